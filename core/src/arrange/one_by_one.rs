//! Curves split one after the other, so that only the pieces of one are in memory.

use alloc::vec::Vec;

use super::arcs::OneCurve;
use super::division::Recent;
use super::pierce::Boxes;
use super::splitter::Splitter;
use super::{ArrangeStats, Clusters, CurveArcs, LengthTable, Piece, Tolerance};
use crate::extract::SurfaceCurve;
use crate::stitch::Stitching;
use crate::view::Patch;

/// One curve, split.
#[derive(Clone, Debug)]
pub struct SplitCurve {
    /// Its pieces in the order of the parameter; none if it is shorter than the resolution.
    pub pieces: Vec<Piece>,
    /// Length along it.
    pub lengths: LengthTable,
    /// Counts of this curve.
    pub stats: ArrangeStats,
}

/// Splits curves one after the other, as [`arrange`](super::arrange) does all of them.
pub struct OneByOne<'a> {
    arcs: CurveArcs<'a>,
    splitter: Splitter<'a>,
    recent: Recent,
}

impl<'a> OneByOne<'a> {
    /// What splits the curves of `arcs`, and `later` ones, which are not active: these are not kept, and are to be handed over again
    /// one by one. The other arguments are those of [`arrange`](super::arrange). Cost: linear in the number of arcs and patches.
    #[must_use]
    pub fn new(
        arcs: CurveArcs<'a>,
        later: impl Iterator<Item = SurfaceCurve>,
        patches: &'a [&'a Patch],
        stitching: &Stitching,
        clusters: &'a Clusters,
        tolerance: Tolerance,
    ) -> Self {
        let joined = stitching.joined_surfaces();
        let mut boxes = Boxes::of(arcs, joined.len());
        // No curve pierces what its surface is joined to.
        if joined.iter().any(|surfaces| surfaces.len() < joined.len()) {
            for curve in later {
                let kept = arcs.cover_later(&curve);
                arcs.later(&curve, &kept).iter().for_each(|arc| boxes.add(curve.surface, &arc));
            }
        }
        let splitter = Splitter::new(arcs, patches, joined, boxes, clusters, tolerance);
        Self { arcs, splitter, recent: Recent::default() }
    }

    /// Splits the curve with this index.
    pub fn split(&mut self, index: usize) -> SplitCurve {
        Self::split_one(&self.splitter, &mut self.recent, self.arcs.one(index))
    }

    /// Splits one of the later curves. In its pieces it has the index after those of all that are kept.
    pub fn split_later(&mut self, curve: &SurfaceCurve) -> SplitCurve {
        let kept = self.arcs.cover_later(curve);
        // Shorter than those that are kept live.
        let arcs: CurveArcs<'_> = self.arcs;
        Self::split_one(&self.splitter, &mut self.recent, arcs.later(curve, &kept))
    }

    fn split_one(splitter: &Splitter<'_>, recent: &mut Recent, curve: OneCurve<'_>) -> SplitCurve {
        let lengths = curve.length_table(splitter.tolerance().resolution);
        let (pieces, stats) = splitter.split(curve, &lengths, recent);
        SplitCurve { pieces, lengths, stats }
    }
}
