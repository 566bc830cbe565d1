//! penvis's own firmware as a peer.

use penvis_firmware::{Machine, Settings};

use super::Recording;
use super::peer::Peer;
use super::recorder::{PenSense, Recorder};
use crate::device::Pen;

const NS_PER_US: u64 = 1000;

/// The firmware with simulated motors, whose step pulses are recorded.
#[derive(Debug)]
pub(super) struct Firmware {
    machine: Machine<Recorder>,
    /// ns since power on.
    now: u64,
}

impl Firmware {
    /// Switched on just now, with its pen up at the origin.
    pub(super) fn new(settings: Settings, pen: &Pen) -> Self {
        let recorder = Recorder::new(PenSense::new(pen, &settings), &settings);
        Self { machine: Machine::new(recorder, settings), now: 0 }
    }
}

impl Peer for Firmware {
    fn receive(&mut self, byte: u8) {
        self.machine.receive(byte);
    }

    fn transmit(&mut self) -> Option<u8> {
        self.machine.transmit()
    }

    fn work(&mut self) -> bool {
        self.machine.poll()
    }

    fn next_event(&self) -> u64 {
        self.machine.next_event().saturating_mul(NS_PER_US)
    }

    fn advance(&mut self, now: u64) {
        if now >= self.next_event() {
            self.machine.tick();
        }
        self.now = now;
    }

    fn recording(&self) -> Recording {
        self.machine.hardware().recording(self.now, self.machine.lost_bytes())
    }
}
