//! Polylines divided by shadows.

use glam::{DVec2, DVec3};

use super::along::Along;
use super::{Area, Line};

/// The sides of all shadows in which a fill is darkest. Those of several surfaces do not overlap, as what is visible of these does not.
pub struct Shade {
    sides: Vec<[DVec2; 2]>,
}

impl Shade {
    /// Of the shadows of the surfaces that `is_one` names.
    #[must_use]
    pub fn new(shadows: &[Area], is_one: &dyn Fn(usize) -> bool) -> Self {
        let own = shadows.iter().filter(|area| is_one(area.surface));
        Self { sides: own.flat_map(|area| &area.loops).flat_map(|l| l.sides()).map(|(side, _)| side).collect() }
    }

    /// Whether a point is in a shadow, by the nonzero rule.
    fn holds(sides: &[[DVec2; 2]], p: DVec2) -> bool {
        let turn = |[a, b]: &[DVec2; 2]| {
            if (a.y <= p.y) == (b.y <= p.y) || p.x >= a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y) {
                return 0;
            }
            if a.y <= p.y { 1 } else { -1 }
        };
        sides.iter().map(turn).sum::<i32>() != 0
    }

    /// The parts of a polyline in shadows, as ways along it in mm, in order. Parts and gaps are left out that are no longer than `apart_mm`: what lies
    /// between the shadows of neighbouring surfaces.
    ///
    /// Cost: all sides, and those at the height of the polyline times its vertices and times the crossings.
    pub(super) fn parts(&self, page: &[DVec2], along: &Along<'_>, apart_mm: f64) -> Vec<[f64; 2]> {
        let (low, high) = page.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
        // Others are not crossed, nor do they matter to what lies to the left of them.
        let beside = |[a, b]: &&[DVec2; 2]| a.y.max(b.y) >= low.y && a.y.min(b.y) <= high.y && a.x.max(b.x) >= low.x;
        let sides: Vec<[DVec2; 2]> = self.sides.iter().filter(beside).copied().collect();
        let mut cuts = vec![0.0, along.length_mm()];
        for (k, w) in page.windows(2).enumerate() {
            let (p, d) = (w[0], w[1] - w[0]);
            let (low, high) = (w[0].min(w[1]), w[0].max(w[1]));
            for [a, b] in &sides {
                let e = *b - *a;
                let across = d.perp_dot(e);
                if across == 0.0 || a.max(*b).cmplt(low).any() || a.min(*b).cmpgt(high).any() {
                    continue;
                }
                let [s, t] = [(*a - p).perp_dot(e) / across, (*a - p).perp_dot(d) / across];
                if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
                    cuts.push(along.up_to(k) + s * d.length());
                }
            }
        }
        cuts.sort_by(f64::total_cmp);
        let mut parts: Vec<[f64; 2]> = Vec::new();
        for w in cuts.windows(2).filter(|w| w[1] > w[0]) {
            if !Self::holds(&sides, along.at(w[0].midpoint(w[1]))) {
                continue;
            }
            match parts.last_mut() {
                Some(last) if w[0] - last[1] <= apart_mm => last[1] = w[1],
                _ => parts.push([w[0], w[1]]),
            }
        }
        parts.retain(|part| part[1] - part[0] > apart_mm);
        parts
    }
}

/// Where lines are left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Light {
    /// Out of shadows.
    Falls,
    /// In shadows.
    Misses,
}

/// What is left of lines where light falls, or does not. What lies between parts within `apart_mm` counts with them, and what is shorter than `shortest_mm` is
/// left out, for a pen makes dots of it.
#[must_use]
pub fn divided(lines: Vec<Line>, shade: &Shade, light: Light, [apart_mm, shortest_mm]: [f64; 2]) -> Vec<Line> {
    let mut left = Vec::with_capacity(lines.len());
    for line in lines {
        let along = Along::new(&line.page);
        let dark = shade.parts(&line.page, &along, apart_mm);
        let parts = match light {
            Light::Misses => dark,
            Light::Falls => between([0.0, along.length_mm()], &dark),
        };
        let places = along.parts(&parts).into_iter().zip(along.parts_of(&line.points, DVec3::lerp, &parts));
        let long = places.filter(|(page, _)| Along::new(page).length_mm() >= shortest_mm);
        left.extend(long.map(|(page, points)| Line { page, points, ..line }));
    }
    left
}

