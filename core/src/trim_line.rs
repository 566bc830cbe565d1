//! Lines along trim curves: where the kept part of a surface ends, from corner to corner.

use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use crate::line::foot;
use crate::trim::{TrimLoop, TrimPiece, Trims};
use crate::view::ViewScene;

/// The part of a trim line inside one patch.
#[derive(Clone, Debug, PartialEq)]
pub struct TrimSpan {
    /// The patch whose kept part it bounds.
    pub patch: usize,
    /// The curve in the surface's parameters.
    pub piece: TrimPiece,
    /// Whether the kept part is on its left in (u, v).
    pub left: bool,
}

/// A part of a trim loop without corners.
///
/// Its parameter t runs from 0 to the number of spans; the integer part names the span, the fraction is the parameter
/// of its curve. A loop without corners is one line, whose ends are one point.
#[derive(Clone, Debug, PartialEq)]
pub struct TrimLine {
    /// Index of the surface.
    pub surface: usize,
    /// The spans, end to end.
    pub spans: Vec<TrimSpan>,
    /// Positions at equal steps of the parameter, [`SAMPLES`] a span, in view space.
    samples: Vec<DVec3>,
}

/// Places a span at which a search for the nearest point begins: spans run one way in u and v.
const SAMPLES: u32 = 8;

impl TrimLine {
    /// All trim lines of a surface, loop by loop. What runs along the border of the surface's parameter range is left
    /// to the boundary there, and what has nothing or everything on both sides is no border.
    #[must_use]
    pub fn all(view: &ViewScene, surface: usize) -> Vec<Self> {
        let mut out = Vec::new();
        if let Some(trims) = view.trims(surface) {
            for l in trims.loops() {
                Self::of_loop(view, surface, trims, l, &mut out);
            }
        }
        out
    }

    fn of_loop(view: &ViewScene, surface: usize, trims: &Trims, l: &TrimLoop, out: &mut Vec<Self>) {
        let pieces = l.pieces();
        let count = pieces.len();
        let is_edge = |p: &TrimPiece| p.keeps_left().is_some() && !trims.is_on_border(p);
        // Whether a line begins with piece k, or a gap.
        let begins = |k: usize| {
            let (before, after) = (&pieces[(k + count - 1) % count], &pieces[k]);
            !is_edge(before)
                || !is_edge(after)
                || before.keeps_left() != after.keeps_left()
                || trims.is_corner(before, after)
                || on_corner_line(view, surface, trims, after.from())
        };
        let first = (0..count).find(|&k| begins(k)).unwrap_or(0);
        let mut spans = Vec::new();
        for k in (first..first + count).map(|k| k % count) {
            if begins(k) && !spans.is_empty() {
                out.push(Self::new(view, surface, core::mem::take(&mut spans)));
            }
            if let Some(left) = pieces[k].keeps_left().filter(|_| is_edge(&pieces[k])) {
                spans.push(TrimSpan {
                    patch: patch_beside(view, surface, &pieces[k], left),
                    piece: pieces[k].clone(),
                    left,
                });
            }
        }
        if !spans.is_empty() {
            out.push(Self::new(view, surface, spans));
        }
    }

    fn new(view: &ViewScene, surface: usize, spans: Vec<TrimSpan>) -> Self {
        let count = spans.len() as u32 * SAMPLES;
        let mut line = Self { surface, spans, samples: Vec::new() };
        line.samples = (0..=count).map(|k| line.point(view, f64::from(k) / f64::from(SAMPLES))).collect();
        line
    }

    /// Interval of the parameter.
    #[must_use]
    pub fn domain(&self) -> [f64; 2] {
        [0.0, self.spans.len() as f64]
    }

    /// Index of the span that holds `t`; at a joint, of the one that begins there.
    #[must_use]
    pub fn span_at(&self, t: f64) -> usize {
        (libm::floor(t).max(0.0) as usize).min(self.spans.len() - 1)
    }

    /// Surface parameters at `t`.
    #[must_use]
    pub fn uv(&self, t: f64) -> DVec2 {
        let k = self.span_at(t);
        self.spans[k].piece.eval(t - k as f64)
    }

    /// Surface parameters and their derivatives at `t` on the span `k`.
    #[must_use]
    pub fn uv_jet(&self, t: f64, k: usize) -> (DVec2, DVec2) {
        self.spans[k].piece.jet(t - k as f64)
    }

