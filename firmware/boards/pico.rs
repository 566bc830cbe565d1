//! Raspberry Pi Pico: RP2040, Cortex-M0+ at 125 MHz without floating point, 264 KB of RAM.
//!
//! # Wiring
//!
//! | pin | GPIO | direction | to |
//! |---|---|---|---|
//! | 1 | 0 | out | UART0: receiver of the serial adapter (3.3 V), 115,200 baud, 8 bits, no parity |
//! | 2 | 1 | in | UART0: transmitter of the serial adapter |
//! | 4, 6, 9 | 2, 4, 6 | out | step input of the driver of X, Y, Z: a step is its rising edge |
//! | 5, 7, 10 | 3, 5, 7 | out | direction input of the driver of X, Y, Z |
//! | 11 | 8 | out | enable inputs of the drivers: low energises |
//! | 14, 15, 16 | 10, 11, 12 | in, pulled up | limit switches of X, Y, Z to ground |
//! | 19 | 14 | out | signal of the pen's servo: 50 Hz, pulses of 1 to 2 ms |
//!
//! The servo takes its 5 V from VBUS (pin 40), the drivers their logic supply from 3V3 (pin 36), all grounds meet. A debug probe's serial
//! port is such an adapter.
//!
//! # Theory of operation
//!
//! The 64-bit timer counts µs; its alarm 0 is the step interrupt. The step pulses begin in one interrupt and end in another, `$0` later; each is one store to the
//! set or clear register of the pins, which the eight sets of axes have their words for. UART0 interrupts when its FIFO has bytes; what is to be sent goes out in pieces of its
//! 32 bytes, a millisecond apart at most. Priorities are those of `penvis_firmware::Shared`. The second processor sleeps.
//!
//! Settings are kept in the last 8 KB of the 2 MB of flash. While they are written, which takes some tenths of a second, nothing else happens, and bytes that arrive are lost: senders
//! wait for `ok` after a setting, as with every GRBL.
//!
//! # Build and flash
//!
//! ```text
//! rustup target add thumbv6m-none-eabi
//! cargo build --profile firmware -p penvis-firmware --bin pico --features board-pico --target thumbv6m-none-eabi
//! probe-rs download --chip RP2040 target/thumbv6m-none-eabi/firmware/pico       # by a debug probe, or:
//! picotool load -x -t elf target/thumbv6m-none-eabi/firmware/pico               # by USB, plugged in with BOOTSEL held, or:
//! cargo run -p penvis-firmware --example uf2 -- target/thumbv6m-none-eabi/firmware/pico pico.uf2     # and copied to the drive that it then is
//! ```
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod handover;

/// The board is what this is for; a host only checks that it compiles.
#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
mod board {
    use cortex_m::peripheral::scb::SystemHandler;
    use cortex_m::peripheral::syst::SystClkSource;
    use cortex_m::peripheral::{NVIC, SCB};
    use cortex_m_rt::exception;
    use embedded_hal::pwm::SetDutyCycle;
    use embedded_io::{Read, ReadReady};
    use penvis_firmware::{Axes, Cadence, Foreground, Hardware, Pen, Servo, Settings, Shared, Wiring};
    use rp2040_hal::clocks::{Clock, init_clocks_and_plls};
    use rp2040_hal::fugit::RateExtU32;
    use rp2040_hal::gpio::bank0::{Gpio0, Gpio1};
    use rp2040_hal::gpio::{FunctionUart, Pin, PinState, PullDown};
    use rp2040_hal::pac::{self, interrupt};
    use rp2040_hal::pwm::{FreeRunning, Pwm7, Slice, Slices};
    use rp2040_hal::uart::{DataBits, Reader, StopBits, UartConfig, UartPeripheral, Writer};
    use rp2040_hal::{Sio, Watchdog};

    use super::handover::Handover;
    use super::storage::Storage;

    const CRYSTAL_HZ: u32 = 12_000_000;
    const BAUD: u32 = 115_200;

    /// Blocks the planner looks ahead.
    const BLOCKS: usize = 64;

