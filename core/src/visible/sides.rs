//! What is nearest to the eye beside an edge: a surface, or nothing, on its left and on its right.
//!
//! Sight lines say which surface it is, because that is what a region is made of: what is nearest there, whatever the edge is.
//! They pass beside a place of the edge that is far from all other edges, at two distances, and are believed if they agree, and
//! if those beside another place do. Geometry says whether the surface ends in the edge or goes on behind it: by the side of the
//! edge on which each of its sheets lies, which signs of polynomials tell, where depths beside an edge differ little and
//! could deceive.

use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::planar::{Edge, Map, nearest};
use crate::extract::{Path, SurfaceCurve, lies_left, lies_left_along, side_lies_left, side_lies_left_along};
use crate::grid::Grid;
use crate::line::Line;
use crate::stroke::from_chord;
use crate::visibility::{Hit, RayScratch, Subject, fold_lies_left};

/// The surface that is nearest on one side of an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Beside {
    /// Index of the surface.
    pub(super) surface: usize,
    /// The sheet of it that ends in the edge, if one does.
    pub(super) sheet: Option<Sheet>,
    /// Parameter of the edge's curve at the place that was looked at.
    pub(super) t: f64,
    /// Parameters of the surface beside it.
    pub(super) uv: DVec2,
}

/// A sheet that ends in a curve: where to find its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Sheet {
    /// Along the curve's own path.
    Path,
    /// On the second surface of a section.
    Second,
    /// Along a side that coincides with the curve.
    Side(usize),
}

impl Sheet {
    /// Parameters on the sheet at `t` of the curve, whose position there is `p`. Where a side closes, its ends are one place: of
    /// their parameters those that are nearer to `before` are meant.
    pub(super) fn uv(
        self,
        subject: &Subject<'_>,
        curve: &SurfaceCurve,
        t: f64,
        p: DVec3,
        before: Option<DVec2>,
    ) -> DVec2 {
        let g = &subject.geometry;
        match (self, &curve.path) {
            (Self::Side(side), _) => {
                let path = &subject.stitching.sides[side].path;
                let (at, distance) = path.nearest(g.view, p);
                let room = distance + 8.0 * subject.occluders.resolution();
                let ends = path.domain();
                let closes = ends.iter().all(|&end| path.point(g.view, end).distance(p) <= room);
                match before.filter(|_| closes) {
                    Some(before) => {
                        let [a, b] = ends.map(|end| path.uv(end));
                        if a.distance(before) <= b.distance(before) { a } else { b }
                    }
                    None => path.uv(at),
                }
            }
            (Self::Second, Path::Section(section)) => curve.both_uv(g, section, t)[1],
            _ => curve.uv(g, t),
        }
    }
}

/// What lies beside an edge: on its left, then on its right.
pub(super) type Sides = [Option<Beside>; 2];

/// Fractions of an edge's length at which it may be looked beside.
const PLACES: [f64; 9] = [0.5, 0.31, 0.69, 0.17, 0.83, 0.41, 0.59, 0.07, 0.93];

/// Farthest sight lines from an edge, of the size of the picture.
const FARTHEST: f64 = 0.01;

/// Farthest that a curve is from its chords, in tolerances, which are measured at three places of each: as far again is on the safe side.
pub(super) const SAG: f64 = 2.0;

/// Part of a distance from another edge to which it is sought.
const PRECISION: f64 = 0.1;

/// How much nearer the second sight line passes.
const NEARER: f64 = 0.125;

