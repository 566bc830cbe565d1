//! Rational B-spline surfaces.

use alloc::vec::Vec;
use core::array;

use glam::{DMat4, DVec3, DVec4};

use super::curve::{check_degree, check_homogeneous, check_insertion, mapped, premultiplied};
use super::de_boor::{self, Scratch, gather};
use super::refine::Strip;
use super::{Curve, KnotVector, NurbsError};
use crate::view::{MAX_DEGREE, Patch};

/// A rational B-spline surface. Its positive side is that of the normal S_u × S_v.
///
/// Parameters outside the domain mean the nearest point of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {
    knots_u: KnotVector,
    knots_v: KnotVector,
    points: Vec<DVec4>,
}

/// Position and derivatives up to second order of a surface at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceJet {
    /// Position.
    pub p: DVec3,
    /// Derivative by u.
    pub du: DVec3,
    /// Derivative by v.
    pub dv: DVec3,
    /// Second derivative by u.
    pub duu: DVec3,
    /// Mixed second derivative.
    pub duv: DVec3,
    /// Second derivative by v.
    pub dvv: DVec3,
}

impl Surface {
    /// The surface with these control points (x, y, z, weight), coordinates *not* multiplied by the weight, index
    /// `iu * nv + iv`, where nv is the control count of `knots_v`.
    ///
    /// # Errors
    /// If the number of points is not the product of the control counts, a coordinate is not finite, or a weight not
    /// positive.
    pub fn new(knots_u: KnotVector, knots_v: KnotVector, points: Vec<DVec4>) -> Result<Self, NurbsError> {
        let points = premultiplied(points, knots_u.control_count() * knots_v.control_count())?;
        Ok(Self { knots_u, knots_v, points })
    }

    /// As [`new`](Self::new), of control points that are homogeneous already: (x·w, y·w, z·w, w).
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn from_homogeneous(knots_u: KnotVector, knots_v: KnotVector, points: Vec<DVec4>) -> Result<Self, NurbsError> {
        check_homogeneous(&points, knots_u.control_count() * knots_v.control_count())?;
        Ok(Self { knots_u, knots_v, points })
    }

    /// The knot vector in u.
    #[must_use]
    pub fn knots_u(&self) -> &KnotVector {
        &self.knots_u
    }

    /// The knot vector in v.
    #[must_use]
    pub fn knots_v(&self) -> &KnotVector {
        &self.knots_v
    }

    /// The degree in u.
    #[must_use]
    pub fn degree_u(&self) -> usize {
        self.knots_u.degree()
    }

    /// The degree in v.
    #[must_use]
    pub fn degree_v(&self) -> usize {
        self.knots_v.degree()
    }

    /// The parameter interval of u.
    #[must_use]
    pub fn domain_u(&self) -> [f64; 2] {
        self.knots_u.domain()
    }

    /// The parameter interval of v.
    #[must_use]
    pub fn domain_v(&self) -> [f64; 2] {
        self.knots_v.domain()
    }

    /// The homogeneous control points (x·w, y·w, z·w, w), index `iu * nv + iv`.
    #[must_use]
    pub fn homogeneous(&self) -> &[DVec4] {
        &self.points
    }

    /// Control points of the v-curve over control row `iu`, in span `kv`.
    fn row(&self, iu: usize, kv: usize) -> Scratch {
        let nv = self.knots_v.control_count();
        gather(self.degree_v(), kv, |iv| self.points[iu * nv + iv])
    }

    /// The point at (u, v). O(p·q²), no allocation.
    #[must_use]
    pub fn eval(&self, u: f64, v: f64) -> DVec3 {
        let (u, v) = (self.knots_u.clamp(u), self.knots_v.clamp(v));
        let (ku, kv) = (self.knots_u.span(u), self.knots_v.span(v));
        let column = gather(self.degree_u(), ku, |iu| de_boor::point(&self.knots_v, kv, self.row(iu, kv), v));
        let h = de_boor::point(&self.knots_u, ku, column, u);
        h.truncate() / h.w
    }

