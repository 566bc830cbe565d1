//! Where the picture lies on the sheet.

use glam::DVec2;
use thiserror::Error;

use super::inside;
use crate::drawing::Page;

/// The similarity from the screen (units of the model) to the page (mm, y up, origin at the lower left).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layout {
    mm_per_unit: f64,
    /// Middle of the picture on the screen.
    screen: DVec2,
    /// Middle of the page in mm.
    page: DVec2,
}

/// Why a picture cannot be put on a sheet.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum LayoutError {
    /// The margins meet.
    #[error(
        "a margin of {margin_mm} mm leaves no room on a sheet of {width_mm} × {height_mm} mm; give a smaller --margin"
    )]
    NoRoom {
        /// Margin in mm.
        margin_mm: f64,
        /// Width of the sheet in mm.
        width_mm: f64,
        /// Height of the sheet in mm.
        height_mm: f64,
    },
    /// The picture's size cannot be scaled in floating point.
    #[error("the picture spans {width} × {height} model units, which cannot be scaled to paper; scale the model")]
    Extent {
        /// Width on the screen.
        width: f64,
        /// Height on the screen.
        height: f64,
    },
}

impl Layout {
    /// Fits the screen rectangle `extent` (lower left, upper right) inside the margins, in the middle of the sheet, as
    /// large as it gets with one scale for both axes. An extent without width and height keeps 1 mm a unit; so does one
    /// that is only the rounding of its coordinates, which must not be magnified to a picture.
    ///
    /// # Errors
    /// If the margins leave no room, or the extent is not finite or too small to be scaled.
    pub fn fit(extent: [DVec2; 2], page: Page, margin_mm: f64) -> Result<Self, LayoutError> {
        let room = Self::room(page, margin_mm)?;
        let size = extent[1] - extent[0];
        // A picture without width is held by its height alone, and the other way round.
        let scale = |room: f64, size: f64| if size > 0.0 { room / size } else { f64::INFINITY };
        let widest = scale(room.x, size.x).min(scale(room.y, size.y));
        let mm_per_unit = if size.cmple(rounding(extent)).all() { 1.0 } else { widest };
        if !(size.is_finite() && mm_per_unit.is_finite() && mm_per_unit > 0.0) {
            return Err(LayoutError::Extent { width: size.x, height: size.y });
        }
        let page = DVec2::new(page.width_mm, page.height_mm) / 2.0;
        Ok(Self { mm_per_unit, screen: extent[0] + size / 2.0, page })
    }

    /// Width and height inside the margins in mm.
    ///
    /// # Errors
    /// If nothing is left of them.
    pub fn room(page: Page, margin_mm: f64) -> Result<DVec2, LayoutError> {
        let room = inside(page, margin_mm);
        if !room.cmpgt(DVec2::ZERO).all() {
            let Page { width_mm, height_mm } = page;
            return Err(LayoutError::NoRoom { margin_mm, width_mm, height_mm });
        }
        Ok(room)
    }

    /// A point of the screen on the page, in mm.
    #[must_use]
    pub fn to_page(&self, screen: DVec2) -> DVec2 {
        (screen - self.screen) * self.mm_per_unit + self.page
    }

    /// The point of the screen that lies at a point of the page, in mm.
    #[must_use]
    pub fn to_screen(&self, page: DVec2) -> DVec2 {
        (page - self.page) / self.mm_per_unit + self.screen
    }

    /// A length in mm as a length on the screen.
    #[must_use]
    pub fn to_screen_length(&self, mm: f64) -> f64 {
        mm / self.mm_per_unit
    }
}

/// Size below which an extent is rounding. A projected coordinate is a sum of four products, each rounded to half an ulp,
/// of numbers about as large as the result at worst, and evaluation at a parameter adds as many again for each degree.
fn rounding(extent: [DVec2; 2]) -> DVec2 {
    64.0 * f64::EPSILON * DVec2::splat(extent[0].abs().max(extent[1].abs()).max_element())
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: Page = Page { width_mm: 200.0, height_mm: 100.0 };

    #[test]
    fn the_tighter_side_decides_and_the_other_is_centred() {
        let layout = Layout::fit([DVec2::new(-1.0, 2.0), DVec2::new(1.0, 4.0)], PAGE, 10.0).unwrap();
        assert_eq!(layout.to_page(DVec2::new(-1.0, 2.0)), DVec2::new(60.0, 10.0));
        assert_eq!(layout.to_page(DVec2::new(1.0, 4.0)), DVec2::new(140.0, 90.0));
        assert_eq!(layout.to_screen_length(40.0), 1.0);
        assert_eq!(layout.to_screen(DVec2::new(140.0, 90.0)), DVec2::new(1.0, 4.0));
    }

    #[test]
    fn pictures_without_width_height_or_both_are_placed() {
        let high = Layout::fit([DVec2::ZERO, DVec2::new(0.0, 2.0)], PAGE, 10.0).unwrap();
        assert_eq!(high.to_page(DVec2::new(0.0, 2.0)), DVec2::new(100.0, 90.0));
        let dot = Layout::fit([DVec2::ONE, DVec2::ONE], PAGE, 10.0).unwrap();
        assert_eq!(dot.to_page(DVec2::ONE), DVec2::new(100.0, 50.0));
        let noise = Layout::fit([DVec2::ONE, DVec2::ONE + 4.0 * f64::EPSILON], PAGE, 10.0).unwrap();
        assert_eq!(noise.to_screen_length(1.0), 1.0);
    }

    #[test]
    fn what_cannot_be_placed_is_refused() {
        let unit = [DVec2::ZERO, DVec2::ONE];
        assert!(matches!(Layout::fit(unit, PAGE, 50.0), Err(LayoutError::NoRoom { .. })));
        assert!(matches!(Layout::fit(unit, PAGE, f64::NAN), Err(LayoutError::NoRoom { .. })));
        for bad in [f64::NAN, f64::INFINITY, 1e-320] {
            let extent = [DVec2::ZERO, DVec2::new(bad, 0.0)];
            assert!(matches!(Layout::fit(extent, PAGE, 10.0), Err(LayoutError::Extent { .. })), "{bad}");
        }
    }
}
