//! Which pen draws what, and what becomes of what is hidden.

use std::collections::BTreeMap;

use penvis_core::stroke::CurveKind;

use super::{HIDDEN_LAYER, Hidden};

/// Kinds of curve, in the order of [`CurveKind`].
const KINDS: [CurveKind; 7] = [
    CurveKind::Boundary,
    CurveKind::Crease,
    CurveKind::Silhouette,
    CurveKind::Iso,
    CurveKind::Smooth,
    CurveKind::Section,
    CurveKind::Hatch,
];

/// Pens, numbered from 1, by what they draw, as far as somebody says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct KindPens {
    visible: [Option<u32>; KINDS.len()],
    hidden: Option<u32>,
}

impl KindPens {
    /// One pen for everything that is visible.
    #[must_use]
    pub fn all(pen: u32) -> Self {
        Self { visible: [Some(pen); KINDS.len()], hidden: None }
    }

    /// These pens, but for a kind.
    #[must_use]
    pub fn with(mut self, kind: CurveKind, pen: u32) -> Self {
        self.visible[kind as usize] = Some(pen);
        self
    }

    /// These pens, but for what is hidden.
    #[must_use]
    pub fn with_hidden(self, pen: u32) -> Self {
        Self { hidden: Some(pen), ..self }
    }

    /// These pens, and where nothing is said those of another choice.
    #[must_use]
    pub fn or(self, other: Self) -> Self {
        let visible = KINDS.map(|kind| self.visible[kind as usize].or(other.visible[kind as usize]));
        Self { visible, hidden: self.hidden.or(other.hidden) }
    }

    /// The pen of visible curves of a kind: the first, if nothing is said.
    #[must_use]
    pub fn of(&self, kind: CurveKind) -> u32 {
        self.visible[kind as usize].unwrap_or(1)
    }

    /// The pen of what is hidden, if one is said.
    #[must_use]
    pub fn of_hidden(&self) -> Option<u32> {
        self.hidden
    }

    /// The pen of everything that is visible, if it is one.
    #[must_use]
    pub fn only(&self) -> Option<u32> {
        let pens = KINDS.map(|kind| self.of(kind));
        pens.iter().all(|pen| *pen == pens[0]).then_some(pens[0])
    }

    fn last(&self) -> u32 {
        KINDS.iter().map(|kind| self.of(*kind)).max().unwrap_or(1)
    }
}

/// How the strokes of a surface are inked.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ink {
    /// The pens.
    pub pens: KindPens,
    /// What becomes of what is hidden.
    pub hidden: Hidden,
}

impl Ink {
    /// One pen for everything, and what becomes of what is hidden.
    #[must_use]
    pub fn new(pen: u32, hidden: Hidden) -> Self {
        Self { pens: KindPens::all(pen), hidden }
    }
}

/// The inks of the surfaces of a model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inks {
    common: Ink,
    own: Vec<Ink>,
    /// Pens by layer, which go before those of the surfaces.
    layers: BTreeMap<String, u32>,
}

impl Inks {
    /// The first pen for all surfaces.
    #[must_use]
    pub fn hiding(hidden: Hidden) -> Self {
        Self { common: Ink { hidden, ..Ink::default() }, ..Self::default() }
    }

    /// An ink for each surface, by its index; those beyond the list have the usual one.
    #[must_use]
    pub fn new(own: Vec<Ink>) -> Self {
        Self { own, ..Self::default() }
    }

    /// These inks, but with pens for some layers, by name.
    #[must_use]
    pub fn with_layers(self, layers: BTreeMap<String, u32>) -> Self {
        Self { layers, ..self }
    }

    /// The ink of a surface.
    #[must_use]
    pub fn of(&self, surface: usize) -> Ink {
        self.own.get(surface).copied().unwrap_or(self.common)
    }

    /// The pens of layers that go before those of the surfaces.
    #[must_use]
    pub fn layers(&self) -> &BTreeMap<String, u32> {
        &self.layers
    }

    /// The pen of visible curves of a kind on a surface that are on this layer.
    #[must_use]
    pub fn visible(&self, surface: usize, kind: CurveKind, layer: &str) -> u32 {
        self.layers.get(layer).copied().unwrap_or_else(|| self.of(surface).pens.of(kind))
    }

    /// The pen of what is hidden on a surface and on this layer, if one is said.
    #[must_use]
    pub fn hidden(&self, surface: usize, layer: &str) -> Option<u32> {
        self.layers.get(layer).copied().or(self.of(surface).pens.of_hidden())
    }

    /// Whether anything hidden is drawn in dashes.
    #[must_use]
    pub fn have_dashes(&self) -> bool {
        let is_dashed = |ink: &Ink| matches!(ink.hidden, Hidden::Dashed(_));
        if self.own.is_empty() { is_dashed(&self.common) } else { self.own.iter().any(is_dashed) }
    }

    /// The highest pen of all that is visible. What is hidden has pens beyond it, unless they are said.
    #[must_use]
    pub fn last_pen(&self) -> u32 {
        let layers = self.layers.iter().filter(|(layer, _)| !layer.starts_with(HIDDEN_LAYER)).map(|(_, pen)| *pen);
        let surfaces = self.own.iter().map(|ink| ink.pens.last());
        surfaces.chain(layers).max().unwrap_or(self.common.pens.last())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_are_in_order() {
        for (index, kind) in KINDS.iter().enumerate() {
            assert_eq!(*kind as usize, index);
        }
    }

    #[test]
    fn layers_go_before_kinds_and_kinds_before_what_is_usual() {
        let pens = KindPens::default().with(CurveKind::Iso, 3).or(KindPens::all(2).with(CurveKind::Iso, 9));
        assert_eq!((pens.of(CurveKind::Iso), pens.of(CurveKind::Crease), pens.only()), (3, 2, None));
        assert_eq!((KindPens::all(4).only(), KindPens::default().only()), (Some(4), Some(1)));
        let layers = BTreeMap::from([("iso-2".to_owned(), 5), ("hidden-1".to_owned(), 8)]);
        let inks = Inks::new(vec![Ink { pens, hidden: Hidden::Layer }]).with_layers(layers);
        assert_eq!(inks.visible(0, CurveKind::Iso, "iso-1"), 3);
        assert_eq!(inks.visible(0, CurveKind::Iso, "iso-2"), 5);
        assert_eq!((inks.hidden(0, "hidden-1"), inks.hidden(0, "hidden-2"), inks.last_pen()), (Some(8), None, 5));
    }
}
