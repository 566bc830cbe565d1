//! One cell of a patch against one sight line: hull tests, the regularity certificate and Newton's method.
//!
//! The sight line through the screen point q meets a cell where f = X − q.x·W and g = Y − q.y·W vanish together. Both
//! are tensor Bernstein polynomials, so every statement about the cell is a statement about finitely many coefficients.
//!
//! With J₀ the mean Jacobian of (f, g) and P = J₀⁻¹, write P·(f, g) = x + ρ(x). Two certificates follow:
//!
//! 1. *Enclosure.* A root satisfies x = −ρ(x), so it lies in the box spanned by the coefficients of −ρ. A box that misses
//!    the unit square proves that there is no root; a box inside the unit square proves that there is one (Brouwer).
//! 2. *Regularity.* Let κ bound ‖P·J − I‖∞ over the cell. κ < 1 makes (f, g) one-to-one, hence at most one root, and
//!    x ↦ clamp(x − P·(f, g)) contracts towards it by κ. For κ < ½ the same inequality also proves the absence of a
//!    root from the residual alone (see [`solve`]).

use glam::{DVec2, DVec4};

use crate::view::{MAX_DEGREE, halve_net, net_jet};

/// Most control points of a net.
pub(super) const MAX_NET: usize = (MAX_DEGREE + 1) * (MAX_DEGREE + 1);

/// Largest κ of a cell that counts as regular: below ½ with room for the margin by which roots may lie outside.
const REGULAR: f64 = 0.4;

/// Widest border of a cell, as part of the cell: cells near poles and folds are smaller than the width of a border, which
/// must not make them all meet.
const WIDEST_BORDER: f64 = 0.02;

/// Bidegree of a net; control point (i, j) has index `i * (q + 1) + j`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Degrees {
    pub(super) p: usize,
    pub(super) q: usize,
}

impl Degrees {
    pub(super) fn len(self) -> usize {
        (self.p + 1) * (self.q + 1)
    }
}

/// A parameter direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Axis {
    U,
    V,
}

impl Axis {
    pub(super) fn index(self) -> usize {
        match self {
            Self::U => 0,
            Self::V => 1,
        }
    }

    pub(super) fn other(self) -> Self {
        match self {
            Self::U => Self::V,
            Self::V => Self::U,
        }
    }
}

/// Lengths that separate *the same* from *different*, all derived from the size of the data.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tolerances {
    /// Screen distance within which a root is *on* a patch border.
    pub(super) border: f64,
    /// Difference in depth within which two places touch.
    pub(super) contact: f64,
    /// Rounding error of a coordinate after subdivision.
    pub(super) rounding: f64,
}

/// A rectangle of a patch's local parameters, an exact dyadic, and how often it was halved in u and in v.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    pub(super) lo: DVec2,
    pub(super) hi: DVec2,
    pub(super) depth: [u8; 2],
}

impl Window {
    pub(super) const WHOLE: Self = Self { lo: DVec2::ZERO, hi: DVec2::ONE, depth: [0, 0] };

    pub(super) fn halves(self, axis: Axis) -> [Self; 2] {
        let k = axis.index();
        let (mut a, mut b) = (self, self);
        let middle = 0.5 * (self.lo[k] + self.hi[k]);
        a.hi[k] = middle;
        b.lo[k] = middle;
        a.depth[k] += 1;
        b.depth[k] += 1;
        [a, b]
    }

    /// Which sides lie on the border of the patch: u = 0, u = 1, v = 0, v = 1. Dyadics, so the comparison is exact.
    pub(super) fn sides(self) -> [bool; 4] {
        [self.lo.x == 0.0, self.hi.x == 1.0, self.lo.y == 0.0, self.hi.y == 1.0]
    }

    /// The patch's parameters of the cell's own (s, t).
    pub(super) fn at(self, x: DVec2) -> DVec2 {
        self.lo + x * (self.hi - self.lo)
    }
}

/// Splits the net at the middle of `axis`: `net` becomes the lower half, `upper` receives the other.
pub(super) fn halve(net: &mut [DVec4], upper: &mut [DVec4], degrees: Degrees, axis: Axis) {
    halve_net(net, upper, degrees.p, degrees.q, axis == Axis::U);
}

/// Coefficients of f and g of one cell for one sight line.
#[derive(Clone, Debug)]
pub(super) struct Equations {
    degrees: Degrees,
    f: [f64; MAX_NET],
    g: [f64; MAX_NET],
    /// Largest weight.
    weight: f64,
}

impl Equations {
    pub(super) const EMPTY: Self =
        Self { degrees: Degrees { p: 0, q: 0 }, f: [0.0; MAX_NET], g: [0.0; MAX_NET], weight: 0.0 };

