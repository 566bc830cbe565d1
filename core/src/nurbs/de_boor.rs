//! Evaluation: the de Boor algorithm on the control points of one span.
//!
//! With k the span, level r of the triangle replaces dᵢ, i = k − p + r … k, by (1 − α) dᵢ₋₁ + α dᵢ,
//! α = (aᵣ − tᵢ) / (tᵢ₊ₚ₊₁₋ᵣ − tᵢ). With all aᵣ = t that is the point at t; with other arguments it is the blossom
//! f(a₁, …, aₚ) of the span's polynomial. While the arguments are in [tₖ, tₖ₊₁], every α is in [0, 1], and every
//! denominator is at least tₖ₊₁ − tₖ > 0.
//! Source: Piegl and Tiller, *The NURBS Book*, 2nd ed., section 5.2; Ramshaw 1989, *Blossoms are polar forms*, CAGD 6.

use core::array;

use glam::{DVec3, DVec4};

use super::KnotVector;
use crate::view::MAX_DEGREE;

/// The control points of one span.
pub(super) type Scratch = [DVec4; MAX_DEGREE + 1];

/// The control points `get(k − p) … get(k)` of span `k`.
pub(super) fn gather(degree: usize, k: usize, get: impl Fn(usize) -> DVec4) -> Scratch {
    array::from_fn(|j| if j <= degree { get(k - degree + j) } else { DVec4::ZERO })
}

/// One level of the triangle: level `r` (1 … p), argument `a`.
fn level(knots: &KnotVector, k: usize, d: &mut Scratch, r: usize, a: f64) {
    let (t, p) = (knots.as_slice(), knots.degree());
    for j in (r..=p).rev() {
        let i = k - p + j;
        let alpha = (a - t[i]) / (t[i + p + 1 - r] - t[i]);
        // In this form equal points stay equal, and α = 0 or 1 gives an end exactly.
        d[j] = d[j - 1] * (1.0 - alpha) + d[j] * alpha;
    }
}

/// The blossom of the span's polynomial at the arguments `argument(1) … argument(p)`.
pub(super) fn blossom(knots: &KnotVector, k: usize, mut d: Scratch, argument: impl Fn(usize) -> f64) -> DVec4 {
    let p = knots.degree();
    for r in 1..=p {
        level(knots, k, &mut d, r, argument(r));
    }
    d[p]
}

/// The homogeneous point at `t` in span `k`.
pub(super) fn point(knots: &KnotVector, k: usize, d: Scratch, t: f64) -> DVec4 {
    blossom(knots, k, d, |_| t)
}

/// The homogeneous point at `t` in span `k` and its first two derivatives.
///
/// The derivatives are read from the triangle before its last two levels, whose points are the blossom values
/// f(t, …, t, ·, ·).
pub(super) fn jet(knots: &KnotVector, k: usize, mut d: Scratch, t: f64) -> [DVec4; 3] {
    let (kn, p) = (knots.as_slice(), knots.degree());
    let width = kn[k + 1] - kn[k];
    for r in 1..p.saturating_sub(1) {
        level(knots, k, &mut d, r, t);
    }
    let mut second = DVec4::ZERO;
    if p >= 2 {
        let g0 = (d[p - 1] - d[p - 2]) / (kn[k + 1] - kn[k - 1]);
        let g1 = (d[p] - d[p - 1]) / (kn[k + 2] - kn[k]);
        second = (g1 - g0) * ((p * (p - 1)) as f64 / width);
        level(knots, k, &mut d, p - 1, t);
    }
    let first = (d[p] - d[p - 1]) * (p as f64 / width);
    level(knots, k, &mut d, p, t);
    [d[p], first, second]
}

/// Point and two derivatives in space from their homogeneous counterparts (quotient rule, The NURBS Book eq. 4.8).
pub(super) fn project([h, h1, h2]: [DVec4; 3]) -> [DVec3; 3] {
    let s = h.truncate() / h.w;
    let s1 = (h1.truncate() - s * h1.w) / h.w;
    let s2 = (h2.truncate() - s1 * (2.0 * h1.w) - s * h2.w) / h.w;
    [s, s1, s2]
}
