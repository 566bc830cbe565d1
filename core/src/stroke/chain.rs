//! Strokes that continue one another become one.

use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;
use core::mem;

use glam::{DVec2, DVec3};

use super::{Stroke, StrokePoint};

/// Joins strokes of one surface, of equal kind, level and invisibility, end to end. Ends count as one place if they are within `screen_gap` on
/// the screen and `model_gap` in space. Where more than two ends meet, the straightest pair is joined first.
/// Deterministic; O(n log n).
#[must_use]
pub fn chain(mut strokes: Vec<Stroke>, screen_gap: f64, model_gap: f64) -> Vec<Stroke> {
    let links = links(&strokes, screen_gap, model_gap);
    let mut points: Vec<_> = strokes.iter_mut().map(|s| mem::take(&mut s.points)).collect();
    let mut out = Vec::with_capacity(strokes.len());
    follow(&strokes, &links, &mut |k| mem::take(&mut points[k]), &mut |stroke| {
        out.push(stroke);
        true
    });
    out
}

/// As [`chain`], one chain after the other, of strokes that are not kept: `outlines` have the [`outline`]s of their vertices, and
/// `points` gives all of them, once for each stroke. Ends when `draw` returns false.
pub(crate) fn chain_each(
    outlines: &[Stroke],
    screen_gap: f64,
    model_gap: f64,
    points: &mut dyn FnMut(usize) -> Vec<StrokePoint>,
    draw: &mut dyn FnMut(Stroke) -> bool,
) {
    let links = links(outlines, screen_gap, model_gap);
    follow(outlines, &links, points, draw);
}

/// What chaining has to know of the vertices of a stroke: two at each end.
pub(crate) fn outline(mut points: Vec<StrokePoint>) -> Vec<StrokePoint> {
    let n = points.len();
    if n > 4 {
        points.drain(2..n - 2);
    }
    points.shrink_to_fit();
    points
}

/// Which end each end is joined to.
fn links(strokes: &[Stroke], screen_gap: f64, model_gap: f64) -> Vec<[Option<usize>; 2]> {
    let mut links = vec![[None; 2]; strokes.len()];
    let mut pairs = candidate_pairs(strokes, screen_gap, model_gap);
    pairs.sort_by(|a, b| a.turn.total_cmp(&b.turn).then(a.ends.cmp(&b.ends)));
    for p in pairs {
        let [a, b] = p.ends;
        if links[a / 2][a % 2].is_none() && links[b / 2][b % 2].is_none() {
            links[a / 2][a % 2] = Some(b);
            links[b / 2][b % 2] = Some(a);
        }
    }
    links
}

/// Two ends that may be joined; an end is twice the stroke's index, plus one for its last vertex.
struct Pair {
    ends: [usize; 2],
    /// One plus the cosine between the directions into the two strokes: 0 goes straight on, 2 turns back.
    turn: f64,
}

fn vertex(strokes: &[Stroke], end: usize) -> &StrokePoint {
    let points = &strokes[end / 2].points;
    if end.is_multiple_of(2) { &points[0] } else { &points[points.len() - 1] }
}

/// Unit direction on the screen from an end into its stroke.
fn inward(strokes: &[Stroke], end: usize) -> DVec2 {
    let points = &strokes[end / 2].points;
    let n = points.len();
    let d = if end.is_multiple_of(2) {
        points[1].screen - points[0].screen
    } else {
        points[n - 2].screen - points[n - 1].screen
    };
    d.normalize_or_zero()
}

fn candidate_pairs(strokes: &[Stroke], screen_gap: f64, model_gap: f64) -> Vec<Pair> {
    // Cells twice the gap wide: whatever is within the gap lies in the same cell or one of its neighbours.
    let cell = (2.0 * screen_gap).max(f64::MIN_POSITIVE);
    let key = |p: DVec2| (libm::floor(p.x / cell) as i64, libm::floor(p.y / cell) as i64);
    let mut cells: BTreeMap<(i64, i64), Vec<usize>> = BTreeMap::new();
    for end in 0..2 * strokes.len() {
        cells.entry(key(vertex(strokes, end).screen)).or_default().push(end);
    }
    let mut pairs = Vec::new();
    for a in 0..2 * strokes.len() {
        let (sa, va) = (&strokes[a / 2], vertex(strokes, a));
        let (i, j) = key(va.screen);
        for (di, dj) in (-1..=1).flat_map(|x| (-1..=1).map(move |y| (x, y))) {
            for &b in cells.get(&(i.saturating_add(di), j.saturating_add(dj))).into_iter().flatten() {
                let (sb, vb) = (&strokes[b / 2], vertex(strokes, b));
                let near =
                    (va.screen - vb.screen).length() <= screen_gap && DVec3::distance(va.model, vb.model) <= model_gap;
                // A stroke may close on itself, if it is long enough to have an inside.
                let own = a / 2 == b / 2 && sa.points.len() < 4;
                let alike = |s: &Stroke| (s.surface, s.style, s.kind, s.level, s.qi);
                if b > a && near && !own && alike(sa) == alike(sb) {
                    pairs.push(Pair { ends: [a, b], turn: 1.0 + inward(strokes, a).dot(inward(strokes, b)) });
                }
            }
        }
    }
    pairs
}

