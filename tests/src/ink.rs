//! How far apart two drawings are.

use glam::DVec2;
use penvis::drawing::Drawing;

/// Distance in mm between the places at which a line is compared.
const SPACING: f64 = 0.05;

/// Width in mm of the cells in which lines are sought.
const CELL: f64 = 0.5;

/// Segments of a drawing, by the cells of the page that they pass.
pub struct Ink {
    segments: Vec<[DVec2; 2]>,
    lo: DVec2,
    across: usize,
    up: usize,
    cells: Vec<Vec<u32>>,
}

impl Ink {
    /// All lines of a drawing that are on the paper.
    #[must_use]
    pub fn new(drawing: &Drawing) -> Self {
        let ends = |line: &[DVec2]| line.windows(2).map(|w| [w[0], w[1]]).collect::<Vec<_>>();
        let segments: Vec<_> = drawing.polylines.iter().flat_map(|p| ends(&p.page)).collect();
        let start = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let (lo, hi) = segments.iter().flatten().fold(start, |(lo, hi), &p| (lo.min(p), hi.max(p)));
        let lo = if segments.is_empty() { DVec2::ZERO } else { lo };
        let count = ((hi - lo).max(DVec2::ZERO) / CELL).floor();
        let (across, up) = (count.x as usize + 1, count.y as usize + 1);
        let mut ink = Self { segments, lo, across, up, cells: vec![Vec::new(); across * up] };
        for k in 0..ink.segments.len() {
            let [a, b] = ink.segments[k];
            let pieces = (a.distance(b) / CELL).ceil().max(1.0);
            for i in 0..pieces as usize {
                let (p, q) = (a.lerp(b, i as f64 / pieces), a.lerp(b, (i as f64 + 1.0) / pieces));
                // Rounding of the place between the ends may step out of the box.
                let inside =
                    |[x, y]: [i64; 2]| [x.clamp(0, across as i64 - 1), y.clamp(0, up as i64 - 1)].map(|c| c as usize);
                let ([x0, y0], [x1, y1]) = (inside(ink.cell(p.min(q))), inside(ink.cell(p.max(q))));
                for y in y0..=y1 {
                    for x in x0..=x1 {
                        let list = &mut ink.cells[y * across + x];
                        if list.last() != Some(&(k as u32)) {
                            list.push(k as u32);
                        }
                    }
                }
            }
        }
        ink
    }

    /// Number of segments.
    #[must_use]
    pub fn segment_count(&self) -> usize {
        self.segments.len()
    }

    /// Length in mm.
    #[must_use]
    pub fn length_mm(&self) -> f64 {
        self.segments.iter().map(|[a, b]| a.distance(*b)).sum()
    }

    /// The largest distance in mm of a place on this ink from the other, and that place; none if there is no ink. Both
    /// directions are needed to say that two drawings are equal. Places are compared every 0.05 mm and at all vertices.
    #[must_use]
    pub fn farthest_from(&self, other: &Self) -> Option<(f64, DVec2)> {
        let places = self.segments.iter().flat_map(|&[a, b]| {
            let count = (a.distance(b) / SPACING).ceil().max(1.0) as usize;
            (0..=count).map(move |i| a.lerp(b, i as f64 / count as f64))
        });
        places.map(|p| (other.distance(p), p)).max_by(|x, y| x.0.total_cmp(&y.0))
    }

    /// Distance in mm of a place from the nearest ink, infinite if there is none.
    #[must_use]
    pub fn distance(&self, p: DVec2) -> f64 {
        if self.segments.is_empty() {
            return f64::INFINITY;
        }
        let [x, y] = self.cell(p);
        let outside =
            [-x, -y, x - self.across as i64 + 1, y - self.up as i64 + 1].into_iter().max().unwrap_or(0).max(0);
        let most = outside + self.across.max(self.up) as i64;
        let mut best = f64::INFINITY;
        // Rings of cells: one of radius r holds nothing nearer than (r − 1) cells.
        for r in outside..=most {
            if best <= (r - 1) as f64 * CELL {
                break;
            }
            for j in -r..=r {
                let step = if j.abs() == r { 1 } else { 2 * r.max(1) };
                let mut i = -r;
                while i <= r {
                    best = best.min(self.nearest_in([x + i, y + j], p));
                    i += step;
                }
            }
        }
        best
    }

    fn cell(&self, p: DVec2) -> [i64; 2] {
        let c = ((p - self.lo) / CELL).floor();
        [c.x as i64, c.y as i64]
    }

    fn nearest_in(&self, [x, y]: [i64; 2], p: DVec2) -> f64 {
        if x < 0 || y < 0 || x >= self.across as i64 || y >= self.up as i64 {
            return f64::INFINITY;
        }
        let list = &self.cells[y as usize * self.across + x as usize];
        list.iter().map(|&k| to_segment(p, self.segments[k as usize])).fold(f64::INFINITY, f64::min)
    }
}

fn to_segment(p: DVec2, [a, b]: [DVec2; 2]) -> f64 {
    let d = b - a;
    let along = if d == DVec2::ZERO { 0.0 } else { ((p - a).dot(d) / d.length_squared()).clamp(0.0, 1.0) };
    p.distance(a + d * along)
}

#[cfg(test)]
mod tests {
    use super::*;
    use penvis::drawing::{Page, Polyline};
    use penvis::pens::Pens;

    fn drawing(lines: &[&[[f64; 2]]]) -> Drawing {
        let line = |points: &&[[f64; 2]]| Polyline::stroke("ink", 1, points.iter().map(|&p| p.into()).collect());
        let page = Page { width_mm: 100.0, height_mm: 100.0 };
        Drawing {
            name: "test".into(),
            page,
            isos: 0,
            pens: Pens::default(),
            slack_mm: 0.0,
            polylines: lines.iter().map(line).collect(),
        }
    }

    #[test]
    fn distances_are_those_of_trying_all_segments() {
        let lines: &[&[[f64; 2]]] = &[&[[0.0, 0.0], [30.0, 4.0], [31.0, 20.0]], &[[12.0, 40.0], [12.0, 40.0]]];
        let ink = Ink::new(&drawing(lines));
        for k in 0..400 {
            let p = DVec2::new(f64::from(k % 20) * 3.1 - 9.0, f64::from(k / 20) * 2.9 - 7.0);
            let direct = ink.segments.iter().map(|&s| to_segment(p, s)).fold(f64::INFINITY, f64::min);
            assert!((ink.distance(p) - direct).abs() < 1e-12, "at {p}: {} and {direct}", ink.distance(p));
        }
    }

    #[test]
    fn a_line_left_out_and_a_line_too_many_are_seen_from_one_side_each() {
        let two = Ink::new(&drawing(&[&[[0.0, 0.0], [10.0, 0.0]], &[[0.0, 7.0], [10.0, 7.0]]]));
        let one = Ink::new(&drawing(&[&[[0.0, 0.0], [10.0, 0.0]]]));
        assert!((two.farthest_from(&one).unwrap().0 - 7.0).abs() < 1e-12);
        assert_eq!(one.farthest_from(&two).unwrap().0, 0.0);
        assert!(Ink::new(&drawing(&[])).farthest_from(&one).is_none());
        assert_eq!(one.farthest_from(&Ink::new(&drawing(&[]))).unwrap().0, f64::INFINITY);
    }
}
