//! What would go wrong with a job, said before the plotter has moved.
//!
//! [`job`] holds the exact bytes of a job against the profile of its device; [`told`] holds it against what a GRBL controller
//! tells of itself, which [`Probe`] asks for; [`Check`] lets the controller read the whole job in its check mode. [`Window`] asks an HPGL
//! plotter where its pens can go.

mod check;
mod gcode;
mod hpgl;
mod probe;
mod window;

use std::fmt;

pub use check::Check;
pub use gcode::told;
pub use probe::{Probe, Told};
pub use window::Window;

use crate::device::{Device, Language};
use crate::protocol::{Event, Unit, grbl};

/// Something that is wrong, or may be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Whether the job must not be sent with it.
    pub severity: Severity,
    /// Where, if it is at one place: what is counted, and its number in the file from 1.
    pub place: Option<(Unit, usize)>,
    /// What is wrong and what to do, in one line.
    pub what: String,
}

/// How bad a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// The job will not be drawn as it is.
    Error,
    /// It may not.
    Warning,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let severity = match self.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        write!(f, "{severity}: {}", self.text())
    }
}

impl Finding {
    /// Where and what, without the severity.
    #[must_use]
    pub fn text(&self) -> String {
        match self.place {
            Some((unit, number)) => format!("{unit} {number} {}", self.what),
            None => self.what.clone(),
        }
    }
}

/// What is wrong with a job for a device, as far as its profile tells. A fault that is repeated is told once.
#[must_use]
pub fn job(bytes: &[u8], device: &Device) -> Vec<Finding> {
    match &device.language {
        Language::Grbl(language) | Language::Marlin(language) => {
            match grbl::Job::new(&String::from_utf8_lossy(bytes), language.line_limit) {
                Ok(job) => gcode::job(&job, device, language),
                Err(error) => vec![whole(Severity::Error, error.to_string())],
            }
        }
        Language::Hpgl(language) => match crate::protocol::hpgl::Job::new(bytes) {
            Ok(job) => hpgl::job(&job, device, language),
            Err(error) => vec![whole(Severity::Error, error.to_string())],
        },
    }
}

/// A finding that is about the whole job.
fn whole(severity: Severity, what: String) -> Finding {
    Finding { severity, place: None, what }
}

/// Findings of one kind, of which the first is told and the others are counted.
#[derive(Debug, Default)]
struct Repeated {
    first: Option<Finding>,
    more: usize,
}

impl Repeated {
    fn add(&mut self, severity: Severity, unit: Unit, number: usize, what: impl FnOnce() -> String) {
        match self.first {
            None => self.first = Some(Finding { severity, place: Some((unit, number)), what: what() }),
            Some(_) => self.more += 1,
        }
    }

    fn finish(self, unit: Unit) -> Option<Finding> {
        let mut finding = self.first?;
        if self.more > 0 {
            finding.what.push_str(&format!(" (and {} more {unit}s like it)", self.more));
        }
        Some(finding)
    }
}

/// The event at the end of a conversation.
fn end(result: Result<(), crate::protocol::Fault>) -> Event {
    match result {
        Ok(()) => Event::Done,
        Err(fault) => Event::Failed(fault),
    }
}

#[cfg(test)]
mod tests;
