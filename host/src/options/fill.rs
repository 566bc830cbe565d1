//! The options of fills.

use penvis_core::extract::adaptive::Direction;

use super::{OptionError, bad};
use crate::args::DrawingArgs;
use crate::fill::FillChoice;
use crate::fill::choice::{self, A_GAP, A_PITCH, AN_ANGLE, is_angle, is_gap, is_pitch, kind};

/// What is asked of fills.
pub(super) fn fill(args: &DrawingArgs) -> Result<FillChoice, OptionError> {
    let kind =
        args.fill.as_deref().map(|word| kind(word).map_err(|problem| bad("--fill", word, problem))).transpose()?;
    // What is always said says nothing when it is as usual.
    let word = &args.iso_direction;
    let direction = choice::direction(word).map_err(|problem| bad("--iso-direction", word, problem))?;
    let direction = Some(direction).filter(|direction| *direction != Direction::Auto);
    let checked = |option, number: Option<f64>, holds: fn(f64) -> bool, wanted: &str| match number {
        Some(x) if !holds(x) => Err(bad(option, x, format!("is not {wanted}"))),
        number => Ok(number),
    };
    Ok(FillChoice {
        kind,
        degrees: checked("--fill-angle", args.fill_angle, is_angle, AN_ANGLE)?,
        pitch_mm: checked("--fill-pitch", args.fill_pitch, is_pitch, A_PITCH)?,
        direction,
        gap_mm: checked("--fill-gap", args.fill_gap, is_gap, A_GAP)?,
    })
}
