//! Isocurves joined along the outlines at which they end, so that the pen stays down.
//!
//! Where the pen ends one isocurve at an outline and begins the next at the same outline nearby, it need not be lifted: it
//! goes on along the outline, where there is ink anyway.

use std::collections::HashMap;

use glam::DVec2;
use penvis_core::stroke::CurveKind;

use crate::drawing::Polyline;

/// Longest way along an outline in mm: about what a pen draws in the time that it takes to lower and raise it.
const LONGEST_MM: f64 = 10.0;

/// Side of a cell in mm.
const CELL_MM: f64 = 2.0;

/// Joins each isocurve to the one drawn next, of the same pen and level, if the end of the one and the beginning of the other lie in the
/// ink of one outline, a line of `pen_width_mm`, and the way along it is less than twice the straight way, but for the width
/// of the pen. No ink is added where there is none. Isocurves of one surface and layer become one polyline; others end
/// where the next begins.
///
/// Cost: linear in the vertices, as long as few outlines share a place.
#[must_use]
pub fn join(polylines: Vec<Polyline>, pen_width_mm: f64) -> Vec<Polyline> {
    let outlines = Outlines::new(&polylines);
    let mut ways =
        polylines.windows(2).map(|w| outlines.way(&w[0], &w[1], pen_width_mm)).collect::<Vec<_>>().into_iter();
    let mut joined: Vec<Polyline> = Vec::with_capacity(polylines.len());
    for (k, next) in polylines.into_iter().enumerate() {
        let way = if k == 0 { None } else { ways.next().flatten() };
        match (way, joined.last_mut()) {
            (Some(way), Some(last)) => {
                last.page.extend(way.page);
                last.points.extend(way.points);
                if last.surface == next.surface && last.layer == next.layer {
                    last.page.extend(next.page);
                    last.points.extend(next.points);
                    last.certainty = last.certainty.max(next.certainty);
                } else {
                    last.page.extend(next.page.first());
                    last.points.extend(next.points.first());
                    joined.push(next);
                }
            }
            _ => joined.push(next),
        }
    }
    joined
}

/// Vertices of an outline between two places on it.
struct Way {
    page: Vec<DVec2>,
    points: Vec<glam::DVec3>,
}

/// A place on an outline.
#[derive(Clone, Copy)]
struct Foot {
    outline: usize,
    segment: usize,
    /// Length of the outline before it in mm.
    along: f64,
    /// Distance from it in mm.
    off: f64,
}

/// What is inked besides isocurves, in square cells.
struct Outlines<'a> {
    polylines: &'a [Polyline],
    /// Segments, by polyline and index, of those that may come into a cell.
    cells: HashMap<(i64, i64), Vec<(usize, usize)>>,
    /// Lengths of the outlines up to each vertex, by polyline.
    lengths: HashMap<usize, Vec<f64>>,
}

impl<'a> Outlines<'a> {
    fn new(polylines: &'a [Polyline]) -> Self {
        let mut outlines = Self { polylines, cells: HashMap::new(), lengths: HashMap::new() };
        for (k, line) in polylines.iter().enumerate() {
            if line.kind == CurveKind::Iso || !line.visible || !line.page.iter().all(|p| p.is_finite()) {
                continue;
            }
            let mut lengths = vec![0.0];
            for (segment, w) in line.page.windows(2).enumerate() {
                lengths.push(lengths[segment] + w[0].distance(w[1]));
                for cell in cells(w[0].min(w[1]), w[0].max(w[1])) {
                    outlines.cells.entry(cell).or_default().push((k, segment));
                }
            }
            outlines.lengths.insert(k, lengths);
        }
        outlines
    }

    /// The nearest place on each outline within `reach` of `p`.
    fn feet(&self, p: DVec2, reach: f64) -> Vec<Foot> {
        let mut feet: Vec<Foot> = Vec::new();
        let near = cells(p - reach, p + reach).filter_map(|cell| self.cells.get(&cell)).flatten();
        for &(outline, segment) in near {
            let page = &self.polylines[outline].page;
            let (a, d) = (page[segment], page[segment + 1] - page[segment]);
            let share = if d == DVec2::ZERO { 0.0 } else { ((p - a).dot(d) / d.length_squared()).clamp(0.0, 1.0) };
            let off = (p - a - d * share).length();
            let along = self.lengths[&outline][segment] + share * d.length();
            let foot = Foot { outline, segment, along, off };
            match feet.iter_mut().find(|f| f.outline == outline) {
                Some(known) if off < known.off => *known = foot,
                Some(_) => {}
                None if off <= reach => feet.push(foot),
                None => {}
            }
        }
        feet
    }

