//! Curves of edges and profiles.

use std::f64::consts::TAU;

use glam::{DMat4, DVec3, DVec4};
use penvis_core::nurbs::{Curve, KnotVector, lowered_curve};
use penvis_core::shape::{self, Frame};
use penvis_core::view::MAX_DEGREE;

use super::super::fault::Fault;
use super::composite::composite;
use super::exchange::{Entity, Part};
use super::units::{Units, matrix};

/// Most curves that stand for one another.
const MAX_DEPTH: usize = 16;

/// A curve as the file has it, in millimetres.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    /// Through a point in a direction, whose length is that of a unit of the parameter.
    Line(DVec3, DVec3),
    /// The semiaxes in x and in y; a circle if they are equal.
    Ellipse(Frame, [f64; 2]),
    /// The focal distance; open towards x.
    Parabola(Frame, f64),
    /// The real semiaxis, in x, and the imaginary one.
    Hyperbola(Frame, [f64; 2]),
    /// A B-spline curve, or a composite one as such, and whether it is closed.
    Spline(Curve, bool),
}

/// A curve, and the part of it that a trimmed curve is.
#[derive(Clone, Debug)]
pub(super) struct Basis {
    pub(super) shape: Shape,
    /// Points at which the part begins and ends, and whether it runs as the curve does.
    pub(super) part: Option<([DVec3; 2], bool)>,
}

/// A part of a curve.
#[derive(Clone, Debug)]
pub(super) struct Arc {
    pub(super) curve: Curve,
    /// Parameters of the file's curve at its ends; that of an ellipse is an angle in radians.
    pub(super) t: [f64; 2],
}

impl Arc {
    /// The same, run through the other way.
    pub(super) fn reversed(&self) -> Self {
        Self { curve: self.curve.reversed(), t: [self.t[1], self.t[0]] }
    }

    /// Runs through a chain of them the other way.
    pub(super) fn turn(chain: &mut [Self]) {
        chain.reverse();
        chain.iter_mut().for_each(|arc| *arc = arc.reversed());
    }
}

/// The curve that an entity is or stands for.
pub(super) fn basis(entity: Entity<'_>, units: &Units) -> Result<Basis, Fault> {
    basis_within(entity, units, 0)
}

/// The same of an entity that is reached through `depth` others.
pub(super) fn basis_within(entity: Entity<'_>, units: &Units, depth: usize) -> Result<Basis, Fault> {
    let (mut entity, mut part) = (entity, None);
    for depth in depth..MAX_DEPTH {
        const STAND_FOR: &[&str] = &["SURFACE_CURVE", "SEAM_CURVE", "INTERSECTION_CURVE"];
        if let Some((_, on_surface)) = entity.find_any(STAND_FOR) {
            entity = on_surface.entity(1)?;
        } else if let Some(trimmed) = entity.find("TRIMMED_CURVE") {
            entity = trimmed.entity(1)?;
            let ends = [trim(trimmed, 2, entity, units, depth)?, trim(trimmed, 3, entity, units, depth)?];
            part = part.or(Some((ends, trimmed.flag(4)?)));
        } else {
            return Ok(Basis { shape: shape(entity, units, depth)?, part });
        }
    }
    Err(entity.fault("is reached through more curves than there can be; one is defined by itself"))
}

