//! Visible regions, as Markdown: their area against that which the oracle's triangles cover, and pixels farther than one from a
//! border on the wrong side of it, by the painted preview, or, where it is too coarse to tell (steep), by the triangles; milliseconds on one core, without clusters of surfaces and with them, for
//! which Ruan, Zhang and Yong (2006, table 2) had 24.7 and 7.6 s for their vase, 50.4 and 22.7 s for their missile, and 42.4 and
//! 42.3 s for their spring.
//!
//!     cargo run --release -p penvis-tests --example regions [--pixels N] [--views N] [MODEL|FILE.json…]
//!
//! The built-in models from their own views at 2000 pixels if nothing else is said; with views, from so many directions all round.
//! Ends with failure if a pixel is on the wrong side or in two regions, a place is undecided, or an area is off by 0.1 % and more.

use std::process::ExitCode;
use std::time::Instant;

use clap::Parser;
use penvis::model::View;
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::scene::Scene;
use penvis_tests::models::models;
use penvis_tests::oracle::Oracle;
use penvis_tests::raster::grid;
use penvis_tests::regions::against;
use penvis_tests::views::directions;

/// Lines by which the oracle measures an area.
const LINES: u32 = 2000;

#[derive(Parser)]
struct Args {
    /// Models.
    models: Vec<String>,
    /// Pixels of the longer side.
    #[arg(long, default_value_t = 2000)]
    pixels: usize,
    /// Directions; 0 for the model's own view.
    #[arg(long, default_value_t = 0)]
    views: u32,
}

/// What is found in one view, or in several.
#[derive(Default)]
struct Found {
    views: usize,
    /// In pixels.
    covered: f64,
    area: f64,
    /// Largest difference between area and what is covered, as a part of this.
    worst: f64,
    wrong: usize,
    steep: usize,
    shared: usize,
    undecided: usize,
    /// Milliseconds without clusters and with them.
    times: [f64; 2],
}

impl Found {
    fn is_right(&self) -> bool {
        self.wrong + self.shared + self.undecided == 0 && self.worst < 1e-3
    }
}

fn main() -> ExitCode {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("the first pool");
    let args = Args::parse();
    println!(
        "| model | views | covered, in pixels | area | largest difference | wrong side | steep | in two | undecided | ms without | \
         ms with clusters |"
    );
    println!("|---|{}", "--:|".repeat(10));
    let mut right = true;
    for (word, model) in models(args.models) {
        let mut views: Vec<View> = directions(args.views).map(View::orthographic).collect();
        if views.is_empty() {
            views.push(model.view.unwrap_or(View::ISOMETRIC));
        }
        let mut found = Found::default();
        for view in &views {
            look(&model.scene, view, args.pixels, &mut found);
        }
        right &= found.is_right();
        println!(
            "| {word} | {} | {:.0} | {:.0} | {:.4} % | {} | {} | {} | {} | {:.0} | {:.0} |",
            found.views,
            found.covered,
            found.area,
            100.0 * found.worst,
            found.wrong,
            found.steep,
            found.shared,
            found.undecided,
            found.times[0],
            found.times[1]
        );
    }
    if right { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn look(scene: &Scene, view: &View, pixels: usize, found: &mut Found) {
    let camera = view.camera().expect("a camera");
    for (k, clusters) in [false, true].into_iter().enumerate() {
        let options = DrawOptions { isos: 0, clusters, ..DrawOptions::default() };
        let started = Instant::now();
        let prepared = Prepared::new(scene, &camera, &options, &()).expect("seen");
        let grid = grid(&prepared, pixels);
        let regions = prepared.visible_regions(0.05 * grid.pixel, 0.2, &()).expect("nothing stops it");
        found.times[k] += 1e3 * started.elapsed().as_secs_f64();
        if !clusters {
            continue;
        }
        let raster = prepared.render(&grid, &()).expect("nothing stops it");
        let oracle = Oracle::new(scene, view);
        let a = against(&prepared, &regions, &raster, || &oracle);
        let covered = oracle.area(LINES) / grid.pixel.powi(2);
        found.views += 1;
        found.covered += covered;
        found.area += a.area;
        found.worst = found.worst.max((a.area / covered - 1.0).abs());
        found.steep += a.steep;
        found.wrong += a.wrong;
        found.shared += a.shared;
        found.undecided += regions.undecided.len();
        for place in &regions.undecided {
            eprintln!("{} {view:?}: {place:?}", scene.name);
        }
        if a.wrong + a.shared > 0 || (a.area / covered - 1.0).abs() >= 1e-3 {
            eprintln!("{} {view:?}: {a:?}", scene.name);
        }
    }
}
