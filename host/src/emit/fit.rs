//! A stroke in as few lines and arcs as the chord error that is left allows.
//!
//! From each vertex on, the longest run of vertices is looked for that one arc or one biarc replaces, and the number of straight moves that
//! would do it; what is written with fewer bytes is taken. Vertices lie on the curve, so that tangents come from circles through three of
//! them; at corners they end.

use glam::DVec2;

use super::Run;
use super::arc::{Arc, GRID_MM, biarc, deviation, mm};
use super::number::fixed;
use crate::device::Gcode;

/// Decimals of coordinates in mm. GRBL reports with three, and a step is coarser.
pub(super) const DECIMALS: usize = 3;

/// Part of the chord error that is left where polylines are to become arcs; they have been traced with the rest.
pub(crate) const SLACK_PART: f64 = 0.75;

/// Straight moves that are written with about as many bytes as a biarc, which has four words more.
const LINES_OF_BIARC: usize = 3;

/// The same for an arc.
const LINES_OF_ARC: usize = 1;

/// How far a curve whose curvature grows evenly from 0 turns from its chord, times the length of this and through its rise: (κ′l²/3) l /
/// (κ′l³/(9√3)). On an arc it is 4.
const TURN_OF_RISE: f64 = 5.196_152_422_706_632;

/// A move with the pen down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Piece {
    /// To there.
    Line([i64; 2]),
    /// Along an arc.
    Arc(Arc),
}

impl Piece {
    /// It as a line of G-code without a feed.
    pub(crate) fn text(&self) -> String {
        let to = |[x, y]: [i64; 2]| format!("X{} Y{}", fixed(x, DECIMALS), fixed(y, DECIMALS));
        match self {
            Self::Line(end) => format!("G1 {}", to(*end)),
            Self::Arc(Arc { end, centre: [i, j], clockwise, .. }) => {
                let word = if *clockwise { "G2" } else { "G3" };
                format!("{word} {} I{} J{}", to(*end), fixed(*i, DECIMALS), fixed(*j, DECIMALS))
            }
        }
    }

    /// Where it ends.
    pub(crate) fn end(&self) -> [i64; 2] {
        match self {
            Self::Line(end) | Self::Arc(Arc { end, .. }) => *end,
        }
    }

    /// The straight ways, in mm, by which the controller goes along it from `start`.
    pub(crate) fn ways(&self, start: [i64; 2], gcode: &Gcode) -> Vec<DVec2> {
        match self {
            Self::Line(end) => vec![mm(*end) - mm(start)],
            Self::Arc(arc) => arc.ways(gcode.dialect.inside_of_arc(arc.radii()[0])),
        }
    }
}

/// The moves by which a device draws a run that may be `slack_mm` farther from its curves than its vertices and their chords are: lines, and arcs where
/// the device takes them. The run is on the grid of [`GRID_MM`].
pub(crate) fn moves(run: &Run, slack_mm: f64, gcode: &Gcode) -> Vec<Piece> {
    let inside = |radius: f64| gcode.dialect.inside_of_arc(radius);
    let inside: &dyn Fn(f64) -> f64 = &inside;
    let allowed = Allowed {
        slack_mm,
        chord_mm: slack_mm * (1.0 - SLACK_PART) / SLACK_PART,
        inside: (gcode.arcs && slack_mm > 0.0).then_some(inside),
    };
    pieces(&run.points, &run.exact, &allowed)
}

/// What a fit may do.
pub(super) struct Allowed<'a> {
    /// How far the pieces may be from the vertices and the chords between them, mm.
    pub(super) slack_mm: f64,
    /// How far the polyline may be from its curve, mm: tells corners from curves.
    pub(super) chord_mm: f64,
    /// How far the chords by which the controller draws lie inside an arc of this radius, mm; none where it draws no arcs.
    pub(super) inside: Option<&'a dyn Fn(f64) -> f64>,
}

