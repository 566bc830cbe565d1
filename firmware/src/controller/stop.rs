//! Ends that are not the end of the program: reset, limits, a jog that is cancelled.

use super::{Controller, Job, Mode};
use crate::error::Alarm;
use crate::gcode::GcodeState;
use crate::planner::Overrides;
use crate::stepper::StepSink;

impl<const BLOCKS: usize> Controller<BLOCKS> {
    pub(super) fn soft_reset(&mut self, stepper: &mut impl StepSink) {
        // Whoever stands still, also in the middle of a held block, knows where it is.
        let lost = stepper.is_moving() || self.planner.speed_sqr > 0.0;
        stepper.abort();
        self.receiver.clear();
        self.editor.clear();
        if !self.transmitter.has_room() {
            // Nobody reads; what comes now matters more.
            self.transmitter.clear();
        }
        self.job = Job::None;
        self.hold = false;
        self.jogging = false;
        self.cancel_jog = false;
        self.running = false;
        self.waiting_pen = None;
        self.reset = false;
        self.status_wanted = false;
        self.overrides = Overrides::default();
        self.planner.set_overrides(self.overrides);
        self.gcode = GcodeState { offset: self.gcode.offset, ..GcodeState::default() };
        self.sync_position(stepper);
        if lost {
            self.transmitter.alarm(Alarm::AbortedInMotion);
        }
        // ALARM:2 stays locked until `$X`, like everything that is not a check.
        self.mode =
            if lost || matches!(self.mode, Mode::Alarm | Mode::NeedsReset) { Mode::Alarm } else { Mode::Normal };
        self.transmitter.banner();
        if self.mode == Mode::Alarm {
            self.transmitter.text("[MSG:'$H'|'$X' to unlock]");
        }
        self.offset_report = 0;
        self.override_report = 1;
    }

    /// Stops with deceleration and waits for a reset.
    pub(super) fn soft_limit(&mut self) {
        self.hold = true;
        self.mode = Mode::NeedsReset;
        self.transmitter.alarm(Alarm::SoftLimit);
        self.transmitter.text("[MSG:Reset to continue]");
    }

    /// Ends the jog when it is done, or when it has been stopped.
    pub(super) fn mind_jog(&mut self, stepper: &impl StepSink) {
        if self.cancel_jog {
            self.hold = true;
            if self.planner.speed_sqr == 0.0 && !stepper.is_moving() {
                self.sync_position(stepper);
                self.running = false;
                if !matches!(core::mem::take(&mut self.job), Job::None) {
                    self.transmitter.answer(Ok(()));
                }
                self.hold = false;
                self.cancel_jog = false;
                self.jogging = false;
            }
        } else if matches!(self.job, Job::None) && self.is_still(stepper) {
            self.jogging = false;
        }
    }
}
