//! Surfaces of an object that are drawn otherwise than the object, by their names.

use penvis_core::scene::SceneSurface;

use super::keys::Item;
use super::object::{Look, STYLE};
use crate::model::fault::Fault;
use crate::model::text::shown;
use crate::style::StyleChoice;

/// The key of a surface that says nothing of it: angles between facets make surfaces, and do not belong to one.
const NOT_OF_A_SURFACE: &str = "crease_angle";

/// Most names in a message.
const MOST_NAMES: usize = 8;

/// What is said of the surfaces with a name.
pub(super) struct Named<'t> {
    name: &'t str,
    /// Where it is said.
    line: usize,
    style: StyleChoice,
}

impl<'t> Named<'t> {
    /// What a table says, whose keys are names.
    ///
    /// # Errors
    /// If it is none, or what it says of one makes no sense.
    pub(super) fn all(item: &Item<'t>) -> Result<Vec<Self>, Fault> {
        let known: Vec<&str> = STYLE.into_iter().filter(|key| *key != NOT_OF_A_SURFACE).collect();
        let named = |own: &Item<'t>| {
            let look = Look::new(&own.table("a surface", &known)?)?;
            Ok(Self { name: own.key, line: own.line, style: look.style })
        };
        item.entries("a table of surfaces by their names")?.iter().map(named).collect()
    }
}

/// What is said of each of an object's surfaces; nothing of those that are not named. Of several with one name it is said of all.
///
/// # Errors
/// If a name is none of theirs.
pub(super) fn choices(named: &[Named<'_>], surfaces: &[SceneSurface]) -> Result<Vec<StyleChoice>, Fault> {
    let mut choices = vec![StyleChoice::default(); surfaces.len()];
    for Named { name, line, style } in named {
        let mut found = false;
        for (choice, _) in choices.iter_mut().zip(surfaces).filter(|(_, surface)| surface.name == *name) {
            (*choice, found) = (*style, true);
        }
        if !found {
            return Err(Fault::line(*line, unknown(name, surfaces)));
        }
    }
    Ok(choices)
}

/// What is wrong with a name that none of these surfaces has.
fn unknown(name: &str, surfaces: &[SceneSurface]) -> String {
    // A name may be as long as the file; its beginning says what was meant.
    let name = shown(name);
    let distance = |other: &&str| strsim::damerau_levenshtein(&name, other);
    let mut names: Vec<&str> = Vec::new();
    // Names of a model are counted in its order, and those that follow one another are often the same.
    let mut seen = std::collections::HashSet::new();
    names.extend(surfaces.iter().map(|surface| surface.name.as_str()).filter(|name| seen.insert(*name)));
    let nearest = shown(names.iter().min_by_key(|other| distance(other)).copied().unwrap_or_default());
    let mut told: Vec<String> = names.iter().take(MOST_NAMES).map(|name| shown(name)).collect();
    if names.len() > MOST_NAMES {
        told.push(format!("and {} more", names.len() - MOST_NAMES));
    }
    format!(
        "`surface`: the object has no surface `{name}`; the nearest name is `{nearest}`, and all are {}",
        told.join(", ")
    )
}
