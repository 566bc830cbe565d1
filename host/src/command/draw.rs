//! `penvis draw`: a model becomes files.

use std::path::{Path, PathBuf};
use std::time::Instant;

use crate::args::DrawArgs;
use crate::compute::{compute, load, summary};
use crate::device::Device;
use crate::drawing::Drawing;
use crate::emit::{self, EmitError, Format, RegionFormat};
use crate::error::Error;
use crate::interrupt;
use crate::model::View;
use crate::options::{DrawOptions, Output};
use crate::output;
use crate::progress::Progress;
use crate::redraw::{Plotters, Redraw, RedrawError};
use crate::render;
use crate::stats::Stats;

/// Computes the drawing, makes all files, and writes them when all are made. Says in a line what was drawn.
///
/// # Errors
/// [`Error`]: what is wrong with the command line, a model, the view, an output or a folder.
pub fn run(args: &DrawArgs) -> Result<(), Error> {
    let started = Instant::now();
    let redraw = Redraw::new(&args.models, &args.drawing)?;
    let of_surfaces = [(args.render, "--render"), (args.emit_regions.is_some(), "--emit-regions")];
    if let (Some(_), Some((_, option)), [file, ..]) = (&redraw, of_surfaces.into_iter().find(|o| o.0), &args.models[..])
    {
        return Err(RedrawError::Surfaces { option, file: file.clone() }.into());
    }
    let options = match &redraw {
        Some(redraw) => DrawOptions::new(&DrawArgs { drawing: redraw.args().clone(), ..args.clone() })?,
        None => DrawOptions::new(args)?,
    };
    let progress = Progress::start();
    let path = options.order.path(&options.estimated);
    let plotters = Plotters { gcode: &options.gcode, hpgl: &options.hpgl };
    let curved =
        options.outputs.iter().any(|o| o.format == Format::Gcode) && options.order.arcs.in_file(&options.gcode);
    let mut computed = match &redraw {
        Some(redraw) => redraw.compute(&options.drawing, path, curved, plotters, &progress, |page| {
            options.check_page(page)?;
            Ok(options.reach(page))
        })?,
        None if options.render => return render(&options, progress),
        None => {
            let loaded = load(&options.drawing, &progress)?;
            options.check_page(loaded.page())?;
            options.check_files(loaded.files())?;
            let reach = options.reach(loaded.page());
            compute(loaded.reaching(reach).curved(curved).along(path).with_regions(options.regions.is_some()))?
        }
    };

    progress.stage("writing");
    let emitting = Instant::now();
    let mut files = Vec::with_capacity(options.outputs.len() + 1);
    // Only arcs have a use for vertices that are as near to each other as theirs.
    let thinned = computed.drawing.thinned();
    let drawn = |gcode: bool| if gcode { &computed.drawing } else { thinned.as_ref() };
    for output in &options.outputs {
        let drawing = drawn(output.format == Format::Gcode);
        files.push((output.path.clone(), emit(output, drawing, &computed.view, &options)?));
        if output.format == Format::Hpgl {
            computed.notes.extend(by_hand(&output.path, drawing, &options.hpgl));
        }
    }
    if let (Some((path, format)), Some(shapes)) = (&options.regions, &computed.regions) {
        let shadows = computed.shadows.as_ref();
        let text = match format {
            RegionFormat::Svg => emit::regions_svg(shapes, shadows, &command_line()),
            RegionFormat::Json => emit::regions_json(shapes, shadows, &computed.view)
                .map_err(|source| Error::Json { path: path.clone(), source })?,
        };
        files.push((path.clone(), text.into_bytes()));
    }
    computed.seconds.emit = emitting.elapsed().as_secs_f64();
    computed.seconds.total = started.elapsed().as_secs_f64();
    let drawing = drawn(options.estimated.language.gcode().is_some());
    let stats = Stats::new(&computed.stats, computed.seconds, drawing, &options.estimated);
    if let Some(path) = &options.stats {
        let text = stats.json().map_err(|source| Error::Json { path: path.clone(), source })?;
        files.push((path.clone(), text.into_bytes()));
    }
    if interrupt::is_wanted() {
        return Err(Error::Interrupted { doing: "making the files".into() });
    }
    output::write_all(&files)?;
    drop(progress);

    eprintln!("{}", summary(&computed.drawing.name, &stats));
    if redraw.is_none() {
        eprintln!("{}", stats.visibility.summary());
    }
    if let Some(shapes) = &computed.regions {
        eprintln!("{}", shapes.summary());
    }
    if let Some(shadows) = &computed.shadows {
        eprintln!("{}", shadows.summary());
    }
    for note in &computed.notes {
        eprintln!("warning: {note}");
    }
    for warning in stats.warnings() {
        eprintln!("warning: {warning}; --stats FILE.json lists all");
    }
    Ok(())
}

/// Paints the surfaces instead. Says in a line what was painted.
fn render(options: &DrawOptions, progress: Progress) -> Result<(), Error> {
    let loaded = load(&options.drawing, &progress)?;
    options.check_files(loaded.files())?;
    let page = loaded.page();
    let path = || options.outputs.first().map(|o| o.path.clone()).unwrap_or_default();
    let fault = |source| Error::Emit { path: path(), source };
    let pixels = emit::Pixels::new(page, emit::RENDER_DPI).map_err(fault)?;
    let rendered = render::render(loaded, pixels, options.drawing.light)?;
    progress.stage("writing");
    let picture = emit::shaded(page, &pixels, &rendered.shades).map_err(fault)?;
    let files: Vec<_> = options.outputs.iter().map(|o| (o.path.clone(), picture.clone())).collect();
    if interrupt::is_wanted() {
        return Err(Error::Interrupted { doing: "making the files".into() });
    }
    output::write_all(&files)?;
    drop(progress);
    eprintln!("{}", rendered.summary());
    Ok(())
}

/// What was typed, as a shell would take it again.
fn command_line() -> String {
    let words = std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned());
    shell_words::join(std::iter::once("penvis".to_owned()).chain(words))
}

/// What is to be known of a file that takes more pens than the plotter holds.
fn by_hand(path: &Path, drawing: &Drawing, device: &Device) -> Option<String> {
    let last = drawing.polylines.iter().map(|polyline| polyline.pen).max().filter(|last| *last > device.pens)?;
    let (file, name, held) = (path.display(), &device.name, device.pens);
    Some(format!(
        "{file} takes pens up to {last}, and `{name}` holds {held}: `penvis plot` stops for the others, which not every program does"
    ))
}

/// The bytes of one output.
fn emit(output: &Output, drawing: &Drawing, view: &View, options: &DrawOptions) -> Result<Vec<u8>, Error> {
    let path = || -> PathBuf { output.path.clone() };
    let made: Result<Vec<u8>, EmitError> = match output.format {
        Format::Svg => Ok(emit::svg(drawing, Some(&command_line())).into_bytes()),
        Format::Gcode => emit::gcode(drawing, &options.gcode).map(String::into_bytes),
        Format::Hpgl => emit::hpgl(drawing, &options.hpgl).map(String::into_bytes),
        Format::Png => emit::png(drawing, options.show_travel),
        Format::Json => {
            let text = emit::json(drawing, view).map_err(|source| Error::Json { path: path(), source })?;
            Ok(text.into_bytes())
        }
    };
    made.map_err(|source| Error::Emit { path: path(), source })
}
