//! Objects of a scene: what they are, where they stand and how they are drawn.

use penvis_core::extract::CurveSet;

use super::keys::{Item, Table};
use super::place::{PLACEMENT, Placement};
use super::shape::{self, Faces, SHAPES};
use super::surfaces::Named;
use crate::fill::{FillChoice, choice};
use crate::model::fault::Fault;
use crate::page::KindPens;
use crate::style::{self, MOST_ISOS, MOST_PENS, StyleChoice};

/// Keys of how an object is drawn.
pub(super) const STYLE: [&str; 6] = ["pen", "curves", "iso", "hidden", "fill", "crease_angle"];

/// Keys of a fill.
const FILL: [&str; 5] = ["kind", "angle", "pitch", "gap", "direction"];

/// What an object is.
pub(super) enum Body<'t> {
    /// A built-in model or a file, by its name.
    Model(&'t str),
    /// A shape by its measures.
    Shape(Faces),
}

/// An object as the file describes it.
pub(super) struct Object<'t> {
    /// Its name, if it has one.
    pub(super) name: Option<&'t str>,
    pub(super) body: Body<'t>,
    /// The line of the body.
    pub(super) line: usize,
    pub(super) placement: Placement,
    /// How it is drawn.
    pub(super) look: Look,
    /// How surfaces of it are drawn otherwise.
    pub(super) surfaces: Vec<Named<'t>>,
}

/// How something is drawn, as far as the file says.
#[derive(Clone, Copy, Default)]
pub(super) struct Look {
    pub(super) style: StyleChoice,
    /// Largest angle between facets of a mesh that stand for one smooth surface, in radians.
    pub(super) crease_angle: Option<f64>,
}

impl<'t> Object<'t> {
    /// What a table says.
    ///
    /// # Errors
    /// If it has an unknown key, no body or several, or a value that makes no sense.
    pub(super) fn new(item: &Item<'t>) -> Result<Self, Fault> {
        let known: Vec<&str> = ["name", "model"]
            .iter()
            .chain(&SHAPES)
            .chain(&PLACEMENT)
            .chain(&STYLE)
            .chain(&["surface"])
            .copied()
            .collect();
        let table = item.table("an object", &known)?;
        let name = table.get("name").map(|item| item.text()).transpose()?;
        let (body, line) = body(&table)?;
        let (placement, look) = (Placement::new(&table)?, Look::new(&table)?);
        let surfaces = table.get("surface").map(|item| Named::all(&item)).transpose()?.unwrap_or_default();
        Ok(Self { name, body, line, placement, look, surfaces })
    }
}

fn body<'t>(table: &Table<'t>) -> Result<(Body<'t>, usize), Fault> {
    let mut bodies = ["model"].into_iter().chain(SHAPES).filter_map(|key| table.get(key));
    let Some(first) = bodies.next() else {
        return Err(table.fault(format!("the object is nothing; give it a model, or one of {}", SHAPES.join(", "))));
    };
    if let Some(second) = bodies.next() {
        return Err(second
            .fault(format!("is one too many, for the object has a `{}`; make it an object of its own", first.key)));
    }
    let body = if first.key == "model" { Body::Model(first.text()?) } else { Body::Shape(shape::faces(&first)?) };
    Ok((body, first.line))
}

impl Look {
    /// What the keys of a table say.
    ///
    /// # Errors
    /// If one of them makes no sense.
    pub(super) fn new(table: &Table<'_>) -> Result<Self, Fault> {
        let pens = table.get("pen").map(|item| pens(&item)).transpose()?.unwrap_or_default();
        let curves = table.get("curves").map(|item| curves(&item)).transpose()?;
        let isos = table.get("iso").map(|item| item.whole(0, MOST_ISOS)).transpose()?;
        let hidden = table.get("hidden").map(|item| style::hidden(item.text()?).map_err(|problem| item.fault(problem)));
        let angle = table.get("crease_angle");
        let angle =
            angle.map(|item| item.number_that(|a| (0.0..=180.0).contains(&a), "an angle from 0 to 180 degrees"));
        let fill = table.get("fill").map(|item| fill(&item)).transpose()?.unwrap_or_default();
        let style = StyleChoice { curves, isos, pens, hidden: hidden.transpose()?, fill };
        Ok(Self { style, crease_angle: angle.transpose()?.map(f64::to_radians) })
    }
}

/// One pen for all that is visible, or a table of pens by kind.
fn pens(item: &Item<'_>) -> Result<KindPens, Fault> {
    if !item.is_table() {
        return item.whole(1, MOST_PENS).map(KindPens::all);
    }
    let table = item.table("`pen`", &style::pen_names())?;
    let given = style::pen_names().into_iter().filter_map(|name| Some((name, table.get(name)?)));
    let mut pens = KindPens::default();
    for (name, item) in given {
        let pen = item.whole(1, MOST_PENS)?;
        pens = style::with_pen(pens, name, pen).map_err(|problem| item.fault(problem))?;
    }
    Ok(pens)
}

/// The name of a kind of fill, or a table of what is asked of it.
fn fill(item: &Item<'_>) -> Result<FillChoice, Fault> {
    let kind = |item: &Item<'_>| choice::kind(item.text()?).map_err(|problem| item.fault(problem));
    if !item.is_table() {
        return Ok(FillChoice { kind: Some(kind(item)?), ..FillChoice::default() });
    }
    let table = item.table("`fill`", &FILL)?;
    let number = |key, holds: fn(f64) -> bool, wanted: &str| {
        table.get(key).map(|item| item.number_that(holds, wanted)).transpose()
    };
    let direction = table.get("direction");
    let direction = direction.map(|item| choice::direction(item.text()?).map_err(|problem| item.fault(problem)));
    Ok(FillChoice {
        kind: table.get("kind").map(|item| kind(&item)).transpose()?,
        degrees: number("angle", choice::is_angle, choice::AN_ANGLE)?,
        pitch_mm: number("pitch", choice::is_pitch, choice::A_PITCH)?,
        gap_mm: number("gap", choice::is_gap, choice::A_GAP)?,
        direction: direction.transpose()?,
    })
}

/// Kinds of curve: a list of texts, or one text with commas as on the command line.
fn curves(item: &Item<'_>) -> Result<CurveSet, Fault> {
    let kinds = if item.is_list() {
        let words: Vec<&str> = item.items()?.iter().map(Item::text).collect::<Result<_, _>>()?;
        style::kinds(words)
    } else {
        style::kinds(item.text()?.split(',').map(str::trim).filter(|word| !word.is_empty()))
    };
    kinds.map_err(|problem| item.fault(format!("asks for a kind that is none: {problem}")))
}
