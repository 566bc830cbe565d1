//! How many silhouettes a scene shows, how many of them are closed, and how many cusps they have: closed forms, however
//! the surfaces are cut and described.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::{DVec3, DVec4};
use penvis_core::nurbs::{KnotVector, Surface};
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::scene::{Scene, SceneSurface};
use penvis_core::shape::{Frame, cone, cylinder, disk, sphere, torus};
use penvis_core::view::Camera;
use proptest::prelude::*;

fn prepared(surfaces: Vec<Surface>, camera: &Camera) -> Prepared {
    let named = |(k, surface): (usize, Surface)| SceneSurface::new(k.to_string(), surface);
    let scene = Scene { name: String::new(), surfaces: surfaces.into_iter().enumerate().map(named).collect() };
    let options = DrawOptions { isos: 0, ..DrawOptions::default() };
    Prepared::new(&scene, camera, &options, &()).expect("a picture")
}

fn parallel(eye: DVec3) -> Camera {
    let up = if eye.normalize().z.abs() > 0.9 { DVec3::X } else { DVec3::Z };
    Camera::orthographic(eye, up).expect("a camera")
}

/// Components, loops and cusps; every silhouette is in one chain, and neighbours in a chain meet.
fn counts(surfaces: Vec<Surface>, camera: &Camera) -> [usize; 3] {
    let p = prepared(surfaces, camera);
    let (found, g) = (p.silhouette_chains(), p.geometry());
    let mut seen = vec![0; p.curves().len()];
    let size = g.view.size();
    for chain in &found.chains {
        let ends = |k: usize| {
            let link = chain.links[k];
            let curve = &p.curves()[link.curve];
            let [a, b] = curve.domain.map(|t| curve.point(&g, t));
            if link.reversed { [b, a] } else { [a, b] }
        };
        chain.links.iter().for_each(|l| seen[l.curve] += 1);
        for k in 1..chain.links.len() {
            assert!(ends(k - 1)[1].distance(ends(k)[0]) <= 1e-6 * size);
        }
        if chain.closed {
            assert!(ends(chain.links.len() - 1)[1].distance(ends(0)[0]) <= 1e-6 * size);
        }
    }
    for (curve, times) in p.curves().iter().zip(seen) {
        let silhouette = curve.kind == penvis_core::stroke::CurveKind::Silhouette;
        assert_eq!(times, usize::from(silhouette), "{:?}", curve.path);
    }
    [found.stats.components, found.stats.loops, found.stats.cusps]
}

fn direction(elevation: f64, azimuth: f64) -> DVec3 {
    DVec3::new(elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin())
}

fn ring() -> Vec<Surface> {
    vec![torus(&Frame::WORLD, 3.0, 1.0).expect("a torus")]
}

fn ball() -> Vec<Surface> {
    vec![sphere(&Frame::WORLD, 1.0).expect("a sphere")]
}

/// Every patch a surface of its own.
fn loose(surfaces: &[Surface]) -> Vec<Surface> {
    let cut = |surfaces: Vec<Surface>, u: bool| -> Vec<Surface> {
        let mut out = Vec::new();
        for surface in surfaces {
            let mut rest = surface;
            let knots = if u { rest.knots_u().breaks() } else { rest.knots_v().breaks() };
            for &t in &knots[1..knots.len() - 1] {
                let (low, high) = if u { rest.split_u(t) } else { rest.split_v(t) }.expect("a knot inside");
                out.push(low);
                rest = high;
            }
            out.push(rest);
        }
        out
    };
    cut(cut(surfaces.to_vec(), true), false)
}

/// The silhouette of a torus is the parallel curve, at the tube's radius r, of the ellipse with half axes R and
/// R sin(elevation): two closed curves, and the inner one has four cusps where r exceeds the ellipse's smallest radius
/// of curvature R sin².
fn ring_counts(elevation: f64) -> [usize; 3] {
    [2, 2, if 3.0 * elevation.sin().powi(2) < 1.0 { 4 } else { 0 }]
}

#[test]
fn a_torus_shows_two_loops_from_every_side() {
    for k in 0..24 {
        let elevation = 0.03 + 1.5 * f64::from(k) / 24.0;
        let eye = direction(elevation, 2.399_963 * f64::from(k));
        assert_eq!(counts(ring(), &parallel(eye)), ring_counts(elevation), "{eye}");
        assert_eq!(counts(loose(&ring()), &parallel(eye)), ring_counts(elevation), "in pieces, {eye}");
    }
}

#[test]
fn a_torus_along_its_axis_and_a_hair_beside_it_shows_two_circles() {
    for tilt in [0.0, 1e-9, 1e-6, 1e-3] {
        for azimuth in [0.0, 0.3, FRAC_PI_2] {
            let eye = direction(FRAC_PI_2 - tilt, azimuth);
            assert_eq!(counts(ring(), &parallel(eye)), [2, 2, 0], "{tilt} {azimuth}");
        }
    }
}

#[test]
fn a_sphere_shows_one_loop_through_poles_and_seams() {
    let mut eyes = vec![DVec3::X, -DVec3::X, DVec3::Y, -DVec3::Y, DVec3::Z, -DVec3::Z, DVec3::new(1.0, -1.0, 0.0)];
    // Across the axis the great circle runs through both poles.
    eyes.extend((0..12).map(|k| direction(0.0, 0.7 * f64::from(k))));
    eyes.extend((0..12).map(|k| direction(0.25 * f64::from(k) - 1.4, 1.1 * f64::from(k))));
    for eye in eyes {
        assert_eq!(counts(ball(), &parallel(eye)), [1, 1, 0], "{eye}");
        assert_eq!(counts(loose(&ball()), &parallel(eye)), [1, 1, 0], "in pieces, {eye}");
        let near = Camera::perspective(3.0 * eye, DVec3::ZERO, eye.any_orthogonal_vector()).expect("a camera");
        assert_eq!(counts(ball(), &near), [1, 1, 0], "near, {eye}");
    }
}

