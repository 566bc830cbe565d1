//! Short, tame pieces of curves on the screen, bounded by the strips of Elber and Cohen 1989, §4.

use glam::{DVec2, DVec3, DVec4};

use crate::view::{MAX_DEGREE, curve_jet};

/// Control points of an arc: fixed room, so that intersecting allocates nothing.
pub(crate) type Control = heapless::Vec<DVec4, { MAX_DEGREE + 1 }>;

/// A rational Bézier curve in view space that stands for a curve on the parameter interval `t`, within `error` on the
/// screen (0 for isoparametric lines, which are such curves exactly, unless they are edges whose sides are apart).
#[derive(Clone, Debug)]
pub(crate) struct Arc {
    /// Index of the curve.
    pub(crate) curve: usize,
    /// Interval of the curve's parameter; the Bézier parameter runs linearly in it.
    pub(crate) t: [f64; 2],
    /// Homogeneous control points.
    pub(crate) points: Control,
    /// Largest distance on the screen between the curve and this arc.
    pub(crate) error: f64,
    /// Screen box, `error` included.
    pub(crate) lo: DVec2,
    /// Screen box, `error` included.
    pub(crate) hi: DVec2,
    /// Lower and upper bound of the depth.
    pub(crate) z: [f64; 2],
}

pub(crate) fn screen(h: DVec4) -> DVec2 {
    DVec2::new(h.x / h.w, h.y / h.w)
}

impl Arc {
    pub(crate) fn new(curve: usize, t: [f64; 2], points: Control, error: f64) -> Self {
        let [lo, hi] = extremes(points.iter().map(|h| h.truncate() / h.w));
        Self::within(lo, hi, curve, t, points, error)
    }

    /// As [`new`](Self::new), with `places` as the control points without their weights.
    pub(crate) fn over(
        places: impl Iterator<Item = DVec3>,
        curve: usize,
        t: [f64; 2],
        points: Control,
        error: f64,
    ) -> Self {
        let [lo, hi] = extremes(places);
        Self::within(lo, hi, curve, t, points, error)
    }

    /// With control points between `lo` and `hi`.
    fn within(lo: DVec3, hi: DVec3, curve: usize, t: [f64; 2], points: Control, error: f64) -> Self {
        let e = DVec2::splat(error);
        let (z, lo, hi) = ([lo.z - error, hi.z + error], lo.truncate() - e, hi.truncate() + e);
        Self { curve, t, points, error, lo, hi, z }
    }

    /// First and last point on the screen.
    pub(crate) fn ends(&self) -> (DVec2, DVec2) {
        (screen(self.points[0]), screen(self.points[self.points.len() - 1]))
    }

    /// From the first to the last point on the screen.
    pub(crate) fn chord(&self) -> DVec2 {
        let (p, q) = self.ends();
        q - p
    }

    /// Curve parameter of the Bézier parameter `x`.
    pub(crate) fn param(&self, x: f64) -> f64 {
        self.t[0] + x * (self.t[1] - self.t[0])
    }

    /// Position at the curve parameter `t`, view space.
    pub(crate) fn at(&self, t: f64) -> DVec3 {
        self.jet_at(t).0
    }

    /// Position at the curve parameter `t`, and derivative by the Bézier parameter, view space.
    pub(crate) fn jet_at(&self, t: f64) -> (DVec3, DVec3) {
        self.jet((t - self.t[0]) / (self.t[1] - self.t[0]))
    }

    /// Position and derivative at the Bézier parameter `x`, view space.
    pub(crate) fn jet(&self, x: f64) -> (DVec3, DVec3) {
        let (h, d) = curve_jet(&self.points, x);
        let p = h.truncate() / h.w;
        (p, (d.truncate() - p * d.w) / h.w)
    }

    /// The two halves.
    pub(crate) fn halves(&self) -> (Arc, Arc) {
        let (l, r) = split_control(&self.points, 0.5);
        let m = 0.5 * (self.t[0] + self.t[1]);
        (Arc::new(self.curve, [self.t[0], m], l, self.error), Arc::new(self.curve, [m, self.t[1]], r, self.error))
    }

