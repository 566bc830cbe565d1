//! What the images AN386 and AN500 of the MPS2 board have in common, which is all but the processor.
//!
//! # Wiring
//!
//! | serial port | address | interrupt | carries |
//! |---|---|---|---|
//! | UART0 | 0x4000_4000 | 0 received, 1 sent | GRBL, both ways |
//! | UART1 | 0x4000_5000 | – | the trace of what the motors and the pen do, see `trace.rs` |
//! | UART2 | 0x4000_6000 | – | measurements and trials on request, see `monitor.rs` |
//!
//! There are no motors: neither image has pins that QEMU would show.
//!
//! # Theory of operation
//!
//! TIMER1 counts down from 2³² at 25 MHz and wraps: it is the clock. TIMER0 is set to what is left until the next step and interrupts at zero. Interrupts have the
//! priorities of `penvis_firmware::Shared`; SysTick pends PendSV each millisecond. The vector table is that of `cortex-m-rt` without a device, in which every interrupt
//! leads to `DefaultHandler`.
//!
//! What is stored is kept in RAM that outlives a reset of the processor, see `kept.rs`. Limit switches are where the monitor is told to put them.

// It holds the controller and the stepper once more, for which images with the core have no room.
#[cfg(not(feature = "scene"))]
mod bench;
mod kept;
mod monitor;
mod registers;
mod trace;

use cortex_m::peripheral::SCB;
use cortex_m::peripheral::scb::Exception;
use cortex_m_rt::{entry, exception};
use penvis_firmware::{Foreground, Shared};

use crate::handover::Handover;
use crate::interrupts::{self, BLOCKS, lies_ahead};
use kept::Kept;
use registers::{CLOCK, Irq, TIMER0, UART0, UART2, Uart};
use trace::Trace;

/// The system's clock, Hz.
pub(crate) const CLOCK_HZ: u32 = 25_000_000;

pub(crate) static SHARED: Shared<Trace> = Shared::new();

static SENDER: Handover<Uart> = Handover::new();
static STORAGE: Handover<Kept> = Handover::new();

/// Room for a scene that is sent: the largest built-in one has some 60 000 bytes.
#[cfg(feature = "scene")]
pub(crate) const SCENE_BYTES: usize = 64 * 1024;

/// Memory for what thread mode computes.
#[cfg(feature = "heap")]
pub(crate) const HEAP_BYTES: usize = if cfg!(feature = "scene") { 3 << 20 } else { 1 << 20 };

#[cfg(feature = "heap")]
#[global_allocator]
pub(crate) static HEAP: crate::heap::Heap<HEAP_BYTES> = crate::heap::Heap::new();

#[entry]
fn main() -> ! {
    let Some(core) = cortex_m::Peripherals::take() else { unreachable!("the processor is taken once") };
    monitor::paint_stack();
    CLOCK.start(u32::MAX, false);
    UART0.start(true);
    UART2.start(false);
    SHARED.start(Trace::start(), CLOCK.counted());
    SENDER.give(UART0);
    STORAGE.give(Kept);
    TIMER0.start(1, true);
    interrupts::start(core, CLOCK_HZ, Irq::Timer0, &[Irq::Uart0Receive, Irq::Uart0Transmit]);
    #[cfg(feature = "heap")]
    crate::thread::run(|ended| {
        monitor::report(&ended);
        #[cfg(feature = "scene")]
        crate::drawing::report(&ended);
        work()
    });
    #[cfg(not(feature = "heap"))]
    work()
}

/// Thread mode.
fn work() -> ! {
    loop {
        monitor::serve();
        #[cfg(feature = "scene")]
        crate::drawing::serve();
        cortex_m::asm::wfi();
    }
}

/// The step interrupt.
fn step() {
    TIMER0.acknowledge();
    let due = SHARED.tick(CLOCK.counted());
    // What has passed already is due at once.
    let now = CLOCK.counted();
    TIMER0.expire_in(if lies_ahead(due, now) { due.wrapping_sub(now) } else { 1 });
}

#[exception]
#[allow(unsafe_code, reason = "cortex-m-rt declares all handlers of interrupts without a device so")]
// SAFETY: called by the processor only.
unsafe fn DefaultHandler(irq: i16) {
    match irq {
        n if n == Irq::Timer0 as i16 => step(),
        n if n == Irq::Uart0Receive as i16 => {
            UART0.acknowledge_received();
            while let Some(byte) = UART0.take() {
                SHARED.receive(byte);
            }
            SCB::set_pendsv();
        }
        n if n == Irq::Uart0Transmit as i16 => {
            UART0.acknowledge_sent();
            SCB::set_pendsv();
        }
        _ => panic!("interrupt {irq}, which nothing asked for"),
    }
}

#[exception]
fn PendSV() {
    static mut FOREGROUND: Option<Foreground<Trace, BLOCKS, Kept>> = None;
    static mut PORT: Option<Uart> = None;

    interrupts::turn(&SHARED, FOREGROUND, &STORAGE, PORT, &SENDER);
}

/// Ends the emulation with a failure, which tests see; a hardware fault does the same. What panics in thread mode is started again instead.
#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    #[cfg(feature = "heap")]
    crate::thread::abandon(info);
    cortex_m::interrupt::disable();
    cortex_m_semihosting::hprintln!("{info}");
    loop {
        cortex_m_semihosting::debug::exit(cortex_m_semihosting::debug::EXIT_FAILURE);
    }
}

#[exception]
#[allow(unsafe_code, reason = "cortex-m-rt declares it so")]
// SAFETY: called by the processor only.
unsafe fn HardFault(frame: &cortex_m_rt::ExceptionFrame) -> ! {
    panic!("hard fault: {frame:?}, exception {:?}", Exception::HardFault);
}
