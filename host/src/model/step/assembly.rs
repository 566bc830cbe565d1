//! Which bodies a file has, and where they stand.
//!
//! A representation is a list of items in one system of coordinates and units. Representations that are related without a
//! transformation are one. One that is related to another with a transformation, or mapped into it, stands in it as a
//! component, as often as that is so.

use std::collections::{BTreeMap, BTreeSet};

use glam::DMat4;

use super::super::fault::Fault;
use super::exchange::{Entity, Exchange};
use super::units::Units;

/// Representations whose items are bodies.
const SHAPES: &[&str] = &[
    "SHAPE_REPRESENTATION",
    "ADVANCED_BREP_SHAPE_REPRESENTATION",
    "FACETED_BREP_SHAPE_REPRESENTATION",
    "MANIFOLD_SURFACE_SHAPE_REPRESENTATION",
    "NON_MANIFOLD_SURFACE_SHAPE_REPRESENTATION",
    "ELEMENTARY_BREP_SHAPE_REPRESENTATION",
    "GEOMETRICALLY_BOUNDED_SURFACE_SHAPE_REPRESENTATION",
    "GEOMETRICALLY_BOUNDED_WIREFRAME_SHAPE_REPRESENTATION",
    "EDGE_BASED_WIREFRAME_SHAPE_REPRESENTATION",
    "SHELL_BASED_WIREFRAME_SHAPE_REPRESENTATION",
    "CSG_SHAPE_REPRESENTATION",
    "COMPOUND_SHAPE_REPRESENTATION",
    "TESSELLATED_SHAPE_REPRESENTATION",
];

/// Most components in one another.
const MAX_DEPTH: usize = 64;

/// Most bodies, and most places of components: a file of a few lines can ask for any number of them.
const MOST_BODIES: usize = 1 << 18;

/// A body: an item of a representation.
#[derive(Clone)]
pub(super) struct Body<'a> {
    pub(super) item: Entity<'a>,
    /// Index of its units.
    pub(super) units: usize,
}

/// The bodies of a file and where they stand.
#[derive(Default)]
pub(super) struct Assembly<'a> {
    pub(super) bodies: Vec<Body<'a>>,
    /// Indices of bodies, and their places, in millimetres.
    pub(super) placed: Vec<(usize, DMat4)>,
    pub(super) units: Vec<Units>,
}

/// One representation, or several that are one.
#[derive(Default)]
struct Group {
    bodies: Vec<usize>,
    components: Vec<(u64, DMat4)>,
    is_component: bool,
}

/// Representations that are one, by the numbers of their entities.
#[derive(Default)]
struct Same(BTreeMap<u64, u64>);

impl Same {
    fn of(&self, id: u64) -> u64 {
        let mut id = id;
        while let Some(&other) = self.0.get(&id).filter(|&&other| other != id) {
            id = other;
        }
        id
    }

    fn join(&mut self, a: u64, b: u64) {
        let (a, b) = (self.of(a), self.of(b));
        // To the lower one, so that chains end.
        self.0.insert(a.max(b), a.min(b));
    }
}

