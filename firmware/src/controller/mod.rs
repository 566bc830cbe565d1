//! The main loop's side: bytes in, answers and step commands out.

mod command;
#[cfg(feature = "scene")]
mod drawing;
mod hold;
mod homing;
mod job;
mod plot;
mod status;
mod stop;

use embedded_storage::nor_flash::NorFlash;

use crate::axis::Axes;
use crate::error::Error;
use crate::gcode::{Actions, GcodeState};
use crate::hal::Wiring;
use crate::line::{LineEditor, Receiver};
use crate::pen::Pen;
use crate::planner::{Overrides, Planner};
use crate::realtime::RealTime;
use crate::report::Transmitter;
use crate::settings::Settings;
use crate::stepper::{Command, StepSink};
use crate::storage::{Loaded, NoStorage, Slots, Stored};
use hold::Hold;
use homing::Homing;
use plot::Speech;

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
    /// After ALARM:1 and ALARM:2: only a reset helps.
    NeedsReset,
    /// `$SLP`: only a reset helps.
    Sleep,
}

/// What the line taken last still wants before it is answered.
#[derive(Debug, Default)]
#[allow(clippy::large_enum_variant, reason = "there is one of it, and no allocator to put the larger part elsewhere")]
enum Job {
    #[default]
    None,
    /// Actions in the order of their fields; those done are taken out. `dwell` is what is left of it in µs, once it has begun.
    Actions { actions: Actions, dwell: Option<u64> },
    /// `$$`: the next setting's index.
    Settings(usize),
    /// `$#`: the next line's index.
    Parameters(usize),
    /// `$H`.
    Homing(Homing),
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
/// `BLOCKS` is the number of blocks the planner looks ahead, `F` the memory for what outlives switching off.
#[derive(Debug)]
pub struct Controller<const BLOCKS: usize, F = NoStorage> {
    receiver: Receiver,
    speech: Speech,
    editor: LineEditor,
    transmitter: Transmitter,
    slots: Slots<F>,
    stored: Stored,
    defaults: Settings,
    gcode: GcodeState,
    planner: Planner<BLOCKS>,
    job: Job,
    /// Drawings that are computed in the background.
    #[cfg(feature = "scene")]
    desk: crate::scene::Desk,
    mode: Mode,
    hold: Hold,
    /// The motion under way is to be stopped with deceleration and forgotten.
    braking: bool,
    /// `$J=` motion is planned or under way; other motion is refused until it ends.
    jogging: bool,
    /// The jog is to be stopped and forgotten.
    cancel_jog: bool,
    /// Segments are being generated: stays set until the planner has run dry.
    running: bool,
    /// The pen as it was last handed to the stepper, and the S of it before the override.
    pen: Pen,
    pen_speed: f64,
    /// 0x99–0x9D: percentage of S, 10 to 200, and whether the pen does not know of it yet.
    pen_override: u8,
    pen_due: bool,
    /// Laser mode: a change of the pen that waits for the next block.
    waiting_pen: Option<Pen>,
    /// Limit switches that were closed at the last look.
    limits_before: Axes,
    /// The start-up line that is next, or at work.
    startup: Option<usize>,
    reset: bool,
    status_wanted: bool,
    overrides: Overrides,
    /// Reports until the work offset and the overrides are told again.
    offset_report: u8,
    override_report: u8,
    configured: bool,
}

impl<const BLOCKS: usize> Controller<BLOCKS> {
    /// As after a reset, without storage: the banner waits to be sent.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        Self::with_storage(settings, NoStorage)
    }
}

