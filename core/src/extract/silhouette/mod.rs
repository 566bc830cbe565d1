//! Silhouettes: the curves on which a surface turns away from the eye.
//!
//! On one patch they are the zero set of F ([`facing`](super::facing)), whose topology [`zero_set`] gives as arcs that
//! are graphs over one parameter. Vertices are put on an arc by the walk of Elber and Cohen (1989, §3) until the chords
//! between them are good enough. A [`TracedCurve`] keeps arcs and vertices, and every point asked for of it is found on
//! F = 0 itself, none on a chord.
//!
//! Where the sight line is tangent to the silhouette itself its projection has a cusp (a curtain fold); the curve is
//! split there.

mod cusp;
mod trace;
mod walk;

use alloc::vec::Vec;

use glam::DVec2;

use self::cusp::CuspForm;
use self::trace::{Tracer, split_at_cusps};
use self::walk::bracketed;
use super::facing::{Facing, FacingForm, coordinate_rounding};
use super::zero_set::{Rect, Variable, ZeroEnd, zero_set};
use crate::stop::Stop;
use crate::view::Patch;

/// How finely silhouettes are divided into segments. Topology and position do not depend on it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SilhouetteOptions {
    /// Largest distance on the screen between a segment's middle and the curve, in view units.
    pub chord: f64,
    /// Largest angle between surface normals at the ends of a half segment, radians; on a silhouette that is how far
    /// the curve turns on the screen.
    pub normal_angle: f64,
}

/// How a traced curve ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurveEnd {
    /// On an edge or corner of the patch: the vertex has a coordinate of exactly 0 or 1.
    Border,
    /// At a cusp of the projection, where the silhouette goes on as another curve (or as this one, for a loop with a
    /// single cusp).
    Cusp,
    /// Where two silhouettes of the patch cross.
    Crossing,
    /// At an undecided place.
    Undecided,
    /// At the first point, which is the last one too.
    Closed,
}

/// A piece of a curve between neighbouring vertices: a graph over one local parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// The independent parameter.
    pub axis: Variable,
    /// Range of the other parameter, in which F has exactly one zero for each value of the independent one.
    pub bracket: [f64; 2],
    /// Whether F grows with the other parameter.
    pub rising: bool,
}

/// A silhouette curve on one patch, evaluated on F = 0 itself.
///
/// Its parameter t runs from 0 to the number of segments; the integer part names the segment, the fraction the
/// position between its two vertices along the independent parameter. The front-facing side lies on the left in the
/// plane of the local parameters.
///
/// A silhouette goes on in the neighbouring patch from where it meets a smooth edge. The two ends agree across the edge
/// to rounding, and along it to rounding divided by the angle at which the silhouette meets the edge.
#[derive(Clone, Debug, PartialEq)]
pub struct TracedCurve {
    /// Index of the patch.
    pub patch: usize,
    /// Local parameters of the vertices, one more than segments.
    pub vertices: Vec<DVec2>,
    /// The segments.
    pub segments: Vec<Segment>,
    /// How the curve begins and ends.
    pub ends: [CurveEnd; 2],
}

/// A patch edge on which F vanishes identically.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EdgeFactor {
    /// Index of the patch.
    pub patch: usize,
    /// Edge: 0 is u = 0, 1 is u = 1, 2 is v = 0, 3 is v = 1.
    pub edge: usize,
    /// Multiplicity of the factor. Where it is odd F, continued over the edge, changes sign.
    pub multiplicity: u8,
    /// The edge is one point in space: no curve, but a limit of normals.
    pub collapsed: bool,
}

/// A place where the topology of a silhouette was not decided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UndecidedPlace {
    /// Index of the patch.
    pub patch: usize,
    /// Local parameters.
    pub place: Rect,
}

/// Counts of the extraction.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SilhouetteStats {
    /// Patches whose zero set was sought.
    pub patches: usize,
    /// Cells looked at.
    pub cells: usize,
    /// Deepest subdivision.
    pub depth_max: u32,
    /// Connected pieces, before splitting at cusps.
    pub components: usize,
    /// Closed ones among them.
    pub loops: usize,
    /// Places where two silhouettes cross on the surface.
    pub crossings: usize,
    /// Cusps of the projection.
    pub cusps: usize,
    /// Vertices.
    pub vertices: usize,
    /// Walks to F = 0.
    pub walks: usize,
    /// Walks that left their arc and were finished inside a bracket.
    pub bracketed: usize,
    /// Steps of all walks together.
    pub steps: usize,
    /// Steps of the longest walk.
    pub steps_max: usize,
}

