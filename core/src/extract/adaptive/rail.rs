//! A part of an isocurve between the two that it will be compared with, and the distance between two such parts.

use alloc::vec;
use alloc::vec::Vec;

use glam::{DVec2, DVec3, DVec4};

use super::Metric;
use crate::bernstein::{Piecewise, Univariate, product};
use crate::line::{Axis, Line};
use crate::view::ViewScene;

/// Part of a rail in one patch.
#[derive(Clone, Debug)]
pub(super) struct RailSpan {
    /// Interval of the running parameter, inside one knot interval.
    pub(super) t: [f64; 2],
    /// Homogeneous control points on it, in view space.
    pub(super) points: Vec<DVec4>,
}

/// A part of an isocurve over an interval of its running parameter.
#[derive(Clone, Debug)]
pub(super) struct Rail {
    pub(super) spans: Vec<RailSpan>,
}

impl Rail {
    /// The isocurve at the constant parameter `s` over `t`, which lies in the surface's domain. O(p·q) a patch.
    pub(super) fn new(view: &ViewScene, surface: usize, axis: Axis, s: f64, t: [f64; 2]) -> Self {
        let line = Line::over(view, surface, axis, s, false, t);
        let whole = line.spans.into_iter().map(|span| RailSpan { t: span.t, points: span.points });
        Self { spans: whole.collect() }.cut(t)
    }

    /// The part over `t`.
    pub(super) fn cut(&self, t: [f64; 2]) -> Self {
        let inside = self.spans.iter().filter(|s| s.t[0] < t[1] && s.t[1] > t[0]);
        let part = |s: &RailSpan| {
            let within = [s.t[0].max(t[0]), s.t[1].min(t[1])];
            let local = within.map(|x| (x - s.t[0]) / (s.t[1] - s.t[0]));
            RailSpan { t: within, points: restricted(&s.points, local) }
        };
        Self { spans: inside.map(part).collect() }
    }

    /// Interval of the running parameter.
    pub(super) fn domain(&self) -> Option<[f64; 2]> {
        self.spans.first().zip(self.spans.last()).map(|(a, b)| [a.t[0], b.t[1]])
    }

    /// Length of the control polygon on the screen: a bound of the length.
    pub(super) fn length_bound(&self) -> f64 {
        let at = |h: &DVec4| h.truncate().truncate() / h.w;
        self.spans.iter().flat_map(|s| s.points.windows(2)).map(|w| at(&w[0]).distance(at(&w[1]))).sum()
    }
}

/// Control points of the part over `t` of a Bézier curve, by corner cutting at both ends.
pub(crate) fn restricted(points: &[DVec4], t: [f64; 2]) -> Vec<DVec4> {
    let mut c = points.to_vec();
    let n = c.len();
    if t[1] < 1.0 {
        // The lower part at t₁ grows from the beginning.
        for r in 1..n {
            for k in (r..n).rev() {
                c[k] = c[k - 1] + (c[k] - c[k - 1]) * t[1];
            }
        }
    }
    if t[0] > 0.0 {
        // The upper part of that grows from the end.
        let x = t[0] / t[1];
        for r in 1..n {
            for k in 0..n - r {
                c[k] = c[k] + (c[k + 1] - c[k]) * x;
            }
        }
    }
    c
}

/// The weight that all of some points have; `None` if they have more than one.
pub(super) fn common_weight<'a>(mut points: impl Iterator<Item = &'a DVec4>) -> Option<f64> {
    let w = points.next()?.w;
    points.all(|p| p.w == w).then_some(w)
}

/// The squared distance between corresponding points of two rails over the same interval, as a quotient of piecewise
/// polynomials (Elber and Cohen 1992, definition 4 and eq. 2).
#[derive(Clone, Debug)]
pub(super) struct IsoDistance {
    /// Numerator N ≥ 0.
    pub(super) above: Piecewise,
    /// Denominator D > 0.
    pub(super) below: Piecewise,
}

impl IsoDistance {
    /// Formed symbolically from the control points: of degree 2p for rails of degree p whose points all have one weight,
    /// else with C₁ − C₂ = (P₁ w₂ − P₂ w₁) / (w₁ w₂) numerator and denominator of degree 4p.
    pub(super) fn new(a: &Rail, b: &Rail, metric: Metric) -> Self {
        let (mut above, mut below) = (Vec::new(), Vec::new());
        for (x, y) in a.spans.iter().zip(&b.spans) {
            let (n, d) = squared(&x.points, &y.points, metric);
            above.push((x.t, n));
            below.push((x.t, d));
        }
        Self { above: Piecewise::new(above), below: Piecewise::new(below) }
    }

