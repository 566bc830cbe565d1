//! What of each surface is wanted on paper.

use alloc::vec::Vec;

use super::collect::CurveSet;
use super::kind::CurveKind;

/// What of a surface is wanted on paper. Whatever it is, the surface hides what is behind it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Style {
    /// Kinds of curve.
    pub curves: CurveSet,
    /// Isocurves a direction, equally far apart in the parameter; they stand at the middles of as many equal parts of the
    /// surface's parameter range, or of the box of its trims.
    pub isos: u32,
}

/// The styles of the surfaces of a scene.
///
/// A curve that is a part of several surfaces is drawn if one of them wants its kind, in the style of the first that does.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Styles {
    common: Style,
    own: Vec<Style>,
}

impl Styles {
    /// One style for all surfaces.
    #[must_use]
    pub fn uniform(common: Style) -> Self {
        Self { common, own: Vec::new() }
    }

    /// A style for each surface, by its index. Nothing is wanted of surfaces beyond the list.
    #[must_use]
    pub fn new(own: Vec<Style>) -> Self {
        Self { common: Style { curves: CurveSet::NONE, isos: 0 }, own }
    }

    /// The style of a surface.
    #[must_use]
    pub fn of(&self, surface: usize) -> &Style {
        self.own.get(surface).unwrap_or(&self.common)
    }

    /// The first of the surfaces that wants curves of this kind.
    #[must_use]
    pub fn drawn_by(&self, surfaces: &[usize], kind: CurveKind) -> Option<usize> {
        surfaces.iter().copied().find(|&s| self.of(s).curves.contains(kind))
    }

    /// Whether any surface may want curves of this kind.
    #[must_use]
    pub fn wants(&self, kind: CurveKind) -> bool {
        self.own.iter().chain([&self.common]).any(|style| style.curves.contains(kind))
    }
}
