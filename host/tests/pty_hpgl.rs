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

/// A plotter that draws what its buffer holds.
#[derive(Default)]
struct Plotter {
    control: Vec<u8>,
    buffer: VecDeque<u8>,
    /// Instruction that is being read.
    word: Vec<u8>,
    at: [i64; 2],
    down: bool,
    relative: bool,
    /// Lines that were drawn, from and to.
    ink: Vec<[[i64; 2]; 2]>,
    unknown: Vec<String>,
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
            b'L' => Some(format!("{BUFFER}\r")),
            b'O' => Some(format!("{}\r", if self.buffer.is_empty() { 8 } else { 0 })),
            b'E' => Some("0\r".to_owned()),
            b'K' => {
                self.buffer.clear();
                None
            }
            _ => None,
        }
    }

    fn draw(&mut self) -> Option<String> {
        for _ in 0..PACE {
            match self.buffer.pop_front()? {
                b';' => {
                    let word = std::mem::take(&mut self.word);
                    let answer = self.carry_out(&String::from_utf8_lossy(&word));
                    if answer.is_some() {
                        return answer;
                    }
                }
                byte => self.word.push(byte),
            }
        }
        None
    }

    fn carry_out(&mut self, word: &str) -> Option<String> {
        let (kind, list) = word.split_at_checked(2)?;
        match kind {
            "OA" => return Some(format!("{},{},{}\r", self.at[0], self.at[1], u8::from(self.down))),
            "OE" => return Some("0\r".into()),
            "OI" => return Some("7440A\r".into()),
            "IN" | "SP" => {}
            "PU" => self.down = false,
            "PD" => self.down = true,
            "PA" => self.relative = false,
            "PR" => self.relative = true,
            _ => self.unknown.push(word.into()),
        }
        let numbers: Vec<i64> = list.split(',').filter_map(|number| number.parse().ok()).collect();
        for pair in numbers.chunks_exact(2) {
            let from = if self.relative { self.at } else { [0, 0] };
            let to = [from[0] + pair[0], from[1] + pair[1]];
            if self.down {
                self.ink.push([self.at, to]);
            }
            self.at = to;
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
    let mut expected = Vec::new();
    for i in 0..100 {
        expected.extend([[[i, 0], [i, 100]], [[i, 100], [i, 200]]]);
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
    assert_eq!(plotter.unknown, Vec::<String>::new());
    assert_eq!(plotter.ink, expected);
}
