//! What the instructions do: from parts to ops, with the state that outlives an instruction.

use heapless::Vec;

use super::encoded::{Encoded, Piece};
use super::parser::{Parser, Part};
use super::{OPS, Window};

/// Largest coordinate, in plotter units: HPGL/2's. Beyond it is error 3, and a position beyond it is error 6.
const LARGEST: f64 = 8_388_607.0;

/// Largest speed, cm/s.
const FASTEST: f64 = 127.0;

/// Slowest speed, cm/s: what VS rounds 0 up to.
const SLOWEST: f64 = 0.1;

/// Pens that can be named.
const PENS: f64 = 99.0;

/// Parameters that an instruction other than a list of points may have.
const PARAMETERS: usize = 8;

/// Errors of `OE`.
const UNKNOWN: u8 = 1;
const COUNT: u8 = 2;
const RANGE: u8 = 3;
const POSITION: u8 = 6;

/// What output instructions ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Question {
    /// OA: where the pen is, in plotter units.
    Actual,
    /// OC: where it was sent, in user units.
    Commanded,
    /// OE.
    Error,
    /// OF: plotter units in a mm.
    Factors,
    /// OH: the hard-clip limits.
    HardClip,
    /// OI.
    Identification,
    /// OO.
    Options,
    /// OP: the scaling points.
    Points,
    /// OS.
    Status,
    /// OW.
    Window,
}

/// What is done after an instruction was read, one after the other. Places are in plotter units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Op {
    /// A straight move; with the pen down at this speed in cm/s, if any was set.
    Go { to: [f64; 2], speed: Option<f64> },
    /// Lifts or lowers the pen.
    Pen(bool),
    /// IN: a machine that is locked homes, if it can.
    Initialise,
    /// An answer.
    Answer(Question),
}

/// Ops of one part.
pub(crate) type Ops = Vec<Op, OPS>;

/// Plotter units of user units: those of the corners P1 and P2.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Scale {
    low: [f64; 2],
    high: [f64; 2],
}

/// The state of the language.
#[derive(Clone, Debug)]
pub(crate) struct Plotter {
    parser: Parser,
    encoded: Encoded,
    /// The instruction at work, its parameters, and how many there were.
    instruction: Option<[u8; 2]>,
    numbers: Vec<f64, PARAMETERS>,
    count: usize,
    /// The hard-clip limits.
    limits: Window,
    /// IW.
    window: Option<Window>,
    /// P1 and P2, when IP has set them.
    points: Option<[[f64; 2]; 2]>,
    scale: Option<Scale>,
    relative: bool,
    /// PD.
    down: bool,
    /// SP; with 0 nothing is drawn.
    pen: u8,
    /// cm/s.
    speed: Option<f64>,
    /// Where the last vector ends, in the window or not, and where the pen really went.
    at: [f64; 2],
    tip: [f64; 2],
    /// The first error since it was asked for.
    error: u8,
    initialised: bool,
}

impl Plotter {
    /// As after `IN`, with the pen at `at`.
    pub(crate) fn new(limits: Window, at: [f64; 2]) -> Self {
        Self {
            parser: Parser::default(),
            encoded: Encoded::default(),
            instruction: None,
            numbers: Vec::new(),
            count: 0,
            limits,
            window: None,
            points: None,
            scale: None,
            relative: false,
            down: false,
            pen: 1,
            speed: None,
            at,
            tip: at,
            error: 0,
            initialised: true,
        }
    }

    /// Whether an instruction may begin with the next byte.
    pub(crate) fn is_between(&self) -> bool {
        self.parser.is_between()
    }

    /// The limits have changed.
    pub(crate) fn set_limits(&mut self, limits: Window) {
        self.limits = limits;
    }

    /// The pen is up at `at`, and what was being read is forgotten.
    pub(crate) fn abort(&mut self, at: [f64; 2]) {
        self.parser = Parser::default();
        self.instruction = None;
        (self.at, self.tip) = (at, at);
    }

