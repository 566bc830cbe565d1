//! Drawings that are drawn again: from a file onto a page, without a model.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use thiserror::Error;

use crate::args::DrawingArgs;
use crate::compute::Computed;
use crate::device::Device;
use crate::drawing::{Drawing, DrawingFormat, Found, Page, Reading};
use crate::error::Error;
use crate::interrupt;
use crate::marking::{MARKS_LAYER, TITLE_LAYER};
use crate::model::{ReadError, Source, View};
use crate::options::{DrawingOptions, OptionError, bad};
use crate::page::{self, Layout, PathChoice, Placing, Position, Shares, Size, Window};
use crate::pens::{Pen, Pens};
use crate::progress::Progress;
use crate::stats::Seconds;
use crate::style::MOST_PENS;

/// Why a drawing cannot be drawn again.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RedrawError {
    /// It is among models.
    #[error("{file} is a drawing, and {other} is none; draw models and drawings one after the other")]
    Mixed {
        /// The drawing.
        file: String,
        /// What is none.
        other: String,
    },
    /// Something is asked for that only models have.
    #[error("{option} is for models, and {file} is a drawing: its strokes are as they are; leave it out")]
    Surfaces {
        /// The option.
        option: &'static str,
        /// The drawing.
        file: String,
    },
    /// There are more layers than pens.
    #[error(
        "{file} has more layers than there are pens, {MOST_PENS}; give them pens with --pen LAYER=N, or all of them one with --pen 1"
    )]
    Layers {
        /// The drawing.
        file: String,
    },
    /// It cannot be read.
    #[error("{file}: {source}")]
    Read {
        /// The drawing.
        file: String,
        /// What is wrong, and where.
        source: ReadError,
    },
}

/// The plotters for which files in their languages are.
#[derive(Clone, Copy, Debug)]
pub struct Plotters<'a> {
    /// For G-code.
    pub gcode: &'a Device,
    /// For HPGL.
    pub hpgl: &'a Device,
}

/// Drawings in files, and what is asked of them. Several are drawn as one, with their lower left corners together, on a sheet as large as the largest.
#[derive(Clone, Debug)]
pub struct Redraw {
    files: Vec<(PathBuf, DrawingFormat)>,
    /// The pen of everything, if one is said.
    pen: Option<u32>,
    /// Pens by layer, which go before it.
    layers: BTreeMap<String, u32>,
    /// What else is asked for, in options that models have too.
    args: DrawingArgs,
}

impl Redraw {
    /// The drawings among what is to be drawn, if there are any.
    ///
    /// # Errors
    /// If there are models too, or something is asked for that only models have.
    pub fn new(files: &[String], args: &DrawingArgs) -> Result<Option<Self>, Error> {
        let (Some(drawings), Some(file)) = (drawings(files)?, files.first()) else { return Ok(None) };
        if let Some(option) = of_models(args) {
            return Err(RedrawError::Surfaces { option, file: file.clone() }.into());
        }
        let (mut pen, mut layers) = (None, BTreeMap::new());
        for word in &args.pen {
            let (layer, number) =
                word.rsplit_once('=').map_or((None, word.as_str()), |(layer, n)| (Some(layer.trim()), n));
            let Some(number) = number.trim().parse().ok().filter(|number| (1..=MOST_PENS).contains(number)) else {
                let problem = format!("names no pen; give LAYER=N or N, a number from 1 to {MOST_PENS}");
                return Err(bad("--pen", word, problem).into());
            };
            match layer {
                None => pen = Some(number),
                Some(layer) => drop(layers.insert(layer.to_owned(), number)),
            }
        }
        let args = DrawingArgs { pen: Vec::new(), ..args.clone() };
        Ok(Some(Self { files: drawings, pen, layers, args }))
    }

    /// The arguments without the pens, which are said by the layers of the drawing here.
    #[must_use]
    pub fn args(&self) -> &DrawingArgs {
        &self.args
    }

