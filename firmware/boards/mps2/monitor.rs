//! Measurements, asked for by a byte at UART2 and answered there by a line.
//!
//! `s`: the stack that has been used at most since the start, bytes.

use core::fmt::Write as _;

use super::registers::UART2;

/// What unused stack holds.
const PAINT: u32 = 0xa5a5_5a5a;

/// The stack's lowest and highest word.
pub(crate) struct Stack {
    lowest: *const u32,
    top: *const u32,
}

/// Fills the unused stack, so that what has been used can be told later. First thing in thread mode.
#[allow(unsafe_code, reason = "the stack is memory that only the linker knows the ends of")]
pub(crate) fn paint_stack() -> Stack {
    unsafe extern "C" {
        static mut __sheap: u32;
        static mut _stack_start: u32;
    }
    /// Left alone below the stack pointer: what the loop itself uses.
    const MARGIN: u32 = 256;

    let lowest = &raw mut __sheap;
    let mut word = lowest;
    // SAFETY: from the end of the statics to below the stack pointer is memory that nothing uses; no interrupt is let in yet.
    unsafe {
        while (word as u32) < cortex_m::register::msp::read() - MARGIN {
            word.write_volatile(PAINT);
            word = word.add(1);
        }
    }
    Stack { lowest, top: &raw const _stack_start }
}

impl Stack {
    /// Bytes used at most so far.
    #[allow(unsafe_code, reason = "as above")]
    fn used(&self) -> usize {
        let mut word = self.lowest;
        // SAFETY: between the ends of the stack, which is readable memory.
        while word < self.top && unsafe { word.read_volatile() } == PAINT {
            word = word.wrapping_add(1);
        }
        self.top as usize - word as usize
    }
}

/// Answers what has been asked.
pub(crate) fn serve(stack: &Stack) {
    while let Some(byte) = UART2.take() {
        let Ok(()) = (match byte {
            b's' => writeln!(Line, "stack {}", stack.used()),
            _ => writeln!(Line, "unknown request {byte:#x}: s asks for the stack used"),
        }) else {
            return;
        };
    }
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
