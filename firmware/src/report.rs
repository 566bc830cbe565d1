//! The answers, letter for letter as GRBL writes them.

use core::fmt::{self, Write};

use heapless::{Deque, String};

use crate::axis::{AXES, Axes};
use crate::error::{Alarm, Error};
use crate::gcode::{Distance, FeedMode, GcodeState, Motion, Plane, Spindle, Units};
use crate::number::write_fixed;
use crate::settings::{SETTING_IDS, Settings};
use crate::storage::{SYSTEMS, Stored};

/// Bytes the transmit queue holds.
pub const TX_BYTES: usize = 512;

/// Longest single answer. A line is taken up only when this much room is left, so that no answer is ever cut.
pub(crate) const ANSWER_BYTES: usize = 256;

/// The transmit queue. [`fmt::Write`] on it is all or nothing.
#[derive(Debug, Default)]
pub(crate) struct Transmitter {
    ring: Deque<u8, TX_BYTES>,
}

impl Transmitter {
    pub(crate) fn pop(&mut self) -> Option<u8> {
        self.ring.pop_front()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.ring.is_empty()
    }

    /// Whether any answer fits.
    pub(crate) fn has_room(&self) -> bool {
        TX_BYTES - self.ring.len() >= ANSWER_BYTES
    }

    pub(crate) fn clear(&mut self) {
        self.ring.clear();
    }

    /// Queues what `write` composes, followed by `\r\n`; nothing when it is longer than [`ANSWER_BYTES`] or finds no room, which [`Transmitter::has_room`] rules out for all answers of this module.
    fn line(&mut self, write: impl FnOnce(&mut String<ANSWER_BYTES>) -> fmt::Result) {
        let mut text = String::new();
        if write(&mut text).and_then(|()| text.write_str("\r\n")).is_ok() && TX_BYTES - self.ring.len() >= text.len() {
            self.bytes(text.as_bytes());
        }
    }

    /// Bytes as they are; nothing when there is no room for all of them.
    pub(crate) fn bytes(&mut self, bytes: &[u8]) {
        if TX_BYTES - self.ring.len() >= bytes.len() {
            for &byte in bytes {
                // The room has just been checked.
                let _ = self.ring.push_back(byte);
            }
        }
    }

    /// An answer of HPGL, with the end that was asked for.
    pub(crate) fn reply(&mut self, end: &[u8], write: impl FnOnce(&mut String<ANSWER_BYTES>) -> fmt::Result) {
        let mut text = String::new();
        if write(&mut text).is_ok() && TX_BYTES - self.ring.len() >= text.len() + end.len() {
            self.bytes(text.as_bytes());
            self.bytes(end);
        }
    }

    pub(crate) fn text(&mut self, text: &str) {
        self.line(|out| out.write_str(text));
    }

    pub(crate) fn banner(&mut self) {
        self.text("\r\nGrbl 1.1h ['$' for help]");
    }

    pub(crate) fn answer(&mut self, result: Result<(), Error>) {
        match result {
            Ok(()) => self.text("ok"),
            Err(error) => self.line(|out| write!(out, "error:{}", error.code())),
        }
    }

    pub(crate) fn alarm(&mut self, alarm: Alarm) {
        self.line(|out| write!(out, "ALARM:{}", alarm.code()));
    }

    pub(crate) fn setting(&mut self, id: u16, settings: &Settings) {
        if let Some((value, decimals)) = settings.get(id) {
            self.line(|out| {
                write!(out, "${id}=")?;
                write_fixed(out, value, decimals)
            });
        }
    }

