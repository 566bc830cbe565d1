//! The plotter's replies: which question each of them answers.
//!
//! ```text
//!  asked          when it is answered              reply
//!  ESC.B, .L, .O  at once                          a number
//!  OE;OA;         when all before it is carried out  a number, and a place right behind it
//! ```
//!
//! Two questions may thus be open, and nothing but the numbers tells whose a reply is. A buffer is never so full that the answer
//! to `ESC.B` could be an error's number, 0 to 8 (see [`super::flow::FREE_MIN`]). But digits are lost on the line: an error stops the job
//! when the other question is answered too, and until then nothing more counts as executed; if that has no answer, it was its
//! own. Where a 0 may be an answer to `ESC.O` too, what comes next decides.

use std::time::Duration;

use super::answers::Verdict;
use super::flow::Free;
use super::{ANSWER_WAIT, ASK_MAX, Event, Fault, Hpgl, Phase, codes};

/// Time after a 0 in which the place must begin to come, if it was the answer to `OE;`.
const PLACE_WAIT: Duration = Duration::from_millis(200);
/// Most bytes of a place.
const PLACE_BYTES: usize = 20;

/// A question that is answered at once, or when the buffer is empty.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Question {
    Space,
    Size,
    Status,
    LineError,
    InstructionError,
    Identity,
}

