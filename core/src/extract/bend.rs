//! Where a surface has a sharp edge along one of its own knot lines.
//!
//! The normal of a patch has the components det [(Y, Z, W)…], det [(Z, X, W)…] and det [(X, Y, W)…] of homogeneous
//! position and derivatives, by the same common factor W³: each is the [facing polynomial](super::facing) of the patch
//! with its axes exchanged. Along a patch edge they are univariate polynomials, and so are the squares of sine and cosine of
//! the angle between the normals of two patches that share the edge: where the edge begins or ceases to be sharp is a root.
//!
//! A degenerate net (control points that coincide across the edge, a collapsed edge) makes the normal vanish there. The
//! rows of coefficients at the edge are then zero, and the first row that is not is, but for a positive factor, the
//! quotient by the power of the distance that vanishes: the limit of the normal's direction.

use alloc::vec::Vec;

use glam::{DVec3, DVec4};

use super::curve::Geometry;
use super::facing::{coordinate_rounding, form};
use crate::bernstein::Univariate;
use crate::line::{Axis, Line};
use crate::view::Patch;

/// A normal along a patch edge, by the local parameter of the edge, of any length.
struct EdgeNormal {
    components: [Univariate; 3],
    /// Bound of the rounding in a coefficient.
    rounding: f64,
}

impl EdgeNormal {
    /// The limit of the normal towards the edge at which a line of constant `axis` bounds a model-space patch from
    /// `below` or above; `None` for a patch without area.
    fn new(patch: &Patch, axis: Axis, below: bool) -> Option<Self> {
        // The two rows of control points next to the edge have the tangent planes of the whole patch along it.
        let strip = strip(patch, axis, below);
        Self::first_rows(&strip, axis, below, 1).or_else(|| Self::first_rows(patch, axis, below, usize::MAX))
    }

    /// The first of the `most` rows of the normal's coefficients from the edge that is not zero to rounding.
    fn first_rows(patch: &Patch, axis: Axis, below: bool, most: usize) -> Option<Self> {
        let turned = |f: fn(DVec4) -> DVec4| {
            form(&Patch { points: patch.points.iter().map(|&p| f(p)).collect(), ..patch.clone() })
        };
        let (x, x_rounding) = turned(|p| DVec4::new(p.y, p.z, p.x, p.w));
        let (y, y_rounding) = turned(|p| DVec4::new(p.z, p.x, p.y, p.w));
        let (z, z_rounding) = turned(|p| p);
        let rounding = x_rounding.max(y_rounding).max(z_rounding);
        let field = [x, y, z];
        let across = if axis == Axis::U { field[0].degree_u() } else { field[0].degree_v() };
        (0..=across).take(most).map(|k| if below { across - k } else { k }).find_map(|k| {
            let components = field.each_ref().map(|f| {
                let row: Vec<f64> = match axis {
                    Axis::U => (0..=f.degree_v()).map(|j| f.get(k, j)).collect(),
                    Axis::V => (0..=f.degree_u()).map(|i| f.get(i, k)).collect(),
                };
                Univariate::new(row)
            });
            let known = components.iter().any(|c| c.magnitude() > rounding);
            known.then_some(Self { components, rounding })
        })
    }

    /// The unit normal at `t`; `None` where it is no longer than its rounding.
    fn at(&self, t: f64) -> Option<DVec3> {
        let n = DVec3::from_array(self.components.each_ref().map(|c| c.eval(t)));
        (n.abs().max_element() > self.rounding).then(|| n.normalize())
    }

    fn dot(&self, other: &Self) -> Univariate {
        let [a, b, c] = [0, 1, 2].map(|k| self.components[k].mul(&other.components[k]));
        a.add(&b).add(&c)
    }

    fn cross_squared(&self, other: &Self) -> Univariate {
        let [a, b, c] = [(1, 2), (2, 0), (0, 1)].map(|(k, l)| {
            let (m, n) = (&self.components, &other.components);
            let minor = m[k].mul(&n[l]).sub(&m[l].mul(&n[k]));
            minor.mul(&minor)
        });
        a.add(&b).add(&c)
    }
}

