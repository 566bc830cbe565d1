//! Models by name or path, one or several.

use std::collections::BTreeMap;
use std::io;
use std::ops::Range;
use std::path::Path;

use glam::DVec3;
use penvis_core::scene::Scene;
use thiserror::Error;

use super::aim::ViewChoice;
use super::fault::ReadError;
use super::format;
use super::import::{Import, Reading, Report};
use super::source::Source;
use super::view::View;
use crate::builtin;
use crate::pens::Pen;
use crate::style::{SheetChoice, StyleChoice};

/// Largest coordinate, and the inverse of the smallest size of a model. Areas of normals, squared, are sixth powers of
/// lengths, and have to stay in the range of f64.
const LARGEST_COORDINATE: f64 = 1e50;

/// What is drawn: the surfaces of one model or several, and the view they are stored with.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Model {
    /// The surfaces, in the order of the models and of their files.
    pub scene: Scene,
    /// The view of the first model that has one.
    pub view: Option<View>,
    /// What that model asks of the view beyond it.
    pub aim: ViewChoice,
    /// What is asked of the drawing of ranges of surfaces; a later one counts where they overlap.
    pub styles: Vec<(Range<usize>, StyleChoice)>,
    /// What the first model that says something about it asks of the sheet.
    pub sheet: SheetChoice,
    /// What models say of pens, by number; the first that describes one is heard.
    pub pens: BTreeMap<u32, Pen>,
    /// The files, in the order of their surfaces; one that refers to others goes before them.
    pub files: Vec<ModelFile>,
}

/// A file that models come from.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelFile {
    /// The file.
    pub file: String,
    /// Name of its format.
    pub format: &'static str,
    /// The surfaces that come from it, by their indices in the scene; of the first copy where a scene repeats them.
    pub surfaces: Range<usize>,
    /// What its reader has to say.
    pub report: Report,
}

impl Model {
    /// What is asked of the drawing of each surface.
    #[must_use]
    pub fn choices(&self) -> Vec<StyleChoice> {
        let mut choices = vec![StyleChoice::default(); self.scene.surfaces.len()];
        for (range, choice) in &self.styles {
            if let Some(own) = choices.get_mut(range.clone()) {
                own.fill(*choice);
            }
        }
        choices
    }
}

/// Why a model is not there.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ModelError {
    /// Neither a built-in model nor a file.
    #[error(
        "there is no file `{spec}` and no built-in model of that name; `penvis info --list` lists the built-in models"
    )]
    Unknown {
        /// What was asked for.
        spec: String,
    },
    /// A kind of file that is not read.
    #[error("{file}: is none of the formats that models are read from: {}; convert it", format::formats())]
    Kind {
        /// The file.
        file: String,
    },
    /// The system does not let it be opened.
    #[error("cannot read {file}: {source}")]
    Open {
        /// The file.
        file: String,
        /// What the system said.
        source: io::Error,
    },
    /// It was asked to stop.
    #[error("{file}: reading was stopped")]
    Stopped {
        /// The file.
        file: String,
    },
    /// Coordinates that the geometry cannot be computed with.
    #[error(
        "{file}: surface {surface} has a coordinate of {value:e}; scale the model so that none exceeds {LARGEST_COORDINATE:e}"
    )]
    Huge {
        /// The file.
        file: String,
        /// Index of the surface.
        surface: usize,
        /// The coordinate.
        value: f64,
    },
    /// A model that the geometry cannot be computed with.
    #[error("{file}: is only {size:e} wide; scale the model up")]
    Tiny {
        /// The file.
        file: String,
        /// Longest side of its box.
        size: f64,
    },
    /// It cannot be read.
    #[error("{file}: {source}")]
    Read {
        /// The file.
        file: String,
        /// What is wrong, and where.
        source: ReadError,
    },
}

/// Loads models and joins them into one scene, named after all of them.
///
/// A bare word is a built-in model first and a file second; anything with a dot or a separator is a file.
///
/// # Errors
/// The first [`ModelError`].
pub fn load(specs: &[String], reading: &Reading<'_>) -> Result<Model, ModelError> {
    let mut joined = Model::default();
    let (mut names, mut scenes, mut before) = (Vec::new(), Vec::new(), 0);
    for spec in specs {
        let model = load_one(spec, reading)?;
        let shifted = |r: Range<usize>| before + r.start..before + r.end;
        let moved = |f: ModelFile| ModelFile { surfaces: shifted(f.surfaces.clone()), ..f };
        joined.files.extend(model.files.into_iter().map(moved));
        if joined.view.is_none() && joined.aim == ViewChoice::default() {
            (joined.view, joined.aim) = (model.view, model.aim);
        }
        joined.styles.extend(model.styles.into_iter().map(|(range, style)| (shifted(range), style)));
        joined.sheet = joined.sheet.or(&model.sheet);
        for (number, pen) in model.pens {
            joined.pens.entry(number).or_insert(pen);
        }
        before += model.scene.surfaces.len();
        names.push(model.scene.name.clone());
        scenes.push(model.scene);
    }
    joined.scene = Scene::joined(names.join(" + "), scenes);
    Ok(joined)
}

