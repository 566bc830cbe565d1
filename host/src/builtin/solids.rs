//! The elementary closed surfaces, all but the box with a closed form to compare a drawing with.

use glam::{DMat4, DVec3, DVec4};
use penvis_core::scene::SceneSurface;
use penvis_core::shape::{self, Frame};

use super::{bezier, part};
use crate::model::View;

pub(super) fn sphere() -> Option<Vec<SceneSurface>> {
    Some(vec![part("sphere", shape::sphere(&Frame::WORLD, 1.0).ok()?)])
}

pub(super) fn sphere_view() -> View {
    View::orthographic(DVec3::new(1.0, -2.0, 0.8))
}

/// Radius 1, height 2.5.
pub(super) fn cylinder() -> Option<Vec<SceneSurface>> {
    const HEIGHT: f64 = 2.5;
    let end = |origin: DVec3, z: DVec3| shape::disk(&Frame::new(origin, z, DVec3::X).ok()?, 1.0).ok();
    Some(vec![
        part("bottom", end(DVec3::ZERO, DVec3::NEG_Z)?),
        part("side", shape::cylinder(&Frame::WORLD, 1.0, HEIGHT).ok()?),
        part("top", end(DVec3::Z * HEIGHT, DVec3::Z)?),
    ])
}

/// Radius 1, height 2.4.
pub(super) fn cone() -> Option<Vec<SceneSurface>> {
    let below = Frame::new(DVec3::ZERO, DVec3::NEG_Z, DVec3::X).ok()?;
    Some(vec![
        part("base", shape::disk(&below, 1.0).ok()?),
        part("side", shape::cone(&Frame::WORLD, 1.0, 0.0, 2.4).ok()?),
    ])
}

pub(super) fn upright_view() -> View {
    View::orthographic(DVec3::new(1.0, -2.0, 1.1))
}

/// Radii 3 and 1.
pub(super) fn torus() -> Option<Vec<SceneSurface>> {
    Some(vec![part("torus", shape::torus(&Frame::WORLD, 3.0, 1.0).ok()?)])
}

/// Two tori of radii 3 and 0.8, each through the middle of the other's hole. The second is turned about the x axis by
/// the angle whose cosine is 5/13.
pub(super) fn linked_tori() -> Option<Vec<SceneSurface>> {
    let (cosine, sine) = (5.0 / 13.0, 12.0 / 13.0);
    let place = DMat4::from_cols(
        DVec4::X,
        DVec4::new(0.0, cosine, sine, 0.0),
        DVec4::new(0.0, -sine, cosine, 0.0),
        DVec4::new(3.0, 0.0, 0.0, 1.0),
    );
    let first = shape::torus(&Frame::WORLD, 3.0, 0.8).ok()?;
    let second = first.transformed(place).ok()?;
    Some(vec![part("level torus", first), part("turned torus", second)])
}

pub(super) fn linked_tori_view() -> View {
    View::orthographic(DVec3::new(0.5, -1.0, 0.9))
}

/// The sides of a box: name, normal, and the direction across seen from outside.
pub(crate) const SIDES_OF_A_BOX: [(&str, DVec3, DVec3); 6] = [
    ("left", DVec3::NEG_X, DVec3::NEG_Y),
    ("right", DVec3::X, DVec3::Y),
    ("front", DVec3::NEG_Y, DVec3::X),
    ("back", DVec3::Y, DVec3::NEG_X),
    ("bottom", DVec3::NEG_Z, DVec3::NEG_X),
    ("top", DVec3::Z, DVec3::X),
];

/// Six rectangles with edges along the axes: no silhouette, no curvature, faces that can be seen edge-on.
pub(super) fn cuboid() -> Option<Vec<SceneSurface>> {
    let half = DVec3::new(1.5, 1.0, 0.75);
    let mut faces = Vec::with_capacity(6);
    for (name, normal, across) in SIDES_OF_A_BOX {
        let up = normal.cross(across);
        let corner = |s: f64, t: f64| ((normal + s * across + t * up) * half).extend(1.0);
        faces.push(part(
            name,
            bezier([[corner(-1.0, -1.0), corner(-1.0, 1.0)], [corner(1.0, -1.0), corner(1.0, 1.0)]])?,
        ));
    }
    Some(faces)
}

pub(super) fn cuboid_view() -> View {
    View::orthographic(DVec3::new(1.0, -1.6, 0.9))
}
