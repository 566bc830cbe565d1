//! Trimmed surfaces against closed forms, and against the same shapes made without trims.

use std::f64::consts::{PI, TAU};

use glam::{DMat4, DVec2, DVec3, DVec4};
use penvis_core::extract::adaptive::{AdaptiveOptions, Direction, Spacing};
use penvis_core::nurbs::{Curve, KnotVector, Surface};
use penvis_core::pipeline::{DrawOptions, Prepared, Traced};
use penvis_core::scene::{Scene, SceneSurface};
use penvis_core::shape::{Frame, circle, cylinder, plane, polyline, torus};
use penvis_core::stroke::CurveKind;
use penvis_core::trim::Trims;
use penvis_core::view::Camera;
use penvis_core::visibility::Method;

fn round(x: f64, y: f64, radius: f64) -> Vec<Curve> {
    let there = DMat4::from_translation(DVec3::new(x, y, 0.0));
    vec![circle(&Frame::WORLD, radius).and_then(|c| Ok(c.transformed(there)?)).expect("a circle")]
}

fn rectangle(u: [f64; 2], v: [f64; 2]) -> Vec<Curve> {
    let corners = [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)].map(|(i, j)| DVec3::new(u[i], v[j], 0.0));
    vec![polyline(&corners).expect("a polygon")]
}

fn whole(surface: Surface) -> SceneSurface {
    SceneSurface::new("whole", surface)
}

fn trimmed(surface: Surface, loops: &[Vec<Curve>]) -> SceneSurface {
    let trims = Some(Trims::new(&surface, loops).expect("trims"));
    SceneSurface { trims, ..SceneSurface::new("trimmed", surface) }
}

/// The square with side `size` about (0, 0, z); its parameters run from 0 to 1.
fn square(size: f64, z: f64) -> Surface {
    plane(DVec3::new(-0.5 * size, -0.5 * size, z), DVec3::X * size, DVec3::Y * size).expect("a plane")
}

fn traced(surfaces: Vec<SceneSurface>, eye: DVec3, options: &DrawOptions) -> Traced {
    let scene = Scene { name: "trims".into(), surfaces };
    let up = if eye.truncate() == DVec2::ZERO { DVec3::Y } else { DVec3::Z };
    let camera = Camera::orthographic(eye, up).expect("a camera");
    let prepared = Prepared::new(&scene, &camera, options, &()).expect("a picture");
    let traced = prepared.trace(1e-7, &()).expect("nothing stops it");
    assert!(traced.stats.visibility.undecided.is_empty(), "{:?}", traced.stats.visibility.undecided);
    traced
}

/// Visible length of a kind on a surface, or on all, in model space.
fn length(picture: &Traced, kind: CurveKind, surface: Option<usize>) -> f64 {
    let wanted = picture.strokes.iter().filter(|s| s.kind == kind && surface.is_none_or(|k| s.surface == k));
    wanted.flat_map(|s| s.points.windows(2)).map(|w| w[0].model.distance(w[1].model)).sum()
}

fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() <= 1e-5 * (1.0 + expected), "{found} instead of {expected}");
}

const SLANTED: DVec3 = DVec3::new(0.7, -1.3, 0.9);

#[test]
fn a_disc_has_a_round_boundary_and_isocurves_as_long_as_its_chords() {
    let options = DrawOptions { isos: 5, ..DrawOptions::default() };
    for eye in [DVec3::Z, SLANTED] {
        let disc = trimmed(square(2.0, 0.0), &[round(0.5, 0.5, 0.4)]);
        let picture = traced(vec![disc], eye, &options);
        near(length(&picture, CurveKind::Boundary, None), TAU * 0.8);
        // At the middles of five parts of the disc's own width.
        let chord = |k: i32| 2.0 * (1.0 - (0.4 * f64::from(k)).powi(2)).sqrt() * 0.8;
        near(length(&picture, CurveKind::Iso, None), 2.0 * (-2..=2).map(chord).sum::<f64>());
        assert_eq!(picture.stats.trims, 1);
    }
}

