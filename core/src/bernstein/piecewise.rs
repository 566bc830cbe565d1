//! Piecewise polynomials: scalar B-spline functions, as the Bernstein polynomials of their spans.

use alloc::vec::Vec;

use super::Univariate;

/// One polynomial piece.
#[derive(Clone, Debug, PartialEq)]
struct Span {
    /// Interval of the parameter.
    t: [f64; 2],
    /// The function on it, by the local parameter on [0, 1].
    polynomial: Univariate,
}

/// A function on an interval that is a polynomial on each of its spans. Sums, differences and products are formed span
/// by span (Elber and Cohen 1992, section 2), and its zeros are those of the whole.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Piecewise {
    spans: Vec<Span>,
}

impl Piecewise {
    /// The function with these polynomials on these intervals, which follow one another.
    #[must_use]
    pub fn new(spans: impl IntoIterator<Item = ([f64; 2], Univariate)>) -> Self {
        Self { spans: spans.into_iter().map(|(t, polynomial)| Span { t, polynomial }).collect() }
    }

    /// The straight line from `from` to `to` over each interval between neighbouring nodes (parameter, value).
    #[must_use]
    pub fn linear(nodes: &[(f64, f64)]) -> Self {
        let line = |w: &[(f64, f64)]| ([w[0].0, w[1].0], Univariate::new(alloc::vec![w[0].1, w[1].1]));
        Self::new(nodes.windows(2).map(line))
    }

    /// The intervals of the spans, with their polynomials.
    pub fn spans(&self) -> impl Iterator<Item = ([f64; 2], &Univariate)> {
        self.spans.iter().map(|s| (s.t, &s.polynomial))
    }

    /// Ends of the domain; `None` without spans.
    #[must_use]
    pub fn domain(&self) -> Option<[f64; 2]> {
        self.spans.first().zip(self.spans.last()).map(|(a, b)| [a.t[0], b.t[1]])
    }

    /// Largest absolute coefficient.
    #[must_use]
    pub fn magnitude(&self) -> f64 {
        self.spans.iter().fold(0.0, |m, s| m.max(s.polynomial.magnitude()))
    }

    /// Value at `t`; at a joint of two spans, of the later one. 0 without spans.
    #[must_use]
    pub fn eval(&self, t: f64) -> f64 {
        let k = self.spans.partition_point(|s| s.t[0] <= t).saturating_sub(1);
        self.spans.get(k).map_or(0.0, |s| s.polynomial.eval((t - s.t[0]) / (s.t[1] - s.t[0])))
    }

    /// Every coefficient times `k`.
    #[must_use]
    pub fn scaled(&self, k: f64) -> Self {
        self.map(|p| p.scaled(k))
    }

    /// Sum of two functions on one domain.
    #[must_use]
    pub fn add(&self, other: &Self) -> Self {
        self.zip(other, Univariate::add)
    }

    /// Difference of two functions on one domain.
    #[must_use]
    pub fn sub(&self, other: &Self) -> Self {
        self.zip(other, Univariate::sub)
    }

    /// Product of two functions on one domain.
    #[must_use]
    pub fn mul(&self, other: &Self) -> Self {
        self.zip(other, Univariate::mul)
    }

    /// The part on [a, b], which lies in the domain.
    #[must_use]
    pub fn restricted(&self, [a, b]: [f64; 2]) -> Self {
        let inside = self.spans.iter().filter(|s| s.t[0] < b && s.t[1] > a);
        Self {
            spans: inside
                .map(|s| {
                    let t = [s.t[0].max(a), s.t[1].min(b)];
                    let local = t.map(|x| (x - s.t[0]) / (s.t[1] - s.t[0]));
                    Span { t, polynomial: s.polynomial.restricted(local[0], local[1]) }
                })
                .collect(),
        }
    }

    /// The intervals on which the function exceeds `noise`, in order, none touching the next. Values up to the noise, and
    /// changes of sign within it, count as not positive or not at all: a function that is noise everywhere is positive nowhere.
    #[must_use]
    pub fn positive(&self, noise: f64) -> Vec<[f64; 2]> {
        let mut out: Vec<[f64; 2]> = Vec::new();
        for s in &self.spans {
            let (lo, hi) = s.polynomial.bounds();
            if hi <= noise {
                continue;
            }
            let at = |x: f64| if x == 1.0 { s.t[1] } else { s.t[0] + x * (s.t[1] - s.t[0]) };
            let mut cuts = alloc::vec![0.0];
            if lo <= noise {
                cuts.extend(s.polynomial.roots_above(noise).iter().map(|r| r.t));
            }
            cuts.push(1.0);
            for w in cuts.windows(2).filter(|w| w[0] < w[1]) {
                if s.polynomial.eval(0.5 * (w[0] + w[1])) <= noise {
                    continue;
                }
                let part = [at(w[0]), at(w[1])];
                match out.last_mut() {
                    Some(last) if last[1] == part[0] => last[1] = part[1],
                    _ => out.push(part),
                }
            }
        }
        out
    }

    fn map(&self, f: impl Fn(&Univariate) -> Univariate) -> Self {
        Self { spans: self.spans.iter().map(|s| Span { t: s.t, polynomial: f(&s.polynomial) }).collect() }
    }

