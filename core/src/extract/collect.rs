//! All curves of a scene: boundaries, creases, silhouettes and uniform isocurves.

use alloc::vec;
use alloc::vec::Vec;

use super::curve::{Geometry, Path, SurfaceCurve};
use super::facing::Facing;
use super::kind::CurveKind;
use super::silhouette::Silhouettes;
use crate::line::{Axis, Line};
use crate::stitch::{Edge, EdgeClass, Stitching};

/// Which kinds of curve are wanted on paper.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CurveSet {
    /// Free edges.
    pub boundary: bool,
    /// Sharp edges.
    pub crease: bool,
    /// Silhouettes.
    pub silhouette: bool,
    /// Isoparametric curves.
    pub iso: bool,
    /// Smooth joins.
    pub smooth: bool,
}

impl Default for CurveSet {
    fn default() -> Self {
        Self { boundary: true, crease: true, silhouette: true, iso: true, smooth: false }
    }
}

impl CurveSet {
    /// Whether `kind` is in the set.
    #[must_use]
    pub fn contains(&self, kind: CurveKind) -> bool {
        match kind {
            CurveKind::Boundary => self.boundary,
            CurveKind::Crease => self.crease,
            CurveKind::Silhouette => self.silhouette,
            CurveKind::Iso => self.iso,
            CurveKind::Smooth => self.smooth,
        }
    }
}

/// Gathers the curves. Every active curve is there whatever `wanted` says, because visibility changes at it; passive
/// ones only if they are wanted. `isos` isocurves a direction stand at the middles of as many equal parts of each
/// surface's parameter range.
#[must_use]
pub fn curves(
    g: &Geometry<'_>,
    stitching: &Stitching,
    silhouettes: &Silhouettes,
    wanted: CurveSet,
    isos: u32,
    angle: f64,
) -> Vec<SurfaceCurve> {
    let mut out = Vec::new();
    for edge in &stitching.edges {
        if edge.owner() {
            edge_curves(g, stitching, edge, wanted, &mut out);
        }
    }
    for surface in 0..g.view.surfaces().len() {
        inner_lines(g, surface, wanted, angle, &mut out);
    }
    for traced in &silhouettes.curves {
        let surface = g.view.patches()[traced.patch].surface;
        out.push(SurfaceCurve {
            kind: CurveKind::Silhouette,
            surface,
            surfaces: vec![surface],
            domain: [0.0, traced.segment_count() as f64],
            path: Path::Traced(traced.clone()),
            active: true,
            inked: wanted.silhouette,
            sides: Vec::new(),
            splits: Vec::new(),
        });
    }
    // Active curves first: of coincident lines the earlier one is inked, and outlines come before what fills them.
    out.sort_by_key(|c| !c.active);
    if wanted.iso {
        for surface in 0..g.view.surfaces().len() {
            iso_curves(g, surface, isos, &mut out);
        }
    }
    out
}

/// The curve of one edge: a boundary, a crease, or a smooth join, parts of which may be silhouettes.
fn edge_curves(g: &Geometry<'_>, stitching: &Stitching, edge: &Edge, wanted: CurveSet, out: &mut Vec<SurfaceCurve>) {
    let side = &stitching.sides[edge.side];
    let mut sides = vec![edge.side];
    sides.extend(&edge.partners);
    let mut surfaces: Vec<usize> = sides.iter().map(|&s| stitching.sides[s].line.surface).collect();
    surfaces.dedup();
    let mut splits = facing_zeros(g, &side.line, edge.t);
    for &p in &edge.partners {
        let other = &stitching.sides[p].line;
        let zeros = facing_zeros(g, other, other.domain());
        splits.extend(zeros.iter().map(|&t| side.line.nearest(other.point(t)).0));
    }
    splits.extend(corners(g, &side.line));
    let curve = |kind: CurveKind, domain: [f64; 2], active: bool| SurfaceCurve {
        kind,
        surface: side.line.surface,
        surfaces: surfaces.clone(),
        path: Path::Line(side.line.clone()),
        domain,
        active,
        inked: wanted.contains(kind),
        sides: sides.clone(),
        splits: splits.iter().copied().filter(|&t| domain[0] < t && t < domain[1]).collect(),
    };
    match (edge.class, edge.partners.first()) {
        (EdgeClass::Smooth, Some(&partner)) => {
            let folds = |k: usize, a: f64, b: f64| {
                let m = 0.5 * (a + b);
                let other = &stitching.sides[partner].line;
                let (t0, t1) =
                    (other.nearest(side.line.point(m)).0, other.nearest(side.line.point(0.6 * b + 0.4 * a)).0);
                let reversed = if t1 < t0 { -1 } else { 1 };
                let ours = lies_left(g, &side.line, k);
                let theirs = lies_left(g, other, other.span_at(t0)).map(|s| s * reversed);
                fold(ours, theirs)
            };
            line_parts(&side.line, edge.t, folds, |folded, t| {
                if folded {
                    out.push(curve(CurveKind::Silhouette, t, true));
                } else if wanted.smooth {
                    out.push(curve(CurveKind::Smooth, t, false));
                }
            });
        }
        (EdgeClass::Crease, _) => out.push(curve(CurveKind::Crease, edge.t, true)),
        _ => out.push(curve(CurveKind::Boundary, edge.t, true)),
    }
}

