//! What is sent for each instruction of a job.
//!
//! Strokes go as relative moves between whole plotter units, and pens are moved by instructions of their own:
//!
//! ```text
//!  job:   PU100,200;              PD300,200,300,250;
//!  sent:  PU;PR-40,10;      OE;OA;   PD;PR200,0,0,50;      OE;OA;
//! ```
//!
//! So the position behind any of them is the sum of all moves before it: a byte that was lost, doubled or changed leaves the
//! pen elsewhere until the end of the job, and `OA;` tells. As only one instruction lowers the pen for a stroke, it stays up to
//! the end of the stroke where that one is mangled, and `OA;` tells that too; it is asked before each change. Where the
//! position is not known (see [`crate::trace::hpgl`]), instructions go as the job has them. A plotter that takes `PE` has the same
//! increments of strokes in that; the way to a stroke stays in digits, for what is encoded draws. What does not show in the place of the
//! pen, such as a pen's number that the plotter does not have, `OE` tells where the plotter knows that.

use std::collections::VecDeque;
use std::fmt::Write as _;

use super::holders::{Holders, Swap, selected};
use super::{Job, encoded};
use crate::trace::hpgl::{Action, Motion, Path, State};

/// A question that is answered when all before it is carried out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ask {
    /// Where the pen is, and whether it is down.
    Place,
    /// Whether anything was refused, and then the same.
    Check,
}

impl Ask {
    pub(super) fn bytes(self) -> &'static [u8] {
        match self {
            Self::Place => b"OA;",
            Self::Check => b"OE;OA;",
        }
    }
}

/// Longest list of relative moves in bytes; shorter where the buffer is small.
const LIST_BYTES: usize = 200;
/// Puts the pen into its holder.
const PUT_AWAY: &[u8] = b"SP0;";
/// Largest increment that every plotter takes.
const INCREMENT_MAX: i64 = 32_767;

/// Where the plotter must be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Expected {
    /// Instructions of the job that are carried out by then.
    pub(super) pieces: usize,
    /// In plotter units, if it is known.
    pub(super) at: Option<[i64; 2]>,
    /// Whether the pen is down, if it is known.
    pub(super) down: Option<bool>,
}

impl Expected {
    /// Whether the plotter may be there.
    pub(super) fn fits(&self, at: [i64; 2], down: bool) -> bool {
        self.at.is_none_or(|expected| expected == at) && self.down.is_none_or(|expected| expected == down)
    }
}

/// Bytes that are sent together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Unit {
    pub(super) bytes: Vec<u8>,
    /// What the plotter must be like when it has carried them out.
    pub(super) after: Expected,
    /// Whether they end with the end of an instruction, so that something else may be sent behind them.
    pub(super) whole: bool,
    /// The question that this is, if it is one.
    pub(super) asks: Option<Ask>,
}

/// Makes units of a job's instructions, one instruction at a time.
#[derive(Debug)]
pub(super) struct Words {
    state: State,
    /// Whether the plotter takes coordinates as increments; none while that is its own affair.
    relative: Option<bool>,
    /// Index of the next instruction.
    next: usize,
    units: VecDeque<Unit>,
    /// Bytes since the last question.
    unasked: usize,
    /// Most bytes of a unit.
    unit_bytes: usize,
    /// Most points in a list.
    list_points: usize,
    /// Whether strokes go in `PE`.
    encoded: bool,
    /// Bytes after which the question is put within a stroke too.
    span: usize,
    /// What is asked.
    question: Ask,
    holders: Holders,
    /// What is to be done by hand before the next instruction.
    swap: Option<Swap>,
    /// Speed in percent of that of the job, the speed that the job has when it says none, and the fastest (cm/s).
    percent: u16,
    speeds: Option<(f64, u32)>,
}

