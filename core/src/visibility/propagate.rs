//! Visibility carried from piece to piece, breadth first.
//!
//! A point on the convex hull of the picture has nothing in front of it, so that propagation starts there without a ray
//! (Appel; Heger). What no link reaches gets a ray, and is a start of its own.

use alloc::collections::VecDeque;
use alloc::vec;
use alloc::vec::Vec;

use super::RayScratch;
use super::classify::{ClassifyOptions, Subject, VisibilityStats, Watch};
use super::links::{Link, links};

/// What is known of a piece: sheets in front.
type Known = Option<u32>;

/// Sheets in front of every piece that links tell, by its index; pieces that links contradict each other about, and
/// pieces without a clear ray, are left open.
pub(super) fn propagate(subject: &Subject<'_>, options: &ClassifyOptions, stats: &mut VisibilityStats) -> Vec<Known> {
    let pieces = &subject.arrangement.pieces;
    let margin = options.margin();
    let links = links(subject, margin);
    let graph = Graph::new(pieces.len(), &links);
    let mut known: Vec<Known> = vec![None; pieces.len()];
    let mut queue = VecDeque::new();
    for k in subject.outermost(margin) {
        if known[k].is_none() {
            known[k] = Some(0);
            graph.spread(k, &mut known, &mut queue);
        }
    }
    let mut scratch = RayScratch::default();
    let mut fired = vec![false; pieces.len()];
    for k in 0..pieces.len() {
        if subject.stop.is_wanted() {
            break;
        }
        if known[k].is_some() || !subject.wanted(&pieces[k]) {
            continue;
        }
        fired[k] = true;
        let mut watch = Watch::of(subject, options, k, &mut scratch);
        known[k] = watch.once();
        let asked = core::mem::take(&mut watch.stats);
        stats.rays_active += asked.rays_active;
        stats.rays_passive += asked.rays_passive;
        if known[k].is_some() {
            graph.spread(k, &mut known, &mut queue);
        }
    }
    // One contradiction makes everything doubtful that is linked to it.
    for link in &links {
        if contradicts(link, &known) {
            stats.disagreements += 1;
        }
    }
    let doubtful: Vec<usize> = links.iter().filter(|l| contradicts(l, &known)).map(|l| l.from).collect();
    for k in doubtful {
        graph.forget(k, &mut known, &mut queue);
    }
    let told = |k: &usize| known[*k].is_some() && !fired[*k] && subject.wanted(&pieces[*k]);
    stats.propagated += (0..pieces.len()).filter(told).count() as u64;
    known
}

/// Whether both ends of a link are known, and not as the link says.
fn contradicts(link: &Link, known: &[Known]) -> bool {
    match (known[link.from], known[link.to]) {
        (Some(a), Some(b)) => i64::from(a) + i64::from(link.difference) != i64::from(b),
        _ => false,
    }
}

/// The links by piece.
struct Graph {
    /// For each piece the first of its neighbours; one more at the end.
    starts: Vec<usize>,
    /// The other piece, and its difference to this one.
    neighbours: Vec<(usize, i32)>,
}

impl Graph {
    fn new(pieces: usize, links: &[Link]) -> Self {
        let mut starts = vec![0; pieces + 1];
        for link in links {
            starts[link.from + 1] += 1;
            starts[link.to + 1] += 1;
        }
        for k in 0..pieces {
            starts[k + 1] += starts[k];
        }
        let mut next = starts.clone();
        let mut neighbours = vec![(0, 0); 2 * links.len()];
        for link in links {
            for (from, to, difference) in
                [(link.from, link.to, link.difference), (link.to, link.from, -link.difference)]
            {
                neighbours[next[from]] = (to, difference);
                next[from] += 1;
            }
        }
        Self { starts, neighbours }
    }

    fn of(&self, piece: usize) -> &[(usize, i32)] {
        &self.neighbours[self.starts[piece]..self.starts[piece + 1]]
    }

    /// Carries what is known of a piece to everything that is linked to it and not known yet.
    fn spread(&self, from: usize, known: &mut [Known], queue: &mut VecDeque<usize>) {
        queue.push_back(from);
        while let Some(k) = queue.pop_front() {
            let Some(qi) = known[k] else { continue };
            for &(other, difference) in self.of(k) {
                // Fewer than none is a contradiction, and stays open: the link is looked at again in the end.
                let told = qi.saturating_add_signed(difference);
                if known[other].is_none() {
                    known[other] = Some(told);
                    queue.push_back(other);
                }
            }
        }
    }

    /// Forgets a piece and everything that is linked to it.
    fn forget(&self, from: usize, known: &mut [Known], queue: &mut VecDeque<usize>) {
        queue.push_back(from);
        while let Some(k) = queue.pop_front() {
            if known[k].take().is_some() {
                queue.extend(self.of(k).iter().map(|n| n.0));
            }
        }
    }
}
