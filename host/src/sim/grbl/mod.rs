//! A controller with GRBL 1.1h or one of its descendants, written from what GRBL does and not from penvis's firmware.
//!
//! ```text
//!  bytes ──> real-time characters: at once
//!    └─────> receive ring (128) ──> line ──> parser ──> orders ──> planner (15 moves) ──> motion ──> ink
//! ```
//!
//! The main loop does one thing at a time: while an order waits (for room in the planner, for the motion to end, for a dwell) no
//! line is read, and the ring fills up. What does not fit it is lost without a word.

mod arc;
mod dialect;
mod gcode;
mod realtime;
mod report;
mod settings;
mod system;
mod words;

use std::collections::VecDeque;

use glam::DVec3;

use super::Recording;
use super::motion::{Motion, Move, Pencil, Sense};
use super::peer::{Peer, PeerError, Trouble};
use crate::device::Pen;
pub(super) use dialect::Dialect;
use gcode::{Order, Parser, Place};
use report::Counters;
use settings::Settings;
use words::{LOCKED, OVERFLOW, Refusal, UNSUPPORTED};

const NS_PER_S: f64 = 1e9;
/// Time that the boot loader takes, in ns.
const BOOT_NS: u64 = 1_000_000_000;
/// Time that writing the EEPROM takes, in ns; what arrives meanwhile is lost.
const STORE_NS: u64 = 40_000_000;
/// Height of the upper end of the Z axis above where it was switched on, in mm.
const Z_TOP: f64 = 10.0;

/// What the main loop does after a line was read, one after the other.
#[derive(Clone, Debug, PartialEq)]
enum Op {
    Order(Order),
    /// Nothing, until this time in ns.
    Until(u64),
    /// Waits for the motion to end, and then for so many ns.
    Rest(u64),
    Say(String),
    /// Greets after the boot loader.
    Greet,
    /// Waits for the homing moves to end.
    Homed,
    /// Stops for a soft limit.
    SoftLimit,
}

/// Characters that are left out until something comes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Skip {
    #[default]
    Nothing,
    Parenthesis,
    Semicolon,
    Overflow,
}

/// What locks it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Lock {
    #[default]
    None,
    /// Until `$X` or `$H`.
    Alarm,
    /// Until a reset: it listens to nothing else.
    Critical,
    /// Until a reset.
    Sleep,
}

/// A controller with GRBL, and its mechanics.
#[derive(Debug)]
pub(super) struct Grbl {
    dialect: Dialect,
    ring_size: usize,
    ring: VecDeque<u8>,
    lost: u32,
    output: VecDeque<u8>,
    line: Vec<u8>,
    skip: Skip,
    /// The line before ended in `\r`.
    returned: bool,
    /// What lines are refused with since the last empty one.
    refused: Option<Refusal>,
    ops: VecDeque<Op>,
    /// Until when nothing that arrives is noticed, ns.
    deaf_until: u64,
    blocks: usize,
    motion: Motion,
    /// Where the machine's zero is, in mm of the mechanism.
    zero: DVec3,
    settings: Settings,
    parser: Parser,
    start_lines: [String; 2],
    lock: Lock,
    check: bool,
    door: bool,
    homing: bool,
    jogging: bool,
    /// A jog that is to be forgotten once it has come to rest.
    jog_cancelled: bool,
    /// A status was asked for while it could not be told.
    status_wanted: bool,
    counters: Counters,
    /// Percent of the speed of feeds and of rapid moves, and of the spindle.
    overrides: [u32; 3],
    /// The S in force; none when the spindle is off.
    spindle: Option<f32>,
    /// The spindle is off while it is held.
    spindle_stopped: bool,
    servo: Option<Servo>,
    /// The next line is refused, whatever it says.
    refuses: bool,
    /// When somebody presses the button that resumes, ns.
    button_at: u64,
    hung: bool,
}

/// A servo on the spindle's output: parts of the full level with the pen up and down.
#[derive(Clone, Copy, Debug)]
struct Servo {
    up: f32,
    down: f32,
}

