//! Which boundaries coincide.
//!
//! Two boundary curves that coincide over an interval are one edge, and so are those that the model says are one, whatever
//! their distance: a smooth join is a *seam* (not inked, silhouettes chain across it), a sharp one is a *crease*, inked
//! once. What coincides with nothing is a free *boundary*. A boundary may meet several others along parts of itself, so
//! edges are intervals of sides. Where a surface is trimmed its boundary is made of what trim curves keep of its borders, and of the trim curves
//! themselves.

use alloc::collections::BTreeMap;
use alloc::vec::Vec;

use glam::{DVec2, DVec3, DVec4};

use crate::line::{Axis, Line};
use crate::stop::Stop;
use crate::trim_line::TrimLine;
use crate::view::{MAX_DEGREE, ViewScene, curve_point};

mod near;
mod side;

pub use side::{Side, SidePath};

/// What an interval of a side is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EdgeClass {
    /// Free edge.
    Boundary,
    /// Joins another boundary at an angle, or more than one.
    Crease,
    /// Joins one other boundary smoothly.
    Smooth,
}

/// An interval of a side with the sides that coincide with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// Index of the side.
    pub side: usize,
    /// Interval of the side's running parameter.
    pub t: [f64; 2],
    /// Sides that coincide with it all along.
    pub partners: Vec<usize>,
    /// What it is.
    pub class: EdgeClass,
    /// How far it was found from its partners, view-space units: an edge is no better known than that. Rounding where the
    /// model's surfaces end in the same curves.
    pub gap: f64,
}

impl Edge {
    /// Whether this copy of a shared edge is the one to be inked: the one of the lowest side.
    #[must_use]
    pub fn owner(&self) -> bool {
        self.partners.iter().all(|&p| self.side < p)
    }
}

/// Tolerances of stitching.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StitchOptions {
    /// Boundaries nearer than this everywhere are one edge; view-space units.
    pub distance: f64,
    /// Largest angle between the tangent planes of a smooth join, radians; facets of a mesh have their own.
    pub angle: f64,
}

/// Boundaries nearer than this fraction of the size are one edge: models come out of other programs with seven digits.
pub(crate) const STITCH: f64 = 1e-6;

/// Largest angle of a smooth join if nothing else is asked for: one degree.
pub(crate) const SMOOTH_ANGLE: f64 = core::f64::consts::PI / 180.0;

impl StitchOptions {
    /// The usual ones for a scene.
    #[must_use]
    pub fn of(view: &ViewScene) -> Self {
        Self { distance: STITCH * view.size(), angle: SMOOTH_ANGLE }
    }
}

/// The sides of all surfaces and the edges they form.
#[derive(Clone, Debug)]
pub struct Stitching {
    /// Four sides a surface: u low, u high, v low, v high; then the trim curves of all surfaces.
    pub sides: Vec<Side>,
    /// Edges in the order of their sides, along each side in the order of its parameter. Poles have none, nor has what
    /// is cut off.
    pub edges: Vec<Edge>,
    /// Number of surfaces.
    surfaces: usize,
}

/// Interior points at which coincidence and angle are tested, as fractions of an interval; off centre, so that
/// symmetric curves that cross at their middles are not taken for one.
const PROBES: [f64; 5] = [0.08, 0.29, 0.47, 0.73, 0.94];

