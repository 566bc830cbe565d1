//! Adaptive isocurves cover every surface as evenly as promised, measured without what they were chosen by.

use glam::DVec3;
use penvis::builtin;
use penvis_core::extract::adaptive::{AdaptiveOptions, Direction, RULED, Spacing};
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::scene::Scene;
use penvis_core::view::Camera;
use penvis_tests::cover::{Coverage, measure};

/// The scene with isocurves of a hundred-and-twentieth of the picture's width, and what they are like.
fn covered(scene: &Scene, camera: &Camera, direction: Direction) -> (Prepared, Coverage, f64) {
    let options = DrawOptions { isos: 0, ..DrawOptions::default() };
    let mut prepared = Prepared::new(scene, camera, &options, &()).expect("a picture");
    let [low, high] = prepared.extent();
    let spacing = low.distance(high) / 120.0;
    let even = AdaptiveOptions { spacing, measured: Spacing::Screen, direction, tone: None, levels: 1, shortest: 0.0 };
    prepared.cover(&even, &()).expect("nothing stops it");
    let surfaces = scene.surfaces.iter().map(|s| &s.surface);
    let mut all = Coverage::default();
    measure(surfaces, camera, &prepared, spacing).iter().for_each(|one| all.add(one));
    (prepared, all, spacing)
}

#[test]
fn every_model_is_covered_from_its_own_view_and_along_an_axis() {
    for (name, _) in builtin::names() {
        let model = builtin::load(name).expect("a built-in model");
        let along_an_axis = Camera::orthographic(DVec3::NEG_Y, DVec3::Z).expect("a camera");
        for camera in [model.view.camera().expect("a camera"), along_an_axis] {
            for direction in [Direction::Auto, Direction::Both] {
                let (prepared, all, spacing) = covered(&model.scene, &camera, direction);
                // Polylines are off their curves by what a chord of a 48th of a knot interval is.
                let most = (0.5 + RULED) * spacing * 1.01;
                assert!(all.farthest <= most, "{name} {direction:?}: {} spacings", all.farthest / spacing);
                // Two distances for each isocurve but the two at the ends of a surface, and one for those.
                let stats = prepared.stats().adaptive;
                let ways = if direction == Direction::Both { 2 } else { 1 };
                let covers = (ways * model.scene.surfaces.len()) as u64;
                assert_eq!(stats.distances, 2 * stats.curves - 3 * covers, "{name}");
            }
        }
    }
}

#[test]
fn the_measure_sees_what_is_missing() {
    let model = builtin::load("teapot").expect("a built-in model");
    let camera = model.view.camera().expect("a camera");
    let (prepared, all, spacing) = covered(&model.scene, &camera, Direction::Auto);
    let surfaces = model.scene.surfaces.iter().map(|s| &s.surface);
    // Held against half the spacing, the same curves are too few, and none is crowded any more.
    let mut finer = Coverage::default();
    measure(surfaces, &camera, &prepared, spacing / 4.0).iter().for_each(|one| finer.add(one));
    assert!(finer.farthest > 0.75 * spacing / 4.0 && finer.crowded < all.crowded);
}
