//! Scenes stored in a compact form, from which a board removes hidden curves and draws by itself.
//!
//! The host packs a [`StoredScene`] ([`StoredScene::pack`]); the board unpacks it ([`StoredScene::unpack`]).

mod file;
mod record;
mod stored;

pub use file::{HEADER_BYTES, Place, SceneError, VERSION, announced, frame};
pub use stored::{Look, Program, Sight, StoredScene};
