//! Holds the machine against the job, at the places that the plan has for that.
//!
//! ```text
//!  lines of the part sent ──> [G4 P0.01] $G ── [GC:…] and ok ──> state as wanted ── `?` ──> place as wanted ──> go on
//!                                 │                                 │                          │
//!                                 no answer: ask again              not: ask again, then       not, three times: stop,
//!                                                                   repeat the pen's lines     with the line at fault
//! ```
//!
//! Nothing else is on the way meanwhile, and the machine is at rest, so that repeating the lines of the pen does no harm.

use std::collections::VecDeque;
use std::time::Duration;

use super::plan::is_dwell;
use super::report::{self, Place, Status};
use super::{BARRIER, Event, Fault, Grbl, Phase, Protocol, QUERY, Sent, What, explain, refused};
use crate::trace::gcode::{Distance, Modal};

/// The `ok` of a `$G` follows its answer at once; after this time it is taken for lost.
const OK_WAIT: Duration = Duration::from_secs(1);
/// Time beyond the dwells of a check after which a question without an answer is asked again.
const ANSWER_WAIT: Duration = Duration::from_secs(1);
/// Times that a question is asked at one check.
const ASKED_MAX: u32 = 6;
/// Reports in a row of a wrong place that prove it.
const MISPLACED_MAX: u32 = 3;
/// Reports without the place of the origin after which places are given up: GRBL tells it in one of thirty.
const WITHOUT_ORIGIN_MAX: u32 = 100;
/// A controller that ends a dwell too soon so many times, on lines that were not changed, has a clock of its own.
const DWELL_REPEATS: u32 = 2;
/// A dwell that is answered after less than this part of its time was changed on the way.
const DWELL_PART: f64 = 0.75;
/// How much earlier still an answer may seem to come for the delays of the line, s.
const DWELL_JITTER: f64 = 0.01;
/// Half the last digit of reports: 0.001 mm, or 0.0001 inches.
const REPORT_ROUNDING: f64 = 0.0005;
/// A step that is coarser than that of any plotter, mm; taken where $100 and its kin do not tell.
const STEP_COARSE: f64 = 0.05;
/// Half the last digit of what is sent in differences, mm, twice: the model stays so near to the job.
const SENT_ROUNDING: f64 = 0.001;
/// Relative error of a number that is read in floats of 32 bits, each digit by itself.
const FLOAT_ERROR: f64 = 2.4e-7;

/// A check under way.
#[derive(Debug)]
pub(super) struct Checking {
    /// Lines that are still to be sent for it.
    pub(super) queue: VecDeque<(String, What)>,
    stage: Stage,
    /// What `$G` told, and when.
    reported: Option<(Modal, Duration)>,
    /// When something was last asked.
    asked_at: Duration,
    asked: u32,
    /// Answers in a row that were not as wanted.
    pub(super) misses: u32,
    /// Whether the lines of the pen were repeated.
    repeated: bool,
    /// Whether the feed was sent again.
    pub(super) feed_sent: bool,
    /// Whether the place was seen to be right already.
    placed: bool,
    without_origin: u32,
    /// How often the origin had been told when it began.
    origins_told: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// The state is wanted.
    Modal,
    /// The place is wanted.
    Place,
}

impl Grbl {
    fn verified(&self) -> bool {
        self.told.modal.is_some()
    }

    /// All lines of the part are sent: begins its check.
    pub(super) fn begin_check(&mut self, now: Duration) {
        if !self.verified() && !self.on_the_way.is_empty() {
            // Nothing else tells an answer from the next one.
            return;
        }
        let mut queue = VecDeque::new();
        self.queue_questions(&mut queue);
        self.checking = Some(Checking {
            queue,
            stage: Stage::Modal,
            reported: None,
            asked_at: now,
            asked: 0,
            misses: 0,
            repeated: false,
            feed_sent: false,
            placed: false,
            without_origin: 0,
            origins_told: self.told.origins_told,
        });
        self.advance_check(now);
    }

