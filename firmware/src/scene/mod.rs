//! Scenes stored in a compact form, from which a board removes hidden curves and draws by itself.
//!
//! ```text
//!  host    StoredScene::pack ──▶ bytes
//!  board   bytes ──▶ StoredScene::unpack ──▶ penvis-core ──▶ strokes ──▶ lines of G-code
//! ```
//!
//! It needs an allocator, and memory that depends on the scene.

mod draw;
mod file;
mod record;
mod stored;

pub use draw::{DrawError, Figures, Line, draw};
pub use file::{HEADER_BYTES, Place, SceneError, VERSION, announced, frame};
pub use stored::{Look, Program, Sight, StoredScene};
