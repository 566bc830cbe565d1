//! Clusters: connected surfaces of one self-visible type that, seen one-to-one, cannot hide one another (Ruan, Zhang and
//! Yong 2006, §4).
//!
//! A surface that faces one way all over is joined to a neighbour that does so too where the two lie on either side of
//! their common edge on the screen: there the projection goes on one-to-one from the one to the other. What is joined so
//! is an immersion of a surface in the plane, and need not be one-to-one as a whole (a spiral staircase). It is where
//! its projected boundary does not intersect itself; the proof is that of [`region`](super::region).
//!
//! Two curves of one cluster cross on the screen only where they meet in space, so that neither hides the other.

use alloc::vec;
use alloc::vec::Vec;

use super::Arcs;
use super::intersect::Work;
use super::region::meets_itself;
use crate::extract::facing::Facing;
use crate::extract::{CurveKind, Geometry, Path, SurfaceCurve, lies_left};
use crate::grid::Grid;
use crate::stitch::{Edge, Stitching};
use crate::stop::Stop;

/// Which surfaces cannot hide one another.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Clusters {
    /// For each surface the cluster that it is part of, if any.
    of: Vec<Option<usize>>,
    /// Number of clusters.
    count: usize,
}

impl Clusters {
    /// No surface is part of any.
    #[must_use]
    pub fn none() -> Self {
        Self::default()
    }

    /// Number of clusters.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// Number of surfaces that are part of one.
    #[must_use]
    pub fn members(&self) -> usize {
        self.of.iter().flatten().count()
    }

    /// Whether two curves, given by the surfaces that they lie on, lie on one cluster.
    pub(super) fn share(&self, a: &[usize], b: &[usize]) -> bool {
        let of = |s: &usize| self.of.get(*s).copied().flatten();
        a.iter().filter_map(of).any(|k| b.iter().filter_map(of).any(|l| k == l))
    }
}

/// Tolerances, in view units: crossings on the screen are resolved to `resolution`, and pieces of a boundary nearer than
/// `contact` in space are one curve.
///
/// Cost: the boundaries of the clusters intersected with themselves.
#[must_use]
pub fn clusters(g: &Geometry<'_>, stitching: &Stitching, resolution: f64, contact: f64, stop: Stop<'_>) -> Clusters {
    let surfaces = g.view.surfaces();
    let faces_one_way = |k: usize| {
        let grid = &surfaces[k];
        let all = grid.first..grid.first + grid.count_u() * grid.count_v();
        let facing = g.forms[grid.first].facing;
        matches!(facing, Facing::Front | Facing::Back) && all.clone().all(|p| g.forms[p].facing == facing)
    };
    let plain: Vec<bool> = (0..surfaces.len()).map(faces_one_way).collect();
    // Surfaces joined so far, each by its lowest one.
    let mut root: Vec<usize> = (0..surfaces.len()).collect();
    fn find(root: &mut [usize], mut k: usize) -> usize {
        while root[k] != k {
            root[k] = root[root[k]];
            k = root[k];
        }
        k
    }
    let goes_on = |edge: &Edge| -> Option<[usize; 2]> {
        let [partner] = edge.partners[..] else { return None };
        let (a, b) = (&stitching.sides[edge.side].line, &stitching.sides[partner].line);
        let pair = [a.surface, b.surface];
        (pair.iter().all(|&s| plain[s]) && is_passed(g, edge.t, a, b)).then_some(pair)
    };
    let inner: Vec<bool> = stitching
        .edges
        .iter()
        .map(|edge| {
            let Some([a, b]) = goes_on(edge) else { return false };
            let (a, b) = (find(&mut root, a), find(&mut root, b));
            root[a.max(b)] = a.min(b);
            true
        })
        .collect();
    let mut boundaries: Vec<Vec<SurfaceCurve>> = vec![Vec::new(); surfaces.len()];
    for (edge, inner) in stitching.edges.iter().zip(inner) {
        let line = &stitching.sides[edge.side].line;
        if plain[line.surface] && !inner {
            let k = find(&mut root, line.surface);
            boundaries[k].push(SurfaceCurve {
                kind: CurveKind::Boundary,
                surface: line.surface,
                surfaces: vec![line.surface],
                path: Path::Line(line.clone()),
                domain: edge.t,
                active: true,
                inked: false,
                sides: Vec::new(),
                splits: Vec::new(),
            });
        }
    }
    let mut cluster: Vec<Option<usize>> = vec![None; surfaces.len()];
    let mut count = 0;
    for (k, boundary) in boundaries.iter().enumerate() {
        if stop.is_wanted() {
            break;
        }
        if plain[k] && find(&mut root, k) == k && is_simple(g, boundary, resolution, contact) {
            cluster[k] = Some(count);
            count += 1;
        }
    }
    let of = (0..surfaces.len()).map(|s| if plain[s] { cluster[find(&mut root, s)] } else { None });
    Clusters { of: of.collect(), count }
}

/// Whether two surfaces lie on either side of a part of their common edge on the screen. Each faces one way, so that one
/// place tells.
fn is_passed(g: &Geometry<'_>, t: [f64; 2], a: &crate::line::Line, b: &crate::line::Line) -> bool {
    let middle = 0.5 * (t[0] + t[1]);
    let (p, along) = a.jet(middle);
    let at = b.nearest(p).0;
    let theirs = lies_left(g, b, at);
    let theirs = if along.dot(b.jet(at).1) < 0.0 { -theirs } else { theirs };
    lies_left(g, a, middle) * theirs < 0
}

/// Whether a boundary meets itself on the screen only where it does so in space.
fn is_simple(g: &Geometry<'_>, boundary: &[SurfaceCurve], resolution: f64, contact: f64) -> bool {
    let arcs = Arcs::new(boundary, g, resolution, Stop::NEVER);
    let grid = Grid::new(arcs.arcs.iter().map(|a| (a.lo, a.hi)));
    let (mut near, mut found, mut work) = (Vec::new(), Vec::new(), Work::default());
    for (k, arc) in arcs.arcs.iter().enumerate() {
        grid.near(arc.lo, arc.hi, &mut near);
        for &other in near.iter().filter(|&&other| other as usize > k) {
            let other = &arcs.arcs[other as usize];
            if meets_itself(g, boundary, [arc, other], resolution, contact, &mut found, &mut work) {
                return false;
            }
        }
    }
    work.undecided == 0
}
