//! Marlin's line protocol.
//!
//! ```text
//!  Greeting ── `start`, or 2 s of silence ──> Numbering ── M110 answered ──> Streaming ── check at the end ──> Over (Done)
//!                     Streaming ── fault, cancel ──> Stopping ── M410, pen up ──> Over (Failed)
//! ```
//!
//! Each line goes out as `N1001 G1 X1 *cs` without the blanks: numbered, and with the exclusive or of all bytes before the `*`.
//! Marlin takes a line only if both are right, and else says `Resend: n` and forgets what it has not read. So a line is
//! neither lost nor drawn twice, whatever is sent again; a missing `ok` is recovered by sending the oldest line again, which
//! Marlin, if it has it, answers with the number of the last line that it took.
//!
//! `ok` means that a line is planned. At each end of a stroke `M400` waits for the motion before it, and `M114` tells the
//! place, which is held against where the job leads: what is executed is known from there.

mod check;
mod control;
mod line;

use std::collections::VecDeque;
use std::time::Duration;

use super::grbl::{Job, Turn};
use super::heights::Heights;
use super::{Control, Event, Fault, Input, Outbox, Place, Progress, Protocol, Unit};
use crate::trace::gcode::{Machine, follow};
use crate::trace::{Position, Trace};
use check::Checking;
use line::{Answer, numbered};

/// Time from opening the port in which a banner may come: boards that reset have a boot loader to run through.
const BANNER_WAIT: Duration = Duration::from_secs(2);
/// A board that has begun to speak is ready when it has been silent for so long.
const BANNER_QUIET: Duration = Duration::from_millis(500);
/// Time for an answer to the first line, and attempts.
const NUMBER_WAIT: Duration = Duration::from_secs(2);
const NUMBER_MAX: u32 = 5;
/// Marlin says every two seconds that it is busy; after this silence the oldest line is sent again.
const QUIET_MAX: Duration = Duration::from_secs(5);
/// Times in a row that lines are sent again without one being taken.
const AGAIN_MAX: u32 = 6;
/// What is on the way when a line is asked for again is waited for: it may ask for the same again.
const RESEND_QUIET: Duration = Duration::from_millis(100);
/// Silence that ends the job, though lines were sent again.
const SILENCE_MAX: Duration = Duration::from_secs(30);
/// A controller that is busy for so long with one line is not coming back.
const BUSY_MAX: Duration = Duration::from_secs(3600);
/// Time in which the pen is lifted after the job was stopped.
const STOP_WAIT: Duration = Duration::from_secs(3);
/// Lines that are kept behind the oldest one that is not answered: more than any Marlin has under way.
const KEPT: usize = 64;
/// The number before the first line. G and M codes end below: an `N` that is changed to one of them makes no command.
const FIRST: u32 = 1000;

const BARRIER: &str = "M400";
const WHERE: &str = "M114";

/// What the conversation must know besides the job.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Receive buffer of the controller in bytes.
    pub rx_bytes: usize,
    /// Lines that it holds before it carries them out: `BUFSIZE`.
    pub buffer_lines: usize,
    /// The machine, to follow what the job does.
    pub machine: Machine,
    /// Lines that lift the pen after a job was stopped.
    pub lift: Vec<String>,
    /// Speed of the line, for messages.
    pub baud: u32,
}

/// A conversation with a Marlin controller that streams one job.
#[derive(Debug)]
pub struct Marlin {
    job: Job,
    options: Options,
    trace: Trace,
    /// Indices of the first lines after the places where the job is held against the machine; the last is its end.
    checks: Vec<usize>,
    phase: Phase,
    since: Duration,
    input: Input,
    outbox: Outbox,
    /// Lines that were sent, by their numbers; older ones are forgotten.
    sent: VecDeque<Sent>,
    /// How many were forgotten.
    forgotten: u32,
    /// Number of the oldest line that is not answered.
    oldest: u32,
    /// Number of the line that goes out next, again or for the first time.
    upcoming: u32,
    /// Lines of ours that go before the next one of the job.
    queue: VecDeque<(String, What)>,
    /// Index of the job's next line.
    next: usize,
    answered: usize,
    executed: usize,
    /// Index of the next check.
    part: usize,
    checking: Option<Checking>,
    /// Lines go out one by one until one that was asked for again is taken.
    recovery: Option<Recovery>,
    /// Times in a row that lines went out again without one being taken.
    again: u32,
    /// The line before asked for a line again; an `ok` may belong to that.
    after_resend: bool,
    /// An answer was waited for in vain, and its line sent again.
    gave_up: bool,
    /// Whether the controller is at rest before the job's next line.
    at_rest: bool,
    heights: Heights,
    pause: Option<String>,
    hold: Option<Hold>,
    pausing: bool,
    /// Why the job is being stopped.
    fault: Option<Fault>,
    attempts: u32,
    last_heard: Duration,
    /// When lines last went out or were answered.
    last_step: Duration,
    /// When a line was last answered.
    last_taken: Duration,
    told_busy: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Greeting,
    Numbering,
    Streaming,
    Stopping,
    Over,
}

