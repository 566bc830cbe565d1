//! GRBL's line protocol.
//!
//! ```text
//!  Greeting ── banner, or 2 s of silence ──> Asking ── `?` answered: Idle ──> Probing ── `$I`, `$$` ──> Streaming
//!     Streaming ── all lines answered ──> Barrier ── `G4 P0.01` answered ──> Over (Done)
//!     any of them ── error, cancel ──> Holding ── `!`, Hold:0 ──> Resetting ── 0x18, banner ──> Lifting ── ok ──> Over (Failed)
//! ```
//!
//! Lines are streamed by *character counting*: the controller answers each line when it has taken it out of its receive
//! buffer, so the lengths (with their line ends) of the lines not answered yet are what the buffer can hold at most. Their sum
//! stays one byte below the buffer's size; nothing is ever lost and the buffer never runs dry. Only `\n` ends a line: GRBL
//! takes `\r\n` for two lines and answers both.
//!
//! The answer `ok` means that a line is planned, not that it is drawn. `G4 P0.01` waits for the motion before it, and so its
//! answer is the end of the drawing.

mod codes;
mod job;

use std::collections::VecDeque;
use std::time::Duration;

pub use job::{Job, JobError, Line, Turn};
pub(crate) use job::{clean, words};

use super::{Control, Event, Fault, Place, Progress, Protocol, Unit};

/// Time from opening the port in which a banner may come: boards that reset have a boot loader to run through.
const BANNER_WAIT: Duration = Duration::from_secs(2);
/// Time between attempts to get a status report before anything is known about the other side.
const ASK_INTERVAL: Duration = Duration::from_secs(1);
/// Attempts to get a status report before anything is known about the other side.
const ASK_MAX: u32 = 4;
/// Time between status requests: five a second is the most that does not hold up the controller.
const POLL_INTERVAL: Duration = Duration::from_millis(250);
/// A controller that is asked for its status answers in milliseconds, in motion too; this is far beyond.
const SILENCE_MAX: Duration = Duration::from_secs(10);
/// The same for homing and the like, during which GRBL answers nothing.
const SILENCE_MAX_AT_REST: Duration = Duration::from_secs(180);
/// An idle controller that owes an answer for so long, beyond the longest dwell, has lost bytes.
const IDLE_MAX: Duration = Duration::from_secs(5);
/// Slowing down to a hold takes at most this long; then the reset goes out all the same.
const HOLD_WAIT: Duration = Duration::from_secs(5);
/// Time for the banner after a reset, and for the pen to be lifted after it.
const RESET_WAIT: Duration = Duration::from_secs(3);
/// Receive buffer when neither the controller nor the profile tells another size: GRBL's own.
pub const RX_BYTES: usize = 128;
/// Longest line of the controller that is kept; the rest of a longer one is dropped.
const INPUT_MAX: usize = 1024;

const HOLD: u8 = b'!';
const RESUME: u8 = b'~';
const STATUS: u8 = b'?';
const RESET: u8 = 0x18;
/// Speed as programmed, then 10 % faster, 10 % slower, 1 % faster, 1 % slower.
const SPEEDS: [u8; 5] = [0x90, 0x91, 0x92, 0x93, 0x94];
/// Range of GRBL's speed override in percent.
const SPEED_RANGE: (u16, u16) = (10, 200);
/// `G4 P0.01`: answered when the motion before it has ended.
const BARRIER: &str = "G4P0.01";

/// What the conversation must know besides the job.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Receive buffer of the controller in bytes, unless `$I` tells another.
    pub rx_bytes: usize,
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
    phase: Phase,
    /// When the phase began.
    since: Duration,
    /// Bytes of the line that is being received.
    input: Vec<u8>,
    output: Vec<u8>,
    events: VecDeque<Event>,
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
    /// Lines of the job that are carried out for certain: a barrier behind them was answered.
    executed: usize,
    /// Whether the job's next line is at rest already: its barrier was answered.
    at_rest: bool,
    pause: Option<Pause>,
    /// A hold that the user asked for.
    hold: Option<Hold>,
    /// Lines of ours that are still to be sent, in order: probes, or those that lift the pen.
    errands: VecDeque<String>,
    /// Why the job is being stopped.
    fault: Option<Fault>,
    last_heard: Duration,
    last_poll: Duration,
    /// Whether the user was told that somebody holds the plotter.
    hold_told: bool,
    /// Since when the controller has been idle in all its reports, with no answer in between.
    idle_since: Option<Duration>,
}

