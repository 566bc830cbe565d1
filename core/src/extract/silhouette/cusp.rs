//! Where the projection of a silhouette has cusps: exactly where, and proof that there are no others.
//!
//! On F = 0 the silhouette runs along (F_v, −F_u), and its image on the screen along G = F_v ∇_u x − F_u ∇_v x with
//! x = (X, Y) / W. Multiplied by W², both components of G are tensor polynomials. A cusp (a curtain fold) is a place
//! where the sight line is tangent to the silhouette, G = 0. On a rectangle around a piece of the silhouette the
//! coefficients decide:
//!
//! - all G in one open half plane: no cusp;
//! - a component A of G strictly monotone along the silhouette: one where A changes sign, else none;
//! - neither: the piece is halved.

use alloc::vec::Vec;

use glam::DVec2;

use super::Segment;
use super::walk::bracketed;
use crate::bernstein::{Bivariate, Interval};
use crate::extract::facing::{FacingForm, coordinate_rounding};
use crate::extract::zero_set::{Rect, Variable};
use crate::view::Patch;

/// Halvings until a piece counts as a point: a pair of cusps nearer than 2⁻²⁶ = √(2⁻⁵²) of a patch is no larger on the
/// screen than the rounding of coordinates, for the distance on the screen grows with the square at a cusp, or slower.
const MAX_DEPTH: u32 = 26;

/// Halvings from which on a piece is left at that when its ends and its middle are one point on the screen to rounding.
/// A larger one may have been elsewhere between them.
const POINT_DEPTH: u32 = 8;

/// Where a piece is cut: not in the middle, for models are symmetric, and their cusps love it.
const RATIOS: [f64; 3] = [0.4871, 0.5227, 0.4393];

/// Pieces looked at along one arc until the rest is undecided. A cusp asks for some 20; only where a silhouette runs
/// along the sight line, or nearly so, does nothing end the halving.
const MAX_PIECES: usize = 1 << 11;

/// The screen tangent of the silhouettes of one patch as polynomials.
pub(super) struct CuspForm {
    g: [Bivariate; 2],
    /// Bound of the rounding in each coefficient.
    rounding: f64,
}

/// A point of an arc as the search sees it.
#[derive(Clone, Copy)]
pub(super) struct Probe {
    pub(super) local: DVec2,
    pub(super) screen: DVec2,
    /// How far on the screen rounding, of coordinates and of F, may have moved it.
    pub(super) blur: f64,
    /// Length of the screen tangent, negative where it points against the normal turned a right angle, and 0 where it
    /// is no larger than its rounding.
    pub(super) advance: f64,
}

impl CuspForm {
    /// Forms G from the patch and its reduced facing polynomial, of bidegree (m + 2p − 1, n + 2q − 1) for a rational
    /// patch of bidegree (p, q) with F of bidegree (m, n), (m + p − 1, n + q − 1) for a polynomial one.
    pub(super) fn new(patch: &Patch, f: &Bivariate, f_rounding: f64) -> Self {
        let (fu, fv) = (f.derivative_u(), f.derivative_v());
        let middle = patch.eval(0.5, 0.5).truncate();
        let w = patch.coordinate(3);
        let plain = patch.is_polynomial();
        let mut largest = 0.0_f64;
        let mut size = 0.0_f64;
        let g = [0, 1].map(|k| {
            // About the middle of the patch, which moves nothing and keeps rounding relative to the patch.
            let x = patch.coordinate(k).sub(&w.scaled(middle[k]));
            size = size.max(x.magnitude());
            let (xu, xv) = if plain {
                (x.derivative_u(), x.derivative_v())
            } else {
                let quotient = |dx: &Bivariate, dw: &Bivariate| dx.mul(&w).sub(&x.mul(dw));
                (quotient(&x.derivative_u(), &w.derivative_u()), quotient(&x.derivative_v(), &w.derivative_v()))
            };
            largest = largest.max(xu.magnitude()).max(xv.magnitude());
            fv.mul(&xu).sub(&fu.mul(&xv))
        });
        // Rounding with which the derivatives arrive, times what they are multiplied by, and that of the products.
        let degree = patch.degree_u.max(patch.degree_v) as f64;
        let f_degree = f.degree_u().max(f.degree_v()) as f64;
        let w_largest = w.magnitude();
        let spread = if plain { w_largest } else { 2.0 * w_largest * w_largest };
        let x_rounding = 4.0 * degree * spread * (coordinate_rounding(patch) + 4.0 * degree * f64::EPSILON * size);
        let f_slope = 2.0 * f_degree * f.magnitude();
        let products = 4.0 * (degree + f_degree) * f64::EPSILON * f_slope * largest;
        Self { g, rounding: 2.0 * (2.0 * f_degree * f_rounding * largest + f_slope * x_rounding) + products }
    }

