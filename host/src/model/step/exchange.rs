//! Entities of an exchange file (ISO 10303-21), with the place of each.

use std::io::{self, Read};

use step_io::parser::{Attribute, Graph, RawEntity, parse};

use super::super::fault::{Fault, ReadError};
use super::super::source::Source;
use super::super::text::shown;

/// A file's entities.
pub(super) struct Exchange {
    graph: Graph,
}

impl Exchange {
    /// Parses a file.
    ///
    /// # Errors
    /// Where the syntax is wrong.
    pub(super) fn parse(source: &mut Source) -> Result<Self, ReadError> {
        if source.length() == 0 {
            return Err(Fault::whole("is empty").into());
        }
        let mut statements = Statements { inner: source.text()?, line: 1, length: 0, fault: None };
        match parse(&mut statements) {
            Ok(graph) => Ok(Self { graph }),
            Err(step_io::Error::Io(error)) => Err(statements.fault.map_or_else(|| error.into(), Into::into)),
            Err(error) => Err(syntax(&error).into()),
        }
    }

    /// All entities, by their numbers.
    pub(super) fn entities(&self) -> impl Iterator<Item = Entity<'_>> {
        self.graph.entities.values().map(|raw| Entity { file: self, raw })
    }

    /// All entities that are of a type.
    pub(super) fn all<'a>(&'a self, name: &'static str) -> impl Iterator<Item = Part<'a>> {
        self.entities().filter_map(move |e| e.find(name))
    }

    /// What the parser put right, in its words.
    pub(super) fn repairs(&self) -> impl Iterator<Item = String> + '_ {
        self.graph.warnings.iter().map(|w| w.to_string().trim_start_matches("warning at ").to_owned())
    }
}

/// Most bytes of a statement: the parser holds one at a time, and points of a large mesh may be one.
const LONGEST_STATEMENT: usize = 64 << 20;

/// A file as the parser is given it: it ends where there is no text any more, or no end of a statement.
struct Statements<R> {
    inner: R,
    line: usize,
    /// Bytes since the last semicolon.
    length: usize,
    fault: Option<Fault>,
}

impl<R: Read> Read for Statements<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.inner.read(buffer)?;
        for byte in &buffer[..count] {
            match byte {
                b'\n' => self.line += 1,
                b';' => self.length = 0,
                0 => {
                    self.fault = Some(Fault::line(self.line, "has zero bytes, not text; it is cut off, so get it anew"))
                }
                _ => {}
            }
            self.length += 1;
            if self.length > LONGEST_STATEMENT {
                let problem = format!("has no semicolon in {} MiB; it is no exchange file", LONGEST_STATEMENT >> 20);
                self.fault = Some(Fault::line(self.line, problem));
            }
            if self.fault.is_some() {
                return Err(io::Error::from(io::ErrorKind::InvalidData));
            }
        }
        Ok(count)
    }
}

/// The message of the parser with its place in front.
fn syntax(error: &step_io::Error) -> Fault {
    let text = error.to_string();
    for prefix in ["parse error at ", "lex error at ", "read error at "] {
        if let Some((place, problem)) = text.strip_prefix(prefix).and_then(|rest| rest.split_once(": ")) {
            return Fault::at(place, problem);
        }
    }
    Fault::whole(text.strip_prefix("parse error: ").unwrap_or(&text))
}

/// An entity: of one type, or of several that are parts of it.
#[derive(Clone, Copy)]
pub(super) struct Entity<'a> {
    file: &'a Exchange,
    raw: &'a RawEntity,
}

impl<'a> Entity<'a> {
    /// Its number.
    pub(super) fn id(self) -> u64 {
        self.raw.id()
    }

    /// Its type; the types of its parts in brackets if there are several.
    pub(super) fn name(self) -> String {
        match self.raw {
            RawEntity::Simple { name, .. } => name.clone(),
            RawEntity::Complex { parts, .. } => {
                let names: Vec<&str> = parts.iter().map(|p| p.name.as_str()).collect();
                format!("({})", names.join(" "))
            }
        }
    }

