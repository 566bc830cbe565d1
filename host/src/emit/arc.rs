//! Circular arcs between points of a plotter's grid, as controllers read them: ends and centre are rounded.

use glam::DVec2;

/// Side of the grid in mm: the decimals of G-code.
pub(super) const GRID_MM: f64 = 0.001;

/// Largest radius in mm. Controllers compute in floats of 32 bits, which resolve a ten-thousandth of a millimetre up to here.
const RADIUS_MAX_MM: f64 = 1000.0;

/// Shortest way in mm between the ends of an arc; a shorter one is a line.
const SHORTEST_MM: f64 = 0.05;

/// An arc of less than half a turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Arc {
    pub(super) start: [i64; 2],
    pub(super) end: [i64; 2],
    /// From the start: I and J.
    pub(super) centre: [i64; 2],
    pub(super) clockwise: bool,
}

/// A point of the grid in mm.
pub(super) fn mm([x, y]: [i64; 2]) -> DVec2 {
    DVec2::new(x as f64, y as f64) * GRID_MM
}

/// The nearest point of the grid. A cast saturates, and makes 0 of what is not a number.
pub(super) fn on_grid(p: DVec2) -> [i64; 2] {
    let p = (p / GRID_MM).round();
    [p.x as i64, p.y as i64]
}

impl Arc {
    /// The arc that leaves `start` in the direction `tangent` and goes to `end`; none if it is too short, too straight, or half a
    /// turn or more. Only the centre is rounded, so that the radii at the ends differ by two roundings at most.
    pub(super) fn leaving(start: [i64; 2], end: [i64; 2], tangent: DVec2) -> Option<Self> {
        let from_start = centre(mm(start), mm(end), tangent)?;
        Some(Self { start, end, centre: on_grid(from_start), clockwise: tangent.perp_dot(from_start) < 0.0 })
    }

    /// The arc from `start` that arrives at `end` in the direction `tangent`; none as for [`leaving`](Self::leaving).
    pub(super) fn arriving(start: [i64; 2], end: [i64; 2], tangent: DVec2) -> Option<Self> {
        let from_end = centre(mm(end), mm(start), -tangent)?;
        let centre = on_grid(from_end + mm(end) - mm(start));
        Some(Self { start, end, centre, clockwise: tangent.perp_dot(from_end) < 0.0 })
    }

    /// The centre in mm.
    pub(super) fn middle(&self) -> DVec2 {
        mm([self.start[0] + self.centre[0], self.start[1] + self.centre[1]])
    }

    /// The radii at the start and at the end, mm; controllers draw between the two.
    pub(super) fn radii(&self) -> [f64; 2] {
        [mm(self.start), mm(self.end)].map(|end| end.distance(self.middle()))
    }

    /// 1 counter-clockwise, −1 clockwise.
    pub(super) fn turn(&self) -> f64 {
        if self.clockwise { -1.0 } else { 1.0 }
    }

    /// The chords of equal lengths, as ways in mm, that lie no more than `inside` mm inside of it.
    pub(super) fn ways(&self, inside: f64) -> Vec<DVec2> {
        let (middle, [radius, _]) = (self.middle(), self.radii());
        let (from, to) = (mm(self.start) - middle, mm(self.end) - middle);
        let sweep = from.angle_to(to);
        let step = 2.0 * (1.0 - inside / radius).clamp(0.0, 1.0).acos();
        // Of less than half a turn, and of a radius of a metre at most.
        let count = (sweep.abs() / step).ceil().clamp(1.0, 1e4) as u32;
        let share = |k: u32| f64::from(k) / f64::from(count);
        // The radii at both ends differ by the rounding of the centre.
        let at = |k: u32| if k == count { to } else { DVec2::from_angle(sweep * share(k)).rotate(from) };
        (0..count).map(|k| at(k + 1) - at(k)).collect()
    }

    /// Direction in which it arrives at its end.
    pub(super) fn arrival(&self) -> DVec2 {
        (mm(self.end) - self.middle()).perp() * self.turn()
    }
}

/// The centre, from `a`, of the circle through `a` and `b` that touches the direction `tangent` at `a`.
fn centre(a: DVec2, b: DVec2, tangent: DVec2) -> Option<DVec2> {
    let (way, normal) = (b - a, tangent.perp());
    // Twice the sine of half the turn, times the length of the way; its cosine must be positive.
    let across = way.dot(normal);
    let radius = way.length_squared() / (2.0 * across);
    let fits = way.length() >= SHORTEST_MM && way.dot(tangent) > 0.0 && radius.abs() <= RADIUS_MAX_MM;
    fits.then_some(normal * radius)
}

