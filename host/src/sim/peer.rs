//! What is at the other end of a simulated line.

use std::fmt;

use thiserror::Error;

use super::Recording;

/// What can go wrong with a plotter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Trouble {
    /// It refuses the next line or instruction, though nothing is wrong with that.
    Error,
    /// A limit switch is hit: it stops and locks itself.
    Alarm,
    /// Its power drops for a moment: it starts anew and has forgotten all that it was told.
    Reset,
    /// It stops for good, in motion too, and neither listens nor answers.
    Hang,
    /// Somebody holds it to change the pen, and lets it go on after so many ns.
    PenChange {
        /// For how long, in ns.
        ns: u64,
    },
}

/// A simulated plotter that there is not.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum PeerError {
    /// No such plotter.
    #[error("there is no simulated plotter `{name}`; it is one of {}", super::name::names().join(", "))]
    Unknown {
        /// The name asked for.
        name: String,
    },
    /// It has no such option.
    #[error("--port sim:{name}: `{option}` is no option of it, or has no value that makes sense")]
    Option {
        /// The plotter.
        name: &'static str,
        /// The option asked for.
        option: String,
    },
    /// It speaks another language than the device.
    #[error(
        "--port sim:{name} does not speak the language of `{device}`; `{device}` speaks {speaks}: plot with --device {fitting}"
    )]
    Language {
        /// The plotter.
        name: &'static str,
        /// The device asked for.
        device: String,
        /// What that speaks.
        speaks: &'static str,
        /// A device for the plotter.
        fitting: &'static str,
    },
}

impl PeerError {
    /// An option that a plotter has not.
    pub(super) fn option(name: &'static str, key: &str, value: &str) -> Self {
        let option = if value.is_empty() { key.to_owned() } else { format!("{key}={value}") };
        Self::Option { name, option }
    }
}

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

    /// Whether these bytes from it are all of an answer.
    fn is_whole_answer(&self, bytes: &[u8]) -> bool {
        bytes.ends_with(b"\n")
    }

    /// Whether an answer that begins with these bytes may acknowledge something.
    fn begins_acknowledgement(&self, bytes: &[u8]) -> bool {
        bytes.iter().zip(b"ok").all(|(byte, expected)| byte == expected)
    }

    /// Something goes wrong with it.
    fn suffer(&mut self, trouble: Trouble);

    /// Whether its pen moves along the paper at this moment.
    fn is_moving(&self) -> bool;

    /// What it has drawn up to now.
    fn recording(&self) -> Recording;
}
