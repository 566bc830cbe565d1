//! `penvis plot`: streams a job to a plotter, or to the simulated one.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use penvis_firmware::Settings;
use serialport::FlowControl;
use thiserror::Error as ThisError;

use crate::args::DrawingArgs;
use crate::compute::{Computed, compute, duration_text, load, summary};
use crate::device::{self, Device, Flow, Gcode, Language, PlaceError};
use crate::drawing::Page;
use crate::emit::{self, Format};
use crate::error::Error;
use crate::options::{DrawingOptions, folder};
use crate::output;
use crate::progress::Progress;
use crate::protocol::{self, Conversation, JobError};
use crate::sim::{Recording, SimPort};
use crate::stats::Stats;
use crate::stream::{self, Clock, StreamError, Terminal, User, WallClock};

/// Name of the port with the simulated plotter.
const SIM: &str = "sim";

/// Device of the simulated port, when none is asked for.
const SIM_DEVICE: &str = "penvis";

/// Device for HPGL files, when none is asked for.
const HPGL_DEVICE: &str = "hp7475a";

/// Width of the pen in the picture of what the simulated plotter drew, mm.
const SIM_PEN_MM: f64 = 0.3;

/// Arguments of `penvis plot`.
#[derive(Clone, Debug, clap::Args)]
pub struct PlotArgs {
    /// Built-in models (`penvis info --list`), model files or scenes, several as one; or one file for a plotter: .gcode, .nc, .hpgl, .plt
    #[arg(required = true, value_name = "MODEL|FILE")]
    pub jobs: Vec<String>,
    /// Serial port (`penvis ports`), or `sim` for a simulated plotter
    #[arg(long, value_name = "PORT")]
    pub port: String,
    /// Plotter (`penvis devices`), or the path of a profile ending in .toml [default: grbl-servo; penvis with --port sim; hp7475a for HPGL files]
    #[arg(long, value_name = "NAME")]
    pub device: Option<String>,
    /// Speed of the line [default: the device's]
    #[arg(long, value_name = "BAUD", value_parser = clap::value_parser!(u32).range(1..))]
    pub baud: Option<u32>,
    /// With --port sim: file for what the simulated plotter drew, .svg or .png [default: JOB-ink.svg in the current folder]
    #[arg(long, value_name = "FILE")]
    pub sim_out: Option<PathBuf>,
    /// What is drawn of a model, and on which paper
    #[command(flatten)]
    pub drawing: DrawingArgs,
}

/// Why a job was not plotted.
#[derive(Debug, ThisError)]
#[non_exhaustive]
pub enum PlotError {
    /// The model cannot be drawn, or what the simulated plotter drew cannot be written.
    #[error(transparent)]
    Drawing(#[from] Error),
    /// `--sim-out` with a real plotter.
    #[error("--sim-out is for the simulated plotter; leave it out, or plot with --port sim")]
    SimOutWithoutSim,
    /// Not a picture.
    #[error("--sim-out {path}: give a name that ends in .svg or .png", path = path.display())]
    SimOutKind {
        /// The file asked for.
        path: PathBuf,
    },
    /// The picture cannot be where it is asked for.
    #[error("--sim-out {path}: {problem}", path = path.display())]
    SimOutPath {
        /// The file asked for.
        path: PathBuf,
        /// Why not.
        problem: &'static str,
    },
    /// An HPGL plotter is not simulated.
    #[error("the simulated plotter speaks G-code and `{device}` speaks {speaks}; plot with --device {SIM_DEVICE}")]
    SimLanguage {
        /// The device asked for.
        device: String,
        /// What it speaks.
        speaks: &'static str,
    },
    /// A file of another language.
    #[error(
        "{file} is not in the language of `{device}`, {speaks}; choose another --device (`penvis devices` lists them)"
    )]
    Language {
        /// The job.
        file: String,
        /// The device.
        device: String,
        /// What it speaks.
        speaks: &'static str,
    },
    /// A file that is neither a job nor a model.
    #[error("{file} is no job for a plotter; those end in .gcode, .nc, .hpgl or .plt, and models in .json")]
    Kind {
        /// The file.
        file: String,
    },
    /// A file among others.
    #[error("{file} is plotted by itself; give it without {other}")]
    Several {
        /// The file.
        file: String,
        /// What else was given.
        other: String,
    },
    /// A job that cannot be read.
    #[error("{file} cannot be read: {source}")]
    Read {
        /// The file.
        file: String,
        /// What the system said.
        source: io::Error,
    },
    /// A job that must not be sent.
    #[error("{name}: {source}")]
    Job {
        /// The job.
        name: String,
        /// Why not.
        source: JobError,
    },
    /// Nobody is there to change the pen.
    #[error("{name}: line {line} waits for its user (M0), and standard input is no terminal; plot it from one")]
    Pause {
        /// The job.
        name: String,
        /// The line.
        line: usize,
    },
    /// The page does not fit.
    #[error(transparent)]
    Place(#[from] PlaceError),
    /// The port cannot be opened.
    #[error("cannot open the port {port}: {source}; `penvis ports` lists the ports, and --port sim needs none")]
    Open {
        /// The port.
        port: String,
        /// What the system said.
        source: serialport::Error,
    },
    /// It went wrong on the way.
    #[error("{name}: {source}")]
    Stream {
        /// The job.
        name: String,
        /// Why.
        source: StreamError,
    },
}

