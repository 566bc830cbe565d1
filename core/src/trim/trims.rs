//! The checked trims of a surface, and what lies inside.

use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::{TrimError, TrimPiece};
use crate::nurbs::{Curve, Surface};

/// Ends of curves nearer than this part of the parameter range meet, and what overshoots the range by no more is taken
/// to end on it: models come out of other programs with seven digits.
pub(super) const SLACK: f64 = 1e-6;

/// What is nearer than this part of the parameter range to its border, or to a line, is on it: the rounding of
/// parameters that were computed, some thousand units in the last place.
pub(super) const SAME: f64 = 1e-12;

/// Sine of the turn, in parameters scaled to the unit square, from which on a joint of pieces is a corner.
const CORNER: f64 = 1e-3;

/// A closed loop of pieces, end to end; neighbours share their common end bit for bit.
#[derive(Clone, Debug, PartialEq)]
pub struct TrimLoop {
    pub(super) pieces: Vec<TrimPiece>,
}

impl TrimLoop {
    /// The pieces in order.
    #[must_use]
    pub fn pieces(&self) -> &[TrimPiece] {
        &self.pieces
    }
}

/// How a rectangle of parameters lies to the trims.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cover {
    /// All of it is kept.
    Inside,
    /// All of it is cut off.
    Outside,
    /// A trim curve enters it.
    Mixed,
}

/// What trim curves a rectangle holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Nearby {
    /// None.
    None,
    /// A single piece.
    Edge {
        /// Direction of the piece in (u, v).
        direction: DVec2,
        /// Whether the surface is kept on its left.
        left: bool,
    },
    /// A corner, or several.
    Several,
}

/// The part of a surface that is kept.
///
/// Invariants: there is a loop, each is closed and within the surface's parameter range. What lies on a trim curve
/// itself is neither inside nor outside; ask for what is beside it.
#[derive(Clone, Debug, PartialEq)]
pub struct Trims {
    pub(super) loops: Vec<TrimLoop>,
    /// The surface's parameter range.
    pub(super) lo: DVec2,
    pub(super) hi: DVec2,
}

impl Trims {
    /// The part of `surface` that is inside by the even-odd rule over the loops, each a list of curves in (u, v), whose
    /// z is ignored.
    ///
    /// Curves that end within 10⁻⁶ of the parameter range of where the next one begins are made to meet; what
    /// overshoots the range by no more is moved onto its border. Cost: the roots of two polynomials of degree 2p − 1
    /// for each polynomial piece of degree p, and a crossing for each pair of pieces that lie beside or on one another.
    ///
    /// # Errors
    /// If there is no loop, or one has no extent, is not closed or leaves the parameter range.
    pub fn new(surface: &Surface, loops: &[Vec<Curve>]) -> Result<Self, TrimError> {
        if loops.is_empty() {
            return Err(TrimError::NoLoops);
        }
        let (u, v) = (surface.domain_u(), surface.domain_v());
        let mut trims =
            Self { loops: Vec::with_capacity(loops.len()), lo: DVec2::new(u[0], v[0]), hi: DVec2::new(u[1], v[1]) };
        for (index, curves) in loops.iter().enumerate() {
            let pieces = trims.closed(index, curves)?;
            trims.loops.push(TrimLoop { pieces });
        }
        trims.find_kept_sides();
        Ok(trims)
    }

    /// Trims that were taken apart into their loops and those into their pieces, put together bit for bit.
    ///
    /// # Errors
    /// If a loop has no pieces, is not closed or leaves the parameter range of `surface`.
    pub fn restored(surface: &Surface, loops: Vec<Vec<TrimPiece>>) -> Result<Self, TrimError> {
        if loops.is_empty() {
            return Err(TrimError::NoLoops);
        }
        let (u, v) = (surface.domain_u(), surface.domain_v());
        let (lo, hi) = (DVec2::new(u[0], v[0]), DVec2::new(u[1], v[1]));
        for (index, pieces) in loops.iter().enumerate() {
            let Some(last) = pieces.last() else { return Err(TrimError::NoExtent { index }) };
            let mut before = last;
            for (curve, piece) in pieces.iter().enumerate() {
                let (end, start) = (before.to(), piece.from());
                if end != start {
                    let curve = (curve + pieces.len() - 1) % pieces.len();
                    return Err(TrimError::Gap { index, curve, end: end.to_array(), start: start.to_array() });
                }
                if start != start.clamp(lo, hi) {
                    return Err(TrimError::Outside { index, curve, at: start.to_array() });
                }
                before = piece;
            }
        }
        Ok(Self { loops: loops.into_iter().map(|pieces| TrimLoop { pieces }).collect(), lo, hi })
    }

