//! Curves split where their visibility can change: pieces.
//!
//! Along a curve the number of sheets in front changes only where an active curve (silhouette, boundary, crease) that is
//! nearer to the eye crosses it on the screen, where the curve meets the silhouette of its own surface, at its own
//! corners and cusps, and where it pierces another surface (Elber and Cohen 1989, lemma 2.5 and corollary 2.1; they
//! exclude piercing). Crossings are found by intersecting arcs, piercings by intersecting arcs and patches; places on the
//! curve's own surface come with the curve, from parameter space.

mod alongside;
mod arc;
mod arcs;
mod cluster;
mod cover;
mod division;
mod intersect;
mod meeting;
mod pierce;
pub mod region;
mod run;

use alloc::vec::Vec;

use glam::{DVec2, DVec4};

use crate::extract::{CurveKind, Path, SurfaceCurve};
use crate::grid::Grid;
use crate::stitch::Stitching;
use crate::stop::Stop;
use crate::view::Patch;
pub use arcs::{Arcs, CurveArcs};
pub use cluster::{Clusters, clusters};

use arc::{Arc, Control};
use division::Recent;
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
    /// The inked curve, nearer or first in order, that already draws the same line on the screen: another one, or this one in
    /// another piece.
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

/// Approximate length along one curve on the screen, piecewise linear in the curve parameter. Where the curve is longer than
/// the resolution, lengths between places are right to a factor of two and a half, however unevenly the parameter runs.
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
    arcs: CurveArcs<'_>,
    patches: &[&Patch],
    stitching: &Stitching,
    clusters: &Clusters,
    tolerance: Tolerance,
    stop: Stop<'_>,
) -> Arrangement {
    let curves = arcs.curves;
    let active = Active::new(arcs);
    let grid = Grid::new(active.iter().map(|a| (a.lo, a.hi)));
    let of_surfaces = arcs.iter().map(|arc| (curves[arc.curve].surface, arc));
    let sheets = Sheets::new(patches, of_surfaces, stitching.joined_surfaces(), tolerance.contact);
    let splitter = Splitter { arcs, active, grid, sheets, clusters, tolerance };
    let split = |recent: &mut Recent, index: usize| {
        let table = arcs.length_table(index, tolerance.resolution);
        if stop.is_wanted() {
            return (Vec::new(), table, ArrangeStats::default());
        }
        let (pieces, stats) = splitter.split(index, &table, recent);
        (pieces, table, stats)
    };
    #[cfg(feature = "parallel")]
    let parts: Vec<_> = {
        use rayon::prelude::*;
        (0..curves.len()).into_par_iter().map_init(Recent::default, split).collect()
    };
    // One after the other, so that what is found is in memory once.
    #[cfg(not(feature = "parallel"))]
    let parts = {
        let mut recent = Recent::default();
        (0..curves.len()).map(move |index| split(&mut recent, index))
    };
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
    // What is not needed any more goes first: the pieces may have to be moved.
    drop(splitter);
    pieces.shrink_to_fit();
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

/// The arcs of active curves, counted through.
struct Active<'a> {
    arcs: CurveArcs<'a>,
    /// Each active curve, and how many arcs those before it have.
    curves: Vec<(usize, usize)>,
}

impl<'a> Active<'a> {
    fn new(arcs: CurveArcs<'a>) -> Self {
        let mut before = 0;
        let active = (0..arcs.curves.len()).filter(|&k| arcs.curves[k].active).map(|curve| {
            let here = before;
            before += arcs.count(curve);
            (curve, here)
        });
        Self { curves: active.collect(), arcs }
    }

    fn iter(&self) -> impl Iterator<Item = Arc> + Clone {
        self.curves.iter().flat_map(|&(curve, _)| self.arcs.of(curve))
    }

    fn get(&self, k: usize, recent: &mut Recent) -> Option<Arc> {
        let last = self.curves.partition_point(|&(_, before)| before <= k).checked_sub(1)?;
        let (curve, before) = *self.curves.get(last)?;
        recent.arc(self.arcs, (curve, k - before), k)
    }
}

/// Everything that curves are split by.
struct Splitter<'a> {
    arcs: CurveArcs<'a>,
    /// The arcs of active curves, and where they are.
    active: Active<'a>,
    grid: Grid,
    sheets: Sheets<'a>,
    clusters: &'a Clusters,
    tolerance: Tolerance,
}

