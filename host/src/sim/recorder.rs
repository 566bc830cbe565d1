//! What the firmware drew, rebuilt from its step pulses.

use glam::DVec2;
use penvis_firmware::{AXES, Axes, Hardware, Pen as Servo, Settings};

use super::recording::{Recording, Trace};
use super::simplify::Simplifier;
use crate::device::Pen;

const S_PER_NS: f64 = 1e-9;

/// How the simulated machine's pen is read off its outputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum PenSense {
    /// By the servo's level.
    Servo {
        /// Level with the pen up.
        up: u16,
        /// Level with the pen down.
        down: u16,
    },
    /// By the steps of the Z axis: down at and below this many. Until it was above them once it counts as up: the height in which the
    /// machine is switched on is unknown.
    Z {
        /// Steps from the origin.
        down_steps: i64,
    },
}

impl PenSense {
    /// For the pen of a profile, on a machine with these settings. Half way between up and down is the border.
    #[must_use]
    pub(super) fn new(pen: &Pen, settings: &Settings) -> Self {
        let level = |s: u32| match Servo::from_speed(f64::from(s), settings) {
            Servo::On { level } => level,
            Servo::Off => 0,
        };
        match *pen {
            Pen::Servo { up, down, .. } => Self::Servo { up: level(up), down: level(down) },
            Pen::Z { up_mm, down_mm, .. } => {
                let [_, _, steps_per_mm] = settings.steps_per_mm();
                Self::Z { down_steps: ((up_mm + down_mm) / 2.0 * steps_per_mm).floor() as i64 }
            }
        }
    }

    /// Whether a servo that is told this has its pen down. Without a pulse it is up, and so it is at either level half way.
    fn servo_is_down(self, servo: Servo) -> bool {
        match (self, servo) {
            (Self::Servo { up, down }, Servo::On { level }) => level.abs_diff(down) < level.abs_diff(up),
            _ => false,
        }
    }
}

/// The simulated motors and pen.
#[derive(Clone, Debug)]
pub(super) struct Recorder {
    sense: PenSense,
    /// Of the mechanics: a job that changes `$100` does not change them.
    settings: Settings,
    /// Half of the shorter step, mm.
    tolerance: f64,
    negative: Axes,
    position: [i64; AXES],
    steps: [u64; AXES],
    servo: Servo,
    /// Whether the Z axis was above the border once.
    raised: bool,
    pen_down: bool,
    trace: Simplifier,
    /// Whether the trace has moved.
    moved: bool,
    traces: Vec<Trace>,
}

impl Recorder {
    pub(super) fn new(sense: PenSense, settings: &Settings) -> Self {
        let [x, y, _] = settings.steps_per_mm();
        let tolerance = 0.5 / x.max(y);
        Self {
            sense,
            settings: settings.clone(),
            tolerance,
            negative: Axes::NONE,
            position: [0; AXES],
            steps: [0; AXES],
            servo: Servo::Off,
            raised: false,
            pen_down: false,
            trace: Simplifier::new(DVec2::ZERO, tolerance),
            moved: false,
            traces: Vec::new(),
        }
    }

    /// All that was recorded, up to now.
    pub(super) fn recording(&self, now_ns: u64, lost_bytes: u32) -> Recording {
        let mut traces = self.traces.clone();
        if self.pen_down || self.moved {
            traces.push(Trace { pen: 1, pen_down: self.pen_down, points: self.trace.clone().finish() });
        }
        let duration_s = now_ns as f64 * S_PER_NS;
        Recording { traces, duration_s, steps: self.steps, position: self.position, lost_bytes }
    }

    fn senses_down(&self) -> bool {
        match self.sense {
            PenSense::Servo { .. } => self.sense.servo_is_down(self.servo),
            PenSense::Z { down_steps } => self.raised && self.position[2] <= down_steps,
        }
    }

    fn at(&self) -> DVec2 {
        let [x, y, _] = self.settings.pen(self.position.map(|steps| steps as f64));
        DVec2::new(x, y)
    }

    /// Begins a trace if the pen has changed.
    fn sense(&mut self) {
        let down = self.senses_down();
        if down == self.pen_down {
            return;
        }
        let next = Simplifier::new(self.at(), self.tolerance);
        let trace = std::mem::replace(&mut self.trace, next);
        // A pen that is up and goes nowhere leaves nothing to tell; one that is down leaves a dot.
        if self.pen_down || self.moved {
            self.traces.push(Trace { pen: 1, pen_down: self.pen_down, points: trace.finish() });
        }
        self.pen_down = down;
        self.moved = false;
    }
}

impl Hardware for Recorder {
    fn set_directions(&mut self, negative: Axes) {
        // Each block begins with this, and its steps approximate one straight line.
        self.trace.corner();
        self.negative = negative;
    }

