//! Arcs as chords, within the tolerance that `$12` allows.

use super::gcode::Place;
use super::words::{ARC_RADIUS, INVALID_TARGET, NO_AXIS_IN_PLANE, NO_AXIS_WORDS, NO_OFFSETS, Refusal};

/// Ends nearer than this angle in radians make a full circle.
const FULL_CIRCLE: f32 = 5e-7;
/// More chords than this are no plotter's arc.
const CHORDS_MAX: f32 = 100_000.0;

/// G2 or G3, in machine mm.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arc {
    pub(super) from: Place,
    pub(super) to: Place,
    /// 0: XY, 1: ZX, 2: YZ.
    pub(super) plane: u8,
    pub(super) clockwise: bool,
}

impl Arc {
    /// The ends of its chords; the last is its own end. `named` are the axes that the block names, `offsets` I, J and K, `radius` R, in mm.
    pub(super) fn chords(
        &self,
        named: [bool; 3],
        offsets: [Option<f32>; 3],
        radius: Option<f32>,
        tolerance: f32,
    ) -> Result<Vec<Place>, Refusal> {
        let [a, b, along] = match self.plane {
            0 => [0, 1, 2],
            1 => [2, 0, 1],
            _ => [1, 2, 0],
        };
        if !named.contains(&true) {
            return Err(NO_AXIS_WORDS);
        }
        if !(named[a] || named[b]) {
            return Err(NO_AXIS_IN_PLANE);
        }
        let (x, y) = (self.to[a] - self.from[a], self.to[b] - self.from[b]);
        let (centre, r) = match radius {
            Some(r) => self.centre_by_radius([x, y], r)?,
            None => {
                if offsets[a].is_none() && offsets[b].is_none() {
                    return Err(NO_OFFSETS);
                }
                let centre = [offsets[a].unwrap_or(0.0), offsets[b].unwrap_or(0.0)];
                let target_r = (x - centre[0]).hypot(y - centre[1]);
                let r = centre[0].hypot(centre[1]);
                let off = (target_r - r).abs();
                if off > 0.005 && (off > 0.5 || off > 0.001 * r) {
                    return Err(INVALID_TARGET);
                }
                (centre, r)
            }
        };
        let begin = [-centre[0], -centre[1]];
        let end = [x - centre[0], y - centre[1]];
        let mut angle = (begin[0] * end[1] - begin[1] * end[0]).atan2(begin[0] * end[0] + begin[1] * end[1]);
        if self.clockwise && angle >= -FULL_CIRCLE {
            angle -= std::f32::consts::TAU;
        } else if !self.clockwise && angle <= FULL_CIRCLE {
            angle += std::f32::consts::TAU;
        }
        let chord = 2.0 * (tolerance * (2.0 * r - tolerance)).max(0.0).sqrt();
        let count = if chord > 0.0 { ((angle * r).abs() / chord).floor().min(CHORDS_MAX) } else { 0.0 } as usize;
        let rise = self.to[along] - self.from[along];
        let mut ends: Vec<Place> = (1..count)
            .map(|i| {
                let part = i as f32 / count as f32;
                let (sine, cosine) = f64::from(angle * part).sin_cos();
                let (sine, cosine) = (sine as f32, cosine as f32);
                let mut place = self.from;
                place[a] += centre[0] + begin[0] * cosine - begin[1] * sine;
                place[b] += centre[1] + begin[0] * sine + begin[1] * cosine;
                place[along] += rise * part;
                place
            })
            .collect();
        ends.push(self.to);
        Ok(ends)
    }

    fn centre_by_radius(&self, [x, y]: [f32; 2], r: f32) -> Result<([f32; 2], f32), Refusal> {
        if x == 0.0 && y == 0.0 {
            return Err(INVALID_TARGET);
        }
        let h = 4.0 * r * r - x * x - y * y;
        if h < 0.0 {
            return Err(ARC_RADIUS);
        }
        let mut side = -h.sqrt() / x.hypot(y);
        if !self.clockwise {
            side = -side;
        }
        // A negative radius takes the longer way round.
        if r < 0.0 {
            side = -side;
        }
        Ok(([0.5 * (x - y * side), 0.5 * (y + x * side)], r.abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const XY: [bool; 3] = [true, true, false];

    fn arc(to: Place, clockwise: bool) -> Arc {
        Arc { from: [10.0, 0.0, 0.0], to, plane: 0, clockwise }
    }

    fn farthest_from_circle(ends: &[Place], centre: [f32; 2], r: f32) -> f32 {
        ends.iter().map(|p| ((p[0] - centre[0]).hypot(p[1] - centre[1]) - r).abs()).fold(0.0, f32::max)
    }

    #[test]
    fn arcs_turn_the_way_they_should() {
        let (left, right) = (arc([0.0, 10.0, 0.0], false), arc([0.0, 10.0, 0.0], true));
        let about = [Some(-10.0), None, None];
        let short = left.chords(XY, about, None, 0.002).unwrap();
        let long = right.chords(XY, about, None, 0.002).unwrap();
        assert!(long.len() > 2 * short.len() && short.len() > 20);
        for ends in [&short, &long] {
            assert!(farthest_from_circle(ends, [0.0, 0.0], 10.0) < 1e-4);
            assert_eq!(ends.last(), Some(&[0.0, 10.0, 0.0]));
        }
        assert!(short.iter().all(|p| p[0] >= -1e-4 && p[1] >= -1e-4));
        // By radius: the shorter way round, and with a negative one the longer, about another centre.
        let by_radius = |r: f32| left.chords(XY, [None; 3], Some(r), 0.002).unwrap();
        assert!(by_radius(10.0).len().abs_diff(short.len()) <= 1 && by_radius(-10.0).len().abs_diff(long.len()) <= 1);
        assert!(farthest_from_circle(&by_radius(10.0), [0.0, 0.0], 10.0) < 1e-4);
        assert!(farthest_from_circle(&by_radius(-10.0), [10.0, 10.0], 10.0) < 1e-4);
        let circle = arc([10.0, 0.0, 3.0], false).chords(XY, about, None, 0.002).unwrap();
        assert!(circle.len() > 100 && (circle[circle.len() / 2 - 1][2] - 1.5).abs() < 0.05);
    }

    #[test]
    fn arcs_that_are_none_are_refused() {
        let a = arc([0.0, 10.0, 0.0], false);
        for (named, offsets, radius, refusal) in [
            ([false; 3], [None; 3], None, NO_AXIS_WORDS),
            ([false, false, true], [None; 3], None, NO_AXIS_IN_PLANE),
            (XY, [None; 3], None, NO_OFFSETS),
            (XY, [Some(-9.0), None, None], None, INVALID_TARGET),
            (XY, [None; 3], Some(2.0), ARC_RADIUS),
        ] {
            assert_eq!(a.chords(named, offsets, radius, 0.002), Err(refusal));
        }
        assert_eq!(arc([10.0, 0.0, 0.0], false).chords(XY, [None; 3], Some(5.0), 0.002), Err(INVALID_TARGET));
    }
}