    /// The way from the end of one polyline to the beginning of the next along an outline.
    fn way(&self, from: &Polyline, to: &Polyline, pen_width_mm: f64) -> Option<Way> {
        let isocurves = [from, to].iter().all(|p| p.kind == CurveKind::Iso && p.visible);
        if !isocurves || (from.pen, from.level) != (to.pen, to.level) {
            return None;
        }
        let (a, b) = (*from.page.last()?, *to.page.first()?);
        let straight = a.distance(b);
        let most = LONGEST_MM.min(2.0 * straight + pen_width_mm);
        if !(straight > 0.0 && straight <= most) {
            return None;
        }
        let (feet, others) = (self.feet(a, pen_width_mm / 2.0), self.feet(b, pen_width_mm / 2.0));
        let pairs = feet.iter().flat_map(|f| others.iter().filter(|o| o.outline == f.outline).map(move |o| (f, o)));
        let ways = pairs.map(|(f, o)| (self.round(f, o), f, o));
        let ((length, over_start), from, to) = ways.min_by(|x, y| x.0.0.total_cmp(&y.0.0))?;
        (length <= most).then(|| self.between(from, to, over_start))
    }

    /// Length of the way between two places of one outline, and whether the shorter one goes over the beginning of a
    /// closed outline.
    fn round(&self, from: &Foot, to: &Foot) -> (f64, bool) {
        let inner = (to.along - from.along).abs();
        let line = &self.polylines[from.outline].page;
        let whole = self.lengths[&from.outline].last().copied().unwrap_or(0.0);
        let closed = line.first() == line.last();
        if closed && whole - inner < inner { (whole - inner, true) } else { (inner, false) }
    }

    fn between(&self, from: &Foot, to: &Foot, over_start: bool) -> Way {
        let line = &self.polylines[from.outline];
        let count = line.page.len();
        let forward = from.along <= to.along;
        let (low, high) = if forward { (from, to) } else { (to, from) };
        // Vertices in the order from the lower place to the higher one, or round the other way.
        let mut order: Vec<usize> = if over_start {
            // The first vertex is the last again.
            (0..=low.segment).rev().chain((high.segment + 1..count - 1).rev()).collect()
        } else {
            (low.segment + 1..=high.segment).collect()
        };
        if !forward {
            order.reverse();
        }
        Way {
            page: order.iter().map(|&k| line.page[k]).collect(),
            points: order.iter().map(|&k| line.points[k]).collect(),
        }
    }
}

/// The cells that a box meets.
fn cells(low: DVec2, high: DVec2) -> impl Iterator<Item = (i64, i64)> {
    // A cast saturates, and makes 0 of what is not a number.
    let index = |x: f64| (x / CELL_MM).floor() as i64;
    let (x, y) = (index(low.x)..=index(high.x), index(low.y)..=index(high.y));
    x.flat_map(move |i| y.clone().map(move |j| (i, j)))
}

#[cfg(test)]
mod tests {
    use penvis_core::stroke::CurveKind::{Boundary, Iso};
    use proptest::prelude::*;

    use super::*;
    use crate::emit::tests::polyline;

    fn frame() -> Polyline {
        polyline(Boundary, 1, &[[0.0, 0.0], [20.0, 0.0], [20.0, 30.0], [0.0, 30.0], [0.0, 0.0]])
    }

    fn rungs() -> Vec<Polyline> {
        let rung = |k: usize| {
            let y = 1.0 + k as f64;
            let (a, b) = if k % 2 == 0 { (0.0, 20.0) } else { (20.0, 0.0) };
            polyline(Iso, 1, &[[a, y], [b, y]])
        };
        (0..20).map(rung).collect()
    }

    #[test]
    fn lines_between_two_outlines_become_one_stroke() {
        let joined = join([vec![frame()], rungs()].concat(), 0.3);
        assert_eq!(joined.len(), 2);
        assert_eq!(joined[1].page.len(), 40);
        assert_eq!(joined[1].page[2], DVec2::new(20.0, 2.0));
        assert_eq!(joined[1].points.len(), 40);
    }