#[test]
fn what_is_seen_through_a_hole_is_what_lies_under_it() {
    for visibility in [Method::Rays, Method::Propagate] {
        let options = DrawOptions { isos: 4, visibility, ..DrawOptions::default() };
        let plate = trimmed(square(4.0, 1.0), &[rectangle([0.0, 1.0], [0.0, 1.0]), round(0.5, 0.5, 0.125)]);
        let picture = traced(vec![whole(square(1.0, 0.0)), plate], DVec3::Z, &options);
        // The hole has radius ½, and the square under it its corners hidden.
        near(length(&picture, CurveKind::Boundary, Some(1)), 16.0 + PI);
        near(length(&picture, CurveKind::Boundary, Some(0)), 0.0);
        let chord = |x: f64| 2.0 * (0.25 - x * x).sqrt();
        near(length(&picture, CurveKind::Iso, Some(0)), 4.0 * (chord(0.125) + chord(0.375)));
    }
}

#[test]
fn the_parts_that_are_cut_off_hide_nothing() {
    let options = DrawOptions { isos: 3, ..DrawOptions::default() };
    let alone = traced(vec![whole(square(1.0, 0.0))], SLANTED, &options);
    // A disc that is elsewhere, cut from a square that would cover all.
    let away = trimmed(square(40.0, 1.0), &[round(0.1, 0.1, 0.05)]);
    let both = traced(vec![whole(square(1.0, 0.0)), away], SLANTED, &options);
    for kind in [CurveKind::Boundary, CurveKind::Iso] {
        near(length(&both, kind, Some(0)), length(&alone, kind, None));
    }
}

#[test]
fn trims_along_the_whole_range_change_nothing() {
    let ring = || torus(&Frame::WORLD, 3.0, 1.0).expect("a torus");
    let ([u0, u1], [v0, v1]) = (ring().domain_u(), ring().domain_v());
    let options = DrawOptions { isos: 6, ..DrawOptions::default() };
    let all = trimmed(ring(), &[rectangle([u0, u1], [v0, v1])]);
    let (a, b) = (traced(vec![whole(ring())], SLANTED, &options), traced(vec![all], SLANTED, &options));
    for kind in [CurveKind::Boundary, CurveKind::Crease, CurveKind::Silhouette, CurveKind::Iso] {
        near(length(&b, kind, None), length(&a, kind, None));
    }
    assert_eq!(length(&b, CurveKind::Boundary, None), 0.0);
}

/// A part of a torus, cut out by trims and made by splitting: silhouettes, boundaries, what hides what.
#[test]
fn a_trimmed_rectangle_is_the_surface_over_it() {
    let ring = torus(&Frame::WORLD, 3.0, 1.2).expect("a torus");
    for (u, v) in [([0.1, 0.8], [0.05, 0.6]), ([0.0, 0.7], [0.3, 1.0]), ([0.25, 0.75], [0.22, 0.9])] {
        let mut part = ring.clone();
        for (k, at) in [(0, u[0]), (1, u[1])] {
            if let Ok((low, high)) = part.split_u(at) {
                part = if k == 0 { high } else { low };
            }
        }
        for (k, at) in [(0, v[0]), (1, v[1])] {
            if let Ok((low, high)) = part.split_v(at) {
                part = if k == 0 { high } else { low };
            }
        }
        for eye in [SLANTED, DVec3::new(-0.5, 0.2, 0.4), DVec3::new(0.3, 1.1, -0.8)] {
            let options = DrawOptions { isos: 5, ..DrawOptions::default() };
            let expected = traced(vec![whole(part.clone())], eye, &options);
            let found = traced(vec![trimmed(ring.clone(), &[rectangle(u, v)])], eye, &options);
            for kind in [CurveKind::Boundary, CurveKind::Crease, CurveKind::Iso] {
                near(length(&found, kind, None), length(&expected, kind, None));
            }
            // A silhouette touches its own boundary on the screen, and the other branch at a cusp. What is within r
            // there is √(8 r R) long, with r of 10⁻⁸ of the size.
            let [a, b] = [&found, &expected].map(|p| length(p, CurveKind::Silhouette, None));
            assert!((a - b).abs() < 5e-3, "{u:?} {v:?} {eye}: {a} instead of {b}");
        }
    }
}

