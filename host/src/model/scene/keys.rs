//! The keys of a TOML file, each with its line, so that a message can say where it is wrong and what was likely meant.

use penvis_core::shape::ShapeError;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::model::fault::Fault;
use crate::model::text::shown;

/// Where the lines of a text begin.
pub(super) struct Lines(Vec<usize>);

impl Lines {
    pub(super) fn of(text: &str) -> Self {
        let after = text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(at, _)| at + 1);
        Self(std::iter::once(0).chain(after).collect())
    }

    /// Number of the line, from 1, in which the byte at an offset is.
    fn at(&self, offset: usize) -> usize {
        self.0.partition_point(|&start| start <= offset)
    }
}

/// The table that a text is.
///
/// # Errors
/// What is no TOML in it, and in which line.
pub(super) fn parse<'t>(text: &'t str, lines: &Lines) -> Result<Spanned<DeTable<'t>>, Fault> {
    DeTable::parse(text).map_err(|error| {
        let Some(span) = error.span() else {
            return Fault::whole(format!("cannot be read as TOML: {}", error.message()));
        };
        // The word that is wrong, if it is one; what is missing has none.
        let word = text.get(span.clone()).and_then(|words| words.lines().next()).unwrap_or_default();
        let quoted = if word.is_empty() { String::new() } else { format!(" at `{}`", shown(word)) };
        Fault::line(lines.at(span.start), format!("{}{quoted}", error.message()))
    })
}

/// A table whose keys are all known.
#[derive(Clone, Copy)]
pub(super) struct Table<'t> {
    lines: &'t Lines,
    /// Where it begins.
    pub(super) line: usize,
    /// What it describes, for messages.
    what: &'static str,
    entries: &'t DeTable<'t>,
}

impl<'t> Table<'t> {
    /// The table of a whole file.
    ///
    /// # Errors
    /// If it has another key than those `known`.
    pub(super) fn whole(
        entries: &'t DeTable<'t>,
        lines: &'t Lines,
        what: &'static str,
        known: &[&str],
    ) -> Result<Self, Fault> {
        Self { lines, line: 1, what, entries }.checked(known)
    }

    fn checked(self, known: &[&str]) -> Result<Self, Fault> {
        let unknown = self.entries.keys().filter(|key| !known.contains(&key.get_ref().as_ref()));
        let Some(first) = unknown.min_by_key(|key| key.span().start) else { return Ok(self) };
        // A key may be as long as the file; its beginning says what was meant.
        let key = shown(first.get_ref());
        let distance = |other: &str| strsim::damerau_levenshtein(&key, other);
        let nearest = known.iter().min_by_key(|other| distance(other)).copied().unwrap_or_default();
        let problem = format!(
            "there is no key `{key}` in {}; the nearest one is `{nearest}`, and all are {}",
            self.what,
            known.join(", ")
        );
        Err(Fault::line(self.lines.at(first.span().start), problem))
    }

    /// What a key says, if it is there.
    pub(super) fn get(&self, key: &'static str) -> Option<Item<'t>> {
        let (_, value) = self.entries.iter().find(|(own, _)| own.get_ref() == key)?;
        Some(Item { lines: self.lines, key, line: self.lines.at(value.span().start), value: value.get_ref() })
    }

    /// What a key says that must be there.
    ///
    /// # Errors
    /// If it is not.
    pub(super) fn need(&self, key: &'static str) -> Result<Item<'t>, Fault> {
        self.get(key).ok_or_else(|| self.fault(format!("{} needs the key `{key}`", self.what)))
    }

    /// What is wrong with the table as a whole.
    pub(super) fn fault(&self, problem: impl Into<String>) -> Fault {
        Fault::line(self.line, problem)
    }
}

/// What a key says.
#[derive(Clone, Copy)]
pub(super) struct Item<'t> {
    lines: &'t Lines,
    pub(super) key: &'t str,
    pub(super) line: usize,
    value: &'t DeValue<'t>,
}

impl<'t> Item<'t> {
    /// What is wrong with the value.
    pub(super) fn fault(&self, problem: impl AsRef<str>) -> Fault {
        Fault::line(self.line, format!("`{}` {}", self.key, problem.as_ref()))
    }

    /// What is wrong with a shape that has this key.
    pub(super) fn misshapen(&self, error: ShapeError) -> Fault {
        Fault::line(self.line, format!("`{}`: {error}", self.key))
    }

    fn is_no(&self, wanted: &str) -> Fault {
        let is = match self.value {
            DeValue::String(text) => format!("is the text \"{}\"", shown(text)),
            DeValue::Integer(number) => format!("is {}", shown(number.as_str())),
            DeValue::Float(number) => format!("is {}", shown(number.as_str())),
            DeValue::Boolean(value) => format!("is {value}"),
            DeValue::Datetime(_) => "is a date".to_owned(),
            DeValue::Array(items) => format!("is a list of {}", items.len()),
            DeValue::Table(_) => "is a table".to_owned(),
        };
        self.fault(format!("{is}; give {wanted}"))
    }

