//! Fills: what the visible parts of surfaces are covered with, in mm on the paper.
//!
//! | module | does |
//! |---|---|
//! | `choice` | what fill is asked for |
//! | `area` | the shapes that are filled |
//! | `hatch` | parallel lines inside a shape |
//! | `contour` | lines along the contours of shapes |
//! | `offset` | shapes kept away from lines, and made smaller |
//! | `iso` | isocurves inside shapes |
//! | `clear`, `keep` | the gap that parallel lines, and others, keep to outlines |
//! | `even` | lines as far apart as it is light, where that is one all over |
//! | `tone` | lines that end where it is light |
//! | `along`, `placed` | lines of many vertices, and the places under them |
//! | `dark`, `shaded` | runs, and polylines, divided by shadows |
//! | `cover` | all of it for a picture |

mod along;
mod area;
pub(crate) mod choice;
mod clear;
mod contour;
mod cover;
mod dark;
mod even;
mod hatch;
mod iso;
mod keep;
mod offset;
mod placed;
mod shaded;
#[cfg(test)]
mod testing;
mod tone;

pub use area::{Area, Loop};
pub use choice::FillChoice;
pub use clear::Gap;
pub use contour::{Ring, rings};
pub use cover::{Canvas, Line, cover};
pub use hatch::{Grid, Run, hatch};
pub use iso::{iso_sets, trimmed};
pub use offset::OffsetError;
pub use shaded::{Light, Shade, divided};

use penvis_core::extract::adaptive::Direction;

/// What a fill is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FillKind {
    /// Parallel lines.
    Hatch,
    /// Two sets of them, at a right angle. With a tone, the second begins where the first can make it no darker.
    Cross,
    /// Lines along the outlines, one within the other until nothing is left.
    Contour,
    /// Isocurves, each of which ends where its neighbours have come near enough.
    Iso,
}

/// How a surface is filled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fill {
    /// What with.
    pub kind: FillKind,
    /// Angle of parallel lines in degrees, counter-clockwise from the lower side of the sheet; 0 for others.
    pub degrees: f64,
    /// Their distance in mm, positive; with a tone, where it is darkest.
    pub pitch_mm: f64,
    /// What they keep from outlines in mm, 0 or more.
    pub gap_mm: f64,
    /// Which isocurves.
    pub direction: Direction,
    /// Number of the pen that draws them.
    pub pen: u32,
}
