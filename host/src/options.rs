//! The command line, checked: what it means, and what the defaults are.

mod arcs;
mod fill;
mod order;
mod paper;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::Duration;

pub use arcs::Arcs;
pub use order::{OrderBy, OrderOptions};

use glam::DVec3;
use penvis_core::extract::adaptive::Tone;
use penvis_core::visibility::Method;
use thiserror::Error;

use crate::args::{DrawArgs, DrawingArgs};
use crate::device::{self, Device, DeviceError, Language, PlaceError};
use crate::drawing::Page;
use crate::emit::{Format, RegionFormat};
use crate::isocurves::{self, Isocurves};
use crate::model::{MESH_CREASE_DEGREES, ModelFile, ViewChoice, aim};
use crate::page::{Depths, Hidden, Layout, LayoutError, SheetError, Window};
use crate::style::{self, SheetChoice, StyleChoice};

/// Why the command line makes no sense.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum OptionError {
    /// A value that its option does not take.
    #[error("{option} {value}: {problem}")]
    Value {
        /// The option.
        option: &'static str,
        /// What was given.
        value: String,
        /// What is wrong, and what it takes.
        problem: String,
    },
    /// An output of an unknown kind.
    #[error("{path}: unknown kind of file; the extensions are {known}", path = path.display(), known = Format::extensions())]
    Extension {
        /// The output.
        path: PathBuf,
    },
    /// An output that cannot be.
    #[error("{path}: {problem}", path = path.display())]
    Output {
        /// The output.
        path: PathBuf,
        /// Why not.
        problem: String,
    },
    /// No such paper.
    #[error("--paper: {0}")]
    Sheet(#[from] SheetError),
    /// The margins leave nothing.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// No such device.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The sheet does not go into the device.
    #[error(transparent)]
    Place(#[from] PlaceError),
}

pub(crate) fn bad(option: &'static str, value: impl ToString, problem: impl Into<String>) -> OptionError {
    OptionError::Value { option, value: value.to_string(), problem: problem.into() }
}

fn view_choice(args: &DrawingArgs) -> Result<ViewChoice, OptionError> {
    let up = args.up.as_deref().map(|text| direction("--up", text)).transpose()?;
    let direction = args.view.as_deref().map(named_view).transpose()?;
    let angle = match args.perspective {
        Some(degrees) if !(degrees > 0.0 && degrees < 180.0) => {
            return Err(bad("--perspective", degrees, "is not an angle between 0 and 180 degrees; 30 is a good one"));
        }
        degrees => degrees.map(f64::to_radians),
    };
    Ok(ViewChoice { direction, up, angle })
}

fn named_view(text: &str) -> Result<(DVec3, DVec3), OptionError> {
    if let Some(view) = aim::named(text) {
        return Ok(view);
    }
    let neither = || bad("--view", text, format!("is neither a direction X,Y,Z nor one of {}", aim::names()));
    direction("--view", text).map(aim::with_up).map_err(|_| neither())
}

pub(crate) fn direction(option: &'static str, text: &str) -> Result<DVec3, OptionError> {
    let numbers: Vec<f64> = text.split(',').map_while(|part| part.trim().parse().ok()).collect();
    match (numbers.as_slice(), text.split(',').count()) {
        (&[x, y, z], 3) if DVec3::new(x, y, z).try_normalize().is_some() => Ok(DVec3::new(x, y, z)),
        _ => Err(bad(option, text, "is not a direction; give three finite numbers X,Y,Z that are not all zero")),
    }
}

/// What is drawn, and on which paper, as far as the command line says; [`Settled`](crate::settle::Settled) is the rest.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawingOptions {
    /// Names and paths of models, at least one.
    pub models: Vec<String>,
    /// From where.
    pub view: ViewChoice,
    /// The kinds that are inked, and what becomes of hidden curves.
    pub style: StyleChoice,
    /// Pens by layer, besides those of kinds.
    pub layer_pens: BTreeMap<String, u32>,
    /// Isocurves.
    pub isocurves: Option<Isocurves>,
    /// What makes lines wider apart, or end.
    pub tone: Option<Tone>,
    /// Direction to the light in the viewer's frame: right, up, towards the eye.
    pub light: DVec3,
    /// Whether shadows are darkened.
    pub shadows: bool,
    /// Largest angle, in radians, between facets of a mesh that stand for one smooth surface.
    pub crease_angle: Option<f64>,
    /// Width of the pen in mm.
    pub pen_width_mm: f64,
    /// Whether hidden curves are told apart by the number of sheets in front of them.
    pub depths: Depths,
    /// Most sheets in front of what is drawn, if anything hidden is.
    pub deepest: u32,
    /// Gap in mm that curves leave beside outlines that they pass behind.
    pub halo_mm: f64,
    /// Time after which to give up.
    pub time_limit: Option<Duration>,
    /// How visibility is found.
    pub visibility: Method,
    /// The sheet, its margins, and how exact the drawing on it is.
    pub sheet: SheetChoice,
}

