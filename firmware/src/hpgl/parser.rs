//! Instructions out of bytes, one part a byte at the most.

/// Digits of a number that count; the rest is read over.
const DIGITS: u32 = 15;

/// Ends a label unless `DT` says otherwise.
const ETX: u8 = 0x03;

/// What a byte has completed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Part {
    /// Nothing.
    None,
    /// An instruction begins.
    Mnemonic([u8; 2]),
    /// A parameter of it.
    Number(f64),
    /// Something that is no parameter.
    Bad,
    /// A byte of `PE`.
    Encoded(u8),
    /// The instruction is complete.
    End,
}

/// A parameter that is being read.
#[derive(Clone, Copy, Debug, Default)]
struct Number {
    negative: bool,
    mantissa: u64,
    digits: u32,
    /// Decimal places, once there was a point.
    places: Option<u32>,
    /// Digits before the point that were read over.
    over: bool,
    /// Any character of it has come.
    begun: bool,
    /// Any digit has come.
    any: bool,
}

impl Number {
    /// Takes a character of a number; false when it does not fit there.
    fn push(&mut self, byte: u8) -> bool {
        match byte {
            b'+' | b'-' if !self.begun => self.negative = byte == b'-',
            b'.' if self.places.is_none() => self.places = Some(0),
            b'0'..=b'9' => {
                self.any = true;
                // Decimal places beyond those are nothing to a plotter.
                if self.digits < DIGITS && self.places.is_none_or(|places| places < DIGITS) {
                    self.mantissa = self.mantissa * 10 + u64::from(byte - b'0');
                    self.digits += u32::from(self.mantissa > 0);
                    if let Some(places) = &mut self.places {
                        *places += 1;
                    }
                } else if self.places.is_none() {
                    self.over = true;
                }
            }
            _ => return false,
        }
        self.begun = true;
        true
    }

    /// The number, if there is one; infinite when it is longer than any plotter's.
    fn take(&mut self) -> Option<Part> {
        let number = core::mem::take(self);
        if !number.begun {
            return None;
        }
        if !number.any {
            return Some(Part::Bad);
        }
        let places = number.places.unwrap_or(0);
        let value = if number.over { f64::INFINITY } else { number.mantissa as f64 / power_of_ten(places) };
        Some(Part::Number(if number.negative { -value } else { value }))
    }
}

