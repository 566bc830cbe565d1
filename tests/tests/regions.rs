//! Visible regions of every built-in model, from its own view, along the axes, from where nothing is in line with anything, and in
//! perspective: no two overlap, and no pixel farther than one from a border is on the wrong side of it.

use glam::DVec3;
use penvis::builtin;
use penvis::model::View;
use penvis_tests::raster::{grid, prepared};
use penvis_tests::regions::against;

/// Pixels of the longer side.
const PIXELS: usize = 120;

fn views(own: View) -> [View; 6] {
    [
        own,
        View::orthographic(DVec3::X),
        View::orthographic(DVec3::NEG_Y),
        View { up: DVec3::Y, ..View::orthographic(DVec3::Z) },
        View::orthographic(DVec3::new(0.31, -0.85, 0.42)),
        View::perspective(DVec3::new(9.0, -25.0, 14.0), DVec3::ZERO),
    ]
}

/// Places at which a border may be undecided, in one view and in all: at a cusp, and where a silhouette runs along a join of surfaces, a
/// piece may be so short, and sheets so near, that an edge is not found. Loops go straight over such gaps.
const UNDECIDED: [usize; 2] = [9, 25];

#[test]
fn every_pixel_is_in_the_region_of_the_surface_that_is_painted_into_it() {
    let mut undecided = 0;
    for (name, _) in builtin::names() {
        let model = builtin::load(name).expect("a built-in model");
        for (k, view) in views(model.view).iter().enumerate() {
            let prepared = prepared(&model.scene, view);
            let grid = grid(&prepared, PIXELS);
            let regions = prepared.visible_regions(0.01 * grid.pixel, 0.3, &()).expect("nothing stops it");
            let raster = prepared.render(&grid, &()).expect("nothing stops it");
            let found = against(&prepared, &regions, &raster);
            assert!(found.wrong + found.shared == 0, "{name}, view {k}: {found:?}");
            assert!(found.clear > 1000 && found.area > 300.0, "{name}, view {k}: {found:?}");
            assert!(regions.undecided.len() <= UNDECIDED[0], "{name}, view {k}: {:?}", regions.undecided);
            undecided += regions.undecided.len();
        }
    }
    assert!(undecided <= UNDECIDED[1], "{undecided}");
}
