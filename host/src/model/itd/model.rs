//! Models: trimmed surfaces that share their edges.
//!
//! `[MODEL #surfaces #segments …]` has surfaces, `[MDLTSRF #loops [SURFACE …] [MDLLOOP 1 -2 …] …]`, whose loops list segments by
//! their numbers, negative ones backwards, and then the segments, `[MDLTSEG mask first second [CURVE …] …]`: the numbers of
//! the two surfaces that end there, 0 for none, and the curves whose bits are set in the mask: 1 and 2 for those in the
//! parameters of the first and second surface, 4 for the one in space, which is not needed.

use std::io::BufRead;

use penvis_core::nurbs::{Curve, Surface};
use penvis_core::trim::{TrimCurve, Trims};

use super::spline::{Spline, Splines, whole};
use super::token::{Kind, Tokens};
use super::trimmed::block;
use crate::model::fault::{Fault, ReadError};
use crate::model::text::shown;

/// A surface of a model.
struct Face {
    /// The line on which it begins.
    line: usize,
    surface: Spline<Surface>,
    loops: Vec<Loop>,
}

/// A loop of segments, by their numbers.
struct Loop {
    line: usize,
    segments: Vec<i64>,
}

/// A segment: up to two surfaces, by their numbers, and its curve in the parameters of each.
struct Segment {
    sides: [(usize, Option<Spline<Curve>>); 2],
}

/// A surface of a model, with the line on which it begins.
pub(super) type Part = (usize, Spline<(Surface, Option<Trims>)>);

/// Reads a model, whose keyword was read last, to its end; its surfaces name their edges by numbers from `edges` on, which
/// is left at the first that is free.
///
/// # Errors
/// What is wrong with it.
pub(super) fn model<R: BufRead>(
    tokens: &mut Tokens<'_, R>,
    splines: &mut Splines,
    edges: &mut u32,
) -> Result<Vec<Part>, ReadError> {
    let line = tokens.line();
    let kind = tokens.after_attributes()?;
    let face_count = whole(tokens, kind, "a number of surfaces")?;
    let kind = tokens.next()?;
    let segment_count = whole(tokens, kind, "a number of segments")?;
    let (mut faces, mut segments) = (Vec::new(), Vec::new());
    while let Some(keyword) = block(tokens)? {
        match keyword.as_str() {
            "MDLTSRF" => faces.push(face(tokens, splines)?),
            "MDLTSEG" => segments.push(segment(tokens, splines, face_count)?),
            _ => tokens.leave()?,
        }
    }
    for (what, got, announced) in [("surfaces", faces.len(), face_count), ("segments", segments.len(), segment_count)] {
        if got != announced {
            let problem =
                format!("begins a MODEL of {announced} {what}, but has {got}; it is cut off or its head wrong");
            return Err(Fault::line(line, problem).into());
        }
    }
    let first = *edges;
    let free = u32::try_from(segments.len()).ok().and_then(|count| first.checked_add(count));
    *edges = free.ok_or_else(|| Fault::line(line, "begins a MODEL with more segments than can be numbered"))?;
    let part = |(index, face): (usize, Face)| {
        let line = face.line;
        let trimmed = trimmed(index + 1, face, &segments, first)?;
        Ok((line, trimmed))
    };
    faces.into_iter().enumerate().map(part).collect()
}

fn face<R: BufRead>(tokens: &mut Tokens<'_, R>, splines: &mut Splines) -> Result<Face, ReadError> {
    let line = tokens.line();
    let kind = tokens.after_attributes()?;
    let announced = whole(tokens, kind, "a number of loops")?;
    let (mut surface, mut loops) = (None, Vec::new());
    while let Some(keyword) = block(tokens)? {
        match keyword.as_str() {
            "SURFACE" if surface.is_none() => surface = Some(splines.surface(tokens)?),
            "SURFACE" => return Err(tokens.fault(format!("has another surface in the MDLTSRF of line {line}"))),
            "MDLLOOP" => loops.push(segments(tokens)?),
            _ => tokens.leave()?,
        }
    }
    let Some(surface) = surface else {
        return Err(tokens.fault(format!("ends the MDLTSRF of line {line}, which has no surface")));
    };
    if loops.len() != announced {
        let got = loops.len();
        return Err(tokens.fault(format!("ends the MDLTSRF of line {line} after {got} of {announced} loops")));
    }
    Ok(Face { line, surface, loops })
}

fn segments<R: BufRead>(tokens: &mut Tokens<'_, R>) -> Result<Loop, ReadError> {
    let line = tokens.line();
    let mut segments = Vec::new();
    let mut kind = tokens.after_attributes()?;
    while kind == Kind::Word {
        let number = tokens.text().parse();
        segments.push(number.map_err(|_| tokens.unexpected(kind, "the number of a segment"))?);
        kind = tokens.next()?;
    }
    match kind {
        Kind::Close => Ok(Loop { line, segments }),
        kind => Err(tokens.unexpected(kind, "the number of a segment")),
    }
}

