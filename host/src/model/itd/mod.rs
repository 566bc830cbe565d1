//! The reader of IRIT data trees: free-form surfaces, trimmed or not, and polygons.
//!
//! A file is a tree of blocks in brackets: `[OBJECT NAME …]` holds other objects or geometry, such as `[SURFACE …]`,
//! `[TRIMSRF …]`, `[MODEL …]` or `[POLYGON …]`. Attributes, blocks too, come before what they belong to, and carry no shape; comments
//! stand between blocks. Written after the section on the data file format of the user's manual of IRIT (G. Elber), also
//! at <https://paulbourke.net/dataformats/irit>. Polygons become a [mesh](super::mesh).

mod model;
mod spline;
#[cfg(test)]
mod tests;
mod token;
mod trimmed;

use std::io::BufRead;

use glam::DVec3;
use penvis_core::nurbs::Surface;
use penvis_core::scene::{Scene, SceneSurface};
use penvis_core::trim::Trims;

use self::spline::{Spline, Splines, whole};
use self::token::{Kind, Tokens};
use super::fault::{Fault, ReadError};
use super::format::ModelFormat;
use super::import::{Import, Reading, Report};
use super::mesh::{Decimals, MOST_CORNERS_OF_ONE, MOST_FACETS, Mesh};
use super::source::Source;
use super::text::{number, shown};

/// The data trees of IRIT.
pub(super) const FORMAT: ModelFormat =
    ModelFormat { name: "ITD", extensions: &["itd", "dat"], looks_like: |source| looks_like(source.head()), read };

/// Blocks that carry no shape.
const SHAPELESS: &[&str] = &["NUMBER", "STRING", "VECTOR", "PLANE"];

/// Blocks that are not drawn, with what they are called in the report.
const SKIPPED: &[(&str, &str)] = &[
    ("CURVE", "curves (CURVE)"),
    ("POLYLINE", "polylines (POLYLINE)"),
    ("POINTLIST", "clouds of points (POINTLIST)"),
    ("POINT", "points (POINT)"),
    ("CTLPT", "control points (CTLPT)"),
    ("MATRIX", "matrices (MATRIX)"),
    ("INSTANCE", "instances (INSTANCE)"),
    ("TRISRF", "triangular patches (TRISRF)"),
    ("TRIVAR", "trivariates (TRIVAR)"),
    ("MULTIVAR", "multivariates (MULTIVAR)"),
];

/// Most kinds of blocks that are in no description of the format: with more, a file is of another one.
const MOST_UNKNOWN: usize = 16;

/// Whether the first bracket of a file opens a block that begins one.
fn looks_like(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    let Some((_, rest)) = text.split_once('[') else { return false };
    let begins = |word: &str| rest.strip_prefix(word).is_some_and(|rest| rest.starts_with(|c: char| c.is_whitespace()));
    ["OBJECT", "SURFACE", "TRIMSRF"].iter().any(|word| begins(word))
}

fn read(source: &mut Source, reading: &Reading<'_>) -> Result<Import, ReadError> {
    let length = source.length();
    if length == 0 {
        return Err(Fault::whole("is empty").into());
    }
    let name = source.stem().to_owned();
    let mut file = File {
        tokens: Tokens::new(source.stream()?, length, reading),
        splines: Splines::default(),
        mesh: Mesh::new("line"),
        decimals: Decimals::default(),
        objects: Vec::new(),
        surfaces: Vec::new(),
        edges: 0,
        report: Report::default(),
        unknown: 0,
    };
    file.tree()?;
    file.finish(name, reading)
}

/// A file as far as it is read.
struct File<'a, R> {
    tokens: Tokens<'a, R>,
    splines: Splines,
    mesh: Mesh,
    /// Of the corners of polygons.
    decimals: Decimals,
    /// Names of the objects that are open; that of the one around it for an object without a name.
    objects: Vec<String>,
    surfaces: Vec<SceneSurface>,
    /// Number of the next edge that surfaces of models share.
    edges: u32,
    report: Report,
    /// Kinds of blocks that are not known.
    unknown: usize,
}

