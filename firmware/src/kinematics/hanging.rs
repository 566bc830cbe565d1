//! A pen that hangs on two cords: V-plotter, polargraph.
//!
//! ```text
//!   left motor ●────────── motor_distance ──────────● right motor
//!              │ ╲                              ╱
//!  origin_below│    ╲ l                  r  ╱
//!              │       ╲              ╱
//!              └─origin_right─▶ O     Y up, X to the right
//!                             ╲   ╱
//!                               ● pen, `depth` below the motors
//!
//!  l² = (x + origin_right)² + (origin_below − y)²
//!  r² = (motor_distance − origin_right − x)² + (origin_below − y)²
//! ```
//!
//! The motors count the cord that they have let out since the pen was at the origin. The weight of pen and cords is taken for small: cords are straight and do not
//! stretch.
//!
//! # How far a straight winding is off a straight line
//!
//! Along a straight line of which c mm are wound evenly, a cord of length l is off its true length by at most c²/8 · max l″, and l″ = sin²(angle to the cord)/l ≤ 1/l ≤ 1/depth.
//! Errors e of both cords move the pen by at most 2·e / sine, where sine is that of the angle between the cords (the norm of the inverse of the matrix whose
//! rows are the unit vectors along the cords is at most √2/sine). So c = √(4·tolerance·depth·sine) keeps the pen within the tolerance; sine = depth·motor_distance / (l·r).

use crate::axis::AXES;

/// Least depth below the motors, in distances of the motors: nearer to their line the cords would have to pull without limit.
const LEAST_DEPTH: f64 = 0.01;

/// Most pieces of a line. Those of the longest line near the motors, at the finest tolerance that is of use (a micrometre), are fewer.
const MOST_PIECES: f64 = 1e6;

/// Where the motors of a hanging plotter are, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hanging {
    /// `$501`: between the motors, along the line on which both are, > 0. This line is level.
    pub motor_distance: f64,
    /// `$502`: how far to the right of the left motor the origin is.
    pub origin_right: f64,
    /// `$503`: how far below the motors the origin is, at least a hundredth of their distance.
    pub origin_below: f64,
}

impl Default for Hanging {
    /// Motors 1 m apart, and the origin in the lower left corner of an A2 sheet that hangs between them, 15 cm below their line.
    fn default() -> Self {
        Self { motor_distance: 1000.0, origin_right: 203.0, origin_below: 744.0 }
    }
}

impl Hanging {
    /// Right of the left motor, and below both.
    fn place(&self, [x, y, _]: [f64; AXES]) -> (f64, f64) {
        (x + self.origin_right, self.origin_below - y)
    }

    fn cords(&self, mm: [f64; AXES]) -> [f64; 2] {
        let (right, depth) = self.place(mm);
        [libm::hypot(right, depth), libm::hypot(self.motor_distance - right, depth)]
    }

    pub(super) fn motors(&self, mm: [f64; AXES]) -> [f64; AXES] {
        let ([l, r], [l0, r0]) = (self.cords(mm), self.cords([0.0; AXES]));
        [l - l0, r - r0, mm[2]]
    }

    /// Cords that are too short to meet hang straight from motor to motor, as far as this goes.
    pub(super) fn pen(&self, motors: [f64; AXES]) -> [f64; AXES] {
        let [l0, r0] = self.cords([0.0; AXES]);
        let (l, r) = (l0 + motors[0], r0 + motors[1]);
        // (l² − r² + d²) / 2d
        let right = ((l - r) * (l + r) / self.motor_distance + self.motor_distance) / 2.0;
        let depth = libm::sqrt(((l - right) * (l + right)).max(0.0));
        [right - self.origin_right, self.origin_below - depth, motors[2]]
    }

    pub(super) fn reaches(&self, mm: [f64; AXES]) -> bool {
        self.place(mm).1 >= LEAST_DEPTH * self.motor_distance
    }

    /// Whether the origin itself can be reached.
    pub(crate) fn is_possible(&self) -> bool {
        self.reaches([0.0; AXES])
    }

    /// Of the angle between the cords, at least: it may be more where `mm` is the farthest of several places.
    #[cfg(test)]
    pub(super) fn sine(&self, mm: [f64; AXES]) -> f64 {
        let [l, r] = self.cords(mm);
        self.place(mm).1 * self.motor_distance / (l * r)
    }

    pub(super) fn pieces(&self, from: [f64; AXES], to: [f64; AXES], tolerance: f64) -> u32 {
        // The depth is least, and the cords are longest, at one of the ends.
        let depth = self.place(from).1.min(self.place(to).1).max(LEAST_DEPTH * self.motor_distance);
        let ([l0, r0], [l1, r1]) = (self.cords(from), self.cords(to));
        let sine = depth * self.motor_distance / (l0.max(l1) * r0.max(r1));
        let longest = libm::sqrt(4.0 * tolerance * depth * sine.min(1.0));
        let length = libm::hypot(to[0] - from[0], to[1] - from[1]);
        // Both are positive, and a quotient that is no number gives 1.
        libm::ceil(length / longest).clamp(1.0, MOST_PIECES) as u32
    }
}

/// A motor winds no more than the pen moves; rounded to whole steps it may, and then that counts.
pub(super) fn way(wound: [f64; AXES], asked: [f64; AXES]) -> [f64; AXES] {
    let length = libm::hypot(asked[0], asked[1]);
    let most = wound[0].abs().max(wound[1].abs());
    if length > 0.0 && most > 0.0 {
        let scale = (most / length).max(1.0);
        [asked[0] * scale, asked[1] * scale, wound[2]]
    } else {
        wound
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cords_by_pythagoras() {
        let cords = Hanging { motor_distance: 1000.0, origin_right: 300.0, origin_below: 400.0 };
        // 3-4-5 at the origin; 800-600-1000 below the left motor's right.
        assert_eq!(cords.cords([0.0; 3])[0], 500.0);
        assert_eq!(cords.motors([500.0, -200.0, 1.0])[0], 500.0);
        assert_eq!(
            cords.pen([500.0, libm::hypot(200.0, 600.0) - libm::hypot(700.0, 400.0), 1.0]),
            [500.0, -200.0, 1.0]
        );
        assert!(cords.reaches([0.0, 389.0, 0.0]) && !cords.reaches([0.0, 391.0, 0.0]));
        // Too short to meet.
        let up = cords.pen([-450.0, -450.0, 0.0]);
        assert!(up.iter().all(|v| v.is_finite()));
    }

    #[test]
    fn pieces_are_few() {
        let cords = Hanging::default();
        // A line across the sheet, within 2 µm: pieces of a millimetre or two.
        let pieces = cords.pieces([0.0, 0.0, 0.0], [594.0, 300.0, 0.0], 0.002);
        assert!((300..900).contains(&pieces), "{pieces}");
        assert_eq!(cords.pieces([0.0; 3], [0.0; 3], 0.002), 1);
        assert_eq!(cords.pieces([0.0; 3], [0.5, 0.5, 0.0], 0.002), 1);
    }
}
