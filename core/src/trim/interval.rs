//! What of an isoparametric line is kept.

use alloc::vec::Vec;

use glam::DVec2;

use super::Trims;
use crate::line::Axis;

impl Trims {
    /// The intervals of the line u = `value` ([`Axis::U`]) or v = `value` over `range` that are kept, in increasing
    /// order.
    ///
    /// The line is cut where trim curves cross, touch or end on it, and each part is asked for in its middle. A part
    /// that runs along a trim curve, which there is a curve of its own, is not kept; on the border of the parameter
    /// range it is what [`kept_on_border`](Self::kept_on_border) says. Cost: a root for each piece whose box the line
    /// passes, and as much again for each part.
    #[must_use]
    pub fn kept_on_line(&self, axis: Axis, value: f64, range: [f64; 2]) -> Vec<[f64; 2]> {
        let (fixed, running) = if axis == Axis::U { (0, 1) } else { (1, 0) };
        let noise = self.noise();
        let (lo, hi) = self.range();
        if value == lo[fixed] || value == hi[fixed] {
            let clipped =
                self.kept_on_border(axis, value).into_iter().map(|t| [t[0].max(range[0]), t[1].min(range[1])]);
            return clipped.filter(|t| t[0] < t[1]).collect();
        }
        let (mut cuts, mut along) = (Vec::new(), Vec::new());
        for p in self.pieces() {
            let (a, b) = (p.from(), p.to());
            let near = |x: DVec2| (x[fixed] - value).abs() <= noise[fixed];
            match (near(a), near(b)) {
                (true, true) => {
                    cuts.extend([a[running], b[running]]);
                    along.push([a[running].min(b[running]), a[running].max(b[running])]);
                }
                (true, false) => cuts.push(a[running]),
                (false, true) => cuts.push(b[running]),
                (false, false) if (a[fixed] < value) != (b[fixed] < value) => {
                    cuts.push(p.eval(p.reaches(fixed, value))[running]);
                }
                (false, false) => {}
            }
        }
        let is_kept = |m: f64| {
            let at = if axis == Axis::U { DVec2::new(value, m) } else { DVec2::new(m, value) };
            !along.iter().any(|r| r[0] < m && m < r[1]) && self.contains_across(at, running)
        };
        parts(range, cuts, noise[running], is_kept)
    }

    /// The intervals of a border of the parameter range, v along u = `value` ([`Axis::U`]) or u along v = `value`, in
    /// which the kept part of the surface ends there.
    #[must_use]
    pub fn kept_on_border(&self, axis: Axis, value: f64) -> Vec<[f64; 2]> {
        let (fixed, running) = if axis == Axis::U { (0, 1) } else { (1, 0) };
        let on = |x: DVec2| x[fixed] == value;
        let along: Vec<[f64; 2]> = self
            .pieces()
            .filter(|p| on(p.from()) && on(p.to()))
            .map(|p| [p.from()[running].min(p.to()[running]), p.from()[running].max(p.to()[running])])
            .collect();
        let cuts = along.iter().flatten().copied().collect();
        let (lo, hi) = self.range();
        // Loops that run along each other cancel.
        let is_kept = |m: f64| along.iter().filter(|r| r[0] < m && m < r[1]).count() % 2 == 1;
        parts([lo[running], hi[running]], cuts, self.noise()[running], is_kept)
    }

    /// As [`contains`](Self::contains), looking in the direction of constant `running` coordinate.
    fn contains_across(&self, at: DVec2, running: usize) -> bool {
        if running == 1 {
            return self.contains(at);
        }
        let mut inside = false;
        for p in self.pieces().filter(|p| (p.from().x <= at.x) != (p.to().x <= at.x)) {
            let (lo, hi) = p.bounds();
            inside ^= at.y < lo.y || (at.y < hi.y && at.y < p.eval(p.reaches(0, at.x)).y);
        }
        inside
    }
}

/// The parts of `range` between cuts whose middles are kept, neighbours made one. Cuts within `noise` are one.
fn parts(range: [f64; 2], mut cuts: Vec<f64>, noise: f64, is_kept: impl Fn(f64) -> bool) -> Vec<[f64; 2]> {
    cuts.retain(|&x| range[0] + noise < x && x < range[1] - noise);
    cuts.sort_by(f64::total_cmp);
    cuts.dedup_by(|b, a| *b - *a <= noise);
    cuts.push(range[1]);
    let mut out: Vec<[f64; 2]> = Vec::new();
    let mut before = range[0];
    for cut in cuts {
        if is_kept(0.5 * (before + cut)) {
            match out.last_mut() {
                Some(last) if last[1] == before => last[1] = cut,
                _ => out.push([before, cut]),
            }
        }
        before = cut;
    }
    out
}
