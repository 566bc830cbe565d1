//! Pull-back: the parameter curves of space curves on surfaces.
//!
//! Boundary representations give a face as a surface and its edges as curves in space; [trims](crate::trim) are curves in
//! (u, v). The image of a curve under the inverse of the surface is found
//!
//! - on planes exactly: there it is an affine map of the control points;
//! - along isoparametric curves as a straight line in (u, v);
//! - otherwise as cubics through the feet of points of the curve, with the derivatives of the image there, as long as the
//!   tolerance lets them be.
//!
//! Only the image in (u, v) matters to trims, not how it is parametrised; that a point of the image is over that of the curve
//! with nearly the same parameter is how it is checked. Files are imprecise: a curve need not lie *on* its surface. Then the
//! image is that of the feet, and its distance from the surface is told.
//!
//! Where a file gives the image as well, that is [compared](PullBack::given) with the curve.

mod affine;
mod error;
mod foot;
mod given;
mod pole;
mod sheet;
mod straight;
#[cfg(test)]
mod tests;
mod walk;

use alloc::vec::Vec;

use glam::{DVec2, DVec3};

use self::affine::Affine;
use self::sheet::Sheet;
use self::walk::{Cubic, Miss, Node, Stop, Walk};
use crate::nurbs::{Curve, KnotVector, NurbsError, Surface};

pub use error::PullBackError;

/// Part of the range of a curve's parameter within which the search begins at a knot.
const BESIDE: f64 = 1e-6;

/// The image of a space curve in the parameters of a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct PulledBack {
    /// Curves of (u, v, 0), end to end, the whole in the direction of the space curve, each on the part of its domain over
    /// which it lies. There are several only where the space curve passes a pole.
    pub curves: Vec<Curve>,
    /// Largest distance in space between the surface at the image and the curve.
    pub deviation: f64,
    /// Largest distance of the curve from the surface, a part of the deviation.
    pub off: f64,
}

/// A surface on which curves are to be pulled back. What all searches on it need is made once.
#[derive(Clone, Debug)]
pub struct PullBack<'a> {
    sheet: Sheet<'a>,
    affine: Option<Affine>,
    limit: f64,
}

/// The image of one curve on a surface, as [`PullBack::curve`].
///
/// # Errors
/// As there.
pub fn pull_back(
    surface: &Surface,
    periodic: [bool; 2],
    curve: &Curve,
    tolerance: f64,
) -> Result<PulledBack, PullBackError> {
    PullBack::new(surface, periodic).curve(curve, tolerance)
}

/// The point of a surface nearest to `point`, as [`PullBack::foot`].
#[must_use]
pub fn foot_point(surface: &Surface, periodic: [bool; 2], point: DVec3) -> (DVec2, f64) {
    PullBack::new(surface, periodic).foot(point)
}

impl<'a> PullBack<'a> {
    /// Pull-back onto `surface`, which in a `periodic` direction, u or v, goes on beyond its range as it began. Cost: that of
    /// [`Surface::bezier_patches`]. Curves may be off the surface by a thousandth of its size.
    #[must_use]
    pub fn new(surface: &'a Surface, periodic: [bool; 2]) -> Self {
        let sheet = Sheet::new(surface, periodic);
        let limit = 1e-3 * sheet.size;
        Self { affine: Affine::of(&sheet), sheet, limit }
    }

    /// The same, where curves may be off the surface by `limit`.
    #[must_use]
    pub fn with_limit(self, limit: f64) -> Self {
        Self { limit, ..self }
    }

    /// The point of the surface nearest to `point`, and its distance. No other is nearer by more than a hundredth of it.
    ///
    /// Cost: a few microseconds for points on the surface; some hundred for points that are nearly as far from much of it, as
    /// the centre of a sphere.
    #[must_use]
    pub fn foot(&self, point: DVec3) -> (DVec2, f64) {
        let foot = self.sheet.foot(point, self.sheet.rounding);
        (foot.uv, foot.distance)
    }