/// What [`Words`] goes by.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Size of the plotter's buffer in bytes.
    pub(super) buffer_bytes: usize,
    /// Most points in a list.
    pub(super) list_points: usize,
    /// Whether strokes go in `PE`.
    pub(super) encoded: bool,
    /// Whether nothing but the answers tells how full the buffer is.
    pub(super) asks_often: bool,
    /// What the plotter is asked.
    pub(super) question: Ask,
    /// Pens that it holds.
    pub(super) pens: u32,
    /// Speed where the job says none, and the fastest, in cm/s; none where the plotter's speed cannot be set.
    pub(super) speeds: Option<(f64, u32)>,
}

impl Words {
    pub(super) fn new(limits: Limits) -> Self {
        let third = limits.buffer_bytes / 3;
        Self {
            state: State::unknown(),
            relative: None,
            next: 0,
            units: VecDeque::new(),
            unasked: 0,
            unit_bytes: third.clamp(16, LIST_BYTES),
            list_points: limits.list_points.max(1),
            encoded: limits.encoded,
            span: if limits.asks_often { third } else { usize::MAX },
            question: limits.question,
            holders: Holders::new(limits.pens),
            swap: None,
            percent: 100,
            speeds: limits.speeds,
        }
    }

    /// What the plotter must be like when all that was made is carried out.
    pub(super) fn expected(&self) -> Expected {
        // In the gaps of a pattern the pen is up.
        let down = self.state.down.filter(|down| !down || self.state.is_solid());
        Expected { pieces: self.next, at: self.state.at, down }
    }

    /// Whether the pen is known to be up, and no instruction is under way.
    pub(super) fn may_rest(&self) -> bool {
        self.units.is_empty() && self.state.down == Some(false)
    }

    /// The next unit; none when there is none left.
    pub(super) fn peek(&mut self, job: &Job) -> Option<&Unit> {
        while self.units.is_empty() && self.swap.is_none() && self.next < job.instructions().len() {
            self.make(job);
        }
        if self.units.is_empty() && self.unasked > 0 {
            self.ask();
        }
        self.units.front()
    }

    /// What is still to be sent before the plotter rests: the question whether it has come there.
    pub(super) fn rest(&mut self) -> Option<&Unit> {
        if self.units.is_empty() && self.unasked > 0 {
            self.ask();
        }
        self.units.front()
    }

    pub(super) fn take(&mut self) -> Option<Unit> {
        self.units.pop_front()
    }

    /// What is to be done by hand now, if that is so. All units are taken by then.
    pub(super) fn swap(&self) -> Option<Swap> {
        self.swap.filter(|_| self.units.is_empty() && self.unasked == 0)
    }

    /// It is done.
    pub(super) fn swapped(&mut self) {
        if let Some(swap) = self.swap.take() {
            self.holders.put(swap);
        }
    }

    /// Draws at this speed from here on.
    pub(super) fn set_percent(&mut self, percent: u16) {
        if self.speeds.is_some() && percent != self.percent {
            self.percent = percent;
            let speed = self.speed();
            self.push(speed, true);
        }
    }

    fn speed(&self) -> Vec<u8> {
        let Some((usual, fastest)) = self.speeds else { return Vec::new() };
        let speed = self.state.speed.unwrap_or(usual) * f64::from(self.percent) / 100.0;
        format!("VS{};", (speed.round() as u32).clamp(1, fastest)).into_bytes()
    }

    fn push(&mut self, bytes: Vec<u8>, whole: bool) {
        self.unasked += bytes.len();
        let after = self.expected();
        self.units.push_back(Unit { bytes, after, whole, asks: None });
    }

    fn ask(&mut self) {
        self.unasked = 0;
        let after = self.expected();
        let asks = Some(self.question);
        self.units.push_back(Unit { bytes: self.question.bytes().to_vec(), after, whole: true, asks });
    }

