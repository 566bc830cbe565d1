//! Whole jobs on simulated plotters with which something goes wrong: drawn, or stopped with the place that failed. The example
//! `faults` does the same over more seeds.

use penvis::sim::FaultKind;
use penvis_tests::faults::{Bench, PLOTTERS};
use rayon::prelude::*;

/// Seeds for each plotter and fault.
const SEEDS: u64 = 3;

/// What goes wrong with today's senders, and why: how the port's name begins, and the fault.
const KNOWN: &[(&str, FaultKind, &str)] = &[];

#[test]
fn nothing_is_lost_without_a_word() {
    let mut wrong = Vec::new();
    for (port, device) in PLOTTERS {
        let bench = Bench::new(port, device).unwrap_or_else(|problem| panic!("{port}, {device}: {problem}"));
        let cases: Vec<_> = FaultKind::all().flat_map(|kind| (0..SEEDS).map(move |seed| (kind, seed))).collect();
        let outcomes: Vec<_> = cases
            .into_par_iter()
            .map(|(kind, seed)| (kind, seed, bench.try_fault(kind, seed).expect("the job can be plotted")))
            .collect();
        for (kind, seed, outcome) in outcomes {
            if outcome.verdict.is_good() {
                continue;
            }
            let line = format!(
                "{port} {device} {} seed {seed}: {} ({}): {}",
                kind.name(),
                outcome.verdict,
                outcome.struck,
                outcome.message
            );
            match KNOWN.iter().find(|(known, fault, _)| port.starts_with(known) && *fault == kind) {
                Some((.., reason)) => println!("known ({reason}): {line}"),
                None => wrong.push(line),
            }
        }
    }
    assert!(wrong.is_empty(), "{} went wrong:\n{}", wrong.len(), wrong.join("\n"));
}
