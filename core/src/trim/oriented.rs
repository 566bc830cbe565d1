//! Loops that keep what is on their left, on surfaces that close on themselves.
//!
//! This is how boundary representations bound a face. In a direction in which a surface is periodic its parameters go on
//! beyond the range, and a loop may close a whole period from where it began: round a cylinder, or round a pole. The
//! loops are cut where they pass a seam, and what is left of them in the parameter range ends and begins on its border;
//! from each end the bound goes on along the border, with the range on its left, to where the next one begins. Poles
//! need no rule of their own: a loop ends in one and begins in it again, and the border between is a single point.

use alloc::vec;
use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::trims::{SAME, SLACK};
use super::{TrimError, TrimLoop, TrimPiece, Trims};
use crate::nurbs::{Curve, Surface};

/// A curve of a trim loop.
#[derive(Clone, Debug, PartialEq)]
pub struct TrimCurve {
    /// The curve of (u, v, 0).
    pub curve: Curve,
    /// Identity of the edge of which it is one side: another surface whose trims have the same one ends there too, and the two
    /// are joined whatever their distance.
    pub edge: Option<u32>,
}

/// A part of a border of the parameter range that is a side of a shared edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BorderEdge {
    /// Interval of the parameter that runs along the border.
    pub t: [f64; 2],
    /// Identity of the edge.
    pub edge: u32,
}

/// A part of a loop within the parameter range that begins and ends on its border.
struct Arc {
    /// The loop it comes from.
    index: usize,
    pieces: Vec<TrimPiece>,
    /// Places of its ends along the border.
    begins: f64,
    ends: f64,
}

impl Trims {
    /// The part of `surface` on the left of the loops (u to the right, v up), each a list of curves end to end.
    ///
    /// In a `periodic` direction, u or v, the curves may leave the parameter range, each may lie any number of periods
    /// from the one before it, and a loop may close whole periods from where it began. A loop may end in a pole (a border
    /// that is a single point) and begin in it again elsewhere. If no loop reaches the border it is itself the outer
    /// bound, unless a loop inside is one; so without loops all of the surface is kept. Ends nearer than 10⁻⁶ of the
    /// range are made to meet, and those so near to the border or a seam are moved onto it. Cost: as [`Trims::new`].
    ///
    /// # Errors
    /// If a loop has no extent, is not closed, leaves the parameter range in another direction, or the loops do not bound
    /// one side.
    pub fn oriented(surface: &Surface, periodic: [bool; 2], loops: &[Vec<TrimCurve>]) -> Result<Self, TrimError> {
        let (u, v) = (surface.domain_u(), surface.domain_v());
        let (lo, hi) = (DVec2::new(u[0], v[0]), DVec2::new(u[1], v[1]));
        let domain = Domain { lo, hi, range: hi - lo, periodic, poles: poles(surface) };
        let (mut closed, mut arcs) = (Vec::new(), Vec::new());
        for (index, curves) in loops.iter().enumerate() {
            let pieces = domain.unwrapped(index, curves)?;
            domain.wrap(index, pieces, &mut closed, &mut arcs)?;
        }
        let border = if arcs.is_empty() { domain.needs_border(&closed) } else { false };
        closed.extend(domain.linked(arcs)?);
        if border {
            let corners = [lo, DVec2::new(hi.x, lo.y), hi, DVec2::new(lo.x, hi.y), lo];
            closed.push(corners.windows(2).map(|w| TrimPiece::straight(w[0], w[1])).collect());
        }
        let loops = closed.into_iter().map(|pieces| TrimLoop { pieces }).collect();
        let mut trims = Self { loops, lo, hi };
        trims.find_kept_sides();
        Ok(trims)
    }

    /// The parts of the borders u low, u high, v low and v high that are sides of shared edges.
    pub(crate) fn border_edges(&self) -> [Vec<BorderEdge>; 4] {
        let mut out = <[Vec<BorderEdge>; 4]>::default();
        for p in self.pieces() {
            let Some(edge) = p.edge() else { continue };
            let (lo, hi) = p.bounds();
            for (k, on) in out.iter_mut().enumerate() {
                let d = k / 2;
                let border = if k % 2 == 0 { self.lo[d] } else { self.hi[d] };
                if lo[d] == border && hi[d] == border {
                    on.push(BorderEdge { t: [lo[1 - d], hi[1 - d]], edge });
                }
            }
        }
        out
    }

    /// Whether the loops are the border of the parameter range, so that all of the surface is kept.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        let all = |[a, b]: [f64; 2], kept: Vec<[f64; 2]>| kept == [[a, b]];
        let (u, v) = ([self.lo.x, self.hi.x], [self.lo.y, self.hi.y]);
        self.pieces().all(|p| self.is_on_border(p))
            && u.iter().all(|&x| all(v, self.kept_on_border(crate::line::Axis::U, x)))
            && v.iter().all(|&y| all(u, self.kept_on_border(crate::line::Axis::V, y)))
    }
}

