//! The gap between lines of any course and outlines.

use std::collections::HashMap;

use glam::DVec2;

use super::along::Along;
use super::clear::capsule;

/// Side of a cell in mm, in gaps, and at least.
const CELL: f64 = 4.0;
const LEAST_CELL_MM: f64 = 1.0;

/// Outlines by where they are.
pub(super) struct Outlines {
    gap_mm: f64,
    cell_mm: f64,
    /// Segments that may be nearer than the gap to a place in a cell.
    cells: HashMap<[i64; 2], Vec<[DVec2; 2]>>,
}

impl Outlines {
    pub(super) fn new<'a>(outlines: impl IntoIterator<Item = &'a [DVec2]>, gap_mm: f64) -> Self {
        let mut own = Self { gap_mm, cell_mm: (CELL * gap_mm).max(LEAST_CELL_MM), cells: HashMap::new() };
        // Nothing is nearer than nothing.
        if gap_mm > 0.0 {
            for w in outlines.into_iter().flat_map(|line| line.windows(2)) {
                for cell in own.along([w[0], w[1]], gap_mm) {
                    own.cells.entry(cell).or_default().push([w[0], w[1]]);
                }
            }
        }
        own
    }

    /// The cells that come nearer than `reach` to a segment, and perhaps others beside it.
    fn along(&self, [a, b]: [DVec2; 2], reach: f64) -> Vec<[i64; 2]> {
        // A cast saturates, and makes 0 of what is not a number.
        let index = |x: f64| (x / self.cell_mm).floor() as i64;
        // Long segments at an angle have large boxes: one for each cell that they are long.
        let count = (a.distance(b) / self.cell_mm).ceil().clamp(1.0, 1e6) as u32;
        let at = |k: u32| a.lerp(b, f64::from(k) / f64::from(count));
        let mut cells = Vec::new();
        for k in 0..count {
            let (low, high) = (at(k).min(at(k + 1)) - reach, at(k).max(at(k + 1)) + reach);
            for x in index(low.x)..=index(high.x) {
                cells.extend((index(low.y)..=index(high.y)).map(|y| [x, y]));
            }
        }
        cells.sort_unstable();
        cells.dedup();
        cells
    }

    /// The parts of a polyline that are nowhere nearer to an outline than the gap, as intervals of the way along it, in order. It is exact but for rounding: on a segment
    /// of the one, what is near a segment of the other is one interval. Of a polyline without length nothing is left.
    ///
    /// Cost: O(n log n) in the pairs of segments that lie in a common cell.
    pub(super) fn clear(&self, page: &[DVec2]) -> Vec<[f64; 2]> {
        let along = Along::new(page);
        let mut near: Vec<[f64; 2]> = Vec::new();
        for (k, w) in page.windows(2).enumerate() {
            let Some(forwards) = (w[1] - w[0]).try_normalize() else { continue };
            let (length, from) = (w[0].distance(w[1]), along.up_to(k));
            let frame = |p: DVec2| DVec2::new(forwards.dot(p - w[0]), forwards.perp_dot(p - w[0]));
            let others = self.along([w[0], w[1]], 0.0).into_iter().filter_map(|cell| self.cells.get(&cell)).flatten();
            for [p, q] in others {
                let Some([low, high]) = capsule([frame(*p), frame(*q)], self.gap_mm, 0.0) else { continue };
                let (low, high) = (low.max(0.0), high.min(length));
                if low < high {
                    near.push([from + low, from + high]);
                }
            }
        }
        near.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
        let mut left = Vec::new();
        let mut done = 0.0;
        for [from, to] in near {
            if from > done {
                left.push([done, from]);
            }
            done = to.max(done);
        }
        if done < along.length_mm() {
            left.push([done, along.length_mm()]);
        }
        left
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::testing::distance;
    use super::*;

    #[test]
    fn a_line_is_left_but_for_what_is_near_a_wall() {
        let wall = [DVec2::new(1.0, -5.0), DVec2::new(1.0, 2.0)];
        let line = [[-10.0, 0.0], [0.0, 0.0], [10.0, 0.0], [10.0, 20.0]].map(DVec2::from);
        let left = Outlines::new([&wall[..]], 0.5).clear(&line);
        assert_eq!(left, [[0.0, 10.5], [11.5, 40.0]]);
        assert_eq!(Outlines::new([&wall[..]], 0.0).clear(&line), [[0.0, 40.0]]);
        assert!(Outlines::new([&line[..]], 0.5).clear(&wall[..1]).is_empty());
        assert!(Outlines::new([&line[..]], 0.5).clear(&line).is_empty());
    }

    /// A place, mostly on a coarse grid, so that lines coincide, touch and stand on one another.
    fn place() -> impl Strategy<Value = DVec2> {
        let planted = (0..=6i32, 0..=6i32).prop_map(|(x, y)| DVec2::new(f64::from(x), f64::from(y)));
        prop_oneof![3 => planted, 1 => (0.0..6.0, 0.0..6.0).prop_map(|(x, y)| DVec2::new(x, y))]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]

        #[test]
        fn what_is_left_keeps_the_gap_and_nothing_else_is_missing(
            page in prop::collection::vec(place(), 2..8),
            walls in prop::collection::vec(prop::collection::vec(place(), 2..5), 1..4),
            gap in prop_oneof![Just(0.5), 0.01..2.5f64],
        ) {
            let left = Outlines::new(walls.iter().map(|w| &w[..]), gap).clear(&page);
            let away = |p: DVec2| {
                let sides = walls.iter().flat_map(|w| w.windows(2));
                sides.map(|w| distance(p, [w[0], w[1]])).fold(f64::INFINITY, f64::min)
            };
            prop_assert!(left.iter().all(|part| part[0] < part[1]) && left.windows(2).all(|w| w[0][1] <= w[1][0]));
            let along = Along::new(&page);
            prop_assert!(along.length_mm() > 0.0 || left.is_empty());
            for k in (0..=500).filter(|_| along.length_mm() > 0.0) {
                let mm = along.length_mm() * (f64::from(k) / 500.0);
                let (far, kept) = (away(along.at(mm)), left.iter().any(|part| part[0] <= mm && mm <= part[1]));
                prop_assert!(if kept { far > gap - 1e-9 } else { far < gap + 1e-9 }, "{far} of {gap} at {mm}: {kept}");
            }
        }
    }
}
