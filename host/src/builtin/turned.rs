//! Solids of revolution about the z axis, each from an exact profile in the half plane (r, z).
//!
//! A profile is a chain of curves from the axis to the axis: the underside first, then up the outside. Every curve is
//! one surface; where two meet at an angle there is a crease, where they meet smoothly a seam. Neighbours are given the
//! same end point, hence the same circle.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3, DVec4};
use penvis_core::nurbs::{Curve, KnotVector, Surface};
use penvis_core::scene::SceneSurface;
use penvis_core::shape;

use super::part;
use crate::model::View;

/// Foot, body, collar and head; the head is a sphere of radius 0.45 about (0, 2.22).
pub(super) fn pawn() -> Option<Vec<SceneSurface>> {
    const RIM: (f64, f64) = (0.95, 0.0);
    const WAIST: (f64, f64) = (0.72, 0.62);
    const NECK: (f64, f64) = (0.26, 1.66);
    const HEAD: (f64, f64) = (0.27, 1.86);
    let foot =
        [RIM, (1.04, 0.02), (1.09, 0.13), (1.02, 0.3), (0.78, 0.28), (0.76, 0.42), (0.9, 0.48), (0.84, 0.59), WAIST];
    let body = [WAIST, (0.62, 0.67), (0.5, 0.78), (0.36, 1.08), (0.29, 1.4), (0.27, 1.56), NECK];
    let collar = [NECK, (0.36, 1.65), (0.5, 1.68), (0.58, 1.76), (0.5, 1.84), (0.37, 1.86), HEAD];
    Some(vec![
        part("underside", turn(&spline(&[(0.0, 0.0), RIM])?)?),
        part("foot", turn(&spline(&foot)?)?),
        part("body", turn(&spline(&body)?)?),
        part("collar", turn(&spline(&collar)?)?),
        part("head", turn(&arcs((0.0, 2.22), &[HEAD, (0.45, 2.22), (0.0, 2.67)])?)?),
    ])
}

pub(super) fn pawn_view() -> View {
    View::perspective(DVec3::new(3.6, -5.2, 3.9), DVec3::new(0.0, 0.0, 1.3))
}

/// Foot, stem with a knob and bowl in one curve, a round lip, and the inside of the bowl.
pub(super) fn goblet() -> Option<Vec<SceneSurface>> {
    const RIM: (f64, f64) = (0.92, 0.0);
    const EDGE: (f64, f64) = (0.92, 0.05);
    const OUTER: (f64, f64) = (0.9, 3.2);
    const INNER: (f64, f64) = (0.84, 3.2);
    let outside = [
        EDGE,
        (0.78, 0.13),
        (0.4, 0.16),
        (0.13, 0.3),
        (0.1, 0.75),
        (0.1, 1.02),
        (0.3, 1.1),
        (0.3, 1.26),
        (0.09, 1.34),
        (0.12, 1.62),
        (0.6, 1.74),
        (0.98, 2.1),
        (1.05, 2.62),
        (0.9, 2.98),
        OUTER,
    ];
    let inside = [INNER, (0.84, 2.98), (0.98, 2.62), (0.91, 2.16), (0.55, 1.85), (0.2, 1.78), (0.0, 1.78)];
    Some(vec![
        part("underside", turn(&spline(&[(0.0, 0.0), RIM])?)?),
        part("edge", turn(&spline(&[RIM, EDGE])?)?),
        part("outside", turn(&spline(&outside)?)?),
        part("lip", turn(&arcs((0.87, 3.2), &[OUTER, (0.87, 3.23), INNER])?)?),
        part("inside", turn(&spline(&inside)?)?),
    ])
}

pub(super) fn goblet_view() -> View {
    View::perspective(DVec3::new(2.0, -6.0, 5.8), DVec3::new(0.0, 0.0, 1.6))
}

/// The clamped uniform B-spline of those control points, cubic or of as high a degree as they allow.
pub(super) fn spline(control: &[(f64, f64)]) -> Option<Curve> {
    let degree = 3.min(control.len() - 1);
    let knots = KnotVector::uniform(degree, control.len() - degree, [0.0, 1.0]).ok()?;
    Curve::new(knots, control.iter().map(|&(r, z)| DVec4::new(r, 0.0, z, 1.0)).collect()).ok()
}

