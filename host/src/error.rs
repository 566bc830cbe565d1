//! What can go wrong in making a drawing, from the arguments to the files.

use std::path::PathBuf;

use penvis_core::view::{CameraError, ViewError};
use thiserror::Error;

use crate::device::DeviceError;
use crate::emit::EmitError;
use crate::fill::OffsetError;
use crate::marking::MarkError;
use crate::model::ModelError;
use crate::options::OptionError;
use crate::page::LayoutError;
use crate::redraw::RedrawError;
use crate::store::StoreError;

/// Why there is no drawing. Each message is one line that says what is wrong, where, and what to do.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum Error {
    /// Something on the command line.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// A model.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A drawing.
    #[error(transparent)]
    Redraw(#[from] RedrawError),
    /// A device profile.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// The view that the options and the model make together.
    #[error("--view, --up: {0}")]
    View(#[from] CameraError),
    /// The camera does not see the whole model.
    #[error("--view, --perspective: {0}")]
    Scene(#[from] ViewError),
    /// Ctrl-C.
    #[error("stopped by Ctrl-C while {doing}; nothing was written")]
    Interrupted {
        /// What was being done.
        doing: String,
    },
    /// `--time-limit` is over.
    #[error(
        "--time-limit: {limit_s} s were over while {doing}, and nothing was written; allow more, or ask for less with \
         --iso, --curves or --hidden omit"
    )]
    TimeLimit {
        /// The limit in s.
        limit_s: f64,
        /// What was being done.
        doing: String,
    },
    /// Shadows of nothing that is filled or written.
    #[error(
        "--shadows: nothing is filled that shadows could darken; give --fill hatch or --fill cross, or write the shadows with --emit-regions"
    )]
    Shadows,
    /// The picture does not go on the paper.
    #[error(transparent)]
    Layout(#[from] LayoutError),
    /// What is visible cannot be filled.
    #[error("--fill: {0}")]
    Fill(#[from] OffsetError),
    /// The sheet cannot be marked.
    #[error(transparent)]
    Mark(#[from] MarkError),
    /// A board could not draw it.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// An output cannot be made from the drawing.
    #[error("{path}: {source}", path = path.display())]
    Emit {
        /// The output.
        path: PathBuf,
        /// Why.
        source: EmitError,
    },
    /// A file cannot be written.
    #[error("cannot write {path}: {source}; check that the folder is there, can be written and has room", path = path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file that is not to be replaced.
    #[error("{path} is there already, and is left as it is; give the new file another name", path = path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// JSON cannot be made.
    #[error("{path}: {source}", path = path.display())]
    Json {
        /// The output.
        path: PathBuf,
        /// What the serializer said.
        source: serde_json::Error,
    },
    /// Standard output is gone.
    #[error("cannot write to standard output: {0}")]
    Output(#[from] std::io::Error),
}
