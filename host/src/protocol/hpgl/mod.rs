//! HPGL over a serial line.
//!
//! ```text
//!  Probing ── which handshake it knows, how large its buffer is ──> Sending ── all questions answered ──> Finishing ──> Over
//! ```
//!
//! A plotter's buffer holds from 60 bytes to some thousands, and what overflows is lost. Which handshake keeps it from
//! overflowing is found out in this order (see [`Handshake`]): `ESC.B` is obeyed at once and tells the free bytes; as it
//! travels behind all that was sent before, the number counts it, and so many bytes may follow. Or the plotter stops the line
//! (Xon/Xoff), or grants block after block (ENQ/ACK), or its DTR does. What is known of all of them is `OA;`: its reply says
//! that all before it is out of the buffer.
//!
//! There is no checksum. But `OA;` also tells where the pen is, and instructions are sent in such a way that this shows whether
//! all of them arrived (see `words`): the job stops where the plotter is not where it must be. The questions travel behind
//! the strokes, and nothing waits for the answers. `OE;` goes with them where the plotter knows it: what counts as executed is
//! drawn where it must be, and nothing of it was refused.

mod answers;
mod codes;
pub(crate) mod encoded;
mod flow;
mod holders;
mod job;
mod probe;
mod replies;
mod words;

use std::time::Duration;

pub(crate) use flow::RESERVE;
pub use holders::{Holders, Swap};
pub use job::{Job, JobError};

use super::{Control, Event, Fault, Input, Lines, Outbox, Place, Progress, Protocol, Unit};
use crate::device::Handshake;
use answers::{Answers, Verdict};
use flow::Flow;
use probe::Probe;
use replies::{Asked, Question};
use words::{Ask, Expected, Limits, Words};

/// Time for an answer to what is obeyed at once. At 300 baud, 20 bytes take 0.7 s.
const ANSWER_WAIT: Duration = Duration::from_secs(3);
/// Times that such a question is put.
const ASK_MAX: u32 = 3;
/// Time between questions for the free space while the buffer is full.
const POLL_INTERVAL: Duration = Duration::from_millis(100);
/// Time between enquiries for room.
const ENQUIRE_INTERVAL: Duration = Duration::from_secs(1);
/// Time between questions for the status while nothing is to be sent.
const STATUS_INTERVAL: Duration = Duration::from_millis(500);
/// So many questions for the space, and one is for the status instead: has its user halted it?
const POLLS_PER_STATUS: u32 = 20;
/// Times without any progress after which the plotter is asked again where it is: an answer may have been lost, or its
/// question. A long line drawn slowly takes its time.
const REPEAT_AFTER: [Duration; 3] = [Duration::from_secs(10), Duration::from_secs(60), Duration::from_secs(200)];
/// Time without any progress after which the plotter is given up.
const PROGRESS_MAX: Duration = Duration::from_secs(600);

const XON: u8 = 0x11;
const XOFF: u8 = 0x13;
const ENQ: u8 = 0x05;
const ACK: u8 = 0x06;
/// Aborts what is buffered, lifts the pen and puts it away.
const ABORT: &[u8] = b"\x1b.K;PU;SP0;";

/// What the conversation must know besides the job.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Name of the device, for messages.
    pub name: String,
    /// Size of the plotter's buffer in bytes, when it does not tell.
    pub buffer_bytes: usize,
    /// Most points in a list.
    pub list_points: usize,
    /// Whether strokes go in `PE`.
    pub encoded: bool,
    /// How many pens the plotter holds; others are asked for when their turn comes.
    pub pens: u32,
    /// How the buffer is kept from overflowing.
    pub handshake: Handshake,
    /// Speed where the job says none, and the fastest, in cm/s; none where the plotter's speed cannot be set.
    pub speeds: Option<(f64, u32)>,
    /// Speed of the line in baud.
    pub baud: u32,
}

