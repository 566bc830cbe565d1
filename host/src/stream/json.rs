//! What happens to a plot, for other programs: a JSON object a line on standard output.

use std::io::{self, Write};
use std::time::{Duration, Instant};

use serde::Serialize;

use super::course::Estimate;
use super::{Course, Observer, User};
use crate::interrupt;
use crate::protocol::{Control, Progress};

/// Time between two lines that tell nothing but progress.
const INTERVAL: Duration = Duration::from_millis(500);

/// Something that happened, as it is written.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum Happening<'a> {
    /// A plot begins.
    Start {
        /// What it is called.
        job: &'a str,
        /// What its pieces are: `line` or `instruction`.
        unit: &'a str,
        /// Pieces of the job.
        total: usize,
        /// Pieces that were drawn before.
        skipped: usize,
    },
    /// It has come this far.
    Progress {
        /// Pieces that the plotter has taken.
        acknowledged: usize,
        /// Pieces that it has carried out for certain.
        executed: usize,
        /// Pieces of the job.
        total: usize,
        /// From 0 to 1, by time.
        fraction: f64,
        /// Ink drawn by then, mm.
        #[serde(skip_serializing_if = "Option::is_none")]
        ink_mm: Option<f64>,
        /// Time since the beginning, s.
        elapsed_s: f64,
        /// Time that is left, s.
        #[serde(skip_serializing_if = "Option::is_none")]
        left_s: Option<f64>,
    },
    /// The plotter, or the program, says something.
    Message {
        /// What it says.
        text: &'a str,
    },
    /// The job waits: a line on standard input goes on, `s` stops.
    Prompt {
        /// The comment of the job.
        text: &'a str,
    },
    /// The plotter rests.
    Paused,
    /// It goes on.
    Resumed,
    /// All is drawn, and the pen rests.
    Done {
        /// Time since the beginning, s.
        elapsed_s: f64,
    },
    /// It has ended before its end.
    Failed {
        /// Why.
        error: &'a str,
    },
}

/// Writes what happens to standard output.
#[derive(Debug)]
pub struct Json {
    user: User,
    since: Instant,
    estimate: Estimate,
    progress: Progress,
    written: Option<(Progress, Instant)>,
}

impl Json {
    /// For a job that takes this course. With a user present, Ctrl-C from now on stops the plotter before the program.
    #[must_use]
    pub fn new(user: User, course: Course) -> Self {
        if user == User::Present {
            interrupt::watch();
        }
        Self {
            user,
            since: Instant::now(),
            estimate: Estimate::new(course),
            progress: Progress::default(),
            written: None,
        }
    }

    /// Writes a line. A reader that has gone does not stop the plotter.
    pub fn write(&self, happening: &Happening<'_>) {
        let Ok(mut line) = serde_json::to_string(happening) else { return };
        line.push('\n');
        let mut out = io::stdout().lock();
        let _ = out.write_all(line.as_bytes()).and_then(|()| out.flush());
    }

    /// Time since the beginning, s.
    #[must_use]
    pub fn elapsed_s(&self) -> f64 {
        self.since.elapsed().as_secs_f64()
    }

    /// Writes how far the job is, if that is news and the last such line is some time ago, or `now`.
    fn show(&mut self, now: bool) {
        let due = match self.written {
            Some((shown, when)) => shown != self.progress && (now || when.elapsed() >= INTERVAL),
            None => self.progress.total > 0,
        };
        if !due {
            return;
        }
        let Progress { acknowledged, executed, total } = self.progress;
        let standing = self.estimate.at(acknowledged, total, self.since.elapsed());
        self.written = Some((self.progress, Instant::now()));
        self.write(&Happening::Progress {
            acknowledged,
            executed,
            total,
            fraction: standing.fraction,
            ink_mm: standing.ink_mm.map(|(done, _)| done),
            elapsed_s: self.elapsed_s(),
            left_s: standing.left.map(|left| left.as_secs_f64()),
        });
    }

    /// Writes how the plot ended.
    pub fn end(&mut self, error: Option<&str>) {
        self.show(true);
        self.write(&match error {
            Some(error) => Happening::Failed { error },
            None => Happening::Done { elapsed_s: self.elapsed_s() },
        });
    }
}

impl Observer for Json {
    fn progress(&mut self, progress: Progress) {
        self.progress = progress;
        self.show(false);
    }

    fn message(&mut self, text: &str) {
        self.write(&Happening::Message { text });
    }

    fn control(&mut self) -> Option<Control> {
        self.show(false);
        (self.user == User::Present && interrupt::is_wanted()).then_some(Control::Stop)
    }

    fn prompt(&mut self, comment: &str) -> bool {
        self.show(true);
        self.estimate.paused(true, self.since.elapsed());
        self.write(&Happening::Prompt { text: comment });
        if self.user == User::Absent {
            self.estimate.paused(false, self.since.elapsed());
            return true;
        }
        let mut answer = String::new();
        let goes_on = match io::stdin().read_line(&mut answer) {
            Ok(count) => count > 0 && !answer.trim().eq_ignore_ascii_case("s"),
            Err(_) => false,
        };
        self.estimate.paused(false, self.since.elapsed());
        goes_on
    }

    fn paused(&mut self, rests: bool) {
        self.estimate.paused(rests, self.since.elapsed());
        self.write(if rests { &Happening::Paused } else { &Happening::Resumed });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_happening_is_an_object_of_its_own() {
        let table = [
            (
                Happening::Start { job: "a.gcode", unit: "line", total: 9, skipped: 0 },
                r#"{"event":"start","job":"a.gcode","unit":"line","total":9,"skipped":0}"#,
            ),
            (
                Happening::Progress {
                    acknowledged: 5,
                    executed: 4,
                    total: 9,
                    fraction: 0.5,
                    ink_mm: None,
                    elapsed_s: 1.5,
                    left_s: Some(2.0),
                },
                r#"{"event":"progress","acknowledged":5,"executed":4,"total":9,"fraction":0.5,"elapsed_s":1.5,"left_s":2.0}"#,
            ),
            (Happening::Message { text: "a \"b\"" }, r#"{"event":"message","text":"a \"b\""}"#),
            (Happening::Prompt { text: "pen 2" }, r#"{"event":"prompt","text":"pen 2"}"#),
            (Happening::Paused, r#"{"event":"paused"}"#),
            (Happening::Resumed, r#"{"event":"resumed"}"#),
            (Happening::Done { elapsed_s: 3.0 }, r#"{"event":"done","elapsed_s":3.0}"#),
            (Happening::Failed { error: "x" }, r#"{"event":"failed","error":"x"}"#),
        ];
        for (happening, expected) in table {
            assert_eq!(serde_json::to_string(&happening).unwrap(), expected);
        }
    }
}
