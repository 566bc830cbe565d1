//! What a reader makes of a file, and what it has to say about it.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

use penvis_core::scene::Scene;

use super::aim::ViewChoice;
use super::fault::{Fault, ReadError};
use super::load::ModelFile;
use super::view::View;
use crate::pens::Pen;
use crate::style::{SheetChoice, StyleChoice};

/// Most control points of all free-form surfaces of a file: half a gigabyte, and as many as a million bicubic patches have.
pub(super) const MOST_POINTS: usize = 1 << 24;

/// What a reader makes of a file.
///
/// A format that has surfaces and nothing else fills in `scene` and `report`. The rest gives way to the command line.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Import {
    /// The surfaces.
    pub scene: Scene,
    /// The view that the file states, if it does.
    pub view: Option<View>,
    /// What it asks of the view, whichever model that is of.
    pub aim: ViewChoice,
    /// What it asks of the drawing of ranges of surfaces; a later one counts where they overlap.
    pub styles: Vec<(Range<usize>, StyleChoice)>,
    /// What it asks of the sheet.
    pub sheet: SheetChoice,
    /// What it says of pens, by number.
    pub pens: BTreeMap<u32, Pen>,
    /// The files that it refers to, in the order of their surfaces.
    pub files: Vec<ModelFile>,
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
#[derive(Clone)]
pub struct Reading<'a> {
    /// Two facets of a mesh that meet at no more than this angle, in radians, stand for one smooth surface.
    pub crease_angle: f64,
    /// Whether that was asked for, so that no file can choose another one.
    is_angle_asked: bool,
    /// The files that are being read because of each other, the outermost first.
    chain: Vec<PathBuf>,
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

/// Most files that are read because of each other. Each level has its own frames on the stack and its own copy of the surfaces.
const DEEPEST: usize = 16;

impl<'a> Reading<'a> {
    /// With the usual options.
    #[must_use]
    pub fn new(watch: &'a dyn Watch) -> Self {
        let crease_angle = MESH_CREASE_DEGREES.to_radians();
        Self { crease_angle, is_angle_asked: false, chain: Vec::new(), watch }
    }

    /// The same, but facets that meet at no more than this angle, in radians, stand for one smooth surface.
    #[must_use]
    pub fn with_crease_angle(self, crease_angle: f64) -> Self {
        Self { crease_angle, is_angle_asked: true, ..self }
    }

    /// The same, but with this crease angle, if any, unless another one was asked for: what is said nearer to the command
    /// line goes first.
    #[must_use]
    pub fn or_crease_angle(self, crease_angle: Option<f64>) -> Self {
        match crease_angle {
            Some(angle) if !self.is_angle_asked => self.with_crease_angle(angle),
            _ => self,
        }
    }

    /// The same, but with this crease angle, if any, where nothing else asks for one.
    #[must_use]
    pub fn or_usual_crease_angle(self, crease_angle: Option<f64>) -> Self {
        match crease_angle {
            Some(crease_angle) if !self.is_angle_asked => Self { crease_angle, ..self },
            _ => self,
        }
    }

    /// The same, for files to which the one at `path` refers.
    ///
    /// # Errors
    /// If that file is being read already, or too many are because of each other.
    pub fn within(&self, path: &Path) -> Result<Self, Fault> {
        // A path that cannot be resolved is of a file that cannot be read, which is for its reader to say.
        let own = path.canonicalize().unwrap_or_else(|_| path.to_owned());
        if self.chain.contains(&own) {
            return Err(Fault::whole(
                "refers to itself, directly or through other files; a file cannot be a part of itself",
            ));
        }
        if self.chain.len() == DEEPEST {
            return Err(Fault::whole(format!(
                "is the last of {DEEPEST} files that refer one to the next; join some of them"
            )));
        }
        let mut chain = self.chain.clone();
        chain.push(own);
        Ok(Self { chain, ..self.clone() })
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
