//! What lies outside a window of the page, cut off.

use glam::{DVec2, DVec3};

use crate::drawing::Polyline;

/// An upright rectangle of the page in mm, with its border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    /// Lower left corner.
    pub low: DVec2,
    /// Upper right corner, nowhere below the other one.
    pub high: DVec2,
}

impl Window {
    /// What two windows have in common; none if that is nothing.
    #[must_use]
    pub fn common(self, other: Self) -> Option<Self> {
        let (low, high) = (self.low.max(other.low), self.high.min(other.high));
        low.cmple(high).all().then_some(Self { low, high })
    }

    fn contains(&self, p: DVec2) -> bool {
        p.cmpge(self.low).all() && p.cmple(self.high).all()
    }

    /// The part of a segment that lies in the window, as parameters from 0 to 1 (Liang and Barsky 1984); none if it is no more than a point.
    fn part(&self, a: DVec2, b: DVec2) -> Option<(f64, f64)> {
        let (mut from, mut to) = (0.0_f64, 1.0_f64);
        for (start, step, low, high) in
            [(a.x, b.x - a.x, self.low.x, self.high.x), (a.y, b.y - a.y, self.low.y, self.high.y)]
        {
            if step == 0.0 {
                if !(low..=high).contains(&start) {
                    return None;
                }
                continue;
            }
            let (one, other) = ((low - start) / step, (high - start) / step);
            from = from.max(one.min(other));
            to = to.min(one.max(other));
        }
        (from < to).then_some((from, to))
    }
}

/// Appends the parts of `polyline` inside a window to `out`, in their order; one that lies inside stays as it is. A closed one that is cut is not cut
/// where it begins.
pub fn clip(polyline: Polyline, window: &Window, out: &mut Vec<Polyline>) {
    if polyline.page.iter().all(|&p| window.contains(p)) {
        out.push(polyline);
        return;
    }
    let before = out.len();
    let mut run = Run::default();
    for (page, points) in polyline.page.windows(2).zip(polyline.points.windows(2)) {
        let Some((from, to)) = window.part(page[0], page[1]) else {
            run.end(&polyline, out);
            continue;
        };
        let at = |t: f64| match t {
            0.0 => (page[0], points[0]),
            1.0 => (page[1], points[1]),
            // Rounding takes it no farther than the border.
            t => (page[0].lerp(page[1], t).clamp(window.low, window.high), points[0].lerp(points[1], t)),
        };
        if from > 0.0 {
            run.end(&polyline, out);
        }
        if run.page.is_empty() {
            run.push(at(from));
        }
        run.push(at(to));
        if to < 1.0 {
            run.end(&polyline, out);
        }
    }
    run.end(&polyline, out);
    join_over_start(&polyline, before, out);
}

/// Joins the last and the first part of a closed polyline where they meet in its first vertex.
fn join_over_start(polyline: &Polyline, before: usize, out: &mut Vec<Polyline>) {
    let closed = polyline.page.first() == polyline.page.last();
    let parts = out.get(before..).unwrap_or_default();
    let [first, .., last] = parts else { return };
    if !closed || first.page.first() != polyline.page.first() || last.page.last() != polyline.page.last() {
        return;
    }
    let (page, points) = (first.page.clone(), first.points.clone());
    if let Some(mut joined) = out.pop() {
        joined.page.extend_from_slice(&page[1..]);
        joined.points.extend_from_slice(&points[1..]);
        out[before] = joined;
    }
}

/// A part that is being followed.
#[derive(Default)]
struct Run {
    page: Vec<DVec2>,
    points: Vec<DVec3>,
}

impl Run {
    fn push(&mut self, (page, point): (DVec2, DVec3)) {
        self.page.push(page);
        self.points.push(point);
    }

    fn end(&mut self, polyline: &Polyline, out: &mut Vec<Polyline>) {
        let Self { page, points } = std::mem::take(self);
        if page.len() >= 2 {
            out.push(Polyline { page, points, layer: polyline.layer.clone(), ..*polyline });
        }
    }
}

#[cfg(test)]
mod tests {
    use penvis_core::stroke::CurveKind::Iso;
    use proptest::prelude::*;

    use super::*;
    use crate::emit::tests::polyline;

