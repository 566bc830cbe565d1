//! What is left of a G-code job, with the lines that bring the machine into the state in which it begins.

use glam::DVec3;

use super::Rest;
use crate::device::{Device, Dialect, Gcode, Pen};
use crate::emit::decimal;
use crate::protocol::grbl::{Job, Line, Turn, words};
use crate::trace::Step;
use crate::trace::gcode::{Distance, FeedMode, Followed, Modal, Motion, Plane, Spindle, Units};

/// Decimals of a position in mm: finer than any step.
const DECIMALS: usize = 4;

/// Heights that differ by less are the same, mm.
const SAME: f64 = 1e-6;

/// Where a job goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Start {
    /// Index of the first line that is sent again.
    line: usize,
    /// Where the pen must be before it, in the coordinates of the job.
    place: DVec3,
    pen_down: bool,
    pen: u32,
}

/// The rest of a job of which `executed` lines were carried out, begun `overlap_mm` further back along the stroke where it
/// was broken off within one. `pen` is the pen that the machine holds.
///
/// The lines keep their numbers; those that are put before them bear the number of the first of them.
#[must_use]
pub fn rest(
    job: &Job,
    followed: &Followed,
    executed: usize,
    overlap_mm: f64,
    device: &Device,
    gcode: &Gcode,
    pen: u32,
) -> Rest {
    let known = Known { job, followed, gcode, shifts: shifts(job) };
    let Some(start) = known.last(executed).map(|start| known.back(start, overlap_mm)) else {
        return Rest { job: text(&[], job.lines()), added: 0, skipped: 0 };
    };
    let lines = known.preamble(&start, device, pen);
    let rest = job.lines().get(start.line..).unwrap_or_default();
    Rest { job: text(&lines, rest), added: lines.len(), skipped: start.line }
}

/// Whether a job moves its own origin (G92).
#[must_use]
pub fn shifts(job: &Job) -> bool {
    job.lines().iter().any(|line| words(&line.text).any(|(letter, value)| letter == 'G' && value.floor() == 92.0))
}

struct Known<'a> {
    job: &'a Job,
    followed: &'a Followed,
    gcode: &'a Gcode,
    shifts: bool,
}

