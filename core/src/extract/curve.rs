//! A curve on a surface: a path in (u, v) that can be evaluated in (u, v), in space and on the screen.

use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::facing::FacingForm;
use super::kind::CurveKind;
use super::section::SectionCurve;
use super::silhouette::TracedCurve;
use super::zero_set;
use crate::bernstein::Bivariate;
use crate::line::{Axis, Line};
use crate::trim_line::TrimLine;
use crate::view::ViewScene;

/// What is needed to evaluate curves: the patches in view space and the facing polynomial of each.
#[derive(Clone, Copy, Debug)]
pub struct Geometry<'a> {
    /// The scene.
    pub view: &'a ViewScene,
    /// One facing form a patch.
    pub forms: &'a [FacingForm],
}

/// How a curve runs on its surface.
#[derive(Clone, Debug)]
pub enum Path {
    /// At constant u or v.
    Line(Line),
    /// Along the zero set of the facing polynomial of one patch.
    Traced(TracedCurve),
    /// Along the intersection of two surfaces.
    Section(SectionCurve),
    /// Along a trim curve.
    Trim(TrimLine),
}

/// A curve to be arranged, and drawn if its visibility and the user's choice say so.
#[derive(Clone, Debug)]
pub struct SurfaceCurve {
    /// What it is.
    pub kind: CurveKind,
    /// The surface it lies on.
    pub surface: usize,
    /// Every surface that has it as part of itself: `surface`, and those stitched to it along the curve.
    pub surfaces: Vec<usize>,
    /// The path.
    pub path: Path,
    /// Interval of the path's parameter.
    pub domain: [f64; 2],
    /// Whether visibility can change where it crosses something on the screen (Elber and Cohen 1989, definition 2.4).
    pub active: bool,
    /// Whether it is wanted on paper.
    pub inked: bool,
    /// The surface in whose style it is drawn: of `surfaces` the first that wants it, or `surface`.
    pub style: usize,
    /// Of adaptive isocurves: from 0, the coarsest of the levels that it belongs to; 0 for all others.
    pub level: u32,
    /// Indices of the sides (boundary curves) that coincide with it, its own included.
    pub sides: Vec<usize>,
    /// How far apart the sides are that it stands for, view-space units: it is no better known than that.
    pub gap: f64,
    /// Parameters at which its visibility can change by its own surfaces: where it meets their silhouettes, and corners.
    pub splits: Vec<f64>,
}

impl SurfaceCurve {
    /// Surface parameters at `t`.
    #[must_use]
    pub fn uv(&self, g: &Geometry<'_>, t: f64) -> DVec2 {
        match &self.path {
            Path::Line(line) => line.uv(t),
            Path::Traced(c) => {
                let l = c.local_at(&g.forms[c.patch], t);
                g.view.patches()[c.patch].to_surface(l.x, l.y)
            }
            Path::Section(c) => self.both_uv(g, c, t)[0],
            Path::Trim(line) => line.uv(t),
        }
    }

    /// Surface parameters at `t` on the two surfaces of a section.
    pub(crate) fn both_uv(&self, g: &Geometry<'_>, section: &SectionCurve, t: f64) -> [DVec2; 2] {
        let patches = g.view.patches();
        let at = section.at(patches, t, section.arc_at(t));
        [0, 1].map(|k| patches[at.patches[k]].to_surface(at.local[k].x, at.local[k].y))
    }

    /// Position in view space at `t`.
    #[must_use]
    pub fn point(&self, g: &Geometry<'_>, t: f64) -> DVec3 {
        match &self.path {
            Path::Line(line) => line.point(t),
            Path::Traced(c) => {
                let l = c.local_at(&g.forms[c.patch], t);
                g.view.patches()[c.patch].eval(l.x, l.y)
            }
            Path::Section(c) => c.at(g.view.patches(), t, c.arc_at(t)).p,
            Path::Trim(line) => line.point(g.view, t),
        }
    }

