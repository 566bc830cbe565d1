//! How far a strip of a surface between two isocurves is from the ruled surface between them (R̂ ⇝ R in Elber and Cohen
//! 1992, who leave the test open).
//!
//! With homogeneous H over the strip and Ĥ linear across it from one isocurve to the other, E = H − Ĥ is a tensor
//! polynomial on each patch, and its coefficients, each the difference of a control point from the ruled surface's, bound it.
//! Both surfaces divided by their weights, R − R̂ = (E Ŵ − Ĥ E_w) / (W Ŵ). The bound is a polynomial along the strip, with the
//! largest coefficient across the strip for each along it, so that where it exceeds a limit is again a zero set.

use alloc::vec::Vec;

use glam::{DVec3, DVec4};

use super::Metric;
use super::rail::{Rail, RailSpan, common_weight, restricted};
use crate::bernstein::{Piecewise, Univariate, binomial};
use crate::line::Axis;
use crate::view::{Patch, SurfaceGrid, ViewScene};

/// Bounds for the strips of one surface in one direction.
pub(super) struct Ruled<'a> {
    view: &'a ViewScene,
    grid: &'a SurfaceGrid,
    axis: Axis,
    metric: Metric,
    /// For each patch of the surface a bound of the deviation of a strip inside it, over the squared share of the patch
    /// that the strip is wide.
    bends: Vec<f64>,
}

impl<'a> Ruled<'a> {
    pub(super) fn new(view: &'a ViewScene, surface: usize, axis: Axis, metric: Metric) -> Self {
        let grid = &view.surfaces()[surface];
        let count = grid.count_u() * grid.count_v();
        let bends = view.patches()[grid.first..grid.first + count].iter().map(|p| bend(p, axis, metric)).collect();
        Self { view, grid, axis, metric, bends }
    }

    /// Knots across the strips.
    pub(super) fn across(&self) -> &'a [f64] {
        match self.axis {
            Axis::U => &self.grid.u_breaks,
            Axis::V => &self.grid.v_breaks,
        }
    }

    /// Rows of patches that strips between the parameters `s` enter.
    pub(super) fn rows(&self, s: [f64; 2]) -> core::ops::Range<usize> {
        let breaks = self.across();
        let last = breaks.len() - 2;
        let low = breaks.partition_point(|&b| b <= s[0]).saturating_sub(1).min(last);
        let high = breaks.partition_point(|&b| b < s[1]).clamp(low + 1, last + 1);
        low..high
    }

    /// The patch over `t` in a row.
    fn patch(&self, t: [f64; 2], row: usize) -> usize {
        let along = match self.axis {
            Axis::U => &self.grid.v_breaks,
            Axis::V => &self.grid.u_breaks,
        };
        let column = along.partition_point(|&b| b <= t[0]).saturating_sub(1).min(along.len() - 2);
        match self.axis {
            Axis::U => self.grid.patch(row, column),
            Axis::V => self.grid.patch(column, row),
        }
    }

    /// A bound of the distance from each point of the strip between the rails `a` and `b` to the ruled surface between
    /// them, on the screen or in space, as a function of the running parameter. Where it is `enough` or less, any bound up
    /// to that is as good.
    pub(super) fn deviation(&self, s: [f64; 2], [a, b]: [&Rail; 2], enough: f64) -> Piecewise {
        let rows = self.rows(s);
        let width = s[1] - s[0];
        let spans = a.spans.iter().zip(&b.spans).map(|(x, y)| {
            let patches = rows.clone().map(|row| (row, self.patch(x.t, row)));
            if rows.len() == 1
                && let Some((row, patch)) = patches.clone().next()
            {
                let share = width / (self.across()[row + 1] - self.across()[row]);
                let bound = self.bends[patch - self.grid.first] * share * share;
                if bound <= enough {
                    return (x.t, Univariate::constant(bound));
                }
            }
            let mut most: Vec<f64> = Vec::new();
            for (row, patch) in patches {
                let breaks = [self.across()[row], self.across()[row + 1]];
                let part = [s[0].max(breaks[0]), s[1].min(breaks[1])];
                let rails = part.map(|v| between(x, y, (v - s[0]) / width));
                let local = part.map(|v| (v - breaks[0]) / (breaks[1] - breaks[0]));
                let net = self.net(&self.view.patches()[patch], x.t, local);
                let found = coefficients(&net, &rails, self.metric);
                most.resize(found.len().max(most.len()), 0.0);
                most.iter_mut().zip(found).for_each(|(m, f)| *m = m.max(f));
            }
            (x.t, Univariate::new(most))
        });
        Piecewise::new(spans.collect::<Vec<_>>())
    }

    /// Control points over `t` along and the local `s` across, the index across fastest.
    fn net(&self, patch: &Patch, t: [f64; 2], s: [f64; 2]) -> Net {
        let (p, q) = (patch.degree_u, patch.degree_v);
        let width = q + 1;
        let at = |i: usize, j: usize| patch.points[i * width + j];
        // Columns run along the strip.
        let (along, across, domain) = match self.axis {
            Axis::V => (p, q, patch.u),
            Axis::U => (q, p, patch.v),
        };
        let local = t.map(|x| ((x - domain[0]) / (domain[1] - domain[0])).clamp(0.0, 1.0));
        let columns = (0..=across).map(|j| {
            let column: Vec<DVec4> = match self.axis {
                Axis::V => (0..=along).map(|i| at(i, j)).collect(),
                Axis::U => (0..=along).map(|i| at(j, i)).collect(),
            };
            restricted(&column, local)
        });
        let columns: Vec<Vec<DVec4>> = columns.collect();
        let rows = (0..=along).map(|i| {
            let row: Vec<DVec4> = columns.iter().map(|c| c[i]).collect();
            restricted(&row, s)
        });
        Net { along, across, points: rows.flatten().collect() }
    }
}

