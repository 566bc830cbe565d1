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

    /// The sides whose boxes are not `apart` from what is looked for, in no order, each as often as it has such boxes. What is
    /// apart from a box has to be so from all boxes within it.
    fn search(&self, apart: impl Fn(DVec3, DVec3) -> bool) -> Vec<usize> {
        let mut found = Vec::new();
        let mut at = 0;
        while let Some(run) = self.runs.get(at) {
            if apart(run.lo, run.hi) {
                at = run.next;
                continue;
            }
            if run.is_leaf() {
                let boxes = self.boxes[run.first..run.first + run.count].iter();
                found.extend(boxes.filter(|b| !apart(b.1, b.2)).map(|b| b.0));
                at = run.next;
            } else {
                at += 1;
            }
        }
        found
    }
}

/// Least cosine of the angle between straight sides that coincide: at a larger angle the feet of the one run along the other
/// less than half as far.
const ALONG: f64 = 0.5;

/// Whether two sides may coincide along a part of them within `tol`; no for straight ones that only touch or cross.
///
/// What coincides does so between two ends of the one or the other: for straight sides, all along where they are beside
/// one another or nowhere. There are allowances of one `tol` for how far apart they are where both begin or end, and for
/// how far they go on beside one another.
fn may_coincide(side: &Side, other: &Side, tol: f64) -> bool {
    let (Some([a, b]), Some(ends)) = (side.straight, other.straight) else { return true };
    let (along, other) = (b - a, ends[1] - ends[0]);
    let squared = along.length_squared();
    let dot = along.dot(other);
    if dot * dot < ALONG * ALONG * squared * other.length_squared() {
        return false;
    }
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

/// Whether a segment has a point in a box.
fn enters([a, b]: [DVec3; 2], lo: DVec3, hi: DVec3) -> bool {
    let along = b - a;
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for k in 0..3 {
        if along[k] == 0.0 {
            if a[k] < lo[k] || hi[k] < a[k] {
                return false;
            }
        } else {
            let [x, y] = [(lo[k] - a[k]) / along[k], (hi[k] - a[k]) / along[k]];
            (from, to) = (from.max(x.min(y)), to.min(x.max(y)));
        }
    }
    from <= to
}

/// Where sides are: bent ones by their boxes, straight ones by their ends and middles.
///
/// Two straight sides coincide on more than a `tol` only if an end of one of them is beside the other, off its ends, or both
/// have both ends in common, and so their middles. Boxes would not do for them: those of all sides of a fan meet in its
/// middle, and there would be as many pairs as the square of their number.
struct Index<'a> {
    sides: &'a [Side],
    tol: f64,
    bent: Tree,
    ends: Tree,
    middles: Tree,
}

impl<'a> Index<'a> {
    fn new(sides: &'a [Side], tol: f64) -> Self {
        let edges = || sides.iter().enumerate().filter(|(_, side)| side.is_edge());
        let straight = || edges().filter_map(|(i, side)| Some((i, side.straight?)));
        let bent = edges().filter(|(_, side)| side.straight.is_none()).map(|(i, side)| (i, side.lo, side.hi));
        let ends = straight().flat_map(|(i, ends)| ends.map(|p| (i, p, p)));
        let middles = straight().map(|(i, [a, b])| (i, a.midpoint(b), a.midpoint(b)));
        let [bent, ends, middles] =
            [Tree::new(bent.collect()), Tree::new(ends.collect()), Tree::new(middles.collect())];
        Self { sides, tol, bent, ends, middles }
    }

    /// Of the pairs of sides that may coincide those with side `i` that it finds: its bent partners, and straight ones that end
    /// beside it or have its ends. What it does not find the other one of the pair does. In no order, and some are no pairs.
    fn candidates(&self, i: usize) -> Vec<usize> {
        let (side, tol) = (&self.sides[i], self.tol);
        let margin = DVec3::splat(tol);
        let mut found = self.bent.search(|lo, hi| side.lo.cmpgt(hi + margin).any() || lo.cmpgt(side.hi + margin).any());
        if let Some(own) = side.straight {
            // An end that is off a straight side by twice the tolerance, across the other side, is off by no more than that
            // over the least cosine.
            let wide = DVec3::splat(2.0 / ALONG * tol);
            let at_end = |p: DVec3, lo: DVec3, hi: DVec3| (p - lo).abs().max((p - hi).abs()).length() <= 0.5 * tol;
            found.extend(self.ends.search(|lo, hi| {
                !enters(own, lo - wide, hi + wide) || at_end(own[0], lo, hi) || at_end(own[1], lo, hi)
            }));
            let middle = own[0].midpoint(own[1]);
            found.extend(
                self.middles.search(|lo, hi| (middle + margin).cmplt(lo).any() || (middle - margin).cmpgt(hi).any()),
            );
        }
        found.retain(|&j| j != i);
        found
    }
}

