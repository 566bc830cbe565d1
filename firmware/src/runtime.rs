//! Running a machine with interrupts: what the handlers of a board share, and what each of them calls.
//!
//! ```text
//!  priority   interrupt                 does
//!  highest    step timer                Shared::tick, and sets the timer to the time that it returns
//!  middle     serial port received      Shared::receive, then pends the lowest
//!  lowest     PendSV, and each ms       Foreground::turn: bytes in, a line at most, answers out, steps supplied
//!  none       thread mode               free: computes drawings, or sleeps
//! ```
//!
//! The step timer is held off only by the critical sections of [`Shared`], each the copy of a command or of a byte. What thread mode does holds off nothing, so it may take
//! minutes over a drawing, and may be abandoned in the middle of it.

use core::cell::RefCell;

use critical_section::Mutex;
use embedded_io::{Write, WriteReady};
use embedded_storage::nor_flash::NorFlash;
use heapless::Deque;

use crate::axis::{AXES, Axes};
use crate::controller::Controller;
use crate::hal::{Hardware, Wiring};
use crate::line::RX_BYTES;
#[cfg(feature = "scene")]
use crate::scene::{Answer, Line, Offer, Order};
use crate::settings::Settings;
use crate::stepper::{Command, Drawn, StepSink, Stepper};
use crate::storage::NoStorage;

/// What the interrupts share, for a `static` of the board. Until [`Shared::start`] it does nothing.
#[derive(Debug)]
pub struct Shared<H> {
    motion: Mutex<RefCell<Option<Motion<H>>>>,
    received: Mutex<RefCell<Received>>,
    #[cfg(feature = "scene")]
    mail: Mutex<RefCell<Mail>>,
}

/// Between the controller's [`Desk`](crate::scene::Desk) and the studio in thread mode.
#[cfg(feature = "scene")]
#[derive(Debug)]
struct Mail {
    order: Option<Order>,
    line: Option<Line>,
    answer: Option<Answer>,
    abandoned: bool,
}

/// The step interrupt's own.
#[derive(Debug)]
struct Motion<H> {
    stepper: Stepper<H>,
    cadence: Cadence,
}

/// Bytes between two turns of the foreground.
#[derive(Debug)]
struct Received {
    bytes: Deque<u8, RX_BYTES>,
    lost: u32,
}

