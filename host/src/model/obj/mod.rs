//! The OBJ reader: polygons and free-form surfaces.
//!
//! Statements are a keyword and its words, on a line that `\` continues. Vertices are numbered from 1, or from the last one
//! back when the number is negative. Polygons (`f`) become a [mesh](super::mesh); free-form surfaces are read as
//! [they are](freeform). What only colours, textures or smooths a model carries no shape and is left out.

mod basis;
mod freeform;
#[cfg(test)]
mod tests;

use glam::DVec4;
use penvis_core::scene::{Scene, SceneSurface};

use self::freeform::FreeForm;
use super::fault::{Fault, ReadError};
use super::format::ModelFormat;
use super::import::{Import, Reading, Report};
use super::mesh::{Decimals, MOST_CORNERS, Mesh, PROGRESS_STEP};
use super::source::Source;
use super::text::{Lines, number, shown};

/// Polygons and free-form surfaces, as most modellers write them.
pub(super) const FORMAT: ModelFormat =
    ModelFormat { name: "OBJ", extensions: &["obj"], looks_like: |source| looks_like(source.head()), read };

/// Keywords that say nothing of the shape.
const SHAPELESS: &[&str] = &[
    "vt",
    "vn",
    "mg",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "maplib",
    "usemap",
    "usemtl",
    "mtllib",
    "shadow_obj",
    "trace_obj",
    "ctech",
    "stech",
];

/// Keywords of shapes that are not drawn, with what they are called in the report.
const SKIPPED: &[(&str, &str)] = &[
    ("p", "points (p)"),
    ("l", "lines (l)"),
    ("s", "smoothing groups (s)"),
    ("call", "other files (call)"),
    ("csh", "commands (csh)"),
    ("bsp", "patches of version 2 (bsp)"),
    ("bzp", "patches of version 2 (bzp)"),
    ("cdc", "curves of version 2 (cdc)"),
    ("cdp", "patches of version 2 (cdp)"),
    ("res", "segments of version 2 (res)"),
];

/// Keywords that are read, but for those of free-form geometry.
const READ: &[&str] = &["v", "f", "g", "o"];

/// Most keywords that are in no description of the format: with more, a file is of another one.
const MOST_UNKNOWN: usize = 16;

/// Most bytes of a statement with all lines that continue it.
const LONGEST_STATEMENT: usize = 1 << 25;

fn is_known(keyword: &str) -> bool {
    READ.contains(&keyword)
        || SHAPELESS.contains(&keyword)
        || SKIPPED.iter().any(|s| s.0 == keyword)
        || freeform::KEYWORDS.contains(&keyword)
}

/// Whether a file begins with statements of the format, one of which is a vertex.
fn looks_like(head: &[u8]) -> bool {
    /// Statements that are looked at.
    const FIRST: usize = 100;
    let text = String::from_utf8_lossy(head);
    let mut continues = false;
    let mut vertices = 0;
    for line in text.lines().take(FIRST) {
        let continued = std::mem::replace(&mut continues, line.trim_end().ends_with('\\'));
        let words: Vec<&str> = line.split('#').next().unwrap_or("").split_ascii_whitespace().collect();
        let (Some(keyword), false) = (words.first(), continued) else { continue };
        if !is_known(keyword) {
            return false;
        }
        vertices += usize::from(*keyword == "v" && words.len() >= 4 && words[1..4].iter().all(|w| number(w).is_ok()));
    }
    vertices > 0
}

fn read(source: &mut Source, reading: &Reading<'_>) -> Result<Import, ReadError> {
    if source.length() == 0 {
        return Err(Fault::whole("is empty").into());
    }
    let name = source.stem().to_owned();
    let total = source.length();
    let mut file = File::new();
    let mut lines = Lines::new(source.stream()?);
    let mut statement = String::new();
    // The line on which the statement began.
    let mut start = 0;
    while lines.advance()? {
        if lines.number() % PROGRESS_STEP == 0 {
            reading.progress((lines.bytes_read() >> 10) as usize, (total >> 10) as usize)?;
        }
        if statement.is_empty() {
            start = lines.number();
        }
        let line = lines.line();
        let line = line.trim_end();
        if let Some(begun) = line.strip_suffix('\\') {
            statement.push_str(begun);
            statement.push(' ');
            if statement.len() > LONGEST_STATEMENT {
                let problem = format!("goes on over lines for more than {LONGEST_STATEMENT} bytes");
                return Err(Fault::line(start, problem).into());
            }
            continue;
        }
        statement.push_str(line);
        file.statement(&statement, start).map_err(|problem| Fault::line(start, problem))?;
        statement.clear();
    }
    if !statement.is_empty() {
        return Err(Fault::line(start, "goes on, but the file ends; it is cut off").into());
    }
    file.finish(name, reading)
}

/// A file as far as it is read.
struct File {
    /// Vertices with their weights, which coordinates are not multiplied by.
    vertices: Vec<DVec4>,
    /// Index in the mesh of each vertex that a facet has.
    in_mesh: Vec<u32>,
    /// Of the coordinates of vertices.
    decimals: Decimals,
    mesh: Mesh,
    free: FreeForm,
    report: Report,
    unknown: usize,
}

/// A vertex that no facet has yet.
const NOT_IN_MESH: u32 = u32::MAX;