    /// The patch at `t`, and the local parameters in it.
    #[must_use]
    pub fn place(&self, view: &ViewScene, t: f64) -> (usize, DVec2) {
        let patch = self.spans[self.span_at(t)].patch;
        // A piece may leave its patch by rounding.
        (patch, view.patches()[patch].to_local(self.uv(t)).clamp(DVec2::ZERO, DVec2::ONE))
    }

    /// Position and derivative in view space at `t`; at a joint, of the span that begins there.
    #[must_use]
    pub fn jet(&self, view: &ViewScene, t: f64) -> (DVec3, DVec3) {
        self.jet_in(view, t, self.span_at(t))
    }

    /// Position and derivative in view space at `t` on the span `k`.
    #[must_use]
    pub fn jet_in(&self, view: &ViewScene, t: f64, k: usize) -> (DVec3, DVec3) {
        let patch = &view.patches()[self.spans[k].patch];
        let (uv, slope) = self.uv_jet(t, k);
        let local = patch.to_local(uv).clamp(DVec2::ZERO, DVec2::ONE);
        let d = slope / DVec2::new(patch.u[1] - patch.u[0], patch.v[1] - patch.v[0]);
        let jet = patch.jet(local.x, local.y);
        (jet.p, jet.du * d.x + jet.dv * d.y)
    }

    /// Position in view space at `t`.
    #[must_use]
    pub fn point(&self, view: &ViewScene, t: f64) -> DVec3 {
        let (patch, local) = self.place(view, t);
        view.patches()[patch].eval(local.x, local.y)
    }

    /// Box in view space that holds the line: lower and upper corner. That of the parts of the patches over the boxes
    /// of the spans.
    #[must_use]
    pub fn bounds(&self, view: &ViewScene) -> (DVec3, DVec3) {
        let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for span in &self.spans {
            let patch = &view.patches()[span.patch];
            let (low, high) = span.piece.bounds();
            let [low, high] = [low, high].map(|x| patch.to_local(x).clamp(DVec2::ZERO, DVec2::ONE));
            let part = [0, 1, 2, 3].map(|k| patch.coordinate(k).restricted([low.x, high.x], [low.y, high.y]));
            let [x, y, z, w] = part.each_ref().map(|c| c.coefficients());
            for k in 0..w.len() {
                let p = DVec3::new(x[k], y[k], z[k]) / w[k];
                (lo, hi) = (lo.min(p), hi.max(p));
            }
        }
        (lo, hi)
    }

    /// Nearest point of the line to `p` in view space: parameter and distance. Sampled, then Newton on the derivative
    /// of the squared distance beside the best sample; local minima closer together than an eighth of a span are not
    /// told apart.
    #[must_use]
    pub fn nearest(&self, view: &ViewScene, p: DVec3) -> (f64, f64) {
        let [a, b] = self.domain();
        let mut best = (a, f64::INFINITY);
        for (k, sample) in self.samples.iter().enumerate() {
            let d = sample.distance_squared(p);
            if d < best.1 {
                best = (k as f64 / f64::from(SAMPLES), d);
            }
        }
        let found = self.nearest_beside(view, p, best.0);
        // The ends of a closed line are one point, and the nearest may be beside the other one.
        let other_end = if best.0 == a { b } else { a };
        if best.0 == a || best.0 == b {
            let beyond = self.nearest_beside(view, p, other_end);
            if beyond.1 < found.1 {
                return beyond;
            }
        }
        found
    }

    fn nearest_beside(&self, view: &ViewScene, p: DVec3, from: f64) -> (f64, f64) {
        let [a, b] = self.domain();
        let step = 1.0 / f64::from(SAMPLES);
        let (lo, hi) = ((from - step).max(a), (from + step).min(b));
        let t = foot(|t| self.jet(view, t), p, from, [lo, hi], b - a);
        let distance = |t: f64| self.point(view, t).distance(p);
        let (d, before) = (distance(t), distance(from));
        if d <= before { (t, d) } else { (from, before) }
    }
}

/// Whether a place is on a knot line at which the surface is merely continuous: what passes there has a corner in
/// space.
fn on_corner_line(view: &ViewScene, surface: usize, trims: &Trims, at: DVec2) -> bool {
    let grid = &view.surfaces()[surface];
    let noise = trims.noise();
    grid.u_corners.iter().any(|c| (c - at.x).abs() <= noise.x)
        || grid.v_corners.iter().any(|c| (c - at.y).abs() <= noise.y)
}

