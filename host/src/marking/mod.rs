//! What is drawn on a sheet beside the picture: registration marks, and a title.

mod text;

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec2;
use thiserror::Error;

use crate::drawing::{Page, Polyline};

/// Layer of the registration marks.
pub const MARKS_LAYER: &str = "marks";

/// Layer of the title.
pub const TITLE_LAYER: &str = "title";

/// Width and height of a mark in mm.
const MARK_MM: f64 = 5.0;

/// Height of capitals of the title in mm.
const CAPITAL_MM: f64 = 3.0;

/// How far letters reach below their line, as a part of the height of capitals.
const BELOW: f64 = 1.0 / 3.0;

/// Room in mm between marks, title and picture.
const GAP_MM: f64 = 2.0;

/// Why a sheet cannot be marked.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum MarkError {
    /// The sheet is too small.
    #[error(
        "--marks: the margins leave {width_mm} × {height_mm} mm, too little for marks of {MARK_MM} mm; give a smaller --margin, or no marks"
    )]
    NoRoom {
        /// Width inside the margins in mm.
        width_mm: f64,
        /// Height inside the margins in mm.
        height_mm: f64,
    },
    /// The title is too long.
    #[error("--title: is {width_mm:.0} mm long, and there are {room_mm:.0} mm for it; make it shorter")]
    Long {
        /// Its width in mm.
        width_mm: f64,
        /// The room in mm.
        room_mm: f64,
    },
    /// A character that there is no letter for.
    #[error("--title: there is no letter for {character:?}; write it in the characters of ASCII")]
    Letter {
        /// The character.
        character: char,
    },
}

/// What is drawn on a sheet beside the picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Marking {
    /// A cross in each corner inside the margins, by each pen that draws anything, so that sheets and pens can be brought into register.
    pub marks: bool,
    /// A line of text at the lower left inside the margins.
    pub title: Option<String>,
    /// Pens said for the layers [`marks`](MARKS_LAYER) and [`title`](TITLE_LAYER). Marks have all that are used otherwise, and a title the first of these.
    pub pens: BTreeMap<String, u32>,
}

impl Marking {
    /// How much of the sheet it takes inside the margins on each side, in mm.
    #[must_use]
    pub fn band_mm(&self) -> f64 {
        match (self.marks, &self.title) {
            (true, _) => MARK_MM + GAP_MM,
            (false, Some(_)) => CAPITAL_MM * (1.0 + BELOW) + GAP_MM,
            (false, None) => 0.0,
        }
    }

    /// Its strokes on a sheet with margins, beside these of a picture.
    ///
    /// # Errors
    /// [`MarkError`].
    pub fn strokes(&self, picture: &[Polyline], page: Page, margin_mm: f64) -> Result<Vec<Polyline>, MarkError> {
        let said = |layer: &str| self.pens.get(layer).copied();
        let mut used: BTreeSet<u32> = picture.iter().map(|polyline| polyline.pen).collect();
        let title_pen = said(TITLE_LAYER).or(used.first().copied()).unwrap_or(1);
        if self.title.is_some() {
            used.insert(title_pen);
        }
        let low = DVec2::splat(margin_mm);
        let high = DVec2::new(page.width_mm, page.height_mm) - low;
        let room = high - low;
        let mut strokes = Vec::new();
        if self.marks {
            // Two beside each other, and not one in the other.
            if !(room.x >= 2.0 * MARK_MM && room.y >= 2.0 * MARK_MM) {
                return Err(MarkError::NoRoom { width_mm: room.x, height_mm: room.y });
            }
            let pens = said(MARKS_LAYER).map_or_else(|| used.iter().copied().collect(), |pen| vec![pen]);
            let half = MARK_MM / 2.0;
            let (left, right) = (low + half, high - half);
            let corners = [left, DVec2::new(right.x, left.y), right, DVec2::new(left.x, right.y)];
            for pen in pens {
                for corner in corners {
                    for arm in [DVec2::X * half, DVec2::Y * half] {
                        strokes.push(Polyline::stroke(MARKS_LAYER, pen, vec![corner - arm, corner + arm]));
                    }
                }
            }
        }
        if let Some(title) = &self.title {
            let (lines, width_mm) =
                text::strokes(title, CAPITAL_MM).map_err(|character| MarkError::Letter { character })?;
            let aside = if self.marks { MARK_MM + GAP_MM } else { 0.0 };
            let room_mm = (room.x - 2.0 * aside).max(0.0);
            if width_mm > room_mm {
                return Err(MarkError::Long { width_mm, room_mm });
            }
            let at = low + DVec2::new(aside, CAPITAL_MM * BELOW);
            strokes.extend(
                lines
                    .into_iter()
                    .map(|line| Polyline::stroke(TITLE_LAYER, title_pen, line.into_iter().map(|p| at + p).collect())),
            );
        }
        Ok(strokes)
    }
}

#[cfg(test)]
mod tests {
    use penvis_core::stroke::CurveKind::Iso;

    use super::*;
    use crate::emit::tests::polyline;

    const PAGE: Page = Page { width_mm: 200.0, height_mm: 100.0 };

    fn picture() -> Vec<Polyline> {
        [3, 2, 3].map(|pen| polyline(Iso, pen, &[[50.0, 50.0], [60.0, 50.0]])).to_vec()
    }

    #[test]
    fn every_pen_that_is_used_makes_marks_in_the_corners() {
        let marking = Marking { marks: true, ..Marking::default() };
        let found = marking.strokes(&picture(), PAGE, 10.0).unwrap();
        assert_eq!(found.len(), 2 * 4 * 2);
        assert_eq!(found.iter().filter(|p| p.pen == 2).count(), 8);
        assert_eq!(found[0].page, [DVec2::new(10.0, 12.5), DVec2::new(15.0, 12.5)]);
        assert!(
            found.iter().flat_map(|p| &p.page).all(|p| (10.0..=190.0).contains(&p.x) && (10.0..=90.0).contains(&p.y))
        );
        let one = Marking { pens: BTreeMap::from([("marks".into(), 7)]), ..marking.clone() };
        let found = one.strokes(&picture(), PAGE, 10.0).unwrap();
        assert!(found.len() == 8 && found.iter().all(|p| p.pen == 7 && p.layer == "marks"));
        assert!(matches!(marking.strokes(&picture(), PAGE, 46.0), Err(MarkError::NoRoom { .. })));
        assert!(Marking::default().strokes(&picture(), PAGE, 10.0).unwrap().is_empty());
    }

    #[test]
    fn a_title_is_within_the_band_below_the_picture() {
        for marks in [false, true] {
            let marking = Marking { marks, title: Some("gjpqy| 1:2".into()), ..Marking::default() };
            let found = marking.strokes(&picture(), PAGE, 10.0).unwrap();
            let title: Vec<&Polyline> = found.iter().filter(|p| p.layer == "title").collect();
            assert!(title.len() > 8 && title.iter().all(|p| p.pen == 2));
            for p in title.iter().flat_map(|p| &p.page) {
                assert!(p.x >= 10.0 && p.x < 60.0 && p.y >= 10.0 - 1e-9 && p.y < 10.0 + marking.band_mm(), "{p}");
            }
        }
        let title = |text: &str| {
            let marking = Marking { title: Some(text.into()), ..Marking::default() };
            marking.strokes(&picture(), PAGE, 10.0).unwrap_err().to_string()
        };
        assert!(title(&"long ".repeat(30)).contains("there are 180 mm for it"));
        assert!(title("naïve").contains("no letter for 'ï'"));
    }
}
