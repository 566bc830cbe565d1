//! The picture's planar map: the visible parts of curves, split into edges between vertices.
//!
//! An edge ends where its curve does, where it passes behind a nearer one, and where another visible one ends in it. A crossing
//! that splitting found says which two places are one vertex; so does the contact tolerance, to which stitched curves are
//! known, for whatever else comes together: corners, the ends of silhouettes on boundaries, places that sight lines located.

use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use crate::arrange::Cut;
use crate::disjoint::Disjoint;
use crate::grid::Grid;
use crate::stroke::{places, runs};
use crate::visibility::{Sighting, Subject};

/// A part of a visible curve between two vertices.
#[derive(Clone, Debug)]
pub(super) struct Edge {
    /// Index of the curve.
    pub(super) curve: usize,
    /// Indices of the vertices at its beginning and its end.
    pub(super) ends: [usize; 2],
    /// Places along the curve, ends included, with chords within the tolerance: parameter and position in view space. The first and
    /// the last position are those of the vertices on the screen.
    pub(super) places: Vec<(f64, DVec3)>,
    /// Other curves that run along it, nearer than what counts as one place, and borders of what lies beside it as much as its own:
    /// index, and places as of its own.
    pub(super) others: Vec<(usize, Vec<(f64, DVec3)>)>,
}

impl Edge {
    /// Length on the screen.
    pub(super) fn length(&self) -> f64 {
        self.places.windows(2).map(|w| w[0].1.truncate().distance(w[1].1.truncate())).sum()
    }
}

/// The vertices and edges of a picture.
#[derive(Clone, Debug, Default)]
pub(super) struct Map {
    /// Places of the vertices on the screen.
    pub(super) vertices: Vec<DVec2>,
    pub(super) edges: Vec<Edge>,
    /// Visible parts of curves that the edges come from.
    pub(super) parts: usize,
}

/// Nodes, some of which turn out to be one.
#[derive(Default)]
struct Nodes {
    same: Disjoint,
    at: Vec<DVec2>,
}

impl Nodes {
    fn push(&mut self, at: DVec2) -> usize {
        self.at.push(at);
        self.same.push()
    }

    /// Joins those within `distance` of one another.
    fn join_near(&mut self, distance: f64) {
        let mut order: Vec<usize> = (0..self.at.len()).collect();
        order.sort_by(|&a, &b| self.at[a].x.total_cmp(&self.at[b].x).then(a.cmp(&b)));
        for (k, &a) in order.iter().enumerate() {
            for &b in &order[k + 1..] {
                if self.at[b].x - self.at[a].x > distance {
                    break;
                }
                if self.at[a].distance(self.at[b]) <= distance {
                    self.same.join(a, b);
                }
            }
        }
    }
}

/// A visible part of a curve with the vertices on it.
struct Part {
    curve: usize,
    places: Vec<(f64, DVec3)>,
    /// Parameters and nodes, the ends first.
    nodes: Vec<(f64, usize)>,
}

/// The map of what is `visible`. Chords are within `tolerance`, and places within `contact` of each other are one.
pub(super) fn map(subject: &Subject<'_>, visible: &[Sighting], tolerance: f64, contact: f64) -> Map {
    let g = &subject.geometry;
    let mut nodes = Nodes::default();
    let mut parts: Vec<Part> = Vec::new();
    for run in runs(visible) {
        if subject.stop.is_wanted() {
            return Map::default();
        }
        let places = places(g, &subject.curves[run.curve], run.t, tolerance);
        let ends = [places.first(), places.last()].into_iter().flatten();
        let nodes = ends.map(|&(t, p)| (t, nodes.push(p.truncate()))).collect();
        parts.push(Part { curve: run.curve, places, nodes });
    }
    let count = parts.len();
    crossings(subject, &mut parts, &mut nodes, contact);
    chains(subject, &parts, &mut nodes);
    nodes.join_near(contact);
    snap(subject, &mut parts, &mut nodes, contact);
    nodes.join_near(contact);
    edges(subject, parts, nodes, contact, count)
}

