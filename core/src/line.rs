//! Isoparametric lines: a surface's points at constant u or constant v, exact in view space.

use alloc::vec::Vec;

use glam::{DVec2, DVec3, DVec4};

use crate::view::{MAX_DEGREE, ViewScene, curve_jet, curve_point};

/// Which parameter is held constant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Axis {
    /// u is constant, the line runs in v.
    U,
    /// v is constant, the line runs in u.
    V,
}

/// The part of a line inside one patch: a rational Bézier curve.
#[derive(Clone, Debug, PartialEq)]
pub struct LineSpan {
    /// Interval of the running parameter.
    pub t: [f64; 2],
    /// The patch it lies in.
    pub patch: usize,
    /// The constant parameter, local to the patch.
    pub local: f64,
    /// Homogeneous control points in view space.
    pub points: Vec<DVec4>,
}

/// An isoparametric line across a surface, in view space.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Index of the surface.
    pub surface: usize,
    /// Which parameter is constant.
    pub axis: Axis,
    /// Its value.
    pub value: f64,
    /// On a knot line: whether the line belongs to the patches below it.
    pub below: bool,
    /// One curve a patch, in the order of the running parameter.
    pub spans: Vec<LineSpan>,
}

impl Line {
    /// The line at `value` over the surface's whole domain. Cost: O(p·q) a patch crossed.
    #[must_use]
    pub fn new(view: &ViewScene, surface: usize, axis: Axis, value: f64, below: bool) -> Self {
        Self::over(view, surface, axis, value, below, [f64::NEG_INFINITY, f64::INFINITY])
    }

    /// The spans of the line that hold part of the interval `t` of the running parameter; all of them if it is empty.
    #[must_use]
    pub fn over(view: &ViewScene, surface: usize, axis: Axis, value: f64, below: bool, t: [f64; 2]) -> Self {
        let grid = &view.surfaces()[surface];
        let all = match axis {
            Axis::U => &grid.v_breaks,
            Axis::V => &grid.u_breaks,
        };
        let first = all.partition_point(|&b| b <= t[0]).saturating_sub(1);
        let last = all.partition_point(|&b| b < t[1]);
        let breaks = all.get(first..=last.min(all.len() - 1)).filter(|part| part.len() > 1).unwrap_or(all);
        let mut spans = Vec::with_capacity(breaks.len() - 1);
        for w in breaks.windows(2) {
            let middle = 0.5 * (w[0] + w[1]);
            let (uv, below) = match axis {
                Axis::U => (DVec2::new(value, middle), [below, false]),
                Axis::V => (DVec2::new(middle, value), [false, below]),
            };
            let (index, local) = view.locate(surface, uv, below);
            let patch = &view.patches()[index];
            let (p, q) = (patch.degree_u, patch.degree_v);
            let mut across = [DVec4::ZERO; MAX_DEGREE + 1];
            let points = match axis {
                Axis::U => (0..=q)
                    .map(|j| {
                        (0..=p).for_each(|i| across[i] = patch.points[i * (q + 1) + j]);
                        curve_point(&across[..=p], local.x)
                    })
                    .collect(),
                Axis::V => patch.points.chunks_exact(q + 1).map(|row| curve_point(row, local.y)).collect(),
            };
            let local = if axis == Axis::U { local.x } else { local.y };
            spans.push(LineSpan { t: [w[0], w[1]], patch: index, local, points });
        }
        Self { surface, axis, value, below, spans }
    }

    /// Interval of the running parameter.
    #[must_use]
    pub fn domain(&self) -> [f64; 2] {
        [self.spans[0].t[0], self.spans[self.spans.len() - 1].t[1]]
    }

    /// Surface parameters at `t`.
    #[must_use]
    pub fn uv(&self, t: f64) -> DVec2 {
        match self.axis {
            Axis::U => DVec2::new(self.value, t),
            Axis::V => DVec2::new(t, self.value),
        }
    }

    /// Index of the span that holds `t`.
    #[must_use]
    pub fn span_at(&self, t: f64) -> usize {
        let after = self.spans.partition_point(|s| s.t[0] <= t);
        after.saturating_sub(1)
    }

    /// The patch at `t`, and the local parameters in it.
    #[must_use]
    pub fn place(&self, t: f64) -> (usize, DVec2) {
        let span = &self.spans[self.span_at(t)];
        let local = (t - span.t[0]) / (span.t[1] - span.t[0]);
        let at = match self.axis {
            Axis::U => DVec2::new(span.local, local),
            Axis::V => DVec2::new(local, span.local),
        };
        (span.patch, at)
    }

