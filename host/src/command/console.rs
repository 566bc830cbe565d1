//! `penvis console`: type at a plotter, and see what it answers.

use std::io::{self, BufRead, ErrorKind, IsTerminal};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, TryRecvError};
use std::thread;
use std::time::Duration;

use serialport::SerialPort;
use thiserror::Error as ThisError;

use super::plot::{PlotError, open};
use crate::device::{self, Device, Language};
use crate::error::Error;
use crate::interrupt;
use crate::sim::{PeerError, SimName, SimPort};
use crate::stream::{Clock, WallClock};

/// How long one read waits.
const READ_WAIT: Duration = Duration::from_millis(20);
/// A script waits so long for the answer to a line, from the last byte that came on.
const ANSWER_WAIT: Duration = Duration::from_secs(10);
/// After its last line, a script listens for so long after the last byte that came.
const QUIET: Duration = Duration::from_secs(1);
/// Time in which a board that was reset by opening the port runs through its boot loader.
const BANNER_WAIT: Duration = Duration::from_secs(2);
/// Lines that are read ahead.
const AHEAD: usize = 16;
/// Longest line of an answer that is kept together.
const LINE_MAX: usize = 4096;

/// Arguments of `penvis console`.
#[derive(Clone, Debug, clap::Args)]
pub struct ConsoleArgs {
    /// Serial port (`penvis ports`), or a simulated plotter as in `penvis plot`
    #[arg(long, value_name = "PORT")]
    pub port: String,
    /// Plotter (`penvis devices`), which says how lines end [default: grbl-servo, or that of the simulated port]
    #[arg(long, value_name = "NAME")]
    pub device: Option<String>,
    /// Speed of the line [default: the device's]
    #[arg(long, value_name = "BAUD", value_parser = clap::value_parser!(u32).range(1..))]
    pub baud: Option<u32>,
}

