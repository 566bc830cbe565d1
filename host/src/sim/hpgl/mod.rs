//! A plotter like the HP 7475A: a buffer, device control instructions that pass it by, and a pen.
//!
//! ```text
//!  bytes ──> ESC . … : at once ──> answers
//!    └─────> buffer (1024) ──> parser ──> two vectors ──> motion ──> ink
//! ```
//!
//! Bytes leave the buffer as the pen goes; what does not fit it is lost, and `ESC.E` says so when it is asked. Facts are those of HP's
//! *7475A Interfacing and Programming Manual*. Text is read and not drawn.

mod clip;
mod control;
mod instruction;
mod parser;

use std::collections::VecDeque;

use glam::DVec3;

use super::Recording;
use super::motion::{Motion, Move, Pencil, Sense};
use super::peer::{Peer, PeerError, Trouble};
use crate::device::{Hpgl as Language, Paper};
use crate::straight;
use clip::Window;
use control::Control;
use instruction::State;
use parser::Parser;

/// Bytes of the buffer.
const BUFFER: usize = 1024;
/// Vectors that are under way or next.
const VECTORS: usize = 2;
/// Speed of each axis in mm/s when nothing else is asked for: 38.1 cm/s.
const SPEED: f64 = 381.0;
/// 2 g for each axis, in mm/s².
const ACCELERATION: f64 = 19_600.0;
/// Time to lift or lower the pen, ns.
const LIFT_NS: u64 = 60_000_000;
/// Time to put a pen back and take another one, ns.
const CHANGE_NS: u64 = 3_000_000_000;
/// Time from power on until it listens, ns.
const BOOT_NS: u64 = 1_000_000_000;

/// What it does after an instruction was read, one after the other. Places are in plotter units.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Op {
    /// A vector, of which the part within the window is drawn.
    Vector([f64; 2]),
    /// A straight move, within the window.
    Go([f64; 2]),
    /// Lifts or lowers the pen.
    Tip(bool),
    /// Takes a pen; 0 puts it back.
    Take(u32),
    /// Nothing, until this time in ns.
    Until(u64),
    Answer(Question),
}

/// What output instructions ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Question {
    Actual,
    Commanded,
    Error,
    Factors,
    HardClip,
    Identification,
    Options,
    P1P2,
    Status,
    Window,
}

/// A plotter like the HP 7475A.
#[derive(Debug)]
pub(super) struct Hpgl {
    control: Control,
    buffer: VecDeque<u8>,
    lost: u32,
    output: VecDeque<u8>,
    parser: Parser,
    state: State,
    ops: VecDeque<Op>,
    motion: Motion,
    /// Length of a plotter unit, mm.
    unit: f64,
    /// Where the last vector ends, in plotter units, in the window or not.
    at: [f64; 2],
    /// The pen touches the paper, or would if there was one.
    tip: bool,
    /// VIEW is pressed until then, ns.
    view_until: u64,
    lever: bool,
    deaf_until: u64,
    hung: bool,
}

impl Hpgl {
    /// Switched on just now. Options: `buffer=BYTES`, `paper=NAME` (of the device's; its largest otherwise).
    pub(super) fn new(language: &Language, papers: &[Paper], options: &[(&str, &str)]) -> Result<Self, PeerError> {
        let area = |paper: &&Paper| {
            let length = |[from, to]: [i32; 2]| i64::from(to) - i64::from(from);
            length(paper.x_range) * length(paper.y_range)
        };
        let (mut size, mut paper) = (BUFFER, papers.iter().max_by_key(area));
        for &(key, value) in options {
            let bad = || PeerError::option("hpgl7475a", key, value);
            match key {
                "buffer" => size = value.parse().ok().filter(|n| *n >= 32).ok_or_else(bad)?,
                "paper" => paper = Some(papers.iter().find(|paper| paper.name == value).ok_or_else(bad)?),
                _ => return Err(bad()),
            }
        }
        let hard_clip =
            paper.map_or(Window::new([0, 16_158], [0, 11_040]), |paper| Window::new(paper.x_range, paper.y_range));
        let steps_per_mm = 1.0 / language.unit_mm;
        Ok(Self {
            control: Control::new(size),
            buffer: VecDeque::new(),
            lost: 0,
            output: VecDeque::new(),
            parser: Parser::default(),
            state: State::new(hard_clip),
            ops: VecDeque::new(),
            motion: Motion::new(VECTORS, Pencil::new(Sense::Told, DVec3::splat(steps_per_mm))),
            unit: language.unit_mm,
            at: [0.0; 2],
            tip: false,
            view_until: 0,
            lever: false,
            deaf_until: BOOT_NS,
            hung: false,
        })
    }

