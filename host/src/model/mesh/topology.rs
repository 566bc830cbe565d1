//! What the facets of a mesh have to do with one another.

use std::collections::{HashMap, HashSet};

use super::on_edges::PointsOnEdges;
use super::{Mesh, counted, width};
use crate::model::import::Report;

/// How facets meet.
#[derive(Debug, Default)]
pub(super) struct Topology {
    /// Corners that part the edge of a facet, in order from its lower corner, by the facet and the edge's corners, the lower
    /// first.
    parted: HashMap<(u32, [u32; 2]), Vec<u32>>,
    /// Identities of the edges that facets name, by their corners, the lower first.
    named: HashMap<[u32; 2], u32>,
    /// For every facet the angle in radians below which the precision of the file cannot tell it and a neighbour from
    /// coplanar ones.
    pub(super) blur: Vec<f64>,
}

/// A side of a facet, or a part of one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
struct Half {
    /// The corners, the lower first.
    ends: [u32; 2],
    facet: u32,
    /// Whether the facet has the lower one first.
    forward: bool,
}

fn half(from: u32, to: u32, facet: u32) -> Half {
    Half { ends: [from.min(to), from.max(to)], facet, forward: from < to }
}

impl Topology {
    /// Finds how the facets meet, and turns those that disagree with most of their neighbours.
    pub(super) fn of(mesh: &mut Mesh, tolerance: f64, report: &mut Report) -> Self {
        let mut topology = Self::default();
        let mut halves: Vec<Half> = Vec::with_capacity(mesh.corners.len());
        for (facet, polygon) in mesh.polygons.iter().enumerate() {
            let own = mesh.corners_of(polygon);
            halves.extend((0..own.len()).map(|k| half(own[k], own[(k + 1) % own.len()], facet as u32)));
        }
        halves.sort_unstable();
        topology.part(mesh, &mut halves, tolerance, report);
        // The corners of a part of a plane are off it by rounding.
        for h in halves.iter().filter(|h| mesh.polygons[h.facet as usize].is_flat) {
            let next = topology.named.len() as u32;
            topology.named.entry(h.ends).or_insert(next);
        }
        orient(mesh, &halves, report);
        topology.find_blur(mesh, &halves, tolerance);
        let several = || halves.chunk_by(|a, b| a.ends == b.ends).filter(|group| group.len() > 2);
        if let Some(first) = several().next() {
            let [a, b] = first[0].ends.map(|c| mesh.points[c as usize]);
            report.problems.push(format!(
                "{} in more than two facets, the first from {a} to {b}; each is drawn as a crease",
                are_edges(several().count())
            ));
        }
        topology
    }

    /// The corners that part a facet's edge, from one of its ends to the other.
    pub(super) fn between(&self, facet: u32, from: u32, to: u32) -> impl Iterator<Item = u32> + '_ {
        let parts = self.parted.get(&(facet, [from.min(to), from.max(to)])).map_or(&[][..], Vec::as_slice);
        let count = parts.len();
        (0..count).map(move |k| parts[if from < to { k } else { count - 1 - k }])
    }

    /// The identity of the edge between two neighbouring corners, if facets name it.
    pub(super) fn edge(&self, from: u32, to: u32) -> Option<u32> {
        self.named.get(&[from.min(to), from.max(to)]).copied()
    }

    /// Parts edges of one facet only where corners of other such edges lie on them, so that they meet what is beside
    /// them.
    fn part(&mut self, mesh: &Mesh, halves: &mut Vec<Half>, tolerance: f64, report: &mut Report) {
        let alone = |halves: &[Half]| -> Vec<Half> {
            halves.chunk_by(|a, b| a.ends == b.ends).filter(|group| group.len() == 1).map(|group| group[0]).collect()
        };
        let open = alone(halves);
        if open.is_empty() {
            return;
        }
        let point = |c: u32| mesh.points[c as usize];
        let mut ends: Vec<u32> = open.iter().flat_map(|h| h.ends).collect();
        ends.sort_unstable();
        ends.dedup();
        let tree = PointsOnEdges::new(ends.iter().map(|&c| (c, point(c))));
        let mut parts: Vec<(Half, Vec<u32>)> = Vec::new();
        let mut farthest = HashMap::new();
        for &h in &open {
            let [a, b] = h.ends;
            let own = mesh.corners_of(&mesh.polygons[h.facet as usize]);
            let mut between = tree.on(point(a), point(b), tolerance);
            between.retain(|found| !own.contains(&found.point));
            if let Some(far) = between.iter().map(|found| found.distance).max_by(f64::total_cmp) {
                farthest.insert((h.facet, h.ends), far);
                parts.push((h, between.iter().map(|found| found.point).collect()));
            }
        }
        // Two open edges may cross without having anything in common: only parts that meet another edge are kept.
        let parted_of = |(h, between): &(Half, Vec<u32>)| -> Vec<Half> {
            let mut chain = vec![h.ends[0]];
            chain.extend(between);
            chain.push(h.ends[1]);
            let parts = chain.windows(2).map(|w| half(w[0], w[1], h.facet));
            parts.map(|p| Half { forward: p.forward == h.forward, ..p }).collect()
        };
        let mut all: Vec<Half> = open.iter().filter(|h| !farthest.contains_key(&(h.facet, h.ends))).copied().collect();
        all.extend(parts.iter().flat_map(parted_of));
        all.sort_unstable();
        let lonely: HashSet<Half> = alone(&all).into_iter().collect();
        parts.retain(|part| parted_of(part).iter().any(|p| !lonely.contains(p)));
        if parts.is_empty() {
            return;
        }
        let whole: HashSet<(u32, [u32; 2])> = parts.iter().map(|(h, _)| (h.facet, h.ends)).collect();
        halves.retain(|h| !whole.contains(&(h.facet, h.ends)));
        halves.extend(parts.iter().flat_map(parted_of));
        halves.sort_unstable();
        for part in &parts {
            for p in parted_of(part) {
                let next = self.named.len() as u32;
                self.named.entry(p.ends).or_insert(next);
            }
        }
        let far = parts.iter().map(|(h, _)| farthest[&(h.facet, h.ends)]).fold(0.0, f64::max);
        let away = if far > 0.0 { format!(", at most {far:.1e} away") } else { String::new() };
        let edges = counted(parts.len(), "edge");
        report.healed.push(format!("parted {edges} at corners of other facets that lie on them{away}"));
        self.parted = parts.into_iter().map(|(h, between)| ((h.facet, h.ends), between)).collect();
    }

    /// A corner may be half a tolerance from where it was meant to be, which tilts a facet by so much over its width.
    fn find_blur(&mut self, mesh: &Mesh, halves: &[Half], tolerance: f64) {
        let tilt = |polygon| {
            let points = mesh.corners_of(polygon).iter().map(|&c| mesh.points[c as usize]);
            tolerance / width(points)
        };
        let own: Vec<f64> = mesh.polygons.iter().map(tilt).collect();
        self.blur = own.clone();
        for group in halves.chunk_by(|a, b| a.ends == b.ends) {
            let most = group.iter().map(|h| own[h.facet as usize]).fold(0.0, f64::max);
            for h in group {
                let blur = &mut self.blur[h.facet as usize];
                *blur = blur.max(own[h.facet as usize] + most);
            }
        }
    }
}

