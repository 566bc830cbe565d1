//! What clustering saves (Ruan, Zhang and Yong 2006, table 2): pairs of arcs and milliseconds of splitting with and
//! without it, on one core.
//!
//!     cargo run --release -p penvis-tests --example clusters

use std::time::Instant;

use penvis::builtin;
use penvis_core::pipeline::{DrawOptions, Prepared};

/// Runs of which the median is told.
const RUNS: usize = 7;

fn main() {
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global().expect("the first pool");
    println!("| model | pairs of arcs, without | with | ms to split and see, without | with |");
    println!("|---|--:|--:|--:|--:|");
    for name in ["vase", "missile", "spring", "teapot", "box"] {
        let model = builtin::load(name).expect("a built-in model");
        let camera = model.view.camera().expect("a camera");
        let [without, with] = [false, true].map(|clusters| {
            let options = DrawOptions { clusters, ..DrawOptions::default() };
            let prepared = Prepared::new(&model.scene, &camera, &options, &()).expect("a picture");
            let mut times: Vec<f64> = (0..RUNS)
                .map(|_| {
                    let started = Instant::now();
                    prepared.sightings(&()).expect("nothing stops it");
                    1e3 * started.elapsed().as_secs_f64()
                })
                .collect();
            times.sort_by(f64::total_cmp);
            (prepared.sightings(&()).expect("nothing stops it").1.arrange.pairs_near, times[RUNS / 2])
        });
        println!("| {name} | {} | {} | {:.1} | {:.1} |", without.0, with.0, without.1, with.1);
    }
}