    #[test]
    fn a_join_goes_round_the_corner_of_the_outline() {
        let lines =
            vec![frame(), polyline(Iso, 1, &[[5.0, 5.0], [0.1, 1.0]]), polyline(Iso, 1, &[[1.5, 0.0], [5.0, 4.0]])];
        let joined = join(lines, 0.3);
        assert_eq!(joined.len(), 2);
        // Over the corner, which is where the outline begins and ends.
        let want = [[5.0, 5.0], [0.1, 1.0], [0.0, 0.0], [1.5, 0.0], [5.0, 4.0]].map(DVec2::from);
        assert_eq!(joined[1].page, want);
        let lines =
            vec![frame(), polyline(Iso, 1, &[[5.0, 5.0], [19.0, 0.0]]), polyline(Iso, 1, &[[20.0, 1.0], [5.0, 4.0]])];
        assert_eq!(join(lines, 0.3)[1].page[2], DVec2::new(20.0, 0.0));
    }

    #[test]
    fn what_is_not_on_one_outline_or_far_apart_or_drawn_otherwise_stays() {
        let end_inside =
            vec![frame(), polyline(Iso, 1, &[[0.0, 1.0], [19.8, 1.0]]), polyline(Iso, 1, &[[20.0, 2.0], [0.0, 2.0]])];
        assert_eq!(join(end_inside.clone(), 0.3).len(), 3);
        assert_eq!(join(end_inside, 0.5).len(), 2);
        let far =
            vec![frame(), polyline(Iso, 1, &[[0.0, 1.0], [20.0, 1.0]]), polyline(Iso, 1, &[[20.0, 12.0], [0.0, 12.0]])];
        assert_eq!(join(far, 0.3).len(), 3);
        let mut levels = [vec![frame()], rungs()].concat();
        levels[2].level = 1;
        assert_eq!(join(levels, 0.3).len(), 4);
        let mut pens = [vec![frame()], rungs()].concat();
        pens[2].pen = 2;
        assert_eq!(join(pens, 0.3).len(), 4);
        let mut hidden = [vec![frame()], rungs()].concat();
        hidden[0].visible = false;
        assert_eq!(join(hidden, 0.3).len(), 21);
    }

    #[test]
    fn lines_of_two_surfaces_stay_two_that_meet() {
        let mut lines = [vec![frame()], rungs()].concat();
        lines[5].surface = 1;
        let joined = join(lines, 0.3);
        assert_eq!(joined.len(), 4);
        for w in joined[1..].windows(2) {
            assert_eq!(w[0].page.last(), w[1].page.first());
        }
    }

    proptest! {
        #[test]
        fn every_join_lies_in_ink_that_is_there(
            ends in prop::collection::vec((0.0..100.0, 0.0..100.0), 2..40), width in 0.1..1.0
        ) {
            // Places on the frame, a few of them off it.
            let on = |s: f64| match s {
                s if s < 20.0 => DVec2::new(s, 0.0),
                s if s < 50.0 => DVec2::new(20.0, s - 20.0),
                s if s < 70.0 => DVec2::new(70.0 - s, 30.0),
                s if s < 100.0 => DVec2::new(0.0, 100.0 - s),
                _ => DVec2::ZERO,
            };
            let line = |(a, b): (f64, f64)| polyline(Iso, 1, &[on(a).to_array(), [10.0, 15.0], on(b).to_array()]);
            let mut lines = vec![frame()];
            lines.extend(ends.into_iter().map(line));
            let segments = |lines: &[Polyline]| -> Vec<(DVec2, DVec2)> {
                lines.iter().flat_map(|l| l.page.windows(2).map(|w| (w[0], w[1])).collect::<Vec<_>>()).collect()
            };
            let before = segments(&lines);
            for (a, b) in segments(&join(lines, width)) {
                let on_frame = |p: DVec2| {
                    let inside = p.min(DVec2::new(20.0, 30.0) - p).min_element();
                    inside.abs() <= width / 2.0 + 1e-9
                };
                prop_assert!(before.contains(&(a, b)) || (0..=8).all(|k| on_frame(a.lerp(b, f64::from(k) / 8.0))));
            }
        }
    }
}