impl<'a> Assembly<'a> {
    /// Of a file.
    ///
    /// # Errors
    /// If a representation, a relation or a unit is wrong, or components go on in one another.
    pub(super) fn of(file: &'a Exchange) -> Result<Self, Fault> {
        let mut own = Self::default();
        let mut contexts = BTreeMap::new();
        let mut same = Same::default();
        let shapes: Vec<Entity<'a>> = file.entities().filter(|e| e.find_any(SHAPES).is_some()).collect();
        let is_shape: BTreeSet<u64> = shapes.iter().map(|e| e.id()).collect();
        let mut placements = Vec::new();
        for entity in file.entities() {
            let Some(relation) = entity.find_any(&["REPRESENTATION_RELATIONSHIP", "SHAPE_REPRESENTATION_RELATIONSHIP"])
            else {
                continue;
            };
            let relation = relation.1;
            let ends = [relation.entity(2)?, relation.entity(3)?];
            if ends.iter().any(|e| !is_shape.contains(&e.id())) {
                continue;
            }
            match entity.find("REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION") {
                Some(with) => placements.push((entity, ends, with.entity(0)?)),
                None => same.join(ends[0].id(), ends[1].id()),
            }
        }
        let mut groups: BTreeMap<u64, Group> = BTreeMap::new();
        for &shape in &shapes {
            let units = own.units_of(shape, &mut contexts)?;
            let group = same.of(shape.id());
            groups.entry(group).or_default();
            let Some((_, representation)) = shape.find_any(&["REPRESENTATION"]).or_else(|| shape.find_any(SHAPES))
            else {
                continue;
            };
            for item in representation.entities(1)? {
                if let Some(mapped) = item.find("MAPPED_ITEM") {
                    let (component, map) = own.mapped(mapped.entity(1)?, mapped.entity(2)?, units, &mut contexts)?;
                    let component = same.of(component);
                    groups.entry(component).or_default().is_component = true;
                    groups.entry(group).or_default().components.push((component, map));
                } else if is_frame(item) {
                    // A place that others refer to.
                } else if own.bodies.len() < MOST_BODIES {
                    groups.entry(group).or_default().bodies.push(own.bodies.len());
                    own.bodies.push(Body { item, units });
                } else {
                    return Err(too_many(item));
                }
            }
        }
        let children = children(file);
        for (entity, ends, operator) in placements {
            let swap = is_swapped(entity, ends, operator, &children);
            let [child, parent] = if swap { [ends[1], ends[0]] } else { ends };
            let units = [own.units_of(child, &mut contexts)?, own.units_of(parent, &mut contexts)?];
            let map = own.transformation(operator, ends.map(Entity::id), child.id(), units)?;
            let (child, parent) = (same.of(child.id()), same.of(parent.id()));
            groups.entry(child).or_default().is_component = true;
            groups.entry(parent).or_default().components.push((child, map));
        }
        own.place(&groups)?;
        Ok(own)
    }

    /// Index of the units of a representation.
    fn units_of(&mut self, shape: Entity<'a>, contexts: &mut BTreeMap<u64, usize>) -> Result<usize, Fault> {
        let Some((_, representation)) = shape.find_any(&["REPRESENTATION"]).or_else(|| shape.find_any(SHAPES)) else {
            return Err(shape.fault("is no representation of a shape that is known"));
        };
        let context = representation.entity(2)?;
        if let Some(&index) = contexts.get(&context.id()) {
            return Ok(index);
        }
        let units = Units::of(context)?;
        let index = self.units.iter().position(|u| *u == units).unwrap_or(self.units.len());
        if index == self.units.len() {
            self.units.push(units);
        }
        contexts.insert(context.id(), index);
        Ok(index)
    }

    /// The representation that a map maps, and to where.
    fn mapped(
        &mut self,
        source: Entity<'a>,
        target: Entity<'a>,
        units: usize,
        contexts: &mut BTreeMap<u64, usize>,
    ) -> Result<(u64, DMat4), Fault> {
        let Some(map) = source.find("REPRESENTATION_MAP") else {
            return Err(source.fault("stands where a REPRESENTATION_MAP has to"));
        };
        let shape = map.entity(1)?;
        let inner = self.units_of(shape, contexts)?;
        let from = self.units[inner].placement(map.entity(0)?)?;
        let to = self.units[units].placement(target)?;
        Ok((shape.id(), to * from.inverse()))
    }

    /// The map of a component into what it is a component of.
    fn transformation(
        &self,
        operator: Entity<'a>,
        ends: [u64; 2],
        child: u64,
        [inner, outer]: [usize; 2],
    ) -> Result<DMat4, Fault> {
        let Some(defined) = operator.find("ITEM_DEFINED_TRANSFORMATION") else {
            // A transformation that is no pair of placements maps the component as it is.
            return self.units[outer].placement(operator);
        };
        let items = [defined.entity(2)?, defined.entity(3)?];
        // The first item is one of the first representation.
        let [from, to] = if ends[0] == child { items } else { [items[1], items[0]] };
        Ok(self.units[outer].placement(to)? * self.units[inner].placement(from)?.inverse())
    }