/// What is plotted.
struct Job {
    /// For messages.
    name: String,
    /// In the language of the device.
    bytes: Vec<u8>,
    /// The page it was made for, if that is known.
    page: Option<Page>,
}

/// Where a job goes.
#[derive(Debug)]
enum Destination<'a> {
    /// The simulated plotter, and the picture of what it draws.
    Sim { gcode: &'a Gcode, ink: PathBuf },
    /// A real port.
    Port(&'a str),
}

/// Streams the job to its end and says what was done. Returns only when everything was acknowledged and the pen rests.
///
/// # Errors
/// [`PlotError`]: what is wrong with the command line or the job, or what went wrong on the way. No file is left behind then.
pub fn run(args: &PlotArgs) -> Result<(), PlotError> {
    let file = file(&args.jobs)?;
    let format = file.and_then(Format::of_path);
    let device =
        device::find(args.device.as_deref().unwrap_or(default_device(&args.port, format))).map_err(Error::from)?;
    let destination = destination(args, &device)?;
    let job = match file {
        Some(path) => read(path, &device)?,
        None => draw(args, &device)?,
    };
    let baud = args.baud.unwrap_or(device.baud);
    let conversation = protocol::start(&job.bytes, &device, baud)
        .map_err(|source| PlotError::Job { name: job.name.clone(), source })?;
    match destination {
        Destination::Sim { gcode, ink } => simulate(&job, conversation, &device, gcode, baud, &ink),
        Destination::Port(port) => Ok(plot(&job, conversation, &device, baud, port)?),
    }
}

/// The file for a plotter among the jobs, which then must be the only one; none when they are models.
fn file(jobs: &[String]) -> Result<Option<&Path>, PlotError> {
    let format = |job: &String| Format::of_path(Path::new(job));
    if let Some(file) = jobs.iter().find(|job| matches!(format(job), Some(Format::Svg | Format::Png))) {
        return Err(PlotError::Kind { file: file.clone() });
    }
    let Some(file) = jobs.iter().find(|job| matches!(format(job), Some(Format::Gcode | Format::Hpgl))) else {
        return Ok(None);
    };
    match jobs.iter().position(|job| job == file).and_then(|at| jobs.get(if at == 0 { 1 } else { 0 })) {
        Some(other) => Err(PlotError::Several { file: file.clone(), other: other.clone() }),
        None => Ok(Some(Path::new(file))),
    }
}

fn default_device(port: &str, format: Option<Format>) -> &'static str {
    match format {
        Some(Format::Hpgl) => HPGL_DEVICE,
        _ if port == SIM => SIM_DEVICE,
        _ => device::DEFAULT,
    }
}

