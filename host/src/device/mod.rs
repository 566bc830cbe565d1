//! Plotters as data: a profile is a TOML file that says what a plotter speaks, how far it reaches, and how its pen moves.
//!
//! A profile may say `inherits = "NAME"`; its keys then replace those of the named one, table by table. Profiles that come
//! with the program are compiled in; a profile of one's own is given by the path of its file, which ends in `.toml`, or by
//! its name when it is in [`user_folder`], where it goes before a built-in one.

mod gcode;
mod place;
mod profile;
mod source;
mod template;

use std::path::{Path, PathBuf};

use thiserror::Error;

pub use gcode::{ARC_TOLERANCE_MM, Dialect, Gcode, Pen, Streaming};
pub use place::{PlaceError, Placement};
pub use profile::{Axes, Device, Flow, Handshake, Hpgl, Language, Origin, Paper};
pub use source::user_folder;
pub(crate) use template::MM_MIN_PER_CM_S;

use source::Sources;

/// The profiles that come with the program: name and text.
const BUILT_IN: &[(&str, &str)] = &[
    ("grbl-servo", include_str!("../../devices/grbl-servo.toml")),
    ("grbl-z", include_str!("../../devices/grbl-z.toml")),
    ("grblhal", include_str!("../../devices/grblhal.toml")),
    ("fluidnc", include_str!("../../devices/fluidnc.toml")),
    ("marlin-servo", include_str!("../../devices/marlin-servo.toml")),
    ("marlin-z", include_str!("../../devices/marlin-z.toml")),
    ("penvis", include_str!("../../devices/penvis.toml")),
    ("penvis-hpgl", include_str!("../../devices/penvis-hpgl.toml")),
    ("hpgl2", include_str!("../../devices/hpgl2.toml")),
    ("hp7475a", include_str!("../../devices/hp7475a.toml")),
    ("hp7470a", include_str!("../../devices/hp7470a.toml")),
    ("hp7440a", include_str!("../../devices/hp7440a.toml")),
    ("hp7550a", include_str!("../../devices/hp7550a.toml")),
    ("dxy1100", include_str!("../../devices/dxy1100.toml")),
    ("dxy1300", include_str!("../../devices/dxy1300.toml")),
];

/// Name of the device that is used when none is asked for.
pub const DEFAULT: &str = "grbl-servo";

/// Device for HPGL when none is asked for.
pub const DEFAULT_HPGL: &str = "hp7475a";

