//! Changes of representation along one parameter: the same points, other knots.
//!
//! All functions work on *rows*: `width` control points that move together, row i being
//! `points[i * width .. (i + 1) * width]`. A curve has rows of one point, a surface in u rows of nv points.

use alloc::vec::Vec;

use glam::DVec4;

use super::KnotVector;
use super::de_boor::{Scratch, blossom, gather};

/// Control points with the knots of one direction.
#[derive(Clone, Debug)]
pub(super) struct Strip {
    pub(super) knots: KnotVector,
    pub(super) points: Vec<DVec4>,
    pub(super) width: usize,
}

impl Strip {
    fn scratch(&self, k: usize, column: usize) -> Scratch {
        gather(self.knots.degree(), k, |i| self.points[i * self.width + column])
    }

    /// Inserts `t`, in the domain, once. Böhm 1980, *Inserting new knots into B-spline curves*, CAD 12; The NURBS Book
    /// eq. 5.11. The caller sees to the multiplicity.
    pub(super) fn insert(&mut self, t: f64) {
        let (p, w) = (self.knots.degree(), self.width);
        let k = self.knots.span(t);
        let s = self.knots.multiplicity(t);
        let kn = self.knots.as_slice();
        // New rows k − p + 1 … last; those before are the old ones, those after are the old ones moved by one. At the end
        // of the domain the knots equal to t are to the right of the span, elsewhere to its left.
        let last = if kn[k + 1] == t { k } else { k.saturating_sub(s) };
        let first = k + 1 - p;
        let mut points = Vec::with_capacity(self.points.len() + w);
        points.extend_from_slice(&self.points[..first * w]);
        for i in first..=last {
            let alpha = (t - kn[i]) / (kn[i + p] - kn[i]);
            points
                .extend((0..w).map(|c| self.points[(i - 1) * w + c] * (1.0 - alpha) + self.points[i * w + c] * alpha));
        }
        points.extend_from_slice(&self.points[last.max(first - 1) * w..]);
        let mut knots = kn.to_vec();
        knots.insert(k + 1, t);
        *self = Self { knots: KnotVector::trusted(knots, p), points, width: w };
    }

    /// Inserts `t` until its multiplicity is at least `multiplicity`.
    pub(super) fn raise(&mut self, t: f64, multiplicity: usize) {
        for _ in self.knots.multiplicity(t)..multiplicity {
            self.insert(t);
        }
    }

    /// Inserts what `other`, on the same domain, has more of.
    pub(super) fn unite(&mut self, other: &KnotVector) {
        let breaks = other.breaks();
        for &t in breaks.iter().skip(1).take(breaks.len().saturating_sub(2)) {
            self.raise(t, other.multiplicity(t));
        }
    }

    /// Full multiplicity at both ends of the domain; nothing beyond.
    pub(super) fn clamped(mut self) -> Self {
        let p = self.knots.degree();
        let [start, end] = self.knots.domain();
        self.raise(start, p);
        self.raise(end, p);
        self.between(start, end)
    }

    /// The part on [a, b], whose ends are knots of multiplicity p or more.
    fn between(&self, a: f64, b: f64) -> Self {
        let (p, w) = (self.knots.degree(), self.width);
        let kn = self.knots.as_slice();
        // The row that is interpolated at a knot of multiplicity p stands p before its last copy, and 1 before its first.
        let last_a = kn.partition_point(|&k| k <= a) - 1;
        let first_b = kn.partition_point(|&k| k < b);
        let points = self.points[(last_a - p) * w..first_b * w].to_vec();
        let mut knots = alloc::vec![a; p + 1];
        knots.extend_from_slice(&kn[last_a + 1..first_b]);
        knots.extend(core::iter::repeat_n(b, p + 1));
        Self { knots: KnotVector::trusted(knots, p), points, width: w }
    }

    /// The parts before and after `t`, strictly inside the domain, both clamped.
    pub(super) fn split(self, t: f64) -> (Self, Self) {
        let mut whole = self.clamped();
        whole.raise(t, whole.knots.degree());
        let [start, end] = whole.knots.domain();
        (whole.between(start, t), whole.between(t, end))
    }

