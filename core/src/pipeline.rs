//! The stages in order: from a scene and a camera to strokes.

use alloc::vec::Vec;

use glam::DVec2;

use crate::arrange::region::{Region, RegionOptions, regions};
use crate::arrange::{Arcs, ArrangeStats, Tolerance, arrange};
use crate::extract::chain::{ChainOptions, ChainStats, SilhouetteChains, silhouette_chains};
use crate::extract::facing::{Facing, FacingForm, FacingStats, facing_of_all};
use crate::extract::silhouette::{SilhouetteOptions, SilhouetteStats, silhouettes};
use crate::extract::{CurveOptions, CurveSet, Geometry, SurfaceCurve, UndecidedPart, curves};
use crate::scene::Scene;
use crate::stitch::{StitchOptions, Stitching};
use crate::stroke::{Stroke, chain, flatten};
use crate::view::{Camera, Patch, ViewError, ViewScene};
use crate::visibility::{ClassifyOptions, Method, Occluders, Sighting, Subject, VisibilityStats, classify};

/// What is to be drawn. Lengths are derived from the scene's size where they are not given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawOptions {
    /// Kinds of curve wanted on paper.
    pub curves: CurveSet,
    /// Isocurves a direction and surface.
    pub isos: u32,
    /// Whether hidden parts are wanted, with their number of sheets in front.
    pub keep_hidden: bool,
    /// Where the visibility of the pieces comes from.
    pub visibility: Method,
    /// Largest angle between surfaces that join smoothly, radians.
    pub smooth_angle: f64,
}

impl Default for DrawOptions {
    /// All kinds but smooth joins, 8 isocurves, no hidden parts, joins smooth up to one degree.
    fn default() -> Self {
        Self {
            curves: CurveSet::default(),
            isos: 8,
            keep_hidden: false,
            visibility: Method::default(),
            smooth_angle: core::f64::consts::PI / 180.0,
        }
    }
}

/// Stages whose time is told apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Projection into view space.
    View,
    /// Coincident boundaries.
    Stitch,
    /// Curves of interest.
    Extract,
    /// Splitting.
    Arrange,
    /// Quantitative invisibility.
    Visibility,
    /// Flattening and chaining.
    Stroke,
}

/// What the stages counted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stats {
    /// Surfaces of the scene.
    pub surfaces: u64,
    /// Bézier patches.
    pub patches: u64,
    /// Which patches can have silhouettes.
    pub facing: FacingStats,
    /// Silhouettes, patch by patch.
    pub silhouette: SilhouetteStats,
    /// Silhouettes of the scene, chained over patches and surfaces.
    pub chains: ChainStats,
    /// Parts of surfaces where the silhouettes' topology is undecided.
    pub silhouette_undecided: Vec<UndecidedPart>,
    /// Splitting.
    pub arrange: ArrangeStats,
    /// Visibility.
    pub visibility: VisibilityStats,
}

/// Told when a stage begins.
pub type Observer<'a> = &'a mut dyn FnMut(Stage);

/// Coincidence and crossings on the screen are resolved to this fraction of the scene's size: three nanometres on a
/// sheet of 300 mm, and ten times the error to which traced curves are represented.
const RESOLUTION: f64 = 1e-8;

/// Boundaries nearer than this fraction of the size are one edge: models come out of other programs with seven digits.
const STITCH: f64 = 1e-6;

/// Traced curves are represented for splitting to this fraction of the size.
const FIT: f64 = 1e-9;

/// Silhouettes get vertices until their chords are within this fraction of the size; flattening refines further.
const TRACE_CHORD: f64 = 2e-4;

/// Largest turn of the normal between neighbouring vertices of a silhouette, radians.
const TRACE_ANGLE: f64 = 0.2;

/// Distance between rays along a piece, of the size.
const RAY_SPACING: f64 = 0.02;

/// A scene with its curves extracted; knows how large the picture is.
pub struct Prepared {
    view: ViewScene,
    stitching: Stitching,
    forms: Vec<FacingForm>,
    curves: Vec<SurfaceCurve>,
    chains: SilhouetteChains,
    arcs: Arcs,
    options: DrawOptions,
    stats: Stats,
}

