//! What the processors of real boards do besides interrupts: drawing what is stored, sleep, and the end.

use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use penvis_firmware::Levels;

/// Levels that release the motors, as the settings have it: see [`note_release`].
static HIGH: AtomicU32 = AtomicU32::new(0);
static LOW: AtomicU32 = AtomicU32::new(0);

/// For `Port::note_release`.
pub(crate) fn note_release(levels: Levels) {
    HIGH.store(levels.high, Relaxed);
    LOW.store(levels.low, Relaxed);
}

/// Thread mode after the start.
pub(crate) fn run() -> ! {
    #[cfg(feature = "scene")]
    crate::thread::run(|ended| {
        crate::drawing::report(&ended);
        work()
    });
    #[cfg(not(feature = "scene"))]
    work()
}

fn work() -> ! {
    loop {
        #[cfg(feature = "scene")]
        crate::drawing::serve();
        cortex_m::asm::wfi();
    }
}

/// What panics in thread mode is started again; else pen up, motors released. The watchdog is not used, since a machine that has lost its place must not go on.
#[panic_handler]
fn panic(_info: &core::panic::PanicInfo<'_>) -> ! {
    #[cfg(feature = "scene")]
    crate::thread::abandon(_info);
    cortex_m::interrupt::disable();
    crate::board::rest(Levels { high: HIGH.load(Relaxed), low: LOW.load(Relaxed) });
    loop {
        cortex_m::asm::wfi();
    }
}