/// The pieces of a stroke whose vertices are `exact` (mm) and `points` on the grid, neighbours different there.
///
/// Cost: O(n log n) in the vertices.
pub(super) fn pieces(points: &[[i64; 2]], exact: &[DVec2], allowed: &Allowed<'_>) -> Vec<Piece> {
    let fit = Fit { points, exact, tangents: tangents(exact, allowed.chord_mm), allowed };
    let mut pieces = Vec::new();
    let mut from = 0;
    while from + 1 < points.len() {
        let line = farthest(from, points.len() - 1, |to| fit.is_line(from, to).then_some(()));
        let corner = (from + 1..points.len()).find(|k| fit.tangents[*k].is_corner()).unwrap_or(points.len() - 1);
        let curve = allowed.inside.and_then(|inside| farthest(from, corner, |to| fit.curve(from, to, inside)));
        let next = match curve {
            Some((to, Curve::One(arc))) if !fit.lines_reach(from, to, LINES_OF_ARC) => {
                pieces.push(Piece::Arc(arc));
                to
            }
            Some((to, Curve::Two(arcs))) if !fit.lines_reach(from, to, LINES_OF_BIARC) => {
                pieces.extend(arcs.map(Piece::Arc));
                to
            }
            _ => {
                let to = line.map_or(from + 1, |(to, ())| to);
                pieces.push(Piece::Line(points[to]));
                to
            }
        };
        from = next;
    }
    pieces
}

enum Curve {
    One(Arc),
    Two([Arc; 2]),
}

/// Directions, of length 1, in which a stroke arrives at a vertex and leaves it.
#[derive(Clone, Copy, Debug)]
struct Tangent {
    arriving: DVec2,
    leaving: DVec2,
}

impl Tangent {
    fn is_corner(&self) -> bool {
        self.arriving != self.leaving
    }
}

struct Fit<'a> {
    points: &'a [[i64; 2]],
    exact: &'a [DVec2],
    tangents: Vec<Tangent>,
    allowed: &'a Allowed<'a>,
}

impl Fit<'_> {
    /// Whether one straight move is near enough to the vertices from one to another, and passes them in their order. The next vertex is
    /// always gone to: rounding is all that it may be off.
    fn is_line(&self, from: usize, to: usize) -> bool {
        if to == from + 1 {
            return true;
        }
        let (start, end) = (mm(self.points[from]), mm(self.points[to]));
        follows(start, end, &self.exact[from..=to], self.allowed.slack_mm, GRID_MM)
    }

    /// Whether so many straight moves are enough.
    fn lines_reach(&self, from: usize, to: usize, count: usize) -> bool {
        let mut at = from;
        for _ in 0..count {
            at = farthest(at, to, |k| self.is_line(at, k).then_some(())).map_or(at + 1, |(k, ())| k);
            if at >= to {
                return true;
            }
        }
        false
    }

    /// The arc or the two arcs that replace the vertices from one to another.
    fn curve(&self, from: usize, to: usize, inside: &dyn Fn(f64) -> f64) -> Option<Curve> {
        let (start, end) = (self.points[from], self.points[to]);
        let (leaving, arriving) = (self.tangents[from].leaving, self.tangents[to].arriving);
        let exact = &self.exact[from..=to];
        let fits = |arcs: &[Arc]| deviation(arcs, exact, inside).is_some_and(|off| off <= self.allowed.slack_mm);
        if let Some(arc) = Arc::leaving(start, end, leaving) {
            // One arc has both tangents where it misses the other by no more than the grid.
            let miss = arc.arrival().normalize_or_zero().perp_dot(arriving) * mm(end).distance(mm(start));
            if miss.abs() <= GRID_MM && fits(&[arc]) {
                return Some(Curve::One(arc));
            }
        }
        biarc(start, end, leaving, arriving).filter(|arcs| fits(arcs)).map(Curve::Two)
    }
}

/// The directions at each vertex: those of the circle through it and its neighbours, which is exact on circles of any spacing. Where the chords
/// turn by more than a curve within `chord_mm` of them can, there is a corner, and each side has its own. A closed
/// stroke goes on where it begins.
fn tangents(exact: &[DVec2], chord_mm: f64) -> Vec<Tangent> {
    let last = exact.len().saturating_sub(1);
    let closed = last > 2 && exact[0] == exact[last];
    let smooth: Vec<Option<DVec2>> = (0..=last)
        .map(|k| match k {
            _ if last < 2 => None,
            k if (k == 0 || k == last) && closed => through([exact[last - 1], exact[0], exact[1]], chord_mm),
            0 => None,
            k if k == last => None,
            k => through([exact[k - 1], exact[k], exact[k + 1]], chord_mm),
        })
        .collect();
    // On a circle the tangents at both ends of a chord lie as mirrored in it.
    let beside = |k: usize, other: usize| {
        let chord = (exact[k.max(other)] - exact[k.min(other)]).normalize_or_zero();
        smooth[other].map_or(chord, |tangent| chord * (2.0 * tangent.dot(chord)) - tangent)
    };
    (0..=last)
        .map(|k| match smooth[k] {
            Some(tangent) => Tangent { arriving: tangent, leaving: tangent },
            None => Tangent {
                arriving: if k > 0 { beside(k, k - 1) } else { DVec2::ZERO },
                leaving: if k < last { beside(k, k + 1) } else { DVec2::ZERO },
            },
        })
        .collect()
}

