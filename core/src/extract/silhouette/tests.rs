use super::trace::distance_to_chord;
use super::*;
use crate::bernstein::Bivariate;
use crate::extract::facing::facing_of_all;
use crate::stop::Stop;
use crate::view::Camera;
use core::f64::consts::{PI, TAU};
use glam::{DVec3, DVec4};
use proptest::prelude::*;

const FINE: SilhouetteOptions = SilhouetteOptions { chord: 1e-4, normal_angle: 0.1 };

/// Quarter k of the unit circle as a rational quadratic: homogeneous (x, y, w).
fn quarter(k: usize) -> [DVec3; 3] {
    let h = core::f64::consts::FRAC_1_SQRT_2;
    let turn = |x: f64, y: f64, w: f64| match k % 4 {
        0 => DVec3::new(x, y, w),
        1 => DVec3::new(-y, x, w),
        2 => DVec3::new(-x, -y, w),
        _ => DVec3::new(y, -x, w),
    };
    [turn(1.0, 0.0, 1.0), turn(h, h, h), turn(0.0, 1.0, 1.0)]
}

/// Patches of the surface of revolution about z of circle quarters (`major` + `minor` cos φ, `minor` sin φ).
fn revolved(major: f64, minor: f64, quarters: &[usize], camera: &Camera) -> Vec<Patch> {
    let mut patches = Vec::new();
    for &k in quarters {
        for turn in 0..4 {
            let mut points = Vec::new();
            for s in quarter(turn) {
                for c in quarter(k) {
                    let (r, z, w) = (major * c.z + minor * c.x, minor * c.y, c.z);
                    points.push(camera.matrix() * DVec4::new(r * s.x, r * s.y, z * s.z, w * s.z));
                }
            }
            patches.push(Patch { surface: 0, degree_u: 2, degree_v: 2, points, u: [0.0, 1.0], v: [0.0, 1.0] });
        }
    }
    patches
}

fn sphere(camera: &Camera) -> Vec<Patch> {
    revolved(0.0, 1.0, &[3, 0], camera)
}

fn torus(camera: &Camera) -> Vec<Patch> {
    revolved(2.0, 0.5, &[0, 1, 2, 3], camera)
}

fn traced(patches: &[Patch], options: SilhouetteOptions) -> (Vec<FacingForm>, Silhouettes) {
    let (forms, _) = facing_of_all(patches, Stop::NEVER);
    let found = silhouettes(patches, &forms, options, Stop::NEVER);
    (forms, found)
}

/// View-space points along a curve, `per` to a segment.
fn sampled(curve: &TracedCurve, patches: &[Patch], forms: &[FacingForm], per: usize) -> Vec<DVec3> {
    let n = curve.segment_count() * per;
    (0..=n)
        .map(|k| {
            let p = curve.local_at(&forms[curve.patch], k as f64 / per as f64);
            patches[curve.patch].eval(p.x, p.y)
        })
        .collect()
}

fn polar_extent(points: &[DVec3]) -> f64 {
    points
        .windows(2)
        .map(|w| libm::atan2(w[0].x * w[1].y - w[0].y * w[1].x, w[0].x * w[1].x + w[0].y * w[1].y).abs())
        .sum()
}

fn views() -> Vec<DVec3> {
    [(1.0, -2.0, 1.5), (-0.3, 0.2, 1.0), (0.7, 0.1, -0.4), (1.0, 1.0, 1.0), (0.0, -1.0, 1.0), (0.3, 0.9, 0.01)]
        .map(|(x, y, z)| DVec3::new(x, y, z))
        .to_vec()
}

