//! Curves where two patches meet: edges of surfaces, alone or stitched, and the knot lines inside them.
//!
//! A sharp join is a crease. A smooth one is a silhouette wherever the two patches lie on the same side of it on the
//! screen, one of them facing the eye and the other not. Either its points are zeros of F on both sides (a sphere seen along
//! its axis), or the tangent planes agree to the tolerance of stitching only, and the sight line is between them: there
//! the silhouette of one patch ends at one place of the join, that of the other at another place, and what joins them is
//! the join itself. Which way each patch faces just beside the join changes at roots of a univariate polynomial, so the
//! join is cut at all of them and asked in between.

use alloc::vec;
use alloc::vec::Vec;

use glam::DVec3;

use super::bend::Bend;
use super::collect::CurveOptions;
use super::curve::{Geometry, Path, SurfaceCurve};
use super::kind::CurveKind;
use super::on_line::{
    corners, facing_zeros, lies_left, side_corners, side_lies_left, side_lies_left_along, side_zeros,
};
use crate::line::{Axis, Line};
use crate::stitch::{Edge, EdgeClass, SidePath, Stitching};

/// The curve of one edge: a boundary, a crease, or a smooth join, parts of which may be silhouettes.
pub(super) fn edge_curves(
    g: &Geometry<'_>,
    stitching: &Stitching,
    edge: &Edge,
    options: &CurveOptions<'_>,
    out: &mut Vec<SurfaceCurve>,
) {
    let path = &stitching.sides[edge.side].path;
    let mut sides = vec![edge.side];
    sides.extend(&edge.partners);
    let mut surfaces: Vec<usize> = sides.iter().map(|&s| stitching.sides[s].path.surface()).collect();
    surfaces.dedup();
    let onto = |other: &SidePath, t: f64| path.nearest(g.view, other.point(g.view, t)).0;
    let mut zeros = side_zeros(g, path, edge.t);
    for &p in &edge.partners {
        let other = &stitching.sides[p].path;
        let theirs = side_zeros(g, other, other.domain());
        zeros.extend(theirs.iter().map(|&t| onto(other, t)));
    }
    let mut splits = zeros.clone();
    splits.extend(side_corners(g, path));
    let curve = |kind: CurveKind, domain: [f64; 2], active: bool| SurfaceCurve {
        kind,
        surface: path.surface(),
        surfaces: surfaces.clone(),
        path: match path {
            SidePath::Line(line) => Path::Line(line.clone()),
            SidePath::Trim(line) => Path::Trim(line.clone()),
        },
        domain,
        active,
        inked: options.styles.drawn_by(&surfaces, kind).is_some(),
        style: options.styles.drawn_by(&surfaces, kind).unwrap_or(path.surface()),
        level: 0,
        sides: sides.clone(),
        gap: edge.gap,
        splits: splits.iter().copied().filter(|&t| domain[0] < t && t < domain[1]).collect(),
    };
    match (edge.class, edge.partners.first()) {
        (EdgeClass::Smooth, Some(&partner)) => {
            let other = &stitching.sides[partner].path;
            let mut cuts = zeros;
            cuts.extend(path.breaks());
            cuts.extend(other.breaks().iter().map(|&t| onto(other, t)));
            let is_fold = |m: f64| {
                let (p, along) = path.jet(g.view, m);
                let there = other.nearest(g.view, p).0;
                folds(side_lies_left(g, path, m), side_lies_left_along(g, other, there, along))
            };
            let at = |t: f64| path.point(g.view, t);
            for (fold, t) in runs(&parts(&at, edge.t, cuts, options.contact), is_fold) {
                if fold {
                    out.push(curve(CurveKind::Silhouette, t, true));
                } else if options.styles.drawn_by(&surfaces, CurveKind::Smooth).is_some() {
                    out.push(curve(CurveKind::Smooth, t, false));
                }
            }
        }
        (EdgeClass::Crease, _) => out.push(curve(CurveKind::Crease, edge.t, true)),
        _ => out.push(curve(CurveKind::Boundary, edge.t, true)),
    }
}