    /// Pins by axis, as bits of the registers.
    const STEP: [u32; 3] = [1 << 2, 1 << 4, 1 << 6];
    const DIRECTION: [u32; 3] = [1 << 3, 1 << 5, 1 << 7];
    const LIMIT: [u32; 3] = [1 << 10, 1 << 11, 1 << 12];
    const ENABLE: u32 = 1 << 8;

    /// Priorities, of which the upper 2 bits count: lower is more urgent.
    const STEP_PRIORITY: u8 = 0x00;
    const SERIAL_PRIORITY: u8 = 0x40;
    const FOREGROUND_PRIORITY: u8 = 0xc0;

    /// Has the servo's PWM count µs.
    const SERVO_DIVIDER: u8 = 125;
    const SERVO_SLICE: usize = 7;

    /// What the ROM loads first: it sets up the flash.
    #[unsafe(link_section = ".boot2")]
    #[used]
    #[allow(unsafe_code, reason = "the ROM finds it by its place")]
    static BOOT2: [u8; 256] = rp2040_boot2::BOOT_LOADER_W25Q080;

    type PortPins = (Pin<Gpio0, FunctionUart, PullDown>, Pin<Gpio1, FunctionUart, PullDown>);

    static SHARED: Shared<Motors> = Shared::new();

    static RECEIVER: Handover<Reader<pac::UART0, PortPins>> = Handover::new();
    static SENDER: Handover<Writer<pac::UART0, PortPins>> = Handover::new();

    #[rp2040_hal::entry]
    fn main() -> ! {
        let (Some(mut board), Some(mut core)) = (pac::Peripherals::take(), cortex_m::Peripherals::take()) else {
            unreachable!("the peripherals are taken once")
        };
        let mut watchdog = Watchdog::new(board.WATCHDOG);
        let Ok(clocks) = init_clocks_and_plls(
            CRYSTAL_HZ,
            board.XOSC,
            board.CLOCKS,
            board.PLL_SYS,
            board.PLL_USB,
            &mut board.RESETS,
            &mut watchdog,
        ) else {
            panic!("the clocks do not start: is the crystal one of 12 MHz?")
        };
        let sio = Sio::new(board.SIO);
        let pins = rp2040_hal::gpio::Pins::new(board.IO_BANK0, board.PADS_BANK0, sio.gpio_bank0, &mut board.RESETS);

        let port = UartPeripheral::new(
            board.UART0,
            (pins.gpio0.into_function(), pins.gpio1.into_function()),
            &mut board.RESETS,
        );
        let config = UartConfig::new(BAUD.Hz(), DataBits::Eight, None, StopBits::One);
        let Ok(port) = port.enable(config, clocks.peripheral_clock.freq()) else {
            panic!("the serial port cannot have {BAUD} baud")
        };
        let (mut receiver, sender) = port.split();
        receiver.enable_rx_interrupt();
        RECEIVER.give(receiver);
        SENDER.give(sender);

        // From now on all of these pins are driven by their common registers.
        pins.gpio2.into_push_pull_output_in_state(PinState::Low);
        pins.gpio3.into_push_pull_output_in_state(PinState::Low);
        pins.gpio4.into_push_pull_output_in_state(PinState::Low);
        pins.gpio5.into_push_pull_output_in_state(PinState::Low);
        pins.gpio6.into_push_pull_output_in_state(PinState::Low);
        pins.gpio7.into_push_pull_output_in_state(PinState::Low);
        pins.gpio8.into_push_pull_output_in_state(PinState::High);
        pins.gpio10.into_pull_up_input();
        pins.gpio11.into_pull_up_input();
        pins.gpio12.into_pull_up_input();

        let mut slices = Slices::new(board.PWM, &mut board.RESETS);
        let servo = Servo::default();
        slices.pwm7.set_div_int(SERVO_DIVIDER);
        slices.pwm7.set_top(servo.frame_us - 1);
        slices.pwm7.enable();
        slices.pwm7.channel_a.output_to(pins.gpio14);

        // Out of its reset; from then on it is used by its registers.
        rp2040_hal::Timer::new(board.TIMER, &mut board.RESETS, &clocks);
        SHARED.start(Motors { pwm: slices.pwm7, servo, words: [0; 8], wiring: Wiring::default() }, now());
        timer().inte().modify(|_, w| w.alarm_0().set_bit());

        #[allow(unsafe_code, reason = "cortex-m cannot know which priorities the program's critical sections rely on")]
        // SAFETY: all critical sections disable every interrupt, whatever its priority.
        unsafe {
            core.NVIC.set_priority(pac::Interrupt::TIMER_IRQ_0, STEP_PRIORITY);
            core.NVIC.set_priority(pac::Interrupt::UART0_IRQ, SERIAL_PRIORITY);
            core.SCB.set_priority(SystemHandler::PendSV, FOREGROUND_PRIORITY);
            core.SCB.set_priority(SystemHandler::SysTick, FOREGROUND_PRIORITY);
        }
        core.SYST.set_clock_source(SystClkSource::Core);
        core.SYST.set_reload(clocks.system_clock.freq().to_Hz() / 1000 - 1);
        core.SYST.clear_current();
        core.SYST.enable_interrupt();
        core.SYST.enable_counter();
        for irq in [pac::Interrupt::TIMER_IRQ_0, pac::Interrupt::UART0_IRQ] {
            #[allow(unsafe_code, reason = "letting an interrupt in may break a critical section that masks by it")]
            // SAFETY: none does.
            unsafe {
                NVIC::unmask(irq);
            }
        }
        NVIC::pend(pac::Interrupt::TIMER_IRQ_0);
        loop {
            cortex_m::asm::wfi();
        }
    }

