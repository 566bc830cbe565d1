//! Adaptive isocurves: as few as cover a surface evenly (Elber and Cohen 1992, *Adaptive isocurves based rendering*,
//! UUCS-92-040).
//!
//! Isocurves that are equally far apart in the parameter crowd where a surface narrows and part where it widens. Here a strip
//! between two isocurves gets a middle one only where the two are farther apart than the spacing δ, so that curves end
//! where their neighbours have come near enough:
//!
//! ```text
//!      uniform                adaptive
//!   | | | | | | |            |  |  |  |
//!    \ \ | | / /              \  \ | /
//!     \\\|//                   \  |
//!     ///|\\\                  /  |
//!    / / | | \ \              /  / | \
//!   | | | | | | |            |  |  |  |
//! ```
//!
//! The squared distance of the two is a quotient of piecewise polynomials, formed symbolically, and where it passes δ² are
//! roots. Each distance is formed once: one for the two ends of the domain, and two for each curve that is introduced.
//!
//! Two curves at distance δ leave no point of the *ruled* surface between them farther than δ/2 from one of them (lemma 1
//! there). That the surface itself is no farther than [`RULED`] δ from the ruled one is bounded by coefficients, and where it
//! is not, the strip is divided as well. With that, the two sides of a closed surface may coincide, strips may be folded
//! or begin at a pole, and distances may be taken on the screen alone, also of surfaces with silhouettes; the paper, which
//! does not test this, takes them in space there ([`Spacing::Surface`]), which crowds curves towards outlines.

mod edges;
mod equal;
mod rail;
mod ruled;
mod strip;
mod tone;

use alloc::vec;
use alloc::vec::Vec;

pub use tone::Tone;
pub(crate) use tone::{Shade, in_model, incidence};

pub(crate) use rail::restricted;
use rail::{IsoDistance, Rail};
use strip::Strips;

use super::curve::{Geometry, Path, SurfaceCurve};
use super::facing::Facing;
use super::kind::CurveKind;
use super::on_line::{corners, facing_zeros};
use super::style::Styles;
use crate::line::{Axis, Line};
use crate::stitch::Stitching;
use crate::stop::Stop;

/// Share of the spacing by which a surface may bend away from the ruled surface between neighbouring isocurves.
pub const RULED: f64 = 0.25;

/// Which isocurves are taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Direction {
    /// Those along which u runs.
    U,
    /// Those along which v runs.
    V,
    /// Both.
    Both,
    /// On each surface those between whose outermost two the largest distance in space is the smaller (the choice of the
    /// paper): fewer and longer ones.
    #[default]
    Auto,
}

/// Where the distance between isocurves is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Spacing {
    /// On the screen.
    #[default]
    Screen,
    /// In view space on surfaces that have a silhouette, on the screen on others, as the paper has it.
    Surface,
}

/// Coordinates that a distance is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Metric {
    Screen,
    Space,
}

/// What adaptive isocurves are to be like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdaptiveOptions {
    /// Largest distance of neighbouring isocurves, screen units, positive. With a tone, their average distance where it is
    /// darkest, and twice the smallest, across the curves.
    pub spacing: f64,
    /// Where it is measured.
    pub measured: Spacing,
    /// Which isocurves.
    pub direction: Direction,
    /// What makes the spacing wider; `None` for an even one.
    pub tone: Option<Tone>,
    /// Number of levels, at least 1: the isocurves up to level k are those for 2ⁿ⁻¹⁻ᵏ times the spacing.
    pub levels: u32,
    /// Curves no longer than this on the screen that end inside their surface are left out, as are divisions of strips no
    /// longer.
    pub shortest: f64,
}

/// A part of an isocurve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IsoPiece {
    /// Index of the surface.
    pub surface: usize,
    /// Which parameter is constant.
    pub axis: Axis,
    /// Its value.
    pub value: f64,
    /// Interval of the other parameter.
    pub t: [f64; 2],
    /// From 0, the coarsest level.
    pub level: u32,
}

/// What was counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AdaptiveStats {
    /// Isocurves between which the surfaces were held: the ends of each domain, and those introduced between them, of which a
    /// tone may leave little or nothing.
    pub curves: u64,
    /// Distances of pairs of isocurves that were formed.
    pub distances: u64,
    /// Strips held against the ruled surface between their sides.
    pub ruled_tests: u64,
}

/// Isocurves that cover a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cover {
    /// The pieces, surface by surface and on each in the order of the constant parameter, the seams between surfaces last.
    pub pieces: Vec<IsoPiece>,
    /// Counts.
    pub stats: AdaptiveStats,
}

