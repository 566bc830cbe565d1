//! Tensor-product polynomials in two variables on the unit square.

use alloc::vec;
use alloc::vec::Vec;

use super::{Univariate, binomial, hull};

/// A polynomial ∑∑ cᵢⱼ Bᵢᵖ(u) Bⱼᵠ(v) on [0, 1]², of bidegree (p, q). Coefficients are stored with j running fastest.
#[derive(Clone, Debug, PartialEq)]
pub struct Bivariate {
    degree_u: usize,
    degree_v: usize,
    coef: Vec<f64>,
}

impl Bivariate {
    /// The polynomial of bidegree (p, q) with coefficient `f(i, j)`.
    #[must_use]
    pub fn from_fn(degree_u: usize, degree_v: usize, mut f: impl FnMut(usize, usize) -> f64) -> Self {
        let mut coef = Vec::with_capacity((degree_u + 1) * (degree_v + 1));
        for i in 0..=degree_u {
            for j in 0..=degree_v {
                coef.push(f(i, j));
            }
        }
        Self { degree_u, degree_v, coef }
    }

    /// The constant `c`, bidegree (0, 0).
    #[must_use]
    pub fn constant(c: f64) -> Self {
        Self { degree_u: 0, degree_v: 0, coef: vec![c] }
    }

    /// Degree in u.
    #[must_use]
    pub fn degree_u(&self) -> usize {
        self.degree_u
    }

    /// Degree in v.
    #[must_use]
    pub fn degree_v(&self) -> usize {
        self.degree_v
    }

    /// Coefficient of Bᵢ(u) Bⱼ(v).
    #[must_use]
    pub fn get(&self, i: usize, j: usize) -> f64 {
        self.coef[i * (self.degree_v + 1) + j]
    }

    /// All coefficients, row by row in u, v fastest.
    #[must_use]
    pub fn coefficients(&self) -> &[f64] {
        &self.coef
    }

    /// Lower and upper bound on the unit square.
    #[must_use]
    pub fn bounds(&self) -> (f64, f64) {
        hull(&self.coef)
    }

    /// Largest absolute coefficient.
    #[must_use]
    pub fn magnitude(&self) -> f64 {
        self.coef.iter().fold(0.0, |m, c| m.max(c.abs()))
    }

    fn row(&self, i: usize) -> &[f64] {
        let w = self.degree_v + 1;
        &self.coef[i * w..(i + 1) * w]
    }

    /// Value at (u, v) by de Casteljau; an extrapolation outside the unit square. O(p·q·(p + q)).
    #[must_use]
    pub fn eval(&self, u: f64, v: f64) -> f64 {
        self.restricted_u(u).eval(v)
    }

    /// The polynomial in v on the line u = `u`.
    #[must_use]
    pub fn restricted_u(&self, u: f64) -> Univariate {
        let w = self.degree_v + 1;
        let mut c = self.coef.clone();
        for r in (1..=self.degree_u).rev() {
            for k in 0..r * w {
                c[k] += u * (c[k + w] - c[k]);
            }
        }
        c.truncate(w);
        Univariate::new(c)
    }

    /// The polynomial in u on the line v = `v`.
    #[must_use]
    pub fn restricted_v(&self, v: f64) -> Univariate {
        Univariate::new(
            (0..=self.degree_u)
                .map(|i| {
                    let mut c: Vec<f64> = self.row(i).to_vec();
                    for r in (1..c.len()).rev() {
                        for k in 0..r {
                            c[k] += v * (c[k + 1] - c[k]);
                        }
                    }
                    c[0]
                })
                .collect(),
        )
    }

    /// Partial derivative with respect to u, bidegree (p − 1, q).
    #[must_use]
    pub fn derivative_u(&self) -> Self {
        let p = self.degree_u;
        if p == 0 {
            return Self::from_fn(0, self.degree_v, |_, _| 0.0);
        }
        Self::from_fn(p - 1, self.degree_v, |i, j| p as f64 * (self.get(i + 1, j) - self.get(i, j)))
    }

    /// Partial derivative with respect to v, bidegree (p, q − 1).
    #[must_use]
    pub fn derivative_v(&self) -> Self {
        let q = self.degree_v;
        if q == 0 {
            return Self::from_fn(self.degree_u, 0, |_, _| 0.0);
        }
        Self::from_fn(self.degree_u, q - 1, |i, j| q as f64 * (self.get(i, j + 1) - self.get(i, j)))
    }

