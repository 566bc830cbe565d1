//! `penvis plot`: streams a job to a plotter, or to the simulated one.

mod port;
mod preflight;
mod resume;

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use thiserror::Error as ThisError;

use super::ink;
use crate::args::{DrawingArgs, PathArgs, say_nothing};
use crate::compute::{Computed, compute, duration_text, load, summary};
use crate::device::{self, ARC_TOLERANCE_MM, Device, Handshake, Language, PlaceError};
use crate::drawing::Page;
use crate::emit::{self, Format};
use crate::error::Error;
use crate::journal::JournalError;
use crate::options::{Arcs, DrawingOptions, OptionError, OrderOptions};
use crate::progress::Progress;
use crate::protocol::{self, Conversation, JobError, Protocol, Unit};
use crate::redraw::{Plotters, Redraw};
use crate::resume::Whole;
use crate::sim::{Fault, FaultError, Faults, PeerError, Recording, SimName, SimPort, Traffic};
use crate::stats::Stats;
use crate::stream::{self, Course, Interface, StreamError, User};
use crate::trace::gcode::{Machine, chorded};

pub(super) use port::open;
pub use resume::ResumeError;

/// Arguments of `penvis plot`.
#[derive(Clone, Debug, clap::Args)]
pub struct PlotArgs {
    /// Built-in models (`penvis info --list`), model files or scenes, several as one; or drawings: .svg, .json, .gcode, .nc, .hpgl, .plt. One file in
    /// the plotter's language goes as it is, unless an option of the drawing or of the path of the pen other than --arcs is given; then, and for a plotter of another language, it
    /// is laid out anew
    #[arg(required_unless_present = "resume", value_name = "MODEL|FILE")]
    pub jobs: Vec<String>,
    /// Serial port (`penvis ports`), or `sim` for a simulated plotter with penvis's firmware, `sim:grbl`, `sim:marlin` and
    /// `sim:hpgl7475a` for ones like others; options of it follow after commas, such as `sim:grbl,$32=1`
    #[arg(long, value_name = "PORT")]
    pub port: String,
    /// Plotter (`penvis devices`), or the path of a profile ending in .toml [default: grbl-servo; penvis with --port sim, and others
    /// of these ports their own; hp7475a for HPGL files]
    #[arg(long, value_name = "NAME")]
    pub device: Option<String>,
    /// Speed of the line [default: the device's]
    #[arg(long, value_name = "BAUD", value_parser = clap::value_parser!(u32).range(1..))]
    pub baud: Option<u32>,
    /// Only say what would go wrong with the job, and draw nothing
    #[arg(long, conflicts_with = "resume")]
    pub preflight: bool,
    /// GRBL: let the controller read the whole job before it draws, in its check mode, and say which lines it refuses
    #[arg(long, conflicts_with = "resume")]
    pub check: bool,
    /// HPGL: how the plotter's buffer is kept from overflowing [default: the device's, which is auto where it says nothing;
    /// with --resume, as the plot was begun]
    #[arg(long, value_name = "NAME")]
    pub handshake: Option<Handshake>,
    /// With --port sim: file for what the simulated plotter drew, .svg or .png [default: JOB-ink.svg in the current folder]
    #[arg(long, value_name = "FILE")]
    pub sim_out: Option<PathBuf>,
    /// With --port sim: what goes wrong, NAME or NAME@N, of lost, doubled, corrupted (a byte to the plotter; lost-answer and so on: from
    /// it), delayed-ok, missing-ok, error, alarm, reset, unplug, stall, pen-change. N counts from 1: bytes to the plotter, with -answer
    /// those from it, with -ok acknowledgements
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub fault: Vec<String>,
    /// With --fault: decides where faults happen that say no N, and how
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    pub seed: u64,
    /// Go on with a plot that was broken off, from its journal: that of the job named, or the one in the current folder
    #[arg(long, conflicts_with_all = ["DrawingArgs", "PathArgs", "device", "sim_out", "fault"])]
    pub resume: bool,
    /// With --resume: draw so much of a stroke that was broken off again
    #[arg(long, value_name = "MM", requires = "resume", default_value_t = 0.0)]
    pub overlap: f64,
    /// With --resume: the pen is at the zero of the drawing, where the plotter was switched on or brought by hand
    #[arg(long, requires = "resume")]
    pub at_zero: bool,
    /// Discard the journal of a plot of this name that was broken off, and begin anew
    #[arg(long, conflicts_with = "resume")]
    pub restart: bool,
    /// Tell how the plot goes as JSON on standard output, an object a line
    #[arg(long)]
    pub json: bool,
    /// What is drawn of a model, and on which paper
    #[command(flatten)]
    pub drawing: DrawingArgs,
    /// The order of strokes of a model
    #[command(flatten)]
    pub path: PathArgs,
}

