//! What moves the pen: a servo or a solenoid. A pen on the Z axis needs neither.

use core::convert::Infallible;

use embedded_hal::digital::OutputPin;
use embedded_hal::pwm::SetDutyCycle;

use crate::pen::Pen;

/// Moves the pen.
pub trait PenDriver {
    /// Takes the pen there at once, as far as it is concerned: slow changes come as many calls ([`crate::PenMotion`]).
    fn set(&mut self, pen: Pen);

    /// The pen has settled where it was told last (`$512`).
    fn settled(&mut self) {}
}

/// No pen, or one on the Z axis.
impl PenDriver for () {
    fn set(&mut self, _: Pen) {}
}

/// Widths of a hobby servo's pulse, in µs, and the frame they repeat in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Servo {
    /// Frame in µs; 20000 (50 Hz) for nearly every servo.
    pub frame_us: u16,
    /// Pulse for [`Pen::Off`], µs.
    pub rest_us: u16,
    /// Pulse for level 0, µs.
    pub low_us: u16,
    /// Pulse for level 65535, µs. May be below `low_us` for a servo that turns the other way.
    pub high_us: u16,
}

impl Default for Servo {
    fn default() -> Self {
        Self { frame_us: 20_000, rest_us: 1000, low_us: 1000, high_us: 2000 }
    }
}

impl Servo {
    /// Width of the pulse for `pen` in µs.
    #[must_use]
    pub fn pulse_us(&self, pen: Pen) -> u16 {
        match pen {
            Pen::Off => self.rest_us,
            Pen::On { level } => {
                let (low, high) = (i64::from(self.low_us), i64::from(self.high_us));
                // Between low and high, both u16.
                (low + (high - low) * i64::from(level) / i64::from(u16::MAX)) as u16
            }
        }
    }
}

/// A servo on a PWM channel, whose period is the servo's frame.
#[derive(Debug)]
pub struct ServoPen<P> {
    /// The channel.
    pub pwm: P,
    /// Pulse widths.
    pub servo: Servo,
}

impl<P: SetDutyCycle<Error = Infallible>> PenDriver for ServoPen<P> {
    fn set(&mut self, pen: Pen) {
        let frame = self.servo.frame_us.max(1);
        let Ok(()) = self.pwm.set_duty_cycle_fraction(self.servo.pulse_us(pen).min(frame), frame);
    }
}

/// Whether a solenoid is to pull: from half the level on.
fn pulls(pen: Pen) -> bool {
    matches!(pen, Pen::On { level } if level > u16::MAX / 2)
}

/// A solenoid behind a transistor: high pulls.
#[derive(Debug)]
pub struct Solenoid<P> {
    /// The pin.
    pub pin: P,
}

impl<P: OutputPin<Error = Infallible>> PenDriver for Solenoid<P> {
    fn set(&mut self, pen: Pen) {
        let Ok(()) = self.pin.set_state(pulls(pen).into());
    }
}

/// A solenoid on a PWM channel, which gets full power until it has settled (`$512`), and then only what it takes to hold: it stays cool through a long stroke.
#[derive(Debug)]
pub struct HeldSolenoid<P> {
    /// The channel.
    pub pwm: P,
    /// Duty for holding, percent; 20 to 40 do for most. What is above 100 counts as 100.
    pub hold_percent: u8,
    pulls: bool,
}

impl<P> HeldSolenoid<P> {
    /// Not pulling.
    pub fn new(pwm: P, hold_percent: u8) -> Self {
        Self { pwm, hold_percent, pulls: false }
    }
}

impl<P: SetDutyCycle<Error = Infallible>> PenDriver for HeldSolenoid<P> {
    fn set(&mut self, pen: Pen) {
        let pulls = pulls(pen);
        // A level that changes while it holds needs no new pull.
        if pulls != self.pulls {
            self.pulls = pulls;
            let Ok(()) = if pulls { self.pwm.set_duty_cycle_fully_on() } else { self.pwm.set_duty_cycle_fully_off() };
        }
    }

    fn settled(&mut self) {
        if self.pulls {
            let Ok(()) = self.pwm.set_duty_cycle_percent(self.hold_percent.min(100));
        }
    }
}

#[cfg(test)]
mod tests {
    use core::cell::RefCell;
    use std::string::{String, ToString};
    use std::vec::Vec;

    use embedded_hal::{digital, pwm};

    use super::*;

    /// A wire that writes what happens to it into a log.
    struct Wire<'a>(&'a RefCell<Vec<String>>);

    impl digital::ErrorType for Wire<'_> {
        type Error = Infallible;
    }

    impl OutputPin for Wire<'_> {
        fn set_low(&mut self) -> Result<(), Infallible> {
            self.0.borrow_mut().push("low".to_string());
            Ok(())
        }

        fn set_high(&mut self) -> Result<(), Infallible> {
            self.0.borrow_mut().push("high".to_string());
            Ok(())
        }
    }

    impl pwm::ErrorType for Wire<'_> {
        type Error = Infallible;
    }

    impl SetDutyCycle for Wire<'_> {
        fn max_duty_cycle(&self) -> u16 {
            1000
        }

        fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
            self.0.borrow_mut().push(duty.to_string());
            Ok(())
        }
    }

    #[test]
    fn solenoids_pull_and_hold() {
        let log = RefCell::new(Vec::new());
        let on = |level| Pen::On { level };
        let mut plain = Solenoid { pin: Wire(&log) };
        for pen in [on(0), on(65_535), Pen::Off] {
            plain.set(pen);
            plain.settled();
        }
        assert_eq!(log.take(), ["low", "high", "low"]);
        let mut held = HeldSolenoid::new(Wire(&log), 30);
        for pen in [Pen::Off, on(40_000), on(65_535), Pen::Off] {
            held.set(pen);
            held.settled();
        }
        assert_eq!(log.take(), ["1000", "300", "300", "0"]);
    }

    #[test]
    fn servo_pulse_is_linear_either_way() {
        let mut servo = Servo::default();
        assert_eq!(servo.pulse_us(Pen::Off), 1000);
        assert_eq!(servo.pulse_us(Pen::On { level: 65535 }), 2000);
        servo.low_us = 2400;
        servo.high_us = 600;
        assert_eq!(servo.pulse_us(Pen::On { level: 0 }), 2400);
        assert_eq!(servo.pulse_us(Pen::On { level: 65535 }), 600);
    }
}
