//! One line of G-code: words, checks, and the actions it asks for.

use crate::axis::AXES;
use crate::error::Error;
use crate::gcode::arc::Centre;
use crate::gcode::{Arc, Distance, GcodeState, Motion, Plane, Spindle, Units};
use crate::number;
use crate::pen::Pen;
use crate::settings::Settings;

/// Largest N word.
const MAX_LINE_NUMBER: f64 = 10_000_000.0;

/// Largest distance of a target from the origin in steps, so that the difference of two targets fits i32.
const MAX_STEPS: f64 = 1_073_741_823.0;

/// How fast a motion is meant to go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Speed {
    /// As fast as the axes allow.
    Rapid,
    /// mm/min along the path.
    Feed(f64),
}

/// The motion of a line, in machine mm.
#[derive(Clone, Debug)]
pub(crate) enum Path {
    /// A straight line.
    Line { target: [f64; AXES], speed: Speed },
    /// An arc or helix.
    Arc(Arc),
}

/// M0, M2 and M30.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Flow {
    /// Go on.
    #[default]
    Run,
    /// M0: stop until `~`.
    Pause,
    /// M0 has stopped.
    Paused,
    /// M2, M30.
    End,
}

/// What a good line asks for, in the order in which it is done.
#[derive(Clone, Debug, Default)]
pub(crate) struct Actions {
    pub(crate) pen: Option<Pen>,
    /// Seconds.
    pub(crate) dwell: Option<f64>,
    pub(crate) motion: Option<Path>,
    pub(crate) flow: Flow,
}

/// What wants the axis words of the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum AxisUse {
    Motion,
    /// G92.
    SetOffset,
}

/// The words of a line, sorted by what they change.
#[derive(Debug, Default)]
struct Words {
    /// Bit per letter, A = 0.
    present: u32,
    values: [f64; 26],
    /// Bit per modal group that the line has set: G groups 0–15, M groups from 16.
    groups: u32,
    axis_use: Option<AxisUse>,
    dwell: bool,
    absolute: bool,
    clear_offset: bool,
    flow: Flow,
}

impl Words {
    fn has(&self, letter: u8) -> bool {
        self.present & bit(letter) != 0
    }

    /// The value of `letter` if it is on the line.
    fn get(&self, letter: u8) -> Option<f64> {
        if self.has(letter) { self.values.get(usize::from(letter.wrapping_sub(b'A'))).copied() } else { None }
    }

