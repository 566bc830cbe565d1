//! Motion with limited jerk: S-shaped ramps.
//!
//! ```text
//!  v ▲            ____________
//!    │          ╱              ╲            a ramp from one speed to another: the acceleration rises with the jerk j, stays at a,
//!    │        ╱                  ╲          and falls to nothing again
//!    │      ╱                      ╲
//!    └───╱───────────────────────────╲──▶ t
//!  a ▲    ____
//!    │  ╱      ╲  ____________                 T = Δ/a + a/j, or 2·√(Δ/j) if Δ = |v₁ − v₀| is below a²/j; the way is T·(v₀ + v₁)/2
//!    └─╱────────╲─────────────╲────────╱──▶ t
//!                               ╲____╱
//! ```
//!
//! A ramp does not end at a block: chords of a curve are shorter than it. So nothing is planned beyond the ceilings of the junctions, and the state that is carried
//! from segment to segment is a speed and an acceleration. Each segment goes along the fastest ramp to the highest speed V, at most the nominal one, for which, from the
//! state in which it ends, *every* junction ahead can still be met: for each that must be passed more slowly than now, the ramp down to its ceiling, with the acceleration at
//! nothing there, must fit into the way to it. The last of them is the end of the last block, at rest.
//!
//! That there always is such a V: the ramp to a stop is a beginning of any of those ramps down, or brakes harder, so who follows it passes every junction in time. V = 0 is
//! allowed wherever the state before was.
//!
//! All blocks between two stops have one acceleration and one jerk, those of the slowest of the axes ([`crate::planner`] sees to that), or a later block might forbid
//! what an earlier one has begun. Stops are met within half a step event, since no motor can be nearer; and so is
//! a slow junction where a stop was planned until the line behind it came.

use super::{Stretch, events_in};

/// Speed and acceleration along the path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct State {
    /// mm/s, ≥ 0.
    pub(super) speed: f32,
    /// mm/s², signed.
    pub(super) acceleration: f32,
}

/// Limits along the path.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// mm/s².
    pub(super) acceleration: f32,
    /// mm/s³, > 0.
    pub(super) jerk: f32,
}

/// A place ahead, and the speed at which it may be passed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gate {
    /// mm.
    pub(super) way: f32,
    /// (mm/s)².
    pub(super) ceiling_sqr: f32,
}

/// Constant jerk for a time.
#[derive(Clone, Copy, Debug)]
struct Phase {
    /// mm/s³, signed.
    jerk: f32,
    /// s.
    time: f32,
}

impl State {
    /// After `time` at constant `jerk`.
    fn after(self, jerk: f32, time: f32) -> Self {
        let acceleration = self.acceleration + jerk * time;
        let speed = self.speed + (self.acceleration + 0.5 * jerk * time) * time;
        // Rounding may leave a little less than nothing.
        Self { speed: speed.max(0.0), acceleration }
    }

    /// mm in `time` at constant `jerk`.
    fn way(self, jerk: f32, time: f32) -> f32 {
        (self.speed + (self.acceleration + jerk * time / 3.0) * time / 2.0) * time
    }

    /// Seconds for `way` mm at constant `jerk`, of which `most` are enough: by halving, and by Newton's method where that converges.
    fn time(self, jerk: f32, way: f32, most: f32) -> f32 {
        let (mut low, mut high) = (0.0, most);
        let mut time = if self.speed > 0.0 { (way / self.speed).min(most) } else { most };
        for _ in 0..16 {
            let off = self.way(jerk, time) - way;
            if off > 0.0 {
                high = time;
            } else {
                low = time;
            }
            let speed = self.after(jerk, time).speed;
            let next = time - off / speed;
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            if (next - time).abs() <= f32::EPSILON * time {
                break;
            }
            time = next;
        }
        time
    }
}

impl Limits {
    /// The fastest ramp from `from` to the speed `to` with no acceleration.
    fn ramp(self, from: State, to: f32) -> [Phase; 3] {
        let (a, j) = (from.acceleration, self.jerk);
        // Where the speed goes if the acceleration ends as fast as it can.
        let up = to >= from.speed + a * a.abs() / (2.0 * j);
        let sign = if up { 1.0 } else { -1.0 };
        let (change, now) = (sign * (to - from.speed), sign * a);
        // Speeds add up: (peak² − now²)/2j up to the peak, peak²/2j back to nothing.
        let needed_sqr = (change * j + 0.5 * now * now).max(0.0);
        let peak = libm::sqrtf(needed_sqr).min(self.acceleration).max(now);
        let hold = if peak > 0.0 { ((needed_sqr - peak * peak) / (j * peak)).max(0.0) } else { 0.0 };
        [
            Phase { jerk: sign * j, time: (peak - now) / j },
            Phase { jerk: 0.0, time: hold },
            Phase { jerk: -sign * j, time: peak / j },
        ]
    }

