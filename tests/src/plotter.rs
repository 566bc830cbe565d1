//! From a model to the ink of the simulated plotter, by the same steps as the program's.

use clap::Parser;
use penvis::args::DrawingArgs;
use penvis::compute::{Computed, compute, load};
use penvis::device::{self, Device, Language};
use penvis::drawing::Drawing;
use penvis::options::DrawingOptions;
use penvis::page::PathChoice;
use penvis::progress::Progress;
use penvis::protocol::{self, Control, Progress as JobProgress};
use penvis::sim::{Recording, SimPort};
use penvis::stream::{self, Observer, StreamError, WallClock};
use penvis_firmware::Settings;
use serialport::SerialPort;

#[derive(Parser)]
struct Arguments {
    models: Vec<String>,
    #[command(flatten)]
    drawing: DrawingArgs,
}

/// What `penvis draw` with these words does, up to the files.
///
/// # Panics
/// If the words are not understood.
#[must_use]
pub fn options(words: &[&str]) -> DrawingOptions {
    let arguments = Arguments::parse_from(["draw"].iter().chain(words));
    DrawingOptions::new(&arguments.models, &arguments.drawing).expect("the options are legal")
}

/// Draws what `penvis draw` with these words draws.
///
/// # Panics
/// If it cannot be drawn.
#[must_use]
pub fn draw(words: &[&str]) -> Computed {
    drawn(words, PathChoice::default(), false)
}

/// Draws what `penvis draw` with these words draws, along a path of which something else is asked, and with slack for arcs if it is `curved`.
///
/// # Panics
/// If it cannot be drawn.
#[must_use]
pub fn drawn(words: &[&str], path: PathChoice, curved: bool) -> Computed {
    let (options, progress) = (options(words), Progress::start());
    let loaded = load(&options, &progress).expect("the model can be read");
    compute(loaded.curved(curved).along(path)).expect("the model can be drawn")
}

/// The plotter that is simulated.
///
/// # Panics
/// If its profile is not legal.
#[must_use]
pub fn simulated() -> Device {
    device::find("penvis").expect("a built-in profile")
}

/// A simulated plotter that has just been switched on.
///
/// # Panics
/// If the device speaks another language than G-code.
#[must_use]
pub fn port(device: &Device) -> SimPort {
    let Language::Grbl(gcode) = &device.language else { panic!("{} speaks no G-code", device.name) };
    SimPort::new(Settings::default(), &gcode.pen, device.baud)
}

/// Streams a job to the simulated plotter, to its end, and tells what it drew.
///
/// # Errors
/// What the streamer says.
///
/// # Panics
/// If the job is not one for the device.
pub fn plot(job: &str, device: &Device) -> Result<Recording, StreamError> {
    let mut port = port(device);
    let clock = port.clock();
    let mut conversation = protocol::start(job.as_bytes(), device, device.baud).expect("a job for the device");
    stream::run(&mut port, conversation.protocol.as_mut(), &clock, &mut Nobody)?;
    Ok(port.recording())
}

/// Streams a job to the plotter at a serial port, to its end by the wall's clock, and tells how far it came.
///
/// # Errors
/// What the streamer says.
///
/// # Panics
/// If the job is not one for the device.
pub fn plot_at(port: &mut dyn SerialPort, job: &str, device: &Device) -> Result<JobProgress, StreamError> {
    let mut conversation = protocol::start(job.as_bytes(), device, device.baud).expect("a job for the device");
    stream::run(port, conversation.protocol.as_mut(), &WallClock::start(), &mut Nobody)?;
    Ok(conversation.protocol.progress())
}

/// The ink of a recording as a drawing on the page of the drawing that was plotted.
///
/// # Panics
/// If the page does not fit the device.
#[must_use]
pub fn ink(recording: &Recording, drawing: &Drawing, device: &Device) -> Drawing {
    let placement = device.place(drawing.page).expect("the page fits");
    recording.drawing("ink", drawing.page, &placement)
}

/// Wants to know nothing, and never lets a job wait.
pub struct Nobody;

impl Observer for Nobody {
    fn progress(&mut self, _: JobProgress) {}

    fn message(&mut self, _: &str) {}

    fn prompt(&mut self, _: &str) -> bool {
        true
    }

    fn control(&mut self) -> Option<Control> {
        None
    }

    fn paused(&mut self, _: bool) {}
}
