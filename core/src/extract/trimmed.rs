//! Curves cut to what trims keep of their surfaces (Elber and Cohen 1989, section 6, stage 1).

use alloc::vec::Vec;

use glam::DVec2;

use super::curve::{Geometry, Path, SurfaceCurve};
use super::facing::FacingForm;
use super::silhouette::{CurveEnd, TracedCurve, UndecidedPlace};
use super::zero_set::{Rect, Variable};
use crate::trim::{Cover, Trims};

/// Halvings of a segment at the most: what is left is some roundings of its parameter long.
const MOST_HALVINGS: u32 = 44;

/// Parts of one segment looked at, at the most. A crossing takes some hundred; more are needed where the curve runs
/// along a trim curve.
const MOST_PARTS: u32 = 4096;

/// What trims keep of a curve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Kept {
    /// The intervals of its parameter in which it is inside, in increasing order.
    pub parts: Vec<[f64; 2]>,
    /// Intervals in which that is not known, because it runs along a trim curve; they are kept or not as their middles are.
    pub undecided: Vec<[f64; 2]>,
}

/// What is kept of a curve by the trims of all of its own path's surfaces; all of it where they have none.
///
/// An isoparametric line is cut at the roots of the trim curves' polynomials. Of a silhouette a part between halvings lies
/// in a box if the facing polynomial has the right signs on its long sides, which Bernstein coefficients prove; where no
/// trim curve enters the box the part is decided, else it is halved, to the rounding of its parameter. A part of a section
/// is taken to stay within half the length of its chord of the box of its ends: sections come in arcs that are nearly
/// straight. What runs along a border or a trim curve as a side of its surface is not asked for.
#[must_use]
pub fn kept_parts(g: &Geometry<'_>, curve: &SurfaceCurve) -> Kept {
    let whole = || Kept { parts: alloc::vec![curve.domain], undecided: Vec::new() };
    let trims = |surface: usize| g.view.trims(surface);
    match &curve.path {
        Path::Line(line) => match trims(curve.surface) {
            Some(trims) => Kept { parts: trims.kept_on_line(line.axis, line.value, curve.domain), ..Kept::default() },
            None => whole(),
        },
        Path::Trim(_) => whole(),
        Path::Traced(traced) => match trims(curve.surface) {
            Some(trims) => {
                let (form, patch) = (&g.forms[traced.patch], &g.view.patches()[traced.patch]);
                let held = |from: f64, to: f64| {
                    let (lo, hi) = strip(form, traced, from, to)?;
                    Some((patch.to_surface(lo.x, lo.y), patch.to_surface(hi.x, hi.y)))
                };
                inside(trims, &|t| curve.uv(g, t), &held, whole())
            }
            None => whole(),
        },
        Path::Section(section) => [0, 1].into_iter().fold(whole(), |kept, k| match trims(curve.surfaces[k]) {
            Some(trims) => {
                let uv = |t: f64| curve.both_uv(g, section, t)[k];
                let held = |from: f64, to: f64| {
                    let (a, b) = (uv(from), uv(to));
                    let room = DVec2::splat(0.5 * (b - a).abs().max_element()).max(trims.noise());
                    Some((a.min(b) - room, a.max(b) + room))
                };
                inside(trims, &uv, &held, kept)
            }
            None => kept,
        }),
    }
}

/// A box in local parameters, half as high again as it has to be at its ends on either side, that holds the part of a
/// silhouette between two parameters of one segment; none if its coefficients do not prove that it does.
///
/// On the segment F has one zero for each value of the independent parameter, within the segment's bracket, and F changes
/// sign there in a known direction. A line along the independent parameter on which F has the sign of one side lies on that
/// side of the zeros.
fn strip(form: &FacingForm, traced: &TracedCurve, from: f64, to: f64) -> Option<(DVec2, DVec2)> {
    let segment = &traced.segments[(from as usize).min(traced.segment_count() - 1)];
    // The end of a segment is the vertex that begins the next one, whose bracket is another.
    let at = |t: f64| {
        let vertex = t as usize;
        if t == vertex as f64 { traced.vertices[vertex] } else { traced.local_at(form, t) }
    };
    let (a, b) = (at(from), at(to));
    let along_u = segment.axis == Variable::U;
    let turn = |p: DVec2| if along_u { p } else { DVec2::new(p.y, p.x) };
    let (lo, hi) = (turn(a.min(b)), turn(a.max(b)));
    let room = 0.5 * (hi - lo).max_element();
    let f = form.polynomial.as_ref()?;
    // Whether F has the sign `positive` all along the line.
    let proven = |y: f64, positive: bool| {
        let line = if along_u { f.restricted_v(y) } else { f.restricted_u(y) };
        let (low, high) = line.restricted(lo.x, hi.x).bounds();
        if positive { low > form.rounding } else { high < -form.rounding }
    };
    let [bottom, top] = segment.bracket;
    let low = if lo.y - room <= bottom { bottom.min(lo.y) } else { lo.y - room };
    let high = if hi.y + room >= top { top.max(hi.y) } else { hi.y + room };
    let holds = (low <= bottom || proven(low, !segment.rising)) && (high >= top || proven(high, segment.rising));
    holds.then(|| (turn(DVec2::new(lo.x, low)), turn(DVec2::new(hi.x, high))))
}

