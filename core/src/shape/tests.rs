//! Closed forms.

use alloc::vec;
use core::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DVec3, DVec4};

use super::*;
use crate::nurbs::{Curve, KnotVector, Surface};

fn tilted() -> Frame {
    Frame::new(DVec3::new(3.0, -2.0, 5.0), DVec3::new(1.0, 2.0, 2.0), DVec3::new(0.3, -1.0, 0.0)).unwrap()
}

/// Points of a surface in the coordinates of a frame, with the normal S_u × S_v there.
fn local(s: &Surface, f: &Frame) -> impl Iterator<Item = (DVec3, DVec3)> {
    let (s, [x, y, z], o) = (s.clone(), f.axes(), f.origin());
    let into = move |d: DVec3| DVec3::new(d.dot(x), d.dot(y), d.dot(z));
    let at = move |i: i32, n: i32, [a, b]: [f64; 2]| a + (b - a) * f64::from(i) / f64::from(n);
    let uv = (0..=24).flat_map(|i| (0..=16).map(move |j| (i, j)));
    uv.map(move |(i, j)| {
        let (p, du, dv) = s.derivatives(at(i, 24, s.domain_u()), at(j, 16, s.domain_v()));
        (into(p - o), into(du.cross(dv)))
    })
}

fn radius(p: DVec3) -> f64 {
    p.truncate().length()
}

#[test]
fn sphere_points_are_at_the_radius_and_normals_point_out() {
    let f = tilted();
    let s = sphere(&f, 2.5).unwrap();
    assert_eq!((s.knots_u().control_count(), s.knots_v().control_count()), (9, 5));
    for (p, n) in local(&s, &f) {
        assert!((p.length() / 2.5 - 1.0).abs() < 1e-14);
        // At the poles the normal vanishes.
        assert!(n.dot(p) > 0.0 || radius(p) < 1e-14);
    }
    let poles = [s.eval(0.3, 0.0), s.eval(0.6, 1.0)];
    assert!((poles[0] - (f.origin() - 2.5 * f.axes()[2])).length() < 1e-14);
    assert!((poles[1] - (f.origin() + 2.5 * f.axes()[2])).length() < 1e-14);
}

#[test]
fn cylinder_cone_and_annulus_satisfy_their_equations() {
    let f = tilted();
    for (p, n) in local(&cylinder(&f, 0.7, 3.0).unwrap(), &f) {
        assert!((radius(p) / 0.7 - 1.0).abs() < 1e-14 && n.truncate().dot(p.truncate()) > 0.0 && n.z.abs() < 1e-13);
    }
    for (p, n) in local(&cone(&f, 2.0, 0.0, 3.0).unwrap(), &f) {
        assert!((radius(p) - 2.0 * (1.0 - p.z / 3.0)).abs() < 1e-14);
        assert!(n.truncate().dot(p.truncate()) > 0.0 || radius(p) < 1e-14);
    }
    for (p, n) in local(&annulus(&f, 0.5, 2.0).unwrap(), &f) {
        assert!(p.z.abs() < 1e-14 && (0.5 - 1e-14..=2.0 + 1e-14).contains(&radius(p)) && n.z > 0.0);
    }
    assert!(local(&disk(&f, 2.0).unwrap(), &f).all(|(p, n)| n.z > 0.0 || radius(p) < 1e-14));
}

#[test]
fn torus_points_satisfy_its_equation_and_normals_point_out() {
    let f = tilted();
    for (p, n) in local(&torus(&f, 3.0, 1.25).unwrap(), &f) {
        let centre = (p.truncate() / radius(p) * 3.0).extend(0.0);
        assert!(((p - centre).length() / 1.25 - 1.0).abs() < 2e-14);
        assert!(n.dot(p - centre) > 0.0);
    }
}

#[test]
fn full_turns_close_bit_for_bit() {
    let t = torus(&tilted(), 3.0, 1.25).unwrap();
    for i in 0..=10 {
        let x = f64::from(i) / 10.0;
        assert_eq!(t.eval(0.0, x), t.eval(1.0, x));
        assert_eq!(t.eval(x, 0.0), t.eval(x, 1.0));
    }
}

