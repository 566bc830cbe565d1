//! Facets as surfaces.

use glam::{DVec2, DVec3, DVec4};
use penvis_core::nurbs::{Curve, KnotVector, NurbsError, Surface};
use penvis_core::scene::{Facet, SceneSurface};
use penvis_core::trim::{TrimCurve, Trims};

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
    if count > 0 {
        report.kinds.insert("triangle".to_owned(), count);
    }
    Ok(out)
}

/// The surface of a facet, and its trims if it has any; its front is where its corners go round counterclockwise.
fn shape(mesh: &Mesh, topology: &Topology, index: usize) -> Result<(Surface, Option<Trims>), String> {
    let polygon = &mesh.polygons[index];
    let corners = mesh.corners_of(polygon);
    let at = |k: usize| mesh.points[corners[k] as usize];
    // Where the corners are in (u, v). The first corner of a triangle is all of v = 0, and follows itself.
    let (surface, places) = match corners.len() {
        3 => (
            patch([at(0), at(2), at(0), at(1)]),
            vec![(0, [1.0, 0.0]), (1, [1.0, 1.0]), (2, [0.0, 1.0]), (0, [0.0; 2])],
        ),
        n => return Err(format!("has {n} corners; only triangles are read")),
    };
    let surface = surface.map_err(|e| e.to_string())?;
    let mut border = Vec::new();
    let mut is_named = false;
    for (k, &(corner, uv)) in places.iter().enumerate() {
        let (next, to) = places[(k + 1) % places.len()];
        let (a, b) = (corners[corner], corners[next]);
        let (from, to) = (DVec2::from(uv), DVec2::from(to));
        if a == b {
            border.push(straight(from, to, None)?);
            continue;
        }
        let ends = [mesh.points[a as usize], mesh.points[b as usize]];
        let mut here = (a, from);
        let between =
            topology.between(index as u32, a, b).map(|c| (c, from.lerp(to, place(ends, mesh.points[c as usize]))));
        for there in between.chain([(b, to)]) {
            let edge = topology.edge(here.0, there.0);
            is_named |= edge.is_some();
            border.push(straight(here.1, there.1, edge)?);
            here = there;
        }
    }
    if !is_named {
        return Ok((surface, None));
    }
    let trims = Trims::oriented(&surface, [false; 2], &[border]).map_err(|e| e.to_string())?;
    Ok((surface, Some(trims)))
}

/// The bilinear patch with corners at (0, 0), (0, 1), (1, 0) and (1, 1).
fn patch(corners: [DVec3; 4]) -> Result<Surface, NurbsError> {
    let knots = KnotVector::bezier(1, [0.0, 1.0])?;
    Surface::new(knots.clone(), knots, corners.map(|p| p.extend(1.0)).to_vec())
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