    /// The pieces of one loop.
    fn closed(&self, index: usize, curves: &[Curve]) -> Result<Vec<TrimPiece>, TrimError> {
        let range = self.hi - self.lo;
        let mut pieces: Vec<(usize, TrimPiece)> = Vec::new();
        let mut own = Vec::new();
        for (curve, c) in curves.iter().enumerate() {
            for segment in c.bezier_segments() {
                let points: Vec<DVec3> = segment.points.iter().map(|h| DVec3::new(h.x, h.y, h.w)).collect();
                TrimPiece::of_bezier(points, SAME * range, &mut own);
            }
            pieces.extend(own.drain(..).map(|p| (curve, p)));
        }
        let count = pieces.len();
        let mut joints = Vec::with_capacity(count + 1);
        for k in 0..count {
            let (curve, start) = (pieces[k].0, pieces[k].1.from());
            let before = &pieces[(k + count - 1) % count];
            let end = before.1.to();
            if (start - end).abs().cmpgt(SLACK * range).any() {
                let (end, start) = (end.to_array(), start.to_array());
                return Err(TrimError::Gap { index, curve: before.0, end, start });
            }
            let over = (self.lo - start).max(start - self.hi);
            if over.cmpgt(SLACK * range).any() {
                return Err(TrimError::Outside { index, curve, at: start.to_array() });
            }
            joints.push(self.on_border(start));
        }
        joints.extend(joints.first().copied());
        let moved = |(k, (_, p)): (usize, (usize, TrimPiece))| p.with_ends(joints[k], joints[k + 1]);
        let mut pieces: Vec<TrimPiece> = pieces.into_iter().enumerate().map(moved).collect();
        // A piece that is one point says nothing; its neighbours share that point.
        pieces.retain(|p| p.from() != p.to());
        if pieces.is_empty() {
            return Err(TrimError::NoExtent { index });
        }
        Ok(pieces)
    }

    /// A point that is on the border of the parameter range to rounding, or beyond it, moved onto the border.
    fn on_border(&self, mut x: DVec2) -> DVec2 {
        let noise = SAME * (self.hi - self.lo);
        for k in 0..2 {
            for border in [self.lo[k], self.hi[k]] {
                if (x[k] - border).abs() <= noise[k] {
                    x[k] = border;
                }
            }
        }
        x.clamp(self.lo, self.hi)
    }

    /// Finds what is kept beside each piece. Pieces are cut first where others begin or end on them: along what two have in
    /// common, and nowhere else, the surface is the same on both sides.
    pub(super) fn find_kept_sides(&mut self) {
        let noise = self.noise();
        let joints: Vec<DVec2> = self.pieces().map(TrimPiece::from).collect();
        for own in &mut self.loops {
            let mut cut = Vec::with_capacity(own.pieces.len());
            for piece in own.pieces.drain(..) {
                let mut places: Vec<(f64, DVec2)> =
                    joints.iter().filter_map(|&at| piece.passes(at, noise).map(|s| (s, at))).collect();
                places.sort_by(|a, b| a.0.total_cmp(&b.0));
                let mut rest = piece;
                for (_, at) in places {
                    // Of two that are one to rounding the second is an end now.
                    if let Some(s) = rest.passes(at, noise) {
                        let (before, after) = rest.split(s, Some(at));
                        cut.push(before);
                        rest = after;
                    }
                }
                cut.push(rest);
            }
            own.pieces = cut;
        }
        let sides: Vec<Vec<Option<bool>>> =
            self.loops.iter().map(|l| l.pieces.iter().map(|p| self.kept_side(p)).collect()).collect();
        for (own, side) in self.loops.iter_mut().zip(sides) {
            for (piece, left) in own.pieces.iter_mut().zip(side) {
                piece.left = left;
            }
        }
    }

    /// Whether what is kept lies on the left of a piece of these trims: by the number of trim curves beyond its middle.
    fn kept_side(&self, piece: &TrimPiece) -> Option<bool> {
        let range = self.hi - self.lo;
        let chord = (piece.to() - piece.from()) / range;
        // Across the coordinate along which the piece runs more, one looks along the other one.
        let along = usize::from(chord.y.abs() >= chord.x.abs());
        let across = 1 - along;
        let value = 0.5 * (piece.from()[along] + piece.to()[along]);
        let here = piece.eval(piece.reaches(along, value))[across];
        let (mut beyond, mut same) = (0, 0);
        for p in self.pieces().filter(|p| (p.from()[along] <= value) != (p.to()[along] <= value)) {
            let there = p.eval(p.reaches(along, value))[across];
            if (there - here).abs() <= SAME * range[across] {
                same += 1;
            } else if there > here {
                beyond += 1;
            }
        }
        // Up along v the larger u lies on the right, to the right along u the larger v on the left.
        let right_handed = (along == 1) == (chord[along] > 0.0);
        (same % 2 == 1).then_some((beyond % 2 == 1) != right_handed)
    }

    /// The loops.
    #[must_use]
    pub fn loops(&self) -> &[TrimLoop] {
        &self.loops
    }

    pub(super) fn pieces(&self) -> impl Iterator<Item = &TrimPiece> {
        self.loops.iter().flat_map(|l| &l.pieces)
    }

