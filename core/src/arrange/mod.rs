//! Curves split where their visibility can change: pieces.
//!
//! Along a curve the number of sheets in front changes only where an active curve (silhouette, boundary, crease) that is
//! nearer to the eye crosses it on the screen, where the curve meets the silhouette of its own surface, at its own
//! corners and cusps, and where it pierces another surface (Elber and Cohen 1989, lemma 2.5 and corollary 2.1; they
//! exclude piercing). Crossings are found by intersecting arcs, piercings by intersecting arcs and patches; places on the
//! curve's own surface come with the curve, from parameter space.

mod alongside;
mod arc;
mod cluster;
mod intersect;
mod meeting;
mod pierce;
pub mod region;

use alloc::vec::Vec;

use glam::{DVec2, DVec3, DVec4};

use crate::extract::{CurveKind, Geometry, Path, SurfaceCurve};
use crate::grid::Grid;
use crate::stitch::Stitching;
use crate::stop::Stop;
use crate::view::Patch;
pub use cluster::{Clusters, clusters};

use arc::{Arc, Control, screen, split_control};
use intersect::{Work, meetings, nearest};
use meeting::Meeting;
use pierce::Sheets;

/// Fractions of an interval at which an arc is compared with another one, or with a surface, to tell whether they
/// coincide: more places than the coordinates of two arcs of ordinary degree can agree at without being the same.
const PROBES: [f64; 9] = [0.06, 0.17, 0.28, 0.39, 0.5, 0.61, 0.72, 0.83, 0.94];

/// A part of a curve with one quantitative invisibility.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// Index of the curve.
    pub curve: usize,
    /// Interval of the curve's parameter.
    pub t: [f64; 2],
    /// The inked curve, nearer or first in order, that already draws the same line on the screen.
    pub covered_by: Option<usize>,
    /// Whether it runs along something not behind it on the screen, drawn or not.
    pub coincident: bool,
    /// What separates it from the piece before it on the curve; nothing at the beginning of the curve.
    pub entered: Vec<Cut>,
    /// Whether the piece begins, and ends, where the curve does and something splits it there, other than the edge of its
    /// own surface that it ends at: what continues the curve beyond its end may then have another invisibility.
    pub crossed: [bool; 2],
}

/// Why a curve is split at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cut {
    /// It meets the silhouette of its own surface there, or has a corner.
    Own,
    /// It goes through a surface that it does not belong to.
    Piercing,
    /// An active curve crosses it on the screen.
    Crossing {
        /// Index of the active curve.
        with: usize,
        /// The parameter of the active curve.
        at: f64,
        /// The active curve is nearer to the eye by more than what counts as a contact; else the two touch.
        nearer: bool,
    },
    /// It begins or ends to run along another curve.
    Overlap,
}

/// What arranging counted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ArrangeStats {
    /// Curves that came in.
    pub curves: u64,
    /// Pairs of arcs near enough to be intersected.
    pub pairs_near: u64,
    /// Pairs of arcs that were not, because they lie on one cluster of surfaces.
    pub pairs_clustered: u64,
    /// Halvings of arcs.
    pub subdivisions: u64,
    /// Newton steps.
    pub newton: u64,
    /// Crossings with something not behind.
    pub crossings: u64,
    /// Places where curves pierce surfaces that they do not belong to.
    pub piercings: u64,
    /// Intervals in which curves coincide on the screen.
    pub overlaps: u64,
    /// Pairs of arcs, or of an arc and a patch, whose subdivision came to no end; what they have in common may be
    /// missing.
    pub undecided: u64,
    /// Pieces that came out.
    pub pieces: u64,
}

/// Approximate length along one curve on the screen, piecewise linear in the curve parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct LengthTable {
    knots: Vec<(f64, f64)>,
}

impl LengthTable {
    /// Length from the beginning to the parameter `t`, screen units.
    #[must_use]
    pub fn length_at(&self, t: f64) -> f64 {
        let k = self.knots.partition_point(|n| n.0 <= t).clamp(1, self.knots.len() - 1);
        let ((t0, l0), (t1, l1)) = (self.knots[k - 1], self.knots[k]);
        if t1 > t0 { l0 + (l1 - l0) * ((t - t0) / (t1 - t0)).clamp(0.0, 1.0) } else { l0 }
    }