/// The patch of degree 1 across an edge between the control points of the edge and those next to it.
fn strip(patch: &Patch, axis: Axis, below: bool) -> Patch {
    let (p, q) = (patch.degree_u, patch.degree_v);
    let width = q + 1;
    let keep = |degree: usize, k: usize| if below { k + 1 >= degree } else { k <= 1 };
    let kept = |(k, _): &(usize, &DVec4)| match axis {
        Axis::U => keep(p, k / width),
        Axis::V => keep(q, k % width),
    };
    let points = patch.points.iter().enumerate().filter(kept).map(|(_, &point)| point).collect();
    let (degree_u, degree_v) = if axis == Axis::U { (1, q) } else { (p, 1) };
    Patch { degree_u, degree_v, points, ..patch.clone() }
}

/// The normals on both sides of the part of a knot line between two crossing knot lines.
struct Span {
    t: [f64; 2],
    sides: [EdgeNormal; 2],
}

/// The angle between the two sides of a knot line.
pub(super) struct Bend {
    /// Parts in which the two sides may differ.
    spans: Vec<Span>,
    angle: f64,
}

impl Bend {
    /// The two sides of a knot line, `low` and `high`, which are sharp where their normals differ by more than `angle`
    /// radians. `corner` tells whether the surface is merely continuous there. Where it is smoother the normals can
    /// differ only if they vanish all along a span. Cost: the facing polynomials
    /// of six patches of degree 1 across the line a span of a corner, else one point.
    pub(super) fn new(g: &Geometry<'_>, low: &Line, high: &Line, corner: bool, angle: f64) -> Self {
        let span = |(a, b): (&crate::line::LineSpan, &crate::line::LineSpan)| {
            if !corner && has_normal(g.view.model_patch(a.patch), low.axis, a.local) {
                return None;
            }
            let sides = [
                EdgeNormal::new(g.view.model_patch(a.patch), low.axis, true)?,
                EdgeNormal::new(g.view.model_patch(b.patch), low.axis, false)?,
            ];
            Some(Span { t: a.t, sides })
        };
        Self { spans: low.spans.iter().zip(&high.spans).filter_map(span).collect(), angle }
    }

    /// Parameters among which are all at which the line begins or ceases to be sharp.
    pub(super) fn changes(&self) -> Vec<f64> {
        let mut out = Vec::new();
        for Span { t, sides: [a, b] } in &self.spans {
            let sine = libm::sin(self.angle);
            let limit = a.dot(a).mul(&b.dot(b)).scaled(sine * sine);
            // The angle passes its limit where the sine does. It jumps only where a normal vanishes, and then reverses.
            let roots = [a.cross_squared(b).sub(&limit), a.dot(b)].map(|p| p.roots());
            out.extend(roots.iter().flatten().map(|r| t[0] + r.t * (t[1] - t[0])));
        }
        out
    }

    /// Whether the two sides meet at more than the angle at `t`. Not where a side has no normal: in a patch without area,
    /// or at a point at which it vanishes.
    pub(super) fn is_sharp(&self, t: f64) -> bool {
        let Some(span) = self.spans.iter().find(|s| s.t[0] <= t && t <= s.t[1]) else { return false };
        let local = (t - span.t[0]) / (span.t[1] - span.t[0]);
        let [a, b] = span.sides.each_ref().map(|s| s.at(local));
        a.zip(b).is_some_and(|(a, b)| libm::atan2(a.cross(b).length(), a.dot(b)) > self.angle)
    }
}

/// Whether the normal of a patch certainly does not vanish all along a line across it: it does not at one place.
fn has_normal(patch: &Patch, axis: Axis, local: f64) -> bool {
    let along = 0.47;
    let jet = if axis == Axis::U { patch.jet(local, along) } else { patch.jet(along, local) };
    // A derivative carries the rounding of two control points times the degree, and a product of two that of both.
    let rounding = 2.0 * patch.degree_u.max(patch.degree_v) as f64 * coordinate_rounding(patch);
    jet.normal().length() > 2.0 * rounding * (jet.du.length() + jet.dv.length() + rounding)
}
