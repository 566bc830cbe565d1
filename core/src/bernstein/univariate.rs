//! Polynomials in one variable on [0, 1].

use alloc::vec;
use alloc::vec::Vec;

use super::{binomial, hull};

/// A polynomial ∑ cᵢ Bᵢⁿ(t) on [0, 1], of degree n = number of coefficients − 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Univariate {
    coef: Vec<f64>,
}

/// Coefficients that evaluation keeps on the stack. Silhouette polynomials have degree up to 26 (3 · 9 − 1).
const SCRATCH: usize = 32;

impl Univariate {
    /// The polynomial with these coefficients; an empty list is the zero polynomial of degree 0.
    #[must_use]
    pub fn new(mut coef: Vec<f64>) -> Self {
        if coef.is_empty() {
            coef.push(0.0);
        }
        Self { coef }
    }

    /// The constant `c`, degree 0.
    #[must_use]
    pub fn constant(c: f64) -> Self {
        Self { coef: vec![c] }
    }

    /// Formal degree: one less than the number of coefficients.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.coef.len() - 1
    }

    /// Bernstein coefficients, in order.
    #[must_use]
    pub fn coefficients(&self) -> &[f64] {
        &self.coef
    }

    /// Lower and upper bound on [0, 1].
    #[must_use]
    pub fn bounds(&self) -> (f64, f64) {
        hull(&self.coef)
    }

    /// Largest absolute coefficient.
    #[must_use]
    pub fn magnitude(&self) -> f64 {
        self.coef.iter().fold(0.0, |m, c| m.max(c.abs()))
    }

    /// Value at `t` by de Casteljau's corner cutting; stable inside [0, 1], an extrapolation outside. O(n²), without
    /// allocation up to degree 31.
    #[must_use]
    pub fn eval(&self, t: f64) -> f64 {
        let mut scratch = [0.0; SCRATCH];
        match scratch.get_mut(..self.coef.len()) {
            Some(c) => {
                c.copy_from_slice(&self.coef);
                corner_cut(c, t)
            }
            None => corner_cut(&mut self.coef.clone(), t),
        }
    }

    /// First derivative, of degree n − 1 (0 for a constant).
    #[must_use]
    pub fn derivative(&self) -> Self {
        let n = self.degree();
        if n == 0 {
            return Self::constant(0.0);
        }
        Self { coef: self.coef.windows(2).map(|w| n as f64 * (w[1] - w[0])).collect() }
    }

    /// The same polynomial written with degree `degree` (unchanged where that is not higher).
    #[must_use]
    pub fn elevated(&self, degree: usize) -> Self {
        let mut coef = self.coef.clone();
        while coef.len() <= degree {
            let n = coef.len();
            let mut up = Vec::with_capacity(n + 1);
            up.push(coef[0]);
            for i in 1..n {
                let a = i as f64 / n as f64;
                up.push(a * coef[i - 1] + (1.0 - a) * coef[i]);
            }
            up.push(coef[n - 1]);
            coef = up;
        }
        Self { coef }
    }

    /// Sum; the degree is the higher of the two.
    #[must_use]
    pub fn add(&self, other: &Self) -> Self {
        self.zip(other, |a, b| a + b)
    }

    /// Difference; the degree is the higher of the two.
    #[must_use]
    pub fn sub(&self, other: &Self) -> Self {
        self.zip(other, |a, b| a - b)
    }

    fn zip(&self, other: &Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let n = self.degree().max(other.degree());
        let (a, b) = (self.elevated(n), other.elevated(n));
        Self { coef: a.coef.iter().zip(&b.coef).map(|(&x, &y)| f(x, y)).collect() }
    }

    /// Every coefficient times `k`.
    #[must_use]
    pub fn scaled(&self, k: f64) -> Self {
        Self { coef: self.coef.iter().map(|c| k * c).collect() }
    }

    /// Product; degrees add. O(n·m).
    #[must_use]
    pub fn mul(&self, other: &Self) -> Self {
        let (n, m) = (self.degree(), other.degree());
        let mut coef = vec![0.0; n + m + 1];
        for (i, a) in self.coef.iter().enumerate() {
            let ai = a * binomial(n, i);
            for (j, b) in other.coef.iter().enumerate() {
                coef[i + j] += ai * (b * binomial(m, j));
            }
        }
        for (k, c) in coef.iter_mut().enumerate() {
            *c /= binomial(n + m, k);
        }
        Self { coef }
    }

    /// The two halves at `t`, each written on [0, 1] again.
    #[must_use]
    pub fn split(&self, t: f64) -> (Self, Self) {
        let mut right = self.coef.clone();
        let n = right.len();
        let mut left = Vec::with_capacity(n);
        for r in (0..n).rev() {
            left.push(right[0]);
            for i in 0..r {
                right[i] += t * (right[i + 1] - right[i]);
            }
        }
        (Self { coef: left }, Self { coef: right })
    }

    /// The part on [a, b], written on [0, 1].
    #[must_use]
    pub fn restricted(&self, a: f64, b: f64) -> Self {
        let right = if a == 0.0 { self.clone() } else { self.split(a).1 };
        if b == 1.0 { right } else { right.split((b - a) / (1.0 - a)).0 }
    }

    /// The polynomial in 1 − t.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self { coef: self.coef.iter().rev().copied().collect() }
    }
}

