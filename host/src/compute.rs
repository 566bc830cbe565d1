//! From options to a drawing: reads the models, runs the core, lays the strokes out.

mod doubts;
mod filled;

use std::f64::consts::PI;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use penvis_core::pipeline::{self, Monitor, PictureError, Prepared, Stage};
use penvis_core::scene::Scene;

use crate::drawing::{Drawing, Page};
use crate::error::Error;
use crate::interrupt;
use crate::model::{self, Model, ModelError, ModelFile, Reading, View};
use crate::options::DrawingOptions;
use crate::page::{self, Layout, PathChoice, Shares, Window};
use crate::progress::Progress;
use crate::regions::{NORMAL_ANGLE, Shapes};
use crate::settle::Settled;
use crate::shadow::{self, ShadowError, ShadowShapes};
use crate::stats::Seconds;

/// A drawing with what is known about its making.
#[derive(Clone, Debug)]
pub struct Computed {
    /// The drawing.
    pub drawing: Drawing,
    /// The view it was drawn with.
    pub view: View,
    /// Counts of the core.
    pub stats: pipeline::Stats,
    /// Times of all stages but `emit` and `total`.
    pub seconds: Seconds,
    /// What is not drawn that was to be, each a line.
    pub notes: Vec<String>,
    /// What is visible of every surface, if that was asked for.
    pub regions: Option<Shapes>,
    /// What is visible and in shadow, if that was asked for.
    pub shadows: Option<ShadowShapes>,
}

/// A model that has been read, and what is settled about its drawing.
pub struct Loaded<'a> {
    options: &'a DrawingOptions,
    progress: &'a Progress,
    started: Instant,
    /// Time that reading took in s.
    read: f64,
    model: Model,
    settled: Settled,
    /// What the plotters reach of the page.
    reach: Option<Window>,
    /// What is asked of the path of the pen.
    path: PathChoice,
    /// Whether arcs are to be fitted to what is drawn.
    curved: bool,
    /// Whether the visible regions are asked for.
    regions: bool,
}

impl Loaded<'_> {
    /// With a part of the page that the plotters reach, to which a picture that is cut off at the margins is cut too.
    #[must_use]
    pub fn reaching(self, reach: Option<Window>) -> Self {
        Self { reach, ..self }
    }

    /// With a path of the pen of which this is asked; else it is one of little travel.
    #[must_use]
    pub fn along(self, path: PathChoice) -> Self {
        Self { path, ..self }
    }

    /// Drawn so finely that arcs can be fitted to it.
    #[must_use]
    pub fn curved(self, curved: bool) -> Self {
        Self { curved, ..self }
    }

    /// With the visible regions of all surfaces.
    #[must_use]
    pub fn with_regions(self, regions: bool) -> Self {
        Self { regions, ..self }
    }

    /// The sheet.
    #[must_use]
    pub fn page(&self) -> Page {
        self.settled.page
    }

    /// Whether hidden curves are told apart.
    pub(crate) fn depths(&self) -> page::Depths {
        self.options.depths
    }

    /// Whether shadows are darkened.
    pub(crate) fn has_shadows(&self) -> bool {
        self.options.shadows
    }

    /// Whether curves leave gaps beside outlines.
    pub(crate) fn has_gaps(&self) -> bool {
        self.options.halo_mm > 0.0
    }

    /// The files that the model comes from.
    #[must_use]
    pub fn files(&self) -> &[ModelFile] {
        &self.model.files
    }
}

/// A model on its page, with the curves of interest found and nothing decided yet.
pub(crate) struct Placed<'a> {
    pub(crate) scene: Scene,
    pub(crate) view: View,
    pub(crate) wanted: pipeline::DrawOptions,
    pub(crate) prepared: Prepared,
    pub(crate) layout: Layout,
    pub(crate) settled: Settled,
    pub(crate) watch: Watch<'a>,
}

