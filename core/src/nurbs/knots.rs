//! Knot vectors.

use alloc::vec::Vec;

use super::NurbsError;
use crate::view::MAX_DEGREE;

/// A legal knot vector of a given degree, clamped or not.
///
/// Invariants: degree p from 1 to [`MAX_DEGREE`]; all knots finite and non-decreasing, their range finite; the domain
/// [tₚ, tₙ₊₁] is not empty; a knot strictly inside the domain is repeated at most p times, any other at most p + 1.
#[derive(Clone, Debug, PartialEq)]
pub struct KnotVector {
    knots: Vec<f64>,
    degree: usize,
}

impl KnotVector {
    /// Checks the full knot vector (control points + degree + 1 knots).
    ///
    /// # Errors
    /// If an invariant does not hold; the error names the knot.
    pub fn new(knots: Vec<f64>, degree: usize) -> Result<Self, NurbsError> {
        Self::checked(knots, degree, MAX_DEGREE)
    }

    /// As [`new`](Self::new), with another limit to the degree: for what is lowered before anything else is done with it.
    pub(super) fn checked(knots: Vec<f64>, degree: usize, max: usize) -> Result<Self, NurbsError> {
        if degree == 0 || degree > max {
            return Err(NurbsError::Degree { degree, max });
        }
        let least = 2 * (degree + 1);
        if knots.len() < least {
            return Err(NurbsError::TooFewKnots { count: knots.len(), degree, least });
        }
        for (index, &value) in knots.iter().enumerate() {
            if !value.is_finite() || !(value - knots[0]).is_finite() {
                return Err(NurbsError::KnotNotFinite { index, value });
            }
            if index > 0 && value < knots[index - 1] {
                return Err(NurbsError::KnotDecreases { index, value });
            }
        }
        let (first, last) = (degree, knots.len() - 1 - degree);
        let (start, end) = (knots[first], knots[last]);
        if start >= end {
            return Err(NurbsError::EmptyDomain { first, last, at: start });
        }
        let mut index = 0;
        for run in knots.chunk_by(|a, b| a == b) {
            let (value, multiplicity) = (run[0], run.len());
            let most = if value > start && value < end { degree } else { degree + 1 };
            if multiplicity > most {
                return Err(NurbsError::Multiplicity { index, value, multiplicity, most });
            }
            index += multiplicity;
        }
        Ok(Self { knots, degree })
    }

    /// The vector without inner knots, clamped, on [a, b]: that of one Bézier piece.
    ///
    /// # Errors
    /// If the degree is out of range, or a < b does not hold for finite a and b.
    pub fn bezier(degree: usize, [a, b]: [f64; 2]) -> Result<Self, NurbsError> {
        let ends = [a, b].into_iter().flat_map(|t| core::iter::repeat_n(t, degree.min(MAX_DEGREE) + 1));
        Self::new(ends.collect(), degree)
    }

    /// The clamped vector on [a, b] with `spans` spans of equal length.
    ///
    /// # Errors
    /// If the degree is out of range, or a < b does not hold for finite a and b, or the spans are too many for the
    /// floats between a and b. Zero spans are taken as one.
    pub fn uniform(degree: usize, spans: usize, [a, b]: [f64; 2]) -> Result<Self, NurbsError> {
        let p = degree.min(MAX_DEGREE);
        let mut knots = alloc::vec![a; p + 1];
        knots.extend((1..spans).map(|i| a + (b - a) * (i as f64 / spans as f64)));
        knots.extend(core::iter::repeat_n(b, p + 1));
        Self::new(knots, degree)
    }

    /// A vector that the caller derived from a legal one by an operation that keeps the invariants.
    pub(super) fn trusted(knots: Vec<f64>, degree: usize) -> Self {
        Self { knots, degree }
    }

    /// The degree p.
    #[must_use]
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// All knots, in order.
    #[must_use]
    pub fn as_slice(&self) -> &[f64] {
        &self.knots
    }

    /// Number of control points that belong to the vector, n + 1.
    #[must_use]
    pub fn control_count(&self) -> usize {
        self.knots.len() - self.degree - 1
    }

    /// The interval [tₚ, tₙ₊₁] on which the curve is defined.
    #[must_use]
    pub fn domain(&self) -> [f64; 2] {
        [self.knots[self.degree], self.knots[self.knots.len() - 1 - self.degree]]
    }

    /// The distinct knots in the domain, its ends included: where the polynomial pieces begin and end.
    #[must_use]
    pub fn breaks(&self) -> Vec<f64> {
        let mut breaks = self.knots[self.degree..self.knots.len() - self.degree].to_vec();
        breaks.dedup();
        breaks
    }

    /// How often `t` stands in the vector (0 where it is no knot).
    #[must_use]
    pub fn multiplicity(&self, t: f64) -> usize {
        self.knots.iter().filter(|&&k| k == t).count()
    }

    /// The index k of the span that holds `t`: tₖ ≤ t < tₖ₊₁. The end of the domain belongs to the last span, and what
    /// is outside the domain to the nearest. O(log n).
    #[must_use]
    pub fn span(&self, t: f64) -> usize {
        let [start, end] = self.domain();
        let knots = &self.knots;
        if t >= end {
            return knots.partition_point(|&k| k < end) - 1;
        }
        // A parameter that is not a number compares false and ends in the first span.
        let t = if t > start { t } else { start };
        knots.partition_point(|&k| k <= t) - 1
    }

    /// As [`span`](Self::span), for a knot inside the domain the span `below` it if that is asked for.
    pub(super) fn span_from(&self, t: f64, below: bool) -> usize {
        let k = self.span(t);
        if below && self.knots[k] == t && t > self.domain()[0] {
            self.knots.partition_point(|&knot| knot < t) - 1
        } else {
            k
        }
    }

