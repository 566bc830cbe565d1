//! Strokes whose ends meet, made one, so that the pen goes on from one to the next without being lifted.
//!
//! [`ends`] finds which ends go together, and here the strokes are strung on one another.

mod ends;

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use penvis_core::stroke::{Certainty, CurveKind};

use crate::drawing::Polyline;
use ends::{End, Ends};

/// Joins strokes of one pen, level and layer that are alike in all else that is known of them, where their ends are no farther apart than `gap_mm`; gaps
/// are closed by a segment. Where several ends meet, those go together between which the pen turns least. A stroke whose own ends meet becomes a
/// closed one.
///
/// Ends that meet, but are of different surfaces or kinds of curve, stay apart: one of the strokes is made to end where the other begins, to the bit,
/// so that the pen can go on.
///
/// A stroke whose vertices are no places on paper stays as it is, and so does one that is closed, and hidden ones unless `hidden` are to be joined too. No
/// vertex is moved, and none is left out. Cost: O(n log n) in the strokes, and linear in the vertices.
#[must_use]
pub fn merge(mut polylines: Vec<Polyline>, gap_mm: f64, hidden: bool) -> Vec<Polyline> {
    if !(gap_mm > 0.0 && gap_mm.is_finite()) {
        return polylines;
    }
    let is_joined = |p: &Polyline| (p.visible || hidden) && p.page.len() >= 2 && p.page.first() != p.page.last();
    let mut ends: Vec<Option<[End; 2]>> =
        polylines.iter().map(|p| if is_joined(p) { End::of(&p.page, gap_mm) } else { None }).collect();
    let groups = number(polylines.iter().map(Alike::new));
    let mates = Ends::new(&ends, &groups, gap_mm).mates();
    // What is left over goes together with less that is alike, and only meets.
    let meetings = {
        let is_free = |end: usize| mates.get(end).is_some_and(Option::is_none);
        let groups = number(polylines.iter().map(Drawn::new));
        for (k, pair) in ends.iter_mut().enumerate() {
            for (side, end) in pair.iter_mut().flatten().enumerate() {
                end.is_free = is_free(2 * k + side);
            }
        }
        Ends::new(&ends, &groups, gap_mm).mates()
    };
    for (one, mate) in meetings.iter().enumerate() {
        if let Some(other) = mate.map(|m| m as usize).filter(|&other| one < other && one ^ 1 != other) {
            meet(&mut polylines, one, other);
        }
    }
    string(polylines, &mates)
}

/// What strokes that are joined have in common.
#[derive(PartialEq, Eq, Hash)]
struct Alike<'a> {
    drawn: Drawn<'a>,
    kind: Option<CurveKind>,
    surface: usize,
    certainty: Certainty,
}

/// What strokes have in common between which the pen may stay down.
#[derive(PartialEq, Eq, Hash)]
struct Drawn<'a> {
    pen: u32,
    level: u32,
    layer: &'a str,
    visible: bool,
    qi: u32,
}

impl<'a> Alike<'a> {
    fn new(p: &'a Polyline) -> Self {
        Self { drawn: Drawn::new(p), kind: p.kind, surface: p.surface, certainty: p.certainty }
    }
}

impl<'a> Drawn<'a> {
    fn new(p: &'a Polyline) -> Self {
        Self { pen: p.pen, level: p.level, layer: &p.layer, visible: p.visible, qi: p.qi }
    }
}

/// Numbers for what is equal.
fn number<T: Eq + std::hash::Hash>(all: impl Iterator<Item = T>) -> Vec<u32> {
    let mut known = HashMap::new();
    all.map(|one| {
        let next = known.len() as u32;
        *known.entry(one).or_insert(next)
    })
    .collect()
}

/// Lets an end of a stroke meet an end of another one.
fn meet(polylines: &mut [Polyline], one: usize, other: usize) {
    let Some((page, point)) = polylines.get(other / 2).and_then(|p| {
        let at = if other & 1 == 0 { 0 } else { p.page.len() - 1 };
        Some((*p.page.get(at)?, *p.points.get(at)?))
    }) else {
        return;
    };
    let Some(p) = polylines.get_mut(one / 2) else { return };
    let at = if one & 1 == 0 { 0 } else { p.page.len() };
    let known = p.page.get(at.saturating_sub(one & 1));
    if known != Some(&page) {
        p.page.insert(at, page);
        p.points.insert(at, point);
    }
}

/// Strings strokes on one another whose ends, two for each in the order of the strokes, have mates.
fn string(polylines: Vec<Polyline>, mates: &[Option<u32>]) -> Vec<Polyline> {
    let mate = |end: usize| mates.get(end).copied().flatten().map(|m| m as usize);
    let mut left: Vec<Option<Polyline>> = polylines.into_iter().map(Some).collect();
    let mut strung = Vec::with_capacity(left.len());
    for k in 0..left.len() {
        if left[k].is_none() {
            continue;
        }
        // Back to where the chain begins, or all the way round.
        let mut begin = 2 * k;
        let mut closed = false;
        while let Some(end) = mate(begin) {
            begin = end ^ 1;
            if begin == 2 * k {
                closed = true;
                break;
            }
        }
        let mut chain: Option<Polyline> = None;
        let mut next = Some(begin);
        while let Some(end) = next {
            let Some(mut stroke) = left.get_mut(end / 2).and_then(Option::take) else { break };
            if end & 1 == 1 {
                stroke.page.reverse();
                stroke.points.reverse();
            }
            match &mut chain {
                None => chain = Some(stroke),
                Some(chain) => append(chain, &stroke.page, &stroke.points),
            }
            next = mate(end ^ 1);
        }
        if let (true, Some(chain)) = (closed, &mut chain)
            && let (Some(&page), Some(&point)) = (chain.page.first(), chain.points.first())
        {
            append(chain, &[page], &[point]);
        }
        strung.extend(chain);
    }
    strung
}

/// Goes on through other vertices.
fn append(chain: &mut Polyline, page: &[DVec2], points: &[DVec3]) {
    let skip = usize::from(chain.page.last() == page.first());
    chain.page.extend(page.iter().skip(skip));
    chain.points.extend(points.iter().skip(skip));
}

#[cfg(test)]
mod tests;
