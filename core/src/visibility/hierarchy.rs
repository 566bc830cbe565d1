//! The patches cut into regular cells, and a bounding hierarchy over the cells' screen boxes.

use alloc::borrow::Cow;
use alloc::boxed::Box;
use alloc::vec;
use alloc::vec::Vec;

use glam::{DVec2, DVec3, DVec4};

use super::leaf::{Degrees, Enclosure, Equations, Tolerances, Window, halve};
use super::pole::{Pole, poles};
use crate::stop::Stop;
use crate::trim::{Cover, Trims};
use crate::view::{MAX_DEGREE, Patch};

/// Lengths below this part of the scene's diagonal are not told apart: width of a border, depth of a contact. Coordinates
/// of CAD data agree along shared borders to some 1e-12 of the model; a pen draws 1e-4 of the sheet.
const RESOLUTION: f64 = 1e-9;

/// Bound of the relative rounding error of a coordinate that came through the camera and up to forty halvings.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// A cell that is not regular yet is halved this often when the hierarchy is built, in a scene of many patches; the rest is
/// done for the sight lines that need it. More would cost the construction what it saves a few thousand sight lines.
const LEAST_HALVINGS: u32 = 4;

/// The same in a scene of one patch, one less for each doubling of the number of patches.
const MOST_HALVINGS: u32 = 12;

/// How far round a cell, as part of its size, trim curves count as entering it: roots are found outside a cell by the
/// width of a border, 2 % of it at the most, and rounding.
const NEAR_CELL: f64 = 0.025;

/// Most leaves in one node.
const BUCKET: usize = 4;

/// What a query has to know of a patch beside itself.
#[derive(Clone, Debug)]
struct PatchInfo {
    index: usize,
    /// Index of its surface's trims in `Occluders::trims`.
    trims: Option<usize>,
    /// Most patches have none.
    poles: Option<Box<Poles>>,
}

/// For the sides u = 0, u = 1, v = 0, v = 1: the screen point (and nearest depth) on which the side collapses.
type Poles = [Option<Pole>; 4];

/// A patch as a query sees it.
#[derive(Clone, Copy)]
pub(super) struct Occluder<'a> {
    pub(super) patch: &'a Patch,
    info: &'a PatchInfo,
}

impl<'a> Occluder<'a> {
    /// Its index, as it was handed over.
    pub(super) fn index(self) -> usize {
        self.info.index
    }

    pub(super) fn degrees(self) -> Degrees {
        Degrees { p: self.patch.degree_u, q: self.patch.degree_v }
    }

    pub(super) fn poles(self) -> &'a Poles {
        const NONE: &Poles = &[None; 4];
        self.info.poles.as_deref().unwrap_or(NONE)
    }

    pub(super) fn to_surface(self, x: DVec2) -> DVec2 {
        self.patch.to_surface(x.x, x.y)
    }
}

/// A cell of a patch as it was left by the construction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Leaf {
    /// Index into `Occluders::patches`.
    pub(super) patch: usize,
    /// First control point in `Occluders::nets`; of a whole patch none, for its net is that of the patch.
    net: Option<u32>,
    pub(super) window: Window,
    pub(super) box_min: DVec2,
    pub(super) box_max: DVec2,
    pub(super) depth: [f64; 2],
    /// Whether a trim curve enters the cell, or comes near.
    pub(super) mixed: bool,
    /// For every sight line through the box, if the cell is regular for all of them.
    pub(super) regular: Option<Enclosure>,
}

impl Leaf {
    pub(super) fn centre(&self) -> DVec2 {
        0.5 * (self.box_min + self.box_max)
    }
}

/// A node of the hierarchy. Nodes are stored in preorder, so that a rejected subtree is skipped by one jump.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub(super) box_min: DVec2,
    pub(super) box_max: DVec2,
    pub(super) nearest: f64,
    /// The node that follows when this one is rejected or done.
    pub(super) next: u32,
    /// Range of leaves; empty in an inner node.
    pub(super) leaves: [u32; 2],
}

