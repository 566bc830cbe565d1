//! CoreXY: two motors that stand still and drive the pen by two crossed belts.
//!
//! ```text
//!  A = X + Y     both belts pull the carriage along X, and against each other along Y
//!  B = X − Y
//! ```
//!
//! Along an axis both motors turn as fast as the axis moves; along a diagonal one of them turns with the sum of both speeds and the other stands.

use crate::axis::AXES;

pub(super) fn motors([x, y, z]: [f64; AXES]) -> [f64; AXES] {
    [x + y, x - y, z]
}

pub(super) fn pen([a, b, z]: [f64; AXES]) -> [f64; AXES] {
    [(a + b) / 2.0, (a - b) / 2.0, z]
}
