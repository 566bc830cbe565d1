//! The commands.

use glam::DVec3;

use super::super::motion::Move;
use super::Op;

const MM_PER_INCH: f32 = 25.4;
/// Length of the chords of an arc, mm.
const CHORD_MM: f32 = 1.0;
const CHORDS_MAX: usize = 100_000;
const NS_PER_MS: f32 = 1e6;

/// What outlives a command.
#[derive(Clone, Debug)]
pub(super) struct State {
    /// Whether it knows inches.
    pub(super) inch: bool,
    /// Where the last move ends, in its own mm.
    pub(super) position: [f32; 3],
    /// What `G92` has shifted.
    shift: [f32; 3],
    inches: bool,
    relative: bool,
    /// In mm/min, before the percentage.
    feed: f32,
    percent: f32,
    steps_per_mm: [f32; 3],
    /// mm/s.
    rates: [f32; 3],
    acceleration: f32,
    soft_endstops: bool,
    homed: bool,
    angle: f32,
}

/// A command's parameters.
struct Words<'a>(&'a str);

impl Words<'_> {
    /// Whether a letter is there.
    fn seen(&self, letter: char) -> bool {
        self.0.contains(letter)
    }

    /// The number behind a letter; none when the letter or the number is not there. What is no number is not missed.
    fn value(&self, letter: char) -> Option<f32> {
        let rest = self.0.get(self.0.find(letter)? + 1..)?.trim_start();
        let (mut end, mut point) = (0, false);
        for (i, c) in rest.char_indices() {
            let fits = c.is_ascii_digit() || (c == '.' && !point) || (i == 0 && matches!(c, '-' | '+'));
            if !fits {
                break;
            }
            point |= c == '.';
            end = i + 1;
        }
        rest.get(..end)?.parse().ok()
    }
}

impl State {
    /// As after a reset.
    pub(super) fn new(inch: bool) -> Self {
        Self {
            inch,
            position: [0.0; 3],
            shift: [0.0; 3],
            inches: false,
            relative: false,
            feed: 1500.0,
            percent: 100.0,
            steps_per_mm: [80.0, 80.0, 400.0],
            rates: [300.0, 300.0, 20.0],
            acceleration: 500.0,
            soft_endstops: true,
            homed: false,
            angle: 90.0,
        }
    }

    pub(super) fn steps_per_mm(&self) -> DVec3 {
        DVec3::from(self.steps_per_mm.map(f64::from))
    }

