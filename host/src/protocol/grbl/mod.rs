//! GRBL's line protocol.
//!
//! ```text
//!  Greeting ── banner, or 2 s of silence ──> Asking ── `?` answered: Idle ──> Probing ── `$I`, `$$`, `$G` ──> Streaming
//!     Streaming ── check at the end of the job ──> Over (Done)
//!     any of them ── error, cancel ──> Holding ── `!`, Hold:0 ──> Resetting ── 0x18, banner ──> Lifting ── ok ──> Over (Failed)
//! ```
//!
//! Lines are streamed by *character counting*: the controller answers each line when it has taken it out of its receive
//! buffer, so the lengths (with their line ends) of the lines not answered yet are what the buffer can hold at most. Their sum
//! stays one byte below the buffer's size; nothing is ever lost and the buffer never runs dry. Only `\n` ends a line: GRBL
//! takes `\r\n` for two lines and answers both. *Send and response* keeps a single line on the way.
//!
//! The answer `ok` means that a line is planned, not that it is drawn, and nothing on the line has a checksum. So the job is
//! held against the machine where the pen has just been lowered or lifted (`plan`), and goes on only when both agree
//! (`check`). An `ok` that was lost or came twice is made good there too: the answer to `$G` proves that all lines before it
//! were taken.

mod check;
mod codes;
mod control;
mod explain;
mod feed;
mod job;
mod plan;
mod replies;
mod report;
mod told;
mod watch;

use std::collections::VecDeque;
use std::time::Duration;

pub use job::{Job, JobError, Line, Turn};
pub(crate) use job::{clean, without_pause, words};
pub(crate) use plan::{is_dwell, spelled};
pub(crate) use replies::{error_meaning, is_banner};

use super::heights::Heights;
use super::{Control, Event, Fault, Input, Outbox, Place, Progress, Protocol, Unit};
use crate::device::Streaming;
use crate::trace::Position;
use crate::trace::gcode::{Machine, Modal, follow};
use check::Checking;
use control::Hold;
use plan::{Model, Plan};
use replies::refused;
use told::Told;
use watch::Watch;

/// Time from opening the port in which a banner may come: boards that reset have a boot loader to run through.
const BANNER_WAIT: Duration = Duration::from_secs(2);
/// Time between attempts to get a status report before anything is known about the other side.
const ASK_INTERVAL: Duration = Duration::from_secs(1);
/// Attempts to get a status report before anything is known about the other side.
const ASK_MAX: u32 = 4;
/// A controller that is asked for its status answers in milliseconds, in motion too; this is far beyond.
const SILENCE_MAX: Duration = Duration::from_secs(10);
/// Slowing down to a hold takes at most this long; then the reset goes out all the same.
const HOLD_WAIT: Duration = Duration::from_secs(5);
/// Time for the banner after a reset, and for the pen to be lifted after it.
const RESET_WAIT: Duration = Duration::from_secs(3);
/// Receive buffer when neither the controller nor the profile tells another size: GRBL's own.
pub const RX_BYTES: usize = 128;

const HOLD: u8 = b'!';
const RESUME: u8 = b'~';
const STATUS: u8 = b'?';
const RESET: u8 = 0x18;
/// `G4 P0.01`: answered when the motion before it has ended.
const BARRIER: &str = "G4P0.01";
/// Asks for the state of the interpreter, in its turn among the lines.
const QUERY: &str = "$G";
/// Times that it is asked before the job: a controller that does not answer may not know it, or a byte was lost.
const ASK_MODAL_MAX: u32 = 3;
const UNVERIFIED: &str = "the plotter does not answer `$G`, so that what arrives there is not verified";
/// Ends whatever a sender before us may have left half written, and makes an error of it rather than a motion.
const BREAK: &str = "#";

/// What the conversation must know besides the job.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Receive buffer of the controller in bytes, unless `$I` tells another.
    pub rx_bytes: usize,
    /// Longest line in characters, without its end.
    pub line_limit: usize,
    /// How lines go to the controller.
    pub streaming: Streaming,
    /// The machine, to follow what the job does.
    pub machine: Machine,
    /// Whether the pen is a servo on the spindle output, which the laser mode would move too early.
    pub servo: bool,
    /// Lines that lift the pen after a job was stopped.
    pub lift: Vec<String>,
    /// Speed of the line, for messages.
    pub baud: u32,
}

