//! WeAct Black Pill: STM32F411CE, Cortex-M4 at 96 MHz with an f32 unit, 512 KB of flash, 128 KB of RAM.
//!
//! # Wiring
//!
//! | pin | direction | to |
//! |---|---|---|
//! | A9 | out | USART1: receiver of the serial adapter (3.3 V), 115,200 baud, 8 bits, no parity |
//! | A10 | in | USART1: transmitter of the serial adapter |
//! | B12, B13, B14 | out | step input of the driver of X, Y, Z: a step is its rising edge |
//! | B15, B10, B9 | out | direction input of the driver of X, Y, Z |
//! | B8 | out | enable inputs of the drivers: low energises |
//! | A1, A2, A3 | in, pulled up | limit switches of X, Y, Z to ground |
//! | B6 | out | signal of the pen's servo, 3.3 V: 50 Hz, pulses of 1 to 2 ms |
//!
//! The servo takes its 5 V from the pin of that name, the drivers their logic supply from 3V3, all grounds meet.
//!
//! # Theory of operation
//!
//! TIM2 counts 32 bits at 96 MHz; its compare channel 1 is the step interrupt. The step pulses begin in one interrupt and end in another, `$0` later; each is one store
//! to the set-and-reset register of port B, which the eight sets of axes have their words for. `$2`, `$3`, `$4` and `$5` invert the signals of the table above. USART1 interrupts for each byte received, and, while something is being sent, when it can take the
//! next. TIM4 makes the servo's pulses. Priorities are those of `penvis_firmware::Shared`.
//!
//! Settings are kept in the second and third sector of the flash, 16 KB each, which the program leaves out. While they are written, which takes up to a second, nothing else happens,
//! and bytes that arrive are lost: senders wait for `ok` after a setting, as with every GRBL.
//!
//! # Build and flash
//!
//! ```text
//! rustup target add thumbv7em-none-eabihf
//! cargo build --profile firmware -p penvis-firmware --bin black-pill --features board-black-pill --target thumbv7em-none-eabihf
//! probe-rs download --chip STM32F411CEUx target/thumbv7em-none-eabihf/firmware/black-pill       # by a debug probe, or by USB,
//! llvm-objcopy -O binary --gap-fill 0xff target/thumbv7em-none-eabihf/firmware/black-pill black-pill.bin
//! # plugged in with BOOT0 held; this forgets the settings:
//! dfu-util -d 0483:df11 -a 0 -s 0x08000000:leave -D black-pill.bin
//! ```
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(all(target_os = "none", feature = "scene"))]
compile_error!("the Black Pill has no memory for stored scenes: build it without the feature `scene`");

#[cfg(target_os = "none")]
mod handover;
#[cfg(target_os = "none")]
mod interrupts;
#[cfg(target_os = "none")]
mod thread_mode;

/// The board is what this is for; a host only checks that it compiles.
#[cfg(not(target_os = "none"))]
fn main() {}

#[cfg(target_os = "none")]
mod board {
    use core::convert::Infallible;

    use cortex_m::peripheral::{NVIC, SCB};
    use cortex_m_rt::{entry, exception};
    use embedded_hal::pwm::SetDutyCycle;
    use embedded_io::{ErrorType, Write, WriteReady};
    use penvis_firmware::{Foreground, Levels, Pen, Port, PortMotors, PortPins, Servo, Shared};
    use stm32f4xx_hal::flash::LockedFlash;
    use stm32f4xx_hal::gpio::PinState;
    use stm32f4xx_hal::nb;
    use stm32f4xx_hal::pac::{self, interrupt};
    use stm32f4xx_hal::prelude::*;
    use stm32f4xx_hal::rcc::{Config, Enable, Reset};
    use stm32f4xx_hal::serial::config::Config as SerialConfig;
    use stm32f4xx_hal::serial::{Rx, RxListen, Serial, Tx, TxListen};
    use stm32f4xx_hal::timer::PwmChannel;

    use super::handover::Handover;
    use super::interrupts::{self, BLOCKS, lies_ahead};
    use super::storage::Storage;
    use super::thread_mode;

    const CRYSTAL_MHZ: u32 = 25;
    const CLOCK_MHZ: u32 = 96;
    const BAUD: u32 = 115_200;

    /// From the bit that sets a pin to the bit that resets it.
    const RESET: u32 = 16;

    static SHARED: Shared<PortMotors<Pins>> = Shared::new();

    static RECEIVER: Handover<Rx<pac::USART1>> = Handover::new();
    static SENDER: Handover<Sender> = Handover::new();
    static STORAGE: Handover<Storage> = Handover::new();

