//! The command line: which command does what is asked for.

use clap::{Parser, Subcommand};
use thiserror::Error as ThisError;

use crate::args::DrawArgs;
use crate::command;
use crate::command::console::ConsoleError;
use crate::command::devices::DevicesError;
use crate::command::plot::PlotError;
use crate::command::ports::PortsError;
use crate::command::simulate::SimulateError;
use crate::error::Error;

/// Draws three-dimensional free-form models with a pen: exact surfaces in, visible strokes out.
#[derive(Debug, Parser)]
#[command(name = "penvis", version, propagate_version = true, max_term_width = 100)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Compute a drawing and write it to files
    Draw(Box<DrawArgs>),
    /// Tell what a model holds, or list the built-in models
    Info(command::info::InfoArgs),
    /// Draw a model, or a file for a plotter, with a plotter or a simulated one
    Plot(Box<command::plot::PlotArgs>),
    /// Store a model with the options of its drawing, for a board that draws it by itself
    Pack(Box<command::pack::PackArgs>),
    /// Print or write a scene file to begin with
    Scene(command::scene::SceneArgs),
    /// Offer a simulated plotter to other programs
    Simulate(command::simulate::SimulateArgs),
    /// Type at a plotter, and see what it answers
    Console(command::console::ConsoleArgs),
    /// List the serial ports
    Ports(command::ports::PortsArgs),
    /// List the plotters, or print the profile of one
    Devices(command::devices::DevicesArgs),
}

impl Cli {
    /// Does what was asked for.
    ///
    /// # Errors
    /// [`CliError`]: what went wrong, in a line.
    pub fn run(&self) -> Result<(), CliError> {
        match &self.command {
            Command::Draw(args) => command::draw::run(args)?,
            Command::Info(args) => command::info::run(args)?,
            Command::Plot(args) => command::plot::run(args)?,
            Command::Pack(args) => command::pack::run(args)?,
            Command::Scene(args) => command::scene::run(args)?,
            Command::Simulate(args) => command::simulate::run(args)?,
            Command::Console(args) => command::console::run(args)?,
            Command::Ports(args) => command::ports::run(args)?,
            Command::Devices(args) => command::devices::run(args)?,
        }
        Ok(())
    }
}

/// Why a command failed. Each message is one line that says what is wrong, where, and what to do.
#[derive(Debug, ThisError)]
#[non_exhaustive]
pub enum CliError {
    /// From `penvis draw`, `penvis info`, `penvis pack` and `penvis scene`.
    #[error(transparent)]
    Drawing(#[from] Error),
    /// From `penvis devices`.
    #[error(transparent)]
    Devices(#[from] DevicesError),
    /// From `penvis plot`.
    #[error(transparent)]
    Plot(#[from] PlotError),
    /// From `penvis simulate`.
    #[error(transparent)]
    Simulate(#[from] SimulateError),
    /// From `penvis console`.
    #[error(transparent)]
    Console(#[from] ConsoleError),
    /// From `penvis ports`.
    #[error(transparent)]
    Ports(#[from] PortsError),
}

impl CliError {
    /// Whether Ctrl-C ended a computation.
    #[must_use]
    pub fn is_interrupt(&self) -> bool {
        matches!(
            self,
            Self::Drawing(Error::Interrupted { .. }) | Self::Plot(PlotError::Drawing(Error::Interrupted { .. }))
        )
    }
}
