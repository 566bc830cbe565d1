//! Who is told how a plot goes: somebody at the terminal, or another program.

use super::json::{Happening, Json};
use super::{Course, Observer, Terminal, User};
use crate::protocol::{Control, Progress, Unit};

/// Tells how a plot goes.
#[derive(Debug)]
pub enum Interface {
    /// Somebody at the terminal.
    Terminal(Box<Terminal>),
    /// Another program, on standard output.
    Json(Box<Json>),
}

impl Interface {
    /// For a plot with this course; `json` for a program.
    #[must_use]
    pub fn new(user: User, course: Course, json: bool) -> Self {
        if json {
            Self::Json(Box::new(Json::new(user, course)))
        } else {
            Self::Terminal(Box::new(Terminal::new(user, course)))
        }
    }

    /// Whether there is somebody who answers when the job waits.
    #[must_use]
    pub fn answers(&self) -> bool {
        match self {
            Self::Terminal(_) => Terminal::has_user(),
            Self::Json(_) => true,
        }
    }

    /// The plot begins: `total` pieces, of which `skipped` were drawn before.
    pub fn start(&mut self, job: &str, unit: Unit, total: usize, skipped: usize) {
        if let Self::Json(json) = self {
            json.write(&Happening::Start { job, unit: &unit.to_string(), total, skipped });
        }
    }

    /// The program says something.
    pub fn say(&mut self, text: &str) {
        match self {
            Self::Terminal(terminal) => terminal.say(text),
            Self::Json(json) => json.write(&Happening::Message { text }),
        }
    }

    /// The plot has ended; with an error, before its end. Those at the terminal are told that by the program's own last word.
    pub fn end(&mut self, error: Option<&str>) {
        if let Self::Json(json) = self {
            json.end(error);
        }
    }

    fn observer(&mut self) -> &mut dyn Observer {
        match self {
            Self::Terminal(terminal) => terminal.as_mut(),
            Self::Json(json) => json.as_mut(),
        }
    }
}

impl Observer for Interface {
    fn progress(&mut self, progress: Progress) {
        self.observer().progress(progress);
    }

    fn message(&mut self, text: &str) {
        self.observer().message(text);
    }

    fn note(&mut self, text: &str) {
        self.observer().note(text);
    }

    fn warn(&mut self, text: &str) {
        self.observer().warn(text);
    }

    fn control(&mut self) -> Option<Control> {
        self.observer().control()
    }

    fn prompt(&mut self, comment: &str) -> bool {
        self.observer().prompt(comment)
    }

    fn paused(&mut self, rests: bool) {
        self.observer().paused(rests);
    }
}
