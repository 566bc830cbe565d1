//! A controller with Marlin 2, as far as a plotter needs it.
//!
//! ```text
//!  bytes ──> receive ring (128) ──> line: number, checksum ──> 4 commands ──> planner (15 moves) ──> motion ──> ink
//!                                     └── not as it should be: `Error:…`, ring emptied, `Resend: n`
//! ```
//!
//! A command is answered when it was carried out, which for a move is when the planner has it. Blank lines earn nothing. Lines without a
//! number are obeyed unchecked.

mod command;
mod queue;

use std::collections::VecDeque;

use glam::DVec3;

use super::Recording;
use super::motion::{Motion, Move, Pencil, Sense};
use super::peer::{Peer, PeerError, Trouble};
use crate::device::Pen;
use command::State;
use queue::Queue;

/// Moves that the planner holds.
const BLOCKS: usize = 15;
/// Time that the boot loader takes, in ns.
const BOOT_NS: u64 = 1_000_000_000;
/// Time between signs of life while a command is carried out, in ns.
const BUSY_NS: u64 = 2_000_000_000;

/// What a command does, one after the other.
#[derive(Clone, Debug, PartialEq)]
enum Op {
    Move(Move),
    /// Waits for the motion to end, and then for so many ns.
    Rest(u64),
    /// Nothing, until this time in ns.
    Until(u64),
    /// Turns a servo, at once.
    Servo(f32),
    Say(String),
    /// Waits for the motion to end and then for its user, or for so many ns.
    User(Option<u64>),
    /// These axes are where they count 0.
    Homed([bool; 3]),
}

/// A controller with Marlin, and its mechanics.
#[derive(Debug)]
pub(super) struct Marlin {
    queue: Queue,
    output: VecDeque<u8>,
    /// Of the command that is carried out; empty when none is.
    ops: VecDeque<Op>,
    /// A command is carried out.
    at_work: bool,
    motion: Motion,
    /// Where it counts 0, in mm of the mechanism.
    zero: DVec3,
    state: State,
    servo: Option<Servo>,
    advanced_ok: bool,
    /// Waits for its user, until they press the button (ns) or `M108` comes.
    user_until: Option<u64>,
    /// When it says that it is busy, ns.
    busy_at: u64,
    deaf_until: u64,
    /// The next command fails, whatever it is.
    fails: bool,
    /// Halted for good: it answers nothing but a reset.
    halted: bool,
}

/// Angles of the servo with the pen up and down, in degrees.
#[derive(Clone, Copy, Debug)]
struct Servo {
    index: u32,
    up: f32,
    down: f32,
}

impl Marlin {
    /// Switched on just now. Options: `advanced-ok=1`, `resend-ok=0`, `bufsize=N`, `rx=BYTES`, `inch=1`.
    pub(super) fn new(pen: &Pen, options: &[(&str, &str)]) -> Result<Self, PeerError> {
        let (mut advanced_ok, mut inch) = (false, false);
        let mut queue = Queue::default();
        for &(key, value) in options {
            let bad = || PeerError::option("marlin", key, value);
            let switch = || match value {
                "0" => Ok(false),
                "1" => Ok(true),
                _ => Err(bad()),
            };
            match key {
                "advanced-ok" => advanced_ok = switch()?,
                "resend-ok" => queue.resend_ok = switch()?,
                "inch" => inch = switch()?,
                "bufsize" => queue.size = value.parse().ok().filter(|n| *n >= 1).ok_or_else(bad)?,
                "rx" => queue.ring_size = value.parse().ok().filter(|n| *n >= 16).ok_or_else(bad)?,
                _ => return Err(bad()),
            }
        }
        let (sense, servo) = match *pen {
            Pen::Z { up_mm, down_mm, .. } => (Sense::Z(f64::midpoint(up_mm, down_mm)), None),
            Pen::Servo { index, up, down, .. } => {
                (Sense::Told, Some(Servo { index, up: up as f32, down: down as f32 }))
            }
        };
        let state = State::new(inch);
        let mut marlin = Self {
            queue,
            output: VecDeque::new(),
            ops: VecDeque::new(),
            at_work: false,
            motion: Motion::new(BLOCKS, Pencil::new(sense, state.steps_per_mm())),
            zero: DVec3::ZERO,
            state,
            servo,
            advanced_ok,
            user_until: None,
            busy_at: u64::MAX,
            deaf_until: 0,
            fails: false,
            halted: false,
        };
        marlin.boot();
        Ok(marlin)
    }

    fn say(&mut self, text: &str) {
        self.output.extend(text.bytes());
    }

    fn now(&self) -> u64 {
        self.motion.now()
    }

    /// Starts anew; the banner comes after the boot loader.
    fn boot(&mut self) {
        self.queue.restart();
        self.deaf_until = self.now().saturating_add(BOOT_NS);
        self.user_until = None;
        self.busy_at = u64::MAX;
        self.fails = false;
        self.halted = false;
        self.at_work = false;
        let banner = "start\nMarlin 2.1.2.5\n\necho: Last Updated: 2024-11-01 | Author: (none, default config)\n\
                      echo: Compiled: Nov  1 2024\necho: Free Memory: 5000  PlannerBufferBytes: 1232\n\
                      echo:Hardcoded Default Settings Loaded\n";
        self.ops = VecDeque::from([Op::Until(self.deaf_until), Op::Say(banner.to_owned())]);
    }

    /// Stops at once, and forgets all moves.
    fn stop_dead(&mut self) {
        let counted = self.motion.abort();
        self.state.position = (counted - self.zero).to_array().map(|mm| mm as f32);
        // The motors have run on, and nobody counted that.
        self.zero += self.motion.position() - counted;
        self.ops.clear();
        self.user_until = None;
    }

