//! Text files, a line at a time.

use std::borrow::Cow;
use std::io::{BufRead, Read};

use super::fault::{Fault, ReadError};

/// Most bytes of a line. No format has numbers enough for more; a file without ends of lines is no text.
const LONGEST_LINE: usize = 1 << 22;

/// The lines of a text file, counted from 1. Only one is held in memory.
pub(super) struct Lines<R> {
    source: R,
    number: usize,
    line: Vec<u8>,
    read: u64,
}

impl<R: BufRead> Lines<R> {
    pub(super) fn new(source: R) -> Self {
        Self { source, number: 0, line: Vec::new(), read: 0 }
    }

    /// Number of the line that was read last.
    pub(super) fn number(&self) -> usize {
        self.number
    }

    /// Bytes read so far.
    pub(super) fn bytes_read(&self) -> u64 {
        self.read
    }

    /// Reads the next line, without its end; no at the end of the file.
    ///
    /// # Errors
    /// If it is too long, or what the system says.
    pub(super) fn advance(&mut self) -> Result<bool, ReadError> {
        self.line.clear();
        let got = self.source.by_ref().take(LONGEST_LINE as u64 + 1).read_until(b'\n', &mut self.line)?;
        if got == 0 {
            return Ok(false);
        }
        self.read += got as u64;
        self.number += 1;
        if got > LONGEST_LINE {
            let problem = format!("is longer than {LONGEST_LINE} bytes; this is no text file of its format");
            return Err(Fault::line(self.number, problem).into());
        }
        Ok(true)
    }

    /// The line that was read last; what is no UTF-8 in it, such as names in other alphabets, is replaced.
    pub(super) fn line(&self) -> Cow<'_, str> {
        String::from_utf8_lossy(&self.line)
    }
}

/// A finite number.
///
/// # Errors
/// What is wrong with the word.
pub(super) fn number(word: &str) -> Result<f64, String> {
    match word.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        Ok(_) => Err(format!("`{}` is not a finite number", shown(word))),
        Err(_) => Err(format!("`{}` is not a number", shown(word))),
    }
}

/// A word for a message: its beginning if it is long, without characters that a terminal acts on.
pub(super) fn shown(word: &str) -> String {
    const LONGEST: usize = 40;
    let mut text: String =
        word.chars().take(LONGEST).map(|c| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c }).collect();
    if word.chars().nth(LONGEST).is_some() {
        text.push('…');
    }
    text
}
