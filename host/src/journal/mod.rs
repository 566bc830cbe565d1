//! What is known of an unfinished plot, on the disk: the job itself, and how much of it is drawn.
//!
//! A journal is there before the first byte goes to the plotter, and is taken away when the plot is done. In between it can be
//! read at every moment, whatever ends the program or the computer. It holds all that is needed to go on: the job byte for
//! byte, so that nothing is drawn from a model that has changed meanwhile, and the plotter's profile as it was.
//!
//! Only what the plotter has *executed* is noted ([`Progress::executed`](crate::protocol::Progress)), which is less than what it
//! has acknowledged: what is in its buffers is lost with its power.

mod file;
mod format;
mod note;

use std::io;
use std::path::PathBuf;

use thiserror::Error;

pub use file::{Journal, now_ms, read};
pub use format::{Contents, FormatError, Head, Record, parse};
pub use note::{Noting, Reached};

/// Extension of journals.
pub const EXTENSION: &str = "journal";

/// Why there is no journal.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum JournalError {
    /// A plot of this name has not come to its end.
    #[error(
        "{path} is the journal of this plot, which has not come to its end; go on with --resume, or begin anew with --restart",
        path = path.display()
    )]
    Unfinished {
        /// The journal.
        path: PathBuf,
    },
    /// It cannot be read.
    #[error("the journal {path} cannot be read: {source}", path = path.display())]
    Read {
        /// The journal.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// It cannot be used.
    #[error("the journal {path} {source}", path = path.display())]
    Format {
        /// The journal.
        path: PathBuf,
        /// Why not.
        source: FormatError,
    },
    /// It cannot be written.
    #[error("the journal {path} cannot be written: {source}", path = path.display())]
    Write {
        /// The journal.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}
