//! Strokes as the search for their order sees them.

use std::iter::{self, Sum};

use glam::DVec2;

use super::ends::Rest;
use crate::page::FARTHEST_MM;

/// A stroke to be visited.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stroke<'a> {
    /// Two or more.
    vertices: &'a [DVec2],
    closed: bool,
}

/// A stroke in an order, and where the pen begins with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Visit {
    /// Which one.
    pub stroke: u32,
    /// Index of the vertex that the pen begins with; of an open stroke the first or the last.
    pub vertex: u32,
}

impl<'a> Stroke<'a> {
    /// From its vertices, at least one; it is closed if the last is the first.
    pub(super) fn new(vertices: &'a [DVec2]) -> Self {
        Self { vertices, closed: vertices.len() > 2 && vertices.first() == vertices.last() }
    }

    pub(super) fn is_closed(&self) -> bool {
        self.closed
    }

    /// Number of vertices that the pen can begin with.
    pub(super) fn starts(&self) -> usize {
        if self.closed { self.vertices.len() - 1 } else { 2 }
    }

    /// One of them.
    pub(super) fn start(&self, index: usize) -> DVec2 {
        let index = if self.closed || index == 0 { index } else { self.vertices.len() - 1 };
        let at = self.vertices.get(index).copied().unwrap_or(DVec2::ZERO);
        if at.is_nan() { DVec2::ZERO } else { at.clamp(DVec2::splat(-FARTHEST_MM), DVec2::splat(FARTHEST_MM)) }
    }

    /// The visit that begins with one of them.
    pub(super) fn visit(&self, stroke: u32, start: usize) -> Visit {
        let vertex = if self.closed || start == 0 { start } else { self.vertices.len() - 1 };
        Visit { stroke, vertex: vertex as u32 }
    }

    /// Where a visit begins.
    pub(super) fn begin(&self, visit: Visit) -> DVec2 {
        self.start(if self.closed { visit.vertex as usize } else { usize::from(visit.vertex != 0) })
    }

    /// Where it ends.
    pub(super) fn end(&self, visit: Visit) -> DVec2 {
        if self.closed { self.begin(visit) } else { self.start(usize::from(visit.vertex == 0)) }
    }

    /// The visit in the other direction.
    pub(super) fn turned(&self, visit: Visit) -> Visit {
        if self.closed { visit } else { self.visit(visit.stroke, usize::from(visit.vertex == 0)) }
    }
}

/// Sum of the costs of all ways of an order.
pub(super) fn total<T: Sum>(
    strokes: &[Stroke<'_>],
    visits: &[Visit],
    rest: Rest,
    cost: impl Fn(DVec2, DVec2) -> T,
) -> T {
    let begins = visits.iter().map(|&v| Some(strokes[v.stroke as usize].begin(v)));
    let ends = visits.iter().map(|&v| Some(strokes[v.stroke as usize].end(v)));
    let ways = iter::once(rest.before).chain(ends).zip(begins.chain([rest.after]));
    let ways = ways.filter_map(|(from, to)| from.zip(to));
    if visits.is_empty() { iter::empty().sum() } else { ways.map(|(from, to)| cost(from, to)).sum() }
}
