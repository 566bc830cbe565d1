//! The bases of free-form geometry, made B-splines.
//!
//! Every piece of a curve is a polynomial, and so has Bézier points; pieces that meet are one B-spline whose inner knots
//! have the multiplicity of the degree. Formulas after the section on the mathematics of free-form curves and surfaces of
//! the format's description.

use glam::DVec4;
use penvis_core::nurbs::KnotVector;

/// Which functions control points are multiplied by.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Basis {
    /// Bernstein polynomials; successive pieces share a control point.
    Bezier,
    /// B-splines.
    BSpline,
    /// Cubic pieces through all control points but the first and last, along half the chord between the neighbours.
    Cardinal,
    /// Powers of the parameter.
    Taylor,
    /// Any polynomials of the degree, by their coefficients.
    Matrix {
        /// Coefficient of power j of the function of control point i, at i·(n + 1) + j.
        matrix: Vec<f64>,
        /// Control points from a piece to the next one.
        step: usize,
    },
}

/// Ends of pieces nearer than this part of the largest coordinate are one point: what seven digits leave.
const JOINT: f64 = 1e-6;

impl Basis {
    /// The B-spline of these homogeneous control points, with parameters as `parm` has them: knots for B-splines, and the
    /// ends of pieces for all others.
    ///
    /// # Errors
    /// If the numbers of points, parameters and the degree do not go together, or pieces do not meet.
    pub(super) fn spline(
        &self,
        degree: usize,
        parm: &[f64],
        points: &[DVec4],
    ) -> Result<(KnotVector, Vec<DVec4>), String> {
        if *self == Self::BSpline {
            let knots = KnotVector::new(parm.to_vec(), degree).map_err(|e| e.to_string())?;
            if knots.control_count() != points.len() {
                return Err(format!(
                    "has {} control points, but {} knots of degree {degree} ask for {}",
                    points.len(),
                    parm.len(),
                    knots.control_count()
                ));
            }
            return Ok((knots, points.to_vec()));
        }
        let (size, step) = self.piece(degree)?;
        let count = points.len();
        if count < size || !(count - size).is_multiple_of(step) {
            return Err(format!("has {count} control points; pieces of degree {degree} take {size}, then {step} each"));
        }
        let pieces = (count - size) / step + 1;
        if parm.len() != pieces + 1 {
            return Err(format!("has {} parameters, but {pieces} pieces have {} ends", parm.len(), pieces + 1));
        }
        let mut knots = vec![parm[0]];
        let mut out: Vec<DVec4> = Vec::new();
        for (k, own) in (0..pieces).map(|k| (k, &points[k * step..k * step + size])) {
            knots.extend(std::iter::repeat_n(parm[k], degree));
            let bezier = self.bezier(degree, own);
            match out.last() {
                Some(last) => {
                    let scale = last.abs().max_element().max(bezier[0].abs().max_element());
                    if last.distance(bezier[0]) > JOINT * scale {
                        return Err(format!("has a gap between its pieces {} and {}", k, k + 1));
                    }
                    out.extend(&bezier[1..]);
                }
                None => out = bezier,
            }
        }
        knots.extend(std::iter::repeat_n(parm[pieces], degree + 1));
        let knots = KnotVector::new(knots, degree).map_err(|e| e.to_string())?;
        Ok((knots, out))
    }

    /// Number of control points that so many parameters ask for; none if they are too few.
    pub(super) fn count(&self, degree: usize, parameters: usize) -> Option<usize> {
        if *self == Self::BSpline {
            return parameters.checked_sub(degree + 1);
        }
        let (size, step) = self.piece(degree).ok()?;
        parameters.checked_sub(2)?.checked_mul(step)?.checked_add(size)
    }

    /// Control points of a piece, and from a piece to the next one.
    fn piece(&self, degree: usize) -> Result<(usize, usize), String> {
        match self {
            Self::Cardinal if degree != 3 => Err(format!("is cardinal of degree {degree}; there is only degree 3")),
            Self::Cardinal => Ok((4, 1)),
            Self::Bezier => Ok((degree + 1, degree)),
            Self::Matrix { matrix, .. } if matrix.len() != (degree + 1) * (degree + 1) => Err(format!(
                "has {} numbers in its basis matrix; degree {degree} asks for {}",
                matrix.len(),
                (degree + 1) * (degree + 1)
            )),
            Self::Matrix { step, .. } => Ok((degree + 1, *step)),
            Self::Taylor | Self::BSpline => Ok((degree + 1, degree + 1)),
        }
    }

    /// Bézier points of a piece.
    fn bezier(&self, degree: usize, c: &[DVec4]) -> Vec<DVec4> {
        match self {
            Self::Cardinal => vec![c[1], c[1] + (c[2] - c[0]) / 6.0, c[2] - (c[3] - c[1]) / 6.0, c[2]],
            Self::Taylor => from_powers(c),
            Self::Matrix { matrix, .. } => {
                let n = degree + 1;
                let power = |j: usize| (0..n).map(|i| matrix[i * n + j] * c[i]).sum();
                from_powers(&(0..n).map(power).collect::<Vec<DVec4>>())
            }
            Self::Bezier | Self::BSpline => c.to_vec(),
        }
    }
}

