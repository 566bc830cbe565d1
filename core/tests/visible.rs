//! Visible regions of shapes whose areas are known in closed form, and what may not change them.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};
use penvis_core::nurbs::Surface;
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::scene::{Scene, SceneSurface};
use penvis_core::shape::{Frame, annulus, cylinder, plane, sphere, torus};
use penvis_core::stroke::CurveKind;
use penvis_core::view::Camera;
use penvis_core::visible::{VisibleLoop, VisibleRegion, VisibleRegions};

const TOLERANCE: f64 = 1e-4;

fn seen(surfaces: &[Surface], camera: &Camera) -> VisibleRegions {
    seen_within(surfaces, camera, TOLERANCE)
}

fn seen_within(surfaces: &[Surface], camera: &Camera, tolerance: f64) -> VisibleRegions {
    let named = |(k, s): (usize, &Surface)| SceneSurface::new(format!("s{k}"), s.clone());
    let scene = Scene { name: "scene".into(), surfaces: surfaces.iter().enumerate().map(named).collect() };
    let prepared = Prepared::new(&scene, camera, &DrawOptions::default(), &()).unwrap();
    let regions = prepared.visible_regions(tolerance, 0.2, &()).unwrap();
    assert_eq!(regions.undecided, []);
    check(&prepared, &regions);
    regions
}

/// Loops are closed on the screen and, but for poles, in the parameters; each point of a border is a point of its surface, chords
/// turn the normal by little, and its points on the screen are where its parameters say.
fn check(prepared: &Prepared, regions: &VisibleRegions) {
    let view = prepared.geometry().view;
    for region in &regions.regions {
        for l in &region.loops {
            for (k, edge) in l.edges.iter().enumerate() {
                let next = &l.edges[(k + 1) % l.edges.len()];
                let (a, b) = (edge.points.last().unwrap(), next.points.first().unwrap());
                assert_eq!(a.screen, b.screen);
                let apart = |uv: DVec2| view.model_point(region.surface, uv);
                let jump = apart(a.uv).distance(apart(b.uv));
                assert!(jump < 1e-2, "from {} to {} at {}: {jump}", a.uv, b.uv, a.screen);
                for p in &edge.points {
                    let there = view.jet(region.surface, p.uv, [false; 2]).p.truncate();
                    assert!(there.distance(p.screen) < 1e-4, "{} is at {there}, not {}", p.uv, p.screen);
                }
            }
        }
    }
}

fn along(eye: [f64; 3]) -> Camera {
    Camera::orthographic(DVec3::from_array(eye), DVec3::new(0.1, 1.0, 0.2)).unwrap()
}

fn total(regions: &VisibleRegions) -> f64 {
    regions.regions.iter().map(VisibleRegion::area).sum()
}

/// The loops of a surface's region, outer ones first: how many there are of both.
fn loops(regions: &VisibleRegions, surface: usize) -> (usize, usize) {
    let region = regions.regions.iter().find(|r| r.surface == surface).unwrap();
    let outer = region.loops.iter().filter(|l| l.area() > 0.0).count();
    (outer, region.loops.len() - outer)
}

#[track_caller]
fn near(got: f64, expected: f64) {
    assert!((got - expected).abs() <= 2e-4 * expected, "{got} is not {expected}");
}

#[test]
fn a_visible_sphere_is_a_disc() {
    let ball = [sphere(&Frame::WORLD, 1.5).unwrap()];
    for eye in [[0.3, -0.7, 0.5], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]] {
        near(total(&seen(&ball, &along(eye))), PI * 2.25);
    }
    // From the distance d the tangents make an angle with sine r / d.
    let camera = Camera::perspective(DVec3::new(2.0, 3.0, 4.0), DVec3::ZERO, DVec3::Z).unwrap();
    near(total(&seen(&ball, &camera)), PI * 29.0 * 2.25 / (29.0 - 2.25));
}

/// A sphere of two halves that meet in a meridian. Seen from nearly above the middle of one of them, that meridian is an ellipse
/// within the silhouette, which is a circle, and what is seen of the other half lies between the two: a crescent as wide as the
/// cosine of the tilt is less than 1, narrower than chords are good to.
#[test]
fn a_visible_crescent_may_be_narrower_than_the_chords_of_its_borders() {
    let [a, b] = halves_of_a_sphere();
    for tilt in [0.1, 0.03, 0.01] {
        for tolerance in [3e-3, 1e-3, 1e-4] {
            let regions =
                seen_within(&[a.clone(), b.clone()], &along([f64::sin(tilt), f64::cos(tilt), 0.0]), tolerance);
            let areas: Vec<f64> = regions.regions.iter().map(VisibleRegion::area).collect();
            let expected = [0.5 * PI * (1.0 + f64::cos(tilt)), 0.5 * PI * (1.0 - f64::cos(tilt))];
            // Chords that are within the tolerance of a border as long as the circle.
            let room = 2.0 / 3.0 * TAU * tolerance;
            assert_eq!(areas.len(), 2, "{tilt}, {tolerance}: {areas:?}");
            for (got, expected) in areas.iter().zip(expected) {
                assert!((got - expected).abs() <= room, "{tilt}, {tolerance}: {got} is not {expected}");
            }
        }
    }
}

