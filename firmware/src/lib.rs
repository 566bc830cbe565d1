//! Pen plotter firmware: the GRBL 1.1 dialect in, step pulses and pen moves out, without std and without an allocator.
//!
//! The same code runs on a board, in an emulated board, and inside the host's simulated port in virtual time. Start with [`Machine`];
//! [`Hardware`] is what a board (or a recorder) provides, [`Pins`] provides it from `embedded-hal` pins, and [`PortMotors`] from a port's registers. [`serve`] runs a machine on an
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
//!            words ─▶ checks ─▶ actions     $ commands ─▶ settings ─▶ storage, report ─┘
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
//! 2. A line is checked as a whole; a refused one changes nothing. What is stored is in force once it is in the memory.
//! 3. Dwells (G4), changes of the pen (M3, M5, S with `$32=0`) and program flow (M0, M2, M30) wait until everything before them has been drawn.
//! 4. Every target is rounded to steps once, from its absolute position. Position errors do not accumulate, and each block ends exactly there.
//! 5. Lines that lie on one line within half a step share a block. `Bf:` and `[OPT:` therefore count lines, of which those that are missing from the whole have not been
//!    drawn, and `Ln:` is the first line of the block at which the *motors* are: neither promises what has not been drawn.
//! 6. Feeds, limits and reports are the pen's, in mm; how the motors move it is [`Kinematics`]' affair.
//! 7. Stops keep the position unless a reset (0x18) cuts off a motion, which is then reported as ALARM:3.
//!
//! # What outlives switching off
//!
//! With a memory of `embedded-storage`'s `NorFlash` ([`Controller::with_storage`]): the settings, the origins of G54 to G59, the places of G28 and G30, the start-up lines of `$N`
//! and the text of `$I=`. Two slots take turns, so that a cut of the power while one is written leaves the record of the other. Without a memory
//! all of these last until the machine is switched off.
//!
//! # HPGL
//!
//! The same machine is an HPGL plotter when `$450` says so, or (`$450=0`) when the first thing that it hears is `ESC` or `IN;`; 0x18 goes back to G-code.
//! It knows `IN DF SP PU PD PA PR PE VS IP SC IW`, answers `OA OC OE OF OH OI OO OP OS OW`, and obeys device control (`ESC.` with `@ B E H I K L M N O R ( ) Y Z`) at once, past a buffer of
//! [`HPGL_BYTES`]. There is one pen: SP0 puts it away, any other takes it. It draws no arcs and letters no labels; an instruction that it does not know is error 1 of
//! `OE`, and error 7 says that an alarm has it locked. A line that begins with `$` is a system command here too.
//!
//! Plotter units of `$451` (0.025 mm; HP's own plotters: 0.02488) lie at the work origin, and what is outside of the travel is not drawn. PD goes to the pen's level of `$30`,
//! each change of the pen is given `$452` ms, and without VS the machine is as fast as its axes. A pen on the Z axis is for G-code.
//!
//! # Homing and limits
//!
//! `$22=1` has the machine start locked until `$H` has found the home switches of the axes in `$44`: towards the ends that `$23` says, at the feeds of `$25` and `$24`, with the
//! pull-off of `$27`; Z first, then X and Y together. A pen that hangs on cords (`$500=2`) does not home, since its cords have no ends. Then the travel lies below the origin, as in GRBL; `$22=9` makes home the origin instead. `$21` stops at once when a
//! switch closes, `$20` refuses targets outside of the travel.
//!
//! # Boards
//!
//! `boards/` of this package has a binary for each board that it runs on, with wiring, pins and theory of operation at the top of its file; `build.rs` knows their
//! memories. They need a feature each, `board-pico` for `pico`, and are empty on a host. A new board is a file of the same kind: a timer, a serial port, a [`Port`] of pins
//! ([`PortMotors`] does the rest), and handlers that call [`Shared`] and what the boards share.
//!
//! # What is different from GRBL
//!
//! There is no probe (G38, `$6`): a pen needs none. Axes that home stop with deceleration, so that no step is lost. Soft limits (`$20`)
//! also work without homing: the pen is put at the origin by hand, and the sheet lies in 0..=travel. `~` also resumes a hold that has not yet
//! come to rest. A start-up line is checked when it is given, and not obeyed before the next start. An open door (0x84) counts as closed when `~` comes. In laser mode (`$32=1`)
//! changes of the pen ride with the motion, but G0 does not switch it off. From grblHAL come the numbers of what GRBL has not: `$22` bit 3, `$41` (park the pen at a hold), `$44`,
//! and `$HX`.
//!
//! Settings that GRBL does not have:
//!
//! | | |
//! |---|---|
//! | `$140`–`$142` | jerk of X, Y, Z, mm/s³: above 0 for X and Y ramps are S-shaped, of the lowest acceleration and jerk of the axes that take part; 0, the default: trapezoids |
//! | `$500` | how the motors move the pen: 0 a motor an axis, 1 CoreXY, 2 hanging on two cords |
//! | `$501`–`$503` | hanging: distance of the motors; how far the origin is to the right of the left one, and below both; mm |
//! | `$510`, `$511` | speed of the pen while S rises and while it falls, S a second; 0, the default: at once |
//! | `$512` | time in which the pen then settles, ms; a solenoid only holds after it |
//!
//! # Units
//!
//! mm, mm/min (feeds and maximum rates, as in G-code), mm/s and mm/s² (inside the planner), steps, s in G-code, and for what the stepper times µs and ticks of the hardware's timer ([`Hardware::TICKS_PER_US`]).
//!
//! # Features
//!
//! `scene`, which needs an allocator: scenes stored in a compact form, which `penvis-core` draws on the board itself, by the `$PV` commands of the module `scene`.
//!
//! # Costs
//!
//! | | bytes of RAM, 32-bit |
//! |---|---|
//! | [`Machine`] with 15 blocks (default) | below 6 K |
//! | with 64 blocks | below 9 K |
//! | of which the receive ring, for HPGL | [`HPGL_BYTES`] |
//! | of which what is stored | below 1 K |
//! | with the feature `scene`, more | below 0.5 K |
//! | stack while a record is written | 3 K |
//! | of which [`Stepper`] with its queue of [`SEGMENTS`] commands | below 1 K |
//!
//! Flash: about 36 K of thumbv7em code at `opt-level = "s"`, the software f64 arithmetic not counted.
//!
//! | | work |
//! |---|---|
//! | [`Stepper::tick`], a step | 55 instructions on a Cortex-M4F and on a Cortex-M7, with two axes in motion and a table of port patterns; 91 with [`Hardware::TICK_ENDS_PULSE`] |
//! | [`Stepper::tick`], a new segment | some 120 instructions more, and at a new block divisions for the position |
//! | a segment, each 2.5 ms of motion | 60 f32 operations, at most 8 square roots and 8 divisions; with limited jerk up to 14 times 100, and 30 for each block within the way of a stop |
//! | a block, and a line that joins one | 200 f32 and 30 f64 operations, and 6 f32 operations for each earlier block whose entry speed rises |
//! | a line | per digit an integer multiplication, per word an f64 division |
//! | a chord of an arc | 10 f64 operations; sine and cosine once for the whole arc |
//!
//! The highest step rate is [`MAX_STEP_RATE`]; settings that would exceed it are refused.
#![no_std]
#![forbid(unsafe_code)]