impl DrawingOptions {
    /// Checks the arguments.
    ///
    /// # Errors
    /// [`OptionError`] with the option and what it takes.
    pub fn new(models: &[String], args: &DrawingArgs) -> Result<Self, OptionError> {
        let sheet = SheetChoice {
            paper: args.paper.clone(),
            orientation: paper::orientation(args),
            margin_mm: args.margin,
            tolerance_mm: args.tolerance,
            size: paper::size(args)?,
            position: args.position.as_deref().map(paper::position).transpose()?,
            clip: args.clip.then_some(true),
            marks: args.marks.then_some(true),
            title: args.title.clone(),
        };
        if let Some(margin_mm) = args.margin
            && !(margin_mm.is_finite() && margin_mm >= 0.0)
        {
            return Err(bad("--margin", margin_mm, "is not a length in mm; give 0 or more"));
        }
        let (page, margin_mm) = sheet.settle()?;
        if sheet.paper.is_some() {
            Layout::room(page, margin_mm)?;
        }
        if let Some(mm) = args.tolerance
            && !(mm.is_finite() && mm > 0.0)
        {
            return Err(bad("--tolerance", mm, "is not a positive length in mm; 0.01 is a good one"));
        }
        if let Some(angle) = args.crease_angle.filter(|angle| !(0.0..=180.0).contains(angle)) {
            let problem = format!("is not an angle from 0 to 180 degrees; {MESH_CREASE_DEGREES} is a good one");
            return Err(bad("--crease-angle", angle, problem));
        }
        if !(args.pen_width.is_finite() && args.pen_width > 0.0) {
            return Err(bad("--pen-width", args.pen_width, "is not a positive width in mm"));
        }
        let curves = args
            .curves
            .as_deref()
            .map(|text| style::kinds(text.split(',').map(str::trim)).map_err(|problem| bad("--curves", text, problem)));
        let light = isocurves::light(args)?;
        let isocurves = Isocurves::new(args, light)?;
        let tone = isocurves::tone(args, light)?;
        let hidden = args
            .hidden
            .as_deref()
            .map(|word| style::hidden(word).map_err(|problem| bad("--hidden", word, problem)))
            .transpose()?;
        if hidden == Some(Hidden::Omit) && args.qi.is_some_and(|n| n > 0) {
            return Err(bad("--hidden", "omit", "leaves nothing to --qi; give dashed or layer, or --qi 0"));
        }
        let deepest = args.qi.unwrap_or(u32::MAX);
        if !(args.halo.is_finite() && args.halo >= 0.0) {
            return Err(bad("--halo", args.halo, "is not a gap in mm; give 0 or more"));
        }
        let depths = if args.qi.is_some() { Depths::Apart } else { Depths::Together };
        let time_limit = match args.time_limit {
            Some(s) => match Duration::try_from_secs_f64(s) {
                Ok(limit) if s > 0.0 => Some(limit),
                _ => return Err(bad("--time-limit", s, "is not a time in s; give more than 0")),
            },
            None => None,
        };
        let visibility = match args.visibility.as_str() {
            "rays" => Method::Rays,
            "propagate" => Method::Propagate,
            other => return Err(bad("--visibility", other, "is not one of rays, propagate")),
        };
        let (pens, layer_pens) = paper::pens(&args.pen)?;
        let style = StyleChoice {
            curves: curves.transpose()?,
            hidden,
            pens,
            fill: fill::fill(args)?,
            ..StyleChoice::default()
        };
        Ok(Self {
            models: models.to_vec(),
            view: view_choice(args)?,
            style,
            layer_pens,
            isocurves,
            tone,
            light,
            shadows: args.shadows,
            crease_angle: args.crease_angle.map(f64::to_radians),
            pen_width_mm: args.pen_width,
            depths,
            deepest,
            halo_mm: args.halo,
            visibility,
            time_limit,
            sheet,
        })
    }

