//! Rectangles in plotter units, and what of a segment lies in one.

/// A rectangle with its border; never inside out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Window {
    low: [f64; 2],
    high: [f64; 2],
}

impl Window {
    /// Between two corners, whichever they are.
    pub(crate) fn new(a: [f64; 2], b: [f64; 2]) -> Self {
        Self { low: [a[0].min(b[0]), a[1].min(b[1])], high: [a[0].max(b[0]), a[1].max(b[1])] }
    }

    pub(crate) fn low(&self) -> [f64; 2] {
        self.low
    }

    pub(crate) fn high(&self) -> [f64; 2] {
        self.high
    }

    /// What lies in both; where nothing does, the border of `self` nearest to the other.
    pub(crate) fn common(&self, other: &Self) -> Self {
        Self { low: self.nearest(other.low), high: self.nearest(other.high) }
    }

    /// The place in it that is nearest to `at`.
    pub(crate) fn nearest(&self, at: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis: usize| at[axis].max(self.low[axis]).min(self.high[axis]))
    }

    pub(crate) fn contains(&self, at: [f64; 2]) -> bool {
        self.nearest(at) == at
    }

    /// The ends of the part of the segment that lies in it (Liang and Barsky); `None` when there is no such part. An end of the segment that lies in it comes out as it is.
    pub(crate) fn clip(&self, from: [f64; 2], to: [f64; 2]) -> Option<[[f64; 2]; 2]> {
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for axis in 0..2 {
            let along = to[axis] - from[axis];
            if along == 0.0 {
                if from[axis] < self.low[axis] || from[axis] > self.high[axis] {
                    return None;
                }
                continue;
            }
            let low = (self.low[axis] - from[axis]) / along;
            let high = (self.high[axis] - from[axis]) / along;
            enter = enter.max(low.min(high));
            leave = leave.min(low.max(high));
        }
        if enter > leave {
            return None;
        }
        let at = |t: f64| self.nearest([from[0] + (to[0] - from[0]) * t, from[1] + (to[1] - from[1]) * t]);
        Some([if enter == 0.0 { from } else { at(enter) }, if leave == 1.0 { to } else { at(leave) }])
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn segments_are_clipped() {
        let w = Window::new([100.0, 50.0], [0.0, 0.0]);
        for (from, to, part) in [
            ([10.0, 10.0], [20.0, 30.0], Some([[10.0, 10.0], [20.0, 30.0]])),
            ([-10.0, 10.0], [20.0, 10.0], Some([[0.0, 10.0], [20.0, 10.0]])),
            ([-100.0, 25.0], [200.0, 25.0], Some([[0.0, 25.0], [100.0, 25.0]])),
            ([-10.0, 10.0], [-10.0, 20.0], None),
            ([-10.0, 40.0], [10.0, 60.0], Some([[0.0, 50.0], [0.0, 50.0]])),
            ([-10.0, 45.0], [5.0, 60.0], None),
            ([5.0, 5.0], [5.0, 5.0], Some([[5.0, 5.0], [5.0, 5.0]])),
        ] {
            assert_eq!(w.clip(from, to), part, "{from:?} {to:?}");
        }
        assert_eq!(w.common(&Window::new([200.0, 10.0], [300.0, 20.0])), Window::new([100.0, 10.0], [100.0, 20.0]));
    }

    proptest! {
        #[test]
        fn what_is_clipped_lies_in_both(v in prop::array::uniform8(-200.0..200.0f64)) {
            let w = Window::new([v[0], v[1]], [v[2], v[3]]);
            let (from, to) = ([v[4], v[5]], [v[6], v[7]]);
            let middle = [(from[0] + to[0]) / 2.0, (from[1] + to[1]) / 2.0];
            match w.clip(from, to) {
                None => prop_assert!(!w.contains(from) && !w.contains(to) && !w.contains(middle)),
                Some([a, b]) => {
                    for p in [a, b] {
                        prop_assert!(w.contains(p));
                        let cross = (p[0] - from[0]) * (to[1] - from[1]) - (p[1] - from[1]) * (to[0] - from[0]);
                        prop_assert!(cross.abs() < 1e-8);
                    }
                    if w.contains(from) { prop_assert_eq!(a, from) }
                    if w.contains(to) { prop_assert_eq!(b, to) }
                }
            }
        }
    }
}
