//! The words of a data tree, and its blocks.

use std::io::BufRead;

use crate::model::fault::{Fault, ReadError};
use crate::model::import::Reading;
use crate::model::mesh::PROGRESS_STEP;
use crate::model::text::{Lines, shown};

/// Most blocks in one another. Groups of groups of parts are a few deep; what is deeper than this is no model.
pub(super) const DEEPEST: usize = 256;

/// What a token is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// `[`.
    Open,
    /// `]`.
    Close,
    /// A word or a number.
    Word,
    /// A string in quotation marks.
    Text,
    /// The end of the file, outside of all blocks.
    End,
}

/// Takes a file apart. Only a line of it is in memory.
pub(super) struct Tokens<'a, R> {
    lines: Lines<R>,
    line: String,
    /// Where in the line the next token is looked for.
    at: usize,
    /// Where in the line the token is that was read last.
    token: std::ops::Range<usize>,
    /// The lines on which the open blocks begin.
    open: Vec<usize>,
    reading: &'a Reading<'a>,
    /// Length of the file.
    total: u64,
}

impl<'a, R: BufRead> Tokens<'a, R> {
    pub(super) fn new(source: R, total: u64, reading: &'a Reading<'a>) -> Self {
        Self { lines: Lines::new(source), line: String::new(), at: 0, token: 0..0, open: Vec::new(), reading, total }
    }

    /// The line that is being read.
    pub(super) fn line(&self) -> usize {
        self.lines.number()
    }

    /// The token that was read last; of a string, what is between the quotation marks.
    pub(super) fn text(&self) -> &str {
        &self.line[self.token.clone()]
    }

    /// Number of the blocks that are open.
    pub(super) fn depth(&self) -> usize {
        self.open.len()
    }

    /// A fault in the line that is being read.
    pub(super) fn fault(&self, problem: impl Into<String>) -> ReadError {
        Fault::line(self.line(), problem).into()
    }

    /// A fault: there is something else than what was expected.
    pub(super) fn unexpected(&self, kind: Kind, expected: &str) -> ReadError {
        match kind {
            Kind::End => self.fault(format!("ends the file where {expected} is expected")),
            _ => self.fault(format!("has `{}` where {expected} is expected", shown(self.text()))),
        }
    }

    /// Reads the next token.
    ///
    /// # Errors
    /// If a block does not end or was not begun, blocks are in one another too deep, or what the system says.
    pub(super) fn next(&mut self) -> Result<Kind, ReadError> {
        let Some(first) = self.find(|c| !c.is_ascii_whitespace())? else { return Ok(Kind::End) };
        let start = self.at;
        let rest = &self.line[start..];
        let (kind, token) = match first {
            '[' | ']' => return self.bracket(first),
            '"' => match rest[1..].find('"') {
                Some(length) => (Kind::Text, start + 1..start + 1 + length),
                None => return Err(self.fault("begins a string that does not end on its line")),
            },
            _ => {
                let ends = |c: char| c.is_ascii_whitespace() || matches!(c, '[' | ']' | '"');
                (Kind::Word, start..start + rest.find(ends).unwrap_or(rest.len()))
            }
        };
        self.at = token.end + usize::from(kind == Kind::Text);
        self.token = token;
        Ok(kind)
    }

    /// Leaves out a comment, which is anything without brackets, and reads the bracket that ends it.
    ///
    /// # Errors
    /// As [`next`](Self::next).
    pub(super) fn after_comment(&mut self) -> Result<Kind, ReadError> {
        match self.find(|c| matches!(c, '[' | ']'))? {
            Some(bracket) => self.bracket(bracket),
            None => Ok(Kind::End),
        }
    }

    /// Leaves out attributes, which are blocks, and reads what follows them.
    ///
    /// # Errors
    /// As [`next`](Self::next).
    pub(super) fn after_attributes(&mut self) -> Result<Kind, ReadError> {
        loop {
            match self.next()? {
                Kind::Open => self.leave()?,
                kind => return Ok(kind),
            }
        }
    }

    /// Leaves out the rest of the block that was opened last.
    ///
    /// # Errors
    /// As [`next`](Self::next).
    pub(super) fn leave(&mut self) -> Result<(), ReadError> {
        self.leave_to(self.depth().saturating_sub(1))
    }

    /// Leaves out what there is until so many blocks are open.
    ///
    /// # Errors
    /// As [`next`](Self::next).
    pub(super) fn leave_to(&mut self, depth: usize) -> Result<(), ReadError> {
        while self.depth() > depth {
            self.next()?;
        }
        Ok(())
    }

    /// Goes to the first character of a kind, from where the last token ended; none at the end of the file.
    fn find(&mut self, is: impl Fn(char) -> bool) -> Result<Option<char>, ReadError> {
        loop {
            let rest = &self.line[self.at..];
            if let Some((offset, c)) = rest.char_indices().find(|&(_, c)| is(c)) {
                self.at += offset;
                return Ok(Some(c));
            }
            if !self.lines.advance()? {
                self.token = 0..0;
                self.at = self.line.len();
                return match self.open.last() {
                    Some(begun) => Err(self.fault(format!(
                        "is the last, but the block that begins on line {begun} has no `]`; the file is cut off, so get it anew"
                    ))),
                    None => Ok(None),
                };
            }
            self.line.clear();
            self.line.push_str(&self.lines.line());
            self.at = 0;
            if self.lines.number().is_multiple_of(PROGRESS_STEP) {
                self.reading.progress((self.lines.bytes_read() >> 10) as usize, (self.total >> 10) as usize)?;
            }
        }
    }

    /// Reads the bracket that is there.
    fn bracket(&mut self, bracket: char) -> Result<Kind, ReadError> {
        self.token = self.at..self.at + 1;
        self.at += 1;
        if bracket == '[' {
            if self.open.len() == DEEPEST {
                return Err(self.fault(format!("opens a block within {DEEPEST} others; no model is nested so deep")));
            }
            self.open.push(self.line());
            return Ok(Kind::Open);
        }
        match self.open.pop() {
            Some(_) => Ok(Kind::Close),
            None => Err(self.fault("has `]`, but no block is open")),
        }
    }
}
