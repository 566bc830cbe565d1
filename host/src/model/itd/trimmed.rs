//! Surfaces with their trims.
//!
//! `[TRIMSRF [SURFACE …] [TRIMCRV [TRIMCRVSEG [CURVE …] …] …] …]`: each `TRIMCRV` is a closed loop of segments end to end,
//! and a segment has its curve in parameters first, and maybe one in space that is not needed. What is kept is inside by
//! the even-odd rule.

use std::io::BufRead;

use penvis_core::nurbs::{Curve, Surface};
use penvis_core::trim::Trims;

use super::spline::{Spline, Splines};
use super::token::{Kind, Tokens};
use crate::model::fault::{Fault, ReadError};

/// A loop of trim curves, and the line on which it begins.
struct Loop {
    line: usize,
    curves: Vec<Curve>,
}

/// Reads a trimmed surface, whose keyword was read last, to its end.
///
/// # Errors
/// What is wrong with it.
pub(super) fn trimmed<R: BufRead>(
    tokens: &mut Tokens<'_, R>,
    splines: &mut Splines,
) -> Result<Spline<(Surface, Option<Trims>)>, ReadError> {
    let line = tokens.line();
    let mut surface = None;
    let mut skipped = None;
    let mut loops = Vec::new();
    while let Some(keyword) = block(tokens)? {
        match keyword.as_str() {
            "SURFACE" if surface.is_none() && skipped.is_none() => match splines.surface(tokens)? {
                Spline::Read(read) => surface = Some(read),
                Spline::Skipped(what) => skipped = Some(what),
            },
            "SURFACE" => return Err(tokens.fault(format!("has another surface in the TRIMSRF of line {line}"))),
            "TRIMCRV" => match trim_loop(tokens, splines)? {
                Spline::Read(read) => loops.push(read),
                Spline::Skipped(what) => skipped = skipped.or(Some(format!("surfaces whose trims are {what}"))),
            },
            _ => tokens.leave()?,
        }
    }
    if let Some(what) = skipped {
        return Ok(Spline::Skipped(what));
    }
    let Some(surface) = surface else {
        return Err(tokens.fault(format!("ends the TRIMSRF of line {line}, which has no surface")));
    };
    // A surface without trims is whole.
    let Some(first) = loops.first() else { return Ok(Spline::Read((surface, None))) };
    let curves: Vec<Vec<Curve>> = loops.iter().map(|l| l.curves.clone()).collect();
    let trims = Trims::new(&surface, &curves).map_err(|e| {
        let own = e.place().0.and_then(|k| loops.get(k)).unwrap_or(first);
        Fault::line(own.line, format!("begins a TRIMCRV that is wrong: {e}"))
    })?;
    Ok(Spline::Read((surface, Some(trims))))
}

fn trim_loop<R: BufRead>(tokens: &mut Tokens<'_, R>, splines: &mut Splines) -> Result<Spline<Loop>, ReadError> {
    let line = tokens.line();
    let mut curves = Vec::new();
    let mut skipped = None;
    while let Some(keyword) = block(tokens)? {
        if keyword != "TRIMCRVSEG" {
            tokens.leave()?;
            continue;
        }
        let segment = tokens.line();
        let mut has_curve = false;
        while let Some(keyword) = block(tokens)? {
            // The first is in parameters, one that follows in space.
            if keyword != "CURVE" || has_curve {
                tokens.leave()?;
                continue;
            }
            has_curve = true;
            match splines.curve(tokens)? {
                Spline::Read(curve) => curves.push(curve),
                Spline::Skipped(what) => skipped = Some(what),
            }
        }
        if !has_curve {
            return Err(tokens.fault(format!("ends the TRIMCRVSEG of line {segment}, which has no curve")));
        }
    }
    Ok(match skipped {
        Some(what) => Spline::Skipped(what),
        None => Spline::Read(Loop { line, curves }),
    })
}

/// Reads the beginning of a block and its keyword, in capitals; none at the end of the block around it.
pub(super) fn block<R: BufRead>(tokens: &mut Tokens<'_, R>) -> Result<Option<String>, ReadError> {
    match tokens.next()? {
        Kind::Open => {}
        Kind::Close => return Ok(None),
        kind => return Err(tokens.unexpected(kind, "a block or `]`")),
    }
    match tokens.next()? {
        Kind::Word => Ok(Some(tokens.text().to_ascii_uppercase())),
        kind => Err(tokens.unexpected(kind, "the keyword of a block")),
    }
}
