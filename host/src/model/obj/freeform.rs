//! Free-form surfaces of an OBJ file.
//!
//! Attributes (`cstype`, `deg`, `bmat`, `step`) hold until they are set anew. An element (`surf`, `curv2`, `curv`) begins
//! with its control points and ends with `end`; what is in between gives its parameters (`parm`) and bounds it (`trim`,
//! `hole`) by parts of curves in its parameters, whose points are `vp`.

use glam::{DVec2, DVec3, DVec4};
use penvis_core::nurbs::{Curve, KnotVector, Surface};
use penvis_core::scene::SceneSurface;
use penvis_core::trim::Trims;

use super::basis::Basis;
use super::reference;
use crate::model::fault::Fault;
use crate::model::import::Report;
use crate::model::mesh::MOST_CORNERS;
use crate::model::text::{number, shown};

/// The keywords of free-form geometry.
pub(super) const KEYWORDS: &[&str] = &[
    "vp", "cstype", "deg", "bmat", "step", "curv", "curv2", "surf", "parm", "trim", "hole", "scrv", "sp", "end", "con",
];

/// Largest degree that is read, that of the core.
const MAX_DEGREE: usize = penvis_core::view::MAX_DEGREE;

/// What is beyond a range by this part of it is its end: what seven digits leave.
const SLACK: f64 = 1e-6;

/// The free-form geometry of a file as far as it is read.
#[derive(Default)]
pub(super) struct FreeForm {
    /// Points in parameters, with their weights.
    parameters: Vec<DVec3>,
    kind: Option<Kind>,
    degree: [Option<usize>; 2],
    step: [Option<usize>; 2],
    matrix: [Vec<f64>; 2],
    part: String,
    element: Option<Element>,
    /// Curves in parameters, for trims.
    curves: Vec<Curve>,
    surfaces: Vec<SceneSurface>,
}

/// A basis as `cstype` names it, and whether its points have weights.
#[derive(Clone, Copy, PartialEq)]
struct Kind {
    name: &'static str,
    rational: bool,
}

const KINDS: [&str; 5] = ["bezier", "bspline", "cardinal", "taylor", "bmatrix"];

/// An element that has begun and not ended.
struct Element {
    line: usize,
    shape: Shape,
    parm: [Vec<f64>; 2],
    loops: Vec<Loop>,
}

enum Shape {
    /// A curve in space, which is not drawn.
    Curve,
    /// A curve in parameters, by its homogeneous control points.
    Parameters(Vec<DVec4>),
    /// A surface: the part of the parameters that there is of it, u and v, and its homogeneous control points, u fastest.
    Surface([[f64; 2]; 2], Vec<DVec4>),
}

/// A loop of trims: parts of curves in parameters, by parameter and index.
struct Loop {
    line: usize,
    is_hole: bool,
    parts: Vec<([f64; 2], usize)>,
}

impl FreeForm {
    /// Surfaces that follow belong to the part of this name.
    pub(super) fn begin_part(&mut self, name: &str) {
        name.clone_into(&mut self.part);
    }