    pub(super) fn set(&mut self, net: &[DVec4], degrees: Degrees, q: DVec2) {
        self.degrees = degrees;
        self.weight = 0.0;
        for ((h, f), g) in net.iter().zip(&mut self.f).zip(&mut self.g) {
            *f = h.x - q.x * h.w;
            *g = h.y - q.y * h.w;
            self.weight = self.weight.max(h.w);
        }
    }

    fn pairs(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let n = self.degrees.len();
        self.f[..n].iter().zip(&self.g[..n]).map(|(&f, &g)| (f, g))
    }

    /// Whether f, g, f + g or f − g has one sign on the cell, farther from zero than the width of a border.
    pub(super) fn separated(&self, tolerances: &Tolerances) -> bool {
        let (mut lo, mut hi) = ([f64::INFINITY; 4], [f64::NEG_INFINITY; 4]);
        for (f, g) in self.pairs() {
            for (k, c) in [f, g, f + g, f - g].into_iter().enumerate() {
                lo[k] = lo[k].min(c);
                hi[k] = hi[k].max(c);
            }
        }
        (0..4).any(|k| self.one_sign(lo[k], hi[k], if k < 2 { 1.0 } else { 2.0 }, tolerances))
    }

    /// The cell seen along the direction in which it extends on the screen. At a fold the image of a cell is a thin strip;
    /// this is the test that sees past its side.
    pub(super) fn strip(&self, tolerances: &Tolerances) -> Strip {
        let (a, b) = self.mean_jacobian();
        let (along, axis) = if a.length_squared() >= b.length_squared() { (a, Axis::U) } else { (b, Axis::V) };
        let normal = along.perp();
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        for (f, g) in self.pairs() {
            let c = normal.x * f + normal.y * g;
            lo = lo.min(c);
            hi = hi.max(c);
        }
        let scale = normal.length();
        if self.one_sign(lo, hi, scale, tolerances) {
            Strip::Missed
        } else if hi - lo <= 8.0 * tolerances.rounding * self.weight * scale {
            Strip::Line(axis)
        } else {
            Strip::Wide
        }
    }

    /// Whether the whole cell lies on the sight line, to rounding.
    pub(super) fn vanish(&self, tolerances: &Tolerances) -> bool {
        let t = 4.0 * tolerances.rounding * self.weight;
        self.pairs().all(|(f, g)| f.abs() <= t && g.abs() <= t)
    }

    /// Whether [lo, hi], the range of a combination of f and g with factors of length `scale`, stays off zero.
    fn one_sign(&self, lo: f64, hi: f64, scale: f64, tolerances: &Tolerances) -> bool {
        let unit = scale * self.weight;
        let t = (tolerances.border * unit).min(WIDEST_BORDER * (hi - lo)).max(tolerances.rounding * unit);
        lo > t || hi < -t
    }

    /// Mean of (f, g)_u and of (f, g)_v over their coefficients; the sums telescope to the opposite edges.
    fn mean_jacobian(&self) -> (DVec2, DVec2) {
        let Degrees { p, q } = self.degrees;
        let w = q + 1;
        let (mut a, mut b) = (DVec2::ZERO, DVec2::ZERO);
        for j in 0..=q {
            a += DVec2::new(self.f[p * w + j] - self.f[j], self.g[p * w + j] - self.g[j]);
        }
        for i in 0..=p {
            b += DVec2::new(self.f[i * w + q] - self.f[i * w], self.g[i * w + q] - self.g[i * w]);
        }
        (a / (q + 1) as f64, b / (p + 1) as f64)
    }

    /// The enclosure of the roots; `None` where J₀ is singular. `half` is the half-size of the box of screen points, all
    /// of which the enclosure is to hold for (zero for a single sight line), and q the box's centre.
    pub(super) fn enclosure(&self, net: &[DVec4], half: DVec2, tolerances: &Tolerances) -> Option<Enclosure> {
        let (a, b) = self.mean_jacobian();
        let det = a.perp_dot(b);
        let rows = [DVec2::new(b.y, -b.x) / det, DVec2::new(-a.y, a.x) / det];
        if !(rows[0].is_finite() && rows[1].is_finite()) {
            return None;
        }
        let Degrees { p, q } = self.degrees;
        let w = q + 1;
        let (mut lo, mut hi) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let (mut light, mut heavy) = (f64::INFINITY, 0.0_f64);
        for (i, row) in net.chunks_exact(w).enumerate() {
            let s = i as f64 / p as f64;
            for (j, h) in row.iter().enumerate() {
                let c = DVec2::new(self.f[i * w + j], self.g[i * w + j]);
                let rho = DVec2::new(rows[0].dot(c) - s, rows[1].dot(c) - j as f64 / q as f64);
                lo = lo.min(rho);
                hi = hi.max(rho);
                light = light.min(h.w);
                heavy = heavy.max(h.w);
            }
        }
        let weight = 0.5 * (light + heavy);
        // Screen points off the centre of the box by d change ρ by −P·d·W, of which −P·d·weight is taken into account.
        let off = 0.5 * (heavy - light);
        let reach = |r: DVec2| r.x.abs() * half.x + r.y.abs() * half.y;
        let slack = 0.5 * (hi - lo) + off * DVec2::new(reach(rows[0]), reach(rows[1]));
        // Rounding of coordinates as the root sees it; the factor 2 on the border's width pays for the Jacobian at the
        // root differing from J₀ by κ < ½.
        let noise = |r: DVec2| 1e-13 + tolerances.rounding * heavy * (r.x.abs() + r.y.abs());
        let noise = DVec2::new(noise(rows[0]), noise(rows[1]));
        let border = 2.0 * tolerances.border * heavy * DVec2::new(rows[0].length(), rows[1].length());
        let margin = noise + border.min(DVec2::splat(WIDEST_BORDER));
        Some(Enclosure { middle: -0.5 * (lo + hi), slack, rows, weight, noise, margin, contraction: f64::INFINITY })
    }

