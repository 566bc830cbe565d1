//! Curves as arcs: pieces of polynomials that can be intersected, tame enough for strips and cones.

use alloc::boxed::Box;
use alloc::vec::Vec;

use glam::DVec2;

use super::LengthTable;
use super::arc::{Arc, screen};
use super::cover::{Covering, Taker};
use super::division::{Division, Walk};
use super::run::Run;
use crate::extract::{Geometry, SurfaceCurve};
use crate::stop::Stop;

/// What is kept of the curves as arcs; [`with`](Self::with) the curves it is what can be intersected.
#[derive(Clone, Debug, Default)]
pub struct Arcs {
    curves: Vec<Kept>,
    fit: f64,
    keep: bool,
}

/// What is kept of the arcs of one curve.
#[derive(Clone, Debug)]
pub(super) enum Kept {
    /// The arcs.
    Whole(Box<[Run]>),
    /// Where they begin and end.
    Divided(Division),
}

impl Arcs {
    /// Covers every curve with arcs: exact for isoparametric lines, within `fit` (screen units) for traced ones; and within
    /// its gap where it is an edge whose sides are apart. With `keep` false the arcs are made again whenever they are asked for, the same
    /// to the bit, and take a few bytes each instead of a hundred.
    #[must_use]
    pub fn new(curves: &[SurfaceCurve], geometry: &Geometry<'_>, fit: f64, keep: bool, stop: Stop<'_>) -> Self {
        let mut all = Self { curves: Vec::with_capacity(curves.len()), fit, keep };
        all.extend(curves, geometry, stop);
        all
    }

    /// Adds the arcs of further curves.
    pub fn extend(&mut self, curves: &[SurfaceCurve], geometry: &Geometry<'_>, stop: Stop<'_>) {
        let mut taker = Taker::new(self.keep);
        for curve in curves {
            let covering = Covering { curve, index: self.curves.len(), geometry: *geometry, tolerance: self.fit };
            if !stop.is_wanted() {
                covering.cover(&mut taker);
            }
            self.curves.push(taker.take());
        }
    }

    /// The arcs of the curves that they are of, evaluated by what these were evaluated by.
    #[must_use]
    pub fn with<'a>(&'a self, curves: &'a [SurfaceCurve], geometry: Geometry<'a>) -> CurveArcs<'a> {
        CurveArcs { arcs: self, curves, geometry }
    }
}

/// The curves as arcs, ready to be intersected.
#[derive(Clone, Copy, Debug)]
pub struct CurveArcs<'a> {
    arcs: &'a Arcs,
    /// The curves.
    pub(super) curves: &'a [SurfaceCurve],
    geometry: Geometry<'a>,
}

impl<'a> CurveArcs<'a> {
    /// All arcs, curve by curve.
    pub(super) fn iter(self) -> impl Iterator<Item = Arc> + Clone {
        (0..self.arcs.curves.len()).flat_map(move |curve| self.one(curve).iter())
    }

    /// Screen box of all curves: lower left and upper right corner. No curve leaves it by more than a
    /// millionth of its size and the error of its arcs, and it is no larger than the curves.
    ///
    /// Control polygons are halved only where they reach beyond what is known to be on a curve.
    #[must_use]
    pub fn extent(self) -> [DVec2; 2] {
        extent_of(&self.iter())
    }

    /// For each direction on the screen the place of an active curve that is outermost in it: curve and parameter. None if places
    /// more than `apart` away from it in space are as far out, to within `margin`: they may lie in front of it.
    #[must_use]
    pub(crate) fn outermost<const N: usize>(
        self,
        directions: [DVec2; N],
        margin: f64,
        apart: f64,
    ) -> [Option<(usize, f64)>; N] {
        let mut farthest = [f64::NEG_INFINITY; N];
        let active = || self.iter().filter(|a| self.curves[a.curve].active);
        for arc in active() {
            for (known, &direction) in farthest.iter_mut().zip(&directions) {
                *known = known.max(end_reach(&arc, direction));
            }
        }
        let mut open = [const { Vec::new() }; N];
        for arc in active() {
            for ((open, &known), &direction) in open.iter_mut().zip(&farthest).zip(&directions) {
                if reach(&arc, direction) >= known - margin {
                    open.push((arc.clone(), 0));
                }
            }
        }
        core::array::from_fn(|k| outermost_of(core::mem::take(&mut open[k]), directions[k], farthest[k], margin, apart))
    }

