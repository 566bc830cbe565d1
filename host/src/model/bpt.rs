//! The reader of patch lists: Bézier patches one after the other, as Newell's teapot is passed on.
//!
//! The first line has the number of patches. Each patch begins with a line of its degrees m and n and goes on with
//! (m + 1)(n + 1) control points, a line each, m + 1 along its first direction and then the next such row. As R. Holmes
//! describes it, <http://www.holmes3d.net/graphics/roffview/tools/patchoff/>. Patches carry no names and no weights.

use glam::DVec4;
use penvis_core::nurbs::{KnotVector, NurbsError, Surface};
use penvis_core::scene::{Scene, SceneSurface};
use penvis_core::view::MAX_DEGREE;

use super::fault::{Fault, ReadError};
use super::format::ModelFormat;
use super::import::{Import, MOST_POINTS, Reading};
use super::mesh::{MOST_FACETS, PROGRESS_STEP};
use super::source::Source;
use super::text::{Lines, number, shown};

/// Bézier patches, such as those of the teapot.
pub(super) const FORMAT: ModelFormat =
    ModelFormat { name: "BPT", extensions: &["bpt"], looks_like: |source| looks_like(source.head()), read };

/// Most patches. Each becomes a surface of about a kilobyte, as a facet of a mesh does.
const MOST_PATCHES: usize = MOST_FACETS;

/// Whether a file begins with a number alone, then two whole numbers, then three numbers.
fn looks_like(head: &[u8]) -> bool {
    let text = String::from_utf8_lossy(head);
    let mut lines =
        text.lines().map(|line| line.split_ascii_whitespace().collect::<Vec<_>>()).filter(|w| !w.is_empty());
    let whole = |words: &[&str]| words.iter().all(|w| w.parse::<usize>().is_ok());
    let (Some(count), Some(degrees), Some(point)) = (lines.next(), lines.next(), lines.next()) else { return false };
    count.len() == 1
        && whole(&count)
        && degrees.len() == 2
        && whole(&degrees)
        && point.len() == 3
        && point.iter().all(|w| w.parse::<f64>().is_ok())
}

fn read(source: &mut Source, reading: &Reading<'_>) -> Result<Import, ReadError> {
    let name = source.stem().to_owned();
    let length = source.length();
    if length == 0 {
        return Err(Fault::whole("is empty").into());
    }
    let mut list = PatchList::default();
    let mut lines = Lines::new(source.stream()?);
    while lines.advance()? {
        if lines.number() % PROGRESS_STEP == 0 {
            reading.progress((lines.bytes_read() >> 10) as usize, (length >> 10) as usize)?;
        }
        let line = lines.line();
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        if !words.is_empty() {
            list.line(&words).map_err(|problem| Fault::line(lines.number(), problem))?;
        }
    }
    let surfaces = list.finish().map_err(|problem| Fault::line(lines.number(), problem))?;
    Ok(Import { scene: Scene { name, surfaces }, ..Import::default() })
}

/// A patch whose control points are not all read.
struct Patch {
    degrees: [usize; 2],
    /// Those of the first direction fastest.
    points: Vec<DVec4>,
}

impl Patch {
    /// Number of its control points.
    fn size(&self) -> usize {
        (self.degrees[0] + 1) * (self.degrees[1] + 1)
    }

    fn surface(&self) -> Result<Surface, NurbsError> {
        let [m, n] = self.degrees;
        let of = |degree| KnotVector::bezier(degree, [0.0, 1.0]);
        let points = (0..=m).flat_map(|i| (0..=n).map(move |j| self.points[j * (m + 1) + i])).collect();
        Surface::new(of(m)?, of(n)?, points)
    }
}

/// A file as far as it is read.
#[derive(Default)]
struct PatchList {
    /// The number of patches that the first line announces.
    announced: Option<usize>,
    /// The patch that has begun and not ended.
    patch: Option<Patch>,
    /// Control points of the patches that have begun.
    points: usize,
    surfaces: Vec<SceneSurface>,
}

