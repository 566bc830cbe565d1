//! `penvis devices`: the plotters that it knows.

use std::fmt::Write as _;
use std::io;

use thiserror::Error;

use crate::device::{self, DeviceError};

/// Lists the plotters, or prints the profile of one.
#[derive(Clone, Debug, clap::Args)]
pub struct DevicesArgs {
    /// Device whose profile is printed in full, as TOML that can be saved, changed, and given to --device
    pub name: Option<String>,
}

/// Why the list or the profile was not printed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DevicesError {
    /// No such device.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// Nobody takes the output.
    #[error("cannot write to standard output: {0}")]
    Output(#[from] io::Error),
}

/// Prints the list, or the resolved profile of one device.
///
/// # Errors
/// [`DevicesError`]: an unknown name, or output that fails.
pub fn run(args: &DevicesArgs) -> Result<(), DevicesError> {
    let text = match &args.name {
        Some(name) => device::resolved_toml(name)?,
        None => list()?,
    };
    Ok(super::print(&text)?)
}

/// A line for each device that comes with the program.
fn list() -> Result<String, DeviceError> {
    let names = device::names();
    let width = names.iter().map(|name| name.len()).max().unwrap_or(0);
    let mut text = String::new();
    for name in names {
        let device = device::find(name)?;
        let mark = if name == device::DEFAULT { " [default]" } else { "" };
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{name:width$}  {}{mark}", device.description);
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_has_a_line_for_each_device() {
        let text = list().unwrap();
        assert_eq!(text.lines().count(), device::names().len());
        assert!(text.contains("HP 7475A") && text.contains("[default]"));
    }
}
