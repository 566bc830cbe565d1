//! Where the controller and what draws scenes meet: an order one way, lines of G-code and an answer the other.
//!
//! ```text
//!  controller                     desk                    studio, in the background
//!  $PV=… line ───────────────▶ order ──── take_order ───▶ obeys it
//!  interprets it as its own ◀─── line ◀─── offer_line ──── each line of the drawing
//!  ok or error:n ◀───────────── answer ◀── finish ──────── done
//!  reset ────────────────────▶ is_abandoned ─────────────▶ stops
//! ```
//!
//! It is plain memory without a lock: where the two sides are in different contexts, the board moves what is on it from one to the other
//! in short critical sections.

use heapless::{String, Vec};

use super::draw::Line;
use crate::error::Error;

/// Bytes of a scene that one line carries, as twice as many hexadecimal digits.
pub const CHUNK_BYTES: usize = 36;

/// Characters of an answer's text.
pub const ANSWER_CHARS: usize = 200;

/// What a `$PV` line asks for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Order {
    /// `$PV=CLEAR`: forget the scene that was sent.
    Clear,
    /// `$PV=` and hexadecimal digits: the next bytes of a scene.
    Append(Vec<u8, CHUNK_BYTES>),
    /// `$PV`: tell how much there is of a scene, and room for.
    Tell,
    /// `$PV=TRACE`: compute the strokes without drawing them, and tell the figures.
    Trace,
    /// `$PV=DRAW`: draw the scene.
    Draw,
}

/// The answer to an order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Answer {
    /// Said before `ok` or `error:n`; nothing if empty.
    pub text: String<ANSWER_CHARS>,
    /// `ok`, or which error.
    pub result: Result<(), Error>,
}

/// What became of an offered line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Offer {
    /// It will be obeyed.
    Taken,
    /// The line before it still lies there: offer it again.
    Full,
    /// The drawing is not wanted any more.
    Abandoned,
}

/// The desk.
#[derive(Clone, Debug, Default)]
pub struct Desk {
    order: Option<Order>,
    line: Option<Line>,
    answer: Option<Answer>,
    /// The `$PV` line has not been answered yet.
    waiting: bool,
    /// An order is with the studio, or on its way there.
    working: bool,
    /// What the studio works at is not wanted any more.
    abandoned: bool,
    /// Why, if a line of the drawing was refused.
    fault: Option<Error>,
}

impl Desk {
    /// For the studio: what it is to do.
    pub fn take_order(&mut self) -> Option<Order> {
        self.order.take()
    }

    /// For the studio: the next line of a drawing.
    pub fn offer_line(&mut self, line: &Line) -> Offer {
        if self.abandoned {
            return Offer::Abandoned;
        }
        if self.line.is_some() {
            return Offer::Full;
        }
        self.line = Some(line.clone());
        Offer::Taken
    }

    /// For the studio: whether what it works at is not wanted any more.
    #[must_use]
    pub fn is_abandoned(&self) -> bool {
        self.abandoned
    }

    /// For the studio: it is done with the order.
    pub fn finish(&mut self, answer: Answer) {
        self.answer = Some(answer);
        self.working = false;
        self.abandoned = false;
    }

    /// What follows `$PV` on a line.
    ///
    /// # Errors
    /// [`Error::InvalidStatement`], or [`Error::NotIdle`] while the studio has not noticed yet that a drawing was abandoned.
    pub(crate) fn order(&mut self, text: &[u8]) -> Result<(), Error> {
        let order = match text {
            b"" => Order::Tell,
            b"=CLEAR" => Order::Clear,
            b"=TRACE" => Order::Trace,
            b"=DRAW" => Order::Draw,
            [b'=', digits @ ..] => Order::Append(bytes(digits).ok_or(Error::InvalidStatement)?),
            _ => return Err(Error::InvalidStatement),
        };
        if self.working {
            return Err(Error::NotIdle);
        }
        *self = Self { order: Some(order), waiting: true, working: true, ..Self::default() };
        Ok(())
    }

    /// Whether the `$PV` line has not been answered yet: what follows it has to wait.
    #[must_use]
    pub fn is_waiting(&self) -> bool {
        self.waiting
    }

    /// For the controller: the next line of the drawing.
    pub(crate) fn take_line(&mut self) -> Option<Line> {
        self.line.take()
    }

