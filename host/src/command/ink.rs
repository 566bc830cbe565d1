//! What a simulated plotter drew, as a picture in a file.

use std::path::{Path, PathBuf};

use crate::device::Placement;
use crate::drawing::Page;
use crate::emit::{self, Format};
use crate::error::Error;
use crate::options::folder;
use crate::output;
use crate::sim::Recording;

/// Why a picture cannot be where it is asked for; none when it can.
pub(crate) fn problem(path: &Path) -> Option<&'static str> {
    if !matches!(Format::of_path(path), Some(Format::Svg | Format::Png)) {
        Some("give a name that ends in .svg or .png")
    } else if !folder(path).is_dir() {
        Some("there is no such folder; make it first")
    } else if path.exists() && !path.is_file() {
        Some("is there, and is not a regular file; choose another name")
    } else {
        None
    }
}

/// Writes the ink that is on a page.
pub(crate) fn write(
    recording: &Recording,
    name: &str,
    page: Page,
    place: &Placement,
    path: &Path,
) -> Result<(), Error> {
    let drawing = recording.drawing(name, page, place);
    let picture = match Format::of_path(path) {
        Some(Format::Png) => {
            emit::png(&drawing, false).map_err(|source| Error::Emit { path: path.to_owned(), source })?
        }
        _ => emit::svg(&drawing, None).into_bytes(),
    };
    output::write_all(&[(PathBuf::from(path), picture)])
}