    /// The parameter at a length from the beginning.
    #[must_use]
    pub fn param_at(&self, length: f64) -> f64 {
        let k = self.knots.partition_point(|n| n.1 <= length).clamp(1, self.knots.len() - 1);
        let ((t0, l0), (t1, l1)) = (self.knots[k - 1], self.knots[k]);
        if l1 > l0 { t0 + (t1 - t0) * ((length - l0) / (l1 - l0)).clamp(0.0, 1.0) } else { t0 }
    }

    /// Whole length.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.knots[self.knots.len() - 1].1
    }
}

/// The pieces of all curves.
#[derive(Clone, Debug)]
pub struct Arrangement {
    /// Curve by curve, in the order of the parameter. A curve shorter than the resolution has none.
    pub pieces: Vec<Piece>,
    /// Length along each curve.
    pub lengths: Vec<LengthTable>,
    /// Counts.
    pub stats: ArrangeStats,
}

/// The curves as arcs, ready to be intersected.
#[derive(Clone, Debug)]
pub struct Arcs {
    arcs: Vec<Arc>,
    /// For each curve the index of its first arc; one more at the end.
    starts: Vec<usize>,
}

impl Arcs {
    /// Covers every curve with arcs: exact for isoparametric lines, within `fit` (screen units) for traced ones.
    #[must_use]
    pub fn new(curves: &[SurfaceCurve], geometry: &Geometry<'_>, fit: f64, stop: Stop<'_>) -> Self {
        let mut all = Self { arcs: Vec::new(), starts: alloc::vec![0] };
        all.extend(curves, 0, geometry, fit, stop);
        all
    }

    /// Adds the arcs of further curves, the first of which has the index `first`.
    pub fn extend(&mut self, curves: &[SurfaceCurve], first: usize, geometry: &Geometry<'_>, fit: f64, stop: Stop<'_>) {
        let Self { arcs, starts } = self;
        for (k, curve) in (first..).zip(curves) {
            if !stop.is_wanted() {
                cover_curve(curve, k, geometry, fit, arcs);
            }
            starts.push(arcs.len());
        }
    }

    /// Screen box of all curves: lower left and upper right corner. No curve leaves it by more than a
    /// millionth of its size and the error of its arcs, and it is no larger than the curves.
    ///
    /// Control polygons are halved only where they reach beyond what is known to be on a curve.
    #[must_use]
    pub fn extent(&self) -> [DVec2; 2] {
        let mut found = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        for arc in &self.arcs {
            let (p, q) = arc.ends();
            found = [found[0].min(p).min(q), found[1].max(p).max(q)];
        }
        // A picture that is one point has the rounding of its coordinates instead of a size.
        let rounding = 64.0 * f64::EPSILON * found[0].abs().max(found[1].abs()).max_element();
        let slack = DVec2::splat(rounding.max(EXTENT_SLACK * (found[1] - found[0]).max_element()));
        for arc in &self.arcs {
            widen(arc, slack, &mut found, 0);
        }
        found
    }

    /// The place of an active curve that is outermost in a direction on the screen: curve and parameter. None if places
    /// more than `apart` away from it in space are as far out, to within `margin`: they may lie in front of it.
    #[must_use]
    pub(crate) fn outermost(
        &self,
        curves: &[SurfaceCurve],
        direction: DVec2,
        margin: f64,
        apart: f64,
    ) -> Option<(usize, f64)> {
        let reach = |a: &Arc| a.points.iter().map(|h| screen(*h).dot(direction)).fold(f64::NEG_INFINITY, f64::max);
        let ends = |a: &Arc| a.ends().0.dot(direction).max(a.ends().1.dot(direction));
        let active = || self.arcs.iter().filter(|a| curves[a.curve].active);
        let mut known = active().map(ends).fold(f64::NEG_INFINITY, f64::max);
        let mut open: Vec<(Arc, u32)> =
            active().filter(|a| reach(a) >= known - margin).map(|a| (a.clone(), 0)).collect();
        let mut found: Vec<Arc> = Vec::new();
        while let Some((arc, depth)) = open.pop() {
            known = known.max(ends(&arc));
            let far = reach(&arc);
            if far < known - margin {
                continue;
            }
            // A control polygon nears its arc by a factor of four with each halving.
            if far - ends(&arc) <= margin || depth >= 20 {
                found.push(arc);
            } else {
                let (a, b) = arc.halves();
                open.extend([(a, depth + 1), (b, depth + 1)]);
            }
        }
        found.retain(|a| reach(a) >= known - margin);
        let best = found.iter().max_by(|a, b| ends(a).total_cmp(&ends(b)))?;
        let (lo, hi) = (best.lo.extend(best.z[0]), best.hi.extend(best.z[1]));
        let near = |a: &Arc| {
            let (low, high) = (a.lo.extend(a.z[0]), a.hi.extend(a.z[1]));
            (hi.max(high) - lo.min(low)).max_element() <= apart
        };
        let (p, q) = best.ends();
        let x = if p.dot(direction) >= q.dot(direction) { 0.0 } else { 1.0 };
        found.iter().all(near).then(|| (best.curve, best.param(x)))
    }

