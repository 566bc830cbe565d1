//! How the patches along an isoparametric line or a trim curve face the eye.

use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::curve::Geometry;
use super::facing::{Facing, FacingForm};
use crate::bernstein::{Bivariate, bracketed};
use crate::line::{Axis, Line};
use crate::stitch::SidePath;
use crate::trim_line::{TrimLine, TrimSpan};
use crate::view::Patch;

/// Parameters at which a line meets the silhouette of the patches it runs in: the zeros of their facing polynomials on
/// it, freed of factors that vanish all along it, and the borders between patches all along which the facing vanishes. Only
/// those in `t`, ends included.
pub(super) fn facing_zeros(g: &Geometry<'_>, line: &Line, t: [f64; 2]) -> Vec<f64> {
    let mut out = Vec::new();
    // Edges of a patch at the end of a span and at the beginning of the next one, in the order of `edge_factor`.
    let (end, beginning) = if line.axis == Axis::U { (3, 2) } else { (1, 0) };
    for w in line.spans.windows(2) {
        let x = w[0].t[1];
        let vanishes = g.forms[w[0].patch].edge_factor[end] > 0 || g.forms[w[1].patch].edge_factor[beginning] > 0;
        if vanishes && t[0] <= x && x <= t[1] {
            out.push(x);
        }
    }
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

/// On which side of the directed line, on the screen, the patch lies that the line bounds at `t`: 1 left, −1 right, 0 if
/// it is edge-on. It is the sign of the facing polynomial just inside, that is of its value on the line once factors that
/// vanish all along the line are divided out; it changes at [`facing_zeros`] and between patches only.
pub(crate) fn lies_left(g: &Geometry<'_>, line: &Line, t: f64) -> i8 {
    let (patch, at) = line.place(t);
    let form = &g.forms[patch];
    let front = match form.facing {
        Facing::EdgeOn => return 0,
        Facing::Front => true,
        Facing::Back => false,
        Facing::Mixed => {
            let [value, ..] = form.gradient(at.x, at.y);
            value > 0.0
        }
    };
    // Seen from the front, v turns left from u: what lies at larger v is left of a line that runs in u, what lies at
    // larger u right of one that runs in v.
    if front == ((line.axis == Axis::V) != line.below) { 1 } else { -1 }
}

/// [`lies_left`] of a line that runs in the direction `along` instead of the line's own, or against it.
pub(crate) fn lies_left_along(g: &Geometry<'_>, line: &Line, t: f64, along: DVec3) -> i8 {
    let left = lies_left(g, line, t);
    if along.dot(line.jet(t).1) < 0.0 { -left } else { left }
}

/// Places on a line where it crosses a knot at which its surface is merely continuous.
pub(super) fn corners(g: &Geometry<'_>, line: &Line) -> Vec<f64> {
    let grid = &g.view.surfaces()[line.surface];
    match line.axis {
        Axis::U => grid.v_corners.clone(),
        Axis::V => grid.u_corners.clone(),
    }
}

/// [`facing_zeros`] of a side.
pub(super) fn side_zeros(g: &Geometry<'_>, path: &SidePath, t: [f64; 2]) -> Vec<f64> {
    match path {
        SidePath::Line(line) => facing_zeros(g, line, t),
        SidePath::Trim(line) => trim_zeros(g, line, t),
    }
}

/// [`corners`] of a side; a trim line has none inside.
pub(super) fn side_corners(g: &Geometry<'_>, path: &SidePath) -> Vec<f64> {
    path.line().map_or_else(Vec::new, |line| corners(g, line))
}

/// [`lies_left`] of a side.
pub(crate) fn side_lies_left(g: &Geometry<'_>, path: &SidePath, t: f64) -> i8 {
    match path {
        SidePath::Line(line) => lies_left(g, line, t),
        SidePath::Trim(line) => {
            let (patch, at) = line.place(g.view, t);
            let form = &g.forms[patch];
            let front = match form.facing {
                Facing::EdgeOn => return 0,
                Facing::Front => true,
                Facing::Back => false,
                Facing::Mixed => form.value(at.x, at.y) > 0.0,
            };
            // Seen from the front, left in (u, v) is left on the screen.
            if front == line.spans[line.span_at(t)].left { 1 } else { -1 }
        }
    }
}

/// [`lies_left_along`] of a side.
pub(crate) fn side_lies_left_along(g: &Geometry<'_>, path: &SidePath, t: f64, along: DVec3) -> i8 {
    let left = side_lies_left(g, path, t);
    if along.dot(path.jet(g.view, t).1) < 0.0 { -left } else { left }
}

/// Halvings of a span at the most in the search for zeros of the facing polynomial, and cells looked at: a zero takes
/// some sixty, more are needed only where the trim curve runs along a silhouette.
const MOST_HALVINGS: u32 = 30;
const MOST_CELLS: u32 = 2048;

/// Parameters in `t` at which a trim line meets the silhouette of its surface, and those at which it passes from one
/// patch to another that faces another way. A part of the curve over whose box the polynomial has one sign, by its
/// coefficients, has no zero, so that none is missed; where the line runs along a silhouette for a while there may be
/// some in it.
fn trim_zeros(g: &Geometry<'_>, line: &TrimLine, t: [f64; 2]) -> Vec<f64> {
    let mut out = Vec::new();
    for (k, span) in line.spans.iter().enumerate() {
        let form = &g.forms[span.patch];
        let start = k as f64;
        if k > 0 {
            let before = &g.forms[line.spans[k - 1].patch];
            if before.edge_factor != [0; 4] || form.edge_factor != [0; 4] || before.facing != form.facing {
                out.push(start);
            }
        }
        let (Facing::Mixed, Some(polynomial)) = (form.facing, &form.polynomial) else { continue };
        let patch = &g.view.patches()[span.patch];
        let mut cells = MOST_CELLS;
        let search = SpanSearch { span, patch, form, polynomial };
        search.zeros([0.0, 1.0], 0, &mut cells, &mut |s| out.push(start + s));
    }
    out.retain(|&x| t[0] <= x && x <= t[1]);
    out
}

/// The facing polynomial along one span of a trim line.
struct SpanSearch<'a> {
    span: &'a TrimSpan,
    patch: &'a Patch,
    form: &'a FacingForm,
    polynomial: &'a Bivariate,
}

