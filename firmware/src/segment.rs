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
    /// The phases of the `left` mm (> 0) from `speed_sqr` on: to the nominal speed or what is reached of it, at it, and down to the exit
    /// speed. Phases that do not occur have no length; the lengths add up to `left` but for rounding.
    fn profile(&self, speed_sqr: f32, left: f32) -> [Phase; 3] {
        let a = self.acceleration;
        let none = Phase { rate: 0.0, length: 0.0, end_sqr: speed_sqr };
        let brake_sqr = self.exit_sqr + 2.0 * a * left;
        if speed_sqr >= brake_sqr {
            // Equal but for rounding; the rate is what lands on the exit speed.
            return [none, none, self.brake(speed_sqr, left)];
        }
        let first = if speed_sqr < self.nominal_sqr {
            let to_nominal = (self.nominal_sqr - speed_sqr) / (2.0 * a);
            // Where the rising line meets the falling one.
            let to_brake = (brake_sqr - speed_sqr) / (4.0 * a);
            let length = to_nominal.min(to_brake).min(left);
            let peak_sqr = speed_sqr + 2.0 * a * length;
            if to_nominal > to_brake || to_nominal >= left {
                let rest = left - length;
                return [Phase { rate: a, length, end_sqr: peak_sqr }, none, self.brake(peak_sqr, rest)];
            }
            Phase { rate: a, length, end_sqr: self.nominal_sqr }
        } else {
            let to_nominal = (speed_sqr - self.nominal_sqr) / (2.0 * a);
            if to_nominal >= left {
                return [Phase { rate: -a, length: left, end_sqr: speed_sqr - 2.0 * a * left }, none, none];
            }
            Phase { rate: -a, length: to_nominal, end_sqr: self.nominal_sqr }
        };
        let rest = left - first.length;
        let brake = ((self.nominal_sqr - self.exit_sqr).max(0.0) / (2.0 * a)).min(rest);
        let cruise = Phase { rate: 0.0, length: rest - brake, end_sqr: self.nominal_sqr };
        [first, cruise, self.brake(self.nominal_sqr, brake)]
    }

    /// From `speed_sqr` down to the exit speed in exactly `length` mm.
    fn brake(&self, speed_sqr: f32, length: f32) -> Phase {
        let rate = if length > 0.0 { (self.exit_sqr - speed_sqr) / (2.0 * length) } else { 0.0 };
        Phase { rate, length, end_sqr: self.exit_sqr }
    }

    /// Moves `way` mm along `profile`, which starts at `speed_sqr`: the square of the speed there, and the seconds it takes.
    fn travel(&self, profile: &[Phase; 3], mut speed_sqr: f32, mut way: f32) -> (f32, f32) {
        let mut seconds = 0.0;
        for phase in profile {
            if phase.length <= 0.0 {
                continue;
            }
            if way < phase.length {
                let end_sqr = (speed_sqr + 2.0 * phase.rate * way).max(0.0);
                return (end_sqr, seconds + self.time(speed_sqr, end_sqr, way));
            }
            seconds += self.time(speed_sqr, phase.end_sqr, phase.length);
            speed_sqr = phase.end_sqr;
            way -= phase.length;
        }
        (speed_sqr, seconds)
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
            let profile = bounds.profile(speed_sqr, left);
            let rate = profile.iter().find(|p| p.length > 0.0).map_or(0.0, |p| p.rate);
            let events = slice(block, current.left, speed_sqr, rate);
            let way = if events == current.left { left } else { block.mm_per_event * events as f32 };
            (events, bounds.travel(&profile, speed_sqr, way))
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

/// 2⁻¹⁶ µs between events, rounded to nearest.
fn period(seconds: f32, events: u32) -> u64 {
    // In f64: 24 bits would be off by a µs in 16 s.
    libm::round(f64::from(seconds) / f64::from(events) * 65_536e6) as u64
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use std::vec::Vec;

    use super::*;
    use crate::gcode::Speed;
    use crate::planner::Overrides;
    use crate::settings::Settings;

    const A: Bounds = Bounds { nominal_sqr: 10_000.0, exit_sqr: 0.0, acceleration: 1000.0 };

    #[test]
    fn travel_follows_the_closed_forms() {
        let close = |got: (f32, f32), speed: f32, seconds: f32| {
            assert!(
                (libm::sqrtf(got.0) - speed).abs() < 1e-2 && (got.1 - seconds).abs() < 1e-4,
                "{got:?}, not {speed}, {seconds}"
            );
        };
        let travel = |bounds: Bounds, from, left, way| bounds.travel(&bounds.profile(from, left), from, way);
        // 100 mm in one go: up, across, down; and the first half of it.
        close(travel(A, 0.0, 100.0, 100.0), 0.0, 1.1);
        close(travel(A, 0.0, 100.0, 50.0), 100.0, 0.55);
        // 4 mm never reach 100 mm/s: 2·√(4/1000) s, with √4000 mm/s in the middle.
        close(travel(A, 0.0, 4.0, 4.0), 0.0, 0.1265);
        close(travel(A, 0.0, 4.0, 2.0), 63.25, 0.0632);
        // An exit speed that cannot be reached.
        let fast = Bounds { exit_sqr: 9000.0, ..A };
        close(travel(fast, 0.0, 2.0, 2.0), 63.25, 0.0632);
        // Faster than nominal after an override: 100 to 50 mm/s over 3.75 mm, then on.
        let slow = Bounds { nominal_sqr: 2500.0, exit_sqr: 2500.0, ..A };
        close(travel(slow, 10_000.0, 8.75, 8.75), 50.0, 0.15);
        // From rest to rest over nothing.
        assert_eq!(travel(A, 0.0, 0.0, 0.0), (0.0, 0.0));
    }

    /// A generated segment as (mm, s, mm/s at its end).
    struct Run {
        segment: Steps,
        speed: f64,
        seconds: f64,
        end: f64,
        /// The machine has come to rest in a hold since the segment before.
        rested: bool,
        exit_planned: f64,
    }

    fn runs(
        planner: &mut Planner<8>,
        hold: bool,
        count: usize,
        settings: &Settings,
        out: &mut Vec<Run>,
        rested: &mut bool,
    ) {
        for _ in 0..count {
            let Some(command) = planner.next_segment(hold) else {
                *rested |= hold;
                return;
            };
            let Command::Steps(segment) = command else { panic!("only steps are planned") };
            let mm = |axis: usize| f64::from(segment.steps[axis]) / settings.steps_per_mm[axis];
            let length = libm::sqrt(mm(0) * mm(0) + mm(1) * mm(1) + mm(2) * mm(2));
            let seconds = segment.period as f64 / 65_536e6 * f64::from(segment.events);
            out.push(Run {
                segment,
                speed: length * f64::from(segment.events) / f64::from(segment.events_of_block) / seconds,
                seconds,
                end: f64::from(libm::sqrtf(planner.speed_sqr)),
                rested: core::mem::take(rested),
                exit_planned: f64::from(libm::sqrtf(planner.exit_sqr())),
            });
        }
    }

    /// Acceleration and highest speed along the block of a segment.
    fn limits(segment: &Steps, settings: &Settings) -> (f64, f64) {
        let mm = [0, 1, 2].map(|axis| f64::from(segment.steps[axis]) / settings.steps_per_mm[axis]);
        let length = libm::sqrt(mm.iter().map(|v| v * v).sum());
        let least = |limit: [f64; 3]| {
            (0..3).filter(|&a| mm[a] > 0.0).map(|a| limit[a] * length / mm[a]).fold(f64::INFINITY, f64::min)
        };
        (least(settings.acceleration), least(settings.max_rate) / 60.0)
    }

    proptest! {
        #[test]
        fn no_limit_is_exceeded_and_every_step_is_made(
            moves in prop::collection::vec((-20.0..20.0f64, -20.0..20.0f64, -2.0..2.0f64, 0..4u8, 30.0..12_000.0f64), 1..40),
            orders in prop::collection::vec((0..6usize, any::<bool>(), 10..=200u8, 0..4u8), 40),
        ) {
            let settings = Settings::default();
            let mut planner: Planner<8> = Planner::new();
            let (mut out, mut rested, mut at) = (Vec::new(), false, [0.0f64; 3]);
            for ((x, y, z, kind, feed), (count, hold, percent, change)) in moves.into_iter().zip(orders) {
                // Long and short, straight on and not.
                let scale = [1.0, 0.1, 0.01, 1.0][usize::from(kind)];
                let turn = if kind == 3 { [x.abs(), 0.0, 0.0] } else { [x, y, z] };
                at = [0, 1, 2].map(|a| at[a] + turn[a] * scale);
                while planner.is_full() {
                    runs(&mut planner, false, 1, &settings, &mut out, &mut rested);
                }
                let speed = if feed < 1000.0 { Speed::Rapid } else { Speed::Feed(feed) };
                planner.append(at, speed, None, 0, &settings);
                if change == 0 {
                    planner.set_overrides(Overrides { feed: percent, rapid: [25, 50, 100][usize::from(percent) % 3] });
                }
                runs(&mut planner, hold && change == 1, count, &settings, &mut out, &mut rested);
            }
            while !planner.is_empty() {
                runs(&mut planner, false, 1, &settings, &mut out, &mut rested);
            }
            prop_assert_eq!(planner.speed_sqr, 0.0);

            let mut position = [0i64; 3];
            for (i, run) in out.iter().enumerate() {
                let (acceleration, limit) = limits(&run.segment, &settings);
                prop_assert!(run.speed <= limit * 1.001, "{} mm/s of {}", run.speed, limit);
                let last = out.get(i + 1).is_none_or(|next| next.segment.first);
                if last {
                    // What the next block was planned to be entered with is never exceeded.
                    prop_assert!(run.end <= run.exit_planned * 1.001 + 1e-3, "{} into {}", run.end, run.exit_planned);
                    for (axis, at) in position.iter_mut().enumerate() {
                        let steps = i64::from(run.segment.steps[axis]);
                        *at += if run.segment.negative.contains(axis) { -steps } else { steps };
                    }
                }
                // The mean speeds of neighbours differ by at most the acceleration times the distance of their middles.
                if i > 0 && !run.rested {
                    let before = &out[i - 1];
                    let bound = acceleration.max(limits(&before.segment, &settings).0) * (run.seconds + before.seconds) / 2.0;
                    let change = (run.speed - before.speed).abs();
                    prop_assert!(change <= bound * 1.001 + 1e-3 * run.speed, "{}: {} of {}", i, change, bound);
                }
            }
            for axis in 0..3 {
                prop_assert_eq!(position[axis], libm::round(at[axis] * settings.steps_per_mm[axis]) as i64);
            }
        }
    }
}
