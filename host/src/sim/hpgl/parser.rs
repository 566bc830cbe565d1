//! HPGL, byte by byte: a vector can be drawn before the list that it is in has arrived.

/// Ends a label unless `DT` says otherwise.
const ETX: u8 = 0x03;
/// Characters of a number that are kept.
const DIGITS_MAX: usize = 24;

/// A part of an instruction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Part {
    /// Two letters.
    Mnemonic([u8; 2]),
    Number(f64),
    /// What is no number.
    Bad,
    End,
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
enum Within {
    #[default]
    Nothing,
    Letter(u8),
    Numbers,
    Label,
    Terminator,
}

/// Reads HPGL.
#[derive(Clone, Debug)]
pub(super) struct Parser {
    within: Within,
    number: Vec<u8>,
    terminator: u8,
    fails: bool,
}

impl Default for Parser {
    fn default() -> Self {
        Self { within: Within::Nothing, number: Vec::new(), terminator: ETX, fails: false }
    }
}

impl Parser {
    /// The next mnemonic is read as one that it does not know.
    pub(super) fn fail_next(&mut self) {
        self.fails = true;
    }

    /// Takes a byte; the parts that it completes.
    pub(super) fn take(&mut self, byte: u8) -> Vec<Part> {
        let mut parts = Vec::new();
        match std::mem::take(&mut self.within) {
            Within::Label => {
                if byte != self.terminator {
                    self.within = Within::Label;
                }
            }
            Within::Terminator => self.terminator = if byte == b';' { ETX } else { byte },
            Within::Letter(first) if byte.is_ascii_alphabetic() => {
                let mnemonic =
                    if std::mem::take(&mut self.fails) { *b"??" } else { [first, byte.to_ascii_uppercase()] };
                self.within = match &mnemonic {
                    b"LB" => Within::Label,
                    b"DT" => Within::Terminator,
                    _ => Within::Numbers,
                };
                parts.push(Part::Mnemonic(mnemonic));
            }
            Within::Letter(first) if byte <= b' ' => self.within = Within::Letter(first),
            Within::Letter(_) => parts.extend([Part::Mnemonic(*b"??"), Part::End]),
            Within::Nothing if byte.is_ascii_alphabetic() => self.within = Within::Letter(byte.to_ascii_uppercase()),
            Within::Nothing if byte == b';' || byte <= b' ' => {}
            Within::Nothing => parts.extend([Part::Mnemonic(*b"??"), Part::End]),
            Within::Numbers => match byte {
                b'+' | b'-' | b'.' | b'0'..=b'9' => {
                    // A sign begins another number.
                    if matches!(byte, b'+' | b'-') && !self.number.is_empty() {
                        parts.extend(self.end_number());
                    }
                    if self.number.len() < DIGITS_MAX {
                        self.number.push(byte);
                    }
                    self.within = Within::Numbers;
                }
                b',' | ..=b' ' => {
                    parts.extend(self.end_number());
                    self.within = Within::Numbers;
                }
                b';' => {
                    parts.extend(self.end_number());
                    parts.push(Part::End);
                }
                _ if byte.is_ascii_alphabetic() => {
                    parts.extend(self.end_number());
                    parts.push(Part::End);
                    self.within = Within::Letter(byte.to_ascii_uppercase());
                }
                _ => {
                    self.number.clear();
                    parts.push(Part::Bad);
                    self.within = Within::Numbers;
                }
            },
        }
        parts
    }

    fn end_number(&mut self) -> Option<Part> {
        if self.number.is_empty() {
            return None;
        }
        let number = std::mem::take(&mut self.number);
        let number = String::from_utf8_lossy(&number).parse::<f64>();
        Some(number.map_or(Part::Bad, Part::Number))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hpgl_is_read_byte_by_byte() {
        let parts = |text: &str| {
            let mut parser = Parser::default();
            text.bytes().flat_map(|byte| parser.take(byte)).collect::<Vec<_>>()
        };
        use Part::{Bad, End, Mnemonic, Number};
        for (text, expected) in [
            ("IN;SP1;", vec![Mnemonic(*b"IN"), End, Mnemonic(*b"SP"), Number(1.0), End]),
            ("pd 1,-2PU", vec![Mnemonic(*b"PD"), Number(1.0), Number(-2.0), End, Mnemonic(*b"PU")]),
            ("PA1-2+3.5;", vec![Mnemonic(*b"PA"), Number(1.0), Number(-2.0), Number(3.5), End]),
            ("LBPD;\x03PU;", vec![Mnemonic(*b"LB"), Mnemonic(*b"PU"), End]),
            ("DT*;LBa;b*PU;", vec![Mnemonic(*b"DT"), Mnemonic(*b"LB"), Mnemonic(*b"PU"), End]),
            ("1;", vec![Mnemonic(*b"??"), End]),
            ("PA1.2.3,~;", vec![Mnemonic(*b"PA"), Bad, Bad, End]),
        ] {
            assert_eq!(parts(text), expected, "{text:?}");
        }
    }
}