    /// The image of `curve`: within `tolerance` of its feet on the surface, measured along the surface.
    ///
    /// In a periodic direction the image is unwrapped: continuous, and on beyond the range. It begins inside the range; a
    /// curve along a seam is on its low side, and whole periods away it is as good. A curve that passes a pole is in two
    /// curves there, which each end in the pole with the parameter that is its limit along the curve. Planes give rational
    /// curves as the space curve's; isoparametric curves straight lines of degree 1; else the degree is 3.
    ///
    /// The deviation is certified on planes. Elsewhere it is the largest of seven places of every cubic, and two more for
    /// every knot passed, or of so many places of a straight line that only the line itself can pass them all; half as much
    /// again of what is along the surface.
    ///
    /// # Errors
    /// If the curve is farther from the surface than the limit, or all of it is within the tolerance of a pole, or its image
    /// cannot be followed.
    pub fn curve(&self, curve: &Curve, tolerance: f64) -> Result<PulledBack, PullBackError> {
        if !(tolerance > 0.0 && tolerance.is_finite()) {
            return Err(PullBackError::Tolerance { tolerance });
        }
        // Less than what is computed cannot be asked for.
        let tolerance = tolerance.max(64.0 * self.sheet.rounding);
        let limit = self.limit.max(tolerance);
        let lost = |_: NurbsError| PullBackError::Lost { at: curve.eval(curve.domain()[0]).to_array() };
        if let Some(plane) = &self.affine {
            let (image, off) = plane.image(curve).map_err(lost)?;
            if off > limit {
                let at = curve.eval(curve.domain()[0]).to_array();
                return Err(PullBackError::Off { at, distance: off, limit });
            }
            return Ok(PulledBack { curves: alloc::vec![image], deviation: off, off });
        }
        let breaks = curve.knots().breaks();
        let mut walk = Walk { sheet: &self.sheet, curve, breaks: &breaks, tolerance: 0.5 * tolerance, limit, steps: 0 };
        let (mut curves, mut miss) = (Vec::new(), Miss::default());
        for part in self.parts(curve, tolerance)?.windows(2) {
            let (image, found) = self.image(&mut walk, [part[0], part[1]])?;
            curves.push(image.map_err(lost)?);
            miss = miss.with(found);
        }
        Ok(PulledBack { curves, deviation: miss.total, off: miss.off })
    }

    /// The ends of the parts of a curve between poles.
    fn parts(&self, curve: &Curve, tolerance: f64) -> Result<Vec<Stop>, PullBackError> {
        let [a, b] = curve.domain();
        let mut stops = alloc::vec![Stop { t: a, pole: None }, Stop { t: b, pole: None }];
        for pole in &self.sheet.poles {
            stops.extend(pole::passes(curve, pole, tolerance)?.into_iter().map(|t| Stop { t, pole: Some(*pole) }));
        }
        stops.sort_by(|x, y| x.t.total_cmp(&y.t));
        // Of two at one place that with the pole.
        stops.dedup_by(|later, kept| {
            let same = later.t == kept.t;
            if same && kept.pole.is_none() {
                kept.pole = later.pole;
            }
            same
        });
        Ok(stops)
    }

