//! Surfaces of revolution.

use alloc::vec::Vec;
use core::f64::consts::{FRAC_1_SQRT_2, TAU};

use glam::{DVec3, DVec4};

use super::curves::UnitArc;
use super::error::{not_negative, positive};
use super::frame::direction;
use super::{Frame, ShapeError};
use crate::nurbs::{Curve, KnotVector, Surface};

/// The profile turned round the axis through `point` along `axis` by `sweep` radians (counterclockwise seen from the
/// tip of the axis where positive; 2π is the full turn). u turns, from 0 to 1; v is the profile's parameter.
///
/// A profile that runs along the axis at a distance gives a normal S_u × S_v away from the axis. Where the profile meets
/// the axis the surface has a pole, a control row that is one point.
///
/// # Errors
/// If a coordinate is not finite, the axis has no direction, or |`sweep`| is zero or more than a full turn.
pub fn revolution(profile: &Curve, point: DVec3, axis: DVec3, sweep: f64) -> Result<Surface, ShapeError> {
    let z = direction("the axis", axis)?;
    if !point.is_finite() {
        return Err(ShapeError::NotFinite { what: "the point on the axis" });
    }
    let arc = UnitArc::new(sweep)?;
    // Of each homogeneous control point the part on the axis, the part across it, and that part turned by a right angle.
    let parts: Vec<(DVec3, DVec3, DVec3, f64)> = profile
        .homogeneous()
        .iter()
        .map(|h| {
            let from_point = h.truncate() - point * h.w;
            let mut across = from_point - z * from_point.dot(z);
            // Less than this is what the subtractions above leave of a point on the axis: each of their three stages
            // rounds by at most half an ulp of terms no larger than |h| + |point| w, in three coordinates.
            let rounding = 8.0 * f64::EPSILON * (h.truncate().length() + point.length() * h.w);
            if across.length() <= rounding {
                across = DVec3::ZERO;
            }
            (h.truncate() - across, across, z.cross(across), h.w)
        })
        .collect();
    let turn = |&(x, y, w): &(f64, f64, f64)| {
        parts.iter().map(move |&(on, across, turned, weight)| (on * w + across * x + turned * y).extend(weight * w))
    };
    let points = arc.points.iter().flat_map(turn).collect();
    Ok(Surface::from_homogeneous(arc.knots, profile.knots().clone(), points)?)
}

/// The sphere about the frame's origin, 9 × 5 control points, biquadratic. u is the longitude from the x axis; v runs from
/// the south pole (0) over the equator (½) to the north pole (1). Normal outwards.
///
/// # Errors
/// If the radius is not positive and finite.
pub fn sphere(frame: &Frame, radius: f64) -> Result<Surface, ShapeError> {
    let r = positive("the radius of the sphere", radius)?;
    const H: f64 = FRAC_1_SQRT_2;
    let meridian = [(0.0, -r, 1.0), (r * H, -r * H, H), (r, 0.0, 1.0), (r * H, r * H, H), (0.0, r, 1.0)];
    let knots = KnotVector::new([[0.0; 3].as_slice(), &[0.5; 2], &[1.0; 3]].concat(), 2)?;
    turned(frame, knots, &meridian)
}

/// The lateral surface of the cylinder of height `height` on the circle round the frame's origin. u goes round, v up.
/// Normal outwards.
///
/// # Errors
/// If radius or height is not positive and finite.
pub fn cylinder(frame: &Frame, radius: f64, height: f64) -> Result<Surface, ShapeError> {
    let r = positive("the radius of the cylinder", radius)?;
    let h = positive("the height of the cylinder", height)?;
    turned(frame, KnotVector::bezier(1, [0.0, 1.0])?, &[(r, 0.0, 1.0), (r, h, 1.0)])
}

/// The lateral surface of the cone or frustum with radius `bottom` at the frame's origin and `top` at the height
/// `height`; one of them may be zero, which gives a pole. u goes round, v up. Normal outwards.
///
/// # Errors
/// If a radius is negative or both are zero, or the height is not positive, or one is not finite.
pub fn cone(frame: &Frame, bottom: f64, top: f64, height: f64) -> Result<Surface, ShapeError> {
    let a = not_negative("the bottom radius of the cone", bottom)?;
    let b = not_negative("the top radius of the cone", top)?;
    let h = positive("the height of the cone", height)?;
    if a == 0.0 && b == 0.0 {
        return Err(ShapeError::Radii { first: a, second: b, remedy: "make one of them positive" });
    }
    turned(frame, KnotVector::bezier(1, [0.0, 1.0])?, &[(a, 0.0, 1.0), (b, h, 1.0)])
}

/// The torus round the frame's z axis: `major` is the radius of the circle of centres, `minor` that of the tube. 9 × 9
/// control points, biquadratic. u goes round the axis; v round the tube, from the outer equator (0) over the top (¼), the
/// inner equator (½) and the bottom (¾). Normal outwards. A tube wider than `major` passes through itself on the axis.
///
/// # Errors
/// If a radius is not positive and finite.
pub fn torus(frame: &Frame, major: f64, minor: f64) -> Result<Surface, ShapeError> {
    let major = positive("the major radius of the torus", major)?;
    let minor = positive("the minor radius of the torus", minor)?;
    let tube = UnitArc::new(TAU)?;
    let meridian: Vec<_> = tube.points.iter().map(|&(x, y, w)| (major * w + minor * x, minor * y, w)).collect();
    turned(frame, tube.knots, &meridian)
}

/// The disk of radius `radius` about the frame's origin. u goes round; v from the rim (0) to the centre (1), a pole. The
/// normal is the frame's z.
///
/// # Errors
/// If the radius is not positive and finite.
pub fn disk(frame: &Frame, radius: f64) -> Result<Surface, ShapeError> {
    annulus(frame, 0.0, radius)
}

/// The plane ring between two circles about the frame's origin. u goes round; v from the outer circle (0) to the inner
/// (1). The normal is the frame's z.
///
/// # Errors
/// If `inner` is negative, or not less than `outer`, or one is not finite.
pub fn annulus(frame: &Frame, inner: f64, outer: f64) -> Result<Surface, ShapeError> {
    let inner = not_negative("the inner radius", inner)?;
    let outer = positive("the outer radius", outer)?;
    if inner >= outer {
        return Err(ShapeError::Radii { first: inner, second: outer, remedy: "make the outer one larger" });
    }
    turned(frame, KnotVector::bezier(1, [0.0, 1.0])?, &[(outer, 0.0, 1.0), (inner, 0.0, 1.0)])
}

/// The full turn of a meridian with homogeneous control points (radius·w, height·w, w).
fn turned(frame: &Frame, knots_v: KnotVector, meridian: &[(f64, f64, f64)]) -> Result<Surface, ShapeError> {
    let arc = UnitArc::new(TAU)?;
    let column = |&(x, y, w): &(f64, f64, f64)| {
        meridian.iter().map(move |&(r, h, weight)| frame.place(DVec4::new(r * x, r * y, h * w, weight * w)))
    };
    let points = arc.points.iter().flat_map(column).collect();
    Ok(Surface::from_homogeneous(arc.knots, knots_v, points)?)
}