/// What parts, in order and apart, leave of a whole.
pub(super) fn between([from, to]: [f64; 2], parts: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let begins = std::iter::once(from).chain(parts.iter().map(|p| p[1]));
    let ends = parts.iter().map(|p| p[0]).chain([to]);
    begins.zip(ends).filter(|(a, b)| a < b).map(|(a, b)| [a, b]).collect()
}

/// Parts that touch made one, in order.
pub(super) fn united(mut parts: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    parts.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut united: Vec<[f64; 2]> = Vec::with_capacity(parts.len());
    for part in parts {
        match united.last_mut().filter(|last| part[0] <= last[1]) {
            Some(last) => last[1] = last[1].max(part[1]),
            None => united.push(part),
        }
    }
    united
}

#[cfg(test)]
mod tests {
    use super::super::Loop;
    use super::*;

    fn square(surface: usize, low: [f64; 2], high: [f64; 2]) -> Area {
        let corners = [low, [high[0], low[1]], high, [low[0], high[1]]];
        Area { surface, loops: vec![Loop::bordered(corners.map(DVec2::from).to_vec())] }
    }

    #[test]
    fn a_line_is_dark_where_it_crosses_shadows_of_its_surfaces() {
        let shadows =
            [square(0, [1.0, 0.0], [3.0, 5.0]), square(1, [3.004, 0.0], [4.0, 5.0]), square(2, [6.0, 0.0], [7.0, 5.0])];
        let page = [[0.0, 1.0], [5.0, 1.0], [5.0, 2.0], [9.0, 2.0]].map(DVec2::from);
        let along = Along::new(&page);
        let parts = |is_one: &dyn Fn(usize) -> bool| Shade::new(&shadows, is_one).parts(&page, &along, 0.01);
        assert_eq!(parts(&|s| s < 2), [[1.0, 4.0]]);
        assert_eq!(parts(&|_| true), [[1.0, 4.0], [7.0, 8.0]]);
        assert_eq!(parts(&|_| false), [[0.0; 2]; 0]);
        // From within one to within another.
        let page = [[2.0, 1.0], [6.5, 1.0]].map(DVec2::from);
        let found = Shade::new(&shadows, &|_| true).parts(&page, &Along::new(&page), 0.01);
        assert_eq!(found.len(), 2);
        for (found, want) in found.iter().flatten().zip([0.0, 2.0, 4.0, 4.5]) {
            assert!((found - want).abs() < 1e-12, "{found} {want}");
        }
    }

    #[test]
    fn lines_are_left_where_light_falls_or_where_it_does_not() {
        let shade = Shade::new(&[square(0, [2.0, 0.0], [4.0, 5.0]), square(0, [6.0, 0.0], [6.2, 5.0])], &|_| true);
        let page = [[0.0, 1.0], [3.0, 1.0], [8.0, 1.0]].map(DVec2::from).to_vec();
        let points = page.iter().map(|p| p.extend(p.x)).collect();
        let line = Line { surface: 0, pen: 3, page, points };
        let left = |light| divided(vec![line.clone()], &shade, light, [0.01, 0.5]);
        let ends = |lines: &[Line]| -> Vec<(f64, f64)> {
            let end = |l: &Line| Some((l.page.first()?.x, l.page.last()?.x));
            lines.iter().filter_map(end).map(|(a, b)| ((1e9 * a).round() / 1e9, (1e9 * b).round() / 1e9)).collect()
        };
        let (lit, dark) = (left(Light::Falls), left(Light::Misses));
        assert_eq!(ends(&lit), [(0.0, 2.0), (4.0, 6.0), (6.2, 8.0)]);
        assert_eq!(ends(&dark), [(2.0, 4.0)]);
        assert_eq!((dark[0].page.len(), dark[0].pen), (3, 3));
        assert!(dark[0].points.iter().zip(&dark[0].page).all(|(q, p)| q.distance(p.extend(p.x)) < 1e-12));
    }

    #[test]
    fn what_is_between_parts_and_the_parts_are_the_whole() {
        let parts = [[0.0, 1.0], [2.0, 3.0], [5.0, 6.0]];
        assert_eq!(between([0.0, 8.0], &parts), [[1.0, 2.0], [3.0, 5.0], [6.0, 8.0]]);
        assert_eq!(between([0.0, 6.0], &[]), [[0.0, 6.0]]);
        assert_eq!(united([&parts[..], &between([0.0, 8.0], &parts)].concat()), [[0.0, 8.0]]);
        assert_eq!(united(vec![[2.0, 3.0], [0.0, 1.0]]), [[0.0, 1.0], [2.0, 3.0]]);
    }
}
