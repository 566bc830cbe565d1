//! What the step interrupt costs: a machine of its own, which makes steps of two axes while the clock counts.
//!
//! In QEMU with `-icount shift=5` an instruction takes 32 ns and a count of the clock 40 ns, so that a sum of counts tells instructions. Counted is
//! [`Stepper::tick`] from call to return, with a hardware that stores a word a step to the register of a port of pins; what the reading of the clock costs is taken off.

use core::fmt;
use core::hint::black_box;

use penvis_firmware::{Axes, Controller, Hardware, Pen, Settings, StepSink, Stepper};

use super::registers::{CLOCK, GPIO0};

/// Counts of the clock, each of 40 ns, in instructions of 32 ns.
const COUNT_NS: u64 = 40;
const INSTRUCTION_NS: u64 = 32;

/// Step events that are measured: 100 mm of 80 a mm.
const EVENTS: u32 = 8000;

/// Two axes at different speeds, well within the limits.
const JOB: &[u8] = b"G1 X100 Y61.8 F6000\n";

/// Instructions of the ticks, in hundredths.
pub(crate) struct Cost {
    /// If the hardware ends its pulses by itself.
    whole: Ticks,
    /// If a second tick ends them: both.
    halves: Ticks,
}

/// What a step costs, and what more where the next segment is loaded.
struct Ticks {
    step: u64,
    load: u64,
    segments: u64,
}

impl fmt::Display for Cost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { whole, halves } = self;
        write!(
            f,
            "{}.{:02} instructions a step of 2 axes, {}.{:02} where a second tick ends the pulse, and {} for each of {} segments of {EVENTS} steps",
            whole.step / 100,
            whole.step % 100,
            halves.step / 100,
            halves.step % 100,
            whole.load / 100,
            whole.segments
        )
    }
}

/// Measures.
pub(crate) fn step() -> Cost {
    Cost { whole: measure::<false>(), halves: measure::<true>() }
}

/// A port of pins: each set of axes has its word, and one store to the register makes its steps.
struct Port<const TICK_ENDS_PULSE: bool> {
    words: [u32; 8],
}

impl<const TICK_ENDS_PULSE: bool> Hardware for Port<TICK_ENDS_PULSE> {
    const TICKS_PER_US: u32 = super::CLOCK_HZ / 1_000_000;
    const TICK_ENDS_PULSE: bool = TICK_ENDS_PULSE;

    fn set_directions(&mut self, negative: Axes) {
        GPIO0.set(negative.bits().into());
    }

    fn step(&mut self, axes: Axes) {
        GPIO0.set(self.words[usize::from(axes.bits() & 7)]);
    }

    fn end_step(&mut self) {
        GPIO0.set(self.words[7] << 16);
    }

    fn set_pen(&mut self, _: Pen) {}
}

/// A motion, whose ticks that load a segment are told apart: only they take a command out of the queue.
fn measure<const TICK_ENDS_PULSE: bool>() -> Ticks {
    let port = Port::<TICK_ENDS_PULSE> { words: black_box([0, 1, 2, 3, 4, 5, 6, 7]) };
    // The type of the machine itself: another one would be in the flash a second time.
    let mut controller: Controller<{ super::BLOCKS }> = Controller::new(Settings::default());
    let mut stepper = Stepper::new(port);
    for &byte in JOB {
        controller.receive(byte);
    }
    let (mut plain, mut loading) = (Sum::default(), Sum::default());
    loop {
        while controller.poll(&mut stepper) {}
        while controller.transmit().is_some() {}
        if controller.is_idle(&stepper) {
            break;
        }
        let (room, moving) = (stepper.room(), stepper.is_moving());
        let counts = counted(|| black_box(stepper.tick()));
        if stepper.room() != room {
            loading.add(counts);
        } else if moving {
            plain.add(counts);
        }
    }
    // A step is one tick, or two.
    let ticks = if TICK_ENDS_PULSE { 2 } else { 1 };
    let (step, load) = (plain.hundredths(), loading.hundredths());
    Ticks { step: step * ticks, load: load.saturating_sub(step), segments: loading.ticks }
}

/// Ticks of one kind.
#[derive(Default)]
struct Sum {
    counts: u64,
    ticks: u64,
}

impl Sum {
    fn add(&mut self, counts: u32) {
        self.counts += u64::from(counts);
        self.ticks += 1;
    }

    /// Hundredths of instructions of one, without the reading of the clock.
    fn hundredths(&self) -> u64 {
        let nothing: u64 = (0..self.ticks).map(|_| u64::from(counted(|| black_box(1)))).sum();
        self.counts.saturating_sub(nothing) * 100 * COUNT_NS / INSTRUCTION_NS / self.ticks.max(1)
    }
}

/// Counts of the clock that `what` takes, no interrupt between.
fn counted(what: impl FnOnce() -> u32) -> u32 {
    critical_section::with(|_| {
        let before = CLOCK.counted();
        what();
        CLOCK.counted().wrapping_sub(before)
    })
}
