//! Intervals, as coefficients give them.

use core::ops::{Mul, Sub};

/// The numbers from `lo` to `hi`. Its own rounding, some units in the last place, is for whoever widens it by that of
/// the coefficients.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interval {
    pub(crate) lo: f64,
    pub(crate) hi: f64,
}

impl Interval {
    pub(crate) fn new((lo, hi): (f64, f64)) -> Self {
        Self { lo, hi }
    }

    pub(crate) fn widened(self, by: f64) -> Self {
        Self { lo: self.lo - by, hi: self.hi + by }
    }

    /// The squares of its numbers: unlike those of a product with itself, none is negative.
    pub(crate) fn squared(self) -> Self {
        let least = if self.lo <= 0.0 && self.hi >= 0.0 { 0.0 } else { self.lo.abs().min(self.hi.abs()) };
        let most = self.magnitude();
        Self { lo: least * least, hi: most * most }
    }

    /// The largest absolute value.
    pub(crate) fn magnitude(self) -> f64 {
        self.lo.abs().max(self.hi.abs())
    }

    /// The sign that all of its numbers have, if they do.
    pub(crate) fn sign(self) -> Option<f64> {
        if self.lo > 0.0 {
            Some(1.0)
        } else if self.hi < 0.0 {
            Some(-1.0)
        } else {
            None
        }
    }
}

impl Mul for Interval {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let all = [self.lo * other.lo, self.lo * other.hi, self.hi * other.lo, self.hi * other.hi];
        let (lo, hi) = all.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(*x), hi.max(*x)));
        Self { lo, hi }
    }
}

impl Sub for Interval {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self { lo: self.lo - other.hi, hi: self.hi - other.lo }
    }
}
