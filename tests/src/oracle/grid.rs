//! Screen boxes in the cells of a uniform grid.

use glam::DVec2;

/// For each cell of the screen the boxes that touch it.
pub(super) struct Grid {
    lo: DVec2,
    cell: DVec2,
    across: usize,
    /// Where the cell's items begin in `items`; one more at the end.
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl Grid {
    /// Sorts `count` boxes, given as lower left and upper right corner, into about as many cells.
    pub(super) fn new(count: usize, boxes: impl Fn(usize) -> [DVec2; 2]) -> Self {
        let start = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        let [lo, hi] = (0..count).map(&boxes).fold(start, |[l, h], [a, b]| [l.min(a), h.max(b)]);
        let across = ((count as f64).sqrt() as usize).clamp(1, 1024);
        let cell = ((hi - lo) / across as f64).max(DVec2::splat(f64::MIN_POSITIVE));
        let mut grid = Self { lo, cell, across, starts: vec![0; across * across + 1], items: Vec::new() };
        for k in 0..count {
            grid.touched(boxes(k), |grid, c| grid.starts[c + 1] += 1);
        }
        for c in 0..across * across {
            grid.starts[c + 1] += grid.starts[c];
        }
        grid.items = vec![0; grid.starts[across * across] as usize];
        let mut next = grid.starts.clone();
        for k in 0..count {
            grid.touched(boxes(k), |grid, c| {
                grid.items[next[c] as usize] = k as u32;
                next[c] += 1;
            });
        }
        grid
    }

    /// The boxes that may hold the point.
    pub(super) fn at(&self, q: DVec2) -> &[u32] {
        let x = (q - self.lo) / self.cell;
        let inside = |x: f64| (0.0..=self.across as f64).contains(&x);
        if !(inside(x.x) && inside(x.y)) {
            return &[];
        }
        let c = self.column(x.y) * self.across + self.column(x.x);
        &self.items[self.starts[c] as usize..self.starts[c + 1] as usize]
    }

    fn column(&self, x: f64) -> usize {
        (x as usize).min(self.across - 1)
    }

    fn touched(&mut self, [a, b]: [DVec2; 2], mut f: impl FnMut(&mut Self, usize)) {
        let (a, b) = ((a - self.lo) / self.cell, (b - self.lo) / self.cell);
        for y in self.column(a.y)..=self.column(b.y) {
            for x in self.column(a.x)..=self.column(b.x) {
                f(self, y * self.across + x);
            }
        }
    }
}
