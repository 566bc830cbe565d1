//! Curves as arcs: pieces of polynomials that can be intersected, tame enough for strips and cones.

use alloc::boxed::Box;
use alloc::vec::Vec;

use glam::{DVec2, DVec3, DVec4};

use super::LengthTable;
use super::arc::{Arc, Control, screen, split_control};
use super::run::{Keeper, Run};
use crate::extract::{Geometry, Path, SurfaceCurve};
use crate::stop::Stop;

/// The curves as arcs, ready to be intersected.
#[derive(Clone, Debug, Default)]
pub struct Arcs {
    /// For each curve its arcs.
    curves: Vec<Box<[Run]>>,
}

impl Arcs {
    /// Covers every curve with arcs: exact for isoparametric lines, within `fit` (screen units) for traced ones; and within
    /// its gap where it is an edge whose sides are apart.
    #[must_use]
    pub fn new(curves: &[SurfaceCurve], geometry: &Geometry<'_>, fit: f64, stop: Stop<'_>) -> Self {
        let mut all = Self { curves: Vec::with_capacity(curves.len()) };
        all.extend(curves, 0, geometry, fit, stop);
        all
    }

    /// Adds the arcs of further curves, the first of which has the index `first`.
    pub fn extend(&mut self, curves: &[SurfaceCurve], first: usize, geometry: &Geometry<'_>, fit: f64, stop: Stop<'_>) {
        let mut keeper = Keeper::default();
        for (k, curve) in (first..).zip(curves) {
            if !stop.is_wanted() {
                cover_curve(curve, k, geometry, fit, &mut keeper);
            }
            self.curves.push(keeper.take());
        }
    }

    /// All arcs, curve by curve.
    pub(super) fn iter(&self) -> impl Iterator<Item = Arc> + Clone {
        (0..self.curves.len()).flat_map(|curve| self.of(curve))
    }

    /// Screen box of all curves: lower left and upper right corner. No curve leaves it by more than a
    /// millionth of its size and the error of its arcs, and it is no larger than the curves.
    ///
    /// Control polygons are halved only where they reach beyond what is known to be on a curve.
    #[must_use]
    pub fn extent(&self) -> [DVec2; 2] {
        let mut found = [DVec2::INFINITY, DVec2::NEG_INFINITY];
        for arc in self.iter() {
            let (p, q) = arc.ends();
            found = [found[0].min(p).min(q), found[1].max(p).max(q)];
        }
        // A picture that is one point has the rounding of its coordinates instead of a size.
        let rounding = 64.0 * f64::EPSILON * found[0].abs().max(found[1].abs()).max_element();
        let slack = DVec2::splat(rounding.max(EXTENT_SLACK * (found[1] - found[0]).max_element()));
        for arc in self.iter() {
            widen(&arc, slack, &mut found, 0);
        }
        found
    }

    /// The place of an active curve that is outermost in a direction on the screen: curve and parameter. None if places
    /// more than `apart` away from it in space are as far out, to within `margin`: they may lie in front of it.
    #[must_use]
    pub(crate) fn outermost(
        &self,
        curves: &[SurfaceCurve],
        direction: DVec2,
        margin: f64,
        apart: f64,
    ) -> Option<(usize, f64)> {
        let reach =
            |points: &[DVec4]| points.iter().map(|h| screen(*h).dot(direction)).fold(f64::NEG_INFINITY, f64::max);
        let ends = |(p, q): (DVec2, DVec2)| p.dot(direction).max(q.dot(direction));
        let active = || self.iter().filter(|a| curves[a.curve].active);
        let mut known = active().map(|a| ends(a.ends())).fold(f64::NEG_INFINITY, f64::max);
        let mut open: Vec<(Arc, u32)> =
            active().filter(|a| reach(&a.points) >= known - margin).map(|a| (a, 0)).collect();
        let mut found: Vec<Arc> = Vec::new();
        while let Some((arc, depth)) = open.pop() {
            known = known.max(ends(arc.ends()));
            let far = reach(&arc.points);
            if far < known - margin {
                continue;
            }
            // A control polygon nears its arc by a factor of four with each halving.
            if far - ends(arc.ends()) <= margin || depth >= 20 {
                found.push(arc);
            } else {
                let (a, b) = arc.halves();
                open.extend([(a, depth + 1), (b, depth + 1)]);
            }
        }
        found.retain(|a| reach(&a.points) >= known - margin);
        let best = found.iter().max_by(|a, b| ends(a.ends()).total_cmp(&ends(b.ends())))?;
        let (lo, hi) = (best.lo.extend(best.z[0]), best.hi.extend(best.z[1]));
        let near = |a: &Arc| {
            let (low, high) = (a.lo.extend(a.z[0]), a.hi.extend(a.z[1]));
            (hi.max(high) - lo.min(low)).max_element() <= apart
        };
        let (p, q) = best.ends();
        let x = if p.dot(direction) >= q.dot(direction) { 0.0 } else { 1.0 };
        found.iter().all(near).then(|| (best.curve, best.param(x)))
    }