fn destination<'a>(args: &'a PlotArgs, device: &'a Device) -> Result<Destination<'a>, PlotError> {
    if args.port != SIM {
        return if args.sim_out.is_some() {
            Err(PlotError::SimOutWithoutSim)
        } else {
            Ok(Destination::Port(&args.port))
        };
    }
    let Language::Grbl(gcode) = &device.language else {
        return Err(PlotError::SimLanguage { device: device.name.clone(), speaks: device.language.name() });
    };
    let ink = args.sim_out.clone().unwrap_or_else(|| ink_name(&args.jobs));
    if !matches!(Format::of_path(&ink), Some(Format::Svg | Format::Png)) {
        return Err(PlotError::SimOutKind { path: ink });
    }
    // Said before the plot rather than after it.
    let problem = if !folder(&ink).is_dir() {
        Some("there is no such folder; make it first")
    } else if ink.exists() && !ink.is_file() {
        Some("is there, and is not a regular file; choose another name")
    } else {
        None
    };
    match problem {
        Some(problem) => Err(PlotError::SimOutPath { path: ink, problem }),
        None => Ok(Destination::Sim { gcode, ink }),
    }
}

/// Where the picture goes when nothing is said: into the current folder, under the names of the jobs.
fn ink_name(jobs: &[String]) -> PathBuf {
    let stem = |job: &String| {
        let path = Path::new(job);
        path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
    };
    PathBuf::from(format!("{}-ink.svg", jobs.iter().map(stem).collect::<Vec<_>>().join("-")))
}

/// Draws models in the language of the device.
fn draw(args: &PlotArgs, device: &Device) -> Result<Job, PlotError> {
    let options = DrawingOptions::new(&args.jobs, &args.drawing).map_err(Error::from)?;
    // Said before the drawing is computed rather than after it.
    if let Some(page) = options.stated_page() {
        device.place(page).map_err(PlotError::Place)?;
    }
    let progress = Progress::start();
    let loaded = load(&options, &progress)?;
    device.place(loaded.page()).map_err(PlotError::Place)?;
    let Computed { drawing, stats, seconds, .. } = compute(loaded)?;
    drop(progress);
    let name = drawing.name.clone();
    let made = match device.language {
        Language::Grbl(_) | Language::Marlin(_) => emit::gcode(&drawing, device),
        Language::Hpgl(_) => emit::hpgl(&drawing, device),
    };
    let text = made.map_err(|source| Error::Emit { path: PathBuf::from(&name), source })?;
    let stats = Stats::new(&stats, seconds, &drawing, device);
    eprintln!("{}", summary(&name, &stats));
    for warning in stats.warnings() {
        eprintln!("warning: {warning}");
    }
    Ok(Job { name, bytes: text.into_bytes(), page: Some(drawing.page) })
}

/// Reads a file in the language of the device.
fn read(path: &Path, device: &Device) -> Result<Job, PlotError> {
    let file = path.display().to_string();
    match (Format::of_path(path), &device.language) {
        (Some(Format::Gcode), Language::Grbl(_) | Language::Marlin(_)) | (Some(Format::Hpgl), Language::Hpgl(_)) => {}
        (_, language) => {
            return Err(PlotError::Language { file, device: device.name.clone(), speaks: language.name() });
        }
    }
    match fs::read(path) {
        Ok(bytes) => Ok(Job { name: file, bytes, page: None }),
        Err(source) => Err(PlotError::Read { file, source }),
    }
}

