//! The status report.

use embedded_storage::nor_flash::NorFlash;

use super::{Controller, Mode, REPORT_CYCLE};
use crate::gcode::Spindle;
use crate::report::{OverrideReport, Status};
use crate::stepper::StepSink;

impl<const BLOCKS: usize, F: NorFlash> Controller<BLOCKS, F> {
    fn state(&self, stepper: &impl StepSink) -> &'static str {
        let moving = !stepper.is_idle() || self.running;
        let rests = self.planner.speed_sqr == 0.0 && stepper.is_idle();
        match self.mode {
            Mode::Sleep => "Sleep",
            _ if self.is_homing() => "Home",
            Mode::Alarm | Mode::NeedsReset => "Alarm",
            _ if self.jogging => "Jog",
            _ if self.hold.is_door() => {
                if rests {
                    "Door:0"
                } else {
                    "Door:2"
                }
            }
            _ if self.hold.is_on() => {
                if rests {
                    "Hold:0"
                } else {
                    "Hold:1"
                }
            }
            Mode::Check => "Check",
            Mode::Normal if moving || !self.planner.is_empty() || self.is_drawing() => "Run",
            Mode::Normal => "Idle",
        }
    }

    pub(super) fn report_status(&mut self, stepper: &mut impl StepSink) {
        let with_offset = self.offset_report == 0;
        self.offset_report = if with_offset { REPORT_CYCLE } else { self.offset_report - 1 };
        let with_overrides = !with_offset && self.override_report == 0;
        if with_overrides {
            self.override_report = REPORT_CYCLE;
        } else {
            self.override_report = self.override_report.saturating_sub(1);
        }
        let drawn = stepper.drawn();
        let feed = f64::from(libm::sqrtf(self.planner.speed_sqr)) * 60.0;
        let status = Status {
            state: self.state(stepper),
            position: self.stored.settings.pen(stepper.position().map(f64::from)),
            offset: self.gcode.work_offset(&self.stored.systems),
            lines_free: self.planner.free(drawn.lines),
            rx_free: self.receiver.free(),
            line: drawn.number,
            feed,
            speed: if self.gcode.spindle == Spindle::Off { 0.0 } else { self.gcode.speed },
            limits: self.limits(stepper),
            door: self.hold.is_door(),
            overrides: with_overrides.then_some(OverrideReport {
                feed: self.overrides.feed,
                rapid: self.overrides.rapid,
                pen: self.pen_override,
                spindle: self.gcode.spindle,
                flood: self.gcode.flood,
                mist: self.gcode.mist,
            }),
            with_offset,
            settings: &self.stored.settings,
        };
        self.transmitter.status(&status);
    }
}
