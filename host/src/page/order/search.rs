//! Local search over rounds of strokes.
//!
//! From each end, exchanges of up to five ways are looked for as Lin and Kernighan do (*An effective heuristic algorithm for the
//! traveling-salesman problem*, 1973): each new way goes to one of the nearest ends, and what the exchange has gained stays positive all
//! along. When none is left, a double bridge over a few strokes at a random place (Martin, Otto and Felten, *Large-step Markov chains for
//! the traveling salesman problem*, 1991) is followed by the same search around it, and taken back if the round has become longer.

use std::collections::VecDeque;

use super::ends::{Ends, NEAR};
use super::tour::{End, Exchange, MOST, Tour};

/// How many neighbours are gone on from at each further way of an exchange, of those that gain most.
const BREADTH: [usize; MOST - 1] = [8, 3, 2, 1];

/// Most strokes in each of the stretches that a double bridge exchanges.
const STRETCH: u32 = 10;

/// Rounds end when this many double bridges for each stroke have brought nothing.
const FRUITLESS: u64 = 3;

/// Positions of a round that are written in the time in which a neighbour is looked at.
const WRITTEN_PER_LOOK: u64 = 16;

/// A local search and what it has found so far.
pub(super) struct Search<'a> {
    ends: &'a Ends,
    near: Vec<End>,
    tour: Tour,
    cost: i64,
    /// Ends around which there may be something to gain.
    queue: VecDeque<End>,
    queued: Vec<bool>,
    /// Neighbours looked at.
    looks: u64,
}

impl<'a> Search<'a> {
    /// Of a round, given by the ends at which its strokes begin.
    pub(super) fn new(ends: &'a Ends, order: Vec<End>) -> Self {
        let near = ends.neighbours();
        let tour = Tour::new(order);
        let cost = ends.all().map(|e| ends.cost(e, tour.mate(e))).sum::<i64>() / 2;
        let queued = vec![false; near.len() / NEAR];
        Self { ends, near, tour, cost, queue: VecDeque::new(), queued, looks: 0 }
    }

    /// The round.
    pub(super) fn order(&self) -> &[End] {
        self.tour.order()
    }

    /// What has been done, in looks at neighbours.
    pub(super) fn work(&self) -> u64 {
        self.looks + self.tour.written / WRITTEN_PER_LOOK
    }

    /// Searches until so much has been done, nothing more is to be expected, or `stops` says so.
    pub(super) fn run(&mut self, most: u64, rng: &mut fastrand::Rng, stops: &dyn Fn() -> bool) {
        for e in self.tour.order().to_vec() {
            self.enqueue(e);
            self.enqueue(e ^ 1);
        }
        while self.work() < most && !stops() {
            let Some(end) = self.next() else { break };
            while self.work() < most && self.improve(end) {
                self.tour.commit();
            }
        }
        self.clear();
        let count = self.tour.order().len() as u64;
        let mut fruitless = 0;
        // Three stretches and the rest.
        while count >= 4 && fruitless < FRUITLESS * count && self.work() < most && !stops() {
            let before = self.cost;
            self.perturb(rng);
            fruitless = if self.cost < before { 0 } else { fruitless + 1 };
        }
    }

    fn enqueue(&mut self, end: End) {
        if !self.queued[end as usize] {
            self.queued[end as usize] = true;
            self.queue.push_back(end);
        }
    }

    fn next(&mut self) -> Option<End> {
        let end = self.queue.pop_front()?;
        self.queued[end as usize] = false;
        Some(end)
    }

    fn clear(&mut self) {
        while self.next().is_some() {}
    }

    /// Does an exchange that gains, if there is one that begins with the way at this end.
    fn improve(&mut self, from: End) -> bool {
        let to = self.tour.mate(from);
        let gain = self.ends.cost(from, to);
        let mut x = Exchange::default();
        self.tour.push(&mut x, from, to);
        let Some(won) = self.extend(&mut x, from, to, gain, 0) else { return false };
        self.tour.apply(&x);
        self.cost -= won;
        for &end in x.ends() {
            self.enqueue(end);
        }
        true
    }

    /// Extends an exchange that leads from the end `from` to the end `last` and has gained so much but for the way back, until it gains in all; how
    /// much.
    fn extend(&mut self, x: &mut Exchange, from: End, last: End, gain: i64, depth: usize) -> Option<i64> {
        let breadth = *BREADTH.get(depth)?;
        // What gains most first.
        let mut best = [(0_i64, 0, 0); NEAR];
        let mut count = 0;
        for k in 0..NEAR {
            let near = self.near[last as usize * NEAR + k];
            self.looks += 1;
            let gain = gain - self.ends.cost(last, near);
            // The list ends with the end itself where there are no more.
            if gain <= 0 || near == last {
                break;
            }
            let mate = self.tour.mate(near);
            if mate == last || near == from {
                continue;
            }
            let gain = gain + self.ends.cost(near, mate);
            let place = best[..count].partition_point(|b| b.0 >= gain);
            if place < breadth {
                count = (count + 1).min(breadth);
                best.copy_within(place..count - 1, place + 1);
                best[place] = (gain, near, mate);
            }
        }
        for &(gain, near, mate) in &best[..count] {
            if !self.tour.push(x, near, mate) {
                continue;
            }
            let closed = gain - self.ends.cost(mate, from);
            if closed > 0 && Tour::is_round(x) {
                return Some(closed);
            }
            if let Some(won) = self.extend(x, from, mate, gain, depth + 1) {
                return Some(won);
            }
            x.pop();
        }
        None
    }

    /// A double bridge at a random place and what it leads to, if the round becomes no longer.
    fn perturb(&mut self, rng: &mut fastrand::Rng) {
        let count = self.tour.order().len() as u32;
        let longest = STRETCH.min((count - 1) / 3);
        let at = rng.u32(0..count);
        let lengths = [(); 3].map(|()| rng.u32(1..=longest));
        let before = self.cost;
        let e = self.tour.bridge(at, lengths);
        let cost = |a: usize, b: usize| self.ends.cost(e[a], e[b]);
        let old = cost(0, 1) + cost(2, 3) + cost(4, 5) + cost(6, 7);
        self.cost += cost(0, 5) + cost(6, 3) + cost(4, 1) + cost(2, 7) - old;
        for end in e {
            self.enqueue(end);
        }
        while let Some(end) = self.next() {
            while self.improve(end) {}
        }
        if self.cost > before {
            self.tour.undo();
            self.cost = before;
        } else {
            self.tour.commit();
        }
    }
}
