//! Strokes: what the pen draws.
//!
//! Neighbouring pieces of equal visibility are joined, flattened to polylines, and chained where they continue one
//! another.

mod chain;
mod flatten;

pub use chain::chain;
pub(crate) use chain::{chain_each, outline};
pub use flatten::flatten;
pub(crate) use flatten::{from_chord, places, polyline, runs, stroke};

pub use crate::extract::CurveKind;
pub use crate::visibility::Certainty;

use alloc::vec::Vec;

use glam::{DVec2, DVec3};

/// A vertex of a stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrokePoint {
    /// On the screen, in model units (orthographic) or in the units of the target plane (perspective).
    pub screen: DVec2,
    /// On the surface, in model space.
    pub model: DVec3,
}

/// A polyline of one kind, level and quantitative invisibility.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// What the curve is.
    pub kind: CurveKind,
    /// Index of the surface it lies on (the nearer one of a shared curve).
    pub surface: usize,
    /// Index of the surface in whose style it is drawn: of those that share the curve the first that wants it.
    pub style: usize,
    /// Of adaptive isocurves: the level from 0, the coarsest; 0 for all others.
    pub level: u32,
    /// Quantitative invisibility: sheets in front. 0 is visible.
    pub qi: u32,
    /// The least certain of its pieces.
    pub certainty: Certainty,
    /// Two vertices or more; a closed stroke repeats the first one at its end.
    pub points: Vec<StrokePoint>,
}
