//! Ends that are not the end of the program: reset, limits, a jog that is cancelled.

use embedded_storage::nor_flash::NorFlash;

use super::{Controller, Job, Mode};
use crate::error::Alarm;
use crate::gcode::GcodeState;
use crate::pen::Pen;
use crate::planner::Overrides;
use crate::stepper::StepSink;

impl<const BLOCKS: usize, F: NorFlash> Controller<BLOCKS, F> {
    /// 0x18: forgets everything but settings, offsets and position.
    pub(super) fn soft_reset(&mut self, stepper: &mut impl StepSink) {
        // Whoever stands still, also in the middle of a held block, knows where it is.
        let lost = stepper.is_moving() || self.planner.speed_sqr > 0.0;
        let alarm = match self.job {
            Job::Homing(_) => Some(Alarm::HomingReset),
            _ if lost => Some(Alarm::AbortedInMotion),
            _ => None,
        };
        self.receiver.clear();
        self.editor.clear();
        self.hear_anew();
        if !self.transmitter.has_room() {
            // Nobody reads; what comes now matters more.
            self.transmitter.clear();
        }
        self.job = Job::None;
        #[cfg(feature = "scene")]
        self.desk.abandon();
        self.jogging = false;
        self.cancel_jog = false;
        self.reset = false;
        self.status_wanted = false;
        self.overrides = Overrides::default();
        self.planner.set_overrides(self.overrides);
        (self.pen_override, self.pen_due) = (100, false);
        self.gcode = GcodeState { offset: self.gcode.offset, ..GcodeState::default() };
        self.stop_at_once(stepper);
        // An alarm stays locked until `$H` or `$X`, like everything that is not a check.
        let locked = alarm.is_some() || matches!(self.mode, Mode::Alarm | Mode::NeedsReset | Mode::Sleep);
        self.mode = if locked { Mode::Alarm } else { Mode::Normal };
        if let Some(alarm) = alarm {
            self.tell_alarm(alarm);
        }
        stepper.configure(self.wiring());
        self.offset_report = 0;
        self.override_report = 1;
        self.greet();
    }

    /// Says why it has stopped; to HPGL, when it asks.
    pub(super) fn tell_alarm(&mut self, alarm: Alarm) {
        if self.speech.is_hpgl() {
            self.speech.fail();
            return;
        }
        self.transmitter.alarm(alarm);
        if self.mode == Mode::NeedsReset {
            self.transmitter.text("[MSG:Reset to continue]");
        }
    }

    /// The banner, and the start-up lines, or why they are not run. HPGL has neither.
    pub(super) fn greet(&mut self) {
        self.startup = None;
        if self.speech.is_hpgl() {
            return;
        }
        self.transmitter.banner();
        if self.mode == Mode::Alarm {
            self.transmitter.text("[MSG:'$H'|'$X' to unlock]");
        } else {
            self.startup = Some(0);
        }
    }

    /// Stops without deceleration, forgets all motion, and lifts the pen. The steps that were made count.
    pub(super) fn stop_at_once(&mut self, stepper: &mut impl StepSink) {
        stepper.abort();
        self.hold = super::Hold::default();
        self.braking = false;
        self.running = false;
        self.pen = Pen::Off;
        self.waiting_pen = None;
        self.sync_position(stepper);
    }

    /// Stops with deceleration, and then forgets what is planned. True once that is done.
    pub(super) fn brake(&mut self, stepper: &impl StepSink) -> bool {
        self.braking = true;
        if self.planner.speed_sqr != 0.0 || stepper.is_moving() {
            return false;
        }
        self.sync_position(stepper);
        self.braking = false;
        self.running = false;
        true
    }

    /// Stops with deceleration and waits for a reset.
    pub(super) fn soft_limit(&mut self) {
        self.hold.begin();
        self.mode = Mode::NeedsReset;
        self.tell_alarm(Alarm::SoftLimit);
    }

    /// With `$21`, a switch that closes stops the machine at once. One that was closed before does not: the machine must be able to leave it.
    pub(super) fn mind_limits(&mut self, stepper: &mut impl StepSink) {
        if !self.stored.settings.hard_limits {
            return;
        }
        let closed = self.limits(stepper);
        let new = closed.bits() & !self.limits_before.bits() != 0;
        self.limits_before = closed;
        if new && stepper.is_moving() && !self.is_homing() && self.mode != Mode::NeedsReset {
            self.job = Job::None;
            self.jogging = false;
            self.cancel_jog = false;
            self.stop_at_once(stepper);
            self.mode = Mode::NeedsReset;
            self.tell_alarm(Alarm::HardLimit);
        }
    }

    /// Ends the jog when it is done, or when it has been stopped.
    pub(super) fn mind_jog(&mut self, stepper: &impl StepSink) {
        if self.cancel_jog {
            if self.brake(stepper) {
                if !matches!(core::mem::take(&mut self.job), Job::None) {
                    self.transmitter.answer(Ok(()));
                }
                self.cancel_jog = false;
                self.jogging = false;
            }
        } else if matches!(self.job, Job::None) && self.is_still(stepper) {
            self.jogging = false;
        }
    }

    /// `$SLP`: the pen goes up and the motors are released; only a reset wakes it, and then its place is not certain.
    pub(super) fn sleep(&mut self, stepper: &mut impl StepSink) {
        self.stop_at_once(stepper);
        self.mode = Mode::Sleep;
        stepper.configure(self.wiring());
        self.transmitter.text("[MSG:Sleeping]");
    }
}
