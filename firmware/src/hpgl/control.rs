//! Device control, `ESC . X`, and the handshakes that it chooses.
//!
//! An instruction is obeyed when its last byte arrives, however much is buffered, and takes no room in the buffer. Parameters are numbers between `;`, ended by `:`.
//! Handshakes: the computer asks (`ESC.B`), or is stopped by a character (`ESC.I`, `ESC.N`: Xon/Xoff), or asks for room for a block with one and is answered with another (`ESC.H`: ENQ/ACK), or
//! is stopped by the ready line (`ESC.@`).

use heapless::Vec;

use super::HPGL_BYTES;

const ESC: u8 = 0x1b;
const CR: u8 = b'\r';

/// Free bytes below which the line is stopped, when no threshold is given.
const THRESHOLD: usize = 80;

/// Parameters that an instruction takes; the rest is error 14.
const PARAMETERS: usize = 12;

/// Characters of an acknowledgement, of an Xoff or of the end of an answer.
pub(crate) type Signs = Vec<u8, 10>;

/// What a byte was.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Received {
    /// One for the buffer.
    Data(u8),
    /// The end of an instruction that is answered, or that ends what is buffered.
    Order(Order),
    /// The handshake may have something to say.
    Shake,
    /// Nothing.
    None,
}

/// What an instruction has the plotter do at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    /// `ESC.B`: tell the free bytes.
    Free,
    /// `ESC.L`: tell the size of the buffer.
    Size,
    /// `ESC.O`: tell the extended status.
    Status,
    /// `ESC.E`: tell the last error, and forget it.
    Error,
    /// `ESC.K`: forget what is buffered, and stop.
    Abort,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Escape {
    #[default]
    None,
    Begun,
    Dot,
    /// Parameters of this letter.
    Parameters(u8),
}

/// Reads device control, and minds the handshake.
#[derive(Clone, Debug)]
pub(crate) struct Control {
    escape: Escape,
    /// Parameters that are complete, and the one that is being read.
    parameters: Vec<Option<u16>, PARAMETERS>,
    parameter: Option<u16>,
    size: usize,
    /// The ready line stops the computer.
    hardware: bool,
    ready: bool,
    /// Free bytes that a block needs, and below which Xoff is sent.
    block: usize,
    /// The character that asks for room for a block, and whether that is still to be answered.
    enquiry: Option<u8>,
    asked: bool,
    /// The answer to it, or Xon.
    acknowledge: Signs,
    xon: bool,
    xoff: Signs,
    stopped: bool,
    /// The end of an answer.
    terminator: Signs,
    error: u8,
    /// Programmed off: data is not for it.
    off: bool,
}

impl Default for Control {
    fn default() -> Self {
        let mut control = Self {
            escape: Escape::None,
            parameters: Vec::new(),
            parameter: None,
            size: HPGL_BYTES,
            hardware: false,
            ready: true,
            block: THRESHOLD,
            enquiry: None,
            asked: false,
            acknowledge: Signs::new(),
            xon: false,
            xoff: Signs::new(),
            stopped: false,
            terminator: Signs::new(),
            error: 0,
            off: false,
        };
        control.set_terminator(Signs::new());
        control
    }
}

impl Control {
    /// Bytes of the buffer, as set up by `ESC.@`.
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// What ends an answer.
    pub(crate) fn terminator(&self) -> &[u8] {
        &self.terminator
    }

    /// The level of the ready line.
    pub(crate) fn is_ready(&self) -> bool {
        self.ready || !self.hardware
    }

    /// A byte was lost.
    pub(crate) fn overflow(&mut self) {
        self.error = 16;
    }

    /// The last error, which is forgotten.
    pub(crate) fn take_error(&mut self) -> u8 {
        core::mem::take(&mut self.error)
    }

    fn set_terminator(&mut self, signs: Signs) {
        self.terminator = signs;
        if self.terminator.is_empty() {
            // There is room for one.
            let _ = self.terminator.push(CR);
        }
    }

    /// So many bytes are free: what is sent because of it.
    pub(crate) fn room(&mut self, free: usize) -> Signs {
        if free < THRESHOLD.min(self.size / 2) {
            self.ready = false;
        } else if free >= self.size / 2 {
            self.ready = true;
        }
        if self.asked && free >= self.block.min(self.size) {
            self.asked = false;
            return self.acknowledge.clone();
        }
        if self.xon && !self.stopped && free < self.block.min(self.size / 2) {
            self.stopped = true;
            return self.xoff.clone();
        }
        if self.xon && self.stopped && free >= self.size / 2 {
            self.stopped = false;
            return self.acknowledge.clone();
        }
        Signs::new()
    }

    /// Takes a byte from the port. Cost: constant.
    pub(crate) fn receive(&mut self, byte: u8) -> Received {
        match core::mem::take(&mut self.escape) {
            Escape::None if byte == ESC => self.escape = Escape::Begun,
            Escape::None if self.off => {}
            Escape::None if self.enquiry == Some(byte) => {
                self.asked = true;
                return Received::Shake;
            }
            Escape::None => return Received::Data(byte),
            Escape::Begun if byte == b'.' => self.escape = Escape::Dot,
            Escape::Begun => self.error = 11,
            Escape::Dot if matches!(byte, b'@' | b'H' | b'I' | b'M' | b'N') => {
                self.parameters.clear();
                self.parameter = None;
                self.escape = Escape::Parameters(byte);
            }
            Escape::Dot => return self.instruction(byte),
            Escape::Parameters(letter) => return self.parameter(letter, byte),
        }
        Received::None
    }