/// Two arcs that touch where they meet, from `start` in the direction `from` to `end` in the direction `to` (of length 1): the
/// biarc whose joint lies as far from either tangent's corner (K. M. Bolton, "Biarc curves", Computer-Aided Design 7, 1975; the choice
/// of equal lengths is that of D. S. Meek and D. J. Walton, "Approximating discrete data by G1 arc splines", CAD 24, 1992). The
/// joint and the centres are rounded to the grid.
pub(super) fn biarc(start: [i64; 2], end: [i64; 2], from: DVec2, to: DVec2) -> Option<[Arc; 2]> {
    let way = mm(end) - mm(start);
    // |way − d (from + to)| = 2 d, its positive root without cancellation.
    let along = way.dot(from + to);
    let root = (along * along + 2.0 * (1.0 - from.dot(to)) * way.length_squared()).sqrt();
    let d = way.length_squared() / (along + root);
    if !(d.is_finite() && d > 0.0) {
        return None;
    }
    let joint = on_grid((mm(start) + mm(end) + (from - to) * d) / 2.0);
    Some([Arc::leaving(start, joint, from)?, Arc::arriving(joint, end, to)?])
}

/// A bound for the distance in mm between arcs, each beginning where the one before it ends, and a polyline, both ways; none if it
/// is not seen to follow them. `inside` is how far the chords of the controller lie inside an arc of some radius.
///
/// A polyline that turns about the centre all the way as the arc does is mapped onto it along the radii, one to one; so no point
/// of either is farther from the other than this map moves it, which is most at a vertex or at the foot of the centre on a chord.
/// At a joint the polyline is cut by the radius there. The ends, and what the radii of two neighbours miss of each other
/// at the joint, are no farther apart than the points between which they lie.
pub(super) fn deviation(arcs: &[Arc], points: &[DVec2], inside: impl Fn(f64) -> f64) -> Option<f64> {
    let (mut at, mut rest) = points.split_first().map(|(first, rest)| (*first, rest))?;
    let mut worst = at.distance(mm(arcs.first()?.start));
    for (index, arc) in arcs.iter().enumerate() {
        let (middle, turn, [r0, r1]) = (arc.middle(), arc.turn(), arc.radii());
        let low = r0.min(r1) - inside(r0.max(r1));
        let high = r0.max(r1);
        let end = mm(arc.end) - middle;
        let is_last = index + 1 == arcs.len();
        loop {
            let (next, after) = rest.split_first().map(|(next, after)| (*next, after))?;
            let (u, v) = (at - middle, next - middle);
            if u.perp_dot(v) * turn <= 0.0 || u.perp_dot(end) * turn < 0.0 {
                return None;
            }
            let ends = is_last && after.is_empty();
            let beyond = -v.perp_dot(end) * turn;
            let (to, cut) = if !is_last && beyond >= 0.0 {
                let before = u.perp_dot(end) * turn;
                let share = before / (before + beyond);
                (at + (next - at) * if share.is_finite() { share } else { 1.0 }, true)
            } else {
                (next, false)
            };
            let v = to - middle;
            worst = worst.max(u.length().max(v.length()) - high).max(high - low).max(low - u.length().min(v.length()));
            worst = worst.max(u.length().max(v.length()) - low).max(high - nearest(u, v));
            at = to;
            if cut {
                worst = worst.max(at.distance(mm(arc.end)));
                break;
            }
            rest = after;
            if ends {
                return Some(worst.max(at.distance(mm(arc.end))));
            }
        }
    }
    None
}

