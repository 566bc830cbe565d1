//! What GRBL reports: `<…>` for `?`, and `[GC:…]` for `$G`.
//!
//! Nothing on the line is protected by a checksum, so a report that is not well formed from end to end tells nothing.

use crate::trace::gcode::{Coordinates, Distance, FeedMode, Modal, Motion, Plane, Spindle, Units};

/// Axes that are looked at; a controller may report more.
const AXES: usize = 3;

/// A status report.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Status {
    /// `Idle`, `Run`, `Hold`, …
    pub(super) state: String,
    /// What follows the state after a colon: `0` in `Hold:0`.
    pub(super) detail: String,
    /// Where the machine is, in the units of reports.
    pub(super) position: Option<Place>,
    /// First number of `Bf`: blocks of the planner that are free.
    pub(super) blocks_free: Option<usize>,
    /// `WCO`: place of the job's origin in machine coordinates, in the units of reports.
    pub(super) offset: Option<[f64; AXES]>,
}

/// A position as it is reported; $10 decides which.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    /// `MPos`: from the machine's zero.
    Machine([f64; AXES]),
    /// `WPos`: from the job's origin.
    Work([f64; AXES]),
}

/// The status report in a line; none if it is no whole one.
pub(super) fn status(line: &str) -> Option<Status> {
    let inside = line.strip_prefix('<')?.strip_suffix('>')?;
    let mut fields = inside.split('|');
    let state = fields.next()?;
    let (state, detail) = state.split_once(':').unwrap_or((state, ""));
    if state.is_empty() || !state.bytes().all(|byte| byte.is_ascii_alphabetic()) {
        return None;
    }
    let (state, detail) = (state.to_owned(), detail.to_owned());
    let mut status = Status { state, detail, position: None, blocks_free: None, offset: None };
    for field in fields {
        // A field that a doubled or changed byte has made unknown is left aside, like those of other controllers.
        let Some((name, values)) = field.split_once(':') else { continue };
        match name {
            "MPos" => status.position = Some(Place::Machine(vector(values)?)),
            "WPos" => status.position = Some(Place::Work(vector(values)?)),
            "Bf" => status.blocks_free = values.split(',').next().and_then(|free| free.parse().ok()),
            "WCO" => status.offset = Some(vector(values)?),
            _ => {}
        }
    }
    Some(status)
}

/// The first three of some numbers with commas between.
fn vector(values: &str) -> Option<[f64; AXES]> {
    let mut vector = [0.0; AXES];
    let mut count = 0;
    for value in values.split(',') {
        let number = number(value)?;
        if let Some(slot) = vector.get_mut(count) {
            *slot = number;
        }
        count += 1;
    }
    (count >= 2).then_some(vector)
}

/// A decimal number as GRBL writes them: digits with a point among them, and perhaps a sign.
fn number(text: &str) -> Option<f64> {
    let digits = text.strip_prefix('-').unwrap_or(text);
    let plain =
        digits.starts_with(|c: char| c.is_ascii_digit()) && digits.bytes().all(|b| b.is_ascii_digit() || b == b'.');
    if plain { text.parse().ok() } else { None }
}

/// The state in a `[GC:…]` line: all that GRBL tells always, or none.
pub(super) fn modal(line: &str) -> Option<Modal> {
    let words = line.strip_prefix("[GC:")?.strip_suffix(']')?;
    let mut modal = Modal::default();
    for word in words.split(' ').filter(|word| !word.is_empty()) {
        let mut chars = word.chars();
        let (letter, value) = (chars.next()?, number(chars.as_str())?);
        match (letter, (value * 10.0).round() as i64) {
            ('G', 0) => modal.motion = Some(Motion::Rapid),
            ('G', 10) => modal.motion = Some(Motion::Linear),
            ('G', 20) => modal.motion = Some(Motion::ArcClockwise),
            ('G', 30) => modal.motion = Some(Motion::ArcCounterClockwise),
            ('G', 382..=385) => modal.motion = Some(Motion::Probe),
            ('G', 800) => modal.motion = Some(Motion::Cancelled),
            ('G', 170) => modal.plane = Some(Plane::Xy),
            ('G', 180) => modal.plane = Some(Plane::Zx),
            ('G', 190) => modal.plane = Some(Plane::Yz),
            ('G', 200) => modal.units = Some(Units::Inches),
            ('G', 210) => modal.units = Some(Units::Millimetres),
            ('G', 900) => modal.distance = Some(Distance::Absolute),
            ('G', 910) => modal.distance = Some(Distance::Incremental),
            ('G', 930) => modal.feed_mode = Some(FeedMode::InverseTime),
            ('G', 940) => modal.feed_mode = Some(FeedMode::PerMinute),
            ('G', code @ 540..=590) if code % 10 == 0 => modal.coordinates = Some(Coordinates((code / 10) as u8)),
            ('M', 30) => modal.spindle = Some(Spindle::Clockwise),
            ('M', 40) => modal.spindle = Some(Spindle::CounterClockwise),
            ('M', 50) => modal.spindle = Some(Spindle::Off),
            ('F', _) => modal.feed = Some(value),
            ('S', _) => modal.speed = Some(value),
            _ => {}
        }
    }
    let whole = modal.units.is_some()
        && modal.distance.is_some()
        && modal.plane.is_some()
        && modal.spindle.is_some()
        && modal.coordinates.is_some()
        && modal.speed.is_some();
    whole.then_some(modal)
}

