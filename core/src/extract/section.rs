//! Sections: the curves in which two surfaces that are not joined intersect.
//!
//! The arcs of all pairs of patches are found by subdivision (module `search`), short and nearly straight, and followed from
//! border to border over cells and patches. A point of a section is found by Newton's method on both surfaces at once,
//! none on a chord.

mod cell;
mod search;

use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;

use glam::{DMat4, DVec2, DVec3, DVec4};

use self::cell::Cell;
use self::search::{Search, Short};
use super::curve::{Geometry, Path, SurfaceCurve};
use super::facing::Facing;
use super::kind::CurveKind;
use super::silhouette::UndecidedPlace;
use super::style::Styles;
use super::zero_set::Rect;
use crate::grid::Grid;
use crate::stitch::Stitching;
use crate::stop::Stop;
use crate::view::{Jet, Patch, ViewScene};

/// An arc of a section on one pair of patches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionArc {
    /// Indices of the two patches, the one of the lower surface first.
    pub patches: [usize; 2],
    /// Local parameters of both patches at the beginning and at the end: u and v of the first, u and v of the second.
    pub ends: [DVec4; 2],
}

/// A curve that two surfaces have in common.
///
/// Its parameter t runs from 0 to the number of arcs; within one the point moves uniformly along the chord. The second
/// surface's normal points to the left, seen along the first one's.
#[derive(Clone, Debug, PartialEq)]
pub struct SectionCurve {
    /// The arcs, each beginning where the one before it ends.
    pub arcs: Vec<SectionArc>,
}

/// A point of a section.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SectionPoint {
    /// The two patches.
    pub(crate) patches: [usize; 2],
    /// Local parameters on them.
    pub(crate) local: [DVec2; 2],
    /// Position in view space.
    pub(crate) p: DVec3,
    /// Derivative by t.
    pub(crate) d: DVec3,
}

impl SectionCurve {
    /// The point at `t`, of the arc number `arc`. Newton's method from the chord, some four steps.
    pub(crate) fn at(&self, patches: &[Patch], t: f64, arc: usize) -> SectionPoint {
        let SectionArc { patches: which, ends } = self.arcs[arc];
        let (a, b) = (&patches[which[0]], &patches[which[1]]);
        let jets = |x: DVec4| -> [Jet; 2] { [a.jet(x.x, x.y), b.jet(x.z, x.w)] };
        let [from, to] = ends.map(|x| jets(x)[0].p);
        let chord = to - from;
        let f = t - arc as f64;
        let mut x = ends[0].lerp(ends[1], f);
        // Both surfaces are at one point, and that is at the fraction f of the chord.
        let target = (from + chord * f).dot(chord);
        let mut jet = jets(x);
        for _ in 0..12 {
            let [ja, jb] = jet;
            let column = |d: DVec3, first: bool| {
                let sign = if first { 1.0 } else { -1.0 };
                (d * sign).extend(if first { d.dot(chord) } else { 0.0 })
            };
            let matrix =
                DMat4::from_cols(column(ja.du, true), column(ja.dv, true), column(jb.du, false), column(jb.dv, false));
            let residual = (ja.p - jb.p).extend(ja.p.dot(chord) - target);
            if matrix.determinant() == 0.0 {
                break;
            }
            let step = matrix.inverse() * residual;
            let next = (x - step).clamp(DVec4::ZERO, DVec4::ONE);
            let moved = (next - x).abs().max_element();
            x = next;
            jet = jets(x);
            if moved.is_nan() || moved <= 1e-15 {
                break;
            }
        }
        let along = jet[0].normal().cross(jet[1].normal());
        let speed = along.dot(chord) / chord.length_squared();
        let d = if speed > 0.0 { along / speed } else { chord };
        let local = [DVec2::new(x.x, x.y), DVec2::new(x.z, x.w)];
        SectionPoint { patches: which, local, p: jet[0].p, d }
    }

    /// Index of the arc that holds `t`.
    pub(crate) fn arc_at(&self, t: f64) -> usize {
        (libm::floor(t).max(0.0) as usize).min(self.arcs.len() - 1)
    }
}

/// The sections of a scene.
#[derive(Clone, Debug, Default)]
pub struct Sections {
    /// The curves, by their surfaces.
    pub curves: Vec<SectionCurve>,
    /// Places at which it is not known how two surfaces intersect: they touch there, or nearly.
    pub undecided: Vec<UndecidedPlace>,
}

/// Finds where surfaces that share no edge intersect. Arcs that end within `contact` (view-space units) of each other
/// are one curve. Surfaces that touch without crossing have no section. Cost: proportional to the pairs of patches that
/// come near, some hundred pairs of cells for each.
#[must_use]
pub fn sections(view: &ViewScene, stitching: &Stitching, contact: f64, stop: Stop<'_>) -> Sections {
    let joined = stitching.joined_surfaces();
    let patches = view.patches();
    let cells: Vec<Cell> = patches.iter().map(Cell::new).collect();
    let grid = Grid::new(cells.iter().map(|c| (c.lo.truncate(), c.hi.truncate())));
    let mut arcs: BTreeMap<[usize; 2], Vec<SectionArc>> = BTreeMap::new();
    let mut undecided = Vec::new();
    let mut near = Vec::new();
    for (i, a) in cells.iter().enumerate() {
        if stop.is_wanted() {
            break;
        }
        grid.near(a.lo.truncate(), a.hi.truncate(), &mut near);
        for j in near.iter().map(|&j| j as usize).filter(|&j| j > i) {
            let surfaces = [patches[i].surface, patches[j].surface];
            if joined[surfaces[0]].binary_search(&surfaces[1]).is_ok() || !a.is_near(&cells[j]) {
                continue;
            }
            let mut search = Search::new(contact);
            search.meet(a, &cells[j]);
            let arc = |s: &Short| SectionArc { patches: [i, j], ends: s.ends };
            arcs.entry(surfaces).or_default().extend(search.found.iter().map(arc));
            undecided.extend(
                search.undecided.iter().map(|[from, to]| UndecidedPlace {
                    patch: i,
                    place: Rect { u: [from.x, to.x], v: [from.y, to.y] },
                }),
            );
        }
    }
    let mut curves = Vec::new();
    for list in arcs.into_values() {
        chained(patches, list, contact, &mut curves);
    }
    Sections { curves, undecided }
}

