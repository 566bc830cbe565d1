//! Bytes that a metre of ink takes: G-code by chords and by arcs, HPGL in digits and encoded (PE), without what is sent before and after the drawing.
//!
//!     cargo run --release -p penvis-tests --example bytes -- [WORDS OF penvis draw…]

use penvis::device::{self, Language};
use penvis::drawing::Drawing;
use penvis::emit;
use penvis::page::PathChoice;
use penvis_tests::plotter::drawn;

/// Built-in models that are drawn when nothing else is said.
const MODELS: [&str; 5] = ["teapot", "torus", "vase", "sphere", "spring"];

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let drawings = if words.is_empty() { MODELS.iter().map(|name| vec![*name]).collect() } else { vec![words] };
    println!("{:<24}{:>9}{:>9}{:>9}{:>7}{:>9}{:>9}{:>7}", "bytes/m", "ink m", "G1", "G1-G3", "", "PD", "PE", "");
    for words in drawings {
        row(&words);
    }
}

fn row(words: &[&str]) {
    let [chords, arcs] = [false, true].map(|curved| drawn(words, PathChoice::default(), curved).drawing);
    let metres =
        chords.polylines.iter().flat_map(|line| line.page.windows(2)).map(|w| w[0].distance(w[1])).sum::<f64>()
            / 1000.0;
    let lines = gcode(&chords) / metres;
    let curved = gcode(&arcs) / metres;
    let [digits, encoded] = [false, true].map(|encoded| hpgl(&chords, encoded) / metres);
    println!(
        "{:<24}{metres:>9.3}{lines:>9.0}{curved:>9.0}{:>7.2}{digits:>9.0}{encoded:>9.0}{:>7.2}",
        words.join(" "),
        curved / lines,
        encoded / digits
    );
}

/// Bytes of a drawing as G-code for a common plotter.
fn gcode(drawing: &Drawing) -> f64 {
    let device = device::find("grbl-servo").expect("a built-in profile");
    let bytes = |drawing: &Drawing| emit::gcode(drawing, &device).expect("it fits").len();
    (bytes(drawing) - bytes(&without_ink(drawing))) as f64
}

/// Bytes of a drawing as HPGL for a plotter that takes both.
fn hpgl(drawing: &Drawing, encoded: bool) -> f64 {
    let mut device = device::find("hpgl2").expect("a built-in profile");
    let Language::Hpgl(language) = &mut device.language else { panic!("hpgl2 speaks HPGL") };
    language.encoded = encoded;
    let bytes = |drawing: &Drawing| emit::hpgl(drawing, &device).expect("it fits").len();
    (bytes(drawing) - bytes(&without_ink(drawing))) as f64
}

fn without_ink(drawing: &Drawing) -> Drawing {
    Drawing { polylines: Vec::new(), ..drawing.clone() }
}
