//! A job's user at the terminal.

use std::collections::VecDeque;
use std::io::{self, IsTerminal, Write};
use std::time::{Duration, Instant};

use crossterm::event::{self, Event, KeyEventKind};
use crossterm::terminal::{disable_raw_mode, enable_raw_mode};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::course::{Estimate, Standing};
use super::keys::{HELP, Keys, Wish};
use super::{Course, Observer};
use crate::compute::duration_text;
use crate::interrupt;
use crate::protocol::{Control, Progress};

/// Time before a bar is shown, and the keys.
const PATIENCE: Duration = Duration::from_secs(1);
/// Time between two lines where there is no terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(60);
/// Parts of the bar.
const PARTS: u64 = 1000;
/// Keys taken at a time.
const KEYS_MAX: usize = 64;

/// Shows a bar on standard error once a job takes longer than a second, if that is a terminal, or else a line a minute; takes
/// keys, and asks on standard input after a pause.
#[derive(Debug)]
pub struct Terminal {
    since: Instant,
    bar: ProgressBar,
    shows: bool,
    user: User,
    /// Whether the user was told that the job is being stopped.
    told: bool,
    estimate: Estimate,
    progress: Progress,
    /// Pieces that were acknowledged when the conversation began, and whether there are more: before, no key would do anything.
    first: Option<usize>,
    begun: bool,
    last_line: Instant,
    keys: Keys,
    raw: Option<RawMode>,
    /// Whether keys can be taken at all.
    takes_keys: bool,
    wishes: VecDeque<Control>,
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
    /// For a job that begins now and takes this course. With a user present, Ctrl-C from now on stops the plotter before the
    /// program; a second one stops the program.
    #[must_use]
    pub fn new(user: User, course: Course) -> Self {
        if user == User::Present {
            interrupt::watch();
        }
        let bar = ProgressBar::with_draw_target(Some(PARTS), ProgressDrawTarget::hidden());
        if let Ok(style) = ProgressStyle::with_template("{bar:30} {msg}") {
            bar.set_style(style);
        }
        let shows = io::stderr().is_terminal();
        let takes_keys = user == User::Present && shows && Self::has_user() && is_in_front();
        Self {
            since: Instant::now(),
            bar,
            shows,
            user,
            told: false,
            estimate: Estimate::new(course),
            progress: Progress::default(),
            first: None,
            begun: false,
            last_line: Instant::now(),
            keys: Keys::new(),
            raw: None,
            takes_keys,
            wishes: VecDeque::new(),
        }
    }

    /// Whether somebody may be asked after a pause.
    #[must_use]
    pub fn has_user() -> bool {
        io::stdin().is_terminal()
    }

    /// Says something above the bar.
    pub fn say(&self, text: &str) {
        // A raw terminal goes down a line and not back to its beginning.
        let end = if self.raw.is_some() { "\r\n" } else { "\n" };
        self.bar.suspend(|| eprint!("{text}{end}"));
    }

    fn show(&mut self) {
        let Progress { acknowledged, total, .. } = self.progress;
        if total == 0 {
            return;
        }
        let standing = self.estimate.at(acknowledged, total, self.since.elapsed());
        if self.shows {
            if self.bar.is_hidden() && self.since.elapsed() > PATIENCE {
                self.bar.set_draw_target(ProgressDrawTarget::stderr());
            }
            self.bar.set_position((standing.fraction * PARTS as f64) as u64);
            self.bar.set_message(text(&standing));
        } else if self.user == User::Present && self.last_line.elapsed() > LINE_INTERVAL {
            self.last_line = Instant::now();
            self.say(&text(&standing));
        }
    }

    /// Takes the keys that were pressed.
    fn take_keys(&mut self) {
        if !self.takes_keys || self.since.elapsed() < PATIENCE || !self.begun {
            return;
        }
        if self.raw.is_none() {
            match RawMode::enter() {
                Ok(raw) => {
                    self.raw = Some(raw);
                    self.say(HELP);
                }
                Err(e) => return self.give_up_keys(&e),
            }
        }
        for _ in 0..KEYS_MAX {
            match event::poll(Duration::ZERO).and_then(|some| some.then(event::read).transpose()) {
                Ok(Some(Event::Key(key))) if key.kind != KeyEventKind::Release => match self.keys.press(key) {
                    Some(Wish::Plotter(control, text)) => {
                        self.wishes.push_back(control);
                        if let Some(text) = text {
                            self.say(&text);
                        }
                    }
                    Some(Wish::Interrupt) => interrupt::press(),
                    None => {}
                },
                Ok(Some(_)) => {}
                Ok(None) => return,
                Err(e) => return self.give_up_keys(&e),
            }
        }
    }