/// The point at which a trimmed curve begins or ends.
fn trim(trimmed: Part<'_>, index: usize, basis: Entity<'_>, units: &Units, depth: usize) -> Result<DVec3, Fault> {
    if let Ok(points) = trimmed.entities(index)
        && let Some(point) = points.first()
    {
        return units.point(*point);
    }
    let t = match trimmed.reals(index) {
        Ok(values) if values.len() == 1 => values[0],
        _ => return Err(trimmed.fault("is trimmed by neither a point nor a parameter")),
    };
    if basis.find("COMPOSITE_CURVE").is_some() {
        return Err(
            trimmed.fault("is a part of a composite curve by a parameter; export it with the points of its ends")
        );
    }
    let point = match shape(basis, units, depth)? {
        Shape::Line(origin, d) => origin + d * t,
        Shape::Ellipse(frame, [a, b]) => {
            let (sin, cos) = (t * units.angle).sin_cos();
            matrix(&frame).transform_point3(DVec3::new(a * cos, b * sin, 0.0))
        }
        Shape::Parabola(frame, f) => matrix(&frame).transform_point3(DVec3::new(f * t * t, 2.0 * f * t, 0.0)),
        Shape::Hyperbola(frame, [a, b]) => matrix(&frame).transform_point3(DVec3::new(a * t.cosh(), b * t.sinh(), 0.0)),
        Shape::Spline(curve, _) => curve.eval(t),
    };
    if point.is_finite() { Ok(point) } else { Err(trimmed.fault("is trimmed beyond the numbers that there are")) }
}

/// The curve that an entity is, which is reached through `depth` others.
fn shape(entity: Entity<'_>, units: &Units, depth: usize) -> Result<Shape, Fault> {
    if let Some(line) = entity.find("LINE") {
        let vector = line.entity(2)?;
        let Some(vector) = vector.find("VECTOR") else {
            return Err(vector.fault("stands where a VECTOR has to"));
        };
        let d = units.direction(vector.entity(1)?)?.normalize() * vector.positive(2)? * units.length;
        return Ok(Shape::Line(units.point(line.entity(1)?)?, d));
    }
    if let Some(circle) = entity.find("CIRCLE") {
        let radius = circle.positive(2)? * units.length;
        return Ok(Shape::Ellipse(units.frame(circle.entity(1)?)?, [radius; 2]));
    }
    if let Some(ellipse) = entity.find("ELLIPSE") {
        let axes = [ellipse.positive(2)? * units.length, ellipse.positive(3)? * units.length];
        return Ok(Shape::Ellipse(units.frame(ellipse.entity(1)?)?, axes));
    }
    if let Some(parabola) = entity.find("PARABOLA") {
        return Ok(Shape::Parabola(units.frame(parabola.entity(1)?)?, parabola.positive(2)? * units.length));
    }
    if let Some(hyperbola) = entity.find("HYPERBOLA") {
        let axes = [hyperbola.positive(2)? * units.length, hyperbola.positive(3)? * units.length];
        return Ok(Shape::Hyperbola(units.frame(hyperbola.entity(1)?)?, axes));
    }
    if let Some(polyline) = entity.find("POLYLINE") {
        let points = polyline.entities(1)?.into_iter().map(|p| units.point(p)).collect::<Result<Vec<_>, _>>()?;
        let curve = shape::polyline(&points).map_err(|e| polyline.fault(e.to_string()))?;
        let closed = points.first() == points.last();
        return Ok(Shape::Spline(curve, closed));
    }
    let curve = match spline(entity, units)? {
        Some(curve) => Some(curve),
        None => composite(entity, units, depth)?,
    };
    if let Some(curve) = curve {
        let [a, b] = curve.domain();
        let size: f64 = curve.homogeneous().windows(2).map(|w| (w[1] / w[1].w).distance(w[0] / w[0].w)).sum();
        // Closed to the rounding of a file of fifteen digits, or as good as.
        let closed = curve.eval(a).distance(curve.eval(b)) <= 1e-9 * size;
        return Ok(Shape::Spline(curve, closed));
    }
    Err(entity.fault("is a kind of curve that is not read"))
}

