//! Curves split, and what is seen of them.

use alloc::vec::Vec;

use super::{DrawOptions, Monitor, RAY_SPACING, RESOLUTION, Stage};
use crate::arrange::{ArrangeStats, Arrangement, Clusters, CurveArcs, Tolerance, arrange, clusters};
use crate::extract::chain::SilhouetteChains;
use crate::extract::facing::Facing;
use crate::extract::{Geometry, SurfaceCurve};
use crate::stitch::{STITCH, Stitching};
use crate::stop::{Stop, Stopped};
use crate::view::{Patch, ViewScene};
use crate::visibility::{ClassifyOptions, Cracks, Occluders, Outermost, Sighting, Subject, VisibilityStats, classify};

/// Below what lengths things are one.
pub(super) fn tolerance(view: &ViewScene) -> Tolerance {
    let size = view.size();
    Tolerance { resolution: RESOLUTION * size, contact: STITCH * size }
}

/// What splitting and visibility have to know.
#[derive(Clone, Copy)]
pub(super) struct Picture<'a> {
    pub(super) geometry: Geometry<'a>,
    pub(super) stitching: &'a Stitching,
    pub(super) curves: &'a [SurfaceCurve],
    /// The silhouettes among the curves.
    pub(super) chains: &'a SilhouetteChains,
    pub(super) options: &'a DrawOptions,
}

/// What visibility is decided of.
pub(super) struct Split {
    arrangement: Arrangement,
    outermost: Outermost,
}

/// Counts of splitting and of deciding visibility.
pub(super) type Counts = (ArrangeStats, VisibilityStats);

impl<'a> Picture<'a> {
    /// Splits, and finds all that visibility has to know of the arcs of the curves.
    pub(super) fn split(&self, arcs: CurveArcs<'_>, monitor: &dyn Monitor) -> Result<Split, Stopped> {
        let stops = || monitor.stops();
        let stop = Stop::when(&stops);
        monitor.begin(Stage::Arrange);
        let view = self.geometry.view;
        let tolerance = tolerance(view);
        let (patches, clusters) = (self.covering_patches(), self.clusters(stop));
        let arrangement = arrange(arcs, &patches, self.stitching, &clusters, tolerance, stop);
        stop.check()?;
        let outermost = Outermost::new(arcs, view.size(), &self.classifying());
        Ok(Split { arrangement, outermost })
    }

    /// The patches that curves may pierce. One that is seen edge-on hides nothing, so that it does not matter where a curve does.
    pub(super) fn covering_patches(&self) -> Vec<&'a Patch> {
        let patches = self.geometry.view.patches().iter().zip(self.geometry.forms);
        patches.filter(|(_, f)| f.facing != Facing::EdgeOn).map(|(p, _)| p).collect()
    }

    /// Which surfaces cannot hide one another, as far as that is wanted.
    pub(super) fn clusters(&self, stop: Stop<'_>) -> Clusters {
        if self.options.clusters {
            clusters(&self.geometry, self.stitching, tolerance(self.geometry.view), stop)
        } else {
            Clusters::none()
        }
    }

    /// What sight lines meet.
    pub(super) fn occluders(&self, stop: Stop<'_>) -> Occluders<'a> {
        let view = self.geometry.view;
        Occluders::trimmed(view.patches(), &|s| view.trims(s), self.options.cells, stop)
    }

    /// How visibility is decided.
    pub(super) fn classifying(&self) -> ClassifyOptions {
        let size = self.geometry.view.size();
        ClassifyOptions {
            method: self.options.visibility,
            spacing: RAY_SPACING * size,
            resolution: 1e-9 * size,
            count_hidden: self.options.deepest > 0,
        }
    }

    /// Decides the visibility of what is split, and hands it on with all that it was decided by. No arcs are needed for that.
    pub(super) fn seen<T>(
        &self,
        split: Split,
        monitor: &dyn Monitor,
        then: impl FnOnce(&Subject<'_>, Vec<Sighting>, Counts) -> T,
    ) -> Result<T, Stopped> {
        let stops = || monitor.stops();
        let stop = Stop::when(&stops);
        let Split { arrangement, outermost } = split;
        monitor.begin(Stage::Visibility);
        let view = self.geometry.view;
        let occluders = self.occluders(stop);
        stop.check()?;
        let cracks = Cracks::new(view, self.stitching, occluders.resolution());
        let subject = Subject {
            geometry: self.geometry,
            curves: self.curves,
            outermost: &outermost,
            chains: self.chains,
            arrangement: &arrangement,
            stitching: self.stitching,
            occluders: &occluders,
            cracks: &cracks,
            stop,
        };
        let (sightings, visibility) = classify(&subject, &self.classifying());
        stop.check()?;
        Ok(then(&subject, sightings, (arrangement.stats, visibility)))
    }
}
