//! The camera that looks from the light.

use glam::DVec3;
use penvis_core::view::{Camera, CameraError};

/// A camera at the light far away. `light` is the direction to it in the frame of `eye`: right, up, towards the eye. A light from the eye sees what
/// a parallel eye does, upright.
///
/// # Errors
/// If the light has no direction.
pub fn camera(eye: &Camera, light: DVec3) -> Result<Camera, CameraError> {
    let [x, y, z] = eye.axes();
    let direction = x * light.x + y * light.y + z * light.z;
    // Upright as long as the light does not come from above or from below.
    let up = if light.y * light.y > light.x * light.x + light.z * light.z { -z } else { y };
    Camera::orthographic(direction, up)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_light_looks_along_its_direction_from_wherever_it_comes() {
        let eye = Camera::orthographic(DVec3::new(1.0, -2.0, 0.5), DVec3::Z).unwrap();
        for light in [DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z, DVec3::new(-1.0, 1.0, 1.0)] {
            let lamp = camera(&eye, light).unwrap();
            let seen = eye.axes().map(|axis| axis.dot(lamp.axes()[2]));
            assert!((DVec3::from_array(seen) - light.normalize()).length() < 1e-14, "{light}: {seen:?}");
        }
        // A light from the eye sees what the eye does, upright.
        let lamp = camera(&eye, DVec3::Z).unwrap();
        assert!(lamp.axes().iter().zip(eye.axes()).all(|(a, b)| a.distance(b) < 1e-14), "{lamp:?} {eye:?}");
        assert!(camera(&eye, DVec3::ZERO).is_err());
    }
}
