//! The outermost isocurves of the surfaces, where a cover begins: each edge once for all surfaces that meet in it.

use alloc::vec;
use alloc::vec::Vec;

use super::strip::Strips;
use super::{AdaptiveOptions, IsoPiece};
use crate::extract::{CurveKind, Geometry, Styles};
use crate::line::{Axis, Line};
use crate::stitch::{Edge, EdgeClass, Stitching};
use crate::stop::Stop;

/// The edges that are not drawn as what they are and that run along the isocurves of a surface that meets there. `tasks` are
/// the surfaces with the constant parameters of their isocurves. With a tone, those parts that are dark enough for an
/// isocurve at twice its distance.
pub(super) fn pieces(
    g: &Geometry<'_>,
    stitching: &Stitching,
    styles: &Styles,
    options: &AdaptiveOptions,
    tasks: &[(usize, Axis)],
) -> Vec<IsoPiece> {
    // Whether isocurves of constant u, and of constant v, cover each surface.
    let mut covers = vec![[false; 2]; g.view.surfaces().len()];
    tasks.iter().for_each(|&(surface, axis)| covers[surface][usize::from(axis == Axis::V)] = true);
    let mut out = Vec::new();
    for edge in stitching.edges.iter().filter(|e| e.owner()) {
        let mut sides = vec![edge.side];
        sides.extend(&edge.partners);
        let surfaces: Vec<usize> = sides.iter().map(|&s| stitching.sides[s].path.surface()).collect();
        if styles.drawn_by(&surfaces, kind(edge.class)).is_some() {
            continue;
        }
        let covered = |side: usize| {
            // No isocurve runs along a trim curve.
            stitching.sides[side]
                .path
                .line()
                .is_some_and(|line| covers[line.surface][usize::from(line.axis == Axis::V)])
        };
        let Some(line) = stitching.sides[edge.side].path.line() else { continue };
        if !sides.iter().any(|&side| covered(side)) {
            continue;
        }
        for t in dark(g, line, edge, options) {
            out.push(IsoPiece { surface: line.surface, axis: line.axis, value: line.value, t, level: 0 });
        }
    }
    out
}

fn kind(class: EdgeClass) -> CurveKind {
    match class {
        EdgeClass::Boundary => CurveKind::Boundary,
        EdgeClass::Crease => CurveKind::Crease,
        EdgeClass::Smooth => CurveKind::Smooth,
    }
}

/// The parts of an edge, which runs along `line`, that are dark enough.
fn dark(g: &Geometry<'_>, line: &Line, edge: &Edge, options: &AdaptiveOptions) -> Vec<[f64; 2]> {
    if options.tone.is_none() {
        return vec![edge.t];
    }
    let mut strips = Strips::new(g, line.surface, line.axis, options, Stop::NEVER);
    strips.dark_at_the_end(line.value, edge.t)
}
