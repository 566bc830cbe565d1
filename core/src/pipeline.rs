//! The stages in order: from a scene and a camera to strokes.

use alloc::vec::Vec;

use glam::{DVec2, DVec3};

mod isocurves;
mod picture;
mod sparing;

pub use isocurves::IsoSet;
pub use sparing::trace_each;

use crate::arrange::region::{Region, regions};
use crate::arrange::{Arcs, ArrangeStats, CurveArcs};
use crate::extract::adaptive::{AdaptiveOptions, AdaptiveStats, adaptive_curves, cover};
use crate::extract::chain::{ChainOptions, ChainStats, SilhouetteChains, silhouette_chains};
use crate::extract::facing::{FacingForm, FacingStats, facing_of_all};
use crate::extract::section::{section_curves, sections};
use crate::extract::silhouette::{SilhouetteOptions, SilhouetteStats, Silhouettes, silhouettes};
use crate::extract::{
    CurveKind, CurveOptions, CurveSet, Geometry, Style, Styles, SurfaceCurve, UndecidedPart, all_but_isos,
    curves as gathered, cut_to_trims,
};
use crate::probe::Probe;
use crate::render::{self, PixelGrid, Raster};
use crate::scene::Scene;
use crate::stitch::{SMOOTH_ANGLE, STITCH, StitchOptions, Stitching};
use crate::stop::{Stop, Stopped};
use crate::stroke::{Stroke, chain, flatten};
use crate::view::{Camera, ViewError, ViewScene};
use crate::visibility::{ClassifyOptions, Method, Sighting, Subject, VisibilityStats, halo};
use crate::visible::{BorderOptions, Straight, VisibleRegions, visible_regions};
use picture::{Counts, Picture, tolerance};

/// What is to be drawn. Lengths are derived from the scene's size where they are not given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawOptions {
    /// Kinds of curve wanted on paper.
    pub curves: CurveSet,
    /// Isocurves a direction and surface, equally far apart in the parameter; adaptive ones are added by
    /// [`Prepared::cover`].
    pub isos: u32,
    /// Most sheets that a wanted part may have in front of it: 0 for what is visible alone, `u32::MAX` for everything.
    pub deepest: u32,
    /// Where the visibility of the pieces comes from.
    pub visibility: Method,
    /// Whether connected surfaces that cannot hide one another are left out of each other's arrangement. It changes no
    /// picture.
    pub clusters: bool,
    /// Largest angle between surfaces that join smoothly, radians.
    pub smooth_angle: f64,
    /// Cells that patches are cut into ahead of the sight lines, at the most; where there are more patches, one each. Half a
    /// kilobyte a cell: few spare memory and cost time, for each sight line then cuts its own. It changes no picture.
    pub cells: usize,
}

impl Default for DrawOptions {
    /// All kinds but smooth joins, 8 isocurves, no hidden parts, joins smooth up to one degree, as many cells as spare time.
    fn default() -> Self {
        Self {
            curves: CurveSet::default(),
            isos: 8,
            deepest: 0,
            visibility: Method::default(),
            clusters: true,
            smooth_angle: SMOOTH_ANGLE,
            cells: usize::MAX,
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
    /// Painting and shading, which take the place of the last three.
    Render,
}

/// What the stages counted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stats {
    /// Surfaces of the scene.
    pub surfaces: u64,
    /// Bézier patches.
    pub patches: u64,
    /// Trim loops of all surfaces.
    pub trims: u64,
    /// Which patches can have silhouettes.
    pub facing: FacingStats,
    /// Silhouettes, patch by patch.
    pub silhouette: SilhouetteStats,
    /// Silhouettes of the scene, chained over patches and surfaces.
    pub chains: ChainStats,
    /// Parts of surfaces where the silhouettes' topology is undecided.
    pub silhouette_undecided: Vec<UndecidedPart>,
    /// Parts of surfaces where it is undecided how another one intersects them.
    pub section_undecided: Vec<UndecidedPart>,
    /// Adaptive isocurves.
    pub adaptive: AdaptiveStats,
    /// Splitting.
    pub arrange: ArrangeStats,
    /// Visibility.
    pub visibility: VisibilityStats,
}

/// Watches over a computation. `()` looks away.
pub trait Monitor: Sync {
    /// Told when a stage begins.
    fn begin(&self, stage: Stage) {
        let _ = stage;
    }

