//! Faces: surfaces with the loops of edges round them.

use std::collections::HashMap;
use std::rc::Rc;

use glam::{DVec2, DVec3};
use penvis_core::nurbs::{Curve, Surface};
use penvis_core::pull_back::{PullBack, PullBackError, PulledBack};
use penvis_core::scene::SceneSurface;
use penvis_core::shape;
use penvis_core::trim::{TrimCurve, Trims};

use super::super::fault::Fault;
use super::curve::{self, Arc};
use super::exchange::{Entity, Exchange};
use super::parameters::Parameters;
use super::pcurve::{self, Apart, Given, ParameterCurve};
use super::surface::{self, Extent, Support};
use super::units::Units;

/// Numbers of the edges of a file, by which the two sides of each are one edge.
#[derive(Debug, Default)]
pub(super) struct EdgeNumbers {
    curves: HashMap<u64, u32>,
    /// Sides of polygons, by the lower and the higher number of their ends.
    sides: HashMap<[u64; 2], u32>,
}

impl EdgeNumbers {
    /// Of all edges of a file.
    pub(super) fn of(file: &Exchange) -> Self {
        let mut numbers = Self::default();
        let mut next = 0..;
        for entity in file.entities() {
            if entity.find("EDGE_CURVE").is_some() {
                numbers.curves.extend(next.next().map(|n| (entity.id(), n)));
            } else if let Some(polygon) = entity.find("POLY_LOOP")
                && let Ok(points) = polygon.entities(1)
            {
                for k in 0..points.len() {
                    let ends = side([points[k], points[(k + 1) % points.len()]]);
                    if !numbers.sides.contains_key(&ends) {
                        numbers.sides.extend(next.next().map(|n| (ends, n)));
                    }
                }
            }
        }
        numbers
    }
}

/// The numbers of two points, the lower one first.
fn side(ends: [Entity<'_>; 2]) -> [u64; 2] {
    let [a, b] = ends.map(Entity::id);
    [a.min(b), a.max(b)]
}

/// How faces are read.
pub(super) struct Reader<'a> {
    pub(super) units: &'a Units,
    pub(super) edges: &'a EdgeNumbers,
}

/// A face as it is drawn, and what there is to say about it.
#[derive(Debug)]
pub(super) struct Face {
    pub(super) surface: SceneSurface,
    pub(super) kind: &'static str,
    /// Largest distance of an edge from the surface, in millimetres.
    pub(super) off: f64,
    /// Largest distance by which ends of edges were made to meet, in millimetres.
    pub(super) moved: f64,
    /// Edges shorter than the tolerance, which were left out.
    pub(super) short: usize,
    /// Whether the loops ran the wrong way round.
    pub(super) turned: bool,
    /// What became of the parameter curves of its sides.
    pub(super) given: Given,
}

/// A side of a face.
struct Side {
    /// Number of the entity that messages name it by.
    id: u64,
    edge: Option<u32>,
    arc: Arc,
    /// The curve in space of which it is a part, and whether it is all of its edge; none for a side of a polygon.
    basis: Option<(Rc<curve::Shape>, bool)>,
    /// Its parameter curves on the surface of the face, the likeliest first.
    given: Vec<ParameterCurve>,
}

/// What there is to say about the sides of a face.
#[derive(Debug, Default)]
struct Notes {
    short: usize,
    given: Given,
}

