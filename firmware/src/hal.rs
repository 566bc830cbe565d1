//! What the firmware needs of a board, and how to give it that with `embedded-hal` pins.

use core::convert::Infallible;

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::OutputPin;

use crate::axis::Axes;
use crate::pen::{Pen, PenMotion};
use crate::pen_driver::PenDriver;

/// Settings that concern the wires.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Wiring {
    /// Width of a step pulse, µs (`$0`).
    pub pulse_us: u8,
    /// Axes whose step signal is inverted: a step is its falling edge (`$2`).
    pub invert_steps: Axes,
    /// Axes whose direction signal is inverted (`$3`).
    pub invert_directions: Axes,
    /// The enable signal is inverted (`$4`).
    pub invert_enable: bool,
    /// Motors are released after this many ms; 255: never (`$1`). The stepper minds it, not the hardware.
    pub idle_delay_ms: u8,
    /// How the pen moves. The stepper minds it, not the hardware.
    pub pen: PenMotion,
}

/// Motors and pen. All calls come from [`crate::Stepper`], in the order in which things happen.
///
/// What a step costs is mostly the hardware's doing. Where the step pins share a port, keep the eight patterns of its register in a
/// table that [`Hardware::configure`] fills, so that [`Hardware::step`] is one load and one store: `BSRR ← table[axes.bits()]`.
pub trait Hardware {
    /// Ticks of the step timer in a µs. A step is at most one of them early, so a fast timer makes high rates even: at 100,000 steps a second
    /// and 1 tick in a µs single periods are off by up to a tenth, at 84 ticks by 0.1 %.
    const TICKS_PER_US: u32 = 1;

    /// How a step pulse ends. False: [`Hardware::step`] makes the whole pulse, or starts one that a timer's compare channel ends after `$0`.
    /// True: [`Hardware::step`] raises the step signals, and [`crate::Stepper::tick`] asks to be called again after `$0` and then calls [`Hardware::end_step`]. So
    /// each step takes two short interrupts, and no time is spent waiting.
    const TICK_ENDS_PULSE: bool = false;

    /// The direction of all following steps: axes in `negative` go down, the others up. Logical, before `$3`. Called at the start of
    /// each block, a whole step period before its first step (less the pulse of the step before it, with [`Hardware::TICK_ENDS_PULSE`]).
    fn set_directions(&mut self, negative: Axes);

    /// One step pulse on each of `axes` (may be empty): see [`Hardware::TICK_ENDS_PULSE`].
    fn step(&mut self, axes: Axes);

    /// Ends the pulse on all axes. Called only with [`Hardware::TICK_ENDS_PULSE`].
    fn end_step(&mut self) {}

    /// The pen's new state. Called only while no step of what came before is outstanding.
    fn set_pen(&mut self, pen: Pen);

    /// The pen has settled where it was told last (`$512`): a solenoid may now only hold.
    fn pen_settled(&mut self) {}

    /// Energises or releases the motors.
    fn enable_motors(&mut self, on: bool) {
        let _ = on;
    }

    /// Axes whose limit switch pin is low: closed, for normally open switches to ground with pull-ups. `$5` inverts them. Read at every turn of the main loop while
    /// the machine moves, homes or reports, so it must be quick. A machine without switches reports none.
    fn limits(&mut self) -> Axes {
        Axes::NONE
    }

    /// New wiring settings, at the start and when `$0` or `$3` change.
    fn configure(&mut self, wiring: Wiring) {
        let _ = wiring;
    }

    /// The time of what is called next, in ticks since the start. For recorders; a board has no use for it.
    fn set_time(&mut self, now: u64) {
        let _ = now;
    }
}

/// Step and direction signals of one axis.
pub trait AxisDriver {
    /// Sets the level of the direction signal.
    fn set_direction(&mut self, high: bool);
    /// Sets the level of the step signal.
    fn set_step(&mut self, high: bool);
}

/// A step and a direction pin. Pins that can fail (port expanders) are too slow for this, so their error must be [`Infallible`].
#[derive(Debug)]
pub struct StepDirection<S, D> {
    /// Step pin; a step is its rising edge.
    pub step: S,
    /// Direction pin.
    pub direction: D,
}

impl<S: OutputPin<Error = Infallible>, D: OutputPin<Error = Infallible>> AxisDriver for StepDirection<S, D> {
    fn set_direction(&mut self, high: bool) {
        let Ok(()) = self.direction.set_state(high.into());
    }

    fn set_step(&mut self, high: bool) {
        let Ok(()) = self.step.set_state(high.into());
    }
}

/// An axis that the machine does not have.
impl AxisDriver for () {
    fn set_direction(&mut self, _: bool) {}
    fn set_step(&mut self, _: bool) {}
}

/// [`Hardware`] over `embedded-hal` pins: three axes (`()` for one that is missing), an active-low enable pin, what moves the pen, and a delay for the step pulse.
///
/// [`Hardware::step`] is busy for the width of the pulse (`$0`, 10 µs by default; 2 to 4 µs do for common drivers).
#[derive(Debug)]
pub struct Pins<X, Y, Z, E, P, D> {
    /// X axis.
    pub x: X,
    /// Y axis.
    pub y: Y,
    /// Z axis.
    pub z: Z,
    /// Enable pin of the drivers: low energises, unless `$4` inverts it.
    pub enable: E,
    /// What moves the pen.
    pub pen: P,
    /// Delay for the pulse.
    pub delay: D,
    wiring: Wiring,
}

