//! What the instructions do.

use super::clip::Window;
use super::parser::Part;
use super::{Op, Question, SPEED};

/// Pens of the carousel.
const PENS: f64 = 6.0;
/// Largest parameter, in plotter units.
const LARGEST: f64 = 32_767.0;
/// Angle of the chords of arcs, unless they say another one.
const CHORD_DEGREES: f64 = 5.0;
const CHORDS_MAX: usize = 10_000;

/// Instructions that it knows and that draw nothing here: of text, of shading and of its panel.
const OTHERS: &[&[u8; 2]] = &[
    b"CA", b"CP", b"CS", b"DC", b"DI", b"DP", b"DR", b"DT", b"EW", b"FT", b"IM", b"LB", b"LT", b"OD", b"PT", b"RA",
    b"RR", b"RO", b"SA", b"SI", b"SL", b"SM", b"SR", b"SS", b"TL", b"UC", b"WG", b"XT", b"YT",
];

/// What outlives an instruction.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub(super) hard_clip: Window,
    pub(super) window: Window,
    pub(super) p1p2: Window,
    /// User units of the corners P1 and P2, when scaling is on: x of both, y of both.
    scale: Option<[f64; 4]>,
    pub(super) pen: u32,
    pub(super) down: bool,
    relative: bool,
    /// In mm/s.
    pub(super) speed: f64,
    /// The last error since it was asked for; 0 for none.
    pub(super) error: u8,
    /// It was initialised since its status was asked for.
    initialised: bool,
    instruction: Option<[u8; 2]>,
    numbers: Vec<f64>,
    /// Numbers that the instruction had in all.
    count: usize,
}

impl State {
    pub(super) fn new(hard_clip: Window) -> Self {
        Self {
            hard_clip,
            window: hard_clip,
            p1p2: hard_clip,
            scale: None,
            pen: 0,
            down: false,
            relative: false,
            speed: SPEED,
            error: 0,
            initialised: true,
            instruction: None,
            numbers: Vec::new(),
            count: 0,
        }
    }

    /// `OS`.
    pub(super) fn status(&mut self) -> u32 {
        let initialised = std::mem::take(&mut self.initialised);
        u32::from(self.down) + 8 * u32::from(initialised) + 16 + 32 * u32::from(self.error != 0)
    }

    /// From plotter to user units.
    pub(super) fn to_user(&self, at: [f64; 2]) -> [f64; 2] {
        let Some([x1, x2, y1, y2]) = self.scale else { return at.map(f64::round) };
        let (low, high) = (self.p1p2.low, self.p1p2.high);
        [x1 + (at[0] - low[0]) * (x2 - x1) / (high[0] - low[0]), y1 + (at[1] - low[1]) * (y2 - y1) / (high[1] - low[1])]
    }

    /// Lengths in user units, in plotter units.
    fn lengths(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let Some([x1, x2, y1, y2]) = self.scale else { return [x, y] };
        let (low, high) = (self.p1p2.low, self.p1p2.high);
        [x * (high[0] - low[0]) / (x2 - x1), y * (high[1] - low[1]) / (y2 - y1)]
    }

    /// A place in user units, in plotter units.
    fn place(&self, at: [f64; 2]) -> [f64; 2] {
        let Some([x1, _, y1, _]) = self.scale else { return at };
        let [x, y] = self.lengths([at[0] - x1, at[1] - y1]);
        [self.p1p2.low[0] + x, self.p1p2.low[1] + y]
    }

    fn fail(&mut self, error: u8) {
        self.error = error;
        self.instruction = None;
    }

    /// Takes a part of an instruction; the last vector ends at `at`, in plotter units.
    pub(super) fn part(&mut self, part: Part, at: [f64; 2]) -> Vec<Op> {
        match part {
            Part::Mnemonic(mnemonic) => {
                self.numbers.clear();
                self.count = 0;
                self.instruction = Some(mnemonic);
                return self.begin(mnemonic, at);
            }
            Part::Number(number) if number.abs() > LARGEST => self.fail(3),
            Part::Bad => self.fail(3),
            Part::Number(number) => {
                self.numbers.push(number);
                self.count += 1;
                if let (Some([b'P', b'A' | b'R' | b'U' | b'D']), [x, y]) = (self.instruction, self.numbers.as_slice()) {
                    let pair = [*x, *y];
                    self.numbers.clear();
                    return self.vector(pair, at).into_iter().collect();
                }
                // No instruction but those has so many.
                self.numbers.truncate(16);
            }
            Part::End => {
                if let Some(mnemonic) = self.instruction.take() {
                    return self.end(mnemonic, at);
                }
            }
        }
        Vec::new()
    }

    fn vector(&mut self, pair: [f64; 2], at: [f64; 2]) -> Option<Op> {
        let to = if self.relative {
            let [x, y] = self.lengths(pair);
            [at[0] + x, at[1] + y]
        } else {
            self.place(pair)
        };
        if to.iter().any(|value| value.abs() > LARGEST) {
            self.fail(6);
            return None;
        }
        Some(Op::Vector(to))
    }

    /// What is done before the numbers come.
    fn begin(&mut self, mnemonic: [u8; 2], at: [f64; 2]) -> Vec<Op> {
        match &mnemonic {
            b"PA" => self.relative = false,
            b"PR" => self.relative = true,
            b"PU" | b"PD" => {
                self.down = mnemonic == *b"PD";
                // Outside of the window it stays up.
                return vec![Op::Tip(self.down && self.window.nearest(at) == at)];
            }
            _ => {}
        }
        Vec::new()
    }

