//! Where a job is held against what it should have done, and what is sent for each of its lines.
//!
//! GRBL has no checksum, so the job is cut where the pen has just been lowered or lifted and the machine is at rest anyway.
//! There `$G` tells whether the pen, the units and all else are as they should be, and `?` where the machine is. What is
//! drawn in between goes out in differences (`G91`), so that the place at its end is the sum of all its lines: a line that
//! was lost, doubled or changed on the way shows there, which it would not if each line said where to go anew.
//!
//! ```text
//!  as the job has it            as it is sent
//!  G0 X10 Y20                   G0X10Y20
//!  M3 S1000                     G0M3S1000
//!  G4 P0.2                      G91G4P0.2            check: pen, G91, place
//!  G1 X30.5 Y20 F2000           G1X20.5Y0F2000
//!  G1 X30.5 Y40.123             G1X0Y20.123
//!  M3 S0                        G1G90M3S0
//!  G4 P0.15                     G4P0.15              check: pen, G90, place
//! ```
//!
//! No two lines make a legal one when the line end between them is lost: each line of a stroke has both coordinates, and a
//! line that moves the pen names the motion of the line before it, which GRBL refuses to find twice in a line.

use super::job::{Job, Line, Turn, words};
use crate::emit::decimal;
use crate::trace::gcode::{Distance, Followed, Modal, Motion, Plane, Units};

/// Decimals of the differences: GRBL reports with three, and a step is coarser.
const DECIMALS: usize = 3;
/// Coordinates beyond are no plotter's, mm; up to here a float of 32 bits resolves a hundredth.
const COORDINATE_MAX: f64 = 1e5;
/// Longest number that is sent as the job has it, in a line whose coordinates are written anew.
const NUMBER_MAX: usize = 12;
/// Most characters that are put before a line of the job.
const PREFIX_MAX: usize = 5;

/// A job with its checks.
#[derive(Debug)]
pub(super) struct Plan {
    pub(super) followed: Followed,
    checks: Vec<Check>,
}

/// A place in the job at which the machine is at rest and is asked how it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Check {
    /// Index of the first line after it.
    pub(super) end: usize,
    /// Index of the first of the lines before it that move the pen; `end` if there are none.
    pub(super) pen_lines: usize,
    /// Whether the pen is down at it; none at the end of the job.
    pub(super) pen_down: Option<bool>,
    /// Whether the lines from the check before it to `pen_lines` are sent in differences.
    pub(super) relative: bool,
    /// Whether those after it are.
    pub(super) then_relative: bool,
    /// Whether the lines that move the pen do nothing else, so that they may be sent again.
    pub(super) repeatable: bool,
}

/// Where the controller takes itself to be while lines are sent in differences.
///
/// GRBL adds them up in floats of 32 bits, in machine coordinates. The sums are followed here, rounding and all, and each
/// difference is taken from where they are, so that their errors do not grow with the number of lines.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Model {
    /// Machine coordinates, mm.
    at: [f64; 2],
    /// Place of the job's origin in them, mm.
    origin: [f64; 2],
    /// Whether the controller computes with 64 bits.
    double: bool,
}

impl Model {
    pub(super) fn new(start: [f64; 2], origin: [f64; 2], double: bool) -> Self {
        let mut model = Self { at: [0.0; 2], origin, double };
        model.at = [0, 1].map(|axis| model.rounded(start[axis] + origin[axis]));
        model
    }

    fn rounded(&self, value: f64) -> f64 {
        if self.double { value } else { f64::from(value as f32) }
    }

    /// Goes to a place (mm, from the job's origin); the difference that does it best.
    fn go(&mut self, to: [f64; 2]) -> [f64; 2] {
        let scale = 10_f64.powi(DECIMALS as i32);
        let difference = [0, 1].map(|axis| ((to[axis] + self.origin[axis] - self.at[axis]) * scale).round() / scale);
        self.at = [0, 1].map(|axis| self.rounded(self.at[axis] + self.rounded(difference[axis])));
        difference
    }
}

