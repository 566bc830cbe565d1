//! Runs divided by shadows.

use super::area::Loop;
use super::hatch::{Grid, Run, hatch};

/// The parts of the lines of a grid in a shadow that is `thick_mm` there, to the one side of the line or to the other, in the order of [`hatch`]. Where the
/// border of what is visible is that of what is lit, there may be a sliver between the two polygons, along which a line would be drawn in the
/// light.
pub(super) fn in_shadow(loops: &[Loop], grid: &Grid, thick_mm: f64) -> Vec<Run> {
    let across = (grid.place(1, 0.0) - grid.place(0, 0.0)).normalize_or_zero() * thick_mm;
    let whole = hatch(loops, grid);
    let beside = |sign: f64| {
        let shift = |own: &Loop| Loop::bordered(own.points.iter().map(|p| *p + sign * across).collect());
        let [both, _] = divide(&whole, &hatch(&loops.iter().map(shift).collect::<Vec<_>>(), grid), 0.0);
        both
    };
    let mut parts: Vec<Run> = [1.0, -1.0].into_iter().flat_map(beside).collect();
    parts.sort_by(|a, b| a.line.cmp(&b.line).then(a.along[0].total_cmp(&b.along[0])));
    let mut joined: Vec<Run> = Vec::with_capacity(parts.len());
    for part in parts {
        match joined.last_mut().filter(|last| last.line == part.line && part.along[0] <= last.along[1]) {
            Some(last) => last.along[1] = last.along[1].max(part.along[1]),
            None => joined.push(part),
        }
    }
    joined
}

/// The parts of runs in shadow, and those in the light. Both are in the order of [`hatch`](super::hatch()), as are the runs and the `dark` parts of their
/// lines. Where the shadow ends within `apart_mm` of the end of a run it ends with it. At the borders of shadows, parts that meet there may be joined.
pub(super) fn divide(runs: &[Run], dark: &[Run], apart_mm: f64) -> [Vec<Run>; 2] {
    let [mut shaded, mut lit] = [Vec::new(), Vec::new()];
    let mut rest = dark;
    for run in runs {
        rest = &rest[rest.partition_point(|d| d.line < run.line)..];
        let own = &rest[..rest.partition_point(|d| d.line == run.line)];
        let [from, to] = run.along;
        let (mut at, mut joins) = (from, run.joins[0]);
        for part in own.iter().map(|d| d.along) {
            let begin = if part[0] <= from + apart_mm { from } else { part[0] }.max(at);
            let end = if part[1] >= to - apart_mm { to } else { part[1] };
            if end <= begin {
                continue;
            }
            if begin > at {
                lit.push(Run { along: [at, begin], joins: [joins, true], ..*run });
                joins = true;
            }
            let last = end == to;
            shaded.push(Run { along: [begin, end], joins: [joins, !last || run.joins[1]], ..*run });
            (at, joins) = (end, true);
        }
        if at < to {
            lit.push(Run { along: [at, to], joins: [joins, run.joins[1]], ..*run });
        }
    }
    [shaded, lit]
}

#[cfg(test)]
mod tests {
    use glam::DVec2;
    use proptest::prelude::*;

    use super::*;

    fn run(line: i64, from: f64, to: f64) -> Run {
        Run { line, along: [from, to], joins: [false; 2] }
    }

    #[test]
    fn a_run_is_divided_where_the_shadow_ends() {
        let whole = Run { joins: [false, true], ..run(2, 0.0, 10.0) };
        let [dark, lit] = divide(&[whole], &[run(1, 0.0, 9.0), run(2, 3.0, 4.0), run(2, 6.0, 9.995)], 0.01);
        let parts = |runs: &[Run]| runs.iter().map(|r| (r.along, r.joins)).collect::<Vec<_>>();
        assert_eq!(parts(&dark), [([3.0, 4.0], [true; 2]), ([6.0, 10.0], [true; 2])]);
        assert_eq!(parts(&lit), [([0.0, 3.0], [false, true]), ([4.0, 6.0], [true; 2])]);
        let [dark, lit] = divide(&[whole], &[], 0.01);
        assert_eq!((dark.len(), &lit[..]), (0, &[whole][..]));
        let [dark, lit] = divide(&[whole], &[run(2, -5.0, 12.0)], 0.01);
        assert_eq!((&dark[..], lit.len()), (&[whole][..], 0));
    }

    #[test]
    fn a_sliver_is_no_shadow_and_a_shadow_keeps_its_border() {
        let of = |points: &[[f64; 2]]| Loop::bordered(points.iter().map(|p| DVec2::from(*p)).collect());
        // A square from whose upper side, which lies on a line, a sliver goes on to the right; another one lies alone.
        let loops = [
            of(&[[0.0, 0.0], [4.0, 0.0], [4.0, 2.99], [9.0, 2.99], [9.0, 3.005], [0.0, 3.005]]),
            of(&[[0.0, 4.99], [9.0, 4.99], [9.0, 5.005], [0.0, 5.005]]),
        ];
        let grid = Grid::new(0.0, 1.0);
        assert!(hatch(&loops, &grid).iter().any(|r| r.line == 3 && r.along == [0.0, 9.0]));
        let found = in_shadow(&loops, &grid, 0.02);
        let on = |line| found.iter().filter(|r| r.line == line).map(|r| r.along).collect::<Vec<_>>();
        assert_eq!(on(0), [[0.0, 4.0]]);
        assert_eq!(on(2), [[0.0, 4.0]]);
        assert_eq!(on(3), [[0.0, 4.0]]);
        assert_eq!(on(5), [[0.0; 2]; 0]);
    }

    /// Runs of some lines that do not touch, in order.
    fn runs() -> impl Strategy<Value = Vec<Run>> {
        prop::collection::vec(prop::collection::btree_set(0..40i32, 0..8), 3).prop_map(|lines| {
            let mut runs = Vec::new();
            for (line, ends) in lines.iter().enumerate() {
                let ends: Vec<f64> = ends.iter().map(|&x| f64::from(x)).collect();
                runs.extend(ends.chunks_exact(2).map(|w| run(line as i64, w[0], w[1])));
            }
            runs
        })
    }

    proptest! {
        #[test]
        fn every_place_is_either_dark_or_lit(whole in runs(), dark in runs()) {
            let [shaded, lit] = divide(&whole, &dark, 0.0);
            let holds = |runs: &[Run], line: i64, at: f64| {
                runs.iter().filter(|r| r.line == line && r.along[0] < at && at < r.along[1]).count()
            };
            for (line, at) in (0..3).flat_map(|line| (0..40).map(move |k| (line, f64::from(k) + 0.5))) {
                let (inside, dark) = (holds(&whole, line, at), holds(&dark, line, at));
                prop_assert_eq!(holds(&shaded, line, at), inside.min(dark));
                prop_assert_eq!(holds(&lit, line, at), inside - inside.min(dark));
            }
        }
    }
}
