//! Which pen draws what, and what becomes of what is hidden.

use super::Hidden;

/// How the strokes of a surface are inked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ink {
    /// Pen of what is visible, from 1.
    pub pen: u32,
    /// What becomes of what is hidden.
    pub hidden: Hidden,
}

impl Default for Ink {
    /// The first pen; what is hidden is left out.
    fn default() -> Self {
        Self { pen: 1, hidden: Hidden::Omit }
    }
}

/// The inks of the surfaces of a model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inks {
    common: Ink,
    own: Vec<Ink>,
}

impl Inks {
    /// One ink for all surfaces.
    #[must_use]
    pub fn uniform(common: Ink) -> Self {
        Self { common, own: Vec::new() }
    }

    /// The first pen for all surfaces.
    #[must_use]
    pub fn hiding(hidden: Hidden) -> Self {
        Self::uniform(Ink { hidden, ..Ink::default() })
    }

    /// An ink for each surface, by its index; those beyond the list have the usual one.
    #[must_use]
    pub fn new(own: Vec<Ink>) -> Self {
        Self { common: Ink::default(), own }
    }

    /// The ink of a surface.
    #[must_use]
    pub fn of(&self, surface: usize) -> Ink {
        self.own.get(surface).copied().unwrap_or(self.common)
    }

    /// The highest pen of all that is visible. What is hidden has pens beyond it.
    #[must_use]
    pub fn last_pen(&self) -> u32 {
        self.own.iter().map(|ink| ink.pen).max().unwrap_or(self.common.pen)
    }
}
