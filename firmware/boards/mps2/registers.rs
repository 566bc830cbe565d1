//! The peripherals of Arm's Cortex-M System Design Kit (DDI 0479): the timer and the serial port, by their registers.
#![allow(unsafe_code, reason = "registers are memory at fixed addresses")]

use core::convert::Infallible;

use cortex_m::interrupt::InterruptNumber;
use embedded_io::{ErrorType, Write, WriteReady};

/// Interrupts of the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u16)]
pub(crate) enum Irq {
    Uart0Receive = 0,
    Uart0Transmit = 1,
    Timer0 = 8,
}

// SAFETY: the numbers are distinct, fixed, and within the 32 that the images have.
unsafe impl InterruptNumber for Irq {
    fn number(self) -> u16 {
        self as u16
    }
}

pub(crate) const TIMER0: Timer = Timer(0x4000_0000);
/// TIMER1, which runs for ever.
pub(crate) const CLOCK: Timer = Timer(0x4000_1000);
pub(crate) const UART0: Uart = Uart(0x4000_4000);
pub(crate) const UART1: Uart = Uart(0x4000_5000);
pub(crate) const UART2: Uart = Uart(0x4000_6000);
/// Not modelled by QEMU, which takes what is written to it and forgets that.
#[cfg(not(feature = "scene"))]
pub(crate) const GPIO0: Gpio = Gpio(0x4001_0000);

fn read(address: usize) -> u32 {
    // SAFETY: only the registers of this file's constants are read, all of which exist and are aligned.
    unsafe { (address as *const u32).read_volatile() }
}

fn write(address: usize, value: u32) {
    // SAFETY: as above; none of these registers makes the hardware touch memory.
    unsafe { (address as *mut u32).write_volatile(value) }
}

/// A 32-bit timer that counts down at the system's clock, by its address.
#[derive(Clone, Copy)]
pub(crate) struct Timer(usize);

impl Timer {
    const CTRL: usize = 0x0;
    const VALUE: usize = 0x4;
    const RELOAD: usize = 0x8;
    const INTCLEAR: usize = 0xc;

    /// Counts from `from`, and from 2³² − 1 each time it has come to zero.
    pub(crate) fn start(self, from: u32, interrupt: bool) {
        write(self.0 + Self::RELOAD, u32::MAX);
        write(self.0 + Self::VALUE, from);
        write(self.0 + Self::CTRL, 1 | u32::from(interrupt) << 3);
    }

    /// Counts since the start, modulo 2³².
    pub(crate) fn counted(self) -> u32 {
        !read(self.0 + Self::VALUE)
    }

    /// Comes to zero after `counts`, ≥ 1.
    pub(crate) fn expire_in(self, counts: u32) {
        write(self.0 + Self::VALUE, counts);
    }

    pub(crate) fn acknowledge(self) {
        write(self.0 + Self::INTCLEAR, 1);
    }
}

/// A port of pins, by its address.
#[cfg(not(feature = "scene"))]
#[derive(Clone, Copy)]
pub(crate) struct Gpio(usize);

#[cfg(not(feature = "scene"))]
impl Gpio {
    const DATAOUT: usize = 0x4;

    /// The levels of all pins, by one store.
    pub(crate) fn set(self, levels: u32) {
        write(self.0 + Self::DATAOUT, levels);
    }
}

/// A serial port with room for one byte each way, by its address.
#[derive(Clone, Copy)]
pub(crate) struct Uart(usize);

impl Uart {
    const DATA: usize = 0x0;
    const STATE: usize = 0x4;
    const CTRL: usize = 0x8;
    const INTCLEAR: usize = 0xc;
    const BAUDDIV: usize = 0x10;
    const TX_FULL: u32 = 1;
    const RX_FULL: u32 = 2;

    /// Sends and receives, as fast as QEMU can: it has no line.
    pub(crate) fn start(self, interrupts: bool) {
        write(self.0 + Self::BAUDDIV, 16);
        write(self.0 + Self::CTRL, if interrupts { 0b1111 } else { 0b0011 });
    }

    /// A byte that has arrived.
    pub(crate) fn take(self) -> Option<u8> {
        (read(self.0 + Self::STATE) & Self::RX_FULL != 0).then(|| read(self.0 + Self::DATA) as u8)
    }

    /// Sends `byte` if there is room for it.
    pub(crate) fn offer(self, byte: u8) -> bool {
        let room = self.has_room();
        if room {
            write(self.0 + Self::DATA, u32::from(byte));
        }
        room
    }

    fn has_room(self) -> bool {
        read(self.0 + Self::STATE) & Self::TX_FULL == 0
    }

    pub(crate) fn acknowledge_sent(self) {
        write(self.0 + Self::INTCLEAR, 1);
    }

    pub(crate) fn acknowledge_received(self) {
        write(self.0 + Self::INTCLEAR, 2);
    }
}

impl ErrorType for Uart {
    type Error = Infallible;
}

impl WriteReady for Uart {
    fn write_ready(&mut self) -> Result<bool, Infallible> {
        Ok(self.has_room())
    }
}

impl Write for Uart {
    /// Takes one byte, or waits until it can.
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        let Some(&byte) = bytes.first() else { return Ok(0) };
        while !self.offer(byte) {}
        Ok(1)
    }

    fn flush(&mut self) -> Result<(), Infallible> {
        while !self.has_room() {}
        Ok(())
    }
}