/// A conversation with a GRBL controller that streams one job.
#[derive(Debug)]
pub struct Grbl {
    job: Job,
    options: Options,
    plan: Plan,
    phase: Phase,
    /// When the phase began.
    since: Duration,
    /// Bytes of the line that is being received.
    input: Input,
    outbox: Outbox,
    /// Bytes that may be on the way: one less than the receive buffer.
    rx_limit: usize,
    on_the_way: VecDeque<Sent>,
    /// Bytes of `on_the_way`.
    used: usize,
    /// Most bytes that were ever on the way.
    used_max: usize,
    /// Index of the job's next line.
    next: usize,
    /// Lines of the job that are answered.
    answered: usize,
    /// Lines of the job that are carried out: a check behind them was passed, or free blocks of the planner tell so.
    executed: usize,
    /// Whether the job's next line is at rest already: its barrier was answered.
    at_rest: bool,
    /// Index of the check of the plan that comes next.
    part: usize,
    /// Where the controller takes itself to be, in a part that is sent in differences.
    model: Option<Model>,
    /// Whether the planner holds a block for each line of the part, so that its blocks tell how far the part is.
    blocks_count: bool,
    checking: Option<Checking>,
    /// What the controller tells of itself.
    told: Told,
    heights: Heights,
    /// Comment of the pause (M0) at which the job waits for its user.
    pause: Option<String>,
    hold: Option<Hold>,
    /// Whether the job is to rest at the next end of a stroke.
    pausing: bool,
    /// Lines of ours that are still to be sent, in order: probes, or those that lift the pen.
    errands: VecDeque<String>,
    /// Why the job is being stopped.
    fault: Option<Fault>,
    /// Lines of the controller that were no answer and no report known.
    unknown: u32,
    watch: Watch,
}

/// Where the conversation is; see the figure at the top.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Greeting,
    Asking { asked: u32 },
    Probing,
    Streaming,
    Holding,
    Resetting,
    Lifting,
    Over,
}

/// A line that is on the way.
#[derive(Clone, Copy, Debug)]
struct Sent {
    what: What,
    bytes: usize,
    at: Duration,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum What {
    /// The job's line of this index.
    Line(usize),
    /// A line of ours.
    Errand,
    /// A wait for the motion to end.
    Barrier,
    /// `$G`.
    Query,
    /// Something that was taken, as a later answer proves, and whose own answer may come yet.
    Ghost,
}

impl Grbl {
    /// A conversation that has not begun. The port is opened at time 0.
    #[must_use]
    pub fn new(job: Job, options: Options) -> Self {
        let followed = follow(&job, &options.machine, &Modal::default(), Position::UNKNOWN);
        Self {
            plan: Plan::new(&job, followed, options.line_limit, false),
            rx_limit: options.rx_bytes.saturating_sub(1),
            heights: Heights::new(options.machine.pen),
            job,
            options,
            phase: Phase::Greeting,
            since: Duration::ZERO,
            input: Input::default(),
            outbox: Outbox::default(),
            on_the_way: VecDeque::new(),
            used: 0,
            used_max: 0,
            next: 0,
            answered: 0,
            executed: 0,
            at_rest: false,
            part: 0,
            model: None,
            blocks_count: false,
            checking: None,
            told: Told { unit_mm: 1.0, ..Told::default() },
            pause: None,
            hold: None,
            pausing: false,
            errands: VecDeque::new(),
            fault: None,
            unknown: 0,
            watch: Watch::default(),
        }
    }

    /// Most bytes that were on the way at one time.
    #[must_use]
    pub fn used_max(&self) -> usize {
        self.used_max
    }

    /// Bytes that may be on the way.
    #[must_use]
    pub fn rx_limit(&self) -> usize {
        self.rx_limit
    }

    /// Lines of the controller that were neither an answer nor a report that is known: noise on the line, or another dialect.
    #[must_use]
    pub fn unknown_lines(&self) -> u32 {
        self.unknown
    }

    fn enter(&mut self, phase: Phase, now: Duration) {
        self.phase = phase;
        self.since = now;
    }

