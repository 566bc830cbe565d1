//! Rational B-spline curves in space.

use alloc::vec::Vec;

use glam::{DMat4, DVec3, DVec4};

use super::de_boor::{self, gather};
use super::refine::Strip;
use super::{KnotVector, NurbsError};
use crate::view::MAX_DEGREE;

/// A rational B-spline curve in space.
///
/// Parameters outside the domain mean the nearer end of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    knots: KnotVector,
    points: Vec<DVec4>,
}

/// One polynomial piece of a curve, between neighbouring knots.
#[derive(Clone, Debug, PartialEq)]
pub struct BezierSegment {
    /// The interval of the curve's parameter that local 0..1 stands for.
    pub interval: [f64; 2],
    /// The p + 1 homogeneous control points (x·w, y·w, z·w, w).
    pub points: Vec<DVec4>,
}

impl Curve {
    /// The curve with these control points (x, y, z, weight), coordinates *not* multiplied by the weight.
    ///
    /// # Errors
    /// If the number of points is not [`KnotVector::control_count`], a coordinate is not finite, or a weight not positive.
    pub fn new(knots: KnotVector, points: Vec<DVec4>) -> Result<Self, NurbsError> {
        let points = premultiplied(points, knots.control_count())?;
        Ok(Self { knots, points })
    }

    /// As [`new`](Self::new), of control points that are homogeneous already: (x·w, y·w, z·w, w).
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn from_homogeneous(knots: KnotVector, points: Vec<DVec4>) -> Result<Self, NurbsError> {
        check_homogeneous(&points, knots.control_count())?;
        Ok(Self { knots, points })
    }

    /// The knot vector.
    #[must_use]
    pub fn knots(&self) -> &KnotVector {
        &self.knots
    }

    /// The degree p.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.knots.degree()
    }

    /// The parameter interval.
    #[must_use]
    pub fn domain(&self) -> [f64; 2] {
        self.knots.domain()
    }

    /// The homogeneous control points (x·w, y·w, z·w, w).
    #[must_use]
    pub fn homogeneous(&self) -> &[DVec4] {
        &self.points
    }

    /// The point at `t`. O(p²), no allocation.
    #[must_use]
    pub fn eval(&self, t: f64) -> DVec3 {
        let t = self.knots.clamp(t);
        let k = self.knots.span(t);
        let h = de_boor::point(&self.knots, k, gather(self.degree(), k, |i| self.points[i]), t);
        h.truncate() / h.w
    }

    /// The first derivative at `t`; at a knot the one from the right, at the end of the domain the one from the left.
    #[must_use]
    pub fn derivative(&self, t: f64) -> DVec3 {
        self.derivatives(t)[1]
    }

    /// The point and the first and second derivative at `t`, one-sided at knots as [`derivative`](Self::derivative).
    #[must_use]
    pub fn derivatives(&self, t: f64) -> [DVec3; 3] {
        self.derivatives_from(t, false)
    }

    /// As [`derivatives`](Self::derivatives), at a knot with those from `below` if that is asked for.
    #[must_use]
    pub fn derivatives_from(&self, t: f64, below: bool) -> [DVec3; 3] {
        let t = self.knots.clamp(t);
        let k = self.knots.span_from(t, below);
        de_boor::project(de_boor::jet(&self.knots, k, gather(self.degree(), k, |i| self.points[i]), t))
    }

    /// The same curve with the knot `t` inserted `times` times.
    ///
    /// # Errors
    /// If `t` is not strictly inside the domain, or would be repeated more than p times.
    pub fn insert_knot(&self, t: f64, times: usize) -> Result<Self, NurbsError> {
        check_insertion(&self.knots, t, times)?;
        let mut strip = self.strip();
        for _ in 0..times {
            strip.insert(t);
        }
        Ok(strip.into())
    }

    /// The same curve, with the same continuity, written with degree `degree`, clamped; unchanged where `degree` is not
    /// higher than now.
    ///
    /// # Errors
    /// If `degree` is higher than [`MAX_DEGREE`].
    pub fn elevated(&self, degree: usize) -> Result<Self, NurbsError> {
        check_degree(degree)?;
        Ok(self.strip().raised(degree).into())
    }

    /// The same curve with its ends at control points and no knots beyond them.
    #[must_use]
    pub fn clamped(&self) -> Self {
        self.strip().clamped().into()
    }

    /// The parts before and after `t`, both clamped, with the parameters of the whole.
    ///
    /// # Errors
    /// If `t` is not strictly inside the domain.
    pub fn split(&self, t: f64) -> Result<(Self, Self), NurbsError> {
        self.knots.check_inside(t)?;
        let (a, b) = self.strip().split(t);
        Ok((a.into(), b.into()))
    }

    /// The Bézier pieces in order of the parameter. Neighbours share their common end bit for bit.
    #[must_use]
    pub fn bezier_segments(&self) -> Vec<BezierSegment> {
        let pieces = self.strip().bezier();
        pieces.into_iter().map(|(interval, points)| BezierSegment { interval, points }).collect()
    }

    /// The curve run backwards on the same domain [a, b]: what was at t is at a + b − t.
    #[must_use]
    pub fn reversed(&self) -> Self {
        self.strip().reversed().into()
    }

    /// The curve with its parameter stretched affinely to the domain [a, b].
    ///
    /// # Errors
    /// If a < b does not hold, or the new knots are not finite or fall together.
    pub fn reparametrized(&self, domain: [f64; 2]) -> Result<Self, NurbsError> {
        Ok(Self { knots: self.knots.stretched(domain)?, points: self.points.clone() })
    }

    /// The image under a projective map of homogeneous coordinates.
    ///
    /// # Errors
    /// If a control point gets a weight that is not positive, or a coordinate that is not finite.
    pub fn transformed(&self, map: DMat4) -> Result<Self, NurbsError> {
        Ok(Self { knots: self.knots.clone(), points: mapped(&self.points, map)? })
    }

    /// The two curves on the same domain with the same degree and knots, clamped, so that their control points
    /// correspond. The domain is that of `self`, to which the other is stretched affinely; a knot of the other that then
    /// misses one of `self` by no more than the rounding of the stretch is taken to be the same.
    ///
    /// # Errors
    /// If knots of the other curve are so close that they fall together when stretched.
    pub fn compatible(&self, other: &Self) -> Result<(Self, Self), NurbsError> {
        let degree = self.degree().max(other.degree());
        let (mut a, mut b) = (self.strip().clamped().raised(degree), other.strip().clamped().raised(degree));
        b.knots = b.knots.stretched(a.knots.domain())?.snapped_to(&a.knots)?;
        let (of_a, of_b) = (a.knots.clone(), b.knots.clone());
        a.unite(&of_b);
        b.unite(&of_a);
        Ok((a.into(), b.into()))
    }

    pub(super) fn trusted(knots: KnotVector, points: Vec<DVec4>) -> Self {
        Self { knots, points }
    }

    fn strip(&self) -> Strip {
        Strip { knots: self.knots.clone(), points: self.points.clone(), width: 1 }
    }
}

