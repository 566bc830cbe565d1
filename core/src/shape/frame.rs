//! Where a shape stands.

use glam::{DVec3, DVec4};

use super::ShapeError;

/// A right-handed orthonormal frame: where a shape stands and which way it points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    origin: DVec3,
    x: DVec3,
    y: DVec3,
    z: DVec3,
}

impl Frame {
    /// The frame of the model space itself.
    pub const WORLD: Self = Self { origin: DVec3::ZERO, x: DVec3::X, y: DVec3::Y, z: DVec3::Z };

    /// The frame with its z axis along `z`, and its x axis along the part of `x` that is perpendicular to it. The lengths
    /// of both do not matter.
    ///
    /// # Errors
    /// If a coordinate is not finite, a vector has no length, or the two are parallel.
    pub fn new(origin: DVec3, z: DVec3, x: DVec3) -> Result<Self, ShapeError> {
        let z = direction("the frame's z axis", z)?;
        let x = direction("the frame's x axis", x)?;
        if !origin.is_finite() {
            return Err(ShapeError::NotFinite { what: "the frame's origin" });
        }
        let across = z.cross(x);
        // Below this sine the direction of the difference is made of rounding.
        if across.length() < 1e-9 {
            return Err(ShapeError::Parallel { what: "the frame's z and x axes" });
        }
        let y = across.normalize();
        Ok(Self { origin, x: y.cross(z), y, z })
    }

    /// The frame with its z axis along `axis`. Its x axis comes from the coordinate axis that is least along it: the frame
    /// along Z is that of the model space, moved.
    ///
    /// # Errors
    /// If a coordinate is not finite, or the axis has no length.
    pub fn along(origin: DVec3, axis: DVec3) -> Result<Self, ShapeError> {
        let a = direction("the axis", axis)?.abs();
        let x = if a.x <= a.y && a.x <= a.z {
            DVec3::X
        } else if a.y <= a.z {
            DVec3::Y
        } else {
            DVec3::Z
        };
        Self::new(origin, axis, x)
    }

    /// The world frame, moved to `origin`.
    ///
    /// # Errors
    /// If a coordinate is not finite.
    pub fn at(origin: DVec3) -> Result<Self, ShapeError> {
        Self::along(origin, DVec3::Z)
    }

    /// The origin.
    #[must_use]
    pub fn origin(&self) -> DVec3 {
        self.origin
    }

    /// The unit vectors x, y, z.
    #[must_use]
    pub fn axes(&self) -> [DVec3; 3] {
        [self.x, self.y, self.z]
    }

    /// The homogeneous point with local homogeneous coordinates (x·w, y·w, z·w, w).
    pub(super) fn place(&self, h: DVec4) -> DVec4 {
        (self.origin * h.w + self.x * h.x + self.y * h.y + self.z * h.z).extend(h.w)
    }
}

/// `v` normalised.
pub(super) fn direction(what: &'static str, v: DVec3) -> Result<DVec3, ShapeError> {
    if !v.is_finite() {
        return Err(ShapeError::NotFinite { what });
    }
    // Scaled first, so that neither huge nor tiny vectors lose their length to over- or underflow of the squares.
    let largest = v.abs().max_element();
    (v / largest).try_normalize().ok_or(ShapeError::NoDirection { what })
}
