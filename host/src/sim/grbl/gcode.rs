//! The G-code of GRBL 1.1: which blocks it accepts, what it answers to the others, and what it makes of them.
//!
//! Places are single precision, as on the controllers of eight bits that GRBL was made for.

use super::arc;
use super::settings::Settings;
use super::words::{
    AXIS_CONFLICT, AXIS_WORDS, COORDINATE_SYSTEM, G53_MODE, INVALID_JOG, LINE_NUMBER, MODAL_GROUP, NEGATIVE,
    NO_AXIS_WORDS, NO_FEED, NOT_WHOLE, REPEATED, Refusal, TOOL_LENGTH_AXIS, UNSUPPORTED, UNUSED_WORDS, VALUE_MISSING,
    Word, words,
};

const MM_PER_INCH: f32 = 25.4;
const LINE_NUMBER_MAX: f32 = 10_000_000.0;
/// G54 to G59, then G28 and G30.
pub(super) const PLACES: usize = 8;

pub(super) type Place = [f32; 3];

/// What a block has the controller do, in order.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Order {
    /// A straight move to a machine position, at a feed in mm/min, or as fast as it goes.
    Line { target: Place, feed: Option<f32> },
    /// Waits until the motion has ended, then for so many seconds.
    Dwell(f32),
    /// The spindle, which is where a servo is: its S, or off. After the motion, or (laser mode) at once.
    Spindle(Option<f32>),
    /// Writes the EEPROM.
    Store,
    /// Waits for the motion, and then for its user.
    Pause,
    /// The program has ended.
    End,
}

/// What `G0` to `G80` choose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    Rapid,
    Linear,
    Clockwise,
    Anticlockwise,
    None,
}

/// State that outlives a block.
#[derive(Clone, Debug)]
pub(super) struct Modal {
    pub(super) mode: Mode,
    /// 0: XY (G17), 1: ZX (G18), 2: YZ (G19).
    pub(super) plane: u8,
    pub(super) inches: bool,
    pub(super) relative: bool,
    pub(super) inverse_time: bool,
    /// Of G54 to G59, from 0.
    pub(super) system: usize,
    /// M3, M4 or none (M5).
    pub(super) spindle: Option<u8>,
    /// Bit 0: M8, bit 1: M7.
    pub(super) coolant: u8,
    /// In mm/min.
    pub(super) feed: f32,
    pub(super) speed: f32,
    pub(super) tool: f32,
    /// Where the last block ends, in machine mm.
    pub(super) position: Place,
    pub(super) g92: Place,
    pub(super) tool_length: f32,
}

impl Modal {
    /// As after a reset, at a place.
    pub(super) fn at(position: Place) -> Self {
        Self {
            mode: Mode::Rapid,
            plane: 0,
            inches: false,
            relative: false,
            inverse_time: false,
            system: 0,
            spindle: None,
            coolant: 0,
            feed: 0.0,
            speed: 0.0,
            tool: 0.0,
            position,
            g92: [0.0; 3],
            tool_length: 0.0,
        }
    }

    /// From work to machine coordinates, of the system in force.
    pub(super) fn offset(&self, places: &[Place; PLACES]) -> Place {
        let system = places.get(self.system).copied().unwrap_or_default();
        let length = [0.0, 0.0, self.tool_length];
        std::array::from_fn(|axis| system[axis] + self.g92[axis] + length[axis])
    }

    /// What `$G` tells, with the feed in the units of reports.
    pub(super) fn report(&self, in_inches: bool) -> String {
        let mode = match self.mode {
            Mode::Rapid => "0",
            Mode::Linear => "1",
            Mode::Clockwise => "2",
            Mode::Anticlockwise => "3",
            Mode::None => "80",
        };
        let coolant = ["M9", "M8", "M7", "M7 M8"][usize::from(self.coolant & 3)];
        let (feed, decimals) = if in_inches { (self.feed / MM_PER_INCH, 1) } else { (self.feed, 0) };
        format!(
            "[GC:G{mode} G{} G{} G{} G{} G{} M{} {coolant} T{} F{feed:.decimals$} S{:.0}]\r\n",
            54 + self.system,
            17 + self.plane,
            if self.inches { 20 } else { 21 },
            if self.relative { 91 } else { 90 },
            if self.inverse_time { 93 } else { 94 },
            self.spindle.unwrap_or(5),
            self.tool as u8,
            self.speed,
        )
    }
}

