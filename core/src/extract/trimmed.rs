//! Curves cut to what trims keep of their surfaces (Elber and Cohen 1989, section 6, stage 1).

use alloc::vec::Vec;

use glam::DVec2;

use super::curve::{Geometry, Path, SurfaceCurve};
use super::silhouette::CurveEnd;
use crate::trim::{Cover, Trims};

/// Halvings of a segment at the most: what is left is some roundings of its parameter long.
const MOST_HALVINGS: u32 = 44;

/// Halvings that are made in any case, before a part of a curve is taken to stay near the box of its ends.
const LEAST_HALVINGS: u32 = 2;

/// Parts of one segment looked at, at the most. A crossing takes some hundred; more are needed where the curve runs
/// along a trim curve.
const MOST_PARTS: u32 = 4096;

/// The intervals of a curve, in increasing order, in which it runs inside the trims of all of its own path's surfaces;
/// all of it where they have none. An isoparametric line is cut at the roots of the trim curves' polynomials. Of
/// another curve each part between halvings is taken to stay within half its size of the box of its ends, and is cut
/// where trim curves enter that box, to the rounding of its parameter. What runs along a border or a trim curve as a
/// side of its surface is not asked for.
#[must_use]
pub fn trimmed_parts(g: &Geometry<'_>, curve: &SurfaceCurve) -> Vec<[f64; 2]> {
    let whole = alloc::vec![curve.domain];
    match &curve.path {
        Path::Line(line) => match g.view.trims(curve.surface) {
            Some(trims) => trims.kept_on_line(line.axis, line.value, curve.domain),
            None => whole,
        },
        Path::Trim(_) => whole,
        Path::Traced(_) => match g.view.trims(curve.surface) {
            Some(trims) => inside(trims, &|t| curve.uv(g, t), &whole),
            None => whole,
        },
        Path::Section(section) => [0, 1].into_iter().fold(whole, |parts, k| match g.view.trims(curve.surfaces[k]) {
            Some(trims) => inside(trims, &|t| curve.both_uv(g, section, t)[k], &parts),
            None => parts,
        }),
    }
}

/// Cuts curves to the parts inside trims, in their order; those that are sides of their surface are cut already.
pub(crate) fn cut_to_trims(g: &Geometry<'_>, curves: Vec<SurfaceCurve>) -> Vec<SurfaceCurve> {
    let is_trimmed = |c: &SurfaceCurve| c.sides.is_empty() && c.surfaces.iter().any(|&s| g.view.trims(s).is_some());
    let mut out = Vec::with_capacity(curves.len());
    for curve in curves {
        if is_trimmed(&curve) {
            out.extend(trimmed_parts(g, &curve).into_iter().map(|t| part(&curve, t)));
        } else {
            out.push(curve);
        }
    }
    out
}

/// The part of a curve over the interval `t` of its domain.
fn part(curve: &SurfaceCurve, t: [f64; 2]) -> SurfaceCurve {
    let mut part = curve.clone();
    if let Path::Traced(traced) = &mut part.path {
        for (k, end) in traced.ends.iter_mut().enumerate() {
            if t[k] != curve.domain[k] {
                *end = CurveEnd::Border;
            }
        }
    }
    part.domain = t;
    part.splits.retain(|&x| t[0] < x && x < t[1]);
    part
}

/// The intervals within `parts` in which a path is inside, segment by segment (between whole numbers).
fn inside(trims: &Trims, uv: &dyn Fn(f64) -> DVec2, parts: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut cutter = Cutter { trims, uv, left: MOST_PARTS, out: Vec::new() };
    for &[a, b] in parts {
        for segment in a as usize..libm::ceil(b) as usize {
            let (t0, t1) = (a.max(segment as f64), b.min((segment + 1) as f64));
            cutter.left = MOST_PARTS;
            cutter.cut((t0, uv(t0)), (t1, uv(t1)), 0);
        }
    }
    cutter.out
}

struct Cutter<'a> {
    trims: &'a Trims,
    uv: &'a dyn Fn(f64) -> DVec2,
    /// How many more parts may be looked at.
    left: u32,
    out: Vec<[f64; 2]>,
}

impl Cutter<'_> {
    fn cut(&mut self, from: (f64, DVec2), to: (f64, DVec2), depth: u32) {
        let (a, b) = (from.0, to.0);
        let middle = 0.5 * (a + b);
        if depth >= MOST_HALVINGS || self.left == 0 || middle <= a || middle >= b {
            if self.trims.contains((self.uv)(middle)) {
                self.keep(a, b);
            }
            return;
        }
        self.left -= 1;
        if depth >= LEAST_HALVINGS {
            let (lo, hi) = (from.1.min(to.1), from.1.max(to.1));
            let room = (0.5 * (hi - lo)).max(self.trims.noise());
            match self.trims.cover(lo - room, hi + room) {
                Cover::Inside => return self.keep(a, b),
                Cover::Outside => return,
                Cover::Mixed => {}
            }
        }
        let at = (middle, (self.uv)(middle));
        self.cut(from, at, depth + 1);
        self.cut(at, to, depth + 1);
    }

    fn keep(&mut self, a: f64, b: f64) {
        match self.out.last_mut() {
            Some(last) if last[1] == a => last[1] = b,
            _ => self.out.push([a, b]),
        }
    }
}
