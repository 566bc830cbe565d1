//! Blocks: straight motions of whole steps, with the limits along them.

use super::junction::junction_sqr;
use crate::axis::{AXES, Axes};
use crate::gcode::Speed;
use crate::pen::Pen;
use crate::settings::Settings;

/// Slowest nominal speed, mm/s (1 mm/min, GRBL's own): slower feeds would make single steps take minutes.
pub(crate) const MIN_SPEED: f32 = 1.0 / 60.0;

/// A straight motion of a whole number of steps on each axis.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    /// Steps of each motor, and those that go down.
    pub(crate) steps: [u32; AXES],
    pub(crate) negative: Axes,
    /// Steps of the busiest motor: the number of step events.
    pub(crate) events: u32,
    /// Path length of one event, of the pen.
    pub(crate) mm_per_event: f32,
    /// mm/s² along the path, so that no axis exceeds its own.
    pub(crate) acceleration: f32,
    /// mm/s³ along the path; 0: not limited.
    pub(crate) jerk: f32,
    /// mm/s along the path, so that no axis exceeds its own.
    pub(super) limit: f32,
    /// Programmed mm/s; `None` for a rapid.
    pub(super) feed: Option<f32>,
    /// Square of the speed that the junction with the previous block allows, (mm/s)²; 0 when the machine stood still.
    pub(super) junction_sqr: f32,
    /// Square of the highest entry speed whatever follows.
    pub(super) ceiling_sqr: f32,
    /// Square of the entry speed as planned.
    pub(crate) entry_sqr: f32,
    /// Change of the pen at the start of the block (laser mode).
    pub(crate) pen: Option<Pen>,
    /// N word of the first line in it, 0 for none.
    pub(crate) line: u32,
    /// Lines (chords of arcs) in it.
    pub(crate) lines: u16,
}

impl Block {
    pub(super) fn length(&self) -> f32 {
        self.mm_per_event * self.events as f32
    }

    /// Allows it to be entered without a stop: it goes from `before`, where the block before ends, to `after`.
    ///
    /// With limited jerk one ramp goes through many blocks, so all of them must allow the same; else the machine stops between them.
    pub(super) fn join(&mut self, before: &Tail, after: &Tail, settings: &Settings) {
        if before.ramp != after.ramp {
            return;
        }
        self.junction_sqr = junction_sqr(before, after, settings);
        self.ceiling_sqr = self.junction_sqr.min(square(after.nominal.min(before.nominal)));
    }

    /// mm/s to cruise at.
    pub(crate) fn nominal(&self, overrides: Overrides) -> f32 {
        let speed = match self.feed {
            None => self.limit * f32::from(overrides.rapid) / 100.0,
            Some(feed) => feed * f32::from(overrides.feed) / 100.0,
        };
        speed.max(MIN_SPEED).min(self.limit)
    }
}

pub(super) fn square(v: f32) -> f32 {
    v * v
}

/// Percentages of the programmed feed and of the rapid rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Overrides {
    /// 10 to 200.
    pub(crate) feed: u8,
    /// 25, 50 or 100.
    pub(crate) rapid: u8,
}

impl Default for Overrides {
    fn default() -> Self {
        Self { feed: 100, rapid: 100 }
    }
}

/// Where a block ends, and how.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tail {
    pub(super) mm: [f64; AXES],
    /// What the motors have wound there, mm, before it is rounded to steps.
    pub(super) motors: [f64; AXES],
    pub(super) steps: [i32; AXES],
    pub(super) direction: [f32; AXES],
    pub(super) length: f32,
    pub(super) nominal: f32,
    /// Acceleration and jerk of the block, where that is limited.
    pub(super) ramp: (f32, f32),
}

impl Tail {
    /// Standing at `steps`.
    pub(super) fn standing(steps: [i32; AXES], settings: &Settings) -> Self {
        let counted = steps.map(f64::from);
        Self { mm: settings.pen(counted), motors: settings.wound(counted), steps, ..Self::default() }
    }

    /// The block from here to `target`, entered at rest, and where it ends; none when that is less than a step away on every axis.
    pub(super) fn block(
        &self,
        target: [f64; AXES],
        speed: Speed,
        overrides: Overrides,
        settings: &Settings,
    ) -> Option<(Block, Self)> {
        let kinematics = &settings.kinematics;
        let mut tail = Self { mm: target, motors: kinematics.motors(target), ..Self::default() };
        let mut steps = [0u32; AXES];
        let mut negative = Axes::NONE;
        let (mut wound, mut asked) = ([0.0; AXES], [0.0; AXES]);
        for motor in 0..AXES {
            let scale = settings.steps_per_mm[motor];
            // The cast saturates; the interpreter keeps targets within half of i32.
            tail.steps[motor] = libm::round(tail.motors[motor] * scale) as i32;
            let delta = tail.steps[motor].saturating_sub(self.steps[motor]);
            steps[motor] = delta.unsigned_abs();
            if delta < 0 {
                negative.insert(motor);
            }
            wound[motor] = f64::from(delta) / scale;
            asked[motor] = target[motor] - self.mm[motor];
        }
        let events = steps.into_iter().max().unwrap_or(0);
        if events == 0 {
            return None;
        }
        // Speeds and rates follow the steps that are made; the angle at the junction follows the commanded line, which has no rounding to steps in it.
        let moved = kinematics.way(wound, asked).map(|way| way.abs() as f32);
        let length = libm::sqrtf(moved.iter().map(|way| way * way).sum());
        tail.direction = asked.map(|way| way as f32);
        tail.length = libm::sqrtf(tail.direction.iter().map(|d| d * d).sum());
        for d in &mut tail.direction {
            *d = if tail.length > 0.0 { *d / tail.length } else { 0.0 };
        }
        let (mut limit, mut acceleration) = (f32::INFINITY, f32::INFINITY);
        for (axis, &way) in moved.iter().enumerate() {
            if way > 0.0 {
                let share = length / way;
                limit = limit.min((settings.max_rate[axis] / 60.0) as f32 * share);
                acceleration = acceleration.min(settings.acceleration[axis] as f32 * share);
            }
        }
        let mut jerk = 0.0;
        if let Some(limits) = settings.ramp(steps[2] > 0) {
            (acceleration, jerk) = limits;
            tail.ramp = limits;
        }
        let block = Block {
            steps,
            negative,
            events,
            mm_per_event: length / events as f32,
            acceleration,
            jerk,
            limit,
            feed: match speed {
                Speed::Rapid => None,
                Speed::Feed(mm_per_minute) => Some((mm_per_minute / 60.0) as f32),
            },
            junction_sqr: 0.0,
            ceiling_sqr: 0.0,
            entry_sqr: 0.0,
            pen: None,
            line: 0,
            lines: 1,
        };
        tail.nominal = block.nominal(overrides);
        Some((block, tail))
    }
}