/// Commands of the group that is not modal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Once {
    Dwell,
    SetOffsets,
    /// G28 or G30, by its index among the places.
    GoTo(usize),
    StorePlace(usize),
    Machine,
    SetG92,
    ClearG92,
}

/// A block's words, sorted.
#[derive(Default)]
struct Block {
    once: Option<Once>,
    mode: Option<Mode>,
    tool_length: Option<bool>,
    /// 0, 1, 2 or 30.
    flow: Option<i32>,
    groups: u32,
    values: [Option<f32>; 26],
}

impl Block {
    fn value(&self, letter: u8) -> Option<f32> {
        self.values.get(usize::from(letter.wrapping_sub(b'A'))).copied().flatten()
    }

    fn take(&mut self, letter: u8) -> Option<f32> {
        self.values.get_mut(usize::from(letter.wrapping_sub(b'A'))).and_then(Option::take)
    }

    /// Notes that a command of this modal group was given.
    fn group(&mut self, group: u32) -> Result<(), Refusal> {
        if self.groups & (1 << group) != 0 {
            return Err(MODAL_GROUP);
        }
        self.groups |= 1 << group;
        Ok(())
    }

    fn axes(&self) -> [Option<f32>; 3] {
        [self.value(b'X'), self.value(b'Y'), self.value(b'Z')]
    }

    fn has_axes(&self) -> bool {
        self.axes().iter().any(Option::is_some)
    }

    fn take_axes(&mut self) {
        for letter in *b"XYZ" {
            self.take(letter);
        }
    }

    /// Whether a command has asked for the axis words by itself.
    fn wants_axes(&self) -> bool {
        let once = matches!(self.once, Some(Once::SetOffsets | Once::GoTo(_) | Once::SetG92));
        once || self.tool_length.is_some()
            || matches!(self.mode, Some(Mode::Rapid | Mode::Linear | Mode::Clockwise | Mode::Anticlockwise))
    }
}

/// The parser's state, which includes the stored places.
#[derive(Clone, Debug)]
pub(super) struct Parser {
    pub(super) modal: Modal,
    /// Machine coordinates of G54 to G59, G28 and G30.
    pub(super) places: [Place; PLACES],
}

impl Parser {
    /// As after a reset.
    pub(super) fn new() -> Self {
        Self { modal: Modal::at([0.0; 3]), places: [[0.0; 3]; PLACES] }
    }

    /// Checks a block and carries it out in the parser's state; what is to be done comes back. A block that is refused changes nothing.
    pub(super) fn block(&mut self, line: &[u8], settings: &Settings) -> Result<Vec<Order>, Refusal> {
        let mut modal = self.modal.clone();
        let mut block = Block::default();
        let mut spindle = modal.spindle;
        for word in words(line)? {
            match word.letter {
                b'G' => general(word, &mut block, &mut modal)?,
                b'M' => miscellaneous(word, &mut block, &mut modal, &mut spindle)?,
                letter => value(word, letter, &mut block)?,
            }
        }
        self.carry_out(block, modal, spindle, settings)
    }

    /// The move of a jog line, which leaves the state as it is but for the place.
    pub(super) fn jog(&mut self, line: &[u8]) -> Result<Order, Refusal> {
        let mut modal = self.modal.clone();
        let mut block = Block::default();
        for word in words(line)? {
            match (word.letter, word.command()) {
                (b'G', (20 | 21 | 90 | 91 | 53, 0)) => general(word, &mut block, &mut modal)?,
                (b'G' | b'M', _) => return Err(INVALID_JOG),
                (letter, _) => value(word, letter, &mut block)?,
            }
        }
        if !block.has_axes() {
            return Err(NO_AXIS_WORDS);
        }
        let scale = if modal.inches { MM_PER_INCH } else { 1.0 };
        let feed = block.take(b'F').ok_or(NO_FEED)? * scale;
        let target = self.target(&block, &modal, scale);
        block.take_axes();
        block.take(b'N');
        if block.values.iter().any(Option::is_some) {
            return Err(UNUSED_WORDS);
        }
        self.modal.position = target;
        Ok(Order::Line { target, feed: Some(feed) })
    }

