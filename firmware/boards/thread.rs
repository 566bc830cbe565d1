//! Thread mode: work that may run out of memory, or panic, without the machine's noticing.
//!
//! ```text
//!  run(work) ──▶ work(Ended::Never) ──▶ … panics, by itself or for want of memory
//!                                          │ the panic handler calls abandon
//!                 empty stack and heap  ◀──┘
//!                 work(Ended::…) ──▶ … and so on
//! ```
//!
//! Interrupts have a stack frame of their own while they run, above nothing that the work keeps, so that the work's stack can be dropped whenever none of them is active.
//! They go on as if nothing had happened. What the work may not do is to keep a lock of theirs: it is abandoned only outside critical sections.

use core::cell::Cell;
use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;
use cortex_m::peripheral::scb::VectActive;
use critical_section::Mutex;

/// How the work before this one ended.
#[derive(Debug, Default)]
pub(crate) enum Ended {
    /// There was none.
    #[default]
    Never,
    /// `needed` more bytes were asked for while `used` of `size` were in use.
    OutOfMemory { needed: usize, used: usize, size: usize },
    /// A fault in the program, there.
    Panicked { file: heapless::String<64>, line: u32 },
}

type Work = fn(Ended) -> !;

static WORK: Mutex<Cell<Option<Work>>> = Mutex::new(Cell::new(None));
static ENDED: Mutex<Cell<Ended>> = Mutex::new(Cell::new(Ended::Never));

/// Does `work` in thread mode, from the start each time it is abandoned, with an empty heap and all of the stack.
pub(crate) fn run(work: Work) -> ! {
    critical_section::with(|cs| WORK.borrow(cs).set(Some(work)));
    start()
}

extern "C" fn start() -> ! {
    let (work, ended) = critical_section::with(|cs| (WORK.borrow(cs).get(), ENDED.borrow(cs).take()));
    let Some(work) = work else { unreachable!("only what is run starts") };
    #[allow(unsafe_code, reason = "the heap cannot know that nothing of it is in use")]
    // SAFETY: this is thread mode, and what used the heap before is gone with its stack.
    unsafe {
        crate::HEAP.reset();
    }
    work(ended)
}

/// For the panic handler: starts the work again if it was the work that panicked. Returns if it was an interrupt, or anything with interrupts held off.
pub(crate) fn abandon(info: &PanicInfo<'_>) {
    if SCB::vect_active() != VectActive::ThreadMode || cortex_m::register::primask::read().is_inactive() {
        return;
    }
    let heap = &crate::HEAP;
    let ended = match heap.refused() {
        Some(needed) => Ended::OutOfMemory { needed, used: heap.used(), size: heap.size() },
        None => {
            let mut ended = (heapless::String::new(), 0);
            if let Some(at) = info.location() {
                // The end of a long path tells most.
                let tail = at.file().len().saturating_sub(ended.0.capacity());
                let fits = ended.0.push_str(at.file().get(tail..).unwrap_or("?"));
                debug_assert!(fits.is_ok());
                ended.1 = at.line();
            }
            Ended::Panicked { file: ended.0, line: ended.1 }
        }
    };
    let known = critical_section::with(|cs| {
        ENDED.borrow(cs).set(ended);
        WORK.borrow(cs).get().is_some()
    });
    if known {
        restart();
    }
}

/// Drops the stack of thread mode.
#[allow(unsafe_code, reason = "a stack pointer is set")]
fn restart() -> ! {
    unsafe extern "C" {
        static _stack_start: u32;
    }
    // SAFETY: the linker's stack begins there, and the function never returns. What lies on the stack now is lost, its destructors do not run: no critical section
    // is open, and the heap is emptied by the start.
    unsafe { cortex_m::asm::bootstrap(&raw const _stack_start, start as *const u32) }
}
