//! A job as a whole, in whichever language, with what is known of its course.

use std::time::Duration;

use super::{Rest, gcode, hpgl};
use crate::device::{Device, Gcode, Hpgl, Language};
use crate::journal::Reached;
use crate::protocol::{self, JobError, grbl};
use crate::trace::gcode::{Followed, Machine, follow};
use crate::trace::{self, Position, Step, Trace};

/// A job that can be told where it is, and from where it goes on.
#[derive(Clone, Debug)]
pub struct Whole {
    device: Device,
    course: Course,
}

#[derive(Clone, Debug)]
enum Course {
    Gcode { job: grbl::Job, language: Box<Gcode>, followed: Followed },
    Hpgl { job: protocol::hpgl::Job, language: Hpgl, trace: Trace },
}

impl Whole {
    /// Reads a job in the language of the device.
    ///
    /// # Errors
    /// [`JobError`]: it is none.
    pub fn new(bytes: &[u8], device: &Device) -> Result<Self, JobError> {
        let course = match &device.language {
            Language::Grbl(language) | Language::Marlin(language) => {
                let job = grbl::Job::new(&String::from_utf8_lossy(bytes), language.line_limit)?;
                let machine = Machine::new(device, language);
                let followed = follow(&job, &machine, &machine.before(), Position::UNKNOWN);
                Course::Gcode { job, language: Box::new(language.clone()), followed }
            }
            Language::Hpgl(language) => {
                let job = protocol::hpgl::Job::new(bytes)?;
                let trace = trace::hpgl::follow(&job, device, language);
                Course::Hpgl { job, language: language.clone(), trace }
            }
        };
        Ok(Self { device: device.clone(), course })
    }

    /// What each piece does.
    #[must_use]
    pub fn steps(&self) -> &[Step] {
        match &self.course {
            Course::Gcode { followed: Followed { trace, .. }, .. } | Course::Hpgl { trace, .. } => &trace.steps,
        }
    }

    /// Whether pieces are counted as they come, and have no numbers of their own.
    #[must_use]
    pub fn counts(&self) -> bool {
        matches!(self.course, Course::Hpgl { .. })
    }

    /// The longest time that it has the plotter stand still by itself.
    #[must_use]
    pub fn longest_dwell(&self) -> Duration {
        match &self.course {
            Course::Gcode { job, .. } => job.longest_dwell(),
            Course::Hpgl { .. } => Duration::ZERO,
        }
    }

    /// Whether it moves the origin (G92), so that its coordinates are not those that the machine has at rest.
    #[must_use]
    pub fn shifts(&self) -> bool {
        matches!(&self.course, Course::Gcode { job, .. } if gcode::shifts(job))
    }

    /// The line with which it homes the machine before it draws; none if it does not.
    #[must_use]
    pub fn homing(&self) -> Option<&str> {
        let Course::Gcode { job, .. } = &self.course else { return None };
        let drawn = self.steps().iter().position(|step| step.ink_mm > 0.0).unwrap_or(job.lines().len());
        let marlin = matches!(self.device.language, Language::Marlin(_));
        let homes = |text: &&str| text.starts_with("$H") || marlin && text.starts_with("G28") && !text.contains('.');
        job.lines().iter().take(drawn).map(|line| line.text.as_str()).find(homes)
    }

    /// How far it is when `pieces` of it are executed.
    #[must_use]
    pub fn reached(&self, pieces: usize) -> Reached {
        let step = pieces.checked_sub(1).and_then(|last| self.steps().get(last));
        let position = step.and_then(|step| Some([step.end.x?, step.end.y?, step.end.z.unwrap_or_default()]));
        Reached { executed: pieces as u64, pen: step.map_or(1, |step| step.pen), position }
    }

    /// What is left when `executed` pieces are executed; `overlap_mm` of a stroke that was broken off is drawn again. `pen` is the
    /// pen that the plotter holds.
    #[must_use]
    pub fn rest(&self, executed: usize, overlap_mm: f64, pen: u32) -> Rest {
        match &self.course {
            Course::Gcode { job, language, followed } => {
                gcode::rest(job, followed, executed, overlap_mm, &self.device, language, pen)
            }
            Course::Hpgl { job, language, .. } => hpgl::rest(job, executed, overlap_mm, &self.device, language),
        }
    }
}
