//! The answers, letter for letter as GRBL writes them.

use core::fmt::{self, Write};

use heapless::{Deque, String};

use crate::axis::AXES;
use crate::error::{Alarm, Error};
use crate::gcode::{Distance, GcodeState, Motion, Plane, Spindle, Units};
use crate::number::write_fixed;
use crate::settings::{SETTING_IDS, Settings};

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
            for byte in text.bytes() {
                // The room has just been checked.
                let _ = self.ring.push_back(byte);
            }
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
            let coolant = if state.coolant { "M8" } else { "M9" };
            write!(out, "[GC:{motion} G54 {plane} {units} {distance} G94 {spindle} {coolant} T{} F", state.tool)?;
            let (scale, decimals) = if settings.report_inches { (25.4, 1) } else { (1.0, 0) };
            write_fixed(out, state.feed / scale, decimals)?;
            out.write_str(" S")?;
            write_fixed(out, state.speed, 0)?;
            out.write_str("]")
        });
    }

    /// `$I`, first and second line.
    pub(crate) fn version(&mut self, second: bool, blocks: usize, rx: usize) {
        if second {
            self.line(|out| write!(out, "[OPT:V,{blocks},{rx}]"));
        } else {
            self.text("[VER:1.1h.penvis:]");
        }
    }

    /// Line `index` of `$#`; false past the last.
    pub(crate) fn parameter(&mut self, index: usize, state: &GcodeState, settings: &Settings) -> bool {
        let zero = [0.0; AXES];
        let (name, values, tail) = match index {
            0 => ("G54", zero, ""),
            1 => ("G92", state.offset, ""),
            2 => {
                self.text("[TLO:0.000]");
                return true;
            }
            3 => ("PRB", zero, ":0"),
            _ => return false,
        };
        self.line(|out| {
            write!(out, "[{name}:")?;
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

fn write_position(out: &mut impl Write, mm: [f64; AXES], settings: &Settings) -> fmt::Result {
    let (scale, decimals) = if settings.report_inches { (25.4, 4) } else { (1.0, 3) };
    for (axis, value) in mm.into_iter().enumerate() {
        if axis > 0 {
            out.write_char(',')?;
        }
        write_fixed(out, value / scale, decimals)?;
    }
    Ok(())
}

/// What a status report tells.
#[derive(Debug)]
pub(crate) struct Status<'a> {
    pub(crate) state: &'a str,
    /// Machine mm.
    pub(crate) position: [f64; AXES],
    pub(crate) offset: [f64; AXES],
    pub(crate) blocks_free: usize,
    pub(crate) rx_free: usize,
    /// N word of the block in execution, 0 for none.
    pub(crate) line: u32,
    /// mm/min.
    pub(crate) feed: f64,
    pub(crate) speed: f64,
    /// Feed, rapid: when it is their turn.
    pub(crate) overrides: Option<(u8, u8)>,
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
            write!(out, "|Bf:{},{}", self.blocks_free, self.rx_free)?;
        }
        if self.line > 0 {
            write!(out, "|Ln:{}", self.line)?;
        }
        out.write_str("|FS:")?;
        let (scale, decimals) = if self.settings.report_inches { (25.4, 1) } else { (1.0, 0) };
        write_fixed(out, self.feed / scale, decimals)?;
        out.write_char(',')?;
        write_fixed(out, self.speed, 0)?;
        if self.with_offset {
            out.write_str("|WCO:")?;
            write_position(out, self.offset, self.settings)?;
        } else if let Some((feed, rapid)) = self.overrides {
            write!(out, "|Ov:{feed},{rapid},100")?;
        }
        out.write_char('>')
    }
}