impl Stitching {
    /// Finds coincident boundaries. A join that is smooth on a part of itself only is parted, provided that the part is
    /// no shorter than a sixteenth of the interval between knots. Cost: O(n log n) in the number of sides, 5 nearest-point
    /// searches an interval of each pair whose boxes meet, and 16 for each that coincides, 1 if it joins triangles, and 16
    /// more if it coincides loosely.
    #[must_use]
    pub fn new(view: &ViewScene, options: &StitchOptions, stop: Stop<'_>) -> Self {
        let surfaces = view.surfaces().len();
        let mut sides: Vec<Side> = (0..surfaces).flat_map(|s| Side::borders(view, s, options.distance)).collect();
        let trims = (0..surfaces).flat_map(|s| TrimLine::all(view, s));
        sides.extend(trims.map(|line| Side::trimmed(view, line, options.distance)));
        let mut near = near::near_pairs(&sides, options.distance, stop);
        add_shared(&sides, &mut near);
        let changes_of = |side: &Side| side.changes().into_iter().map(|t| Change::of(view, side, t)).collect();
        let changes: Vec<Vec<Change>> = sides.iter().map(changes_of).collect();
        let of_side = |i: usize| {
            let mut edges = Vec::new();
            if sides[i].is_edge() && !stop.is_wanted() {
                side_edges(view, &sides, &changes, i, &near[i], options, &mut edges);
            }
            edges
        };
        #[cfg(feature = "parallel")]
        let edges: Vec<Edge> = {
            use rayon::prelude::*;
            (0..sides.len()).into_par_iter().flat_map_iter(of_side).collect()
        };
        #[cfg(not(feature = "parallel"))]
        let edges: Vec<Edge> = (0..sides.len()).flat_map(of_side).collect();
        Self { sides, edges, surfaces }
    }

    /// For every surface the surfaces that share an edge with it, itself included, in increasing order.
    #[must_use]
    pub fn joined_surfaces(&self) -> Vec<Vec<usize>> {
        let mut joined: Vec<Vec<usize>> = (0..self.surfaces).map(|s| alloc::vec![s]).collect();
        for edge in &self.edges {
            let own = self.sides[edge.side].path.surface();
            joined[own].extend(edge.partners.iter().map(|&p| self.sides[p].path.surface()));
        }
        for list in &mut joined {
            list.sort_unstable();
            list.dedup();
        }
        joined
    }

    /// The edges of one side.
    pub fn edges_of(&self, side: usize) -> impl Iterator<Item = &Edge> {
        let from = self.edges.partition_point(|e| e.side < side);
        self.edges[from..].iter().take_while(move |e| e.side == side)
    }
}

/// Adds the sides that are sides of one shared edge.
fn add_shared(sides: &[Side], near: &mut [Vec<usize>]) {
    let mut by_edge: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (i, side) in sides.iter().enumerate().filter(|(_, side)| side.is_edge()) {
        for edge in side.shared.iter().map(|s| s.edge) {
            let list = by_edge.entry(edge).or_default();
            if list.last() != Some(&i) {
                list.push(i);
            }
        }
    }
    for list in by_edge.values() {
        for &i in list {
            near[i].extend(list.iter().copied().filter(|&j| j != i));
        }
    }
    for n in near {
        n.sort_unstable();
        n.dedup();
    }
}

/// A place of a side where a coincidence can begin or end.
struct Change {
    at: DVec3,
    /// Shared edges of which the side has a part that begins or ends there.
    edges: Vec<u32>,
}

impl Change {
    fn of(view: &ViewScene, side: &Side, t: f64) -> Self {
        let edges = side.shared.iter().filter(|s| s.t.contains(&t)).map(|s| s.edge).collect();
        Self { at: side.path.point(view, t), edges }
    }
}