    fn say(&mut self, text: &str) {
        self.output.extend(text.bytes());
        self.output.extend(self.control.terminator());
    }

    fn now(&self) -> u64 {
        self.motion.now()
    }

    fn free(&self) -> usize {
        self.control.size().saturating_sub(self.buffer.len())
    }

    /// Neither VIEW nor the lever holds it up.
    fn is_ready(&self) -> bool {
        !self.hung && !self.lever && self.now() >= self.view_until && self.now() >= self.deaf_until
    }

    /// Says or shows whether there is room, as the handshake asks for.
    fn shake_hands(&mut self) {
        let free = self.free();
        let said = self.control.room(free);
        self.output.extend(said);
    }

    /// `ESC.O`.
    fn extended_status(&self) -> u32 {
        let view = self.now() < self.view_until;
        8 * u32::from(self.buffer.is_empty()) + 16 * u32::from(view && !self.lever) + 32 * u32::from(self.lever)
    }

    /// Forgets what it has to draw. The vectors that are under way are finished.
    fn abort(&mut self) {
        self.buffer.clear();
        self.parser = Parser::default();
        self.ops.clear();
        let end = self.motion.planned() / self.unit;
        self.at = [end.x, end.y];
        self.shake_hands();
    }

    fn obey(&mut self, order: control::Order) {
        match order {
            control::Order::Say(text) => self.say(&text),
            control::Order::Free => {
                let free = self.free();
                self.say(&free.to_string());
            }
            control::Order::Size => {
                let size = self.control.size();
                self.say(&size.to_string());
            }
            control::Order::Status => {
                let status = self.extended_status();
                self.say(&status.to_string());
            }
            control::Order::Abort => self.abort(),
            control::Order::Settled => self.shake_hands(),
        }
    }

    /// Does the first op, if it can be done now.
    fn operate(&mut self) -> bool {
        match self.ops.front() {
            None => return false,
            Some(Op::Until(time)) if self.now() < *time => return false,
            Some(Op::Go(_)) if self.motion.room() == 0 => return false,
            Some(Op::Tip(_) | Op::Take(_) | Op::Answer(_)) if !self.motion.is_done() => return false,
            Some(_) => {}
        }
        match self.ops.pop_front() {
            Some(Op::Vector(to)) => self.vector(to),
            Some(Op::Go([x, y])) => {
                let target = DVec3::new(x, y, 0.0) * self.unit;
                // Each axis has its own motor: along a diagonal the pen is √2 times as fast, and gets there √2 times as soon.
                let factor = straight::over_longest_axis(target - self.motion.planned());
                let (speed, acceleration) = (self.state.speed * factor, ACCELERATION * factor);
                self.motion.push(Move { target, speed, acceleration, rapid: false });
            }
            Some(Op::Tip(down)) if down != self.tip => {
                self.tip = down;
                self.motion.set_pen_down(down && self.state.pen > 0);
                self.ops.push_front(Op::Until(self.now().saturating_add(LIFT_NS)));
            }
            Some(Op::Take(pen)) if pen != self.state.pen => {
                self.state.pen = pen;
                self.tip = false;
                self.motion.set_pen_down(false);
                if pen > 0 {
                    self.motion.take_pen(pen);
                }
                self.ops.push_front(Op::Until(self.now().saturating_add(CHANGE_NS)));
            }
            Some(Op::Answer(question)) => self.answer(question),
            Some(Op::Tip(_) | Op::Take(_) | Op::Until(_)) | None => {}
        }
        true
    }

    /// Draws what of a vector is in the window; outside of it the pen is up.
    fn vector(&mut self, to: [f64; 2]) {
        let from = std::mem::replace(&mut self.at, to);
        let window = self.state.window;
        let mut ops = Vec::new();
        match window.clip(from, to).filter(|_| self.state.down) {
            Some([enter, leave]) => {
                if enter != from {
                    ops.extend([Op::Tip(false), Op::Go(enter)]);
                }
                ops.extend([Op::Tip(true), Op::Go(leave)]);
                if leave != to {
                    ops.push(Op::Tip(false));
                }
            }
            None => ops.extend([Op::Tip(false), Op::Go(window.nearest(to))]),
        }
        for op in ops.into_iter().rev() {
            self.ops.push_front(op);
        }
    }