    #[entry]
    fn main() -> ! {
        let (Some(board), Some(core)) = (pac::Peripherals::take(), cortex_m::Peripherals::take()) else {
            unreachable!("the peripherals are taken once")
        };
        // Half of it for the slow bus, whose timers run at twice that.
        let speed = Config::hse(CRYSTAL_MHZ.MHz()).sysclk(CLOCK_MHZ.MHz()).pclk1((CLOCK_MHZ / 2).MHz());
        let mut rcc = board.RCC.freeze(speed);
        let a = board.GPIOA.split(&mut rcc);
        let b = board.GPIOB.split(&mut rcc);

        let config = SerialConfig::default().baudrate(BAUD.bps());
        let Ok(port) = Serial::<_, u8>::new(board.USART1, (a.pa9, a.pa10), config, &mut rcc) else {
            panic!("the serial port cannot have {BAUD} baud")
        };
        let (sender, mut receiver) = port.split();
        receiver.listen();
        RECEIVER.give(receiver);
        SENDER.give(Sender(sender));
        STORAGE.give(Storage(LockedFlash::new(board.FLASH)));

        // From now on all of these pins are driven by their common registers.
        b.pb12.into_push_pull_output_in_state(PinState::Low);
        b.pb13.into_push_pull_output_in_state(PinState::Low);
        b.pb14.into_push_pull_output_in_state(PinState::Low);
        b.pb15.into_push_pull_output_in_state(PinState::Low);
        b.pb10.into_push_pull_output_in_state(PinState::Low);
        b.pb9.into_push_pull_output_in_state(PinState::Low);
        b.pb8.into_push_pull_output_in_state(PinState::High);
        a.pa1.into_pull_up_input();
        a.pa2.into_pull_up_input();
        a.pa3.into_pull_up_input();

        let servo = Servo::default();
        let (_, (channel, ..)) = board.TIM4.pwm_us(u32::from(servo.frame_us).micros(), &mut rcc);
        let mut pwm = channel.with(b.pb6);
        pwm.enable();

        pac::TIM2::enable(&mut rcc);
        pac::TIM2::reset(&mut rcc);
        let timer = board.TIM2;
        #[allow(unsafe_code, reason = "a time is no enumeration")]
        // SAFETY: every time is valid.
        timer.arr().write(|w| unsafe { w.bits(u32::MAX) });
        timer.egr().write(|w| w.ug().update());
        timer.sr().reset();
        timer.dier().write(|w| w.cc1ie().enabled());
        timer.cr1().write(|w| w.cen().enabled());

        SHARED.start(PortMotors::new(Pins { pwm, servo }), now());
        interrupts::start(core, CLOCK_MHZ * 1_000_000, pac::Interrupt::TIM2, &[pac::Interrupt::USART1]);
        thread_mode::run()
    }

    /// Ticks since the start, modulo 2³².
    fn now() -> u32 {
        timer().cnt().read().bits()
    }