impl Reader<'_> {
    /// A face.
    ///
    /// # Errors
    /// Why it cannot be drawn.
    pub(super) fn face(&self, entity: Entity<'_>) -> Result<Face, Fault> {
        // An oriented face turns front and loops alike, so that what it keeps is the same.
        let entity = match entity.find("ORIENTED_FACE") {
            Some(oriented) => oriented.entity(2)?,
            None => entity,
        };
        let Some((_, face)) = entity.find_any(&["ADVANCED_FACE", "FACE_SURFACE"]) else {
            return Err(entity.fault("is a kind of face that is not read"));
        };
        // The loops run with what is kept on their left seen from the front of the face, which may be the back of its surface.
        let same_sense = face.flag(3)?;
        let surface = face.entity(2)?;
        let (mut extent, mut loops, mut notes) = (Extent::default(), Vec::new(), Notes::default());
        for bound in face.entities(1)? {
            let Some((_, part)) = bound.find_any(&["FACE_OUTER_BOUND", "FACE_BOUND"]) else {
                return Err(bound.fault("stands where a FACE_BOUND has to"));
            };
            let ring = part.entity(1)?;
            if let Some(pole) = ring.find("VERTEX_LOOP") {
                extent.points.push(self.vertex(pole.entity(1)?)?);
                continue;
            }
            let mut sides = self.sides(ring, surface, &mut notes)?;
            if part.flag(2)? != same_sense {
                turn(&mut sides, |s| s.arc = s.arc.reversed());
            }
            if !sides.is_empty() {
                extent.curves.extend(sides.iter().map(|s| s.arc.curve.clone()));
                loops.push(sides);
            }
        }
        let support = surface::support(surface, self.units, &extent)?;
        let name = match face.text(0) {
            "" | "NONE" => format!("face #{}", entity.id()),
            name => format!("face #{} {name}", entity.id()),
        };
        self.trimmed(entity, name, support, &loops, notes)
    }

    /// The surface with its trims.
    fn trimmed(
        &self,
        entity: Entity<'_>,
        name: String,
        support: Support,
        loops: &[Vec<Side>],
        notes: Notes,
    ) -> Result<Face, Fault> {
        let Support { surface, periodic, is_cut, parameters, kind } = support;
        let Notes { mut short, mut given } = notes;
        let whole = |surface: Surface| SceneSurface::new(name.clone(), surface);
        if loops.is_empty() {
            if is_cut {
                return Err(entity.fault("has no edges, but its surface has no end"));
            }
            return Ok(Face { surface: whole(surface), kind, off: 0.0, moved: 0.0, short, turned: false, given });
        }
        let pull_back = PullBack::new(&surface, periodic);
        let (mut off, mut moved) = (0.0_f64, 0.0_f64);
        let mut rings = Vec::with_capacity(loops.len());
        for sides in loops {
            let mut ring: Vec<TrimCurve> = Vec::with_capacity(sides.len());
            for side in sides {
                let image = match self.given(side, &pull_back, parameters, &mut given) {
                    Some(image) => Ok(image),
                    None => pull_back.curve(&side.arc.curve, self.units.tolerance),
                };
                match image {
                    Ok(image) => {
                        off = off.max(image.off);
                        ring.extend(image.curves.into_iter().map(|curve| TrimCurve { curve, edge: side.edge }));
                    }
                    Err(PullBackError::Point { .. }) => short += 1,
                    Err(error) => return Err(entity.fault(format!("edge #{}: {error}", side.id))),
                }
            }
            moved = moved.max(meet(&surface, periodic, &mut ring)?);
            if !ring.is_empty() {
                rings.push(ring);
            }
        }
        let trimmed = |rings: &[Vec<TrimCurve>]| {
            Trims::oriented(&surface, periodic, rings).map_err(|error| entity.fault(error.to_string()))
        };
        let mut trims = trimmed(&rings)?;
        // A face that keeps what is beyond its loops on a surface that was made for them.
        let turned = is_cut && periodic == [false; 2] && has_border(&trims);
        if turned {
            for ring in &mut rings {
                turn(ring, |c| c.curve = c.curve.reversed());
            }
            trims = trimmed(&rings)?;
            if has_border(&trims) {
                return Err(entity.fault("has loops none of which is round the others"));
            }
        }
        let (surface, trims) = trims.rectangle(&surface).unwrap_or((surface, trims));
        let surface = SceneSurface { trims: Some(trims), ..whole(surface) };
        Ok(Face { surface, kind, off, moved, short, turned, given })
    }

    /// The image of a side that the file gives, if it is where the side is within the tolerance.
    fn given(
        &self,
        side: &Side,
        pull_back: &PullBack<'_>,
        parameters: Parameters,
        notes: &mut Given,
    ) -> Option<PulledBack> {
        let (shape, whole) = side.basis.as_ref()?;
        let curve = &side.arc.curve;
        let ends = curve.domain().map(|t| curve.eval(t));
        let mut apart: Option<Apart> = None;
        for candidate in side.given.iter().flat_map(|given| given.candidates(shape, &side.arc, *whole)) {
            let image = match candidate.image(pull_back, parameters, self.units, ends) {
                Ok(Some(image)) => pull_back.given(&image, curve, self.units.tolerance),
                Ok(None) => continue,
                Err(error) => Err(error),
            };
            match image {
                Ok(image) => return Some(image),
                Err(error) => apart = Some(Apart::of(&error).nearer(apart)),
            }
        }
        notes.apart.extend(apart);
        None
    }

    /// The sides of a loop round a face of a surface, in its order and direction.
    fn sides(&self, ring: Entity<'_>, surface: Entity<'_>, notes: &mut Notes) -> Result<Vec<Side>, Fault> {
        let mut sides = Vec::new();
        if let Some(edges) = ring.find("EDGE_LOOP") {
            for oriented in edges.entities(1)? {
                let Some(part) = oriented.find("ORIENTED_EDGE") else {
                    return Err(oriented.fault("stands where an ORIENTED_EDGE has to"));
                };
                let edge = part.entity(3)?;
                let forward = part.flag(4)?;
                let Some((shape, mut arcs)) = self.edge(edge, &mut notes.short)? else { continue };
                if !forward {
                    Arc::turn(&mut arcs);
                }
                let mut given = match edge.find("EDGE_CURVE") {
                    Some(curve) => {
                        let unread = |fault| notes.given.unread.push(fault);
                        pcurve::on_surface(curve.entity(3)?, surface, self.units, unread)
                    }
                    None => Vec::new(),
                };
                if !forward {
                    given.reverse();
                }
                let number = self.edges.curves.get(&edge.id()).copied();
                let (shape, whole) = (Rc::new(shape), arcs.len() == 1);
                sides.extend(arcs.into_iter().map(|arc| {
                    let basis = Some((Rc::clone(&shape), whole));
                    Side { id: edge.id(), edge: number, arc, basis, given: given.clone() }
                }));
            }
        } else if let Some(polygon) = ring.find("POLY_LOOP") {
            let points = polygon.entities(1)?;
            for k in 0..points.len() {
                let ends = [points[k], points[(k + 1) % points.len()]];
                let [a, b] = [self.units.point(ends[0])?, self.units.point(ends[1])?];
                if a.distance(b) <= self.units.tolerance {
                    notes.short += 1;
                    continue;
                }
                let curve = shape::line(a, b).map_err(|e| polygon.fault(e.to_string()))?;
                let edge = self.edges.sides.get(&side(ends)).copied();
                let arc = Arc { curve, t: [0.0, 1.0] };
                sides.push(Side { id: ends[0].id(), edge, arc, basis: None, given: Vec::new() });
            }
        } else {
            return Err(ring.fault("is a kind of loop that is not read"));
        }
        Ok(sides)
    }

    /// The curve of an edge, and the parts of it from the edge's first vertex to its last; none if it is shorter than the
    /// tolerance.
    fn edge(&self, entity: Entity<'_>, short: &mut usize) -> Result<Option<(curve::Shape, Vec<Arc>)>, Fault> {
        let Some(edge) = entity.find("EDGE_CURVE") else {
            return Err(entity.fault("is a kind of edge that is not read"));
        };
        let vertices = [edge.entity(1)?, edge.entity(2)?];
        let ends = [self.vertex(vertices[0])?, self.vertex(vertices[1])?];
        let closes = vertices[0].id() == vertices[1].id();
        let basis = curve::basis(edge.entity(3)?, self.units)?;
        // Two vertices at one place end a closed edge, or one that is nothing but a point.
        let closes = closes || (ends[0] == ends[1] && basis.shape.is_closed());
        if !closes && ends[0].distance(ends[1]) <= self.units.tolerance && matches!(basis.shape, curve::Shape::Line(..))
        {
            *short += 1;
            return Ok(None);
        }
        let forward = edge.flag(4)? == basis.part.is_none_or(|(_, along)| along);
        let arcs = basis.shape.between(ends, closes, forward).map_err(|problem| entity.fault(problem))?;
        Ok(Some((basis.shape, arcs)))
    }

    /// The point of a vertex.
    fn vertex(&self, entity: Entity<'_>) -> Result<DVec3, Fault> {
        match entity.find("VERTEX_POINT") {
            Some(vertex) => self.units.point(vertex.entity(1)?),
            None => Err(entity.fault("is a kind of vertex that is not read")),
        }
    }
}

