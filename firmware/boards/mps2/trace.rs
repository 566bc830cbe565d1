//! Motors and pen that write what happens to them to UART1, for a decoder to rebuild the path from.
//!
//! # Form
//!
//! A sequence of records: a byte that says what happens, the time since the record before it, and what else there is to say.
//!
//! ```text
//!  7      5 4      3 2     0
//! ┌────────┬────────┬───────┐  LEB128          kind 2 only: level, 16 bits, low byte first
//! │ 0      │ kind   │ bits  │ ┌──────────┐    ┌──────────────────────────────────────────┐
//! └────────┴────────┴───────┘ └──────────┘    └──────────────────────────────────────────┘
//!
//!  Times are in ticks of the stepper, 1/25 µs.
//!
//!  kind 0   a step on each axis in `bits` (bit 0 is X), in the direction told last
//!  kind 1   the directions from now on: negative on the axes in `bits`
//!  kind 2   the pen: `bits` is 1 for on, with its level, 0 for off
//!  kind 3   `bits` is 1 for motors on, 0 for off, 2 for records lost here
//! ```

use penvis_firmware::{Axes, Hardware, Pen};

use super::registers::UART1;

const STEP: u8 = 0 << 3;
const DIRECTIONS: u8 = 1 << 3;
const PEN: u8 = 2 << 3;
const OTHER: u8 = 3 << 3;
const LOST: u8 = OTHER | 2;

/// Looks at a full port until it counts as stuck.
const PATIENCE: u32 = 1_000_000;

/// The recorder.
pub(crate) struct Trace {
    /// Ticks since the start: of what happens now, and of the last record.
    now: u64,
    told: u64,
    stuck: bool,
}

impl Trace {
    pub(crate) fn start() -> Self {
        UART1.start(false);
        Self { now: 0, told: 0, stuck: false }
    }

    fn record(&mut self, what: u8) {
        if self.stuck {
            self.stuck = !send(LOST);
            self.time();
        }
        self.byte(what);
        self.time();
    }

    fn time(&mut self) {
        let mut since = self.now.saturating_sub(self.told);
        self.told = self.now;
        while since >= 0x80 {
            self.byte(since as u8 | 0x80);
            since >>= 7;
        }
        self.byte(since as u8);
    }

    fn byte(&mut self, byte: u8) {
        self.stuck = self.stuck || !send(byte);
    }
}

fn send(byte: u8) -> bool {
    (0..PATIENCE).any(|_| UART1.offer(byte))
}

impl Hardware for Trace {
    const TICKS_PER_US: u32 = super::CLOCK_HZ / 1_000_000;

    fn set_directions(&mut self, negative: Axes) {
        self.record(DIRECTIONS | negative.bits());
    }

    fn step(&mut self, axes: Axes) {
        self.record(STEP | axes.bits());
    }

    fn set_pen(&mut self, pen: Pen) {
        match pen {
            Pen::Off => self.record(PEN),
            Pen::On { level } => {
                self.record(PEN | 1);
                for byte in level.to_le_bytes() {
                    self.byte(byte);
                }
            }
        }
    }

    fn enable_motors(&mut self, on: bool) {
        self.record(OTHER | u8::from(on));
    }

    fn set_time(&mut self, now: u64) {
        self.now = now;
    }
}
