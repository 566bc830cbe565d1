//! `$PV`: scenes that the machine draws by itself, over the [`Desk`].

use embedded_storage::nor_flash::NorFlash;

use super::{Controller, Job, Mode};
use crate::error::Error;
use crate::line::LineEditor;
use crate::scene::Desk;
use crate::stepper::StepSink;

impl<const BLOCKS: usize, F: NorFlash> Controller<BLOCKS, F> {
    /// What connects it with the [`Studio`](crate::scene::Studio) that computes drawings.
    pub fn desk_mut(&mut self) -> &mut Desk {
        &mut self.desk
    }

    /// A `$PV` line, without those letters. It is answered over the desk.
    ///
    /// # Errors
    /// If it is none, or the machine is not idle.
    pub(super) fn order(&mut self, text: &[u8], stepper: &impl StepSink) -> Result<Job, Error> {
        if self.mode != Mode::Normal || self.hold.is_on() || !self.is_still(stepper) {
            return Err(Error::NotIdle);
        }
        self.desk.order(text)?;
        Ok(Job::None)
    }

    /// Takes what there is for the controller from the desk. True when anything was done.
    pub(super) fn mind_desk(&mut self) -> bool {
        if let Some(line) = self.desk.take_line() {
            // Stripped as a line from the port is: those of a program have blanks.
            let mut editor = LineEditor::default();
            line.bytes().for_each(|byte| _ = editor.push(byte));
            match editor.line().and_then(|line| self.take_gcode(line)) {
                Ok(job) => self.job = job,
                Err(error) => self.desk.refuse(error),
            }
            return true;
        }
        let Some(answer) = self.desk.take_answer() else { return false };
        if !answer.text.is_empty() {
            self.transmitter.text(&answer.text);
        }
        self.transmitter.answer(answer.result);
        true
    }
}
