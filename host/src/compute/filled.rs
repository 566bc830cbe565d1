//! Fills of a picture as polylines on the paper.

use glam::DVec2;
use penvis_core::extract::CurveKind;
use penvis_core::extract::adaptive::Tone;
use penvis_core::pipeline::{IsoSet, Prepared};
use penvis_core::stroke::Certainty;
use penvis_core::visible::{VisibleRegion, VisibleRegions};

use super::Watch;
use crate::drawing::Polyline;
use crate::error::Error;
use crate::fill::{Area, Canvas, Fill, FillKind, Light, Line, Loop, Shade, cover, divided, iso_sets, trimmed};
use crate::interrupt;
use crate::page::{Layout, clip};
use crate::settle::Settled;

/// What is filled.
pub(super) struct Filled<'a> {
    pub(super) prepared: &'a Prepared,
    /// The visible regions.
    pub(super) regions: &'a VisibleRegions,
    /// What of them is in shadow, if that is to be darkest; without a tone nothing else is filled.
    pub(super) shadows: Option<&'a [Area]>,
    pub(super) settled: &'a Settled,
    pub(super) layout: &'a Layout,
    /// Largest distance of the chords of isocurves from these, in units of the screen.
    pub(super) tolerance: f64,
}

/// The lines of all fills of the visible regions, with gaps to the outlines among the polylines that are drawn.
///
/// # Errors
/// If Ctrl-C or the time limit ends it, or regions are too large on the paper for what they are filled with.
pub(super) fn fills(filled: &Filled<'_>, drawn: &[Polyline], watch: &Watch<'_>) -> Result<Vec<Polyline>, Error> {
    let Filled { prepared, regions, shadows, settled, layout, .. } = *filled;
    let probe = prepared.probe(watch).map_err(|e| watch.reason(e.into()))?;
    let areas: Vec<Area> = regions.regions.iter().map(|region| area(region, layout)).collect();
    let is_outline = |p: &&Polyline| p.visible && p.kind.is_some_and(|kind| kind != CurveKind::Iso);
    let outlines: Vec<&[DVec2]> = drawn.iter().filter(is_outline).map(|p| &p.page[..]).collect();
    let tolerance_mm = settled.tolerance_mm;
    let canvas = Canvas { probe: &probe, layout, tone: settled.tone, tolerance_mm, shadows };
    let stops = || interrupt::is_wanted() || watch.is_over();
    let mut lines = cover(&areas, &settled.fills, &outlines, &canvas, &stops)?;
    if shadows.is_none() || settled.tone.is_some() {
        lines.extend(isocurves(filled, settled.tone, Light::Falls, &outlines, watch)?);
    }
    if shadows.is_some() {
        lines.extend(isocurves(filled, None, Light::Misses, &outlines, watch)?);
    }
    if stops() {
        return Err(watch.reason(penvis_core::stop::Stopped.into()));
    }
    let layer = CurveKind::Hatch.name();
    let whole = lines.into_iter().map(|Line { surface, pen, page, points }| Polyline {
        kind: Some(CurveKind::Hatch),
        surface,
        layer: layer.to_owned(),
        pen,
        level: 0,
        visible: true,
        qi: 0,
        certainty: Certainty::Proven,
        points,
        page,
    });
    let Some(window) = layout.window() else { return Ok(whole.collect()) };
    let mut inside = Vec::new();
    whole.for_each(|polyline| clip(polyline, window, &mut inside));
    Ok(inside)
}

/// The isocurves of fills that follow a tone, or without one are as many as where it is darkest, where the light falls or where it does not. Without shadows it
/// falls everywhere.
fn isocurves(
    filled: &Filled<'_>,
    tone: Option<Tone>,
    light: Light,
    outlines: &[&[DVec2]],
    watch: &Watch<'_>,
) -> Result<Vec<Line>, Error> {
    let Filled { prepared, shadows, settled, layout, tolerance, .. } = *filled;
    let (fills, sets): (Vec<Fill>, Vec<IsoSet>) = iso_sets(&settled.fills, tone, layout).into_iter().unzip();
    if sets.is_empty() {
        return Ok(Vec::new());
    }
    let found = prepared.isocurves(&sets, tolerance, watch).map_err(|e| watch.reason(e.into()))?;
    let mut lines = Vec::new();
    for ((fill, set), strokes) in fills.iter().zip(&sets).zip(&found) {
        let own = trimmed(strokes, fill, outlines, layout);
        lines.extend(match shadows {
            Some(shadows) => {
                let is_one = |surface: usize| set.surfaces.binary_search(&surface).is_ok();
                // With a tone, what ends at the border of a shadow goes on beyond it.
                let shortest_mm = if settled.tone.is_some() { 0.0 } else { fill.pitch_mm };
                divided(own, &Shade::new(shadows, &is_one), light, [settled.tolerance_mm, shortest_mm])
            }
            None => own,
        });
    }
    Ok(lines)
}

/// What is not filled that was to be, each a line.
pub(super) fn notes(prepared: &Prepared, settled: &Settled) -> Vec<String> {
    let is_iso = |fill: &Option<Fill>| fill.is_some_and(|fill| fill.kind == FillKind::Iso);
    let fills = settled.fills.iter().enumerate();
    let facets = fills.filter(|(surface, fill)| is_iso(fill) && prepared.is_facet(*surface)).count();
    let note =
        || format!("{facets} facets of meshes are not filled, for they have no isocurves; take another fill for them");
    (facets > 0).then(note).into_iter().collect()
}

/// A region on the paper. Smooth joins do not end fills.
fn area(region: &VisibleRegion, layout: &Layout) -> Area {
    let border = |own: &penvis_core::visible::VisibleLoop| {
        let mut border = Loop::default();
        for edge in &own.edges {
            // The last point is the first of the next edge.
            let begin = edge.points.iter().take(edge.points.len().saturating_sub(1));
            border.points.extend(begin.map(|p| layout.to_page(p.screen)));
            border.smooth.resize(border.points.len(), edge.kind == CurveKind::Smooth && edge.own);
        }
        border
    };
    Area { surface: region.surface, loops: region.loops.iter().map(border).collect() }
}
