//! The pipeline's visibility against the oracle's, from 20 directions all round, parallel and in perspective: numbers of
//! sheets on all curves, hidden ones too.
//!
//!     cargo run --release -p penvis-tests --example oracle [rays|propagate] [MODEL|FILE.json…]
//!
//! All built-in models if none is named. Ends with failure if any place is judged differently.

use std::process::ExitCode;

use penvis::model::View;
use penvis_core::pipeline::DrawOptions;
use penvis_core::visibility::Method;
use penvis_tests::agreement::compare;
use penvis_tests::models::models;
use penvis_tests::views::{directions, near};

/// Directions to the eye.
const VIEWS: u32 = 20;

fn main() -> ExitCode {
    let mut words: Vec<String> = std::env::args().skip(1).collect();
    let visibility = match words.first().map(String::as_str) {
        Some("propagate") => Method::Propagate,
        _ => Method::Rays,
    };
    words.retain(|w| w != "rays" && w != "propagate");
    println!("| model | places judged alike | differently | not judged (of length) |");
    println!("|---|--:|--:|--:|");
    let mut wrong = 0;
    for (word, model) in models(words) {
        let scene = model.scene;
        let options = DrawOptions { deepest: u32::MAX, visibility, ..DrawOptions::default() };
        let (mut agreed, mut differ, mut length, mut judged) = (0, 0, 0.0, 0.0);
        for direction in directions(VIEWS) {
            for view in [View::orthographic(direction), near(&scene, direction)] {
                let a = compare(&scene, &view, &options);
                for d in &a.disagreements {
                    eprintln!("{word} {view:?}: {d:?}");
                }
                agreed += a.agreed;
                differ += a.disagreements.len();
                length += a.length;
                judged += a.judged_length;
            }
        }
        wrong += differ;
        println!("| {word} | {agreed} | {differ} | {:.1} % |", 100.0 * (1.0 - judged / length));
    }
    if wrong == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