    /// Whether hidden curves are asked for by the number of sheets in front of them.
    pub(crate) fn tells_depths(&self) -> bool {
        self.depths == Depths::Apart && self.deepest > 0
    }

    /// The sheet, if no model can choose another one.
    pub(crate) fn stated_page(&self) -> Option<Page> {
        self.sheet.paper.as_ref()?;
        self.sheet.settle().ok().map(|(page, _)| page)
    }
}

/// A file to be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Output {
    /// Where.
    pub path: PathBuf,
    /// What.
    pub format: Format,
}

/// What `penvis draw` is to do.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawOptions {
    /// What is drawn, and on which paper.
    pub drawing: DrawingOptions,
    /// The path of the pen.
    pub order: OrderOptions,
    /// The files to be written.
    pub outputs: Vec<Output>,
    /// The plotter that G-code is written for.
    pub gcode: Device,
    /// The plotter that HPGL is written for.
    pub hpgl: Device,
    /// The plotter whose speeds the estimate uses: the one asked for, or the default one of the language written.
    pub estimated: Device,
    /// Where the stats go.
    pub stats: Option<PathBuf>,
    /// Where the visible regions go, and as what.
    pub regions: Option<(PathBuf, RegionFormat)>,
    /// Whether pictures show the ways with the pen up.
    pub show_travel: bool,
    /// Whether the surfaces are painted instead of drawn; all outputs are pictures then.
    pub render: bool,
}

impl DrawOptions {
    /// Checks the arguments, and all that can be checked of the outputs before anything is computed.
    ///
    /// # Errors
    /// [`OptionError`] with the option or the output.
    pub fn new(args: &DrawArgs) -> Result<Self, OptionError> {
        let mut outputs = Vec::new();
        for path in &args.output {
            let format = Format::of_path(path).ok_or_else(|| OptionError::Extension { path: path.clone() })?;
            if args.render && format != Format::Png {
                let problem =
                    "--render paints pictures and draws no strokes; give a .png, or leave --render out".into();
                return Err(OptionError::Output { path: path.clone(), problem });
            }
            outputs.push(Output { path: path.clone(), format });
        }
        let regions = args.emit_regions.as_ref().map(|path| match RegionFormat::of_path(path) {
            Some(format) => Ok((path.clone(), format)),
            None => {
                let problem = "--emit-regions writes .svg or .json; choose one of these extensions".into();
                Err(OptionError::Output { path: path.clone(), problem })
            }
        });
        let regions = regions.transpose()?;
        let drawing = DrawingOptions::new(&args.models, &args.drawing)?;
        let order = OrderOptions::new(&args.path)?;
        check_paths(args)?;
        let asked = args.device.as_deref().map(device::find).transpose()?;
        let or_default = |default: &str, speaks: fn(&Language) -> bool| match &asked {
            Some(device) if speaks(&device.language) => Ok(device.clone()),
            _ => device::find(default),
        };
        let gcode = or_default(device::DEFAULT, |language| language.gcode().is_some())?;
        let hpgl = or_default(device::DEFAULT_HPGL, |language| matches!(language, Language::Hpgl(_)))?;
        for output in &outputs {
            let device = match output.format {
                Format::Gcode => &gcode,
                Format::Hpgl => &hpgl,
                _ => continue,
            };
            if asked.as_ref().is_some_and(|asked| asked.language.name() != device.language.name()) {
                let name = args.device.as_deref().unwrap_or_default();
                let problem =
                    format!("does not speak the language of {}; leave it out for a common one", output.path.display());
                return Err(bad("--device", name, problem));
            }
        }
        let only_hpgl =
            outputs.iter().any(|o| o.format == Format::Hpgl) && outputs.iter().all(|o| o.format != Format::Gcode);
        let estimated = asked.unwrap_or_else(|| if only_hpgl { hpgl.clone() } else { gcode.clone() });
        let options = Self {
            drawing,
            order,
            outputs,
            gcode,
            hpgl,
            estimated,
            stats: args.stats.clone(),
            regions,
            show_travel: args.show_travel,
            render: args.render,
        };
        if let Some(page) = options.drawing.stated_page() {
            options.check_page(page)?;
        }
        Ok(options)
    }