/// Cuts side `i` where a coincidence begins or ends, and classifies the intervals. `changes` are the places of the sides
/// where one can.
fn side_edges(
    view: &ViewScene,
    sides: &[Side],
    changes: &[Vec<Change>],
    i: usize,
    near: &[usize],
    options: &StitchOptions,
    edges: &mut Vec<Edge>,
) {
    let path = &sides[i].path;
    let [a, b] = path.domain();
    // A coincidence of analytic curves can begin and end only at a knot of one of them, or where one is cut off.
    let mut cuts = sides[i].changes();
    for &j in near {
        for change in &changes[j] {
            let p = change.at;
            // The ends of a part of the same edge count whatever their distance.
            if change.edges.iter().any(|&edge| sides[i].shared.iter().any(|own| own.edge == edge)) {
                cuts.push(path.nearest(view, p).0);
                continue;
            }
            if !sides[i].may_hold(p, options.distance) {
                continue;
            }
            let (ti, d) = path.nearest(view, p);
            if d <= options.distance {
                cuts.push(ti);
            }
        }
    }
    cuts.sort_by(f64::total_cmp);
    let short = |x: f64, y: f64| (path.point(view, x) - path.point(view, y)).length() <= options.distance;
    let mut kept: Vec<f64> = Vec::with_capacity(cuts.len());
    for c in cuts {
        // A closed side's two ends coincide in space but not in parameter: both stay.
        match kept.last() {
            Some(&last) if short(last, c) && c - last < 0.5 * (b - a) => {}
            _ => kept.push(c),
        }
    }
    if let Some(last) = kept.last_mut() {
        *last = b;
    }
    let first = edges.len();
    for w in kept.windows(2) {
        let at = |f: f64| w[0] + f * (w[1] - w[0]);
        if !sides[i].is_kept(at(0.5)) {
            continue;
        }
        let of_edge = sides[i]
            .edge_at(at(0.5))
            .map_or_else(Vec::new, |edge| other_sides(view, sides, i, edge, near, PROBES.map(at), options.distance));
        // How far a side is from this one, if they coincide.
        let apart = |&j: &usize| {
            if let Some(found) = of_edge.iter().find(|f| f.0 == j) {
                return Some(*found);
            }
            let other = &sides[j];
            let foot = |f: f64| {
                let p = path.point(view, at(f));
                let near = other.may_hold(p, options.distance);
                let (t, distance) = if near { other.path.nearest(view, p) } else { (0.0, f64::INFINITY) };
                (distance <= options.distance && other.is_kept(t)).then_some((p, t, distance))
            };
            let (mut own, mut feet, mut most) = ([DVec3::ZERO; 5], [DVec3::ZERO; 5], 0.0_f64);
            for (k, &f) in PROBES.iter().enumerate() {
                let (p, t, distance) = foot(f)?;
                (own[k], feet[k], most) = (p, other.path.point(view, t), most.max(distance));
            }
            run_along(&own, &feet).then_some((j, most))
        };
        let found: Vec<(usize, f64)> = near.iter().filter_map(apart).collect();
        let gap = found.iter().map(|&(j, d)| gap(view, path, &sides[j].path, [w[0], w[1]], d, options.distance));
        let gap = gap.fold(0.0, f64::max);
        let partners: Vec<usize> = found.into_iter().map(|f| f.0).collect();
        let classes = match partners.as_slice() {
            [] => alloc::vec![(EdgeClass::Boundary, [w[0], w[1]])],
            [j] => {
                let meeting = [path.surface(), sides[*j].path.surface()];
                let cosine = libm::cos(view.smooth_angle(meeting, options.angle));
                let class = |t: f64| {
                    let tj = sides[*j].path.nearest(view, path.point(view, t)).0;
                    let (n, m) = (conormal(view, path, t)?, conormal(view, &sides[*j].path, tj)?);
                    Some(if n.dot(m) <= -cosine { EdgeClass::Smooth } else { EdgeClass::Crease })
                };
                // Triangles meet at one angle all along.
                let flat = meeting.iter().all(|&s| is_triangle(view, sides, s));
                classes(class, [w[0], w[1]], short, if flat { 1 } else { PLACES })
            }
            _ => alloc::vec![(EdgeClass::Crease, [w[0], w[1]])],
        };
        for (class, t) in classes {
            match edges[first..].last_mut() {
                Some(last) if last.t[1] == t[0] && last.partners == partners && last.class == class => {
                    last.t[1] = t[1];
                    last.gap = last.gap.max(gap);
                }
                _ => edges.push(Edge { side: i, t, partners: partners.clone(), class, gap }),
            }
        }
    }
}

