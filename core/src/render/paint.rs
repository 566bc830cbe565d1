//! Isocurves into pixels.

use alloc::vec::Vec;

use glam::{DVec2, DVec4};

use super::{PixelGrid, REACH, Sample};
use crate::extract::adaptive::restricted;
use crate::line::{Axis, Line};
use crate::stop::Stop;
use crate::trim_line::TrimLine;
use crate::view::ViewScene;

/// Halvings of a curve after which it is painted as if it were short enough. No curve that is painted in reasonable time
/// needs as many: it would be 2⁴⁰ times as long as the reach.
const LIMIT: u32 = 40;

/// Halvings of a span of a trim line before the distance of its ends is taken for its extent.
const LEAST_HALVINGS: u32 = 4;

/// The part of an isocurve in one patch.
#[derive(Clone, Copy, Debug)]
struct Arc {
    patch: usize,
    axis: Axis,
    /// The constant parameter, local to the patch.
    value: f64,
    /// The interval of the running one, local to the patch.
    t: [f64; 2],
    /// First control point over that interval, and their number.
    first: usize,
    count: usize,
}

/// Isocurves as Bézier curves in the homogeneous coordinates (X, Y, Z, W), where X / W and Y / W are pixels to the right and
/// down, and Z / W is the depth.
pub(super) struct Arcs {
    grid: PixelGrid,
    arcs: Vec<Arc>,
    points: Vec<DVec4>,
    /// Points of curves that are no isocurves.
    dots: Vec<Dot>,
    /// Isocurves pushed.
    pub(super) curves: u64,
}

impl Arcs {
    pub(super) fn new(grid: PixelGrid) -> Self {
        Self { grid, arcs: Vec::new(), points: Vec::new(), dots: Vec::new(), curves: 0 }
    }

    /// Adds the part over `t` of an isocurve.
    pub(super) fn push(&mut self, line: &Line, t: [f64; 2]) {
        self.curves += 1;
        let PixelGrid { corner, pixel, .. } = self.grid;
        for span in line.spans.iter().filter(|s| s.t[0] < t[1] && s.t[1] > t[0]) {
            let width = span.t[1] - span.t[0];
            let local = t.map(|t| ((t - span.t[0]) / width).clamp(0.0, 1.0));
            let (first, count) = (self.points.len(), span.points.len());
            let part = restricted(&span.points, local);
            let moved = part.iter().map(|h| {
                let place = (h.truncate().truncate() - corner * h.w) / pixel;
                DVec4::new(place.x, -place.y, h.z, h.w)
            });
            self.points.extend(moved);
            self.arcs.push(Arc { patch: span.patch, axis: line.axis, value: span.local, t: local, first, count });
        }
    }

    /// Adds a trim line by points of it, each within the reach of the next: its spans are halved until the chord is half of
    /// that, four times in any case.
    pub(super) fn push_trim(&mut self, view: &ViewScene, line: &TrimLine) {
        self.curves += 1;
        let mut open: Vec<(f64, f64, u32)> =
            (0..line.spans.len()).rev().map(|k| (k as f64, k as f64 + 1.0, 0)).collect();
        let place = |t: f64| self.grid.place(line.point(view, t).truncate());
        let mut dots = Vec::new();
        while let Some((a, b, halvings)) = open.pop() {
            let middle = 0.5 * (a + b);
            let far = place(a).distance(place(b)) > 0.5 * REACH;
            if halvings < LEAST_HALVINGS || (far && halvings < LIMIT) {
                open.extend([(middle, b, halvings + 1), (a, middle, halvings + 1)]);
            } else {
                let (patch, at) = line.place(view, middle);
                dots.push(Dot { place: place(middle), z: line.point(view, middle).z, patch, at });
            }
        }
        self.dots.extend(dots);
    }
}

/// A point of a curve.
#[derive(Clone, Copy, Debug)]
struct Dot {
    /// Pixels to the right and down.
    place: DVec2,
    z: f64,
    patch: usize,
    at: DVec2,
}

/// Rows of a raster.
pub(super) struct Band<'a> {
    /// Index of the first row.
    top: usize,
    width: usize,
    samples: &'a mut [Option<Sample>],
    /// Lower and upper bound of the pixel coordinates of what may be painted into the rows.
    lo: DVec2,
    hi: DVec2,
    painted: u64,
}