impl Prepared {
    /// Projects, stitches and extracts.
    ///
    /// # Errors
    /// If the scene is empty or reaches the eye plane.
    pub fn new(scene: &Scene, camera: &Camera, options: &DrawOptions, begin: Observer<'_>) -> Result<Self, ViewError> {
        begin(Stage::View);
        let view = ViewScene::new(scene, camera)?;
        let size = view.size();
        begin(Stage::Stitch);
        let stitch = StitchOptions { distance: STITCH * size, angle: options.smooth_angle };
        let stitching = Stitching::new(&view, &stitch);
        begin(Stage::Extract);
        let (forms, facing) = facing_of_all(view.patches());
        let trace = SilhouetteOptions { chord: TRACE_CHORD * size, normal_angle: TRACE_ANGLE };
        let traced = silhouettes(view.patches(), &forms, trace);
        let g = Geometry { view: &view, forms: &forms };
        let gather = CurveOptions {
            wanted: options.curves,
            isos: options.isos,
            angle: options.smooth_angle,
            contact: STITCH * size,
        };
        let curves = curves(&g, &stitching, &traced, &gather);
        let chaining = ChainOptions { gap: STITCH * size, angle: options.smooth_angle };
        let chains = silhouette_chains(&g, &stitching, &curves, chaining);
        let arcs = Arcs::new(&curves, &g, FIT * size);
        let stats = Stats {
            surfaces: view.surfaces().len() as u64,
            patches: view.patches().len() as u64,
            facing,
            silhouette_undecided: traced.undecided.iter().map(|place| UndecidedPart::new(&view, place)).collect(),
            silhouette: traced.stats,
            chains: chains.stats,
            ..Stats::default()
        };
        Ok(Self { view, stitching, forms, curves, chains, arcs, options: *options, stats })
    }

    /// Lower left and upper right corner of the picture on the screen.
    #[must_use]
    pub fn extent(&self) -> [DVec2; 2] {
        self.arcs.extent()
    }

    /// What evaluates the curves.
    #[must_use]
    pub fn geometry(&self) -> Geometry<'_> {
        Geometry { view: &self.view, forms: &self.forms }
    }

    /// All curves, also those that are not wanted on paper but change the visibility of others.
    #[must_use]
    pub fn curves(&self) -> &[SurfaceCurve] {
        &self.curves
    }

    /// What was counted so far: patches, silhouettes and their chains.
    #[must_use]
    pub fn stats(&self) -> &Stats {
        &self.stats
    }

    /// The silhouettes among the [`curves`](Self::curves), chained over patches and surfaces.
    #[must_use]
    pub fn silhouette_chains(&self) -> &SilhouetteChains {
        &self.chains
    }

    /// The regions without silhouettes, in parts that do not overlap themselves on the screen.
    #[must_use]
    pub fn regions(&self) -> Vec<Region> {
        let size = self.view.size();
        regions(&self.geometry(), RegionOptions { resolution: RESOLUTION * size, contact: STITCH * size })
    }

    /// Splits and decides visibility: every inked curve in parts of one quantitative invisibility each, hidden ones too.
    /// The number of sheets before a hidden part is exact if hidden parts are to be kept, else at least one.
    #[must_use]
    pub fn sightings(&self, begin: Observer<'_>) -> (Vec<Sighting>, Stats) {
        let size = self.view.size();
        begin(Stage::Arrange);
        let tolerance = Tolerance { resolution: RESOLUTION * size, contact: STITCH * size };
        // A patch seen edge-on hides nothing, so that it does not matter where a curve pierces it.
        let covering = self.view.patches().iter().zip(&self.forms).filter(|(_, f)| f.facing != Facing::EdgeOn);
        let patches: Vec<&Patch> = covering.map(|(p, _)| p).collect();
        let arrangement = arrange(&self.curves, &self.arcs, &patches, &self.stitching, tolerance);
        begin(Stage::Visibility);
        let occluders = Occluders::new(self.view.patches());
        let options = ClassifyOptions {
            method: self.options.visibility,
            spacing: RAY_SPACING * size,
            resolution: 1e-9 * size,
            count_hidden: self.options.keep_hidden,
        };
        let subject = Subject {
            geometry: self.geometry(),
            curves: &self.curves,
            arcs: &self.arcs,
            chains: &self.chains,
            arrangement: &arrangement,
            stitching: &self.stitching,
            occluders: &occluders,
        };
        let (sightings, visibility) = classify(&subject, &options);
        (sightings, Stats { arrange: arrangement.stats, visibility, ..self.stats.clone() })
    }

    /// Splits, decides visibility, and flattens with chords within `tolerance` (screen units).
    #[must_use]
    pub fn trace(&self, tolerance: f64, begin: Observer<'_>) -> Traced {
        let (mut sightings, stats) = self.sightings(begin);
        begin(Stage::Stroke);
        if !self.options.keep_hidden {
            sightings.retain(|s| s.qi == 0);
        }
        let strokes = flatten(&self.geometry(), &self.curves, &sightings, tolerance);
        let gap = 2.0 * STITCH * self.view.size();
        Traced { strokes: chain(strokes, gap, gap), stats }
    }
}

