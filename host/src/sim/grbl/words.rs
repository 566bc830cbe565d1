//! The words of a block of G-code, as GRBL reads them.

/// Digits of a number that GRBL keeps.
const DIGITS_MAX: u32 = 8;

/// What GRBL answers as `error:n`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Refusal(pub(super) u8);

pub(super) const EXPECTED_LETTER: Refusal = Refusal(1);
pub(super) const BAD_NUMBER: Refusal = Refusal(2);
pub(super) const INVALID_STATEMENT: Refusal = Refusal(3);
pub(super) const NEGATIVE: Refusal = Refusal(4);
pub(super) const SETTING_DISABLED: Refusal = Refusal(5);
pub(super) const STEP_PULSE: Refusal = Refusal(6);
pub(super) const NOT_IDLE: Refusal = Refusal(8);
pub(super) const LOCKED: Refusal = Refusal(9);
pub(super) const SOFT_LIMIT_NEEDS_HOMING: Refusal = Refusal(10);
pub(super) const OVERFLOW: Refusal = Refusal(11);
pub(super) const TRAVEL_EXCEEDED: Refusal = Refusal(15);
pub(super) const INVALID_JOG: Refusal = Refusal(16);
pub(super) const UNSUPPORTED: Refusal = Refusal(20);
pub(super) const MODAL_GROUP: Refusal = Refusal(21);
pub(super) const NO_FEED: Refusal = Refusal(22);
pub(super) const NOT_WHOLE: Refusal = Refusal(23);
pub(super) const AXIS_CONFLICT: Refusal = Refusal(24);
pub(super) const REPEATED: Refusal = Refusal(25);
pub(super) const NO_AXIS_WORDS: Refusal = Refusal(26);
pub(super) const LINE_NUMBER: Refusal = Refusal(27);
pub(super) const VALUE_MISSING: Refusal = Refusal(28);
pub(super) const COORDINATE_SYSTEM: Refusal = Refusal(29);
pub(super) const G53_MODE: Refusal = Refusal(30);
pub(super) const AXIS_WORDS: Refusal = Refusal(31);
pub(super) const NO_AXIS_IN_PLANE: Refusal = Refusal(32);
pub(super) const INVALID_TARGET: Refusal = Refusal(33);
pub(super) const ARC_RADIUS: Refusal = Refusal(34);
pub(super) const NO_OFFSETS: Refusal = Refusal(35);
pub(super) const UNUSED_WORDS: Refusal = Refusal(36);
pub(super) const TOOL_LENGTH_AXIS: Refusal = Refusal(37);

/// A number at the beginning of the text, in single precision with GRBL's rounding, and what follows it; none when there is no digit.
pub(super) fn number(text: &[u8]) -> Option<(f32, &[u8])> {
    let mut at = 0;
    let negative = text.first() == Some(&b'-');
    if negative || text.first() == Some(&b'+') {
        at = 1;
    }
    let (mut digits, mut value, mut exponent, mut point) = (0_u32, 0_u32, 0_i32, false);
    while let Some(&byte) = text.get(at) {
        match byte {
            b'0'..=b'9' => {
                digits += 1;
                if digits <= DIGITS_MAX {
                    exponent -= i32::from(point);
                    value = value * 10 + u32::from(byte - b'0');
                } else {
                    exponent += i32::from(!point);
                }
            }
            b'.' if !point => point = true,
            _ => break,
        }
        at += 1;
    }
    if digits == 0 {
        return None;
    }
    let mut result = value as f32;
    while exponent <= -2 {
        result *= 0.01;
        exponent += 2;
    }
    if exponent < 0 {
        result *= 0.1;
    }
    for _ in 0..exponent {
        result *= 10.0;
    }
    Some((if negative { -result } else { result }, text.get(at..).unwrap_or_default()))
}

/// A letter with its number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Word {
    pub(super) letter: u8,
    pub(super) value: f32,
}

impl Word {
    /// The whole part of a command's number, and its hundredths: G38.2 is 38 and 20.
    pub(super) fn command(self) -> (i32, i32) {
        let whole = self.value.trunc();
        (whole as i32, (100.0 * (self.value - whole)).round() as i32)
    }
}

/// The words of a line that is in capitals and without blanks and comments.
pub(super) fn words(line: &[u8]) -> Result<Vec<Word>, Refusal> {
    let mut rest = line;
    let mut words = Vec::new();
    while let Some((&letter, after)) = rest.split_first() {
        if !letter.is_ascii_uppercase() {
            return Err(EXPECTED_LETTER);
        }
        let (value, after) = number(after).ok_or(BAD_NUMBER)?;
        words.push(Word { letter, value });
        rest = after;
    }
    Ok(words)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_by_an_eight_bit_controller() {
        for (text, value, rest) in [
            ("1.5Y", 1.5, "Y"),
            ("-0.25", -0.25, ""),
            ("+7", 7.0, ""),
            (".5", 0.5, ""),
            ("3.", 3.0, ""),
            ("1.2.3", 1.2, ".3"),
            ("123456789", 123_456_780.0, ""),
            ("1E3", 1.0, "E3"),
        ] {
            let (got, after) = number(text.as_bytes()).unwrap();
            assert!((got - value).abs() <= value.abs() * 1e-6, "{text}: {got}");
            assert_eq!(after, rest.as_bytes(), "{text}");
        }
        for text in ["", "-", ".", "X1", "--1"] {
            assert!(number(text.as_bytes()).is_none(), "{text}");
        }
    }

    #[test]
    fn lines_are_cut_into_words() {
        assert_eq!(words(b"G1X-2").unwrap(), [Word { letter: b'G', value: 1.0 }, Word { letter: b'X', value: -2.0 }]);
        for (line, refusal) in
            [("#", EXPECTED_LETTER), ("G1X", BAD_NUMBER), ("GX1", BAD_NUMBER), ("G1X1#", EXPECTED_LETTER)]
        {
            assert_eq!(words(line.as_bytes()), Err(refusal), "{line}");
        }
        assert_eq!(Word { letter: b'G', value: 38.2 }.command(), (38, 20));
    }
}
