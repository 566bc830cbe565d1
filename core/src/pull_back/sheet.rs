//! A surface as pull-back sees it: with its periods, poles, and the lines over which it is not smooth.

use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::foot::Cell;
use super::pole::{self, Pole};
use crate::nurbs::{KnotVector, Surface, SurfaceJet};
use crate::view::net_box;

/// Parameters this near to a line, of the range, are on it. Newton's last step leaves less, and trims tell no more apart.
pub(super) const ON_LINE: f64 = 1e-10;

/// A surface with what every search on it needs.
#[derive(Clone, Debug)]
pub(super) struct Sheet<'a> {
    pub(super) surface: &'a Surface,
    pub(super) periodic: [bool; 2],
    pub(super) lo: DVec2,
    pub(super) hi: DVec2,
    pub(super) range: DVec2,
    /// Diagonal of the box of the control points.
    pub(super) size: f64,
    /// Error of a point that was computed.
    pub(super) rounding: f64,
    pub(super) poles: Vec<Pole>,
    /// In u and in v: the knots over which the surface has no continuous second derivative, ends of the range included.
    pub(super) rough: [Vec<f64>; 2],
    /// In u and in v: all distinct knots of the range.
    pub(super) breaks: [Vec<f64>; 2],
    pub(super) cells: Vec<Cell>,
}

impl<'a> Sheet<'a> {
    pub(super) fn new(surface: &'a Surface, periodic: [bool; 2]) -> Self {
        let (u, v) = (surface.domain_u(), surface.domain_v());
        let (lo, hi) = (DVec2::new(u[0], v[0]), DVec2::new(u[1], v[1]));
        let (low, high) = net_box(surface.homogeneous());
        let largest = low.abs().max(high.abs()).max_element();
        let knots = [surface.knots_u(), surface.knots_v()];
        Self {
            surface,
            periodic,
            lo,
            hi,
            range: hi - lo,
            size: (high - low).length(),
            // Evaluation is a few dozen roundings of numbers no larger than the coordinates.
            rounding: 32.0 * f64::EPSILON * largest,
            poles: pole::find(surface),
            rough: knots.map(rough),
            breaks: knots.map(KnotVector::breaks),
            cells: surface.bezier_patches(0).into_iter().map(Cell::new).collect(),
        }
    }

    /// The nearest parameters that there are: in a periodic direction all.
    pub(super) fn within(&self, uv: DVec2) -> DVec2 {
        let inside = uv.clamp(self.lo, self.hi);
        DVec2::select(glam::BVec2::new(self.periodic[0], self.periodic[1]), uv, inside)
    }

    /// The whole periods by which a parameter is beyond the range. Where a little more is as good as the next, it counts as that.
    pub(super) fn periods(&self, uv: DVec2) -> DVec2 {
        let turns = |d: usize| {
            if self.periodic[d] { libm::floor((uv[d] - self.lo[d]) / self.range[d] + ON_LINE) } else { 0.0 }
        };
        DVec2::new(turns(0), turns(1))
    }

    /// The same point of the surface within the parameter range.
    pub(super) fn wrapped(&self, uv: DVec2) -> DVec2 {
        let inside = uv.cmpge(self.lo) & uv.cmple(self.hi);
        if inside.all() { uv } else { (uv - self.periods(uv) * self.range).clamp(self.lo, self.hi) }
    }

    /// Each parameter moved onto the line over which the surface is not smooth, a border for one, if it is within `near`, or
    /// as good as on it.
    pub(super) fn on_line(&self, uv: DVec2, near: f64) -> DVec2 {
        let turns = self.periods(uv) * self.range;
        let snapped = |d: usize| {
            let inside = uv[d] - turns[d];
            let is_near = |x: &&f64| (**x - inside).abs() <= near.max(ON_LINE * self.range[d]);
            self.rough[d].iter().find(is_near).map_or(uv[d], |x| x + turns[d])
        };
        DVec2::new(snapped(0), snapped(1))
    }

    pub(super) fn eval(&self, uv: DVec2) -> DVec3 {
        let at = self.wrapped(uv);
        self.surface.eval(at.x, at.y)
    }

