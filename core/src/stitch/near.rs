//! Which sides come near one another: broad phase of the stitching.

use alloc::vec;
use alloc::vec::Vec;

use glam::DVec3;

use super::Side;
use crate::stop::Stop;

/// Boxes of a run that is not halved.
const LEAF: usize = 4;

/// Boxes in a tree: they are sorted so that every run that is halved again and again has the lower half, in the direction in
/// which their middles are widest apart, before the upper one.
struct Tree {
    /// Sides, with the corners of their boxes.
    boxes: Vec<(usize, DVec3, DVec3)>,
    /// In preorder: the lower half of a run follows it at once.
    runs: Vec<Run>,
}

struct Run {
    lo: DVec3,
    hi: DVec3,
    first: usize,
    count: usize,
    /// The run that follows when this one is rejected or done.
    next: usize,
}

impl Run {
    fn is_leaf(&self) -> bool {
        self.count <= LEAF
    }
}

impl Tree {
    /// O(n log n) in the number of boxes.
    fn new(boxes: Vec<(usize, DVec3, DVec3)>) -> Self {
        let mut tree = Self { boxes, runs: Vec::new() };
        let mut open = vec![(0, tree.boxes.len())];
        while let Some((first, count)) = open.pop() {
            let own = &mut tree.boxes[first..first + count];
            let middle = |b: &(usize, DVec3, DVec3)| b.1 + b.2;
            let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            let (mut least, mut most) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
            for b in own.iter() {
                (lo, hi) = (lo.min(b.1), hi.max(b.2));
                (least, most) = (least.min(middle(b)), most.max(middle(b)));
            }
            tree.runs.push(Run { lo, hi, first, count, next: 0 });
            if count > LEAF {
                let extent = most - least;
                let axis = (0..3).fold(0, |best, k| if extent[k] > extent[best] { k } else { best });
                let half = count / 2;
                own.select_nth_unstable_by(half, |a, b| {
                    middle(a)[axis].total_cmp(&middle(b)[axis]).then(a.0.cmp(&b.0))
                });
                open.push((first + half, count - half));
                open.push((first, half));
            }
        }
        // A run is followed by the first that begins where it ends.
        let mut after = vec![tree.runs.len(); tree.boxes.len() + 1];
        for index in (0..tree.runs.len()).rev() {
            let run = &mut tree.runs[index];
            run.next = after[run.first + run.count];
            after[run.first] = index;
        }
        tree
    }

    /// The sides whose boxes are as near as `tol` to a box, and which are `wanted`, in increasing order.
    fn near(&self, lo: DVec3, hi: DVec3, tol: f64, wanted: impl Fn(usize) -> bool) -> Vec<usize> {
        let margin = DVec3::splat(tol);
        let apart =
            |other_lo: DVec3, other_hi: DVec3| lo.cmpgt(other_hi + margin).any() || other_lo.cmpgt(hi + margin).any();
        let mut found = Vec::new();
        let mut at = 0;
        while let Some(run) = self.runs.get(at) {
            if apart(run.lo, run.hi) {
                at = run.next;
                continue;
            }
            if run.is_leaf() {
                let boxes = self.boxes[run.first..run.first + run.count].iter();
                found.extend(boxes.filter(|b| !apart(b.1, b.2) && wanted(b.0)).map(|b| b.0));
                at = run.next;
            } else {
                at += 1;
            }
        }
        found.sort_unstable();
        found
    }
}

/// Whether two sides may coincide along a part of them within `tol`; no for straight ones that only touch or cross.
///
/// What coincides does so between two ends of the one or the other: for straight sides, all along where they are beside
/// one another or nowhere. There are allowances of one `tol` for how far apart they are where both begin or end, and for
/// how far they go on beside one another.
fn may_coincide(side: &Side, other: &Side, tol: f64) -> bool {
    let (Some([a, b]), Some(ends)) = (side.straight, other.straight) else { return true };
    let along = b - a;
    let squared = along.length_squared();
    let [c, d] = ends.map(|p| ((p - a).dot(along) / squared).clamp(0.0, 1.0));
    let (from, to) = (a + along * c.min(d), a + along * c.max(d));
    let is_far = |p: DVec3| distance_to_segment(ends, p) > 2.0 * tol;
    from.distance(to) > tol && !is_far(from) && !is_far(to)
}