/// The silhouettes of some patches.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Silhouettes {
    /// The curves, by patch.
    pub curves: Vec<TracedCurve>,
    /// Edges that are seen edge-on as a whole; whether such an edge is a silhouette depends on the neighbour.
    pub edges: Vec<EdgeFactor>,
    /// Places left undecided.
    pub undecided: Vec<UndecidedPlace>,
    /// Counts.
    pub stats: SilhouetteStats,
}

impl TracedCurve {
    /// Number of segments, at least 1.
    #[must_use]
    pub fn segment_count(&self) -> usize {
        self.segments.len()
    }

    /// Range of the parameter: 0 to the number of segments.
    #[must_use]
    pub fn param_range(&self) -> (f64, f64) {
        (0.0, self.segments.len() as f64)
    }

    /// Whether the curve is a loop without cusps.
    #[must_use]
    pub fn is_closed(&self) -> bool {
        self.ends[0] == CurveEnd::Closed
    }

    /// Local parameters at `t` (clamped to the range): a vertex exactly where `t` is whole, else the zero of F to full
    /// precision. `form` is the form of the curve's patch. Some five evaluations of a univariate polynomial.
    #[must_use]
    pub fn local_at(&self, form: &FacingForm, t: f64) -> DVec2 {
        let t = t.clamp(0.0, self.segments.len() as f64);
        let k = (libm::floor(t) as usize).min(self.segments.len() - 1);
        let fraction = t - k as f64;
        let (a, b) = (self.vertices[k], self.vertices[k + 1]);
        if fraction == 0.0 {
            return a;
        }
        if fraction == 1.0 {
            return b;
        }
        bracketed(form, &self.segments[k], a, b, fraction).0
    }
}

/// Silhouettes of all patches; `forms` are their forms, index by index. Cost: linear in the number of mixed patches.
#[must_use]
pub fn silhouettes(patches: &[Patch], forms: &[FacingForm], options: SilhouetteOptions, stop: Stop<'_>) -> Silhouettes {
    let mut out = Silhouettes::default();
    for (k, (patch, form)) in patches.iter().zip(forms).enumerate() {
        if stop.is_wanted() {
            break;
        }
        silhouettes_of(k, patch, form, options, &mut out);
    }
    out
}

/// Appends the silhouettes of one patch, number `index`, to `out`.
pub fn silhouettes_of(
    index: usize,
    patch: &Patch,
    form: &FacingForm,
    options: SilhouetteOptions,
    out: &mut Silhouettes,
) {
    for (edge, &multiplicity) in form.edge_factor.iter().enumerate() {
        if multiplicity > 0 {
            out.edges.push(EdgeFactor { patch: index, edge, multiplicity, collapsed: form.collapsed[edge] });
        }
    }
    let (Facing::Mixed, Some(polynomial)) = (form.facing, &form.polynomial) else { return };
    let zeros = zero_set(polynomial, form.rounding);
    out.stats.patches += 1;
    out.stats.cells += zeros.stats.cells;
    out.stats.depth_max = out.stats.depth_max.max(zeros.stats.depth_max);
    out.stats.components += zeros.stats.components;
    out.stats.loops += zeros.stats.loops;
    out.stats.crossings += zeros.stats.crossings;
    out.undecided.extend(zeros.undecided.iter().map(|&place| UndecidedPlace { patch: index, place }));
    if zeros.components.is_empty() {
        return;
    }
    let cusp_form = CuspForm::new(patch, polynomial, form.rounding);
    let mut tracer = Tracer {
        patch,
        cusp_form: &cusp_form,
        coordinate_rounding: coordinate_rounding(patch),
        derivative_rounding: 2.0 * patch.degree_u.max(patch.degree_v) as f64 * coordinate_rounding(patch),
        gradient_rounding: 2.0 * polynomial.degree_u().max(polynomial.degree_v()) as f64 * form.rounding,
        form,
        options,
        stats: &mut out.stats,
    };
    for component in &zeros.components {
        let ends = match component.ends {
            None => [CurveEnd::Closed; 2],
            Some(ends) => ends.map(|e| match e {
                ZeroEnd::Border => CurveEnd::Border,
                ZeroEnd::Crossing => CurveEnd::Crossing,
                ZeroEnd::Undecided => CurveEnd::Undecided,
            }),
        };
        let mut undecided = Vec::new();
        let path = tracer.refined(&component.arcs, &mut undecided);
        out.undecided.extend(undecided.into_iter().map(|place| UndecidedPlace { patch: index, place }));
        split_at_cusps(index, path, ends, &mut out.curves);
    }
}

#[cfg(test)]
mod tests;