/// The parameter range of a surface, and how it closes.
struct Domain {
    lo: DVec2,
    hi: DVec2,
    range: DVec2,
    periodic: [bool; 2],
    /// Whether the borders u low, u high, v low, v high are points.
    poles: [bool; 4],
}

impl Domain {
    /// The pieces of a loop, each with the index of its curve, end to end but for poles, in parameters that go on over
    /// seams. Ends near lines of the border and its repetitions are on them.
    fn unwrapped(&self, index: usize, curves: &[TrimCurve]) -> Result<Vec<TrimPiece>, TrimError> {
        let mut pieces: Vec<(usize, TrimPiece)> = Vec::new();
        for (curve, c) in curves.iter().enumerate() {
            let mut own = Vec::new();
            for segment in c.curve.bezier_segments() {
                let points: Vec<DVec3> = segment.points.iter().map(|h| DVec3::new(h.x, h.y, h.w)).collect();
                TrimPiece::of_bezier(points, SAME * self.range, &mut own);
            }
            let Some(start) = own.first().map(TrimPiece::from) else { continue };
            let shift = pieces.last().map_or(DVec2::ZERO, |(_, before)| self.periods(before.to() - start));
            pieces.extend(own.into_iter().map(|p| (curve, p.moved(shift).with_edge(c.edge))));
        }
        let count = pieces.len();
        let (mut from, mut to) = (Vec::with_capacity(count), vec![DVec2::ZERO; count]);
        for k in 0..count {
            let before = (k + count - 1) % count;
            let (curve, start) = (pieces[k].0, pieces[k].1.from());
            // The last piece may end whole periods from where the first begins.
            let end = pieces[before].1.to();
            let turns = if k == 0 { self.periods(end - start) } else { DVec2::ZERO };
            let over = (self.lo - start).max(start - self.hi) / self.range;
            if (0..2).any(|d| !self.periodic[d] && over[d] > SLACK) {
                return Err(TrimError::Outside { index, curve, at: start.to_array() });
            }
            let joint = self.snapped(start);
            let meets = (start + turns - end).abs().cmple(SLACK * self.range).all();
            to[before] = if meets { joint + turns } else { self.snapped(end) };
            if !meets && !self.share_pole(to[before], joint) {
                let (end, start) = (end.to_array(), start.to_array());
                return Err(TrimError::Gap { index, curve: pieces[before].0, end, start });
            }
            from.push(joint);
        }
        let moved = |(k, (_, p)): (usize, (usize, TrimPiece))| p.with_ends(from[k], to[k]);
        let mut pieces: Vec<TrimPiece> = pieces.into_iter().enumerate().map(moved).collect();
        pieces.retain(|p| p.from() != p.to());
        if pieces.is_empty() { Err(TrimError::NoExtent { index }) } else { Ok(pieces) }
    }

    /// The whole periods nearest to a distance, in the directions that have any.
    fn periods(&self, distance: DVec2) -> DVec2 {
        let whole =
            |d: usize| if self.periodic[d] { libm::round(distance[d] / self.range[d]) * self.range[d] } else { 0.0 };
        DVec2::new(whole(0), whole(1))
    }

    /// The line of the border, or its repetition in a periodic direction, with the number `m`; 0 is the lower border.
    fn line(&self, d: usize, m: f64) -> f64 {
        if m == 1.0 { self.hi[d] } else { self.lo[d] + m * self.range[d] }
    }

    /// The point with the coordinates that are near a line of the border on it.
    fn snapped(&self, mut x: DVec2) -> DVec2 {
        for d in 0..2 {
            let m = libm::round((x[d] - self.lo[d]) / self.range[d]);
            let m = if self.periodic[d] { m } else { m.clamp(0.0, 1.0) };
            let line = self.line(d, m);
            if (x[d] - line).abs() <= SLACK * self.range[d] {
                x[d] = line;
            }
        }
        x
    }

    /// Whether two points are one because they lie on the same pole.
    fn share_pole(&self, a: DVec2, b: DVec2) -> bool {
        (0..4).any(|k| {
            let (d, value) = (k / 2, if k % 2 == 0 { self.lo[k / 2] } else { self.hi[k / 2] });
            self.poles[k] && a[d] == value && b[d] == value
        })
    }

