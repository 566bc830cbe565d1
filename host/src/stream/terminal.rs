//! A job's user at the terminal.

use std::io::{self, IsTerminal, Write};
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::Observer;
use crate::interrupt;
use crate::protocol::{Control, Progress};

/// Time before a bar is shown.
const PATIENCE: Duration = Duration::from_secs(1);

/// Shows a bar on standard error once a job takes longer than a second, if that is a terminal, and asks on standard input after a pause.
#[derive(Debug)]
pub struct Terminal {
    since: Instant,
    bar: ProgressBar,
    user: User,
    /// Whether the user was told that the job is being stopped.
    told: bool,
}

/// Who minds the plotter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum User {
    /// Somebody at the terminal changes the pens, and stops the plotter with Ctrl-C.
    Present,
    /// Nobody: a simulated plotter needs no hand to change its pen, and nothing to stop it in order.
    Absent,
}

impl Terminal {
    /// For a job that begins now. With a user present, Ctrl-C from now on stops the plotter before the program; a second one stops the program.
    #[must_use]
    pub fn new(user: User) -> Self {
        if user == User::Present {
            interrupt::watch();
        }
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        if let Ok(style) = ProgressStyle::with_template("{bar:40} {percent}% ({pos} of {len}, {eta} left)") {
            bar.set_style(style);
        }
        Self { since: Instant::now(), bar, user, told: false }
    }

    /// Whether somebody may be asked after a pause.
    #[must_use]
    pub fn has_user() -> bool {
        io::stdin().is_terminal()
    }

    /// Says something above the bar.
    pub fn say(&self, text: &str) {
        self.bar.suspend(|| eprintln!("{text}"));
    }
}

impl Observer for Terminal {
    fn progress(&mut self, progress: Progress) {
        if self.bar.is_hidden() && self.since.elapsed() > PATIENCE && io::stderr().is_terminal() {
            self.bar.set_draw_target(ProgressDrawTarget::stderr());
        }
        self.bar.set_length(progress.total as u64);
        self.bar.set_position(progress.acknowledged as u64);
    }

    fn message(&mut self, text: &str) {
        self.say(&format!("the plotter says: {text}"));
    }

    fn warn(&mut self, text: &str) {
        self.say(&format!("warning: {text}"));
    }

    fn control(&mut self) -> Option<Control> {
        let wanted = self.user == User::Present && interrupt::is_wanted();
        if wanted && !self.told {
            self.told = true;
            self.say("stopping the plotter; press Ctrl-C again to leave it as it is");
        }
        wanted.then_some(Control::Stop)
    }

    fn paused(&mut self, rests: bool) {
        self.say(if rests { "the plotter rests" } else { "the plotter goes on" });
    }

    fn prompt(&mut self, comment: &str) -> bool {
        if self.user == User::Absent {
            return true;
        }
        let what = if comment.is_empty() { String::new() } else { format!(" ({comment})") };
        self.bar.suspend(|| {
            eprint!("the job pauses{what}: press Enter to go on, or s and Enter to stop ");
            // A prompt that is not seen is none the less waited for.
            let _ = io::stderr().flush();
            let mut answer = String::new();
            match io::stdin().read_line(&mut answer) {
                Ok(count) => count > 0 && !answer.trim().eq_ignore_ascii_case("s"),
                Err(_) => false,
            }
        })
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}
