//! The STEP reader: boundary representations of ISO 10303-203, 214 and 242.
//!
//! Faces of planes, cylinders, cones, spheres, tori, surfaces of extrusion and of revolution, and B-spline surfaces become
//! rational B-spline surfaces that are exactly those of the file. The edges round a face become its trims. Where the file says
//! how an edge runs in the parameters of the surface, and that is within [`TOLERANCE`] of the size of the model of its curve in
//! space, measured along the surface, the trim is that parameter curve: as it is on B-spline surfaces, and moved to the
//! parameters of the surface that is drawn on planes, and along lines of constant parameters of cylinders, cones, spheres and
//! tori. Other parameter curves of what is round are no rational curves in the parameters that are drawn. There, on surfaces of
//! extrusion and of revolution, and where the file gives no such curve, the curve in space is pulled back onto the surface,
//! exactly on planes and along isoparametric curves, and elsewhere within the same tolerance. Both sides of an edge carry its number, so that what touches in the file touches
//! in the drawing whatever its curves say. Composite curves are read as one B-spline curve. Components of assemblies stand where the file places them; lengths are in
//! millimetres.
//!
//! Two things are not read, and told by their names: offset curves, which are no rational curves but for lines and arcs, whose
//! exporters write the result; and a profile that goes on beyond the axis that it turns round, but for lines and circles, because
//! the parts on either side of the axis sweep the same points twice and which of them a face means only its edges could tell.

mod assembly;
mod composite;
mod curve;
mod exchange;
mod face;
mod parameters;
mod pcurve;
mod surface;
#[cfg(test)]
mod tests;
mod units;

use std::collections::{BTreeMap, HashMap};

use glam::{DMat4, DVec3};
use penvis_core::scene::{Scene, SceneSurface};
use penvis_core::view::MAX_DEGREE;
use rayon::prelude::*;

use self::assembly::{Assembly, Body};
use self::exchange::{Entity, Exchange, Part};
use self::face::{EdgeNumbers, Face, Reader};
use self::pcurve::Given;
use super::fault::{Fault, ReadError};
use super::format::ModelFormat;
use super::import::{Import, Reading, Report};
use super::source::Source;

/// Solids and surfaces of CAD programs.
pub(super) const FORMAT: ModelFormat = ModelFormat {
    name: "STEP",
    extensions: &["step", "stp", "p21"],
    looks_like: |source| source.head().trim_ascii_start().starts_with(b"ISO-10303-21"),
    read,
};

/// Largest distance of trims from the curves that are pulled back, of the diagonal of all vertices. On a sheet of paper a
/// model is some hundred millimetres wide, and a ten-thousandth of a millimetre is a hundredth of what a plotter resolves.
const TOLERANCE: f64 = 1e-6;

/// Faces that are read before one asks whether to go on.
const CHUNK: usize = 64;

/// Most faces, all places of all components counted.
const MOST_FACES: usize = 1 << 20;

fn read(source: &mut Source, reading: &Reading<'_>) -> Result<Import, ReadError> {
    let name = source.stem().to_owned();
    let file = Exchange::parse(source)?;
    let mut report = Report::default();
    report.healed.extend(file.repairs());
    let mut assembly = Assembly::of(&file)?;
    let size = size(&file);
    for units in &mut assembly.units {
        units.tolerance = TOLERANCE * size * units.length;
    }
    let faces_of = assembly.bodies.iter().map(|body| faces(body, &mut report)).collect::<Result<Vec<_>, _>>()?;
    let total = assembly.placed.iter().fold(0_usize, |sum, (body, _)| sum.saturating_add(faces_of[*body].len()));
    if total > MOST_FACES {
        let problem = format!("asks for {total} faces in all places of its components; draw a part of it");
        return Err(Fault::whole(problem).into());
    }
    let made = make(&file, &assembly, &faces_of, reading, &mut report)?;
    let scene = placed(name, &assembly, &faces_of, &made)?;
    for (body, _) in &assembly.placed {
        let faces = faces_of[*body].iter().filter_map(|f| made.get(&(f.id(), assembly.bodies[*body].units)));
        faces.for_each(|face| *report.kinds.entry(face.kind.to_owned()).or_default() += 1);
    }
    if scene.surfaces.is_empty() {
        return Err(nothing(&report).into());
    }
    report.unit = assembly.units.iter().find_map(|u| u.name.clone());
    Ok(Import { scene, report, ..Import::default() })
}

