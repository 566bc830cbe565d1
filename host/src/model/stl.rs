//! The STL reader: triangles, as text or in binary.
//!
//! A binary file has 80 bytes of anything, the number of triangles and 50 bytes for each: the normal and three corners in
//! single precision, and two bytes that some programs colour it by. A text file has solids, each with
//! `facet normal x y z`, `outer loop`, three times `vertex x y z`, `endloop`, `endfacet`. Binary files may begin with the
//! word `solid` as text does, so that their length decides. The order of the corners says which side is the front, whatever
//! the normal says.

use std::io::Read;

use glam::DVec3;
use penvis_core::scene::Scene;

use super::fault::{Fault, ReadError};
use super::format::ModelFormat;
use super::import::{Import, Reading, Report};
use super::mesh::{MOST_FACETS, Mesh, PROGRESS_STEP, Precision};
use super::source::Source;
use super::text::{Lines, number, shown};

/// Triangles for printing and machining.
pub(super) const FORMAT: ModelFormat = ModelFormat {
    name: "STL",
    extensions: &["stl"],
    looks_like: |source| is_binary(source) || is_text(source.head()),
    read,
};

/// Bytes before the first triangle of a binary file.
const HEADER: u64 = 84;

/// Bytes of a triangle of a binary file.
const TRIANGLE: u64 = 50;

/// The number of triangles that a binary file announces.
fn announced(head: &[u8]) -> Option<u64> {
    let bytes = head.get(80..84)?;
    Some(u64::from(u32::from_le_bytes(bytes.try_into().ok()?)))
}

/// Whether the length is that of a binary file.
fn is_binary(source: &Source) -> bool {
    announced(source.head()).is_some_and(|count| source.length() == HEADER + TRIANGLE * count)
}

/// Whether a file begins as text of solids does.
fn is_text(head: &[u8]) -> bool {
    let start = head.trim_ascii_start();
    let begins = start.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid"));
    // Text has no zero bytes.
    begins && !head.contains(&0)
}

fn read(source: &mut Source, reading: &Reading<'_>) -> Result<Import, ReadError> {
    let mut report = Report::default();
    let name = source.stem().to_owned();
    let mesh = if is_binary(source) || !is_text(source.head()) {
        binary(source, reading, &mut report)?
    } else {
        text(source, reading, &mut report)?
    };
    let surfaces = mesh.into_surfaces(Precision::Single, reading, &mut report)?;
    if surfaces.is_empty() {
        return Err(Fault::whole("has no triangle with an area; there is nothing to draw").into());
    }
    Ok(Import { scene: Scene { name, surfaces }, report, ..Import::default() })
}

/// How the normals in a file go with the corners. They are not used.
#[derive(Default)]
struct Normals {
    zero: usize,
    against: usize,
}

impl Normals {
    fn count(&mut self, normal: DVec3, [a, b, c]: [DVec3; 3]) {
        if normal == DVec3::ZERO || normal.is_nan() {
            self.zero += 1;
        } else if normal.dot((b - a).cross(c - a)) < 0.0 {
            self.against += 1;
        }
    }

    fn tell(&self, total: usize, report: &mut Report) {
        let used = "the order of the corners counts";
        if self.zero > 0 && self.zero < total {
            report.healed.push(format!("{} of {total} normals are missing; {used}", self.zero));
        }
        if self.against > 0 {
            report.healed.push(format!("{} of {total} normals point to the back; {used}", self.against));
        }
    }
}

fn binary(source: &mut Source, reading: &Reading<'_>, report: &mut Report) -> Result<Mesh, ReadError> {
    let length = source.length();
    let Some(count) = announced(source.head()) else {
        return Err(match length {
            0 => Fault::whole("is empty"),
            _ => Fault::whole(format!("is only {length} bytes long, shorter than the beginning of a binary STL file")),
        }
        .into());
    };
    let held = (length - HEADER) / TRIANGLE;
    if count > held {
        let problem = format!(
            "announces {count} triangles, but its {length} bytes hold {held}; it is cut off or no STL file, so get it anew"
        );
        return Err(Fault::at("header", problem).into());
    }
    if count > MOST_FACETS as u64 {
        let problem = format!("has {count} triangles; no pen can draw more than {MOST_FACETS}, so simplify the mesh");
        return Err(Fault::at("header", problem).into());
    }
    let rest = length - HEADER - TRIANGLE * count;
    if rest > 0 {
        report.problems.push(format!("{rest} bytes after the last triangle are left out"));
    }
    let mut mesh = Mesh::new("triangle");
    let mut normals = Normals::default();
    let mut stream = source.stream()?;
    let mut header = [0; HEADER as usize];
    stream.read_exact(&mut header)?;
    for triangle in 0..count as usize {
        if triangle % PROGRESS_STEP == 0 {
            reading.progress(triangle, count as usize)?;
        }
        let mut bytes = [0; TRIANGLE as usize];
        stream.read_exact(&mut bytes)?;
        let mut numbers = [0.0; 12];
        for (number, bytes) in numbers.iter_mut().zip(bytes.chunks_exact(4)) {
            *number = f64::from(f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]));
        }
        let vector = |k: usize| DVec3::from_slice(&numbers[3 * k..3 * k + 3]);
        let corners = [vector(1), vector(2), vector(3)];
        if let Some(k) = corners.iter().position(|p| !p.is_finite()) {
            let place = format!("triangle {}", triangle + 1);
            return Err(Fault::at(place, format!("corner {} is {}, not finite", k + 1, corners[k])).into());
        }
        normals.count(vector(0), corners);
        let corners = corners.map(|p| mesh.point(p));
        mesh.facet(&corners, triangle + 1)?;
    }
    normals.tell(mesh.len(), report);
    Ok(mesh)
}

