//! Levels of the pen that the user changes while the job waits: the pen's own lines are rewritten from then on.

use super::grbl::words;
use crate::device::Pen;
use crate::emit::decimal;

/// Steps into which the way between the pen's two levels is divided for the user.
const STEPS: f64 = 50.0;
/// A step of a pen on the Z axis, mm.
const Z_STEP: f64 = 0.1;
/// Decimals of levels.
const DECIMALS: usize = 3;
/// Values nearer than this are the same level.
const SAME: f64 = 1e-6;

/// The levels of the pen, as the job has them and as they are now.
#[derive(Clone, Debug)]
pub(super) struct Heights {
    letter: char,
    /// Up and down, in the job.
    written: [f64; 2],
    /// Up and down, now.
    now: [f64; 2],
    /// What a step away from the paper adds.
    step: f64,
    /// Least and greatest value.
    range: [f64; 2],
}

impl Heights {
    pub(super) fn new(pen: Pen) -> Self {
        match pen {
            Pen::Servo { up, down, .. } => {
                let (up, down) = (f64::from(up), f64::from(down));
                let step = ((up - down).abs() / STEPS).round().max(1.0).copysign(up - down);
                Self { letter: 'S', written: [up, down], now: [up, down], step, range: [0.0, 1e5] }
            }
            Pen::Z { up_mm, down_mm, .. } => {
                let levels = [up_mm, down_mm];
                Self { letter: 'Z', written: levels, now: levels, step: Z_STEP, range: [-1e3, 1e3] }
            }
        }
    }

    /// Moves a level by some steps, away from the paper when they are positive; false if up would no more be above down.
    pub(super) fn change(&mut self, down: bool, steps: i32) -> bool {
        let mut levels = self.now;
        levels[usize::from(down)] += f64::from(steps) * self.step;
        let [up, low] = levels;
        let ordered = (up - low) * self.step > 0.0;
        let within = levels.iter().all(|level| (self.range[0]..=self.range[1]).contains(level));
        if ordered && within {
            self.now = levels;
        }
        ordered && within
    }

    /// What the user is told of a level when it was to be changed.
    pub(super) fn told(&self, down: bool, changed: bool) -> String {
        let name = if down { "pen-down" } else { "pen-up" };
        let level = format!("{}{}", self.letter, decimal(self.now[usize::from(down)], DECIMALS));
        if changed {
            format!("the {name} level is {level} from now on")
        } else {
            format!("the {name} level stays at {level}: there is no room that way")
        }
    }

    /// The line that brings a pen that is up to its new level; none for one that waits for the next line of the job.
    pub(super) fn lifted(&self) -> Option<String> {
        (self.letter == 'S').then(|| format!("M3S{}", decimal(self.now[0], DECIMALS)))
    }

    /// A line of the pen with the levels as they are now.
    pub(super) fn rewritten(&self, text: &str) -> String {
        if self.now == self.written {
            return text.to_owned();
        }
        let Some((_, value)) = words(text).find(|(letter, _)| *letter == self.letter) else { return text.to_owned() };
        let (Some(level), Some(at)) = (self.changed(value), text.find(self.letter)) else { return text.to_owned() };
        let (before, rest) = text.split_at(at);
        let after =
            rest.get(1..).and_then(|rest| rest.find(|c: char| c.is_ascii_alphabetic()).and_then(|at| rest.get(at..)));
        format!("{before}{}{}{}", self.letter, decimal(level, DECIMALS), after.unwrap_or_default())
    }

    /// What an S value of the job is now.
    pub(super) fn level(&self, speed: f64) -> f64 {
        if self.letter == 'S' { self.changed(speed).unwrap_or(speed) } else { speed }
    }

    /// What a height of the job is now, mm.
    pub(super) fn height(&self, z: f64) -> f64 {
        if self.letter == 'Z' { self.changed(z).unwrap_or(z) } else { z }
    }

    fn changed(&self, value: f64) -> Option<f64> {
        let at = self.written.iter().position(|level| (level - value).abs() < SAME)?;
        self.now.get(at).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_pens_own_levels_are_rewritten() {
        let mut servo =
            Heights::new(Pen::Servo { index: 0, up: 100, down: 600, raise_s: 0.1, lower_s: 0.1, soft_steps: 1 });
        assert_eq!(servo.rewritten("M3S600"), "M3S600");
        // Ten for a step; up is the lesser value here.
        assert!(servo.change(true, 2) && servo.change(false, -1));
        for (line, expected) in [
            ("M3S600", "M3S580"),
            ("G1G90M3S100", "G1G90M3S110"),
            ("S600M3", "S580M3"),
            ("M3S350", "M3S350"),
            ("G4P0.2", "G4P0.2"),
        ] {
            assert_eq!(servo.rewritten(line), expected);
        }
        assert_eq!((servo.level(600.0), servo.level(7.0), servo.height(100.0)), (580.0, 7.0, 100.0));
        assert_eq!(servo.lifted().as_deref(), Some("M3S110"));
        assert_eq!(servo.told(true, true), "the pen-down level is S580 from now on");
        assert_eq!(servo.told(false, false), "the pen-up level stays at S110: there is no room that way");
        assert!(!servo.change(true, 100), "down would be above up");
        assert!(!servo.change(false, 12), "below what a servo takes");
        assert_eq!(servo.rewritten("M3S600"), "M3S580");
    }

    #[test]
    fn a_pen_on_the_z_axis() {
        let mut z = Heights::new(Pen::Z { up_mm: 3.0, down_mm: 0.0, feed: 1.0, soft_mm: 0.0, soft_feed: 1.0 });
        assert!(z.change(true, -2));
        assert_eq!(z.rewritten("G1Z0F600"), "G1Z-0.2F600");
        assert_eq!(z.rewritten("G90G1Z3F600"), "G90G1Z3F600");
        assert_eq!((z.height(0.0), z.level(0.0), z.lifted()), (-0.2, 0.0, None));
    }
}
