//! Motors whose signals are pins of one port, driven by a store to its registers.

use crate::axis::{AXES, Axes};
use crate::hal::{Hardware, Wiring};
use crate::pen::Pen;

/// Pins that change at once: bits of a port's registers, none in both.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Levels {
    /// Pins that become high.
    pub high: u32,
    /// Pins that become low.
    pub low: u32,
}

/// Which pin is what, as bits of the registers, of X, Y and Z.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PortPins {
    /// Step signals: a step is the rising edge, unless `$2` inverts it.
    pub step: [u32; AXES],
    /// Direction signals: high goes down, unless `$3` inverts it.
    pub direction: [u32; AXES],
    /// The enable signal of all drivers: low energises, unless `$4` inverts it.
    pub enable: u32,
    /// Limit switches, of the port that is read: low is closed, unless `$5` inverts it.
    pub limit: [u32; AXES],
}

/// A board's port, and what moves its pen.
pub trait Port {
    /// Ticks of the step timer in a µs: see [`Hardware::TICKS_PER_US`].
    const TICKS_PER_US: u32 = 1;

    /// Whether the hardware ends step pulses by itself; else a second tick does: see [`Hardware::TICK_ENDS_PULSE`].
    const ENDS_PULSES: bool = false;

    /// Which pin is what.
    const PINS: PortPins;

    /// Levels as the registers take them, worked out before they are wanted.
    type Word: Copy;

    /// Works them out.
    fn word(levels: Levels) -> Self::Word;

    /// Changes these pins and no others.
    fn drive(&mut self, word: Self::Word);

    /// The levels of the port that the limit switches are at.
    fn levels(&mut self) -> u32;

    /// The pen's new state: see [`Hardware::set_pen`].
    fn set_pen(&mut self, pen: Pen);

    /// The pen has settled: see [`Hardware::pen_settled`].
    fn pen_settled(&mut self) {}

    /// The levels that release the motors from now on, for who must do it when nothing else works any more.
    fn note_release(&mut self, levels: Levels) {
        let _ = levels;
    }
}

/// [`Hardware`] over a [`Port`]. A step is one load from a table of the eight sets of axes, and what [`Port::drive`] does.
#[derive(Debug)]
pub struct PortMotors<P: Port> {
    port: P,
    /// The active edges of each set of axes, and the idle levels of all.
    steps: [P::Word; 8],
    idle: P::Word,
    wiring: Wiring,
    negative: Axes,
    on: bool,
}

/// The bits of `axes` among `pins`.
fn bits(pins: [u32; AXES], axes: Axes) -> u32 {
    pins.into_iter().enumerate().filter(|(axis, _)| axes.contains(*axis)).fold(0, |word, (_, pin)| word | pin)
}

/// Those of `axes` high that are in `high`, the others low.
fn levels(pins: [u32; AXES], axes: Axes, high: Axes) -> Levels {
    Levels { high: bits(pins, axes.and(high)), low: bits(pins, axes.without(high)) }
}

/// All axes.
const ALL: Axes = Axes::from_bits(0b111);

impl<P: Port> PortMotors<P> {
    /// Motors at rest. The pins are outputs and inputs already; their levels are set with the first [`Hardware::configure`].
    pub fn new(port: P) -> Self {
        let nothing = P::word(Levels::default());
        Self { port, steps: [nothing; 8], idle: nothing, wiring: Wiring::default(), negative: Axes::NONE, on: false }
    }

    /// The level of the enable signal with the motors `on` or not.
    fn enabling(&self, on: bool) -> Levels {
        let pin = P::PINS.enable;
        if on == self.wiring.invert_enable { Levels { high: pin, low: 0 } } else { Levels { high: 0, low: pin } }
    }
}

impl<P: Port> Hardware for PortMotors<P> {
    const TICKS_PER_US: u32 = P::TICKS_PER_US;
    const TICK_ENDS_PULSE: bool = !P::ENDS_PULSES;

    fn set_directions(&mut self, negative: Axes) {
        self.negative = negative;
        let high = Axes::from_bits(negative.bits() ^ self.wiring.invert_directions.bits());
        self.port.drive(P::word(levels(P::PINS.direction, ALL, high)));
    }

    #[inline]
    fn step(&mut self, axes: Axes) {
        self.port.drive(self.steps[usize::from(axes.bits() & 7)]);
    }