/// The first thing in which a reported state differs from the wanted one, as far as that is known: wanted and found, in words
/// of G-code. Motion is left aside, as lines with coordinates name it, and so is the feed, on which only the speed depends.
pub(super) fn difference(wanted: &Modal, found: &Modal) -> Option<(String, String)> {
    /// S is reported without decimals.
    const SPEED_ROUNDING: f64 = 0.51;
    fn differ<T: PartialEq + Copy>(
        wanted: Option<T>,
        found: Option<T>,
        word: impl Fn(T) -> String,
    ) -> Option<(String, String)> {
        let (wanted, found) = (wanted?, found?);
        (wanted != found).then(|| (word(wanted), word(found)))
    }
    let off = wanted.spindle == Some(Spindle::Off);
    differ(wanted.units, found.units, |units| if units == Units::Inches { "G20" } else { "G21" }.to_owned())
        .or_else(|| {
            let word = |distance| if distance == Distance::Absolute { "G90" } else { "G91" }.to_owned();
            differ(wanted.distance, found.distance, word)
        })
        .or_else(|| {
            let word = |plane| match plane {
                Plane::Xy => "G17".to_owned(),
                Plane::Zx => "G18".to_owned(),
                Plane::Yz => "G19".to_owned(),
            };
            differ(wanted.plane, found.plane, word)
        })
        .or_else(|| {
            let word = |mode| if mode == FeedMode::InverseTime { "G93" } else { "G94" }.to_owned();
            differ(wanted.feed_mode, found.feed_mode, word)
        })
        .or_else(|| differ(wanted.coordinates, found.coordinates, |Coordinates(number)| format!("G{number}")))
        .or_else(|| {
            let word = |spindle| match spindle {
                Spindle::Off => "M5".to_owned(),
                Spindle::Clockwise => "M3".to_owned(),
                Spindle::CounterClockwise => "M4".to_owned(),
            };
            differ(wanted.spindle, found.spindle, word)
        })
        .or_else(|| {
            let (wanted, found) = (wanted.speed?, found.speed?);
            (!off && (wanted - found).abs() > SPEED_ROUNDING).then(|| (format!("S{wanted}"), format!("S{found}")))
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_reports_are_understood() {
        let table = [
            ("<Idle|MPos:1.000,-2.500,0.000|Bf:15,128|FS:0,0|WCO:0.100,0.000,0.000>", "Idle", ""),
            ("<Hold:1|WPos:1.000,-2.500>", "Hold", "1"),
            ("<Run|MPos:1.000,2.000,3.000,4.000|Pn:X|Ov:100,100,100>", "Run", ""),
            ("<Alarm>", "Alarm", ""),
        ];
        for (line, state, detail) in table {
            let status = status(line).unwrap();
            assert_eq!((status.state.as_str(), status.detail.as_str()), (state, detail), "{line}");
        }
        let first = status(table[0].0).unwrap();
        assert_eq!(first.position, Some(Place::Machine([1.0, -2.5, 0.0])));
        assert_eq!(first.offset, Some([0.1, 0.0, 0.0]));
        assert_eq!(first.blocks_free, Some(15));
        assert_eq!(status(table[1].0).unwrap().position, Some(Place::Work([1.0, -2.5, 0.0])));
    }

    #[test]
    fn mangled_reports_tell_nothing() {
        for line in [
            "<Idle|MPos:1.000,0.000,0.000",
            "<<Idle|MPos:1.000,0.000,0.000>",
            "<Idle|MPos:1.0.00,0.000,0.000>",
            "<Idle|MPos:1.000;0.000;0.000>",
            "<Idle|MPos:1.000>",
            "<Idle|MPos:-,1.000>",
            "<Idle|MPos:1e3,1.000>",
            "<Id1e|MPos:1.000,0.000>",
            "<>",
        ] {
            assert_eq!(status(line), None, "{line}");
        }
        for line in [
            "[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0",
            "[GC:G0 G54 G17 G21 G94 M5 M9 T0 F0 S0]",
            "[GC:]",
            "[GC:G0 G5x]",
        ] {
            assert_eq!(modal(line), None, "{line}");
        }
    }

    #[test]
    fn differences_are_told_in_words() {
        let wanted = modal("[GC:G1 G54 G17 G21 G90 G94 M3 M9 T0 F2000 S1000]").unwrap();
        let table = [
            ("[GC:G0 G54 G17 G21 G90 G94 M3 M9 T0 F0 S1000]", None),
            ("[GC:G1 G54 G17 G20 G90 G94 M3 M9 T0 F0 S1000]", Some(("G21", "G20"))),
            ("[GC:G1 G54 G17 G21 G91 G94 M3 M9 T0 F0 S1000]", Some(("G90", "G91"))),
            ("[GC:G1 G55 G17 G21 G90 G94 M3 M9 T0 F0 S1000]", Some(("G54", "G55"))),
            ("[GC:G1 G54 G18 G21 G90 G94 M3 M9 T0 F0 S1000]", Some(("G17", "G18"))),
            ("[GC:G1 G54 G17 G21 G90 G94 M5 M9 T0 F0 S1000]", Some(("M3", "M5"))),
            ("[GC:G1 G54 G17 G21 G90 G94 M3 M9 T0 F0 S100]", Some(("S1000", "S100"))),
        ];
        for (line, expected) in table {
            let found = difference(&wanted, &modal(line).unwrap());
            assert_eq!(found, expected.map(|(a, b)| (a.to_owned(), b.to_owned())), "{line}");
        }
        assert_eq!(difference(&Modal::default(), &wanted), None);
    }
}
