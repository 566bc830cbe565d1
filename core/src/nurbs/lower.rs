//! Curves and surfaces of degrees beyond what is computed with, as ones of degree 5 within a tolerance.
//!
//! CAD programs write edges of degrees up to 25. Each polynomial piece is replaced by the one of degree 5 with the same point
//! and the same first and second derivative at both ends, in homogeneous coordinates; the error is of sixth order in the
//! length of the piece. Written with the old degree again, its control points are compared with the old ones: no point is
//! farther off than the farthest pair (the difference is a Bézier curve too, in the hull of its control points). Where that is
//! more than the tolerance the piece is halved.

use alloc::vec::Vec;

use glam::DVec4;

use super::curve::premultiplied;
use super::refine::{Strip, halves};
use super::{Curve, KnotVector, NurbsError, Surface};
use crate::view::MAX_DEGREE;

/// Highest degree that is lowered. The binomials of higher ones, and the errors they bring, pass what f64 can tell apart.
pub const MAX_LOWERED_DEGREE: usize = 30;

/// The degree of what is lowered.
const DEGREE: usize = 5;

/// Halvings of a piece. The error falls by 64 with each, from at most the size of the piece to its rounding.
const MAX_HALVINGS: u32 = 12;

/// The curve with these control points (x, y, z, weight), coordinates not multiplied by the weight, of any degree up to
/// [`MAX_LOWERED_DEGREE`], and how far it may be off: nothing if the degree is at most [`MAX_DEGREE`], and else not more than
/// `tolerance`, or the least that halving leads to.
///
/// # Errors
/// As [`KnotVector::new`] and [`Curve::new`].
pub fn lowered_curve(
    degree: usize,
    knots: Vec<f64>,
    points: Vec<DVec4>,
    tolerance: f64,
) -> Result<(Curve, f64), NurbsError> {
    if degree <= MAX_DEGREE {
        return Ok((Curve::new(KnotVector::new(knots, degree)?, points)?, 0.0));
    }
    let knots = KnotVector::checked(knots, degree, MAX_LOWERED_DEGREE)?;
    let points = premultiplied(points, knots.control_count())?;
    let (strip, off) = lowered(Strip { knots, points, width: 1 }, tolerance)?;
    Ok((Curve::from_homogeneous(strip.knots, strip.points)?, off))
}

/// The surface with these control points, `points[iu * count_v + iv]`, as [`lowered_curve`] in both directions.
///
/// # Errors
/// As [`KnotVector::new`] and [`Surface::new`].
pub fn lowered_surface(
    [p, q]: [usize; 2],
    [u, v]: [Vec<f64>; 2],
    points: Vec<DVec4>,
    tolerance: f64,
) -> Result<(Surface, f64), NurbsError> {
    if p <= MAX_DEGREE && q <= MAX_DEGREE {
        return Ok((Surface::new(KnotVector::new(u, p)?, KnotVector::new(v, q)?, points)?, 0.0));
    }
    let knots_u = KnotVector::checked(u, p, MAX_LOWERED_DEGREE)?;
    let knots_v = KnotVector::checked(v, q, MAX_LOWERED_DEGREE)?;
    let width = knots_v.control_count();
    let points = premultiplied(points, knots_u.control_count() * width)?;
    let half = 0.5 * tolerance;
    let (in_u, off_u) = lowered(Strip { knots: knots_u, points, width }, half)?;
    let rows = in_u.knots.control_count();
    let points = transposed(&in_u.points, rows, width);
    let (in_v, off_v) = lowered(Strip { knots: knots_v, points, width: rows }, half)?;
    let columns = in_v.knots.control_count();
    let surface = Surface::from_homogeneous(in_u.knots, in_v.knots, transposed(&in_v.points, columns, rows))?;
    Ok((surface, off_u + off_v))
}

fn transposed(points: &[DVec4], rows: usize, width: usize) -> Vec<DVec4> {
    (0..width).flat_map(|c| (0..rows).map(move |r| points[r * width + c])).collect()
}

/// A polynomial piece: its interval, its rows, and how often it was halved.
type Piece = ([f64; 2], Vec<DVec4>, u32);