/// Cuts curves to the parts inside trims, in their order; those that are sides of their surface are cut already. Also the
/// places where it is not known what to keep.
pub(crate) fn cut_to_trims(g: &Geometry<'_>, curves: Vec<SurfaceCurve>) -> (Vec<SurfaceCurve>, Vec<UndecidedPlace>) {
    let is_trimmed = |c: &SurfaceCurve| c.sides.is_empty() && c.surfaces.iter().any(|&s| g.view.trims(s).is_some());
    let (mut out, mut undecided) = (Vec::with_capacity(curves.len()), Vec::new());
    for curve in curves {
        if is_trimmed(&curve) {
            let kept = kept_parts(g, &curve);
            undecided.extend(kept.undecided.iter().map(|&t| place(g, &curve, t)));
            out.extend(kept.parts.into_iter().map(|t| part(&curve, t)));
        } else {
            out.push(curve);
        }
    }
    (out, undecided)
}

/// Where a part of a curve is on its surface: the box of its ends.
fn place(g: &Geometry<'_>, curve: &SurfaceCurve, t: [f64; 2]) -> UndecidedPlace {
    let uv = t.map(|t| curve.uv(g, t));
    let (patch, _) = g.view.locate(curve.surface, 0.5 * (uv[0] + uv[1]), [false; 2]);
    let [a, b] = uv.map(|uv| g.view.patches()[patch].to_local(uv).clamp(DVec2::ZERO, DVec2::ONE));
    let (lo, hi) = (a.min(b), a.max(b));
    UndecidedPlace { patch, place: Rect { u: [lo.x, hi.x], v: [lo.y, hi.y] } }
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

/// The part of what is kept in which a path is inside, segment by segment (between whole numbers). `held` is a box that
/// holds the path between two parameters, if one is known.
fn inside(
    trims: &Trims,
    uv: &dyn Fn(f64) -> DVec2,
    held: &dyn Fn(f64, f64) -> Option<(DVec2, DVec2)>,
    before: Kept,
) -> Kept {
    let kept = Kept { parts: Vec::new(), undecided: before.undecided };
    let mut cutter = Cutter { trims, uv, held, left: MOST_PARTS, kept };
    for [a, b] in before.parts {
        for segment in a as usize..libm::ceil(b) as usize {
            cutter.left = MOST_PARTS;
            cutter.cut(a.max(segment as f64), b.min((segment + 1) as f64), 0);
        }
    }
    cutter.kept
}

struct Cutter<'a> {
    trims: &'a Trims,
    uv: &'a dyn Fn(f64) -> DVec2,
    held: &'a dyn Fn(f64, f64) -> Option<(DVec2, DVec2)>,
    /// How many more parts may be looked at.
    left: u32,
    kept: Kept,
}

impl Cutter<'_> {
    fn cut(&mut self, a: f64, b: f64, depth: u32) {
        let middle = 0.5 * (a + b);
        let last = depth >= MOST_HALVINGS || middle <= a || middle >= b;
        if last || self.left == 0 {
            if !last {
                join(&mut self.kept.undecided, a, b);
            }
            if self.trims.contains((self.uv)(middle)) {
                join(&mut self.kept.parts, a, b);
            }
            return;
        }
        self.left -= 1;
        if let Some((lo, hi)) = (self.held)(a, b) {
            let noise = self.trims.noise();
            match self.trims.cover(lo - noise, hi + noise) {
                Cover::Inside => return join(&mut self.kept.parts, a, b),
                Cover::Outside => return,
                Cover::Mixed => {}
            }
        }
        self.cut(a, middle, depth + 1);
        self.cut(middle, b, depth + 1);
    }
}

/// Appends an interval, or lengthens the last one if they meet.
fn join(intervals: &mut Vec<[f64; 2]>, a: f64, b: f64) {
    match intervals.last_mut() {
        Some(last) if last[1] == a => last[1] = b,
        _ => intervals.push([a, b]),
    }
}
