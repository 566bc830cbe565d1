//! Fills: what the visible parts of surfaces are covered with, in mm on the paper.
//!
//! | module | does |
//! |---|---|
//! | [`area`] | the shapes that are filled |
//! | [`mod@hatch`] | parallel lines inside a shape |
//! | [`mod@clear`] | the gap that lines keep to outlines |

mod area;
mod clear;
mod hatch;

pub use area::{Area, Loop};
pub use clear::clear;
pub use hatch::{Grid, Run, hatch};
