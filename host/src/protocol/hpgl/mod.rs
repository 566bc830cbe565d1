//! HPGL over a serial line.
//!
//! ```text
//!  Asking ── `ESC.B` answered ──> Sending by free space ──┐
//!     └── no answer ── `OA;` answered ──> Sending in turns ──┴─> Draining ── `OA;` ──> Checking ── `OE;`, `ESC.E` ──> Over
//! ```
//!
//! A plotter's buffer holds from 60 bytes to a few thousand, and what overflows is lost. `ESC.B` is obeyed at once and tells
//! the free bytes; as it travels behind all that was sent before, the number counts it, and so many bytes may follow. A device that does
//! not know `ESC.B` gets a piece that fits its buffer, and `OA;` behind it, whose reply waits for the pen.
//!
//! Needed for neither is a handshake wire, which common adapters do not have.

mod job;

use std::collections::VecDeque;
use std::time::Duration;

pub use job::{Job, JobError};

use super::{Control, Event, Fault, Place, Progress, Protocol, Unit};

/// Time for an answer to what is obeyed at once. At 300 baud, 20 bytes take 0.7 s.
const ANSWER_WAIT: Duration = Duration::from_secs(3);
/// Attempts to get a first answer.
const ASK_MAX: u32 = 3;
/// Time between questions for the free space while the buffer is full.
const POLL_INTERVAL: Duration = Duration::from_millis(100);
/// So many of these questions, and one is for the status instead: has its user halted it?
const POLLS_PER_STATUS: u32 = 20;
/// Without questions that are answered at once, a piece of the job may take this long to be drawn.
const TURN_MAX: Duration = Duration::from_secs(600);
/// Bytes sent after one answer, at most.
const CHUNK_MAX: usize = 4096;
/// `OA;` behind a piece.
const TURN_END: &[u8] = b"OA;";
/// Longest reply that is kept.
const INPUT_MAX: usize = 256;

/// `ESC.O`: VIEW is pressed.
const STATUS_VIEW: u32 = 16;
/// `ESC.O`: the paper lever is raised.
const STATUS_LEVER: u32 = 32;

/// What the conversation must know besides the job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Size of the plotter's buffer in bytes.
    pub buffer_bytes: usize,
    /// Speed of the line in baud.
    pub baud: u32,
}

/// A conversation with an HPGL plotter that sends one job.
#[derive(Debug)]
pub struct Hpgl {
    job: Job,
    options: Options,
    phase: Phase,
    /// Question that is to be answered, and since when.
    asked: Option<(Question, Duration)>,
    /// Whether an answer to `OA;` is due, and since when.
    turn: Option<Duration>,
    /// Whether it knows `ESC.B`.
    tells_space: bool,
    input: Vec<u8>,
    output: Vec<u8>,
    events: VecDeque<Event>,
    /// Index of the instruction to be sent next, and how many of its bytes are sent.
    next: usize,
    next_byte: usize,
    /// Instructions that are carried out for certain: the plotter answered `OA;` behind them.
    executed: usize,
    /// When the last question was answered.
    last_answer: Duration,
    /// Questions for the space that found too little, in a row.
    waits: u32,
    /// What the user was told of the status.
    told: u32,
    /// What the plotter reports at the end.
    reported: Vec<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Asking { asked: u32 },
    AskingForTurns,
    Sending,
    Draining,
    Checking,
    Over,
}

/// Questions that are answered at once with a number, and `OE;`, which is when the buffer is empty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Question {
    Space,
    Status,
    InstructionError,
    LineError,
}

impl Question {
    fn bytes(self) -> &'static [u8] {
        match self {
            Self::Space => b"\x1b.B",
            Self::Status => b"\x1b.O",
            Self::InstructionError => b"OE;",
            Self::LineError => b"\x1b.E",
        }
    }
}

impl Hpgl {
    /// A conversation that has not begun.
    #[must_use]
    pub fn new(job: Job, options: Options) -> Self {
        Self {
            job,
            options,
            phase: Phase::Asking { asked: 0 },
            asked: None,
            turn: None,
            tells_space: false,
            input: Vec::new(),
            output: Vec::new(),
            events: VecDeque::new(),
            next: 0,
            next_byte: 0,
            executed: 0,
            last_answer: Duration::ZERO,
            waits: 0,
            told: 0,
            reported: Vec::new(),
        }
    }

    fn ask(&mut self, question: Question, now: Duration) {
        self.output.extend_from_slice(question.bytes());
        self.asked = Some((question, now));
    }

    fn ask_for_turn(&mut self, now: Duration) {
        self.output.extend_from_slice(TURN_END);
        self.turn = Some(now);
    }