/// Where the conversation is; see the figure at the top.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Greeting,
    Asking { asked: u32 },
    Probing,
    Streaming,
    Barrier,
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
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum What {
    /// The job's line of this index.
    Line(usize),
    /// A line of ours.
    Errand,
    /// A wait for the motion to end.
    Barrier,
}

/// A pause (M0) of the job.
#[derive(Clone, Debug)]
struct Pause {
    comment: String,
    /// Whether the user was told.
    told: bool,
    /// Whether the line was answered.
    answered: bool,
}

/// A hold that the user asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Hold {
    /// The plotter slows down.
    Slowing,
    /// It rests, and the user was told.
    AtRest,
    /// It was told to go on.
    Leaving,
}

impl Grbl {
    /// A conversation that has not begun. The port is opened at time 0.
    #[must_use]
    pub fn new(job: Job, options: Options) -> Self {
        Self {
            rx_limit: options.rx_bytes.saturating_sub(1),
            job,
            options,
            phase: Phase::Greeting,
            since: Duration::ZERO,
            input: Vec::new(),
            output: Vec::new(),
            events: VecDeque::new(),
            on_the_way: VecDeque::new(),
            used: 0,
            used_max: 0,
            next: 0,
            answered: 0,
            executed: 0,
            at_rest: false,
            pause: None,
            hold: None,
            errands: VecDeque::new(),
            fault: None,
            last_heard: Duration::ZERO,
            last_poll: Duration::ZERO,
            hold_told: false,
            idle_since: None,
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

    fn enter(&mut self, phase: Phase, now: Duration) {
        self.phase = phase;
        self.since = now;
    }

    fn fail(&mut self, fault: Fault) {
        self.phase = Phase::Over;
        self.events.push_back(Event::Failed(fault));
    }

    /// Stops the motion, then fails: `!`, and in [`tick`](Protocol::tick) the rest.
    fn stop(&mut self, fault: Fault, now: Duration) {
        self.fault = Some(fault);
        self.errands.clear();
        self.pause = None;
        self.realtime(HOLD);
        self.realtime(STATUS);
        self.last_poll = now;
        self.enter(Phase::Holding, now);
    }

    fn realtime(&mut self, byte: u8) {
        self.output.push(byte);
    }

    fn send(&mut self, text: &str, what: What) {
        self.output.extend_from_slice(text.as_bytes());
        self.output.push(b'\n');
        let bytes = text.len() + 1;
        self.used += bytes;
        self.used_max = self.used_max.max(self.used);
        self.on_the_way.push_back(Sent { what, bytes });
    }

    /// Takes one line of the controller.
    fn line(&mut self, line: &str, now: Duration) {
        let after = |prefix: &str| line.strip_prefix(prefix);
        if line == "ok" {
            self.answer(None, now);
        } else if let Some(code) = after("error:") {
            self.answer(Some(code.trim()), now);
        } else if let Some(code) = after("ALARM:") {
            self.alarm(code.trim());
        } else if let Some(status) = after("<") {
            self.status(status.trim_end_matches('>'), now);
        } else if let Some(rest) = after("[OPT:") {
            self.build_options(rest.trim_end_matches(']'));
        } else if let Some(message) = after("[MSG:") {
            self.events.push_back(Event::Message(message.trim_end_matches(']').to_owned()));
        } else if let Some(value) = after("$32=") {
            let laser = value.trim().parse::<f64>().is_ok_and(|mode| mode == 1.0);
            if laser && self.options.servo && self.phase == Phase::Probing {
                self.fail(Fault::LaserMode);
            }
        } else if line.starts_with("Grbl ") || line.contains("'$' for help") {
            self.banner(now);
        }
        // Start-up lines print `>…:ok`; like all else they are no answer to a line of ours.
    }

    /// The oldest line on the way is answered.
    fn answer(&mut self, error: Option<&str>, now: Duration) {
        self.idle_since = None;
        let Some(sent) = self.on_the_way.pop_front() else { return };
        self.used -= sent.bytes;
        let What::Line(index) = sent.what else {
            // A controller may not know a probe of ours; that is no fault of the job.
            return self.errand_answered(sent.what, error, now);
        };
        let Some(code) = error else {
            self.answered = self.answered.max(index + 1);
            self.at_rest = false;
            match &mut self.pause {
                Some(pause) if pause.told => self.pause = None,
                Some(pause) => pause.answered = true,
                None => {}
            }
            return;
        };
        if self.fault.is_some() {
            return;
        }
        self.stop(refused(self.place_of(index), code), now);
    }

    fn errand_answered(&mut self, what: What, error: Option<&str>, now: Duration) {
        match (self.phase, what, error) {
            (Phase::Barrier, What::Barrier, Some(code)) => self.stop(refused(self.place(), code), now),
            (Phase::Barrier, What::Barrier, None) => {
                self.phase = Phase::Over;
                self.executed = self.job.lines().len();
                self.events.push_back(Event::Done);
            }
            (_, What::Barrier, _) => {
                self.at_rest = true;
                self.executed = self.answered;
            }
            _ => {}
        }
    }

    fn alarm(&mut self, code: &str) {
        if self.phase == Phase::Over {
            return;
        }
        let meaning = code.parse().map_or("in the controller's own words", codes::alarm);
        let fault = Fault::Alarm { at: self.place(), code: code.to_owned(), meaning };
        // Empties the buffers, and a hard limit lets nothing else through; the lock stays on.
        self.realtime(RESET);
        // Where a line was refused first, or the user stopped the job, that is the reason.
        let fault = self.fault.take().unwrap_or(fault);
        self.fail(fault);
    }

    fn banner(&mut self, now: Duration) {
        self.on_the_way.clear();
        self.used = 0;
        match self.phase {
            // The boot of a board that was reset by opening the port; what was asked before is lost.
            Phase::Greeting | Phase::Asking { .. } | Phase::Probing => self.ask(1, now),
            Phase::Resetting => {
                self.errands = self.options.lift.iter().cloned().collect();
                self.enter(Phase::Lifting, now);
            }
            Phase::Streaming | Phase::Barrier => {
                let at = self.place();
                self.fail(Fault::Restarted { at });
            }
            Phase::Holding | Phase::Lifting => self.finish_stopping(),
            Phase::Over => {}
        }
    }

    /// Stops at once, unless the job waits for its user anyway.
    fn hold(&mut self, now: Duration) {
        if matches!(self.phase, Phase::Streaming | Phase::Barrier) && self.hold.is_none() && self.pause.is_none() {
            self.hold = Some(Hold::Slowing);
            self.realtime(HOLD);
            self.realtime(STATUS);
            self.last_poll = now;
        }
    }

    fn resume(&mut self, now: Duration) {
        let told = match (&self.pause, &mut self.hold) {
            (Some(pause), _) => {
                let (told, answered) = (pause.told, pause.answered);
                if told && answered {
                    self.pause = None;
                }
                told
            }
            (None, Some(hold)) => {
                *hold = Hold::Leaving;
                true
            }
            (None, None) => false,
        };
        if told {
            self.realtime(RESUME);
            // The report that is under way may still say Hold.
            self.last_poll = now;
            self.last_heard = now;
        }
    }

    fn cancel(&mut self, now: Duration) {
        match self.phase {
            Phase::Holding | Phase::Resetting | Phase::Lifting | Phase::Over => {}
            Phase::Greeting | Phase::Asking { .. } | Phase::Probing => {
                let at = self.place();
                self.fail(Fault::Cancelled { at });
            }
            Phase::Streaming | Phase::Barrier => {
                let at = self.place();
                self.stop(Fault::Cancelled { at }, now);
            }
        }
    }

    /// Sets GRBL's feed override: from 100 % on in steps of ten and of one.
    fn speed(&mut self, percent: u16) {
        if !matches!(self.phase, Phase::Streaming | Phase::Barrier) {
            return;
        }
        let [base, plus_ten, minus_ten, plus_one, minus_one] = SPEEDS;
        let off = i32::from(percent.clamp(SPEED_RANGE.0, SPEED_RANGE.1)) - 100;
        self.realtime(base);
        for (steps, plus, minus) in [(off / 10, plus_ten, minus_ten), (off % 10, plus_one, minus_one)] {
            for _ in 0..steps.abs() {
                self.realtime(if steps > 0 { plus } else { minus });
            }
        }
    }

    fn ask(&mut self, asked: u32, now: Duration) {
        self.errands.clear();
        self.realtime(STATUS);
        self.last_poll = now;
        self.enter(Phase::Asking { asked }, now);
    }

    fn build_options(&mut self, rest: &str) {
        // [OPT:V,15,128]: letters, planner blocks, receive buffer. FluidNC leaves the numbers out.
        let told = rest.split(',').nth(2).and_then(|bytes| bytes.trim().parse::<usize>().ok());
        if let (Phase::Probing, Some(bytes @ 2..)) = (self.phase, told) {
            self.rx_limit = bytes - 1;
        }
    }

    fn status(&mut self, status: &str, now: Duration) {
        let state = status.split('|').next().unwrap_or_default();
        let (name, detail) = state.split_once(':').unwrap_or((state, ""));
        match self.phase {
            Phase::Asking { .. } => {
                if name == "Idle" {
                    // The empty line ends whatever a sender before us may have left half written.
                    self.errands = ["", "$I", "$$"].map(str::to_owned).into();
                    self.enter(Phase::Probing, now);
                } else {
                    self.fail(Fault::NotReady { state: state.to_owned(), advice: codes::advice(name) });
                }
            }
            Phase::Streaming | Phase::Barrier if name == "Alarm" => self.alarm("that it did not tell"),
            Phase::Streaming | Phase::Barrier => self.state_in_job(name, detail, now),
            Phase::Holding if name != "Run" && (name != "Hold" || detail != "1") => self.reset(now),
            _ => {}
        }
    }

    /// The state while the job goes on.
    fn state_in_job(&mut self, name: &str, detail: &str, now: Duration) {
        if name == "Idle" {
            self.idle_since.get_or_insert(now);
        } else {
            self.idle_since = None;
        }
        let held = name == "Hold";
        match self.hold {
            Some(Hold::Slowing) if held && detail != "1" => {
                self.hold = Some(Hold::AtRest);
                self.events.push_back(Event::Paused);
            }
            Some(Hold::Leaving) if !held => {
                self.hold = None;
                self.events.push_back(Event::Resumed);
            }
            _ => {}
        }
        if self.hold.is_some() {
            return;
        }
        match &mut self.pause {
            Some(pause) if held && !pause.told => {
                pause.told = true;
                self.events.push_back(Event::Prompt(pause.comment.clone()));
            }
            Some(pause) if !held && pause.answered => self.pause = None,
            Some(_) => {}
            // Somebody has pressed a button or opened the door.
            None if held || name == "Door" => {
                if !self.hold_told {
                    self.events
                        .push_back(Event::Message(format!("{name}; the job goes on when the plotter is resumed")));
                }
                self.hold_told = true;
            }
            None => self.hold_told = false,
        }
    }

    fn reset(&mut self, now: Duration) {
        self.realtime(RESET);
        self.on_the_way.clear();
        self.used = 0;
        self.enter(Phase::Resetting, now);
    }

    fn finish_stopping(&mut self) {
        let at = self.place();
        let fault = self.fault.take().unwrap_or(Fault::Cancelled { at });
        self.fail(fault);
    }

    /// Sends lines of ours, each when the one before it is answered. True when none is left.
    fn run_errands(&mut self) -> bool {
        if !self.on_the_way.is_empty() {
            return false;
        }
        match self.errands.pop_front() {
            Some(text) => {
                self.send(&text, What::Errand);
                false
            }
            None => true,
        }
    }

    /// Sends as many lines of the job as may be on the way.
    fn stream(&mut self, now: Duration) {
        while let Some(line) = self.job.lines().get(self.next) {
            if self.pause.is_some() {
                return;
            }
            let alone_before = self.on_the_way.back().is_some_and(|sent| match sent.what {
                What::Line(index) => self.job.lines().get(index).is_some_and(|line| line.turn != Turn::Streamed),
                What::Errand | What::Barrier => true,
            });
            let alone = line.turn != Turn::Streamed;
            let full = self.used + line.text.len() + 1 > self.rx_limit;
            if alone_before || full || (alone && !self.on_the_way.is_empty()) {
                return;
            }
            if line.turn == Turn::AtRest && !self.at_rest {
                self.send(BARRIER, What::Barrier);
                return;
            }
            if let Turn::Pause(comment) = &line.turn {
                self.pause = Some(Pause { comment: comment.clone(), told: false, answered: false });
            }
            let text = line.text.clone();
            self.send(&text, What::Line(self.next));
            self.next += 1;
        }
        if self.on_the_way.is_empty() && self.pause.is_none() {
            self.send(BARRIER, What::Barrier);
            self.enter(Phase::Barrier, now);
        }
    }

    /// Asks for the status now and then, and fails when the controller is silent or idle for too long.
    fn watch(&mut self, now: Duration) {
        // A controller that waits for its user may wait for ever.
        let waiting = self.hold.is_some() || self.pause.as_ref().is_some_and(|pause| pause.told);
        if now.saturating_sub(self.last_poll) >= POLL_INTERVAL {
            self.realtime(STATUS);
            self.last_poll = now;
        }
        let at_rest = matches!(self.on_the_way.front(), Some(Sent { what: What::Line(index), .. })
            if self.job.lines().get(*index).is_some_and(|line| line.turn == Turn::AtRest));
        let allowed = if at_rest { SILENCE_MAX_AT_REST } else { SILENCE_MAX };
        let silent = now.saturating_sub(self.last_heard);
        if silent > allowed {
            let at = self.place();
            return self.fail(Fault::Silent { at, seconds: silent.as_secs() });
        }
        let owed = !self.on_the_way.is_empty() && !waiting && !at_rest;
        let idle = self.idle_since.map_or(Duration::ZERO, |since| now.saturating_sub(since));
        if owed && idle > IDLE_MAX + self.job.longest_dwell() {
            let at = self.place();
            self.stop(Fault::Lost { at }, now);
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

/// The controller's answer to a line of the job, or to the barrier at its end.
fn refused(at: Place, code: &str) -> Fault {
    let meaning = code.parse().map_or("in the controller's own words", codes::error);
    Fault::Refused { at, code: code.to_owned(), meaning }
}

impl Protocol for Grbl {
    fn receive(&mut self, bytes: &[u8], now: Duration) {
        if !bytes.is_empty() {
            self.last_heard = now;
        }
        for &byte in bytes {
            match byte {
                b'\n' => {
                    let line = std::mem::take(&mut self.input);
                    let line = String::from_utf8_lossy(&line);
                    self.line(line.trim(), now);
                }
                _ if self.input.len() < INPUT_MAX => self.input.push(byte),
                _ => {}
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
                if self.run_errands() {
                    self.enter(Phase::Streaming, now);
                    self.last_heard = now;
                    match self.too_long() {
                        Some(fault) => self.fail(fault),
                        None => self.stream(now),
                    }
                } else if now.saturating_sub(self.last_heard) > SILENCE_MAX {
                    let baud = self.options.baud;
                    self.fail(Fault::NoAnswer { baud });
                }
            }
            Phase::Streaming => {
                self.stream(now);
                self.watch(now);
            }
            Phase::Barrier => self.watch(now),
            Phase::Holding => {
                if elapsed > HOLD_WAIT {
                    self.reset(now);
                } else if now.saturating_sub(self.last_poll) >= POLL_INTERVAL {
                    self.realtime(STATUS);
                    self.last_poll = now;
                }
            }
            Phase::Resetting if elapsed > RESET_WAIT => self.finish_stopping(),
            Phase::Lifting => {
                let lifted = self.run_errands();
                if lifted || elapsed > RESET_WAIT {
                    self.finish_stopping();
                }
            }
            _ => {}
        }
    }

    fn take_output(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.output)
    }

    fn take_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    fn control(&mut self, control: Control, now: Duration) {
        match control {
            Control::Hold => self.hold(now),
            Control::Resume => self.resume(now),
            Control::Stop => self.cancel(now),
            Control::Speed(percent) => self.speed(percent),
        }
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
