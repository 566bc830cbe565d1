//! The path of the pen through what is on the paper.

use super::{Effort, draw_once, join, merge, order};
use crate::drawing::Polyline;
use crate::drawing::simplify::simplify;
use crate::emit::SLACK_PART;
use crate::pens::Pens;

/// Share of a pen's width over which ends are joined when nothing is said. The ink of the two ends, round as the pen, covers such a gap but for 3 % of
/// the width on either side, which for fine pens is less than the tolerance of curves.
const GAP_SHARE: f64 = 1.0 / 3.0;

/// Share of the tolerance of a drawing that is left to vertices that are left out. It is small, as chords that follow a curve are all needed, and only
/// runs that are straight are not.
const SIMPLIFIED_SHARE: f64 = 0.1;

/// How the tolerance of a drawing is shared out, each share in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shares {
    /// All of it: largest distance between a curve and what is drawn of it.
    pub whole_mm: f64,
    /// Between a curve and the polyline that it is traced by.
    pub traced_mm: f64,
    /// Between that and what is left of it when vertices in straight runs are left out.
    pub simplified_mm: f64,
    /// Between that and the arcs that are fitted to it, see [`Drawing::slack_mm`](crate::drawing::Drawing::slack_mm).
    pub slack_mm: f64,
}

impl Shares {
    /// Those of a drawing to which arcs are to be fitted (`curved`) or not. Arcs follow the vertices: the polylines are to be near the curves themselves,
    /// and the fit leaves out vertices by itself.
    #[must_use]
    pub fn of(whole_mm: f64, curved: bool) -> Self {
        if curved {
            let slack_mm = SLACK_PART * whole_mm;
            Self { whole_mm, traced_mm: whole_mm - slack_mm, simplified_mm: 0.0, slack_mm }
        } else {
            let traced_mm = whole_mm * (1.0 - SIMPLIFIED_SHARE);
            Self { whole_mm, traced_mm, simplified_mm: SIMPLIFIED_SHARE * whole_mm, slack_mm: 0.0 }
        }
    }
}

/// What is asked of the path of the pen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PathChoice {
    /// What the order of strokes is to be good at, and how long may be searched for it.
    pub effort: Effort,
    /// Largest gap in mm over which ends of strokes are joined, a third of the thinnest pen's width if nothing is said; 0 to leave strokes as they are.
    pub merge_mm: Option<f64>,
}

/// What becomes of strokes before they are ordered. By default nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Joining {
    /// Distance in mm within which lines are one and the same, and drawn once; see [`draw_once`].
    pub same_mm: f64,
    /// Largest gap in mm over which ends of strokes are joined; see [`merge`].
    pub gap_mm: f64,
    /// Largest distance in mm of vertices that are left out from what is drawn.
    pub chord_mm: f64,
    /// Whether hidden polylines are joined too. They must not be where some are dashes, whose gaps are meant.
    pub hidden: bool,
}

/// How the pen goes through polylines.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PenPath {
    /// What becomes of them before they are ordered.
    pub joining: Joining,
    /// What their order is to be good at, and how long may be searched for it.
    pub effort: Effort,
    /// Width of the pen in mm where isocurves are hatches: they are joined along outlines of this width.
    pub hatched_mm: Option<f64>,
}

impl PathChoice {
    /// The path through polylines that these pens draw, and that were traced within their share of a tolerance; within all of it, two stand for the same.
    #[must_use]
    pub fn settle(&self, polylines: &[Polyline], pens: &Pens, shares: &Shares) -> PenPath {
        let thinnest = || polylines.iter().map(|p| pens.width_mm(p.pen)).reduce(f64::min).unwrap_or(0.0);
        let gap_mm = self.merge_mm.unwrap_or_else(|| GAP_SHARE * thinnest());
        let joining = if gap_mm > 0.0 {
            Joining { same_mm: shares.whole_mm, gap_mm, chord_mm: shares.simplified_mm, hidden: false }
        } else {
            Joining::default()
        };
        PenPath { joining, effort: self.effort, hatched_mm: None }
    }
}

impl Joining {
    /// Draws once what is there twice, joins polylines whose ends meet, and leaves out vertices that are not needed. `stops` is asked now and then
    /// whether to leave the rest as it is.
    #[must_use]
    pub fn join(&self, polylines: Vec<Polyline>, stops: &dyn Fn() -> bool) -> Vec<Polyline> {
        let once = draw_once(polylines, self.same_mm, self.hidden, stops);
        let mut merged = merge(once, self.gap_mm, self.hidden);
        if self.chord_mm > 0.0 {
            merged.iter_mut().for_each(|polyline| simplify(polyline, self.chord_mm));
        }
        merged
    }
}

impl PenPath {
    /// Joins polylines, orders them for the pen, and joins hatches. `stops` is asked now and then whether to end with what has been found. Cost: that
    /// of [`draw_once`], [`merge`] and [`order`].
    #[must_use]
    pub fn through(&self, polylines: Vec<Polyline>, stops: &dyn Fn() -> bool) -> Vec<Polyline> {
        let ordered = order(self.joining.join(polylines, stops), &self.effort, stops);
        match self.hatched_mm {
            Some(width_mm) => join(ordered, width_mm),
            None => ordered,
        }
    }
}
