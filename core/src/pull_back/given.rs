//! Images that a file gives: accepted where they are over their curves.

use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use super::walk::Miss;
use super::{PullBack, PullBackError, PulledBack};
use crate::line::foot;
use crate::nurbs::{Curve, KnotVector, NurbsError};

/// Part of the parameter range by which an image may leave it: what trims move onto the border.
const OVER: f64 = 1e-6;

/// Fewest and most places of a span at which an image is compared with its curve.
const PLACES: [usize; 2] = [4, 64];

impl PullBack<'_> {
    /// A curve of (u, v, 0) that is given as the image of `curve`, if it is: run through from its start to its end it is within
    /// `tolerance` of the curve, measured along the surface, run through likewise, whatever the parameters of the two.
    ///
    /// As of other images the first point of the result is inside the range in periodic directions. What is a line of
    /// constant u or v within half the tolerance is that line exactly, and on a border or a knot line that is as near; it has
    /// degree 1.
    ///
    /// Across the surface the curve may be off by the limit, as for other images. The deviation is the largest of as many places of every span as decide between polynomials of the degrees of the
    /// surface along the image and of the curve. Cost: a few evaluations of each for a place.
    ///
    /// # Errors
    /// [`PullBackError::Tolerance`], [`PullBackError::Beyond`] if the image leaves the parameters of the surface, and
    /// [`PullBackError::Apart`] with a place where the two are apart.
    pub fn given(&self, image: &Curve, curve: &Curve, tolerance: f64) -> Result<PulledBack, PullBackError> {
        if !(tolerance > 0.0 && tolerance.is_finite()) {
            return Err(PullBackError::Tolerance { tolerance });
        }
        let tolerance = tolerance.max(64.0 * self.sheet.rounding);
        let clamped = image.clamped();
        let start = uv(&clamped, clamped.domain()[0]);
        let lost = |_| PullBackError::Beyond { at: start.to_array() };
        let image = self.straightened(&clamped, 0.5 * tolerance).unwrap_or(Ok(clamped)).map_err(lost)?;
        let shift = self.shift(uv(&image, image.domain()[0]));
        let moved = image.homogeneous().iter().map(|h| (h.truncate() - shift.extend(0.0) * h.w).extend(h.w)).collect();
        let image = Curve::from_homogeneous(image.knots().clone(), moved).map_err(lost)?;
        let miss = self.apart(&image, curve, tolerance)?;
        Ok(PulledBack { curves: alloc::vec![image], deviation: miss.total, off: miss.off })
    }

    /// The part of a curve of (u, v, 0) between the places over which the surface is nearest to the `ends`, looked for from the
    /// parameters `guess`: those of a curve in space with nearly the same parameter.
    ///
    /// # Errors
    /// If there is nothing between the two, or they are in the wrong order.
    pub fn part(&self, image: &Curve, guess: [f64; 2], ends: [DVec3; 2]) -> Result<Curve, NurbsError> {
        let [lo, hi] = image.domain();
        let jet = |t: f64| {
            let [at, slope, _] = image.derivatives(t);
            let jet = self.sheet.jet(at.truncate());
            (jet.p, jet.du * slope.x + jet.dv * slope.y)
        };
        // No farther than to the middle, so that an end stays one.
        let middle = (0.5 * (guess[0] + guess[1])).clamp(lo, hi);
        let a = foot(jet, ends[0], guess[0].clamp(lo, middle), [lo, middle], hi - lo);
        let b = foot(jet, ends[1], guess[1].clamp(middle, hi), [middle, hi], hi - lo);
        let mut part = image.clone();
        if b < hi {
            part = part.split(b)?.0;
        }
        if a > lo {
            part = part.split(a)?.1;
        }
        Ok(part)
    }

    /// The straight line that a clamped image is, if it is within `near` of one of constant u or v and runs one way along it.
    fn straightened(&self, image: &Curve, near: f64) -> Option<Result<Curve, NurbsError>> {
        let [a, b] = image.domain();
        let middle = uv(image, 0.5 * (a + b));
        let jet = self.sheet.jet(self.sheet.within(middle));
        let points: Vec<DVec2> = image.homogeneous().iter().map(|h| h.truncate().truncate() / h.w).collect();
        let line = |d: usize| {
            // Where the surface has no extent, near a pole, a distance says nothing of the parameter.
            let near = (near / [jet.du, jet.dv][d].length()).min(1e-3 * self.sheet.range[d]);
            let value = self.sheet.on_line(middle, near)[d];
            let rises = points.last()?[1 - d] > points.first()?[1 - d];
            let along = |w: &[DVec2]| if rises { w[0][1 - d] <= w[1][1 - d] } else { w[0][1 - d] >= w[1][1 - d] };
            let is_line = points.iter().all(|p| (p[d] - value).abs() <= near) && points.windows(2).all(along);
            let end = |p: DVec2| {
                let mut at = self.sheet.on_line(p, 0.0);
                at[d] = value;
                at.extend(0.0).extend(1.0)
            };
            is_line.then(|| Some(alloc::vec![end(*points.first()?), end(*points.last()?)]))?
        };
        let ends = line(0).or_else(|| line(1))?;
        Some(KnotVector::bezier(1, [a, b]).and_then(|knots| Curve::new(knots, ends)))
    }

    /// How far the surface over the image and the curve are apart.
    fn apart(&self, image: &Curve, curve: &Curve, tolerance: f64) -> Result<Miss, PullBackError> {
        let ([a, b], [from, to]) = (image.domain(), curve.domain());
        let place = |t: f64| {
            let at = uv(image, t);
            let over = (at - self.sheet.within(at)).abs().cmpgt(OVER * self.sheet.range).any();
            if over { Err(PullBackError::Beyond { at: at.to_array() }) } else { Ok(self.sheet.wrapped(at)) }
        };
        let apart = |distance: f64, limit: f64, at: DVec3| PullBackError::Apart { at: at.to_array(), distance, limit };
        let compared = |at: DVec2, p: DVec3| {
            let e = p - self.sheet.eval(at);
            let total = e.length();
            let along = if total <= tolerance { total } else { self.sheet.part_along(at, e) };
            let miss = Miss { along, total, off: libm::sqrt((total * total - along * along).max(0.0)) };
            let limit = self.limit.max(tolerance);
            // What is not a number is no agreement either.
            match (along <= tolerance, total <= limit) {
                (true, true) => Ok(miss),
                (false, _) => Err(apart(along, tolerance, p)),
                (true, false) => Err(apart(total, limit, p)),
            }
        };
        let mut most = compared(place(a)?, curve.eval(from))?.with(compared(place(b)?, curve.eval(to))?);
        let jet = |t: f64| {
            let [p, d, _] = curve.derivatives(t);
            (p, d)
        };
        // The curve has to be run through with the image, or a point of a closed one would do for all of it.
        let jumps = |before: f64, t: f64| t < before - OVER * (to - from) || t - before > 0.5 * (to - from);
        let mut before = from;
        for t in self.places(image, curve) {
            let at = place(t)?;
            let p = self.sheet.eval(at);
            // Where both have one parameter this is the place, and otherwise near it.
            let guess = from + (t - a) / (b - a) * (to - from);
            let mut near = foot(jet, p, guess.max(before), [before, to], to - from);
            if compared(at, curve.eval(near)).is_err() {
                near = curve.nearest(p).0;
            }
            let there = curve.eval(near);
            let found = compared(at, there)?;
            if jumps(before, near) {
                return Err(apart(there.distance(curve.eval(before)), tolerance, there));
            }
            (most, before) = (most.with(found), near.max(before));
        }
        if jumps(before, to) {
            let at = curve.eval(before);
            return Err(apart(at.distance(curve.eval(to)), tolerance, at));
        }
        Ok(most)
    }

    /// The parameters at which an image is compared, without its ends.
    fn places(&self, image: &Curve, curve: &Curve) -> Vec<f64> {
        let ([a, b], [from, to]) = (image.domain(), curve.domain());
        let mut breaks = image.knots().breaks();
        breaks.extend(curve.knots().breaks().into_iter().map(|t| a + (t - from) / (to - from) * (b - a)));
        breaks.retain(|t| (a..=b).contains(t));
        breaks.sort_by(f64::total_cmp);
        breaks.dedup();
        let surface = self.sheet.surface;
        let degree = image.degree() * (surface.degree_u() + surface.degree_v()) + curve.degree();
        let mut out = Vec::new();
        for w in breaks.windows(2) {
            let knots = self.sheet.breaks_between(uv(image, w[0]), uv(image, w[1]));
            let count = degree.saturating_mul(1 + knots).clamp(PLACES[0], PLACES[1]);
            out.extend((1..=count).map(|k| w[0] + (w[1] - w[0]) * (k as f64 / count as f64)));
        }
        out.retain(|&t| t < b);
        out
    }
}

