//! The order of drawing: from each end to the nearest stroke that is left.

use glam::DVec2;

use crate::drawing::Polyline;

/// Orders polylines so that the pen travels little: pen by pen, level by level, from the lower left corner always on to the nearest end of
/// what is left, turning polylines where their last vertex is the nearer one. Ties go to the earlier polyline.
///
/// Cost: a grid of the ends finds the nearest one in about constant time, so O(n log n) unless ends are clustered.
#[must_use]
pub fn order(polylines: Vec<Polyline>) -> Vec<Polyline> {
    let turn_of = |p: &Polyline| (p.pen, p.level);
    let mut turns: Vec<(u32, u32)> = polylines.iter().map(turn_of).collect();
    turns.sort_unstable();
    turns.dedup();
    let mut left: Vec<Option<Polyline>> = polylines.into_iter().map(Some).collect();
    let mut ordered = Vec::with_capacity(left.len());
    let mut at = DVec2::ZERO;
    for turn in turns {
        let ends = left.iter().enumerate().filter_map(|(index, polyline)| {
            let polyline = polyline.as_ref().filter(|p| turn_of(p) == turn)?;
            Some((index, *polyline.page.first()?, *polyline.page.last()?))
        });
        let mut grid = Grid::new(ends.collect());
        while let Some((index, turn)) = grid.take_nearest(at) {
            let Some(mut polyline) = left[index].take() else { continue };
            if turn {
                polyline.page.reverse();
                polyline.points.reverse();
            }
            at = polyline.page.last().copied().unwrap_or(at);
            ordered.push(polyline);
        }
    }
    ordered
}

/// An end of a polyline.
#[derive(Clone, Copy)]
struct End {
    at: DVec2,
    /// Which entry of the list.
    entry: usize,
    /// Whether it is the last vertex.
    last: bool,
}

/// Ends of polylines in square cells, about two in each.
struct Grid {
    /// Index of the polyline, and the cells of its first and last vertex.
    entries: Vec<(usize, [usize; 2])>,
    cells: Vec<Vec<End>>,
    columns: i64,
    rows: i64,
    low: DVec2,
    size: f64,
    left: usize,
}

impl Grid {
    fn new(ends: Vec<(usize, DVec2, DVec2)>) -> Self {
        let points = ends.iter().flat_map(|e| [e.1, e.2]);
        let low = points.clone().fold(DVec2::INFINITY, DVec2::min);
        let extent = points.fold(DVec2::NEG_INFINITY, DVec2::max) - low;
        let count = ends.len().max(1) as f64;
        // Cells for an even spread; a narrow extent still gets no more than a cell for each end.
        let size = (extent.x * extent.y / count).sqrt().max(extent.max_element() / count);
        let size = if size.is_finite() && size > 0.0 { size } else { 1.0 };
        let across = |extent: f64| ((extent / size).floor().max(0.0) as i64).saturating_add(1);
        let (columns, rows) = if extent.is_finite() { (across(extent.x), across(extent.y)) } else { (1, 1) };
        let mut grid = Self {
            entries: Vec::with_capacity(ends.len()),
            cells: vec![Vec::new(); (columns * rows) as usize],
            columns,
            rows,
            low,
            size,
            left: ends.len(),
        };
        for (entry, (index, first, last)) in ends.into_iter().enumerate() {
            let cells = [first, last].map(|at| {
                let (column, row) = grid.cell(at);
                (row * columns + column) as usize
            });
            grid.cells[cells[0]].push(End { at: first, entry, last: false });
            grid.cells[cells[1]].push(End { at: last, entry, last: true });
            grid.entries.push((index, cells));
        }
        grid
    }

    /// Column and row of a point, held inside the grid.
    fn cell(&self, at: DVec2) -> (i64, i64) {
        // A cast saturates, and makes 0 of what is not a number.
        let column = ((at.x - self.low.x) / self.size).floor() as i64;
        let row = ((at.y - self.low.y) / self.size).floor() as i64;
        (column.clamp(0, self.columns - 1), row.clamp(0, self.rows - 1))
    }

    /// Takes the polyline with the nearest end out; whether that end is its last vertex.
    fn take_nearest(&mut self, at: DVec2) -> Option<(usize, bool)> {
        if self.left == 0 {
            return None;
        }
        let (column, row) = self.cell(at);
        let mut best: Option<(f64, usize, bool)> = None;
        for ring in 0..self.columns.max(self.rows) {
            // Cells of this ring are at least `ring − 1` cells away from a point inside the grid, and no nearer from outside.
            if best.is_some_and(|(distance, ..)| distance < (ring - 1) as f64 * self.size) {
                break;
            }
            self.search_ring(column, row, ring, at, &mut best);
        }
        let (_, entry, last) = best?;
        let (index, cells) = self.entries[entry];
        for cell in cells {
            self.cells[cell].retain(|end| end.entry != entry);
        }
        self.left -= 1;
        Some((index, last))
    }

