//! The `$` commands.

use glam::DVec3;

use super::words::{INVALID_STATEMENT, NOT_IDLE, Refusal, TRAVEL_EXCEEDED, number};
use super::{Grbl, Lock, NS_PER_S, Op, Order, Z_TOP};
use crate::sim::motion::Move;

const HELP: &str = "[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]\r\n";

impl Grbl {
    /// Takes a line that began with `$`.
    pub(super) fn system(&mut self, command: &[u8]) -> Result<(), Refusal> {
        match command {
            b"" => {
                self.say(HELP);
                return Ok(());
            }
            b"G" => {
                let text = self.parser.modal.report(self.settings.is_on(13));
                self.say(&text);
                return Ok(());
            }
            b"$" => {
                if !self.motion.is_done() || self.motion.is_held() {
                    return Err(NOT_IDLE);
                }
                let text = self.settings.list();
                self.say(&text);
                return Ok(());
            }
            b"C" => return self.toggle_check(),
            b"X" => {
                if self.lock == Lock::Alarm {
                    self.lock = Lock::None;
                    self.say("[MSG:Caution: Unlocked]\r\n");
                }
                return Ok(());
            }
            _ => {}
        }
        if let Some(line) = command.strip_prefix(b"J=") {
            return self.jog(line);
        }
        // All others are for a machine at rest.
        if !self.motion.is_done() || self.check || self.jogging {
            return Err(NOT_IDLE);
        }
        match command {
            b"#" => {
                let text = self.parameters();
                self.say(&text);
            }
            b"I" => {
                let text = self.dialect.build(self.blocks, self.ring_size);
                self.say(&text);
            }
            b"N" => {
                let [a, b] = &self.start_lines;
                let text = format!("$N0={a}\r\n$N1={b}\r\n");
                self.say(&text);
            }
            b"H" => {
                self.settings.homing()?;
                self.home();
            }
            b"SLP" => {
                self.lock = Lock::Sleep;
                self.spindle = None;
                self.set_pen();
                self.say("[MSG:Sleeping]\r\n");
            }
            b"RST=$" | b"RST=#" | b"RST=*" => {
                if command != b"RST=#" {
                    self.settings = super::Settings::default();
                }
                if command != b"RST=$" {
                    self.parser.places = Default::default();
                }
                self.say("[MSG:Restoring defaults]\r\n");
                self.store();
            }
            _ => return self.set(command),
        }
        Ok(())
    }

    /// `$x=value` and `$Nx=line`.
    fn set(&mut self, command: &[u8]) -> Result<(), Refusal> {
        if let Some(rest) = command.strip_prefix(b"N") {
            let (index, line) = match rest {
                [b'0', b'=', line @ ..] => (0, line),
                [b'1', b'=', line @ ..] => (1, line),
                _ => return Err(INVALID_STATEMENT),
            };
            if self.lock != Lock::None {
                return Err(NOT_IDLE);
            }
            let orders = self.parser.block(line, &self.settings)?;
            self.ops.extend(orders.into_iter().map(Op::Order));
            self.start_lines[index] = String::from_utf8_lossy(line).into_owned();
            self.store();
            return Ok(());
        }
        let (at, rest) = number(command).ok_or(INVALID_STATEMENT)?;
        let value = rest.strip_prefix(b"=").ok_or(INVALID_STATEMENT)?;
        let (value, rest) = number(value).ok_or(super::words::BAD_NUMBER)?;
        if !rest.is_empty() || at.fract() != 0.0 || !(0.0..=255.0).contains(&at) {
            return Err(INVALID_STATEMENT);
        }
        self.settings.set(at as u8, value)?;
        self.store();
        Ok(())
    }

    fn toggle_check(&mut self) -> Result<(), Refusal> {
        if self.check {
            self.say("[MSG:Disabled]\r\n");
            self.reset();
        } else if self.lock != Lock::None || !self.motion.is_done() {
            return Err(NOT_IDLE);
        } else {
            self.check = true;
            self.say("[MSG:Enabled]\r\n");
        }
        Ok(())
    }

    fn jog(&mut self, line: &[u8]) -> Result<(), Refusal> {
        if self.lock != Lock::None || self.check || !(self.motion.is_done() || self.jogging) {
            return Err(NOT_IDLE);
        }
        let before = self.parser.clone();
        let order = self.parser.jog(line)?;
        if let Order::Line { target, .. } = order
            && self.settings.is_on(20)
            && !self.within_travel(target)
        {
            self.parser = before;
            return Err(TRAVEL_EXCEEDED);
        }
        self.jogging = true;
        self.ops.push_back(Op::Order(order));
        Ok(())
    }

    /// The corner of the mechanism at which its switches are: `$23` has a bit for each axis that homes towards its lower end.
    fn corner(&self) -> DVec3 {
        let [x, y, _] = self.settings.axes(130).map(f64::from);
        let mask = self.settings.get(23) as u32;
        let end = |axis: u32, upper: f64| if mask & (1 << axis) == 0 { upper } else { 0.0 };
        DVec3::new(end(0, x), end(1, y), end(2, Z_TOP))
    }

    /// Runs to the switches: Z first, then X and Y, then off them.
    fn home(&mut self) {
        self.homing = true;
        self.lock = Lock::None;
        let corner = self.corner();
        let at = self.motion.position();
        let speed = f64::from(self.settings.get(25)) / 60.0;
        let acceleration = self.settings.axes(120).map(f64::from).into_iter().fold(f64::MAX, f64::min);
        for target in [at.with_z(corner.z), corner, self.off_the_switches()] {
            // The planner is empty, and holds more than three.
            self.motion.push(Move { target, speed: speed.max(1.0), acceleration: acceleration.max(1.0), rapid: false });
        }
        let debounce = (f64::from(self.settings.get(26)) * NS_PER_S / 1000.0) as u64;
        self.ops.extend([Op::Rest(debounce), Op::Homed]);
    }

    /// The place in the mechanism to which homing goes last.
    fn off_the_switches(&self) -> DVec3 {
        let mask = self.settings.get(23) as u32;
        let off = f64::from(self.settings.get(27));
        let away = |axis: u32| if mask & (1 << axis) == 0 { -off } else { off };
        self.corner() + DVec3::new(away(0), away(1), away(2))
    }

    /// The machine's zero is where the switches say.
    pub(super) fn homed(&mut self) {
        let travel = self.settings.axes(130).map(f64::from);
        let mask = self.settings.get(23) as u32;
        let counted = |axis: usize| {
            let off = f64::from(self.settings.get(27));
            if mask & (1 << axis) == 0 { -off } else { off - travel[axis] }
        };
        let counted = DVec3::new(counted(0), counted(1), counted(2));
        self.zero = self.motion.position() - counted;
        self.homing = false;
        self.synchronize();
        if std::mem::take(&mut self.status_wanted) {
            self.status();
        }
    }
}