    fn of(&self, curve: usize) -> &[Arc] {
        &self.arcs[self.starts[curve]..self.starts[curve + 1]]
    }

    fn length_table(&self, curve: &SurfaceCurve, index: usize) -> LengthTable {
        let mut knots = Vec::with_capacity(self.of(index).len() + 1);
        knots.push((curve.domain[0], 0.0));
        let mut length = 0.0;
        for a in self.of(index) {
            let (p, q) = a.ends();
            length += (q - p).length();
            knots.push((a.t[1], length));
        }
        if knots.len() == 1 {
            knots.push((curve.domain[1], 0.0));
        }
        LengthTable { knots }
    }
}

/// Overhang that [`Arcs::extent`] leaves, of the size of the box: a third of a micrometre on a sheet of 300 mm.
const EXTENT_SLACK: f64 = 1e-6;

/// Widens `found` to hold `arc` up to `slack`. The polygon nears the arc by a factor of four with each halving, so ten of
/// them reach the slack; only halves that still reach beyond are followed.
fn widen(arc: &Arc, slack: DVec2, found: &mut [DVec2; 2], depth: u32) {
    const DEEPEST: u32 = 16;
    let beyond = |p: DVec2| p.cmplt(found[0] - slack).any() || p.cmpgt(found[1] + slack).any();
    if depth >= DEEPEST || !arc.points.iter().any(|h| beyond(screen(*h))) {
        return;
    }
    let (left, right) = arc.halves();
    let (_, middle) = left.ends();
    *found = [found[0].min(middle), found[1].max(middle)];
    widen(&left, slack, found, depth + 1);
    widen(&right, slack, found, depth + 1);
}

/// The arcs of one curve.
fn cover_curve(curve: &SurfaceCurve, index: usize, geometry: &Geometry<'_>, fit: f64, arcs: &mut Vec<Arc>) {
    match &curve.path {
        Path::Line(line) => {
            for span in &line.spans {
                let (a, b) = (span.t[0].max(curve.domain[0]), span.t[1].min(curve.domain[1]));
                if a < b {
                    let width = span.t[1] - span.t[0];
                    let all: Control = span.points.iter().copied().collect();
                    let (x, y) = ((a - span.t[0]) / width, (b - span.t[0]) / width);
                    let right = if x > 0.0 { split_control(&all, x).1 } else { all };
                    let part = if y < 1.0 { split_control(&right, (y - x) / (1.0 - x)).0 } else { right };
                    tame(Arc::new(index, [a, b], part, 0.0), fit, arcs, 0);
                }
            }
        }
        Path::Traced(_) | Path::Section(_) | Path::Trim(_) => {
            let fit = Fit { curve, index, geometry, tolerance: fit };
            let [a, b] = curve.domain;
            for segment in a as usize..libm::ceil(b) as usize {
                let (t0, t1) = (a.max(segment as f64), b.min((segment + 1) as f64));
                let ((p0, d0), (p1, d1)) = (curve.jet(geometry, t0), curve.jet_below(geometry, t1));
                fit.hermite((t0, p0, d0), (t1, p1, d1), arcs, 0);
            }
        }
    }
}

/// Halves an arc until it is tame.
fn tame(arc: Arc, point: f64, out: &mut Vec<Arc>, depth: u32) {
    const DEEPEST: u32 = 6;
    if depth >= DEEPEST || is_tame(&arc, point) {
        out.push(arc);
    } else {
        let (l, r) = arc.halves();
        tame(l, point, out, depth + 1);
        tame(r, point, out, depth + 1);
    }
}

