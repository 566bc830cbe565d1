//! Cracks: where the two sides of one edge are apart.
//!
//! The faces of a model that was not made exactly meet in the edges they share, but the ends of their surfaces need not: they
//! leave a gap, or overlap. A sight line there would meet no sheet, or two. It is to meet what it does where the sides are one:
//! beside a crack each of the faces is left out, and stands for the half plane that it fills beyond its side, as a face does
//! that ends on the sight line.

use alloc::vec::Vec;
use core::cmp::Ordering;

use glam::{DVec2, DVec3};

use super::coverage::{Sector, coverage};
use super::{Exclusion, Occluders, RayAnswer, RayScratch, Unclear};
use crate::grid::Grid;
use crate::line::{Axis, foot};
use crate::stitch::{Edge, SidePath, Stitching};
use crate::view::ViewScene;

/// Parts of a polynomial piece of an edge.
const PARTS: u32 = 16;

/// Half the width of a crack, of the largest distance of its sides that was found: between the places looked at they may be
/// farther apart.
const WIDE: f64 = 2.0;

/// Largest part of a patch that is left out beside a crack: where more of it would be, because it is seen nearly edge-on or is
/// no larger than the crack, nothing is left out, and the sight line is not clear.
const MOST: f64 = 0.05;

/// Difference of direction, in radians, below which the sides of an edge are one.
const APART: f64 = 0.02;

/// How far the sheet beside a crack may bend: its half plane and what is left out of it are those of its tangent plane.
const BEND: f64 = 1.5;

/// A part of an edge, and the box that holds what is beside it on the screen.
struct Part {
    /// Index into `Cracks::edges`.
    edge: usize,
    t: [f64; 2],
    lo: DVec2,
    hi: DVec2,
}

/// The cracks of a scene, for sight lines that pass beside them.
pub struct Cracks<'a> {
    view: &'a ViewScene,
    stitching: &'a Stitching,
    edges: Vec<&'a Edge>,
    parts: Vec<Part>,
    grid: Grid,
    border: f64,
}

/// A face beside a crack.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    /// The part of the face that is left out.
    pub(super) place: Exclusion,
    pub(super) z: f64,
    /// How far the depth of the face may be from that on the sight line.
    pub(super) room: f64,
    /// What it fills of the screen.
    pub(super) sector: Sector,
}

/// A crack beside which a sight line passes.
#[derive(Clone, Debug)]
pub(super) struct Crack {
    edge: usize,
    t: f64,
    /// The faces on both sides, or on all if there are more.
    pub(super) faces: Vec<Face>,
    /// Whether it is not known what the sight line meets there: at the end of an edge, or where a face is seen edge-on.
    pub(super) doubtful: bool,
}

impl<'a> Cracks<'a> {
    /// The edges whose sides are farther apart than `border`, on the screen or in depth. O(n log n) in their number.
    #[must_use]
    pub fn new(view: &'a ViewScene, stitching: &'a Stitching, border: f64) -> Self {
        let loose = |e: &&Edge| e.gap > border && !e.partners.is_empty() && e.owner();
        let edges: Vec<&Edge> = stitching.edges.iter().filter(loose).collect();
        let mut parts = Vec::new();
        for (edge, e) in edges.iter().enumerate() {
            let path = &stitching.sides[e.side].path;
            let mut breaks: Vec<f64> = path.breaks().into_iter().filter(|t| e.t[0] < *t && *t < e.t[1]).collect();
            breaks.insert(0, e.t[0]);
            breaks.push(e.t[1]);
            let width = DVec2::splat(WIDE * e.gap + border);
            for w in breaks.windows(2) {
                let at = |k: f64| w[0] + (w[1] - w[0]) * (k / f64::from(PARTS));
                for k in 0..PARTS {
                    let k = f64::from(k);
                    let [a, m, b] = [k, k + 0.5, k + 1.0].map(|k| path.point(view, at(k)).truncate());
                    // Twice as far from its chord as its middle no arc is that is nearly a parabola.
                    let bent = DVec2::splat(2.0 * m.distance(0.5 * (a + b)));
                    let (lo, hi) = (a.min(b) - width - bent, a.max(b) + width + bent);
                    parts.push(Part { edge, t: [at(k), at(k + 1.0)], lo, hi });
                }
            }
        }
        let grid = Grid::new(parts.iter().map(|p| (p.lo, p.hi)));
        Self { view, stitching, edges, parts, grid, border }
    }