/// Control points of a strip in one patch.
struct Net {
    along: usize,
    across: usize,
    points: Vec<DVec4>,
}

/// The isocurve of the ruled surface at a fraction of its width.
fn between(a: &RailSpan, b: &RailSpan, fraction: f64) -> Vec<DVec4> {
    a.points.iter().zip(&b.points).map(|(p, q)| *p + (*q - *p) * fraction).collect()
}

fn length(d: DVec3, metric: Metric) -> f64 {
    match metric {
        Metric::Screen => d.truncate().length(),
        Metric::Space => d.length(),
    }
}

/// Coefficients along the strip of the bound of R − R̂.
fn coefficients(net: &Net, rails: &[Vec<DVec4>; 2], metric: Metric) -> Vec<f64> {
    let (p, q) = (net.along, net.across);
    let ruled = |i: usize, j: usize| rails[0][i] + (rails[1][i] - rails[0][i]) * (j as f64 / q as f64);
    let off = |i: usize, j: usize| net.points[i * (q + 1) + j] - ruled(i, j);
    let all = net.points.iter().chain(&rails[0]).chain(&rails[1]);
    if let Some(w) = common_weight(all) {
        let widest = |i: usize| (0..=q).map(|j| length(off(i, j).truncate(), metric)).fold(0.0, f64::max);
        return (0..=p).map(|i| widest(i) / w).collect();
    }
    let lightest = |points: &[DVec4]| points.iter().map(|h| h.w).fold(f64::INFINITY, f64::min);
    let weights = lightest(&net.points) * lightest(&rails[0]).min(lightest(&rails[1]));
    // E Ŵ − Ĥ E_w of degree 2p along and q + 1 across; Ĥ is linear across.
    let mut sum = alloc::vec![DVec3::ZERO; (2 * p + 1) * (q + 2)];
    for (i, j) in (0..=p).flat_map(|i| (0..=q).map(move |j| (i, j))) {
        let e = off(i, j);
        for (k, l) in (0..=p).flat_map(|k| [(k, 0), (k, 1)]) {
            let h = rails[l][k];
            let term = e.truncate() * h.w - h.truncate() * e.w;
            sum[(i + k) * (q + 2) + j + l] += term * (binomial(p, i) * binomial(q, j) * binomial(p, k));
        }
    }
    let row = |i: usize| {
        let scale = |j: usize| binomial(2 * p, i) * binomial(q + 1, j) * weights;
        (0..q + 2).map(|j| length(sum[i * (q + 2) + j], metric) / scale(j)).fold(0.0, f64::max)
    };
    (0..=2 * p).map(row).collect()
}