    /// Reads the drawing, which is for one of these `plotters` if it is for a plotter, puts it on its page, cuts off what is to be cut off, and finds a path of the pen of which this is asked. `curved` says whether arcs are to be fitted to it. `reach` says what the
    /// plotters reach of a page, or refuses it.
    ///
    /// It keeps its size, and its place too if the sheet is its own: then no coordinate changes. On another sheet it is put in the middle.
    ///
    /// # Errors
    /// If it cannot be read, has no layer of a name for which a pen is said, or does not fit, or Ctrl-C ends it.
    pub fn compute(
        &self,
        options: &DrawingOptions,
        path: PathChoice,
        curved: bool,
        plotters: Plotters<'_>,
        progress: &Progress,
        reach: impl FnOnce(Page) -> Result<Option<Window>, Error>,
    ) -> Result<Computed, Error> {
        interrupt::watch();
        progress.stage("reading");
        let started = Instant::now();
        // Polylines that were read as they are have no tolerance left.
        let curved = curved && self.files.iter().all(|(_, format)| format.has_curves());
        let shares = Shares::of(options.sheet.settled_tolerance_mm(), curved);
        let mut found = self.read(shares.traced_mm, plotters)?;
        let mut window = place(&mut found.drawing, options)?;
        // What is enlarged was to be read more closely. The points are on the curves, so that the finer ones are as far apart but for two tolerances, and the
        // picture becomes less than twice as large as before, unless it is itself no larger than a few of them.
        let scale = window.as_ref().map_or(1.0, |layout| 1.0 / layout.to_screen_length(1.0));
        if scale > 1.0 && self.files.iter().any(|(_, format)| format.has_curves()) {
            found = self.read(shares.traced_mm / (2.0 * scale), plotters)?;
            window = place(&mut found.drawing, options)?;
        }
        let mut seconds = Seconds { read: started.elapsed().as_secs_f64(), ..Seconds::default() };
        progress.stage("ordering");
        let started = Instant::now();
        let Found { mut drawing, view, colours, notes } = found;
        self.choose_pens(&mut drawing, &colours, options.pen_width_mm)?;
        let marking = options.sheet.marking(self.layers.clone());
        let reach = reach(drawing.page)?;
        if let Some(layout) = window {
            let layout = reach.map_or(Ok(layout), |reach| layout.within(reach))?;
            if let Some(window) = layout.window() {
                let whole = std::mem::take(&mut drawing.polylines);
                whole.into_iter().for_each(|polyline| page::clip(polyline, window, &mut drawing.polylines));
            }
        }
        let edge_mm = options.sheet.margin_mm.unwrap_or_else(|| page::default_margin_mm(drawing.page));
        let marks = marking.strokes(&drawing.polylines, drawing.page, edge_mm)?;
        drawing.polylines.extend(marks);
        // What is hidden may be dashes, and stays as it is.
        let path = path.settle(&drawing.polylines, &drawing.pens, &shares);
        drawing.slack_mm = shares.slack_mm;
        drawing.polylines = path.through(drawing.polylines, &interrupt::is_wanted);
        if interrupt::is_wanted() {
            return Err(Error::Interrupted { doing: "ordering strokes".into() });
        }
        seconds.page = started.elapsed().as_secs_f64();
        let view = view.unwrap_or(View::ISOMETRIC);
        Ok(Computed { drawing, view, stats: Default::default(), seconds, notes, regions: None, shadows: None })
    }

    /// Reads the drawings as one.
    fn read(&self, tolerance_mm: f64, plotters: Plotters<'_>) -> Result<Found, Error> {
        let Plotters { gcode, hpgl } = plotters;
        let reading = Reading { tolerance_mm, gcode, hpgl, stops: &interrupt::is_wanted };
        let mut all: Option<Found> = None;
        for (path, format) in &self.files {
            let mut found = read(path, *format, &reading)?;
            found.notes.iter_mut().for_each(|note| *note = format!("{}: {note}", path.display()));
            all = Some(match all {
                Some(before) => together(before, found),
                None => found,
            });
        }
        all.ok_or_else(|| bad("DRAWING", "", "is missing; give a file").into())
    }

    /// Gives layers the pens that are said for them, and pens the colours of what they draw first.
    fn choose_pens(
        &self,
        drawing: &mut Drawing,
        colours: &BTreeMap<u32, [u8; 3]>,
        pen_width_mm: f64,
    ) -> Result<(), Error> {
        for (layer, pen) in &self.layers {
            let is_marking = matches!(layer.as_str(), MARKS_LAYER | TITLE_LAYER);
            if !is_marking && !drawing.polylines.iter().any(|p| p.layer == *layer) {
                let mut names: Vec<&str> = drawing.polylines.iter().map(|p| p.layer.as_str()).collect();
                names.sort_unstable();
                names.dedup();
                let problem = format!("the drawing has no layer `{layer}`, but {}", names.join(", "));
                return Err(bad("--pen", format!("{layer}={pen}"), crate::message::one_line(&problem)).into());
            }
        }
        let mut own = BTreeMap::new();
        for polyline in &mut drawing.polylines {
            let color = colours.get(&polyline.pen).copied();
            polyline.pen = self.layers.get(&polyline.layer).copied().or(self.pen).unwrap_or(polyline.pen);
            if polyline.pen > MOST_PENS {
                return Err(RedrawError::Layers { file: drawing.name.clone() }.into());
            }
            own.entry(polyline.pen).or_insert(Pen { color, ..Pen::default() });
        }
        drawing.pens = Pens::new(own, pen_width_mm);
        Ok(())
    }
}

