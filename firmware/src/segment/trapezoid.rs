//! The trapezoid of one block: what is left of it follows from the speed now, the way left and the exit speed.
//!
//! ```text
//!   v² ▲      nominal²                 above the line exit² + 2·a·left:  decelerate, to land on exit² exactly
//!      │    _________                  below it and below nominal²:      accelerate, until either is met
//!      │   /         \                 on nominal²:                      cruise, until the line is met
//!      │  /           \ exit²          above nominal² (override):        decelerate to it
//!      └──┴────────────┴──▶ s
//! ```

/// One phase of the trapezoid at constant acceleration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Phase {
    /// mm/s², signed.
    pub(super) rate: f32,
    /// mm.
    pub(super) length: f32,
    /// (mm/s)² at its end.
    end_sqr: f32,
}

/// What bounds the motion along the rest of a block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    /// (mm/s)².
    pub(super) nominal_sqr: f32,
    pub(super) exit_sqr: f32,
    /// mm/s².
    pub(super) acceleration: f32,
}

impl Bounds {
    /// The phases of the `left` mm (> 0) from `speed_sqr` on: to the nominal speed or what is reached of it, at it, and down to the exit
    /// speed. Phases that do not occur have no length; the lengths add up to `left` but for rounding.
    pub(super) fn profile(&self, speed_sqr: f32, left: f32) -> [Phase; 3] {
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
    pub(super) fn travel(&self, profile: &[Phase; 3], mut speed_sqr: f32, mut way: f32) -> (f32, f32) {
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
    pub(super) fn time(&self, from_sqr: f32, to_sqr: f32, length: f32) -> f32 {
        if length <= 0.0 {
            return 0.0;
        }
        let sum = libm::sqrtf(from_sqr) + libm::sqrtf(to_sqr);
        if sum > 0.0 { 2.0 * length / sum } else { libm::sqrtf(2.0 * length / self.acceleration) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
