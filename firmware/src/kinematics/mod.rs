//! From the pen's place to the lengths that the motors wind, and back.
//!
//! Everything above the planner speaks of X, Y and Z of the pen, in mm: targets, feeds, reports, soft limits, the limits of speed and acceleration. Only
//! the planner's steps and what the stepper makes of them are the motors'. Lines that are not straight for the motors are cut into pieces that are, as nearly
//! as `$12` asks.
//!
//! | | motors | a straight line is | fastest motor, mm/s |
//! |---|---|---|---|
//! | [Cartesian](cartesian) | X, Y, Z | straight | its axis |
//! | [CoreXY](core_xy) | A = X + Y, B = X − Y, Z | straight | X + Y |
//! | [hanging](hanging) | left cord, right cord, Z | curved | √(X² + Y²) |
//!
//! `$100`–`$102` are steps per mm of what a motor winds, `$3` turns motors around.

mod cartesian;
mod core_xy;
mod hanging;

pub use hanging::Hanging;

use crate::axis::AXES;

/// How the motors move the pen (`$500`).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Kinematics {
    /// `$500=0`: a motor an axis.
    #[default]
    Cartesian,
    /// `$500=1`: two crossed belts.
    CoreXy,
    /// `$500=2`: a pen that hangs on two cords (V-plotter, polargraph).
    Hanging(Hanging),
}

impl Kinematics {
    /// What the motors have wound, in mm from the origin, when the pen is at `mm`.
    #[must_use]
    pub fn motors(&self, mm: [f64; AXES]) -> [f64; AXES] {
        match self {
            Self::Cartesian => cartesian::motors(mm),
            Self::CoreXy => core_xy::motors(mm),
            Self::Hanging(cords) => cords.motors(mm),
        }
    }

    /// Where the pen is, in mm, when the motors have wound `motors` from the origin.
    #[must_use]
    pub fn pen(&self, motors: [f64; AXES]) -> [f64; AXES] {
        match self {
            Self::Cartesian => cartesian::pen(motors),
            Self::CoreXy => core_xy::pen(motors),
            Self::Hanging(cords) => cords.pen(motors),
        }
    }

    /// The way of the pen, mm along each axis, that stands for a straight motion in which the motors wind `wound` in whole steps, and which was asked to be `asked`.
    ///
    /// Its length is what speeds are measured by: it never is so short that a motor would have to be faster than the table above says.
    pub(crate) fn way(&self, wound: [f64; AXES], asked: [f64; AXES]) -> [f64; AXES] {
        match self {
            Self::Cartesian => cartesian::pen(wound),
            Self::CoreXy => core_xy::pen(wound),
            Self::Hanging(_) => hanging::way(wound, asked),
        }
    }

    /// Into how many equal pieces the line between two points has to be cut, for the pen to stay within `tolerance` mm of it while the motors wind evenly.
    pub(crate) fn pieces(&self, from: [f64; AXES], to: [f64; AXES], tolerance: f64) -> u32 {
        match self {
            Self::Cartesian | Self::CoreXy => 1,
            Self::Hanging(cords) => cords.pieces(from, to, tolerance),
        }
    }

    /// Whether the pen can be at `mm`.
    pub(crate) fn reaches(&self, mm: [f64; AXES]) -> bool {
        match self {
            Self::Cartesian | Self::CoreXy => true,
            Self::Hanging(cords) => cords.reaches(mm),
        }
    }

