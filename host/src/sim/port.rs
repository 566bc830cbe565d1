//! The serial port of the simulated plotter.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use penvis_firmware::Settings;
use serialport::{ClearBuffer, DataBits, Error, ErrorKind, FlowControl, Parity, SerialPort, StopBits};

use super::Recording;
use super::fault::{Broken, Faults, Traffic};
use super::firmware::Firmware;
use super::peer::Peer;
use crate::device::Pen;
use crate::stream::Clock;

/// Start bit, eight data bits, stop bit.
const BITS_PER_BYTE: u64 = 10;
const NS_PER_S: u64 = 1_000_000_000;
const NS_PER_US: u64 = 1000;

/// The time of a simulated plotter, since it was switched on.
#[derive(Clone, Debug, Default)]
pub struct SimClock(Arc<AtomicU64>);

impl SimClock {
    fn set(&self, us: u64) {
        self.0.store(us, Ordering::Relaxed);
    }
}

impl Clock for SimClock {
    fn now(&self) -> Duration {
        Duration::from_micros(self.0.load(Ordering::Relaxed))
    }
}

/// A serial port with a simulated plotter at its other end.
///
/// A write lasts as long as its bytes travel at the baud rate, and the plotter goes on meanwhile; a read with nothing to read lets time pass
/// until a byte arrives or the time-out is over. Both in virtual time, and so at once. The receive buffer is the plotter's
/// own: a sender that does not count loses bytes, and nobody tells it.
#[derive(Debug)]
pub struct SimPort {
    // The trait clears buffers through a shared reference.
    line: RefCell<Line>,
    clock: SimClock,
    timeout: Duration,
    baud: u32,
}

#[derive(Debug)]
struct Line {
    peer: Box<dyn Peer>,
    /// Time in ns: byte times are no whole µs.
    now: u64,
    /// When the plotter's transmitter is free again, ns.
    transmitter_free: u64,
    /// Bytes from the plotter with the time of their arrival in ns.
    inbox: VecDeque<(u64, u8)>,
    faults: Faults,
    flow: FlowControl,
    /// Xoff was received.
    xoff: bool,
}

const XON: u8 = 0x11;
const XOFF: u8 = 0x13;

impl Line {
    /// Lets the plotter do all it can.
    fn settle(&mut self, byte_ns: u64) {
        loop {
            while self.transmitter_free <= self.now {
                let Some(byte) = self.peer.transmit() else { break };
                self.transmitter_free = self.now + byte_ns;
                self.faults.comes_from_plotter(byte, self.transmitter_free, self.peer.as_ref(), &mut self.inbox);
            }
            if !self.peer.work() {
                break;
            }
        }
    }

    /// Lets the next thing happen, if it does by `until` (ns). False when time has come to `until`.
    fn advance(&mut self, until: u64, byte_ns: u64) -> bool {
        self.settle(byte_ns);
        let event = self.peer.next_event();
        let transmitter = if self.transmitter_free > self.now { self.transmitter_free } else { u64::MAX };
        let next = event.min(transmitter).min(self.faults.next_due());
        self.now = self.now.max(next.min(until));
        self.peer.advance(self.now);
        self.faults.strike(self.peer.as_mut(), self.now);
        next <= until
    }

    /// Whether flow control holds up what is written.
    fn is_stopped(&mut self) -> bool {
        match self.flow {
            FlowControl::None => false,
            FlowControl::Hardware => self.peer.ready_line() == Some(false),
            FlowControl::Software => {
                let arrived = self.inbox.iter().take_while(|(at, _)| *at <= self.now);
                if let Some((_, last)) = arrived.filter(|(_, byte)| matches!(*byte, XON | XOFF)).last() {
                    self.xoff = *last == XOFF;
                }
                let now = self.now;
                // The system keeps them to itself.
                self.inbox.retain(|(at, byte)| *at > now || !matches!(*byte, XON | XOFF));
                self.xoff
            }
        }
    }

    /// A byte travels to the plotter.
    fn carry(&mut self, byte: u8, byte_ns: u64) {
        let arrival = self.now + byte_ns;
        while self.advance(arrival, byte_ns) {}
        let (bytes, count) = self.faults.arrives_at_plotter(byte, self.now);
        for byte in bytes.into_iter().take(count) {
            self.peer.receive(byte);
        }
        self.faults.strike(self.peer.as_mut(), self.now);
    }

