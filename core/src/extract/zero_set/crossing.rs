//! What happens in a place that F's rounding hides: the shape of F around its critical point tells.

use glam::DVec2;

use super::Rect;
use crate::bernstein::{Bivariate, Interval};

/// The shape of F around a place.
pub(super) enum Shape {
    /// One critical point, a saddle: two branches that cross there, or pass each other within the place.
    Saddle(DVec2),
    /// One critical point, an extremum: a point, or a loop within the place, or nothing.
    Extremum,
    /// Not decided.
    Unknown,
}

/// The shape of `f` around `place`, a rectangle in which it is no larger than some multiple of `rounding`.
///
/// The second derivatives are formed before they are restricted to the place, so that unlike F they are known well
/// there. Where the Hessian's determinant keeps its sign, the gradient is one-to-one near its zero: Newton's method finds
/// the critical point, in the place or within its width of it.
pub(super) fn shape(f: &Bivariate, place: &Rect, rounding: f64) -> Shape {
    let (fu, fv) = (f.derivative_u(), f.derivative_v());
    let second = [fu.derivative_u(), fu.derivative_v(), fv.derivative_v()];
    let wide = |[a, b]: [f64; 2]| [(a - (b - a)).max(0.0), (b + (b - a)).min(1.0)];
    let (u, v) = (wide(place.u), wide(place.v));
    // Two differences of coefficients, each times the degree.
    let degree = f.degree_u().max(f.degree_v()) as f64;
    let doubt = 4.0 * degree * degree * rounding;
    let [uu, uv, vv] = second.each_ref().map(|g| Interval::new(g.restricted(u, v).bounds()).widened(doubt));
    let Some(determinant) = (uu * vv - uv.squared()).sign() else { return Shape::Unknown };
    let mut p = DVec2::new(0.5 * (place.u[0] + place.u[1]), 0.5 * (place.v[0] + place.v[1]));
    for _ in 0..8 {
        let (gu, gv) = (fu.eval(p.x, p.y), fv.eval(p.x, p.y));
        let [a, b, c] = second.each_ref().map(|g| g.eval(p.x, p.y));
        let step = DVec2::new(c * gu - b * gv, a * gv - b * gu) / (a * c - b * b);
        p -= step;
        if !p.is_finite() || step.abs().max_element() <= f64::EPSILON {
            break;
        }
    }
    let near = |x: f64, [a, b]: [f64; 2]| x >= a - (b - a) && x <= b + (b - a);
    if !(near(p.x, place.u) && near(p.y, place.v)) {
        return Shape::Unknown;
    }
    // A critical point this near to the border of the square is on it.
    let snapped = |x: f64, [a, b]: [f64; 2]| {
        if a == 0.0 {
            0.0
        } else if b == 1.0 {
            1.0
        } else {
            x
        }
    };
    if determinant > 0.0 {
        Shape::Extremum
    } else {
        Shape::Saddle(DVec2::new(snapped(p.x, place.u), snapped(p.y, place.v)))
    }
}
