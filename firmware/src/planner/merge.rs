//! Runs of lines that lie on one line, which become one block.
//!
//! Chords of a curve are often shorter than the way in which the machine stops, and then the blocks of the planner end before that
//! way does: it would have to draw slowly for want of foresight. Most such chords differ from one long line by less than the machine resolves.
//!
//! ```text
//!                          ╱ left       A point at distance d, which the line from the start must pass within τ, allows the directions within
//!         ●  ·  ╱  (  )●               asin(τ/d) of its own. What all points of the run allow together is a sector.
//!  start ●══════════════╪═══▶ new      A new point is taken if it lies in the sector, and farther from the start than the last: so each point
//!            ●  ╲   (  )                before it is passed in its order, within τ.
//!                  ╲ right
//! ```
//!
//! τ is half a step of the finer of the two motors, but no more than the junction deviation: chords of a circle of radius r that leave it by s meet at an
//! angle for which that allows the speed √(a·r·δ/s), and it shall not be less than the circle's own √(a·r).
//!
//! Lines are judged by what the motors wind, since it is for them that a block is straight. Only lines of one speed are put together, with the pen as it is and Z at rest.

use super::block::Tail;
use crate::axis::AXES;
use crate::settings::Settings;

/// The lines in the last block. Lengths are in mm, directions are unit vectors, and all of it is seen from the beginning of the block.
#[derive(Clone, Debug)]
pub(super) struct Run {
    /// The machine stood still when the block was appended.
    pub(super) from_rest: bool,
    /// How far from the block a point may be.
    tolerance: f32,
    /// The edges of the sector; none as long as all points are within the tolerance of the start.
    sector: Option<Sector>,
    last: [f32; 2],
}

/// Directions between two, by way of the left.
#[derive(Clone, Copy, Debug)]
struct Sector {
    right: [f32; 2],
    left: [f32; 2],
}

impl Run {
    /// A run of one line, from `start` to `end`; none if it moves Z, or nothing may join it.
    pub(super) fn new(start: &Tail, end: &Tail, from_rest: bool, settings: &Settings) -> Option<Self> {
        let step = 1.0 / settings.steps_per_mm[0].max(settings.steps_per_mm[1]);
        let tolerance = (0.5 * step).min(settings.junction_deviation) as f32;
        let mut run = Self { from_rest, tolerance, sector: None, last: [0.0; 2] };
        (offset(start, end).is_some() && tolerance > 0.0).then(|| {
            run.add(start, end);
            run
        })
    }

    /// Whether the block may end at `end` instead.
    pub(super) fn takes(&self, start: &Tail, end: &Tail) -> bool {
        let Some(to) = offset(start, end) else { return false };
        let onward = dot(to, to) >= dot(self.last, self.last);
        onward
            && self
                .sector
                .is_none_or(|s| cross(s.right, to) >= 0.0 && cross(to, s.left) >= 0.0 && dot(self.last, to) > 0.0)
    }

    /// Takes `end` for a point of the run.
    pub(super) fn add(&mut self, start: &Tail, end: &Tail) {
        let Some(to) = offset(start, end) else { return };
        self.last = to;
        let distance = libm::sqrtf(dot(to, to));
        if distance <= self.tolerance {
            return;
        }
        let sin = self.tolerance / distance;
        let cos = libm::sqrtf(1.0 - sin * sin);
        let unit = to.map(|v| v / distance);
        let right = [unit[0] * cos + unit[1] * sin, unit[1] * cos - unit[0] * sin];
        let left = [unit[0] * cos - unit[1] * sin, unit[1] * cos + unit[0] * sin];
        self.sector = Some(match self.sector {
            None => Sector { right, left },
            Some(old) => Sector {
                right: if cross(old.right, right) > 0.0 { right } else { old.right },
                left: if cross(old.left, left) < 0.0 { left } else { old.left },
            },
        });
    }
}

/// What the first two motors wind from `start` to `end`; none if Z moves.
fn offset(start: &Tail, end: &Tail) -> Option<[f32; 2]> {
    const { assert!(AXES == 3) };
    (start.motors[2] == end.motors[2]).then(|| [0, 1].map(|motor| (end.motors[motor] - start.motors[motor]) as f32))
}

