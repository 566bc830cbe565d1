//! Pieces of trim curves: rational Bézier curves in (u, v) that run one way in u and one way in v.
//!
//! Such a piece meets a line of constant u or v once at most, or runs along it; its box is spanned by its ends. Which
//! lines it meets is decided by comparing the coordinates of its ends, which neighbouring pieces share bit for bit, so
//! that no crossing is lost or counted twice at a joint.

use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use crate::bernstein::{Univariate, bracketed};
use crate::view::MAX_DEGREE;

/// A rational Bézier curve in (u, v) that runs one way in each of the two parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct TrimPiece {
    /// Homogeneous control points (u·w, v·w, w).
    points: Vec<DVec3>,
    from: DVec2,
    to: DVec2,
    /// Whether the surface is kept on the left of the piece (u to the right, v up) and not on its right, or the other
    /// way round; none where it is kept, or not, on both sides, because another trim curve runs along this one.
    pub(super) left: Option<bool>,
    /// Identity of the shared edge along which it runs.
    pub(super) edge: Option<u32>,
}

fn affine(h: DVec3) -> DVec2 {
    h.truncate() / h.z
}

/// Extremes nearer than this to an end of a curve, in its local parameter, are the end.
const AT_END: f64 = 1e-12;

impl TrimPiece {
    /// The pieces of a Bézier curve with the homogeneous control points (u·w, v·w, w): it is cut at its extremes in u
    /// and in v. `noise` is the rounding of u and of v, below which they count as constant.
    pub(super) fn of_bezier(points: Vec<DVec3>, noise: DVec2, out: &mut Vec<Self>) {
        let mut cuts = Vec::new();
        let origin = affine(points[0]);
        let weight = Univariate::new(points.iter().map(|h| h.z).collect());
        for k in 0..2 {
            // Relative to the first point, so that large parameters of a small range lose nothing.
            let x = Univariate::new(points.iter().map(|h| h[k] - origin[k] * h.z).collect());
            if x.magnitude() > noise[k] * weight.magnitude() {
                let slope = x.derivative().mul(&weight).sub(&x.mul(&weight.derivative()));
                cuts.extend(slope.roots().iter().map(|r| r.t).filter(|&t| t > AT_END && t < 1.0 - AT_END));
            }
        }
        cuts.sort_by(f64::total_cmp);
        cuts.dedup();
        let mut rest = Self::whole(points);
        let mut before = 0.0;
        for t in cuts {
            let (piece, after) = rest.split((t - before) / (1.0 - before), None);
            out.push(piece);
            rest = after;
            before = t;
        }
        out.push(rest);
    }

    fn whole(points: Vec<DVec3>) -> Self {
        let (from, to) = (affine(points[0]), affine(points[points.len() - 1]));
        Self { points, from, to, left: None, edge: None }
    }

    /// A piece that was taken apart into what [`control_points`](Self::control_points), [`from`](Self::from) and
    /// [`to`](Self::to), [`keeps_left`](Self::keeps_left) and [`edge`](Self::edge) say, put together bit for bit. `None` if it
    /// cannot have been one: its points are too few or too many, or not finite, a weight is not positive, or the curve does not
    /// begin and end at `ends`. That it runs one way is taken on trust; nothing but the picture suffers if it does not.
    #[must_use]
    pub fn restored(points: Vec<DVec3>, ends: [DVec2; 2], left: Option<bool>, edge: Option<u32>) -> Option<Self> {
        let [from, to] = ends;
        let known = (2..=MAX_DEGREE + 1).contains(&points.len()) && points.iter().all(|h| h.is_finite() && h.z > 0.0);
        // What `with_ends` has multiplied by a weight and is divided by it again: two roundings.
        let near = |h: DVec3, at: DVec2| (affine(h) - at).abs().cmple(4.0 * f64::EPSILON * at.abs()).all();
        let (first, last) = (points.first().copied()?, points.last().copied()?);
        (known && from != to && near(first, from) && near(last, to)).then_some(Self { points, from, to, left, edge })
    }