/// Whether tangents stay within 45° of the chord, so that strips are thin and cone tests can succeed; or the arc is no
/// larger than `point`: a curve along the sight line has no direction on the screen that halving could bring out.
fn is_tame(arc: &Arc, point: f64) -> bool {
    arc.strip().spread <= 1.0 || (arc.hi - arc.lo).max_element() <= 2.0 * arc.error + point
}

/// A traced curve that is being covered by arcs.
struct Fit<'a> {
    curve: &'a SurfaceCurve,
    index: usize,
    geometry: &'a Geometry<'a>,
    tolerance: f64,
}

/// A parameter with position and derivative there.
type Node = (f64, DVec3, DVec3);

impl Fit<'_> {
    /// Cubic Hermite arcs within the tolerance between two places of one segment. The error falls with the fourth power
    /// of the length, so a few halvings reach any tolerance; it is measured at three inner points.
    fn hermite(&self, from: Node, to: Node, out: &mut Vec<Arc>, depth: u32) {
        const DEEPEST: u32 = 12;
        let ((t0, p0, d0), (t1, p1, d1)) = (from, to);
        let h = t1 - t0;
        let legs = [d0, d1].map(|d| leg(d * (h / 3.0), p1 - p0));
        let points = [p0, p0 + legs[0], p1 - legs[1], p1];
        let control: Control = points.iter().map(|p| DVec4::new(p.x, p.y, p.z, 1.0)).collect();
        let arc = Arc::new(self.index, [t0, t1], control, self.tolerance);
        let m = 0.5 * (t0 + t1);
        let (pm, dm) = self.curve.jet(self.geometry, m);
        // The middle first: there the error is largest, and the point serves the halves.
        let mut error = (arc.jet(0.5).0 - pm).length();
        let tame = is_tame(&arc, self.tolerance);
        // Where the curve is known less well than the tolerance, arcs cannot be better, however short.
        let enough = self.tolerance.max(self.curve.rounding(self.geometry, m));
        if (error <= enough && tame) || depth >= DEEPEST {
            for x in [0.25, 0.75] {
                error = error.max((arc.jet(x).0 - self.curve.point(self.geometry, t0 + x * h)).length());
            }
        }
        if depth >= DEEPEST || (error <= enough && tame) {
            out.push(Arc::new(self.index, [t0, t1], arc.points, self.tolerance.max(2.0 * error)));
        } else {
            self.hermite(from, (m, pm, dm), out, depth + 1);
            self.hermite((m, pm, dm), to, out, depth + 1);
        }
    }
}

/// A leg of a Hermite arc's control polygon, no longer than the chord on the screen and in space. The derivative of a
/// traced curve grows beyond all bounds towards a place where its independent parameter stands still, and means nothing
/// at a singular point. A monotone cubic has legs of its chord's length at most (Fritsch and Carlson 1980), so nothing is
/// lost on short arcs.
fn leg(tangent: DVec3, chord: DVec3) -> DVec3 {
    if !tangent.is_finite() {
        return chord / 3.0;
    }
    let bounded = |d: DVec2, most: f64| d.clamp_length_max(most.max(f64::MIN_POSITIVE));
    let flat = bounded(tangent.truncate(), chord.truncate().length());
    flat.extend(tangent.z.clamp(-chord.length(), chord.length()))
}

/// Below what lengths, in view space, things are one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Crossings nearer together than this are one, and curves within it of each other on the screen coincide.
    pub resolution: f64,
    /// A curve within this of a surface runs in it and does not pierce it.
    pub contact: f64,
}