/// 10 to the power of at most [`DIGITS`], exactly.
fn power_of_ten(exponent: u32) -> f64 {
    (0..exponent.min(DIGITS)).fold(1.0, |power, _| power * 10.0)
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Within {
    #[default]
    Nothing,
    /// The first letter of a mnemonic.
    Letter(u8),
    Numbers,
    Encoded,
    Label,
    /// `DT`: the next byte ends labels.
    Terminator,
}

/// Reads instructions byte by byte: `XX` with parameters between commas and blanks, ended by `;` or the next instruction.
#[derive(Clone, Debug)]
pub(crate) struct Parser {
    within: Within,
    number: Number,
    terminator: u8,
    /// A byte that is to be taken once more, after the part that it completed.
    again: Option<u8>,
}

impl Default for Parser {
    fn default() -> Self {
        Self { within: Within::Nothing, number: Number::default(), terminator: ETX, again: None }
    }
}

impl Parser {
    /// Whether an instruction may begin with the next byte.
    pub(crate) fn is_between(&self) -> bool {
        self.within == Within::Nothing && self.again.is_none()
    }

    /// Labels end with ETX again.
    pub(crate) fn reset_terminator(&mut self) {
        self.terminator = ETX;
    }

    /// Takes a byte, or the last once more while [`Parser::again`] is there.
    pub(crate) fn take(&mut self, byte: u8) -> Part {
        match self.within {
            Within::Nothing if byte.is_ascii_alphabetic() => {
                self.within = Within::Letter(byte.to_ascii_uppercase());
                Part::None
            }
            Within::Nothing if byte == b';' || byte <= b' ' => Part::None,
            Within::Nothing => {
                // No instruction: what follows it is read as its parameters.
                self.within = Within::Numbers;
                Part::Mnemonic(*b"??")
            }
            Within::Letter(first) if byte.is_ascii_alphabetic() => {
                let mnemonic = [first, byte.to_ascii_uppercase()];
                self.within = match &mnemonic {
                    b"LB" => Within::Label,
                    b"DT" => Within::Terminator,
                    b"PE" => Within::Encoded,
                    _ => Within::Numbers,
                };
                Part::Mnemonic(mnemonic)
            }
            Within::Letter(_) if byte <= b' ' => Part::None,
            Within::Letter(_) => {
                (self.within, self.again) = (Within::Numbers, Some(byte));
                Part::Mnemonic(*b"??")
            }
            Within::Label => {
                if byte != self.terminator {
                    return Part::None;
                }
                self.within = Within::Nothing;
                Part::End
            }
            Within::Terminator => {
                self.terminator = if byte == b';' { ETX } else { byte };
                self.within = if byte == b';' { Within::Nothing } else { Within::Numbers };
                if byte == b';' { Part::End } else { Part::None }
            }
            Within::Encoded if byte == b';' => {
                self.within = Within::Nothing;
                Part::End
            }
            Within::Encoded => Part::Encoded(byte),
            Within::Numbers => self.numbers(byte),
        }
    }

    /// The byte that is to be taken once more.
    pub(crate) fn again(&mut self) -> Option<u8> {
        self.again.take()
    }

    fn numbers(&mut self, byte: u8) -> Part {
        match byte {
            b'+' | b'-' | b'.' | b'0'..=b'9' => {
                if self.number.push(byte) {
                    return Part::None;
                }
                // A sign, or a second point, begins another number.
                let part = self.number.take().unwrap_or(Part::None);
                self.number.push(byte);
                part
            }
            b',' | 0..=b' ' => self.number.take().unwrap_or(Part::None),
            b';' | b'A'..=b'Z' | b'a'..=b'z' => {
                if let Some(part) = self.number.take() {
                    self.again = Some(byte);
                    return part;
                }
                self.within = if byte == b';' { Within::Nothing } else { Within::Letter(byte.to_ascii_uppercase()) };
                Part::End
            }
            _ => {
                self.number = Number::default();
                Part::Bad
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    fn parts(text: &[u8]) -> Vec<Part> {
        let mut parser = Parser::default();
        let mut parts = Vec::new();
        for &byte in text {
            let mut next = Some(byte);
            while let Some(byte) = next {
                parts.push(parser.take(byte));
                next = parser.again();
            }
        }
        parts.retain(|part| *part != Part::None);
        parts
    }

    #[test]
    fn instructions_are_read_byte_by_byte() {
        use Part::{Bad, Encoded, End, Mnemonic, Number};
        for (text, expected) in [
            ("IN;SP1;", &[Mnemonic(*b"IN"), End, Mnemonic(*b"SP"), Number(1.0), End][..]),
            ("pd 1,-2PU", &[Mnemonic(*b"PD"), Number(1.0), Number(-2.0), End, Mnemonic(*b"PU")]),
            ("PA1-2+3.5;", &[Mnemonic(*b"PA"), Number(1.0), Number(-2.0), Number(3.5), End]),
            ("PA1.5.25 .5;", &[Mnemonic(*b"PA"), Number(1.5), Number(0.25), Number(0.5), End]),
            ("LBPD;\x03PU;", &[Mnemonic(*b"LB"), End, Mnemonic(*b"PU"), End]),
            ("DT*;LBa;b*PU;", &[Mnemonic(*b"DT"), End, Mnemonic(*b"LB"), End, Mnemonic(*b"PU"), End]),
            ("1;P1PU;", &[Mnemonic(*b"??"), End, Mnemonic(*b"??"), Number(1.0), End, Mnemonic(*b"PU"), End]),
            ("PA1,~-;", &[Mnemonic(*b"PA"), Number(1.0), Bad, Bad, End]),
            ("PE<;;", &[Mnemonic(*b"PE"), Encoded(b'<'), End]),
            ("\r\nP\r\nU;", &[Mnemonic(*b"PU"), End]),
            (
                "PA1234567890123456789,0.00000000000000000000001;",
                &[Mnemonic(*b"PA"), Number(f64::INFINITY), Number(0.0), End],
            ),
        ] {
            assert_eq!(parts(text.as_bytes()), expected, "{text:?}");
        }
    }
}
