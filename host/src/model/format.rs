//! The registry of model formats.
//!
//! A new reader is a file of its own with a constant [`ModelFormat`], and a line in [`FORMATS`].

use std::path::Path;

use super::fault::ReadError;
use super::import::{Import, Reading};
use super::source::Source;
use super::{bpt, itd, obj, scene, step, stl, surface_json};

/// A format of model files.
pub struct ModelFormat {
    /// What users call it.
    pub name: &'static str,
    /// Extensions of its files, in small letters.
    pub extensions: &'static [&'static str],
    /// Whether a file is of this format by its first bytes and its length; where several formats could be, no.
    pub(super) looks_like: fn(&Source) -> bool,
    /// Reads a file.
    pub(super) read: fn(&mut Source, &Reading<'_>) -> Result<Import, ReadError>,
}

impl ModelFormat {
    /// Reads a file of this format.
    ///
    /// # Errors
    /// [`ReadError`], whatever the bytes are.
    pub fn read(&self, source: &mut Source, reading: &Reading<'_>) -> Result<Import, ReadError> {
        (self.read)(source, reading)
    }

    fn has_extension(&self, path: &Path) -> bool {
        path.extension().is_some_and(|e| self.extensions.iter().any(|own| e.eq_ignore_ascii_case(own)))
    }
}

/// The formats, in the order in which a file is held against them.
pub const FORMATS: &[ModelFormat] =
    &[surface_json::FORMAT, step::FORMAT, stl::FORMAT, obj::FORMAT, bpt::FORMAT, itd::FORMAT, scene::FORMAT];

/// The format of a file: what it looks like inside, or else what its extension says.
#[must_use]
pub fn format_of(source: &Source, path: &Path) -> Option<&'static ModelFormat> {
    let by_content = FORMATS.iter().find(|f| (f.looks_like)(source));
    by_content.or_else(|| FORMATS.iter().find(|f| f.has_extension(path)))
}

/// The formats with their extensions, for messages.
#[must_use]
pub fn formats() -> String {
    let all: Vec<String> = FORMATS.iter().map(|f| format!("{} (.{})", f.name, f.extensions.join(", ."))).collect();
    all.join(", ")
}