    fn queue_questions(&self, queue: &mut VecDeque<(String, What)>) {
        if !self.verified() || !self.plan.rests(&self.job, self.part) {
            let relative = self.plan.check(self.part).is_some_and(|check| check.then_relative);
            queue.push_back((format!("{}{BARRIER}", if relative { "G91" } else { "" }), What::Barrier));
        }
        if self.verified() {
            queue.push_back((QUERY.to_owned(), What::Query));
        }
    }

    /// Sends what a check still has to send, and asks again what was not answered.
    pub(super) fn advance_check(&mut self, now: Duration) {
        let Some(mut checking) = self.checking.take() else { return };
        while let Some((text, what)) = checking.queue.pop_front() {
            if !self.has_room(text.len()) {
                checking.queue.push_front((text, what));
                break;
            }
            self.send(&text, what, now);
            checking.asked_at = now;
        }
        let sent = checking.queue.is_empty();
        let reported = checking.reported.as_ref().map(|(_, at)| *at);
        let asked_at = checking.asked_at;
        let stage = checking.stage;
        self.checking = Some(checking);
        if !sent || self.hold.is_some() || !self.verified() {
            return;
        }
        let waited = now.saturating_sub(asked_at);
        match stage {
            Stage::Modal if reported.is_some_and(|at| now.saturating_sub(at) > OK_WAIT) => {
                // Its `ok` may come yet, and must not be taken for that of another line.
                for sent in &mut self.on_the_way {
                    sent.what = What::Ghost;
                }
                self.hold_against_state(now);
            }
            Stage::Modal
                if reported.is_none()
                    && self.on_the_way.is_empty()
                    && waited > ANSWER_WAIT + self.job.longest_dwell() * 2 =>
            {
                self.ask_again(now);
            }
            Stage::Place if waited > ANSWER_WAIT => self.ask_place(now),
            _ => {}
        }
    }

    /// Asks for the state again. Also where lines seem to be on the way, though the controller is idle.
    pub(super) fn ask_again(&mut self, now: Duration) {
        let Some(checking) = &mut self.checking else { return };
        checking.asked += 1;
        checking.asked_at = now;
        if checking.asked > ASKED_MAX {
            let at = self.place();
            return self.stop(Fault::Lost { at }, now);
        }
        self.send(QUERY, What::Query, now);
    }

    fn ask_place(&mut self, now: Duration) {
        let Some(checking) = &mut self.checking else { return };
        checking.asked += 1;
        checking.asked_at = now;
        if checking.asked > ASKED_MAX {
            let at = self.place();
            return self.stop(Fault::Lost { at }, now);
        }
        self.ask_status(now);
    }

    /// `$G` told this. Whatever was sent before it was taken, whether its `ok` was lost or came twice.
    pub(super) fn modal(&mut self, modal: Modal, now: Duration) {
        match self.phase {
            Phase::Probing => self.told.modal = Some(modal),
            Phase::Streaming => {
                if self.checking.is_none() && !self.is_as_lines_leave_it(&modal, now) {
                    return;
                }
                match self.on_the_way.iter().position(|sent| sent.what == What::Query) {
                    Some(count) => {
                        for sent in self.on_the_way.drain(..count) {
                            self.used -= sent.bytes;
                            if let What::Line(index) = sent.what {
                                self.answered = self.answered.max(index + 1);
                            }
                        }
                    }
                    // An `ok` too many was taken for its answer; the right one follows.
                    None => self.on_the_way.push_front(Sent { what: What::Ghost, bytes: 0, at: now }),
                }
                match &mut self.checking {
                    Some(checking) if checking.stage == Stage::Modal => checking.reported = Some((modal, now)),
                    Some(_) => {}
                    None => {}
                }
            }
            _ => {}
        }
    }