    pub(super) fn is_text(&self) -> bool {
        self.value.is_str()
    }

    pub(super) fn is_list(&self) -> bool {
        self.value.is_array()
    }

    pub(super) fn is_table(&self) -> bool {
        self.value.is_table()
    }

    /// A text.
    ///
    /// # Errors
    /// If it is none.
    pub(super) fn text(&self) -> Result<&'t str, Fault> {
        self.value.as_str().ok_or_else(|| self.is_no("a text in quotes"))
    }

    /// Yes or no.
    ///
    /// # Errors
    /// If it is neither.
    pub(super) fn flag(&self) -> Result<bool, Fault> {
        self.value.as_bool().ok_or_else(|| self.is_no("true or false"))
    }

    /// A finite number.
    ///
    /// # Errors
    /// If it is none.
    pub(super) fn number(&self) -> Result<f64, Fault> {
        let number = match self.value {
            // Beyond 2^53 the nearest double is meant.
            DeValue::Integer(n) => i64::from_str_radix(n.as_str(), n.radix()).ok().map(|n| n as f64),
            DeValue::Float(x) => x.as_str().parse().ok(),
            _ => None,
        };
        number.filter(|x: &f64| x.is_finite()).ok_or_else(|| self.is_no("a finite number"))
    }

    /// A number for which `holds`; `wanted` says which those are.
    ///
    /// # Errors
    /// If it is no such number.
    pub(super) fn number_that(&self, holds: impl Fn(f64) -> bool, wanted: &str) -> Result<f64, Fault> {
        match self.number() {
            Ok(x) if holds(x) => Ok(x),
            _ => Err(self.is_no(wanted)),
        }
    }

    /// A whole number from `least` to `most`.
    ///
    /// # Errors
    /// If it is none.
    pub(super) fn whole(&self, least: u32, most: u32) -> Result<u32, Fault> {
        let number = match self.value {
            DeValue::Integer(n) => u32::from_str_radix(n.as_str(), n.radix()).ok(),
            _ => None,
        };
        let wanted = || self.is_no(&format!("a whole number from {least} to {most}"));
        number.filter(|n| (least..=most).contains(n)).ok_or_else(wanted)
    }

    /// So many finite numbers.
    ///
    /// # Errors
    /// If it is no such list.
    pub(super) fn numbers<const N: usize>(&self) -> Result<[f64; N], Fault> {
        let wanted = || self.is_no(&format!("{N} numbers in brackets"));
        let items = self.items().map_err(|_| wanted())?;
        if items.len() != N {
            return Err(wanted());
        }
        let mut numbers = [0.0; N];
        for (number, item) in numbers.iter_mut().zip(items) {
            *number = item.number()?;
        }
        Ok(numbers)
    }

    /// The members of a list.
    ///
    /// # Errors
    /// If it is none.
    pub(super) fn items(&self) -> Result<Vec<Self>, Fault> {
        let items = self.value.as_array().ok_or_else(|| self.is_no("a list in brackets"))?;
        let item = |value: &'t Spanned<DeValue<'t>>| Self {
            line: self.lines.at(value.span().start),
            value: value.get_ref(),
            ..*self
        };
        Ok(items.iter().map(item).collect())
    }

    /// What a table says whose keys may be anything, in the order of the file; each has the line of its key.
    ///
    /// # Errors
    /// If it is none; `wanted` says what it is to be.
    pub(super) fn entries(&self, wanted: &str) -> Result<Vec<Self>, Fault> {
        let entries = self.value.as_table().ok_or_else(|| self.is_no(wanted))?;
        let mut all: Vec<(usize, Self)> = Vec::with_capacity(entries.len());
        for (key, value) in entries {
            let at = key.span().start;
            let (key, value) = (key.get_ref().as_ref(), value.get_ref());
            all.push((at, Self { lines: self.lines, key, line: self.lines.at(at), value }));
        }
        all.sort_by_key(|(at, _)| *at);
        Ok(all.into_iter().map(|(_, item)| item).collect())
    }

    /// A table that has none but these keys.
    ///
    /// # Errors
    /// If it is none, or has another key.
    pub(super) fn table(&self, what: &'static str, known: &[&str]) -> Result<Table<'t>, Fault> {
        let wanted = || self.is_no(&format!("a table of {}", known.join(", ")));
        let entries = self.value.as_table().ok_or_else(wanted)?;
        Table { lines: self.lines, line: self.line, what, entries }.checked(known)
    }
}
