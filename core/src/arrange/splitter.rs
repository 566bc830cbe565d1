//! One curve split by all others.

use alloc::vec::Vec;

use glam::DVec2;

use super::arc::Arc;
use super::arcs::OneCurve;
use super::division::Recent;
use super::intersect::{Work, meetings, nearest};
use super::meeting::Meeting;
use super::pierce::{Boxes, Sheets};
use super::{ArrangeStats, Clusters, CurveArcs, Cut, LengthTable, Piece, Tolerance};
use crate::extract::{CurveKind, Path, SurfaceCurve};
use crate::grid::Grid;
use crate::view::Patch;

/// An interval in which a curve coincides on the screen with another one.
struct Overlap {
    t: [f64; 2],
    with: usize,
    /// Whether the other curve draws the line: it is inked, and nearer or earlier in order.
    drawn: bool,
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
            before += arcs.one(curve).count();
            (curve, here)
        });
        Self { curves: active.collect(), arcs }
    }

    fn iter(&self) -> impl Iterator<Item = Arc> + Clone {
        self.curves.iter().flat_map(|&(curve, _)| self.arcs.one(curve).iter())
    }

    fn get(&self, k: usize, recent: &mut Recent) -> Option<Arc> {
        let last = self.curves.partition_point(|&(_, before)| before <= k).checked_sub(1)?;
        let (curve, before) = *self.curves.get(last)?;
        recent.arc(self.arcs.one(curve), k - before, k)
    }
}

/// Everything that curves are split by.
pub(super) struct Splitter<'a> {
    arcs: CurveArcs<'a>,
    /// The arcs of active curves, and where they are.
    active: Active<'a>,
    grid: Grid,
    sheets: Sheets<'a>,
    clusters: &'a Clusters,
    tolerance: Tolerance,
}

impl<'a> Splitter<'a> {
    /// What splits these curves, and others that come after them and are not active: their boxes are among `boxes`.
    pub(super) fn new(
        arcs: CurveArcs<'a>,
        patches: &'a [&'a Patch],
        joined: Vec<Vec<usize>>,
        boxes: Boxes,
        clusters: &'a Clusters,
        tolerance: Tolerance,
    ) -> Self {
        let active = Active::new(arcs);
        let grid = Grid::new(active.iter().map(|a| (a.lo, a.hi)));
        let sheets = Sheets::new(patches, boxes, joined, tolerance.contact);
        Self { arcs, active, grid, sheets, clusters, tolerance }
    }

    /// Below what lengths things are one.
    pub(super) fn tolerance(&self) -> Tolerance {
        self.tolerance
    }

    /// The pieces of a curve.
    pub(super) fn split(
        &self,
        own: OneCurve<'_>,
        table: &LengthTable,
        recent: &mut Recent,
    ) -> (Vec<Piece>, ArrangeStats) {
        let curves = self.arcs.curves;
        let Tolerance { resolution, contact } = self.tolerance;
        let (curve, index) = (own.curve(), own.index());
        let mut stats = ArrangeStats { curves: 1, ..ArrangeStats::default() };
        let mut work = Work::default();
        let mut cuts: Vec<(f64, Cut)> = curve.splits.iter().map(|&t| (t, Cut::Own)).collect();
        let (mut overlaps, mut pierced) = (Vec::new(), Vec::new());
        let (mut near, mut found) = (Vec::new(), Vec::new());
        for arc in own.iter() {
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
                                let end = self.end_at(own, table, (arc, a), (other, b));
                                let nearer = end.is_none() && zb > za + contact;
                                let cut = Cut::Crossing { with: other.curve, at: b, nearer };
                                cuts.push((end.unwrap_or(a), cut));
                                stats.crossings += 1;
                            }
                        }
                        Meeting::Overlap { a, za, zb, .. } => {
                            if zb < za - resolution || self.own_contact((own, table), other.curve, a) {
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
        let pieces = cut(curve, index, table, cuts, &overlaps, resolution, is_own_edge);
        stats.pieces = pieces.len() as u64;
        (pieces, stats)
    }
}

/// Least sine of the angle between a curve and the edge that it ends in at which a crossing of the two is told from its end:
/// beyond it what lies between is a strip that can be seen.
const FLATTEST: f64 = 0.02;

impl Splitter<'_> {
    /// The end of a curve that a crossing with another one is, if the other one is an edge of its own surface in which it
    /// ends, and it crosses that by no more than the sides of the edge are apart: of an edge whose sides are not quite the
    /// same curve one is drawn, and what ends at another reaches over that, or falls short of it.
    fn end_at(
        &self,
        own: OneCurve<'_>,
        table: &LengthTable,
        (arc, a): (&Arc, f64),
        (other, b): (&Arc, f64),
    ) -> Option<f64> {
        let (curve, edge) = (own.curve(), &self.arcs.curves[other.curve]);
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
            (curve.domain[0], own.arc(0)?.jet(0.0).0, l)
        } else {
            (curve.domain[1], own.arc(own.count().checked_sub(1)?)?.jet(1.0).0, table.total() - l)
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
        self.arcs.one(other.curve).iter().any(apart).then_some(end)
    }

    /// Whether an overlap over the interval `t` is the tangency of a curve with the silhouette of its own surface. Both then touch
    /// in space at a place that is already known exactly, from parameter space, and run apart from there. Near a cusp another
    /// branch of the silhouette may run as near on the screen, but that one is nearer to the eye, or farther.
    fn own_contact(&self, (own, table): (OneCurve<'_>, &LengthTable), other: usize, t: [f64; 2]) -> bool {
        let Tolerance { resolution, contact } = self.tolerance;
        let (c, silhouette) = (own.curve(), &self.arcs.curves[other]);
        let traced = |c: &SurfaceCurve| matches!(c.path, Path::Traced(_));
        if traced(c) || !traced(silhouette) || !c.surfaces.contains(&silhouette.surface) {
            return false;
        }
        let (l0, l1) = (table.length_at(t[0].min(t[1])), table.length_at(t[0].max(t[1])));
        // A tangency of curvature 1/R stays within the resolution r for √(8 r R); R is at most the picture's size.
        let reach = libm::sqrt(8.0 * resolution * table.total()).max(l1 - l0);
        let near = |x: &&f64| (l0 - reach..=l1 + reach).contains(&table.length_at(**x));
        let touches = |&s: &f64| {
            let Some(p) = own.holding(s).map(|a| a.at(s)) else { return false };
            self.arcs.one(other).iter().any(|arc| {
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
