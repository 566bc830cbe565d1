//! Isocurves joined along the outlines at which they end, so that the pen stays down.
//!
//! Where the pen ends one isocurve at an outline and begins the next at the same outline nearby, it need not be lifted: it
//! goes on along the outline, where there is ink anyway.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use penvis_core::stroke::CurveKind;

use crate::drawing::Polyline;

/// Longest way along an outline in mm: about what a pen draws in the time that it takes to lower and raise it.
const LONGEST_MM: f64 = 10.0;

/// Side of a cell in mm.
const CELL_MM: f64 = 2.0;

/// Joins each isocurve to the one drawn next, of the same pen and level, if the end of the one and the beginning of the other
/// lie in the ink that this pen gives one outline, a line of `pen_width_mm`, and the way along it is less than twice the straight way, but for
/// the width of the pen. A join is a polyline of its own between the two, part of the outline on the isocurves' layer; no ink is
/// added where there is none.
///
/// Cost: linear in the vertices, as long as few outlines share a place.
#[must_use]
pub fn join(polylines: Vec<Polyline>, pen_width_mm: f64) -> Vec<Polyline> {
    let outlines = Outlines::new(&polylines);
    let ways: Vec<Option<Polyline>> =
        polylines.windows(2).map(|w| outlines.way(&w[0], &w[1], pen_width_mm)).chain([None]).collect();
    polylines.into_iter().zip(ways).flat_map(|(line, way)| [Some(line), way]).flatten().collect()
}

/// A place on an outline.
#[derive(Clone, Copy)]
struct Foot {
    outline: usize,
    segment: usize,
    /// Share of the segment before it.
    share: f64,
    /// Length of the outline before it in mm.
    along: f64,
    /// Distance from it in mm.
    off: f64,
}