    /// The pen was moved by something else.
    pub(crate) fn set_position(&mut self, at: [f64; 2]) {
        (self.at, self.tip) = (at, at);
    }

    /// Keeps an error until it is asked for.
    pub(crate) fn fail(&mut self, error: u8) {
        if self.error == 0 {
            self.error = error;
        }
    }

    /// Where the pen is, in plotter units.
    pub(crate) fn tip(&self) -> [f64; 2] {
        self.tip
    }

    /// Where the last vector ends, in user units.
    pub(crate) fn commanded(&self) -> [f64; 2] {
        let Some(scale) = self.scale else { return self.at };
        let [low, high] = self.points();
        [0, 1].map(|axis: usize| {
            scale.low[axis]
                + (self.at[axis] - low[axis]) * (scale.high[axis] - scale.low[axis]) / (high[axis] - low[axis])
        })
    }

    pub(crate) fn is_down(&self) -> bool {
        self.down
    }

    /// `OE`.
    pub(crate) fn take_error(&mut self) -> u8 {
        core::mem::take(&mut self.error)
    }

    /// `OS`.
    pub(crate) fn take_status(&mut self) -> u8 {
        let initialised = core::mem::take(&mut self.initialised);
        u8::from(self.down)
            | u8::from(self.points.is_some()) << 1
            | u8::from(initialised) << 3
            | 1 << 4
            | u8::from(self.error != 0) << 5
    }

    /// Where vectors are drawn.
    pub(crate) fn window(&self) -> Window {
        self.window.map_or(self.limits, |window| self.limits.common(&window))
    }

    pub(crate) fn limits(&self) -> Window {
        self.limits
    }

    /// P1 and P2.
    pub(crate) fn points(&self) -> [[f64; 2]; 2] {
        self.points.unwrap_or([self.limits.low(), self.limits.high()])
    }

    /// Takes a byte out of the ring: the ops that come of it.
    pub(crate) fn take(&mut self, byte: u8) -> Ops {
        let part = self.parser.take(byte);
        self.part(part)
    }

    /// Goes on with a byte that ended one part and begins another. `None` when there is none.
    pub(crate) fn take_again(&mut self) -> Option<Ops> {
        let byte = self.parser.again()?;
        Some(self.take(byte))
    }

    fn part(&mut self, part: Part) -> Ops {
        match part {
            Part::None => Ops::new(),
            Part::Mnemonic(mnemonic) => {
                self.numbers.clear();
                self.count = 0;
                self.encoded = Encoded::default();
                self.instruction = Some(mnemonic);
                self.begin(mnemonic)
            }
            Part::Bad => self.refuse(RANGE),
            Part::Number(number) if number.abs() > LARGEST => self.refuse(RANGE),
            Part::Number(number) => self.number(number),
            Part::Encoded(byte) => self.encoded(byte),
            Part::End => match self.instruction.take() {
                Some(mnemonic) => self.end(mnemonic),
                None => Ops::new(),
            },
        }
    }

    /// The instruction is wrong, and what is left of it does nothing.
    fn refuse(&mut self, error: u8) -> Ops {
        if self.instruction.take().is_some() {
            self.fail(error);
        }
        Ops::new()
    }

    fn number(&mut self, number: f64) -> Ops {
        if self.instruction.is_none() {
            return Ops::new();
        }
        self.count = self.count.saturating_add(1);
        // Those beyond are only counted.
        let _ = self.numbers.push(number);
        if let (Some([b'P', b'A' | b'R' | b'U' | b'D']), [x, y]) = (self.instruction, self.numbers.as_slice()) {
            let pair = [*x, *y];
            self.numbers.clear();
            return self.vector(pair, self.relative, self.down);
        }
        Ops::new()
    }

