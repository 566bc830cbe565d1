//! Plotters as data: a profile is a TOML file that says what a plotter speaks, how far it reaches, and how its pen moves.
//!
//! A profile may say `inherits = "NAME"`; its keys then replace those of the named one, table by table. Profiles that come
//! with the program are compiled in; a profile of one's own is given by the path of its file, which ends in `.toml`.

mod gcode;
mod place;
mod profile;

use std::fs::File;
use std::io::Read;

use thiserror::Error;

pub use gcode::{Dialect, Gcode, Pen, Streaming};
pub use place::{PlaceError, Placement};
pub use profile::{Device, Flow, Hpgl, Language, Origin, Paper};

use crate::message::one_line;

/// The profiles that come with the program: name and text.
const BUILT_IN: &[(&str, &str)] = &[
    ("grbl-servo", include_str!("../../devices/grbl-servo.toml")),
    ("grbl-z", include_str!("../../devices/grbl-z.toml")),
    ("marlin-servo", include_str!("../../devices/marlin-servo.toml")),
    ("marlin-z", include_str!("../../devices/marlin-z.toml")),
    ("penvis", include_str!("../../devices/penvis.toml")),
    ("hp7475a", include_str!("../../devices/hp7475a.toml")),
    ("hp7470a", include_str!("../../devices/hp7470a.toml")),
    ("hp7440a", include_str!("../../devices/hp7440a.toml")),
    ("dxy1100", include_str!("../../devices/dxy1100.toml")),
];

/// Name of the device that is used when none is asked for.
pub const DEFAULT: &str = "grbl-servo";

/// Most bytes of a profile.
const LARGEST: u64 = 1 << 20;

/// Longest chain of `inherits`; a longer one is a circle.
const INHERIT_MAX: usize = 16;

/// Why a device is not available.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// No such name.
    #[error("there is no device `{name}`; it is one of {}, or the path of a profile ending in .toml", names().join(", "))]
    Unknown {
        /// The name asked for.
        name: String,
    },
    /// A profile says something that it may not, or leaves something out.
    #[error("device profile {file}: {what}")]
    Profile {
        /// The file, or the name of a built-in profile.
        file: String,
        /// What is wrong, with the key.
        what: String,
    },
    /// A profile cannot be read.
    #[error("device profile {file} cannot be read: {source}")]
    Read {
        /// The file.
        file: String,
        /// What the system said.
        source: std::io::Error,
    },
}

/// Names of the devices that come with the program.
#[must_use]
pub fn names() -> Vec<&'static str> {
    BUILT_IN.iter().map(|(name, _)| *name).collect()
}

/// The device of this name, or the one in this file when it ends in `.toml`.
///
/// # Errors
/// [`DeviceError`]: no such name, or a profile that is not right.
pub fn find(name: &str) -> Result<Device, DeviceError> {
    Device::from_table(resolved(name)?, name)
}

/// The TOML text of a device with everything that it inherits written out; it reads back as the same device.
///
/// # Errors
/// As [`find`].
pub fn resolved_toml(name: &str) -> Result<String, DeviceError> {
    let table = resolved(name)?;
    Device::from_table(table.clone(), name)?;
    toml::to_string(&table).map_err(|e| DeviceError::Profile { file: name.to_owned(), what: e.to_string() })
}

impl Device {
    /// The device that the text of a profile describes; `file` is what messages call it.
    ///
    /// # Errors
    /// [`DeviceError`]: a profile that is not right, or one that it inherits from.
    pub fn from_toml(text: &str, file: &str) -> Result<Self, DeviceError> {
        Self::from_table(followed(parse(text, file)?, file)?, file)
    }
}

/// The profile's table with `inherits` followed and removed.
fn resolved(name: &str) -> Result<toml::Table, DeviceError> {
    followed(parse(&read(name)?, name)?, name)
}

/// A profile's table with `inherits` followed and removed.
fn followed(mut base: toml::Table, name: &str) -> Result<toml::Table, DeviceError> {
    let mut file = name.to_owned();
    let mut table = toml::Table::new();
    for _ in 0..INHERIT_MAX {
        let next = base.remove("inherits");
        overlay(&mut base, table);
        table = base;
        match next {
            None => return Ok(table),
            Some(toml::Value::String(next)) => {
                base = parse(&read(&next)?, &next)?;
                file = next;
            }
            Some(_) => {
                return Err(DeviceError::Profile { file, what: "`inherits` must be the name of a device".into() });
            }
        }
    }
    Err(DeviceError::Profile { file: name.to_owned(), what: "`inherits` goes round in a circle".into() })
}

