//! Where profiles are, what they inherit, and in which file and line a key stands.

use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use directories::ProjectDirs;
use toml::de::{DeTable, DeValue};

use super::{BUILT_IN, DeviceError};
use crate::message::one_line;

/// Most bytes of a profile.
const LARGEST: u64 = 1 << 20;

/// Longest chain of `inherits`; a longer one is a circle.
const INHERIT_MAX: usize = 16;

/// End of the name of a profile's file.
const EXTENSION: &str = ".toml";

/// Folder of the user's own profiles, whether it exists or not: `~/.config/penvis/devices` on Linux. None without a home.
#[must_use]
pub fn user_folder() -> Option<PathBuf> {
    ProjectDirs::from("", "", "penvis").map(|dirs| dirs.config_dir().join("devices"))
}

/// Names of the profiles in a folder, sorted. A folder that is not there holds none.
pub(super) fn names_in(folder: &Path) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let name = |entry: std::fs::DirEntry| {
        let name = entry.file_name().into_string().ok()?;
        name.strip_suffix(EXTENSION).filter(|name| is_name(name)).map(str::to_owned)
    };
    let mut names: Vec<_> = entries.flatten().filter_map(name).collect();
    names.sort();
    names
}

/// Whether a device may be called so: what is no name is a path.
fn is_name(name: &str) -> bool {
    !name.is_empty()
        && !name.starts_with('.')
        && name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.'))
}

/// A profile as it is written.
#[derive(Clone, Debug)]
struct Source {
    /// What messages call it: the path, or the name of a built-in profile.
    name: String,
    /// Its file, unless it is built in.
    path: Option<PathBuf>,
    text: String,
}

/// A profile and those that it inherits from, the nearest first.
#[derive(Debug)]
pub(super) struct Sources(Vec<Source>);

impl Sources {
    /// The profile of this name, or in this file, and what it inherits from. `folder` is where the user's own are.
    pub(super) fn of(name: &str, folder: Option<&Path>) -> Result<(Self, toml::Table), DeviceError> {
        Self::from(open(name, None, folder)?, folder)
    }

    /// The profile that is this text, and what it inherits from.
    pub(super) fn of_text(text: &str, file: &str, folder: Option<&Path>) -> Result<(Self, toml::Table), DeviceError> {
        let path = file.ends_with(EXTENSION).then(|| PathBuf::from(file));
        Self::from(Source { name: file.to_owned(), path, text: text.to_owned() }, folder)
    }

    fn from(first: Source, folder: Option<&Path>) -> Result<(Self, toml::Table), DeviceError> {
        let mut sources = Self(Vec::new());
        let mut table = toml::Table::new();
        let mut source = first;
        loop {
            let mut base = parse(&source)?;
            let next = base.remove("inherits");
            overlay(&mut base, table);
            table = base;
            sources.0.push(source.clone());
            match next {
                None => return Ok((sources, table)),
                Some(toml::Value::String(_)) if sources.0.len() == INHERIT_MAX => {
                    return Err(sources.fault("inherits", "goes round in a circle"));
                }
                Some(toml::Value::String(next)) => source = open(&next, Some(&source), folder)?,
                Some(_) => {
                    return Err(Self(vec![source]).fault("inherits", "must be the name of a device"));
                }
            }
        }
    }

    /// The error that says what is wrong with a key, in the file and line where it stands. Parts of a key are separated by
    /// dots, and members of a list are numbered in brackets from 0.
    pub(super) fn fault(&self, key: &str, problem: &str) -> DeviceError {
        let found = self.0.iter().find_map(|source| Some((source, line_of(&source.text, key)?)));
        let (file, line) = match (found, self.0.first()) {
            (Some((source, line)), _) => (source.name.clone(), Some(line)),
            (None, first) => (first.map(|first| first.name.clone()).unwrap_or_default(), None),
        };
        DeviceError::Profile { file, line, what: one_line(&format!("`{key}` {problem}")) }
    }
}

/// The profile of a name: a path when it ends in `.toml`, else one of the user's own, else a built-in one. In a profile that
/// inherits, a path begins at the profile's own folder, and its own name means the one that it goes before.
fn open(name: &str, heir: Option<&Source>, folder: Option<&Path>) -> Result<Source, DeviceError> {
    if name.ends_with(EXTENSION) {
        let base = heir.and_then(|heir| heir.path.as_deref()).and_then(Path::parent);
        return read(&base.map_or_else(|| PathBuf::from(name), |base| base.join(name)));
    }
    if let Some(folder) = folder.filter(|_| is_name(name)) {
        let path = folder.join(format!("{name}{EXTENSION}"));
        let is_heir = heir.is_some_and(|heir| heir.path.as_ref() == Some(&path));
        if path.is_file() && !is_heir {
            return read(&path);
        }
    }
    let found = BUILT_IN.iter().find(|(known, _)| *known == name);
    match found {
        Some((_, text)) => Ok(Source { name: name.to_owned(), path: None, text: (*text).to_owned() }),
        None => Err(DeviceError::Unknown { name: one_line(name), inherited_by: heir.map(|heir| heir.name.clone()) }),
    }
}