/// Looks beside every edge, whose chords are within `tolerance`; an edge beside which the sight lines do not agree is left undecided. Also the number of sight lines.
pub(super) fn sides(subject: &Subject<'_>, map: &Map, tolerance: f64) -> (Vec<Option<Sides>>, u64) {
    let segments: Vec<(usize, usize)> =
        map.edges.iter().enumerate().flat_map(|(k, e)| (1..e.places.len()).map(move |i| (k, i))).collect();
    let corners = |&(k, i): &(usize, usize)| {
        let [a, b] = segment(&map.edges[k], i);
        (a.min(b), a.max(b))
    };
    let grid = Grid::new(segments.iter().map(corners));
    let look = Look { subject, map, segments: &segments, grid, tolerance, size: subject.geometry.view.size() };
    let one = |scratch: &mut RayScratch, k: usize| {
        let before = scratch.stats.rays;
        (look.edge(k, scratch), scratch.stats.rays - before)
    };
    #[cfg(feature = "parallel")]
    let all: Vec<(Option<Sides>, u64)> = {
        use rayon::prelude::*;
        (0..map.edges.len()).into_par_iter().map_init(RayScratch::default, one).collect()
    };
    #[cfg(not(feature = "parallel"))]
    let all: Vec<(Option<Sides>, u64)> = {
        let mut scratch = RayScratch::default();
        (0..map.edges.len()).map(|k| one(&mut scratch, k)).collect()
    };
    let rays = all.iter().map(|a| a.1).sum();
    (all.into_iter().map(|a| a.0).collect(), rays)
}

fn segment(edge: &Edge, i: usize) -> [DVec2; 2] {
    [edge.places[i - 1].1.truncate(), edge.places[i].1.truncate()]
}

struct Look<'a> {
    subject: &'a Subject<'a>,
    map: &'a Map,
    segments: &'a [(usize, usize)],
    grid: Grid,
    tolerance: f64,
    size: f64,
}

/// A place of an edge.
struct Place {
    t: f64,
    p: DVec3,
    /// Unit vector to the left on the screen.
    left: DVec2,
    /// Distance from all other edges, at the most as far as sight lines pass.
    clearance: f64,
    /// How far the other curves of the edge lie to its left, and to its right.
    room: [f64; 2],
}

