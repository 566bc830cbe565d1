//! How time and memory grow with the scene: a field of tori with 8 isocurves a direction, or triangles without: a ball of them,
//! or a cone, in whose apex all of them meet.
//!
//!     cargo run --release -p penvis-tests --example scale tori|triangles|fan N [rays|propagate]
//!
//! One size a run, because the largest memory of a process does not shrink; on one core with `RAYON_NUM_THREADS=1`.

use std::f64::consts::{PI, TAU};
use std::sync::Mutex;
use std::time::Instant;

use glam::{DVec3, DVec4};
use penvis_core::nurbs::{KnotVector, Surface};
use penvis_core::pipeline::{DrawOptions, Monitor, Prepared, Stage};
use penvis_core::scene::{Scene, SceneSurface};
use penvis_core::shape::{Frame, torus};
use penvis_core::view::Camera;
use penvis_core::visibility::Method;

/// Tori in a square, a little apart and at three heights.
fn tori(n: usize) -> Vec<Surface> {
    let side = (n as f64).sqrt().round() as usize;
    let place = |i: usize, j: usize| {
        let origin = DVec3::new(4.2 * i as f64, 4.2 * j as f64, 0.6 * ((i + j) % 3) as f64);
        torus(&Frame::new(origin, DVec3::Z, DVec3::X).expect("a frame"), 1.5, 0.5).expect("a torus")
    };
    (0..side).flat_map(|i| (0..side).map(move |j| place(i, j))).collect()
}

/// A bumpy ball of about n triangles.
fn triangles(n: usize) -> Vec<Surface> {
    let rows = ((n as f64 / 4.0).sqrt() as usize).max(3);
    let columns = 2 * rows;
    let at = |i: usize, j: usize| {
        let (polar, azimuth) = (PI * i as f64 / rows as f64, TAU * (j % columns) as f64 / columns as f64);
        let ring = if i == 0 || i == rows { 0.0 } else { polar.sin() };
        let r = 1.0 + 0.1 * (5.0 * azimuth).sin() * ring * ring * (4.0 * polar).sin();
        DVec4::new(r * ring * azimuth.cos(), r * ring * azimuth.sin(), r * polar.cos(), 1.0)
    };
    let mut all = Vec::new();
    for i in 0..rows {
        for j in 0..columns {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            if i > 0 {
                all.push(facet(a, c, d));
            }
            if i + 1 < rows {
                all.push(facet(a, b, c));
            }
        }
    }
    all
}

/// A cone of n triangles round its apex.
fn fan(n: usize) -> Vec<Surface> {
    let at = |k: usize| {
        let azimuth = TAU * (k % n) as f64 / n as f64;
        DVec4::new(azimuth.cos(), azimuth.sin(), 0.0, 1.0)
    };
    let apex = DVec4::new(0.0, 0.0, 3.0, 1.0);
    (0..n).map(|k| facet(apex, at(k), at(k + 1))).collect()
}

/// A bilinear patch with one side drawn together in its first corner.
fn facet(a: DVec4, b: DVec4, c: DVec4) -> Surface {
    let knots = || KnotVector::bezier(1, [0.0, 1.0]).expect("knots");
    Surface::new(knots(), knots(), vec![a, b, a, c]).expect("a facet")
}

/// When stages began.
#[derive(Default)]
struct Stages(Mutex<Vec<(Stage, Instant)>>);

impl Monitor for Stages {
    fn begin(&self, stage: Stage) {
        self.0.lock().expect("no thread has failed").push((stage, Instant::now()));
    }
}

impl Stages {
    /// Stages with their milliseconds, up to now.
    fn told(self) -> String {
        let begun = self.0.into_inner().expect("no thread has failed");
        let ends = begun.iter().skip(1).map(|b| b.1).chain([Instant::now()]);
        let told = |((stage, from), to): (&(Stage, Instant), Instant)| {
            format!("{stage:?} {:.0}", 1e3 * to.duration_since(*from).as_secs_f64())
        };
        begun.iter().zip(ends).map(told).collect::<Vec<_>>().join(", ")
    }
}

/// Largest resident memory of this process in MB, where the system tells.
fn peak() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? / 1024)
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let n: usize = words.get(1).and_then(|n| n.parse().ok()).unwrap_or(100);
    let (surfaces, isos) = match words.first().map(String::as_str) {
        Some("triangles") => (triangles(n), 0),
        Some("fan") => (fan(n), 0),
        _ => (tori(n), 8),
    };
    let visibility = if words.get(2).is_some_and(|w| w == "propagate") { Method::Propagate } else { Method::Rays };
    let named = |surface| SceneSurface::new("", surface);
    let scene = Scene { name: "scale".into(), surfaces: surfaces.into_iter().map(named).collect() };
    let camera = Camera::orthographic(DVec3::new(0.35, -0.5, 0.8), DVec3::Z).expect("a camera");
    let options = DrawOptions { isos, visibility, ..DrawOptions::default() };
    let started = Instant::now();
    let stages = Stages::default();
    let prepared = Prepared::new(&scene, &camera, &options, &stages).expect("a picture");
    let extracted = started.elapsed();
    let [low, high] = prepared.extent();
    let traced = prepared.trace(1e-4 * low.distance(high), &stages).expect("nothing stops it");
    let all = started.elapsed();
    let points: usize = traced.strokes.iter().map(|s| s.points.len()).sum();
    println!(
        "{} surfaces: {:.0} ms to extract, {:.0} ms in all, {} strokes, {points} vertices, {:.1} µs a vertex, peak {} MB",
        scene.surfaces.len(),
        1e3 * extracted.as_secs_f64(),
        1e3 * all.as_secs_f64(),
        traced.strokes.len(),
        1e6 * all.as_secs_f64() / points as f64,
        peak().map_or("?".into(), |mb| mb.to_string()),
    );
    println!("ms: {}", stages.told());
    println!("{:?}", traced.stats.arrange);
}
