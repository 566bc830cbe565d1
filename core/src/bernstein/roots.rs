//! All roots of a polynomial on [0, 1], isolated by the signs of the Bernstein coefficients.
//!
//! Descartes' rule in Bernstein form: the number of sign variations exceeds the number of roots in (0, 1), counted with
//! multiplicity, by an even number. No variation: no root; one: exactly one. Otherwise subdivide.
//! Source: Lane and Riesenfeld 1981, *Bounds on a polynomial*, BIT 21.
//!
//! The rule alone is for exact coefficients: rounding turns a double root into two roots or none. Coefficients therefore
//! come with a noise level. Where the polynomial stays within the noise it has no sign, and such an interval is one
//! *cluster*: a multiple root, several close ones, or a near miss that nobody can tell from a root.

use alloc::vec::Vec;

use super::Univariate;

/// What is known of a root.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RootKind {
    /// The polynomial is monotone here and changes sign, or it reaches zero at an end of [0, 1].
    Simple,
    /// A multiple root, several roots closer than the noise can separate, or a near miss within the noise.
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

/// Bound on the recursion. On an interval 2⁻⁵⁴ wide no polynomial of a usable degree varies by more than its rounding,
/// so the limit only stops subdivision from going on between neighbouring floats.
const MAX_DEPTH: u32 = 54;

/// Coefficients are taken to be right to this fraction of the largest: some 50 roundings of products and sums, what
/// the polynomials of this crate (degree up to 26, products of three factors) have behind them.
const RELATIVE_NOISE: f64 = 1e-14;

/// What subdivision found, in order of t.
enum Event {
    /// One sign change in the interval; `end_noise` tells which of its end values lie within the noise.
    Crossing { t: f64, interval: [f64; 2], end_noise: [bool; 2] },
    /// The polynomial is monotone beside `t`, towards zero, and within the noise at `t`, which it does not pass;
    /// `flat` where its slope at `t` is noise too.
    Touch { t: f64, rising: bool, flat: bool },
    /// Nothing but noise on the interval.
    Noise { interval: [f64; 2] },
}

/// Neighbouring events that are one root.
struct Group {
    interval: [f64; 2],
    crossing: Option<f64>,
    /// Whether more than one simple root may be meant.
    cluster: bool,
    /// Direction of the polynomial at its touches.
    rising: Option<bool>,
    touches: u32,
}

impl Univariate {
    /// Roots on [0, 1] in increasing order; none for a polynomial that vanishes identically.
    ///
    /// The coefficients are taken to be right to 10⁻¹⁴ of the largest. Simple roots are as exact as the evaluation
    /// allows; clusters (multiple roots, near misses) are reported once, with [`RootKind::Cluster`]. Cost: O(n²) per
    /// subdivision; well separated roots need a few each, a cluster some 50.
    #[must_use]
    pub fn roots(&self) -> Vec<Root> {
        self.roots_above(self.magnitude() * RELATIVE_NOISE)
    }

    /// As [`roots`](Self::roots), with coefficients known to be right to ±`noise` only. Where no value exceeds the noise
    /// there is a cluster; a polynomial with no coefficient beyond the noise, or with one that is not finite,
    /// has no roots to speak of, and none is given.
    #[must_use]
    pub fn roots_above(&self, noise: f64) -> Vec<Root> {
        let noise = noise.max(0.0);
        if self.magnitude() <= noise || !self.coefficients().iter().all(|c| c.is_finite()) {
            return Vec::new();
        }
        let mut roots = Vec::new();
        let mut group: Option<Group> = None;
        for event in self.isolate(noise) {
            let next = Group::of(event);
            match &mut group {
                Some(g) if g.joins(&next) => g.absorb(&next),
                _ => {
                    roots.extend(group.take().and_then(|g| g.root(self)));
                    group = Some(next);
                }
            }
        }
        roots.extend(group.and_then(|g| g.root(self)));
        roots
    }

