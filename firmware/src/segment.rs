//! The segment generator: from planned blocks to short runs of equally spaced step events.
//!
//! A segment is a whole number of step events, about [`SLICE`] seconds long; its duration is the time in which the trapezoid covers
//! exactly that way, in closed form. So steps are never split, and no remainder has to be carried: what is left of a block is an integer.
//!
//! The trapezoid is not stored. At each segment it follows from the speed now, the way left and the exit speed, so a plan that has
//! changed, an override or a feed hold need no recomputation of anything else:
//!
//! ```text
//!   v² ▲      nominal²                 above the line exit² + 2·a·left:  decelerate, to land on exit² exactly
//!      │    _________                  below it and below nominal²:      accelerate, until either is met
//!      │   /         \                 on nominal²:                      cruise, until the line is met
//!      │  /           \ exit²          above nominal² (override):        decelerate to it
//!      └──┴────────────┴──▶ s
//! ```

use crate::planner::{Block, Planner};
use crate::stepper::{Command, Steps};

/// Aimed-at duration of a segment, s. Within a segment the speed is constant, so it changes in treads of acceleration × slice.
const SLICE: f32 = 0.0025;

/// One phase of the trapezoid at constant acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Phase {
    /// mm/s², signed.
    rate: f32,
    /// mm.
    length: f32,
    /// (mm/s)² at its end.
    end_sqr: f32,
}

/// What bounds the motion along the rest of a block.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    nominal_sqr: f32,
    exit_sqr: f32,
    acceleration: f32,
}

impl Bounds {
    /// The phase in which the machine is at `speed_sqr` with `left` mm (> 0) to go.
    fn phase(&self, speed_sqr: f32, left: f32) -> Phase {
        let a = self.acceleration;
        let brake_sqr = self.exit_sqr + 2.0 * a * left;
        if speed_sqr >= brake_sqr {
            // Equal but for rounding; the rate is what lands on the exit speed.
            Phase { rate: (self.exit_sqr - speed_sqr) / (2.0 * left), length: left, end_sqr: self.exit_sqr }
        } else if speed_sqr < self.nominal_sqr {
            let to_nominal = (self.nominal_sqr - speed_sqr) / (2.0 * a);
            let to_brake = (brake_sqr - speed_sqr) / (4.0 * a);
            if to_nominal <= to_brake {
                Phase {
                    rate: a,
                    length: to_nominal.min(left),
                    end_sqr: self.nominal_sqr.min(speed_sqr + 2.0 * a * left),
                }
            } else if to_brake >= left {
                // The exit speed is out of reach: accelerate to the end.
                Phase { rate: a, length: left, end_sqr: speed_sqr + 2.0 * a * left }
            } else {
                Phase { rate: a, length: to_brake, end_sqr: speed_sqr + 2.0 * a * to_brake }
            }
        } else if speed_sqr > self.nominal_sqr {
            let to_nominal = (speed_sqr - self.nominal_sqr) / (2.0 * a);
            if to_nominal <= left {
                Phase { rate: -a, length: to_nominal, end_sqr: self.nominal_sqr }
            } else {
                Phase { rate: -a, length: left, end_sqr: speed_sqr - 2.0 * a * left }
            }
        } else {
            let cruise = left - (speed_sqr - self.exit_sqr).max(0.0) / (2.0 * a);
            Phase { rate: 0.0, length: cruise.clamp(0.0, left), end_sqr: speed_sqr }
        }
    }

    /// Moves `way` of the `left` mm on: the square of the speed there, and the seconds it takes.
    fn travel(&self, mut speed_sqr: f32, mut left: f32, mut way: f32) -> (f32, f32) {
        let mut seconds = 0.0;
        // Accelerate, cruise and brake, and as many again for phases of no length that rounding leaves between them.
        for _ in 0..6 {
            if way <= 0.0 || left <= 0.0 {
                return (speed_sqr, seconds);
            }
            let phase = self.phase(speed_sqr, left);
            let (length, end_sqr) = if way < phase.length {
                (way, (speed_sqr + 2.0 * phase.rate * way).max(0.0))
            } else {
                (phase.length, phase.end_sqr)
            };
            seconds += self.time(speed_sqr, end_sqr, length);
            speed_sqr = end_sqr;
            way -= length;
            left -= length;
        }
        (speed_sqr, seconds + self.time(speed_sqr, speed_sqr, way))
    }