/// Why there is nothing to draw.
fn nothing(report: &Report) -> Fault {
    if let Some(problem) = report.problems.first() {
        let more = report.problems.len() - 1;
        let also = if more > 0 { format!(" ({more} more faces have problems)") } else { String::new() };
        return Fault::whole(format!("no face can be drawn: {problem}{also}"));
    }
    match report.skipped.iter().max_by_key(|(_, count)| **count) {
        Some((what, _)) => Fault::whole(format!(
            "has no faces, but {what}, which is not read; export it as solids or surfaces (AP203, AP214 or AP242)"
        )),
        None => Fault::whole("has no faces; export it as solids or surfaces (AP203, AP214 or AP242)"),
    }
}

/// The faces of a body; what is none is counted.
fn faces<'a>(body: &Body<'a>, report: &mut Report) -> Result<Vec<Entity<'a>>, Fault> {
    // Shells and sets of faces in one another, to their end; a file may say that one is part of itself.
    const MAX_DEPTH: usize = 8;
    let mut out = Vec::new();
    let mut todo = vec![(body.item, 0)];
    while let Some((item, depth)) = todo.pop() {
        if depth > MAX_DEPTH || out.len() > MOST_FACES || todo.len() > MOST_FACES {
            return Err(item.fault("is part of itself, or has more faces than can be drawn"));
        }
        // In an entity of several types attributes come without the name.
        let first = usize::from(item.is_simple());
        let mut inside = |parts: Vec<Entity<'a>>| todo.extend(parts.into_iter().rev().map(|e| (e, depth + 1)));
        if let Some((_, solid)) = item.find_any(&["MANIFOLD_SOLID_BREP", "FACETED_BREP", "BREP_WITH_VOIDS"]) {
            let voids = item.find("BREP_WITH_VOIDS").map(|v| v.entities(if item.is_simple() { 2 } else { 0 }));
            let outer = if item.is_simple() { Some(solid) } else { item.find("MANIFOLD_SOLID_BREP") };
            let mut shells = outer.map(|o| o.entity(first)).transpose()?.into_iter().collect::<Vec<_>>();
            shells.extend(voids.transpose()?.into_iter().flatten());
            inside(shells);
        } else if let Some((_, shells)) = item.find_any(&[
            "SHELL_BASED_SURFACE_MODEL",
            "FACE_BASED_SURFACE_MODEL",
            "CLOSED_SHELL",
            "OPEN_SHELL",
            "CONNECTED_FACE_SET",
        ]) {
            inside(shells.entities(first)?);
        } else if let Some((_, turned)) = item.find_any(&["ORIENTED_CLOSED_SHELL", "ORIENTED_OPEN_SHELL"]) {
            inside(vec![turned.entity(2)?]);
        } else if item.find_any(&["ADVANCED_FACE", "FACE_SURFACE", "ORIENTED_FACE"]).is_some() {
            out.push(item);
        } else if let Some((_, set)) = item.find_any(&["GEOMETRIC_SET", "GEOMETRIC_CURVE_SET"]) {
            for element in set.entities(first)? {
                report.skip(element.name());
            }
        } else {
            report.skip(item.name());
        }
    }
    Ok(out)
}

/// A face as it is in its own representation, by the numbers of its entity and of its units.
type Made = HashMap<(u64, usize), Face>;

