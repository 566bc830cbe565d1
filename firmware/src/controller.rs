//! The main loop's side: bytes in, answers and step commands out.

use crate::axis::{AXES, Axes};
use crate::error::{Alarm, Error};
use crate::gcode::{Actions, Flow, GcodeState, Path, Speed, Spindle, interpret, interpret_jog};
use crate::hal::Wiring;
use crate::line::{LineEditor, Receiver};
use crate::pen::Pen;
use crate::planner::{Overrides, Planner};
use crate::realtime::{Override, RealTime};
use crate::report::{Status, Transmitter, setting_id};
use crate::settings::Settings;
use crate::stepper::{Command, StepSink};
use crate::system::{self, SystemCommand};

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

    /// Ends the jog when it is done, or when it has been stopped.
    fn mind_jog(&mut self, stepper: &impl StepSink) {
        if self.cancel_jog {
            self.hold = true;
            if self.planner.speed_sqr == 0.0 && !stepper.is_moving() {
                self.sync_position(stepper);
                self.running = false;
                if !matches!(core::mem::take(&mut self.job), Job::None) {
                    self.transmitter.answer(Ok(()));
                }
                self.hold = false;
                self.cancel_jog = false;
                self.jogging = false;
            }
        } else if matches!(self.job, Job::None) && self.is_still(stepper) {
            self.jogging = false;
        }
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

    fn soft_reset(&mut self, stepper: &mut impl StepSink) {
        // Whoever stands still, also in the middle of a held block, knows where it is.
        let lost = stepper.is_moving() || self.planner.speed_sqr > 0.0;
        stepper.abort();
        self.receiver.clear();
        self.editor.clear();
        if !self.transmitter.has_room() {
            // Nobody reads; what comes now matters more.
            self.transmitter.clear();
        }
        self.job = Job::None;
        self.hold = false;
        self.jogging = false;
        self.cancel_jog = false;
        self.running = false;
        self.waiting_pen = None;
        self.reset = false;
        self.status_wanted = false;
        self.overrides = Overrides::default();
        self.planner.set_overrides(self.overrides);
        self.gcode = GcodeState { offset: self.gcode.offset, ..GcodeState::default() };
        self.sync_position(stepper);
        if lost {
            self.transmitter.alarm(Alarm::AbortedInMotion);
        }
        // ALARM:2 stays locked until `$X`, like everything that is not a check.
        self.mode =
            if lost || matches!(self.mode, Mode::Alarm | Mode::NeedsReset) { Mode::Alarm } else { Mode::Normal };
        self.transmitter.banner();
        if self.mode == Mode::Alarm {
            self.transmitter.text("[MSG:'$H'|'$X' to unlock]");
        }
        self.offset_report = 0;
        self.override_report = 1;
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

    /// Goes on with the job, or else takes up the next line. True when anything was done.
    fn advance(&mut self, stepper: &mut impl StepSink) -> bool {
        match core::mem::take(&mut self.job) {
            Job::None => self.read_line(stepper),
            Job::Settings(index) => {
                if let Some(id) = setting_id(index) {
                    self.transmitter.setting(id, &self.settings);
                    self.job = Job::Settings(index + 1);
                } else {
                    self.transmitter.answer(Ok(()));
                }
                true
            }
            Job::Parameters(index) => {
                if self.transmitter.parameter(index, &self.gcode, &self.settings) {
                    self.job = Job::Parameters(index + 1);
                } else {
                    self.transmitter.answer(Ok(()));
                }
                true
            }
            Job::Actions { mut actions, mut dwell } => match self.act(&mut actions, &mut dwell, stepper) {
                Progress::Done => {
                    self.transmitter.answer(Ok(()));
                    true
                }
                progress => {
                    // A soft limit has ended the line without an answer.
                    if self.mode != Mode::NeedsReset {
                        self.job = Job::Actions { actions, dwell };
                    }
                    matches!(progress, Progress::Moved)
                }
            },
        }
    }

    fn read_line(&mut self, stepper: &mut impl StepSink) -> bool {
        while let Some(byte) = self.receiver.pop() {
            if self.editor.push(byte) {
                let result = self.take_line(stepper);
                self.editor.clear();
                match result {
                    Ok(Job::None) => self.transmitter.answer(Ok(())),
                    Ok(job) => self.job = job,
                    Err(error) => self.transmitter.answer(Err(error)),
                }
                return true;
            }
        }
        false
    }

    fn take_line(&mut self, stepper: &mut impl StepSink) -> Result<Job, Error> {
        let line = self.editor.line()?;
        match line {
            [] => Ok(Job::None),
            [b'$', b'J', b'=', jog @ ..] => {
                let free = self.jogging || (self.is_still(stepper) && !self.hold);
                if self.mode != Mode::Normal || !free || self.cancel_jog {
                    return Err(Error::NotIdle);
                }
                let (state, actions) = interpret_jog(jog, &self.gcode, &self.settings)?;
                self.gcode = state;
                self.jogging = true;
                Ok(Job::Actions { actions, dwell: None })
            }
            [b'$', ..] => {
                let command = system::parse(line)?;
                self.obey(command, stepper)
            }
            _ if self.mode == Mode::Alarm || self.jogging => Err(Error::Locked),
            _ => {
                let (state, actions) = interpret(line, &self.gcode, &self.settings)?;
                if state.offset != self.gcode.offset {
                    self.offset_report = 0;
                }
                self.gcode = state;
                if self.mode == Mode::Check {
                    return Ok(Job::None);
                }
                Ok(Job::Actions { actions, dwell: None })
            }
        }
    }

    fn obey(&mut self, command: SystemCommand, stepper: &mut impl StepSink) -> Result<Job, Error> {
        let still = self.is_still(stepper) && !self.hold;
        let anywhere = matches!(command, SystemCommand::Help | SystemCommand::Modal);
        if !(still || anywhere) {
            return Err(Error::NotIdle);
        }
        match command {
            SystemCommand::Help => {
                self.transmitter.text("[HLP:$$ $# $G $I $N $x=val $C $X $H $J=line $RST= ~ ! ? ctrl-x]")
            }
            SystemCommand::Settings => return Ok(Job::Settings(0)),
            SystemCommand::Parameters => return Ok(Job::Parameters(0)),
            SystemCommand::Modal => self.transmitter.modal(&self.gcode, &self.settings),
            SystemCommand::Version => {
                self.transmitter.version(false, BLOCKS, crate::RX_BYTES);
                self.transmitter.version(true, BLOCKS, crate::RX_BYTES);
            }
            SystemCommand::StartupLines => {
                self.transmitter.text("$N0=");
                self.transmitter.text("$N1=");
            }
            SystemCommand::CheckMode if self.mode == Mode::Check => {
                self.transmitter.text("[MSG:Disabled]");
                self.mode = Mode::Normal;
                self.reset = true;
            }
            SystemCommand::CheckMode => {
                if self.mode != Mode::Normal {
                    return Err(Error::NotIdle);
                }
                self.transmitter.text("[MSG:Enabled]");
                self.mode = Mode::Check;
            }
            SystemCommand::Unlock => {
                if self.mode == Mode::Alarm {
                    self.transmitter.text("[MSG:Caution: Unlocked]");
                    self.mode = Mode::Normal;
                }
            }
            SystemCommand::Home => return Err(Error::HomingDisabled),
            SystemCommand::RestoreSettings => {
                self.settings = self.defaults.clone();
                self.apply_settings(stepper);
            }
            SystemCommand::ClearOffsets => {
                self.gcode.offset = [0.0; AXES];
                self.offset_report = 0;
            }
            SystemCommand::Set(id, value) => {
                self.settings.set(id, value)?;
                self.apply_settings(stepper);
            }
        }
        Ok(Job::None)
    }

    fn apply_settings(&mut self, stepper: &mut impl StepSink) {
        stepper.configure(self.wiring());
        // The steps stay, so with another scale the position in mm changes.
        self.sync_position(stepper);
    }

    /// Does the next of `actions`.
    fn act(&mut self, actions: &mut Actions, dwell: &mut Option<u64>, stepper: &mut impl StepSink) -> Progress {
        if let Some(pen) = actions.pen {
            if self.settings.laser_mode {
                self.waiting_pen = Some(pen);
            } else if !self.is_drained(stepper) || !stepper.push(Command::Pen(pen)) {
                return Progress::Waiting;
            }
            actions.pen = None;
            return Progress::Moved;
        }
        if let Some(seconds) = actions.dwell {
            return self.dwell(seconds, actions, dwell, stepper);
        }
        if let Some(path) = &mut actions.motion {
            let progress = self.plan(path);
            if matches!(progress, Progress::Done) {
                actions.motion = None;
                return if actions.flow == Flow::Run { Progress::Done } else { Progress::Moved };
            }
            return progress;
        }
        match actions.flow {
            Flow::Run => Progress::Done,
            Flow::Pause => {
                // Held once everything before has been drawn; then the line ends at `~`.
                if !self.is_drained(stepper) {
                    return Progress::Waiting;
                }
                self.hold = true;
                actions.flow = Flow::Paused;
                Progress::Moved
            }
            Flow::Paused if self.hold => Progress::Waiting,
            Flow::Paused => Progress::Done,
            Flow::End => {
                if !self.is_drained(stepper) || !stepper.push(Command::Pen(Pen::Off)) {
                    return Progress::Waiting;
                }
                self.gcode.end_program();
                self.overrides = Overrides::default();
                self.transmitter.text("[MSG:Pgm End]");
                Progress::Done
            }
        }
    }

    /// Everything before has been drawn, and nothing holds.
    fn is_drained(&self, stepper: &impl StepSink) -> bool {
        !self.hold && self.is_still(stepper)
    }

    /// G4: waits for the motion, hands the time to the stepper piece by piece, and waits for its end.
    fn dwell(
        &mut self,
        seconds: f64,
        actions: &mut Actions,
        left: &mut Option<u64>,
        stepper: &mut impl StepSink,
    ) -> Progress {
        match *left {
            None if self.is_drained(stepper) => {
                // Saturates: half a million years.
                *left = Some(libm::ceil(seconds * 1e6) as u64);
                Progress::Moved
            }
            None => Progress::Waiting,
            Some(0) if stepper.is_idle() => {
                actions.dwell = None;
                Progress::Moved
            }
            Some(0) => Progress::Waiting,
            Some(rest) => {
                let piece = rest.min(DWELL_PIECE);
                if !stepper.push(Command::Dwell(piece as u32)) {
                    return Progress::Waiting;
                }
                *left = Some(rest - piece);
                Progress::Moved
            }
        }
    }

    /// Plans the next straight piece of `path`.
    fn plan(&mut self, path: &mut Path) -> Progress {
        if self.planner.is_full() {
            return Progress::Waiting;
        }
        let (target, speed, last) = match path {
            Path::Line { target, speed } => (*target, *speed, true),
            Path::Arc(arc) => match arc.next() {
                Some(target) => (target, arc.speed, false),
                None => return Progress::Done,
            },
        };
        if !self.settings.in_travel(target) {
            self.soft_limit();
            return Progress::Waiting;
        }
        self.append(target, speed);
        if last { Progress::Done } else { Progress::Moved }
    }

    fn append(&mut self, target: [f64; AXES], speed: Speed) {
        if self.planner.append(target, speed, self.waiting_pen, self.gcode.line, &self.settings) {
            self.waiting_pen = None;
        }
    }

    /// Stops with deceleration and waits for a reset.
    fn soft_limit(&mut self) {
        self.hold = true;
        self.mode = Mode::NeedsReset;
        self.transmitter.alarm(Alarm::SoftLimit);
        self.transmitter.text("[MSG:Reset to continue]");
    }

    fn report_status(&mut self, stepper: &impl StepSink) {
        let moving = !stepper.is_idle() || self.running;
        let state = match self.mode {
            Mode::Alarm | Mode::NeedsReset => "Alarm",
            _ if self.jogging => "Jog",
            _ if self.hold && moving && self.planner.speed_sqr > 0.0 => "Hold:1",
            _ if self.hold && !stepper.is_idle() => "Hold:1",
            _ if self.hold => "Hold:0",
            Mode::Check => "Check",
            Mode::Normal if moving || !self.planner.is_empty() => "Run",
            Mode::Normal => "Idle",
        };
        let with_offset = self.offset_report == 0;
        self.offset_report = if with_offset { REPORT_CYCLE } else { self.offset_report - 1 };
        let with_overrides = !with_offset && self.override_report == 0;
        if with_overrides {
            self.override_report = REPORT_CYCLE;
        } else {
            self.override_report = self.override_report.saturating_sub(1);
        }
        let feed = f64::from(libm::sqrtf(self.planner.speed_sqr)) * 60.0;
        let status = Status {
            state,
            position: self.millimetres(stepper.position()),
            offset: self.gcode.offset,
            blocks_free: self.planner.free(),
            rx_free: self.receiver.free(),
            line: self.planner.current.as_ref().map_or(0, |c| c.block.line),
            feed,
            speed: if self.gcode.spindle == Spindle::Off { 0.0 } else { self.gcode.speed },
            overrides: with_overrides.then_some((self.overrides.feed, self.overrides.rapid)),
            with_offset,
            settings: &self.settings,
        };
        self.transmitter.status(&status);
    }
}
