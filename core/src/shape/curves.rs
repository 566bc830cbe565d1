//! Lines and circular arcs.

use alloc::vec::Vec;
use core::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, TAU};

use glam::{DVec3, DVec4};

use super::error::positive;
use super::{Frame, ShapeError};
use crate::nurbs::{Curve, KnotVector};

/// The segment from `a` to `b`; degree 1, parameter 0 to 1.
///
/// # Errors
/// If a coordinate is not finite, or the points coincide.
pub fn line(a: DVec3, b: DVec3) -> Result<Curve, ShapeError> {
    polyline(&[a, b])
}

/// The polygon through `points`; degree 1, with point i at parameter i / (number of points − 1). Close it by repeating
/// the first point.
///
/// # Errors
/// If there are fewer than two points, a coordinate is not finite, or two successive points coincide.
pub fn polyline(points: &[DVec3]) -> Result<Curve, ShapeError> {
    let count = points.len();
    if count < 2 {
        return Err(ShapeError::TooFewPoints { count });
    }
    if let Some(i) = points.windows(2).position(|w| w[0] == w[1]) {
        return Err(ShapeError::EqualPoints { index: i + 1 });
    }
    let knots = KnotVector::uniform(1, count - 1, [0.0, 1.0])?;
    Ok(Curve::new(knots, points.iter().map(|p| p.extend(1.0)).collect())?)
}

/// The full circle round the frame's z axis, counterclockwise from its x axis; degree 2, parameter 0 to 1.
///
/// # Errors
/// If the radius is not positive and finite.
pub fn circle(frame: &Frame, radius: f64) -> Result<Curve, ShapeError> {
    arc(frame, radius, 0.0, TAU)
}

/// The arc in the frame's xy plane about its origin, from the angle `start` through `sweep` (radians, counterclockwise
/// where positive); degree 2, parameter 0 to 1. One rational quadratic for each quarter turn begun; the parameter is not
/// the angle, except at the breaks and in the middle between them.
///
/// # Errors
/// If the radius is not positive and finite, `start` is not finite, or |`sweep`| is zero or more than a full turn.
pub fn arc(frame: &Frame, radius: f64, start: f64, sweep: f64) -> Result<Curve, ShapeError> {
    let radius = positive("the radius of the arc", radius)?;
    if !start.is_finite() {
        return Err(ShapeError::NotFinite { what: "the start angle" });
    }
    let (sin, cos) = libm::sincos(start);
    let turn = UnitArc::new(sweep)?;
    let place = |&(x, y, w): &(f64, f64, f64)| {
        let (x, y) = (cos * x - sin * y, sin * x + cos * y);
        frame.place(DVec4::new(radius * x, radius * y, 0.0, w))
    };
    Ok(Curve::from_homogeneous(turn.knots, turn.points.iter().map(place).collect())?)
}

/// The arc of radius 1 about the origin from angle 0: homogeneous plane control points (x·w, y·w, w).
pub(super) struct UnitArc {
    pub(super) knots: KnotVector,
    pub(super) points: Vec<(f64, f64, f64)>,
}

impl UnitArc {
    /// With n pieces of angle 2δ each, the inner control point of a piece is (cos μ / cos δ, sin μ / cos δ) with weight
    /// cos δ, μ its middle angle: premultiplied just (cos μ, sin μ, cos δ). The NURBS Book section 7.5.
    pub(super) fn new(sweep: f64) -> Result<Self, ShapeError> {
        let size = sweep.abs();
        if !(size > 0.0 && size <= TAU) {
            return Err(ShapeError::Sweep { sweep });
        }
        let pieces = (1..4).find(|&n| f64::from(n) * FRAC_PI_2 >= size).unwrap_or(4_u8);
        let quarters = size == f64::from(pieces) * FRAC_PI_2;
        let delta = 0.5 * size / f64::from(pieces);
        let shoulder = if quarters { FRAC_1_SQRT_2 } else { libm::cos(delta) };
        let turn = sweep.signum();
        let points = (0..=2 * pieces).map(|i| {
            let (sin, cos) = if quarters {
                EIGHTHS[usize::from(i % 8)]
            } else {
                libm::sincos(size * f64::from(i) / f64::from(2 * pieces))
            };
            (cos, turn * sin, if i % 2 == 0 { 1.0 } else { shoulder })
        });
        let mut knots = alloc::vec![0.0; 3];
        for i in 1..pieces {
            knots.extend([f64::from(i) / f64::from(pieces); 2]);
        }
        knots.extend([1.0; 3]);
        Ok(Self { knots: KnotVector::new(knots, 2)?, points: points.collect() })
    }
}

/// Sine and cosine of the multiples of π/4, correctly rounded.
const EIGHTHS: [(f64, f64); 8] = {
    const H: f64 = FRAC_1_SQRT_2;
    [(0.0, 1.0), (H, H), (1.0, 0.0), (H, -H), (0.0, -1.0), (-H, -H), (-1.0, 0.0), (-H, H)]
};
