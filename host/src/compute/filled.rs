//! Fills of a picture as polylines on the paper.

use glam::DVec2;
use penvis_core::extract::CurveKind;
use penvis_core::pipeline::Prepared;
use penvis_core::stroke::Certainty;
use penvis_core::visible::{VisibleRegion, VisibleRegions};

use super::Watch;
use crate::drawing::Polyline;
use crate::error::Error;
use crate::fill::{Area, Canvas, Line, Loop, cover};
use crate::interrupt;
use crate::page::{Layout, clip};
use crate::settle::Settled;

/// The lines of all fills of the visible regions, with gaps to the outlines among the polylines that are drawn.
///
/// # Errors
/// If Ctrl-C or the time limit ends it, or regions are too large on the paper for what they are filled with.
pub(super) fn fills(
    prepared: &Prepared,
    regions: &VisibleRegions,
    settled: &Settled,
    layout: &Layout,
    drawn: &[Polyline],
    watch: &Watch<'_>,
) -> Result<Vec<Polyline>, Error> {
    let probe = prepared.probe(watch).map_err(|e| watch.reason(e.into()))?;
    let areas: Vec<Area> = regions.regions.iter().map(|region| area(region, layout)).collect();
    let is_outline = |p: &&Polyline| p.visible && p.kind.is_some_and(|kind| kind != CurveKind::Iso);
    let outlines: Vec<&[DVec2]> = drawn.iter().filter(is_outline).map(|p| &p.page[..]).collect();
    let tolerance_mm = settled.tolerance_mm;
    let canvas = Canvas { probe: &probe, layout, tone: settled.tone, tolerance_mm };
    let stops = || interrupt::is_wanted() || watch.is_over();
    let lines = cover(&areas, &settled.fills, &outlines, &canvas, &stops)?;
    if stops() {
        return Err(watch.reason(penvis_core::stop::Stopped.into()));
    }
    let layer = CurveKind::Hatch.name();
    let whole = lines.into_iter().map(|Line { surface, page, points }| Polyline {
        kind: Some(CurveKind::Hatch),
        surface,
        layer: layer.to_owned(),
        pen: settled.inks.visible(surface, CurveKind::Hatch, layer),
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