    /// Carries a command out in its own state; what else it does comes back. `count` is where the motors are, in steps, and `servo` the
    /// number of the servo that holds the pen.
    pub(super) fn command(&mut self, text: &str, count: DVec3, zero: DVec3, servo: Option<u32>) -> Vec<Op> {
        let unknown = || vec![Op::Say(format!("echo:Unknown command: \"{text}\"\n"))];
        let Some(letter) = text.chars().next().filter(|c| matches!(c, 'G' | 'M' | 'T')) else { return unknown() };
        let rest = text.get(1..).unwrap_or_default();
        let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
        let Some(code) = rest.get(..digits).and_then(|digits| digits.parse::<u32>().ok()) else { return unknown() };
        let words = Words(rest.get(digits..).unwrap_or_default());
        let scale = if self.inches { MM_PER_INCH } else { 1.0 };
        match (letter, code) {
            ('G', 0 | 1) => {
                let target = self.target(&words, scale);
                self.take_feed(&words, scale);
                vec![Op::Move(self.go(target, zero))]
            }
            ('G', 2 | 3) => self.arc(&words, scale, code == 2, zero),
            ('G', 4) => {
                let ms = words.value('S').map(|s| s * 1000.0).or(words.value('P')).unwrap_or(0.0);
                vec![Op::Rest((ms.max(0.0) * NS_PER_MS) as u64)]
            }
            ('G', 20 | 21) if self.inch => {
                self.inches = code == 20;
                Vec::new()
            }
            // Without INCH_MODE_SUPPORT it knows millimetres only, and takes their word without a complaint.
            ('G', 21) => Vec::new(),
            ('G', 28) => self.home(&words, zero),
            ('G', 90 | 91) => {
                self.relative = code == 91;
                Vec::new()
            }
            ('G', 92) => {
                for (axis, letter) in ['X', 'Y', 'Z'].into_iter().enumerate() {
                    if let Some(value) = words.value(letter) {
                        self.shift[axis] = value * scale - self.position[axis];
                    }
                }
                Vec::new()
            }
            ('M', 0 | 1) => {
                let ms = words.value('S').map(|s| s * 1000.0).or(words.value('P'));
                vec![Op::User(ms.map(|ms| (ms.max(0.0) * NS_PER_MS) as u64))]
            }
            // What it did when they arrived; and what a plotter has not: motors that rest, fans, messages.
            ('M', 17 | 18 | 42 | 84 | 106..=108 | 110..=112 | 117 | 201 | 410 | 500 | 501) | ('T', 0) => Vec::new(),
            ('M', 92) => {
                for (axis, letter) in ['X', 'Y', 'Z'].into_iter().enumerate() {
                    self.steps_per_mm[axis] =
                        words.value(letter).filter(|v| *v > 0.0).unwrap_or(self.steps_per_mm[axis]);
                }
                Vec::new()
            }
            ('M', 114) => vec![Op::Say(self.whereabouts(count))],
            ('M', 115) => vec![Op::Say(
                "FIRMWARE_NAME:Marlin 2.1.2.5 (Nov  1 2024 12:00:00) SOURCE_CODE_URL:github.com/MarlinFirmware/Marlin \
                 PROTOCOL_VERSION:1.0 MACHINE_TYPE:Plotter EXTRUDER_COUNT:0\nCap:EEPROM:0\nCap:EMERGENCY_PARSER:1\n"
                    .to_owned(),
            )],
            ('M', 118) => vec![Op::Say(format!("{}\n", words.0.trim()))],
            ('M', 119) => vec![Op::Say("Reporting endstop status\nx_min: open\ny_min: open\nz_min: open\n".to_owned())],
            ('M', 203) => {
                for (axis, letter) in ['X', 'Y', 'Z'].into_iter().enumerate() {
                    self.rates[axis] = words.value(letter).filter(|v| *v > 0.0).unwrap_or(self.rates[axis]);
                }
                Vec::new()
            }
            ('M', 204) => {
                self.acceleration =
                    words.value('P').or(words.value('S')).filter(|v| *v > 0.0).unwrap_or(self.acceleration);
                Vec::new()
            }
            ('M', 211) => {
                if let Some(on) = words.value('S') {
                    self.soft_endstops = on != 0.0;
                    return Vec::new();
                }
                let on = if self.soft_endstops { "On" } else { "Off" };
                vec![Op::Say(format!("Soft endstops: {on}  Min:  X0.00 Y0.00 Z0.00   Max:  X300.00 Y300.00 Z50.00\n"))]
            }
            ('M', 220) => match words.value('S') {
                Some(percent) => {
                    self.percent = percent.clamp(1.0, 999.0);
                    Vec::new()
                }
                None => vec![Op::Say(format!("FR:{:.0}%\n", self.percent))],
            },
            ('M', 280) => match (words.value('P').unwrap_or(0.0) as u32, words.value('S')) {
                (index, _) if Some(index) != servo => vec![Op::Say(format!("Error:Servo {index} out of range\n"))],
                (_, Some(angle)) => {
                    self.angle = angle;
                    vec![Op::Servo(angle)]
                }
                (index, None) => vec![Op::Say(format!("echo: Servo {index}: {:.0}\n", self.angle))],
            },
            ('M', 400) => vec![Op::Rest(0)],
            ('M', 503) => vec![Op::Say(self.settings())],
            _ => unknown(),
        }
    }

    fn take_feed(&mut self, words: &Words<'_>, scale: f32) {
        if let Some(feed) = words.value('F').filter(|feed| *feed > 0.0) {
            self.feed = feed * scale;
        }
    }

    fn target(&self, words: &Words<'_>, scale: f32) -> [f32; 3] {
        let mut target = self.position;
        for (axis, letter) in ['X', 'Y', 'Z'].into_iter().enumerate() {
            if let Some(value) = words.value(letter) {
                target[axis] = value * scale + if self.relative { self.position[axis] } else { -self.shift[axis] };
            }
        }
        if self.soft_endstops && self.homed {
            for (value, most) in target.iter_mut().zip([300.0, 300.0, 50.0]) {
                *value = value.clamp(0.0, most);
            }
        }
        target
    }

