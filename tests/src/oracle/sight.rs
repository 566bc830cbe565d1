//! Projections written from their geometry, not from the camera's matrix.

use glam::{DVec2, DVec3};
use penvis::model::{Projection, View};

/// Where the eye is.
#[derive(Clone, Copy, Debug)]
pub enum Sight {
    /// At infinity, in this direction from the model.
    Parallel {
        /// From the model to the eye; any length.
        direction: DVec3,
        /// Upwards on the screen.
        up: DVec3,
    },
    /// At a point.
    Central {
        /// The eye.
        eye: DVec3,
        /// What it looks at.
        target: DVec3,
        /// Upwards on the screen.
        up: DVec3,
    },
}

impl From<&View> for Sight {
    fn from(view: &View) -> Self {
        match view.projection {
            Projection::Orthographic => Self::Parallel { direction: view.eye_direction, up: view.up },
            Projection::Perspective { eye, target } => Self::Central { eye, target, up: view.up },
        }
    }
}

impl Sight {
    /// Screen position of a model point, and a height that grows towards the eye.
    ///
    /// Of a point at distance d from the eye along the sight direction, and f the distance of the target, the screen
    /// position is magnified by f / d (similar triangles) and the height is f² / d: of all functions of the distance
    /// the one for which flat triangles stay flat. Near the target it changes as lengths do.
    #[must_use]
    pub fn project(&self, p: DVec3) -> DVec3 {
        match *self {
            Self::Parallel { direction, up } => {
                let (right, upwards, towards) = frame(direction, up);
                DVec3::new(p.dot(right), p.dot(upwards), p.dot(towards))
            }
            Self::Central { eye, target, up } => {
                let (right, upwards, towards) = frame(eye - target, up);
                let f = (eye - target).dot(towards);
                let d = (eye - p).dot(towards);
                let flat = DVec2::new((p - eye).dot(right), (p - eye).dot(upwards));
                (flat * (f / d)).extend(f * f / d)
            }
        }
    }
}

fn frame(direction: DVec3, up: DVec3) -> (DVec3, DVec3, DVec3) {
    let towards = direction.normalize();
    let right = up.cross(towards).normalize();
    (right, towards.cross(right), towards)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_screen_is_the_camera_s() {
        let (eye, target, up) = (DVec3::new(3.0, -5.0, 4.0), DVec3::new(0.2, 0.1, 0.5), DVec3::Z);
        let views = [View::perspective(eye, target), View { up, ..View::orthographic(eye) }];
        for view in views {
            let (camera, sight) = (view.camera().unwrap(), Sight::from(&view));
            for p in [DVec3::X, DVec3::new(-0.3, 0.7, 1.1), target] {
                let (a, b) = (camera.project(p).unwrap(), sight.project(p));
                assert!((a - b).truncate().length() < 1e-13);
            }
        }
    }
}
