//! Follows a G-code job line by line, as GRBL and Marlin read it.

mod arc;
mod chords;
mod modal;

use glam::{DVec2, DVec3};

pub use chords::{Chorded, chorded};
pub use modal::{Coordinates, Distance, FeedMode, Modal, Motion, Plane, Spindle, Units};

use super::timing::{Pace, Timer};
use super::{Cut, Position, Step, Trace};
use crate::device::{Device, Dialect, Gcode, Pen};
use crate::protocol::grbl::{Job, Line, Turn, clean, words};
use arc::Arc;

/// S values and heights of the pen that differ by less are the same; profiles write them with three decimals at most.
const SAME: f64 = 1e-6;

/// What must be known of a machine to follow a job for it.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// How its pen is lifted.
    pub pen: Pen,
    /// Lines that have the pen changed; `{pen}` stands for its number.
    pub pen_change: Vec<String>,
    /// Whose G-code it reads.
    pub dialect: Dialect,
    /// How fast it is.
    pub pace: Pace,
}

impl Machine {
    /// That of a device; none if it speaks no G-code.
    #[must_use]
    pub fn of(device: &Device) -> Option<Self> {
        device.language.gcode().map(|gcode| Self::new(device, gcode))
    }

    /// That of a device that speaks this.
    #[must_use]
    pub fn new(device: &Device, gcode: &Gcode) -> Self {
        Self { pen: gcode.pen, pen_change: gcode.pen_change.clone(), dialect: gcode.dialect, pace: Pace::of(device) }
    }
}

impl Machine {
    /// What may be taken for granted before a job: Marlin reads millimetres and arcs in the xy plane, and often knows nothing else, and absolute
    /// coordinates unless it is told otherwise; its place at the ends of strokes shows whether that is so. A controller of the GRBL kind is
    /// asked.
    #[must_use]
    pub fn before(&self) -> Modal {
        if self.dialect != Dialect::Marlin {
            return Modal::default();
        }
        Modal {
            units: Some(Units::Millimetres),
            distance: Some(Distance::Absolute),
            plane: Some(Plane::Xy),
            ..Modal::default()
        }
    }
}

/// What a G-code job does, and the state of the controller after each of its lines.
#[derive(Clone, Debug, PartialEq)]
pub struct Followed {
    /// A step for each line.
    pub trace: Trace,
    /// States that differ from the one before, with the index of the first line after which they hold.
    states: Vec<(usize, Modal)>,
    before: Modal,
}

impl Followed {
    /// The state of the controller after the line of this index of the job; that before the first line when there is none.
    #[must_use]
    pub fn state_after(&self, index: Option<usize>) -> &Modal {
        let Some(index) = index else { return &self.before };
        let count = self.states.partition_point(|(first, _)| *first <= index);
        count.checked_sub(1).and_then(|at| self.states.get(at)).map_or(&self.before, |(_, state)| state)
    }
}

/// Follows a job that finds the controller in the state `before` and the pen at `start`: [`Modal::default`] and
/// [`Position::UNKNOWN`] when nothing is known of them. Cost: linear.
#[must_use]
pub fn follow(job: &Job, machine: &Machine, before: &Modal, start: Position) -> Followed {
    followed(job, Follower::new(machine, before, start, Some(Timer::new(&machine.pace, job.lines().len()))))
}

/// As [`follow`], for those who do not ask how long it takes: the seconds are 0.
#[must_use]
pub fn places(job: &Job, machine: &Machine, before: &Modal, start: Position) -> Followed {
    followed(job, Follower::new(machine, before, start, None))
}

fn followed(job: &Job, mut follower: Follower<'_>) -> Followed {
    let before = follower.modal.clone();
    let steps = job.lines().iter().enumerate().map(|(index, line)| follower.line(index, line)).collect();
    let mut trace = Trace { steps };
    let seconds = follower.timer.map(Timer::finish).unwrap_or_default();
    for (step, seconds) in trace.steps.iter_mut().zip(seconds) {
        step.seconds = seconds;
    }
    Followed { trace, states: follower.states, before }
}

