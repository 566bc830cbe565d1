//! Every simulated plotter with every fault, over many seeds: how often the job was drawn, how often it stopped with the place that
//! failed, and what else came of it.
//!
//!     cargo run --release -p penvis-tests --example faults -- [--seeds 200] [--first 0] [--only PORT|DEVICE|FAULT]… [--list] [--list-stopped]
//!
//! `--list` also prints each seed that went wrong, with what happened and what was said, and `--list-stopped` each that stopped. Ends with failure if any did.

use std::process::ExitCode;

use penvis::sim::FaultKind;
use penvis_tests::faults::{Bench, PLOTTERS, Verdict};
use rayon::prelude::*;

fn main() -> ExitCode {
    let (mut seeds, mut first, mut only, mut list, mut list_stopped) = (200, 0, Vec::new(), false, false);
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut number = || words.next().and_then(|number| number.parse().ok());
        match word.as_str() {
            "--seeds" => seeds = number().unwrap_or(seeds),
            "--first" => first = number().unwrap_or(first),
            "--only" => only.extend(words.next()),
            "--list" => list = true,
            "--list-stopped" => list_stopped = true,
            _ => {
                eprintln!("{word} is no option; see the top of this example");
                return ExitCode::FAILURE;
            }
        }
    }
    let kinds: Vec<_> = FaultKind::all().collect();
    let asked_kinds = kinds.iter().any(|kind| only.iter().any(|word| word == kind.name()));
    let asked_plotters = PLOTTERS.iter().any(|(port, device)| only.iter().any(|word| word == port || word == device));
    print!("{:<38}{:<14}{:<18}", "port", "device", "fault");
    for verdict in Verdict::ALL {
        print!("{verdict:>13}");
    }
    println!();
    let mut good = true;
    for (port, device) in PLOTTERS {
        if asked_plotters && !only.iter().any(|word| word == port || word == device) {
            continue;
        }
        let bench = match Bench::new(port, device) {
            Ok(bench) => bench,
            Err(problem) => {
                println!("{port:<38}{device:<14}{problem}");
                good = false;
                continue;
            }
        };
        for kind in &kinds {
            if asked_kinds && !only.iter().any(|word| word == kind.name()) {
                continue;
            }
            let seeds = first..first + seeds;
            let outcomes: Vec<_> = seeds.into_par_iter().map(|seed| (seed, bench.try_fault(*kind, seed))).collect();
            print!("{port:<38}{device:<14}{:<18}", kind.name());
            for verdict in Verdict::ALL {
                let count = outcomes.iter().filter(|(_, o)| o.as_ref().is_ok_and(|o| o.verdict == verdict)).count();
                print!("{:>13}", if count == 0 { "-".to_owned() } else { count.to_string() });
            }
            println!();
            for (seed, outcome) in outcomes {
                match outcome {
                    Ok(outcome) => {
                        good &= outcome.verdict.is_good();
                        let listed = if outcome.verdict.is_good() {
                            list_stopped && outcome.verdict == Verdict::Stopped
                        } else {
                            list
                        };
                        if listed {
                            println!("    seed {seed}: {} ({}): {}", outcome.verdict, outcome.struck, outcome.message);
                        }
                    }
                    Err(problem) => {
                        good = false;
                        println!("    seed {seed}: {problem}");
                    }
                }
            }
        }
    }
    if good { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}