impl<X, Y, Z, E, P, D> Pins<X, Y, Z, E, P, D> {
    /// Pins that are already outputs.
    pub fn new(axes: (X, Y, Z), enable: E, pen: P, delay: D) -> Self {
        let (x, y, z) = axes;
        Self { x, y, z, enable, pen, delay, wiring: Wiring::default() }
    }
}

impl<X, Y, Z, E, P, D> Hardware for Pins<X, Y, Z, E, P, D>
where
    X: AxisDriver,
    Y: AxisDriver,
    Z: AxisDriver,
    E: OutputPin<Error = Infallible>,
    P: PenDriver,
    D: DelayNs,
{
    fn set_directions(&mut self, negative: Axes) {
        let level = Axes::from_bits(negative.bits() ^ self.wiring.invert_directions.bits());
        self.x.set_direction(level.contains(0));
        self.y.set_direction(level.contains(1));
        self.z.set_direction(level.contains(2));
    }

    fn step(&mut self, axes: Axes) {
        let inverted = self.wiring.invert_steps;
        for high in [true, false] {
            if axes.contains(0) {
                self.x.set_step(high != inverted.contains(0));
            }
            if axes.contains(1) {
                self.y.set_step(high != inverted.contains(1));
            }
            if axes.contains(2) {
                self.z.set_step(high != inverted.contains(2));
            }
            if high {
                self.delay.delay_us(u32::from(self.wiring.pulse_us));
            }
        }
    }

    fn set_pen(&mut self, pen: Pen) {
        self.pen.set(pen);
    }

    fn pen_settled(&mut self) {
        self.pen.settled();
    }

    fn enable_motors(&mut self, on: bool) {
        let Ok(()) = self.enable.set_state((on == self.wiring.invert_enable).into());
    }

    fn configure(&mut self, wiring: Wiring) {
        self.wiring = wiring;
        // The levels between steps.
        self.x.set_step(wiring.invert_steps.contains(0));
        self.y.set_step(wiring.invert_steps.contains(1));
        self.z.set_step(wiring.invert_steps.contains(2));
    }
}

#[cfg(test)]
mod tests {
    use core::cell::RefCell;
    use std::string::{String, ToString};
    use std::vec::Vec;

    use embedded_hal::pwm::SetDutyCycle;
    use embedded_hal::{digital, pwm};

    use super::*;
    use crate::pen_driver::{Servo, ServoPen};

    /// One wire of the board, which writes all that happens to it into the common log.
    struct Wire<'a>(&'static str, &'a RefCell<Vec<String>>);

    impl Wire<'_> {
        fn log(&self, what: &str) {
            self.1.borrow_mut().push(std::format!("{}{what}", self.0));
        }
    }

    impl digital::ErrorType for Wire<'_> {
        type Error = Infallible;
    }

    impl OutputPin for Wire<'_> {
        fn set_low(&mut self) -> Result<(), Infallible> {
            self.log("0");
            Ok(())
        }

        fn set_high(&mut self) -> Result<(), Infallible> {
            self.log("1");
            Ok(())
        }
    }

    impl pwm::ErrorType for Wire<'_> {
        type Error = Infallible;
    }

    impl SetDutyCycle for Wire<'_> {
        fn max_duty_cycle(&self) -> u16 {
            40_000
        }

        fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
            self.log(&duty.to_string());
            Ok(())
        }
    }

    impl DelayNs for Wire<'_> {
        fn delay_ns(&mut self, ns: u32) {
            self.log(&ns.to_string());
        }
    }

    #[test]
    fn pins_get_the_signals() {
        let log = RefCell::new(Vec::new());
        let wire = |name| Wire(name, &log);
        let axis = |step, direction| StepDirection { step: wire(step), direction: wire(direction) };
        let mut pins = Pins::new(
            (axis("xs", "xd"), axis("ys", "yd"), ()),
            wire("en"),
            ServoPen { pwm: wire("pwm"), servo: Servo::default() },
            wire("ns"),
        );
        let mut said = |act: &mut dyn FnMut(&mut Pins<_, _, _, _, _, _>)| {
            act(&mut pins);
            log.borrow_mut().drain(..).collect::<Vec<_>>().join(" ")
        };
        let both = Axes::from_bits(0b011);
        assert_eq!(
            said(&mut |p| p.configure(Wiring {
                pulse_us: 4,
                invert_directions: Axes::from_bits(2),
                ..Wiring::default()
            })),
            "xs0 ys0"
        );
        assert_eq!(said(&mut |p| p.enable_motors(true)), "en0");
        assert_eq!(said(&mut |p| p.set_directions(both)), "xd1 yd0");
        assert_eq!(said(&mut |p| p.set_directions(Axes::NONE)), "xd0 yd1");
        assert_eq!(said(&mut |p| p.step(both)), "xs1 ys1 ns4000 xs0 ys0");
        assert_eq!(said(&mut |p| p.step(Axes::from_bits(0b101))), "xs1 ns4000 xs0");
        // 1 ms and 2 ms of 20 ms.
        assert_eq!(said(&mut |p| p.set_pen(Pen::Off)), "pwm2000");
        assert_eq!(said(&mut |p| p.set_pen(Pen::On { level: u16::MAX })), "pwm4000");
        assert_eq!(said(&mut |p| p.enable_motors(false)), "en1");
        let inverted = Wiring { invert_steps: Axes::from_bits(1), invert_enable: true, ..Wiring::default() };
        assert_eq!(said(&mut |p| p.configure(inverted)), "xs1 ys0");
        assert_eq!(said(&mut |p| p.step(both)), "xs0 ys1 ns0 xs1 ys0");
        assert_eq!(said(&mut |p| p.enable_motors(true)), "en1");
    }
}
