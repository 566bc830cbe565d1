//! Asks a GRBL controller for its build options and settings.

use std::collections::BTreeMap;
use std::time::Duration;

use super::end;
use crate::protocol::grbl::is_banner;
use crate::protocol::{Control, Input, Outbox, Place, Progress, Protocol, Unit};

/// Time for all of an answer; a board that was reset by opening the port has a boot loader to run through.
const ANSWER_WAIT: Duration = Duration::from_secs(2);
/// Times that each question is put.
const ASK_MAX: u32 = 3;
/// The questions.
const QUESTIONS: [&str; 2] = ["$I", "$$"];

/// What a controller tells of itself. Nothing, where it does not answer.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Told {
    /// Its settings, `$n=`.
    settings: BTreeMap<u32, f64>,
    /// Size of its receive buffer in bytes.
    pub rx_bytes: Option<usize>,
}

impl Told {
    /// The setting `$number`, if it was told.
    #[must_use]
    pub fn setting(&self, number: u32) -> Option<f64> {
        self.settings.get(&number).copied()
    }

    /// Takes a line of the controller.
    fn take(&mut self, line: &str) {
        if let Some(options) = line.strip_prefix("[OPT:").and_then(|rest| rest.strip_suffix(']')) {
            // [OPT:V,15,128]: letters, planner blocks, receive buffer. FluidNC leaves the numbers out.
            let bytes = options.split(',').nth(2).and_then(|bytes| bytes.trim().parse().ok());
            self.rx_bytes = bytes.filter(|bytes| *bytes > 2).or(self.rx_bytes);
        } else if let Some((number, value)) = line.strip_prefix('$').and_then(|rest| rest.split_once('=')) {
            // Older versions write what the setting is for behind it.
            let value = value.split_whitespace().next().unwrap_or_default();
            if let (Ok(number), Ok(value)) = (number.parse(), value.parse::<f64>()) {
                self.settings.insert(number, value);
            }
        }
    }
}

/// A conversation that asks, and sends nothing that moves. It ends in [`crate::protocol::Event::Done`] whether it was answered or not.
#[derive(Debug, Default)]
pub struct Probe {
    told: Told,
    /// Index of the question that is to be answered, and how often it was put.
    question: usize,
    times: u32,
    since: Duration,
    input: Input,
    outbox: Outbox,
}

impl Probe {
    /// A conversation that has not begun.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// What was told.
    #[must_use]
    pub fn told(&self) -> &Told {
        &self.told
    }

    fn ask(&mut self, now: Duration) {
        let Some(question) = QUESTIONS.get(self.question) else {
            self.outbox.tell(end(Ok(())));
            return;
        };
        self.outbox.line(question);
        self.times += 1;
        self.since = now;
    }

    fn next(&mut self, now: Duration) {
        self.question += 1;
        self.times = 0;
        self.ask(now);
    }

    fn is_over(&self) -> bool {
        self.question >= QUESTIONS.len()
    }
}

impl Protocol for Probe {
    fn receive(&mut self, bytes: &[u8], now: Duration) {
        for &byte in bytes {
            let Some(line) = self.input.take(byte) else { continue };
            if self.is_over() {
                return;
            }
            if line == "ok" {
                self.next(now);
            } else if line.starts_with("error:") {
                // What a sender before us left half written may have spoilt the first one.
                if self.times < ASK_MAX { self.ask(now) } else { self.next(now) }
            } else if is_banner(&line) {
                // A board that was reset by opening the port has lost the question.
                (self.question, self.times) = (0, 0);
                self.ask(now);
            } else {
                self.told.take(&line);
            }
        }
    }

    fn tick(&mut self, now: Duration) {
        if self.is_over() {
            return;
        }
        if self.times == 0 {
            self.ask(now);
        } else if now.saturating_sub(self.since) > ANSWER_WAIT {
            if self.times < ASK_MAX {
                self.ask(now);
            } else {
                // Who does not answer the first question answers none; the job's own conversation says so.
                self.question = QUESTIONS.len();
                self.ask(now);
            }
        }
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
    }

    fn control(&mut self, control: Control, _now: Duration) {
        if control == Control::Stop && !self.is_over() {
            self.question = QUESTIONS.len();
            self.outbox.tell(end(Err(crate::protocol::Fault::Cancelled { at: self.place() })));
        }
    }

    fn progress(&self) -> Progress {
        Progress::default()
    }

    fn place(&self) -> Place {
        Place { unit: Unit::Line, number: 0, text: String::new() }
    }
}
