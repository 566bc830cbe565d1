//! What can be wrong with a curve or surface.

use core::fmt;

/// One of the two parameters of a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// The first parameter, u.
    U,
    /// The second parameter, v.
    V,
}

impl fmt::Display for Direction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::U => "u",
            Self::V => "v",
        })
    }
}

/// Why a knot vector, curve or surface cannot be made, or an operation not be done.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NurbsError {
    /// The degree is zero or higher than the fixed scratch allows.
    #[error("degree {degree} is not supported; use 1 to {max}")]
    Degree {
        /// The degree asked for.
        degree: usize,
        /// The highest degree, [`MAX_DEGREE`](crate::view::MAX_DEGREE).
        max: usize,
    },
    /// There are not even enough knots for one span.
    #[error("{count} knots are too few for degree {degree}; give at least {least} (control points + degree + 1)")]
    TooFewKnots {
        /// Number of knots given.
        count: usize,
        /// The degree.
        degree: usize,
        /// The smallest legal number.
        least: usize,
    },
    /// A knot is infinite or not a number, or so large that differences of knots overflow.
    #[error("knot {index} is {value}; knots must be finite numbers with finite differences")]
    KnotNotFinite {
        /// Index in the knot vector.
        index: usize,
        /// The knot.
        value: f64,
    },
    /// A knot is smaller than the one before it.
    #[error("knot {index} is {value}, less than knot {} before it; sort the knots", index - 1)]
    KnotDecreases {
        /// Index of the smaller knot.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A knot is repeated so often that the curve would fall apart there.
    #[error(
        "knot {value} (from index {index}) is repeated {multiplicity} times; at most {most} are allowed there, so remove some or split"
    )]
    Multiplicity {
        /// Index of the first of the equal knots.
        index: usize,
        /// Their value.
        value: f64,
        /// How many there are.
        multiplicity: usize,
        /// How many may be: degree inside the domain, degree + 1 at its ends and beyond.
        most: usize,
    },
    /// The knots degree and (count − degree − 1), the ends of the domain, are equal.
    #[error("the domain is the single point {at} (knots {first} to {last}); spread the knots")]
    EmptyDomain {
        /// Index of the knot that begins the domain.
        first: usize,
        /// Index of the knot that ends it.
        last: usize,
        /// Their common value.
        at: f64,
    },
    /// The number of control points does not agree with the knots.
    #[error(
        "{count} control points, but the knots and degrees ask for {expected} (knots − degree − 1 in each direction)"
    )]
    PointCount {
        /// Control points given.
        count: usize,
        /// Control points that the knots ask for.
        expected: usize,
    },
    /// A coordinate is infinite, not a number, or overflows when multiplied by its weight.
    #[error("control point {index} has a coordinate that is not finite (or overflows with its weight); correct it")]
    PointNotFinite {
        /// Index of the control point, for a surface iu · nv + iv.
        index: usize,
    },
    /// A weight is zero, negative, infinite or not a number.
    #[error("control point {index} has weight {weight}; weights must be positive and finite")]
    Weight {
        /// Index of the control point, for a surface iu · nv + iv.
        index: usize,
        /// The weight.
        weight: f64,
    },
    /// A parameter is outside the domain, or at an end where something inside is asked for.
    #[error("{t} is not inside the domain {start} to {end}; give a parameter strictly between")]
    OutsideDomain {
        /// The parameter.
        t: f64,
        /// Start of the domain.
        start: f64,
        /// End of the domain.
        end: f64,
    },
    /// An inserted knot would have more copies than the degree.
    #[error("knot {value} would be repeated {multiplicity} times; at most {most} are allowed inside the domain")]
    InsertsTooMany {
        /// The knot.
        value: f64,
        /// How many copies there would be.
        multiplicity: usize,
        /// How many may be, the degree.
        most: usize,
    },
    /// A projective map sends a control point to infinity or behind the eye.
    #[error(
        "the map gives control point {index} the weight {weight}; move the model in front of the eye plane, or cut it there"
    )]
    Projection {
        /// Index of the control point, for a surface iu · nv + iv.
        index: usize,
        /// Its weight after the map.
        weight: f64,
    },
}