impl<R: BufRead> File<'_, R> {
    /// Reads all blocks.
    fn tree(&mut self) -> Result<(), ReadError> {
        loop {
            match self.tokens.after_comment()? {
                Kind::Open => self.block()?,
                // All other blocks are read to their ends, so that it is that of an object.
                Kind::Close => drop(self.objects.pop()),
                _ => return Ok(()),
            }
        }
    }

    /// Reads a block that is not an attribute, but of an object its beginning only.
    fn block(&mut self) -> Result<(), ReadError> {
        let line = self.tokens.line();
        let kind = self.tokens.next()?;
        if kind != Kind::Word {
            return Err(self.tokens.unexpected(kind, "the keyword of a block"));
        }
        let keyword = self.tokens.text().to_ascii_uppercase();
        match keyword.as_str() {
            "OBJECT" => self.object(),
            "SURFACE" => {
                let surface = self.splines.surface(&mut self.tokens)?;
                self.add(surface.map(|surface| (surface, None)), line)
            }
            "TRIMSRF" => {
                let trimmed = trimmed::trimmed(&mut self.tokens, &mut self.splines)?;
                self.add(trimmed, line)
            }
            "MODEL" => {
                for (line, part) in model::model(&mut self.tokens, &mut self.splines, &mut self.edges)? {
                    self.add(part, line)?;
                }
                Ok(())
            }
            "POLYGON" => self.polygon(line),
            "POLYSTRIP" => self.strip(line),
            _ => self.skip(&keyword),
        }
    }

    /// Reads the beginning of an object: its attributes and its name.
    fn object(&mut self) -> Result<(), ReadError> {
        let line = self.tokens.line();
        let depth = self.tokens.depth();
        let mut token = self.tokens.next()?;
        while token == Kind::Open {
            self.tokens.next()?;
            let keyword = self.tokens.text().to_ascii_uppercase();
            if is_geometry(&keyword) {
                return Err(self
                    .tokens
                    .fault(format!("has {keyword} where the object of line {line} has no name yet")));
            }
            self.tokens.leave_to(depth)?;
            token = self.tokens.next()?;
        }
        if !matches!(token, Kind::Word | Kind::Text) {
            return Err(self.tokens.unexpected(token, &format!("the name of the object of line {line}")));
        }
        let own = self.tokens.text();
        let name = match self.objects.last() {
            Some(around) if own.is_empty() || own == "NONE" => around.clone(),
            _ if own == "NONE" => String::new(),
            _ => shown(own),
        };
        self.objects.push(name);
        Ok(())
    }

    /// Leaves out a block that is not drawn, and counts it.
    fn skip(&mut self, keyword: &str) -> Result<(), ReadError> {
        if let Some((_, name)) = SKIPPED.iter().find(|s| s.0 == keyword) {
            self.report.skip(*name);
        } else if !SHAPELESS.contains(&keyword) {
            let name = format!("blocks {}", shown(keyword));
            if !self.report.skipped.contains_key(&name) {
                self.unknown += 1;
                if self.unknown > MOST_UNKNOWN {
                    let problem =
                        format!("`{}` is one unknown keyword too many; this is no file of IRIT", shown(keyword));
                    return Err(self.tokens.fault(problem));
                }
            }
            self.report.skip(name);
        }
        self.tokens.leave()
    }

    /// Adds a surface whose block begins on a line, or counts it.
    fn add(&mut self, spline: Spline<(Surface, Option<Trims>)>, line: usize) -> Result<(), ReadError> {
        match spline {
            Spline::Skipped(what) => self.report.skip(what),
            Spline::Read((surface, trims)) => {
                if self.surfaces.len() == MOST_FACETS {
                    let problem =
                        format!("is surface {}; no pen can draw so many, so simplify the model", MOST_FACETS + 1);
                    return Err(self.tokens.fault(problem));
                }
                let name = match self.objects.last().map(String::as_str) {
                    None | Some("") => format!("surface of line {line}"),
                    Some(object) => object.to_owned(),
                };
                self.surfaces.push(SceneSurface { trims, ..SceneSurface::new(name, surface) });
            }
        }
        Ok(())
    }

    fn polygon(&mut self, line: usize) -> Result<(), ReadError> {
        let corners = self.corners()?;
        Ok(self.mesh.facet(&corners, line)?)
    }

    /// Reads a strip of triangles, each of three corners that follow one another.
    fn strip(&mut self, line: usize) -> Result<(), ReadError> {
        let corners = self.corners()?;
        for (k, own) in corners.windows(3).enumerate() {
            // Every other one goes round the other way.
            let triangle = if k % 2 == 0 { [own[0], own[1], own[2]] } else { [own[1], own[0], own[2]] };
            self.mesh.facet(&triangle, line)?;
        }
        Ok(())
    }

    /// Reads the corners of a polygon or strip, to the end of its block.
    fn corners(&mut self) -> Result<Vec<u32>, ReadError> {
        let kind = self.tokens.after_attributes()?;
        let count = whole(&self.tokens, kind, "a number of points")?;
        if !(3..=MOST_CORNERS_OF_ONE).contains(&count) {
            let problem = format!("announces {count} points; polygons and strips have 3 to {MOST_CORNERS_OF_ONE}");
            return Err(self.tokens.fault(problem));
        }
        self.mesh.begin_part(self.objects.last().map_or("", String::as_str));
        let mut corners = Vec::new();
        for k in 0..count {
            match self.tokens.next()? {
                Kind::Open => corners.push(self.corner()?),
                Kind::Close => return Err(self.tokens.fault(format!("ends after {k} of {count} points"))),
                kind => return Err(self.tokens.unexpected(kind, "a point")),
            }
        }
        match self.tokens.next()? {
            Kind::Close => Ok(corners),
            kind => Err(self.tokens.unexpected(kind, &format!("`]` after {count} points"))),
        }
    }

    /// Reads a point of a polygon.
    fn corner(&mut self) -> Result<u32, ReadError> {
        let mut p = [0.0; 3];
        let mut token = self.tokens.after_attributes()?;
        for (k, x) in p.iter_mut().enumerate() {
            match token {
                Kind::Word => *x = number(self.tokens.text()).map_err(|problem| self.tokens.fault(problem))?,
                Kind::Close => return Err(self.tokens.fault(format!("has {k} numbers; a point has x, y and z"))),
                kind => return Err(self.tokens.unexpected(kind, "a coordinate")),
            }
            self.decimals.count(self.tokens.text());
            token = self.tokens.next()?;
        }
        match token {
            Kind::Close => Ok(self.mesh.point(DVec3::from(p))),
            kind => Err(self.tokens.unexpected(kind, "`]` after x, y and z")),
        }
    }

    fn finish(self, name: String, reading: &Reading<'_>) -> Result<Import, ReadError> {
        let mut report = self.report;
        if self.mesh.len() == 0 && self.surfaces.is_empty() {
            let skipped: Vec<String> = report.skipped.iter().map(|(what, count)| format!("{count} {what}")).collect();
            let but = if skipped.is_empty() { String::new() } else { format!(", but {}", skipped.join(", ")) };
            return Err(Fault::whole(format!("has no surface and no polygon{but}; there is nothing to draw")).into());
        }
        let surfaces = self.mesh.into_surfaces(self.decimals.precision(), reading, &mut report)?;
        if surfaces.is_empty() && self.surfaces.is_empty() {
            return Err(Fault::whole("has no polygon with an area; there is nothing to draw").into());
        }
        if !self.surfaces.is_empty() {
            report.kinds.insert("free-form surface".to_owned(), self.surfaces.len());
        }
        // Both number the edges that they share from 0.
        let scenes = [surfaces, self.surfaces].map(|surfaces| Scene { name: String::new(), surfaces });
        Ok(Import { scene: Scene::joined(name, scenes), report, ..Import::default() })
    }
}

/// Whether a keyword is that of a block that holds a shape, and so of no attribute.
fn is_geometry(keyword: &str) -> bool {
    ["OBJECT", "SURFACE", "TRIMSRF", "POLYGON", "POLYSTRIP", "CURVE", "POLYLINE", "MODEL", "INSTANCE"]
        .contains(&keyword)
}
