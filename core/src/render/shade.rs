//! The light on what was painted.

use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::{Raster, Sample};
use crate::extract::adaptive::{in_model, incidence};
use crate::stop::Stop;
use crate::view::ViewScene;

/// Brightness of what turns away from the light.
pub const AMBIENT: f64 = 0.2;

/// Share of the way to the patch's middle at which a normal is taken in place of one that does not exist.
const INWARDS: f64 = 1e-3;

/// Below this share of the normal in the patch's middle a normal is rounding. A patch at 10⁵ pixels has a normal of 10⁻⁵
/// of that one pixel from a pole.
const SINGULAR: f64 = 1e-9;

/// What the light does to a pixel.
#[derive(Clone, Copy, Debug)]
struct Lit {
    surface: usize,
    /// Cosine between the light and the normal ∂u × ∂v.
    cosine: f64,
    /// Whether the eye sees that side.
    front: bool,
}

/// The brightness of every pixel, from [`AMBIENT`] to 1; `None` where nothing was painted. The direction to the light is in
/// the viewer's frame: right, up, towards the eye. One exact normal a pixel: about 0.3 µs.
///
/// In a pixel at an outline there may be nothing but points behind the fold, where the normal on the eye's side is the
/// opposite of that right before it. They are taken for what the pixel beside them shows: the side that most of the eight
/// pixels around show of that surface.
pub(crate) fn shade(raster: &Raster, view: &ViewScene, light: DVec3, stop: Stop<'_>) -> Vec<Option<f64>> {
    let light = in_model(view.camera(), light);
    let width = raster.grid.width;
    let lit = pixels(raster, |k| {
        if stop.is_wanted() {
            return None;
        }
        raster.samples[k].as_ref().map(|s| lit(view, s, light))
    });
    pixels(raster, |k| {
        let own = lit[k]?;
        let (mut alike, mut others) = (0, 0);
        for near in around(k, width, lit.len()).filter_map(|k| lit[k]).filter(|l| l.surface == own.surface) {
            *(if near.front == own.front { &mut alike } else { &mut others }) += 1;
        }
        let front = if others > alike { !own.front } else { own.front };
        let cosine = if front { own.cosine } else { -own.cosine };
        Some(AMBIENT + (1.0 - AMBIENT) * cosine.max(0.0))
    })
}

/// A value for every pixel.
fn pixels<T: Send>(raster: &Raster, of: impl Fn(usize) -> Option<T> + Send + Sync) -> Vec<Option<T>> {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        (0..raster.samples.len()).into_par_iter().map(of).collect()
    }
    #[cfg(not(feature = "parallel"))]
    (0..raster.samples.len()).map(of).collect()
}

/// The pixels around one, of so many in rows of `width`.
fn around(k: usize, width: usize, count: usize) -> impl Iterator<Item = usize> {
    let (column, row, height) = (k % width, k / width, count / width);
    let span = |x: usize, n: usize| x.saturating_sub(1)..(x + 2).min(n);
    span(row, height).flat_map(move |r| span(column, width).map(move |c| r * width + c)).filter(move |&n| n != k)
}

/// The light at a point. At a pole it is the one right beside it.
fn lit(view: &ViewScene, sample: &Sample, light: DVec3) -> Lit {
    let patch = view.model_patch(sample.patch);
    let middle = DVec2::splat(0.5);
    let area = |at: DVec2| patch.jet(at.x, at.y).normal().length();
    let singular = area(sample.at) <= SINGULAR * area(middle);
    let at = if singular { sample.at.lerp(middle, INWARDS) } else { sample.at };
    let (cosine, front) = incidence(view, patch.surface, patch.to_surface(at.x, at.y), light);
    Lit { surface: patch.surface, cosine, front }
}
