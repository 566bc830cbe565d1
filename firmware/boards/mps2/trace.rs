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

use penvis_firmware::{AXES, Axes, Hardware, Pen};

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
    negative: Axes,
    /// Steps since the start, whatever the firmware calls the place.
    position: [i32; AXES],
    /// Steps at and below which the limit switch of an axis is closed.
    switches: Option<[i32; AXES]>,
}

impl Trace {
    pub(crate) fn start() -> Self {
        UART1.start(false);
        Self { now: 0, told: 0, stuck: false, negative: Axes::NONE, position: [0; AXES], switches: None }
    }

    /// Puts a limit switch so many steps below where each axis stands; it is closed there and below.
    pub(crate) fn put_switches(&mut self, below: [i32; AXES]) {
        self.switches = Some(core::array::from_fn(|axis| self.position[axis] - below[axis]));
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
        self.negative = negative;
        self.record(DIRECTIONS | negative.bits());
    }

    fn step(&mut self, axes: Axes) {
        self.record(STEP | axes.bits());
        for (axis, position) in self.position.iter_mut().enumerate() {
            if axes.contains(axis) {
                *position += if self.negative.contains(axis) { -1 } else { 1 };
            }
        }
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

    fn limits(&mut self) -> Axes {
        let mut closed = Axes::NONE;
        for axis in 0..AXES {
            // Without switches the pins are pulled up.
            if self.switches.is_some_and(|switches| self.position[axis] <= switches[axis]) {
                closed.insert(axis);
            }
        }
        closed
    }

    fn set_time(&mut self, now: u64) {
        self.now = now;
    }
}