/// Circular arcs about one centre through points of a circle, each less than half a turn from the one before; exact
/// rational quadratics.
pub(super) fn arcs(centre: (f64, f64), through: &[(f64, f64)]) -> Option<Curve> {
    let centre = DVec2::from(centre);
    let mut control = Vec::with_capacity(2 * through.len() - 1);
    for (k, &point) in through.iter().enumerate() {
        if k > 0 {
            let (s, e) = (DVec2::from(through[k - 1]) - centre, DVec2::from(point) - centre);
            // The tangents of the ends meet on the bisector, at distance ρ / cos(half the angle).
            let cosine = s.dot(e) / s.dot(s);
            let m = centre + (s + e) / (1.0 + cosine);
            control.push(DVec4::new(m.x, 0.0, m.y, ((1.0 + cosine) / 2.0).sqrt()));
        }
        control.push(DVec4::new(point.0, 0.0, point.1, 1.0));
    }
    let count = through.len() - 1;
    let inner = (1..count).flat_map(|k| [k as f64 / count as f64; 2]);
    let knots = [0.0; 3].into_iter().chain(inner).chain([1.0; 3]).collect();
    Curve::new(KnotVector::new(knots, 2).ok()?, control).ok()
}

/// The profile, given in the half plane y = 0, x ≥ 0, turned once about the z axis.
pub(super) fn turn(profile: &Curve) -> Option<Surface> {
    shape::revolution(profile, DVec3::ZERO, DVec3::Z, TAU).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surface(surfaces: Option<Vec<SceneSurface>>, name: &str) -> Surface {
        surfaces.unwrap().into_iter().find(|s| s.name == name).unwrap().surface
    }

    #[test]
    fn arcs_lie_on_their_circle_and_end_at_the_given_points() {
        let through = [(0.27, 1.86), (0.45, 2.22), (0.0, 2.67)];
        let curve = arcs((0.0, 2.22), &through).unwrap();
        for k in 0..=100 {
            let p = curve.eval(f64::from(k) / 100.0);
            assert!(((p - DVec3::Z * 2.22).length() - 0.45).abs() < 1e-15, "{k}: {p}");
        }
        for (t, (r, z)) in [0.0, 0.5, 1.0].into_iter().zip(through) {
            assert_eq!(curve.eval(t), DVec3::new(r, 0.0, z));
        }
    }

    #[test]
    fn splines_begin_and_end_at_control_points_and_along_their_polygon() {
        let control = [(1.0, 0.0), (1.5, 0.5), (1.0, 2.0), (0.5, 2.5), (0.5, 3.0)];
        let curve = spline(&control).unwrap();
        assert_eq!((curve.eval(0.0), curve.eval(1.0)), (DVec3::X, DVec3::new(0.5, 0.0, 3.0)));
        assert!(curve.derivative(0.0).normalize().distance(DVec3::new(1.0, 0.0, 1.0).normalize()) < 1e-15);
        assert!(curve.derivative(1.0).normalize().distance(DVec3::Z) < 1e-15);
    }

    #[test]
    fn every_parallel_is_a_circle() {
        for (part, surfaces) in [("foot", pawn()), ("collar", pawn()), ("outside", goblet())] {
            let s = surface(surfaces, part);
            for v in s.knots_v().breaks() {
                let radius = s.eval(0.0, v).x;
                for k in 0..=60 {
                    let p = s.eval(f64::from(k) / 60.0, v);
                    assert!((p.truncate().length() - radius).abs() < 4e-16 * (1.0 + radius), "{part}: {p}");
                }
            }
        }
    }

    #[test]
    fn the_head_of_the_pawn_is_a_sphere_of_its_closed_form() {
        let head = surface(pawn(), "head");
        for i in 0..=20 {
            for j in 0..=20 {
                let p = head.eval(f64::from(i) / 20.0, f64::from(j) / 20.0);
                assert!((p.distance(DVec3::Z * 2.22) - 0.45).abs() < 1e-15);
            }
        }
        assert_eq!(head.eval(0.3, 1.0), DVec3::new(0.0, 0.0, 2.67));
    }
}