    fn search_ring(&self, column: i64, row: i64, ring: i64, at: DVec2, best: &mut Option<(f64, usize, bool)>) {
        for y in (row - ring).max(0)..=(row + ring).min(self.rows - 1) {
            // Between the first and the last row of a ring only its two sides belong to it.
            let step = if (y - row).abs() == ring { 1 } else { (2 * ring).max(1) };
            let mut x = column - ring;
            while x <= column + ring {
                if (0..self.columns).contains(&x) {
                    for end in &self.cells[(y * self.columns + x) as usize] {
                        let candidate = (at.distance(end.at), end.entry, end.last);
                        if best.is_none_or(|b| candidate < b) {
                            *best = Some(candidate);
                        }
                    }
                }
                x += step;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use penvis_core::stroke::{Certainty, CurveKind};
    use proptest::prelude::*;

    use super::*;

    fn line(a: DVec2, b: DVec2, pen: u32) -> Polyline {
        Polyline {
            kind: CurveKind::Iso,
            surface: 0,
            layer: "iso".into(),
            pen,
            level: 0,
            visible: true,
            qi: 0,
            certainty: Certainty::Proven,
            points: vec![a.extend(0.0), b.extend(0.0)],
            page: vec![a, b],
        }
    }

    /// The same rule without a grid.
    fn slow(mut left: Vec<Polyline>) -> Vec<Polyline> {
        let (mut at, mut out) = (DVec2::ZERO, Vec::new());
        while !left.is_empty() {
            let mut best = (f64::INFINITY, 0, false);
            for (k, p) in left.iter().enumerate() {
                for (last, end) in [(false, p.page[0]), (true, p.page[1])] {
                    let candidate = (at.distance(end), k, last);
                    if candidate < best {
                        best = candidate;
                    }
                }
            }
            let mut p = left.remove(best.1);
            if best.2 {
                p.page.reverse();
                p.points.reverse();
            }
            at = p.page[1];
            out.push(p);
        }
        out
    }

    #[test]
    fn polylines_are_turned_and_pens_kept_together() {
        let p = |x: f64| DVec2::new(x, 1.0);
        let ordered = order(vec![line(p(9.0), p(5.0), 1), line(p(1.0), p(2.0), 2), line(p(4.0), p(0.0), 1)]);
        let starts: Vec<_> = ordered.iter().map(|l| (l.pen, l.page[0].x, l.points[1].x)).collect();
        assert_eq!(starts, [(1, 0.0, 4.0), (1, 5.0, 9.0), (2, 2.0, 1.0)]);
        assert!(order(Vec::new()).is_empty());
    }

    #[test]
    fn levels_are_drawn_one_after_the_other_with_each_pen() {
        let p = |x: f64| DVec2::new(x, 1.0);
        let mut lines: Vec<_> =
            (0..6).map(|k| line(p(f64::from(k)), p(f64::from(k) + 0.5), 1 + k as u32 % 2)).collect();
        for (k, l) in lines.iter_mut().enumerate() {
            l.level = 2 - k as u32 / 2;
        }
        let turns: Vec<_> = order(lines).iter().map(|l| (l.pen, l.level)).collect();
        assert_eq!(turns, [(1, 0), (1, 1), (1, 2), (2, 0), (2, 1), (2, 2)]);
    }

    #[test]
    fn ends_on_a_line_or_in_a_point_are_ordered_too() {
        for scale in [0.0, 1e-300, 1.0, 1e300] {
            let lines: Vec<_> =
                (0..50).map(|k| line(DVec2::new(f64::from(k * 7 % 50), 0.0) * scale, DVec2::ZERO, 1)).collect();
            assert_eq!(order(lines).len(), 50);
        }
    }

    proptest! {
        #[test]
        fn the_grid_finds_the_nearest(
            ends in prop::collection::vec(((0.0..300.0, 0.0..5.0), (0.0..30.0, -200.0..200.0)), 0..120)
        ) {
            let lines: Vec<_> = ends.into_iter().map(|(a, b)| line(a.into(), b.into(), 1)).collect();
            prop_assert_eq!(order(lines.clone()), slow(lines));
        }
    }
}