    /// Whether to stop. Asked often, from any thread; once it has said so, it has to go on saying so.
    fn stops(&self) -> bool {
        false
    }
}

impl Monitor for () {}

/// Why there is no picture.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PictureError {
    /// The camera does not see the scene.
    #[error(transparent)]
    View(#[from] ViewError),
    /// The monitor stopped it.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// A scene that is asked for twice was not the same the second time.
    #[error("the scene changed while it was drawn; draw it again from the beginning")]
    Changed,
}

/// Coincidence and crossings on the screen are resolved to this fraction of the scene's size: three nanometres on a
/// sheet of 300 mm, and ten times the error to which traced curves are represented.
const RESOLUTION: f64 = 1e-8;

/// Traced curves are represented for splitting to this fraction of the size.
const FIT: f64 = 1e-9;

/// Silhouettes get vertices until their chords are within this fraction of the size; flattening refines further.
const TRACE_CHORD: f64 = 2e-4;

/// Largest turn of the normal between neighbouring vertices of a silhouette, radians.
const TRACE_ANGLE: f64 = 0.2;

/// Distance between rays along a piece, of the size.
const RAY_SPACING: f64 = 0.02;

/// What of a scene's curves is kept. It changes no picture.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kept {
    /// The curves, and the arcs that they are intersected by.
    All,
    /// The curves. Each arc is made again whenever it is asked for: its memory for its time.
    Curves,
    /// The curves but for the isocurves, which are made one at a time.
    NoIsos,
}

/// A scene with its curves extracted; knows how large the picture is.
pub struct Prepared {
    view: ViewScene,
    stitching: Stitching,
    forms: Vec<FacingForm>,
    curves: Vec<SurfaceCurve>,
    /// How many of the curves come before the sections.
    before_sections: usize,
    chains: SilhouetteChains,
    arcs: Arcs,
    styles: Styles,
    options: DrawOptions,
    /// Gap beside outlines, screen units.
    halo: f64,
    stats: Stats,
}

impl Prepared {
    /// Projects, stitches and extracts.
    ///
    /// # Errors
    /// If the scene is empty or reaches the eye plane, or the monitor stops it.
    pub fn new(
        scene: &Scene,
        camera: &Camera,
        options: &DrawOptions,
        monitor: &dyn Monitor,
    ) -> Result<Self, PictureError> {
        let styles = Styles::uniform(Style { curves: options.curves, isos: options.isos });
        Self::styled(scene, camera, options, styles, monitor)
    }

