//! Surfaces of faces: those that have no end, and those that go round, as rational B-spline surfaces that are as large as a
//! face asks for.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, DVec4};
use penvis_core::nurbs::{Curve, Surface, lowered_surface};
use penvis_core::shape::{self, Frame, ShapeError};

use super::super::fault::Fault;
use super::curve::{self, Arc, Shape, implied, repeated};
use super::exchange::{Entity, Part};
use super::parameters::Parameters;
use super::units::{Units, matrix};

/// A surface, and the directions in which it goes on as it began.
#[derive(Debug)]
pub(super) struct Support {
    pub(super) surface: Surface,
    pub(super) periodic: [bool; 2],
    /// Whether it is only as large as the face asks for, so that a face that keeps its border keeps the wrong side.
    pub(super) is_cut: bool,
    /// What the file's parameters of it are.
    pub(super) parameters: Parameters,
    pub(super) kind: &'static str,
}

/// What a face needs of its surface: the curves round it.
#[derive(Debug, Default)]
pub(super) struct Extent {
    pub(super) curves: Vec<Curve>,
    /// Points that are loops of their own: poles.
    pub(super) points: Vec<DVec3>,
}

/// Part of a range by which a surface goes on beyond what a face needs, where a curve is tangent to where it would end.
const MARGIN: f64 = 1.0 / 16.0;

/// Part of a range, or of the distance of coordinates from the origin, that is nothing.
const NOTHING: f64 = 1e-9;

impl Extent {
    /// Points that hold the curves in their hull.
    fn points(&self) -> impl Iterator<Item = DVec3> + '_ {
        let of_curves = self.curves.iter().flat_map(|c| c.homogeneous()).map(|h| h.truncate() / h.w);
        of_curves.chain(self.points.iter().copied())
    }

    /// A point of the first curve.
    fn start(&self) -> Option<DVec3> {
        self.points().next()
    }

    /// The range of a coordinate: just what is needed if only straight lines, and curves along which it is constant, reach
    /// its ends; else a little more. None if it is a single value.
    fn range(&self, coordinate: impl Fn(DVec3) -> f64) -> Option<[f64; 2]> {
        let (mut lo, mut hi) = (f64::INFINITY, f64::NEG_INFINITY);
        for x in self.points().map(&coordinate) {
            (lo, hi) = (lo.min(x), hi.max(x));
        }
        let length = hi - lo;
        let nothing = NOTHING * length.max(NOTHING * lo.abs().max(hi.abs()));
        if length.is_nan() || length <= 1e-12 * lo.abs().max(hi.abs()) {
            return None;
        }
        let (mut below, mut above) = (false, false);
        for c in self.curves.iter().filter(|c| c.degree() > 1) {
            let values = || c.homogeneous().iter().map(|h| coordinate(h.truncate() / h.w));
            let (low, high) = values().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            if high - low > nothing {
                below |= low - lo <= nothing;
                above |= hi - high <= nothing;
            }
        }
        let margin = MARGIN * length;
        Some([if below { lo - margin } else { lo }, if above { hi + margin } else { hi }])
    }

    /// A direction in which the face is longest, if it has a straight side.
    fn straight_side(&self) -> Option<DVec3> {
        let sides = self.curves.iter().filter(|c| c.degree() == 1 && c.homogeneous().len() == 2);
        let vectors = sides.map(|c| (c.homogeneous()[1] - c.homogeneous()[0]).truncate());
        vectors.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()))
    }
}

