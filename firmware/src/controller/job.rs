//! What a line asks for, done piece by piece as the planner and the stepper have room.

use super::{Controller, DWELL_PIECE, Job, Mode, Progress};
use crate::axis::AXES;
use crate::gcode::{Actions, Flow, Path, Speed};
use crate::pen::Pen;
use crate::planner::Overrides;
use crate::report::setting_id;
use crate::stepper::{Command, StepSink};

impl<const BLOCKS: usize> Controller<BLOCKS> {
    /// Goes on with the job, or else takes up the next line. True when anything was done.
    pub(super) fn advance(&mut self, stepper: &mut impl StepSink) -> bool {
        match core::mem::take(&mut self.job) {
            Job::None => self.read_line(stepper),
            Job::Settings(index) => {
                if let Some(id) = setting_id(index) {
                    self.transmitter.setting(id, &self.settings);
                    self.job = Job::Settings(index + 1);
                } else {
                    self.transmitter.answer(Ok(()));
                }
                true
            }
            Job::Parameters(index) => {
                if self.transmitter.parameter(index, &self.gcode, &self.settings) {
                    self.job = Job::Parameters(index + 1);
                } else {
                    self.transmitter.answer(Ok(()));
                }
                true
            }
            Job::Actions { mut actions, mut dwell } => match self.act(&mut actions, &mut dwell, stepper) {
                Progress::Done => {
                    self.transmitter.answer(Ok(()));
                    true
                }
                progress => {
                    // A soft limit has ended the line without an answer.
                    if self.mode != Mode::NeedsReset {
                        self.job = Job::Actions { actions, dwell };
                    }
                    matches!(progress, Progress::Moved)
                }
            },
        }
    }

    /// Does the next of `actions`.
    pub(super) fn act(
        &mut self,
        actions: &mut Actions,
        dwell: &mut Option<u64>,
        stepper: &mut impl StepSink,
    ) -> Progress {
        if let Some(pen) = actions.pen {
            if self.settings.laser_mode {
                self.waiting_pen = Some(pen);
            } else if !self.is_drained(stepper) || !stepper.push(Command::Pen(pen)) {
                return Progress::Waiting;
            }
            actions.pen = None;
            return Progress::Moved;
        }
        if let Some(seconds) = actions.dwell {
            return self.dwell(seconds, actions, dwell, stepper);
        }
        if let Some(path) = &mut actions.motion {
            let progress = self.plan(path);
            if matches!(progress, Progress::Done) {
                actions.motion = None;
                return if actions.flow == Flow::Run { Progress::Done } else { Progress::Moved };
            }
            return progress;
        }
        match actions.flow {
            Flow::Run => Progress::Done,
            Flow::Pause => {
                // Held once everything before has been drawn; then the line ends at `~`.
                if !self.is_drained(stepper) {
                    return Progress::Waiting;
                }
                self.hold = true;
                actions.flow = Flow::Paused;
                Progress::Moved
            }
            Flow::Paused if self.hold => Progress::Waiting,
            Flow::Paused => Progress::Done,
            Flow::End => {
                if !self.is_drained(stepper) || !stepper.push(Command::Pen(Pen::Off)) {
                    return Progress::Waiting;
                }
                self.gcode.end_program();
                self.overrides = Overrides::default();
                self.transmitter.text("[MSG:Pgm End]");
                Progress::Done
            }
        }
    }

    /// Everything before has been drawn, and nothing holds.
    pub(super) fn is_drained(&self, stepper: &impl StepSink) -> bool {
        !self.hold && self.is_still(stepper)
    }

    /// G4: waits for the motion, hands the time to the stepper piece by piece, and waits for its end.
    pub(super) fn dwell(
        &mut self,
        seconds: f64,
        actions: &mut Actions,
        left: &mut Option<u64>,
        stepper: &mut impl StepSink,
    ) -> Progress {
        match *left {
            None if self.is_drained(stepper) => {
                // Saturates: half a million years.
                *left = Some(libm::ceil(seconds * 1e6) as u64);
                Progress::Moved
            }
            None => Progress::Waiting,
            Some(0) if stepper.is_idle() => {
                actions.dwell = None;
                Progress::Moved
            }
            Some(0) => Progress::Waiting,
            Some(rest) => {
                let piece = rest.min(DWELL_PIECE);
                if !stepper.push(Command::Dwell(piece as u32)) {
                    return Progress::Waiting;
                }
                *left = Some(rest - piece);
                Progress::Moved
            }
        }
    }

    /// Plans the next straight piece of `path`.
    pub(super) fn plan(&mut self, path: &mut Path) -> Progress {
        if self.planner.is_full() {
            return Progress::Waiting;
        }
        let (target, speed, last) = match path {
            Path::Line { target, speed } => (*target, *speed, true),
            Path::Arc(arc) => match arc.next() {
                Some(target) => (target, arc.speed, false),
                None => return Progress::Done,
            },
        };
        if !self.settings.in_travel(target) {
            self.soft_limit();
            return Progress::Waiting;
        }
        self.append(target, speed);
        if last { Progress::Done } else { Progress::Moved }
    }

    pub(super) fn append(&mut self, target: [f64; AXES], speed: Speed) {
        if self.planner.append(target, speed, self.waiting_pen, self.gcode.line, &self.settings) {
            self.waiting_pen = None;
        }
    }
}