/// Splits every curve; `patches` are those that can hide something (patches seen edge-on cannot). Every crossing farther
/// than the resolution from another, and at an angle that the arithmetic can see, is found. Cost: proportional to the
/// number of near pairs of arcs, and of arcs and patches.
#[must_use]
pub fn arrange(
    curves: &[SurfaceCurve],
    arcs: &Arcs,
    patches: &[&Patch],
    stitching: &Stitching,
    clusters: &Clusters,
    tolerance: Tolerance,
    stop: Stop<'_>,
) -> Arrangement {
    let active: Vec<Arc> = arcs.arcs.iter().filter(|a| curves[a.curve].active).cloned().collect();
    let grid = Grid::new(active.iter().map(|a| (a.lo, a.hi)));
    let sheets = Sheets::new(patches, stitching.joined_surfaces(), tolerance.contact);
    let splitter = Splitter { curves, arcs, active, grid, sheets, clusters, tolerance };
    let split = |index: usize| {
        let table = arcs.length_table(&curves[index], index);
        if stop.is_wanted() {
            return (Vec::new(), table, ArrangeStats::default());
        }
        let (pieces, stats) = splitter.split(index, &table);
        (pieces, table, stats)
    };
    #[cfg(feature = "parallel")]
    let parts: Vec<_> = {
        use rayon::prelude::*;
        (0..curves.len()).into_par_iter().map(split).collect()
    };
    #[cfg(not(feature = "parallel"))]
    let parts: Vec<_> = (0..curves.len()).map(split).collect();
    let mut stats = ArrangeStats { curves: curves.len() as u64, ..ArrangeStats::default() };
    let (mut pieces, mut lengths) = (Vec::new(), Vec::with_capacity(curves.len()));
    for (part, table, work) in parts {
        stats.pairs_near += work.pairs_near;
        stats.pairs_clustered += work.pairs_clustered;
        stats.subdivisions += work.subdivisions;
        stats.newton += work.newton;
        stats.crossings += work.crossings;
        stats.overlaps += work.overlaps;
        stats.piercings += work.piercings;
        stats.undecided += work.undecided;
        pieces.extend(part);
        lengths.push(table);
    }
    stats.pieces = pieces.len() as u64;
    Arrangement { pieces, lengths, stats }
}

/// An interval in which a curve coincides on the screen with another one.
struct Overlap {
    t: [f64; 2],
    with: usize,
    /// Whether the other curve draws the line: it is inked, and nearer or earlier in order.
    drawn: bool,
}

/// What two curves have in common on the screen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Intersection {
    /// Parameters of the two curves at each crossing. One at a joint of the subdivision may come up twice.
    pub crossings: Vec<[f64; 2]>,
    /// Intervals of the two curves' parameters in which they run within the resolution of each other.
    pub overlaps: Vec<[[f64; 2]; 2]>,
    /// Halvings of a curve.
    pub subdivisions: u64,
    /// Newton steps.
    pub newton: u64,
}

/// Intersects two rational Bézier curves, given by homogeneous control points with positive weights, on the screen: the
/// paper's algorithm (Elber and Cohen 1989, §4) by itself. Both have the parameter range 0 to 1. None if a degree is
/// above [`MAX_DEGREE`](crate::view::MAX_DEGREE) or a curve has no control points.
#[must_use]
pub fn intersect(a: &[DVec4], b: &[DVec4], resolution: f64) -> Option<Intersection> {
    let arc = |points: &[DVec4]| {
        let control = Control::from_slice(points).ok().filter(|c| !c.is_empty())?;
        Some(Arc::new(0, [0.0, 1.0], control, 0.0))
    };
    let (mut found, mut work) = (Vec::new(), Work::default());
    meetings(&arc(a)?, &arc(b)?, resolution, &mut found, &mut work);
    let mut out = Intersection { subdivisions: work.subdivisions, newton: work.newton, ..Intersection::default() };
    for meeting in found {
        match meeting {
            Meeting::Crossing { a, b, .. } => out.crossings.push([a, b]),
            Meeting::Overlap { a, b, .. } => out.overlaps.push([a, b]),
        }
    }
    Some(out)
}

/// Everything that curves are split by.
struct Splitter<'a> {
    curves: &'a [SurfaceCurve],
    arcs: &'a Arcs,
    /// The arcs of active curves, and where they are.
    active: Vec<Arc>,
    grid: Grid,
    sheets: Sheets,
    clusters: &'a Clusters,
    tolerance: Tolerance,
}

