//! Draws a stored scene as a board does, on this machine: what the heap holds at its peak in each stage, without the stored scene itself, which a board
//! has in its flash or in memory set aside, and the strokes with the hash over their coordinates.
//!
//!     penvis pack pawn -o pawn.bin
//!     cargo run --release -p penvis-firmware --features scene --example chip pawn.bin [CELLS]
//!
//! Pointers and lengths take twice the room here that they take on a chip of 32 bits. What it takes there is told by
//!
//!     rustup target add i686-unknown-linux-musl
//!     CARGO_TARGET_I686_UNKNOWN_LINUX_MUSL_LINKER=rust-lld \
//!         cargo run -p penvis-firmware --features scene --target i686-unknown-linux-musl --example chip pawn.bin
//!
//! Without CELLS patches are not cut ahead of the sight lines.

use std::cell::Cell;
use std::sync::Mutex;

use peak_alloc::PeakAlloc;
use penvis_core::pipeline::{Monitor, Stage};
use penvis_firmware::scene::draw;

#[global_allocator]
static HEAP: PeakAlloc = PeakAlloc;

/// Prints the peak of each stage when the next begins.
struct Stages {
    stage: Mutex<Cell<Option<Stage>>>,
    /// What the heap held before.
    before: usize,
}

impl Stages {
    fn end(&self, next: Option<Stage>) {
        if let Some(stage) = self.stage.lock().expect("one thread").replace(next) {
            println!("{stage:?}: {} bytes at most", HEAP.peak_usage().saturating_sub(self.before));
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
    let mut words = std::env::args().skip(1);
    let path = words.next().expect("a stored scene");
    let cells = words.next().map_or(0, |n| n.parse().expect("a number of cells"));
    let bytes = std::fs::read(path).expect("a file");
    let stages = Stages { stage: Mutex::default(), before: HEAP.current_usage() };
    let mut lines = 0;
    let figures = draw(&bytes, cells, &stages, &mut |_| {
        lines += 1;
        true
    });
    let figures = figures.expect("a scene that can be drawn");
    stages.end(None);
    println!(
        "{} bytes of scene, {lines} lines, {} strokes, {} points, hash {:016x}",
        bytes.len(),
        figures.strokes,
        figures.points,
        figures.hash
    );
}
