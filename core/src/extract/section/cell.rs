//! Parts of patches, as the search for intersections cuts them.

use alloc::vec::Vec;

use glam::{DVec2, DVec3, DVec4};

use crate::view::{Patch, net_box, net_extent, net_jet};

/// A part of a patch: its control net, and where it is in the patch.
#[derive(Clone, Debug)]
pub(super) struct Cell {
    degree: [usize; 2],
    points: Vec<DVec4>,
    /// Corners in local parameters of the patch.
    pub(super) from: DVec2,
    pub(super) to: DVec2,
    pub(super) lo: DVec3,
    pub(super) hi: DVec3,
}

/// The plane through a cell, and how far the cell is from being it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slab {
    pub(super) origin: DVec3,
    pub(super) normal: DVec3,
    /// Extent of the net along the normal, from the origin.
    pub(super) height: [f64; 2],
    /// Length of the cell across, in the direction in which it is shorter.
    pub(super) width: f64,
}

impl Cell {
    pub(super) fn new(patch: &Patch) -> Self {
        Self::of([patch.degree_u, patch.degree_v], patch.points.clone(), DVec2::ZERO, DVec2::ONE)
    }

    fn of(degree: [usize; 2], points: Vec<DVec4>, from: DVec2, to: DVec2) -> Self {
        let (lo, hi) = net_box(&points);
        Self { degree, points, from, to, lo, hi }
    }

    fn corner(&self, high_u: bool, high_v: bool) -> DVec3 {
        let (p, q) = (self.degree[0], self.degree[1]);
        let h = self.points[if high_u { p * (q + 1) } else { 0 } + if high_v { q } else { 0 }];
        h.truncate() / h.w
    }

    /// Lengths in u and in v.
    fn extent(&self) -> [f64; 2] {
        let [a, b, c, d] = [(false, false), (true, false), (false, true), (true, true)].map(|(u, v)| self.corner(u, v));
        [a.distance(b).max(c.distance(d)), a.distance(c).max(b.distance(d))]
    }

    pub(super) fn size(&self) -> f64 {
        self.lo.distance(self.hi)
    }

    /// The two parts along the longer direction.
    pub(super) fn parts(&self) -> [Self; 2] {
        let [u, v] = self.extent();
        let along_u = u >= v;
        let (low, high) = split_net(&self.points, self.degree, along_u);
        let middle = self.from + RATIO * (self.to - self.from);
        let (mut to, mut from) = (self.to, self.from);
        if along_u {
            (to.x, from.x) = (middle.x, middle.x);
        } else {
            (to.y, from.y) = (middle.y, middle.y);
        }
        [Self::of(self.degree, low, self.from, to), Self::of(self.degree, high, from, self.to)]
    }

    /// Position and derivatives by the cell's own parameters.
    pub(super) fn jet(&self, at: DVec2) -> [DVec3; 3] {
        let [h, hu, hv] = net_jet(&self.points, self.degree[0], self.degree[1], at.x, at.y);
        let p = h.truncate() / h.w;
        [p, (hu.truncate() - p * hu.w) / h.w, (hv.truncate() - p * hv.w) / h.w]
    }

    /// None where the cell has no tangent plane in its middle.
    pub(super) fn slab(&self) -> Option<Slab> {
        let [origin, du, dv] = self.jet(DVec2::splat(0.5));
        let normal = du.cross(dv).try_normalize()?;
        let [u, v] = self.extent();
        Some(Slab { origin, normal, height: self.along(origin, normal), width: u.min(v) })
    }

    /// Control points of the border on which a parameter (0 for u, 1 for v) is at its low or high end.
    pub(super) fn border(&self, parameter: usize, high: bool) -> impl Iterator<Item = DVec3> {
        let (p, q) = (self.degree[0], self.degree[1]);
        let (first, step, count) = match (parameter, high) {
            (0, false) => (0, 1, q + 1),
            (0, true) => (p * (q + 1), 1, q + 1),
            (_, false) => (0, q + 1, p + 1),
            (_, true) => (q, q + 1, p + 1),
        };
        (0..count).map(move |k| self.points[first + k * step]).map(|h| h.truncate() / h.w)
    }

    /// Extent of the net along `n` from `origin`.
    pub(super) fn along(&self, origin: DVec3, n: DVec3) -> [f64; 2] {
        net_extent(&self.points, origin, n)
    }

    /// Local parameters of the patch at the cell's own.
    pub(super) fn local(&self, at: DVec2) -> DVec2 {
        self.from + at * (self.to - self.from)
    }

    /// Whether the box of another cell meets this one's.
    pub(super) fn is_near(&self, other: &Self) -> bool {
        !(self.lo.cmpgt(other.hi).any() || other.lo.cmpgt(self.hi).any())
    }
}

/// Where cells are cut: not in the middle, for models are symmetric, and what lies on a border has to be found twice.
const RATIO: f64 = 0.4871;

/// The nets of the two parts of a cell.
fn split_net(points: &[DVec4], [p, q]: [usize; 2], along_u: bool) -> (Vec<DVec4>, Vec<DVec4>) {
    let (mut low, mut high) = (points.to_vec(), points.to_vec());
    let (n, count, step, next) = if along_u { (p, q + 1, q + 1, 1) } else { (q, p + 1, 1, q + 1) };
    for line in 0..count {
        let at = |k: usize| line * next + k * step;
        // De Casteljau in place: row r leaves the next point of the lower part in front.
        for r in 0..=n {
            low[at(r)] = high[at(0)];
            for k in 0..n - r {
                high[at(k)] = high[at(k)].lerp(high[at(k + 1)], RATIO);
            }
        }
    }
    (low, high)
}

impl Slab {
    pub(super) fn thickness(&self) -> f64 {
        self.height[1] - self.height[0]
    }
}