    /// µs since the start, modulo 2³².
    fn now() -> u32 {
        timer().timerawl().read().bits()
    }

    #[allow(unsafe_code, reason = "the timer has no other owner once it runs")]
    fn timer() -> &'static pac::timer::RegisterBlock {
        // SAFETY: the registers exist; after the start only the step interrupt writes to them.
        unsafe { &*pac::TIMER::ptr() }
    }

    #[allow(unsafe_code, reason = "the pins' common registers have no other owner once they are outputs")]
    fn pins() -> &'static pac::sio::RegisterBlock {
        // SAFETY: the registers exist; setting and clearing bits is one store, so nobody else's pins change.
        unsafe { &*pac::SIO::ptr() }
    }

    fn set(word: u32) {
        #[allow(unsafe_code, reason = "a word of pins is no enumeration")]
        // SAFETY: every word is valid.
        pins().gpio_out_set().write(|w| unsafe { w.bits(word) });
    }

    fn clear(word: u32) {
        #[allow(unsafe_code, reason = "as above")]
        // SAFETY: every word is valid.
        pins().gpio_out_clr().write(|w| unsafe { w.bits(word) });
    }

    /// The bits of `axes` among the pins of three axes.
    fn word(of: [u32; 3], axes: Axes) -> u32 {
        (0..3).filter(|&axis| axes.contains(axis)).map(|axis| of[axis]).sum()
    }

    struct Motors {
        pwm: Slice<Pwm7, FreeRunning>,
        servo: Servo,
        /// Step pins of each set of axes.
        words: [u32; 8],
        wiring: Wiring,
    }

    impl Hardware for Motors {
        const TICKS_PER_US: u32 = 1;
        const TICK_ENDS_PULSE: bool = true;

        fn set_directions(&mut self, negative: Axes) {
            let high = Axes::from_bits(negative.bits() ^ self.wiring.invert_directions.bits());
            set(word(DIRECTION, high));
            clear(word(DIRECTION, Axes::from_bits(!high.bits())));
        }

        #[inline]
        fn step(&mut self, axes: Axes) {
            set(self.words[usize::from(axes.bits() & 7)]);
        }

        #[inline]
        fn end_step(&mut self) {
            clear(self.words[7]);
        }

        fn set_pen(&mut self, pen: Pen) {
            let Ok(()) = self.pwm.channel_a.set_duty_cycle(self.servo.pulse_us(pen));
        }

        fn enable_motors(&mut self, on: bool) {
            if on { clear(ENABLE) } else { set(ENABLE) }
        }

        fn limits(&mut self) -> Axes {
            let level = pins().gpio_in().read().bits();
            let mut closed = Axes::NONE;
            for (axis, pin) in LIMIT.into_iter().enumerate() {
                if level & pin == 0 {
                    closed.insert(axis);
                }
            }
            closed
        }

        fn configure(&mut self, wiring: Wiring) {
            self.wiring = wiring;
            for bits in 0..8 {
                self.words[usize::from(bits)] = word(STEP, Axes::from_bits(bits));
            }
        }
    }

    #[interrupt]
    fn TIMER_IRQ_0() {
        timer().intr().write(|w| w.alarm_0().clear_bit_by_one());
        let due = SHARED.tick(now());
        #[allow(unsafe_code, reason = "a time is no enumeration")]
        // SAFETY: every time is valid.
        timer().alarm0().write(|w| unsafe { w.bits(due) });
        // The alarm goes off only at its very µs.
        if !(1..=Cadence::LONGEST).contains(&due.wrapping_sub(now())) {
            NVIC::pend(pac::Interrupt::TIMER_IRQ_0);
        }
    }

    #[interrupt]
    fn UART0_IRQ() {
        static mut PORT: Option<Reader<pac::UART0, PortPins>> = None;

        let Some(port) = RECEIVER.owned(PORT) else { return };
        let mut byte = [0];
        while port.read_ready().is_ok_and(|ready| ready) {
            // A byte with an error of framing or parity is no byte; the line it belonged to will not make sense, and be refused.
            if let Ok(1) = port.read(&mut byte) {
                SHARED.receive(byte[0]);
            }
        }
        SCB::set_pendsv();
    }

    #[exception]
    fn SysTick() {
        SCB::set_pendsv();
    }

    #[exception]
    fn PendSV() {
        static mut FOREGROUND: Option<Foreground<Motors, BLOCKS, Storage>> = None;
        static mut PORT: Option<Writer<pac::UART0, PortPins>> = None;

        let Some(port) = SENDER.owned(PORT) else { return };
        let foreground =
            FOREGROUND.get_or_insert_with(|| Foreground::with_storage(&SHARED, Settings::default(), Storage));
        let Ok(more) = foreground.turn(port);
        if more {
            SCB::set_pendsv();
        }
    }

    /// Pen up, motors released. The watchdog is not used, since a machine that has lost its place must not go on.
    #[panic_handler]
    fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
        cortex_m::interrupt::disable();
        set(ENABLE);
        #[allow(unsafe_code, reason = "whoever owned the servo will not run any more")]
        // SAFETY: the register exists, and every width is valid.
        unsafe {
            (*pac::PWM::ptr()).ch(SERVO_SLICE).cc().write(|w| w.a().bits(Servo::default().rest_us));
        }
        loop {
            cortex_m::asm::wfi();
        }
    }
}