/// A plate with a bore: the edge of the hole and that of the wall are one crease.
#[test]
fn a_hole_and_the_wall_that_begins_there_share_one_crease() {
    for visibility in [Method::Rays, Method::Propagate] {
        let options = DrawOptions { isos: 0, visibility, ..DrawOptions::default() };
        let plate = || trimmed(square(2.0, 0.0), &[rectangle([0.0, 1.0], [0.0, 1.0]), round(0.5, 0.5, 0.25)]);
        let wall = || {
            let below = Frame::new(DVec3::new(0.0, 0.0, -0.2), DVec3::Z, DVec3::X).expect("a frame");
            whole(cylinder(&below, 0.5, 0.2).expect("a wall"))
        };
        for surfaces in [vec![plate(), wall()], vec![wall(), plate()]] {
            let picture = traced(surfaces, SLANTED, &options);
            near(length(&picture, CurveKind::Crease, None), PI);
            assert!(picture.stats.visibility.tolerated.is_empty(), "{:?}", picture.stats.visibility.tolerated);
        }
        // Along the axis the wall is seen edge-on, and its far end behind the crease.
        let picture = traced(vec![plate(), wall()], DVec3::Z, &options);
        near(length(&picture, CurveKind::Crease, None), PI);
        near(length(&picture, CurveKind::Boundary, None), 8.0);
    }
}

#[test]
fn a_plug_that_fills_a_hole_leaves_no_trace_of_it() {
    let plate = trimmed(square(2.0, 0.0), &[rectangle([0.0, 1.0], [0.0, 1.0]), round(0.5, 0.5, 0.25)]);
    // Round the same circle, on a square of another size.
    let plug = trimmed(square(4.0, 0.0), &[round(0.5, 0.5, 0.125)]);
    for eye in [SLANTED, DVec3::Z] {
        let options = DrawOptions { isos: 2, ..DrawOptions::default() };
        let below = whole(square(1.0, -0.1));
        let picture = traced(vec![plate.clone(), plug.clone(), below], eye, &options);
        near(length(&picture, CurveKind::Boundary, Some(0)), 8.0);
        near(length(&picture, CurveKind::Boundary, Some(1)), 0.0);
        near(length(&picture, CurveKind::Crease, None), 0.0);
        for kind in [CurveKind::Boundary, CurveKind::Iso] {
            near(length(&picture, kind, Some(2)), 0.0);
        }
    }
}

/// The surface (u, −(v − g(u))², v) with g = ½ + 20 u (u − ¼) (u − ¾) (u − 1), seen along its third axis: the
/// silhouette v = g(u) is a straight line on the screen, with one normal all along, and swings to and fro in the parameters.
fn swinging() -> (Surface, impl Fn(f64) -> f64) {
    let g = |u: f64| 0.5 + 20.0 * u * (u - 0.25) * (u - 0.75) * (u - 1.0);
    // Bernstein coefficients by interpolation at as many places as there are coefficients.
    const N: usize = 8;
    let coefficients = |f: &dyn Fn(f64) -> f64| -> Vec<f64> {
        let mut rows: Vec<Vec<f64>> = (0..=N)
            .map(|k| {
                let t = k as f64 / N as f64;
                let binomial = |i: usize| (0..i).fold(1.0, |b, j| b * (N - j) as f64 / (j + 1) as f64);
                let basis = |i: usize| binomial(i) * t.powi(i as i32) * (1.0 - t).powi((N - i) as i32);
                (0..=N).map(basis).chain([f(t)]).collect()
            })
            .collect();
        for k in 0..=N {
            let pivot = (k..=N).max_by(|&a, &b| rows[a][k].abs().total_cmp(&rows[b][k].abs())).expect("a row");
            rows.swap(k, pivot);
            let own = rows[k].clone();
            for (_, row) in rows.iter_mut().enumerate().filter(|(r, _)| *r != k) {
                let factor = row[k] / own[k];
                row.iter_mut().zip(&own).for_each(|(x, y)| *x -= factor * y);
            }
        }
        (0..=N).map(|k| rows[k][N + 1] / rows[k][k]).collect()
    };
    let (x, once, twice) = (coefficients(&|u| u), coefficients(&g), coefficients(&|u| g(u) * g(u)));
    let points = (0..=N).flat_map(|i| {
        // v² and v have the coefficients 0, 0, 1 and 0, ½, 1.
        let y = [0.0, once[i], 2.0 * once[i] - 1.0].map(|y| y - twice[i]);
        [0, 1, 2].map(|j| DVec4::new(x[i], y[j], 0.5 * j as f64, 1.0))
    });
    let knots = |degree| KnotVector::bezier(degree, [0.0, 1.0]).expect("knots");
    (Surface::new(knots(N), knots(2), points.collect()).expect("a surface"), g)
}

