//! Stopping a long computation.

use core::fmt;

/// Whether to go on, asked between pieces of work of some milliseconds at the most. What is stopped returns early with
/// part of its result, which is of no use; so who hands a `Stop` down asks it once more in the end.
#[derive(Clone, Copy)]
pub struct Stop<'a> {
    wanted: Option<&'a (dyn Fn() -> bool + Sync)>,
}

impl<'a> Stop<'a> {
    /// Goes on to the end.
    pub const NEVER: Stop<'static> = Stop { wanted: None };

    /// Stops when `wanted` says so. Once it has, it has to say so for good.
    pub fn when(wanted: &'a (dyn Fn() -> bool + Sync)) -> Self {
        Self { wanted: Some(wanted) }
    }

    /// Whether to stop.
    #[must_use]
    pub fn is_wanted(&self) -> bool {
        self.wanted.is_some_and(|wanted| wanted())
    }

    /// [`Stopped`] if it is time to stop.
    ///
    /// # Errors
    /// [`Stopped`].
    pub fn check(&self) -> Result<(), Stopped> {
        if self.is_wanted() { Err(Stopped) } else { Ok(()) }
    }
}

impl fmt::Debug for Stop<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Stop").field("possible", &self.wanted.is_some()).finish()
    }
}

/// A computation was stopped before its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("stopped before the end")]
pub struct Stopped;
