//! The three axes and sets of them.

/// Number of axes: X, Y and Z, in this order in every array of this crate.
pub const AXES: usize = 3;

/// A set of axes, one bit each: bit 0 is X, bit 1 is Y, bit 2 is Z (the bit order of `$2` and `$3`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Axes(u8);

impl Axes {
    /// No axis.
    pub const NONE: Self = Self(0);

    /// The set whose bits are the low three bits of `bits`; others are dropped.
    #[must_use]
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits & 0b111)
    }

    /// The set as bits 0 (X) to 2 (Z).
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Whether `axis` (0 = X, 1 = Y, 2 = Z) is in the set.
    #[must_use]
    pub const fn contains(self, axis: usize) -> bool {
        axis < AXES && self.0 & (1 << axis) != 0
    }

    /// Whether the set is empty.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// The axes in both sets.
    #[must_use]
    pub const fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// The axes of this set that are not in `other`.
    #[must_use]
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// Adds `axis` (0 = X, 1 = Y, 2 = Z); larger indices are ignored.
    pub const fn insert(&mut self, axis: usize) {
        if axis < AXES {
            self.0 |= 1 << axis;
        }
    }
}