impl Splitter<'_> {
    fn split(&self, index: usize, table: &LengthTable) -> (Vec<Piece>, ArrangeStats) {
        let Self { curves, arcs, .. } = *self;
        let Tolerance { resolution, contact } = self.tolerance;
        let curve = &curves[index];
        let mut stats = ArrangeStats::default();
        let mut work = Work::default();
        let mut cuts: Vec<(f64, Cut)> = curve.splits.iter().map(|&t| (t, Cut::Own)).collect();
        let (mut overlaps, mut pierced) = (Vec::new(), Vec::new());
        let (mut near, mut found) = (Vec::new(), Vec::new());
        for arc in arcs.of(index) {
            stats.undecided += self.sheets.piercings(arc, &curve.surfaces, &mut pierced);
            let margin = DVec2::splat(resolution);
            self.grid.near(arc.lo - margin, arc.hi + margin, &mut near);
            for &k in &near {
                let other = &self.active[k as usize];
                // Arcs of one curve that follow one another meet at their joint only, the curve being smooth there.
                if other.curve == index && other.t[0] <= arc.t[1] && arc.t[0] <= other.t[1] {
                    continue;
                }
                if other.z[1] < arc.z[0] - resolution {
                    continue;
                }
                if (arc.lo - margin).cmpgt(other.hi).any() || (other.lo - margin).cmpgt(arc.hi).any() {
                    continue;
                }
                if self.clusters.share(&curve.surfaces, &curves[other.curve].surfaces) {
                    stats.pairs_clustered += 1;
                    continue;
                }
                stats.pairs_near += 1;
                found.clear();
                meetings(arc, other, resolution, &mut found, &mut work);
                for m in &found {
                    match *m {
                        Meeting::Crossing { a, b, za, zb } => {
                            // Touching counts: the curves then meet in space, and beyond the other one may turn away.
                            if zb >= za - resolution {
                                let nearer = zb > za + contact;
                                cuts.push((a, Cut::Crossing { with: other.curve, at: b, nearer }));
                                stats.crossings += 1;
                            }
                        }
                        Meeting::Overlap { a, za, zb, .. } => {
                            let theirs = (&curves[other.curve], arcs.of(other.curve));
                            if zb < za - resolution
                                || own_contact(curve, theirs, a, (arcs.of(index), table), self.tolerance)
                            {
                                continue;
                            }
                            let nearer = zb > za + resolution || !curve.active || other.curve < index;
                            let drawn = curves[other.curve].inked && nearer && other.curve != index;
                            overlaps.push(Overlap { t: [a[0].min(a[1]), a[0].max(a[1])], with: other.curve, drawn });
                        }
                    }
                }
            }
        }
        stats.subdivisions = work.subdivisions;
        stats.newton = work.newton;
        stats.undecided += work.undecided;
        let overlaps = merged(overlaps, table, resolution);
        stats.overlaps = overlaps.len() as u64;
        stats.piercings = pierced.len() as u64;
        cuts.extend(pierced.into_iter().map(|t| (t, Cut::Piercing)));
        cuts.extend(overlaps.iter().flat_map(|o| o.t).map(|t| (t, Cut::Overlap)));
        let is_own_edge = |k: usize| {
            let other = &curves[k];
            // A silhouette ends where another one continues it, in the next patch.
            let continues = matches!(curve.path, Path::Traced(_)) || other.kind != CurveKind::Silhouette;
            continues && other.surfaces.iter().any(|s| curve.surfaces.contains(s))
        };
        (cut(curve, index, table, cuts, &overlaps, resolution, is_own_edge), stats)
    }
}

/// Whether an overlap is the tangency of a curve with the silhouette of its own surface. Both then touch in space at a
/// place that is already known exactly, from parameter space, and run apart from there. Near a cusp another branch of the
/// silhouette may run as near on the screen, but that one is nearer to the eye, or farther.
fn own_contact(
    c: &SurfaceCurve,
    other: (&SurfaceCurve, &[Arc]),
    t: [f64; 2],
    (arcs, table): (&[Arc], &LengthTable),
    Tolerance { resolution, contact }: Tolerance,
) -> bool {
    if !matches!(other.0.path, Path::Traced(_)) || !c.surfaces.contains(&other.0.surface) {
        return false;
    }
    let (l0, l1) = (table.length_at(t[0].min(t[1])), table.length_at(t[0].max(t[1])));
    // A tangency of curvature 1/R stays within the resolution r for √(8 r R); R is at most the picture's size.
    let reach = libm::sqrt(8.0 * resolution * table.total()).max(l1 - l0);
    let near = |x: &&f64| (l0 - reach..=l1 + reach).contains(&table.length_at(**x));
    let touches = |&s: &f64| {
        let Some(p) = arcs.iter().find(|a| a.t[0] <= s && s <= a.t[1]).map(|a| a.at(s)) else { return false };
        other.1.iter().any(|arc| {
            let limit = 4.0 * resolution + 2.0 * arc.error;
            let margin = DVec2::splat(limit);
            let inside = p.truncate().cmpge(arc.lo - margin).all() && p.truncate().cmple(arc.hi + margin).all();
            inside && {
                let (x, distance) = nearest(arc, p.truncate());
                distance <= limit && (arc.jet(x).0.z - p.z).abs() <= contact
            }
        })
    };
    c.splits.iter().chain(&c.domain).filter(near).any(touches)
}