/// Makes vertices of the crossings between visible parts: where the curve that is cut ends, or goes on behind nothing; and of the places at
/// which a curve meets the silhouette of its own surface, whether this is visible or not: there the sheet that ends in it changes sides.
fn crossings(subject: &Subject<'_>, parts: &mut [Part], nodes: &mut Nodes, contact: f64) {
    let pieces = &subject.arrangement.pieces;
    let g = &subject.geometry;
    for k in 0..parts.len() {
        let curve = parts[k].curve;
        let [start, end] = [0, 1].map(|e| parts[k].nodes[e].0);
        let first = pieces.partition_point(|p| (p.curve, p.t[0]) < (curve, start));
        let here = pieces[first..].iter().take_while(|p| p.curve == curve && p.t[0] <= end);
        for piece in here {
            let t = piece.t[0];
            if piece.entered.contains(&Cut::Own) {
                node_at(subject, &mut parts[k], t, nodes, contact);
            }
            for cut in &piece.entered {
                let Cut::Crossing { with, at, .. } = *cut else { continue };
                let from = parts.partition_point(|p| p.curve < with);
                let holds = |p: &Part| p.curve == with && p.nodes[0].0 <= at && at <= p.nodes[1].0;
                let there = parts[from..].iter().take_while(|p| p.curve == with).position(holds);
                let Some(other) = there.map(|i| from + i) else { continue };
                let own = node_at(subject, &mut parts[k], t, nodes, contact);
                let p = subject.curves[with].point(g, at).truncate();
                // A crossing found at the end of an arc that is known to its fit may be off; what is farther is no vertex.
                if p.distance(nodes.at[own]) <= contact {
                    let theirs = node_at(subject, &mut parts[other], at, nodes, contact);
                    nodes.same.join(own, theirs);
                }
            }
        }
    }
}

/// The node of a part at `t`: the one that is there already, or a new one.
fn node_at(subject: &Subject<'_>, part: &mut Part, t: f64, nodes: &mut Nodes, contact: f64) -> usize {
    let table = &subject.arrangement.lengths[part.curve];
    let l = table.length_at(t);
    let near = part.nodes.iter().find(|n| (table.length_at(n.0) - l).abs() <= 0.25 * contact);
    if let Some(&(_, node)) = near {
        return node;
    }
    let node = nodes.push(subject.curves[part.curve].point(&subject.geometry, t).truncate());
    part.nodes.push((t, node));
    node
}

/// Joins the ends of silhouettes that go on from one another.
fn chains(subject: &Subject<'_>, parts: &[Part], nodes: &mut Nodes) {
    let end = |curve: usize, last: bool| {
        let t = subject.curves[curve].domain[usize::from(last)];
        let from = parts.partition_point(|p| p.curve < curve);
        let mut own = parts[from..].iter().take_while(|p| p.curve == curve);
        own.find_map(|p| p.nodes.iter().find(|n| n.0 == t).map(|n| n.1))
    };
    for chain in &subject.chains.chains {
        let pairs = chain.links.windows(2).map(|w| (w[0], w[1]));
        let closing = chain.links.last().zip(chain.links.first()).filter(|_| chain.closed);
        for (a, b) in pairs.chain(closing.map(|(a, b)| (*a, *b))) {
            if let (Some(p), Some(q)) = (end(a.curve, !a.reversed), end(b.curve, b.reversed)) {
                nodes.same.join(p, q);
            }
        }
    }
}

