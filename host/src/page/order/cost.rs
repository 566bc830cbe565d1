//! What a way with the pen up costs.

use glam::DVec2;

use crate::straight;

/// How ways between strokes are rated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measure {
    /// By their length.
    Distance,
    /// By the time from the end of one stroke to the beginning of the next, from rest to rest. A way of no length takes none, as the pen stays
    /// down.
    Time {
        /// Time to lift and to lower the pen in s.
        lift_s: f64,
        /// Speed with the pen up in mm/s.
        speed: f64,
        /// Acceleration in mm/s².
        acceleration: f64,
        /// What these two are those of: each axis by itself, so that a slanting way is as fast as its longer part, or the pen.
        of_axes: bool,
    },
}

impl Measure {
    /// Cost of a way in mm or in s.
    #[must_use]
    pub fn of(&self, way: DVec2) -> f64 {
        match *self {
            Self::Distance => way.length(),
            Self::Time { .. } if way == DVec2::ZERO => 0.0,
            Self::Time { lift_s, speed, acceleration, of_axes } => {
                let length = if of_axes { way.abs().max_element() } else { way.length() };
                lift_s + straight::seconds(length, speed, acceleration)
            }
        }
    }
}

/// Costs in whole numbers: their sums are exact, so that no search goes in circles over roundings.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    measure: Measure,
    per_unit: f64,
}

impl Scale {
    /// For this many ways that are no longer than this.
    pub(super) fn new(measure: Measure, longest_mm: f64, ways: usize) -> Self {
        // The sum of all ways, and of those that an exchange adds and removes, stays below 2^62.
        let bits = 60_u32.saturating_sub(usize::BITS - ways.leading_zeros()).min(44);
        let most = measure.of(DVec2::X * longest_mm);
        let per_unit = if most > 0.0 && most.is_finite() { (1_u64 << bits) as f64 / most } else { 0.0 };
        Self { measure, per_unit: if per_unit.is_finite() { per_unit } else { 0.0 } }
    }

    pub(super) fn between(&self, a: DVec2, b: DVec2) -> i64 {
        (self.measure.of(b - a) * self.per_unit) as i64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_is_a_triangle_and_then_a_trapezoid_with_a_lift() {
        let time = |of_axes: bool| Measure::Time { lift_s: 0.3, speed: 100.0, acceleration: 1000.0, of_axes };
        // 10 mm are what it takes to reach 100 mm/s and to stop again: 0.2 s either way.
        for (mm, s) in [(0.0, 0.0), (2.5, 0.4), (10.0, 0.5), (110.0, 1.5)] {
            for (of_axes, way) in [(false, DVec2::new(0.6, 0.8)), (true, DVec2::new(0.6, -1.0))] {
                let found = time(of_axes).of(way * mm);
                assert!((found - s).abs() < 1e-12, "{mm} mm took {found} s");
            }
        }
        assert_eq!(Measure::Distance.of(DVec2::new(4.5, -6.0)), 7.5);
    }

    #[test]
    fn whole_numbers_keep_nine_digits_and_their_sums_fit() {
        let (a, b) = (DVec2::ZERO, DVec2::new(3.0, 4.0));
        for ways in [1, 1000, 10_000_000] {
            let scale = Scale::new(Measure::Distance, 500.0, ways);
            let ratio = scale.between(a, b * 100.0) as f64 / scale.between(a, b) as f64;
            assert!((ratio - 100.0).abs() < 1e-6, "{ratio}");
            assert!(scale.between(a, b * 100.0).checked_mul(2 * ways as i64).is_some());
        }
        assert_eq!(Scale::new(Measure::Distance, 0.0, 3).between(a, a), 0);
    }
}
