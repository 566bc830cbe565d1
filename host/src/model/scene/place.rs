//! Where an object stands, and where its copies do.

use glam::{DMat3, DMat4, DVec2, DVec3};

use super::keys::{Item, Table};
use crate::model::fault::Fault;

/// Keys of a placement.
pub(super) const PLACEMENT: [&str; 4] = ["scale", "rotate", "translate", "array"];

/// Most copies along one direction of an array.
const MOST_ALONG: u32 = 1 << 20;

/// Most directions of an array; space has no more.
const MOST_DIRECTIONS: usize = 3;

/// Bounds of the size of a scale: products of three are far from the ends of the range of f64, so that whether a placement
/// mirrors is never lost to over- or underflow.
const SCALE: [f64; 2] = [1e-50, 1e50];

/// Where an object stands: first it is scaled, then rotated, then moved; then it is repeated.
pub(super) struct Placement {
    map: DMat4,
    array: Vec<Direction>,
}

/// A direction of an array.
struct Direction {
    count: u32,
    step: DVec3,
}

impl Placement {
    /// What the keys of an object say.
    ///
    /// # Errors
    /// If one of them makes no sense.
    pub(super) fn new(object: &Table<'_>) -> Result<Self, Fault> {
        let scale = object.get("scale").map_or(Ok(DVec3::ONE), |item| scale(&item))?;
        let turn = object.get("rotate").map_or(Ok(DMat3::IDENTITY), |item| rotation(&item))?;
        let shift = object.get("translate").map_or(Ok(DVec3::ZERO), |item| item.numbers().map(DVec3::from))?;
        let array = object.get("array").map_or(Ok(Vec::new()), |item| array(&item))?;
        let map = DMat4::from_translation(shift) * DMat4::from_mat3(turn * DMat3::from_diagonal(scale));
        Ok(Self { map, array })
    }

    /// How many copies there are.
    pub(super) fn count(&self) -> u64 {
        self.array.iter().map(|d| u64::from(d.count)).product()
    }

    /// Where copy `index` stands; the first direction counts fastest.
    pub(super) fn copy(&self, index: u64) -> DMat4 {
        let (mut rest, mut shift) = (index, DVec3::ZERO);
        for direction in &self.array {
            let count = u64::from(direction.count);
            shift += direction.step * (rest % count) as f64;
            rest /= count;
        }
        DMat4::from_translation(shift) * self.map
    }
}

/// One factor, or one for each axis; a negative one mirrors.
fn scale(item: &Item<'_>) -> Result<DVec3, Fault> {
    let factors = if item.is_list() { DVec3::from(item.numbers()?) } else { DVec3::splat(item.number()?) };
    let [least, most] = SCALE;
    if factors.to_array().iter().all(|f| (least..=most).contains(&f.abs())) {
        Ok(factors)
    } else {
        Err(item.fault(format!("must be from {least:e} to {most:e} in size; a negative factor mirrors")))
    }
}

/// An axis with an angle, or three angles, about x first, then about y, then about z, the axes staying where they are.
fn rotation(item: &Item<'_>) -> Result<DMat3, Fault> {
    if !item.is_table() {
        let [x, y, z] = item.numbers()?;
        return Ok(about(DVec3::Z, z) * about(DVec3::Y, y) * about(DVec3::X, x));
    }
    let table = item.table("a rotation", &["axis", "degrees"])?;
    let axis = table.need("axis")?;
    let vector = DVec3::from(axis.numbers()?);
    // Scaled first, so that neither huge nor tiny vectors lose their length to over- or underflow of the squares.
    let unit = (vector / vector.abs().max_element()).try_normalize();
    let unit = unit.ok_or_else(|| axis.fault("has no direction; give three numbers that are not all zero"))?;
    Ok(about(unit, table.need("degrees")?.number()?))
}

/// The rotation by an angle in degrees about a unit vector, counterclockwise seen from its tip (Rodrigues' formula). Quarter
/// turns about coordinate axes are exact.
fn about(axis: DVec3, degrees: f64) -> DMat3 {
    let turn = degrees % 360.0;
    let (cosine, sine) = match turn / 90.0 {
        0.0 => (1.0, 0.0),
        1.0 | -3.0 => (0.0, 1.0),
        2.0 | -2.0 => (-1.0, 0.0),
        3.0 | -1.0 => (0.0, -1.0),
        _ => DVec2::from_angle(turn.to_radians()).into(),
    };
    let turned = |v: DVec3| v * cosine + axis.cross(v) * sine + axis * (axis.dot(v) * (1.0 - cosine));
    DMat3::from_cols(turned(DVec3::X), turned(DVec3::Y), turned(DVec3::Z))
}

/// One direction, or several.
fn array(item: &Item<'_>) -> Result<Vec<Direction>, Fault> {
    let items = if item.is_list() { item.items()? } else { vec![*item] };
    if items.len() > MOST_DIRECTIONS {
        return Err(item.fault(format!("has {} directions; give {MOST_DIRECTIONS} at most", items.len())));
    }
    items.iter().map(direction).collect()
}

fn direction(item: &Item<'_>) -> Result<Direction, Fault> {
    let table = item.table("an array", &["count", "step"])?;
    let count = table.need("count")?.whole(1, MOST_ALONG)?;
    Ok(Direction { count, step: DVec3::from(table.need("step")?.numbers()?) })
}
