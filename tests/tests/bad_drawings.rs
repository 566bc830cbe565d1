//! Files of every drawing format that are not as they should be: each is refused in one line that says what is wrong and where, in bounded memory.

use std::fs::File;
use std::io::Write;
use std::path::Path;

use peak_alloc::PeakAlloc;
use penvis::device;
use penvis::drawing::{DrawingFormat, Found, Reading};
use penvis::model::Source;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Memory that any of these files may take to be refused.
const MOST_MEMORY: usize = 96 << 20;

/// A small good file of a format, and whether a part of it is no file.
const SAMPLES: &[(&str, &str, bool)] = &[
    ("json", r#"{"page": {"width_mm": 100, "height_mm": 50}, "polylines": [{"page": [[1, 2], [3, 4]]}]}"#, true),
    (
        "svg",
        "<svg xmlns='http://www.w3.org/2000/svg' width='100mm' height='50mm' viewBox='0 0 100 50'>\n<path id='p' d='M1 2L3 4'/>\n</svg>",
        true,
    ),
    ("gcode", "G21\nG90\nG0 X10 Y10\nM3 S1000\nG1 X30 F2000\nM3 S0\n", false),
    ("plt", "IN;SP1;PU400,400;PD800,400;PU;SP0;", false),
];

/// Reads a file; or the message with which it is refused, which is one line.
fn read(path: &Path) -> Result<Found, String> {
    let format = DrawingFormat::of(path).ok_or("is no drawing")?;
    let [gcode, hpgl] = ["grbl-servo", "hp7475a"].map(|name| device::find(name).expect("a built-in profile"));
    let reading = Reading { tolerance_mm: 0.01, gcode: &gcode, hpgl: &hpgl, stops: &|| false };
    let mut source = Source::open(path).expect("a file");
    format.read(&mut source, &reading).map_err(|error| {
        let message = error.to_string();
        assert!(!message.contains(char::is_control) && message.chars().count() < 1000, "{message:?}");
        message
    })
}

/// The message with which a file is refused, in no more memory than it may take.
fn refused(path: &Path) -> String {
    MEMORY.reset_peak_usage();
    let before = MEMORY.current_usage();
    let message = read(path).expect_err("a bad file");
    let taken = MEMORY.peak_usage().saturating_sub(before);
    assert!(taken < MOST_MEMORY, "{}: {taken} bytes to say {message}", path.display());
    message
}

fn written(folder: &tempfile::TempDir, extension: &str, content: &[u8]) -> std::path::PathBuf {
    let path = folder.path().join(format!("a.{extension}"));
    std::fs::write(&path, content).expect("room for a small file");
    path
}

#[test]
fn a_file_cut_off_anywhere_is_refused_or_read_to_where_it_ends() {
    const PARTS: usize = 16;
    let folder = tempfile::tempdir().expect("a folder");
    for (extension, content, has_end) in SAMPLES {
        assert_eq!(
            read(&written(&folder, extension, content.as_bytes())).expect("a good file").drawing.polylines.len(),
            1
        );
        for k in 0..PARTS {
            let length = content.len() * k / PARTS;
            let result = read(&written(&folder, extension, &content.as_bytes()[..length]));
            assert!(!(*has_end && result.is_ok()), "{extension}: {length} bytes were read as a whole");
        }
    }
}

/// A file whose beginning is good, and of the rest of which there is nothing: a copy that broke off.
#[test]
fn a_gigabyte_that_was_cut_off_is_refused_without_holding_it() {
    let folder = tempfile::tempdir().expect("a folder");
    for (extension, content, _) in SAMPLES {
        let path = folder.path().join(format!("large.{extension}"));
        let mut file = File::create(&path).expect("a file");
        file.write_all(&content.as_bytes()[..content.len() * 3 / 4]).expect("room for a small file");
        file.set_len(1 << 30).expect("a file with a hole");
        refused(&path);
    }
}

/// Extension, what is replaced in the sample of it, by what, and how the message begins.
const CHANGES: &[(&str, &str, &str, &str)] = &[
    ("json", "[3, 4]", "[3, 1e9]", "polylines[0]: page has a coordinate of more than 10000 mm; no paper is so large"),
    ("json", "[3, 4]", "[3]", "polylines[0].page[1]: invalid length 1"),
    ("json", "50", "0", "page: is no sheet; give sides of 1 to 10000 mm"),
    ("svg", "L3 4", "L3 1e9", "line 2, path, #p: has a coordinate of more than 10000 mm; no paper is so large"),
    ("svg", "d='M", "transform='turn(3)' d='M", "line 2, path, #p: has a transform that cannot be read"),
    (
        "svg",
        "width='100mm'",
        "width='100m'",
        "says a width that is no length, `100m`; give a number of mm, cm, in, pt or px",
    ),
    (
        "svg",
        "width='100mm' height='50mm' viewBox='0 0 100 50'",
        "",
        "says no size; give the svg element width and height, or a viewBox",
    ),
    ("svg", "</svg>", "</sgv>", "expected 'svg' tag, not 'sgv' at 3:1"),
    ("svg", "'p'", "p", "expected a quote not 'p' at 2:10"),
    ("svg", "<path", "&who;<path", "unknown entity reference 'who' at 2:1"),
    ("gcode", "X30", "X30?", "line 5 holds `?`, which a GRBL plotter obeys the moment it arrives; take it out"),
    ("gcode", "X30", "X99999", "line 5: has a coordinate of more than 10000 mm; no paper is so large"),
    (
        "gcode",
        "S1000",
        "S500",
        "draws nothing with any pen that there is a profile of; say with --device for which plotter it is",
    ),
    ("plt", "SP1", "1", "this is not HPGL: instruction 2 begins with \"1;PU400,\", and must begin with two letters"),
    ("plt", "PD800,400", "PD800", "draws nothing that can be followed: 1 × PD is not followed"),
];

#[test]
fn one_thing_wrong_is_named_with_its_place() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut wrong = Vec::new();
    for (extension, from, to, expected) in CHANGES {
        let (_, content, _) = SAMPLES.iter().find(|(e, ..)| e == extension).expect("a sample");
        assert!(content.contains(from), "no {extension} with {from}");
        match read(&written(&folder, extension, content.replacen(from, to, 1).as_bytes())) {
            Err(message) if message.starts_with(expected) => {}
            other => {
                wrong.push(format!("\n.{extension}: {to} instead of {from}: {:?}", other.map(|found| found.notes)))
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.concat());
}

#[test]
fn what_is_nested_or_repeated_a_million_times_takes_no_more_than_it_may() {
    let folder = tempfile::tempdir().expect("a folder");
    let svg = |inner: &str| format!("<svg xmlns='http://www.w3.org/2000/svg' width='9mm' height='9mm'>{inner}</svg>");
    let laughs: String = (1..9).map(|k| format!("<!ENTITY l{k} \"{}\">", format!("&l{};", k - 1).repeat(9))).collect();
    for (extension, text, expected) in [
        ("json", format!("{{\"polylines\": {}", "[".repeat(1_000_000)), "polylines"),
        ("svg", svg(&["<g>".repeat(100_000), "</g>".repeat(100_000)].concat()), "line 1, g: is within 256 others"),
        ("svg", format!("<!DOCTYPE svg [<!ENTITY l0 \"ha\">{laughs}]>{}", svg("<title>&l8;</title>")), "entity"),
    ] {
        let message = refused(&written(&folder, extension, text.as_bytes()));
        assert!(message.contains(expected), "{message}");
    }
}
