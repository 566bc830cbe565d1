//! Which way a patch faces: the sign of its normal's z as a polynomial.
//!
//! With homogeneous view coordinates P = (X, Y, W), the determinant F = det [P, P_u, P_v] equals W³ N_z, so for W > 0
//! it has the sign of the normal's z component everywhere (Elber and Cohen 1989, eq. 1, for rational patches). It is a
//! tensor polynomial, and its Bernstein coefficients are certificates: all of one sign, and the patch is front- or
//! back-facing with no silhouette inside.
//!
//! Writing P as the last step of de Casteljau, P = ∑ bᵢ(u) bⱼ(v) aᵢⱼ over the four corners with aᵢⱼ of bidegree
//! (p − 1, q − 1), the determinant becomes bilinear in the corners' own determinants,
//!
//! ```text
//! F = p q ∑ bᵢ(u) bⱼ(v) det [aᵢⱼ, a₁ⱼ − a₀ⱼ, aᵢ₁ − aᵢ₀],        i, j ∈ {0, 1}
//! ```
//!
//! which forms it with the leading terms already cancelled: bidegree (3p − 2, 3q − 2), and (2p − 1, 2q − 1) where W is
//! constant. No coefficient suffers more rounding than its own terms.

use glam::{DVec2, DVec3, DVec4};

use crate::bernstein::Bivariate;
use crate::stop::Stop;
use crate::view::{MAX_DEGREE, Patch};

/// Unit roundoff of f64, 2⁻⁵³.
const ROUNDOFF: f64 = f64::EPSILON / 2.0;

/// Highest degree of F in one variable, 3 · [`MAX_DEGREE`] − 2; sizes the scratch of evaluations.
const MAX_FORM_DEGREE: usize = 3 * MAX_DEGREE - 2;

/// Rounding that view coordinates carry when they arrive, in units of roundoff times the largest coordinate: four
/// products and sums of the view transform, as much again for its rounded matrix, and Bézier extraction before it. What
/// a perspective camera's translation cancels is not in the coordinates any more, nor in this bound: a model far from
/// the origin compared with its size should be moved there first.
const INPUT_ROUNDINGS: f64 = 16.0;

/// The side of a patch that the eye sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facing {
    /// N_z > 0 in the whole interior.
    Front,
    /// N_z < 0 in the whole interior.
    Back,
    /// Both signs, or not decided by the coefficients.
    Mixed,
    /// N_z = 0 to rounding everywhere: no area on the screen.
    EdgeOn,
}

/// The polynomial F of one patch, freed of factors that vanish on patch edges, and what its coefficients prove.
#[derive(Clone, Debug, PartialEq)]
pub struct FacingForm {
    /// What the coefficients prove.
    pub facing: Facing,
    /// F divided by its edge factors, in local parameters; its sign in the interior is the sign of N_z. Coefficients
    /// within `rounding` of nought are exactly 0. `None` where the patch was decided without forming F
    /// ([`Facing::Front`] or [`Facing::Back`] by first differences) and for [`Facing::EdgeOn`].
    pub polynomial: Option<Bivariate>,
    /// How often u, 1 − u, v and 1 − v divide F, in this order (edges u = 0, u = 1, v = 0, v = 1).
    ///
    /// On an edge that is not collapsed a factor means that the whole edge is seen edge-on: an odd multiplicity, on
    /// this patch alone, makes F change sign if the polynomial is continued across the edge.
    pub edge_factor: [u8; 4],
    /// Whether the edge is one point in space (a pole), in the order of `edge_factor`.
    pub collapsed: [bool; 4],
    /// Bound of the rounding in each coefficient of `polynomial`, including that of the view coordinates themselves.
    pub rounding: f64,
}

