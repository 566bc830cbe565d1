//! Vertices that a polyline does not need.

use std::borrow::Cow;

use glam::DVec2;

use super::{Drawing, Polyline};

impl Drawing {
    /// The drawing with as few vertices as its slack allows, which is used up by that. What stays is where it was. Cost: linear in the vertices.
    #[must_use]
    pub fn thinned(&self) -> Cow<'_, Self> {
        if self.slack_mm <= 0.0 {
            return Cow::Borrowed(self);
        }
        let mut thin = self.clone();
        thin.polylines.iter_mut().for_each(|polyline| simplify(polyline, self.slack_mm));
        thin.slack_mm = 0.0;
        Cow::Owned(thin)
    }
}

/// Leaves out vertices of a polyline, so that what is left is nowhere farther than `chord_mm` from what was there, and the other way round. First and
/// last vertices stay.
///
/// From a vertex that is kept, the chord goes on as long as it passes all vertices between within `chord_mm`: the directions in which it does are a wedge
/// that each vertex makes narrower (Sklansky and Gonzalez 1980). It never turns back, as the way of the pen must not become shorter. Bounds hold
/// against the vertices that were given, and do not add up along the line. Cost: linear.
pub(crate) fn simplify(line: &mut Polyline, chord_mm: f64) {
    let kept = kept(&line.page, chord_mm);
    if kept.len() < line.page.len() && line.points.len() == line.page.len() {
        line.page = kept.iter().map(|&k| line.page[k]).collect();
        line.points = kept.iter().map(|&k| line.points[k]).collect();
    }
}

/// Indices of the vertices that are needed, as [`simplify`] says; the first and the last are among them.
pub(crate) fn kept(page: &[DVec2], chord: f64) -> Vec<usize> {
    let Some(&first) = page.first() else { return Vec::new() };
    let mut kept = vec![0];
    let mut wedge = Wedge::new(first, chord);
    for (k, w) in page.windows(2).enumerate() {
        if wedge.takes(w[1]) {
            continue;
        }
        // The chord ends at the vertex before, and the next one begins there.
        if kept.last() != Some(&k) {
            kept.push(k);
        }
        wedge = Wedge::new(w[0], chord);
        wedge.takes(w[1]);
    }
    if page.len() > 1 {
        kept.push(page.len() - 1);
    }
    kept
}

/// The directions in which a chord passes all vertices so far.
struct Wedge {
    from: DVec2,
    chord: f64,
    /// Distance of the last vertex.
    reach: f64,
    /// A direction, and the angles from it between which the wedge lies; none while all vertices are so near that every direction does.
    sides: Option<(DVec2, f64, f64)>,
}

impl Wedge {
    fn new(from: DVec2, chord: f64) -> Self {
        Self { from, chord, reach: 0.0, sides: None }
    }

    /// Whether a chord may end at the next vertex; then it counts as one that later chords pass.
    fn takes(&mut self, p: DVec2) -> bool {
        let way = p - self.from;
        let reach = way.length();
        if !(reach >= self.reach && reach.is_finite()) {
            // Nor may one after it, where it is no number.
            self.reach = f64::INFINITY;
            return false;
        }
        self.reach = reach;
        let Some((axis, low, high)) = self.sides else {
            if reach > self.chord {
                let half = (self.chord / reach).asin();
                self.sides = Some((way / reach, -half, half));
            }
            return true;
        };
        let (angle, half) = (axis.angle_to(way), (self.chord / reach).asin());
        self.sides = Some((axis, low.max(angle - half), high.min(angle + half)));
        (low..=high).contains(&angle)
    }
}

#[cfg(test)]
mod tests {
    use penvis_core::stroke::CurveKind::Iso;
    use proptest::prelude::*;

    use super::*;
    use crate::emit::tests::{drawing, polyline};

    fn simplified(page: &[[f64; 2]], chord: f64) -> Vec<[f64; 2]> {
        let mut line = polyline(Iso, 1, page);
        simplify(&mut line, chord);
        assert!(line.points.iter().zip(&line.page).all(|(q, p)| *q == p.extend(0.5)));
        line.page.into_iter().map(|p| p.to_array()).collect()
    }

