//! Sight lines against shapes whose sheets can be counted by hand, by closed form or by dense triangulation.

use alloc::vec;
use alloc::vec::Vec;
use core::f64::consts::SQRT_2;

use glam::{DMat4, DVec2, DVec3, DVec4};
use proptest::prelude::*;

use super::{Exclusion, Occluders, RayAnswer, RayScratch, Unclear};
use crate::nurbs::Surface;
use crate::shape::{self, Frame};
use crate::stop::Stop;
use crate::trim::Trims;
use crate::view::{Camera, Patch};

/// A patch of surface `surface` on u × v from homogeneous model points, seen through `view`.
fn patch(surface: usize, degrees: [usize; 2], u: [f64; 2], v: [f64; 2], points: Vec<DVec4>, view: DMat4) -> Patch {
    let points = points.into_iter().map(|h| view * h).collect();
    Patch { surface, degree_u: degrees[0], degree_v: degrees[1], points, u, v }
}

/// The surface of revolution about z of rational quadratic arcs (r, z, weight), four quarter turns each; u runs along the
/// profile, v round the axis, one unit a piece.
fn revolved(surface: usize, arcs: &[[[f64; 3]; 3]], view: DMat4) -> Vec<Patch> {
    let ring = [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [-1.0, 1.0], [-1.0, 0.0], [-1.0, -1.0], [0.0, -1.0], [1.0, -1.0]];
    let mut out = Vec::new();
    for (i, arc) in arcs.iter().enumerate() {
        for k in 0..4 {
            let mut points = Vec::new();
            for [r, z, w] in arc {
                for m in 0..3 {
                    let [x, y] = ring[(2 * k + m) % 8];
                    let weight = if m == 1 { w / SQRT_2 } else { *w };
                    points.push(DVec4::new(r * x, r * y, *z, 1.0) * weight);
                }
            }
            let (u, v) = (i as f64, k as f64);
            out.push(patch(surface, [2, 2], [u, u + 1.0], [v, v + 1.0], points, view));
        }
    }
    out
}

fn sphere(surface: usize, view: DMat4) -> Vec<Patch> {
    let w = 1.0 / SQRT_2;
    revolved(
        surface,
        &[[[0.0, -1.0, 1.0], [1.0, -1.0, w], [1.0, 0.0, 1.0]], [[1.0, 0.0, 1.0], [1.0, 1.0, w], [0.0, 1.0, 1.0]]],
        view,
    )
}