    /// How messages name it.
    pub(super) fn place(self) -> String {
        format!("line {}: #{} {}", self.raw.span().line, self.id(), self.name())
    }

    /// A fault in it.
    pub(super) fn fault(self, problem: impl Into<String>) -> Fault {
        Fault::at(self.place(), problem)
    }

    /// It as a thing of a type, if it is one.
    pub(super) fn find(self, name: &str) -> Option<Part<'a>> {
        let attributes = match self.raw {
            RawEntity::Simple { name: own, attributes, .. } => (own == name).then_some(attributes),
            RawEntity::Complex { parts, .. } => parts.iter().find(|p| p.name == name).map(|p| &p.attributes),
        };
        attributes.map(|attributes| Part { entity: self, attributes })
    }

    /// The first of several types that it is of.
    pub(super) fn find_any(self, names: &[&'static str]) -> Option<(&'static str, Part<'a>)> {
        names.iter().find_map(|&name| Some((name, self.find(name)?)))
    }

    /// Whether it is of one type, not of several.
    pub(super) fn is_simple(self) -> bool {
        matches!(self.raw, RawEntity::Simple { .. })
    }
}

/// An entity as a thing of one of its types: attributes count from 0 among those that the type, and in an entity of one
/// type the types it is derived from, have.
#[derive(Clone, Copy)]
pub(super) struct Part<'a> {
    pub(super) entity: Entity<'a>,
    attributes: &'a [Attribute],
}

impl<'a> Part<'a> {
    /// A fault in it.
    pub(super) fn fault(self, problem: impl Into<String>) -> Fault {
        self.entity.fault(problem)
    }

    /// Number of attributes.
    pub(super) fn len(self) -> usize {
        self.attributes.len()
    }