/// How patches were classified.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FacingStats {
    /// Patches looked at.
    pub patches: usize,
    /// Decided front or back by first differences (Elber and Cohen 1989, lemma 3.1), F not formed.
    pub by_differences: usize,
    /// Decided front or back by the coefficients of F.
    pub by_coefficients: usize,
    /// Edge-on.
    pub edge_on: usize,
    /// Left for the search for silhouettes.
    pub mixed: usize,
}

/// F = det [P, P_u, P_v], P = (X, Y, W), by local parameters: the sign of N_z where W > 0.
///
/// Bidegree (2p − 1, 2q − 1) for a patch with constant W (F is then normalised by W³: it *is* N_z), else
/// (3p − 2, 3q − 2). Edge factors are still in it; see [`facing`]. Cost: about 100 p² q² multiplications at most.
#[must_use]
pub fn facing_polynomial(patch: &Patch) -> Bivariate {
    form(patch).0
}

/// Classifies a patch, forming F unless first differences decide.
#[must_use]
pub fn facing(patch: &Patch) -> FacingForm {
    let collapsed = collapsed_edges(patch);
    let plain = |facing, rounding| FacingForm { facing, polynomial: None, edge_factor: [0; 4], collapsed, rounding };
    if let Some(facing) = by_differences(patch) {
        return plain(facing, 0.0);
    }
    let (polynomial, rounding) = form(patch);
    if polynomial.magnitude() <= rounding {
        return plain(Facing::EdgeOn, rounding);
    }
    let (polynomial, edge_factor, rounding) = reduce(polynomial, rounding);
    let (lo, hi) = polynomial.bounds();
    if lo == 0.0 && hi == 0.0 {
        return FacingForm { edge_factor, ..plain(Facing::EdgeOn, rounding) };
    }
    // A Bernstein basis function is positive inside: coefficients of weakly one sign, not all 0, decide the interior.
    let facing = if lo >= 0.0 {
        Facing::Front
    } else if hi <= 0.0 {
        Facing::Back
    } else {
        Facing::Mixed
    };
    FacingForm { facing, polynomial: Some(polynomial), edge_factor, collapsed, rounding }
}

/// Classifies every patch, with counts.
#[must_use]
pub fn facing_of_all(patches: &[Patch], stop: Stop<'_>) -> (alloc::vec::Vec<FacingForm>, FacingStats) {
    let going = patches.iter().take_while(|_| !stop.is_wanted());
    let mut forms = alloc::vec::Vec::with_capacity(patches.len());
    forms.extend(going.map(facing));
    let mut stats = FacingStats { patches: forms.len(), ..FacingStats::default() };
    for f in &forms {
        match f.facing {
            Facing::EdgeOn => stats.edge_on += 1,
            Facing::Mixed => stats.mixed += 1,
            Facing::Front | Facing::Back if f.polynomial.is_none() => stats.by_differences += 1,
            Facing::Front | Facing::Back => stats.by_coefficients += 1,
        }
    }
    (forms, stats)
}

impl FacingForm {
    /// The reduced polynomial and its two partial derivatives at the local point (u, v), no allocation; zeros where no
    /// polynomial was formed. O(p q) for bidegree (p, q).
    #[must_use]
    pub fn gradient(&self, u: f64, v: f64) -> [f64; 3] {
        let Some(f) = &self.polynomial else { return [0.0; 3] };
        let (p, q) = (f.degree_u(), f.degree_v());
        let (mut bu, mut bv) = ([0.0; MAX_FORM_DEGREE + 1], [0.0; MAX_FORM_DEGREE + 1]);
        let (mut du, mut dv) = ([0.0; MAX_FORM_DEGREE + 1], [0.0; MAX_FORM_DEGREE + 1]);
        basis(p, u, &mut bu, &mut du);
        basis(q, v, &mut bv, &mut dv);
        let mut out = [0.0; 3];
        for (i, row) in f.coefficients().chunks_exact(q + 1).enumerate() {
            let (mut value, mut slope) = (0.0, 0.0);
            for (j, c) in row.iter().enumerate() {
                value += c * bv[j];
                slope += c * dv[j];
            }
            out[0] += bu[i] * value;
            out[1] += du[i] * value;
            out[2] += bu[i] * slope;
        }
        out
    }