/// Splits parts where a vertex of others lies in them.
fn snap(subject: &Subject<'_>, parts: &mut [Part], nodes: &mut Nodes, contact: f64) {
    let g = &subject.geometry;
    let segments: Vec<(usize, usize)> =
        parts.iter().enumerate().flat_map(|(k, p)| (1..p.places.len()).map(move |i| (k, i))).collect();
    // A curve is farther from its chord than it is from what lies on it.
    let slack = |part: &Part, i: usize| {
        let [a, b] = [part.places[i - 1], part.places[i]];
        let middle = subject.curves[part.curve].point(g, 0.5 * (a.0 + b.0)).truncate();
        2.0 * contact + 2.0 * middle.distance(0.5 * (a.1 + b.1).truncate())
    };
    let boxes: Vec<(DVec2, DVec2)> = segments
        .iter()
        .map(|&(k, i)| {
            let [a, b] = [parts[k].places[i - 1].1, parts[k].places[i].1].map(DVec3::truncate);
            let room = DVec2::splat(slack(&parts[k], i));
            (a.min(b) - room, a.max(b) + room)
        })
        .collect();
    let grid = Grid::new(boxes.iter().copied());
    let mut near = Vec::new();
    let mut found: Vec<(usize, f64, usize)> = Vec::new();
    for node in 0..nodes.at.len() {
        if nodes.same.root(node) != node {
            continue;
        }
        let q = nodes.at[node];
        grid.near(q, q, &mut near);
        for &s in &near {
            let (k, i) = segments[s as usize];
            let (lo, hi) = boxes[s as usize];
            if q.cmplt(lo).any() || q.cmpgt(hi).any() {
                continue;
            }
            let part = &parts[k];
            let curve = &subject.curves[part.curve];
            let (t, distance) =
                nearest(|t| curve.point(g, t).truncate(), q, [part.places[i - 1].0, part.places[i].0], 0.0);
            if distance > contact {
                continue;
            }
            let table = &subject.arrangement.lengths[part.curve];
            // It is the end of the part itself, or a vertex that is there already.
            let known = part.nodes.iter().any(|&(s, other)| {
                let apart = (table.length_at(s) - table.length_at(t)).abs();
                apart <= contact || (nodes.same.root(other) == node && apart <= 8.0 * contact)
            });
            if !known {
                found.push((k, t, node));
            }
        }
    }
    for (k, t, node) in found {
        let own = node_at(subject, &mut parts[k], t, nodes, contact);
        nodes.same.join(own, node);
    }
}

/// Parameter and distance of the point of a curve that is nearest to `q`, between two parameters, by golden sections, until the part
/// that is left is shorter than so much of the distance.
pub(super) fn nearest(point: impl Fn(f64) -> DVec2, q: DVec2, [mut a, mut b]: [f64; 2], precision: f64) -> (f64, f64) {
    const RATIO: f64 = 0.618_033_988_749_895;
    let offset = |t: f64| point(t) - q;
    let (mut s, mut t) = (b - RATIO * (b - a), a + RATIO * (b - a));
    let (mut ds, mut dt) = (offset(s), offset(t));
    for _ in 0..60 {
        // What is left is a little more than four times as long as what lies between the two.
        if 5.0 * ds.distance(dt) <= precision * ds.length().min(dt.length()) {
            break;
        }
        if ds.length_squared() <= dt.length_squared() {
            (b, t, dt) = (t, s, ds);
            s = b - RATIO * (b - a);
            ds = offset(s);
        } else {
            (a, s, ds) = (s, t, dt);
            t = a + RATIO * (b - a);
            dt = offset(t);
        }
    }
    let (t, d) = if ds.length_squared() <= dt.length_squared() { (s, ds) } else { (t, dt) };
    (t, d.length())
}

/// In contact tolerances, how long an edge has to be that comes back to its vertex, or that several curves are.
const SHORTEST: f64 = 4.0;

/// The edges between the nodes of the parts.
fn edges(subject: &Subject<'_>, parts: Vec<Part>, mut nodes: Nodes, contact: f64, count: usize) -> Map {
    let g = &subject.geometry;
    let mut number = vec![usize::MAX; nodes.at.len()];
    let mut map = Map { parts: count, ..Map::default() };
    for mut part in parts {
        let curve = &subject.curves[part.curve];
        part.nodes.sort_by(|a, b| a.0.total_cmp(&b.0));
        for w in part.nodes.windows(2) {
            let ([(a, _), (b, _)], ends) = ([w[0], w[1]], [nodes.same.root(w[0].1), nodes.same.root(w[1].1)]);
            let inner = part.places.iter().filter(|p| a < p.0 && p.0 < b).copied();
            let mut places: Vec<(f64, DVec3)> = Vec::with_capacity(part.places.len());
            places.push((a, curve.point(g, a)));
            places.extend(inner);
            places.push((b, curve.point(g, b)));
            if places.len() == 2 && ends[0] == ends[1] {
                // A closed edge has an area, and what lies between two places that are one has none.
                let middle = 0.5 * (a + b);
                places.insert(1, (middle, curve.point(g, middle)));
            }
            let edge = Edge { curve: part.curve, ends, places, others: Vec::new() };
            if ends[0] == ends[1] && edge.length() <= SHORTEST * contact {
                continue;
            }
            map.edges.push(edge);
        }
    }
    drop_doubled(subject, &mut map.edges, contact);
    contract_short(&mut map.edges, &mut nodes, contact);
    for edge in &mut map.edges {
        for end in &mut edge.ends {
            if number[*end] == usize::MAX {
                number[*end] = map.vertices.len();
                map.vertices.push(nodes.at[*end]);
            }
            *end = number[*end];
        }
        let [a, b] = edge.ends.map(|v| map.vertices[v]);
        let last = edge.places.len() - 1;
        for (k, p) in [(0, a), (last, b)] {
            edge.places[k].1 = p.extend(edge.places[k].1.z);
        }
    }
    map
}