    fn go(&mut self, target: [f32; 3], zero: DVec3) -> Move {
        let steps: [f64; 3] =
            std::array::from_fn(|axis| f64::from((target[axis] * self.steps_per_mm[axis]).round() as i32));
        let to = DVec3::from(steps) / self.steps_per_mm();
        let from = DVec3::from(self.position.map(f64::from));
        let direction = (to - from).normalize_or_zero().abs();
        let speed = (0..3)
            .filter(|axis| direction[*axis] > 0.0)
            .map(|axis| f64::from(self.rates[axis]) / direction[axis])
            .fold(f64::from(self.feed * self.percent / 100.0) / 60.0, f64::min);
        self.position = target;
        Move { target: zero + to, speed, acceleration: f64::from(self.acceleration), rapid: false }
    }

    fn arc(&mut self, words: &Words<'_>, scale: f32, clockwise: bool, zero: DVec3) -> Vec<Op> {
        let bad = || vec![Op::Say("Error:G2/G3 bad parameters\n".to_owned())];
        let target = self.target(words, scale);
        self.take_feed(words, scale);
        let [x, y] = [target[0] - self.position[0], target[1] - self.position[1]];
        let turn = if clockwise { -1.0 } else { 1.0 };
        let centre = if let Some(r) = words.value('R') {
            let (r, half) = (r * scale, x.hypot(y) / 2.0);
            if half == 0.0 || r.abs() < half {
                return bad();
            }
            let side = (r * r - half * half).sqrt() * turn * r.signum() / (2.0 * half);
            [x / 2.0 - y * side, y / 2.0 + x * side]
        } else {
            let [i, j] = ['I', 'J'].map(|letter| words.value(letter));
            if i.is_none() && j.is_none() {
                return bad();
            }
            [i.unwrap_or(0.0) * scale, j.unwrap_or(0.0) * scale]
        };
        let r = centre[0].hypot(centre[1]);
        let (from, to) = ((-centre[1]).atan2(-centre[0]), (y - centre[1]).atan2(x - centre[0]));
        let mut angle = (to - from) * turn;
        while angle <= 5e-7 {
            angle += std::f32::consts::TAU;
        }
        let count = ((angle * r / CHORD_MM) as usize).clamp(1, CHORDS_MAX);
        let (begin, rise) = (self.position, target[2] - self.position[2]);
        let mut ops = Vec::with_capacity(count);
        for k in 1..count {
            let part = k as f32 / count as f32;
            let at = from + turn * angle * part;
            let place =
                [begin[0] + centre[0] + r * at.cos(), begin[1] + centre[1] + r * at.sin(), begin[2] + rise * part];
            ops.push(Op::Move(self.go(place, zero)));
        }
        ops.push(Op::Move(self.go(target, zero)));
        ops
    }

    /// `G28`: its switches are where it was switched on, at the lower ends.
    fn home(&mut self, words: &Words<'_>, zero: DVec3) -> Vec<Op> {
        let all = !['X', 'Y', 'Z'].into_iter().any(|letter| words.seen(letter));
        let axes = ['X', 'Y', 'Z'].map(|letter| all || words.seen(letter));
        let mut to = zero + DVec3::from(self.position.map(f64::from));
        for axis in (0..3).filter(|axis| axes[*axis]) {
            to[axis] = 0.0;
            self.position[axis] = 0.0;
            self.shift[axis] = 0.0;
        }
        self.homed |= all;
        let homing = Move { target: to, speed: 30.0, acceleration: f64::from(self.acceleration), rapid: false };
        vec![Op::Rest(0), Op::Move(homing), Op::Homed(axes)]
    }

    /// What `M114` tells: where the last command ends, and where the motors are in steps.
    fn whereabouts(&self, count: DVec3) -> String {
        let [x, y, z]: [f32; 3] = std::array::from_fn(|axis| self.position[axis] + self.shift[axis]);
        format!("X:{x:.2} Y:{y:.2} Z:{z:.2} E:0.00 Count X:{} Y:{} Z:{}\n", count.x, count.y, count.z)
    }

    fn settings(&self) -> String {
        let ([x, y, z], [fx, fy, fz]) = (self.steps_per_mm, self.rates);
        let a = self.acceleration;
        format!(
            "echo:; Linear Units:\necho:  G21 ; (mm)\necho:; Steps per unit:\necho:  M92 X{x:.2} Y{y:.2} Z{z:.2}\n\
             echo:; Max feedrates (units/s):\necho:  M203 X{fx:.2} Y{fy:.2} Z{fz:.2}\necho:; Acceleration (units/s2):\n\
             echo:  M204 P{a:.2} R{a:.2} T{a:.2}\n"
        )
    }
}