/// The surfaces of a scene prepared for the question *how many sheets lie in front of this point*.
///
/// Immutable once built and shared freely between threads; each thread brings its own [`RayScratch`](super::RayScratch).
/// About 0.5 kB of memory a cell for bicubic patches, some thirty to a hundred cells a patch; of a cell that is a whole patch less than half, for
/// it has the net of the patch.
#[derive(Clone, Debug)]
pub struct Occluders<'a> {
    all: Cow<'a, [Patch]>,
    patches: Vec<PatchInfo>,
    nets: Vec<DVec4>,
    pub(super) leaves: Vec<Leaf>,
    pub(super) nodes: Vec<Node>,
    pub(super) tolerances: Tolerances,
    pub(super) trims: Vec<Trims>,
    size: f64,
    left_out: usize,
}

impl Occluders<'static> {
    /// Prepares the patches. They are cut until each cell is proven to hold at most one root for every sight line
    /// through its screen box, or a fixed number of halvings is spent (on cells that hold a fold or a pole).
    ///
    /// Patches that project to a curve have no area and occlude nothing: they are left out, as are patches without
    /// a parameter direction (degree 0). The result depends on the order of the patches only through the order of
    /// equal hits. O(n log n) in the number of cells.
    #[must_use]
    pub fn new(patches: &[Patch], stop: Stop<'_>) -> Self {
        Occluders::trimmed(patches, &|_| None, usize::MAX, stop).into_owned()
    }
}

