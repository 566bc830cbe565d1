//! Device control instructions, `ESC . X`, and the handshakes that they choose.

const ESC: u8 = 0x1b;
const CR: u8 = b'\r';
/// Longest list of parameters.
const PARAMETERS_MAX: usize = 40;
/// Free bytes below which the ready line says stop, and Xoff when no threshold is given.
const THRESHOLD: usize = 80;

/// What a byte was.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Received {
    /// One for the buffer.
    Data(u8),
    /// The end of an instruction that is obeyed at once.
    Order(Order),
    /// The sender asks whether there is room.
    Asked,
    Nothing,
}

/// What an instruction has the plotter do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Order {
    Say(String),
    /// Tells the free bytes.
    Free,
    /// Tells the size of the buffer.
    Size,
    Status,
    Abort,
    /// The handshake is another one.
    Settled,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
enum Escape {
    #[default]
    None,
    Begun,
    Dot,
    Parameters(u8, Vec<u8>),
}

/// Reads device control instructions, and minds the handshake.
#[derive(Clone, Debug)]
pub(super) struct Control {
    escape: Escape,
    /// Bytes of the buffer as built, and as set up.
    most: usize,
    size: usize,
    hardware: bool,
    ready: bool,
    /// Free bytes that a block needs, and below which Xoff is sent.
    block: usize,
    /// The character that asks for room.
    enquiry: Option<u8>,
    asked: bool,
    acknowledge: Vec<u8>,
    /// Xon and Xoff instead of question and answer.
    xon: bool,
    xoff: Vec<u8>,
    stopped: bool,
    terminator: Vec<u8>,
    error: u8,
    /// Programmed off: data is not for it.
    off: bool,
}

impl Control {
    pub(super) fn new(size: usize) -> Self {
        Self {
            escape: Escape::None,
            most: size,
            size,
            hardware: false,
            ready: true,
            block: THRESHOLD,
            enquiry: None,
            asked: false,
            acknowledge: Vec::new(),
            xon: false,
            xoff: Vec::new(),
            stopped: false,
            terminator: vec![CR],
            error: 0,
            off: false,
        }
    }

    pub(super) fn size(&self) -> usize {
        self.size
    }

    /// The size of the buffer as built.
    pub(super) fn most(&self) -> usize {
        self.most
    }

    pub(super) fn terminator(&self) -> Vec<u8> {
        self.terminator.clone()
    }

    pub(super) fn ready_line(&self) -> bool {
        self.ready || !self.hardware
    }

    /// Bytes were lost.
    pub(super) fn overflow(&mut self) {
        self.error = 16;
    }

    /// So many bytes are free: what is sent because of it.
    pub(super) fn room(&mut self, free: usize) -> Vec<u8> {
        if free < THRESHOLD.min(self.size / 2) {
            self.ready = false;
        } else if free >= self.size / 2 {
            self.ready = true;
        }
        if self.asked && free >= self.block.min(self.size) {
            self.asked = false;
            return self.acknowledge.clone();
        }
        if self.xon {
            if !self.stopped && free < self.block.min(self.size / 2) {
                self.stopped = true;
                return self.xoff.clone();
            }
            if self.stopped && free >= self.size / 2 {
                self.stopped = false;
                return self.acknowledge.clone();
            }
        }
        Vec::new()
    }

    pub(super) fn receive(&mut self, byte: u8) -> Received {
        match std::mem::take(&mut self.escape) {
            Escape::None if byte == ESC => self.escape = Escape::Begun,
            Escape::None if self.off => {}
            Escape::None if self.enquiry == Some(byte) => {
                self.asked = true;
                return Received::Asked;
            }
            Escape::None => return Received::Data(byte),
            Escape::Begun if byte == b'.' => self.escape = Escape::Dot,
            // Not one of its own: a character by itself has no meaning for it.
            Escape::Begun => self.error = 11,
            Escape::Dot if matches!(byte, b'@' | b'H' | b'I' | b'M' | b'N') => {
                self.escape = Escape::Parameters(byte, Vec::new());
            }
            Escape::Dot => return self.instruction(byte),
            Escape::Parameters(letter, text) if byte == b':' => return self.set(letter, &text),
            Escape::Parameters(letter, mut text) => {
                if !(byte.is_ascii_digit() || byte == b';' || byte == b' ') {
                    self.error = 12;
                } else if text.len() == PARAMETERS_MAX {
                    self.error = 14;
                } else {
                    text.push(byte);
                    self.escape = Escape::Parameters(letter, text);
                }
            }
        }
        Received::Nothing
    }

    /// An instruction without parameters.
    fn instruction(&mut self, letter: u8) -> Received {
        let order = match letter {
            b'A' => Order::Say("7475A,1".to_owned()),
            b'B' => Order::Free,
            b'E' => Order::Say(std::mem::take(&mut self.error).to_string()),
            b'K' => Order::Abort,
            b'L' => Order::Size,
            b'O' => Order::Status,
            b'R' => {
                let (most, error, off) = (self.most, self.error, self.off);
                *self = Self { error, off, ..Self::new(most) };
                Order::Settled
            }
            b'(' | b'Y' => {
                self.off = false;
                return Received::Nothing;
            }
            b')' | b'Z' => {
                self.off = true;
                return Received::Nothing;
            }
            b'J' => return Received::Nothing,
            _ => {
                self.error = 11;
                return Received::Nothing;
            }
        };
        Received::Order(order)
    }

    /// An instruction with parameters.
    fn set(&mut self, letter: u8, text: &[u8]) -> Received {
        let text = String::from_utf8_lossy(text);
        let numbers: Vec<Option<usize>> = text.split(';').map(|number| number.trim().parse().ok()).collect();
        let number = |index: usize| numbers.get(index).copied().flatten();
        let characters = |from: usize| -> Vec<u8> {
            numbers
                .iter()
                .skip(from)
                .flatten()
                .filter_map(|number| u8::try_from(*number).ok())
                .filter(|c| *c > 0)
                .collect()
        };
        match letter {
            b'@' => {
                self.size = number(0).unwrap_or(self.most).clamp(1, self.most);
                self.hardware = number(1).is_some_and(|bits| bits & 1 != 0);
            }
            b'H' | b'I' => {
                self.block = number(0).unwrap_or(THRESHOLD);
                self.enquiry = number(1).and_then(|c| u8::try_from(c).ok()).filter(|c| *c > 0);
                self.acknowledge = characters(2);
                self.xon = letter == b'I' && self.enquiry.is_none() && !self.acknowledge.is_empty();
                self.asked = false;
                self.stopped = false;
            }
            b'N' => self.xoff = characters(1),
            // Delay, trigger and echo are for other computers; the end of a reply is the fourth.
            _ => {
                let end = characters(3);
                self.terminator = if end.is_empty() { vec![CR] } else { end };
            }
        }
        Received::Order(Order::Settled)
    }
}