impl Grbl {
    /// Switched on just now. Options are settings (`$32=1` or `32=1`), `rx=BYTES` and `blocks=N`.
    pub(super) fn new(dialect: Dialect, pen: &Pen, options: &[(&str, &str)]) -> Result<Self, PeerError> {
        let mut settings = Settings::default();
        let (mut ring_size, mut blocks) = (dialect.ring(), dialect.blocks());
        for &(key, value) in options {
            let bad = || PeerError::option(dialect.name(), key, value);
            match key.strip_prefix('$').unwrap_or(key) {
                "rx" => ring_size = value.parse().ok().filter(|n| *n >= 16).ok_or_else(bad)?,
                "blocks" => blocks = value.parse().ok().filter(|n| *n >= 1).ok_or_else(bad)?,
                number => {
                    let number = number.parse().map_err(|_| bad())?;
                    let value = value.parse::<f32>().ok().filter(|v| v.is_finite()).ok_or_else(bad)?;
                    settings.set(number, value).map_err(|_| bad())?;
                }
            }
        }
        let [x, y, z] = settings.axes(100).map(f64::from);
        let (sense, servo) = match *pen {
            Pen::Z { up_mm, down_mm, .. } => (Sense::Z(f64::midpoint(up_mm, down_mm)), None),
            Pen::Servo { up, down, .. } => {
                let level = |s: u32| level(&settings, s as f32);
                (Sense::Told, Some(Servo { up: level(up), down: level(down) }))
            }
        };
        let motion = Motion::new(blocks, Pencil::new(sense, DVec3::new(x, y, z)));
        Ok(Self {
            dialect,
            ring_size,
            ring: VecDeque::new(),
            lost: 0,
            output: VecDeque::new(),
            line: Vec::new(),
            skip: Skip::Nothing,
            returned: false,
            refused: None,
            ops: VecDeque::from([Op::Until(BOOT_NS), Op::Greet]),
            deaf_until: BOOT_NS,
            blocks,
            motion,
            zero: DVec3::ZERO,
            lock: if settings.is_on(22) { Lock::Alarm } else { Lock::None },
            settings,
            parser: Parser::new(),
            start_lines: [String::new(), String::new()],
            check: false,
            door: false,
            homing: false,
            jogging: false,
            jog_cancelled: false,
            status_wanted: false,
            counters: Counters::default(),
            overrides: [100; 3],
            spindle: None,
            spindle_stopped: false,
            servo,
            refuses: false,
            button_at: u64::MAX,
            hung: false,
        })
    }

    fn say(&mut self, text: &str) {
        self.output.extend(text.bytes());
    }

    fn now(&self) -> u64 {
        self.motion.now()
    }

    fn steps_per_mm(&self) -> DVec3 {
        DVec3::from(self.settings.axes(100).map(f64::from))
    }

    /// The machine position in mm, as it counts its steps.
    fn machine_position(&self) -> DVec3 {
        let steps_per_mm = self.steps_per_mm();
        ((self.motion.position() - self.zero) * steps_per_mm).round() / steps_per_mm
    }

    /// The parser goes on from where the machine is.
    fn synchronize(&mut self) {
        self.parser.modal.position = self.machine_position().to_array().map(|mm| mm as f32);
    }

    /// Whether the main loop stands still.
    fn is_suspended(&self) -> bool {
        self.hung || self.motion.is_held() || matches!(self.lock, Lock::Critical | Lock::Sleep)
    }

    /// Sets the servo as the spindle's state says.
    fn set_pen(&mut self) {
        let Some(servo) = self.servo else { return };
        let level = match self.spindle {
            Some(s) if !self.spindle_stopped => level(&self.settings, s * self.overrides[2] as f32 / 100.0),
            _ => 0.0,
        };
        let off = self.spindle.is_none() || self.spindle_stopped;
        self.motion.set_pen_down(!off && (level - servo.down).abs() < (level - servo.up).abs());
    }

    /// Does the first op, if it can be done now.
    fn operate(&mut self) -> bool {
        match self.ops.front() {
            None => return false,
            Some(Op::Until(time)) if self.now() < *time => return false,
            Some(Op::Rest(_) | Op::Homed | Op::SoftLimit) if !self.motion.is_done() => return false,
            Some(Op::Order(order)) => return self.order(*order),
            Some(_) => {}
        }
        match self.ops.pop_front() {
            Some(Op::Rest(ns)) => self.ops.push_front(Op::Until(self.now().saturating_add(ns))),
            Some(Op::Say(text)) => self.say(&text),
            Some(Op::Greet) => self.greet(),
            Some(Op::Homed) => self.homed(),
            Some(Op::SoftLimit) => self.alarm(2),
            Some(Op::Until(_) | Op::Order(_)) | None => {}
        }
        true
    }

