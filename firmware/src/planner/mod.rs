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
//! 4. Lines that lie on one line within half a step share a block ([`merge`]), so that the blocks reach far enough ahead where lines are short.
//!    A block tells how many lines it holds and the number of the first, so that none counts as drawn before it is.

mod block;
mod junction;
mod merge;

use heapless::Deque;

pub(crate) use block::{Block, Overrides};
use block::{Tail, square};
use merge::Run;

use crate::axis::AXES;
use crate::gcode::Speed;
use crate::pen::Pen;
use crate::settings::Settings;
use crate::stepper::SEGMENTS;

/// Lines that may share a block. What has been drawn is told block by block, and the look-ahead must not come to rest on a single one.
const SHARING: u16 = 32;

/// The block whose segments are being generated.
#[derive(Clone, Debug)]
pub(crate) struct Current {
    pub(crate) block: Block,
    /// Step events not yet in a segment.
    pub(crate) left: u32,
}

/// The queue of at most `BLOCKS` blocks, besides the one in execution.
#[derive(Debug)]
pub(crate) struct Planner<const BLOCKS: usize> {
    queue: Deque<Block, BLOCKS>,
    pub(crate) current: Option<Current>,
    /// Square of the speed at the end of the last generated segment, (mm/s)².
    pub(crate) speed_sqr: f32,
    /// Acceleration there, mm/s², where the jerk is limited.
    pub(crate) acceleration: f32,
    overrides: Overrides,
    /// Where the last block of the queue ends, and where it begins.
    tail: Tail,
    before: Tail,
    /// The lines in that block, while more may join them.
    run: Option<Run>,
    /// Lines appended since the start; wraps.
    lines: u32,
}

impl<const BLOCKS: usize> Planner<BLOCKS> {
    pub(crate) fn new() -> Self {
        const { assert!(BLOCKS >= 2, "look-ahead needs at least two blocks") };
        const { assert!(Self::LINES < u16::MAX as usize, "a block counts its lines in 16 bits") };
        Self {
            queue: Deque::new(),
            current: None,
            speed_sqr: 0.0,
            acceleration: 0.0,
            overrides: Overrides::default(),
            tail: Tail::default(),
            before: Tail::default(),
            run: None,
            lines: 0,
        }
    }

    /// Lines (chords of arcs) that may be appended and not drawn: as many as blocks share, in the queue, in execution and in the segments at the stepper.
    pub(crate) const LINES: usize = (BLOCKS + 1 + SEGMENTS) * SHARING as usize;

    /// Whether nothing is planned or in execution.
    pub(crate) fn is_empty(&self) -> bool {
        self.queue.is_empty() && self.current.is_none()
    }

    /// Whether no line fits, when `drawn` lines since the start have been.
    pub(crate) fn is_full(&self, drawn: u32) -> bool {
        self.queue.is_full() || self.free(drawn) == 0
    }

    /// Lines that still fit if they can share blocks, when `drawn` lines since the start have been. All others of [`Planner::LINES`] are not drawn yet.
    pub(crate) fn free(&self, drawn: u32) -> usize {
        Self::LINES.saturating_sub(self.lines.wrapping_sub(drawn) as usize)
    }

    pub(crate) fn overrides(&self) -> Overrides {
        self.overrides
    }

    /// Forgets all blocks; the machine stands at `steps` and has drawn `drawn` lines since the start.
    pub(crate) fn reset(&mut self, steps: [i32; AXES], drawn: u32, settings: &Settings) {
        self.queue.clear();
        self.current = None;
        self.speed_sqr = 0.0;
        self.acceleration = 0.0;
        self.tail = Tail::standing(steps, settings);
        self.run = None;
        self.lines = drawn;
    }

    /// Lines appended since the start; wraps.
    pub(crate) fn lines_appended(&self) -> u32 {
        self.lines
    }

    /// Where the last line that was long enough ends, machine mm.
    pub(crate) fn end(&self) -> [f64; AXES] {
        self.tail.mm
    }

    /// Square of the speed at the end of the current block.
    pub(crate) fn exit_sqr(&self) -> f32 {
        self.queue.front().map_or(0.0, |next| next.entry_sqr)
    }

    /// The blocks behind the current one: the ceiling of the square of the speed at which each is entered, and its length, mm. A last one, of no length, is the
    /// end.
    pub(crate) fn ahead(&self) -> impl Iterator<Item = (f32, f32)> {
        self.queue.iter().map(|block| (block.ceiling_sqr, block.length())).chain([(0.0, 0.0)])
    }

    /// Makes the next block current.
    pub(crate) fn advance(&mut self) -> Option<&mut Current> {
        self.current = self.queue.pop_front().map(|block| Current { left: block.events, block });
        if self.current.is_none() {
            self.speed_sqr = 0.0;
            self.acceleration = 0.0;
        }
        self.current.as_mut()
    }