    /// One degree more, clamped, every continuity kept.
    ///
    /// The blossom of the raised curve is the mean of the old blossom over all ways to leave one argument out. Window i
    /// of the raised knots holds p + 1 arguments, and of any p + 1 successive indices just one is ≡ r modulo p + 1: so
    /// for each r the raised knots without the indices ≡ r refine the old ones, and the control points on them are the
    /// terms of the mean. Convex throughout. Source: Prautzsch 1984, *Degree elevation of B-spline curves*, CAGD 1.
    fn raised_once(self) -> Self {
        let old = self.clamped();
        let (p, w) = (old.knots.degree(), old.width);
        let [start, end] = old.knots.domain();
        let breaks = old.knots.breaks();
        let inner = &breaks[1..breaks.len() - 1];

        let mut knots = alloc::vec![start; p + 2];
        for &t in inner {
            knots.extend(core::iter::repeat_n(t, old.knots.multiplicity(t) + 1));
        }
        knots.extend(core::iter::repeat_n(end, p + 2));
        let knots = KnotVector::trusted(knots, p + 1);

        let count = knots.control_count();
        let mut points = alloc::vec![DVec4::ZERO; count * w];
        let share = 1.0 / (p + 1) as f64;
        for r in 0..=p {
            let mut term = old.clone();
            for &t in inner {
                let kept = knots.as_slice().iter().enumerate().filter(|&(i, &k)| k == t && i % (p + 1) != r).count();
                term.raise(t, kept);
            }
            for i in 0..count {
                // Indices ≡ r in 1 ..= i are left out before this window.
                let left_out = if r == 0 { i / (p + 1) } else { (i + p + 1 - r) / (p + 1) };
                let row = i - left_out;
                for c in 0..w {
                    points[i * w + c] += term.points[row * w + c] * share;
                }
            }
        }
        // The ends are control points of the old curve; a mean of equal numbers need not be that number.
        points[..w].copy_from_slice(&old.points[..w]);
        let tail = points.len() - w;
        points[tail..].copy_from_slice(&old.points[old.points.len() - w..]);
        Self { knots, points, width: w }
    }

    /// The same written with degree at least `degree` (which is legal).
    pub(super) fn raised(mut self, degree: usize) -> Self {
        while self.knots.degree() < degree {
            self = self.raised_once();
        }
        self
    }

    /// The Bézier pieces in order: interval, and p + 1 rows. Neighbours share their common row bit for bit.
    ///
    /// Row j of the piece on [a, b] is the blossom with p − j arguments a and j arguments b.
    pub(super) fn bezier(&self) -> Vec<([f64; 2], Vec<DVec4>)> {
        let (p, w) = (self.knots.degree(), self.width);
        let breaks = self.knots.breaks();
        let mut pieces: Vec<([f64; 2], Vec<DVec4>)> = Vec::with_capacity(breaks.len());
        for ab in breaks.windows(2) {
            let (a, b) = (ab[0], ab[1]);
            let k = self.knots.span(a);
            let mut rows = Vec::with_capacity((p + 1) * w);
            for j in 0..=p {
                for c in 0..w {
                    rows.push(blossom(&self.knots, k, self.scratch(k, c), |r| if r <= p - j { a } else { b }));
                }
            }
            if let Some((_, before)) = pieces.last() {
                rows[..w].copy_from_slice(&before[p * w..]);
            }
            pieces.push(([a, b], rows));
        }
        pieces
    }

    /// The row at `t`.
    pub(super) fn at(&self, t: f64) -> Vec<DVec4> {
        let t = self.knots.clamp(t);
        let k = self.knots.span(t);
        (0..self.width).map(|c| blossom(&self.knots, k, self.scratch(k, c), |_| t)).collect()
    }

    /// The parameter run backwards on the same domain.
    pub(super) fn reversed(&self) -> Self {
        let points = self.points.chunks_exact(self.width).rev().flatten().copied().collect();
        Self { knots: self.knots.reversed(), points, width: self.width }
    }
}

/// The two halves of a Bézier piece of rows of `w` points, by de Casteljau's algorithm.
pub(super) fn halves(mut rows: Vec<DVec4>, w: usize) -> (Vec<DVec4>, Vec<DVec4>) {
    let n = rows.len() / w;
    let mut left = Vec::with_capacity(rows.len());
    for k in (0..n).rev() {
        left.extend_from_slice(&rows[..w]);
        for i in 0..k * w {
            rows[i] = 0.5 * (rows[i] + rows[i + w]);
        }
    }
    (left, rows)
}
