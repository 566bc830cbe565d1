//! The pen: what M3, M5 and S ask of it, and the servo pulse that does it.

use crate::settings::Settings;

/// What the pen is told to do. A pen on the Z axis needs none of this: its moves are ordinary steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pen {
    /// M5, reset or the end of the program: the rest position, up.
    #[default]
    Off,
    /// M3 or M4 with a level: 0 for S at or below `$31`, `u16::MAX` for S at or above `$30`, linear between.
    On {
        /// Position between the two ends, 0 to 65535.
        level: u16,
    },
}

impl Pen {
    /// The pen of M3 with spindle word `s`, by `$30` and `$31`. An empty or reversed range gives the full level for any `s` at or above `$30`.
    #[must_use]
    pub fn from_speed(s: f64, settings: &Settings) -> Self {
        let (low, high) = (settings.spindle_min, settings.spindle_max);
        let level = if s >= high {
            u16::MAX
        } else if s <= low {
            0
        } else {
            // low < s < high, so the quotient lies in (0, 1).
            libm::round((s - low) / (high - low) * f64::from(u16::MAX)) as u16
        };
        Self::On { level }
    }
}

/// Widths of a hobby servo's pulse, in µs, and the frame they repeat in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Servo {
    /// Frame in µs; 20000 (50 Hz) for nearly every servo.
    pub frame_us: u16,
    /// Pulse for [`Pen::Off`], µs.
    pub rest_us: u16,
    /// Pulse for level 0, µs.
    pub low_us: u16,
    /// Pulse for level 65535, µs. May be below `low_us` for a servo that turns the other way.
    pub high_us: u16,
}

impl Default for Servo {
    fn default() -> Self {
        Self { frame_us: 20_000, rest_us: 1000, low_us: 1000, high_us: 2000 }
    }
}

impl Servo {
    /// Width of the pulse for `pen` in µs.
    #[must_use]
    pub fn pulse_us(&self, pen: Pen) -> u16 {
        match pen {
            Pen::Off => self.rest_us,
            Pen::On { level } => {
                let (low, high) = (i64::from(self.low_us), i64::from(self.high_us));
                // Between low and high, both u16.
                (low + (high - low) * i64::from(level) / i64::from(u16::MAX)) as u16
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speed_maps_between_31_and_30() {
        let s = Settings { spindle_min: 200.0, spindle_max: 1000.0, ..Settings::default() };
        for (speed, level) in [(0.0, 0), (200.0, 0), (600.0, 32768), (1000.0, 65535), (5000.0, 65535)] {
            assert_eq!(Pen::from_speed(speed, &s), Pen::On { level }, "S{speed}");
        }
        let s = Settings { spindle_min: 5.0, spindle_max: 5.0, ..Settings::default() };
        assert_eq!(Pen::from_speed(5.0, &s), Pen::On { level: 65535 });
        assert_eq!(Pen::from_speed(4.0, &s), Pen::On { level: 0 });
    }

    #[test]
    fn servo_pulse_is_linear_either_way() {
        let mut servo = Servo::default();
        assert_eq!(servo.pulse_us(Pen::Off), 1000);
        assert_eq!(servo.pulse_us(Pen::On { level: 65535 }), 2000);
        servo.low_us = 2400;
        servo.high_us = 600;
        assert_eq!(servo.pulse_us(Pen::On { level: 0 }), 2400);
        assert_eq!(servo.pulse_us(Pen::On { level: 65535 }), 600);
    }
}