/// Reads a drawing.
///
/// # Errors
/// If it cannot be read, or Ctrl-C ends it.
pub fn read(path: &Path, format: DrawingFormat, reading: &Reading<'_>) -> Result<Found, Error> {
    let file = || path.display().to_string();
    let found = Source::open(path).map_err(ReadError::from).and_then(|mut source| format.read(&mut source, reading));
    found.map_err(|source| match source {
        ReadError::Stopped => Error::Interrupted { doing: format!("reading {}", file()) },
        source => RedrawError::Read { file: file(), source }.into(),
    })
}

/// Files, if they are drawings; none if none of them is.
///
/// # Errors
/// [`RedrawError::Mixed`] if only some are.
pub fn drawings(files: &[String]) -> Result<Option<Vec<(PathBuf, DrawingFormat)>>, RedrawError> {
    let mut found = Vec::new();
    let (mut drawing, mut other) = (None, None);
    for file in files {
        match DrawingFormat::of(Path::new(file)) {
            Some(format) => {
                drawing = drawing.or(Some(file));
                found.push((PathBuf::from(file), format));
            }
            None => other = other.or(Some(file)),
        }
    }
    match (drawing, other) {
        (Some(file), Some(other)) => Err(RedrawError::Mixed { file: file.clone(), other: other.clone() }),
        (Some(_), None) => Ok(Some(found)),
        (None, _) => Ok(None),
    }
}

/// One drawing of two.
fn together(mut a: Found, b: Found) -> Found {
    let page = &mut a.drawing.page;
    page.width_mm = page.width_mm.max(b.drawing.page.width_mm);
    page.height_mm = page.height_mm.max(b.drawing.page.height_mm);
    a.drawing.name = format!("{}, {}", a.drawing.name, b.drawing.name);
    a.drawing.isos = if a.drawing.isos == b.drawing.isos { a.drawing.isos } else { 0 };
    a.drawing.polylines.extend(b.drawing.polylines);
    for (pen, colour) in b.colours {
        a.colours.entry(pen).or_insert(colour);
    }
    a.notes.extend(b.notes);
    Found { view: a.view.filter(|view| b.view.as_ref() == Some(view)), ..a }
}

/// Puts a drawing on the sheet that is asked for, and returns its layout there; none of a drawing without strokes.
fn place(drawing: &mut Drawing, options: &DrawingOptions) -> Result<Option<Layout>, Error> {
    let sheet = &options.sheet;
    let own = drawing.page;
    let is_said = sheet.paper.is_some() || sheet.orientation.is_some();
    let page = if is_said { sheet.settle().map_err(OptionError::from)?.0 } else { own };
    drawing.page = page;
    let Some([low, high]) = drawing.extent() else { return Ok(None) };
    let stays = sheet.size.is_none() && sheet.position.is_none() && page == own;
    // Its own margins are unknown, and what stays where it is asks for none.
    let margin_mm = match sheet.margin_mm {
        None if stays => 0.0,
        margin_mm => {
            margin_mm.unwrap_or_else(|| page::default_margin_mm(page)) + sheet.marking(BTreeMap::new()).band_mm()
        }
    };
    let placing = Placing {
        size: sheet.size.unwrap_or(Size::Scale(1.0)),
        position: if stays { Position::At(low) } else { sheet.position.unwrap_or_default() },
        clip: sheet.clip.unwrap_or_default(),
    };
    let layout = Layout::new([low, high], page, margin_mm, placing)?;
    if !stays {
        drawing.polylines.iter_mut().flat_map(|p| &mut p.page).for_each(|p| *p = layout.to_page(*p));
    }
    Ok(Some(layout))
}

/// The first option that is given and asks something of surfaces.
fn of_models(args: &DrawingArgs) -> Option<&'static str> {
    let given = [
        ("--view", args.view.is_some()),
        ("--up", args.up.is_some()),
        ("--perspective", args.perspective.is_some()),
        ("--curves", args.curves.is_some()),
        ("--iso", args.iso.is_some()),
        ("--iso-spacing", args.iso_spacing.is_some()),
        ("--iso-direction", args.iso_direction != "auto"),
        ("--iso-metric", args.iso_metric != "paper"),
        ("--iso-levels", args.iso_levels != 1),
        ("--shade", args.shade.is_some()),
        ("--shadows", args.shadows),
        ("--fill", args.fill.is_some()),
        ("--fill-angle", args.fill_angle.is_some()),
        ("--fill-pitch", args.fill_pitch.is_some()),
        ("--fill-gap", args.fill_gap.is_some()),
        ("--light", args.light != "-1,1,1"),
        ("--crease-angle", args.crease_angle.is_some()),
        ("--hidden", args.hidden.is_some()),
        ("--halo", args.halo != 0.0),
        ("--qi", args.qi.is_some()),
        ("--visibility", args.visibility != "rays"),
        ("--time-limit", args.time_limit.is_some()),
    ];
    given.into_iter().find_map(|(option, is_given)| is_given.then_some(option))
}