/// The deviation of a strip of width x, as a share of a patch, is at most x² times this: an eighth of the second derivative
/// across for H (the error of linear interpolation), with R̂ within the patch's ball for what the weights add.
fn bend(patch: &Patch, axis: Axis, metric: Metric) -> f64 {
    let (p, q) = (patch.degree_u, patch.degree_v);
    let width = q + 1;
    let euclidean: Vec<DVec3> = patch.points.iter().map(|h| h.truncate() / h.w).collect();
    let centre = euclidean.iter().sum::<DVec3>() / euclidean.len() as f64;
    let radius = euclidean.iter().map(|e| length(*e - centre, metric)).fold(0.0, f64::max);
    let lightest = patch.points.iter().map(|h| h.w).fold(f64::INFINITY, f64::min);
    let (degree, stride) = if axis == Axis::U { (p, width) } else { (q, 1) };
    if degree < 2 {
        return 0.0;
    }
    let mut most = 0.0_f64;
    for k in 0..patch.points.len() {
        let index = if axis == Axis::U { k / width } else { k % width };
        if index + 2 <= degree {
            let d = patch.points[k] - 2.0 * patch.points[k + stride] + patch.points[k + 2 * stride];
            let centred = d.truncate() - centre * d.w;
            most = most.max(length(centred, metric) + radius * d.w.abs());
        }
    }
    (degree * (degree - 1)) as f64 * most / (8.0 * lightest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::line::Line;
    use crate::scene::{Scene, SceneSurface};
    use crate::shape::{Frame, torus};
    use crate::view::Camera;
    use alloc::vec;

    fn view(surface: crate::nurbs::Surface) -> ViewScene {
        let scene = Scene { name: "t".into(), surfaces: vec![SceneSurface::new("t", surface)] };
        ViewScene::new(&scene, &Camera::orthographic(DVec3::new(1.0, 0.3, 0.7), DVec3::Z).unwrap()).unwrap()
    }

    /// The largest distance between points of the strip and of the ruled surface at equal parameters, with the share
    /// across that makes it smallest: densely sampled, so a lower bound of the distance between the surfaces.
    fn sampled(view: &ViewScene, axis: Axis, s: [f64; 2], t: f64, metric: Metric) -> f64 {
        let at = |s: f64| Line::new(view, 0, axis, s, false).point(t);
        let (a, b) = (at(s[0]), at(s[1]));
        let mut most = 0.0_f64;
        for k in 0..=40 {
            let p = at(s[0] + (s[1] - s[0]) * f64::from(k) / 40.0);
            let nearest = (0..=400).map(|j| length(p - a.lerp(b, f64::from(j) / 400.0), metric));
            most = most.max(nearest.fold(f64::INFINITY, f64::min));
        }
        most
    }

    #[test]
    fn no_point_is_farther_than_the_bound_and_the_bound_falls_with_the_square_of_the_width() {
        let wave = {
            let knots = || crate::nurbs::KnotVector::bezier(3, [0.0, 1.0]).unwrap();
            let points = (0..16).map(|k| {
                let (i, j) = (f64::from(k / 4), f64::from(k % 4));
                DVec4::new(i, j, libm::sin(2.0 * i + 3.0 * j), 1.0)
            });
            crate::nurbs::Surface::new(knots(), knots(), points.collect()).unwrap()
        };
        for surface in [torus(&Frame::WORLD, 3.0, 1.0).unwrap(), wave] {
            let view = view(surface);
            for (axis, metric) in [
                (Axis::U, Metric::Screen),
                (Axis::V, Metric::Space),
                (Axis::U, Metric::Space),
                (Axis::V, Metric::Screen),
            ] {
                let ruled = Ruled::new(&view, 0, axis, metric);
                let mut last = f64::INFINITY;
                // The widest strip of the torus goes over a knot.
                for width in [0.4, 0.1, 0.025, 0.00625] {
                    let s = [0.2, 0.2 + width];
                    let [a, b] = s.map(|s| Rail::new(&view, 0, axis, s, [0.05, 0.95]));
                    let bound = ruled.deviation(s, [&a, &b], 0.0);
                    for k in 0..=20 {
                        let t = 0.05 + 0.9 * f64::from(k) / 20.0;
                        let found = sampled(&view, axis, s, t, metric);
                        assert!(found <= bound.eval(t) + 1e-12, "{axis:?} {metric:?} {width} {t}: {found}");
                    }
                    let most = bound.magnitude();
                    assert!(most < last / 4.0, "{width}: {most} after {last}");
                    last = most;
                }
            }
        }
    }
}
