//! What the plotter is found to know before the job begins.
//!
//! Each step is bounded in time, and moves nothing: where one is not answered the next is tried.

use std::time::Duration;

use super::{ANSWER_WAIT, Ask, ENQ, Event, Hpgl, Phase, Question, Words};
use crate::device::Handshake;
use crate::protocol::{Fault, Lines};

/// Time for an Xoff or an acknowledgement.
const SIGN_WAIT: Duration = Duration::from_secs(2);
/// Time in which the port tells the levels of its lines.
const LEVELS_WAIT: Duration = Duration::from_millis(500);
/// Free bytes below which an Xoff is asked for, more than any buffer has: it comes at once where Xon/Xoff is known.
const XOFF_AT_ONCE: usize = 15_358;

/// Steps of the probe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Probe {
    /// Nothing was sent.
    Begin,
    /// `ESC.B`.
    Space,
    /// `ESC.L`.
    Size,
    /// Is there an Xoff?
    Xon,
    /// Is there an acknowledgement?
    Enq,
    /// Does the plotter's line say that it is ready?
    Levels,
    /// `OA;`: every handshake needs it.
    Turn,
    /// Errors of what was drawn before are forgotten.
    OldErrors,
    /// `OI;`, and whether `IN;` went before it: some HP 7475A want that.
    Identity { after_in: bool },
}

impl Hpgl {
    fn enter(&mut self, probe: Probe, now: Duration) {
        self.phase = Phase::Probing(probe);
        self.goes_on(now);
    }

    /// Lets time pass.
    pub(super) fn probe(&mut self, probe: Probe, now: Duration) {
        let elapsed = now.saturating_sub(self.progressed);
        match probe {
            Probe::Begin => self.probe_begin(now),
            Probe::Space | Probe::Size | Probe::OldErrors | Probe::Identity { .. } => {
                if let Some(question) = self.is_overdue(now) {
                    self.probe_unanswered(question, now);
                }
            }
            Probe::Xon if elapsed > SIGN_WAIT + self.flow.backlog(now) => {
                self.put(b"\x1b.R", now);
                self.probe_enq(now);
            }
            Probe::Enq if elapsed > SIGN_WAIT + self.flow.backlog(now) => {
                self.enquired = None;
                // Where the enquiry was taken for the beginning of an instruction, that ends here.
                self.put(b"\x1b.R;", now);
                self.enter(Probe::Levels, now);
            }
            Probe::Levels if elapsed > LEVELS_WAIT => self.probe_turn(Handshake::Oa, now),
            Probe::Turn if elapsed > 2 * ANSWER_WAIT + self.flow.backlog(now) => {
                if self.repeats < 2 {
                    (self.progressed, self.repeats) = (now, self.repeats + 1);
                    // A plotter that was booting has not heard of the handshake either.
                    self.set_up();
                    self.ask_where(Ask::Place, now);
                } else {
                    self.no_answer();
                }
            }
            _ => {}
        }
    }

    fn probe_begin(&mut self, now: Duration) {
        // Whatever a sender before us left half said is forgotten, and its handshake too.
        self.put(b"\x1b.R\x1b.K", now);
        match self.options.handshake {
            Handshake::Auto | Handshake::EscB => {
                self.ask(Question::Space, now);
                self.enter(Probe::Space, now);
            }
            chosen => self.probe_turn(chosen, now),
        }
    }

    /// A question was put often enough.
    fn probe_unanswered(&mut self, question: Question, now: Duration) {
        match (question, self.phase) {
            (Question::Space, _) if self.options.handshake == Handshake::Auto => {
                let setup = format!("\x1b.I{XOFF_AT_ONCE};0;17:\x1b.N;19:;;;;");
                self.put(setup.as_bytes(), now);
                self.flow.stopped = false;
                self.enter(Probe::Xon, now);
            }
            (Question::Space, _) => self.no_answer(),
            (Question::Size, _) => self.probe_turn(Handshake::EscB, now),
            (Question::InstructionError | Question::LineError, _) => self.probe_identity(now),
            (Question::Identity, Phase::Probing(Probe::Identity { after_in: false })) if self.job_begins_anew() => {
                self.put(b"IN;", now);
                self.ask(Question::Identity, now);
                self.enter(Probe::Identity { after_in: true }, now);
            }
            _ => self.begin(now),
        }
    }

    /// Whether the job begins with `IN;`, so that one more before it changes nothing.
    fn job_begins_anew(&self) -> bool {
        self.job.instructions().first().is_some_and(|first| first.eq_ignore_ascii_case(b"IN;"))
    }

    fn no_answer(&mut self) {
        let baud = self.options.baud;
        self.fail(Fault::NoAnswer { baud });
    }

    fn probe_enq(&mut self, now: Duration) {
        let setup = format!("\x1b.H{};5;6:", self.flow.block());
        self.put(setup.as_bytes(), now);
        self.outbox.write(&[ENQ]);
        self.enquired = Some(now);
        self.enter(Probe::Enq, now);
    }