fn read(path: &Path) -> Result<Source, DeviceError> {
    let name = path.display().to_string();
    let mut text = String::new();
    match File::open(path).and_then(|file| file.take(LARGEST + 1).read_to_string(&mut text)) {
        Err(source) => Err(DeviceError::Read { file: name, source }),
        Ok(_) if text.len() as u64 > LARGEST => {
            let what = format!("is larger than {} KiB, too large for a profile; check the path", LARGEST >> 10);
            Err(DeviceError::Profile { file: name, line: None, what })
        }
        Ok(_) => Ok(Source { name, path: Some(path.to_owned()), text }),
    }
}

fn parse(source: &Source) -> Result<toml::Table, DeviceError> {
    source.text.parse::<toml::Table>().map_err(|e: toml::de::Error| DeviceError::Profile {
        file: source.name.clone(),
        line: e.span().map(|span| line_at(&source.text, span.start)),
        what: one_line(e.message()),
    })
}

/// Number of the line, from 1, in which the byte at an offset is.
fn line_at(text: &str, offset: usize) -> usize {
    1 + text.bytes().take(offset).filter(|byte| *byte == b'\n').count()
}

/// The line in which a key of a profile stands.
fn line_of(text: &str, key: &str) -> Option<usize> {
    let document = DeTable::parse(text).ok()?;
    let mut table = document.get_ref();
    let mut line = None;
    let mut parts = key.split('.').peekable();
    while let Some(part) = parts.next() {
        let (name, index) = match part.split_once('[') {
            Some((name, rest)) => (name, rest.split(']').next()?.parse::<usize>().ok()),
            None => (part, None),
        };
        let (at, value) = table.get_key_value(name)?;
        line = Some(line_at(text, at.span().start));
        let mut value = value.get_ref();
        if let (Some(index), DeValue::Array(list)) = (index, value) {
            let member = list.get(index)?;
            line = Some(line_at(text, member.span().start));
            value = member.get_ref();
        }
        match value {
            DeValue::Table(inner) => table = inner,
            _ if parts.peek().is_none() => {}
            _ => return None,
        }
    }
    line
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
    use std::fs;

    use super::*;

    #[test]
    fn keys_are_found_in_their_lines() {
        let text = "name = 'x'\n\n[gcode]\nrx_bytes = 1\npen = { kind = 'z',\n feed = 3 }\n[[papers]]\nname = 'a'\n[[papers]]\n\nx_range = [0,\n 1]\n";
        let table = [
            ("name", Some(1)),
            ("gcode", Some(3)),
            ("gcode.rx_bytes", Some(4)),
            ("gcode.pen.feed", Some(6)),
            ("papers[1].x_range", Some(11)),
            ("papers[1].x_range[1]", Some(12)),
            ("gcode.pen.up", None),
            ("papers[2].name", None),
            ("name.first", None),
            ("", None),
        ];
        for (key, line) in table {
            assert_eq!(line_of(text, key), line, "{key}");
        }
    }

    #[test]
    fn the_users_own_profiles_go_before_the_built_in_ones() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("grbl-servo.toml"), "inherits = 'grbl-servo'\ndraw_feed = 7.0\n").unwrap();
        fs::write(at("mine.toml"), "inherits = 'parts/half.toml'\nname = 'mine'\n").unwrap();
        fs::create_dir(at("parts")).unwrap();
        fs::write(at("parts/half.toml"), "inherits = 'grbl-servo'\n[gcode]\nrx_bytes = 300\n").unwrap();
        fs::write(at(".hidden.toml"), "").unwrap();
        fs::write(at("notes.txt"), "").unwrap();
        assert_eq!(names_in(folder.path()), ["grbl-servo", "mine"]);

        let (_, table) = Sources::of("mine", Some(folder.path())).unwrap();
        assert_eq!(table["draw_feed"].as_float(), Some(7.0));
        assert_eq!(table["gcode"]["rx_bytes"].as_integer(), Some(300));
        assert_eq!(table["name"].as_str(), Some("mine"));
        let error = Sources::of("mine.toml", Some(folder.path())).unwrap_err().to_string();
        assert!(error.contains("cannot be read"), "a path begins where the program was started: {error}");
        let (_, table) = Sources::of("grbl-servo", None).unwrap();
        assert_eq!(table["draw_feed"].as_float(), Some(2000.0));
        assert!(Sources::of("../mine", Some(&at("parts"))).is_err());
    }

    #[test]
    fn faults_are_told_where_they_stand_also_in_what_is_inherited() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        fs::write(at("base.toml"), "inherits = 'grbl-servo'\n\nbaud = 0\n").unwrap();
        fs::write(at("mine.toml"), "name = 'mine'\ninherits = 'base.toml'\n").unwrap();
        let (sources, _) = Sources::of(at("mine.toml").to_str().unwrap(), None).unwrap();
        let message = |key: &str| sources.fault(key, "is wrong").to_string();
        assert!(message("baud").contains("base.toml, line 3: `baud` is wrong"), "{}", message("baud"));
        assert!(message("name").contains("mine.toml, line 1: "), "{}", message("name"));
        assert!(message("gcode.pen.up").contains("grbl-servo, line "), "{}", message("gcode.pen.up"));
        assert!(message("nothing").contains("mine.toml: `nothing`"), "{}", message("nothing"));
    }
}