/// Why a job was not plotted.
#[derive(Debug, ThisError)]
#[non_exhaustive]
pub enum PlotError {
    /// The model cannot be drawn, or what the simulated plotter drew cannot be written.
    #[error(transparent)]
    Drawing(#[from] Error),
    /// A job with something wrong in it.
    #[error("{name}: {what}; nothing was sent that moves")]
    Preflight {
        /// The job.
        name: String,
        /// The first thing that is wrong, with its place.
        what: String,
    },
    /// `--check` with a plotter that has no check mode.
    #[error("--check is for GRBL, and `{device}` speaks {speaks}; leave it out")]
    Check {
        /// The device.
        device: String,
        /// What it speaks.
        speaks: &'static str,
    },
    /// `--handshake` with a plotter that has a handshake of its own.
    #[error("--handshake is for HPGL plotters, and `{device}` speaks {speaks}; leave it out")]
    Handshake {
        /// The device.
        device: String,
        /// What it speaks.
        speaks: &'static str,
    },
    /// `--sim-out` or `--fault` with a real plotter.
    #[error("{option} is for the simulated plotter; leave it out, or plot with --port sim")]
    OnlySim {
        /// The option.
        option: &'static str,
    },
    /// The picture cannot be where it is asked for.
    #[error("--sim-out {path}: {problem}", path = path.display())]
    SimOutPath {
        /// The file asked for.
        path: PathBuf,
        /// Why not.
        problem: &'static str,
    },
    /// No such simulated plotter.
    #[error(transparent)]
    Peer(#[from] PeerError),
    /// No such fault.
    #[error(transparent)]
    Fault(#[from] FaultError),
    /// A file that is neither a job nor a drawing nor a model.
    #[error(
        "{file} is a picture and no job for a plotter; those end in .gcode, .nc, .hpgl or .plt, and drawings in .svg or .json"
    )]
    Kind {
        /// The file.
        file: String,
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
    #[error(
        "{name}: {unit} {number} waits for its user, who is to change the pen, and standard input is no terminal; plot it from one"
    )]
    Pause {
        /// The job.
        name: String,
        /// What is counted.
        unit: Unit,
        /// Number of the first that waits.
        number: usize,
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
    /// The journal cannot be kept or read.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// A plot that was broken off cannot go on.
    #[error(transparent)]
    Resume(#[from] ResumeError),
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
    /// A simulated plotter, with faults, and the picture of what it draws.
    Sim { port: Box<SimPort>, faults: Vec<Fault>, ink: PathBuf },
    /// A real port.
    Port(&'a str),
}

/// Streams the job to its end and says what was done. Returns only when everything was acknowledged and the pen rests.
///
/// # Errors
/// [`PlotError`]: what is wrong with the command line or the job, or what went wrong on the way. No file is left behind then.
pub fn run(args: &PlotArgs) -> Result<(), PlotError> {
    if args.resume {
        return resume::run(args);
    }
    let named = file(&args.jobs)?;
    let format = named.and_then(Format::of_path);
    let sim = SimName::parse(&args.port).transpose()?;
    let profile = args.device.as_deref().unwrap_or(default_device(sim.as_ref(), format));
    let mut device = device::find(profile).map_err(Error::from)?;
    choose_handshake(&mut device, args.handshake)?;
    let file = named.filter(|file| speaks(&device, file) && say_nothing(&args.drawing, &args.path));
    if args.check && !matches!(device.language, Language::Grbl(_)) {
        return Err(PlotError::Check { device: device.name.clone(), speaks: device.language.name() });
    }
    let baud = args.baud.unwrap_or(device.baud);
    let destination = destination(args, sim.as_ref(), &device, baud)?;
    let journal = port::journal_path(&args.jobs, file);
    // Said before the drawing is computed rather than after it.
    if let (Destination::Port(_), false, true) = (&destination, args.restart, journal.exists()) {
        return Err(JournalError::Unfinished { path: journal }.into());
    }
    let job = match file {
        Some(path) => without_arcs(read(path)?, args.path.arcs, &device)?,
        None => draw(args, &device)?,
    };
    let bad = |source| PlotError::Job { name: job.name.clone(), source };
    let conversation = protocol::start(&job.bytes, &device, baud).map_err(bad)?;
    preflight::report(&job, &crate::preflight::job(&job.bytes, &device))?;
    match destination {
        Destination::Sim { mut port, faults, ink } => {
            if args.preflight || args.check {
                let clock = port.clock();
                preflight::ask(port.as_mut(), &clock, &job, &device, args.check)?;
            }
            if args.preflight {
                return Ok(());
            }
            let expected = match &sim {
                Some(sim) if faults.iter().any(|fault| fault.at.is_none()) => {
                    undisturbed(&job, &device, SimPort::with(sim.peer(&device)?, baud), baud)?
                }
                _ => Traffic::default(),
            };
            let faults = Faults::new(&faults, args.seed, expected);
            let course = Course::new(Whole::new(&job.bytes, &device).map_err(bad)?.steps());
            let interface = Interface::new(User::Absent, course, args.json);
            simulate(&job, conversation, &device, *port, faults, &ink, interface)
        }
        Destination::Port(path) => {
            let mut profile = device::resolved_toml(profile).map_err(Error::from)?;
            if let Some(handshake) = args.handshake {
                profile = device::with_handshake(&profile, handshake).map_err(Error::from)?;
            }
            let line = port::Line { path, baud, device: &device };
            if args.preflight {
                return port::ask(&job, &line, args.check);
            }
            let wish = port::Wish { restart: args.restart, json: args.json, check: args.check };
            port::plot(&job, conversation, &line, wish, profile, &journal)
        }
    }
}

/// The file for a plotter, if it is the only job.
fn file(jobs: &[String]) -> Result<Option<&Path>, PlotError> {
    let format = |job: &String| Format::of_path(Path::new(job));
    if let Some(file) = jobs.iter().find(|job| format(job) == Some(Format::Png)) {
        return Err(PlotError::Kind { file: file.clone() });
    }
    match jobs {
        [job] if matches!(format(job), Some(Format::Gcode | Format::Hpgl)) => Ok(Some(Path::new(job))),
        _ => Ok(None),
    }
}

/// Whether a file is in the language of a device, so that it can go to it as it is.
fn speaks(device: &Device, file: &Path) -> bool {
    match device.language {
        Language::Grbl(_) | Language::Marlin(_) => Format::of_path(file) == Some(Format::Gcode),
        Language::Hpgl(_) => Format::of_path(file) == Some(Format::Hpgl),
    }
}

/// Has an HPGL plotter's buffer kept from overflowing as the user says, if the user says so.
fn choose_handshake(device: &mut Device, handshake: Option<Handshake>) -> Result<(), PlotError> {
    match (&mut device.language, handshake) {
        (_, None) => {}
        (Language::Hpgl(language), Some(handshake)) => language.handshake = handshake,
        (language, Some(_)) => {
            return Err(PlotError::Handshake { device: device.name.clone(), speaks: language.name() });
        }
    }
    Ok(())
}

fn default_device(sim: Option<&SimName>, format: Option<Format>) -> &'static str {
    match (sim, format) {
        (Some(sim), _) => sim.default_device(),
        (None, Some(Format::Hpgl)) => device::DEFAULT_HPGL,
        (None, _) => device::DEFAULT,
    }
}

fn destination<'a>(
    args: &'a PlotArgs,
    sim: Option<&SimName>,
    device: &Device,
    baud: u32,
) -> Result<Destination<'a>, PlotError> {
    let Some(sim) = sim else {
        return if args.sim_out.is_some() {
            Err(PlotError::OnlySim { option: "--sim-out" })
        } else if !args.fault.is_empty() {
            Err(PlotError::OnlySim { option: "--fault" })
        } else {
            Ok(Destination::Port(&args.port))
        };
    };
    let faults = args.fault.iter().map(|fault| fault.parse()).collect::<Result<Vec<Fault>, _>>()?;
    let port = Box::new(SimPort::with(sim.peer(device)?, baud));
    let ink = args.sim_out.clone().unwrap_or_else(|| ink_name(&args.jobs));
    // Said before the plot rather than after it.
    match ink::problem(&ink) {
        Some(problem) => Err(PlotError::SimOutPath { path: ink, problem }),
        None => Ok(Destination::Sim { port, faults, ink }),
    }
}

