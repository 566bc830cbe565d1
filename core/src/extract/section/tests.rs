use alloc::vec::Vec;
use core::f64::consts::{PI, TAU};

use glam::DVec3;

use super::*;
use crate::nurbs::Surface;
use crate::scene::{Scene, SceneSurface};
use crate::shape::{Frame, cylinder, plane, sphere};
use crate::stitch::StitchOptions;
use crate::view::Camera;

/// Sections of some surfaces, seen from above so that view coordinates are model coordinates.
fn found(surfaces: Vec<Surface>) -> (ViewScene, Sections) {
    let named = surfaces.into_iter().map(|surface| SceneSurface::new("s", surface));
    let scene = Scene { name: "s".into(), surfaces: named.collect() };
    let view = ViewScene::new(&scene, &Camera::orthographic(DVec3::Z, DVec3::Y).unwrap()).unwrap();
    let stitching = Stitching::new(&view, &StitchOptions { distance: 1e-6 * view.size(), angle: 0.02 }, Stop::NEVER);
    let sections = sections(&view, &stitching, 1e-6 * view.size(), Stop::NEVER);
    (view, sections)
}

/// Points along a section, and whether it closes.
fn traced(view: &ViewScene, curve: &SectionCurve) -> (Vec<DVec3>, bool) {
    let per = 5;
    let n = curve.arcs.len() * per;
    let points: Vec<DVec3> = (0..=n)
        .map(|k| {
            let t = k as f64 / per as f64;
            let at = curve.at(view.patches(), t, curve.arc_at(t));
            let [a, b] = [0, 1].map(|k| view.patches()[at.patches[k]].eval(at.local[k].x, at.local[k].y));
            assert!(a.distance(b) < 1e-12, "on both surfaces: {a} {b}");
            a
        })
        .collect();
    let closes = points[0].distance(points[n]) < 1e-9;
    (points, closes)
}

fn length(points: &[DVec3]) -> f64 {
    points.windows(2).map(|w| w[0].distance(w[1])).sum()
}

fn square(z: f64, half: f64) -> Surface {
    plane(DVec3::new(-half, -half, z), 2.0 * half * DVec3::X, 2.0 * half * DVec3::Y).unwrap()
}

fn tilted() -> Frame {
    Frame::new(DVec3::new(0.1, -0.05, 0.02), DVec3::new(0.3, -0.2, 1.0), DVec3::X).unwrap()
}

#[test]
fn a_plane_cuts_a_sphere_in_a_circle() {
    // Along parallels of the sphere, through its equator, and at an angle.
    for (frame, z) in [(Frame::WORLD, 0.3), (Frame::WORLD, 1e-3), (tilted(), 0.02), (tilted(), 0.4)] {
        let (view, sections) = found(vec![sphere(&frame, 1.0).unwrap(), square(z, 2.0)]);
        assert!(sections.undecided.is_empty());
        let [curve] = &sections.curves[..] else { panic!("{z}: {} curves", sections.curves.len()) };
        let (points, closes) = traced(&view, curve);
        assert!(closes, "{z}");
        let middle = if frame == Frame::WORLD { DVec3::ZERO } else { DVec3::new(0.1, -0.05, 0.02) };
        let radius = libm::sqrt(1.0 - (z - middle.z) * (z - middle.z));
        for p in &points {
            let r = (*p - middle).truncate().length();
            assert!((p.z - z).abs() < 1e-12 && (r - radius).abs() < 1e-12, "{p}");
        }
        assert!((length(&points) - TAU * radius).abs() < 1e-2 * radius, "{}", length(&points));
    }
}

#[test]
fn a_tiny_circle_is_not_missed() {
    let z = 1.0 - 1e-6;
    let (view, sections) = found(vec![sphere(&tilted(), 1.0).unwrap(), square(0.02 + z, 2.0)]);
    let [curve] = &sections.curves[..] else { panic!("{} curves", sections.curves.len()) };
    let (points, closes) = traced(&view, curve);
    let radius = libm::sqrt(1.0 - z * z);
    assert!(
        closes && (length(&points) - TAU * radius).abs() < 0.05 * radius,
        "{} of {}, {}",
        length(&points),
        TAU * radius,
        points[0].distance(points[points.len() - 1])
    );
    for p in points {
        assert!(((p - DVec3::new(0.1, -0.05, 0.02)).length() - 1.0).abs() < 1e-12);
    }
}

#[test]
fn two_pipes_of_one_size_meet_in_ellipses_that_cross() {
    // At the two crossings the pipes touch: no arc is known there, but everywhere else.
    let across = Frame::new(DVec3::new(-2.0, 0.0, 0.0), DVec3::X, DVec3::Y).unwrap();
    let along = Frame::new(DVec3::new(0.0, 0.0, -2.0), DVec3::Z, DVec3::X).unwrap();
    let (view, sections) = found(vec![cylinder(&along, 0.5, 4.0).unwrap(), cylinder(&across, 0.5, 4.0).unwrap()]);
    let mut total = 0.0;
    for curve in &sections.curves {
        let (points, _) = traced(&view, curve);
        total += length(&points);
        for p in points {
            assert!((p.x.abs() - p.z.abs()).abs() < 1e-6, "{p}");
        }
    }
    // Two ellipses with half axes ½ and √½.
    let h = 0.029_437_251_522_859_42_f64;
    let around = PI * (0.5 + core::f64::consts::FRAC_1_SQRT_2) * (1.0 + h / 4.0 + h * h / 64.0);
    assert!((total - 2.0 * around).abs() < 0.02, "{total} of {}", 2.0 * around);
}

#[test]
fn what_touches_or_coincides_has_no_section() {
    let (_, touching) = found(vec![sphere(&Frame::WORLD, 1.0).unwrap(), square(1.0, 2.0)]);
    assert!(touching.curves.is_empty(), "{}", touching.curves.len());
    let (_, apart) = found(vec![sphere(&Frame::WORLD, 1.0).unwrap(), square(1.0 + 1e-5, 2.0)]);
    assert!(apart.curves.is_empty() && apart.undecided.is_empty());
    let (_, same) = found(vec![square(0.0, 1.0), square(0.0, 0.7)]);
    assert!(same.curves.is_empty());
}

#[test]
fn a_wall_ends_the_section() {
    let wall = plane(DVec3::new(0.3, -2.0, -2.0), 4.0 * DVec3::Y, 4.0 * DVec3::Z).unwrap();
    let (view, sections) = found(vec![wall, square(0.25, 1.0)]);
    let [curve] = &sections.curves[..] else { panic!("{} curves", sections.curves.len()) };
    let (points, closes) = traced(&view, curve);
    assert!(!closes);
    assert!((length(&points) - 2.0).abs() < 1e-9, "from edge to edge of the square: {}", length(&points));
    assert!(points.iter().all(|p| (p.x - 0.3).abs() < 1e-12 && (p.z - 0.25).abs() < 1e-12));
}