impl PatchList {
    /// Reads the words of a line that has any.
    fn line(&mut self, words: &[&str]) -> Result<(), String> {
        let Some(announced) = self.announced else {
            self.announced = Some(count(words)?);
            return Ok(());
        };
        if self.surfaces.len() == announced {
            let first = words.first().copied().unwrap_or_default();
            return Err(format!(
                "goes on with `{}` after the last of {announced} patches; correct the first line or remove it",
                shown(first)
            ));
        }
        let patch = match &mut self.patch {
            None => return self.begin(words),
            Some(patch) => patch,
        };
        let &[x, y, z] = words else {
            let size = patch.size();
            let at = patch.points.len() + 1;
            return Err(format!(
                "has {} numbers, but is control point {at} of {size} of patch {}, which has x, y and z",
                words.len(),
                self.surfaces.len() + 1
            ));
        };
        patch.points.push(DVec4::new(number(x)?, number(y)?, number(z)?, 1.0));
        if patch.points.len() == patch.size() {
            let surface = patch.surface().map_err(|e| format!("ends patch {}: {e}", self.surfaces.len() + 1))?;
            self.surfaces.push(SceneSurface::new(format!("patch {}", self.surfaces.len() + 1), surface));
            self.patch = None;
        }
        Ok(())
    }

    /// Begins a patch by its degrees.
    fn begin(&mut self, words: &[&str]) -> Result<(), String> {
        let number = self.surfaces.len() + 1;
        let &[m, n] = words else {
            return Err(format!("has {} words, but begins patch {number} by its two degrees", words.len()));
        };
        let degree = |word: &str| match word.parse::<usize>() {
            Ok(degree) if (1..=MAX_DEGREE).contains(&degree) => Ok(degree),
            Ok(degree) => Err(format!("begins patch {number} of degree {degree}; there are 1 to {MAX_DEGREE}")),
            Err(_) => Err(format!("begins patch {number}, but `{}` is no degree", shown(word))),
        };
        let degrees = [degree(m)?, degree(n)?];
        let patch = Patch { degrees, points: Vec::new() };
        self.points += patch.size();
        if self.points > MOST_POINTS {
            return Err(format!(
                "begins patch {number}, which makes {} control points; no pen can draw more than {MOST_POINTS}, so simplify the model",
                self.points
            ));
        }
        self.patch = Some(patch);
        Ok(())
    }

    /// The surfaces, if all that were announced are there.
    fn finish(self) -> Result<Vec<SceneSurface>, String> {
        let Some(announced) = self.announced else {
            return Err("is the last, and none says how many patches there are; this is no patch list".to_owned());
        };
        let got = self.surfaces.len();
        match self.patch {
            Some(patch) => Err(format!(
                "is the last, but patch {} of {announced} has {} of its {} control points; the file is cut off, so get it anew",
                got + 1,
                patch.points.len(),
                patch.size()
            )),
            None if got < announced => Err(format!(
                "is the last, but only {got} of {announced} patches are there; the file is cut off, so get it anew"
            )),
            None => Ok(self.surfaces),
        }
    }
}