fn torus(surface: usize, major: f64, minor: f64, view: DMat4) -> Vec<Patch> {
    let ring = [[1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [-1.0, 1.0], [-1.0, 0.0], [-1.0, -1.0], [0.0, -1.0], [1.0, -1.0]];
    let arcs: Vec<[[f64; 3]; 3]> = (0..4)
        .map(|k| {
            [0, 1, 2].map(|m| {
                let [x, z] = ring[(2 * k + m) % 8];
                [major + minor * x, minor * z, if m == 1 { 1.0 / SQRT_2 } else { 1.0 }]
            })
        })
        .collect();
    revolved(surface, &arcs, view)
}

/// An n × n grid of bilinear patches z = height(x, y) on [−1, 1]².
fn grid(surface: usize, n: usize, height: impl Fn(f64, f64) -> f64, view: DMat4) -> Vec<Patch> {
    let at = |k: usize| 2.0 * k as f64 / n as f64 - 1.0;
    let mut out = Vec::new();
    for i in 0..n {
        for j in 0..n {
            let points = [(i, j), (i, j + 1), (i + 1, j), (i + 1, j + 1)]
                .into_iter()
                .map(|(i, j)| DVec4::new(at(i), at(j), height(at(i), at(j)), 1.0))
                .collect();
            out.push(patch(surface, [1, 1], [at(i), at(i + 1)], [at(j), at(j + 1)], points, view));
        }
    }
    out
}

fn turned(x: f64, y: f64, z: f64) -> DMat4 {
    DMat4::from_rotation_x(x) * DMat4::from_rotation_y(y) * DMat4::from_rotation_z(z)
}

fn ask(patches: &[Patch], p: DVec3, exclude: &[Exclusion]) -> RayAnswer {
    Occluders::new(patches, Stop::NEVER).query(p, exclude, &mut RayScratch::new())
}

fn clear(qi: u32) -> RayAnswer {
    RayAnswer { qi, clear: true, reason: None, contact: false }
}

#[test]
fn nothing_hides_nothing() {
    let o = Occluders::new(&[], Stop::NEVER);
    assert_eq!(o.size(), 0.0);
    assert_eq!(o.query(DVec3::ZERO, &[], &mut RayScratch::new()), clear(0));
}

#[test]
fn a_plane_behind_a_plane() {
    let mut all = grid(0, 1, |_, _| 1.0, DMat4::IDENTITY);
    all.extend(grid(1, 1, |_, _| 2.0, DMat4::IDENTITY));
    for (z, qi) in [(0.0, 2), (1.5, 1), (3.0, 0)] {
        assert_eq!(ask(&all, DVec3::new(0.3, -0.2, z), &[]), clear(qi));
    }
    assert_eq!(ask(&all, DVec3::new(1.3, -0.2, 0.0), &[]), clear(0));
    let on_the_lower = ask(&all, DVec3::new(0.3, -0.2, 1.0), &[]);
    assert_eq!(on_the_lower, RayAnswer { qi: 1, clear: false, reason: Some(Unclear::Contact), contact: true });
    let own = Exclusion { surface: 0, uv: DVec2::new(0.3, -0.2), radius: DVec2::splat(1e-6) };
    assert_eq!(ask(&all, DVec3::new(0.3, -0.2, 1.0), &[own]), clear(1));
}

#[test]
fn borders_and_corners_of_patches_count_one_sheet() {
    for view in [DMat4::IDENTITY, turned(0.4, 0.3, 0.2), turned(0.0, 3.0, 0.7)] {
        for height in [|_, _| 0.0, |x: f64, y: f64| 0.3 * x * y] {
            let o = Occluders::new(&grid(0, 4, height, view), Stop::NEVER);
            let mut scratch = RayScratch::new();
            for i in -7..=7 {
                for j in -7..=7 {
                    let (x, y) = (f64::from(i) / 8.0, f64::from(j) / 8.0);
                    // The patches interpolate the height at their corners and are bilinear as it is.
                    let p = (view * DVec4::new(x, y, height(x, y), 1.0)).truncate();
                    assert_eq!(o.query(p - DVec3::Z, &[], &mut scratch), clear(1), "{x} {y}");
                    assert_eq!(o.query(p + DVec3::Z, &[], &mut scratch), clear(0), "{x} {y}");
                }
            }
        }
    }
}

#[test]
fn an_open_border_and_a_crease_are_not_clear() {
    let flat = grid(0, 2, |_, _| 0.0, DMat4::IDENTITY);
    for p in [DVec3::new(1.0, 0.3, -1.0), DVec3::new(1.0, 1.0, -1.0), DVec3::new(-0.3, -1.0, -1.0)] {
        let answer = ask(&flat, p, &[]);
        assert_eq!((answer.qi, answer.clear, answer.reason), (0, false, Some(Unclear::Border)));
    }
    // Two planes that meet in x = 0 and both hang down to the right of it, then to both sides.
    let hang = |slope: f64, to: f64| {
        let corner = |x: f64, y: f64| DVec4::new(x, y, slope * x.abs(), 1.0);
        let points = [corner(0.0, -1.0), corner(0.0, 1.0), corner(to, -1.0), corner(to, 1.0)];
        patch(0, [1, 1], [0.0, 1.0], [0.0, 1.0], points.to_vec(), DMat4::IDENTITY)
    };
    let p = DVec3::new(0.0, 0.25, -5.0);
    assert_eq!(ask(&[hang(-1.0, 1.0), hang(-2.0, 1.0)], p, &[]).reason, Some(Unclear::Border));
    assert_eq!(ask(&[hang(-1.0, 1.0), hang(-2.0, -1.0)], p, &[]), clear(1));
}

#[test]
fn a_sphere_from_every_side() {
    let mut scratch = RayScratch::new();
    for view in [DMat4::IDENTITY, turned(1.1, 0.2, 0.0), turned(core::f64::consts::FRAC_PI_2, 0.0, 0.3)] {
        let o = Occluders::new(&sphere(0, view), Stop::NEVER);
        for i in -12..=12 {
            for j in -12..=12 {
                let q = DVec2::new(f64::from(i), f64::from(j)) / 8.0;
                let r = q.length();
                if (r - 1.0).abs() < 1e-6 {
                    continue;
                }
                let inside = u32::from(r < 1.0);
                assert_eq!(o.query(q.extend(-2.0), &[], &mut scratch), clear(2 * inside), "{q}");
                assert_eq!(o.query(q.extend(0.0), &[], &mut scratch), clear(inside), "{q}");
                assert_eq!(o.query(q.extend(2.0), &[], &mut scratch), clear(0), "{q}");
            }
        }
    }
}

#[test]
fn close_to_the_outline_of_a_sphere() {
    let mut scratch = RayScratch::new();
    for view in [DMat4::IDENTITY, turned(1.1, 0.2, 0.0), turned(core::f64::consts::FRAC_PI_2, 0.0, 0.3)] {
        let o = Occluders::new(&sphere(0, view), Stop::NEVER);
        for k in 0..40 {
            let a = 0.16 * f64::from(k);
            let d = DVec2::new(libm::cos(a), libm::sin(a));
            for off in [1e-2, 1e-4, 1e-6, 1e-8] {
                assert_eq!(o.query((d * (1.0 - off)).extend(-2.0), &[], &mut scratch), clear(2), "{a} {off}");
                assert_eq!(o.query((d * (1.0 + off)).extend(-2.0), &[], &mut scratch), clear(0), "{a} {off}");
            }
            for off in [1e-10, 1e-12, 0.0] {
                let answer = o.query((d * (1.0 - off)).extend(-2.0), &[], &mut scratch);
                assert!(!answer.clear && answer.qi <= 2, "{a} {off}");
            }
        }
    }
    assert!(scratch.stats.halvings < 600 * scratch.stats.rays, "{:?}", scratch.stats);
}

#[test]
fn close_to_the_pole_of_a_sphere() {
    let mut scratch = RayScratch::new();
    for view in [DMat4::IDENTITY, turned(0.7, 0.2, 0.0), turned(1.5, 0.0, 0.3)] {
        let o = Occluders::new(&sphere(0, view), Stop::NEVER);
        let pole = (view * DVec4::new(0.0, 0.0, 1.0, 1.0)).truncate();
        for k in 0..30 {
            for off in [0.0, 1e-16, 1e-12, 1e-10, 3e-10, 1e-9, 2e-9, 5e-9, 1e-8, 1e-6, 1e-3] {
                let a = 0.21 * f64::from(k);
                let q = pole.truncate() + off * DVec2::new(libm::cos(a), libm::sin(a));
                assert_eq!(o.query(q.extend(-2.0), &[], &mut scratch), clear(2), "{a} {off}");
            }
        }
    }
    assert!(scratch.stats.halvings < 300 * scratch.stats.rays, "{:?}", scratch.stats);
}

#[test]
fn two_nested_spheres() {
    let mut all = sphere(0, turned(0.3, 0.1, 0.0));
    all.extend(sphere(1, DMat4::from_scale(DVec3::splat(0.5)) * turned(1.0, 0.5, 0.0)));
    let o = Occluders::new(&all, Stop::NEVER);
    let mut scratch = RayScratch::new();
    let q = DVec2::new(0.1, 0.2);
    let heights: Vec<f64> = o.hits(q, &mut scratch).iter().map(|h| h.z).collect();
    let [big, small] = [1.0, 0.25].map(|r: f64| libm::sqrt(r - q.length_squared()));
    for (z, expected) in heights.iter().zip([big, small, -small, -big]) {
        assert!((z - expected).abs() < 1e-14);
    }
    for (z, qi) in [(2.0, 0), (0.7, 1), (0.0, 2), (-0.7, 3), (-2.0, 4)] {
        assert_eq!(o.query(q.extend(z), &[], &mut scratch), clear(qi));
    }
}

/// Roots of the quartic along the sight line, by sampling the implicit function: the torus is smooth and the sample
/// much finer than the distances asked for.
fn torus_sheets(inverse: DMat4, major: f64, minor: f64, p: DVec3) -> u32 {
    let value = |z: f64| {
        let x = (inverse * DVec4::new(p.x, p.y, z, 1.0)).truncate();
        let ring = libm::sqrt(x.x * x.x + x.y * x.y) - major;
        ring * ring + x.z * x.z - minor * minor
    };
    let top = major + 2.0 * minor;
    let n = 4000;
    let at = |k: usize| p.z + (top - p.z) * k as f64 / n as f64;
    (0..n).filter(|&k| (value(at(k)) < 0.0) != (value(at(k + 1)) < 0.0)).count() as u32
}

#[test]
fn points_on_a_surface_and_on_its_silhouette() {
    let view = turned(0.9, 0.4, 0.0);
    let o = Occluders::new(&sphere(0, view), Stop::NEVER);
    let mut scratch = RayScratch::new();
    for patch in sphere(0, view) {
        for i in 0..=8 {
            for j in 0..=8 {
                let (s, t) = (f64::from(i) / 8.0, f64::from(j) / 8.0);
                let jet = patch.jet(s, t);
                let n = jet.normal();
                if (i == 0 || i == 8) && n.length() < 1e-9 || jet.p.z.abs() < 1e-3 {
                    continue;
                }
                let uv = patch.to_surface(s, t);
                let radius = DVec2::splat(1e-4);
                // Round the axis v = 0 is v = 4.
                let twin = DVec2::new(
                    uv.x,
                    if uv.y == 0.0 {
                        4.0
                    } else if uv.y == 4.0 {
                        0.0
                    } else {
                        uv.y
                    },
                );
                let own = [Exclusion { surface: 0, uv, radius }, Exclusion { surface: 0, uv: twin, radius }];
                let answer = o.query(jet.p, &own, &mut scratch);
                assert_eq!(answer, clear(u32::from(jet.p.z < 0.0)), "{uv} {}", jet.p);
            }
        }
        // Every isoline u = const crosses the silhouette z = 0 once: bisect for it.
        for i in 0..16 {
            let s = (f64::from(i) + 0.5) / 16.0;
            let height = |t: f64| patch.eval(s, t).z;
            let (mut a, mut b) = (0.0, 1.0);
            if (height(a) < 0.0) == (height(b) < 0.0) {
                continue;
            }
            for _ in 0..60 {
                let m = 0.5 * (a + b);
                if (height(a) < 0.0) == (height(m) < 0.0) { a = m } else { b = m }
            }
            let own = Exclusion { surface: 0, uv: patch.to_surface(s, a), radius: DVec2::splat(1e-3) };
            let before = scratch.stats.halvings;
            assert_eq!(o.query(patch.eval(s, a), &[own], &mut scratch), clear(0), "{s} {a}");
            assert!(scratch.stats.halvings - before < 200);
        }
    }
}

#[test]
fn a_patch_seen_along_itself_occludes_nothing() {
    let upright = grid(0, 1, |_, _| 0.0, turned(core::f64::consts::FRAC_PI_2, 0.0, 0.3));
    let o = Occluders::new(&upright, Stop::NEVER);
    assert_eq!(o.left_out(), 1);
    assert_eq!(o.query(DVec3::new(0.1, 0.0, -3.0), &[], &mut RayScratch::new()), clear(0));
}

/// The surfaces as patches seen through `view`, numbered in order.
fn seen(surfaces: &[Surface], view: DMat4) -> Vec<Patch> {
    surfaces.iter().enumerate().flat_map(|(k, s)| s.transformed(view).unwrap().bezier_patches(k)).collect()
}

fn upright() -> Frame {
    Frame::at(DVec3::ZERO).unwrap()
}

#[test]
fn a_closed_can_seen_along_its_axis() {
    let can = [
        shape::cylinder(&upright(), 1.0, 2.0).unwrap(),
        shape::disk(&upright(), 1.0).unwrap(),
        shape::disk(&Frame::at(DVec3::new(0.0, 0.0, 2.0)).unwrap(), 1.0).unwrap(),
    ];
    let o = Occluders::new(&seen(&can, DMat4::IDENTITY), Stop::NEVER);
    assert!(o.left_out() >= 3, "the wall has no area");
    let mut scratch = RayScratch::new();
    for (x, y, qi) in [(0.0, 0.0, 2), (0.5, 0.0, 2), (0.0, -0.5, 2), (0.3, 0.4, 2), (1.1, 0.0, 0), (0.8, 0.8, 0)] {
        assert_eq!(o.query(DVec3::new(x, y, -1.0), &[], &mut scratch), clear(qi));
        assert_eq!(o.query(DVec3::new(x, y, 1.0), &[], &mut scratch), clear(qi / 2));
    }
    // From the side its ends have no area, and the middle line of sight runs along a seam.
    let o = Occluders::new(&seen(&can, turned(core::f64::consts::FRAC_PI_2, 0.0, 0.0)), Stop::NEVER);
    for x in [0.0, 0.25, -0.5, 0.999, 1.001] {
        let qi = 2 * u32::from(f64::abs(x) < 1.0);
        assert_eq!(o.query(DVec3::new(x, -1.0, -3.0), &[], &mut scratch), clear(qi), "{x}");
    }
}

#[test]
fn the_apex_of_a_cone() {
    let cone = [shape::cone(&upright(), 1.0, 0.0, 2.0).unwrap()];
    let mut scratch = RayScratch::new();
    for (a, b) in [(0.0, 0.0), (0.2, 0.1), (3.0, 0.0)] {
        let view = turned(a, b, 0.4);
        let o = Occluders::new(&seen(&cone, view), Stop::NEVER);
        let apex = (view * DVec4::new(0.0, 0.0, 2.0, 1.0)).truncate();
        assert_eq!(o.query(apex - DVec3::Z, &[], &mut scratch), clear(1), "{a} {b}");
        assert_eq!(o.query(apex + DVec3::Z, &[], &mut scratch), clear(0), "{a} {b}");
        // Wherever on the circle the apex is named, it is excluded all round.
        let tip = Exclusion { surface: 0, uv: DVec2::new(0.3, 1.0), radius: DVec2::splat(1e-3) };
        assert_eq!(o.query(apex, &[tip], &mut scratch), clear(0), "{a} {b}");
        assert!(o.query(apex, &[], &mut scratch).contact, "{a} {b}");
    }
    // Across the axis the cone ends at the tip: it is met on one side of it only.
    let o = Occluders::new(&seen(&cone, turned(core::f64::consts::FRAC_PI_2, 0.0, 0.4)), Stop::NEVER);
    assert!(!o.query(DVec3::new(0.0, -2.0, -5.0), &[], &mut scratch).clear);
    assert_eq!(o.query(DVec3::new(0.0, -1.999, -5.0), &[], &mut scratch), clear(2));
}

#[test]
fn perspective_and_elevated_degrees_change_no_count() {
    let sphere = shape::sphere(&upright(), 1.0).unwrap();
    let elevated = sphere.elevated(4, 3).unwrap();
    let eye = DVec3::new(2.0, -3.0, 1.0);
    let camera = Camera::perspective(eye, DVec3::new(0.1, 0.0, 0.2), DVec3::Z).unwrap();
    let [a, b] = [sphere, elevated].map(|s| Occluders::new(&seen(&[s], camera.matrix()), Stop::NEVER));
    let mut scratch = RayScratch::new();
    for k in 0..400 {
        let x = DVec3::new(f64::from(k % 7) - 3.0, f64::from(k / 7 % 7) - 3.0, f64::from(k / 49) - 4.0) * 0.55;
        // Sheets between the eye and x: the roots of |eye + t·(x − eye)| = 1 in t < 1.
        let d = x - eye;
        let (half, c) = (eye.dot(d), eye.length_squared() - 1.0);
        let disc = half * half - d.length_squared() * c;
        let root = libm::sqrt(disc.max(0.0));
        let near = |sign: f64| disc > 0.0 && (-half + sign * root) / d.length_squared() < 1.0;
        let expected = u32::from(near(-1.0)) + u32::from(near(1.0));
        let Some(p) = camera.project(x) else { continue };
        assert!(disc.abs() > 1e-9 && (x.length() - 1.0).abs() > 1e-9, "choose another point");
        assert_eq!(a.query(p, &[], &mut scratch), clear(expected), "{x}");
        assert_eq!(b.query(p, &[], &mut scratch), clear(expected), "{x}");
    }
}

/// The patch with both parameters reversed, with u and v exchanged, and cut at the middle of u.
fn rewritten(patch: &Patch) -> [Vec<Patch>; 3] {
    let (p, q) = (patch.degree_u, patch.degree_v);
    let at = |i: usize, j: usize| patch.points[i * (q + 1) + j];
    let build = |p: usize, q: usize, f: &dyn Fn(usize, usize) -> DVec4| {
        (0..=p).flat_map(|i| (0..=q).map(move |j| (i, j))).map(|(i, j)| f(i, j)).collect::<Vec<_>>()
    };
    let reversed = Patch { points: build(p, q, &|i, j| at(p - i, q - j)), ..patch.clone() };
    let (degree_u, degree_v) = (q, p);
    let exchanged = Patch { points: build(q, p, &|i, j| at(j, i)), degree_u, degree_v, ..patch.clone() };
    let (mut lower, mut upper) = (patch.clone(), patch.clone());
    super::leaf::halve(&mut lower.points, &mut upper.points, super::leaf::Degrees { p, q }, super::leaf::Axis::U);
    let middle = 0.5 * (patch.u[0] + patch.u[1]);
    lower.u[1] = middle;
    upper.u[0] = middle;
    [alloc::vec![reversed], alloc::vec![exchanged], alloc::vec![lower, upper]]
}

/// Number of triangles of an n × n tessellation above p, and whether p is clear of every edge whose triangles turn
/// differently or that is open: the count is that of the surface only there.
fn triangles_above(patch: &Patch, p: DVec3, n: usize) -> Option<u32> {
    let at = |i: usize, j: usize| patch.eval(i as f64 / n as f64, j as f64 / n as f64);
    let mut count = 0;
    for i in 0..n {
        for j in 0..n {
            let c = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            for t in [[c[0], c[1], c[2]], [c[0], c[2], c[3]]] {
                let side = |a: DVec3, b: DVec3| (b - a).truncate().perp_dot((p - a).truncate());
                let e = [side(t[1], t[2]), side(t[2], t[0]), side(t[0], t[1])];
                let area = e[0] + e[1] + e[2];
                let longest = (t[1] - t[0]).length().max((t[2] - t[0]).length());
                let low = e[0].min(e[1]).min(e[2]);
                let high = e[0].max(e[1]).max(e[2]);
                let near = (p - t[0]).truncate().length() < 3.0 * longest;
                if near && (area.abs() < 0.05 * longest * longest) {
                    return None;
                }
                if low >= 0.0 || high <= 0.0 {
                    let z = (e[0] * t[0].z + e[1] * t[1].z + e[2] * t[2].z) / area;
                    if (z - p.z).abs() < 0.05 {
                        return None;
                    }
                    count += u32::from(z > p.z);
                }
            }
        }
    }
    let border = (0..=n).any(|k| {
        [at(k, 0), at(k, n), at(0, k), at(n, k)].into_iter().any(|x| (x - p).truncate().length() < 2.0 / n as f64)
    });
    (!border).then_some(count)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn a_torus_agrees_with_its_quartic(a in 0.0..6.3, b in 0.0..6.3, x in -1.5..1.5, y in -1.5..1.5, z in -1.5..1.5) {
        let view = turned(a, b, 0.0);
        let p = DVec3::new(x, y, z);
        let (major, minor) = (1.0, 0.4);
        let o = Occluders::new(&torus(0, major, minor, view), Stop::NEVER);
        let answer = o.query(p, &[], &mut RayScratch::new());
        prop_assert!(answer.clear);
        prop_assert_eq!(answer.qi, torus_sheets(view.inverse(), major, minor, p));
    }

    #[test]
    fn random_rational_patches_agree_with_a_triangulation(
        z in proptest::collection::vec((-1.0..1.0, -0.6..0.6, -0.6..0.6, 0.5..2.0), 16),
        points in proptest::collection::vec((-1.0..4.0, -1.0..4.0, -1.0..1.0), 24),
    ) {
        let points_of = z.iter().enumerate().map(|(k, &(z, dx, dy, w))| {
            let (i, j) = (k / 4, k % 4);
            DVec4::new(i as f64 + 2.0 * dx, j as f64 + 2.0 * dy, z, 1.0) * w
        });
        let patch = patch(0, [3, 3], [0.0, 1.0], [0.0, 1.0], points_of.collect(), DMat4::IDENTITY);
        let o = Occluders::new(core::slice::from_ref(&patch), Stop::NEVER);
        let others = rewritten(&patch).map(|p| Occluders::new(&p, Stop::NEVER));
        let mut scratch = RayScratch::new();
        for (x, y, z) in points {
            let p = DVec3::new(x, y, z);
            let answer = o.query(p, &[], &mut scratch);
            for other in &others {
                prop_assert_eq!(other.query(p, &[], &mut scratch), answer);
            }
            if let Some(expected) = triangles_above(&patch, p, 64) {
                prop_assert_eq!(answer, clear(expected), "{}", p);
            }
        }
    }

    /// Sight lines planted on dyadic parameters of a wavy surface: borders, corners and inner borders of cells.
    #[test]
    fn planted_parameters_count_like_their_neighbourhood(
        heights in proptest::collection::vec(-1.0..1.0, 25),
        i in 1usize..32, j in 1usize..32, a in -0.5..0.5, b in -0.5..0.5,
    ) {
        let view = turned(a, b, 0.0);
        let index = |x: f64| libm::round(2.0 * x + 2.0) as usize;
        let all = grid(0, 4, |x, y| 0.3 * heights[index(x) * 5 + index(y)], view);
        let o = Occluders::new(&all, Stop::NEVER);
        let mut scratch = RayScratch::new();
        let at = |k: usize| (k / 8, (k % 8) as f64 / 8.0);
        let ((pi, s), (pj, t)) = (at(i), at(j));
        let q = all[pi * 4 + pj].eval(s, t).truncate();
        let answer = o.query(q.extend(-9.0), &[], &mut scratch);
        let around: Vec<RayAnswer> = (0..8).map(|k| {
            let d = DVec2::new(libm::cos(0.7 + 0.785 * f64::from(k)), libm::sin(0.7 + 0.785 * f64::from(k)));
            o.query((q + 1e-6 * d).extend(-9.0), &[], &mut scratch)
        }).collect();
        // One of them may come within the width of a border, of the four that may meet here.
        let counts: Vec<u32> = around.iter().filter(|a| a.clear).map(|a| a.qi).collect();
        prop_assert!(counts.len() >= 4, "{:?}", around);
        if answer.clear {
            prop_assert!(counts.iter().all(|&n| n == answer.qi), "{:?} {:?}", answer, around);
        } else {
            // Only where the surface turns back under the sight line.
            prop_assert!(counts.iter().any(|&n| n != counts[0]), "{:?} {:?}", answer, around);
        }
    }
}

/// A disc of radius ½ in the middle of the square [−1, 1]² and what is left of the square, the one in 16 patches and
/// the other in one: surfaces 0 and 1.
fn disc_and_rest() -> (Vec<Patch>, [Trims; 2]) {
    let square = shape::plane(DVec3::new(-1.0, -1.0, 0.0), DVec3::X * 2.0, DVec3::Y * 2.0).unwrap();
    let there = DMat4::from_translation(DVec3::new(0.5, 0.5, 0.0));
    let round = vec![shape::circle(&Frame::WORLD, 0.25).unwrap().transformed(there).unwrap()];
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
    let outline = vec![shape::polyline(&corners.map(|c| DVec3::new(c[0], c[1], 0.0))).unwrap()];
    let mut fine = square.clone();
    for k in [0.25, 0.5, 0.75] {
        fine = fine.insert_knot_u(k, 1).unwrap().insert_knot_v(k, 1).unwrap();
    }
    let mut patches = fine.bezier_patches(0);
    patches.extend(square.bezier_patches(1));
    let disc = Trims::new(&fine, core::slice::from_ref(&round)).unwrap();
    (patches, [disc, Trims::new(&square, &[outline, round]).unwrap()])
}

#[test]
fn a_trimmed_sheet_counts_where_it_is_kept() {
    let (patches, trims) = disc_and_rest();
    for kept in [0, 1] {
        let only = |surface: usize| Some(&trims[kept]).filter(|_| surface == kept);
        let own: Vec<Patch> = patches.iter().filter(|p| p.surface == kept).cloned().collect();
        let o = Occluders::trimmed(&own, &only, usize::MAX, Stop::NEVER);
        let mut scratch = RayScratch::new();
        for k in 0..200 {
            let angle = 0.7 + 0.4 * f64::from(k);
            let d = DVec2::new(libm::cos(angle), libm::sin(angle));
            for r in [0.01, 0.3, 0.49, 0.5 - 1e-7, 0.5 + 1e-7, 0.51, 0.9] {
                let at = (d * r).extend(-1.0);
                assert_eq!(o.query(at, &[], &mut scratch), clear(u32::from((r < 0.5) == (kept == 0))), "{r} {angle}");
            }
            // The border itself is an open one.
            let on = o.query((d * 0.5).extend(-1.0), &[], &mut scratch);
            assert_eq!((on.qi, on.clear), (0, false), "{angle}");
        }
    }
}

#[test]
fn what_fills_a_hole_counts_one_sheet_on_its_border_too() {
    let (patches, trims) = disc_and_rest();
    let o = Occluders::trimmed(&patches, &|s| Some(&trims[s]), usize::MAX, Stop::NEVER);
    let mut scratch = RayScratch::new();
    for k in 0..200 {
        let angle = 0.7 + 0.4 * f64::from(k);
        let d = DVec2::new(libm::cos(angle), libm::sin(angle));
        for r in [0.1, 0.5 - 1e-12, 0.5, 0.5 + 1e-12, 0.8] {
            assert_eq!(o.query((d * r).extend(-1.0), &[], &mut scratch), clear(1), "{r} {angle}");
        }
    }
}
