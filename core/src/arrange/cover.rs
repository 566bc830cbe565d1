//! How a curve is covered by arcs: its parts are halved until they are tame, and within the tolerance.
//!
//! Which arcs there are follows from how often each part was halved, and an arc from the curve and its place among the halves. So they
//! need not be kept; see [`division`](super::division).

use alloc::boxed::Box;

use glam::{DVec2, DVec3, DVec4};

use super::arc::{Arc, Control, split_control};
use super::arcs::Kept;
use super::division::{Divider, WHOLE};
use super::run::Keeper;
use crate::extract::{Geometry, Path, SurfaceCurve};

/// Takes the arcs of a curve in order.
pub(super) enum Taker {
    /// To keep them.
    Whole(Keeper),
    /// To keep how often their parts of the curve were halved.
    Divided(Divider),
}

impl Taker {
    pub(super) fn new(keep: bool) -> Self {
        if keep { Self::Whole(Keeper::default()) } else { Self::Divided(Divider::default()) }
    }

    /// Takes the next arc, and how often its part of the curve was halved. `usual` is the error of most arcs of the curve.
    fn push(&mut self, arc: &Arc, depth: u32, usual: f64) {
        match self {
            Self::Whole(keeper) => keeper.push(arc),
            Self::Divided(divider) => divider.push(depth, arc.error, usual),
        }
    }

    /// What is kept of the arcs that it took.
    pub(super) fn take(&mut self) -> Kept {
        match self {
            Self::Whole(keeper) => Kept::Whole(keeper.take()),
            Self::Divided(divider) => Kept::Divided(divider.take()),
        }
    }
}

/// A curve that is being covered by arcs.
#[derive(Clone, Copy)]
pub(super) struct Covering<'a> {
    pub(super) curve: &'a SurfaceCurve,
    pub(super) index: usize,
    pub(super) geometry: Geometry<'a>,
    /// Largest distance on the screen from a traced curve, its gap not counted.
    pub(super) tolerance: f64,
}

/// A part of a curve before it is halved.
#[derive(Clone)]
pub(super) enum Part {
    /// Of an isoparametric line, exactly.
    Line(Box<Arc>),
    /// An interval of one segment of another curve.
    Segment([f64; 2]),
}

/// Parameter of a curve with position and derivative there, view space.
pub(super) type Node = (f64, DVec3, DVec3);