fn load_one(spec: &str, reading: &Reading<'_>) -> Result<Model, ModelError> {
    if let Some(model) = built_in(spec) {
        return Ok(model);
    }
    load_file(Path::new(spec), reading)
}

/// The built-in model of this name, if it is one and not a path.
pub(super) fn built_in(spec: &str) -> Option<Model> {
    if spec.contains(['.', '/', '\\']) {
        return None;
    }
    let model = builtin::load(spec)?;
    Some(Model { scene: model.scene, view: Some(model.view), ..Model::default() })
}

/// Loads the model in a file.
///
/// # Errors
/// If it is not there or cannot be read.
pub(super) fn load_file(path: &Path, reading: &Reading<'_>) -> Result<Model, ModelError> {
    let file = path.to_string_lossy().into_owned();
    if !path.exists() {
        return Err(ModelError::Unknown { spec: file });
    }
    let mut source = Source::open(path).map_err(|source| ModelError::Open { file: file.clone(), source })?;
    let Some(format) = format::format_of(&source, path) else {
        return Err(ModelError::Kind { file });
    };
    let import = format.read(&mut source, reading).map_err(|source| match source {
        ReadError::Stopped => ModelError::Stopped { file: file.clone() },
        source => ModelError::Read { file: file.clone(), source },
    })?;
    check_size(&import.scene, &file)?;
    let Import { scene, view, aim, styles, sheet, pens, files: others, report } = import;
    let mut files = vec![ModelFile { file, format: format.name, surfaces: 0..scene.surfaces.len(), report }];
    files.extend(others);
    Ok(Model { scene, view, aim, styles, sheet, pens, files })
}

/// Refuses sizes whose powers overflow or vanish.
fn check_size(scene: &Scene, file: &str) -> Result<(), ModelError> {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for (surface, part) in scene.surfaces.iter().enumerate() {
        for h in part.surface.homogeneous() {
            let p = h.truncate() / h.w;
            let value = p.abs().max_element();
            // Written so that what is not a number is refused too.
            if !p.abs().cmple(DVec3::splat(LARGEST_COORDINATE)).all() {
                return Err(ModelError::Huge { file: file.to_owned(), surface, value });
            }
            (low, high) = (low.min(p), high.max(p));
        }
    }
    let size = (high - low).max_element();
    if size > 0.0 && size < LARGEST_COORDINATE.recip() {
        return Err(ModelError::Tiny { file: file.to_owned(), size });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(spec: &str) -> String {
        load(&[spec.to_owned()], &Reading::new(&())).unwrap_err().to_string()
    }

    #[test]
    fn several_models_are_one_scene() {
        let load = |specs: &[&str]| {
            let specs: Vec<String> = specs.iter().map(|&s| s.to_owned()).collect();
            super::load(&specs, &Reading::new(&())).unwrap()
        };
        let both = load(&["saddle", "Teapot"]);
        let (saddle, teapot) = (load(&["saddle"]), load(&["teapot"]));
        assert_eq!(both.scene.name, "saddle + teapot");
        assert_eq!(both.scene.surfaces.len(), saddle.scene.surfaces.len() + 32);
        assert_eq!(both.scene.surfaces.last(), teapot.scene.surfaces.last());
        assert_eq!(both.view, saddle.view);
    }

    #[test]
    fn what_is_no_model_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
        std::fs::write(path("a.txt"), "to whom it may concern").unwrap();
        std::fs::write(path("a.json"), "{\"surfaces\": 3}").unwrap();
        for (name, x) in [("huge.json", "1e51"), ("tiny.json", "1e-51")] {
            let text = format!(
                r#"{{"surfaces": [{{"degree_u": 1, "degree_v": 1, "knots_u": [0, 0, 1, 1], "knots_v": [0, 0, 1, 1],
                "control_points": [[[0, 0, 0, 1], [0, {x}, 0, 1]], [[0, 0, 0, 1], [0, {x}, 0, 1]]]}}]}}"#
            );
            std::fs::write(path(name), text).unwrap();
        }
        assert!(message("no-such-model").contains("info --list"));
        assert!(message(&path("b.json")).contains("no file"));
        assert!(message(&path("a.txt")).contains("surface JSON (.json)"));
        assert!(message(folder.path().to_str().unwrap()).contains("cannot read"));
        assert!(message(&path("huge.json")).contains("surface 0 has a coordinate of 1e51; scale"));
        assert!(message(&path("tiny.json")).contains("only 1e-51 wide"));
        let found = message(&path("a.json"));
        assert!(found.contains("a.json: surfaces: invalid type"), "{found}");
    }
}
