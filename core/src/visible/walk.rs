//! From edges to loops.
//!
//! Every edge borders the region on its left in its own direction, and that on its right against it. At a vertex each edge of a
//! region's border that comes in goes on to the next one clockwise that leaves: with the region on the left that is the one behind which
//! no other part of the region begins. The order round a vertex is that in which the edges leave a circle about it. As edges meet
//! at vertices only, it is the same for every circle that all of them reach, so a wide one is taken: on it edges that touch at the
//! vertex are apart.

use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;
use core::f64::consts::TAU;

use glam::DVec2;

use super::planar::{Edge, Map};
use super::sides::{Beside, Sides};
use crate::extract::Path;
use crate::visibility::Subject;

/// An edge as the border of a region, which lies on its left.
#[derive(Clone, Copy, Debug)]
pub(super) struct Half {
    /// Index of the edge.
    pub(super) edge: usize,
    /// Whether the edge runs the other way.
    pub(super) reversed: bool,
    /// The region's surface beside the edge.
    pub(super) beside: Beside,
}

impl Half {
    fn from(&self, map: &Map) -> usize {
        map.edges[self.edge].ends[usize::from(self.reversed)]
    }

    fn to(&self, map: &Map) -> usize {
        map.edges[self.edge].ends[usize::from(!self.reversed)]
    }
}

/// The halves of one surface's border as closed loops, and the vertices at which they do not go on.
#[derive(Clone, Debug, Default)]
pub(super) struct Walked {
    pub(super) loops: Vec<Vec<Half>>,
    /// Vertices that more or fewer halves enter than leave.
    pub(super) open: Vec<usize>,
}

/// Whether an edge borders nothing: on both sides there is one part of one surface.
pub(super) fn is_inner(subject: &Subject<'_>, edge: &Edge, sides: &Sides) -> bool {
    let curve = &subject.curves[edge.curve];
    match sides {
        [None, None] => true,
        [Some(a), Some(b)] if a.surface == b.surface => match (a.sheet, b.sheet) {
            // What ends there is seen edge-on, and the surface goes on behind it.
            (None, None) => true,
            // A knot line, over which the surface goes on with its parameters.
            (Some(_), Some(_)) => curve.sides.is_empty() && matches!(curve.path, Path::Line(_)),
            _ => false,
        },
        _ => false,
    }
}

/// The halves of every surface's border.
pub(super) fn halves(subject: &Subject<'_>, map: &Map, sides: &[Option<Sides>]) -> BTreeMap<usize, Vec<Half>> {
    let mut out: BTreeMap<usize, Vec<Half>> = BTreeMap::new();
    for (edge, sides) in sides.iter().enumerate() {
        let Some(sides) = sides.as_ref().filter(|s| !is_inner(subject, &map.edges[edge], s)) else { continue };
        for (reversed, beside) in [false, true].into_iter().zip(sides) {
            if let Some(beside) = *beside {
                out.entry(beside.surface).or_default().push(Half { edge, reversed, beside });
            }
        }
    }
    out
}

/// Widest gap in a border that a loop goes straight over, of the size of the picture. It is listed whatever its width; where it is wider the
/// border is left out, for what it encloses is not known even roughly.
pub(super) const WIDEST_GAP: f64 = 2e-3;

/// Walks the halves of one surface.
pub(super) fn walk(subject: &Subject<'_>, map: &Map, halves: &[Half]) -> Walked {
    let mut at: BTreeMap<usize, [Vec<usize>; 2]> = BTreeMap::new();
    for (k, half) in halves.iter().enumerate() {
        at.entry(half.to(map)).or_default()[0].push(k);
        at.entry(half.from(map)).or_default()[1].push(k);
    }
    let mut next = vec![None; halves.len()];
    let mut out = Walked::default();
    for (&vertex, [coming, leaving]) in &at {
        if coming.len() != leaving.len() {
            out.open.push(vertex);
        }
        match (&coming[..], &leaving[..]) {
            (&[a], &[b]) => next[a] = Some(b),
            _ => join(subject, map, halves, vertex, [coming, leaving], &mut next),
        }
    }
    bridge(map, halves, &mut next, WIDEST_GAP * subject.geometry.view.size());
    let mut used = vec![false; halves.len()];
    for first in 0..halves.len() {
        let (mut path, mut k) = (Vec::new(), first);
        // No two go on to the same one, so that a path that comes upon itself does so at its beginning.
        while !used[k] {
            used[k] = true;
            path.push(halves[k]);
            match next[k] {
                Some(n) if n == first => out.loops.push(core::mem::take(&mut path)),
                Some(n) => k = n,
                None => {}
            }
        }
    }
    out
}