    /// Refuses a sheet that a plotter among the outputs does not take.
    ///
    /// # Errors
    /// If it does not fit.
    pub fn check_page(&self, page: Page) -> Result<(), OptionError> {
        for output in &self.outputs {
            match output.format {
                Format::Gcode => self.gcode.place(page)?,
                Format::Hpgl => self.hpgl.place(page)?,
                _ => continue,
            };
        }
        Ok(())
    }

    /// The part of a page that all plotters among the outputs reach; none if there are no such outputs. A page that one does not take counts
    /// for nothing, see [`check_page`](Self::check_page).
    #[must_use]
    pub fn reach(&self, page: Page) -> Option<Window> {
        let placements = self.outputs.iter().filter_map(|output| match output.format {
            Format::Gcode => self.gcode.place(page).ok(),
            Format::Hpgl => self.hpgl.place(page).ok(),
            _ => None,
        });
        placements
            .map(|placement| placement.reach())
            .reduce(|a, b| a.common(b).unwrap_or(Window { low: a.low, high: a.low }))
    }

    /// Refuses outputs that are files from which the model comes.
    ///
    /// # Errors
    /// If there is one.
    pub fn check_files(&self, files: &[ModelFile]) -> Result<(), OptionError> {
        let read: BTreeSet<PathBuf> =
            files.iter().filter_map(|file| Path::new(&file.file).canonicalize().ok()).collect();
        let mut written = self
            .outputs
            .iter()
            .map(|output| &output.path)
            .chain(&self.stats)
            .chain(self.regions.iter().map(|(path, _)| path));
        match written.find(|path| path.canonicalize().is_ok_and(|path| read.contains(&path))) {
            Some(path) => {
                let problem = "is a part of the scene; choose another name for the output".into();
                Err(OptionError::Output { path: path.clone(), problem })
            }
            None => Ok(()),
        }
    }
}

/// Refuses outputs that are the same, are a model, are no regular file, or have no folder.
fn check_paths(args: &DrawArgs) -> Result<(), OptionError> {
    let models: Vec<_> = args.models.iter().filter_map(|model| Path::new(model).canonicalize().ok()).collect();
    let mut seen = BTreeSet::new();
    for path in args.output.iter().chain(&args.stats).chain(&args.emit_regions) {
        let refuse = |problem: String| Err(OptionError::Output { path: path.clone(), problem });
        let folder = folder(path);
        let (Ok(folder), Some(name)) = (folder.canonicalize(), path.file_name()) else {
            return refuse(format!("there is no folder {}; make it first", folder.display()));
        };
        if path.exists() && !path.is_file() {
            return refuse("is there, and is not a regular file; choose another name".into());
        }
        if path.canonicalize().is_ok_and(|path| models.contains(&path)) {
            return refuse("is the model; choose another name for the output".into());
        }
        if !seen.insert(folder.join(name)) {
            return refuse("is asked for twice".into());
        }
    }
    Ok(())
}

