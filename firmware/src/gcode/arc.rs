//! Arcs and helices as chords.

use crate::axis::AXES;
use crate::error::Error;
use crate::gcode::{Plane, Speed};

/// An arc whose ends differ by less than this angle (rad) is a full turn: the start of an incremental circle carries rounding,
/// and a real arc this short is far below a step. GRBL uses the same value.
const FULL_TURN_ANGLE: f64 = 5e-7;

/// What determines an arc besides its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Centre {
    /// I, J, K in the plane's two axes, from the start, mm.
    Offset([f64; 2]),
    /// R, mm; negative for the way round that exceeds half a turn.
    Radius(f64),
}

/// The chords of an arc that remain to be drawn; an iterator over their end points in machine mm.
///
/// The unit vector from the centre is turned by a fixed rotation for each chord: four multiplications instead of a sine and a cosine.
/// Its relative error grows by about 2⁻⁵² a chord, so even a million chords of a circle of 1 m stay within a nanometre, and the last point is the target itself.
#[derive(Clone, Debug)]
pub(crate) struct Arc {
    axes: [usize; AXES],
    centre: [f64; 2],
    /// cos and sin of the current angle, and of the angle of a chord.
    unit: [f64; 2],
    turn: [f64; 2],
    /// At the start and at the end; they differ by the rounding of the program.
    radii: [f64; 2],
    start: [f64; AXES],
    target: [f64; AXES],
    done: u32,
    chords: u32,
    /// mm of path.
    length: f64,
    pub(crate) speed: Speed,
}

impl Arc {
    /// The arc from `start` to `target` (machine mm, finite) within `tolerance` mm of its chords.
    ///
    /// # Errors
    /// [`Error::InvalidTarget`] when the two radii differ by more than 0.5 mm, or by more than both 0.005 mm and 0.1 %, or an arc by radius ends where it starts;
    /// [`Error::ArcRadius`] when no circle of that radius reaches the end.
    pub(crate) fn new(
        start: [f64; AXES],
        target: [f64; AXES],
        plane: Plane,
        centre: Centre,
        clockwise: bool,
        tolerance: f64,
        speed: Speed,
    ) -> Result<Self, Error> {
        let axes = plane.axes();
        let [a, b, _] = axes;
        let chord = [target[a] - start[a], target[b] - start[b]];
        let offset = match centre {
            Centre::Offset(offset) => offset,
            Centre::Radius(r) => centre_of_radius(chord, r, clockwise)?,
        };
        let from = [-offset[0], -offset[1]];
        let to = [chord[0] - offset[0], chord[1] - offset[1]];
        let radii = [libm::hypot(from[0], from[1]), libm::hypot(to[0], to[1])];
        let differ = (radii[1] - radii[0]).abs();
        if radii[0] == 0.0 || differ > 0.5 || (differ > 0.005 && differ > 0.001 * radii[0]) {
            return Err(Error::InvalidTarget);
        }
        let tau = 2.0 * core::f64::consts::PI;
        let mut angle = libm::atan2(from[0] * to[1] - from[1] * to[0], from[0] * to[0] + from[1] * to[1]);
        if clockwise {
            if angle >= -FULL_TURN_ANGLE {
                angle -= tau;
            }
        } else if angle <= FULL_TURN_ANGLE {
            angle += tau;
        }
        // A chord of half-angle α leaves the circle by r(1 − cos α) = 2r sin²(α/2); at most a third of a turn for a chord.
        let radius = radii[0].max(radii[1]);
        let half = (2.0 * libm::asin(libm::sqrt((tolerance / (2.0 * radius)).min(1.0)))).min(tau / 6.0);
        let chords = (libm::ceil(angle.abs() / (2.0 * half)) as u32).max(1);
        let step = angle / f64::from(chords);
        let rise = target[plane.axes()[2]] - start[plane.axes()[2]];
        let length = libm::hypot(angle * (radii[0] + radii[1]) / 2.0, rise);
        Ok(Self {
            axes,
            centre: [start[a] + offset[0], start[b] + offset[1]],
            unit: [from[0] / radii[0], from[1] / radii[0]],
            turn: [libm::cos(step), libm::sin(step)],
            radii,
            start,
            target,
            done: 0,
            chords,
            length,
            speed,
        })
    }

    /// The length of the path, mm.
    pub(crate) fn length(&self) -> f64 {
        self.length
    }

    /// The largest absolute coordinate the arc can reach in its plane, mm.
    pub(crate) fn reach(&self) -> f64 {
        self.centre[0].abs().max(self.centre[1].abs()) + self.radii[0].max(self.radii[1])
    }
}

impl Iterator for Arc {
    type Item = [f64; AXES];

    fn next(&mut self) -> Option<Self::Item> {
        if self.done >= self.chords {
            return None;
        }
        self.done += 1;
        if self.done == self.chords {
            return Some(self.target);
        }
        let [c, s] = self.unit;
        let [tc, ts] = self.turn;
        self.unit = [c * tc - s * ts, s * tc + c * ts];
        let t = f64::from(self.done) / f64::from(self.chords);
        let r = self.radii[0] + (self.radii[1] - self.radii[0]) * t;
        let [a, b, h] = self.axes;
        let mut point = self.target;
        point[a] = self.centre[0] + r * self.unit[0];
        point[b] = self.centre[1] + r * self.unit[1];
        point[h] = self.start[h] + (self.target[h] - self.start[h]) * t;
        Some(point)
    }
}