#[test]
fn the_area_of_a_circle_and_of_a_sphere() {
    // Half the integral of (x y' − y x') by Simpson's rule on each quarter.
    let c = circle(&Frame::WORLD, 3.0).unwrap();
    let integrand = |t: f64| {
        let [p, d, _] = c.derivatives(t);
        0.5 * (p.x * d.y - p.y * d.x)
    };
    let n = 400;
    let sum: f64 = (0..=n)
        .map(|i| {
            integrand(f64::from(i) / f64::from(n)) * if i == 0 || i == n { 1.0 } else { f64::from(2 + 2 * (i % 2)) }
        })
        .sum();
    assert!((sum / (3.0 * f64::from(n)) / (9.0 * PI) - 1.0).abs() < 1e-9);

    let s = sphere(&Frame::WORLD, 2.0).unwrap();
    let n = 80;
    let at = |i: i32| (f64::from(i) + 0.5) / f64::from(n);
    let cell = |(i, j)| {
        let (_, du, dv) = s.derivatives(at(i), at(j));
        du.cross(dv).length() / f64::from(n * n)
    };
    let area: f64 = (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).map(cell).sum();
    assert!((area / (16.0 * PI) - 1.0).abs() < 1e-3);
}

#[test]
fn arcs_of_any_sweep_begin_and_end_where_they_should() {
    let f = tilted();
    let [x, y, _] = f.axes();
    let on = |a: f64| f.origin() + 2.0 * (libm::cos(a) * x + libm::sin(a) * y);
    for sweep in [1e-9, 0.3, FRAC_PI_2, 1.6, PI, 3.3, 1.5 * PI, 5.0, TAU, -0.3, -FRAC_PI_2, -4.0, -TAU] {
        let c = arc(&f, 2.0, 0.7, sweep).unwrap();
        for (t, a) in [(0.0, 0.7), (0.5, 0.7 + 0.5 * sweep), (1.0, 0.7 + sweep)] {
            assert!((c.eval(t) - on(a)).length() < 4e-15 * 8.0, "{sweep} at {t}");
        }
        for i in 0..=40 {
            let r = (c.eval(f64::from(i) / 40.0) - f.origin()).length();
            assert!((r / 2.0 - 1.0).abs() < 1e-14, "{sweep}");
        }
    }
}

#[test]
fn a_revolved_semicircle_is_the_sphere_and_its_poles_are_points() {
    let f = tilted();
    let [x, _, z] = f.axes();
    let meridian = Frame::new(f.origin(), x.cross(z), x).unwrap();
    let c = arc(&meridian, 2.5, -FRAC_PI_2, PI).unwrap();
    let s = revolution(&c, f.origin(), z * 17.0, TAU).unwrap();
    for (p, n) in local(&s, &f) {
        assert!((p.length() / 2.5 - 1.0).abs() < 1e-14);
        assert!(n.dot(p) > 0.0 || radius(p) < 1e-14);
    }
    for i in 0..=10 {
        assert!((s.eval(f64::from(i) / 10.0, 1.0) - s.eval(0.0, 1.0)).length() < 4e-15);
    }
}

#[test]
fn a_partial_revolution_turns_the_profile() {
    let profile = line(DVec3::new(1.0, 0.0, 0.0), DVec3::new(2.0, 0.0, 1.0)).unwrap();
    let s = revolution(&profile, DVec3::ZERO, DVec3::Z, 2.0).unwrap();
    let end = s.eval(1.0, 0.5);
    assert!((end - DVec3::new(1.5 * libm::cos(2.0), 1.5 * libm::sin(2.0), 0.5)).length() < 1e-15);
    assert_eq!(s.eval(0.0, 0.5), profile.eval(0.5));
}