/// The unit sphere in two halves, of which the first has positive y.
fn halves_of_a_sphere() -> [Surface; 2] {
    let (a, b) = sphere(&Frame::WORLD, 1.0).unwrap().split_u(0.5).unwrap();
    [a, b]
}

#[test]
fn a_visible_torus_is_a_ring_or_a_stadium() {
    let ring = [torus(&Frame::WORLD, 3.0, 1.0).unwrap()];
    near(total(&seen(&ring, &along([0.0, 0.0, 1.0]))), PI * (16.0 - 4.0));
    near(total(&seen(&ring, &along([1.0, 0.0, 0.0]))), 12.0 + PI);
    // Whatever it hides of itself, the picture is what lies within 1 of the circle's image; here that is an ellipse, with a hole.
    let oblique = seen(&ring, &along([0.3, -0.7, 0.5]));
    let region = &oblique.regions[0];
    assert!(region.loops.iter().flat_map(|l| &l.edges).any(|e| !e.own && e.kind == CurveKind::Silhouette));
}

#[test]
fn a_visible_cylinder_in_perspective_has_the_area_of_its_outline() {
    let (far, height) = (4.0_f64, 3.0);
    let tube = [cylinder(&Frame::WORLD, 1.0, height).unwrap()];
    let target = DVec3::new(0.0, 0.0, 0.5 * height);
    let camera = Camera::perspective(target + far * DVec3::X, target, DVec3::Z).unwrap();
    // From the middle of its height the nearer halves of the rims hide its inside.
    let regions = seen(&tube, &camera);
    // At the angle a the rim is at (sin a, ± h/2) d / (d - cos a); Simpson's rule from tangent to tangent.
    let end = (1.0 / far).acos();
    let width = |a: f64| far * (far * a.cos() - 1.0) / (far - a.cos()).powi(2);
    let area = |a: f64| height * far / (far - a.cos()) * width(a);
    let n = 1000;
    let weight = |k: usize| if k == 0 || k == n { 1.0 } else { [2.0, 4.0][k % 2] };
    let step = 2.0 * end / n as f64;
    let expected: f64 = (0..=n).map(|k| weight(k) * area(-end + step * k as f64)).sum::<f64>() * step / 3.0;
    near(total(&regions), expected);
}

/// A box's six faces.
fn cube() -> Vec<Surface> {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let face = |k: usize, low: bool| {
        let (u, v, n) = (axes[(k + 1) % 3], axes[(k + 2) % 3], axes[k]);
        plane(if low { DVec3::ZERO } else { n }, u, v).unwrap()
    };
    (0..3).flat_map(|k| [face(k, true), face(k, false)]).collect()
}

#[test]
fn a_visible_cube_shows_the_faces_that_look_at_the_eye() {
    let eye = DVec3::new(0.5, -0.4, 0.8);
    let regions = seen(&cube(), &along(eye.to_array()));
    let faces: Vec<usize> = regions.regions.iter().map(|r| r.surface).collect();
    assert_eq!(faces, [1, 2, 5]);
    let share = eye.normalize().abs();
    for (region, expected) in regions.regions.iter().zip(share.to_array()) {
        near(region.area(), expected);
        assert_eq!(region.loops.len(), 1);
        assert_eq!(region.loops[0].edges.len(), 4);
    }
    // Along an axis one face is all there is.
    let straight = seen(&cube(), &along([0.0, 0.0, 1.0]));
    near(total(&straight), 1.0);
    assert_eq!(straight.regions.len(), 1);
}

#[test]
fn visible_regions_have_holes_and_parts() {
    let back = plane(DVec3::new(-4.0, -4.0, -1.0), 8.0 * DVec3::X, 8.0 * DVec3::Y).unwrap();
    let ring = annulus(&Frame::WORLD, 1.0, 2.0).unwrap();
    let regions = seen(&[back.clone(), ring], &along([0.0, 0.0, 1.0]));
    // The sheet inside the ring, and outside of it with a hole.
    assert_eq!(loops(&regions, 0), (2, 1));
    near(regions.regions[0].area(), 64.0 - 3.0 * PI);
    near(regions.regions[1].area(), 3.0 * PI);
    let bar = plane(DVec3::new(-1.0, -5.0, 0.0), 2.0 * DVec3::X, 10.0 * DVec3::Y).unwrap();
    let regions = seen(&[back, bar], &along([0.0, 0.0, 1.0]));
    assert_eq!(loops(&regions, 0), (2, 0));
    near(regions.regions[0].area(), 48.0);
    let own = |l: &VisibleLoop| l.edges.iter().filter(|e| !e.own).map(|e| e.kind).collect::<Vec<_>>();
    assert!(regions.regions[0].loops.iter().all(|l| own(l) == [CurveKind::Boundary]));
}