    /// Cuts a loop at seams and moves its parts into the parameter range.
    fn wrap(
        &self,
        index: usize,
        pieces: Vec<TrimPiece>,
        closed: &mut Vec<Vec<TrimPiece>>,
        arcs: &mut Vec<Arc>,
    ) -> Result<(), TrimError> {
        let (mut in_u, mut cut) = (Vec::new(), Vec::new());
        let lines = [0, 1].map(|d| self.seams(d, &pieces));
        pieces.into_iter().for_each(|p| p.split_at(0, &lines[0], SAME * self.range.x, &mut in_u));
        in_u.into_iter().for_each(|p| p.split_at(1, &lines[1], SAME * self.range.y, &mut cut));
        let mut wrapped: Vec<TrimPiece> = cut.into_iter().map(|p| self.moved_into_range(p)).collect();
        // Two pieces on one side of a seam still meet; to rounding, where one was moved by a period.
        let count = wrapped.len();
        let meets = |a: DVec2, b: DVec2| (a - b).abs().cmple(SAME * 16.0 * self.range).all();
        let joined: Vec<bool> =
            (0..count).map(|k| meets(wrapped[(k + count - 1) % count].to(), wrapped[k].from())).collect();
        for k in 0..count {
            if joined[k] {
                let start = wrapped[(k + count - 1) % count].to();
                let piece = wrapped[k].clone();
                let to = piece.to();
                wrapped[k] = piece.with_ends(start, to);
            }
        }
        let Some(first) = joined.iter().position(|j| !j) else {
            closed.push(wrapped);
            return Ok(());
        };
        wrapped.rotate_left(first);
        let mut parts: Vec<Vec<TrimPiece>> = Vec::new();
        for (k, piece) in wrapped.into_iter().enumerate() {
            match parts.last_mut() {
                Some(part) if joined[(first + k) % count] => part.push(piece),
                _ => parts.push(vec![piece]),
            }
        }
        for pieces in parts {
            let place = |x: DVec2| self.along_border(x).ok_or(TrimError::Open { index, at: x.to_array() });
            let (begins, ends) = (place(pieces[0].from())?, place(pieces[pieces.len() - 1].to())?);
            arcs.push(Arc { index, pieces, begins, ends });
        }
        Ok(())
    }

    /// The seams in direction `d` that pieces reach, in increasing order.
    fn seams(&self, d: usize, pieces: &[TrimPiece]) -> Vec<f64> {
        if !self.periodic[d] {
            return Vec::new();
        }
        let ends = || pieces.iter().flat_map(|p| [p.from()[d], p.to()[d]]);
        let cell = |x: f64| (x - self.lo[d]) / self.range[d];
        let first = libm::floor(cell(ends().fold(f64::INFINITY, f64::min)));
        let last = libm::ceil(cell(ends().fold(f64::NEG_INFINITY, f64::max)));
        // A curve winds round a surface a few times; one that winds more often is cut at the first of them, and is then
        // found to be open.
        let count = (last - first).clamp(0.0, 64.0) as u32;
        (0..=count).map(|k| self.line(d, first + f64::from(k))).collect()
    }

    /// A piece that passes no seam, moved by whole periods into the parameter range. One that runs along a seam goes to the
    /// side on which it has the range on its left.
    fn moved_into_range(&self, piece: TrimPiece) -> TrimPiece {
        let (mut shift, mut from, mut to) = (DVec2::ZERO, piece.from(), piece.to());
        for d in (0..2).filter(|&d| self.periodic[d]) {
            let middle = (0.5 * (from[d] + to[d]) - self.lo[d]) / self.range[d];
            let cell = if from[d] == to[d] && libm::fabs(middle - libm::round(middle)) <= SAME {
                let runs_up = to[1 - d] > from[1 - d];
                let low_side = runs_up == (d == 0);
                libm::round(middle) - if low_side { 1.0 } else { 0.0 }
            } else {
                libm::floor(middle)
            };
            shift[d] = -cell * self.range[d];
            for x in [&mut from, &mut to] {
                x[d] = if x[d] == self.line(d, cell) {
                    self.lo[d]
                } else if x[d] == self.line(d, cell + 1.0) {
                    self.hi[d]
                } else {
                    (x[d] + shift[d]).clamp(self.lo[d], self.hi[d])
                };
            }
        }
        piece.moved(shift).with_ends(from.clamp(self.lo, self.hi), to.clamp(self.lo, self.hi))
    }

    /// Place of a point along the border, counterclockwise from the lower left corner, by whole sides; none inside.
    fn along_border(&self, x: DVec2) -> Option<f64> {
        let at = (x - self.lo) / self.range;
        if x.y == self.lo.y {
            Some(at.x)
        } else if x.x == self.hi.x {
            Some(1.0 + at.y)
        } else if x.y == self.hi.y {
            Some(3.0 - at.x)
        } else if x.x == self.lo.x {
            Some(4.0 - at.y)
        } else {
            None
        }
    }