    #[inline]
    fn end_step(&mut self) {
        self.port.drive(self.idle);
    }

    fn set_pen(&mut self, pen: Pen) {
        self.port.set_pen(pen);
    }

    fn pen_settled(&mut self) {
        self.port.pen_settled();
    }

    fn enable_motors(&mut self, on: bool) {
        self.on = on;
        self.port.drive(P::word(self.enabling(on)));
    }

    fn limits(&mut self) -> Axes {
        let high = self.port.levels();
        let mut low = Axes::NONE;
        for (axis, pin) in P::PINS.limit.into_iter().enumerate() {
            if high & pin == 0 {
                low.insert(axis);
            }
        }
        low
    }

    fn configure(&mut self, wiring: Wiring) {
        self.wiring = wiring;
        let active_high = ALL.without(wiring.invert_steps);
        for (axes, word) in (0..8).map(Axes::from_bits).zip(&mut self.steps) {
            *word = P::word(levels(P::PINS.step, axes, active_high));
        }
        self.idle = P::word(levels(P::PINS.step, ALL, wiring.invert_steps));
        self.port.note_release(self.enabling(false));
        // What has been inverted shows at once.
        self.port.drive(self.idle);
        self.set_directions(self.negative);
        self.enable_motors(self.on);
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    /// Pins as they are, and what was done to those of the steps.
    #[derive(Default)]
    struct Pins {
        levels: u32,
        edges: Vec<u32>,
        switches: u32,
        release: Levels,
    }

    impl Port for Pins {
        const PINS: PortPins =
            PortPins { step: [1, 2, 4], direction: [0x10, 0x20, 0x40], enable: 0x100, limit: [1, 2, 4] };
        type Word = Levels;

        fn word(levels: Levels) -> Levels {
            assert_eq!(levels.high & levels.low, 0);
            levels
        }

        fn drive(&mut self, word: Levels) {
            let before = self.levels;
            self.levels = (before | word.high) & !word.low;
            if (before ^ self.levels) & 7 != 0 {
                self.edges.push(self.levels & 7);
            }
        }

        fn levels(&mut self) -> u32 {
            self.switches
        }

        fn set_pen(&mut self, _: Pen) {}

        fn note_release(&mut self, levels: Levels) {
            self.release = levels;
        }
    }

    fn motors(wiring: Wiring) -> PortMotors<Pins> {
        let mut motors = PortMotors::new(Pins::default());
        motors.configure(wiring);
        motors.port.edges.clear();
        motors
    }

    #[test]
    fn signals_are_those_of_the_wiring() {
        let mut motors = motors(Wiring::default());
        assert_eq!(motors.port.levels, 0x100, "released");
        motors.enable_motors(true);
        motors.set_directions(Axes::from_bits(0b010));
        assert_eq!(motors.port.levels, 0x20);
        motors.step(Axes::from_bits(0b101));
        motors.end_step();
        assert_eq!(motors.port.edges, [0b101, 0]);
        assert_eq!(motors.port.levels, 0x20, "and nothing else has changed");
        assert_eq!(motors.port.release, Levels { high: 0x100, low: 0 });
    }

    #[test]
    fn inverted_signals_are_inverted_at_once_and_for_ever() {
        let mut motors = motors(Wiring::default());
        motors.enable_motors(true);
        motors.set_directions(Axes::from_bits(0b001));
        motors.configure(Wiring {
            invert_steps: Axes::from_bits(0b011),
            invert_directions: Axes::from_bits(0b101),
            invert_enable: true,
            ..Wiring::default()
        });
        assert_eq!(motors.port.levels, 0x100 | 0x40 | 0b011, "energised, X down, Z up, X and Y idle high");
        motors.port.edges.clear();
        motors.step(Axes::from_bits(0b101));
        motors.end_step();
        assert_eq!(motors.port.edges, [0b110, 0b011]);
        motors.enable_motors(false);
        assert_eq!(motors.port.levels & 0x100, 0);
        assert_eq!(motors.port.release, Levels { high: 0, low: 0x100 });
    }

    #[test]
    fn a_switch_that_is_low_is_told() {
        let mut motors = motors(Wiring::default());
        motors.port.switches = 0b101;
        assert_eq!(motors.limits(), Axes::from_bits(0b010));
    }
}