#[test]
fn a_sphere_seen_from_infinity_shows_its_great_circle() {
    for d in views() {
        let camera = Camera::orthographic(d, DVec3::new(0.1, 0.2, 1.3)).unwrap();
        let patches = sphere(&camera);
        let (forms, found) = traced(&patches, FINE);
        let mut angle = 0.0;
        for curve in &found.curves {
            let points = sampled(curve, &patches, &forms, 4);
            for p in &points {
                assert!(p.z.abs() < 1e-12 && (p.truncate().length() - 1.0).abs() < 1e-12, "{d}: {p}");
            }
            angle += polar_extent(&points);
        }
        // What is missing from the whole circle lies on patch edges (seen along a symmetry plane).
        let on_edges = found.edges.iter().filter(|e| !e.collapsed).count() as f64 * PI / 4.0;
        assert!((angle + on_edges - TAU).abs() < 1e-9, "{d}: {angle} + {on_edges}");
        assert!(found.undecided.is_empty());
        assert_eq!(found.stats.cusps, 0);
    }
}

#[test]
fn a_sphere_seen_along_its_axis_has_its_equator_on_patch_edges() {
    let camera = Camera::orthographic(DVec3::Z, DVec3::Y).unwrap();
    let patches = sphere(&camera);
    let (forms, found) = traced(&patches, FINE);
    assert!(found.curves.is_empty() && found.undecided.is_empty());
    let equator: Vec<_> = found.edges.iter().filter(|e| !e.collapsed).collect();
    assert_eq!(equator.len(), 8);
    assert!(equator.iter().all(|e| e.multiplicity % 2 == 1));
    let count = |f| forms.iter().filter(|x| x.facing == f).count();
    assert_eq!((count(Facing::Front), count(Facing::Back)), (4, 4));
}

#[test]
fn a_sphere_in_perspective_shows_the_polar_circle_of_the_eye() {
    for d in views() {
        let eye = d.normalize() * 3.0;
        let camera = Camera::perspective(eye, DVec3::ZERO, DVec3::new(0.1, 0.2, 1.3)).unwrap();
        let patches = sphere(&camera);
        let (forms, found) = traced(&patches, FINE);
        // In the camera's frame the polar circle lies at depth 1/f with radius √(1 − 1/f²), f = 3.
        let (depth, radius) = (1.0 / 3.0, libm::sqrt(8.0 / 9.0));
        let scale = 1.0 / (1.0 - depth / 3.0);
        for curve in &found.curves {
            for p in sampled(curve, &patches, &forms, 3) {
                assert!((p.z - depth * scale).abs() < 1e-12, "{p}");
                assert!((p.truncate().length() - radius * scale).abs() < 1e-12, "{p}");
            }
        }
        let angle: f64 = found.curves.iter().map(|c| polar_extent(&sampled(c, &patches, &forms, 3))).sum();
        assert!((angle - TAU).abs() < 1e-9 && found.undecided.is_empty(), "{d} {angle}");
    }
}

#[test]
fn a_torus_from_a_general_view_has_its_normal_across_the_sight_line() {
    for d in views() {
        let camera = Camera::orthographic(d, DVec3::new(0.1, 0.2, 1.3)).unwrap();
        let patches = torus(&camera);
        let (forms, found) = traced(&patches, FINE);
        let back = camera.matrix().inverse();
        let mut length = 0.0;
        for curve in &found.curves {
            for p in sampled(curve, &patches, &forms, 3) {
                let m = back.transform_point3(p);
                let ring = DVec3::new(m.x, m.y, 0.0).normalize() * 2.0;
                let normal = (m - ring) / 0.5;
                assert!((normal.length() - 1.0).abs() < 1e-12);
                assert!(normal.dot(d.normalize()).abs() < 1e-11, "{d} {p} {}", normal.dot(d.normalize()));
            }
            length += curve.vertices.len() as f64;
        }
        assert!(length > 0.0 && found.undecided.is_empty(), "{d}");
    }
}

#[test]
fn a_torus_along_its_axis_has_both_equators_on_patch_edges() {
    let camera = Camera::orthographic(DVec3::Z, DVec3::Y).unwrap();
    let (_, found) = traced(&torus(&camera), FINE);
    assert!(found.curves.is_empty() && found.undecided.is_empty());
    assert_eq!(found.edges.len(), 16);
    assert!(found.edges.iter().all(|e| e.multiplicity == 1 && !e.collapsed && e.edge >= 2));
}