impl Known<'_> {
    fn step(&self, line: usize) -> Option<&Step> {
        self.followed.trace.steps.get(line)
    }

    /// The last place, no further than after so many lines, at which all is known that is needed to begin there.
    fn last(&self, executed: usize) -> Option<Start> {
        (1..=executed.min(self.job.lines().len())).rev().find_map(|line| self.start(line))
    }

    /// How to begin at a line; none if something about it is not known.
    fn start(&self, line: usize) -> Option<Start> {
        let before = line.checked_sub(1)?;
        let step = self.step(before)?;
        let state = self.followed.state_after(Some(before));
        state.units.zip(state.distance)?;
        let (x, y) = step.end.x.zip(step.end.y)?;
        let z = match self.gcode.pen {
            Pen::Z { .. } => step.end.z?,
            Pen::Servo { .. } => step.end.z.unwrap_or(0.0),
        };
        if self.shifts && state.shift.iter().any(Option::is_none) {
            return None;
        }
        // An arc, or G1 without a feed, cannot be made the motion that goes without saying; then the next line must say it.
        let goes_without = match state.motion {
            Some(Motion::Rapid) => true,
            Some(Motion::Linear) => state.feed.is_some_and(|feed| feed > 0.0),
            _ => false,
        };
        if !goes_without && !self.says_its_motion(line) {
            return None;
        }
        Some(Start { line, place: DVec3::new(x, y, z), pen_down: step.pen_down?, pen: step.pen })
    }

    /// Whether the next line that goes anywhere, from `line` on, says how.
    fn says_its_motion(&self, line: usize) -> bool {
        let mut rest = self.job.lines().iter().skip(line);
        let next = rest.find(|line| words(&line.text).any(|(letter, _)| matches!(letter, 'X' | 'Y' | 'Z')));
        next.is_none_or(|line| words(&line.text).any(|(letter, value)| letter == 'G' && (0.0..4.0).contains(&value)))
    }

    /// Goes back by a length along the stroke, as far as it goes.
    fn back(&self, start: Start, length_mm: f64) -> Start {
        let (mut start, mut left) = (start, length_mm);
        while left > 0.0 && start.pen_down {
            let index = start.line - 1;
            let (Some(step), Some(before)) = (self.step(index), self.start(index).filter(|before| before.pen_down))
            else {
                break;
            };
            let state = self.followed.state_after(Some(index));
            let straight = state.motion == Some(Motion::Linear) && state.distance == Some(Distance::Absolute);
            if straight && step.ink_mm > left {
                start.place = start.place.lerp(before.place, left / step.ink_mm);
                start.line = index;
                break;
            }
            left -= step.ink_mm;
            start = before;
        }
        start
    }

    /// The lines that bring the machine to the start, whatever state it is in; in mm and absolute, until the last of them.
    fn preamble(&self, start: &Start, device: &Device, pen: u32) -> Vec<String> {
        let state = self.followed.state_after(start.line.checked_sub(1));
        let marlin = self.gcode.dialect == Dialect::Marlin;
        // A Marlin that is built without inches knows neither G20 nor G21.
        let units = |line: &Line| words(&line.text).any(|word| matches!(word, ('G', 20.0 | 21.0)));
        let says_units = !marlin || self.job.lines().iter().any(units);
        let mut lines = if says_units { vec!["G21".to_owned()] } else { Vec::new() };
        lines.push("G90".to_owned());
        if !marlin {
            // Marlin is built without them, mostly.
            lines.extend(["G17".to_owned(), "G94".to_owned()]);
        }
        if self.shifts {
            lines.push("G92.1".to_owned());
        }
        if let Some(coordinates) = state.coordinates {
            lines.push(format!("G{}", coordinates.0));
        }
        lines.extend(self.gcode.pen_up());
        if start.pen != 1 || pen != start.pen {
            lines.extend(self.gcode.pen_change.iter().map(|line| device.fill(line, start.pen)));
        }
        let shift = DVec3::from_array(state.shift.map(Option::unwrap_or_default));
        let to = start.place + shift;
        let feed = if marlin { format!("F{}", decimal(device.travel_feed, 1)) } else { String::new() };
        lines.push(format!("G0X{}Y{}{feed}", decimal(to.x, DECIMALS), decimal(to.y, DECIMALS)));
        if shift != DVec3::ZERO {
            let [x, y] = [start.place.x, start.place.y].map(|value| decimal(value, DECIMALS));
            // A pen on Z is at its own height now, which the job may call another.
            let z = match self.gcode.pen {
                Pen::Z { up_mm, .. } => format!("Z{}", decimal(up_mm - shift.z, DECIMALS)),
                Pen::Servo { .. } => String::new(),
            };
            lines.push(format!("G92X{x}Y{y}{z}"));
        }
        if start.pen_down {
            lines.extend(self.gcode.pen_down());
        }
        self.pen_as_it_was(start, state, &mut lines);
        modes(state, marlin, &mut lines);
        lines
    }

    /// Where the job moves a pen on Z otherwise than the profile does, and what it has switched on besides.
    fn pen_as_it_was(&self, start: &Start, state: &Modal, lines: &mut Vec<String>) {
        // A servo is at a level of the profile, or it is not known whether it draws.
        let Pen::Z { up_mm, down_mm, feed, .. } = self.gcode.pen else { return };
        let here = if start.pen_down { down_mm } else { up_mm };
        if (start.place.z - here).abs() > SAME {
            lines.push(format!("G1Z{}F{}", decimal(start.place.z, DECIMALS), decimal(feed, 1)));
        }
        let word = match state.spindle {
            Some(Spindle::Clockwise) => "M3",
            Some(Spindle::CounterClockwise) => "M4",
            Some(Spindle::Off) | None => return,
        };
        let speed = state.speed.map(|speed| format!("S{}", decimal(speed, 3))).unwrap_or_default();
        lines.push(format!("{word}{speed}"));
    }
}

/// The modes that a job has set, from those that the preamble uses: G21, G90, G17, G94.
fn modes(state: &Modal, marlin: bool, lines: &mut Vec<String>) {
    if let Some(feed) = state.feed.filter(|feed| *feed > 0.0) {
        // Marlin takes F for that of a motion.
        lines.push(format!("{}F{}", if marlin { "G1" } else { "" }, decimal(feed, 3)));
    }
    match state.motion {
        Some(Motion::Rapid) => lines.push("G0".to_owned()),
        // GRBL refuses it as long as there is no feed.
        Some(Motion::Linear) if state.feed.is_some_and(|feed| feed > 0.0) && !marlin => lines.push("G1".to_owned()),
        _ => {}
    }
    match state.plane {
        Some(Plane::Zx) => lines.push("G18".to_owned()),
        Some(Plane::Yz) => lines.push("G19".to_owned()),
        Some(Plane::Xy) | None => {}
    }
    if state.feed_mode == Some(FeedMode::InverseTime) {
        lines.push("G93".to_owned());
    }
    if state.units == Some(Units::Inches) {
        lines.push("G20".to_owned());
    }
    if state.distance == Some(Distance::Incremental) {
        lines.push("G91".to_owned());
    }
}

/// G-code that reads as these lines with the numbers that they have, and before them some with the number of the first.
/// Lines that end in a carriage return share the number of the one behind it.
fn text(preamble: &[String], lines: &[Line]) -> Vec<u8> {
    let first = lines.first().map_or(1, |line| line.number);
    let mut text = "\n".repeat(first.saturating_sub(1));
    for line in preamble {
        text.push_str(line);
        text.push('\r');
    }
    let mut number = first;
    for (index, line) in lines.iter().enumerate() {
        if index > 0 && line.number == number {
            text.push('\r');
        }
        while number < line.number {
            text.push('\n');
            number += 1;
        }
        text.push_str(&line.text);
        if let Turn::Pause(comment) = &line.turn {
            text.push(';');
            text.push_str(comment);
        }
    }
    text.push('\n');
    text.into_bytes()
}

#[cfg(test)]
mod tests;
