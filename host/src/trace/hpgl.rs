//! Follows an HPGL job instruction by instruction, as HP's plotters read it.
//!
//! Coordinates are whole plotter units until the job scales, clips, rotates or decorates them: then the plotter alone knows
//! where its pen is, and so it is after labels, arcs and whatever else is not a plain move.

use glam::DVec2;

use super::timing::{Pace, Timer};
use super::{Cut, Position, Step, Trace};
use crate::device::{Device, Hpgl, MM_MIN_PER_CM_S};
use crate::protocol::hpgl::{Job, encoded};

/// Largest magnitude of a coordinate or an increment that every plotter takes.
const LARGEST: i64 = 32_767;

/// Instructions that move nothing and leave the coordinates as they are: character sets and sizes, line types, fills, input
/// masks, speeds, forces.
const SETTINGS: &[&[u8; 2]] = &[
    b"AC", b"AP", b"AS", b"CA", b"CC", b"CF", b"CM", b"CS", b"CV", b"DI", b"DR", b"DS", b"DT", b"DV", b"ES", b"FS",
    b"FT", b"GM", b"IM", b"IP", b"KY", b"LO", b"LT", b"NR", b"PB", b"PT", b"PW", b"SA", b"SI", b"SL", b"SR", b"SS",
    b"TL", b"UC", b"UF", b"VN", b"VS", b"WU",
];

/// What is known of a plotter between two instructions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct State {
    /// Where its pen is, in plotter units.
    pub at: Option<[i64; 2]>,
    /// Whether its pen is down.
    pub down: Option<bool>,
    /// Number of its pen; 0 for none.
    pub pen: Option<u32>,
    /// Whether coordinates are absolute.
    pub absolute: Option<bool>,
    /// Speed with the pen down in cm/s, if the job has set it.
    pub speed: Option<f64>,
    /// User units (`SC`).
    scaled: bool,
    /// A window of its own (`IW`).
    windowed: bool,
    /// Axes turned (`RO`).
    rotated: bool,
    /// A symbol at each point (`SM`).
    symbols: bool,
    /// Lines in a pattern (`LT`), in whose gaps the pen is up.
    patterned: bool,
}

/// What an instruction does.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// `PU`, `PD`, `PA`, `PR`.
    Move(Motion),
    /// Another pen, `SP`.
    Select,
    /// It sets something, and moves nothing.
    Set,
    /// Anything else.
    Unknown,
}

/// What `PU`, `PD`, `PA` or `PR` does.
#[derive(Clone, Debug, PartialEq)]
pub struct Motion {
    /// Whether it lowers (true) or lifts the pen first.
    pub lowers: Option<bool>,
    /// Where it goes.
    pub path: Path,
}

/// Where a pen goes.
#[derive(Clone, Debug, PartialEq)]
pub enum Path {
    /// Nowhere.
    Stays,
    /// Through these points, in plotter units.
    Through(Vec<[i64; 2]>),
    /// Somewhere.
    Unknown,
}

/// Whether an instruction only sets something that later ones go by, so that a job which is taken up in its middle needs it.
#[must_use]
pub fn is_setting(instruction: &[u8]) -> bool {
    let Some(mnemonic) = mnemonic(instruction) else { return false };
    SETTINGS.contains(&&mnemonic) || matches!(&mnemonic, b"IN" | b"DF" | b"SC" | b"IW" | b"RO" | b"SM" | b"PS")
}

/// The name of an instruction in capitals.
pub(crate) fn mnemonic(instruction: &[u8]) -> Option<[u8; 2]> {
    let (a, b) = (instruction.first()?, instruction.get(1)?);
    Some([a.to_ascii_uppercase(), b.to_ascii_uppercase()])
}

/// The parameters behind a mnemonic, if all are numbers; the separators are commas and blanks.
pub(crate) fn numbers(parameters: &[u8]) -> Option<Vec<f64>> {
    let text = std::str::from_utf8(parameters).ok()?.trim_end_matches(';');
    let number = |word: &str| {
        let plain = word.bytes().all(|b| b.is_ascii_digit() || matches!(b, b'+' | b'-' | b'.'));
        word.parse::<f64>().ok().filter(|_| plain)
    };
    text.split([',', ' ', '\t', '\r', '\n']).filter(|word| !word.is_empty()).map(number).collect()
}

impl State {
    /// A plotter of which nothing is known.
    #[must_use]
    pub fn unknown() -> Self {
        Self { scaled: true, ..Self::default() }
    }