    fn target(&self, block: &Block, modal: &Modal, scale: f32) -> Place {
        let offset = modal.offset(&self.places);
        let machine = block.once == Some(Once::Machine);
        let axes = block.axes();
        std::array::from_fn(|axis| match axes[axis] {
            None => modal.position[axis],
            Some(value) if machine => value * scale,
            Some(value) if modal.relative => value * scale + modal.position[axis],
            Some(value) => value * scale + offset[axis],
        })
    }

    #[allow(clippy::too_many_lines, reason = "the order of the checks is what decides which error is answered")]
    fn carry_out(
        &mut self,
        mut block: Block,
        mut modal: Modal,
        spindle: Option<u8>,
        settings: &Settings,
    ) -> Result<Vec<Order>, Refusal> {
        let mut orders = Vec::new();
        let scale = if modal.inches { MM_PER_INCH } else { 1.0 };
        let axes = block.has_axes();
        if block.take(b'N').is_some_and(|n| n > LINE_NUMBER_MAX) {
            return Err(LINE_NUMBER);
        }
        let mode = block.mode.unwrap_or(modal.mode);
        // Axis words that no command has asked for are for the mode in force.
        let moves =
            block.mode.is_some_and(|mode| mode != Mode::None) || (axes && !block.wants_axes() && block.mode.is_none());
        let feed = match (modal.inverse_time, block.take(b'F')) {
            (true, feed) => {
                if moves && mode != Mode::Rapid && mode != Mode::None && feed.is_none() && axes {
                    return Err(NO_FEED);
                }
                feed.unwrap_or(0.0)
            }
            (false, Some(feed)) => feed * scale,
            (false, None) if self.modal.inverse_time => 0.0,
            (false, None) => modal.feed,
        };
        modal.feed = feed;
        let speed = block.take(b'S').unwrap_or(modal.speed);
        if let Some(tool) = block.take(b'T') {
            modal.tool = tool;
        }
        let dwell = match block.once {
            Some(Once::Dwell) => Some(block.take(b'P').ok_or(VALUE_MISSING)?),
            _ => None,
        };
        if let Some(on) = block.tool_length {
            if on {
                if !axes {
                    return Err(NO_AXIS_WORDS);
                }
                let Some(length) = block.take(b'Z') else { return Err(TOOL_LENGTH_AXIS) };
                if block.has_axes() {
                    return Err(TOOL_LENGTH_AXIS);
                }
                modal.tool_length = length * scale;
            } else {
                modal.tool_length = 0.0;
            }
        }
        // What the group that is not modal does; the spindle, the dwell and the coolant come first.
        let mut once = Vec::new();
        let mut places = self.places;
        match block.once {
            Some(Once::SetOffsets) => {
                if !axes {
                    return Err(NO_AXIS_WORDS);
                }
                let (Some(p), Some(l)) = (block.take(b'P'), block.take(b'L')) else { return Err(VALUE_MISSING) };
                if !(0.0..=6.0).contains(&p) {
                    return Err(COORDINATE_SYSTEM);
                }
                let index = if p.trunc() == 0.0 { modal.system } else { p.trunc() as usize - 1 };
                let from_here = match l as i32 {
                    2 => false,
                    20 => true,
                    _ => return Err(UNSUPPORTED),
                };
                if block.value(b'R').is_some() {
                    return Err(UNSUPPORTED);
                }
                let length = [0.0, 0.0, modal.tool_length];
                for (axis, value) in block.axes().into_iter().enumerate() {
                    if let (Some(value), Some(place)) = (value, places.get_mut(index)) {
                        place[axis] = if from_here {
                            modal.position[axis] - modal.g92[axis] - length[axis] - value * scale
                        } else {
                            value * scale
                        };
                    }
                }
                block.take_axes();
                once.push(Order::Store);
            }
            Some(Once::SetG92) => {
                if !axes {
                    return Err(NO_AXIS_WORDS);
                }
                let system = places.get(modal.system).copied().unwrap_or_default();
                let length = [0.0, 0.0, modal.tool_length];
                for (axis, value) in block.axes().into_iter().enumerate() {
                    if let Some(value) = value {
                        modal.g92[axis] = modal.position[axis] - system[axis] - length[axis] - value * scale;
                    }
                }
                block.take_axes();
            }
            Some(Once::ClearG92) => modal.g92 = [0.0; 3],
            Some(Once::StorePlace(index)) => {
                if let Some(place) = places.get_mut(index) {
                    *place = modal.position;
                }
                once.push(Order::Store);
            }
            Some(Once::GoTo(index)) => {
                let home = places.get(index).copied().unwrap_or_default();
                if axes {
                    let between = self.target(&block, &modal, scale);
                    once.push(Order::Line { target: between, feed: None });
                    // Only the axes that are named go on.
                    let named = block.axes();
                    modal.position =
                        std::array::from_fn(|axis| if named[axis].is_some() { home[axis] } else { between[axis] });
                } else {
                    modal.position = home;
                }
                block.take_axes();
                once.push(Order::Line { target: modal.position, feed: None });
            }
            Some(Once::Machine) if !matches!(mode, Mode::Rapid | Mode::Linear) => return Err(G53_MODE),
            Some(Once::Machine | Once::Dwell) | None => {}
        }
        let mut motion = Vec::new();
        if mode == Mode::None && axes && !block.wants_axes() {
            return Err(AXIS_WORDS);
        }
        modal.mode = mode;
        if moves {
            let target = self.target(&block, &modal, scale);
            let length = distance(modal.position, target);
            let feed = if modal.inverse_time { feed * length } else { feed };
            match mode {
                Mode::Rapid if axes => motion.push(Order::Line { target, feed: None }),
                Mode::Linear | Mode::Clockwise | Mode::Anticlockwise
                    if feed <= 0.0 && (length > 0.0 || !modal.inverse_time) =>
                {
                    return Err(NO_FEED);
                }
                Mode::Linear if axes => motion.push(Order::Line { target, feed: Some(feed) }),
                Mode::Clockwise | Mode::Anticlockwise => {
                    let offsets = [block.take(b'I'), block.take(b'J'), block.take(b'K')].map(|o| o.map(|v| v * scale));
                    let radius = block.take(b'R').map(|r| r * scale);
                    let named = block.axes().map(|value| value.is_some());
                    let arc = arc::Arc {
                        from: modal.position,
                        to: target,
                        plane: modal.plane,
                        clockwise: mode == Mode::Clockwise,
                    };
                    let chords = arc.chords(named, offsets, radius, settings.get(12))?;
                    motion.extend(chords.into_iter().map(|target| Order::Line { target, feed: Some(feed) }));
                }
                _ => {}
            }
            modal.position = target;
            block.take_axes();
        }
        if block.values.iter().any(Option::is_some) {
            return Err(UNUSED_WORDS);
        }
        // In GRBL's order: spindle, dwell, the rest, motion, pause.
        let was = (self.modal.spindle.is_some(), self.modal.speed, self.modal.spindle);
        modal.spindle = spindle;
        modal.speed = speed;
        if (spindle.is_some() && was.1 != speed) || spindle != was.2 {
            orders.push(Order::Spindle(spindle.map(|_| speed)));
        }
        orders.extend(dwell.map(Order::Dwell));
        orders.append(&mut once);
        orders.append(&mut motion);
        match block.flow {
            Some(0 | 1) => orders.push(Order::Pause),
            Some(_) => {
                orders.push(Order::Spindle(None));
                orders.push(Order::End);
                let Modal { position, g92, tool_length, feed, speed, tool, inches, .. } = modal;
                modal =
                    Modal { mode: Mode::Linear, g92, tool_length, feed, speed, tool, inches, ..Modal::at(position) };
            }
            None => {}
        }
        self.modal = modal;
        self.places = places;
        Ok(orders)
    }
}

