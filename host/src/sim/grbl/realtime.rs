//! Characters that act the moment they arrive.

use super::{Grbl, Lock};

/// Bounds of the speed of feeds and of the spindle, in percent.
const PERCENT: std::ops::RangeInclusive<u32> = 10..=200;

impl Grbl {
    /// Obeys a real-time character. False when it is none.
    pub(super) fn realtime(&mut self, byte: u8) -> bool {
        match byte {
            b'?' if self.homing => self.status_wanted = true,
            b'?' => self.status(),
            b'~' => self.resume(),
            b'!' => self.hold(),
            0x18 => self.reset(),
            0x84 => {
                if self.lock == Lock::None && !self.check {
                    self.hold();
                    self.door = true;
                }
            }
            0x85 => self.cancel_jog(),
            0x90..=0x9d => self.set_override(byte),
            0x9e if self.motion.is_held() && !self.motion.is_moving() => {
                self.spindle_stopped = !self.spindle_stopped;
                self.set_pen();
            }
            // Coolant and what later versions use.
            0x80.. => {}
            _ => return false,
        }
        true
    }

    /// `!`: the motion comes to rest and can be resumed.
    pub(super) fn hold(&mut self) {
        if self.lock != Lock::None || self.check || self.homing {
            return;
        }
        if self.jogging {
            self.cancel_jog();
        } else {
            self.motion.hold();
        }
    }

    /// `~`.
    pub(super) fn resume(&mut self) {
        // While it brakes, GRBL does not hear it.
        if self.motion.is_held() && !self.motion.is_moving() && !self.jog_cancelled {
            self.door = false;
            self.spindle_stopped = false;
            self.set_pen();
            self.motion.resume();
        }
    }

    fn cancel_jog(&mut self) {
        if self.jogging {
            self.motion.hold();
            self.jog_cancelled = true;
        }
    }

    /// Ctrl-X.
    pub(super) fn reset(&mut self) {
        let homing = self.homing;
        let critical = self.lock == Lock::Critical;
        let moving = self.stop_dead();
        if moving && !critical {
            self.lock = Lock::Alarm;
            self.say(if homing { "ALARM:6\r\n" } else { "ALARM:3\r\n" });
        }
        self.greet();
    }

    fn set_override(&mut self, byte: u8) {
        let step = |percent: u32, coded: u8| match coded {
            0 => 100,
            1 => percent + 10,
            2 => percent.saturating_sub(10),
            3 => percent + 1,
            _ => percent.saturating_sub(1),
        };
        let [feed, rapid, spindle] = &mut self.overrides;
        match byte {
            0x90..=0x94 => *feed = step(*feed, byte - 0x90).clamp(*PERCENT.start(), *PERCENT.end()),
            0x95 => *rapid = 100,
            0x96 => *rapid = 50,
            0x97 => *rapid = 25,
            0x99..=0x9d => *spindle = step(*spindle, byte - 0x99).clamp(*PERCENT.start(), *PERCENT.end()),
            _ => return,
        }
        self.counters.overrides = 0;
        let factors = [self.overrides[0], self.overrides[1]].map(|percent| f64::from(percent) / 100.0);
        self.motion.set_factors(factors);
        self.set_pen();
    }
}