/// Runs through a chain of curves the other way.
fn turn<T>(chain: &mut [T], reverse: impl FnMut(&mut T)) {
    chain.reverse();
    chain.iter_mut().for_each(reverse);
}

/// Whether the border of the surface bounds what is kept, where no edge is.
fn has_border(trims: &Trims) -> bool {
    trims.loops().iter().any(|l| l.pieces().iter().all(|p| p.edge().is_none()))
}

/// Along a coordinate, of its range, that of an isoparametric curve changes by no more.
const CONSTANT: f64 = 1e-9;

/// Makes the curves of a loop meet: edges that were given apart end apart by what they were rounded. Isoparametric curves
/// stay such as far as they can. Returns the largest distance in space by which an end was moved.
fn meet(surface: &Surface, periodic: [bool; 2], ring: &mut [TrimCurve]) -> Result<f64, Fault> {
    let (u, v) = (surface.domain_u(), surface.domain_v());
    let range = DVec2::new(u[1] - u[0], v[1] - v[0]);
    let inside = |mut x: DVec2| {
        for (d, domain) in [u, v].into_iter().enumerate() {
            if periodic[d] && !(domain[0]..=domain[1]).contains(&x[d]) {
                x[d] = domain[0] + (x[d] - domain[0]).rem_euclid(range[d]);
            }
        }
        surface.eval(x.x, x.y)
    };
    let mut most = 0.0_f64;
    let count = ring.len();
    for k in 0..count {
        let next = (k + 1) % count;
        let (end, start) = (last(&ring[k].curve), first(&ring[next].curve));
        let mut shift = start - end;
        for d in 0..2 {
            shift[d] = if periodic[d] { (shift[d] / range[d]).round() * range[d] } else { 0.0 };
        }
        let gap = start - end - shift;
        if gap == DVec2::ZERO {
            continue;
        }
        // In a pole the ends may be anywhere; and where they are far apart the loop is open, which its trims say.
        if gap.abs().cmpgt(1e-3 * range).any() {
            continue;
        }
        most = most.max(inside(end).distance(inside(start)));
        let mut joint = 0.5 * (end + start - shift);
        for d in 0..2 {
            match [&ring[k].curve, &ring[next].curve].map(|c| is_constant(c, d, CONSTANT * range[d])) {
                [true, false] => joint[d] = end[d],
                [false, true] => joint[d] = start[d] - shift[d],
                _ => {}
            }
        }
        ring[k].curve = with_end(&ring[k].curve, joint, true)?;
        ring[next].curve = with_end(&ring[next].curve, joint + shift, false)?;
    }
    Ok(most)
}

fn first(curve: &Curve) -> DVec2 {
    curve.homogeneous().first().map_or(DVec2::ZERO, |h| DVec2::new(h.x, h.y) / h.w)
}

fn last(curve: &Curve) -> DVec2 {
    curve.homogeneous().last().map_or(DVec2::ZERO, |h| DVec2::new(h.x, h.y) / h.w)
}

/// Whether a coordinate is constant along a curve.
fn is_constant(curve: &Curve, d: usize, near: f64) -> bool {
    let start = first(curve)[d];
    curve.homogeneous().iter().all(|h| (h[d] / h.w - start).abs() <= near)
}

/// A clamped curve with its last control point, or its first, elsewhere.
fn with_end(curve: &Curve, to: DVec2, at_last: bool) -> Result<Curve, Fault> {
    let mut points = curve.homogeneous().to_vec();
    let at = if at_last { points.last_mut() } else { points.first_mut() };
    if let Some(h) = at {
        *h = (to * h.w).extend(0.0).extend(h.w);
    }
    Curve::from_homogeneous(curve.knots().clone(), points).map_err(|e| Fault::whole(e.to_string()))
}