/// The words of a facet of a text file; numbers where there is none.
const FACET: [Option<&str>; 21] = {
    const N: Option<&str> = None;
    let corner = Some("vertex");
    [
        Some("facet"),
        Some("normal"),
        N,
        N,
        N,
        Some("outer"),
        Some("loop"),
        corner,
        N,
        N,
        N,
        corner,
        N,
        N,
        N,
        corner,
        N,
        N,
        N,
        Some("endloop"),
        Some("endfacet"),
    ]
};

/// A text file as far as it is read.
struct Text {
    mesh: Mesh,
    normals: Normals,
    /// Words of the facet that are read, and the numbers among them: the normal and three corners.
    words: usize,
    numbers: Vec<f64>,
    /// The line on which the facet began.
    start: usize,
    /// The line on which the solid began that has not ended.
    solid: Option<usize>,
}

fn text(source: &mut Source, reading: &Reading<'_>, report: &mut Report) -> Result<Mesh, ReadError> {
    let length = source.length();
    let (mesh, normals) = (Mesh::new("line"), Normals::default());
    let mut text = Text { mesh, normals, words: 0, numbers: Vec::with_capacity(12), start: 0, solid: None };
    let mut lines = Lines::new(source.stream()?);
    while lines.advance()? {
        if lines.number() % PROGRESS_STEP == 0 {
            reading.progress((lines.bytes_read() >> 10) as usize, (length >> 10) as usize)?;
        }
        text.line(&lines.line(), lines.number())?;
    }
    if text.words > 0 {
        return Err(
            Fault::line(text.start, "begins a facet that does not end; the file is cut off, so get it anew").into()
        );
    }
    if let Some(line) = text.solid {
        report.problems.push(format!("the solid of line {line} does not end; the file may be cut off"));
    }
    if text.mesh.len() == 0 {
        return Err(Fault::whole("has no facet; there is nothing to draw").into());
    }
    text.normals.tell(text.mesh.len(), report);
    Ok(text.mesh)
}

impl Text {
    fn line(&mut self, line: &str, number: usize) -> Result<(), Fault> {
        let mut words = line.split_ascii_whitespace();
        while let Some(word) = words.next() {
            let is = |keyword: &str| word.eq_ignore_ascii_case(keyword);
            if self.words == 0 && (is("solid") || is("endsolid")) {
                // What else is on the line is its name.
                self.solid = is("solid").then_some(number);
                if is("solid") {
                    let name: Vec<&str> = words.collect();
                    self.mesh.begin_part(&shown(&name.join(" ")));
                }
                return Ok(());
            }
            self.word(word, number).map_err(|problem| Fault::line(number, problem))?;
            if self.words == FACET.len() {
                self.end_facet()?;
            }
        }
        Ok(())
    }

    fn word(&mut self, word: &str, line: usize) -> Result<(), String> {
        if self.words == 0 {
            self.start = line;
        }
        match FACET[self.words] {
            Some(keyword) if word.eq_ignore_ascii_case(keyword) => {}
            Some(keyword) => {
                let solid = if self.words == 0 { ", `solid` or `endsolid`" } else { "" };
                return Err(format!("has `{}` where `{keyword}`{solid} is expected", shown(word)));
            }
            // Normals are not used, so that they need not be finite.
            None if self.numbers.len() < 3 => self.numbers.push(word.parse().unwrap_or(f64::NAN)),
            None => self.numbers.push(number(word)?),
        }
        self.words += 1;
        Ok(())
    }

