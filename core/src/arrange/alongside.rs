//! Arcs that run along each other: where are they nearer than the resolution, and where do they change sides?
//!
//! Strips tell two arcs apart only when each is straighter than the gap between them, so arcs a hair's breadth apart
//! (a silhouette seen almost along the axis that makes it coincide with another) would be cut into thousands of parts.
//! Their *distance* is as smooth as they are, however small it is. Where both arcs are graphs over one direction x,
//! it is D(x) = y_b(x) − y_a(x), and cubic Hermite interpolation of D converges with the fourth power of the interval:
//! a few halvings find its sign and its zeros to any resolution.

use glam::DVec2;

use super::arc::{Arc, screen};
use super::meeting::Meeting;

/// Largest slope of an arc against the common direction, tan 63°: one arc may be 45° off its own chord.
const STEEPEST: f64 = 2.0;

/// Halvings of the common interval at most; 2⁻⁴⁰ of any arc is below the resolution of a picture.
const DEEPEST: u32 = 40;

/// Two arcs over their common interval of x.
struct Pair<'a> {
    a: &'a Arc,
    b: &'a Arc,
    origin: DVec2,
    dir: DVec2,
    /// Whether b runs against x.
    reversed: bool,
    /// Distance within which the arcs count as one.
    limit: f64,
    /// Intervals of x within the limit, in increasing order, those that touch made one.
    near: alloc::vec::Vec<[f64; 2]>,
    /// Places where the arcs change sides.
    zeros: alloc::vec::Vec<f64>,
}

/// D and its derivative at x.
#[derive(Clone, Copy)]
struct Offset {
    x: f64,
    d: f64,
    slope: f64,
}

/// Appends all meetings of two arcs that are graphs over the direction of the first one's chord; false, and nothing
/// appended, if they are not.
pub(super) fn alongside(a: &Arc, b: &Arc, limit: f64, out: &mut alloc::vec::Vec<Meeting>) -> bool {
    let (from, to) = a.ends();
    let length = (to - from).length();
    if length <= 4.0 * limit {
        return false;
    }
    let dir = (to - from) / length;
    let (Some(true), Some(forward)) = (runs(a, dir), runs(b, dir)) else { return false };
    let along = |p: DVec2| (p - from).dot(dir);
    let (p, q) = b.ends();
    let (b0, b1) = if forward { (along(p), along(q)) } else { (along(q), along(p)) };
    let (x0, x1) = (b0.max(0.0), b1.min(length));
    if x1 < x0 - limit {
        return true;
    }
    let mut pair = Pair {
        a,
        b,
        origin: from,
        dir,
        reversed: !forward,
        limit,
        near: alloc::vec::Vec::new(),
        zeros: alloc::vec::Vec::new(),
    };
    let first = pair.offset(x0);
    if x1 - x0 <= 4.0 * limit {
        // They have an end in common, or nothing.
        if first.d.abs() <= 4.0 * limit {
            pair.zeros.push(x0);
        }
    } else {
        let last = pair.offset(x1);
        pair.search(first, last, 0);
    }
    pair.report(out);
    true
}

/// Whether the arc runs along `dir` (true) or against it, never steeper than [`STEEPEST`]. The tangents of a rational
/// Bézier curve with positive weights are positive combinations of the legs of its control polygon.
fn runs(arc: &Arc, dir: DVec2) -> Option<bool> {
    let (mut forward, mut backward) = (true, true);
    let mut last = screen(arc.points[0]);
    for h in &arc.points[1..] {
        let e = screen(*h);
        let leg = e - last;
        let (x, y) = (leg.dot(dir), leg.dot(dir.perp()).abs());
        forward &= y <= STEEPEST * x;
        backward &= y <= -STEEPEST * x;
        last = e;
    }
    // An arc that is a point runs nowhere.
    (forward != backward).then_some(forward)
}