    /// Highest speeds of the motors if `axes` are those of X, Y and Z, in the same unit.
    pub(crate) fn motor_rates(&self, axes: [f64; AXES]) -> [f64; AXES] {
        let [x, y, z] = axes;
        match self {
            Self::Cartesian => axes,
            Self::CoreXy => [x + y, x + y, z],
            Self::Hanging(_) => [libm::hypot(x, y), libm::hypot(x, y), z],
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn all() -> impl Strategy<Value = Kinematics> {
        let hanging = (300.0..3000.0f64, 0.0..1.0f64, 0.05..1.5f64).prop_map(|(distance, right, down)| {
            Kinematics::Hanging(Hanging {
                motor_distance: distance,
                origin_right: right * distance,
                origin_below: down * distance,
            })
        });
        prop_oneof![Just(Kinematics::Cartesian), Just(Kinematics::CoreXy), hanging]
    }

    proptest! {
        #[test]
        fn there_and_back_is_where_it_was(kinematics in all(), x in -1.0..1.0f64, y in -1.0..1.0f64, z in -50.0..50.0f64) {
            let mm = match &kinematics {
                Kinematics::Hanging(cords) => [
                    (x + 0.5) * cords.motor_distance - cords.origin_right,
                    // Below the motors.
                    cords.origin_below - (0.05 + y.abs()) * cords.motor_distance,
                    z,
                ],
                _ => [x * 500.0, y * 500.0, z],
            };
            prop_assert!(kinematics.reaches(mm));
            let motors = kinematics.motors(mm);
            let back = kinematics.pen(motors);
            for axis in 0..AXES {
                prop_assert!((back[axis] - mm[axis]).abs() < 1e-7, "{:?} and {:?}", mm, back);
            }
            prop_assert!(kinematics.motors([0.0; AXES]).iter().all(|m| m.abs() < 1e-9), "the origin is the origin");
            // Half a step of each motor, 1/160 mm, moves the pen by less than a step, unless it hangs from cords that are nearly one line.
            let shifted = kinematics.pen([motors[0] + 1.0 / 160.0, motors[1] - 1.0 / 160.0, motors[2]]);
            let moved = libm::hypot(shifted[0] - mm[0], shifted[1] - mm[1]);
            let allowed = match &kinematics {
                Kinematics::Hanging(cords) => 2.0 / 160.0 / cords.sine(mm).min(1.0),
                _ => 1.5 / 160.0,
            };
            prop_assert!(moved < allowed * 1.01, "{} of {}", moved, allowed);
        }

        /// The pen stays beside the line that it was asked to draw.
        #[test]
        fn pieces_keep_to_the_line(
            kinematics in all(), from in (0.0..1.0f64, 0.02..1.5f64), to in (0.0..1.0f64, 0.02..1.5f64), exponent in -3.5..-1.0f64,
        ) {
            let Kinematics::Hanging(cords) = kinematics else { return Ok(()) };
            let at = |(x, down): (f64, f64)| {
                [x * cords.motor_distance - cords.origin_right, cords.origin_below - down * cords.motor_distance, 0.0]
            };
            let (from, to, tolerance) = (at(from), at(to), libm::pow(10.0, exponent));
            prop_assume!(cords.reaches(from) && cords.reaches(to));
            let pieces = kinematics.pieces(from, to, tolerance);
            let between = |a: [f64; AXES], b: [f64; AXES], t: f64| [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * t);
            let length = libm::hypot(to[0] - from[0], to[1] - from[1]);
            for k in (0..pieces).step_by(1 + pieces as usize / 40) {
                let ends = [k, k + 1].map(|k| kinematics.motors(between(from, to, f64::from(k) / f64::from(pieces))));
                for t in [0.25, 0.5, 0.75] {
                    let pen = kinematics.pen(between(ends[0], ends[1], t));
                    let off = ((pen[0] - from[0]) * (to[1] - from[1]) - (pen[1] - from[1]) * (to[0] - from[0])) / length;
                    prop_assert!(off.abs() <= tolerance + 1e-9, "{} off, {} allowed in {} pieces", off, tolerance, pieces);
                }
            }
        }

        #[test]
        fn no_motor_is_faster_than_its_rate(
            kinematics in all(), x in 0.1..0.9f64, down in 0.1..1.0f64, angle in 0.0..6.3f64, way in 0.001..1.0f64,
        ) {
            let mm = match &kinematics {
                Kinematics::Hanging(c) => [x * c.motor_distance - c.origin_right, c.origin_below - down * c.motor_distance, 0.0],
                _ => [x, down, 0.0],
            };
            let to = [mm[0] + way * libm::cos(angle), mm[1] + way * libm::sin(angle), 0.0];
            let (a, b) = (kinematics.motors(mm), kinematics.motors(to));
            let rates = kinematics.motor_rates([libm::cos(angle).abs(), libm::sin(angle).abs(), 0.0]);
            for motor in 0..AXES {
                prop_assert!((b[motor] - a[motor]).abs() <= rates[motor] * way * (1.0 + 1e-9) + 1e-12);
            }
        }
    }
}