    fn fail(&mut self, fault: Fault) {
        self.phase = Phase::Over;
        self.outbox.tell(Event::Failed(fault));
    }

    /// Stops the motion, then fails: `!`, and in [`tick`](Protocol::tick) the rest.
    fn stop(&mut self, fault: Fault, now: Duration) {
        if matches!(fault, Fault::Misplaced { .. } | Fault::Garbled { .. } | Fault::Lost { .. }) {
            // What free blocks have told of this part is drawn, and in the wrong place.
            self.executed = self.executed.min(self.plan.start(self.part));
        }
        self.fault = Some(fault);
        self.errands.clear();
        self.checking = None;
        self.pause = None;
        self.realtime(HOLD);
        self.ask_status(now);
        self.enter(Phase::Holding, now);
    }

    fn realtime(&mut self, byte: u8) {
        self.outbox.write(&[byte]);
    }

    fn ask_status(&mut self, now: Duration) {
        self.realtime(STATUS);
        self.watch.last_poll = now;
        self.watch.answered_at_poll = self.answered;
    }

    fn send(&mut self, text: &str, what: What, now: Duration) {
        self.outbox.line(text);
        let bytes = text.len() + 1;
        self.used += bytes;
        self.used_max = self.used_max.max(self.used);
        self.on_the_way.push_back(Sent { what, bytes, at: now });
    }

    /// Whether a line of this many characters may go out now.
    fn has_room(&self, length: usize) -> bool {
        match self.options.streaming {
            Streaming::CharacterCounting => self.used + length < self.rx_limit,
            Streaming::SendResponse => self.on_the_way.is_empty(),
        }
    }

    fn forget_on_the_way(&mut self) {
        self.on_the_way.clear();
        self.used = 0;
    }

    fn ask(&mut self, asked: u32, now: Duration) {
        self.errands.clear();
        self.ask_status(now);
        self.enter(Phase::Asking { asked }, now);
    }

    /// Probes are answered: the job begins, with what is known now.
    fn begin(&mut self, now: Duration) {
        self.enter(Phase::Streaming, now);
        self.watch.begin(now);
        if let Some(fault) = self.too_long() {
            return self.fail(fault);
        }
        let verified = self.told.modal.is_some();
        if !verified {
            self.outbox.tell(Event::Warning(UNVERIFIED.to_owned()));
        }
        // Where the pen is must be told by the job, so that it is verified before anything moves.
        let told = self.told.modal.clone().unwrap_or_default();
        let before = Modal { speed: None, spindle: None, coordinates: None, ..told };
        let followed = follow(&self.job, &self.options.machine, &before, Position::UNKNOWN);
        self.plan = Plan::new(&self.job, followed, self.options.line_limit, verified);
        self.stream(now);
    }

    fn reset(&mut self, now: Duration) {
        self.realtime(RESET);
        self.forget_on_the_way();
        self.enter(Phase::Resetting, now);
    }

    fn finish_stopping(&mut self) {
        let at = self.place();
        let fault = self.fault.take().unwrap_or(Fault::Cancelled { at });
        self.fail(fault);
    }

    /// Sends lines of ours, each when the one before it is answered. True when none is left.
    fn run_errands(&mut self, now: Duration) -> bool {
        if !self.on_the_way.is_empty() {
            return false;
        }
        match self.errands.pop_front() {
            Some(text) => {
                self.send(&text, What::Errand, now);
                false
            }
            None => true,
        }
    }