impl<'a> Occluders<'a> {
    /// These, with a copy of the patches if they are borrowed.
    #[must_use]
    pub fn into_owned(self) -> Occluders<'static> {
        let Self { all, patches, nets, leaves, nodes, tolerances, trims, size, left_out } = self;
        let all = Cow::Owned(all.into_owned());
        Occluders { all, patches, nets, leaves, nodes, tolerances, trims, size, left_out }
    }

    /// As [`new`](Occluders::new), of patches that are borrowed, with what `trims` says of a surface, by its index: cells that are cut off as a whole are
    /// left out, and in those that a trim curve enters each root is asked for (Elber and Cohen 1989, section 6, stage
    /// 2). There are no more cells than `most`, or one a patch if that is more; sight lines cut cells that are not regular
    /// further themselves.
    #[must_use]
    pub fn trimmed<'t>(
        patches: &'a [Patch],
        trims: &dyn Fn(usize) -> Option<&'t Trims>,
        most: usize,
        stop: Stop<'_>,
    ) -> Self {
        let (mut lo, mut hi, mut reach) = (DVec3::INFINITY, DVec3::NEG_INFINITY, 0.0_f64);
        for h in patches.iter().flat_map(|p| &p.points) {
            let x = h.truncate() / h.w;
            lo = lo.min(x);
            hi = hi.max(x);
            reach = reach.max(x.abs().max_element());
        }
        let size = if lo.x <= hi.x { (hi - lo).length() } else { 0.0 };
        let rounding = ROUNDING * reach;
        let tolerance = RESOLUTION * size + 16.0 * rounding;
        let tolerances = Tolerances { border: tolerance, contact: tolerance, rounding };
        let mut build = Self {
            all: Cow::Borrowed(patches),
            patches: Vec::with_capacity(patches.len()),
            nets: Vec::new(),
            // Room for a cell of each.
            leaves: Vec::with_capacity(patches.len()),
            nodes: Vec::new(),
            tolerances,
            trims: Vec::new(),
            size,
            left_out: 0,
        };
        let doublings = patches.len().max(1).ilog2();
        let halvings = MOST_HALVINGS.saturating_sub(doublings).max(LEAST_HALVINGS);
        let halvings = halvings.min((most / patches.len().max(1)).max(1).ilog2());
        let mut equations = Equations::EMPTY;
        let mut last = None;
        for (index, patch) in patches.iter().enumerate() {
            if stop.is_wanted() {
                break;
            }
            if has_area(patch, rounding) {
                if last != Some(patch.surface) {
                    build.trims.extend(trims(patch.surface).cloned());
                    last = Some(patch.surface);
                }
                let own = trims(patch.surface).map(|_| build.trims.len() - 1);
                build.add(index, patch, own, halvings, &mut equations);
            } else {
                build.left_out += 1;
            }
        }
        build.nets.shrink_to_fit();
        build.arrange();
        build
    }

    /// Diagonal of everything in view space, the unit of all tolerances; 0 for an empty scene.
    #[must_use]
    pub fn size(&self) -> f64 {
        self.size
    }

    /// Width of a border on the screen and of a contact in depth: 1e-9 of [`size`](Self::size), and not less than the
    /// rounding of the coordinates.
    #[must_use]
    pub fn resolution(&self) -> f64 {
        self.tolerances.border
    }

    /// Number of cells, and how many of them are regular for every sight line through their box.
    #[must_use]
    pub fn cells(&self) -> (usize, usize) {
        (self.leaves.len(), self.leaves.iter().filter(|l| l.regular.is_some()).count())
    }

    /// Number of patches without area on the screen, which occlude nothing.
    #[must_use]
    pub fn left_out(&self) -> usize {
        self.left_out
    }

    /// The patch that a cell is part of.
    pub(super) fn patch_of(&self, leaf: &Leaf) -> Occluder<'_> {
        self.occluder(leaf.patch)
    }

    fn occluder(&self, slot: usize) -> Occluder<'_> {
        let info = &self.patches[slot];
        Occluder { patch: &self.all[info.index], info }
    }

    /// The net of a cell.
    pub(super) fn net(&self, leaf: &Leaf) -> &[DVec4] {
        let patch = self.patch_of(leaf).patch;
        match leaf.net {
            Some(first) => &self.nets[first as usize..first as usize + patch.points.len()],
            None => &patch.points,
        }
    }

    /// The trims of the surface of a patch.
    pub(super) fn trims_of(&self, patch: Occluder<'_>) -> Option<&Trims> {
        patch.info.trims.map(|k| &self.trims[k])
    }

    /// How a cell of a patch lies to the trims, with what is so near to it that a root of the cell may be there.
    pub(super) fn cover(&self, patch: Occluder<'_>, window: Window) -> Cover {
        let Some(trims) = self.trims_of(patch) else { return Cover::Inside };
        let room = (window.hi - window.lo) * NEAR_CELL;
        trims.cover(patch.to_surface(window.lo - room), patch.to_surface(window.hi + room))
    }

    fn add(&mut self, index: usize, patch: &Patch, trims: Option<usize>, halvings: u32, equations: &mut Equations) {
        let degrees = Degrees { p: patch.degree_u, q: patch.degree_v };
        let n = degrees.len();
        let slot = self.patches.len();
        let poles = poles(patch, self.tolerances.rounding);
        let poles = poles.iter().any(Option::is_some).then(|| Box::new(poles));
        self.patches.push(PatchInfo { index, trims, poles });
        let mut nets = patch.points.clone();
        let mut windows = vec![Window::WHOLE];
        while let Some(window) = windows.pop() {
            let start = nets.len() - n;
            let cover = self.cover(self.occluder(slot), window);
            if cover == Cover::Outside {
                nets.truncate(start);
                continue;
            }
            let net = &mut nets[start..];
            let (box_min, box_max, depth) = bounds(net);
            let (centre, half) = (0.5 * (box_min + box_max), 0.5 * (box_max - box_min));
            let half = half + DVec2::splat(self.tolerances.border);
            equations.set(net, degrees, centre);
            let regular = equations
                .enclosure(net, half, &self.tolerances)
                .map(|e| Enclosure { contraction: equations.contraction(net, half, e.rows), ..e })
                .filter(Enclosure::is_regular);
            let [a, b] = window.depth;
            if regular.is_none() && u32::from(a) + u32::from(b) < halvings {
                let axis = equations.split_axis();
                let [lower, upper] = window.halves(axis);
                windows.extend([lower, upper]);
                nets.resize(start + 2 * n, DVec4::ZERO);
                let (net, rest) = nets[start..].split_at_mut(n);
                halve(net, rest, degrees, axis);
                continue;
            }
            let mixed = cover == Cover::Mixed;
            // Memory ends long before the numbers do.
            let own = (window.depth != [0, 0]).then_some(self.nets.len() as u32);
            let leaf = Leaf { patch: slot, net: own, window, box_min, box_max, depth, mixed, regular };
            self.leaves.push(leaf);
            if own.is_some() {
                self.nets.extend_from_slice(&nets[start..]);
            }
            nets.truncate(start);
        }
    }

    /// Builds the hierarchy by median splits and brings the leaves into its order.
    fn arrange(&mut self) {
        let mut order: Vec<u32> = (0..self.leaves.len() as u32).collect();
        // Close together, for they are compared again and again.
        let centres: Vec<DVec2> = self.leaves.iter().map(Leaf::centre).collect();
        self.node(&mut order, 0, &centres);
        drop(centres);
        permute(&mut self.leaves, &mut order);
        self.nodes.shrink_to_fit();
    }

    /// Appends the subtree over `order`, whose first leaf will have the position `first`.
    fn node(&mut self, order: &mut [u32], first: u32, centres: &[DVec2]) {
        let (mut box_min, mut box_max, mut nearest) = (DVec2::INFINITY, DVec2::NEG_INFINITY, f64::NEG_INFINITY);
        let (mut lo, mut hi) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for &k in order.iter() {
            let leaf = &self.leaves[k as usize];
            box_min = box_min.min(leaf.box_min);
            box_max = box_max.max(leaf.box_max);
            nearest = nearest.max(leaf.depth[1]);
            lo = lo.min(centres[k as usize]);
            hi = hi.max(centres[k as usize]);
        }
        let own = self.nodes.len();
        let border = DVec2::splat(self.tolerances.border);
        let count = order.len();
        let leaves = if count <= BUCKET { [first, first + count as u32] } else { [0, 0] };
        self.nodes.push(Node { box_min: box_min - border, box_max: box_max + border, nearest, next: 0, leaves });
        if count > BUCKET {
            let axis = usize::from(hi.y - lo.y > hi.x - lo.x);
            let middle = count / 2;
            order.select_nth_unstable_by(middle, |&a, &b| {
                let (x, y) = (centres[a as usize][axis], centres[b as usize][axis]);
                x.total_cmp(&y).then(a.cmp(&b))
            });
            let (left, right) = order.split_at_mut(middle);
            self.node(left, first, centres);
            self.node(right, first + middle as u32, centres);
        }
        self.nodes[own].next = self.nodes.len() as u32;
    }
}