    /// `$G`.
    pub(crate) fn modal(&mut self, state: &GcodeState, settings: &Settings) {
        self.line(|out| {
            let motion = match state.motion {
                Motion::Rapid => "G0",
                Motion::Linear => "G1",
                Motion::ArcClockwise => "G2",
                Motion::ArcCounterClockwise => "G3",
                Motion::Cancelled => "G80",
            };
            let plane = match state.plane {
                Plane::Xy => "G17",
                Plane::Zx => "G18",
                Plane::Yz => "G19",
            };
            let units = if state.units == Units::Inches { "G20" } else { "G21" };
            let distance = if state.distance == Distance::Absolute { "G90" } else { "G91" };
            let spindle = match state.spindle {
                Spindle::Off => "M5",
                Spindle::Clockwise => "M3",
                Spindle::CounterClockwise => "M4",
            };
            let coolant = match (state.mist, state.flood) {
                (false, false) => "M9",
                (true, false) => "M7",
                (false, true) => "M8",
                (true, true) => "M7 M8",
            };
            let feed = if state.feed_mode == FeedMode::InverseTime { "G93" } else { "G94" };
            let system = 54 + state.system;
            write!(
                out,
                "[GC:{motion} G{system} {plane} {units} {distance} {feed} {spindle} {coolant} T{} F",
                state.tool
            )?;
            let (scale, decimals) = if settings.report_inches { (25.4, 1) } else { (1.0, 0) };
            write_fixed(out, state.feed / scale, decimals)?;
            out.write_str(" S")?;
            write_fixed(out, state.speed, 0)?;
            out.write_str("]")
        });
    }

    /// `$I`: `name` is the text of `$I=`.
    pub(crate) fn version(&mut self, name: &[u8], lines: usize, rx: usize) {
        self.line(|out| {
            out.write_str("[VER:1.1h.penvis:")?;
            write_ascii(out, name)?;
            out.write_str("]")
        });
        // V: the pen's level varies; H: single axes home.
        self.line(|out| write!(out, "[OPT:VH,{lines},{rx}]"));
    }

    /// A line of `$N`.
    pub(crate) fn startup_line(&mut self, index: usize, line: &[u8]) {
        self.line(|out| {
            write!(out, "$N{index}=")?;
            write_ascii(out, line)
        });
    }

    /// The answer to a start-up line.
    pub(crate) fn startup(&mut self, line: &[u8], result: Result<(), Error>) {
        self.line(|out| {
            out.write_str(">")?;
            write_ascii(out, line)?;
            match result {
                Ok(()) => out.write_str(":ok"),
                Err(error) => write!(out, ":error:{}", error.code()),
            }
        });
    }

    /// Line `index` of `$#`; false past the last.
    pub(crate) fn parameter(&mut self, index: usize, state: &GcodeState, stored: &Stored) -> bool {
        let settings = &stored.settings;
        let place = |index: usize| stored.places.get(index).copied().unwrap_or_default();
        let (name, values, tail) = match index {
            0..SYSTEMS => (54 + index, stored.systems.get(index).copied().unwrap_or_default(), ""),
            6 => (28, place(0), ""),
            7 => (30, place(1), ""),
            8 => (92, state.offset, ""),
            9 => {
                self.line(|out| {
                    out.write_str("[TLO:")?;
                    write_length(out, state.tool_length, settings)?;
                    out.write_str("]")
                });
                return true;
            }
            // There is no probe.
            10 => (0, [0.0; AXES], ":0"),
            _ => return false,
        };
        self.line(|out| {
            if name == 0 {
                out.write_str("[PRB:")?
            } else {
                write!(out, "[G{name}:")?
            }
            write_position(out, values, settings)?;
            write!(out, "{tail}]")
        });
        true
    }

    /// `?`.
    pub(crate) fn status(&mut self, status: &Status<'_>) {
        self.line(|out| status.write(out));
    }
}

/// The settings of `$$` one by one.
pub(crate) fn setting_id(index: usize) -> Option<u16> {
    SETTING_IDS.get(index).copied()
}

fn write_length(out: &mut impl Write, mm: f64, settings: &Settings) -> fmt::Result {
    let (scale, decimals) = if settings.report_inches { (25.4, 4) } else { (1.0, 3) };
    write_fixed(out, mm / scale, decimals)
}