/// The sections that are wanted as curves to be drawn. They are split where one of their surfaces turns away from the eye.
#[must_use]
pub fn section_curves(g: &Geometry<'_>, sections: &Sections, styles: &Styles) -> Vec<SurfaceCurve> {
    let patches = g.view.patches();
    let curve = |section: &SectionCurve| {
        let surfaces = section.arcs[0].patches.map(|k| patches[k].surface);
        Some(SurfaceCurve {
            kind: CurveKind::Section,
            surface: surfaces[0],
            surfaces: surfaces.to_vec(),
            domain: [0.0, section.arcs.len() as f64],
            splits: turns(g, section),
            path: Path::Section(section.clone()),
            active: false,
            inked: true,
            style: styles.drawn_by(&surfaces, CurveKind::Section)?,
            level: 0,
            sides: Vec::new(),
            gap: 0.0,
        })
    };
    sections.curves.iter().filter_map(curve).collect()
}

/// Where one of the two surfaces of a section turns away from the eye: inside an arc, or from one patch to the next. An arc
/// is short and nearly straight, so that this happens once on it or not at all; what turns away and back within one is
/// left to the sight lines.
fn turns(g: &Geometry<'_>, section: &SectionCurve) -> Vec<f64> {
    let patches = g.view.patches();
    // Whether the surface number `side` faces the eye at `t`, on the arc number `k`; none if it is seen edge-on.
    let faces = |side: usize, t: f64, k: usize| {
        let form = &g.forms[section.arcs[k].patches[side]];
        match form.facing {
            Facing::Front => Some(true),
            Facing::Back => Some(false),
            Facing::EdgeOn => None,
            Facing::Mixed => {
                let local = section.at(patches, t, k).local[side];
                Some(form.value(local.x, local.y) > 0.0)
            }
        }
    };
    let mut out = Vec::new();
    for side in [0, 1] {
        for k in 0..section.arcs.len() {
            let (mut lo, mut hi) = (k as f64, (k + 1) as f64);
            let (first, last) = (faces(side, lo, k), faces(side, hi, k));
            if k > 0 && faces(side, lo, k - 1) != first {
                out.push(lo);
            }
            if first == last {
                continue;
            }
            // To the last bits of a parameter of this size.
            while hi - lo > 1e-14 * hi {
                let middle = 0.5 * (lo + hi);
                if faces(side, middle, k) == first { lo = middle } else { hi = middle }
            }
            out.push(0.5 * (lo + hi));
        }
    }
    out
}

/// Strings arcs together, the end of one to the nearest beginning of another.
fn chained(patches: &[Patch], arcs: Vec<SectionArc>, gap: f64, out: &mut Vec<SectionCurve>) {
    let place = |arc: &SectionArc, end: usize| {
        let x = arc.ends[end];
        patches[arc.patches[0]].eval(x.x, x.y)
    };
    // Cubes twice the gap wide: whatever is within the gap lies in the same one or in a neighbour.
    let cube = (2.0 * gap).max(f64::MIN_POSITIVE);
    let key = |p: DVec3| (p / cube).floor().to_array().map(|x| x as i64);
    let mut beginnings: BTreeMap<[i64; 3], Vec<usize>> = BTreeMap::new();
    for (k, arc) in arcs.iter().enumerate() {
        beginnings.entry(key(place(arc, 0))).or_default().push(k);
    }
    let mut next = vec![None; arcs.len()];
    let mut has_before = vec![false; arcs.len()];
    for (k, arc) in arcs.iter().enumerate() {
        let p = place(arc, 1);
        let [x, y, z] = key(p);
        let around = (-1..=1).flat_map(|i| (-1..=1).flat_map(move |j| (-1..=1).map(move |l| [i, j, l])));
        let near = around
            .filter_map(|[i, j, l]| beginnings.get(&[x.saturating_add(i), y.saturating_add(j), z.saturating_add(l)]))
            .flatten()
            .filter(|&&other| other != k && !has_before[other])
            .map(|&other| (place(&arcs[other], 0).distance(p), other))
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        if let Some((distance, other)) = near
            && distance <= gap
        {
            next[k] = Some(other);
            has_before[other] = true;
        }
    }
    let mut used = vec![false; arcs.len()];
    // Open curves from their beginnings, then closed ones from anywhere.
    let open = (0..arcs.len()).filter(|&k| !has_before[k]);
    for first in open.chain(0..arcs.len()) {
        let mut curve = SectionCurve { arcs: Vec::new() };
        let mut at = Some(first);
        while let Some(k) = at.filter(|&k| !used[k]) {
            used[k] = true;
            curve.arcs.push(arcs[k]);
            at = next[k];
        }
        if !curve.arcs.is_empty() {
            out.push(curve);
        }
    }
}

#[cfg(test)]
mod tests;
