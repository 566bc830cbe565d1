//! Why a curve cannot be pulled back.

/// Why a space curve has no parameter curve.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PullBackError {
    /// The tolerance is not a positive number.
    #[error("the tolerance is {tolerance}; it must be positive and finite")]
    Tolerance {
        /// The tolerance given.
        tolerance: f64,
    },
    /// The curve is nearer than the tolerance to one point everywhere.
    #[error("the curve is a point within the tolerance, at ({}, {}, {}); leave it out", at[0], at[1], at[2])]
    Point {
        /// The point.
        at: [f64; 3],
    },
    /// The curve leaves the surface by more than is allowed.
    #[error(
        "the curve is {distance} from the surface at ({}, {}, {}), more than the {limit} allowed; correct one of them, or allow more", at[0], at[1], at[2]
    )]
    Off {
        /// A point of the curve.
        at: [f64; 3],
        /// Its distance from the surface.
        distance: f64,
        /// The largest distance allowed.
        limit: f64,
    },
    /// The image has a jump, or needs more pieces than are allowed.
    #[error(
        "the image of the curve cannot be followed on the surface past ({}, {}, {}); raise the tolerance, or split curve and surface there", at[0], at[1], at[2]
    )]
    Lost {
        /// A point of the curve.
        at: [f64; 3],
    },
    /// A given image leaves the parameters of the surface.
    #[error("the parameter curve leaves the surface at ({}, {}); extend the surface, or leave the curve out", at[0], at[1])]
    Beyond {
        /// A point (u, v) of the image.
        at: [f64; 2],
    },
    /// A given image is not that of the curve.
    #[error(
        "the parameter curve is {distance} from its curve at ({}, {}, {}), more than the {limit} allowed; leave it out", at[0], at[1], at[2]
    )]
    Apart {
        /// A point of the curve.
        at: [f64; 3],
        /// Distance of the image from there.
        distance: f64,
        /// The largest distance allowed.
        limit: f64,
    },
}
