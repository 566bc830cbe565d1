//! Sends a job: connects a [`Protocol`] with a port, whichever port it is.
//!
//! A real port, a pseudo terminal and the simulated plotter are all a [`SerialPort`]. Every wait is bounded by the protocol,
//! which is told the time by a [`Clock`]: that of the wall, or the simulated plotter's own.

mod clock;
mod course;
mod interface;
mod json;
mod keys;
mod terminal;

use std::io::{self, ErrorKind};
use std::time::Duration;

use serialport::SerialPort;
use thiserror::Error;

pub use clock::{Clock, WallClock};
pub use course::{Course, Estimate, Standing};
pub use interface::Interface;
pub use json::{Happening, Json};
pub use terminal::{Terminal, User};

use crate::protocol::{Control, Event, Fault, Lines, Place, Progress, Protocol};

/// How long one read waits; between two reads the protocol sends and polls.
const READ_WAIT: Duration = Duration::from_millis(20);
/// A port that takes no byte for this long will take no more.
const WRITE_MAX: Duration = Duration::from_secs(30);

/// What wants to know how a job goes, and answers for its user.
pub trait Observer {
    /// The job is this far.
    fn progress(&mut self, progress: Progress);

    /// The plotter says something.
    fn message(&mut self, text: &str);

    /// What the user asked for is done, or is not.
    fn note(&mut self, text: &str) {
        self.message(text);
    }

    /// Something is not as it should be, as this side of the line sees it; the job goes on.
    fn warn(&mut self, text: &str) {
        self.message(text);
    }

    /// What the user wants now. Asked many times a second.
    fn control(&mut self) -> Option<Control>;

    /// The job waits for its user, who is shown this comment of the job. True to go on, false to stop.
    fn prompt(&mut self, comment: &str) -> bool;

    /// The plotter rests after a hold, or (false) goes on.
    fn paused(&mut self, rests: bool);
}

/// Why a job did not get to its end.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StreamError {
    /// The conversation failed.
    #[error(transparent)]
    Fault(#[from] Fault),
    /// The port is gone.
    #[error("the plotter was unplugged {at}")]
    Unplugged {
        /// The first piece that it had not acknowledged.
        at: Place,
    },
    /// The port does not take what is written.
    #[error("the port takes no more bytes {at}: is the plotter halted, or the flow control wrong?")]
    Stalled {
        /// The first piece that it had not acknowledged.
        at: Place,
    },
    /// The system reports a fault of the port.
    #[error("the port failed {at}: {source}")]
    Io {
        /// The first piece that it had not acknowledged.
        at: Place,
        /// What the system said.
        source: io::Error,
    },
}

/// Sends the protocol's job through the port, to its end: all of it acknowledged, and the plotter at rest.
///
/// # Errors
/// [`StreamError`]. Nothing more is sent then.
pub fn run(
    port: &mut dyn SerialPort,
    protocol: &mut dyn Protocol,
    clock: &dyn Clock,
    observer: &mut dyn Observer,
) -> Result<(), StreamError> {
    let failed = |protocol: &dyn Protocol, source: io::Error| {
        let at = protocol.place();
        if is_gone(&source) { StreamError::Unplugged { at } } else { StreamError::Io { at, source } }
    };
    port.set_timeout(READ_WAIT).map_err(|e| failed(protocol, e.into()))?;
    let mut output: Vec<u8> = Vec::new();
    let mut written = clock.now();
    let mut shown = Progress::default();
    let mut input = [0; 512];
    loop {
        if let Some(control) = observer.control() {
            protocol.control(control, clock.now());
        }
        if protocol.watches_lines() {
            // A port without such lines, as a pseudo terminal is, has none that is up.
            let lines = Lines {
                clear_to_send: port.read_clear_to_send().unwrap_or(false),
                data_set_ready: port.read_data_set_ready().unwrap_or(false),
            };
            protocol.lines(lines, clock.now());
        }
        protocol.tick(clock.now());
        output.append(&mut protocol.take_output());
        // The last bytes (a reset, or pen up) go out even when the event is the end.
        if output.is_empty() {
            written = clock.now();
        } else {
            match port.write(&output) {
                Ok(0) => return Err(StreamError::Unplugged { at: protocol.place() }),
                Ok(count) => {
                    output.drain(..count);
                    written = clock.now();
                }
                Err(e) if is_wait(&e) && clock.now().saturating_sub(written) > WRITE_MAX => {
                    return Err(StreamError::Stalled { at: protocol.place() });
                }
                Err(e) if is_wait(&e) => {}
                Err(e) => return Err(failed(protocol, e)),
            }
        }
        let progress = protocol.progress();
        if progress != shown {
            observer.progress(progress);
            shown = progress;
        }
        while output.is_empty()
            && let Some(event) = protocol.take_event()
        {
            match event {
                Event::Done => return Ok(()),
                Event::Failed(fault) => return Err(fault.into()),
                Event::Message(text) => observer.message(&text),
                Event::Note(text) => observer.note(&text),
                Event::Warning(text) => observer.warn(&text),
                Event::Paused => observer.paused(true),
                Event::Resumed => observer.paused(false),
                Event::Prompt(comment) => {
                    let goes_on = observer.prompt(&comment);
                    protocol.control(if goes_on { Control::Resume } else { Control::Stop }, clock.now());
                    output = protocol.take_output();
                }
            }
        }
        match port.read(&mut input) {
            Ok(0) => return Err(StreamError::Unplugged { at: protocol.place() }),
            Ok(count) => protocol.receive(&input[..count], clock.now()),
            Err(e) if is_wait(&e) => {}
            Err(e) => return Err(failed(protocol, e)),
        }
    }
}

/// Nothing to read or no room to write now; that is no fault.
fn is_wait(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted)
}

/// The other end is gone.
fn is_gone(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::BrokenPipe
            | ErrorKind::NotConnected
            | ErrorKind::ConnectionReset
            | ErrorKind::UnexpectedEof
            | ErrorKind::NotFound
    ) || error.raw_os_error().is_some_and(is_gone_code)
}

/// `EIO`, `ENXIO` and `ENODEV`: what Unix says of a device that was pulled out.
#[cfg(unix)]
fn is_gone_code(code: i32) -> bool {
    matches!(code, 5 | 6 | 19)
}

/// `ERROR_GEN_FAILURE`, `ERROR_BAD_COMMAND`, `ERROR_OPERATION_ABORTED`: what Windows says of a device that was pulled out.
#[cfg(not(unix))]
fn is_gone_code(code: i32) -> bool {
    matches!(code, 31 | 22 | 995)
}

#[cfg(test)]
mod tests;
