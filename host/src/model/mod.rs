//! Models: surfaces and a view, from a file or built in.

mod view;

pub use view::{Projection, View};
