//! Planes: surfaces that are affine in their parameters. There the pull-back is an affine map of control points.

use alloc::vec::Vec;

use glam::{DVec2, DVec3, DVec4};

use super::sheet::Sheet;
use crate::nurbs::{Curve, KnotVector, NurbsError};

/// The plane p(u, v) = origin + (u − u₀)·along_u + (v − v₀)·along_v.
#[derive(Clone, Copy, Debug)]
pub(super) struct Affine {
    origin: DVec3,
    /// (u₀, v₀).
    start: DVec2,
    along: [DVec3; 2],
    /// Vectors whose products with a difference from the origin are u and v.
    dual: [DVec3; 2],
}

impl Affine {
    /// The plane that the surface is, if its control points are those of an affine function: equal weights, and each at the
    /// image of its Greville abscissae (means of p successive knots; B-splines reproduce linear functions so).
    pub(super) fn of(sheet: &Sheet<'_>) -> Option<Self> {
        let s = sheet.surface;
        let points = s.homogeneous();
        let weight = points[0].w;
        if points.iter().any(|h| (h.w - weight).abs() > 4.0 * f64::EPSILON * weight) {
            return None;
        }
        let (u, v) = (greville(s.knots_u()), greville(s.knots_v()));
        let (nu, nv) = (u.len(), v.len());
        let at = |i: usize, j: usize| points[i * nv + j].truncate() / points[i * nv + j].w;
        let along_u = (at(nu - 1, 0) - at(0, 0)) / (u[nu - 1] - u[0]);
        let along_v = (at(0, nv - 1) - at(0, 0)) / (v[nv - 1] - v[0]);
        let image = |i: usize, j: usize| at(0, 0) + along_u * (u[i] - u[0]) + along_v * (v[j] - v[0]);
        let is_image = |k: usize| (image(k / nv, k % nv) - at(k / nv, k % nv)).length() <= sheet.rounding;
        if !(0..points.len()).all(is_image) {
            return None;
        }
        let [a, b, c] = [along_u.length_squared(), along_u.dot(along_v), along_v.length_squared()];
        let determinant = a * c - b * b;
        // What is no wider than rounding is a line.
        if determinant <= 1e-20 * a * c {
            return None;
        }
        let dual = [(along_u * c - along_v * b) / determinant, (along_v * a - along_u * b) / determinant];
        Some(Self { origin: at(0, 0), start: DVec2::new(u[0], v[0]), along: [along_u, along_v], dual })
    }

    pub(super) fn foot(&self, p: DVec3) -> DVec2 {
        self.start + DVec2::from(self.dual.map(|d| (p - self.origin).dot(d)))
    }

    pub(super) fn eval(&self, uv: DVec2) -> DVec3 {
        let d = uv - self.start;
        self.origin + self.along[0] * d.x + self.along[1] * d.y
    }

    /// The image of a curve, exact, and the largest distance of its control points, so of the curve, from the plane.
    pub(super) fn image(&self, curve: &Curve) -> Result<(Curve, f64), NurbsError> {
        let mut off = 0.0_f64;
        let place = |h: &DVec4| {
            let p = h.truncate() / h.w;
            let uv = self.foot(p);
            off = off.max((self.eval(uv) - p).length());
            (uv * h.w).extend(0.0).extend(h.w)
        };
        let points = curve.homogeneous().iter().map(place).collect();
        Ok((Curve::from_homogeneous(curve.knots().clone(), points)?, off))
    }
}

/// The parameter at which each control point of the function t ↦ t stands.
fn greville(knots: &KnotVector) -> Vec<f64> {
    let p = knots.degree();
    let mean = |w: &[f64]| w.iter().sum::<f64>() / p as f64;
    knots.as_slice()[1..].windows(p).take(knots.control_count()).map(mean).collect()
}
