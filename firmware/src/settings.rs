//! The `$n=value` settings.

use crate::axis::AXES;
use crate::error::Error;

/// Highest step rate of one axis that settings may ask for, in steps per second. Below it a timer of 1 µs keeps a period to 4 %.
pub const MAX_STEP_RATE: f64 = 40_000.0;

/// Everything that `$$` lists. Only [`Settings::set`] changes a value, so all of them are in range. They live in RAM, and every start has the values given to the machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// `$0`: width of a step pulse, µs, 3 to 255.
    pub(crate) pulse_us: u8,
    /// `$1`: ms from the last step until the motors are released, 0 to 255; 255 holds them for ever.
    pub(crate) idle_delay_ms: u8,
    /// `$3`: axes whose direction signal is inverted, bits 0 to 2.
    pub(crate) invert_directions: u8,
    /// `$10`: status report: bit 0 machine (1) or work (0) position, bit 1 buffer fields.
    pub(crate) report_mask: u8,
    /// `$11`: junction deviation, mm, ≥ 0: how far a circle tangent to both lines of a corner stays from its vertex; sets the corner's speed.
    pub(crate) junction_deviation: f64,
    /// `$12`: largest distance between an arc and its chords, mm, > 0.
    pub(crate) arc_tolerance: f64,
    /// `$13`: report positions in inches.
    pub(crate) report_inches: bool,
    /// `$20`: refuse targets outside 0..=travel in X and Y and ±travel in Z (machine coordinates; the start is 0).
    pub(crate) soft_limits: bool,
    /// `$30`: S of the highest pen level, ≥ 0.
    pub(crate) spindle_max: f64,
    /// `$31`: S of the lowest pen level, ≥ 0.
    pub(crate) spindle_min: f64,
    /// `$32`: laser mode: changes of the pen ride with the motion and do not stop it.
    pub(crate) laser_mode: bool,
    /// `$100`–`$102`: steps per mm, > 0.
    pub(crate) steps_per_mm: [f64; AXES],
    /// `$110`–`$112`: maximum rate, mm/min, > 0.
    pub(crate) max_rate: [f64; AXES],
    /// `$120`–`$122`: acceleration, mm/s², > 0.
    pub(crate) acceleration: [f64; AXES],
    /// `$130`–`$132`: travel, mm, > 0.
    pub(crate) travel: [f64; AXES],
}

impl Default for Settings {
    /// An A3 plotter with 80 steps per mm.
    fn default() -> Self {
        Self {
            pulse_us: 10,
            idle_delay_ms: 255,
            invert_directions: 0,
            report_mask: 3,
            junction_deviation: 0.01,
            arc_tolerance: 0.002,
            report_inches: false,
            soft_limits: false,
            spindle_max: 1000.0,
            spindle_min: 0.0,
            laser_mode: false,
            steps_per_mm: [80.0, 80.0, 80.0],
            max_rate: [12_000.0, 12_000.0, 3_000.0],
            acceleration: [1000.0, 1000.0, 500.0],
            travel: [430.0, 310.0, 50.0],
        }
    }
}

/// The numbers that `$$` lists, in its order.
pub(crate) const SETTING_IDS: [u16; 23] =
    [0, 1, 3, 10, 11, 12, 13, 20, 30, 31, 32, 100, 101, 102, 110, 111, 112, 120, 121, 122, 130, 131, 132];

impl Settings {
    /// The value of `$id` and the decimals it is printed with, or `None` for a number that is not a setting.
    #[must_use]
    pub fn get(&self, id: u16) -> Option<(f64, u8)> {
        Some(match id {
            0 => (f64::from(self.pulse_us), 0),
            1 => (f64::from(self.idle_delay_ms), 0),
            3 => (f64::from(self.invert_directions), 0),
            10 => (f64::from(self.report_mask), 0),
            11 => (self.junction_deviation, 3),
            12 => (self.arc_tolerance, 3),
            13 => (f64::from(u8::from(self.report_inches)), 0),
            20 => (f64::from(u8::from(self.soft_limits)), 0),
            30 => (self.spindle_max, 3),
            31 => (self.spindle_min, 3),
            32 => (f64::from(u8::from(self.laser_mode)), 0),
            100..=132 => (*self.table(id)?, 3),
            _ => return None,
        })
    }

