//! Poles: borders of the parameter range that are one point of the surface.

use alloc::vec::Vec;

use glam::{DVec2, DVec3, DVec4};

use super::PullBackError;
use super::sheet::Sheet;
use crate::line::foot;
use crate::nurbs::{Curve, Surface};
use crate::view::net_box;

/// A border of the parameter range that is a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pole {
    /// The parameter that is constant on the border: 0 is u, 1 is v.
    pub(super) d: usize,
    /// Its value.
    pub(super) value: f64,
    /// Whether it is the upper end of the range.
    high: bool,
    pub(super) point: DVec3,
}

/// Largest extent of a pole, of its surface's: as trims have it.
const POLE: f64 = 1e-6;

/// The borders that are points.
pub(super) fn find(surface: &Surface) -> Vec<Pole> {
    let clamped = surface.clamped();
    let net: Vec<DVec3> = clamped.homogeneous().iter().map(|h| h.truncate() / h.w).collect();
    let (width, rows) = (clamped.knots_v().control_count(), clamped.knots_u().control_count());
    let extent = |points: &mut dyn Iterator<Item = DVec3>| {
        let (lo, hi) = points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)));
        (hi - lo).length()
    };
    let small = POLE * extent(&mut net.iter().copied());
    let mut out = Vec::new();
    for high in [false, true] {
        let (i, j) = if high { (rows - 1, width - 1) } else { (0, 0) };
        if extent(&mut net[i * width..(i + 1) * width].iter().copied()) <= small {
            out.push(Pole { d: 0, value: clamped.domain_u()[usize::from(high)], high, point: net[i * width] });
        }
        if extent(&mut net.iter().copied().skip(j).step_by(width)) <= small {
            out.push(Pole { d: 1, value: clamped.domain_v()[usize::from(high)], high, point: net[j] });
        }
    }
    out
}

/// Where a curve comes within `tolerance` of a pole: parameters in order, an end of the curve rather than places near it.
/// The error is the curve's, if it never leaves that neighbourhood.
pub(super) fn passes(curve: &Curve, pole: &Pole, tolerance: f64) -> Result<Vec<f64>, PullBackError> {
    /// Places of a Bézier segment at which a search begins.
    const SAMPLES: u32 = 16;
    let p = pole.point;
    let near = |points: &[DVec4]| {
        let (lo, hi) = net_box(points);
        (lo - p).max(p - hi).max(DVec3::ZERO).length() <= tolerance
    };
    if !near(curve.homogeneous()) {
        return Ok(Vec::new());
    }
    let distance = |t: f64| (curve.eval(t) - p).length();
    let [start, end] = curve.domain();
    let mut found = alloc::vec![start, end];
    for segment in curve.bezier_segments().iter().filter(|s| near(&s.points)) {
        let [a, b] = segment.interval;
        let at = |k: u32| a + (b - a) * (f64::from(k) / f64::from(SAMPLES));
        let samples: Vec<f64> = (0..=SAMPLES).map(|k| distance(at(k))).collect();
        for k in 0..=SAMPLES {
            let (before, after) = (k.saturating_sub(1), (k + 1).min(SAMPLES));
            if samples[k as usize] <= samples[before as usize].min(samples[after as usize]) {
                let jet = |t: f64| {
                    let [q, d, _] = curve.derivatives(t);
                    (q, d)
                };
                found.push(foot(jet, p, at(k), [at(before), at(after)], b - a));
            }
        }
    }
    found.retain(|&t| distance(t) <= tolerance);
    found.sort_by(f64::total_cmp);
    let mut out: Vec<f64> = Vec::new();
    for t in found {
        match out.last_mut() {
            // Between them the curve stays near: they are one.
            Some(last) if (1..8).all(|k| distance(*last + (t - *last) * f64::from(k) / 8.0) <= tolerance) => {
                if *last == start && t == end {
                    return Err(PullBackError::Point { at: p.to_array() });
                }
                if t == end || *last != start && distance(t) < distance(*last) {
                    *last = t;
                }
            }
            _ => out.push(t),
        }
    }
    Ok(out)
}

impl Pole {
    /// The parameters at the pole of a curve that leaves it in the direction `leaving` (of any length), near `guess` where
    /// several would do: with u the parameter along the pole, the direction S_v(u) into the surface is nearest to that of
    /// the curve. By Gauss–Newton on the unit sphere of directions.
    pub(super) fn limit(&self, sheet: &Sheet<'_>, guess: DVec2, leaving: DVec3) -> DVec2 {
        let along = 1 - self.d;
        let mut uv = guess;
        uv[self.d] = self.value;
        let Some(goal) = leaving.try_normalize() else { return uv };
        let inwards = if self.high { -1.0 } else { 1.0 };
        let mut best = (f64::INFINITY, uv);
        for _ in 0..30 {
            let jet = sheet.jet(uv);
            let direction = inwards * if self.d == 0 { jet.du } else { jet.dv };
            let (length, Some(unit)) = (direction.length(), direction.try_normalize()) else { return best.1 };
            let off = (goal - unit).length_squared();
            if off >= best.0 {
                return best.1;
            }
            best = (off, uv);
            // Derivative of the unit vector.
            let turned = inwards * jet.duv / length;
            let slope = turned - unit * unit.dot(turned);
            let squared = slope.length_squared();
            if squared == 0.0 {
                return uv;
            }
            let step = (goal - unit).dot(slope) / squared;
            let most = 0.125 * sheet.range[along];
            uv[along] += step.clamp(-most, most);
            uv = sheet.within(uv);
        }
        best.1
    }

    /// Derivative by t of the parameters of a curve with the derivatives `c1` and `c2` where it is in the pole, at `uv`.
    ///
    /// With S_u = S_uu = 0 there, C′ = S_v v′, and C″ = 2 S_uv u′v′ + S_vv v′² + S_v v″, of which u′ and v″ are the
    /// solution in the sense of least squares.
    pub(super) fn slope(&self, sheet: &Sheet<'_>, uv: DVec2, c1: DVec3, c2: DVec3) -> DVec2 {
        let jet = sheet.jet(uv);
        let (across, second) = if self.d == 0 { (jet.du, jet.duu) } else { (jet.dv, jet.dvv) };
        let squared = across.length_squared();
        if squared == 0.0 {
            return DVec2::ZERO;
        }
        let rise = c1.dot(across) / squared;
        let rest = c2 - second * (rise * rise);
        // What of S_uv is across S_v moves the direction.
        let mixed = 2.0 * rise * jet.duv;
        let turn = mixed - across * (mixed.dot(across) / squared);
        let size = turn.length_squared();
        let run = if size > 0.0 { rest.dot(turn) / size } else { 0.0 };
        let mut out = DVec2::ZERO;
        (out[self.d], out[1 - self.d]) = (rise, run);
        out
    }
}
