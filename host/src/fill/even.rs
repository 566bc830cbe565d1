//! Areas that are equally dark all over.
//!
//! Where lines of one grid are there or not, they are not equally far apart unless it is just half as dark, or a quarter, and so on. Where the darkness changes from
//! place to place that makes neighbours end in different places; on a flat face it would be seen as stripes. So an area that is equally dark wherever its
//! lines are looked at, and ends in no smooth join, over which lines would have to go on, has a grid of its own, with just as many lines as it is
//! dark.

use glam::DVec2;

use super::Area;
use super::hatch::Run;

/// Largest difference of darkness that counts as none: no plotter draws a millionth of a line more or less.
const ALIKE: f64 = 1e-6;

/// Whether lines would have to go on beyond the area.
pub(super) fn goes_on(area: &Area) -> bool {
    area.loops.iter().any(|own| own.smooth.contains(&true))
}

/// The darkness along runs, if it is the same wherever they are looked at, at their ends and in steps no longer than `step`. Where it is not known they
/// are not looked at.
pub(super) fn darkness(runs: &[Run], step: f64, darkness: &mut dyn FnMut(&Run, f64) -> Option<f64>) -> Option<f64> {
    let mut range: Option<[f64; 2]> = None;
    for run in runs {
        let count = (run.length_mm() / step).ceil().clamp(1.0, 1e6) as u32;
        for k in 0..=count {
            let share = f64::from(k) / f64::from(count);
            let Some(found) = darkness(run, run.along[0] + share * run.length_mm()) else { continue };
            let [low, high] = range.map_or([found; 2], |[low, high]| [low.min(found), high.max(found)]);
            if high - low > ALIKE {
                return None;
            }
            range = Some([low, high]);
        }
    }
    range.map(|[low, high]| low.midpoint(high))
}

/// The segments of lines that come within `reach_mm` of an area's box.
pub(super) fn beside<'a>(area: &Area, lines: &[&'a [DVec2]], reach_mm: f64) -> impl Iterator<Item = &'a [DVec2]> {
    let corners = area.loops.iter().flat_map(|own| &own.points);
    let (low, high) = corners.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
    lines.iter().flat_map(|line| line.windows(2)).filter(move |w| {
        let (l, h) = (w[0].min(w[1]), w[0].max(w[1]));
        (l - high).max(low - h).max_element() <= reach_mm
    })
}

#[cfg(test)]
mod tests {
    use super::super::Loop;
    use super::*;

    #[test]
    fn darkness_is_one_only_if_it_is_so_everywhere() {
        let run = |line, from, to| Run { line, along: [from, to], joins: [false; 2] };
        let runs = [run(0, 0.0, 10.0), run(1, 2.0, 2.5)];
        assert_eq!(darkness(&runs, 1.0, &mut |_, _| Some(0.25)), Some(0.25));
        assert_eq!(darkness(&runs, 1.0, &mut |run, _| Some(0.25 * (run.line + 1) as f64)), None);
        assert_eq!(darkness(&runs, 1.0, &mut |_, at| Some(if at > 9.5 { 0.3 } else { 0.25 })), None);
        // On borders nothing may be known, and nothing at all is no darkness.
        assert_eq!(darkness(&runs, 1.0, &mut |_, at| (at > 0.0).then_some(0.75)), Some(0.75));
        assert_eq!(darkness(&runs, 1.0, &mut |_, _| None), None);
        assert_eq!(darkness(&[], 1.0, &mut |_, _| Some(0.5)), None);
    }

    #[test]
    fn what_is_far_from_an_area_is_left_out() {
        let area = Area {
            surface: 0,
            loops: vec![Loop::bordered([[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]].map(DVec2::from).to_vec())],
        };
        let line = [[-1.0, -9.0], [-1.0, 5.0], [20.0, 5.0]].map(DVec2::from);
        assert_eq!(beside(&area, &[&line], 0.9).count(), 0);
        assert_eq!(beside(&area, &[&line], 1.0).collect::<Vec<_>>(), [&line[..2]]);
        assert_eq!(beside(&area, &[&line], 2.0).count(), 2);
    }
}