impl Covering<'_> {
    /// The error of most arcs of the curve.
    pub(super) fn usual_error(&self) -> f64 {
        match self.curve.path {
            Path::Line(_) => self.curve.gap,
            Path::Traced(_) | Path::Section(_) | Path::Trim(_) => self.tolerance + self.curve.gap,
        }
    }

    /// Hands out the arcs.
    pub(super) fn cover(&self, out: &mut Taker) {
        let mut next = 0;
        while let Some(k) = self.next_part(next) {
            match self.part(k) {
                Part::Line(arc) => self.tame(&arc, out, 0),
                Part::Segment(t) => self.hermite(self.node(t, 0), self.node(t, WHOLE), out, 0),
            }
            next = k + 1;
        }
    }

    /// The first part from the number `k` on; none if the curve has no more.
    pub(super) fn next_part(&self, k: usize) -> Option<usize> {
        let [a, b] = self.curve.domain;
        match &self.curve.path {
            Path::Line(line) => {
                let inside = line.spans.iter().skip(k).position(|s| s.t[0].max(a) < s.t[1].min(b));
                inside.map(|after| k + after)
            }
            Path::Traced(_) | Path::Section(_) | Path::Trim(_) => {
                let k = k.max(a as usize);
                (k < libm::ceil(b) as usize).then_some(k)
            }
        }
    }

    /// The part with the number `k`, which is one of [`next_part`](Self::next_part).
    pub(super) fn part(&self, k: usize) -> Part {
        let [a, b] = self.curve.domain;
        match &self.curve.path {
            Path::Line(line) => {
                let span = &line.spans[k];
                let (a, b) = (span.t[0].max(a), span.t[1].min(b));
                let width = span.t[1] - span.t[0];
                let all: Control = span.points.iter().copied().collect();
                let (x, y) = ((a - span.t[0]) / width, (b - span.t[0]) / width);
                let right = if x > 0.0 { split_control(&all, x).1 } else { all };
                let part = if y < 1.0 { split_control(&right, (y - x) / (1.0 - x)).0 } else { right };
                Part::Line(Box::new(Arc::new(self.index, [a, b], part, self.curve.gap)))
            }
            Path::Traced(_) | Path::Section(_) | Path::Trim(_) => {
                Part::Segment([a.max(k as f64), b.min((k + 1) as f64)])
            }
        }
    }

    /// The curve at a place of a segment over the interval `t`: of [`WHOLE`], halved again and again.
    pub(super) fn node(&self, t: [f64; 2], place: u32) -> Node {
        let [mut lo, mut hi] = t;
        let (mut from, mut to) = (0, WHOLE);
        while place != from && place != to {
            let middle = (from + to) / 2;
            let m = 0.5 * (lo + hi);
            if place < middle { (hi, to) = (m, middle) } else { (lo, from) = (m, middle) }
        }
        let t = if place == from { lo } else { hi };
        // The end of a segment is the beginning of the next one, which may leave it in another direction.
        let jet =
            if place == WHOLE { self.curve.jet_below(&self.geometry, t) } else { self.curve.jet(&self.geometry, t) };
        (t, jet.0, jet.1)
    }

    /// Halves an arc until it is tame. Where the curve runs along the sight line and comes back on the screen, the one arc that is
    /// left in the end is as long as the square of its part of the parameter.
    fn tame(&self, arc: &Arc, out: &mut Taker, depth: u32) {
        const DEEPEST: u32 = 16;
        if depth >= DEEPEST || is_tame(arc, self.tolerance) {
            out.push(arc, depth, self.usual_error());
        } else {
            let (l, r) = arc.halves();
            self.tame(&l, out, depth + 1);
            self.tame(&r, out, depth + 1);
        }
    }

    /// Cubic Hermite arcs within the tolerance between two places of one segment. The error falls with the fourth power
    /// of the length, so a few halvings reach any tolerance; it is measured at three inner points.
    fn hermite(&self, from: Node, to: Node, out: &mut Taker, depth: u32) {
        const DEEPEST: u32 = 12;
        let arc = self.between(from, to, self.tolerance);
        let [t0, t1] = arc.t;
        let m = 0.5 * (t0 + t1);
        let (pm, dm) = self.curve.jet(&self.geometry, m);
        // The middle first: there the error is largest, and the point serves the halves.
        let mut error = (arc.jet(0.5).0 - pm).length();
        let tame = is_tame(&arc, self.tolerance);
        // Where the curve is known less well than the tolerance, arcs cannot be better, however short.
        let enough = self.tolerance.max(self.curve.rounding(&self.geometry, m));
        if (error <= enough && tame) || depth >= DEEPEST {
            for x in [0.25, 0.75] {
                error = error.max((arc.jet(x).0 - self.curve.point(&self.geometry, t0 + x * (t1 - t0))).length());
            }
        }
        if depth >= DEEPEST || (error <= enough && tame) {
            let error = self.tolerance.max(2.0 * error) + self.curve.gap;
            out.push(&Arc::new(self.index, [t0, t1], arc.points, error), depth, self.usual_error());
        } else {
            self.hermite(from, (m, pm, dm), out, depth + 1);
            self.hermite((m, pm, dm), to, out, depth + 1);
        }
    }

    /// The cubic with the positions and derivatives of the curve at two places.
    pub(super) fn between(&self, (t0, p0, d0): Node, (t1, p1, d1): Node, error: f64) -> Arc {
        let h = t1 - t0;
        let legs = [d0, d1].map(|d| leg(d * (h / 3.0), p1 - p0));
        let points = [p0, p0 + legs[0], p1 - legs[1], p1];
        let control: Control = points.iter().map(|p| DVec4::new(p.x, p.y, p.z, 1.0)).collect();
        Arc::new(self.index, [t0, t1], control, error)
    }
}

/// Whether tangents stay within 45° of the chord, so that strips are thin and cone tests can succeed; or the arc is no
/// larger than `point`: a curve along the sight line has no direction on the screen that halving could bring out.
fn is_tame(arc: &Arc, point: f64) -> bool {
    arc.strip().spread <= 1.0 || (arc.hi - arc.lo).max_element() <= 2.0 * arc.error + point
}

/// A leg of a Hermite arc's control polygon, no longer than the chord on the screen and in space. The derivative of a
/// traced curve grows beyond all bounds towards a place where its independent parameter stands still, and means nothing
/// at a singular point. A monotone cubic has legs of its chord's length at most (Fritsch and Carlson 1980), so nothing is
/// lost on short arcs.
fn leg(tangent: DVec3, chord: DVec3) -> DVec3 {
    if !tangent.is_finite() {
        return chord / 3.0;
    }
    let bounded = |d: DVec2, most: f64| d.clamp_length_max(most.max(f64::MIN_POSITIVE));
    let flat = bounded(tangent.truncate(), chord.truncate().length());
    flat.extend(tangent.z.clamp(-chord.length(), chord.length()))
}