impl Plan {
    /// The checks of a job whose effects are known, for lines of at most `limit` characters. With `verified` false, only its end.
    pub(super) fn new(job: &Job, followed: Followed, limit: usize, verified: bool) -> Self {
        let mut checks = if verified { pen_changes(job, &followed) } else { Vec::new() };
        let total = job.lines().len();
        if checks.last().is_none_or(|check| check.end < total) {
            let end = Check {
                end: total,
                pen_lines: total,
                pen_down: None,
                relative: false,
                then_relative: false,
                repeatable: true,
            };
            checks.push(end);
        }
        let mut plan = Self { followed, checks };
        for k in 1..plan.checks.len() {
            if plan.can_be_relative(job.lines(), k, limit) {
                plan.checks[k - 1].then_relative = true;
                plan.checks[k].relative = true;
            }
        }
        plan
    }

    pub(super) fn check(&self, index: usize) -> Option<&Check> {
        self.checks.get(index)
    }

    /// Index of the first line of the part of the job that this check ends.
    pub(super) fn start(&self, index: usize) -> usize {
        index.checked_sub(1).and_then(|before| self.checks.get(before)).map_or(0, |check| check.end)
    }

    /// What the controller should tell of itself at a check.
    pub(super) fn wanted(&self, index: usize) -> Modal {
        let Some(check) = self.checks.get(index) else { return Modal::default() };
        let mut modal = self.followed.state_after(check.end.checked_sub(1)).clone();
        if check.then_relative {
            modal.distance = Some(Distance::Incremental);
        }
        modal
    }

    /// Whether a check is behind a line that waits for the motion before it, so that none of ours is needed.
    pub(super) fn rests(&self, job: &Job, index: usize) -> bool {
        self.checks.get(index).and_then(|check| job.lines().get(check.end.checked_sub(1)?)).is_some_and(is_dwell)
    }

    /// The model for the lines that this check ends, if they are sent in differences.
    pub(super) fn model(&self, index: usize, origin: [f64; 2], double: bool) -> Option<Model> {
        let check = self.checks.get(index).filter(|check| check.relative)?;
        let before = self.start(index).checked_sub(1)?;
        let start = self.followed.trace.steps.get(before)?.end.xy().filter(|_| check.pen_lines > 0)?;
        Some(Model::new([start.x, start.y], origin, double))
    }

    /// Whether each line of the stroke that this check ends is at least one block of the planner, which drops those shorter than
    /// a step.
    pub(super) fn has_a_block_a_line(&self, index: usize, steps_per_mm: [Option<f64>; 3]) -> bool {
        let (Some(check), [Some(x), Some(y), _]) = (self.checks.get(index), steps_per_mm) else { return false };
        let lines = self.followed.trace.steps.get(self.start(index)..check.pen_lines).unwrap_or_default();
        // Along the diagonal, with a step of rounding at both ends.
        let least = 3.0 / x.min(y);
        check.relative && lines.iter().all(|step| step.ink_mm > least)
    }

    /// What is sent for a line of the part that the check of this index ends.
    pub(super) fn text(&self, job: &Job, line: usize, check: usize, model: &mut Option<Model>) -> String {
        let (Some(Line { text, .. }), Some(part)) = (job.lines().get(line), self.checks.get(check)) else {
            return String::new();
        };
        if line < part.pen_lines {
            if let Some(model) = model.as_mut().filter(|_| part.relative) {
                return self.relative(text, line, self.start(check), part.pen_lines, model);
            }
            let explicit =
                if line + 1 == part.pen_lines && moves(text) { self.motion_word(text, Some(line)) } else { "" };
            return format!("{explicit}{text}");
        }
        let mut prefix = String::new();
        if line == part.pen_lines {
            prefix.push_str(self.motion_word(text, line.checked_sub(1)));
            if part.relative {
                prefix.push_str("G90");
            }
        }
        if line + 1 == part.end && part.then_relative && is_dwell_text(text) {
            prefix.push_str("G91");
        }
        prefix + text
    }

