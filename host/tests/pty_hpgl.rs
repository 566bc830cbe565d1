//! `penvis plot` against an HPGL plotter with a small buffer at a pseudo terminal.
#![cfg(unix)]

use std::collections::VecDeque;
use std::io::{Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use clap::Parser;
use penvis::cli::Cli;
use serialport::{SerialPort, TTYPort};

/// Bytes of the buffer, as in the smallest plotter.
const BUFFER: usize = 60;

/// Bytes that it draws between two looks at the line.
const PACE: usize = 20;

/// What is left to be drawn, what was drawn, and whether anything was lost.
#[derive(Default)]
struct Plotter {
    control: Vec<u8>,
    buffer: VecDeque<u8>,
    drawn: Vec<u8>,
    lost: bool,
}

impl Plotter {
    fn receive(&mut self, byte: u8) -> Option<String> {
        if byte != 0x1b && self.control.is_empty() {
            self.lost |= self.buffer.len() == BUFFER;
            self.buffer.push_back(byte);
            return None;
        }
        self.control.push(byte);
        if self.control.len() < 3 {
            return None;
        }
        self.control.clear();
        match byte {
            b'B' => Some(format!("{}\r", BUFFER.saturating_sub(self.buffer.len()))),
            b'O' => Some(format!("{}\r", if self.buffer.is_empty() { 8 } else { 0 })),
            b'E' => Some("0\r".to_owned()),
            b'K' => {
                self.buffer.clear();
                None
            }
            _ => None,
        }
    }

    fn draw(&mut self) -> Option<&'static str> {
        for _ in 0..PACE {
            self.drawn.push(self.buffer.pop_front()?);
            for (question, answer) in [(&b"OA;"[..], "120,340,0\r"), (b"OE;", "0\r")] {
                if self.drawn.ends_with(question) {
                    self.drawn.truncate(self.drawn.len() - question.len());
                    return Some(answer);
                }
            }
        }
        None
    }
}

#[test]
fn every_instruction_arrives_through_a_buffer_of_60_bytes() {
    let (mut master, slave) = TTYPort::pair().unwrap();
    let path = slave.name().unwrap();
    let over = Arc::new(AtomicBool::new(false));
    let ends = Arc::clone(&over);
    let thread = thread::spawn(move || {
        // Held so that the master does not see an end before the program comes.
        let _slave = slave;
        master.set_timeout(Duration::from_millis(1)).unwrap();
        let mut plotter = Plotter::default();
        let mut buffer = [0; 256];
        while !ends.load(Ordering::Relaxed) {
            let count = master.read(&mut buffer).unwrap_or(0);
            for byte in &buffer[..count] {
                if let Some(answer) = plotter.receive(*byte) {
                    master.write_all(answer.as_bytes()).unwrap();
                }
            }
            if let Some(answer) = plotter.draw() {
                master.write_all(answer.as_bytes()).unwrap();
            }
        }
        plotter
    });
    let folder = tempfile::tempdir().unwrap();
    let job = folder.path().join("job.plt");
    let mut hpgl = String::from("IN;SP1;");
    for i in 0..100 {
        hpgl.push_str(&format!("PU{i},0;PD{i},100,{i},200;"));
    }
    hpgl.push_str("PU;SP0;");
    std::fs::write(&job, &hpgl).unwrap();
    let words = ["penvis", "plot", job.to_str().unwrap(), "--device", "hp7440a", "--port", &path];
    let result = Cli::try_parse_from(words).unwrap().run().map_err(|e| e.to_string());
    over.store(true, Ordering::Relaxed);
    let plotter = thread.join().unwrap();
    assert_eq!(result, Ok(()));
    assert!(!plotter.lost, "the buffer overflowed");
    assert_eq!(String::from_utf8(plotter.drawn).unwrap(), hpgl);
}
