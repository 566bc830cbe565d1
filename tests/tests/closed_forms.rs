//! Silhouettes and counts of sheets that are known exactly.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use penvis_core::nurbs::Surface;
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::scene::{Scene, SceneSurface};
use penvis_core::shape::{Frame, cylinder, plane, sphere, torus};
use penvis_core::stop::Stop;
use penvis_core::stroke::CurveKind;
use penvis_core::view::{Camera, ViewScene};
use penvis_core::visibility::{Occluders, RayScratch};

fn scene(surfaces: Vec<Surface>) -> Scene {
    let named = |(k, surface)| SceneSurface::new(format!("surface {k}"), surface);
    Scene { name: "closed form".into(), surfaces: surfaces.into_iter().enumerate().map(named).collect() }
}

fn parallel(direction: DVec3) -> Camera {
    let up = if direction.x == 0.0 && direction.y == 0.0 { DVec3::Y } else { DVec3::Z };
    Camera::orthographic(direction, up).expect("a camera")
}

/// The silhouettes of a surface as polylines in model space, dense enough for lengths to six digits.
fn silhouettes(surface: Surface, camera: &Camera) -> Vec<Vec<DVec3>> {
    const PARTS: u32 = 1000;
    let prepared = Prepared::new(&scene(vec![surface]), camera, &DrawOptions::default(), &()).expect("seen");
    let g = prepared.geometry();
    let of_kind = prepared.curves().iter().filter(|c| c.kind == CurveKind::Silhouette);
    of_kind
        .map(|c| {
            let [a, b] = c.domain;
            (0..=PARTS).map(|k| c.model_point(&g, a + (b - a) * f64::from(k) / f64::from(PARTS))).collect()
        })
        .collect()
}

fn length(lines: &[Vec<DVec3>]) -> f64 {
    lines.iter().flat_map(|line| line.windows(2)).map(|w| w[0].distance(w[1])).sum()
}

fn assert_close(value: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((value - expected).abs() <= tolerance, "{what}: {value} instead of {expected}");
}

const DIRECTIONS: [DVec3; 6] = [
    DVec3::Z,
    DVec3::NEG_Y,
    DVec3::new(1.0, -1.6, 0.75),
    DVec3::new(0.3, 0.2, 1.0),
    DVec3::new(-1.0, -1.0, 0.0),
    DVec3::new(0.001, -1.0, 1e-7),
];

#[test]
fn a_sphere_has_the_great_circle_across_the_sight_line() {
    for d in DIRECTIONS {
        let lines = silhouettes(sphere(&Frame::WORLD, 2.0).expect("a sphere"), &parallel(d));
        for p in lines.iter().flatten() {
            assert_close(p.length(), 2.0, 1e-12, "radius");
            assert_close(p.dot(d.normalize()), 0.0, 1e-9, "height over the plane");
        }
        assert_close(length(&lines), TAU * 2.0, 1e-4, "length");
    }
}

/// The points whose tangent planes hold the eye are those of the polar plane p · e = r².
#[test]
fn a_sphere_near_the_eye_has_its_polar_circle() {
    let r = 1.5;
    for eye in [DVec3::new(0.0, -4.0, 0.0), DVec3::new(2.0, -3.0, 1.0), DVec3::new(0.0, 0.0, 1.7)] {
        let up = if eye.x == 0.0 && eye.y == 0.0 { DVec3::Y } else { DVec3::Z };
        // The patches' control net reaches beyond the sphere, and must stay before the eye.
        let r = if eye.length() < 2.0 { 0.6 } else { r };
        let camera = Camera::perspective(eye, DVec3::ZERO, up).expect("a camera");
        let lines = silhouettes(sphere(&Frame::WORLD, r).expect("a sphere"), &camera);
        for p in lines.iter().flatten() {
            assert_close(p.length(), r, 1e-12, "radius");
            assert_close(p.dot(eye), r * r, 1e-8, "polar plane");
        }
        let radius = r * (1.0 - (r / eye.length()).powi(2)).sqrt();
        assert_close(length(&lines), TAU * radius, 1e-4, "length");
    }
}