#[derive(Clone, Debug)]
struct Sent {
    text: String,
    what: What,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum What {
    /// The job's line of this index.
    Line(usize),
    /// A line of ours.
    Ours,
    /// `M400`: answered at rest.
    Barrier,
    /// `M114`.
    Where,
}

/// A line was asked for again.
#[derive(Clone, Copy, Debug)]
struct Recovery {
    number: u32,
    /// Nothing goes out before.
    until: Duration,
}

/// A rest that the user asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Hold {
    /// What the controller has is still drawn.
    Draining,
    /// It rests, and the user was told.
    AtRest,
}

impl Marlin {
    /// A conversation that has not begun. The port is opened at time 0.
    #[must_use]
    pub fn new(job: Job, options: Options) -> Self {
        let trace = follow(&job, &options.machine, &options.machine.before(), Position::UNKNOWN).trace;
        Self {
            checks: check::places(&job, &trace),
            heights: Heights::new(options.machine.pen),
            trace,
            job,
            options,
            phase: Phase::Greeting,
            since: Duration::ZERO,
            input: Input::default(),
            outbox: Outbox::default(),
            sent: VecDeque::new(),
            forgotten: 0,
            oldest: FIRST + 1,
            upcoming: FIRST + 1,
            queue: VecDeque::new(),
            next: 0,
            answered: 0,
            executed: 0,
            part: 0,
            checking: None,
            recovery: None,
            again: 0,
            after_resend: false,
            gave_up: false,
            at_rest: false,
            pause: None,
            hold: None,
            pausing: false,
            fault: None,
            attempts: 0,
            last_heard: Duration::ZERO,
            last_step: Duration::ZERO,
            last_taken: Duration::ZERO,
            told_busy: false,
        }
    }

    fn enter(&mut self, phase: Phase, now: Duration) {
        self.phase = phase;
        self.since = now;
    }

    fn fail(&mut self, fault: Fault) {
        self.phase = Phase::Over;
        self.outbox.tell(Event::Failed(fault));
    }

    /// Stops the motion and lifts the pen, then fails. Boards with an emergency parser stop at once, others behind what they hold.
    fn stop(&mut self, fault: Fault, now: Duration) {
        self.fault = Some(fault);
        self.checking = None;
        self.pause = None;
        self.outbox.write(b"M410\n");
        for line in &self.options.lift {
            self.outbox.line(&self.heights.rewritten(line));
        }
        self.enter(Phase::Stopping, now);
    }

    /// Number after that of the newest line that was ever sent.
    fn end(&self) -> u32 {
        self.first_kept() + self.sent.len() as u32
    }

    /// Number of the oldest line that is still known.
    fn first_kept(&self) -> u32 {
        FIRST + 1 + self.forgotten
    }

    /// Takes one line of the controller.
    fn line(&mut self, line: &str, now: Duration) {
        let answer = line::parse(line);
        let after_resend = std::mem::take(&mut self.after_resend);
        match answer {
            Answer::Start if self.phase == Phase::Streaming => {
                let at = self.place();
                self.fail(Fault::Restarted { at });
            }
            Answer::Halted if !matches!(self.phase, Phase::Over | Phase::Stopping) => {
                let (at, code) = (self.place(), "halt".to_owned());
                self.fail(Fault::Alarm { at, code, meaning: "it has halted itself and must be reset" });
            }
            Answer::Ok(None) if after_resend => {}
            Answer::Ok(number) => self.ok(number, now),
            Answer::Resend(number) => self.resend(number, now),
            Answer::Error(text) if self.phase == Phase::Streaming => {
                let at = self.place();
                self.stop(Fault::Complaint { at, text: text.to_owned() }, now);
            }
            Answer::Unknown(command) if self.phase == Phase::Streaming => self.unknown_command(command, now),
            Answer::Where(place) => self.place_told(place, now),
            Answer::BusyForUser if !self.told_busy => {
                self.told_busy = true;
                self.outbox.tell(Event::Message("the plotter waits for its user".into()));
            }
            Answer::Message(text) => self.outbox.tell(Event::Message(text.to_owned())),
            _ => {}
        }
    }