    /// Reads a statement of free-form geometry.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn statement(
        &mut self,
        keyword: &str,
        words: &[&str],
        line: usize,
        vertices: &[DVec4],
        report: &mut Report,
    ) -> Result<(), String> {
        match keyword {
            "vp" => return self.parameter_point(words),
            "cstype" => self.kind = Some(kind(words)?),
            "deg" => self.degree = directions(words, MAX_DEGREE, "a degree")?,
            "step" => self.step = directions(words, MOST_CORNERS, "a step")?,
            "bmat" => {
                let (direction, words) = direction(words)?;
                self.matrix[direction] = numbers(words)?;
            }
            "curv" | "curv2" | "surf" => {
                if let Some(element) = &self.element {
                    return Err(format!("begins an element, but that of line {} has no `end`", element.line));
                }
                let shape = match keyword {
                    "curv" => Shape::Curve,
                    "curv2" => Shape::Parameters(self.parameter_points(words)?),
                    _ => self.surface_points(words, vertices)?,
                };
                self.element = Some(Element { line, shape, parm: Default::default(), loops: Vec::new() });
            }
            "con" => report.skip("connections of surfaces (con)"),
            _ => return self.body(keyword, words, line, report),
        }
        Ok(())
    }

    fn parameter_point(&mut self, words: &[&str]) -> Result<(), String> {
        let p = numbers(words)?;
        if p.is_empty() || p.len() > 3 {
            return Err(format!("has {} numbers; a point in parameters has u, v and maybe a weight", p.len()));
        }
        if self.parameters.len() == MOST_CORNERS {
            return Err(format!("is point {}; no pen can draw so much, so simplify the model", MOST_CORNERS + 1));
        }
        let at = |k: usize, or: f64| p.get(k).copied().unwrap_or(or);
        self.parameters.push(DVec3::new(at(0, 0.0), at(1, 0.0), at(2, 1.0)));
        Ok(())
    }

    fn parameter_points(&self, words: &[&str]) -> Result<Vec<DVec4>, String> {
        let rational = self.kind.is_some_and(|k| k.rational);
        let point = |word: &&str| {
            let p = self.parameters[reference(word, self.parameters.len(), "point in parameters")?];
            let w = if rational { p.z } else { 1.0 };
            Ok(DVec4::new(p.x * w, p.y * w, 0.0, w))
        };
        words.iter().map(point).collect()
    }

    fn surface_points(&self, words: &[&str], vertices: &[DVec4]) -> Result<Shape, String> {
        let (window, points) = words.split_at_checked(4).ok_or("has no control points")?;
        let window = numbers(window)?;
        let rational = self.kind.is_some_and(|k| k.rational);
        let point = |word: &&str| {
            let vertex = word.split('/').next().unwrap_or("");
            let p = vertices[reference(vertex, vertices.len(), "vertex")?];
            Ok(if rational { (p.truncate() * p.w).extend(p.w) } else { p.truncate().extend(1.0) })
        };
        let points = points.iter().map(point).collect::<Result<_, String>>()?;
        Ok(Shape::Surface([[window[0], window[1]], [window[2], window[3]]], points))
    }

    /// Reads a statement between the beginning of an element and its end.
    fn body(&mut self, keyword: &str, words: &[&str], line: usize, report: &mut Report) -> Result<(), String> {
        let curves = self.curves.len();
        let Some(element) = &mut self.element else {
            return Err(format!("`{keyword}` belongs between `surf` or `curv2` and `end`"));
        };
        match keyword {
            "parm" => {
                let (direction, words) = direction(words)?;
                element.parm[direction] = numbers(words)?;
            }
            "trim" | "hole" => {
                if words.is_empty() || !words.len().is_multiple_of(3) {
                    return Err("does not list parts of curves, each by two parameters and a curve".to_owned());
                }
                let part = |w: &[&str]| Ok(([number(w[0])?, number(w[1])?], reference(w[2], curves, "curve")?));
                let parts = words.chunks_exact(3).map(part).collect::<Result<_, String>>()?;
                element.loops.push(Loop { line, is_hole: keyword == "hole", parts });
            }
            "scrv" => report.skip("special curves (scrv)"),
            "sp" => report.skip("special points (sp)"),
            _ => {
                let Some(element) = self.element.take() else { return Ok(()) };
                return self.end(element, report);
            }
        }
        Ok(())
    }

    fn end(&mut self, element: Element, report: &mut Report) -> Result<(), String> {
        let line = element.line;
        let of_element = |problem: String| format!("ends the element of line {line}, which {problem}");
        match element.shape {
            Shape::Curve => report.skip("curves (curv)"),
            Shape::Parameters(points) => {
                let curve = self.curve(&element.parm[0], &points).map_err(of_element)?;
                self.curves.push(curve);
            }
            Shape::Surface(window, points) => {
                let surface = self.surface(window, &element.parm, &points).map_err(of_element)?;
                let trims = self.trims(&surface, &element.loops)?;
                let name = match self.part.as_str() {
                    "" => format!("surface of line {line}"),
                    part => part.to_owned(),
                };
                self.surfaces.push(SceneSurface { trims, ..SceneSurface::new(name, surface) });
            }
        }
        Ok(())
    }

    /// Basis and degree in a direction.
    fn basis(&self, direction: usize) -> Result<(Basis, usize), String> {
        let kind = self.kind.ok_or("has no basis; `cstype` comes first")?;
        let degree = self.degree[direction].ok_or("has no degree in both directions; `deg` comes first")?;
        let basis = match kind.name {
            "bezier" => Basis::Bezier,
            "bspline" => Basis::BSpline,
            "cardinal" => Basis::Cardinal,
            "taylor" => Basis::Taylor,
            _ => {
                let step = self.step[direction].ok_or("has no `step` for its basis matrix")?;
                Basis::Matrix { matrix: self.matrix[direction].clone(), step }
            }
        };
        Ok((basis, degree))
    }

    fn curve(&self, parm: &[f64], points: &[DVec4]) -> Result<Curve, String> {
        let (basis, degree) = self.basis(0)?;
        let (knots, points) = basis.spline(degree, parm, points)?;
        Curve::from_homogeneous(knots, points).map_err(|e| e.to_string())
    }

    fn surface(&self, window: [[f64; 2]; 2], parm: &[Vec<f64>; 2], points: &[DVec4]) -> Result<Surface, String> {
        let (basis_u, degree_u) = self.basis(0)?;
        let (basis_v, degree_v) = self.basis(1)?;
        let rows = basis_v.count(degree_v, parm[1].len()).ok_or("has too few parameters v (`parm v`)")?;
        if rows == 0 || !points.len().is_multiple_of(rows) {
            return Err(format!("has {} control points, but its parameters v ask for {rows} rows", points.len()));
        }
        let columns = points.len() / rows;
        if columns == 0 {
            return Err("has no control points".to_owned());
        }
        // First along u, in each row; then along v.
        let mut knots_u: Option<KnotVector> = None;
        let mut along_u = Vec::with_capacity(rows);
        for row in points.chunks_exact(columns) {
            let (knots, row) = basis_u.spline(degree_u, &parm[0], row).map_err(|e| format!("along u {e}"))?;
            knots_u = Some(knots);
            along_u.push(row);
        }
        let knots_u = knots_u.ok_or("has no control points")?;
        let mut knots_v: Option<KnotVector> = None;
        let mut all = Vec::new();
        for iu in 0..knots_u.control_count() {
            let column: Vec<DVec4> = along_u.iter().map(|row| row[iu]).collect();
            let (knots, column) = basis_v.spline(degree_v, &parm[1], &column).map_err(|e| format!("along v {e}"))?;
            knots_v = Some(knots);
            all.extend(column);
        }
        let knots_v = knots_v.ok_or("has no control points")?;
        let whole = Surface::from_homogeneous(knots_u, knots_v, all).map_err(|e| e.to_string())?;
        windowed(whole, window)
    }

    fn trims(&self, surface: &Surface, loops: &[Loop]) -> Result<Option<Trims>, String> {
        let Some(first) = loops.first() else { return Ok(None) };
        let part = |&(t, index): &([f64; 2], usize)| part(&self.curves[index], t);
        let mut all = Vec::with_capacity(loops.len() + 1);
        for l in loops {
            let curves: Result<Vec<Curve>, String> = l.parts.iter().map(part).collect();
            all.push(curves.map_err(|e| format!("ends a surface whose loop of line {} {e}", l.line))?);
        }
        if loops.iter().all(|l| l.is_hole) {
            all.push(border(surface).map_err(|e| e.to_string())?);
        }
        let trims = Trims::new(surface, &all).map_err(|e| {
            let line = e.place().0.and_then(|k| loops.get(k)).unwrap_or(first).line;
            format!("ends a surface whose trims are wrong, those of line {line}: {e}")
        })?;
        Ok(Some(trims))
    }

    /// The surfaces.
    ///
    /// # Errors
    /// If the last element has no end.
    pub(super) fn finish(self, report: &mut Report) -> Result<Vec<SceneSurface>, Fault> {
        if let Some(element) = self.element {
            return Err(Fault::line(element.line, "begins an element that has no `end`; the file is cut off"));
        }
        if self.surfaces.is_empty() && !self.curves.is_empty() {
            report.skipped.insert("curves in parameters without a surface (curv2)".to_owned(), self.curves.len());
        }
        Ok(self.surfaces)
    }
}