/// The folder that a file is in.
#[must_use]
pub fn folder(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser;
    use glam::DVec2;

    use super::*;
    use penvis_core::extract::{CurveSet, Style};
    use penvis_core::stroke::CurveKind;

    use crate::model::{self, Model, Projection, View};
    use crate::page::{Effort, Ink, KindPens, Measure, Placing, Position, Size};
    use crate::settle::Settled;

    const A4: Page = Page { width_mm: 297.0, height_mm: 210.0 };

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: DrawArgs,
    }

    fn options(words: &str) -> Result<DrawOptions, OptionError> {
        DrawOptions::new(&Line::try_parse_from(format!("penvis {words}").split_whitespace()).unwrap().args)
    }

    fn view(words: &str) -> View {
        let stored = View::perspective(DVec3::new(3.0, -4.0, 1.0), DVec3::Z);
        let scene = model::load(&["saddle".into()], &model::Reading::new(&())).unwrap().scene;
        options(&format!("saddle -o a.svg {words}")).unwrap().drawing.view.resolve(Some(stored), &scene)
    }

    #[test]
    fn the_view_is_the_stored_one_unless_asked_otherwise() {
        assert_eq!(view("").projection, Projection::Perspective { eye: DVec3::new(3.0, -4.0, 1.0), target: DVec3::Z });
        assert_eq!(view("--view front"), View::orthographic(DVec3::NEG_Y));
        assert_eq!(view("--view -1,-2,.5"), View::orthographic(DVec3::new(-1.0, -2.0, 0.5)));
        assert_eq!(view("--view 0,0,2").up, DVec3::Y);
        assert_eq!(view("--up -1,0,0").up, DVec3::NEG_X);
        for name in aim::names().split(", ") {
            view(&format!("--view {name}")).camera().unwrap();
        }
        for flat in ["top", "bottom"] {
            let x = view(&format!("--view {flat}")).camera().unwrap().project(DVec3::X).unwrap();
            assert_eq!(x.truncate(), glam::DVec2::X);
        }
    }

    #[test]
    fn a_perspective_holds_the_model() {
        let seen = view("--view iso --perspective 40");
        let Projection::Perspective { eye, target } = seen.projection else { panic!("{seen:?}") };
        let scene = model::load(&["saddle".into()], &model::Reading::new(&())).unwrap().scene;
        let widest = scene.surfaces[0].surface.homogeneous().iter().map(|h| {
            let p = h.truncate() / h.w;
            (p - eye).angle_between(target - eye).to_degrees()
        });
        let widest = widest.fold(0.0, f64::max);
        assert!(widest <= 20.0 && widest > 10.0, "{widest}");
    }

    fn settled(words: &str, model: &Model) -> Settled {
        Settled::new(&options(&format!("saddle -o a.json {words}")).unwrap().drawing, model).unwrap()
    }

    fn saddle() -> Model {
        model::load(&["saddle".into()], &model::Reading::new(&())).unwrap()
    }

    #[test]
    fn defaults() {
        let found = settled("", &saddle());
        assert_eq!(*found.styles.of(0), Style { curves: CurveSet::default(), isos: 8 });
        assert_eq!((found.adaptive, found.isos, found.deepest), (None, 8, 0));
        assert_eq!((found.inks.of(0), found.margin_mm), (Ink::default(), 15.0));
        assert_eq!(found.page, Page { width_mm: 297.0, height_mm: 210.0 });
        let options = options("saddle -o a.svg").unwrap();
        assert_eq!((options.gcode.name.as_str(), options.hpgl.name.as_str()), (device::DEFAULT, device::DEFAULT_HPGL));
        assert_eq!(options.estimated.name, device::DEFAULT);
        assert_eq!(self::options("saddle -o a.plt").unwrap().estimated.name, device::DEFAULT_HPGL);
    }

    #[test]
    fn isocurves_are_counted_only_when_inked() {
        for words in ["--curves boundary,trim", "--iso 0", "--curves silhouette --iso-spacing 1"] {
            let found = settled(words, &saddle());
            assert_eq!((found.adaptive, found.isos, found.styles.of(0).curves.iso), (None, 0, false), "{words}");
        }
    }

    #[test]
    fn the_command_line_goes_before_the_model() {
        let mut model = model::load(&["linked_tori".into()], &model::Reading::new(&())).unwrap();
        let outlines = CurveSet { silhouette: true, ..CurveSet::NONE };
        let first = StyleChoice { curves: Some(outlines), pens: KindPens::all(2), ..StyleChoice::default() };
        let second = StyleChoice { isos: Some(3), hidden: Some(Hidden::Layer), ..StyleChoice::default() };
        model.styles = vec![(0..1, first), (1..2, second)];
        model.sheet = SheetChoice { paper: Some("a5".into()), margin_mm: Some(7.0), ..SheetChoice::default() };
        let found = settled("", &model);
        assert_eq!(*found.styles.of(0), Style { curves: outlines, isos: 0 });
        assert_eq!(*found.styles.of(1), Style { curves: CurveSet::default(), isos: 3 });
        assert_eq!([0, 1].map(|s| found.inks.of(s).pens.only()), [Some(2), Some(1)]);
        assert_eq!([0, 1].map(|s| found.inks.of(s).hidden), [Hidden::Omit, Hidden::Layer]);
        assert_eq!((found.page.width_mm, found.margin_mm, found.deepest, found.isos), (210.0, 7.0, u32::MAX, 0));

        let found = settled("--curves iso --iso 4 --hidden omit --paper 100x80 --margin 5", &model);
        let isos = Style { curves: CurveSet { iso: true, ..CurveSet::NONE }, isos: 4 };
        assert_eq!([0, 1].map(|s| *found.styles.of(s)), [isos; 2]);
        assert_eq!([0, 1].map(|s| found.inks.of(s).pens.only()), [Some(2), Some(1)]);
        assert_eq!((found.page.width_mm, found.margin_mm, found.deepest, found.isos), (100.0, 5.0, 0, 4));

        let found = settled("--qi 2", &model);
        assert_eq!(([0, 1].map(|s| found.inks.of(s).hidden), found.deepest), ([Hidden::Layer; 2], 2));
        let found = settled("--iso-spacing 1", &model);
        assert_eq!(
            (found.adaptive.is_some(), found.styles.of(0).curves.iso, found.styles.of(1).curves.iso),
            (true, false, true)
        );
    }

    #[test]
    fn layers_have_pens() {
        let mut model = saddle();
        model.styles = vec![(0..1, StyleChoice { pens: KindPens::all(7), ..StyleChoice::default() })];
        let inks = settled("--pen iso=2,silhouette=3 --pen hidden-2=9 --pen trim=4 --hidden layer", &model).inks;
        let pen = |kind: CurveKind| inks.visible(0, kind, kind.name());
        assert_eq!([CurveKind::Iso, CurveKind::Silhouette, CurveKind::Boundary].map(pen), [2, 3, 4]);
        assert_eq!((pen(CurveKind::Crease), inks.last_pen()), (7, 7));
        assert_eq!((inks.hidden(0, "hidden-2"), inks.hidden(0, "hidden-1")), (Some(9), None));
        let inks = settled("--pen 5,iso=2", &model).inks;
        assert_eq!((inks.of(0).pens.of(CurveKind::Iso), inks.of(0).pens.of(CurveKind::Crease)), (2, 5));
    }

    #[test]
    fn the_picture_has_a_size_and_a_place() {
        let placing = |words: &str, model: &Model| settled(words, model).placing;
        let mut model = saddle();
        assert_eq!(placing("", &model), Placing::default());
        model.sheet.size = Some(Size::Width(50.0));
        model.sheet.clip = Some(true);
        assert_eq!(placing("", &model), Placing { size: Size::Width(50.0), clip: true, ..Placing::default() });
        let at = Position::At(DVec2::new(-20.0, 25.4));
        let asked = Placing { size: Size::Scale(0.25), position: at, clip: true };
        assert_eq!(placing("--scale 1:4 --position -20mm,1in", &model), asked);
    }

    #[test]
    fn what_is_cut_is_cut_to_what_all_plotters_reach() {
        let reach = |words: &str| options(&format!("saddle {words}")).unwrap().reach(A4);
        assert_eq!(reach("-o a.svg"), None);
        let whole = Window { low: DVec2::ZERO, high: DVec2::new(297.0, 210.0) };
        assert_eq!(reach("-o a.gcode"), Some(whole));
        let hp = reach("-o a.plt").unwrap();
        assert_eq!(reach("-o a.plt -o a.gcode"), Some(hp));
        assert!(hp.low.min_element() > 0.0 && hp.high.cmplt(whole.high).all(), "{hp:?}");
    }

    #[test]
    fn the_order_is_good_for_the_plotter_whose_time_is_told() {
        let effort = |words: &str| {
            let options = options(&format!("saddle {words}")).unwrap();
            options.order.path(&options.estimated).effort
        };
        let servo = device::find("grbl-servo").unwrap();
        let usual = Measure::Time {
            lift_s: 0.35,
            speed: servo.travel_feed / 60.0,
            acceleration: servo.acceleration,
            of_axes: true,
        };
        assert_eq!(effort("-o a.svg"), Effort { measure: usual, seconds: 1.0, seed: 0 });
        let hp = device::find("hp7550a").unwrap();
        assert!(
            matches!(effort("-o a.plt --device hp7550a").measure, Measure::Time { speed, lift_s: 0.12, of_axes: true, .. } if speed == hp.travel_feed / 60.0)
        );
        assert!(matches!(effort("-o a.gcode --device marlin-z").measure, Measure::Time { of_axes: false, .. }));
        let asked = Effort { measure: Measure::Distance, seconds: 0.0, seed: 9 };
        assert_eq!(effort("-o a.svg --order-by distance --optimize 0 --order-seed 9"), asked);
    }

    #[test]
    fn adaptive_isocurves_have_a_spacing_or_twice_the_pen() {
        use penvis_core::extract::adaptive::{Direction, Spacing, Tone};
        let adaptive = |words: &str| match options(&format!("saddle -o a.svg {words}")).unwrap().drawing.isocurves {
            Some(Isocurves::Adaptive(adaptive)) => adaptive,
            other => panic!("{words}: {other:?}"),
        };
        let plain = adaptive("--iso-spacing 0.5");
        assert_eq!((plain.spacing_mm, plain.measured, plain.direction), (0.5, Spacing::Screen, Direction::Auto));
        assert_eq!((plain.tone, plain.levels), (None, 1));
        let shaded = adaptive("--shade lambert --pen-width 0.4 --light -1,2,3 --iso-levels 3 --iso-direction both");
        assert_eq!((shaded.spacing_mm, shaded.levels, shaded.direction), (0.8, 3, Direction::Both));
        assert_eq!(shaded.tone, Some(Tone::Lambert(DVec3::new(-1.0, 2.0, 3.0))));
        let flat = adaptive("--shade 0.25 --iso-spacing 1 --iso-metric surface");
        assert_eq!((flat.spacing_mm, flat.measured, flat.tone), (1.0, Spacing::Surface, Some(Tone::Flat(0.25))));
    }

    #[test]
    fn what_makes_no_sense_is_refused_with_its_option() {
        let table = [
            ("--view up", "--view up: "),
            ("--view 0,0,0", "--view 0,0,0: "),
            ("--view 1,2", "--view 1,2: "),
            ("--view 1,2,3,4", "--view "),
            ("--up 1,2,nan", "--up 1,2,nan: "),
            ("--perspective 180", "--perspective 180: "),
            ("--perspective nan", "--perspective NaN: "),
            ("--curves silhouete", "`silhouete` is not one of boundary"),
            ("--curves iso,", "`` is not one of"),
            ("--iso 1001", "--iso 1001: "),
            ("--halo nan", "--halo NaN: "),
            ("--iso-spacing 0", "--iso-spacing 0: "),
            ("--iso-spacing nan", "--iso-spacing NaN: "),
            ("--iso-levels 2", "goes with --iso-spacing or --shade"),
            ("--iso-direction u", "goes with --iso-spacing, --shade or --fill iso"),
            ("--iso-metric surface", "goes with --iso-spacing or --shade"),
            ("--iso-spacing 1 --iso-levels 0", "--iso-levels 0: "),
            ("--iso-spacing 1 --iso-direction w", "--iso-direction w: is not one of"),
            ("--iso-spacing 1 --iso-metric foot", "--iso-metric foot: is not one of"),
            ("--shade dark", "--shade dark: "),
            ("--shade 1.5", "--shade 1.5: "),
            ("--shade lambert --light 0,0,0", "--light 0,0,0: "),
            ("--hidden no", "--hidden no: "),
            ("--optimize -1", "--optimize -1: is not a time from 0 to 86400 s"),
            ("--optimize nan", "--optimize NaN: "),
            ("--merge -0.1", "--merge -0.1: is not a length from 0 to 10 mm"),
            ("--merge nan", "--merge NaN: "),
            ("--order-by length", "--order-by length: is not one of time, distance"),
            ("--pen 0", "--pen 0: names no pen"),
            ("--pen iso=100", "--pen iso=100: names no pen"),
            ("--pen isos=2", "--pen isos=2: `isos` is not one of boundary"),
            ("--pen iso-0=2", "--pen iso-0=2: `iso-0` is not one of boundary"),
            ("--tolerance 0", "--tolerance 0: "),
            ("--tolerance inf", "--tolerance inf: "),
            ("--paper a9", "--paper: there is no paper `a9`"),
            ("--paper a4 --margin 105", "leaves no room"),
            ("--margin nan", "--margin NaN: "),
            ("--scale 0", "--scale 0: is no ratio"),
            ("--scale 1:x", "--scale 1:x: is no ratio"),
            ("--width 12ft", "--width 12ft: is no length"),
            ("--height 0", "--height 0: is no length"),
            ("--position left", "--position left: is neither center nor"),
            ("--position 1", "--position 1: is neither center nor"),
            ("--crease-angle 181", "--crease-angle 181: is not an angle from 0 to 180 degrees; 30"),
            ("--crease-angle nan", "--crease-angle NaN: "),
            ("--pen-width 0", "--pen-width 0: "),
            ("-o b.png --render", "a.svg: --render paints pictures"),
            ("--device nobody", "there is no device `nobody`"),
            ("-o b.pdf", "b.pdf: unknown kind of file; the extensions are .svg"),
            ("-o a.svg", "a.svg: is asked for twice"),
            ("-o ./a.svg", "./a.svg: is asked for twice"),
            ("-o nowhere/b.svg", "nowhere/b.svg: there is no folder nowhere"),
            ("-o b.gcode --device hp7475a", "--device hp7475a: does not speak the language of b.gcode"),
            ("-o b.gcode --paper a2", "larger than the reach"),
            ("-o b.plt --paper a2", "its papers are"),
        ];
        for (words, expected) in table {
            let message = options(&format!("saddle -o a.svg {words}")).unwrap_err().to_string();
            assert!(message.contains(expected), "{words} gave {message:?}");
            assert!(!message.contains('\n'), "{message:?}");
        }
    }
}