impl Splitter<'_> {
    fn split(&self, index: usize, table: &LengthTable, recent: &mut Recent) -> (Vec<Piece>, ArrangeStats) {
        let arcs = self.arcs;
        let curves = arcs.curves;
        let Tolerance { resolution, contact } = self.tolerance;
        let curve = &curves[index];
        let mut stats = ArrangeStats::default();
        let mut work = Work::default();
        let mut cuts: Vec<(f64, Cut)> = curve.splits.iter().map(|&t| (t, Cut::Own)).collect();
        let (mut overlaps, mut pierced) = (Vec::new(), Vec::new());
        let (mut near, mut found) = (Vec::new(), Vec::new());
        for arc in arcs.of(index) {
            let arc = &arc;
            stats.undecided += self.sheets.piercings(arc, &curve.surfaces, &mut pierced);
            let margin = DVec2::splat(resolution);
            self.grid.near(arc.lo - margin, arc.hi + margin, &mut near);
            for &k in &near {
                let Some(other) = &self.active.get(k as usize, recent) else { continue };
                // Arcs of one curve that follow one another meet at their joint only, the curve being smooth there; unless it
                // runs along the sight line there and comes back beside itself.
                let follows = other.curve == index && other.t[0] <= arc.t[1] && arc.t[0] <= other.t[1];
                if follows && arc.chord().dot(other.chord()) >= 0.0 {
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
                                let end = self.end_at(index, table, (arc, a), (other, b));
                                let nearer = end.is_none() && zb > za + contact;
                                let cut = Cut::Crossing { with: other.curve, at: b, nearer };
                                cuts.push((end.unwrap_or(a), cut));
                                stats.crossings += 1;
                            }
                        }
                        Meeting::Overlap { a, za, zb, .. } => {
                            if zb < za - resolution || self.own_contact((index, table), other.curve, a) {
                                continue;
                            }
                            // Of a curve that comes back along itself, seen edge-on, the nearer part is drawn, or the first.
                            let before = if other.curve == index { other.t[0] < arc.t[0] } else { other.curve < index };
                            let nearer = zb > za + resolution || !curve.active || before;
                            let drawn = curves[other.curve].inked && nearer;
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

/// Least sine of the angle between a curve and the edge that it ends in at which a crossing of the two is told from its end:
/// beyond it what lies between is a strip that can be seen.
const FLATTEST: f64 = 0.02;

impl Splitter<'_> {
    /// The end of a curve that a crossing with another one is, if the other one is an edge of its own surface in which it
    /// ends, and it crosses that by no more than the sides of the edge are apart: of an edge whose sides are not quite the
    /// same curve one is drawn, and what ends at another reaches over that, or falls short of it.
    fn end_at(&self, index: usize, table: &LengthTable, (arc, a): (&Arc, f64), (other, b): (&Arc, f64)) -> Option<f64> {
        let (curve, edge) = (&self.arcs.curves[index], &self.arcs.curves[other.curve]);
        if edge.gap == 0.0 || !edge.surfaces.iter().any(|s| curve.surfaces.contains(s)) {
            return None;
        }
        let along = |arc: &Arc, t: f64| arc.jet_at(t).1.truncate().normalize_or_zero();
        let sine = along(arc, a).perp_dot(along(other, b)).abs();
        let least = edge.gap + self.tolerance.resolution;
        // The sides may be apart to either side of what is drawn.
        let reach = 2.0 * least / sine.max(FLATTEST);
        let l = table.length_at(a);
        let (end, joint, gap) = if 2.0 * l <= table.total() {
            (curve.domain[0], self.arcs.of(index).next()?.jet(0.0).0, l)
        } else {
            (
                curve.domain[1],
                self.arcs.arc(index, self.arcs.count(index).checked_sub(1)?)?.jet(1.0).0,
                table.total() - l,
            )
        };
        if gap > reach {
            return None;
        }
        let apart = |arc: Arc| {
            let margin = DVec2::splat(2.0 * least);
            let p = joint.truncate();
            let near = p.cmpge(arc.lo - margin).all() && p.cmple(arc.hi + margin).all();
            near && arc.jet(nearest(&arc, p).0).0.distance(joint) <= 2.0 * least.max(self.tolerance.contact)
        };
        self.arcs.of(other.curve).any(apart).then_some(end)
    }

    /// Whether an overlap over the interval `t` is the tangency of a curve with the silhouette of its own surface. Both then touch
    /// in space at a place that is already known exactly, from parameter space, and run apart from there. Near a cusp another
    /// branch of the silhouette may run as near on the screen, but that one is nearer to the eye, or farther.
    fn own_contact(&self, (index, table): (usize, &LengthTable), other: usize, t: [f64; 2]) -> bool {
        let Tolerance { resolution, contact } = self.tolerance;
        let (c, silhouette) = (&self.arcs.curves[index], &self.arcs.curves[other]);
        let traced = |c: &SurfaceCurve| matches!(c.path, Path::Traced(_));
        if traced(c) || !traced(silhouette) || !c.surfaces.contains(&silhouette.surface) {
            return false;
        }
        let (l0, l1) = (table.length_at(t[0].min(t[1])), table.length_at(t[0].max(t[1])));
        // A tangency of curvature 1/R stays within the resolution r for √(8 r R); R is at most the picture's size.
        let reach = libm::sqrt(8.0 * resolution * table.total()).max(l1 - l0);
        let near = |x: &&f64| (l0 - reach..=l1 + reach).contains(&table.length_at(**x));
        let touches = |&s: &f64| {
            let Some(p) = self.arcs.holding(index, s).map(|a| a.at(s)) else { return false };
            self.arcs.of(other).any(|arc| {
                let limit = 4.0 * resolution + 2.0 * arc.error;
                let margin = DVec2::splat(limit);
                let inside = p.truncate().cmpge(arc.lo - margin).all() && p.truncate().cmple(arc.hi + margin).all();
                inside && {
                    let (x, distance) = nearest(&arc, p.truncate());
                    distance <= limit && (arc.jet(x).0.z - p.z).abs() <= contact
                }
            })
        };
        c.splits.iter().chain(&c.domain).filter(near).any(touches)
    }
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
        // By length: in the parameter the middle may be within the resolution of an end, where something else begins.
        let m = table.param_at(0.5 * (table.length_at(p.t[0]) + table.length_at(p.t[1])));
        let here = || overlaps.iter().filter(|o| o.t[0] <= m && m <= o.t[1]);
        p.coincident = here().next().is_some();
        p.covered_by = here().filter(|o| o.drawn).map(|o| o.with).min();
        // Most have one cut or two, and they are kept.
        p.entered.shrink_to_fit();
    }
    pieces
}
