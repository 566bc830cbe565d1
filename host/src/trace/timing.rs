//! How long a job takes: the line that it comes over, and the motion, as the firmware's own planner makes it.
//!
//! ```text
//!  pieces ──> line: so many baud, and no more on the way than the plotter's buffer holds
//!     └─────> planner: a window of moves, none planned before it has arrived ──> segments ──> time
//! ```
//!
//! A plotter with a planner of its own turns corners a little otherwise; which speeds it can reach, and where it has to wait for the line, is the same.

use std::collections::VecDeque;

use glam::DVec3;
use penvis_firmware::{AXES, Mechanics, SEGMENTS, Slice, Stopwatch};

use crate::device::{Device, Language, Streaming};
use crate::straight;

/// Bits of a byte on the line: with its start and stop bit.
const BITS: f64 = 10.0;

/// Bytes of an answer, `ok` with its line end.
const ANSWER: f64 = 4.0;

/// Bytes that Marlin's line number, checksum and asterisk take, of jobs of some thousand lines.
const NUMBERED: usize = 10;

/// Time in s by which the segments that have been made are ahead of the motors.
const LEAD_S: f64 = SEGMENTS as f64 * 0.0025;

/// Farthest from where motion began, in mm, that steps are counted.
const FARTHEST_MM: f64 = 1e6;

/// What the time of a job depends on, besides the job.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    mechanics: Mechanics,
    /// Moves that are planned together; one: each comes to rest.
    lookahead: u32,
    /// Time in s of a byte on the line.
    byte_s: f64,
    /// Bytes on the way at most.
    window: usize,
    /// Pieces on the way at most.
    pieces: usize,
    /// Bytes that go with each piece.
    with_each: usize,
    /// Bytes to and from the plotter where it is asked how it stands, at the ends of strokes.
    question: [usize; 2],
}

impl Pace {
    /// That of a device.
    #[must_use]
    pub fn of(device: &Device) -> Self {
        let (window, pieces, with_each, question) = match &device.language {
            Language::Grbl(gcode) => {
                let pieces = if gcode.streaming == Streaming::SendResponse { 1 } else { usize::MAX };
                // `$G` and `?`, with some 55 and 75 bytes of answer.
                (gcode.rx_bytes, pieces, 1, [4, 130])
            }
            // `M114`, with its number.
            Language::Marlin(gcode) => (gcode.rx_bytes, gcode.buffer_lines.max(1), 1 + NUMBERED, [5 + NUMBERED, 70]),
            // `OA;OE;`, for whose answers nothing waits.
            Language::Hpgl(hpgl) => (hpgl.buffer_bytes, usize::MAX, 0, [6, 0]),
        };
        let mechanics = Mechanics {
            // The Z axis of a pen is as fast as it is told to be.
            max_rate: [device.travel_feed, device.travel_feed, 1e6],
            acceleration: [device.acceleration; AXES],
            junction_deviation: device.junction_deviation,
        };
        let byte_s = BITS / f64::from(device.baud);
        Self { mechanics, lookahead: device.lookahead, byte_s, window, pieces, with_each, question }
    }

    /// That of a machine to which a job comes at once.
    #[cfg(test)]
    pub(super) fn of_motion(mechanics: Mechanics, lookahead: u32) -> Self {
        Self {
            mechanics,
            lookahead,
            byte_s: 0.0,
            window: usize::MAX,
            pieces: usize::MAX,
            with_each: 0,
            question: [0; 2],
        }
    }
}

/// A planner with a window of some size.
trait Plan {
    fn is_full(&self) -> bool;
    fn append(&mut self, target: [f64; AXES], feed: Option<f64>) -> bool;
    fn advance(&mut self) -> Option<Slice>;
}

impl<const BLOCKS: usize> Plan for Stopwatch<BLOCKS> {
    fn is_full(&self) -> bool {
        self.is_full()
    }

    fn append(&mut self, target: [f64; AXES], feed: Option<f64>) -> bool {
        self.append(target, feed)
    }

    fn advance(&mut self) -> Option<Slice> {
        self.advance()
    }
}

