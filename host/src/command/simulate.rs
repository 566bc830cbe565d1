//! `penvis simulate`: a simulated plotter that other programs talk to.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error as ThisError;

use super::ink;
use crate::compute::duration_text;
use crate::device;
use crate::error::Error;
use crate::interrupt;
use crate::sim::{Fault, FaultError, Faults, PeerError, Recording, SimName, SimPort, Traffic};

/// Bytes of a job of some size, within which a seed places faults: how long that of a client is, nobody knows.
const EXPECTED: Traffic = Traffic { sent: 20_000, answered: 5_000, acknowledged: 1_000 };

/// Arguments of `penvis simulate`.
#[derive(Clone, Debug, clap::Args)]
pub struct SimulateArgs {
    /// Offer the plotter at a pseudo terminal, whose path is printed; Ctrl-C ends it
    #[arg(long, required = true)]
    pub pty: bool,
    /// Which plotter: sim, sim:grbl, sim:marlin, with options after commas as in `penvis plot`
    #[arg(long, value_name = "PORT", default_value = "sim")]
    pub port: String,
    /// Device whose pen it has (`penvis devices`) [default: that of the port]
    #[arg(long, value_name = "NAME")]
    pub device: Option<String>,
    /// Speed of the line [default: the device's]
    #[arg(long, value_name = "BAUD", value_parser = clap::value_parser!(u32).range(1..))]
    pub baud: Option<u32>,
    /// What goes wrong, as in `penvis plot`
    #[arg(long, value_name = "NAME", value_delimiter = ',')]
    pub fault: Vec<String>,
    /// With --fault: decides where faults happen that say no N, and how
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    pub seed: u64,
    /// File for what the plotter drew, .svg or .png, written at the end
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Name for the pseudo terminal: a symbolic link, removed at the end
    #[arg(long, value_name = "PATH")]
    pub link: Option<PathBuf>,
    /// Plot as fast as bytes come and go, and not by the clock on the wall
    #[arg(long)]
    pub fast: bool,
    /// End when the first client hangs up
    #[arg(long)]
    pub once: bool,
}

/// Why a plotter was not simulated.
#[derive(Debug, ThisError)]
#[non_exhaustive]
pub enum SimulateError {
    /// The device, or the picture.
    #[error(transparent)]
    Drawing(#[from] Error),
    /// No such simulated plotter.
    #[error(transparent)]
    Peer(#[from] PeerError),
    /// No such fault.
    #[error(transparent)]
    Fault(#[from] FaultError),
    /// A real port.
    #[error("--port {port} is a real one; what is simulated begins with `sim`")]
    RealPort {
        /// The port asked for.
        port: String,
    },
    /// The picture cannot be where it is asked for.
    #[error("--out {path}: {problem}", path = path.display())]
    Out {
        /// The file asked for.
        path: PathBuf,
        /// Why not.
        problem: &'static str,
    },
    /// The name cannot be given.
    #[error("--link {path}: {source}; choose another name", path = path.display())]
    Link {
        /// The link asked for.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The terminal failed.
    #[error("the pseudo terminal failed: {0}")]
    Pty(#[from] io::Error),
    /// Not on this system.
    #[error("--pty: this system has no pseudo terminals; plot with --port sim instead")]
    NoPty,
}

/// Offers the plotter until it is over, and writes what it drew.
///
/// # Errors
/// [`SimulateError`].
pub fn run(args: &SimulateArgs) -> Result<(), SimulateError> {
    let name = SimName::parse(&args.port).ok_or_else(|| SimulateError::RealPort { port: args.port.clone() })??;
    let device = device::find(args.device.as_deref().unwrap_or(name.default_device())).map_err(Error::from)?;
    let faults = args.fault.iter().map(|fault| fault.parse()).collect::<Result<Vec<Fault>, _>>()?;
    if let Some(path) = &args.out
        && let Some(problem) = ink::problem(path)
    {
        return Err(SimulateError::Out { path: path.clone(), problem });
    }
    let page = device.whole_page();
    let place = device.place(page).map_err(|e| SimulateError::Pty(io::Error::other(e)))?;
    let mut port = SimPort::with(name.peer(&device)?, args.baud.unwrap_or(device.baud));
    port.set_faults(Faults::new(&faults, args.seed, EXPECTED));
    serve(args, &mut port)?;
    for fault in port.faults().struck() {
        eprintln!("fault {fault}");
    }
    let recording = port.recording();
    eprintln!("{}", told(&recording));
    if let Some(path) = &args.out {
        ink::write(&recording, "simulated", page, &place, path)?;
        eprintln!("what it drew is in {}", path.display());
    }
    Ok(())
}

#[cfg(unix)]
fn serve(args: &SimulateArgs, port: &mut SimPort) -> Result<(), SimulateError> {
    use crate::sim::{Pace, Pty};

    let mut pty = Pty::open()?;
    let link = match &args.link {
        Some(path) => Some(Link::new(pty.path(), path)?),
        None => None,
    };
    interrupt::watch();
    let shown = args.link.as_deref().unwrap_or(pty.path()).display().to_string();
    super::print(&format!("{shown}\n"))?;
    eprintln!("a simulated plotter is at {shown}; Ctrl-C ends it");
    let pace = if args.fast { Pace::Hurry } else { Pace::Wall };
    let once = args.once;
    let stays =
        pty.serve(port, pace, &mut |visit| interrupt::is_wanted() || (once && visit.clients > 0 && !visit.connected))?;
    if !stays {
        eprintln!("the plotter was unplugged");
    }
    drop(link);
    Ok(())
}

#[cfg(not(unix))]
fn serve(_args: &SimulateArgs, _port: &mut SimPort) -> Result<(), SimulateError> {
    Err(SimulateError::NoPty)
}

/// A symbolic link that is removed when it is dropped.
#[cfg(unix)]
struct Link(PathBuf);

#[cfg(unix)]
impl Link {
    fn new(to: &Path, path: &Path) -> Result<Self, SimulateError> {
        // One that leads nowhere is left of a simulation that was killed.
        if path.is_symlink() && !path.exists() {
            std::fs::remove_file(path).map_err(|source| SimulateError::Link { path: path.to_owned(), source })?;
        }
        std::os::unix::fs::symlink(to, path).map_err(|source| SimulateError::Link { path: path.to_owned(), source })?;
        Ok(Self(path.to_owned()))
    }
}

#[cfg(unix)]
impl Drop for Link {
    fn drop(&mut self) {
        // Where it cannot be removed, it leads nowhere.
        let _ = std::fs::remove_file(&self.0);
    }
}

/// The line that says what was drawn.
fn told(recording: &Recording) -> String {
    format!(
        "{:.0} mm of ink, {:.0} mm of travel, {} lifts, {} bytes lost, in {}",
        recording.ink_mm(),
        recording.travel_mm(),
        recording.lifts(),
        recording.lost_bytes,
        duration_text(std::time::Duration::try_from_secs_f64(recording.duration_s).unwrap_or_default()),
    )
}