fn uv(image: &Curve, t: f64) -> DVec2 {
    image.eval(t).truncate()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nurbs::Surface;
    use crate::shape::{Frame, arc, cylinder, line, plane, polyline, sphere};
    use core::f64::consts::TAU;

    const ROUND: [bool; 2] = [true, false];

    fn bezier(points: &[[f64; 2]]) -> Curve {
        let knots = KnotVector::bezier(points.len() - 1, [0.0, 1.0]).unwrap();
        Curve::new(knots, points.iter().map(|p| DVec3::new(p[0], p[1], 0.0).extend(1.0)).collect()).unwrap()
    }

    /// A bicubic sheet, and the curve over a line across its parameters, which has degree six.
    fn wave() -> (Surface, Curve, Curve) {
        let knots = || KnotVector::bezier(3, [0.0, 1.0]).unwrap();
        let height = |i: usize, j: usize| [0.0, 2.0, -1.0, 0.5][(i * j + i) % 4];
        let point = |k: usize| DVec3::new((k / 4) as f64, (k % 4) as f64, height(k / 4, k % 4)).extend(1.0);
        let surface = Surface::new(knots(), knots(), (0..16).map(point).collect()).unwrap();
        let image = bezier(&[[0.1, 0.2], [0.9, 0.7]]);
        // A polynomial of degree six by its values at seven places: solved for its control points.
        let over = |t: f64| {
            let at = uv(&image, t);
            surface.eval(at.x, at.y)
        };
        let binomial = |k: usize| [1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0][k];
        let basis = |k: usize, t: f64| binomial(k) * libm::pow(t, k as f64) * libm::pow(1.0 - t, (6 - k) as f64);
        let mut rows: Vec<([f64; 7], DVec3)> =
            (0..7).map(|r| (core::array::from_fn(|k| basis(k, r as f64 / 6.0)), over(r as f64 / 6.0))).collect();
        for k in 0..7 {
            let pivot = (k..7).max_by(|&a, &b| rows[a].0[k].abs().total_cmp(&rows[b].0[k].abs())).unwrap();
            rows.swap(k, pivot);
            let (row, right) = rows[k];
            for (r, (other, value)) in rows.iter_mut().enumerate().filter(|(r, _)| *r != k) {
                let share = other[k] / row[k];
                (0..7).for_each(|c| other[c] -= share * row[c]);
                *value -= right * share;
                assert!(other[k].abs() < 1e-9, "{r}");
            }
        }
        let points = (0..7).map(|k| (rows[k].1 / rows[k].0[k]).extend(1.0)).collect();
        let curve = Curve::new(KnotVector::bezier(6, [0.0, 1.0]).unwrap(), points).unwrap();
        (surface, image, curve)
    }

    #[test]
    fn an_image_is_taken_as_it_is_where_it_is_over_its_curve_and_refused_by_its_distance_where_it_is_not() {
        let (surface, image, curve) = wave();
        let sheet = PullBack::new(&surface, [false; 2]);
        let found = sheet.given(&image, &curve, 1e-9).unwrap();
        assert_eq!(found.curves, core::slice::from_ref(&image));
        assert!(found.deviation < 1e-11, "{}", found.deviation);
        // The same points, at other parameters: the line as a quadratic that begins slowly.
        let slow = bezier(&[[0.1, 0.2], [0.1 + 0.2 * 0.8, 0.2 + 0.2 * 0.5], [0.9, 0.7]]);
        let found = sheet.given(&slow, &curve, 1e-9).unwrap();
        assert!(found.deviation < 1e-10, "{}", found.deviation);
        // Bent in the middle: by how much is measured on the surface, over the images of one parameter at most.
        let bent = bezier(&[[0.1, 0.2], [0.5, 0.45 + 2e-5], [0.9, 0.7]]);
        let at = uv(&bent, 0.5);
        let far = surface.eval(at.x, at.y).distance(curve.eval(0.5));
        match sheet.given(&bent, &curve, 1e-6) {
            Err(PullBackError::Apart { distance, limit, .. }) => assert!(limit < distance && distance <= far * 1.01),
            other => panic!("{other:?}"),
        }
        let found = sheet.given(&bent, &curve, 1.01 * far).unwrap();
        assert!(found.deviation > 0.5 * far, "{} {far}", found.deviation);
        assert!(matches!(sheet.given(&image.reversed(), &curve, 1e-6), Err(PullBackError::Apart { .. })));
        assert!(matches!(sheet.given(&image, &curve.reversed(), 1e-6), Err(PullBackError::Apart { .. })));
    }

    #[test]
    fn the_start_of_a_closed_curve_is_not_all_of_it() {
        let surface = cylinder(&Frame::WORLD, 2.0, 3.0).unwrap();
        let sheet = PullBack::new(&surface, ROUND);
        let ring = arc(&Frame::new(DVec3::Z, DVec3::Z, DVec3::X).unwrap(), 2.0, 0.0, TAU).unwrap();
        let v = 1.0 / 3.0;
        // Three periods on, and run through at the speed of the parameter.
        let found = sheet.given(&bezier(&[[3.0, v], [4.0, v]]), &ring, 1e-9).unwrap();
        assert_eq!(found.curves[0].domain().map(|t| uv(&found.curves[0], t)), [DVec2::new(0.0, v), DVec2::new(1.0, v)]);
        for wrong in [[[0.0, v], [1e-12, v]], [[0.0, v], [0.5, v]], [[0.0, v], [2.0, v]], [[1.0, v], [0.0, v]]] {
            let found = sheet.given(&bezier(&wrong), &ring, 1e-9);
            assert!(matches!(found, Err(PullBackError::Apart { .. })), "{wrong:?} {found:?}");
        }
        let there_and_back = polyline(&[[0.0, v], [0.2, v], [0.0, v]].map(|p| DVec3::new(p[0], p[1], 0.0))).unwrap();
        assert!(sheet.given(&there_and_back, &ring, 1e-9).is_err());
    }

    #[test]
    fn what_is_as_good_as_on_a_border_is_on_it() {
        let surface = sphere(&Frame::WORLD, 1.0).unwrap();
        let sheet = PullBack::new(&surface, ROUND);
        let meridian = surface.isocurve_u(0.0);
        let rounded = bezier(&[[1e-8, 0.0], [-1e-8, 0.5], [1e-8, 1.0]]);
        let found = sheet.given(&rounded, &meridian, 1e-6).unwrap();
        assert_eq!(found.curves[0].degree(), 1);
        assert_eq!(found.curves[0].domain().map(|t| uv(&found.curves[0], t)), [DVec2::ZERO, DVec2::Y]);
    }

    #[test]
    fn the_part_between_two_points_is_found_whatever_the_parameter() {
        let (surface, image, curve) = wave();
        let sheet = PullBack::new(&surface, [false; 2]);
        let longer = bezier(&[[0.0, 0.1375], [1.0, 0.7625]]);
        let ends = [0.0, 1.0].map(|t| curve.eval(t));
        for guess in [[0.1, 0.9], [0.3, 0.8], [0.0, 1.0]] {
            let part = sheet.part(&longer, guess, ends).unwrap();
            let [a, b] = part.domain();
            assert!(uv(&part, a).distance(uv(&image, 0.0)) < 1e-12 && uv(&part, b).distance(uv(&image, 1.0)) < 1e-12);
            assert!(sheet.given(&part, &curve, 1e-9).is_ok());
        }
        // From a parameter that is nowhere near, what is found is not over the curve.
        let part = sheet.part(&longer, [2.0, 3.0], ends).unwrap();
        assert!(sheet.given(&part, &curve, 1e-9).is_err());
    }

    /// A curve beside its surface is compared along the surface.
    #[test]
    fn what_is_off_the_surface_has_the_image_of_its_feet() {
        let surface = plane(DVec3::ZERO, DVec3::X, DVec3::Y).unwrap();
        let sheet = PullBack::new(&surface, [false; 2]).with_limit(1e-3);
        let image = bezier(&[[0.1, 0.2], [0.9, 0.6]]);
        let beside = |off: DVec3| line(DVec3::new(0.1, 0.2, 0.0) + off, DVec3::new(0.9, 0.6, 0.0) + off).unwrap();
        let found = sheet.given(&image, &beside(DVec3::Z * 5e-4), 1e-6).unwrap();
        assert!((found.off - 5e-4).abs() < 1e-12 && (found.deviation - 5e-4).abs() < 1e-12, "{found:?}");
        assert!(sheet.given(&image, &beside(DVec3::new(0.0, 2e-6, 5e-4)), 1e-6).is_err());
        assert!(sheet.given(&image, &beside(DVec3::Z * 2e-3), 1e-6).is_err());
    }

    #[test]
    fn images_beyond_the_surface_are_refused() {
        let surface = plane(DVec3::ZERO, DVec3::X, DVec3::Y).unwrap();
        let sheet = PullBack::new(&surface, [false; 2]);
        let beyond = bezier(&[[0.5, 0.5], [1.5, 0.5]]);
        let side = line(DVec3::new(0.5, 0.5, 0.0), DVec3::new(1.5, 0.5, 0.0)).unwrap();
        assert!(matches!(sheet.given(&beyond, &side, 1e-6), Err(PullBackError::Beyond { at: [u, _] }) if u > 1.0));
        assert!(matches!(sheet.given(&beyond, &side, f64::NAN), Err(PullBackError::Tolerance { .. })));
    }
}
