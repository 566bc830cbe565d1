//! What the controller says, line by line.

use std::time::Duration;

use super::{Event, Fault, Grbl, Phase, Place, Protocol, RESET, What, codes, report};

impl Grbl {
    /// Takes one line of the controller.
    pub(super) fn line(&mut self, line: &str, now: Duration) {
        let after = |prefix: &str| line.strip_prefix(prefix);
        if let Some(at) = hidden_fault(line) {
            self.unknown = self.unknown.saturating_add(1);
            return self.line(line.get(at..).unwrap_or_default(), now);
        }
        if line == "ok" {
            self.answer(None, now);
        } else if let Some(code) = after("error:") {
            self.answer(Some(code.trim()), now);
        } else if let Some(code) = after("ALARM:") {
            self.alarm(code.trim());
        } else if line.starts_with('<') {
            match report::status(line) {
                Some(status) => self.status(&status, now),
                None => self.unknown += 1,
            }
        } else if line.starts_with("[GC:") {
            match report::modal(line) {
                Some(modal) => self.modal(self.told.in_mm(modal), now),
                None => self.unknown += 1,
            }
        } else if let Some(rest) = after("[OPT:") {
            self.build_options(rest.trim_end_matches(']'));
        } else if let Some(version) = after("[VER:") {
            // Our own firmware; every other one computes with floats of 32 bits.
            self.told.double |= version.contains("penvis");
        } else if let Some(message) = after("[MSG:") {
            self.outbox.tell(Event::Message(message.trim_end_matches(']').to_owned()));
        } else if let Some((number, value)) = after("$").and_then(|rest| rest.split_once('=')) {
            self.setting(number, value);
        } else if is_banner(line) {
            self.banner(now);
        } else if !(line.is_empty() || line.starts_with(['[', '>', '$'])) {
            // Noise, or the words of another dialect. Start-up lines print `>…:ok`; they are no answer to a line of ours either.
            self.unknown = self.unknown.saturating_add(1);
        }
    }

    fn setting(&mut self, number: &str, value: &str) {
        // Descriptions may follow.
        let value = value.split_whitespace().next().and_then(|value| value.parse::<f64>().ok());
        let (Phase::Probing, Ok(number), Some(value)) = (self.phase, number.parse::<u32>(), value) else { return };
        match number {
            13 if value == 1.0 => self.told.unit_mm = 25.4,
            32 if value == 1.0 && self.options.servo => self.fail(Fault::LaserMode),
            100..=102 if value > 0.0 => {
                if let Some(slot) = self.told.steps_per_mm.get_mut(number as usize - 100) {
                    *slot = Some(value);
                }
            }
            _ => {}
        }
    }

    /// The oldest line on the way is answered.
    fn answer(&mut self, error: Option<&str>, now: Duration) {
        self.watch.answered(now);
        let Some(sent) = self.on_the_way.pop_front() else { return self.answered_nothing(error, now) };
        self.used -= sent.bytes;
        let What::Line(index) = sent.what else {
            return self.errand_answered(sent.what, error, now);
        };
        let Some(code) = error else {
            self.answered = self.answered.max(index + 1);
            self.at_rest = false;
            return self.line_taken(index, sent.at, now);
        };
        if self.fault.is_none() {
            self.stop(refused(self.place_of(index), code), now);
        }
    }

    fn errand_answered(&mut self, what: What, error: Option<&str>, now: Duration) {
        match (what, error) {
            // A controller may not know a probe of ours; that is no fault of the job.
            (What::Errand | What::Line(_), _) => {}
            (What::Ghost, _) => self.ghost_answered(error, now),
            (What::Query, _) => self.query_answered(error, now),
            (What::Barrier, Some(code)) if self.fault.is_none() && self.phase == Phase::Streaming => {
                self.stop(refused(self.place(), code), now);
            }
            (What::Barrier, Some(_)) => {}
            (What::Barrier, None) => self.barrier_answered(now),
        }
    }

    pub(super) fn alarm(&mut self, code: &str) {
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
        self.forget_on_the_way();
        match self.phase {
            // The boot of a board that was reset by opening the port; what was asked before is lost.
            Phase::Greeting | Phase::Asking { .. } | Phase::Probing => self.ask(1, now),
            Phase::Resetting => {
                self.errands = self.options.lift.iter().map(|line| self.heights.rewritten(line)).collect();
                self.enter(Phase::Lifting, now);
            }
            Phase::Streaming => {
                let at = self.place();
                self.fail(Fault::Restarted { at });
            }
            Phase::Holding | Phase::Lifting => self.finish_stopping(),
            Phase::Over => {}
        }
    }

    fn build_options(&mut self, rest: &str) {
        // [OPT:V,15,128]: letters, planner blocks, receive buffer. FluidNC leaves the numbers out.
        let mut told = rest.split(',').skip(1).map(|number| number.trim().parse::<usize>().ok());
        let (blocks, bytes) = (told.next().flatten(), told.next().flatten());
        if let (Phase::Probing, Some(bytes @ 2..)) = (self.phase, bytes) {
            self.rx_limit = bytes - 1;
            self.told.blocks = blocks;
        }
    }
}

/// Where an error or an alarm begins behind something else: the line end before it was lost.
fn hidden_fault(line: &str) -> Option<usize> {
    let whole = line.starts_with('>') || line.ends_with([']', '>']);
    let at = line.rfind("error:").max(line.rfind("ALARM:"))?;
    (at > 0 && !whole).then_some(at)
}

/// The controller's answer to a line of the job, or to the barrier at its end.
pub(super) fn refused(at: Place, code: &str) -> Fault {
    Fault::Refused { at, code: code.to_owned(), meaning: error_meaning(code) }
}

/// What an `error:` means.
pub(crate) fn error_meaning(code: &str) -> &'static str {
    code.parse().map_or("in the controller's own words", codes::error)
}

/// Whether a line of a controller says that it has started anew.
pub(crate) fn is_banner(line: &str) -> bool {
    line.starts_with("Grbl ") || line.contains("'$' for help")
}
