//! Figures of every built-in model at default settings, as Markdown: seconds of every stage, counts, and how the
//! pipeline's visibility agrees with the oracle's.
//!
//!     cargo run --release -p penvis-tests --example figures [MODEL…]
//!
//! Times are medians of several runs in one process, on all cores; `RAYON_NUM_THREADS=1` gives those of one core.

use std::time::Instant;

use penvis::stats::Stats;
use penvis::{builtin, emit};
use penvis_core::pipeline::DrawOptions;
use penvis_tests::agreement::{Agreement, compare};
use penvis_tests::plotter::{draw, simulated};
use penvis_tests::stages::STAGES;

/// Runs of which the median is told.
const RUNS: usize = 7;

struct Row {
    name: &'static str,
    seconds: [f64; STAGES.len()],
    stats: Stats,
    agreement: Agreement,
}

fn main() {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    let names = builtin::names().map(|(name, _)| name);
    let rows: Vec<Row> = names.filter(|name| wanted.is_empty() || wanted.iter().any(|w| w == name)).map(row).collect();
    println!("Milliseconds, median of {RUNS} runs; from the name of the model to G-code.\n");
    println!("| model | {} |", STAGES.map(|s| s.0).join(" | "));
    println!("|---|{}", "--:|".repeat(STAGES.len()));
    for row in &rows {
        println!("| {} | {} |", row.name, row.seconds.map(|s| format!("{:.1}", 1000.0 * s)).join(" | "));
    }
    println!("\nCounts. Places are on all curves, hidden ones too, and compared are the numbers of sheets in front.\n");
    let columns = [
        "model",
        "surfaces",
        "patches",
        "curves",
        "pieces",
        "rays",
        "strokes",
        "ink mm",
        "lifts",
        "undecided",
        "places judged",
        "not judged (of length)",
        "disagreements",
    ];
    println!("| {} |", columns.join(" | "));
    println!("|---|{}", "--:|".repeat(columns.len() - 1));
    for Row { name, stats, agreement, .. } in &rows {
        println!(
            "| {name} | {} | {} | {} | {} | {} | {} | {:.0} | {} | {} | {} | {:.1} % | {} |",
            stats.model.surfaces,
            stats.model.patches,
            stats.arrange.curves,
            stats.arrange.pieces,
            stats.visibility.rays_active + stats.visibility.rays_passive,
            stats.strokes.count,
            stats.strokes.ink_mm,
            stats.strokes.lifts,
            stats.undecided(),
            agreement.agreed + agreement.disagreements.len(),
            100.0 * agreement.ambiguous(),
            agreement.disagreements.len(),
        );
    }
}

fn row(name: &'static str) -> Row {
    let device = simulated();
    let mut times: [Vec<f64>; STAGES.len()] = Default::default();
    let mut last = None;
    for _ in 0..RUNS {
        let started = Instant::now();
        let mut computed = draw(&[name]);
        let emitting = Instant::now();
        emit::gcode(&computed.drawing, &device).expect("G-code");
        computed.seconds.emit = emitting.elapsed().as_secs_f64();
        computed.seconds.total = started.elapsed().as_secs_f64();
        for (times, (_, of)) in times.iter_mut().zip(STAGES) {
            times.push(of(&computed.seconds));
        }
        last = Some(Stats::new(&computed.stats, computed.seconds, &computed.drawing, &device));
    }
    let seconds = times.map(|mut all| {
        all.sort_by(f64::total_cmp);
        all[RUNS / 2]
    });
    let model = builtin::load(name).expect("a built-in model");
    let options = DrawOptions { deepest: u32::MAX, ..DrawOptions::default() };
    let agreement = compare(&model.scene, &model.view, &options);
    Row { name, seconds, stats: last.expect("at least one run"), agreement }
}
