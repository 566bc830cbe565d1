//! The models that an example is run on.

use penvis::builtin;
use penvis::model::{self, Model};

/// The named models, or all built-in ones if none is named, each with its name. One that cannot be read is a row of a Markdown table that says why.
pub fn models(mut names: Vec<String>) -> impl Iterator<Item = (String, Model)> {
    if names.is_empty() {
        names = builtin::names().map(|(name, _)| name.to_owned()).collect();
    }
    names.into_iter().filter_map(|name| match model::load(std::slice::from_ref(&name), &model::Reading::new(&())) {
        Ok(model) => Some((name, model)),
        Err(error) => {
            println!("| {name} | {error} |");
            None
        }
    })
}
