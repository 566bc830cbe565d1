//! How objects are drawn and on which sheet, as far as somebody says: a scene file, and above it the command line.

use std::collections::BTreeMap;

use penvis_core::extract::CurveSet;
use penvis_core::stroke::CurveKind;

use crate::drawing::Page;
use crate::fill::FillChoice;
use crate::marking::Marking;
use crate::page::{self, DashPattern, Hidden, KindPens, Orientation, Placing, Position, SheetError, Size};

/// Kinds of curve by the names that users give them; what fills surfaces comes last.
const KINDS: [(&str, CurveKind); 7] = [
    ("boundary", CurveKind::Boundary),
    ("crease", CurveKind::Crease),
    ("silhouette", CurveKind::Silhouette),
    ("iso", CurveKind::Iso),
    ("smooth", CurveKind::Smooth),
    ("intersection", CurveKind::Section),
    ("hatch", CurveKind::Hatch),
];

/// Largest number of a pen. Plotters hold eight, and people may swap some more by hand.
pub(crate) const MOST_PENS: u32 = 99;

/// Most isocurves a direction. More would not be told apart on paper.
pub(crate) const MOST_ISOS: u32 = 1000;

/// Sheet when none is asked for.
const DEFAULT_PAPER: &str = "a4";

/// Distance in mm between a curve and its polyline when none is asked for: a tenth of the width of the finest pens.
const DEFAULT_TOLERANCE_MM: f64 = 0.01;

/// What is asked of the drawing of an object; what is left open is for others to say.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StyleChoice {
    /// The kinds that are inked.
    pub curves: Option<CurveSet>,
    /// Isocurves a direction.
    pub isos: Option<u32>,
    /// Pens.
    pub pens: KindPens,
    /// What becomes of hidden curves.
    pub hidden: Option<Hidden>,
    /// What visible surfaces are filled with.
    pub fill: FillChoice,
}

impl StyleChoice {
    /// This choice, and what it leaves open as another one says.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        Self {
            curves: self.curves.or(other.curves),
            isos: self.isos.or(other.isos),
            pens: self.pens.or(other.pens),
            hidden: self.hidden.or(other.hidden),
            fill: self.fill.or(other.fill),
        }
    }
}

/// What is asked of the sheet and of what is on it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SheetChoice {
    /// Name or size; one that [`page::sheet`] knows.
    pub paper: Option<String>,
    /// Which way it is held.
    pub orientation: Option<Orientation>,
    /// Margin on all sides in mm, finite and not negative.
    pub margin_mm: Option<f64>,
    /// Largest distance in mm between a curve and its polyline, finite and positive.
    pub tolerance_mm: Option<f64>,
    /// How large the picture is made.
    pub size: Option<Size>,
    /// Where it is put.
    pub position: Option<Position>,
    /// Whether what lies beyond the margins is cut off.
    pub clip: Option<bool>,
    /// Whether there are registration marks.
    pub marks: Option<bool>,
    /// A title.
    pub title: Option<String>,
}

impl SheetChoice {
    /// This choice, and what it leaves open as another one says. A sheet goes with the way it is held.
    #[must_use]
    pub fn or(&self, other: &Self) -> Self {
        let below = if self.paper.is_some() { None } else { other.orientation };
        Self {
            paper: self.paper.clone().or_else(|| other.paper.clone()),
            orientation: self.orientation.or(below),
            margin_mm: self.margin_mm.or(other.margin_mm),
            tolerance_mm: self.tolerance_mm.or(other.tolerance_mm),
            size: self.size.or(other.size),
            position: self.position.or(other.position),
            clip: self.clip.or(other.clip),
            marks: self.marks.or(other.marks),
            title: self.title.clone().or_else(|| other.title.clone()),
        }
    }

    /// What is drawn beside the picture, with these pens for its layers.
    #[must_use]
    pub fn marking(&self, pens: BTreeMap<String, u32>) -> Marking {
        Marking { marks: self.marks.unwrap_or_default(), title: self.title.clone(), pens }
    }

    /// Size and place of the picture.
    #[must_use]
    pub fn placing(&self) -> Placing {
        Placing {
            size: self.size.unwrap_or_default(),
            position: self.position.unwrap_or_default(),
            clip: self.clip.unwrap_or_default(),
        }
    }

    /// Largest distance in mm between a curve and its polyline.
    #[must_use]
    pub fn settled_tolerance_mm(&self) -> f64 {
        self.tolerance_mm.unwrap_or(DEFAULT_TOLERANCE_MM)
    }