/// Plots on the simulated plotter, and writes the picture of what it drew.
fn simulate(
    job: &Job,
    mut conversation: Conversation,
    device: &Device,
    gcode: &Gcode,
    baud: u32,
    ink: &Path,
) -> Result<(), PlotError> {
    // A job whose page is unknown may use all of the plotter.
    let [width_mm, height_mm] = device.travel_mm.unwrap_or_default();
    let page = job.page.unwrap_or(Page { width_mm, height_mm });
    let placement = device.place(page).map_err(PlotError::Place)?;
    let mut port = SimPort::new(Settings::default(), &gcode.pen, baud);
    let clock = port.clock();
    stream::run(&mut port, conversation.protocol.as_mut(), &clock, &mut Terminal::new(User::Absent))
        .map_err(|source| PlotError::Stream { name: job.name.clone(), source })?;
    let recording = port.recording();
    let drawing = recording.drawing(&job.name, page, &placement);
    let picture = match Format::of_path(ink) {
        Some(Format::Png) => {
            emit::png(&drawing, SIM_PEN_MM).map_err(|source| Error::Emit { path: ink.to_owned(), source })?
        }
        _ => emit::svg(&drawing, SIM_PEN_MM).into_bytes(),
    };
    output::write_all(&[(ink.to_owned(), picture)])?;
    eprintln!("{}", simulated(&job.name, conversation.protocol.progress().total, &recording));
    eprintln!("what it drew is in {}", ink.display());
    Ok(())
}

/// Plots on a real plotter.
fn plot(job: &Job, mut conversation: Conversation, device: &Device, baud: u32, path: &str) -> Result<(), PlotError> {
    if let (Some(line), false) = (conversation.first_pause, Terminal::has_user()) {
        return Err(PlotError::Pause { name: job.name.clone(), line });
    }
    let flow = match device.flow {
        Flow::None => FlowControl::None,
        Flow::XonXoff => FlowControl::Software,
        Flow::RtsCts => FlowControl::Hardware,
    };
    let mut port = serialport::new(path, baud)
        .flow_control(flow)
        .open()
        .map_err(|source| PlotError::Open { port: path.to_owned(), source })?;
    let clock = WallClock::start();
    stream::run(port.as_mut(), conversation.protocol.as_mut(), &clock, &mut Terminal::new(User::Present))
        .map_err(|source| PlotError::Stream { name: job.name.clone(), source })?;
    let pieces = conversation.protocol.progress().total;
    let unit = conversation.protocol.place().unit;
    eprintln!("{}: {pieces} {unit}s plotted in {}", job.name, duration_text(clock.now()));
    Ok(())
}