    /// A line was taken: the oldest, or all up to the one of this number.
    fn ok(&mut self, number: Option<u32>, now: Duration) {
        if self.phase == Phase::Numbering {
            self.enter(Phase::Streaming, now);
            (self.last_taken, self.last_step) = (now, now);
            return;
        }
        let up_to = match number {
            Some(number) if (self.oldest..self.upcoming).contains(&number) => number + 1,
            // Answered before, or mangled.
            Some(_) => return,
            None => (self.oldest + 1).min(self.upcoming),
        };
        self.taken(up_to, now);
    }

    /// All lines before this number are taken.
    fn taken(&mut self, up_to: u32, now: Duration) {
        while self.oldest < up_to {
            let index = (self.oldest - self.first_kept()) as usize;
            let what = self.sent.get(index).map(|sent| sent.what);
            self.oldest += 1;
            self.again = 0;
            self.told_busy = false;
            (self.last_taken, self.last_step) = (now, now);
            match what {
                Some(What::Line(line)) => {
                    self.answered = self.answered.max(line + 1);
                    self.at_rest = false;
                }
                Some(What::Barrier) => self.rests(now),
                Some(What::Where) => self.where_answered(now),
                Some(What::Ours) | None => {}
            }
        }
        if self.recovery.is_some_and(|recovery| recovery.number < self.oldest) {
            self.recovery = None;
        }
        while self.sent.len() > KEPT && self.first_kept() + (KEPT as u32) < self.oldest {
            self.sent.pop_front();
            self.forgotten += 1;
        }
    }

    /// The controller has taken all lines before this number, and has read no other.
    fn resend(&mut self, number: u32, now: Duration) {
        self.after_resend = true;
        if self.phase == Phase::Numbering {
            // What somebody has left half written is gone now.
            self.number_lines(now);
            return;
        }
        if self.phase != Phase::Streaming || !(self.first_kept()..=self.end()).contains(&number) {
            return;
        }
        if self.recovery.is_some_and(|recovery| recovery.number == number && now < recovery.until) {
            return;
        }
        // Those before it were taken. Their answers may come yet, unless we had given up waiting for them.
        if std::mem::take(&mut self.gave_up) {
            self.taken(number, now);
        }
        self.again += 1;
        if self.again > AGAIN_MAX {
            let at = self.place();
            return self.stop(Fault::Lost { at }, now);
        }
        if number < self.end() {
            self.recovery = Some(Recovery { number, until: now + RESEND_QUIET });
        }
        self.oldest = self.oldest.min(number);
        self.upcoming = number;
        self.last_step = now;
    }

    /// Marlin does not know a command: one of the job, unless the line was mangled.
    fn unknown_command(&mut self, command: &str, now: Duration) {
        let plain: String = command.chars().filter(char::is_ascii_graphic).collect();
        let first = self.first_kept();
        let found = self.sent.iter().enumerate().find_map(|(k, sent)| match sent.what {
            What::Line(line) if sent.text == plain && first + k as u32 >= self.oldest => Some(line),
            _ => None,
        });
        if let Some(line) = found {
            let fault = Fault::Complaint { at: self.place_of(line), text: "it does not know this command".to_owned() };
            self.stop(fault, now);
        }
    }

    fn number_lines(&mut self, now: Duration) {
        self.outbox.write(numbered(FIRST, &format!("M110N{FIRST}")).as_bytes());
        self.enter(Phase::Numbering, now);
    }