/// Where the picture goes when nothing is said: into the current folder, under the names of the jobs.
fn ink_name(jobs: &[String]) -> PathBuf {
    PathBuf::from(format!("{}-ink.svg", stems(jobs)))
}

/// The names of the jobs without folders and extensions, as one.
fn stems(jobs: &[String]) -> String {
    let stem = |job: &String| {
        let path = Path::new(job);
        path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
    };
    jobs.iter().map(stem).collect::<Vec<_>>().join("-")
}

/// Draws models, or drawings, in the language of the device.
fn draw(args: &PlotArgs, device: &Device) -> Result<Job, PlotError> {
    let redraw = Redraw::new(&args.jobs, &args.drawing)?;
    let drawing_args = redraw.as_ref().map_or(&args.drawing, Redraw::args);
    let options = DrawingOptions::new(&args.jobs, drawing_args).map_err(Error::from)?;
    let order = OrderOptions::new(&args.path).map_err(Error::from)?;
    let path = order.path(device);
    // Said before the drawing is computed rather than after it.
    if let Some(page) = options.stated_page() {
        device.place(page).map_err(PlotError::Place)?;
    }
    let progress = Progress::start();
    let reach = |page| -> Result<_, Error> { Ok(Some(device.place(page).map_err(OptionError::from)?.reach())) };
    let curved = order.arcs.on_line(device);
    let Computed { drawing, stats, seconds, notes, .. } = match &redraw {
        Some(redraw) => {
            // A file in another language is for a common plotter of that.
            let [gcode, hpgl] = [device::DEFAULT, device::DEFAULT_HPGL].map(device::find);
            let (gcode, hpgl) = (gcode.map_err(Error::from)?, hpgl.map_err(Error::from)?);
            let plotters = match device.language {
                Language::Grbl(_) | Language::Marlin(_) => Plotters { gcode: device, hpgl: &hpgl },
                Language::Hpgl(_) => Plotters { gcode: &gcode, hpgl: device },
            };
            redraw.compute(&options, path, curved, plotters, &progress, reach)?
        }
        None => {
            let loaded = load(&options, &progress)?;
            let reach = reach(loaded.page())?;
            compute(loaded.reaching(reach).curved(curved).along(path))?
        }
    };
    drop(progress);
    let name = drawing.name.clone();
    let made = match device.language {
        Language::Grbl(_) | Language::Marlin(_) => emit::gcode(&drawing, device),
        Language::Hpgl(_) => emit::hpgl(&drawing, device),
    };
    let text = made.map_err(|source| Error::Emit { path: PathBuf::from(&name), source })?;
    let stats = Stats::new(&stats, seconds, &drawing, device);
    eprintln!("{}", summary(&name, &stats));
    for warning in notes.into_iter().chain(stats.warnings()) {
        eprintln!("warning: {warning}");
    }
    Ok(Job { name, bytes: text.into_bytes(), page: Some(drawing.page) })
}

