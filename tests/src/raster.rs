//! The painted preview held against sight lines through the middles of its pixels.
//!
//! Sight lines find the surfaces by certified roots, on cells of patches, with nothing of the isocurves and distances by
//! which they are painted.

use glam::DVec2;
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::render::{PixelGrid, Raster};
use penvis_core::scene::Scene;
use penvis_core::stop::Stop;
use penvis_core::view::Jet;
use penvis_core::visibility::{Hit, Occluders, RayScratch};
use rayon::prelude::*;

use penvis::model::View;

/// Rounding on the screen, in pixels.
const ROUNDING: f64 = 1e-6;

/// What sight lines say of a raster.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Agreement {
    /// Pixels whose middle a sight line meets a surface in.
    pub covered: usize,
    /// Of these, pixels that nothing was painted into.
    pub unpainted: usize,
    /// Painted pixels whose middle no surface covers: those at an outline.
    pub rim: usize,
    /// Pixels with a point that is deeper than the nearest surface in its middle is anywhere within half a pixel.
    pub deeper: usize,
    /// Pixels with a point that is not of the surface it is said to be of, or not in the pixel.
    pub astray: usize,
    /// Pixels with a point of a surface that is not the nearest in its middle, though nearer in another part of the pixel.
    pub other: usize,
}

impl Agreement {
    /// Takes that of another raster in.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            covered: self.covered + other.covered,
            unpainted: self.unpainted + other.unpainted,
            rim: self.rim + other.rim,
            deeper: self.deeper + other.deeper,
            astray: self.astray + other.astray,
            other: self.other + other.other,
        }
    }

    /// Whether all is as it should be.
    #[must_use]
    pub fn is_right(&self) -> bool {
        self.unpainted + self.deeper + self.astray == 0
    }
}

/// The scene ready to be painted.
///
/// # Panics
/// If it cannot be seen from the view.
#[must_use]
pub fn prepared(scene: &Scene, view: &View) -> Prepared {
    let options = DrawOptions { isos: 0, ..DrawOptions::default() };
    Prepared::new(scene, &view.camera().expect("a camera"), &options, &()).expect("seen")
}

/// Pixels round the picture, the longer side so many, with a margin of some; its middle is not on the corner of any.
#[must_use]
pub fn grid(prepared: &Prepared, pixels: usize) -> PixelGrid {
    let [lo, hi] = prepared.extent();
    let pixel = (hi - lo).max_element() / (pixels as f64 - 4.73);
    let middle = lo.midpoint(hi) + DVec2::new(0.137, -0.291) * pixel;
    let [width, height] = (hi - lo).to_array().map(|side| (side / pixel + 5.0).ceil() as usize);
    PixelGrid { corner: middle + DVec2::new(-(width as f64), height as f64) * 0.5 * pixel, pixel, width, height }
}

/// Asks a sight line through the middle of every pixel. Some microseconds each.
#[must_use]
pub fn against(prepared: &Prepared, raster: &Raster) -> Agreement {
    let occluders = Occluders::new(prepared.geometry().view.patches(), Stop::NEVER);
    let row = |row: usize| {
        let mut scratch = RayScratch::new();
        let mut out = Agreement::default();
        for column in 0..raster.grid.width {
            let nearest = occluders.hits(raster.grid.centre(column, row), &mut scratch).first().copied();
            out = out.plus(pixel(prepared, raster, [column, row], nearest));
        }
        out
    };
    (0..raster.grid.height).into_par_iter().map(row).reduce(Agreement::default, Agreement::plus)
}

fn pixel(prepared: &Prepared, raster: &Raster, [column, row]: [usize; 2], nearest: Option<Hit>) -> Agreement {
    let view = prepared.geometry().view;
    let sample = raster.sample(column, row);
    let mut out = Agreement { covered: usize::from(nearest.is_some()), ..Agreement::default() };
    if let Some(s) = sample {
        let p = view.patches()[s.patch].eval(s.at.x, s.at.y);
        let off = raster.grid.place(p.truncate()) - DVec2::new(column as f64, row as f64) - 0.5;
        let right = off.abs().max_element() <= 0.5 + ROUNDING && (p.z - s.z).abs() <= 1e-9 * view.size();
        out.astray = usize::from(!right);
    }
    match (nearest, sample) {
        (Some(_), None) => out.unpainted = 1,
        (None, Some(_)) => out.rim = 1,
        (Some(hit), Some(s)) => {
            let patch = &view.patches()[hit.patch];
            let at = patch.to_local(hit.uv);
            // Twice what a plane falls over half a pixel: room for what the surface bends.
            let falls = raster.grid.pixel * slope(&patch.jet(at.x, at.y));
            out.deeper = usize::from(s.z < hit.z - falls - 1e-9 * view.size());
            out.other = usize::from(view.patches()[s.patch].surface != hit.surface);
        }
        (None, None) => {}
    }
    out
}

/// Depth that a surface gains on a unit of the screen; infinite at a fold.
fn slope(jet: &Jet) -> f64 {
    let n = jet.normal();
    n.truncate().length() / n.z.abs()
}