/// The planner whose window is nearest to so many moves.
fn plan(mechanics: &Mechanics, lookahead: u32) -> Box<dyn Plan> {
    match lookahead {
        0..=2 => Box::new(Stopwatch::<2>::new(mechanics)),
        3..=5 => Box::new(Stopwatch::<4>::new(mechanics)),
        6..=11 => Box::new(Stopwatch::<8>::new(mechanics)),
        12..=23 => Box::new(Stopwatch::<16>::new(mechanics)),
        24..=47 => Box::new(Stopwatch::<32>::new(mechanics)),
        48..=95 => Box::new(Stopwatch::<64>::new(mechanics)),
        _ => Box::new(Stopwatch::<128>::new(mechanics)),
    }
}

/// The line to the plotter.
struct Line {
    /// When the last byte has been sent, s.
    free: f64,
    /// Pieces on the way or in the buffer: their bytes, and when they are taken from it.
    out: VecDeque<(usize, f64)>,
    bytes: usize,
}

/// Follows a job in time, piece by piece.
pub(crate) struct Timer {
    pace: Pace,
    plan: Box<dyn Plan>,
    line: Line,
    /// The piece that is being followed, and its bytes.
    piece: (usize, usize),
    /// When it is taken from the buffer.
    taken: f64,
    /// End of the last segment, s.
    now: f64,
    /// Time in s since the last line ended.
    open: f64,
    /// Lines that have not ended: the piece each belongs to, and its length in mm.
    under_way: VecDeque<(usize, f64)>,
    at: DVec3,
    /// Time in s of each piece.
    seconds: Vec<f64>,
}

impl Timer {
    /// Of a job of so many pieces.
    pub(crate) fn new(pace: &Pace, pieces: usize) -> Self {
        Self {
            pace: *pace,
            plan: plan(&pace.mechanics, pace.lookahead),
            line: Line { free: 0.0, out: VecDeque::new(), bytes: 0 },
            piece: (0, 0),
            taken: 0.0,
            now: 0.0,
            open: 0.0,
            under_way: VecDeque::new(),
            at: DVec3::ZERO,
            seconds: vec![0.0; pieces],
        }
    }

    /// The next piece arrives; motion goes on meanwhile, and comes to rest if there is no more of it.
    pub(crate) fn piece(&mut self, index: usize, bytes: usize) {
        let Pace { byte_s, window, pieces, with_each, .. } = self.pace;
        self.line.out.push_back((self.piece.1, self.taken));
        self.line.bytes += self.piece.1;
        let bytes = bytes + with_each;
        let mut start = self.line.free;
        while (self.line.bytes.saturating_add(bytes) > window || self.line.out.len() >= pieces)
            && let Some((others, taken)) = self.line.out.pop_front()
        {
            self.line.bytes -= others;
            start = start.max(taken + ANSWER * byte_s);
        }
        self.line.free = start + bytes as f64 * byte_s;
        self.piece = (index, bytes);
        self.taken = self.line.free;
        while self.now < self.taken + LEAD_S && self.advance() {}
        if self.now < self.taken && self.under_way.is_empty() {
            self.spend(self.taken - self.now);
        }
    }

    /// A straight move by so many mm, at a feed in mm/min along it or as fast as the axes allow.
    pub(crate) fn go(&mut self, way: DVec3, feed: Option<f64>) {
        let target = self.at + way;
        let farthest = target.abs().max_element();
        if farthest.is_nan() || farthest > FARTHEST_MM {
            // Farther than any paper; whatever it takes is no estimate of a plot.
            return self.rest();
        }
        let was_full = self.plan.is_full();
        while self.plan.is_full() && self.advance() {}
        if was_full {
            self.taken = self.taken.max(self.now - LEAD_S);
        }
        self.at = target;
        if self.plan.append(target.to_array(), feed) {
            self.under_way.push_back((self.piece.0, way.length()));
        }
        if self.pace.lookahead <= 1 {
            self.rest();
        }
    }

    /// A straight move by so many mm, along which the axis that moves farthest has this feed in mm/min.
    pub(crate) fn go_by_axis(&mut self, way: DVec3, feed: f64) {
        self.go(way, Some(feed * straight::over_longest_axis(way)));
    }

    /// All motion ends, and the piece is taken after that.
    pub(crate) fn rest(&mut self) {
        while self.advance() {}
        self.now = self.now.max(self.taken);
        self.taken = self.now;
    }

    /// At rest for so many seconds.
    pub(crate) fn dwell(&mut self, seconds: f64) {
        self.rest();
        self.spend(seconds);
        self.taken = self.now;
    }

