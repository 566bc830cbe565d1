//! Poles: sides of a patch that collapse to a point on the screen.
//!
//! No cell at a pole is regular, and a sight line through it meets the whole side. Such cells are answered by the sector
//! that they fill round the pole.

use glam::{DVec2, DVec4};

use super::coverage::Sector;
use super::leaf::Degrees;
use crate::view::Patch;

/// A side of a patch that is one point on the screen.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pole {
    pub(super) at: DVec2,
    /// Smallest and largest depth of the side; they differ where the side runs along the sight line.
    pub(super) depth: [f64; 2],
}

/// The sides of the patch that are one point on the screen.
pub(super) fn poles(patch: &Patch, rounding: f64) -> [Option<Pole>; 4] {
    let (p, q) = (patch.degree_u, patch.degree_v);
    let w = q + 1;
    let side = |start: usize, step: usize, count: usize| {
        let at = |k: usize| {
            let h = patch.points[start + k * step];
            h.truncate() / h.w
        };
        let first = at(0);
        let mut depth = [first.z, first.z];
        for k in 1..=count {
            let x = at(k);
            if (x - first).truncate().abs().max_element() > 4.0 * rounding {
                return None;
            }
            depth = [depth[0].min(x.z), depth[1].max(x.z)];
        }
        Some(Pole { at: first.truncate(), depth })
    };
    [side(0, 1, q), side(p * w, 1, q), side(0, w, p), side(q, w, p)]
}

/// How the image of a cell lies round the pole on its collapsed side.
pub(super) enum Fan {
    /// The side is the only root for the sight line through the pole, and the cell fills this sector round it.
    Sector(Sector),
    /// A fold runs through the pole, or the pole is seen edge-on.
    Folded,
    /// The cell is too large to say.
    Wide,
}

/// The fan of a cell round the pole on its side `side`.
///
/// With s the parameter across the side, (f, g) = s·T(s, t) and T is a Bernstein polynomial whose coefficients are those
/// of (f, g) beyond the side, scaled. If all of them lie on one side of a line through the origin, T has no zero. On the
/// side itself T(0, t) turns one way if its consecutive coefficients do, the Wronskians BᵢBⱼ′ − BⱼBᵢ′ (i < j) being
/// non-negative; the sector then is that from its first to its last direction.
pub(super) fn pole_fan(net: &[DVec4], degrees: Degrees, side: usize, pole: DVec2, rounding: f64) -> Fan {
    let Degrees { p, q } = degrees;
    let (across, along) = if side < 2 { (p, q) } else { (q, p) };
    let point = |a: usize, b: usize| {
        let a = if side.is_multiple_of(2) { a } else { across - a };
        let (i, j) = if side < 2 { (a, b) } else { (b, a) };
        net[i * (q + 1) + j]
    };
    let tangent = |a: usize, b: usize| {
        let h = point(a, b);
        h.truncate().truncate() - pole * h.w
    };
    let (mut left, mut right) = (false, false);
    for b in 0..along {
        let (from, to) = (tangent(1, b), tangent(1, b + 1));
        let turn = from.perp_dot(to);
        let noise = rounding * point(1, b).w.max(point(1, b + 1).w);
        let noise = noise * (from.abs() + to.abs()).element_sum() + noise * noise;
        left |= turn > noise;
        right |= turn < -noise;
    }
    if left == right {
        return Fan::Folded;
    }
    let (first, last) = (tangent(1, 0), tangent(1, along));
    let middle = first.normalize_or_zero() + last.normalize_or_zero();
    let ahead = (1..=across).all(|a| (0..=along).all(|b| middle.dot(tangent(a, b)) > 0.0));
    if ahead { Fan::Sector(Sector::between(first, last)) } else { Fan::Wide }
}
