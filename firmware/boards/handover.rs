//! From the start of the program to the interrupt that owns a thing from then on.

use core::cell::Cell;

use critical_section::Mutex;

/// Holds a thing until its owner takes it.
pub(crate) struct Handover<T>(Mutex<Cell<Option<T>>>);

impl<T> Handover<T> {
    pub(crate) const fn new() -> Self {
        Self(Mutex::new(Cell::new(None)))
    }

    pub(crate) fn give(&self, thing: T) {
        critical_section::with(|cs| self.0.borrow(cs).set(Some(thing)));
    }

    /// What was given, once.
    pub(crate) fn take(&self) -> Option<T> {
        critical_section::with(|cs| self.0.borrow(cs).take())
    }

    /// `owned`, after having taken there what was given. `None` if nothing has been.
    pub(crate) fn owned<'a>(&self, owned: &'a mut Option<T>) -> Option<&'a mut T> {
        if owned.is_none() {
            *owned = self.take();
        }
        owned.as_mut()
    }
}