    /// The reduced polynomial at the local point (u, v), no allocation; 0 where none was formed. O(p q).
    #[must_use]
    pub fn value(&self, u: f64, v: f64) -> f64 {
        let Some(f) = &self.polynomial else { return 0.0 };
        let (p, q) = (f.degree_u(), f.degree_v());
        let (mut bu, mut bv) = ([0.0; MAX_FORM_DEGREE + 1], [0.0; MAX_FORM_DEGREE + 1]);
        let mut unused = [0.0; MAX_FORM_DEGREE + 1];
        basis(p, u, &mut bu, &mut unused);
        basis(q, v, &mut bv, &mut unused);
        let rows = f.coefficients().chunks_exact(q + 1).zip(&bu);
        rows.fold(0.0, |sum, (row, b)| sum + b * row.iter().zip(&bv).fold(0.0, |s, (c, b)| s + c * b))
    }

    /// What the reduced polynomial is divided by to give N_z / |N|, the cosine between normal and sight line, at a local
    /// point of `patch`, whose form this is; `normal` is |N| there.
    #[must_use]
    pub fn unit(&self, patch: &Patch, local: DVec2, normal: f64) -> f64 {
        let factors = [local.x, 1.0 - local.x, local.y, 1.0 - local.y];
        let reduced = factors.iter().zip(&self.edge_factor).fold(1.0, |m, (x, &k)| m * libm::pow(*x, f64::from(k)));
        // F is W³ N_z; with constant W it is formed of Cartesian points, and is N_z.
        let w = if patch.is_polynomial() { 1.0 } else { patch.homogeneous_jet(local.x, local.y)[0].w };
        normal * w * w * w / reduced
    }
}

/// A univariate restriction of F with room for the highest degree, so that walking along a silhouette allocates nothing.
#[derive(Clone, Debug)]
pub(super) struct LineForm {
    degree: usize,
    coef: [f64; MAX_FORM_DEGREE + 1],
}

impl LineForm {
    /// F on the line u = `x` (`along_v`) or v = `x`, as a polynomial in the other variable.
    pub(super) fn new(f: &Bivariate, along_v: bool, x: f64) -> Self {
        let (p, q) = (f.degree_u(), f.degree_v());
        let mut b = [0.0; MAX_FORM_DEGREE + 1];
        let mut unused = [0.0; MAX_FORM_DEGREE + 1];
        let mut coef = [0.0; MAX_FORM_DEGREE + 1];
        basis(if along_v { p } else { q }, x, &mut b, &mut unused);
        for (i, row) in f.coefficients().chunks_exact(q + 1).enumerate() {
            for (j, c) in row.iter().enumerate() {
                if along_v {
                    coef[j] += b[i] * c;
                } else {
                    coef[i] += b[j] * c;
                }
            }
        }
        Self { degree: if along_v { q } else { p }, coef }
    }

    /// Value and derivative at `y`.
    pub(super) fn eval(&self, y: f64) -> (f64, f64) {
        let (mut b, mut d) = ([0.0; MAX_FORM_DEGREE + 1], [0.0; MAX_FORM_DEGREE + 1]);
        basis(self.degree, y, &mut b, &mut d);
        let n = self.degree + 1;
        self.coef[..n].iter().zip(b.iter().zip(&d)).fold((0.0, 0.0), |(f, s), (c, (b, d))| (f + c * b, s + c * d))
    }
}

