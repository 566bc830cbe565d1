//! Units of length and angle, and placements in them.

use std::f64::consts::PI;

use glam::{DMat4, DVec3, DVec4};
use penvis_core::shape::Frame;

use super::super::fault::Fault;
use super::exchange::{Entity, Part};

/// What the numbers of a representation mean.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Units {
    /// Name of the unit of length; none if the file does not say.
    pub(super) name: Option<String>,
    /// Millimetres in a unit of length.
    pub(super) length: f64,
    /// Radians in a unit of angle.
    pub(super) angle: f64,
    /// What is not drawn exactly is drawn within this, in millimetres.
    pub(super) tolerance: f64,
    /// Whether points are parameters of a surface: two numbers, whose z is zero.
    flat: bool,
}

impl Default for Units {
    fn default() -> Self {
        Self { name: None, length: 1.0, angle: 1.0, tolerance: 0.0, flat: false }
    }
}

/// Conversions that are defined by others, at most so many deep.
const MAX_DEPTH: usize = 8;

impl Units {
    /// Those of a representation's context.
    ///
    /// # Errors
    /// If a unit of length or of a plane angle is none that is known.
    pub(super) fn of(context: Entity<'_>) -> Result<Self, Fault> {
        let mut units = Self::default();
        let Some(assigned) = context.find("GLOBAL_UNIT_ASSIGNED_CONTEXT") else { return Ok(units) };
        for unit in assigned.entities(0)? {
            if unit.find("LENGTH_UNIT").is_some() {
                let (name, metres) = size(unit, "METRE", 0)?;
                // Powers of ten below one are rounded, their inverses are not.
                let millimetres = if metres < 1e-3 { 1.0 / (1e-3 / metres) } else { metres * 1e3 };
                (units.name, units.length) = (Some(name), rounded(millimetres));
            } else if unit.find("PLANE_ANGLE_UNIT").is_some() {
                units.angle = size(unit, "RADIAN", 0)?.1;
                // Degrees are often written with a few digits.
                let degree = PI / 180.0;
                if (units.angle - degree).abs() < 1e-6 * degree {
                    units.angle = degree;
                }
            }
        }
        Ok(units)
    }

    /// Those of curves in the parameters of a surface: points are as the file has them, whatever a surface measures by them.
    pub(super) fn of_parameters(&self) -> Self {
        Self { name: None, length: 1.0, tolerance: 0.0, flat: true, ..*self }
    }

    /// How far what stands for a curve of these control points may be off: what is asked for in space; among parameters, which
    /// have no common measure, a part of them that is next to nothing.
    pub(super) fn tolerance_of(&self, points: &[DVec4]) -> f64 {
        if !self.flat {
            return self.tolerance;
        }
        let (lo, hi) = points.iter().fold((DVec4::INFINITY, DVec4::NEG_INFINITY), |(l, h), p| (l.min(*p), h.max(*p)));
        1e-9 * (hi - lo).truncate().length()
    }

    /// A point, in millimetres.
    pub(super) fn point(&self, entity: Entity<'_>) -> Result<DVec3, Fault> {
        let Some(point) = entity.find("CARTESIAN_POINT") else {
            return Err(entity.fault("stands where a CARTESIAN_POINT has to"));
        };
        let p = self.vector(point)? * self.length;
        if p.is_finite() { Ok(p) } else { Err(point.fault("is not finite in millimetres")) }
    }

    /// The coordinates of a point or direction.
    fn vector(&self, part: Part<'_>) -> Result<DVec3, Fault> {
        match part.reals(1)?[..] {
            [x, y, z] if !self.flat => Ok(DVec3::new(x, y, z)),
            [x, y] if self.flat => Ok(DVec3::new(x, y, 0.0)),
            _ => Err(part.fault(format!("does not have {} coordinates", if self.flat { "two" } else { "three" }))),
        }
    }

    /// A direction, of any length.
    pub(super) fn direction(&self, entity: Entity<'_>) -> Result<DVec3, Fault> {
        let Some(direction) = entity.find("DIRECTION") else {
            return Err(entity.fault("stands where a DIRECTION has to"));
        };
        let d = self.vector(direction)?;
        let largest = d.abs().max_element();
        if largest > 0.0 { Ok(d / largest) } else { Err(direction.fault("has no length")) }
    }

    /// A frame: the x axis is made perpendicular to the z axis, and is chosen as ISO 10303-42 has it where it is left out.
    pub(super) fn frame(&self, entity: Entity<'_>) -> Result<Frame, Fault> {
        if let Some(placement) = entity.find("AXIS2_PLACEMENT_2D").filter(|_| self.flat) {
            let x = if placement.has(2) { self.direction(placement.entity(2)?)? } else { DVec3::X };
            let origin = self.point(placement.entity(1)?)?;
            return Frame::new(origin, DVec3::Z, x).map_err(|e| placement.fault(e.to_string()));
        }
        let Some(placement) = entity.find("AXIS2_PLACEMENT_3D") else {
            return Err(entity.fault("stands where an AXIS2_PLACEMENT_3D has to"));
        };
        let origin = self.point(placement.entity(1)?)?;
        let z = if placement.has(2) { self.direction(placement.entity(2)?)? } else { DVec3::Z };
        let x = if placement.has(3) { Some(self.direction(placement.entity(3)?)?) } else { None };
        let chosen = if z.x.abs() < (1.0 - f64::EPSILON) * z.length() { DVec3::X } else { DVec3::Y };
        Frame::new(origin, z, x.unwrap_or(chosen)).map_err(|e| placement.fault(e.to_string()))
    }

