//! Files of every model format that are not as they should be: each is refused in one line that says which file, where
//! in it and what to do, in bounded memory, or what is not understood in it is counted.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use peak_alloc::PeakAlloc;
use penvis::model::{self, FORMATS, Model, Reading};
use tempfile::TempDir;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Memory that any of these files may take to be refused.
const MOST_MEMORY: usize = 96 << 20;

/// A small good file of a format.
struct Sample {
    /// Of the format in the registry.
    format: &'static str,
    extension: &'static str,
    content: &'static [u8],
    /// Whether a part of the file is no file: its end is announced or marked.
    has_end: bool,
}

const SAMPLES: &[Sample] = &[
    Sample {
        format: "surface JSON",
        extension: "json",
        content: br#"{"name": "sheet", "surfaces": [
  {"degree_u": 1, "degree_v": 1, "knots_u": [0, 0, 1, 1], "knots_v": [0, 0, 1, 1],
   "control_points": [[[0, 0, 0, 1], [0, 1, 0, 1]], [[1, 0, 0, 1], [1, 1, 0, 1]]],
   "trim_loops": [[{"degree": 1, "knots": [0, 0, 1, 2, 3, 3],
                    "control_points": [[0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 0, 1]]}]]}],
 "view": {"eye_direction": [1.0, -1.6, 0.75], "up": [0, 0, 1], "projection": "orthographic"}}"#,
        has_end: true,
    },
    Sample {
        format: "STEP",
        extension: "step",
        content: include_bytes!("../fuzz/corpus/step/triangle.step"),
        has_end: true,
    },
    Sample {
        format: "STL",
        extension: "stl",
        content: b"solid roof
facet normal 0 -1 1
outer loop
vertex 0 0 0
vertex 2 0 0
vertex 1 1 1
endloop
endfacet
facet normal 0 1 1
outer loop
vertex 1 1 1
vertex 2 0 0
vertex 2 2 0
endloop
endfacet
endsolid roof
",
        has_end: true,
    },
    Sample {
        format: "OBJ",
        extension: "obj",
        content: b"o roof
v 0 0 0
v 2 0 0
v 1 1 1
v 2 2 0
f 1 2 3
f 3 2 4
",
        has_end: false,
    },
    Sample {
        format: "BPT",
        extension: "bpt",
        content: b"2
2 1
0 0 0
1 0 1
2 0 0
0 3 0
1 3 1
2 3 0
1 1
0 0 5
1 0 5
0 1 5
1 1 5
",
        has_end: true,
    },
    Sample {
        format: "ITD",
        extension: "itd",
        content: b"[OBJECT [COLOR 4] SHEET
  [TRIMSRF
    [SURFACE BSPLINE 3 2 3 2 P3
      [KV 0 0 0 2 2 2]
      [KV 0 0 1 1]
      [1 0 0 0] [1 1 0 1] [1 2 0 0]
      [1 0 3 0] [2 2 6 2] [1 2 3 0]]
    [TRIMCRV
      [TRIMCRVSEG [CURVE BEZIER 2 E2 [0 0] [2 0]]]
      [TRIMCRVSEG [CURVE BSPLINE 3 2 E2 [KV 0 0 1 2 2] [2 0] [2 1] [0 0]]]]]]
[OBJECT ROOF
  [POLYGON [PLANE 0 0 1 9] 4 [0 0 9] [2 0 9] [2 2 9] [0 2 9]]]
",
        has_end: false,
    },
    Sample {
        format: "scene",
        extension: "toml",
        content: b"[[object]]
model = \"saddle\"
scale = 2

[[object]]
name = \"ball\"
sphere = { radius = 1.5 }
translate = [3, 0, 0]
array = { count = 2, step = [0, 4, 0] }
pen = 2
curves = [\"silhouette\", \"iso\"]

[camera]
view = \"front\"

[page]
paper = \"a5\"
",
        has_end: false,
    },
];

/// A folder for bad files.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    fn write(&self, name: &str, content: &[u8]) -> PathBuf {
        let path = self.0.path().join(name);
        fs::write(&path, content).expect("room for a small file");
        path
    }
}

