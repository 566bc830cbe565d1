//! Figures of meshes, as Markdown: STL files of a torus and of a bumpy ball are written, read and drawn, with the seconds of
//! every stage and the largest memory.
//!
//!     cargo run --release -p penvis-tests --example meshes [TRIANGLES…]
//!
//! Without numbers, of about 14,000 and 200,000 triangles. On one core with `RAYON_NUM_THREADS=1`.

use std::f64::consts::{PI, TAU};
use std::fs;
use std::path::Path;
use std::time::Instant;

use glam::DVec3;
use peak_alloc::PeakAlloc;
use penvis::model::{self, Reading};
use penvis_tests::plotter::draw;
use penvis_tests::stages::TO_THE_PAGE;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// A closed surface over [0, 1]², u round it.
type Shape = fn(f64, f64) -> DVec3;

const SHAPES: [(&str, Shape); 2] = [("torus", torus), ("ball", ball)];

fn torus(u: f64, v: f64) -> DVec3 {
    let (u, v) = (TAU * u, TAU * v);
    let r = 3.0 + v.cos();
    DVec3::new(r * u.cos(), r * u.sin(), v.sin())
}

/// A ball with bumps that hide one another.
fn ball(u: f64, v: f64) -> DVec3 {
    let (u, v) = (TAU * u, PI * v);
    let r = 1.0 + 0.15 * (5.0 * u).sin() * v.sin().powi(2) * (4.0 * v).sin();
    r * DVec3::new(v.sin() * u.cos(), v.sin() * u.sin(), -v.cos())
}

/// A binary STL file of about so many triangles; those without area at the poles of a ball are in it too.
fn stl(shape: Shape, triangles: usize) -> Vec<u8> {
    let rows = ((triangles as f64 / 4.0).sqrt().round() as usize).max(3);
    let columns = 2 * rows;
    let at = |i: usize, j: usize| {
        let p = shape((i % columns) as f64 / columns as f64, j as f64 / rows as f64);
        p.to_array().map(|x| x as f32)
    };
    let mut bytes = vec![0; 80];
    bytes.extend((2 * rows as u32 * columns as u32).to_le_bytes());
    for (i, j) in (0..columns).flat_map(|i| (0..rows).map(move |j| (i, j))) {
        let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
        for corners in [[a, b, c], [a, c, d]] {
            // No normal, and no colour.
            bytes.extend([0; 12]);
            bytes.extend(corners.iter().flatten().flat_map(|x| x.to_le_bytes()));
            bytes.extend([0; 2]);
        }
    }
    bytes
}

/// Writes, reads and draws a file; tells its row of the table, and what was healed.
fn row(folder: &Path, name: &str, shape: Shape, triangles: usize) -> (String, Vec<String>) {
    let path = folder.join(format!("{name}.stl"));
    fs::write(&path, stl(shape, triangles)).expect("room for the file");
    let spec = path.to_str().expect("a plain path").to_owned();
    let read = model::load(std::slice::from_ref(&spec), &Reading::new(&())).expect("a mesh");
    let (count, report) = (read.scene.surfaces.len(), read.files[0].report.clone());
    drop(read);
    MEMORY.reset_peak_usage();
    let started = Instant::now();
    let drawn = draw(&[&spec, "--view", "1,-2,0.8"]);
    let total = started.elapsed().as_secs_f64();
    let peak = MEMORY.peak_usage() >> 20;
    let undecided = drawn.stats.silhouette_undecided.len() + drawn.stats.visibility.undecided.len();
    let mut row = format!("| {name} | {count} | {} | {}", report.healed.len(), report.problems.len());
    for (_, seconds) in TO_THE_PAGE {
        row += &format!(" | {:.2}", seconds(&drawn.seconds));
    }
    row += &format!(" | {total:.2} | {peak} | {} | {undecided} |", drawn.drawing.polylines.len());
    (row, report.healed.into_iter().chain(report.problems).collect())
}

fn main() {
    let wanted: Vec<usize> = std::env::args().skip(1).filter_map(|word| word.parse().ok()).collect();
    let sizes = if wanted.is_empty() { vec![14_000, 200_000] } else { wanted };
    let folder = tempfile::tempdir().expect("a folder");
    println!("Seconds; from a file of STL to the strokes on the page.\n");
    let stages = TO_THE_PAGE.map(|s| s.0).join(" | ");
    println!("| mesh | triangles | healed | problems | {stages} | total | peak MB | strokes | undecided |");
    println!("|---|{}", "--:|".repeat(TO_THE_PAGE.len() + 7));
    let mut told = Vec::new();
    for &triangles in &sizes {
        for (name, shape) in SHAPES {
            let (row, notes) = row(folder.path(), name, shape, triangles);
            println!("{row}");
            told.extend(notes.into_iter().map(|note| format!("{name} of {triangles}: {note}")));
        }
    }
    for note in told {
        println!("\n{note}");
    }
}
