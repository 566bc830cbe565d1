//! The view of a model as files and options state it.

use glam::DVec3;
use penvis_core::view::{Camera, CameraError};
use serde::{Deserialize, Serialize};

/// How sight lines run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Parallel to the eye direction.
    Orthographic,
    /// Through an eye point.
    Perspective {
        /// The eye, in model space.
        eye: DVec3,
        /// The point looked at; lengths are true in the plane through it.
        target: DVec3,
    },
}

/// Where the eye is and which way is up, in model space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// From the model to the eye; any length. Perspective looks along eye − target instead.
    pub eye_direction: DVec3,
    /// Drawn upwards on the paper.
    pub up: DVec3,
    /// Parallel or through an eye point.
    pub projection: Projection,
}

impl View {
    /// The isometric view from the right, the front and above: what a model without a view is drawn with.
    pub const ISOMETRIC: Self = Self::orthographic(DVec3::new(1.0, -1.0, 1.0));

    /// Parallel projection with z upwards.
    #[must_use]
    pub const fn orthographic(eye_direction: DVec3) -> Self {
        Self { eye_direction, up: DVec3::Z, projection: Projection::Orthographic }
    }

    /// Perspective through `eye` towards `target`, with z upwards.
    #[must_use]
    pub fn perspective(eye: DVec3, target: DVec3) -> Self {
        Self { eye_direction: eye - target, up: DVec3::Z, projection: Projection::Perspective { eye, target } }
    }

    /// The camera of this view.
    ///
    /// # Errors
    /// If a coordinate is not finite, there is no direction, or up is parallel to it.
    pub fn camera(&self) -> Result<Camera, CameraError> {
        match self.projection {
            Projection::Orthographic => Camera::orthographic(self.eye_direction, self.up),
            Projection::Perspective { eye, target } => Camera::perspective(eye, target, self.up),
        }
    }
}

/// `view` of the surface JSON and of the drawing JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct ViewJson {
    pub(crate) eye_direction: [f64; 3],
    #[serde(default = "up_is_z")]
    pub(crate) up: [f64; 3],
    #[serde(default)]
    pub(crate) projection: ProjectionJson,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum ProjectionJson {
    #[default]
    Orthographic,
    Perspective {
        eye: [f64; 3],
        target: [f64; 3],
    },
}

fn up_is_z() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

impl From<ViewJson> for View {
    fn from(json: ViewJson) -> Self {
        let projection = match json.projection {
            ProjectionJson::Orthographic => Projection::Orthographic,
            ProjectionJson::Perspective { eye, target } => {
                Projection::Perspective { eye: eye.into(), target: target.into() }
            }
        };
        Self { eye_direction: json.eye_direction.into(), up: json.up.into(), projection }
    }
}

impl From<View> for ViewJson {
    fn from(view: View) -> Self {
        let projection = match view.projection {
            Projection::Orthographic => ProjectionJson::Orthographic,
            Projection::Perspective { eye, target } => {
                ProjectionJson::Perspective { eye: eye.into(), target: target.into() }
            }
        };
        Self { eye_direction: view.eye_direction.into(), up: view.up.into(), projection }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_projections_survive_json() {
        let views = [View::ISOMETRIC, View::perspective(DVec3::new(3.0, -4.0, 5.0), DVec3::X)];
        for view in views {
            let text = serde_json::to_string(&ViewJson::from(view)).unwrap();
            let back: ViewJson = serde_json::from_str(&text).unwrap();
            assert_eq!(View::from(back), view, "{text}");
        }
        assert_eq!(
            serde_json::to_string(&ViewJson::from(View::ISOMETRIC)).unwrap(),
            r#"{"eye_direction":[1.0,-1.0,1.0],"up":[0.0,0.0,1.0],"projection":"orthographic"}"#
        );
    }

    #[test]
    fn up_and_projection_have_defaults() {
        let json: ViewJson = serde_json::from_str(r#"{"eye_direction":[1,-1,1]}"#).unwrap();
        assert_eq!(View::from(json), View::ISOMETRIC);
    }
}
