//! A round of strokes in an array: who is next to whom, and exchanges of the ways between them.
//!
//! A stroke has two ends, and a round two ways for each stroke: the stroke itself, which stays, and the way from its end to the next
//! stroke, which an exchange may replace. The ways of an exchange cut the round into stretches; it is done by writing all stretches but
//! the longest anew.

/// Most ways that one exchange replaces.
pub(super) const MOST: usize = 5;

/// An end of a stroke: twice the stroke's number, plus 1 for its last vertex.
pub(super) type End = u32;

/// Ways to be replaced: way i is between ends `2i` and `2i + 1`; the new ones are from `2i + 1` to `2i + 2`, and from the last to the first.
#[derive(Clone, Copy, Default)]
pub(super) struct Exchange {
    ends: [End; 2 * MOST],
    /// Position before each way, and whether the second end is the one after it.
    gaps: [(u32, bool); MOST],
    count: usize,
}

impl Exchange {
    /// The ends of the ways that are replaced.
    pub(super) fn ends(&self) -> &[End] {
        &self.ends[..2 * self.count]
    }

    /// Drops the last way.
    pub(super) fn pop(&mut self) {
        self.count -= 1;
    }
}

/// What an exchange leaves.
struct Round {
    /// Positions before the ways, upwards.
    gaps: [u32; MOST],
    /// Stretches in their new order: the rank of the way before each, and whether it is run forward.
    stretches: [(u8, bool); MOST],
}

/// The round. What is done to it is noted until [`Tour::commit`] or [`Tour::undo`].
pub(super) struct Tour {
    /// The end at which the stroke at each position begins.
    order: Vec<End>,
    /// Position of each stroke.
    place: Vec<u32>,
    /// Stretches that were written over: their beginnings and lengths.
    stretches: Vec<(u32, u32)>,
    /// What was there.
    old: Vec<End>,
    /// Positions written so far.
    pub(super) written: u64,
}

impl Tour {
    /// From the end at which each stroke begins, in order.
    pub(super) fn new(order: Vec<End>) -> Self {
        let mut place = vec![0; order.len()];
        for (p, &end) in order.iter().enumerate() {
            place[(end >> 1) as usize] = p as u32;
        }
        Self { order, place, stretches: Vec::new(), old: Vec::new(), written: 0 }
    }

    /// The end at which each stroke begins, in order.
    pub(super) fn order(&self) -> &[End] {
        &self.order
    }

    fn before(&self, p: u32) -> u32 {
        if p == 0 { self.order.len() as u32 - 1 } else { p - 1 }
    }

    fn after(&self, p: u32) -> u32 {
        if p + 1 == self.order.len() as u32 { 0 } else { p + 1 }
    }

    /// The end at the other side of the way at `end`.
    pub(super) fn mate(&self, end: End) -> End {
        let p = self.place[(end >> 1) as usize];
        if self.order[p as usize] == end {
            self.order[self.before(p) as usize] ^ 1
        } else {
            self.order[self.after(p) as usize]
        }
    }

    /// Adds the way from `a` to its mate `b`; false if it is there already.
    pub(super) fn push(&self, x: &mut Exchange, a: End, b: End) -> bool {
        let p = self.place[(b >> 1) as usize];
        let gap = if self.order[p as usize] == b { (self.before(p), true) } else { (p, false) };
        if x.gaps[..x.count].iter().any(|g| g.0 == gap.0) {
            return false;
        }
        x.gaps[x.count] = gap;
        x.ends[2 * x.count] = a;
        x.ends[2 * x.count + 1] = b;
        x.count += 1;
        true
    }

    /// The stretches between the ways of an exchange in their new order; none if they would not make one round.
    fn round(x: &Exchange) -> Option<Round> {
        let k = x.count;
        let mut rank = [0u8; MOST];
        let mut gaps = [0; MOST];
        for (rank, &(gap, _)) in rank.iter_mut().zip(&x.gaps[..k]) {
            let r = x.gaps[..k].iter().filter(|other| other.0 < gap).count();
            (*rank, gaps[r]) = (r as u8, gap);
        }
        // The side of a way is 1 after it. Ends by twice the rank plus the side.
        let mut link = [0u8; 2 * MOST];
        for i in 0..k {
            let next = if i + 1 == k { 0 } else { i + 1 };
            let from = 2 * rank[i] + u8::from(x.gaps[i].1);
            let to = 2 * rank[next] + u8::from(!x.gaps[next].1);
            link[from as usize] = to;
            link[to as usize] = from;
        }
        let mut stretches = [(0, true); MOST];
        let mut at = 1u8;
        for (i, stretch) in stretches.iter_mut().enumerate().take(k) {
            let (r, side) = (at / 2, at % 2);
            let other = if side == 1 {
                *stretch = (r, true);
                2 * if r as usize + 1 == k { 0 } else { r + 1 }
            } else {
                let before = if r == 0 { k as u8 - 1 } else { r - 1 };
                *stretch = (before, false);
                2 * before + 1
            };
            at = link[other as usize];
            if at == 1 && i + 1 < k {
                return None;
            }
        }
        Some(Round { gaps, stretches })
    }

