//! Ctrl-C, as a wish that is asked for.

use std::process;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};

static WATCH: Once = Once::new();
static WANTED: AtomicBool = AtomicBool::new(false);

/// What a shell reports of a program that Ctrl-C has ended: 128 and the number of the signal.
pub const EXIT_INTERRUPTED: u8 = 130;

/// From now on the first Ctrl-C is a wish, and the second ends the program.
pub fn watch() {
    WATCH.call_once(|| {
        // Where a signal cannot be caught, it ends the program as before.
        let _ = ctrlc::set_handler(press);
    });
}

/// Does what Ctrl-C does: the first time it is a wish, the second time it ends the program.
pub fn press() {
    if WANTED.swap(true, Ordering::Relaxed) {
        // Nothing is cleaned up on this way out; a terminal that shows no more what is typed would be left behind.
        let _ = crossterm::terminal::disable_raw_mode();
        process::exit(EXIT_INTERRUPTED.into());
    }
}

/// Whether Ctrl-C was pressed.
#[must_use]
pub fn is_wanted() -> bool {
    WANTED.load(Ordering::Relaxed)
}