    /// A straight piece along a border of the parameter range.
    pub(super) fn straight(from: DVec2, to: DVec2) -> Self {
        Self::whole(alloc::vec![from.extend(1.0), to.extend(1.0)])
    }

    /// The same piece moved by `shift`.
    pub(super) fn moved(mut self, shift: DVec2) -> Self {
        for h in &mut self.points {
            *h += (shift * h.z).extend(0.0);
        }
        (self.from, self.to) = (self.from + shift, self.to + shift);
        self
    }

    /// The mirror image in the middle of the range [a, b] of u, which it runs along as before: what was on its left is on
    /// its right.
    pub(super) fn mirrored_u(&self, [a, b]: [f64; 2]) -> Self {
        // As knots are mirrored, so that what was at a knot still is. Both borders become each other exactly, and what is
        // between stays there.
        let mirror = |u: f64| {
            if u == a {
                b
            } else if u == b {
                a
            } else {
                (a + (b - u)).clamp(a, b)
            }
        };
        let end = |p: DVec2| DVec2::new(mirror(p.x), p.y);
        let points = self.points.iter().map(|h| DVec3::new(a * h.z + (b * h.z - h.x), h.y, h.z)).collect();
        let image = Self { points, left: self.left.map(|left| !left), ..self.clone() };
        image.with_ends(end(self.from), end(self.to))
    }

    /// The parts before and after `s`, which have the point `at` in common, or else the curve's.
    pub(super) fn split(&self, s: f64, at: Option<DVec2>) -> (Self, Self) {
        let mut right = self.points.clone();
        let mut left = Vec::with_capacity(right.len());
        for r in (0..right.len()).rev() {
            left.push(right[0]);
            for i in 0..r {
                right[i] = right[i] + (right[i + 1] - right[i]) * s;
            }
        }
        let at = at.unwrap_or_else(|| affine(right[0]));
        let before = Self { points: left, from: self.from, to: at, left: self.left, edge: self.edge };
        (before, Self { points: right, from: at, to: self.to, left: self.left, edge: self.edge })
    }

    /// The same piece with its ends moved, by rounding.
    pub(super) fn with_ends(mut self, from: DVec2, to: DVec2) -> Self {
        let last = self.points.len() - 1;
        for (k, x) in [(0, from), (last, to)] {
            let w = self.points[k].z;
            self.points[k] = (x * w).extend(w);
        }
        (self.from, self.to) = (from, to);
        self
    }

    /// The same piece with the identity of the shared edge along which it runs.
    pub(super) fn with_edge(self, edge: Option<u32>) -> Self {
        Self { edge, ..self }
    }

    /// First point.
    #[must_use]
    pub fn from(&self) -> DVec2 {
        self.from
    }

    /// Last point.
    #[must_use]
    pub fn to(&self) -> DVec2 {
        self.to
    }

    /// Homogeneous Bézier control points (u·w, v·w, w).
    #[must_use]
    pub fn control_points(&self) -> &[DVec3] {
        &self.points
    }

    /// Identity of the shared edge along which the piece runs, if the trims were given one.
    #[must_use]
    pub fn edge(&self) -> Option<u32> {
        self.edge
    }

    /// Whether the surface is kept on the left of the piece (u to the right, v up) and cut off on its right; none where
    /// another trim curve runs along the piece, so that both sides are alike.
    #[must_use]
    pub fn keeps_left(&self) -> Option<bool> {
        self.left
    }

    /// Lower and upper corner of the box that holds the piece.
    #[must_use]
    pub fn bounds(&self) -> (DVec2, DVec2) {
        (self.from.min(self.to), self.from.max(self.to))
    }

    /// The point at `s` from 0 to 1.
    #[must_use]
    pub fn eval(&self, s: f64) -> DVec2 {
        self.jet(s).0
    }