    /// The same polynomial written with bidegree at least (p, q).
    #[must_use]
    pub fn elevated(&self, degree_u: usize, degree_v: usize) -> Self {
        let mut out = self.clone();
        while out.degree_u < degree_u {
            let n = out.degree_u + 1;
            out = Self::from_fn(n, out.degree_v, |i, j| {
                let a = i as f64 / n as f64;
                let lower = if i > 0 { a * out.get(i - 1, j) } else { 0.0 };
                let upper = if i < n { (1.0 - a) * out.get(i, j) } else { 0.0 };
                lower + upper
            });
        }
        while out.degree_v < degree_v {
            let n = out.degree_v + 1;
            out = Self::from_fn(out.degree_u, n, |i, j| {
                let a = j as f64 / n as f64;
                let lower = if j > 0 { a * out.get(i, j - 1) } else { 0.0 };
                let upper = if j < n { (1.0 - a) * out.get(i, j) } else { 0.0 };
                lower + upper
            });
        }
        out
    }

    /// Sum; each degree is the higher of the two.
    #[must_use]
    pub fn add(&self, other: &Self) -> Self {
        self.zip(other, |a, b| a + b)
    }

    /// Difference; each degree is the higher of the two.
    #[must_use]
    pub fn sub(&self, other: &Self) -> Self {
        self.zip(other, |a, b| a - b)
    }

    fn zip(&self, other: &Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let (p, q) = (self.degree_u.max(other.degree_u), self.degree_v.max(other.degree_v));
        let (a, b) = (self.elevated(p, q), other.elevated(p, q));
        let coef = a.coef.iter().zip(&b.coef).map(|(&x, &y)| f(x, y)).collect();
        Self { degree_u: p, degree_v: q, coef }
    }

    /// Every coefficient times `k`.
    #[must_use]
    pub fn scaled(&self, k: f64) -> Self {
        Self { coef: self.coef.iter().map(|c| k * c).collect(), ..*self }
    }

    /// Product; degrees add. O(p·q·r·s).
    #[must_use]
    pub fn mul(&self, other: &Self) -> Self {
        let (p, q) = (self.degree_u + other.degree_u, self.degree_v + other.degree_v);
        let w = q + 1;
        let mut coef = vec![0.0; (p + 1) * w];
        // Scaled Bernstein coefficients (each times its binomials) multiply like power-basis coefficients.
        let a = self.with_binomials();
        let b = other.with_binomials();
        let (wa, wb) = (self.degree_v + 1, other.degree_v + 1);
        for i in 0..=self.degree_u {
            for j in 0..=self.degree_v {
                let x = a[i * wa + j];
                if x == 0.0 {
                    continue;
                }
                for k in 0..=other.degree_u {
                    let row = &mut coef[(i + k) * w + j..(i + k) * w + j + wb];
                    for (c, y) in row.iter_mut().zip(&b[k * wb..(k + 1) * wb]) {
                        *c += x * y;
                    }
                }
            }
        }
        for i in 0..=p {
            let bi = binomial(p, i);
            for j in 0..=q {
                coef[i * w + j] /= bi * binomial(q, j);
            }
        }
        Self { degree_u: p, degree_v: q, coef }
    }

    fn with_binomials(&self) -> Vec<f64> {
        let mut out = Vec::with_capacity(self.coef.len());
        for i in 0..=self.degree_u {
            let bi = binomial(self.degree_u, i);
            for j in 0..=self.degree_v {
                out.push(self.get(i, j) * bi * binomial(self.degree_v, j));
            }
        }
        out
    }

    /// The two halves at u = `t`, each written on the unit square again.
    #[must_use]
    pub fn split_u(&self, t: f64) -> (Self, Self) {
        let w = self.degree_v + 1;
        let mut right = self.coef.clone();
        let mut left = Vec::with_capacity(right.len());
        for r in (0..=self.degree_u).rev() {
            left.extend_from_slice(&right[..w]);
            for k in 0..r * w {
                right[k] += t * (right[k + w] - right[k]);
            }
        }
        (Self { coef: left, ..*self }, Self { coef: right, ..*self })
    }

