//! What is wrong with a model file, and where.

use std::fmt;

use crate::message::one_line;

/// What is wrong with a model file, and where in it. It is told in one line, whatever the file's own words in it are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Where: a line, an entity, a surface and its field; empty when it is the whole of the file.
    pub place: String,
    /// What is wrong and what to do.
    pub problem: String,
}

impl Fault {
    /// A fault at a place.
    pub fn at(place: impl Into<String>, problem: impl Into<String>) -> Self {
        Self { place: place.into(), problem: problem.into() }
    }

    /// A fault in a line of a text file, counted from 1.
    pub fn line(number: usize, problem: impl Into<String>) -> Self {
        Self::at(format!("line {number}"), problem)
    }

    /// A fault of the whole file.
    pub fn whole(problem: impl Into<String>) -> Self {
        Self::at("", problem)
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.place.is_empty() {
            write!(f, "{}: ", one_line(&self.place))?;
        }
        f.write_str(&one_line(&self.problem))
    }
}

impl std::error::Error for Fault {}

/// Why there is no model from a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The contents are wrong.
    #[error(transparent)]
    Fault(#[from] Fault),
    /// The system does not let it be read.
    #[error("cannot be read: {0}")]
    Io(#[from] std::io::Error),
    /// It is too much for a model.
    #[error("is larger than {} MiB, too large for a file of this format; check the path", limit >> 20)]
    TooLarge {
        /// Most bytes that are read.
        limit: u64,
    },
    /// It was asked to stop.
    #[error("reading was stopped")]
    Stopped,
}