    /// Those beside which the sight line through `q` passes.
    pub(super) fn at(&self, q: DVec2) -> Vec<Crack> {
        let mut found: Vec<Crack> = Vec::new();
        if self.edges.is_empty() {
            return found;
        }
        let mut near = Vec::new();
        self.grid.near(q, q, &mut near);
        for part in near.iter().map(|&k| &self.parts[k as usize]) {
            if q.cmplt(part.lo).any() || q.cmpgt(part.hi).any() {
                continue;
            }
            let Some(crack) = self.beside(part, q) else { continue };
            // Two parts of an edge find the same place where they meet.
            let reach = 2.0 * (part.t[1] - part.t[0]);
            if !found.iter().any(|c| c.edge == crack.edge && (c.t - crack.t).abs() <= reach) {
                found.push(crack);
            }
        }
        // Where several edges meet, half planes are not what the faces fill.
        for k in 0..found.len() {
            let meets = |other: &Crack| {
                let same = |a: &Face, b: &Face| {
                    let near = (a.place.uv - b.place.uv).abs().cmple(a.place.radius + b.place.radius).all();
                    a.place.surface == b.place.surface && near
                };
                found[k].faces.iter().any(|a| other.faces.iter().any(|b| same(a, b)))
            };
            let several = found.iter().enumerate().any(|(j, other)| j != k && meets(other));
            found[k].doubtful |= several;
        }
        found
    }

    /// The crack along a part of an edge, if the sight line passes beside it.
    fn beside(&self, part: &Part, q: DVec2) -> Option<Crack> {
        let edge = self.edges[part.edge];
        let path = &self.stitching.sides[edge.side].path;
        let width = WIDE * edge.gap + self.border;
        let reach = part.t[1] - part.t[0];
        let bounds = [(part.t[0] - reach).max(edge.t[0]), (part.t[1] + reach).min(edge.t[1])];
        let flat = |t: f64| {
            let (p, d) = path.jet(self.view, t);
            (p.truncate().extend(0.0), d.truncate().extend(0.0))
        };
        let domain = path.domain();
        let start = 0.5 * (part.t[0] + part.t[1]);
        let t = foot(flat, q.extend(0.0), start, bounds, domain[1] - domain[0]);
        let (p, d) = path.jet(self.view, t);
        let off = q - p.truncate();
        if off.length() > width {
            return None;
        }
        let mut crack = Crack { edge: part.edge, t, faces: Vec::new(), doubtful: false };
        // Beyond an end, or seen along itself.
        let along = d.truncate().normalize_or_zero();
        crack.doubtful |= along == DVec2::ZERO || off.dot(along).abs() > 1e-3 * width;
        let partners =
            edge.partners.iter().map(|&side| (side, self.stitching.sides[side].path.nearest(self.view, p).0));
        for (side, t) in core::iter::once((edge.side, t)).chain(partners) {
            match self.face(&self.stitching.sides[side].path, t, q, width) {
                (face, true) => crack.faces.push(face),
                (face, false) => {
                    crack.faces.push(face);
                    crack.doubtful = true;
                }
            }
        }
        Some(crack)
    }