/// Why a console has ended.
#[derive(Debug, ThisError)]
#[non_exhaustive]
pub enum ConsoleError {
    /// No such device.
    #[error(transparent)]
    Device(#[from] Error),
    /// No such simulated plotter.
    #[error(transparent)]
    Peer(#[from] PeerError),
    /// The port cannot be opened.
    #[error(transparent)]
    Open(#[from] Box<PlotError>),
    /// The port fails, or is gone.
    #[error("the port {port} is gone: {source}")]
    Port {
        /// The port.
        port: String,
        /// What the system said.
        source: io::Error,
    },
    /// A line that is to be sent cannot be.
    #[error("line {line}: {what}")]
    Line {
        /// Its number.
        line: usize,
        /// What is wrong with it.
        what: String,
    },
    /// Nobody takes the output.
    #[error("cannot write to standard output: {0}")]
    Output(io::Error),
}

/// Sends what is typed, or a script on standard input line by line, and shows what comes back, until Ctrl-C or the end of the
/// input.
///
/// # Errors
/// [`ConsoleError`].
pub fn run(args: &ConsoleArgs) -> Result<(), ConsoleError> {
    let sim = SimName::parse(&args.port).transpose()?;
    let name = args.device.as_deref().unwrap_or_else(|| sim.as_ref().map_or(device::DEFAULT, SimName::default_device));
    let device = device::find(name).map_err(Error::from)?;
    let baud = args.baud.unwrap_or(device.baud);
    interrupt::watch();
    let script = !io::stdin().is_terminal();
    if !script {
        eprintln!(
            "{}; Ctrl-C leaves; ^X is sent as one byte, and so are {}",
            device.description,
            if is_gcode(&device) { "?, ! and ~ on a line of their own" } else { "^[ and other control characters" }
        );
    }
    match sim {
        Some(sim) => {
            let mut port = SimPort::with(sim.peer(&device)?, baud);
            let clock = port.clock();
            Session::new(&mut port, &clock, &device, script, true).talk(args)
        }
        None => {
            let mut port = open(&args.port, baud, &device).map_err(Box::new)?;
            Session::new(port.as_mut(), &WallClock::start(), &device, script, false).talk(args)
        }
    }
}

fn is_gcode(device: &Device) -> bool {
    !matches!(device.language, Language::Hpgl(_))
}

struct Session<'a> {
    port: &'a mut dyn SerialPort,
    clock: &'a dyn Clock,
    device: &'a Device,
    script: bool,
    /// Whether the port has a time of its own, which must not run away from that of who types.
    simulated: bool,
    wall: WallClock,
    heard: Vec<u8>,
    last_heard: Duration,
    /// Whether an answer to what was sent is awaited.
    awaits: bool,
}

impl<'a> Session<'a> {
    fn new(
        port: &'a mut dyn SerialPort,
        clock: &'a dyn Clock,
        device: &'a Device,
        script: bool,
        simulated: bool,
    ) -> Self {
        let (wall, heard) = (WallClock::start(), Vec::new());
        Self { port, clock, device, script, simulated, wall, heard, last_heard: Duration::ZERO, awaits: false }
    }

    fn talk(mut self, args: &ConsoleArgs) -> Result<(), ConsoleError> {
        let gone = |source| ConsoleError::Port { port: args.port.clone(), source };
        self.port.set_timeout(READ_WAIT).map_err(|e| gone(e.into()))?;
        let lines = lines();
        let (mut number, mut ended) = (0, false);
        while !interrupt::is_wanted() {
            let quiet = self.clock.now().saturating_sub(self.last_heard);
            let waits = self.awaits && quiet < ANSWER_WAIT;
            // A board that boots takes no line for one, and a simulated plotter was switched on just now.
            let boots = self.script && (is_gcode(self.device) || self.simulated) && self.clock.now() < BANNER_WAIT;
            if !ended && !(self.script && (waits || boots)) {
                match self.next(&lines) {
                    Ok(line) => {
                        number += 1;
                        let bytes = encode(&line, is_gcode(self.device))
                            .map_err(|what| ConsoleError::Line { line: number, what })?;
                        self.send(&line, &bytes).map_err(gone)?;
                    }
                    Err(TryRecvError::Disconnected) => ended = true,
                    Err(TryRecvError::Empty) => {}
                }
            } else if ended && !waits && quiet >= QUIET {
                break;
            }
            self.hear(&gone)?;
        }
        self.show_rest()
    }

    /// The next line, if there is one. Whoever types at a simulated plotter is waited for while its time is ahead of the wall's.
    fn next(&self, lines: &Receiver<String>) -> Result<String, TryRecvError> {
        let ahead = self.clock.now().saturating_sub(self.wall.now());
        if self.simulated && !self.script && !ahead.is_zero() {
            return lines.recv_timeout(ahead).map_err(|e| match e {
                RecvTimeoutError::Timeout => TryRecvError::Empty,
                RecvTimeoutError::Disconnected => TryRecvError::Disconnected,
            });
        }
        if self.script && self.simulated {
            // Its time stands still while the script is read.
            return lines.recv().map_err(|_| TryRecvError::Disconnected);
        }
        lines.try_recv()
    }

    fn send(&mut self, line: &str, bytes: &[u8]) -> io::Result<()> {
        if self.script {
            self.show('>', line).map_err(io::Error::other)?;
        }
        self.awaits = expects_answer(bytes, is_gcode(self.device));
        self.last_heard = self.clock.now();
        let mut left = bytes;
        while !left.is_empty() && !interrupt::is_wanted() {
            match self.port.write(left) {
                Ok(0) => return Err(ErrorKind::BrokenPipe.into()),
                Ok(count) => left = &left[count..],
                Err(e) if is_wait(&e) && self.clock.now().saturating_sub(self.last_heard) < ANSWER_WAIT => {}
                Err(e) => return Err(e),
            }
        }
        Ok(())
    }

    fn hear(&mut self, gone: &dyn Fn(io::Error) -> ConsoleError) -> Result<(), ConsoleError> {
        let mut buffer = [0; 256];
        match self.port.read(&mut buffer) {
            Ok(0) => Err(gone(ErrorKind::BrokenPipe.into())),
            Ok(count) => {
                self.last_heard = self.clock.now();
                for &byte in &buffer[..count] {
                    match byte {
                        b'\r' | b'\n' => self.show_rest()?,
                        _ if self.heard.len() < LINE_MAX => self.heard.push(byte),
                        _ => {}
                    }
                }
                Ok(())
            }
            Err(e) if is_wait(&e) => Ok(()),
            Err(e) => Err(gone(e)),
        }
    }

    /// Shows the line that has come so far, if there is anything in it.
    fn show_rest(&mut self) -> Result<(), ConsoleError> {
        let line = std::mem::take(&mut self.heard);
        if line.is_empty() {
            return Ok(());
        }
        let line = String::from_utf8_lossy(&line).into_owned();
        self.awaits &= is_gcode(self.device) && !is_answer(&line);
        self.show('<', &line)
    }

    fn show(&self, way: char, line: &str) -> Result<(), ConsoleError> {
        let shown: String = line.chars().flat_map(visible).collect();
        let text = format!("{:9.3} {way} {shown}\n", self.clock.now().as_secs_f64());
        super::print(&text).map_err(ConsoleError::Output)
    }
}

fn is_wait(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

/// A character as a terminal can show it.
fn visible(c: char) -> Vec<char> {
    match c {
        '\u{0}'..='\u{1f}' => vec!['^', (c as u8 + b'@') as char],
        c if c.is_control() => c.escape_default().collect(),
        c => vec![c],
    }
}

/// Lines of standard input, read by a thread, for reading waits.
fn lines() -> Receiver<String> {
    let (give, lines) = mpsc::sync_channel(AHEAD);
    thread::spawn(move || {
        for line in io::stdin().lock().lines() {
            let Ok(line) = line else { return };
            if give.send(line).is_err() {
                return;
            }
        }
    });
    lines
}

/// The bytes of a typed line: `^X` is a control character, `^^` is `^`. G-code lines end in `\n`, but for single characters that
/// GRBL obeys at once; HPGL needs no end.
fn encode(line: &str, gcode: bool) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::with_capacity(line.len() + 1);
    let mut chars = line.trim_end_matches(['\r', '\n']).chars();
    while let Some(c) = chars.next() {
        if c != '^' {
            let mut buffer = [0; 4];
            bytes.extend_from_slice(c.encode_utf8(&mut buffer).as_bytes());
            continue;
        }
        match chars.next().map(|c| c.to_ascii_uppercase()) {
            Some('^') => bytes.push(b'^'),
            Some(c @ '@'..='_') => bytes.push(c as u8 - b'@'),
            _ => return Err("`^` stands before a letter, as in ^X; write ^^ for the character itself".into()),
        }
    }
    let at_once = matches!(bytes[..], [b'?' | b'!' | b'~' | 0..=0x1f]);
    if gcode && !at_once {
        bytes.push(b'\n');
    }
    Ok(bytes)
}

/// Whether something comes back for these bytes.
fn expects_answer(bytes: &[u8], gcode: bool) -> bool {
    if gcode {
        return bytes.ends_with(b"\n") || bytes == b"?";
    }
    // `OA;` and its kin; `ESC.B` and its kin, which are capital letters.
    let output = bytes.windows(2).enumerate().any(|(k, pair)| {
        pair[0].eq_ignore_ascii_case(&b'O') && pair[1].is_ascii_alphabetic() && (k == 0 || bytes[k - 1] == b';')
    });
    output || bytes.windows(3).any(|three| matches!(three, [0x1b, b'.', b'A' | b'B' | b'E' | b'L' | b'O']))
}

/// Whether a line of a G-code controller ends the answer to one of ours.
fn is_answer(line: &str) -> bool {
    let line = line.trim();
    line == "ok"
        || line.starts_with("ok ")
        || line.starts_with('<')
        || line.starts_with("error:")
        || line.starts_with("ALARM:")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_as_the_language_wants() {
        let table: &[(&str, bool, &[u8])] = &[
            ("G0 X1", true, b"G0 X1\n"),
            ("G0 X1\r", true, b"G0 X1\n"),
            ("", true, b"\n"),
            ("?", true, b"?"),
            ("!", true, b"!"),
            ("^X", true, b"\x18"),
            ("^x", true, b"\x18"),
            ("?G0", true, b"?G0\n"),
            ("IN;PU1,1;", false, b"IN;PU1,1;"),
            ("^[.B", false, b"\x1b.B"),
            ("LBa^^b^C", false, b"LBa^b\x03"),
        ];
        for (line, gcode, expected) in table {
            assert_eq!(encode(line, *gcode).as_deref(), Ok(*expected), "{line}");
        }
        assert!(encode("a^1", true).is_err() && encode("a^", false).is_err());
    }

    #[test]
    fn answers_are_expected_where_they_come() {
        let table: &[(&[u8], bool, bool)] = &[
            (b"G0\n", true, true),
            (b"?", true, true),
            (b"!", true, false),
            (b"PU;OA;", false, true),
            (b"oi;", false, true),
            (b"PU;", false, false),
            (b"\x1b.B", false, true),
            (b"\x1b.K", false, false),
        ];
        for (bytes, gcode, expected) in table {
            assert_eq!(expects_answer(bytes, *gcode), *expected, "{:?}", String::from_utf8_lossy(bytes));
        }
        for (line, expected) in
            [("ok", true), ("ok P15 B3", true), ("error:20", true), ("[MSG:x]", false), ("<Idle>", true)]
        {
            assert_eq!(is_answer(line), expected, "{line}");
        }
    }

    #[test]
    fn what_cannot_be_shown_is_spelt() {
        let shown: String = "a\u{1b}[1m\u{7f}é".chars().flat_map(visible).collect();
        assert_eq!(shown, "a^[[1m\\u{7f}é");
    }
}
