//! Figures of a large exchange file, as Markdown: a mechanical part of 34 faces is written side by side with itself until there
//! are about as many faces as are asked for, each a face of its own with edges and points of its own, and the file is read and
//! drawn, with the seconds of every stage and the largest memory.
//!
//!     cargo run --release -p penvis-tests --example step_array [FACES…]
//!
//! Without numbers, of about 3000 faces. On one core with `RAYON_NUM_THREADS=1`. The file is left in the folder for temporary
//! files.

use std::fmt::Write as _;
use std::time::Instant;
use std::{env, fs};

use peak_alloc::PeakAlloc;
use penvis::model::{self, Reading};
use penvis_tests::plotter::draw;
use penvis_tests::stages::TO_THE_PAGE;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// The part, 100 by 60 mm.
const PART: &str = include_str!("../data/mech_analytic.step");

/// Faces of the part.
const FACES: usize = 34;

/// Distance in mm from one part to the next.
const PITCH: [f64; 2] = [110.0, 70.0];

/// The statements of the part's data, each without its line breaks, and what stands before them.
fn statements() -> (&'static str, Vec<String>) {
    let (head, data) = PART.split_once("DATA;").expect("data");
    let (data, _) = data.rsplit_once("ENDSEC;").expect("its end");
    let whole = data.replace(['\n', '\r'], "");
    (head, whole.split(';').map(|s| s.trim().to_owned()).filter(|s| !s.is_empty()).collect())
}

/// A statement with its numbers raised by `first`, and moved if it is a point in space.
fn moved(statement: &str, first: usize, by: [f64; 2]) -> String {
    let mut out = String::with_capacity(statement.len() + 16);
    let mut rest = statement;
    while let Some(at) = rest.find('#') {
        out.push_str(&rest[..=at]);
        let digits = rest[at + 1..].find(|c: char| !c.is_ascii_digit()).map_or(rest.len(), |n| at + 1 + n);
        let number: usize = rest[at + 1..digits].parse().expect("the number of an entity");
        write!(out, "{}", number + first).expect("memory");
        rest = &rest[digits..];
    }
    out.push_str(rest);
    if !out.contains("CARTESIAN_POINT") {
        return out;
    }
    let (name, list) = out.rsplit_once('(').expect("coordinates");
    let numbers = list.trim_end_matches([')', ' ']).split(',').map(|x| x.trim().parse().expect("a coordinate"));
    match numbers.collect::<Vec<f64>>()[..] {
        [x, y, z] => format!("{name}({:?},{:?},{z:?}))", x + by[0], y + by[1]),
        // Of a curve in the parameters of a surface.
        _ => out,
    }
}

/// The file of `columns` by `rows` parts.
fn array([columns, rows]: [usize; 2]) -> String {
    let (head, statements) = statements();
    let mut text = format!("{head}DATA;\n");
    for k in 0..columns * rows {
        let by = [PITCH[0] * (k % columns) as f64, PITCH[1] * (k / columns) as f64];
        for statement in &statements {
            writeln!(text, "{};", moved(statement, k * statements.len(), by)).expect("memory");
        }
    }
    text + "ENDSEC;\nEND-ISO-10303-21;\n"
}

/// Writes, reads and draws a file; tells its row of the table, and what its reader has to say.
fn row(faces: usize) -> (String, Vec<String>) {
    let rows = ((faces as f64 / FACES as f64).sqrt().ceil() as usize).max(1);
    let columns = faces.div_ceil(FACES * rows);
    let path = env::temp_dir().join(format!("array-of-{}-faces.step", FACES * rows * columns));
    let text = array([columns, rows]);
    let size = text.len() as f64 / 1e6;
    fs::write(&path, text).expect("room for the file");
    let spec = path.to_str().expect("a plain path").to_owned();
    MEMORY.reset_peak_usage();
    let read = model::load(std::slice::from_ref(&spec), &Reading::new(&())).expect("a model");
    let to_read = MEMORY.peak_usage() >> 20;
    let (count, report) = (read.scene.surfaces.len(), read.files[0].report.clone());
    drop(read);
    MEMORY.reset_peak_usage();
    let started = Instant::now();
    let drawn = draw(&[&spec, "--view", "1,-2,0.8"]);
    let total = started.elapsed().as_secs_f64();
    let peak = MEMORY.peak_usage() >> 20;
    let undecided = drawn.stats.silhouette_undecided.len() + drawn.stats.visibility.undecided.len();
    let mut row = format!("| {size:.1} | {count} | {}", report.problems.len());
    for (_, seconds) in TO_THE_PAGE {
        row += &format!(" | {:.2}", seconds(&drawn.seconds));
    }
    row += &format!(" | {total:.2} | {to_read} | {peak} | {} | {undecided} |", drawn.drawing.polylines.len());
    (row, report.healed.into_iter().chain(report.problems).collect())
}

fn main() {
    let wanted: Vec<usize> = env::args().skip(1).filter_map(|word| word.parse().ok()).collect();
    let wanted = if wanted.is_empty() { vec![3000] } else { wanted };
    println!("Seconds; from an exchange file to the strokes on the page.\n");
    let stages = TO_THE_PAGE.map(|s| s.0).join(" | ");
    println!("| MB of file | faces | problems | {stages} | total | peak MB to read | peak MB | strokes | undecided |");
    println!("|{}", "--:|".repeat(TO_THE_PAGE.len() + 8));
    let mut told = Vec::new();
    for faces in wanted {
        let (row, notes) = row(faces);
        println!("{row}");
        told.extend(notes.into_iter().map(|note| format!("of {faces}: {note}")));
    }
    for note in told {
        println!("\n{note}");
    }
}
