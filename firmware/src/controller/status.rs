//! The status report.

use super::{Controller, Mode, REPORT_CYCLE};
use crate::gcode::Spindle;
use crate::report::Status;
use crate::stepper::StepSink;

impl<const BLOCKS: usize> Controller<BLOCKS> {
    pub(super) fn report_status(&mut self, stepper: &impl StepSink) {
        let moving = !stepper.is_idle() || self.running;
        let state = match self.mode {
            Mode::Alarm | Mode::NeedsReset => "Alarm",
            _ if self.jogging => "Jog",
            _ if self.hold && moving && self.planner.speed_sqr > 0.0 => "Hold:1",
            _ if self.hold && !stepper.is_idle() => "Hold:1",
            _ if self.hold => "Hold:0",
            Mode::Check => "Check",
            Mode::Normal if moving || !self.planner.is_empty() => "Run",
            Mode::Normal => "Idle",
        };
        let with_offset = self.offset_report == 0;
        self.offset_report = if with_offset { REPORT_CYCLE } else { self.offset_report - 1 };
        let with_overrides = !with_offset && self.override_report == 0;
        if with_overrides {
            self.override_report = REPORT_CYCLE;
        } else {
            self.override_report = self.override_report.saturating_sub(1);
        }
        let feed = f64::from(libm::sqrtf(self.planner.speed_sqr)) * 60.0;
        let status = Status {
            state,
            position: self.millimetres(stepper.position()),
            offset: self.gcode.offset,
            blocks_free: self.planner.free(),
            rx_free: self.receiver.free(),
            line: self.planner.current.as_ref().map_or(0, |c| c.block.line),
            feed,
            speed: if self.gcode.spindle == Spindle::Off { 0.0 } else { self.gcode.speed },
            overrides: with_overrides.then_some((self.overrides.feed, self.overrides.rapid)),
            with_offset,
            settings: &self.settings,
        };
        self.transmitter.status(&status);
    }
}