    /// When the oldest byte from the plotter arrives.
    fn arrival(&self) -> Option<u64> {
        self.inbox.front().map(|(at, _)| *at)
    }
}

impl SimPort {
    /// A plotter with penvis's own firmware that has just been switched on, with its pen up at the origin.
    #[must_use]
    pub fn new(settings: Settings, pen: &Pen, baud: u32) -> Self {
        Self::with(Box::new(Firmware::new(settings, pen)), baud)
    }

    /// A plotter of any kind.
    #[must_use]
    pub fn with(peer: Box<dyn Peer>, baud: u32) -> Self {
        Self {
            line: RefCell::new(Line {
                peer,
                now: 0,
                transmitter_free: 0,
                inbox: VecDeque::new(),
                faults: Faults::default(),
                flow: FlowControl::None,
                xoff: false,
            }),
            clock: SimClock::default(),
            timeout: Duration::ZERO,
            baud: baud.max(1),
        }
    }

    /// Has these faults happen from now on.
    pub fn set_faults(&mut self, faults: Faults) {
        self.line.get_mut().faults = faults;
    }

    /// The faults, with those that have happened.
    #[must_use]
    pub fn faults(&self) -> Faults {
        self.line.borrow().faults.clone()
    }

    /// How much has gone over the line, since the faults were set if they were.
    #[must_use]
    pub fn traffic(&self) -> Traffic {
        self.line.borrow().faults.traffic
    }

    /// The plotter's clock, by which a conversation with it goes.
    #[must_use]
    pub fn clock(&self) -> SimClock {
        self.clock.clone()
    }

    /// What has been drawn up to now.
    #[must_use]
    pub fn recording(&self) -> Recording {
        self.line.borrow().peer.recording()
    }

    fn byte_ns(&self) -> u64 {
        BITS_PER_BYTE * NS_PER_S / u64::from(self.baud)
    }

    fn show_time(&self) {
        self.clock.set(self.line.borrow().now / NS_PER_US);
    }
}

impl Read for SimPort {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if buffer.is_empty() {
            return Ok(0);
        }
        let byte_ns = self.byte_ns();
        let line = self.line.get_mut();
        match line.faults.broken {
            Broken::Pipe => return Err(io::ErrorKind::BrokenPipe.into()),
            Broken::Nothing => return Ok(0),
            Broken::Not | Broken::Mute | Broken::Full => {}
        }
        let wait = u64::try_from(self.timeout.as_nanos()).unwrap_or(u64::MAX);
        let until = line.now.saturating_add(wait);
        // Whatever the plotter does until a byte arrives, it does.
        while line.arrival().is_none_or(|at| at > line.now) {
            let arrival = line.arrival().unwrap_or(u64::MAX);
            if !line.advance(until.min(arrival), byte_ns) && arrival > until {
                break;
            }
        }
        line.is_stopped();
        let mut count = 0;
        for slot in buffer {
            match line.inbox.front() {
                Some((at, byte)) if *at <= line.now => *slot = *byte,
                _ => break,
            }
            line.inbox.pop_front();
            count += 1;
        }
        self.show_time();
        if count == 0 { Err(io::ErrorKind::TimedOut.into()) } else { Ok(count) }
    }
}

