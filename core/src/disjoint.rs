//! Things that turn out to be the same, by their numbers (union–find; Tarjan and van Leeuwen 1984, with path halving).

use alloc::vec::Vec;

/// Sets of numbers, each of which begins as a set of its own.
#[derive(Clone, Debug, Default)]
pub(crate) struct Disjoint {
    /// Another member of the set of each, or itself.
    same: Vec<usize>,
}

impl Disjoint {
    /// The numbers below `count`, each for itself.
    pub(crate) fn new(count: usize) -> Self {
        Self { same: (0..count).collect() }
    }

    /// Adds the next number.
    pub(crate) fn push(&mut self) -> usize {
        self.same.push(self.same.len());
        self.same.len() - 1
    }

    /// The lowest of those that a number is joined with.
    pub(crate) fn root(&mut self, mut k: usize) -> usize {
        while self.same[k] != k {
            self.same[k] = self.same[self.same[k]];
            k = self.same[k];
        }
        k
    }

    /// Makes the sets of two numbers one.
    pub(crate) fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.same[a.max(b)] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_joined_has_the_lowest_root() {
        let mut sets = Disjoint::new(5);
        sets.join(4, 2);
        sets.join(3, 4);
        assert_eq!([0, 1, 2, 3, 4].map(|k| sets.root(k)), [0, 1, 2, 2, 2]);
        assert_eq!(sets.push(), 5);
        sets.join(5, 0);
        sets.join(3, 5);
        assert_eq!([0, 1, 2, 3, 4, 5].map(|k| sets.root(k)), [0, 1, 0, 0, 0, 0]);
    }
}
