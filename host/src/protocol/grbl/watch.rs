//! Asks for the status now and then, and fails when the controller is silent, idle or motionless for too long.

use std::time::Duration;

use super::report::{Place, Status};
use super::{Event, Fault, Grbl, Hold, Phase, Protocol, QUERY, SILENCE_MAX, Turn, What, codes};

/// Time between status requests: five a second is the most that does not hold up the controller.
const POLL_INTERVAL: Duration = Duration::from_millis(250);
/// Lines that may be in the step generator's buffer: GRBL's holds 6 pieces of blocks, grblHAL's 10; and the planner keeps one
/// block free.
const IN_STEPS: usize = 16;
/// Time for the answer of a probe, while the controller reports to be idle.
const PROBE_WAIT: Duration = Duration::from_secs(2);
/// Time for homing and the like, during which GRBL answers nothing.
const SILENCE_MAX_AT_REST: Duration = Duration::from_secs(180);
/// An idle controller that owes an answer for so long, beyond the longest dwell, is asked what it has taken.
const IDLE_MAX: Duration = Duration::from_secs(1);
/// The same where it cannot be asked: it has lost bytes.
const IDLE_MAX_UNASKED: Duration = Duration::from_secs(5);
/// Times in a row that an idle controller is asked.
const RESYNC_MAX: u32 = 3;
/// A controller that claims to run and neither moves nor answers for so long, beyond the longest dwell, does not run.
const MOTIONLESS_MAX: Duration = Duration::from_secs(60);
/// A hold that nobody here asked for ends the job after so long.
const HELD_MAX: Duration = Duration::from_secs(3600);

/// What was last heard and seen.
#[derive(Debug, Default)]
pub(super) struct Watch {
    pub(super) last_heard: Duration,
    pub(super) last_poll: Duration,
    /// Lines that were answered when the status was asked for last.
    pub(super) answered_at_poll: usize,
    /// When a line was answered last, and the time before.
    answered_at: Duration,
    pub(super) answered_before: Duration,
    /// Since when the controller has been idle in all its reports, with no answer in between.
    pub(super) idle_since: Option<Duration>,
    /// Since when somebody else holds it; the user was told.
    held_since: Option<Duration>,
    /// Where it was last, and since when.
    place: Option<Place>,
    moved_at: Duration,
    /// A dwell of the job that ended too soon.
    pub(super) short_dwell: Option<usize>,
    /// Dwells in a row that were sent again because they ended too soon.
    pub(super) dwells_repeated: u32,
    /// Times in a row that it was asked what it has taken.
    resyncs: u32,
}

impl Watch {
    pub(super) fn begin(&mut self, now: Duration) {
        self.last_heard = now;
        self.moved_at = now;
        self.idle_since = None;
    }

    pub(super) fn answered(&mut self, now: Duration) {
        self.answered_before = self.answered_at;
        self.answered_at = now;
        self.idle_since = None;
        self.moved_at = now;
        self.resyncs = 0;
    }

    /// Whether somebody else holds the controller.
    pub(super) fn is_held(&self) -> bool {
        self.held_since.is_some()
    }

    pub(super) fn poll_is_due(&self, now: Duration) -> bool {
        now.saturating_sub(self.last_poll) >= POLL_INTERVAL
    }
}

impl Grbl {
    pub(super) fn status(&mut self, status: &Status, now: Duration) {
        if let Some(origin) = status.offset {
            self.told.origin_told(origin);
        }
        if status.position != self.watch.place {
            self.watch.place = status.position;
            self.watch.moved_at = now;
        }
        let (name, detail) = (status.state.as_str(), status.detail.as_str());
        match self.phase {
            Phase::Asking { .. } => {
                if name == "Idle" {
                    self.errands = [super::BREAK, "$I", "$$"].map(str::to_owned).into();
                    self.enter(Phase::Probing, now);
                } else if codes::is_busy_state(name) {
                    self.fail(Fault::NotReady { state: state_text(status), advice: codes::advice(name) });
                }
            }
            Phase::Probing if name == "Idle" => self.skip_lost_probe(now),
            Phase::Streaming if name == "Alarm" => self.alarm("that it did not tell"),
            Phase::Streaming => {
                self.count_blocks(status);
                self.state_in_job(name, detail, now);
                if self.hold.is_none() && self.phase == Phase::Streaming && name != "Hold" && name != "Door" {
                    self.place_reported(status, now);
                }
            }
            Phase::Holding if name != "Run" && (name != "Hold" || detail != "1") => self.reset(now),
            _ => {}
        }
    }

