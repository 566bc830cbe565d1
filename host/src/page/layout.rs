//! Where the picture lies on the sheet.

use glam::DVec2;
use thiserror::Error;

use super::{Placing, Position, Size, Window, inside};
use crate::drawing::Page;

/// The similarity from the screen (units of the model) to the page (mm, y up, origin at the lower left).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layout {
    mm_per_unit: f64,
    /// Middle of the picture on the screen.
    screen: DVec2,
    /// Where that comes to on the page in mm.
    page: DVec2,
    /// The part of the page outside which nothing is drawn.
    window: Option<Window>,
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
    /// A picture without an extent in the direction in which one was asked for.
    #[error("the picture has no {side}, so it cannot be given one; say its size with --scale")]
    Flat {
        /// The extent that it lacks.
        side: &'static str,
    },
    /// The picture does not lie inside the margins.
    #[error(
        "the picture of {width_mm:.2} × {height_mm:.2} mm at {x_mm:.2}, {y_mm:.2} does not fit inside the margins, {room_width_mm:.2} × \
         {room_height_mm:.2} mm at {margin_mm}, {margin_mm}; make it smaller, move it with --position, or cut it off with --clip"
    )]
    Outside {
        /// Width of the picture in mm.
        width_mm: f64,
        /// Height of the picture in mm.
        height_mm: f64,
        /// Its left end in mm.
        x_mm: f64,
        /// Its lower end in mm.
        y_mm: f64,
        /// Width inside the margins in mm.
        room_width_mm: f64,
        /// Height inside the margins in mm.
        room_height_mm: f64,
        /// Margin in mm.
        margin_mm: f64,
    },
    /// The device reaches nothing of what is inside the margins.
    #[error(
        "the device reaches nothing inside margins of {margin_mm} mm; choose smaller ones with --margin, or another --paper"
    )]
    Unreached {
        /// Margin in mm.
        margin_mm: f64,
    },
}

impl Layout {
    /// Fits the screen rectangle `extent` (lower left, upper right) inside the margins, in the middle of the sheet, as
    /// large as it gets with one scale for both axes.
    ///
    /// # Errors
    /// If the margins leave no room, or the extent is not finite or too small to be scaled.
    pub fn fit(extent: [DVec2; 2], page: Page, margin_mm: f64) -> Result<Self, LayoutError> {
        Self::new(extent, page, margin_mm, Placing::default())
    }

