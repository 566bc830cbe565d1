//! `penvis plot --resume`: goes on with a plot that was broken off.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use glam::DVec3;
use serialport::SerialPort;
use thiserror::Error;

use super::port::{Line, Run, check_user, journal_path};
use super::{Job, PlotArgs, PlotError, choose_handshake, preflight};
use crate::device::{Device, Language, Pen};
use crate::error::Error;
use crate::journal::{self, EXTENSION, Journal};
use crate::protocol;
use crate::resume::locate::{Found, Locate};
use crate::resume::{Renumbered, Whole, way};
use crate::sim::SimName;
use crate::stream::{self, Course, Interface, Observer, User, WallClock};

/// A plotter that is farther than this from the way that its job has yet to go has lost its place, mm: a few steps.
const NEAR_MM: f64 = 0.05;

/// Pieces that a plotter may acknowledge between two notes in the journal, at the least length and at the speed of any line.
const PIECES_A_NOTE: usize = 1000;

/// A plotter that is nearer than this to where machines say they are when they are switched on may have been, mm.
const SWITCHED_ON_MM: f64 = 0.002;

/// What messages call the profile in a journal.
const PROFILE: &str = "in the journal";

/// Why a plot does not go on.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ResumeError {
    /// Nothing to go on with.
    #[error("there is no journal in this folder: name the job that was broken off, or its .{EXTENSION} file")]
    None,
    /// Several journals.
    #[error("there are several journals in this folder, {}: say which", names.join(", "))]
    Several {
        /// Their names.
        names: Vec<String>,
    },
    /// The folder cannot be read.
    #[error("the folder cannot be read: {0}; name the journal")]
    Folder(#[from] io::Error),
    /// The simulated plotter keeps none.
    #[error("--resume is for plotters that draw; a simulated plotter keeps no journal and begins anew")]
    Simulated,
    /// The overlap is no length.
    #[error("--overlap {0}: give a length in mm from 0 on")]
    Overlap(f64),
    /// Nobody knows where the pen is.
    #[error(
        "{name}: the plotter does not know where its pen is ({why}): bring the pen to the zero of the drawing, lift it, \
         and resume with --at-zero"
    )]
    Lost {
        /// The job.
        name: String,
        /// What it says.
        why: &'static str,
    },
    /// The job's own origin cannot be set by hand.
    #[error(
        "{name}: the job sets its own origin (G92), so that its zero is not known; home the plotter, or begin anew"
    )]
    OwnOrigin {
        /// The job.
        name: String,
    },
}

/// Reads the journal, finds out where the pen is, and sends what is left.
pub(super) fn run(args: &PlotArgs) -> Result<(), PlotError> {
    if SimName::parse(&args.port).is_some() {
        return Err(ResumeError::Simulated.into());
    }
    if !(args.overlap.is_finite() && args.overlap >= 0.0) {
        return Err(ResumeError::Overlap(args.overlap).into());
    }
    let path = find(&args.jobs)?;
    let contents = journal::read(&path)?;
    let name = contents.head.name.clone();
    let mut device = Device::from_toml(&contents.head.profile, PROFILE).map_err(Error::from)?;
    choose_handshake(&mut device, args.handshake)?;
    let job_error = |source| PlotError::Job { name: name.clone(), source };
    let whole = Whole::new(&contents.job, &device).map_err(job_error)?;
    let (executed, ahead, pen) = contents.last.map_or((0, 0, 1), |last| (last.executed, last.ahead as usize, last.pen));
    // A journal's pieces are those of a job in memory.
    let executed = usize::try_from(executed).unwrap_or(usize::MAX);
    let journal = Journal::reopen(&path, &contents)?;
    if executed as u64 == contents.head.pieces {
        eprintln!("{name}: all of it was plotted");
        return Ok(journal.remove()?);
    }
    // The profile may be read by a later version, and the plotter's settings changed since.
    let job = Job { name: name.clone(), bytes: contents.job.clone(), page: None };
    preflight::report(&job, &crate::preflight::job(&job.bytes, &device))?;
    let mut rest = whole.rest(executed, args.overlap, pen);
    let mut interface = Interface::new(User::Present, Course::new(whole.steps()), args.json);
    if let Language::Marlin(_) = device.language {
        for line in marlin_lines(&name, &whole, &device, args.at_zero, &mut interface)?.iter().rev() {
            rest.begin_with(line);
        }
    }
    let baud = args.baud.unwrap_or(contents.head.baud);
    let mut conversation = protocol::start(&rest.job, &device, baud).map_err(job_error)?;
    if whole.counts() {
        conversation.protocol = Box::new(Renumbered::new(conversation.protocol, &rest));
    }
    let line = Line { path: &args.port, baud, device: &device };
    let mut port = line.open()?;
    check_user(&name, &conversation, &interface)?;
    let pieces = contents.head.pieces;
    interface
        .say(&format!("{name}: {executed} of {pieces} pieces were plotted; going on behind piece {}", rest.skipped));
    if let Language::Grbl(_) = device.language {
        let settling = Settling { name: &name, whole: &whole, executed, ahead, line: &line, at_zero: args.at_zero };
        settling.settle(port.as_mut(), &mut interface)?;
    }
    preflight::ask(port.as_mut(), &WallClock::start(), &job, &device, false)?;
    Run { name: &name, whole: &whole, rest: &rest, line: &line, fresh: false }.stream(
        port.as_mut(),
        conversation,
        journal,
        &mut interface,
    )
}