/// Values and derivatives of the Bernstein basis of degree `n` at `t`, by the triangle recurrence.
fn basis(n: usize, t: f64, b: &mut [f64; MAX_FORM_DEGREE + 1], d: &mut [f64; MAX_FORM_DEGREE + 1]) {
    b[0] = 1.0;
    for m in 1..=n {
        if m == n {
            // The row before the last gives the derivatives, Bᵢⁿ' = n (Bᵢ₋₁ⁿ⁻¹ − Bᵢⁿ⁻¹).
            d[0] = -(n as f64) * b[0];
            for i in 1..n {
                d[i] = n as f64 * (b[i - 1] - b[i]);
            }
            d[n] = n as f64 * b[n - 1];
        }
        b[m] = t * b[m - 1];
        for i in (1..m).rev() {
            b[i] = (1.0 - t) * b[i] + t * b[i - 1];
        }
        b[0] *= 1.0 - t;
    }
}

/// Largest absolute Cartesian coordinate of the control points.
fn extent(patch: &Patch) -> f64 {
    patch.points.iter().fold(0.0, |m, p| m.max((p.truncate() / p.w).abs().max_element()))
}

/// Bound of the rounding with which Cartesian view coordinates of a patch arrive.
pub(super) fn coordinate_rounding(patch: &Patch) -> f64 {
    INPUT_ROUNDINGS * ROUNDOFF * extent(patch)
}

/// Whether each edge (u = 0, u = 1, v = 0, v = 1) is one point in space, to the rounding of the coordinates.
fn collapsed_edges(patch: &Patch) -> [bool; 4] {
    let (p, q, w) = (patch.degree_u, patch.degree_v, patch.degree_v + 1);
    let near = 2.0 * coordinate_rounding(patch);
    let point = |k: usize| patch.points[k].truncate() / patch.points[k].w;
    let one = |first: usize, step: usize, n: usize| {
        let origin: DVec3 = point(first);
        (1..=n).all(|k| (point(first + k * step) - origin).abs().max_element() <= near)
    };
    [one(0, 1, q), one(p * w, 1, q), one(0, w, p), one(q, w, p)]
}

/// Least ratio of a length to the coordinates, and of a slanted frame, with which first differences decide.
const SLANT: f64 = 1.0 / 65536.0;

/// What is larger than this, where rounding makes 2⁻¹⁶ at most, is beyond doubt positive.
const SURE: f64 = 1.0 / 1024.0;

/// Lemma 3.1 of Elber and Cohen 1989 for a polynomial patch: bounds of x_u, x_v, y_u and y_v by first differences of
/// control points, and with them of N_z = x_u y_v − y_u x_v. O(p q).
///
/// The lemma holds in any affine frame of the screen; in the frame of the patch's two mean tangents x_u and y_v are
/// near 1 and the other two near 0, which is where the bound is tightest.
fn by_differences(patch: &Patch) -> Option<Facing> {
    if !patch.is_polynomial() {
        return by_directions(patch);
    }
    let (p, q, w) = (patch.degree_u, patch.degree_v, patch.degree_v + 1);
    let at = |i: usize, j: usize| -> DVec2 { patch.points[i * w + j].truncate().truncate() };
    let mean_u = (0..=q).fold(DVec2::ZERO, |s, j| s + (at(p, j) - at(0, j))) / (w * p) as f64;
    let mean_v = (0..=p).fold(DVec2::ZERO, |s, i| s + (at(i, q) - at(i, 0))) / ((p + 1) * q) as f64;
    let det = mean_u.perp_dot(mean_v);
    // With the tangents no shorter than 2⁻¹⁶ of the coordinates and the frame no more slanted than 2⁻¹⁶, differences
    // are known in it to 2⁻⁵³ · 2³² · 2 · INPUT_ROUNDINGS = 2⁻¹⁶; a bound on N_z above `SURE` is then beyond doubt.
    const LARGEST: f64 = 8.0;
    let (lu, lv) = (mean_u.length(), mean_v.length());
    let extent = patch.points.iter().fold(0.0_f64, |m, p| m.max(p.truncate().abs().max_element()));
    if !(det.abs() > SLANT * lu * lv && lu.min(lv) > SLANT * extent) {
        return None;
    }
    let mut u = [DVec2::INFINITY, DVec2::NEG_INFINITY];
    let mut v = u;
    let put = |hull: &mut [DVec2; 2], d: DVec2| {
        let c = DVec2::new(d.perp_dot(mean_v), mean_u.perp_dot(d)) / det;
        *hull = [hull[0].min(c), hull[1].max(c)];
    };
    for i in 0..=p {
        for j in 0..=q {
            if i < p {
                put(&mut u, at(i + 1, j) - at(i, j));
            }
            if j < q {
                put(&mut v, at(i, j + 1) - at(i, j));
            }
        }
    }
    let largest = [u[0], u[1], v[0], v[1]].iter().fold(0.0_f64, |m, d| m.max(d.abs().max_element()));
    // Lower bound of x_u y_v − y_u x_v over the hulls; the first factors are positive.
    let across = (u[0].y * v[0].x).max(u[0].y * v[1].x).max(u[1].y * v[0].x).max(u[1].y * v[1].x);
    let sure = largest <= LARGEST && u[0].x > 0.0 && v[0].y > 0.0 && u[0].x * v[0].y - across > SURE;
    sure.then_some(if det > 0.0 { Facing::Front } else { Facing::Back })
}