    /// Speaks a handshake from here on; `OA;` must be answered with it.
    fn probe_turn(&mut self, handshake: Handshake, now: Duration) {
        self.flow.handshake = handshake;
        self.set_up();
        self.ask_where(Ask::Place, now);
        self.enter(Probe::Turn, now);
    }

    /// Has the plotter speak the handshake. What it obeys at once takes no room in its buffer.
    fn set_up(&mut self) {
        let block = self.flow.block();
        let setup = match self.flow.handshake {
            Handshake::XonXoff => {
                self.flow.stopped = false;
                format!("\x1b.I{block};0;17:\x1b.N;19:")
            }
            Handshake::EnqAck => format!("\x1b.H{block};5;6:"),
            Handshake::Hardware => "\x1b.@;1:".to_owned(),
            Handshake::EscB | Handshake::Oa | Handshake::Auto => String::new(),
        };
        self.outbox.write(setup.as_bytes());
    }

    /// A question was answered with a number.
    pub(super) fn probe_told(&mut self, question: Question, number: usize, now: Duration) {
        match question {
            Question::Space => {
                // Nothing is in the buffer yet, so that all of it is free; it may be larger than `ESC.B` can tell.
                self.flow.buffer = number.max(1);
                self.ask(Question::Size, now);
                self.enter(Probe::Size, now);
            }
            Question::Size => {
                self.flow.buffer = self.flow.buffer.max(number);
                self.probe_turn(Handshake::EscB, now);
            }
            Question::InstructionError => {
                self.tells_errors = true;
                if self.flow.handshake == Handshake::EscB {
                    self.ask(Question::LineError, now);
                } else {
                    self.probe_identity(now);
                }
            }
            Question::LineError => self.probe_identity(now),
            Question::Status | Question::Identity => {}
        }
    }

    /// `OA;` or `OI;` was answered.
    pub(super) fn probe_answered(&mut self, now: Duration) {
        match self.phase {
            Phase::Probing(Probe::Turn) => {
                self.ask(Question::InstructionError, now);
                self.enter(Probe::OldErrors, now);
            }
            Phase::Probing(Probe::Identity { .. }) => self.begin(now),
            _ => {}
        }
    }

    fn probe_identity(&mut self, now: Duration) {
        self.ask(Question::Identity, now);
        self.enter(Probe::Identity { after_in: false }, now);
    }

    /// The plotter has told what it is.
    pub(super) fn identity(&mut self, reply: &str) {
        let known = self.options.name.to_ascii_lowercase();
        let (told, name) = (reply.to_ascii_lowercase(), &self.options.name);
        let same = told.split(|c: char| !c.is_ascii_alphanumeric()).any(|word| word.len() > 2 && known.contains(word));
        if !same {
            let told: String = reply.chars().filter(|c| !c.is_control()).take(40).collect();
            let text = format!("it calls itself `{told}`, and the job is sent as for `{name}` (--device)");
            self.outbox.tell(Event::Warning(text));
        }
    }

    /// The job begins.
    fn begin(&mut self, now: Duration) {
        let limits = Self::limits(&self.options, self.flow.buffer, self.flow.handshake, self.question());
        self.words = Words::new(limits);
        self.phase = Phase::Sending;
        self.goes_on(now);
        self.answered = now;
        self.send(now);
    }

    /// Xon came.
    pub(super) fn line_went_on(&mut self, now: Duration) {
        self.flow.stopped = false;
        if self.phase == Phase::Sending {
            self.goes_on(now);
        }
    }

    /// Xoff came.
    pub(super) fn line_stopped(&mut self, now: Duration) {
        self.flow.stopped = true;
        if self.phase == Phase::Probing(Probe::Xon) {
            self.put(b"\x1b.R", now);
            self.probe_turn(Handshake::XonXoff, now);
        }
    }

    /// An acknowledgement came.
    pub(super) fn block_granted(&mut self, now: Duration) {
        if self.enquired.take().is_none() {
            return;
        }
        self.flow.grant();
        if self.phase == Phase::Probing(Probe::Enq) {
            self.probe_turn(Handshake::EnqAck, now);
        }
    }

    /// The levels of the port's lines are told.
    pub(super) fn levels_told(&mut self, lines: Lines, now: Duration) {
        // Cables lead the plotter's DTR to one of the two, and leave the other open, or bridge it so that it is always up.
        let wired = &mut self.wired;
        wired.clear_to_send |= lines.clear_to_send;
        wired.data_set_ready |= lines.data_set_ready;
        let is_wired = wired.clear_to_send || wired.data_set_ready;
        let ready = is_wired && *wired == lines;
        let probing = self.phase == Phase::Probing(Probe::Levels);
        if probing || self.flow.handshake == Handshake::Hardware || self.flow.ready.is_some() {
            self.flow.ready = Some(ready);
        }
        if probing {
            if ready {
                // It may be bridged in the cable: it can stop what is sent, and the answers are counted none the less.
                self.put(b"\x1b.@;1:", now);
            } else {
                self.flow.ready = None;
            }
            self.probe_turn(Handshake::Oa, now);
        }
    }
}