/// How a line goes over the paper from the end of the one before to its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Way {
    /// Straight.
    Straight,
    /// Along an arc.
    Arc {
        /// Its centre in mm.
        centre: DVec2,
        /// Counter-clockwise from where it begins, in radians.
        angle: f64,
    },
}

/// Follows a job as [`follow`] does, and tells `each` of its lines what it does, but for its time, and which way it goes. Cost: linear; nothing is held.
pub fn follow_ways(
    job: &Job,
    machine: &Machine,
    before: &Modal,
    start: Position,
    each: &mut dyn FnMut(&Line, Step, Way),
) {
    let mut follower = Follower::new(machine, before, start, None);
    for (index, line) in job.lines().iter().enumerate() {
        let step = follower.line(index, line);
        each(line, step, follower.way);
    }
}

struct Follower<'a> {
    machine: &'a Machine,
    modal: Modal,
    position: [Option<f64>; 3],
    pen: u32,
    pen_down: Option<bool>,
    /// Whether the pen was up and has not been lifted again: a stroke, or the way down to one.
    in_stroke: bool,
    states: Vec<(usize, Modal)>,
    /// None where nobody asks for times.
    timer: Option<Timer>,
    /// The pen has been moved, and the machine has not been asked how it stands since.
    unasked: bool,
    /// How the last line went.
    way: Way,
}

/// The words of a line, sorted by what they do.
#[derive(Default)]
struct Block {
    axes: [Option<f64>; 3],
    centre: [Option<f64>; 3],
    radius: Option<f64>,
    dwell: bool,
    p: Option<f64>,
    s: Option<f64>,
    machine_coordinates: bool,
    set_position: bool,
    clear_offset: bool,
    /// Whether the axis words are for something that is not followed; the pen is anywhere then.
    elsewhere: bool,
    /// Whether the line sets a state that is not followed.
    unknown: bool,
    end: bool,
    rests: bool,
    /// Whether S and P are for a servo of Marlin's.
    servo: bool,
    /// Whether S and P are for something that has nothing to do with the drawing.
    foreign: bool,
}

impl<'a> Follower<'a> {
    fn new(machine: &'a Machine, before: &Modal, start: Position, timer: Option<Timer>) -> Self {
        let mut follower = Self {
            machine,
            modal: before.clone(),
            position: start.axes(),
            pen: 1,
            pen_down: None,
            in_stroke: false,
            states: Vec::new(),
            timer,
            unasked: false,
            way: Way::Straight,
        };
        follower.pen_down = follower.pen_of_state();
        follower
    }

    fn line(&mut self, index: usize, line: &Line) -> Step {
        let before = self.modal.clone();
        let mut step = Step::default();
        self.way = Way::Straight;
        self.time(|timer| timer.piece(index, line.text.len()));
        self.pen_number(line);
        if line.text.starts_with(['$', '[']) {
            self.system(&line.text);
        } else {
            self.block(&line.text, &mut step);
        }
        if line.turn != Turn::Streamed {
            self.rest();
        }
        let was = self.pen_down;
        self.pen_down = self.pen_of_state();
        step.cut = match (was, self.pen_down) {
            (Some(true) | None, Some(false)) => {
                self.in_stroke = false;
                Cut::StrokeEnd
            }
            (Some(false), Some(true) | None) => {
                self.in_stroke = true;
                Cut::StrokeStart
            }
            (None, Some(true)) if !self.in_stroke => {
                self.in_stroke = true;
                Cut::StrokeStart
            }
            _ => Cut::None,
        };
        self.unasked |= step.cut != Cut::None;
        if self.modal != before {
            self.states.push((index, self.modal.clone()));
        }
        Step { end: Position::from_axes(self.position), pen_down: self.pen_down, pen: self.pen, ..step }
    }

    /// `$` lines: only those that neither move nor change how lines are read leave everything known.
    fn system(&mut self, text: &str) {
        let harmless = matches!(text, "$" | "$$" | "$#" | "$G" | "$I" | "$N" | "$X");
        if !harmless {
            self.lose();
        }
    }

    /// Something happens that is not followed.
    fn lose(&mut self) {
        self.position = [None; 3];
        self.modal = Modal { shift: [None; 3], ..Modal::default() };
        self.rest();
    }

