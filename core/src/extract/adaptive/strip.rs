//! Algorithm 1 of Elber and Cohen 1992: a strip of a surface between two isocurves is divided where they are too far
//! apart.

use alloc::vec::Vec;

use glam::DVec2;

use super::equal::equal_strips;
use super::rail::{IsoDistance, Rail, followed};
use super::ruled::Ruled;
use super::tone::Shade;
use super::{AdaptiveOptions, AdaptiveStats, Cover, IsoPiece, Metric, RULED, domain, metric};
use crate::bernstein::{Piecewise, Univariate, complement, intersection, union};
use crate::extract::Geometry;
use crate::line::Axis;
use crate::stop::Stop;

/// Fraction of the largest density within which a shaded density is followed along an isocurve.
const DENSITY_STEP: f64 = 0.02;

/// Unit roundoff of view coordinates is exceeded by projection and extraction this many times.
const ROUNDINGS: f64 = 16.0;

/// Parts of a patch across which a strip may at most reach before the tone on its rails and in its middle stands for that
/// of the whole of it.
const TONE_PARTS: f64 = 8.0;

/// Factor of the density by which a curve is judged that is the middle of a strip, by the strip's index, from 1 down to 1/2:
/// neighbours differ (van der Corput's sequence), so that, as a place gets darker, the curves of a halving come one after
/// the other and not all at once.
///
/// Of strips of width Δ between curves, those are halved for which Δ r 2⁻ᵇ > 1, with b equally distributed over [0, 1): the
/// share log₂(Δ r) of them. Curves a length are then (1 + log₂(Δ r)) / Δ, which is r at both ends of the range 1 ≤ Δ r ≤ 2, where
/// the curves of the next halving begin, and up to 6 % more between: ink covers r times the width of the pen. No gap is
/// narrower than half of 1/r.
fn stagger(index: u64) -> f64 {
    let fraction = index.reverse_bits() as f64 / libm::exp2(64.0);
    libm::exp2(-fraction)
}

/// The inverse of the wanted spacing along a strip.
#[derive(Clone, Debug)]
enum Density {
    Even(f64),
    /// With its largest value.
    Shaded(Piecewise, f64),
}

impl Density {
    fn most(&self) -> f64 {
        match self {
            Self::Even(r) => *r,
            Self::Shaded(_, most) => *most,
        }
    }

    fn times(&self, f: &Piecewise) -> Piecewise {
        match self {
            Self::Even(r) => f.scaled(*r),
            Self::Shaded(r, _) => f.mul(r),
        }
    }
}

/// Divides the strips of one surface in one direction.
pub(super) struct Strips<'a> {
    g: Geometry<'a>,
    surface: usize,
    /// The parameter that is constant on the isocurves.
    axis: Axis,
    ruled: Ruled<'a>,
    metric: Metric,
    options: &'a AdaptiveOptions,
    /// `None` for even spacing.
    shade: Option<Shade>,
    /// Bound of the rounding in view coordinates.
    rounding: f64,
    stop: Stop<'a>,
    pieces: Vec<IsoPiece>,
    stats: AdaptiveStats,
}

/// A strip: the isocurves at the ends of `s` over one interval, and their distance.
struct Strip<'a> {
    s: [f64; 2],
    /// Which of as many equal parts of the domain.
    index: u64,
    rails: [&'a Rail; 2],
    distance: IsoDistance,
}

impl<'a> Strips<'a> {
    pub(super) fn new(
        g: &Geometry<'a>,
        surface: usize,
        axis: Axis,
        options: &'a AdaptiveOptions,
        stop: Stop<'a>,
    ) -> Self {
        let metric = metric(g, surface, options.measured);
        Self {
            g: *g,
            surface,
            axis,
            ruled: Ruled::new(g.view, surface, axis, metric),
            metric,
            options,
            shade: options.tone.map(|tone| Shade::new(tone, g.view)),
            rounding: ROUNDINGS * f64::EPSILON / 2.0 * g.view.size(),
            stop,
            pieces: Vec::new(),
            stats: AdaptiveStats::default(),
        }
    }

    /// Covers the whole surface between the ends of its domain, which are two of the isocurves counted.
    pub(super) fn cover(mut self) -> Cover {
        self.stats.curves = 2;
        let (s, t) = domain(&self.g, self.surface, self.axis);
        let equal =
            self.shade.and_then(|shade| equal_strips(&self.g, self.surface, self.axis, &shade, self.options.spacing));
        if let Some(count) = equal {
            self.draw_equal(count, s, t);
            return Cover { pieces: self.pieces, stats: self.stats };
        }
        let [a, b] = s.map(|s| self.rail(s, t));
        let strip = self.strip(s, 0, [&a, &b]);
        self.divide(&strip);
        Cover { pieces: self.pieces, stats: self.stats }
    }

