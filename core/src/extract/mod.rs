//! The curves of a surface that a drawing shows.

pub mod chain;
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