    /// Carries out the order at the front, if it can be done now.
    fn order(&mut self, order: Order) -> bool {
        let ns = |seconds: f32| (f64::from(seconds) * NS_PER_S) as u64;
        let laser = self.settings.is_on(32);
        let next = match order {
            _ if self.check => None,
            Order::Line { target, feed } => {
                if !self.within_travel(target) && self.settings.is_on(20) {
                    self.ops.clear();
                    self.ops.push_back(Op::SoftLimit);
                    return true;
                }
                if self.motion.room() == 0 {
                    return false;
                }
                let next = self.plan(target, feed);
                self.motion.push(next);
                None
            }
            Order::Spindle(speed) => {
                if !laser && !self.motion.is_done() {
                    return false;
                }
                self.spindle = speed;
                self.set_pen();
                None
            }
            Order::Dwell(seconds) => Some(Op::Rest(ns(seconds))),
            Order::Pause | Order::End | Order::Store if !self.motion.is_done() => return false,
            Order::Store => None,
            Order::Pause => {
                self.motion.hold();
                None
            }
            Order::End => {
                self.overrides = [100; 3];
                self.motion.set_factors([1.0; 2]);
                self.say("[MSG:Pgm End]\r\n");
                None
            }
        };
        self.ops.pop_front();
        if order == Order::Store && !self.check {
            self.store();
        }
        if let Some(op) = next {
            self.ops.push_front(op);
        }
        true
    }

    /// Writes the EEPROM.
    fn store(&mut self) {
        let stored = self.now() + STORE_NS;
        if self.dialect.is_deaf_while_storing() {
            self.deaf_until = stored;
        }
        self.ops.push_front(Op::Until(stored));
    }

    fn within_travel(&self, target: Place) -> bool {
        let travel = self.settings.axes(130);
        target.iter().zip(travel).all(|(at, travel)| (-travel..=0.0).contains(at))
    }

    /// The move to a machine position.
    fn plan(&self, target: Place, feed: Option<f32>) -> Move {
        let steps_per_mm = self.settings.axes(100);
        let target: [f64; 3] = std::array::from_fn(|axis| {
            f64::from((target[axis] * steps_per_mm[axis]).round() as i32) / f64::from(steps_per_mm[axis])
        });
        let target = DVec3::from(target) + self.zero;
        let direction = (target - self.motion.planned()).normalize_or_zero().abs();
        let along = |limits: [f32; 3]| {
            let limits = limits.map(f64::from);
            (0..3)
                .filter(|axis| direction[*axis] > 0.0)
                .map(|axis| limits[axis] / direction[axis])
                .fold(f64::MAX, f64::min)
        };
        let most = along(self.settings.axes(110)) / 60.0;
        let speed = feed.map_or(most, |feed| most.min(f64::from(feed) / 60.0));
        Move { target, speed, acceleration: along(self.settings.axes(120)), rapid: feed.is_none() }
    }

    /// Reads from the ring up to the end of a line. False when nothing is there.
    fn read(&mut self) -> bool {
        let Some(byte) = self.ring.pop_front() else { return false };
        let returned = std::mem::replace(&mut self.returned, byte == b'\r');
        match (byte, self.skip) {
            (b'\n', _) if returned && !self.dialect.ends_lines_twice() => {}
            (b'\n' | b'\r', skip) => {
                let line = std::mem::take(&mut self.line);
                self.skip = Skip::Nothing;
                let too_long = skip == Skip::Overflow && !self.dialect.cuts_lines_off();
                let answer = if too_long { Err(OVERFLOW) } else { self.execute(&line) };
                match answer {
                    Ok(()) => self.ops.push_back(Op::Say("ok\r\n".to_owned())),
                    Err(Refusal(code)) => self.say(&format!("error:{code}\r\n")),
                }
            }
            (b')', Skip::Parenthesis) => self.skip = Skip::Nothing,
            (_, Skip::Parenthesis | Skip::Semicolon | Skip::Overflow) | (..=b' ' | b'/', _) => {}
            (b'(', _) => self.skip = Skip::Parenthesis,
            (b';', _) => self.skip = Skip::Semicolon,
            _ if self.line.len() == self.dialect.line_max() => self.skip = Skip::Overflow,
            _ => self.line.push(byte.to_ascii_uppercase()),
        }
        true
    }

    /// Takes a line, cleaned.
    fn execute(&mut self, line: &[u8]) -> Result<(), Refusal> {
        if std::mem::take(&mut self.refuses) {
            self.refused = Some(UNSUPPORTED).filter(|_| self.dialect.refuses_on());
            return Err(UNSUPPORTED);
        }
        match line.split_first() {
            None => {
                self.refused = None;
                Ok(())
            }
            Some((b'$', command)) => {
                let answer = self.system(command);
                self.refused = answer.err().filter(|_| self.dialect.refuses_on());
                answer
            }
            Some(_) if self.lock != Lock::None || self.jogging => Err(LOCKED),
            Some(_) => match self.refused.map_or_else(|| self.parser.block(line, &self.settings), Err) {
                Ok(orders) => {
                    self.ops.extend(orders.into_iter().map(Op::Order));
                    Ok(())
                }
                Err(refusal) => {
                    self.refused = Some(refusal).filter(|_| self.dialect.refuses_on());
                    Err(refusal)
                }
            },
        }
    }

