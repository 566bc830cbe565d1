//! Fewer points for the same path, while it is being drawn.

use std::collections::VecDeque;

use glam::DVec2;

/// Leaves out points of a path as they come, so that every point left out is within `tolerance` of the segment in its place.
///
/// From the last point kept, the *anchor*, each point that follows allows a cone of directions: those of the rays that pass
/// within the tolerance of it. As long as the cones of all points since the anchor have directions in common, there may be a point
/// ahead that lies in one of them, and the segment to it serves for all of them. Steps of a motor swing to and fro about the straight line that
/// they approximate: not every one lies in the cone, but the last one of the line does.
///
/// ```text
///                 .-- cone of p1 and p2
///            p1 o     _,-o p3       p3 lies in the cone: p1 and p2 may be left out
///  anchor o<------- o p2 ----->
/// ```
///
/// When the cones have nothing in common any more, or the path comes back towards the anchor, the last point that lay in the cone is the
/// next anchor, and the points after it are looked at again. They are as many as a motor makes between two steps of the slower axis,
/// so that a plot of hours needs no more memory than its drawing.
#[derive(Clone, Debug)]
pub(super) struct Simplifier {
    tolerance: f64,
    points: Vec<DVec2>,
    /// The last point to which a segment from the anchor serves.
    end: Option<DVec2>,
    /// The points after `end`.
    pending: Vec<DVec2>,
    /// Clockwise and anticlockwise edges of the cone; none while every direction will do.
    cone: Option<Cone>,
    /// Square of the largest distance from the anchor.
    farthest: f64,
}

/// Directions between two edges less than a half turn apart.
#[derive(Clone, Copy, Debug)]
struct Cone {
    right: DVec2,
    left: DVec2,
}

impl Cone {
    /// The rays that pass within `tolerance` of a point; none when all do.
    fn about(away: DVec2, tolerance: f64) -> Option<Self> {
        let distance = away.length();
        if distance <= tolerance {
            return None;
        }
        let sine = tolerance / distance;
        let cosine = (1.0 - sine * sine).sqrt();
        Some(Self { right: DVec2::new(cosine, -sine).rotate(away), left: DVec2::new(cosine, sine).rotate(away) })
    }

    fn holds(&self, away: DVec2) -> bool {
        self.right.perp_dot(away) >= 0.0 && away.perp_dot(self.left) >= 0.0
    }

    /// The directions in common; none when there are none.
    fn common(&self, other: &Self) -> Option<Self> {
        let right = if self.right.perp_dot(other.right) > 0.0 { other.right } else { self.right };
        let left = if other.left.perp_dot(self.left) > 0.0 { other.left } else { self.left };
        (right.perp_dot(left) >= 0.0).then_some(Self { right, left })
    }
}

impl Simplifier {
    /// A path that begins at `start`.
    pub(super) fn new(start: DVec2, tolerance: f64) -> Self {
        Self { tolerance, points: vec![start], end: None, pending: Vec::new(), cone: None, farthest: 0.0 }
    }

    /// The path goes straight on to `point`.
    pub(super) fn push(&mut self, point: DVec2) {
        if self.extend(point) {
            return;
        }
        let mut again = self.keep();
        again.push_back(point);
        self.replay(again);
    }

    /// Keeps the last point: the path may turn there, and what follows is no longer on one line with what came before.
    pub(super) fn corner(&mut self) {
        while self.end.is_some() {
            let again = self.keep();
            self.replay(again);
        }
    }

    /// The points that are kept, the first and the last among them; two or more.
    pub(super) fn finish(mut self) -> Vec<DVec2> {
        self.corner();
        if self.points.len() == 1 {
            self.points.push(self.anchor());
        }
        self.points
    }

    fn anchor(&self) -> DVec2 {
        // It begins with one point, and none is ever taken out.
        self.points.last().copied().unwrap_or_default()
    }

    /// Takes one more point, if the points since the anchor may still be replaced by one segment with it.
    fn extend(&mut self, point: DVec2) -> bool {
        let away = point - self.anchor();
        let squared = away.length_squared();
        if squared < self.farthest {
            return false;
        }
        let serves = self.cone.is_none_or(|cone| cone.holds(away));
        self.cone = match (self.cone, Cone::about(away, self.tolerance)) {
            (Some(cone), Some(about)) => match cone.common(&about) {
                Some(common) => Some(common),
                None => return false,
            },
            (cone, about) => cone.or(about),
        };
        self.farthest = squared;
        if serves {
            self.end = Some(point);
            self.pending.clear();
        } else {
            self.pending.push(point);
        }
        true
    }