/// Lemma 3.1 for a rational patch: bounds of the directions of S_u and S_v on the screen, by the coefficients of
/// W² S_u = (X_u W − X W_u, Y_u W − Y W_u) and of W² S_v. Eight products of nets, where F takes thirty-six.
///
/// Bernstein functions are positive, so that each derivative lies in the cone of its coefficients. If every direction of
/// the one is less than half a turn to the right of every direction of the other, N_z is positive.
fn by_directions(patch: &Patch) -> Option<Facing> {
    let w = patch.coordinate(3);
    let middle = patch.eval(0.5, 0.5).truncate();
    let [x, y] = [0, 1].map(|k| patch.coordinate(k).sub(&w.scaled(middle[k])));
    let least = SLANT * x.magnitude().max(y.magnitude()).max(extent(patch) * w.magnitude()) * w.magnitude();
    let quotient = |a: &Bivariate, da: &Bivariate, dw: &Bivariate| da.mul(&w).sub(&a.mul(dw));
    let (wu, wv) = (w.derivative_u(), w.derivative_v());
    let u = cone(&quotient(&x, &x.derivative_u(), &wu), &quotient(&y, &y.derivative_u(), &wu), least)?;
    let v = cone(&quotient(&x, &x.derivative_v(), &wv), &quotient(&y, &y.derivative_v(), &wv), least)?;
    // The corners of a product of two cones narrower than half a turn.
    let turns = [(u[0], v[0]), (u[0], v[1]), (u[1], v[0]), (u[1], v[1])].map(|(a, b)| a.perp_dot(b));
    if turns.iter().all(|&t| t > SURE) {
        Some(Facing::Front)
    } else if turns.iter().all(|&t| t < -SURE) {
        Some(Facing::Back)
    } else {
        None
    }
}

/// The two unit vectors that bound the directions of the coefficients (x, y); none if one of these is no longer than
/// `least`, so that its direction is not known, or if they spread over nearly half a turn.
fn cone(x: &Bivariate, y: &Bivariate, least: f64) -> Option<[DVec2; 2]> {
    let all = || x.coefficients().iter().zip(y.coefficients()).map(|(&x, &y)| DVec2::new(x, y));
    let middle = all().fold(DVec2::ZERO, |sum, d| sum + d.normalize_or_zero()).try_normalize()?;
    // Tangents of the angles from the middle, least and largest.
    let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
    for d in all() {
        let ahead = middle.dot(d);
        if !(d.length() > least && ahead > SURE * d.length()) {
            return None;
        }
        let tangent = middle.perp_dot(d) / ahead;
        (lo, hi) = (lo.min(tangent), hi.max(tangent));
    }
    Some([lo, hi].map(|t| (middle + middle.perp() * t).normalize()))
}