/// Reads a file that goes to the plotter as it is.
fn read(path: &Path) -> Result<Job, PlotError> {
    let file = path.display().to_string();
    match fs::read(path) {
        Ok(bytes) => Ok(Job { name: file, bytes, page: None }),
        Err(source) => Err(PlotError::Read { file, source }),
    }
}

/// Has the arcs of a job go as chords where they are not to go over the line, and says so.
fn without_arcs(mut job: Job, arcs: Arcs, device: &Device) -> Result<Job, PlotError> {
    let Some(language) = device.language.gcode().filter(|_| !arcs.on_line(device)) else { return Ok(job) };
    let chorded = chorded(&job.bytes, language.line_limit, &Machine::new(device, language))
        .map_err(|source| PlotError::Job { name: job.name.clone(), source: source.into() })?;
    let count = |count: usize| if count == 1 { "1 arc".to_owned() } else { format!("{count} arcs") };
    let asked_for = arcs == Arcs::Off || !language.arcs;
    if chorded.arcs > 0 {
        let why = if asked_for {
            ""
        } else {
            ": what is changed in an arc on the line might not be noticed (--arcs on sends arcs)"
        };
        eprintln!("{}: {} sent as chords, {ARC_TOLERANCE_MM} mm away at the most{why}", job.name, count(chorded.arcs));
    }
    if let Some(first) = chorded.left.first() {
        let what = if asked_for { "" } else { ", and what is changed in them on the line is not noticed" };
        eprintln!(
            "{}: warning: {} sent as in the file, the first in line {first}{what}; to be written as chords they need G20 or G21, G90 or G91, \
             the plane of the paper and a known place to begin",
            job.name,
            count(chorded.left.len())
        );
    }
    job.bytes = chorded.job;
    Ok(job)
}