/// A conversation with an HPGL plotter that sends one job.
#[derive(Debug)]
pub struct Hpgl {
    job: Job,
    options: Options,
    phase: Phase,
    words: Words,
    answers: Answers,
    flow: Flow,
    /// Question that is to be answered at once.
    asked: Option<Asked>,
    /// What a number means that may be an error's, or a mangled answer to that question.
    doubt: Option<Verdict>,
    /// When the last of them was answered or given up.
    answered: Duration,
    /// Questions for the space that found too little, in a row.
    waits: u32,
    /// Bits of the status that its user was told of.
    told: u32,
    /// What was sent last.
    last: Expected,
    /// Whether that ends with the end of an instruction.
    whole: bool,
    /// When something last went on, and how often the plotter was asked since then where it is.
    progressed: Duration,
    repeats: usize,
    /// Lines of the port that were ever up: those that are wired.
    wired: Lines,
    /// When the plotter was asked for room for a block.
    enquired: Option<Duration>,
    pause: Option<Pause>,
    input: Input,
    outbox: Outbox,
    /// Instructions that the plotter has, and those that are carried out.
    received: usize,
    executed: usize,
    /// Whether the plotter answers `OE;`.
    tells_errors: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Probing(Probe),
    Sending,
    Finishing,
    Over,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Pause {
    /// The stroke that is being drawn is drawn to its end.
    Wanted,
    /// The plotter rests, and the user was told.
    AtRest,
    /// The user was asked to put a pen into its holder.
    Swap,
}

impl Hpgl {
    /// A conversation that has not begun.
    #[must_use]
    pub fn new(job: Job, options: Options) -> Self {
        let flow = Flow::new(options.buffer_bytes, options.baud);
        Self {
            job,
            phase: Phase::Probing(Probe::Begin),
            words: Words::new(Self::limits(&options, options.buffer_bytes, Handshake::Oa, Ask::Place)),
            answers: Answers::default(),
            flow,
            options,
            asked: None,
            doubt: None,
            answered: Duration::ZERO,
            waits: 0,
            told: 0,
            last: Expected::default(),
            whole: true,
            progressed: Duration::ZERO,
            repeats: 0,
            wired: Lines::default(),
            enquired: None,
            pause: None,
            input: Input::default(),
            outbox: Outbox::default(),
            received: 0,
            executed: 0,
            tells_errors: false,
        }
    }

    /// The handshake that is spoken; the one asked for while that is not known.
    #[must_use]
    pub fn handshake(&self) -> Handshake {
        if matches!(self.phase, Phase::Probing(_)) { self.options.handshake } else { self.flow.handshake }
    }

    fn limits(options: &Options, buffer_bytes: usize, handshake: Handshake, question: Ask) -> Limits {
        Limits {
            buffer_bytes,
            list_points: options.list_points,
            encoded: options.encoded,
            pens: options.pens,
            asks_often: handshake != Handshake::EscB,
            question,
            speeds: options.speeds,
        }
    }

    fn put(&mut self, bytes: &[u8], now: Duration) {
        self.outbox.write(bytes);
        self.flow.send(bytes.len(), now);
    }

    fn goes_on(&mut self, now: Duration) {
        (self.progressed, self.repeats) = (now, 0);
    }

    fn fail(&mut self, fault: Fault) {
        self.phase = Phase::Over;
        self.asked = None;
        self.outbox.tell(Event::Failed(fault));
    }

    /// Aborts what the plotter has in its buffer, and fails.
    fn abort(&mut self, fault: Fault) {
        self.outbox.discard_bytes();
        self.outbox.write(ABORT);
        self.fail(fault);
    }

    /// What follows from an answer to the question where the plotter is.
    fn judge(&mut self, verdict: Verdict, now: Duration) {
        match verdict {
            Verdict::Right { pieces, sent } => {
                self.flow.consume(sent);
                if pieces > self.executed {
                    self.goes_on(now);
                }
                if self.doubt.is_none() {
                    self.executed = self.executed.max(pieces);
                }
                self.received = self.received.max(pieces);
                if self.phase == Phase::Probing(Probe::Turn) && !self.answers.is_waiting() {
                    self.probe_answered(now);
                }
            }
            Verdict::Open => {}
            Verdict::AskAgain => self.put(Ask::Place.bytes(), now),
            Verdict::Astray { first, last, expected, at, down } => {
                let place = |at: Option<[i64; 2]>, down: Option<bool>| {
                    let at = at.map_or("anywhere".into(), |[x, y]| format!("at ({x}, {y})"));
                    match down {
                        Some(true) => format!("{at} with the pen down"),
                        Some(false) => format!("{at} with the pen up"),
                        None => at,
                    }
                };
                self.abort(Fault::Astray {
                    first: first + 1,
                    last: last.max(first + 1),
                    found: place(Some(at), Some(down)),
                    wanted: place(expected.at, expected.down),
                });
            }
            Verdict::Refused { first, last, error } => {
                let meaning = codes::instruction_error(error);
                self.abort(Fault::Erred { first: first + 1, last: last.max(first + 1), code: error, meaning });
            }
            Verdict::Noise => {
                let at = self.place();
                self.abort(Fault::Noise { at });
            }
        }
    }

