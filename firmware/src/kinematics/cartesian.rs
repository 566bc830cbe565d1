//! A motor an axis.

use crate::axis::AXES;

pub(super) fn motors(mm: [f64; AXES]) -> [f64; AXES] {
    mm
}

pub(super) fn pen(motors: [f64; AXES]) -> [f64; AXES] {
    motors
}
