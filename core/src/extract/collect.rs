//! All curves of a scene: boundaries, creases, silhouettes and uniform isocurves.

use alloc::vec;
use alloc::vec::Vec;

use super::curve::{Geometry, Path, SurfaceCurve};
use super::iso::iso_lines;
use super::join::{edge_curves, inner_lines};
use super::kind::CurveKind;
use super::silhouette::Silhouettes;
use super::style::Styles;
use crate::stitch::Stitching;
use crate::stop::Stop;

/// Which kinds of curve are wanted on paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CurveSet {
    /// Free edges.
    pub boundary: bool,
    /// Sharp edges.
    pub crease: bool,
    /// Silhouettes.
    pub silhouette: bool,
    /// Isoparametric curves.
    pub iso: bool,
    /// Smooth joins.
    pub smooth: bool,
    /// Intersections of surfaces.
    pub section: bool,
}

impl Default for CurveSet {
    fn default() -> Self {
        Self { boundary: true, crease: true, silhouette: true, iso: true, smooth: false, section: false }
    }
}

impl CurveSet {
    /// No kind.
    pub const NONE: Self =
        Self { boundary: false, crease: false, silhouette: false, iso: false, smooth: false, section: false };

    /// Adds `kind` to the set, which has no hatch lines: they are no curves of surfaces.
    pub fn insert(&mut self, kind: CurveKind) {
        match kind {
            CurveKind::Boundary => self.boundary = true,
            CurveKind::Crease => self.crease = true,
            CurveKind::Silhouette => self.silhouette = true,
            CurveKind::Iso => self.iso = true,
            CurveKind::Smooth => self.smooth = true,
            CurveKind::Section => self.section = true,
            CurveKind::Hatch => {}
        }
    }

    /// Whether `kind` is in the set.
    #[must_use]
    pub fn contains(&self, kind: CurveKind) -> bool {
        match kind {
            CurveKind::Boundary => self.boundary,
            CurveKind::Crease => self.crease,
            CurveKind::Silhouette => self.silhouette,
            CurveKind::Iso => self.iso,
            CurveKind::Smooth => self.smooth,
            CurveKind::Section => self.section,
            CurveKind::Hatch => false,
        }
    }
}

/// What is to be gathered.
#[derive(Clone, Copy, Debug)]
pub struct CurveOptions<'a> {
    /// What of each surface is wanted on paper.
    pub styles: &'a Styles,
    /// Largest angle between the tangent planes of a smooth join, radians.
    pub angle: f64,
    /// Stitched curves agree to this; view-space units. No part of a join shorter than it is told from its neighbours:
    /// where two patches turn away from the eye at places nearer together, that is one place known to rounding.
    pub contact: f64,
}

/// Gathers the curves, as they are without trims but for the boundaries. Every active curve is there whatever is wanted, because visibility changes at it; passive ones only
/// if they are wanted.
#[must_use]
pub fn curves(
    g: &Geometry<'_>,
    stitching: &Stitching,
    silhouettes: &Silhouettes,
    options: &CurveOptions<'_>,
    stop: Stop<'_>,
) -> Vec<SurfaceCurve> {
    let mut out = all_but_isos(g, stitching, silhouettes, options, stop);
    // After the others: of coincident lines the earlier one is inked, and outlines come before what fills them.
    let isos = iso_lines(g.view, options.styles);
    out.reserve_exact(isos.len());
    out.extend(isos.iter().take_while(|_| !stop.is_wanted()).map(|line| line.curve(g)));
    out
}

/// The curves but for the isocurves, active ones first.
pub(crate) fn all_but_isos(
    g: &Geometry<'_>,
    stitching: &Stitching,
    silhouettes: &Silhouettes,
    options: &CurveOptions<'_>,
    stop: Stop<'_>,
) -> Vec<SurfaceCurve> {
    let mut out = Vec::new();
    for edge in &stitching.edges {
        if stop.is_wanted() {
            return out;
        }
        if edge.owner() {
            edge_curves(g, stitching, edge, options, &mut out);
        }
    }
    for surface in 0..g.view.surfaces().len() {
        if stop.is_wanted() {
            return out;
        }
        inner_lines(g, surface, options, &mut out);
    }
    for traced in &silhouettes.curves {
        let surface = g.view.patches()[traced.patch].surface;
        out.push(SurfaceCurve {
            kind: CurveKind::Silhouette,
            surface,
            surfaces: vec![surface],
            domain: [0.0, traced.segment_count() as f64],
            path: Path::Traced(traced.clone()),
            active: true,
            inked: options.styles.of(surface).curves.silhouette,
            style: surface,
            level: 0,
            sides: Vec::new(),
            gap: 0.0,
            splits: Vec::new(),
        });
    }
    // Of coincident lines the earlier one is inked.
    out.sort_by_key(|c| !c.active);
    out
}
