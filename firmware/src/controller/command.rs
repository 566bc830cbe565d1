//! Lines: G-code is interpreted, `$` commands are obeyed.

use embedded_storage::nor_flash::NorFlash;

use super::{Controller, Homing, Job, Mode};
use crate::axis::{AXES, Axes};
use crate::error::Error;
use crate::gcode::{interpret, interpret_jog};
use crate::kinematics::Kinematics;
use crate::planner::Planner;
use crate::stepper::StepSink;
use crate::storage::{Stored, StoredLine};
use crate::system::{self, Restore, SystemCommand};

impl<const BLOCKS: usize, F: NorFlash> Controller<BLOCKS, F> {
    /// Whether start-up lines are still to be run.
    pub(super) fn has_startup(&self) -> bool {
        self.startup.is_some_and(|next| self.stored.startup.iter().skip(next).any(|line| !line.is_empty()))
    }

    /// Takes up the next start-up line. False when there is none.
    pub(super) fn start_up(&mut self) -> bool {
        let Some(next) = self.startup else { return false };
        let Some((index, line)) = self.stored.startup.iter().enumerate().skip(next).find(|(_, line)| !line.is_empty())
        else {
            self.startup = None;
            return false;
        };
        let line = line.clone();
        self.startup = Some(index);
        let result = self.take_gcode(&line);
        self.take_up(result);
        true
    }

    pub(super) fn read_line(&mut self, stepper: &mut impl StepSink) -> bool {
        while let Some(byte) = self.receiver.pop() {
            if self.editor.push(byte) {
                self.end_line(stepper);
                return true;
            }
        }
        false
    }

    /// The editor has a whole line.
    pub(super) fn end_line(&mut self, stepper: &mut impl StepSink) {
        let result = self.take_line(stepper);
        self.editor.clear();
        self.take_up(result);
    }

    /// A line has been read: it is answered at once, or when its job is done.
    fn take_up(&mut self, result: Result<Job, Error>) {
        match result {
            Ok(Job::None) => self.answer(Ok(())),
            Ok(job) => self.job = job,
            Err(error) => self.answer(Err(error)),
        }
    }

    /// Answers the line at work; a start-up line with its text, and not a line of a drawing, nor the line that asked for it before it is done.
    pub(super) fn answer(&mut self, result: Result<(), Error>) {
        if self.is_drawing() {
            return;
        }
        match self.startup {
            None => self.transmitter.answer(result),
            Some(index) => {
                if let Some(line) = self.stored.startup.get(index) {
                    self.transmitter.startup(line, result);
                }
                self.startup = Some(index + 1);
            }
        }
    }

    fn take_line(&mut self, stepper: &mut impl StepSink) -> Result<Job, Error> {
        // As long as the editor's, so nothing is cut off.
        let line: StoredLine = self.editor.line()?.iter().copied().collect();
        match line.as_slice() {
            [] => Ok(Job::None),
            [b'$', b'J', b'=', jog @ ..] => {
                let free = self.jogging || (self.is_still(stepper) && !self.hold.is_on());
                if self.mode != Mode::Normal || !free || self.cancel_jog {
                    return Err(Error::NotIdle);
                }
                let (state, actions) = interpret_jog(jog, &self.gcode, &self.stored)?;
                self.gcode = state;
                self.jogging = true;
                Ok(Job::Actions { actions, dwell: None })
            }
            #[cfg(feature = "scene")]
            [b'$', b'P', b'V', order @ ..] => self.order(order, stepper),
            [b'$', ..] => {
                let command = system::parse(&line)?;
                self.obey(command, stepper)
            }
            line => self.take_gcode(line),
        }
    }

    pub(super) fn take_gcode(&mut self, line: &[u8]) -> Result<Job, Error> {
        if self.mode == Mode::Alarm || self.jogging {
            return Err(Error::Locked);
        }
        let (state, actions) = interpret(line, &self.gcode, &self.stored)?;
        let systems = &self.stored.systems;
        if state.work_offset(systems) != self.gcode.work_offset(systems) {
            self.offset_report = 0;
        }
        self.gcode = state;
        if self.mode == Mode::Check {
            return Ok(Job::None);
        }
        Ok(Job::Actions { actions, dwell: None })
    }

