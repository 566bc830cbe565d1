//! The path of the pen through what is on the paper.

use super::{Effort, join, order};
use crate::drawing::Polyline;

/// How the pen goes through polylines.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PenPath {
    /// What their order is to be good at, and how long may be searched for it.
    pub effort: Effort,
    /// Width of the pen in mm where isocurves are hatches: they are joined along outlines of this width.
    pub hatched_mm: Option<f64>,
}

impl PenPath {
    /// Orders polylines for the pen, and joins hatches. `stops` is asked now and then whether to end with what has been found. Cost: that of
    /// [`order`].
    #[must_use]
    pub fn through(&self, polylines: Vec<Polyline>, stops: &dyn Fn() -> bool) -> Vec<Polyline> {
        let ordered = order(polylines, &self.effort, stops);
        match self.hatched_mm {
            Some(width_mm) => join(ordered, width_mm),
            None => ordered,
        }
    }
}
