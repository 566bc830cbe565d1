//! What is asked of the view, where models and options leave the rest to each other.

use glam::DVec3;
use penvis_core::scene::Scene;

use super::view::{Projection, View};

/// Views by name: direction to the eye, and up.
const VIEWS: [(&str, DVec3, DVec3); 7] = [
    ("front", DVec3::NEG_Y, DVec3::Z),
    ("back", DVec3::Y, DVec3::Z),
    ("left", DVec3::NEG_X, DVec3::Z),
    ("right", DVec3::X, DVec3::Z),
    // x stays to the right in both.
    ("top", DVec3::Z, DVec3::Y),
    ("bottom", DVec3::NEG_Z, DVec3::NEG_Y),
    ("iso", View::ISOMETRIC.eye_direction, DVec3::Z),
];

/// What is asked of the view; the model's own fills what is left open.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ViewChoice {
    /// Direction to the eye and the up that goes with it.
    pub(crate) direction: Option<(DVec3, DVec3)>,
    pub(crate) up: Option<DVec3>,
    /// Angle in radians that the model's bounding sphere fills.
    pub(crate) angle: Option<f64>,
}

impl ViewChoice {
    /// This choice, and what it leaves open as another one says. An up goes with its direction.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        let below = if self.direction.is_some() { None } else { other.up };
        Self { direction: self.direction.or(other.direction), up: self.up.or(below), angle: self.angle.or(other.angle) }
    }

    /// The view of a scene that is stored with `stored`, if with any.
    ///
    /// A perspective places the eye so that the bounding sphere of the control points fills its angle.
    #[must_use]
    pub fn resolve(&self, stored: Option<View>, scene: &Scene) -> View {
        let mut view = match self.direction {
            Some((eye_direction, up)) => View { up, ..View::orthographic(eye_direction) },
            None => stored.unwrap_or(View::ISOMETRIC),
        };
        if let Some(up) = self.up {
            view.up = up;
        }
        if let Some(angle) = self.angle {
            let towards_eye = match view.projection {
                Projection::Orthographic => view.eye_direction,
                Projection::Perspective { eye, target } => eye - target,
            };
            let (target, radius) = bounding_sphere(scene);
            let eye = target + towards_eye.normalize_or_zero() * (radius / (angle / 2.0).sin());
            view = View { up: view.up, ..View::perspective(eye, target) };
        }
        view
    }
}

/// A sphere round all control points, and so round the surfaces: the middle of their box, and the largest distance from it.
fn bounding_sphere(scene: &Scene) -> (DVec3, f64) {
    let points = || scene.surfaces.iter().flat_map(|s| s.surface.homogeneous()).map(|h| h.truncate() / h.w);
    let low = points().fold(DVec3::INFINITY, DVec3::min);
    let high = points().fold(DVec3::NEG_INFINITY, DVec3::max);
    if low.cmpgt(high).any() {
        return (DVec3::ZERO, 1.0);
    }
    let middle = low + (high - low) / 2.0;
    let radius = points().map(|p| p.distance(middle)).fold(0.0, f64::max);
    (middle, if radius > 0.0 { radius } else { 1.0 })
}

/// Direction to the eye and up of a view by its name, in any case.
pub(crate) fn named(name: &str) -> Option<(DVec3, DVec3)> {
    VIEWS.iter().find(|view| view.0.eq_ignore_ascii_case(name.trim())).map(|&(_, eye, up)| (eye, up))
}

/// The names of the views, for messages.
pub(crate) fn names() -> String {
    VIEWS.map(|view| view.0).join(", ")
}

/// A direction to the eye with the up that goes with it: along z there is no upwards along z.
pub(crate) fn with_up(eye: DVec3) -> (DVec3, DVec3) {
    (eye, if eye.x == 0.0 && eye.y == 0.0 { DVec3::Y } else { DVec3::Z })
}