/// The end of the flash as storage.
#[cfg(target_os = "none")]
mod storage {
    #![allow(unsafe_code, reason = "flash is programmed by functions of the ROM while nothing else may read it")]

    use core::mem::transmute;

    use embedded_storage::nor_flash::{
        ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
    };
    use rp2040_hal::rom_data;

    /// Where flash can be read, and how much of it there is.
    const FLASH: usize = 0x1000_0000;
    const FLASH_BYTES: u32 = 2 << 20;

    /// Two slots of a sector each.
    const BYTES: u32 = 2 * SECTOR;
    const SECTOR: u32 = 4096;
    const PAGE: usize = 256;
    const OFFSET: u32 = FLASH_BYTES - BYTES;

    /// Erases 64 KB at once, where there are as many.
    const BLOCK_BYTES: u32 = 1 << 16;
    const BLOCK_ERASE: u8 = 0xd8;

    /// The second stage's length in words.
    const BOOT2_WORDS: usize = 64;

    /// The sectors at the end of the flash.
    #[derive(Debug)]
    pub(crate) struct Storage;

    impl ErrorType for Storage {
        type Error = NorFlashErrorKind;
    }

    impl ReadNorFlash for Storage {
        const READ_SIZE: usize = 1;

        fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
            check_read(self, offset, bytes.len())?;
            let from = (FLASH + (OFFSET + offset) as usize) as *const u8;
            for (k, byte) in bytes.iter_mut().enumerate() {
                // SAFETY: within the flash, which is memory to read. Volatile, since it changes behind the compiler's back.
                *byte = unsafe { from.add(k).read_volatile() };
            }
            Ok(())
        }

