//! Why a shape cannot be made.

use crate::nurbs::NurbsError;

/// Why a shape cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ShapeError {
    /// A length that must be positive is not.
    #[error("{what} is {value}; it must be positive and finite")]
    NotPositive {
        /// Which length.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A length that may be zero is negative or not finite.
    #[error("{what} is {value}; it must be finite and not negative")]
    Negative {
        /// Which length.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A point or vector has a coordinate that is infinite or not a number.
    #[error("{what} has a coordinate that is not finite; give three finite numbers")]
    NotFinite {
        /// Which vector.
        what: &'static str,
    },
    /// A direction has no length.
    #[error("{what} has no direction; give a vector that is not zero")]
    NoDirection {
        /// Which vector.
        what: &'static str,
    },
    /// Two directions that span a plane are parallel.
    #[error("{what} are parallel; turn one of them")]
    Parallel {
        /// Which vectors.
        what: &'static str,
    },
    /// An angle is zero, more than a full turn, or not finite.
    #[error("the sweep is {sweep} rad; it must be from -2π to 2π and not zero")]
    Sweep {
        /// The angle in radians.
        sweep: f64,
    },
    /// Both radii of a cone, or of an annulus, leave nothing between them.
    #[error("the radii {first} and {second} leave no surface; {remedy}")]
    Radii {
        /// One radius.
        first: f64,
        /// The other.
        second: f64,
        /// What to do.
        remedy: &'static str,
    },
    /// A polyline needs two points.
    #[error("a polyline of {count} points has no length; give at least two")]
    TooFewPoints {
        /// How many were given.
        count: usize,
    },
    /// Two successive points of a polyline are the same.
    #[error("points {} and {index} of the polyline coincide; leave one out", index - 1)]
    EqualPoints {
        /// Index of the second of the two.
        index: usize,
    },
    /// The numbers were fine one by one, but their combination is not (overflow).
    #[error(transparent)]
    Nurbs(#[from] NurbsError),
}

pub(super) fn positive(what: &'static str, value: f64) -> Result<f64, ShapeError> {
    if value > 0.0 && value.is_finite() { Ok(value) } else { Err(ShapeError::NotPositive { what, value }) }
}

pub(super) fn not_negative(what: &'static str, value: f64) -> Result<f64, ShapeError> {
    if value >= 0.0 && value.is_finite() { Ok(value) } else { Err(ShapeError::Negative { what, value }) }
}
