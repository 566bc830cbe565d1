//! Strokes that continue one another become one.

use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::{Stroke, StrokePoint};

/// Joins strokes of one surface, of equal kind, level and invisibility, end to end. Ends count as one place if they are within `screen_gap` on
/// the screen and `model_gap` in space. Where more than two ends meet, the straightest pair is joined first.
/// Deterministic; O(n log n).
#[must_use]
pub fn chain(strokes: Vec<Stroke>, screen_gap: f64, model_gap: f64) -> Vec<Stroke> {
    let mut links = vec![[None; 2]; strokes.len()];
    let mut pairs = candidate_pairs(&strokes, screen_gap, model_gap);
    pairs.sort_by(|a, b| a.turn.total_cmp(&b.turn).then(a.ends.cmp(&b.ends)));
    for p in pairs {
        let [a, b] = p.ends;
        if links[a / 2][a % 2].is_none() && links[b / 2][b % 2].is_none() {
            links[a / 2][a % 2] = Some(b);
            links[b / 2][b % 2] = Some(a);
        }
    }
    follow(strokes, &links)
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
fn follow(strokes: Vec<Stroke>, links: &[[Option<usize>; 2]]) -> Vec<Stroke> {
    let mut used = vec![false; strokes.len()];
    let mut out = Vec::with_capacity(strokes.len());
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
        let mut joined = Stroke { points: Vec::new(), ..strokes[start].clone() };
        loop {
            let k = enter / 2;
            used[k] = true;
            let skip = usize::from(!joined.points.is_empty());
            let points = &strokes[k].points;
            if enter.is_multiple_of(2) {
                joined.points.extend(points.iter().skip(skip));
            } else {
                joined.points.extend(points.iter().rev().skip(skip));
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
        out.push(joined);
    }
    out
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
    fn strokes_that_meet_on_the_screen_only_stay_apart() {
        let mut far = stroke(&[[1.0, 0.0], [2.0, 0.0]]);
        for p in &mut far.points {
            p.model.z = 5.0;
        }
        assert_eq!(chain(vec![stroke(&[[0.0, 0.0], [1.0, 0.0]]), far], 1e-6, 1e-6).len(), 2);
    }
}