impl<H: Hardware> Shared<H> {
    /// Without hardware as yet.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            motion: Mutex::new(RefCell::new(None)),
            received: Mutex::new(RefCell::new(Received { bytes: Deque::new(), lost: 0 })),
            #[cfg(feature = "scene")]
            mail: Mutex::new(RefCell::new(Mail { order: None, line: None, answer: None, abandoned: false })),
        }
    }

    /// Gives it the hardware: at rest at the origin, pen off, motors off. The first step interrupt is due now, when the timer's counter shows `counter`.
    pub fn start(&self, hardware: H, counter: u32) {
        let motion = Motion { stepper: Stepper::new(hardware), cadence: Cadence::new(counter) };
        critical_section::with(|cs| self.motion.replace(cs, Some(motion)));
    }

    /// The step interrupt, when the timer's counter shows `counter`: see [`Stepper::tick`]. The counter runs for ever at the stepper's ticks, and wraps at 2³².
    /// Returns its value at which to interrupt again, at most [`Cadence::LONGEST`] away; it may have passed already.
    #[inline]
    pub fn tick(&self, counter: u32) -> u32 {
        critical_section::with(|cs| match self.motion.borrow_ref_mut(cs).as_mut() {
            Some(Motion { stepper, cadence }) => cadence.next(counter, || stepper.tick()),
            None => counter.wrapping_add(Cadence::LONGEST),
        })
    }

    /// The serial port's interrupt: keeps `byte` for the foreground. Counts it as lost when [`RX_BYTES`] wait already.
    pub fn receive(&self, byte: u8) {
        critical_section::with(|cs| {
            let mut received = self.received.borrow_ref_mut(cs);
            if received.bytes.push_back(byte).is_err() {
                received.lost = received.lost.saturating_add(1);
            }
        });
    }

    /// Bytes that [`Shared::receive`] had no room for since the start.
    pub fn lost_bytes(&self) -> u32 {
        critical_section::with(|cs| self.received.borrow_ref(cs).lost)
    }

    /// For thread mode: what is to be drawn.
    #[cfg(feature = "scene")]
    pub fn take_order(&self) -> Option<Order> {
        critical_section::with(|cs| self.mail.borrow_ref_mut(cs).order.take())
    }

    /// For thread mode: the next line of the drawing. The foreground takes it at its next turn, for which there is reason then.
    #[cfg(feature = "scene")]
    pub fn offer_line(&self, line: &Line) -> Offer {
        critical_section::with(|cs| {
            let mut mail = self.mail.borrow_ref_mut(cs);
            match mail.line {
                _ if mail.abandoned => Offer::Abandoned,
                Some(_) => Offer::Full,
                None => {
                    mail.line = Some(line.clone());
                    Offer::Taken
                }
            }
        })
    }

    /// For thread mode: whether what is being drawn is not wanted any more.
    #[cfg(feature = "scene")]
    pub fn is_abandoned(&self) -> bool {
        critical_section::with(|cs| self.mail.borrow_ref(cs).abandoned)
    }

    /// For thread mode: the order is done.
    #[cfg(feature = "scene")]
    pub fn finish(&self, answer: Answer) {
        critical_section::with(|cs| self.mail.borrow_ref_mut(cs).answer = Some(answer));
    }

    /// Uses the hardware with interrupts held off; `None` before the start.
    pub fn with_hardware<R>(&self, using: impl FnOnce(&mut H) -> R) -> Option<R> {
        self.with(|stepper| using(stepper.hardware_mut()))
    }

    fn with<R>(&self, using: impl FnOnce(&mut Stepper<H>) -> R) -> Option<R> {
        critical_section::with(|cs| self.motion.borrow_ref_mut(cs).as_mut().map(|motion| using(&mut motion.stepper)))
    }

    fn take_received(&self) -> Option<u8> {
        critical_section::with(|cs| self.received.borrow_ref_mut(cs).bytes.pop_front())
    }
}

impl<H: Hardware> Default for Shared<H> {
    fn default() -> Self {
        Self::new()
    }
}

/// Locks the stepper for each call. Before the start there is no room, and nothing moves.
impl<H: Hardware> StepSink for &Shared<H> {
    fn room(&self) -> usize {
        self.with(|stepper| stepper.room()).unwrap_or(0)
    }

    fn push(&mut self, command: Command) -> bool {
        self.with(|stepper| stepper.push(command)).unwrap_or(false)
    }

    fn is_idle(&self) -> bool {
        self.with(|stepper| stepper.is_idle()).unwrap_or(true)
    }

    fn is_moving(&self) -> bool {
        self.with(|stepper| stepper.is_moving()).unwrap_or(false)
    }

    fn position(&self) -> [i32; AXES] {
        self.with(|stepper| stepper.position()).unwrap_or([0; AXES])
    }

    fn drawn(&self) -> Drawn {
        self.with(|stepper| stepper.drawn()).unwrap_or_default()
    }

    fn abort(&mut self) {
        self.with(Stepper::abort);
    }

    fn set_position(&mut self, steps: [i32; AXES]) {
        self.with(|stepper| stepper.set_position(steps));
    }

    fn limits(&mut self) -> Axes {
        self.with(|stepper| stepper.limits()).unwrap_or(Axes::NONE)
    }

    fn configure(&mut self, wiring: Wiring) {
        self.with(|stepper| stepper.configure(wiring));
    }
}

/// The lowest interrupt's own: everything between the bytes and the step commands.
#[derive(Debug)]
pub struct Foreground<H: 'static, const BLOCKS: usize, F = NoStorage> {
    shared: &'static Shared<H>,
    controller: Controller<BLOCKS, F>,
}

