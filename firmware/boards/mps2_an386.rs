//! Arm MPS2 with the image AN386: Cortex-M4 with an f32 unit, as QEMU emulates it (`-M mps2-an386`).
//!
//! For the wiring, which is the same on both images, and for what the serial ports carry see `mps2/mod.rs`. Build and run, with 3 serial ports:
//!
//! ```text
//! cargo build --profile firmware -p penvis-firmware --bin mps2-an386 --features board-mps2-an386 --target thumbv7em-none-eabihf
//! qemu-system-arm -M mps2-an386 -nographic -monitor none -semihosting -kernel target/thumbv7em-none-eabihf/firmware/mps2-an386 \
//!     -serial mon:stdio -serial file:trace.bin -serial null
//! ```
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(all(target_os = "none", feature = "scene"))]
mod drawing;
#[cfg(target_os = "none")]
mod handover;
#[cfg(all(target_os = "none", feature = "heap"))]
mod heap;
#[cfg(target_os = "none")]
mod interrupts;
#[cfg(target_os = "none")]
mod mps2;
#[cfg(all(target_os = "none", feature = "heap"))]
mod thread;
#[cfg(all(target_os = "none", feature = "heap"))]
use mps2::HEAP;
#[cfg(all(target_os = "none", feature = "scene"))]
use mps2::{SCENE_BYTES, SHARED};

/// The board is what this is for; a host only checks that it compiles.
#[cfg(not(target_os = "none"))]
fn main() {}