    /// One of the curves.
    pub(super) fn one(self, index: usize) -> OneCurve<'a> {
        OneCurve { kept: &self.arcs.curves[index], covering: self.covering(&self.curves[index], index) }
    }

    /// What is kept of the arcs of a curve that comes after all of these: the arcs, for one curve has few.
    pub(super) fn cover_later(self, curve: &SurfaceCurve) -> Kept {
        let mut taker = Taker::new(true);
        self.covering(curve, self.curves.len()).cover(&mut taker);
        taker.take()
    }

    /// That curve, with what [`cover_later`](Self::cover_later) gave.
    pub(super) fn later(self, curve: &'a SurfaceCurve, kept: &'a Kept) -> OneCurve<'a> {
        OneCurve { kept, covering: self.covering(curve, self.curves.len()) }
    }

    fn covering<'b>(self, curve: &'b SurfaceCurve, index: usize) -> Covering<'b>
    where
        'a: 'b,
    {
        Covering { curve, index, geometry: self.geometry, tolerance: self.arcs.fit }
    }
}

/// A curve with its arcs.
#[derive(Clone, Copy)]
pub(super) struct OneCurve<'a> {
    kept: &'a Kept,
    covering: Covering<'a>,
}

impl<'a> OneCurve<'a> {
    /// The curve.
    pub(super) fn curve(self) -> &'a SurfaceCurve {
        self.covering.curve
    }

    /// Its index among all.
    pub(super) fn index(self) -> usize {
        self.covering.index
    }

    /// Its arcs in order.
    pub(super) fn iter(self) -> Series<'a> {
        match self.kept {
            Kept::Whole(runs) => Series::Whole { runs, next: 0, curve: self.covering.index },
            Kept::Divided(division) => Series::Divided(division.walk(self.covering)),
        }
    }

    /// The number of its arcs.
    pub(super) fn count(self) -> usize {
        match self.kept {
            Kept::Whole(runs) => runs.iter().map(Run::len).sum(),
            Kept::Divided(division) => division.len(),
        }
    }

    /// One of its arcs.
    pub(super) fn arc(self, k: usize) -> Option<Arc> {
        self.iter().nth(k)
    }

    /// Whether an arc takes evaluations of the curve, and is worth remembering.
    pub(super) fn is_dear(self) -> bool {
        matches!(self.kept, Kept::Divided(_)) && self.curve().axis().is_none()
    }

    /// The first arc that holds the parameter `t`.
    pub(super) fn holding(self, t: f64) -> Option<Arc> {
        match self.kept {
            Kept::Whole(runs) => runs.iter().find_map(|run| Some(run.arc(run.holding(t)?, self.covering.index))),
            Kept::Divided(_) => self.iter().find(|arc| arc.t[0] <= t && t <= arc.t[1]),
        }
    }

    /// Lengths below `resolution` (screen units) are not told apart.
    pub(super) fn length_table(self, resolution: f64) -> LengthTable {
        let curve = self.curve();
        let mut table = Measured { knots: Vec::new(), rates: [0.0; 2] };
        table.knots.push((curve.domain[0], 0.0));
        for a in self.iter() {
            let (p, q) = a.ends();
            measure(&a, [0.0, 1.0], [p, q], resolution, &mut table, 0);
        }
        let Measured { mut knots, .. } = table;
        if knots.len() == 1 {
            knots.push((curve.domain[1], 0.0));
        }
        knots.shrink_to_fit();
        LengthTable { knots }
    }
}

/// A table of lengths that is being made.
struct Measured {
    knots: Vec<(f64, f64)>,
    /// Least and largest length by the parameter in what the last interval is made of.
    rates: [f64; 2],
}