    /// As [`new`](Self::new), with a style for each surface in place of the curves and isocurves of the options.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn styled(
        scene: &Scene,
        camera: &Camera,
        options: &DrawOptions,
        styles: Styles,
        monitor: &dyn Monitor,
    ) -> Result<Self, PictureError> {
        monitor.begin(Stage::View);
        let view = ViewScene::new(scene, camera)?;
        Ok(Self::seen_as(view, options, styles, Kept::All, monitor)?)
    }

    /// As [`styled`](Self::styled), from the scene as it is seen.
    fn seen_as(
        view: ViewScene,
        options: &DrawOptions,
        styles: Styles,
        kept: Kept,
        monitor: &dyn Monitor,
    ) -> Result<Self, Stopped> {
        let stops = || monitor.stops();
        let stop = Stop::when(&stops);
        let size = view.size();
        monitor.begin(Stage::Stitch);
        let stitch = StitchOptions { angle: options.smooth_angle, ..StitchOptions::of(&view) };
        let stitching = Stitching::new(&view, &stitch, stop);
        stop.check()?;
        monitor.begin(Stage::Extract);
        let (forms, facing) = facing_of_all(view.patches(), stop);
        stop.check()?;
        let trace = SilhouetteOptions { chord: TRACE_CHORD * size, normal_angle: TRACE_ANGLE };
        let traced = silhouettes(view.patches(), &forms, trace, stop);
        stop.check()?;
        let g = Geometry { view: &view, forms: &forms };
        let gather = CurveOptions { styles: &styles, angle: options.smooth_angle, contact: STITCH * size };
        let all = match kept {
            Kept::All | Kept::Curves => gathered(&g, &stitching, &traced, &gather, stop),
            Kept::NoIsos => all_but_isos(&g, &stitching, &traced, &gather, stop),
        };
        let (mut curves, cut) = cut_to_trims(&g, all);
        stop.check()?;
        let before_sections = curves.len();
        let (mut undecided_silhouettes, silhouette) = (traced.undecided, traced.stats);
        drop(traced.curves);
        undecided_silhouettes.extend(cut);
        let mut undecided_sections = Vec::new();
        if styles.wants(CurveKind::Section) {
            let found = sections(&view, &stitching, STITCH * size, stop);
            stop.check()?;
            let (sections, cut) = cut_to_trims(&g, section_curves(&g, &found, &styles));
            curves.extend(sections);
            undecided_sections = found.undecided;
            undecided_sections.extend(cut);
        }
        let chaining = ChainOptions { gap: STITCH * size, angle: options.smooth_angle };
        let chains = silhouette_chains(&g, &stitching, &curves, chaining);
        let arcs = Arcs::new(&curves, &g, FIT * size, kept == Kept::All, stop);
        stop.check()?;
        let stats = Stats {
            surfaces: view.surfaces().len() as u64,
            patches: view.patches().len() as u64,
            trims: (0..view.surfaces().len()).filter_map(|s| view.trims(s)).map(|t| t.loops().len() as u64).sum(),
            facing,
            silhouette_undecided: undecided_silhouettes.iter().map(|place| UndecidedPart::new(&view, place)).collect(),
            section_undecided: undecided_sections.iter().map(|place| UndecidedPart::new(&view, place)).collect(),
            silhouette,
            chains: chains.stats,
            ..Stats::default()
        };
        let options = *options;
        Ok(Self { view, stitching, forms, curves, before_sections, chains, arcs, styles, options, halo: 0.0, stats })
    }

    /// Adds adaptive isocurves to the surfaces whose styles have isocurves, but for facets of meshes. They lie inside the picture as it is, so that their spacing can be chosen by its
    /// [`extent`](Self::extent).
    ///
    /// # Errors
    /// If the monitor stops it.
    pub fn cover(&mut self, options: &AdaptiveOptions, monitor: &dyn Monitor) -> Result<(), Stopped> {
        let stops = || monitor.stops();
        let stop = Stop::when(&stops);
        monitor.begin(Stage::Extract);
        let g = Geometry { view: &self.view, forms: &self.forms };
        let wanted = |s: usize| self.styles.of(s).curves.iso && self.view.facet(s).is_none();
        let found = cover(&g, &self.stitching, &wanted, &self.styles, options, stop);
        stop.check()?;
        let curves = adaptive_curves(&g, &found);
        self.arcs.extend(&curves, &g, stop);
        stop.check()?;
        self.curves.extend(curves);
        self.stats.adaptive = found.stats;
        Ok(())
    }

    /// Leaves gaps of this width (screen units) where curves pass behind outlines that are drawn; 0 for none. See [`halo`].
    pub fn leave_gaps(&mut self, gap: f64) {
        self.halo = gap;
    }

    /// Lower left and upper right corner of the picture on the screen.
    #[must_use]
    pub fn extent(&self) -> [DVec2; 2] {
        self.curve_arcs().extent()
    }

    fn curve_arcs(&self) -> CurveArcs<'_> {
        self.arcs.with(&self.curves, self.geometry())
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
        regions(&self.geometry(), tolerance(&self.view))
    }

    /// Splits and decides visibility: every inked curve in parts of one quantitative invisibility each, hidden ones too.
    /// The number of sheets before a hidden part is exact if hidden parts are wanted, else at least one.
    ///
    /// # Errors
    /// If the monitor stops it.
    pub fn sightings(&self, monitor: &dyn Monitor) -> Result<(Vec<Sighting>, Stats), Stopped> {
        let picture = self.picture();
        let split = picture.split(self.curve_arcs(), monitor)?;
        // Not a part of seeing: boards have no room for what they do not draw.
        let seen = picture.seen(split, monitor, |subject, sightings, counts| {
            let deepest = self.options.deepest;
            let left = if self.halo > 0.0 { halo(subject, sightings, self.halo, deepest) } else { sightings };
            (left, self.with(counts))
        })?;
        if monitor.stops() { Err(Stopped) } else { Ok(seen) }
    }

    /// All counts, with those of splitting and of visibility.
    fn with(&self, (arrange, visibility): Counts) -> Stats {
        Stats { arrange, visibility, ..self.stats.clone() }
    }

    /// What splitting and visibility have to know.
    fn picture(&self) -> Picture<'_> {
        Picture {
            geometry: self.geometry(),
            stitching: &self.stitching,
            curves: &self.curves,
            chains: &self.chains,
            options: &self.options,
        }
    }

    /// The visible part of every surface, bordered by loops with chords within `tolerance` (screen units) and with no more than
    /// `normal_angle` (radians) between the normals of the surface at neighbouring points. Which curves are wanted on paper, and
    /// which hidden parts, makes no difference. Nothing of a surface without area on the screen is visible.
    ///
    /// Cost: that of [`sightings`](Self::sightings) for all curves but isocurves, eight sight lines an edge, and one a point of
    /// borders that go on behind another surface.
    ///
    /// # Errors
    /// If the monitor stops it.
    pub fn visible_regions(
        &self,
        tolerance: f64,
        normal_angle: f64,
        monitor: &dyn Monitor,
    ) -> Result<VisibleRegions, Stopped> {
        self.bordered(tolerance, normal_angle, None, monitor)
    }

    /// As [`visible_regions`](Self::visible_regions), with borders so fine that on the screen of `camera`, whatever camera this is, chords between neighbouring points,
    /// straight ones and those in the parameters, pass within `tolerance` of the border half-way. So the loops can be taken for
    /// polygons in the parameters.
    ///
    /// Cost: that of [`visible_regions`](Self::visible_regions), and twice as many sight lines for borders that go on behind another surface.
    ///
    /// # Errors
    /// If the monitor stops it.
    pub fn regions_in_parameters(
        &self,
        tolerance: f64,
        normal_angle: f64,
        camera: &Camera,
        monitor: &dyn Monitor,
    ) -> Result<VisibleRegions, Stopped> {
        self.bordered(tolerance, normal_angle, Some(Straight { camera, tolerance }), monitor)
    }

    fn bordered(
        &self,
        tolerance: f64,
        normal_angle: f64,
        straight: Option<Straight<'_>>,
        monitor: &dyn Monitor,
    ) -> Result<VisibleRegions, Stopped> {
        let stops = || monitor.stops();
        let stop = Stop::when(&stops);
        monitor.begin(Stage::Extract);
        let size = self.view.size();
        let curves = self.bordering(stop);
        stop.check()?;
        let border = BorderOptions { tolerance, normal_angle, contact: 2.0 * STITCH * size, straight };
        let found = self.seen_instead(&curves, monitor, |subject, sightings, asking| {
            monitor.begin(Stage::Stroke);
            visible_regions(subject, &sightings, asking, border)
        })?;
        stop.check()?;
        Ok(found)
    }

    /// Splits other curves than those of the drawing, among them all that hide anything, decides what is visible of them, and hands it on with
    /// how that was asked for.
    fn seen_instead<T>(
        &self,
        curves: &[SurfaceCurve],
        monitor: &dyn Monitor,
        then: impl FnOnce(&Subject<'_>, Vec<Sighting>, &ClassifyOptions) -> T,
    ) -> Result<T, Stopped> {
        let stops = || monitor.stops();
        let stop = Stop::when(&stops);
        let (g, size) = (self.geometry(), self.view.size());
        let chaining = ChainOptions { gap: STITCH * size, angle: self.options.smooth_angle };
        let chains = silhouette_chains(&g, &self.stitching, curves, chaining);
        let arcs = Arcs::new(curves, &g, FIT * size, true, stop);
        stop.check()?;
        let options = DrawOptions { deepest: 0, ..self.options };
        let picture = Picture { geometry: g, curves, chains: &chains, options: &options, ..self.picture() };
        let split = picture.split(arcs.with(curves, g), monitor)?;
        picture.seen(split, monitor, |subject, sightings, _| then(subject, sightings, &picture.classifying()))
    }

    /// All curves that can border a visible region, inked: those that there are whatever is wanted, smooth joins, and sections.
    fn bordering(&self, stop: Stop<'_>) -> Vec<SurfaceCurve> {
        let (g, contact) = (self.geometry(), STITCH * self.view.size());
        let mut curves: Vec<SurfaceCurve> = self.curves.iter().filter(|c| c.active).cloned().collect();
        let joins = CurveSet { smooth: true, ..CurveSet::NONE };
        let styles = Styles::uniform(Style { curves: CurveSet { section: true, ..joins }, isos: 0 });
        let gather = CurveOptions { styles: &styles, angle: self.options.smooth_angle, contact };
        let all = gathered(&g, &self.stitching, &Silhouettes::default(), &gather, stop);
        curves.extend(all.into_iter().filter(|c| c.kind == CurveKind::Smooth));
        let found = sections(&self.view, &self.stitching, contact, stop);
        curves.extend(cut_to_trims(&g, section_curves(&g, &found, &styles)).0);
        for curve in &mut curves {
            curve.inked = true;
        }
        curves
    }

    /// Splits, decides visibility, and flattens with chords within `tolerance` (screen units).
    ///
    /// # Errors
    /// If the monitor stops it.
    pub fn trace(&self, tolerance: f64, monitor: &dyn Monitor) -> Result<Traced, Stopped> {
        let (mut sightings, stats) = self.sightings(monitor)?;
        monitor.begin(Stage::Stroke);
        let stops = || monitor.stops();
        let stop = Stop::when(&stops);
        sightings.retain(|s| s.qi <= self.options.deepest);
        let strokes = flatten(&self.geometry(), &self.curves, &sightings, tolerance, stop);
        stop.check()?;
        let gap = 2.0 * STITCH * self.view.size();
        let strokes = chain(strokes, gap, gap);
        stop.check()?;
        Ok(Traced { strokes, stats })
    }

    /// What finds the places on surfaces that lie behind points of the screen.
    ///
    /// # Errors
    /// If the monitor stops it.
    pub fn probe(&self, monitor: &dyn Monitor) -> Result<Probe<'_>, Stopped> {
        let stops = || monitor.stops();
        let stop = Stop::when(&stops);
        let occluders = self.picture().occluders(stop);
        stop.check()?;
        Ok(Probe::new(self.geometry(), occluders))
    }

    /// Paints the surfaces into the pixels of `grid`, which may be as fine as 10⁻⁶ of the scene's size.
    ///
    /// # Errors
    /// If the monitor stops it.
    pub fn render(&self, grid: &PixelGrid, monitor: &dyn Monitor) -> Result<Raster, Stopped> {
        let stops = || monitor.stops();
        let stop = Stop::when(&stops);
        monitor.begin(Stage::Render);
        let raster = render::render(&self.geometry(), &self.stitching, grid, stop);
        stop.check()?;
        Ok(raster)
    }

    /// The brightness of what [`render`](Self::render) painted, pixel by pixel, from [`render::AMBIENT`] to 1 after Lambert's
    /// law; `None` where there is nothing. `light` is the direction to the light in the viewer's frame: right, up, towards
    /// the eye; any length but 0.
    ///
    /// # Errors
    /// If the monitor stops it.
    pub fn shade(&self, raster: &Raster, light: DVec3, monitor: &dyn Monitor) -> Result<Vec<Option<f64>>, Stopped> {
        let stops = || monitor.stops();
        let stop = Stop::when(&stops);
        let shades = render::shade(raster, &self.view, light, stop);
        stop.check()?;
        Ok(shades)
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
    extern crate std;

    use super::*;
    use crate::nurbs::{KnotVector, Surface};
    use crate::scene::SceneSurface;
    use alloc::vec;
    use glam::DVec4;

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
        Scene { name: "saddle".into(), surfaces: vec![SceneSurface::new("saddle", surface)] }
    }

    fn traced(scene: &Scene, eye: DVec3, options: &DrawOptions) -> Traced {
        let camera = Camera::orthographic(eye, DVec3::Z).unwrap();
        let prepared = Prepared::new(scene, &camera, options, &()).unwrap();
        prepared.trace(1e-3, &()).unwrap()
    }

    #[test]
    fn a_silhouette_along_the_sight_line_costs_no_more_than_another() {
        // Seen from (1, −1, 1) the silhouette x + y = ½ is a straight line that projects to one point.
        let t = traced(&saddle(), DVec3::new(1.0, -1.0, 1.0), &DrawOptions::default());
        assert_eq!(t.stats.arrange.undecided, 0);
        assert!(t.stats.arrange.pairs_near < 2_000, "{:?}", t.stats.arrange);
        assert!(t.strokes.iter().all(|s| s.kind != crate::stroke::CurveKind::Silhouette));
    }

    /// Remembers stages.
    #[derive(Default)]
    struct Recorder(std::sync::Mutex<Vec<Stage>>);

    impl Monitor for Recorder {
        fn begin(&self, stage: Stage) {
            self.0.lock().unwrap().push(stage);
        }
    }

    /// Stops when it has been asked so often.
    struct Patience(std::sync::atomic::AtomicI64);

    impl Monitor for Patience {
        fn stops(&self) -> bool {
            self.0.fetch_sub(1, std::sync::atomic::Ordering::Relaxed) <= 0
        }
    }

    #[test]
    fn a_monitor_stops_everywhere() {
        let camera = Camera::orthographic(DVec3::new(0.3, -0.8, 0.4), DVec3::Z).unwrap();
        let run = |patience: i64| {
            let monitor = Patience(patience.into());
            let prepared = match Prepared::new(&saddle(), &camera, &DrawOptions::default(), &monitor) {
                Ok(prepared) => prepared,
                Err(error) => {
                    assert_eq!(error, PictureError::Stopped(Stopped));
                    return true;
                }
            };
            prepared.trace(1e-3, &monitor).is_err()
        };
        assert!((0..40).all(run));
        assert!(!run(1_000_000));
    }

    #[test]
    fn stages_follow_one_another() {
        let seen = Recorder::default();
        let camera = Camera::orthographic(DVec3::X, DVec3::Z).unwrap();
        let prepared = Prepared::new(&saddle(), &camera, &DrawOptions::default(), &seen).unwrap();
        let _strokes = prepared.trace(1e-3, &seen).unwrap();
        let order = [Stage::View, Stage::Stitch, Stage::Extract, Stage::Arrange, Stage::Visibility, Stage::Stroke];
        assert_eq!(*seen.0.lock().unwrap(), order);
    }

    #[test]
    fn the_eye_inside_a_model_is_refused_by_name() {
        let camera = Camera::perspective(DVec3::new(0.0, 0.0, 0.1), DVec3::X, DVec3::Z).unwrap();
        let got = Prepared::new(&saddle(), &camera, &DrawOptions::default(), &());
        assert!(matches!(got, Err(PictureError::View(ViewError::BehindEye { index: 0, .. }))));
    }
}
