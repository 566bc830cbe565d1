//! What the interrupts of all boards have in common: see `penvis_firmware::Shared` for which there are.

use cortex_m::interrupt::InterruptNumber;
use cortex_m::peripheral::scb::SystemHandler;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{NVIC, SCB};
use cortex_m_rt::exception;
use embedded_io::{Write, WriteReady};
use embedded_storage::nor_flash::NorFlash;
use penvis_firmware::{Cadence, Foreground, Hardware, Settings, Shared};

use crate::handover::Handover;

/// Blocks the planner looks ahead.
pub(crate) const BLOCKS: usize = 64;

/// Priorities, of which the upper 2 bits count on a Cortex-M0+, the upper 3 or 4 on others: lower is more urgent.
const STEP_PRIORITY: u8 = 0x00;
const SERIAL_PRIORITY: u8 = 0x40;
const FOREGROUND_PRIORITY: u8 = 0xc0;

/// Lets the interrupts in: the step timer's, due now, the serial port's, and that of each millisecond, by a clock of `clock_hz`.
pub(crate) fn start<I: InterruptNumber>(mut core: cortex_m::Peripherals, clock_hz: u32, step: I, serial: &[I]) {
    #[allow(unsafe_code, reason = "cortex-m cannot know which priorities the program's critical sections rely on")]
    // SAFETY: all critical sections disable every interrupt, whatever its priority.
    unsafe {
        core.NVIC.set_priority(step, STEP_PRIORITY);
        for port in serial {
            core.NVIC.set_priority(*port, SERIAL_PRIORITY);
        }
        core.SCB.set_priority(SystemHandler::PendSV, FOREGROUND_PRIORITY);
        core.SCB.set_priority(SystemHandler::SysTick, FOREGROUND_PRIORITY);
    }
    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST.set_reload(clock_hz / 1000 - 1);
    core.SYST.clear_current();
    core.SYST.enable_interrupt();
    core.SYST.enable_counter();
    for irq in serial.iter().copied().chain([step]) {
        #[allow(unsafe_code, reason = "letting an interrupt in may break a critical section that masks by it")]
        // SAFETY: none does.
        unsafe {
            NVIC::unmask(irq);
        }
    }
    NVIC::pend(step);
}

/// Whether the timer, whose counter shows `now`, has not come to `due` yet: else the interrupt must be pended.
pub(crate) fn lies_ahead(due: u32, now: u32) -> bool {
    (1..=Cadence::LONGEST).contains(&due.wrapping_sub(now))
}

/// The lowest interrupt. What it owns is made or taken over the first time.
pub(crate) fn turn<H: Hardware, F: NorFlash, S: Write + WriteReady>(
    shared: &'static Shared<H>,
    foreground: &mut Option<Foreground<H, BLOCKS, F>>,
    storage: &Handover<F>,
    port: &mut Option<S>,
    sender: &Handover<S>,
) {
    if foreground.is_none() {
        *foreground = storage.take().map(|flash| Foreground::with_storage(shared, Settings::default(), flash));
    }
    let (Some(foreground), Some(port)) = (foreground, sender.owned(port)) else { return };
    // A port that fails has lost a byte; whoever waits for the answer will see that.
    if foreground.turn(port).unwrap_or(false) {
        SCB::set_pendsv();
    }
}

#[exception]
fn SysTick() {
    #[cfg(feature = "scene")]
    crate::drawing::tick();
    SCB::set_pendsv();
}
