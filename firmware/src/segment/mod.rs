//! The segment generator: from planned blocks to short runs of equally spaced step events.
//!
//! A segment is a whole number of step events, about [`SLICE`] seconds long; its duration is the time in which the trapezoid covers
//! exactly that way, in closed form. So steps are never split, and no remainder has to be carried: what is left of a block is an integer.
//!
//! Along the way the speed is a [trapezoid](trapezoid) or, with `$140`–`$142`, an [S-curve](s_curve). Neither is stored: at each segment it follows from the state
//! now and from what is ahead, so a plan that has changed, an override or a feed hold need no recomputation of anything else.

mod s_curve;
mod trapezoid;

use s_curve::{Gate, Limits, State};
use trapezoid::Bounds;

use crate::planner::{Current, Planner};
use crate::stepper::{Command, Steps};

/// One segment: so many step events, the square of the speed and the acceleration at their end, and the seconds they take.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    events: u32,
    end_sqr: f32,
    acceleration: f32,
    seconds: f32,
}

impl Stretch {
    fn new(events: u32, end: State, seconds: f32) -> Self {
        Self { events, end_sqr: end.speed * end.speed, acceleration: end.acceleration, seconds }
    }
}

/// Aimed-at duration of a segment, s. Within a segment the speed is constant, so it changes in treads of acceleration × slice.
const SLICE: f32 = 0.0025;

impl<const BLOCKS: usize> Planner<BLOCKS> {
    /// The next segment, or `None` when there is nothing to do: no block, or, with `hold`, the machine has come to rest.
    ///
    /// Cost: about 60 f32 operations and at most 16 square roots and divisions along a trapezoid; of an S-curve see [`Limits::stretch`].
    pub(crate) fn next_segment(&mut self, hold: bool) -> Option<Command> {
        if hold && self.speed_sqr == 0.0 {
            return None;
        }
        let first = self.current.is_none();
        if first {
            self.advance()?;
        }
        let stretch = if self.current.as_ref()?.block.jerk > 0.0 { self.s_curve(hold)? } else { self.trapezoid(hold)? };
        let events = stretch.events;
        if events == 0 {
            // The rest of the way to a stop is less than a step. A block that has not begun stays current with all its events.
            self.speed_sqr = 0.0;
            self.acceleration = 0.0;
            if first {
                self.put_back();
            }
            return None;
        }
        let current = self.current.as_mut()?;
        let block = &current.block;
        let segment = Steps {
            steps: block.steps,
            events_of_block: block.events,
            negative: block.negative,
            first,
            events: events as u16,
            period: period(stretch.seconds, events),
            pen: if first { block.pen } else { None },
            line: block.line,
            lines: if events == current.left { block.lines } else { 0 },
        };
        (self.speed_sqr, self.acceleration) = (stretch.end_sqr, stretch.acceleration);
        current.left -= events;
        if current.left == 0 {
            self.finish_current();
        }
        Some(Command::Steps(segment))
    }

    /// The next stretch of the current block along its trapezoid. No events: the stop of a hold is less than a step away.
    fn trapezoid(&self, hold: bool) -> Option<Stretch> {
        let Current { block, left } = self.current.as_ref()?;
        let (exit_sqr, speed_sqr) = (self.exit_sqr(), self.speed_sqr);
        let nominal = block.nominal(self.overrides());
        let way_left = block.mm_per_event * *left as f32;
        let bounds = Bounds { nominal_sqr: nominal * nominal, exit_sqr, acceleration: block.acceleration };
        let speed = libm::sqrtf(speed_sqr);
        let (events, (end_sqr, seconds)) = if hold {
            // The phase that must land on the exit speed may be steeper by its rounding.
            let rate = block.acceleration.max((speed_sqr - exit_sqr) / (2.0 * way_left));
            let events = events_in(speed, -rate, block.mm_per_event, *left)
                .min((speed_sqr / (2.0 * rate) / block.mm_per_event) as u32);
            let way = block.mm_per_event * events as f32;
            let end_sqr = (speed_sqr - 2.0 * rate * way).max(0.0);
            (events, (end_sqr, bounds.time(speed_sqr, end_sqr, way)))
        } else {
            let profile = bounds.profile(speed_sqr, way_left);
            let rate = profile.iter().find(|p| p.length > 0.0).map_or(0.0, |p| p.rate);
            let events = events_in(speed, rate, block.mm_per_event, *left);
            let way = if events == *left { way_left } else { block.mm_per_event * events as f32 };
            (events, bounds.travel(&profile, speed_sqr, way))
        };
        Some(Stretch { events, end_sqr, acceleration: 0.0, seconds })
    }