/// Overlaps with the same curve that follow one another, made one.
fn merged(mut overlaps: Vec<Overlap>, table: &LengthTable, resolution: f64) -> Vec<Overlap> {
    overlaps.sort_by(|x, y| (x.with, x.drawn).cmp(&(y.with, y.drawn)).then(x.t[0].total_cmp(&y.t[0])));
    let mut out: Vec<Overlap> = Vec::new();
    for o in overlaps {
        match out.last_mut() {
            Some(last)
                if (last.with, last.drawn) == (o.with, o.drawn)
                    && table.length_at(o.t[0]) <= table.length_at(last.t[1]) + 4.0 * resolution =>
            {
                last.t[1] = last.t[1].max(o.t[1]);
            }
            _ => out.push(o),
        }
    }
    out
}

/// Pieces between sorted cuts; cuts nearer together than the resolution are one.
fn cut(
    curve: &SurfaceCurve,
    index: usize,
    table: &LengthTable,
    mut cuts: Vec<(f64, Cut)>,
    overlaps: &[Overlap],
    resolution: f64,
    is_own_edge: impl Fn(usize) -> bool,
) -> Vec<Piece> {
    let [a, b] = curve.domain;
    if table.total() <= resolution {
        return Vec::new();
    }
    cuts.sort_by(|x, y| x.0.total_cmp(&y.0));
    let end = table.total();
    let least = 4.0 * resolution;
    let mut last = 0.0;
    let piece = |t: f64, entered: Vec<Cut>| Piece {
        curve: index,
        t: [t, b],
        covered_by: None,
        coincident: false,
        entered,
        crossed: [false; 2],
    };
    let mut pieces = Vec::with_capacity(cuts.len() + 1);
    pieces.push(piece(a, Vec::new()));
    for (t, cut) in cuts {
        let l = table.length_at(t);
        let touches = matches!(cut, Cut::Crossing { with, nearer: false, .. } if is_own_edge(with));
        if l >= end - least {
            if let Some(last) = pieces.last_mut() {
                last.crossed[1] |= !touches;
            }
            continue;
        }
        if l > last + least {
            if let Some(before) = pieces.last_mut() {
                before.t[1] = t;
            }
            pieces.push(piece(t, Vec::new()));
            last = l;
        }
        let first = pieces.len() == 1;
        if let Some(here) = pieces.last_mut() {
            // What is nearer to the beginning of the curve than the resolution separates nothing.
            if first {
                here.crossed[0] |= !touches;
            } else {
                here.entered.push(cut);
            }
        }
    }
    for p in &mut pieces {
        let m = 0.5 * (p.t[0] + p.t[1]);
        let here = || overlaps.iter().filter(|o| o.t[0] <= m && m <= o.t[1]);
        p.coincident = here().next().is_some();
        p.covered_by = here().filter(|o| o.drawn).map(|o| o.with).min();
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The quarter circle round (5, 3) from angle 45° to 135°, whose top is inside and whose control polygon is higher.
    fn quarter() -> Arcs {
        let c = libm::sqrt(0.5);
        let points = [(c, c, 1.0), (0.0, 2.0 * c, c), (-c, c, 1.0)].map(|(x, y, w)| {
            let middle = DVec2::new(5.0, 3.0);
            // The middle control point is at √2 above the centre, with weight cos 45°.
            let p = if w < 1.0 { middle + DVec2::new(0.0, y) } else { middle + DVec2::new(x, y) };
            DVec4::new(p.x * w, p.y * w, 0.0, w)
        });
        Arcs {
            arcs: alloc::vec![Arc::new(0, [0.0, 1.0], points.into_iter().collect(), 0.0)],
            starts: alloc::vec![0, 1],
        }
    }

    #[test]
    fn the_extent_is_that_of_the_curve_and_not_of_its_polygon() {
        let [lo, hi] = quarter().extent();
        let c = libm::sqrt(0.5);
        assert!((lo - DVec2::new(5.0 - c, 3.0 + c)).length() < 1e-14, "{lo}");
        assert!((hi.x - 5.0 - c).abs() < 1e-14 && (hi.y - 4.0).abs() < 2e-6 && hi.y <= 4.0 + 1e-15, "{hi}");
    }
}
