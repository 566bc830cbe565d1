//! `penvis scene`: a scene file to begin with.

use std::path::{Path, PathBuf};

use crate::error::Error;
use crate::output;

/// A scene with all there is to say in one, which draws as it stands.
const TEMPLATE: &str = include_str!("../../doc/scene.toml");

/// Prints a commented scene that draws as it stands, or writes it to a file.
#[derive(Clone, Debug, clap::Args)]
pub struct SceneArgs {
    /// Write it to a file that is not there yet
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "scene.toml")]
    pub init: Option<PathBuf>,
}

/// Prints the scene, or writes it and says how to go on.
///
/// # Errors
/// If the file is there already or cannot be written, or standard output is gone.
pub fn run(args: &SceneArgs) -> Result<(), Error> {
    let Some(path) = &args.init else { return Ok(super::print(TEMPLATE)?) };
    output::write_new(path, TEMPLATE.as_bytes())?;
    eprintln!("wrote {}; change it, and draw it with: penvis draw {0} -o {}", path.display(), drawing(path).display());
    Ok(())
}

/// What a drawing of the scene may be called.
fn drawing(scene: &Path) -> PathBuf {
    scene.with_extension("svg")
}