    /// Way and time of a ramp.
    fn extent(ramp: &[Phase; 3], mut from: State) -> (f32, f32) {
        let (mut way, mut time) = (0.0, 0.0);
        for phase in ramp {
            way += from.way(phase.jerk, phase.time);
            time += phase.time;
            from = from.after(phase.jerk, phase.time);
        }
        (way, time)
    }

    /// `way` mm along `ramp`, and on at its last speed `to`: the state there, and the seconds. None if it comes to rest before.
    fn travel(ramp: &[Phase; 3], mut from: State, to: f32, mut way: f32) -> Option<(State, f32)> {
        let mut seconds = 0.0;
        for phase in ramp {
            let whole = from.way(phase.jerk, phase.time);
            if way <= whole {
                let time = from.time(phase.jerk, way, phase.time);
                return Some((from.after(phase.jerk, time), seconds + time));
            }
            way -= whole;
            seconds += phase.time;
            from = from.after(phase.jerk, phase.time);
        }
        (to > 0.0).then(|| (State { speed: to, acceleration: 0.0 }, seconds + way / to))
    }

    /// The way that it takes to pass at `speed` mm/s and no faster, without acceleration; 0 if there is nothing to do for that.
    fn way_down(self, from: State, speed: f32) -> f32 {
        let (a, j) = (from.acceleration, self.jerk);
        let turn = a * a / (2.0 * j);
        if a > 0.0 {
            if from.speed + turn <= speed {
                return 0.0;
            }
        } else if from.speed <= speed {
            return 0.0;
        } else if from.speed - turn < speed {
            // Too much deceleration to end at that speed: it is below when the deceleration has ended.
            return from.way(j, -a / j);
        }
        Self::extent(&self.ramp(from, speed), from).0
    }

    /// Whether all of `gates`, in the order of their way, can be met from `from`.
    fn meets(self, from: State, gates: impl Iterator<Item = Gate>, half_event: f32) -> bool {
        let a = from.acceleration.max(0.0);
        let most = from.speed + a * a / (2.0 * self.jerk);
        let stop = self.way_down(from, 0.0);
        for gate in gates {
            if gate.ceiling_sqr <= 0.0 {
                // Nothing beyond it matters before.
                return stop <= gate.way + half_event;
            }
            if gate.way >= stop {
                return true;
            }
            if gate.ceiling_sqr < most * most && self.way_down(from, libm::sqrtf(gate.ceiling_sqr)) > gate.way {
                return false;
            }
        }
        true
    }

    /// The next stretch of at most `left` events of `mm_per_event`: towards `nominal` mm/s, past the gates that `gates` tells for a place so many events on.
    ///
    /// Cost: in the worst case 14 ramps are tried, each against the gates within the way of a stop; 1 while nothing but the nominal speed limits.
    pub(super) fn stretch<G: Iterator<Item = Gate>>(
        self,
        from: State,
        nominal: f32,
        left: u32,
        mm_per_event: f32,
        gates: impl Fn(u32) -> G,
    ) -> Stretch {
        let events = events_in(from.speed, from.acceleration, mm_per_event, left);
        let way = mm_per_event * events as f32;
        let half = 0.5 * mm_per_event;
        let attempt = |to: f32| {
            let (end, seconds) = Self::travel(&self.ramp(from, to), from, to, way)?;
            self.meets(end, gates(events), half).then_some(Stretch::new(events, end, seconds))
        };
        let mut to = nominal;
        for _ in 0..10 {
            let Some(mut best) = attempt(to) else {
                to *= 0.5;
                continue;
            };
            if to < nominal {
                // Between this and twice as much.
                let mut step = 0.5 * to;
                for _ in 0..4 {
                    if let Some(better) = attempt(to + step) {
                        best = better;
                        to += step;
                    }
                    step *= 0.5;
                }
            }
            return best;
        }
        self.stopping(from, left, mm_per_event, 1)
    }

    /// The next stretch on the way to a stop, of at least `least` events: it ends at rest if these are farther than the stop. No events if less than one is left of it.
    pub(super) fn stopping(self, from: State, left: u32, mm_per_event: f32, least: u32) -> Stretch {
        let ramp = self.ramp(from, 0.0);
        let (whole, time) = Self::extent(&ramp, from);
        let events = events_in(from.speed, from.acceleration, mm_per_event, left)
            .min((whole / mm_per_event) as u32)
            .max(least)
            .min(left);
        let way = mm_per_event * events as f32;
        match Self::travel(&ramp, from, 0.0, way) {
            Some((end, seconds)) => Stretch::new(events, end, seconds),
            // From rest to rest over the remainder: +j, −j, −j, +j for a quarter of the time each.
            None => {
                let rest = libm::cbrtf(32.0 * (way - whole).max(0.0) / self.jerk);
                Stretch::new(events, State::default(), time + rest)
            }
        }
    }
}
