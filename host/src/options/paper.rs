//! The options of the sheet, of the picture's place on it, and of the pens.

use std::collections::BTreeMap;

use super::{OptionError, bad};
use crate::args::DrawingArgs;
use crate::marking::{MARKS_LAYER, TITLE_LAYER};
use crate::page::{self, KindPens, Orientation, Position, Size};
use crate::style::{self, MOST_PENS};

/// Which way the sheet is held, if that is said.
pub(super) fn orientation(args: &DrawingArgs) -> Option<Orientation> {
    match (args.landscape, args.portrait) {
        (_, true) => Some(Orientation::Portrait),
        (true, _) => Some(Orientation::Landscape),
        _ => None,
    }
}

/// Pens by kind, and by layer where a layer is only some of a kind or none.
pub(super) fn pens(words: &[String]) -> Result<(KindPens, BTreeMap<String, u32>), OptionError> {
    let (mut kinds, mut layers) = (KindPens::default(), BTreeMap::new());
    for word in words {
        let wrong = |problem: String| bad("--pen", word, problem);
        let (layer, number) = word.split_once('=').map_or((None, word.as_str()), |(layer, n)| (Some(layer.trim()), n));
        let Some(pen) = number.trim().parse().ok().filter(|pen| (1..=MOST_PENS).contains(pen)) else {
            return Err(wrong(format!("names no pen; give LAYER=N or N, a number from 1 to {MOST_PENS}")));
        };
        let is_part = |layer: &str| {
            let part = ["iso-", "hidden-"].iter().find_map(|start| layer.strip_prefix(start));
            part.is_some_and(|k| k.parse::<u32>().is_ok_and(|k| k > 0)) || matches!(layer, MARKS_LAYER | TITLE_LAYER)
        };
        match layer {
            None => kinds = kinds.or(KindPens::all(pen)),
            Some(layer) if is_part(layer) => drop(layers.insert(layer.to_owned(), pen)),
            Some(layer) => kinds = style::with_pen(kinds, layer, pen).map_err(wrong)?,
        }
    }
    Ok((kinds, layers))
}

/// How large the picture is to be, if that is said.
pub(super) fn size(args: &DrawingArgs) -> Result<Option<Size>, OptionError> {
    let length = |option, text: &str| {
        let problem = "is no length on paper; give one more than 0 such as 120mm, 12cm or 5in";
        page::length_mm(text).filter(|&mm| mm > 0.0).ok_or_else(|| bad(option, text, problem))
    };
    let ratio = |text: &str| {
        page::scale(text).ok_or_else(|| bad("--scale", text, "is no ratio paper:model; 1:2 is half the model's size"))
    };
    Ok(match (&args.scale, &args.width, &args.height) {
        (Some(text), ..) => Some(Size::Scale(ratio(text)?)),
        (_, Some(text), _) => Some(Size::Width(length("--width", text)?)),
        (.., Some(text)) => Some(Size::Height(length("--height", text)?)),
        (None, None, None) => None,
    })
}

/// Where the picture is to be put.
pub(super) fn position(text: &str) -> Result<Position, OptionError> {
    let problem = "is neither center nor two lengths X,Y from the lower left corner of the sheet, such as 20mm,30mm";
    page::position(text).ok_or_else(|| bad("--position", text, problem))
}
