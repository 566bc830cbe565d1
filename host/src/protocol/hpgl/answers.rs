//! Questions where the plotter is and whether it has refused anything, and whether its answers are what they must be.
//!
//! `OE;` goes before `OA;`, so that an error is known before the place behind it counts as reached. Answers come in the order of
//! the questions. One may be mangled or missing because the line mangled it, or the question; the
//! position is the sum of all moves, so that the next answer still tells of the stroke whose own was lost. An answer that
//! reads well and is wrong may be mangled too: the next one decides, and nothing is sent before it has come.

use std::collections::VecDeque;

use super::words::{Ask, Expected};

/// Answers of a whole job that may be unreadable or missing; a line that mangles more mangles instructions too.
const MANGLED_MAX: u32 = 20;

/// A question that is to be answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Question {
    expected: Expected,
    /// Bytes that were sent up to its end.
    sent: u64,
    /// Whether it only repeats the one before it, with nothing between.
    again: bool,
    /// Whether it begins with `OE;`.
    checks: bool,
}

/// What an answer means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// So many instructions are carried out, as many bytes are out of the buffer, and the plotter is where it must be.
    Right { pieces: usize, sent: u64 },
    /// Nothing yet.
    Open,
    /// The question must be put again before anything else is sent.
    AskAgain,
    /// The plotter is elsewhere, after instructions from the first (an index) up to, not including, the last.
    Astray { first: usize, last: usize, expected: Expected, at: [i64; 2], down: bool },
    /// The plotter has refused one of the instructions from the first (an index) up to, not including, the last.
    Refused { first: usize, last: usize, error: u32 },
    /// Too much cannot be read.
    Noise,
}

/// The questions that are to be answered.
#[derive(Debug, Default)]
pub(super) struct Answers {
    queue: VecDeque<Question>,
    /// What the last right answer told.
    right: Expected,
    /// Right answers that may come once more.
    strays: u32,
    /// Whether the first question's `OE;` was answered.
    heard: bool,
    /// A question with a wrong answer that the next answer confirms or not.
    suspect: Option<(Question, [i64; 2], bool)>,
    mangled: u32,
}

impl Answers {
    /// A question was sent, and with it so many bytes in all.
    pub(super) fn asked(&mut self, ask: Ask, expected: Expected, sent: u64) {
        let again = self.queue.back().is_some_and(|last| last.sent + ask.bytes().len() as u64 == sent);
        self.queue.push_back(Question { expected, sent, again, checks: ask == Ask::Check });
    }

    /// Whether an answer to `OE;` comes before the next place.
    pub(super) fn expects_error(&self) -> bool {
        self.queue.front().is_some_and(|front| front.checks && !self.heard)
    }

    /// Takes a number that may be the answer to `OE;`; none if it cannot be.
    pub(super) fn take_error(&mut self, number: u32) -> Option<Verdict> {
        let expected = self.expects_error();
        self.heard |= expected;
        if number == 0 {
            return expected.then_some(Verdict::Open);
        }
        let last = self.queue.front()?.expected.pieces;
        Some(Verdict::Refused { first: self.right.pieces, last, error: number })
    }

    /// Whether questions are to be answered.
    pub(super) fn is_waiting(&self) -> bool {
        !self.queue.is_empty()
    }

    /// Instructions that are carried out.
    pub(super) fn reached(&self) -> usize {
        self.right.pieces
    }

    /// Whether nothing more may be sent before an answer has come.
    pub(super) fn is_frozen(&self) -> bool {
        self.suspect.is_some()
    }

    /// Takes an answer that reads well.
    pub(super) fn take(&mut self, at: [i64; 2], down: bool) -> Verdict {
        let Some(&front) = self.queue.front() else {
            return self.stray(at, down);
        };
        if front.expected.fits(at, down) {
            return self.pass(1);
        }
        if self.strays > 0 && self.right.fits(at, down) {
            return self.stray(at, down);
        }
        if let Some((question, at, down)) = self.suspect {
            return Verdict::Astray {
                first: self.right.pieces,
                last: question.expected.pieces,
                expected: question.expected,
                at,
                down,
            };
        }
        // The answer before this one was lost on the way, or its question.
        let elsewhere = front.expected.at.is_some_and(|expected| expected != at);
        if elsewhere && self.queue.get(1).is_some_and(|next| next.expected.fits(at, down)) {
            self.mangled += 1;
            return self.pass(2);
        }
        self.queue.pop_front();
        self.heard = false;
        self.suspect = Some((front, at, down));
        if self.queue.is_empty() {
            // Nothing has happened since: the same must be answered again.
            self.queue.push_back(Question { again: false, checks: false, ..front });
            return Verdict::AskAgain;
        }
        if !elsewhere {
            // A pen that was up or down at the wrong time does not tell later.
            return Verdict::Astray {
                first: self.right.pieces,
                last: front.expected.pieces,
                expected: front.expected,
                at,
                down,
            };
        }
        Verdict::Open
    }

    /// The first questions are answered.
    fn pass(&mut self, count: usize) -> Verdict {
        let mut last = None;
        for _ in 0..count {
            last = self.queue.pop_front();
        }
        let Some(last) = last else { return Verdict::Open };
        self.heard = false;
        if self.suspect.take().is_some() {
            self.mangled += 1;
        }
        self.right = last.expected;
        if self.queue.iter().all(|question| question.again) {
            self.strays += self.queue.len() as u32;
            self.queue.clear();
        }
        if self.mangled > MANGLED_MAX {
            Verdict::Noise
        } else {
            Verdict::Right { pieces: last.expected.pieces, sent: last.sent }
        }
    }

