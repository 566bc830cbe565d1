//! Curves split where their visibility can change: pieces.
//!
//! Along a curve the number of sheets in front changes only where an active curve (silhouette, boundary, crease) that is
//! nearer to the eye crosses it on the screen, where the curve meets the silhouette of its own surface, at its own
//! corners and cusps, and where it pierces another surface (Elber and Cohen 1989, lemma 2.5 and corollary 2.1; they
//! exclude piercing). Crossings are found by intersecting arcs, piercings by intersecting arcs and patches; places on the
//! curve's own surface come with the curve, from parameter space.

mod alongside;
mod arc;
mod arcs;
mod cluster;
mod cover;
mod division;
mod intersect;
mod meeting;
mod one_by_one;
mod pierce;
pub mod region;
mod run;
mod splitter;

use alloc::vec::Vec;

use glam::DVec4;

use crate::stitch::Stitching;
use crate::stop::Stop;
use crate::view::Patch;
pub use arcs::{Arcs, CurveArcs};
pub use cluster::{Clusters, clusters};
pub use one_by_one::{OneByOne, lengths};

use arc::{Arc, Control};
use division::Recent;
use intersect::{Work, meetings};
use meeting::Meeting;
use pierce::Boxes;
use splitter::Splitter;

/// Fractions of an interval at which an arc is compared with another one, or with a surface, to tell whether they
/// coincide: more places than the coordinates of two arcs of ordinary degree can agree at without being the same.
const PROBES: [f64; 9] = [0.06, 0.17, 0.28, 0.39, 0.5, 0.61, 0.72, 0.83, 0.94];

/// A part of a curve with one quantitative invisibility.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// Index of the curve.
    pub curve: usize,
    /// Interval of the curve's parameter.
    pub t: [f64; 2],
    /// The inked curve, nearer or first in order, that already draws the same line on the screen: another one, or this one in
    /// another piece.
    pub covered_by: Option<usize>,
    /// Whether it runs along something not behind it on the screen, drawn or not.
    pub coincident: bool,
    /// What separates it from the piece before it on the curve; nothing at the beginning of the curve.
    pub entered: Vec<Cut>,
    /// Whether the piece begins, and ends, where the curve does and something splits it there, other than the edge of its
    /// own surface that it ends at: what continues the curve beyond its end may then have another invisibility.
    pub crossed: [bool; 2],
}

/// Why a curve is split at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cut {
    /// It meets the silhouette of its own surface there, or has a corner.
    Own,
    /// It goes through a surface that it does not belong to.
    Piercing,
    /// An active curve crosses it on the screen.
    Crossing {
        /// Index of the active curve.
        with: usize,
        /// The parameter of the active curve.
        at: f64,
        /// The active curve is nearer to the eye by more than what counts as a contact; else the two touch.
        nearer: bool,
    },
    /// It begins or ends to run along another curve.
    Overlap,
}

/// What arranging counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ArrangeStats {
    /// Curves that came in.
    pub curves: u64,
    /// Pairs of arcs near enough to be intersected.
    pub pairs_near: u64,
    /// Pairs of arcs that were not, because they lie on one cluster of surfaces.
    pub pairs_clustered: u64,
    /// Halvings of arcs.
    pub subdivisions: u64,
    /// Newton steps.
    pub newton: u64,
    /// Crossings with something not behind.
    pub crossings: u64,
    /// Places where curves pierce surfaces that they do not belong to.
    pub piercings: u64,
    /// Intervals in which curves coincide on the screen.
    pub overlaps: u64,
    /// Pairs of arcs, or of an arc and a patch, whose subdivision came to no end; what they have in common may be
    /// missing.
    pub undecided: u64,
    /// Pieces that came out.
    pub pieces: u64,
}

impl ArrangeStats {
    /// Adds what was counted for further curves.
    pub(crate) fn add(&mut self, other: Self) {
        self.curves += other.curves;
        self.pairs_near += other.pairs_near;
        self.pairs_clustered += other.pairs_clustered;
        self.subdivisions += other.subdivisions;
        self.newton += other.newton;
        self.crossings += other.crossings;
        self.piercings += other.piercings;
        self.overlaps += other.overlaps;
        self.undecided += other.undecided;
        self.pieces += other.pieces;
    }
}

/// Approximate length along one curve on the screen, piecewise linear in the curve parameter. Where the curve is longer than
/// the resolution, lengths between places are right to a factor of two and a half, however unevenly the parameter runs.
#[derive(Clone, Debug, PartialEq)]
pub struct LengthTable {
    knots: Vec<(f64, f64)>,
}

impl LengthTable {
    /// Length from the beginning to the parameter `t`, screen units.
    #[must_use]
    pub fn length_at(&self, t: f64) -> f64 {
        let k = self.knots.partition_point(|n| n.0 <= t).clamp(1, self.knots.len() - 1);
        let ((t0, l0), (t1, l1)) = (self.knots[k - 1], self.knots[k]);
        if t1 > t0 { l0 + (l1 - l0) * ((t - t0) / (t1 - t0)).clamp(0.0, 1.0) } else { l0 }
    }