/// The surface of a face.
///
/// # Errors
/// If it is none that is read, or is wrong.
pub(super) fn support(entity: Entity<'_>, units: &Units, extent: &Extent) -> Result<Support, Fault> {
    let shaped = |e: ShapeError| entity.fault(e.to_string());
    let empty = || entity.fault("has a face that is nowhere wide");
    let length = |part: Part<'_>, index: usize| Ok::<f64, Fault>(part.positive(index)? * units.length);
    if let Some(plane) = entity.find("PLANE") {
        let frame = units.frame(plane.entity(1)?)?;
        let surface = plane_of(&frame, extent).ok_or_else(empty)?;
        let parameters = Parameters::Plane(frame);
        return Ok(Support { surface, periodic: [false; 2], is_cut: true, parameters, kind: "plane" });
    }
    if let Some(cylinder) = entity.find("CYLINDRICAL_SURFACE") {
        let own = units.frame(cylinder.entity(1)?)?;
        let frame = turned(&own, extent);
        let radius = length(cylinder, 2)?;
        let parameters = Parameters::Cone { frame: own, radius, slope: 0.0 };
        let [a, b] = extent.range(along(&frame)).ok_or_else(empty)?;
        let surface = shape::cylinder(&lifted(&frame, a).map_err(shaped)?, radius, b - a).map_err(shaped)?;
        return Ok(Support { surface, periodic: [true, false], is_cut: true, parameters, kind: "cylinder" });
    }
    if let Some(cone) = entity.find("CONICAL_SURFACE") {
        let own = units.frame(cone.entity(1)?)?;
        let frame = turned(&own, extent);
        let radius = cone.real(2)? * units.length;
        let slope = (cone.real(3)? * units.angle).tan();
        if !(radius >= 0.0 && slope.is_finite() && slope != 0.0) {
            return Err(cone.fault("has a radius below zero, or an angle that makes no cone"));
        }
        let [mut a, mut b] = extent.range(along(&frame)).ok_or_else(empty)?;
        // The other half of the double cone is no part of it.
        let apex = -radius / slope;
        if slope > 0.0 {
            a = a.max(apex);
        } else {
            b = b.min(apex);
        }
        // What rounding leaves of the apex is the apex.
        let at = |z: f64| if (z - apex).abs() <= NOTHING * (b - a).abs() { 0.0 } else { radius + slope * z };
        if a >= b {
            return Err(empty());
        }
        let surface = shape::cone(&lifted(&frame, a).map_err(shaped)?, at(a), at(b), b - a).map_err(shaped)?;
        let parameters = Parameters::Cone { frame: own, radius, slope };
        return Ok(Support { surface, periodic: [true, false], is_cut: true, parameters, kind: "cone" });
    }
    if let Some(sphere) = entity.find("SPHERICAL_SURFACE") {
        let (own, radius) = (units.frame(sphere.entity(1)?)?, length(sphere, 2)?);
        let surface = shape::sphere(&turned(&own, extent), radius).map_err(shaped)?;
        let parameters = Parameters::Torus { frame: own, major: 0.0, minor: radius };
        return Ok(Support { surface, periodic: [true, false], is_cut: false, parameters, kind: "sphere" });
    }
    if let Some((kind, torus)) = entity.find_any(&["TOROIDAL_SURFACE", "DEGENERATE_TOROIDAL_SURFACE"]) {
        let own = units.frame(torus.entity(1)?)?;
        let frame = turned(&own, extent);
        let (major, minor) = (length(torus, 2)?, length(torus, 3)?);
        let parameters = Parameters::Torus { frame: own, major, minor };
        if kind == "TOROIDAL_SURFACE" && major > minor {
            let surface = shape::torus(&frame, major, minor).map_err(shaped)?;
            return Ok(Support { surface, periodic: [true, true], is_cut: false, parameters, kind: "torus" });
        }
        let outer = if kind == "TOROIDAL_SURFACE" { true } else { torus.flag(4)? };
        let surface = spindle(&frame, [major, minor], outer).map_err(shaped)?;
        return Ok(Support { surface, periodic: [true, false], is_cut: false, parameters, kind: "torus" });
    }
    if let Some(extrusion) = entity.find("SURFACE_OF_LINEAR_EXTRUSION") {
        return extruded(extrusion, units, extent);
    }
    if let Some(revolution) = entity.find("SURFACE_OF_REVOLUTION") {
        return revolved(revolution, units, extent);
    }
    if let Some((surface, closed)) = spline(entity, units)? {
        let parameters = Parameters::Own;
        return Ok(Support { surface, periodic: closed, is_cut: false, parameters, kind: "B-spline surface" });
    }
    Err(entity.fault("is a kind of surface that is not read"))
}

/// The coordinate along a frame's z axis.
fn along(frame: &Frame) -> impl Fn(DVec3) -> f64 {
    let (origin, z) = (frame.origin(), frame.axes()[2]);
    move |p| (p - origin).dot(z)
}

/// A frame moved along its z axis.
fn lifted(frame: &Frame, z: f64) -> Result<Frame, ShapeError> {
    let [x, _, axis] = frame.axes();
    Frame::new(frame.origin() + axis * z, axis, x)
}

/// A frame turned round its z axis so that a curve of the face begins at the x axis: a face that is not all round then does
/// not pass the seam, if one of its sides is straight.
fn turned(frame: &Frame, extent: &Extent) -> Frame {
    let [_, _, z] = frame.axes();
    let sides = extent.curves.iter().filter(|c| c.degree() == 1).filter_map(|c| c.homogeneous().first());
    let start = sides.map(|h| h.truncate() / h.w).next().or_else(|| extent.start());
    let turned = start.and_then(|p| Frame::new(frame.origin(), z, p - frame.origin()).ok());
    turned.unwrap_or(*frame)
}