    /// Whether an exchange leaves one round.
    pub(super) fn is_round(x: &Exchange) -> bool {
        if x.count == 2 {
            return x.gaps[0].1 != x.gaps[1].1;
        }
        Self::round(x).is_some()
    }

    /// Does an exchange that leaves one round. Costs the strokes outside the longest stretch.
    pub(super) fn apply(&mut self, x: &Exchange) {
        let Some(Round { gaps, mut stretches }) = Self::round(x) else { return };
        let (k, n) = (x.count, self.order.len() as u32);
        let length = |r: u8| {
            let (from, to) = (gaps[r as usize], gaps[if r as usize + 1 == k { 0 } else { r as usize + 1 }]);
            if to > from { to - from } else { to + n - from }
        };
        let stretches = &mut stretches[..k];
        let longest = (0..k).max_by_key(|&i| length(stretches[i].0)).unwrap_or(0);
        stretches.rotate_left(longest);
        if !stretches[0].1 {
            stretches[1..].reverse();
            for s in stretches.iter_mut() {
                s.1 = !s.1;
            }
        }
        let keep = stretches[0].0;
        let kept = length(keep);
        let start = (gaps[keep as usize] + 1 + kept) % n;
        let rest = n - kept;
        let base = self.note(start, rest);
        let mut p = start;
        for &(r, forward) in &stretches[1..] {
            let from = self.after(gaps[r as usize]);
            let from = base + (if from >= start { from - start } else { from + n - start }) as usize;
            let run = from..from + length(r) as usize;
            if forward {
                for i in run {
                    p = self.put(p, self.old[i]);
                }
            } else {
                for i in run.rev() {
                    p = self.put(p, self.old[i] ^ 1);
                }
            }
        }
    }

    /// Keeps what was done.
    pub(super) fn commit(&mut self) {
        self.stretches.clear();
        self.old.clear();
    }

    /// Takes back what was done since the last commit.
    pub(super) fn undo(&mut self) {
        while let Some((start, rest)) = self.stretches.pop() {
            let base = self.old.len() - rest as usize;
            let mut p = start;
            for i in base..self.old.len() {
                p = self.put(p, self.old[i]);
            }
            self.written += u64::from(rest);
            self.old.truncate(base);
        }
    }

    /// Exchanges the first and the last of three stretches of these lengths after a position: a double bridge, which no exchange of two or three ways
    /// undoes. Together they must be shorter than the round. Gives the ends at the four old ways; the new ones are 0–5, 6–3, 4–1 and 2–7.
    pub(super) fn bridge(&mut self, at: u32, lengths: [u32; 3]) -> [End; 8] {
        let start = self.after(at);
        let rest = lengths[0] + lengths[1] + lengths[2];
        let base = self.note(start, rest);
        let (b, c) = (lengths[0], lengths[0] + lengths[1]);
        let mut p = start;
        for run in [c..rest, b..c, 0..b] {
            for i in run {
                p = self.put(p, self.old[base + i as usize]);
            }
        }
        let (before, after) = (self.order[at as usize] ^ 1, self.order[p as usize]);
        let entry = |i: u32| self.old[base + i as usize];
        let exit = |i: u32| self.old[base + i as usize - 1] ^ 1;
        [before, entry(0), exit(b), entry(b), exit(c), entry(c), exit(rest), after]
    }

    /// Notes what is on a stretch before it is written over; where it is noted.
    fn note(&mut self, start: u32, length: u32) -> usize {
        let base = self.old.len();
        self.written += u64::from(length);
        self.stretches.push((start, length));
        let first = (self.order.len() as u32 - start).min(length) as usize;
        self.old.extend_from_slice(&self.order[start as usize..start as usize + first]);
        self.old.extend_from_slice(&self.order[..length as usize - first]);
        base
    }