    /// The face that ends on a side at `t`, and whether it is known what it fills.
    fn face(&self, path: &SidePath, t: f64, q: DVec2, width: f64) -> (Face, bool) {
        let (index, local) = path.place(self.view, t);
        let patch = &self.view.patches()[index];
        let size = patch.parameter_size();
        let (run, inward) = match path {
            SidePath::Line(line) => {
                let inward = if line.below { -1.0 } else { 1.0 };
                match line.axis {
                    Axis::U => (DVec2::Y, DVec2::X * inward),
                    Axis::V => (DVec2::X, DVec2::Y * inward),
                }
            }
            SidePath::Trim(line) => {
                let k = line.span_at(t);
                let run = line.uv_jet(t, k).1 / size;
                (run, if line.spans[k].left { run.perp() } else { -run.perp() })
            }
        };
        let jet = patch.jet(local.x, local.y);
        let (a, b) = (jet.du.truncate(), jet.dv.truncate());
        let (along, inward) = (a * run.x + b * run.y, a * inward.x + b * inward.y);
        let sector = Sector::left_of(if along.perp_dot(inward) > 0.0 { along } else { -along });
        let det = a.perp_dot(b);
        let rows = [DVec2::new(b.y, -b.x) / det, DVec2::new(-a.y, a.x) / det];
        let reach = BEND * (q.distance(jet.p.truncate()) + width);
        let part = DVec2::new(rows[0].length(), rows[1].length()) * reach;
        let slope = (rows[0] * jet.du.z + rows[1] * jet.dv.z).length();
        let corners = [DVec2::ONE, DVec2::NEG_ONE, DVec2::new(1.0, -1.0), DVec2::new(-1.0, 1.0)];
        let turns = |corner: &DVec2| {
            let at = (local + *corner * part).clamp(DVec2::ZERO, DVec2::ONE);
            let there = patch.jet(at.x, at.y);
            there.du.truncate().perp_dot(there.dv.truncate()) * det <= 0.0
        };
        // Over a fold there would be two sheets.
        let known = part.cmple(DVec2::splat(MOST)).all() && !corners.iter().any(turns);
        let (surface, uv) = (path.surface(), path.uv(t));
        let radius = if known { part * size } else { DVec2::ZERO };
        let room = if known { slope * reach } else { 0.0 };
        (Face { place: Exclusion { surface, uv, radius }, z: jet.p.z, room: room + width, sector }, known)
    }
}

/// Whether a point of a crack is among the places that are left out already: then it is the point's own.
pub(super) fn is_own(crack: &Crack, exclude: &[Exclusion]) -> bool {
    let holds = |face: &Face, e: &Exclusion| {
        e.surface == face.place.surface && (face.place.uv - e.uv).abs().cmple(e.radius).all()
    };
    crack.faces.iter().any(|face| exclude.iter().any(|e| holds(face, e)))
}

impl Face {
    /// How the face lies to a point in depth, contact within `contact`: in front of it, behind it, or neither.
    pub(super) fn above(&self, p: DVec3, contact: f64) -> Ordering {
        let (above, room) = (self.z - p.z, self.room + contact);
        if above > room {
            Ordering::Greater
        } else if above < -room {
            Ordering::Less
        } else {
            Ordering::Equal
        }
    }
}

impl Occluders<'_> {
    /// As [`query`](Self::query), among edges whose sides are apart: a sight line through the gap between the sides of such an
    /// edge, or through both where they overlap, meets what it would if they were one.
    #[must_use]
    pub fn query_among(
        &self,
        p: DVec3,
        exclude: &[Exclusion],
        cracks: &Cracks<'_>,
        scratch: &mut RayScratch,
    ) -> RayAnswer {
        let contact = self.resolution();
        let mut cracks = cracks.at(p.truncate());
        let is_behind = |c: &Crack| c.faces.iter().all(|face| face.above(p, contact) == Ordering::Less);
        cracks.retain(|c| !is_behind(c) && !is_own(c, exclude));
        if cracks.is_empty() {
            return self.query(p, exclude, scratch);
        }
        let known = || cracks.iter().filter(|c| !c.doubtful);
        let places = known().flat_map(|c| &c.faces).map(|face| face.place);
        let exclude: Vec<Exclusion> = exclude.iter().copied().chain(places).collect();
        let mut answer = self.query(p, &exclude, scratch);
        for crack in known() {
            if crack.faces.iter().any(|face| face.above(p, contact) != Ordering::Greater) {
                answer.doubt(Unclear::Contact);
                continue;
            }
            let sectors: Vec<Sector> = crack.faces.iter().map(|face| face.sector).collect();
            let (low, high) = coverage(&sectors, APART, &mut Vec::new());
            answer.qi += low;
            if low != high {
                answer.doubt(Unclear::Border);
            }
        }
        if cracks.iter().any(|c| c.doubtful) {
            answer.doubt(Unclear::Border);
        }
        answer
    }
}

#[cfg(test)]
mod tests;
