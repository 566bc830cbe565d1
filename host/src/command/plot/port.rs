//! Plots at a real port, with a journal beside the job.

use std::path::{Path, PathBuf};

use serialport::{FlowControl, SerialPort};

use super::{Job, PlotError, preflight, stems};
use crate::compute::duration_text;
use crate::device::{Device, Flow};
use crate::interrupt;
use crate::journal::{self, EXTENSION, Head, Journal, Noting};
use crate::protocol::Conversation;
use crate::resume::{Rest, Whole};
use crate::stream::{self, Clock, Course, Interface, User, WallClock};

/// How a job is plotted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wish {
    /// Whether the journal of an earlier plot is discarded.
    pub(super) restart: bool,
    /// Whether events are written as JSON.
    pub(super) json: bool,
    /// Whether the controller reads all of the job before.
    pub(super) check: bool,
}

/// What is at the other end of a port.
pub(super) struct Line<'a> {
    /// The port.
    pub(super) path: &'a str,
    /// Its speed.
    pub(super) baud: u32,
    /// What is connected there.
    pub(super) device: &'a Device,
}

impl Line<'_> {
    /// Opens the port.
    pub(super) fn open(&self) -> Result<Box<dyn SerialPort>, PlotError> {
        open(self.path, self.baud, self.device)
    }
}

/// Opens a port as a device wants it.
pub(crate) fn open(path: &str, baud: u32, device: &Device) -> Result<Box<dyn SerialPort>, PlotError> {
    let flow = match device.flow {
        Flow::None => FlowControl::None,
        Flow::XonXoff => FlowControl::Software,
        Flow::RtsCts => FlowControl::Hardware,
    };
    let opened = serialport::new(path, baud).flow_control(flow).open();
    opened.map_err(|source| PlotError::Open { port: path.to_owned(), source })
}

/// Where the journal of these jobs is: beside the file for a plotter, and for models in the current folder, under their names.
pub(super) fn journal_path(jobs: &[String], file: Option<&Path>) -> PathBuf {
    match file {
        Some(file) => {
            let mut name = file.as_os_str().to_owned();
            name.push(".");
            name.push(EXTENSION);
            name.into()
        }
        None => PathBuf::from(format!("{}.{EXTENSION}", stems(jobs))),
    }
}

/// Plots a job from its beginning.
pub(super) fn plot(
    job: &Job,
    conversation: Conversation,
    line: &Line<'_>,
    wish: Wish,
    profile: String,
    path: &Path,
) -> Result<(), PlotError> {
    let whole =
        Whole::new(&job.bytes, line.device).map_err(|source| PlotError::Job { name: job.name.clone(), source })?;
    let mut interface = Interface::new(User::Present, Course::new(whole.steps()), wish.json);
    check_user(&job.name, &conversation, &interface)?;
    let mut port = line.open()?;
    preflight::ask(port.as_mut(), &WallClock::start(), job, line.device, wish.check)?;
    let head = Head {
        name: job.name.clone(),
        profile,
        baud: line.baud,
        pieces: conversation.protocol.progress().total as u64,
        begun_ms: journal::now_ms(),
    };
    let journal = Journal::create(path, &head, &job.bytes, wish.restart)?;
    let rest = Rest { job: Vec::new(), added: 0, skipped: 0 };
    let run = Run { name: &job.name, whole: &whole, rest: &rest, line, fresh: true };
    run.stream(port.as_mut(), conversation, journal, &mut interface)
}

/// Says what would go wrong with a job, and plots nothing.
pub(super) fn ask(job: &Job, line: &Line<'_>, check: bool) -> Result<(), PlotError> {
    let mut port = line.open()?;
    interrupt::watch();
    preflight::ask(port.as_mut(), &WallClock::start(), job, line.device, check)
}

/// Refuses a job that waits for its user when there is none.
pub(super) fn check_user(name: &str, conversation: &Conversation, interface: &Interface) -> Result<(), PlotError> {
    match conversation.first_pause {
        Some(number) if !interface.answers() => {
            Err(PlotError::Pause { name: name.to_owned(), unit: conversation.protocol.place().unit, number })
        }
        _ => Ok(()),
    }
}

/// A job, or what is left of one, on its way.
pub(super) struct Run<'a> {
    pub(super) name: &'a str,
    pub(super) whole: &'a Whole,
    pub(super) rest: &'a Rest,
    pub(super) line: &'a Line<'a>,
    /// Whether it has a journal only since now.
    pub(super) fresh: bool,
}

impl Run<'_> {
    /// Sends it to its end and takes the journal away; or says how to go on.
    pub(super) fn stream(
        &self,
        port: &mut dyn SerialPort,
        mut conversation: Conversation,
        mut journal: Journal,
        interface: &mut Interface,
    ) -> Result<(), PlotError> {
        let clock = WallClock::start();
        let protocol = conversation.protocol.as_mut();
        let total = self.rest.of_whole(protocol.progress().total);
        let reached = |pieces| self.whole.reached(self.rest.of_whole(pieces));
        interface.start(self.name, protocol.place().unit, total, self.rest.skipped);
        let mut noting = Noting::new(interface, &mut journal, &reached, total);
        let result = stream::run(port, protocol, &clock, &mut noting);
        noting.finish();
        let place = protocol.place();
        let Err(source) = result else {
            let pieces = total - self.rest.skipped;
            let from = if self.rest.skipped > 0 {
                format!(", from {} {} on", place.unit, self.first())
            } else {
                String::new()
            };
            let took = duration_text(clock.now());
            journal.remove()?;
            interface.end(None);
            interface.say(&format!("{}: {pieces} {}s plotted in {took}{from}", self.name, place.unit));
            return Ok(());
        };
        if place.number == 0 && self.fresh {
            // Nothing was sent that moves anything: there is nothing to go on with.
            journal.remove()?;
        } else {
            let path = journal.path().display().to_string();
            journal.close()?;
            let port = self.line.path;
            interface
                .say(&format!("what is drawn is in {path}; go on with: penvis plot --resume {path} --port {port}"));
        }
        interface.end(Some(&source.to_string()));
        Err(PlotError::Stream { name: self.name.to_owned(), source })
    }

    /// Number of the first piece that is sent.
    fn first(&self) -> usize {
        self.rest.skipped + 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_journal_is_beside_the_job() {
        let table = [
            (&["a/b.gcode".to_owned()][..], Some("a/b.gcode"), "a/b.gcode.journal"),
            (&["teapot".to_owned()], None, "teapot.journal"),
            (&["a/x.json".to_owned(), "torus".to_owned()], None, "x-torus.journal"),
        ];
        for (jobs, file, expected) in table {
            assert_eq!(journal_path(jobs, file.map(Path::new)), Path::new(expected));
        }
    }
}
