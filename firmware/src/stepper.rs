//! The step interrupt: segments in, step pulses out.
//!
//! One timer interrupt calls [`Stepper::tick`]. Each tick makes the step event that is due (at most one step on each axis), loads the next
//! segment when one has ended, and returns the time to the next tick. Axes share the events of a block by Bresenham's
//! algorithm in integers, so each makes exactly its steps by the block's last event.
//!
//! Time budget: a step event is 3 additions and comparisons and one call of [`Hardware::step`]; loading a segment copies 40 bytes. No floating point, no
//! division, no loop over anything but the axes and commands that take no time.

use heapless::Deque;

use crate::axis::{AXES, Axes};
use crate::hal::{Hardware, Wiring};
use crate::pen::Pen;

/// Ticks of the step timer in a second: all times of [`Stepper`] are in µs.
pub const TIMER_HZ: u32 = 1_000_000;

/// Time to the next tick while there is nothing to do, µs.
pub const IDLE_TICKS: u32 = 1000;

/// Segments that the queue between main loop and interrupt holds: some 30 ms of motion.
pub const SEGMENTS: usize = 12;

/// A run of equally spaced step events within one block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Steps {
    /// Steps of each axis in the whole block.
    pub(crate) steps: [u32; AXES],
    /// Step events in the whole block: the largest of `steps`.
    pub(crate) events_of_block: u32,
    pub(crate) negative: Axes,
    /// First segment of its block.
    pub(crate) first: bool,
    /// Step events in this segment, > 0.
    pub(crate) events: u16,
    /// Between events, in 1/256 µs.
    pub(crate) period: u64,
    /// Change of the pen before the first event.
    pub(crate) pen: Option<Pen>,
}

/// What the main loop hands to the interrupt, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Command {
    /// Make steps.
    Steps(Steps),
    /// Move the pen; takes no time of its own.
    Pen(Pen),
    /// Do nothing for this many µs.
    Dwell(u32),
}

/// The interrupt's side as the main loop sees it. [`Stepper`] itself where one context runs both; on a board with interrupts an
/// adapter that locks a shared [`Stepper`] for each call, which keeps every critical section to a copy of 56 bytes:
///
/// ```
/// use core::cell::RefCell; // on a board: critical_section::Mutex<RefCell<Stepper<…>>> in a static
/// use penvis_firmware::{AXES, Axes, Command, Controller, Hardware, Pen, Settings, StepSink, Stepper, Wiring};
///
/// struct Board;
/// impl Hardware for Board {
///     fn set_directions(&mut self, _: Axes) {}
///     fn step(&mut self, _: Axes) {}
///     fn set_pen(&mut self, _: Pen) {}
/// }
///
/// struct Shared<'a>(&'a RefCell<Stepper<Board>>);
/// impl StepSink for Shared<'_> {
///     fn room(&self) -> usize { self.0.borrow().room() }
///     fn push(&mut self, command: Command) -> bool { self.0.borrow_mut().push(command) }
///     fn is_idle(&self) -> bool { self.0.borrow().is_idle() }
///     fn is_moving(&self) -> bool { self.0.borrow().is_moving() }
///     fn position(&self) -> [i32; AXES] { self.0.borrow().position() }
///     fn abort(&mut self) { self.0.borrow_mut().abort() }
///     fn set_position(&mut self, steps: [i32; AXES]) { self.0.borrow_mut().set_position(steps) }
///     fn limits(&mut self) -> Axes { self.0.borrow_mut().limits() }
///     fn configure(&mut self, wiring: Wiring) { self.0.borrow_mut().configure(wiring) }
/// }
///
/// let stepper = RefCell::new(Stepper::new(Board));
/// let mut controller: Controller<64> = Controller::new(Settings::default());
/// for &byte in b"G0 X1\n" {
///     controller.receive(byte);
/// }
/// // The main loop does this for ever; the timer interrupt, stepper.borrow_mut().tick().
/// while !controller.is_idle(&Shared(&stepper)) {
///     controller.poll(&mut Shared(&stepper));
///     controller.transmit();
///     stepper.borrow_mut().tick();
/// }
/// assert_eq!(stepper.borrow().position(), [80, 0, 0]);
/// ```
pub trait StepSink {
    /// Commands that still fit.
    fn room(&self) -> usize;
    /// Appends `command`; false when there is no room, and then nothing has changed.
    fn push(&mut self, command: Command) -> bool;
    /// Whether every command has been carried out.
    fn is_idle(&self) -> bool;
    /// Whether steps are outstanding.
    fn is_moving(&self) -> bool;
    /// Steps from the origin.
    fn position(&self) -> [i32; AXES];
    /// Stops at once, forgets all commands, lifts the pen. The position stays what it is.
    fn abort(&mut self);
    /// Calls the place where the machine stands so many steps from the origin. The caller has seen that it stands.
    fn set_position(&mut self, steps: [i32; AXES]);
    /// Axes whose limit switch is closed: see [`Hardware::limits`].
    fn limits(&mut self) -> Axes;
    /// Takes new wiring settings.
    fn configure(&mut self, wiring: Wiring);
}

/// The step interrupt's state.
#[derive(Debug)]
pub struct Stepper<H> {
    hardware: H,
    queue: Deque<Command, SEGMENTS>,
    segment: Option<Steps>,
    /// Events left in `segment`.
    left: u16,
    /// Bresenham's remainders, 0..events_of_block.
    remainders: [u32; AXES],
    /// A dwell is running out.
    dwelling: bool,
    position: [i32; AXES],
    pen: Pen,
    /// Time of this tick and of the next, µs since the start.
    now: u64,
    next: u64,
    /// 256ths of a µs that `next` is early.
    fraction: u8,
    motors_on: bool,
    /// Motors are released this long after the last command, µs.
    idle_delay: Option<u32>,
    /// Time of the last step, µs.
    idle_since: u64,
}