    /// Makes the units of the next instruction.
    fn make(&mut self, job: &Job) {
        let Some(instruction) = job.instructions().get(self.next) else { return };
        let before = self.state;
        let mut state = before;
        let action = state.follow(instruction);
        let is = |name: &str| instruction.get(..2).is_some_and(|word| word.eq_ignore_ascii_case(name.as_bytes()));
        // What begins anew forgets its errors.
        let begins_anew = is("IN") || is("DF");
        let changes = state.down != before.down || matches!(action, Action::Select | Action::Unknown);
        if (changes || begins_anew) && self.unasked > 0 {
            self.ask();
        }
        let pen = selected(instruction);
        if let Some(swap) = pen.and_then(|pen| self.holders.swap(pen)) {
            // Nobody can reach for a pen that is held up.
            self.state.follow(PUT_AWAY);
            self.verbatim(PUT_AWAY);
            self.swap = Some(swap);
            return;
        }
        match action {
            Action::Move(Motion { lowers, path: Path::Through(points) }) => {
                self.lower(lowers.filter(|lowers| before.down != Some(*lowers)));
                self.moves(before.at, &points);
                self.state = state;
            }
            Action::Move(Motion { lowers: Some(lowers), path: Path::Stays }) => {
                self.lower(Some(lowers));
                self.state = state;
            }
            Action::Move(Motion { lowers, path }) => {
                if let (Some(_), Path::Unknown, Some(absolute)) = (lowers, &path, before.absolute)
                    && self.relative != Some(!absolute)
                {
                    self.push(if absolute { b"PA;".to_vec() } else { b"PR;".to_vec() }, true);
                }
                self.relative = state.absolute.map(|absolute| !absolute).or(self.relative);
                self.state = state;
                self.verbatim(instruction);
            }
            Action::Set => {
                self.state = state;
                if begins_anew {
                    self.relative = Some(false);
                }
                self.verbatim(instruction);
                if self.percent != 100 && (begins_anew || is("VS")) {
                    let speed = self.speed();
                    self.push(speed, true);
                }
            }
            Action::Select | Action::Unknown => {
                self.state = state;
                match pen.map(|pen| (pen, self.holders.of(pen))) {
                    Some((pen, holder)) if holder != pen => self.verbatim(format!("SP{holder};").as_bytes()),
                    _ => self.verbatim(instruction),
                }
            }
        }
        self.next += 1;
        // What the units leave behind is the end of the instruction.
        let pieces = self.next;
        if let Some(last) = self.units.back_mut().filter(|unit| unit.asks.is_none()) {
            last.after.pieces = pieces;
        }
        if self.unasked >= self.span {
            self.ask();
        }
    }

    fn lower(&mut self, lowers: Option<bool>) {
        if let Some(down) = lowers {
            self.state.down = Some(down);
            self.push(if down { b"PD;".to_vec() } else { b"PU;".to_vec() }, true);
        }
    }

    /// Moves through points, from where the pen is if that is known.
    fn moves(&mut self, from: Option<[i64; 2]>, points: &[[i64; 2]]) {
        self.state.at = from;
        let mut list = String::new();
        let mut count = 0;
        for &[x, y] in points {
            let step = self.state.at.map(|[from_x, from_y]| [x - from_x, y - from_y]);
            let step = step.filter(|step| step.iter().all(|d| d.abs() <= INCREMENT_MAX));
            let mut word = String::new();
            let begins = match step {
                Some(step) if self.encoded && self.state.down == Some(true) => {
                    encoded::push(&mut word, step);
                    encoded::BEGIN
                }
                _ => {
                    let [a, b] = step.unwrap_or([x, y]);
                    // Writing to a string cannot fail.
                    let _ = write!(word, "{a},{b}");
                    self.relative = Some(step.is_some());
                    if step.is_some() { "PR" } else { "PA" }
                }
            };
            let fits =
                list.starts_with(begins) && count < self.list_points && list.len() + word.len() + 2 <= self.unit_bytes;
            if fits {
                if begins != encoded::BEGIN {
                    list.push(',');
                }
                list.push_str(&word);
                count += 1;
            } else {
                self.list(std::mem::take(&mut list));
                list = format!("{begins}{word}");
                count = 1;
            }
            self.state.at = Some([x, y]);
        }
        self.list(list);
    }