    /// The squared distance on the screen from the points of `rail` to corresponding ones of `other`, across `rail`: of what
    /// leads from one to the other the part that is perpendicular to the rail's direction. Where isocurves are skew to what joins
    /// their corresponding points it is the gap that the eye sees between them. With the direction T, of degree p − 1,
    /// else T ∝ P′ w − P w′ of degree 2p − 1, it is (V × T)² / (|T|² (w₁ w₂)²), V = P₁ w₂ − P₂ w₁.
    pub(super) fn across(rail: &Rail, other: &Rail) -> Self {
        let (mut above, mut below) = (Vec::new(), Vec::new());
        for (x, y) in rail.spans.iter().zip(&other.spans) {
            let (a, b) = (&x.points, &y.points);
            let flat = |v: DVec4| v.truncate().truncate();
            let n = (a.len() - 1) as f64;
            let slope: Vec<DVec4> = a.windows(2).map(|w| (w[1] - w[0]) * n).collect();
            let (along, to, weight) = match common_weight(a.iter().chain(b)) {
                Some(w) => {
                    let along: Vec<DVec2> = slope.iter().map(|d| flat(*d) / w).collect();
                    let to: Vec<DVec2> = a.iter().zip(b).map(|(p, q)| (flat(*q) - flat(*p)) / w).collect();
                    (along, to, Univariate::constant(1.0))
                }
                None => {
                    let along = product(a, &slope, |p: DVec4, d: DVec4| flat(d) * p.w - flat(p) * d.w);
                    let to = product(a, b, |p: DVec4, q: DVec4| flat(q) * p.w - flat(p) * q.w);
                    (along, to, Univariate::new(product(a, b, |p: DVec4, q: DVec4| p.w * q.w)))
                }
            };
            let cross = Univariate::new(product(&along, &to, |t: DVec2, v: DVec2| t.perp_dot(v)));
            let speed = Univariate::new(product(&along, &along, |s: DVec2, t: DVec2| s.dot(t)));
            above.push((x.t, cross.mul(&cross)));
            below.push((x.t, speed.mul(&weight.mul(&weight))));
        }
        Self { above: Piecewise::new(above), below: Piecewise::new(below) }
    }

    /// The distance over a part of the interval: nothing is formed again.
    pub(super) fn part(&self, t: [f64; 2]) -> Self {
        Self { above: self.above.restricted(t), below: self.below.restricted(t) }
    }

    /// The largest distance, exact: at an end of a span, or where the derivative N′D − ND′ of the square vanishes.
    pub(super) fn maximum(&self) -> f64 {
        let mut most = 0.0_f64;
        for ((_, n), (_, d)) in self.above.spans().zip(self.below.spans()) {
            let slope = n.derivative().mul(d).sub(&n.mul(&d.derivative()));
            let stationary = slope.roots();
            for x in stationary.iter().map(|r| r.t).chain([0.0, 1.0]) {
                most = most.max(n.eval(x).max(0.0) / d.eval(x));
            }
        }
        libm::sqrt(most)
    }
}

fn squared(a: &[DVec4], b: &[DVec4], metric: Metric) -> (Univariate, Univariate) {
    let dot = |x: DVec3, y: DVec3| match metric {
        Metric::Screen => x.truncate().dot(y.truncate()),
        Metric::Space => x.dot(y),
    };
    if let Some(w) = common_weight(a.iter().chain(b)) {
        let difference: Vec<DVec3> = a.iter().zip(b).map(|(p, q)| (p.truncate() - q.truncate()) / w).collect();
        return (Univariate::new(product(&difference, &difference, dot)), Univariate::constant(1.0));
    }
    let difference = product(a, b, |p: DVec4, q: DVec4| p.truncate() * q.w - q.truncate() * p.w);
    let weight = product(a, b, |p: DVec4, q: DVec4| p.w * q.w);
    let weight = Univariate::new(weight);
    (Univariate::new(product(&difference, &difference, dot)), weight.mul(&weight))
}

/// The nodes of a piecewise linear function that follows `f` along some rail: spans are halved until the middle is within
/// `tolerance` of the chord, at least twice and at most [`HALVINGS`] times.
pub(super) fn followed(rail: &Rail, tolerance: f64, f: &dyn Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let mut nodes = Vec::new();
    for span in &rail.spans {
        let ends = span.t.map(|t| (t, f(t)));
        if nodes.is_empty() {
            nodes = vec![ends[0]];
        }
        follow(f, ends, tolerance, 0, &mut nodes);
    }
    nodes
}