/// What is inked besides isocurves and the lines of fills, in square cells.
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
            let is_outline = !matches!(line.kind, Some(CurveKind::Iso | CurveKind::Hatch));
            if !is_outline || !line.visible || !line.page.iter().all(|p| p.is_finite()) {
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

    /// The nearest place on each outline of a pen within `reach` of `p`.
    fn feet(&self, p: DVec2, reach: f64, pen: u32) -> Vec<Foot> {
        let mut feet: Vec<Foot> = Vec::new();
        let near = cells(p - reach, p + reach).filter_map(|cell| self.cells.get(&cell)).flatten();
        for &(outline, segment) in near.filter(|(outline, _)| self.polylines[*outline].pen == pen) {
            let page = &self.polylines[outline].page;
            let (a, d) = (page[segment], page[segment + 1] - page[segment]);
            let share = if d == DVec2::ZERO { 0.0 } else { ((p - a).dot(d) / d.length_squared()).clamp(0.0, 1.0) };
            let off = (p - a - d * share).length();
            let along = self.lengths[&outline][segment] + share * d.length();
            let foot = Foot { outline, segment, share, along, off };
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
    fn way(&self, from: &Polyline, to: &Polyline, pen_width_mm: f64) -> Option<Polyline> {
        let before = from;
        let isocurves = [from, to].iter().all(|p| p.kind == Some(CurveKind::Iso) && p.visible);
        if !isocurves || (from.pen, from.level) != (to.pen, to.level) {
            return None;
        }
        let (a, b) = (*from.page.last()?, *to.page.first()?);
        let straight = a.distance(b);
        let most = LONGEST_MM.min(2.0 * straight + pen_width_mm);
        if !(straight > 0.0 && straight <= most) {
            return None;
        }
        let [feet, others] = [a, b].map(|p| self.feet(p, pen_width_mm / 2.0, from.pen));
        let pairs = feet.iter().flat_map(|f| others.iter().filter(|o| o.outline == f.outline).map(move |o| (f, o)));
        let ways = pairs.map(|(f, o)| (self.round(f, o), f, o));
        let ((length, over_start), from, to) = ways.min_by(|x, y| x.0.0.total_cmp(&y.0.0))?;
        if length > most {
            return None;
        }
        let outline = &self.polylines[from.outline];
        let order = self.between(from, to, over_start);
        let (mut page, mut points) = (vec![a], vec![self.point(from)]);
        page.extend(order.iter().map(|&k| outline.page[k]));
        points.extend(order.iter().map(|&k| outline.points[k]));
        page.push(b);
        points.push(self.point(to));
        let Polyline { layer, pen, level, .. } = before.clone();
        Some(Polyline { layer, pen, level, page, points, ..outline.clone() })
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

    /// A place on an outline in model space.
    fn point(&self, foot: &Foot) -> DVec3 {
        let points = &self.polylines[foot.outline].points;
        points[foot.segment].lerp(points[foot.segment + 1], foot.share)
    }

    /// The vertices of an outline between two places on it, in order.
    fn between(&self, from: &Foot, to: &Foot, over_start: bool) -> Vec<usize> {
        let count = self.polylines[from.outline].page.len();
        let forward = from.along <= to.along;
        let (low, high) = if forward { (from, to) } else { (to, from) };
        // In the order from the lower place to the higher one, or round the other way.
        let mut order: Vec<usize> = if over_start {
            // The first vertex is the last again.
            (0..=low.segment).rev().chain((high.segment + 1..count - 1).rev()).collect()
        } else {
            (low.segment + 1..=high.segment).collect()
        };
        if !forward {
            order.reverse();
        }
        order
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
            let (a, b) = if k.is_multiple_of(2) { (0.0, 20.0) } else { (20.0, 0.0) };
            polyline(Iso, 1, &[[a, y], [b, y]])
        };
        (0..20).map(rung).collect()
    }

    /// The joins among polylines: what is on the layer of isocurves and is none.
    fn joins(lines: Vec<Polyline>, pen_width_mm: f64) -> Vec<Polyline> {
        let joined = join(lines, pen_width_mm);
        for w in joined.windows(3).filter(|w| w[1].layer == "iso" && w[1].kind != Some(Iso)) {
            assert_eq!((w[0].page.last(), w[1].page.last()), (w[1].page.first(), w[2].page.first()));
            assert_eq!(w[1].page.len(), w[1].points.len());
        }
        joined.into_iter().filter(|p| p.layer == "iso" && p.kind != Some(Iso)).collect()
    }

    fn with_frame(lines: Vec<Polyline>) -> Vec<Polyline> {
        [vec![frame()], lines].concat()
    }

    #[test]
    fn lines_between_two_outlines_are_drawn_without_a_lift() {
        let drawing = crate::emit::tests::drawing(100.0, 100.0, join(with_frame(rungs()), 0.3));
        let runs = crate::emit::runs(&drawing, 0.001, |p| p);
        assert_eq!(runs.len(), 2);
        assert_eq!(runs[1].points.len(), 40);
        assert_eq!(runs[1].points[2], [20_000, 2000]);
        let found = joins(with_frame(rungs()), 0.3);
        assert_eq!(found.len(), 19);
        for j in &found {
            assert_eq!(j.kind, Some(Boundary));
            assert!(j.points.iter().zip(&j.page).all(|(q, p)| q.distance(p.extend(0.5)) < 1e-12));
        }
    }

    #[test]
    fn a_join_goes_round_the_corner_of_the_outline() {
        let lines = vec![polyline(Iso, 1, &[[5.0, 5.0], [0.1, 1.0]]), polyline(Iso, 1, &[[1.5, 0.0], [5.0, 4.0]])];
        // Over the corner, which is where the outline begins and ends.
        assert_eq!(joins(with_frame(lines), 0.3)[0].page, [[0.1, 1.0], [0.0, 0.0], [1.5, 0.0]].map(DVec2::from));
        let lines = vec![polyline(Iso, 1, &[[5.0, 5.0], [19.0, 0.0]]), polyline(Iso, 1, &[[20.0, 1.0], [5.0, 4.0]])];
        assert_eq!(joins(with_frame(lines), 0.3)[0].page[1], DVec2::new(20.0, 0.0));
    }

    #[test]
    fn what_is_not_on_one_outline_or_far_apart_or_drawn_otherwise_stays() {
        let to = |x: f64, y: f64| {
            with_frame(vec![polyline(Iso, 1, &[[0.0, 1.0], [x, 1.0]]), polyline(Iso, 1, &[[20.0, y], [0.0, y]])])
        };
        assert_eq!(joins(to(19.8, 2.0), 0.3).len(), 0);
        assert_eq!(joins(to(19.8, 2.0), 0.5).len(), 1);
        assert_eq!(joins(to(20.0, 12.0), 0.3).len(), 0);
        let changed = |change: fn(&mut Vec<Polyline>)| {
            let mut lines = with_frame(rungs());
            change(&mut lines);
            joins(lines, 0.3).len()
        };
        assert_eq!(changed(|lines| lines[2].level = 1), 17);
        assert_eq!(changed(|lines| lines[2].pen = 2), 17);
        assert_eq!(changed(|lines| lines[0].visible = false), 0);
        assert_eq!(changed(|lines| lines[5].surface = 1), 19);
    }

    #[test]
    fn no_way_leads_along_the_line_of_a_fill_or_over_ink_of_another_pen() {
        let changed = |change: fn(&mut Polyline)| {
            let mut lines = with_frame(rungs());
            change(&mut lines[0]);
            joins(lines, 0.3).len()
        };
        assert_eq!(changed(|_| {}), 19);
        assert_eq!(changed(|frame| frame.kind = Some(CurveKind::Hatch)), 0);
        assert_eq!(changed(|frame| frame.pen = 2), 0);
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