impl Pair<'_> {
    /// Height above x, slope dy/dx, and the Bézier parameter: Newton's method within a bracket, the arc being a graph.
    fn at(&self, arc: &Arc, reversed: bool, x: f64) -> (f64, f64, f64) {
        let normal = self.dir.perp();
        let (mut lo, mut hi) = (0.0_f64, 1.0_f64);
        let (p, q) = arc.ends();
        let (xp, xq) = ((p - self.origin).dot(self.dir), (q - self.origin).dot(self.dir));
        let mut s = ((x - xp) / (xq - xp)).clamp(0.0, 1.0);
        let mut best = (0.0, 0.0);
        for _ in 0..60 {
            let (r, d) = arc.jet(s);
            let (r, d) = (r.truncate() - self.origin, d.truncate());
            let (run, off) = (d.dot(self.dir), r.dot(self.dir) - x);
            let slope = if run == 0.0 { 0.0 } else { d.dot(normal) / run };
            // What is missing in x is made up along the tangent.
            best = (r.dot(normal) - off * slope, slope);
            if (off > 0.0) != reversed {
                hi = s
            } else {
                lo = s
            }
            let next = if run == 0.0 { f64::NAN } else { s - off / run };
            let next = if next >= lo && next <= hi { next } else { 0.5 * (lo + hi) };
            let moved = (next - s).abs();
            s = next;
            if moved <= 1e-9 {
                break;
            }
        }
        (best.0, best.1, s)
    }

    fn offset(&self, x: f64) -> Offset {
        let (ya, sa, _) = self.at(self.a, false, x);
        let (yb, sb, _) = self.at(self.b, self.reversed, x);
        Offset { x, d: yb - ya, slope: sb - sa }
    }

    fn search(&mut self, from: Offset, to: Offset, depth: u32) {
        let h = to.x - from.x;
        let c = [from.d, from.d + from.slope * h / 3.0, to.d - to.slope * h / 3.0, to.d];
        // The cubic at ¼, ½ and ¾; the error of Hermite interpolation is largest in the middle.
        let inner = [0.25, 0.5, 0.75].map(|f| (f, self.offset(from.x + f * h)));
        let cubic = |f: f64| {
            let g = 1.0 - f;
            g * g * g * c[0] + 3.0 * f * g * g * c[1] + 3.0 * f * f * g * c[2] + f * f * f * c[3]
        };
        let error = 2.0 * inner.iter().map(|(f, o)| (o.d - cubic(*f)).abs()).fold(0.0, f64::max);
        let (lo, hi) = c.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), &c| (lo.min(c), hi.max(c)));
        if lo - error > self.limit || hi + error < -self.limit {
            return;
        }
        if lo - error >= -self.limit && hi + error <= self.limit {
            self.is_near(from.x, to.x);
            return;
        }
        let rises = c
            .windows(2)
            .map(|w| w[1] - w[0])
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), r| (lo.min(r), hi.max(r)));
        let monotone = error <= 0.25 * self.limit && (rises.0 >= 0.0 || rises.1 <= 0.0)
            // Far from parallel: the cubic's rise outweighs whatever it leaves out.
            || rises.0 > 8.0 * error
            || rises.1 < -8.0 * error;
        if monotone || depth >= DEEPEST {
            self.monotone(from, to);
            return;
        }
        let middle = inner[1].1;
        self.search(from, middle, depth + 1);
        self.search(middle, to, depth + 1);
    }

    /// D runs one way between two places.
    fn monotone(&mut self, from: Offset, to: Offset) {
        let sign = if to.d >= from.d { 1.0 } else { -1.0 };
        let (low, high) = (sign * from.d, sign * to.d);
        if low > self.limit || high < -self.limit {
            return;
        }
        let x0 = if low >= -self.limit { from.x } else { self.reaches(from.x, to.x, sign, -self.limit) };
        let x1 = if high <= self.limit { to.x } else { self.reaches(from.x, to.x, sign, self.limit) };
        if x1 - x0 > 8.0 * self.limit {
            self.is_near(x0, x1);
        } else {
            self.zeros.push(if low <= 0.0 && high >= 0.0 { self.reaches(from.x, to.x, sign, 0.0) } else { x0 });
        }
    }

    /// Where sign · D, increasing, reaches a value: bisection to the last bit of the interval that matters.
    fn reaches(&self, x0: f64, x1: f64, sign: f64, value: f64) -> f64 {
        let (mut lo, mut hi) = (x0, x1);
        let enough = (1e-3 * self.limit).max(1e-15 * (x1 - x0));
        while hi - lo > enough {
            let m = 0.5 * (lo + hi);
            if m <= lo || m >= hi {
                break;
            }
            let o = self.offset(m);
            let newton = m + (value * sign - o.d) / o.slope;
            if sign * o.d < value {
                lo = m
            } else {
                hi = m
            }
            // The derivative is at hand: one step of Newton's method from the middle, held in the bracket.
            if newton > lo && newton < hi {
                let d = self.offset(newton).d;
                if sign * d < value {
                    lo = newton
                } else {
                    hi = newton
                }
                let beyond = if sign * d < value { newton + enough } else { newton - enough };
                if beyond > lo && beyond < hi {
                    if sign * self.offset(beyond).d < value { lo = beyond } else { hi = beyond }
                }
            }
        }
        0.5 * (lo + hi)
    }

    fn is_near(&mut self, x0: f64, x1: f64) {
        match self.near.last_mut() {
            Some(last) if x0 <= last[1] + 4.0 * self.limit => last[1] = x1,
            _ => self.near.push([x0, x1]),
        }
    }

    fn report(&self, out: &mut alloc::vec::Vec<Meeting>) {
        let on = |x: f64| (self.at(self.a, false, x).2, self.at(self.b, self.reversed, x).2);
        let depth = |x: f64| {
            let (s, t) = on(x);
            (self.a.jet(s).0.z, self.b.jet(t).0.z)
        };
        for &[x0, x1] in &self.near {
            let ((s0, t0), (s1, t1)) = (on(x0), on(x1));
            let (za, zb) = depth(0.5 * (x0 + x1));
            let (a, b) = ([self.a.param(s0), self.a.param(s1)], [self.b.param(t0), self.b.param(t1)]);
            out.push(Meeting::Overlap { a, b, za, zb });
        }
        for &x in &self.zeros {
            let ((s, t), (za, zb)) = (on(x), depth(x));
            out.push(Meeting::Crossing { a: self.a.param(s), b: self.b.param(t), za, zb });
        }
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::super::arc::Control;
    use super::*;
    use glam::DVec4;

    fn arc(points: &[[f64; 2]]) -> Arc {
        let points: Control = points.iter().map(|p| DVec4::new(p[0], p[1], 0.0, 1.0)).collect();
        Arc::new(0, [0.0, 1.0], points, 0.0)
    }

    fn all(a: &Arc, b: &Arc) -> Vec<Meeting> {
        let mut out = Vec::new();
        assert!(alongside(a, b, 1e-9, &mut out));
        out
    }

    /// A bow, and the same bow turned a little about the point at one third of its chord.
    #[test]
    fn a_crossing_at_a_thousandth_of_a_degree_is_one_crossing() {
        let bow = [[0.0, 0.0], [1.0, 0.5], [2.0, 0.5], [3.0, 0.0]];
        let tilt = 2e-5;
        for reverse in [false, true] {
            let mut turned = bow.map(|[x, y]| [x, y + tilt * (x - 1.0)]);
            if reverse {
                turned.reverse();
            }
            let m = all(&arc(&bow), &arc(&turned));
            assert_eq!(m.len(), 1, "{m:?}");
            let t = match m[0] {
                Meeting::Crossing { a, .. } => a,
                Meeting::Overlap { a, .. } => 0.5 * (a[0] + a[1]),
            };
            assert!((t - 1.0 / 3.0).abs() < 1e-6, "{m:?}");
        }
    }

    #[test]
    fn bows_a_hair_apart_do_not_meet() {
        let bow = [[0.0, 0.0], [1.0, 0.5], [2.0, 0.5], [3.0, 0.0]];
        assert!(all(&arc(&bow), &arc(&bow.map(|[x, y]| [x, y + 1e-8]))).is_empty());
    }

    /// Two parabolas y = x² and y = x² + k (x − ½)² touch where x is ½, and are within r for √(r/k) to either side.
    #[test]
    fn a_contact_is_an_interval_as_long_as_the_distance_is_small() {
        let parabola = |a: f64, b: f64, c: f64| [[0.0, c], [0.5, c + 0.5 * b], [1.0, a + b + c]];
        for k in [1e-6, 1e-3, 0.1] {
            let m = all(&arc(&parabola(1.0, 0.0, 0.0)), &arc(&parabola(1.0 + k, -k, 0.25 * k)));
            let [Meeting::Overlap { a, .. }] = m[..] else { panic!("{m:?}") };
            let half = libm::sqrt(1e-9 / k);
            assert!((a[0] - (0.5 - half)).abs() < 0.3 * half && (a[1] - (0.5 + half)).abs() < 0.3 * half, "{k}: {a:?}");
        }
    }
}
