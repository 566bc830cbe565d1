//! Regions without silhouettes that hide parts of themselves all the same.
//!
//! A region between silhouettes faces one way, so that its projection is one-to-one near every point, but not as a
//! whole: a ramp that winds up by more than a turn overlaps itself (Elber and Cohen 1989, figure 2). By their lemma 2.2
//! the projected boundary of such a region intersects itself. It is split along isoparametric lines until every part
//! has a projected boundary that does not.
//!
//! Why a simple boundary proves it: as the facing has one sign, the number of points of the region over a point of the
//! screen is the winding number of the projected boundary round it, and that is 0 or 1. Where two pieces of the boundary
//! are one curve in space (the seam of a closed surface), they are run through in opposite directions and cancel; the
//! turning of what is left adds up to 2π times the Euler characteristic, so that nested curves turn opposite ways.

use alloc::vec;
use alloc::vec::Vec;

use glam::DVec3;

use super::arc::Arc;
use super::intersect::{Work, meetings};
use super::meeting::Meeting;
use super::{Arcs, Tolerance};
use crate::extract::facing::Facing;
use crate::extract::{CurveKind, Geometry, Path, SurfaceCurve};
use crate::grid::Grid;
use crate::line::{Axis, Line};
use crate::stop::Stop;

/// A rectangle of a surface's parameters in which it faces one way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Part {
    /// Range of u.
    pub u: [f64; 2],
    /// Range of v.
    pub v: [f64; 2],
    /// Proven: no two of its points lie over one another. Otherwise rays have to be tested against it in full.
    pub one_to_one: bool,
}

/// A part of a surface without silhouettes inside.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// Index of the surface.
    pub surface: usize,
    /// [`Facing::Front`] or [`Facing::Back`].
    pub facing: Facing,
    /// Its parts; a single one unless its projection is not one-to-one as a whole.
    pub parts: Vec<Part>,
}

impl Region {
    /// Whether its projected boundary intersects itself, so that it had to be split.
    #[must_use]
    pub fn overlaps_itself(&self) -> bool {
        self.parts.len() > 1 || self.parts.iter().any(|p| !p.one_to_one)
    }
}

/// Splits until a part is not split further: it then covers a thousandth of its region or less.
const MAX_DEPTH: u32 = 10;

/// The regions of every surface that are rectangles of its parameters: the whole surface where all of its patches face
/// one way, else each patch that does. What is left, patches with silhouettes inside and patches seen edge-on, is in no
/// region. Cost: some ten arcs intersected pairwise a region, and a part where it overlaps itself.
#[must_use]
pub fn regions(g: &Geometry<'_>, tolerance: Tolerance) -> Vec<Region> {
    let mut out = Vec::new();
    for (surface, grid) in g.view.surfaces().iter().enumerate() {
        let count = grid.count_u() * grid.count_v();
        let facing = |k: usize| g.forms[grid.first + k].facing;
        let sided = |f: Facing| matches!(f, Facing::Front | Facing::Back);
        let mut put = |u: [f64; 2], v: [f64; 2], facing: Facing| {
            let mut parts = Vec::new();
            split(g, surface, [u, v], tolerance, 0, &mut parts);
            out.push(Region { surface, facing, parts });
        };
        let ends = |b: &[f64]| [b[0], b[b.len() - 1]];
        if sided(facing(0)) && (1..count).all(|k| facing(k) == facing(0)) {
            put(ends(&grid.u_breaks), ends(&grid.v_breaks), facing(0));
            continue;
        }
        for patch in (0..count).filter(|&k| sided(facing(k))) {
            let p = &g.view.patches()[grid.first + patch];
            put(p.u, p.v, facing(patch));
        }
    }
    out
}

