//! The raster preview: surfaces painted by isocurves into a z-buffer (Elber and Cohen 1992, *Adaptive isocurves based
//! rendering*, UUCS-92-040, section 4).
//!
//! A surface is covered by isocurves of less than a pixel's spacing, each isocurve by points that are less than a pixel apart,
//! and each point goes into the pixel that holds it, unless something nearer is there. No surface is turned into polygons;
//! what a pixel keeps is a point *of* the surface, by its parameters, so that it is shaded with the exact normal.
//!
//! # Nothing is missed
//!
//! Let p be a point of a surface that has area on the screen, and all lengths be in pixels on the screen. With isocurves
//! [`SPACING`] = δ apart
//!
//! 1. p is within [`RULED`] · δ of the ruled surface between its two neighbouring isocurves, by construction of the cover;
//! 2. each point of that lies on a chord no longer than δ from one of the two to the other, so within δ/2 of one of them
//!    (lemma 1 there; the outermost isocurves are the boundaries, which are painted like the others);
//! 3. each point of an isocurve is within [`REACH`] of a point that is painted.
//!
//! In all p is within (1/2 + [`RULED`]) δ + [`REACH`] = 0.4975 of a point painted. A pixel is a square of side 1 and holds
//! the disc of radius 1/2 round its centre. So **every pixel whose centre a surface covers is painted, at least as near as some
//! point of each surface there within that disc**, and since what is painted are points of the surface, **every pixel that is
//! painted holds a point of the surface**. What is left between the two are pixels at outlines, of which a surface covers a
//! part but not the centre.
//!
//! Of a trimmed surface the isocurves are cut, and the trim curves are painted too: where what leads from p to the painted
//! point leaves the surface there is one of them nearer.
//!
//! For spacings along and across that add up to 1/2 like this, the number of points, the inverse of δ · 2 [`REACH`], is least
//! where both terms are 1/4, which is some six points a pixel, twice as many since strips are halved until they are narrow
//! enough.

mod paint;
mod shade;
#[cfg(test)]
mod tests;

use alloc::vec;
use alloc::vec::Vec;

use glam::DVec2;

pub use shade::AMBIENT;
pub(crate) use shade::shade;

use crate::extract::adaptive::{AdaptiveOptions, Direction, RULED, Spacing, cover};
use crate::extract::facing::Facing;
use crate::extract::{CurveSet, Geometry, Style, Styles};
use crate::line::{Axis, Line};
use crate::stitch::Stitching;
use crate::stop::Stop;
use crate::trim_line::TrimLine;
use paint::{Arcs, Band};

/// Spacing of the isocurves in pixels.
pub const SPACING: f64 = 0.33;

/// Distance in pixels within which each point of an isocurve has one that is painted.
pub const REACH: f64 = 0.25;

// What makes the cover complete, with room for the rounding of coordinates of some 10⁵ pixels.
const _: () = assert!((0.5 + RULED) * SPACING + REACH < 0.499);

/// Rows of pixels that are painted in one go.
const BAND: usize = 32;

/// A rectangle of the screen in square pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelGrid {
    /// Upper left corner, screen units.
    pub corner: DVec2,
    /// Side of a pixel, screen units, positive.
    pub pixel: f64,
    /// Pixels in a row.
    pub width: usize,
    /// Rows, from above.
    pub height: usize,
}

impl PixelGrid {
    /// The middle of a pixel on the screen.
    #[must_use]
    pub fn centre(&self, column: usize, row: usize) -> DVec2 {
        self.corner + DVec2::new(column as f64 + 0.5, -(row as f64 + 0.5)) * self.pixel
    }

    /// A point of the screen in pixels from the upper left corner, to the right and down.
    #[must_use]
    pub fn place(&self, screen: DVec2) -> DVec2 {
        let d = (screen - self.corner) / self.pixel;
        DVec2::new(d.x, -d.y)
    }
}

/// The nearest point of all that were painted into a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Depth in view space; nearer is larger.
    pub z: f64,
    /// Index of the patch.
    pub patch: usize,
    /// Parameters, local to the patch.
    pub at: DVec2,
}

/// How much was painted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RasterStats {
    /// Isocurves, boundaries among them.
    pub curves: u64,
    /// Points painted, into whatever pixel and at whatever depth.
    pub points: u64,
}

