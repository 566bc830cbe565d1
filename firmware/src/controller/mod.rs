//! The main loop's side: bytes in, answers and step commands out.

mod command;
mod job;
mod status;
mod stop;

use crate::axis::{AXES, Axes};
use crate::gcode::{Actions, GcodeState};
use crate::hal::Wiring;
use crate::line::{LineEditor, Receiver};
use crate::pen::Pen;
use crate::planner::{Overrides, Planner};
use crate::realtime::{Override, RealTime};
use crate::report::Transmitter;
use crate::settings::Settings;
use crate::stepper::{Command, StepSink};

/// Longest piece of a dwell, µs: so long a reset may go unnoticed by the step interrupt.
const DWELL_PIECE: u64 = 50_000;

/// Status reports between two that carry the work offset or the overrides.
const REPORT_CYCLE: u8 = 20;

/// Whether the machine takes commands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Normal,
    /// `$C`: lines are checked and not obeyed.
    Check,
    /// Lines are answered with `error:9`.
    Alarm,
    /// After ALARM:2: only a reset helps.
    NeedsReset,
}

/// What the line taken last still wants before it is answered.
#[derive(Debug, Default)]
enum Job {
    #[default]
    None,
    /// Actions in the order of their fields; those done are taken out. `dwell` is what is left of it in µs, once it has begun.
    Actions { actions: Actions, dwell: Option<u64> },
    /// `$$`: the next setting's index.
    Settings(usize),
    /// `$#`: the next line's index.
    Parameters(usize),
}

/// What the motion of a job has come to.
enum Progress {
    /// The planner or the stepper must first do something.
    Waiting,
    /// Something has been done; go on.
    Moved,
    /// All of it has been done.
    Done,
}

/// Line editor, interpreter, planner and segment generator, without the step interrupt.
///
/// [`crate::Machine`] is this together with a [`crate::Stepper`], for one context that runs both. A board with interrupts keeps them
/// apart: it calls [`Controller::poll`] from the main loop with a [`StepSink`] that locks the shared stepper, and
/// [`crate::Stepper::tick`] from the timer.
///
/// `BLOCKS` is the number of blocks the planner looks ahead.
#[derive(Debug)]
pub struct Controller<const BLOCKS: usize> {
    receiver: Receiver,
    editor: LineEditor,
    transmitter: Transmitter,
    settings: Settings,
    defaults: Settings,
    gcode: GcodeState,
    planner: Planner<BLOCKS>,
    job: Job,
    mode: Mode,
    /// Motion is stopped or stopping: `!` or M0.
    hold: bool,
    /// `$J=` motion is planned or under way; other motion is refused until it ends.
    jogging: bool,
    /// The jog is to be stopped and forgotten.
    cancel_jog: bool,
    /// Segments are being generated: stays set until the planner has run dry.
    running: bool,
    /// Laser mode: a change of the pen that waits for the next block.
    waiting_pen: Option<Pen>,
    reset: bool,
    status_wanted: bool,
    overrides: Overrides,
    /// Reports until the work offset and the overrides are told again.
    offset_report: u8,
    override_report: u8,
    configured: bool,
}