/// Most halvings of a span by [`followed`].
const HALVINGS: u32 = 7;

fn follow(f: &dyn Fn(f64) -> f64, [a, b]: [(f64, f64); 2], tolerance: f64, depth: u32, nodes: &mut Vec<(f64, f64)>) {
    let t = 0.5 * (a.0 + b.0);
    let middle = (t, f(t));
    let close = (middle.1 - 0.5 * (a.1 + b.1)).abs() <= tolerance;
    if depth >= HALVINGS || (depth >= 2 && close) {
        nodes.push(b);
        return;
    }
    follow(f, [a, middle], tolerance, depth + 1, nodes);
    follow(f, [middle, b], tolerance, depth + 1, nodes);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Scene, SceneSurface};
    use crate::shape::{Frame, torus};
    use crate::view::Camera;

    fn ring() -> ViewScene {
        let surface = torus(&Frame::WORLD, 3.0, 1.0).unwrap();
        let scene = Scene { name: "t".into(), surfaces: vec![SceneSurface::new("t", surface)] };
        ViewScene::new(&scene, &Camera::orthographic(DVec3::new(1.0, 0.3, 0.7), DVec3::Z).unwrap()).unwrap()
    }

    #[test]
    fn a_part_of_a_rail_runs_through_the_same_points() {
        let view = ring();
        let whole = Line::new(&view, 0, Axis::V, 0.3, false);
        let part = Rail::new(&view, 0, Axis::V, 0.3, [0.1, 0.6]).cut([0.15, 0.55]);
        assert_eq!(part.domain(), Some([0.15, 0.55]));
        for s in &part.spans {
            for (k, h) in [(0, s.points[0]), (1, s.points[s.points.len() - 1])] {
                assert!((h.truncate() / h.w - whole.point(s.t[k])).length() < 1e-14);
            }
            let (t, h) = (0.5 * (s.t[0] + s.t[1]), crate::view::curve_point(&s.points, 0.5));
            assert!((h.truncate() / h.w - whole.point(t)).length() < 1e-14);
        }
    }

    #[test]
    fn the_symbolic_distance_is_the_distance() {
        let view = ring();
        for metric in [Metric::Screen, Metric::Space] {
            let [a, b] = [0.2, 0.45].map(|s| Rail::new(&view, 0, Axis::U, s, [0.0, 1.0]));
            let [la, lb] = [0.2, 0.45].map(|s| Line::new(&view, 0, Axis::U, s, false));
            let distance = IsoDistance::new(&a, &b, metric);
            let mut most = 0.0_f64;
            for k in 0..=1000 {
                let t = f64::from(k) / 1000.0;
                let d = la.point(t) - lb.point(t);
                let want = if metric == Metric::Screen { d.truncate().length() } else { d.length() };
                let got = libm::sqrt(distance.above.eval(t) / distance.below.eval(t));
                assert!((got - want).abs() < 1e-12, "{t}: {got} {want}");
                most = most.max(want);
            }
            assert!(distance.maximum() >= most - 1e-12 && distance.maximum() < most + 1e-4);
        }
    }

    #[test]
    fn the_distance_across_is_that_from_the_tangent() {
        let view = ring();
        let [rail, other] = [0.2, 0.21].map(|s| Rail::new(&view, 0, Axis::V, s, [0.0, 1.0]));
        let [line, beside] = [0.2, 0.21].map(|s| Line::new(&view, 0, Axis::V, s, false));
        let across = IsoDistance::across(&rail, &other);
        for k in 0..200 {
            let t = (f64::from(k) + 0.5) / 200.0;
            let ((p, d), q) = (line.jet(t), beside.point(t));
            let want = (q - p).truncate().perp_dot(d.truncate().normalize()).abs();
            let got = libm::sqrt(across.above.eval(t) / across.below.eval(t));
            assert!((got - want).abs() < 1e-9, "{t}: {got} {want}");
        }
    }

    #[test]
    fn a_function_is_followed_to_the_tolerance() {
        let rail = Rail::new(&ring(), 0, Axis::U, 0.2, [0.0, 1.0]);
        let f = |t: f64| libm::sin(7.0 * t);
        let line = Piecewise::linear(&followed(&rail, 0.01, &f));
        for k in 0..=1000 {
            let t = f64::from(k) / 1000.0;
            assert!((line.eval(t) - f(t)).abs() < 0.011, "{t}");
        }
    }
}