impl Look<'_> {
    fn edge(&self, k: usize, scratch: &mut RayScratch) -> Option<Sides> {
        if self.subject.stop.is_wanted() {
            return None;
        }
        let edge = &self.map.edges[k];
        let length = edge.length();
        let farthest = (0.25 * length).min(FARTHEST * self.size);
        let mut places: Vec<Place> = PLACES.iter().filter_map(|f| self.place(k, f * length, farthest)).collect();
        // Stable: of equal ones the first.
        places.sort_by(|a, b| b.clearance.total_cmp(&a.clearance));
        let key = |sides: &Sides| sides.map(|s| s.map(|b| (b.surface, b.sheet)));
        let curve = &self.subject.curves[edge.curve];
        let fold = match &curve.path {
            // It is the same all along an edge, which no cusp is inside of.
            Path::Traced(traced) => places.iter().find_map(|p| fold_lies_left(self.subject, traced, curve, p.t)),
            _ => None,
        };
        let fold = fold.map(|left| if left { 1 } else { -1 });
        let mut seen: Vec<Sides> = Vec::new();
        for place in &places {
            let Some(here) = self.beside(edge, place, fold, scratch) else { continue };
            if seen.iter().any(|s| key(s) == key(&here)) {
                return seen.into_iter().find(|s| key(s) == key(&here));
            }
            seen.push(here);
        }
        // An edge so short, or in such narrow company, that there is one place only.
        if let [only] = seen[..] { Some(only) } else { None }
    }

    /// The place at a distance along an edge.
    fn place(&self, k: usize, along: f64, farthest: f64) -> Option<Place> {
        let edge = &self.map.edges[k];
        let mut before = 0.0;
        let mut at = None;
        for i in 1..edge.places.len() {
            let [a, b] = segment(edge, i);
            let step = a.distance(b);
            if before + step >= along && step > 0.0 {
                let (s, t) = (edge.places[i - 1].0, edge.places[i].0);
                at = Some((s + (t - s) * (along - before) / step, b - a));
                break;
            }
            before += step;
        }
        let (t, chord) = at?;
        let (p, d) = self.subject.curves[edge.curve].jet(&self.subject.geometry, t);
        let direction =
            d.truncate().try_normalize().filter(|d| d.dot(chord) > 0.0).or_else(|| chord.try_normalize())?;
        let q = p.truncate();
        let (mut clearance, mut near) = (farthest, Vec::new());
        let reach = farthest + SAG * self.tolerance;
        self.grid.near(q - reach, q + reach, &mut near);
        for &s in &near {
            let (other, i) = self.segments[s as usize];
            if other != k {
                clearance = clearance.min(self.distance(q, other, i, clearance));
            }
        }
        let left = direction.perp();
        let mut room = [0.0_f64; 2];
        for (curve, places) in &edge.others {
            let off = self.offset(q, *curve, places).dot(left);
            room = [room[0].max(off), room[1].max(-off)];
        }
        Some(Place { t, p, left, clearance, room })
    }

    /// Where the nearest place of another curve of an edge is, from a place of the edge.
    fn offset(&self, q: DVec2, curve: usize, places: &[(f64, DVec3)]) -> DVec2 {
        let point = |t: f64| self.subject.curves[curve].point(&self.subject.geometry, t).truncate();
        let near = places.windows(2).map(|w| nearest(point, q, [w[0].0, w[1].0], PRECISION));
        near.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(DVec2::ZERO, |n| point(n.0) - q)
    }

    /// Distance of a place from the part of an edge over a chord, if it is less than `least`. The curve it is that counts: where two
    /// edges are nearer to each other than to their chords, the chords may be in any order.
    fn distance(&self, q: DVec2, edge: usize, i: usize, least: f64) -> f64 {
        let edge = &self.map.edges[edge];
        let [a, b] = segment(edge, i);
        if from_chord(q.extend(0.0), a.extend(0.0), b.extend(0.0)) - SAG * self.tolerance >= least {
            return least;
        }
        let curve = &self.subject.curves[edge.curve];
        let point = |t: f64| curve.point(&self.subject.geometry, t).truncate();
        nearest(point, q, [edge.places[i - 1].0, edge.places[i].0], PRECISION).1
    }

    /// What lies on both sides of a place, if it is clear. `fold` is the side on which the sheets of a silhouette lie, if that is known.
    fn beside(&self, edge: &Edge, place: &Place, fold: Option<i8>, scratch: &mut RayScratch) -> Option<Sides> {
        // Beyond all curves that the edge is made of, and well before the next edge.
        let distance = place.room.map(|room| 0.3 * (place.clearance - room));
        if distance.iter().any(|d| d * NEARER <= 8.0 * self.subject.occluders.resolution()) {
            return None;
        }
        let at = |side: usize, part: f64| [1.0, -1.0][side] * (place.room[side] + part * distance[side]);
        let q = place.p.truncate();
        let mut met = [None; 2];
        for side in [0, 1] {
            let far = self.front(q + place.left * at(side, 1.0), scratch)?;
            let near = self.front(q + place.left * at(side, NEARER), scratch)?;
            met[side] = match (far, near) {
                (None, None) => None,
                (Some(far), Some(near)) if far.surface == near.surface => Some([far, near]),
                _ => return None,
            };
        }
        // A sheet that ends in the edge comes to its depth: linearly, or at a fold with the root of the distance.
        let left = met.map(|m| {
            m.map(|[far, near]| {
                let [a, b] = [far, near].map(|h| (h.z - place.p.z).abs());
                if b <= 8.0 * self.subject.occluders.resolution() { 0.0 } else { b / a }
            })
        });
        let curve = &self.subject.curves[edge.curve];
        let mut out = [None; 2];
        for (k, side) in [(0, 1), (1, -1)] {
            let Some([_, near]) = met[k] else { continue };
            let other = met[1 - k].filter(|m| m[1].surface == near.surface).and(left[1 - k]);
            // Of a fold's two sides one has both sheets, and it is that at which they come nearer.
            let fold = fold.map(|fold| fold == side);
            let comes = left[k].is_some_and(|own| match curve.path {
                Path::Traced(_) => fold.unwrap_or_else(|| other.is_none_or(|other| own < other)),
                _ => own <= 0.6,
            });
            let sheet = self.sheet(curve, place, side, &near, comes);
            out[k] = Some(Beside { surface: near.surface, sheet, t: place.t, uv: near.uv });
        }
        Some(out)
    }

    /// What is nearest on a sight line, if that is clear. Of surfaces that coincide it is the first.
    fn front(&self, q: DVec2, scratch: &mut RayScratch) -> Option<Option<Hit>> {
        let hits = self.subject.occluders.hits(q, scratch);
        let Some(top) = hits.first() else { return Some(None) };
        let same = |h: &&Hit| top.z - h.z <= 8.0 * self.subject.occluders.resolution();
        let first = hits.iter().take_while(same).min_by_key(|h| h.surface).filter(|h| !h.grazing)?;
        Some(Some(*first))
    }

    /// The sheet that ends in a curve of the surface that was met on one side: 1 on its left, −1 on its right. Where geometry does not
    /// tell, `comes` does.
    fn sheet(&self, curve: &SurfaceCurve, place: &Place, side: i8, near: &Hit, comes: bool) -> Option<Sheet> {
        let mut best: Option<(f64, Sheet)> = None;
        for (surface, sheet, lies) in sheets(self.subject, curve, place.t) {
            let here = match lies {
                Some(0) => false,
                Some(lies) => lies == side,
                None => comes,
            };
            if surface != near.surface || !here {
                continue;
            }
            let apart = apart(self.subject, surface, near.uv, sheet.uv(self.subject, curve, place.t, place.p, None));
            if best.is_none_or(|b| apart < b.0) {
                best = Some((apart, sheet));
            }
        }
        best.map(|b| b.1)
    }
}