/// Walks the links into chains, in the order of the lowest stroke of each.
fn follow(
    strokes: &[Stroke],
    links: &[[Option<usize>; 2]],
    points: &mut dyn FnMut(usize) -> Vec<StrokePoint>,
    draw: &mut dyn FnMut(Stroke) -> bool,
) {
    let mut used = vec![false; strokes.len()];
    for first in 0..strokes.len() {
        if used[first] {
            continue;
        }
        // Back to the beginning of the chain, or once round a closed one.
        let mut enter = 2 * first;
        while let Some(before) = links[enter / 2][enter % 2] {
            enter = before ^ 1;
            if enter / 2 == first {
                break;
            }
        }
        let start = enter / 2;
        let closed = links[enter / 2][enter % 2].is_some();
        let Stroke { kind, surface, style, level, qi, certainty, .. } = strokes[start];
        let mut joined = Stroke { kind, surface, style, level, qi, certainty, points: Vec::new() };
        loop {
            let k = enter / 2;
            used[k] = true;
            let mut own = points(k);
            if !enter.is_multiple_of(2) {
                own.reverse();
            }
            if joined.points.is_empty() {
                joined.points = own;
            } else {
                joined.points.extend(own.drain(1..));
            }
            joined.certainty = joined.certainty.max(strokes[k].certainty);
            match links[k][(enter % 2) ^ 1] {
                Some(next) if !used[next / 2] => enter = next,
                _ => break,
            }
        }
        if closed {
            // Ends within the gap become one vertex, so that the stroke closes exactly.
            let begin = joined.points[0];
            if let Some(last) = joined.points.last_mut() {
                *last = begin;
            }
        }
        if !draw(joined) {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Certainty, CurveKind};
    use super::*;

    fn stroke(points: &[[f64; 2]]) -> Stroke {
        let points = points
            .iter()
            .map(|p| StrokePoint { screen: DVec2::from_array(*p), model: DVec3::new(p[0], p[1], 0.0) })
            .collect();
        Stroke { kind: CurveKind::Iso, surface: 0, style: 0, level: 0, qi: 0, certainty: Certainty::Proven, points }
    }

    #[test]
    fn three_pieces_in_any_direction_become_one() {
        let got = chain(
            vec![
                stroke(&[[1.0, 0.0], [2.0, 0.0]]),
                stroke(&[[1.0, 0.0], [0.0, 0.0]]),
                stroke(&[[3.0, 0.0], [2.0, 0.0]]),
            ],
            1e-6,
            1e-6,
        );
        assert_eq!(got.len(), 1);
        let x: Vec<f64> = got[0].points.iter().map(|p| p.screen.x).collect();
        assert!(x == [0.0, 1.0, 2.0, 3.0] || x == [3.0, 2.0, 1.0, 0.0], "{x:?}");
    }

    #[test]
    fn at_a_crossing_each_goes_straight_on() {
        let arm = |x: f64, y: f64| stroke(&[[0.0, 0.0], [x, y]]);
        let got = chain(vec![arm(1.0, 0.0), arm(0.0, 1.0), arm(-1.0, 0.0), arm(0.0, -1.0)], 1e-6, 1e-6);
        assert_eq!(got.len(), 2);
        for s in &got {
            assert_eq!(s.points.len(), 3);
            assert!((s.points[0].screen + s.points[2].screen).length() < 1e-12);
        }
    }

    #[test]
    fn a_ring_of_pieces_closes() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let pieces = (0..4).map(|k| stroke(&[square[k], square[(k + 1) % 4]])).collect();
        let got = chain(pieces, 1e-6, 1e-6);
        assert_eq!(got.len(), 1);
        assert_eq!(got[0].points.len(), 5);
        assert_eq!(got[0].points[0], got[0].points[4]);
    }

    #[test]
    fn a_single_closed_stroke_stays_itself() {
        let got = chain(vec![stroke(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 0.0]])], 1e-6, 1e-6);
        assert_eq!(got.len(), 1);
        assert_eq!(got[0].points.len(), 4);
    }

    #[test]
    fn outlines_are_chained_as_the_strokes_are() {
        let wave = |from: f64, n: usize| {
            let points: Vec<[f64; 2]> = (0..=n).map(|k| [from + k as f64, (k % 3) as f64]).collect();
            stroke(&points)
        };
        let strokes = vec![wave(0.0, 9), wave(9.0, 3), wave(12.0, 6), wave(30.0, 1), wave(31.0, 2)];
        let mut outlines = strokes.clone();
        outlines.iter_mut().for_each(|s| s.points = outline(mem::take(&mut s.points)));
        assert!(outlines.iter().all(|s| s.points.len() <= 4));
        let mut drawn = Vec::new();
        chain_each(&outlines, 1e-6, 1e-6, &mut |k| strokes[k].points.clone(), &mut |s| {
            drawn.push(s);
            true
        });
        assert_eq!(drawn, chain(strokes, 1e-6, 1e-6));
        assert!(drawn.len() < 5);
    }

    #[test]
    fn strokes_that_meet_on_the_screen_only_stay_apart() {
        let mut far = stroke(&[[1.0, 0.0], [2.0, 0.0]]);
        for p in &mut far.points {
            p.model.z = 5.0;
        }
        assert_eq!(chain(vec![stroke(&[[0.0, 0.0], [1.0, 0.0]]), far], 1e-6, 1e-6).len(), 2);
    }
}