    /// The arcs of one curve, in order.
    pub(super) fn of(&self, curve: usize) -> impl DoubleEndedIterator<Item = Arc> + Clone {
        self.curves[curve].iter().flat_map(move |run| (0..run.len()).map(move |k| run.arc(k, curve)))
    }

    /// The number of arcs of one curve.
    pub(super) fn count(&self, curve: usize) -> usize {
        self.curves[curve].iter().map(Run::len).sum()
    }

    /// An arc of one curve.
    pub(super) fn arc(&self, curve: usize, mut k: usize) -> Option<Arc> {
        for run in &self.curves[curve] {
            if k < run.len() {
                return Some(run.arc(k, curve));
            }
            k -= run.len();
        }
        None
    }

    /// The first arc of one curve that holds the parameter `t`.
    pub(super) fn holding(&self, curve: usize, t: f64) -> Option<Arc> {
        self.curves[curve].iter().find_map(|run| Some(run.arc(run.holding(t)?, curve)))
    }

    /// Lengths below `resolution` (screen units) are not told apart.
    pub(super) fn length_table(&self, curve: &SurfaceCurve, index: usize, resolution: f64) -> LengthTable {
        let mut knots = Vec::with_capacity(self.count(index) + 1);
        knots.push((curve.domain[0], 0.0));
        for a in self.of(index) {
            let (p, q) = a.ends();
            measure(&a, [0.0, 1.0], [p, q], resolution, &mut knots, 0);
        }
        if knots.len() == 1 {
            knots.push((curve.domain[1], 0.0));
        }
        LengthTable { knots }
    }
}

/// Appends the end of the part of an arc over the interval `x` of its Bézier parameter, from `p` to `q` on the screen, to
/// a table of parameters and lengths; parts first whose parameter runs unevenly.
///
/// Quarters of a part that is even have lengths within a factor of two of each other. Towards a place where the curve stands
/// still, and where weights differ by many orders of magnitude, each halving leaves at least one half even or below
/// the resolution, so that some [`MOST_UNEVEN`] parts for each such place are enough.
fn measure(arc: &Arc, x: [f64; 2], [p, q]: [DVec2; 2], resolution: f64, knots: &mut Vec<(f64, f64)>, depth: u32) {
    let at = |f: f64| arc.jet(x[0] + f * (x[1] - x[0])).0.truncate();
    let middle = at(0.5);
    let quarters = [p, at(0.25), middle, at(0.75), q];
    let mut lengths = [0.0; 4];
    for (k, w) in quarters.windows(2).enumerate() {
        lengths[k] = w[0].distance(w[1]);
    }
    let [least, most] =
        [lengths.iter().copied().fold(f64::INFINITY, f64::min), lengths.iter().copied().fold(0.0, f64::max)];
    if depth >= MOST_UNEVEN || most <= resolution || most <= 2.0 * least {
        let before = knots.last().map_or(0.0, |k| k.1);
        knots.push((arc.param(x[1]), before + p.distance(q)));
    } else {
        let m = 0.5 * (x[0] + x[1]);
        measure(arc, [x[0], m], [p, middle], resolution, knots, depth + 1);
        measure(arc, [m, x[1]], [middle, q], resolution, knots, depth + 1);
    }
}