/// Reads the models.
///
/// # Errors
/// If one cannot be read, there is no such sheet, its margins leave nothing of it, or Ctrl-C or the time limit ends it.
pub fn load<'a>(options: &'a DrawingOptions, progress: &'a Progress) -> Result<Loaded<'a>, Error> {
    let started = Instant::now();
    let model = read(&options.models, options.crease_angle, options.time_limit, progress)?;
    let settled = Settled::new(options, &model)?;
    let read = started.elapsed().as_secs_f64();
    Ok(Loaded {
        options,
        progress,
        started,
        read,
        model,
        settled,
        reach: None,
        path: PathChoice::default(),
        curved: false,
        regions: false,
    })
}

/// Reads models, with this crease angle in radians if one is asked for.
///
/// # Errors
/// If one cannot be read, or Ctrl-C or the time limit ends it.
pub(crate) fn read(
    models: &[String],
    crease_angle: Option<f64>,
    limit: Option<Duration>,
    progress: &Progress,
) -> Result<Model, Error> {
    interrupt::watch();
    progress.stage("reading");
    let watch = ReadWatch { progress, started: Instant::now(), limit };
    let reading = match crease_angle {
        Some(angle) => Reading::new(&watch).with_crease_angle(angle),
        None => Reading::new(&watch),
    };
    model::load(models, &reading).map_err(|e| watch.reason(e))
}

