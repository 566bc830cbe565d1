//! Closed forms, invariants, and curves that are hard to follow.

use alloc::vec::Vec;
use core::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DVec2, DVec3, DVec4};
use proptest::prelude::*;

use super::*;
use crate::shape::{Frame, arc, circle, cone, cylinder, extrusion, line, plane, polyline, revolution, sphere, torus};

const ROUND: [bool; 2] = [true, false];

fn tilted() -> Frame {
    Frame::new(DVec3::new(3.0, -2.0, 5.0), DVec3::new(1.0, 2.0, 2.0), DVec3::new(0.3, -1.0, 0.0)).unwrap()
}

/// The point with these coordinates in a frame.
fn at(f: &Frame, x: f64, y: f64, z: f64) -> DVec3 {
    let [ex, ey, ez] = f.axes();
    f.origin() + ex * x + ey * y + ez * z
}

/// A frame at a place of another, with its z and x axes along these directions.
fn placed(f: &Frame, origin: [f64; 3], z: [f64; 3], x: [f64; 3]) -> Frame {
    let direction = |d: [f64; 3]| at(f, d[0], d[1], d[2]) - f.origin();
    Frame::new(at(f, origin[0], origin[1], origin[2]), direction(z), direction(x)).unwrap()
}

fn samples(c: &Curve, count: usize) -> Vec<DVec3> {
    let [a, b] = c.domain();
    (0..=count).map(|k| c.eval(a + (b - a) * k as f64 / count as f64)).collect()
}

/// Points of the image, on the surface.
fn lifted(s: &Surface, periodic: [bool; 2], found: &PulledBack, count: usize) -> Vec<DVec3> {
    let sheet = Sheet::new(s, periodic);
    found.curves.iter().flat_map(|c| samples(c, count)).map(|p| sheet.eval(p.truncate())).collect()
}

/// Largest distance of a point of `a` from the polygon through `b`.
fn farthest(a: &[DVec3], b: &[DVec3]) -> f64 {
    let to_segment = |p: DVec3, w: &[DVec3]| {
        let d = w[1] - w[0];
        let s = if d == DVec3::ZERO { 0.0 } else { ((p - w[0]).dot(d) / d.length_squared()).clamp(0.0, 1.0) };
        (w[0] + d * s - p).length()
    };
    let nearest = |p: &DVec3| b.windows(2).map(|w| to_segment(*p, w)).fold(f64::INFINITY, f64::min);
    a.iter().map(nearest).fold(0.0, f64::max)
}

/// Pulls back and holds the image against the curve by points alone: as sets both ways, and at the ends.
fn checked(s: &Surface, periodic: [bool; 2], c: &Curve, tolerance: f64) -> PulledBack {
    let found = pull_back(s, periodic, c, tolerance).unwrap_or_else(|e| panic!("{e}"));
    let sheet = Sheet::new(s, periodic);
    // Fine enough that the polygons' chords are near the curves, by the tolerance that is asked for here.
    let (image, curve) = (lifted(s, periodic, &found, 2000), samples(c, 2000));
    let chords = curve.windows(2).map(|w| (w[1] - w[0]).length()).fold(0.0, f64::max);
    let allowed = found.deviation + 0.5 * chords * chords / sheet.size.min(1.0) + 1e-13 * sheet.size;
    let (there, back) = (farthest(&image, &curve), farthest(&curve, &image));
    assert!(there <= allowed && back <= allowed, "{there:e} {back:e}, said {:e}", found.deviation);
    assert!(found.deviation <= tolerance + found.off + 1e-13 * sheet.size, "{found:?}");
    let ends = [image[0] - curve[0], image[image.len() - 1] - curve[curve.len() - 1]];
    assert!(ends.iter().all(|e| e.length() <= found.deviation + 1e-13 * sheet.size), "{ends:?}");
    let start = found.curves[0].eval(found.curves[0].domain()[0]);
    assert!((0..2).all(|d| sheet.lo[d] - 1e-9 <= start[d] && start[d] <= sheet.hi[d]), "begins at {start}");
    found
}

/// The ends of the image's only curve.
fn ends(found: &PulledBack) -> [DVec2; 2] {
    assert_eq!(found.curves.len(), 1);
    found.curves[0].domain().map(|t| found.curves[0].eval(t).truncate())
}