    /// Whether coordinates are plotter units, and the pen goes where they say.
    #[must_use]
    pub fn is_plain(&self) -> bool {
        !(self.scaled || self.windowed || self.rotated || self.symbols)
    }

    /// Whether the pen draws all of a line.
    #[must_use]
    pub fn is_solid(&self) -> bool {
        !self.patterned
    }

    /// Carries an instruction out, and tells what it does.
    pub fn follow(&mut self, instruction: &[u8]) -> Action {
        let Some(mnemonic) = mnemonic(instruction) else { return self.lose() };
        let numbers = numbers(&instruction[2..]);
        let given = numbers.as_ref().is_none_or(|numbers| !numbers.is_empty());
        match &mnemonic {
            b"PU" | b"PD" | b"PA" | b"PR" => return self.motion(&mnemonic, numbers),
            b"SP" => {
                self.pen = numbers.as_deref().map(|n| n.first().map_or(0, |pen| *pen as u32));
                // Plotters lift the pen to change it; some put the new one down again.
                self.down = self.down.filter(|down| !down);
                return Action::Select;
            }
            b"IN" | b"DF" => {
                let rotated = self.rotated && &mnemonic == b"DF";
                *self = Self {
                    at: self.at,
                    down: self.down,
                    pen: self.pen,
                    absolute: Some(true),
                    rotated,
                    ..Self::default()
                };
                if &mnemonic == b"IN" {
                    (self.at, self.down) = (None, Some(false));
                }
            }
            b"SC" => self.scaled = given,
            b"IW" => self.windowed = given,
            b"RO" => self.rotated = numbers.is_none_or(|n| n.first().is_some_and(|angle| *angle != 0.0)),
            b"SM" => self.symbols = instruction.get(2).is_some_and(|byte| *byte != b';'),
            b"VS" => self.speed = numbers.and_then(|n| n.first().copied()).filter(|speed| *speed > 0.0),
            b"LT" => self.patterned = given,
            b"PS" => {}
            _ if SETTINGS.contains(&&mnemonic) => {}
            _ => return self.lose(),
        }
        if matches!(&mnemonic, b"RO" | b"PS") {
            self.at = None;
        }
        Action::Set
    }

    /// An instruction that is not followed may leave the pen anywhere.
    fn lose(&mut self) -> Action {
        (self.at, self.down) = (None, None);
        Action::Unknown
    }

    fn motion(&mut self, mnemonic: &[u8; 2], numbers: Option<Vec<f64>>) -> Action {
        let lowers = match mnemonic {
            b"PU" => Some(false),
            b"PD" => Some(true),
            b"PA" => {
                self.absolute = Some(true);
                None
            }
            _ => {
                self.absolute = Some(false);
                None
            }
        };
        self.down = lowers.or(self.down);
        let path = match numbers {
            Some(numbers) if numbers.is_empty() => Path::Stays,
            Some(numbers) => self.points(&numbers).map_or(Path::Unknown, Path::Through),
            None => Path::Unknown,
        };
        match &path {
            Path::Stays => {}
            Path::Through(points) => self.at = points.last().copied().or(self.at),
            Path::Unknown => self.at = None,
        }
        Action::Move(Motion { lowers, path })
    }

    /// The points that coordinates stand for; none where a plotter may see others in them.
    fn points(&self, numbers: &[f64]) -> Option<Vec<[i64; 2]>> {
        if !self.is_plain() || !numbers.len().is_multiple_of(2) {
            return None;
        }
        let absolute = self.absolute?;
        // Where fractions go to is each plotter's own affair.
        let whole = |value: f64| (value.fract() == 0.0 && value.abs() <= LARGEST as f64).then_some(value as i64);
        let mut at = if absolute { None } else { Some(self.at?) };
        let point = |pair: &[f64]| {
            let [x, y] = [whole(*pair.first()?)?, whole(*pair.get(1)?)?];
            let [x, y] = at.map_or([x, y], |[from_x, from_y]: [i64; 2]| [from_x + x, from_y + y]);
            if !absolute {
                at = Some([x, y]);
            }
            (x.abs() <= LARGEST && y.abs() <= LARGEST).then_some([x, y])
        };
        numbers.chunks(2).map(point).collect()
    }
}