    /// An idle controller told its state in the middle of a part. One that has restarted without a banner that is known has
    /// forgotten what was sent, and would take differences for places.
    fn is_as_lines_leave_it(&mut self, found: &Modal, now: Duration) -> bool {
        let mut wanted = self.plan.followed.state_after(self.next.checked_sub(1)).clone();
        let start = self.plan.start(self.part);
        if self
            .plan
            .check(self.part)
            .is_some_and(|check| check.relative && (start..=check.pen_lines).contains(&self.next))
        {
            wanted.distance = Some(Distance::Incremental);
        }
        wanted.speed = wanted.speed.map(|speed| self.heights.level(speed));
        let Some((wanted, found)) = report::difference(&wanted, found) else { return true };
        let at = self.place();
        self.stop(Fault::Garbled { at, wanted, found }, now);
        false
    }

    /// The `ok` (or error) of a `$G`, or of something that was taken for it.
    pub(super) fn query_answered(&mut self, error: Option<&str>, now: Duration) {
        if let (Some(code), Phase::Streaming) = (error, self.phase) {
            if self.checking.is_none() {
                return self.stop(refused(self.place(), code), now);
            }
            return self.repeat_pen_lines(now, |grbl| refused(grbl.place(), code));
        }
        self.state_is_told(now);
    }

    /// An `ok` came that belongs to no line of the job: to the `$G` of a check whose answer is there, perhaps.
    fn state_is_told(&mut self, now: Duration) {
        let told = self.checking.as_ref().is_some_and(|checking| checking.reported.is_some());
        if told && self.on_the_way.is_empty() {
            self.hold_against_state(now);
        }
    }

    /// An answer to nothing that is on the way.
    pub(super) fn answered_nothing(&mut self, error: Option<&str>, now: Duration) {
        self.unknown = self.unknown.saturating_add(1);
        if let (Some(code), Phase::Streaming) = (error, self.phase) {
            // Something was refused, and an `ok` too many before it hides what.
            self.stop(refused(self.place_of(self.answered.saturating_sub(1)), code), now);
        }
    }

    /// An answer to something that was given up.
    pub(super) fn ghost_answered(&mut self, error: Option<&str>, now: Duration) {
        match (error, self.phase) {
            (Some(code), Phase::Streaming) => self.stop(refused(self.place(), code), now),
            _ => self.state_is_told(now),
        }
    }

    /// The motion before a barrier has ended.
    pub(super) fn barrier_answered(&mut self, now: Duration) {
        self.at_rest = true;
        if self.checking.is_some() && !self.verified() {
            self.finish_check(now);
        }
    }

    /// A line of the job was taken.
    pub(super) fn line_taken(&mut self, index: usize, sent_at: Duration, now: Duration) {
        if !self.verified() {
            return;
        }
        let lines = self.job.lines();
        if lines.get(index).is_some_and(is_dwell) {
            let wanted = self.plan.followed.trace.steps.get(index).map_or(0.0, |step| step.seconds);
            let began = sent_at.max(self.watch.answered_before);
            let took = now.saturating_sub(began).as_secs_f64();
            if took < wanted * DWELL_PART - DWELL_JITTER {
                self.watch.short_dwell = Some(index);
            } else {
                self.watch.dwells_repeated = 0;
            }
        }
        // While the pen's dwell goes on, the machine rests already.
        let next = self.on_the_way.front().map(|sent| sent.what);
        let last = self.plan.check(self.part).and_then(|check| check.end.checked_sub(1));
        if let (Some(What::Line(next)), Some(last)) = (next, last)
            && next == last
            && self.checking.is_some()
            && lines.get(last).is_some_and(is_dwell)
        {
            self.ask_status(now);
        }
    }

