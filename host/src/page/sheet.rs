//! Sizes of paper.

use thiserror::Error;

use crate::drawing::Page;

/// Sheets by name, upright: width and height in mm (ISO 216; ANSI/ASME Y14.1 in whole tenths).
const SHEETS: &[(&str, f64, f64)] = &[
    ("a5", 148.0, 210.0),
    ("a4", 210.0, 297.0),
    ("a3", 297.0, 420.0),
    ("a2", 420.0, 594.0),
    ("letter", 215.9, 279.4),
    ("legal", 215.9, 355.6),
];

/// Longest side of a sheet in mm. A larger number is a slip of the keyboard, and no plotter here reaches so far.
const LONGEST_MM: f64 = 10_000.0;

/// Which way a sheet is held.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Orientation {
    /// The long side runs from left to right.
    Landscape,
    /// The long side runs from bottom to top.
    Portrait,
}

/// A paper that is neither a name nor a size.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("there is no paper `{paper}`; give one of {names}, or a size such as 200x150mm", names = names())]
pub struct SheetError {
    /// What was asked for.
    pub paper: String,
}

fn names() -> String {
    SHEETS.iter().map(|sheet| sheet.0).collect::<Vec<_>>().join(", ")
}

/// The sheet of this name or size (`WxHmm`, `WxH`; mm). A named sheet lies in landscape unless told otherwise; a size is
/// taken as it is written unless an orientation is asked for.
///
/// # Errors
/// [`SheetError`] for an unknown name, or a side that is not between 1 mm and 10 m.
pub fn sheet(paper: &str, orientation: Option<Orientation>) -> Result<Page, SheetError> {
    let wanted = paper.trim().to_ascii_lowercase();
    let error = || SheetError { paper: paper.to_owned() };
    let (named, (a, b)) = match SHEETS.iter().find(|sheet| sheet.0 == wanted) {
        Some(&(_, width, height)) => (true, (width, height)),
        None => (false, size(&wanted).ok_or_else(error)?),
    };
    let (width_mm, height_mm) = match orientation {
        Some(Orientation::Portrait) => (a.min(b), a.max(b)),
        None if !named => (a, b),
        Some(Orientation::Landscape) | None => (a.max(b), a.min(b)),
    };
    Ok(Page { width_mm, height_mm })
}

fn size(text: &str) -> Option<(f64, f64)> {
    let (width, height) = text.strip_suffix("mm").unwrap_or(text).split_once(['x', '×'])?;
    let side = |text: &str| {
        let mm: f64 = text.trim().trim_end_matches("mm").trim().parse().ok()?;
        (1.0..=LONGEST_MM).contains(&mm).then_some(mm)
    };
    Some((side(width)?, side(height)?))
}

/// Margin in mm that is kept when none is asked for: 15, which every built-in plotter reaches, but at most a tenth of the
/// shorter side.
#[must_use]
pub fn default_margin_mm(page: Page) -> f64 {
    (page.width_mm.min(page.height_mm) / 10.0).min(15.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_sizes() {
        use Orientation::{Landscape, Portrait};
        let table: &[(&str, Option<Orientation>, f64, f64)] = &[
            ("a4", None, 297.0, 210.0),
            ("A3", Some(Landscape), 420.0, 297.0),
            ("a5", Some(Portrait), 148.0, 210.0),
            ("letter", None, 279.4, 215.9),
            ("200x150mm", None, 200.0, 150.0),
            ("150x200", None, 150.0, 200.0),
            ("150mm x 200.5mm", Some(Landscape), 200.5, 150.0),
            ("200x150", Some(Portrait), 150.0, 200.0),
        ];
        for &(paper, orientation, width_mm, height_mm) in table {
            assert_eq!(sheet(paper, orientation), Ok(Page { width_mm, height_mm }), "{paper} {orientation:?}");
        }
        for bad in ["", "a9", "x", "10x", "0x10", "-5x5", "nanx10", "infx10", "1e9x10", "10x10x10"] {
            assert!(sheet(bad, None).is_err(), "{bad}");
        }
        assert!(sheet("b4", None).unwrap_err().to_string().contains("a4, a3"));
    }
}