/// What goes over the line when nothing goes wrong with a job: a fault whose place a seed decides is to fall within it.
fn undisturbed(job: &Job, device: &Device, mut port: SimPort, baud: u32) -> Result<Traffic, PlotError> {
    let name = &job.name;
    let mut conversation =
        protocol::start(&job.bytes, device, baud).map_err(|source| PlotError::Job { name: name.clone(), source })?;
    let clock = port.clock();
    stream::run(&mut port, conversation.protocol.as_mut(), &clock, &mut preflight::Unwatched)
        .map_err(|source| PlotError::Stream { name: name.clone(), source })?;
    Ok(port.traffic())
}

/// Plots on the simulated plotter, and writes the picture of what it drew: of a job that fails only if it was to go wrong.
fn simulate(
    job: &Job,
    mut conversation: Conversation,
    device: &Device,
    mut port: SimPort,
    faults: Faults,
    path: &Path,
    mut interface: Interface,
) -> Result<(), PlotError> {
    let page = job.page.unwrap_or_else(|| device.whole_page());
    let placement = device.place(page).map_err(PlotError::Place)?;
    let disturbed = !faults.is_empty();
    port.set_faults(faults);
    let clock = port.clock();
    let protocol = conversation.protocol.as_mut();
    interface.start(&job.name, protocol.place().unit, protocol.progress().total, 0);
    let result = stream::run(&mut port, protocol, &clock, &mut interface);
    interface.end(result.as_ref().err().map(ToString::to_string).as_deref());
    drop(interface);
    let result = result.map_err(|source| PlotError::Stream { name: job.name.clone(), source });
    if disturbed {
        match port.faults().struck() {
            [] => eprintln!("none of the faults happened"),
            struck => struck.iter().for_each(|fault| eprintln!("fault {fault}")),
        }
    } else if result.is_err() {
        return result;
    }
    let recording = port.recording();
    ink::write(&recording, &job.name, page, &placement, path)?;
    eprintln!("{}", simulated(&job.name, conversation.protocol.as_ref(), &recording));
    eprintln!("what it drew is in {}", path.display());
    result
}