    #[test]
    fn straight_runs_keep_their_ends_and_corners_stay() {
        let run: Vec<[f64; 2]> =
            (0..=10).map(|k| [f64::from(k), 0.0]).chain((1..=10).map(|k| [10.0, f64::from(k)])).collect();
        assert_eq!(simplified(&run, 0.001), [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]]);
        assert_eq!(simplified(&run, 0.0), [[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]]);
    }

    #[test]
    fn ways_there_and_back_are_kept() {
        let spike = [[0.0, 0.0], [5.0, 0.0], [3.0, 0.0], [9.0, 0.0]];
        assert_eq!(simplified(&spike, 0.01), spike);
        let ring = [[0.0, 0.0], [0.001, 0.0], [0.001, 0.001], [0.0, 0.0]];
        assert_eq!(simplified(&ring, 0.01).len(), 3);
    }

    #[test]
    fn one_vertex_two_and_the_same_ones_are_lines_too() {
        assert_eq!(simplified(&[[1.0, 2.0]], 0.1).len(), 1);
        assert_eq!(simplified(&[[1.0, 2.0], [1.0, 2.0]], 0.1), [[1.0, 2.0]; 2]);
        assert_eq!(simplified(&[[1.0, 2.0], [1.0, 2.0], [4.0, 2.0], [4.0, 2.0]], 0.1), [[1.0, 2.0], [4.0, 2.0]]);
        let lost = [DVec2::ZERO, DVec2::X, DVec2::NAN, DVec2::X, DVec2::ZERO];
        assert_eq!(kept(&lost, 0.1), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn a_circle_has_about_as_few_chords_as_its_tolerance_allows() {
        let page: Vec<[f64; 2]> = (0..=10_000)
            .map(|k| (DVec2::from_angle(f64::from(k) * std::f64::consts::TAU / 1e4) * 50.0).to_array())
            .collect();
        // A chord of a sagitta of 0.01 mm: 2 sqrt(2 r s); the wedge also allows for what lies on the other side.
        let fewest = std::f64::consts::TAU * 50.0 / (2.0 * (2.0 * 50.0 * 0.01_f64).sqrt());
        let found = simplified(&page, 0.01).len() as f64;
        assert!((fewest..1.1 * fewest).contains(&found), "{found} for {fewest}");
    }

    #[test]
    fn what_stays_is_where_it_was_and_near_enough() {
        let circle: Vec<[f64; 2]> = (0..=400)
            .map(|k| DVec2::from_angle(f64::from(k) / 400.0 * std::f64::consts::TAU) * 30.0)
            .map(|p| [p.x + 50.0, p.y + 50.0])
            .collect();
        let straight: Vec<[f64; 2]> = (0..=50).map(|k| [f64::from(k), 3.0]).collect();
        let mut fine = drawing(100.0, 100.0, vec![polyline(Iso, 1, &circle), polyline(Iso, 1, &straight)]);
        assert_eq!(*fine.thinned(), fine);
        fine.slack_mm = 0.0075;
        let thin = fine.thinned();
        assert_eq!((thin.slack_mm, thin.polylines[1].page.len()), (0.0, 2));
        let (few, all) = (&thin.polylines[0], &fine.polylines[0]);
        // The vertices between the ends of three chords are 0.0074 mm from the way between these, those of four 0.0148 mm.
        assert_eq!((few.page.len(), few.points.len()), (135, 135));
        assert_eq!((few.page.first(), few.page.last()), (all.page.first(), all.page.last()));
        for p in &all.page {
            let near = few.page.windows(2).any(|w| {
                let along = ((*p - w[0]).dot(w[1] - w[0]) / w[0].distance_squared(w[1])).clamp(0.0, 1.0);
                p.distance(w[0].lerp(w[1], along)) <= 0.0075 + 1e-12
            });
            assert!(near, "{p}");
        }
    }

    /// Distance of a point from a polyline.
    fn distance(p: DVec2, line: &[DVec2]) -> f64 {
        let to = |w: &[DVec2]| {
            let d = w[1] - w[0];
            let t = if d == DVec2::ZERO { 0.0 } else { ((p - w[0]).dot(d) / d.length_squared()).clamp(0.0, 1.0) };
            p.distance(w[0] + d * t)
        };
        line.windows(2).map(to).fold(f64::INFINITY, f64::min)
    }

    fn farthest(from: &[DVec2], to: &[DVec2]) -> f64 {
        let places = from.windows(2).flat_map(|w| (0..=8).map(|k| w[0].lerp(w[1], f64::from(k) / 8.0)));
        places.map(|p| distance(p, to)).fold(0.0, f64::max)
    }

    proptest! {
        #[test]
        fn neither_line_leaves_the_other(
            steps in prop::collection::vec((0.0..0.3_f64, -0.5..0.5_f64, 0_u32..20), 2..80), chord in 0.0..0.2_f64
        ) {
            let (mut at, mut heading) = (DVec2::ZERO, 0.0);
            let mut page = vec![at];
            for (step, turn, what) in steps {
                heading += match what {
                    0 => std::f64::consts::PI,
                    1..6 => turn,
                    _ => turn * 0.02,
                };
                at += DVec2::from_angle(heading) * step;
                page.push(at);
            }
            let given: Vec<[f64; 2]> = page.iter().map(|p| p.to_array()).collect();
            let found: Vec<DVec2> = simplified(&given, chord).into_iter().map(DVec2::from).collect();
            prop_assert!(farthest(&page, &found) <= chord + 1e-9);
            prop_assert!(farthest(&found, &page) <= chord + 1e-9);
            prop_assert_eq!((found.first(), found.last()), (page.first(), page.last()));
        }
    }
}