    /// Stops and locks itself, for the reason of this number.
    fn alarm(&mut self, code: u8) {
        self.stop_dead();
        self.lock = Lock::Critical;
        self.say(&format!("ALARM:{code}\r\n[MSG:Reset to continue]\r\n"));
    }

    /// Ends all motion at once. Whether there was any.
    fn stop_dead(&mut self) -> bool {
        let moving = self.motion.is_moving();
        let counted = self.motion.abort();
        // The mechanism has run on, and nobody counted that.
        self.zero += self.motion.position() - counted;
        self.ops.clear();
        self.homing = false;
        self.jogging = false;
        self.jog_cancelled = false;
        moving
    }

    /// Everything that a reset forgets, and the banner.
    fn greet(&mut self) {
        self.ring.clear();
        self.line.clear();
        self.skip = Skip::Nothing;
        self.check = false;
        self.door = false;
        self.overrides = [100; 3];
        self.motion.set_factors([1.0; 2]);
        self.spindle = None;
        self.spindle_stopped = false;
        self.set_pen();
        self.button_at = u64::MAX;
        self.counters = Counters::default();
        self.parser.modal = gcode::Modal::at([0.0; 3]);
        self.synchronize();
        self.returned = false;
        self.refused = None;
        self.say(self.dialect.banner());
        if self.lock != Lock::None {
            self.lock = Lock::Alarm;
            self.say("[MSG:'$H'|'$X' to unlock]\r\n");
            return;
        }
        for line in self.start_lines.clone() {
            if line.is_empty() {
                continue;
            }
            let answer = match self.execute(line.as_bytes()) {
                Ok(()) => "ok".to_owned(),
                Err(Refusal(code)) => format!("error:{code}"),
            };
            self.ops.push_back(Op::Say(format!(">{line}:{answer}\r\n")));
        }
    }
}

/// Part of the full output of the spindle for an S, through `$30` and `$31`.
fn level(settings: &Settings, s: f32) -> f32 {
    let (most, least) = (settings.get(30), settings.get(31));
    if least >= most || s >= most {
        1.0
    } else if s <= 0.0 {
        0.0
    } else {
        // The lowest level that is not off is one of 255.
        ((s - least) / (most - least)).max(1.0 / 255.0)
    }
}

impl Peer for Grbl {
    fn receive(&mut self, byte: u8) {
        if self.hung || self.now() < self.deaf_until {
            self.lost = self.lost.saturating_add(1);
        } else if !self.realtime(byte) {
            if self.ring.len() < self.ring_size {
                self.ring.push_back(byte);
            } else {
                self.lost = self.lost.saturating_add(1);
            }
        }
    }

    fn transmit(&mut self) -> Option<u8> {
        self.output.pop_front()
    }

    fn work(&mut self) -> bool {
        if self.jogging && self.motion.is_done() {
            self.jogging = false;
        }
        if self.jog_cancelled && !self.motion.is_moving() {
            self.motion.abort();
            self.ops.retain(|op| !matches!(op, Op::Order(_)));
            self.jogging = false;
            self.jog_cancelled = false;
            self.synchronize();
        }
        if self.is_suspended() {
            return false;
        }
        if self.ops.is_empty() { self.read() } else { self.operate() }
    }

    fn next_event(&self) -> u64 {
        if self.hung {
            return u64::MAX;
        }
        let wait = match self.ops.front() {
            Some(Op::Until(time)) if *time > self.now() && !self.is_suspended() => *time,
            _ => u64::MAX,
        };
        self.motion.next_event().min(wait).min(self.button_at)
    }

    fn advance(&mut self, now: u64) {
        self.motion.advance(now);
        if now >= self.button_at {
            self.button_at = u64::MAX;
            self.resume();
        }
    }

    fn suffer(&mut self, trouble: Trouble) {
        match trouble {
            Trouble::Error => self.refuses = true,
            Trouble::Alarm => self.alarm(1),
            Trouble::Reset => {
                self.stop_dead();
                self.output.clear();
                // It counts from where it is.
                self.zero = self.motion.position();
                self.spindle = None;
                self.set_pen();
                self.lock = if self.settings.is_on(22) { Lock::Alarm } else { Lock::None };
                self.deaf_until = self.now().saturating_add(BOOT_NS);
                self.ops.extend([Op::Until(self.deaf_until), Op::Greet]);
            }
            Trouble::Hang => {
                self.stop_dead();
                self.hung = true;
            }
            Trouble::PenChange { ns } => {
                self.hold();
                self.button_at = self.now().saturating_add(ns);
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
