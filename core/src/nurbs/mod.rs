//! Checked knot vectors, and rational B-spline curves and surfaces on them.

mod surface;

pub use surface::Surface;