    fn encoded(&mut self, byte: u8) -> Ops {
        if self.instruction.is_none() {
            return Ops::new();
        }
        match self.encoded.take(byte) {
            Piece::None => Ops::new(),
            Piece::Bad => self.refuse(RANGE),
            Piece::Pen(pen) => self.select(pen),
            Piece::Point { at, .. } if at.iter().any(|v| v.abs() > LARGEST) => self.refuse(RANGE),
            Piece::Point { at, absolute, down } => {
                let mut ops = Ops::new();
                if self.down != down {
                    self.down = down;
                    push(&mut ops, self.tip_op());
                }
                for op in self.vector(at, !absolute, down) {
                    push(&mut ops, op);
                }
                ops
            }
        }
    }

    /// The pen where it is: it is only put down within the window, and if there is one.
    fn tip_op(&self) -> Op {
        Op::Pen(self.draws() && self.window().contains(self.at))
    }

    fn draws(&self) -> bool {
        self.down && self.pen > 0
    }

    /// Lengths in user units, in plotter units.
    fn lengths(&self, user: [f64; 2]) -> [f64; 2] {
        let Some(scale) = self.scale else { return user };
        let [low, high] = self.points();
        [0, 1].map(|axis: usize| user[axis] * (high[axis] - low[axis]) / (scale.high[axis] - scale.low[axis]))
    }

    /// A vector to, or by, `user` units.
    fn vector(&mut self, user: [f64; 2], relative: bool, down: bool) -> Ops {
        let mut ops = Ops::new();
        let to = match (relative, self.scale) {
            (true, _) => {
                let by = self.lengths(user);
                [self.at[0] + by[0], self.at[1] + by[1]]
            }
            (false, None) => user,
            (false, Some(scale)) => {
                let by = self.lengths([user[0] - scale.low[0], user[1] - scale.low[1]]);
                let [low, _] = self.points();
                [low[0] + by[0], low[1] + by[1]]
            }
        };
        // NaN as well.
        if !to.iter().all(|value| value.abs() <= LARGEST) {
            return self.refuse(POSITION);
        }
        let from = core::mem::replace(&mut self.at, to);
        let window = self.window();
        let go = |to| Op::Go { to, speed: None };
        match window.clip(from, to).filter(|_| down && self.pen > 0) {
            Some([enter, leave]) => {
                if enter != from {
                    push(&mut ops, Op::Pen(false));
                    push(&mut ops, go(enter));
                }
                push(&mut ops, Op::Pen(true));
                push(&mut ops, Op::Go { to: leave, speed: self.speed });
                if leave != to {
                    push(&mut ops, Op::Pen(false));
                }
                self.tip = leave;
            }
            None => {
                self.tip = window.nearest(to);
                push(&mut ops, Op::Pen(false));
                push(&mut ops, go(self.tip));
            }
        }
        ops
    }

    /// What is done before the parameters come.
    fn begin(&mut self, mnemonic: [u8; 2]) -> Ops {
        let mut ops = Ops::new();
        match &mnemonic {
            b"PA" => self.relative = false,
            b"PR" => self.relative = true,
            b"PU" | b"PD" => {
                self.down = mnemonic == *b"PD";
                push(&mut ops, self.tip_op());
            }
            _ => {}
        }
        ops
    }

    fn select(&mut self, pen: f64) -> Ops {
        if !(0.0..=PENS).contains(&pen) {
            self.instruction = None;
            self.fail(RANGE);
            return Ops::new();
        }
        self.pen = pen as u8;
        self.down = false;
        one(Op::Pen(false))
    }