    fn give_up_keys(&mut self, error: &io::Error) {
        self.takes_keys = false;
        self.raw = None;
        self.say(&format!("warning: the terminal gives no keys ({error}); Ctrl-C stops the plotter"));
    }
}

/// How a plot stands, in words.
fn text(standing: &Standing) -> String {
    let mut text = format!("{:.0} %", 100.0 * standing.fraction);
    if let Some((done, all)) = standing.ink_mm {
        text.push_str(&format!(", {:.1} of {:.1} m", done / 1000.0, all / 1000.0));
    }
    if let Some(left) = standing.left {
        text.push_str(&format!(", {} left", duration_text(left)));
    }
    text
}

/// A terminal that gives each key as it is pressed, until this is dropped.
#[derive(Debug)]
struct RawMode;

impl RawMode {
    fn enter() -> io::Result<Self> {
        enable_raw_mode()?;
        Ok(Self)
    }
}

impl Drop for RawMode {
    fn drop(&mut self) {
        // Whoever drops it is about to end; there is nobody left to tell.
        let _ = disable_raw_mode();
    }
}

/// Whether the terminal listens to this program: one in the background that asks it for keys is stopped by the system.
#[cfg(unix)]
fn is_in_front() -> bool {
    rustix::termios::tcgetpgrp(io::stdin()).is_ok_and(|front| front == rustix::process::getpgrp())
}

#[cfg(not(unix))]
fn is_in_front() -> bool {
    true
}

impl Observer for Terminal {
    fn progress(&mut self, progress: Progress) {
        self.progress = progress;
        let first = *self.first.get_or_insert(progress.acknowledged);
        self.begun |= progress.acknowledged > first;
        self.show();
    }

    fn message(&mut self, text: &str) {
        self.say(&format!("the plotter says: {text}"));
    }

    fn note(&mut self, text: &str) {
        self.say(text);
    }

    fn warn(&mut self, text: &str) {
        self.say(&format!("warning: {text}"));
    }

    fn control(&mut self) -> Option<Control> {
        self.take_keys();
        let wanted = self.user == User::Present && interrupt::is_wanted();
        if wanted && !self.told {
            self.told = true;
            self.say("stopping the plotter; press Ctrl-C again to leave it as it is");
        }
        if wanted { Some(Control::Stop) } else { self.wishes.pop_front() }
    }

    fn paused(&mut self, rests: bool) {
        self.keys.paused(rests);
        self.estimate.paused(rests, self.since.elapsed());
        self.say(if rests { "the plotter rests; space goes on" } else { "the plotter goes on" });
    }

    fn prompt(&mut self, comment: &str) -> bool {
        if self.user == User::Absent {
            return true;
        }
        self.estimate.paused(true, self.since.elapsed());
        // A line is typed as usual.
        self.raw = None;
        let what = if comment.is_empty() { String::new() } else { format!(" ({comment})") };
        let goes_on = self.bar.suspend(|| {
            eprint!("the job pauses{what}: press Enter to go on, or s and Enter to stop ");
            // A prompt that is not seen is none the less waited for.
            let _ = io::stderr().flush();
            let mut answer = String::new();
            match io::stdin().read_line(&mut answer) {
                Ok(count) => count > 0 && !answer.trim().eq_ignore_ascii_case("s"),
                Err(_) => false,
            }
        });
        self.estimate.paused(false, self.since.elapsed());
        goes_on
    }
}

impl Drop for Terminal {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_standing_is_told_as_far_as_it_is_known() {
        let mut standing = Standing { fraction: 0.374, ink_mm: None, left: None };
        assert_eq!(text(&standing), "37 %");
        standing.ink_mm = Some((1234.0, 33_100.0));
        standing.left = Some(Duration::from_secs(754));
        assert_eq!(text(&standing), "37 %, 1.2 of 33.1 m, 12 min 34 s left");
    }
}
