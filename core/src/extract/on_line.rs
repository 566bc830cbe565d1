//! How the patches along an isoparametric line face the eye.

use alloc::vec::Vec;

use glam::DVec3;

use super::curve::Geometry;
use super::facing::Facing;
use crate::line::{Axis, Line};

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
