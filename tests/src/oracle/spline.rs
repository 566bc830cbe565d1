//! Rational B-spline surfaces by their definition: basis functions from the Cox–de Boor recursion, summed.

use glam::{DVec2, DVec3, DVec4};
use penvis_core::nurbs::Surface;

/// The basis functions that do not vanish at one parameter: index of the first, and the values of all.
struct Basis {
    first: usize,
    values: Vec<f64>,
}

impl Basis {
    /// Cox–de Boor recursion (de Boor 1972, eq. 2), on the span that holds `t`; the end of the domain belongs to the last.
    fn at(knots: &[f64], degree: usize, t: f64) -> Self {
        let last = knots.len() - degree - 2;
        let span = (degree..=last).rev().find(|&k| knots[k] < knots[k + 1] && knots[k] <= t).unwrap_or(degree);
        let mut values = vec![1.0];
        for p in 1..=degree {
            let mut next = vec![0.0; p + 1];
            for (i, b) in values.iter().enumerate() {
                // This function of degree p − 1 begins at knot `left`, and spreads over two of degree p.
                let left = span + 1 + i - p;
                let (a, c) = (knots[left], knots[left + p]);
                next[i] += b * (c - t) / (c - a);
                next[i + 1] += b * (t - a) / (c - a);
            }
            values = next;
        }
        Self { first: span - degree, values }
    }
}

/// The surface's point at one pair of parameters.
pub(super) fn point(surface: &Surface, uv: DVec2) -> DVec3 {
    points(surface, &[uv.x], &[uv.y])[0]
}

/// The surface's points at every pair of the parameters `us`, `vs`: index `i * vs.len() + j`.
pub(super) fn points(surface: &Surface, us: &[f64], vs: &[f64]) -> Vec<DVec3> {
    let (ku, kv) = (surface.knots_u(), surface.knots_v());
    let nv = kv.control_count();
    let across: Vec<Basis> = vs.iter().map(|&v| Basis::at(kv.as_slice(), kv.degree(), v)).collect();
    let mut out = Vec::with_capacity(us.len() * vs.len());
    for &u in us {
        let b = Basis::at(ku.as_slice(), ku.degree(), u);
        let row: Vec<DVec4> = (0..nv)
            .map(|j| {
                let terms = b.values.iter().enumerate();
                terms.map(|(i, &w)| surface.homogeneous()[(b.first + i) * nv + j] * w).sum()
            })
            .collect();
        out.extend(across.iter().map(|b| {
            let h: DVec4 = b.values.iter().enumerate().map(|(j, &w)| row[b.first + j] * w).sum();
            h.truncate() / h.w
        }));
    }
    out
}

/// The distinct knots of the domain of `knots`, each interval cut into `parts`.
pub(super) fn subdivided(knots: &[f64], degree: usize, parts: usize) -> Vec<f64> {
    let mut breaks = knots[degree..knots.len() - degree].to_vec();
    breaks.dedup();
    let mut out = Vec::with_capacity((breaks.len() - 1) * parts + 1);
    for w in breaks.windows(2) {
        out.extend((0..parts).map(|k| w[0] + (w[1] - w[0]) * k as f64 / parts as f64));
    }
    out.extend(breaks.last());
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use penvis_core::nurbs::KnotVector;

    #[test]
    fn basis_functions_sum_to_one_and_reproduce_the_parameter() {
        let knots = [0.0, 0.0, 0.0, 0.0, 0.2, 0.5, 0.5, 0.9, 1.0, 1.0, 1.0, 1.0];
        for k in 0..=50 {
            let t = f64::from(k) / 50.0;
            let b = Basis::at(&knots, 3, t);
            let sum: f64 = b.values.iter().sum();
            let greville = |i: usize| (knots[i + 1] + knots[i + 2] + knots[i + 3]) / 3.0;
            let mean: f64 = b.values.iter().enumerate().map(|(i, w)| w * greville(b.first + i)).sum();
            assert!((sum - 1.0).abs() < 1e-14 && (mean - t).abs() < 1e-14);
        }
    }

    #[test]
    fn a_rational_quarter_circle_is_round() {
        let arc =
            [DVec4::new(1.0, 0.0, 0.0, 1.0), DVec4::new(1.0, 1.0, 0.0, 0.5_f64.sqrt()), DVec4::new(0.0, 1.0, 0.0, 1.0)];
        let net = arc.iter().flat_map(|&p| [p, p + DVec4::Z]).collect();
        let bezier = |p| KnotVector::bezier(p, [0.0, 1.0]).unwrap();
        let surface = Surface::new(bezier(2), bezier(1), net).unwrap();
        let parameters = subdivided(&[0.0, 0.0, 1.0, 1.0], 1, 10);
        for p in points(&surface, &parameters, &[0.0, 0.3]) {
            assert!((p.truncate().length() - 1.0).abs() < 1e-15);
        }
    }
}