/// Why a device is not available.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// No such name.
    #[error("{}there is no device `{name}`; it is one of {}, one of your own in {}, or the path of a profile ending in .toml",
        inherited_by.as_ref().map(|heir| format!("device profile {heir}: `inherits`: ")).unwrap_or_default(),
        names().join(", "), folder_text())]
    Unknown {
        /// The name asked for.
        name: String,
        /// The profile that inherits from it.
        inherited_by: Option<String>,
    },
    /// A profile says something that it may not, or leaves something out.
    #[error("device profile {file}{}: {what}", line.map(|line| format!(", line {line}")).unwrap_or_default())]
    Profile {
        /// The file, or the name of a built-in profile.
        file: String,
        /// The line of the key, when it stands anywhere.
        line: Option<usize>,
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

/// The folder of the user's profiles, for messages.
fn folder_text() -> String {
    user_folder().map_or_else(|| "your configuration folder".into(), |folder| folder.display().to_string())
}

/// A device that can be asked for by its name.
#[derive(Debug)]
pub struct Listed {
    /// Its name.
    pub name: String,
    /// Its file when it is one of the user's own.
    pub path: Option<PathBuf>,
    /// The device, or what is wrong with its profile.
    pub device: Result<Device, DeviceError>,
}

/// The devices that can be asked for by name: those that come with the program, unless one of the user's own goes before
/// them, then the user's.
#[must_use]
pub fn list() -> Vec<Listed> {
    list_in(user_folder().as_deref())
}

fn list_in(folder: Option<&Path>) -> Vec<Listed> {
    let own = folder.map(source::names_in).unwrap_or_default();
    let built_in = names().into_iter().map(str::to_owned).filter(|name| !own.contains(name)).map(|name| (name, None));
    let own = own.iter().filter_map(|name| Some((name.clone(), Some(folder?.join(format!("{name}.toml"))))));
    built_in.chain(own).map(|(name, path)| Listed { device: find_in(&name, folder), name, path }).collect()
}

/// The device of this name, or the one in this file when it ends in `.toml`.
///
/// # Errors
/// [`DeviceError`]: no such name, or a profile that is not right.
pub fn find(name: &str) -> Result<Device, DeviceError> {
    find_in(name, user_folder().as_deref())
}

fn find_in(name: &str, folder: Option<&Path>) -> Result<Device, DeviceError> {
    let (sources, table) = Sources::of(name, folder)?;
    Device::from_table(table, &sources)
}

/// The TOML text of a device with everything that it inherits written out; it reads back as the same device.
///
/// # Errors
/// As [`find`].
pub fn resolved_toml(name: &str) -> Result<String, DeviceError> {
    let (sources, table) = Sources::of(name, user_folder().as_deref())?;
    Device::from_table(table.clone(), &sources)?;
    toml::to_string(&table).map_err(|e| DeviceError::Profile {
        file: name.to_owned(),
        line: None,
        what: crate::message::one_line(&e.to_string()),
    })
}

/// The text of an HPGL plotter's profile, as [`resolved_toml`] gives it, in which its buffer is kept from overflowing in this way.
///
/// # Errors
/// [`DeviceError`]: a text that is no profile.
pub fn with_handshake(profile: &str, handshake: Handshake) -> Result<String, DeviceError> {
    let bad = |what: String| DeviceError::Profile {
        file: "--handshake".to_owned(),
        line: None,
        what: crate::message::one_line(&what),
    };
    let mut table: toml::Table = toml::from_str(profile).map_err(|e| bad(e.to_string()))?;
    let value = toml::Value::try_from(handshake).map_err(|e| bad(e.to_string()))?;
    if let toml::Value::Table(hpgl) = table.entry("hpgl").or_insert_with(|| toml::Table::new().into()) {
        hpgl.insert("handshake".to_owned(), value);
    }
    toml::to_string(&table).map_err(|e| bad(e.to_string()))
}

impl Device {
    /// The device that the text of a profile describes; `file` is what messages call it.
    ///
    /// # Errors
    /// [`DeviceError`]: a profile that is not right, or one that it inherits from.
    pub fn from_toml(text: &str, file: &str) -> Result<Self, DeviceError> {
        let (sources, table) = Sources::of_text(text, file, user_folder().as_deref())?;
        Self::from_table(table, &sources)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn a_handshake_that_is_chosen_is_kept_with_the_profile() {
        let text = with_handshake(&resolved_toml("hp7475a").unwrap(), Handshake::EnqAck).unwrap();
        let Language::Hpgl(language) = Device::from_toml(&text, "test").unwrap().language else { panic!("no HPGL") };
        assert_eq!(language.handshake, Handshake::EnqAck);
        assert!(with_handshake("[", Handshake::Oa).is_err());
    }

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
            assert_eq!(Device::from_toml(&text, name).unwrap(), find(name).unwrap());
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
            ("inherits = 'grbl-servo'\nspeed = 3\n", &["speed", ".toml, line 2: "]),
            ("inherits = 'grbl-servo'\n[gcode.pen]\nkind = 'servo'\nupp = 3\n", &["`gcode.pen.upp`", "line 4"]),
            ("inherits = 'grbl-servo'\n[gcode.pen]\nup = 'high'\n", &["`gcode.pen.up`", "line 3"]),
            ("inherits = 'grbl-servo'\n[gcode.pen]\nindex = 1\n", &["`gcode.pen.index`", "Marlin"]),
            ("inherits = 'grbl-servo'\n[gcode.pen]\nsoft_steps = 99\n", &["`gcode.pen.soft_steps`", "1 to 50"]),
            ("inherits = 'grbl-servo'\n[gcode.pen]\nfeed = 1.0\n", &["`gcode.pen.feed`", "`servo`"]),
            ("inherits = 'grbl-z'\n[gcode.pen]\nsoft_mm = 9.0\n", &["`gcode.pen.soft_mm`", "line 3"]),
            ("inherits = 'grbl-servo'\n[gcode.pen]\nkind = 'z'\nup_mm = 1.0\n", &["`gcode.pen.feed` is missing"]),
            ("inherits = 'grbl-servo'\ndraw_feed = -1.0\n", &["draw_feed", "positive", "line 2"]),
            ("inherits = 'grbl-servo'\ntravel_mm = [inf, 1.0]\n", &["travel_mm", "line 2"]),
            (
                "inherits = 'grbl-servo'\n[gcode]\nstart = ['G21',\n 'M3 S{lift}']\n",
                &["{lift}", "{pen}, {up}", "line 4"],
            ),
            ("inherits = 'grbl-servo'\n[gcode]\ndialect = 'marlin'\n", &["`gcode.dialect`", "line 3"]),
            ("inherits = 'hp7475a'\n[hpgl]\npen_change = 'SP{pin};'\n", &["`hpgl.pen_change`", "line 3"]),
            ("inherits = 'hp7475a'\n[axes]\nswap = true\n", &["`axes`", "line 2"]),
            ("inherits = 'hp7475a'\nprotocol = 'grbl'\n", &["[gcode]"]),
            ("inherits = 'nobody'\n", &["nobody", "hp7475a", ".toml: `inherits`"]),
            ("inherits = 3\n", &["inherits", "line 1"]),
            ("name = \n", &["profile", "line 1"]),
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
    fn the_list_has_the_users_own_with_their_faults() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write("mine.toml", "inherits = 'grbl-z'\nname = 'mine'\n");
        write("bad.toml", "inherits = 'grbl-z'\nbaud = 'fast'\n");
        write("penvis.toml", "inherits = 'penvis'\nbaud = 9600\n");
        let list = list_in(Some(folder.path()));
        assert_eq!(list.len(), names().len() + 2);
        let of = |name: &str| list.iter().find(|listed| listed.name == name).unwrap();
        assert!(of("mine").device.is_ok() && of("mine").path.as_ref().unwrap().ends_with("mine.toml"));
        assert!(of("bad").device.as_ref().unwrap_err().to_string().contains("line 2"));
        assert_eq!(of("penvis").device.as_ref().unwrap().baud, 9600);
        assert!(of("grbl-z").path.is_none());
        assert_eq!(list_in(None).len(), names().len());
    }

    #[test]
    fn a_circle_of_inheritance_is_refused() {
        let file = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
        let path = file.path().to_str().unwrap().to_owned();
        std::fs::write(&path, format!("inherits = '{path}'\n")).unwrap();
        assert!(find(&path).unwrap_err().to_string().contains("circle"));
    }
}