/// A scene as strokes.
#[derive(Clone, Debug)]
pub struct Traced {
    /// Visible strokes, and hidden ones if they were asked for.
    pub strokes: Vec<Stroke>,
    /// Counts.
    pub stats: Stats,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nurbs::{KnotVector, Surface};
    use crate::scene::SceneSurface;
    use alloc::vec;
    use glam::{DVec3, DVec4};

    /// z = x² − y² over [−1, 1]² as one biquadratic patch.
    fn saddle() -> Scene {
        let knots = || KnotVector::bezier(2, [-1.0, 1.0]).unwrap();
        // Coefficients of t² and of t on [−1, 1] are 1, −1, 1 and −1, 0, 1.
        let (square, linear) = ([1.0, -1.0, 1.0], [-1.0, 0.0, 1.0]);
        let points = (0..9).map(|k| {
            let (i, j) = (k / 3, k % 3);
            DVec4::new(linear[i], linear[j], square[i] - square[j], 1.0)
        });
        let surface = Surface::new(knots(), knots(), points.collect()).unwrap();
        Scene { name: "saddle".into(), surfaces: vec![SceneSurface { name: "saddle".into(), surface }] }
    }

    fn traced(scene: &Scene, eye: DVec3, options: &DrawOptions) -> Traced {
        let camera = Camera::orthographic(eye, DVec3::Z).unwrap();
        let prepared = Prepared::new(scene, &camera, options, &mut |_| {}).unwrap();
        prepared.trace(1e-3, &mut |_| {})
    }

    #[test]
    fn a_silhouette_along_the_sight_line_costs_no_more_than_another() {
        // Seen from (1, −1, 1) the silhouette x + y = ½ is a straight line that projects to one point.
        let t = traced(&saddle(), DVec3::new(1.0, -1.0, 1.0), &DrawOptions::default());
        assert_eq!(t.stats.arrange.undecided, 0);
        assert!(t.stats.arrange.pairs_near < 2_000, "{:?}", t.stats.arrange);
        assert!(t.strokes.iter().all(|s| s.kind != crate::stroke::CurveKind::Silhouette));
    }

    #[test]
    fn stages_follow_one_another() {
        let mut seen = Vec::new();
        let camera = Camera::orthographic(DVec3::X, DVec3::Z).unwrap();
        let prepared = Prepared::new(&saddle(), &camera, &DrawOptions::default(), &mut |s| seen.push(s)).unwrap();
        let _strokes = prepared.trace(1e-3, &mut |s| seen.push(s));
        let order = [Stage::View, Stage::Stitch, Stage::Extract, Stage::Arrange, Stage::Visibility, Stage::Stroke];
        assert_eq!(seen, order);
    }

    #[test]
    fn the_eye_inside_a_model_is_refused_by_name() {
        let camera = Camera::perspective(DVec3::new(0.0, 0.0, 0.1), DVec3::X, DVec3::Z).unwrap();
        let got = Prepared::new(&saddle(), &camera, &DrawOptions::default(), &mut |_| {});
        assert!(matches!(got, Err(ViewError::BehindEye { index: 0, .. })));
    }
}
