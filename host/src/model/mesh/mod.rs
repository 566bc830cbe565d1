//! Polygon meshes, which readers fill and which become surfaces.
//!
//! A mesh in a file is a list of polygons that do not know of each other, or know by numbers that were rounded. Here it
//! becomes one that does: corners that are one point are [welded](weld), facets without area and those that are there
//! twice go, facets are turned to agree with their neighbours, and corners that lie on the edge of another facet part it
//! ([topology]). What was done is counted in the report, with the largest distance by which a point was moved.
//!
//! Each facet becomes a [surface](surfaces) of its own, of degree 1 × 1. Facets that meet at exactly the same corners are
//! joined by geometry; where they meet only to the precision of the file, both name the edge.

mod on_edges;
mod polygon;
mod surfaces;
#[cfg(test)]
mod tests;
mod topology;
mod weld;

use std::collections::{HashMap, HashSet};

use self::polygon::Shape;
use glam::DVec3;
use penvis_core::scene::SceneSurface;

use super::fault::{Fault, ReadError};
use super::import::{Reading, Report};

/// Most facets of a mesh. Each becomes a surface of about a kilobyte, and more of them than this leave no white between
/// the lines on any sheet.
pub(super) const MOST_FACETS: usize = 1 << 20;

/// Most corners of all facets together.
pub(super) const MOST_CORNERS: usize = 8 * MOST_FACETS;

/// Most corners of a facet, whose crossings are looked for in pairs.
pub(super) const MOST_CORNERS_OF_ONE: usize = 1 << 16;

/// How often readers say how far they are, in facets or lines.
pub(super) const PROGRESS_STEP: usize = 1 << 14;

/// How finely the coordinates of a file are known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Precision {
    /// They are, or were before they were written, numbers of single precision.
    Single,
    /// They are decimal numbers with at most so many digits after the point.
    Decimals(u32),
}

/// A coordinate with fewer steps of its last decimal than this is taken to be exact: it is typed, not rounded.
const ROUNDED_STEPS: f64 = 1e5;

impl Precision {
    /// Distance within which two points whose coordinates are at most `largest` are one: that of two neighbours in the
    /// grid of numbers, which is what rounding makes of one point that was computed twice.
    fn tolerance(self, largest: f64) -> f64 {
        let single = largest * f64::from(f32::EPSILON);
        let step = match self {
            Self::Single => single,
            Self::Decimals(digits) => {
                let step = 10_f64.powi(-i32::try_from(digits).unwrap_or(i32::MAX));
                if step * ROUNDED_STEPS <= largest { single.max(step) } else { single }
            }
        };
        3_f64.sqrt() * step
    }
}

/// Follows the coordinates of a text file, for how finely they are known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Decimals {
    /// Most digits after the point so far; none if a coordinate had an exponent.
    most: Option<u32>,
}

impl Default for Decimals {
    fn default() -> Self {
        Self { most: Some(0) }
    }
}

impl Decimals {
    /// Takes note of a coordinate as it is written.
    pub(super) fn count(&mut self, word: &str) {
        let digits = word.split_once('.').map_or(0, |(_, digits)| digits.len() as u32);
        self.most = self.most.filter(|_| !word.contains(['e', 'E'])).map(|most| most.max(digits));
    }

    /// How finely all of them are known.
    pub(super) fn precision(self) -> Precision {
        self.most.map_or(Precision::Single, Precision::Decimals)
    }
}

/// A facet's corners as a range of the list of all, and where it stands in the file.
#[derive(Clone, Copy, Debug)]
struct Polygon {
    first: u32,
    count: u32,
    /// Line or number of the facet, by which messages name it.
    place: u32,
    /// Index of the name of its part.
    part: u32,
    /// Whether it is a part of a plane, and no patch of its own.
    is_flat: bool,
}

/// A polygon mesh as readers fill it.
#[derive(Debug)]
pub(super) struct Mesh {
    /// What `place` of a facet counts: lines or triangles.
    unit: &'static str,
    points: Vec<DVec3>,
    index: HashMap<[u64; 3], u32>,
    corners: Vec<u32>,
    polygons: Vec<Polygon>,
    parts: Vec<String>,
}

impl Mesh {
    /// A mesh without facets. Messages name a facet by `unit` and a number.
    pub(super) fn new(unit: &'static str) -> Self {
        Self {
            unit,
            points: Vec::new(),
            index: HashMap::new(),
            corners: Vec::new(),
            polygons: Vec::new(),
            parts: vec![String::new()],
        }
    }

