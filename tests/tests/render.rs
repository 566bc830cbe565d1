//! The painted preview leaves no pixel out: every built-in model, against sight lines through the middles of all pixels.

use glam::DVec3;
use penvis::builtin;
use penvis::model::View;
use penvis_tests::raster::{Agreement, against, grid, prepared};

/// Pixels of the longer side.
const PIXELS: usize = 150;

/// From the model's own side, from where nothing is in line with anything, along an axis, where surfaces are seen edge-on and
/// folds lie on knots, and in perspective.
fn views(own: View) -> [View; 4] {
    [
        own,
        View::orthographic(DVec3::new(0.31, -0.85, 0.42)),
        View::orthographic(DVec3::NEG_Y),
        View::perspective(DVec3::new(9.0, -25.0, 14.0), DVec3::ZERO),
    ]
}

#[test]
fn every_pixel_whose_middle_a_surface_covers_is_painted_no_deeper_than_it() {
    for (name, _) in builtin::names() {
        let model = builtin::load(name).expect("a built-in model");
        for (k, view) in views(model.view).iter().enumerate() {
            let prepared = prepared(&model.scene, view);
            let raster = prepared.render(&grid(&prepared, PIXELS), &()).expect("nothing stops it");
            let found = against(&prepared, &raster);
            assert!(found.is_right(), "{name}, view {k}: {found:?}");
            assert!(found.covered > 500, "{name}, view {k}: {found:?}");
            // An outline touches a pixel or two for each that it is long.
            assert!(found.rim < 20 * PIXELS, "{name}, view {k}: {found:?}");
        }
    }
}

#[test]
fn a_picture_of_few_pixels_or_of_a_part_is_as_complete() {
    let model = builtin::load("teapot").expect("a built-in model");
    let prepared = prepared(&model.scene, &model.view);
    let mut all = Agreement::default();
    for pixels in [6, 11, 37] {
        all = all.plus(against(&prepared, &prepared.render(&grid(&prepared, pixels), &()).expect("nothing stops it")));
    }
    // Magnified, so that one pixel is less than a thousandth of the model.
    let mut part = grid(&prepared, 1200);
    part.corner = part.centre(part.width / 2, part.height / 2);
    (part.width, part.height) = (61, 43);
    all = all.plus(against(&prepared, &prepared.render(&part, &()).expect("nothing stops it")));
    assert!(all.is_right() && all.covered > 61 * 43, "{all:?}");
}