/// The line that says what the simulated plotter did.
fn simulated(name: &str, lines: usize, recording: &Recording) -> String {
    format!(
        "{name}: {lines} lines, {:.0} mm of ink, {:.0} mm of travel, {} lifts, {} of plotting (simulated)",
        recording.ink_mm(),
        recording.travel_mm(),
        recording.lifts(),
        duration_text(Duration::try_from_secs_f64(recording.duration_s).unwrap_or_default()),
    )
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    #[derive(Parser)]
    struct Line {
        #[command(flatten)]
        args: PlotArgs,
    }

    fn plotted(words: &[&str]) -> Result<(), PlotError> {
        run(&Line::try_parse_from(["plot"].iter().chain(words)).unwrap().args)
    }

    /// A folder with a job in it.
    fn folder_with(name: &str, job: &str) -> (tempfile::TempDir, String) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        fs::write(&path, job).unwrap();
        let path = path.to_str().unwrap().to_owned();
        (folder, path)
    }

    const SQUARE: &str =
        "G21\nG90\nG0X10Y10\nM3S1000\nG4P0.2\nG1X30F2000\nG1Y30\nG1X10\nG1Y10\nM3S0\nG4P0.15\nG0X0Y0\nM5\n";

    #[test]
    fn the_ink_is_written_as_svg_and_png() {
        let (folder, job) = folder_with("square.gcode", SQUARE);
        for name in ["ink.svg", "ink.png"] {
            let out = folder.path().join(name);
            plotted(&[&job, "--port", "sim", "--sim-out", out.to_str().unwrap()]).unwrap();
            assert!(fs::metadata(&out).unwrap().len() > 100);
        }
        let svg = fs::read_to_string(folder.path().join("ink.svg")).unwrap();
        assert_eq!(svg.matches("<path").count(), 1, "{svg}");
    }

    #[test]
    fn a_model_is_drawn_and_plotted() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("ink.svg");
        plotted(&["saddle", "--iso", "2", "--port", "sim", "--sim-out", out.to_str().unwrap()]).unwrap();
        assert!(fs::read_to_string(out).unwrap().contains("width=\"297mm\" height=\"210mm\""));
    }

    #[test]
    fn nothing_is_left_of_a_job_that_fails() {
        let (folder, job) = folder_with("bad.nc", "G21\nG1X10F600\nG5Y3\n");
        let out = folder.path().join("ink.svg");
        let message = plotted(&[&job, "--port", "sim", "--sim-out", out.to_str().unwrap()]).unwrap_err().to_string();
        assert!(
            message.contains("bad.nc: ") && message.contains("line 3") && message.contains("error 20"),
            "{message}"
        );
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn what_makes_no_sense_is_refused_in_a_line() {
        let (folder, gcode) = folder_with("a.gcode", SQUARE);
        let hpgl = folder.path().join("a.plt");
        fs::write(&hpgl, "IN;").unwrap();
        let hpgl = hpgl.to_str().unwrap();
        let long = folder.path().join("long.gcode");
        fs::write(&long, format!("G1X{}\n", "1".repeat(90))).unwrap();
        let long = long.to_str().unwrap();
        let table: &[(&[&str], &str)] = &[
            (&[&gcode, "--port", "/dev/nowhere"], "cannot open the port /dev/nowhere"),
            (&[&gcode, "--port", "/dev/nowhere", "--sim-out", "a.svg"], "--sim-out is for the simulated plotter"),
            (&[&gcode, "--port", "sim", "--sim-out", "a.gcode"], "ends in .svg or .png"),
            (&[&gcode, "--port", "sim", "--sim-out", "nowhere/a.svg"], "there is no such folder"),
            (&[&gcode, "--port", "sim", "--device", "hp7475a"], "plot with --device penvis"),
            (&[hpgl, "--port", "sim"], "plot with --device penvis"),
            (&[hpgl, "--port", "sim", "--device", "penvis"], "not in the language of `penvis`, grbl"),
            (&[&gcode, "--port", "sim", "--device", "nobody"], "there is no device `nobody`"),
            (&["a.svg", "--port", "sim"], "a.svg is no job"),
            (&["teapot", &gcode, "--port", "sim"], "is plotted by itself; give it without teapot"),
            (&["no-such-model", "--port", "sim"], "no-such-model"),
            (&["teapot", "--port", "sim", "--paper", "a2"], "larger than the reach"),
            (&["gone.gcode", "--port", "sim"], "gone.gcode cannot be read"),
            (&[long, "--port", "sim"], "line 1 has 93 characters"),
        ];
        for (words, expected) in table {
            let message = plotted(words).unwrap_err().to_string();
            assert!(message.contains(expected) && !message.contains('\n'), "{words:?} gave {message:?}");
        }
    }

    #[test]
    fn the_picture_is_named_after_the_job() {
        assert_eq!(ink_name(&["teapot".into()]), Path::new("teapot-ink.svg"));
        assert_eq!(ink_name(&["some/where/job.gcode".into()]), Path::new("job-ink.svg"));
        assert_eq!(ink_name(&["a/x.json".into(), "torus".into()]), Path::new("x-torus-ink.svg"));
    }

    #[test]
    fn the_device_follows_the_port_and_the_file() {
        assert_eq!(default_device("sim", None), "penvis");
        assert_eq!(default_device("/dev/ttyUSB0", Some(Format::Gcode)), "grbl-servo");
        assert_eq!(default_device("/dev/ttyUSB0", Some(Format::Hpgl)), "hp7475a");
    }
}
