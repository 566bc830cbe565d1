//! Rectangles in plotter units.

use std::fmt;

/// A rectangle with its border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Window {
    pub(super) low: [f64; 2],
    pub(super) high: [f64; 2],
}

impl Window {
    pub(super) fn new(x: [i32; 2], y: [i32; 2]) -> Self {
        Self { low: [f64::from(x[0]), f64::from(y[0])], high: [f64::from(x[1]), f64::from(y[1])] }
    }

    /// Between two corners.
    pub(super) fn between(a: [f64; 2], b: [f64; 2]) -> Self {
        Self { low: [a[0].min(b[0]), a[1].min(b[1])], high: [a[0].max(b[0]), a[1].max(b[1])] }
    }

    /// What is in both; when nothing is, a border of `self`.
    pub(super) fn common(&self, other: &Self) -> Self {
        Self { low: self.nearest(other.low), high: self.nearest(other.high) }
    }

    /// The place in it that is nearest to one.
    pub(super) fn nearest(&self, at: [f64; 2]) -> [f64; 2] {
        [at[0].clamp(self.low[0], self.high[0]), at[1].clamp(self.low[1], self.high[1])]
    }

    /// The part of a segment that is in it.
    pub(super) fn clip(&self, from: [f64; 2], to: [f64; 2]) -> Option<[[f64; 2]; 2]> {
        // Parameters at which it enters and leaves (Liang and Barsky).
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for axis in 0..2 {
            let along = to[axis] - from[axis];
            if along == 0.0 {
                if from[axis] < self.low[axis] || from[axis] > self.high[axis] {
                    return None;
                }
                continue;
            }
            let [a, b] = [self.low[axis], self.high[axis]].map(|border| (border - from[axis]) / along);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        if enter > leave {
            return None;
        }
        let at = |t: f64| self.nearest([from[0] + (to[0] - from[0]) * t, from[1] + (to[1] - from[1]) * t]);
        Some([if enter == 0.0 { from } else { at(enter) }, if leave == 1.0 { to } else { at(leave) }])
    }
}

impl fmt::Display for Window {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([a, b], [c, d]) = (self.low, self.high);
        write!(f, "{a},{b},{c},{d}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_are_clipped() {
        let window = Window::new([0, 10], [0, 10]);
        for (from, to, clipped) in [
            ([1.0, 1.0], [9.0, 9.0], Some([[1.0, 1.0], [9.0, 9.0]])),
            ([-5.0, 5.0], [15.0, 5.0], Some([[0.0, 5.0], [10.0, 5.0]])),
            ([5.0, 5.0], [5.0, 25.0], Some([[5.0, 5.0], [5.0, 10.0]])),
            ([-5.0, 0.0], [0.0, -5.0], None),
            ([11.0, 0.0], [11.0, 10.0], None),
            ([3.0, 3.0], [3.0, 3.0], Some([[3.0, 3.0], [3.0, 3.0]])),
        ] {
            assert_eq!(window.clip(from, to), clipped, "{from:?} {to:?}");
        }
    }
}
