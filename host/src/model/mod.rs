//! Models: surfaces and a view, from a file or built in.

pub(crate) mod view;

pub use view::{Projection, View};