/// At longitude θ from the sight line's side, seen at the angle a to the axis, the normal (cos φ cos θ, cos φ sin θ, sin φ)
/// is across the sight line where tan φ = −tan a cos θ: at one φ on the outer half of the tube and at one on the inner.
#[test]
fn a_torus_has_an_outer_and_an_inner_branch() {
    let (major, minor) = (3.0, 0.8);
    for a in [0.0, 0.02, 0.4, 0.9, 1.3, 1.55] {
        let d = DVec3::new(f64::sin(a), 0.0, f64::cos(a));
        let lines = silhouettes(torus(&Frame::WORLD, major, minor).expect("a torus"), &parallel(d));
        let mut lengths = [0.0; 2];
        for line in &lines {
            let tube = |p: DVec3| DVec2::new(p.truncate().length() - major, p.z);
            for p in line {
                assert_close(tube(*p).length(), minor, 1e-12, "distance from the middle of the tube");
                let (theta, phi) = (p.y.atan2(p.x), tube(*p).y.atan2(tube(*p).x));
                let across = phi.cos() * theta.cos() * a.sin() + phi.sin() * a.cos();
                assert_close(across, 0.0, 1e-8, "normal along the sight line");
            }
            lengths[usize::from(tube(line[500]).x < 0.0)] += length(std::slice::from_ref(line));
        }
        for (branch, found) in lengths.into_iter().enumerate() {
            // φ is in the right half for the outer branch, half a turn on for the inner.
            let at = |theta: f64| {
                let phi = (-a.sin() * theta.cos()).atan2(a.cos()) + PI * branch as f64;
                let r = major + minor * phi.cos();
                DVec3::new(r * theta.cos(), r * theta.sin(), minor * phi.sin())
            };
            let exact: Vec<DVec3> = (0..=20_000).map(|k| at(TAU * f64::from(k) / 20_000.0)).collect();
            assert_close(found, length(&[exact]), 1e-3, &format!("length of branch {branch} at {a}"));
        }
    }
}

/// From the side the two branches meet: the circles of the tube left and right, and those on its top and bottom.
#[test]
fn a_torus_from_the_side_has_four_circles() {
    let (major, minor) = (3.0, 0.8);
    let lines = silhouettes(torus(&Frame::WORLD, major, minor).expect("a torus"), &parallel(DVec3::X));
    let mut lengths = [0.0; 2];
    for line in &lines {
        let on_tube = line.iter().all(|p| p.x.abs() < 1e-9);
        assert!(on_tube || line.iter().all(|p| (p.z.abs() - minor).abs() < 1e-9), "a silhouette is on no circle");
        lengths[usize::from(on_tube)] += length(std::slice::from_ref(line));
    }
    assert_close(lengths[0], 2.0 * TAU * major, 1e-3, "top and bottom");
    assert_close(lengths[1], 2.0 * TAU * minor, 1e-3, "left and right");
}

/// The circles on which it lies are seen edge-on, each a line over which it comes back along itself: two such lines and
/// the outer halves of two circles of the tube are visible.
#[test]
fn a_torus_from_the_side_is_drawn_once() {
    for direction in [DVec3::X, DVec3::NEG_Y, DVec3::new(0.6, -0.8, 0.0)] {
        let scene = scene(vec![torus(&Frame::WORLD, 3.0, 1.0).expect("a torus")]);
        let wanted = DrawOptions { isos: 0, ..DrawOptions::default() };
        let prepared = Prepared::new(&scene, &parallel(direction), &wanted, &()).expect("seen");
        let strokes = prepared.trace(1e-7, &()).expect("nothing stops it").strokes;
        let ink: f64 =
            strokes.iter().flat_map(|s| s.points.windows(2)).map(|w| w[0].screen.distance(w[1].screen)).sum();
        assert_close(ink, TAU + 4.0 * 3.0, 1e-5, "ink");
    }
}

#[test]
fn a_cylinder_has_two_lines_and_none_along_its_axis() {
    let (radius, height) = (1.2, 3.5);
    for d in DIRECTIONS {
        let surface = cylinder(&Frame::WORLD, radius, height).expect("a cylinder");
        let lines = silhouettes(surface, &parallel(d));
        if d == DVec3::Z {
            assert!(lines.is_empty(), "edge-on everywhere");
            continue;
        }
        let across = d.truncate().perp().normalize() * radius;
        for p in lines.iter().flatten() {
            let off = p.truncate().distance(across).min(p.truncate().distance(-across));
            assert_close(off, 0.0, 1e-9, "distance from the lines");
        }
        assert_close(length(&lines), 2.0 * height, 1e-9, "length");
    }
}