    /// Like [`Words::get`], and the word counts as used.
    fn take(&mut self, letter: u8) -> Option<f64> {
        let value = self.get(letter);
        self.present &= !bit(letter);
        value
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

const AXIS_LETTERS: [u8; AXES] = *b"XYZ";
const OFFSET_LETTERS: [u8; AXES] = *b"IJK";

/// Interprets one stripped line.
///
/// Returns the state after it and what is to be done. Cost: linear in the length of the line; the arc alone needs transcendental functions.
///
/// # Errors
/// GRBL's number for the first thing wrong, in GRBL's order: the words one by one, then the line as a whole.
pub(crate) fn interpret(line: &[u8], state: &GcodeState, settings: &Settings) -> Result<(GcodeState, Actions), Error> {
    let mut new = state.clone();
    let mut words = read_words(line, &mut new)?;

    if let Some(n) = words.take(b'N') {
        if n > MAX_LINE_NUMBER {
            return Err(Error::InvalidLineNumber);
        }
        if n != libm::floor(n) {
            return Err(Error::NotInteger);
        }
        new.line = n as u32;
    }
    if let Some(f) = words.take(b'F') {
        new.feed = f * new.units.mm();
    }
    if let Some(s) = words.take(b'S') {
        new.speed = s;
    }
    if let Some(t) = words.take(b'T') {
        if t > 255.0 {
            return Err(Error::ToolNumberTooLarge);
        }
        if t != libm::floor(t) {
            return Err(Error::NotInteger);
        }
        new.tool = t as u8;
    }

    let mut actions = Actions { flow: words.flow, ..Actions::default() };
    if words.dwell {
        actions.dwell = Some(words.take(b'P').ok_or(Error::ValueWordMissing)?);
    }

    let any_axis = AXIS_LETTERS.iter().any(|&l| words.has(l));
    if any_axis && words.axis_use.is_none() {
        words.axis_use = Some(AxisUse::Motion);
    }
    if words.absolute && !matches!(new.motion, Motion::Rapid | Motion::Linear) {
        return Err(Error::G53NeedsRapidOrLinear);
    }
    match words.axis_use {
        Some(AxisUse::SetOffset) => {
            if !any_axis {
                return Err(Error::NoAxisWords);
            }
            for (axis, &letter) in AXIS_LETTERS.iter().enumerate() {
                if let Some(value) = words.take(letter) {
                    new.offset[axis] = state.position[axis] - value * new.units.mm();
                }
            }
        }
        Some(AxisUse::Motion) => actions.motion = motion(&mut words, &mut new, settings)?,
        None => {}
    }
    if words.clear_offset {
        new.offset = [0.0; AXES];
    }
    if words.present != 0 {
        return Err(Error::UnusedWords);
    }

    let pen = |s: &GcodeState| if s.spindle == Spindle::Off { Pen::Off } else { Pen::from_speed(s.speed, settings) };
    if pen(&new) != pen(state) {
        actions.pen = Some(pen(&new));
    }
    Ok((new, actions))
}

/// Interprets what follows `$J=`: a straight motion at its own feed, after which only the position differs.
///
/// # Errors
/// [`Error::InvalidJog`] for anything but F, N, axis words, G20, G21, G53, G90 and G91; [`Error::UndefinedFeedRate`] and [`Error::NoAxisWords`] when those are missing;
/// [`Error::TravelExceeded`] beyond the soft limits.
pub(crate) fn interpret_jog(
    line: &[u8],
    state: &GcodeState,
    settings: &Settings,
) -> Result<(GcodeState, Actions), Error> {
    let mut scratch = GcodeState { motion: Motion::Linear, ..state.clone() };
    let mut words = read_words(line, &mut scratch)?;
    // Groups 3 and 6, and of group 0 only G53.
    let allowed = 1 << 3 | 1 << 6 | u32::from(words.absolute);
    if words.groups & !allowed != 0 || words.axis_use.is_some() {
        return Err(Error::InvalidJog);
    }
    words.take(b'N');
    scratch.feed = words.take(b'F').unwrap_or(0.0) * scratch.units.mm();
    let path = motion(&mut words, &mut scratch, settings)?.ok_or(Error::NoAxisWords)?;
    if words.present != 0 {
        return Err(Error::InvalidJog);
    }
    if !settings.in_travel(scratch.position) {
        return Err(Error::TravelExceeded);
    }
    let new = GcodeState { position: scratch.position, ..state.clone() };
    Ok((new, Actions { motion: Some(path), ..Actions::default() }))
}

/// Splits the line into words and applies the codes to `new`.
fn read_words(mut line: &[u8], new: &mut GcodeState) -> Result<Words, Error> {
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
        // What every post-processor writes in its header and what is always so here: incremental arc centres, units per minute,
        // no cutter compensation, no tool length, the one coordinate system, exact path.
        911 => words.group(4)?,
        940 => words.group(5)?,
        400 => words.group(7)?,
        490 => words.group(8)?,
        540 => words.group(12)?,
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
        80 | 90 => {
            words.group(24)?;
            new.coolant = code == 80;
        }
        _ => return Err(Error::UnsupportedCommand),
    }
    Ok(())
}

/// The motion of the line, if it has axis words; the state's position moves to its end.
fn motion(words: &mut Words, new: &mut GcodeState, settings: &Settings) -> Result<Option<Path>, Error> {
    let any_axis = AXIS_LETTERS.iter().any(|&l| words.has(l));
    let speed = match new.motion {
        Motion::Cancelled => return Err(Error::AxisWordsUnused),
        Motion::Rapid => Speed::Rapid,
        _ if new.feed == 0.0 => return Err(Error::UndefinedFeedRate),
        _ => Speed::Feed(new.feed),
    };
    let arc = match new.motion {
        Motion::ArcClockwise => Some(true),
        Motion::ArcCounterClockwise => Some(false),
        _ => None,
    };
    if !any_axis {
        return if arc.is_some() { Err(Error::NoAxisWords) } else { Ok(None) };
    }
    let mm = new.units.mm();
    let [a, b, _] = new.plane.axes();
    if arc.is_some() && !(words.has(AXIS_LETTERS[a]) || words.has(AXIS_LETTERS[b])) {
        return Err(Error::NoAxisWordsInPlane);
    }
    let start = new.position;
    let mut target = start;
    for (axis, &letter) in AXIS_LETTERS.iter().enumerate() {
        if let Some(value) = words.take(letter) {
            target[axis] = match new.distance {
                _ if words.absolute => value * mm,
                Distance::Absolute => value * mm + new.offset[axis],
                Distance::Incremental => start[axis] + value * mm,
            };
        }
        if (target[axis] * settings.steps_per_mm[axis]).abs() > MAX_STEPS {
            return Err(Error::InvalidTarget);
        }
    }
    let path = match arc {
        None => Path::Line { target, speed },
        Some(clockwise) => {
            let centre = match words.take(b'R') {
                Some(r) => Centre::Radius(r * mm),
                None => {
                    let offset = [words.take(OFFSET_LETTERS[a]), words.take(OFFSET_LETTERS[b])];
                    if offset == [None, None] {
                        return Err(Error::NoOffsetsInPlane);
                    }
                    Centre::Offset(offset.map(|o| o.unwrap_or(0.0) * mm))
                }
            };
            let arc = Arc::new(start, target, new.plane, centre, clockwise, settings.arc_tolerance, speed)?;
            let scale = settings.steps_per_mm[a].max(settings.steps_per_mm[b]);
            if arc.reach() * scale > MAX_STEPS {
                return Err(Error::InvalidTarget);
            }
            Path::Arc(arc)
        }
    };
    new.position = target;
    Ok(Some(path))
}
