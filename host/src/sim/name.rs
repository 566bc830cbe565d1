//! The names of simulated plotters: `sim`, `sim:NAME`, `sim:NAME,OPTION=VALUE,…`.

use penvis_firmware::Settings;

use super::firmware::Firmware;
use super::grbl::{Dialect, Grbl};
use super::hpgl::Hpgl;
use super::marlin::Marlin;
use super::peer::{Peer, PeerError};
use crate::device::{Device, Language, Pen};

/// A kind of simulated plotter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Firmware,
    Grbl(Dialect),
    Marlin,
    Hpgl,
}

/// Name, kind, and the device that is meant when none is asked for.
const KINDS: [(&str, Kind, &str); 6] = [
    ("firmware", Kind::Firmware, "penvis"),
    ("grbl", Kind::Grbl(Dialect::Grbl), "grbl-servo"),
    ("grblhal", Kind::Grbl(Dialect::GrblHal), "grblhal"),
    ("fluidnc", Kind::Grbl(Dialect::FluidNc), "fluidnc"),
    ("marlin", Kind::Marlin, "marlin-servo"),
    ("hpgl7475a", Kind::Hpgl, "hp7475a"),
];

/// Number of the firmware's setting for the length of a plotter unit, mm.
const PLOTTER_UNIT: u16 = 451;

/// The pen of the firmware when it hears HPGL: PD goes to the S of `$30`.
const HPGL_PEN: Pen = Pen::Servo { index: 0, up: 0, down: 1000, raise_s: 0.15, lower_s: 0.15, soft_steps: 1 };

/// Names of the simulated plotters.
pub(super) fn names() -> Vec<&'static str> {
    KINDS.iter().map(|(name, ..)| *name).collect()
}

/// A simulated plotter as it is asked for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SimName {
    name: &'static str,
    kind: Kind,
    device: &'static str,
    options: Vec<(String, String)>,
}

impl SimName {
    /// The plotter that a port's name asks for; none when it is the name of a real port.
    ///
    /// # Errors
    /// [`PeerError::Unknown`].
    pub fn parse(port: &str) -> Option<Result<Self, PeerError>> {
        let rest = match port.strip_prefix("sim")? {
            "" => "firmware",
            rest => rest.strip_prefix(':')?,
        };
        let mut parts = rest.split(',');
        let asked = parts.next().unwrap_or_default();
        let Some(&(name, kind, device)) = KINDS.iter().find(|(name, ..)| *name == asked) else {
            return Some(Err(PeerError::Unknown { name: asked.to_owned() }));
        };
        let option = |part: &str| {
            part.split_once('=').map_or((part.to_owned(), String::new()), |(k, v)| (k.to_owned(), v.to_owned()))
        };
        Some(Ok(Self { name, kind, device, options: parts.map(option).collect() }))
    }

    /// Name of the device that is meant when none is asked for.
    #[must_use]
    pub fn default_device(&self) -> &'static str {
        self.device
    }

    /// The plotter, switched on just now, with the pen of a device.
    ///
    /// # Errors
    /// [`PeerError`]: it does not speak the language of the device, or has not the options that were asked for.
    pub fn peer(&self, device: &Device) -> Result<Box<dyn Peer>, PeerError> {
        let options: Vec<(&str, &str)> = self.options.iter().map(|(k, v)| (k.as_str(), v.as_str())).collect();
        match (self.kind, &device.language) {
            (Kind::Firmware, Language::Grbl(gcode)) => match options.first() {
                Some((key, value)) => Err(PeerError::option(self.name, key, value)),
                None => Ok(Box::new(Firmware::new(Settings::default(), &gcode.pen))),
            },
            // Other plotters' units are not its own.
            (Kind::Firmware, Language::Hpgl(hpgl))
                if Settings::default().get(PLOTTER_UNIT).is_some_and(|(unit, _)| unit == hpgl.unit_mm) =>
            {
                match options.first() {
                    Some((key, value)) => Err(PeerError::option(self.name, key, value)),
                    None => Ok(Box::new(Firmware::new(Settings::default(), &HPGL_PEN).in_hpgl())),
                }
            }
            (Kind::Grbl(dialect), Language::Grbl(gcode)) => Ok(Box::new(Grbl::new(dialect, &gcode.pen, &options)?)),
            (Kind::Marlin, Language::Marlin(gcode)) => Ok(Box::new(Marlin::new(&gcode.pen, &options)?)),
            (Kind::Hpgl, Language::Hpgl(hpgl)) => Ok(Box::new(Hpgl::new(hpgl, &device.papers, &options)?)),
            (_, language) => Err(PeerError::Language {
                name: self.name,
                device: device.name.clone(),
                speaks: language.name(),
                fitting: self.device,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::find;

    #[test]
    fn ports_are_told_apart() {
        for port in ["/dev/ttyUSB0", "COM3", "simple", "si", ""] {
            assert_eq!(SimName::parse(port), None, "{port}");
        }
        for (port, device) in [
            ("sim", "penvis"),
            ("sim:firmware", "penvis"),
            ("sim:grbl,$32=1,rx=64", "grbl-servo"),
            ("sim:marlin,advanced-ok=1", "marlin-servo"),
        ] {
            let name = SimName::parse(port).unwrap().unwrap();
            assert_eq!(name.default_device(), device);
            name.peer(&find(device).unwrap()).unwrap();
        }
    }

    #[test]
    fn what_there_is_not_is_refused_in_a_line() {
        for (port, device, part) in [
            ("sim:bgrl", "penvis", "no simulated plotter `bgrl`; it is one of firmware, grbl, grblhal"),
            ("sim:grbl,rx=many", "penvis", "sim:grbl: `rx=many` is no option"),
            ("sim:grbl,$7=1", "penvis", "`$7=1`"),
            ("sim:hpgl7475a,paper=a9", "hp7475a", "`paper=a9`"),
            ("sim:marlin,rx=3", "marlin-servo", "sim:marlin: `rx=3`"),
            ("sim:firmware,rx=3", "penvis", "`rx=3`"),
            ("sim:grbl", "hp7475a", "`hp7475a` speaks hpgl"),
            ("sim", "marlin-z", "`marlin-z` speaks marlin"),
        ] {
            let made = SimName::parse(port).unwrap().and_then(|name| name.peer(&find(device).unwrap()));
            let message = made.unwrap_err().to_string();
            assert!(message.contains(part) && !message.contains('\n'), "{message}");
        }
    }
}