/// The number of patches, by the words of the first line.
fn count(words: &[&str]) -> Result<usize, String> {
    let text = words.join(" ");
    match text.parse::<usize>() {
        Ok(0) => Err("announces no patch; there is nothing to draw".to_owned()),
        Ok(n) if n > MOST_PATCHES => {
            Err(format!("announces {n} patches; no pen can draw more than {MOST_PATCHES}, so simplify the model"))
        }
        Ok(n) => Ok(n),
        Err(_) => Err(format!("has `{}`, but the first line is the number of patches", shown(&text))),
    }
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use proptest::prelude::*;

    use super::*;
    use crate::builtin;
    use crate::model::format_of;

    /// Three points along the first direction, two along the second; and a flat one.
    const TWO: &str = "2\n2 1\n0 0 0\n1 0 1\n2 0 0\n0 3 0\n1 3 1\n2 3 0\n\n1 1\n0 0 5\n1 0 5\n0 1 5\n1 1 5\n";

    fn import(text: &str) -> Result<Import, ReadError> {
        let mut source = Source::from_bytes("list", text.as_bytes().to_vec())?;
        read(&mut source, &Reading::new(&()))
    }

    #[test]
    fn the_first_direction_is_fastest() {
        let scene = import(TWO).unwrap().scene;
        assert_eq!(scene.name, "list");
        let names: Vec<&str> = scene.surfaces.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names, ["patch 1", "patch 2"]);
        let surface = &scene.surfaces[0].surface;
        assert_eq!((surface.degree_u(), surface.degree_v()), (2, 1));
        for (u, v, expected) in [(1.0, 0.0, [2.0, 0.0, 0.0]), (0.0, 1.0, [0.0, 3.0, 0.0]), (0.5, 0.5, [1.0, 1.5, 0.5])]
        {
            assert_eq!(surface.eval(u, v).to_array(), expected);
        }
    }

    #[test]
    fn the_teapot_comes_back_as_it_was_written() {
        let teapot = builtin::load("teapot").unwrap().scene;
        let mut text = format!("{}\n", teapot.surfaces.len());
        for s in &teapot.surfaces {
            let (m, n, points) = (s.surface.degree_u(), s.surface.degree_v(), s.surface.homogeneous());
            let _ = writeln!(text, "{m} {n}");
            for (i, j) in (0..=n).flat_map(|j| (0..=m).map(move |i| (i, j))) {
                let p = points[i * (n + 1) + j];
                let _ = writeln!(text, "{:?}\t{:?} {:?}\r", p.x, p.y, p.z);
            }
        }
        let read = import(&text).unwrap().scene.surfaces;
        assert_eq!(read.len(), 32);
        for (read, own) in read.iter().zip(&teapot.surfaces) {
            assert_eq!(read.surface, own.surface);
        }
    }

    #[test]
    fn three_lines_tell_the_format() {
        let format = |text: &str, name: &str| {
            let source = Source::from_bytes("list", text.as_bytes().to_vec()).unwrap();
            format_of(&source, std::path::Path::new(name)).map(|f| f.name)
        };
        assert_eq!(format(TWO, "list"), Some("BPT"));
        assert_eq!(format("2\n2 1\n0 0 0 0\n", "list"), None);
        assert_eq!(format("2\n2 1\n0 0 0 0\n", "list.BPT"), Some("BPT"));
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        let swap = |from: &str, to: &str| TWO.replacen(from, to, 1);
        let table = [
            (String::new(), "is empty"),
            ("\n\n".to_owned(), "line 2: is the last, and none says how many patches there are; this is no patch list"),
            (swap("2\n", "0\n"), "line 1: announces no patch; there is nothing to draw"),
            (swap("2\n", "1.5\n"), "line 1: has `1.5`, but the first line is the number of patches"),
            (
                swap("2\n", "3\n"),
                "line 14: is the last, but only 2 of 3 patches are there; the file is cut off, so get it anew",
            ),
            (
                swap("2\n", "1\n"),
                "line 10: goes on with `1` after the last of 1 patches; correct the first line or remove it",
            ),
            (
                swap("2\n", "1000000000\n"),
                "line 1: announces 1000000000 patches; no pen can draw more than 1048576, so simplify the model",
            ),
            (swap("2 1", "10 1"), "line 2: begins patch 1 of degree 10; there are 1 to 9"),
            (swap("2 1", "0 1"), "line 2: begins patch 1 of degree 0; there are 1 to 9"),
            (swap("2 1", "2 -1"), "line 2: begins patch 1, but `-1` is no degree"),
            (swap("2 1", "2 1 0"), "line 2: has 3 words, but begins patch 1 by its two degrees"),
            (
                swap("1 0 1", "1 0"),
                "line 4: has 2 numbers, but is control point 2 of 6 of patch 1, which has x, y and z",
            ),
            (swap("1 0 1", "1 nan 1"), "line 4: `nan` is not a finite number"),
            (swap("1 0 1", "1 1e999 1"), "line 4: `1e999` is not a finite number"),
            (swap("1 0 1", "1 0 x"), "line 4: `x` is not a number"),
            (
                TWO[..TWO.len() - 6].to_owned(),
                "line 13: is the last, but patch 2 of 2 has 3 of its 4 control points; the file is cut off, so get it anew",
            ),
            (
                format!("{TWO}the end\n"),
                "line 15: goes on with `the` after the last of 2 patches; correct the first line or remove it",
            ),
        ];
        for (text, expected) in table {
            assert_eq!(import(&text).unwrap_err().to_string(), expected);
        }
    }

    proptest! {
        #[test]
        fn mutated_files_never_panic(
            at in any::<prop::sample::Index>(), len in 0_usize..20, with in "[-0-9. \ne]{0,12}",
        ) {
            let at = at.index(TWO.len());
            let end = (at + len).min(TWO.len());
            let mut text = TWO.to_owned();
            text.replace_range(at..end, &with);
            let _ = import(&text);
        }
    }
}