fn split(
    g: &Geometry<'_>,
    surface: usize,
    [u, v]: [[f64; 2]; 2],
    tolerance: Tolerance,
    depth: u32,
    out: &mut Vec<Part>,
) {
    let one_to_one = boundary_is_simple(g, surface, u, v, tolerance);
    if one_to_one || depth >= MAX_DEPTH {
        out.push(Part { u, v, one_to_one });
        return;
    }
    let grid = &g.view.surfaces()[surface];
    let inside = |breaks: &[f64], r: [f64; 2]| -> Vec<f64> {
        breaks.iter().copied().filter(|&x| r[0] < x && x < r[1]).collect()
    };
    let (ku, kv) = (inside(&grid.u_breaks, u), inside(&grid.v_breaks, v));
    // Along the direction of more spans, at a knot; where there is none, along the longer one in space.
    let middle = |knots: &[f64], r: [f64; 2]| knots.get(knots.len() / 2).copied().unwrap_or(0.5 * (r[0] + r[1]));
    let in_u = if ku.len() == kv.len() {
        length(g, surface, u, v, true) >= length(g, surface, u, v, false)
    } else {
        ku.len() > kv.len()
    };
    let halves = if in_u {
        let m = middle(&ku, u);
        [[[u[0], m], v], [[m, u[1]], v]]
    } else {
        let m = middle(&kv, v);
        [[u, [v[0], m]], [u, [m, v[1]]]]
    };
    for half in halves {
        split(g, surface, half, tolerance, depth + 1, out);
    }
}

/// Length of a chain through the middle of a rectangle, along u or along v.
fn length(g: &Geometry<'_>, surface: usize, u: [f64; 2], v: [f64; 2], along_u: bool) -> f64 {
    const STEPS: usize = 16;
    let (axis, value, [a, b]) =
        if along_u { (Axis::V, 0.5 * (v[0] + v[1]), u) } else { (Axis::U, 0.5 * (u[0] + u[1]), v) };
    let line = Line::new(g.view, surface, axis, value, false);
    let at = |k: usize| line.point(a + (b - a) * k as f64 / STEPS as f64);
    (0..STEPS).map(|k| at(k).distance(at(k + 1))).sum()
}

/// Whether the projected boundary of a rectangle meets itself only where it does so in space.
fn boundary_is_simple(g: &Geometry<'_>, surface: usize, u: [f64; 2], v: [f64; 2], tolerance: Tolerance) -> bool {
    let sides =
        [(Axis::U, u[0], false, v), (Axis::U, u[1], true, v), (Axis::V, v[0], false, u), (Axis::V, v[1], true, u)];
    let line = |axis, value, below| Line::new(g.view, surface, axis, value, below);
    let curves = sides.map(|(axis, value, below, domain)| boundary_curve(line(axis, value, below), domain));
    is_simple(g, &curves, tolerance)
}

/// A part of an isoparametric line as a curve that is intersected, and nothing else.
pub(super) fn boundary_curve(line: Line, domain: [f64; 2]) -> SurfaceCurve {
    SurfaceCurve {
        kind: CurveKind::Boundary,
        surface: line.surface,
        surfaces: vec![line.surface],
        style: line.surface,
        path: Path::Line(line),
        domain,
        active: true,
        inked: false,
        level: 0,
        sides: Vec::new(),
        gap: 0.0,
        splits: Vec::new(),
    }
}

/// Whether a boundary of isoparametric lines meets itself on the screen only where it does so in space.
pub(super) fn is_simple(g: &Geometry<'_>, boundary: &[SurfaceCurve], tolerance: Tolerance) -> bool {
    let arcs = Arcs::new(boundary, g, tolerance.resolution, true, Stop::NEVER);
    let arcs: Vec<Arc> = arcs.with(boundary, *g).iter().collect();
    let grid = Grid::new(arcs.iter().map(|a| (a.lo, a.hi)));
    let (mut near, mut found, mut work) = (Vec::new(), Vec::new(), Work::default());
    for (k, first) in arcs.iter().enumerate() {
        grid.near(first.lo, first.hi, &mut near);
        for &other in near.iter().filter(|&&other| other as usize > k) {
            let second = &arcs[other as usize];
            if first.hi.cmplt(second.lo).any() || second.hi.cmplt(first.lo).any() {
                continue;
            }
            found.clear();
            meetings(first, second, tolerance.resolution, &mut found, &mut work);
            let at = |curve: usize, t: f64| boundary[curve].point(g, t);
            let apart = |p: DVec3, q: DVec3| p.distance(q) > tolerance.contact;
            let crosses = found.iter().any(|meeting| match meeting {
                Meeting::Crossing { a, b, .. } => apart(at(first.curve, *a), at(second.curve, *b)),
                Meeting::Overlap { a, .. } => {
                    let p = at(first.curve, 0.5 * (a[0] + a[1]));
                    match &boundary[second.curve].path {
                        Path::Line(line) => line.nearest(p).1 > tolerance.contact,
                        Path::Traced(_) | Path::Section(_) | Path::Trim(_) => true,
                    }
                }
            });
            if crosses {
                return false;
            }
        }
    }
    work.undecided == 0
}