/// Follows a job on a device that speaks HPGL: a step for each of its instructions. Positions are in mm from the plotter's
/// zero. Cost: linear.
#[must_use]
pub fn follow(job: &Job, device: &Device, language: &Hpgl) -> Trace {
    let mut state = State::unknown();
    let mut trace = Trace::default();
    let mut timer = Timer::new(&Pace::of(device), job.instructions().len());
    for (index, instruction) in job.instructions().iter().enumerate() {
        let before = state;
        let action = state.follow(instruction);
        timer.piece(index, sent_bytes(instruction, before.at, &action, language.encoded && state.down == Some(true)));
        let mut step = Step {
            end: position(state.at, language.unit_mm),
            pen_down: state.down,
            pen: state.pen.unwrap_or(1),
            ..Step::default()
        };
        step.cut = match (before.down, state.down) {
            (Some(false) | None, Some(true)) => Cut::StrokeStart,
            (Some(true) | None, Some(false)) => Cut::StrokeEnd,
            _ => Cut::None,
        };
        if before.down != state.down {
            timer.dwell(language.lift_s);
            timer.ask();
        }
        match action {
            Action::Move(Motion { path: Path::Through(points), .. }) => {
                let feed = match state.down {
                    Some(false) => device.travel_feed,
                    _ => state.speed.map_or(device.draw_feed, |speed| speed * MM_MIN_PER_CM_S),
                };
                let mut from = before.at;
                for to in points {
                    let line = from.map(|from| (vector(to) - vector(from)) * language.unit_mm);
                    from = Some(to);
                    let Some((line, length)) = line.map(|line| (line, line.length())).filter(|(_, l)| *l > 0.0) else {
                        continue;
                    };
                    match state.down {
                        Some(true) => step.ink_mm += length,
                        Some(false) => step.travel_mm += length,
                        None => {}
                    }
                    timer.go_by_axis(line.extend(0.0), feed);
                }
            }
            Action::Move(_) | Action::Set => {}
            // A plotter of whose pen nothing was said holds none.
            Action::Select if before.pen.unwrap_or(0) != state.pen.unwrap_or(0) => timer.dwell(language.change_s),
            Action::Select => {}
            Action::Unknown => timer.rest(),
        }
        trace.steps.push(step);
    }
    for (step, seconds) in trace.steps.iter_mut().zip(timer.finish()) {
        step.seconds = seconds;
    }
    trace
}

/// Bytes that are sent for an instruction: moves go in differences, and the pen by an instruction of its own, see [`crate::protocol::hpgl`].
fn sent_bytes(instruction: &[u8], from: Option<[i64; 2]>, action: &Action, encoded: bool) -> usize {
    match (from, action) {
        (Some(from), Action::Move(Motion { lowers, path: Path::Through(points) })) => {
            usize::from(lowers.is_some()) * "PD;".len() + difference_bytes(from, points, encoded)
        }
        _ => instruction.len(),
    }
}

/// Bytes of a list of moves in differences, in plotter units, encoded (`PE`) or not.
pub(crate) fn difference_bytes(mut from: [i64; 2], points: &[[i64; 2]], encoded: bool) -> usize {
    let numbers = points.iter().map(|to| {
        let step = [to[0] - from[0], to[1] - from[1]];
        from = *to;
        if encoded { encoded::length(step) } else { digits(step[0]) + digits(step[1]) + 2 }
    });
    numbers.sum::<usize>() + if encoded { encoded::BEGIN.len() + 1 } else { "PR".len() }
}

/// Characters of a whole number.
fn digits(number: i64) -> usize {
    number.unsigned_abs().checked_ilog10().unwrap_or(0) as usize + 1 + usize::from(number < 0)
}

fn vector([x, y]: [i64; 2]) -> DVec2 {
    DVec2::new(x as f64, y as f64)
}