    /// The motion that holds after a line as a word, unless a text has one already, or it may not stand alone.
    fn motion_word(&self, text: &str, after: Option<usize>) -> &'static str {
        let state = self.followed.state_after(after);
        if words(text).any(|(letter, value)| letter == 'G' && matches!(value, 0.0..4.0 | 80.0)) {
            return "";
        }
        match state.motion {
            Some(Motion::Rapid) => "G0",
            // G1 without a feed is an error, even where nothing moves.
            Some(Motion::Linear) if state.feed.is_some_and(|feed| feed > 0.0) => "G1",
            _ => "",
        }
    }

    /// A line of a stroke in differences.
    fn relative(&self, text: &str, line: usize, first: usize, end: usize, model: &mut Model) -> String {
        let steps = &self.followed.trace.steps;
        let Some(to) = steps.get(line).and_then(|step| step.end.xy()) else { return text.to_owned() };
        let [x, y] = model.go([to.x, to.y]);
        let motion = self.followed.state_after(Some(line)).motion;
        let before = self.followed.state_after(line.checked_sub(1)).motion;
        let named = line == first || line + 1 == end || motion != before;
        let motion = match motion {
            Some(Motion::ArcClockwise) => "G2",
            Some(Motion::ArcCounterClockwise) => "G3",
            Some(Motion::Rapid) if named => "G0",
            Some(Motion::Linear) if named => "G1",
            _ => "",
        };
        let mut sent = format!("{motion}X{}Y{}", decimal(x, DECIMALS), decimal(y, DECIMALS));
        for (letter, number) in spelled(text) {
            if matches!(letter, 'I' | 'J' | 'F') {
                sent.push(letter);
                sent.push_str(number);
            }
        }
        sent
    }

    /// Whether the lines that the check of this index ends can be sent in differences: a stroke in absolute millimetres of
    /// which all is known.
    fn can_be_relative(&self, lines: &[Line], index: usize, limit: usize) -> bool {
        let (Some(before), Some(check)) = (self.checks.get(index.wrapping_sub(1)), self.checks.get(index)) else {
            return false;
        };
        let steps = &self.followed.trace.steps;
        let known = |line: usize| {
            let place = steps.get(line).and_then(|step| step.end.xy());
            let state = self.followed.state_after(Some(line));
            let within = place.is_some_and(|at| at.abs().max_element() < COORDINATE_MAX);
            within && state.units == Some(Units::Millimetres) && state.distance == Some(Distance::Absolute)
        };
        let short = |line: usize| lines.get(line).is_some_and(|line| line.text.len() + PREFIX_MAX <= limit);
        let Some(last_before) = before.end.checked_sub(1) else { return false };
        before.pen_down == Some(true)
            && check.pen_down == Some(false)
            && before.end < check.pen_lines
            && known(last_before)
            && short(last_before)
            && short(check.pen_lines)
            && (before.end..check.pen_lines).all(|line| {
                let arc_start = steps.get(line.wrapping_sub(1)).and_then(|step| step.end.xy());
                let moved = steps.get(line).and_then(|step| step.end.xy()) != arc_start;
                known(line)
                    && lines.get(line).is_some_and(|of| {
                        let motion = self.followed.state_after(Some(line));
                        of.turn == Turn::Streamed && is_plain(&of.text, motion, moved)
                    })
            })
    }
}

/// Whether a line does nothing but move in the plane of the paper, in a way that may be written in differences. A full turn
/// (not `moved`) and an arc by its radius are not: a changed number would not show in where they end.
fn is_plain(text: &str, state: &Modal, moved: bool) -> bool {
    let arc = match state.motion {
        Some(Motion::Rapid | Motion::Linear) => false,
        Some(Motion::ArcClockwise | Motion::ArcCounterClockwise) => true,
        _ => return false,
    };
    moves(text)
        && (!arc || (moved && state.plane == Some(Plane::Xy)))
        && words(text).all(|(letter, value)| match letter {
            'G' => matches!(value, 0.0 | 1.0 | 2.0 | 3.0 | 17.0 | 21.0 | 90.0 | 94.0),
            'X' | 'Y' => value.is_finite(),
            'I' | 'J' => arc && value.is_finite(),
            'F' => value > 0.0,
            _ => false,
        })
        && spelled(text).all(|(letter, number)| !matches!(letter, 'I' | 'J' | 'F') || number.len() <= NUMBER_MAX)
}