/// Halvings of an arc that is measured, at the most: what is left is a few roundings of its parameter long.
const MOST_UNEVEN: u32 = 50;

/// Overhang that [`Arcs::extent`] leaves, of the size of the box: a third of a micrometre on a sheet of 300 mm.
const EXTENT_SLACK: f64 = 1e-6;

/// Widens `found` to hold `arc` up to `slack`. The polygon nears the arc by a factor of four with each halving, so ten of
/// them reach the slack; only halves that still reach beyond are followed.
fn widen(arc: &Arc, slack: DVec2, found: &mut [DVec2; 2], depth: u32) {
    const DEEPEST: u32 = 16;
    let beyond = |p: DVec2| p.cmplt(found[0] - slack).any() || p.cmpgt(found[1] + slack).any();
    if depth >= DEEPEST || !arc.points.iter().any(|h| beyond(screen(*h))) {
        return;
    }
    let (left, right) = arc.halves();
    let (_, middle) = left.ends();
    *found = [found[0].min(middle), found[1].max(middle)];
    widen(&left, slack, found, depth + 1);
    widen(&right, slack, found, depth + 1);
}

/// The arcs of one curve.
fn cover_curve(curve: &SurfaceCurve, index: usize, geometry: &Geometry<'_>, fit: f64, arcs: &mut Keeper) {
    match &curve.path {
        Path::Line(line) => {
            for span in &line.spans {
                let (a, b) = (span.t[0].max(curve.domain[0]), span.t[1].min(curve.domain[1]));
                if a < b {
                    let width = span.t[1] - span.t[0];
                    let all: Control = span.points.iter().copied().collect();
                    let (x, y) = ((a - span.t[0]) / width, (b - span.t[0]) / width);
                    let right = if x > 0.0 { split_control(&all, x).1 } else { all };
                    let part = if y < 1.0 { split_control(&right, (y - x) / (1.0 - x)).0 } else { right };
                    tame(&Arc::new(index, [a, b], part, curve.gap), fit, arcs, 0);
                }
            }
        }
        Path::Traced(_) | Path::Section(_) | Path::Trim(_) => {
            let fit = Fit { curve, index, geometry, tolerance: fit };
            let [a, b] = curve.domain;
            for segment in a as usize..libm::ceil(b) as usize {
                let (t0, t1) = (a.max(segment as f64), b.min((segment + 1) as f64));
                let ((p0, d0), (p1, d1)) = (curve.jet(geometry, t0), curve.jet_below(geometry, t1));
                fit.hermite((t0, p0, d0), (t1, p1, d1), arcs, 0);
            }
        }
    }
}

/// Halves an arc until it is tame. Where the curve runs along the sight line and comes back on the screen, the one arc that is
/// left in the end is as long as the square of its part of the parameter.
fn tame(arc: &Arc, point: f64, out: &mut Keeper, depth: u32) {
    const DEEPEST: u32 = 16;
    if depth >= DEEPEST || is_tame(arc, point) {
        out.push(arc);
    } else {
        let (l, r) = arc.halves();
        tame(&l, point, out, depth + 1);
        tame(&r, point, out, depth + 1);
    }
}

/// Whether tangents stay within 45° of the chord, so that strips are thin and cone tests can succeed; or the arc is no
/// larger than `point`: a curve along the sight line has no direction on the screen that halving could bring out.
fn is_tame(arc: &Arc, point: f64) -> bool {
    arc.strip().spread <= 1.0 || (arc.hi - arc.lo).max_element() <= 2.0 * arc.error + point
}

/// A traced curve that is being covered by arcs.
struct Fit<'a> {
    curve: &'a SurfaceCurve,
    index: usize,
    geometry: &'a Geometry<'a>,
    tolerance: f64,
}

/// A parameter with position and derivative there.
type Node = (f64, DVec3, DVec3);