fn position(at: Option<[i64; 2]>, unit_mm: f64) -> Position {
    match at {
        Some([x, y]) => Position { x: Some(x as f64 * unit_mm), y: Some(y as f64 * unit_mm), z: None },
        None => Position::UNKNOWN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{Language, find};

    fn states(hpgl: &str) -> Vec<State> {
        let job = Job::new(hpgl.as_bytes()).unwrap();
        let mut state = State::unknown();
        job.instructions()
            .iter()
            .map(|instruction| {
                state.follow(instruction);
                state
            })
            .collect()
    }

    #[test]
    fn the_pen_is_followed_as_far_as_it_can_be() {
        type Known = (Option<[i64; 2]>, Option<bool>);
        let table: &[(&str, Known)] = &[
            ("IN;", (None, Some(false))),
            ("PU10,10;", (None, Some(false))),
            ("IN;PU10,20;", (Some([10, 20]), Some(false))),
            ("IN;PA;PU10 20;PD;PR5,-5,5,-5;", (Some([20, 10]), Some(true))),
            ("in;pa10,20;pd30,40", (Some([30, 40]), Some(true))),
            ("IN;PR5,5;", (None, Some(false))),
            ("IN;PA1,1;PR;PU5,5;PA;PD7,7;", (Some([7, 7]), Some(true))),
            ("IN;PA1,1;LBtext\x03", (None, None)),
            ("IN;PA1,1;AA5,5,90;PA3,3;PU;", (Some([3, 3]), Some(false))),
            ("IN;PA1.5,1;", (None, Some(false))),
            ("IN;PA1.0,1;", (Some([1, 1]), Some(false))),
            ("IN;PA1,1,2;", (None, Some(false))),
            ("IN;PA40000,1;", (None, Some(false))),
            ("IN;SC0,100,0,100;PA1,1;", (None, Some(false))),
            ("IN;SC0,100,0,100;SC;PA1,1;", (Some([1, 1]), Some(false))),
            ("IN;IW0,0,9,9;PA1,1;", (None, Some(false))),
            ("IN;RO90;PA1,1;", (None, Some(false))),
            ("IN;RO90;DF;PA1,1;", (None, Some(false))),
            ("IN;SM*;PA1,1;", (None, Some(false))),
            ("IN;SM*;PA1,1;SM;PA1,1;", (Some([1, 1]), Some(false))),
            ("IN;PA1,1;VS5;LT2;SI1,2;FS3;", (Some([1, 1]), Some(false))),
            ("IN;PA1,1;PD;SP2;", (Some([1, 1]), None)),
            ("IN;PA1,1;PU;SP2;", (Some([1, 1]), Some(false))),
            ("IN;PA1,1;XX;", (None, None)),
        ];
        for (hpgl, (at, down)) in table {
            let state = *states(hpgl).last().unwrap();
            assert_eq!((state.at, state.down), (*at, *down), "{hpgl}");
        }
        let state = *states("IN;SP3;VS12;LT2;").last().unwrap();
        assert_eq!((state.pen, state.speed, state.is_solid()), (Some(3), Some(12.0), false));
    }

    #[test]
    fn ink_travel_and_time_add_up() {
        let device = find("dxy1100").unwrap();
        let Language::Hpgl(language) = &device.language else { panic!("not HPGL") };
        let job = Job::new(b"IN;SP1;PU400,0;PU800,0;PD800,400,400,400;VS10;PD400,0;PU;SP0;").unwrap();
        let trace = follow(&job, &device, language);
        assert_eq!(trace.steps.len(), job.instructions().len());
        assert!((trace.ink_mm() - 30.0).abs() < 1e-9 && (trace.travel_mm() - 10.0).abs() < 1e-9);
        // 10 mm at 10 cm/s take a tenth of a second at least.
        assert!(trace.steps[6].seconds > 0.1 && trace.steps[6].seconds < 0.2, "{:?}", trace.steps[6]);
        let cuts: Vec<_> = trace.steps.iter().map(|step| step.cut).filter(|cut| *cut != Cut::None).collect();
        assert_eq!(cuts, [Cut::StrokeEnd, Cut::StrokeStart, Cut::StrokeEnd]);
        assert_eq!(trace.extent(), Some((DVec2::new(10.0, 0.0), DVec2::new(20.0, 10.0))));
    }

    #[test]
    fn settings_are_told_from_what_moves() {
        for setting in [&b"VS5;"[..], b"IN;", b"lt2;", b"SC0,1,0,1;"] {
            assert!(is_setting(setting));
        }
        for other in [&b"PU;"[..], b"PA1,1;", b"SP1;", b"LBx\x03", b"AA1,1,2;", b"P", b""] {
            assert!(!is_setting(other));
        }
    }

    #[test]
    fn numbers_have_their_digits() {
        for number in [0, 7, -7, 10, 99, 100, -12_345] {
            assert_eq!(digits(number), number.to_string().len());
        }
    }

    #[test]
    fn bytes_are_those_that_are_sent() {
        let bytes = |job: &str| {
            let job = Job::new(job.as_bytes()).unwrap();
            let mut state = State::unknown();
            let each = job.instructions().iter().map(|instruction| {
                let from = state.at;
                let action = state.follow(instruction);
                sent_bytes(instruction, from, &action, false)
            });
            each.sum::<usize>()
        };
        assert_eq!(bytes("IN;PA;PU40,80;"), "IN;PA;PU40,80;".len());
        assert_eq!(bytes("IN;PA;PU40,80;PD120,80,120,90;PU;"), "IN;PA;PU40,80;PD;PR80,0,0,10;PU;".len());
    }
}