impl Measured {
    /// Adds an interval up to the parameter `t`, along which the length grows by `length`: as one with the last, if the parameter
    /// runs alike in both.
    fn add(&mut self, t: f64, length: f64) {
        let (before, total) = self.knots.last().copied().unwrap_or_default();
        let rate = length / (t - before);
        let [least, most] = [self.rates[0].min(rate), self.rates[1].max(rate)];
        let next = (t, total + length);
        match self.knots.last_mut() {
            Some(last) if least > 0.0 && most <= ALIKE * least => {
                *last = next;
                self.rates = [least, most];
            }
            _ => {
                self.knots.push(next);
                self.rates = [rate; 2];
            }
        }
    }
}

/// Intervals of a table are one while the parameter runs as evenly as this in them.
const ALIKE: f64 = 1.25;

/// The arcs of one curve in order.
#[derive(Clone)]
pub(super) enum Series<'a> {
    Whole { runs: &'a [Run], next: usize, curve: usize },
    Divided(Walk<'a>),
}

impl Iterator for Series<'_> {
    type Item = Arc;

    fn next(&mut self) -> Option<Arc> {
        self.nth(0)
    }

    /// Makes no arc that is passed over.
    fn nth(&mut self, n: usize) -> Option<Arc> {
        match self {
            Self::Whole { runs, next, curve } => {
                *next += n;
                while let Some((run, others)) = runs.split_first() {
                    if *next < run.len() {
                        *next += 1;
                        return Some(run.arc(*next - 1, *curve));
                    }
                    *next -= run.len();
                    *runs = others;
                }
                None
            }
            Self::Divided(walk) => walk.nth(n),
        }
    }
}

/// How far the control points of an arc reach in a direction on the screen.
fn reach(arc: &Arc, direction: DVec2) -> f64 {
    arc.points.iter().map(|h| screen(*h).dot(direction)).fold(f64::NEG_INFINITY, f64::max)
}

/// How far its ends do.
fn end_reach(arc: &Arc, direction: DVec2) -> f64 {
    let (p, q) = arc.ends();
    p.dot(direction).max(q.dot(direction))
}

/// The outermost place of arcs, of which some end reaches as far as `known`; see [`CurveArcs::outermost`].
fn outermost_of(
    mut open: Vec<(Arc, u32)>,
    direction: DVec2,
    mut known: f64,
    margin: f64,
    apart: f64,
) -> Option<(usize, f64)> {
    let mut found: Vec<Arc> = Vec::new();
    while let Some((arc, depth)) = open.pop() {
        known = known.max(end_reach(&arc, direction));
        let far = reach(&arc, direction);
        if far < known - margin {
            continue;
        }
        // A control polygon nears its arc by a factor of four with each halving.
        if far - end_reach(&arc, direction) <= margin || depth >= 20 {
            found.push(arc);
        } else {
            let (a, b) = arc.halves();
            open.extend([(a, depth + 1), (b, depth + 1)]);
        }
    }
    found.retain(|a| reach(a, direction) >= known - margin);
    let best = found.iter().max_by(|a, b| end_reach(a, direction).total_cmp(&end_reach(b, direction)))?;
    let (lo, hi) = (best.lo.extend(best.z[0]), best.hi.extend(best.z[1]));
    let near = |a: &Arc| {
        let (low, high) = (a.lo.extend(a.z[0]), a.hi.extend(a.z[1]));
        (hi.max(high) - lo.min(low)).max_element() <= apart
    };
    let (p, q) = best.ends();
    let x = if p.dot(direction) >= q.dot(direction) { 0.0 } else { 1.0 };
    found.iter().all(near).then(|| (best.curve, best.param(x)))
}

