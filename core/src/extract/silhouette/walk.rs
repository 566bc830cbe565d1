//! Points on a silhouette: the walk of Elber and Cohen (1989, §3), and its safeguard.
//!
//! Both look for F = 0 near a chord of an arc. The walk goes down the gradient and may end anywhere on the arc between
//! the chord's ends, which is all that a new vertex needs. A curve that is evaluated at a parameter needs the one point
//! there; [`bracketed`] finds it, and takes over where the walk leaves the arc.

use glam::DVec2;

use super::Segment;
use crate::extract::facing::{FacingForm, LineForm};
use crate::extract::zero_set::Variable;
use crate::view::Patch;

/// Secant steps of a walk. The secant method gains a factor 1.6 in digits with each, so that nine make 1e-16 of 1e-1;
/// a walk that needs more is not in reach of its zero.
const MAX_STEPS: usize = 9;

/// The walk from the middle of the chord a b: the gradient of N_z is evaluated once, and on the line along it the zero
/// is found by secants (steps 1 to 8 of the paper). Returns the point and the number of steps; none where it leaves
/// the arc.
///
/// The gradient is the one on the surface, not in the parameter plane, and the walk ends where |N_z| / |N| is nought to
/// rounding: neither depends on how fast the parameters run. A line of constant independent parameter meets F = 0 once
/// in the segment's bracket, hence a zero of F in the bracket, with its independent parameter between those of a and b,
/// is on the arc. The walk's end is taken if it lies in the middle half, so that each halving gets somewhere.
pub(super) fn walk(form: &FacingForm, patch: &Patch, segment: &Segment, a: DVec2, b: DVec2) -> Option<(DVec2, usize)> {
    let from = 0.5 * (a + b);
    let jet = patch.jet(from.x, from.y);
    let [f, fu, fv] = form.gradient(from.x, from.y);
    let unit = form.unit(patch, from, jet.normal().length());
    // A sine is not known better than to some units of roundoff. F below its rounding bound is nought as well, but the
    // bound is a wide one: one step more is worth its cost.
    let nought =
        |f: f64, before: f64| f.abs() <= 8.0 * f64::EPSILON * unit || f.abs().max(before.abs()) <= form.rounding;
    let direction = DVec2::new(fu / jet.du.length_squared(), fv / jet.dv.length_squared());
    let slope = direction.dot(DVec2::new(fu, fv));
    let (mut before, mut f_before) = (0.0, f);
    let mut at = -f / slope;
    let mut steps = 1;
    let inside = |p: DVec2| {
        let (x, y, x0, x1) = match segment.axis {
            Variable::U => (p.x, p.y, a.x, b.x),
            Variable::V => (p.y, p.x, a.y, b.y),
        };
        let fraction = (x - x0) / (x1 - x0);
        (0.25..=0.75).contains(&fraction) && y >= segment.bracket[0] && y <= segment.bracket[1]
    };
    loop {
        let p = from + direction * at;
        // Not a number is outside as well.
        if !inside(p) {
            return None;
        }
        let f = form.value(p.x, p.y);
        let next = at - f * (at - before) / (f - f_before);
        if nought(f, f_before) || (next == at && f.abs() <= form.rounding) {
            return Some((p, steps));
        }
        if steps == MAX_STEPS {
            return None;
        }
        (before, f_before, at) = (at, f, next);
        steps += 1;
    }
}

/// The point of the silhouette a `fraction` of the way from `a` to `b` along the segment's independent parameter, and
/// the number of steps to it.
///
/// Newton's method from the chord, kept inside a bracket that every evaluation tightens; a step that leaves it, or that
/// does not halve the one before the last, is replaced by bisection. Ends where a step no longer changes the parameter.
pub(super) fn bracketed(form: &FacingForm, segment: &Segment, a: DVec2, b: DVec2, fraction: f64) -> (DVec2, usize) {
    let guess = a + (b - a) * fraction;
    let Some(polynomial) = &form.polynomial else { return (guess, 0) };
    let (x, mut y) = match segment.axis {
        Variable::U => (guess.x, guess.y),
        Variable::V => (guess.y, guess.x),
    };
    let line = LineForm::new(polynomial, segment.axis == Variable::U, x);
    let [mut lo, mut hi] = segment.bracket;
    y = y.clamp(lo, hi);
    let (mut before, mut last) = (hi - lo, hi - lo);
    let mut steps = 0;
    // Bisection alone needs some 60 steps from a bracket of width 1 to one unit in the last place.
    while steps < 100 {
        steps += 1;
        let (f, slope) = line.eval(y);
        if f == 0.0 {
            break;
        }
        if (f > 0.0) == segment.rising {
            hi = y;
        } else {
            lo = y;
        }
        let newton = y - f / slope;
        let halves = (newton - y).abs() <= 0.5 * before;
        let next = if halves && newton >= lo && newton <= hi { newton } else { 0.5 * (lo + hi) };
        (before, last) = (last, (next - y).abs());
        // Half a unit in the last place of 1, the scale of a parameter.
        let settled = (next - y).abs() <= 0.5 * f64::EPSILON || hi - lo <= 0.5 * f64::EPSILON;
        y = next;
        if settled {
            break;
        }
    }
    (if segment.axis == Variable::U { DVec2::new(x, y) } else { DVec2::new(y, x) }, steps)
}