/// Bézier points of a polynomial given by its coefficients: Σⱼ C(k, j) / C(n, j) aⱼ.
fn from_powers(a: &[DVec4]) -> Vec<DVec4> {
    let n = a.len() - 1;
    let ratio = |k: usize, j: usize| (0..j).map(|i| (k - i) as f64 / (n - i) as f64).product::<f64>();
    (0..=n).map(|k| (0..=k).map(|j| ratio(k, j) * a[j]).sum()).collect()
}

#[cfg(test)]
mod tests {
    use penvis_core::nurbs::Curve;
    use proptest::prelude::*;

    use super::*;

    fn points(x: &[f64]) -> Vec<DVec4> {
        x.iter().map(|&x| DVec4::new(x, x * x - 1.0, 2.0 - x, 1.0)).collect()
    }

    fn curve(basis: &Basis, degree: usize, parm: &[f64], points: &[DVec4]) -> Curve {
        let (knots, points) = basis.spline(degree, parm, points).unwrap();
        Curve::from_homogeneous(knots, points).unwrap()
    }

    #[test]
    fn cardinal_splines_pass_through_their_points() {
        let p = points(&[0.0, 1.0, 4.0, 2.0, -1.0, 5.0]);
        let c = curve(&Basis::Cardinal, 3, &[0.0, 1.0, 2.0, 3.0], &p);
        for k in 0..4 {
            assert!(c.eval(k as f64).distance(p[k + 1].truncate()) < 1e-12);
            let slope = 0.5 * (p[k + 2] - p[k]).truncate();
            assert!(c.derivative(k as f64).distance(slope) < 1e-12, "{k}");
        }
    }

    #[test]
    fn taylor_coefficients_are_powers() {
        let a = points(&[0.5, -1.0, 2.0, 3.0]).iter().map(|h| h.truncate().extend(0.0)).collect::<Vec<_>>();
        let mut a = a;
        a[0].w = 1.0;
        let c = curve(&Basis::Taylor, 3, &[2.0, 4.0], &a);
        for t in [0.0, 0.3, 1.0] {
            let expected: DVec4 = (0..4).map(|j| a[j] * f64::powi(t, j as i32)).sum();
            assert!(c.eval(2.0 + 2.0 * t).distance(expected.truncate()) < 1e-12);
        }
    }

    proptest! {
        /// The basis matrix of uniform B-splines makes the B-spline with uniform knots.
        #[test]
        fn the_matrix_of_uniform_b_splines_makes_them(x in prop::collection::vec(-5.0_f64..5.0, 4..9), t in 0.0_f64..1.0) {
            let matrix = [1.0, -3.0, 3.0, -1.0, 4.0, 0.0, -6.0, 3.0, 1.0, 3.0, 3.0, -3.0, 0.0, 0.0, 0.0, 1.0];
            let matrix = matrix.map(|m: f64| m / 6.0).to_vec();
            let p = points(&x);
            let pieces = p.len() - 3;
            let parm: Vec<f64> = (0..=pieces).map(|k| k as f64).collect();
            let c = curve(&Basis::Matrix { matrix, step: 1 }, 3, &parm, &p);
            let knots: Vec<f64> = (0..p.len() + 4).map(|k| k as f64 - 3.0).collect();
            let expected = curve(&Basis::BSpline, 3, &knots, &p);
            let t = t * pieces as f64;
            prop_assert!(c.eval(t).distance(expected.eval(t)) < 1e-9);
        }
    }

    #[test]
    fn what_does_not_go_together_is_refused() {
        let p = points(&[0.0, 1.0, 2.0, 3.0, 4.0]);
        let table: &[(Basis, usize, &[f64], &str)] = &[
            (Basis::Bezier, 3, &[0.0, 1.0], "has 5 control points; pieces of degree 3 take 4, then 3 each"),
            (Basis::Bezier, 2, &[0.0, 1.0], "has 2 parameters, but 2 pieces have 3 ends"),
            (Basis::Bezier, 2, &[0.0, 1.0, 0.5], "knot"),
            (Basis::Cardinal, 2, &[0.0, 1.0], "is cardinal of degree 2; there is only degree 3"),
            (
                Basis::BSpline,
                2,
                &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0],
                "has 5 control points, but 6 knots of degree 2 ask for 3",
            ),
            (
                Basis::Matrix { matrix: vec![1.0], step: 1 },
                1,
                &[0.0, 1.0],
                "has 1 numbers in its basis matrix; degree 1 asks for 4",
            ),
            (
                Basis::Matrix { matrix: vec![1.0, 0.0, 0.0, 1.0], step: 1 },
                1,
                &[0.0, 1.0, 2.0, 3.0, 4.0],
                "has a gap between its pieces 1 and 2",
            ),
        ];
        for (basis, degree, parm, expected) in table {
            let problem = basis.spline(*degree, parm, &p).unwrap_err();
            assert!(problem.contains(expected), "{problem}");
        }
    }
}