/// The B-spline curve that an entity is, if it is one.
fn spline(entity: Entity<'_>, units: &Units) -> Result<Option<Curve>, Fault> {
    const KINDS: &[&str] =
        &["B_SPLINE_CURVE_WITH_KNOTS", "BEZIER_CURVE", "UNIFORM_CURVE", "QUASI_UNIFORM_CURVE", "B_SPLINE_CURVE"];
    let Some((kind, own)) = entity.find_any(KINDS) else { return Ok(None) };
    // In an entity of several types, the degree and the points stand with B_SPLINE_CURVE, without the name.
    let (base, first) = match entity.find("B_SPLINE_CURVE") {
        Some(base) if !entity.is_simple() => (base, 0),
        _ => (own, 1),
    };
    let degree = base.count(first)?;
    let points = base.entities(first + 1)?;
    let after = if entity.is_simple() { first + 5 } else { 0 };
    let knots = match kind {
        "B_SPLINE_CURVE_WITH_KNOTS" => repeated(own, after, after + 1)?,
        kind => implied(own, kind, degree, points.len())?,
    };
    let weights = match entity.find("RATIONAL_B_SPLINE_CURVE") {
        Some(rational) => rational.reals(0)?,
        None => vec![1.0; points.len()],
    };
    if weights.len() != points.len() {
        return Err(entity.fault(format!("has {} points, but {} weights", points.len(), weights.len())));
    }
    let point = |(p, w): (Entity<'_>, f64)| Ok(units.point(p)?.extend(w));
    let points = points.into_iter().zip(weights).map(point).collect::<Result<Vec<DVec4>, Fault>>()?;
    let tolerance = units.tolerance_of(&points);
    let lowered = lowered_curve(degree, knots, points, tolerance);
    let (curve, off) = lowered.map_err(|e| entity.fault(e.to_string()))?;
    if off > tolerance { Err(not_lowered(entity, off)) } else { Ok(Some(curve)) }
}

/// What is wrong with a spline of a degree that is too high.
pub(super) fn not_lowered(entity: Entity<'_>, off: f64) -> Fault {
    entity.fault(format!("has a degree above {MAX_DEGREE}, and is {off:.3e} mm off with a lower one; export it anew"))
}

/// Most knots of a direction.
const MOST_KNOTS: usize = 1 << 20;

/// Knots from their multiplicities and values.
pub(super) fn repeated(part: Part<'_>, counts: usize, values: usize) -> Result<Vec<f64>, Fault> {
    let (counts, values) = (part.counts(counts)?, part.reals(values)?);
    if counts.len() != values.len() {
        return Err(part.fault(format!("has {} knots, but {} multiplicities", values.len(), counts.len())));
    }
    let total = counts.iter().fold(0_usize, |sum, &n| sum.saturating_add(n));
    if total > MOST_KNOTS {
        return Err(part.fault(format!("announces {total} knots, more than the {MOST_KNOTS} that are read")));
    }
    Ok(values.iter().zip(counts).flat_map(|(&x, n)| std::iter::repeat_n(x, n)).collect())
}

/// The knots of a kind of spline that has none of its own (ISO 10303-42, 4.4.44 to 46).
pub(super) fn implied(part: Part<'_>, kind: &str, degree: usize, count: usize) -> Result<Vec<f64>, Fault> {
    if degree == 0 || count <= degree {
        return Err(part.fault(format!("has {count} points, too few for degree {degree}")));
    }
    let total = count + degree + 1;
    let knot = |i: usize| -> f64 {
        // Whole numbers this small are exact.
        let spans = (count - degree) as f64;
        match kind {
            "UNIFORM_CURVE" | "UNIFORM_SURFACE" => i as f64 - degree as f64,
            "BEZIER_CURVE" | "BEZIER_SURFACE" => {
                if i == 0 {
                    0.0
                } else {
                    ((i - 1) / degree) as f64
                }
            }
            _ => (i as f64 - degree as f64).clamp(0.0, spans),
        }
    };
    if kind.starts_with("BEZIER") && !(count - 1).is_multiple_of(degree) {
        return Err(part.fault(format!("has {count} points, which are no whole number of segments of degree {degree}")));
    }
    let mut knots: Vec<f64> = (0..total).map(knot).collect();
    if kind.starts_with("BEZIER")
        && let [.., before, last] = &mut knots[..]
    {
        *last = *before;
    }
    Ok(knots)
}

/// Turns nearer to a whole one than this are one, or none: what fifteen digits leave of an angle.
const TURN: f64 = 1e-9;

impl Shape {
    /// The part from `a` to `b`, which are points of the curve as far as files are exact, in the direction of the curve or
    /// against it. All of it from `a` and back to `a` if it `closes`.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn between(&self, [a, b]: [DVec3; 2], closes: bool, forward: bool) -> Result<Vec<Arc>, String> {
        if !forward {
            let mut parts = self.between([b, a], closes, true)?;
            Arc::turn(&mut parts);
            return Ok(parts);
        }
        let straight = |t: [f64; 2], name: &str| {
            let line = shape::line(a, b).map_err(|_| format!("is {name} of no length"))?;
            Ok(vec![Arc { curve: line, t }])
        };
        let t = match self {
            Self::Line(origin, d) => {
                return straight([a, b].map(|p| (p - *origin).dot(*d) / d.length_squared()), "a line");
            }
            Self::Ellipse(frame, axes) => {
                let to_unit = unit_circle(frame, *axes).inverse();
                let angle = |p: DVec3| {
                    let q = to_unit.transform_point3(p);
                    q.y.atan2(q.x)
                };
                let start = angle(a);
                let sweep = if closes { TAU } else { (angle(b) - start).rem_euclid(TAU) };
                if !closes && !(TURN..=TAU - TURN).contains(&sweep) {
                    return straight([start; 2], "an arc");
                }
                return Ok(vec![Arc { curve: ellipse(frame, *axes, start, sweep)?, t: [start, start + sweep] }]);
            }
            Self::Parabola(frame, f) => {
                let inverse = matrix(frame).inverse();
                [a, b].map(|p| inverse.transform_point3(p).y / (2.0 * f))
            }
            Self::Hyperbola(frame, [_, q]) => {
                let inverse = matrix(frame).inverse();
                [a, b].map(|p| (inverse.transform_point3(p).y / q).asinh())
            }
            Self::Spline(curve, closed) => return part_of_spline(curve, *closed, [a, b], closes),
        };
        self.over(t).map(|curve| vec![Arc { curve, t }])
    }

    /// The part over an interval of its parameter, which is an angle in radians for an ellipse.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn over(&self, t: [f64; 2]) -> Result<Curve, String> {
        match self {
            Self::Line(origin, d) => shape::line(*origin + *d * t[0], *origin + *d * t[1]).map_err(|e| e.to_string()),
            Self::Ellipse(frame, axes) => ellipse(frame, *axes, t[0], t[1] - t[0]),
            Self::Parabola(frame, f) => {
                let point = |t: f64| DVec3::new(f * t * t, 2.0 * f * t, 0.0);
                let shoulder = DVec3::new(f * t[0] * t[1], f * (t[0] + t[1]), 0.0);
                conic(frame, [point(t[0]), shoulder, point(t[1])], 1.0, t[0] < t[1])
            }
            Self::Hyperbola(frame, [p, q]) => {
                let point = |t: f64| DVec3::new(p * t.cosh(), q * t.sinh(), 0.0);
                let (middle, half) = (0.5 * (t[0] + t[1]), 0.5 * (t[1] - t[0]));
                let weight = half.cosh();
                conic(frame, [point(t[0]), point(middle) / weight, point(t[1])], weight, t[0] < t[1])
            }
            Self::Spline(curve, _) => cut(curve, t),
        }
    }

    /// Length of the parameter over which the curve comes back to where it began, if it does.
    pub(super) fn period(&self) -> Option<f64> {
        match self {
            Self::Ellipse(..) => Some(TAU),
            Self::Spline(curve, true) => Some(curve.domain()[1] - curve.domain()[0]),
            _ => None,
        }
    }

    /// All of it: a whole turn of an ellipse, a spline.
    ///
    /// # Errors
    /// If it has no end.
    pub(super) fn whole(&self) -> Result<Vec<Arc>, String> {
        match self {
            Self::Ellipse(frame, axes) => {
                let at = frame.origin() + frame.axes()[0] * axes[0];
                self.between([at, at], true, true)
            }
            Self::Spline(curve, _) => Ok(vec![Arc { curve: curve.clone(), t: curve.domain() }]),
            _ => Err("has no end, and is not trimmed".to_owned()),
        }
    }

    /// Whether the curve, and not only a part of it, comes back to where it began.
    pub(super) fn is_closed(&self) -> bool {
        matches!(self, Self::Ellipse(..) | Self::Spline(_, true))
    }
}

