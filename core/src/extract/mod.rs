//! The curves of a surface that a drawing shows.

mod collect;
mod curve;
pub mod facing;
pub mod silhouette;
pub mod zero_set;

pub use collect::{CurveSet, curves};
pub use curve::{Geometry, Path, SurfaceCurve};