    /// The point and its derivatives by u and by v. At a knot the derivatives are those from the right, at the end of
    /// the domain those from the left.
    #[must_use]
    pub fn derivatives(&self, u: f64, v: f64) -> (DVec3, DVec3, DVec3) {
        let j = self.jet(u, v);
        (j.p, j.du, j.dv)
    }

    /// The point and its derivatives up to second order, one-sided at knots as [`derivatives`](Self::derivatives). No
    /// allocation.
    #[must_use]
    pub fn jet(&self, u: f64, v: f64) -> SurfaceJet {
        self.jet_from(u, v, [false; 2])
    }

    /// As [`jet`](Self::jet), at a knot of u or v with the derivatives from `below` where that is asked for.
    #[must_use]
    pub fn jet_from(&self, u: f64, v: f64, below: [bool; 2]) -> SurfaceJet {
        let (u, v) = (self.knots_u.clamp(u), self.knots_v.clamp(v));
        let (p, ku, kv) = (self.degree_u(), self.knots_u.span_from(u, below[0]), self.knots_v.span_from(v, below[1]));
        let mut columns: [Scratch; 3] = array::from_fn(|_| [DVec4::ZERO; MAX_DEGREE + 1]);
        for j in 0..=p {
            let jet = de_boor::jet(&self.knots_v, kv, self.row(ku - p + j, kv), v);
            for (column, value) in columns.iter_mut().zip(jet) {
                column[j] = value;
            }
        }
        let [values, slopes, curvatures] = columns;
        let [h, hu, huu] = de_boor::jet(&self.knots_u, ku, values, u);
        let [hv, huv, _] = de_boor::jet(&self.knots_u, ku, slopes, u);
        let hvv = de_boor::point(&self.knots_u, ku, curvatures, u);
        let [p, du, duu] = de_boor::project([h, hu, huu]);
        let [_, dv, dvv] = de_boor::project([h, hv, hvv]);
        // The NURBS Book, eq. 4.20.
        let duv = (huv.truncate() - dv * hu.w - du * hv.w - p * huv.w) / h.w;
        SurfaceJet { p, du, dv, duu, duv, dvv }
    }

    /// The same surface with the knot `u` inserted `times` times.
    ///
    /// # Errors
    /// If `u` is not strictly inside the domain, or would be repeated more often than the degree.
    pub fn insert_knot_u(&self, u: f64, times: usize) -> Result<Self, NurbsError> {
        check_insertion(&self.knots_u, u, times)?;
        let mut strip = self.strip();
        for _ in 0..times {
            strip.insert(u);
        }
        Ok(self.with_strip(strip))
    }

    /// The same surface with the knot `v` inserted `times` times.
    ///
    /// # Errors
    /// If `v` is not strictly inside the domain, or would be repeated more often than the degree.
    pub fn insert_knot_v(&self, v: f64, times: usize) -> Result<Self, NurbsError> {
        Ok(self.transposed().insert_knot_u(v, times)?.transposed())
    }

    /// The same surface, with the same continuity, written with degrees (`degree_u`, `degree_v`); a degree that is not
    /// higher than now stays, and one that is raised leaves that direction clamped.
    ///
    /// # Errors
    /// If a degree is higher than [`MAX_DEGREE`].
    pub fn elevated(&self, degree_u: usize, degree_v: usize) -> Result<Self, NurbsError> {
        check_degree(degree_u.max(degree_v))?;
        let across = self.with_strip(self.strip().raised(degree_u)).transposed();
        Ok(across.with_strip(across.strip().raised(degree_v)).transposed())
    }

    /// The same surface with its edges at control rows and no knots beyond them.
    #[must_use]
    pub fn clamped(&self) -> Self {
        let across = self.with_strip(self.strip().clamped()).transposed();
        across.with_strip(across.strip().clamped()).transposed()
    }

