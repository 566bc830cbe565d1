//! Arcs and helices.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::Plane;
use crate::device::ARC_TOLERANCE_MM;

/// Arcs whose ends are nearer than this angle (rad) are full turns, as for GRBL.
const FULL_TURN_ANGLE: f64 = 5e-7;

/// An arc, or a helix: an arc that moves across its plane at a constant rate.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arc {
    plane: Plane,
    /// From the centre, in the plane's axes, mm.
    from: [f64; 2],
    to: [f64; 2],
    /// Signed, counter-clockwise; never 0.
    angle: f64,
    /// Way across the plane, mm.
    rise: f64,
}

impl Arc {
    /// The arc from one place to another, about the start plus `offset` (I, J, K) or with this radius (R, negative for the long
    /// way), all in mm. None if the controller would refuse it.
    pub(super) fn new(
        from: DVec3,
        to: DVec3,
        plane: Plane,
        offset: [Option<f64>; 3],
        radius: Option<f64>,
        clockwise: bool,
    ) -> Option<Self> {
        let [a, b, across] = plane.axes();
        let way = to - from;
        let chord = [way[a], way[b]];
        let centre = match radius {
            Some(radius) => centre_of_radius(chord, radius, clockwise)?,
            None if offset[a].is_none() && offset[b].is_none() => return None,
            None => [offset[a].unwrap_or(0.0), offset[b].unwrap_or(0.0)],
        };
        let from = [-centre[0], -centre[1]];
        let to = [chord[0] - centre[0], chord[1] - centre[1]];
        let radii = [from[0].hypot(from[1]), to[0].hypot(to[1])];
        let differ = (radii[1] - radii[0]).abs();
        if radii[0] == 0.0 || differ > 0.5 || (differ > 0.005 && differ > 0.001 * radii[0]) {
            return None;
        }
        let mut angle = (from[0] * to[1] - from[1] * to[0]).atan2(from[0] * to[0] + from[1] * to[1]);
        if clockwise && angle >= -FULL_TURN_ANGLE {
            angle -= TAU;
        } else if !clockwise && angle <= FULL_TURN_ANGLE {
            angle += TAU;
        }
        Some(Self { plane, from, to, angle, rise: way[across] })
    }

    /// Its centre from where it begins, in mm, and its angle, counter-clockwise in radians, if it is one on the paper too.
    pub(super) fn on_paper(&self) -> Option<(DVec2, f64)> {
        (self.plane == Plane::Xy).then(|| (-DVec2::from(self.from), self.angle))
    }

    /// Length of its image on the paper, the xy plane, mm. Arcs of other planes are followed by chords of a degree or less.
    pub(super) fn length_on_paper(&self) -> f64 {
        if self.plane == Plane::Xy {
            return self.in_plane();
        }
        let count = (self.angle.abs().to_degrees().ceil() as u32).max(1);
        let [a, b, across] = self.plane.axes();
        let at = |k: u32| {
            let t = f64::from(k) / f64::from(count);
            let (sin, cos) = (self.angle * t).sin_cos();
            let mut at = DVec3::ZERO;
            at[a] = cos * self.from[0] - sin * self.from[1];
            at[b] = sin * self.from[0] + cos * self.from[1];
            at[across] = self.rise * t;
            at.truncate()
        };
        (0..count).map(|k| at(k).distance(at(k + 1))).sum()
    }

    /// The chords by which a controller goes along it, as ways in mm: no farther from it than GRBL's arc tolerance as it is shipped ($12).
    pub(super) fn chords(&self) -> impl Iterator<Item = DVec3> {
        let [a, b, across] = self.plane.axes();
        let radius = (self.from[0].hypot(self.from[1]) + self.to[0].hypot(self.to[1])) / 2.0;
        let step = 2.0 * (1.0 - ARC_TOLERANCE_MM / radius).clamp(0.0, 1.0).acos();
        // A full turn of the largest arc that fits any paper.
        let count = (self.angle.abs() / step).ceil().clamp(1.0, 1e5);
        let at = move |t: f64| {
            let (sin, cos) = (self.angle * t).sin_cos();
            let mut at = DVec3::ZERO;
            at[a] = cos * self.from[0] - sin * self.from[1];
            at[b] = sin * self.from[0] + cos * self.from[1];
            at[across] = self.rise * t;
            at
        };
        (0..count as u32).map(move |k| at(f64::from(k + 1) / count) - at(f64::from(k) / count))
    }

    fn in_plane(&self) -> f64 {
        // The radii may differ by the rounding of the program.
        (self.from[0].hypot(self.from[1]) + self.to[0].hypot(self.to[1])) / 2.0 * self.angle.abs()
    }
}

/// The centre of an arc of this radius, from its start.
fn centre_of_radius(chord: [f64; 2], radius: f64, clockwise: bool) -> Option<[f64; 2]> {
    let length = chord[0].hypot(chord[1]);
    let square = radius * radius - length * length / 4.0;
    if length == 0.0 || square < 0.0 {
        return None;
    }
    // The centre is to the left of the chord for the short way counter-clockwise and for the long way clockwise.
    let left = if clockwise == (radius < 0.0) { 1.0 } else { -1.0 };
    let height = left * square.sqrt() / length;
    Some([chord[0] / 2.0 - height * chord[1], chord[1] / 2.0 + height * chord[0]])
}
