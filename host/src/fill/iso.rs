//! Isocurves inside the visible regions of surfaces. What is seen of them is found as of all curves, so that they end where the
//! regions do; what is left to do on the paper is their gap to outlines.

use glam::{DVec2, DVec3};
use penvis_core::extract::adaptive::{AdaptiveOptions, Spacing, Tone};
use penvis_core::pipeline::IsoSet;
use penvis_core::stroke::Stroke;

use super::along::Along;
use super::cover::{Line, SHORTEST_TONED};
use super::keep::Outlines;
use super::{Fill, FillKind};
use crate::page::Layout;

/// The fills of surfaces, by their indices, that are isocurves, and which those are. Without a tone they are as in the darkest part of one: a pitch apart on
/// average, rather than at most, which would make them twice as many in some places as beside these.
#[must_use]
pub fn iso_sets(fills: &[Option<Fill>], tone: Option<Tone>, layout: &Layout) -> Vec<(Fill, IsoSet)> {
    let mut sets: Vec<(Fill, IsoSet)> = Vec::new();
    for (surface, fill) in fills.iter().enumerate() {
        let Some(fill) = fill.filter(|fill| fill.kind == FillKind::Iso) else { continue };
        match sets.iter_mut().find(|(known, _)| *known == fill) {
            Some((_, set)) => set.surfaces.push(surface),
            None => {
                let spacing = layout.to_screen_length(fill.pitch_mm);
                let options = AdaptiveOptions {
                    spacing,
                    measured: Spacing::Screen,
                    direction: fill.direction,
                    tone: Some(tone.unwrap_or(Tone::Flat(1.0))),
                    levels: 1,
                    shortest: SHORTEST_TONED * spacing,
                };
                sets.push((fill, IsoSet { surfaces: vec![surface], options }));
            }
        }
    }
    sets
}

/// What is left of isocurves when they keep the gap of their fill from outlines.
#[must_use]
pub fn trimmed(strokes: &[Stroke], fill: &Fill, outlines: &[&[DVec2]], layout: &Layout) -> Vec<Line> {
    let outlines = Outlines::new(outlines.iter().copied(), fill.gap_mm);
    let mut lines = Vec::new();
    for stroke in strokes.iter().filter(|stroke| stroke.points.len() > 1) {
        let page: Vec<DVec2> = stroke.points.iter().map(|p| layout.to_page(p.screen)).collect();
        let points: Vec<DVec3> = stroke.points.iter().map(|p| p.model).collect();
        let along = Along::new(&page);
        let left = outlines.clear(&page);
        let parts = along.parts(&left).into_iter().zip(along.parts_of(&points, DVec3::lerp, &left));
        let long = parts.filter(|(page, _)| Along::new(page).length_mm() >= SHORTEST_TONED * fill.pitch_mm);
        lines.extend(long.map(|(page, points)| Line { surface: stroke.surface, pen: fill.pen, page, points }));
    }
    lines
}
