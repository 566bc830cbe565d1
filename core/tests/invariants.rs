//! What is drawn belongs to the shapes, not to how they are described: visible lengths stay the same when surfaces are
//! described otherwise, reordered, cut, or moved together with the eye.

use std::collections::BTreeMap;

use glam::{DMat4, DQuat, DVec3};
use penvis_core::nurbs::Surface;
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::scene::{Scene, SceneSurface};
use penvis_core::shape::{Frame, plane, sphere, torus};
use penvis_core::stroke::CurveKind;
use penvis_core::view::Camera;
use proptest::prelude::*;

/// A torus that a ball pierces, over a sheet that the torus touches nowhere.
fn model() -> Vec<Surface> {
    let ball = Frame::at(DVec3::new(2.6, 0.4, 0.3)).expect("a frame");
    vec![
        torus(&Frame::WORLD, 3.0, 1.0).expect("a torus"),
        sphere(&ball, 1.3).expect("a sphere"),
        plane(DVec3::new(-4.0, -3.5, -1.7), 8.5 * DVec3::X, DVec3::new(0.3, 7.0, 0.2)).expect("a plane"),
    ]
}

/// Visible length on the screen, kind by kind.
fn visible(surfaces: Vec<Surface>, eye: DVec3, up: DVec3, isos: u32, scale: f64) -> BTreeMap<CurveKind, f64> {
    let named = |(k, surface): (usize, Surface)| SceneSurface::new(k.to_string(), surface);
    let scene = Scene { name: String::new(), surfaces: surfaces.into_iter().enumerate().map(named).collect() };
    let camera = Camera::orthographic(eye, up).expect("a camera");
    let options = DrawOptions { isos, ..DrawOptions::default() };
    let prepared = Prepared::new(&scene, &camera, &options, &()).expect("a picture");
    let traced = prepared.trace(1e-5 * scale, &()).expect("nothing stops it");
    assert!(traced.stats.visibility.undecided.is_empty(), "{:?}", traced.stats.visibility.undecided);
    let mut lengths = BTreeMap::new();
    for stroke in &traced.strokes {
        let length: f64 = stroke.points.windows(2).map(|w| w[0].screen.distance(w[1].screen)).sum();
        *lengths.entry(stroke.kind).or_insert(0.0) += length / scale;
    }
    lengths
}

fn same(a: &BTreeMap<CurveKind, f64>, b: &BTreeMap<CurveKind, f64>) -> Result<(), TestCaseError> {
    let kinds: Vec<_> = a.keys().chain(b.keys()).collect();
    for kind in kinds {
        let (x, y) = (a.get(kind).copied().unwrap_or(0.0), b.get(kind).copied().unwrap_or(0.0));
        // Chords at a tolerance of 1e-5 fall short of their curves by less than that a unit of length.
        prop_assert!((x - y).abs() <= 1e-4 * (1.0 + x), "{kind:?}: {x} and {y}");
    }
    Ok(())
}

fn direction() -> impl Strategy<Value = DVec3> {
    (-1.0..1.0_f64, 0.0..core::f64::consts::TAU).prop_map(|(z, a)| {
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * a.cos(), r * a.sin(), z)
    })
}

fn up_of(eye: DVec3) -> DVec3 {
    if eye.z.abs() > 0.9 { DVec3::X } else { DVec3::Z }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn descriptions_of_the_same_surfaces_draw_the_same(eye in direction(), way in 0..6_usize) {
        let other: Vec<Surface> = model().iter().map(|s| match way {
            0 => s.reversed_u(),
            1 => s.reversed_v(),
            2 => s.transposed(),
            3 => s.elevated(s.degree_u() + 1, s.degree_v() + 1).expect("a degree in range"),
            4 => s.insert_knot_u(s.domain_u()[0] + 0.37 * (s.domain_u()[1] - s.domain_u()[0]), 1).expect("a knot inside"),
            _ => s.insert_knot_v(s.domain_v()[0] + 0.61 * (s.domain_v()[1] - s.domain_v()[0]), 1).expect("a knot inside"),
        }).collect();
        let up = up_of(eye);
        same(&visible(model(), eye, up, 3, 1.0), &visible(other, eye, up, 3, 1.0))?;
    }

    #[test]
    fn the_order_of_surfaces_does_not_matter(eye in direction()) {
        let reversed = model().into_iter().rev().collect();
        same(&visible(model(), eye, up_of(eye), 3, 1.0), &visible(reversed, eye, up_of(eye), 3, 1.0))?;
    }

    #[test]
    fn the_seam_of_a_cut_surface_is_not_drawn(eye in direction(), at in 0.1..0.9_f64, in_u: bool) {
        let cut = model().iter().flat_map(|s| {
            let [a, b] = if in_u { s.domain_u() } else { s.domain_v() };
            let t = a + at * (b - a);
            let (low, high) = if in_u { s.split_u(t) } else { s.split_v(t) }.expect("a place inside");
            [low, high]
        }).collect();
        same(&visible(model(), eye, up_of(eye), 0, 1.0), &visible(cut, eye, up_of(eye), 0, 1.0))?;
    }

    #[test]
    fn moving_turning_and_scaling_model_and_eye_together_changes_nothing(
        eye in direction(), axis in direction(), angle in 0.0..3.0_f64, far in 0.0..100.0_f64, scale in -3.0..3.0_f64,
    ) {
        let (turn, scale) = (DQuat::from_axis_angle(axis, angle), 10.0_f64.powf(scale));
        let map = DMat4::from_scale_rotation_translation(DVec3::splat(scale), turn, far * scale * axis);
        let moved = model().iter().map(|s| s.transformed(map).expect("a similarity")).collect();
        let up = up_of(eye);
        same(&visible(model(), eye, up, 3, 1.0), &visible(moved, turn * eye, turn * up, 3, scale))?;
    }
}