/// Surfaces painted into pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Raster {
    /// Where the pixels are.
    pub grid: PixelGrid,
    /// What is nearest in each pixel, row by row from above; `None` where there is nothing.
    pub samples: Vec<Option<Sample>>,
    /// Counts.
    pub stats: RasterStats,
}

impl Raster {
    /// What is nearest in a pixel; `None` also outside.
    #[must_use]
    pub fn sample(&self, column: usize, row: usize) -> Option<Sample> {
        if column >= self.grid.width {
            return None;
        }
        self.samples.get(row * self.grid.width + column).copied().flatten()
    }

    /// Pixels that something was painted into.
    #[must_use]
    pub fn painted(&self) -> usize {
        self.samples.iter().flatten().count()
    }
}

/// Paints all surfaces. Those that are seen edge-on have no area and leave nothing. Pixels without size stay empty.
///
/// The result does not depend on how many threads there are: each paints rows of its own, and all surfaces in one order.
/// Of points at equal depth the one that is painted first stays, which is the one of the lower surface.
///
/// Cost: ten to twenty points, some 0.1 µs each, for each pixel that each sheet of surface covers, visible or not. Isocurves are
/// found also outside of the grid. 40 bytes a pixel.
pub(crate) fn render(g: &Geometry<'_>, stitching: &Stitching, grid: &PixelGrid, stop: Stop<'_>) -> Raster {
    let mut raster =
        Raster { grid: *grid, samples: vec![None; grid.width * grid.height], stats: RasterStats::default() };
    let sized = grid.pixel.is_finite() && grid.pixel > 0.0 && grid.corner.is_finite();
    if raster.samples.is_empty() || !sized {
        return raster;
    }
    let arcs = isocurves(g, stitching, grid, stop);
    if stop.is_wanted() {
        return raster;
    }
    let work = |(k, rows): (usize, &mut [Option<Sample>])| Band::new(k * BAND, grid.width, rows).paint(&arcs, stop);
    let bands = BAND * grid.width;
    #[cfg(feature = "parallel")]
    let points: u64 = {
        use rayon::prelude::*;
        raster.samples.par_chunks_mut(bands).enumerate().map(work).sum()
    };
    #[cfg(not(feature = "parallel"))]
    let points: u64 = raster.samples.chunks_mut(bands).enumerate().map(work).sum();
    raster.stats = RasterStats { curves: arcs.curves, points };
    raster
}

/// The isocurves that cover the surfaces, and all boundaries and trims, surface by surface.
fn isocurves(g: &Geometry<'_>, stitching: &Stitching, grid: &PixelGrid, stop: Stop<'_>) -> Arcs {
    let options = AdaptiveOptions {
        spacing: SPACING * grid.pixel,
        measured: Spacing::Screen,
        direction: Direction::Auto,
        tone: None,
        levels: 1,
        shortest: 0.0,
    };
    // The ends of the domains are painted here, whatever they are.
    let edges = CurveSet { boundary: true, crease: true, smooth: true, ..CurveSet::default() };
    let styles = Styles::uniform(Style { curves: edges, isos: 0 });
    let pieces = cover(g, stitching, &|_| true, &styles, &options, stop).pieces;
    let mut arcs = Arcs::new(*grid);
    for (surface, shape) in g.view.surfaces().iter().enumerate() {
        let forms = &g.forms[shape.first..shape.first + shape.count_u() * shape.count_v()];
        if forms.iter().all(|f| f.facing == Facing::EdgeOn) {
            continue;
        }
        let kept = |axis: Axis, value: f64, t: [f64; 2]| match g.view.trims(surface) {
            Some(trims) => trims.kept_on_line(axis, value, t),
            None => vec![t],
        };
        for (axis, breaks) in [(Axis::U, &shape.u_breaks), (Axis::V, &shape.v_breaks)] {
            for end in [breaks[0], breaks[breaks.len() - 1]] {
                let line = Line::new(g.view, surface, axis, end, false);
                kept(axis, end, line.domain()).into_iter().for_each(|t| arcs.push(&line, t));
            }
        }
        let first = pieces.partition_point(|p| p.surface < surface);
        for p in pieces[first..].iter().take_while(|p| p.surface == surface) {
            arcs.push(&Line::over(g.view, surface, p.axis, p.value, false, p.t), p.t);
        }
        TrimLine::all(g.view, surface).iter().for_each(|line| arcs.push_trim(g.view, line));
    }
    arcs
}
