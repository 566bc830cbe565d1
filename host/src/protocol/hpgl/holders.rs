//! Which pens are in a plotter's holders as a job goes on.
//!
//! A job may take more pens than the plotter holds. Pen 9 of a plotter with eight holders is put into holder 1 by hand, pen 10 into
//! holder 2, and pen 1 into holder 1 again when its turn comes: before each of these the plotter puts away what it has and
//! waits for its user.

use super::Job;
use crate::trace::hpgl::{mnemonic, numbers};

/// A pen that is to be put into a holder by hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Swap {
    /// The pen, as the job numbers it.
    pub pen: u32,
    /// The holder, from 1.
    pub holder: u32,
}

/// The pen in each holder.
#[derive(Clone, Debug)]
pub struct Holders {
    /// How many there are.
    count: u32,
    /// Those that have another pen than their own.
    swaps: Vec<Swap>,
}

impl Holders {
    /// So many holders with pens of their own numbers; at least one.
    #[must_use]
    pub fn new(count: u32) -> Self {
        Self { count: count.max(1), swaps: Vec::new() }
    }

    /// The holder that a pen (from 1) belongs to.
    #[must_use]
    pub fn of(&self, pen: u32) -> u32 {
        pen.saturating_sub(1) % self.count + 1
    }

    /// What has to be done by hand before a pen (from 1) can be taken, if anything. Cost: linear in the holders with other pens.
    #[must_use]
    pub fn swap(&self, pen: u32) -> Option<Swap> {
        let holder = self.of(pen);
        let held = self.swaps.iter().find(|swap| swap.holder == holder).map_or(holder, |swap| swap.pen);
        (held != pen).then_some(Swap { pen, holder })
    }

    /// That has been done.
    pub fn put(&mut self, swap: Swap) {
        self.swaps.retain(|other| other.holder != swap.holder);
        if swap.pen != swap.holder {
            self.swaps.push(swap);
        }
    }

    /// The holders that have another pen than their own, in the order in which they were given them.
    #[must_use]
    pub fn swaps(&self) -> &[Swap] {
        &self.swaps
    }

    /// What so many instructions at the beginning of a job want put by hand, one after the other: the index of the instruction, and the
    /// swap. The holders are afterwards as these leave them.
    pub fn follow<'a>(&'a mut self, job: &'a Job, count: usize) -> impl Iterator<Item = (usize, Swap)> + 'a {
        job.instructions().iter().take(count).enumerate().filter_map(|(index, instruction)| {
            let swap = self.swap(selected(instruction)?)?;
            self.put(swap);
            Some((index, swap))
        })
    }
}

/// The pen, from 1, that an instruction takes; none if it takes none.
#[must_use]
pub(super) fn selected(instruction: &[u8]) -> Option<u32> {
    if mnemonic(instruction)? != *b"SP" {
        return None;
    }
    let [pen] = numbers(&instruction[2..])?[..] else { return None };
    // Plotters cut fractions off.
    let pen = pen as u32;
    (pen > 0).then_some(pen)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swaps(job: &str, count: u32) -> Vec<(usize, u32, u32)> {
        let job = Job::new(job.as_bytes()).unwrap();
        let mut holders = Holders::new(count);
        holders.follow(&job, usize::MAX).map(|(index, swap)| (index, swap.pen, swap.holder)).collect()
    }

    #[test]
    fn pens_beyond_the_holders_are_put_in_by_hand_and_so_are_those_that_they_displace() {
        const JOB: &str = "IN;SP1;PD;SP3;PD;SP2;PD;SP3;PD;SP1;PD;SP0;";
        assert_eq!(swaps(JOB, 3), []);
        assert_eq!(swaps(JOB, 2), [(3, 3, 1), (9, 1, 1)]);
        assert_eq!(swaps(JOB, 1), [(3, 3, 1), (5, 2, 1), (7, 3, 1), (9, 1, 1)]);
        assert_eq!(swaps(JOB, 0), swaps(JOB, 1));
    }

    #[test]
    fn what_is_left_in_the_holders_is_known() {
        let job = Job::new(b"IN;SP3;SP2;SP6;").unwrap();
        let mut holders = Holders::new(2);
        assert_eq!(holders.follow(&job, 3).count(), 1);
        assert_eq!(holders.swaps(), [Swap { pen: 3, holder: 1 }]);
        assert_eq!(holders.swap(1), Some(Swap { pen: 1, holder: 1 }));
        assert_eq!((holders.swap(2), holders.swap(3)), (None, None));
    }

    #[test]
    fn pens_are_read() {
        let table: &[(&[u8], Option<u32>)] = &[
            (b"SP3;", Some(3)),
            (b"sp 12 ;", Some(12)),
            (b"SP2.7;", Some(2)),
            (b"SP;", None),
            (b"SP0;", None),
            (b"SP-3;", None),
            (b"SP1,2;", None),
            (b"SPx;", None),
            (b"VS3;", None),
            (b"S", None),
        ];
        for (instruction, expected) in table {
            assert_eq!(selected(instruction), *expected, "{}", String::from_utf8_lossy(instruction));
        }
    }
}