/// The map of the unit circle onto an ellipse.
fn unit_circle(frame: &Frame, axes: [f64; 2]) -> DMat4 {
    matrix(frame) * DMat4::from_scale(DVec3::new(axes[0], axes[1], 1.0))
}

/// An arc of an ellipse.
fn ellipse(frame: &Frame, axes: [f64; 2], start: f64, sweep: f64) -> Result<Curve, String> {
    let unit = shape::arc(&Frame::WORLD, 1.0, start, sweep).map_err(|e| e.to_string())?;
    unit.transformed(unit_circle(frame, axes)).map_err(|e| e.to_string())
}

/// A rational quadratic with the inner weight, in coordinates of the frame.
fn conic(frame: &Frame, points: [DVec3; 3], weight: f64, rises: bool) -> Result<Curve, String> {
    if !rises {
        return Err("runs against its parameter".to_owned());
    }
    let [a, m, b] = points;
    let knots = KnotVector::bezier(2, [0.0, 1.0]).map_err(|e| e.to_string())?;
    let curve = Curve::new(knots, vec![a.extend(1.0), m.extend(weight), b.extend(1.0)]);
    curve.and_then(|c| c.transformed(matrix(frame))).map_err(|e| e.to_string())
}

/// Parameters nearer to an end of the curve than this part of its range are the end.
const END: f64 = 1e-9;