impl From<Strip> for Curve {
    fn from(strip: Strip) -> Self {
        Self { knots: strip.knots, points: strip.points }
    }
}

/// Checks control points (x, y, z, weight) and multiplies the weights in.
pub(super) fn premultiplied(mut points: Vec<DVec4>, expected: usize) -> Result<Vec<DVec4>, NurbsError> {
    if points.len() != expected {
        return Err(NurbsError::PointCount { count: points.len(), expected });
    }
    for (index, p) in points.iter_mut().enumerate() {
        let weight = p.w;
        if !(weight > 0.0 && weight.is_finite()) {
            return Err(NurbsError::Weight { index, weight });
        }
        *p = (p.truncate() * weight).extend(weight);
        if !p.is_finite() {
            return Err(NurbsError::PointNotFinite { index });
        }
    }
    Ok(points)
}

/// Checks control points (x·w, y·w, z·w, w).
pub(super) fn check_homogeneous(points: &[DVec4], expected: usize) -> Result<(), NurbsError> {
    if points.len() != expected {
        return Err(NurbsError::PointCount { count: points.len(), expected });
    }
    for (index, p) in points.iter().enumerate() {
        if !(p.w > 0.0 && p.w.is_finite()) {
            return Err(NurbsError::Weight { index, weight: p.w });
        }
        if !p.is_finite() {
            return Err(NurbsError::PointNotFinite { index });
        }
    }
    Ok(())
}

/// Homogeneous control points under a projective map.
pub(super) fn mapped(points: &[DVec4], map: DMat4) -> Result<Vec<DVec4>, NurbsError> {
    let image = |(index, &p)| {
        let q: DVec4 = map * p;
        if !q.is_finite() {
            Err(NurbsError::PointNotFinite { index })
        } else if q.w <= 0.0 {
            Err(NurbsError::Projection { index, weight: q.w })
        } else {
            Ok(q)
        }
    };
    points.iter().enumerate().map(image).collect()
}

pub(super) fn check_degree(degree: usize) -> Result<(), NurbsError> {
    if degree > MAX_DEGREE { Err(NurbsError::Degree { degree, max: MAX_DEGREE }) } else { Ok(()) }
}

pub(super) fn check_insertion(knots: &KnotVector, t: f64, times: usize) -> Result<(), NurbsError> {
    knots.check_inside(t)?;
    let multiplicity = knots.multiplicity(t).saturating_add(times);
    let most = knots.degree();
    if multiplicity > most { Err(NurbsError::InsertsTooMany { value: t, multiplicity, most }) } else { Ok(()) }
}