/// Distance of two places of a surface, as a part of its parameter range.
pub(super) fn apart(subject: &Subject<'_>, surface: usize, a: DVec2, b: DVec2) -> f64 {
    let grid = &subject.geometry.view.surfaces()[surface];
    let range = |breaks: &[f64]| breaks[breaks.len() - 1] - breaks[0];
    ((a - b) / DVec2::new(range(&grid.u_breaks), range(&grid.v_breaks))).length()
}

/// The sheets that end in a curve at `t`: surface, where its parameters are, and the side on which it lies: 1 on the left, −1 on
/// the right, 0 if it is seen edge-on; `None` where that is not known from there.
fn sheets(subject: &Subject<'_>, curve: &SurfaceCurve, t: f64) -> heapless::Vec<(usize, Sheet, Option<i8>), 8> {
    let g = &subject.geometry;
    let mut out = heapless::Vec::new();
    // A joint of more sheets than there is room for is no manifold: what is left out counts as what goes on behind.
    let mut push = |surface: usize, sheet: Sheet, lies: Option<i8>| {
        let _ = out.push((surface, sheet, lies));
    };
    let sides = || {
        curve.sides.iter().enumerate().map(|(k, &side)| {
            let path = &subject.stitching.sides[side].path;
            let (p, along) = curve.jet(g, t);
            if k == 0 {
                return (path.surface(), Sheet::Path, side_lies_left(g, path, t));
            }
            let at = path.nearest(g.view, p).0;
            (path.surface(), Sheet::Side(side), side_lies_left_along(g, path, at, along))
        })
    };
    match &curve.path {
        Path::Section(_) => {
            for (&surface, sheet) in curve.surfaces.iter().zip([Sheet::Path, Sheet::Second]) {
                push(surface, sheet, None);
            }
        }
        // Where the fold is flat that is not known here, but elsewhere on the edge.
        Path::Traced(_) => push(curve.surface, Sheet::Path, None),
        Path::Line(line) if curve.sides.is_empty() => {
            let other = Line::new(g.view, line.surface, line.axis, line.value, !line.below);
            let along = line.jet(t).1;
            push(curve.surface, Sheet::Path, Some(lies_left(g, line, t)));
            push(curve.surface, Sheet::Path, Some(lies_left_along(g, &other, t, along)));
        }
        Path::Line(_) | Path::Trim(_) => {
            for (surface, sheet, lies) in sides() {
                push(surface, sheet, Some(lies));
            }
        }
    }
    out
}
