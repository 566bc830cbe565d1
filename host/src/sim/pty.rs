//! A simulated plotter at a pseudo terminal, for programs that open a path.

use std::collections::VecDeque;
use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::io::{FdFlags, fcntl_getfd, fcntl_setfd};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use serialport::SerialPort;

use super::SimPort;
use crate::stream::Clock;

/// How far the plotter's time may be ahead of the wall's: a real line takes no byte earlier.
const AHEAD: Duration = Duration::from_millis(20);
/// Time between two looks at a line on which nothing happens.
const PATIENCE: Duration = Duration::from_millis(1);
/// So much of its own time passes for a plotter in a hurry while nothing comes.
const HURRY: Duration = Duration::from_millis(20);
/// A byte that comes no later than this after another one is of the same answer.
const GAP: Duration = Duration::from_millis(2);
/// Bytes that are kept for a client that has not come yet; the oldest are dropped.
const WAITING_MAX: usize = 1 << 16;

/// By whose time a simulated plotter works.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// That of the wall.
    Wall,
    /// Its own, which passes as fast as bytes come and go.
    Hurry,
}

/// What has come over a pseudo terminal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Visit {
    /// Bytes from clients.
    pub received: usize,
    /// Whether a client has it open.
    pub connected: bool,
    /// Clients that have come.
    pub clients: usize,
}

/// A pseudo terminal without a name of its own choice. It is gone when this is dropped.
#[derive(Debug)]
pub struct Pty {
    master: File,
    path: PathBuf,
}

impl Pty {
    /// Opens one.
    ///
    /// # Errors
    /// What the system says.
    pub fn open() -> io::Result<Self> {
        let fd = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
        // A program that is started meanwhile must not hold the line.
        fcntl_setfd(&fd, fcntl_getfd(&fd)? | FdFlags::CLOEXEC)?;
        grantpt(&fd)?;
        unlockpt(&fd)?;
        let name = ptsname(&fd, Vec::new())?.into_string().map_err(|e| io::Error::new(ErrorKind::InvalidData, e))?;
        let path = PathBuf::from(name);
        let slave = OpenOptions::new().read(true).write(true).open(&path)?;
        // Bytes go through as they are. The setting outlives the handle.
        let mut termios = tcgetattr(&slave)?;
        termios.make_raw();
        tcsetattr(&slave, OptionalActions::Now, &termios)?;
        fcntl_setfl(&fd, fcntl_getfl(&fd)? | OFlags::NONBLOCK)?;
        Ok(Self { master: File::from(fd), path })
    }

    /// The path that clients open.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Connects clients with a simulated plotter until `over` says so, which is asked again and again. Returns false when the plotter was
    /// unplugged before that.
    ///
    /// # Errors
    /// What the system says of the terminal.
    pub fn serve(&mut self, port: &mut SimPort, pace: Pace, over: &mut dyn FnMut(Visit) -> bool) -> io::Result<bool> {
        let clock = port.clock();
        let (start, begun) = (Instant::now(), clock.now());
        let mut visit = Visit::default();
        let (mut inward, mut outward) = (VecDeque::new(), VecDeque::new());
        let mut buffer = [0; 512];
        while !over(visit) {
            let elapsed = start.elapsed();
            let ahead = |clock: &dyn Clock| (clock.now() - begun).saturating_sub(elapsed);
            let mut quiet = true;
            if inward.is_empty() && (pace == Pace::Hurry || ahead(&clock) < AHEAD) {
                let count = self.receive(&mut buffer, &mut visit)?;
                inward.extend(buffer.iter().take(count));
                quiet &= count == 0;
            }
            if !inward.is_empty() {
                match port.write(inward.make_contiguous()) {
                    Ok(0) => return Ok(false),
                    Ok(count) => drop(inward.drain(..count)),
                    Err(e) if e.kind() == ErrorKind::TimedOut => {}
                    Err(_) => return Ok(false),
                }
            }
            let wait = match pace {
                Pace::Hurry => HURRY,
                Pace::Wall => elapsed.saturating_sub(clock.now() - begun),
            };
            port.set_timeout(wait)?;
            match port.read(&mut buffer) {
                Ok(0) => return Ok(false),
                Ok(count) => {
                    outward.extend(buffer.iter().take(count));
                    quiet = false;
                    // What follows without a gap goes with it.
                    port.set_timeout(GAP)?;
                    while outward.len() < WAITING_MAX
                        && let Ok(count @ 1..) = port.read(&mut buffer)
                    {
                        outward.extend(buffer.iter().take(count));
                    }
                }
                Err(e) if e.kind() == ErrorKind::TimedOut => {}
                Err(_) => return Ok(false),
            }
            self.send(&mut outward, &mut visit)?;
            if quiet {
                thread::sleep(PATIENCE);
            }
        }
        Ok(true)
    }

    /// Reads what a client has written.
    fn receive(&mut self, buffer: &mut [u8], visit: &mut Visit) -> io::Result<usize> {
        let connected = match self.master.read(buffer) {
            Ok(count) if count > 0 => {
                visit.received += count;
                visit.clients += usize::from(!visit.connected);
                visit.connected = true;
                return Ok(count);
            }
            Ok(_) => false,
            Err(e) if e.kind() == ErrorKind::WouldBlock => true,
            Err(e) if e.kind() == ErrorKind::Interrupted => visit.connected,
            // Nobody has it open.
            Err(e) if is_gone(&e) => false,
            Err(e) => return Err(e),
        };
        visit.clients += usize::from(connected && !visit.connected);
        visit.connected = connected;
        Ok(0)
    }

    /// Writes what a client takes.
    fn send(&mut self, outward: &mut VecDeque<u8>, visit: &mut Visit) -> io::Result<()> {
        while visit.connected && !outward.is_empty() {
            match self.master.write(outward.make_contiguous()) {
                Ok(count) => drop(outward.drain(..count)),
                Err(e) if e.kind() == ErrorKind::WouldBlock => break,
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) if is_gone(&e) => visit.connected = false,
                Err(e) => return Err(e),
            }
        }
        outward.drain(..outward.len().saturating_sub(WAITING_MAX));
        Ok(())
    }
}

/// `EIO`: no client has the terminal open.
fn is_gone(error: &io::Error) -> bool {
    error.raw_os_error() == Some(rustix::io::Errno::IO.raw_os_error())
}
