//! From bytes to commands: the receive ring, line numbers and checksums, and the few commands that wait their turn.

use std::collections::VecDeque;

/// Bytes of the receive ring.
const RING: usize = 128;
/// Commands that wait.
const SIZE: usize = 4;
/// Bytes of a command, with the one that ends it.
const COMMAND_MAX: usize = 96;

/// What is obeyed when it is read, not when it is its turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Urgent {
    /// `M108`.
    Continue,
    /// `M112`.
    Kill,
    /// `M410`.
    QuickStop,
}

#[derive(Clone, Debug)]
struct Command {
    number: Option<i64>,
    text: String,
}

/// Commands on their way.
#[derive(Debug)]
pub(super) struct Queue {
    pub(super) ring_size: usize,
    pub(super) size: usize,
    /// Whether an `ok` follows a request to send a line again.
    pub(super) resend_ok: bool,
    ring: VecDeque<u8>,
    pub(super) lost: u32,
    line: Vec<u8>,
    comment: bool,
    last: i64,
    commands: VecDeque<Command>,
    /// The line as it arrives, for what is urgent.
    arriving: Vec<u8>,
}

impl Default for Queue {
    fn default() -> Self {
        Self {
            ring_size: RING,
            size: SIZE,
            resend_ok: true,
            ring: VecDeque::new(),
            lost: 0,
            line: Vec::new(),
            comment: false,
            last: 0,
            commands: VecDeque::new(),
            arriving: Vec::new(),
        }
    }
}

impl Queue {
    /// As after a reset.
    pub(super) fn restart(&mut self) {
        self.ring.clear();
        self.line.clear();
        self.arriving.clear();
        self.commands.clear();
        self.comment = false;
        self.last = 0;
    }

    /// A byte arrives.
    pub(super) fn receive(&mut self, byte: u8, deaf: bool) -> Option<Urgent> {
        if deaf {
            self.lost = self.lost.saturating_add(1);
            return None;
        }
        if self.ring.len() < self.ring_size {
            self.ring.push_back(byte);
        } else {
            self.lost = self.lost.saturating_add(1);
        }
        // The emergency parser sees what arrives, whether there is room for it or not.
        if byte != b'\n' && byte != b'\r' {
            if self.arriving.len() < COMMAND_MAX {
                self.arriving.push(byte);
            }
            return None;
        }
        let line = std::mem::take(&mut self.arriving);
        let text = without_number(&line);
        let text = text.split(|byte| *byte == b'*').next().unwrap_or_default().trim_ascii();
        match text {
            b"M108" => Some(Urgent::Continue),
            b"M112" => Some(Urgent::Kill),
            b"M410" => Some(Urgent::QuickStop),
            _ => None,
        }
    }

    /// Commands that there is room for.
    pub(super) fn free(&self) -> usize {
        self.size.saturating_sub(self.commands.len())
    }

    /// The command whose turn it is.
    pub(super) fn front(&self) -> Option<&str> {
        self.commands.front().map(|command| command.text.as_str())
    }

    /// Takes the command that was carried out; its number comes back.
    pub(super) fn pop(&mut self) -> Option<i64> {
        self.commands.pop_front().and_then(|command| command.number)
    }

    /// Reads a byte from the ring, if there is one and room for a command; what is to be said comes back.
    pub(super) fn read(&mut self) -> Option<String> {
        while self.commands.len() < self.size {
            let byte = self.ring.pop_front()?;
            if byte == b'\n' || byte == b'\r' {
                self.comment = false;
                let line = std::mem::take(&mut self.line);
                if let Err(problem) = self.command(&line) {
                    return Some(self.refuse(problem));
                }
                continue;
            }
            self.comment |= byte == b';';
            if !self.comment && self.line.len() + 1 < COMMAND_MAX {
                self.line.push(byte);
            }
        }
        None
    }

    /// Checks a line and lets it wait for its turn.
    fn command(&mut self, line: &[u8]) -> Result<(), &'static str> {
        let line = line.trim_ascii_start();
        if line.is_empty() {
            return Ok(());
        }
        let star = line.iter().rposition(|byte| *byte == b'*');
        let mut number = None;
        if line.first() == Some(&b'N') {
            let text = String::from_utf8_lossy(line);
            // `M110 N5` sets the number, whatever the line's own is.
            let sets = text.find("M110").and_then(|at| text.get(at + 4..));
            let own = match sets.and_then(|rest| rest.find('N').and_then(|at| rest.get(at + 1..))) {
                Some(set) => whole(set),
                None => whole(text.get(1..).unwrap_or_default()),
            };
            if own != self.last + 1 && sets.is_none() {
                return Err("Line Number is not Last Line Number+1");
            }
            let Some(star) = star else { return Err("No Checksum with line number") };
            let sum = line.iter().take(star).fold(0, |sum, byte| sum ^ byte);
            let told = whole(&String::from_utf8_lossy(line.get(star + 1..).unwrap_or_default()));
            if told != i64::from(sum) {
                return Err("checksum mismatch");
            }
            self.last = own;
            number = Some(own);
        }
        let text = without_number(line.get(..star.unwrap_or(line.len())).unwrap_or_default());
        self.commands.push_back(Command { number, text: String::from_utf8_lossy(text).trim().to_owned() });
        Ok(())
    }

    /// Empties the ring and asks for the line again.
    fn refuse(&mut self, problem: &str) -> String {
        self.ring.clear();
        let last = self.last;
        let ok = if self.resend_ok { "ok\n" } else { "" };
        format!("Error:{problem}, Last Line: {last}\nResend: {}\n{ok}", last + 1)
    }
}

/// A line without its number.
fn without_number(line: &[u8]) -> &[u8] {
    let line = line.trim_ascii_start();
    match line.strip_prefix(b"N") {
        Some(rest) => {
            let digits = rest.iter().take_while(|byte| byte.is_ascii_digit() || **byte == b'-').count();
            rest.get(digits..).unwrap_or_default().trim_ascii_start()
        }
        None => line,
    }
}

/// The whole number at the beginning of a text, as C's `strtol` reads it: 0 when there is none.
fn whole(text: &str) -> i64 {
    let text = text.trim_start();
    let end = text.bytes().enumerate().find(|(i, b)| !(b.is_ascii_digit() || (*i == 0 && matches!(b, b'-' | b'+'))));
    text.get(..end.map_or(text.len(), |(i, _)| i)).and_then(|digits| digits.parse().ok()).unwrap_or(0)
}