    /// Subdivides until every interval is decided.
    fn isolate(&self, noise: f64) -> Vec<Event> {
        let mut events = Vec::new();
        let mut stack = Vec::new();
        stack.push((self.clone(), 0.0, 1.0, 0));
        while let Some((p, a, b, depth)) = stack.pop() {
            let c = p.coefficients();
            let (first, last) = (c[0], c[c.len() - 1]);
            let variations = variations(c);
            if variations == 0 && c.iter().all(|x| x.abs() > noise) {
                continue;
            }
            let monotone = is_monotone(c);
            let end_noise = [first.abs() <= noise, last.abs() <= noise];
            let opposite = (first < 0.0 && last > 0.0) || (first > 0.0 && last < 0.0);
            if opposite && (monotone || (variations == 1 && end_noise == [false, false])) {
                let t = a + bracketed(|t| p.eval(t), [0.0, 1.0], [first, last]) * (b - a);
                events.push(Event::Crossing { t, interval: [a, b], end_noise });
            } else if depth >= MAX_DEPTH || c.iter().all(|x| x.abs() <= noise) {
                events.push(Event::Noise { interval: [a, b] });
            } else if monotone {
                // No sign change strictly inside; the smaller end may be zero.
                let n = c.len() - 1;
                let (t, value, beside) = if first.abs() <= last.abs() { (a, first, c[1]) } else { (b, last, c[n - 1]) };
                if value.abs() <= noise {
                    events.push(Event::Touch { t, rising: first < last, flat: beside.abs() <= noise });
                }
            } else {
                let m = 0.5 * (a + b);
                let (l, r) = p.split(0.5);
                // The right half waits on the stack, so that events come out in order.
                stack.push((r, m, b, depth + 1));
                stack.push((l, a, m, depth + 1));
            }
        }
        events
    }
}

impl Group {
    fn of(event: Event) -> Self {
        match event {
            Event::Crossing { t, interval, end_noise } => {
                // An end with a decided value parts the root from whatever lies beyond.
                let a = if end_noise[0] { interval[0] } else { t };
                let b = if end_noise[1] { interval[1] } else { t };
                Self { interval: [a, b], crossing: Some(t), cluster: false, rising: None, touches: 0 }
            }
            Event::Touch { t, rising, flat } => {
                Self { interval: [t, t], crossing: None, cluster: flat, rising: Some(rising), touches: 1 }
            }
            Event::Noise { interval } => Self { interval, crossing: None, cluster: true, rising: None, touches: 0 },
        }
    }

    /// Whether `next` begins where this group ends. Both numbers are then the same subdivision point, bit for bit.
    fn joins(&self, next: &Self) -> bool {
        self.interval[1] == next.interval[0]
    }

    fn absorb(&mut self, next: &Self) {
        self.interval[1] = next.interval[1];
        // Two crossings in one group are two roots that only noise separates; a rise that meets a fall is an extremum.
        let two = self.crossing.is_some() && next.crossing.is_some();
        let extremum = self.rising.is_some_and(|r| next.rising.is_some_and(|s| r != s));
        self.cluster |= next.cluster || two || extremum;
        self.crossing = self.crossing.or(next.crossing);
        self.rising = next.rising.or(self.rising);
        self.touches += next.touches;
    }

    /// The group as one root, if it is one.
    fn root(&self, p: &Univariate) -> Option<Root> {
        let [a, b] = self.interval;
        if !self.cluster {
            let t = self.crossing.unwrap_or(a);
            // A touch from one side only is passed by the polynomial on the other; at an end of the domain there is no
            // other side.
            let is_root = self.crossing.is_some() || self.touches > 1 || a == 0.0 || a == 1.0;
            return is_root.then_some(Root { t, kind: RootKind::Simple });
        }
        let (fa, fb) = (p.eval(a), p.eval(b));
        let d = p.derivative();
        let (da, db) = (d.eval(a), d.eval(b));
        let t = if fa * fb < 0.0 {
            bracketed(|t| p.eval(t), [a, b], [fa, fb])
        } else if da * db < 0.0 {
            // An even root: the extremum is far better conditioned than the value.
            bracketed(|t| d.eval(t), [a, b], [da, db])
        } else if fa.abs() <= fb.abs() {
            a
        } else {
            b
        };
        Some(Root { t, kind: RootKind::Cluster })
    }
}

/// Sign variations of the coefficients, zeros left out.
fn variations(c: &[f64]) -> usize {
    let mut last = 0.0;
    let mut n = 0;
    for &x in c {
        if x != 0.0 {
            if last != 0.0 && (last < 0.0) != (x < 0.0) {
                n += 1;
            }
            last = x;
        }
    }
    n
}

/// Whether the control polygon, and with it the polynomial, only rises or only falls, and does not stand still throughout.
fn is_monotone(c: &[f64]) -> bool {
    let rises = c.windows(2).all(|w| w[0] <= w[1]);
    let falls = c.windows(2).all(|w| w[0] >= w[1]);
    rises != falls
}