    /// Sends as many lines as may be on the way.
    fn stream(&mut self, now: Duration) {
        while self.phase == Phase::Streaming {
            let alone = match self.recovery {
                Some(recovery) if now < recovery.until => return,
                recovery => recovery.is_some(),
            };
            let on_the_way = (self.upcoming - self.oldest) as usize;
            let lines = if alone { 1 } else { self.options.buffer_lines };
            if on_the_way >= lines || (self.upcoming >= self.end() && !self.prepare()) {
                return;
            }
            let index = (self.upcoming - self.first_kept()) as usize;
            let Some(sent) = self.sent.get(index) else { return };
            let line = numbered(self.upcoming, &sent.text);
            let bytes: usize =
                self.sent.iter().take(index).rev().take(on_the_way).map(|sent| sent.text.len() + 12).sum();
            if on_the_way > 0 && bytes + line.len() >= self.options.rx_bytes {
                return;
            }
            self.outbox.write(line.as_bytes());
            self.upcoming += 1;
            self.last_step = now;
        }
    }

    /// Puts the next line behind those that were sent; false if there is none to be sent now.
    fn prepare(&mut self) -> bool {
        if let Some((text, what)) = self.queue.pop_front() {
            self.sent.push_back(Sent { text, what });
            return true;
        }
        if self.checking.is_some() || self.pause.is_some() || self.hold.is_some() {
            return false;
        }
        if self.checks.get(self.part).is_none_or(|end| self.next >= *end) {
            self.begin_check();
            return self.prepare();
        }
        let Some(line) = self.job.lines().get(self.next) else { return false };
        if let Turn::Pause(comment) = &line.turn {
            if self.at_rest && self.oldest == self.upcoming {
                self.outbox.tell(Event::Prompt(comment.clone()));
                self.pause = Some(comment.clone());
            } else if self.oldest == self.upcoming {
                self.sent.push_back(Sent { text: BARRIER.to_owned(), what: What::Barrier });
                return true;
            }
            return false;
        }
        let moves_pen = line.text.starts_with("M280") || line.text.contains('Z');
        let text = if moves_pen { self.heights.rewritten(&line.text) } else { line.text.clone() };
        self.sent.push_back(Sent { text, what: What::Line(self.next) });
        self.next += 1;
        true
    }

    /// Looks after a controller that does not answer.
    fn watch(&mut self, now: Duration) {
        let silent = now.saturating_sub(self.last_heard);
        if self.oldest == self.upcoming {
            // Nothing is owed; only what waits for its user may wait for ever.
            self.last_heard = now;
            self.last_taken = now;
            return;
        }
        if silent > SILENCE_MAX {
            let at = self.place();
            return self.stop(Fault::Silent { at, seconds: silent.as_secs() }, now);
        }
        let busy = now.saturating_sub(self.last_taken);
        if busy > BUSY_MAX {
            let at = self.place();
            return self.stop(Fault::Motionless { at, seconds: busy.as_secs() }, now);
        }
        if silent.min(now.saturating_sub(self.last_step)) > QUIET_MAX {
            self.again += 1;
            if self.again > AGAIN_MAX {
                let at = self.place();
                return self.stop(Fault::Lost { at }, now);
            }
            self.recovery = Some(Recovery { number: self.oldest, until: now });
            self.gave_up = true;
            self.upcoming = self.oldest;
            self.stream(now);
        }
    }

    fn place_of(&self, index: usize) -> Place {
        match self.job.lines().get(index) {
            Some(line) => Place { unit: Unit::Line, number: line.number, text: line.text.clone() },
            None => Place { unit: Unit::Line, number: 0, text: String::new() },
        }
    }
}

impl Protocol for Marlin {
    fn receive(&mut self, bytes: &[u8], now: Duration) {
        if !bytes.is_empty() {
            self.last_heard = now;
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
        let quiet = now.saturating_sub(self.last_heard);
        match self.phase {
            Phase::Greeting if elapsed >= BANNER_WAIT && quiet >= BANNER_QUIET => self.number_lines(now),
            Phase::Numbering if elapsed >= NUMBER_WAIT => {
                self.attempts += 1;
                if self.attempts >= NUMBER_MAX {
                    let baud = self.options.baud;
                    self.fail(Fault::NoAnswer { baud });
                } else {
                    self.number_lines(now);
                }
            }
            Phase::Streaming => {
                self.advance_check(now);
                self.stream(now);
                self.watch(now);
            }
            Phase::Stopping if elapsed >= STOP_WAIT => {
                let at = self.place();
                let fault = self.fault.take().unwrap_or(Fault::Cancelled { at });
                self.fail(fault);
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
            Phase::Greeting | Phase::Numbering => self.place_of(usize::MAX),
            _ => self.place_of(self.answered.min(self.job.lines().len() - 1)),
        }
    }
}

#[cfg(test)]
mod tests;