    fn step(&mut self, axes: Axes) {
        for axis in (0..AXES).filter(|axis| axes.contains(*axis)) {
            self.steps[axis] += 1;
            self.position[axis] += if self.negative.contains(axis) { -1 } else { 1 };
        }
        if axes.contains(0) || axes.contains(1) {
            self.moved = true;
            self.trace.push(self.at());
        }
        if axes.contains(2) {
            self.raised |= matches!(self.sense, PenSense::Z { down_steps } if self.position[2] > down_steps);
            self.sense();
        }
    }

    fn set_pen(&mut self, pen: Servo) {
        self.servo = pen;
        self.sense();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::find;
    use crate::drawing::Page;

    const X: Axes = Axes::from_bits(1);
    const Y: Axes = Axes::from_bits(2);
    const Z: Axes = Axes::from_bits(4);

    fn recorder(pen: Pen) -> Recorder {
        let settings = Settings::default();
        Recorder::new(PenSense::new(&pen, &settings), &settings)
    }

    fn servo() -> Recorder {
        recorder(Pen::Servo { index: 0, up: 0, down: 1000, raise_s: 0.1, lower_s: 0.1, soft_steps: 1 })
    }

    fn repeat(recorder: &mut Recorder, axes: Axes, times: u32) {
        for _ in 0..times {
            recorder.step(axes);
        }
    }

    #[test]
    fn steps_become_traces() {
        let mut r = servo();
        repeat(&mut r, X, 800);
        r.set_pen(Servo::On { level: u16::MAX });
        repeat(&mut r, Y, 80);
        r.set_directions(X);
        repeat(&mut r, X, 400);
        r.set_pen(Servo::On { level: 0 });
        r.set_pen(Servo::On { level: u16::MAX });
        let recording = r.recording(1, 0);
        let v = DVec2::new;
        let expected = [
            Trace { pen: 1, pen_down: false, points: vec![v(0.0, 0.0), v(10.0, 0.0)] },
            Trace { pen: 1, pen_down: true, points: vec![v(10.0, 0.0), v(10.0, 1.0), v(5.0, 1.0)] },
            Trace { pen: 1, pen_down: true, points: vec![v(5.0, 1.0), v(5.0, 1.0)] },
        ];
        assert_eq!(recording.traces.len(), 3);
        for (trace, expected) in recording.traces.iter().zip(&expected) {
            assert_eq!(trace.pen_down, expected.pen_down);
            assert_eq!(trace.points.first(), expected.points.first());
            assert_eq!(trace.points.last(), expected.points.last());
            assert!((trace.length_mm() - expected.length_mm()).abs() < 0.0125, "{trace:?}");
        }
        assert_eq!((recording.lifts(), recording.steps, recording.position), (2, [1200, 80, 0], [400, 80, 0]));
        assert!((recording.ink_mm() - 6.0).abs() < 0.0125 && (recording.travel_mm() - 10.0).abs() < 1e-9);
    }

    #[test]
    fn the_border_is_half_way() {
        let mut r = servo();
        for (pen, down) in [
            (Servo::Off, false),
            (Servo::On { level: 32_767 }, false),
            (Servo::On { level: 32_768 }, true),
            (Servo::On { level: 0 }, false),
        ] {
            r.set_pen(pen);
            assert_eq!(r.pen_down, down, "{pen:?}");
        }
        let mut reversed =
            recorder(Pen::Servo { index: 0, up: 900, down: 100, raise_s: 0.1, lower_s: 0.1, soft_steps: 1 });
        reversed.set_pen(Servo::On { level: 10_000 });
        assert!(reversed.pen_down);
        reversed.set_pen(Servo::Off);
        assert!(!reversed.pen_down);
    }

    #[test]
    fn a_pen_on_the_z_axis() {
        let mut r = recorder(Pen::Z { up_mm: 3.0, down_mm: 0.0, feed: 1000.0, soft_mm: 0.0, soft_feed: 1000.0 });
        assert!(!r.pen_down);
        repeat(&mut r, Z, 240);
        assert!(!r.pen_down);
        r.set_directions(Z);
        repeat(&mut r, Z, 119);
        assert!(!r.pen_down);
        repeat(&mut r, Z, 1);
        assert!(r.pen_down);
    }

    #[test]
    fn the_ink_lies_on_its_page() {
        let mut r = servo();
        r.set_pen(Servo::On { level: u16::MAX });
        repeat(&mut r, X, 80);
        let page = Page { width_mm: 210.0, height_mm: 297.0 };
        let mut device = find("penvis").unwrap();
        device.travel_mm = Some([297.0, 210.0]);
        let place = device.place(page).unwrap();
        let drawing = r.recording(1, 0).drawing("x", page, &place);
        assert_eq!(drawing.polylines.len(), 1);
        assert_eq!(drawing.polylines[0].page, [DVec2::new(0.0, 297.0), DVec2::new(0.0, 296.0)]);
        assert_eq!(drawing.polylines[0].points.len(), 2);
    }
}