    /// The sheet and the margin on all sides in mm.
    ///
    /// # Errors
    /// If there is no such paper.
    pub fn settle(&self) -> Result<(Page, f64), SheetError> {
        let page = page::sheet(self.paper.as_deref().unwrap_or(DEFAULT_PAPER), self.orientation)?;
        Ok((page, self.margin_mm.unwrap_or_else(|| page::default_margin_mm(page))))
    }
}

/// The kind with a name.
///
/// # Errors
/// What is wrong with a name that is none.
pub(crate) fn kind(word: &str) -> Result<CurveKind, String> {
    named(word, &KINDS)
}

/// The kind with a name, among some.
fn named(word: &str, kinds: &[(&str, CurveKind)]) -> Result<CurveKind, String> {
    // The curves along trims are boundaries of the trimmed surface.
    let name = if word == "trim" { "boundary" } else { word };
    let known = kinds.iter().find(|(known, kind)| *known == name || kind.name() == name);
    let names = || kinds.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    known.map(|(_, kind)| *kind).ok_or_else(|| format!("`{word}` is not one of {}", names()))
}

/// The names of what has a pen: kinds, and what is hidden.
pub(crate) fn pen_names() -> [&'static str; KINDS.len() + 1] {
    let mut names = [page::HIDDEN_LAYER; KINDS.len() + 1];
    for (name, (kind, _)) in names.iter_mut().zip(KINDS) {
        *name = kind;
    }
    names
}

/// These pens, but for a kind or what is hidden, by its name.
///
/// # Errors
/// What is wrong with a name that is none.
pub(crate) fn with_pen(pens: KindPens, word: &str, pen: u32) -> Result<KindPens, String> {
    match word {
        page::HIDDEN_LAYER => Ok(pens.with_hidden(pen)),
        word => {
            kind(word).map(|kind| pens.with(kind, pen)).map_err(|problem| format!("{problem}, {}", page::HIDDEN_LAYER))
        }
    }
}

/// The set of kinds with these names.
///
/// # Errors
/// What is wrong with the first name that is none.
pub(crate) fn kinds<'a>(words: impl IntoIterator<Item = &'a str>) -> Result<CurveSet, String> {
    let mut set = CurveSet::NONE;
    let [curves @ .., (hatch, _)] = &KINDS;
    for word in words {
        if word == *hatch {
            return Err(format!(
                "`{word}` is no curve of a surface; a fill is asked for with --fill, or `fill` in a scene"
            ));
        }
        set.insert(named(word, curves)?);
    }
    Ok(set)
}

/// What becomes of hidden curves, by its name.
///
/// # Errors
/// What is wrong with the name.
pub(crate) fn hidden(word: &str) -> Result<Hidden, String> {
    match word {
        "omit" => Ok(Hidden::Omit),
        "dashed" => Ok(Hidden::Dashed(DashPattern::default())),
        "layer" => Ok(Hidden::Layer),
        _ => Err("is not one of omit, dashed, layer".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_open_is_as_the_other_says() {
        let above = StyleChoice { isos: Some(3), hidden: Some(Hidden::Omit), ..StyleChoice::default() };
        let below = StyleChoice {
            isos: Some(5),
            pens: KindPens::all(2),
            hidden: Some(Hidden::Layer),
            ..StyleChoice::default()
        };
        let both = above.or(below);
        assert_eq!(
            (both.isos, both.pens.only(), both.hidden, both.curves),
            (Some(3), Some(2), Some(Hidden::Omit), None)
        );
        let stated = SheetChoice {
            paper: Some("a5".into()),
            orientation: Some(Orientation::Portrait),
            margin_mm: Some(3.0),
            ..SheetChoice::default()
        };
        let size = |choice: &SheetChoice| choice.settle().map(|(page, margin)| (page.width_mm, margin)).unwrap();
        assert_eq!(size(&SheetChoice::default().or(&stated)), (148.0, 3.0));
        // The scene held its own sheet upright, not this one.
        let other = SheetChoice { paper: Some("a4".into()), ..SheetChoice::default() };
        assert_eq!(size(&other.or(&stated)), (297.0, 3.0));
        let turned = SheetChoice { orientation: Some(Orientation::Landscape), ..SheetChoice::default() };
        assert_eq!(size(&turned.or(&stated)), (210.0, 3.0));
    }

    #[test]
    fn kinds_have_the_names_of_options_and_of_files() {
        let names = |words: &str| kinds(words.split(' '));
        assert_eq!(names("trim"), names("boundary"));
        assert_eq!(names("section iso"), names("iso intersection iso"));
        assert!(names("iso,hatch").is_err() && names("iso hatch").unwrap_err().contains("--fill"));
        assert!(names("iso edges").unwrap_err().starts_with("`edges` is not one of boundary, "));
    }
}