    /// The strip that holds the arc on the screen.
    pub(crate) fn strip(&self) -> Strip {
        let (a, b) = self.ends();
        let chord = b - a;
        let length = chord.length();
        let dir = if length > 0.0 { chord / length } else { DVec2::X };
        let normal = dir.perp();
        let (mut lo, mut hi) = (0.0_f64, 0.0_f64);
        // Tangents are positive combinations of the differences of neighbouring control points (the weights being
        // positive), so their widest angle to the chord bounds the tangent cone.
        let mut spread = 0.0_f64;
        let mut last = a;
        for h in self.points.iter() {
            let e = screen(*h);
            let d = (e - a).dot(normal);
            lo = lo.min(d);
            hi = hi.max(d);
            let step = e - last;
            let (along, across) = (step.dot(dir), step.dot(normal).abs());
            if along > 0.0 {
                spread = spread.max(across / along);
            } else if along < 0.0 || across > 0.0 {
                spread = f64::INFINITY;
            }
            last = e;
        }
        Strip { origin: a, dir, length, lo: lo - self.error, hi: hi + self.error, spread }
    }
}

/// Least and greatest coordinates.
fn extremes(places: impl Iterator<Item = DVec3>) -> [DVec3; 2] {
    places.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[lo, hi], p| [lo.min(p), hi.max(p)])
}

/// A rotated box round an arc: chord direction, extent across it, and the tangent of the widest tangent angle to it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Strip {
    pub(crate) origin: DVec2,
    pub(crate) dir: DVec2,
    pub(crate) length: f64,
    pub(crate) lo: f64,
    pub(crate) hi: f64,
    pub(crate) spread: f64,
}

impl Strip {
    /// The strip with `by` added to its width.
    pub(crate) fn wider(self, by: f64) -> Self {
        Self { lo: self.lo - 0.5 * by, hi: self.hi + 0.5 * by, ..self }
    }

    pub(crate) fn width(&self) -> f64 {
        self.hi - self.lo
    }

    /// Whether all control points of `arc` lie on one side of the strip.
    pub(crate) fn excludes(&self, arc: &Arc) -> bool {
        let normal = self.dir.perp();
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        for h in &arc.points {
            let d = (screen(*h) - self.origin).dot(normal);
            lo = lo.min(d);
            hi = hi.max(d);
        }
        lo - arc.error > self.hi || hi + arc.error < self.lo
    }

    /// How far the chord lines move apart over the length of the shorter chord. The cones of straight arcs are so narrow that
    /// they are apart by rounding alone.
    pub(crate) fn divergence(&self, other: &Self) -> f64 {
        self.dir.perp_dot(other.dir).abs() * self.length.min(other.length)
    }

    /// Whether no tangent of one is parallel to a tangent of the other, so that the arcs cross at most once
    /// (the cone test of Sederberg and Meyers 1988).
    pub(crate) fn cones_apart(&self, other: &Self) -> bool {
        if !(self.spread.is_finite() && other.spread.is_finite()) {
            return false;
        }
        let sine = self.dir.perp_dot(other.dir).abs();
        let cosine = self.dir.dot(other.dir).abs();
        // tan(α + β) < tan θ with θ in (0, π/2]; the sum must stay below a right angle.
        let product = self.spread * other.spread;
        product < 1.0 && (self.spread + other.spread) * cosine < sine * (1.0 - product)
    }
}

/// Control points of the two parts at `x`.
pub(crate) fn split_control(points: &[DVec4], x: f64) -> (Control, Control) {
    // Those of an arc, for which there is room.
    let mut right = Control::from_slice(points).unwrap_or_default();
    let mut left = Control::new();
    for r in (0..points.len()).rev() {
        // Room is the same as that of `points`, so this push cannot fail.
        let _ = left.push(right[0]);
        for i in 0..r {
            right[i] = right[i] + (right[i + 1] - right[i]) * x;
        }
    }
    (left, right)
}
