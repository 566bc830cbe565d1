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
//! the strokes, and nothing waits for the answers.

mod answers;
mod codes;
mod flow;
mod job;
mod probe;
mod words;

use std::collections::VecDeque;
use std::time::Duration;

pub use job::{Job, JobError};

use super::{Control, Event, Fault, Lines, Place, Progress, Protocol, Unit};
use crate::device::Handshake;
use answers::{Answers, Verdict};
use flow::{Flow, Free};
use probe::Probe;
use words::{ASK, Expected, Limits, Words};

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
/// Longest reply that is kept.
const INPUT_MAX: usize = 256;

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
    input: Vec<u8>,
    output: Vec<u8>,
    events: VecDeque<Event>,
    /// Instructions that the plotter has, and those that are carried out.
    received: usize,
    executed: usize,
    /// What the plotter reports at the end.
    reported: Vec<String>,
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
}

/// A question that is answered at once, or when the buffer is empty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Question {
    Space,
    Size,
    Status,
    LineError,
    InstructionError,
    Identity,
}

impl Question {
    fn bytes(self) -> &'static [u8] {
        match self {
            Self::Space => b"\x1b.B",
            Self::Size => b"\x1b.L",
            Self::Status => b"\x1b.O",
            Self::LineError => b"\x1b.E",
            Self::InstructionError => b"OE;",
            Self::Identity => b"OI;",
        }
    }

    /// Whether a number may be the answer. `buffer` is the size of the buffer.
    fn allows(self, number: usize, buffer: usize) -> bool {
        match self {
            Self::Space => number <= buffer,
            Self::Size => (1..=1 << 24).contains(&number),
            Self::Status | Self::InstructionError => number < 256,
            Self::LineError => number == 0 || (10..20).contains(&number),
            Self::Identity => false,
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Asked {
    question: Question,
    since: Duration,
    /// Times that it was put.
    times: u32,
    /// Bytes and instructions that were sent before it.
    sent: u64,
    pieces: usize,
}

impl Hpgl {
    /// A conversation that has not begun.
    #[must_use]
    pub fn new(job: Job, options: Options) -> Self {
        let flow = Flow::new(options.buffer_bytes, options.baud);
        let mut hpgl = Self {
            job,
            phase: Phase::Probing(Probe::Begin),
            words: Words::new(Self::limits(&options, options.buffer_bytes, Handshake::Oa)),
            answers: Answers::default(),
            flow,
            options,
            asked: None,
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
            input: Vec::new(),
            output: Vec::new(),
            events: VecDeque::new(),
            received: 0,
            executed: 0,
            reported: Vec::new(),
        };
        hpgl.input.reserve(INPUT_MAX);
        hpgl
    }

    /// The handshake that is spoken; the one asked for while that is not known.
    #[must_use]
    pub fn handshake(&self) -> Handshake {
        if matches!(self.phase, Phase::Probing(_)) { self.options.handshake } else { self.flow.handshake }
    }

    fn limits(options: &Options, buffer_bytes: usize, handshake: Handshake) -> Limits {
        Limits {
            buffer_bytes,
            list_points: options.list_points,
            asks_often: handshake != Handshake::EscB,
            speeds: options.speeds,
        }
    }

    fn put(&mut self, bytes: &[u8], now: Duration) {
        self.output.extend_from_slice(bytes);
        self.flow.send(bytes.len(), now);
    }

    fn goes_on(&mut self, now: Duration) {
        (self.progressed, self.repeats) = (now, 0);
    }

    fn ask(&mut self, question: Question, now: Duration) {
        self.ask_again(question, 1, now);
    }

    fn ask_again(&mut self, question: Question, times: u32, now: Duration) {
        let (sent, pieces) = (self.flow.sent(), self.last.pieces);
        self.output.extend_from_slice(question.bytes());
        self.asked = Some(Asked { question, since: now, times, sent, pieces });
    }

    /// The question that was put often enough and is given up, if it is overdue; one that was not is put again.
    fn is_overdue(&mut self, now: Duration) -> Option<Question> {
        let asked = self.asked?;
        if now.saturating_sub(asked.since) <= ANSWER_WAIT + self.flow.backlog(now) {
            return None;
        }
        // Not all know `OI;`.
        if asked.times < ASK_MAX && asked.question != Question::Identity {
            self.ask_again(asked.question, asked.times + 1, now);
            return None;
        }
        self.asked = None;
        self.answered = now;
        Some(asked.question)
    }

    fn fail(&mut self, fault: Fault) {
        self.phase = Phase::Over;
        self.asked = None;
        self.events.push_back(Event::Failed(fault));
    }

    /// Aborts what the plotter has in its buffer, and fails.
    fn abort(&mut self, fault: Fault) {
        self.output.clear();
        self.output.extend_from_slice(ABORT);
        self.fail(fault);
    }

    /// Takes one reply.
    fn reply(&mut self, reply: &str, now: Duration) {
        if self.phase == Phase::Over {
            return;
        }
        if let Some((at, down)) = position(reply) {
            let verdict = self.answers.take(at, down);
            return self.judge(verdict, now);
        }
        let number = reply.parse::<usize>().ok().filter(|_| reply.bytes().all(|byte| byte.is_ascii_digit()));
        match (self.asked, number) {
            (Some(asked), Some(number)) if asked.question.allows(number, self.size_limit()) => {
                self.asked = None;
                self.answered = now;
                self.told_number(asked, number, now);
            }
            (Some(asked), None) if asked.question == Question::Identity => {
                self.asked = None;
                self.identity(reply);
                self.probe_answered(now);
            }
            (asked, _) => {
                let verdict = self.answers.take_mangled();
                self.judge(verdict, now);
                if let Some(asked) = asked.filter(|asked| self.asked.is_some() && asked.times < ASK_MAX) {
                    self.ask_again(asked.question, asked.times + 1, now);
                }
            }
        }
    }

    /// Most free bytes that the plotter can have.
    fn size_limit(&self) -> usize {
        if matches!(self.phase, Phase::Probing(_)) { 1 << 24 } else { self.flow.buffer }
    }

    /// A question was answered with a number.
    fn told_number(&mut self, asked: Asked, number: usize, now: Duration) {
        match (self.phase, asked.question) {
            (Phase::Probing(_), question) => self.probe_told(question, number, now),
            (_, Question::Space) => {
                self.received = self.received.max(asked.pieces);
                match self.flow.free(number, asked.sent) {
                    Free::More => {
                        self.goes_on(now);
                        self.waits = 0;
                    }
                    Free::Unconfirmed => self.waits = 0,
                    Free::Same => self.waits += 1,
                }
            }
            (_, Question::Status) => self.status(number as u32, now),
            (_, Question::InstructionError) => {
                if number != 0 {
                    let meaning = codes::instruction_error(number as u32);
                    self.reported.push(format!("instruction error {number}, {meaning}"));
                }
                self.finish_line(now);
            }
            (_, Question::LineError) => {
                if number != 0 && number != codes::OUTPUT_OVERLAPS as usize {
                    let meaning = codes::line_error(number as u32);
                    self.reported.push(format!("line error {number}, {meaning}"));
                }
                self.finish();
            }
            (_, Question::Size | Question::Identity) => {}
        }
    }

    fn status(&mut self, bits: u32, now: Duration) {
        for (bit, message) in codes::HALTS {
            if bits & bit != 0 && self.told & bit == 0 {
                self.events.push_back(Event::Message(message.to_owned()));
            }
        }
        self.told = bits;
        // A plotter that its user has halted may rest for as long as it likes.
        if codes::HALTS.iter().any(|(bit, _)| bits & bit != 0) {
            self.goes_on(now);
        }
        if bits & codes::STATUS_EMPTY != 0 && !self.answers.is_waiting() {
            self.flow.consume(self.flow.sent());
        }
    }

    /// What follows from an answer to the question where the plotter is.
    fn judge(&mut self, verdict: Verdict, now: Duration) {
        match verdict {
            Verdict::Right { pieces, sent } => {
                self.flow.consume(sent);
                if pieces > self.executed {
                    self.goes_on(now);
                }
                self.executed = self.executed.max(pieces);
                self.received = self.received.max(pieces);
                if self.phase == Phase::Probing(Probe::Turn) && !self.answers.is_waiting() {
                    self.probe_answered(now);
                }
            }
            Verdict::Open => {}
            Verdict::AskAgain => self.put(ASK, now),
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
            let asks = unit.is_some_and(|unit| unit.asks);
            // The reserve is there for questions.
            if !self.flow.may_send(if asks { 0 } else { bytes }, !self.whole, now) {
                return self.blocked(bytes, now);
            }
            let Some(unit) = self.words.take() else { break };
            self.put(&unit.bytes, now);
            if unit.asks {
                self.answers.asked(unit.after, self.flow.sent());
            }
            (self.last, self.whole) = (unit.after, unit.whole);
            self.goes_on(now);
        }
        if self.answers.is_waiting() || self.answers.is_frozen() {
            return;
        }
        match self.pause {
            Some(Pause::Wanted) if self.words.may_rest() => {
                self.pause = Some(Pause::AtRest);
                self.events.push_back(Event::Paused);
            }
            Some(Pause::AtRest) => self.goes_on(now),
            _ if self.words.peek(&self.job).is_none() => {
                self.phase = Phase::Finishing;
                self.pause = None;
                self.asked = None;
                self.ask(Question::InstructionError, now);
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
                self.output.push(ENQ);
                self.enquired = Some(now);
            }
            _ if self.flow.has_room(bytes) => {}
            _ if self.whole && !waiting => self.ask_where(now),
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
    fn ask_where(&mut self, now: Duration) {
        self.put(ASK, now);
        self.answers.asked(self.last, self.flow.sent());
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
        if repeats > self.repeats && self.whole {
            self.repeats = repeats;
            self.enquired = None;
            self.ask_where(now);
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
        if self.reported.is_empty() {
            self.phase = Phase::Over;
            self.asked = None;
            self.executed = self.job.instructions().len();
            self.events.push_back(Event::Done);
        } else {
            let what = self.reported.join(" and ");
            self.fail(Fault::Reported { what });
        }
    }

    fn pause(&mut self) {
        if self.phase == Phase::Sending && self.pause.is_none() {
            self.pause = Some(Pause::Wanted);
        }
    }

    fn resume(&mut self, now: Duration) {
        if self.pause.take() == Some(Pause::AtRest) {
            self.goes_on(now);
            self.events.push_back(Event::Resumed);
        }
    }
}

/// Where the pen is and whether it is down, as `OA;` answers it.
fn position(reply: &str) -> Option<([i64; 2], bool)> {
    let mut parts = reply.split(',').map(str::trim);
    let (x, y, pen) = (parts.next()?, parts.next()?, parts.next()?);
    let number = |text: &str| {
        let digits = text.strip_prefix('-').unwrap_or(text);
        let is_number = (1..=7).contains(&digits.len()) && digits.bytes().all(|byte| byte.is_ascii_digit());
        text.parse::<i64>().ok().filter(|_| is_number)
    };
    let down = match pen {
        "0" => false,
        "1" => true,
        _ => return None,
    };
    parts.next().is_none().then_some(([number(x)?, number(y)?], down))
}

impl Protocol for Hpgl {
    fn receive(&mut self, bytes: &[u8], now: Duration) {
        for &byte in bytes {
            match byte {
                b'\r' | b'\n' => {
                    let reply = std::mem::take(&mut self.input);
                    let reply = String::from_utf8_lossy(&reply);
                    let reply = reply.trim();
                    if !reply.is_empty() {
                        self.reply(reply, now);
                    }
                }
                XON => self.line_went_on(now),
                XOFF => self.line_stopped(now),
                ACK => self.block_granted(now),
                _ if self.input.len() < INPUT_MAX => self.input.push(byte),
                _ => {}
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
            // The drawing is done by then: a plotter that does not know these questions is forgiven.
            Phase::Finishing => match self.is_overdue(now) {
                Some(Question::InstructionError) => self.finish_line(now),
                Some(_) => self.finish(),
                None => {}
            },
            Phase::Over => {}
        }
    }

    fn take_output(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.output)
    }

    fn take_event(&mut self) -> Option<Event> {
        self.events.pop_front()
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
            Control::Speed(percent) => self.words.set_percent(percent),
            _ => {}
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
