//! Scenes stored in a compact form, from which a board removes hidden curves and draws by itself.
//!
//! ```text
//!  host    StoredScene::pack ──▶ bytes ──▶ flash of the board, or $PV= lines
//!  board   bytes ──▶ StoredScene::unpack ──▶ penvis-core ──▶ strokes ──▶ lines of G-code ──▶ controller
//! ```
//!
//! # Commands
//!
//! | line | does |
//! |---|---|
//! | `$PV=CLEAR` | forgets the scene that was sent |
//! | `$PV=0123…` | appends up to 36 bytes, two hexadecimal digits each; the first 16 bytes are the header, and tell whether the scene fits |
//! | `$PV` | `[PV:sent,room,stored]`: bytes that were sent, that may be sent, and of the scene in the flash, which is drawn while none is sent |
//! | `$PV=DRAW` | draws, and then answers `[PV:strokes,points,hash,heap,ms]`: [`Figures`], the most bytes of the heap in use at once, and the time it took |
//! | `$PV=TRACE` | computes all strokes, draws nothing, and answers the same |
//!
//! Each is answered by `ok`, or by a message of what is wrong and `error:n`, and needs the machine idle. While it draws, the next line waits, and real-time
//! commands work as in any other job: hold, resume, overrides, `?`; a reset ends the drawing. The lines of the drawing go the way of those from the port, so
//! that settings, work coordinates and soft limits hold for them.
//!
//! Drawing is work for the background: a [`Studio`] obeys the [`Order`]s that the controller leaves on its [`Desk`], and computes strokes while
//! the controller draws those before. It needs an allocator, and memory that depends on the scene; a board gives it what it has, takes all of it back when it
//! is not enough, and answers [`out_of_memory`].

mod desk;
mod draw;
mod file;
mod record;
mod stored;
mod studio;

pub use desk::{ANSWER_CHARS, Answer, CHUNK_BYTES, Desk, Offer, Order};
pub use draw::{DrawError, Figures, Line, draw};
pub use file::{HEADER_BYTES, Place, SceneError, VERSION, announced, frame};
pub use stored::{Look, Program, Sight, StoredScene};
pub use studio::{Studio, Surroundings, out_of_memory};
