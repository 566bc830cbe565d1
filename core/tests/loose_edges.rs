//! Boundary representations whose faces do not quite meet at the edges that they share.

use glam::{DMat4, DVec3};
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::scene::{Scene, SceneSurface};
use penvis_core::shape::{plane, polyline};
use penvis_core::stroke::{CurveKind, Stroke};
use penvis_core::trim::{TrimCurve, Trims};
use penvis_core::view::Camera;

/// The unit cube, each face pushed out by its own distance, larger by a margin than the square that its trims keep. Its
/// edges are shared whatever the gap.
fn cube(push: [f64; 6], margin: f64) -> Scene {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let mut surfaces = Vec::new();
    for (face, out) in push.into_iter().enumerate() {
        let (k, high) = (face / 2, face % 2 == 1);
        // u × v points out of the cube.
        let (u, v) = if high { (axes[(k + 1) % 3], axes[(k + 2) % 3]) } else { (axes[(k + 2) % 3], axes[(k + 1) % 3]) };
        let base = if high { axes[k] * (1.0 + out) } else { axes[k] * -out };
        let surface = plane(base - (u + v) * margin, u * (1.0 + 2.0 * margin), v * (1.0 + 2.0 * margin)).unwrap();
        let at = |x: f64| (x + margin) / (1.0 + 2.0 * margin);
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
        let side = |w: &[[f64; 2]]| {
            let curve = polyline(&[w[0], w[1]].map(|c| DVec3::new(at(c[0]), at(c[1]), 0.0))).unwrap();
            // An edge is told by its direction and by where it is in the two others.
            let middle =
                axes[k] * f64::from(u8::from(high)) + u * (w[0][0] + w[1][0]) / 2.0 + v * (w[0][1] + w[1][1]) / 2.0;
            let id = (0..3).fold(0, |id, d| id * 3 + (2.0 * middle[d]).round() as u32);
            TrimCurve { curve, edge: Some(id) }
        };
        let trims = Trims::oriented(&surface, [false; 2], &[corners.windows(2).map(side).collect()]).unwrap();
        surfaces.push(SceneSurface { trims: Some(trims), ..SceneSurface::new(format!("face {face}"), surface) });
    }
    Scene { name: "cube".into(), surfaces }
}

fn length(s: &Stroke) -> f64 {
    s.points.windows(2).map(|w| w[0].model.distance(w[1].model)).sum()
}

#[test]
fn a_cube_of_faces_that_do_not_meet_shows_its_nine_edges() {
    let camera = Camera::orthographic(DVec3::new(1.0, -1.3, 0.8), DVec3::Z).unwrap();
    let options = DrawOptions { isos: 0, ..DrawOptions::default() };
    for gap in [0.0, 1e-7, 1e-5, 1e-4, 1e-3] {
        for margin in [0.0, 0.25] {
            let pushes: [[f64; 6]; 3] = [[1.0; 6], [-1.0; 6], [0.3, -1.0, 1.0, 0.1, -0.6, 0.9]];
            for push in pushes {
                let scene = cube(push.map(|p| p * gap), margin);
                let prepared = Prepared::new(&scene, &camera, &options, &()).unwrap();
                let traced = prepared.trace(1e-6, &()).unwrap();
                let ink: f64 = traced.strokes.iter().map(length).sum();
                let case = format!("gap {gap}, margin {margin}, {push:?}: {ink}");
                assert!(traced.strokes.iter().all(|s| s.kind == CurveKind::Crease && s.qi == 0), "{case}");
                // Nine edges of about 1; what is hidden or seen by the gaps at their ends is as long as the gaps.
                assert!((ink - 9.0).abs() <= 100.0 * gap + 1e-6, "{case}");
                assert_eq!(traced.stats.visibility.undecided.len(), 0, "{case}");
            }
        }
    }
}

#[test]
fn two_models_that_number_their_edges_alike_keep_their_own() {
    let camera = Camera::orthographic(DVec3::new(1.0, -1.3, 0.8), DVec3::Z).unwrap();
    let options = DrawOptions { isos: 0, ..DrawOptions::default() };
    let first = cube([1e-5; 6], 0.0);
    let mut second = first.clone();
    for part in &mut second.surfaces {
        let aside = DMat4::from_translation(DVec3::new(5.0, 0.0, 0.0));
        part.surface = part.surface.transformed(aside).unwrap();
    }
    let both = Scene::joined("two cubes", [first, second]);
    let prepared = Prepared::new(&both, &camera, &options, &()).unwrap();
    let traced = prepared.trace(1e-6, &()).unwrap();
    let ink: f64 = traced.strokes.iter().map(length).sum();
    assert!((ink - 18.0).abs() < 1e-2 && traced.strokes.iter().all(|s| s.kind == CurveKind::Crease), "{ink}");
}