fn load(path: &Path) -> Result<Model, String> {
    let spec = path.to_str().expect("a plain path").to_owned();
    model::load(std::slice::from_ref(&spec), &Reading::new(&())).map_err(|error| {
        let message = error.to_string();
        assert!(!message.contains(char::is_control), "{message:?} is more than a line");
        assert!(message.contains(&spec) && message.chars().count() < 1000 + spec.len(), "{message}");
        message.replace(&spec, "FILE")
    })
}

/// The message with which a file is refused.
fn refused(path: &Path) -> String {
    match load(path) {
        Ok(model) => panic!("{} was read: {} surfaces", path.display(), model.scene.surfaces.len()),
        Err(message) => message,
    }
}

#[test]
fn every_format_has_a_sample_that_is_read() {
    let folder = Folder::new();
    for format in FORMATS {
        let samples: Vec<_> = SAMPLES.iter().filter(|s| s.format == format.name).collect();
        assert!(!samples.is_empty(), "{} has no sample", format.name);
        for sample in samples {
            let path = folder.write(&format!("good.{}", sample.extension), sample.content);
            let model = load(&path).unwrap_or_else(|message| panic!("{}: {message}", sample.format));
            assert!(!model.scene.surfaces.is_empty());
            assert_eq!(model.files[0].format, sample.format);
        }
    }
}

#[test]
fn an_empty_file_a_folder_and_a_file_that_is_not_there_are_refused() {
    let folder = Folder::new();
    for sample in SAMPLES {
        for content in [&b""[..], b"\n", b"\0\0\0\0"] {
            let message = refused(&folder.write(&format!("empty.{}", sample.extension), content));
            assert!(message.starts_with("FILE: "), "{}: {message}", sample.format);
        }
        let path = folder.0.path().join(format!("folder.{}", sample.extension));
        fs::create_dir_all(&path).expect("a folder");
        assert!(refused(&path).starts_with("cannot read FILE: is a directory"), "{}", refused(&path));
        assert!(refused(&path.with_extension(format!("gone.{}", sample.extension))).contains("no file"));
    }
}

#[test]
fn a_file_cut_off_anywhere_is_refused_or_read_to_where_it_ends() {
    const PARTS: usize = 16;
    let folder = Folder::new();
    for sample in SAMPLES {
        for k in 1..PARTS {
            let length = sample.content.len() * k / PARTS;
            let path = folder.write(&format!("cut.{}", sample.extension), &sample.content[..length]);
            match load(&path) {
                Ok(model) => {
                    assert!(!sample.has_end, "{}: {length} bytes were read as a whole", sample.format);
                    assert!(!model.scene.surfaces.is_empty(), "{}: {length} bytes", sample.format);
                }
                Err(message) => assert!(message.starts_with("FILE: "), "{}: {message}", sample.format),
            }
        }
    }
}

/// A file whose beginning is good, and of the rest of which there is nothing: a copy that broke off.
#[test]
fn a_gigabyte_that_was_cut_off_is_refused_without_holding_it() {
    let folder = Folder::new();
    for sample in SAMPLES {
        let path = folder.0.path().join(format!("large.{}", sample.extension));
        let mut file = File::create(&path).expect("a file");
        file.write_all(&sample.content[..sample.content.len() * 3 / 4]).expect("room for a small file");
        file.set_len(1 << 30).expect("a file with a hole");
        MEMORY.reset_peak_usage();
        let before = MEMORY.current_usage();
        let message = refused(&path);
        let taken = MEMORY.peak_usage().saturating_sub(before);
        assert!(message.starts_with("FILE: "), "{}: {message}", sample.format);
        assert!(taken < MOST_MEMORY, "{}: {taken} bytes to say {message}", sample.format);
    }
}

