//! The path of the pen through what is on the paper.

use super::{Effort, join, merge, order};
use crate::drawing::Polyline;
use crate::pens::Pens;

/// Share of a pen's width over which ends are joined when nothing is said. The ink of the two ends, round as the pen, covers such a gap but for 3 % of
/// the width on either side, which for fine pens is less than the tolerance of curves.
const GAP_SHARE: f64 = 1.0 / 3.0;

/// What is asked of the path of the pen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathChoice {
    /// What the order of strokes is to be good at, and how long may be searched for it.
    pub effort: Effort,
    /// Largest gap in mm over which ends of strokes are joined, 0 for none; a third of the thinnest pen's width if nothing is said.
    pub merge_mm: Option<f64>,
}

/// How the pen goes through polylines.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PenPath {
    /// What their order is to be good at, and how long may be searched for it.
    pub effort: Effort,
    /// Largest gap in mm over which ends of strokes are joined; 0 for none.
    pub merge_mm: f64,
    /// Whether hidden polylines are joined too. They must not be where some are dashes, whose gaps are meant.
    pub merges_hidden: bool,
    /// Width of the pen in mm where isocurves are hatches: they are joined along outlines of this width.
    pub hatched_mm: Option<f64>,
}

impl PathChoice {
    /// The path through polylines that these pens draw.
    #[must_use]
    pub fn settle(&self, polylines: &[Polyline], pens: &Pens) -> PenPath {
        let thinnest = || polylines.iter().map(|p| pens.width_mm(p.pen)).reduce(f64::min).unwrap_or(0.0);
        let merge_mm = self.merge_mm.unwrap_or_else(|| GAP_SHARE * thinnest());
        PenPath { effort: self.effort, merge_mm, ..PenPath::default() }
    }
}

impl PenPath {
    /// Joins polylines whose ends meet, orders them for the pen, and joins hatches. `stops` is asked now and then whether to end with what has been
    /// found. Cost: that of [`order`] and [`merge`].
    #[must_use]
    pub fn through(&self, polylines: Vec<Polyline>, stops: &dyn Fn() -> bool) -> Vec<Polyline> {
        let merged = merge(polylines, self.merge_mm, self.merges_hidden);
        let ordered = order(merged, &self.effort, stops);
        match self.hatched_mm {
            Some(width_mm) => join(ordered, width_mm),
            None => ordered,
        }
    }
}
