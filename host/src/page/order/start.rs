//! First orders, for a search to begin with.

use glam::DVec2;

use super::kdtree::KdTree;
use super::stroke::{Stroke, Visit};
use super::tour::End;

/// Neighbours that an end may be linked to, at most.
const NEAR: usize = 8;

/// Strokes linked by the shortest ways between their ends, one after the other wherever they are; ends 2i and 2i + 1 are of stroke i. Gives the ends at
/// which they begin, in order.
///
/// Cost: ends of chains find their neighbours again when theirs are linked, which is soon for few of them only; O(n log n) on average.
pub(super) fn greedy(points: &[DVec2]) -> Vec<End> {
    let mut link: Vec<Option<End>> = vec![None; points.len()];
    // Of ends of chains, the other end of the chain.
    let mut other: Vec<End> = (0..points.len() as u32).map(|e| e ^ 1).collect();
    let mut open: Vec<End> = (0..points.len() as u32).collect();
    let (mut found, mut ways) = (Vec::new(), Vec::new());
    while open.len() > 2 {
        let tree = KdTree::new(points, open.clone());
        ways.clear();
        for &e in &open {
            let is_other_chain = |o: End| o != e && other[e as usize] != o;
            tree.nearest(points[e as usize], NEAR, is_other_chain, &mut found);
            ways.extend(found.iter().map(|&(distance, o)| (distance, e.min(o), e.max(o))));
        }
        ways.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        // The shortest way is always taken, so that the chains become fewer.
        for &(_, a, b) in &ways {
            if link[a as usize].is_some() || link[b as usize].is_some() || other[a as usize] == b {
                continue;
            }
            (link[a as usize], link[b as usize]) = (Some(b), Some(a));
            let (p, q) = (other[a as usize], other[b as usize]);
            (other[p as usize], other[q as usize]) = (q, p);
        }
        open.retain(|&e| link[e as usize].is_none());
    }
    let mut order = Vec::with_capacity(points.len() / 2);
    let mut next = open.first().copied();
    while let Some(end) = next {
        order.push(end);
        next = link[(end ^ 1) as usize];
    }
    order
}

/// From a place always on to the nearest end of what is left, of closed strokes the nearest vertex. Ties go to the earlier stroke.
///
/// Cost: O(v log v) on average in the vertices that a stroke can begin with.
pub(super) fn nearest(strokes: &[Stroke<'_>], from: DVec2) -> Vec<Visit> {
    // Vertices that a stroke can begin with, those of a stroke together.
    let (mut points, mut owners, mut firsts) = (Vec::new(), Vec::new(), Vec::with_capacity(strokes.len()));
    for (stroke, s) in strokes.iter().enumerate() {
        firsts.push(points.len());
        points.extend((0..s.starts()).map(|start| s.start(start)));
        owners.resize(points.len(), stroke as u32);
    }
    let mut tree = KdTree::new(&points, (0..points.len() as u32).collect());
    let (mut at, mut found) = (from, Vec::new());
    let mut visits = Vec::with_capacity(strokes.len());
    loop {
        tree.nearest(at, 1, |_| true, &mut found);
        let Some(&(_, item)) = found.first() else { return visits };
        let stroke = owners[item as usize];
        let s = &strokes[stroke as usize];
        let first = firsts[stroke as usize];
        let visit = s.visit(stroke, item as usize - first);
        for item in first..first + s.starts() {
            tree.remove(item as u32);
        }
        at = s.end(visit);
        visits.push(visit);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The same rule without a tree.
    fn slow(strokes: &[Stroke<'_>], from: DVec2) -> Vec<Visit> {
        let (mut at, mut visits) = (from, Vec::new());
        let mut left: Vec<u32> = (0..strokes.len() as u32).collect();
        while !left.is_empty() {
            let mut best = (f64::INFINITY, 0, 0);
            for &k in &left {
                for start in 0..strokes[k as usize].starts() {
                    let candidate = (at.distance_squared(strokes[k as usize].start(start)), k, start);
                    if candidate < best {
                        best = candidate;
                    }
                }
            }
            let visit = strokes[best.1 as usize].visit(best.1, best.2);
            left.retain(|k| *k != best.1);
            at = strokes[best.1 as usize].end(visit);
            visits.push(visit);
        }
        visits
    }

    fn points() -> impl Strategy<Value = Vec<DVec2>> {
        prop::collection::vec((0_u32..30, -20_i32..20).prop_map(|(x, y)| DVec2::new(x.into(), y.into())), 2..5)
    }

    proptest! {
        #[test]
        fn the_tree_finds_the_nearest(lines in prop::collection::vec((points(), any::<bool>()), 0..60)) {
            let lines: Vec<Vec<DVec2>> = lines
                .into_iter()
                .map(|(mut line, close)| {
                    line.extend(close.then_some(line[0]));
                    line
                })
                .collect();
            let strokes: Vec<_> = lines.iter().map(|l| Stroke::new(l)).collect();
            prop_assert_eq!(nearest(&strokes, DVec2::ZERO), slow(&strokes, DVec2::ZERO));
        }

        #[test]
        fn greedy_takes_every_stroke_once_and_the_shortest_way(
            points in prop::collection::vec((0_u32..20, 0_u32..20), 0..60)
        ) {
            let even = points.len() / 2 * 2;
            let points: Vec<DVec2> = points[..even].iter().map(|&(x, y)| DVec2::new(x.into(), y.into())).collect();
            let order = greedy(&points);
            let mut seen: Vec<_> = order.iter().map(|e| e / 2).collect();
            seen.sort_unstable();
            prop_assert_eq!(seen, (0..even as u32 / 2).collect::<Vec<_>>());
            let way = |a: u32, b: u32| points[a as usize].distance(points[b as usize]);
            let all = (0..even as u32).flat_map(|a| (0..even as u32).map(move |b| (a, b))).filter(|(a, b)| a / 2 != b / 2);
            let shortest = all.map(|(a, b)| way(a, b)).fold(f64::INFINITY, f64::min);
            let taken = order.windows(2).map(|w| way(w[0] ^ 1, w[1])).fold(f64::INFINITY, f64::min);
            prop_assert_eq!(taken, shortest);
        }
    }
}
