//! Points that lie on line segments.

use glam::DVec3;

/// Points in a tree of boxes, to be asked which of them lie on a segment.
///
/// The points are sorted so that every run of them that is halved again and again has the lower half, in the direction in
/// which the run is widest, before the upper one; a run of a few is a leaf.
pub(super) struct PointsOnEdges {
    points: Vec<(u32, DVec3)>,
    /// Boxes of the runs, a run before its halves: the lower half follows it at once, the upper one at `upper`.
    runs: Vec<Run>,
}

struct Run {
    low: DVec3,
    high: DVec3,
    first: usize,
    count: usize,
    /// Index of the run that is its upper half; 0 for a leaf.
    upper: usize,
}

/// Points of a leaf.
const LEAF: usize = 8;

/// A point on a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OnEdge {
    /// Its index.
    pub(super) point: u32,
    /// Where on the segment it is, from 0 to 1, ends not included.
    pub(super) at: f64,
    /// Distance from it.
    pub(super) distance: f64,
}

impl PointsOnEdges {
    /// Sorts the points. Cost: O(n log² n).
    pub(super) fn new(points: impl Iterator<Item = (u32, DVec3)>) -> Self {
        let mut tree = Self { points: points.collect(), runs: Vec::new() };
        // Runs that are still to be parted, each with the run of which it is the upper half.
        let mut open = vec![(0, tree.points.len(), None)];
        while let Some((first, count, parent)) = open.pop() {
            let own = &mut tree.points[first..first + count];
            let low = own.iter().fold(DVec3::INFINITY, |low, p| low.min(p.1));
            let high = own.iter().fold(DVec3::NEG_INFINITY, |high, p| high.max(p.1));
            let index = tree.runs.len();
            if let Some(parent) = parent {
                let parent: &mut Run = &mut tree.runs[parent];
                parent.upper = index;
            }
            tree.runs.push(Run { low, high, first, count, upper: 0 });
            if count > LEAF {
                let extent = high - low;
                let axis = (0..3).fold(0, |best, k| if extent[k] > extent[best] { k } else { best });
                own.sort_by(|a, b| a.1[axis].total_cmp(&b.1[axis]).then(a.0.cmp(&b.0)));
                let half = count / 2;
                // The lower half is taken next, and so stands next to its run.
                open.push((first + half, count - half, Some(index)));
                open.push((first, half, None));
            }
        }
        tree
    }

    /// The points within `tolerance` of the segment from `a` to `b` that are beside neither end, in their order along it.
    pub(super) fn on(&self, a: DVec3, b: DVec3, tolerance: f64) -> Vec<OnEdge> {
        let along = b - a;
        let square = along.length_squared();
        let mut found = Vec::new();
        let mut open = vec![0];
        while let Some(index) = open.pop() {
            let Some(run) = self.runs.get(index) else { continue };
            if !meets_box(a, along, run.low - tolerance, run.high + tolerance) {
                continue;
            }
            if run.upper != 0 {
                open.extend([index + 1, run.upper]);
                continue;
            }
            for &(point, p) in &self.points[run.first..run.first + run.count] {
                let at = (p - a).dot(along) / square;
                let distance = p.distance(a + along * at);
                if 0.0 < at && at < 1.0 && distance <= tolerance {
                    found.push(OnEdge { point, at, distance });
                }
            }
        }
        found.sort_by(|x, y| x.at.total_cmp(&y.at).then(x.point.cmp(&y.point)));
        found
    }
}

/// Whether the segment from `a` along `along` meets a box.
fn meets_box(a: DVec3, along: DVec3, low: DVec3, high: DVec3) -> bool {
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for k in 0..3 {
        if along[k] == 0.0 {
            if a[k] < low[k] || a[k] > high[k] {
                return false;
            }
            continue;
        }
        let (s, t) = ((low[k] - a[k]) / along[k], (high[k] - a[k]) / along[k]);
        from = from.max(s.min(t));
        to = to.min(s.max(t));
    }
    // The quotients are known to rounding; what touches a box is let in.
    from <= to + 8.0 * f64::EPSILON
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// Against all points, on a lattice where many lie on each segment.
        #[test]
        fn every_point_is_asked(
            points in prop::collection::vec(prop::array::uniform3(-3_i32..3), 0..120),
            ends in prop::array::uniform2(prop::array::uniform3(-4_i32..4)),
            tolerance in prop::sample::select(vec![1e-9, 0.3])
        ) {
            let points: Vec<DVec3> = points.iter().map(|p| DVec3::from(p.map(f64::from))).collect();
            let [a, b] = ends.map(|p| DVec3::from(p.map(f64::from)));
            prop_assume!(a != b);
            let tree = PointsOnEdges::new(points.iter().enumerate().map(|(k, &p)| (k as u32, p)));
            let mut found: Vec<u32> = tree.on(a, b, tolerance).iter().map(|f| f.point).collect();
            found.sort_unstable();
            let is_on = |p: DVec3| {
                let at = (p - a).dot(b - a) / (b - a).length_squared();
                0.0 < at && at < 1.0 && (p - a).cross(b - a).length() <= tolerance * (b - a).length()
            };
            let expected: Vec<u32> = (0..points.len()).filter(|&k| is_on(points[k])).map(|k| k as u32).collect();
            prop_assert_eq!(found, expected);
        }
    }
}
