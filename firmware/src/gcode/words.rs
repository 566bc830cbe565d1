//! The words of a line, and the codes among them.

use crate::axis::AXES;
use crate::error::Error;
use crate::gcode::{Distance, FeedMode, Flow, GcodeState, Motion, Plane, Spindle, Units};
use crate::number;

/// What wants the axis words of the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AxisUse {
    Motion,
    /// G92.
    SetOffset,
    /// G10.
    SetSystem,
    /// G28 (0) and G30 (1).
    GoToPlace(usize),
    /// G43.1.
    ToolLength,
}

/// The words of a line, sorted by what they change.
#[derive(Debug, Default)]
pub(super) struct Words {
    /// Bit per letter, A = 0.
    pub(super) present: u32,
    values: [f64; 26],
    /// Bit per modal group that the line has set: G groups 0–15, M groups from 16.
    pub(super) groups: u32,
    pub(super) axis_use: Option<AxisUse>,
    pub(super) dwell: bool,
    /// G53.
    pub(super) absolute: bool,
    pub(super) clear_offset: bool,
    /// G28.1 (0) and G30.1 (1).
    pub(super) keep_place: Option<usize>,
    pub(super) flow: Flow,
}

impl Words {
    pub(super) fn has(&self, letter: u8) -> bool {
        self.present & bit(letter) != 0
    }

    /// The value of `letter` if it is on the line.
    fn get(&self, letter: u8) -> Option<f64> {
        if self.has(letter) { self.values.get(usize::from(letter.wrapping_sub(b'A'))).copied() } else { None }
    }

    /// Like [`Words::get`], and the word counts as used.
    pub(super) fn take(&mut self, letter: u8) -> Option<f64> {
        let value = self.get(letter);
        self.present &= !bit(letter);
        value
    }

    /// Whether the line has any axis word.
    pub(super) fn has_axes(&self) -> bool {
        AXIS_LETTERS.iter().any(|&l| self.has(l))
    }

    fn group(&mut self, group: u32) -> Result<(), Error> {
        let bit = 1 << group;
        if self.groups & bit != 0 {
            return Err(Error::ModalGroupViolation);
        }
        self.groups |= bit;
        Ok(())
    }

    fn wants_axes(&mut self, by: AxisUse) -> Result<(), Error> {
        if self.axis_use.replace(by).is_some() { Err(Error::AxisCommandConflict) } else { Ok(()) }
    }
}

const fn bit(letter: u8) -> u32 {
    1 << (letter.wrapping_sub(b'A') & 31)
}

pub(super) const AXIS_LETTERS: [u8; AXES] = *b"XYZ";
pub(super) const OFFSET_LETTERS: [u8; AXES] = *b"IJK";

/// Splits the line into words and applies the codes to `new`.
pub(super) fn read_words(mut line: &[u8], new: &mut GcodeState) -> Result<Words, Error> {
    let mut words = Words::default();
    while let Some((&letter, rest)) = line.split_first() {
        if !letter.is_ascii_uppercase() {
            return Err(Error::ExpectedCommandLetter);
        }
        let (value, rest) = number::parse(rest).ok_or(Error::BadNumber)?;
        line = rest;
        match letter {
            b'G' => g_code(tenths(value)?, &mut words, new)?,
            b'M' => m_code(tenths(value)?, &mut words, new)?,
            b'F' | b'I' | b'J' | b'K' | b'L' | b'N' | b'P' | b'R' | b'S' | b'T' | b'X' | b'Y' | b'Z' => {
                if words.has(letter) {
                    return Err(Error::WordRepeated);
                }
                if value < 0.0 && matches!(letter, b'F' | b'N' | b'P' | b'S' | b'T') {
                    return Err(Error::NegativeValue);
                }
                words.present |= bit(letter);
                if let Some(slot) = words.values.get_mut(usize::from(letter - b'A')) {
                    *slot = value;
                }
            }
            _ => return Err(Error::UnsupportedCommand),
        }
    }
    Ok(words)
}

