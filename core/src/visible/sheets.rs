//! Loops that go on with the sheet that they border.
//!
//! Where a surface hides a part of itself, both sides of a line are its region, and two parts of it meet at a vertex that on the screen is one place and
//! on the surface two. Angles do not always tell which edge goes on with which: at the end of a fold all leave in one direction. Then two
//! borders have gone on with each other's sheet, which the places on the surface tell.

use alloc::vec::Vec;

use glam::DVec2;

use super::sides::apart;
use super::{BorderPoint, VisibleEdge, VisibleLoop};
use crate::stroke::from_chord;
use crate::visibility::Subject;

/// What is left of the gaps of two borders in the parameters if they go on with their own sheets, at the most.
const LEFT: f64 = 0.1;

/// The borders of one surface.
pub(super) struct Sheets<'a> {
    pub(super) subject: &'a Subject<'a>,
    pub(super) surface: usize,
    /// Places within this of one another on the screen are one, or so near that a border goes straight on from the one to the other.
    pub(super) near: f64,
    /// How far what lies between two places of one is from them on the screen at the most.
    pub(super) tolerance: f64,
}

impl Sheets<'_> {
    /// The loops, of which those that go on with each other's sheet at a vertex are parted, or joined to one. Cost: linear in the edges, and the square
    /// of how many change the sheet.
    pub(super) fn own(&self, loops: Vec<VisibleLoop>) -> Vec<VisibleLoop> {
        let mut next: Vec<usize> = Vec::new();
        for own in &loops {
            let (first, count) = (next.len(), own.edges.len());
            next.extend((0..count).map(|k| first + (k + 1) % count));
        }
        let edges: Vec<VisibleEdge> = loops.into_iter().flat_map(|l| l.edges).collect();
        let gap = |a: usize, b: usize| match (edges[a].points.last(), edges[b].points.first()) {
            (Some(a), Some(b)) => self.gap(a, b),
            _ => 0.0,
        };
        let leaving: Vec<usize> = (0..edges.len()).filter(|&k| gap(k, next[k]) > 0.0).collect();
        for (i, &a) in leaving.iter().enumerate() {
            for &b in &leaving[i + 1..] {
                let [p, q] = [a, b].map(|k| edges[k].points.last().map_or(DVec2::ZERO, |p| p.screen));
                let now = gap(a, next[a]) + gap(b, next[b]);
                if p.distance(q) <= self.near && gap(a, next[b]) + gap(b, next[a]) < LEFT * now {
                    next.swap(a, b);
                }
            }
        }
        let mut edges: Vec<Option<VisibleEdge>> = edges.into_iter().map(Some).collect();
        let mut out = Vec::new();
        for first in 0..edges.len() {
            let (mut own, mut k) = (Vec::new(), first);
            while let Some(edge) = edges[k].take() {
                own.push(edge);
                k = next[k];
            }
            if !own.is_empty() {
                out.push(VisibleLoop { edges: own });
            }
        }
        out
    }

    /// Where a loop goes on with another sheet, though none takes its place: on the screen.
    pub(super) fn changes(&self, own: &VisibleLoop) -> Vec<DVec2> {
        let next = own.edges.iter().cycle().skip(1);
        let ends = own.edges.iter().zip(next).filter_map(|(a, b)| Some((a.points.last()?, b.points.first()?)));
        ends.filter(|(a, b)| self.gap(a, b) > 0.0).map(|(a, _)| a.screen).collect()
    }

    /// Distance of two places of a border in the parameters, as a part of their range, if what lies between them there is seen
    /// elsewhere; else, as at a pole, and where they are one to the precision of the points, 0.
    fn gap(&self, a: &BorderPoint, b: &BorderPoint) -> f64 {
        let on = goes_straight_on(self.subject, self.surface, [*a, *b], self.tolerance);
        if on { 0.0 } else { apart(self.subject, self.surface, a.uv, b.uv) }
    }
}

/// Whether what lies between two places of a surface in the parameters is seen between them, within a tolerance on the screen: then
/// they are on one sheet.
pub(super) fn goes_straight_on(
    subject: &Subject<'_>,
    surface: usize,
    [a, b]: [BorderPoint; 2],
    tolerance: f64,
) -> bool {
    let seen = |uv: DVec2| subject.geometry.view.jet(surface, uv, [false; 2]).p.truncate().extend(0.0);
    let is_between = |share: f64| {
        let q = seen(a.uv + share * (b.uv - a.uv));
        from_chord(q, a.screen.extend(0.0), b.screen.extend(0.0)) <= tolerance
    };
    [0.25, 0.5, 0.75].into_iter().all(is_between)
}