impl File {
    fn new() -> Self {
        Self {
            vertices: Vec::new(),
            in_mesh: Vec::new(),
            decimals: Decimals::default(),
            mesh: Mesh::new("line"),
            free: FreeForm::default(),
            report: Report::default(),
            unknown: 0,
        }
    }

    fn statement(&mut self, statement: &str, line: usize) -> Result<(), String> {
        let statement = statement.split('#').next().unwrap_or("");
        let mut words = statement.split_ascii_whitespace();
        let Some(keyword) = words.next() else { return Ok(()) };
        match keyword {
            "v" => self.vertex(words),
            "f" | "fo" => self.facet(words, line),
            "g" | "o" => {
                let name: Vec<&str> = words.collect();
                let name = shown(&name.join(" "));
                self.mesh.begin_part(&name);
                self.free.begin_part(&name);
                Ok(())
            }
            _ if SHAPELESS.contains(&keyword) => Ok(()),
            _ if freeform::KEYWORDS.contains(&keyword) => {
                let words: Vec<&str> = words.collect();
                self.free.statement(keyword, &words, line, &self.vertices, &mut self.report)
            }
            _ => self.skip(keyword, words.next()),
        }
    }

    /// Counts what is not drawn.
    fn skip(&mut self, keyword: &str, word: Option<&str>) -> Result<(), String> {
        if let Some((_, name)) = SKIPPED.iter().find(|s| s.0 == keyword) {
            // Smoothing that is turned off takes nothing away.
            if !(keyword == "s" && matches!(word, Some("off" | "0"))) {
                self.report.skip(*name);
            }
            return Ok(());
        }
        let name = format!("statements {}", shown(keyword));
        if !self.report.skipped.contains_key(&name) {
            self.unknown += 1;
            if self.unknown > MOST_UNKNOWN {
                return Err(format!("`{}` is one unknown keyword too many; this is no OBJ file", shown(keyword)));
            }
        }
        self.report.skip(name);
        Ok(())
    }

    fn vertex<'a>(&mut self, words: impl Iterator<Item = &'a str>) -> Result<(), String> {
        let mut numbers = [0.0; 7];
        let mut count = 0;
        for word in words {
            if count == numbers.len() {
                return Err("has more numbers than a vertex with a weight or a colour".to_owned());
            }
            numbers[count] = number(word)?;
            count += 1;
            if count <= 3 {
                self.decimals.count(word);
            }
        }
        if count < 3 {
            return Err(format!("has {count} numbers; a vertex has x, y and z"));
        }
        if self.vertices.len() == MOST_CORNERS {
            return Err(format!("is vertex {}; no pen can draw so much, so simplify the model", MOST_CORNERS + 1));
        }
        // Six numbers are a point and a colour.
        let weight = if count == 4 { numbers[3] } else { 1.0 };
        self.vertices.push(DVec4::new(numbers[0], numbers[1], numbers[2], weight));
        self.in_mesh.push(NOT_IN_MESH);
        Ok(())
    }

    fn facet<'a>(&mut self, words: impl Iterator<Item = &'a str>, line: usize) -> Result<(), String> {
        let mut corners = Vec::new();
        for word in words {
            let vertex = word.split('/').next().unwrap_or("");
            let index = reference(vertex, self.vertices.len(), "vertex")?;
            if self.in_mesh[index] == NOT_IN_MESH {
                self.in_mesh[index] = self.mesh.point(self.vertices[index].truncate());
            }
            corners.push(self.in_mesh[index]);
        }
        if corners.len() < 3 {
            return Err(format!("has {} corners; a face has three or more", corners.len()));
        }
        self.mesh.facet(&corners, line).map_err(|fault| fault.problem)
    }

    fn finish(mut self, name: String, reading: &Reading<'_>) -> Result<Import, ReadError> {
        let mut report = self.report;
        let facets = self.mesh.len();
        let free = self.free.finish(&mut report)?;
        if facets == 0 && free.is_empty() {
            return Err(Fault::whole("has no face and no surface; there is nothing to draw").into());
        }
        self.vertices = Vec::new();
        let mut surfaces: Vec<SceneSurface> =
            self.mesh.into_surfaces(self.decimals.precision(), reading, &mut report)?;
        if surfaces.is_empty() && free.is_empty() {
            return Err(Fault::whole("has no face with an area; there is nothing to draw").into());
        }
        if !free.is_empty() {
            report.kinds.insert("free-form surface".to_owned(), free.len());
        }
        surfaces.extend(free);
        Ok(Import { scene: Scene { name, surfaces }, report, ..Import::default() })
    }
}

/// Index from 0 of what a word refers to, of `count` that there are so far.
///
/// # Errors
/// If it is no number of one of them.
fn reference(word: &str, count: usize, what: &str) -> Result<usize, String> {
    let number: i64 = word.parse().map_err(|_| format!("`{}` is not the number of a {what}", shown(word)))?;
    let index = if number < 0 { number.checked_add(count as i64) } else { number.checked_sub(1) };
    match index.and_then(|k| usize::try_from(k).ok()) {
        Some(index) if index < count => Ok(index),
        _ => Err(format!("refers to {what} {number} of {count} that are there so far")),
    }
}
