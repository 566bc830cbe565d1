//! `penvis devices`: the plotters that it knows.

use std::fmt::Write as _;
use std::io;
use std::path::PathBuf;

use thiserror::Error;

use crate::device::{self, DeviceError, Listed};
use crate::message::one_line;

/// Lists the plotters, or prints the profile of one.
#[derive(Clone, Debug, clap::Args)]
pub struct DevicesArgs {
    /// Device whose profile is printed in full, as TOML that can be saved, changed, and given to --device; by its name if it is in the folder for one's own
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
        None => list(&device::list()) + &own(device::user_folder()),
    };
    Ok(super::print(&text)?)
}

/// Where the user's own profiles belong.
fn own(folder: Option<PathBuf>) -> String {
    folder.map(|folder| format!("profiles of your own belong in {}\n", folder.display())).unwrap_or_default()
}

/// A line for each device; the user's own with their files.
fn list(devices: &[Listed]) -> String {
    let width = devices.iter().map(|listed| listed.name.len()).max().unwrap_or(0);
    let mut text = String::new();
    for Listed { name, path, device } in devices {
        let mark = if name == device::DEFAULT { " [default]" } else { "" };
        let what = match device {
            Ok(device) => one_line(&device.description),
            Err(error) => format!("cannot be used: {error}"),
        };
        let path = path.as_ref().map(|path| format!(" ({})", path.display())).unwrap_or_default();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{name:width$}  {what}{mark}{path}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_has_a_line_for_each_device() {
        let listed = |name: &str, path: Option<&str>| Listed {
            name: name.into(),
            path: path.map(PathBuf::from),
            device: device::find(name),
        };
        let text = list(&[listed("grbl-servo", None), listed("hp7475a", Some("/x/hp7475a.toml")), listed("no", None)]);
        let lines: Vec<_> = text.lines().collect();
        assert_eq!(lines.len(), 3);
        assert!(lines[0].ends_with("[default]"));
        assert!(lines[1].contains("HP 7475A") && lines[1].ends_with("(/x/hp7475a.toml)"));
        assert!(lines[2].contains("cannot be used"));
    }
}