/// Covers every `wanted` surface with isocurves no farther apart than the spacing. Where a surface's edge, at which the cover begins, is a smooth join it is one of the isocurves, once for all
/// surfaces that meet there; so are edges of kinds that no style there has; others are drawn anyway.
///
/// Without a tone, each point of a surface is within (1/2 + [`RULED`]) · spacing + `shortest` of an isocurve, by the measure
/// of the spacing. Cost: linear in the isocurves that come out, times the knot intervals that they cross.
#[must_use]
pub fn cover(
    g: &Geometry<'_>,
    stitching: &Stitching,
    wanted: &dyn Fn(usize) -> bool,
    styles: &Styles,
    options: &AdaptiveOptions,
    stop: Stop<'_>,
) -> Cover {
    let tasks: Vec<(usize, Axis)> = (0..g.view.surfaces().len())
        .filter(|&surface| wanted(surface))
        .flat_map(|surface| axes(g, surface, options.direction).into_iter().map(move |axis| (surface, axis)))
        .collect();
    let work = |&(surface, axis): &(usize, Axis)| Strips::new(g, surface, axis, options, stop).cover();
    #[cfg(feature = "parallel")]
    let covers: Vec<Cover> = {
        use rayon::prelude::*;
        tasks.par_iter().map(work).collect()
    };
    #[cfg(not(feature = "parallel"))]
    let covers: Vec<Cover> = tasks.iter().map(work).collect();
    let mut out = Cover::default();
    for c in covers {
        out.pieces.extend(c.pieces);
        out.stats.curves += c.stats.curves;
        out.stats.distances += c.stats.distances;
        out.stats.ruled_tests += c.stats.ruled_tests;
    }
    out.pieces.extend(edges::pieces(g, stitching, styles, options, &tasks));
    out
}

/// The domain of the constant and of the running parameter of a surface's isocurves.
fn domain(g: &Geometry<'_>, surface: usize, axis: Axis) -> ([f64; 2], [f64; 2]) {
    let grid = &g.view.surfaces()[surface];
    let [u, v] = [&grid.u_breaks, &grid.v_breaks].map(|b| [b[0], b[b.len() - 1]]);
    if axis == Axis::U { (u, v) } else { (v, u) }
}

/// The constant parameters of the isocurves in a direction.
fn axes(g: &Geometry<'_>, surface: usize, direction: Direction) -> Vec<Axis> {
    match direction {
        Direction::U => vec![Axis::V],
        Direction::V => vec![Axis::U],
        Direction::Both => vec![Axis::U, Axis::V],
        Direction::Auto => {
            let widest = |axis: Axis| {
                let (s, t) = domain(g, surface, axis);
                let [a, b] = s.map(|s| Rail::new(g.view, surface, axis, s, t));
                IsoDistance::new(&a, &b, Metric::Space).maximum()
            };
            vec![if widest(Axis::U) < widest(Axis::V) { Axis::U } else { Axis::V }]
        }
    }
}

/// Where distances on a surface are taken.
fn metric(g: &Geometry<'_>, surface: usize, measured: Spacing) -> Metric {
    let has_silhouette = || {
        let grid = &g.view.surfaces()[surface];
        let forms = &g.forms[grid.first..grid.first + grid.count_u() * grid.count_v()];
        let any = |facing: Facing| forms.iter().any(|f| f.facing == facing);
        any(Facing::Mixed) || (any(Facing::Front) && any(Facing::Back))
    };
    match measured {
        Spacing::Surface if has_silhouette() => Metric::Space,
        _ => Metric::Screen,
    }
}

/// The pieces as curves to be arranged and drawn.
#[must_use]
pub fn adaptive_curves(g: &Geometry<'_>, cover: &Cover) -> Vec<SurfaceCurve> {
    let curve = |p: &IsoPiece| {
        let line = Line::over(g.view, p.surface, p.axis, p.value, false, p.t);
        let mut splits = facing_zeros(g, &line, p.t);
        splits.extend(corners(g, &line).iter().filter(|&&t| p.t[0] < t && t < p.t[1]));
        SurfaceCurve {
            kind: CurveKind::Iso,
            surface: p.surface,
            surfaces: vec![p.surface],
            path: Path::Line(line),
            domain: p.t,
            active: false,
            inked: true,
            style: p.surface,
            level: p.level,
            sides: Vec::new(),
            gap: 0.0,
            splits,
        }
    };
    cover.pieces.iter().map(curve).collect()
}

#[cfg(test)]
mod tests;
