//! Trims: which part of a surface there is.
//!
//! Closed loops of rational B-spline curves in (u, v) bound the part of a surface that is kept: where the even-odd rule
//! over all loops says inside (Elber and Cohen 1989, section 6). The curves are cut into [pieces](TrimPiece) that run
//! one way in both parameters, once, by the roots of their derivatives' Bernstein form. Every question is then answered
//! on the curves themselves: a piece is crossed by a line where one bracketed root of a univariate polynomial says so.

mod error;
mod interval;
mod oriented;
mod piece;
mod rectangle;
#[cfg(test)]
mod tests;
mod trims;

pub use error::TrimError;
pub use oriented::{BorderEdge, TrimCurve};
pub use piece::TrimPiece;
pub use trims::{Cover, Nearby, TrimLoop, Trims};
