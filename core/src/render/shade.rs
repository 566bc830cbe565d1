//! The light on what was painted.

use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::{BAND, Raster, Sample};
use crate::extract::adaptive::{in_model, lambert};
use crate::stop::Stop;
use crate::view::ViewScene;

/// Brightness of what turns away from the light.
pub const AMBIENT: f64 = 0.2;

/// Share of the way to the patch's middle at which a normal is taken in place of one that does not exist.
const INWARDS: f64 = 1e-3;

/// Below this share of the normal in the patch's middle a normal is rounding. A patch at 10⁵ pixels has a normal of 10⁻⁵
/// of that one pixel from a pole.
const SINGULAR: f64 = 1e-9;

/// The brightness of every pixel, from [`AMBIENT`] to 1; `None` where nothing was painted. The direction to the light is in
/// the viewer's frame: right, up, towards the eye. One exact normal a pixel: about 0.3 µs.
pub(crate) fn shade(raster: &Raster, view: &ViewScene, light: DVec3, stop: Stop<'_>) -> Vec<Option<f64>> {
    let light = in_model(view.camera(), light);
    let bright = |s: &Sample| AMBIENT + (1.0 - AMBIENT) * lit(view, s, light);
    let work = |part: &[Option<Sample>]| -> Vec<Option<f64>> {
        if stop.is_wanted() {
            return Vec::new();
        }
        part.iter().map(|s| s.as_ref().map(bright)).collect()
    };
    let part = (BAND * raster.grid.width).max(1);
    #[cfg(feature = "parallel")]
    let parts: Vec<Vec<Option<f64>>> = {
        use rayon::prelude::*;
        raster.samples.par_chunks(part).map(work).collect()
    };
    #[cfg(not(feature = "parallel"))]
    let parts: Vec<Vec<Option<f64>>> = raster.samples.chunks(part).map(work).collect();
    parts.concat()
}

/// Cosine between the light and the normal on the side that the eye sees. At a pole it is the one right beside it.
fn lit(view: &ViewScene, sample: &Sample, light: DVec3) -> f64 {
    let patch = view.model_patch(sample.patch);
    let middle = DVec2::splat(0.5);
    let area = |at: DVec2| patch.jet(at.x, at.y).normal().length();
    let singular = area(sample.at) <= SINGULAR * area(middle);
    let at = if singular { sample.at.lerp(middle, INWARDS) } else { sample.at };
    lambert(view, patch.surface, patch.to_surface(at.x, at.y), light)
}
