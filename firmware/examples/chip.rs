//! Draws a stored scene as a board does, on this machine: what the heap holds at its peak in each stage, and the strokes with the
//! hash over their coordinates.
//!
//!     penvis pack pawn -o pawn.bin
//!     cargo run --release -p penvis-firmware --features scene --example chip pawn.bin
//!
//! Pointers and lengths take twice the room here that they take on a chip of 32 bits.

use std::cell::Cell;
use std::sync::Mutex;

use peak_alloc::PeakAlloc;
use penvis_core::pipeline::{Monitor, Prepared, Stage};
use penvis_firmware::scene::StoredScene;

#[global_allocator]
static HEAP: PeakAlloc = PeakAlloc;

/// Prints the peak of each stage when the next begins.
struct Stages(Mutex<Cell<Option<Stage>>>);

impl Stages {
    fn end(&self, next: Option<Stage>) {
        if let Some(stage) = self.0.lock().expect("one thread").replace(next) {
            println!("{stage:?}: peak {}, after {}", HEAP.peak_usage(), HEAP.current_usage());
        }
        HEAP.reset_peak_usage();
    }
}

impl Monitor for Stages {
    fn begin(&self, stage: Stage) {
        self.end(Some(stage));
    }
}

fn main() {
    let path = std::env::args().nth(1).expect("a stored scene");
    let bytes = std::fs::read(path).expect("a file");
    let before = HEAP.current_usage();
    let stored = StoredScene::unpack(&bytes).expect("a scene");
    println!("file {} bytes, unpacked {}", bytes.len(), HEAP.current_usage() - before);
    let stages = Stages(Mutex::new(Cell::new(None)));
    let camera = stored.sight.camera().expect("checked");
    let prepared =
        Prepared::styled(&stored.scene, &camera, &stored.options, stored.styles(), &stages).expect("a picture");
    println!("{} curves, {} patches", prepared.curves().len(), prepared.stats().patches);
    let traced = prepared.trace(stored.tolerance, &stages).expect("never stopped");
    stages.end(None);
    let points: usize = traced.strokes.iter().map(|s| s.points.len()).sum();
    println!("{} strokes, {points} points; {:?}", traced.strokes.len(), traced.stats);
}