    /// The point at `s` from 0 to 1, and its derivative. O(p²) for degree p, no allocation.
    #[must_use]
    pub fn jet(&self, s: f64) -> (DVec2, DVec2) {
        let n = self.points.len();
        let mut row = [DVec3::ZERO; MAX_DEGREE + 1];
        row[..n].copy_from_slice(&self.points);
        let mut d = DVec3::ZERO;
        for r in (1..n).rev() {
            if r == 1 {
                d = (row[1] - row[0]) * (n - 1) as f64;
            }
            for i in 0..r {
                row[i] = row[i] + (row[i + 1] - row[i]) * s;
            }
        }
        let h = row[0];
        let p = affine(h);
        let slope = (d.truncate() - p * d.z) / h.z;
        let p = if s <= 0.0 {
            self.from
        } else if s >= 1.0 {
            self.to
        } else {
            let (lo, hi) = self.bounds();
            p.clamp(lo, hi)
        };
        (p, slope)
    }

    /// Direction at the beginning and at the end, of no particular length; where derivatives vanish their limit. Both
    /// run along the piece.
    pub(super) fn directions(&self) -> [DVec2; 2] {
        let n = self.points.len();
        let at = |k: usize| affine(self.points[k]);
        let small = 1e-9 * (self.to - self.from).abs();
        let apart = |d: &DVec2| d.abs().cmpgt(small).any();
        let first = (1..n).map(|k| at(k) - self.from).find(apart);
        let last = (0..n - 1).rev().map(|k| self.to - at(k)).find(apart);
        [first, last].map(|d| d.unwrap_or(self.to - self.from))
    }

    /// The parameter at which coordinate `k` (0 is u, 1 is v) has a value between those of the ends.
    pub(super) fn reaches(&self, k: usize, value: f64) -> f64 {
        let (a, b) = (self.from[k] - value, self.to[k] - value);
        if a == 0.0 || a * b > 0.0 && a.abs() < b.abs() {
            return 0.0;
        }
        if b == 0.0 || a * b > 0.0 {
            return 1.0;
        }
        bracketed(|s| self.eval(s)[k] - value, [0.0, 1.0], [a, b])
    }

    /// The parameter of a point on the piece, to `noise`, that is not one of its ends.
    pub(super) fn passes(&self, at: DVec2, noise: DVec2) -> Option<f64> {
        let (lo, hi) = self.bounds();
        let same = |p: DVec2| (p - at).abs().cmple(noise).all();
        if at.cmplt(lo - noise).any() || at.cmpgt(hi + noise).any() || same(self.from) || same(self.to) {
            return None;
        }
        let k = usize::from(hi.y - lo.y > hi.x - lo.x);
        let s = self.reaches(k, at[k]);
        (s > 0.0 && s < 1.0 && same(self.eval(s))).then_some(s)
    }

    /// Whether the piece has a point in the closed rectangle from `lo` to `hi`.
    pub(super) fn enters(&self, lo: DVec2, hi: DVec2) -> bool {
        let (low, high) = self.bounds();
        if low.cmpgt(hi).any() || lo.cmpgt(high).any() {
            return false;
        }
        let inside = |p: DVec2| p.cmpge(lo).all() && p.cmple(hi).all();
        if inside(self.from) || inside(self.to) || low.x == high.x || low.y == high.y {
            return true;
        }
        let at = |v: f64| self.eval(self.reaches(1, v.clamp(low.y, high.y))).x;
        let (a, b) = (at(lo.y), at(hi.y));
        a.min(b) <= hi.x && a.max(b) >= lo.x
    }

    /// Appends the parts between the `values` that coordinate `k` passes; the parts end exactly on them. Ends within
    /// `noise` of a value are on it.
    pub(super) fn split_at(self, k: usize, values: &[f64], noise: f64, out: &mut Vec<Self>) {
        let (low, high) = self.bounds();
        let (first, last) =
            (values.partition_point(|&x| x <= low[k] + noise), values.partition_point(|&x| x < high[k] - noise));
        let rising = self.to[k] > self.from[k];
        let mut rest = self;
        let count = last.saturating_sub(first);
        for i in 0..count {
            let value = if rising { values[first + i] } else { values[last - 1 - i] };
            let s = rest.reaches(k, value);
            let mut at = rest.eval(s);
            at[k] = value;
            let (piece, after) = rest.split(s, Some(at));
            out.push(piece);
            rest = after;
        }
        out.push(rest);
    }
}