    fn block(&mut self, text: &str, step: &mut Step) {
        let mut block = Block::default();
        let mut feed = None;
        for (letter, value) in words(text) {
            if !value.is_finite() {
                // `G28 X Y`: a letter by itself names an axis that is homed.
                if block.elsewhere && matches!(letter, 'X' | 'Y' | 'Z') {
                    continue;
                }
                block.unknown = true;
                break;
            }
            match letter {
                'G' => self.g(value, &mut block),
                'M' => self.m(value, &mut block),
                'X' => block.axes[0] = Some(value),
                'Y' => block.axes[1] = Some(value),
                'Z' => block.axes[2] = Some(value),
                'I' => block.centre[0] = Some(value),
                'J' => block.centre[1] = Some(value),
                'K' => block.centre[2] = Some(value),
                'R' => block.radius = Some(value),
                'F' => feed = Some(value),
                'P' => block.p = Some(value),
                'S' => block.s = Some(value),
                'T' => self.pen = if (1.0..=255.0).contains(&value) { value as u32 } else { self.pen },
                'N' | 'L' | 'E' => {}
                // Other axes.
                _ => block.elsewhere = true,
            }
        }
        if block.unknown {
            return self.lose();
        }
        let unit = self.modal.units.map(Units::mm);
        if let Some(feed) = feed {
            self.modal.feed = match self.modal.feed_mode {
                Some(FeedMode::InverseTime) => None,
                _ => unit.map(|mm| feed * mm),
            };
        }
        let marlin = self.machine.dialect == Dialect::Marlin;
        let mut dwell = None;
        if block.servo {
            if matches!(self.machine.pen, Pen::Servo { index, .. } if block.p.unwrap_or(0.0) == f64::from(index)) {
                self.modal.servo = block.s;
            }
        } else if block.dwell {
            // Marlin counts P in milliseconds and S in seconds; for GRBL, S is the speed of a spindle.
            dwell = match (block.p, block.s) {
                (None, Some(s)) if marlin => Some(s),
                (Some(p), _) if marlin => Some(p / 1000.0),
                (p, _) => p,
            };
        } else if block.s.is_some() && !block.foreign {
            self.modal.speed = block.s;
        }
        if self.pen_of_state() != self.pen_down && !marlin {
            // A servo waits for the motion before it.
            self.rest();
        }
        if let Some(seconds) = dwell {
            // Days are enough, and a job that asks for more does not overflow anything.
            self.time(|timer| timer.dwell(seconds.clamp(0.0, 1e6)));
            self.ask();
        }
        if block.rests {
            self.rest();
        }
        self.axis_words(&block, unit, step);
        if block.end {
            self.modal.end_program();
        }
    }

    /// What the axis words of a line do.
    fn axis_words(&mut self, block: &Block, unit: Option<f64>, step: &mut Step) {
        let mm = |value: Option<f64>| Some(value? * unit?);
        if block.clear_offset {
            // What G92 had set before the job is cleared with it, and nothing is known of that.
            self.position = [None; 3];
            self.modal.shift = [None; 3];
        }
        if block.elsewhere {
            self.position = [None; 3];
            return self.rest();
        }
        if block.set_position {
            for axis in 0..3 {
                if block.axes[axis].is_some() {
                    let to = mm(block.axes[axis]);
                    let moved = self.position[axis].zip(to).map(|(from, to)| from - to);
                    self.modal.shift[axis] = self.modal.shift[axis].zip(moved).map(|(shift, by)| shift + by);
                    self.position[axis] = to;
                }
            }
            return;
        }
        if block.axes == [None; 3] {
            return;
        }
        let start = self.position;
        for ((at, from), word) in self.position.iter_mut().zip(start).zip(block.axes) {
            if word.is_some() {
                *at = match self.modal.distance {
                    _ if block.machine_coordinates => None,
                    Some(Distance::Absolute) => mm(word),
                    Some(Distance::Incremental) => from.zip(mm(word)).map(|(from, by)| from + by),
                    None => None,
                };
            }
        }
        if matches!(self.modal.motion, None | Some(Motion::Cancelled | Motion::Probe)) {
            self.position = [None; 3];
            return self.rest();
        }
        self.motion(block, unit, start, step);
    }

