//! Rational B-spline surfaces.

/// A rational B-spline surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Surface {}
