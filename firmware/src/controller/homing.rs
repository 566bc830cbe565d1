//! The homing cycle: finds the home switches, and with them where the machine is.
//!
//! ```text
//!            seek $25                 locate $24
//!  start ─────────────────▶┃        ┌──────────▶┃
//!                          ┃◀───────┘   ◀───────┃     position := home
//!                  switch  ┃  pull off $27      ┃  pull off $27
//! ```
//!
//! The axes of `$44` home one after the other, Z first (which lifts a pen on it), then X, then Y. A switch that closes stops the motion with deceleration, so that no
//! step is lost; the place where it closed is kept, and the pull-off is measured from there. The overrun is v²/(2·a) and what is queued at the stepper, some 30 ms: 1.1 mm
//! for 1500 mm/min and 1000 mm/s². After each motion the machine rests for `$26` ms.
//!
//! Guarantees:
//! 1. Each motion is bounded: the seek by one and a half times the travel, the location by five times the pull-off. A switch that is not found there is ALARM:9.
//! 2. A switch that is still closed after a pull-off is ALARM:8, so the next motion never starts on a switch that is stuck.
//! 3. The pen is up from beginning to end, and the position is only changed when the axis has been located.

use embedded_storage::nor_flash::NorFlash;

use super::{Controller, Job, Mode, Progress};
use crate::axis::{AXES, Axes};
use crate::error::Alarm;
use crate::gcode::{Speed, Spindle};
use crate::pen::Pen;
use crate::planner::Overrides;
use crate::stepper::{Command, StepSink};

/// The seek goes so many travels, as GRBL's.
const SEEK_TRAVELS: f64 = 1.5;

/// The location goes so many pull-offs, as GRBL's.
const LOCATE_PULL_OFFS: f64 = 5.0;

/// Axes in the order in which they home.
const ORDER: [usize; AXES] = [2, 0, 1];

/// The homing cycle at work.
#[derive(Clone, Copy, Debug)]
pub(super) struct Homing {
    /// Axes that are still to be homed, the one at work among them.
    left: Axes,
    phase: Phase,
    /// Start-up lines follow: `$H` without an axis.
    pub(super) whole: bool,
    /// No line waits for its answer: HPGL's `IN`.
    pub(super) silent: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    /// The next axis begins.
    Begin,
    /// Towards the switch; `closed` is where it closed, mm, once it has.
    Approach { axis: usize, locating: bool, closed: Option<f64> },
    /// Away from the switch.
    PullOff { axis: usize, located: bool },
    /// Standing still for a while after a pull-off.
    Rest { axis: usize, located: bool },
}

impl Homing {
    pub(super) fn new(axes: Axes, whole: bool) -> Self {
        Self { left: axes, phase: Phase::Begin, whole, silent: false }
    }

    /// That is not answered.
    pub(super) fn silent(axes: Axes) -> Self {
        Self { silent: true, ..Self::new(axes, false) }
    }
}

impl<const BLOCKS: usize, F: NorFlash> Controller<BLOCKS, F> {
    /// Axes whose limit switch is closed, by `$5`.
    pub(super) fn limits(&self, stepper: &mut impl StepSink) -> Axes {
        let low = stepper.limits();
        if self.stored.settings.invert_limits { Axes::from_bits(!low.bits()) } else { low }
    }

    /// Goes on with the cycle.
    pub(super) fn home(&mut self, homing: &mut Homing, stepper: &mut impl StepSink) -> Progress {
        if self.hold.is_door() {
            self.homing_failed(Alarm::HomingDoor, stepper);
            return Progress::Waiting;
        }
        match homing.phase {
            Phase::Begin => self.home_next(homing, stepper),
            Phase::Approach { axis, locating, closed } => self.approach(homing, axis, locating, closed, stepper),
            Phase::PullOff { axis, located } => {
                if !self.is_still(stepper) || !stepper.push(Command::Dwell(self.home_rest())) {
                    return Progress::Waiting;
                }
                homing.phase = Phase::Rest { axis, located };
                Progress::Moved
            }
            Phase::Rest { axis, located } => {
                if !stepper.is_idle() {
                    return Progress::Waiting;
                }
                if self.limits(stepper).contains(axis) {
                    self.homing_failed(Alarm::HomingPullOff, stepper);
                    return Progress::Waiting;
                }
                if located {
                    self.call_here(axis, self.stored.settings.home(axis), stepper);
                    homing.left = Axes::from_bits(homing.left.bits() & !(1 << axis));
                    homing.phase = Phase::Begin;
                } else {
                    self.begin_approach(homing, axis, true, stepper);
                }
                Progress::Moved
            }
        }
    }