    /// The arcs as closed loops, which run along the border from the end of one to the beginning of the next.
    fn linked(&self, arcs: Vec<Arc>) -> Result<Vec<Vec<TrimPiece>>, TrimError> {
        let ahead = |from: f64, to: f64| if to >= from { to - from } else { to - from + 4.0 };
        let mut next = Vec::with_capacity(arcs.len());
        let mut taken = vec![false; arcs.len()];
        for arc in &arcs {
            let nearest = (0..arcs.len())
                .min_by(|&a, &b| ahead(arc.ends, arcs[a].begins).total_cmp(&ahead(arc.ends, arcs[b].begins)));
            match nearest {
                Some(k) if !taken[k] => {
                    taken[k] = true;
                    next.push(k);
                }
                _ => {
                    let at = arc.pieces[arc.pieces.len() - 1].to().to_array();
                    return Err(TrimError::Open { index: arc.index, at });
                }
            }
        }
        let mut arcs: Vec<Option<Arc>> = arcs.into_iter().map(Some).collect();
        let mut out = Vec::new();
        for first in 0..arcs.len() {
            let mut pieces: Vec<TrimPiece> = Vec::new();
            let mut k = first;
            while let Some(arc) = arcs[k].take() {
                self.along(&mut pieces, arc.pieces[0].from());
                pieces.extend(arc.pieces);
                k = next[k];
            }
            if let Some(start) = pieces.first().map(TrimPiece::from) {
                self.along(&mut pieces, start);
                out.push(pieces);
            }
        }
        Ok(out)
    }

    /// Appends the way along the border from the end of the pieces, if there are any, to the point `goal` on it.
    fn along(&self, pieces: &mut Vec<TrimPiece>, goal: DVec2) {
        let Some(mut here) = pieces.last().map(TrimPiece::to) else { return };
        let (Some(mut at), Some(to)) = (self.along_border(here), self.along_border(goal)) else { return };
        let to = if to >= at { to } else { to + 4.0 };
        let corner = |k: f64| {
            let k = k % 4.0;
            DVec2::new(
                if k == 1.0 || k == 2.0 { self.hi.x } else { self.lo.x },
                if k >= 2.0 { self.hi.y } else { self.lo.y },
            )
        };
        while at < to {
            let side = libm::floor(at) + 1.0;
            let (end, stop) = if side < to { (side, corner(side)) } else { (to, goal) };
            if here != stop {
                pieces.push(TrimPiece::straight(here, stop));
            }
            (at, here) = (end, stop);
        }
    }

    /// Whether the border is a bound, if no loop ends on it: nothing is inside, or the loop farthest to the left has the
    /// kept part outside.
    fn needs_border(&self, loops: &[Vec<TrimPiece>]) -> bool {
        let leftmost = |l: &Vec<TrimPiece>| l.iter().map(|p| p.bounds().0.x).fold(f64::INFINITY, f64::min);
        match loops.iter().min_by(|a, b| leftmost(a).total_cmp(&leftmost(b))) {
            None => true,
            Some(l) => area(l, self.lo) < 0.0,
        }
    }
}

/// Twice the area that a loop runs round counterclockwise, up to what its pieces bulge: enough for its sign, because the
/// pieces run one way and are cut fine enough for it here.
fn area(pieces: &[TrimPiece], origin: DVec2) -> f64 {
    const CHORDS: u32 = 16;
    let mut sum = 0.0;
    for p in pieces {
        for k in 0..CHORDS {
            let at = |k: u32| p.eval(f64::from(k) / f64::from(CHORDS)) - origin;
            sum += at(k).perp_dot(at(k + 1));
        }
    }
    sum
}

/// Largest extent of a pole, of its surface's: as wide as what counts as one point in stitching.
const POLE: f64 = 1e-6;

/// Whether the borders u low, u high, v low, v high are points.
fn poles(surface: &Surface) -> [bool; 4] {
    let clamped = surface.clamped();
    let net: Vec<DVec3> = clamped.homogeneous().iter().map(|h| h.truncate() / h.w).collect();
    let extent = |points: &mut dyn Iterator<Item = DVec3>| {
        let (lo, hi) = points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
        (hi - lo).length()
    };
    let small = POLE * extent(&mut net.iter().copied());
    let width = clamped.knots_v().control_count();
    let rows = clamped.knots_u().control_count();
    let row = |i: usize| extent(&mut net[i * width..(i + 1) * width].iter().copied()) <= small;
    let column = |j: usize| extent(&mut net.iter().copied().skip(j).step_by(width)) <= small;
    [row(0), row(rows - 1), column(0), column(width - 1)]
}

#[cfg(test)]
mod tests;