/// "1 edge is", "2 edges are".
fn are_edges(n: usize) -> String {
    format!("{} {}", counted(n, "edge"), if n == 1 { "is" } else { "are" })
}

/// Turns facets so that neighbours go along a common edge in opposite directions: of each set of facets that are joined by
/// edges of two, the lesser part.
fn orient(mesh: &mut Mesh, halves: &[Half], report: &mut Report) {
    let mut sets = Sets::new(mesh.polygons.len());
    let mut twisted = 0;
    for group in halves.chunk_by(|a, b| a.ends == b.ends) {
        if let [a, b] = group
            && a.facet != b.facet
            && !sets.join(a.facet as usize, b.facet as usize, a.forward == b.forward)
        {
            twisted += 1;
        }
    }
    let mut sides = vec![[0_u32; 2]; mesh.polygons.len()];
    let places: Vec<(usize, bool)> = (0..mesh.polygons.len()).map(|f| sets.root(f)).collect();
    for &(root, turned) in &places {
        sides[root][usize::from(turned)] += 1;
    }
    let mut count = 0;
    for (facet, &(root, turned)) in places.iter().enumerate() {
        let minority = sides[root][1] > sides[root][0];
        if turned != minority {
            let polygon = mesh.polygons[facet];
            mesh.corners[polygon.first as usize..][..polygon.count as usize].reverse();
            count += 1;
        }
    }
    if count > 0 {
        report.healed.push(format!("turned {} round to agree with their neighbours", counted(count, "facet")));
    }
    if twisted > 0 {
        report.problems.push(format!(
            "the surface has one side only: at {} neighbours cannot agree which is the front",
            counted(twisted, "edge")
        ));
    }
}

/// Disjoint sets whose members know whether they are turned against the first of their set.
struct Sets {
    parent: Vec<(usize, bool)>,
}

impl Sets {
    fn new(count: usize) -> Self {
        Self { parent: (0..count).map(|k| (k, false)).collect() }
    }

    /// The first of the set, and whether the member is turned against it.
    fn root(&mut self, member: usize) -> (usize, bool) {
        let (mut at, mut turned) = (member, false);
        while self.parent[at].0 != at {
            turned ^= self.parent[at].1;
            at = self.parent[at].0;
        }
        // Shortens the way for the next one.
        let (root, mut rest, mut next) = (at, turned, member);
        while next != root {
            let (parent, step) = self.parent[next];
            self.parent[next] = (root, rest);
            rest ^= step;
            next = parent;
        }
        (root, turned)
    }

    /// Says that one of two is turned against the other, or that they agree; no if they are known not to be so.
    fn join(&mut self, a: usize, b: usize, turned: bool) -> bool {
        let ((ra, ta), (rb, tb)) = (self.root(a), self.root(b));
        if ra == rb {
            return (ta ^ tb) == turned;
        }
        let (low, high) = (ra.min(rb), ra.max(rb));
        self.parent[high] = (low, ta ^ tb ^ turned);
        true
    }
}