    /// Seconds for `length` mm at constant acceleration between the two speeds. Both are zero only where rounding has eaten a way shorter than f32 resolves; that takes as long as from rest.
    fn time(&self, from_sqr: f32, to_sqr: f32, length: f32) -> f32 {
        if length <= 0.0 {
            return 0.0;
        }
        let sum = libm::sqrtf(from_sqr) + libm::sqrtf(to_sqr);
        if sum > 0.0 { 2.0 * length / sum } else { libm::sqrtf(2.0 * length / self.acceleration) }
    }
}

impl<const BLOCKS: usize> Planner<BLOCKS> {
    /// The next segment, or `None` when there is nothing to do: no block, or, with `hold`, the machine has come to rest.
    ///
    /// Cost: about 60 f32 operations and at most 16 square roots and divisions.
    pub(crate) fn next_segment(&mut self, hold: bool) -> Option<Command> {
        if hold && self.speed_sqr == 0.0 {
            return None;
        }
        let first = self.current.is_none();
        if first {
            self.advance()?;
        }
        let exit_sqr = self.exit_sqr();
        let overrides = self.overrides();
        let speed_sqr = self.speed_sqr;
        let current = self.current.as_mut()?;
        let block = &current.block;
        let nominal = block.nominal(overrides);
        let left = block.mm_per_event * current.left as f32;
        let bounds = Bounds { nominal_sqr: nominal * nominal, exit_sqr, acceleration: block.acceleration };

        let (events, (end_sqr, seconds)) = if hold {
            // The phase that must land on the exit speed may be steeper by its rounding.
            let rate = block.acceleration.max((speed_sqr - exit_sqr) / (2.0 * left));
            let events = slice(block, current.left, speed_sqr, -rate)
                .min((speed_sqr / (2.0 * rate) / block.mm_per_event) as u32);
            if events == 0 {
                // The rest of the way to a stop is less than a step. A block that has not begun stays current with all its events.
                self.speed_sqr = 0.0;
                if first {
                    self.put_back();
                }
                return None;
            }
            let way = block.mm_per_event * events as f32;
            let end_sqr = (speed_sqr - 2.0 * rate * way).max(0.0);
            (events, (end_sqr, bounds.time(speed_sqr, end_sqr, way)))
        } else {
            let rate = bounds.phase(speed_sqr, left).rate;
            let events = slice(block, current.left, speed_sqr, rate);
            let way = if events == current.left { left } else { block.mm_per_event * events as f32 };
            (events, bounds.travel(speed_sqr, left, way))
        };
        let segment = Steps {
            steps: block.steps,
            events_of_block: block.events,
            negative: block.negative,
            first,
            events: events as u16,
            period: period(seconds, events),
            pen: if first { block.pen } else { None },
        };
        self.speed_sqr = end_sqr;
        current.left -= events;
        if current.left == 0 {
            self.finish_current();
        }
        Some(Command::Steps(segment))
    }
}

/// Step events that take about [`SLICE`] from `speed_sqr` at `rate` (signed): at least 1, at most `left` and what a segment counts.
fn slice(block: &Block, left: u32, speed_sqr: f32, rate: f32) -> u32 {
    let v = libm::sqrtf(speed_sqr);
    let way = (v + (v + rate * SLICE).max(0.0)) * (SLICE / 2.0);
    ((way / block.mm_per_event) as u32).clamp(1, left.min(u32::from(u16::MAX)))
}

/// 256ths of a µs between events, rounded to nearest.
fn period(seconds: f32, events: u32) -> u64 {
    // In f64: 24 bits would be off by a tick a second.
    libm::round(f64::from(seconds) / f64::from(events) * 256e6) as u64
}
