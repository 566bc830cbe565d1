//! A plotter that needs nothing installed: a serial port with penvis's own firmware behind it, in virtual time.
//!
//! [`SimPort`] is a [`serialport::SerialPort`], so that nothing above it knows that no plotter is there. Bytes travel at the
//! speed of the line and the motors step at their own, but nobody waits for either: time jumps from event to event. What the *steps* drew, not what was
//! commanded, comes out as a [`Recording`].

mod port;
mod recording;
mod simplify;

pub use port::{SimClock, SimPort};
pub use recording::{PenSense, Recording, Trace};