    /// Facets that follow belong to the part of this name; empty for none.
    pub(super) fn begin_part(&mut self, name: &str) {
        match self.parts.last() {
            Some(last) if last == name => {}
            _ => self.parts.push(name.to_owned()),
        }
    }

    /// Index of the point, which is that of the same point if it was there before.
    pub(super) fn point(&mut self, p: DVec3) -> u32 {
        // The two zeros are one number.
        let p = p + DVec3::ZERO;
        let next = self.points.len() as u32;
        let index = *self.index.entry(p.to_array().map(f64::to_bits)).or_insert(next);
        if index == next {
            self.points.push(p);
        }
        index
    }

    /// Adds a facet by the indices of its corners in order; it is the one at `place`, as messages say.
    ///
    /// # Errors
    /// If there are more facets, or corners, than a drawing can be made of.
    pub(super) fn facet(&mut self, corners: &[u32], place: usize) -> Result<(), Fault> {
        let first = self.corners.len();
        if corners.len() > MOST_CORNERS_OF_ONE {
            let place = format!("{} {place}", self.unit);
            let problem =
                format!("has {} corners; part it into facets of {MOST_CORNERS_OF_ONE} at most", corners.len());
            return Err(Fault::at(place, problem));
        }
        if self.polygons.len() == MOST_FACETS || first + corners.len() > MOST_CORNERS {
            return Err(too_many());
        }
        self.corners.extend_from_slice(corners);
        let part = self.parts.len() as u32 - 1;
        let place = u32::try_from(place).unwrap_or(u32::MAX);
        self.polygons.push(Polygon { first: first as u32, count: corners.len() as u32, place, part, is_flat: false });
        Ok(())
    }

    /// Number of facets so far.
    pub(super) fn len(&self) -> usize {
        self.polygons.len()
    }

    fn corners_of(&self, polygon: &Polygon) -> &[u32] {
        &self.corners[polygon.first as usize..][..polygon.count as usize]
    }

    /// The facets as surfaces. What had to be put right for it is told in the report. Cost: O(n log n) in the corners.
    ///
    /// # Errors
    /// If it is asked to stop.
    pub(super) fn into_surfaces(
        mut self,
        precision: Precision,
        reading: &Reading<'_>,
        report: &mut Report,
    ) -> Result<Vec<SceneSurface>, ReadError> {
        self.index = HashMap::new();
        let largest = self.points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        let tolerance = precision.tolerance(largest);
        self.weld(tolerance, report);
        self.clean(tolerance, report);
        self.part(tolerance, reading, report)?;
        let topology = topology::Topology::of(&mut self, tolerance, report);
        surfaces::surfaces(&self, &topology, reading, report)
    }

    /// Makes points nearer to each other than the tolerance one.
    fn weld(&mut self, tolerance: f64, report: &mut Report) {
        let welded = weld::weld(&self.points, tolerance);
        if welded.moved > 0 {
            let count = counted(welded.moved, "corner");
            report.healed.push(format!("welded {count} to others, at most {:.1e} away", welded.farthest));
        }
        for corner in &mut self.corners {
            *corner = welded.target[*corner as usize];
        }
    }

    /// Drops facets without area, and those that are there twice.
    fn clean(&mut self, tolerance: f64, report: &mut Report) {
        let (mut flat, mut again) = (0, 0);
        let mut seen: HashSet<Vec<u32>> = HashSet::with_capacity(self.polygons.len());
        let mut corners = Vec::with_capacity(self.corners.len());
        let mut polygons = Vec::with_capacity(self.polygons.len());
        for polygon in &self.polygons {
            let mut own = self.corners_of(polygon).to_vec();
            own.dedup();
            while own.len() > 1 && own.first() == own.last() {
                own.pop();
            }
            if !has_area(own.iter().map(|&c| self.points[c as usize]), tolerance) {
                flat += 1;
                continue;
            }
            if !seen.insert(canonical(&own)) {
                again += 1;
                continue;
            }
            polygons.push(Polygon { first: corners.len() as u32, count: own.len() as u32, ..*polygon });
            corners.extend(own);
        }
        (self.polygons, self.corners) = (polygons, corners);
        if flat > 0 {
            report.healed.push(format!("dropped {} without area", counted(flat, "facet")));
        }
        if again > 0 {
            report.healed.push(format!("dropped {} there already", are(again, "facet")));
        }
    }