fn distance_to_segment([a, b]: [DVec3; 2], p: DVec3) -> f64 {
    let along = b - a;
    let at = ((p - a).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    p.distance(a + along * at)
}

/// For every side, the others with which it may coincide within `tol`, in increasing order: those whose boxes come as near,
/// but for straight ones that only touch. Cost: O(log n) a side and O(1) a pair whose boxes are near.
pub(super) fn near_pairs(sides: &[Side], tol: f64, stop: Stop<'_>) -> Vec<Vec<usize>> {
    let edges = sides.iter().enumerate().filter(|(_, side)| side.is_edge());
    let tree = Tree::new(edges.map(|(i, side)| (i, side.lo, side.hi)).collect());
    let of_side = |i: usize| {
        let side = &sides[i];
        if !side.is_edge() || stop.is_wanted() {
            return Vec::new();
        }
        // Asked before it is kept: at the middle of a fan there are as many pairs as the square of its sides.
        tree.near(side.lo, side.hi, tol, |j| j != i && may_coincide(side, &sides[j], tol))
    };
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        (0..sides.len()).into_par_iter().map(of_side).collect()
    }
    #[cfg(not(feature = "parallel"))]
    (0..sides.len()).map(of_side).collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn straight(ends: [DVec3; 2]) -> Side {
        let line =
            crate::line::Line { surface: 0, axis: crate::line::Axis::U, value: 0.0, below: false, spans: Vec::new() };
        Side {
            path: super::super::SidePath::Line(line),
            kept: vec![[0.0, 1.0]],
            shared: Vec::new(),
            collapsed: false,
            lo: ends[0].min(ends[1]),
            hi: ends[0].max(ends[1]),
            straight: Some(ends),
        }
    }

    #[test]
    fn straight_sides_that_touch_or_cross_do_not_coincide() {
        let point = |x: f64, y: f64| DVec3::new(x, y, 0.3 * x);
        let base = straight([point(0.0, 0.0), point(1.0, 0.0)]);
        let table = [
            ([point(0.0, 0.0), point(1.0, 0.0)], true),
            ([point(2.0, 0.0), point(0.5, 0.0)], true),
            ([point(0.3, 0.0009), point(0.4, -0.0009)], true),
            ([point(-3.0, 0.0), point(4.0, 0.0)], true),
            // At an end, at a small angle and a large one, and one after the other.
            ([point(0.0, 0.0), point(1.0, 0.01)], false),
            ([point(0.0, 0.0), point(0.0, 1.0)], false),
            ([point(1.0, 0.0), point(2.0, 0.0)], false),
            // In between.
            ([point(0.5, 0.0), point(0.7, 0.1)], false),
            ([point(0.0, -0.01), point(1.0, 0.01)], false),
        ];
        for (ends, expected) in table {
            let other = straight(ends);
            assert_eq!(may_coincide(&base, &other, 1e-3), expected, "{ends:?}");
            assert_eq!(may_coincide(&other, &base, 1e-3), expected, "{ends:?}");
        }
    }

    proptest! {
        /// Against all pairs, on a lattice where many boxes touch.
        #[test]
        fn every_near_box_is_found(
            corners in prop::collection::vec((prop::array::uniform3(-4_i32..4), prop::array::uniform3(0_i32..3)), 0..80),
            tol in prop::sample::select(vec![0.0, 0.5]),
        ) {
            let vector = |x: [i32; 3]| DVec3::from_array(x.map(f64::from));
            // Every other number is that of no side.
            let boxes: Vec<_> = corners.iter().enumerate()
                .map(|(k, &(lo, size))| (2 * k, vector(lo), vector(lo) + vector(size))).collect();
            let tree = Tree::new(boxes.clone());
            for &(own, lo, hi) in &boxes {
                let meets = |b: &&(usize, DVec3, DVec3)| {
                    b.0 != own && lo.cmple(b.2 + tol).all() && b.1.cmple(hi + tol).all()
                };
                let expected: Vec<usize> = boxes.iter().filter(meets).map(|b| b.0).collect();
                prop_assert_eq!(tree.near(lo, hi, tol, |k| k != own), expected);
            }
        }
    }
}
