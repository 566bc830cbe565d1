//! HPGL on the machine: which language is spoken, and ops to motion.
//!
//! With `$450=0` the machine speaks G-code until the first thing that it hears, with nothing else unread, is `ESC` or `IN;`: no line of G-code begins so. 0x18 goes back.
//! A line that begins with `$` between two instructions is a system command in HPGL too. A locked machine reads on, and answers, but moves nothing and keeps the
//! pen up; where it can home, `IN` has it home.

use core::fmt::Write;

use embedded_storage::nor_flash::NorFlash;
use heapless::Deque;

use super::{Controller, Homing, Job, Mode, Progress};
use crate::gcode::{PenOrder, Speed, Spindle, in_range};
use crate::hpgl::{Control, HPGL_BYTES, OPS, Op, Order, Plotter, Question, Received, Window};
use crate::line::RX_BYTES;
use crate::number::write_fixed;
use crate::stepper::{Command, StepSink};

/// `$450`.
const GCODE: u8 = 1;
const HPGL: u8 = 2;

const ESC: u8 = 0x1b;
const CAN: u8 = 0x18;

/// mm/min in 1 cm/s.
const MM_MIN_PER_CM_S: f64 = 600.0;

/// `OE`: the machine is locked by an alarm. HP's own end at 6.
const LOCKED: u8 = 7;

/// `ESC.O`: the buffer is empty, the machine is held, the machine is locked.
const STATUS_EMPTY: u8 = 8;
const STATUS_HELD: u8 = 16;
const STATUS_LOCKED: u8 = 32;

/// The language, and the state of HPGL.
#[derive(Debug)]
pub(super) struct Speech {
    hpgl: bool,
    /// Letters of `IN;` that have come as the first thing.
    heard: usize,
    control: Control,
    plotter: Plotter,
    ops: Deque<Op, OPS>,
    /// `ESC.K`: the motion under way is to be stopped and forgotten.
    aborting: bool,
    /// A line that begins with `$` is being read.
    command: bool,
    /// Something else than HPGL has moved the machine.
    moved: bool,
    /// 0x18 has come: the language is chosen anew.
    anew: bool,
}

impl Default for Speech {
    fn default() -> Self {
        Self {
            hpgl: false,
            heard: 0,
            control: Control::default(),
            plotter: Plotter::new(Window::default(), [0.0; 2]),
            ops: Deque::new(),
            aborting: false,
            command: false,
            moved: true,
            anew: false,
        }
    }
}

impl Speech {
    pub(super) fn is_hpgl(&self) -> bool {
        self.hpgl
    }

    pub(super) fn is_ready(&self) -> bool {
        self.control.is_ready()
    }

    /// No op is left.
    pub(super) fn is_idle(&self) -> bool {
        self.ops.is_empty() && !self.aborting
    }

    /// The machine is locked.
    pub(super) fn fail(&mut self) {
        self.plotter.fail(LOCKED);
    }
}

impl<const BLOCKS: usize, F: NorFlash> Controller<BLOCKS, F> {
    /// The language of the start, by `$450`.
    pub(super) fn choose_language(&mut self) {
        self.speak(self.stored.settings.language == HPGL);
    }

    fn speak(&mut self, hpgl: bool) {
        self.speech = Speech { hpgl, ..Speech::default() };
        self.receiver.set_limit(if hpgl { HPGL_BYTES } else { RX_BYTES });
    }

    /// 0x18.
    pub(super) fn ask_reset(&mut self) {
        self.reset = true;
        self.speech.anew = true;
    }

    /// Forgets what of a language was half said; after 0x18 the language too.
    pub(super) fn hear_anew(&mut self) {
        let hpgl = if self.speech.anew { self.stored.settings.language == HPGL } else { self.speech.hpgl };
        self.speak(hpgl);
    }

    /// Takes a byte of HPGL, or the first that shows that it is HPGL. False when it belongs to G-code.
    pub(super) fn hear(&mut self, byte: u8) -> bool {
        if !self.speech.hpgl && !self.is_first_of_hpgl(byte) {
            return false;
        }
        if byte == CAN {
            self.ask_reset();
            return true;
        }
        match self.speech.control.receive(byte) {
            Received::Data(byte) => {
                if !self.receiver.push(byte) {
                    self.speech.control.overflow();
                }
                self.shake_hands();
            }
            Received::Order(order) => self.obey_order(order),
            Received::Shake => {
                self.receiver.set_limit(self.speech.control.size());
                self.shake_hands();
            }
            Received::None => {}
        }
        true
    }