/// The basis that `cstype` names.
fn kind(words: &[&str]) -> Result<Kind, String> {
    let (rational, name) = match words {
        ["rat", name] => (true, name),
        [name] => (false, name),
        _ => return Err("does not name one basis".to_owned()),
    };
    match KINDS.into_iter().find(|kind| kind == name) {
        Some(name) => Ok(Kind { name, rational }),
        None => Err(format!("names the basis `{}`; there are {}", shown(name), KINDS.join(", "))),
    }
}

/// One or two whole numbers, for u and v.
fn directions(words: &[&str], most: usize, what: &str) -> Result<[Option<usize>; 2], String> {
    let read = |word: &&str| match word.parse::<usize>() {
        Ok(n) if (1..=most).contains(&n) => Ok(n),
        _ => Err(format!("`{}` is not {what} from 1 to {most}", shown(word))),
    };
    match words {
        [u] => Ok([Some(read(u)?), None]),
        [u, v] => Ok([Some(read(u)?), Some(read(v)?)]),
        _ => Err(format!("does not give {what} for u, or for u and v")),
    }
}

/// The direction that the first word names, and the other words.
fn direction<'a, 'b>(words: &'b [&'a str]) -> Result<(usize, &'b [&'a str]), String> {
    match words {
        ["u", rest @ ..] => Ok((0, rest)),
        ["v", rest @ ..] => Ok((1, rest)),
        _ => Err("does not begin with a direction, u or v".to_owned()),
    }
}