/// The zero of `f` between the ends of `x`, where it has the values `y` of opposite sign: regula falsi (Illinois) with
/// bisection as safeguard, until no float lies between or the value is zero.
pub(crate) fn bracketed(f: impl Fn(f64) -> f64, x: [f64; 2], y: [f64; 2]) -> f64 {
    let ([mut lo, mut hi], [mut flo, mut fhi]) = (x, y);
    // The Illinois weights make the secant overshoot; the true values choose the better end at last.
    let (mut true_lo, mut true_hi) = (flo, fhi);
    let mut side = 0;
    for i in 0..200 {
        let middle = 0.5 * (lo + hi);
        if middle <= lo || middle >= hi {
            break;
        }
        let secant = (lo * fhi - hi * flo) / (fhi - flo);
        // Every fourth step bisects, so that the bracket shrinks whatever the shape.
        let t = if i % 4 == 3 || !(secant > lo && secant < hi) { middle } else { secant };
        let value = f(t);
        if value == 0.0 {
            return t;
        }
        if (value < 0.0) == (flo < 0.0) {
            (lo, flo, true_lo) = (t, value, value);
            if side == -1 {
                fhi *= 0.5;
            }
            side = -1;
        } else {
            (hi, fhi, true_hi) = (t, value, value);
            if side == 1 {
                flo *= 0.5;
            }
            side = 1;
        }
    }
    if true_lo.abs() < true_hi.abs() { lo } else { hi }
}

#[cfg(test)]
mod tests {
    use alloc::vec;

    use proptest::prelude::*;

    use super::*;

    fn from_roots(roots: &[f64]) -> Univariate {
        roots.iter().fold(Univariate::constant(1.0), |p, r| p.mul(&Univariate::new(vec![-r, 1.0 - r])))
    }

    fn assert_all_simple(want: &[f64], tolerance: f64) {
        let got = from_roots(want).roots();
        assert_eq!(got.len(), want.len(), "{got:?}");
        for (g, w) in got.iter().zip(want) {
            assert!((g.t - w).abs() < tolerance, "{g:?} {w}");
            assert_eq!(g.kind, RootKind::Simple);
        }
    }

    #[test]
    fn planted_roots_are_all_found() {
        assert_all_simple(&[0.0, 0.1, 0.1001, 0.5, 0.9, 1.0], 1e-9);
        assert_all_simple(&[1e-12, 0.5, 1.0 - 1e-12], 1e-15);
        // A value of p between these two is some 10⁻¹¹ of the coefficients, a thousand times the noise.
        assert_all_simple(&[0.3, 0.300_01, 0.7], 1e-9);
    }

    #[test]
    fn a_root_at_a_subdivision_point_is_one_simple_root() {
        for want in [0.5, 0.25, 0.375] {
            let got = from_roots(&[want, -0.3, 1.7]).roots();
            assert_eq!(got, [Root { t: want, kind: RootKind::Simple }]);
        }
    }

    #[test]
    fn a_double_root_is_one_cluster() {
        for double in [0.3, 0.5, 0.7123] {
            let got = from_roots(&[double, double, 0.8]).roots();
            assert_eq!(got.len(), 2, "{got:?}");
            assert!((got[0].t - double).abs() < 1e-12 && got[0].kind == RootKind::Cluster, "{got:?}");
            assert!((got[1].t - 0.8).abs() < 1e-12 && got[1].kind == RootKind::Simple, "{got:?}");
        }
    }

    #[test]
    fn roots_a_few_ulps_apart_are_one_cluster() {
        for ulps in 1..5 {
            let near = 0.3 + f64::from(ulps) * 5.6e-17;
            let got = from_roots(&[0.3, near, 0.8, 0.8 + f64::from(ulps) * 1.2e-16]).roots();
            assert_eq!(got.len(), 2, "{got:?}");
            assert!((got[0].t - 0.3).abs() < 1e-12 && got[0].kind == RootKind::Cluster, "{got:?}");
            assert!((got[1].t - 0.8).abs() < 1e-12 && got[1].kind == RootKind::Cluster, "{got:?}");
        }
    }

    #[test]
    fn a_triple_root_is_one_cluster() {
        let got = from_roots(&[0.37, 0.37, 0.37]).roots();
        assert_eq!(got.len(), 1, "{got:?}");
        // The cube root of the noise is the resolution.
        assert!((got[0].t - 0.37).abs() < 3e-5 && got[0].kind == RootKind::Cluster, "{got:?}");
    }

    #[test]
    fn a_near_miss_counts_within_the_noise_only() {
        let square = from_roots(&[0.3, 0.3]);
        let lifted = |by: f64| square.add(&Univariate::constant(by));
        assert_eq!(lifted(1e-16).roots().len(), 1);
        assert_eq!(lifted(1e-12).roots().len(), 0);
        assert_eq!(lifted(-1e-12).roots().len(), 2);
        let told = lifted(1e-12).roots_above(1e-11);
        assert_eq!(told.len(), 1);
        assert!((told[0].t - 0.3).abs() < 1e-12 && told[0].kind == RootKind::Cluster, "{told:?}");
    }