/// The rectangle of a plane that holds the face, along its longest straight side.
fn plane_of(frame: &Frame, extent: &Extent) -> Option<Surface> {
    let [x, _, z] = frame.axes();
    let frame = Frame::new(frame.origin(), z, extent.straight_side().unwrap_or(x)).unwrap_or(*frame);
    let [x, y, _] = frame.axes();
    let o = frame.origin();
    let [a, b] = extent.range(|p| (p - o).dot(x))?;
    let [c, d] = extent.range(|p| (p - o).dot(y))?;
    shape::plane(o + x * a + y * c, x * (b - a), y * (d - c)).ok()
}

/// A torus whose tube reaches the axis: the part outside that the tube turns from pole to pole, or the one inside.
fn spindle(frame: &Frame, [major, minor]: [f64; 2], outer: bool) -> Result<Surface, ShapeError> {
    let [x, y, z] = frame.axes();
    // Angle of the tube at which it meets the axis, from the outer equator.
    let meets = (-major / minor).acos();
    let centre = frame.origin() + x * major;
    let profile_frame = Frame::new(centre, -y, x)?;
    let (start, sweep) = if outer { (-meets, 2.0 * meets) } else { (meets, TAU - 2.0 * meets) };
    if sweep.is_nan() || sweep <= 0.0 {
        return Err(ShapeError::Sweep { sweep });
    }
    let profile = shape::arc(&profile_frame, minor, start, sweep)?;
    shape::revolution(&on_axis(&profile, frame)?, frame.origin(), z, TAU)
}

/// A profile whose ends are on the axis to rounding, with its ends on it.
fn on_axis(profile: &Curve, frame: &Frame) -> Result<Curve, ShapeError> {
    let (o, z) = (frame.origin(), frame.axes()[2]);
    let mut points = profile.homogeneous().to_vec();
    let size = points.iter().map(|h| (h.truncate() / h.w).distance(o)).fold(0.0, f64::max);
    let last = points.len() - 1;
    for k in [0, last] {
        let p = points[k].truncate() / points[k].w;
        let foot = o + z * (p - o).dot(z);
        if p.distance(foot) <= NOTHING * size {
            points[k] = (foot * points[k].w).extend(points[k].w);
        }
    }
    Ok(Curve::from_homogeneous(profile.knots().clone(), points)?)
}

fn extruded(part: Part<'_>, units: &Units, extent: &Extent) -> Result<Support, Fault> {
    let basis = curve::basis(part.entity(1)?, units)?;
    let vector = part.entity(2)?;
    let Some(vector) = vector.find("VECTOR") else { return Err(vector.fault("stands where a VECTOR has to")) };
    let d = units.direction(vector.entity(1)?)?.normalize();
    let empty = || part.fault("has a face that is nowhere wide");
    if let Shape::Line(origin, l) = basis.shape {
        let frame = Frame::new(origin, l.cross(d), l).map_err(|e| part.fault(e.to_string()))?;
        let surface = plane_of(&frame, extent).ok_or_else(empty)?;
        let parameters = Parameters::Other;
        return Ok(Support { surface, periodic: [false; 2], is_cut: true, parameters, kind: "plane" });
    }
    let (profile, closed) = profile(part, &basis)?;
    // Along d, what a face needs lies between the profile moved up and moved down to it.
    let height = |h: &DVec4| (h.truncate() / h.w).dot(d);
    let (lo, hi) = profile
        .homogeneous()
        .iter()
        .map(height)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
    let [a, b] = extent.range(|p| p.dot(d)).ok_or_else(empty)?;
    let (a, b) = (a - hi, b - lo);
    let moved = profile.transformed(glam::DMat4::from_translation(d * a)).map_err(|e| part.fault(e.to_string()))?;
    let surface = shape::extrusion(&moved, d * (b - a)).map_err(|e| part.fault(e.to_string()))?;
    let parameters = Parameters::Other;
    Ok(Support { surface, periodic: [closed, false], is_cut: true, parameters, kind: "surface of extrusion" })
}

