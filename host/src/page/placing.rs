//! How large a picture is made, and where it is put on the sheet.

use glam::DVec2;

/// Units of length on paper, in mm (ISO 1000; an inch is 25.4 mm by definition).
const UNITS: [(&str, f64); 3] = [("mm", 1.0), ("cm", 10.0), ("in", 25.4)];

/// Longest length in mm that a user means, either way. A larger one is a slip of the keyboard.
const LONGEST_MM: f64 = 10_000.0;

/// How large the picture is made.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Size {
    /// As large as the margins allow.
    #[default]
    Fit,
    /// So many mm of paper for a unit of the model, which is a millimetre where the model says what its units are. In perspective that holds in
    /// the plane through the point that the eye looks at.
    Scale(f64),
    /// So wide in mm.
    Width(f64),
    /// So high in mm.
    Height(f64),
}

/// Where the picture is put.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Position {
    /// Into the middle of the sheet.
    #[default]
    Centre,
    /// Its lower left corner at this place of the sheet, in mm from the lower left corner.
    At(DVec2),
}

/// Size and place of a picture on the sheet, and what becomes of what is too large.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Placing {
    /// How large.
    pub size: Size,
    /// Where.
    pub position: Position,
    /// Whether what lies beyond the margins is cut off; otherwise a picture that does not fit is refused.
    pub clip: bool,
}

/// The length in mm that a text says: a number of mm, cm or in, of mm if there is no unit. None if it is no length, or none that fits any paper.
#[must_use]
pub fn length_mm(text: &str) -> Option<f64> {
    let text = text.trim();
    let unit = UNITS.iter().find_map(|&(name, mm)| Some((text.strip_suffix(name)?, mm)));
    let (number, mm) = unit.unwrap_or((text, 1.0));
    let length = number.trim_end().parse::<f64>().ok()? * mm;
    (length.abs() <= LONGEST_MM).then_some(length)
}

/// The scale that a text says, as mm of paper for a mm of the model: a ratio `paper:model` such as `1:2`, or its value. None if it is no positive ratio.
#[must_use]
pub fn scale(text: &str) -> Option<f64> {
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|n| n.is_finite() && *n > 0.0);
    let value = match text.split_once(':') {
        Some((paper, model)) => number(paper)? / number(model)?,
        None => number(text)?,
    };
    (value.is_finite() && value > 0.0).then_some(value)
}

/// The position that a text says: `center`, or `X,Y`, each a [length](length_mm). None if it is neither.
#[must_use]
pub fn position(text: &str) -> Option<Position> {
    if text.trim().eq_ignore_ascii_case("center") {
        return Some(Position::Centre);
    }
    let (x, y) = text.split_once(',')?;
    Some(Position::At(DVec2::new(length_mm(x)?, length_mm(y)?)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_have_units() {
        let table =
            [("120", 120.0), ("120mm", 120.0), (" 12.5 cm ", 125.0), ("2in", 50.8), ("-3mm", -3.0), ("1e2", 100.0)];
        for (text, mm) in table {
            assert_eq!(length_mm(text), Some(mm), "{text}");
        }
        for bad in ["", "mm", "12 ft", "nan", "inf", "1e9", "1,5", "12mmm"] {
            assert_eq!(length_mm(bad), None, "{bad}");
        }
    }

    #[test]
    fn scales_are_ratios_or_their_values() {
        for (text, value) in [("1:2", 0.5), ("2:1", 2.0), ("0.25", 0.25), (" 1 : 50 ", 0.02)] {
            assert_eq!(scale(text), Some(value), "{text}");
        }
        for bad in ["", "1:", ":2", "0", "1:0", "-1:2", "nan", "1:inf", "1e308:1e-308", "1:2:3", "a:b"] {
            assert_eq!(scale(bad), None, "{bad}");
        }
    }

    #[test]
    fn positions_are_the_centre_or_two_lengths() {
        assert_eq!(position("Center"), Some(Position::Centre));
        assert_eq!(position("20mm, 3cm"), Some(Position::At(DVec2::new(20.0, 30.0))));
        for bad in ["", "20", "20,", "20,30,40", "left", "nan,1"] {
            assert_eq!(position(bad), None, "{bad}");
        }
    }
}
