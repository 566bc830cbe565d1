//! Objects become surfaces of one scene.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use penvis_core::scene::{Scene, SceneSurface};

use super::object::{Body, Look, Object};
use super::shape::Faces;
use super::surfaces;
use crate::builtin;
use crate::model::fault::{Fault, ReadError};
use crate::model::import::{MOST_POINTS, Reading, Report};
use crate::model::load::{self, Model, ModelError, ModelFile};
use crate::model::source::Source;
use crate::style::StyleChoice;

/// Most surfaces of a scene, all copies counted.
const MOST_SURFACES: u64 = 1 << 20;

/// How often it is told how far the copying is, in copies.
const PROGRESS_STEP: u64 = 1 << 12;

/// A scene as far as it is put together.
pub(super) struct Assembly<'a> {
    /// The folder from which paths count; none for a scene that is in no file.
    folder: Option<PathBuf>,
    /// For the files that are read because of this one.
    reading: Reading<'a>,
    /// How objects are drawn that do not say otherwise.
    common: Look,
    done: Assembled,
    surfaces: u64,
    points: u64,
    /// Files that were read, by path and by the bits of the crease angle.
    models: BTreeMap<(PathBuf, Option<u64>), Rc<Model>>,
}

/// What objects have become.
#[derive(Default)]
pub(super) struct Assembled {
    /// One for each copy of each object.
    pub(super) scenes: Vec<Scene>,
    /// How ranges of their surfaces are drawn.
    pub(super) styles: Vec<(Range<usize>, StyleChoice)>,
    /// The files of models; those of the first copy where there are several.
    pub(super) files: Vec<ModelFile>,
    /// Kinds of surfaces of shapes and built-in models.
    pub(super) report: Report,
}

impl<'a> Assembly<'a> {
    /// Nothing yet.
    ///
    /// # Errors
    /// If the file is read because of itself.
    pub(super) fn new(source: &Source, reading: &Reading<'a>, common: Look) -> Result<Self, Fault> {
        let reading = match source.path() {
            Some(path) => reading.within(path)?,
            None => reading.clone(),
        };
        let folder = source.path().map(|path| path.parent().unwrap_or(Path::new("")).to_owned());
        // An object's own angle goes before those of a scene that it is; that of all objects does not.
        let reading = reading.or_usual_crease_angle(common.crease_angle);
        let (done, models) = (Assembled::default(), BTreeMap::new());
        Ok(Self { folder, reading, common, done, surfaces: 0, points: 0, models })
    }

    /// Adds all copies of an object.
    ///
    /// # Errors
    /// If its model cannot be read, a surface cannot stand where it is put, or there are too many.
    pub(super) fn add(&mut self, object: Object<'_>) -> Result<(), ReadError> {
        let Object { name, body, line, placement, look, surfaces } = object;
        let (model, kinds) = match body {
            Body::Shape(faces) => shape(faces),
            Body::Model(spec) => self.model(spec, line, look.crease_angle)?,
        };
        let (count, members) = (placement.count(), &model.scene.surfaces);
        let points: u64 = members.iter().map(|s| s.surface.homogeneous().len() as u64).sum();
        // Counts are at most 2^60, and what they are multiplied by fits in memory.
        self.surfaces = self.surfaces.saturating_add(count.saturating_mul(members.len() as u64));
        self.points = self.points.saturating_add(count.saturating_mul(points));
        if self.surfaces > MOST_SURFACES || self.points > MOST_POINTS as u64 {
            let problem = format!(
                "with {count} of this the scene has {} surfaces of {} control points; no pen can draw more than \
                 {MOST_SURFACES} of {MOST_POINTS}, so take fewer",
                self.surfaces, self.points
            );
            return Err(Fault::line(line, problem).into());
        }
        for (kind, number) in kinds {
            *self.done.report.kinds.entry(kind).or_default() += number * count as usize;
        }
        let base = self.done.styles.last().map_or(0, |(range, _)| range.end);
        let moved = |range: &Range<usize>, by: usize| by + range.start..by + range.end;
        self.done
            .files
            .extend(model.files.iter().map(|f| ModelFile { surfaces: moved(&f.surfaces, base), ..f.clone() }));
        // What is said of a surface goes before what is said of the object, and that before what the model says itself.
        let own = surfaces::choices(&surfaces, members)?;
        let choices: Vec<StyleChoice> =
            own.into_iter().zip(model.choices()).map(|(own, choice)| own.or(look.style).or(choice)).collect();
        for copy in 0..count {
            if copy % PROGRESS_STEP == PROGRESS_STEP - 1 {
                self.reading.progress(copy as usize, count as usize)?;
            }
            let map = placement.copy(copy);
            let number = if count > 1 { format!(" {}", copy + 1) } else { String::new() };
            let placed = members.iter().map(|member| {
                let image = member.transformed(map).map_err(|error| Fault::line(line, error.to_string()))?;
                let name = name.map_or_else(|| member.name.clone(), |own| format!("{own}{number}/{}", member.name));
                Ok(SceneSurface { name, ..image })
            });
            let surfaces = placed.collect::<Result<Vec<_>, Fault>>()?;
            self.done.scenes.push(Scene { name: String::new(), surfaces });
            for &choice in &choices {
                self.style(choice.or(self.common.style));
            }
        }
        Ok(())
    }