    /// What is done when all numbers are there.
    fn end(&mut self, mnemonic: [u8; 2], at: [f64; 2]) -> Vec<Op> {
        let numbers = std::mem::take(&mut self.numbers);
        match (&mnemonic, numbers.as_slice()) {
            (b"PA" | b"PR" | b"PU" | b"PD", []) => {}
            (b"IN", []) => {
                let (hard_clip, pen) = (self.hard_clip, self.pen);
                *self = Self { pen, ..Self::new(hard_clip) };
                return vec![Op::Tip(false)];
            }
            (b"DF", []) => {
                let (hard_clip, pen, down, p1p2) = (self.hard_clip, self.pen, self.down, self.p1p2);
                *self = Self { pen, down, p1p2, ..Self::new(hard_clip) };
            }
            (b"SP", []) => return self.take(0.0),
            (b"SP", [pen]) => return self.take(*pen),
            (b"VS", []) => self.speed = SPEED,
            (b"VS", [speed, ..]) if (0.0..=127.0).contains(speed) => self.speed = (speed * 10.0).clamp(10.0, SPEED),
            (b"IP", []) => self.p1p2 = self.hard_clip,
            (b"IP", [a, b, c, d]) if a != c && b != d => self.p1p2 = Window { low: [*a, *b], high: [*c, *d] },
            (b"IW", []) => self.window = self.hard_clip,
            (b"IW", [a, b, c, d]) => self.window = self.hard_clip.common(&Window::between([*a, *b], [*c, *d])),
            (b"SC", []) => self.scale = None,
            (b"SC", [x1, x2, y1, y2]) if x1 != x2 && y1 != y2 => self.scale = Some([*x1, *x2, *y1, *y2]),
            (b"CI", [radius] | [radius, _]) => {
                let [r, _] = self.lengths([*radius, 0.0]);
                let chord = numbers.get(1).copied();
                let start = [at[0] + r, at[1]];
                // A circle is drawn with the pen down, and leaves it where and as it was.
                let mut ops = vec![Op::Tip(false), Op::Go(self.window.nearest(start)), Op::Tip(true)];
                ops.extend(arc(start, at, 360.0, chord).into_iter().map(|to| Op::Go(self.window.nearest(to))));
                ops.extend([Op::Tip(false), Op::Go(self.window.nearest(at)), Op::Tip(self.down)]);
                return ops;
            }
            (b"AA", [x, y, angle] | [x, y, angle, _]) => {
                let centre = self.place([*x, *y]);
                return arc(at, centre, *angle, numbers.get(3).copied()).into_iter().map(Op::Vector).collect();
            }
            (b"AR", [x, y, angle] | [x, y, angle, _]) => {
                let [x, y] = self.lengths([*x, *y]);
                let centre = [at[0] + x, at[1] + y];
                return arc(at, centre, *angle, numbers.get(3).copied()).into_iter().map(Op::Vector).collect();
            }
            (b"EA" | b"ER", [x, y]) => {
                let [x, y] = if mnemonic == *b"EA" {
                    self.place([*x, *y])
                } else {
                    let [x, y] = self.lengths([*x, *y]);
                    [at[0] + x, at[1] + y]
                };
                let corners = [[x, at[1]], [x, y], [at[0], y], at];
                let mut ops = vec![Op::Tip(true)];
                ops.extend(corners.map(|corner| Op::Go(self.window.nearest(corner))));
                ops.push(Op::Tip(self.down));
                return ops;
            }
            (b"OA", []) => return vec![Op::Answer(Question::Actual)],
            (b"OC", []) => return vec![Op::Answer(Question::Commanded)],
            (b"OE", []) => return vec![Op::Answer(Question::Error)],
            (b"OF", []) => return vec![Op::Answer(Question::Factors)],
            (b"OH", []) => return vec![Op::Answer(Question::HardClip)],
            (b"OI", []) => return vec![Op::Answer(Question::Identification)],
            (b"OO", []) => return vec![Op::Answer(Question::Options)],
            (b"OP", []) => return vec![Op::Answer(Question::P1P2)],
            (b"OS", []) => return vec![Op::Answer(Question::Status)],
            (b"OW", []) => return vec![Op::Answer(Question::Window)],
            (other, _) if OTHERS.contains(&other) => {}
            (b"VS", [_, ..]) | (b"IP" | b"SC", [_, _, _, _]) => self.fail(3),
            (
                b"PA" | b"PR" | b"PU" | b"PD" | b"IN" | b"DF" | b"SP" | b"IP" | b"IW" | b"SC" | b"CI" | b"AA" | b"AR"
                | b"EA" | b"ER" | b"OA" | b"OC" | b"OE" | b"OF" | b"OH" | b"OI" | b"OO" | b"OP" | b"OS" | b"OW",
                _,
            ) => self.fail(2),
            _ => self.fail(1),
        }
        Vec::new()
    }

    fn take(&mut self, pen: f64) -> Vec<Op> {
        if !(0.0..=PENS).contains(&pen) {
            self.fail(3);
            return Vec::new();
        }
        self.down = false;
        vec![Op::Tip(false), Op::Take(pen as u32)]
    }
}

/// The ends of the chords of an arc from a place, in degrees anticlockwise about a centre.
fn arc(from: [f64; 2], centre: [f64; 2], degrees: f64, chord: Option<f64>) -> Vec<[f64; 2]> {
    let step = chord.map_or(CHORD_DEGREES, f64::abs).clamp(0.5, 120.0);
    let count = ((degrees.abs() / step).ceil() as usize).clamp(1, CHORDS_MAX);
    let [x, y] = [from[0] - centre[0], from[1] - centre[1]];
    let at = |k: usize| {
        let (sine, cosine) = (degrees.to_radians() * k as f64 / count as f64).sin_cos();
        [centre[0] + x * cosine - y * sine, centre[1] + x * sine + y * cosine]
    };
    (1..=count).map(at).collect()
}