fn read(name: &str) -> Result<String, DeviceError> {
    if name.ends_with(".toml") {
        let mut text = String::new();
        let reading = File::open(name).and_then(|file| file.take(LARGEST + 1).read_to_string(&mut text));
        return match reading {
            Err(source) => Err(DeviceError::Read { file: name.to_owned(), source }),
            Ok(_) if text.len() as u64 > LARGEST => Err(DeviceError::Profile {
                file: name.to_owned(),
                what: format!("is larger than {} KiB, too large for a profile; check the path", LARGEST >> 10),
            }),
            Ok(_) => Ok(text),
        };
    }
    let found = BUILT_IN.iter().find(|(known, _)| *known == name);
    found.map(|(_, text)| (*text).to_owned()).ok_or_else(|| DeviceError::Unknown { name: name.to_owned() })
}

fn parse(text: &str, file: &str) -> Result<toml::Table, DeviceError> {
    text.parse::<toml::Table>()
        .map_err(|e| DeviceError::Profile { file: file.to_owned(), what: one_line(&e.to_string()) })
}

/// Puts the keys of `over` into `base`. Tables are merged, anything else is replaced; a table with another `kind` is replaced
/// too, for its keys mean something else.
fn overlay(base: &mut toml::Table, over: toml::Table) {
    for (key, value) in over {
        match (base.get_mut(&key), value) {
            (Some(toml::Value::Table(below)), toml::Value::Table(above))
                if above.get("kind").is_none_or(|kind| below.get("kind") == Some(kind)) =>
            {
                overlay(below, above);
            }
            (_, value) => {
                base.insert(key, value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn built_in_profiles_are_right_and_bear_their_own_names() {
        for (name, _) in BUILT_IN {
            let device = find(name).unwrap();
            assert_eq!(device.name, *name);
            assert!(!device.description.is_empty());
        }
        assert!(names().contains(&DEFAULT));
    }

    #[test]
    fn the_resolved_text_reads_back_as_the_same_device() {
        for (name, _) in BUILT_IN {
            let text = resolved_toml(name).unwrap();
            assert!(!text.contains("inherits"));
            assert_eq!(Device::from_table(parse(&text, name).unwrap(), name).unwrap(), find(name).unwrap());
        }
    }

    fn file(text: &str) -> tempfile::NamedTempFile {
        let mut file = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
        file.write_all(text.as_bytes()).unwrap();
        file
    }

    fn message(text: &str) -> String {
        find(file(text).path().to_str().unwrap()).unwrap_err().to_string()
    }

    #[test]
    fn a_file_inherits_table_by_table() {
        let file = file("name = 'mine'\ninherits = 'grbl-servo'\n[gcode.pen]\ndown = 700\n");
        let device = find(file.path().to_str().unwrap()).unwrap();
        let Language::Grbl(gcode) = device.language else { panic!("not grbl") };
        assert!(matches!(gcode.pen, Pen::Servo { up: 0, down: 700, .. }));
        assert_eq!(gcode.line_limit, 79);
    }

    #[test]
    fn another_kind_of_pen_inherits_no_keys_of_the_first() {
        let Language::Grbl(gcode) = find("grbl-z").unwrap().language else { panic!("not grbl") };
        assert!(matches!(gcode.pen, Pen::Z { .. }));
    }

    #[test]
    fn faults_name_the_key_and_the_file() {
        let table: &[(&str, &[&str])] = &[
            ("inherits = 'grbl-servo'\nspeed = 3\n", &["speed", ".toml"]),
            ("inherits = 'grbl-servo'\n[gcode.pen]\nkind = 'servo'\nupp = 3\n", &["upp"]),
            ("inherits = 'grbl-servo'\ndraw_feed = -1.0\n", &["draw_feed", "positive"]),
            ("inherits = 'grbl-servo'\ntravel_mm = [inf, 1.0]\n", &["travel_mm"]),
            ("inherits = 'hp7475a'\nprotocol = 'grbl'\n", &["[gcode]"]),
            ("inherits = 'nobody'\n", &["nobody", "hp7475a"]),
            ("inherits = 3\n", &["inherits"]),
            ("name = \n", &["profile"]),
            ("name = 'x'\n", &["description"]),
        ];
        for (text, words) in table {
            let message = message(text);
            for word in *words {
                assert!(message.contains(word), "{text:?} gave {message:?}, without {word:?}");
            }
            assert!(!message.contains('\n'), "{message:?} is more than a line");
        }
    }

    #[test]
    fn a_circle_of_inheritance_is_refused() {
        let file = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
        let path = file.path().to_str().unwrap().to_owned();
        std::fs::write(&path, format!("inherits = '{path}'\n")).unwrap();
        assert!(find(&path).unwrap_err().to_string().contains("circle"));
    }
}