        fn capacity(&self) -> usize {
            BYTES as usize
        }
    }

    impl NorFlash for Storage {
        const WRITE_SIZE: usize = PAGE;
        const ERASE_SIZE: usize = SECTOR as usize;

        fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
            check_erase(self, from, to)?;
            change(&Change::Erase { offset: OFFSET + from, bytes: (to - from) as usize });
            Ok(())
        }

        fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
            check_write(self, offset, bytes.len())?;
            for (offset, bytes) in (OFFSET + offset..).step_by(PAGE).zip(bytes.chunks_exact(PAGE)) {
                // A copy, which certainly does not lie in flash.
                let mut page = [0; PAGE];
                page.copy_from_slice(bytes);
                change(&Change::Program { offset, page: &page });
            }
            Ok(())
        }
    }

    enum Change<'a> {
        Erase { offset: u32, bytes: usize },
        Program { offset: u32, page: &'a [u8; PAGE] },
    }

    /// Functions of the ROM, looked up while flash can still be read.
    struct Rom {
        connect: unsafe extern "C" fn(),
        leave_reading: unsafe extern "C" fn(),
        erase: unsafe extern "C" fn(u32, usize, u32, u8),
        program: unsafe extern "C" fn(u32, *const u8, usize),
        flush_cache: unsafe extern "C" fn(),
    }

    fn change(what: &Change<'_>) {
        let rom = Rom {
            connect: rom_data::connect_internal_flash::ptr(),
            leave_reading: rom_data::flash_exit_xip::ptr(),
            erase: rom_data::flash_range_erase::ptr(),
            program: rom_data::flash_range_program::ptr(),
            flush_cache: rom_data::flash_flush_cache::ptr(),
        };
        let mut boot2 = [0; BOOT2_WORDS];
        for (k, word) in boot2.iter_mut().enumerate() {
            // SAFETY: the first 256 bytes of flash are the second stage.
            *word = unsafe { (FLASH as *const u32).add(k).read_volatile() };
        }
        // SAFETY: no interrupt comes now, the second processor sleeps in its ROM and nothing uses DMA, so that nothing reads flash; the offsets have been checked.
        critical_section::with(|_| unsafe { change_unread(what, &rom, &boot2) });
    }

    /// Does it, and has the second stage make flash readable again, by a copy of it.
    ///
    /// # Safety
    /// Nothing else reads flash meanwhile, the offsets are within the storage, and `boot2` is the second stage.
    #[inline(never)]
    #[unsafe(link_section = ".data.change_unread")]
    unsafe fn change_unread(what: &Change<'_>, rom: &Rom, boot2: &[u32; BOOT2_WORDS]) {
        // SAFETY: this is the order of the data sheet (RP2040, 2.8.3.1.3), and this function lies in RAM. The second stage is Thumb code that does not depend on its place and
        // returns to whoever calls it.
        unsafe {
            (rom.connect)();
            (rom.leave_reading)();
            match what {
                Change::Erase { offset, bytes } => (rom.erase)(*offset, *bytes, BLOCK_BYTES, BLOCK_ERASE),
                Change::Program { offset, page } => (rom.program)(*offset, page.as_ptr(), PAGE),
            }
            (rom.flush_cache)();
            let read_again: extern "C" fn() = transmute(boot2.as_ptr().cast::<u8>().wrapping_add(1));
            read_again();
        }
    }
}
