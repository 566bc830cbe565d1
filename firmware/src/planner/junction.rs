//! The speed of a corner: junction deviation.
//!
//! The published idea (S. Jeon 2009): the corner of two lines is replaced by the circle tangent to both
//! whose distance from the vertex is δ (`$11`); with the half-angle θ/2 between the lines its radius is R = δ·sin(θ/2)/(1 − sin(θ/2)), and
//! v² ≤ a·R. For chords of a curve δ alone would allow more than the curve does: a circle tangent to both at half of the shorter
//! has R = ½·min(l₁, l₂)·tan(θ/2), which for equal chords is the curve's own radius; the smaller R counts. Collinear blocks are not slowed.

use super::block::Tail;
use crate::axis::AXES;
use crate::settings::Settings;

/// Square of the speed at which the corner between two blocks may be taken, (mm/s)².
pub(super) fn junction_sqr(before: &Tail, after: &Tail, settings: &Settings) -> f32 {
    let mut cos = 0.0;
    for axis in 0..AXES {
        cos -= before.direction[axis] * after.direction[axis];
    }
    // Of the angle θ between the lines: π when they go straight on, 0 when they turn back. Halves of it by the sums of squares, which stay accurate at both ends.
    let sin_half = libm::sqrtf(((1.0 - cos) / 2.0).clamp(0.0, 1.0));
    let cos_half = libm::sqrtf(((1.0 + cos) / 2.0).clamp(0.0, 1.0));
    // The cosine of unit vectors in f32 is uncertain by about 2⁻²²; a deviation from straight below its root (0.03°) is noise.
    if cos_half * cos_half <= f32::EPSILON {
        return f32::INFINITY;
    }
    let deviation = settings.junction_deviation as f32;
    // 1 − sin = cos²/(1 + sin), without cancellation.
    let by_deviation = deviation * sin_half * (1.0 + sin_half) / (cos_half * cos_half);
    let by_chords = 0.5 * before.length.min(after.length) * sin_half / cos_half;
    // The change of the velocity points along the difference of the directions, whose length is 2·cos(θ/2).
    let mut acceleration = f32::INFINITY;
    for axis in 0..AXES {
        let share = (after.direction[axis] - before.direction[axis]).abs() / (2.0 * cos_half);
        if share > 0.0 {
            acceleration = acceleration.min(settings.acceleration[axis] as f32 / share);
        }
    }
    acceleration * by_deviation.min(by_chords)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tail(direction: [f64; 2], length: f32) -> Tail {
        let norm = libm::hypot(direction[0], direction[1]);
        let direction = [(direction[0] / norm) as f32, (direction[1] / norm) as f32, 0.0];
        Tail { direction, length, ..Tail::default() }
    }

    fn close(got: f32, expect: f64) {
        assert!((f64::from(got) - expect).abs() <= 1e-3 * expect, "{got}, not {expect}");
    }

    #[test]
    fn junctions_by_closed_form() {
        let settings = Settings::default();
        let east = tail([1.0, 0.0], 10.0);
        // Straight on, and straight on as well as text of three decimals can say it.
        assert_eq!(junction_sqr(&east, &east, &settings), f32::INFINITY);
        let a = tail([0.333, 0.667], 10.0);
        assert_eq!(junction_sqr(&a, &a, &settings), f32::INFINITY);
        // A right angle: R = δ·s/(1 − s) with s = sin 45°, and the turn is shared by both axes.
        let s = libm::sqrt(0.5);
        close(junction_sqr(&east, &tail([0.0, 1.0], 10.0), &settings), 1000.0 * libm::sqrt(2.0) * 0.01 * s / (1.0 - s));
        // Back again.
        assert_eq!(junction_sqr(&east, &tail([-1.0, 0.0], 10.0), &settings), 0.0);
        // Chords of 1 mm of a circle: its radius is l / (2·sin(turn/2)), and tan for the tangent circle.
        let turn = 0.01;
        let before = tail([libm::cos(turn / 2.0), -libm::sin(turn / 2.0)], 1.0);
        let after = tail([libm::cos(turn / 2.0), libm::sin(turn / 2.0)], 5.0);
        close(junction_sqr(&before, &after, &settings), 1000.0 * 0.5 / libm::tan(turn / 2.0));
        // δ = 0 stops at every corner but a straight one.
        let mut exact = settings;
        exact.set(11, 0.0).unwrap();
        assert_eq!(junction_sqr(&before, &after, &exact), 0.0);
        assert_eq!(junction_sqr(&east, &east, &exact), f32::INFINITY);
    }
}