    const WINDOW: Window = Window { low: DVec2::new(10.0, 10.0), high: DVec2::new(30.0, 20.0) };

    fn clipped(page: &[[f64; 2]]) -> Vec<Vec<[f64; 2]>> {
        let mut out = Vec::new();
        clip(polyline(Iso, 1, page), &WINDOW, &mut out);
        for p in &out {
            assert_eq!(p.page.len(), p.points.len());
        }
        out.into_iter().map(|p| p.page.into_iter().map(|q| q.to_array()).collect()).collect()
    }

    #[test]
    fn lines_end_on_the_border() {
        assert_eq!(clipped(&[[0.0, 15.0], [40.0, 15.0]]), [[[10.0, 15.0], [30.0, 15.0]]]);
        assert_eq!(
            clipped(&[[12.0, 12.0], [12.0, 40.0], [14.0, 40.0], [14.0, 0.0]]),
            [[[12.0, 12.0], [12.0, 20.0]], [[14.0, 20.0], [14.0, 10.0]]]
        );
        assert_eq!(clipped(&[[0.0, 0.0], [40.0, 0.0]]), Vec::<Vec<[f64; 2]>>::new());
    }

    #[test]
    fn what_is_inside_or_on_the_border_stays_and_what_touches_it_goes() {
        let frame = [[10.0, 10.0], [30.0, 10.0], [30.0, 20.0], [10.0, 20.0], [10.0, 10.0]];
        assert_eq!(clipped(&frame), [frame.to_vec()]);
        // Through a corner.
        assert_eq!(clipped(&[[0.0, 20.0], [20.0, 0.0]]), Vec::<Vec<[f64; 2]>>::new());
        // Out to the border's own line and back along it.
        assert_eq!(clipped(&[[5.0, 10.0], [35.0, 10.0]]), [[[10.0, 10.0], [30.0, 10.0]]]);
    }

    #[test]
    fn a_closed_line_is_not_cut_where_it_begins() {
        let square = [[20.0, 15.0], [40.0, 15.0], [40.0, 18.0], [20.0, 18.0], [20.0, 15.0]];
        let cut = [[30.0, 18.0], [20.0, 18.0], [20.0, 15.0], [30.0, 15.0]];
        assert_eq!(clipped(&square), [cut]);
    }

    proptest! {
        #[test]
        fn what_is_left_is_inside_and_is_all_that_was(
            page in prop::collection::vec((0_i32..9, 0_i32..7), 2..12), shift in 0.0..1.0_f64, closed: bool
        ) {
            let mut page: Vec<[f64; 2]> =
                page.into_iter().map(|(x, y)| [5.0 * f64::from(x) + shift.round() * 0.3, 5.0 * f64::from(y)]).collect();
            if closed {
                page.push(page[0]);
            }
            let parts = clipped(&page);
            let inside = |p: DVec2| p.cmpge(WINDOW.low).all() && p.cmple(WINDOW.high).all();
            let segments = |line: &[[f64; 2]]| -> Vec<(DVec2, DVec2)> {
                line.windows(2).map(|w| (w[0].into(), w[1].into())).collect()
            };
            let lengths = |lines: Vec<(DVec2, DVec2)>| -> f64 { lines.iter().map(|(a, b)| a.distance(*b)).sum() };
            for part in &parts {
                prop_assert!(part.iter().all(|&p| inside(p.into())));
            }
            // By sampling, the independent way.
            let steps = 2000;
            let sampled: f64 = segments(&page).iter().map(|(a, b)| {
                // What goes along the border is in it; the rounding of samples is not to take it out.
                let close = |p: DVec2| p.cmpge(WINDOW.low - 1e-9).all() && p.cmple(WINDOW.high + 1e-9).all();
                let hits = (0..steps).filter(|&k| close(a.lerp(*b, (f64::from(k) + 0.5) / f64::from(steps)))).count();
                a.distance(*b) * hits as f64 / f64::from(steps)
            }).sum();
            let left = lengths(parts.iter().flat_map(|p| segments(p)).collect());
            prop_assert!((left - sampled).abs() <= 0.1 * page.len() as f64, "{left} against {sampled}");
        }
    }
}