    /// `M112`, and what it does to itself: only a reset brings it back.
    fn kill(&mut self) {
        self.stop_dead();
        self.halted = true;
        self.queue.restart();
        self.say("Error:Printer halted. kill() called!\n");
    }

    /// `M410`.
    fn quick_stop(&mut self) {
        self.stop_dead();
        if self.at_work {
            self.finish();
        }
    }

    /// Obeys what is obeyed while it is read.
    fn at_once(&mut self, urgent: queue::Urgent) {
        match urgent {
            queue::Urgent::Continue => {
                if self.user_until.is_some() {
                    self.user_until = Some(self.now());
                }
            }
            queue::Urgent::Kill => self.kill(),
            queue::Urgent::QuickStop => self.quick_stop(),
        }
    }

    /// Takes the next command, if there is one.
    fn begin(&mut self) -> bool {
        let Some(text) = self.queue.front() else { return false };
        let text = text.to_owned();
        self.at_work = true;
        self.busy_at = self.now().saturating_add(BUSY_NS);
        if std::mem::take(&mut self.fails) {
            self.say("Error:Command failed\n");
        } else {
            let count = (self.motion.position() - self.zero) * self.state.steps_per_mm();
            let ops = self.state.command(&text, count.round(), self.zero, self.servo.map(|servo| servo.index));
            self.ops.extend(ops);
        }
        true
    }

    /// The command is carried out.
    fn finish(&mut self) {
        self.at_work = false;
        self.busy_at = u64::MAX;
        let number = self.queue.pop();
        match (self.advanced_ok, number) {
            (false, _) => self.say("ok\n"),
            (true, number) => {
                let number = number.map_or(String::new(), |n| format!(" N{n}"));
                let text = format!("ok{number} P{} B{}\n", self.motion.room(), self.queue.free());
                self.say(&text);
            }
        }
    }

    /// Does the first op, if it can be done now.
    fn operate(&mut self) -> bool {
        match self.ops.front() {
            None => return false,
            Some(Op::Until(time)) if self.now() < *time => return false,
            Some(Op::Move(_)) if self.motion.room() == 0 => return false,
            Some(Op::Rest(_) | Op::User(_) | Op::Homed(_)) if !self.motion.is_done() => return false,
            Some(_) => {}
        }
        match self.ops.pop_front() {
            Some(Op::Move(next)) => self.motion.push(next),
            Some(Op::Rest(ns)) => self.ops.push_front(Op::Until(self.now().saturating_add(ns))),
            Some(Op::Servo(angle)) => {
                if let Some(servo) = self.servo {
                    self.motion.set_pen_down((angle - servo.down).abs() < (angle - servo.up).abs());
                }
            }
            Some(Op::Say(text)) => self.say(&text),
            Some(Op::User(ns)) => {
                self.user_until = Some(ns.map_or(u64::MAX, |ns| self.now().saturating_add(ns)));
            }
            Some(Op::Homed(axes)) => {
                for axis in (0..3).filter(|axis| axes[*axis]) {
                    self.zero[axis] = self.motion.position()[axis];
                }
            }
            Some(Op::Until(_)) | None => {}
        }
        true
    }
}

impl Peer for Marlin {
    fn receive(&mut self, byte: u8) {
        let deaf = self.halted || self.now() < self.deaf_until;
        if let Some(urgent) = self.queue.receive(byte, deaf) {
            self.at_once(urgent);
        }
    }

    fn transmit(&mut self) -> Option<u8> {
        self.output.pop_front()
    }

    fn work(&mut self) -> bool {
        if self.halted {
            return false;
        }
        if let Some(text) = self.queue.read() {
            self.say(&text);
            return true;
        }
        if let Some(until) = self.user_until {
            if self.now() < until {
                return false;
            }
            self.user_until = None;
            return true;
        }
        if !self.ops.is_empty() {
            return self.operate();
        }
        if self.at_work {
            self.finish();
            return true;
        }
        self.begin()
    }

    fn next_event(&self) -> u64 {
        if self.halted {
            return u64::MAX;
        }
        let later = |time: u64| if time > self.now() { time } else { u64::MAX };
        let wait = match (self.user_until, self.ops.front()) {
            (Some(until), _) => later(until),
            (None, Some(Op::Until(time))) => later(*time),
            _ => u64::MAX,
        };
        self.motion.next_event().min(wait).min(self.busy_at)
    }

    fn advance(&mut self, now: u64) {
        self.motion.advance(now);
        if now >= self.busy_at {
            self.busy_at = now.saturating_add(BUSY_NS);
            let text = if self.user_until.is_some() { "paused for user" } else { "processing" };
            self.say(&format!("echo:busy: {text}\n"));
        }
    }

    fn suffer(&mut self, trouble: Trouble) {
        match trouble {
            Trouble::Error => self.fails = true,
            Trouble::Alarm => self.kill(),
            Trouble::Reset => {
                self.motion.abort();
                self.output.clear();
                self.zero = self.motion.position();
                self.state = State::new(self.state.inch);
                self.motion.set_pen_down(false);
                self.boot();
            }
            Trouble::Hang => {
                self.motion.abort();
                self.output.clear();
                self.halted = true;
            }
            Trouble::PenChange { ns } => {
                // What it carries out goes on when the user is ready.
                self.user_until = Some(self.now().saturating_add(ns));
                self.busy_at = self.busy_at.min(self.now().saturating_add(BUSY_NS));
            }
        }
    }

    fn is_moving(&self) -> bool {
        self.motion.is_moving()
    }

    fn recording(&self) -> Recording {
        self.motion.recording(self.queue.lost)
    }
}

#[cfg(test)]
mod tests;