    /// Puts a stroke at a position; the next position.
    fn put(&mut self, p: u32, end: End) -> u32 {
        self.order[p as usize] = end;
        self.place[(end >> 1) as usize] = p;
        self.after(p)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// All pairs of mates.
    fn ways(tour: &Tour) -> Vec<(End, End)> {
        let ends = 0..2 * tour.order().len() as u32;
        ends.map(|e| (e, tour.mate(e))).filter(|(e, mate)| e < mate).collect()
    }

    /// Strokes met on the way round from the first.
    fn reached(tour: &Tour) -> usize {
        let (mut at, mut count) = (0, 0);
        loop {
            at = tour.mate(at) ^ 1;
            count += 1;
            if at == 0 || count > tour.order().len() {
                return count;
            }
        }
    }

    proptest! {
        #[test]
        fn exchanges_replace_their_ways_and_can_be_taken_back(
            n in 2_u32..40,
            turned in prop::collection::vec(any::<bool>(), 40),
            rounds in prop::collection::vec(prop::collection::vec(0_u32..80, MOST), 1..8),
        ) {
            let mut tour = Tour::new((0..n).map(|i| 2 * i + u32::from(turned[i as usize])).collect());
            let (order, first) = (tour.order().to_vec(), ways(&tour));
            for picks in rounds {
                let mut x = Exchange::default();
                for pick in picks {
                    let a = pick % (2 * n);
                    tour.push(&mut x, a, tour.mate(a));
                }
                let before = ways(&tour);
                let ends = x.ends().to_vec();
                if ends.len() < 4 || !Tour::is_round(&x) {
                    tour.apply(&x);
                    prop_assert!(ends.len() < 4 || before == ways(&tour));
                    continue;
                }
                tour.apply(&x);
                prop_assert_eq!(reached(&tour), n as usize);
                let gone = |w: &(End, End)| ends.chunks(2).any(|c| (c[0].min(c[1]), c[0].max(c[1])) == *w);
                let mut expected: Vec<_> = before.into_iter().filter(|w| !gone(w)).collect();
                for i in 0..ends.len() / 2 {
                    let (a, b) = (ends[2 * i + 1], ends[(2 * i + 2) % ends.len()]);
                    expected.push((a.min(b), a.max(b)));
                }
                expected.sort_unstable();
                prop_assert_eq!(expected, ways(&tour));
            }
            tour.undo();
            prop_assert_eq!(tour.order(), order);
            prop_assert_eq!(ways(&tour), first);
        }

        #[test]
        fn what_is_no_round_is_refused(n in 2_u32..12, picks in prop::collection::vec(0_u32..24, MOST)) {
            let tour = Tour::new((0..n).map(|i| 2 * i).collect());
            let mut x = Exchange::default();
            for pick in picks {
                let a = pick % (2 * n);
                tour.push(&mut x, a, tour.mate(a));
            }
            prop_assume!(x.ends().len() >= 4);
            // The same by following links through all ends.
            let mut link: Vec<End> = (0..2 * n).map(|e| tour.mate(e)).collect();
            let ends = x.ends();
            for i in 0..ends.len() / 2 {
                let (a, b) = (ends[2 * i + 1], ends[(2 * i + 2) % ends.len()]);
                (link[a as usize], link[b as usize]) = (b, a);
            }
            let (mut at, mut count) = (0, 0);
            loop {
                at = link[at as usize] ^ 1;
                count += 1;
                if at == 0 {
                    break;
                }
            }
            prop_assert_eq!(Tour::is_round(&x), count == n);
        }

        #[test]
        fn a_double_bridge_exchanges_two_stretches(
            n in 4_u32..40, at in 0_u32..40, lengths in [1_u32..14, 1_u32..14, 1_u32..14]
        ) {
            prop_assume!(lengths.iter().sum::<u32>() < n);
            let mut tour = Tour::new((0..n).map(|i| 2 * i).collect());
            let before = ways(&tour);
            let e = tour.bridge(at % n, lengths);
            prop_assert_eq!(reached(&tour), n as usize);
            let mut expected = before.clone();
            for [a, b] in [[0, 1], [2, 3], [4, 5], [6, 7]] {
                expected.retain(|w| *w != (e[a].min(e[b]), e[a].max(e[b])));
            }
            for [a, b] in [[0, 5], [6, 3], [4, 1], [2, 7]] {
                expected.push((e[a].min(e[b]), e[a].max(e[b])));
            }
            expected.sort_unstable();
            prop_assert_eq!(expected, ways(&tour));
            tour.undo();
            prop_assert_eq!(ways(&tour), before);
        }
    }
}
