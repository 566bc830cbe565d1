//! Pen plotter firmware: the GRBL 1.1 dialect in, step pulses and pen moves out, without std and without an allocator.
//!
//! Start with [`Machine`]; [`Hardware`] is what a board (or a recorder) has to provide.
#![no_std]

#[cfg(test)]
extern crate std;

mod axis;
mod controller;
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
pub use serve::{pump, serve};
pub use settings::{MAX_STEP_RATE, Settings};
pub use stepper::{Command, IDLE_TICKS, SEGMENTS, StepSink, Stepper, Steps, TIMER_HZ};