/// Appends the end of the part of an arc over the interval `x` of its Bézier parameter, from `p` to `q` on the screen, to
/// a table of parameters and lengths; parts first whose parameter runs unevenly.
///
/// Quarters of a part that is even have lengths within a factor of two of each other. Towards a place where the curve stands
/// still, and where weights differ by many orders of magnitude, each halving leaves at least one half even or below
/// the resolution, so that some [`MOST_UNEVEN`] parts for each such place are enough.
fn measure(arc: &Arc, x: [f64; 2], [p, q]: [DVec2; 2], resolution: f64, table: &mut Measured, depth: u32) {
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
        table.add(arc.param(x[1]), p.distance(q));
    } else {
        let m = 0.5 * (x[0] + x[1]);
        measure(arc, [x[0], m], [p, middle], resolution, table, depth + 1);
        measure(arc, [m, x[1]], [middle, q], resolution, table, depth + 1);
    }
}

/// Halvings of an arc that is measured, at the most: what is left is a few roundings of its parameter long.
const MOST_UNEVEN: u32 = 50;

/// Overhang that [`CurveArcs::extent`] leaves, of the size of the box: a third of a micrometre on a sheet of 300 mm.
const EXTENT_SLACK: f64 = 1e-6;

/// The box of arcs; see [`CurveArcs::extent`].
fn extent_of(arcs: &(impl Iterator<Item = Arc> + Clone)) -> [DVec2; 2] {
    let mut found = [DVec2::INFINITY, DVec2::NEG_INFINITY];
    for arc in arcs.clone() {
        let (p, q) = arc.ends();
        found = [found[0].min(p).min(q), found[1].max(p).max(q)];
    }
    // A picture that is one point has the rounding of its coordinates instead of a size.
    let rounding = 64.0 * f64::EPSILON * found[0].abs().max(found[1].abs()).max_element();
    let slack = DVec2::splat(rounding.max(EXTENT_SLACK * (found[1] - found[0]).max_element()));
    for arc in arcs.clone() {
        widen(&arc, slack, &mut found, 0);
    }
    found
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec4;

    /// The quarter circle round (5, 3) from angle 45° to 135°, whose top is inside and whose control polygon is higher.
    fn quarter() -> Arc {
        let c = libm::sqrt(0.5);
        let points = [(c, c, 1.0), (0.0, 2.0 * c, c), (-c, c, 1.0)].map(|(x, y, w)| {
            let middle = DVec2::new(5.0, 3.0);
            // The middle control point is at √2 above the centre, with weight cos 45°.
            let p = if w < 1.0 { middle + DVec2::new(0.0, y) } else { middle + DVec2::new(x, y) };
            DVec4::new(p.x * w, p.y * w, 0.0, w)
        });
        Arc::new(0, [0.0, 1.0], points.into_iter().collect(), 0.0)
    }

    #[test]
    fn the_extent_is_that_of_the_curve_and_not_of_its_polygon() {
        let [lo, hi] = extent_of(&core::iter::once(quarter()));
        let c = libm::sqrt(0.5);
        assert!((lo - DVec2::new(5.0 - c, 3.0 + c)).length() < 1e-14, "{lo}");
        assert!((hi.x - 5.0 - c).abs() < 1e-14 && (hi.y - 4.0).abs() < 2e-6 && hi.y <= 4.0 + 1e-15, "{hi}");
    }

    #[test]
    fn intervals_that_run_alike_are_one_and_the_length_stays() {
        let mut table = Measured { knots: alloc::vec![(0.0, 0.0)], rates: [0.0; 2] };
        // The parameter runs a little faster each time, then stands still, then jumps.
        let lengths = [1.0, 1.1, 1.2, 1.3, 1.4, 0.0, 0.0, 7.0, 6.0];
        for (k, length) in lengths.into_iter().enumerate() {
            table.add((k + 1) as f64, length);
        }
        table.add(9.0, 0.5);
        assert_eq!(table.knots.iter().map(|knot| knot.0).collect::<Vec<_>>(), [0.0, 3.0, 5.0, 6.0, 7.0, 9.0, 9.0]);
        let total = table.knots[table.knots.len() - 1].1;
        assert!((total - lengths.iter().sum::<f64>() - 0.5).abs() < 1e-12, "{total}");
    }
}
