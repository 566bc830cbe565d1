//! Following the image of a curve: cubics in (u, v) through feet of the curve's points, with the image's derivatives.
//!
//! A step is taken from a foot to the next, and kept where the cubic between them is on the surface where the curve is, at
//! all places looked at. So it does not matter how a foot was found: one on another sheet makes a cubic that is elsewhere,
//! and the step is halved.

use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::PullBackError;
use super::foot::{hessian, solve};
use super::pole::Pole;
use super::sheet::Sheet;
use crate::bernstein::bracketed;
use crate::nurbs::{Curve, SurfaceJet};

/// A cubic over an interval of the curve's parameter.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cubic {
    pub(super) t: [f64; 2],
    /// Bézier control points in (u, v).
    pub(super) b: [DVec2; 4],
}

/// How far an image is from its curve.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Miss {
    /// Along the surface.
    pub(super) along: f64,
    /// In all.
    pub(super) total: f64,
    /// From the surface.
    pub(super) off: f64,
}

impl Miss {
    pub(super) fn with(self, other: Self) -> Self {
        Self { along: self.along.max(other.along), total: self.total.max(other.total), off: self.off.max(other.off) }
    }
}

/// A point of the image.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) t: f64,
    pub(super) uv: DVec2,
}

/// A place where the walk must stop: the curve is not smooth there, or ends, perhaps in a pole.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stop {
    pub(super) t: f64,
    pub(super) pole: Option<Pole>,
}

/// Steps of one curve, tried or taken, before it is given up.
const STEPS: usize = 20_000;

/// The shortest step, of the domain of the curve.
const SHORTEST: f64 = 1e-12;

/// Following one curve.
pub(super) struct Walk<'a> {
    pub(super) sheet: &'a Sheet<'a>,
    pub(super) curve: &'a Curve,
    /// Distinct knots of the curve.
    pub(super) breaks: &'a [f64],
    /// Largest distance along the surface between the image and the feet of the curve.
    pub(super) tolerance: f64,
    /// Largest distance of the curve from the surface.
    pub(super) limit: f64,
    pub(super) steps: usize,
}

