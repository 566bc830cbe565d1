//! The step interrupt: segments in, step pulses out.
//!
//! One timer interrupt calls [`Stepper::tick`]. Each tick makes the step event that is due (at most one step on each axis), loads the next
//! segment when one has ended, and returns the time to the next tick. Axes share the events of a block by Bresenham's
//! algorithm in integers, so each makes exactly its steps by the block's last event.
//!
//! Time is counted in ticks of the hardware's timer, [`Hardware::TICKS_PER_US`] of them in a µs. A period is a whole number of ticks and 2⁻³²ths of
//! one, which are carried from event to event: the mean rate is exact, and each event at most a tick early.
//!
//! ```text
//!              ◀─────── period ───────▶◀─────── period ───────▶
//!  step     ┌────┐                  ┌────┐                  ┌────┐
//!        ───┘    └──────────────────┘    └──────────────────┘    └───
//!           ▲ tick                  ▲ tick                  ▲ tick       the hardware ends a pulse by itself
//!           ▲ tick ▲ tick           ▲ tick ▲ tick           ▲ tick       Hardware::TICK_ENDS_PULSE
//!  direction     ╳ changes after the last pulse of a block, the rest of a period before the next rising edge
//! ```
//!
//! Time budget: see [`Stepper::tick`]. No floating point, no division, no loop over anything but the axes and commands that take no time.

use heapless::Deque;

use crate::axis::{AXES, Axes};
use crate::dda::Dda;
use crate::hal::{Hardware, Wiring};
use crate::pen::{Pen, PenMotion, RAMP_STEP_US, Ramp};

/// Time to the next tick while there is nothing to do, µs.
pub const IDLE_US: u32 = 1000;

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
    /// Between events, in 2⁻¹⁶ µs.
    pub(crate) period: u64,
    /// Change of the pen before the first event.
    pub(crate) pen: Option<Pen>,
    /// N word of the block's first line, 0 for none.
    pub(crate) line: u32,
    /// Lines that have been drawn when this has.
    pub(crate) lines: u16,
}

/// How far the drawing has come: what has been stepped, not what has been planned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Drawn {
    /// Lines (chords of arcs) that moved the machine and have been drawn to their end, since the start; wraps.
    pub lines: u32,
    /// N word of the line at which the machine is; of several that share a block the first. 0 for none, and at rest.
    pub number: u32,
}

/// What the main loop hands to the interrupt, in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Command {
    /// Make steps.
    Steps(Steps),
    /// Move the pen, and wait until it has settled ([`PenMotion`]).
    Pen(Pen),
    /// Do nothing for this many µs.
    Dwell(u32),
}

/// The interrupt's side as the main loop sees it. [`Stepper`] itself where one context runs both; on a board with interrupts an
/// adapter that locks a shared [`Stepper`] for each call, which keeps every critical section to a copy of 56 bytes:
///
/// ```
/// use core::cell::RefCell; // on a board: critical_section::Mutex<RefCell<Stepper<…>>> in a static
/// use penvis_firmware::{AXES, Axes, Command, Controller, Drawn, Hardware, Pen, Settings, StepSink, Stepper, Wiring};
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
///     fn drawn(&self) -> Drawn { self.0.borrow().drawn() }
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
    /// How far the drawing has come.
    fn drawn(&self) -> Drawn;
    /// Stops at once, forgets all commands, lifts the pen. The position stays what it is.
    fn abort(&mut self);
    /// Calls the place where the machine stands so many steps from the origin. The caller has seen that it stands.
    fn set_position(&mut self, steps: [i32; AXES]);
    /// Axes whose limit switch is closed: see [`Hardware::limits`].
    fn limits(&mut self) -> Axes;
    /// Takes new wiring settings.
    fn configure(&mut self, wiring: Wiring);
}