/// Coordinates of the corner nets: (X − x₀ W, Y − y₀ W, W) with the screen centre (x₀, y₀) of the patch, which changes
/// the determinant by nothing and its rounding by much.
struct Centred<'a> {
    patch: &'a Patch,
    centre: DVec2,
    /// Constant weight to divide by, or 1.
    weight: f64,
}

impl Centred<'_> {
    fn at(&self, i: usize, j: usize) -> DVec3 {
        let p: DVec4 = self.patch.points[i * (self.patch.degree_v + 1) + j] / self.weight;
        DVec3::new(p.x - self.centre.x * p.w, p.y - self.centre.y * p.w, p.w)
    }

    /// Coordinate polynomials, of bidegree (p − 1, q − 1), of a combination of control points.
    fn net(&self, f: impl Fn(&Self, usize, usize) -> DVec3) -> [Bivariate; 3] {
        let (p, q) = (self.patch.degree_u, self.patch.degree_v);
        [0, 1, 2].map(|k| Bivariate::from_fn(p - 1, q - 1, |i, j| f(self, i, j)[k]))
    }
}

/// F with a bound of the rounding in each coefficient.
pub(super) fn form(patch: &Patch) -> (Bivariate, f64) {
    let (p, q) = (patch.degree_u, patch.degree_v);
    let polynomial = patch.is_polynomial();
    let (lo, hi) = patch.points.iter().fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(lo, hi), h| {
        let s = DVec2::new(h.x, h.y) / h.w;
        (lo.min(s), hi.max(s))
    });
    let weight = if polynomial { patch.points[0].w } else { 1.0 };
    let c = Centred { patch, centre: 0.5 * (lo + hi), weight };
    let du = [0, 1].map(|j0| c.net(|c, i, j| c.at(i + 1, j + j0) - c.at(i, j + j0)));
    let dv = [0, 1].map(|i0| c.net(|c, i, j| c.at(i + i0, j + 1) - c.at(i + i0, j)));
    let corner = |i0: usize, j0: usize| {
        let (a, b) = (&du[j0], &dv[i0]);
        let minor = |k: usize, l: usize| a[k].mul(&b[l]).sub(&a[l].mul(&b[k]));
        if polynomial {
            return minor(0, 1);
        }
        let at = c.net(|c, i, j| c.at(i + i0, j + j0));
        at[0].mul(&minor(1, 2)).add(&at[1].mul(&minor(2, 0))).add(&at[2].mul(&minor(0, 1)))
    };
    let d = [[corner(0, 0), corner(0, 1)], [corner(1, 0), corner(1, 1)]];
    let (n, m) = (d[0][0].degree_u() + 1, d[0][0].degree_v() + 1);
    let scale = (p * q) as f64;
    let f = Bivariate::from_fn(n, m, |i, j| {
        // b₀ Bᵢⁿ⁻¹ = (n − i)/n Bᵢⁿ and b₁ Bᵢ₋₁ⁿ⁻¹ = i/n Bᵢⁿ.
        let (a, b) = (i as f64 / n as f64, j as f64 / m as f64);
        let get = |k: usize, l: usize| {
            let inside = i >= k && i - k < n && j >= l && j - l < m;
            if inside { d[k][l].get(i - k, j - l) } else { 0.0 }
        };
        scale * ((1.0 - a) * ((1.0 - b) * get(0, 0) + b * get(0, 1)) + a * ((1.0 - b) * get(1, 0) + b * get(1, 1)))
    });
    let rounding = scale * rounding_of_corners(patch, &c, &du, &dv, polynomial);
    (f, rounding)
}

