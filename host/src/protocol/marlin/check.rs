//! Holds the place of the machine against where the job leads, at the ends of strokes.

use std::time::Duration;

use super::{BARRIER, Event, Fault, Hold, Marlin, Phase, WHERE, What};
use crate::protocol::grbl::{Job, is_dwell};
use crate::trace::{Cut, Trace};

/// Answers in a row of a wrong place that prove it.
const MISPLACED_MAX: u32 = 3;
/// The answer of `M114` precedes its `ok`; only where that seems to have come already is it waited for.
const PLACE_WAIT: Duration = Duration::from_secs(1);
/// `M114` tells hundredths of a millimetre; and floats of 32 bits.
const ALLOWED: f64 = 0.011;

/// A check under way.
#[derive(Debug, Default)]
pub(super) struct Checking {
    /// What `M114` told.
    place: Option<[f64; 3]>,
    misses: u32,
    /// `M114` was answered, and where it is was not told yet.
    waits_since: Option<Duration>,
}

/// Where the job is held against the machine: behind each end of a stroke with the dwells that follow it, and at its end.
pub(super) fn places(job: &Job, trace: &Trace) -> Vec<usize> {
    let lines = job.lines();
    let mut places = Vec::new();
    for (index, step) in trace.steps.iter().enumerate() {
        if step.cut == Cut::StrokeEnd {
            let dwells = lines.iter().skip(index + 1).take_while(|line| is_dwell(line)).count();
            places.push(index + 1 + dwells);
        }
    }
    if places.last() != Some(&lines.len()) {
        places.push(lines.len());
    }
    places
}

impl Marlin {
    /// All lines of the part are on their way.
    pub(super) fn begin_check(&mut self) {
        self.checking = Some(Checking::default());
        self.queue.extend([(BARRIER.to_owned(), What::Barrier), (WHERE.to_owned(), What::Where)]);
    }

    /// `M400` was answered.
    pub(super) fn rests(&mut self, now: Duration) {
        self.at_rest = true;
        if self.checking.is_none() && self.hold == Some(Hold::Draining) {
            self.hold = Some(Hold::AtRest);
            self.outbox.tell(Event::Paused);
        }
        self.last_step = now;
    }

    /// `M114` tells a place.
    pub(super) fn place_told(&mut self, place: [f64; 3], now: Duration) {
        let Some(checking) = &mut self.checking else { return };
        checking.place = Some(place);
        // All before it was taken, though answers may have been lost.
        let sent = (self.upcoming - self.first_kept()) as usize;
        if let Some(index) = self.sent.iter().take(sent).rposition(|sent| sent.what == What::Where) {
            self.taken(self.first_kept() + index as u32, now);
        }
    }

    /// `M114` was answered.
    pub(super) fn where_answered(&mut self, now: Duration) {
        if let Some(checking) = &mut self.checking {
            checking.waits_since = Some(now);
        }
        self.advance_check(now);
    }

    /// Goes on when the place is told, or was to be told for too long.
    pub(super) fn advance_check(&mut self, now: Duration) {
        let Some(checking) = &mut self.checking else { return };
        let Some(since) = checking.waits_since else { return };
        if checking.place.is_some() || now.saturating_sub(since) > PLACE_WAIT {
            checking.waits_since = None;
            self.hold_against_place(now);
        }
    }

    fn hold_against_place(&mut self, now: Duration) {
        let Some(end) = self.checks.get(self.part).copied() else { return };
        let wanted = end.checked_sub(1).and_then(|last| self.trace.steps.get(last)).map(|step| step.end.axes());
        let wanted = wanted.map(|[x, y, z]| [x, y, z.map(|z| self.heights.height(z))]);
        let Some(checking) = &mut self.checking else { return };
        let off: Option<Vec<String>> = checking.place.take().zip(wanted).map(|(place, wanted)| {
            let axes = ["X", "Y", "Z"].iter().zip(place).zip(wanted);
            axes.filter_map(|((axis, at), wanted)| {
                let off = at - wanted?;
                (off.abs() > ALLOWED).then(|| format!("{axis} by {off:.2} mm"))
            })
            .collect()
        });
        match off {
            Some(off) if off.is_empty() => self.finish_check(now),
            off => {
                checking.misses += 1;
                if checking.misses < MISPLACED_MAX {
                    // The answer itself has no checksum.
                    self.queue.push_back((WHERE.to_owned(), What::Where));
                    return;
                }
                let first = self.part.checked_sub(1).and_then(|part| self.checks.get(part)).copied().unwrap_or(0);
                let fault = match off {
                    Some(off) => Fault::Misplaced {
                        first: self.place_of(first).number,
                        last: self.place_of(end.saturating_sub(1)).number,
                        off: off.join(" and "),
                        at: None,
                    },
                    None => Fault::Lost { at: self.place_of(end.saturating_sub(1)) },
                };
                self.stop(fault, now);
            }
        }
    }

    fn finish_check(&mut self, now: Duration) {
        self.checking = None;
        let Some(end) = self.checks.get(self.part).copied() else { return };
        self.executed = self.executed.max(end);
        self.answered = self.answered.max(end);
        self.part += 1;
        if end >= self.job.lines().len() {
            self.phase = Phase::Over;
            self.outbox.tell(Event::Done);
        } else if std::mem::take(&mut self.pausing) || self.hold == Some(Hold::Draining) {
            self.hold = Some(Hold::AtRest);
            self.outbox.tell(Event::Paused);
        }
        self.last_step = now;
    }
}
