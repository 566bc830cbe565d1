//! The subcommands: each has its arguments and a `run`.

use std::io::{self, Write};

pub mod console;
pub mod devices;
pub mod draw;
pub mod info;
mod ink;
pub mod pack;
pub mod plot;
pub mod ports;
pub mod scene;
pub mod simulate;

/// Prints to standard output. A reader that has gone (`penvis devices | head`) has what it wanted: that is no error.
pub(crate) fn print(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(e) if e.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}
