//! A vase of surfaces of revolution and swept handles, as in Ruan, Zhang and Yong (2006, fig. 7).

use glam::{DVec3, DVec4};
use penvis_core::nurbs::{KnotVector, Surface};
use penvis_core::scene::SceneSurface;
use penvis_core::shape::{self, Frame};

use super::part;
use super::turned::{arcs, spline, turn};
use crate::model::View;

const FOOT: (f64, f64) = (0.72, 0.0);
const OUTER: (f64, f64) = (0.9, 3.95);
const INNER: (f64, f64) = (0.8, 3.95);

/// Radius of a handle.
const HANDLE: f64 = 0.1;
/// Radii of the two arcs along which it is swept.
const UPPER: f64 = 0.741;
const LOWER: f64 = 0.342;

/// The wall is about 0.1 thick. Both ends of a handle lie half-way inside it, parallel to it.
pub(super) fn surfaces() -> Option<Vec<SceneSurface>> {
    let outside = [
        FOOT,
        (0.9, 0.06),
        (1.3, 0.7),
        (1.45, 1.5),
        (1.25, 2.3),
        (0.72, 2.85),
        (0.56, 3.3),
        (0.66, 3.7),
        (0.9, 3.75),
        OUTER,
    ];
    let inside = [
        INNER,
        (0.8, 3.77),
        (0.56, 3.7),
        (0.46, 3.3),
        (0.62, 2.79),
        (1.13, 2.25),
        (1.34, 1.5),
        (1.2, 0.74),
        (0.8, 0.14),
        (0.3, 0.12),
        (0.0, 0.12),
    ];
    let mut surfaces = vec![
        part("underside", turn(&spline(&[(0.0, 0.0), FOOT])?)?),
        part("outside", turn(&spline(&outside)?)?),
        part("lip", turn(&arcs((0.85, 3.95), &[OUTER, (0.85, 4.0), INNER])?)?),
        part("inside", turn(&spline(&inside)?)?),
    ];
    for (name, side) in [("right", 1.0), ("left", -1.0)] {
        // From the neck outwards and down by a quarter turn, then by 60° more into the shoulder.
        let neck = Joint { at: DVec3::new(0.553 * side, 0.0, 3.3), away: DVec3::Z };
        let elbow = neck.bent(UPPER, DVec3::X * side);
        let shoulder = elbow.bent(LOWER, DVec3::new(0.5 * side, 0.0, -0.75_f64.sqrt()));
        surfaces.push(part(format!("{name} handle upper"), tube(neck, elbow, UPPER, side)?));
        surfaces.push(part(format!("{name} handle lower"), tube(elbow, shoulder, LOWER, side)?));
    }
    Some(surfaces)
}

/// Where two arcs of a handle meet.
#[derive(Clone, Copy)]
struct Joint {
    at: DVec3,
    /// Unit vector from the arcs' centres to the joint.
    away: DVec3,
}

impl Joint {
    fn centre(self, radius: f64) -> DVec3 {
        self.at - self.away * radius
    }

    /// The other end of an arc of that radius.
    fn bent(self, radius: f64, away: DVec3) -> Self {
        Self { at: self.centre(radius) + away * radius, away }
    }
}

/// The piece of a torus between two joints: the circle in u, the bend in v. Both ends depend on their joint alone, so
/// that pieces that share a joint share its circle.
fn tube(from: Joint, to: Joint, radius: f64, side: f64) -> Option<Surface> {
    let cosine = from.away.dot(to.away);
    let corner = (from.away + to.away) / (1.0 + cosine);
    let bend = ((1.0 + cosine) / 2.0).sqrt();
    let section = shape::circle(&Frame::WORLD, HANDLE).ok()?;
    let points = section.homogeneous().iter().flat_map(|h| {
        let (outwards, sideways, weight) = (h.x / h.w, DVec3::NEG_Y * (h.y / h.w * side), h.w);
        let middle = from.centre(radius) + corner * (radius + outwards) + sideways;
        [
            (from.at + from.away * outwards + sideways).extend(weight),
            middle.extend(weight * bend),
            (to.at + to.away * outwards + sideways).extend(weight),
        ]
    });
    Surface::new(section.knots().clone(), KnotVector::bezier(2, [0.0, 1.0]).ok()?, points.collect::<Vec<DVec4>>()).ok()
}

pub(super) fn view() -> View {
    View::orthographic(DVec3::new(0.45, -1.0, 0.4))
}