/// The step interrupt's state. All times are in ticks of the timer.
#[derive(Debug)]
pub struct Stepper<H> {
    hardware: H,
    /// Step events left in the segment; 0: no segment is in execution.
    left: u32,
    /// The block of that segment.
    dda: Dda,
    /// A step signal is high, and the next tick ends it ([`Hardware::TICK_ENDS_PULSE`]).
    in_pulse: bool,
    /// Ticks that a pulse takes (`$0`).
    pulse: u32,
    /// Between step events: whole ticks, and 2⁻³²ths of one.
    period: u32,
    period_part: u32,
    /// 2⁻³²ths of a tick that `next` is early.
    early: u32,
    /// Time of the next tick since the start; within a tick, its own. One 64-bit sum a tick is enough, so the time of the last tick is not kept beside it.
    next: u64,
    /// From the last tick to the next.
    wait: u32,
    queue: Deque<Command, SEGMENTS>,
    /// Events of the block up to the end of the segment.
    dealt: u32,
    /// Where the block began, in steps.
    block_start: [i32; AXES],
    drawn: Drawn,
    /// Lines that will have been drawn at the end of the segment.
    lines: u16,
    /// What was loaded last was a segment.
    stepping: bool,
    /// A dwell, or the settling of the pen, is running out.
    dwelling: bool,
    settling: bool,
    pen: Pen,
    /// The pen is on its way.
    ramp: Option<Ramp>,
    pen_motion: PenMotion,
    motors_on: bool,
    /// Motors are released this long after the last command.
    idle_delay: Option<u32>,
    /// Time of the last step.
    idle_since: u64,
}

impl<H: Hardware> Stepper<H> {
    /// At rest at the origin, pen off, motors off, the hardware told so.
    pub fn new(mut hardware: H) -> Self {
        hardware.set_pen(Pen::Off);
        hardware.enable_motors(false);
        Self {
            hardware,
            left: 0,
            dda: Dda::default(),
            in_pulse: false,
            pulse: 1,
            period: 1,
            period_part: 0,
            early: 0,
            next: 0,
            wait: 0,
            queue: Deque::new(),
            dealt: 0,
            block_start: [0; AXES],
            drawn: Drawn::default(),
            lines: 0,
            stepping: false,
            dwelling: false,
            settling: false,
            pen: Pen::Off,
            ramp: None,
            pen_motion: PenMotion::default(),
            motors_on: false,
            idle_delay: None,
            idle_since: 0,
        }
    }

    /// The step interrupt: makes the step that is due now, and returns the ticks (≥ 1) until it wants to be called again.
    // Where it is inlined into an interrupt with work of its own, registers run out and each step costs more.
    #[inline(never)]
    pub fn tick(&mut self) -> u32 {
        self.hardware.set_time(self.next);
        let wait = if H::TICK_ENDS_PULSE && self.in_pulse {
            self.hardware.end_step();
            self.in_pulse = false;
            let wait = if self.left > 0 { self.period() } else { self.load() };
            // What is loaded after a step counts from its rising edge.
            wait.saturating_sub(self.pulse).max(1)
        } else if self.left > 0 {
            self.left -= 1;
            self.hardware.step(self.dda.event());
            if H::TICK_ENDS_PULSE {
                self.in_pulse = true;
                self.pulse
            } else if self.left > 0 {
                self.period()
            } else {
                self.load()
            }
        } else {
            self.load()
        };
        self.next += u64::from(wait);
        self.wait = wait;
        wait
    }

    /// Ticks from this step event to the next.
    #[inline(always)]
    fn period(&mut self) -> u32 {
        let (early, carry) = self.early.overflowing_add(self.period_part);
        self.early = early;
        // Below u32::MAX: see `begin`.
        self.period + u32::from(carry)
    }

    /// Time of the last tick, in ticks since the start.
    #[must_use]
    pub fn now(&self) -> u64 {
        self.next - u64::from(self.wait)
    }

    /// Time at which the next tick is due, in ticks since the start.
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

    /// Takes commands until one takes time; the ticks until the next call.
    #[cold]
    #[inline(never)]
    fn load(&mut self) -> u32 {
        if self.stepping {
            self.stepping = false;
            self.idle_since = self.next;
            self.drawn.lines = self.drawn.lines.wrapping_add(u32::from(self.lines));
            self.drawn.number = 0;
        }
        self.dwelling = false;
        if core::mem::take(&mut self.settling) {
            self.hardware.pen_settled();
        }
        if let Some(ticks) = self.move_pen() {
            return ticks;
        }
        while let Some(command) = self.queue.pop_front() {
            match command {
                Command::Steps(segment) => {
                    self.begin(&segment);
                    return self.period();
                }
                Command::Pen(pen) => {
                    self.ramp = Some(Ramp::new(self.pen, pen, self.pen_motion));
                    if let Some(ticks) = self.move_pen() {
                        return ticks;
                    }
                }
                Command::Dwell(us) => {
                    self.dwelling = true;
                    return us.saturating_mul(H::TICKS_PER_US).max(1);
                }
            }
        }
        self.idle()
    }

