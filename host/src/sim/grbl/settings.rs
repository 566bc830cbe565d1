//! The `$n=value` settings, which outlive a reset.

use std::fmt::Write;

use super::words::{INVALID_STATEMENT, NEGATIVE, Refusal, SETTING_DISABLED, SOFT_LIMIT_NEEDS_HOMING, STEP_PULSE};

/// Number, value at first, and whether it has decimals. A plotter for A3, not GRBL's generic mill.
const SETTINGS: [(u8, f32, bool); 34] = [
    (0, 10.0, false),
    (1, 25.0, false),
    (2, 0.0, false),
    (3, 0.0, false),
    (4, 0.0, false),
    (5, 0.0, false),
    (6, 0.0, false),
    (10, 1.0, false),
    (11, 0.01, true),
    (12, 0.002, true),
    (13, 0.0, false),
    (20, 0.0, false),
    (21, 0.0, false),
    (22, 0.0, false),
    (23, 0.0, false),
    (24, 25.0, true),
    (25, 500.0, true),
    (26, 250.0, false),
    (27, 1.0, true),
    (30, 1000.0, false),
    (31, 0.0, false),
    (32, 0.0, false),
    (100, 80.0, true),
    (101, 80.0, true),
    (102, 80.0, true),
    (110, 5000.0, true),
    (111, 5000.0, true),
    (112, 1000.0, true),
    (120, 500.0, true),
    (121, 500.0, true),
    (122, 100.0, true),
    (130, 420.0, true),
    (131, 297.0, true),
    (132, 20.0, true),
];

/// Settings that are switches: 0 or not 0.
const SWITCHES: [u8; 8] = [4, 5, 6, 13, 20, 21, 22, 32];

/// The settings in force.
#[derive(Clone, Debug)]
pub(super) struct Settings([f32; SETTINGS.len()]);

impl Default for Settings {
    fn default() -> Self {
        Self(SETTINGS.map(|(_, value, _)| value))
    }
}

impl Settings {
    /// The value of `$number`; 0 for one that there is not.
    pub(super) fn get(&self, number: u8) -> f32 {
        SETTINGS.iter().zip(self.0).find(|((n, ..), _)| *n == number).map_or(0.0, |(_, value)| value)
    }

    /// Whether a switch is on.
    pub(super) fn is_on(&self, number: u8) -> bool {
        self.get(number) != 0.0
    }

    /// `$first`, `$first+1` and `$first+2`.
    pub(super) fn axes(&self, first: u8) -> [f32; 3] {
        [self.get(first), self.get(first + 1), self.get(first + 2)]
    }

    /// Sets `$number`.
    pub(super) fn set(&mut self, number: u8, value: f32) -> Result<(), Refusal> {
        let index = SETTINGS.iter().position(|(n, ..)| *n == number).ok_or(INVALID_STATEMENT)?;
        let (_, _, decimals) = SETTINGS[index];
        if value < 0.0 {
            return Err(NEGATIVE);
        }
        // What it is divided by may not be 0.
        if (100..130).contains(&number) && value == 0.0 {
            return Err(NEGATIVE);
        }
        match number {
            0 if value < 3.0 => return Err(STEP_PULSE),
            20 if value != 0.0 && !self.is_on(22) => return Err(SOFT_LIMIT_NEEDS_HOMING),
            _ => {}
        }
        // Without homing there are no soft limits.
        if number == 22
            && value == 0.0
            && let Some(soft) = SETTINGS.iter().position(|(n, ..)| *n == 20)
        {
            self.0[soft] = 0.0;
        }
        self.0[index] = match (decimals, SWITCHES.contains(&number)) {
            (true, _) => value,
            (false, true) => f32::from(value != 0.0),
            (false, false) => value.trunc(),
        };
        Ok(())
    }

    /// Homing, if it is switched on.
    pub(super) fn homing(&self) -> Result<(), Refusal> {
        if self.is_on(22) { Ok(()) } else { Err(SETTING_DISABLED) }
    }

    /// What `$$` lists.
    pub(super) fn list(&self) -> String {
        let mut text = String::new();
        for ((number, _, decimals), value) in SETTINGS.iter().zip(self.0) {
            // Writing to a string cannot fail.
            let _ = if *decimals {
                write!(text, "${number}={value:.3}\r\n")
            } else {
                write!(text, "${number}={value}\r\n")
            };
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_checked() {
        let mut s = Settings::default();
        for (number, value, refusal) in [
            (7, 1.0, INVALID_STATEMENT),
            (0, 2.0, STEP_PULSE),
            (110, -1.0, NEGATIVE),
            (100, 0.0, NEGATIVE),
            (20, 1.0, SOFT_LIMIT_NEEDS_HOMING),
        ] {
            assert_eq!(s.set(number, value), Err(refusal), "${number}={value}");
        }
        s.set(22, 1.0).unwrap();
        s.set(20, 5.0).unwrap();
        assert!(s.list().contains("$20=1\r\n") && s.list().contains("$100=80.000\r\n"));
        s.set(22, 0.0).unwrap();
        assert!(!s.is_on(20));
    }
}
