//! Curves split one after the other, so that only the pieces of one are in memory.

use alloc::vec::Vec;

use super::arcs::OneCurve;
use super::division::Recent;
use super::pierce::Boxes;
use super::splitter::Splitter;
use super::{Arcs, ArrangeStats, Clusters, CurveArcs, LengthTable, Piece, Tolerance};
use crate::extract::{Geometry, SurfaceCurve};
use crate::stitch::Stitching;
use crate::stop::Stop;
use crate::view::Patch;

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

    /// The pieces of the curve with this index, with counts.
    pub fn split(&mut self, index: usize) -> (Vec<Piece>, ArrangeStats) {
        Self::split_one(&self.splitter, &mut self.recent, self.arcs.one(index))
    }

    /// The pieces of one of the later curves, with counts. In them it has the index after those of all that are kept.
    pub fn split_later(&mut self, curve: &SurfaceCurve) -> (Vec<Piece>, ArrangeStats) {
        let kept = self.arcs.cover_later(curve);
        // Shorter than those that are kept live.
        let arcs: CurveArcs<'_> = self.arcs;
        Self::split_one(&self.splitter, &mut self.recent, arcs.later(curve, &kept))
    }

    fn split_one(splitter: &Splitter<'_>, recent: &mut Recent, curve: OneCurve<'_>) -> (Vec<Piece>, ArrangeStats) {
        let lengths = curve.length_table(splitter.tolerance().resolution);
        splitter.split(curve, &lengths, recent)
    }
}

/// Length along a curve, as [`arrange`](super::arrange) tells it: made again, of arcs within `fit` as [`Arcs::new`] makes them, which are not kept.
#[must_use]
pub fn lengths(curve: &SurfaceCurve, geometry: Geometry<'_>, fit: f64, resolution: f64) -> LengthTable {
    let none = Arcs::new(&[], &geometry, fit, true, Stop::NEVER);
    let arcs = none.with(&[], geometry);
    let kept = arcs.cover_later(curve);
    arcs.later(curve, &kept).length_table(resolution)
}
