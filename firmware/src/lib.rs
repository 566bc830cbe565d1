//! Pen plotter firmware: the GRBL 1.1 dialect in, step pulses and pen moves out, without std and without an allocator.
//!
//! The same code runs on a board, in an emulated board, and inside the host's simulated port in virtual time. Start with [`Machine`];
//! [`Hardware`] is what a board (or a recorder) provides, and [`Pins`] provides it from `embedded-hal` pins. [`serve`] runs a machine on an
//! `embedded-io` port.
//!
//! # Theory of operation
//!
//! ```text
//!            bytes                                                              answers
//!              │                                                                   ▲
//!  realtime    ▼   ? ~ ! 0x18 ≥0x80 act at once, even inside comments              │
//!  line      RX ring, 128 bytes ─▶ line editor, 79 characters                   TX queue
//!              │ stripped line                                                     ▲
//!  gcode       ▼                          system                                   │
//!            words ─▶ checks ─▶ actions     $ commands ─▶ settings ─▶ report ──────┘
//!              │ lines and chords of arcs, machine mm, f64
//!  planner     ▼
//!            absolute steps, i32 ─▶ blocks with the speeds of their junctions, f32
//!              │
//!  segment     ▼
//!            runs of equally spaced step events, some 2.5 ms each
//! ═════════════╪═══ queue of step commands: the only thing both contexts touch ══════
//!  stepper     ▼
//!            timer interrupt: Bresenham in integers ─▶ hal: step, direction, pen
//! ```
//!
//! Above the double line is [`Controller`], which the main loop polls; below it is [`Stepper`], which the timer interrupt ticks. [`Machine`] owns both, for one
//! context. A board with interrupts owns them apart: see [`Shared`].
//!
//! 1. `ok` means planned, not drawn. A line that finds the planner full waits, unanswered, and what follows it fills the receive ring: that is what character-counting senders rely on.
//! 2. A line is checked as a whole; a refused one changes nothing.
//! 3. Dwells (G4), changes of the pen (M3, M5, S with `$32=0`) and program flow (M0, M2, M30) wait until everything before them has been drawn.
//! 4. Every target is rounded to steps once, from its absolute position. Position errors do not accumulate, and each block ends exactly there.
//! 5. Stops keep the position unless a reset (0x18) cuts off a motion, which is then reported as ALARM:3.
//!
//! # What is different from GRBL
//!
//! There is no homing cycle (`$H` and `$22=1` give error:5), no probe, no G10, G28 or G30, no start-up lines, and G54 is the only coordinate system. Soft limits (`$20`)
//! work without homing: the pen is put at the origin by hand, and the sheet lies in 0..=travel. `~` also resumes a hold that has not yet
//! come to rest. The coordinates and settings live in RAM. In laser mode (`$32=1`) changes of the pen ride with the motion, but G0 does not switch it off.
//!
//! # Units
//!
//! mm, mm/min (feeds and maximum rates, as in G-code), mm/s and mm/s² (inside the planner), steps, s in G-code, and for what the stepper times µs and ticks of the hardware's timer ([`Hardware::TICKS_PER_US`]).
//!
//! # Costs
//!
//! | | bytes of RAM, 32-bit |
//! |---|---|
//! | [`Machine`] with 15 blocks (default) | below 3 K |
//! | with 64 blocks | below 6 K |
//! | of which [`Stepper`] with its queue of [`SEGMENTS`] commands | below 1 K |
//!
//! Flash: about 36 K of thumbv7em code at `opt-level = "s"`, the software f64 arithmetic not counted.
//!
//! | | work |
//! |---|---|
//! | [`Stepper::tick`], a step | an integer addition and a comparison for each axis, two for the time, one [`Hardware::step`] |
//! | [`Stepper::tick`], a new segment | and a copy of 56 bytes |
//! | a segment, each 2.5 ms of motion | 60 f32 operations, at most 8 square roots and 8 divisions |
//! | a block | 150 f32 and 20 f64 operations, and 6 f32 operations for each earlier block whose entry speed rises |
//! | a line | per digit an integer multiplication, per word an f64 division |
//! | a chord of an arc | 10 f64 operations; sine and cosine once for the whole arc |
//!
//! The highest step rate is [`MAX_STEP_RATE`]; settings that would exceed it are refused.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(test)]
extern crate std;

mod axis;
mod controller;
mod dda;
mod error;
mod gcode;
mod hal;
mod line;
mod machine;
mod number;
mod pen;
mod planner;
mod realtime;
mod report;
mod runtime;
mod segment;
mod serve;
mod settings;
mod stepper;
mod system;

pub use axis::{AXES, Axes};
pub use controller::Controller;
pub use error::{Alarm, Error};
pub use hal::{AxisDriver, Hardware, Pins, StepDirection, Wiring};
pub use line::{LINE_CHARS, RX_BYTES};
pub use machine::Machine;
pub use pen::{Pen, Servo};
pub use realtime::{Override, RealTime};
pub use report::TX_BYTES;
pub use runtime::{Cadence, Foreground, Shared};
pub use serve::{pump, serve};
pub use settings::{MAX_STEP_RATE, Settings};
pub use stepper::{Command, IDLE_US, SEGMENTS, StepSink, Stepper, Steps};
