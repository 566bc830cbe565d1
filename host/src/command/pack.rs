//! `penvis pack`: a model for a board that draws it by itself.

use std::path::PathBuf;

use crate::args::DrawingArgs;
use crate::compute::load;
use crate::device;
use crate::error::Error;
use crate::interrupt;
use crate::options::DrawingOptions;
use crate::output;
use crate::progress::Progress;
use crate::store::{StoreError, lines, store};

/// Device whose lines are stored when none is asked for: the firmware of the boards.
const DEFAULT_DEVICE: &str = "penvis";

/// Arguments of `penvis pack`.
#[derive(Clone, Debug, clap::Args)]
pub struct PackArgs {
    /// Built-in models (`penvis info --list`), model files or scenes (`penvis scene`); several are stored as one scene
    #[arg(required = true, value_name = "MODEL")]
    pub models: Vec<String>,
    /// File to write: .pv for the lines that send it, any other for its bytes
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// Plotter with the board, for its lines and feeds (`penvis devices`)
    #[arg(long, value_name = "NAME", default_value = DEFAULT_DEVICE)]
    pub device: String,
    /// What is drawn, and on which paper
    #[command(flatten)]
    pub drawing: DrawingArgs,
}

/// Stores the model and says in a line what was stored.
///
/// # Errors
/// [`Error`]: what is wrong with the command line, a model, the view or the folder, or what a board cannot draw.
pub fn run(args: &PackArgs) -> Result<(), Error> {
    let options = DrawingOptions::new(&args.models, &args.drawing)?;
    let device = device::find(&args.device)?;
    let progress = Progress::start();
    let stored = store(load(&options, &progress)?, &device)?;
    let bytes = stored.pack().map_err(StoreError::from)?;
    if interrupt::is_wanted() {
        return Err(Error::Interrupted { doing: "storing the scene".into() });
    }
    let size = bytes.len();
    let is_text = args.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("pv"));
    let content = if is_text { lines(&bytes).into_bytes() } else { bytes };
    output::write_all(&[(args.output.clone(), content)])?;
    drop(progress);
    let surfaces = stored.scene.surfaces.len();
    eprintln!("{}: {surfaces} surfaces in {size} bytes", stored.scene.name);
    Ok(())
}