    /// What is done when all parameters are there.
    fn end(&mut self, mnemonic: [u8; 2]) -> Ops {
        let numbers = core::mem::take(&mut self.numbers);
        let count = self.count;
        let answer = |question| one(Op::Answer(question));
        match (&mnemonic, numbers.as_slice()) {
            (b"PA" | b"PR" | b"PU" | b"PD", []) => {}
            (b"PE" | b"LB" | b"DT", _) => {}
            (b"IN", _) if count <= 1 => {
                *self = Self { parser: self.parser.clone(), ..Self::new(self.limits, self.tip) };
                self.parser.reset_terminator();
                let mut ops = one(Op::Pen(false));
                push(&mut ops, Op::Initialise);
                return ops;
            }
            (b"DF", []) => {
                (self.window, self.scale, self.speed, self.relative) = (None, None, None, false);
                self.parser.reset_terminator();
            }
            (b"SP", []) => return self.select(0.0),
            (b"SP", [pen]) => return self.select(*pen),
            (b"VS", []) => self.speed = None,
            (b"VS", [speed] | [speed, _]) => {
                if !(0.0..=FASTEST).contains(speed) {
                    self.fail(RANGE);
                } else {
                    self.speed = Some(speed.max(SLOWEST));
                }
            }
            (b"IP", []) => self.points = None,
            (b"IP", [x, y]) => {
                // P2 follows P1.
                let [low, high] = self.points();
                self.points = Some([[*x, *y], [x + high[0] - low[0], y + high[1] - low[1]]]);
            }
            (b"IP", [a, b, c, d]) if a != c && b != d => self.points = Some([[*a, *b], [*c, *d]]),
            (b"IW", []) => self.window = None,
            (b"IW", [a, b, c, d]) => self.window = Some(Window::new([*a, *b], [*c, *d])),
            (b"SC", []) => self.scale = None,
            (b"SC", [x1, x2, y1, y2] | [x1, x2, y1, y2, 0.0]) if x1 != x2 && y1 != y2 => {
                self.scale = Some(Scale { low: [*x1, *y1], high: [*x2, *y2] });
            }
            (b"IP" | b"SC", [_, _, _, _]) => self.fail(RANGE),
            (b"OA", []) => return answer(Question::Actual),
            (b"OC", []) => return answer(Question::Commanded),
            (b"OE", []) => return answer(Question::Error),
            (b"OF", []) => return answer(Question::Factors),
            (b"OH", []) => return answer(Question::HardClip),
            (b"OI", []) => return answer(Question::Identification),
            (b"OO", []) => return answer(Question::Options),
            (b"OP", []) => return answer(Question::Points),
            (b"OS", []) => return answer(Question::Status),
            (b"OW", []) => return answer(Question::Window),
            (
                b"PA" | b"PR" | b"PU" | b"PD" | b"IN" | b"DF" | b"SP" | b"VS" | b"IP" | b"IW" | b"SC" | b"OA" | b"OC"
                | b"OE" | b"OF" | b"OH" | b"OI" | b"OO" | b"OP" | b"OS" | b"OW",
                _,
            ) => self.fail(COUNT),
            _ => self.fail(UNKNOWN),
        }
        Ops::new()
    }
}

/// Appends an op; [`OPS`] is as many as any part makes.
fn push(ops: &mut Ops, op: Op) {
    let full = ops.push(op).is_err();
    debug_assert!(!full, "a part makes more than {OPS} ops");
}

