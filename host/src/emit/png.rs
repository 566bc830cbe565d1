//! A picture of the inked paper.

use glam::DVec2;
use tiny_skia::{Color, ColorU8, LineCap, LineJoin, Paint, PathBuilder, Pixmap, Stroke, Transform};

use super::EmitError;
use crate::drawing::{Drawing, Page};

/// Dots an inch, unless the sheet is so large that its longer side is held to `LONGEST_PX`.
pub const DPI: f64 = 300.0;

/// Longest side of a picture in pixels; 8000 by 8000 take 256 MB while drawing.
const LONGEST_PX: f64 = 8000.0;

/// Dots an inch of painted surfaces: half of a drawing's, so that four of its pixels lie on one of theirs.
pub const RENDER_DPI: f64 = 150.0;

/// White of drawing paper.
const PAPER: [u8; 3] = [252, 250, 245];

/// Painted surfaces in full light: plaster, told from the paper.
const SURFACE: [u8; 3] = [232, 229, 222];

/// Ways with the pen up: a light blue that no pen has.
const TRAVEL: [u8; 3] = [130, 185, 235];

/// Width in mm of the ways with the pen up.
const TRAVEL_MM: f64 = 0.1;

/// The drawing as PNG: ink as wide and of the colour of each pen on paper, antialiased, at [`DPI`]. A pen thinner than a pixel keeps its share
/// of it. With `travel`, the ways of the pen between strokes are under the ink, from the lower left corner and back to it.
///
/// # Errors
/// If the page is too narrow for a pixel.
pub fn png(drawing: &Drawing, travel: bool) -> Result<Vec<u8>, EmitError> {
    let page = drawing.page;
    let pixels = Pixels::new(page, DPI)?;
    let scale = pixels.per_mm;
    let mut picture = paper(page, &pixels)?;
    let round = Stroke { line_cap: LineCap::Round, line_join: LineJoin::Round, ..Stroke::default() };
    let mut line = |points: &[DVec2], [r, g, b]: [u8; 3], width_mm: f64| {
        let mut path = PathBuilder::new();
        for (k, p) in points.iter().enumerate() {
            let (x, y) = ((p.x * scale) as f32, ((page.height_mm - p.y) * scale) as f32);
            if k == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
        }
        // No path comes of points that are not finite: there is no ink for them.
        let Some(path) = path.finish() else { return };
        let mut paint = Paint::default();
        paint.set_color_rgba8(r, g, b, 255);
        let stroke = Stroke { width: (width_mm * scale) as f32, ..round.clone() };
        picture.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
    };
    if travel {
        let mut at = DVec2::ZERO;
        let ends = drawing.polylines.iter().filter_map(|p| Some([*p.page.first()?, *p.page.last()?]));
        for [first, last] in ends.chain([[DVec2::ZERO; 2]]) {
            if first != at {
                line(&[at, first], TRAVEL, TRAVEL_MM);
            }
            at = last;
        }
    }
    for polyline in &drawing.polylines {
        line(&polyline.page, drawing.pens.color(polyline.pen), drawing.pens.width_mm(polyline.pen));
    }
    picture.encode_png().map_err(|_| impossible(page))
}

/// Painted surfaces as PNG: the brightness of each pixel from 0 to 1, row by row from above, bare paper where there is none.
///
/// # Errors
/// If the page is too narrow for a pixel.
pub fn shaded(page: Page, pixels: &Pixels, shades: &[Option<f64>]) -> Result<Vec<u8>, EmitError> {
    let mut picture = paper(page, pixels)?;
    for (pixel, shade) in picture.pixels_mut().iter_mut().zip(shades) {
        let Some(shade) = shade else { continue };
        let [r, g, b] = SURFACE.map(|full| (f64::from(full) * shade).round() as u8);
        *pixel = ColorU8::from_rgba(r, g, b, 255).premultiply();
    }
    picture.encode_png().map_err(|_| impossible(page))
}

/// The pixels that a page is cut into.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pixels {
    /// Pixels a mm.
    pub per_mm: f64,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Pixels {
    /// Those at `dpi`, or coarser ones if the page is so large that its longer side is held to `LONGEST_PX`.
    ///
    /// # Errors
    /// If the page is too narrow for a pixel.
    pub fn new(page: Page, dpi: f64) -> Result<Self, EmitError> {
        let per_mm = (dpi / 25.4).min(LONGEST_PX / page.width_mm.max(page.height_mm));
        let [width, height] = [page.width_mm, page.height_mm].map(|mm| (mm * per_mm).round() as u32);
        if width == 0 || height == 0 {
            return Err(impossible(page));
        }
        Ok(Self { per_mm, width, height })
    }
}

