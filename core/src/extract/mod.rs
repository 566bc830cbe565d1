//! The curves of a surface that a drawing shows.

mod collect;
mod curve;
pub mod facing;
mod kind;
pub mod silhouette;
mod undecided;
pub mod zero_set;

pub use collect::{CurveSet, curves};
pub use curve::{Geometry, Path, SurfaceCurve};
pub use kind::CurveKind;
pub use undecided::UndecidedPart;
