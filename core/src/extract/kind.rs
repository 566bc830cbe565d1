//! Kinds of curve.

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
    /// Two surfaces that are not joined intersect; not inked unless asked for.
    Section,
    /// Line of a fill of what is visible; not a curve of the surface, and only there where a fill is asked for.
    Hatch,
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
            Self::Section => "section",
            Self::Hatch => "hatch",
        }
    }
}
