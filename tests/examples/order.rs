//! How far the pen travels between strokes: `cargo run -p penvis-tests --release --example order -- [FILE.svg …]`.
//!
//! Orders three drawings of a kind each, made from a seed, or those of the files, of which paths of `M` and `L` in absolute coordinates are read. For each
//! drawing and time of the search: travel with the pen up between strokes, without the way to the first and from the last, in mm; seconds of the
//! processor, where the system tells them, and neighbours that the search might look at.

use std::env;
use std::fs;
use std::process::ExitCode;
use std::time::Instant;

use glam::DVec2;
use penvis::page::{Effort, Measure, Rest, route};
use penvis_tests::strokes::{Line, hatches, rings, segments, travel};

fn main() -> ExitCode {
    println!("{:<12} {:>8} {:>9} {:>10} {:>8} {:>14}", "drawing", "strokes", "search s", "travel mm", "cpu s", "looks");
    let files: Vec<String> = env::args().skip(1).collect();
    if files.is_empty() {
        report("segments", &segments(1_000), &[0.0, 0.1, 1.0]);
        report("rings", &rings(10_000), &[0.0, 1.0, 10.0]);
        report("hatches", &hatches(100_000), &[0.0, 1.0, 10.0]);
    }
    for file in files {
        let lines = match fs::read_to_string(&file).map_err(|e| e.to_string()).and_then(|text| parse(&text)) {
            Ok(lines) => lines,
            Err(problem) => {
                eprintln!("error: {file}: {problem}");
                return ExitCode::FAILURE;
            }
        };
        let name = file.rsplit('/').next().unwrap_or(&file);
        report(name, &lines, &[0.0, 1.0, 10.0]);
    }
    ExitCode::SUCCESS
}

fn report(name: &str, lines: &[Line], times: &[f64]) {
    let pages: Vec<&[DVec2]> = lines.iter().map(Vec::as_slice).collect();
    for &seconds in times {
        let effort = Effort { measure: Measure::Distance, seconds, seed: 1 };
        let before = processor_s();
        let visits = route(&pages, Rest::default(), &effort, &|| false);
        let spent = processor_s() - before;
        let (travel, looks) = (travel(lines, &visits), effort.looks(lines.len()));
        println!("{name:<12} {:>8} {seconds:>9} {travel:>10.0} {spent:>8.2} {looks:>14}", lines.len());
    }
}

/// Time that the processor has worked for this program, or else the time of day, in s.
fn processor_s() -> f64 {
    thread_local!(static START: Instant = Instant::now());
    let told = fs::read_to_string("/proc/self/schedstat").ok();
    let nanoseconds = told.and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| START.with(Instant::elapsed).as_secs_f64(), |ns| ns * 1e-9)
}

fn parse(text: &str) -> Result<Vec<Line>, String> {
    let mut lines = Vec::new();
    for path in text.split(" d=\"").skip(1).filter_map(|rest| rest.split('"').next()) {
        for part in path.split('M').skip(1) {
            let line: Option<Line> = part.split('L').map(point).collect();
            lines.push(line.ok_or_else(|| format!("`{}` is no list of points", part.trim()))?);
        }
    }
    Ok(lines)
}

fn point(text: &str) -> Option<DVec2> {
    let mut numbers = text.split([' ', ',']).filter(|t| !t.is_empty()).map(|t| t.parse().ok());
    Some(DVec2::new(numbers.next()??, numbers.next()??))
}