    #[test]
    fn multiple_roots_at_the_ends_are_reported_there() {
        let got = from_roots(&[0.0, 0.0, 0.4, 1.0, 1.0, 1.0]).roots();
        assert_eq!(got.len(), 3, "{got:?}");
        assert_eq!(got[0], Root { t: 0.0, kind: RootKind::Cluster });
        assert!((got[1].t - 0.4).abs() < 1e-12 && got[1].kind == RootKind::Simple, "{got:?}");
        assert_eq!(got[2], Root { t: 1.0, kind: RootKind::Cluster });
    }

    #[test]
    fn all_roots_of_degree_26() {
        // Equally spaced roots: values between them are some 10⁻⁹ of the coefficients. The condition number of the root
        // (Farouki and Rajan 1987, CAGD 4, eq. 21) times the rounding of the 26 products and of de Casteljau.
        for want in [
            (1..=26).map(|i| f64::from(i) / 27.0).collect::<Vec<f64>>(),
            (0..=25).map(|i| f64::from(i) / 25.0).collect(),
        ] {
            let p = from_roots(&want);
            let (d, size) = (p.derivative(), Univariate::new(p.coefficients().iter().map(|c| c.abs()).collect()));
            let got = p.roots();
            assert_eq!(got.len(), 26, "{got:?}");
            for (g, w) in got.iter().zip(want) {
                let condition = size.eval(w) / d.eval(w).abs();
                assert!((g.t - w).abs() <= 52.0 * f64::EPSILON * condition, "{g:?} {w} {condition:e}");
                assert_eq!(g.kind, RootKind::Simple);
            }
        }
    }

    #[test]
    fn no_root_and_no_polynomial() {
        assert!(Univariate::new(vec![1.0, 2.0, 0.5]).roots().is_empty());
        assert!(Univariate::new(vec![0.0, 0.0]).roots().is_empty());
        assert!(Univariate::new(vec![3.0]).roots().is_empty());
        assert!(Univariate::new(vec![f64::NAN, 1.0]).roots().is_empty());
        assert!(Univariate::new(vec![f64::INFINITY, -1.0]).roots().is_empty());
        assert!(Univariate::new(vec![1.0, -1.0]).roots_above(1.0).is_empty());
    }

    /// Coefficients of any sign, with zeros and tiny values among them.
    fn polynomials() -> impl Strategy<Value = Univariate> {
        let c = prop_oneof![4 => -1.0..1.0_f64, 1 => Just(0.0), 1 => -1e-9..1e-9_f64, 1 => -1e-15..1e-15_f64];
        prop::collection::vec(c, 1..28).prop_map(Univariate::new)
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(512) })]

        #[test]
        fn roots_are_in_order_and_the_polynomial_is_noise_there(p in polynomials()) {
            let roots = p.roots();
            prop_assert!(roots.windows(2).all(|w| w[0].t < w[1].t), "{roots:?}");
            for r in &roots {
                prop_assert!((0.0..=1.0).contains(&r.t));
                prop_assert!(p.eval(r.t).abs() <= 1.1e-14 * p.magnitude(), "{r:?} {}", p.eval(r.t));
            }
        }

        #[test]
        fn no_change_of_sign_is_without_a_root(p in polynomials()) {
            let roots = p.roots();
            let noise = 2e-14 * p.magnitude();
            let decided: Vec<(f64, f64)> =
                (0..=400).map(|i| f64::from(i) / 400.0).map(|t| (t, p.eval(t))).filter(|(_, y)| y.abs() > noise).collect();
            for w in decided.windows(2) {
                let between = roots.iter().filter(|r| w[0].0 < r.t && r.t < w[1].0);
                if (w[0].1 < 0.0) != (w[1].1 < 0.0) {
                    prop_assert!(between.count() > 0, "lost between {} and {}", w[0].0, w[1].0);
                } else {
                    // Simple roots come in pairs here, clusters as they like.
                    let kinds: Vec<_> = between.map(|r| r.kind).collect();
                    prop_assert!(kinds.contains(&RootKind::Cluster) || kinds.len() % 2 == 0, "{kinds:?}");
                }
            }
        }

        #[test]
        fn scaling_moves_no_root(p in polynomials(), e in -300..300_i32) {
            // A power of two is exact, as long as nothing underflows: the tiniest coefficients are dropped.
            let coarse = |c: &f64| if c.abs() < 1e-12 { 0.0 } else { *c };
            let p = Univariate::new(p.coefficients().iter().map(coarse).collect());
            prop_assert_eq!(p.roots(), p.scaled(libm::ldexp(1.0, e)).roots());
        }

        #[test]
        fn well_separated_roots_are_all_simple(gaps in prop::collection::vec(0.05..0.2_f64, 1..8)) {
            let roots: Vec<f64> = gaps.iter().scan(0.0, |t, g| { *t += g; Some(*t) }).filter(|&t| t < 1.0).collect();
            assert_all_simple(&roots, 1e-10);
        }
    }
}