    /// The image of the part of a curve between two stops, and how far it is off.
    fn image(
        &self,
        walk: &mut Walk<'_>,
        [from, to]: [Stop; 2],
    ) -> Result<(Result<Curve, NurbsError>, Miss), PullBackError> {
        let curve = walk.curve;
        // The search for the right sheet begins inside, where the curve is away from poles and seams.
        let middle = 0.5 * (from.t + to.t);
        // At a knot rather than beside it: a step from the one to the other would be all rounding.
        let near = |k: &&f64| (**k - middle).abs() <= BESIDE * (to.t - from.t);
        let t = walk.breaks.iter().find(near).copied().unwrap_or(middle);
        let at = curve.eval(t);
        let foot = self.sheet.foot(at, walk.tolerance);
        if foot.distance > walk.limit {
            return Err(PullBackError::Off { at: at.to_array(), distance: foot.distance, limit: walk.limit });
        }
        let seed = Node { t, uv: foot.uv };
        if let Some((line, miss)) = walk.straight(seed, [from, to]) {
            let shift = self.shift(line[0]);
            let points = line.map(|uv| (uv - shift).extend(0.0).extend(1.0)).to_vec();
            return Ok((KnotVector::bezier(1, [from.t, to.t]).and_then(|k| Curve::new(k, points)), miss));
        }
        let (mut cubics, miss) = self.followed(walk, seed, [from, to])?;
        let shift = self.shift(cubics[0].b[0]);
        for b in cubics.iter_mut().flat_map(|c| &mut c.b) {
            *b -= shift;
        }
        Ok((joined(&cubics), miss))
    }

    /// Whole periods, in parameters, by which a point is beyond the range.
    fn shift(&self, uv: DVec2) -> DVec2 {
        self.sheet.periods(uv) * self.sheet.range
    }

    /// The cubics through `seed` over the part of a curve between two stops, in order.
    fn followed(
        &self,
        walk: &mut Walk<'_>,
        seed: Node,
        [from, to]: [Stop; 2],
    ) -> Result<(Vec<Cubic>, Miss), PullBackError> {
        let (curve, t) = (walk.curve, seed.t);
        let knots = walk.breaks.windows(3).filter(|w| from.t < w[1] && w[1] < to.t && w[1] != t);
        let rough = knots.filter(|w| is_rough(curve, [w[0], w[1], w[2]], walk.tolerance));
        let stops: Vec<Stop> = rough.map(|w| Stop { t: w[1], pole: None }).collect();
        let middle = stops.partition_point(|s| s.t < t);
        let (mut before, mut after) = (Vec::new(), Vec::new());
        let backwards: Vec<Stop> = stops[..middle].iter().rev().copied().chain([from]).collect();
        let forwards: Vec<Stop> = stops[middle..].iter().copied().chain([to]).collect();
        let miss = walk.follow(seed, &backwards, &mut before)?.with(walk.follow(seed, &forwards, &mut after)?);
        before.reverse();
        before.extend(after);
        Ok((before, miss))
    }
}

/// Whether the curve's derivatives jump at a knot, the middle one of the three, so that a cubic over it would be off by more
/// than the tolerance. Across a jump of the first derivative the error is half of it times the parameter to the jump, at most
/// an eighth of the jump times the length of the cubic; for the second derivative, a sixty-fourth times the length squared.
fn is_rough(curve: &Curve, [before, knot, after]: [f64; 3], tolerance: f64) -> bool {
    let knots = curve.knots();
    if knots.multiplicity(knot) + 1 < knots.degree() {
        return false;
    }
    let [_, a1, a2] = curve.derivatives_from(knot, true);
    let [_, b1, b2] = curve.derivatives_from(knot, false);
    let h = after - before;
    (b1 - a1).length() * h > 8.0 * tolerance || (b2 - a2).length() * h * h > 64.0 * tolerance
}

/// The cubics as one B-spline curve. Its derivatives jump in length only, but at corners; so the knots are triple.
fn joined(cubics: &[Cubic]) -> Result<Curve, NurbsError> {
    let first = cubics.first().ok_or(NurbsError::PointCount { count: 0, expected: 4 })?;
    let (mut knots, mut points) = (alloc::vec![first.t[0]; 4], alloc::vec![first.b[0]]);
    for c in cubics {
        knots.extend([c.t[1]; 3]);
        points.extend(&c.b[1..]);
    }
    knots.push(knots[knots.len() - 1]);
    Curve::new(KnotVector::new(knots, 3)?, points.iter().map(|b| b.extend(0.0).extend(1.0)).collect())
}