fn numbers(words: &[&str]) -> Result<Vec<f64>, String> {
    words.iter().map(|word| number(word)).collect()
}

/// The part of a range that a window leaves: its ends, each none where it is that of the range.
fn inner([a, b]: [f64; 2], [low, high]: [f64; 2], what: &str) -> Result<[Option<f64>; 2], String> {
    let slack = SLACK * (b - a);
    if low >= high || low < a - slack || high > b + slack {
        return Err(format!("is asked for from {low} to {high} in {what}, but is there from {a} to {b}"));
    }
    Ok([Some(low).filter(|low| low - a > slack), Some(high).filter(|high| b - high > slack)])
}

/// The part of a surface in a window of its parameters.
fn windowed(surface: Surface, window: [[f64; 2]; 2]) -> Result<Surface, String> {
    let mut part = surface;
    let [low, high] = inner(part.domain_u(), window[0], "u")?;
    if let Some(high) = high {
        part = part.split_u(high).map_err(|e| e.to_string())?.0;
    }
    if let Some(low) = low {
        part = part.split_u(low).map_err(|e| e.to_string())?.1;
    }
    let [low, high] = inner(part.domain_v(), window[1], "v")?;
    if let Some(high) = high {
        part = part.split_v(high).map_err(|e| e.to_string())?.0;
    }
    if let Some(low) = low {
        part = part.split_v(low).map_err(|e| e.to_string())?.1;
    }
    Ok(part)
}

/// The part of a curve from one parameter to another, backwards if the second is the lower one.
fn part(curve: &Curve, [from, to]: [f64; 2]) -> Result<Curve, String> {
    let [low, high] = inner(curve.domain(), [from.min(to), from.max(to)], "a curve")?;
    let mut part = curve.clone();
    if let Some(high) = high {
        part = part.split(high).map_err(|e| e.to_string())?.0;
    }
    if let Some(low) = low {
        part = part.split(low).map_err(|e| e.to_string())?.1;
    }
    Ok(if from < to { part } else { part.reversed() })
}

/// The border of a surface's parameter range.
fn border(surface: &Surface) -> Result<Vec<Curve>, penvis_core::shape::ShapeError> {
    let ([a, b], [c, d]) = (surface.domain_u(), surface.domain_v());
    let corners = [[a, c], [b, c], [b, d], [a, d], [a, c]].map(|p| DVec2::from(p).extend(0.0));
    Ok(vec![penvis_core::shape::polyline(&corners)?])
}
