//! Orthographic and exact perspective views.

use glam::{DMat4, DVec3, DVec4};

/// A view: the projective map from model space to view space (screen x to the right, y up, z towards the eye).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    matrix: DMat4,
    /// Unit vectors to the right, up, and towards the eye, in model space.
    axes: [DVec3; 3],
    perspective: bool,
}

/// Why a camera cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// A coordinate is infinite or not a number.
    #[error("a view coordinate is not a finite number; give three finite numbers")]
    NotFinite,
    /// The eye direction has no length, or eye and target coincide.
    #[error("the view has no direction; the eye must differ from its target")]
    NoDirection,
    /// The up vector has no component across the view direction.
    #[error("the up vector is parallel to the view direction; choose another up")]
    UpAlongView,
}

impl Camera {
    /// Parallel projection. `eye_direction` points from the model to the eye; `up` is drawn upwards on the screen.
    /// Lengths on the screen are lengths in the model.
    ///
    /// # Errors
    /// If a coordinate is not finite, the direction has no length, or `up` is parallel to it.
    pub fn orthographic(eye_direction: DVec3, up: DVec3) -> Result<Self, CameraError> {
        let axes = frame(eye_direction, up)?;
        Ok(Self { matrix: rotation(axes), axes, perspective: false })
    }

    /// Exact perspective from `eye` towards `target`. Lengths are true in the plane through `target` across the sight
    /// line, where view z is 0.
    ///
    /// With q = p − target in the camera's frame and f = |eye − target|, screen = (q.x, q.y) / (1 − q.z / f) and
    /// z = q.z / (1 − q.z / f): sight lines become parallels to the z axis and keep their order.
    ///
    /// # Errors
    /// If a coordinate is not finite, eye and target coincide, or `up` is parallel to the sight line.
    pub fn perspective(eye: DVec3, target: DVec3, up: DVec3) -> Result<Self, CameraError> {
        if !target.is_finite() {
            return Err(CameraError::NotFinite);
        }
        let axes = frame(eye - target, up)?;
        let f = (eye - target).length();
        let mut divide = DMat4::IDENTITY;
        divide.z_axis.w = -1.0 / f;
        Ok(Self { matrix: divide * rotation(axes) * DMat4::from_translation(-target), axes, perspective: true })
    }

    /// The map from homogeneous model coordinates to homogeneous view coordinates.
    #[must_use]
    pub fn matrix(&self) -> DMat4 {
        self.matrix
    }

    /// Unit vectors to the right, up, and towards the eye, in model space.
    #[must_use]
    pub fn axes(&self) -> [DVec3; 3] {
        self.axes
    }

    /// Whether sight lines meet in an eye point.
    #[must_use]
    pub fn is_perspective(&self) -> bool {
        self.perspective
    }

    /// A model point in view space; `None` at or behind the eye plane.
    #[must_use]
    pub fn project(&self, p: DVec3) -> Option<DVec3> {
        let h = self.matrix * DVec4::new(p.x, p.y, p.z, 1.0);
        (h.w > 0.0).then(|| DVec3::new(h.x / h.w, h.y / h.w, h.z / h.w))
    }
}

/// The frame x = up × d, y = d × x, d = towards the eye.
fn frame(direction: DVec3, up: DVec3) -> Result<[DVec3; 3], CameraError> {
    if !(direction.is_finite() && up.is_finite()) {
        return Err(CameraError::NotFinite);
    }
    let d = direction.try_normalize().ok_or(CameraError::NoDirection)?;
    let up = up.try_normalize().ok_or(CameraError::UpAlongView)?;
    let side = up.cross(d);
    // Below this sine the screen's x axis would be made of rounding.
    if side.length() < 1e-9 {
        return Err(CameraError::UpAlongView);
    }
    let x = side.normalize();
    Ok([x, d.cross(x), d])
}

/// Rotation into a frame: its axes are the rows.
fn rotation([x, y, d]: [DVec3; 3]) -> DMat4 {
    DMat4::from_cols(
        DVec4::new(x.x, y.x, d.x, 0.0),
        DVec4::new(x.y, y.y, d.y, 0.0),
        DVec4::new(x.z, y.z, d.z, 0.0),
        DVec4::W,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axes_of_a_front_view() {
        let c = Camera::orthographic(DVec3::NEG_Y, DVec3::Z).unwrap();
        assert_eq!(c.project(DVec3::new(1.0, 2.0, 3.0)), Some(DVec3::new(1.0, 3.0, -2.0)));
    }

    #[test]
    fn points_on_a_sight_line_share_a_screen_point_and_keep_their_order() {
        let (eye, target) = (DVec3::new(3.0, -4.0, 2.0), DVec3::new(0.0, 0.5, 0.2));
        let c = Camera::perspective(eye, target, DVec3::Z).unwrap();
        let p = DVec3::new(0.3, 0.1, -0.4);
        let (a, b) = (c.project(p).unwrap(), c.project(eye + (p - eye) * 0.5).unwrap());
        assert!((a.truncate() - b.truncate()).length() < 1e-14);
        assert!(b.z > a.z);
        assert_eq!(c.project(eye + (eye - target)), None);
    }

    #[test]
    fn a_view_without_direction_is_refused() {
        assert_eq!(Camera::orthographic(DVec3::ZERO, DVec3::Z), Err(CameraError::NoDirection));
        assert_eq!(Camera::orthographic(DVec3::Z, DVec3::Z), Err(CameraError::UpAlongView));
        assert_eq!(Camera::orthographic(DVec3::NAN, DVec3::Z), Err(CameraError::NotFinite));
    }
}
