//! Lines: G-code is interpreted, `$` commands are obeyed.

use super::{Controller, Job, Mode};
use crate::axis::AXES;
use crate::error::Error;
use crate::gcode::{interpret, interpret_jog};
use crate::stepper::StepSink;
use crate::system::{self, SystemCommand};

impl<const BLOCKS: usize> Controller<BLOCKS> {
    pub(super) fn read_line(&mut self, stepper: &mut impl StepSink) -> bool {
        while let Some(byte) = self.receiver.pop() {
            if self.editor.push(byte) {
                let result = self.take_line(stepper);
                self.editor.clear();
                match result {
                    Ok(Job::None) => self.transmitter.answer(Ok(())),
                    Ok(job) => self.job = job,
                    Err(error) => self.transmitter.answer(Err(error)),
                }
                return true;
            }
        }
        false
    }

    pub(super) fn take_line(&mut self, stepper: &mut impl StepSink) -> Result<Job, Error> {
        let line = self.editor.line()?;
        match line {
            [] => Ok(Job::None),
            [b'$', b'J', b'=', jog @ ..] => {
                let free = self.jogging || (self.is_still(stepper) && !self.hold);
                if self.mode != Mode::Normal || !free || self.cancel_jog {
                    return Err(Error::NotIdle);
                }
                let (state, actions) = interpret_jog(jog, &self.gcode, &self.settings)?;
                self.gcode = state;
                self.jogging = true;
                Ok(Job::Actions { actions, dwell: None })
            }
            [b'$', ..] => {
                let command = system::parse(line)?;
                self.obey(command, stepper)
            }
            _ if self.mode == Mode::Alarm || self.jogging => Err(Error::Locked),
            _ => {
                let (state, actions) = interpret(line, &self.gcode, &self.settings)?;
                if state.offset != self.gcode.offset {
                    self.offset_report = 0;
                }
                self.gcode = state;
                if self.mode == Mode::Check {
                    return Ok(Job::None);
                }
                Ok(Job::Actions { actions, dwell: None })
            }
        }
    }

    pub(super) fn obey(&mut self, command: SystemCommand, stepper: &mut impl StepSink) -> Result<Job, Error> {
        let still = self.is_still(stepper) && !self.hold;
        let anywhere = matches!(command, SystemCommand::Help | SystemCommand::Modal);
        if !(still || anywhere) {
            return Err(Error::NotIdle);
        }
        match command {
            SystemCommand::Help => {
                self.transmitter.text("[HLP:$$ $# $G $I $N $x=val $C $X $H $J=line $RST= ~ ! ? ctrl-x]")
            }
            SystemCommand::Settings => return Ok(Job::Settings(0)),
            SystemCommand::Parameters => return Ok(Job::Parameters(0)),
            SystemCommand::Modal => self.transmitter.modal(&self.gcode, &self.settings),
            SystemCommand::Version => {
                self.transmitter.version(false, BLOCKS, crate::RX_BYTES);
                self.transmitter.version(true, BLOCKS, crate::RX_BYTES);
            }
            SystemCommand::StartupLines => {
                self.transmitter.text("$N0=");
                self.transmitter.text("$N1=");
            }
            SystemCommand::CheckMode if self.mode == Mode::Check => {
                self.transmitter.text("[MSG:Disabled]");
                self.mode = Mode::Normal;
                self.reset = true;
            }
            SystemCommand::CheckMode => {
                if self.mode != Mode::Normal {
                    return Err(Error::NotIdle);
                }
                self.transmitter.text("[MSG:Enabled]");
                self.mode = Mode::Check;
            }
            SystemCommand::Unlock => {
                if self.mode == Mode::Alarm {
                    self.transmitter.text("[MSG:Caution: Unlocked]");
                    self.mode = Mode::Normal;
                }
            }
            SystemCommand::Home => return Err(Error::HomingDisabled),
            SystemCommand::RestoreSettings => {
                self.settings = self.defaults.clone();
                self.apply_settings(stepper);
            }
            SystemCommand::ClearOffsets => {
                self.gcode.offset = [0.0; AXES];
                self.offset_report = 0;
            }
            SystemCommand::Set(id, value) => {
                self.settings.set(id, value)?;
                self.apply_settings(stepper);
            }
        }
        Ok(Job::None)
    }

    pub(super) fn apply_settings(&mut self, stepper: &mut impl StepSink) {
        stepper.configure(self.wiring());
        // The steps stay, so with another scale the position in mm changes.
        self.sync_position(stepper);
    }
}