    /// A point and a direction.
    pub(super) fn axis(&self, entity: Entity<'_>) -> Result<(DVec3, DVec3), Fault> {
        let Some(placement) = entity.find("AXIS1_PLACEMENT") else {
            return Err(entity.fault("stands where an AXIS1_PLACEMENT has to"));
        };
        let z = if placement.has(2) { self.direction(placement.entity(2)?)? } else { DVec3::Z };
        Ok((self.point(placement.entity(1)?)?, z))
    }

    /// The map from a placement's own coordinates to those it stands in, both in millimetres.
    pub(super) fn placement(&self, entity: Entity<'_>) -> Result<DMat4, Fault> {
        if entity.find("AXIS2_PLACEMENT_3D").is_some() {
            return Ok(matrix(&self.frame(entity)?));
        }
        let Some(operator) = entity.find("CARTESIAN_TRANSFORMATION_OPERATOR_3D") else {
            return Err(entity.fault("is no placement that is known"));
        };
        // The last of an entity of one type, after its names: axis 1, axis 2, origin, scale, axis 3. Else the first four
        // stand with the general type.
        let base = entity.find("CARTESIAN_TRANSFORMATION_OPERATOR").unwrap_or(operator);
        let first = if entity.is_simple() { operator.len().saturating_sub(5) } else { 0 };
        let axis3 = operator.len().saturating_sub(1);
        let optional =
            |part: Part<'_>, k: usize| if part.has(k) { self.direction(part.entity(k)?).map(Some) } else { Ok(None) };
        let (x, y, z) = (optional(base, first)?, optional(base, first + 1)?, optional(operator, axis3)?);
        let origin = self.point(base.entity(first + 2)?)?;
        let scale = if base.has(first + 3) { base.positive(first + 3)? } else { 1.0 };
        let z = z.unwrap_or_else(|| match (x, y) {
            (Some(x), Some(y)) => x.cross(y),
            _ => DVec3::Z,
        });
        let chosen = if z.x.abs() < (1.0 - f64::EPSILON) * z.length() { DVec3::X } else { DVec3::Y };
        let frame = Frame::new(origin, z, x.unwrap_or(chosen)).map_err(|e| operator.fault(e.to_string()))?;
        let mut map = matrix(&frame) * DMat4::from_scale(DVec3::splat(scale));
        // The y axis given may be the other one.
        if y.is_some_and(|y| y.dot(frame.axes()[1]) < 0.0) {
            map *= DMat4::from_scale(DVec3::new(1.0, -1.0, 1.0));
        }
        Ok(map)
    }
}

/// A conversion factor without the error of the last digits that its own computation has.
fn rounded(x: f64) -> f64 {
    let whole = x.round();
    if whole > 0.0 && (x - whole).abs() <= 4.0 * f64::EPSILON * whole { whole } else { x }
}

/// Name of a unit, and its size in the base unit.
fn size(unit: Entity<'_>, base: &str, depth: usize) -> Result<(String, f64), Fault> {
    if let Some(si) = unit.find("SI_UNIT") {
        // In an entity of several types the dimensions, which are derived, stand with NAMED_UNIT.
        let first = if unit.is_simple() { 1 } else { 0 };
        let prefix = match si.word(first) {
            None => ("", 1.0),
            Some("MEGA") => ("mega", 1e6),
            Some("KILO") => ("kilo", 1e3),
            Some("HECTO") => ("hecto", 1e2),
            Some("DECA") => ("deca", 1e1),
            Some("DECI") => ("deci", 1e-1),
            Some("CENTI") => ("centi", 1e-2),
            Some("MILLI") => ("milli", 1e-3),
            Some("MICRO") => ("micro", 1e-6),
            Some("NANO") => ("nano", 1e-9),
            Some(other) => return Err(si.fault(format!("has the prefix .{other}., which is not known"))),
        };
        return match si.word(first + 1) {
            Some(name) if name == base => Ok((format!("{}{}", prefix.0, name.to_lowercase()), prefix.1)),
            _ => Err(si.fault(format!("is no .{base}."))),
        };
    }
    let Some(conversion) = unit.find("CONVERSION_BASED_UNIT") else {
        return Err(unit.fault("is no unit that is known"));
    };
    if depth == MAX_DEPTH {
        return Err(conversion.fault("is defined by itself"));
    }
    let first = if unit.is_simple() { 1 } else { 0 };
    let name = conversion.text(first).to_lowercase();
    let factor = conversion.entity(first + 1)?;
    let types = ["LENGTH_MEASURE_WITH_UNIT", "PLANE_ANGLE_MEASURE_WITH_UNIT", "MEASURE_WITH_UNIT"];
    // In an entity of several types the value stands with the general one, which is the last to be looked at.
    let measure = types.iter().filter_map(|t| factor.find(t)).find(|m| m.has(0));
    let Some(measure) = measure else { return Err(factor.fault("stands where a measure with a unit has to")) };
    let (_, of) = size(measure.entity(1)?, base, depth + 1)?;
    Ok((name, measure.positive(0)? * of))
}

/// The map from a frame's own coordinates to those it stands in.
pub(super) fn matrix(frame: &Frame) -> DMat4 {
    let [x, y, z] = frame.axes();
    DMat4::from_cols(x.extend(0.0), y.extend(0.0), z.extend(0.0), frame.origin().extend(1.0))
}