    fn at(&self, p: DVec2) -> DVec2 {
        DVec2::new(self.g[0].eval(p.x, p.y), self.g[1].eval(p.x, p.y))
    }
}

/// What is known of the cusps on an arc.
#[derive(Default)]
pub(super) struct Cusps {
    /// Pieces of the arc with one cusp each, in order: first and last point, at which the screen tangent has opposite
    /// directions.
    pub(super) brackets: Vec<[DVec2; 2]>,
    /// Pieces that may hold any number.
    pub(super) undecided: Vec<Rect>,
}

/// Seeks the cusps between two points of one arc; `probe` looks at a point of it.
///
/// A cusp at an end is not listed: there is one if the advance has opposite signs on the two sides of that end.
pub(super) fn cusps_of(
    form: &FacingForm,
    cusp_form: &CuspForm,
    segment: &Segment,
    ends: [DVec2; 2],
    probe: &impl Fn(DVec2) -> Probe,
) -> Cusps {
    let mut search = Search {
        form,
        cusp_form,
        segment,
        probe,
        pieces: 0,
        found: Cusps { brackets: Vec::new(), undecided: Vec::new() },
    };
    search.piece(ends.map(probe), 0);
    search.found
}

struct Search<'a, P> {
    form: &'a FacingForm,
    cusp_form: &'a CuspForm,
    segment: &'a Segment,
    probe: &'a P,
    pieces: usize,
    found: Cusps,
}

enum Verdict {
    None,
    AtMostOne,
    Unknown,
}