    fn parameter(&mut self, letter: u8, byte: u8) -> Received {
        self.escape = Escape::Parameters(letter);
        match byte {
            b'0'..=b'9' => {
                let value = self.parameter.unwrap_or(0).saturating_mul(10).saturating_add(u16::from(byte - b'0'));
                self.parameter = Some(value);
            }
            b';' | b':' => {
                if self.parameters.push(self.parameter.take()).is_err() {
                    self.error = 14;
                }
                if byte == b':' {
                    self.escape = Escape::None;
                    self.set(letter);
                    return Received::Shake;
                }
            }
            b' ' => {}
            _ => {
                self.error = 12;
                self.escape = Escape::None;
            }
        }
        Received::None
    }

    /// An instruction without parameters.
    fn instruction(&mut self, letter: u8) -> Received {
        match letter {
            b'B' => return Received::Order(Order::Free),
            b'E' => return Received::Order(Order::Error),
            b'K' => return Received::Order(Order::Abort),
            b'L' => return Received::Order(Order::Size),
            b'O' => return Received::Order(Order::Status),
            b'R' => {
                *self = Self { error: self.error, off: self.off, ..Self::default() };
                return Received::Shake;
            }
            b'(' | b'Y' => self.off = false,
            b')' | b'Z' => self.off = true,
            // Of answers that have been sent there is nothing to forget.
            b'J' => {}
            _ => self.error = 11,
        }
        Received::None
    }

    /// An instruction with parameters.
    fn set(&mut self, letter: u8) {
        let number = |index: usize| self.parameters.get(index).copied().flatten().map(usize::from);
        let signs = |from: usize| -> Signs {
            let given = self.parameters.iter().skip(from).flatten();
            given.filter_map(|n| u8::try_from(*n).ok()).filter(|sign| *sign > 0).take(10).collect()
        };
        match letter {
            b'@' => {
                let (size, lines) = (number(0).unwrap_or(HPGL_BYTES), number(1).unwrap_or(0));
                self.size = size.clamp(1, HPGL_BYTES);
                self.hardware = lines & 1 != 0;
            }
            b'H' | b'I' => {
                let enquiry = number(1).and_then(|sign| u8::try_from(sign).ok()).filter(|sign| *sign > 0);
                let acknowledge = signs(2);
                self.block = number(0).unwrap_or(THRESHOLD);
                self.enquiry = enquiry;
                self.xon = letter == b'I' && enquiry.is_none() && !acknowledge.is_empty();
                self.acknowledge = acknowledge;
                (self.asked, self.stopped) = (false, false);
            }
            b'N' => self.xoff = signs(1),
            // M: delay, trigger and echo are for other computers; the end of an answer is the fourth, in up to two characters.
            _ => {
                let end = signs(3).into_iter().take(2).collect();
                self.set_terminator(end);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sends bytes; what of them was for the buffer, and the last order.
    fn send(control: &mut Control, bytes: &[u8]) -> (std::vec::Vec<u8>, Option<Order>) {
        let (mut data, mut order) = (std::vec::Vec::new(), None);
        for &byte in bytes {
            match control.receive(byte) {
                Received::Data(byte) => data.push(byte),
                Received::Order(o) => order = Some(o),
                Received::Shake | Received::None => {}
            }
        }
        (data, order)
    }

    #[test]
    fn instructions_never_reach_the_buffer() {
        let mut control = Control::default();
        for (bytes, data, order, error) in [
            (&b"PA\x1b.B1"[..], &b"PA1"[..], Some(Order::Free), 0),
            (b"\x1b.L\x1b.KX", b"X", Some(Order::Abort), 0),
            (b"\x1b.@1000;1:Y", b"Y", None, 0),
            (b"\x1b)12\x1b.)34\x1b.(5", b"125", None, 11),
            (b"\x1b.Q", b"", None, 11),
            (b"\x1b.@1x", b"", None, 12),
            (b"\x1b.H1;2;3;4;5;6;7;8;9;10;11;12;13;14:", b"", None, 14),
            (b"\x1b.O", b"", Some(Order::Status), 0),
        ] {
            assert_eq!(send(&mut control, bytes), (data.to_vec(), order), "{bytes:?}");
            assert_eq!(control.take_error(), error, "{bytes:?}");
        }
    }

    #[test]
    fn handshakes() {
        // Xon/Xoff.
        let mut control = Control::default();
        send(&mut control, b"\x1b.I80;0;17:\x1b.N;19:");
        assert_eq!(control.room(1000), b"");
        assert_eq!(control.room(79), b"\x13");
        assert_eq!(control.room(60), b"");
        assert_eq!(control.room(512), b"\x11");
        // ENQ/ACK.
        let mut control = Control::default();
        send(&mut control, b"\x1b.H500;5;6:");
        assert_eq!(control.receive(5), Received::Shake);
        assert_eq!(control.room(499), b"", "not yet");
        assert_eq!(control.room(500), b"\x06");
        assert_eq!(control.room(1000), b"");
        // The ready line.
        let mut control = Control::default();
        send(&mut control, b"\x1b.@;1:");
        control.room(10);
        assert!(!control.is_ready());
        control.room(600);
        assert!(control.is_ready());
        send(&mut control, b"\x1b.M;;;10;13:");
        assert_eq!(control.terminator(), b"\n\r");
        send(&mut control, b"\x1b.R");
        assert_eq!((control.terminator(), control.size()), (&b"\r"[..], HPGL_BYTES));
    }
}