/// The line that says what the simulated plotter did.
fn simulated(name: &str, protocol: &dyn Protocol, recording: &Recording) -> String {
    let (pieces, unit) = (protocol.progress().total, protocol.place().unit);
    format!(
        "{name}: {pieces} {unit}s, {:.0} mm of ink, {:.0} mm of travel, {} lifts, {} of plotting (simulated)",
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
    fn a_simulated_grbl_draws_too_and_what_goes_wrong_is_drawn_as_it_was() {
        let (folder, job) = folder_with("square.gcode", SQUARE);
        let out = folder.path().join("ink.svg");
        let sim = ["--port", "sim:grbl,$120=900", "--sim-out", out.to_str().unwrap()];
        let words = |fault: &[&'static str]| [&[job.as_str()], &sim[..], fault].concat();
        plotted(&words(&[])).unwrap();
        let whole = fs::read_to_string(&out).unwrap();
        assert_eq!(whole.matches("<path").count(), 1, "{whole}");
        let message = plotted(&words(&["--fault", "reset@80"])).unwrap_err().to_string();
        assert!(message.contains("restarted"), "{message}");
        assert_ne!(fs::read_to_string(&out).unwrap(), whole);
    }

    #[test]
    fn a_job_stays_what_it_is_however_its_arcs_go() {
        let args = |words: &[&str]| {
            Line::try_parse_from(["plot", "a.gcode", "--port", "sim"].iter().chain(words)).unwrap().args
        };
        for (words, stays) in [
            (&[][..], true),
            (&["--arcs", "on"], true),
            (&["--arcs", "off"], true),
            (&["--merge", "0"], false),
            (&["--paper", "a4"], false),
        ] {
            let PlotArgs { drawing, path, .. } = args(words);
            assert_eq!(say_nothing(&drawing, &path), stays, "{words:?}");
        }
    }

    #[test]
    fn arcs_of_a_file_go_over_lines_that_are_checked() {
        let arcs = "G21\nG90\nG0X10Y10\nM3S1000\nG2X14Y10I2J0F2000\nM3S0\n";
        let sent = |arcs_are: Arcs, name: &str| {
            let job = Job { name: "arcs".into(), bytes: arcs.into(), page: None };
            String::from_utf8(without_arcs(job, arcs_are, &device::find(name).unwrap()).unwrap().bytes).unwrap()
        };
        for (arcs_are, name) in [(Arcs::On, "grbl-servo"), (Arcs::On, "marlin-servo"), (Arcs::Auto, "marlin-servo")] {
            assert_eq!(sent(arcs_are, name), arcs);
        }
        for (arcs_are, name) in [(Arcs::Auto, "grbl-servo"), (Arcs::Auto, "penvis"), (Arcs::Off, "marlin-servo")] {
            let chords = sent(arcs_are, name);
            // A half circle of 2 mm, in lines of one number.
            assert!(!chords.contains("G2X") && chords.matches('\r').count() > 20, "{name}: {chords}");
            assert_eq!(chords.matches('\n').count(), arcs.matches('\n').count());
        }
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
        let (folder, job) = folder_with("bad.nc", "G21\nG1X10F600\nG1Y3Y4\n");
        let out = folder.path().join("ink.svg");
        let message = plotted(&[&job, "--port", "sim", "--sim-out", out.to_str().unwrap()]).unwrap_err().to_string();
        assert!(
            message.contains("bad.nc: ") && message.contains("line 3") && message.contains("error 25"),
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
        let five = folder.path().join("five.gcode");
        fs::write(&five, "G21\nG5X1\n").unwrap();
        let five = five.to_str().unwrap();
        let table: &[(&[&str], &str)] = &[
            (&[&gcode, "--port", "/dev/nowhere"], "cannot open the port /dev/nowhere"),
            (&[&gcode, "--port", "/dev/nowhere", "--sim-out", "a.svg"], "--sim-out is for the simulated plotter"),
            (&[&gcode, "--port", "/dev/nowhere", "--fault", "lost"], "--fault is for the simulated plotter"),
            (&[&gcode, "--port", "sim", "--fault", "reset,lots"], "there is no fault `lots`"),
            (&[&gcode, "--port", "sim:lots"], "no simulated plotter `lots`"),
            (&[&gcode, "--port", "sim", "--sim-out", "a.gcode"], "ends in .svg or .png"),
            (&[&gcode, "--port", "sim", "--sim-out", "nowhere/a.svg"], "there is no such folder"),
            (&[&gcode, "--port", "sim", "--device", "hp7475a"], "plot with --device penvis"),
            (&[hpgl, "--port", "sim"], "draws nothing"),
            (&[&gcode, "--port", "sim", "--scale", "99:1"], "does not fit inside the margins"),
            (&[&gcode, "--port", "sim", "--iso", "3"], "--iso is for models"),
            (&[&gcode, "--port", "sim", "--device", "nobody"], "there is no device `nobody`"),
            (&[&gcode, "--port", "sim:marlin", "--check"], "--check is for GRBL, and `marlin"),
            (&[five, "--port", "sim"], "line 2 has G5, which grbl does not know"),
            (&[&gcode, "--port", "sim:grbl,$32=1", "--preflight"], "laser mode ($32=1)"),
            (&[&gcode, "--port", "sim", "--handshake", "esc-b"], "--handshake is for HPGL plotters"),
            (&["a.png", "--port", "sim"], "a.png is a picture and no job"),
            (&["teapot", &gcode, "--port", "sim"], "is a drawing, and teapot is none"),
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
        let device = |port, format| default_device(SimName::parse(port).transpose().unwrap().as_ref(), format);
        assert_eq!(device("sim", None), "penvis");
        assert_eq!(device("sim:grbl", None), "grbl-servo");
        assert_eq!(device("/dev/ttyUSB0", Some(Format::Gcode)), "grbl-servo");
        assert_eq!(device("/dev/ttyUSB0", Some(Format::Hpgl)), "hp7475a");
    }
}
