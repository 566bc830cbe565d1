//! The curves of a surface that a drawing shows.

pub mod adaptive;
mod bend;
pub mod chain;
mod collect;
mod curve;
pub mod facing;
mod iso;
mod join;
mod kind;
mod on_line;
pub mod section;
pub mod silhouette;
mod style;
mod trimmed;
mod undecided;
pub mod zero_set;

pub(crate) use collect::all_but_isos;
pub use collect::{CurveOptions, CurveSet, curves};
pub use curve::{Geometry, Path, SurfaceCurve};
pub(crate) use iso::{IsoLine, iso_lines};
pub use kind::CurveKind;
pub(crate) use on_line::{lies_left, lies_left_along, side_lies_left, side_lies_left_along};
pub use style::{Style, Styles};
pub(crate) use trimmed::cut_to_trims;
pub use trimmed::{Kept, kept_parts};
pub use undecided::UndecidedPart;
