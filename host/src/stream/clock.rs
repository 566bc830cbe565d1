//! The time that a conversation goes by.

use std::time::{Duration, Instant};

/// Tells the time since a port was opened; it never runs backwards.
pub trait Clock {
    /// Time since the port was opened.
    fn now(&self) -> Duration;
}

/// The time of the wall.
#[derive(Clone, Copy, Debug)]
pub struct WallClock(Instant);

impl WallClock {
    /// A clock that starts now.
    #[must_use]
    pub fn start() -> Self {
        Self(Instant::now())
    }
}

impl Clock for WallClock {
    fn now(&self) -> Duration {
        self.0.elapsed()
    }
}
