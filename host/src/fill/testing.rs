//! What tests of several fills need.

use glam::DVec2;
use proptest::prelude::*;

use super::area::Loop;

/// Distance of a point from a segment.
pub(super) fn distance(p: DVec2, [a, b]: [DVec2; 2]) -> f64 {
    let d = b - a;
    let share = if d.length_squared() > 0.0 { ((p - a).dot(d) / d.length_squared()).clamp(0.0, 1.0) } else { 0.0 };
    p.distance(a + share * d)
}

/// Whether a point is inside by the turns that the sides make as seen from it.
pub(super) fn winds(p: DVec2, loops: &[Loop]) -> bool {
    let turns: f64 = loops.iter().flat_map(Loop::sides).map(|([a, b], _)| (a - p).angle_to(b - p)).sum();
    (turns / std::f64::consts::TAU).round() != 0.0
}

/// A corner of a polygon, mostly on a coarse grid, so that sides run along lines and coincide, corners lie on them and touch, and loops cross
/// themselves.
pub(super) fn corner() -> impl Strategy<Value = DVec2> {
    let planted = (0..=12i32, 0..=12i32).prop_map(|(x, y)| DVec2::new(f64::from(x), f64::from(y)));
    let any = (0.0..12.0, 0.0..12.0).prop_map(|(x, y)| DVec2::new(x, y));
    prop_oneof![3 => planted, 1 => any]
}
