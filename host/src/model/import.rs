//! What a reader makes of a file, and what it has to say about it.

use std::collections::BTreeMap;

use penvis_core::scene::Scene;

use super::fault::ReadError;
use super::view::View;

/// Most control points of all free-form surfaces of a file: half a gigabyte, and as many as a million bicubic patches have.
pub(super) const MOST_POINTS: usize = 1 << 24;

/// What a reader makes of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Import {
    /// The surfaces.
    pub scene: Scene,
    /// The view that the file states, if it does.
    pub view: Option<View>,
    /// What there is to say about it.
    pub report: Report,
}

/// What a reader has to say about a file that it could read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Report {
    /// The unit that lengths had in the file; none if it does not say. They are millimetres in the scene if it does.
    pub unit: Option<String>,
    /// Surfaces by their kind in the file, such as planes and cylinders; empty if it has one kind only.
    pub kinds: BTreeMap<String, usize>,
    /// What was put right, and by how much.
    pub healed: Vec<String>,
    /// What was not understood, and how often it is there.
    pub skipped: BTreeMap<String, usize>,
    /// What is wrong and could not be put right, with its place.
    pub problems: Vec<String>,
}

impl Report {
    /// Counts something that was not understood.
    pub fn skip(&mut self, what: impl Into<String>) {
        *self.skipped.entry(what.into()).or_default() += 1;
    }
}

/// What readers are told, and whom they tell how far they are.
pub struct Reading<'a> {
    /// Two facets of a mesh that meet at no more than this angle, in radians, stand for one smooth surface.
    pub crease_angle: f64,
    watch: &'a dyn Watch,
}

/// Watches over readers. `()` looks away.
pub trait Watch {
    /// Told how much of how much is done.
    fn progress(&self, done: usize, total: usize) {
        let _ = (done, total);
    }

    /// Whether to stop.
    fn stops(&self) -> bool {
        false
    }
}

impl Watch for () {}

/// Two facets that meet at no more than this stand for one smooth surface if nothing else is asked for: half of the
/// angle between the sides of a hexagon. Coarser meshes are seldom meant to be smooth.
pub const MESH_CREASE_DEGREES: f64 = 30.0;

impl<'a> Reading<'a> {
    /// With the usual options.
    #[must_use]
    pub fn new(watch: &'a dyn Watch) -> Self {
        Self { crease_angle: MESH_CREASE_DEGREES.to_radians(), watch }
    }

    /// The same, but facets that meet at no more than this angle, in radians, stand for one smooth surface.
    #[must_use]
    pub fn with_crease_angle(self, crease_angle: f64) -> Self {
        Self { crease_angle, ..self }
    }

    /// Says that `done` of `total` parts are read.
    ///
    /// # Errors
    /// [`ReadError::Stopped`] if reading is to stop. To be asked often.
    pub fn progress(&self, done: usize, total: usize) -> Result<(), ReadError> {
        self.watch.progress(done, total);
        if self.watch.stops() { Err(ReadError::Stopped) } else { Ok(()) }
    }
}