/// The centre, from the start, of the circle of radius |`r`| through both ends of `chord`.
fn centre_of_radius(chord: [f64; 2], r: f64, clockwise: bool) -> Result<[f64; 2], Error> {
    let d = libm::hypot(chord[0], chord[1]);
    if d == 0.0 {
        return Err(Error::InvalidTarget);
    }
    let height_squared = r * r - d * d / 4.0;
    // Half a turn written with rounded ends falls short by that rounding; GRBL refuses it too.
    if height_squared < 0.0 {
        return Err(Error::ArcRadius);
    }
    // The centre of the shorter arc lies left of the chord when counter-clockwise.
    let left = if clockwise == (r > 0.0) { -1.0 } else { 1.0 };
    let k = left * libm::sqrt(height_squared) / d;
    Ok([chord[0] / 2.0 - k * chord[1], chord[1] / 2.0 + k * chord[0]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn arc(start: [f64; 2], end: [f64; 2], centre: Centre, clockwise: bool, tolerance: f64) -> Result<Arc, Error> {
        let lift = |p: [f64; 2]| [p[0], p[1], 0.0];
        Arc::new(lift(start), lift(end), Plane::Xy, centre, clockwise, tolerance, Speed::Rapid)
    }

    #[test]
    fn quarter_passes_its_middle() {
        let points: std::vec::Vec<_> =
            arc([10.0, 0.0], [0.0, 10.0], Centre::Offset([-10.0, 0.0]), false, 0.01).unwrap().collect();
        assert_eq!(points.last(), Some(&[0.0, 10.0, 0.0]));
        assert!(points.iter().all(|p| p[0] >= 0.0 && p[1] > 0.0));
        let points: std::vec::Vec<_> =
            arc([10.0, 0.0], [0.0, 10.0], Centre::Offset([-10.0, 0.0]), true, 0.01).unwrap().collect();
        assert!(points.iter().any(|p| p[1] < -9.9), "clockwise takes the long way");
    }

    #[test]
    fn radius_takes_the_short_way_and_minus_the_long() {
        for (r, clockwise, long) in
            [(10.0, false, false), (10.0, true, false), (-10.0, false, true), (-10.0, true, true)]
        {
            let a = arc([0.0, 0.0], [10.0, 0.0], Centre::Radius(r), clockwise, 0.001).unwrap();
            let mut last = [0.0; 2];
            let length: f64 = a
                .map(|p| {
                    let d = libm::hypot(p[0] - last[0], p[1] - last[1]);
                    last = [p[0], p[1]];
                    d
                })
                .sum();
            let short = 10.0 * core::f64::consts::PI / 3.0;
            let expect = if long { 20.0 * core::f64::consts::PI - short } else { short };
            assert!((length - expect).abs() < 0.05, "R{r} clockwise {clockwise}: {length}");
        }
    }

    #[test]
    fn refusals() {
        assert_eq!(arc([0.0; 2], [10.0, 0.0], Centre::Radius(4.9), true, 0.01).err(), Some(Error::ArcRadius));
        assert_eq!(arc([0.0; 2], [0.0; 2], Centre::Radius(5.0), true, 0.01).err(), Some(Error::InvalidTarget));
        assert_eq!(
            arc([0.0; 2], [10.0, 0.0], Centre::Offset([4.0, 0.0]), true, 0.01).err(),
            Some(Error::InvalidTarget)
        );
        assert_eq!(arc([0.0; 2], [0.0; 2], Centre::Offset([0.0; 2]), true, 0.01).err(), Some(Error::InvalidTarget));
    }

    proptest! {
        #[test]
        fn chords_stay_within_tolerance(
            cx in -100.0..100.0f64, cy in -100.0..100.0f64, r in 0.01..300.0f64,
            from in 0.0..6.0f64, sweep in 0.001..6.2f64, clockwise: bool, tolerance in 0.001..0.2f64,
        ) {
            let at = |t: f64| [cx + r * libm::cos(t), cy + r * libm::sin(t)];
            let (start, end) = (at(from), at(if clockwise { from - sweep } else { from + sweep }));
            let a = arc(start, end, Centre::Offset([cx - start[0], cy - start[1]]), clockwise, tolerance).unwrap();
            let mut last = start;
            let mut turned = 0.0;
            for p in a {
                let middle = [(last[0] + p[0]) / 2.0, (last[1] + p[1]) / 2.0];
                let on = libm::hypot(p[0] - cx, p[1] - cy);
                let sagitta = r - libm::hypot(middle[0] - cx, middle[1] - cy);
                prop_assert!((on - r).abs() < 1e-9 * (100.0 + r));
                prop_assert!(sagitta <= tolerance * (1.0 + 1e-9) + 1e-9);
                let (u, v) = ([last[0] - cx, last[1] - cy], [p[0] - cx, p[1] - cy]);
                turned += libm::atan2(u[0] * v[1] - u[1] * v[0], u[0] * v[0] + u[1] * v[1]);
                last = [p[0], p[1]];
            }
            prop_assert_eq!(last, end);
            prop_assert!((turned.abs() - sweep).abs() < 1e-6 * (1.0 + 100.0 / r));
            prop_assert_eq!(turned < 0.0, clockwise);
        }
    }
}