    #[allow(unsafe_code, reason = "the timer has no other owner once it runs")]
    fn timer() -> &'static pac::tim2::RegisterBlock {
        // SAFETY: the registers exist; after the start only the step interrupt writes to them.
        unsafe { &*pac::TIM2::ptr() }
    }

    /// Sets the pins of port B in the lower half of `word`, and resets those in its upper half.
    fn drive(word: u32) {
        #[allow(
            unsafe_code,
            reason = "a word of pins is no enumeration, and the register has no other owner once they are outputs"
        )]
        // SAFETY: the register exists and every word is valid; it is one store, so nobody else's pins change.
        unsafe {
            (*pac::GPIOB::ptr()).bsrr().write(|w| w.bits(word));
        }
    }

    /// A change of pins as the register takes it.
    fn word(levels: Levels) -> u32 {
        levels.high | levels.low << RESET
    }

    /// The pins of port B, and for the limit switches those of port A.
    struct Pins {
        pwm: PwmChannel<pac::TIM4, 0>,
        servo: Servo,
    }

    impl Port for Pins {
        const TICKS_PER_US: u32 = CLOCK_MHZ;
        const PINS: PortPins = PortPins {
            step: [1 << 12, 1 << 13, 1 << 14],
            direction: [1 << 15, 1 << 10, 1 << 9],
            enable: 1 << 8,
            limit: [1 << 1, 1 << 2, 1 << 3],
        };

        type Word = u32;

        fn word(levels: Levels) -> u32 {
            word(levels)
        }

        #[inline]
        fn drive(&mut self, word: u32) {
            drive(word);
        }

        fn levels(&mut self) -> u32 {
            #[allow(unsafe_code, reason = "the port has no owner")]
            // SAFETY: the register exists, and reading it does nothing else.
            unsafe {
                (*pac::GPIOA::ptr()).idr().read().bits()
            }
        }

        fn set_pen(&mut self, pen: Pen) {
            let Ok(()) = self.pwm.set_duty_cycle(self.servo.pulse_us(pen));
        }

        fn note_release(&mut self, levels: Levels) {
            thread_mode::note_release(levels);
        }
    }

    #[interrupt]
    fn TIM2() {
        timer().sr().write(|w| w.cc1if().clear());
        let due = SHARED.tick(now());
        #[allow(unsafe_code, reason = "a time is no enumeration")]
        // SAFETY: every time is valid.
        timer().ccr1().write(|w| unsafe { w.bits(due) });
        // The channel compares for equality only.
        if !lies_ahead(due, now()) {
            NVIC::pend(pac::Interrupt::TIM2);
        }
    }

    /// The sending half, which interrupts when it can take another byte: it has room for one only.
    struct Sender(Tx<pac::USART1>);

    impl ErrorType for Sender {
        type Error = Infallible;
    }

    impl WriteReady for Sender {
        fn write_ready(&mut self) -> Result<bool, Infallible> {
            Ok(self.0.is_tx_empty())
        }
    }

    impl Write for Sender {
        /// Takes one byte, or waits until it can.
        fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
            let Some(&byte) = bytes.first() else { return Ok(0) };
            while !self.0.is_tx_empty() {}
            #[allow(unsafe_code, reason = "a byte is no enumeration")]
            // SAFETY: only the owner of the sending half writes to this register.
            unsafe {
                (*pac::USART1::ptr()).dr().write(|w| w.dr().bits(byte.into()));
            }
            self.0.listen();
            Ok(1)
        }

        fn flush(&mut self) -> Result<(), Infallible> {
            while !self.0.is_tx_empty() {}
            Ok(())
        }
    }

    #[interrupt]
    fn USART1() {
        static mut PORT: Option<Rx<pac::USART1>> = None;

        let Some(port) = RECEIVER.owned(PORT) else { return };
        // A byte with an error of framing, or the one after an overrun, is no byte; the line it belonged to will not make sense, and be refused. An error must be read
        // even if there is no byte with it, or it goes on calling.
        loop {
            match port.read() {
                Ok(byte) => SHARED.receive(byte),
                Err(nb::Error::Other(_)) => (),
                Err(nb::Error::WouldBlock) => break,
            }
        }
        // Whether it was this or the sender that called: the foreground has the sender call again when it has given it a byte.
        #[allow(unsafe_code, reason = "the control register is shared with the sending half")]
        // SAFETY: the foreground changes it too, and may be in between its read and its write now; all it does is to set the bit that is cleared here, which makes for one
        // call more than needed.
        unsafe {
            (*pac::USART1::ptr()).cr1().modify(|_, w| w.txeie().disabled());
        }
        SCB::set_pendsv();
    }

    #[exception]
    fn PendSV() {
        static mut FOREGROUND: Option<Foreground<PortMotors<Pins>, BLOCKS, Storage>> = None;
        static mut PORT: Option<Sender> = None;

        interrupts::turn(&SHARED, FOREGROUND, &STORAGE, PORT, &SENDER);
    }

    /// Pen up, motors released by these levels: after a panic, with the interrupts held off.
    pub(crate) fn rest(release: Levels) {
        drive(word(release));
        #[allow(unsafe_code, reason = "whoever owned the servo will not run any more")]
        // SAFETY: the register exists, and every width is valid.
        unsafe {
            (*pac::TIM4::ptr()).ccr1().write(|w| w.ccr().bits(Servo::default().rest_us));
        }
    }
}

/// Two sectors of the flash as storage.
#[cfg(target_os = "none")]
mod storage {
    use embedded_storage::nor_flash::{
        ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
    };
    use stm32f4xx_hal::flash::{FlashExt, LockedFlash};

    /// The sectors' numbers and place: the linker's script has the program begin after them.
    const SECTORS: [u8; 2] = [1, 2];
    const SECTOR: u32 = 16 * 1024;
    const OFFSET: u32 = SECTOR;

    /// The two sectors.
    pub(crate) struct Storage(pub(crate) LockedFlash);

    impl ErrorType for Storage {
        type Error = NorFlashErrorKind;
    }

    impl ReadNorFlash for Storage {
        const READ_SIZE: usize = 1;

        fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
            check_read(self, offset, bytes.len())?;
            ReadNorFlash::read(&mut self.0, OFFSET + offset, bytes).map_err(|_| NorFlashErrorKind::Other)
        }

        fn capacity(&self) -> usize {
            SECTORS.len() * SECTOR as usize
        }
    }

    impl NorFlash for Storage {
        const WRITE_SIZE: usize = 4;
        const ERASE_SIZE: usize = SECTOR as usize;

        fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
            check_erase(self, from, to)?;
            for (sector, start) in SECTORS.into_iter().zip((0..).step_by(SECTOR as usize)) {
                if (from..to).contains(&start) {
                    self.0.unlocked().erase(sector).map_err(|_| NorFlashErrorKind::Other)?;
                }
            }
            Ok(())
        }

        fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
            check_write(self, offset, bytes.len())?;
            let place = (OFFSET + offset) as usize;
            self.0.unlocked().program(place, bytes.iter()).map_err(|_| NorFlashErrorKind::Other)
        }
    }
}
