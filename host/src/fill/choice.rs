//! What fill is asked for.

use penvis_core::extract::adaptive::Direction;

use super::{Fill, FillKind};

/// Smallest pitch in mm: a tenth of what the finest pens draw.
const FINEST_MM: f64 = 0.01;

/// Largest pitch and gap in mm.
const LONGEST_MM: f64 = 1000.0;

/// Distance of lines in mm when nothing is said of it, and no tone has to be made.
const USUAL_PITCH_MM: f64 = 1.0;

/// Angle of lines in degrees when nothing is said of it.
const USUAL_DEGREES: f64 = 45.0;

/// What is asked of the fill of a surface; what is left open is for others to say.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FillChoice {
    /// What it is made of; `Some(None)` for nothing.
    pub kind: Option<Option<FillKind>>,
    /// Angle of its lines in degrees, counter-clockwise from the lower side of the sheet.
    pub degrees: Option<f64>,
    /// Distance of its lines in mm.
    pub pitch_mm: Option<f64>,
    /// Distance that they keep from outlines in mm.
    pub gap_mm: Option<f64>,
    /// Which isocurves they are.
    pub direction: Option<Direction>,
}

impl FillChoice {
    /// This choice, and what it leaves open as another one says.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            kind: self.kind.or(other.kind),
            degrees: self.degrees.or(other.degrees),
            pitch_mm: self.pitch_mm.or(other.pitch_mm),
            gap_mm: self.gap_mm.or(other.gap_mm),
            direction: self.direction.or(other.direction),
        }
    }

    /// The fill, if one is asked for, for a pen with a number and so wide in mm. Lines that make a tone are by default twice as far apart where it is darkest, and the gap is half
    /// that width; lines along contours are as far from these as from one another.
    #[must_use]
    pub fn settle(self, pen: u32, pen_width_mm: f64, toned: bool) -> Option<Fill> {
        let kind = self.kind.flatten()?;
        let usual = if toned { (2.0 * pen_width_mm).max(FINEST_MM) } else { USUAL_PITCH_MM };
        let pitch_mm = self.pitch_mm.unwrap_or(usual);
        let gap_mm = self.gap_mm.unwrap_or(match kind {
            FillKind::Hatch | FillKind::Cross | FillKind::Iso => pen_width_mm / 2.0,
            FillKind::Contour => pitch_mm,
        });
        // Fills that differ in nothing that shows are one.
        let degrees = match kind {
            FillKind::Hatch | FillKind::Cross => self.degrees.unwrap_or(USUAL_DEGREES),
            FillKind::Contour | FillKind::Iso => 0.0,
        };
        let direction = self.direction.filter(|_| kind == FillKind::Iso).unwrap_or_default();
        Some(Fill { kind, degrees, pitch_mm, gap_mm, direction, pen })
    }
}

/// The kind with a name; `None` for `none`.
///
/// # Errors
/// What is wrong with a name that is none.
pub(crate) fn kind(word: &str) -> Result<Option<FillKind>, String> {
    match word {
        "hatch" => Ok(Some(FillKind::Hatch)),
        "cross" => Ok(Some(FillKind::Cross)),
        "contour" => Ok(Some(FillKind::Contour)),
        "iso" => Ok(Some(FillKind::Iso)),
        "none" => Ok(None),
        _ => Err("is not one of hatch, cross, contour, iso, none".into()),
    }
}

/// The isocurves with a name.
///
/// # Errors
/// What is wrong with a name that is none.
pub(crate) fn direction(word: &str) -> Result<Direction, &'static str> {
    match word {
        "u" => Ok(Direction::U),
        "v" => Ok(Direction::V),
        "both" => Ok(Direction::Both),
        "auto" => Ok(Direction::Auto),
        _ => Err("is not one of u, v, both, auto"),
    }
}

/// Whether lines can be so far apart, and what is asked for otherwise.
pub(crate) fn is_pitch(mm: f64) -> bool {
    (FINEST_MM..=LONGEST_MM).contains(&mm)
}

/// What [`is_pitch`] asks for.
pub(crate) const A_PITCH: &str = "a distance in mm from 0.01 to 1000";

/// Whether a gap can be so wide.
pub(crate) fn is_gap(mm: f64) -> bool {
    (0.0..=LONGEST_MM).contains(&mm)
}

/// What [`is_gap`] asks for.
pub(crate) const A_GAP: &str = "a width in mm from 0 to 1000";

/// Whether lines can be drawn at an angle in degrees.
pub(crate) fn is_angle(degrees: f64) -> bool {
    (-360.0..=360.0).contains(&degrees)
}

/// What [`is_angle`] asks for.
pub(crate) const AN_ANGLE: &str = "an angle from -360 to 360 degrees";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_open_is_as_the_other_says_or_as_usual() {
        let above = FillChoice { degrees: Some(30.0), ..FillChoice::default() };
        let below = FillChoice { kind: Some(Some(FillKind::Cross)), degrees: Some(10.0), ..FillChoice::default() };
        let fill = above.or(below).settle(3, 0.4, false).unwrap();
        assert_eq!(
            fill,
            Fill {
                kind: FillKind::Cross,
                degrees: 30.0,
                pitch_mm: 1.0,
                gap_mm: 0.2,
                direction: Direction::Auto,
                pen: 3
            }
        );
        assert_eq!(below.settle(3, 0.4, true).unwrap().pitch_mm, 0.8);
        let rings = FillChoice { kind: Some(Some(FillKind::Contour)), ..FillChoice::default() };
        assert_eq!(rings.settle(3, 0.4, true).map(|fill| (fill.pitch_mm, fill.gap_mm)), Some((0.8, 0.8)));
        // Nothing is a kind too, which another choice does not change.
        let none = FillChoice { kind: Some(None), ..FillChoice::default() };
        assert_eq!((none.or(below).settle(3, 0.4, true), above.settle(3, 0.4, true)), (None, None));
    }
}
