//! Broad phase: which boxes on the screen come near a given one. Cost follows the number of near pairs, not of all pairs.

use alloc::vec;
use alloc::vec::Vec;
use core::iter;
use core::ops::Range;

use glam::DVec2;

/// Most cells that a box meets in each direction: a larger one is put into cells that are larger.
const WIDEST: usize = 4;

/// Uniform grids over the screen, each half as fine as the one before it. A box is in the finest in which it meets few cells, so
/// that long boxes, of which many overlap, take no more room than others.
pub(crate) struct Grid {
    levels: Vec<Level>,
}

/// A uniform grid with the boxes that meet each cell.
struct Level {
    origin: DVec2,
    cell: DVec2,
    /// Cells in each direction.
    count: usize,
    /// How many places in cells its boxes take.
    places: usize,
    /// Where the boxes of each cell begin in `items`; nothing if there are none in any.
    starts: Numbers,
    items: Numbers,
}

/// Numbers in half the room while all of them are small.
enum Numbers {
    Narrow(Vec<u16>),
    Wide(Vec<u32>),
}

impl Numbers {
    /// As many zeros, in room for numbers up to `most`.
    fn zeros(count: usize, most: usize) -> Self {
        if most <= usize::from(u16::MAX) { Self::Narrow(vec![0; count]) } else { Self::Wide(vec![0; count]) }
    }

    fn is_empty(&self) -> bool {
        match self {
            Self::Narrow(all) => all.is_empty(),
            Self::Wide(all) => all.is_empty(),
        }
    }

    fn get(&self, k: usize) -> usize {
        match self {
            Self::Narrow(all) => usize::from(all[k]),
            Self::Wide(all) => all[k] as usize,
        }
    }

    /// Sets a number that there is room for.
    fn set(&mut self, k: usize, number: usize) {
        match self {
            Self::Narrow(all) => all[k] = number as u16,
            Self::Wide(all) => all[k] = number as u32,
        }
    }

    /// Adds to a number, and returns what it was before.
    fn add(&mut self, k: usize, more: usize) -> usize {
        let before = self.get(k);
        self.set(k, before + more);
        before
    }

    fn copy(&self, range: Range<usize>, out: &mut Vec<u32>) {
        match self {
            Self::Narrow(all) => out.extend(all[range].iter().map(|&x| u32::from(x))),
            Self::Wide(all) => out.extend_from_slice(&all[range]),
        }
    }
}

impl Grid {
    /// Bins boxes given by their lower left and upper right corners; about two cells a box, so that a cell holds a few.
    /// Room for O(n) of them, whatever their size.
    pub(crate) fn new(boxes: impl Iterator<Item = (DVec2, DVec2)> + Clone) -> Self {
        let start = (DVec2::INFINITY, DVec2::NEG_INFINITY, 0_usize);
        let (mut lo, mut hi, total) = boxes.clone().fold(start, |(lo, hi, n), b| (lo.min(b.0), hi.max(b.1), n + 1));
        if total == 0 {
            (lo, hi) = (DVec2::ZERO, DVec2::ONE);
        }
        let count = (libm::sqrt(2.0 * total as f64) as usize).clamp(1, 1024);
        let extent = (hi - lo).max(DVec2::splat(f64::MIN_POSITIVE));
        let counts = iter::successors(Some(count), |&n| (n > 1).then_some(n / 2));
        let mut levels: Vec<Level> = counts.map(|n| Level::new(lo, extent, n)).collect();
        let last = levels.len() - 1;
        // There are a dozen levels at the most.
        let mut of = Vec::with_capacity(total);
        for (lo, hi) in boxes.clone() {
            let k = levels.iter().position(|l| l.is_wide_enough(lo, hi)).unwrap_or(last);
            levels[k].places += levels[k].cells(lo, hi).count();
            of.push(k as u8);
        }
        levels.iter_mut().for_each(|level| level.begin(total));
        for ((lo, hi), &k) in boxes.clone().zip(&of) {
            levels[usize::from(k)].announce(lo, hi);
        }
        levels.iter_mut().for_each(Level::sum_up);
        for (i, ((lo, hi), &k)) in boxes.zip(&of).enumerate() {
            levels[usize::from(k)].put(i, lo, hi);
        }
        levels.retain(|l| !l.items.is_empty());
        Self { levels }
    }

    /// Indices of the boxes in the cells that the given one meets, in increasing order, each once.
    pub(crate) fn near(&self, lo: DVec2, hi: DVec2, out: &mut Vec<u32>) {
        out.clear();
        for level in &self.levels {
            for c in level.cells(lo, hi) {
                level.items.copy(level.starts.get(c)..level.starts.get(c + 1), out);
            }
        }
        out.sort_unstable();
        out.dedup();
    }
}