    fn fail(&mut self, fault: Fault) {
        self.phase = Phase::Over;
        self.asked = None;
        self.turn = None;
        self.events.push_back(Event::Failed(fault));
    }

    /// Takes one reply.
    fn reply(&mut self, reply: &str, now: Duration) {
        // `OA;` answers x, y and the pen; every other question is answered with one number.
        if reply.matches(',').count() >= 2 {
            if self.turn.take().is_some() {
                // Nothing is sent behind it before it is answered.
                self.executed = self.next;
                self.turn_ended(now);
            }
            return;
        }
        let (Ok(number), Some((question, _))) = (reply.parse::<u32>(), self.asked) else { return };
        self.asked = None;
        self.last_answer = now;
        match question {
            Question::Space => {
                if let Phase::Asking { .. } = self.phase {
                    self.tells_space = true;
                    self.phase = Phase::Sending;
                }
                self.send(number as usize, now);
            }
            Question::Status => self.status(number),
            Question::InstructionError => {
                if number != 0 {
                    self.reported.push(format!("instruction error {number}, {}", instruction_error(number)));
                }
                self.ask(Question::LineError, now);
            }
            Question::LineError => {
                if number != 0 {
                    self.reported.push(format!("line error {number}, {}", line_error(number)));
                }
                self.finish();
            }
        }
    }

    fn turn_ended(&mut self, now: Duration) {
        match self.phase {
            Phase::AskingForTurns => {
                self.phase = Phase::Sending;
                self.send_turn(now);
            }
            Phase::Sending => self.send_turn(now),
            Phase::Draining => {
                self.phase = Phase::Checking;
                self.asked = None;
                self.ask(Question::InstructionError, now);
            }
            _ => {}
        }
    }

    fn finish(&mut self) {
        if self.reported.is_empty() {
            self.phase = Phase::Over;
            self.events.push_back(Event::Done);
        } else {
            let what = self.reported.join(" and ");
            self.fail(Fault::Reported { what });
        }
    }

    fn status(&mut self, bits: u32) {
        for (bit, message) in [
            (STATUS_VIEW, "VIEW is pressed: the plotter goes on when it is pressed again"),
            (STATUS_LEVER, "the paper lever is raised: the plotter goes on when paper is loaded"),
        ] {
            if bits & bit != 0 && self.told & bit == 0 {
                self.events.push_back(Event::Message(message.to_owned()));
            }
        }
        self.told = bits;
    }

    /// Sends instructions into `free` bytes, and asks again.
    fn send(&mut self, free: usize, now: Duration) {
        if self.next == self.job.instructions().len() {
            return;
        }
        if self.fill(free) == 0 {
            self.waits += 1;
            return;
        }
        self.waits = 0;
        if self.next == self.job.instructions().len() {
            self.phase = Phase::Draining;
            self.ask_for_turn(now);
        } else {
            self.ask(Question::Space, now);
        }
    }

    /// Sends a piece of the job that fits the whole buffer, and `OA;` behind it.
    fn send_turn(&mut self, now: Duration) {
        self.fill(self.options.buffer_bytes.saturating_sub(TURN_END.len()));
        if self.next == self.job.instructions().len() {
            self.phase = Phase::Draining;
        }
        self.ask_for_turn(now);
    }

    /// Puts whole instructions into `free` bytes; a part of one only when it is longer than half of the buffer. The bytes sent.
    fn fill(&mut self, free: usize) -> usize {
        // `OA;` must fit behind the last piece too.
        let room = free.saturating_sub(TURN_END.len()).min(CHUNK_MAX);
        let mut sent = 0;
        while let Some(instruction) = self.job.instructions().get(self.next) {
            let rest = &instruction[self.next_byte..];
            if sent + rest.len() <= room {
                self.output.extend_from_slice(rest);
                sent += rest.len();
                self.next += 1;
                self.next_byte = 0;
                continue;
            }
            let half = self.options.buffer_bytes / 2;
            if sent == 0 && rest.len() > half && room >= half.saturating_sub(TURN_END.len()).max(1) {
                self.output.extend_from_slice(&rest[..room]);
                self.next_byte += room;
                sent = room;
            }
            break;
        }
        sent
    }

    /// Time that the bytes of one piece take on the line.
    fn travel(&self) -> Duration {
        // Ten bits a byte.
        Duration::from_secs_f64(
            10.0 * CHUNK_MAX.min(self.options.buffer_bytes) as f64 / f64::from(self.options.baud.max(1)),
        )
    }
}

