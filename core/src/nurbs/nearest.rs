//! The point of a curve nearest to a point in space.

use alloc::vec::Vec;

use glam::{DVec3, DVec4};

use super::Curve;
use super::refine::halves;

/// Halvings of a span: what is left of it is then narrower than the spacing of numbers near its ends.
const MAX_HALVINGS: u32 = 60;

/// Part of the distance, and of the length of a segment, by which another point may be nearer.
const SLACK: f64 = 1e-12;

/// A part of a Bézier segment.
struct Part {
    t: [f64; 2],
    points: Vec<DVec4>,
    /// No point of it is nearer than this.
    least: f64,
    halvings: u32,
}

impl Curve {
    /// The parameter of the point nearest to `point`, and its distance. Where several are as near, the one with the lowest
    /// parameter among those at the ends of the parts that the search halves, or else any of them.
    ///
    /// No point is nearer by more than 10⁻¹² of the distance and of the length of the longest segment's control polygon. Cost: some hundred
    /// subdivisions; for points as far from much of the curve, such as the centre of an arc, some thousand.
    #[must_use]
    pub fn nearest(&self, point: DVec3) -> (f64, f64) {
        let segments = self.bezier_segments();
        let (mut best, mut size) = ((self.domain()[0], f64::INFINITY), 0.0_f64);
        let mut parts = Vec::with_capacity(segments.len());
        for s in segments {
            for (t, h) in [(s.interval[0], s.points.first()), (s.interval[1], s.points.last())] {
                let Some(h) = h else { continue };
                let distance = (h.truncate() / h.w).distance(point);
                if distance < best.1 {
                    best = (t, distance);
                }
            }
            let (least, extent) = bounds(&s.points, point);
            size = size.max(extent);
            parts.push(Part { t: s.interval, points: s.points, least, halvings: 0 });
        }
        // The nearest last, so that it is looked into first.
        parts.sort_by(|a, b| b.least.total_cmp(&a.least));
        while let Some(part) = parts.pop() {
            if part.least >= best.1 - SLACK * (best.1 + size) || part.halvings == MAX_HALVINGS {
                continue;
            }
            let middle = 0.5 * (part.t[0] + part.t[1]);
            let (left, right) = halves(part.points, 1);
            let Some(h) = left.last() else { continue };
            let distance = (h.truncate() / h.w).distance(point);
            if distance < best.1 {
                best = (middle, distance);
            }
            let half = |points: Vec<DVec4>, t: [f64; 2]| {
                let least = bounds(&points, point).0;
                Part { t, points, least, halvings: part.halvings + 1 }
            };
            let mut both = [half(left, [part.t[0], middle]), half(right, [middle, part.t[1]])];
            both.sort_by(|a, b| b.least.total_cmp(&a.least));
            parts.extend(both);
        }
        best
    }
}

/// A lower bound of the distance of a point from the hull of control points, and the length of their polygon.
///
/// The hull is nowhere farther from the chord than the control points are. That is of second order in the length of a part,
/// so that near the nearest point the number of parts that are still to be searched does not grow.
fn bounds(points: &[DVec4], point: DVec3) -> (f64, f64) {
    let at = |h: &DVec4| h.truncate() / h.w;
    let (Some(a), Some(b)) = (points.first().map(at), points.last().map(at)) else { return (f64::INFINITY, 0.0) };
    let width = points.iter().map(|h| to_segment(at(h), [a, b])).fold(0.0, f64::max);
    let length = points.windows(2).map(|w| at(&w[0]).distance(at(&w[1]))).sum();
    (to_segment(point, [a, b]) - width, length)
}

/// Distance of a point from a segment.
fn to_segment(point: DVec3, [a, b]: [DVec3; 2]) -> f64 {
    let along = b - a;
    let share = (point - a).dot(along) / along.length_squared();
    // A segment without length has no share.
    let share = if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 };
    point.distance(a + along * share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shape::{Frame, arc, polyline};

    #[test]
    fn points_of_a_curve_are_found_again() {
        let curve = arc(&Frame::at(DVec3::new(1.0, -2.0, 0.5)).unwrap(), 3.0, 0.4, 5.5).unwrap();
        for k in 0..=100 {
            let t = f64::from(k) / 100.0;
            let (found, distance) = curve.nearest(curve.eval(t));
            assert!(distance < 1e-11 && (found - t).abs() < 1e-6, "{t}: {found}, {distance}");
        }
    }

    #[test]
    fn the_nearest_point_off_a_polygon_is_that_of_geometry() {
        let curve = polyline(&[DVec3::ZERO, DVec3::new(2.0, 0.0, 0.0), DVec3::new(2.0, 1.0, 0.0)]).unwrap();
        let (t, distance) = curve.nearest(DVec3::new(0.5, -1.0, 0.0));
        assert!((t - 0.125).abs() < 1e-6 && (distance - 1.0).abs() < 1e-12, "{t} {distance}");
        let (t, distance) = curve.nearest(DVec3::new(3.0, 2.0, 0.0));
        assert!(t == 1.0 && (distance - 2.0_f64.sqrt()).abs() < 1e-12, "{t} {distance}");
        let (t, _) = curve.nearest(DVec3::new(3.0, -1.0, 0.0));
        assert_eq!(t, 0.5);
    }

    #[test]
    fn a_point_as_far_from_all_of_a_circle_is_at_its_radius() {
        let curve = arc(&Frame::WORLD, 2.0, 0.0, core::f64::consts::TAU).unwrap();
        let (_, distance) = curve.nearest(DVec3::ZERO);
        assert!((distance - 2.0).abs() < 1e-9);
    }
}
