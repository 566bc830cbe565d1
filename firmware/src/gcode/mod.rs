//! G-code of the GRBL 1.1 dialect: one stripped line and the modal state in, the new modal state and what to do out.
//!
//! A line is checked as a whole before anything of it takes effect, so a refused line changes nothing.

mod arc;
mod interpret;
mod modal;
mod order;
mod words;

pub(crate) use arc::Arc;
pub(crate) use interpret::{in_range, interpret, interpret_jog};
pub(crate) use modal::{Distance, FeedMode, GcodeState, Motion, Plane, Spindle, Units};
pub(crate) use order::{Actions, Flow, Keep, Path, PenOrder, Speed};