/// Makes all faces that stand somewhere.
fn make(
    file: &Exchange,
    assembly: &Assembly<'_>,
    faces_of: &[Vec<Entity<'_>>],
    reading: &Reading<'_>,
    report: &mut Report,
) -> Result<Made, ReadError> {
    let edges = EdgeNumbers::of(file);
    let mut wanted = BTreeMap::new();
    for (body, _) in &assembly.placed {
        let units = assembly.bodies[*body].units;
        wanted.extend(faces_of[*body].iter().map(|face| ((face.id(), units), *face)));
    }
    let wanted: Vec<((u64, usize), Entity<'_>)> = wanted.into_iter().collect();
    let mut made = Made::with_capacity(wanted.len());
    let (mut off, mut moved, mut short, mut turned) = (0.0_f64, 0.0_f64, 0, 0);
    let mut given = Given::default();
    for (chunk, faces) in wanted.chunks(CHUNK).enumerate() {
        reading.progress(chunk * CHUNK, wanted.len())?;
        let one = |&((id, units), entity): &((u64, usize), Entity<'_>)| {
            let reader = Reader { units: &assembly.units[units], edges: &edges };
            ((id, units), reader.face(entity))
        };
        for (key, face) in faces.par_iter().map(one).collect::<Vec<_>>() {
            match face {
                Ok(mut face) => {
                    (off, moved) = (off.max(face.off), moved.max(face.moved));
                    short += face.short;
                    turned += usize::from(face.turned);
                    given.extend(std::mem::take(&mut face.given));
                    made.insert(key, face);
                }
                Err(fault) => report.problems.push(fault.to_string()),
            }
        }
    }
    reading.progress(wanted.len(), wanted.len())?;
    let tolerance = assembly.units.iter().map(|u| u.tolerance).fold(0.0, f64::max);
    let lowered = file.entities().filter(|e| is_high(*e)).count();
    if lowered > 0 {
        report
            .healed
            .push(format!("{lowered} splines of degrees above {MAX_DEGREE} are drawn within {tolerance:.3e} mm"));
    }
    if off > tolerance {
        report.healed.push(format!("edges that are up to {off:.3e} mm off their surfaces were moved onto them"));
    }
    if moved > tolerance {
        report.healed.push(format!("ends of edges that are up to {moved:.3e} mm apart were made to meet"));
    }
    if short > 0 {
        report.healed.push(format!("{short} ends of faces at edges shorter than {tolerance:.3e} mm were left out"));
    }
    given.tell(&mut report.healed);
    if turned > 0 {
        report.healed.push(format!("{turned} faces whose loops ran the wrong way round were turned"));
    }
    Ok(made)
}

/// Whether an entity is a spline in space of a degree that has to be lowered.
fn is_high(entity: Entity<'_>) -> bool {
    let first = usize::from(entity.is_simple());
    let degree = |part: Part<'_>, k: usize| part.count(first + k).unwrap_or(0);
    const SURFACES: &[&str] = &["B_SPLINE_SURFACE", "B_SPLINE_SURFACE_WITH_KNOTS", "BEZIER_SURFACE"];
    const CURVES: &[&str] = &["B_SPLINE_CURVE", "B_SPLINE_CURVE_WITH_KNOTS", "BEZIER_CURVE"];
    if let Some((_, surface)) = entity.find_any(SURFACES) {
        return degree(surface, 0).max(degree(surface, 1)) > MAX_DEGREE;
    }
    let Some((_, curve)) = entity.find_any(CURVES) else { return false };
    let in_space = || {
        let points = curve.entities(first + 1).ok()?;
        Some(points.first()?.find("CARTESIAN_POINT")?.reals(1).ok()?.len() == 3)
    };
    degree(curve, 0) > MAX_DEGREE && in_space() == Some(true)
}

/// Diagonal of the box of all vertices, or of all points if there are none, in units of the file.
fn size(file: &Exchange) -> f64 {
    let point = |e: Entity<'_>| match e.find("CARTESIAN_POINT")?.reals(1).ok()?[..] {
        [x, y, z] => Some(DVec3::new(x, y, z)),
        _ => None,
    };
    let extent = |points: &mut dyn Iterator<Item = DVec3>| {
        let (lo, hi) = points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        (hi - lo).length()
    };
    let vertices = extent(&mut file.all("VERTEX_POINT").filter_map(|v| point(v.entity(1).ok()?)));
    if vertices > 0.0 && vertices.is_finite() { vertices } else { extent(&mut file.entities().filter_map(point)) }
}

/// The scene of all bodies where they stand.
fn placed(name: String, assembly: &Assembly<'_>, faces_of: &[Vec<Entity<'_>>], made: &Made) -> Result<Scene, Fault> {
    let several = assembly.placed.len() > 1;
    let scene = |(place, (body, map)): (usize, &(usize, DMat4))| {
        let units = assembly.bodies[*body].units;
        let faces = faces_of[*body].iter().filter_map(|face| made.get(&(face.id(), units)));
        let surface = |face: &Face| {
            let own = &face.surface;
            let surface = own.surface.transformed(*map).map_err(|e| Fault::at(own.name.clone(), e.to_string()))?;
            let name = if several { format!("body {}: {}", place + 1, own.name) } else { own.name.clone() };
            Ok(SceneSurface { name, surface, ..own.clone() })
        };
        Ok(Scene { name: String::new(), surfaces: faces.map(surface).collect::<Result<_, Fault>>()? })
    };
    let scenes = assembly.placed.iter().enumerate().map(scene).collect::<Result<Vec<_>, Fault>>()?;
    Ok(Scene::joined(name, scenes))
}