/// Finds what the picture's extent depends on, so that everything made of it lies on the page in the same place.
pub(crate) fn place(loaded: Loaded<'_>) -> Result<Placed<'_>, Error> {
    let Loaded { options, progress, started, read, model, settled, reach, .. } = loaded;
    let view = options.view.or(model.aim).resolve(model.view, &model.scene);
    let camera = view.camera()?;
    let wanted = pipeline::DrawOptions {
        deepest: settled.deepest,
        visibility: options.visibility,
        ..pipeline::DrawOptions::default()
    };
    let watch = Watch::new(progress, started, options.time_limit, read);
    let prepared = Prepared::styled(&model.scene, &camera, &wanted, settled.styles.clone(), &watch)
        .map_err(|e| watch.reason(e))?;
    let layout = Layout::new(prepared.extent(), settled.page, settled.margin_mm, settled.placing)?;
    let layout = reach.map_or(Ok(layout), |reach| layout.within(reach))?;
    Ok(Placed { scene: model.scene, view, wanted, prepared, layout, settled, watch })
}

/// Computes the drawing.
///
/// The core is run in two steps, because the chord error and the spacing of isocurves on the screen follow from the scale,
/// and the scale from the extent of the picture.
///
/// # Errors
/// If the view does not exist or does not see all of the model, the picture cannot be scaled, or Ctrl-C or the time limit
/// ends it.
pub fn compute(loaded: Loaded<'_>) -> Result<Computed, Error> {
    let (options, progress, path, curved) = (loaded.options, loaded.progress, loaded.path, loaded.curved);
    let with_regions = loaded.regions;
    let Placed { scene, view, wanted, mut prepared, layout, settled, watch } = place(loaded)?;
    if let Some(adaptive) = &settled.adaptive {
        prepared.cover(&adaptive.on_screen(&layout), &watch).map_err(|e| watch.reason(e.into()))?;
    }
    prepared.leave_gaps(layout.to_screen_length(options.halo_mm));
    let shares = Shares::of(settled.tolerance_mm, curved);
    let tolerance = layout.to_screen_length(shares.traced_mm);
    let traced = prepared.trace(tolerance, &watch).map_err(|e| watch.reason(e.into()))?;
    let levels = settled.adaptive.map_or(1, |adaptive| adaptive.levels);
    let mut polylines = page::lay_out(&traced.strokes, &layout, &settled.inks, options.depths, levels);
    let is_filled = settled.fills.iter().any(Option::is_some);
    if options.shadows && !with_regions && !is_filled {
        return Err(Error::Shadows);
    }
    let (mut regions, mut shadows) = (None, None);
    let mut notes = filled::notes(&prepared, &settled);
    if with_regions || is_filled {
        // Fills ask nothing of the normals of borders.
        let normal_angle = if with_regions { NORMAL_ANGLE } else { PI };
        let found = if options.shadows {
            shadow::visible(&prepared, tolerance, normal_angle, &watch)
        } else {
            prepared.visible_regions(tolerance, normal_angle, &watch)
        };
        let found = found.map_err(|e| watch.reason(e.into()))?;
        if options.shadows {
            let cast = shadow::shadows(&scene, &prepared, &found, options.light, tolerance, &wanted, &watch);
            let cast = cast.map_err(|e| match e {
                ShadowError::Picture(e) => watch.reason(e),
                ShadowError::Light(e) => e.into(),
            })?;
            let shapes = ShadowShapes::new(&cast, &scene, &layout);
            notes.extend(doubts::of_shadows(&shapes));
            shadows = Some(shapes);
        }
        if is_filled {
            let dark = shadows.as_ref().map(ShadowShapes::areas);
            let (prepared, regions, shadows, layout) = (&prepared, &found, dark.as_deref(), &layout);
            let filled = filled::Filled { prepared, regions, shadows, settled: &settled, layout, tolerance };
            polylines.extend(filled::fills(&filled, &polylines, &watch)?);
            notes.extend(doubts::of_fills(regions, &settled, layout));
        }
        regions = with_regions.then(|| Shapes::new(&found, &scene, &layout, settled.page));
    }
    let mut seconds = watch.finish();

    progress.stage("ordering");
    let started = Instant::now();
    polylines.extend(settled.marking.strokes(&polylines, settled.page, settled.edge_mm)?);
    let mut path = path.settle(&polylines, &settled.pens, &shares);
    path.joining.hidden = !settled.inks.have_dashes();
    path.hatched_mm = settled.adaptive.map(|_| options.pen_width_mm);
    let polylines = path.through(polylines, &interrupt::is_wanted);
    if interrupt::is_wanted() {
        return Err(Error::Interrupted { doing: "ordering strokes".into() });
    }
    seconds.page = started.elapsed().as_secs_f64();
    let drawing = Drawing {
        name: scene.name,
        page: settled.page,
        isos: settled.isos,
        pens: settled.pens,
        slack_mm: shares.slack_mm,
        polylines,
    };
    Ok(Computed { drawing, view, stats: traced.stats, seconds, notes, regions, shadows })
}

/// Shows how much is read, and stops reading at Ctrl-C or when the time is over.
struct ReadWatch<'a> {
    progress: &'a Progress,
    started: Instant,
    limit: Option<Duration>,
}

impl ReadWatch<'_> {
    /// Why there is no model: a stop is put down to what asked for it.
    fn reason(&self, error: ModelError) -> Error {
        match (error, self.limit) {
            (ModelError::Stopped { file }, Some(limit)) if !interrupt::is_wanted() => {
                Error::TimeLimit { limit_s: limit.as_secs_f64(), doing: format!("reading {file}") }
            }
            (ModelError::Stopped { file }, _) => Error::Interrupted { doing: format!("reading {file}") },
            (error, _) => error.into(),
        }
    }
}

impl model::Watch for ReadWatch<'_> {
    fn progress(&self, done: usize, total: usize) {
        self.progress.stage(&format!("reading: {done} of {total}"));
    }

    fn stops(&self) -> bool {
        interrupt::is_wanted() || self.limit.is_some_and(|limit| self.started.elapsed() > limit)
    }
}

/// Times the stages of the core, each from its beginning to that of the next, and stops them at Ctrl-C or when the time
/// is over.
pub(crate) struct Watch<'a> {
    progress: &'a Progress,
    started: Instant,
    limit: Option<Duration>,
    times: Mutex<Times>,
}

#[derive(Default)]
struct Times {
    running: Option<(Stage, Instant)>,
    seconds: Seconds,
}