    /// Records the isocurves between `count` equal strips.
    fn draw_equal(&mut self, count: u64, s: [f64; 2], t: [f64; 2]) {
        let finest = self.options.levels.max(1) - 1;
        for k in 1..count {
            if self.stop.is_wanted() {
                return;
            }
            let value = s[0] + (s[1] - s[0]) * (k as f64 / count as f64);
            let rail = self.rail(value, t);
            self.stats.curves += 1;
            self.record(value, t, finest - k.trailing_zeros().min(finest), &rail);
        }
    }

    /// Where the isocurve at the end `s` of the domain is dark enough to be drawn, in `t`: where it is farther from the middle
    /// one than it is wanted to be from its neighbour.
    pub(super) fn dark_at_the_end(&mut self, s: f64, t: [f64; 2]) -> Vec<[f64; 2]> {
        let (ends, _) = domain(&self.g, self.surface, self.axis);
        let middle = 0.5 * (ends[0] + ends[1]);
        let [own, other] = [s, middle].map(|s| self.rail(s, t));
        let density = self.density(&[s], &own, 1.0);
        let strip = if s < middle {
            self.strip([s, middle], 0, [&own, &other])
        } else {
            self.strip([middle, s], 0, [&other, &own])
        };
        let mut dark = self.exceeding(&strip, &density, 1.0);
        dark.retain(|&t| !self.is_dot(t, &own.cut(t)));
        dark
    }

    fn rail(&self, s: f64, t: [f64; 2]) -> Rail {
        Rail::new(self.g.view, self.surface, self.axis, s, t)
    }