    /// Makes the end the next anchor, and returns the points after it.
    fn keep(&mut self) -> VecDeque<DVec2> {
        // The first point after an anchor always serves, so that an end is there when there is anything to keep.
        if let Some(end) = self.end.take() {
            self.points.push(end);
        }
        self.cone = None;
        self.farthest = 0.0;
        std::mem::take(&mut self.pending).into()
    }

    fn replay(&mut self, mut points: VecDeque<DVec2>) {
        while let Some(point) = points.pop_front() {
            if !self.extend(point) {
                let mut again = self.keep();
                again.push_back(point);
                again.append(&mut points);
                points = again;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn simplified(path: &[DVec2], tolerance: f64) -> Vec<DVec2> {
        let mut simplifier = Simplifier::new(path[0], tolerance);
        for point in &path[1..] {
            simplifier.push(*point);
        }
        simplifier.finish()
    }

    fn distance(p: DVec2, a: DVec2, b: DVec2) -> f64 {
        let along = b - a;
        let t = if along == DVec2::ZERO { 0.0 } else { ((p - a).dot(along) / along.length_squared()).clamp(0.0, 1.0) };
        p.distance(a + along * t)
    }

    /// The largest distance of a point of `path` from the polyline `kept`, going along both in order.
    fn deviation(path: &[DVec2], kept: &[DVec2]) -> f64 {
        let (mut segment, mut worst) = (0, 0.0_f64);
        for (i, p) in path.iter().enumerate() {
            // The next segment begins where a kept point is met, but a point may be met twice: the better of the two counts.
            let here = distance(*p, kept[segment], kept[segment + 1]);
            if *p == kept[segment + 1] && segment + 2 < kept.len() && i > 0 {
                segment += 1;
            }
            worst = worst.max(here.min(distance(*p, kept[segment], kept[segment + 1])));
        }
        worst
    }

    /// The points that a step motor passes from (0, 0) to (x, y).
    fn staircase(x: i32, y: i32) -> Vec<DVec2> {
        let events = x.abs().max(y.abs());
        let at = |total: i32, i: i32| (f64::from(total) * f64::from(i) / f64::from(events.max(1))).round();
        (0..=events).map(|i| DVec2::new(at(x, i), at(y, i))).collect()
    }

    #[test]
    fn a_straight_run_of_steps_is_one_segment() {
        for (x, y) in [(1000, 0), (1000, 1000), (1000, 370), (-999, 17), (3, -1000)] {
            assert_eq!(simplified(&staircase(x, y), 0.5).len(), 2, "to ({x}, {y})");
        }
    }

    #[test]
    fn a_corner_and_a_reversal_are_kept() {
        let l = |points: &[(f64, f64)]| -> Vec<DVec2> { points.iter().map(|p| DVec2::from(*p)).collect() };
        let path = l(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0), (3.0, 1.0), (3.0, 2.0), (3.0, 3.0)]);
        let kept = simplified(&path, 0.5);
        assert!(kept.len() <= 4 && deviation(&path, &kept) <= 0.5);
        let path = l(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (1.0, 0.0), (0.0, 0.0), (-1.0, 0.0)]);
        assert_eq!(simplified(&path, 0.5), l(&[(0.0, 0.0), (2.0, 0.0), (-1.0, 0.0)]));
    }

    #[test]
    fn steps_of_two_lines_are_two_segments_with_their_corner() {
        let mut simplifier = Simplifier::new(DVec2::ZERO, 0.5);
        staircase(1000, 370).into_iter().for_each(|p| simplifier.push(p));
        simplifier.corner();
        simplifier.corner();
        let corner = DVec2::new(1000.0, 370.0);
        staircase(990, 371).into_iter().skip(1).for_each(|p| simplifier.push(corner + p));
        assert_eq!(simplifier.finish(), [DVec2::ZERO, corner, corner + DVec2::new(990.0, 371.0)]);
    }

    #[test]
    fn a_dot_has_two_points() {
        assert_eq!(simplified(&[DVec2::ONE], 0.5), vec![DVec2::ONE, DVec2::ONE]);
    }

    proptest! {
        #[test]
        fn no_point_is_farther_than_the_tolerance(steps in prop::collection::vec((-1i32..=1, -1i32..=1, 1usize..30), 1..60)) {
            let mut at = DVec2::ZERO;
            let mut path = vec![at];
            for (dx, dy, times) in steps {
                if (dx, dy) == (0, 0) { continue; }
                for _ in 0..times {
                    at += DVec2::new(f64::from(dx), f64::from(dy));
                    path.push(at);
                }
            }
            let kept = simplified(&path, 0.5);
            prop_assert_eq!(kept[0], path[0]);
            prop_assert_eq!(kept[kept.len() - 1], at);
            // Rounding of a few products of coordinates below 2000.
            prop_assert!(deviation(&path, &kept) <= 0.5 + 1e-9);
        }
    }
}
