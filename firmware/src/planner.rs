//! The look-ahead planner: how fast each straight block may be entered.
//!
//! ```text
//!  v ▲          junctions keep the speed that their angle allows
//!    │      ________
//!    │     /        \____        ______
//!    │    /              \______/      \        v² changes by 2·a·Δs
//!    │   /                              \
//!    └──┴───────────┴────┴──────┴────────┴──▶ s
//!       current      queue[0] …           the last block ends at rest
//! ```
//!
//! Each block has a *ceiling* for the square of its entry speed: the least of its own nominal speed, the previous block's
//! nominal speed, and what the junction allows. The backward pass lowers it so that the machine can always stop by the end of the last block:
//!
//! ```text
//! entry² ≤ exit² + 2·a·length,   exit of a block = entry of the next, of the last = 0
//! ```
//!
//! The usual forward pass is not needed: the segment generator carries the one true speed, never accelerates faster than a, and
//! treats every planned entry as an upper bound, so a block that cannot be entered that fast is entered slower.
//!
//! Guarantees:
//! 1. Whatever was planned before, an appended block only raises entries, so what the generator is doing stays feasible.
//! 2. Along the path neither the nominal speed nor any axis' maximum rate or acceleration is exceeded.
//! 3. Targets are absolute and rounded once, so no error accumulates: the end of every block is within half a step of the commanded point.
//!
//! Junctions (the published idea of junction deviation, S. Jeon 2009): the corner of two lines is replaced by the circle tangent to both
//! whose distance from the vertex is δ (`$11`); with the half-angle θ/2 between the lines its radius is R = δ·sin(θ/2)/(1 − sin(θ/2)), and
//! v² ≤ a·R. For chords of a curve δ alone would allow more than the curve does: a circle tangent to both at half of the shorter
//! has R = ½·min(l₁, l₂)·tan(θ/2), which for equal chords is the curve's own radius; the smaller R counts. Collinear blocks are not slowed.

use heapless::Deque;

use crate::axis::{AXES, Axes};
use crate::gcode::Speed;
use crate::pen::Pen;
use crate::settings::Settings;

/// Slowest nominal speed, mm/s (1 mm/min, GRBL's own): slower feeds would make single steps take minutes.
pub(crate) const MIN_SPEED: f32 = 1.0 / 60.0;

/// A straight motion of a whole number of steps on each axis.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    /// Steps of each axis, and those that go down.
    pub(crate) steps: [u32; AXES],
    pub(crate) negative: Axes,
    /// Steps of the busiest axis: the number of step events.
    pub(crate) events: u32,
    /// Path length of one event.
    pub(crate) mm_per_event: f32,
    /// mm/s² along the path, so that no axis exceeds its own.
    pub(crate) acceleration: f32,
    /// mm/s along the path, so that no axis exceeds its own.
    limit: f32,
    /// Programmed mm/s; `None` for a rapid.
    feed: Option<f32>,
    /// Square of the speed that the junction with the previous block allows, (mm/s)²; 0 when the machine stood still.
    junction_sqr: f32,
    /// Square of the highest entry speed whatever follows.
    ceiling_sqr: f32,
    /// Square of the entry speed as planned.
    pub(crate) entry_sqr: f32,
    /// Change of the pen at the start of the block (laser mode).
    pub(crate) pen: Option<Pen>,
    pub(crate) line: u32,
}

