//! Polynomials in Bernstein form on the unit interval and the unit square.
//!
//! The coefficients bound the polynomial (convex hull), the bound tightens quadratically under subdivision, and signs
//! of coefficients are certificates: all of one sign, no zero. Everything that `penvis` proves it proves with them.
//! Source of the arithmetic: Farouki and Rajan 1988, *Algorithms for polynomials in Bernstein form*, CAGD 5.

use alloc::vec;
use alloc::vec::Vec;
use core::ops::{Add, Mul};

mod bivariate;
mod interval;
mod piecewise;
mod roots;
mod univariate;

pub use bivariate::Bivariate;
pub(crate) use interval::Interval;
pub use piecewise::Piecewise;
pub(crate) use piecewise::{complement, intersection, union};
pub(crate) use roots::bracketed;
pub use roots::{Root, RootKind};
pub use univariate::Univariate;

/// Binomial coefficient as a float: exact up to n = 56; 0 for k > n.
#[must_use]
pub fn binomial(n: usize, k: usize) -> f64 {
    if k > n {
        return 0.0;
    }
    let k = k.min(n - k);
    let mut b = 1.0;
    for i in 0..k {
        // Each partial product is itself a binomial coefficient, so the division is exact.
        b = b * (n - i) as f64 / (i + 1) as f64;
    }
    b
}

/// Coefficients of the product of two polynomials whose coefficients are of any kind, as `times` multiplies them (Elber and
/// Cohen 1992, eq. 4). Empty if one of them is.
#[must_use]
pub(crate) fn product<A: Copy, B: Copy, C>(a: &[A], b: &[B], times: impl Fn(A, B) -> C) -> Vec<C>
where
    C: Copy + Add<Output = C> + Mul<f64, Output = C>,
{
    let mut out: Vec<Option<C>> = vec![None; (a.len() + b.len()).saturating_sub(1)];
    let (m, n) = (a.len().saturating_sub(1), b.len().saturating_sub(1));
    for (i, &x) in a.iter().enumerate() {
        for (j, &y) in b.iter().enumerate() {
            let term = times(x, y) * (binomial(m, i) * binomial(n, j));
            out[i + j] = Some(out[i + j].map_or(term, |sum| sum + term));
        }
    }
    // Without a term there is no coefficient: of the product of nothing with something.
    out.iter().enumerate().filter_map(|(k, c)| c.map(|c| c * (1.0 / binomial(m + n, k)))).collect()
}

/// Smallest and largest of some coefficients: by the convex-hull property a bound of the polynomial on its domain.
#[must_use]
pub fn hull(coefficients: &[f64]) -> (f64, f64) {
    coefficients.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &c| (lo.min(c), hi.max(c)))
}