    /// Says how the next surface is drawn.
    fn style(&mut self, choice: StyleChoice) {
        match self.done.styles.last_mut() {
            Some((range, last)) if *last == choice => range.end += 1,
            last => {
                let next = last.map_or(0, |(range, _)| range.end);
                self.done.styles.push((next..next + 1, choice));
            }
        }
    }

    /// The model that is built in under this name, with its kinds, or that in this file, whose reader tells them.
    fn model(&mut self, spec: &str, line: usize, crease_angle: Option<f64>) -> Result<(Rc<Model>, Kinds), ReadError> {
        if let Some(built_in) = load::built_in(spec) {
            let kind = format!("surface of {}", built_in.scene.name);
            let kinds = Kinds::from([(kind, built_in.scene.surfaces.len())]);
            return Ok((Rc::new(built_in), kinds));
        }
        let Some(folder) = &self.folder else {
            let problem = "is no built-in model, and a scene that is in no file cannot refer to one";
            return Err(Fault::line(line, format!("`model` {problem}: {}", known_models())).into());
        };
        let path = folder.join(spec);
        let key = (path.clone(), crease_angle.map(f64::to_bits));
        if let Some(model) = self.models.get(&key) {
            return Ok((model.clone(), Kinds::new()));
        }
        let reading = self.reading.clone().or_crease_angle(crease_angle);
        let model = load::load_file(&path, &reading).map_err(|error| match error {
            ModelError::Stopped { .. } => ReadError::Stopped,
            error => Fault::line(line, error.to_string()).into(),
        })?;
        let model = Rc::new(model);
        self.models.insert(key, model.clone());
        Ok((model, Kinds::new()))
    }

    /// All of it.
    pub(super) fn finish(self) -> Assembled {
        self.done
    }
}

/// Surfaces by kind.
type Kinds = BTreeMap<String, usize>;

/// A model of the faces of a shape, with their kinds.
fn shape(faces: Faces) -> (Rc<Model>, Kinds) {
    let mut kinds = Kinds::new();
    let mut surfaces = Vec::with_capacity(faces.len());
    for (kind, face) in faces {
        *kinds.entry(kind.to_owned()).or_default() += 1;
        surfaces.push(face);
    }
    (Rc::new(Model { scene: Scene { name: String::new(), surfaces }, ..Model::default() }), kinds)
}

/// The names of the built-in models, for messages.
fn known_models() -> String {
    builtin::names().map(|(name, _)| name).collect::<Vec<_>>().join(", ")
}