    fn strip<'r>(&mut self, s: [f64; 2], index: u64, rails: [&'r Rail; 2]) -> Strip<'r> {
        self.stats.distances += 1;
        Strip { s, index, rails, distance: IsoDistance::new(rails[0], rails[1], self.metric) }
    }

    /// Introduces the middle isocurve wherever the strip is too wide, and goes on with the strips on both sides of it.
    fn divide(&mut self, strip: &Strip<'_>) {
        let middle = 0.5 * (strip.s[0] + strip.s[1]);
        // No number lies between the ends of a strip that floating point cannot divide.
        if self.stop.is_wanted() || !(strip.s[0] < middle && middle < strip.s[1]) {
            return;
        }
        for t in self.wide(strip, middle) {
            let between = self.rail(middle, t);
            let [a, b] = strip.rails.map(|r| r.cut(t));
            if [&a, &between, &b].iter().all(|rail| self.is_dot(t, rail)) {
                continue;
            }
            self.stats.curves += 1;
            let index = strip.index.wrapping_mul(2);
            let lower = self.strip([strip.s[0], middle], index, [&a, &between]);
            self.divide(&lower);
            self.ink(strip, middle, [&a, &between, &b]);
            let upper = self.strip([middle, strip.s[1]], index.wrapping_add(1), [&between, &b]);
            self.divide(&upper);
        }
    }

    /// Where a strip has to be divided.
    fn wide(&mut self, strip: &Strip<'_>, middle: f64) -> Vec<[f64; 2]> {
        let Some(whole) = strip.rails[0].domain() else { return Vec::new() };
        if self.shade.is_some() {
            let rows = self.ruled.rows(strip.s);
            let breaks = &self.ruled.across()[rows.start..=rows.end];
            if rows.len() > 1 || (strip.s[1] - strip.s[0]) * TONE_PARTS > breaks[1] - breaks[0] {
                return alloc::vec![whole];
            }
        }
        let density = self.density(&[strip.s[0], middle, strip.s[1]], strip.rails[0], 1.0);
        self.exceeding(strip, &density, 1.0)
    }

    /// Where a distance is more than `scale` times the wanted one.
    fn farther(&self, distance: &IsoDistance, density: &Density, scale: f64) -> Vec<[f64; 2]> {
        let IsoDistance { above, below } = distance;
        // Δ² r² − 1, times the denominator, with r the inverse of the wanted distance.
        let scaled = density.times(&density.times(above)).scaled(1.0 / (scale * scale));
        // At Δ = 1 / r, where the sign matters, Δ² is known to 2 Δ times the rounding of a distance; and the
        // coefficients of the numerator to some 50 roundings of their own size.
        let blurred = self.blurred(density, scale);
        let noise = (2.0 * blurred + blurred * blurred) * below.magnitude() + 1e-14 * scaled.magnitude();
        scaled.sub(below).positive(noise)
    }

    /// Rounding of a distance in units of the smallest wanted one.
    fn blurred(&self, density: &Density, scale: f64) -> f64 {
        self.rounding * density.most() / scale
    }

    /// Where the rails are more than `scale` times the wanted distance apart, or the surface between them bends away from
    /// the ruled one by more than its share of that.
    fn exceeding(&mut self, strip: &Strip<'_>, density: &Density, scale: f64) -> Vec<[f64; 2]> {
        let Some(whole) = strip.rails[0].domain() else { return Vec::new() };
        let most = density.most() / scale;
        if most <= 0.0 {
            return Vec::new();
        }
        let far = self.farther(&strip.distance, density, scale);
        let blurred = self.blurred(density, scale);
        let mut bent = Vec::new();
        for t in complement(whole, &far) {
            self.stats.ruled_tests += 1;
            let [a, b] = strip.rails.map(|r| r.cut(t));
            let deviation = self.ruled.deviation(strip.s, [&a, &b], RULED / most);
            let share = density.times(&deviation).scaled(1.0 / scale);
            let limit = Piecewise::new([(t, Univariate::constant(RULED))]);
            bent.extend(share.sub(&limit).positive(4.0 * f64::EPSILON + blurred));
        }
        union(&far, &bent)
    }

    /// The inverse of the wanted distance over a rail, times `share`: the largest at some constant parameters.
    fn density(&self, s: &[f64], rail: &Rail, share: f64) -> Density {
        let spacing = self.options.spacing;
        let Some(shade) = self.shade else { return Density::Even(1.0 / spacing) };
        let at = |t: f64| {
            let uv = |s: f64| if self.axis == Axis::U { DVec2::new(s, t) } else { DVec2::new(t, s) };
            let darkness = s.iter().map(|&s| shade.darkness(&self.g, self.surface, uv(s))).fold(0.0, f64::max);
            share * darkness / spacing
        };
        let line = Piecewise::linear(&followed(rail, DENSITY_STEP / spacing, &at));
        let most = line.magnitude();
        Density::Shaded(line, most)
    }

    /// Records the parts of the middle isocurve of a strip that are wanted, by levels. Evenly spaced, that is all of it, and
    /// its level is the coarsest at which the strip is too wide.
    fn ink(&mut self, strip: &Strip<'_>, s: f64, [a, between, b]: [&Rail; 3]) {
        let Some(whole) = between.domain() else { return };
        let finest = self.options.levels.max(1) - 1;
        let mut wanted: Vec<Vec<[f64; 2]>> = Vec::new();
        if self.shade.is_some() {
            let density = self.density(&[s], between, stagger(strip.index));
            let gaps = [a, b].map(|side| IsoDistance::across(between, side));
            for level in 0..=finest {
                // The gap is half of what it was before: half of the wanted distance.
                let scale = 0.5 * libm::exp2(f64::from(finest - level));
                let [x, y] = gaps.each_ref().map(|gap| self.farther(gap, &density, scale));
                wanted.push(intersection(&x, &y));
            }
        } else {
            // One level is all of it, and nothing has to be asked.
            if finest > 0 {
                let part =
                    Strip { s: strip.s, index: strip.index, rails: [a, b], distance: strip.distance.part(whole) };
                let density = Density::Even(1.0 / self.options.spacing);
                for level in 0..finest {
                    let scale = libm::exp2(f64::from(finest - level));
                    wanted.push(self.exceeding(&part, &density, scale));
                }
            }
            wanted.push(alloc::vec![whole]);
        }
        let mut coarser: Vec<[f64; 2]> = Vec::new();
        for (level, reached) in (0..).zip(wanted) {
            for piece in reached.iter().flat_map(|t| complement(*t, &coarser)) {
                self.record(s, piece, level, between);
            }
            coarser = union(&coarser, &reached);
        }
    }

    /// Whether what lies over `t` of an isocurve is a dot on paper: too short, unless it reaches an edge, over which its
    /// neighbour's isocurve can go on, or nothing.
    fn is_dot(&self, t: [f64; 2], rail: &Rail) -> bool {
        let (_, whole) = domain(&self.g, self.surface, self.axis);
        let inside = whole[0] < t[0] && t[1] < whole[1];
        rail.length_bound() <= if inside { self.options.shortest } else { 0.0 }
    }

    /// Records what trims keep of a piece of an isocurve, but for dots.
    fn record(&mut self, s: f64, t: [f64; 2], level: u32, rail: &Rail) {
        let kept = match self.g.view.trims(self.surface) {
            Some(trims) => trims.kept_on_line(self.axis, s, t),
            None => alloc::vec![t],
        };
        for t in kept {
            if t[0] < t[1] && !self.is_dot(t, &rail.cut(t)) {
                self.pieces.push(IsoPiece { surface: self.surface, axis: self.axis, value: s, t, level });
            }
        }
    }
}
