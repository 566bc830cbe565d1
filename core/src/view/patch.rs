//! One polynomial piece of a surface, in homogeneous view coordinates.

use alloc::vec::Vec;

use glam::{DVec2, DVec3, DVec4};

use crate::bernstein::Bivariate;

/// Highest degree of a surface or curve in one parameter. CAD systems stay below it; fixed scratch is sized by it.
pub const MAX_DEGREE: usize = 9;

/// A rational Bézier patch in view space: the piece of one surface between neighbouring knots.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    /// Index of the surface in the scene.
    pub surface: usize,
    /// Degree in u.
    pub degree_u: usize,
    /// Degree in v.
    pub degree_v: usize,
    /// Homogeneous control points (X, Y, Z, W), W > 0, index `i * (degree_v + 1) + j`.
    pub points: Vec<DVec4>,
    /// The interval of the surface's parameter u that local 0..1 stands for.
    pub u: [f64; 2],
    /// The interval of the surface's parameter v that local 0..1 stands for.
    pub v: [f64; 2],
}

/// Position and first derivatives of a patch at one point, in view space (not homogeneous), by local parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet {
    /// Position.
    pub p: DVec3,
    /// Derivative by the local u.
    pub du: DVec3,
    /// Derivative by the local v.
    pub dv: DVec3,
}

impl Jet {
    /// The normal du × dv, not normalised; its z is positive where the parameters turn counterclockwise on the screen.
    #[must_use]
    pub fn normal(&self) -> DVec3 {
        self.du.cross(self.dv)
    }
}

impl Patch {
    /// Surface parameters of the local point (s, t).
    #[must_use]
    pub fn to_surface(&self, s: f64, t: f64) -> DVec2 {
        DVec2::new(self.u[0] + s * (self.u[1] - self.u[0]), self.v[0] + t * (self.v[1] - self.v[0]))
    }

    /// Local parameters of the surface point `uv`; outside [0, 1] where the patch does not hold it.
    #[must_use]
    pub fn to_local(&self, uv: DVec2) -> DVec2 {
        DVec2::new((uv.x - self.u[0]) / (self.u[1] - self.u[0]), (uv.y - self.v[0]) / (self.v[1] - self.v[0]))
    }

    /// One homogeneous coordinate (0 = X … 3 = W) as a tensor Bernstein polynomial.
    #[must_use]
    pub fn coordinate(&self, k: usize) -> Bivariate {
        let w = self.degree_v + 1;
        Bivariate::from_fn(self.degree_u, self.degree_v, |i, j| self.points[i * w + j][k])
    }

    /// Whether every weight is the same to rounding, so that the patch is polynomial.
    #[must_use]
    pub fn is_polynomial(&self) -> bool {
        let w = self.points[0].w;
        self.points.iter().all(|p| (p.w - w).abs() <= 1e-15 * w)
    }

    /// Position at local (s, t), view space.
    #[must_use]
    pub fn eval(&self, s: f64, t: f64) -> DVec3 {
        let h = self.homogeneous_jet(s, t)[0];
        h.truncate() / h.w
    }

    /// Position and first derivatives at local (s, t). About 4·p·q multiplications, no allocation.
    #[must_use]
    pub fn jet(&self, s: f64, t: f64) -> Jet {
        let [h, hu, hv] = self.homogeneous_jet(s, t);
        let p = h.truncate() / h.w;
        Jet { p, du: (hu.truncate() - p * hu.w) / h.w, dv: (hv.truncate() - p * hv.w) / h.w }
    }

    /// Homogeneous position and its two local derivatives.
    #[must_use]
    pub fn homogeneous_jet(&self, s: f64, t: f64) -> [DVec4; 3] {
        net_jet(&self.points, self.degree_u, self.degree_v, s, t)
    }
}

/// Value and derivatives at (s, t) of the tensor Bézier patch of bidegree (p, q) with the control points `points`.
pub(crate) fn net_jet(points: &[DVec4], p: usize, q: usize, s: f64, t: f64) -> [DVec4; 3] {
    let w = q + 1;
    let mut row = [DVec4::ZERO; MAX_DEGREE + 1];
    let mut values = [DVec4::ZERO; MAX_DEGREE + 1];
    let mut slopes = [DVec4::ZERO; MAX_DEGREE + 1];
    for i in 0..=p {
        row[..w].copy_from_slice(&points[i * w..(i + 1) * w]);
        (values[i], slopes[i]) = curve_jet(&mut row[..w], t);
    }
    let hv = curve_point(&mut slopes[..=p], s);
    let (h, hu) = curve_jet(&mut values[..=p], s);
    [h, hu, hv]
}

/// Value and derivative of the Bézier curve with control points `c` (overwritten) at `t`.
pub(crate) fn curve_jet(c: &mut [DVec4], t: f64) -> (DVec4, DVec4) {
    let n = c.len() - 1;
    if n == 0 {
        return (c[0], DVec4::ZERO);
    }
    for r in (2..=n).rev() {
        for i in 0..r {
            c[i] = c[i] + (c[i + 1] - c[i]) * t;
        }
    }
    let d = c[1] - c[0];
    (c[0] + d * t, d * n as f64)
}

/// Value of the Bézier curve with control points `c` (overwritten) at `t`.
pub(crate) fn curve_point(c: &mut [DVec4], t: f64) -> DVec4 {
    for r in (1..c.len()).rev() {
        for i in 0..r {
            c[i] = c[i] + (c[i + 1] - c[i]) * t;
        }
    }
    c[0]
}