    /// κ: the largest ‖P·J − I‖∞ over the cell and over the box of screen points; at least `REGULAR` as soon as that is
    /// certain.
    pub(super) fn contraction(&self, net: &[DVec4], half: DVec2, rows: [DVec2; 2]) -> f64 {
        let Degrees { p, q } = self.degrees;
        let w = q + 1;
        let reach = DVec2::new(
            rows[0].x.abs() * half.x + rows[0].y.abs() * half.y,
            rows[1].x.abs() * half.x + rows[1].y.abs() * half.y,
        );
        let by = |from: usize, to: usize, degree: usize, unit: DVec2| {
            let d = DVec2::new(self.f[to] - self.f[from], self.g[to] - self.g[from]) * degree as f64;
            let m = DVec2::new(rows[0].dot(d), rows[1].dot(d)) - unit;
            m.abs() + reach * (degree as f64 * (net[to].w - net[from].w).abs())
        };
        let (mut in_u, mut in_v) = (DVec2::ZERO, DVec2::ZERO);
        for k in 0..p * w {
            in_u = in_u.max(by(k, k + w, p, DVec2::X));
        }
        if in_u.max_element() >= REGULAR {
            return in_u.max_element();
        }
        for i in 0..=p {
            for k in i * w..i * w + q {
                in_v = in_v.max(by(k, k + 1, q, DVec2::Y));
            }
        }
        (in_u + in_v).max_element()
    }

    /// The direction in which halving brings the cell nearest to regular: that of the larger second difference; where
    /// the mixed one rules (bilinear cells, poles), that in which the cell is longer on the screen.
    pub(super) fn split_axis(&self) -> Axis {
        let Degrees { p, q } = self.degrees;
        let w = q + 1;
        let second = |a: usize, b: usize, c: usize| {
            let f = self.f[a] - 2.0 * self.f[b] + self.f[c];
            let g = self.g[a] - 2.0 * self.g[b] + self.g[c];
            f.abs() + g.abs()
        };
        let (mut uu, mut vv, mut uv) = (0.0_f64, 0.0_f64, 0.0_f64);
        for i in 0..=p {
            for j in 0..=q {
                let k = i * w + j;
                if i + 2 <= p {
                    uu = uu.max(second(k, k + w, k + 2 * w));
                }
                if j + 2 <= q {
                    vv = vv.max(second(k, k + 1, k + 2));
                }
                if i < p && j < q {
                    let f = self.f[k] - self.f[k + 1] - self.f[k + w] + self.f[k + w + 1];
                    let g = self.g[k] - self.g[k + 1] - self.g[k + w] + self.g[k + w + 1];
                    uv = uv.max(f.abs() + g.abs());
                }
            }
        }
        uu *= (p * (p - 1)) as f64;
        vv *= (q * (q - 1)) as f64;
        uv *= (p * q) as f64;
        if 4.0 * uu.max(vv) < uv {
            let (a, b) = self.mean_jacobian();
            return if a.length_squared() >= b.length_squared() { Axis::U } else { Axis::V };
        }
        if uu >= vv { Axis::U } else { Axis::V }
    }
}

/// How a strip round the image of a cell lies to the sight line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Strip {
    /// The sight line passes beside it.
    Missed,
    /// It is a line to rounding, which runs along this parameter; halving the other one tells nothing more.
    Line(Axis),
    /// It has to be halved.
    Wide,
}