    pub(super) fn jet(&self, uv: DVec2) -> SurfaceJet {
        let at = self.wrapped(uv);
        self.surface.jet(at.x, at.y)
    }

    /// As [`jet`](Self::jet), on a line where the surface is not smooth that of the side to which `heading` points.
    pub(super) fn jet_toward(&self, uv: DVec2, heading: DVec2) -> SurfaceJet {
        let mut at = self.wrapped(uv);
        for d in 0..2 {
            let lines = &self.rough[d];
            let near = ON_LINE * self.range[d];
            let k = lines.partition_point(|&x| x < at[d] - near);
            if let Some(&line) = lines.get(k).filter(|&&x| x <= at[d] + near) {
                at[d] = line;
                if self.periodic[d] && line == self.lo[d] && heading[d] < 0.0 {
                    at[d] = self.hi[d];
                } else if self.periodic[d] && line == self.hi[d] && heading[d] >= 0.0 {
                    at[d] = self.lo[d];
                }
            }
        }
        self.surface.jet_from(at.x, at.y, [heading.x < 0.0, heading.y < 0.0])
    }

    /// The line nearest to `from` over which the surface is not smooth and that lies between the two: direction and place.
    pub(super) fn rough_line_between(&self, from: DVec2, to: DVec2) -> Option<(usize, f64)> {
        let mut best: Option<(f64, usize, f64)> = None;
        for d in 0..2 {
            let near = ON_LINE * self.range[d];
            let (a, b) = (from[d].min(to[d]) + near, from[d].max(to[d]) - near);
            if a >= b {
                continue;
            }
            let up = to[d] > from[d];
            let start = if up { a } else { b };
            let turns = self.periods(DVec2::splat(start))[d] * self.range[d];
            let lines = &self.rough[d];
            // Beyond the last line of this period comes the first of the next, which is the same.
            let line = if up {
                lines.iter().map(|x| x + turns).find(|&x| x > start)
            } else {
                lines.iter().rev().map(|x| x + turns).find(|&x| x < start)
            };
            let Some(line) = line.filter(|&x| a < x && x < b) else { continue };
            let share = (line - from[d]) / (to[d] - from[d]);
            if best.is_none_or(|(s, ..)| share < s) {
                best = Some((share, d, line));
            }
        }
        best.map(|(_, d, line)| (d, line))
    }

    /// The part of a difference at a point of the surface that is along it, and leads to another point of it.
    pub(super) fn part_along(&self, at: DVec2, e: DVec3) -> f64 {
        let jet = self.jet(at);
        let Some(n) = jet.du.cross(jet.dv).try_normalize() else { return e.length() };
        let mut e = e - n * n.dot(e);
        for (d, [out, border]) in [[jet.du, jet.dv], [jet.dv, jet.du]].into_iter().enumerate() {
            // Across the border: beyond it there is nothing, and what leads there counts as off.
            let Some(out) = (out - border * (out.dot(border) / border.length_squared())).try_normalize() else {
                continue;
            };
            let beyond = e.dot(out);
            if self.leaves(d, at[d], beyond) {
                e -= out * beyond;
            }
        }
        e.length()
    }

    /// Number of knots between two parameters, in both directions, over any number of periods.
    pub(super) fn breaks_between(&self, a: DVec2, b: DVec2) -> usize {
        let place = |d: usize, x: f64| {
            let breaks = &self.breaks[d];
            let turns = if self.periodic[d] { libm::floor((x - self.lo[d]) / self.range[d]) } else { 0.0 };
            let index = breaks.partition_point(|&k| k < x - turns * self.range[d]);
            turns * (breaks.len() - 1) as f64 + index as f64
        };
        (0..2).map(|d| (place(d, a[d]) - place(d, b[d])).abs() as usize).sum()
    }
}

/// The knots of the range that are repeated so often that second derivatives may jump, and its ends.
fn rough(knots: &KnotVector) -> Vec<f64> {
    let breaks = knots.breaks();
    let last = breaks.len() - 1;
    let jumps = |&(k, &t): &(usize, &f64)| k == 0 || k == last || knots.multiplicity(t) + 1 >= knots.degree();
    breaks.iter().enumerate().filter(jumps).map(|(_, &t)| t).collect()
}
