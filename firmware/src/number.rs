//! Decimal numbers in and out without the standard float formatting, which would cost a board tens of kilobytes of flash.

use core::fmt;

/// Powers of ten that f64 holds exactly.
const POW10: [f64; 19] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18];

/// Reads `[+-]digits[.digits]` at the start of `text` and returns the value and the rest.
///
/// The value is the f64 nearest to the decimal (one correctly rounded division of exact numbers) for up to 15 digits;
/// fractional digits beyond 18 in all are dropped. There is no exponent: `E` is a letter, as in GRBL.
/// `None` when there is no digit or the integer part has more than 18 digits.
pub(crate) fn parse(text: &[u8]) -> Option<(f64, &[u8])> {
    let mut at = 0;
    let negative = match text.first() {
        Some(b'-') => {
            at = 1;
            true
        }
        Some(b'+') => {
            at = 1;
            false
        }
        _ => false,
    };
    let (mut mantissa, mut digits, mut places, mut point, mut any) = (0u64, 0u32, 0usize, false, false);
    while let Some(&c) = text.get(at) {
        match c {
            b'0'..=b'9' => {
                any = true;
                if digits < 18 {
                    mantissa = mantissa * 10 + u64::from(c - b'0');
                    digits += u32::from(mantissa != 0);
                    places += usize::from(point);
                } else if !point {
                    return None;
                }
                if places == POW10.len() - 1 {
                    // 18 places of zeros and digits: what follows is below 1e-18.
                    digits = 18;
                }
            }
            b'.' if !point => point = true,
            _ => break,
        }
        at += 1;
    }
    if !any {
        return None;
    }
    let value = mantissa as f64 / POW10.get(places).copied().unwrap_or(1e18);
    Some((if negative { -value } else { value }, text.get(at..).unwrap_or(&[])))
}

/// Writes `value` with `decimals` (at most 6) places, rounded half away from zero; saturates beyond ±9.2e18 units of the last place.
pub(crate) fn write_fixed(out: &mut impl fmt::Write, value: f64, decimals: u8) -> fmt::Result {
    let decimals = usize::from(decimals.min(6));
    let scale = POW10.get(decimals).copied().unwrap_or(1.0);
    let scaled = libm::round(value * scale) as i64;
    let unit = scale as u64;
    let (whole, part) = (scaled.unsigned_abs() / unit, scaled.unsigned_abs() % unit);
    if scaled < 0 {
        out.write_char('-')?;
    }
    write!(out, "{whole}")?;
    if decimals > 0 {
        write!(out, ".{part:0decimals$}")?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fixed(value: f64, decimals: u8) -> heapless::String<32> {
        let mut s = heapless::String::new();
        write_fixed(&mut s, value, decimals).unwrap();
        s
    }

    #[test]
    fn reads_decimals_to_the_nearest_double() {
        for (text, value) in [
            ("123.456", 123.456),
            ("-0.1", -0.1),
            ("+.5", 0.5),
            ("7.", 7.0),
            ("0000000000000000000000012.25", 12.25),
            ("0.0000000000000000000001", 0.0),
            ("0.30000000000000000000000000004", 0.3),
        ] {
            let (got, rest) = parse(text.as_bytes()).unwrap();
            assert_eq!((got, rest.len()), (value, 0), "{text}");
        }
        assert_eq!(parse(b"1.2.3").unwrap(), (1.2, &b".3"[..]));
        assert_eq!(parse(b"5E3").unwrap(), (5.0, &b"E3"[..]));
        for bad in ["", "-", ".", "X", "1234567890123456789"] {
            assert!(parse(bad.as_bytes()).is_none(), "{bad}");
        }
    }

    #[test]
    fn writes_rounded_and_signed() {
        assert_eq!(fixed(0.0, 3), "0.000");
        assert_eq!(fixed(-0.0004, 3), "0.000");
        assert_eq!(fixed(-12.3456, 3), "-12.346");
        assert_eq!(fixed(999.9996, 3), "1000.000");
        assert_eq!(fixed(7.6, 0), "8");
    }

    proptest::proptest! {
        #[test]
        fn agrees_with_the_standard_parser(text in "[+-]?[0-9]{1,8}(\\.[0-9]{0,7})?") {
            let (got, rest) = parse(text.as_bytes()).unwrap();
            proptest::prop_assert_eq!(got, text.parse::<f64>().unwrap());
            proptest::prop_assert!(rest.is_empty());
        }
    }
}
