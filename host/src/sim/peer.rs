//! What is at the other end of a simulated line.

use std::fmt;

use super::Recording;

/// A simulated plotter: bytes and the time go in, bytes and ink come out.
///
/// Times are in ns since it was switched on. Whoever holds a peer lets time come to no later than its
/// [`next_event`](Self::next_event), calls [`work`](Self::work) until nothing is left, and takes bytes as fast as the line carries them.
pub trait Peer: fmt::Debug + Send {
    /// A byte has arrived, at the time to which the last [`advance`](Self::advance) came.
    fn receive(&mut self, byte: u8);

    /// Takes the next byte to be sent, if there is one.
    fn transmit(&mut self) -> Option<u8>;

    /// Does a piece of the work that takes no time. False when none is left until time goes on or a byte arrives.
    fn work(&mut self) -> bool;

    /// When the next thing happens by itself; [`u64::MAX`] when nothing will.
    fn next_event(&self) -> u64;

    /// Lets time come to `now`, which is not before any earlier one and not after [`next_event`](Self::next_event).
    fn advance(&mut self, now: u64);

    /// The level of its ready line (DTR of a plotter, read as CTS and DSR), true for ready; none when it has no such wire.
    fn ready_line(&self) -> Option<bool> {
        None
    }

    /// What it has drawn up to now.
    fn recording(&self) -> Recording;
}