fn one(op: Op) -> Ops {
    let mut ops = Ops::new();
    push(&mut ops, op);
    ops
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use proptest::prelude::*;

    use super::*;

    const LIMITS: [[f64; 2]; 2] = [[0.0, 0.0], [1000.0, 500.0]];

    fn plotter() -> Plotter {
        Plotter::new(Window::new(LIMITS[0], LIMITS[1]), [0.0; 2])
    }

    fn run(plotter: &mut Plotter, bytes: &[u8]) -> Vec<Op> {
        let mut ops = Vec::new();
        for &byte in bytes {
            ops.extend(plotter.take(byte));
            while let Some(more) = plotter.take_again() {
                ops.extend(more);
            }
        }
        ops
    }

    /// Ops in letters: u, d, a move, and questions.
    fn letters(ops: &[Op]) -> std::string::String {
        let words = ops.iter().map(|op| match op {
            Op::Go { to: [x, y], .. } => std::format!("{x},{y}"),
            Op::Pen(down) => if *down { "d" } else { "u" }.into(),
            Op::Initialise => "in".into(),
            Op::Answer(question) => std::format!("{question:?}"),
        });
        words.collect::<Vec<_>>().join(" ")
    }

    #[test]
    fn instructions() {
        for (text, expected, error) in [
            ("IN;", "u in", 0),
            ("PU10,20;PD30,40,50,60;PU;", "u u 10,20 d d 30,40 d 50,60 u", 0),
            ("PD;PR10,0,0,10;", "d d 10,0 d 10,10", 0),
            ("PA10,10PD20,10;", "u 10,10 d d 20,10", 0),
            ("SP2;PD5,5;SP0;PD9,9;", "u d d 5,5 u u u 9,9", 0),
            ("PD-100,100,100,100,2000,100;", "d d 0,0 u u 0,100 d 100,100 d 1000,100 u", 0),
            ("IW0,0,50,50;PD100,25;PU;", "d d 50,12.5 u u", 0),
            ("PU900,0;PD900,-10,900,10;", "u u 900,0 d d 900,0 u u 900,0 d 900,10", 0),
            ("IP100,100,200,200;SC0,1,0,10;PA.5,5;PR.1,-1;", "u 150,150 u 160,140", 0),
            ("SC0,10,0,10;SC;PA7,7;", "u 7,7", 0),
            ("PD:;", "d", 3),
            ("PA1;", "", 2),
            ("PA1,2,3;", "u 1,2", 2),
            ("XX5;PA1,1;", "u 1,1", 1),
            ("PA99999999,0;PA1,1;", "u 1,1", 3),
            ("PR8000000,0,8000000,0;", "u 1000,0", 6),
            ("VS200;", "", 3),
            ("SP-1;", "", 3),
            ("SC1,1,0,1;", "", 3),
            ("SC1,2,3;", "", 2),
            ("OA5;", "", 2),
            ("OA;OE;OS;", "Actual Error Status", 0),
            ("LBPD1,1;\x03PA1,1;", "u 1,1", 0),
            ("PD;PR;DFPA1,1;", "d d 1,1", 0),
            ("PD;INPU;", "d u in u", 0),
        ] {
            let mut p = plotter();
            assert_eq!(letters(&run(&mut p, text.as_bytes())), expected, "{text}");
            assert_eq!(p.take_error(), error, "{text}");
        }
    }

    #[test]
    fn encoded_polylines() {
        let mut p = plotter();
        // < = 100,50, then by 10,-5 and by 0,20 with the pen down: n → 2n, or 2|n| + 1.
        let ops = run(
            &mut p,
            &[
                b"PE<=",
                &[63 + (200 & 63), 191 + (200 >> 6), 63 + 36, 191 + 1][..],
                &[191 + 20, 191 + 11],
                &[191, 191 + 40],
                b";PU;",
            ]
            .concat(),
        );
        assert_eq!(letters(&ops), "u 100,50 d d 110,45 d 110,65 u");
        assert_eq!(p.take_error(), 0);
    }

    #[test]
    fn speed_and_status() {
        let mut p = plotter();
        let ops = run(&mut p, b"VS5;PD10,10;PU0,0;VS;PD5,5;");
        let speeds: Vec<_> =
            ops.iter().filter_map(|op| if let Op::Go { speed, .. } = op { Some(*speed) } else { None }).collect();
        assert_eq!(speeds, [Some(5.0), None, None]);
        assert_eq!(p.take_status(), 1 + 8 + 16);
        run(&mut p, b"PU;IP0,0,9,9;QQ;");
        assert_eq!(p.take_status(), 2 + 16 + 32);
        assert_eq!((p.take_error(), p.take_error()), (1, 0));
        run(&mut p, b"IP0,0,100,100;SC0,1,0,1;PA.25,2;");
        assert_eq!((p.commanded(), p.tip()), ([0.25, 2.0], [25.0, 200.0]));
    }

    proptest! {
        #[test]
        fn the_pen_stays_in_the_window(bytes in prop::collection::vec(prop_oneof![
            3 => any::<u8>(),
            9 => prop::sample::select(b"PPAUDRE;;,,0123456789-.SCIW ".to_vec()),
        ], 0..200)) {
            let mut p = plotter();
            for op in run(&mut p, &bytes) {
                if let Op::Go { to, .. } = op {
                    prop_assert!(p.limits().contains(to), "{:?}", to);
                }
            }
        }
    }
}