fn distance(a: Place, b: Place) -> f32 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f32>().sqrt()
}

/// A G word.
fn general(word: Word, block: &mut Block, modal: &mut Modal) -> Result<(), Refusal> {
    let (whole, hundredths) = word.command();
    let once = match (whole, hundredths) {
        (4, 0) => Some(Once::Dwell),
        (10, 0) => Some(Once::SetOffsets),
        (28, 0) => Some(Once::GoTo(6)),
        (30, 0) => Some(Once::GoTo(7)),
        (28, 10) => Some(Once::StorePlace(6)),
        (30, 10) => Some(Once::StorePlace(7)),
        (53, 0) => Some(Once::Machine),
        (92, 0) => Some(Once::SetG92),
        (92, 10) => Some(Once::ClearG92),
        _ => None,
    };
    if let Some(once) = once {
        if matches!(once, Once::SetOffsets | Once::GoTo(_) | Once::SetG92) && block.wants_axes() {
            return Err(AXIS_CONFLICT);
        }
        block.group(0)?;
        block.once = Some(once);
        return Ok(());
    }
    let mode = match (whole, hundredths) {
        (0, 0) => Some(Mode::Rapid),
        (1, 0) => Some(Mode::Linear),
        (2, 0) => Some(Mode::Clockwise),
        (3, 0) => Some(Mode::Anticlockwise),
        (80, 0) => Some(Mode::None),
        _ => None,
    };
    if let Some(mode) = mode {
        if mode != Mode::None && block.wants_axes() {
            // Two of the group come first in what is answered when both are moves.
            return Err(if block.mode.is_some() { MODAL_GROUP } else { AXIS_CONFLICT });
        }
        block.group(1)?;
        block.mode = Some(mode);
        return Ok(());
    }
    match (whole, hundredths) {
        (17..=19, 0) => {
            block.group(2)?;
            modal.plane = (whole - 17) as u8;
        }
        (90 | 91, 0) => {
            block.group(3)?;
            modal.relative = whole == 91;
        }
        (91, 10) => block.group(4)?,
        (93 | 94, 0) => {
            block.group(5)?;
            modal.inverse_time = whole == 93;
        }
        (20 | 21, 0) => {
            block.group(6)?;
            modal.inches = whole == 20;
        }
        (40, 0) => block.group(7)?,
        (43, 10) | (49, 0) => {
            if block.wants_axes() {
                return Err(AXIS_CONFLICT);
            }
            block.group(8)?;
            block.tool_length = Some(whole == 43);
        }
        (54..=59, 0) => {
            block.group(12)?;
            modal.system = (whole - 54) as usize;
        }
        (61, 0) => block.group(13)?,
        // Commands that it has, with a decimal that it has not.
        (0..=3 | 4 | 10 | 17..=21 | 40 | 53..=59 | 80 | 93 | 94, 1..) => return Err(NOT_WHOLE),
        _ => return Err(UNSUPPORTED),
    }
    Ok(())
}