#[test]
fn a_silhouette_that_swings_between_its_vertices_is_cut_wherever_it_is_kept() {
    let (surface, g) = swinging();
    let options = DrawOptions { isos: 0, ..DrawOptions::default() };
    let drawn = |loops: &[Vec<Curve>]| {
        let scene = Scene { name: "swinging".into(), surfaces: vec![trimmed(surface.clone(), loops)] };
        let camera = Camera::orthographic(DVec3::Z, DVec3::Y).expect("a camera");
        let prepared = Prepared::new(&scene, &camera, &options, &()).expect("a picture");
        assert!(prepared.stats().silhouette_undecided.is_empty(), "{:?}", prepared.stats().silhouette_undecided);
        let curves = prepared.curves().iter().filter(|c| c.kind == CurveKind::Silhouette);
        let mut parts: Vec<[f64; 2]> = curves
            .map(|c| c.domain.map(|t| c.uv(&prepared.geometry(), t).x))
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        parts.sort_by(|a, b| a[0].total_cmp(&b[0]));
        parts
    };
    assert_eq!(drawn(&[rectangle([0.0, 1.0], [0.0, 1.0])]), [[0.0, 1.0]]);
    // A tile on the top of each swing, which is in the middle between places at which the curve is at one height.
    for top in [0.5 - 0.15625_f64.sqrt(), 0.5, 0.5 + 0.15625_f64.sqrt()] {
        let (w, h) = (0.01, 0.004);
        let parts = drawn(&[rectangle([top - w, top + w], [g(top) - h, g(top) + h])]);
        assert!(parts.len() == 1, "{top}: {parts:?}");
        let [a, b] = parts[0];
        assert!(a < top && top < b, "{top}: {parts:?}");
        for u in [a, b] {
            let on_border = ((u - top).abs() - w).abs() < 1e-9 || ((g(u) - g(top)).abs() - h).abs() < 1e-9;
            assert!(on_border, "{top}: {u}");
        }
        // What the tile leaves out are two parts.
        let rest = drawn(&[rectangle([0.0, 1.0], [0.0, 1.0]), rectangle([top - w, top + w], [g(top) - h, g(top) + h])]);
        assert!(rest.len() == 2 && (rest[0][1] - a).abs() + (rest[1][0] - b).abs() < 1e-9, "{top}: {rest:?}");
    }
}

#[test]
fn adaptive_isocurves_cover_what_is_kept_and_its_borders() {
    // Half a square, by trims along three of its borders, next to the other half, which goes on smoothly.
    let half = trimmed(square(2.0, 0.0), &[rectangle([0.0, 0.5], [0.0, 1.0])]);
    let other = plane(DVec3::new(0.0, -1.0, 0.0), DVec3::X, DVec3::Y * 2.0).expect("a plane");
    let scene = Scene { name: "halves".into(), surfaces: vec![half, whole(other)] };
    let camera = Camera::orthographic(DVec3::Z, DVec3::Y).expect("a camera");
    let options = DrawOptions { isos: 0, ..DrawOptions::default() };
    let mut prepared = Prepared::new(&scene, &camera, &options, &()).expect("a picture");
    let adaptive = AdaptiveOptions {
        spacing: 0.3,
        measured: Spacing::Screen,
        direction: Direction::Both,
        tone: None,
        levels: 1,
        shortest: 0.01,
    };
    prepared.cover(&adaptive, &()).expect("nothing stops it");
    let picture = prepared.trace(1e-7, &()).expect("nothing stops it");
    let isos = || picture.strokes.iter().filter(|s| s.kind == CurveKind::Iso);
    assert!(isos().any(|s| s.surface == 0) && isos().any(|s| s.surface == 1));
    let points = isos().flat_map(|s| s.points.iter().map(move |p| (s.surface, p.model)));
    for (surface, p) in points {
        assert!(if surface == 0 { p.x < 1e-6 } else { p.x > -1e-6 }, "{surface}: {p}");
    }
    near(length(&picture, CurveKind::Boundary, None), 8.0);
    near(length(&picture, CurveKind::Crease, None), 0.0);
}
