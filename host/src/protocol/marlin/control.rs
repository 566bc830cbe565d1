//! What the user wants while the job goes on.

use std::time::Duration;

use super::{BARRIER, Control, Event, Fault, Hold, Marlin, Phase, Protocol, What};
use crate::protocol::grbl::without_pause;

/// Range of `M220` in percent.
const SPEED_RANGE: (u16, u16) = (10, 500);

impl Marlin {
    pub(super) fn obey(&mut self, control: Control, now: Duration) {
        match control {
            Control::Stop => self.cancel(now),
            _ if self.phase != Phase::Streaming => {}
            Control::Hold => self.hold(),
            Control::Pause if self.hold.is_none() && self.pause.is_none() => self.pausing = true,
            Control::Resume => self.resume(),
            Control::Speed(percent) => {
                let percent = percent.clamp(SPEED_RANGE.0, SPEED_RANGE.1);
                self.queue.push_back((format!("M220S{percent}"), What::Ours));
            }
            Control::PenHeight { down, steps } if self.hold == Some(Hold::AtRest) || self.pause.is_some() => {
                let changed = self.heights.change(down, steps);
                self.outbox.tell(Event::Note(self.heights.told(down, changed)));
            }
            _ => {}
        }
        self.tick(now);
    }

    fn cancel(&mut self, now: Duration) {
        let at = self.place();
        match self.phase {
            Phase::Greeting | Phase::Numbering => self.fail(Fault::Cancelled { at }),
            Phase::Streaming => self.stop(Fault::Cancelled { at }, now),
            Phase::Stopping | Phase::Over => {}
        }
    }

    /// Marlin has no hold: it rests when it has drawn what it holds.
    fn hold(&mut self) {
        if self.hold.is_some() || self.pause.is_some() {
            return;
        }
        self.pausing = false;
        self.hold = Some(Hold::Draining);
        if self.checking.is_none() {
            self.queue.push_back((BARRIER.to_owned(), What::Barrier));
        }
    }

    fn resume(&mut self) {
        self.pausing = false;
        if self.pause.take().is_some() {
            let rest = self.job.lines().get(self.next).map(|line| without_pause(&line.text)).unwrap_or_default();
            if rest.is_empty() {
                self.answered = self.answered.max(self.next + 1);
            } else {
                self.queue.push_back((rest, What::Line(self.next)));
            }
            self.next += 1;
        } else if self.hold == Some(Hold::AtRest) {
            self.hold = None;
            self.outbox.tell(Event::Resumed);
        }
    }
}