    /// For the controller: the answer, once all lines have been taken.
    pub(crate) fn take_answer(&mut self) -> Option<Answer> {
        if self.line.is_some() {
            return None;
        }
        let mut answer = self.answer.take()?;
        if let Some(fault) = self.fault.take() {
            answer.result = Err(fault);
        }
        self.waiting = false;
        Some(answer)
    }

    /// For the controller: a line of the drawing was refused, so that the rest is of no use. The `$PV` line is answered with the fault.
    pub(crate) fn refuse(&mut self, fault: Error) {
        self.line = None;
        self.abandoned = self.working;
        if self.waiting {
            self.fault.get_or_insert(fault);
        }
    }

    /// For the controller: a reset. Nothing is answered.
    pub(crate) fn abandon(&mut self) {
        let working = self.working && self.order.is_none();
        *self = Self { working, abandoned: working, ..Self::default() };
    }
}

/// The bytes of hexadecimal digits; `None` if they are none, or too many, or an odd number.
fn bytes(digits: &[u8]) -> Option<Vec<u8, CHUNK_BYTES>> {
    let mut out = Vec::new();
    for pair in digits.chunks(2) {
        let [high, low] = pair else { return None };
        let value = |digit: &u8| char::from(*digit).to_digit(16);
        // Two digits are a byte.
        out.push((value(high)? << 4 | value(low)?) as u8).ok()?;
    }
    (!out.is_empty()).then_some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn done(result: Result<(), Error>) -> Answer {
        Answer { text: String::new(), result }
    }

    #[test]
    fn orders() {
        let order = |text: &str| {
            let mut desk = Desk::default();
            desk.order(text.as_bytes()).map(|()| desk.take_order())
        };
        assert_eq!(order(""), Ok(Some(Order::Tell)));
        assert_eq!(order("=DRAW"), Ok(Some(Order::Draw)));
        assert_eq!(order("=50565343"), Ok(Some(Order::Append(Vec::from_slice(b"PVSC").unwrap()))));
        assert!(order(&alloc::format!("={}", "0".repeat(72))).is_ok());
        for wrong in ["=", "=5", "=5G", "=DRAWN", "X", &alloc::format!("={}", "0".repeat(74))] {
            assert_eq!(order(wrong), Err(Error::InvalidStatement), "{wrong}");
        }
    }

    #[test]
    fn a_drawing_goes_over_the_desk_line_by_line() {
        let mut desk = Desk::default();
        desk.order(b"=DRAW").unwrap();
        assert!(desk.is_waiting() && desk.take_answer().is_none());
        assert_eq!(desk.take_order(), Some(Order::Draw));
        let line = |text: &str| Line::try_from(text).unwrap();
        assert_eq!(desk.offer_line(&line("G1 X1")), Offer::Taken);
        assert_eq!(desk.offer_line(&line("G1 X2")), Offer::Full);
        assert_eq!(desk.take_line(), Some(line("G1 X1")));
        assert_eq!(desk.offer_line(&line("G1 X2")), Offer::Taken);
        desk.finish(done(Ok(())));
        // The last line first.
        assert_eq!(desk.take_answer(), None);
        assert_eq!(desk.take_line(), Some(line("G1 X2")));
        assert_eq!(desk.take_answer(), Some(done(Ok(()))));
        assert!(!desk.is_waiting());
    }

    #[test]
    fn a_refused_line_ends_the_drawing_with_its_error() {
        let mut desk = Desk::default();
        desk.order(b"=DRAW").unwrap();
        desk.take_order();
        desk.refuse(Error::UnsupportedCommand);
        assert_eq!(desk.offer_line(&Line::new()), Offer::Abandoned);
        desk.finish(done(Ok(())));
        assert_eq!(desk.take_answer(), Some(done(Err(Error::UnsupportedCommand))));
        assert_eq!(desk.order(b"=DRAW"), Ok(()));
    }

    #[test]
    fn a_reset_ends_the_drawing_without_an_answer() {
        let mut desk = Desk::default();
        desk.order(b"=DRAW").unwrap();
        desk.take_order();
        desk.abandon();
        assert!(!desk.is_waiting() && desk.is_abandoned());
        assert_eq!(desk.order(b"=DRAW"), Err(Error::NotIdle));
        desk.finish(done(Ok(())));
        assert_eq!(desk.order(b"=DRAW"), Ok(()));
        assert!(!desk.is_abandoned() && desk.take_answer().is_none());
        // Before the studio has even seen it.
        desk.abandon();
        assert!(!desk.is_abandoned() && desk.take_order().is_none());
    }
}