/// Whether a surface is a bilinear patch with a border that is a point: a triangle.
fn is_triangle(view: &ViewScene, sides: &[Side], surface: usize) -> bool {
    let grid = &view.surfaces()[surface];
    let first = &view.patches()[grid.first];
    grid.u_breaks.len() == 2
        && grid.v_breaks.len() == 2
        && (first.degree_u, first.degree_v) == (1, 1)
        && sides[4 * surface..4 * surface + 4].iter().any(|side| side.collapsed)
}

/// Part of the stitching distance below which it does not matter how far apart the sides of an edge are: it is far below
/// what else is told apart.
const LOOSE: f64 = 1e-4;

/// Equal parts of an interval in which a join is asked whether it is smooth, and how far apart its sides are if not by
/// rounding. An approximation has a few waves between two knots, which fewer places would miss.
const PLACES: u32 = 16;

/// Of the sides that belong to the same edge, those that run along side `i` at the parameters `t`, whatever their distance,
/// with that.
///
/// An edge may be in several parts on each of its surfaces. Of the others the nearest points stay at their ends; and where
/// an edge comes back beside itself, round a slot, the part across is farther off by far.
fn other_sides(
    view: &ViewScene,
    sides: &[Side],
    i: usize,
    edge: u32,
    near: &[usize],
    t: [f64; 5],
    distance: f64,
) -> Vec<(usize, f64)> {
    let own = t.map(|t| sides[i].path.point(view, t));
    let along = |&j: &usize| {
        let feet = own.map(|p| sides[j].path.point(view, sides[j].path.nearest(view, p).0));
        let far = own.iter().zip(&feet).map(|(p, q)| p.distance(*q)).fold(0.0, f64::max);
        run_along(&own, &feet).then_some((j, far))
    };
    let of_edge = near.iter().filter(|&&j| sides[j].shared.iter().any(|s| s.edge == edge));
    let found: Vec<(usize, f64)> = of_edge.filter_map(along).collect();
    let nearest = found.iter().map(|f| f.1).fold(f64::INFINITY, f64::min);
    found.into_iter().filter(|f| f.1 <= distance.max(2.0 * nearest)).collect()
}

/// Whether the feet of points of a side run along it, over half of it at least. Where another side only ends beside a short
/// interval they stay at the end; and if it is closed but for that interval, they leap from the one end to the other.
fn run_along(own: &[DVec3; 5], feet: &[DVec3; 5]) -> bool {
    let (mut length, mut along) = (0.0, 0.0);
    for (a, b) in own.windows(2).zip(feet.windows(2)) {
        let [step, foot] = [a, b].map(|w| w[0].distance(w[1]));
        length += step;
        if foot >= 0.5 * step {
            along += step;
        }
    }
    along >= 0.5 * length
}

/// How far two sides that coincide over the interval `t` of the first are apart, given how far they were `found` to be at
/// [`PROBES`].
fn gap(view: &ViewScene, side: &SidePath, other: &SidePath, t: [f64; 2], found: f64, distance: f64) -> f64 {
    if found <= LOOSE * distance {
        return found;
    }
    let place = |k: u32| t[0] + (t[1] - t[0]) * (f64::from(k) + 0.5) / f64::from(PLACES);
    let apart = |k: u32| other.nearest(view, side.point(view, place(k))).1;
    // A search may end at another place than the nearest.
    (0..PLACES).map(apart).fold(found, f64::max).min(found.max(distance))
}

/// Parts of the interval `t` of a side, one after the other, with the class of each. The class is asked for at the middles
/// of so many equal parts, and where it changes the place is bisected until it is `short`. A place without a class, because a
/// surface has no tangent plane there, is like its neighbours; an interval of such places alone is a crease.
fn classes(
    class: impl Fn(f64) -> Option<EdgeClass>,
    t: [f64; 2],
    short: impl Fn(f64, f64) -> bool,
    places: u32,
) -> Vec<(EdgeClass, [f64; 2])> {
    let mut out: Vec<(EdgeClass, [f64; 2])> = Vec::new();
    let mut before = t[0];
    for k in 0..places {
        let place = t[0] + (t[1] - t[0]) * (f64::from(k) + 0.5) / f64::from(places);
        let Some(here) = class(place) else { continue };
        match out.last_mut() {
            None => out.push((here, t)),
            Some((last, range)) if *last != here => {
                let (mut lo, mut hi) = (before, place);
                while !short(lo, hi) {
                    let middle = 0.5 * (lo + hi);
                    if middle <= lo || middle >= hi {
                        break;
                    }
                    if class(middle).is_none_or(|c| c == *last) { lo = middle } else { hi = middle }
                }
                range[1] = hi;
                out.push((here, [hi, t[1]]));
            }
            Some(_) => {}
        }
        before = place;
    }
    if out.is_empty() {
        out.push((EdgeClass::Crease, t));
    }
    out
}