#[cfg(feature = "scene")]
extern crate alloc;
#[cfg(test)]
extern crate std;

mod axis;
mod controller;
mod dda;
mod error;
mod gcode;
mod hal;
mod hpgl;
mod kinematics;
mod line;
mod machine;
mod number;
mod pen;
mod pen_driver;
mod planner;
mod port;
mod realtime;
mod report;
mod runtime;
#[cfg(feature = "scene")]
pub mod scene;
mod segment;
mod serve;
mod settings;
mod stepper;
mod stopwatch;
mod storage;
mod system;

pub use axis::{AXES, Axes};
pub use controller::Controller;
pub use error::{Alarm, Error};
pub use hal::{AxisDriver, Hardware, Pins, StepDirection, Wiring};
pub use hpgl::{Encoded, EncodedPiece, HPGL_BYTES};
pub use kinematics::{Hanging, Kinematics};
pub use line::{LINE_CHARS, RX_BYTES};
pub use machine::Machine;
pub use pen::{Pen, PenMotion};
pub use pen_driver::{HeldSolenoid, PenDriver, Servo, ServoPen, Solenoid};
pub use port::{Levels, Port, PortMotors, PortPins};
pub use realtime::{Override, RealTime};
pub use report::TX_BYTES;
pub use runtime::{Cadence, Foreground, Shared};
pub use serve::{pump, serve};
pub use settings::{MAX_STEP_RATE, Settings};
pub use stepper::{Command, Drawn, IDLE_US, SEGMENTS, StepSink, Stepper, Steps};
pub use stopwatch::{Mechanics, Slice, Stopwatch};
pub use storage::{NoStorage, NoStorageError, RECORD_BYTES, slot_bytes};