    /// Whether this byte shows that HPGL is spoken; then it is.
    fn is_first_of_hpgl(&mut self, byte: u8) -> bool {
        if self.stored.settings.language == GCODE {
            return false;
        }
        // Nothing but what was heard of the beginning waits to be understood.
        let unread = self.receiver.len() + self.editor.len();
        let fresh = unread == self.speech.heard && (unread > 0 || self.editor.is_empty());
        let first = fresh && matches!(self.job, Job::None) && !self.reset;
        match (self.speech.heard, byte.to_ascii_uppercase()) {
            (0, ESC) if first => {
                self.speak(true);
                true
            }
            (heard @ 0, b'I') | (heard @ 1, b'N') if first => {
                self.speech.heard = heard + 1;
                false
            }
            (2, b';') if first => {
                self.receiver.clear();
                self.editor.clear();
                self.speak(true);
                for byte in *b"IN" {
                    self.receiver.push(byte);
                }
                true
            }
            _ => {
                self.speech.heard = 0;
                false
            }
        }
    }

    /// Says whether there is room, as the handshake asks for.
    fn shake_hands(&mut self) {
        let signs = self.speech.control.room(self.receiver.free());
        self.transmitter.bytes(&signs);
    }

    /// Device control that is answered, or that stops.
    fn obey_order(&mut self, order: Order) {
        let status = STATUS_EMPTY * u8::from(self.receiver.is_empty())
            + STATUS_HELD * u8::from(self.hold.is_on())
            + STATUS_LOCKED * u8::from(self.is_locked());
        let number = match order {
            Order::Free => self.receiver.free(),
            Order::Size => self.speech.control.size(),
            Order::Status => usize::from(status),
            Order::Error => usize::from(self.speech.control.take_error()),
            Order::Abort => {
                self.receiver.clear();
                self.speech.aborting = true;
                self.shake_hands();
                return;
            }
        };
        self.transmitter.reply(self.speech.control.terminator(), |out| write!(out, "{number}"));
    }

    fn is_locked(&self) -> bool {
        matches!(self.mode, Mode::Alarm | Mode::NeedsReset | Mode::Sleep)
    }

    /// Goes on with HPGL: does an op, or reads a byte. True when anything was done.
    pub(super) fn plot(&mut self, stepper: &mut impl StepSink) -> bool {
        if self.speech.aborting {
            if !self.brake(stepper) {
                return false;
            }
            self.speech.ops.clear();
            self.speech.command = false;
            self.editor.clear();
            let here = self.plotter_units();
            self.speech.plotter.abort(here);
            self.speech.aborting = false;
            return true;
        }
        if let Some(op) = self.speech.ops.front().copied() {
            let done = self.operate(op, stepper);
            if done {
                self.speech.ops.pop_front();
            }
            return done;
        }
        if let Some(ops) = self.speech.plotter.take_again() {
            self.speech.ops.extend(ops);
            return true;
        }
        if self.speech.moved {
            if !self.is_still(stepper) {
                return false;
            }
            self.speech.moved = false;
            let here = self.plotter_units();
            self.speech.plotter.set_position(here);
        }
        let Some(byte) = self.receiver.pop() else { return false };
        self.shake_hands();
        let between = self.speech.plotter.is_between();
        if self.speech.command || (between && byte == b'$') {
            self.speech.command = true;
            if self.editor.push(byte) {
                self.speech.command = false;
                self.speech.moved = true;
                self.end_line(stepper);
            }
            return true;
        }
        if between {
            let limits = self.plotter_limits();
            self.speech.plotter.set_limits(limits);
        }
        let ops = self.speech.plotter.take(byte);
        self.speech.ops.extend(ops);
        true
    }

    /// The origin of plotter units, machine mm.
    fn plotter_origin(&self) -> [f64; 2] {
        let [x, y, _] = self.gcode.work_offset(&self.stored.systems);
        [x, y]
    }

    /// Where the last motion ends, in plotter units.
    fn plotter_units(&self) -> [f64; 2] {
        let (origin, unit) = (self.plotter_origin(), self.stored.settings.plotter_unit);
        [0, 1].map(|axis: usize| (self.gcode.position[axis] - origin[axis]) / unit)
    }

    /// The hard-clip limits: the whole plotter units within the reach of the axes.
    fn plotter_limits(&self) -> Window {
        let (origin, settings) = (self.plotter_origin(), &self.stored.settings);
        // A limit that is a whole number of units but for its rounding is that number.
        let units = |axis: usize, mm: f64| (mm - origin[axis]) / settings.plotter_unit;
        let (x, y) = (settings.reach(0), settings.reach(1));
        let low = [units(0, x[0]), units(1, y[0])].map(|v| libm::ceil(v - 1e-6));
        let high = [units(0, x[1]), units(1, y[1])].map(|v| libm::floor(v + 1e-6));
        Window::new(low, high)
    }

