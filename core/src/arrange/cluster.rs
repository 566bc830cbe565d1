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

use super::Tolerance;
use super::region::{boundary_curve, is_simple};
use crate::disjoint::Disjoint;
use crate::extract::facing::Facing;
use crate::extract::{Geometry, SurfaceCurve, lies_left, lies_left_along};
use crate::line::Line;
use crate::stitch::{Edge, Stitching};
use crate::stop::Stop;

/// Which surfaces cannot hide one another.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Clusters {
    /// For each surface the cluster that it is part of, if any.
    of: Vec<Option<usize>>,
}

impl Clusters {
    /// No surface is part of any.
    #[must_use]
    pub fn none() -> Self {
        Self::default()
    }

    /// Whether two curves, given by the surfaces that they lie on, lie on one cluster.
    pub(super) fn share(&self, a: &[usize], b: &[usize]) -> bool {
        let of = |s: &usize| self.of.get(*s).copied().flatten();
        a.iter().filter_map(of).any(|k| b.iter().filter_map(of).any(|l| k == l))
    }
}

/// The clusters of a scene. Pieces of a boundary nearer than a contact in space are one curve. Cost: the boundaries of the clusters intersected with themselves.
#[must_use]
pub fn clusters(g: &Geometry<'_>, stitching: &Stitching, tolerance: Tolerance, stop: Stop<'_>) -> Clusters {
    let surfaces = g.view.surfaces();
    let faces_one_way = |k: usize| {
        let grid = &surfaces[k];
        let all = grid.first..grid.first + grid.count_u() * grid.count_v();
        let facing = g.forms[grid.first].facing;
        let whole = g.view.trims(k).is_none();
        whole && matches!(facing, Facing::Front | Facing::Back) && all.clone().all(|p| g.forms[p].facing == facing)
    };
    let plain: Vec<bool> = (0..surfaces.len()).map(faces_one_way).collect();
    // Surfaces joined so far, each by its lowest one.
    let mut joined = Disjoint::new(surfaces.len());
    let goes_on = |edge: &Edge| -> Option<[usize; 2]> {
        let [partner] = edge.partners[..] else { return None };
        let [Some(a), Some(b)] = [edge.side, partner].map(|s| stitching.sides[s].path.line()) else { return None };
        let pair = [a.surface, b.surface];
        (pair.iter().all(|&s| plain[s]) && is_passed(g, edge.t, a, b)).then_some(pair)
    };
    let inner: Vec<bool> = stitching
        .edges
        .iter()
        .map(|edge| {
            let Some([a, b]) = goes_on(edge) else { return false };
            joined.join(a, b);
            true
        })
        .collect();
    let mut boundaries: Vec<Vec<SurfaceCurve>> = vec![Vec::new(); surfaces.len()];
    for (edge, inner) in stitching.edges.iter().zip(inner) {
        let Some(line) = stitching.sides[edge.side].path.line() else { continue };
        if plain[line.surface] && !inner {
            let k = joined.root(line.surface);
            boundaries[k].push(boundary_curve(line.clone(), edge.t));
        }
    }
    let mut cluster: Vec<Option<usize>> = vec![None; surfaces.len()];
    for (k, boundary) in boundaries.iter().enumerate() {
        if stop.is_wanted() {
            break;
        }
        if plain[k] && joined.root(k) == k && is_simple(g, boundary, tolerance) {
            cluster[k] = Some(k);
        }
    }
    let of = (0..surfaces.len()).map(|s| if plain[s] { cluster[joined.root(s)] } else { None });
    Clusters { of: of.collect() }
}

/// Whether two surfaces lie on either side of a part of their common edge on the screen. Each faces one way, so that one
/// place tells.
fn is_passed(g: &Geometry<'_>, t: [f64; 2], a: &Line, b: &Line) -> bool {
    let middle = 0.5 * (t[0] + t[1]);
    let (p, along) = a.jet(middle);
    lies_left(g, a, middle) * lies_left_along(g, b, b.nearest(p).0, along) < 0
}
