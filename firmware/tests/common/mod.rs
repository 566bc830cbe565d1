//! A machine in virtual time, fed through a wire of a given speed, with everything its hardware was told.

#![allow(dead_code, reason = "each test file is a crate of its own and uses its own part of this")]

mod flash;

use std::collections::VecDeque;

use penvis_firmware::{Axes, Hardware, Machine, Pen, Settings};

pub(crate) use flash::RamFlash;

/// What the hardware was told, in order, with the time in µs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Event {
    Step { at: u64, delta: [i32; 3] },
    Pen { at: u64, pen: Pen, position: [i32; 3] },
    Motors { at: u64, on: bool },
}

#[derive(Debug, Default)]
pub(crate) struct Recorder {
    now: u64,
    negative: Axes,
    /// Where the mechanics are, whatever the firmware calls it.
    pub(crate) position: [i32; 3],
    /// Steps at and below which the limit switch of an axis is closed.
    pub(crate) switches: [Option<i32>; 3],
    /// Steps at and above which it is closed.
    pub(crate) upper_switches: [Option<i32>; 3],
    /// Switches that stay closed whatever the position.
    pub(crate) stuck: Axes,
    pub(crate) events: Vec<Event>,
}

impl Hardware for Recorder {
    fn set_directions(&mut self, negative: Axes) {
        self.negative = negative;
    }

    fn step(&mut self, axes: Axes) {
        let mut delta = [0; 3];
        for (axis, d) in delta.iter_mut().enumerate() {
            if axes.contains(axis) {
                *d = if self.negative.contains(axis) { -1 } else { 1 };
            }
            self.position[axis] += *d;
        }
        self.events.push(Event::Step { at: self.now, delta });
    }

    fn set_pen(&mut self, pen: Pen) {
        self.events.push(Event::Pen { at: self.now, pen, position: self.position });
    }

    fn enable_motors(&mut self, on: bool) {
        self.events.push(Event::Motors { at: self.now, on });
    }

    fn limits(&mut self) -> Axes {
        let mut closed = self.stuck;
        for axis in 0..3 {
            let at = self.position[axis];
            if self.switches[axis].is_some_and(|low| at <= low)
                || self.upper_switches[axis].is_some_and(|high| at >= high)
            {
                closed.insert(axis);
            }
        }
        closed
    }

    fn set_time(&mut self, now: u64) {
        self.now = now;
    }
}

/// A machine that looks `BLOCKS` blocks ahead.
pub(crate) struct Sim<const BLOCKS: usize = 15> {
    pub(crate) machine: Machine<Recorder, BLOCKS, RamFlash>,
    pub(crate) answers: Vec<u8>,
}

/// Default settings changed by `$n=value` pairs.
pub(crate) fn settings(changes: &[(u16, f64)]) -> Settings {
    let mut settings = Settings::default();
    for &(id, value) in changes {
        settings.set(id, value).unwrap();
    }
    settings
}

impl Sim {
    /// As usual, with these settings changed.
    pub(crate) fn with(changes: &[(u16, f64)]) -> Self {
        Self::new(settings(changes))
    }

    /// Switched on with such a memory; what it says is not read yet.
    pub(crate) fn start(settings: Settings, flash: RamFlash) -> Self {
        Self::boot(settings, flash)
    }

    /// Switched off and on again; what it says is not read yet.
    pub(crate) fn restarted(&self, settings: Settings) -> Self {
        Self::start(settings, self.machine.storage().clone())
    }
}

impl<const BLOCKS: usize> Sim<BLOCKS> {
    fn boot(settings: Settings, flash: RamFlash) -> Self {
        let machine = Machine::with_storage(Recorder::default(), settings, flash);
        let mut sim = Self { machine, answers: Vec::new() };
        sim.settle();
        sim
    }

    /// Started, and its banner read.
    pub(crate) fn new(settings: Settings) -> Self {
        let mut sim = Self::boot(settings, RamFlash::default());
        let said = sim.take();
        assert!(said.starts_with("\r\nGrbl 1.1h ['$' for help]\r\n"), "{said}");
        sim
    }

    /// Lets the main loop run until it waits.
    pub(crate) fn settle(&mut self) {
        while self.machine.poll() {
            self.answers.extend(std::iter::from_fn(|| self.machine.transmit()));
        }
        self.answers.extend(std::iter::from_fn(|| self.machine.transmit()));
    }

    pub(crate) fn send(&mut self, bytes: impl AsRef<[u8]>) {
        for &byte in bytes.as_ref() {
            self.machine.receive(byte);
        }
        self.settle();
    }

    pub(crate) fn tick(&mut self) {
        self.machine.tick();
        self.settle();
    }

    /// Runs for `us` of virtual time.
    pub(crate) fn run_for(&mut self, us: u64) {
        let end = self.machine.now() + us;
        while self.machine.next_event() <= end {
            self.tick();
        }
    }

    /// Runs until nothing is left to do.
    pub(crate) fn finish(&mut self) {
        self.settle();
        for _ in 0..50_000_000u64 {
            if self.machine.is_idle() {
                return;
            }
            self.tick();
        }
        panic!("not idle after 50 million ticks");
    }

    /// Streams `program` as fast as the receive ring takes it, and finishes.
    pub(crate) fn stream(&mut self, program: &str) {
        let mut bytes: VecDeque<u8> = program.bytes().collect();
        while !bytes.is_empty() {
            while self.machine.rx_free() > 0 {
                let Some(byte) = bytes.pop_front() else { break };
                self.machine.receive(byte);
            }
            self.settle();
            if self.machine.rx_free() == 0 {
                self.tick();
            }
        }
        self.finish();
    }

    /// The answers since the last call.
    pub(crate) fn take(&mut self) -> String {
        String::from_utf8(std::mem::take(&mut self.answers)).unwrap()
    }

    /// The answer to one line once everything has been done.
    pub(crate) fn ask(&mut self, line: &str) -> String {
        self.send(format!("{line}\n"));
        self.finish();
        self.take()
    }

    pub(crate) fn events(&self) -> &[Event] {
        &self.machine.hardware().events
    }

    /// Times and positions after each step.
    pub(crate) fn path(&self) -> Vec<(u64, [i32; 3])> {
        let mut position = [0; 3];
        self.events()
            .iter()
            .filter_map(|event| match event {
                Event::Step { at, delta } => {
                    for axis in 0..3 {
                        position[axis] += delta[axis];
                    }
                    Some((*at, position))
                }
                _ => None,
            })
            .collect()
    }
}