    /// At the end of a stroke, at rest: what follows is sent when the plotter has said how it stands, or at once if nothing waits for that.
    pub(crate) fn ask(&mut self) {
        let [to, from] = self.pace.question;
        if from > 0 {
            self.line.free = self.line.free.max(self.now);
        }
        self.line.free += (to + from) as f64 * self.pace.byte_s;
    }

    /// Time in s of each piece.
    pub(crate) fn finish(mut self) -> Vec<f64> {
        while self.advance() {}
        self.seconds
    }

    /// Nothing moves for so long, and the piece is the reason.
    fn spend(&mut self, seconds: f64) {
        self.now += seconds;
        if let Some(own) = self.seconds.get_mut(self.piece.0) {
            *own += seconds;
        }
    }

    /// Goes on by a segment; false if there is none.
    fn advance(&mut self) -> bool {
        let Some(slice) = self.plan.advance() else { return false };
        self.now += slice.seconds;
        self.open += slice.seconds;
        if slice.lines > 0 {
            // Lines that end together have shared the time by their lengths.
            let count = usize::from(slice.lines).min(self.under_way.len());
            let length: f64 = self.under_way.iter().take(count).map(|line| line.1).sum();
            for (piece, own) in self.under_way.drain(..count) {
                if let Some(seconds) = self.seconds.get_mut(piece) {
                    *seconds += self.open * if length > 0.0 { own / length } else { 1.0 / count as f64 };
                }
            }
            self.open = 0.0;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mechanics() -> Mechanics {
        Mechanics { max_rate: [60_000.0; AXES], acceleration: [100.0; AXES], junction_deviation: 0.01 }
    }

    fn total(pace: &Pace, moves: &[(f64, DVec3)]) -> (f64, Vec<f64>) {
        let mut timer = Timer::new(pace, moves.len());
        for (index, (length, direction)) in moves.iter().enumerate() {
            timer.piece(index, 20);
            timer.go(*direction * *length, Some(600.0));
        }
        let seconds = timer.finish();
        (seconds.iter().sum(), seconds)
    }

    #[test]
    fn a_straight_line_in_pieces_takes_the_same_time() {
        for count in [1, 2, 7, 100] {
            let moves = vec![(11.0 / f64::from(count), DVec3::Y); count as usize];
            // 10 mm/s at 100 mm/s²: 0.1 s up, 0.1 s down, 0.5 mm each.
            let (time, each) = total(&Pace::of_motion(mechanics(), 64), &moves);
            assert!((time - 1.2).abs() < 1e-4, "{count}: {time}");
            assert!(each.iter().all(|seconds| *seconds > 0.0), "{each:?}");
        }
    }

    #[test]
    fn without_a_window_each_move_comes_to_rest() {
        let moves = vec![(11.0, DVec3::X); 3];
        assert!((total(&Pace::of_motion(mechanics(), 1), &moves).0 - 3.6).abs() < 1e-4);
        let back = [(11.0, DVec3::X), (11.0, -DVec3::X)];
        assert!((total(&Pace::of_motion(mechanics(), 64), &back).0 - 2.4).abs() < 1e-4);
    }

    #[test]
    fn a_slow_line_is_what_takes_the_time() {
        // 20 bytes in 0.2 s for a move of 0.1 mm, which takes a hundredth.
        let pace = Pace { byte_s: 0.01, window: 128, ..Pace::of_motion(mechanics(), 64) };
        let moves = vec![(0.1, DVec3::X); 50];
        let time = total(&pace, &moves).0;
        assert!((time - 50.0 * 0.2).abs() < 0.2, "{time}");
        // One that has to be answered before the next is sent takes the answer's time too.
        let alone = total(&Pace { pieces: 1, ..pace }, &moves).0;
        assert!((alone - 50.0 * 0.24).abs() < 0.2, "{alone}");
    }

    #[test]
    fn what_is_too_far_or_nothing_takes_no_time() {
        assert!(Timer::new(&Pace::of_motion(mechanics(), 64), 0).finish().is_empty());
        let moves = [(1e12, DVec3::X), (f64::NAN, DVec3::X), (1.0, DVec3::X)];
        let time = total(&Pace::of_motion(mechanics(), 64), &moves).0;
        assert!(time > 0.1 && time < 1.0, "{time}");
    }
}
