//! From options to painted surfaces: a look at the model in the place where the drawing will be.

use std::time::Instant;

use glam::{DVec2, DVec3};
use penvis_core::render::{PixelGrid, RasterStats};
use penvis_core::scene::Scene;

use crate::compute::{Loaded, Placed, place};
use crate::drawing::Page;
use crate::emit::Pixels;
use crate::error::Error;
use crate::page::Layout;

/// Painted surfaces.
#[derive(Clone, Debug)]
pub struct Rendered {
    /// Name of the model.
    pub name: String,
    /// The page in pixels.
    pub pixels: Pixels,
    /// The brightness of every pixel, row by row from above; `None` where there is no surface.
    pub shades: Vec<Option<f64>>,
    /// Counts of the core.
    pub stats: RasterStats,
    /// Time it took, in s.
    pub seconds: f64,
}

/// Paints the surfaces onto the page where [`compute`](crate::compute::compute) would draw them. `light` is the direction to
/// the light in the viewer's frame: right, up, towards the eye.
///
/// # Errors
/// If the view does not exist or does not see all of the model, the picture cannot be scaled, or Ctrl-C or the time limit
/// ends it.
pub fn render(loaded: Loaded<'_>, pixels: Pixels, light: DVec3) -> Result<Rendered, Error> {
    let started = Instant::now();
    let Placed { scene: Scene { name, .. }, prepared, layout, settled, watch, .. } = place(loaded)?;
    let raster = prepared.render(&grid(&layout, settled.page, &pixels), &watch).map_err(|e| watch.reason(e.into()))?;
    let shades = prepared.shade(&raster, light, &watch).map_err(|e| watch.reason(e.into()))?;
    Ok(Rendered { name, pixels, shades, stats: raster.stats, seconds: started.elapsed().as_secs_f64() })
}

/// The pixels of a page on the screen of the picture that is laid out on it.
#[must_use]
pub fn grid(layout: &Layout, page: Page, pixels: &Pixels) -> PixelGrid {
    PixelGrid {
        corner: layout.to_screen(DVec2::new(0.0, page.height_mm)),
        pixel: layout.to_screen_length(1.0 / pixels.per_mm),
        width: pixels.width as usize,
        height: pixels.height as usize,
    }
}

impl Rendered {
    /// The line that says what was painted: pixels, the share of them that are surface, isocurves, points, time.
    #[must_use]
    pub fn summary(&self) -> String {
        let Pixels { per_mm, width, height } = self.pixels;
        let covered = 100.0 * self.shades.iter().flatten().count() as f64 / self.shades.len() as f64;
        format!(
            "{}: {width} × {height} pixels at {:.0} dpi, {covered:.0} % of them surface, painted with {} isocurves and \
             {:.1} million points in {:.1} s",
            self.name,
            per_mm * 25.4,
            self.stats.curves,
            self.stats.points as f64 / 1e6,
            self.seconds
        )
    }
}
