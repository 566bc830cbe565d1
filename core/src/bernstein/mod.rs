//! Polynomials in Bernstein form on the unit interval and the unit square.
//!
//! The coefficients bound the polynomial (convex hull), the bound tightens quadratically under subdivision, and signs
//! of coefficients are certificates: all of one sign, no zero. Everything that `penvis` proves it proves with them.
//! Source of the arithmetic: Farouki and Rajan 1988, *Algorithms for polynomials in Bernstein form*, CAGD 5.

mod bivariate;
mod interval;
mod roots;
mod univariate;

pub use bivariate::Bivariate;
pub(crate) use interval::Interval;
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

/// Smallest and largest of some coefficients: by the convex-hull property a bound of the polynomial on its domain.
#[must_use]
pub fn hull(coefficients: &[f64]) -> (f64, f64) {
    coefficients.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &c| (lo.min(c), hi.max(c)))
}