impl SpanSearch<'_> {
    fn local(&self, s: f64) -> DVec2 {
        self.patch.to_local(self.span.piece.eval(s)).clamp(DVec2::ZERO, DVec2::ONE)
    }

    fn value(&self, s: f64) -> f64 {
        let at = self.local(s);
        self.form.value(at.x, at.y)
    }

    fn zeros(&self, [a, b]: [f64; 2], depth: u32, cells: &mut u32, found: &mut impl FnMut(f64)) {
        if *cells == 0 {
            return;
        }
        *cells -= 1;
        // The piece runs one way in u and in v, so that its ends span its box.
        let (p, q) = (self.local(a), self.local(b));
        let (lo, hi) = (p.min(q), p.max(q));
        let (low, high) = self.polynomial.restricted([lo.x, hi.x], [lo.y, hi.y]).bounds();
        let noise = 4.0 * self.form.rounding;
        if low > noise || high < -noise || low.abs().max(high.abs()) <= noise {
            return;
        }
        let (from, to) = (self.value(a), self.value(b));
        if depth >= MOST_HALVINGS {
            // It changes sign here, or touches zero to the resolution of the parameter.
            let at = if from * to < 0.0 { bracketed(|s| self.value(s), [a, b], [from, to]) } else { 0.5 * (a + b) };
            found(at);
            return;
        }
        let middle = 0.5 * (a + b);
        self.zeros([a, middle], depth + 1, cells, found);
        self.zeros([middle, b], depth + 1, cells, found);
    }
}