    /// Places the bodies of all groups that are no component, and of their components.
    fn place(&mut self, groups: &BTreeMap<u64, Group>) -> Result<(), Fault> {
        let roots: Vec<u64> = groups.iter().filter(|(_, g)| !g.is_component).map(|(&id, _)| id).collect();
        if roots.is_empty() && !groups.is_empty() {
            return Err(Fault::whole("has components that are all part of one another; export it anew"));
        }
        let mut todo: Vec<(u64, DMat4, usize)> = roots.into_iter().rev().map(|id| (id, DMat4::IDENTITY, 0)).collect();
        let mut visits = 0;
        while let Some((id, map, depth)) = todo.pop() {
            visits += 1;
            let Some(group) = groups.get(&id) else { continue };
            if depth == MAX_DEPTH {
                let problem = format!("is a component {MAX_DEPTH} deep, or of itself; export the file anew");
                return Err(Fault::at(format!("#{id}"), problem));
            }
            if self.placed.len() + group.bodies.len() > MOST_BODIES || visits + todo.len() > MOST_BODIES {
                let problem = format!("asks for more than {MOST_BODIES} bodies; draw a part of it");
                return Err(Fault::at(format!("#{id}"), problem));
            }
            self.placed.extend(group.bodies.iter().map(|&body| (body, map)));
            todo.extend(group.components.iter().rev().map(|&(inner, own)| (inner, map * own, depth + 1)));
        }
        Ok(())
    }
}

fn too_many(item: Entity<'_>) -> Fault {
    item.fault(format!("is one of more than {MOST_BODIES} bodies; draw a part of the file"))
}

/// Whether an item is but a place.
fn is_frame(item: Entity<'_>) -> bool {
    item.find_any(&["AXIS2_PLACEMENT_3D", "AXIS1_PLACEMENT", "AXIS2_PLACEMENT_2D", "PLACEMENT"]).is_some()
}

/// The representations of the products that are components, by the entities that relate representations: for each the
/// representations of the component.
fn children(file: &Exchange) -> BTreeMap<u64, BTreeSet<u64>> {
    // Representations by the definition of the product that they are of.
    let mut of: BTreeMap<u64, BTreeSet<u64>> = BTreeMap::new();
    for shape in file.all("SHAPE_DEFINITION_REPRESENTATION") {
        let (Ok(property), Ok(representation)) = (shape.entity(0), shape.entity(1)) else { continue };
        let definition = property.find("PRODUCT_DEFINITION_SHAPE").and_then(|p| p.entity(2).ok());
        if let Some(definition) = definition {
            of.entry(definition.id()).or_default().insert(representation.id());
        }
    }
    let mut children = BTreeMap::new();
    for placed in file.all("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION") {
        let (Ok(relation), Ok(property)) = (placed.entity(0), placed.entity(1)) else { continue };
        let usage = property.find("PRODUCT_DEFINITION_SHAPE").and_then(|p| p.entity(2).ok());
        let component = usage.and_then(|u| u.find("NEXT_ASSEMBLY_USAGE_OCCURRENCE")).and_then(|u| u.entity(4).ok());
        if let Some(shapes) = component.and_then(|c| of.get(&c.id())) {
            children.insert(relation.id(), shapes.clone());
        }
    }
    children
}

/// Whether the second representation of a relation is the component, and not the first, which is how it should be: as the
/// products say, or else as the placements do.
fn is_swapped(
    relation: Entity<'_>,
    ends: [Entity<'_>; 2],
    operator: Entity<'_>,
    children: &BTreeMap<u64, BTreeSet<u64>>,
) -> bool {
    if let Some(shapes) = children.get(&relation.id()) {
        match ends.map(|e| shapes.contains(&e.id())) {
            [true, false] => return false,
            [false, true] => return true,
            _ => {}
        }
    }
    // The first placement stands in the component.
    let Some(first) = operator.find("ITEM_DEFINED_TRANSFORMATION").and_then(|o| o.entity(2).ok()) else { return false };
    let holds = |shape: Entity<'_>| {
        let part = shape.find_any(SHAPES).map(|(_, part)| part);
        part.and_then(|p| p.entities(1).ok()).is_some_and(|items| items.iter().any(|i| i.id() == first.id()))
    };
    !holds(ends[0]) && holds(ends[1])
}