fn cubics(found: &PulledBack) -> usize {
    found.curves.iter().map(|c| c.bezier_segments().len()).sum()
}

/// The rational Bézier curve on [a, b] whose homogeneous coordinates are polynomials in t, by their coefficients.
fn polynomial(coordinates: [&[f64]; 4], [a, b]: [f64; 2], f: &Frame) -> Curve {
    let n = coordinates.iter().map(|c| c.len()).max().unwrap() - 1;
    let blossom = |c: &[f64], j: usize| {
        // Elementary symmetric polynomials of n − j arguments a and j arguments b.
        let mut e = alloc::vec![1.0];
        for k in 0..n {
            let x = if k < n - j { a } else { b };
            e.push(0.0);
            for i in (1..e.len()).rev() {
                e[i] += e[i - 1] * x;
            }
        }
        c.iter().enumerate().map(|(k, c)| c * e[k] / crate::bernstein::binomial(n, k)).sum::<f64>()
    };
    let points = (0..=n).map(|j| {
        let [x, y, z, w] = coordinates.map(|c| blossom(c, j));
        let [ex, ey, ez] = f.axes();
        (f.origin() * w + ex * x + ey * y + ez * z).extend(w)
    });
    Curve::from_homogeneous(KnotVector::bezier(n, [a, b]).unwrap(), points.collect()).unwrap()
}

#[test]
fn curves_on_a_plane_are_affine_images() {
    let f = tilted();
    let [x, y, z] = f.axes();
    let s = plane(f.origin() - 3.0 * x - 3.0 * y, 6.0 * x, 6.0 * y + x).unwrap();
    let c = circle(&f, 2.0).unwrap();
    let found = checked(&s, [false; 2], &c, 1e-6);
    assert!(found.deviation < 1e-14 && found.off < 1e-14);
    assert_eq!((found.curves[0].knots(), found.curves.len()), (c.knots(), 1));
    // Above the plane the image is that of the feet.
    let above = circle(&placed(&f, [0.0, 0.0, 1e-3], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]), 2.0).unwrap();
    let off = checked(&s, [false; 2], &above, 1e-6);
    assert!((off.off - 1e-3).abs() < 1e-14);
    for (p, q) in samples(&found.curves[0], 50).iter().zip(samples(&off.curves[0], 50)) {
        assert!((*p - q).length() < 1e-14);
    }
    // The same plane of higher degree, with more knots.
    let t = s.elevated(3, 2).unwrap().insert_knot_u(0.3, 2).unwrap().insert_knot_v(0.7, 1).unwrap();
    assert!(checked(&t, [false; 2], &c, 1e-6).deviation < 1e-13);
    assert!(z.dot(t.eval(0.2, 0.4) - f.origin()).abs() < 1e-13);
}

#[test]
fn circles_and_lines_of_a_cylinder_are_straight() {
    let f = tilted();
    let s = cylinder(&f, 1.5, 4.0).unwrap();
    for start in [0.0, 0.1, FRAC_PI_2, 2.0, PI, 5.5] {
        for sweep in [TAU, -TAU, 1.0, -4.0, 0.01] {
            let level = placed(&f, [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
            let found = checked(&s, ROUND, &arc(&level, 1.5, start, sweep).unwrap(), 1e-6);
            let [a, b] = ends(&found);
            assert!(found.curves[0].degree() == 1 && (a.y - 0.25).abs() < 1e-12 && a.y == b.y, "{a} {b}");
            if sweep.abs() == TAU {
                assert!((b.x - a.x - sweep / TAU).abs() < 1e-9, "{a} {b}");
            }
            if start == FRAC_PI_2 {
                assert!((a.x - 0.25).abs() < 1e-9);
            }
        }
        let (sin, cos) = libm::sincos(start);
        let ray = line(at(&f, 1.5 * cos, 1.5 * sin, 3.0), at(&f, 1.5 * cos, 1.5 * sin, 1.0)).unwrap();
        let [a, b] = ends(&checked(&s, ROUND, &ray, 1e-6));
        assert!(a.x == b.x && (a.y - 0.75).abs() < 1e-12 && (b.y - 0.25).abs() < 1e-12);
        assert!(start != 0.0 || a.x == 0.0, "the low side of the seam");
    }
}