/// For every side, the others with which it may coincide within `tol`, in increasing order: those whose boxes come as near,
/// but for straight ones that only touch or cross. Cost: O(log n) a side, and O(1) a pair of which one is bent and whose boxes
/// are near, or of which one ends beside the other.
pub(super) fn near_pairs(sides: &[Side], tol: f64, stop: Stop<'_>) -> Vec<Vec<usize>> {
    let index = Index::new(sides, tol);
    let of_side = |i: usize| {
        if !sides[i].is_edge() || stop.is_wanted() {
            return Vec::new();
        }
        index.candidates(i)
    };
    #[cfg(feature = "parallel")]
    let found: Vec<Vec<usize>> = {
        use rayon::prelude::*;
        (0..sides.len()).into_par_iter().map(of_side).collect()
    };
    #[cfg(not(feature = "parallel"))]
    let found: Vec<Vec<usize>> = (0..sides.len()).map(of_side).collect();
    let mut near = vec![Vec::new(); sides.len()];
    for (i, candidates) in found.into_iter().enumerate() {
        for j in candidates {
            for (own, other) in [(i, j), (j, i)] {
                if may_coincide(&sides[own], &sides[other], tol) {
                    near[own].push(other);
                }
            }
        }
    }
    for list in &mut near {
        list.sort_unstable();
        list.dedup();
    }
    near
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
                let meets = |b: &&(usize, DVec3, DVec3)| lo.cmple(b.2 + tol).all() && b.1.cmple(hi + tol).all();
                let expected: Vec<usize> = boxes.iter().filter(meets).map(|b| b.0).collect();
                let mut found = tree.search(|l, h| lo.cmpgt(h + tol).any() || l.cmpgt(hi + tol).any());
                found.sort_unstable();
                prop_assert_eq!(found, expected, "{}", own);
            }
        }

        /// Against all pairs: on a lattice, moved by up to two tolerances, where many sides end in common or beside another.
        #[test]
        fn every_pair_of_straight_sides_that_may_coincide_is_found(
            ends in prop::collection::vec(
                prop::array::uniform2((prop::array::uniform3(-2_i32..3), prop::array::uniform3(-2.0..2.0_f64))), 0..60),
            spread in prop::sample::select(vec![0.0, 0.3, 1.0]),
        ) {
            let tol = 1e-3;
            let point = |(at, off): ([i32; 3], [f64; 3])| {
                DVec3::from_array(at.map(f64::from)) + spread * tol * DVec3::from_array(off)
            };
            let sides: Vec<Side> = ends.into_iter().map(|e| e.map(point))
                .filter(|[a, b]| a.distance(*b) > tol).map(straight).collect();
            let near = near_pairs(&sides, tol, Stop::NEVER);
            for (i, side) in sides.iter().enumerate() {
                let pair = |&j: &usize| j != i && may_coincide(side, &sides[j], tol);
                let expected: Vec<usize> = (0..sides.len()).filter(pair).collect();
                prop_assert_eq!(&near[i], &expected, "{}", i);
            }
        }
    }

    #[test]
    fn in_a_fan_every_side_finds_its_twin_and_looks_at_few_others() {
        let count = 2000;
        let spoke = |k: usize| {
            let angle = core::f64::consts::TAU * (k / 2) as f64 / count as f64;
            straight([DVec3::new(0.1, 0.2, 0.3), DVec3::new(libm::cos(angle), libm::sin(angle), 0.0)])
        };
        let sides: Vec<Side> = (0..2 * count).map(spoke).collect();
        let index = Index::new(&sides, 1e-6);
        let looked_at: usize = (0..sides.len()).map(|i| index.candidates(i).len()).sum();
        assert!(looked_at <= 4 * sides.len(), "{looked_at}");
        for (i, near) in near_pairs(&sides, 1e-6, Stop::NEVER).into_iter().enumerate() {
            assert_eq!(near, [i ^ 1]);
        }
    }
}