impl Level {
    fn new(origin: DVec2, extent: DVec2, count: usize) -> Self {
        let none = || Numbers::zeros(0, 0);
        Self { origin, cell: extent / count as f64, count, places: 0, starts: none(), items: none() }
    }

    /// The first and the last column, and row, of cells that a box meets.
    fn corners(&self, lo: DVec2, hi: DVec2) -> [[usize; 2]; 2] {
        let n = self.count;
        // A cast from float saturates, so points left of the grid fall into the first cell.
        let index = |x: f64, o: f64, w: f64| (((x - o) / w) as usize).min(n - 1);
        let (o, w) = (self.origin, self.cell);
        [[index(lo.x, o.x, w.x), index(hi.x, o.x, w.x)], [index(lo.y, o.y, w.y), index(hi.y, o.y, w.y)]]
    }

    fn cells(&self, lo: DVec2, hi: DVec2) -> impl Iterator<Item = usize> + use<> {
        let (n, [[i0, i1], [j0, j1]]) = (self.count, self.corners(lo, hi));
        (i0..=i1).flat_map(move |i| (j0..=j1).map(move |j| i * n + j))
    }

    fn is_wide_enough(&self, lo: DVec2, hi: DVec2) -> bool {
        self.corners(lo, hi).iter().all(|[first, last]| last.saturating_sub(*first) < WIDEST)
    }

    /// Makes room, if there are boxes here, of `total` in all.
    fn begin(&mut self, total: usize) {
        if self.places > 0 {
            self.starts = Numbers::zeros(self.count * self.count + 2, self.places);
            self.items = Numbers::zeros(self.places, total);
        }
    }

    /// Counts a box that will be put here. Two places on, so that in the end the starts are where they belong.
    fn announce(&mut self, lo: DVec2, hi: DVec2) {
        for c in self.cells(lo, hi) {
            self.starts.add(c + 2, 1);
        }
    }

    fn sum_up(&mut self) {
        if self.places > 0 {
            for c in 1..self.count * self.count + 2 {
                self.starts.add(c, self.starts.get(c - 1));
            }
        }
    }

    fn put(&mut self, box_: usize, lo: DVec2, hi: DVec2) {
        for c in self.cells(lo, hi) {
            let next = self.starts.add(c + 1, 1);
            self.items.set(next, box_);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn every_box_that_meets_another_is_found_once(
            boxes in prop::collection::vec((prop::array::uniform4(0.0..1.0_f64), 0..12_i32), 0..200),
        ) {
            // Of all sizes.
            let corners = |&([x, y, w, h], k): &([f64; 4], i32)| {
                let (lo, size) = (DVec2::new(x, y), DVec2::new(w, h) * libm::pow(2.0, -f64::from(k)));
                (lo, lo + size)
            };
            let boxes: Vec<(DVec2, DVec2)> = boxes.iter().map(corners).collect();
            let grid = Grid::new(boxes.iter().copied());
            let mut near = Vec::new();
            for &(lo, hi) in &boxes {
                grid.near(lo, hi, &mut near);
                prop_assert!(near.windows(2).all(|w| w[0] < w[1]));
                let meets = |k: &usize| boxes[*k].0.cmple(hi).all() && boxes[*k].1.cmpge(lo).all();
                for k in (0..boxes.len()).filter(meets) {
                    prop_assert!(near.binary_search(&(k as u32)).is_ok(), "{}", k);
                }
            }
        }
    }

    #[test]
    fn boxes_are_found_whatever_their_number() {
        for count in [20_000, 70_000] {
            let at = |k: usize| DVec2::new((k % 300) as f64, (k / 300) as f64);
            let grid = Grid::new((0..count).map(|k| (at(k), at(k) + DVec2::splat(0.25))));
            let mut near = Vec::new();
            for k in (0..count).step_by(997).chain([count - 1]) {
                grid.near(at(k), at(k), &mut near);
                assert!(near.binary_search(&(k as u32)).is_ok() && near.len() < 50, "{k} of {count}: {}", near.len());
            }
        }
    }

    #[test]
    fn long_boxes_take_no_more_room_than_small_ones() {
        let count = 5000;
        // From the middle to a ring, as the sides of a fan.
        let spoke = |k: usize| {
            let angle = core::f64::consts::TAU * k as f64 / count as f64;
            let end = DVec2::new(libm::cos(angle), libm::sin(angle));
            (end.min(DVec2::ZERO), end.max(DVec2::ZERO))
        };
        let grid = Grid::new((0..count).map(spoke));
        let room: usize = grid.levels.iter().map(|l| l.places + l.count * l.count).sum();
        assert!(room <= 20 * count, "{room}");
    }
}
