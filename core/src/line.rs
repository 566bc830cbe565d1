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
        let grid = &view.surfaces()[surface];
        let breaks = match axis {
            Axis::U => &grid.v_breaks,
            Axis::V => &grid.u_breaks,
        };
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
            let mut row = [DVec4::ZERO; MAX_DEGREE + 1];
            let points = match axis {
                Axis::U => (0..=q)
                    .map(|j| {
                        (0..=p).for_each(|i| row[i] = patch.points[i * (q + 1) + j]);
                        curve_point(&mut row[..=p], local.x)
                    })
                    .collect(),
                Axis::V => (0..=p)
                    .map(|i| {
                        row[..=q].copy_from_slice(&patch.points[i * (q + 1)..(i + 1) * (q + 1)]);
                        curve_point(&mut row[..=q], local.y)
                    })
                    .collect(),
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

    /// Position and derivative by the running parameter, in view space.
    #[must_use]
    pub fn jet(&self, t: f64) -> (DVec3, DVec3) {
        let span = &self.spans[self.span_at(t)];
        let mut c = [DVec4::ZERO; MAX_DEGREE + 1];
        c[..span.points.len()].copy_from_slice(&span.points);
        let width = span.t[1] - span.t[0];
        let (h, d) = curve_jet(&mut c[..span.points.len()], (t - span.t[0]) / width);
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
        const SAMPLES: usize = 16;
        let mut best = (self.domain()[0], f64::INFINITY);
        for span in &self.spans {
            let w = span.t[1] - span.t[0];
            for k in 0..=SAMPLES {
                let t = span.t[0] + w * k as f64 / SAMPLES as f64;
                let d = (self.point(t) - p).length_squared();
                if d < best.1 {
                    best = (t, d);
                }
            }
        }
        let [a, b] = self.domain();
        let span = &self.spans[self.span_at(best.0)];
        let step = (span.t[1] - span.t[0]) / SAMPLES as f64;
        let (lo, hi) = ((best.0 - step).max(a), (best.0 + step).min(b));
        let mut t = best.0;
        for _ in 0..30 {
            let (q, d) = self.jet(t);
            let slope = d.length_squared();
            if slope == 0.0 {
                break;
            }
            // Gauss–Newton: the point is on the line or nearly so, where it converges quadratically.
            let next = (t - (q - p).dot(d) / slope).clamp(lo, hi);
            let moved = (next - t).abs();
            t = next;
            if moved <= 1e-15 * (b - a) {
                break;
            }
        }
        let d = (self.point(t) - p).length();
        if d * d <= best.1 { (t, d) } else { (best.0, libm::sqrt(best.1)) }
    }
}
