//! How long motion takes: the planner and the segments of the machine, without the machine.

use crate::axis::AXES;
use crate::gcode::Speed;
use crate::planner::Planner;
use crate::settings::Settings;
use crate::stepper::Command;

/// What a machine is that is not this firmware's own, as far as its motion goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mechanics {
    /// Speed of each axis at most, mm/min, positive.
    pub max_rate: [f64; AXES],
    /// Acceleration of each axis, mm/s², positive.
    pub acceleration: [f64; AXES],
    /// Junction deviation, mm.
    pub junction_deviation: f64,
}

/// Plans lines with a look-ahead of `BLOCKS` blocks as the [`Controller`](crate::Controller) does, and tells the time of what the steppers would then be given,
/// segment by segment.
#[derive(Debug)]
pub struct Stopwatch<const BLOCKS: usize> {
    planner: Planner<BLOCKS>,
    settings: Settings,
    /// Lines whose last segment has been told; wraps.
    told: u32,
}

/// A segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slice {
    /// Time that it takes, s.
    pub seconds: f64,
    /// Lines that end with it. Lines that lie on one line may end together.
    pub lines: u16,
}

impl<const BLOCKS: usize> Stopwatch<BLOCKS> {
    /// At rest at the origin.
    #[must_use]
    pub fn new(mechanics: &Mechanics) -> Self {
        let settings = Settings::of(mechanics);
        let mut planner = Planner::new();
        planner.reset([0; AXES], 0, &settings);
        Self { planner, settings, told: 0 }
    }

    /// Whether a line has to wait for the segments of others.
    #[must_use]
    pub fn is_full(&self) -> bool {
        self.planner.is_full(self.told)
    }

    /// Whether all lines have been told.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.planner.is_empty()
    }

    /// Appends the straight line to `target` (mm) at `feed` mm/min along it, or as fast as the axes allow. False if nothing comes of it: it is shorter than a step,
    /// farther than steps can be counted, or [there is no room](Self::is_full); then it is in no slice's lines.
    pub fn append(&mut self, target: [f64; AXES], feed: Option<f64>) -> bool {
        if self.is_full() || !self.settings.reaches(target) {
            return false;
        }
        let before = self.planner.lines_appended();
        self.planner.append(target, feed.map_or(Speed::Rapid, Speed::Feed), None, 0, &self.settings);
        self.planner.lines_appended() != before
    }

    /// Takes the next segment; none if all lines have been told. What is planned ends at rest, until more is appended.
    pub fn advance(&mut self) -> Option<Slice> {
        let Command::Steps(steps) = self.planner.next_segment(false)? else { return None };
        self.told = self.told.wrapping_add(u32::from(steps.lines));
        // Periods are in 2⁻¹⁶ µs.
        let seconds = steps.period as f64 * f64::from(steps.events) / 65_536e6;
        Some(Slice { seconds, lines: steps.lines })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MECHANICS: Mechanics =
        Mechanics { max_rate: [6000.0; AXES], acceleration: [100.0; AXES], junction_deviation: 0.01 };

    fn finish<const BLOCKS: usize>(watch: &mut Stopwatch<BLOCKS>) -> (f64, u32) {
        let mut all = (0.0, 0);
        while let Some(slice) = watch.advance() {
            all = (all.0 + slice.seconds, all.1 + u32::from(slice.lines));
        }
        assert!(watch.is_idle());
        all
    }

    #[test]
    fn one_line_is_a_trapezoid_or_a_triangle() {
        let mut watch: Stopwatch<4> = Stopwatch::new(&MECHANICS);
        // 10 mm/s at 100 mm/s²: 0.1 s up, 0.1 s down, 0.5 mm each.
        assert!(watch.append([11.0, 0.0, 0.0], Some(600.0)));
        let (seconds, lines) = finish(&mut watch);
        assert!((seconds - 1.2).abs() < 1e-5 && lines == 1, "{seconds}");
        assert!(watch.append([11.0, 0.25, 0.0], Some(600.0)));
        let (seconds, lines) = finish(&mut watch);
        assert!((seconds - 0.1).abs() < 1e-5 && lines == 1, "{seconds}");
    }

    #[test]
    fn the_window_bounds_the_speed() {
        // Right angles are nearly stops; gentle bends need the way of a stop in the window.
        let seconds = |blocks: usize| {
            let bend = |k: u32| {
                let angle = f64::from(k) * 0.02;
                [50.0 * libm::sin(angle), 50.0 - 50.0 * libm::cos(angle), 0.0]
            };
            macro_rules! run {
                ($n:literal) => {{
                    let mut watch: Stopwatch<$n> = Stopwatch::new(&MECHANICS);
                    let (mut time, mut lines) = (0.0, 0);
                    for k in 1..=100 {
                        while watch.is_full() {
                            let slice = watch.advance().unwrap();
                            time += slice.seconds;
                            lines += u32::from(slice.lines);
                        }
                        assert!(watch.append(bend(k), Some(3000.0)));
                    }
                    let (rest, others) = finish(&mut watch);
                    assert_eq!(lines + others, 100);
                    time + rest
                }};
            }
            match blocks {
                2 => run!(2),
                8 => run!(8),
                _ => run!(64),
            }
        };
        let (two, eight, many) = (seconds(2), seconds(8), seconds(64));
        assert!(two > 1.1 * eight && eight > many, "{two} {eight} {many}");
    }

    #[test]
    fn what_cannot_be_counted_is_refused() {
        let mut watch: Stopwatch<4> = Stopwatch::new(&MECHANICS);
        assert!(!watch.append([1e9, 0.0, 0.0], Some(600.0)));
        assert!(!watch.append([f64::NAN, 0.0, 0.0], Some(600.0)));
        assert!(!watch.append([1e-4, 0.0, 0.0], None));
        assert_eq!(finish(&mut watch), (0.0, 0));
    }
}