    /// Combines two functions on spans that lie in one span of either.
    fn zip(&self, other: &Self, f: impl Fn(&Univariate, &Univariate) -> Univariate) -> Self {
        let alike =
            self.spans.len() == other.spans.len() && self.spans.iter().zip(&other.spans).all(|(a, b)| a.t == b.t);
        if alike {
            let both = self.spans.iter().zip(&other.spans);
            return Self {
                spans: both.map(|(a, b)| Span { t: a.t, polynomial: f(&a.polynomial, &b.polynomial) }).collect(),
            };
        }
        let (mut spans, mut k) = (Vec::with_capacity(self.spans.len() + other.spans.len()), 0);
        for a in &self.spans {
            while let Some(b) = other.spans.get(k) {
                let t = [a.t[0].max(b.t[0]), a.t[1].min(b.t[1])];
                if t[0] < t[1] {
                    let part = |s: &Span| {
                        let local = t.map(|x| (x - s.t[0]) / (s.t[1] - s.t[0]));
                        s.polynomial.restricted(local[0], local[1])
                    };
                    spans.push(Span { t, polynomial: f(&part(a), &part(b)) });
                }
                if b.t[1] > a.t[1] {
                    break;
                }
                k += 1;
            }
        }
        Self { spans }
    }
}

/// The union of two lists of intervals, each in order; intervals that touch become one.
#[must_use]
pub(crate) fn union(a: &[[f64; 2]], b: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut all: Vec<[f64; 2]> = a.iter().chain(b).copied().collect();
    all.sort_by(|x, y| x[0].total_cmp(&y[0]));
    let mut out: Vec<[f64; 2]> = Vec::with_capacity(all.len());
    for t in all {
        match out.last_mut() {
            Some(last) if last[1] >= t[0] => last[1] = last[1].max(t[1]),
            _ => out.push(t),
        }
    }
    out
}

/// What two lists of intervals, each in order and without overlaps, have in common.
#[must_use]
pub(crate) fn intersection(a: &[[f64; 2]], b: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let common = |x: &[f64; 2], y: &[f64; 2]| {
        let t = [x[0].max(y[0]), x[1].min(y[1])];
        (t[0] < t[1]).then_some(t)
    };
    a.iter().flat_map(|x| b.iter().filter_map(move |y| common(x, y))).collect()
}

/// What is left of `whole` without the intervals of `taken`, which are in order.
#[must_use]
pub(crate) fn complement(whole: [f64; 2], taken: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut out = Vec::with_capacity(taken.len() + 1);
    let mut from = whole[0];
    for t in taken {
        let until = t[0].min(whole[1]);
        if from < until {
            out.push([from, until]);
        }
        from = from.max(t[1]);
    }
    if from < whole[1] {
        out.push([from, whole[1]]);
    }
    out
}

#[cfg(test)]
mod tests {
    use alloc::vec;

    use proptest::prelude::*;

    use super::*;

    fn function(breaks: &[f64], coefficients: &[Vec<f64>]) -> Piecewise {
        let spans = breaks.windows(2).zip(coefficients);
        Piecewise::new(spans.map(|(w, c)| ([w[0], w[1]], Univariate::new(c.clone()))))
    }

    #[test]
    fn zeros_in_joints_part_what_is_positive_and_other_joints_do_not() {
        // Up, down to zero in a joint, up again, and below.
        let f = function(&[0.0, 1.0, 2.0, 4.0], &[vec![1.0, 0.0], vec![0.0, 2.0], vec![2.0, -2.0]]);
        assert_eq!(f.positive(0.0), [[0.0, 3.0]]);
        let g = function(&[0.0, 1.0, 2.0], &[vec![1.0, -1.0], vec![-1.0, 1.0]]);
        assert_eq!(g.positive(0.0), [[0.0, 0.5], [1.5, 2.0]]);
        assert_eq!(g.scaled(-1.0).positive(0.0), [[0.5, 1.5]]);
        assert!(g.positive(1.0).is_empty());
    }

    #[test]
    fn functions_with_other_joints_are_combined_on_both() {
        let f = Piecewise::linear(&[(0.0, 0.0), (2.0, 2.0), (3.0, 5.0)]);
        let g = Piecewise::linear(&[(0.0, 1.0), (1.0, 3.0), (2.5, 0.0), (3.0, 0.0)]);
        for (t, want) in [(0.5, 0.5 * 2.0), (1.75, 1.75 * 1.5), (2.25, 2.75 * 0.5), (2.75, 0.0)] {
            assert!((f.mul(&g).eval(t) - want).abs() < 1e-14, "{t}");
            assert!((f.add(&g).eval(t) - f.eval(t) - g.eval(t)).abs() < 1e-14);
        }
        assert_eq!(f.mul(&g).spans().count(), 4);
        assert_eq!(f.restricted([1.0, 2.5]).domain(), Some([1.0, 2.5]));
    }

    #[test]
    fn intervals_are_united_intersected_and_complemented() {
        let (a, b) = ([[0.0, 1.0], [3.0, 4.0]], [[1.0, 2.0], [3.5, 5.0]]);
        assert_eq!(union(&a, &b), [[0.0, 2.0], [3.0, 5.0]]);
        assert_eq!(intersection(&a, &b), [[3.5, 4.0]]);
        assert_eq!(complement([0.5, 6.0], &a), [[1.0, 3.0], [4.0, 6.0]]);
        assert!(complement([0.0, 1.0], &a).is_empty());
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn positive_is_where_the_values_are(
            coefficients in prop::collection::vec(prop::collection::vec(-1.0..1.0_f64, 1..8), 1..5)
        ) {
            let breaks: Vec<f64> = (0..=coefficients.len()).map(|k| k as f64).collect();
            let f = function(&breaks, &coefficients);
            let found = f.positive(0.0);
            for k in 0..200 * coefficients.len() {
                let t = (k as f64 + 0.5) / 200.0;
                let inside = found.iter().any(|i| i[0] <= t && t <= i[1]);
                if f.eval(t).abs() > 1e-12 {
                    prop_assert_eq!(inside, f.eval(t) > 0.0, "{}", t);
                }
            }
            prop_assert!(found.windows(2).all(|w| w[0][1] < w[1][0]));
        }
    }
}
