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

mod bench;
#[cfg(feature = "scene")]
mod drawing;
mod monitor;
mod registers;
mod trace;

use cortex_m::peripheral::scb::{Exception, SystemHandler};
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{NVIC, SCB};
use cortex_m_rt::{entry, exception};
use penvis_firmware::{Cadence, Foreground, Settings, Shared};

use registers::{CLOCK, Irq, TIMER0, UART0, UART2};
use trace::Trace;

/// The system's clock, Hz.
pub(crate) const CLOCK_HZ: u32 = 25_000_000;

/// Blocks the planner looks ahead.
const BLOCKS: usize = 64;

/// Priorities, of which the upper 3 bits count: lower is more urgent.
const STEP_PRIORITY: u8 = 0x00;
const SERIAL_PRIORITY: u8 = 0x40;
const FOREGROUND_PRIORITY: u8 = 0xe0;

static SHARED: Shared<Trace> = Shared::new();

/// Memory for what thread mode computes.
#[cfg(feature = "heap")]
pub(crate) const HEAP_BYTES: usize = if cfg!(feature = "scene") { 3 << 20 } else { 1 << 20 };

#[cfg(feature = "heap")]
#[global_allocator]
pub(crate) static HEAP: crate::heap::Heap<HEAP_BYTES> = crate::heap::Heap::new();

#[entry]
fn main() -> ! {
    let Some(mut core) = cortex_m::Peripherals::take() else { unreachable!("the processor is taken once") };
    monitor::paint_stack();
    CLOCK.start(u32::MAX, false);
    UART0.start(true);
    UART2.start(false);
    SHARED.start(Trace::start(), CLOCK.counted());

    #[allow(unsafe_code, reason = "cortex-m cannot know which priorities the program's critical sections rely on")]
    // SAFETY: all critical sections disable every interrupt, whatever its priority.
    unsafe {
        core.NVIC.set_priority(Irq::Timer0, STEP_PRIORITY);
        core.NVIC.set_priority(Irq::Uart0Receive, SERIAL_PRIORITY);
        core.NVIC.set_priority(Irq::Uart0Transmit, SERIAL_PRIORITY);
        core.SCB.set_priority(SystemHandler::PendSV, FOREGROUND_PRIORITY);
        core.SCB.set_priority(SystemHandler::SysTick, FOREGROUND_PRIORITY);
    }
    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST.set_reload(CLOCK_HZ / 1000 - 1);
    core.SYST.clear_current();
    core.SYST.enable_interrupt();
    core.SYST.enable_counter();
    TIMER0.start(1, true);
    for irq in [Irq::Timer0, Irq::Uart0Receive, Irq::Uart0Transmit] {
        #[allow(unsafe_code, reason = "letting an interrupt in may break a critical section that masks by it")]
        // SAFETY: none does.
        unsafe {
            NVIC::unmask(irq);
        }
    }
    #[cfg(feature = "heap")]
    crate::thread::run(|ended| {
        monitor::report(&ended);
        #[cfg(feature = "scene")]
        drawing::report(&ended);
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
        drawing::serve();
        cortex_m::asm::wfi();
    }
}

/// The step interrupt.
fn step() {
    TIMER0.acknowledge();
    let due = SHARED.tick(CLOCK.counted());
    // What has passed already is due at once.
    let left = due.wrapping_sub(CLOCK.counted());
    TIMER0.expire_in(if (1..=Cadence::LONGEST).contains(&left) { left } else { 1 });
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
fn SysTick() {
    #[cfg(feature = "scene")]
    drawing::tick();
    SCB::set_pendsv();
}

#[exception]
fn PendSV() {
    static mut FOREGROUND: Option<Foreground<Trace, BLOCKS>> = None;

    let foreground = FOREGROUND.get_or_insert_with(|| Foreground::new(&SHARED, Settings::default()));
    let Ok(more) = foreground.turn(&mut { UART0 });
    if more {
        SCB::set_pendsv();
    }
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
