//! A G-code job as it goes over the line: checked as a whole before the first byte is sent.

use std::time::Duration;

use thiserror::Error;

/// A line of the job.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    /// Its number in the file, from 1.
    pub number: usize,
    /// What is sent, without the line end.
    pub text: String,
    /// How it goes among the others.
    pub turn: Turn,
}

/// How a line goes among the others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Turn {
    /// While others are on the way.
    Streamed,
    /// By itself, for the controller may write its EEPROM and then loses what arrives.
    Alone,
    /// By itself and at rest: `$` commands are refused in motion.
    AtRest,
    /// By itself; the controller then waits (M0), with this comment for its user.
    Pause(String),
}

/// A job that may be sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Job {
    lines: Vec<Line>,
    longest_dwell: Duration,
}

/// A job that must not be sent.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum JobError {
    /// The controller would cut it off.
    #[error("line {line} has {length} characters, and the plotter takes {limit}: write it in shorter lines")]
    TooLong {
        /// Number of the line.
        line: usize,
        /// Characters that would be sent.
        length: usize,
        /// Most characters.
        limit: usize,
    },
    /// A character that acts at once, wherever it stands.
    #[error("line {line} holds `{character}`, which a GRBL plotter obeys the moment it arrives; take it out")]
    RealTime {
        /// Number of the line.
        line: usize,
        /// The character.
        character: char,
    },
    /// Nothing to send.
    #[error("there is no G-code in it: comments and blank lines only")]
    Empty,
}

impl Job {
    /// Cleans and checks G-code: comments (`(…)`, `;…`), blanks, `%`, and what is not printable ASCII are left out, and lines in
    /// which nothing is left are not sent. `limit` is the most characters in a line. Lines may end in `\n`, `\r\n` or `\r`.
    ///
    /// # Errors
    /// [`JobError`], with the first line at fault.
    pub fn new(gcode: &str, limit: usize) -> Result<Self, JobError> {
        let mut lines = Vec::new();
        let mut longest_dwell = 0.0_f64;
        for (number, raw) in split_lines(gcode) {
            let (text, comment) = clean(raw);
            if text.is_empty() {
                continue;
            }
            if let Some(character) = text.chars().find(|c| matches!(c, '?' | '!' | '~')) {
                return Err(JobError::RealTime { line: number, character });
            }
            if text.len() > limit {
                return Err(JobError::TooLong { line: number, length: text.len(), limit });
            }
            if let Some(seconds) = dwell(&text) {
                longest_dwell = longest_dwell.max(seconds);
            }
            let turn = turn(&text, comment);
            lines.push(Line { number, text, turn });
        }
        if lines.is_empty() {
            return Err(JobError::Empty);
        }
        // Days are enough for any dwell, and keep sums of durations far from overflow.
        let longest_dwell = Duration::from_secs_f64(longest_dwell.clamp(0.0, 1e6));
        Ok(Self { lines, longest_dwell })
    }

    /// The lines to be sent; at least one.
    #[must_use]
    pub fn lines(&self) -> &[Line] {
        &self.lines
    }

    /// The longest `G4` in it.
    #[must_use]
    pub fn longest_dwell(&self) -> Duration {
        self.longest_dwell
    }
}

/// Lines with their numbers, whatever they end in.
fn split_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.split('\n')
        .enumerate()
        .flat_map(|(i, line)| line.strip_suffix('\r').unwrap_or(line).split('\r').map(move |piece| (i + 1, piece)))
}

/// What is to be sent of a line, and its comment.
pub(crate) fn clean(raw: &str) -> (String, String) {
    let system = raw.trim_start().starts_with('$');
    let (mut text, mut comment) = (String::new(), String::new());
    // `$` lines hold no comments: what looks like one may be part of a value.
    let mut in_comment = false;
    let mut chars = raw.chars();
    while let Some(c) = chars.next() {
        match c {
            ')' if in_comment => in_comment = false,
            _ if in_comment => comment.push(c),
            '(' if !system => in_comment = true,
            ';' if !system => comment.extend(chars.by_ref()),
            '%' if !system => {}
            ' ' if system && !text.is_empty() => text.push(c),
            c if c.is_ascii_graphic() => text.push(if system { c } else { c.to_ascii_uppercase() }),
            _ => {}
        }
    }
    text.truncate(text.trim_end().len());
    comment.retain(|c| !c.is_control());
    (text, comment.trim().to_owned())
}

/// The words of a cleaned line: letter and value, which is no number where the line has none.
pub(crate) fn words(text: &str) -> impl Iterator<Item = (char, f64)> {
    text.char_indices().filter(|(_, c)| c.is_ascii_alphabetic()).map(|(i, c)| {
        let rest = &text[i + 1..];
        let end = rest.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(rest.len());
        (c, rest[..end].parse().unwrap_or(f64::NAN))
    })
}

