//! Bodies and faces by their measures.
//!
//! Boxes, cylinders and cones stand on the plane z = 0 round the z axis, spheres and tori have their middle at the origin,
//! rectangles and disks lie in the plane z = 0 and face upwards.

use glam::DVec3;
use penvis_core::scene::SceneSurface;
use penvis_core::shape::{self, Frame, ShapeError};

use super::keys::Item;
use crate::builtin::SIDES_OF_A_BOX;
use crate::model::fault::Fault;

/// Keys of the shapes.
pub(super) const SHAPES: [&str; 7] = ["box", "sphere", "cylinder", "cone", "torus", "rectangle", "disk"];

/// Surfaces of a shape, with their kinds.
pub(super) type Faces = Vec<(&'static str, SceneSurface)>;

/// The surfaces of the shape that a key asks for. Positive sides point outwards.
///
/// # Errors
/// If a measure is missing or makes no shape.
pub(super) fn faces(item: &Item<'_>) -> Result<Faces, Fault> {
    let wrong = |error| item.misshapen(error);
    match item.key {
        "box" => {
            let size = DVec3::from(item.table("a box", &["size"])?.need("size")?.numbers()?);
            cuboid(size).map_err(wrong)
        }
        "rectangle" => {
            let [x, y] = item.table("a rectangle", &["size"])?.need("size")?.numbers()?;
            rectangle(x, y).map_err(wrong)
        }
        "disk" => {
            let radius = item.table("a disk", &["radius"])?.need("radius")?.number()?;
            Ok(vec![face("plane", "disk", shape::disk(&Frame::WORLD, radius).map_err(wrong)?)])
        }
        "sphere" => {
            let radius = item.table("a sphere", &["radius"])?.need("radius")?.number()?;
            Ok(vec![face("sphere", "sphere", shape::sphere(&Frame::WORLD, radius).map_err(wrong)?)])
        }
        "torus" => {
            let table = item.table("a torus", &["radius", "tube_radius"])?;
            let (radius, tube) = (table.need("radius")?.number()?, table.need("tube_radius")?.number()?);
            Ok(vec![face("torus", "torus", shape::torus(&Frame::WORLD, radius, tube).map_err(wrong)?)])
        }
        "cylinder" => {
            let table = item.table("a cylinder", &["radius", "height"])?;
            let (radius, height) = (table.need("radius")?.number()?, table.need("height")?.number()?);
            let side = shape::cylinder(&Frame::WORLD, radius, height).map_err(wrong)?;
            Ok(vec![
                bottom(radius).map_err(wrong)?,
                face("cylinder", "side", side),
                top(radius, height).map_err(wrong)?,
            ])
        }
        _ => {
            let table = item.table("a cone", &["radius", "top_radius", "height"])?;
            let (radius, height) = (table.need("radius")?.number()?, table.need("height")?.number()?);
            let above = table.get("top_radius").map_or(Ok(0.0), |item| item.number())?;
            let side = shape::cone(&Frame::WORLD, radius, above, height).map_err(wrong)?;
            let mut faces = vec![face("cone", "side", side)];
            if radius > 0.0 {
                faces.insert(0, bottom(radius).map_err(wrong)?);
            }
            if above > 0.0 {
                faces.push(top(above, height).map_err(wrong)?);
            }
            Ok(faces)
        }
    }
}

fn face(kind: &'static str, name: &str, surface: penvis_core::nurbs::Surface) -> (&'static str, SceneSurface) {
    (kind, SceneSurface::new(name, surface))
}

fn bottom(radius: f64) -> Result<(&'static str, SceneSurface), ShapeError> {
    let down = Frame::new(DVec3::ZERO, DVec3::NEG_Z, DVec3::X)?;
    Ok(face("plane", "bottom", shape::disk(&down, radius)?))
}

fn top(radius: f64, height: f64) -> Result<(&'static str, SceneSurface), ShapeError> {
    Ok(face("plane", "top", shape::disk(&Frame::at(DVec3::Z * height)?, radius)?))
}

/// A length of a box or a rectangle.
fn side(what: &'static str, value: f64) -> Result<f64, ShapeError> {
    if value > 0.0 { Ok(value) } else { Err(ShapeError::NotPositive { what, value }) }
}

fn rectangle(x: f64, y: f64) -> Result<Faces, ShapeError> {
    let (x, y) = (side("the size along x", x)?, side("the size along y", y)?);
    let corner = DVec3::new(-0.5 * x, -0.5 * y, 0.0);
    Ok(vec![face("plane", "rectangle", shape::plane(corner, DVec3::X * x, DVec3::Y * y)?)])
}

fn cuboid(size: DVec3) -> Result<Faces, ShapeError> {
    let size = DVec3::new(
        side("the size along x", size.x)?,
        side("the size along y", size.y)?,
        side("the size along z", size.z)?,
    );
    let low = DVec3::new(-0.5 * size.x, -0.5 * size.y, 0.0);
    let high = DVec3::new(0.5 * size.x, 0.5 * size.y, size.z);
    let mut faces = Faces::with_capacity(6);
    for (name, normal, across) in SIDES_OF_A_BOX {
        let up = normal.cross(across);
        // The corner that is in front along the normal and behind along both sides. Sides are differences of the same
        // numbers, so that faces have their corners in common to the bit.
        let corner = DVec3::select((normal - across - up).cmpgt(DVec3::ZERO), high, low);
        faces.push(face("plane", name, shape::plane(corner, across * size, up * size)?));
    }
    Ok(faces)
}