fn dot(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: [f32; 2], b: [f32; 2]) -> f32 {
    a[0] * b[1] - a[1] * b[0]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use std::vec::Vec;

    fn at(x: f64, y: f64) -> Tail {
        Tail { motors: [x, y, 0.0], ..Tail::default() }
    }

    /// How many of `points` become one block from the origin on.
    fn taken(points: &[(f64, f64)], settings: &Settings) -> usize {
        let start = at(0.0, 0.0);
        let mut run = Run::new(&start, &at(points[0].0, points[0].1), false, settings).unwrap();
        let mut count = 1;
        for &(x, y) in &points[1..] {
            let end = at(x, y);
            if !run.takes(&start, &end) {
                break;
            }
            run.add(&start, &end);
            count += 1;
        }
        count
    }

    #[test]
    fn chords_of_a_circle_by_closed_form() {
        // Half a step is 1/160 mm. The first chord is l long, and a point at angle t of the circle is off it by r·(1 − cos t) or so: the sector
        // closes where the arc's height over the chord is τ, at t = √(8τ/r).
        let settings = Settings::default();
        for r in [1.0, 10.0, 100.0] {
            let turn = 0.01 / r;
            let points: Vec<_> = (1..20_000)
                .map(|k| f64::from(k) * turn)
                .map(|t| (r * libm::sin(t), r * (1.0 - libm::cos(t))))
                .collect();
            let angle = taken(&points, &settings) as f64 * turn;
            let expect = libm::sqrt(8.0 * 0.5 / 80.0 / r);
            assert!((angle / expect - 1.0).abs() < 0.03, "radius {r}: {angle} of {expect}");
        }
    }

    #[test]
    fn what_is_no_line_is_not_taken() {
        let settings = Settings::default();
        assert_eq!(taken(&[(1.0, 0.0), (2.0, 0.0), (3.0, 0.006), (4.0, 0.0)], &settings), 4);
        assert_eq!(taken(&[(1.0, 0.0), (2.0, 0.02)], &settings), 1);
        assert_eq!(taken(&[(1.0, 0.0), (0.5, 0.0)], &settings), 1);
        assert_eq!(taken(&[(0.001, 0.0), (-0.002, 0.0), (0.0, 5.0), (0.0, 6.0)], &settings), 4);
        let lifted = Tail { motors: [1.0, 0.0, 0.1], ..Tail::default() };
        assert!(Run::new(&at(0.0, 0.0), &lifted, false, &settings).is_none());
        assert!(!Run::new(&at(0.0, 0.0), &at(0.9, 0.0), false, &settings).unwrap().takes(&at(0.0, 0.0), &lifted));
    }

    proptest! {
        /// Every point is passed within the tolerance, one after the other.
        #[test]
        fn no_point_is_left_aside(
            turns in prop::collection::vec((-0.1..0.1f64, 0.0005..0.3f64), 2..60), deviation in 0.001..0.02f64,
        ) {
            let mut settings = Settings::default();
            settings.set(11, deviation).unwrap();
            let (mut heading, mut at) = (0.0, (0.0, 0.0));
            let points: Vec<_> = turns.into_iter().map(|(turn, way)| {
                heading += turn;
                at = (at.0 + way * libm::cos(heading), at.1 + way * libm::sin(heading));
                at
            }).collect();
            let points = &points[..taken(&points, &settings)];
            let end = points[points.len() - 1];
            let length = libm::hypot(end.0, end.1);
            let tolerance = deviation.min(0.5 / 80.0);
            for p in points {
                let along = (p.0 * end.0 + p.1 * end.1) / length;
                let off = ((p.0 * end.1 - p.1 * end.0) / length).abs();
                // Coordinates of some mm in f32.
                prop_assert!(off <= tolerance + 1e-5, "{:?} is {} off", p, off);
                prop_assert!((-1e-5 - tolerance..=length + 1e-5).contains(&along));
            }
        }
    }
}
