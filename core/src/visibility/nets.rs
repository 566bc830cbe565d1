//! The nets of the cells that one sight line has yet to look at.

use alloc::vec::Vec;

use glam::DVec4;

use super::leaf::{Axis, Degrees, halve};

/// A stack of nets of one degree. Each has room of its own, which is kept for the next sight line: so the stack takes what the
/// deepest one needed, and growing it moves nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct Nets {
    all: Vec<Vec<DVec4>>,
    /// How many are on the stack.
    count: usize,
}

impl Nets {
    /// Makes `net` the only one.
    pub(super) fn start(&mut self, net: &[DVec4]) {
        if self.all.is_empty() {
            self.all.push(Vec::new());
        }
        self.all[0].clear();
        self.all[0].extend_from_slice(net);
        self.count = 1;
    }

    /// The net on top; none of an empty stack.
    pub(super) fn top(&self) -> &[DVec4] {
        self.count.checked_sub(1).and_then(|k| self.all.get(k)).map_or(&[], |net| net)
    }

    /// Takes the net on top away.
    pub(super) fn pop(&mut self) {
        self.count = self.count.saturating_sub(1);
    }

    /// Puts the two halves of the net on top in its place, the upper one on top.
    pub(super) fn halve_top(&mut self, degrees: Degrees, axis: Axis) {
        if self.all.len() == self.count {
            self.all.push(Vec::new());
        }
        let (below, above) = self.all.split_at_mut(self.count);
        if let (Some(net), Some(upper)) = (below.last_mut(), above.first_mut()) {
            if upper.len() != net.len() {
                upper.clear();
                upper.reserve_exact(net.len());
                upper.resize(net.len(), DVec4::ZERO);
            }
            halve(net, upper, degrees, axis);
            self.count += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_looked_at_from_the_upper_one_on_and_room_is_used_again() {
        let mut nets = Nets::default();
        assert!(nets.top().is_empty());
        let point = |x: f64, y: f64| DVec4::new(x, y, 0.0, 1.0);
        for net in [&[point(0.0, 0.0), point(0.0, 1.0), point(1.0, 0.0), point(1.0, 1.0)][..], &[DVec4::W; 6]] {
            nets.start(net);
            let degrees = Degrees { p: 1, q: net.len() / 2 - 1 };
            nets.halve_top(degrees, Axis::U);
            nets.halve_top(degrees, Axis::U);
            if net.len() == 4 {
                assert_eq!(nets.top(), [point(0.75, 0.0), point(0.75, 1.0), point(1.0, 0.0), point(1.0, 1.0)]);
                nets.pop();
                assert_eq!(nets.top(), [point(0.5, 0.0), point(0.5, 1.0), point(0.75, 0.0), point(0.75, 1.0)]);
                nets.pop();
                assert_eq!(nets.top(), [point(0.0, 0.0), point(0.0, 1.0), point(0.5, 0.0), point(0.5, 1.0)]);
            } else {
                assert_eq!(nets.top(), net);
                nets.pop();
                nets.pop();
            }
            nets.pop();
            assert!(nets.top().is_empty());
        }
        assert_eq!(nets.all.len(), 3);
    }
}
