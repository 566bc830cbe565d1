//! Views a hair off those in which much coincides: curves then run along each other at distances about the resolution.

use glam::DVec3;
use penvis_core::pipeline::{DrawOptions, Prepared, Stats};
use penvis_core::scene::{Scene, SceneSurface};
use penvis_core::shape::{Frame, torus};
use penvis_core::view::Camera;

fn stats_from(direction: DVec3) -> Stats {
    let surface = torus(&Frame::WORLD, 3.0, 1.0).expect("a torus");
    let scene = Scene { name: "torus".into(), surfaces: vec![SceneSurface::new("torus", surface)] };
    let camera = Camera::orthographic(direction, DVec3::Z).expect("a camera");
    let prepared = Prepared::new(&scene, &camera, &DrawOptions::default(), &()).expect("a picture");
    prepared.trace(1e-3, &()).expect("nothing stops it").stats
}

/// Cutting such curves until each part is straighter than the gap between them takes millions of halvings.
#[test]
fn a_torus_a_hair_off_its_side_is_split_with_little_work() {
    for tilt in [1e-3, 1e-5, 1e-7, 1e-9] {
        for axis in [DVec3::X, DVec3::NEG_Y] {
            let stats = stats_from(axis + tilt * DVec3::new(0.3, 0.5, 0.8));
            let work = stats.arrange;
            assert!(work.subdivisions < 100_000 && work.undecided == 0, "{tilt:e}: {work:?}");
            assert!(stats.visibility.undecided.is_empty(), "{tilt:e}: {:?}", stats.visibility.undecided);
        }
    }
}

/// Here silhouettes are steep graphs over a parameter whose floating-point steps are as wide as the picture's resolution:
/// what covers them cannot be made better by making it shorter.
#[test]
fn silhouettes_known_to_rounding_only_are_covered_with_few_arcs() {
    for axis in [DVec3::X, DVec3::NEG_Y] {
        let work = stats_from(axis + 1e-12 * DVec3::new(0.3, 0.5, 0.8)).arrange;
        assert!(work.pairs_near < 20_000, "{work:?}");
    }
}