/// The strip with a degree that is computed with, and how far it may be off.
fn lowered(strip: Strip, tolerance: f64) -> Result<(Strip, f64), NurbsError> {
    let (p, w) = (strip.knots.degree(), strip.width);
    if p <= MAX_DEGREE {
        return Ok((strip, 0.0));
    }
    let mut bezier = strip.clamped();
    let breaks = bezier.knots.breaks();
    breaks[1..breaks.len() - 1].iter().for_each(|&t| bezier.raise(t, p));
    let rows = |k: usize| bezier.points[k * p * w..((k + 1) * p + 1) * w].to_vec();
    let mut todo: Vec<Piece> = (0..breaks.len() - 1).map(|k| ([breaks[k], breaks[k + 1]], rows(k), 0)).collect();
    todo.reverse();
    let mut knots = alloc::vec![breaks[0]; DEGREE + 1];
    let (mut points, mut off): (Vec<DVec4>, f64) = (Vec::new(), 0.0);
    while let Some(([a, b], rows, halvings)) = todo.pop() {
        let low = hermite(&rows, w);
        let error = difference(&rows, &low, w);
        let middle = 0.5 * (a + b);
        if error > tolerance && halvings < MAX_HALVINGS && a < middle && middle < b {
            let (left, right) = halves(rows, w);
            todo.push(([middle, b], right, halvings + 1));
            todo.push(([a, middle], left, halvings + 1));
            continue;
        }
        off = off.max(error);
        let first = if points.is_empty() { 0 } else { w };
        points.extend_from_slice(&low[first..]);
        knots.extend([b; DEGREE]);
    }
    knots.extend(knots.last().copied());
    Ok((Strip { knots: KnotVector::new(knots, DEGREE)?, points, width: w }, off))
}

/// The rows of degree 5 with the same first two derivatives at both ends as those given, of a higher degree.
fn hermite(rows: &[DVec4], w: usize) -> Vec<DVec4> {
    let p = rows.len() / w - 1;
    let row = |k: usize, c: usize| rows[k * w + c];
    // The first derivative is p times the first difference, the second p (p − 1) times the second one.
    let one = p as f64 / DEGREE as f64;
    let two = (p * (p - 1)) as f64 / (DEGREE * (DEGREE - 1)) as f64;
    let mut low = alloc::vec![DVec4::ZERO; (DEGREE + 1) * w];
    for c in 0..w {
        let end = |b: [DVec4; 3]| {
            let c1 = b[0] + (b[1] - b[0]) * one;
            [b[0], c1, (b[2] - 2.0 * b[1] + b[0]) * two + 2.0 * c1 - b[0]]
        };
        for (k, x) in end([0, 1, 2].map(|k| row(k, c))).into_iter().enumerate() {
            low[k * w + c] = x;
        }
        for (k, x) in end([0, 1, 2].map(|k| row(p - k, c))).into_iter().enumerate() {
            low[(DEGREE - k) * w + c] = x;
        }
    }
    low
}