/// An M word.
fn miscellaneous(word: Word, block: &mut Block, modal: &mut Modal, spindle: &mut Option<u8>) -> Result<(), Refusal> {
    let (whole, hundredths) = word.command();
    if hundredths > 0 {
        return Err(NOT_WHOLE);
    }
    match whole {
        0 | 1 | 2 | 30 => {
            block.group(16)?;
            // M1 stops only where there is a switch for it.
            block.flow = (whole != 1).then_some(whole);
        }
        3..=5 => {
            block.group(17)?;
            *spindle = (whole != 5).then_some(whole as u8);
        }
        8 | 9 => {
            block.group(18)?;
            modal.coolant = u8::from(whole == 8);
        }
        _ => return Err(UNSUPPORTED),
    }
    Ok(())
}

/// A word that is no command.
fn value(word: Word, letter: u8, block: &mut Block) -> Result<(), Refusal> {
    if !matches!(letter, b'F' | b'I'..=b'L' | b'N' | b'P' | b'R' | b'S' | b'T' | b'X'..=b'Z') {
        return Err(UNSUPPORTED);
    }
    let Some(slot) = block.values.get_mut(usize::from(letter - b'A')) else { return Err(UNSUPPORTED) };
    if slot.is_some() {
        return Err(REPEATED);
    }
    if matches!(letter, b'F' | b'N' | b'P' | b'T' | b'S') && word.value < 0.0 {
        return Err(NEGATIVE);
    }
    *slot = Some(word.value);
    Ok(())
}
