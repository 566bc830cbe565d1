//! Feed hold, the safety door, and the pen meanwhile.
//!
//! ```text
//!  !, M0, 0x84            at rest             ~                        pen is down
//!  ────────▶ stopping ──────────▶ held ─────────────▶ pen goes down ────────▶ motion goes on
//!                     pen goes up, if parked
//! ```
//!
//! The pen is parked with `$41=1`, when the door is open, and always after an alarm. A held motion keeps its blocks and its position.

use embedded_storage::nor_flash::NorFlash;

use super::{Controller, Mode};
use crate::gcode::PenOrder;
use crate::pen::Pen;
use crate::stepper::StepSink;

/// Whether the machine is held, and what becomes of the pen.
#[derive(Debug, Default)]
pub(super) struct Hold {
    on: bool,
    door: bool,
    /// `~` has come.
    resuming: bool,
    /// It has come to rest, and the pen has been parked if it was to be.
    rested: bool,
    /// The pen that was lifted, and goes down before the motion goes on.
    lifted: Option<Pen>,
    /// 0x9E has come.
    toggle: bool,
}

impl Hold {
    pub(super) fn begin(&mut self) {
        self.on = true;
        self.resuming = false;
    }

    pub(super) fn open_door(&mut self) {
        self.begin();
        self.door = true;
    }

    /// `~`: goes on as soon as the pen is where it was.
    pub(super) fn resume(&mut self) {
        self.resuming = self.on;
    }

    pub(super) fn toggle_pen(&mut self) {
        self.toggle = self.on;
    }

    pub(super) fn is_on(&self) -> bool {
        self.on
    }

    pub(super) fn is_door(&self) -> bool {
        self.on && self.door
    }
}

impl<const BLOCKS: usize, F: NorFlash> Controller<BLOCKS, F> {
    /// What `order` comes to with the override.
    pub(super) fn pen_of(&self, order: PenOrder) -> Pen {
        match order {
            PenOrder::Off => Pen::Off,
            PenOrder::Speed(s) => Pen::from_speed(s * f64::from(self.pen_override) / 100.0, &self.stored.settings),
        }
    }

    /// Lifts the pen of a machine that is held, puts it down again, and lets it follow its override.
    pub(super) fn mind_pen(&mut self, stepper: &mut impl StepSink) {
        if self.pen_due {
            self.override_pen(stepper);
        }
        if !self.hold.on {
            return;
        }
        if !self.hold.rested && self.is_at_rest(stepper) {
            let park = self.stored.settings.parking || self.hold.door || self.mode == Mode::NeedsReset;
            if !park || self.lift(stepper) {
                self.hold.rested = true;
            }
        }
        if self.hold.toggle && self.hold.rested && self.is_at_rest(stepper) {
            let done = if self.hold.lifted.is_some() { self.lower(stepper) } else { self.lift(stepper) };
            self.hold.toggle = !done;
        }
        if self.hold.resuming && self.lower(stepper) {
            self.hold = Hold::default();
        }
    }

    /// Lifts the pen; false when the stepper has no room.
    fn lift(&mut self, stepper: &mut impl StepSink) -> bool {
        let pen = self.pen;
        if pen == Pen::Off {
            return true;
        }
        let done = self.hand_pen(Pen::Off, stepper);
        if done {
            self.hold.lifted = Some(pen);
        }
        done
    }

    /// Puts the pen down again if it was lifted; false when the stepper has no room.
    fn lower(&mut self, stepper: &mut impl StepSink) -> bool {
        let Some(pen) = self.hold.lifted else { return true };
        let done = self.hand_pen(pen, stepper);
        if done {
            self.hold.lifted = None;
        }
        done
    }

    /// A pen that is on takes its new level at once, whether the machine moves or is held. In laser mode levels ride with the motion, and the next follows.
    fn override_pen(&mut self, stepper: &mut impl StepSink) {
        let pen = self.pen_of(PenOrder::Speed(self.pen_speed));
        if let Some(lifted) = &mut self.hold.lifted {
            *lifted = pen;
        } else if self.pen != Pen::Off && !self.stored.settings.laser_mode && !self.hand_pen(pen, stepper) {
            return;
        }
        self.pen_due = false;
    }
}