fn revolved(part: Part<'_>, units: &Units, extent: &Extent) -> Result<Support, Fault> {
    let basis = curve::basis(part.entity(1)?, units)?;
    let (origin, z) = units.axis(part.entity(2)?)?;
    let shaped = |e: ShapeError| part.fault(e.to_string());
    let axis = Frame::along(origin, z).map_err(shaped)?;
    let z = axis.axes()[2];
    if let Shape::Line(start, l) = basis.shape {
        // Points keep their distance from any point of the axis as they turn.
        let l = l.normalize();
        let to_line = start - origin;
        let foot = -to_line.dot(l);
        let off = (to_line + l * foot).length_squared();
        let far = extent.points().map(|p| p.distance_squared(origin)).fold(0.0, f64::max);
        let half = (far - off).max(0.0).sqrt();
        let (mut a, mut b) = (foot - half, foot + half);
        // On the side of the axis from which the file's point comes, if the line meets the axis.
        let meets = meets_axis(start, l, origin, z);
        if let Some(t) = meets {
            if t <= 0.0 { a = a.max(t) } else { b = b.min(t) }
        }
        if b.is_nan() || b <= a {
            return Err(part.fault("has a face that is nowhere wide"));
        }
        let profile = shape::line(start + l * a, start + l * b).map_err(shaped)?;
        let profile = on_axis(&profile, &axis).map_err(shaped)?;
        let start = around(&profile, &axis, extent).map_err(shaped)?;
        let surface = shape::revolution(&start, origin, z, TAU).map_err(shaped)?;
        return Ok(Support {
            surface,
            periodic: [true, false],
            is_cut: true,
            parameters: Parameters::Other,
            kind: "surface of revolution",
        });
    }
    if let Shape::Ellipse(frame, [a, b]) = &basis.shape
        && a == b
        && basis.part.is_none()
        && frame.axes()[2].dot(z).abs() < NOTHING
        && (frame.origin() - origin).dot(frame.axes()[2]).abs() <= NOTHING * a
    {
        // A whole circle in a plane through the axis. Where it passes through the axis each of its two parts would cover the
        // same; the larger one is as good as a torus.
        let centre = frame.origin();
        let across = centre - origin - z * (centre - origin).dot(z);
        let major = if across.length() <= NOTHING * a { 0.0 } else { across.length() };
        let x = if major > 0.0 { across } else { axis.axes()[0] };
        let turned_up = Frame::new(centre - across, z, x).map_err(shaped)?;
        let own = turned(&turned_up, extent);
        // S_u × S_v points out of the tube if the circle runs counterclockwise seen from where the axis turns from.
        let outwards = frame.axes()[2].dot(x.cross(z)) > 0.0;
        let (surface, periodic) = if major > *a {
            (shape::torus(&own, major, *a).map_err(shaped)?, [true, true])
        } else {
            (spindle(&own, [major, *a], true).map_err(shaped)?, [true, false])
        };
        let surface = if outwards { surface } else { surface.reversed_v() };
        return Ok(Support {
            surface,
            periodic,
            is_cut: false,
            parameters: Parameters::Other,
            kind: "surface of revolution",
        });
    }
    let (profile, closed) = profile(part, &basis)?;
    let profile = on_axis(&profile, &axis).map_err(shaped)?;
    let profile = around(&profile, &axis, extent).map_err(shaped)?;
    let surface = shape::revolution(&profile, origin, z, TAU).map_err(shaped)?;
    Ok(Support {
        surface,
        periodic: [true, closed],
        is_cut: false,
        parameters: Parameters::Other,
        kind: "surface of revolution",
    })
}

/// The parameter of a line of unit direction at which it meets an axis, if it does.
fn meets_axis(start: DVec3, l: DVec3, origin: DVec3, z: DVec3) -> Option<f64> {
    let (from, across) = (start - origin, l - z * l.dot(z));
    let off = from - z * from.dot(z);
    if across.length() <= NOTHING {
        return None;
    }
    let t = -off.dot(across) / across.length_squared();
    ((off + across * t).length() <= NOTHING * (off.length() + from.length())).then_some(t)
}

/// The profile turned about the axis to where a curve of the face begins, so that the seam is there.
fn around(profile: &Curve, axis: &Frame, extent: &Extent) -> Result<Curve, ShapeError> {
    let [_, _, z] = axis.axes();
    let own = turned(axis, extent).axes()[0];
    let off = |p: DVec3| {
        let from = p - axis.origin();
        from - z * from.dot(z)
    };
    let far = profile.homogeneous().iter().map(|h| off(h.truncate() / h.w));
    let Some(x) = far.max_by(|a, b| a.length_squared().total_cmp(&b.length_squared())) else {
        return Ok(profile.clone());
    };
    if x.length() == 0.0 {
        return Ok(profile.clone());
    }
    let angle = x.cross(own).dot(z).atan2(x.dot(own));
    // No turn at all keeps the numbers of the file.
    if angle.abs() <= NOTHING * PI {
        return Ok(profile.clone());
    }
    let to_axis = matrix(axis);
    let map = to_axis * glam::DMat4::from_rotation_z(angle) * to_axis.inverse();
    on_axis(&profile.transformed(map)?, axis)
}