fn write_position(out: &mut impl Write, mm: [f64; AXES], settings: &Settings) -> fmt::Result {
    for (axis, value) in mm.into_iter().enumerate() {
        if axis > 0 {
            out.write_char(',')?;
        }
        write_length(out, value, settings)?;
    }
    Ok(())
}

/// A line that the line editor let through, which is ASCII.
fn write_ascii(out: &mut impl Write, text: &[u8]) -> fmt::Result {
    text.iter().try_for_each(|&byte| out.write_char(char::from(byte)))
}

/// The part of a status report that tells of overrides.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OverrideReport {
    /// Percentages.
    pub(crate) feed: u8,
    pub(crate) rapid: u8,
    pub(crate) pen: u8,
    pub(crate) spindle: Spindle,
    pub(crate) flood: bool,
    pub(crate) mist: bool,
}

impl OverrideReport {
    fn write(&self, out: &mut impl Write) -> fmt::Result {
        write!(out, "|Ov:{},{},{}", self.feed, self.rapid, self.pen)?;
        let spindle = match self.spindle {
            Spindle::Off => "",
            Spindle::Clockwise => "S",
            Spindle::CounterClockwise => "C",
        };
        let flood = if self.flood { "F" } else { "" };
        let mist = if self.mist { "M" } else { "" };
        if !(spindle.is_empty() && flood.is_empty() && mist.is_empty()) {
            write!(out, "|A:{spindle}{flood}{mist}")?;
        }
        Ok(())
    }
}

/// What a status report tells.
#[derive(Debug)]
pub(crate) struct Status<'a> {
    pub(crate) state: &'a str,
    /// Machine mm.
    pub(crate) position: [f64; AXES],
    pub(crate) offset: [f64; AXES],
    /// Lines that the planner still takes, if they are short: see [`crate::Drawn`].
    pub(crate) lines_free: usize,
    pub(crate) rx_free: usize,
    /// N word of what is being drawn, 0 for none.
    pub(crate) line: u32,
    /// mm/min.
    pub(crate) feed: f64,
    pub(crate) speed: f64,
    /// Limit switches that are closed.
    pub(crate) limits: Axes,
    /// The safety door is open.
    pub(crate) door: bool,
    /// When it is their turn.
    pub(crate) overrides: Option<OverrideReport>,
    /// Whether the work offset is due.
    pub(crate) with_offset: bool,
    pub(crate) settings: &'a Settings,
}

impl Status<'_> {
    fn write(&self, out: &mut impl Write) -> fmt::Result {
        let mask = self.settings.report_mask;
        write!(out, "<{}|", self.state)?;
        let mut position = self.position;
        if mask & 1 == 0 {
            for (p, o) in position.iter_mut().zip(self.offset) {
                *p -= o;
            }
        }
        out.write_str(if mask & 1 == 0 { "WPos:" } else { "MPos:" })?;
        write_position(out, position, self.settings)?;
        if mask & 2 != 0 {
            write!(out, "|Bf:{},{}", self.lines_free, self.rx_free)?;
        }
        if self.line > 0 {
            write!(out, "|Ln:{}", self.line)?;
        }
        out.write_str("|FS:")?;
        let (scale, decimals) = if self.settings.report_inches { (25.4, 1) } else { (1.0, 0) };
        write_fixed(out, self.feed / scale, decimals)?;
        out.write_char(',')?;
        write_fixed(out, self.speed, 0)?;
        if self.door || !self.limits.is_empty() {
            out.write_str("|Pn:")?;
            for (_, letter) in "XYZ".chars().enumerate().filter(|(axis, _)| self.limits.contains(*axis)) {
                out.write_char(letter)?;
            }
            if self.door {
                out.write_char('D')?;
            }
        }
        if self.with_offset {
            out.write_str("|WCO:")?;
            write_position(out, self.offset, self.settings)?;
        } else if let Some(overrides) = self.overrides {
            overrides.write(out)?;
        }
        out.write_char('>')
    }
}
