//! What the step interrupt costs: a machine of its own, which makes steps of two axes while the clock counts.
//!
//! In QEMU with `-icount shift=5` an instruction takes 32 ns and a count of the clock 40 ns, so that a sum of counts tells instructions. Counted is
//! [`Stepper::tick`] from call to return, with a hardware that stores a word a step, as a port of pins would; what the reading of the clock costs is taken off.

use core::fmt;
use core::hint::black_box;

use penvis_firmware::{Axes, Hardware, Machine, Pen, Settings};

use super::registers::CLOCK;

/// Counts of the clock, each of 40 ns, in instructions of 32 ns.
const COUNT_NS: u64 = 40;
const INSTRUCTION_NS: u64 = 32;

/// Step events that are measured: 100 mm of 80 a mm.
const EVENTS: u32 = 8000;

/// Two axes at different speeds, well within the limits.
const JOB: &[u8] = b"G1 X100 Y61.8 F6000\n";

/// Instructions, in hundredths, of a step event.
pub(crate) struct Cost {
    /// If the hardware ends its pulses by itself.
    whole: u64,
    /// If a second tick ends them: both.
    halves: u64,
}

impl fmt::Display for Cost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [whole, halves] = [self.whole, self.halves].map(|cost| (cost / 100, cost % 100));
        write!(
            f,
            "{}.{:02} instructions a step of 2 axes over {EVENTS} steps, {}.{:02} where a second tick ends the pulse",
            whole.0, whole.1, halves.0, halves.1
        )
    }
}

/// Measures.
pub(crate) fn step() -> Cost {
    Cost { whole: measure::<false>(), halves: measure::<true>() }
}

/// A port of pins: each set of axes has its word, and one store makes its steps.
struct Port<const TICK_ENDS_PULSE: bool> {
    words: [u32; 8],
    pins: u32,
}

impl<const TICK_ENDS_PULSE: bool> Hardware for Port<TICK_ENDS_PULSE> {
    const TICKS_PER_US: u32 = super::CLOCK_HZ / 1_000_000;
    const TICK_ENDS_PULSE: bool = TICK_ENDS_PULSE;

    fn set_directions(&mut self, negative: Axes) {
        self.pins = black_box(negative.bits().into());
    }

    fn step(&mut self, axes: Axes) {
        self.pins = black_box(self.words[usize::from(axes.bits() & 7)]);
    }

    fn end_step(&mut self) {
        self.pins = black_box(self.words[7] << 16);
    }

    fn set_pen(&mut self, _: Pen) {}
}

/// Hundredths of instructions for a step event, all ticks of a motion and its segments counted.
fn measure<const TICK_ENDS_PULSE: bool>() -> u64 {
    let port = Port::<TICK_ENDS_PULSE> { words: [0, 1, 2, 3, 4, 5, 6, 7], pins: 0 };
    let mut machine: Machine<_, 4> = Machine::new(port, Settings::default());
    for &byte in JOB {
        machine.receive(byte);
    }
    let (mut counts, mut ticks) = (0u64, 0u64);
    loop {
        while machine.poll() {}
        while machine.transmit().is_some() {}
        if machine.is_idle() {
            break;
        }
        counts += u64::from(counted(|| black_box(machine.tick())));
        ticks += 1;
    }
    // What is counted with nothing in between.
    let nothing: u64 = (0..ticks).map(|_| u64::from(counted(|| black_box(1)))).sum();
    counts.saturating_sub(nothing) * 100 * COUNT_NS / INSTRUCTION_NS / u64::from(EVENTS)
}

/// Counts of the clock that `what` takes, no interrupt between.
fn counted(what: impl FnOnce() -> u32) -> u32 {
    critical_section::with(|_| {
        let before = CLOCK.counted();
        what();
        CLOCK.counted().wrapping_sub(before)
    })
}
