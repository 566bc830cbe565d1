//! What is filled: shapes on the paper.

use glam::DVec2;

/// A closed line that borders a shape.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Loop {
    /// Its corners in mm; the last is joined to the first.
    pub points: Vec<DVec2>,
    /// For each corner whether the side from it on is a smooth join, beyond which the same thing goes on.
    pub smooth: Vec<bool>,
}

impl Loop {
    /// Of sides that are all borders.
    #[cfg(test)]
    pub(super) fn bordered(points: Vec<DVec2>) -> Self {
        let smooth = vec![false; points.len()];
        Self { points, smooth }
    }

    /// Its sides, and which of them are smooth joins.
    pub fn sides(&self) -> impl Iterator<Item = ([DVec2; 2], bool)> {
        let next = self.points.iter().cycle().skip(1);
        let smooth = self.smooth.iter().copied().chain(std::iter::repeat(false));
        self.points.iter().zip(next).zip(smooth).map(|((a, b), smooth)| ([*a, *b], smooth))
    }
}

/// A shape on the paper: what its loops wind round more often one way than the other, so that holes run against the loop
/// that they are in.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Area {
    /// Index of the surface that is seen there.
    pub surface: usize,
    /// Outer loops and holes.
    pub loops: Vec<Loop>,
}