    /// Puts the screen rectangle `extent` (lower left, upper right) on the sheet with one scale for both axes. Where it is to fit, an extent
    /// without width and height keeps 1 mm a unit; so does one that is only the rounding of its coordinates, which must not be magnified to a picture.
    ///
    /// # Errors
    /// If the margins leave no room, the extent is not finite or too small to be scaled, or the picture does not lie inside the margins and
    /// is not to be cut off.
    pub fn new(extent: [DVec2; 2], page: Page, margin_mm: f64, placing: Placing) -> Result<Self, LayoutError> {
        let room = Self::room(page, margin_mm)?;
        let size = extent[1] - extent[0];
        let is_flat = size.cmple(rounding(extent));
        let low = DVec2::splat(margin_mm);
        let sided = |mm: f64, size: f64, flat: bool, side: &'static str| {
            if flat { Err(LayoutError::Flat { side }) } else { Ok(mm / size) }
        };
        let mm_per_unit = match placing.size {
            Size::Scale(scale) => scale,
            Size::Width(mm) => sided(mm, size.x, is_flat.x, "width")?,
            Size::Height(mm) => sided(mm, size.y, is_flat.y, "height")?,
            Size::Fit if is_flat.all() => 1.0,
            Size::Fit => {
                // From its corner on if that is fixed. Nothing is as large as that if it lies at the upper or right margin.
                let room = match placing.position {
                    Position::Centre => room,
                    Position::At(corner) => (low + room - corner).max(DVec2::ZERO),
                };
                // A picture without width is held by its height alone, and the other way round.
                let scale = |room: f64, size: f64| if size > 0.0 { room / size } else { f64::INFINITY };
                scale(room.x, size.x).min(scale(room.y, size.y))
            }
        };
        let picture = size * mm_per_unit;
        let at = match placing.position {
            Position::Centre => (DVec2::new(page.width_mm, page.height_mm) - picture) / 2.0,
            Position::At(corner) => corner,
        };
        let outside = LayoutError::Outside {
            width_mm: picture.x,
            height_mm: picture.y,
            x_mm: at.x,
            y_mm: at.y,
            room_width_mm: room.x,
            room_height_mm: room.y,
            margin_mm,
        };
        if !(size.is_finite() && mm_per_unit.is_finite() && mm_per_unit >= 0.0) {
            return Err(LayoutError::Extent { width: size.x, height: size.y });
        }
        if mm_per_unit == 0.0 {
            // Underflow, or a corner that leaves nothing.
            let nothing = matches!(placing.position, Position::At(corner) if !corner.cmplt(low + room).all());
            return Err(if nothing { outside } else { LayoutError::Extent { width: size.x, height: size.y } });
        }
        // What is made to fit may be out by rounding.
        let slack = 1e-9 * page.width_mm.max(page.height_mm);
        let fits = at.cmpge(low - slack).all() && (at + picture).cmple(low + room + slack).all();
        if !fits && !placing.clip {
            return Err(outside);
        }
        let window = placing.clip.then_some(Window { low, high: low + room });
        Ok(Self { mm_per_unit, screen: extent[0] + size / 2.0, page: at + picture / 2.0, window })
    }

    /// This layout with nothing drawn outside a part of the page, if it cuts off anything at all.
    ///
    /// # Errors
    /// If that leaves nothing.
    pub fn within(self, reach: Window) -> Result<Self, LayoutError> {
        let Some(window) = self.window else { return Ok(self) };
        let margin_mm = window.low.x;
        let common = window.common(reach).ok_or(LayoutError::Unreached { margin_mm })?;
        Ok(Self { window: Some(common), ..self })
    }

    /// The part of the page outside which nothing is drawn, if anything is to be cut off.
    #[must_use]
    pub fn window(&self) -> Option<&Window> {
        self.window.as_ref()
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

    const EXTENT: [DVec2; 2] = [DVec2::new(-1.0, 2.0), DVec2::new(1.0, 3.0)];

    fn put(placing: Placing) -> Result<[DVec2; 2], LayoutError> {
        Layout::new(EXTENT, PAGE, 10.0, placing).map(|layout| EXTENT.map(|p| layout.to_page(p)))
    }

    #[test]
    fn a_size_and_a_position_are_kept() {
        let corners = |x: f64, y: f64, width: f64| Ok([DVec2::new(x, y), DVec2::new(x + width, y + width / 2.0)]);
        let plain = Placing::default();
        assert_eq!(put(Placing { size: Size::Scale(20.0), ..plain }), corners(80.0, 40.0, 40.0));
        assert_eq!(put(Placing { size: Size::Width(100.0), ..plain }), corners(50.0, 25.0, 100.0));
        assert_eq!(put(Placing { size: Size::Height(80.0), ..plain }), corners(20.0, 10.0, 160.0));
        let at = Position::At(DVec2::new(30.0, 20.0));
        assert_eq!(put(Placing { size: Size::Width(100.0), position: at, ..plain }), corners(30.0, 20.0, 100.0));
        // As large as it gets from there.
        assert_eq!(put(Placing { position: at, ..plain }), corners(30.0, 20.0, 140.0));
    }

    #[test]
    fn what_lies_beyond_the_margins_is_refused_with_its_size_or_cut_off() {
        let large = Placing { size: Size::Width(180.2), ..Placing::default() };
        let message = put(large).unwrap_err().to_string();
        assert!(message.contains("180.20 × 90.10 mm at 9.90, 4.95"), "{message}");
        assert!(message.contains("180.00 × 80.00 mm at 10, 10"), "{message}");
        for at in [DVec2::new(9.9, 50.0), DVec2::new(30.0, 9.9), DVec2::new(190.0, 20.0), DVec2::new(30.0, 95.0)] {
            let placing = Placing { position: Position::At(at), ..Placing::default() };
            assert!(matches!(put(placing), Err(LayoutError::Outside { .. })), "{at}");
        }
        assert_eq!(Layout::fit(EXTENT, PAGE, 10.0).unwrap().window(), None);
        let cut = Layout::new(EXTENT, PAGE, 10.0, Placing { clip: true, ..large }).unwrap();
        let window = Window { low: DVec2::splat(10.0), high: DVec2::new(190.0, 90.0) };
        assert_eq!(cut.window(), Some(&window));
        let reach = Window { low: DVec2::new(0.0, 15.0), high: DVec2::new(150.0, 100.0) };
        let common = Window { low: DVec2::new(10.0, 15.0), high: DVec2::new(150.0, 90.0) };
        assert_eq!(cut.within(reach).unwrap().window(), Some(&common));
        let none = Window { low: DVec2::new(0.0, 95.0), high: DVec2::new(150.0, 100.0) };
        assert!(matches!(cut.within(none), Err(LayoutError::Unreached { .. })));
    }

    #[test]
    fn a_line_has_no_size_across() {
        let line = [DVec2::ZERO, DVec2::new(0.0, 2.0)];
        let with = |size| Layout::new(line, PAGE, 10.0, Placing { size, ..Placing::default() });
        assert_eq!(with(Size::Width(50.0)), Err(LayoutError::Flat { side: "width" }));
        assert_eq!(with(Size::Height(50.0)).unwrap().to_screen_length(25.0), 1.0);
    }
}
