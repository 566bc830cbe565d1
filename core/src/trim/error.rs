//! What can be wrong with trims.

/// Why trim curves do not bound a part of a surface. Indices count from 0.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrimError {
    /// There is no loop, so that nothing of the surface would be left.
    #[error("there is no trim loop; leave the trims out to keep the whole surface")]
    NoLoops,
    /// A loop has no curves, or they are all one point.
    #[error("trim loop {index} has no extent; remove it")]
    NoExtent {
        /// Index of the loop.
        index: usize,
    },
    /// A curve does not begin where the one before it ends.
    #[error(
        "trim loop {index}: curve {curve} ends at ({}, {}), but the next one begins at ({}, {}); make the curves meet end to end, and the last one the first", end[0], end[1], start[0], start[1]
    )]
    Gap {
        /// Index of the loop.
        index: usize,
        /// Index of the curve in the loop that ends at the gap.
        curve: usize,
        /// Its last point (u, v).
        end: [f64; 2],
        /// The first point of the next curve.
        start: [f64; 2],
    },
    /// A curve leaves the surface.
    #[error(
        "trim loop {index}: curve {curve} reaches ({}, {}), outside the surface's parameter range; clip it to the range", at[0], at[1]
    )]
    Outside {
        /// Index of the loop.
        index: usize,
        /// Index of the curve in the loop.
        curve: usize,
        /// A point of it that is farthest outside.
        at: [f64; 2],
    },
    /// A loop leaves over a seam, and no loop comes back with the kept part on the same side.
    #[error(
        "trim loop {index} leaves over the seam at ({}, {}), and no loop comes back there with the kept part on its left; turn the loops so that all have it on their left", at[0], at[1]
    )]
    Open {
        /// Index of the loop.
        index: usize,
        /// Where it leaves (u, v).
        at: [f64; 2],
    },
}

impl TrimError {
    /// Index of the loop, and of the curve in it, that the error is about.
    #[must_use]
    pub fn place(&self) -> (Option<usize>, Option<usize>) {
        match *self {
            Self::NoLoops => (None, None),
            Self::NoExtent { index } | Self::Open { index, .. } => (Some(index), None),
            Self::Gap { index, curve, .. } | Self::Outside { index, curve, .. } => (Some(index), Some(curve)),
        }
    }
}
