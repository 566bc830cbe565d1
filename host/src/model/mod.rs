//! Models: surfaces and a view, from a file or built in.

pub(crate) mod aim;
mod bpt;
mod fault;
mod format;
mod import;
mod itd;
mod load;
mod mesh;
mod obj;
mod scene;
mod source;
mod step;
mod stl;
mod surface_json;
mod text;
pub(crate) mod view;

pub use aim::ViewChoice;
pub use fault::{Fault, ReadError};
pub use format::{FORMATS, ModelFormat, format_of, formats};
pub use import::{Import, MESH_CREASE_DEGREES, Reading, Report, Watch};
pub use load::{Model, ModelError, ModelFile, load};
pub use source::Source;
pub use view::{Projection, View};