/// Joins halves that do not go on to near ones that nothing goes on to, the nearest first.
fn bridge(map: &Map, halves: &[Half], next: &mut [Option<usize>], widest: f64) {
    let mut begun = vec![false; halves.len()];
    next.iter().flatten().for_each(|&k| begun[k] = true);
    let ends: Vec<usize> = (0..halves.len()).filter(|&k| next[k].is_none()).collect();
    let starts: Vec<usize> = (0..halves.len()).filter(|&k| !begun[k]).collect();
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for &a in &ends {
        let from = map.vertices[halves[a].to(map)];
        let gap = |b: usize| from.distance(map.vertices[halves[b].from(map)]);
        pairs.extend(starts.iter().map(|&b| (gap(b), a, b)).filter(|p| p.0 <= widest));
    }
    pairs.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    for (_, a, b) in pairs {
        if next[a].is_none() && !begun[b] {
            next[a] = Some(b);
            begun[b] = true;
        }
    }
}

/// Joins the halves at a vertex where several meet.
fn join(
    subject: &Subject<'_>,
    map: &Map,
    halves: &[Half],
    vertex: usize,
    [coming, leaving]: [&[usize]; 2],
    next: &mut [Option<usize>],
) {
    let v = map.vertices[vertex];
    let end_of = |k: usize, comes: bool| (halves[k].edge, halves[k].reversed != comes);
    let ends = coming.iter().map(|&k| end_of(k, true)).chain(leaving.iter().map(|&k| end_of(k, false)));
    let reach = ends.map(|(edge, _)| reach(&map.edges[edge], v)).fold(f64::INFINITY, f64::min);
    let angle = |k: usize, comes: bool| {
        let (edge, last) = end_of(k, comes);
        direction(subject, &map.edges[edge], v, last, 0.5 * reach)
    };
    let leave: Vec<(usize, f64)> = leaving.iter().map(|&k| (k, angle(k, false))).collect();
    let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
    for &a in coming {
        let from = angle(a, true);
        for &(b, to) in &leave {
            let turn = libm::fmod(from - to, TAU);
            let turn = if turn <= 0.0 { turn + TAU } else { turn };
            // Back along itself only if there is nothing else.
            let back = halves[a].edge == halves[b].edge && halves[a].reversed != halves[b].reversed;
            pairs.push((if back { TAU } else { turn }, a, b));
        }
    }
    pairs.sort_by(|x, y| x.0.total_cmp(&y.0).then((x.1, x.2).cmp(&(y.1, y.2))));
    let mut taken: Vec<usize> = Vec::new();
    for (_, a, b) in pairs {
        if next[a].is_none() && !taken.contains(&b) {
            next[a] = Some(b);
            taken.push(b);
        }
    }
}

/// How far an edge gets from a vertex.
fn reach(edge: &Edge, v: DVec2) -> f64 {
    edge.places.iter().map(|p| p.1.truncate().distance(v)).fold(0.0, f64::max)
}

/// Angle at which an edge first leaves the circle of radius `r` about the vertex at its beginning or its end.
fn direction(subject: &Subject<'_>, edge: &Edge, v: DVec2, last: bool, r: f64) -> f64 {
    let count = edge.places.len();
    let place = |k: usize| edge.places[if last { count - 1 - k } else { k }];
    let outside = |p: DVec2| p.distance(v) >= r;
    let k = (1..count).find(|&k| outside(place(k).1.truncate())).unwrap_or(count - 1);
    let (mut inner, mut outer) = (place(k - 1).0, place(k).0);
    let point = |t: f64| subject.curves[edge.curve].point(&subject.geometry, t).truncate();
    for _ in 0..50 {
        let middle = 0.5 * (inner + outer);
        if outside(point(middle)) { outer = middle } else { inner = middle }
    }
    let d = point(outer) - v;
    libm::atan2(d.y, d.x)
}
