//! Planes, ruled surfaces, extrusions.

use glam::DVec3;

use super::ShapeError;
use super::frame::direction;
use crate::nurbs::{Curve, KnotVector, Surface};

/// The parallelogram `origin` + u · `along_u` + v · `along_v`, u and v from 0 to 1, degree 1 × 1.
///
/// # Errors
/// If a coordinate is not finite, a vector has no length, or the two are parallel.
pub fn plane(origin: DVec3, along_u: DVec3, along_v: DVec3) -> Result<Surface, ShapeError> {
    let (u, v) = (direction("the plane's u direction", along_u)?, direction("the plane's v direction", along_v)?);
    // Only what rounding cannot tell from a line is refused: a sliver is a surface.
    if u.cross(v).length() <= 4.0 * f64::EPSILON {
        return Err(ShapeError::Parallel { what: "the plane's directions" });
    }
    let knots = KnotVector::bezier(1, [0.0, 1.0])?;
    let corners = [origin, origin + along_v, origin + along_u, origin + along_u + along_v];
    Ok(Surface::new(knots.clone(), knots, corners.map(|p| p.extend(1.0)).to_vec())?)
}

/// The surface of the straight lines between points of equal parameter on `a` (v = 0) and `b` (v = 1). u runs over the
/// domain of `a`, to which that of `b` is stretched; its degree is the higher of the two, its knots those of both.
///
/// # Errors
/// If the knots cannot be united (see [`Curve::compatible`]).
pub fn ruled(a: &Curve, b: &Curve) -> Result<Surface, ShapeError> {
    let (a, b) = a.compatible(b)?;
    let points = a.homogeneous().iter().zip(b.homogeneous()).flat_map(|(&p, &q)| [p, q]).collect();
    Ok(Surface::from_homogeneous(a.knots().clone(), KnotVector::bezier(1, [0.0, 1.0])?, points)?)
}

/// The profile moved along `vector`: u is the profile's parameter, v runs from 0 (the profile) to 1.
///
/// # Errors
/// If the vector is zero or not finite.
pub fn extrusion(profile: &Curve, vector: DVec3) -> Result<Surface, ShapeError> {
    direction("the extrusion", vector)?;
    let points = profile.homogeneous().iter().flat_map(|&h| [h, h + (vector * h.w).extend(0.0)]).collect();
    Ok(Surface::from_homogeneous(profile.knots().clone(), KnotVector::bezier(1, [0.0, 1.0])?, points)?)
}