    /// The two halves at v = `t`, each written on the unit square again.
    #[must_use]
    pub fn split_v(&self, t: f64) -> (Self, Self) {
        let w = self.degree_v + 1;
        let mut right = self.coef.clone();
        let mut left = vec![0.0; right.len()];
        for (row, out) in right.chunks_exact_mut(w).zip(left.chunks_exact_mut(w)) {
            for r in (0..w).rev() {
                out[self.degree_v - r] = row[0];
                for k in 0..r {
                    row[k] += t * (row[k + 1] - row[k]);
                }
            }
        }
        (Self { coef: left, ..*self }, Self { coef: right, ..*self })
    }

    /// The part over the rectangle `u` × `v` of the unit square, written on the unit square again.
    #[must_use]
    pub fn restricted(&self, u: [f64; 2], v: [f64; 2]) -> Self {
        let mut out = self.clone();
        if u[1] < 1.0 {
            out = out.split_u(u[1]).0;
        }
        if u[0] > 0.0 {
            out = out.split_u(u[0] / u[1]).1;
        }
        if v[1] < 1.0 {
            out = out.split_v(v[1]).0;
        }
        if v[0] > 0.0 {
            out = out.split_v(v[0] / v[1]).1;
        }
        out
    }

    /// u and v exchanged.
    #[must_use]
    pub fn transposed(&self) -> Self {
        Self::from_fn(self.degree_v, self.degree_u, |i, j| self.get(j, i))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> (Bivariate, Bivariate) {
        let a = Bivariate::from_fn(2, 3, |i, j| (i as f64 - 0.7) * (j as f64 + 0.3) - 0.2 * (i * j * j) as f64);
        let b = Bivariate::from_fn(3, 1, |i, j| 1.0 - 0.5 * i as f64 + 0.25 * (i * i) as f64 - j as f64);
        (a, b)
    }

    fn grid() -> impl Iterator<Item = (f64, f64)> {
        (0..=5).flat_map(|i| (0..=5).map(move |j| (f64::from(i) / 5.0, f64::from(j) / 5.0)))
    }

    #[test]
    fn arithmetic_agrees_with_values() {
        let (a, b) = sample();
        for (u, v) in grid() {
            let (x, y) = (a.eval(u, v), b.eval(u, v));
            assert!((a.mul(&b).eval(u, v) - x * y).abs() < 1e-13);
            assert!((a.add(&b).eval(u, v) - x - y).abs() < 1e-13);
            assert!((a.sub(&b).eval(u, v) - x + y).abs() < 1e-13);
            assert!((a.transposed().eval(v, u) - x).abs() < 1e-13);
            assert!((a.elevated(5, 4).eval(u, v) - x).abs() < 1e-13);
            assert!((a.scaled(-2.0).eval(u, v) + 2.0 * x).abs() < 1e-13);
            let (low, high) = a.bounds();
            assert!(low <= x && x <= high);
        }
    }

    #[test]
    fn restriction_and_subdivision_agree_with_values() {
        let (a, _) = sample();
        let (l, r) = a.split_u(0.4);
        let (bot, top) = a.split_v(0.3);
        for (u, v) in grid() {
            assert!((a.restricted_u(u).eval(v) - a.restricted_v(v).eval(u)).abs() < 1e-13);
            assert!((l.eval(u, v) - a.eval(0.4 * u, v)).abs() < 1e-13);
            assert!((r.eval(u, v) - a.eval(0.4 + 0.6 * u, v)).abs() < 1e-13);
            assert!((bot.eval(u, v) - a.eval(u, 0.3 * v)).abs() < 1e-13);
            assert!((top.eval(u, v) - a.eval(u, 0.3 + 0.7 * v)).abs() < 1e-13);
        }
    }

    #[test]
    fn derivatives_agree_with_difference_quotients() {
        let (a, _) = sample();
        let h = 1e-6;
        for (u, v) in grid() {
            let du = (a.eval(u + h, v) - a.eval(u - h, v)) / (2.0 * h);
            let dv = (a.eval(u, v + h) - a.eval(u, v - h)) / (2.0 * h);
            assert!((a.derivative_u().eval(u, v) - du).abs() < 1e-8);
            assert!((a.derivative_v().eval(u, v) - dv).abs() < 1e-8);
        }
    }
}
