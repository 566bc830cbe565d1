//! Facets as surfaces.

use glam::{DVec2, DVec3, DVec4};
use penvis_core::nurbs::{Curve, KnotVector, NurbsError, Surface};
use penvis_core::scene::{Facet, SceneSurface};
use penvis_core::trim::{TrimCurve, Trims};

use super::polygon::{Plane, loops as loops_of};
use super::topology::Topology;
use super::{Mesh, PROGRESS_STEP};
use crate::model::fault::{Fault, ReadError};
use crate::model::import::{Reading, Report};

/// The surface of every facet, in order.
pub(super) fn surfaces(
    mesh: &Mesh,
    topology: &Topology,
    reading: &Reading<'_>,
    report: &mut Report,
) -> Result<Vec<SceneSurface>, ReadError> {
    let count = mesh.polygons.len();
    let mut out = Vec::with_capacity(count);
    for (index, polygon) in mesh.polygons.iter().enumerate() {
        if index % PROGRESS_STEP == 0 {
            reading.progress(index, count)?;
        }
        let facet = Facet { crease_angle: reading.crease_angle.max(topology.blur[index]) };
        let fault = |problem: String| Fault::at(format!("{} {}", mesh.unit, polygon.place), problem);
        let (surface, trims) = shape(mesh, topology, index).map_err(fault)?;
        let name = match mesh.parts[polygon.part as usize].as_str() {
            "" => format!("surface {index}"),
            part => part.to_owned(),
        };
        out.push(SceneSurface { name, surface, trims, facet: Some(facet) });
    }
    for polygon in &mesh.polygons {
        let kind = match polygon.count {
            3 => "triangle",
            4 => "quadrilateral",
            _ => "polygon",
        };
        *report.kinds.entry(kind.to_owned()).or_default() += 1;
    }
    Ok(out)
}

/// A corner of a facet: its point, and where it is in (u, v).
type Corner = (u32, DVec2);

/// The surface of a facet, and its trims if it has any; its front is where its corners go round counterclockwise.
fn shape(mesh: &Mesh, topology: &Topology, index: usize) -> Result<(Surface, Option<Trims>), String> {
    let polygon = &mesh.polygons[index];
    let corners = mesh.corners_of(polygon);
    let points: Vec<DVec3> = corners.iter().map(|&c| mesh.points[c as usize]).collect();
    let at = |k: usize, u: f64, v: f64| (corners[k], DVec2::new(u, v));
    let (surface, loops) = match (corners.len(), polygon.is_flat) {
        // The first corner of a triangle is all of v = 0, and follows itself.
        (3, _) => (
            patch([points[0], points[2], points[0], points[1]])?,
            vec![vec![at(0, 0.0, 0.0), at(0, 1.0, 0.0), at(1, 1.0, 1.0), at(2, 0.0, 1.0)]],
        ),
        (4, false) => (
            patch([points[0], points[3], points[1], points[2]])?,
            vec![vec![at(0, 0.0, 0.0), at(1, 1.0, 0.0), at(2, 1.0, 1.0), at(3, 0.0, 1.0)]],
        ),
        _ => flat(corners, &points)?,
    };
    let mut is_named = polygon.is_flat;
    let mut sides = Vec::with_capacity(loops.len());
    for corners in &loops {
        let mut own = Vec::new();
        for (k, &(a, from)) in corners.iter().enumerate() {
            let (b, to) = corners[(k + 1) % corners.len()];
            if a == b {
                own.push(straight(from, to, None)?);
                continue;
            }
            let ends = [mesh.points[a as usize], mesh.points[b as usize]];
            let mut here = (a, from);
            let between = topology.between(index as u32, a, b);
            let between = between.map(|c| (c, from.lerp(to, place(ends, mesh.points[c as usize]))));
            for there in between.chain([(b, to)]) {
                let edge = topology.edge(here.0, there.0);
                is_named |= edge.is_some();
                own.push(straight(here.1, there.1, edge)?);
                here = there;
            }
        }
        sides.push(own);
    }
    if !is_named {
        return Ok((surface, None));
    }
    let trims = Trims::oriented(&surface, [false; 2], &sides).map_err(|e| e.to_string())?;
    Ok((surface, Some(trims)))
}

/// The part of a plane that holds a polygon, and the loops that bound it, each counterclockwise: what is inside is told by
/// how many of them are round it.
fn flat(corners: &[u32], points: &[DVec3]) -> Result<(Surface, Vec<Vec<Corner>>), String> {
    let plane = Plane::of(points).ok_or("has no area")?;
    let places: Vec<DVec2> = points.iter().map(|&p| plane.flat(p)).collect();
    let low = places.iter().fold(DVec2::INFINITY, |low, p| low.min(*p));
    let high = places.iter().fold(DVec2::NEG_INFINITY, |high, p| high.max(*p));
    let size = high - low;
    let at = |p: DVec2| plane.origin + plane.x * p.x + plane.y * p.y;
    let surface = patch([low, DVec2::new(low.x, high.y), DVec2::new(high.x, low.y), high].map(at))?;
    let mut loops = Vec::new();
    for ring in loops_of(corners) {
        let mut own: Vec<Corner> = ring.iter().map(|&k| (corners[k], (places[k] - low) / size)).collect();
        let turn = |k: usize| own[k].1.perp_dot(own[(k + 1) % own.len()].1);
        if (0..own.len()).map(turn).sum::<f64>() < 0.0 {
            own.reverse();
        }
        loops.push(own);
    }
    Ok((surface, loops))
}

/// The bilinear patch with corners at (0, 0), (0, 1), (1, 0) and (1, 1).
fn patch(corners: [DVec3; 4]) -> Result<Surface, String> {
    let surface = || {
        let knots = KnotVector::bezier(1, [0.0, 1.0])?;
        Surface::new(knots.clone(), knots, corners.map(|p| p.extend(1.0)).to_vec())
    };
    surface().map_err(|e: NurbsError| e.to_string())
}

/// Where on a segment the foot of a point is, from 0 to 1.
fn place([a, b]: [DVec3; 2], p: DVec3) -> f64 {
    (p - a).dot(b - a) / (b - a).length_squared()
}

/// A straight side in (u, v).
fn straight(from: DVec2, to: DVec2, edge: Option<u32>) -> Result<TrimCurve, String> {
    let point = |p: DVec2| DVec4::new(p.x, p.y, 0.0, 1.0);
    let knots = KnotVector::bezier(1, [0.0, 1.0]).map_err(|e| e.to_string())?;
    let curve = Curve::new(knots, vec![point(from), point(to)]).map_err(|e| e.to_string())?;
    Ok(TrimCurve { curve, edge })
}