    /// Parts polygons that are not flat into triangles, and finds those that are parts of planes.
    fn part(&mut self, tolerance: f64, reading: &Reading<'_>, report: &mut Report) -> Result<(), ReadError> {
        if self.polygons.iter().all(|p| p.count == 3) {
            return Ok(());
        }
        let count = self.polygons.len();
        let mut mesh = Self { points: std::mem::take(&mut self.points), ..Self::new(self.unit) };
        let (mut parted, mut farthest, mut crossed) = (0, 0.0_f64, Vec::new());
        for (index, polygon) in self.polygons.iter().enumerate() {
            if index % PROGRESS_STEP == 0 {
                reading.progress(index, count)?;
            }
            let own = self.corners_of(polygon);
            let points: Vec<DVec3> = own.iter().map(|&c| mesh.points[c as usize]).collect();
            match polygon::shape(own, &points, tolerance) {
                Shape::Patch => mesh.push(own, *polygon, false)?,
                Shape::Flat => mesh.push(own, *polygon, true)?,
                Shape::Crossed => crossed.push(polygon.place),
                Shape::Parted(triangles, off) => {
                    (parted, farthest) = (parted + 1, farthest.max(off));
                    for triangle in triangles {
                        mesh.push(&triangle.map(|k| own[k]), *polygon, false)?;
                    }
                }
            }
        }
        mesh.parts = std::mem::take(&mut self.parts);
        *self = mesh;
        if parted > 0 {
            let are = if parted == 1 { "1 facet that is" } else { &format!("{parted} facets that are") };
            report.healed.push(format!("parted {are} not flat, by at most {farthest:.1e}, into triangles"));
        }
        if let Some(first) = crossed.first() {
            let facets = counted(crossed.len(), "facet");
            report.problems.push(format!("left out {facets} whose sides cross, the first at {} {first}", self.unit));
        }
        Ok(())
    }

    fn push(&mut self, corners: &[u32], like: Polygon, is_flat: bool) -> Result<(), Fault> {
        if self.polygons.len() == MOST_FACETS {
            return Err(too_many());
        }
        let first = self.corners.len() as u32;
        self.corners.extend_from_slice(corners);
        self.polygons.push(Polygon { first, count: corners.len() as u32, is_flat, ..like });
        Ok(())
    }
}

/// Twice the vector area of a polygon: along its normal, the fingers of the right hand curled along its corners. Relative
/// to its first corner, so that a mesh far from the origin keeps its digits.
fn vector_area(points: impl Iterator<Item = DVec3>) -> DVec3 {
    let mut points = points;
    let Some(origin) = points.next() else { return DVec3::ZERO };
    let mut sum = DVec3::ZERO;
    let mut before = DVec3::ZERO;
    for p in points {
        let here = p - origin;
        sum += before.cross(here);
        before = here;
    }
    sum
}

/// Whether a polygon is wider than the tolerance: a triangle's width is its least height.
fn has_area(points: impl Iterator<Item = DVec3> + Clone, tolerance: f64) -> bool {
    width(points) > tolerance
}

/// Twice the area of a polygon by the longest side of its box's diagonal; for triangles, by their longest side: the least
/// height.
fn width(points: impl Iterator<Item = DVec3> + Clone) -> f64 {
    let corners: Vec<DVec3> = points.clone().take(4).collect();
    let length = match corners.as_slice() {
        &[a, b, c] => a.distance(b).max(b.distance(c)).max(c.distance(a)),
        _ => {
            let low = points.clone().fold(DVec3::INFINITY, DVec3::min);
            let high = points.clone().fold(DVec3::NEG_INFINITY, DVec3::max);
            low.distance(high)
        }
    };
    if length > 0.0 { vector_area(points).length() / length } else { 0.0 }
}

/// The corners from the least one on, towards the lesser of its neighbours: the same for every way to write one polygon.
fn canonical(corners: &[u32]) -> Vec<u32> {
    let n = corners.len();
    let least = (0..n).min_by_key(|&k| corners[k]).unwrap_or(0);
    let forward = corners[(least + 1) % n] <= corners[(least + n - 1) % n];
    (0..n).map(|k| corners[if forward { least + k } else { least + n - k } % n]).collect()
}

/// "1 facet", "2 facets".
fn counted(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// "1 facet that is", "2 facets that are".
fn are(n: usize, what: &str) -> String {
    format!("{} that {}", counted(n, what), if n == 1 { "is" } else { "are" })
}

fn too_many() -> Fault {
    Fault::whole(format!(
        "has more than {MOST_FACETS} facets or {MOST_CORNERS} corners; no pen can draw so many, so simplify the mesh"
    ))
}