fn turn(text: &str, comment: String) -> Turn {
    if text.starts_with('$') {
        return Turn::AtRest;
    }
    let has = |letter: char, value: f64| words(text).any(|word| word == (letter, value));
    if has('M', 0.0) {
        return Turn::Pause(comment);
    }
    let stores_offsets = has('G', 10.0) && (has('L', 2.0) || has('L', 20.0));
    if stores_offsets || has('G', 28.1) || has('G', 30.1) { Turn::Alone } else { Turn::Streamed }
}

/// A cleaned line without its pause.
pub(crate) fn without_pause(text: &str) -> String {
    let mut rest = String::new();
    let mut letters = text.char_indices().filter(|(_, c)| c.is_ascii_alphabetic()).map(|(at, _)| at).peekable();
    while let Some(at) = letters.next() {
        let word = text.get(at..letters.peek().copied().unwrap_or(text.len())).unwrap_or_default();
        let number = word.strip_prefix('M').and_then(|number| number.parse::<f64>().ok());
        if number != Some(0.0) {
            rest.push_str(word);
        }
    }
    rest
}

/// Seconds of a `G4`.
fn dwell(text: &str) -> Option<f64> {
    if !words(text).any(|word| word == ('G', 4.0)) {
        return None;
    }
    words(text).find(|(letter, seconds)| *letter == 'P' && seconds.is_finite()).map(|(_, seconds)| seconds)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(gcode: &str) -> Vec<(usize, String)> {
        Job::new(gcode, 79).unwrap().lines().iter().map(|line| (line.number, line.text.clone())).collect()
    }

    #[test]
    fn lines_are_cleaned_and_keep_their_numbers() {
        let table: &[(&str, &[(usize, &str)])] = &[
            ("G1 X1\nG1 X2\n", &[(1, "G1X1"), (2, "G1X2")]),
            ("G1 X1\r\nG1 X2\r\n", &[(1, "G1X1"), (2, "G1X2")]),
            ("G1 X1\r\rG1 X2", &[(1, "G1X1"), (1, "G1X2")]),
            ("%\n(head)\n\n  \ng1 x1 (a!) y2 ; b?~\n%", &[(5, "G1X1Y2")]),
            ("G1 (never closed X1\nG0", &[(1, "G1"), (2, "G0")]),
            ("\u{feff}G1\u{0}\u{18} X1\u{85}µ", &[(1, "G1X1")]),
            ("$N0=G20 G54\n$H", &[(1, "$N0=G20 G54"), (2, "$H")]),
        ];
        for (gcode, expected) in table {
            let expected: Vec<_> = expected.iter().map(|(n, t)| (*n, (*t).to_owned())).collect();
            assert_eq!(texts(gcode), expected, "{gcode:?}");
        }
    }

    #[test]
    fn jobs_that_must_not_be_sent_are_refused_with_the_line() {
        let long = format!("G0\n(c)\nG1X{}", "1".repeat(77));
        let table = [
            ("", JobError::Empty),
            ("(only)\n;comments\n", JobError::Empty),
            (&long, JobError::TooLong { line: 3, length: 80, limit: 79 }),
            ("G1\nG1!X1", JobError::RealTime { line: 2, character: '!' }),
        ];
        for (gcode, expected) in table {
            assert_eq!(Job::new(gcode, 79).unwrap_err(), expected);
        }
        assert!(Job::new(&format!("G1 X{} (comment)", "1".repeat(76)), 79).is_ok());
    }

    #[test]
    fn turns() {
        let table = [
            ("G1X1Y2", Turn::Streamed),
            ("G10L2P1X0", Turn::Alone),
            ("G10 L20 P1 X0", Turn::Alone),
            ("G10L3", Turn::Streamed),
            ("G28.1", Turn::Alone),
            ("G30.1", Turn::Alone),
            ("G28", Turn::Streamed),
            ("$X", Turn::AtRest),
            ("$100=80", Turn::AtRest),
            ("M0 (take pen 2)", Turn::Pause("take pen 2".into())),
            ("M00", Turn::Pause(String::new())),
            ("M3S0", Turn::Streamed),
        ];
        for (gcode, expected) in table {
            assert_eq!(Job::new(gcode, 79).unwrap().lines()[0].turn, expected, "{gcode}");
        }
    }

    #[test]
    fn a_pause_is_taken_out_of_its_line() {
        for (text, expected) in [("M0", ""), ("M00", ""), ("T2M0", "T2"), ("M0S5M3", "S5M3"), ("M06T1", "M06T1")] {
            assert_eq!(without_pause(text), expected);
        }
    }

    #[test]
    fn the_longest_dwell_is_found() {
        assert_eq!(Job::new("G4P0.5\nG4 P2\nG1P9", 79).unwrap().longest_dwell(), Duration::from_secs(2));
        assert_eq!(Job::new("G4P-1\nG4P\nG4", 79).unwrap().longest_dwell(), Duration::ZERO);
    }
}