impl Question {
    fn bytes(self) -> &'static [u8] {
        match self {
            Self::Space => b"\x1b.B",
            Self::Size => b"\x1b.L",
            Self::Status => b"\x1b.O",
            Self::LineError => b"\x1b.E",
            Self::InstructionError => b"OE;",
            Self::Identity => b"OI;",
        }
    }

    /// Whether a number may be the answer. `buffer` is the size of the buffer.
    fn allows(self, number: usize, buffer: usize) -> bool {
        match self {
            Self::Space => number <= buffer,
            Self::Size => (1..=1 << 24).contains(&number),
            Self::Status | Self::InstructionError => number < 256,
            Self::LineError => number == 0 || (10..20).contains(&number),
            Self::Identity => false,
        }
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Asked {
    question: Question,
    since: Duration,
    /// Times that it was put.
    times: u32,
    /// Bytes and instructions that were sent before it was first put.
    sent: u64,
    pieces: usize,
    /// When a 0 came that may be its answer, or that to `OE;`.
    zero: Option<Duration>,
}

impl Hpgl {
    pub(super) fn ask(&mut self, question: Question, now: Duration) {
        let (sent, pieces) = (self.flow.sent(), self.last.pieces);
        self.put_question(Asked { question, since: now, times: 1, sent, pieces, zero: None });
    }

    /// Puts a question again. The answer may still be the one to the first time.
    fn ask_again(&mut self, asked: Asked, now: Duration) {
        self.put_question(Asked { since: now, times: asked.times + 1, zero: None, ..asked });
    }

    fn put_question(&mut self, asked: Asked) {
        self.outbox.write(asked.question.bytes());
        self.asked = Some(asked);
    }

    /// Lets time pass. The question that was put often enough and is given up, if it is overdue; one that was not is put again.
    pub(super) fn is_overdue(&mut self, now: Duration) -> Option<Question> {
        let asked = self.asked?;
        if let Some(since) = asked.zero {
            if now.saturating_sub(since) > PLACE_WAIT + self.flow.time_of(PLACE_BYTES) {
                self.answered_with(asked, 0, now);
            }
            return None;
        }
        if now.saturating_sub(asked.since) <= ANSWER_WAIT + self.flow.backlog(now) {
            return None;
        }
        // It was the answer to this one, and the line has changed it.
        if self.doubt.take().is_some() {
            self.executed = self.executed.max(self.answers.reached());
        }
        // Not all know `OI;`.
        if asked.times < ASK_MAX && asked.question != Question::Identity {
            self.ask_again(asked, now);
            return None;
        }
        self.asked = None;
        self.answered = now;
        Some(asked.question)
    }

    /// Takes one reply.
    pub(super) fn reply(&mut self, reply: &str, now: Duration) {
        if self.phase == Phase::Over {
            return;
        }
        let number = reply.parse::<usize>().ok().filter(|_| reply.bytes().all(|byte| byte.is_ascii_digit()));
        self.settle_zero(number, now);
        if let Some((at, down)) = position(reply) {
            let verdict = self.answers.take(at, down);
            return self.judge(verdict, now);
        }
        if number == Some(0)
            && self.answers.expects_error()
            && let Some(asked) = self.asked.as_mut().filter(|asked| asked.question == Question::Status)
        {
            asked.zero = Some(now);
            return;
        }
        if let Some(verdict) = number.and_then(|number| self.error_told(number)) {
            if self.asked.is_some() && matches!(verdict, Verdict::Refused { .. }) {
                self.doubt = Some(verdict);
                return;
            }
            return self.judge(verdict, now);
        }
        match (self.asked, number) {
            (Some(asked), Some(number)) if asked.question.allows(number, self.size_limit()) => {
                if let Some(verdict) = self.doubt.take() {
                    return self.judge(verdict, now);
                }
                self.answered_with(asked, number, now);
            }
            (Some(asked), None) if asked.question == Question::Identity => {
                self.asked = None;
                self.identity(reply);
                self.probe_answered(now);
            }
            (asked, _) => {
                let verdict = self.answers.take_mangled();
                self.judge(verdict, now);
                if let Some(asked) = asked.filter(|asked| self.asked.is_some() && asked.times < ASK_MAX) {
                    self.ask_again(asked, now);
                }
            }
        }
    }

    /// The reply behind a 0 (its number, if it is one) tells whose answer that was.
    fn settle_zero(&mut self, number: Option<usize>, now: Duration) {
        let Some(asked) = self.asked.filter(|asked| asked.zero.is_some()) else { return };
        match number {
            // The other one is there too, or is an error.
            Some(number) if number == 0 || codes::is_error(number) => self.answered_with(asked, 0, now),
            // A place, or what may be a mangled one; or the answer to the other question.
            _ => {
                self.asked = Some(Asked { zero: None, ..asked });
                self.answers.take_error(0);
            }
        }
    }

    /// What a number means as the answer to `OE;`; none if it answers another question.
    fn error_told(&mut self, number: usize) -> Option<Verdict> {
        let is_status = number == codes::STATUS_EMPTY as usize
            && self.asked.is_some_and(|asked| asked.question == Question::Status);
        let is_known = number == 0 || codes::is_error(number) && !is_status;
        if is_known { self.answers.take_error(number as u32) } else { None }
    }

    fn answered_with(&mut self, asked: Asked, number: usize, now: Duration) {
        self.asked = None;
        self.answered = now;
        self.told_number(asked, number, now);
    }

    /// Most free bytes that the plotter can have.
    fn size_limit(&self) -> usize {
        if matches!(self.phase, Phase::Probing(_)) { 1 << 24 } else { self.flow.buffer }
    }

    /// A question was answered with a number.
    fn told_number(&mut self, asked: Asked, number: usize, now: Duration) {
        match (self.phase, asked.question) {
            (Phase::Probing(_), question) => self.probe_told(question, number, now),
            (_, Question::Space) => {
                self.received = self.received.max(asked.pieces);
                match self.flow.free(number, asked.sent) {
                    Free::More => {
                        self.goes_on(now);
                        self.waits = 0;
                    }
                    Free::Unconfirmed => self.waits = 0,
                    Free::Same => self.waits += 1,
                }
            }
            (_, Question::Status) => self.status(number as u32, now),
            (_, Question::LineError) if number == 0 || number == codes::OUTPUT_OVERLAPS as usize => self.finish(),
            (_, Question::LineError) => {
                let meaning = codes::line_error(number as u32);
                self.fail(Fault::Reported { what: format!("line error {number}, {meaning}") });
            }
            (_, Question::Size | Question::Identity | Question::InstructionError) => {}
        }
    }

    fn status(&mut self, bits: u32, now: Duration) {
        for (bit, message) in codes::HALTS {
            if bits & bit != 0 && self.told & bit == 0 {
                self.outbox.tell(Event::Message(message.to_owned()));
            }
        }
        self.told = bits;
        // A plotter that its user has halted may rest for as long as it likes.
        if codes::HALTS.iter().any(|(bit, _)| bits & bit != 0) {
            self.goes_on(now);
        }
        if bits & codes::STATUS_EMPTY != 0 && !self.answers.is_waiting() {
            self.flow.consume(self.flow.sent());
        }
    }
}

/// Where the pen is and whether it is down, as `OA;` answers it.
fn position(reply: &str) -> Option<([i64; 2], bool)> {
    let mut parts = reply.split(',').map(str::trim);
    let (x, y, pen) = (parts.next()?, parts.next()?, parts.next()?);
    let number = |text: &str| {
        let digits = text.strip_prefix('-').unwrap_or(text);
        let is_number = (1..=7).contains(&digits.len()) && digits.bytes().all(|byte| byte.is_ascii_digit());
        text.parse::<i64>().ok().filter(|_| is_number)
    };
    let down = match pen {
        "0" => false,
        "1" => true,
        _ => return None,
    };
    parts.next().is_none().then_some(([number(x)?, number(y)?], down))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_are_told_from_other_replies() {
        let table = [
            ("1,2,0", Some(([1, 2], false))),
            ("-15, 30000,1", Some(([-15, 30_000], true))),
            ("1,2", None),
            ("1,2,2", None),
            ("1,2,0,1", None),
            ("1,,0", None),
            ("1.5,2,0", None),
            ("+1,2,0", None),
            ("12345678,2,0", None),
            ("", None),
        ];
        for (reply, expected) in table {
            assert_eq!(position(reply), expected, "{reply}");
        }
    }
}