    /// Distance in u and in v within which parameters are the same to rounding.
    pub(crate) fn noise(&self) -> DVec2 {
        SAME * (self.hi - self.lo)
    }

    /// Lower and upper corner of the box that holds all loops.
    #[must_use]
    pub fn bounds(&self) -> (DVec2, DVec2) {
        self.pieces().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(lo, hi), p| {
            let (low, high) = p.bounds();
            (lo.min(low), hi.max(high))
        })
    }

    /// Whether the point (u, v) is kept: whether an odd number of trim curves lies at larger u. On a trim curve itself,
    /// to rounding, the answer is either. Cost: a root for each piece whose box holds the point.
    #[must_use]
    pub fn contains(&self, at: DVec2) -> bool {
        let mut inside = false;
        for p in self.pieces().filter(|p| (p.from().y <= at.y) != (p.to().y <= at.y)) {
            let (lo, hi) = p.bounds();
            let beyond = at.x < lo.x || (at.x < hi.x && at.x < p.eval(p.reaches(1, at.y)).x);
            inside ^= beyond;
        }
        inside
    }

    /// Whether a piece runs along the border of the parameter range.
    pub(crate) fn is_on_border(&self, p: &TrimPiece) -> bool {
        (0..2).any(|k| p.from()[k] == p.to()[k] && (p.from()[k] == self.lo[k] || p.from()[k] == self.hi[k]))
    }

    /// How the closed rectangle from `lo` to `hi` lies to the trims. A trim curve along the border of the parameter
    /// range does not enter it: the surface ends there anyway.
    #[must_use]
    pub fn cover(&self, lo: DVec2, hi: DVec2) -> Cover {
        if self.pieces().any(|p| p.enters(lo, hi) && !self.is_on_border(p)) {
            return Cover::Mixed;
        }
        // The middle of what of the rectangle is in the parameter range.
        let middle = 0.5 * (lo.max(self.lo) + hi.min(self.hi));
        if self.contains(middle) { Cover::Inside } else { Cover::Outside }
    }

    /// What trim curves enter the closed rectangle from `lo` to `hi`; those along the border of the parameter range and
    /// those that part nothing left out.
    #[must_use]
    pub fn nearby(&self, lo: DVec2, hi: DVec2) -> Nearby {
        let mut found = Nearby::None;
        for p in self.pieces().filter(|p| p.enters(lo, hi) && !self.is_on_border(p)) {
            let Some(left) = p.left else { continue };
            if found != Nearby::None {
                return Nearby::Several;
            }
            let middle = 0.5 * (lo + hi);
            let (low, high) = p.bounds();
            let k = usize::from(high.y - low.y > high.x - low.x);
            let s = p.reaches(k, middle[k].clamp(low[k], high[k]));
            found = Nearby::Edge { direction: p.jet(s).1, left };
        }
        found
    }

    /// The same trims with their pieces cut where they pass the lines of constant u and of constant v in `us` and `vs`,
    /// both in increasing order.
    #[must_use]
    pub fn cut_at(&self, us: &[f64], vs: &[f64]) -> Self {
        let noise = self.noise();
        let cut = |l: &TrimLoop| {
            let (mut in_u, mut pieces) = (Vec::new(), Vec::new());
            l.pieces.iter().for_each(|p| p.clone().split_at(0, us, noise.x, &mut in_u));
            in_u.into_iter().for_each(|p| p.split_at(1, vs, noise.y, &mut pieces));
            TrimLoop { pieces }
        };
        Self { loops: self.loops.iter().map(cut).collect(), ..*self }
    }

    /// The same trims with the shared edges named otherwise: `name` is asked for each piece along one, loop by loop.
    #[must_use]
    pub fn with_edges(mut self, name: &mut dyn FnMut(u32) -> u32) -> Self {
        for piece in self.loops.iter_mut().flat_map(|l| &mut l.pieces) {
            piece.edge = piece.edge.map(&mut *name);
        }
        self
    }

    /// The trims of the surface with [u run backwards](Surface::reversed_u).
    #[must_use]
    pub fn reversed_u(&self) -> Self {
        let mirrored = |p: &TrimPiece| p.mirrored_u([self.lo.x, self.hi.x]);
        let loops = self.loops.iter().map(|l| TrimLoop { pieces: l.pieces.iter().map(mirrored).collect() });
        Self { loops: loops.collect(), ..*self }
    }

    /// Whether the loop turns at the joint between two neighbouring pieces.
    #[must_use]
    pub fn is_corner(&self, before: &TrimPiece, after: &TrimPiece) -> bool {
        let range = self.hi - self.lo;
        let [a, b] = [before.directions()[1], after.directions()[0]].map(|d| (d / range).normalize_or_zero());
        a.dot(b) <= 0.0 || a.perp_dot(b).abs() > CORNER
    }

    /// The surface's parameter range: lower and upper corner.
    pub(crate) fn range(&self) -> (DVec2, DVec2) {
        (self.lo, self.hi)
    }
}