/// Where in a cell the root for a screen point can be, and how far the cell is regular.
#[derive(Clone, Copy, Debug)]
pub(super) struct Enclosure {
    /// Middle of the enclosure for the screen point in the centre.
    pub(super) middle: DVec2,
    /// Half-widths of the enclosure.
    pub(super) slack: DVec2,
    /// Rows of P = J₀⁻¹.
    pub(super) rows: [DVec2; 2],
    /// Middle weight, that of the linear dependence on the screen point.
    pub(super) weight: f64,
    /// Rounding error of a root.
    pub(super) noise: DVec2,
    /// How far outside the unit square a root still counts: rounding and the width of the border.
    pub(super) margin: DVec2,
    /// κ; at most `REGULAR` in a regular cell.
    pub(super) contraction: f64,
}

impl Enclosure {
    /// Middle of the enclosure for the screen point at `offset` from the centre.
    pub(super) fn estimate(&self, offset: DVec2) -> DVec2 {
        self.middle + DVec2::new(self.rows[0].dot(offset), self.rows[1].dot(offset)) * self.weight
    }

    /// Whether a root with this estimate is proven to lie outside the cell and its margin.
    pub(super) fn misses(&self, estimate: DVec2) -> bool {
        let reach = self.slack + self.margin;
        (estimate + reach).min_element() < 0.0 || (estimate - reach).max_element() > 1.0
    }

    /// Whether a root with this estimate is proven to exist in the cell, so clear of its border that no neighbour counts
    /// it: at a common point the neighbour's J₀ differs from this one by (1 + κ)/(1 − κ) < 4 at most.
    pub(super) fn surely_inside(&self, estimate: DVec2) -> bool {
        let reach = self.slack + 4.0 * self.margin;
        (estimate - reach).min_element() > 0.0 && (estimate + reach).max_element() < 1.0
    }

    pub(super) fn is_regular(&self) -> bool {
        self.contraction <= REGULAR
    }
}

/// A root of (f, g): its cell parameters, and the homogeneous point with both derivatives there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Root {
    pub(super) at: DVec2,
    pub(super) jet: [DVec4; 3],
}

/// What Newton's method says of a regular cell.
#[derive(Clone, Copy, Debug)]
pub(super) enum Solution {
    /// The root, inside the cell or within its margin.
    Root(Root),
    /// There is none.
    Empty,
    /// Neither is proven; the cell is to be halved.
    Undecided,
}

/// Solves f = g = 0 in a regular cell from `start`; adds the number of evaluations to `steps`.
///
/// Iterates stay in the cell (with margin). When they stop at its border with residual r = P·(f, g), a root x* of the
/// cell would satisfy r = M(x − x*) with ‖M − I‖∞ ≤ κ, hence |x* − (x − r)| ≤ κ/(1 − κ)·|r|: if that box misses the
/// cell there is no root.
pub(super) fn solve(
    net: &[DVec4],
    degrees: Degrees,
    q: DVec2,
    enclosure: &Enclosure,
    start: DVec2,
    steps: &mut u64,
) -> Solution {
    // A margin wider than this would leave the domain of the certificate.
    let margin = enclosure.margin.min(DVec2::splat(0.05));
    let (lo, hi) = (-margin, DVec2::ONE + margin);
    // Near a fold the iterates jitter by the rounding of the root, which may exceed the fixed thresholds.
    let noise = enclosure.noise.max_element();
    let mut x = start.clamp(lo, hi);
    for _ in 0..16 {
        *steps += 1;
        let [h, hu, hv] = net_jet(net, degrees.p, degrees.q, x.x, x.y);
        let residual = h.truncate().truncate() - q * h.w;
        let a = hu.truncate().truncate() - q * hu.w;
        let b = hv.truncate().truncate() - q * hv.w;
        let det = a.perp_dot(b);
        let step = DVec2::new(residual.perp_dot(b), a.perp_dot(residual)) / det;
        if !step.is_finite() {
            return Solution::Undecided;
        }
        let next = (x - step).clamp(lo, hi);
        let moved = (next - x).abs();
        if (next - (x - step)).abs().max_element() == 0.0 && moved.max_element() <= noise.max(1e-8) {
            // Quadratic convergence: the next step would be of the order of the rounding, so the jet is carried along
            // to first order instead of being evaluated once more.
            return Solution::Root(Root { at: next, jet: [h - hu * step.x - hv * step.y, hu, hv] });
        }
        if moved.max_element() <= noise.max(1e-10) {
            let r = DVec2::new(enclosure.rows[0].dot(residual), enclosure.rows[1].dot(residual));
            let kappa = enclosure.contraction;
            let reach = DVec2::splat(kappa / (1.0 - kappa) * r.abs().max_element());
            let centre = x - r;
            let outside = (centre + reach).min_element() < 0.0 || (centre - reach).max_element() > 1.0;
            return if outside { Solution::Empty } else { Solution::Undecided };
        }
        x = next;
    }
    Solution::Undecided
}