impl<const BLOCKS: usize> Controller<BLOCKS> {
    /// As after a reset: the banner waits to be sent.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        let mut transmitter = Transmitter::default();
        transmitter.banner();
        Self {
            receiver: Receiver::default(),
            editor: LineEditor::default(),
            transmitter,
            defaults: settings.clone(),
            settings,
            gcode: GcodeState::default(),
            planner: Planner::new(),
            job: Job::None,
            mode: Mode::Normal,
            hold: false,
            jogging: false,
            cancel_jog: false,
            running: false,
            waiting_pen: None,
            reset: false,
            status_wanted: false,
            overrides: Overrides::default(),
            offset_report: 0,
            override_report: 1,
            configured: false,
        }
    }

    /// Takes one byte from the port. Real-time bytes are noted at once, the others wait in the ring of [`crate::RX_BYTES`]; what does not fit is lost. Cost: constant.
    pub fn receive(&mut self, byte: u8) {
        match RealTime::from_byte(byte) {
            None => self.receiver.push(byte),
            Some(RealTime::StatusReport) => self.status_wanted = true,
            Some(RealTime::CycleStart) => self.hold &= self.mode == Mode::NeedsReset,
            Some(RealTime::FeedHold | RealTime::JogCancel) if self.jogging => self.cancel_jog = true,
            Some(RealTime::FeedHold) => self.hold = true,
            Some(RealTime::SoftReset) => self.reset = true,
            Some(RealTime::Feed(change)) => {
                self.overrides.feed = match change {
                    Override::Set(percent) => percent,
                    Override::Add(percent) => self.overrides.feed.saturating_add_signed(percent),
                }
                .clamp(10, 200);
            }
            Some(RealTime::Rapid(percent)) => self.overrides.rapid = percent,
            Some(RealTime::JogCancel | RealTime::Unassigned) => {}
        }
    }

    /// The next byte for the port.
    pub fn transmit(&mut self) -> Option<u8> {
        self.transmitter.pop()
    }

    /// One turn of the main loop: obeys the real-time commands, takes up at most one line or goes on with the last, and keeps the step commands supplied.
    ///
    /// Returns true when calling again at once would do more; false when it waits for bytes, for [`Controller::transmit`], or for the stepper.
    pub fn poll(&mut self, stepper: &mut impl StepSink) -> bool {
        if !self.configured {
            self.configured = true;
            stepper.configure(self.wiring());
            self.sync_position(stepper);
        }
        if self.reset {
            self.soft_reset(stepper);
            return true;
        }
        if self.overrides != self.planner.overrides() {
            self.planner.set_overrides(self.overrides);
            self.override_report = 0;
        }
        if self.status_wanted && self.transmitter.has_room() {
            self.status_wanted = false;
            self.report_status(stepper);
        }
        if self.jogging {
            self.mind_jog(stepper);
        }
        let moved = self.mode != Mode::NeedsReset && self.transmitter.has_room() && self.advance(stepper);
        // A first block alone would have to be planned to a stop: see first whether the port has more to add.
        if self.running || !moved || self.planner.is_full() {
            self.generate(stepper);
        }
        moved
    }

    /// Whether there is nothing to do: no unread byte, no line at work, no motion (a held one counts as motion), nothing to send.
    pub fn is_idle(&self, stepper: &impl StepSink) -> bool {
        let started = self.mode != Mode::NeedsReset;
        !(self.reset || self.status_wanted)
            && (self.receiver.is_empty() || !started)
            && matches!(self.job, Job::None)
            && self.is_still(stepper)
            && self.transmitter.is_empty()
    }

    /// The settings in force.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Bytes that the receive ring had no room for since the start.
    pub fn lost_bytes(&self) -> u32 {
        self.receiver.lost()
    }

    /// Bytes that the receive ring has room for.
    pub fn rx_free(&self) -> usize {
        self.receiver.free()
    }

    fn wiring(&self) -> Wiring {
        Wiring {
            pulse_us: self.settings.pulse_us,
            invert_directions: Axes::from_bits(self.settings.invert_directions),
            idle_delay_ms: self.settings.idle_delay_ms,
        }
    }

    /// No motion is planned or under way.
    fn is_still(&self, stepper: &impl StepSink) -> bool {
        self.planner.is_empty() && self.waiting_pen.is_none() && stepper.is_idle()
    }

    /// Takes the position from the steps.
    fn sync_position(&mut self, stepper: &impl StepSink) {
        let steps = stepper.position();
        self.planner.reset(steps, &self.settings);
        self.gcode.position = self.millimetres(steps);
    }

    fn millimetres(&self, steps: [i32; AXES]) -> [f64; AXES] {
        let mut mm = [0.0; AXES];
        for axis in 0..AXES {
            mm[axis] = f64::from(steps[axis]) / self.settings.steps_per_mm[axis];
        }
        mm
    }

    /// Hands segments to the stepper while it has room.
    fn generate(&mut self, stepper: &mut impl StepSink) {
        while stepper.room() > 0 {
            let Some(segment) = self.planner.next_segment(self.hold) else { break };
            self.running = true;
            if !stepper.push(segment) {
                break;
            }
        }
        if self.planner.is_empty() {
            self.running = false;
            if self.waiting_pen.is_some_and(|pen| stepper.push(Command::Pen(pen))) {
                self.waiting_pen = None;
            }
        }
    }
}
