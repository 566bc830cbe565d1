//! Where strokes begin and end, and what the ways between them cost.

use std::iter;
use std::ops::Range;

use glam::DVec2;

use super::cost::{Measure, Scale};
use super::kdtree::KdTree;
use super::tour::End;

/// Neighbours of each end that a search goes to.
pub(super) const NEAR: usize = 8;

/// Where the pen comes from before the strokes, and where it goes after them; none where that does not count.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rest {
    /// Before the first stroke.
    pub before: Option<DVec2>,
    /// After the last one.
    pub after: Option<DVec2>,
}

/// The ends of strokes, and as the last stroke the rest of the pen, which makes a round of their order: it begins where the pen goes to after the
/// strokes, and ends where it comes from.
pub(super) struct Ends {
    points: Vec<DVec2>,
    /// Whether the rest's ends cost nothing wherever they are.
    free: [bool; 2],
    scale: Scale,
}

impl Ends {
    /// From two points a stroke.
    pub(super) fn new(mut points: Vec<DVec2>, rest: Rest, measure: Measure) -> Self {
        let free = [rest.after.is_none(), rest.before.is_none()];
        points.extend([rest.after, rest.before].map(|at| at.unwrap_or(DVec2::ZERO)));
        let low = points.iter().copied().fold(DVec2::INFINITY, DVec2::min);
        let high = points.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
        let scale = Scale::new(measure, low.distance(high), points.len());
        Self { points, free, scale }
    }

    /// The rest's first end.
    fn rest(&self) -> End {
        self.points.len() as u32 - 2
    }

    /// All of them.
    pub(super) fn all(&self) -> Range<End> {
        0..self.points.len() as u32
    }

    fn is_free(&self, end: End) -> bool {
        end >= self.rest() && self.free[(end - self.rest()) as usize]
    }

    /// Cost of the way between two ends.
    pub(super) fn cost(&self, a: End, b: End) -> i64 {
        if self.is_free(a.max(b)) {
            return 0;
        }
        self.scale.between(self.points[a as usize], self.points[b as usize])
    }

    /// The [`NEAR`] nearest ends of each end but those of its own stroke, by what the ways to them cost; where there are fewer, the end itself follows.
    /// Costs O(n log n).
    pub(super) fn neighbours(&self) -> Vec<End> {
        let tree = KdTree::new(&self.points, self.all().filter(|&e| !self.is_free(e)).collect());
        let mut found = Vec::new();
        let mut all = Vec::with_capacity(self.points.len() * NEAR);
        for end in self.all() {
            found.clear();
            if !self.is_free(end) {
                tree.nearest(self.points[end as usize], NEAR, |other| other >> 1 != end >> 1, &mut found);
                found.sort_by_key(|f| self.cost(end, f.1));
            }
            all.extend(found.iter().map(|f| f.1));
            all.extend(iter::repeat_n(end, NEAR - found.len()));
        }
        all
    }
}