impl<const BLOCKS: usize, F: NorFlash> Controller<BLOCKS, F> {
    /// As after a reset, with what `flash` holds; with `defaults` when it holds nothing, and besides `error:7` when it is damaged.
    ///
    /// The memory is used from address 0, twice [`crate::slot_bytes`] of it; a smaller one is not used.
    #[must_use]
    pub fn with_storage(defaults: Settings, flash: F) -> Self {
        let mut slots = Slots::new(flash);
        let mut transmitter = Transmitter::default();
        let stored = match slots.load(&defaults) {
            Loaded::Record(stored) => stored,
            Loaded::Nothing => Stored::new(defaults.clone()),
            Loaded::Damaged => {
                transmitter.answer(Err(Error::StorageFailed));
                Stored::new(defaults.clone())
            }
        };
        let mut controller = Self {
            receiver: Receiver::default(),
            speech: Speech::default(),
            editor: LineEditor::default(),
            transmitter,
            slots,
            // Nobody knows where it is.
            mode: if stored.settings.can_home() { Mode::Alarm } else { Mode::Normal },
            stored,
            defaults,
            gcode: GcodeState::default(),
            planner: Planner::new(),
            job: Job::None,
            #[cfg(feature = "scene")]
            desk: crate::scene::Desk::default(),
            hold: Hold::default(),
            braking: false,
            jogging: false,
            cancel_jog: false,
            running: false,
            pen: Pen::Off,
            pen_speed: 0.0,
            pen_override: 100,
            pen_due: false,
            waiting_pen: None,
            limits_before: Axes::NONE,
            startup: None,
            reset: false,
            status_wanted: false,
            overrides: Overrides::default(),
            offset_report: 0,
            override_report: 1,
            configured: false,
        };
        controller.choose_language();
        controller.greet();
        controller
    }

    /// Takes one byte from the port. Real-time bytes are noted at once, the others wait in the ring of [`crate::RX_BYTES`]; what does not fit is lost. Cost: constant.
    /// In HPGL the real-time bytes are device control (`ESC.`) and 0x18.
    pub fn receive(&mut self, byte: u8) {
        if self.hear(byte) {
            return;
        }
        match RealTime::from_byte(byte) {
            None => {
                self.receiver.push(byte);
            }
            Some(RealTime::StatusReport) => self.status_wanted = true,
            Some(RealTime::CycleStart) if self.mode != Mode::NeedsReset => self.hold.resume(),
            Some(RealTime::FeedHold | RealTime::JogCancel) if self.jogging => self.cancel_jog = true,
            // What homes can be reset, and has no place to hold at.
            Some(RealTime::FeedHold) if !self.is_homing() => self.hold.begin(),
            Some(RealTime::Door) => {
                self.cancel_jog |= self.jogging;
                self.hold.open_door();
            }
            Some(RealTime::SoftReset) => self.ask_reset(),
            Some(RealTime::Feed(change)) => self.overrides.feed = change.apply(self.overrides.feed),
            Some(RealTime::Rapid(percent)) => self.overrides.rapid = percent,
            Some(RealTime::Pen(change)) => {
                self.pen_override = change.apply(self.pen_override);
                self.pen_due = true;
                self.override_report = 0;
            }
            Some(RealTime::TogglePen) => self.hold.toggle_pen(),
            Some(RealTime::ToggleFlood) => self.gcode.flood ^= true,
            Some(RealTime::ToggleMist) => self.gcode.mist ^= true,
            Some(RealTime::CycleStart | RealTime::FeedHold | RealTime::JogCancel | RealTime::Unassigned) => {}
        }
    }

    /// The next byte for the port.
    pub fn transmit(&mut self) -> Option<u8> {
        self.transmitter.pop()
    }

    /// One turn of the main loop: obeys the real-time commands, takes up at most one line or goes on with the last, and keeps the step commands supplied.
    ///
    /// Returns true when calling again at once would do more; false when it waits for bytes, for [`Controller::transmit`], or for the stepper.
    /// Limit switches are looked at here: a hard limit or a home switch is seen as late as this is called.
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
        self.mind_limits(stepper);
        if self.overrides != self.planner.overrides() && !self.is_homing() {
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
        self.mind_pen(stepper);
        let moved = self.is_started() && self.transmitter.has_room() && self.advance(stepper);
        // A first block alone would have to be planned to a stop: see first whether the port has more to add.
        if self.running || !moved || self.planner.is_full(stepper.drawn().lines) {
            self.generate(stepper);
        }
        moved
    }