/// A bare sheet.
fn paper(page: Page, pixels: &Pixels) -> Result<Pixmap, EmitError> {
    let mut picture = Pixmap::new(pixels.width, pixels.height).ok_or_else(|| impossible(page))?;
    let [r, g, b] = PAPER;
    picture.fill(Color::from_rgba8(r, g, b, 255));
    Ok(picture)
}

fn impossible(page: Page) -> EmitError {
    EmitError::Picture { width_mm: page.width_mm, height_mm: page.height_mm }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use penvis_core::stroke::CurveKind::Iso;

    use super::super::tests::{drawing, polyline};
    use super::*;
    use crate::pens::Pens;

    #[test]
    fn ink_is_where_the_pen_was() {
        // 25.4 mm are 300 pixels.
        let lines = vec![polyline(Iso, 1, &[[5.0, 12.7], [20.0, 12.7]])];
        let mut drawing = drawing(25.4, 50.8, lines);
        drawing.pens = Pens::new(BTreeMap::new(), 1.0);
        let bytes = png(&drawing, false).unwrap();
        let picture = Pixmap::decode_png(&bytes).unwrap();
        assert_eq!((picture.width(), picture.height()), (300, 600));
        let grey = |x, y| picture.pixel(x, y).unwrap().green();
        assert_eq!(grey(150, 450), 0);
        assert_eq!(grey(150, 150), PAPER[1]);
        // Half a millimetre on both sides, and a round end.
        assert_eq!((grey(150, 445), grey(150, 455), grey(150, 458)), (0, 0, PAPER[1]));
        assert_eq!((grey(55, 450), grey(50, 450)), (0, PAPER[1]));
    }

    #[test]
    fn ways_with_the_pen_up_are_shown_on_request() {
        let lines =
            vec![polyline(Iso, 1, &[[5.0, 12.7], [20.0, 12.7]]), polyline(Iso, 1, &[[20.0, 25.4], [5.0, 25.4]])];
        let drawing = drawing(25.4, 50.8, lines);
        let shown = |travel| {
            let picture = Pixmap::decode_png(&png(&drawing, travel).unwrap()).unwrap();
            // Halfway up from the end of the one line to the beginning of the other.
            let pixel = picture.pixel(236, 375).unwrap();
            [pixel.red(), pixel.green(), pixel.blue()]
        };
        assert_eq!(shown(false), PAPER);
        let [red, _, blue] = shown(true);
        assert!(red < 200 && blue > 220, "{red} {blue}");
    }

    #[test]
    fn shades_are_pixels_from_above() {
        let page = Page { width_mm: 25.4, height_mm: 50.8 };
        let pixels = Pixels::new(page, RENDER_DPI).unwrap();
        assert_eq!((pixels.width, pixels.height), (150, 300));
        let mut shades = vec![None; 150 * 300];
        shades[149] = Some(1.0);
        shades[150] = Some(0.5);
        let picture = Pixmap::decode_png(&shaded(page, &pixels, &shades).unwrap()).unwrap();
        let colour = |x, y| picture.pixel(x, y).map(|c| [c.red(), c.green(), c.blue()]).unwrap();
        assert_eq!((colour(149, 0), colour(0, 1), colour(1, 1)), (SURFACE, [116, 115, 111], PAPER));
    }

    #[test]
    fn large_sheets_are_coarser_and_odd_ones_refused() {
        let large = png(&drawing(10_000.0, 10.0, Vec::new()), true).unwrap();
        assert_eq!(Pixmap::decode_png(&large).unwrap().width(), 8000);
        assert!(matches!(png(&drawing(10_000.0, 0.1, Vec::new()), false), Err(EmitError::Picture { .. })));
    }

    #[test]
    fn points_that_are_not_finite_leave_no_ink() {
        let lines = vec![polyline(Iso, 1, &[[f64::NAN, 1.0], [f64::INFINITY, 2.0]])];
        assert!(png(&drawing(10.0, 10.0, lines), true).is_ok());
    }
}
