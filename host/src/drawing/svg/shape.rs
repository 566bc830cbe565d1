//! The basic shapes.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DAffine2, DVec2};
use roxmltree::Node;
use svgtypes::PointsParser;

use super::super::flatten::Flattener;
use super::path::{self, Arc, PathError};
use super::viewport::{Along, Viewport};

/// Draws the outline of a shape, put on the paper by `place`. A shape that says no size is none.
///
/// # Errors
/// What is wrong with it.
pub(super) fn draw(
    node: Node<'_, '_>,
    viewport: Viewport,
    place: &DAffine2,
    out: &mut Flattener,
) -> Result<(), PathError> {
    let length = |name: &str, along: Along| viewport.length(node, name, along);
    let point =
        |x: &str, y: &str| DVec2::new(length(x, Along::Width).unwrap_or(0.0), length(y, Along::Height).unwrap_or(0.0));
    match node.tag_name().name() {
        "path" => path::draw(node.attribute("d").unwrap_or_default(), place, out)?,
        "line" => {
            out.move_to(place.transform_point2(point("x1", "y1")))?;
            out.line_to(place.transform_point2(point("x2", "y2")))?;
        }
        "rect" => {
            let size = point("width", "height");
            if size.cmpgt(DVec2::ZERO).all() {
                rectangle(point("x", "y"), size, radii(node, viewport).unwrap_or_default(), place, out)?;
            }
        }
        "circle" => {
            if let Some(r) = length("r", Along::Diagonal) {
                ellipse(point("cx", "cy"), DVec2::splat(r), place, out)?;
            }
        }
        "ellipse" => {
            if let Some(radii) = radii(node, viewport) {
                ellipse(point("cx", "cy"), radii, place, out)?;
            }
        }
        "polyline" | "polygon" => {
            let points = PointsParser::from(node.attribute("points").unwrap_or_default());
            let mut any = false;
            for (x, y) in points {
                let p = place.transform_point2(DVec2::new(x, y));
                if any {
                    out.line_to(p)?
                } else {
                    out.move_to(p)?
                }
                any = true;
            }
            if any && node.tag_name().name() == "polygon" {
                out.close()?;
            }
        }
        _ => {}
    }
    Ok(())
}

/// `rx` and `ry`, of which the one stands for the other if that is not said.
fn radii(node: Node<'_, '_>, viewport: Viewport) -> Option<DVec2> {
    let radius = |name, along| viewport.length(node, name, along).filter(|r| *r >= 0.0);
    match (radius("rx", Along::Width), radius("ry", Along::Height)) {
        (Some(x), Some(y)) => Some(DVec2::new(x, y)),
        (Some(r), None) | (None, Some(r)) => Some(DVec2::splat(r)),
        (None, None) => None,
    }
}

fn ellipse(centre: DVec2, radii: DVec2, place: &DAffine2, out: &mut Flattener) -> Result<(), String> {
    if !radii.cmpgt(DVec2::ZERO).all() {
        return Ok(());
    }
    let first = place.transform_point2(centre + DVec2::X * radii.x);
    let whole = Arc { centre, axes: [DVec2::X * radii.x, DVec2::Y * radii.y], start: 0.0, sweep: TAU };
    out.move_to(first)?;
    whole.draw(place, first, out)
}

fn rectangle(low: DVec2, size: DVec2, radii: DVec2, place: &DAffine2, out: &mut Flattener) -> Result<(), String> {
    let radii = radii.min(size / 2.0);
    let on = |p: DVec2| place.transform_point2(p);
    if radii.cmple(DVec2::ZERO).any() {
        let corners = [low, low + DVec2::X * size.x, low + size, low + DVec2::Y * size.y];
        out.move_to(on(low))?;
        corners.iter().skip(1).try_for_each(|&corner| out.line_to(on(corner)))?;
        return out.close();
    }
    // The middles of the rounded corners, clockwise as it is seen, and the angle at which each begins.
    let (a, b) = (low + radii, low + size - radii);
    let corners = [(DVec2::new(b.x, a.y), 3.0), (b, 0.0), (DVec2::new(a.x, b.y), 1.0), (a, 2.0)];
    let axes = [DVec2::X * radii.x, DVec2::Y * radii.y];
    out.move_to(on(DVec2::new(a.x, low.y)))?;
    for (centre, quarters) in corners {
        // Exactly where the sides end, rather than by cosines.
        let side = |quarters: f64| match quarters as u32 % 4 {
            0 => axes[0],
            1 => axes[1],
            2 => -axes[0],
            _ => -axes[1],
        };
        let arc = Arc { centre, axes, start: quarters * FRAC_PI_2, sweep: FRAC_PI_2 };
        out.line_to(on(centre + side(quarters)))?;
        arc.draw(place, on(centre + side(quarters + 1.0)), out)?;
    }
    out.close()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use roxmltree::Document;

    use super::*;

    fn drawn(xml: &str, tolerance: f64) -> Vec<Vec<DVec2>> {
        let mut out = Flattener::new(tolerance);
        let document = Document::parse(xml).unwrap();
        let viewport = Viewport(DVec2::new(200.0, 100.0));
        assert!(draw(document.root_element(), viewport, &DAffine2::IDENTITY, &mut out).is_ok(), "{xml}");
        out.take()
    }

    #[test]
    fn straight_shapes_have_their_corners() {
        let table: &[(&str, &[[f64; 2]])] = &[
            ("<line x1='1' x2='50%' y2='2'/>", &[[1.0, 0.0], [100.0, 2.0]]),
            ("<rect x='1' y='2' width='3' height='4'/>", &[[1.0, 2.0], [4.0, 2.0], [4.0, 6.0], [1.0, 6.0], [1.0, 2.0]]),
            ("<polyline points='1,2 3 4,5,6'/>", &[[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]),
            ("<polygon points='1,2 3,4 5,6'/>", &[[1.0, 2.0], [3.0, 4.0], [5.0, 6.0], [1.0, 2.0]]),
        ];
        for (xml, expected) in table {
            let expected: Vec<DVec2> = expected.iter().map(|&p| p.into()).collect();
            assert_eq!(drawn(xml, 1.0), [expected], "{xml}");
        }
        for xml in ["<rect width='3'/>", "<circle r='-1'/>", "<ellipse/>", "<polygon/>", "<path/>", "<g/>"] {
            assert!(drawn(xml, 1.0).is_empty(), "{xml}");
        }
    }

    #[test]
    fn round_shapes_are_closed_and_as_long_as_they_should_be() {
        let r = 5.0;
        for (xml, expected) in [
            ("<circle cx='9' cy='9' r='5'/>", 2.0 * PI * r),
            ("<ellipse rx='5'/>", 2.0 * PI * r),
            ("<rect x='3' y='4' width='30' height='40' rx='5'/>", 2.0 * (20.0 + 30.0) + 2.0 * PI * r),
            // Radii are at most half as long as the sides.
            ("<rect width='10' height='10' rx='99' ry='7'/>", 2.0 * PI * r),
        ] {
            let line = drawn(xml, 1e-5).remove(0);
            let ink: f64 = line.windows(2).map(|w| w[0].distance(w[1])).sum();
            assert!((ink - expected).abs() < 1e-3, "{xml}: {ink}, not {expected}");
            assert_eq!(line.first(), line.last());
        }
    }
}