    /// What is executed of a stroke: lines that were answered before the report was asked for are planned, and those that the
    /// planner does not hold any more are drawn, but for the few that were handed to the step generator. Where they are is verified
    /// at the end of the stroke, and taken back if it is wrong.
    fn count_blocks(&mut self, status: &Status) {
        let (Some(blocks), Some(free), true) = (self.told.blocks, status.blocks_free, self.blocks_count) else {
            return;
        };
        let Some(check) = self.plan.check(self.part) else { return };
        let held = blocks.saturating_sub(free) + IN_STEPS;
        let planned = self.watch.answered_at_poll.min(check.pen_lines);
        let executed = planned.saturating_sub(held);
        if executed > self.plan.start(self.part) {
            self.executed = self.executed.max(executed);
        }
    }

    /// The state while the job goes on.
    fn state_in_job(&mut self, name: &str, detail: &str, now: Duration) {
        if name == "Idle" {
            self.watch.idle_since.get_or_insert(now);
        } else {
            self.watch.idle_since = None;
        }
        let held = name == "Hold";
        match self.hold {
            Some(Hold::Slowing) if held && detail != "1" => {
                self.hold = Some(Hold::AtRest);
                self.outbox.tell(Event::Paused);
            }
            Some(Hold::Leaving) if !held => {
                self.hold = None;
                self.outbox.tell(Event::Resumed);
            }
            _ => {}
        }
        if self.hold.is_some() {
            return;
        }
        // Somebody has pressed a button or opened the door.
        if held || name == "Door" {
            if self.watch.held_since.is_none() {
                self.outbox.tell(Event::Message(format!("{name}; the job goes on when the plotter is resumed")));
                self.watch.held_since = Some(now);
            }
        } else {
            self.watch.held_since = None;
        }
    }

    /// The controller is idle: a probe that it has not answered by now was lost, or its answer was.
    fn skip_lost_probe(&mut self, now: Duration) {
        if self.on_the_way.front().is_some_and(|sent| now.saturating_sub(sent.at) > PROBE_WAIT) {
            self.forget_on_the_way();
        }
    }

    /// Looks after the controller while the job goes on.
    pub(super) fn watch(&mut self, now: Duration) {
        if self.phase != Phase::Streaming {
            return;
        }
        if self.watch.poll_is_due(now) {
            self.ask_status(now);
        }
        let at_rest = matches!(self.on_the_way.front().map(|sent| sent.what), Some(What::Line(index))
            if self.job.lines().get(index).is_some_and(|line| line.turn == Turn::AtRest));
        let allowed = if at_rest { SILENCE_MAX_AT_REST } else { SILENCE_MAX };
        let silent = now.saturating_sub(self.watch.last_heard);
        if silent > allowed {
            let at = self.place();
            return self.fail(Fault::Silent { at, seconds: silent.as_secs() });
        }
        if let Some(since) = self.watch.held_since.filter(|since| now.saturating_sub(*since) > HELD_MAX) {
            let (at, seconds) = (self.place(), now.saturating_sub(since).as_secs());
            return self.stop(Fault::Motionless { at, seconds }, now);
        }
        // A controller that waits for its user may wait for ever.
        let waiting = self.hold.is_some() || self.pause.is_some() || self.watch.held_since.is_some();
        if self.on_the_way.is_empty() || waiting || at_rest {
            self.watch.moved_at = now;
            return;
        }
        let dwell = self.job.longest_dwell();
        let idle = self.watch.idle_since.map_or(Duration::ZERO, |since| now.saturating_sub(since));
        let asks = self.told.modal.is_some();
        if idle > dwell + if asks { IDLE_MAX } else { IDLE_MAX_UNASKED } {
            return self.resynchronise(asks, now);
        }
        let motionless = now.saturating_sub(self.watch.moved_at);
        if motionless > MOTIONLESS_MAX + dwell {
            let at = self.place();
            self.stop(Fault::Motionless { at, seconds: motionless.as_secs() }, now);
        }
    }

    /// The controller is idle and owes answers: asks what it has taken. Being idle, it has room for that.
    fn resynchronise(&mut self, asks: bool, now: Duration) {
        if !asks || self.watch.resyncs >= RESYNC_MAX {
            let at = self.place();
            return self.stop(Fault::Lost { at }, now);
        }
        self.watch.resyncs += 1;
        self.watch.idle_since = None;
        if self.checking.is_some() {
            self.ask_again(now);
        } else {
            self.send(QUERY, What::Query, now);
        }
    }
}

fn state_text(status: &Status) -> String {
    if status.detail.is_empty() { status.state.clone() } else { format!("{}:{}", status.state, status.detail) }
}