    /// Sends as many lines of the job as may be on the way.
    fn stream(&mut self, now: Duration) {
        while self.phase == Phase::Streaming && self.checking.is_none() && self.pause.is_none() && !self.is_parked() {
            let Some(check) = self.plan.check(self.part) else { return };
            if self.next >= check.end {
                self.begin_check(now);
                return;
            }
            let Some(line) = self.job.lines().get(self.next) else { return };
            let turn = line.turn.clone();
            let alone_before = self.on_the_way.back().is_some_and(|sent| match sent.what {
                What::Line(index) => self.job.lines().get(index).is_some_and(|line| line.turn != Turn::Streamed),
                What::Errand | What::Barrier | What::Query => true,
                What::Ghost => false,
            });
            if alone_before || (turn != Turn::Streamed && !self.on_the_way.is_empty()) {
                return;
            }
            if matches!(turn, Turn::AtRest | Turn::Pause(_)) && !self.at_rest {
                self.send(BARRIER, What::Barrier, now);
                return;
            }
            if self.next == self.plan.start(self.part) {
                self.blocks_count = self.plan.has_a_block_a_line(self.part, self.told.steps_per_mm);
                let origin = self.told.origin.unwrap_or_default();
                self.model = self.plan.model(self.part, [origin[0], origin[1]], self.told.double);
            }
            let mut model = self.model;
            let mut text = self.plan.text(&self.job, self.next, self.part, &mut model);
            if self.next >= check.pen_lines {
                text = self.heights.rewritten(&text);
            }
            if let Turn::Pause(comment) = turn {
                // The pause is ours, not the controller's: a byte of `M0` that is changed on the way must not drop it.
                self.outbox.tell(Event::Prompt(comment.clone()));
                self.pause = Some(comment);
                return;
            }
            if !self.has_room(text.len()) {
                return;
            }
            self.model = model;
            self.send(&text, What::Line(self.next), now);
            self.next += 1;
        }
    }

    fn place_of(&self, index: usize) -> Place {
        match self.job.lines().get(index) {
            Some(line) => Place { unit: Unit::Line, number: line.number, text: line.text.clone() },
            None => Place { unit: Unit::Line, number: 0, text: String::new() },
        }
    }

    /// The first line that is too long for the receive buffer.
    fn too_long(&self) -> Option<Fault> {
        let limit = self.rx_limit.saturating_sub(1);
        let line = self.job.lines().iter().find(|line| line.text.len() > limit)?;
        Some(Fault::LineTooLong { line: line.number, length: line.text.len(), limit })
    }
}

impl Protocol for Grbl {
    fn receive(&mut self, bytes: &[u8], now: Duration) {
        if !bytes.is_empty() {
            self.watch.last_heard = now;
        }
        for &byte in bytes {
            if let Some(line) = self.input.take(byte) {
                self.line(&line, now);
            }
        }
        self.tick(now);
    }

    fn tick(&mut self, now: Duration) {
        let elapsed = now.saturating_sub(self.since);
        match self.phase {
            Phase::Greeting if elapsed >= BANNER_WAIT => self.ask(1, now),
            Phase::Asking { asked } if elapsed >= ASK_INTERVAL => {
                if asked < ASK_MAX {
                    self.ask(asked + 1, now);
                } else {
                    let baud = self.options.baud;
                    self.fail(Fault::NoAnswer { baud });
                }
            }
            Phase::Probing => {
                if self.watch.poll_is_due(now) && !self.on_the_way.is_empty() {
                    self.ask_status(now);
                }
                if self.run_errands(now) {
                    if self.told.modal.is_none() && self.told.asked < ASK_MODAL_MAX {
                        self.told.asked += 1;
                        self.send(QUERY, What::Errand, now);
                    } else {
                        self.begin(now);
                    }
                } else if now.saturating_sub(self.watch.last_heard) > SILENCE_MAX {
                    let baud = self.options.baud;
                    self.fail(Fault::NoAnswer { baud });
                }
            }
            Phase::Streaming => {
                self.advance_check(now);
                self.stream(now);
                self.watch(now);
            }
            Phase::Holding => {
                if elapsed > HOLD_WAIT {
                    self.reset(now);
                } else if self.watch.poll_is_due(now) {
                    self.ask_status(now);
                }
            }
            Phase::Resetting if elapsed > RESET_WAIT => self.finish_stopping(),
            Phase::Lifting => {
                let lifted = self.run_errands(now);
                if lifted || elapsed > RESET_WAIT {
                    self.finish_stopping();
                }
            }
            _ => {}
        }
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
    }

    fn control(&mut self, control: Control, now: Duration) {
        self.obey(control, now);
    }

    fn progress(&self) -> Progress {
        Progress { acknowledged: self.answered, executed: self.executed, total: self.job.lines().len() }
    }

    fn place(&self) -> Place {
        match self.phase {
            Phase::Greeting | Phase::Asking { .. } | Phase::Probing => self.place_of(usize::MAX),
            _ => self.place_of(self.answered.min(self.job.lines().len() - 1)),
        }
    }
}

#[cfg(test)]
mod tests;
