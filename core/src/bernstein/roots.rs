//! All roots of a polynomial on [0, 1], isolated by sign variations of the Bernstein coefficients.
//!
//! Descartes' rule in Bernstein form: the number of sign variations exceeds the number of roots in (0, 1), counted with
//! multiplicity, by an even number. No variation: no root; one: exactly one. Otherwise subdivide.
//! Source: Lane and Riesenfeld 1981, *Bounds on a polynomial*, BIT 21.

use alloc::vec::Vec;

use super::Univariate;

/// What is known of a root.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RootKind {
    /// The polynomial changes sign here, exactly once in the isolating interval.
    Simple,
    /// A cluster narrower than the resolution: a multiple root, several close ones, or a near miss.
    Cluster,
}

/// A root of a univariate polynomial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Root {
    /// Place on [0, 1].
    pub t: f64,
    /// Isolated or not.
    pub kind: RootKind,
}

/// Subdivision depth at which an interval (2⁻⁴⁰ wide) that still shows two or more sign variations is reported as a
/// cluster: its width is then far below what the coefficients' rounding (some n² · 2⁻⁵³) lets a double root resolve.
const MAX_DEPTH: u32 = 40;

/// Coefficients below this fraction of the largest are rounding of the products they came from, and count as zero.
const RELATIVE_ZERO: f64 = 1e-14;

impl Univariate {
    /// Roots on [0, 1] in increasing order; none for a polynomial that vanishes identically (to rounding).
    ///
    /// Simple roots are exact to a few units in the last place of the evaluation. Clusters (multiple roots) are
    /// reported once, with [`RootKind::Cluster`]. Cost: O(n²) per subdivision, some 50 per close pair.
    #[must_use]
    pub fn roots(&self) -> Vec<Root> {
        let mut found = Vec::new();
        let scale = self.magnitude();
        if scale == 0.0 {
            return found;
        }
        let zero = scale * RELATIVE_ZERO;
        let mut stack = Vec::new();
        stack.push((self.clone(), 0.0, 1.0, 0));
        while let Some((p, a, b, depth)) = stack.pop() {
            let c = p.coefficients();
            // A root on the left end is reported by the interval that begins there; on the right end only at t = 1.
            if c[0].abs() <= zero {
                push(&mut found, a, RootKind::Simple);
            }
            match variations(c, zero) {
                0 => {}
                1 => push(&mut found, bracketed(&p, a, b), RootKind::Simple),
                _ if depth >= MAX_DEPTH => push(&mut found, 0.5 * (a + b), RootKind::Cluster),
                _ => {
                    let m = 0.5 * (a + b);
                    let (l, r) = p.split(0.5);
                    // The right half waits on the stack, so that roots come out in order.
                    stack.push((r, m, b, depth + 1));
                    stack.push((l, a, m, depth + 1));
                }
            }
            if b == 1.0 && c[c.len() - 1].abs() <= zero {
                push(&mut found, 1.0, RootKind::Simple);
            }
        }
        found
    }
}

/// Adds a root unless it is the one just found again from the neighbouring interval.
fn push(found: &mut Vec<Root>, t: f64, kind: RootKind) {
    const SAME: f64 = 1e-11;
    match found.last_mut() {
        Some(last) if (last.t - t).abs() < SAME => {
            if kind == RootKind::Cluster {
                last.kind = kind;
            }
        }
        _ => found.push(Root { t, kind }),
    }
}

/// Sign variations of the coefficients, those within `zero` of nought left out.
fn variations(c: &[f64], zero: f64) -> usize {
    let mut last = 0.0;
    let mut n = 0;
    for &x in c {
        if x.abs() > zero {
            if last * x < 0.0 {
                n += 1;
            }
            last = x;
        }
    }
    n
}

/// The one root of `p` in (0, 1), mapped to [a, b]: regula falsi (Illinois) inside the bracket, bisection as safeguard.
fn bracketed(p: &Univariate, a: f64, b: f64) -> f64 {
    let (mut lo, mut hi) = (0.0_f64, 1.0_f64);
    let (mut flo, mut fhi) = (p.coefficients()[0], p.coefficients()[p.degree()]);
    if flo * fhi >= 0.0 {
        // An end coefficient is zero to rounding: the interior sign is decided just inside.
        let s = p.coefficients().iter().copied().find(|c| c.abs() > 0.0).unwrap_or(0.0);
        let e = p.coefficients().iter().rev().copied().find(|c| c.abs() > 0.0).unwrap_or(0.0);
        if flo == 0.0 || flo * s < 0.0 {
            flo = s;
        }
        if fhi == 0.0 || fhi * e < 0.0 {
            fhi = e;
        }
        if flo * fhi >= 0.0 {
            // Sign variation lies wholly within rounding of an end.
            return if p.coefficients()[0].abs() <= p.coefficients()[p.degree()].abs() { a } else { b };
        }
    }
    let mut side = 0;
    for i in 0..200 {
        if hi - lo <= 1e-16 * hi.abs().max(1e-3) {
            break;
        }
        // Every fourth step bisects, so that the bracket shrinks whatever the shape.
        let t = if i % 4 == 3 { 0.5 * (lo + hi) } else { (lo * fhi - hi * flo) / (fhi - flo) };
        if t <= lo || t >= hi {
            break;
        }
        let f = p.eval(t);
        if f == 0.0 {
            return a + t * (b - a);
        }
        if f * flo > 0.0 {
            lo = t;
            flo = f;
            if side == -1 {
                fhi *= 0.5;
            }
            side = -1;
        } else {
            hi = t;
            fhi = f;
            if side == 1 {
                flo *= 0.5;
            }
            side = 1;
        }
    }
    let t = if flo.abs() < fhi.abs() { lo } else { hi };
    a + t * (b - a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec;

    fn from_roots(roots: &[f64]) -> Univariate {
        roots.iter().fold(Univariate::constant(1.0), |p, r| p.mul(&Univariate::new(vec![-r, 1.0 - r])))
    }

    #[test]
    fn planted_roots_are_all_found() {
        let want = [0.0, 0.1, 0.1001, 0.5, 0.9, 1.0];
        let got = from_roots(&want).roots();
        assert_eq!(got.len(), want.len(), "{got:?}");
        for (g, w) in got.iter().zip(want) {
            assert!((g.t - w).abs() < 1e-9, "{g:?} {w}");
        }
    }

    #[test]
    fn a_double_root_is_one_cluster_or_one_root() {
        let got = from_roots(&[0.3, 0.3, 0.8]).roots();
        assert!(got.iter().any(|r| (r.t - 0.3).abs() < 1e-6), "{got:?}");
        assert!(got.iter().any(|r| (r.t - 0.8).abs() < 1e-12), "{got:?}");
    }

    #[test]
    fn no_root_and_no_polynomial() {
        assert!(Univariate::new(vec![1.0, 2.0, 0.5]).roots().is_empty());
        assert!(Univariate::new(vec![0.0, 0.0]).roots().is_empty());
    }
}