#[test]
fn visible_regions_end_where_surfaces_pierce_each_other() {
    let (a, b) = (3.0, 1.0);
    let ball = sphere(&Frame::WORLD, b).unwrap();
    let sheet = plane(DVec3::new(-a, -a, 0.5), 2.0 * a * DVec3::X, 2.0 * a * DVec3::Y).unwrap();
    let regions = seen(&[ball, sheet], &along([0.0, 0.0, 1.0]));
    let cap = PI * (1.0 - 0.25);
    near(regions.regions[0].area(), cap);
    near(regions.regions[1].area(), 4.0 * a * a - cap);
    let kinds = |r: &VisibleRegion, kind| r.loops.iter().flat_map(|l| &l.edges).any(|e| e.kind == kind && e.own);
    assert!(regions.regions.iter().all(|r| kinds(r, CurveKind::Section)));
}

/// Where a border of a sheet pierces a sphere beside its silhouette, and leaves over this: at a distance of a hundredth of what counts as one
/// place to a hundred times as much, and at several angles. Silhouette, border and section then meet in a triangle as narrow.
#[test]
fn a_border_may_pierce_a_surface_right_beside_its_silhouette() {
    let height = 0.3;
    // Integral of the root of r² − s².
    let under = |r: f64, s: f64| {
        let s = s.clamp(-r, r);
        0.5 * (s * (r * r - s * s).max(0.0).sqrt() + r * r * (s / r).asin())
    };
    for middle in [-0.9, -0.6, 0.0, 0.6, 0.9] {
        let ball = sphere(&Frame::along(DVec3::Y * middle, DVec3::new(0.3, 0.5, 0.2)).unwrap(), 1.0).unwrap();
        for step in -20..=20 {
            let inside = 8e-6 * 10_f64.powf(0.1 * f64::from(step));
            let h = (1.0 - (1.0 - inside).powi(2)).sqrt();
            let sheet = plane(DVec3::Z * h, 2.0 * DVec3::X, height * (DVec3::Y + DVec3::Z)).unwrap();
            let regions = seen(&[ball.clone(), sheet], &along([0.0, 0.0, 1.0]));
            // In the sphere is what has x² + (y − m)² + (y + h)² < 1, which is x² + 2 (y − n)² < r².
            let (n, root) = (0.5 * (middle - h), 2_f64.sqrt());
            let r = (1.0 - middle * middle - h * h + 2.0 * n * n).sqrt();
            let hidden = (under(r, root * (height - n)) - under(r, -root * n)) / root;
            let before = under(1.0, height - middle) - under(1.0, -middle);
            let areas: Vec<f64> = regions.regions.iter().map(VisibleRegion::area).collect();
            let expected = [PI - (before - hidden), 2.0 * height - hidden];
            assert_eq!(areas.len(), 2, "{middle}, {inside}");
            for (got, expected) in areas.iter().zip(expected) {
                assert!((got - expected).abs() <= 1e-3, "{middle}, {inside}: {got} is not {expected}");
            }
        }
    }
}

#[test]
fn visible_areas_do_not_depend_on_the_description() {
    let ball = sphere(&Frame::at(DVec3::new(2.6, 0.4, 0.3)).unwrap(), 1.3).unwrap();
    let ring = torus(&Frame::WORLD, 3.0, 1.0).unwrap();
    let sheet = plane(DVec3::new(-4.0, -3.5, -1.7), 8.5 * DVec3::X, DVec3::new(0.3, 7.0, 0.2)).unwrap();
    let eye = DVec3::new(0.4, -0.6, 0.7);
    let areas = |surfaces: &[Surface], up: DVec3| {
        let regions = seen(surfaces, &Camera::orthographic(eye, up).unwrap()).regions;
        regions.iter().map(VisibleRegion::area).collect::<Vec<f64>>()
    };
    let expected = areas(&[ring.clone(), ball.clone(), sheet.clone()], DVec3::Z);
    assert_eq!(expected.len(), 3);
    let [u0, u1] = ring.domain_u();
    let elevated = ring.elevated(3, 4).unwrap();
    let others = [
        vec![ring.reversed_u(), ball.reversed_v(), sheet.reversed_u()],
        vec![elevated, ball.transposed(), sheet.elevated(2, 1).unwrap()],
        vec![ring.insert_knot_u(u0 + 0.3 * (u1 - u0), 1).unwrap(), ball.insert_knot_v(0.37, 2).unwrap(), sheet.clone()],
    ];
    for other in others {
        for (got, expected) in areas(&other, DVec3::Z).into_iter().zip(&expected) {
            near(got, *expected);
        }
    }
    for turn in [0.1 * TAU, 0.4 * TAU] {
        let up = DVec3::Z * turn.cos() + eye.normalize().cross(DVec3::Z) * turn.sin();
        for (got, expected) in areas(&[ring.clone(), ball.clone(), sheet.clone()], up).into_iter().zip(&expected) {
            near(got, *expected);
        }
    }
}