/// The part of a spline between two of its points, in its direction; two parts if it passes the end of a closed one.
fn part_of_spline(curve: &Curve, closed: bool, ends: [DVec3; 2], closes: bool) -> Result<Vec<Arc>, String> {
    let [lo, hi] = curve.domain();
    let near = END * (hi - lo);
    let mut t = ends.map(|p| curve.nearest(p).0);
    // Both ends of a closed curve are one point.
    let at_end = |t: f64| t - lo <= near || hi - t <= near;
    if closed {
        if at_end(t[0]) {
            t[0] = lo;
        }
        if at_end(t[1]) {
            t[1] = hi;
        }
    } else {
        t = t.map(|t| {
            if t - lo <= near {
                lo
            } else if hi - t <= near {
                hi
            } else {
                t
            }
        });
    }
    let part = |t: [f64; 2]| cut(curve, t).map(|curve| Arc { curve, t });
    if closes && (t[0] == lo || t[1] == hi) {
        return if closed { Ok(vec![part([lo, hi])?]) } else { Err("is open, but its edge is closed".to_owned()) };
    }
    if !closes && t[1] - t[0] > near {
        return Ok(vec![part(t)?]);
    }
    if closed {
        return Ok(vec![part([t[0], hi])?, part([lo, t[1]])?]);
    }
    Err(if closes { "is open, but its edge is closed" } else { "runs from its end to its beginning" }.to_owned())
}

/// The part of a spline over an interval of its parameter, as far as it reaches.
///
/// # Errors
/// If the interval is beyond it or has no length.
pub(super) fn cut(curve: &Curve, [a, b]: [f64; 2]) -> Result<Curve, String> {
    let [lo, hi] = curve.domain();
    let mut part = curve.clone();
    if a > lo {
        part = part.split(a).map_err(|e| e.to_string())?.1;
    }
    if b < hi {
        part = part.split(b).map_err(|e| e.to_string())?.0;
    }
    Ok(part)
}
