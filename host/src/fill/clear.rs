//! The gap between the lines of a grid and outlines.

use glam::DVec2;

use super::hatch::{Grid, Run};

/// A part of a line that is too near an outline.
struct Near {
    line: i64,
    along: [f64; 2],
}

/// Where lines of a grid are too near outlines.
pub struct Gap {
    /// Line by line, and by their beginnings.
    near: Vec<Near>,
}

impl Gap {
    /// Where the lines of `grid` are nearer than `gap_mm` to a line of `outlines`. It is exact but for rounding: on a line, what is
    /// near a segment is one interval, the line's part in the segment's capsule.
    ///
    /// Cost: O(n log n) in the lines that come near a segment.
    #[must_use]
    pub fn new<'a>(grid: &Grid, outlines: impl IntoIterator<Item = &'a [DVec2]>, gap_mm: f64) -> Self {
        let mut near = Vec::new();
        // Nothing is nearer than nothing; what is no number is no gap.
        if !(gap_mm > 0.0 && gap_mm.is_finite()) {
            return Self { near };
        }
        for line in outlines {
            let framed: Vec<DVec2> = line.iter().map(|p| grid.frame(*p)).collect();
            for w in framed.windows(2) {
                let (low, high) = (w[0].y.min(w[1].y) - gap_mm, w[0].y.max(w[1].y) + gap_mm);
                near.extend(grid.lines([low, high]).filter_map(|line| {
                    let along = capsule([w[0], w[1]], gap_mm, grid.across(line))?;
                    Some(Near { line, along })
                }));
            }
        }
        near.sort_unstable_by(|a, b| a.line.cmp(&b.line).then(a.along[0].total_cmp(&b.along[0])));
        Self { near }
    }

    /// What is left of runs, in their order, which is that of [`hatch`](super::hatch()).
    #[must_use]
    pub fn clear(&self, runs: &[Run]) -> Vec<Run> {
        let mut left = Vec::with_capacity(runs.len());
        let mut rest = &self.near[..];
        for run in runs.chunk_by(|a, b| a.line == b.line) {
            let Some(first) = run.first() else { continue };
            rest = &rest[rest.partition_point(|n| n.line < first.line)..];
            let own = &rest[..rest.partition_point(|n| n.line == first.line)];
            run.iter().for_each(|run| subtract(*run, own, &mut left));
        }
        left
    }
}

/// The parts of a run outside intervals, which are in the order of their beginnings.
fn subtract(mut run: Run, near: &[Near], out: &mut Vec<Run>) {
    for Near { along: [from, to], .. } in near {
        if *to <= run.along[0] {
            continue;
        }
        if *from >= run.along[1] {
            break;
        }
        if *from > run.along[0] {
            out.push(Run { along: [run.along[0], *from], joins: [run.joins[0], false], ..run });
        }
        (run.along[0], run.joins[0]) = (*to, false);
        if run.along[0] >= run.along[1] {
            return;
        }
    }
    out.push(run);
}

/// Where a horizontal line at `y` is nearer than `r` to a segment: the convex hull of where it is in the discs about the ends, and
/// in the rectangle between them. `None` if it is nowhere.
pub(super) fn capsule([p, q]: [DVec2; 2], r: f64, y: f64) -> Option<[f64; 2]> {
    let mut hull: Option<[f64; 2]> = None;
    let mut add = |x: f64| hull = Some(hull.map_or([x, x], |[low, high]| [low.min(x), high.max(x)]));
    for centre in [p, q] {
        let square = r * r - (y - centre.y) * (y - centre.y);
        if square > 0.0 {
            let half = square.sqrt();
            add(centre.x - half);
            add(centre.x + half);
        }
    }
    if let Some(along) = (q - p).try_normalize() {
        let n = along.perp() * r;
        let corners = [p + n, q + n, q - n, p - n];
        for (k, a) in corners.iter().enumerate() {
            let b = corners[(k + 1) % 4];
            if (a.y <= y) != (b.y <= y) {
                add(a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x));
            }
        }
    }
    hull.filter(|[low, high]| low < high)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::area::Loop;
    use super::super::hatch::hatch;
    use super::super::testing::{corner, distance, winds};
    use super::*;

    #[test]
    fn a_line_keeps_its_gap_from_a_segment_across_and_beyond_its_end() {
        let run = |line| Run { line, along: [-10.0, 10.0], joins: [true, true] };
        let wall = [DVec2::new(1.0, -5.0), DVec2::new(1.0, 2.0)];
        let gap = Gap::new(&Grid::new(0.0, 1.0), [&wall[..]], 0.5);
        let left = gap.clear(&[run(0), run(1), run(2), run(3)]);
        let on = |line| left.iter().filter(|r| r.line == line).map(|r| r.along).collect::<Vec<_>>();
        for line in 0..=2 {
            assert_eq!(on(line), [[-10.0, 0.5], [1.5, 10.0]], "{line}");
        }
        assert_eq!(on(3), [[-10.0, 10.0]]);
        // Round the end of a segment the gap is a circle's.
        let tip = capsule([DVec2::ZERO, DVec2::new(0.0, -4.0)], 1.0, 0.6).unwrap();
        assert!((tip[0] + 0.8).abs() < 1e-12 && (tip[1] - 0.8).abs() < 1e-12, "{tip:?}");
        assert_eq!(left.iter().find(|r| r.line == 0).map(|r| r.joins), Some([true, false]));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]

        #[test]
        fn fills_are_inside_and_the_gap_away_and_nothing_else_is_missed(
            corners in prop::collection::vec(corner(), 3..9),
            second in prop::collection::vec(corner(), 3..6),
            degrees in prop_oneof![Just(0.0), Just(90.0), Just(45.0), 0.0..180.0],
            gap in prop_oneof![Just(0.0), 0.05..0.7f64],
        ) {
            let grid = Grid::new(degrees, 0.5);
            let loops = [Loop::bordered(corners), Loop::bordered(second)];
            let sides: Vec<[DVec2; 2]> = loops.iter().flat_map(Loop::sides).map(|(side, _)| side).collect();
            let runs = Gap::new(&grid, sides.iter().map(|s| &s[..]), gap).clear(&hatch(&loops, &grid));
            let away = |p: DVec2| sides.iter().map(|s| distance(p, *s)).fold(f64::INFINITY, f64::min);
            for run in &runs {
                prop_assert!(run.along[0] < run.along[1]);
                for k in 0..=8 {
                    let p = grid.place(run.line, run.along[0] + f64::from(k) / 8.0 * run.length_mm());
                    prop_assert!(away(p) >= gap - 1e-9, "{p} is {} from an outline", away(p));
                    prop_assert!(away(p) < 1e-7 || winds(p, &loops), "{p} is outside");
                }
            }
            // All that is inside, farther than the gap and rounding from each side, is in a run.
            for line in -36..36 {
                for k in -45..45 {
                    let (along, p) = (0.4003 * f64::from(k), grid.place(line, 0.4003 * f64::from(k)));
                    if away(p) > gap + 1e-7 && winds(p, &loops) {
                        let is_in = |r: &Run| r.line == line && r.along[0] <= along && along <= r.along[1];
                        prop_assert!(runs.iter().any(is_in), "{p} is missed");
                    }
                }
            }
        }
    }
}