impl Fit<'_> {
    /// Cubic Hermite arcs within the tolerance between two places of one segment. The error falls with the fourth power
    /// of the length, so a few halvings reach any tolerance; it is measured at three inner points.
    fn hermite(&self, from: Node, to: Node, out: &mut Keeper, depth: u32) {
        const DEEPEST: u32 = 12;
        let ((t0, p0, d0), (t1, p1, d1)) = (from, to);
        let h = t1 - t0;
        let legs = [d0, d1].map(|d| leg(d * (h / 3.0), p1 - p0));
        let points = [p0, p0 + legs[0], p1 - legs[1], p1];
        let control: Control = points.iter().map(|p| DVec4::new(p.x, p.y, p.z, 1.0)).collect();
        let arc = Arc::new(self.index, [t0, t1], control, self.tolerance);
        let m = 0.5 * (t0 + t1);
        let (pm, dm) = self.curve.jet(self.geometry, m);
        // The middle first: there the error is largest, and the point serves the halves.
        let mut error = (arc.jet(0.5).0 - pm).length();
        let tame = is_tame(&arc, self.tolerance);
        // Where the curve is known less well than the tolerance, arcs cannot be better, however short.
        let enough = self.tolerance.max(self.curve.rounding(self.geometry, m));
        if (error <= enough && tame) || depth >= DEEPEST {
            for x in [0.25, 0.75] {
                error = error.max((arc.jet(x).0 - self.curve.point(self.geometry, t0 + x * h)).length());
            }
        }
        if depth >= DEEPEST || (error <= enough && tame) {
            let error = self.tolerance.max(2.0 * error) + self.curve.gap;
            out.push(&Arc::new(self.index, [t0, t1], arc.points, error));
        } else {
            self.hermite(from, (m, pm, dm), out, depth + 1);
            self.hermite((m, pm, dm), to, out, depth + 1);
        }
    }
}

/// A leg of a Hermite arc's control polygon, no longer than the chord on the screen and in space. The derivative of a
/// traced curve grows beyond all bounds towards a place where its independent parameter stands still, and means nothing
/// at a singular point. A monotone cubic has legs of its chord's length at most (Fritsch and Carlson 1980), so nothing is
/// lost on short arcs.
fn leg(tangent: DVec3, chord: DVec3) -> DVec3 {
    if !tangent.is_finite() {
        return chord / 3.0;
    }
    let bounded = |d: DVec2, most: f64| d.clamp_length_max(most.max(f64::MIN_POSITIVE));
    let flat = bounded(tangent.truncate(), chord.truncate().length());
    flat.extend(tangent.z.clamp(-chord.length(), chord.length()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The quarter circle round (5, 3) from angle 45° to 135°, whose top is inside and whose control polygon is higher.
    fn quarter() -> Arcs {
        let c = libm::sqrt(0.5);
        let points = [(c, c, 1.0), (0.0, 2.0 * c, c), (-c, c, 1.0)].map(|(x, y, w)| {
            let middle = DVec2::new(5.0, 3.0);
            // The middle control point is at √2 above the centre, with weight cos 45°.
            let p = if w < 1.0 { middle + DVec2::new(0.0, y) } else { middle + DVec2::new(x, y) };
            DVec4::new(p.x * w, p.y * w, 0.0, w)
        });
        let mut keeper = Keeper::default();
        keeper.push(&Arc::new(0, [0.0, 1.0], points.into_iter().collect(), 0.0));
        Arcs { curves: alloc::vec![keeper.take()] }
    }

    #[test]
    fn the_extent_is_that_of_the_curve_and_not_of_its_polygon() {
        let [lo, hi] = quarter().extent();
        let c = libm::sqrt(0.5);
        assert!((lo - DVec2::new(5.0 - c, 3.0 + c)).length() < 1e-14, "{lo}");
        assert!((hi.x - 5.0 - c).abs() < 1e-14 && (hi.y - 4.0).abs() < 2e-6 && hi.y <= 4.0 + 1e-15, "{hi}");
    }
}