impl Walk<'_> {
    /// Appends the cubics from `from` to the last of the stops, which are in the order in which they are reached; each cubic
    /// runs in the direction of the curve, whatever that of the walk.
    pub(super) fn follow(&mut self, from: Node, stops: &[Stop], out: &mut Vec<Cubic>) -> Result<Miss, PullBackError> {
        let (mut here, mut miss) = (from, Miss::default());
        let [a, b] = self.curve.domain();
        let mut reach = b - a;
        for stop in stops {
            while here.t != stop.t {
                let whole = (stop.t - here.t).abs();
                // No sliver is left before the stop.
                let mut step = if reach >= 0.75 * whole { whole } else { reach };
                loop {
                    self.steps += 1;
                    let t = if step == whole { stop.t } else { here.t + step.copysign(stop.t - here.t) };
                    let pole = stop.pole.filter(|_| t == stop.t);
                    if self.steps > STEPS || step <= SHORTEST * (b - a) || t == here.t {
                        return Err(self.lost(here, t));
                    }
                    match self.attempt(here, t, pole) {
                        Ok((cubic, node, found)) => {
                            out.push(cubic);
                            miss = miss.with(found);
                            // The error of a cubic grows with the fourth power of its length.
                            let growth =
                                libm::sqrt(libm::sqrt(self.tolerance / found.along.max(1e-4 * self.tolerance)));
                            reach = 0.9 * (node.t - here.t).abs() * growth.min(4.0);
                            here = node;
                            break;
                        }
                        Err(over) => step *= (0.9 / libm::sqrt(libm::sqrt(over))).clamp(0.1, 0.5),
                    }
                }
            }
        }
        Ok(miss)
    }

    /// Why the walk got no further than `here`: the curve is off the surface beyond, or the image has a jump.
    fn lost(&self, here: Node, beyond: f64) -> PullBackError {
        let far = |t: f64| {
            let at = self.curve.eval(t);
            (self.sheet.foot(at, self.limit).distance, at)
        };
        let (a, b) = (far(here.t), far(beyond));
        let (distance, at) = if a.0 > b.0 { a } else { b };
        if distance > self.limit {
            PullBackError::Off { at: at.to_array(), distance, limit: self.limit }
        } else {
            PullBackError::Lost { at: at.to_array() }
        }
    }

    /// The cubic from `here` to `t`, or to the first line before it over which the surface is not smooth, its other end,
    /// and how far it is off; or else by how much the tolerance is exceeded, about.
    fn attempt(&self, here: Node, t: f64, pole: Option<Pole>) -> Result<(Cubic, Node, Miss), f64> {
        const HOPELESS: f64 = 16.0;
        let ahead = t > here.t;
        let first = self.slope(here, ahead);
        let mut guess = first * (t - here.t);
        let far = (guess.abs() / self.sheet.range).max_element();
        if far > 0.5 {
            guess *= 0.5 / far;
        }
        let guess = here.uv + guess;
        let [at, c1, c2] = self.curve.derivatives_from(t, ahead);
        let (mut end, distance) = if let Some(pole) = pole {
            let secant = self.curve.eval(here.t) - at;
            let tangent = if ahead { -c1 } else { c1 };
            // A curve that stands still in its end has the direction of the secant, about.
            let leaving = if tangent.dot(secant) > 0.0 { tangent } else { secant };
            (Node { t, uv: pole.limit(self.sheet, here.uv, leaving) }, (pole.point - at).length())
        } else {
            let foot = self.sheet.foot_near(at, guess);
            if foot.distance > self.limit {
                return Err(HOPELESS);
            }
            (Node { t, uv: foot.uv }, foot.distance)
        };
        let mut last = pole.map(|p| p.slope(self.sheet, end.uv, c1, c2));
        // Each line between is crossed where the walk comes to it first: then none is left.
        for _ in 0..4 {
            let Some((d, line)) = self.sheet.rough_line_between(here.uv, end.uv) else { break };
            end = self.crossing(here, end, d, line).ok_or(HOPELESS)?;
            last = None;
        }
        let last = last.unwrap_or_else(|| self.slope(end, !ahead));
        let third = (end.t - here.t) / 3.0;
        let b = [here.uv, here.uv + first * third, end.uv - last * third, end.uv].map(|x| self.sheet.within(x));
        let cubic = if ahead {
            Cubic { t: [here.t, end.t], b }
        } else {
            Cubic { t: [end.t, here.t], b: [b[3], b[2], b[1], b[0]] }
        };
        let miss = self.miss(&cubic, self.tolerance)?;
        Ok((cubic, end, miss.with(Miss { off: distance, total: distance, along: 0.0 })))
    }

    /// Where the image passes a line of constant u (`d` 0) or v between two nodes.
    fn crossing(&self, a: Node, b: Node, d: usize, line: f64) -> Option<Node> {
        let uv = |t: f64| {
            let share = (t - a.t) / (b.t - a.t);
            self.sheet.foot_near(self.curve.eval(t), a.uv + (b.uv - a.uv) * share).uv
        };
        let (low, high) = if a.t < b.t { (a, b) } else { (b, a) };
        let t = bracketed(|t| uv(t)[d] - line, [low.t, high.t], [low.uv[d] - line, high.uv[d] - line]);
        let mut at = uv(t);
        let found = (at[d] - line).abs() <= 1e-6 * self.sheet.range[d] && t != a.t;
        at[d] = line;
        found.then_some(Node { t, uv: at })
    }

    /// Derivative of the image at a node, on the side `after` it or before it.
    pub(super) fn slope(&self, node: Node, after: bool) -> DVec2 {
        let [at, c1, _] = self.curve.derivatives_from(node.t, !after);
        let slope = |jet: &SurfaceJet| {
            let r = jet.p - at;
            let right = DVec2::new(c1.dot(jet.du), c1.dot(jet.dv));
            // On a border off which the curve is, the image runs along it.
            let held = [jet.du, jet.dv].map(|s| -r.dot(s));
            let held = [0, 1].map(|d| {
                held[d].abs() > self.sheet.rounding * [jet.du, jet.dv][d].length()
                    && self.sheet.leaves(d, node.uv[d], held[d])
            });
            solve(hessian(jet, r), right, held)
        };
        let away = if after { 1.0 } else { -1.0 };
        let heading = slope(&self.sheet.jet(node.uv)) * away;
        slope(&self.sheet.jet_toward(node.uv, heading))
    }

    /// How far a cubic is from the curve; or, where it is more than `most` along the surface, by what factor.
    ///
    /// Looked at are seven places and two more for each knot of curve or surface passed. The error of a Hermite cubic is
    /// s²(1−s)² times a smooth function; where that is quadratic, the largest error exceeds that at s = ¼, ½ and ¾, which
    /// are among the places, 1.45 times at most. Half as much again is added for it.
    pub(super) fn miss(&self, cubic: &Cubic, most: f64) -> Result<Miss, f64> {
        const BETWEEN: f64 = 1.5;
        let [t0, t1] = cubic.t;
        let knots = self.breaks.partition_point(|&k| k < t1) - self.breaks.partition_point(|&k| k <= t0)
            + self.sheet.breaks_between(cubic.b[0], cubic.b[3]);
        let count = 8 * (1 + knots.min(1000).div_ceil(4));
        let mut miss = Miss::default();
        // From the middle outwards: there a bad cubic is worst.
        for k in 1..count {
            let half = count / 2;
            let place = if k % 2 == 0 { half - k / 2 } else { half + k / 2 };
            let s = place as f64 / count as f64;
            let at = self.sheet.wrapped(cubic.eval(s));
            let e = self.nearby(t0 + s * (t1 - t0), cubic.t, self.sheet.surface.eval(at.x, at.y));
            let total = e.length();
            let along = if total * BETWEEN <= most { total } else { self.sheet.part_along(at, e) };
            if BETWEEN * along > most {
                return Err(BETWEEN * along / most);
            }
            // Across the surface lies what of the error is not along it.
            let off = libm::sqrt((total * total - along * along).max(0.0));
            let found = Miss { along: BETWEEN * along, total: total + (BETWEEN - 1.0) * along, off };
            miss = miss.with(found);
        }
        Ok(miss)
    }

    /// The difference from `p` to the point of the curve nearest to it that is near `t`: what counts is the image, not when
    /// it is where. By two steps of Gauss–Newton from the point at `t`, as long as they are short and lead nearer.
    fn nearby(&self, t: f64, [t0, t1]: [f64; 2], p: DVec3) -> DVec3 {
        let [mut at, mut slope, _] = self.curve.derivatives(t);
        let mut now = t;
        for _ in 0..2 {
            let e = at - p;
            let along = e.dot(slope);
            if along.abs() <= 0.1 * e.length() * slope.length() {
                break;
            }
            let next = now - along / slope.length_squared();
            // A quarter of the way at most, so that no point is near two that are far apart.
            if (next - t).abs() > 0.25 * (t - t0).min(t1 - t) {
                break;
            }
            let [there, turned, _] = self.curve.derivatives(next);
            if (there - p).length_squared() >= e.length_squared() {
                break;
            }
            (now, at, slope) = (next, there, turned);
        }
        at - p
    }
}

impl Cubic {
    pub(super) fn eval(&self, s: f64) -> DVec2 {
        let [a, b, c, d] = self.b;
        // In this form equal coordinates stay equal.
        let between = |p: DVec2, q: DVec2| p + (q - p) * s;
        let (ab, bc, cd) = (between(a, b), between(b, c), between(c, d));
        between(between(ab, bc), between(bc, cd))
    }
}