    fn end_facet(&mut self) -> Result<(), Fault> {
        let vector = |k: usize| DVec3::from_slice(&self.numbers[3 * k..3 * k + 3]);
        let (normal, corners) = (vector(0), [vector(1), vector(2), vector(3)]);
        self.normals.count(normal, corners);
        let corners = corners.map(|p| self.mesh.point(p));
        self.mesh.facet(&corners, self.start)?;
        self.words = 0;
        self.numbers.clear();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::model::format_of;

    /// A tetrahedron: normals, which are not of unit length, and corners.
    const TRIANGLES: [[[f32; 3]; 4]; 4] = [
        [[0.0, 0.0, -1.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]],
        [[0.0, -1.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        [[-1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]],
        [[1.0, 1.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    ];

    fn binary_of(header: &str, triangles: &[[[f32; 3]; 4]]) -> Vec<u8> {
        let mut bytes = header.as_bytes().to_vec();
        bytes.resize(80, 0);
        bytes.extend((triangles.len() as u32).to_le_bytes());
        for t in triangles {
            bytes.extend(t.iter().flatten().flat_map(|x| x.to_le_bytes()));
            // Colour, as some programs put it there.
            bytes.extend([0xff, 0x7f]);
        }
        bytes
    }

    fn text_of(name: &str, triangles: &[[[f32; 3]; 4]]) -> String {
        let mut text = format!("solid {name}\n");
        for [n, corners @ ..] in triangles {
            text += &format!("  facet normal {:e} {:e} {:e}\n    outer loop\n", n[0], n[1], n[2]);
            for c in corners {
                text += &format!("      vertex {} {} {}\n", c[0], c[1], c[2]);
            }
            text += "    endloop\n  endfacet\n";
        }
        text + &format!("endsolid {name}\n")
    }

    fn import(bytes: &[u8]) -> Result<Import, ReadError> {
        let mut source = Source::from_bytes("part", bytes.to_vec())?;
        read(&mut source, &Reading::new(&()))
    }

    fn message(bytes: &[u8]) -> String {
        import(bytes).unwrap_err().to_string()
    }

    #[test]
    fn text_and_binary_are_one_model() {
        let binary = import(&binary_of("made by hand", &TRIANGLES)).unwrap();
        assert_eq!((binary.scene.name.as_str(), binary.scene.surfaces.len()), ("part", 4));
        assert_eq!(binary.report.kinds["triangle"], 4);
        assert_eq!((&binary.report.healed, &binary.report.problems), (&vec![], &vec![]));
        let text = import(text_of("", &TRIANGLES).as_bytes()).unwrap();
        assert_eq!(text, binary);
        // The ends of lines and the letters' case are as one likes, and a line may hold all of it.
        let text = text_of("", &TRIANGLES);
        for other in [text.replace('\n', "\r\n"), text.to_uppercase(), text.replacen('\n', "\n\n", 9)] {
            assert_eq!(import(other.as_bytes()).unwrap(), binary);
        }
        let (head, rest) = text.split_once('\n').unwrap();
        let one_line = format!("{head}\n{}", rest.replace('\n', " "));
        assert_eq!(import(one_line.as_bytes()).unwrap().scene, binary.scene);
    }

    #[test]
    fn length_tells_binary_from_text() {
        let format = |bytes: &[u8], name: &str| {
            let source = Source::from_bytes("part", bytes.to_vec()).unwrap();
            format_of(&source, std::path::Path::new(name)).map(|f| f.name)
        };
        let sly = binary_of("solid of the kind that begins as text does", &TRIANGLES);
        assert_eq!(format(&sly, "part"), Some("STL"));
        assert_eq!(import(&sly).unwrap().scene.surfaces.len(), 4);
        assert_eq!(format(text_of("a", &TRIANGLES).as_bytes(), "part"), Some("STL"));
        assert_eq!(format(&binary_of("", &TRIANGLES)[..200], "part"), None);
        assert_eq!(format(&binary_of("", &TRIANGLES)[..200], "part.STL"), Some("STL"));
    }

    #[test]
    fn several_solids_keep_their_names() {
        let text = text_of("lid", &TRIANGLES[..1]) + &text_of("my box", &TRIANGLES[1..]);
        let names: Vec<String> = import(text.as_bytes()).unwrap().scene.surfaces.into_iter().map(|s| s.name).collect();
        assert_eq!(names, ["lid", "my box", "my box", "my box"]);
    }

    #[test]
    fn normals_are_counted_and_not_used() {
        let mut triangles = TRIANGLES;
        triangles[0][0] = [0.0; 3];
        triangles[1][0] = [f32::NAN, 0.0, 1.0];
        triangles[3][0] = [-1.0, 0.0, 0.0];
        let plain = import(&binary_of("", &TRIANGLES)).unwrap();
        for bytes in [binary_of("", &triangles), text_of("", &triangles).into_bytes()] {
            let read = import(&bytes).unwrap();
            assert_eq!(read.scene, plain.scene);
            let told = [
                "2 of 4 normals are missing; the order of the corners counts",
                "1 of 4 normals point to the back; the order of the corners counts",
            ];
            assert_eq!(read.report.healed, told);
        }
    }

    #[test]
    fn what_is_wrong_is_said_with_its_place() {
        let good = binary_of("", &TRIANGLES);
        let with = |at: usize, bytes: &[u8]| {
            let mut all = good.clone();
            all[at..at + bytes.len()].copy_from_slice(bytes);
            all
        };
        let text = text_of("a", &TRIANGLES);
        let swap = |from: &str, to: &str| text.replacen(from, to, 1).into_bytes();
        let mut flat = TRIANGLES;
        flat.iter_mut().for_each(|t| t[3] = t[1]);
        let table: Vec<(Vec<u8>, &str)> = vec![
            (vec![], "is empty"),
            (vec![0; 83], "is only 83 bytes long, shorter than the beginning of a binary STL file"),
            (
                good[..283].to_vec(),
                "header: announces 4 triangles, but its 283 bytes hold 3; it is cut off or no STL file, so get it anew",
            ),
            (
                with(80, &1_000_000_000_u32.to_le_bytes()),
                "header: announces 1000000000 triangles, but its 284 bytes hold 4; it is cut off or no STL file, so get it anew",
            ),
            (with(80, &0_u32.to_le_bytes()), "has no triangle with an area; there is nothing to draw"),
            (with(84 + 50 + 12, &f32::NAN.to_le_bytes()), "triangle 2: corner 1 is [NaN, 0, 0], not finite"),
            (with(84 + 100 + 44, &f32::INFINITY.to_le_bytes()), "triangle 3: corner 3 is [0, 1, inf], not finite"),
            (binary_of("", &flat), "has no triangle with an area; there is nothing to draw"),
            (b"solid".to_vec(), "has no facet; there is nothing to draw"),
            (swap("vertex 0 0 0", "vertex 0 0"), "line 5: `vertex` is not a number"),
            (swap("vertex 0 0 0", "vertex 0 nan 0"), "line 4: `nan` is not a finite number"),
            (swap("vertex 0 0 0", "vertex 0 1e999 0"), "line 4: `1e999` is not a finite number"),
            (swap("vertex 0 0 0", "vertex 0 0,5 0"), "line 4: `0,5` is not a number"),
            (swap("endloop", "vertex 2 2 2"), "line 7: has `vertex` where `endloop` is expected"),
            (
                swap("facet", "\u{1b}[2Jfacet"),
                "line 2: has `\u{fffd}[2Jfacet` where `facet`, `solid` or `endsolid` is expected",
            ),
            (
                text.as_bytes()[..text.rfind("endfacet").unwrap()].to_vec(),
                "line 23: begins a facet that does not end; the file is cut off, so get it anew",
            ),
        ];
        for (bytes, expected) in table {
            assert_eq!(message(&bytes), expected);
        }
        let cut = text.strip_suffix("endsolid a\n").unwrap();
        assert_eq!(
            import(cut.as_bytes()).unwrap().report.problems,
            ["the solid of line 1 does not end; the file may be cut off"]
        );
        let more = [good.as_slice(), &[0; 7]].concat();
        assert_eq!(import(&more).unwrap().report.problems, ["7 bytes after the last triangle are left out"]);
    }

    #[test]
    fn a_gigabyte_cut_off_is_refused_by_its_length_alone() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let mut head = binary_of("", &TRIANGLES);
        head[80..84].copy_from_slice(&21_474_834_u32.to_le_bytes());
        std::fs::write(file.path(), head).unwrap();
        // Sparse: it takes no room on the disk.
        for (length, expected) in [
            ((1 << 30) - 1000, "hold 21474814; it is cut off"),
            (84 + 50 * 21_474_834, "no pen can draw more than 1048576"),
        ] {
            file.as_file().set_len(length).unwrap();
            let mut source = Source::open(file.path()).unwrap();
            let error = read(&mut source, &Reading::new(&())).unwrap_err().to_string();
            assert!(error.starts_with("header: ") && error.contains(expected), "{error}");
        }
    }

    proptest! {
        #[test]
        fn mutated_files_never_panic(
            is_text in any::<bool>(), at in any::<prop::sample::Index>(), len in 0_usize..60,
            with in prop::collection::vec(any::<u8>(), 0..20),
        ) {
            let mut bytes =
                if is_text { text_of("a", &TRIANGLES).into_bytes() } else { binary_of("a", &TRIANGLES) };
            let at = at.index(bytes.len());
            let end = (at + len).min(bytes.len());
            bytes.splice(at..end, with);
            let _ = import(&bytes);
        }
    }
}