/// Value of the polynomial with coefficients `c` (overwritten, not empty) at `t`.
fn corner_cut(c: &mut [f64], t: f64) -> f64 {
    for r in (1..c.len()).rev() {
        for i in 0..r {
            c[i] += t * (c[i + 1] - c[i]);
        }
    }
    c[0]
}

#[cfg(test)]
mod tests {
    use alloc::vec;

    use proptest::prelude::*;

    use super::*;

    fn polynomials(degree: usize) -> impl Strategy<Value = Univariate> {
        prop::collection::vec(-1.0..1.0_f64, 1..degree + 2).prop_map(Univariate::new)
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(256) })]

        // Coefficients and t are at most 1 in size, and every operation is a convex combination, or n times one: rounding is
        // some n units of 2⁻⁵³ of the result's coefficients.
        #[test]
        fn arithmetic_is_that_of_the_values(a in polynomials(26), b in polynomials(9), t in 0.0..1.0_f64) {
            let (x, y) = (a.eval(t), b.eval(t));
            prop_assert!((a.mul(&b).eval(t) - x * y).abs() < 4e-14);
            prop_assert!((a.add(&b).eval(t) - (x + y)).abs() < 4e-14);
            prop_assert!((a.sub(&b).eval(t) - (x - y)).abs() < 4e-14);
            prop_assert!((a.elevated(40).eval(t) - x).abs() < 4e-14);
            prop_assert!((a.scaled(-3.0).eval(t) + 3.0 * x).abs() < 4e-14);
            prop_assert!((a.reversed().eval(1.0 - t) - x).abs() < 4e-14);
            let (low, high) = a.bounds();
            prop_assert!(low - 1e-15 <= x && x <= high + 1e-15);
        }

        #[test]
        fn parts_and_derivatives_are_those_of_the_whole(a in polynomials(26), at in 0.0..1.0_f64, t in 0.0..1.0_f64) {
            let (l, r) = a.split(at);
            prop_assert!((l.eval(t) - a.eval(at * t)).abs() < 4e-14);
            prop_assert!((r.eval(t) - a.eval(at + (1.0 - at) * t)).abs() < 4e-14);
            prop_assert_eq!(l.coefficients().last(), r.coefficients().first());
            // The derivative of a part is that of the whole times its length.
            let whole = at * a.derivative().eval(at * t);
            prop_assert!((l.derivative().eval(t) - whole).abs() < 26.0 * 4e-14);
        }
    }

    #[test]
    fn product_of_linear_factors_is_their_product_everywhere() {
        let a = Univariate::new(vec![1.0, -2.0]);
        let b = Univariate::new(vec![0.5, 3.0, -1.0]);
        let p = a.mul(&b);
        assert_eq!(p.degree(), 3);
        for i in 0..=10 {
            let t = f64::from(i) / 10.0;
            assert!((p.eval(t) - a.eval(t) * b.eval(t)).abs() < 1e-14);
        }
    }

    #[test]
    fn sum_and_difference_elevate_the_lower_degree() {
        let a = Univariate::new(vec![1.0, -2.0]);
        let b = Univariate::new(vec![0.5, 3.0, -1.0, 2.0]);
        for i in 0..=10 {
            let t = f64::from(i) / 10.0;
            assert!((a.add(&b).eval(t) - a.eval(t) - b.eval(t)).abs() < 1e-14);
            assert!((a.sub(&b).eval(t) - a.eval(t) + b.eval(t)).abs() < 1e-14);
        }
    }

    #[test]
    fn split_restrict_and_reverse_are_the_same_polynomial() {
        let p = Univariate::new(vec![0.3, -2.0, 5.0, 1.0, -0.7]);
        let (l, r) = p.split(0.3);
        let m = p.restricted(0.2, 0.7);
        for i in 0..=8 {
            let t = f64::from(i) / 8.0;
            assert!((l.eval(t) - p.eval(0.3 * t)).abs() < 1e-14);
            assert!((r.eval(t) - p.eval(0.3 + 0.7 * t)).abs() < 1e-14);
            assert!((m.eval(t) - p.eval(0.2 + 0.5 * t)).abs() < 1e-14);
            assert!((p.reversed().eval(t) - p.eval(1.0 - t)).abs() < 1e-14);
        }
    }

    #[test]
    fn derivative_of_a_known_polynomial() {
        // t² has Bernstein coefficients 0, 0, 1 and derivative 2t.
        let d = Univariate::new(vec![0.0, 0.0, 1.0]).derivative();
        assert_eq!(d.coefficients(), &[0.0, 2.0]);
    }
}