    /// The current block has all its segments.
    pub(crate) fn finish_current(&mut self) {
        self.current = None;
        if self.queue.is_empty() {
            self.speed_sqr = 0.0;
            self.acceleration = 0.0;
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
    /// Cost: about 200 f32 and 30 f64 operations, and 6 f32 operations for each block whose entry rises.
    pub(crate) fn append(
        &mut self,
        target: [f64; AXES],
        speed: Speed,
        pen: Option<Pen>,
        line: u32,
        settings: &Settings,
    ) -> bool {
        if pen.is_none() && self.extend(target, speed, settings) {
            return true;
        }
        let Some((mut block, tail)) = self.tail.block(target, speed, self.overrides, settings) else {
            if let Some(last) = self.queue.back_mut() {
                // It is drawn when the block is of which it changes nothing.
                last.lines = last.lines.saturating_add(1);
                self.lines = self.lines.wrapping_add(1);
            }
            return false;
        };
        block.pen = pen;
        block.line = line;
        let from_rest = self.is_empty();
        if !from_rest {
            block.join(&self.tail, &tail, settings);
        }
        if self.queue.push_back(block).is_err() {
            return false;
        }
        self.run = Run::new(&self.tail, &tail, from_rest, settings);
        self.before = self.tail;
        self.tail = tail;
        self.lines = self.lines.wrapping_add(1);
        self.plan_backward(false);
        true
    }

    /// Lets the last block of the queue reach on to `target`, if the lines in it and this one lie on one line; else nothing has changed.
    fn extend(&mut self, target: [f64; AXES], speed: Speed, settings: &Settings) -> bool {
        let (Some(run), Some(last)) = (&mut self.run, self.queue.back_mut()) else { return false };
        let Some((mut block, tail)) = self.before.block(target, speed, self.overrides, settings) else { return false };
        if block.feed != last.feed || last.lines >= SHARING || !run.takes(&self.before, &tail) {
            return false;
        }
        if !run.from_rest {
            block.join(&self.before, &tail, settings);
        }
        // What was planned before must stay possible: the machine may be on its way to the old entry.
        block.entry_sqr = block.ceiling_sqr.min(2.0 * block.acceleration * block.length());
        if block.entry_sqr < last.entry_sqr {
            return false;
        }
        // The backward pass goes on to earlier blocks if this rises.
        block.entry_sqr = last.entry_sqr;
        (block.pen, block.line, block.lines) = (last.pen, last.line, last.lines + 1);
        *last = block;
        run.add(&self.before, &tail);
        self.tail = tail;
        self.lines = self.lines.wrapping_add(1);
        self.plan_backward(false);
        true
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
            (self.before.nominal, previous) = (previous, nominal);
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

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
        for (x, feed) in [(20.0, 6000.0), (20.1, 6001.0), (20.2, 6000.0), (60.0, 6001.0)] {
            planner.append([x, 0.0, 0.0], Speed::Feed(feed), None, 0, &settings);
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
                if !planner.is_full(0) {
                    planner.append(at, Speed::Feed(feed), None, 0, &settings);
                }
                check(&planner)?;
            }
            planner.set_overrides(Overrides { feed: override_percent, rapid: 100 });
            check(&planner)?;
        }
    }

    proptest! {
        /// What has been planned stays possible, whether a line becomes a block or joins one, and no line is lost count of.
        #[test]
        fn an_appended_line_only_raises_entries(
            lines in prop::collection::vec((-0.1..0.1f64, 0.002..0.3f64, 0..20u8, 0..4usize), 1..200),
        ) {
            let settings = Settings::default();
            let mut planner: Planner<8> = Planner::new();
            let (mut heading, mut at, mut drawn, mut blocks) = (0.0, [0.0; 3], 0, 0);
            for (number, (turn, way, kind, segments)) in (1..).zip(lines) {
                heading += if kind == 0 { 40.0 * turn } else { turn };
                at = [at[0] + way * libm::cos(heading), at[1] + way * libm::sin(heading), 0.0];
                if planner.is_full(drawn) {
                    while planner.next_segment(false).map(|c| count(&c, &mut drawn)).is_some() && planner.is_full(drawn) {}
                }
                let old: std::vec::Vec<f32> = planner.queue.iter().map(|block| block.entry_sqr).collect();
                let was_empty = planner.is_empty();
                blocks += u32::from(planner.append(at, Speed::Feed(6000.0), None, number, &settings));
                for (k, (old, new)) in old.iter().zip(&planner.queue).enumerate() {
                    prop_assert!(new.entry_sqr >= *old, "block {}: {} to {}", k, old, new.entry_sqr);
                }
                prop_assert!(!was_empty || planner.queue.front().is_none_or(|first| first.entry_sqr == 0.0));
                for _ in 0..segments {
                    if let Some(command) = planner.next_segment(false) {
                        count(&command, &mut drawn);
                    }
                }
            }
            while let Some(command) = planner.next_segment(false) {
                count(&command, &mut drawn);
            }
            prop_assert_eq!(planner.free(drawn), Planner::<8>::LINES);
            prop_assert!(drawn >= blocks);
            // What was less than a step at the end has not been made.
            prop_assert!(planner.tail.steps.iter().zip(at).all(|(&steps, mm)| (f64::from(steps) - mm * 80.0).abs() <= 1.0));
        }
    }

    fn count(command: &crate::Command, drawn: &mut u32) {
        if let crate::Command::Steps(segment) = command {
            *drawn += u32::from(segment.lines);
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