/// Of edges that run within `contact` of each other from one vertex to another leaves one, an active one if there is one: a line
/// touches the silhouette of its own surface, and what lies between them there is as narrow as what counts as one place. It is the
/// edge of all of them.
fn drop_doubled(subject: &Subject<'_>, edges: &mut Vec<Edge>, contact: f64) {
    let mut between: BTreeMap<[usize; 2], Vec<usize>> = BTreeMap::new();
    for (k, edge) in edges.iter().enumerate() {
        let [a, b] = edge.ends;
        between.entry([a.min(b), a.max(b)]).or_default().push(k);
    }
    let mut dropped = vec![false; edges.len()];
    for same in between.values() {
        for (i, &a) in same.iter().enumerate() {
            for &b in &same[i + 1..] {
                if !dropped[a] && !dropped[b] && runs_along(subject, &edges[a], &edges[b], contact) {
                    let stays = subject.curves[edges[a].curve].active || !subject.curves[edges[b].curve].active;
                    let (stays, goes) = if stays { (a, b) } else { (b, a) };
                    dropped[goes] = true;
                    let gone = &mut edges[goes];
                    let mut others = core::mem::take(&mut gone.others);
                    others.push((gone.curve, gone.places.clone()));
                    edges[stays].others.extend(others);
                }
            }
        }
    }
    let mut dropped = dropped.into_iter();
    edges.retain(|_| !dropped.next().unwrap_or(false));
}

/// Makes one vertex of the ends of an edge that several curves are, if it is hardly longer than their lines may be apart: where three of them meet
/// in a triangle so narrow that two of its corners lie on the opposite sides, nothing can be told beside it that is not beyond its ends.
fn contract_short(edges: &mut Vec<Edge>, nodes: &mut Nodes, contact: f64) {
    let shortest = SHORTEST * contact;
    for edge in edges.iter().filter(|e| !e.others.is_empty() && e.length() <= shortest) {
        nodes.same.join(edge.ends[0], edge.ends[1]);
    }
    for edge in edges.iter_mut() {
        edge.ends = edge.ends.map(|end| nodes.same.root(end));
    }
    edges.retain(|e| e.ends[0] != e.ends[1] || e.length() > shortest);
}

/// Whether all of an edge lies within `contact` of another one.
fn runs_along(subject: &Subject<'_>, edge: &Edge, other: &Edge, contact: f64) -> bool {
    let g = &subject.geometry;
    let curve = |e: &Edge| &subject.curves[e.curve];
    let near = |q: DVec2| {
        let point = |t: f64| curve(other).point(g, t).truncate();
        other.places.windows(2).any(|w| nearest(point, q, [w[0].0, w[1].0], 0.0).1 <= contact)
    };
    let middle = |w: &[(f64, DVec3)]| curve(edge).point(g, 0.5 * (w[0].0 + w[1].0)).truncate();
    // Where two edges are not one they are so nowhere as a rule, and least in the middle.
    let count = edge.places.len();
    let order = (count / 2..count).chain(0..count / 2);
    order.filter(|&k| k > 0).all(|k| near(middle(&edge.places[k - 1..=k])) && near(edge.places[k].1.truncate()))
}