    fn home_rest(&self) -> u32 {
        u32::from(self.stored.settings.home_debounce) * 1000
    }

    /// 1 or −1: towards the switch.
    fn home_sign(&self, axis: usize) -> f64 {
        if self.stored.settings.homes_down(axis) { -1.0 } else { 1.0 }
    }

    fn home_next(&mut self, homing: &mut Homing, stepper: &mut impl StepSink) -> Progress {
        if !self.is_still(stepper) {
            return Progress::Waiting;
        }
        if self.pen != Pen::Off {
            self.gcode.spindle = Spindle::Off;
            return if self.hand_pen(Pen::Off, stepper) { Progress::Moved } else { Progress::Waiting };
        }
        let Some(axis) = ORDER.into_iter().find(|axis| homing.left.contains(*axis)) else {
            self.mode = Mode::Normal;
            self.offset_report = 0;
            return Progress::Done;
        };
        // Percentages are for drawings.
        self.planner.set_overrides(Overrides::default());
        self.begin_approach(homing, axis, false, stepper);
        Progress::Moved
    }

    fn begin_approach(&mut self, homing: &mut Homing, axis: usize, locating: bool, stepper: &mut impl StepSink) {
        let settings = &self.stored.settings;
        let (way, feed) = if locating {
            (LOCATE_PULL_OFFS * settings.home_pull_off, settings.home_feed)
        } else {
            (SEEK_TRAVELS * settings.travel[axis], settings.home_seek)
        };
        homing.phase = Phase::Approach { axis, locating, closed: None };
        // One that is closed already needs no motion.
        if !self.limits(stepper).contains(axis) {
            self.move_axis(axis, self.gcode.position[axis] + self.home_sign(axis) * way, feed, stepper);
        }
    }

    /// Plans a motion of one axis to `mm`, whatever the soft limits.
    fn move_axis(&mut self, axis: usize, mm: f64, feed: f64, stepper: &impl StepSink) {
        self.sync_position(stepper);
        let mut target = self.gcode.position;
        target[axis] = mm;
        self.append(target, Speed::Feed(feed));
    }

    fn approach(
        &mut self,
        homing: &mut Homing,
        axis: usize,
        locating: bool,
        closed: Option<f64>,
        stepper: &mut impl StepSink,
    ) -> Progress {
        let Some(closed) = closed else {
            if self.limits(stepper).contains(axis) {
                let closed = Some(self.stored.settings.pen(stepper.position().map(f64::from))[axis]);
                homing.phase = Phase::Approach { axis, locating, closed };
                return Progress::Moved;
            }
            if self.is_still(stepper) {
                self.homing_failed(Alarm::HomingNotFound, stepper);
            }
            return Progress::Waiting;
        };
        if !self.brake(stepper) {
            return Progress::Waiting;
        }
        let settings = &self.stored.settings;
        let (away, feed) = (closed - self.home_sign(axis) * settings.home_pull_off, settings.home_seek);
        self.move_axis(axis, away, feed, stepper);
        homing.phase = Phase::PullOff { axis, located: locating };
        Progress::Moved
    }

    /// Calls the place where `axis` stands `mm`.
    fn call_here(&mut self, axis: usize, mm: f64, stepper: &mut impl StepSink) {
        let settings = &self.stored.settings;
        let mut here = settings.pen(stepper.position().map(f64::from));
        here[axis] = mm;
        stepper.set_position(settings.steps(here));
        self.sync_position(stepper);
    }

    /// Stops at once, and starts anew as after a reset.
    fn homing_failed(&mut self, alarm: Alarm, stepper: &mut impl StepSink) {
        self.stop_at_once(stepper);
        self.job = Job::None;
        self.mode = Mode::Alarm;
        self.tell_alarm(alarm);
        self.reset = true;
    }
}
