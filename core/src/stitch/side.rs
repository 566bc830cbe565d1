//! The boundary curves of surfaces: sides.

use alloc::vec;
use alloc::vec::Vec;

use glam::{DVec2, DVec3, DVec4};

use crate::line::{Axis, Line};
use crate::trim::BorderEdge;
use crate::trim_line::{TrimLine, TrimSpan};
use crate::view::{ViewScene, net_box};

/// How a side runs on its surface.
#[derive(Clone, Debug, PartialEq)]
pub enum SidePath {
    /// Along the border of the surface's parameter range.
    Line(Line),
    /// Along a trim curve.
    Trim(TrimLine),
}

impl SidePath {
    /// Index of the surface.
    #[must_use]
    pub fn surface(&self) -> usize {
        match self {
            Self::Line(line) => line.surface,
            Self::Trim(line) => line.surface,
        }
    }

    /// The line, if it is one of constant u or v.
    #[must_use]
    pub fn line(&self) -> Option<&Line> {
        match self {
            Self::Line(line) => Some(line),
            Self::Trim(_) => None,
        }
    }

    /// Interval of the parameter.
    #[must_use]
    pub fn domain(&self) -> [f64; 2] {
        match self {
            Self::Line(line) => line.domain(),
            Self::Trim(line) => line.domain(),
        }
    }

    /// Parameters at which its polynomial pieces begin, in increasing order, and the end.
    #[must_use]
    pub fn breaks(&self) -> Vec<f64> {
        let mut breaks: Vec<f64> = match self {
            Self::Line(line) => line.spans.iter().map(|s| s.t[0]).collect(),
            Self::Trim(line) => (0..line.spans.len()).map(|k| k as f64).collect(),
        };
        breaks.push(self.domain()[1]);
        breaks
    }

    /// Surface parameters at `t`.
    #[must_use]
    pub fn uv(&self, t: f64) -> DVec2 {
        match self {
            Self::Line(line) => line.uv(t),
            Self::Trim(line) => line.uv(t),
        }
    }

    /// The patch at `t` on the side's surface, and the local parameters in it.
    #[must_use]
    pub fn place(&self, view: &ViewScene, t: f64) -> (usize, DVec2) {
        match self {
            Self::Line(line) => line.place(t),
            Self::Trim(line) => line.place(view, t),
        }
    }

    /// Position in view space at `t`.
    #[must_use]
    pub fn point(&self, view: &ViewScene, t: f64) -> DVec3 {
        match self {
            Self::Line(line) => line.point(t),
            Self::Trim(line) => line.point(view, t),
        }
    }

    /// Position and derivative in view space at `t`.
    #[must_use]
    pub fn jet(&self, view: &ViewScene, t: f64) -> (DVec3, DVec3) {
        match self {
            Self::Line(line) => line.jet(t),
            Self::Trim(line) => line.jet(view, t),
        }
    }

    /// Nearest point to `p` in view space: parameter and distance.
    #[must_use]
    pub fn nearest(&self, view: &ViewScene, p: DVec3) -> (f64, f64) {
        match self {
            Self::Line(line) => line.nearest(p),
            Self::Trim(line) => line.nearest(view, p),
        }
    }
}

/// A boundary curve of a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Side {
    /// The curve.
    pub path: SidePath,
    /// Intervals of its parameter in which the surface ends there: all of it, unless the surface is trimmed.
    pub kept: Vec<[f64; 2]>,
    /// Parts of it that are sides of shared edges, in no order.
    pub shared: Vec<BorderEdge>,
    /// Whether it is a single point (a pole).
    pub collapsed: bool,
    pub(super) lo: DVec3,
    pub(super) hi: DVec3,
    /// Its ends if it is known to be straight.
    pub(super) straight: Option<[DVec3; 2]>,
}

impl Side {
    /// The four borders of a surface's parameter range: u low, u high, v low, v high. What is no longer than `distance`
    /// is a point.
    pub(super) fn borders(view: &ViewScene, surface: usize, distance: f64) -> Vec<Self> {
        let grid = &view.surfaces()[surface];
        let (u, v) = (&grid.u_breaks, &grid.v_breaks);
        [
            (Axis::U, u[0], false),
            (Axis::U, u[u.len() - 1], true),
            (Axis::V, v[0], false),
            (Axis::V, v[v.len() - 1], true),
        ]
        .into_iter()
        .zip(view.border_edges(surface))
        .map(|((axis, value, below), shared)| {
            let line = Line::new(view, surface, axis, value, below);
            let (lo, hi) = line
                .spans
                .iter()
                .map(|s| net_box(&s.points))
                .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), (low, high)| (lo.min(low), hi.max(high)));
            let collapsed = line.length_bound() <= distance;
            let kept = match view.trims(surface) {
                Some(trims) => trims.kept_on_border(axis, value),
                None => vec![line.domain()],
            };
            let straight = match &line.spans[..] {
                [span] => <[DVec4; 2]>::try_from(&span.points[..]).ok().map(|ends| ends.map(|h| h.truncate() / h.w)),
                _ => None,
            };
            Self { path: SidePath::Line(line), kept, shared: shared.clone(), collapsed, lo, hi, straight }
        })
        .collect()
    }

    /// A trim line as a side. What is no larger than `distance` is a point.
    pub(super) fn trimmed(view: &ViewScene, line: TrimLine, distance: f64) -> Self {
        let (lo, hi) = line.bounds(view);
        let kept = vec![line.domain()];
        let side = |(k, span): (usize, &TrimSpan)| {
            let edge = span.piece.edge()?;
            Some(BorderEdge { t: [k as f64, (k + 1) as f64], edge })
        };
        let shared = line.spans.iter().enumerate().filter_map(side).collect();
        Self {
            path: SidePath::Trim(line),
            kept,
            shared,
            collapsed: (hi - lo).length() <= distance,
            lo,
            hi,
            straight: None,
        }
    }

    /// Whether `p` is as near as `distance` to the box of the boundary curve: else it is farther from the curve.
    pub(super) fn may_hold(&self, p: DVec3, distance: f64) -> bool {
        let margin = DVec3::splat(distance);
        p.cmpge(self.lo - margin).all() && p.cmple(self.hi + margin).all()
    }

    /// Parameters at which a coincidence with another side can begin or end: the joints of its polynomial pieces, where
    /// it is cut off, and the ends. In increasing order.
    pub(super) fn changes(&self) -> Vec<f64> {
        let mut all = self.path.breaks();
        all.extend(self.kept.iter().flatten());
        all.extend(self.shared.iter().flat_map(|s| s.t));
        all.sort_by(f64::total_cmp);
        all.dedup();
        all
    }

    /// Whether the surface ends along a part of it, and not in a point.
    pub(super) fn is_edge(&self) -> bool {
        !self.collapsed && !self.kept.is_empty()
    }

    /// The shared edge of which the boundary at `t` is a side; within rounding of where two of them meet, either.
    pub(super) fn edge_at(&self, t: f64) -> Option<u32> {
        self.shared.iter().find(|s| s.t[0] <= t && t <= s.t[1]).map(|s| s.edge)
    }

    /// Whether the surface ends there at `t`.
    #[must_use]
    pub fn is_kept(&self, t: f64) -> bool {
        self.kept.iter().any(|k| k[0] <= t && t <= k[1])
    }
}
