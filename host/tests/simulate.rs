//! `penvis simulate --pty` as another program, and `penvis plot` as its client.
#![cfg(unix)]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use clap::Parser;
use penvis::cli::Cli;

/// Starts it; the name of its port comes back.
fn start(words: &[&str]) -> (Child, String) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_penvis"))
        .args(["simulate", "--pty", "--fast", "--once"])
        .args(words)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
    (child, line.trim().to_owned())
}

/// Waits for its end, which must come.
fn ends(mut child: Child) -> bool {
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(60) {
        if let Some(status) = child.try_wait().unwrap() {
            return status.success();
        }
        thread::sleep(Duration::from_millis(20));
    }
    child.kill().unwrap();
    panic!("it goes on when its client has hung up");
}

fn plot(job: &Path, port: &str) -> Result<(), String> {
    let words = ["penvis", "plot", job.to_str().unwrap(), "--port", port];
    Cli::try_parse_from(words).unwrap().run().map_err(|e| e.to_string())
}

const SQUARE: &str =
    "G21\nG90\nG0X10Y10\nM3S1000\nG4P0.2\nG1X30F2000\nG1Y30\nG1X10\nG1Y10\nM3S0\nG4P0.15\nG0X0Y0\nM5\n";

#[test]
fn a_client_plots_and_its_ink_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let (job, ink, link) =
        (folder.path().join("a.gcode"), folder.path().join("ink.svg"), folder.path().join("plotter"));
    fs::write(&job, SQUARE).unwrap();
    let (child, port) =
        start(&["--port", "sim:grbl", "--out", ink.to_str().unwrap(), "--link", link.to_str().unwrap()]);
    assert_eq!(Path::new(&port), link);
    assert_eq!(plot(&job, &port), Ok(()));
    assert!(ends(child));
    let svg = fs::read_to_string(ink).unwrap();
    assert_eq!(svg.matches("<path").count(), 1, "{svg}");
    assert!(!link.is_symlink());
}

#[test]
fn what_goes_wrong_there_is_an_error_here() {
    let folder = tempfile::tempdir().unwrap();
    let job = folder.path().join("a.gcode");
    fs::write(&job, SQUARE).unwrap();
    let (child, port) = start(&["--port", "sim:grbl", "--fault", "reset@80"]);
    let message = plot(&job, &port).unwrap_err();
    assert!(message.contains("restarted"), "{message}");
    assert!(ends(child));
}

#[test]
fn what_makes_no_sense_is_refused() {
    for (words, part) in [
        (&["--port", "/dev/ttyS0"][..], "begins with `sim`"),
        (&["--port", "sim:lots"], "no simulated plotter `lots`"),
        (&["--out", "a.gcode"], "ends in .svg or .png"),
        (&["--link", "/"], "--link /: "),
        (&["--fault", "lots"], "no fault `lots`"),
    ] {
        let line = ["penvis", "simulate", "--pty"].iter().chain(words);
        let message = Cli::try_parse_from(line).unwrap().run().unwrap_err().to_string();
        assert!(message.contains(part) && !message.contains('\n'), "{message}");
    }
}