impl Protocol for Hpgl {
    fn receive(&mut self, bytes: &[u8], now: Duration) {
        for &byte in bytes {
            match byte {
                b'\r' | b'\n' => {
                    let reply = std::mem::take(&mut self.input);
                    let reply = String::from_utf8_lossy(&reply).trim().to_owned();
                    if !reply.is_empty() {
                        self.reply(&reply, now);
                    }
                }
                // XON and XOFF are for the line, not for us.
                0x11 | 0x13 => {}
                _ if self.input.len() < INPUT_MAX => self.input.push(byte),
                _ => {}
            }
        }
        self.tick(now);
    }

    fn tick(&mut self, now: Duration) {
        let overdue = |since: Duration, wait: Duration| now.saturating_sub(since) > wait;
        match (self.phase, self.asked) {
            (Phase::Asking { asked: 0 }, _) => {
                // Whatever a sender before us left half said is forgotten, and its handshake too.
                self.output.extend_from_slice(b"\x1b.R\x1b.K");
                self.ask(Question::Space, now);
                self.phase = Phase::Asking { asked: 1 };
            }
            (Phase::Asking { asked }, Some((_, since))) if overdue(since, ANSWER_WAIT) => {
                if asked < ASK_MAX {
                    self.ask(Question::Space, now);
                    self.phase = Phase::Asking { asked: asked + 1 };
                } else {
                    self.asked = None;
                    self.ask_for_turn(now);
                    self.phase = Phase::AskingForTurns;
                }
            }
            // Asked once only: a second reply could be taken for that of a piece.
            (Phase::AskingForTurns, _) if self.turn.is_some_and(|since| overdue(since, ANSWER_WAIT * ASK_MAX)) => {
                let baud = self.options.baud;
                self.fail(Fault::NoAnswer { baud });
            }
            (Phase::Sending | Phase::Draining, Some((_, since))) if overdue(since, ANSWER_WAIT + self.travel()) => {
                let at = self.place();
                self.fail(Fault::Silent { at, seconds: now.saturating_sub(since).as_secs() });
            }
            (Phase::Sending | Phase::Draining, None) if self.tells_space => {
                let draining = self.phase == Phase::Draining;
                let interval = if draining { POLL_INTERVAL * 5 } else { POLL_INTERVAL };
                if now.saturating_sub(self.last_answer) >= interval {
                    let status = draining || self.waits % POLLS_PER_STATUS == POLLS_PER_STATUS - 1;
                    self.waits += u32::from(status);
                    self.ask(if status { Question::Status } else { Question::Space }, now);
                }
            }
            (Phase::Sending | Phase::Draining, _) if !self.tells_space => {
                if let Some(since) = self.turn.filter(|since| overdue(*since, TURN_MAX)) {
                    let at = self.place();
                    self.fail(Fault::Silent { at, seconds: now.saturating_sub(since).as_secs() });
                }
            }
            // The drawing is done by then: a plotter that does not know these questions is forgiven.
            (Phase::Checking, Some((_, since))) if overdue(since, ANSWER_WAIT) => self.finish(),
            _ => {}
        }
    }

    fn take_output(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.output)
    }

    fn take_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    fn control(&mut self, control: Control, _now: Duration) {
        match control {
            Control::Stop if self.phase != Phase::Over => {
                self.output.clear();
                self.output.extend_from_slice(b"\x1b.KPU;SP0;");
                let at = self.place();
                self.fail(Fault::Cancelled { at });
            }
            // What it has in its buffer it draws; it is halted at its own keys.
            _ => {}
        }
    }

    fn progress(&self) -> Progress {
        Progress { acknowledged: self.next, executed: self.executed, total: self.job.instructions().len() }
    }

    fn place(&self) -> Place {
        let begun = !matches!(self.phase, Phase::Asking { .. } | Phase::AskingForTurns);
        let index = self.next.min(self.job.instructions().len() - 1);
        match self.job.instructions().get(index).filter(|_| begun) {
            Some(bytes) => {
                Place { unit: Unit::Instruction, number: index + 1, text: String::from_utf8_lossy(bytes).into_owned() }
            }
            None => Place { unit: Unit::Instruction, number: 0, text: String::new() },
        }
    }
}

/// The meaning of `OE;`'s number.
fn instruction_error(number: u32) -> &'static str {
    match number {
        1 => "an unknown instruction",
        2 => "a wrong number of parameters",
        3 => "a parameter out of range",
        5 => "an unknown character set",
        6 => "a position out of range",
        _ => "see its manual",
    }
}

/// The meaning of `ESC.E`'s number.
fn line_error(number: u32) -> &'static str {
    match number {
        10 => "output asked for before the last one was read",
        11 => "an unknown device control instruction",
        12 | 13 => "a wrong parameter of a device control instruction",
        14 => "too many parameters of a device control instruction",
        15 => "a framing, parity or overrun error: look at --baud and the cable",
        16 => "its buffer overflowed and bytes were lost",
        _ => "see its manual",
    }
}

#[cfg(test)]
mod tests;