    /// Sends what may be sent now.
    fn send(&mut self, now: Duration) {
        while !self.answers.is_frozen() {
            let resting = self.pause.is_some() && self.words.may_rest();
            let unit = if resting { self.words.rest() } else { self.words.peek(&self.job) };
            let Some(bytes) = unit.map(|unit| unit.bytes.len()) else { break };
            let asks = unit.is_some_and(|unit| unit.asks.is_some());
            // The reserve is there for questions.
            if !self.flow.may_send(if asks { 0 } else { bytes }, !self.whole, now) {
                return self.blocked(bytes, now);
            }
            let Some(unit) = self.words.take() else { break };
            self.put(&unit.bytes, now);
            if let Some(ask) = unit.asks {
                self.answers.asked(ask, unit.after, self.flow.sent());
            }
            (self.last, self.whole) = (unit.after, unit.whole);
            self.goes_on(now);
        }
        if self.answers.is_waiting() || self.answers.is_frozen() || self.doubt.is_some() {
            return;
        }
        match self.pause {
            Some(Pause::Wanted) if self.words.may_rest() => {
                self.pause = Some(Pause::AtRest);
                self.outbox.tell(Event::Paused);
            }
            Some(Pause::AtRest | Pause::Swap) => self.goes_on(now),
            _ if self.words.swap().is_some() => self.want_swap(),
            _ if self.words.peek(&self.job).is_none() => {
                self.phase = Phase::Finishing;
                self.pause = None;
                self.asked = None;
                self.finish_line(now);
            }
            _ => {}
        }
    }

    /// A unit must wait: asks for what it waits for.
    fn blocked(&mut self, bytes: usize, now: Duration) {
        let waiting = self.answers.is_waiting();
        match self.flow.handshake {
            Handshake::EscB => {
                let full = now.saturating_sub(self.answered) < POLL_INTERVAL;
                if self.asked.is_none() && (!full || self.waits == 0) {
                    let status = self.waits % POLLS_PER_STATUS == POLLS_PER_STATUS - 1;
                    self.waits += u32::from(status);
                    self.ask(if status { Question::Status } else { Question::Space }, now);
                }
            }
            // A plotter without room may answer later, or not at all.
            Handshake::EnqAck
                if self.flow.granted() < bytes
                    && self.enquired.is_none_or(|since| now.saturating_sub(since) > ENQUIRE_INTERVAL) =>
            {
                self.outbox.write(&[ENQ]);
                self.enquired = Some(now);
            }
            _ if self.flow.has_room(bytes) => {}
            _ if self.whole && !waiting => self.ask_where(self.question(), now),
            Handshake::Oa | Handshake::Auto if !waiting => {
                // Nobody tells how much of it has left the buffer, and a question within it would be part of it.
                let line = self.last.pieces + 1;
                let length = self.job.instructions().get(self.last.pieces).map_or(bytes, Vec::len);
                self.abort(Fault::LineTooLong { line, length, limit: self.flow.buffer });
            }
            _ => {}
        }
    }

    /// Puts the question where the plotter is behind all that was sent.
    fn ask_where(&mut self, ask: Ask, now: Duration) {
        self.put(ask.bytes(), now);
        self.answers.asked(ask, self.last, self.flow.sent());
    }

    /// What the plotter is asked behind what it draws.
    fn question(&self) -> Ask {
        if self.tells_errors { Ask::Check } else { Ask::Place }
    }

    /// Looks after what is overdue.
    fn watch(&mut self, now: Duration) {
        if self.is_overdue(now).is_some() {
            return self.silent(now);
        }
        if self.flow.handshake == Handshake::EscB
            && self.asked.is_none()
            && now.saturating_sub(self.answered) >= STATUS_INTERVAL
        {
            self.ask(Question::Status, now);
        }
        let idle = now.saturating_sub(self.progressed);
        if idle > PROGRESS_MAX {
            return self.silent(now);
        }
        let repeats = REPEAT_AFTER.iter().filter(|after| idle > **after).count();
        if repeats > self.repeats && self.whole && self.flow.may_repeat(Ask::Place.bytes().len()) {
            self.repeats = repeats;
            self.enquired = None;
            self.ask_where(Ask::Place, now);
        }
    }

