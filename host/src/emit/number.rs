//! Decimal numbers as files want them: short, exact, and without `-0`.

/// A whole number of 10^−`decimals` as a decimal fraction, without trailing zeros.
pub(super) fn fixed(units: i64, decimals: usize) -> String {
    let one = 10_u64.pow(decimals as u32);
    let magnitude = units.unsigned_abs();
    let sign = if units < 0 { "-" } else { "" };
    let (whole, part) = (magnitude / one, magnitude % one);
    if part == 0 {
        return format!("{sign}{whole}");
    }
    let digits = format!("{part:0decimals$}");
    format!("{sign}{whole}.{}", digits.trim_end_matches('0'))
}

/// A number rounded to `decimals` places, without trailing zeros.
pub(crate) fn decimal(value: f64, decimals: usize) -> String {
    let scale = 10_f64.powi(decimals as i32);
    // A cast saturates, and makes 0 of what is not a number.
    fixed((value * scale).round() as i64, decimals)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_rounded() {
        let table: &[(f64, usize, &str)] = &[
            (0.0, 3, "0"),
            (-0.0001, 3, "0"),
            (-0.0005, 3, "-0.001"),
            (1.5, 3, "1.5"),
            (-12.0305, 4, "-12.0305"),
            (0.05, 1, "0.1"),
            (99.9996, 3, "100"),
            (7.0, 0, "7"),
            (297.0, 4, "297"),
            (f64::NAN, 3, "0"),
        ];
        for &(value, decimals, text) in table {
            assert_eq!(decimal(value, decimals), text, "{value}");
        }
    }
}