    fn hold_against_state(&mut self, now: Duration) {
        let Some(check) = self.plan.check(self.part).cloned() else { return };
        let Some(checking) = &mut self.checking else { return };
        let Some((found, _)) = checking.reported.take() else { return };
        self.answered = self.answered.max(check.end);
        let mut wanted = self.plan.wanted(self.part);
        wanted.speed = wanted.speed.map(|speed| self.heights.level(speed));
        if let Some((wanted, found)) = report::difference(&wanted, &found) {
            checking.misses += 1;
            if checking.misses == 1 {
                // The report itself may have been changed on the way.
                return self.ask_again(now);
            }
            return self.repeat_pen_lines(now, |grbl| {
                let at = grbl.place_of(check.end.saturating_sub(1));
                Fault::Garbled { at, wanted, found }
            });
        }
        if !self.feed_is_settled(&wanted, &found, now) {
            return;
        }
        let Some(checking) = &mut self.checking else { return };
        checking.misses = 0;
        let short = self.watch.short_dwell.take().filter(|dwell| *dwell >= check.pen_lines);
        if let Some(dwell) = short.filter(|_| self.watch.dwells_repeated < DWELL_REPEATS) {
            self.watch.dwells_repeated += 1;
            let mut model = None;
            let text = self.plan.text(&self.job, dwell, self.part, &mut model);
            if let Some(checking) = &mut self.checking {
                checking.queue.extend([(text, What::Line(dwell)), (QUERY.to_owned(), What::Query)]);
            }
            return self.advance_check(now);
        }
        checking.stage = Stage::Place;
        checking.asked = 0;
        if checking.placed || !self.plan.followed.trace.steps.get(check.end.saturating_sub(1)).is_some_and(knows_place)
        {
            return self.finish_check(now);
        }
        self.ask_place(now);
    }

    /// Sends the lines that move the pen again, once; fails if they cannot be.
    fn repeat_pen_lines(&mut self, now: Duration, fault: impl FnOnce(&Self) -> Fault) {
        let Some(check) = self.plan.check(self.part).cloned() else { return };
        let repeats = check.repeatable && check.pen_lines < check.end;
        if self.checking.as_ref().is_none_or(|checking| checking.repeated) || !repeats {
            let fault = fault(self);
            return self.stop(fault, now);
        }
        let mut queue = VecDeque::new();
        for line in check.pen_lines..check.end {
            let text = self.plan.text(&self.job, line, self.part, &mut None);
            queue.push_back((self.heights.rewritten(&text), What::Line(line)));
        }
        self.queue_questions(&mut queue);
        if let Some(checking) = &mut self.checking {
            checking.repeated = true;
            checking.misses = 0;
            checking.reported = None;
            checking.queue = queue;
        }
        self.advance_check(now);
    }

    /// A status report while a check is under way.
    pub(super) fn place_reported(&mut self, status: &Status, now: Duration) {
        let Some(checking) = &mut self.checking else { return };
        let early = checking.stage == Stage::Modal;
        if early && status.state != "Idle" {
            return;
        }
        let Some(found) = self.told.place(status) else {
            checking.without_origin += 1;
            if checking.without_origin > WITHOUT_ORIGIN_MAX && !early {
                let text = "the plotter does not tell where it is; its place is not verified";
                self.outbox.tell(Event::Warning(text.to_owned()));
                return self.finish_check(now);
            }
            checking.asked = 0;
            if !early {
                self.ask_status(now);
            }
            return;
        };
        let mut off = self.off(found);
        if off != [0.0; 3]
            && let Some(other) = self.told.other_place(status)
            && self.off(other) == [0.0; 3]
        {
            self.told.take_other_origin();
            off = [0.0; 3];
        }
        let right = off.iter().all(|off| *off == 0.0);
        let Some(checking) = &mut self.checking else { return };
        match (early, right) {
            (true, right) => checking.placed = right,
            (false, true) => self.finish_check(now),
            (false, false) => {
                checking.misses += 1;
                // The place of the origin may have been mangled on the way, and is told now and then only.
                let origin_told = matches!(status.position, Some(Place::Work(_)))
                    || self.told.origins_told != checking.origins_told
                    || checking.misses > WITHOUT_ORIGIN_MAX;
                if checking.misses < MISPLACED_MAX || !origin_told {
                    checking.asked = 0;
                    self.ask_place(now);
                } else {
                    let fault = self.misplaced(off);
                    self.stop(fault, now);
                }
            }
        }
    }