    /// An attribute.
    fn attribute(self, index: usize) -> Result<&'a Attribute, Fault> {
        self.attributes.get(index).ok_or_else(|| {
            self.fault(format!("has {} attributes; attribute {} is missing", self.attributes.len(), index + 1))
        })
    }

    /// What is wrong with an attribute that is not what it has to be.
    fn wrong(self, index: usize, expected: &str) -> Fault {
        let found = self.attributes.get(index).map_or_else(|| "nothing".to_owned(), written);
        self.fault(format!("attribute {} is {found}, not {expected}", index + 1))
    }

    /// Whether an attribute is there and has a value.
    pub(super) fn has(self, index: usize) -> bool {
        self.attributes.get(index).is_some_and(|a| !matches!(a, Attribute::Unset | Attribute::Derived))
    }

    /// A finite number.
    pub(super) fn real(self, index: usize) -> Result<f64, Fault> {
        real(self.attribute(index)?).ok_or_else(|| self.wrong(index, "a finite number"))
    }

    /// A number that is positive and finite.
    pub(super) fn positive(self, index: usize) -> Result<f64, Fault> {
        let value = self.real(index)?;
        if value > 0.0 { Ok(value) } else { Err(self.wrong(index, "a positive number")) }
    }

    /// A whole number that is not negative.
    pub(super) fn count(self, index: usize) -> Result<usize, Fault> {
        match self.attribute(index)? {
            Attribute::Integer(n) => usize::try_from(*n).map_err(|_| self.wrong(index, "a count")),
            _ => Err(self.wrong(index, "a count")),
        }
    }

    /// A text; empty if it is left out.
    pub(super) fn text(self, index: usize) -> &'a str {
        match self.attributes.get(index) {
            Some(Attribute::String(text)) => text,
            _ => "",
        }
    }

    /// A value of an enumeration; none if it is left out.
    pub(super) fn word(self, index: usize) -> Option<&'a str> {
        match self.attributes.get(index) {
            Some(Attribute::Enum(word)) => Some(word),
            _ => None,
        }
    }

    /// Whether something is so.
    pub(super) fn flag(self, index: usize) -> Result<bool, Fault> {
        match self.word(index) {
            Some("T") => Ok(true),
            Some("F") => Ok(false),
            _ => Err(self.wrong(index, ".T. or .F.")),
        }
    }

    /// Another entity.
    pub(super) fn entity(self, index: usize) -> Result<Entity<'a>, Fault> {
        self.referred(self.attribute(index)?).unwrap_or_else(|| Err(self.wrong(index, "an entity")))
    }

    /// The entities of a list.
    pub(super) fn entities(self, index: usize) -> Result<Vec<Entity<'a>>, Fault> {
        let items = self.list(index)?.iter();
        items.map(|a| self.referred(a).unwrap_or_else(|| Err(self.wrong(index, "a list of entities")))).collect()
    }

    /// The entities of a list of lists.
    pub(super) fn rows(self, index: usize) -> Result<Vec<Vec<Entity<'a>>>, Fault> {
        let wrong = || self.wrong(index, "a list of lists of entities");
        let row = |a: &'a Attribute| match a {
            Attribute::List(items) => items.iter().map(|a| self.referred(a).unwrap_or_else(|| Err(wrong()))).collect(),
            _ => Err(wrong()),
        };
        self.list(index)?.iter().map(row).collect()
    }

    /// The finite numbers of a list.
    pub(super) fn reals(self, index: usize) -> Result<Vec<f64>, Fault> {
        let wrong = || self.wrong(index, "a list of finite numbers");
        self.list(index)?.iter().map(|a| real(a).ok_or_else(wrong)).collect()
    }

    /// The finite numbers of a list of lists.
    pub(super) fn real_rows(self, index: usize) -> Result<Vec<Vec<f64>>, Fault> {
        let wrong = || self.wrong(index, "a list of lists of finite numbers");
        let row = |a: &'a Attribute| match a {
            Attribute::List(items) => items.iter().map(|a| real(a).ok_or_else(wrong)).collect(),
            _ => Err(wrong()),
        };
        self.list(index)?.iter().map(row).collect()
    }

    /// The counts of a list.
    pub(super) fn counts(self, index: usize) -> Result<Vec<usize>, Fault> {
        let count = |a: &Attribute| match a {
            Attribute::Integer(n) => usize::try_from(*n).ok(),
            _ => None,
        };
        let wrong = || self.wrong(index, "a list of counts");
        self.list(index)?.iter().map(|a| count(a).ok_or_else(wrong)).collect()
    }

    fn list(self, index: usize) -> Result<&'a [Attribute], Fault> {
        match self.attribute(index)? {
            Attribute::List(items) => Ok(items),
            _ => Err(self.wrong(index, "a list")),
        }
    }

    /// The entity that an attribute refers to; none if it refers to none.
    fn referred(self, attribute: &Attribute) -> Option<Result<Entity<'a>, Fault>> {
        let Attribute::EntityRef(id) = attribute else { return None };
        let file = self.entity.file;
        let raw = file.graph.get(*id);
        Some(raw.map(|raw| Entity { file, raw }).ok_or_else(|| {
            self.fault(format!(
                "refers to #{id}, which is not in the file; it is cut off or was edited, so get it anew"
            ))
        }))
    }
}

/// A finite number, bare or with its type.
fn real(attribute: &Attribute) -> Option<f64> {
    let value = match attribute {
        Attribute::Real(x) => *x,
        // Numbers without a point are read as whole ones, which beyond 2⁵³ are rounded as any other.
        Attribute::Integer(n) => *n as f64,
        Attribute::Typed { value, .. } => return real(value),
        _ => return None,
    };
    value.is_finite().then_some(value)
}

/// An attribute as it may stand in the file.
fn written(attribute: &Attribute) -> String {
    match attribute {
        Attribute::Integer(n) => n.to_string(),
        Attribute::Real(x) => x.to_string(),
        Attribute::String(text) => format!("'{}'", shown(text)),
        Attribute::Enum(word) => format!(".{}.", shown(word)),
        Attribute::Binary(_) => "binary".to_owned(),
        Attribute::EntityRef(id) => format!("#{id}"),
        Attribute::Unset => "$".to_owned(),
        Attribute::Derived => "*".to_owned(),
        Attribute::List(items) => format!("a list of {}", items.len()),
        Attribute::Typed { type_name, .. } => format!("a {}", shown(type_name)),
    }
}
