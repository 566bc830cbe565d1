//! Models: surfaces and a view, from a file or built in.

mod load;
mod surface_json;
pub(crate) mod view;

pub use load::{Model, ModelError, load};
pub use surface_json::Fault;
pub use view::{Projection, View};
