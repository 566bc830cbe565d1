//! `penvis plot` against a plotter at a pseudo terminal: the path that a real port takes, with the simulated plotter at the other end.
#![cfg(unix)]

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

use clap::Parser;
use penvis::cli::Cli;
use penvis::device::find;
use penvis::sim::{Pace, Pty, Recording, SimName, SimPort};

/// A plotter at a pseudo terminal, served by a thread.
struct Plotter {
    path: PathBuf,
    over: Arc<AtomicBool>,
    thread: JoinHandle<Recording>,
}

impl Plotter {
    /// Switches it on. It is pulled out after it has received so many bytes.
    fn start(pulled_out_after: usize) -> Self {
        let mut pty = Pty::open().unwrap();
        let path = pty.path().to_owned();
        let over = Arc::new(AtomicBool::new(false));
        let ends = Arc::clone(&over);
        let thread = thread::spawn(move || {
            let name = SimName::parse("sim").unwrap().unwrap();
            let mut sim = SimPort::with(name.peer(&find("penvis").unwrap()).unwrap(), 115_200);
            let over = |received| ends.load(Ordering::Relaxed) || received >= pulled_out_after;
            assert!(pty.serve(&mut sim, Pace::Hurry, &mut |visit| over(visit.received)).unwrap());
            sim.recording()
        });
        Self { path, over, thread }
    }

    /// Plots G-code; the error if there is one, and what was drawn.
    fn plot(self, gcode: &str) -> (Result<(), String>, Recording) {
        let folder = tempfile::tempdir().unwrap();
        let job = folder.path().join("job.gcode");
        std::fs::write(&job, gcode).unwrap();
        let words = ["penvis", "plot", job.to_str().unwrap(), "--port", self.path.to_str().unwrap()];
        let result = Cli::try_parse_from(words).unwrap().run().map_err(|e| e.to_string());
        self.over.store(true, Ordering::Relaxed);
        let recording = self.thread.join().unwrap();
        (result, recording)
    }
}

fn zigzag(lines: u32) -> String {
    let mut gcode = String::from("G21\nG90\nM3S1000\nG4P0.2\nG1F6000X0Y0\n");
    for i in 0..lines {
        gcode.push_str(&format!("G1X{:.3}Y{}\n", f64::from(i % 100) * 0.5, i % 2));
    }
    gcode.push_str("M3S0\nG4P0.15\nG0X12.5Y7.25\n");
    gcode
}

#[test]
fn many_lines_arrive() {
    let (result, recording) = Plotter::start(usize::MAX).plot(&zigzag(500));
    assert_eq!(result, Ok(()));
    assert_eq!((recording.position, recording.lost_bytes, recording.lifts()), ([1000, 580, 0], 0, 1));
}

#[test]
fn a_plotter_that_is_pulled_out_is_an_error_with_its_line() {
    let (result, _) = Plotter::start(2000).plot(&zigzag(500));
    let message = result.unwrap_err();
    assert!(message.contains("job.gcode: the plotter was unplugged at line "), "{message}");
}

#[test]
fn a_refused_line_is_an_error_with_its_number() {
    let (result, recording) = Plotter::start(usize::MAX).plot("G21\nG1X10F6000\nG1Y1Y2\nG1X99\n");
    let message = result.unwrap_err();
    assert!(message.contains("line 3") && message.contains("error 25"), "{message}");
    assert!(recording.position[0] <= 800);
}