/// Bound of the rounding in a corner determinant: for every term of the expansion the rounding of the products formed
/// from it, and the products with one factor replaced by the rounding with which it arrived.
fn rounding_of_corners(
    patch: &Patch,
    c: &Centred<'_>,
    du: &[[Bivariate; 3]; 2],
    dv: &[[Bivariate; 3]; 2],
    polynomial: bool,
) -> f64 {
    let size = |d: &[[Bivariate; 3]; 2], k: usize| d[0][k].magnitude().max(d[1][k].magnitude());
    let w = patch.points.iter().fold(0.0_f64, |m, p| m.max(p.w / c.weight));
    // Coordinates arrive with rounding relative to the whole point (a rotation mixes them), weights relative to theirs.
    let arrived = INPUT_ROUNDINGS * ROUNDOFF * w;
    let delta = [arrived * extent(patch), arrived * extent(patch), if polynomial { 0.0 } else { arrived }];
    // A coefficient of a product of two or three nets sums at most p q terms twice, each with some eight roundings.
    let gamma = (2 * patch.degree_u * patch.degree_v + 16) as f64 * ROUNDOFF;
    let minor = |k: usize, l: usize| {
        let (a, b, s, t) = (size(du, k), size(dv, l), size(du, l), size(dv, k));
        let value = a * b + s * t;
        let error = gamma * value + 2.0 * (delta[l] * (a + t) + delta[k] * (b + s));
        (value, error)
    };
    if polynomial {
        return minor(0, 1).1;
    }
    let mut size_at = DVec3::ZERO;
    for i in 0..=patch.degree_u {
        for j in 0..=patch.degree_v {
            size_at = size_at.max(c.at(i, j).abs());
        }
    }
    [(0, 1, 2), (1, 2, 0), (2, 0, 1)].iter().fold(0.0, |sum, &(k, l, m)| {
        let (value, error) = minor(l, m);
        sum + size_at[k] * (error + gamma * value) + delta[k] * value
    })
}

/// Divides out u, 1 − u, v and 1 − v as often as the coefficients along that edge vanish to rounding, then sets what
/// is within rounding of nought to 0. Returns the quotient, the multiplicities and the grown rounding bound.
///
/// The division is exact: Bᵢⁿ = u (n / i) Bᵢ₋₁ⁿ⁻¹ = (1 − u) (n / (n − i)) Bᵢⁿ⁻¹.
fn reduce(mut f: Bivariate, mut rounding: f64) -> (Bivariate, [u8; 4], f64) {
    let mut factor = [0_u8; 4];
    let mut divided = true;
    // The bound grows with each division, so an edge looked at before is looked at again.
    while divided {
        divided = false;
        for (edge, count) in factor.iter_mut().enumerate() {
            let (n, m) = (f.degree_u(), f.degree_v());
            let (degree, other) = if edge < 2 { (n, m) } else { (m, n) };
            let edge_coefficient = |k: usize| match edge {
                0 => f.get(0, k),
                1 => f.get(n, k),
                2 => f.get(k, 0),
                _ => f.get(k, m),
            };
            if degree == 0 || (0..=other).any(|k| edge_coefficient(k).abs() > rounding) {
                continue;
            }
            f = match edge {
                0 => Bivariate::from_fn(n - 1, m, |i, j| f.get(i + 1, j) * n as f64 / (i + 1) as f64),
                1 => Bivariate::from_fn(n - 1, m, |i, j| f.get(i, j) * n as f64 / (n - i) as f64),
                2 => Bivariate::from_fn(n, m - 1, |i, j| f.get(i, j + 1) * m as f64 / (j + 1) as f64),
                _ => Bivariate::from_fn(n, m - 1, |i, j| f.get(i, j) * m as f64 / (m - j) as f64),
            };
            *count += 1;
            divided = true;
            // The row now on the edge is the one that was multiplied most, by the degree.
            rounding *= degree as f64;
        }
    }
    let snapped = Bivariate::from_fn(f.degree_u(), f.degree_v(), |i, j| {
        let c = f.get(i, j);
        if c.abs() <= rounding { 0.0 } else { c }
    });
    (snapped, factor, rounding)
}

#[cfg(test)]
mod tests;