    /// The parts before and after `u`, clamped in u, with the parameters of the whole.
    ///
    /// # Errors
    /// If `u` is not strictly inside the domain.
    pub fn split_u(&self, u: f64) -> Result<(Self, Self), NurbsError> {
        self.knots_u.check_inside(u)?;
        let (a, b) = self.strip().split(u);
        Ok((self.with_strip(a), self.with_strip(b)))
    }

    /// The parts before and after `v`, clamped in v, with the parameters of the whole.
    ///
    /// # Errors
    /// If `v` is not strictly inside the domain.
    pub fn split_v(&self, v: f64) -> Result<(Self, Self), NurbsError> {
        let (a, b) = self.transposed().split_u(v)?;
        Ok((a.transposed(), b.transposed()))
    }

    /// u run backwards on the same domain [a, b]: what was at u is at a + b − u. The normal changes side.
    #[must_use]
    pub fn reversed_u(&self) -> Self {
        self.with_strip(self.strip().reversed())
    }

    /// v run backwards on the same domain. The normal changes side.
    #[must_use]
    pub fn reversed_v(&self) -> Self {
        self.transposed().reversed_u().transposed()
    }

    /// u and v exchanged. The normal changes side.
    #[must_use]
    pub fn transposed(&self) -> Self {
        let (nu, nv) = (self.knots_u.control_count(), self.knots_v.control_count());
        let points = (0..nv).flat_map(|iv| (0..nu).map(move |iu| self.points[iu * nv + iv])).collect();
        Self { knots_u: self.knots_v.clone(), knots_v: self.knots_u.clone(), points }
    }

    /// The image under a projective map of homogeneous coordinates.
    ///
    /// # Errors
    /// If a control point gets a weight that is not positive, or a coordinate that is not finite.
    pub fn transformed(&self, map: DMat4) -> Result<Self, NurbsError> {
        Ok(Self { points: mapped(&self.points, map)?, ..self.clone() })
    }

    /// The Bézier patches, in the surface's own space: all v-spans of the first u-span, then those of the next.
    /// Neighbours share the control points of their common edge bit for bit. `surface_index` is handed on in
    /// [`Patch::surface`].
    #[must_use]
    pub fn bezier_patches(&self, surface_index: usize) -> Vec<Patch> {
        let (p, q) = (self.degree_u(), self.degree_v());
        let mut patches = Vec::new();
        for (u, rows) in self.strip().bezier() {
            // The p + 1 rows of this u-span, transposed: strips that run in v.
            let nv = self.knots_v.control_count();
            let points = (0..nv).flat_map(|iv| rows.iter().skip(iv).step_by(nv).copied()).collect();
            let across = Strip { knots: self.knots_v.clone(), points, width: p + 1 };
            for (v, columns) in across.bezier() {
                let mut points = Vec::with_capacity((p + 1) * (q + 1));
                points.extend((0..=p).flat_map(|i| columns.iter().skip(i).step_by(p + 1).copied()));
                patches.push(Patch { surface: surface_index, degree_u: p, degree_v: q, points, u, v });
            }
        }
        patches
    }

    /// The curve at constant u, exact; its parameter is v.
    #[must_use]
    pub fn isocurve_u(&self, u: f64) -> Curve {
        Curve::trusted(self.knots_v.clone(), self.strip().at(u))
    }

    /// The curve at constant v, exact; its parameter is u.
    #[must_use]
    pub fn isocurve_v(&self, v: f64) -> Curve {
        self.transposed().isocurve_u(v)
    }

    /// Rows of constant iu.
    fn strip(&self) -> Strip {
        Strip { knots: self.knots_u.clone(), points: self.points.clone(), width: self.knots_v.control_count() }
    }

    fn with_strip(&self, strip: Strip) -> Self {
        Self { knots_u: strip.knots, knots_v: self.knots_v.clone(), points: strip.points }
    }
}
