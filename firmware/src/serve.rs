//! Running a [`Machine`] on a serial port of `embedded-io`.

use core::convert::Infallible;

use embedded_io::{Read, ReadReady, Write, WriteReady};
use embedded_storage::nor_flash::NorFlash;

use crate::hal::Hardware;
use crate::line::RX_BYTES;
use crate::machine::Machine;

/// One turn between port and machine: takes what has arrived (at most [`RX_BYTES`]), polls, and sends as much as the port takes at once.
///
/// Never waits for the port. Returns true when another turn would do more at once.
///
/// # Errors
/// The port's, at the first operation that fails; what was read before it has been taken in, and at most one byte to send is lost.
pub fn pump<H, S, F, const BLOCKS: usize>(machine: &mut Machine<H, BLOCKS, F>, serial: &mut S) -> Result<bool, S::Error>
where
    H: Hardware,
    S: Read + ReadReady + Write + WriteReady,
    F: NorFlash,
{
    let mut byte = [0];
    for _ in 0..RX_BYTES {
        if !serial.read_ready()? || serial.read(&mut byte)? == 0 {
            break;
        }
        machine.receive(byte[0]);
    }
    let more = machine.poll();
    while serial.write_ready()? {
        let Some(byte) = machine.transmit() else { break };
        serial.write(&[byte])?;
    }
    Ok(more)
}

/// Runs `machine` for ever in a single context, without interrupts: for emulated boards and slow motors.
///
/// `clock` returns ticks of the hardware's timer (µs, unless [`Hardware::TICKS_PER_US`] says otherwise) since any moment. A step waits for the turn before it, so a turn's cost (a line of G-code at most: about a millisecond on a
/// processor without floating point) is the jitter of the steps. A tick that is late by more than a whole period delays those after it
/// instead of being made up for, so the rate of the motors is not exceeded. Where that is not good enough call [`Machine::tick`]'s
/// equivalent, [`crate::Stepper::tick`], from a timer interrupt and [`crate::Controller::poll`] from the main loop.
///
/// # Errors
/// Returns only when the port fails, with its error.
pub fn serve<H, S, F, const BLOCKS: usize>(
    machine: &mut Machine<H, BLOCKS, F>,
    serial: &mut S,
    mut clock: impl FnMut() -> u64,
) -> Result<Infallible, S::Error>
where
    H: Hardware,
    S: Read + ReadReady + Write + WriteReady,
    F: NorFlash,
{
    let mut due = clock();
    loop {
        pump(machine, serial)?;
        let now = clock();
        if now >= due {
            let wait = u64::from(machine.tick());
            due = if now - due > wait { now } else { due } + wait;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::VecDeque;
    use std::string::String;
    use std::vec::Vec;

    use embedded_io::{ErrorKind, ErrorType};

    use super::*;
    use crate::{Axes, Pen, Settings};

    #[derive(Default)]
    struct Counter {
        steps: i64,
    }

    impl Hardware for Counter {
        fn set_directions(&mut self, _: Axes) {}
        fn step(&mut self, axes: Axes) {
            self.steps += i64::from(axes.contains(0));
        }
        fn set_pen(&mut self, _: Pen) {}
    }

    /// A port with input waiting, which takes one byte every other time it is asked and is unplugged after a while.
    struct Port {
        input: VecDeque<u8>,
        output: Vec<u8>,
        asked: u32,
        unplugged_at: u32,
    }

    impl ErrorType for Port {
        type Error = ErrorKind;
    }

    impl ReadReady for Port {
        fn read_ready(&mut self) -> Result<bool, ErrorKind> {
            Ok(!self.input.is_empty())
        }
    }

    impl Read for Port {
        fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
            match (buffer.first_mut(), self.input.pop_front()) {
                (Some(slot), Some(byte)) => {
                    *slot = byte;
                    Ok(1)
                }
                _ => Ok(0),
            }
        }
    }

    impl WriteReady for Port {
        fn write_ready(&mut self) -> Result<bool, ErrorKind> {
            self.asked += 1;
            if self.asked > self.unplugged_at { Err(ErrorKind::BrokenPipe) } else { Ok(self.asked.is_multiple_of(2)) }
        }
    }

    impl Write for Port {
        fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
            self.output.extend_from_slice(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> Result<(), ErrorKind> {
            Ok(())
        }
    }

    #[test]
    fn serves_until_unplugged() {
        let mut machine: Machine<Counter> = Machine::new(Counter::default(), Settings::default());
        let mut port = Port {
            input: b"G1 X2 F3000\n?".iter().copied().collect(),
            output: Vec::new(),
            asked: 0,
            unplugged_at: 100_000,
        };
        let mut time = 5_000_000;
        let result = serve(&mut machine, &mut port, || {
            time += 3;
            time
        });
        assert_eq!(result.unwrap_err(), ErrorKind::BrokenPipe);
        assert_eq!(machine.hardware().steps, 160);
        let said = String::from_utf8(port.output).unwrap();
        assert!(said.contains("Grbl 1.1h") && said.contains("<Idle|") && said.ends_with("ok\r\n"), "{said}");
    }
}