    fn answer(&mut self, question: Question) {
        let pen = u32::from(self.state.down);
        let text = match question {
            Question::Actual => {
                let at = (self.motion.position() / self.unit).round();
                format!("{},{},{pen}", at.x, at.y)
            }
            Question::Commanded => {
                let [x, y] = self.state.to_user(self.at);
                format!("{x},{y},{pen}")
            }
            Question::Error => std::mem::take(&mut self.state.error).to_string(),
            Question::Factors => "40,40".to_owned(),
            Question::HardClip => self.state.hard_clip.to_string(),
            Question::Identification => "7475A".to_owned(),
            Question::Options => "0,1,0,0,1,0,0,0".to_owned(),
            Question::P1P2 => self.state.p1p2.to_string(),
            Question::Status => self.state.status().to_string(),
            Question::Window => self.state.window.to_string(),
        };
        self.say(&text);
    }

    /// Reads a byte out of the buffer. False when it is empty.
    fn read(&mut self) -> bool {
        let Some(byte) = self.buffer.pop_front() else { return false };
        for part in self.parser.take(byte) {
            let ops = self.state.part(part, self.at);
            self.ops.extend(ops);
        }
        self.shake_hands();
        true
    }
}

impl Peer for Hpgl {
    fn receive(&mut self, byte: u8) {
        if self.hung || self.now() < self.deaf_until {
            self.lost = self.lost.saturating_add(1);
            return;
        }
        match self.control.receive(byte) {
            control::Received::Data(byte) => {
                if self.free() == 0 {
                    self.lost = self.lost.saturating_add(1);
                    self.control.overflow();
                } else {
                    self.buffer.push_back(byte);
                    self.shake_hands();
                }
            }
            control::Received::Order(order) => self.obey(order),
            control::Received::Asked => self.shake_hands(),
            control::Received::Nothing => {}
        }
    }

    fn transmit(&mut self) -> Option<u8> {
        self.output.pop_front()
    }

    fn work(&mut self) -> bool {
        if !self.is_ready() {
            return false;
        }
        if self.motion.is_held() {
            self.motion.resume();
        }
        if self.ops.is_empty() { self.read() } else { self.operate() }
    }

    fn next_event(&self) -> u64 {
        if self.hung {
            return u64::MAX;
        }
        let later = |time: u64| if time > self.now() { time } else { u64::MAX };
        let wait = match self.ops.front() {
            Some(Op::Until(time)) if self.is_ready() => later(*time),
            _ => u64::MAX,
        };
        self.motion.next_event().min(wait).min(later(self.view_until)).min(later(self.deaf_until))
    }

    fn advance(&mut self, now: u64) {
        self.motion.advance(now);
    }

    fn ready_line(&self) -> Option<bool> {
        Some(self.control.ready_line() && !self.hung)
    }

    fn is_whole_answer(&self, bytes: &[u8]) -> bool {
        // A reply in words, or a character of the handshake.
        bytes.last().is_some_and(u8::is_ascii_control)
    }

    fn begins_acknowledgement(&self, _bytes: &[u8]) -> bool {
        true
    }

    fn suffer(&mut self, trouble: Trouble) {
        match trouble {
            Trouble::Error => self.parser.fail_next(),
            // Its nearest thing to a limit switch: the lever that lets go of the paper.
            Trouble::Alarm => {
                self.lever = true;
                self.motion.hold();
            }
            Trouble::Reset => {
                self.motion.abort();
                self.motion.set_pen_down(false);
                let at = self.motion.position() / self.unit;
                self.at = [at.x, at.y];
                self.tip = false;
                self.buffer.clear();
                self.output.clear();
                self.ops.clear();
                self.parser = Parser::default();
                self.control = Control::new(self.control.most());
                self.state = State::new(self.state.hard_clip);
                self.view_until = 0;
                self.deaf_until = self.now().saturating_add(BOOT_NS);
            }
            Trouble::Hang => {
                self.motion.abort();
                self.output.clear();
                self.hung = true;
            }
            Trouble::PenChange { ns } => {
                self.view_until = self.now().saturating_add(ns);
                self.motion.hold();
            }
        }
    }

    fn is_moving(&self) -> bool {
        self.motion.is_moving()
    }

    fn recording(&self) -> Recording {
        self.motion.recording(self.lost)
    }
}

#[cfg(test)]
mod tests;
