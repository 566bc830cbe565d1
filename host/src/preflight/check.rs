//! Lets a GRBL controller read a whole job in its check mode, in which nothing moves.

use std::collections::VecDeque;
use std::time::Duration;

use super::{Finding, Severity, end};
use crate::protocol::grbl::{Job, Turn, error_meaning, is_banner};
use crate::protocol::{Control, Fault, Input, Outbox, Place, Progress, Protocol, Unit};

/// Time for a banner, for boards that reset when the port is opened.
const BANNER_WAIT: Duration = Duration::from_secs(2);
/// Time for the answer to a line, which is only read.
const ANSWER_WAIT: Duration = Duration::from_secs(10);
/// Switches the check mode on.
const ON: &str = "$C";
/// Ends it, as it ends everything.
const RESET: u8 = 0x18;
/// Refused lines that are told one by one.
const TOLD_MAX: usize = 20;

/// A conversation that checks one job.
#[derive(Debug)]
pub struct Check {
    job: Job,
    phase: Phase,
    since: Duration,
    /// Bytes that may be on the way, and those that are.
    limit: usize,
    used: usize,
    /// Indices of the lines on the way with their bytes; none for a line of ours.
    on_the_way: VecDeque<(Option<usize>, usize)>,
    next: usize,
    answered: usize,
    refused: Vec<(usize, String)>,
    input: Input,
    outbox: Outbox,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Greeting,
    Entering,
    Checking,
    Leaving,
    Over,
}

impl Check {
    /// A conversation that has not begun, with a controller that receives so many bytes at a time.
    #[must_use]
    pub fn new(job: Job, rx_bytes: usize) -> Self {
        Self {
            job,
            phase: Phase::Greeting,
            since: Duration::ZERO,
            limit: rx_bytes.saturating_sub(1),
            used: 0,
            on_the_way: VecDeque::new(),
            next: 0,
            answered: 0,
            refused: Vec::new(),
            input: Input::default(),
            outbox: Outbox::default(),
        }
    }

    /// What the controller refused.
    #[must_use]
    pub fn findings(&self) -> Vec<Finding> {
        let mut findings: Vec<_> = self
            .refused
            .iter()
            .take(TOLD_MAX)
            .filter_map(|(index, code)| {
                let line = self.job.lines().get(*index)?;
                let what = format!("`{}` is refused: error {code}, {}", line.text, error_meaning(code));
                Some(Finding { severity: Severity::Error, place: Some((Unit::Line, line.number)), what })
            })
            .collect();
        let more = self.refused.len().saturating_sub(TOLD_MAX);
        if more > 0 {
            let what = format!("{more} more lines are refused");
            findings.push(Finding { severity: Severity::Error, place: None, what });
        }
        findings
    }

    fn enter(&mut self, phase: Phase, now: Duration) {
        self.phase = phase;
        self.since = now;
    }

    fn finish(&mut self, result: Result<(), Fault>) {
        self.phase = Phase::Over;
        self.outbox.tell(end(result));
    }

    fn send(&mut self, text: &str, index: Option<usize>) {
        self.outbox.line(text);
        self.used += text.len() + 1;
        self.on_the_way.push_back((index, text.len() + 1));
    }

    fn begin(&mut self, now: Duration) {
        self.on_the_way.clear();
        self.used = 0;
        self.send(ON, None);
        self.enter(Phase::Entering, now);
    }

    fn stream(&mut self, now: Duration) {
        while let Some(line) = self.job.lines().get(self.next) {
            // `$` commands and what is written to the EEPROM would be carried out in the check mode too.
            if matches!(line.turn, Turn::AtRest | Turn::Alone) {
                self.next += 1;
                continue;
            }
            if self.used + line.text.len() + 1 > self.limit && !self.on_the_way.is_empty() {
                return;
            }
            let text = line.text.clone();
            self.send(&text, Some(self.next));
            self.next += 1;
        }
        if self.on_the_way.is_empty() {
            self.outbox.write(&[RESET]);
            self.enter(Phase::Leaving, now);
        }
    }

    fn answer(&mut self, error: Option<&str>, now: Duration) {
        let Some((index, bytes)) = self.on_the_way.pop_front() else { return };
        self.used -= bytes;
        self.since = now;
        match (self.phase, index, error) {
            (Phase::Entering, None, None) => self.enter(Phase::Checking, now),
            (Phase::Entering, None, Some(code)) => {
                let advice = "bring it to rest, and unlock or home it, before it can check a job";
                self.finish(Err(Fault::NotReady { state: format!("error {code}, {}", error_meaning(code)), advice }));
            }
            (Phase::Checking, Some(index), error) => {
                self.answered = index + 1;
                if let Some(code) = error {
                    self.refused.push((index, code.to_owned()));
                }
            }
            _ => {}
        }
    }
}

impl Protocol for Check {
    fn receive(&mut self, bytes: &[u8], now: Duration) {
        for &byte in bytes {
            let Some(line) = self.input.take(byte) else { continue };
            if line == "ok" {
                self.answer(None, now);
            } else if let Some(code) = line.strip_prefix("error:") {
                self.answer(Some(code.trim()), now);
            } else if is_banner(&line) {
                match self.phase {
                    Phase::Greeting | Phase::Entering => self.begin(now),
                    Phase::Leaving => self.finish(Ok(())),
                    Phase::Checking => {
                        let at = self.place();
                        self.finish(Err(Fault::Restarted { at }));
                    }
                    Phase::Over => {}
                }
            }
        }
        self.tick(now);
    }

    fn tick(&mut self, now: Duration) {
        let elapsed = now.saturating_sub(self.since);
        match self.phase {
            Phase::Greeting if elapsed >= BANNER_WAIT => self.begin(now),
            Phase::Checking => self.stream(now),
            // A controller without a banner of this kind has left the check mode all the same.
            Phase::Leaving if elapsed > BANNER_WAIT => self.finish(Ok(())),
            _ => {}
        }
        if matches!(self.phase, Phase::Entering | Phase::Checking) && now.saturating_sub(self.since) > ANSWER_WAIT {
            let at = self.place();
            self.outbox.write(&[RESET]);
            self.finish(Err(Fault::Silent { at, seconds: ANSWER_WAIT.as_secs() }));
        }
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
    }

    fn control(&mut self, control: Control, _now: Duration) {
        if control == Control::Stop && self.phase != Phase::Over {
            let at = self.place();
            self.outbox.write(&[RESET]);
            self.finish(Err(Fault::Cancelled { at }));
        }
    }

    fn progress(&self) -> Progress {
        Progress { acknowledged: self.answered, executed: 0, total: self.job.lines().len() }
    }

    fn place(&self) -> Place {
        let begun = !matches!(self.phase, Phase::Greeting | Phase::Entering);
        match self.job.lines().get(self.answered).filter(|_| begun) {
            Some(line) => Place { unit: Unit::Line, number: line.number, text: line.text.clone() },
            None => Place { unit: Unit::Line, number: 0, text: String::new() },
        }
    }
}