fn segment<R: BufRead>(tokens: &mut Tokens<'_, R>, splines: &mut Splines, faces: usize) -> Result<Segment, ReadError> {
    let line = tokens.line();
    let kind = tokens.after_attributes()?;
    let mask = whole(tokens, kind, "a mask of curves")?;
    if mask > 7 {
        return Err(tokens.fault(format!("has `{}` where a mask of curves, 0 to 7, is expected", shown(tokens.text()))));
    }
    let mut sides = [(0, None), (0, None)];
    for (of, _) in &mut sides {
        let kind = tokens.next()?;
        *of = whole(tokens, kind, "the number of a surface")?;
        if *of > faces {
            return Err(tokens.fault(format!("refers to surface {of} of {faces} that the model has")));
        }
    }
    let mut rest = mask;
    while let Some(keyword) = block(tokens)? {
        if keyword != "CURVE" || rest == 0 {
            tokens.leave()?;
            continue;
        }
        let bit = rest.trailing_zeros() as usize;
        rest &= rest - 1;
        match sides.get_mut(bit) {
            Some((_, curve)) => *curve = Some(splines.curve(tokens)?),
            None => tokens.leave()?,
        }
    }
    if rest != 0 {
        return Err(
            tokens.fault(format!("ends the MDLTSEG of line {line}, which lacks a curve that its mask announces"))
        );
    }
    Ok(Segment { sides })
}

/// The surface with this number and its trims.
fn trimmed(
    number: usize,
    face: Face,
    segments: &[Segment],
    first: u32,
) -> Result<Spline<(Surface, Option<Trims>)>, ReadError> {
    let surface = match face.surface {
        Spline::Read(surface) => surface,
        Spline::Skipped(what) => return Ok(Spline::Skipped(what)),
    };
    let mut loops = Vec::with_capacity(face.loops.len());
    for l in &face.loops {
        let mut curves = Vec::with_capacity(l.segments.len());
        for &index in &l.segments {
            match side(number, index, segments, first).map_err(|problem| Fault::line(l.line, problem))? {
                Spline::Read(curve) => curves.push(curve),
                Spline::Skipped(what) => return Ok(Spline::Skipped(format!("surfaces whose trims are {what}"))),
            }
        }
        loops.push(curves);
    }
    let Some(beginning) = face.loops.first() else { return Ok(Spline::Read((surface, None))) };
    let wrong = |e: penvis_core::trim::TrimError| {
        let own = e.place().0.and_then(|k| face.loops.get(k)).unwrap_or(beginning);
        Fault::line(own.line, format!("has an MDLLOOP that is wrong: {e}"))
    };
    // Which way round loops go says nothing in the file; what is kept is told by the even-odd rule first.
    let plain: Vec<Vec<Curve>> = loops.iter().map(|l| l.iter().map(|c| c.curve.clone()).collect()).collect();
    let kept = Trims::new(&surface, &plain).map_err(wrong)?;
    for (own, kept) in loops.iter_mut().zip(kept.loops()) {
        if kept.pieces().iter().find_map(|p| p.keeps_left()) == Some(false) {
            own.reverse();
            for c in own {
                c.curve = c.curve.reversed();
            }
        }
    }
    let trims = Trims::oriented(&surface, [false; 2], &loops).map_err(wrong)?;
    Ok(Spline::Read((surface, Some(trims))))
}

/// The segment of a number in the parameters of a surface, backwards if the number is negative.
fn side(surface: usize, index: i64, segments: &[Segment], first: u32) -> Result<Spline<TrimCurve>, String> {
    let position = usize::try_from(index.unsigned_abs()).ok().and_then(|k| k.checked_sub(1));
    let Some((position, segment)) = position.and_then(|k| Some((k, segments.get(k)?))) else {
        return Err(format!("refers to segment {index} of {} that the model has", segments.len()));
    };
    let [a, b] = &segment.sides;
    // Where a surface meets itself, it goes along the segment once each way.
    let own = if a.0 == surface && (b.0 != surface || index > 0) { a } else { b };
    let curve = match &own.1 {
        Some(Spline::Read(curve)) if own.0 == surface => curve,
        Some(Spline::Skipped(what)) if own.0 == surface => return Ok(Spline::Skipped(what.clone())),
        _ => return Err(format!("refers to segment {index}, which has no curve in surface {surface}")),
    };
    let is_shared = a.0 != 0 && b.0 != 0;
    // The position is less than the count of segments, for which there are numbers.
    let edge = is_shared.then(|| first + position as u32);
    let curve = if index < 0 { curve.reversed() } else { curve.clone() };
    Ok(Spline::Read(TrimCurve { curve, edge }))
}