/// Bound of the distance in space between pieces of two degrees; infinite if the lower one has a weight that is not positive.
///
/// With X / W a point of the one, X + δ and W + ε of the other, (X + δ) / (W + ε) − X / W = (δ − ε X / W) / (W + ε).
fn difference(rows: &[DVec4], low: &[DVec4], w: usize) -> f64 {
    let p = rows.len() / w - 1;
    let mut raised = low.to_vec();
    for q in DEGREE..p {
        // Degree elevation of a Bézier curve: row k becomes a mean of rows k − 1 and k.
        let mut next = Vec::with_capacity(raised.len() + w);
        for k in 0..=q + 1 {
            let share = k as f64 / (q + 1) as f64;
            for c in 0..w {
                let before = if k > 0 { raised[(k - 1) * w + c] * share } else { DVec4::ZERO };
                let own = if k <= q { raised[k * w + c] * (1.0 - share) } else { DVec4::ZERO };
                next.push(before + own);
            }
        }
        raised = next;
    }
    let least = low.iter().map(|h| h.w).fold(f64::INFINITY, f64::min);
    if least <= 0.0 {
        return f64::INFINITY;
    }
    let farthest = rows.iter().map(|h| h.truncate().length() / h.w).fold(0.0, f64::max);
    let of = |(a, b): (&DVec4, &DVec4)| {
        let d = *a - *b;
        (d.truncate().length() + farthest * d.w.abs()) / least
    };
    rows.iter().zip(&raised).map(of).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Binomials n over k.
    fn binomials(n: usize) -> Vec<f64> {
        let mut row = alloc::vec![1.0];
        for k in 1..=n {
            row.push(row[k - 1] * (n + 1 - k) as f64 / k as f64);
        }
        row
    }

    /// A rational Bézier curve by its definition.
    fn point(points: &[DVec4], t: f64) -> glam::DVec3 {
        let n = points.len() - 1;
        let terms = points.iter().zip(binomials(n)).enumerate().map(|(k, (p, b))| {
            let share = b * libm::pow(t, k as f64) * libm::pow(1.0 - t, (n - k) as f64) * p.w;
            (p.truncate() * share).extend(share)
        });
        let h = terms.fold(DVec4::ZERO, |sum, x| sum + x);
        h.truncate() / h.w
    }

    /// Control points that wind, with weights that differ.
    fn winding(n: usize, z: f64) -> Vec<DVec4> {
        let at = |k: usize| {
            let x = k as f64;
            DVec4::new(x, libm::sin(1.3 * x + z), libm::cos(0.7 * x) + z, 1.0 + 0.5 * libm::sin(x))
        };
        (0..=n).map(at).collect()
    }

    fn bezier_knots(degree: usize) -> Vec<f64> {
        [alloc::vec![0.0; degree + 1], alloc::vec![1.0; degree + 1]].concat()
    }

    #[test]
    fn curves_are_lowered_within_what_is_said() {
        for degree in [10, 14, 25, MAX_LOWERED_DEGREE] {
            let points = winding(degree, 0.0);
            for tolerance in [1e-3, 1e-7] {
                let (curve, off) = lowered_curve(degree, bezier_knots(degree), points.clone(), tolerance).unwrap();
                assert!(off <= tolerance && curve.degree() == DEGREE);
                let error = |k: u32| {
                    let t = f64::from(k) / 1000.0;
                    curve.eval(t).distance(point(&points, t))
                };
                let most = (0..=1000).map(error).fold(0.0, f64::max);
                assert!(most <= off + 1e-11, "degree {degree}: {most} > {off}");
            }
        }
    }

    #[test]
    fn surfaces_are_lowered_within_what_is_said() {
        let (p, q) = (11, 3);
        let points: Vec<DVec4> = (0..=p)
            .flat_map(|i| {
                let row = winding(p, 0.0)[i];
                (0..=q).map(move |j| DVec4::new(row.x, row.y + 0.3 * (j * j) as f64, row.z + j as f64, row.w))
            })
            .collect();
        let (surface, off) = lowered_surface([p, q], [bezier_knots(p), bezier_knots(q)], points.clone(), 1e-6).unwrap();
        assert!(off <= 1e-6 && surface.degree_u() == DEGREE && surface.degree_v() == q);
        for i in 0..=20 {
            for j in 0..=20 {
                let (u, v) = (f64::from(i) / 20.0, f64::from(j) / 20.0);
                let column: Vec<DVec4> = points
                    .chunks_exact(q + 1)
                    .map(|row| {
                        let b = binomials(q);
                        let terms = row.iter().zip(b).enumerate().map(|(k, (x, b))| {
                            let s = b * libm::pow(v, k as f64) * libm::pow(1.0 - v, (q - k) as f64) * x.w;
                            (x.truncate() * s).extend(s)
                        });
                        let h = terms.fold(DVec4::ZERO, |sum, x| sum + x);
                        (h.truncate() / h.w).extend(h.w)
                    })
                    .collect();
                assert!(surface.eval(u, v).distance(point(&column, u)) <= off + 1e-11);
            }
        }
    }

    #[test]
    fn what_is_low_enough_is_as_it_was_and_what_is_too_high_is_refused() {
        let points = winding(MAX_DEGREE, 0.0);
        let (curve, off) = lowered_curve(MAX_DEGREE, bezier_knots(MAX_DEGREE), points, 1.0).unwrap();
        assert_eq!((curve.degree(), off), (MAX_DEGREE, 0.0));
        let high = MAX_LOWERED_DEGREE + 1;
        let refused = lowered_curve(high, bezier_knots(high), winding(high, 0.0), 1.0).unwrap_err();
        assert_eq!(refused, NurbsError::Degree { degree: high, max: MAX_LOWERED_DEGREE });
    }

    #[test]
    fn knots_inside_are_kept() {
        let degree = 12;
        let knots = [alloc::vec![0.0; 13], alloc::vec![0.25, 0.5, 0.5], alloc::vec![1.0; 13]].concat();
        let (curve, off) = lowered_curve(degree, knots, winding(degree + 3, 0.0), 1e-8).unwrap();
        assert!(off <= 1e-8 && [0.25, 0.5].iter().all(|t| curve.knots().multiplicity(*t) == DEGREE));
    }
}
