//! What is said on the line to a plotter, as state machines without I/O: bytes and the time go in, bytes and events come out.
//!
//! [`grbl`] and [`marlin`] speak G-code with the line protocols of those controllers, [`hpgl`] speaks HPGL with its device control instructions.
//! [`start`] takes the one that a device speaks, and [`crate::stream`] connects it with a port.

use std::fmt;
use std::time::Duration;

use thiserror::Error;

mod control;
#[cfg(test)]
mod dialogue;
pub mod grbl;
mod heights;
pub mod hpgl;
mod input;
pub mod marlin;
mod outbox;
mod start;

pub use control::Control;
pub(crate) use input::Input;
pub use outbox::Outbox;
pub use start::{Conversation, JobError, start};

/// A conversation with a plotter that sends it one job.
pub trait Protocol {
    /// Takes bytes from the plotter. `now` is the time since the port was opened; it never runs backwards.
    fn receive(&mut self, bytes: &[u8], now: Duration);

    /// Lets time pass: sends what may be sent now, and gives up where an answer is overdue.
    fn tick(&mut self, now: Duration);

    /// What is ready for the caller.
    fn outbox(&mut self) -> &mut Outbox;

    /// Takes the bytes to be written, in order; empty when there are none.
    fn take_output(&mut self) -> Vec<u8> {
        self.outbox().take_bytes()
    }

    /// Takes the oldest event; none when nothing has happened.
    fn take_event(&mut self) -> Option<Event> {
        self.outbox().take_event()
    }

    /// Does what the user wants while the job goes on. What makes no sense now is left aside.
    fn control(&mut self, control: Control, now: Duration);

    /// How far the job is.
    fn progress(&self) -> Progress;

    /// The oldest piece of the job that the plotter has not acknowledged.
    fn place(&self) -> Place;

    /// Whether it wants to be told the levels of the port's lines before each [`tick`](Self::tick).
    fn watches_lines(&self) -> bool {
        false
    }

    /// Takes the levels of the port's lines. Told only to one that [wants them](Self::watches_lines).
    fn lines(&mut self, _lines: Lines, _now: Duration) {}
}

/// Levels of a serial port's lines, true where they are asserted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lines {
    /// CTS.
    pub clear_to_send: bool,
    /// DSR.
    pub data_set_ready: bool,
}

/// How far a job is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// Pieces (lines or instructions) that the plotter has acknowledged: it has them, and will do them unless it is stopped.
    pub acknowledged: usize,
    /// Pieces that the plotter is known to have carried out, motion included. Never more than are acknowledged, and never too many;
    /// it falls where what was carried out proves to be in the wrong place.
    pub executed: usize,
    /// Pieces of the job.
    pub total: usize,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Event {
    /// The plotter says something that its user may want to read.
    Message(String),
    /// What the user asked for is done, or is not; in words of this side.
    Note(String),
    /// Something is not as it should be, and the job goes on; in words of this side.
    Warning(String),
    /// The job waits for its user, with the comment that the job gives; [`Control::Resume`] goes on.
    Prompt(String),
    /// The plotter has come to rest after [`Control::Hold`].
    Paused,
    /// The plotter goes on after [`Event::Paused`].
    Resumed,
    /// All of the job is acknowledged, and the plotter has come to rest.
    Done,
    /// The job has ended before its end. Nothing more is sent.
    Failed(Fault),
}

/// A piece of a job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// What is counted.
    pub unit: Unit,
    /// Number from 1 in the job as its file has it; 0 when the job has not begun.
    pub number: usize,
    /// Its text as it is sent.
    pub text: String,
}

/// What a job is counted in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Lines of G-code.
    Line,
    /// Instructions of HPGL.
    Instruction,
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Line => "line",
            Self::Instruction => "instruction",
        })
    }
}

/// Characters of a piece that messages show.
const TEXT_SHOWN: usize = 80;

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.number == 0 {
            return write!(f, "before the first {}", self.unit);
        }
        write!(f, "at {} {}", self.unit, self.number)?;
        if self.text.is_empty() {
            return Ok(());
        }
        let shown: String = self.text.chars().take(TEXT_SHOWN).collect();
        let more = if shown.len() < self.text.len() { "…" } else { "" };
        write!(f, " (`{shown}{more}`)")
    }
}

