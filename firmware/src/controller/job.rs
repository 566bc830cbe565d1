//! What a line asks for, done piece by piece as the planner and the stepper have room.

use embedded_storage::nor_flash::NorFlash;

use super::{Controller, DWELL_PIECE, Job, Progress};
use crate::axis::AXES;
use crate::error::Error;
use crate::gcode::{Actions, Flow, Keep, Path, PenOrder, Speed};
use crate::pen::Pen;
use crate::planner::Overrides;
use crate::report::setting_id;
use crate::stepper::{Command, StepSink};

impl<const BLOCKS: usize, F: NorFlash> Controller<BLOCKS, F> {
    /// Goes on with the job, or else takes up the next line. True when anything was done.
    pub(super) fn advance(&mut self, stepper: &mut impl StepSink) -> bool {
        match core::mem::take(&mut self.job) {
            #[cfg(feature = "scene")]
            Job::None if self.is_drawing() => self.mind_desk(),
            Job::None if self.start_up() => true,
            Job::None if self.speech.is_hpgl() => self.plot(stepper),
            Job::None => self.read_line(stepper),
            Job::Settings(index) => {
                if let Some(id) = setting_id(index) {
                    self.transmitter.setting(id, &self.stored.settings);
                    self.job = Job::Settings(index + 1);
                } else {
                    self.transmitter.answer(Ok(()));
                }
                true
            }
            Job::Parameters(index) => {
                if self.transmitter.parameter(index, &self.gcode, &self.stored) {
                    self.job = Job::Parameters(index + 1);
                } else {
                    self.transmitter.answer(Ok(()));
                }
                true
            }
            Job::Homing(mut homing) => {
                // While it works it is the job, for all that asks.
                self.job = Job::Homing(homing);
                let progress = self.home(&mut homing, stepper);
                match progress {
                    Progress::Done => {
                        self.job = Job::None;
                        if !homing.silent {
                            self.transmitter.answer(Ok(()));
                        }
                        self.startup = homing.whole.then_some(0);
                    }
                    // A failure has ended it without an answer.
                    _ if self.is_homing() => self.job = Job::Homing(homing),
                    _ => {}
                }
                !matches!(progress, Progress::Waiting)
            }
            Job::Actions { mut actions, mut dwell } => match self.act(&mut actions, &mut dwell, stepper) {
                Ok(Progress::Done) => {
                    self.answer(Ok(()));
                    true
                }
                Ok(progress) => {
                    // A soft limit has ended the line without an answer.
                    if self.is_started() {
                        self.job = Job::Actions { actions, dwell };
                    }
                    matches!(progress, Progress::Moved)
                }
                Err(error) => {
                    #[cfg(feature = "scene")]
                    self.desk.refuse(error);
                    self.answer(Err(error));
                    true
                }
            },
        }
    }

    /// Does the next of `actions`.
    ///
    /// # Errors
    /// [`Error::StorageFailed`]. What of the line was to come after it is not done.
    fn act(
        &mut self,
        actions: &mut Actions,
        dwell: &mut Option<u64>,
        stepper: &mut impl StepSink,
    ) -> Result<Progress, Error> {
        if let Some(order) = actions.pen {
            let pen = self.pen_of(order);
            if self.stored.settings.laser_mode {
                self.waiting_pen = Some(pen);
            } else if !self.is_drained(stepper) || !self.hand_pen(pen, stepper) {
                return Ok(Progress::Waiting);
            }
            if let PenOrder::Speed(s) = order {
                self.pen_speed = s;
            }
            actions.pen = None;
            return Ok(Progress::Moved);
        }
        if let Some(keep) = actions.keep {
            // The memory may stop everything else while it is written.
            if !self.is_drained(stepper) {
                return Ok(Progress::Waiting);
            }
            let mut stored = self.stored.clone();
            let (slot, value) = match keep {
                Keep::System(index, origin) => (stored.systems.get_mut(index), origin),
                Keep::Place(index, place) => (stored.places.get_mut(index), place),
            };
            if let Some(slot) = slot {
                *slot = value;
            }
            self.keep(stored)?;
            self.offset_report = 0;
            actions.keep = None;
            return Ok(Progress::Moved);
        }
        Ok(self.go_on(actions, dwell, stepper))
    }

    /// Does the next of the actions that cannot fail.
    fn go_on(&mut self, actions: &mut Actions, dwell: &mut Option<u64>, stepper: &mut impl StepSink) -> Progress {
        if let Some(seconds) = actions.dwell {
            return self.dwell(seconds, actions, dwell, stepper);
        }
        if let Some(path) = &mut actions.motion {
            let progress = self.plan(path, stepper);
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
                self.hold.begin();
                actions.flow = Flow::Paused;
                Progress::Moved
            }
            Flow::Paused if self.hold.is_on() => Progress::Waiting,
            Flow::Paused => Progress::Done,
            Flow::End => {
                if !self.is_drained(stepper) || !self.hand_pen(Pen::Off, stepper) {
                    return Progress::Waiting;
                }
                self.gcode.end_program();
                self.overrides = Overrides::default();
                self.pen_override = 100;
                self.transmitter.text("[MSG:Pgm End]");
                Progress::Done
            }
        }
    }

    /// Everything before has been drawn, and nothing holds.
    pub(super) fn is_drained(&self, stepper: &impl StepSink) -> bool {
        !self.hold.is_on() && self.is_still(stepper)
    }

    /// G4: waits for the motion, hands the time to the stepper piece by piece, and waits for its end.
    fn dwell(
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
    fn plan(&mut self, path: &mut Path, stepper: &impl StepSink) -> Progress {
        if self.planner.is_full(stepper.drawn().lines) {
            return Progress::Waiting;
        }
        match path {
            Path::Line { via, target, speed } => match *via {
                Some(first) => match self.line(first, *speed) {
                    Progress::Done => {
                        *via = None;
                        Progress::Moved
                    }
                    progress => progress,
                },
                None => self.line(*target, *speed),
            },
            Path::Arc(arc) => {
                let mut ahead = arc.clone();
                let Some(target) = ahead.next() else { return Progress::Done };
                match self.line(target, arc.speed) {
                    Progress::Done => {
                        *arc = ahead;
                        Progress::Moved
                    }
                    progress => progress,
                }
            }
        }
    }

    /// Plans what is left of a line, or the next piece of it that is straight for the motors.
    pub(super) fn line(&mut self, target: [f64; AXES], speed: Speed) -> Progress {
        if !self.stored.settings.in_travel(target) {
            self.soft_limit();
            return Progress::Waiting;
        }
        let from = self.planner.end();
        let pieces = self.stored.settings.kinematics.pieces(from, target, self.stored.settings.arc_tolerance);
        for piece in 1..pieces {
            let share = f64::from(piece) / f64::from(pieces);
            let on_the_way = core::array::from_fn(|axis| from[axis] + (target[axis] - from[axis]) * share);
            // Less than a step is nothing: then so many pieces together.
            if self.append(on_the_way, speed) {
                return Progress::Moved;
            }
        }
        self.append(target, speed);
        Progress::Done
    }

    pub(super) fn append(&mut self, target: [f64; AXES], speed: Speed) -> bool {
        let appended = self.planner.append(target, speed, self.waiting_pen, self.gcode.line, &self.stored.settings);
        if appended {
            self.waiting_pen = None;
        }
        appended
    }
}
