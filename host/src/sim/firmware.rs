//! penvis's own firmware as a peer.

use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};

use penvis_core::pipeline::Monitor;
use penvis_firmware::scene::{Answer, Line, Offer, Studio, Surroundings};
use penvis_firmware::{Hardware, Machine, Pen as Servo, Settings};

use super::Recording;
use super::peer::{Peer, Trouble};
use super::recorder::{PenSense, Recorder};
use crate::device::Pen;

const NS_PER_US: u64 = 1000;

/// Real-time characters: hold, go on, reset.
const HOLD: u8 = b'!';
const RESUME: u8 = b'~';
const RESET: u8 = 0x18;
/// Begins no word of G-code.
const NONSENSE: u8 = b'#';

/// Room for a scene that it draws by itself, bytes.
const SCENE_BYTES: usize = 65_536;

/// The firmware with simulated motors, whose step pulses are recorded.
#[derive(Debug)]
pub(super) struct Firmware {
    machine: Machine<Recorder>,
    studio: Box<Studio<SCENE_BYTES>>,
    /// What the studio has drawn and the controller has not taken yet.
    drawn: Option<Drawn>,
    settings: Settings,
    /// It is talked to in HPGL.
    hpgl: bool,
    /// ns since power on.
    now: u64,
    /// When the machine was last switched on, ns: its own time is from then on.
    born: u64,
    /// Bytes that machines before this one have lost.
    lost_before: u32,
    /// The next byte is to be read as nonsense, which has its line refused.
    refuses: bool,
    /// When somebody lets it go on, ns.
    resume_at: u64,
    hung: bool,
}

impl Firmware {
    /// Switched on just now, with its pen up at the origin.
    pub(super) fn new(settings: Settings, pen: &Pen) -> Self {
        let recorder = Recorder::new(PenSense::new(pen, &settings), &settings);
        Self {
            machine: Machine::new(recorder, settings.clone()),
            studio: Box::new(Studio::new(&[], usize::MAX)),
            drawn: None,
            settings,
            hpgl: false,
            now: 0,
            born: 0,
            lost_before: 0,
            refuses: false,
            resume_at: u64::MAX,
            hung: false,
        }
    }

    /// Does what the controller has left on its desk. On a board this goes on beside it; here it takes no time.
    fn mind_desk(&mut self) {
        let desk = self.machine.desk_mut();
        if let Some(order) = desk.take_order() {
            let lines = Collected::default();
            let answer = self.studio.obey(&order, &lines);
            self.drawn = Some(Drawn { lines: lines.0.into_inner().unwrap_or_else(PoisonError::into_inner), answer });
        }
        if let Some(Drawn { lines, answer }) = &mut self.drawn {
            while lines.front().is_some_and(|line| desk.offer_line(line) == Offer::Taken) {
                lines.pop_front();
            }
            if lines.is_empty() || desk.is_abandoned() {
                desk.finish(answer.clone());
                self.drawn = None;
            }
        }
    }

    /// Talked to in HPGL, which it knows by its first bytes.
    pub(super) fn in_hpgl(self) -> Self {
        Self { hpgl: true, ..self }
    }

    /// When the machine's own next event is.
    fn machine_event(&self) -> u64 {
        self.born.saturating_add(self.machine.next_event().saturating_mul(NS_PER_US))
    }
}

/// A drawing on its way from the studio to the controller.
#[derive(Debug)]
struct Drawn {
    lines: VecDeque<Line>,
    answer: Answer,
}

/// Takes every line at once.
#[derive(Default)]
struct Collected(Mutex<VecDeque<Line>>);

impl Monitor for Collected {}

impl Surroundings for Collected {
    fn line(&self, line: &Line) -> bool {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push_back(line.clone());
        true
    }
}

impl Peer for Firmware {
    fn receive(&mut self, byte: u8) {
        if self.hung {
            return;
        }
        let refused = self.refuses && byte.is_ascii_alphabetic();
        if refused {
            self.refuses = false;
        }
        self.machine.receive(if refused { NONSENSE } else { byte });
    }

    fn transmit(&mut self) -> Option<u8> {
        if self.hung { None } else { self.machine.transmit() }
    }

    fn work(&mut self) -> bool {
        if self.hung {
            return false;
        }
        self.mind_desk();
        self.machine.poll()
    }

    fn next_event(&self) -> u64 {
        if self.hung { u64::MAX } else { self.machine_event().min(self.resume_at) }
    }

    fn advance(&mut self, now: u64) {
        self.now = now;
        if self.hung {
            return;
        }
        if now >= self.machine_event() {
            self.machine.tick();
        }
        if now >= self.resume_at {
            self.resume_at = u64::MAX;
            self.machine.receive(RESUME);
        }
    }

    fn ready_line(&self) -> Option<bool> {
        self.hpgl.then(|| self.machine.is_ready() && !self.hung)
    }

    fn is_whole_answer(&self, bytes: &[u8]) -> bool {
        if self.hpgl { bytes.last().is_some_and(u8::is_ascii_control) } else { bytes.ends_with(b"\n") }
    }

    fn begins_acknowledgement(&self, bytes: &[u8]) -> bool {
        self.hpgl || bytes.iter().zip(b"ok").all(|(byte, expected)| byte == expected)
    }

    fn suffer(&mut self, trouble: Trouble) {
        match trouble {
            Trouble::Error => self.refuses = true,
            // It has no switches: a reset in motion locks it too.
            Trouble::Alarm => self.machine.receive(RESET),
            Trouble::Reset => {
                self.lost_before = self.lost_before.saturating_add(self.machine.lost_bytes());
                let mut recorder = self.machine.hardware().clone();
                recorder.set_pen(Servo::Off);
                self.machine = Machine::new(recorder, self.settings.clone());
                (*self.studio, self.drawn) = (Studio::new(&[], usize::MAX), None);
                self.born = self.now;
                self.resume_at = u64::MAX;
            }
            Trouble::Hang => self.hung = true,
            Trouble::PenChange { ns } => {
                self.machine.receive(HOLD);
                self.resume_at = self.now.saturating_add(ns);
            }
        }
    }

    fn is_moving(&self) -> bool {
        !self.machine.is_still()
    }

    fn recording(&self) -> Recording {
        self.machine.hardware().recording(self.now, self.lost_before.saturating_add(self.machine.lost_bytes()))
    }
}