    fn obey(&mut self, command: SystemCommand<'_>, stepper: &mut impl StepSink) -> Result<Job, Error> {
        let still = self.is_still(stepper) && !self.hold.is_on();
        let anywhere = matches!(command, SystemCommand::Help | SystemCommand::Modal);
        if !(still || anywhere) {
            return Err(Error::NotIdle);
        }
        match command {
            SystemCommand::Help => {
                self.transmitter.text("[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H $RST= ~ ! ? ctrl-x]")
            }
            SystemCommand::Settings => return Ok(Job::Settings(0)),
            SystemCommand::Parameters => return Ok(Job::Parameters(0)),
            SystemCommand::Modal => self.transmitter.modal(&self.gcode, &self.stored.settings),
            SystemCommand::Version => {
                self.transmitter.version(&self.stored.name, Planner::<BLOCKS>::LINES, crate::RX_BYTES)
            }
            SystemCommand::Name(name) => {
                let name = name.iter().copied().collect();
                self.keep(Stored { name, ..self.stored.clone() })?;
            }
            SystemCommand::StartupLines => {
                for (index, line) in self.stored.startup.iter().enumerate() {
                    self.transmitter.startup_line(index, line);
                }
            }
            SystemCommand::StartupLine(index, line) => self.keep_startup(index, line)?,
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
            SystemCommand::Home(axis) => return self.begin_homing(axis),
            SystemCommand::Sleep => {
                if !matches!(self.mode, Mode::Normal | Mode::Alarm) {
                    return Err(Error::NotIdle);
                }
                self.sleep(stepper);
            }
            SystemCommand::Restore(what) => self.restore(what, stepper)?,
            SystemCommand::Set(id, value) => {
                let mut stored = self.stored.clone();
                stored.settings.set(id, value)?;
                self.keep(stored)?;
                self.apply_settings(stepper);
            }
        }
        Ok(Job::None)
    }

    /// Puts `stored` into force, once it is in the memory.
    ///
    /// # Errors
    /// [`Error::StorageFailed`], and everything is as before.
    pub(super) fn keep(&mut self, stored: Stored) -> Result<(), Error> {
        self.slots.save(&stored).map_err(|_| Error::StorageFailed)?;
        self.stored = stored;
        Ok(())
    }

    /// `$N0=` and `$N1=`. The line is checked against the state as it is now, and not obeyed.
    fn keep_startup(&mut self, index: usize, line: &[u8]) -> Result<(), Error> {
        if self.mode != Mode::Normal {
            return Err(Error::NotIdle);
        }
        interpret(line, &self.gcode, &self.stored)?;
        let mut stored = self.stored.clone();
        let slot = stored.startup.get_mut(index).ok_or(Error::InvalidStatement)?;
        *slot = line.iter().copied().collect();
        self.keep(stored)
    }

    fn begin_homing(&mut self, axis: Option<usize>) -> Result<Job, Error> {
        let axes = self.stored.settings.homing_axes();
        let axes = match axis {
            None => axes,
            Some(axis) if axes.contains(axis) => Axes::from_bits(1 << axis),
            Some(_) => Axes::NONE,
        };
        if axes.is_empty() {
            if matches!(self.stored.settings.kinematics(), Kinematics::Hanging(_)) {
                self.transmitter.text("[MSG:A hanging pen does not home: put it at the origin by hand]");
            }
            return Err(Error::HomingDisabled);
        }
        if !matches!(self.mode, Mode::Normal | Mode::Alarm) {
            return Err(Error::NotIdle);
        }
        Ok(Job::Homing(Homing::new(axes, axis.is_none())))
    }

    /// `$RST=`: and then everything starts anew.
    fn restore(&mut self, what: Restore, stepper: &mut impl StepSink) -> Result<(), Error> {
        let mut stored = match what {
            Restore::All => Stored::new(self.defaults.clone()),
            Restore::Settings | Restore::Offsets => self.stored.clone(),
        };
        if what == Restore::Settings {
            stored.settings = self.defaults.clone();
        }
        if what == Restore::Offsets {
            let none = Stored::new(self.defaults.clone());
            (stored.systems, stored.places) = (none.systems, none.places);
        }
        self.keep(stored)?;
        if what != Restore::Settings {
            self.gcode.offset = [0.0; AXES];
        }
        self.apply_settings(stepper);
        self.transmitter.text("[MSG:Restoring defaults]");
        self.reset = true;
        Ok(())
    }

    fn apply_settings(&mut self, stepper: &mut impl StepSink) {
        stepper.configure(self.wiring());
        // The steps stay, so with another scale the position in mm changes.
        self.sync_position(stepper);
    }
}
