//! Models by name or path, one or several.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use glam::DVec3;
use penvis_core::scene::Scene;
use thiserror::Error;

use super::surface_json::{self, Fault};
use super::view::View;
use crate::builtin;

/// Largest model file in bytes, so that a wrong path (a device, a disk image) does not fill the memory.
const LARGEST_FILE: u64 = 1 << 30;

/// Largest coordinate, and the inverse of the smallest size of a model. Areas of normals, squared, are sixth powers of
/// lengths, and have to stay in the range of f64.
const LARGEST_COORDINATE: f64 = 1e50;

/// What is drawn: the surfaces of one model or several, and the view they are stored with.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// The surfaces, in the order of the models and of their files.
    pub scene: Scene,
    /// The view of the first model that has one.
    pub view: Option<View>,
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
    #[error("{file}: models are read from surface JSON (.json) only; convert it")]
    Kind {
        /// The file.
        file: String,
    },
    /// The system does not let it be read.
    #[error("cannot read {file}: {source}")]
    Read {
        /// The file.
        file: String,
        /// What the system said.
        source: io::Error,
    },
    /// Too much to be a model.
    #[error("{file}: is larger than {} MiB, too large for a model; check the path", LARGEST_FILE >> 20)]
    TooLarge {
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
    /// The contents are wrong.
    #[error("{file}: {fault}")]
    Fault {
        /// The file.
        file: String,
        /// What and where.
        fault: Fault,
    },
}

/// Loads models and joins them into one scene, named after all of them.
///
/// A bare word is a built-in model first and a file second; anything with a dot or a separator is a file.
///
/// # Errors
/// The first [`ModelError`].
pub fn load(specs: &[String]) -> Result<Model, ModelError> {
    let mut joined = Model { scene: Scene::default(), view: None };
    for spec in specs {
        let model = load_one(spec)?;
        if !joined.scene.name.is_empty() {
            joined.scene.name.push_str(" + ");
        }
        joined.scene.name.push_str(&model.scene.name);
        joined.scene.surfaces.extend(model.scene.surfaces);
        joined.view = joined.view.or(model.view);
    }
    Ok(joined)
}

fn load_one(spec: &str) -> Result<Model, ModelError> {
    let bare = !spec.contains(['.', '/', '\\']);
    if bare && let Some(model) = builtin::load(spec) {
        return Ok(Model { scene: model.scene, view: Some(model.view) });
    }
    let path = Path::new(spec);
    if !path.exists() {
        return Err(ModelError::Unknown { spec: spec.to_owned() });
    }
    let file = || spec.to_owned();
    if path.is_file() && !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
        return Err(ModelError::Kind { file: file() });
    }
    let bytes = read(path).map_err(|source| ModelError::Read { file: file(), source })?;
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(ModelError::TooLarge { file: file() });
    }
    let stem = path.file_stem().map_or_else(|| spec.to_owned(), |stem| stem.to_string_lossy().into_owned());
    let (scene, view) = surface_json::read(&bytes, &stem).map_err(|fault| ModelError::Fault { file: file(), fault })?;
    check_size(&scene, spec)?;
    Ok(Model { scene, view })
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

/// The bytes of a file, and one more than the limit at most.
fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(LARGEST_FILE + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn message(spec: &str) -> String {
        load(&[spec.to_owned()]).unwrap_err().to_string()
    }

    #[test]
    fn several_models_are_one_scene() {
        let both = load(&["saddle".into(), "Teapot".into()]).unwrap();
        let (saddle, teapot) = (load(&["saddle".into()]).unwrap(), load(&["teapot".into()]).unwrap());
        assert_eq!(both.scene.name, "saddle + teapot");
        assert_eq!(both.scene.surfaces.len(), saddle.scene.surfaces.len() + 32);
        assert_eq!(both.scene.surfaces.last(), teapot.scene.surfaces.last());
        assert_eq!(both.view, saddle.view);
    }

    #[test]
    fn what_is_no_model_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
        std::fs::write(path("a.step"), "ISO-10303-21;").unwrap();
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
        assert!(message(&path("a.step")).contains("surface JSON"));
        assert!(message(folder.path().to_str().unwrap()).contains("cannot read"));
        assert!(message(&path("huge.json")).contains("surface 0 has a coordinate of 1e51; scale"));
        assert!(message(&path("tiny.json")).contains("only 1e-51 wide"));
        let found = message(&path("a.json"));
        assert!(found.contains("a.json: surfaces: invalid type"), "{found}");
    }
}
