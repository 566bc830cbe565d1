//! Stored scenes, drawn in thread mode.
#![allow(
    unsafe_code,
    reason = "what outlives an abandoned thread mode is a static that only thread mode uses, and the scene in flash a place of the linker's"
)]

use core::cell::UnsafeCell;
use core::fmt::Write as _;
use core::sync::atomic::{AtomicU32, Ordering::Relaxed};

use cortex_m::peripheral::SCB;
use penvis_core::pipeline::Monitor;
use penvis_firmware::Error;
use penvis_firmware::scene::{Answer, Line, Offer, Studio, Surroundings, out_of_memory};

use crate::thread::Ended;
use crate::{HEAP, SCENE_BYTES, SHARED};

/// Flash that `build.rs` leaves free for a scene, bytes.
const STORED_BYTES: usize = 64 * 1024;

unsafe extern "C" {
    /// That flash: a scene, which is drawn until another is sent, or anything.
    static _scene: [u8; STORED_BYTES];
}

/// Patches are not cut ahead of the sight lines: memory is scarcer than time.
const CELLS: usize = 0;

/// The studio, with the scene that was sent. It outlives what is drawn of it.
struct Kept(UnsafeCell<Studio<SCENE_BYTES>>);

// SAFETY: only `serve` uses it, which only thread mode calls, one context.
unsafe impl Sync for Kept {}

/// All zeros, so that no flash is taken for it: it learns in `serve` where a scene is stored.
static STUDIO: Kept = Kept(UnsafeCell::new(Studio::new(&[], CELLS)));

/// ms since the start.
static NOW_MS: AtomicU32 = AtomicU32::new(0);

/// Each millisecond.
pub(crate) fn tick() {
    // Nobody else writes it.
    NOW_MS.store(NOW_MS.load(Relaxed).wrapping_add(1), Relaxed);
}

struct Thread;

impl Monitor for Thread {
    fn stops(&self) -> bool {
        SHARED.is_abandoned()
    }
}

impl Surroundings for Thread {
    fn line(&self, line: &Line) -> bool {
        loop {
            match SHARED.offer_line(line) {
                Offer::Taken => {
                    SCB::set_pendsv();
                    return true;
                }
                Offer::Abandoned => return false,
                // Until the foreground has had a turn, a millisecond at most.
                Offer::Full => cortex_m::asm::wfi(),
            }
        }
    }

    fn heap_peak(&self) -> usize {
        HEAP.peak()
    }

    fn now_ms(&self) -> u32 {
        NOW_MS.load(Relaxed)
    }
}

/// Obeys an order, if there is one.
pub(crate) fn serve() {
    let Some(order) = SHARED.take_order() else { return };
    // SAFETY: an earlier reference is gone: with the return of this function, or with the stack of the work that was abandoned.
    let studio = unsafe { &mut *STUDIO.0.get() };
    // SAFETY: the linker's script puts it into flash, which is never written to there.
    studio.set_stored(unsafe { &_scene });
    SHARED.finish(studio.obey(&order, &Thread));
    SCB::set_pendsv();
}

/// Answers the order at which the work before this one ended.
pub(crate) fn report(ended: &Ended) {
    let answer = match ended {
        Ended::Never => return,
        Ended::OutOfMemory { needed, used, size } => out_of_memory(*needed, *used, *size),
        Ended::Panicked { file, line } => {
            let mut text = heapless::String::new();
            // The tail of a path and a number fit.
            let _ = write!(text, "[MSG:the drawing has failed at {file}:{line}]");
            Answer { text, result: Err(Error::DrawingStopped) }
        }
    };
    SHARED.finish(answer);
    SCB::set_pendsv();
}