/// Every end of a curve is the end of exactly one other (on the neighbouring patch, or beyond a cusp), so that the
/// curves close up to loops over the whole surface.
fn ends_meet(patches: &[Patch], found: &Silhouettes, near: f64) {
    let end = |c: &TracedCurve, k: usize| patches[c.patch].eval(c.vertices[k].x, c.vertices[k].y);
    let open = found.curves.iter().filter(|c| !c.is_closed());
    let ends: Vec<DVec3> = open.flat_map(|c| [end(c, 0), end(c, c.segment_count())]).collect();
    for (k, a) in ends.iter().enumerate() {
        let partners = ends.iter().enumerate().filter(|&(l, b)| k != l && (*a - *b).length() < near).count();
        assert_eq!(partners, 1, "{a} in {ends:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn silhouettes_close_up_over_patches_from_any_view(
        x in -1.0..1.0_f64, y in -1.0..1.0_f64, z in -1.0..1.0_f64, far in 4.0..50.0_f64, perspective in any::<bool>(),
    ) {
        let d = DVec3::new(x, y, z);
        prop_assume!(d.length() > 0.1);
        let eye = d.normalize() * far;
        let camera = if perspective {
            Camera::perspective(eye, DVec3::ZERO, DVec3::new(0.1, 0.2, 1.3))
        } else {
            Camera::orthographic(eye, DVec3::new(0.1, 0.2, 1.3))
        };
        let Ok(camera) = camera else { return Ok(()) };
        for patches in [sphere(&camera), torus(&camera)] {
            let (_, found) = traced(&patches, FINE);
            prop_assert!(found.undecided.is_empty());
            ends_meet(&patches, &found, 1e-7);
        }
    }
}

#[test]
fn a_silhouette_that_passes_close_to_a_pole_has_no_undecided_cusps() {
    // Less than 5e-6 of a patch away from it.
    let d = DVec3::new(-0.8483259731132351, -0.2331085799323914, 0.04444750372087215);
    let eye = d.normalize() * 19.821290261496266;
    let camera = Camera::perspective(eye, DVec3::ZERO, DVec3::new(0.1, 0.2, 1.3)).unwrap();
    let patches = sphere(&camera);
    let (_, found) = traced(&patches, FINE);
    assert_eq!((found.undecided, found.stats.cusps), (Vec::new(), 0));
}

#[test]
fn a_torus_has_the_cusps_of_an_ellipses_parallel_curve() {
    // The outline of a torus is the pair of curves parallel, at the distance of the minor radius, to the ellipse of
    // its centre circle. The inner one has a cusp wherever it meets the ellipse's evolute: 4, or none.
    let (a, r) = (2.0, 0.5);
    for (elevation, count) in [(0.1, 4), (0.3, 4), (0.5, 4), (0.53, 0), (0.8, 0), (1.3, 0)] {
        let (sin, cos) = (libm::sin(elevation), libm::cos(elevation));
        // Turned so that no cusp lies on the edge between two patches.
        let d = DVec3::new(cos * libm::sin(0.4), -cos * libm::cos(0.4), sin);
        let camera = Camera::orthographic(d, DVec3::Z).unwrap();
        let patches = torus(&camera);
        let (_, found) = traced(&patches, FINE);
        assert_eq!(found.stats.cusps, count, "elevation {elevation}");
        ends_meet(&patches, &found, 1e-7);
        let b = a * sin;
        let s2 = (libm::pow(r * a * b, 2.0 / 3.0) - b * b) / (a * a - b * b);
        for curve in found.curves.iter().filter(|c| c.ends[1] == CurveEnd::Cusp) {
            let end = curve.vertices[curve.segment_count()];
            let p = patches[curve.patch].eval(end.x, end.y).abs();
            let want_x = (a * a - b * b) / a * libm::pow(1.0 - s2, 1.5);
            let want_y = (a * a - b * b) / b * libm::pow(s2, 1.5);
            assert!((p.x - want_x).abs() < 1e-9 && (p.y - want_y).abs() < 1e-9, "{p} {want_x} {want_y}");
        }
    }
}

#[test]
fn a_cone_has_straight_silhouettes_without_cusps_at_the_apex() {
    // Radius 2 at z = 0, apex at z = 1.5; N · d = 0 at cos θ + sin θ = −4/3 for d = (1, 1, 1).
    for (d, mixed) in [(DVec3::ONE, 1), (DVec3::new(1.0, -1.6, 0.75), 1), (DVec3::new(0.3, -1.0, 0.1), 2)] {
        let camera = Camera::orthographic(d, DVec3::Z).unwrap();
        let mut patches = Vec::new();
        for turn in 0..4 {
            let arc = quarter(turn);
            let points = arc
                .iter()
                .flat_map(|c| [DVec4::new(2.0 * c.x, 2.0 * c.y, 0.0, c.z), DVec4::new(0.0, 0.0, 1.5 * c.z, c.z)]);
            let points = points.map(|p| camera.matrix() * p).collect();
            patches.push(Patch { surface: 0, degree_u: 2, degree_v: 1, points, u: [0.0, 1.0], v: [0.0, 1.0] });
        }
        let (forms, found) = traced(&patches, FINE);
        assert_eq!(found.stats.patches, mixed);
        assert_eq!((found.stats.cusps, found.undecided.len()), (0, 0), "{d}");
        assert!(forms.iter().all(|f| f.collapsed == [false, false, false, true] && f.edge_factor[3] == 1));
        // Two silhouettes; for the second view one of them is the edge between two patches, θ = π.
        let on_edges = found.edges.iter().filter(|e| !e.collapsed).count();
        assert_eq!(found.curves.len() + on_edges / 2, 2);
        let apex = camera.project(DVec3::new(0.0, 0.0, 1.5)).unwrap();
        for curve in &found.curves {
            let points = sampled(curve, &patches, &forms, 3);
            assert!(points.iter().any(|p| (*p - apex).length() < 1e-12));
            let (first, last) = (points[0].truncate(), points[points.len() - 1].truncate());
            assert!(points.iter().all(|p| distance_to_chord(p.truncate(), first, last) < 1e-12));
        }
    }
}

/// The patch (x, y, z)(u, v) for u and v in [−1, 1], each coordinate given as a polynomial of the two.
fn polynomial_patch(f: impl Fn(&Bivariate, &Bivariate) -> [Bivariate; 3]) -> Patch {
    let u = Bivariate::from_fn(1, 0, |i, _| 2.0 * i as f64 - 1.0);
    let v = Bivariate::from_fn(0, 1, |_, j| 2.0 * j as f64 - 1.0);
    let c = f(&u, &v);
    let p = c.iter().map(Bivariate::degree_u).max().unwrap_or(1).max(1);
    let q = c.iter().map(Bivariate::degree_v).max().unwrap_or(1).max(1);
    let c = c.map(|x| x.elevated(p, q));
    let mut points = Vec::new();
    for i in 0..=p {
        for j in 0..=q {
            points.push(DVec4::new(c[0].get(i, j), c[1].get(i, j), c[2].get(i, j), 1.0));
        }
    }
    Patch { surface: 0, degree_u: p, degree_v: q, points, u: [-1.0, 1.0], v: [-1.0, 1.0] }
}

/// (u, v³ + u v, v): Whitney's cusp.
fn whitney() -> Patch {
    polynomial_patch(|u, v| [u.clone(), v.mul(v).mul(v).add(&u.mul(v)), v.clone()])
}

#[test]
fn whitneys_cusp_is_split_at_the_origin() {
    let patches = [whitney()];
    let (forms, found) = traced(&patches, FINE);
    assert_eq!((found.curves.len(), found.stats.cusps), (2, 1));
    let [a, b] = [&found.curves[0], &found.curves[1]];
    assert_eq!((a.ends, b.ends), ([CurveEnd::Border, CurveEnd::Cusp], [CurveEnd::Cusp, CurveEnd::Border]));
    let cusp = a.vertices[a.segment_count()];
    assert_eq!(cusp, b.vertices[0]);
    assert!((cusp - DVec2::splat(0.5)).length() < 1e-12, "{cusp}");
    for curve in [a, b] {
        for p in sampled(curve, &patches, &forms, 5) {
            assert!((p.x + 3.0 * p.z * p.z).abs() < 1e-14, "F = 3 v² + u vanishes");
        }
    }
}

#[test]
fn exchanging_the_parameters_changes_nothing_but_the_direction() {
    let patch = whitney();
    let w = patch.degree_v + 1;
    let mut swapped = patch.clone();
    (swapped.degree_u, swapped.degree_v) = (patch.degree_v, patch.degree_u);
    swapped.points =
        (0..w).flat_map(|j| (0..=patch.degree_u).map(move |i| (i, j))).map(|(i, j)| patch.points[i * w + j]).collect();
    let (_, a) = traced(core::slice::from_ref(&patch), FINE);
    let (_, b) = traced(core::slice::from_ref(&swapped), FINE);
    assert_eq!(a.curves.len(), b.curves.len());
    let cusp = |s: &Silhouettes, p: &Patch| {
        let local = s.curves[1].vertices[0];
        p.eval(local.x, local.y)
    };
    assert!((cusp(&a, &patch) - cusp(&b, &swapped)).length() < 1e-12);
}

#[test]
fn lips_of_a_tiny_fold_are_found_with_their_two_cusps() {
    for r in [0.3, 1e-3, 1e-5] {
        // x = u, y with y_v = (u − a)² + (v − b)² − r²: a round fold line, cusps where the sight line z = v touches it.
        let (a, b) = (0.123, -0.077);
        let constant = Bivariate::constant;
        let patches = [polynomial_patch(|u, v| {
            let (s, t) = (u.sub(&constant(a)), v.sub(&constant(b)));
            let y = t.mul(&t).mul(&t).scaled(1.0 / 3.0).add(&s.mul(&s).sub(&constant(r * r)).mul(&t));
            [u.clone(), y, v.clone()]
        })];
        let options = SilhouetteOptions { chord: 1e-3 * r, normal_angle: 0.1 };
        let (forms, found) = traced(&patches, options);
        assert_eq!((found.stats.loops, found.stats.cusps, found.curves.len()), (1, 2, 2), "{r}: {:?}", found.stats);
        // Coefficients of size 1 place the circle to their rounding divided by the slope 2 r.
        let near = 1e-13 / r;
        for curve in &found.curves {
            assert_eq!(curve.ends, [CurveEnd::Cusp; 2]);
            for p in sampled(curve, &patches, &forms, 3) {
                assert!((DVec2::new(p.x - a, p.z - b).length() - r).abs() < near, "{r} {p}");
            }
            let at = curve.vertices[0] * 2.0 - DVec2::ONE;
            assert!(((at.x - a).abs() - r).abs() < near && (at.y - b).abs() < near * 10.0, "{r} {at}");
        }
    }
}

#[test]
fn chord_error_is_kept_and_evaluation_meets_the_vertices() {
    let camera = Camera::orthographic(DVec3::new(1.0, -2.0, 1.5), DVec3::Z).unwrap();
    let patches = torus(&camera);
    for chord in [1e-2, 1e-3, 1e-5] {
        let (forms, found) = traced(&patches, SilhouetteOptions { chord, normal_angle: 0.5 });
        for curve in &found.curves {
            let per = 8;
            let points = sampled(curve, &patches, &forms, per);
            for (k, piece) in points.windows(per + 1).step_by(per).enumerate() {
                let (a, b) = (piece[0].truncate(), piece[per].truncate());
                for p in piece {
                    assert!(distance_to_chord(p.truncate(), a, b) <= 1.5 * chord);
                }
                assert_eq!(curve.local_at(&forms[curve.patch], k as f64), curve.vertices[k]);
            }
        }
        assert!(found.stats.steps < 8 * found.stats.walks, "{:?}", found.stats);
    }
}