/// Why a job ended before its end.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum Fault {
    /// Nothing that speaks the language is at the port.
    #[error("no answer from the plotter: is it switched on, is this its --port, and is --baud (now {baud}) right?")]
    NoAnswer {
        /// Speed of the line that was tried.
        baud: u32,
    },
    /// It is not idle, so that a job cannot begin.
    #[error("the plotter is not ready, its state is `{state}`: {advice}")]
    NotReady {
        /// Its state in its own word.
        state: String,
        /// What to do.
        advice: &'static str,
    },
    /// The pen would move before the motion ahead of it has ended.
    #[error("the plotter is in laser mode ($32=1), where a servo pen moves too early: switch it off with `$32=0`")]
    LaserMode,
    /// A line does not fit the plotter's receive buffer.
    #[error("line {line} has {length} characters, and the plotter receives {limit} at a time; write shorter lines")]
    LineTooLong {
        /// Number of the line.
        line: usize,
        /// Its characters.
        length: usize,
        /// Most characters.
        limit: usize,
    },
    /// The plotter refuses a piece of the job.
    #[error("the plotter refused the job {at}: error {code}, {meaning}")]
    Refused {
        /// Where.
        at: Place,
        /// The plotter's number for it.
        code: String,
        /// What the number means.
        meaning: &'static str,
    },
    /// The plotter has stopped itself.
    #[error(
        "the plotter raised alarm {code} {at}: {meaning}; its position may be lost, so home it (or set the origin) before the next job"
    )]
    Alarm {
        /// What it had not acknowledged yet.
        at: Place,
        /// The plotter's number for it.
        code: String,
        /// What the number means.
        meaning: &'static str,
    },
    /// The plotter restarted.
    #[error("the plotter restarted {at}: reset button, or a power supply that drops; the rest of the job is lost")]
    Restarted {
        /// What it had not acknowledged yet.
        at: Place,
    },
    /// The plotter no longer answers.
    #[error("the plotter has fallen silent {at}: nothing came back for {seconds} s")]
    Silent {
        /// What it had not acknowledged yet.
        at: Place,
        /// For how long.
        seconds: u64,
    },
    /// The plotter is idle and still owes an answer.
    #[error(
        "bytes were lost on the line {at}: the plotter is idle but never answered it; try a shorter cable or a lower --baud"
    )]
    Lost {
        /// What it had not acknowledged.
        at: Place,
    },
    /// The plotter is not where the job leads.
    #[error(
        "the plotter is off along {off} after lines {first} to {last}, and what they drew is wrong: a byte was lost or changed on \
         the line{}; try a shorter or shielded cable, or a lower --baud",
        at.as_ref().map_or(String::new(), |at| format!(", {at}"))
    )]
    Misplaced {
        /// Number of the first line that may be at fault.
        first: usize,
        /// Number of the last.
        last: usize,
        /// How far, by axis, in words.
        off: String,
        /// The line at fault, if exactly one explains it.
        at: Option<Place>,
    },
    /// The plotter is not in the state that the job has set.
    #[error(
        "the plotter is in the state {found} and not {wanted} {at}: a byte was lost or changed on the line; try a shorter or \
         shielded cable, or a lower --baud"
    )]
    Garbled {
        /// The last line before it was asked.
        at: Place,
        /// What the job has set.
        wanted: String,
        /// What the plotter tells.
        found: String,
    },
    /// The plotter reports an error in words of its own.
    #[error("the plotter reports an error {at}: {text}")]
    Complaint {
        /// What it had not acknowledged yet.
        at: Place,
        /// What it says.
        text: String,
    },
    /// The plotter answers, and does nothing.
    #[error("the plotter has neither moved nor taken a line for {seconds} s {at}: is it held or blocked?")]
    Motionless {
        /// What it had not acknowledged yet.
        at: Place,
        /// For how long.
        seconds: u64,
    },
    /// The plotter is not where the job has led it.
    #[error(
        "the plotter is {found}, and not {wanted}: a byte was lost or changed on the line in {}, and what is drawn of it is wrong; \
         try a shorter cable or a lower --baud",
        instructions(*first, *last)
    )]
    Astray {
        /// Number of the first instruction that may be at fault.
        first: usize,
        /// Number of the last.
        last: usize,
        /// Where it is.
        found: String,
        /// Where it should be.
        wanted: String,
    },
    /// The plotter has refused something, and tells that later.
    #[error(
        "the plotter refused a part of {}: error {code}, {meaning}; either it does not know what stands there, or a byte was \
         changed on the line",
        instructions(*first, *last)
    )]
    Erred {
        /// Number of the first instruction that may be at fault.
        first: usize,
        /// Number of the last.
        last: usize,
        /// The plotter's number for it.
        code: u32,
        /// What the number means.
        meaning: &'static str,
    },
    /// What the plotter answers cannot be read.
    #[error("too many answers of the plotter cannot be read {at}: look at --baud, parity and the cable")]
    Noise {
        /// What it had not acknowledged yet.
        at: Place,
    },
    /// The plotter counted errors while it drew.
    #[error("the plotter took the whole job but reports {what}; the drawing may be incomplete")]
    Reported {
        /// What it reports.
        what: String,
    },
    /// Somebody stopped it.
    #[error("the job was stopped {at}")]
    Cancelled {
        /// What it had not acknowledged yet.
        at: Place,
    },
}

/// One instruction or several, in words.
fn instructions(first: usize, last: usize) -> String {
    if first == last { format!("instruction {first}") } else { format!("instructions {first} to {last}") }
}

impl Fault {
    /// Gives the pieces that it names other numbers.
    pub fn renumber(&mut self, number: &dyn Fn(usize) -> usize) {
        match self {
            Self::Refused { at, .. }
            | Self::Alarm { at, .. }
            | Self::Restarted { at }
            | Self::Silent { at, .. }
            | Self::Lost { at }
            | Self::Garbled { at, .. }
            | Self::Complaint { at, .. }
            | Self::Motionless { at, .. }
            | Self::Noise { at }
            | Self::Cancelled { at } => at.number = number(at.number),
            Self::Misplaced { first, last, at, .. } => {
                (*first, *last) = (number(*first), number(*last));
                if let Some(at) = at {
                    at.number = number(at.number);
                }
            }
            Self::Astray { first, last, .. } | Self::Erred { first, last, .. } => {
                (*first, *last) = (number(*first), number(*last));
            }
            Self::NoAnswer { .. }
            | Self::NotReady { .. }
            | Self::LaserMode
            | Self::LineTooLong { .. }
            | Self::Reported { .. } => {}
        }
    }
}
