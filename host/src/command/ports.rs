//! `penvis ports`: where a plotter may be.

use std::fmt::Write as _;
use std::io;

use serialport::{SerialPortInfo, SerialPortType};
use thiserror::Error;

/// Lists the serial ports, and `sim`, the simulated plotter that is always there.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct PortsArgs {}

/// Why the ports were not listed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PortsError {
    /// The system does not tell them.
    #[error("the system does not tell its serial ports: {0}; a port can still be given to --port by its path")]
    List(#[from] serialport::Error),
    /// Nobody takes the output.
    #[error("cannot write to standard output: {0}")]
    Output(#[from] io::Error),
}

/// Prints a line for each port: its path and what is plugged in there.
///
/// # Errors
/// [`PortsError`]: ports that cannot be listed, or output that fails.
pub fn run(_args: &PortsArgs) -> Result<(), PortsError> {
    let mut ports = serialport::available_ports()?;
    ports.sort_by(|a, b| a.port_name.cmp(&b.port_name));
    Ok(super::print(&list(&ports))?)
}

fn list(ports: &[SerialPortInfo]) -> String {
    let mut lines = vec![("sim".to_owned(), "simulated plotter (penvis firmware, nothing to install)".to_owned())];
    for port in ports {
        let what = match &port.port_type {
            SerialPortType::UsbPort(usb) => {
                let words = [usb.manufacturer.as_deref(), usb.product.as_deref()];
                let words: Vec<_> = words.into_iter().flatten().collect();
                format!("USB {:04x}:{:04x} {}", usb.vid, usb.pid, words.join(" ")).trim_end().to_owned()
            }
            SerialPortType::PciPort => "serial port on the board".to_owned(),
            SerialPortType::BluetoothPort => "Bluetooth".to_owned(),
            SerialPortType::Unknown => String::new(),
        };
        lines.push((port.port_name.clone(), what));
    }
    let width = lines.iter().map(|(name, _)| name.len()).max().unwrap_or(0);
    let mut text = String::new();
    for (name, what) in lines {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{}", format!("{name:width$}  {what}").trim_end());
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_simulated_port_is_always_there() {
        assert!(list(&[]).starts_with("sim  "));
        let port = SerialPortInfo { port_name: "/dev/ttyS0".into(), port_type: SerialPortType::Unknown };
        assert_eq!(list(&[port]).lines().nth(1), Some("/dev/ttyS0"));
    }
}