impl<H: Hardware, const BLOCKS: usize> Foreground<H, BLOCKS> {
    /// For the machine whose hardware `shared` was started with. It forgets everything when it is switched off.
    #[must_use]
    pub fn new(shared: &'static Shared<H>, settings: Settings) -> Self {
        Self::with_storage(shared, settings, NoStorage)
    }
}

impl<H: Hardware, const BLOCKS: usize, F: NorFlash> Foreground<H, BLOCKS, F> {
    /// With what `flash` holds: see [`Controller::with_storage`].
    #[must_use]
    pub fn with_storage(shared: &'static Shared<H>, defaults: Settings, flash: F) -> Self {
        Self { shared, controller: Controller::with_storage(defaults, flash) }
    }

    /// The level of the port's ready line (DTR): see [`Controller::is_ready`].
    #[must_use]
    pub fn is_ready(&self) -> bool {
        self.controller.is_ready()
    }

    /// One turn: takes what has arrived, polls, and sends what the port takes at once, without waiting for it. Returns true when another turn would do more at once; else
    /// one is due when a byte arrives, when the port can take another, and after a millisecond at most, for the steps' sake.
    ///
    /// # Errors
    /// The port's, at the first operation that fails; at most one byte to send is lost.
    pub fn turn<S: Write + WriteReady>(&mut self, port: &mut S) -> Result<bool, S::Error> {
        for _ in 0..RX_BYTES {
            let Some(byte) = self.shared.take_received() else { break };
            self.controller.receive(byte);
        }
        let mut stepper = self.shared;
        let more = self.controller.poll(&mut stepper);
        #[cfg(feature = "scene")]
        let more = self.exchange() || more;
        while port.write_ready()? {
            let Some(byte) = self.controller.transmit() else { break };
            port.write(&[byte])?;
        }
        Ok(more)
    }
}

#[cfg(feature = "scene")]
impl<H: Hardware, const BLOCKS: usize, F: NorFlash> Foreground<H, BLOCKS, F> {
    /// Carries orders from the desk to thread mode, and lines and answers back. True when the controller has something to do by it.
    fn exchange(&mut self) -> bool {
        let desk = self.controller.desk_mut();
        critical_section::with(|cs| {
            let mut mail = self.shared.mail.borrow_ref_mut(cs);
            let mut came = false;
            if let Some(order) = desk.take_order() {
                *mail = Mail { order: Some(order), line: None, answer: None, abandoned: false };
            }
            if let Some(line) = mail.line.take() {
                match desk.offer_line(&line) {
                    Offer::Full => mail.line = Some(line),
                    Offer::Taken => came = true,
                    Offer::Abandoned => (),
                }
            }
            if mail.line.is_none()
                && let Some(answer) = mail.answer.take()
            {
                desk.finish(answer);
                came = true;
            }
            mail.abandoned = desk.is_abandoned();
            came
        })
    }
}

/// When the step interrupt is due, on a counter that runs for ever and wraps at 2³².
///
/// Times follow from one another, not from when the interrupt came, so that latency does not add up. An interrupt that is late by more than a whole period delays
/// those after it instead of having them made up for: the rate of the motors is never exceeded.
#[derive(Clone, Copy, Debug)]
pub struct Cadence {
    due: u32,
    /// Counts of the present wait that still have to pass after `due`.
    rest: u32,
}

impl Cadence {
    /// Longest wait between two interrupts, counts; a longer one is made of several. Less than half the counter's range, so that early and late can be told apart.
    pub const LONGEST: u32 = 1 << 30;

    /// First due when the counter shows `now`.
    #[must_use]
    pub const fn new(now: u32) -> Self {
        Self { due: now, rest: 0 }
    }

