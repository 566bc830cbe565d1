//! Asks an HPGL plotter for its hard-clip limits (`OH;`), which depend on the paper that is loaded, and holds a job against them.

use std::time::Duration;

use super::{Finding, Severity, end, hpgl, whole};
use crate::protocol::hpgl::Job;
use crate::protocol::{Control, Event, Fault, Input, Outbox, Place, Progress, Protocol, Unit};

/// Time for the answer.
const ANSWER_WAIT: Duration = Duration::from_secs(2);
/// Times that the question is put: a plotter that boots does not hear the first one, and some do not know it.
const ASK_MAX: u32 = 2;
/// What a sender before us left half said is forgotten first: a number that was cut off must not be drawn.
const QUESTION: &[u8] = b"\x1b.R\x1b.KOH;";

/// A conversation that asks, and moves nothing. It ends in [`Event::Done`] whether it was answered or not.
#[derive(Debug, Default)]
pub struct Window {
    /// Least and greatest coordinates, in plotter units, if they were told.
    told: Option<[[i64; 2]; 2]>,
    times: u32,
    since: Duration,
    over: bool,
    input: Input,
    outbox: Outbox,
}

impl Window {
    /// What of a job is outside of what was told.
    #[must_use]
    pub fn findings(&self, job: &Job) -> Vec<Finding> {
        let (Some([least, greatest]), Some([low, high])) = (self.told, hpgl::reached(job)) else { return Vec::new() };
        if (0..2).all(|axis| least[axis] <= low[axis] && high[axis] <= greatest[axis]) {
            return Vec::new();
        }
        let what = format!(
            "it goes from ({}, {}) to ({}, {}), and the plotter tells that it draws from ({}, {}) to ({}, {}) only: is the right \
             paper loaded, and its switch set?",
            low[0], low[1], high[0], high[1], least[0], least[1], greatest[0], greatest[1]
        );
        vec![whole(Severity::Warning, what)]
    }

    fn end(&mut self, event: Event) {
        self.over = true;
        self.outbox.tell(event);
    }
}

/// `OH;` answers x and y of two corners.
fn corners(reply: &str) -> Option<[[i64; 2]; 2]> {
    let numbers: Vec<i64> = reply.split(',').map(|number| number.trim().parse().ok()).collect::<Option<_>>()?;
    let [x1, y1, x2, y2] = numbers[..] else { return None };
    (x1 < x2 && y1 < y2).then_some([[x1, y1], [x2, y2]])
}

impl Protocol for Window {
    fn receive(&mut self, bytes: &[u8], _now: Duration) {
        for &byte in bytes {
            match byte {
                _ if self.over => {}
                b'\r' | b'\n' => {
                    self.told = corners(&self.input.end());
                    if self.told.is_some() {
                        self.end(end(Ok(())));
                    }
                }
                _ => self.input.push(byte),
            }
        }
    }

    fn tick(&mut self, now: Duration) {
        if self.over || self.times > 0 && now.saturating_sub(self.since) <= ANSWER_WAIT {
            return;
        }
        if self.times == ASK_MAX {
            return self.end(end(Ok(())));
        }
        self.outbox.write(QUESTION);
        self.times += 1;
        self.since = now;
    }

    fn outbox(&mut self) -> &mut Outbox {
        &mut self.outbox
    }

    fn control(&mut self, control: Control, _now: Duration) {
        if control == Control::Stop && !self.over {
            let at = self.place();
            self.end(end(Err(Fault::Cancelled { at })));
        }
    }

    fn progress(&self) -> Progress {
        Progress::default()
    }

    fn place(&self) -> Place {
        Place { unit: Unit::Instruction, number: 0, text: String::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is found for a job at a plotter that answers so.
    fn findings(answer: &[u8], job: &str) -> Vec<String> {
        let mut window = Window::default();
        let mut asked = Vec::new();
        for second in 0..10 {
            let now = Duration::from_secs(second);
            window.tick(now);
            let output = window.take_output();
            asked.push(String::from_utf8(output).unwrap());
            if second == 3 {
                window.receive(answer, now);
            }
        }
        assert_eq!(window.take_event(), Some(Event::Done));
        assert!(asked.iter().filter(|text| text.as_bytes() == QUESTION).count() == 2, "{asked:?}");
        window.findings(&Job::new(job.as_bytes()).unwrap()).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn what_is_outside_of_the_paper_is_told() {
        let job = "IN;PA;PU10,10;PD11040,10,11041,7000;PU;";
        assert!(findings(b"0,0,16158,11040\r", job).is_empty());
        let found = findings(b"0,0,11040,7721\r", job);
        assert!(found.len() == 1 && found[0].contains("from (10, 10) to (11041, 7000)"), "{found:?}");
        // Nothing that can be read is nothing told.
        for answer in [&b""[..], b"0,0,11040\r", b"a,b,c,d\r", b"9,9,0,0\r", b"0,0,1,1"] {
            assert!(findings(answer, job).is_empty());
        }
    }
}
