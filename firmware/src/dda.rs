//! Which axes step at each event of a block: Bresenham's algorithm for any number of axes.
//!
//! ```text
//!  busiest axis  │ │ │ │ │ │ │ │ │      one step at each of the n events
//!  another       │   │   │   │   │      s steps: an account gains s at each event and pays n for a step
//!                ▲ the account starts half full, so that a step comes at the event that is nearest to its true place
//! ```
//!
//! What has been stepped is not counted: after k events an axis has made ⌊(h + k·s) / n⌋ steps, and its account tells the same. So an event
//! costs an addition and a comparison for each axis, and only who asks for the position pays for a division.

use crate::axis::{AXES, Axes};

/// One axis: its account and what the account gains at each event.
#[derive(Clone, Copy, Debug, Default)]
struct Account {
    /// −n ≤ `balance` < 0; the sign tells that a step is due, without a comparison.
    balance: i32,
    /// Steps in the whole block, ≤ n.
    steps: i32,
}

/// The steps of one block.
#[derive(Debug, Default)]
pub(crate) struct Dda {
    accounts: [Account; AXES],
    /// Step events in the whole block, n.
    events: i32,
    negative: Axes,
}

impl Dda {
    /// Before the first event of a block of `events` events, `steps` ≤ `events` < 2³¹, on each axis.
    pub(crate) fn new(steps: [u32; AXES], events: u32, negative: Axes) -> Self {
        let events = events as i32;
        Self {
            accounts: steps.map(|steps| Account { balance: events / 2 - events, steps: steps as i32 }),
            events,
            negative,
        }
    }

    /// The axes that step at the next event.
    ///
    /// Cost: 7 instructions an axis on a Cortex-M4.
    #[inline(always)]
    pub(crate) fn event(&mut self) -> Axes {
        let mut axes = 0;
        for (axis, account) in self.accounts.iter_mut().enumerate() {
            // Both below 2³¹ and of different signs: no overflow.
            let mut balance = account.balance.wrapping_add(account.steps);
            if balance >= 0 {
                balance = balance.wrapping_sub(self.events);
                axes |= 1 << axis;
            }
            account.balance = balance;
        }
        Axes::from_bits(axes)
    }

    /// Signed steps that each axis has made in the first `events` events, which are those that [`Dda::event`] was called for.
    pub(crate) fn made(&self, events: u32) -> [i32; AXES] {
        let n = i64::from(self.events);
        let mut made = [0; AXES];
        if n > 0 {
            for (axis, (made, account)) in made.iter_mut().zip(&self.accounts).enumerate() {
                let gained = n / 2 - n + i64::from(events) * i64::from(account.steps);
                // At most n, which is an i32.
                let steps = ((gained - i64::from(account.balance)) / n) as i32;
                *made = if self.negative.contains(axis) { -steps } else { steps };
            }
        }
        made
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn every_axis_makes_its_steps_in_time(
            steps in prop::array::uniform3(0..400u32), extra in 0..3u32, bits in 0..8u8,
        ) {
            let events = steps.into_iter().max().unwrap_or(0) + extra + 1;
            let negative = Axes::from_bits(bits);
            let mut dda = Dda::new(steps, events, negative);
            let mut counted = [0i32; AXES];
            for k in 1..=events {
                let axes = dda.event();
                for axis in 0..AXES {
                    counted[axis] += i32::from(axes.contains(axis)) * if negative.contains(axis) { -1 } else { 1 };
                    // Never more than half a step from the line.
                    let line = f64::from(k) * f64::from(steps[axis]) / f64::from(events);
                    prop_assert!((f64::from(counted[axis].abs()) - line).abs() <= 0.5 + 1e-9);
                }
                prop_assert_eq!(dda.made(k), counted);
            }
            prop_assert_eq!(counted.map(i32::unsigned_abs), steps);
        }
    }

    #[test]
    fn the_longest_block_overflows_nothing() {
        let events = (1u32 << 31) - 2;
        let mut dda = Dda::new([events, events - 1, 1], events, Axes::NONE);
        for _ in 0..3 {
            assert_eq!(dda.event(), Axes::from_bits(0b011));
        }
        assert_eq!(dda.made(3), [3, 3, 0]);
        assert_eq!(Dda::default().made(0), [0; AXES]);
    }
}