    /// Sets `$id`.
    ///
    /// # Errors
    /// [`Error::InvalidStatement`] for an unknown number, [`Error::NegativeValue`] for a value outside the range in the field's documentation (`$30` …),
    /// [`Error::PulseTooShort`], [`Error::HomingDisabled`] for `$22`, and [`Error::StepRateTooHigh`] when an axis
    /// would exceed [`MAX_STEP_RATE`]. The settings are unchanged then.
    pub fn set(&mut self, id: u16, value: f64) -> Result<(), Error> {
        if !value.is_finite() || value < 0.0 {
            return Err(Error::NegativeValue);
        }
        match id {
            0 if value < 3.0 => return Err(Error::PulseTooShort),
            0 => self.pulse_us = byte(value)?,
            1 => self.idle_delay_ms = byte(value)?,
            3 => self.invert_directions = byte(value)? & 0b111,
            10 => self.report_mask = byte(value)?,
            11 => self.junction_deviation = value,
            12 => self.arc_tolerance = positive(value)?,
            13 => self.report_inches = value != 0.0,
            20 => self.soft_limits = value != 0.0,
            22 => return Err(Error::HomingDisabled),
            30 => self.spindle_max = value,
            31 => self.spindle_min = value,
            32 => self.laser_mode = value != 0.0,
            100..=132 => {
                let mut changed = self.clone();
                *changed.table_mut(id).ok_or(Error::InvalidStatement)? = positive(value)?;
                if (0..AXES).any(|a| changed.steps_per_mm[a] * changed.max_rate[a] > MAX_STEP_RATE * 60.0) {
                    return Err(Error::StepRateTooHigh);
                }
                *self = changed;
            }
            _ => return Err(Error::InvalidStatement),
        }
        Ok(())
    }

    /// Steps per mm of each axis (`$100`–`$102`).
    #[must_use]
    pub fn steps_per_mm(&self) -> [f64; AXES] {
        self.steps_per_mm
    }

    fn table(&self, id: u16) -> Option<&f64> {
        let axis = usize::from(id % 10);
        match id / 10 {
            10 => self.steps_per_mm.get(axis),
            11 => self.max_rate.get(axis),
            12 => self.acceleration.get(axis),
            13 => self.travel.get(axis),
            _ => None,
        }
    }

    fn table_mut(&mut self, id: u16) -> Option<&mut f64> {
        let axis = usize::from(id % 10);
        match id / 10 {
            10 => self.steps_per_mm.get_mut(axis),
            11 => self.max_rate.get_mut(axis),
            12 => self.acceleration.get_mut(axis),
            13 => self.travel.get_mut(axis),
            _ => None,
        }
    }

    /// Whether `target` (machine mm) lies in the travel, or soft limits are off.
    pub(crate) fn in_travel(&self, target: [f64; AXES]) -> bool {
        !self.soft_limits
            || ((0.0..=self.travel[0]).contains(&target[0])
                && (0.0..=self.travel[1]).contains(&target[1])
                && target[2].abs() <= self.travel[2])
    }
}

/// Scales and limits below a millionth are as senseless as zero, and would overflow what is computed from them in f32.
fn positive(value: f64) -> Result<f64, Error> {
    if (1e-6..=1e9).contains(&value) { Ok(value) } else { Err(Error::NegativeValue) }
}

fn byte(value: f64) -> Result<u8, Error> {
    if value <= 255.0 { Ok(value as u8) } else { Err(Error::NegativeValue) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_listed_setting_reads_back() {
        let mut s = Settings::default();
        for id in SETTING_IDS {
            let (value, _) = s.get(id).unwrap();
            s.set(id, value).unwrap();
        }
        assert_eq!(s, Settings::default());
        s.set(101, 40.0).unwrap();
        assert_eq!(s.steps_per_mm, [80.0, 40.0, 80.0]);
    }

    #[test]
    fn refusals() {
        let mut s = Settings::default();
        for (id, value, error) in [
            (0, 2.0, Error::PulseTooShort),
            (0, 300.0, Error::NegativeValue),
            (11, -1.0, Error::NegativeValue),
            (12, 0.0, Error::NegativeValue),
            (22, 1.0, Error::HomingDisabled),
            (99, 1.0, Error::InvalidStatement),
            (103, 1.0, Error::InvalidStatement),
            (100, 0.0, Error::NegativeValue),
            (100, 1000.0, Error::StepRateTooHigh),
            (110, 1e6, Error::StepRateTooHigh),
            (120, f64::NAN, Error::NegativeValue),
        ] {
            assert_eq!(s.set(id, value), Err(error), "${id}={value}");
        }
        assert_eq!(s, Settings::default());
    }
}
