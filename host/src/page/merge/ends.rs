//! Which ends of strokes go together.

use std::collections::HashMap;

use glam::DVec2;

use crate::drawing::length_mm;
use crate::page::is_on_paper;

/// Most ends of a cell that an end is compared with at a time. Where more end in one place, not all of the pairs are looked at.
const MOST: usize = 64;

/// Where a stroke ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct End {
    at: DVec2,
    /// Direction out of the stroke.
    out: DVec2,
    /// Whether it has no mate yet.
    pub(super) is_free: bool,
    /// Whether the stroke's other end may be its mate.
    is_ring: bool,
}

impl End {
    /// The two ends of a stroke of two vertices or more; none if they are no places on paper. Directions are those of the chords over `reach`, so that a
    /// hook there does not turn them.
    pub(super) fn of(page: &[DVec2], reach: f64) -> Option<[Self; 2]> {
        let (&first, &last) = (page.first()?, page.last()?);
        if !is_on_paper(page) {
            return None;
        }
        let length = length_mm(page);
        // What is shorter is a dot, and there is no way round in it.
        let is_ring = length > 4.0 * reach;
        let end = |at: DVec2, inner: Option<&DVec2>, other: DVec2| {
            let out = (at - inner.copied().unwrap_or(other)).normalize_or_zero();
            Self { at, out, is_free: true, is_ring }
        };
        let is_off = |from: DVec2| move |p: &&DVec2| p.distance(from) >= reach;
        let inner = [page.iter().find(is_off(first)), page.iter().rev().find(is_off(last))];
        Some([end(first, inner[0], last), end(last, inner[1], first)])
    }
}

/// Ends in square cells as wide as the largest gap.
pub(super) struct Ends<'a> {
    ends: &'a [Option<[End; 2]>],
    groups: &'a [u32],
    gap: f64,
}

type Cell = (u32, i64, i64);

impl<'a> Ends<'a> {
    /// Ends of strokes, each with the group with which it goes; they are as far apart as `gap` at most.
    pub(super) fn new(ends: &'a [Option<[End; 2]>], groups: &'a [u32], gap: f64) -> Self {
        Self { ends, groups, gap }
    }

    /// For each end, two a stroke, the one that it goes together with. No two are left that could, unless more than [`MOST`] end in the same cell.
    ///
    /// Each free end chooses the one that is best for it, and the best pairs get their way, until none is left. A turn takes a good part of the free ends
    /// in a place, so that there are few turns.
    pub(super) fn mates(&self) -> Vec<Option<u32>> {
        let mut mates = vec![None; 2 * self.ends.len()];
        let mut free: Vec<u32> = (0..mates.len() as u32).filter(|&e| self.get(e).is_some_and(|e| e.is_free)).collect();
        loop {
            let mut cells: HashMap<Cell, Vec<u32>> = HashMap::new();
            for &end in &free {
                if let Some(cell) = self.cell(end) {
                    cells.entry(cell).or_default().push(end);
                }
            }
            let best = |&end: &u32| self.best(end, &cells).map(|(cost, mate)| (cost, end.min(mate), end.max(mate)));
            let mut pairs: Vec<(f64, u32, u32)> = free.iter().filter_map(best).collect();
            if pairs.is_empty() {
                return mates;
            }
            pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
            for (_, one, other) in pairs {
                let (a, b) = (one as usize, other as usize);
                if mates[a].is_none() && mates[b].is_none() {
                    (mates[a], mates[b]) = (Some(other), Some(one));
                }
            }
            free.retain(|&end| mates[end as usize].is_none());
        }
    }

    fn get(&self, end: u32) -> Option<&End> {
        self.ends.get(end as usize / 2)?.as_ref().map(|pair| &pair[end as usize & 1])
    }

    fn cell(&self, end: u32) -> Option<Cell> {
        let at = (self.get(end)?.at / self.gap).floor();
        Some((*self.groups.get(end as usize / 2)?, at.x as i64, at.y as i64))
    }

    /// The free end that an end goes together with best, and what that costs.
    fn best(&self, end: u32, cells: &HashMap<Cell, Vec<u32>>) -> Option<(f64, u32)> {
        let (group, x, y) = self.cell(end)?;
        let mut best: Option<(f64, u32)> = None;
        for (i, j) in (-1..=1).flat_map(|i| (-1..=1).map(move |j| (i, j))) {
            let Some(cell) = cells.get(&(group, x.saturating_add(i), y.saturating_add(j))) else { continue };
            // Each end begins at another place, so that not all of them look at the same ones.
            let start = cell.partition_point(|&other| other <= end);
            for &other in cell[start..].iter().chain(&cell[..start]).take(MOST) {
                let Some(cost) = self.cost(end, other) else { continue };
                if best.is_none_or(|b| (cost, other) < b) {
                    best = Some((cost, other));
                }
            }
        }
        best
    }

    /// What it costs that two ends go together: a gap of the largest width as much as a turn back. None if they cannot.
    fn cost(&self, one: u32, other: u32) -> Option<f64> {
        let (a, b) = (self.get(one)?, self.get(other)?);
        let gap = a.at.distance(b.at);
        let is_allowed = gap <= self.gap && one != other && (one ^ 1 != other || a.is_ring);
        is_allowed.then(|| gap / self.gap + (1.0 + a.out.dot(b.out)) / 2.0)
    }
}