/// Knot lines inside a surface: creases where the normal jumps, silhouettes where the surface folds exactly there.
fn inner_lines(g: &Geometry<'_>, surface: usize, wanted: CurveSet, angle: f64, out: &mut Vec<SurfaceCurve>) {
    let grid = &g.view.surfaces()[surface];
    for (axis, breaks, corner) in
        [(Axis::U, &grid.u_breaks, &grid.u_corners), (Axis::V, &grid.v_breaks, &grid.v_corners)]
    {
        for &value in &breaks[1..breaks.len() - 1] {
            let (low, high) =
                (Line::new(g.view, surface, axis, value, true), Line::new(g.view, surface, axis, value, false));
            let mut sharp = vec![false; low.spans.len()];
            if corner.contains(&value) {
                for (k, s) in low.spans.iter().enumerate() {
                    sharp[k] = [0.1, 0.35, 0.6, 0.85].iter().any(|f| {
                        let t = s.t[0] + f * (s.t[1] - s.t[0]);
                        breaks_tangent(g, &low, t, angle)
                    });
                }
            }
            let mut put = |line: &Line, kind: CurveKind, t: [f64; 2]| {
                let mut splits = facing_zeros(g, &low, t);
                splits.extend(facing_zeros(g, &high, t));
                splits.extend(corners(g, line));
                splits.retain(|&x| t[0] < x && x < t[1]);
                out.push(SurfaceCurve {
                    kind,
                    surface,
                    surfaces: vec![surface],
                    path: Path::Line(line.clone()),
                    domain: t,
                    active: true,
                    inked: wanted.contains(kind),
                    sides: Vec::new(),
                    splits,
                });
            };
            let whole = low.domain();
            line_parts(
                &low,
                whole,
                |k, _, _| sharp[k],
                |is_sharp, t| {
                    if is_sharp {
                        put(&low, CurveKind::Crease, t);
                    }
                },
            );
            let folded = |k: usize, _: f64, _: f64| !sharp[k] && fold(lies_left(g, &low, k), lies_left(g, &high, k));
            line_parts(&low, whole, folded, |is_fold, t| {
                if is_fold {
                    put(&low, CurveKind::Silhouette, t);
                }
            });
        }
    }
}

/// Calls `emit` with each maximal run of spans of `line` within `t` for which `test` gives the same answer.
fn line_parts(
    line: &Line,
    t: [f64; 2],
    mut test: impl FnMut(usize, f64, f64) -> bool,
    mut emit: impl FnMut(bool, [f64; 2]),
) {
    let mut run: Option<(bool, [f64; 2])> = None;
    for (k, s) in line.spans.iter().enumerate() {
        let (a, b) = (s.t[0].max(t[0]), s.t[1].min(t[1]));
        if a >= b {
            continue;
        }
        let answer = test(k, a, b);
        match &mut run {
            Some((last, range)) if *last == answer => range[1] = b,
            _ => {
                if let Some((last, range)) = run.replace((answer, [a, b])) {
                    emit(last, range);
                }
            }
        }
    }
    if let Some((last, range)) = run {
        emit(last, range);
    }
}

/// Whether the surface's two sides of a knot line meet at more than `angle`.
fn breaks_tangent(g: &Geometry<'_>, low: &Line, t: f64, angle: f64) -> bool {
    let uv = low.uv(t);
    let at = |below: bool| {
        let flags = if low.axis == Axis::U { [below, false] } else { [false, below] };
        g.view.model_jet(low.surface, uv, flags).normal().try_normalize()
    };
    match (at(true), at(false)) {
        (Some(n), Some(m)) => n.dot(m) < libm::cos(angle),
        _ => false,
    }
}