    /// Whether there is nothing to do: no unread byte, no line at work, no motion (a held one counts as motion), nothing to send.
    pub fn is_idle(&self, stepper: &impl StepSink) -> bool {
        !(self.reset || self.status_wanted)
            && (!self.is_started()
                || (self.receiver.is_empty()
                    && matches!(self.job, Job::None)
                    && !self.has_startup()
                    && self.speech.is_idle()
                    && !self.is_drawing()))
            && self.is_still(stepper)
            && self.transmitter.is_empty()
    }

    /// The settings in force.
    pub fn settings(&self) -> &Settings {
        &self.stored.settings
    }

    /// Bytes that the receive ring had no room for since the start.
    pub fn lost_bytes(&self) -> u32 {
        self.receiver.lost()
    }

    /// Bytes that the receive ring has room for.
    pub fn rx_free(&self) -> usize {
        self.receiver.free()
    }

    /// The level of the ready line (DTR), by which HPGL's hardware handshake (`ESC.@`) stops the computer.
    pub fn is_ready(&self) -> bool {
        self.speech.is_ready()
    }

    /// The memory for what outlives switching off.
    pub fn storage(&self) -> &F {
        self.slots.flash()
    }

    /// Whether lines are read at all.
    fn is_started(&self) -> bool {
        !matches!(self.mode, Mode::NeedsReset | Mode::Sleep)
    }

    /// A `$PV` line waits for its answer. Lines from the port wait with it; those of the drawing are answered over the desk.
    fn is_drawing(&self) -> bool {
        #[cfg(feature = "scene")]
        return self.desk.is_waiting();
        #[cfg(not(feature = "scene"))]
        false
    }

    fn is_homing(&self) -> bool {
        matches!(self.job, Job::Homing(_))
    }

    fn wiring(&self) -> Wiring {
        let settings = &self.stored.settings;
        Wiring {
            pulse_us: settings.pulse_us,
            invert_steps: Axes::from_bits(settings.invert_steps),
            invert_directions: Axes::from_bits(settings.invert_directions),
            invert_enable: settings.invert_enable,
            // Asleep, the motors are released at once.
            idle_delay_ms: if self.mode == Mode::Sleep { 0 } else { settings.idle_delay_ms },
            pen: settings.pen_motion(),
        }
    }

    /// No motion is planned or under way.
    fn is_still(&self, stepper: &impl StepSink) -> bool {
        self.planner.is_empty() && self.waiting_pen.is_none() && stepper.is_idle()
    }

    /// No motion is under way, though some may be planned.
    fn is_at_rest(&self, stepper: &impl StepSink) -> bool {
        self.planner.speed_sqr == 0.0 && stepper.is_idle()
    }

    /// Takes the position from the steps.
    fn sync_position(&mut self, stepper: &impl StepSink) {
        let steps = stepper.position();
        self.planner.reset(steps, stepper.drawn().lines, &self.stored.settings);
        self.gcode.position = self.stored.settings.pen(steps.map(f64::from));
    }

    /// Hands segments to the stepper while it has room.
    fn generate(&mut self, stepper: &mut impl StepSink) {
        while stepper.room() > 0 {
            let Some(segment) = self.planner.next_segment(self.hold.is_on() || self.braking) else { break };
            self.running = true;
            if let Command::Steps(steps) = &segment
                && let Some(pen) = steps.pen
            {
                self.pen = pen;
            }
            if !stepper.push(segment) {
                break;
            }
        }
        if self.planner.is_empty() {
            self.running = false;
            if self.waiting_pen.is_some_and(|pen| self.hand_pen(pen, stepper)) {
                self.waiting_pen = None;
            }
        }
    }

    /// Hands the pen's new state to the stepper; false when that has no room.
    fn hand_pen(&mut self, pen: Pen, stepper: &mut impl StepSink) -> bool {
        let taken = stepper.push(Command::Pen(pen));
        if taken {
            self.pen = pen;
        }
        taken
    }
}