    /// How far a place is from that at the check, mm; 0 within what rounding explains.
    fn off(&self, found: [f64; 3]) -> [f64; 3] {
        let Some(check) = self.plan.check(self.part) else { return [0.0; 3] };
        let steps = &self.plan.followed.trace.steps;
        let Some(step) = steps.get(check.end.saturating_sub(1)) else { return [0.0; 3] };
        let mut wanted = step.end.axes();
        wanted[2] = wanted[2].map(|z| self.heights.height(z));
        let part = steps.get(self.plan.start(self.part)..check.end).unwrap_or_default();
        let path: f64 = part.iter().map(|step| step.ink_mm + step.travel_mm).sum();
        let mut off = [0.0; 3];
        for axis in 0..off.len() {
            let Some(wanted) = wanted[axis] else { continue };
            let origin = self.told.origin.map_or(0.0, |origin| origin[axis]);
            // Half a step, the last digits of what is sent and what is reported (place and origin), and floats of 32 bits:
            // that of the place, and those of the differences that lead to it.
            let step = self.told.steps_per_mm[axis].map_or(STEP_COARSE, f64::recip);
            let size = wanted.abs() + 2.0 * origin.abs() + path;
            let allowed = step / 2.0
                + SENT_ROUNDING
                + 2.0 * REPORT_ROUNDING * if self.told.unit_mm == 1.0 { 1.0 } else { 2.54 }
                + FLOAT_ERROR * size;
            let distance = found[axis] - wanted;
            if distance.abs() > allowed {
                off[axis] = distance;
            }
        }
        off
    }

    /// The fault of being somewhere else, with the line that explains it if there is exactly one.
    fn misplaced(&self, off: [f64; 3]) -> Fault {
        let Some(check) = self.plan.check(self.part) else { return Fault::Lost { at: self.place_of(self.answered) } };
        let (first, end) = (self.plan.start(self.part), check.end);
        let origin = self.told.origin.unwrap_or_default();
        let mut model = self.plan.model(self.part, [origin[0], origin[1]], self.told.double);
        let sent: Vec<String> =
            (first..end).map(|line| self.plan.text(&self.job, line, self.part, &mut model)).collect();
        let lines: Vec<explain::Line<'_>> = (first..end)
            .zip(&sent)
            .map(|(line, text)| explain::Line {
                text,
                relative: check.relative && line < check.pen_lines
                    || self.plan.followed.state_after(Some(line)).distance == Some(Distance::Incremental),
                before: line
                    .checked_sub(1)
                    .and_then(|line| self.plan.followed.trace.steps.get(line))
                    .map_or([None; 2], |step| [step.end.x, step.end.y]),
            })
            .collect();
        let step =
            self.told.steps_per_mm.iter().take(2).flatten().fold(0.0, |step, steps| f64::max(step, steps.recip()));
        let culprit = explain::culprit(&lines, [off[0], off[1]], step / 2.0 + SENT_ROUNDING + REPORT_ROUNDING)
            .map(|line| self.place_of(first + line));
        let axes: Vec<String> = ["X", "Y", "Z"]
            .iter()
            .zip(off)
            .filter(|(_, off)| *off != 0.0)
            .map(|(axis, off)| format!("{axis} by {off:.3} mm"))
            .collect();
        Fault::Misplaced {
            first: self.place_of(first).number,
            last: self.place_of(end.saturating_sub(1)).number,
            off: axes.join(" and "),
            at: culprit,
        }
    }

    /// All is as it should be.
    fn finish_check(&mut self, now: Duration) {
        self.checking = None;
        let Some(check) = self.plan.check(self.part).cloned() else { return };
        self.answered = self.answered.max(check.end);
        self.executed = self.executed.max(check.end);
        self.at_rest = true;
        self.part += 1;
        if check.end >= self.job.lines().len() {
            self.phase = Phase::Over;
            self.outbox.tell(Event::Done);
        } else if self.pausing && check.pen_down == Some(false) {
            self.park();
        } else {
            self.stream(now);
        }
    }
}

fn knows_place(step: &crate::trace::Step) -> bool {
    step.end.axes().iter().any(Option::is_some)
}
