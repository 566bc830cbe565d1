//! The order of drawing, in which the pen travels little.
//!
//! [`route`] finds it for the strokes of a pen: a [first order](start), which a [local search](search) makes better over a [round](tour) of
//! strokes and their [neighbours](kdtree), by [turns](closed) with where closed strokes begin.

mod closed;
mod cost;
mod ends;
mod kdtree;
mod route;
mod search;
mod start;
mod stroke;
mod tour;

pub use cost::Measure;
pub use ends::Rest;
pub use route::{Effort, route};
pub use stroke::Visit;

use glam::DVec2;

use crate::drawing::Polyline;

impl Default for Effort {
    /// The length of ways, and a second.
    fn default() -> Self {
        Self { measure: Measure::Distance, seconds: 1.0, seed: 0 }
    }
}

/// Orders polylines so that the pen travels little: pen by pen, level by level, from the lower left corner through all of them and back, as the
/// travel is counted. Polylines are turned, and closed ones begun elsewhere, where that is shorter.
///
/// Each level begins where the one before it has ended; the effort goes to them by their number of polylines. No level becomes longer
/// than in the given order. Cost: that of [`route`].
#[must_use]
pub fn order(polylines: Vec<Polyline>, effort: &Effort, stops: &dyn Fn() -> bool) -> Vec<Polyline> {
    let turn_of = |p: &Polyline| (p.pen, p.level);
    let mut left: Vec<Polyline> = polylines.into_iter().filter(|p| !p.page.is_empty()).collect();
    let count = left.len();
    left.sort_by_key(turn_of);
    let mut ordered = Vec::with_capacity(count);
    let mut at = DVec2::ZERO;
    while let Some(first) = left.first() {
        let turn = turn_of(first);
        let rest = left.split_off(left.partition_point(|p| turn_of(p) == turn));
        let pages: Vec<&[DVec2]> = left.iter().map(|p| p.page.as_slice()).collect();
        let effort = Effort { seconds: effort.seconds * pages.len() as f64 / count as f64, ..*effort };
        let after = rest.is_empty().then_some(DVec2::ZERO);
        let visits = route(&pages, Rest { before: Some(at), after }, &effort, stops);
        let mut strokes: Vec<Option<Polyline>> = left.into_iter().map(Some).collect();
        for visit in visits {
            let Some(mut polyline) = strokes.get_mut(visit.stroke as usize).and_then(Option::take) else { continue };
            begin_at(&mut polyline, visit.vertex as usize);
            at = polyline.page.last().copied().unwrap_or(at);
            ordered.push(polyline);
        }
        left = rest;
    }
    ordered
}

/// Turns a polyline, or begins a closed one elsewhere.
fn begin_at(polyline: &mut Polyline, vertex: usize) {
    let Polyline { page, points, .. } = polyline;
    if vertex == 0 {
        return;
    }
    if page.first() != page.last() {
        page.reverse();
        points.reverse();
        return;
    }
    rotate(page, vertex);
    rotate(points, vertex);
}

/// Begins a closed list elsewhere: its last entry is the first one again.
fn rotate<T: Copy>(closed: &mut Vec<T>, first: usize) {
    closed.pop();
    if first < closed.len() {
        closed.rotate_left(first);
    }
    closed.extend(closed.first().copied());
}

#[cfg(test)]
mod tests;