    /// Lengths and time of a motion from `start` to where the pen is now.
    fn motion(&mut self, block: &Block, unit: Option<f64>, start: [Option<f64>; 3], step: &mut Step) {
        let end = self.position;
        let still = |axis: usize| block.axes[axis].is_none();
        // An axis that does not move is no unknown of the length.
        let known = |axis: usize| start[axis].zip(end[axis]).or(still(axis).then_some((0.0, 0.0)));
        let (Some(x), Some(y), Some(z)) = (known(0), known(1), known(2)) else { return self.rest() };
        let (from, to) = (DVec3::new(x.0, y.0, z.0), DVec3::new(x.1, y.1, z.1));
        let arc = match self.modal.motion {
            Some(Motion::ArcClockwise | Motion::ArcCounterClockwise) => {
                let (Some(mm), Some(plane)) = (unit, self.modal.plane) else { return self.rest() };
                let clockwise = self.modal.motion == Some(Motion::ArcClockwise);
                let centre = block.centre.map(|offset| offset.map(|value| value * mm));
                match Arc::new(from, to, plane, centre, block.radius.map(|r| r * mm), clockwise) {
                    Some(arc) => Some(arc),
                    // The controller refuses it.
                    None => return self.rest(),
                }
            }
            _ => None,
        };
        if let Some((centre, angle)) = arc.as_ref().and_then(Arc::on_paper) {
            self.way = Way::Arc { centre: from.truncate() + centre, angle };
        }
        let way = to - from;
        let paper = arc.as_ref().map_or(way.truncate().length(), Arc::length_on_paper);
        if self.pen_down == Some(true) && self.pen_of_state() == Some(true) {
            step.ink_mm = paper;
        } else {
            step.travel_mm = paper;
        }
        // On Marlin, G0 is as fast as the feed.
        let is_rapid = self.modal.motion == Some(Motion::Rapid) && self.machine.dialect != Dialect::Marlin;
        let feed = self.modal.feed.filter(|feed| *feed > 0.0);
        if feed.is_none() && !is_rapid {
            return self.rest();
        }
        let feed = feed.filter(|_| !is_rapid);
        self.ask();
        self.time(|timer| match &arc {
            Some(arc) => arc.chords().for_each(|chord| timer.go(chord, feed)),
            None if way != DVec3::ZERO => timer.go(way, feed),
            None => {}
        });
    }

    /// Where the pen has come up or down, the machine is asked how it stands.
    fn ask(&mut self) {
        if std::mem::take(&mut self.unasked) {
            self.time(Timer::ask);
        }
    }

    /// The motion so far ends at rest.
    fn rest(&mut self) {
        self.time(Timer::rest);
    }

    fn time(&mut self, what: impl FnOnce(&mut Timer)) {
        if let Some(timer) = &mut self.timer {
            what(timer);
        }
    }

    /// Whether the pen is down in the state as it is.
    fn pen_of_state(&self) -> Option<bool> {
        match self.machine.pen {
            Pen::Servo { up, down, .. } if self.machine.dialect == Dialect::Marlin => {
                side(self.modal.servo?, f64::from(up), f64::from(down))
            }
            Pen::Servo { up, down, .. } => {
                let speed = match self.modal.spindle? {
                    Spindle::Off => 0.0,
                    Spindle::Clockwise | Spindle::CounterClockwise => self.modal.speed?,
                };
                // At 0 there is no signal. A servo that has its place with the pen up there was made for that; any other stays
                // where it is, as long as nothing pulls at it.
                if speed == 0.0 && up != 0 && down != 0 {
                    return self.pen_down.filter(|down| !down);
                }
                side(speed, f64::from(up), f64::from(down))
            }
            Pen::Z { up_mm, down_mm, .. } => {
                let z = self.position[2]?;
                if z >= up_mm - SAME {
                    Some(false)
                } else if z <= down_mm + SAME {
                    Some(true)
                } else {
                    None
                }
            }
        }
    }

