//! Ink that is drawn, in square cells of the page and by its direction, so that what only crosses is not looked at.

use std::collections::HashMap;
use std::f64::consts::PI;

use glam::DVec2;

/// Directions of lines that are told apart.
const DIRECTIONS: i64 = 64;

/// In place of a direction: that of pieces so short that none is meant.
const ANY: i64 = -1;

/// Length, in distances that count as near, from which pieces have a direction.
const DIRECTED: f64 = 50.0;

/// Length, in such distances, from which segments are compared with the fewest directions.
const STRAIGHT: f64 = 200.0;

/// A straight piece of ink.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// Number of its stroke.
    pub(super) stroke: u32,
    /// Length in mm of the stroke before it.
    pub(super) from: f64,
    /// Its ends.
    pub(super) ends: [DVec2; 2],
}

impl Piece {
    pub(super) fn length(&self) -> f64 {
        self.ends[0].distance(self.ends[1])
    }
}

/// Pieces of ink of pens, and which of them are near.
pub(super) struct Kept {
    /// What counts as near, in mm.
    within: f64,
    /// Side of a cell in mm.
    side: f64,
    pieces: Vec<Piece>,
    /// The last question for which a piece was looked at.
    seen: Vec<u32>,
    question: u32,
    /// Pieces by pen, direction and cell, in all cells that come within `within` of them.
    cells: HashMap<(u32, i64, [i64; 2]), Vec<u32>>,
    /// Pieces that were looked at, all questions together.
    pub(super) looks: u64,
}

impl Kept {
    /// None yet, of so many pieces that have this length in mm together. Cells are as wide as pieces are long on the average, so that there are no more
    /// than a few for each.
    pub(super) fn new(within: f64, pieces: usize, length: f64) -> Self {
        let side = (length / pieces.max(1) as f64).max(4.0 * within);
        Self { within, side, pieces: Vec::new(), seen: Vec::new(), question: 0, cells: HashMap::new(), looks: 0 }
    }

    /// Adds a piece of a pen's ink.
    pub(super) fn add(&mut self, pen: u32, piece: Piece) {
        let number = self.pieces.len() as u32;
        let direction = if piece.length() < DIRECTED * self.within { ANY } else { direction(piece.ends) };
        for cell in cells(piece.ends, self.side, self.within) {
            let list = self.cells.entry((pen, direction, cell)).or_default();
            if list.last() != Some(&number) {
                list.push(number);
            }
        }
        self.pieces.push(piece);
        self.seen.push(0);
    }

    /// Calls `found` with pieces of a pen, among them all that come within reach of a segment and run along it.
    ///
    /// Chords of one curve whose sagittas are s or less, the longer one of length l, turn from one another by no more than 8 s / l. What turns by more than
    /// that, with s the distance that counts as near, and by more than the width of a direction, is near to the segment for less than its length.
    pub(super) fn near(&mut self, pen: u32, ends: [DVec2; 2], mut found: impl FnMut(&Piece)) {
        self.question = self.question.wrapping_add(1);
        let length = ends[0].distance(ends[1]) / self.within;
        let turn = (8.0 / length.min(STRAIGHT)).min(1.0).asin() / PI * DIRECTIONS as f64;
        let (middle, turn) = (direction(ends), (turn.ceil() as i64).min(DIRECTIONS / 2));
        let directions = (middle - turn..=middle + turn).take(DIRECTIONS as usize).map(|d| d.rem_euclid(DIRECTIONS));
        let directions = directions.chain([ANY]);
        for key in cells(ends, self.side, 0.0).flat_map(|cell| directions.clone().map(move |d| (pen, d, cell))) {
            for &number in self.cells.get(&key).into_iter().flatten() {
                let seen = &mut self.seen[number as usize];
                if *seen != self.question {
                    *seen = self.question;
                    self.looks += 1;
                    found(&self.pieces[number as usize]);
                }
            }
        }
    }
}

/// The direction of a line, either way, in parts of half a turn.
fn direction([a, b]: [DVec2; 2]) -> i64 {
    let share = (b - a).to_angle() / PI;
    ((share * DIRECTIONS as f64).round() as i64).rem_euclid(DIRECTIONS)
}

/// Cells that a segment and what is within `reach` of it touch, those that it passes one after the other; some twice.
fn cells([a, b]: [DVec2; 2], side: f64, reach: f64) -> impl Iterator<Item = [i64; 2]> {
    let count = (a.distance(b) / side).ceil().max(1.0) as u32;
    let at = move |k: u32| if k == count { b } else { a.lerp(b, f64::from(k) / f64::from(count)) };
    (0..count).flat_map(move |k| {
        let (p, q) = (at(k), at(k + 1));
        let (low, high) = ((p.min(q) - reach) / side, (p.max(q) + reach) / side);
        let (x, y) = (low.x.floor() as i64..=high.x.floor() as i64, low.y.floor() as i64..=high.y.floor() as i64);
        x.flat_map(move |i| y.clone().map(move |j| [i, j]))
    })
}
