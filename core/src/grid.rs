//! Broad phase: which boxes on the screen come near a given one. Cost follows the number of near pairs, not of all pairs.

use alloc::vec;
use alloc::vec::Vec;

use glam::DVec2;

/// A uniform grid over the screen with the boxes that meet each cell.
pub(crate) struct Grid {
    origin: DVec2,
    cell: DVec2,
    count: usize,
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Grid {
    /// Bins boxes given by their lower left and upper right corners; about two cells a box, so that a cell holds a few.
    pub(crate) fn new(boxes: impl Iterator<Item = (DVec2, DVec2)> + Clone) -> Self {
        let start = (DVec2::INFINITY, DVec2::NEG_INFINITY, 0_usize);
        let (mut lo, mut hi, total) = boxes.clone().fold(start, |(lo, hi, n), b| (lo.min(b.0), hi.max(b.1), n + 1));
        if total == 0 {
            (lo, hi) = (DVec2::ZERO, DVec2::ONE);
        }
        let count = (libm::sqrt(2.0 * total as f64) as usize).clamp(1, 1024);
        let extent = (hi - lo).max(DVec2::splat(f64::MIN_POSITIVE));
        let mut starts = vec![0; count * count + 1];
        let mut grid = Self { origin: lo, cell: extent / count as f64, count, starts: Vec::new(), items: Vec::new() };
        for (lo, hi) in boxes.clone() {
            grid.cells(lo, hi).for_each(|c| starts[c + 1] += 1);
        }
        for c in 0..count * count {
            starts[c + 1] += starts[c];
        }
        let mut next = starts.clone();
        let mut items = vec![0; starts[count * count] as usize];
        for (i, (lo, hi)) in boxes.enumerate() {
            for c in grid.cells(lo, hi) {
                items[next[c] as usize] = i as u32;
                next[c] += 1;
            }
        }
        grid.starts = starts;
        grid.items = items;
        grid
    }

    fn cells(&self, lo: DVec2, hi: DVec2) -> impl Iterator<Item = usize> + use<> {
        let n = self.count;
        // A cast from float saturates, so points left of the grid fall into the first cell.
        let index = |x: f64, o: f64, w: f64| (((x - o) / w) as usize).min(n - 1);
        let (i0, i1) = (index(lo.x, self.origin.x, self.cell.x), index(hi.x, self.origin.x, self.cell.x));
        let (j0, j1) = (index(lo.y, self.origin.y, self.cell.y), index(hi.y, self.origin.y, self.cell.y));
        (i0..=i1).flat_map(move |i| (j0..=j1).map(move |j| i * n + j))
    }

    /// Indices of the boxes in the cells that the given one meets, in increasing order, each once.
    pub(crate) fn near(&self, lo: DVec2, hi: DVec2, out: &mut Vec<u32>) {
        out.clear();
        for c in self.cells(lo, hi) {
            out.extend_from_slice(&self.items[self.starts[c] as usize..self.starts[c + 1] as usize]);
        }
        out.sort_unstable();
        out.dedup();
    }
}