/// Whether a line has a coordinate in the plane of the paper.
fn moves(text: &str) -> bool {
    words(text).any(|(letter, _)| matches!(letter, 'X' | 'Y'))
}

/// The words of a line as they are written.
pub(crate) fn spelled(text: &str) -> impl Iterator<Item = (char, &str)> {
    text.char_indices().filter(|(_, c)| c.is_ascii_alphabetic()).map(|(at, letter)| {
        let rest = text.get(at + 1..).unwrap_or_default();
        (letter, rest.split(|c: char| c.is_ascii_alphabetic()).next().unwrap_or_default())
    })
}

/// Whether a line only waits.
pub(crate) fn is_dwell(line: &Line) -> bool {
    line.turn == Turn::Streamed && is_dwell_text(&line.text)
}

fn is_dwell_text(text: &str) -> bool {
    let mut words = words(text);
    words.next() == Some(('G', 4.0)) && matches!(words.next(), Some(('P', _))) && words.next().is_none()
}

/// A check behind each change of the pen, with the dwells that follow it.
fn pen_changes(job: &Job, followed: &Followed) -> Vec<Check> {
    let lines = job.lines();
    let mut checks: Vec<Check> = Vec::new();
    let mut known = None;
    let mut leaves_at = None;
    for (index, step) in followed.trace.steps.iter().enumerate() {
        let Some(down) = step.pen_down else {
            if known.is_some() {
                leaves_at.get_or_insert(index);
            }
            continue;
        };
        let first = leaves_at.take().unwrap_or(index);
        if known == Some(down) {
            continue;
        }
        known = Some(down);
        let mut end = index + 1;
        while lines.get(end).is_some_and(is_dwell) {
            end += 1;
        }
        let repeatable = lines
            .get(first..end)
            .is_some_and(|lines| lines.iter().all(|line| line.turn == Turn::Streamed && !moves(&line.text)))
            && followed.state_after(Some(index)).distance == Some(Distance::Absolute);
        checks.push(Check {
            end,
            pen_lines: first,
            pen_down: Some(down),
            relative: false,
            then_relative: false,
            repeatable,
        });
    }
    checks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::find;
    use crate::trace::Position;
    use crate::trace::gcode::{Machine, follow};

    fn plan(gcode: &str, device: &str) -> (Job, Plan) {
        let job = Job::new(gcode, 79).unwrap();
        let machine = Machine::of(&find(device).unwrap()).unwrap();
        let before = Modal { speed: None, spindle: None, ..Modal::after_reset() };
        let followed = follow(&job, &machine, &before, Position::UNKNOWN);
        let plan = Plan::new(&job, followed, 79, true);
        (job, plan)
    }

    /// What is sent, with `|` at each check.
    fn sent(gcode: &str, device: &str) -> String {
        let (job, plan) = plan(&gcode.replace(' ', "\n"), device);
        let mut sent = Vec::new();
        for k in 0.. {
            let Some(check) = plan.check(k) else { break };
            let mut model = plan.model(k, [0.0; 2], false);
            sent.extend((plan.start(k)..check.end).map(|line| plan.text(&job, line, k, &mut model)));
            sent.push("|".to_owned());
        }
        sent.join(" ")
    }

    #[test]
    fn strokes_go_out_in_differences() {
        let table = [
            (
                "grbl-servo",
                "M3S0 G4P.15 G0X10Y20 M3S1000 G4P.2 G1X30.5Y20F2000 X30.5Y40.123 X1Y2 M3S0 G4P.15 G0X0Y0 M5",
                "G0M3S0 G4P.15 | G0X10Y20 G0M3S1000 G91G4P.2 | G1X20.5Y0F2000 X0Y20.123 G1X-29.5Y-38.123 \
                 G1G90M3S0 G4P.15 | G0X0Y0 M5 |",
            ),
            // Without a dwell, the line of ours that waits is the one to change over.
            ("grbl-servo", "M3S0 G0X1Y1 S1000 G1X2F9 S0 X5Y5", "G0M3S0 | G0X1Y1 G0S1000 | G1X1Y0F9 G1G90S0 | G1X5Y5 |"),
            (
                "grbl-z",
                "G1Z3F1000 G0X1Y1 G1Z0F1000 G1X2Y2F2000 X3 G1Z3F1000",
                "G1Z3F1000 | G0X1Y1 G1Z0F1000 | G1X1Y1F2000 G1X1Y0 G90G1Z3F1000 |",
            ),
            // An arc keeps its centre, which is told by differences anyway.
            (
                "grbl-servo",
                "M3S0 G0X1Y1 M3S1000 G1F9 G3X3Y1I1J0 G1X0 M3S0",
                "G0M3S0 | G0X1Y1 G0M3S1000 | G1F9 G3X3Y1I1J0 G1X0 G1M3S0 |",
            ),
            (
                "grbl-servo",
                "F9 M3S0 G0X1Y1 M3S1000 G3X3Y1I1J0 G1X0 M3S0",
                "F9 G0M3S0 | G0X1Y1 G0M3S1000 | G3X2Y0I1J0 G1X-3Y0 G1G90M3S0 |",
            ),
            // What the sum of the lines would not show goes as it is: a full turn, a radius, inches, an unknown beginning.
            (
                "grbl-servo",
                "F9 M3S0 G0X1Y1 M3S1000 G3X1Y1I1J0 M3S0",
                "F9 G0M3S0 | G0X1Y1 G0M3S1000 | G3X1Y1I1J0 M3S0 |",
            ),
            ("grbl-servo", "F9 M3S0 G0X1Y1 M3S1000 G3X3Y1R1 M3S0", "F9 G0M3S0 | G0X1Y1 G0M3S1000 | G3X3Y1R1 M3S0 |"),
            ("grbl-servo", "G20 M3S0 G0X1Y1 M3S1000 G1X3F9 M3S0", "G20 G0M3S0 | G0X1Y1 G0M3S1000 | G1X3F9 G1M3S0 |"),
            ("grbl-servo", "M3S0 G0X1 M3S1000 G1X3F9 M3S0", "G0M3S0 | G0X1 G0M3S1000 | G1X3F9 G1M3S0 |"),
            ("grbl-servo", "M3S0 G0X1Y1 M3S1000 G1X3F9Z1 M3S0", "G0M3S0 | G0X1Y1 G0M3S1000 | G1X3F9Z1 G1M3S0 |"),
            // A job without a pen is held against its end.
            ("grbl-servo", "G0X1Y1 G0X2", "G0X1Y1 G0X2 |"),
        ];
        for (device, gcode, expected) in table {
            assert_eq!(sent(gcode, device), expected, "{gcode}");
        }
    }

    #[test]
    fn a_line_that_waits_only_is_a_dwell() {
        for (text, expected) in
            [("G4P.1", true), ("G04P1", true), ("G4", false), ("G4P1S2", false), ("G4P1X2", false), ("P1G4", false)]
        {
            assert_eq!(is_dwell_text(text), expected, "{text}");
        }
    }

    #[test]
    fn sums_in_32_bits_stay_where_the_job_wants_them() {
        // The worst case: a difference that is rounded the same way each time.
        let (step, count, origin) = (0.1, 20_000, [-700.0, 400.0]);
        let mut model = Model::new([0.0, 0.0], origin, false);
        let mut controller = [-700.0_f32, 400.0];
        let mut worst = 0.0_f64;
        for k in 1..=count {
            let to = [f64::from(k % 3000) * step, f64::from(k) * 0.013];
            let difference = model.go(to);
            for axis in 0..2 {
                controller[axis] += difference[axis] as f32;
                worst = worst.max((f64::from(controller[axis]) - origin[axis] - to[axis]).abs());
            }
        }
        assert!(worst < 0.0011, "{worst}");
        // The differences as they stand would have run away.
        let mut plain = -700.0_f32;
        for _ in 0..6000 {
            plain += 0.1_f32;
        }
        assert!((f64::from(plain) + 100.0).abs() > 0.02, "{plain}");
    }
}