/// Unit vector in model space that is tangent to the surface, across the side, and points into the surface; `None`
/// where the surface has no tangent plane there.
///
/// The curve across the side leaves it in the direction from its first control point to the next that is another point:
/// the limit of its tangent where derivatives vanish.
fn conormal(view: &ViewScene, path: &SidePath, t: f64) -> Option<DVec3> {
    match path {
        SidePath::Line(line) => conormal_of_border(view, line, t),
        SidePath::Trim(line) => conormal_of_trim(view, line, t),
    }
}

/// [`conormal`] of a trim line. Trims are inside the surface, where derivatives span the tangent plane as a rule.
fn conormal_of_trim(view: &ViewScene, line: &TrimLine, t: f64) -> Option<DVec3> {
    let k = line.span_at(t);
    let patch = view.model_patch(line.spans[k].patch);
    let (uv, run) = line.uv_jet(t, k);
    let local = patch.to_local(uv).clamp(DVec2::ZERO, DVec2::ONE);
    let run = run / DVec2::new(patch.u[1] - patch.u[0], patch.v[1] - patch.v[0]);
    let jet = patch.jet(local.x, local.y);
    let along = (jet.du * run.x + jet.dv * run.y).try_normalize()?;
    let inward = if line.spans[k].left { run.perp() } else { -run.perp() };
    let inward = jet.du * inward.x + jet.dv * inward.y;
    let across = inward - along * inward.dot(along);
    // What of one direction is left by the other is rounding where they are one.
    (across.length() > 1e-9 * inward.length()).then(|| across.normalize())
}

/// [`conormal`] of a border of the parameter range.
fn conormal_of_border(view: &ViewScene, line: &Line, t: f64) -> Option<DVec3> {
    let (uv, across_u) = (line.uv(t), line.axis == Axis::U);
    let below = if across_u { [line.below, false] } else { [false, line.below] };
    let (index, local) = view.locate(line.surface, uv, below);
    let patch = view.model_patch(index);
    let jet = patch.jet(local.x, local.y);
    let along = if across_u { jet.dv } else { jet.du }.try_normalize()?;
    // Control points and what is computed from them carry some tens of roundings of the largest coordinate.
    let cartesian = |h: DVec4| h.truncate() / h.w;
    let extent = patch.points.iter().fold(0.0_f64, |m, &h| m.max(cartesian(h).abs().max_element()));
    let rounding = 64.0 * f64::EPSILON * extent;
    let last = if across_u { patch.degree_u } else { patch.degree_v };
    let (rows, width) = (patch.degree_u + 1, patch.degree_v + 1);
    let control = |k: usize| {
        let k = if line.below { last - k } else { k };
        let row = |i: usize| &patch.points[i * width..(i + 1) * width];
        if across_u {
            return cartesian(curve_point(row(k), local.y));
        }
        let column: heapless::Vec<DVec4, { MAX_DEGREE + 1 }> = (0..rows).map(|i| row(i)[k]).collect();
        cartesian(curve_point(&column, local.x))
    };
    let first = control(0);
    let inward = (1..=last).map(|k| control(k) - first).find(|d| d.length() > rounding)?;
    let across = inward - along * inward.dot(along);
    // One that leaves along the side spans no plane with it.
    (across.length() > rounding).then(|| across.normalize())
}

#[cfg(test)]
mod tests;
