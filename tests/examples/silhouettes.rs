//! Silhouettes: adaptive against non-adaptive subdivision (table 1 of Elber and Cohen 1989), and what the extraction of
//! all built-in models costs.
//!
//! `cargo run --release -p penvis-tests --example silhouettes`

use std::time::Instant;

use penvis::builtin;
use penvis_core::extract::facing::facing_of_all;
use penvis_core::extract::silhouette::{SilhouetteOptions, silhouettes};
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::stop::Stop;
use penvis_core::view::ViewScene;
use penvis_tests::subdivision::{PAPER, subdivide};

/// Chord error and flatness, as a part of the size of the scene: what drawing uses.
const TOLERANCE: f64 = 2e-4;
const RUNS: usize = 7;

fn main() {
    table();
    println!();
    costs();
}

/// Milliseconds of one call.
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = Instant::now();
    let result = work();
    (result, start.elapsed().as_secs_f64() * 1e3)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn table() {
    println!("Silhouettes to {TOLERANCE} of the size; medians of {RUNS} interleaved runs.\n");
    println!(
        "| model | paper | cells, non-adaptive | adaptive | ratio | ms, non-adaptive | adaptive | ratio | ms, traced | ratio |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    for (name, paper) in PAPER {
        let model = builtin::load(name).expect("a built-in model");
        let view = ViewScene::new(&model.scene, &model.view.camera().expect("a camera")).expect("a view");
        let flatness = TOLERANCE * view.size();
        let run = |adaptive| {
            let parts = view.patches().iter().map(|p| subdivide(p, flatness, adaptive));
            parts.fold((0, 0), |(cells, found), s| (cells + s.cells, found + s.found))
        };
        let traced = || {
            let (forms, _) = facing_of_all(view.patches(), Stop::NEVER);
            silhouettes(view.patches(), &forms, SilhouetteOptions { chord: flatness, normal_angle: 0.2 }, Stop::NEVER)
        };
        let (mut plain, mut adaptive, mut ours) = (Vec::new(), Vec::new(), Vec::new());
        let (mut all, mut few) = ((0, 0), (0, 0));
        for _ in 0..RUNS {
            let (a, b, c) = (timed(|| run(false)), timed(|| run(true)), timed(traced));
            (all, few) = (a.0, b.0);
            plain.push(a.1);
            adaptive.push(b.1);
            ours.push(c.1);
        }
        assert_eq!(all.1, few.1, "both find the same pieces");
        let (plain, adaptive, ours) = (median(plain), median(adaptive), median(ours));
        println!(
            "| {name} | {paper} | {} | {} | {:.1} | {plain:.1} | {adaptive:.1} | {:.1} | {ours:.2} | {:.0} |",
            all.0,
            few.0,
            all.0 as f64 / few.0 as f64,
            plain / adaptive,
            plain / ours
        );
    }
}

fn costs() {
    println!(
        "| model | patches searched | cells | depth | walks | bracketed | secants, mean | max | components | loops | cusps | crossings | undecided |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    for (name, _) in builtin::names() {
        let model = builtin::load(name).expect("a built-in model");
        let camera = model.view.camera().expect("a camera");
        let options = DrawOptions { isos: 0, ..DrawOptions::default() };
        let stats = Prepared::new(&model.scene, &camera, &options, &()).expect("a picture").stats().clone();
        let (s, c) = (&stats.silhouette, &stats.chains);
        println!(
            "| {name} | {} | {} | {} | {} | {} | {:.2} | {} | {} | {} | {} | {} | {} |",
            s.patches,
            s.cells,
            s.depth_max,
            s.walks,
            s.bracketed,
            s.steps as f64 / s.walks.max(1) as f64,
            s.steps_max,
            c.components,
            c.loops,
            c.cusps,
            s.crossings,
            stats.silhouette_undecided.len()
        );
    }
}