/// Direction at the middle one of three points of the circle through them; none at a corner.
fn through([a, b, c]: [DVec2; 3], chord_mm: f64) -> Option<DVec2> {
    let (before, after) = (b - a, c - b);
    let (l, m) = (before.length(), after.length());
    let turn = before.angle_to(after).abs();
    if turn.is_nan() || turn > TURN_OF_RISE * chord_mm * (1.0 / l + 1.0 / m) {
        return None;
    }
    (before * (m / l) + after * (l / m)).try_normalize()
}

/// Whether the straight way from `start` to `end` passes `points` in their order, but for `back_mm` that they may go back, and within `slack_mm` of each.
fn follows(start: DVec2, end: DVec2, points: &[DVec2], slack_mm: f64, back_mm: f64) -> bool {
    let way = end - start;
    let length = way.length();
    let mut along = 0.0;
    // Where the ends are one place, nothing compares as true.
    points.iter().all(|p| {
        let at = (*p - start).dot(way) / length;
        let ordered = at >= along - back_mm;
        along = at.max(along);
        // Beyond the ends it is as far as they are.
        let off = (*p - start - way * (at / length).clamp(0.0, 1.0)).length();
        ordered && off <= slack_mm
    })
}

/// The last vertex after `from` and up to `last` that `reach` accepts, with what it says of it, as far as doubling and halving the number of vertices finds it.
fn farthest<T>(from: usize, last: usize, reach: impl Fn(usize) -> Option<T>) -> Option<(usize, T)> {
    let mut found = None;
    let (mut good, mut step) = (from, 1);
    let mut bad = last + 1;
    while good < last {
        let to = (good + step).min(last);
        match reach(to) {
            Some(value) => {
                found = Some((to, value));
                good = to;
                step *= 2;
            }
            // Two chords are the least that an arc is for.
            None if step == 1 && good == from => {
                step = 2;
                if from + 2 > last {
                    return found;
                }
                let value = reach(from + 2)?;
                found = Some((from + 2, value));
                good = from + 2;
            }
            None => {
                bad = to;
                break;
            }
        }
    }
    while good + 1 < bad {
        let to = good.midpoint(bad);
        match reach(to) {
            Some(value) => {
                found = Some((to, value));
                good = to;
            }
            None => bad = to,
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::arc::on_grid;
    use super::*;

    const SLACK: Allowed<'static> = Allowed { slack_mm: 0.0075, chord_mm: 0.0025, inside: Some(&|_| 0.002) };

    fn fit(exact: &[DVec2], allowed: &Allowed<'_>) -> Vec<Piece> {
        let mut points: Vec<[i64; 2]> = Vec::new();
        let mut kept = Vec::new();
        for p in exact {
            if points.last() != Some(&on_grid(*p)) {
                points.push(on_grid(*p));
                kept.push(*p);
            }
        }
        pieces(&points, &kept, allowed)
    }

    /// Points of the pieces, so close that they are the pieces.
    fn sampled(start: [i64; 2], pieces: &[Piece]) -> Vec<DVec2> {
        let mut at = mm(start);
        let mut found = vec![at];
        for piece in pieces {
            match piece {
                Piece::Line(to) => found.extend((1..=50).map(|k| at.lerp(mm(*to), f64::from(k) / 50.0))),
                Piece::Arc(arc) => {
                    assert_eq!(mm(arc.start), at);
                    let (middle, from) = (arc.middle(), at - arc.middle());
                    let sweep = from.angle_to(mm(arc.end) - middle);
                    assert!(sweep * arc.turn() > 0.0, "less than half a turn the way it says");
                    found
                        .extend((1..=50).map(|k| middle + DVec2::from_angle(sweep * f64::from(k) / 50.0).rotate(from)));
                }
            }
            at = match piece {
                Piece::Line(to) => mm(*to),
                Piece::Arc(arc) => mm(arc.end),
            };
        }
        found
    }

    fn far(points: &[DVec2], line: &[DVec2]) -> f64 {
        let to = |p: DVec2, w: &[DVec2]| {
            let way = w[1] - w[0];
            let along =
                if way == DVec2::ZERO { 0.0 } else { ((p - w[0]).dot(way) / way.length_squared()).clamp(0.0, 1.0) };
            p.distance(w[0] + way * along)
        };
        let nearest = |p: &DVec2| line.windows(2).map(|w| to(*p, w)).fold(f64::INFINITY, f64::min);
        points.iter().map(nearest).fold(0.0, f64::max)
    }

    fn finely(exact: &[DVec2]) -> Vec<DVec2> {
        exact.windows(2).flat_map(|w| (0..=8).map(|k| w[0].lerp(w[1], f64::from(k) / 8.0))).collect()
    }

    fn circle(r: f64, sweep: f64, count: usize) -> Vec<DVec2> {
        (0..=count).map(|k| DVec2::new(100.0, 80.0) + DVec2::from_angle(sweep * k as f64 / count as f64) * r).collect()
    }

    #[test]
    fn circles_are_few_arcs() {
        for r in [1.0, 12.5, 90.0] {
            let sagitta = |count: usize| r * (1.0 - (std::f64::consts::PI / count as f64).cos());
            let count = (6..).find(|count| sagitta(*count) <= SLACK.chord_mm).unwrap_or(6);
            let mut closed = circle(r, std::f64::consts::TAU, count);
            closed[count] = closed[0];
            let found = fit(&closed, &SLACK);
            // Two of nearly half a turn, and what is left, which may be a chord.
            let arcs = found.iter().filter(|piece| matches!(piece, Piece::Arc(_))).count();
            assert!(arcs >= 2 && found.len() <= 4 && found.len() - arcs <= 1, "{r}: {found:?}");
        }
    }

    #[test]
    fn straight_runs_are_lines_and_corners_stay() {
        let square = [[0.0, 0.0], [5.0, 0.0], [10.0, 0.001], [10.0, 4.0], [10.0, 10.0], [0.0, 10.0], [0.0, 0.0]];
        let square: Vec<DVec2> = square.iter().map(|p| DVec2::from(*p)).collect();
        let found = fit(&square, &SLACK);
        let expected = [[10_000, 1], [10_000, 10_000], [0, 10_000], [0, 0]].map(Piece::Line);
        assert_eq!(found, expected);
    }

    #[test]
    fn without_arcs_or_slack_there_are_lines() {
        let arc = circle(10.0, 2.0, 60);
        let lines = fit(&arc, &Allowed { inside: None, ..SLACK });
        assert!(lines.len() < 60 && lines.iter().all(|piece| matches!(piece, Piece::Line(_))), "{lines:?}");
        assert_eq!(fit(&arc, &Allowed { slack_mm: 0.0, ..SLACK }).len(), 60);
        assert_eq!(fit(&arc[..1], &SLACK), []);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]

        /// Waves, with corners where they turn back on themselves: the pieces end where the stroke does and are within the slack, both ways.
        #[test]
        fn pieces_are_within_the_slack(
            a in 0.1..15.0_f64, b in 0.1..8.0_f64, f in 0.3..3.0_f64, g in 0.3..4.0_f64, corner in 0..3_usize, count in 8..120_usize,
        ) {
            let curve = |t: f64| DVec2::new(20.0 * t + a * (f * t).sin(), b * (g * t).cos() + if t > 1.0 { corner as f64 * (t - 1.0) * 9.0 } else { 0.0 });
            let exact: Vec<DVec2> = (0..=count).map(|k| curve(3.0 * k as f64 / count as f64)).collect();
            let found = fit(&exact, &SLACK);
            let path = sampled(on_grid(exact[0]), &found);
            prop_assert!(path.last().unwrap().distance(exact[count]) < 0.001);
            let off = far(&path, &exact).max(far(&finely(&exact), &path));
            // Samples of arcs lie on their chords, a little inside.
            prop_assert!(off <= SLACK.slack_mm + 0.0005, "{}: {:?}", off, found);
            prop_assert!(found.len() <= count);
        }
    }
}