    /// Does an op; false when it must wait.
    fn operate(&mut self, op: Op, stepper: &mut impl StepSink) -> bool {
        let moves = matches!(op, Op::Go { .. } | Op::Pen(true));
        if moves && self.mode != Mode::Normal {
            if self.is_locked() {
                self.speech.fail();
            }
            return true;
        }
        match op {
            Op::Go { to, speed } => self.go(to, speed, stepper),
            Op::Pen(down) => self.put_pen(down, stepper),
            Op::Initialise => {
                if self.mode == Mode::Alarm && !self.stored.settings.homing_axes().is_empty() {
                    self.job = Job::Homing(Homing::silent(self.stored.settings.homing_axes()));
                    self.speech.moved = true;
                }
                true
            }
            Op::Answer(question) => {
                let rests = self.is_drained(stepper) || self.is_locked();
                if rests {
                    self.answer_question(question);
                }
                rests
            }
        }
    }

    /// Plans the way, in pieces that are straight for the motors; false while the planner has no room for the next.
    fn go(&mut self, to: [f64; 2], speed: Option<f64>, stepper: &impl StepSink) -> bool {
        let (origin, unit) = (self.plotter_origin(), self.stored.settings.plotter_unit);
        let mut target = self.gcode.position;
        for axis in 0..2 {
            let [low, high] = self.stored.settings.reach(axis);
            // A whole unit may stick out of the reach by the rounding of its limits.
            target[axis] = (to[axis] * unit + origin[axis]).max(low).min(high);
        }
        if in_range(target, &self.stored.settings).is_err() {
            self.speech.plotter.fail(6);
            return true;
        }
        let speed = speed.map_or(Speed::Rapid, |cm_s| Speed::Feed(cm_s * MM_MIN_PER_CM_S));
        while !self.planner.is_full(stepper.drawn().lines) {
            match self.line(target, speed) {
                Progress::Moved => {}
                Progress::Waiting => break,
                Progress::Done => {
                    self.gcode.position = target;
                    return true;
                }
            }
        }
        false
    }

    /// Moves the pen once everything before has been drawn, and gives it its time.
    fn put_pen(&mut self, down: bool, stepper: &mut impl StepSink) -> bool {
        let order = if down { PenOrder::Speed(self.stored.settings.spindle_max) } else { PenOrder::Off };
        let pen = self.pen_of(order);
        if pen == self.pen {
            return true;
        }
        if !self.is_drained(stepper) || stepper.room() < 2 || !self.hand_pen(pen, stepper) {
            return false;
        }
        self.gcode.spindle = if down { Spindle::Clockwise } else { Spindle::Off };
        if let PenOrder::Speed(s) = order {
            (self.gcode.speed, self.pen_speed) = (s, s);
        }
        let delay = u32::from(self.stored.settings.pen_delay) * 1000;
        // The room has just been checked.
        delay == 0 || stepper.push(Command::Dwell(delay))
    }

    fn answer_question(&mut self, question: Question) {
        let plotter = &mut self.speech.plotter;
        let end = self.speech.control.terminator();
        let pen = u8::from(plotter.is_down());
        let unit = self.stored.settings.plotter_unit;
        let whole = |v: f64| libm::round(v) as i64;
        let rectangle = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a, b, c, d].map(whole);
        let numbers = match question {
            Question::Actual => {
                let [x, y] = plotter.tip().map(whole);
                return self.transmitter.reply(end, |out| write!(out, "{x},{y},{pen}"));
            }
            Question::Commanded => {
                let [x, y] = plotter.commanded();
                return self.transmitter.reply(end, |out| {
                    write_fixed(out, x, 4)?;
                    out.write_char(',')?;
                    write_fixed(out, y, 4)?;
                    write!(out, ",{pen}")
                });
            }
            Question::Error => {
                let error = plotter.take_error();
                return self.transmitter.reply(end, |out| write!(out, "{error}"));
            }
            Question::Status => {
                let status = plotter.take_status();
                return self.transmitter.reply(end, |out| write!(out, "{status}"));
            }
            Question::Factors => {
                let factor = whole(1.0 / unit);
                return self.transmitter.reply(end, |out| write!(out, "{factor},{factor}"));
            }
            Question::Identification => return self.transmitter.reply(end, |out| out.write_str("PENVIS")),
            // No pens to choose from, no arcs, no polygons.
            Question::Options => return self.transmitter.reply(end, |out| out.write_str("0,0,0,0,0,0,0,0")),
            Question::HardClip => rectangle(plotter.limits().low(), plotter.limits().high()),
            Question::Window => rectangle(plotter.window().low(), plotter.window().high()),
            Question::Points => {
                let [low, high] = plotter.points();
                rectangle(low, high)
            }
        };
        let [a, b, c, d] = numbers;
        self.transmitter.reply(end, |out| write!(out, "{a},{b},{c},{d}"));
    }
}
