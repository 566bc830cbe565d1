//! `penvis plot` against an HPGL plotter with a small buffer at a pseudo terminal.
#![cfg(unix)]

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use clap::Parser;
use penvis::cli::Cli;
use penvis::device::find;
use penvis::sim::{Pace, Pty, SimName, SimPort};

#[test]
fn every_instruction_arrives_through_a_buffer_of_60_bytes() {
    let mut pty = Pty::open().unwrap();
    let path = pty.path().to_owned();
    let over = Arc::new(AtomicBool::new(false));
    let ends = Arc::clone(&over);
    let thread = thread::spawn(move || {
        let device = find("hp7440a").unwrap();
        let name = SimName::parse("sim:hpgl7475a,buffer=60").unwrap().unwrap();
        let mut sim = SimPort::with(name.peer(&device).unwrap(), 9600);
        assert!(pty.serve(&mut sim, Pace::Hurry, &mut |_| ends.load(Ordering::Relaxed)).unwrap());
        sim.recording()
    });
    let folder = tempfile::tempdir().unwrap();
    let job = folder.path().join("job.plt");
    let mut hpgl = String::from("IN;SP1;");
    for i in 0..100 {
        hpgl.push_str(&format!("PU{i},0;PD{i},100,{i},200;"));
    }
    hpgl.push_str("PU;SP0;");
    std::fs::write(&job, &hpgl).unwrap();
    let words = ["penvis", "plot", job.to_str().unwrap(), "--device", "hp7440a", "--port", path.to_str().unwrap()];
    let result = Cli::try_parse_from(words).unwrap().run().map_err(|e| e.to_string());
    over.store(true, Ordering::Relaxed);
    let recording = thread.join().unwrap();
    assert_eq!(result, Ok(()));
    // A plotter that has just been switched on does not hear the first three questions, and is asked again.
    assert!(recording.lost_bytes <= 9, "{} bytes are lost", recording.lost_bytes);
    assert_eq!((recording.lifts(), recording.position[..2].to_vec()), (100, vec![99, 200]));
    assert!((recording.ink_mm() - 100.0 * 200.0 * 0.02488).abs() < 1e-6, "{} mm", recording.ink_mm());
}