/// Knot lines inside a surface: creases where the normal jumps, silhouettes where the surface folds exactly there.
pub(super) fn inner_lines(g: &Geometry<'_>, surface: usize, options: &CurveOptions<'_>, out: &mut Vec<SurfaceCurve>) {
    let grid = &g.view.surfaces()[surface];
    for (axis, breaks, corner) in
        [(Axis::U, &grid.u_breaks, &grid.u_corners), (Axis::V, &grid.v_breaks, &grid.v_corners)]
    {
        for &value in &breaks[1..breaks.len() - 1] {
            let low = Line::new(g.view, surface, axis, value, true);
            let high = Line::new(g.view, surface, axis, value, false);
            let bend = Bend::new(g, &low, &high, corner.contains(&value), options.angle);
            let whole = low.domain();
            let mut zeros = facing_zeros(g, &low, whole);
            zeros.extend(facing_zeros(g, &high, whole));
            let mut splits = zeros.clone();
            splits.extend(corners(g, &low));
            let mut cuts = zeros;
            cuts.extend(low.spans.iter().map(|s| s.t[0]));
            cuts.extend(bend.changes());
            let kind = |m: f64| {
                if bend.is_sharp(m) {
                    Some(CurveKind::Crease)
                } else {
                    folds(lies_left(g, &low, m), lies_left(g, &high, m)).then_some(CurveKind::Silhouette)
                }
            };
            for (kind, t) in runs(&parts(&|t| low.point(t), whole, cuts, options.contact), kind) {
                let Some(kind) = kind else { continue };
                out.push(SurfaceCurve {
                    kind,
                    surface,
                    surfaces: vec![surface],
                    path: Path::Line(low.clone()),
                    domain: t,
                    active: true,
                    inked: options.styles.of(surface).curves.contains(kind),
                    style: surface,
                    level: 0,
                    sides: Vec::new(),
                    gap: 0.0,
                    splits: splits.iter().copied().filter(|&x| t[0] < x && x < t[1]).collect(),
                });
            }
        }
    }
}

/// The parts within `t` between cuts of the line through the points `at`. Cuts nearer together along the line, in
/// space, than `contact` are one, so that no part is shorter: none at all of a line that is.
fn parts(at: &impl Fn(f64) -> DVec3, t: [f64; 2], mut cuts: Vec<f64>, contact: f64) -> Vec<[f64; 2]> {
    cuts.retain(|&x| t[0] < x && x < t[1]);
    cuts.push(t[1]);
    cuts.sort_by(f64::total_cmp);
    let mut kept = vec![t[0]];
    for cut in cuts {
        if kept.last().is_some_and(|&last| length(at, [last, cut]) > contact) {
            kept.push(cut);
        }
    }
    if let Some(last) = kept.last_mut() {
        *last = t[1];
    }
    kept.windows(2).map(|w| [w[0], w[1]]).collect()
}

/// Length of a part of a line in view space, by eight chords.
fn length(at: &impl Fn(f64) -> DVec3, t: [f64; 2]) -> f64 {
    const CHORDS: u32 = 8;
    let place = |k: u32| at(t[0] + (t[1] - t[0]) * f64::from(k) / f64::from(CHORDS));
    (0..CHORDS).map(|k| place(k).distance(place(k + 1))).sum()
}

/// Neighbouring parts with the same answer in their middles, made one.
fn runs<T: PartialEq>(parts: &[[f64; 2]], answer: impl Fn(f64) -> T) -> Vec<(T, [f64; 2])> {
    let mut out: Vec<(T, [f64; 2])> = Vec::new();
    for t in parts {
        let found = answer(0.5 * (t[0] + t[1]));
        match out.last_mut() {
            Some((last, run)) if *last == found => run[1] = t[1],
            _ => out.push((found, *t)),
        }
    }
    out
}

/// Whether two patches that join smoothly along a line lie on the same side of it on the screen; one that is edge-on ends
/// there the area of one that is not.
fn folds(a: i8, b: i8) -> bool {
    a == b && a != 0 || (a == 0) != (b == 0)
}

#[cfg(test)]
mod tests;