impl<H: Hardware> Stepper<H> {
    /// At rest at the origin, pen off, motors off, the hardware told so.
    pub fn new(mut hardware: H) -> Self {
        hardware.set_pen(Pen::Off);
        hardware.enable_motors(false);
        Self {
            hardware,
            queue: Deque::new(),
            segment: None,
            left: 0,
            remainders: [0; AXES],
            dwelling: false,
            position: [0; AXES],
            pen: Pen::Off,
            now: 0,
            next: 0,
            fraction: 0,
            motors_on: false,
            idle_delay: None,
            idle_since: 0,
        }
    }

    /// The step interrupt: makes the step that is due now, and returns the µs (≥ 1) until it wants to be called again.
    pub fn tick(&mut self) -> u32 {
        self.now = self.next;
        self.hardware.set_time(self.now);
        if let Some(segment) = self.segment {
            self.step_event(&segment);
            self.idle_since = self.now;
            self.left = self.left.saturating_sub(1);
            if self.left == 0 {
                self.segment = None;
            }
        }
        let dwell = if self.segment.is_none() { self.load() } else { None };
        self.dwelling = dwell.is_some();
        let wait = match (self.segment, dwell) {
            (Some(segment), _) => {
                let total = segment.period.saturating_add(u64::from(self.fraction));
                self.fraction = (total & 0xff) as u8;
                u32::try_from(total >> 8).unwrap_or(u32::MAX).max(1)
            }
            (None, Some(ticks)) => ticks,
            (None, None) => self.idle(),
        };
        self.next = self.now.saturating_add(u64::from(wait));
        wait
    }

    /// Time of the last tick, µs since the start.
    #[must_use]
    pub fn now(&self) -> u64 {
        self.now
    }

    /// Time at which the next tick is due, µs since the start.
    #[must_use]
    pub fn next_event(&self) -> u64 {
        self.next
    }

    /// The hardware.
    pub fn hardware(&self) -> &H {
        &self.hardware
    }

    /// The hardware, to take out what it recorded.
    pub fn hardware_mut(&mut self) -> &mut H {
        &mut self.hardware
    }

    /// Gives the hardware back.
    pub fn into_hardware(self) -> H {
        self.hardware
    }

    fn step_event(&mut self, segment: &Steps) {
        let mut axes = Axes::NONE;
        for axis in 0..AXES {
            // Below events_of_block before, and steps ≤ events_of_block < 2³¹: no overflow.
            self.remainders[axis] += segment.steps[axis];
            if self.remainders[axis] >= segment.events_of_block {
                self.remainders[axis] -= segment.events_of_block;
                axes.insert(axis);
                self.position[axis] += if segment.negative.contains(axis) { -1 } else { 1 };
            }
        }
        self.hardware.step(axes);
    }

    /// Takes commands until one takes time; a dwell's µs, if that is the one.
    fn load(&mut self) -> Option<u32> {
        while let Some(command) = self.queue.pop_front() {
            match command {
                Command::Steps(segment) => {
                    if let Some(pen) = segment.pen {
                        self.set_pen(pen);
                    }
                    if segment.first {
                        // Half a block in hand, so that the minor axes step in the middle of their share.
                        self.remainders = [segment.events_of_block / 2; AXES];
                        self.hardware.set_directions(segment.negative);
                        if !self.motors_on {
                            self.motors_on = true;
                            self.hardware.enable_motors(true);
                        }
                    }
                    self.left = segment.events;
                    self.segment = Some(segment);
                    return None;
                }
                Command::Pen(pen) => self.set_pen(pen),
                Command::Dwell(ticks) => return Some(ticks.max(1)),
            }
        }
        None
    }

    fn set_pen(&mut self, pen: Pen) {
        self.pen = pen;
        self.hardware.set_pen(pen);
    }

    /// Releases the motors when their time has come.
    fn idle(&mut self) -> u32 {
        let due = self.idle_delay.is_some_and(|delay| self.now.saturating_sub(self.idle_since) >= u64::from(delay));
        if due && self.motors_on {
            self.motors_on = false;
            self.hardware.enable_motors(false);
        }
        IDLE_TICKS
    }
}

impl<H: Hardware> StepSink for Stepper<H> {
    fn room(&self) -> usize {
        SEGMENTS - self.queue.len()
    }

    fn push(&mut self, command: Command) -> bool {
        self.queue.push_back(command).is_ok()
    }

    fn is_idle(&self) -> bool {
        self.queue.is_empty() && self.segment.is_none() && !self.dwelling
    }

    fn is_moving(&self) -> bool {
        self.segment.is_some() || self.queue.iter().any(|c| matches!(c, Command::Steps(_)))
    }

    fn position(&self) -> [i32; AXES] {
        self.position
    }

    fn abort(&mut self) {
        self.queue.clear();
        self.segment = None;
        self.left = 0;
        self.dwelling = false;
        if self.pen != Pen::Off {
            self.set_pen(Pen::Off);
        }
    }

    fn set_position(&mut self, steps: [i32; AXES]) {
        self.position = steps;
    }

    fn limits(&mut self) -> Axes {
        self.hardware.limits()
    }

    fn configure(&mut self, wiring: Wiring) {
        self.idle_delay = (wiring.idle_delay_ms < u8::MAX).then(|| u32::from(wiring.idle_delay_ms) * 1000);
        self.hardware.configure(wiring);
    }
}