impl<'a> Band<'a> {
    /// The rows from `top` on that `samples` has room for.
    pub(super) fn new(top: usize, width: usize, samples: &'a mut [Option<Sample>]) -> Self {
        let lo = DVec2::new(0.0, top as f64);
        let hi = DVec2::new(width as f64, (top + samples.len() / width) as f64);
        Self { top, width, samples, lo, hi, painted: 0 }
    }

    /// Paints what of the isocurves lies in the rows, and returns the number of points painted.
    pub(super) fn paint(mut self, arcs: &Arcs, stop: Stop<'_>) -> u64 {
        for arc in &arcs.arcs {
            if stop.is_wanted() {
                break;
            }
            let points = &arcs.points[arc.first..arc.first + arc.count];
            // The curve of each degree in an array of its own size: halving is all that is done, and done millions of times.
            match points.len() {
                2 => self.arc::<2>(arc, points),
                3 => self.arc::<3>(arc, points),
                4 => self.arc::<4>(arc, points),
                5 => self.arc::<5>(arc, points),
                6 => self.arc::<6>(arc, points),
                7 => self.arc::<7>(arc, points),
                8 => self.arc::<8>(arc, points),
                9 => self.arc::<9>(arc, points),
                _ => self.arc::<{ crate::view::MAX_DEGREE + 1 }>(arc, points),
            }
        }
        for dot in &arcs.dots {
            self.sample(dot.place, Sample { z: dot.z, patch: dot.patch, at: dot.at });
        }
        self.painted
    }

    fn arc<const N: usize>(&mut self, arc: &Arc, points: &[DVec4]) {
        if let Ok(points) = points.try_into() {
            self.part::<N>(arc, points, arc.t, LIMIT);
        }
    }

    /// Paints the part over `t` of a curve, whose control points these are. The curve lies in their convex hull: nothing is
    /// painted of parts whose hull is outside of the rows, and the middle alone of parts whose control points, and with
    /// them the curve, are within the reach of it.
    fn part<const N: usize>(&mut self, arc: &Arc, points: &[DVec4; N], t: [f64; 2], halvings: u32) {
        if self.misses(points) {
            return;
        }
        let [lower, upper] = halved(points);
        let h = upper[0];
        let middle = h / h.w;
        let near = |p: &DVec4| {
            let (x, y) = (p.x - middle.x * p.w, p.y - middle.y * p.w);
            x * x + y * y <= REACH * REACH * p.w * p.w
        };
        let half = 0.5 * (t[0] + t[1]);
        if halvings == 0 || points.iter().all(near) {
            self.point(arc, middle, half);
        } else {
            self.part(arc, &lower, [t[0], half], halvings - 1);
            self.part(arc, &upper, [half, t[1]], halvings - 1);
        }
    }

    /// Whether a curve with these control points is surely outside of the rows.
    fn misses(&self, points: &[DVec4]) -> bool {
        points.iter().all(|p| p.y < self.lo.y * p.w)
            || points.iter().all(|p| p.y > self.hi.y * p.w)
            || points.iter().all(|p| p.x < self.lo.x * p.w)
            || points.iter().all(|p| p.x > self.hi.x * p.w)
    }

    /// Paints the point of an isocurve at `t`.
    fn point(&mut self, arc: &Arc, at: DVec4, t: f64) {
        let local = match arc.axis {
            Axis::U => DVec2::new(arc.value, t),
            Axis::V => DVec2::new(t, arc.value),
        };
        self.sample(at.truncate().truncate(), Sample { z: at.z, patch: arc.patch, at: local });
    }

    /// Puts a sample into its pixel, if that is in the rows and holds nothing nearer.
    fn sample(&mut self, at: DVec2, sample: Sample) {
        if !(at.x >= self.lo.x && at.x < self.hi.x && at.y >= self.lo.y && at.y < self.hi.y) {
            return;
        }
        self.painted += 1;
        let pixel = (at.y as usize - self.top) * self.width + at.x as usize;
        let Some(there) = self.samples.get_mut(pixel) else { return };
        if there.is_none_or(|s| s.z < sample.z) {
            *there = Some(sample);
        }
    }
}

/// The control points of both halves of a curve, by de Casteljau's corner cutting.
fn halved<const N: usize>(points: &[DVec4; N]) -> [[DVec4; N]; 2] {
    let (mut lower, mut upper) = (*points, *points);
    for (r, low) in lower.iter_mut().enumerate().skip(1) {
        for k in 0..N - r {
            upper[k] = (upper[k] + upper[k + 1]) * 0.5;
        }
        *low = upper[0];
    }
    [lower, upper]
}
