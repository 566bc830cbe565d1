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
//! The 64-bit timer counts µs; its alarm 0 is the step interrupt. The step pulses begin in one interrupt and end in another, `$0` later; each is a store to the set and one to the
//! clear register of the pins, which the eight sets of axes have their words for. `$2`, `$3`, `$4` and `$5` invert the signals of the table above. UART0 interrupts when its FIFO has bytes; what is to be sent goes out in pieces of its
//! 32 bytes, a millisecond apart at most. Priorities are those of `penvis_firmware::Shared`. The second processor sleeps.
//!
//! Settings are kept in the last 8 KB of the 2 MB of flash. While they are written, which takes some tenths of a second, nothing else happens, and bytes that arrive are lost: senders
//! wait for `ok` after a setting, as with every GRBL.
//!
//! With the features `heap,scene`, an image that is untried and that the checks do not build, it draws stored scenes by itself (`penvis pack`, `$PV=`): 168 KB of RAM are for that, and 24 KB for a scene that is sent. One of up to 64 KB can lie
//! in the flash, at 0x101ee000, put there with or after the firmware; then `$PV=DRAW` draws it.
//!
//! # Build and flash
//!
//! ```text
//! rustup target add thumbv6m-none-eabi
//! cargo build --profile firmware -p penvis-firmware --bin pico --features board-pico --target thumbv6m-none-eabi
//! probe-rs download --chip RP2040 target/thumbv6m-none-eabi/firmware/pico       # by a debug probe, or:
//! picotool load -x -t elf target/thumbv6m-none-eabi/firmware/pico               # by USB, plugged in with BOOTSEL held, or:
//! cargo run -p penvis-firmware --example uf2 -- target/thumbv6m-none-eabi/firmware/pico pico.uf2     # and copied to the drive that it then is
//! # With stored scenes, and one in the flash:
//! cargo build --profile firmware -p penvis-firmware --bin pico --features board-pico,heap,scene --target thumbv6m-none-eabi
//! penvis pack saddle -o scene.bin
//! picotool load -x -t bin scene.bin -o 0x101ee000
//! probe-rs download --chip RP2040 --binary-format bin --base-address 0x101ee000 scene.bin
//! ```
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(all(target_os = "none", feature = "scene"))]
mod drawing;
#[cfg(target_os = "none")]
mod handover;
#[cfg(all(target_os = "none", feature = "scene"))]
mod heap;
#[cfg(target_os = "none")]
mod interrupts;
#[cfg(all(target_os = "none", feature = "scene"))]
mod thread;
#[cfg(target_os = "none")]
mod thread_mode;
#[cfg(all(target_os = "none", feature = "scene"))]
use board::{HEAP, SCENE_BYTES, SHARED};

/// The board is what this is for; a host only checks that it compiles.
#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
mod board {
    use cortex_m::peripheral::{NVIC, SCB};
    use cortex_m_rt::exception;
    use embedded_hal::pwm::SetDutyCycle;
    use embedded_io::{Read, ReadReady};
    use penvis_firmware::{Foreground, Levels, Pen, Port, PortMotors, PortPins, Servo, Shared};
    use rp2040_hal::clocks::{Clock, init_clocks_and_plls};
    use rp2040_hal::fugit::RateExtU32;
    use rp2040_hal::gpio::bank0::{Gpio0, Gpio1};
    use rp2040_hal::gpio::{FunctionUart, Pin, PinState, PullDown};
    use rp2040_hal::pac::{self, interrupt};
    use rp2040_hal::pwm::{FreeRunning, Pwm7, Slice, Slices};
    use rp2040_hal::uart::{DataBits, Reader, StopBits, UartConfig, UartPeripheral, Writer};
    use rp2040_hal::{Sio, Watchdog};

    use super::handover::Handover;
    use super::interrupts::{self, BLOCKS, lies_ahead};
    use super::storage::Storage;
    use super::thread_mode;

    const CRYSTAL_HZ: u32 = 12_000_000;
    const BAUD: u32 = 115_200;

