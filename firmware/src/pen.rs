//! The pen: what M3, M5 and S ask of it, and how it gets there.

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

/// How the pen moves where it moves by itself. Speeds are in levels (of [`Pen::On`]) a second; 0: at once.
///
/// The stepper makes the ramp and waits for its end, so that no sender has to dwell: a servo is led down gently instead of dropped. In laser mode (`$32=1`) changes
/// of the pen ride with the motion, and nothing of this holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct PenMotion {
    /// While the level rises (`$510`).
    pub rise: u32,
    /// While it falls (`$511`); [`Pen::Off`] counts as level 0.
    pub fall: u32,
    /// From the end of that until steps go on, ms (`$512`): what the mechanics lag behind, or what a solenoid takes to pull in.
    pub settle_ms: u16,
}

/// A pen on its way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ramp {
    to: Pen,
    /// Now, in 2⁻¹⁶ levels.
    level: u64,
    /// The same of each further step; 0: there at once.
    step: u64,
}

/// Time of a step of the ramp, µs: half a frame of a servo, which takes a new width once a frame.
pub(crate) const RAMP_STEP_US: u32 = 10_000;

impl Pen {
    /// [`Pen::Off`] counts as 0.
    fn level(self) -> u16 {
        match self {
            Self::Off => 0,
            Self::On { level } => level,
        }
    }
}

impl Ramp {
    pub(crate) fn new(from: Pen, to: Pen, motion: PenMotion) -> Self {
        let rate = if to.level() > from.level() { motion.rise } else { motion.fall };
        // Up, so that the last step is not left with what rounding took from the others; none only for no speed.
        let step = ((u64::from(rate) << 16) * u64::from(RAMP_STEP_US)).div_ceil(1_000_000);
        Self { to, level: u64::from(from.level()) << 16, step }
    }

    /// The pen after another [`RAMP_STEP_US`], and whether it has arrived.
    pub(crate) fn next(&mut self) -> (Pen, bool) {
        let to = u64::from(self.to.level()) << 16;
        if self.step == 0 || self.level.abs_diff(to) <= self.step {
            return (self.to, true);
        }
        self.level = if self.level < to { self.level + self.step } else { self.level - self.step };
        // Below that of a u16.
        (Pen::On { level: (self.level >> 16) as u16 }, false)
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
    fn ramps_arrive_in_their_time() {
        // The whole range in half a second: fifty steps of 10 ms.
        let motion = PenMotion { rise: 131_070, fall: 0, settle_ms: 0 };
        let mut ramp = Ramp::new(Pen::Off, Pen::On { level: 65_535 }, motion);
        let mut last = 0;
        for step in 1..50 {
            let (pen, arrived) = ramp.next();
            assert!(!arrived && pen.level() - last <= 1311 && pen.level() - last >= 1310, "{step}: {pen:?}");
            last = pen.level();
        }
        assert_eq!(ramp.next(), (Pen::On { level: 65_535 }, true));
        assert_eq!(Ramp::new(Pen::On { level: 65_535 }, Pen::Off, motion).next(), (Pen::Off, true));
        let slow = PenMotion { rise: 1, fall: 1, settle_ms: 0 };
        let mut ramp = Ramp::new(Pen::On { level: 2 }, Pen::Off, slow);
        let steps = 1 + (0..1000).take_while(|_| !ramp.next().1).count();
        assert!((199..=202).contains(&steps), "{steps} steps of 10 ms for 2 levels at 1 a second");
    }
}
