//! Plotters that need nothing installed: a serial port with a simulated one behind it, in virtual time.
//!
//! [`SimPort`] is a [`serialport::SerialPort`], so that nothing above it knows that no plotter is there. Bytes travel at the
//! speed of the line and the motors move at their own, but nobody waits for either: time jumps from event to event. Behind the port is a
//! [`Peer`]: penvis's own firmware, or a controller that shares no code with it. What the *pen* did, not what was
//! commanded, comes out as a [`Recording`].

mod fault;
mod firmware;
mod grbl;
mod hpgl;
mod marlin;
mod motion;
mod name;
mod peer;
mod port;
#[cfg(unix)]
mod pty;
mod recorder;
mod recording;
mod simplify;

pub use fault::{Fault, FaultError, FaultKind, Faults, Struck, Traffic};
pub use name::SimName;
pub use peer::{Peer, PeerError, Trouble};
pub use port::{SimClock, SimPort};
#[cfg(unix)]
pub use pty::{Pace, Pty, Visit};
pub use recording::{Recording, Trace};

#[cfg(test)]
mod tests;
