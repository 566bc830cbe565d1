//! `PE`: coordinates in base 64 or 32, each in as few bytes as it needs.
//!
//! A number is digits, the least significant first; the last is told from the others by its range. Its lowest bit is the sign. `>` and a number set the
//! binary places of those that follow, `:` and a number take a pen, `<` moves to the next point with the pen up, `=` has that point absolute, and `7` changes to base 32,
//! which needs no eighth bit.

/// Digits of a number: more than any plotter's coordinates.
const BITS: u32 = 48;

/// What a byte has completed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Piece {
    /// Nothing.
    None,
    /// A point: where, whether that is absolute, and whether the pen is down on the way.
    Point {
        /// In the units of coordinates.
        at: [f64; 2],
        /// Whether it is a place; else it is an increment.
        absolute: bool,
        /// Whether the pen draws on the way there.
        down: bool,
    },
    /// A pen.
    Pen(f64),
    /// Something that does not belong there.
    Bad,
}

/// What the next number is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Next {
    #[default]
    Coordinate,
    Pen,
    Places,
}

/// Reads one `PE`, byte by byte.
#[derive(Clone, Copy, Debug, Default)]
pub struct Encoded {
    base32: bool,
    places: i32,
    next: Next,
    up: bool,
    absolute: bool,
    value: u64,
    bits: u32,
    x: Option<f64>,
}

impl Encoded {
    /// Takes a byte of the instruction, after the mnemonic and before `;`, and tells what it completes.
    pub fn take(&mut self, byte: u8) -> Piece {
        // In base 32 the eighth bit is the line's.
        let byte = if self.base32 { byte & 0x7f } else { byte };
        match byte {
            // Between numbers only; within one, no digit is any of these.
            b'7' => self.base32 = true,
            b':' => self.next = Next::Pen,
            b'>' => self.next = Next::Places,
            b'<' => self.up = true,
            b'=' => self.absolute = true,
            // These stand for nothing, wherever they are.
            0..=b' ' | 127..=160 | 255 => return Piece::None,
            _ => return self.digit(byte),
        }
        if self.bits > 0 {
            (self.bits, self.value) = (0, 0);
            return Piece::Bad;
        }
        Piece::None
    }

    fn digit(&mut self, byte: u8) -> Piece {
        let (digit, last) = match (self.base32, byte) {
            (false, 63..=126) => (byte - 63, false),
            (false, 191..=254) => (byte - 191, true),
            (true, 63..=94) => (byte - 63, false),
            (true, 95..=126) => (byte - 95, true),
            _ => return Piece::Bad,
        };
        let width = if self.base32 { 5 } else { 6 };
        if self.bits + width > BITS {
            (self.bits, self.value) = (0, 0);
            return Piece::Bad;
        }
        self.value |= u64::from(digit) << self.bits;
        self.bits += width;
        if !last {
            return Piece::None;
        }
        self.bits = 0;
        let code = core::mem::take(&mut self.value);
        let magnitude = (code >> 1) as f64;
        self.number(if code & 1 == 1 { -magnitude } else { magnitude })
    }

    fn number(&mut self, value: f64) -> Piece {
        match core::mem::take(&mut self.next) {
            Next::Pen => Piece::Pen(value),
            Next::Places if value.abs() <= 26.0 => {
                self.places = value as i32;
                Piece::None
            }
            Next::Places => Piece::Bad,
            Next::Coordinate => {
                let value = libm::ldexp(value, -self.places);
                let Some(x) = self.x.take() else {
                    self.x = Some(value);
                    return Piece::None;
                };
                let absolute = core::mem::take(&mut self.absolute);
                let down = !core::mem::take(&mut self.up);
                Piece::Point { at: [x, value], absolute, down }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use proptest::prelude::*;

    use super::*;

    /// A number as the other side writes it.
    fn encode(n: i64, base32: bool) -> Vec<u8> {
        let mut code = (n.unsigned_abs() << 1) | u64::from(n < 0);
        let (shift, last) = if base32 { (5, 95) } else { (6, 191) };
        let mut bytes = Vec::new();
        while code >> shift > 0 {
            bytes.push(63 + (code & ((1 << shift) - 1)) as u8);
            code >>= shift;
        }
        bytes.push(last + code as u8);
        bytes
    }

    fn pieces(bytes: &[u8]) -> Vec<Piece> {
        let mut encoded = Encoded::default();
        let mut pieces: Vec<Piece> = bytes.iter().map(|b| encoded.take(*b)).collect();
        pieces.retain(|p| *p != Piece::None);
        pieces
    }

    #[test]
    fn flags() {
        let n = |v| encode(v, false);
        let bytes = [&b":"[..], &n(2), b"<=", &n(10), &n(-20), b">", &n(2), &n(6), &n(-1)].concat();
        assert_eq!(
            pieces(&bytes),
            [
                Piece::Pen(2.0),
                Piece::Point { at: [10.0, -20.0], absolute: true, down: false },
                Piece::Point { at: [1.5, -0.25], absolute: false, down: true },
            ]
        );
        assert_eq!(pieces(&[0x80]), []);
        assert_eq!(pieces(&[0xaa]), [Piece::Bad]);
        let point = Piece::Point { at: [20.0, 0.0], absolute: false, down: true };
        assert_eq!(pieces(&[b'7', 63 + 8, b'\r', 95 + 1 + 128, 95]), [point], "a line's own bytes and bits");
        assert_eq!(pieces(&[63; 9]), [Piece::Bad], "no number is that long");
        assert_eq!(pieces(&[64, b'<']), [Piece::Bad], "in the middle of a number");
    }

    proptest! {
        #[test]
        fn numbers_read_back(x in -8_388_607..8_388_607i64, y in -8_388_607..8_388_607i64, base32: bool) {
            let flag: &[u8] = if base32 { b"7" } else { b"" };
            let bytes = [flag, &encode(x, base32), &encode(y, base32)].concat();
            prop_assert_eq!(pieces(&bytes), [Piece::Point { at: [x as f64, y as f64], absolute: false, down: true }]);
        }

        #[test]
        fn any_bytes_are_read(bytes in prop::collection::vec(any::<u8>(), 0..60)) {
            for piece in pieces(&bytes) {
                if let Piece::Point { at, .. } = piece {
                    prop_assert!(at.iter().all(|v| v.is_finite()));
                }
            }
        }
    }
}
