//! Strokes: what the pen draws.
//!
//! Neighbouring pieces of equal visibility are joined, flattened to polylines, and chained where they continue one
//! another.

mod chain;
mod flatten;

pub use chain::chain;
pub use flatten::flatten;

use alloc::vec::Vec;

use glam::{DVec2, DVec3};

/// What a curve is on its surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum CurveKind {
    /// Free edge of a surface.
    Boundary,
    /// Sharp edge: two surfaces, or two pieces of one, meet at an angle.
    Crease,
    /// The surface turns away from the eye.
    Silhouette,
    /// Isoparametric curve.
    Iso,
    /// Smooth join of two surfaces; not inked unless asked for.
    Smooth,
}

impl CurveKind {
    /// The word for it in files and options.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Boundary => "boundary",
            Self::Crease => "crease",
            Self::Silhouette => "silhouette",
            Self::Iso => "iso",
            Self::Smooth => "smooth",
        }
    }
}

/// How a visibility was decided.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Certainty {
    /// Every step had a certificate.
    Proven,
    /// Some step rested on a stated tolerance.
    Tolerance,
    /// Not decided; listed with its place.
    Undecided,
}

impl Certainty {
    /// The word for it in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Proven => "proven",
            Self::Tolerance => "tolerance",
            Self::Undecided => "undecided",
        }
    }
}

/// A vertex of a stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrokePoint {
    /// On the screen, in model units (orthographic) or in the units of the target plane (perspective).
    pub screen: DVec2,
    /// On the surface, in model space.
    pub model: DVec3,
}

/// A polyline of one kind and one quantitative invisibility.
#[derive(Clone, Debug, PartialEq)]
pub struct Stroke {
    /// What the curve is.
    pub kind: CurveKind,
    /// Index of the surface it lies on (the nearer one of a shared curve).
    pub surface: usize,
    /// Quantitative invisibility: sheets in front. 0 is visible.
    pub qi: u32,
    /// The least certain of its pieces.
    pub certainty: Certainty,
    /// Two vertices or more; a closed stroke repeats the first one at its end.
    pub points: Vec<StrokePoint>,
}