/// Counts sheets before places (x, y) of the plane that faces the eye, at the depth `z` of view space.
struct Sheets {
    occluders: Occluders<'static>,
    scratch: RayScratch,
}

impl Sheets {
    fn new(surfaces: Vec<Surface>, camera: &Camera) -> Self {
        let view = ViewScene::new(&scene(surfaces), camera).expect("seen");
        Self { occluders: Occluders::new(view.patches(), Stop::NEVER), scratch: RayScratch::default() }
    }

    /// All counts on a grid over [−half, half]², those that the rays call clear.
    fn agree(&mut self, half: f64, z: f64, expected: impl Fn(f64, f64) -> u32) {
        const N: u32 = 61;
        let (mut clear, mut seen) = (0, Vec::new());
        for i in 0..N {
            for j in 0..N {
                // Symmetric places lie on seams and poles, which are the hard ones; others lie anywhere.
                let at = |k: u32| half * (2.0 * f64::from(k) / f64::from(N - 1) - 1.0);
                let (x, y) = (at(i), at(j));
                let answer = self.occluders.query(DVec3::new(x, y, z), &[], &mut self.scratch);
                if answer.clear {
                    clear += 1;
                    assert_eq!(answer.qi, expected(x, y), "at ({x}, {y}, {z})");
                    seen.push(answer.qi);
                }
            }
        }
        assert!(clear * 100 > N * N * 97, "only {clear} of {} are clear", N * N);
        seen.sort_unstable();
        seen.dedup();
        assert!(seen.len() > 1, "the same everywhere");
    }
}

#[test]
fn nested_spheres_count_two_each() {
    let radii = [0.35, 0.6, 1.0, 1.4, 1.9];
    for d in [DVec3::Z, DVec3::new(1.0, -1.6, 0.75)] {
        let surfaces = radii.iter().map(|&r| sphere(&Frame::WORLD, r).expect("a sphere")).collect();
        let mut sheets = Sheets::new(surfaces, &parallel(d));
        for z in [-3.0, -1.2, -0.5, 0.013, 0.7, 1.5] {
            sheets.agree(2.1, z, |x, y| {
                let passes = |r: f64| {
                    let h = r * r - x * x - y * y;
                    if h <= 0.0 { 0 } else { u32::from(h.sqrt() > z) + u32::from(-h.sqrt() > z) }
                };
                radii.iter().map(|&r| passes(r)).sum()
            });
        }
    }
}

#[test]
fn a_stack_of_planes_counts_one_each() {
    let layers = 12;
    let wall = |k: i32| {
        let (half, z) = (2.0 - 0.15 * f64::from(k), 0.1 * f64::from(k));
        plane(DVec3::new(-half, -half, z), 2.0 * half * DVec3::X, 2.0 * half * DVec3::Y).expect("a plane")
    };
    let mut sheets = Sheets::new((0..layers).map(wall).collect(), &parallel(DVec3::Z));
    for z in [-1.0, 0.05, 0.55, 1.04] {
        sheets.agree(2.03, z, |x, y| {
            let covers = |k: i32| x.abs().max(y.abs()) < 2.0 - 0.15 * f64::from(k) && 0.1 * f64::from(k) > z;
            (0..layers).filter(|&k| covers(k)).count() as u32
        });
    }
}

#[test]
fn a_torus_counts_nothing_two_or_four() {
    let (major, minor) = (2.0, 0.6);
    let ring = || vec![torus(&Frame::WORLD, major, minor).expect("a torus")];
    Sheets::new(ring(), &parallel(DVec3::Z)).agree(3.0, -5.0, |x, y| {
        let r = x.hypot(y);
        if (r - major).abs() < minor { 2 } else { 0 }
    });
    Sheets::new(ring(), &parallel(DVec3::NEG_Y)).agree(3.0, -5.0, |x, z| {
        // The sight line meets the torus where it is major ± √(minor² − z²) from the axis.
        let h = minor * minor - z * z;
        let at = |r: f64| if r > x.abs() { 2 } else { 0 };
        if h <= 0.0 { 0 } else { at(major + h.sqrt()) + at(major - h.sqrt()) }
    });
}