    /// Moves a pen that is on its way; the ticks until that goes on, none when there is nothing to wait for.
    fn move_pen(&mut self) -> Option<u32> {
        let (pen, arrived) = self.ramp.as_mut()?.next();
        self.set_pen(pen);
        if !arrived {
            return Some(RAMP_STEP_US * H::TICKS_PER_US);
        }
        self.ramp = None;
        if self.pen_motion.settle_ms == 0 {
            self.hardware.pen_settled();
            return None;
        }
        self.settling = true;
        Some(u32::from(self.pen_motion.settle_ms) * 1000 * H::TICKS_PER_US)
    }

    /// Makes `segment` the one in execution.
    fn begin(&mut self, segment: &Steps) {
        if let Some(pen) = segment.pen {
            self.set_pen(pen);
        }
        if segment.first {
            self.block_start = self.position();
            self.dda = Dda::new(segment.steps, segment.events_of_block, segment.negative);
            self.dealt = 0;
            self.hardware.set_directions(segment.negative);
            if !self.motors_on {
                self.motors_on = true;
                self.hardware.enable_motors(true);
            }
        }
        self.stepping = true;
        self.lines = segment.lines;
        self.drawn.number = segment.line;
        self.left = u32::from(segment.events);
        self.dealt += self.left;
        // 2⁻¹⁶ µs to ticks; a period that the timer cannot count becomes the longest that it can.
        let period = segment.period.saturating_mul(u64::from(H::TICKS_PER_US));
        self.period = u32::try_from(period >> 16).unwrap_or(u32::MAX).clamp(1, u32::MAX - 1);
        self.period_part = (period as u32) << 16;
    }

    /// What is left of the block will not be made.
    fn forget_block(&mut self) {
        self.drawn.number = 0;
        self.lines = 0;
        self.dda = Dda::default();
        self.dealt = 0;
        self.left = 0;
    }

    fn set_pen(&mut self, pen: Pen) {
        self.pen = pen;
        self.hardware.set_pen(pen);
    }

    /// Releases the motors when their time has come.
    fn idle(&mut self) -> u32 {
        let due = self.idle_delay.is_some_and(|delay| self.next.saturating_sub(self.idle_since) >= u64::from(delay));
        if due && self.motors_on {
            self.motors_on = false;
            self.hardware.enable_motors(false);
        }
        IDLE_US * H::TICKS_PER_US
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
        self.queue.is_empty()
            && self.left == 0
            && !self.in_pulse
            && !self.dwelling
            && !self.settling
            && self.ramp.is_none()
    }

    fn is_moving(&self) -> bool {
        self.left > 0 || self.in_pulse || self.queue.iter().any(|c| matches!(c, Command::Steps(_)))
    }

    fn position(&self) -> [i32; AXES] {
        let made = self.dda.made(self.dealt - self.left);
        core::array::from_fn(|axis| self.block_start[axis].wrapping_add(made[axis]))
    }

    fn drawn(&self) -> Drawn {
        self.drawn
    }

    fn abort(&mut self) {
        self.queue.clear();
        self.block_start = self.position();
        self.forget_block();
        self.dwelling = false;
        self.settling = false;
        self.ramp = None;
        if self.pen != Pen::Off {
            self.set_pen(Pen::Off);
        }
    }

    fn set_position(&mut self, steps: [i32; AXES]) {
        self.forget_block();
        self.block_start = steps;
    }

    fn limits(&mut self) -> Axes {
        self.hardware.limits()
    }

