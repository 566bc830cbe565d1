//! Closed forms, invariants, and curves that are hard to follow.

use alloc::vec::Vec;
use core::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DVec2, DVec3};

use super::*;
use crate::shape::{Frame, arc, circle, cone, cylinder, line, plane, polyline, sphere, torus};

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
    let (image, curve) = (lifted(s, periodic, &found, 400), samples(c, 400));
    let chords = curve.windows(2).map(|w| (w[1] - w[0]).length()).fold(0.0, f64::max);
    let allowed = found.deviation + 0.5 * chords * chords / sheet.size.min(2.0) + 1e-13 * sheet.size;
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

/// The rational curve over the breaks whose homogeneous coordinates are polynomials in t, by their coefficients.
fn polynomial(coordinates: [&[f64]; 4], breaks: &[f64], f: &Frame) -> Curve {
    let n = coordinates.iter().map(|c| c.len()).max().unwrap() - 1;
    let blossom = |c: &[f64], j: usize, a: f64, b: f64| {
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
    let (mut knots, mut points) = (alloc::vec![breaks[0]], Vec::new());
    for w in breaks.windows(2) {
        knots.extend(core::iter::repeat_n(w[0], n));
        for j in usize::from(!points.is_empty())..=n {
            let [x, y, z, w] = coordinates.map(|c| blossom(c, j, w[0], w[1]));
            let [ex, ey, ez] = f.axes();
            points.push((f.origin() * w + ex * x + ey * y + ez * z).extend(w));
        }
    }
    knots.extend(core::iter::repeat_n(breaks[breaks.len() - 1], n + 1));
    Curve::from_homogeneous(KnotVector::new(knots, n).unwrap(), points).unwrap()
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

#[test]
fn circles_round_the_axis_and_meridians_are_straight_on_every_surface_of_revolution() {
    let f = tilted();
    let meridian = |x: f64, r: f64, from: f64, sweep: f64| {
        // In the half-plane at the angle 1 from the x axis.
        let (sin, cos) = libm::sincos(1.0);
        arc(&placed(&f, [x * cos, x * sin, 0.0], [sin, -cos, 0.0], [cos, sin, 0.0]), r, from, sweep).unwrap()
    };
    let level = |r: f64, z: f64| {
        let (sin, cos) = libm::sincos(2.0);
        circle(&placed(&f, [0.0, 0.0, z], [0.0, 0.0, 1.0], [cos, sin, 0.0]), r).unwrap()
    };
    let longitude = cylinder(&f, 1.0, 1.0).unwrap();
    let angle = |a: f64| foot_point(&longitude, ROUND, at(&f, libm::cos(a), libm::sin(a), 0.5)).0.x;
    let ball = sphere(&f, 2.0).unwrap();
    let ring = torus(&f, 3.0, 1.0).unwrap();
    let tip = cone(&f, 2.0, 0.0, 3.0).unwrap();
    let (sin, cos) = libm::sincos(0.7);
    for (s, periodic, c) in [
        (&ball, ROUND, level(2.0 * cos, 2.0 * sin)),
        (&ring, [true; 2], level(3.0 + cos, sin)),
        (&tip, ROUND, level(1.0, 1.5)),
    ] {
        let found = checked(s, periodic, &c, 1e-6);
        let [a, b] = ends(&found);
        assert!(found.curves[0].degree() == 1 && (b - a - DVec2::X).length() < 1e-9, "{a} {b}");
        assert!((a.x - angle(2.0)).abs() < 1e-9);
    }
    for (s, periodic, c) in
        [(&ball, ROUND, meridian(0.0, 2.0, -0.7, 1.5)), (&ring, [true; 2], meridian(3.0, 1.0, 0.2, -TAU))]
    {
        let found = checked(s, periodic, &c, 1e-6);
        let [a, b] = ends(&found);
        assert!(found.curves[0].degree() == 1 && (a.x - angle(1.0)).abs() < 1e-9 && a.x == b.x, "{a} {b}");
        assert!(periodic == ROUND || (b.y - a.y + 1.0).abs() < 1e-9, "{a} {b}");
    }
}

#[test]
fn oblique_circles_of_a_sphere_and_villarceau_circles_of_a_torus() {
    let f = tilted();
    let s = sphere(&f, 2.0).unwrap();
    for (z, h) in [([1.0, 0.3, 0.2], 0.5), ([1.0, 0.3, 0.2], 0.0), ([0.1, 0.2, 1.0], 1.2), ([0.5, 0.0, 1.0], -1.7)] {
        let n = DVec3::from(z).normalize() * h;
        let c = circle(&placed(&f, n.to_array(), z, [0.3, -0.8, 1.0]), libm::sqrt(4.0 - h * h)).unwrap();
        for tolerance in [1e-3, 1e-5, 1e-7] {
            let found = checked(&s, ROUND, &c, tolerance);
            assert!(found.curves.len() == 1 && found.off < 1e-13, "{z:?}: {}", found.off);
            let turns = ends(&found)[1].x - ends(&found)[0].x;
            // Round the axis if the poles are on two sides of its plane.
            let round = if (f64::hypot(z[0], z[1]) * h).abs() < 0.0 { 0.0 } else { turns.round() };
            assert!((turns - round).abs() < 1e-7 && round.abs() <= 1.0, "{turns}");
            assert!(cubics(&found) < 40 + (20.0 / libm::sqrt(libm::sqrt(tolerance))) as usize, "{}", cubics(&found));
        }
    }
    let (major, minor) = (3.0, 1.0);
    let s = torus(&f, major, minor).unwrap();
    let (sin, cos) = (minor / major, libm::sqrt(1.0 - minor * minor / (major * major)));
    let c = circle(&placed(&f, [minor, 0.0, 0.0], [0.0, -sin, cos], [0.6, 0.8 * cos, 0.8 * sin]), major).unwrap();
    let found = checked(&s, [true; 2], &c, 1e-6);
    let turns = ends(&found)[1] - ends(&found)[0];
    assert!(found.off < 1e-12 && (turns.abs() - DVec2::ONE).abs().max_element() < 1e-9, "{turns} {}", found.off);
    assert_eq!(found.curves[0].degree(), 3);
}

#[test]
fn vivianis_curve_is_on_the_sphere_and_on_the_cylinder() {
    // x = cos² a, y = cos a sin a, z = sin a; with s = tan(a / 2) times (1 + s²)².
    let f = tilted();
    let coordinates: [&[f64]; 4] = [
        &[1.0, 0.0, -2.0, 0.0, 1.0],
        &[0.0, 2.0, 0.0, -2.0, 0.0],
        &[0.0, 2.0, 0.0, 2.0, 0.0],
        &[1.0, 0.0, 2.0, 0.0, 1.0],
    ];
    let tube = cylinder(&placed(&f, [0.5, 0.0, -1.2], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]), 0.5, 2.4).unwrap();
    let ball = sphere(&f, 1.0).unwrap();
    // From one pole of the sphere to the other.
    let half = polynomial(coordinates, &[-1.0, 0.0, 1.0], &f);
    let found = checked(&tube, ROUND, &half, 1e-6);
    assert!(found.off < 1e-14 && ((ends(&found)[1] - ends(&found)[0]).x.abs() - 1.0).abs() < 1e-9);
    let found = checked(&ball, ROUND, &half, 1e-6);
    let [a, b] = ends(&found);
    // Longitude and latitude are both a: from −¼ to ¼ of a turn.
    assert!(a.y == 0.0 && b.y == 1.0 && (b.x - a.x - 0.5).abs() < 1e-7, "{a} {b}");
    assert!((a.x - 0.75).abs() < 1e-7, "{a}");
    assert!(cubics(&found) < 100, "{}", cubics(&found));
    // Over the north pole.
    let over = polynomial(coordinates, &[0.3, 0.8, 1.6, 2.5], &f);
    let found = checked(&ball, ROUND, &over, 1e-6);
    assert_eq!(found.curves.len(), 2);
    let [from, to] = [&found.curves[0], &found.curves[1]];
    let (end, start) = (from.eval(from.domain()[1]), to.eval(to.domain()[0]));
    // Down the other side the latitude is 180° − a, the longitude 180° + a.
    assert!(end.y == 1.0 && start.y == 1.0 && ((start.x - end.x).abs() - 0.5).abs() < 1e-6, "{end} {start}");
}

#[test]
fn a_great_circle_through_both_poles_is_in_parts() {
    let f = tilted();
    let s = sphere(&f, 2.0).unwrap();
    let (sin, cos) = libm::sincos(0.4);
    let round = placed(&f, [0.0; 3], [sin, -cos, 0.0], [cos, sin, 0.0]);
    // From 30° south over the north pole, the south pole, and back.
    let found = checked(&s, ROUND, &arc(&round, 2.0, -PI / 6.0, TAU).unwrap(), 1e-6);
    assert_eq!(found.curves.iter().map(Curve::degree).collect::<Vec<_>>(), [1, 1, 1]);
    let spans: Vec<[DVec3; 2]> = found.curves.iter().map(|c| c.domain().map(|t| c.eval(t))).collect();
    assert!(spans.iter().all(|[a, b]| a.x == b.x) && spans[0][1].y == 1.0 && spans[1][0].y == 1.0);
    assert!(spans[1][1].y == 0.0 && spans[2][0].y == 0.0 && (spans[0][0].x - spans[2][0].x).abs() < 1e-9);
    assert!(((spans[0][0].x - spans[1][0].x).abs() - 0.5).abs() < 1e-9);
    // A circle that begins and ends in a pole, oblique.
    let c = circle(&placed(&f, [1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]), libm::sqrt(2.0)).unwrap();
    let found = checked(&s, ROUND, &c, 1e-6);
    let [a, b] = ends(&found);
    // It leaves the pole along y and comes back along y: half a turn.
    assert!(a.y == 1.0 && b.y == 1.0 && ((a.x - b.x).abs() - 0.5).abs() < 1e-6, "{a} {b}");
}

#[test]
fn a_line_over_the_apex_of_a_cone_is_two_rays() {
    let f = tilted();
    let s = cone(&f, 2.0, 0.0, 3.0).unwrap();
    let (sin, cos) = libm::sincos(0.9);
    let c = polyline(&[at(&f, 2.0 * cos, 2.0 * sin, 0.0), at(&f, 0.0, 0.0, 3.0), at(&f, -cos, sin, 1.5)]).unwrap();
    let found = checked(&s, ROUND, &c, 1e-6);
    assert_eq!(found.curves.iter().map(Curve::degree).collect::<Vec<_>>(), [1, 1]);
    let spans: Vec<[DVec3; 2]> = found.curves.iter().map(|c| c.domain().map(|t| c.eval(t))).collect();
    assert!(spans.iter().all(|[a, b]| a.x == b.x) && spans[0][1].y == 1.0 && spans[1][0].y == 1.0);
    assert!((spans[0][0].y, (spans[1][1].y - 0.5).abs() < 1e-12) == (0.0, true));
    assert!((spans[0][0].x + spans[1][0].x - 0.5).abs() < 1e-9);
    let point = line(at(&f, 0.0, 0.0, 3.0), at(&f, 0.0, 1e-9, 3.0)).unwrap();
    assert!(matches!(pull_back(&s, ROUND, &point, 1e-6), Err(PullBackError::Point { .. })));
}

/// A cubic B-spline curve in space through the points of `f` at `spans` + 1 parameters, with its derivatives there.
fn hermite(f: impl Fn(f64) -> DVec3, spans: usize) -> Curve {
    let h = 1.0 / spans as f64;
    let slope = |t: f64| {
        let d = 1e-3;
        (8.0 * (f(t + d) - f(t - d)) - f(t + 2.0 * d) + f(t - 2.0 * d)) / (12.0 * d)
    };
    let mut knots = alloc::vec![0.0; 4];
    let mut points = alloc::vec![f(0.0)];
    for k in 0..spans {
        let (a, b) = (k as f64 * h, (k + 1) as f64 * h);
        points.extend([f(a) + slope(a) * (h / 3.0), f(b) - slope(b) * (h / 3.0)]);
        if k + 1 < spans {
            knots.extend([b; 2]);
        }
    }
    points.push(f(1.0));
    knots.extend([1.0; 4]);
    Curve::new(KnotVector::new(knots, 3).unwrap(), points.iter().map(|p| p.extend(1.0)).collect()).unwrap()
}

#[test]
fn a_helix_is_unwrapped_over_its_turns() {
    let f = tilted();
    let s = cylinder(&f, 1.0, 5.0).unwrap();
    for turns in [5.0, -3.0] {
        let spiral = |t: f64| {
            let (sin, cos) = libm::sincos(TAU * turns * t + 0.3);
            at(&f, cos, sin, 0.5 + 4.0 * t)
        };
        let found = checked(&s, ROUND, &hermite(spiral, 200), 1e-5);
        let [a, b] = ends(&found);
        assert!((b.x - a.x - turns).abs() < 1e-6 && (b.y - a.y - 0.8).abs() < 1e-9, "{a} {b}");
        assert!(found.off > 1e-8 && found.off < 2e-6 && cubics(&found) < 250, "{} {}", found.off, cubics(&found));
        for c in samples(&found.curves[0], 64) {
            let height = (c.y - 0.1) / 0.8;
            assert!((c.x - a.x - turns * height).abs() < 0.02);
        }
    }
}

#[test]
fn curves_off_the_surface_have_the_image_of_their_feet() {
    let f = tilted();
    let s = cylinder(&f, 1.5, 4.0).unwrap();
    let level = placed(&f, [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let found = checked(&s, ROUND, &circle(&level, 1.501).unwrap(), 1e-6);
    assert!((found.off - 1e-3).abs() < 1e-9 && (found.deviation - 1e-3).abs() < 1e-6, "{found:?}");
    assert_eq!(found.curves[0].degree(), 1);
    // Over the end of the cylinder it runs along the border.
    let over = placed(&f, [0.0, 0.0, 4.001], [0.0, 0.001, 1.0], [1.0, 0.0, 0.0]);
    let found = checked(&s, ROUND, &circle(&over, 1.5).unwrap(), 1e-6);
    assert!(found.off > 1e-3 && found.off < 3e-3, "{}", found.off);
    let top = samples(&found.curves[0], 100).iter().map(|p| p.y).fold(0.0, f64::max);
    assert!(top == 1.0, "{top}");
    let e = PullBack::new(&s, ROUND).with_limit(1e-4).curve(&circle(&level, 1.501).unwrap(), 1e-6).unwrap_err();
    assert!(matches!(e, PullBackError::Off { distance, limit: 1e-4, .. } if (distance - 1e-3).abs() < 1e-9), "{e}");
    let away = line(at(&f, 1.5, 0.0, 1.0), at(&f, 2.5, 0.0, 3.0)).unwrap();
    assert!(matches!(pull_back(&s, ROUND, &away, 1e-6), Err(PullBackError::Off { .. })));
    for tolerance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(pull_back(&s, ROUND, &away, tolerance), Err(PullBackError::Tolerance { .. })));
    }
}

#[test]
fn the_foot_is_the_nearest_point() {
    let f = tilted();
    let s = torus(&f, 3.0, 1.0).unwrap();
    for i in 0..200 {
        let [x, y, z] = [1.7, 3.1, 7.3].map(|k| libm::sin(k * f64::from(i)));
        let p = at(&f, 5.0 * x, 5.0 * y, 2.0 * z);
        let wanted = (f64::hypot(f64::hypot(5.0 * x, 5.0 * y) - 3.0, 2.0 * z) - 1.0).abs();
        let (uv, distance) = foot_point(&s, [true; 2], p);
        assert!(
            (distance - wanted).abs() < 1e-9 && ((s.eval(uv.x, uv.y) - p).length() - distance).abs() < 1e-13,
            "{i}"
        );
    }
    let (_, centre) = foot_point(&sphere(&f, 2.0).unwrap(), ROUND, f.origin());
    assert!((centre - 2.0).abs() < 1e-13);
}

#[test]
fn what_turns_back_or_waves_is_not_taken_for_a_straight_line() {
    let f = tilted();
    let s = cylinder(&f, 1.0, 4.0).unwrap();
    let places = |z: &[f64]| z.iter().map(|&z| at(&f, 0.0, 1.0, z)).collect::<Vec<_>>();
    // Up a ruling, half of it down, and up again.
    let found = checked(&s, ROUND, &polyline(&places(&[0.5, 3.0, 1.5, 3.5])).unwrap(), 1e-6);
    assert!(found.curves[0].degree() == 3 && (ends(&found)[1].y - 0.875).abs() < 1e-12);
    // Once round a circle and a quarter back.
    let level = placed(&f, [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let there = arc(&level, 1.0, 0.0, TAU).unwrap().elevated(3).unwrap();
    let [a, b] = there.domain();
    let back = arc(&level, 1.0, TAU, -FRAC_PI_2).unwrap().elevated(3).unwrap();
    let knots: Vec<f64> = there.knots().as_slice()[..there.knots().as_slice().len() - 1]
        .iter()
        .copied()
        .chain(back.knots().as_slice()[4..].iter().map(|k| b + (k - back.domain()[0]) * (b - a)))
        .collect();
    let points = there.homogeneous().iter().chain(&back.homogeneous()[1..]).copied().collect();
    let turned = Curve::from_homogeneous(KnotVector::new(knots, 3).unwrap(), points).unwrap();
    let found = checked(&s, ROUND, &turned, 1e-6);
    let top = samples(&found.curves[0], 200).iter().map(|p| p.x).fold(0.0, f64::max);
    assert!(found.curves[0].degree() == 3 && (top - 1.0).abs() < 1e-6, "{top}");
    assert!((ends(&found)[1].x - 0.75).abs() < 1e-9, "{:?}", ends(&found));
    // A wave of degree 9 that is on the ruling in nine places, and off it between.
    let roots: Vec<f64> = (0..9).map(|k| f64::from(k) / 8.0).collect();
    let mut wave = alloc::vec![1.0];
    for r in roots {
        wave.push(0.0);
        for k in (0..wave.len()).rev() {
            wave[k] = if k > 0 { wave[k - 1] } else { 0.0 } - r * wave[k];
        }
    }
    let curve = polynomial([&wave, &[1.0], &[1.0, 2.0], &[1.0]], &[0.0, 1.0], &f);
    let found = checked(&s, ROUND, &curve, 1e-6);
    assert_eq!(found.curves[0].degree(), 3);
}

#[test]
fn a_straight_image_next_to_a_border_or_a_seam_is_on_it() {
    let f = tilted();
    let s = cylinder(&f, 1.0, 4.0).unwrap();
    let level = placed(&f, [0.0, 0.0, 4.0 - 3e-7], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    let [a, b] = ends(&checked(&s, ROUND, &arc(&level, 1.0, 0.0, TAU).unwrap(), 1e-6));
    assert!(a == DVec2::new(0.0, 1.0) && b == DVec2::ONE, "{a} {b}");
    for side in [3e-7, -3e-7] {
        let ray = line(at(&f, 1.0, side, 0.0), at(&f, 1.0, side, 4.0)).unwrap();
        assert_eq!(ends(&checked(&s, ROUND, &ray, 1e-6)), [DVec2::ZERO, DVec2::Y]);
    }
}

/// The sum of the ends of this range, halved, is a unit in the last place from the knot that is its middle.
#[test]
fn a_knot_beside_the_middle_is_no_obstacle() {
    let (a, knot, b) = (0.1, 0.4, 0.7);
    assert!(0.5 * (a + b) != knot, "the case has gone");
    let s = cylinder(&Frame::WORLD, 12.0, 48.0).unwrap();
    // Half a turn round the upper border, made of two quarters.
    let half = arc(&Frame::at(DVec3::new(0.0, 0.0, 48.0)).unwrap(), 12.0, 0.1, PI).unwrap();
    let knots = [a, a, a, knot, knot, b, b, b].to_vec();
    let c = Curve::from_homogeneous(KnotVector::new(knots, 2).unwrap(), half.homogeneous().to_vec()).unwrap();
    let found = checked(&s, ROUND, &c, 1e-6);
    assert_eq!(found.curves.len(), 1);
    assert_eq!(found.curves[0].degree(), 1);
}