/// Triangles of binary STL have 50 bytes each, and their number comes first: a file is not read to find out that it is too
/// short, or too long for a drawing.
#[test]
fn binary_stl_is_held_against_its_length() {
    let folder = Folder::new();
    let path = folder.0.path().join("large.stl");
    for (count, length, expected) in [
        (4_u32, 0, "FILE: is empty"),
        (4, 83, "FILE: is only 83 bytes long, shorter than the beginning of a binary STL file"),
        (
            1_000_000_000,
            1 << 30,
            "FILE: header: announces 1000000000 triangles, but its 1073741824 bytes hold 21474834; it is cut off or no STL file, so get it anew",
        ),
        (
            21_474_834,
            84 + 50 * 21_474_834,
            "FILE: header: has 21474834 triangles; no pen can draw more than 1048576, so simplify the mesh",
        ),
        (3, 84 + 50 * 3, "FILE: has no triangle with an area; there is nothing to draw"),
    ] {
        let mut file = File::create(&path).expect("a file");
        file.write_all(&[0; 80]).expect("room for a small file");
        file.write_all(&count.to_le_bytes()).expect("room for a small file");
        file.set_len(length).expect("a file with a hole");
        MEMORY.reset_peak_usage();
        let before = MEMORY.current_usage();
        assert_eq!(refused(&path), expected);
        let taken = MEMORY.peak_usage().saturating_sub(before);
        assert!(taken < MOST_MEMORY, "{taken} bytes to say {expected}");
    }
}

/// Extension, what is replaced in the sample of it, by what, and the message.
type Change = (&'static str, &'static str, &'static str, &'static str);