impl Times {
    fn finish(&mut self) {
        if let Some((stage, since)) = self.running.take() {
            self.seconds.add(stage, since.elapsed());
        }
    }
}

impl<'a> Watch<'a> {
    fn new(progress: &'a Progress, started: Instant, limit: Option<Duration>, read: f64) -> Self {
        let times = Times { running: None, seconds: Seconds { read, ..Seconds::default() } };
        Self { progress, started, limit, times: Mutex::new(times) }
    }

    fn is_over(&self) -> bool {
        self.limit.is_some_and(|limit| self.started.elapsed() > limit)
    }

    /// Why there is no picture: a stop is put down to what asked for it.
    pub(crate) fn reason(&self, error: PictureError) -> Error {
        let running = self.times.lock().unwrap_or_else(PoisonError::into_inner).running;
        let doing = running.map_or("beginning", |(stage, _)| doing(stage)).to_owned();
        match (error, self.limit) {
            (PictureError::View(error), _) => error.into(),
            (_, Some(limit)) if !interrupt::is_wanted() => Error::TimeLimit { limit_s: limit.as_secs_f64(), doing },
            _ => Error::Interrupted { doing },
        }
    }

    fn finish(self) -> Seconds {
        let mut times = self.times.into_inner().unwrap_or_else(PoisonError::into_inner);
        times.finish();
        times.seconds
    }
}

impl Monitor for Watch<'_> {
    fn begin(&self, stage: Stage) {
        let mut times = self.times.lock().unwrap_or_else(PoisonError::into_inner);
        times.finish();
        self.progress.stage(doing(stage));
        times.running = Some((stage, Instant::now()));
    }

    fn stops(&self) -> bool {
        interrupt::is_wanted() || self.is_over()
    }
}

/// What a stage does.
fn doing(stage: Stage) -> &'static str {
    match stage {
        Stage::View => "projecting",
        Stage::Stitch => "stitching",
        Stage::Extract => "finding curves",
        Stage::Arrange => "splitting curves",
        Stage::Visibility => "deciding visibility",
        Stage::Stroke => "chaining strokes",
        Stage::Render => "painting",
    }
}

/// The lines that say what a drawing is: strokes, ink, travel, lifts, and the time it will take; and of each layer, if there are several.
#[must_use]
pub fn summary(name: &str, stats: &crate::stats::Stats) -> String {
    let duration = |seconds: f64| duration_text(Duration::try_from_secs_f64(seconds).unwrap_or_default());
    let s = &stats.strokes;
    let mut text = format!(
        "{name}: {} strokes, {:.0} mm of ink, {:.0} mm of travel, {} lifts, about {}",
        s.count,
        s.ink_mm,
        s.travel_mm,
        s.lifts,
        duration(stats.estimate_s)
    );
    if let [_, _, ..] = stats.layers[..] {
        for layer in &stats.layers {
            let line = format!(
                "\n  {} with pen {}: {:.0} mm of ink, {:.0} mm of travel, {} lifts, about {}",
                layer.layer,
                layer.pen,
                layer.ink_mm,
                layer.travel_mm,
                layer.lifts,
                duration(layer.seconds)
            );
            text.push_str(&line);
        }
    }
    text
}

/// A time as its reader would say it: to the second, and to the minute from an hour on.
pub(crate) fn duration_text(duration: Duration) -> String {
    let seconds = duration.as_secs_f64().round() as u64;
    match (seconds / 3600, seconds / 60 % 60, seconds % 60) {
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m} min {s} s"),
        (h, m, _) => format!("{h} h {m} min"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_short() {
        let text = |s: f64| duration_text(Duration::from_secs_f64(s));
        assert_eq!(
            [text(0.4), text(59.6), text(3599.0), text(7322.0)],
            ["0 s", "1 min 0 s", "59 min 59 s", "2 h 2 min"]
        );
    }
}