    /// Position and derivative by the running parameter, in view space.
    #[must_use]
    pub fn jet(&self, t: f64) -> (DVec3, DVec3) {
        let span = &self.spans[self.span_at(t)];
        let width = span.t[1] - span.t[0];
        let (h, d) = curve_jet(&span.points, (t - span.t[0]) / width);
        let p = h.truncate() / h.w;
        (p, (d.truncate() - p * d.w) / (h.w * width))
    }

    /// Position in view space.
    #[must_use]
    pub fn point(&self, t: f64) -> DVec3 {
        self.jet(t).0
    }

    /// Length of the control polygon in view space, an upper bound of the line's length.
    #[must_use]
    pub fn length_bound(&self) -> f64 {
        let e = |h: &DVec4| h.truncate() / h.w;
        self.spans.iter().flat_map(|s| s.points.windows(2)).map(|w| (e(&w[1]) - e(&w[0])).length()).sum()
    }

    /// Nearest point of the line to `p` in view space: parameter and distance. Sampled, then Newton on the derivative
    /// of the squared distance, kept in the bracket of the best sample; local minima closer together than a sixteenth
    /// of a span are not told apart.
    #[must_use]
    pub fn nearest(&self, p: DVec3) -> (f64, f64) {
        if let [span] = &self.spans[..]
            && let [from, to] = span.points[..]
        {
            return nearest_on_segment(span.t, from, to, p);
        }
        let [a, b] = self.domain();
        let mut best = (a, f64::INFINITY);
        for span in &self.spans {
            let w = span.t[1] - span.t[0];
            for k in 0..=SAMPLES {
                let t = span.t[0] + w * f64::from(k) / f64::from(SAMPLES);
                let d = (self.point(t) - p).length_squared();
                if d < best.1 {
                    best = (t, d);
                }
            }
        }
        let found = self.nearest_beside(p, best.0);
        // The ends of a closed line are one point, and the nearest may be beside the other one.
        let beyond = if best.0 == a {
            self.nearest_beside(p, b)
        } else if best.0 == b {
            self.nearest_beside(p, a)
        } else {
            found
        };
        if beyond.1 < found.1 { beyond } else { found }
    }

    /// Nearest point to `p` within a sample's distance of the parameter `from`: parameter and distance, the latter no
    /// larger than at `from`.
    fn nearest_beside(&self, p: DVec3, from: f64) -> (f64, f64) {
        let [a, b] = self.domain();
        // At a knot the samples are not equally far on both sides.
        let step = |span: &LineSpan| (span.t[1] - span.t[0]) / f64::from(SAMPLES);
        let below = self.spans.partition_point(|s| s.t[0] < from).saturating_sub(1);
        let lo = (from - step(&self.spans[below])).max(a);
        let hi = (from + step(&self.spans[self.span_at(from)])).min(b);
        let t = foot(|t| self.jet(t), p, from, [lo, hi], b - a);
        let distance = |t: f64| (self.point(t) - p).length();
        let (d, before) = (distance(t), distance(from));
        if d <= before { (t, d) } else { (from, before) }
    }
}

/// The parameter of a curve near `from`, within `bounds`, at which it is nearest to `p`: Gauss–Newton, which converges
/// quadratically as long as the point is on the curve or nearly so. To the rounding of parameters as large as `range`.
pub(crate) fn foot(jet: impl Fn(f64) -> (DVec3, DVec3), p: DVec3, from: f64, bounds: [f64; 2], range: f64) -> f64 {
    let mut t = from;
    for _ in 0..30 {
        let (q, d) = jet(t);
        let slope = d.length_squared();
        if slope == 0.0 {
            break;
        }
        let next = (t - (q - p).dot(d) / slope).clamp(bounds[0], bounds[1]);
        let moved = (next - t).abs();
        t = next;
        if moved.is_nan() || moved <= 1e-15 * range {
            break;
        }
    }
    t
}

/// Nearest point to `p` of the segment between two homogeneous points over the parameters `t`: parameter and distance.
fn nearest_on_segment(t: [f64; 2], from: DVec4, to: DVec4, p: DVec3) -> (f64, f64) {
    let (a, b) = (from.truncate() / from.w, to.truncate() / to.w);
    let chord = b - a;
    let squared = chord.length_squared();
    let along = if squared > 0.0 { ((p - a).dot(chord) / squared).clamp(0.0, 1.0) } else { 0.0 };
    // The fraction of the chord at the parameter s is s w₁ / ((1 − s) w₀ + s w₁).
    let s = along * from.w / (along * from.w + (1.0 - along) * to.w);
    (t[0] + s * (t[1] - t[0]), (a + chord * along - p).length())
}