    /// `t`, or the nearer end of the domain.
    pub(super) fn clamp(&self, t: f64) -> f64 {
        let [start, end] = self.domain();
        t.clamp(start, end)
    }

    /// Whether both ends of the domain have full multiplicity, so that the end control points lie on the curve.
    #[must_use]
    pub fn is_clamped(&self) -> bool {
        let [start, end] = self.domain();
        self.knots[0] == start && self.knots[self.knots.len() - 1] == end
    }

    /// The vector of the reversed curve, on the same domain: t becomes start + end − t. Knots that are a rounding apart
    /// may fall together, which changes no point of the curve.
    #[must_use]
    pub(super) fn reversed(&self) -> Self {
        let [a, b] = self.domain();
        let mirror = |t: f64| {
            let m = a + (b - t);
            if t <= a {
                // Rounding must not move the ends of the domain.
                if t == a { b } else { m.max(b) }
            } else if t >= b {
                if t == b { a } else { m.min(a) }
            } else {
                m.clamp(a, b)
            }
        };
        Self::trusted(self.knots.iter().rev().map(|&t| mirror(t)).collect(), self.degree)
    }

    /// The vector stretched affinely to another domain.
    pub(super) fn stretched(&self, [a, b]: [f64; 2]) -> Result<Self, NurbsError> {
        let [start, end] = self.domain();
        // Equal knots stay equal, and the ends of the domain become a and b exactly.
        let map = |t: f64| {
            let s = (t - start) / (end - start);
            a * (1.0 - s) + b * s
        };
        Self::new(self.knots.iter().map(|&t| map(t)).collect(), self.degree)
    }

    /// The vector with each knot that misses one of `other` by rounding only moved onto it.
    pub(super) fn snapped_to(&self, other: &Self) -> Result<Self, NurbsError> {
        let [start, end] = self.domain();
        // A stretch rounds four times, each by half an ulp of numbers no larger than this.
        let rounding = 2.0 * f64::EPSILON * start.abs().max(end.abs()).max(end - start);
        let targets = other.breaks();
        let snap = |t: f64| targets.iter().copied().find(|k| (k - t).abs() <= rounding).unwrap_or(t);
        Self::new(self.knots.iter().map(|&t| snap(t)).collect(), self.degree)
    }

    /// `Ok` if `t` is strictly inside the domain.
    pub(super) fn check_inside(&self, t: f64) -> Result<(), NurbsError> {
        let [start, end] = self.domain();
        if t > start && t < end { Ok(()) } else { Err(NurbsError::OutsideDomain { t, start, end }) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec;

    #[test]
    fn domain_breaks_and_spans_of_an_unclamped_vector() {
        let k = KnotVector::new(vec![0.0, 1.0, 2.0, 3.0, 3.0, 4.0, 5.0, 6.0], 2).unwrap();
        assert_eq!(k.control_count(), 5);
        assert_eq!(k.domain(), [2.0, 4.0]);
        assert_eq!(k.breaks(), [2.0, 3.0, 4.0]);
        assert_eq!((k.multiplicity(3.0), k.multiplicity(2.5)), (2, 0));
        for (t, span) in [(1.0, 2), (2.0, 2), (2.9, 2), (3.0, 4), (4.0, 4), (9.0, 4), (f64::NAN, 2)] {
            assert_eq!(k.span(t), span, "{t}");
        }
    }

    #[test]
    fn every_defect_is_named() {
        let v = |k: &[f64], p| KnotVector::new(k.to_vec(), p).unwrap_err();
        assert!(matches!(v(&[0.0, 1.0], 0), NurbsError::Degree { degree: 0, .. }));
        assert!(matches!(v(&[0.0; 30], 10), NurbsError::Degree { degree: 10, .. }));
        assert!(matches!(v(&[0.0, 0.0, 1.0], 1), NurbsError::TooFewKnots { count: 3, least: 4, .. }));
        assert!(matches!(v(&[], 3), NurbsError::TooFewKnots { count: 0, .. }));
        assert!(matches!(v(&[0.0, f64::NAN, 1.0, 1.0], 1), NurbsError::KnotNotFinite { index: 1, .. }));
        assert!(matches!(v(&[-1e308, 0.0, 1.0, 1e308], 1), NurbsError::KnotNotFinite { index: 3, .. }));
        assert!(matches!(v(&[0.0, 0.0, 1.0, 0.5], 1), NurbsError::KnotDecreases { index: 3, .. }));
        assert!(matches!(v(&[0.0, 1.0, 1.0, 2.0], 1), NurbsError::EmptyDomain { first: 1, last: 2, .. }));
        let torn = v(&[0.0, 0.0, 1.0, 1.0, 2.0, 2.0], 1);
        assert!(matches!(torn, NurbsError::Multiplicity { index: 2, multiplicity: 2, most: 1, .. }));
        let heaped = v(&[0.0, 0.0, 0.0, 1.0, 1.0], 1);
        assert!(matches!(heaped, NurbsError::Multiplicity { index: 0, multiplicity: 3, most: 2, .. }));
    }

    #[test]
    fn reversal_keeps_the_domain_and_undoes_itself() {
        let k = KnotVector::new(vec![0.1, 0.1, 0.1, 0.35, 0.6, 0.6, 0.9, 1.3], 2).unwrap();
        let r = k.reversed();
        assert_eq!(r.domain(), k.domain());
        for (a, b) in r.reversed().as_slice().iter().zip(k.as_slice()) {
            assert!((a - b).abs() < 1e-15);
        }
    }
}
