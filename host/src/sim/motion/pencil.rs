//! The pen of a simulated controller, and the ink that it leaves.

use glam::{DVec2, DVec3};

use super::super::recording::{Recording, Trace};

/// How the height of the pen comes about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) enum Sense {
    /// A servo or a solenoid: the controller says up or down.
    Told,
    /// The Z axis: down at and below this height in mm. Until it was above it once it counts as up: the height in which the machine is
    /// switched on is unknown.
    Z(f64),
}

/// Follows the pen's tip, in mm of the mechanism: (0, 0, 0) is where it was switched on.
#[derive(Clone, Debug)]
pub(in super::super) struct Pencil {
    sense: Sense,
    steps_per_mm: DVec3,
    at: DVec3,
    down: bool,
    /// What a controller last said; for [`Sense::Told`].
    told: bool,
    /// Number of the pen in the holder.
    pen: u32,
    /// Whether the Z axis was above the border once.
    raised: bool,
    steps: [u64; 3],
    /// Of the trace that goes on; it begins with where the last one ended.
    points: Vec<DVec2>,
    traces: Vec<Trace>,
}

impl Pencil {
    /// A pen that is up.
    pub(in super::super) fn new(sense: Sense, steps_per_mm: DVec3) -> Self {
        Self {
            sense,
            steps_per_mm,
            at: DVec3::ZERO,
            down: false,
            told: false,
            pen: 1,
            raised: false,
            steps: [0; 3],
            points: vec![DVec2::ZERO],
            traces: Vec::new(),
        }
    }

    /// Where it is.
    pub(super) fn at(&self) -> DVec3 {
        self.at
    }

    /// Goes straight to a place.
    pub(super) fn go(&mut self, to: DVec3) {
        if let Sense::Z(border) = self.sense
            && (self.at.z > border) != (to.z > border)
        {
            // Where it crosses the border the trace changes.
            let along = (border - self.at.z) / (to.z - self.at.z);
            let crossing = self.at.lerp(to, along.clamp(0.0, 1.0));
            self.draw(crossing);
            self.change(self.raised && to.z <= border);
        }
        self.draw(to);
        self.raised |= matches!(self.sense, Sense::Z(border) if to.z > border);
        self.sense();
    }

    fn draw(&mut self, to: DVec3) {
        let steps = |p: DVec3| (p * self.steps_per_mm).round();
        let taken = (steps(to) - steps(self.at)).abs();
        for (count, axis) in self.steps.iter_mut().zip(taken.to_array()) {
            *count += axis as u64;
        }
        self.at = to;
        let tip = to.truncate();
        if self.points.last() != Some(&tip) {
            self.points.push(tip);
        }
    }

    /// The controller raises or lowers it.
    pub(super) fn set_down(&mut self, down: bool) {
        self.told = down;
        self.sense();
    }

    /// Another pen is put into the holder.
    pub(in super::super) fn take(&mut self, pen: u32) {
        if pen != self.pen {
            self.end_trace();
            self.pen = pen;
        }
    }

    fn sense(&mut self) {
        let down = match self.sense {
            Sense::Told => self.told,
            Sense::Z(border) => self.raised && self.at.z <= border,
        };
        self.change(down);
    }

    fn change(&mut self, down: bool) {
        if down != self.down {
            self.end_trace();
            self.down = down;
        }
    }

    fn end_trace(&mut self) {
        let trace = self.trace();
        self.points = vec![self.at.truncate()];
        self.traces.extend(trace);
    }

    /// The trace that goes on. A pen that is up and goes nowhere leaves nothing to tell; one that is down leaves a dot.
    fn trace(&self) -> Option<Trace> {
        let mut points = self.points.clone();
        match points.as_slice() {
            [only] if self.down => points.push(*only),
            [_] => return None,
            _ => {}
        }
        Some(Trace { pen_down: self.down, pen: self.pen, points })
    }

    /// All that was drawn, up to a place on a straight line from the last one.
    pub(super) fn recording(&self, to: DVec3, duration_s: f64, lost_bytes: u32) -> Recording {
        let mut last = self.clone();
        last.go(to);
        last.end_trace();
        let position = (to * self.steps_per_mm).round().to_array().map(|steps| steps as i64);
        Recording { traces: last.traces, duration_s, steps: last.steps, position, lost_bytes }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f64, y: f64, z: f64) -> DVec3 {
        DVec3::new(x, y, z)
    }

    #[test]
    fn traces_change_with_the_pen() {
        let mut pencil = Pencil::new(Sense::Told, DVec3::splat(100.0));
        pencil.go(v(10.0, 0.0, 0.0));
        pencil.set_down(true);
        pencil.go(v(10.0, 5.0, 0.0));
        pencil.set_down(false);
        pencil.set_down(true);
        pencil.take(2);
        let recording = pencil.recording(v(10.0, 7.0, 0.0), 1.0, 0);
        let told: Vec<_> = recording.traces.iter().map(|t| (t.pen_down, t.pen, t.points.clone())).collect();
        let p = DVec2::new;
        assert_eq!(
            told,
            [
                (false, 1, vec![p(0.0, 0.0), p(10.0, 0.0)]),
                (true, 1, vec![p(10.0, 0.0), p(10.0, 5.0)]),
                (true, 1, vec![p(10.0, 5.0), p(10.0, 5.0)]),
                (true, 2, vec![p(10.0, 5.0), p(10.0, 7.0)]),
            ]
        );
        assert_eq!((recording.steps, recording.position), ([1000, 700, 0], [1000, 700, 0]));
    }

    #[test]
    fn a_pen_on_the_z_axis_draws_below_the_border_once_it_was_above() {
        let mut pencil = Pencil::new(Sense::Z(1.0), DVec3::splat(100.0));
        for to in [v(5.0, 0.0, 0.0), v(5.0, 0.0, 3.0), v(9.0, 0.0, 0.0), v(12.0, 0.0, 0.0)] {
            pencil.go(to);
        }
        let recording = pencil.recording(v(12.0, 0.0, 2.0), 1.0, 0);
        let inked: Vec<_> = recording.traces.iter().filter(|t| t.pen_down).collect();
        assert_eq!(inked.len(), 1);
        let [from, to] = [inked[0].points[0], inked[0].points[inked[0].points.len() - 1]];
        assert!((from.x - (5.0 + 4.0 * 2.0 / 3.0)).abs() < 1e-12 && to.x == 12.0, "{inked:?}");
    }
}