    /// Has the servo's PWM count µs.
    const SERVO_DIVIDER: u8 = 125;
    const SERVO_SLICE: usize = 7;

    /// What the ROM loads first: it sets up the flash.
    #[unsafe(link_section = ".boot2")]
    #[used]
    #[allow(unsafe_code, reason = "the ROM finds it by its place")]
    static BOOT2: [u8; 256] = rp2040_boot2::BOOT_LOADER_W25Q080;

    type UartPins = (Pin<Gpio0, FunctionUart, PullDown>, Pin<Gpio1, FunctionUart, PullDown>);

    pub(crate) static SHARED: Shared<PortMotors<Pins>> = Shared::new();

    /// Memory for what thread mode computes.
    #[cfg(feature = "scene")]
    #[global_allocator]
    pub(crate) static HEAP: crate::heap::Heap<{ 168 * 1024 }> = crate::heap::Heap::new();

    /// Room for a scene that is sent.
    #[cfg(feature = "scene")]
    pub(crate) const SCENE_BYTES: usize = 24 * 1024;

    static RECEIVER: Handover<Reader<pac::UART0, UartPins>> = Handover::new();
    static SENDER: Handover<Writer<pac::UART0, UartPins>> = Handover::new();
    static STORAGE: Handover<Storage> = Handover::new();

    #[rp2040_hal::entry]
    fn main() -> ! {
        let (Some(mut board), Some(core)) = (pac::Peripherals::take(), cortex_m::Peripherals::take()) else {
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
        STORAGE.give(Storage);

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
        SHARED.start(PortMotors::new(Pins { pwm: slices.pwm7, servo }), now());
        timer().inte().modify(|_, w| w.alarm_0().set_bit());
        let clock_hz = clocks.system_clock.freq().to_Hz();
        interrupts::start(core, clock_hz, pac::Interrupt::TIMER_IRQ_0, &[pac::Interrupt::UART0_IRQ]);
        thread_mode::run()
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

    /// The pins as a port.
    pub(crate) struct Pins {
        pwm: Slice<Pwm7, FreeRunning>,
        servo: Servo,
    }

    impl Port for Pins {
        const PINS: PortPins = PortPins {
            step: [1 << 2, 1 << 4, 1 << 6],
            direction: [1 << 3, 1 << 5, 1 << 7],
            enable: 1 << 8,
            limit: [1 << 10, 1 << 11, 1 << 12],
        };

        type Word = Levels;

        fn word(levels: Levels) -> Levels {
            levels
        }

        #[inline]
        fn drive(&mut self, word: Levels) {
            set(word.high);
            clear(word.low);
        }

        fn levels(&mut self) -> u32 {
            pins().gpio_in().read().bits()
        }

        fn set_pen(&mut self, pen: Pen) {
            let Ok(()) = self.pwm.channel_a.set_duty_cycle(self.servo.pulse_us(pen));
        }

        fn note_release(&mut self, levels: Levels) {
            thread_mode::note_release(levels);
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
        if !lies_ahead(due, now()) {
            NVIC::pend(pac::Interrupt::TIMER_IRQ_0);
        }
    }

    #[interrupt]
    fn UART0_IRQ() {
        static mut PORT: Option<Reader<pac::UART0, UartPins>> = None;

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
    fn PendSV() {
        static mut FOREGROUND: Option<Foreground<PortMotors<Pins>, BLOCKS, Storage>> = None;
        static mut PORT: Option<Writer<pac::UART0, UartPins>> = None;

        interrupts::turn(&SHARED, FOREGROUND, &STORAGE, PORT, &SENDER);
    }

    /// Pen up, motors released by these levels: after a panic, with the interrupts held off.
    pub(crate) fn rest(release: Levels) {
        set(release.high);
        clear(release.low);
        #[allow(unsafe_code, reason = "whoever owned the servo will not run any more")]
        // SAFETY: the register exists, and every width is valid.
        unsafe {
            (*pac::PWM::ptr()).ch(SERVO_SLICE).cc().write(|w| w.a().bits(Servo::default().rest_us));
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