#[test]
fn a_ruled_surface_joins_curves_of_different_degree_and_knots() {
    let a = circle(&Frame::WORLD, 1.0).unwrap();
    let knots = KnotVector::new(vec![2.0, 2.0, 2.0, 2.0, 2.6, 3.0, 5.0, 5.0, 5.0, 5.0], 3).unwrap();
    let points = (0..6).map(|i| DVec4::new(f64::from(i), f64::from(i * i % 5), 4.0, 1.0 + f64::from(i % 3))).collect();
    let b = Curve::new(knots, points).unwrap();
    let s = ruled(&a, &b).unwrap();
    assert_eq!((s.degree_u(), s.degree_v(), s.domain_u()), (3, 1, [0.0, 1.0]));
    // Knots 2.6, 3 and 5 of b are 0.2, ⅓ and 1 of a, which has ¼, ½ and ¾.
    assert_eq!(s.knots_u().breaks().len(), 7);
    for i in 0..=30 {
        let t = f64::from(i) / 30.0;
        assert!((s.eval(t, 0.0) - a.eval(t)).length() < 1e-14);
        assert!((s.eval(t, 1.0) - b.eval(2.0 + 3.0 * t)).length() < 1e-13);
    }
}

#[test]
fn knots_that_agree_but_for_rounding_are_united() {
    let a = polyline(&[DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]).unwrap();
    let b = Curve::new(KnotVector::uniform(1, 3, [0.1, 0.7]).unwrap(), a.homogeneous().to_vec()).unwrap();
    assert_eq!(ruled(&a, &b).unwrap().knots_u().breaks(), a.knots().breaks());
}

#[test]
fn an_extruded_circle_is_the_cylinder() {
    let f = tilted();
    let s = extrusion(&circle(&f, 0.7).unwrap(), f.axes()[2] * 3.0).unwrap();
    let c = cylinder(&f, 0.7, 3.0).unwrap();
    for (a, b) in local(&s, &f).zip(local(&c, &f)) {
        assert!((a.0 - b.0).length() < 1e-14 && (a.1 - b.1).length() < 1e-12);
    }
}

#[test]
fn a_plane_is_affine_in_both_parameters() {
    let (o, a, b) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(2.0, 0.0, 1.0), DVec3::new(0.0, 3.0, -1.0));
    let s = plane(o, a, b).unwrap();
    let (p, du, dv) = s.derivatives(0.25, 0.5);
    assert!((p - (o + 0.25 * a + 0.5 * b)).length() < 1e-15);
    assert!((du - a).length() < 1e-15 && (dv - b).length() < 1e-15);
}

#[test]
fn what_is_no_shape_is_refused_by_name() {
    let w = Frame::WORLD;
    assert!(matches!(sphere(&w, 0.0), Err(ShapeError::NotPositive { .. })));
    assert!(matches!(sphere(&w, f64::NAN), Err(ShapeError::NotPositive { .. })));
    assert!(matches!(sphere(&w, f64::MAX), Ok(_) | Err(ShapeError::Nurbs(_))));
    assert!(matches!(cone(&w, 0.0, 0.0, 1.0), Err(ShapeError::Radii { .. })));
    assert!(matches!(cone(&w, -1.0, 0.0, 1.0), Err(ShapeError::Negative { .. })));
    assert!(matches!(annulus(&w, 2.0, 2.0), Err(ShapeError::Radii { .. })));
    assert!(matches!(arc(&w, 1.0, 0.0, 0.0), Err(ShapeError::Sweep { .. })));
    assert!(matches!(arc(&w, 1.0, 0.0, 6.3), Err(ShapeError::Sweep { .. })));
    assert!(matches!(arc(&w, 1.0, f64::INFINITY, 1.0), Err(ShapeError::NotFinite { .. })));
    assert!(matches!(line(DVec3::X, DVec3::X), Err(ShapeError::EqualPoints { index: 1 })));
    assert!(matches!(polyline(&[DVec3::X]), Err(ShapeError::TooFewPoints { count: 1 })));
    assert!(matches!(plane(DVec3::ZERO, DVec3::X, DVec3::X), Err(ShapeError::Parallel { .. })));
    assert!(matches!(extrusion(&circle(&w, 1.0).unwrap(), DVec3::ZERO), Err(ShapeError::NoDirection { .. })));
    assert!(matches!(Frame::new(DVec3::ZERO, DVec3::Z, DVec3::Z), Err(ShapeError::Parallel { .. })));
    assert!(matches!(Frame::along(DVec3::NAN, DVec3::Z), Err(ShapeError::NotFinite { .. })));
    assert_eq!(Frame::at(DVec3::ZERO).unwrap(), w);
}
