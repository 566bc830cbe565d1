//! Broad phase: which arcs come near a given one. Cost follows the number of near pairs, not of all pairs.

use alloc::vec;
use alloc::vec::Vec;

use glam::DVec2;

use super::arc::Arc;

/// A uniform grid over the screen with the arcs whose boxes meet each cell.
pub(crate) struct Grid {
    origin: DVec2,
    cell: DVec2,
    count: usize,
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Grid {
    /// Bins `arcs`; about two cells an arc, so that a cell holds a few.
    pub(crate) fn new(arcs: &[Arc]) -> Self {
        let (mut lo, mut hi) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for a in arcs {
            lo = lo.min(a.lo);
            hi = hi.max(a.hi);
        }
        if arcs.is_empty() {
            (lo, hi) = (DVec2::ZERO, DVec2::ONE);
        }
        let count = (libm::sqrt(2.0 * arcs.len() as f64) as usize).clamp(1, 1024);
        let extent = (hi - lo).max(DVec2::splat(f64::MIN_POSITIVE));
        let mut grid = Self {
            origin: lo,
            cell: extent / count as f64,
            count,
            starts: vec![0; count * count + 1],
            items: Vec::new(),
        };
        for a in arcs {
            grid.each_cell(a.lo, a.hi, |c, g| g[c + 1] += 1);
        }
        for c in 0..count * count {
            grid.starts[c + 1] += grid.starts[c];
        }
        let mut next = grid.starts.clone();
        let mut items = vec![0; grid.starts[count * count] as usize];
        for (i, a) in arcs.iter().enumerate() {
            for c in grid.cells(a.lo, a.hi) {
                items[next[c] as usize] = i as u32;
                next[c] += 1;
            }
        }
        grid.items = items;
        grid
    }

    fn each_cell(&mut self, lo: DVec2, hi: DVec2, f: impl Fn(usize, &mut [u32])) {
        let cells: Vec<usize> = self.cells(lo, hi).collect();
        for c in cells {
            f(c, &mut self.starts);
        }
    }

    fn cells(&self, lo: DVec2, hi: DVec2) -> impl Iterator<Item = usize> + use<> {
        let n = self.count;
        // A cast from float saturates, so points left of the grid fall into the first cell.
        let index = |x: f64, o: f64, w: f64| (((x - o) / w) as usize).min(n - 1);
        let (i0, i1) = (index(lo.x, self.origin.x, self.cell.x), index(hi.x, self.origin.x, self.cell.x));
        let (j0, j1) = (index(lo.y, self.origin.y, self.cell.y), index(hi.y, self.origin.y, self.cell.y));
        (i0..=i1).flat_map(move |i| (j0..=j1).map(move |j| i * n + j))
    }

    /// Indices of the arcs in the cells that the box meets, in increasing order, each once.
    pub(crate) fn near(&self, lo: DVec2, hi: DVec2, out: &mut Vec<u32>) {
        out.clear();
        for c in self.cells(lo, hi) {
            out.extend_from_slice(&self.items[self.starts[c] as usize..self.starts[c + 1] as usize]);
        }
        out.sort_unstable();
        out.dedup();
    }
}