impl Write for SimPort {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let byte_ns = self.byte_ns();
        let line = self.line.get_mut();
        let mut taken = 0;
        let until = line.now.saturating_add(u64::try_from(self.timeout.as_nanos()).unwrap_or(u64::MAX));
        for &byte in bytes {
            while line.is_stopped() && line.now < until && line.faults.broken == Broken::Not {
                line.advance(until, byte_ns);
            }
            if line.is_stopped() {
                break;
            }
            if line.faults.broken != Broken::Not && line.faults.broken != Broken::Mute {
                break;
            }
            line.carry(byte, byte_ns);
            taken += 1;
        }
        let broken = line.faults.broken;
        if taken == 0 && broken == Broken::Full {
            while line.advance(until, byte_ns) {}
        }
        line.settle(byte_ns);
        self.show_time();
        match broken {
            Broken::Pipe => Err(io::ErrorKind::BrokenPipe.into()),
            Broken::Not | Broken::Mute | Broken::Full if taken == 0 && !bytes.is_empty() => {
                Err(io::ErrorKind::TimedOut.into())
            }
            _ => Ok(taken),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// What a simulated port cannot do.
fn unsupported<T>(what: &str) -> serialport::Result<T> {
    Err(Error::new(ErrorKind::Io(io::ErrorKind::Unsupported), format!("the simulated port has no {what}")))
}

/// Accepts the one setting that the simulated line has.
fn only<T: PartialEq>(asked: T, have: T, what: &str) -> serialport::Result<()> {
    if asked == have { Ok(()) } else { unsupported(what) }
}

impl SerialPort for SimPort {
    fn name(&self) -> Option<String> {
        Some("sim".to_owned())
    }

    fn baud_rate(&self) -> serialport::Result<u32> {
        Ok(self.baud)
    }

    fn data_bits(&self) -> serialport::Result<DataBits> {
        Ok(DataBits::Eight)
    }

    fn flow_control(&self) -> serialport::Result<FlowControl> {
        Ok(self.line.borrow().flow)
    }

    fn parity(&self) -> serialport::Result<Parity> {
        Ok(Parity::None)
    }

    fn stop_bits(&self) -> serialport::Result<StopBits> {
        Ok(StopBits::One)
    }

    fn timeout(&self) -> Duration {
        self.timeout
    }

    fn set_baud_rate(&mut self, baud: u32) -> serialport::Result<()> {
        if baud == 0 {
            return Err(Error::new(ErrorKind::InvalidInput, "a baud rate of 0"));
        }
        self.baud = baud;
        Ok(())
    }

    fn set_data_bits(&mut self, bits: DataBits) -> serialport::Result<()> {
        only(bits, DataBits::Eight, "other data bits than 8")
    }

    fn set_flow_control(&mut self, flow: FlowControl) -> serialport::Result<()> {
        if flow == FlowControl::Hardware && self.line.borrow().peer.ready_line().is_none() {
            return unsupported("hardware flow control");
        }
        self.line.get_mut().flow = flow;
        Ok(())
    }

    fn set_parity(&mut self, parity: Parity) -> serialport::Result<()> {
        only(parity, Parity::None, "parity")
    }

    fn set_stop_bits(&mut self, bits: StopBits) -> serialport::Result<()> {
        only(bits, StopBits::One, "other stop bits than 1")
    }

    fn set_timeout(&mut self, timeout: Duration) -> serialport::Result<()> {
        self.timeout = timeout;
        Ok(())
    }

    fn write_request_to_send(&mut self, _level: bool) -> serialport::Result<()> {
        unsupported("RTS line")
    }

    fn write_data_terminal_ready(&mut self, _level: bool) -> serialport::Result<()> {
        unsupported("DTR line")
    }

    fn read_clear_to_send(&mut self) -> serialport::Result<bool> {
        self.line.borrow().peer.ready_line().map_or_else(|| unsupported("CTS line"), Ok)
    }

    fn read_data_set_ready(&mut self) -> serialport::Result<bool> {
        self.line.borrow().peer.ready_line().map_or_else(|| unsupported("DSR line"), Ok)
    }

    fn read_ring_indicator(&mut self) -> serialport::Result<bool> {
        unsupported("RI line")
    }

    fn read_carrier_detect(&mut self) -> serialport::Result<bool> {
        unsupported("CD line")
    }

    fn bytes_to_read(&self) -> serialport::Result<u32> {
        let line = self.line.borrow();
        let ready = line.inbox.iter().take_while(|(at, _)| *at <= line.now).count();
        Ok(u32::try_from(ready).unwrap_or(u32::MAX))
    }

    fn bytes_to_write(&self) -> serialport::Result<u32> {
        // A write is over when its bytes have arrived.
        Ok(0)
    }

    fn clear(&self, buffer: ClearBuffer) -> serialport::Result<()> {
        if buffer != ClearBuffer::Output {
            let mut line = self.line.borrow_mut();
            let now = line.now;
            line.inbox.retain(|(at, _)| *at > now);
        }
        Ok(())
    }

    fn try_clone(&self) -> serialport::Result<Box<dyn SerialPort>> {
        unsupported("second handle")
    }

    fn set_break(&self) -> serialport::Result<()> {
        unsupported("break")
    }

    fn clear_break(&self) -> serialport::Result<()> {
        unsupported("break")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{Language, find};
    use crate::sim::tests::hear_all;

    fn sim() -> SimPort {
        let Language::Grbl(gcode) = find("penvis").unwrap().language else { panic!("not grbl") };
        let mut port = SimPort::new(Settings::default(), &gcode.pen, 115_200);
        port.set_timeout(Duration::from_secs(1)).unwrap();
        port
    }

    #[test]
    fn it_greets_and_answers() {
        let mut port = sim();
        assert!(hear_all(&mut port).contains("Grbl 1.1"));
        port.write_all(b"$I\n").unwrap();
        let answer = hear_all(&mut port);
        assert!(answer.contains("[OPT:VH,896,128]") && answer.ends_with("ok\r\n"), "{answer}");
        port.write_all(b"$$\n").unwrap();
        let answer = hear_all(&mut port);
        assert!(answer.contains("$32=0\r\n") && answer.ends_with("ok\r\n"), "{answer}");
    }

    #[test]
    fn time_is_virtual_and_goes_by_the_motion_and_the_baud_rate() {
        let mut port = sim();
        hear_all(&mut port);
        let start = port.clock().now();
        port.write_all(b"G1X100F60\nG4P0.01\n").unwrap();
        // 18 bytes of 10 bits.
        let sent = port.clock().now() - start;
        assert!((sent.as_secs_f64() - 180.0 / 115_200.0).abs() < 1e-5, "{sent:?}");
        port.set_timeout(Duration::from_secs(200)).unwrap();
        let mut answers = String::new();
        while answers.matches("ok").count() < 2 {
            let mut buffer = [0; 64];
            let count = port.read(&mut buffer).unwrap();
            answers.push_str(std::str::from_utf8(&buffer[..count]).unwrap());
        }
        let took = (port.clock().now() - start).as_secs_f64();
        assert!((100.0..100.5).contains(&took), "{took} s");
        assert_eq!(port.recording().position, [8000, 0, 0]);
    }

    #[test]
    fn a_read_with_nothing_to_read_times_out_at_its_time() {
        let mut port = sim();
        hear_all(&mut port);
        let start = port.clock().now();
        port.set_timeout(Duration::from_millis(20)).unwrap();
        assert_eq!(port.read(&mut [0; 8]).unwrap_err().kind(), io::ErrorKind::TimedOut);
        assert_eq!(port.clock().now() - start, Duration::from_millis(20));
    }

    #[test]
    fn a_sender_that_does_not_count_loses_bytes_and_is_not_told() {
        let mut port = sim();
        hear_all(&mut port);
        for i in 0..200 {
            port.write_all(format!("G1X{}Y{}F600\n", i % 10, i % 7).as_bytes()).unwrap();
        }
        assert!(port.recording().lost_bytes > 100);
    }

    #[test]
    fn what_it_cannot_do_is_an_error() {
        let mut port = sim();
        assert!(port.try_clone().is_err() && port.set_break().is_err() && port.clear_break().is_err());
        assert!(port.write_data_terminal_ready(true).is_err() && port.read_clear_to_send().is_err());
        assert!(port.set_parity(Parity::Even).is_err() && port.set_parity(Parity::None).is_ok());
        assert!(port.set_baud_rate(0).is_err() && port.set_baud_rate(9600).is_ok());
        assert_eq!(port.read(&mut []).unwrap(), 0);
    }

    #[test]
    fn clearing_forgets_what_has_arrived() {
        let mut port = sim();
        port.write_all(b"\n\n\n").unwrap();
        while port.bytes_to_read().unwrap() == 0 {
            port.write_all(b"?").unwrap();
        }
        port.clear(ClearBuffer::All).unwrap();
        assert_eq!(port.bytes_to_read().unwrap(), 0);
    }
}