    /// The next stretch of the current block along an S-curve. No events: the stop of a hold is less than a step away.
    fn s_curve(&self, hold: bool) -> Option<Stretch> {
        let Current { block, left } = self.current.as_ref()?;
        let limits = Limits { acceleration: block.acceleration, jerk: block.jerk };
        let from = State { speed: libm::sqrtf(self.speed_sqr), acceleration: self.acceleration };
        let gates = |events: u32| {
            let mut way = block.mm_per_event * (*left - events.min(*left)) as f32;
            self.ahead().map(move |(ceiling_sqr, length)| {
                let gate = Gate { way, ceiling_sqr };
                way += length;
                gate
            })
        };
        let mut stretch = if hold {
            limits.stopping(from, *left, block.mm_per_event, 0)
        } else {
            limits.stretch(from, block.nominal(self.overrides()), *left, block.mm_per_event, gates)
        };
        if stretch.events == *left && self.ahead().next().is_none_or(|(ceiling_sqr, _)| ceiling_sqr <= 0.0) {
            // A stop is met within half an event.
            (stretch.end_sqr, stretch.acceleration) = (0.0, 0.0);
        }
        Some(stretch)
    }
}

/// Step events of `mm` that take about [`SLICE`] from `speed` at `acceleration` (signed): at least 1, at most `left` and what a segment counts.
fn events_in(speed: f32, acceleration: f32, mm: f32, left: u32) -> u32 {
    let way = (speed + (speed + acceleration * SLICE).max(0.0)) * (SLICE / 2.0);
    ((way / mm) as u32).clamp(1, left.min(u32::from(u16::MAX)))
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

    /// As S-curves, with this jerk.
    fn smooth(jerk: f64) -> Settings {
        let mut settings = Settings::default();
        for id in 140..=142 {
            settings.set(id, jerk).unwrap();
        }
        settings
    }

    /// Time in s in which one line of `length` mm along X is drawn at 100 mm/s.
    fn time_of(length: f64, settings: &Settings) -> f64 {
        let mut planner: Planner<8> = Planner::new();
        planner.append([length, 0.0, 0.0], Speed::Feed(6000.0), None, 0, settings);
        let (mut out, mut rested) = (Vec::new(), false);
        while !planner.is_empty() {
            runs(&mut planner, false, 1, settings, &mut out, &mut rested);
        }
        out.iter().map(|run| run.seconds).sum()
    }

    #[test]
    fn s_curves_take_the_time_of_their_closed_form() {
        for jerk in [10_000.0, 50_000.0, 1e6] {
            let settings = smooth(jerk);
            // Up, across, down: a ramp takes Δ/a + a/j if the acceleration is reached, and 2·√(Δ/j) else.
            let reached = 1000.0 * 1000.0 / jerk <= 100.0;
            let ramp = if reached { 0.1 + 1000.0 / jerk } else { 2.0 * libm::sqrt(100.0 / jerk) };
            let expect = ramp + 200.0 / 100.0;
            let got = time_of(200.0, &settings);
            assert!((got / expect - 1.0).abs() < 0.01, "{got} s, not {expect}, with {jerk}");
            // From rest to rest without ever reaching 1000 mm/s²: the cube root of 32·s/j.
            for length in [0.1, 0.5, 2.0] {
                let expect = libm::cbrt(32.0 * length / jerk);
                if jerk * expect / 4.0 <= 1000.0 {
                    let got = time_of(length, &settings);
                    assert!(
                        (0.75..1.25).contains(&(got / expect)),
                        "{got} s, not {expect}, for {length} mm with {jerk}"
                    );
                }
            }
        }
    }

    proptest! {
        #[test]
        fn speed_acceleration_and_jerk_stay_within_their_limits(
            moves in prop::collection::vec((-20.0..20.0f64, -20.0..20.0f64, -2.0..2.0f64, 0..6u8, 30.0..12_000.0f64), 1..60),
            orders in prop::collection::vec((0..9usize, any::<bool>(), 10..=200u8, 0..6u8), 60),
            exponent in 3.5..6.5f64,
        ) {
            let settings = smooth(libm::pow(10.0, exponent));
            let mut planner: Planner<8> = Planner::new();
            let (mut at, mut heading, mut drawn) = ([0.0f64; 3], 0.0f64, 0u32);
            let mut position = [0i64; 3];
            // Since the last override the machine has stood, so that what is planned goes by it.
            let calm = core::cell::Cell::new(true);
            let mut check = |planner: &mut Planner<8>, hold: bool| -> Result<bool, TestCaseError> {
                calm.set(calm.get() || planner.speed_sqr == 0.0);
                let (speed, acceleration) = (libm::sqrtf(planner.speed_sqr), planner.acceleration);
                let overrides = planner.overrides();
                let Some(Command::Steps(segment)) = planner.next_segment(hold) else { return Ok(false) };
                drawn += u32::from(segment.lines);
                if segment.first {
                    for (axis, at) in position.iter_mut().enumerate() {
                        let steps = i64::from(segment.steps[axis]);
                        *at += if segment.negative.contains(axis) { -steps } else { steps };
                    }
                }
                let seconds = segment.period as f32 / 65_536e6 * f32::from(segment.events);
                let (after, change) = (libm::sqrtf(planner.speed_sqr), planner.acceleration - acceleration);
                let (a, j) = settings.ramp(segment.steps[2] > 0).unwrap();
                let (limit, nominal) = match &planner.current {
                    Some(current) => (limits(&segment, &settings).1 as f32, current.block.nominal(overrides)),
                    None => (limits(&segment, &settings).1 as f32, f32::INFINITY),
                };
                // A stop is met within half a step event, where both end.
                let stopped = planner.speed_sqr == 0.0;
                prop_assert!(planner.acceleration.abs() <= a * 1.001, "{} mm/s²", planner.acceleration);
                prop_assert!((after - speed).abs() <= a * seconds * 1.01 + 1e-3 || stopped, "{} to {} in {}", speed, after, seconds);
                prop_assert!(change.abs() <= j * seconds * 1.01 + 1e-3 * a || stopped, "{} by {} in {}", acceleration, change, seconds);
                prop_assert!(after <= limit * 1.001, "{} of {}", after, limit);
                prop_assert!(after <= speed.max(nominal) * 1.001 || !calm.get(), "{} of {}", after, nominal);
                if planner.current.is_none() && !planner.is_empty() && calm.get() {
                    // Where a stop was planned that is none any more, half an event too far: v² = 2·a·½ event, of at most a diagonal step.
                    let ceiling_sqr = planner.ahead().next().unwrap().0.max(a * 1.42 / 80.0);
                    prop_assert!(planner.speed_sqr <= ceiling_sqr * 1.002 + 1e-4, "{} into {}", planner.speed_sqr, ceiling_sqr);
                }
                Ok(true)
            };
            for ((x, y, z, kind, feed), (count, hold, percent, change)) in moves.into_iter().zip(orders) {
                // Long and short, straight on and not, smooth curves of short chords, and with Z.
                let turn = match kind {
                    0 => [x, y, z],
                    1 => [0.1 * x, 0.1 * y, 0.0],
                    2 => [x.abs(), 0.0, 0.0],
                    _ => {
                        heading += 0.005 * y;
                        let way = 0.02 * x.abs();
                        [way * libm::cos(heading), way * libm::sin(heading), 0.0]
                    }
                };
                at = [0, 1, 2].map(|a| at[a] + turn[a]);
                // No more lines than any queue holds, so that only blocks count.
                while planner.is_full(planner.lines_appended()) {
                    check(&mut planner, false)?;
                }
                planner.append(at, if feed < 1000.0 { Speed::Rapid } else { Speed::Feed(feed) }, None, 0, &settings);
                if change == 0 {
                    planner.set_overrides(Overrides { feed: percent, rapid: [25, 50, 100][usize::from(percent) % 3] });
                    calm.set(false);
                }
                for _ in 0..count {
                    check(&mut planner, hold && change == 1)?;
                }
            }
            for _ in 0..2_000_000 {
                if !check(&mut planner, false)? {
                    break;
                }
            }
            prop_assert!(planner.is_empty() && planner.speed_sqr == 0.0 && planner.acceleration == 0.0);
            for (steps, mm) in position.into_iter().zip(at) {
                prop_assert!((steps as f64 - mm * 80.0).abs() <= 1.0);
            }
        }
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
                while planner.is_full(out.iter().map(|run: &Run| u32::from(run.segment.lines)).sum()) {
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
