//! `penvis ports`: where a plotter may be.

mod probe;
mod usb;

use std::fmt::Write as _;
use std::io;

use serialport::{SerialPortInfo, SerialPortType};
use thiserror::Error;

/// Lists the serial ports with a guess of what is there, and `sim`, the simulated plotter that is always there.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct PortsArgs {
    /// Ask at each port that is not in use what is there: seconds a port, and nothing moves
    #[arg(long)]
    pub probe: bool,
}

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

/// Prints a line for each port: its path, what is plugged in there, and what that is most likely, or who answers.
///
/// # Errors
/// [`PortsError`]: ports that cannot be listed, or output that fails.
pub fn run(args: &PortsArgs) -> Result<(), PortsError> {
    let mut ports = serialport::available_ports()?;
    ports.sort_by(|a, b| a.port_name.cmp(&b.port_name));
    Ok(super::print(&list(&ports, args.probe.then_some(&probe::probe)))?)
}

fn list(ports: &[SerialPortInfo], probe: Option<&dyn Fn(&str) -> String>) -> String {
    let mut lines = vec![
        ("sim".to_owned(), "simulated plotter (penvis firmware, nothing to install)".to_owned()),
        ("sim:…".to_owned(), "other simulated plotters (`penvis plot --help`)".to_owned()),
    ];
    for port in ports {
        let mut what = describe(&port.port_type);
        if let Some(probe) = probe {
            what = format!("{what}; {}", probe(&port.port_name));
        } else if let SerialPortType::UsbPort(usb) = &port.port_type
            && let Some((chip, guess)) = usb::guess(usb.vid, usb.pid)
        {
            what = format!("{what} ({chip}); {guess}");
        }
        lines.push((port.port_name.clone(), what.trim_start_matches("; ").to_owned()));
    }
    let width = lines.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for (name, what) in lines {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{}", format!("{name:width$}  {what}").trim_end());
    }
    text
}

/// What is plugged in, in the system's words.
fn describe(kind: &SerialPortType) -> String {
    match kind {
        SerialPortType::UsbPort(usb) => {
            let words = [usb.manufacturer.as_deref(), usb.product.as_deref()];
            let words: Vec<_> = words.into_iter().flatten().collect();
            format!("USB {:04x}:{:04x} {}", usb.vid, usb.pid, words.join(" ")).trim_end().to_owned()
        }
        SerialPortType::PciPort => "serial port on the board".to_owned(),
        SerialPortType::BluetoothPort => "Bluetooth".to_owned(),
        SerialPortType::Unknown => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use serialport::UsbPortInfo;

    use super::*;

    fn usb() -> SerialPortInfo {
        let usb = UsbPortInfo {
            vid: 0x1a86,
            pid: 0x7523,
            serial_number: None,
            manufacturer: None,
            product: Some("USB Serial".into()),
        };
        SerialPortInfo { port_name: "/dev/ttyUSB0".into(), port_type: SerialPortType::UsbPort(usb) }
    }

    #[test]
    fn the_simulated_port_is_always_there() {
        assert!(list(&[], None).starts_with("sim  "));
        let port = SerialPortInfo { port_name: "/dev/ttyS0".into(), port_type: SerialPortType::Unknown };
        assert_eq!(list(&[port], None).lines().nth(2), Some("/dev/ttyS0"));
    }

    #[test]
    fn usb_ports_are_guessed_or_asked() {
        let guessed = list(&[usb()], None);
        let line = guessed.lines().nth(2).unwrap();
        assert!(line.starts_with("/dev/ttyUSB0  USB 1a86:7523 USB Serial (CH340); a board with GRBL"), "{line}");
        let asked = list(&[usb()], Some(&|path| format!("{path} answers")));
        assert!(asked.ends_with("/dev/ttyUSB0  USB 1a86:7523 USB Serial; /dev/ttyUSB0 answers\n"), "{asked}");
    }
}
