//! What the user wants while the job goes on.

use std::time::Duration;

use super::job::without_pause;
use super::{Control, Event, Fault, Grbl, HOLD, Phase, Protocol, RESUME, What};

/// Speed as programmed, then 10 % faster, 10 % slower, 1 % faster, 1 % slower.
const SPEEDS: [u8; 5] = [0x90, 0x91, 0x92, 0x93, 0x94];
/// Range of GRBL's speed override in percent.
const SPEED_RANGE: (u16, u16) = (10, 200);

/// A rest that the user asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Hold {
    /// The plotter slows down.
    Slowing,
    /// It rests where it was, and the user was told.
    AtRest,
    /// It was told to go on.
    Leaving,
    /// It rests with the pen up, for nothing more is sent; the user was told.
    Parked,
}

impl Grbl {
    pub(super) fn obey(&mut self, control: Control, now: Duration) {
        match control {
            Control::Hold => self.hold(now),
            Control::Pause => self.pause_after_stroke(now),
            Control::Resume => self.resume(now),
            Control::Stop => self.cancel(now),
            Control::Speed(percent) => self.speed(percent),
            Control::PenHeight { down, steps } => self.pen_height(down, steps, now),
        }
    }

    pub(super) fn is_parked(&self) -> bool {
        self.hold == Some(Hold::Parked)
    }

    /// Rests with the pen up.
    pub(super) fn park(&mut self) {
        self.pausing = false;
        self.hold = Some(Hold::Parked);
        self.outbox.tell(Event::Paused);
    }

    /// Stops at once, unless the job waits for its user anyway.
    fn hold(&mut self, now: Duration) {
        if self.phase == Phase::Streaming && self.hold.is_none() && self.pause.is_none() {
            self.pausing = false;
            self.hold = Some(Hold::Slowing);
            self.realtime(HOLD);
            self.ask_status(now);
        }
    }

    /// Rests at the next place where the pen is known to be up; at once if it is up now and nothing was sent since.
    fn pause_after_stroke(&mut self, now: Duration) {
        if self.phase != Phase::Streaming || self.hold.is_some() || self.pause.is_some() {
            return;
        }
        let up = |index: usize| self.plan.check(index).is_some_and(|check| check.pen_down == Some(false));
        let is_up = self.part.checked_sub(1).is_some_and(up) && self.next == self.plan.start(self.part);
        if is_up && self.checking.is_none() && self.on_the_way.is_empty() {
            self.park();
        } else if (self.part..).map_while(|index| self.plan.check(index)).any(|check| check.pen_down == Some(false)) {
            self.pausing = true;
        } else {
            // No end of a stroke is known ahead.
            self.hold(now);
        }
    }

    fn resume(&mut self, now: Duration) {
        if self.pause.take().is_some() {
            let rest = self.job.lines().get(self.next).map(|line| without_pause(&line.text)).unwrap_or_default();
            if rest.is_empty() {
                self.answered = self.answered.max(self.next + 1);
            } else {
                self.send(&rest, What::Line(self.next), now);
            }
            self.next += 1;
            self.watch.begin(now);
            return self.stream(now);
        }
        self.pausing = false;
        match self.hold {
            None => {
                // A hold that was not asked for here ends in the same way.
                if self.watch.is_held() {
                    self.realtime(RESUME);
                }
                return;
            }
            Some(Hold::Parked) => {
                self.hold = None;
                self.outbox.tell(Event::Resumed);
            }
            Some(_) => {
                self.hold = Some(Hold::Leaving);
                self.realtime(RESUME);
                // The report that is under way may still say Hold.
                self.watch.last_poll = now;
            }
        }
        self.watch.begin(now);
        self.stream(now);
    }

    fn cancel(&mut self, now: Duration) {
        match self.phase {
            Phase::Holding | Phase::Resetting | Phase::Lifting | Phase::Over => {}
            Phase::Greeting | Phase::Asking { .. } | Phase::Probing => {
                let at = self.place();
                self.fail(Fault::Cancelled { at });
            }
            Phase::Streaming => {
                let at = self.place();
                self.stop(Fault::Cancelled { at }, now);
            }
        }
    }

    /// Sets GRBL's feed override: from 100 % on in steps of ten and of one.
    fn speed(&mut self, percent: u16) {
        if self.phase != Phase::Streaming {
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

    /// Changes a level of the pen while the job rests with the pen up; its next lines are sent with it.
    fn pen_height(&mut self, down: bool, steps: i32, now: Duration) {
        if !self.is_parked() && self.pause.is_none() {
            // Lines of the pen that are on the way would be held against the new levels.
            let text = "the pen's levels change where it is up: go on, and press space once, for the end of the stroke";
            return self.outbox.tell(Event::Note(text.to_owned()));
        }
        let changed = self.heights.change(down, steps);
        self.outbox.tell(Event::Note(self.heights.told(down, changed)));
        if !changed {
            return;
        }
        if let Some(line) = self.heights.lifted().filter(|line| !down && self.has_room(line.len())) {
            self.send(&line, What::Errand, now);
        }
    }
}
