//! The `penvis` command.

use std::process::ExitCode;

use clap::Parser;
use penvis::cli::Cli;
use penvis::interrupt::EXIT_INTERRUPTED;

fn main() -> ExitCode {
    match Cli::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            if error.is_interrupt() { ExitCode::from(EXIT_INTERRUPTED) } else { ExitCode::FAILURE }
        }
    }
}
