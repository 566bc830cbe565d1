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
    #[must_use]
    pub fn bordered(points: Vec<DVec2>) -> Self {
        let smooth = vec![false; points.len()];
        Self { points, smooth }
    }

    /// Its sides, and which of them are smooth joins.
    pub fn sides(&self) -> impl Iterator<Item = ([DVec2; 2], bool)> {
        let next = self.points.iter().cycle().skip(1);
        let smooth = self.smooth.iter().copied().chain(std::iter::repeat(false));
        self.points.iter().zip(next).zip(smooth).map(|((a, b), smooth)| ([*a, *b], smooth))
    }

    /// What of it is no smooth join, as polylines; all of it, closed, if nothing is.
    pub(super) fn walls(&self) -> Vec<Vec<DVec2>> {
        let count = self.points.len();
        let is_smooth = |k: usize| self.smooth.get(k).copied().unwrap_or_default();
        // From behind a join on, so that no wall is cut where the loop begins.
        let first = (0..count).find(|&k| is_smooth(k)).map_or(0, |k| k + 1);
        let mut walls: Vec<Vec<DVec2>> = Vec::new();
        let mut goes_on = false;
        for k in (first..first + count).map(|k| k % count).filter(|_| count > 1) {
            let wall = !is_smooth(k);
            match walls.last_mut() {
                Some(last) if wall && goes_on => last.push(self.points[(k + 1) % count]),
                _ if wall => walls.push(vec![self.points[k], self.points[(k + 1) % count]]),
                _ => {}
            }
            goes_on = wall;
        }
        walls
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn walls_are_what_is_no_join() {
        let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(DVec2::from);
        let walls = |smooth: [bool; 4]| Loop { points: points.to_vec(), smooth: smooth.to_vec() }.walls();
        assert_eq!(walls([false; 4]), [[points[0], points[1], points[2], points[3], points[0]]]);
        assert!(walls([true; 4]).is_empty());
        assert_eq!(walls([false, true, false, false]), [[points[2], points[3], points[0], points[1]]]);
        assert_eq!(walls([true, false, true, false]), [[points[1], points[2]], [points[3], points[0]]]);
        assert!(Loop::default().walls().is_empty());
    }
}