/// The patch that holds a piece; of two on either side, the one on the kept side.
fn patch_beside(view: &ViewScene, surface: usize, piece: &TrimPiece, left: bool) -> usize {
    let run = piece.to() - piece.from();
    // Up along v, the left is at smaller u; to the right along u, it is at larger v.
    let below = [left == (run.y > 0.0), left != (run.x > 0.0)];
    view.locate(surface, piece.eval(0.5), below).0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nurbs::Curve;
    use crate::scene::{Scene, SceneSurface};
    use crate::shape::{Frame, circle, polyline, torus};
    use crate::view::Camera;
    use alloc::vec;
    use glam::DMat4;

    fn circle_about(x: f64, y: f64, radius: f64) -> Vec<Curve> {
        let there = DMat4::from_translation(DVec3::new(x, y, 0.0));
        vec![circle(&Frame::WORLD, radius).unwrap().transformed(there).unwrap()]
    }

    /// A torus, trimmed, seen from above: view coordinates are model coordinates.
    fn view(loops: &[Vec<Curve>]) -> ViewScene {
        let surface = torus(&Frame::WORLD, 3.0, 1.0).unwrap();
        let trims = Some(Trims::new(&surface, loops).unwrap());
        let scene =
            Scene { name: "t".into(), surfaces: vec![SceneSurface { trims, ..SceneSurface::new("t", surface) }] };
        ViewScene::new(&scene, &Camera::orthographic(DVec3::Z, DVec3::Y).unwrap()).unwrap()
    }

    #[test]
    fn lines_run_from_corner_to_corner_inside_patches_and_leave_the_border_out() {
        // The torus has knots at quarters, where it is merely continuous: a curve over them has corners there.
        let corners = [[0.3, 0.3], [0.45, 0.3], [0.45, 0.45], [0.3, 0.45], [0.3, 0.3]];
        let square = vec![polyline(&corners.map(|c| DVec3::new(c[0], c[1], 0.0))).unwrap()];
        let corners = [[0.0, 0.6], [0.1, 0.6], [0.1, 0.7], [0.0, 0.7], [0.0, 0.6]];
        let beside = vec![polyline(&corners.map(|c| DVec3::new(c[0], c[1], 0.0))).unwrap()];
        let round = circle_about(0.625, 0.625, 0.05);
        let view = view(&[square, beside, round]);
        let lines = TrimLine::all(&view, 0);
        assert_eq!(lines.len(), 4 + 3 + 1);
        for line in &lines {
            for (k, span) in line.spans.iter().enumerate() {
                let patch = &view.patches()[span.patch];
                for s in [0.0, 0.5, 1.0] {
                    let at = patch.to_local(span.piece.eval(s));
                    assert!(at.cmpge(DVec2::ZERO).all() && at.cmple(DVec2::ONE).all(), "{at}");
                }
                if k > 0 {
                    assert_eq!(line.spans[k - 1].piece.to(), span.piece.from());
                }
            }
        }
        let [a, b] = lines[7].domain();
        assert_eq!(lines[7].uv(a), lines[7].uv(b));
    }

    #[test]
    fn derivatives_are_those_of_the_points_and_the_nearest_point_of_one_on_it_is_itself() {
        let view = view(&[circle_about(0.4, 0.5, 0.3)]);
        for line in TrimLine::all(&view, 0) {
            let [a, b] = line.domain();
            for k in 0..40 {
                let t = a + (b - a) * (f64::from(k) + 0.37) / 40.0;
                let (p, d) = line.jet(&view, t);
                assert!(p.distance(view.model_point(0, line.uv(t))) < 1e-13);
                let h = 1e-6;
                let quotient = (line.point(&view, t + h) - line.point(&view, t - h)) / (2.0 * h);
                assert!((quotient - d).length() < 1e-6 * d.length(), "{t}");
                let (found, distance) = line.nearest(&view, p);
                assert!((found - t).abs() < 1e-7 && distance < 1e-12, "{t}: {found} {distance}");
                let (lo, hi) = line.bounds(&view);
                assert!(p.cmpge(lo).all() && p.cmple(hi).all());
            }
        }
    }
}