    /// The list of moves up to the pen's place.
    fn list(&mut self, mut list: String) {
        if list.is_empty() {
            return;
        }
        list.push(';');
        self.push(list.into_bytes(), true);
        if self.unasked >= self.span {
            self.ask();
        }
    }

    /// The instruction as it is, in parts if it is long.
    fn verbatim(&mut self, instruction: &[u8]) {
        let count = instruction.len().div_ceil(self.unit_bytes);
        for (index, part) in instruction.chunks(self.unit_bytes).enumerate() {
            self.push(part.to_vec(), index + 1 == count);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits = Limits {
        buffer_bytes: 1024,
        list_points: 99,
        encoded: false,
        asks_often: false,
        question: Ask::Place,
        pens: 8,
        speeds: Some((38.0, 38)),
    };

    fn sent(hpgl: &str, limits: Limits) -> String {
        let job = Job::new(hpgl.as_bytes()).unwrap();
        let mut words = Words::new(limits);
        let mut text = String::new();
        while words.peek(&job).is_some() {
            text.push_str(&String::from_utf8_lossy(&words.take().unwrap().bytes));
        }
        text
    }

    #[test]
    fn strokes_go_as_relative_moves_with_questions_before_each_change_of_the_pen() {
        let table = [
            (
                "IN;PA;PU;SP1;PU40,80;PD120,80,120,90;PU;SP0;",
                "IN;PA;PU;OA;SP1;PA40,80;OA;PD;PR80,0,0,10;OA;PU;OA;SP0;OA;",
            ),
            // The pen is up before, and down after: each instruction that moves it goes by itself.
            ("IN;PU5,5;PD6,6;PD7,8;PU9,9;PD9,9;PU;", "IN;PA5,5;OA;PD;PR1,1;PR1,2;OA;PU;PR2,1;OA;PD;PR0,0;OA;PU;OA;"),
            // Relative jobs are the same to the plotter.
            ("IN;PA5,5;PD;PR1,0,0,1;PU;", "IN;PA5,5;OA;PD;PR1,0,0,1;OA;PU;OA;"),
            // What is not known goes as it is, in the mode that the job has it in.
            ("SP1;PU4,4;PD5,5;PU;", "SP1;OA;PU4,4;OA;PD5,5;OA;PU;OA;"),
            ("IN;PA1,1;PR;LBx\x03PU2,2;PA3,3;PU4,4;", "IN;PA1,1;PR;OA;LBx\x03OA;PU2,2;PA3,3;PR1,1;OA;"),
            ("IN;PA1,1;PA2,2;SC0,9,0,9;PU3,3;", "IN;PA1,1;PR1,1;SC0,9,0,9;PA;PU3,3;OA;"),
            ("IN;PA-30000,0;PD30000,0;", "IN;PA-30000,0;OA;PD;PA30000,0;OA;"),
        ];
        for (hpgl, expected) in table {
            assert_eq!(sent(hpgl, LIMITS), expected, "{hpgl}");
        }
    }

    #[test]
    fn strokes_are_encoded_where_the_plotter_takes_that() {
        let table = [
            ("IN;PA;PU;SP1;PU40,80;PD120,80,120,90;PU;", "IN;PA;PU;OA;SP1;PA40,80;OA;PD;PE7?d__s;OA;PU;OA;"),
            // A mode that was not told is not needed: `PE` has its own. A way that is too long has digits.
            ("IN;PU5,5;PD6,6;PD9,9;PU;", "IN;PA5,5;OA;PD;PE7aa;PE7ee;OA;PU;OA;"),
            ("IN;PA-30000,0;PD30000,0;PD30001,0;", "IN;PA-30000,0;OA;PD;PA30000,0;PE7a_;OA;"),
            ("IN;PA1,1;PD2,2;LBx\x03PD3,3;", "IN;PA1,1;OA;PD;PE7aa;OA;LBx\x03OA;PD;PA3,3;OA;"),
        ];
        for (hpgl, expected) in table {
            assert_eq!(sent(hpgl, Limits { encoded: true, ..LIMITS }), expected, "{hpgl}");
        }
        let small = Limits { buffer_bytes: 60, encoded: true, ..LIMITS };
        let text = sent(&format!("IN;PA0,0;PD{}0,0;PU;", "1000,0,0,0,".repeat(20)), small);
        assert!(text.contains("PE7") && text.split_inclusive(';').all(|one| one.len() <= 20), "{text}");
    }

    #[test]
    fn a_pen_that_the_plotter_does_not_hold_waits_until_it_is_put_in() {
        let job = Job::new(b"IN;PA;SP1;PU1,1;PD2,2;PU;SP3;PU1,1;PD2,2;PU;SP1;PU;SP0;").unwrap();
        let mut words = Words::new(Limits { pens: 2, ..LIMITS });
        let mut parts = Vec::new();
        loop {
            let mut text = String::new();
            while words.peek(&job).is_some() {
                assert_eq!(words.swap(), None);
                text.push_str(&String::from_utf8_lossy(&words.take().unwrap().bytes));
            }
            let swap = words.swap();
            parts.push((text, words.expected().pieces, swap.map(|swap| (swap.pen, swap.holder))));
            if swap.is_none() {
                break;
            }
            words.swapped();
        }
        let wanted = [
            ("IN;PA;OA;SP1;PA1,1;OA;PD;PR1,1;OA;PU;OA;SP0;OA;", 6, Some((3, 1))),
            ("SP1;PR-1,-1;OA;PD;PR1,1;OA;PU;OA;SP0;OA;", 10, Some((1, 1))),
            ("SP1;PU;OA;SP0;OA;", 13, None),
        ];
        assert_eq!(parts, wanted.map(|(text, pieces, swap)| (text.to_owned(), pieces, swap)));
    }

    #[test]
    fn lists_are_cut_where_the_plotter_needs_it() {
        let short = Limits { list_points: 2, ..LIMITS };
        assert_eq!(sent("IN;PA0,0;PD1,0,2,0,3,0;PU;", short), "IN;PA0,0;OA;PD;PR1,0,1,0;PR1,0;OA;PU;OA;");
        let small = Limits { buffer_bytes: 60, asks_often: true, ..LIMITS };
        let job = format!("IN;PA0,0;PD{}0,0;PU;", "1000,0,0,0,".repeat(20));
        let text = sent(&job, small);
        for instruction in text.split_inclusive(';') {
            assert!(instruction.len() <= 20, "{instruction}");
        }
        for piece in text.split("OA;") {
            assert!(piece.len() <= 40, "{piece}");
        }
    }

    #[test]
    fn what_is_expected_adds_up() {
        let job = Job::new(b"IN;PA5,5;PD6,6,7,9;LT2;PD9,9;PU;LBx\x03").unwrap();
        let mut words = Words::new(LIMITS);
        let mut seen = Vec::new();
        while words.peek(&job).is_some() {
            let unit = words.take().unwrap();
            if unit.asks.is_some() {
                seen.push((unit.after.pieces, unit.after.at, unit.after.down));
            }
        }
        let up = Some(false);
        assert_eq!(seen, [(2, Some([5, 5]), up), (5, Some([9, 9]), None), (6, Some([9, 9]), up), (7, None, None)]);
    }

    #[test]
    fn the_speed_is_that_of_the_job_in_percent() {
        let job = Job::new(b"IN;VS20;PA1,1;IN;PA2,2;").unwrap();
        let mut words = Words::new(LIMITS);
        words.set_percent(50);
        let mut text = String::new();
        while words.peek(&job).is_some() {
            text.push_str(&String::from_utf8_lossy(&words.take().unwrap().bytes));
        }
        assert_eq!(text, "VS19;OA;IN;VS19;VS20;VS10;PA1,1;OA;IN;VS19;PA2,2;OA;");
    }
}