/// Puts the item `order[k]` to the place `k`, in place, cycle by cycle. Leaves the order of what is sorted.
fn permute<T>(items: &mut [T], order: &mut [u32]) {
    for first in 0..order.len() {
        let mut here = first;
        loop {
            let from = order[here] as usize;
            order[here] = here as u32;
            if from == first {
                break;
            }
            items.swap(here, from);
            here = from;
        }
    }
}

/// Screen box and depth range of a net, by its control points.
fn bounds(net: &[DVec4]) -> (DVec2, DVec2, [f64; 2]) {
    let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for h in net {
        let x = h.truncate() / h.w;
        lo = lo.min(x);
        hi = hi.max(x);
    }
    (lo.truncate(), hi.truncate(), [lo.z, hi.z])
}

/// Whether the patch covers any area on the screen: F = det[(X, Y, W), (X, Y, W)ᵤ, (X, Y, W)ᵥ] does not vanish.
///
/// F is sampled at 3p × 3q points, more than its degree 3p − 1 by 3q − 1 leaves it zeros; it counts as zero where it is
/// below the error that rounded coordinates leave in it.
fn has_area(patch: &Patch, rounding: f64) -> bool {
    let (p, q) = (patch.degree_u, patch.degree_v);
    if p == 0 || q == 0 || p > MAX_DEGREE || q > MAX_DEGREE || patch.points.len() != (p + 1) * (q + 1) {
        return false;
    }
    let area = |i: usize, j: usize| {
        let s = (i as f64 + 0.5) / (3 * p) as f64;
        let t = (j as f64 + 0.5) / (3 * q) as f64;
        let jet = patch.jet(s, t);
        let (a, b) = (jet.du.truncate(), jet.dv.truncate());
        let noise = 4.0 * rounding * (p as f64 * b.abs().max_element() + q as f64 * a.abs().max_element());
        let noise = noise + 16.0 * rounding * rounding * (p * q) as f64;
        a.perp_dot(b).abs() > noise
    };
    (0..3 * p).any(|i| (0..3 * q).any(|j| area(i, j)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_come_into_any_order() {
        for order in [&[][..], &[0], &[1, 0], &[2, 0, 1, 3], &[4, 3, 0, 1, 2], &[0, 2, 1, 4, 3]] {
            let mut items: Vec<u32> = (0..order.len() as u32).collect();
            permute(&mut items, &mut order.to_vec());
            assert_eq!(items, order);
        }
    }
}