/// Places a span at which a search for the nearest point begins.
const SAMPLES: u32 = 16;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Scene, SceneSurface};
    use crate::shape::{Frame, torus};
    use crate::view::Camera;
    use alloc::vec;

    /// A torus of radii 3 and 1 seen from above: view coordinates are model coordinates.
    fn view() -> ViewScene {
        let surface = torus(&Frame::WORLD, 3.0, 1.0).unwrap();
        let scene = Scene { name: "t".into(), surfaces: vec![SceneSurface::new("t", surface)] };
        ViewScene::new(&scene, &Camera::orthographic(DVec3::Z, DVec3::Y).unwrap()).unwrap()
    }

    #[test]
    fn lines_of_both_directions_lie_on_the_surface_and_their_derivatives_are_tangents() {
        let view = view();
        for axis in [Axis::U, Axis::V] {
            let line = Line::new(&view, 0, axis, 0.3, false);
            for k in 0..=40 {
                let t = f64::from(k) / 40.0;
                let (p, d) = line.jet(t);
                assert!((p - view.model_point(0, line.uv(t))).length() < 1e-13);
                let h = 1e-6;
                let quotient = (line.point(t + h) - line.point(t - h)) / (2.0 * h);
                // Knots excepted: there the derivative of a rational circle jumps.
                if t > 0.0 && t < 1.0 && !line.spans.iter().any(|s| (s.t[0] - t).abs() < 2.0 * h) {
                    assert!((quotient - d).length() < 1e-6 * d.length(), "{axis:?} {t}");
                }
            }
        }
    }

    #[test]
    fn the_nearest_point_of_a_segment_is_its_foot_whatever_its_weights() {
        let (from, to) = (DVec4::new(1.0, 2.0, 0.0, 1.0), DVec4::new(20.0, 8.0, 0.0, 4.0));
        for k in 0..=10 {
            let s = f64::from(k) / 10.0;
            let h = from.lerp(to, s);
            let foot = h.truncate() / h.w;
            let (t, d) = nearest_on_segment([3.0, 5.0], from, to, foot + DVec3::Z);
            assert!((t - (3.0 + 2.0 * s)).abs() < 1e-12 && (d - 1.0).abs() < 1e-12, "{s}: {t}");
        }
        assert_eq!(nearest_on_segment([3.0, 5.0], from, to, DVec3::new(0.0, 2.0, 0.0)), (3.0, 1.0));
    }

    #[test]
    fn the_nearest_point_of_a_circle_is_radially_below() {
        let view = view();
        // The outer equator: the profile begins there.
        let line = Line::new(&view, 0, Axis::V, 0.0, false);
        for k in 0..32 {
            let angle = 0.1 + f64::from(k) * 0.19;
            let direction = DVec3::new(libm::cos(angle), libm::sin(angle), 0.0);
            let (t, d) = line.nearest(direction * 5.0);
            assert!((line.point(t) - direction * 4.0).length() < 1e-7, "{angle}");
            assert!((d - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_nearest_point_of_a_circle_may_be_on_either_side_of_its_seam() {
        let view = view();
        let line = Line::new(&view, 0, Axis::V, 0.0, false);
        let [a, b] = line.domain();
        for offset in [1e-9, 1e-5, 1e-3, 0.25 / 32.0, 0.0078] {
            for t in [a + offset, b - offset] {
                let (found, d) = line.nearest(line.point(t));
                assert!((found - t).abs() < 1e-12 && d < 1e-12, "{t}: {found}, {d}");
            }
        }
    }

    #[test]
    fn the_nearest_point_may_be_on_the_longer_side_of_a_knot() {
        let ring = torus(&Frame::WORLD, 3.0, 1.0).unwrap().insert_knot_u(0.26, 1).unwrap();
        let scene = Scene { name: "t".into(), surfaces: vec![SceneSurface::new("t", ring)] };
        let view = ViewScene::new(&scene, &Camera::orthographic(DVec3::Z, DVec3::Y).unwrap()).unwrap();
        let line = Line::new(&view, 0, Axis::V, 0.0, false);
        for t in [0.25 - 0.007, 0.25 - 0.001, 0.2501, 0.26 + 0.006] {
            let (found, d) = line.nearest(line.point(t));
            assert!((found - t).abs() < 1e-12 && d < 1e-12, "{t}: {found}, {d}");
        }
    }
}
