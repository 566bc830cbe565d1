//! HPGL: the second language of the same machine.
//!
//! ```text
//!  bytes ─▶ device control (ESC . X): obeyed at once, never buffered ─▶ answers, handshake
//!    │ the rest
//!    ▼
//!  ring of HPGL_BYTES ─▶ parser ─▶ instructions ─▶ ops: straight moves, pen, answers ─▶ planner, as from G-code
//! ```
//!
//! Known are `IN DF SP PU PD PA PR PE VS IP SC IW` and the questions `OA OC OE OF OH OI OO OP OS OW`; `LB` is read and not lettered, and all others are error 1 of `OE`. Device
//! control is `ESC.` with `@ B E H I K L M N O R` and `( ) Y Z` (plotter on and off).
//!
//! Plotter units are 0.025 mm, or what `$451` says (0.02488 on HP's own). Their origin is the work origin (G54 and G92). What lies outside of the travel is not drawn: the hard-clip limits are
//! the reach of the axes, and `IW` narrows them. PD lowers the pen to the level of `$30`, and each lift and landing is given `$452` ms.
//!
//! Every step of the way is bounded: a byte makes at most one part, a part at most [`OPS`] ops.

mod control;
mod encoded;
mod parser;
mod plotter;
mod window;

pub(crate) use control::{Control, Order, Received};
pub use encoded::{Encoded, Piece as EncodedPiece};
pub(crate) use plotter::{Op, Plotter, Question};
pub(crate) use window::Window;

/// Bytes that the receive ring holds for HPGL.
pub const HPGL_BYTES: usize = 1024;

/// Most ops that a part of an instruction makes: a vector that enters and leaves the window.
pub(crate) const OPS: usize = 6;
