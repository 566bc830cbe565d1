//! The receive ring and the line editor.

use heapless::{Deque, Vec};

use crate::error::Error;
use crate::hpgl::HPGL_BYTES;

/// Bytes the receive ring holds for G-code; the sum that a character-counting sender may have in flight.
pub const RX_BYTES: usize = 128;

/// Characters a line may hold after stripping.
pub const LINE_CHARS: usize = 79;

/// The receive ring: a byte that does not fit is lost without a word, as on the real board, but counted.
#[derive(Debug)]
pub(crate) struct Receiver {
    ring: Deque<u8, HPGL_BYTES>,
    /// Bytes that it takes, by the language.
    limit: usize,
    lost: u32,
}

impl Default for Receiver {
    fn default() -> Self {
        Self { ring: Deque::new(), limit: RX_BYTES, lost: 0 }
    }
}

impl Receiver {
    /// Has it take so many bytes from now on.
    pub(crate) fn set_limit(&mut self, limit: usize) {
        self.limit = limit.min(HPGL_BYTES);
    }

    /// Takes a byte; false when it is lost.
    pub(crate) fn push(&mut self, byte: u8) -> bool {
        let taken = self.free() > 0 && self.ring.push_back(byte).is_ok();
        if !taken {
            self.lost = self.lost.saturating_add(1);
        }
        taken
    }

    pub(crate) fn pop(&mut self) -> Option<u8> {
        self.ring.pop_front()
    }

    pub(crate) fn free(&self) -> usize {
        self.limit.saturating_sub(self.ring.len())
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.ring.is_empty()
    }

    pub(crate) fn len(&self) -> usize {
        self.ring.len()
    }

    pub(crate) fn lost(&self) -> u32 {
        self.lost
    }

    pub(crate) fn clear(&mut self) {
        self.ring.clear();
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Comment {
    #[default]
    None,
    /// `( … )`; also ends with the line.
    Parentheses,
    /// `; …` to the end of the line.
    Semicolon,
}

/// Strips blanks, control characters, comments and `/` (block delete), and turns letters to upper case.
///
/// `\r` and `\n` each end a line, so `\r\n` gives a line and a blank line, and each of them earns an answer.
#[derive(Debug, Default)]
pub(crate) struct LineEditor {
    text: Vec<u8, LINE_CHARS>,
    comment: Comment,
    overflow: bool,
}

impl LineEditor {
    /// Takes one byte; true when it ended a line, which [`LineEditor::line`] then gives until [`LineEditor::clear`].
    pub(crate) fn push(&mut self, byte: u8) -> bool {
        match (byte, self.comment) {
            (b'\r' | b'\n', _) => return true,
            (b')', Comment::Parentheses) => self.comment = Comment::None,
            (_, Comment::Parentheses | Comment::Semicolon) => {}
            (b'(', _) => self.comment = Comment::Parentheses,
            (b';', _) => self.comment = Comment::Semicolon,
            (b'/' | 0..=b' ' | 0x7f.., _) => {}
            (byte, _) => self.overflow |= self.text.push(byte.to_ascii_uppercase()).is_err(),
        }
        false
    }

    /// The stripped line, or [`Error::LineOverflow`].
    pub(crate) fn line(&self) -> Result<&[u8], Error> {
        if self.overflow { Err(Error::LineOverflow) } else { Ok(&self.text) }
    }

    /// Characters of the line so far.
    pub(crate) fn len(&self) -> usize {
        self.text.len()
    }

    /// Whether the line so far is nothing, not even a comment.
    pub(crate) fn is_empty(&self) -> bool {
        self.text.is_empty() && self.comment == Comment::None && !self.overflow
    }

    pub(crate) fn clear(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each stripped line, or the error number as text.
    fn lines(input: &[u8]) -> std::vec::Vec<std::string::String> {
        let mut editor = LineEditor::default();
        let mut out = std::vec::Vec::new();
        for &b in input {
            if editor.push(b) {
                out.push(match editor.line() {
                    Ok(l) => std::string::String::from_utf8(l.to_vec()).unwrap(),
                    Err(e) => std::format!("error:{}", e.code()),
                });
                editor.clear();
            }
        }
        out
    }

    #[test]
    fn strips() {
        for (input, expect) in [
            ("g1 x 1.5\ty-2\n", &["G1X1.5Y-2"][..]),
            ("g0\r\n", &["G0", ""]),
            ("\n\r", &["", ""]),
            ("(a comment)\n", &[""]),
            ("g1 (inner ; not yet) x1\n", &["G1X1"]),
            ("g1 x1 ; rest (of it\ny2\n", &["G1X1", "Y2"]),
            ("g1 (never closed\ny2\n", &["G1", "Y2"]),
            ("/g0 x1\n", &["G0X1"]),
            ("g0)x1\n", &["G0)X1"]),
            ("no end", &[]),
        ] {
            assert_eq!(lines(input.as_bytes()), expect, "{input:?}");
        }
    }

    #[test]
    fn overflows_past_79_after_stripping() {
        let mut line = std::vec![b'1'; 79];
        line.extend_from_slice(b"   (comments do not count)  \n");
        assert_eq!(lines(&line)[0].len(), 79);
        line.insert(0, b'1');
        line.extend_from_slice(b"G0\n");
        assert_eq!(lines(&line), ["error:11", "G0"]);
    }

    #[test]
    fn ring_holds_128_and_counts_losses() {
        let mut rx = Receiver::default();
        for i in 0..130u8 {
            rx.push(i);
        }
        assert_eq!((rx.free(), rx.lost()), (0, 2));
        assert_eq!((0..128).map(|_| rx.pop().unwrap()).last(), Some(127));
        assert!(rx.is_empty());
    }
}