/// The number of a code in tenths: G91.1 is 911.
fn tenths(value: f64) -> Result<u32, Error> {
    let tenths = libm::round(value * 10.0);
    // Twice the rounding of the product; a code with a second place differs by tenths.
    if (tenths - value * 10.0).abs() > 1e-9 || !(0.0..10_000.0).contains(&tenths) {
        return Err(Error::UnsupportedCommand);
    }
    Ok(tenths as u32)
}

fn g_code(code: u32, words: &mut Words, new: &mut GcodeState) -> Result<(), Error> {
    match code {
        0 | 10 | 20 | 30 | 800 => {
            if code != 800 {
                words.wants_axes(AxisUse::Motion)?;
            }
            words.group(1)?;
            new.motion = match code {
                0 => Motion::Rapid,
                10 => Motion::Linear,
                20 => Motion::ArcClockwise,
                30 => Motion::ArcCounterClockwise,
                _ => Motion::Cancelled,
            };
        }
        40 => {
            words.group(0)?;
            words.dwell = true;
        }
        530 => {
            words.group(0)?;
            words.absolute = true;
        }
        920 => {
            words.wants_axes(AxisUse::SetOffset)?;
            words.group(0)?;
        }
        921 => {
            words.group(0)?;
            words.clear_offset = true;
        }
        100 => {
            words.wants_axes(AxisUse::SetSystem)?;
            words.group(0)?;
        }
        280 | 300 => {
            words.wants_axes(AxisUse::GoToPlace(usize::from(code == 300)))?;
            words.group(0)?;
        }
        281 | 301 => {
            words.group(0)?;
            words.keep_place = Some(usize::from(code == 301));
        }
        170 | 180 | 190 => {
            words.group(2)?;
            new.plane = match code {
                170 => Plane::Xy,
                180 => Plane::Zx,
                _ => Plane::Yz,
            };
        }
        900 | 910 => {
            words.group(3)?;
            new.distance = if code == 900 { Distance::Absolute } else { Distance::Incremental };
        }
        200 | 210 => {
            words.group(6)?;
            new.units = if code == 200 { Units::Inches } else { Units::Millimetres };
        }
        930 | 940 => {
            words.group(5)?;
            let mode = if code == 930 { FeedMode::InverseTime } else { FeedMode::PerMinute };
            if mode != new.feed_mode {
                (new.feed_mode, new.feed) = (mode, 0.0);
            }
        }
        431 => {
            words.wants_axes(AxisUse::ToolLength)?;
            words.group(8)?;
        }
        490 => {
            words.group(8)?;
            new.tool_length = 0.0;
        }
        540 | 550 | 560 | 570 | 580 | 590 => {
            words.group(12)?;
            new.system = (code as usize - 540) / 10;
        }
        // What every post-processor writes in its header and what is always so here: incremental arc centres, no cutter compensation,
        // exact path.
        911 => words.group(4)?,
        400 => words.group(7)?,
        610 => words.group(13)?,
        _ => return Err(Error::UnsupportedCommand),
    }
    Ok(())
}

fn m_code(code: u32, words: &mut Words, new: &mut GcodeState) -> Result<(), Error> {
    match code {
        0 | 20 | 300 => {
            words.group(20)?;
            words.flow = if code == 0 { Flow::Pause } else { Flow::End };
        }
        30 | 40 | 50 => {
            words.group(23)?;
            new.spindle = match code {
                30 => Spindle::Clockwise,
                40 => Spindle::CounterClockwise,
                _ => Spindle::Off,
            };
        }
        70 | 80 | 90 => {
            words.group(24)?;
            new.mist = code == 70 || (code == 80 && new.mist);
            new.flood = code == 80 || (code == 70 && new.flood);
        }
        _ => return Err(Error::UnsupportedCommand),
    }
    Ok(())
}