/// Lines with which a Marlin plotter knows where its pen is: it does not tell whether it has restarted, and so it is homed, if
/// the job homes it, or its user says that the pen is at the zero.
fn marlin_lines(
    name: &str,
    whole: &Whole,
    device: &Device,
    at_zero: bool,
    interface: &mut Interface,
) -> Result<Vec<String>, PlotError> {
    let pen = device.language.gcode();
    let on_z = pen.is_some_and(|gcode| matches!(gcode.pen, Pen::Z { .. }));
    // A pen on Z would go to a height that is as unknown as the rest.
    let mut lines = pen.filter(|_| !on_z).map(|gcode| gcode.pen_up()).unwrap_or_default();
    if let (Some(homing), false) = (whole.homing(), at_zero) {
        lines.push(homing.to_owned());
        return Ok(lines);
    }
    if whole.shifts() {
        return Err(ResumeError::OwnOrigin { name: name.to_owned() }.into());
    }
    let why = "Marlin does not tell whether it has restarted";
    let asks = !at_zero && interface.answers();
    if !(at_zero || asks && interface.prompt(&format!("{why}: bring the pen to the zero of the drawing"))) {
        return Err(ResumeError::Lost { name: name.to_owned(), why }.into());
    }
    lines.push(if on_z { "G92X0Y0Z0" } else { "G92X0Y0" }.to_owned());
    Ok(lines)
}

/// The journal that is meant.
fn find(jobs: &[String]) -> Result<PathBuf, PlotError> {
    if let [job] = jobs
        && Path::new(job).extension().is_some_and(|extension| extension == EXTENSION)
    {
        return Ok(PathBuf::from(job));
    }
    if !jobs.is_empty() {
        return Ok(journal_path(jobs, super::file(jobs)?));
    }
    let mut names = Vec::new();
    for entry in fs::read_dir(".").map_err(ResumeError::from)? {
        let path = PathBuf::from(entry.map_err(ResumeError::from)?.file_name());
        if path.extension().is_some_and(|extension| extension == EXTENSION) {
            names.push(path);
        }
    }
    names.sort();
    match &names[..] {
        [] => Err(ResumeError::None.into()),
        [one] => Ok(one.clone()),
        _ => Err(ResumeError::Several { names: names.iter().map(|name| name.display().to_string()).collect() }.into()),
    }
}

/// A GRBL plotter of which it is to be known where its pen is.
struct Settling<'a> {
    name: &'a str,
    whole: &'a Whole,
    executed: usize,
    /// Pieces that it had acknowledged beyond those.
    ahead: usize,
    line: &'a Line<'a>,
    at_zero: bool,
}

impl Settling<'_> {
    /// Returns when the plotter rests and knows its place: because it has never lost it, because it was homed, or because its
    /// user says so.
    fn settle(&self, port: &mut dyn SerialPort, interface: &mut Interface) -> Result<(), PlotError> {
        let found = self.ask(port, interface, Vec::new())?;
        let why = if self.at_zero { Some("its user knows") } else { self.doubt(&found) };
        let Some(why) = why else { return Ok(()) };
        let mut lines = if found.locked { vec!["$X".to_owned()] } else { Vec::new() };
        if let Some(gcode) = self.line.device.language.gcode()
            && let Pen::Servo { .. } = gcode.pen
        {
            // A pen on Z would go to a height that is as unknown as the rest.
            lines.extend(gcode.pen_up());
        }
        if let (Some(homing), false) = (self.whole.homing(), self.at_zero) {
            lines.push(homing.to_owned());
        } else {
            let asks = !self.at_zero && interface.answers();
            // What the user says of the place is said of the machine's zero, and that the job moves.
            if self.whole.shifts() {
                return Err(ResumeError::OwnOrigin { name: self.name.to_owned() }.into());
            }
            if !(self.at_zero || asks && interface.prompt(&format!("{why}: bring the pen to the zero of the drawing")))
            {
                return Err(ResumeError::Lost { name: self.name.to_owned(), why }.into());
            }
            let axes = if matches!(self.line.device.language.gcode().map(|gcode| gcode.pen), Some(Pen::Z { .. })) {
                "G92X0Y0Z0"
            } else {
                "G92X0Y0"
            };
            lines.push(axes.to_owned());
        }
        let found = self.ask(port, interface, lines)?;
        if found.locked {
            return Err(ResumeError::Lost { name: self.name.to_owned(), why: "it is still locked" }.into());
        }
        Ok(())
    }

    /// Why its place is not to be relied on; none if it is.
    fn doubt(&self, found: &Found) -> Option<&'static str> {
        if found.locked {
            return Some("it is locked after an alarm");
        }
        if found.restarted {
            return Some("it has restarted");
        }
        let (Some(place), Some(machine)) = (found.place, found.machine) else {
            return Some("it does not tell its position");
        };
        if machine.distance(DVec3::ZERO) < SWITCHED_ON_MM {
            return Some("it is where it says it is when it is switched on");
        }
        let ahead = self.ahead.saturating_add(PIECES_A_NOTE);
        let off = way::distance(self.whole.steps(), self.executed, ahead, place.truncate());
        (off > NEAR_MM).then_some("it is nowhere on the way of what is left to draw")
    }

    /// Has the plotter come to rest, sends it lines, and asks where it is.
    fn ask(
        &self,
        port: &mut dyn SerialPort,
        interface: &mut Interface,
        lines: Vec<String>,
    ) -> Result<Found, PlotError> {
        let mut locate = Locate::new(lines, self.whole.longest_dwell(), self.line.baud);
        let clock = WallClock::start();
        stream::run(port, &mut locate, &clock, interface)
            .map_err(|source| PlotError::Stream { name: self.name.to_owned(), source })?;
        Ok(locate.found())
    }
}