/// The curve that is moved or turned, and whether it is closed.
fn profile(part: Part<'_>, basis: &curve::Basis) -> Result<(Curve, bool), Fault> {
    let (curves, closed) = match basis.part {
        Some((ends, forward)) => (basis.shape.between(ends, ends[0] == ends[1], forward), ends[0] == ends[1]),
        None => (basis.shape.whole(), basis.shape.is_closed()),
    };
    let curves = curves.map_err(|e| part.fault(format!("has a profile that {e}")))?;
    match <[Arc; 1]>::try_from(curves) {
        Ok([arc]) => Ok((arc.curve, closed)),
        Err(_) => Err(part.fault("has a profile that passes its own end")),
    }
}

/// The B-spline surface that an entity is, if it is one, and the directions in which it is closed.
fn spline(entity: Entity<'_>, units: &Units) -> Result<Option<(Surface, [bool; 2])>, Fault> {
    const KINDS: &[&str] = &[
        "B_SPLINE_SURFACE_WITH_KNOTS",
        "BEZIER_SURFACE",
        "UNIFORM_SURFACE",
        "QUASI_UNIFORM_SURFACE",
        "B_SPLINE_SURFACE",
    ];
    let Some((kind, own)) = entity.find_any(KINDS) else { return Ok(None) };
    // In an entity of several types, degrees and points stand with B_SPLINE_SURFACE, without the name.
    let (base, first) = match entity.find("B_SPLINE_SURFACE") {
        Some(base) if !entity.is_simple() => (base, 0),
        _ => (own, 1),
    };
    let degrees = [base.count(first)?, base.count(first + 1)?];
    let rows = base.rows(first + 2)?;
    let counts = [rows.len(), rows.first().map_or(0, Vec::len)];
    if let Some(row) = rows.iter().position(|r| r.len() != counts[1]) {
        return Err(entity.fault(format!(
            "has {} points in row {}, but {} in the first",
            rows[row].len(),
            row + 1,
            counts[1]
        )));
    }
    let after = if entity.is_simple() { first + 7 } else { 0 };
    let knots = match kind {
        "B_SPLINE_SURFACE_WITH_KNOTS" => [repeated(own, after, after + 2)?, repeated(own, after + 1, after + 3)?],
        kind => [implied(own, kind, degrees[0], counts[0])?, implied(own, kind, degrees[1], counts[1])?],
    };
    let weights = match entity.find("RATIONAL_B_SPLINE_SURFACE") {
        Some(rational) => rational.real_rows(0)?,
        None => vec![vec![1.0; counts[1]]; counts[0]],
    };
    if weights.len() != counts[0] || weights.iter().any(|r| r.len() != counts[1]) {
        return Err(entity.fault(format!("has {} × {} points, but not as many weights", counts[0], counts[1])));
    }
    let mut points = Vec::with_capacity(counts[0] * counts[1]);
    for (p, w) in rows.into_iter().flatten().zip(weights.into_iter().flatten()) {
        points.push(units.point(p)?.extend(w));
    }
    let (surface, off) =
        lowered_surface(degrees, knots, points, units.tolerance).map_err(|e| entity.fault(e.to_string()))?;
    if off > units.tolerance {
        return Err(curve::not_lowered(entity, off));
    }
    let closed = closes(&surface);
    Ok(Some((surface, closed)))
}

/// Whether the borders at the ends of u, and of v, are one curve: what files say of it is not to be relied on.
fn closes(surface: &Surface) -> [bool; 2] {
    let clamped = surface.clamped();
    let width = clamped.knots_v().control_count();
    let rows: Vec<&[DVec4]> = clamped.homogeneous().chunks_exact(width).collect();
    let at = |h: &DVec4| h.truncate() / h.w;
    let points = || clamped.homogeneous().iter().map(at);
    let (lo, hi) = points().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
    // Half the distance within which the ends of trim curves are made to meet.
    let near = 5e-7 * (hi - lo).length();
    let same = |a: &DVec4, b: &DVec4| at(a).distance(at(b)) <= near && (a.w - b.w).abs() <= 1e-9 * a.w.max(b.w);
    let in_u = rows[0].iter().zip(rows[rows.len() - 1]).all(|(a, b)| same(a, b));
    let in_v = rows.iter().all(|r| same(&r[0], &r[width - 1]));
    // A border that is a single point closes nothing.
    let wide = |border: &mut dyn Iterator<Item = DVec3>| {
        let (l, h) = border.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)));
        (h - l).length() > near
    };
    [in_u && wide(&mut rows[0].iter().map(at)), in_v && wide(&mut rows.iter().map(|r| at(&r[0])))]
}