    fn configure(&mut self, wiring: Wiring) {
        self.idle_delay =
            (wiring.idle_delay_ms < u8::MAX).then(|| u32::from(wiring.idle_delay_ms) * 1000 * H::TICKS_PER_US);
        self.pulse = (u32::from(wiring.pulse_us) * H::TICKS_PER_US).max(1);
        self.pen_motion = wiring.pen;
        self.hardware.configure(wiring);
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    /// The wires, with the time in ticks.
    #[derive(Debug, PartialEq)]
    enum Edge {
        Rise(u64, u8),
        Fall(u64),
        Directions(u64, u8),
    }

    /// A timer of 84 MHz, whose interrupt also ends the pulses.
    #[derive(Default)]
    struct Fast {
        now: u64,
        edges: Vec<Edge>,
    }

    impl Hardware for Fast {
        const TICKS_PER_US: u32 = 84;
        const TICK_ENDS_PULSE: bool = true;

        fn set_directions(&mut self, negative: Axes) {
            self.edges.push(Edge::Directions(self.now, negative.bits()));
        }

        fn step(&mut self, axes: Axes) {
            self.edges.push(Edge::Rise(self.now, axes.bits()));
        }

        fn end_step(&mut self) {
            self.edges.push(Edge::Fall(self.now));
        }

        fn set_pen(&mut self, _: Pen) {}

        fn set_time(&mut self, now: u64) {
            self.now = now;
        }
    }

    /// A block in one segment, `period` in 2⁻¹⁶ µs.
    fn block(steps: [u32; AXES], negative: u8, period: u64) -> Command {
        let events = steps.into_iter().max().unwrap();
        Command::Steps(Steps {
            steps,
            events_of_block: events,
            negative: Axes::from_bits(negative),
            first: true,
            events: events as u16,
            period,
            pen: None,
            line: 7,
            lines: 2,
        })
    }

    fn run(stepper: &mut Stepper<Fast>) {
        while !stepper.is_idle() {
            let next = stepper.next_event();
            let wait = stepper.tick();
            assert_eq!((stepper.now(), stepper.next_event()), (next, next + u64::from(wait)));
        }
    }

    #[test]
    fn signals_keep_their_times() {
        let mut stepper = Stepper::new(Fast::default());
        stepper.configure(Wiring { pulse_us: 2, ..Wiring::default() });
        // 5 µs, and 5.5 µs.
        assert!(stepper.push(block([3, 1, 0], 0b000, 5 << 16)) && stepper.push(block([0, 2, 0], 0b010, 11 << 15)));
        run(&mut stepper);
        assert_eq!(stepper.position(), [3, -1, 0]);
        assert_eq!(stepper.drawn(), Drawn { lines: 4, number: 0 });
        use Edge::{Directions, Fall, Rise};
        assert_eq!(
            stepper.hardware().edges,
            [
                Directions(0, 0b000),
                Rise(420, 0b001),
                Fall(588),
                Rise(840, 0b011),
                Fall(1008),
                Rise(1260, 0b001),
                Fall(1428),
                Directions(1428, 0b010),
                Rise(1260 + 462, 0b010),
                Fall(1428 + 462),
                Rise(1260 + 924, 0b010),
                Fall(1428 + 924),
            ]
        );
    }

    /// At 240,000 steps a second and a period of no whole number of ticks each step is within a tick of its time, for ever.
    #[test]
    fn high_rates_are_even() {
        let mut stepper = Stepper::new(Fast::default());
        stepper.configure(Wiring { pulse_us: 1, ..Wiring::default() });
        let us = 1e6 / 240_001.0;
        assert!(stepper.push(block([60_000, 60_000, 1], 0, (us * 65_536.0f64).round() as u64)));
        run(&mut stepper);
        let rises: Vec<u64> = stepper
            .hardware()
            .edges
            .iter()
            .filter_map(|e| if let Edge::Rise(at, _) = e { Some(*at) } else { None })
            .collect();
        assert_eq!(rises.len(), 60_000);
        for (k, at) in rises.iter().enumerate() {
            let exact = (k + 1) as f64 * us * 84.0;
            // And 60,000 times the rounding of the period, 2⁻¹⁷ µs.
            assert!((*at as f64 - exact).abs() <= 1.0 + k as f64 * 84.0 / 131_072.0, "step {k} at {at}, not {exact}");
        }
        assert!(rises.windows(2).all(|w| (w[1] - w[0]).abs_diff((us * 84.0) as u64) <= 1));
    }

    #[test]
    fn an_abort_keeps_the_position() {
        let mut stepper = Stepper::new(Fast::default());
        stepper.configure(Wiring { pulse_us: 2, ..Wiring::default() });
        assert!(stepper.push(block([100, 40, 7], 0b101, 10 << 16)));
        // The first tick loads; then two for each step.
        for _ in 0..1 + 2 * 31 {
            stepper.tick();
        }
        assert_eq!(stepper.drawn(), Drawn { lines: 0, number: 7 });
        let at = stepper.position();
        assert_eq!((at[0], at[2]), (-31, -2));
        assert!((12..=13).contains(&at[1]));
        stepper.abort();
        assert!(stepper.is_idle());
        assert_eq!(stepper.position(), at);
        assert_eq!(stepper.drawn(), Drawn::default());
        assert!(stepper.push(block([1, 1, 0], 0b000, 10 << 16)));
        run(&mut stepper);
        assert_eq!(stepper.position(), [at[0] + 1, at[1] + 1, at[2]]);
    }
}
