//! The painted preview of every built-in model against sight lines through the middles of its pixels, as Markdown.
//!
//!     cargo run --release -p penvis-tests --example render [MODEL|FILE.json…]
//!
//! On a page of A4 at 150 dpi, as `penvis draw --render` has it, from the model's own view. Ends with failure if a covered
//! pixel is unpainted, or painted with what is not there or not in front.

use std::process::ExitCode;
use std::time::Instant;

use glam::DVec3;
use penvis::emit::{Pixels, RENDER_DPI};
use penvis::page::Layout;
use penvis::render::grid;
use penvis_tests::models::models;
use penvis_tests::plotter::options;
use penvis_tests::raster::{Agreement, against, prepared};

fn main() -> ExitCode {
    println!(
        "| model | covered | unpainted | rim | deeper | astray | other surface in the middle | isocurves | points (10⁶) | \
         painting (ms) | shading (ms) |"
    );
    println!("|---|{}", "--:|".repeat(10));
    let mut all = Agreement::default();
    for (word, model) in models(std::env::args().skip(1).collect()) {
        let options = options(&[&word]);
        let prepared = prepared(&model.scene, &options.view.resolve(model.view, &model.scene));
        let (page, margin_mm) = options.sheet.settle().expect("a sheet");
        let layout = Layout::fit(prepared.extent(), page, margin_mm).expect("it fits");
        let pixels = Pixels::new(page, RENDER_DPI).expect("a page");
        let started = Instant::now();
        let raster = prepared.render(&grid(&layout, page, &pixels), &()).expect("nothing stops it");
        let painting = started.elapsed();
        let started = Instant::now();
        let _shades = prepared.shade(&raster, DVec3::new(-1.0, 1.0, 1.0), &()).expect("nothing stops it");
        let shading = started.elapsed();
        let a = against(&prepared, &raster);
        all = all.plus(a);
        println!(
            "| {word} | {} | {} | {} | {} | {} | {} | {} | {:.1} | {} | {} |",
            a.covered,
            a.unpainted,
            a.rim,
            a.deeper,
            a.astray,
            a.other,
            raster.stats.curves,
            raster.stats.points as f64 / 1e6,
            painting.as_millis(),
            shading.as_millis()
        );
    }
    println!("\n{all:?}");
    if all.is_right() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
