//! Goes on with a job that was broken off: what is left of it, begun in the state in which it stopped.
//!
//! Three questions are answered, each in a module of its own: *what* is to be sent ([`gcode`], [`hpgl`]), *where* the pen is now
//! ([`locate`]), and whether that is a place on the way of the job ([`way`]).
//!
//! The rule is that nothing is left out. Where it is not known exactly how the machine stood after the last piece that was
//! executed, the job goes on from the last piece of which it is known; what lies between is drawn twice.

pub mod gcode;
pub mod hpgl;
pub mod locate;
mod renumber;
pub mod way;
mod whole;

pub use renumber::Renumbered;
pub use whole::Whole;

/// What is left of a job.
#[derive(Clone, Debug, PartialEq)]
pub struct Rest {
    /// What is to be sent, as a job of its own.
    pub job: Vec<u8>,
    /// Pieces at the beginning of `job` that bring the machine into the state in which the rest begins.
    pub added: usize,
    /// Pieces of the whole job that are left out before.
    pub skipped: usize,
}

impl Rest {
    /// Puts a line of G-code before all others, with the number of the first.
    pub fn begin_with(&mut self, line: &str) {
        let at = self.job.iter().position(|byte| *byte != b'\n').unwrap_or(self.job.len());
        self.job.splice(at..at, line.bytes().chain([b'\r']));
        self.added += 1;
    }

    /// From pieces of what is sent to pieces of the whole job.
    #[must_use]
    pub fn of_whole(&self, pieces: usize) -> usize {
        self.skipped + pieces.saturating_sub(self.added)
    }
}