    /// Takes note of a change of pens, by the device's own lines for it.
    fn pen_number(&mut self, line: &Line) {
        let comment = match &line.turn {
            Turn::Pause(comment) => comment.as_str(),
            _ => "",
        };
        for template in self.machine.pen_change.iter().filter(|template| template.contains("{pen}")) {
            let numbers = line.text.split(|c: char| !c.is_ascii_digit());
            let numbers = numbers.chain(comment.split(|c: char| !c.is_ascii_digit()));
            for number in numbers.filter_map(|digits| digits.parse::<u32>().ok()) {
                let (text, said) = clean(&template.replace("{pen}", &number.to_string()));
                if text == line.text && (said == comment || line.turn == Turn::Streamed) {
                    self.pen = number;
                    return;
                }
            }
        }
    }

    fn g(&mut self, value: f64, block: &mut Block) {
        let modal = &mut self.modal;
        // Codes have one decimal at most.
        match (value * 10.0).round() as i64 {
            0 => modal.motion = Some(Motion::Rapid),
            10 => modal.motion = Some(Motion::Linear),
            20 => modal.motion = Some(Motion::ArcClockwise),
            30 => modal.motion = Some(Motion::ArcCounterClockwise),
            40 => block.dwell = true,
            170 => modal.plane = Some(Plane::Xy),
            180 => modal.plane = Some(Plane::Zx),
            190 => modal.plane = Some(Plane::Yz),
            200 => modal.units = Some(Units::Inches),
            210 => modal.units = Some(Units::Millimetres),
            382..=385 => {
                modal.motion = Some(Motion::Probe);
                block.elsewhere = true;
            }
            // What every header holds and what is so anyway: no cutter compensation, incremental centres, exact path.
            400 | 911 | 610 | 640 => {}
            530 => block.machine_coordinates = true,
            code @ (540 | 550 | 560 | 570 | 580 | 590) => {
                let system = Coordinates((code / 10) as u8);
                if modal.coordinates != Some(system) {
                    modal.coordinates = Some(system);
                    self.position = [None; 3];
                }
            }
            800 => modal.motion = Some(Motion::Cancelled),
            900 => modal.distance = Some(Distance::Absolute),
            910 => modal.distance = Some(Distance::Incremental),
            920 => block.set_position = true,
            921 => block.clear_offset = true,
            930 => {
                modal.feed_mode = Some(FeedMode::InverseTime);
                modal.feed = None;
            }
            940 => modal.feed_mode = Some(FeedMode::PerMinute),
            // Tool lengths shift z.
            431 | 490 => self.position[2] = None,
            // Origins are set, and places that only the controller knows are gone to.
            100 | 280 | 281 | 300 | 301 => block.elsewhere = true,
            _ => block.unknown = true,
        }
    }

    fn m(&mut self, value: f64, block: &mut Block) {
        match (value * 10.0).round() as i64 {
            0 | 10 | 4000 => block.rests = true,
            20 | 300 => {
                block.rests = true;
                block.end = true;
            }
            30 => self.modal.spindle = Some(Spindle::Clockwise),
            40 => self.modal.spindle = Some(Spindle::CounterClockwise),
            50 => self.modal.spindle = Some(Spindle::Off),
            // Tools, coolant, overrides; for Marlin motors on, heaters, fans, reports, limits of speed.
            60 | 70 | 80 | 90 | 170 | 560 => {}
            820 | 1040 | 1060 | 1070 | 1100 | 1140 | 1150 | 1190 | 1400 | 1550 | 2010 | 2030 | 2040 | 2050 | 2200 => {
                block.foreign = true;
            }
            2800 => block.servo = true,
            _ => block.unknown = true,
        }
    }
}

/// On which side of the pen's way a servo is: `Some(true)` at or beyond its place with the pen down.
fn side(at: f64, up: f64, down: f64) -> Option<bool> {
    let way = (at - up) / (down - up);
    if way <= SAME {
        Some(false)
    } else if way >= 1.0 - SAME {
        Some(true)
    } else {
        None
    }
}

#[cfg(test)]
mod tests;