#[test]
fn silhouettes_end_at_creases_boundaries_and_tips() {
    let tube = cylinder(&Frame::WORLD, 1.0, 2.0).expect("a cylinder");
    let lid = disk(&Frame::at(2.0 * DVec3::Z).expect("a frame"), 1.0).expect("a disk");
    let tip = cone(&Frame::WORLD, 1.0, 0.0, 2.0).expect("a cone");
    for k in 0..16 {
        let eye = direction(0.8 * (f64::from(k) / 8.0 - 1.0) + 0.01, 0.9 * f64::from(k));
        assert_eq!(counts(vec![tube.clone(), lid.clone()], &parallel(eye)), [2, 0, 0], "tube, {eye}");
        assert_eq!(counts(vec![tip.clone()], &parallel(eye)), [2, 0, 0], "cone, {eye}");
    }
    assert_eq!(counts(vec![tube, lid], &parallel(DVec3::Z)), [0, 0, 0]);
}

/// (u, v³ + v (a u² + b u + c), v) on the square of half width 1: seen along z, a fold along 3 v² + a u² + b u + c = 0
/// with cusps where v = 0.
fn fold([a, b, c]: [f64; 3]) -> Surface {
    let [ku, kv] = [2, 3].map(|degree| KnotVector::bezier(degree, [-1.0, 1.0]).expect("a degree"));
    // Bernstein coefficients over [−1, 1].
    let (u, uu) = ([-1.0, 0.0, 1.0], [1.0, -1.0, 1.0]);
    let (v, vvv) = ([-1.0, -1.0 / 3.0, 1.0 / 3.0, 1.0], [-1.0, 1.0, -1.0, 1.0]);
    let points = (0..12).map(|k| {
        let (i, j) = (k / 4, k % 4);
        DVec4::new(u[i], vvv[j] + v[j] * (a * uu[i] + b * u[i] + c), v[j], 1.0)
    });
    Surface::new(ku, kv, points.collect()).expect("a surface")
}

fn from_above() -> Camera {
    Camera::orthographic(DVec3::Z, DVec3::Y).expect("a camera")
}

#[test]
fn a_cusp_on_the_border_of_patches_or_near_it_is_one_cusp() {
    // Whitney's cusp at the origin, with borders through it or beside it, in one direction or both.
    for near in [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, -1e-12, -1e-9, -1e-6, -1e-3] {
        let whole = fold([0.0, 1.0, 0.0]);
        let pair = |(a, b): (Surface, Surface)| vec![a, b];
        let by_u = pair(whole.split_u(near).expect("a place inside"));
        let by_v = pair(whole.split_v(near).expect("a place inside"));
        let by_both = by_u.iter().flat_map(|s| pair(s.split_v(-near).expect("a place inside"))).collect();
        let knots = whole.insert_knot_u(near, 2).and_then(|s| s.insert_knot_v(near, 3)).expect("knots inside");
        for (way, cut) in [by_u, by_v, by_both, vec![knots]].into_iter().enumerate() {
            assert_eq!(counts(cut, &from_above()), [1, 0, 1], "{near} way {way}");
        }
    }
}

#[test]
fn pairs_of_cusps_are_found_however_near() {
    for e in [0.3, 1e-2, 1e-3, 1e-4, 1e-5] {
        assert_eq!(counts(vec![fold([1.0, 0.0, -e * e])], &from_above()), [1, 1, 2], "lips, {e}");
        assert_eq!(counts(vec![fold([-1.0, 0.0, e * e])], &from_above()), [2, 0, 2], "beaks apart, {e}");
        assert_eq!(counts(vec![fold([-1.0, 0.0, -e * e])], &from_above()), [2, 0, 0], "beaks joined, {e}");
        assert_eq!(counts(vec![fold([1.0, 0.0, e * e])], &from_above()), [0, 0, 0], "no lips, {e}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn counts_do_not_depend_on_how_surfaces_are_cut_and_described(
        elevation in 0.02..1.5_f64, azimuth in 0.0..TAU, way in 0..6_usize, at in 0.05..0.95_f64,
    ) {
        let eye = parallel(direction(elevation, azimuth));
        for (model, expected) in [(ring(), ring_counts(elevation)), (ball(), [1, 1, 0])] {
            let other: Vec<Surface> = model.iter().flat_map(|s| {
                let place = |d: [f64; 2]| d[0] + at * (d[1] - d[0]);
                let pair = |(a, b)| vec![a, b];
                match way {
                    0 => vec![s.reversed_u()],
                    1 => vec![s.reversed_v()],
                    2 => vec![s.transposed()],
                    3 => pair(s.split_u(place(s.domain_u())).expect("a place inside")),
                    4 => pair(s.split_v(place(s.domain_v())).expect("a place inside")),
                    _ => vec![s.insert_knot_u(place(s.domain_u()), 2).expect("a knot inside")],
                }
            }).collect();
            prop_assert_eq!(counts(other, &eye), expected);
        }
    }
}