impl Block {
    fn length(&self) -> f32 {
        self.mm_per_event * self.events as f32
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

/// The block whose segments are being generated.
#[derive(Clone, Debug)]
pub(crate) struct Current {
    pub(crate) block: Block,
    /// Step events not yet in a segment.
    pub(crate) left: u32,
}

/// Where the last appended block ended, and how.
#[derive(Clone, Copy, Debug, Default)]
struct Tail {
    mm: [f64; AXES],
    steps: [i32; AXES],
    direction: [f32; AXES],
    length: f32,
    nominal: f32,
}

/// The queue of at most `BLOCKS` blocks, besides the one in execution.
#[derive(Debug)]
pub(crate) struct Planner<const BLOCKS: usize> {
    queue: Deque<Block, BLOCKS>,
    pub(crate) current: Option<Current>,
    /// Square of the speed at the end of the last generated segment, (mm/s)².
    pub(crate) speed_sqr: f32,
    overrides: Overrides,
    tail: Tail,
}

impl<const BLOCKS: usize> Planner<BLOCKS> {
    pub(crate) fn new() -> Self {
        const { assert!(BLOCKS >= 2, "look-ahead needs at least two blocks") };
        Self {
            queue: Deque::new(),
            current: None,
            speed_sqr: 0.0,
            overrides: Overrides::default(),
            tail: Tail::default(),
        }
    }

    /// Whether nothing is planned or in execution.
    pub(crate) fn is_empty(&self) -> bool {
        self.queue.is_empty() && self.current.is_none()
    }

    pub(crate) fn is_full(&self) -> bool {
        self.queue.is_full()
    }

    /// Blocks that still fit.
    pub(crate) fn free(&self) -> usize {
        BLOCKS - self.queue.len()
    }

    pub(crate) fn overrides(&self) -> Overrides {
        self.overrides
    }

    /// Forgets all blocks; the machine stands at `steps`.
    pub(crate) fn reset(&mut self, steps: [i32; AXES], settings: &Settings) {
        self.queue.clear();
        self.current = None;
        self.speed_sqr = 0.0;
        self.tail = Tail { steps, ..Tail::default() };
        for (axis, mm) in self.tail.mm.iter_mut().enumerate() {
            *mm = f64::from(steps[axis]) / settings.steps_per_mm[axis];
        }
    }

    /// Square of the speed at the end of the current block.
    pub(crate) fn exit_sqr(&self) -> f32 {
        self.queue.front().map_or(0.0, |next| next.entry_sqr)
    }

    /// Makes the next block current.
    pub(crate) fn advance(&mut self) -> Option<&mut Current> {
        self.current = self.queue.pop_front().map(|block| Current { left: block.events, block });
        if self.current.is_none() {
            self.speed_sqr = 0.0;
        }
        self.current.as_mut()
    }

    /// The current block has all its segments.
    pub(crate) fn finish_current(&mut self) {
        self.current = None;
        if self.queue.is_empty() {
            self.speed_sqr = 0.0;
        }
    }

    /// Takes back the advance to a block of which nothing has been generated.
    pub(crate) fn put_back(&mut self) {
        if let Some(current) = self.current.take() {
            // The advance has just freed the place.
            let _ = self.queue.push_front(current.block);
        }
    }

    /// Appends the straight line to `target` (machine mm; the interpreter has checked that its steps fit). The caller has checked [`Planner::is_full`]; a block that does not fit is refused.
    ///
    /// Returns false when the line is shorter than a step on every axis: the next line then starts from where this one did, so nothing is lost.
    /// Cost: about 150 f32 and 20 f64 operations, and 6 f32 operations for each block whose entry rises.
    pub(crate) fn append(
        &mut self,
        target: [f64; AXES],
        speed: Speed,
        pen: Option<Pen>,
        line: u32,
        settings: &Settings,
    ) -> bool {
        let Some((mut block, tail)) = self.block(target, speed, settings) else {
            return false;
        };
        block.pen = pen;
        block.line = line;
        if !self.is_empty() {
            block.junction_sqr = junction_sqr(&self.tail, &tail, settings);
            block.ceiling_sqr = block.junction_sqr.min(square(tail.nominal.min(self.tail.nominal)));
        }
        if self.queue.push_back(block).is_err() {
            return false;
        }
        self.tail = tail;
        self.plan_backward(false);
        true
    }

    /// The block from the tail to `target`, entered at rest, and the tail after it.
    fn block(&self, target: [f64; AXES], speed: Speed, settings: &Settings) -> Option<(Block, Tail)> {
        let mut tail = Tail { mm: target, ..Tail::default() };
        let mut steps = [0u32; AXES];
        let mut negative = Axes::NONE;
        let (mut moved_sqr, mut exact_sqr) = (0.0f32, 0.0f32);
        let mut moved = [0.0f32; AXES];
        for axis in 0..AXES {
            let scale = settings.steps_per_mm[axis];
            // The cast saturates; the interpreter keeps targets within half of i32.
            tail.steps[axis] = libm::round(target[axis] * scale) as i32;
            let delta = tail.steps[axis].saturating_sub(self.tail.steps[axis]);
            steps[axis] = delta.unsigned_abs();
            if delta < 0 {
                negative.insert(axis);
            }
            moved[axis] = (f64::from(steps[axis]) / scale) as f32;
            moved_sqr += moved[axis] * moved[axis];
            tail.direction[axis] = (target[axis] - self.tail.mm[axis]) as f32;
            exact_sqr += tail.direction[axis] * tail.direction[axis];
        }
        let events = steps.into_iter().max().unwrap_or(0);
        if events == 0 {
            return None;
        }
        // Speeds and rates follow the steps that are made; the angle at the junction follows the commanded line, which has no rounding to steps in it.
        let length = libm::sqrtf(moved_sqr);
        tail.length = libm::sqrtf(exact_sqr);
        for d in &mut tail.direction {
            *d = if tail.length > 0.0 { *d / tail.length } else { 0.0 };
        }
        let (mut limit, mut acceleration) = (f32::INFINITY, f32::INFINITY);
        for axis in 0..AXES {
            if steps[axis] > 0 {
                let share = length / moved[axis];
                limit = limit.min((settings.max_rate[axis] / 60.0) as f32 * share);
                acceleration = acceleration.min(settings.acceleration[axis] as f32 * share);
            }
        }
        let block = Block {
            steps,
            negative,
            events,
            mm_per_event: length / events as f32,
            acceleration,
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
        };
        tail.nominal = block.nominal(self.overrides);
        Some((block, tail))
    }

    /// The backward pass. An entry that comes out as it was ends it, since every earlier one depends on later ones through it alone; `all` goes on regardless.
    fn plan_backward(&mut self, all: bool) {
        let mut exit_sqr = 0.0;
        for (back, block) in self.queue.iter_mut().rev().enumerate() {
            let entry_sqr = block.ceiling_sqr.min(exit_sqr + 2.0 * block.acceleration * block.length());
            if back > 0 && !all && entry_sqr == block.entry_sqr {
                break;
            }
            block.entry_sqr = entry_sqr;
            exit_sqr = entry_sqr;
        }
    }

    /// Changes the overrides and plans everything anew.
    ///
    /// A lowered speed cannot be met at once: blocks that the machine reaches before it can have slowed down keep, as their
    /// ceiling, the speed that full deceleration from now on leaves. It is below what was planned before, so all junctions stay safe.
    pub(crate) fn set_overrides(&mut self, overrides: Overrides) {
        self.overrides = overrides;
        let mut previous = self.current.as_ref().map_or(f32::INFINITY, |c| c.block.nominal(overrides));
        for block in &mut self.queue {
            let nominal = block.nominal(overrides);
            block.ceiling_sqr = block.junction_sqr.min(square(nominal.min(previous)));
            previous = nominal;
        }
        self.tail.nominal = previous;
        self.plan_backward(true);
        // Between two blocks there is no current one, and the machine may be moving all the same.
        let mut least_sqr = self.speed_sqr;
        if let Some(Current { block, left }) = &self.current {
            least_sqr -= 2.0 * block.acceleration * block.mm_per_event * *left as f32;
        }
        for block in &mut self.queue {
            if least_sqr <= block.entry_sqr {
                break;
            }
            block.ceiling_sqr = block.ceiling_sqr.max(least_sqr);
            block.entry_sqr = least_sqr;
            least_sqr -= 2.0 * block.acceleration * block.length();
        }
    }
}

fn square(v: f32) -> f32 {
    v * v
}

/// Square of the speed at which the corner between two blocks may be taken, (mm/s)².
fn junction_sqr(before: &Tail, after: &Tail, settings: &Settings) -> f32 {
    let mut cos = 0.0;
    for axis in 0..AXES {
        cos -= before.direction[axis] * after.direction[axis];
    }
    // Of the angle θ between the lines: π when they go straight on, 0 when they turn back. Halves of it by the sums of squares, which stay accurate at both ends.
    let sin_half = libm::sqrtf(((1.0 - cos) / 2.0).clamp(0.0, 1.0));
    let cos_half = libm::sqrtf(((1.0 + cos) / 2.0).clamp(0.0, 1.0));
    // The cosine of unit vectors in f32 is uncertain by about 2⁻²²; a deviation from straight below its root (0.03°) is noise.
    if cos_half * cos_half <= f32::EPSILON {
        return f32::INFINITY;
    }
    let deviation = settings.junction_deviation as f32;
    // 1 − sin = cos²/(1 + sin), without cancellation.
    let by_deviation = deviation * sin_half * (1.0 + sin_half) / (cos_half * cos_half);
    let by_chords = 0.5 * before.length.min(after.length) * sin_half / cos_half;
    // The change of the velocity points along the difference of the directions, whose length is 2·cos(θ/2).
    let mut acceleration = f32::INFINITY;
    for axis in 0..AXES {
        let share = (after.direction[axis] - before.direction[axis]).abs() / (2.0 * cos_half);
        if share > 0.0 {
            acceleration = acceleration.min(settings.acceleration[axis] as f32 / share);
        }
    }
    acceleration * by_deviation.min(by_chords)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn tail(direction: [f64; 2], length: f32) -> Tail {
        let norm = libm::hypot(direction[0], direction[1]);
        let direction = [(direction[0] / norm) as f32, (direction[1] / norm) as f32, 0.0];
        Tail { direction, length, ..Tail::default() }
    }

    fn close(got: f32, expect: f64) {
        assert!((f64::from(got) - expect).abs() <= 1e-3 * expect, "{got}, not {expect}");
    }

    #[test]
    fn junctions_by_closed_form() {
        let settings = Settings::default();
        let east = tail([1.0, 0.0], 10.0);
        // Straight on, and straight on as well as text of three decimals can say it.
        assert_eq!(junction_sqr(&east, &east, &settings), f32::INFINITY);
        let a = tail([0.333, 0.667], 10.0);
        assert_eq!(junction_sqr(&a, &a, &settings), f32::INFINITY);
        // A right angle: R = δ·s/(1 − s) with s = sin 45°, and the turn is shared by both axes.
        let s = libm::sqrt(0.5);
        close(junction_sqr(&east, &tail([0.0, 1.0], 10.0), &settings), 1000.0 * libm::sqrt(2.0) * 0.01 * s / (1.0 - s));
        // Back again.
        assert_eq!(junction_sqr(&east, &tail([-1.0, 0.0], 10.0), &settings), 0.0);
        // Chords of 1 mm of a circle: its radius is l / (2·sin(turn/2)), and tan for the tangent circle.
        let turn = 0.01;
        let before = tail([libm::cos(turn / 2.0), -libm::sin(turn / 2.0)], 1.0);
        let after = tail([libm::cos(turn / 2.0), libm::sin(turn / 2.0)], 5.0);
        close(junction_sqr(&before, &after, &settings), 1000.0 * 0.5 / libm::tan(turn / 2.0));
        // δ = 0 stops at every corner but a straight one.
        let mut exact = settings;
        exact.set(11, 0.0).unwrap();
        assert_eq!(junction_sqr(&before, &after, &exact), 0.0);
        assert_eq!(junction_sqr(&east, &east, &exact), f32::INFINITY);
    }

    #[test]
    fn lines_below_a_step_are_not_lost() {
        let settings = Settings::default();
        let mut planner: Planner<4> = Planner::new();
        for i in 1..=5 {
            assert!(!planner.append([f64::from(i) * 0.001, 0.0, 0.0], Speed::Rapid, None, 0, &settings));
        }
        assert!(planner.append([0.0063, 0.0, 0.0], Speed::Rapid, None, 0, &settings));
        assert_eq!(planner.queue.front().unwrap().steps, [1, 0, 0]);
    }

    #[test]
    fn an_override_between_two_blocks_leaves_room_to_brake() {
        let settings = Settings::default();
        let mut planner: Planner<4> = Planner::new();
        for x in [20.0, 20.1, 20.2, 60.0] {
            planner.append([x, 0.0, 0.0], Speed::Feed(6000.0), None, 0, &settings);
        }
        while !(planner.current.is_none() && planner.speed_sqr > 0.0) {
            assert!(planner.next_segment(false).is_some());
        }
        assert!(planner.speed_sqr > 9000.0, "at full speed at the end of the first block");
        planner.set_overrides(Overrides { feed: 10, rapid: 100 });
        let mut reachable = planner.speed_sqr;
        for block in &planner.queue {
            assert!(
                block.entry_sqr >= reachable - 1.0,
                "{} where full deceleration leaves {reachable}",
                block.entry_sqr
            );
            reachable -= 2.0 * block.acceleration * block.length();
        }
    }

    proptest! {
        #[test]
        fn the_machine_can_always_stop(
            points in prop::collection::vec((-30.0..30.0f64, -30.0..30.0f64, 0..3u8), 1..9),
            feed in 60.0..12_000.0f64,
            override_percent in 10..=200u8,
        ) {
            let settings = Settings::default();
            let mut planner: Planner<8> = Planner::new();
            let mut at = [0.0; 3];
            for (x, y, size) in points {
                let scale = [1.0, 0.1, 0.001][usize::from(size)];
                at = [at[0] + x * scale, at[1] + y * scale, 0.0];
                if !planner.is_full() {
                    planner.append(at, Speed::Feed(feed), None, 0, &settings);
                }
                check(&planner)?;
            }
            planner.set_overrides(Overrides { feed: override_percent, rapid: 100 });
            check(&planner)?;
        }
    }

    fn check<const N: usize>(planner: &Planner<N>) -> Result<(), TestCaseError> {
        let mut exit_sqr = 0.0;
        for block in planner.queue.iter().rev() {
            prop_assert!(block.entry_sqr <= exit_sqr + 2.0 * block.acceleration * block.length());
            prop_assert!(block.entry_sqr <= block.junction_sqr);
            prop_assert!(block.entry_sqr <= square(block.nominal(planner.overrides)));
            exit_sqr = block.entry_sqr;
        }
        prop_assert!(planner.queue.front().is_none_or(|first| first.entry_sqr == 0.0), "the first starts at rest");
        Ok(())
    }
}
