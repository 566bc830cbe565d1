//! Measurements and trials, each asked for by a byte at UART2 and answered there by a line. They are done in thread mode, while the machine works.
//!
//! `s` the stack used at most since the start, of all contexts, bytes; `t` what a step costs, see `bench.rs` (in images without the core, which are built for speed); `l` puts limit switches below where the motors stand; `r` resets the
//! processor, and is not answered; with a heap, `h` its use, and `m` asks for memory until there is no more:
//! its answer is how that ended.

use core::fmt::Write as _;

use penvis_firmware::AXES;

use super::SHARED;
#[cfg(not(feature = "scene"))]
use super::bench;
use super::registers::UART2;

/// What unused stack holds.
const PAINT: u32 = 0xa5a5_5a5a;

/// Left unpainted below the stack pointer: what the painting itself uses.
const MARGIN: usize = 256;

/// The stack's lowest word, and the end of its highest.
fn stack() -> (*mut u32, *mut u32) {
    #[allow(unsafe_code, reason = "only the linker knows the ends of the stack")]
    unsafe extern "C" {
        static mut __sheap: u32;
        static mut _stack_start: u32;
    }
    (&raw mut __sheap, &raw mut _stack_start)
}

/// Fills the unused stack, so that what has been used can be told later. Before any interrupt is let in.
pub(crate) fn paint_stack() {
    let mut word = stack().0;
    while (word as usize) < cortex_m::register::msp::read() as usize - MARGIN {
        #[allow(unsafe_code, reason = "unused stack is nobody's memory")]
        // SAFETY: from the end of the statics to below the stack pointer is memory that nothing uses.
        unsafe {
            word.write_volatile(PAINT);
        }
        word = word.wrapping_add(1);
    }
}

/// Bytes of stack used at most so far.
fn stack_used() -> usize {
    let (mut word, end) = stack();
    #[allow(unsafe_code, reason = "as above")]
    // SAFETY: between the ends of the stack, which is memory.
    while word < end && unsafe { word.read_volatile() } == PAINT {
        word = word.wrapping_add(1);
    }
    end as usize - word as usize
}

/// Answers what has been asked.
pub(crate) fn serve() {
    while let Some(request) = UART2.take() {
        match request {
            b's' => say(format_args!("{} bytes of stack", stack_used())),
            #[cfg(not(feature = "scene"))]
            b't' => say(format_args!("{}", bench::step())),
            b'l' => put_switches(),
            b'r' => cortex_m::peripheral::SCB::sys_reset(),
            #[cfg(feature = "heap")]
            b'h' => say(format_args!("{} bytes of heap in use, {} at most", super::HEAP.used(), super::HEAP.peak())),
            #[cfg(feature = "heap")]
            b'm' => exhaust(),
            _ => say(format_args!("unknown request {request:#x}: see monitor.rs")),
        }
    }
}

/// Steps from where the motors stand to the switches of X, Y and Z.
const BELOW: [i32; AXES] = [800, 2000, 400];

fn put_switches() {
    let _ = SHARED.with_hardware(|trace| trace.put_switches(BELOW));
    say(format_args!("limit switches {} steps below X, {} below Y, {} below Z", BELOW[0], BELOW[1], BELOW[2]));
}

/// Says how the work before this one ended, if there was any.
#[cfg(feature = "heap")]
pub(crate) fn report(ended: &crate::thread::Ended) {
    use crate::thread::Ended;

    match ended {
        Ended::Never => (),
        Ended::OutOfMemory { needed, used, size } => {
            say(format_args!("out of memory: {needed} more bytes were needed, with {used} of {size} in use"));
        }
        Ended::Panicked { file, line } => say(format_args!("panicked at {file}:{line}")),
    }
}

#[cfg(feature = "heap")]
fn exhaust() -> ! {
    extern crate alloc;

    let mut hoard = alloc::vec::Vec::with_capacity(super::HEAP_BYTES / 1000);
    loop {
        hoard.push(core::hint::black_box(alloc::vec![1u8; 1000]));
    }
}

fn say(what: core::fmt::Arguments<'_>) {
    // The port takes everything.
    let _ = Line.write_fmt(format_args!("{what}\n"));
}

/// UART2 as text.
struct Line;

impl core::fmt::Write for Line {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        for byte in text.bytes() {
            while !UART2.offer(byte) {}
        }
        Ok(())
    }
}