    fn silent(&mut self, now: Duration) {
        let seconds = now.saturating_sub(self.progressed).as_secs();
        let at = self.place();
        self.abort(Fault::Silent { at, seconds });
    }

    /// The last question of all, to a plotter that knows device control.
    fn finish_line(&mut self, now: Duration) {
        if self.flow.handshake == Handshake::EscB {
            self.ask(Question::LineError, now);
        } else {
            self.finish();
        }
    }

    fn finish(&mut self) {
        self.phase = Phase::Over;
        self.asked = None;
        self.executed = self.job.instructions().len();
        self.outbox.tell(Event::Done);
    }

    fn pause(&mut self) {
        if self.phase == Phase::Sending && self.pause.is_none() {
            self.pause = Some(Pause::Wanted);
        }
    }

    /// Asks for a pen, once nothing else is asked that time could run out for meanwhile.
    fn want_swap(&mut self) {
        if let Some(Swap { pen, holder }) = self.words.swap().filter(|_| self.asked.is_none()) {
            let place = if self.options.pens > 1 { format!("holder {holder}") } else { "the holder".to_owned() };
            self.pause = Some(Pause::Swap);
            self.outbox.tell(Event::Prompt(format!("put pen {pen} into {place}")));
        }
    }

    fn resume(&mut self, now: Duration) {
        self.goes_on(now);
        match self.pause.take() {
            Some(Pause::AtRest) => self.outbox.tell(Event::Resumed),
            Some(Pause::Swap) => self.words.swapped(),
            Some(Pause::Wanted) | None => {}
        }
    }
}

impl Protocol for Hpgl {
    fn receive(&mut self, bytes: &[u8], now: Duration) {
        for &byte in bytes {
            match byte {
                b'\r' | b'\n' => {
                    let reply = self.input.end();
                    if !reply.is_empty() {
                        self.reply(&reply, now);
                    }
                }
                XON => self.line_went_on(now),
                XOFF => self.line_stopped(now),
                ACK => self.block_granted(now),
                _ => self.input.push(byte),
            }
        }
        self.tick(now);
    }

    fn tick(&mut self, now: Duration) {
        match self.phase {
            Phase::Probing(probe) => self.probe(probe, now),
            Phase::Sending => {
                self.send(now);
                if self.phase == Phase::Sending {
                    self.watch(now);
                }
            }
            // The drawing is done by then: a plotter that does not know the question is forgiven.
            Phase::Finishing => {
                if self.is_overdue(now).is_some() {
                    self.finish();
                }
            }
            Phase::Over => {}
        }
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
    }

    fn watches_lines(&self) -> bool {
        self.phase == Phase::Probing(Probe::Levels)
            || self.flow.handshake == Handshake::Hardware
            || self.flow.ready.is_some()
    }

    fn lines(&mut self, lines: Lines, now: Duration) {
        self.levels_told(lines, now);
    }

    fn control(&mut self, control: Control, now: Duration) {
        match control {
            Control::Stop if self.phase != Phase::Over => {
                let at = self.place();
                self.abort(Fault::Cancelled { at });
            }
            // What it has in its buffer it draws; at once it is halted at its own keys only.
            Control::Hold | Control::Pause => self.pause(),
            Control::Resume => self.resume(now),
            Control::Speed(percent) if self.options.speeds.is_some() => self.words.set_percent(percent),
            Control::Speed(_) => self.outbox.tell(Event::Warning("the plotter's speed cannot be set".to_owned())),
            Control::PenHeight { .. } => {
                self.outbox.tell(Event::Note("the plotter sets the height of its pen itself".to_owned()));
            }
            Control::Stop => {}
        }
    }

    fn progress(&self) -> Progress {
        Progress { acknowledged: self.received, executed: self.executed, total: self.job.instructions().len() }
    }

    fn place(&self) -> Place {
        let begun = !matches!(self.phase, Phase::Probing(_));
        let index = self.received.min(self.job.instructions().len() - 1);
        match self.job.instructions().get(index).filter(|_| begun) {
            Some(bytes) => {
                Place { unit: Unit::Instruction, number: index + 1, text: String::from_utf8_lossy(bytes).into_owned() }
            }
            None => Place { unit: Unit::Instruction, number: 0, text: String::new() },
        }
    }
}

#[cfg(test)]
mod tests;