impl<P: Fn(DVec2) -> Probe> Search<'_, P> {
    fn piece(&mut self, [a, b]: [Probe; 2], depth: u32) {
        self.pieces += 1;
        let turned = a.advance * b.advance < 0.0;
        let wide = 0.25 * (b.local - a.local).abs().max_element();
        let rect = around(self.segment, a.local, b.local, wide);
        let mut verdict = self.judge(&rect, a.local, b.local, turned);
        if matches!(verdict, Verdict::None) {
            return;
        }
        let middle = self.between(a.local, b.local);
        if matches!(verdict, Verdict::Unknown) {
            // Close to a pole G fades towards the pole, so that what is wide compared with the distance to it decides
            // nothing. An arc that hardly bends needs no wide rectangle.
            let slim = self.bulge(a.local, middle.local, b.local);
            if slim < 0.25 * wide {
                verdict = self.judge(&around(self.segment, a.local, b.local, slim), a.local, b.local, turned);
            }
        }
        // Towards a crossing of silhouettes, and where one runs along the sight line, nothing is decided; but what is a
        // point on the screen, as far as its points are known, need not be.
        let far = |p: &Probe| p.screen.distance(middle.screen) > p.blur + middle.blur;
        let point = depth >= MAX_DEPTH
            || middle.local == a.local
            || middle.local == b.local
            || (depth >= POINT_DEPTH && !far(&a) && !far(&b));
        match verdict {
            Verdict::None => {}
            Verdict::Unknown if !point && self.pieces >= MAX_PIECES => self.found.undecided.push(rect),
            Verdict::Unknown if !point => {
                self.piece([a, middle], depth + 1);
                self.piece([middle, b], depth + 1);
            }
            Verdict::AtMostOne | Verdict::Unknown => {
                if turned {
                    self.found.brackets.push([a.local, b.local]);
                }
            }
        }
    }

    /// A point near the middle: one at which the advance is not 0, for a cusp right there would be lost to both sides.
    fn between(&self, a: DVec2, b: DVec2) -> Probe {
        let at = |ratio: f64| (self.probe)(bracketed(self.form, self.segment, a, b, ratio).0);
        let first = at(RATIOS[0]);
        if first.advance != 0.0 {
            return first;
        }
        RATIOS[1..].iter().map(|&r| at(r)).find(|p| p.advance != 0.0).unwrap_or(first)
    }

    /// How far an arc bulges over its ends, to the side of its dependent parameter: twice what it does at its point
    /// `middle`, and what rounding needs.
    fn bulge(&self, a: DVec2, middle: DVec2, b: DVec2) -> f64 {
        let k = usize::from(self.segment.axis == Variable::U);
        let fraction = (middle[1 - k] - a[1 - k]) / (b[1 - k] - a[1 - k]);
        let off_chord = middle[k] - (a[k] + fraction * (b[k] - a[k]));
        let slope = self.form.gradient(middle.x, middle.y)[1 + k];
        2.0 * off_chord.abs() + 8.0 * self.form.rounding / slope.abs()
    }

    fn judge(&self, rect: &Rect, a: DVec2, b: DVec2, turned: bool) -> Verdict {
        let Some(polynomial) = &self.form.polynomial else { return Verdict::None };
        let f = polynomial.restricted(rect.u, rect.v);
        if !self.encloses(&f, rect) {
            return Verdict::Unknown;
        }
        let [x, y] = self.cusp_form.g.each_ref().map(|g| g.restricted(rect.u, rect.v));
        let rounding = self.cusp_form.rounding;
        if !turned && x.magnitude() <= rounding && y.magnitude() <= rounding {
            // The silhouette runs along the sight line: its image is a point, without direction.
            return Verdict::None;
        }
        let (ga, gb) = (self.cusp_form.at(a), self.cusp_form.at(b));
        let component =
            |d: DVec2| Bivariate::from_fn(x.degree_u(), x.degree_v(), |i, j| d.x * x.get(i, j) + d.y * y.get(i, j));
        if !turned {
            let Some(d) = (ga + gb).try_normalize() else { return Verdict::Unknown };
            return if component(d).bounds().0 > 2.0 * rounding { Verdict::None } else { Verdict::Unknown };
        }
        let Some(d) = (gb - ga).try_normalize() else { return Verdict::Unknown };
        // The derivative of A along (F_v, −F_u).
        let along = component(d);
        let [au, av, fu, fv] = [along.derivative_u(), along.derivative_v(), f.derivative_u(), f.derivative_v()]
            .map(|p| Interval::new(p.bounds()));
        // Coefficients of a derivative carry twice the degree of the rounding.
        let degree = 2.0 * along.degree_u().max(along.degree_v()) as f64;
        let of_a = 2.0 * rounding * (fu.magnitude() + fv.magnitude());
        let of_f = self.form.rounding * (au.magnitude() + av.magnitude());
        match (au * fv - av * fu).widened(degree * (of_a + of_f)).sign() {
            Some(_) => Verdict::AtMostOne,
            None => Verdict::Unknown,
        }
    }

    /// Whether the arc between the independent ends of the rectangle is proven to stay inside: F has its signs along
    /// the two long sides, or these are those of the arc's own cell.
    fn encloses(&self, f: &Bivariate, rect: &Rect) -> bool {
        let over_u = self.segment.axis == Variable::U;
        let y = if over_u { rect.v } else { rect.u };
        let (n, m) = (f.degree_u(), f.degree_v());
        let sign = if self.segment.rising { 1.0 } else { -1.0 };
        let side = |high: bool| {
            let s = if high { sign } else { -sign };
            let clear = |c: f64| s * c > 2.0 * self.form.rounding;
            if over_u {
                (0..=n).all(|i| clear(f.get(i, if high { m } else { 0 })))
            } else {
                (0..=m).all(|j| clear(f.get(if high { n } else { 0 }, j)))
            }
        };
        let [low, high] = self.segment.bracket;
        (y[0] <= low || side(false)) && (y[1] >= high || side(true))
    }
}

/// A rectangle around two points of an arc, wider by `margin` on the sides that the arc might bulge over.
fn around(segment: &Segment, a: DVec2, b: DVec2, margin: f64) -> Rect {
    let (low, high) = (a.min(b), a.max(b));
    let widened = |lo: f64, hi: f64| {
        [(lo - margin).max(segment.bracket[0].min(lo)), (hi + margin).min(segment.bracket[1].max(hi))]
    };
    match segment.axis {
        Variable::U => Rect { u: [low.x, high.x], v: widened(low.y, high.y) },
        Variable::V => Rect { u: widened(low.x, high.x), v: [low.y, high.y] },
    }
}