    fn stray(&mut self, at: [i64; 2], down: bool) -> Verdict {
        if self.strays > 0 && self.right.fits(at, down) {
            self.strays -= 1;
            return Verdict::Open;
        }
        self.take_mangled()
    }

    /// Takes an answer that cannot be read, or that nobody asked for.
    pub(super) fn take_mangled(&mut self) -> Verdict {
        self.mangled += 1;
        if self.mangled > MANGLED_MAX { Verdict::Noise } else { Verdict::Open }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Questions at these places with the pen up or down, in a row.
    fn answers(places: &[([i64; 2], bool)]) -> Answers {
        let mut answers = Answers::default();
        for (index, (at, down)) in places.iter().enumerate() {
            let expected = Expected { pieces: index + 1, at: Some(*at), down: Some(*down) };
            answers.asked(Ask::Check, expected, 10 * (index as u64 + 1));
        }
        answers
    }

    const PLACES: [([i64; 2], bool); 3] = [([0, 0], false), ([9, 0], true), ([5, 5], false)];

    fn right(pieces: usize) -> Verdict {
        Verdict::Right { pieces, sent: 10 * pieces as u64 }
    }

    #[test]
    fn answers_in_order_are_right() {
        let mut a = answers(&PLACES);
        for (index, (at, down)) in PLACES.into_iter().enumerate() {
            assert_eq!(a.take(at, down), right(index + 1));
        }
        assert!(!a.is_waiting());
    }

    #[test]
    fn a_lost_or_mangled_answer_is_made_good_by_the_next() {
        let mut a = answers(&PLACES);
        assert_eq!(a.take([9, 0], true), right(2));
        let mut a = answers(&PLACES);
        assert_eq!(a.take_mangled(), Verdict::Open);
        assert_eq!(a.take([9, 0], true), right(2));
        // It reads well and is wrong; the next is right.
        let mut a = answers(&PLACES);
        assert_eq!(a.take([0, 3], false), Verdict::Open);
        assert!(a.is_frozen());
        assert_eq!(a.take([9, 0], true), right(2));
        assert!(!a.is_frozen());
    }

    #[test]
    fn a_plotter_that_is_elsewhere_stays_there() {
        let mut a = answers(&PLACES);
        assert_eq!(a.take([0, 0], false), right(1));
        assert_eq!(a.take([8, 0], true), Verdict::Open);
        assert!(matches!(a.take([4, 5], false), Verdict::Astray { first: 1, last: 2, at: [8, 0], down: true, .. }));
        // The last answer is asked for again.
        let mut a = answers(&PLACES[..1]);
        assert_eq!(a.take([1, 0], false), Verdict::AskAgain);
        assert!(matches!(a.take([1, 0], false), Verdict::Astray { first: 0, last: 1, .. }));
        let mut a = answers(&PLACES[..1]);
        assert_eq!(a.take([1, 0], false), Verdict::AskAgain);
        assert_eq!(a.take([0, 0], false), right(1));
    }

    #[test]
    fn a_pen_that_was_up_at_the_wrong_time_is_told_at_once() {
        let mut a = answers(&PLACES);
        assert_eq!(a.take([0, 0], false), right(1));
        assert!(matches!(a.take([9, 0], false), Verdict::Astray { first: 1, last: 2, down: false, .. }));
    }

    #[test]
    fn answers_to_repeated_questions_may_come_late() {
        let mut a = answers(&PLACES[..1]);
        let expected = Expected { pieces: 1, at: Some([0, 0]), down: Some(false) };
        a.asked(Ask::Place, expected, 13);
        a.asked(Ask::Place, expected, 16);
        assert_eq!(a.take([0, 0], false), right(1));
        assert!(!a.is_waiting());
        assert_eq!(a.take([0, 0], false), Verdict::Open);
        a.asked(Ask::Check, Expected { pieces: 2, at: Some([4, 4]), down: Some(true) }, 30);
        assert_eq!(a.take([0, 0], false), Verdict::Open);
        assert_eq!(a.take([4, 4], true), Verdict::Right { pieces: 2, sent: 30 });
    }

    #[test]
    fn an_error_is_told_before_the_place_behind_it() {
        let mut a = answers(&PLACES);
        assert_eq!(a.take_error(0), Some(Verdict::Open));
        assert_eq!(a.take([0, 0], false), right(1));
        assert_eq!(a.take_error(3), Some(Verdict::Refused { first: 1, last: 2, error: 3 }));
        // The answer for the first was lost; no more than one can come for the second.
        let mut a = answers(&PLACES);
        assert_eq!(a.take([0, 0], false), right(1));
        assert_eq!((a.take_error(0), a.take_error(0)), (Some(Verdict::Open), None));
        // An error is told all the same.
        assert_eq!(a.take_error(2), Some(Verdict::Refused { first: 1, last: 2, error: 2 }));
        let mut none = Answers::default();
        assert_eq!((none.take_error(0), none.take_error(1)), (None, None));
    }

    #[test]
    fn noise_is_bounded() {
        let mut a = answers(&PLACES);
        let verdicts: Vec<_> = (0..=MANGLED_MAX).map(|_| a.take_mangled()).collect();
        assert_eq!(verdicts.iter().filter(|verdict| **verdict == Verdict::Noise).count(), 1);
    }
}