    /// The parameter at a length from the beginning.
    #[must_use]
    pub fn param_at(&self, length: f64) -> f64 {
        let k = self.knots.partition_point(|n| n.1 <= length).clamp(1, self.knots.len() - 1);
        let ((t0, l0), (t1, l1)) = (self.knots[k - 1], self.knots[k]);
        if l1 > l0 { t0 + (t1 - t0) * ((length - l0) / (l1 - l0)).clamp(0.0, 1.0) } else { t0 }
    }

    /// Whole length.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.knots[self.knots.len() - 1].1
    }
}

/// The pieces of all curves.
#[derive(Clone, Debug)]
pub struct Arrangement {
    /// Curve by curve, in the order of the parameter. A curve shorter than the resolution has none.
    pub pieces: Vec<Piece>,
    /// Length along each curve.
    pub lengths: Vec<LengthTable>,
    /// Counts.
    pub stats: ArrangeStats,
}

/// Below what lengths, in view space, things are one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Crossings nearer together than this are one, and curves within it of each other on the screen coincide.
    pub resolution: f64,
    /// A curve within this of a surface runs in it and does not pierce it.
    pub contact: f64,
}

/// Splits every curve; `patches` are those that can hide something (patches seen edge-on cannot). Every crossing farther
/// than the resolution from another, and at an angle that the arithmetic can see, is found. Cost: proportional to the
/// number of near pairs of arcs, and of arcs and patches.
#[must_use]
pub fn arrange(
    arcs: CurveArcs<'_>,
    patches: &[&Patch],
    stitching: &Stitching,
    clusters: &Clusters,
    tolerance: Tolerance,
    stop: Stop<'_>,
) -> Arrangement {
    let curves = arcs.curves;
    let joined = stitching.joined_surfaces();
    let boxes = Boxes::of(arcs, joined.len());
    let splitter = Splitter::new(arcs, patches, joined, boxes, clusters, tolerance);
    let split = |recent: &mut Recent, index: usize| {
        let curve = arcs.one(index);
        let table = curve.length_table(tolerance.resolution);
        if stop.is_wanted() {
            return (Vec::new(), table, ArrangeStats::default());
        }
        let (pieces, stats) = splitter.split(curve, &table, recent);
        (pieces, table, stats)
    };
    #[cfg(feature = "parallel")]
    let parts: Vec<_> = {
        use rayon::prelude::*;
        (0..curves.len()).into_par_iter().map_init(Recent::default, split).collect()
    };
    // One after the other, so that what is found is in memory once.
    #[cfg(not(feature = "parallel"))]
    let parts = {
        let mut recent = Recent::default();
        (0..curves.len()).map(move |index| split(&mut recent, index))
    };
    let mut stats = ArrangeStats::default();
    let (mut pieces, mut lengths) = (Vec::new(), Vec::with_capacity(curves.len()));
    for (part, table, work) in parts {
        stats.add(work);
        pieces.extend(part);
        lengths.push(table);
    }
    // What is not needed any more goes first: the pieces may have to be moved.
    drop(splitter);
    pieces.shrink_to_fit();
    Arrangement { pieces, lengths, stats }
}

/// What two curves have in common on the screen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Intersection {
    /// Parameters of the two curves at each crossing. One at a joint of the subdivision may come up twice.
    pub crossings: Vec<[f64; 2]>,
    /// Intervals of the two curves' parameters in which they run within the resolution of each other.
    pub overlaps: Vec<[[f64; 2]; 2]>,
    /// Halvings of a curve.
    pub subdivisions: u64,
    /// Newton steps.
    pub newton: u64,
}

/// Intersects two rational Bézier curves, given by homogeneous control points with positive weights, on the screen: the
/// paper's algorithm (Elber and Cohen 1989, §4) by itself. Both have the parameter range 0 to 1. None if a degree is
/// above [`MAX_DEGREE`](crate::view::MAX_DEGREE) or a curve has no control points.
#[must_use]
pub fn intersect(a: &[DVec4], b: &[DVec4], resolution: f64) -> Option<Intersection> {
    let arc = |points: &[DVec4]| {
        let control = Control::from_slice(points).ok().filter(|c| !c.is_empty())?;
        Some(Arc::new(0, [0.0, 1.0], control, 0.0))
    };
    let (mut found, mut work) = (Vec::new(), Work::default());
    meetings(&arc(a)?, &arc(b)?, resolution, &mut found, &mut work);
    let mut out = Intersection { subdivisions: work.subdivisions, newton: work.newton, ..Intersection::default() };
    for meeting in found {
        match meeting {
            Meeting::Crossing { a, b, .. } => out.crossings.push([a, b]),
            Meeting::Overlap { a, b, .. } => out.overlaps.push([a, b]),
        }
    }
    Some(out)
}