    /// In the interrupt, at counter `now`: calls `tick` if it is due, for the counts (≥ 1) until the next, and returns the counter's value at which to interrupt again. It may
    /// have passed already. An interrupt before its time changes nothing.
    #[inline]
    pub fn next(&mut self, now: u32, tick: impl FnOnce() -> u32) -> u32 {
        let late = now.wrapping_sub(self.due);
        if late > u32::MAX / 2 {
            return self.due;
        }
        let wait = match core::mem::take(&mut self.rest) {
            0 => tick(),
            rest => rest,
        };
        let part = wait.min(Self::LONGEST);
        self.rest = wait - part;
        let from = if late > part { now } else { self.due };
        self.due = from.wrapping_add(part);
        self.due
    }
}

#[cfg(test)]
mod tests {
    use std::string::String;
    use std::vec::Vec;

    use embedded_io::{ErrorKind, ErrorType};

    use super::*;
    use crate::Pen;

    #[derive(Default)]
    struct Counter(u32);

    impl Hardware for Counter {
        fn set_directions(&mut self, _: Axes) {}
        fn step(&mut self, axes: Axes) {
            self.0 += u32::from(axes.contains(0));
        }
        fn set_pen(&mut self, _: Pen) {}
    }

    /// Takes every third byte at once.
    #[derive(Default)]
    struct Port(Vec<u8>, u32);

    impl ErrorType for Port {
        type Error = ErrorKind;
    }

    impl WriteReady for Port {
        fn write_ready(&mut self) -> Result<bool, ErrorKind> {
            self.1 += 1;
            Ok(self.1.is_multiple_of(3))
        }
    }

    impl Write for Port {
        fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
            self.0.extend_from_slice(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> Result<(), ErrorKind> {
            Ok(())
        }
    }

    #[test]
    fn runs_in_interrupts() {
        static SHARED: Shared<Counter> = Shared::new();
        assert_eq!(SHARED.tick(7), 7 + Cadence::LONGEST);
        assert_eq!((&SHARED).room(), 0);
        SHARED.start(Counter::default(), 0);
        let mut foreground: Foreground<Counter, 15> = Foreground::new(&SHARED, Settings::default());
        let mut port = Port::default();
        for &byte in b"G1 X2 F3000\n" {
            SHARED.receive(byte);
        }
        let mut counter = 0;
        for _ in 0..1000 {
            foreground.turn(&mut port).unwrap();
            counter = SHARED.tick(counter);
        }
        assert_eq!(SHARED.with_hardware(|hardware| hardware.0), Some(160));
        assert_eq!((&SHARED).position(), [160, 0, 0]);
        assert_eq!(String::from_utf8(port.0).unwrap(), "\r\nGrbl 1.1h ['$' for help]\r\nok\r\n");

        for _ in 0..RX_BYTES + 2 {
            SHARED.receive(b' ');
        }
        assert_eq!(SHARED.lost_bytes(), 2);
    }

    /// The counter wraps, an interrupt comes late, and one wait is longer than the counter's half.
    #[test]
    fn cadence_neither_drifts_nor_hurries() {
        let start = u32::MAX - 150;
        let mut cadence = Cadence::new(start);
        let at = |counts: u32| start.wrapping_add(counts);
        assert_eq!(cadence.next(at(3), || 100), at(100));
        assert_eq!(cadence.next(at(104), || 100), at(200));
        assert_eq!(cadence.next(at(299), || 100), at(300), "late by almost a period");
        assert_eq!(cadence.next(at(450), || 100), at(550), "late by more");
        assert_eq!(cadence.next(at(549), || panic!("not due")), at(550));
        assert_eq!(cadence.next(at(550), || Cadence::LONGEST + 7), at(550 + Cadence::LONGEST));
        assert_eq!(
            cadence.next(at(550 + Cadence::LONGEST), || panic!("the wait is not over")),
            at(557 + Cadence::LONGEST)
        );
        assert_eq!(cadence.next(at(557 + Cadence::LONGEST), || 1), at(558 + Cadence::LONGEST));
    }
}