/// One thing wrong in a good file.
const CHANGES: &[Change] = &[
    (
        "json",
        "[1, 1, 0, 1]",
        "[1, NaN, 0, 1]",
        "FILE: surface 0: control_points[1][1][1]: expected value at line 3 column 72",
    ),
    (
        "json",
        "[1, 1, 0, 1]",
        "[1, 1e999, 0, 1]",
        "FILE: surface 0: control_points[1][1][1]: number out of range at line 3 column 77",
    ),
    (
        "json",
        "[1, 1, 0, 1]",
        "[1, -Infinity, 0, 1]",
        "FILE: surface 0: control_points[1][1][1]: invalid number at line 3 column 73",
    ),
    (
        "json",
        "[1, 1, 0, 1]",
        "[1, 1e51, 0, 1]",
        "FILE: surface 0 has a coordinate of 1e51; scale the model so that none exceeds 1e50",
    ),
    (
        "json",
        "[1, 1, 0, 1]",
        "[1, 1, 0, 0]",
        "FILE: surface 0: control_points[1][1]: has weight 0; weights must be positive and finite",
    ),
    (
        "json",
        "[1, 1, 0, 1]",
        "[1, 1, 0, -2]",
        "FILE: surface 0: control_points[1][1]: has weight -2; weights must be positive and finite",
    ),
    (
        "json",
        "[1, 1, 0, 1]",
        "[1, 1, 0]",
        "FILE: surface 0: control_points[1][1]: invalid length 3, expected an array of length 4 at line 3 column 76",
    ),
    (
        "json",
        "[1, 1, 1]",
        "[1, 1, 0]",
        "FILE: surface 0: trim_loops[0][0].control_points[2]: has weight 0; weights must be positive and finite",
    ),
    (
        "json",
        "[1, 1, 1]",
        "[1, 1, -1]",
        "FILE: surface 0: trim_loops[0][0].control_points[2]: has weight -1; weights must be positive and finite",
    ),
    (
        "json",
        "[1, 1, 1]",
        "[1, 2, 1]",
        "FILE: surface 0: trim_loops[0][0]: trim loop 0: curve 0 reaches (1, 2), outside the surface's parameter range; clip it to the range",
    ),
    (
        "json",
        "[0, 0, 1, 1]",
        "[0, 1, 0, 1]",
        "FILE: surface 0: knots_u[2]: knot 2 is 0, less than knot 1 before it; sort the knots",
    ),
    (
        "json",
        "[0, 0, 1, 1]",
        "[0, 0, 0, 0]",
        "FILE: surface 0: knots_u: the domain is the single point 0 (knots 1 to 2); spread the knots",
    ),
    (
        "json",
        "[0, 0, 1, 1]",
        "[0, 0, 1]",
        "FILE: surface 0: knots_u: 3 knots are too few for degree 1; give at least 4 (control points + degree + 1)",
    ),
    (
        "json",
        "[0, 0, 1, 2, 3, 3]",
        "[0, 0, 2, 1, 3, 3]",
        "FILE: surface 0: trim_loops[0][0].knots[3]: knot 3 is 1, less than knot 2 before it; sort the knots",
    ),
    (
        "json",
        "[0, 0, 1, 2, 3, 3]",
        "[0, 0, 1, 2, 3]",
        "FILE: surface 0: trim_loops[0][0].control_points: has 4 points, but knots and degree ask for 3 (knots − degree − 1)",
    ),
    (
        "json",
        r#""degree_u": 1"#,
        r#""degree_u": 1000000000"#,
        "FILE: surface 0: degree_u: degree 1000000000 is not supported; use 1 to 9",
    ),
    (
        "json",
        r#""degree_u": 1"#,
        r#""degree_u": -1"#,
        "FILE: surface 0: degree_u: invalid value: integer `-1`, expected usize at line 2 column 18",
    ),
    (
        "json",
        r#""degree_u": 1"#,
        r#""degree_u": 0"#,
        "FILE: surface 0: degree_u: degree 0 is not supported; use 1 to 9",
    ),
    (
        "json",
        "[1, 1, 1], [0, 0, 1]",
        "[1, 1, 1], [0, 0.5, 1]",
        "FILE: surface 0: trim_loops[0][0]: trim loop 0: curve 0 ends at (0, 0.5), but the next one begins at (0, 0); make the curves meet end to end, and the last one the first",
    ),
    (
        "json",
        "[1.0, -1.6, 0.75]",
        "[0, 0, 1]",
        "FILE: view: the up vector is parallel to the view direction; choose another up",
    ),
    ("json", r#""surfaces""#, r#""faces""#, "FILE: missing field `surfaces` at line 6 column 93"),
    ("step", "(2.0,0.0,0.0)", "(2.0,NaN,0.0)", "FILE: line 10, column 31: expected '(', found ','"),
    ("step", "(2.0,0.0,0.0)", "(2.0,1e999,0.0)", "FILE: line 10, column 29: expected ')', found e999"),
    (
        "step",
        "(2.0,0.0,0.0)",
        "(2.0,0.0)",
        "FILE: no face can be drawn: line 10: #3 CARTESIAN_POINT: does not have three coordinates",
    ),
    ("step", "(2.0,0.0,0.0)", "(2.0,0.0,", "FILE: line 10, column 33: expected ')', found ';'"),
    (
        "step",
        "DIRECTION('',(0.0,0.0,1.0))",
        "DIRECTION('',(0.0,0.0,0.0))",
        "FILE: no face can be drawn: line 30: #23 DIRECTION: has no length",
    ),
    (
        "step",
        "PLANE('',#",
        "CYLINDRICAL_SURFACE('',#",
        "FILE: no face can be drawn: line 33: #26 CYLINDRICAL_SURFACE: has 2 attributes; attribute 3 is missing",
    ),
    ("step", "#2=VERTEX_POINT", "#1=VERTEX_POINT", "FILE: line 9: duplicate entity #1 (first at line 8)"),
    (
        "step",
        "VERTEX_POINT('',#1)",
        "VERTEX_POINT('',#1000000000)",
        "FILE: no face can be drawn: line 9: #2 VERTEX_POINT: refers to #1000000000, which is not in the file; it is cut off or was edited, so get it anew",
    ),
    (
        "step",
        "VERTEX_POINT('',#1)",
        "VERTEX_POINT('',$)",
        "FILE: no face can be drawn: line 9: #2 VERTEX_POINT: attribute 2 is $, not an entity",
    ),
    (
        "step",
        "VERTEX_POINT('',#1)",
        "VERTEX_POINT('')",
        "FILE: no face can be drawn: line 9: #2 VERTEX_POINT: has 1 attributes; attribute 2 is missing",
    ),
    (
        "step",
        "SI_UNIT(.MILLI.,.METRE.)",
        "SI_UNIT(.MILLI.,.GRAM.)",
        "FILE: line 42: #35 (LENGTH_UNIT NAMED_UNIT SI_UNIT): is no .METRE.",
    ),
    (
        "step",
        "SHAPE_REPRESENTATION",
        "SHAPE_ASPECT",
        "FILE: has no faces; export it as solids or surfaces (AP203, AP214 or AP242)",
    ),
    (
        "step",
        "SHELL_BASED_SURFACE_MODEL",
        "CSG_SOLID",
        "FILE: has no faces, but CSG_SOLID, which is not read; export it as solids or surfaces (AP203, AP214 or AP242)",
    ),
    ("step", "ISO-10303-21;", "ISO-10303-22;", "FILE: line 1, column 1: expected ISO-10303-21, found ISO"),
    ("stl", "vertex 2 2 0", "vertex 2 NaN 0", "FILE: line 13: `NaN` is not a finite number"),
    ("stl", "vertex 2 2 0", "vertex 2 1e999 0", "FILE: line 13: `1e999` is not a finite number"),
    ("stl", "vertex 2 2 0", "vertex 2 2", "FILE: line 14: `endloop` is not a number"),
    ("stl", "vertex 2 2 0", "vertex 2 two 0", "FILE: line 13: `two` is not a number"),
    ("obj", "v 2 2 0", "v 2 NaN 0", "FILE: line 5: `NaN` is not a finite number"),
    ("obj", "v 2 2 0", "v 2 1e999 0", "FILE: line 5: `1e999` is not a finite number"),
    ("obj", "v 2 2 0", "v 2 2", "FILE: line 5: has 2 numbers; a vertex has x, y and z"),
    ("obj", "f 3 2 4", "f 3 2 1000000000", "FILE: line 7: refers to vertex 1000000000 of 4 that are there so far"),
    ("obj", "f 3 2 4", "f 3 2 0", "FILE: line 7: refers to vertex 0 of 4 that are there so far"),
    ("obj", "f 3 2 4", "f 3 2", "FILE: line 7: has 2 corners; a face has three or more"),
    ("obj", "f 3 2 4", "f 3 2 -9", "FILE: line 7: refers to vertex -9 of 4 that are there so far"),
    ("bpt", "1 0 1", "1 NaN 1", "FILE: line 4: `NaN` is not a finite number"),
    ("bpt", "1 0 1", "1 1e999 1", "FILE: line 4: `1e999` is not a finite number"),
    ("bpt", "1 0 1", "1 1e51 1", "FILE: surface 0 has a coordinate of 1e51; scale the model so that none exceeds 1e50"),
    (
        "bpt",
        "1 0 1",
        "1 0",
        "FILE: line 4: has 2 numbers, but is control point 2 of 6 of patch 1, which has x, y and z",
    ),
    (
        "bpt",
        "2\n2 1",
        "1000000000\n2 1",
        "FILE: line 1: announces 1000000000 patches; no pen can draw more than 1048576, so simplify the model",
    ),
    (
        "bpt",
        "2\n2 1",
        "3\n2 1",
        "FILE: line 13: is the last, but only 2 of 3 patches are there; the file is cut off, so get it anew",
    ),
    (
        "bpt",
        "2\n2 1",
        "1\n2 1",
        "FILE: line 9: goes on with `1` after the last of 1 patches; correct the first line or remove it",
    ),
    ("bpt", "2\n2 1", "2\n10 1", "FILE: line 2: begins patch 1 of degree 10; there are 1 to 9"),
    ("itd", "[2 2 6 2]", "[2 2 NaN 2]", "FILE: line 7: `NaN` is not a finite number"),
    ("itd", "[2 2 6 2]", "[2 2 1e999 2]", "FILE: line 7: `1e999` is not a finite number"),
    ("itd", "[2 2 6 2]", "[0 2 6 2]", "FILE: line 7: has weight 0; weights must be positive and finite"),
    ("itd", "[2 2 6 2]", "[-2 2 6 2]", "FILE: line 7: has weight -2; weights must be positive and finite"),
    ("itd", "[2 2 6 2]", "[2 2 6]", "FILE: line 7: has 3 numbers in a control point of type P3, which has 4 numbers"),
    ("itd", "[2 2 6 2]", "", "FILE: line 7: ends after 5 of 6 control points"),
    (
        "itd",
        "[2 2 6 2]",
        "[2 2 2e51 2]",
        "FILE: surface 1 has a coordinate of 1e51; scale the model so that none exceeds 1e50",
    ),
    (
        "itd",
        "0 0 0 2 2 2",
        "0 0 0 2 1 2",
        "FILE: line 4: has wrong knots along u: knot 4 is 1, less than knot 3 before it; sort the knots",
    ),
    (
        "itd",
        "0 0 0 2 2 2",
        "0 0 0 2 2",
        "FILE: line 4: has 5 knots along u, but 3 control points of order 3 have 6 knots",
    ),
    (
        "itd",
        "3 2 3 2 P3",
        "50000 20000 3 2 P3",
        "FILE: line 3: announces more than 16777216 control points; no pen can draw so much, so correct or simplify it",
    ),
    ("itd", "9] 4", "9] 1000000000", "FILE: line 12: announces 1000000000 points; polygons and strips have 3 to 65536"),
    (
        "itd",
        "[2 1] [0 0]",
        "[2 1] [0 0.5]",
        "FILE: line 8: begins a TRIMCRV that is wrong: trim loop 0: curve 1 ends at (0, 0.5), but the next one begins at (0, 0); make the curves meet end to end, and the last one the first",
    ),
    ("itd", "2 3 0]]", "2 3 0]", "FILE: line 8: has `[` where `]` after 6 control points is expected"),
    ("bpt", "2\n2 1", "2\n2 0", "FILE: line 2: begins patch 1 of degree 0; there are 1 to 9"),
    ("toml", "scale = 2", "scale = nan", "FILE: line 3: `scale` is nan; give a finite number"),
    ("toml", "scale = 2", "scale = 1e999", "FILE: line 3: `scale` is 1e999; give a finite number"),
    (
        "toml",
        "scale = 2",
        "scale = 0",
        "FILE: line 3: `scale` must be from 1e-50 to 1e50 in size; a negative factor mirrors",
    ),
    ("toml", "scale = 2", "scale = [1, 2]", "FILE: line 3: `scale` is a list of 2; give 3 numbers in brackets"),
    (
        "toml",
        "scale = 2",
        "scale = 1e50",
        "FILE: surface 0 has a coordinate of 1.3333333333333333e50; scale the model so that none exceeds 1e50",
    ),
    (
        "toml",
        "scale = 2",
        "rotate = { axis = [0, 0, 0], degrees = 1 }",
        "FILE: line 3: `axis` has no direction; give three numbers that are not all zero",
    ),
    ("toml", "scale = 2", "rotate = { axis = [0, 0, 1] }", "FILE: line 3: a rotation needs the key `degrees`"),
    ("toml", "scale = 2", "model = \"box\"", "FILE: line 3: duplicate key at `model`"),
    (
        "toml",
        "scale = 2",
        "box = { size = [1, 1, 1] }",
        "FILE: line 3: `box` is one too many, for the object has a `model`; make it an object of its own",
    ),
    (
        "toml",
        "model = \"saddle\"",
        "pen = 1",
        "FILE: line 1: the object is nothing; give it a model, or one of box, sphere, cylinder, cone, torus, rectangle, disk",
    ),
    (
        "toml",
        "model = \"saddle\"",
        "modle = \"saddle\"",
        "FILE: line 2: there is no key `modle` in an object; the nearest one is `model`, and all are name, model, box, sphere, cylinder, cone, torus, rectangle, disk, scale, rotate, translate, array, pen, curves, iso, hidden, fill, crease_angle, surface",
    ),
    (
        "toml",
        "radius = 1.5",
        "raduis = 1.5",
        "FILE: line 7: there is no key `raduis` in a sphere; the nearest one is `radius`, and all are radius",
    ),
    (
        "toml",
        "radius = 1.5",
        "radius = -1",
        "FILE: line 7: `sphere`: the radius of the sphere is -1; it must be positive and finite",
    ),
    ("toml", "radius = 1.5", "", "FILE: line 7: a sphere needs the key `radius`"),
    ("toml", "radius = 1.5", "radius = \"wide\"", "FILE: line 7: `radius` is the text \"wide\"; give a finite number"),
    ("toml", "[3, 0, 0]", "[3, 0, inf]", "FILE: line 8: `translate` is inf; give a finite number"),
    ("toml", "[3, 0, 0]", "[3, 0]", "FILE: line 8: `translate` is a list of 2; give 3 numbers in brackets"),
    ("toml", "count = 2", "count = 0", "FILE: line 9: `count` is 0; give a whole number from 1 to 1048576"),
    (
        "toml",
        "count = 2",
        "count = 1000000",
        "FILE: line 7: with 1000000 of this the scene has 1000001 surfaces of 45000016 control points; no pen can draw more than 1048576 of 16777216, so take fewer",
    ),
    (
        "toml",
        "count = 2",
        "count = 10000000000",
        "FILE: line 9: `count` is 10000000000; give a whole number from 1 to 1048576",
    ),
    ("toml", "pen = 2", "pen = 0", "FILE: line 10: `pen` is 0; give a whole number from 1 to 99"),
    ("toml", "pen = 2", "iso = 1001", "FILE: line 10: `iso` is 1001; give a whole number from 0 to 1000"),
    ("toml", "pen = 2", "hidden = \"dotted\"", "FILE: line 10: `hidden` is not one of omit, dashed, layer"),
    (
        "toml",
        "\"silhouette\"",
        "\"outline\"",
        "FILE: line 11: `curves` asks for a kind that is none: `outline` is not one of boundary, crease, silhouette, iso, smooth, intersection",
    ),
    (
        "toml",
        "view = \"front\"",
        "view = \"frnt\"",
        "FILE: line 14: `view` is neither a direction [x, y, z] nor one of front, back, left, right, top, bottom, iso",
    ),
    (
        "toml",
        "view = \"front\"",
        "up = [0, 0, 1]\nveiw = 3",
        "FILE: line 15: there is no key `veiw` in [camera]; the nearest one is `view`, and all are view, up, perspective, eye, target",
    ),
    (
        "toml",
        "view = \"front\"",
        "view = \"front\"\nup = [0, 1, 0]",
        "FILE: line 13: the up vector is parallel to the view direction; choose another up",
    ),
    (
        "toml",
        "\"a5\"",
        "\"a9\"",
        "FILE: line 17: `paper` is no paper: there is no paper `a9`; give one of a5, a4, a3, a2, letter, legal, or a size such as 200x150mm",
    ),
    (
        "toml",
        "\"a5\"",
        "\"a5\"\nmargin = 80",
        "FILE: line 18: `margin` leaves no room on a sheet of 210 × 148 mm; make it smaller",
    ),
    (
        "toml",
        "[page]",
        "[pages]",
        "FILE: line 16: there is no key `pages` in a scene; the nearest one is `page`, and all are name, object, style, camera, page, pen",
    ),
    ("toml", "[[object]]", "[object]", "FILE: line 5: duplicate key at `object`"),
    ("toml", "scale = 2", "scale = [2, 2", "FILE: line 5: missing comma between array elements, expected `,`"),
    ("toml", "scale = 2", "scale = 2\nscale = 3", "FILE: line 4: duplicate key at `scale`"),
];

#[test]
fn one_thing_wrong_is_named_with_its_place() {
    let folder = Folder::new();
    let mut wrong = Vec::new();
    for (extension, from, to, expected) in CHANGES {
        let texts = SAMPLES.iter().filter(|s| s.extension == *extension).filter_map(|s| str::from_utf8(s.content).ok());
        let text = texts.clone().find(|t| t.contains(from)).unwrap_or_else(|| panic!("no {extension} with {from}"));
        let path = folder.write(&format!("bad.{extension}"), text.replacen(from, to, 1).as_bytes());
        let message = refused(&path);
        if message != *expected {
            wrong.push(format!("\n.{extension}: {to} instead of {from}: {message:?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.concat());
}

#[test]
fn what_is_nested_a_million_deep_does_not_overflow_the_stack() {
    let folder = Folder::new();
    for (extension, before, each, told) in [
        ("json", r#"{"surfaces": "#, "[", "column"),
        ("json", "", r#"{"a":"#, "column"),
        ("step", "ISO-10303-21;HEADER;FILE_SCHEMA((", "(", "line 1, column 97: parameter nesting too deep"),
        ("toml", "[[object]]\na = ", "[", "line 2: cannot recurse further; max recursion depth met"),
        ("toml", "", "[a]\nb = {", "is larger than 1 MiB"),
        ("itd", "", "[OBJECT A\n", "line 257: opens a block within 256 others; no model is nested so deep"),
        ("itd", "[OBJECT [", "[", "line 1: opens a block within 256 others; no model is nested so deep"),
        ("itd", "[OBJECT A [FRACTAL", "[", "line 1: opens a block within 256 others; no model is nested so deep"),
    ] {
        let text = before.to_owned() + &each.repeat(1_000_000);
        let message = refused(&folder.write(&format!("deep.{extension}"), text.as_bytes()));
        assert!(message.starts_with("FILE: ") && message.contains(told), "{message}");
    }
}
