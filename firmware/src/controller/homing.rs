//! The homing cycle: finds the home switches, and with them where the machine is.
//!
//! ```text
//!            seek $25                 locate $24
//!  start ─────────────────▶┃        ┌──────────▶┃
//!                          ┃◀───────┘   ◀───────┃     position := home
//!                  switch  ┃  pull off $27      ┃  pull off $27
//! ```
//!
//! The axes of `$44` home in two cycles, as GRBL's do: Z, which lifts a pen on it, then X and Y together, each as fast as the feed says. A switch that closes stops the motion with
//! deceleration, so that no step is lost, and the axes whose switches are still open go on by themselves; where each closed is kept, and the pull-off is measured from there. The
//! overrun is v²/(2·a) and what is queued at the stepper, some 30 ms: 1.1 mm for 1500 mm/min and 1000 mm/s². After each pull-off the machine rests for `$26` ms.
//!
//! Guarantees:
//! 1. Each axis' way is bounded: the seek by one and a half times its travel, the location by five times the pull-off. A switch that is not found there is ALARM:9.
//! 2. A switch that is still closed after a pull-off is ALARM:8, so the next motion never starts on a switch that is stuck.
//! 3. The pen is up from beginning to end, and the position is only changed when the axes of the cycle have been located.

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

/// Axes that home together, in the order in which they do.
const CYCLES: [Axes; 2] = [Axes::from_bits(0b100), Axes::from_bits(0b011)];

/// The homing cycle at work.
#[derive(Clone, Copy, Debug)]
pub(super) struct Homing {
    /// Axes that are still to be homed, those at work among them.
    left: Axes,
    /// Those at work.
    axes: Axes,
    phase: Phase,
    /// Start-up lines follow: `$H` without an axis.
    pub(super) whole: bool,
    /// No line waits for its answer: HPGL's `IN`.
    pub(super) silent: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Phase {
    /// The next cycle begins.
    Begin,
    /// Towards the switches.
    Approach(Approach),
    /// Away from the switches.
    PullOff { located: bool },
    /// Standing still for a while after a pull-off.
    Rest { located: bool },
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Approach {
    locating: bool,
    /// Where each axis gives up, mm.
    bound: [f64; AXES],
    /// Where its switch closed, mm, once it has.
    closed: [Option<f64>; AXES],
    /// A switch has closed, or is closed from the start: the motion ends, and the axes that are left begin another.
    stopping: bool,
}

impl Homing {
    pub(super) fn new(axes: Axes, whole: bool) -> Self {
        Self { left: axes, axes: Axes::NONE, phase: Phase::Begin, whole, silent: false }
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
            Phase::Approach(approach) => self.approach(homing, approach, stepper),
            Phase::PullOff { located } => {
                if !self.is_still(stepper) || !stepper.push(Command::Dwell(self.home_rest())) {
                    return Progress::Waiting;
                }
                homing.phase = Phase::Rest { located };
                Progress::Moved
            }
            Phase::Rest { located } => {
                if !stepper.is_idle() {
                    return Progress::Waiting;
                }
                if !self.limits(stepper).and(homing.axes).is_empty() {
                    self.homing_failed(Alarm::HomingPullOff, stepper);
                    return Progress::Waiting;
                }
                if located {
                    self.call_home(homing.axes, stepper);
                    homing.left = homing.left.without(homing.axes);
                    homing.phase = Phase::Begin;
                } else {
                    homing.phase = self.begin_approach(homing.axes, true);
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
        let Some(axes) = CYCLES.into_iter().map(|axes| axes.and(homing.left)).find(|axes| !axes.is_empty()) else {
            self.mode = Mode::Normal;
            self.offset_report = 0;
            return Progress::Done;
        };
        // Percentages are for drawings.
        self.planner.set_overrides(Overrides::default());
        homing.axes = axes;
        homing.phase = self.begin_approach(axes, false);
        Progress::Moved
    }

    fn begin_approach(&mut self, axes: Axes, locating: bool) -> Phase {
        let settings = &self.stored.settings;
        let mut bound = self.gcode.position;
        for axis in (0..AXES).filter(|axis| axes.contains(*axis)) {
            let way =
                if locating { LOCATE_PULL_OFFS * settings.home_pull_off } else { SEEK_TRAVELS * settings.travel[axis] };
            bound[axis] += self.home_sign(axis) * way;
        }
        // Nothing moves yet: the first look is for switches that are closed already.
        Phase::Approach(Approach { locating, bound, closed: [None; AXES], stopping: true })
    }

    /// Plans a straight motion, whatever the soft limits. The machine stands.
    fn move_to(&mut self, target: [f64; AXES], feed: f64, stepper: &impl StepSink) {
        self.sync_position(stepper);
        self.append(target, Speed::Feed(feed));
    }

    fn approach(&mut self, homing: &mut Homing, mut approach: Approach, stepper: &mut impl StepSink) -> Progress {
        let limits = self.limits(stepper).and(homing.axes);
        let here = self.stored.settings.pen(stepper.position().map(f64::from));
        for axis in (0..AXES).filter(|axis| limits.contains(*axis)) {
            if approach.closed[axis].is_none() {
                approach.closed[axis] = Some(here[axis]);
                approach.stopping = true;
            }
        }
        homing.phase = Phase::Approach(approach);
        if !approach.stopping {
            if self.is_still(stepper) {
                self.homing_failed(Alarm::HomingNotFound, stepper);
            }
            return Progress::Waiting;
        }
        if !self.brake(stepper) {
            return Progress::Waiting;
        }
        approach.stopping = false;
        let settings = &self.stored.settings;
        let (pull_off, seek, locate) = (settings.home_pull_off, settings.home_seek, settings.home_feed);
        let mut target = self.gcode.position;
        let open = |axis: &usize| homing.axes.contains(*axis) && approach.closed[*axis].is_none();
        let count = (0..AXES).filter(open).count();
        if count > 0 {
            // All equally fast, until the first of them would be at its bound.
            let way = (0..AXES).filter(open).map(|axis| (approach.bound[axis] - target[axis]).abs());
            let way = way.fold(f64::INFINITY, f64::min);
            for axis in (0..AXES).filter(open) {
                target[axis] += self.home_sign(axis) * way;
            }
            homing.phase = Phase::Approach(approach);
            let feed = if approach.locating { locate } else { seek };
            self.move_to(target, feed * libm::sqrt(count as f64), stepper);
        } else {
            for (axis, closed) in approach.closed.into_iter().enumerate() {
                if let Some(closed) = closed {
                    target[axis] = closed - self.home_sign(axis) * pull_off;
                }
            }
            homing.phase = Phase::PullOff { located: approach.locating };
            self.move_to(target, seek, stepper);
        }
        Progress::Moved
    }

    /// Calls the place where `axes` stand their home.
    fn call_home(&mut self, axes: Axes, stepper: &mut impl StepSink) {
        let settings = &self.stored.settings;
        let mut here = settings.pen(stepper.position().map(f64::from));
        for axis in (0..AXES).filter(|axis| axes.contains(*axis)) {
            here[axis] = settings.home(axis);
        }
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
