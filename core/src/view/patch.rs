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

    /// Size of its rectangle of surface parameters.
    #[must_use]
    pub fn parameter_size(&self) -> DVec2 {
        DVec2::new(self.u[1] - self.u[0], self.v[1] - self.v[0])
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

/// Points of a row or column of control points, in fixed room that is not cleared first.
type Row = heapless::Vec<DVec4, { MAX_DEGREE + 1 }>;

/// Box of control points, which holds the patch: lower and upper corner.
pub(crate) fn net_box(points: &[DVec4]) -> (DVec3, DVec3) {
    points.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), h| {
        let e = h.truncate() / h.w;
        (lo.min(e), hi.max(e))
    })
}

/// Extent of control points along `n` from `origin`.
pub(crate) fn net_extent(points: &[DVec4], origin: DVec3, n: DVec3) -> [f64; 2] {
    points.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], h| {
        let d = (h.truncate() / h.w - origin).dot(n);
        [lo.min(d), hi.max(d)]
    })
}

/// Value and derivatives at (s, t) of the tensor Bézier patch of bidegree (p, q) with the control points `points`.
pub(crate) fn net_jet(points: &[DVec4], p: usize, q: usize, s: f64, t: f64) -> [DVec4; 3] {
    let (mut values, mut slopes) = (Row::new(), Row::new());
    for row in points.chunks_exact(q + 1).take(p + 1) {
        let (value, slope) = curve_jet(row, t);
        // A degree is at most MAX_DEGREE, so there is room.
        let _ = (values.push(value), slopes.push(slope));
    }
    let (h, hu) = curve_jet(&values, s);
    [h, hu, curve_point(&slopes, s)]
}

/// Splits the net of bidegree (p, q) at the middle of u or v: `net` becomes the lower half, `upper`, of the same length,
/// receives the other.
pub(crate) fn halve_net(net: &mut [DVec4], upper: &mut [DVec4], p: usize, q: usize, along_u: bool) {
    upper.copy_from_slice(net);
    let w = q + 1;
    if along_u {
        for r in (0..=p).rev() {
            let done = (p - r) * w;
            net[done..done + w].copy_from_slice(&upper[..w]);
            for k in 0..r * w {
                upper[k] = (upper[k] + upper[k + w]) * 0.5;
            }
        }
    } else {
        for (row, out) in upper.chunks_exact_mut(w).zip(net.chunks_exact_mut(w)) {
            for r in (0..w).rev() {
                out[q - r] = row[0];
                for k in 0..r {
                    row[k] = (row[k] + row[k + 1]) * 0.5;
                }
            }
        }
    }
}

fn between(a: DVec4, b: DVec4, t: f64) -> DVec4 {
    a + (b - a) * t
}

/// Value and derivative of the Bézier curve with control points `c` at `t`, by de Casteljau's corner cutting. Lines,
/// conics and cubics are written out: they are most of what is ever evaluated.
pub(crate) fn curve_jet(c: &[DVec4], t: f64) -> (DVec4, DVec4) {
    let (a, b) = match *c {
        [] => return (DVec4::ZERO, DVec4::ZERO),
        [a] => return (a, DVec4::ZERO),
        [a, b] => (a, b),
        [a, b, c] => (between(a, b, t), between(b, c, t)),
        [a, b, c, d] => {
            let m = between(b, c, t);
            (between(between(a, b, t), m, t), between(m, between(c, d, t), t))
        }
        _ => {
            let mut row: Row = c.iter().copied().collect();
            for r in (2..row.len()).rev() {
                for i in 0..r {
                    row[i] = between(row[i], row[i + 1], t);
                }
            }
            (row[0], row[1])
        }
    };
    let d = b - a;
    (a + d * t, d * (c.len() - 1) as f64)
}

/// Value of the Bézier curve with control points `c` at `t`.
pub(crate) fn curve_point(c: &[DVec4], t: f64) -> DVec4 {
    curve_jet(c, t).0
}