/// On which side of the directed line, on the screen, the surface lies that the line bounds: 1 left, −1 right, 0 if the
/// surface is edge-on. Only where the facing polynomial vanishes along the line or the patch is edge-on; elsewhere
/// `None`: two sides of a smooth join then face the same way by continuity.
fn lies_left(g: &Geometry<'_>, line: &Line, k: usize) -> Option<i8> {
    let span = &line.spans[k];
    let form = &g.forms[span.patch];
    if form.facing == Facing::EdgeOn {
        return Some(0);
    }
    let edge = match (line.axis, line.below) {
        (Axis::U, false) => 0,
        (Axis::U, true) => 1,
        (Axis::V, false) => 2,
        (Axis::V, true) => 3,
    };
    if form.edge_factor[edge] == 0 {
        return None;
    }
    let polynomial = form.polynomial.as_ref()?;
    // The reduced polynomial has the facing's sign just inside the edge, except at its own zeros; off-centre places
    // keep symmetric ones out of the way.
    let along = 0.46;
    let value = match edge {
        0 => polynomial.eval(0.0, along),
        1 => polynomial.eval(1.0, along),
        2 => polynomial.eval(along, 0.0),
        _ => polynomial.eval(along, 1.0),
    };
    let sign = if value > 0.0 { 1 } else { -1 };
    Some(match edge {
        0 | 3 => -sign,
        _ => sign,
    })
}

/// Whether two surfaces that join smoothly along a line lie on the same side of it on the screen.
fn fold(a: Option<i8>, b: Option<i8>) -> bool {
    match (a, b) {
        (Some(0), Some(0)) => false,
        (Some(0), _) | (_, Some(0)) => true,
        (Some(a), Some(b)) => a == b,
        _ => false,
    }
}

/// Parameters at which a line meets the silhouette of the patches it runs in: the zeros of their facing polynomials on
/// it. A patch whose facing vanishes along the whole line gives none.
fn facing_zeros(g: &Geometry<'_>, line: &Line, t: [f64; 2]) -> Vec<f64> {
    let mut out = Vec::new();
    for s in &line.spans {
        if s.t[1] <= t[0] || s.t[0] >= t[1] {
            continue;
        }
        let form = &g.forms[s.patch];
        let (Facing::Mixed, Some(polynomial)) = (form.facing, &form.polynomial) else { continue };
        let on_line = match line.axis {
            Axis::U => polynomial.restricted_u(s.local),
            Axis::V => polynomial.restricted_v(s.local),
        };
        // A restriction averages coefficients, so it carries their rounding and a little more of its own; below that
        // the facing vanishes on the whole line, which then is a silhouette itself and meets none.
        if on_line.magnitude() <= 4.0 * form.rounding {
            continue;
        }
        out.extend(
            on_line.roots().iter().map(|r| s.t[0] + r.t * (s.t[1] - s.t[0])).filter(|&x| t[0] <= x && x <= t[1]),
        );
    }
    out
}

/// Places on a line where it crosses a knot at which its surface is merely continuous.
fn corners(g: &Geometry<'_>, line: &Line) -> Vec<f64> {
    let grid = &g.view.surfaces()[line.surface];
    match line.axis {
        Axis::U => grid.v_corners.clone(),
        Axis::V => grid.u_corners.clone(),
    }
}

fn iso_curves(g: &Geometry<'_>, surface: usize, isos: u32, out: &mut Vec<SurfaceCurve>) {
    let grid = &g.view.surfaces()[surface];
    for (axis, breaks) in [(Axis::U, &grid.u_breaks), (Axis::V, &grid.v_breaks)] {
        let (a, b) = (breaks[0], breaks[breaks.len() - 1]);
        for k in 0..isos {
            let value = a + (b - a) * (f64::from(k) + 0.5) / f64::from(isos);
            let line = Line::new(g.view, surface, axis, value, false);
            let domain = line.domain();
            let mut splits = facing_zeros(g, &line, domain);
            splits.extend(corners(g, &line));
            out.push(SurfaceCurve {
                kind: CurveKind::Iso,
                surface,
                surfaces: vec![surface],
                path: Path::Line(line),
                domain,
                active: false,
                inked: true,
                sides: Vec::new(),
                splits,
            });
        }
    }
}