    /// Position and derivative in view space at `t`; at a joint of segments, of the one that begins there.
    #[must_use]
    pub fn jet(&self, g: &Geometry<'_>, t: f64) -> (DVec3, DVec3) {
        self.jet_in(g, t, libm::floor(t))
    }

    /// Position and derivative in view space at `t`; at a joint of segments, of the one that ends there.
    #[must_use]
    pub fn jet_below(&self, g: &Geometry<'_>, t: f64) -> (DVec3, DVec3) {
        self.jet_in(g, t, libm::ceil(t) - 1.0)
    }

    fn jet_in(&self, g: &Geometry<'_>, t: f64, segment: f64) -> (DVec3, DVec3) {
        match &self.path {
            Path::Line(line) => line.jet(t),
            Path::Traced(c) => {
                let segment = segment.clamp(0.0, (c.segment_count() - 1) as f64) as usize;
                let (a, b) = (c.vertices[segment], c.vertices[segment + 1]);
                let form = &g.forms[c.patch];
                // The end of a segment is the vertex that begins the next one.
                let l = if t == (segment + 1) as f64 { b } else { c.local_at(form, t) };
                // F = 0 is a graph over the segment's independent parameter, which runs linearly.
                let [_, fu, fv] = form.gradient(l.x, l.y);
                let d = match c.segments[segment].axis {
                    zero_set::Variable::U => DVec2::new(b.x - a.x, -fu / fv * (b.x - a.x)),
                    zero_set::Variable::V => DVec2::new(-fv / fu * (b.y - a.y), b.y - a.y),
                };
                let j = g.view.patches()[c.patch].jet(l.x, l.y);
                (j.p, j.du * d.x + j.dv * d.y)
            }
            Path::Section(c) => {
                let arc = segment.clamp(0.0, (c.arcs.len() - 1) as f64) as usize;
                let at = c.at(g.view.patches(), t, arc);
                (at.p, at.d)
            }
            Path::Trim(line) => {
                let span = segment.clamp(0.0, (line.spans.len() - 1) as f64) as usize;
                line.jet_in(g.view, t, span)
            }
        }
    }

    /// How far from its true place the point at `t` may be, in view space, because the facing polynomial is known to
    /// rounding only: much where the polynomial is flat. Nothing on other curves.
    #[must_use]
    pub fn rounding(&self, g: &Geometry<'_>, t: f64) -> f64 {
        let Path::Traced(c) = &self.path else { return 0.0 };
        let form = &g.forms[c.patch];
        let l = c.local_at(form, t);
        let [_, fu, fv] = form.gradient(l.x, l.y);
        let magnitude = form.polynomial.as_ref().map_or(0.0, Bivariate::magnitude);
        // A simple zero moves by rounding over slope, a double one by the root of what the second order makes of it.
        let slope = libm::hypot(fu, fv);
        let shift = (form.rounding / slope).min(libm::sqrt(form.rounding / magnitude));
        // The independent parameter is a floating-point number, and its steps are seen as often as the graph is steep.
        let segment = &c.segments[(t.max(0.0) as usize).min(c.segment_count() - 1)];
        let steep = match segment.axis {
            zero_set::Variable::U => fu / fv,
            zero_set::Variable::V => fv / fu,
        };
        let shift = shift + (f64::EPSILON * steep.abs()).min(1.0);
        let j = g.view.patches()[c.patch].jet(l.x, l.y);
        if shift.is_finite() { shift * (j.du.length() + j.dv.length()) } else { 0.0 }
    }

    /// Whether the curve is an isoparametric line with u (`Axis::U`) or v constant.
    #[must_use]
    pub fn axis(&self) -> Option<Axis> {
        match &self.path {
            Path::Line(line) => Some(line.axis),
            Path::Traced(_) | Path::Section(_) | Path::Trim(_) => None,
        }
    }

    /// Position in model space at `t`.
    #[must_use]
    pub fn model_point(&self, g: &Geometry<'_>, t: f64) -> DVec3 {
        g.view.model_point(self.surface, self.uv(g, t))
    }
}