/// Distance of the segment from `u` to `v` from the origin.
fn nearest(u: DVec2, v: DVec2) -> f64 {
    let way = v - u;
    let along = if way == DVec2::ZERO { 0.0 } else { (-u.dot(way) / way.length_squared()).clamp(0.0, 1.0) };
    (u + way * along).length()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn at(angle: f64) -> DVec2 {
        DVec2::from_angle(angle)
    }

    proptest! {
        /// What GRBL asks of an arc (error 33): radii that differ by no more than 0.005 mm.
        #[test]
        fn biarcs_touch_their_tangents_and_each_other(
            x in 0.2..80.0_f64, y in -40.0..40.0_f64, a in -1.4..1.4_f64, b in -1.4..1.4_f64,
        ) {
            let (start, end) = ([12_345, -6_789], on_grid(DVec2::new(12.345 + x, -6.789 + y)));
            let along = (mm(end) - mm(start)).to_angle();
            let (from, to) = (at(along + a), at(along + b));
            let Some(arcs) = biarc(start, end, from, to) else { return Ok(()) };
            prop_assert_eq!((arcs[0].start, arcs[1].end, arcs[0].end), (start, end, arcs[1].start));
            for arc in &arcs {
                let [r0, r1] = arc.radii();
                prop_assert!((r0 - r1).abs() < 0.002, "{:?}: {} {}", arc, r0, r1);
            }
            // By the rounding of the joint, over the length of the arcs.
            let slack = |arc: &Arc| 0.006 / (mm(arc.end) - mm(arc.start)).length();
            let both = slack(&arcs[0]) + slack(&arcs[1]);
            prop_assert!(arcs[1].arrival().normalize().distance(to) < both);
            let leaves = (mm(arcs[1].start) - arcs[1].middle()).perp() * arcs[1].turn();
            prop_assert!(arcs[0].arrival().normalize().distance(leaves.normalize()) < both);
        }

        /// The bound holds, and is no more than what sampling shows but for the rounding of the ends.
        #[test]
        fn the_deviation_bounds_what_samples_show(
            r in 1.0..50.0_f64, sweep in 0.2..3.0_f64, count in 3..30_usize, bulge in -0.02..0.02_f64, clockwise: bool,
        ) {
            let turn = if clockwise { -1.0 } else { 1.0 };
            let wobble = |t: f64| r + bulge * (t * 6.0).sin() * t * (1.0 - t);
            let points: Vec<DVec2> = (0..=count)
                .map(|k| k as f64 / count as f64)
                .map(|t| at(turn * sweep * t) * wobble(t))
                .collect();
            let (start, end) = (on_grid(points[0]), on_grid(points[count]));
            let Some(arc) = Arc::leaving(start, end, at(0.0).perp() * turn) else { return Ok(()) };
            prop_assert_eq!(arc.clockwise, clockwise);
            let Some(bound) = deviation(&[arc], &points, |_| 0.0) else { return Ok(()) };
            let (middle, [r0, r1]) = (arc.middle(), arc.radii());
            let mut shown = 0.0_f64;
            for pair in points.windows(2) {
                for k in 0..=20 {
                    let d = pair[0].lerp(pair[1], f64::from(k) / 20.0).distance(middle);
                    shown = shown.max((d - r0).abs()).max((d - r1).abs());
                }
            }
            prop_assert!(bound >= shown - 1e-12 && bound <= shown + 0.002 + 1e-3 * shown, "{} {}", bound, shown);
        }
    }

    #[test]
    fn what_goes_another_way_is_told() {
        let arc = Arc::leaving([10_000, 0], [0, 10_000], DVec2::Y).unwrap();
        assert_eq!((arc.centre, arc.clockwise), ([-10_000, 0], false));
        let deviation = |points: &[[f64; 2]]| {
            deviation(&[arc], &points.iter().map(|p| DVec2::from(*p)).collect::<Vec<_>>(), |_| 0.0)
        };
        // The chord of a quarter: its middle is r (1 − cos 45°) inside.
        let chord = deviation(&[[10.0, 0.0], [0.0, 10.0]]).unwrap();
        assert!((chord - 10.0 * (1.0 - 0.5_f64.sqrt())).abs() < 1e-9, "{chord}");
        // The long way round, back and forth, and beyond.
        assert_eq!(deviation(&[[10.0, 0.0], [0.0, -10.0], [-10.0, 0.0], [0.0, 10.0]]), None);
        assert_eq!(deviation(&[[10.0, 0.0], [7.0, 7.0], [9.0, 3.0], [0.0, 10.0]]), None);
        assert_eq!(deviation(&[[10.0, 0.0]]), None);
    }

    #[test]
    fn what_is_no_arc_is_none() {
        let leaving = |end: [i64; 2], tangent: DVec2| Arc::leaving([0, 0], end, tangent);
        assert!(leaving([10_000, 0], DVec2::X).is_none(), "a line");
        assert!(leaving([40, 0], at(0.5)).is_none(), "too short");
        assert!(leaving([10_000, 0], at(2.0)).is_none(), "more than half a turn");
        assert!(leaving([10_000, 0], at(0.004)).is_none(), "too large");
        assert!(leaving([10_000, 0], at(0.1)).is_some());
    }
}
