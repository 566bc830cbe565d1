//! A job with its arcs written as chords, for a line on which nobody would notice that an arc was changed.
//!
//! GRBL's line has no checksum: a stroke is held against the place where it ends. An arc whose direction or centre was changed on the way ends
//! there too, and so its chords are sent instead, each of which goes somewhere. They are those that the controller would go along itself, and
//! keep the number that the arc has in the file.

use glam::DVec2;

use super::arc::Arc;
use super::{Distance, FeedMode, Followed, Machine, Modal, Motion, Plane, places};
use crate::emit::decimal;
use crate::protocol::grbl::{Job, JobError, Line, Turn, clean, spelled, words};
use crate::trace::Position;

/// Most moves that the arcs of a job may become: a plot of weeks. Arcs beyond stay as they are.
const MOVES_MAX: usize = 5_000_000;

/// Decimals that nothing is lost by in sums of increments.
const DECIMALS: usize = 6;

/// Codes that may stand in a line beside G2 and G3.
const WITH_ARCS: [f64; 8] = [17.0, 20.0, 21.0, 40.0, 90.0, 91.0, 91.1, 94.0];

/// Codes that take the axis words of a line for themselves, or stop the motion.
const WITHOUT_MOTION: [f64; 14] = [4.0, 10.0, 28.0, 28.1, 30.0, 30.1, 38.2, 38.3, 38.4, 38.5, 43.1, 80.0, 92.0, 92.1];

/// A job without arcs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chorded {
    /// The job. Lines that had an arc hold several, which carriage returns tell apart.
    pub job: Vec<u8>,
    /// Arcs that have become chords.
    pub arcs: usize,
    /// Numbers of the lines whose arcs are as they were, for it is not known where they go: the job has not said units, mode or the place where
    /// they begin, or they leave the plane of the paper, or the line does something else too.
    pub left: Vec<usize>,
}

/// Writes the arcs of a job as chords, no farther from them than the arc tolerance that GRBL is shipped with ($12, 0.002 mm). `limit` is the
/// most characters in a line. Cost: linear in what is written.
///
/// # Errors
/// [`JobError`]: it is no job.
pub fn chorded(job: &[u8], limit: usize, machine: &Machine) -> Result<Chorded, JobError> {
    let text = String::from_utf8_lossy(job);
    let lines = Job::new(&text, limit)?;
    // A controller that has not been told otherwise has arcs in the plane of the paper, and feeds a minute.
    let before = Modal { plane: Some(Plane::Xy), feed_mode: Some(FeedMode::PerMinute), ..machine.before() };
    let followed = places(&lines, machine, &before, Position::UNKNOWN);
    let mut chorded = Chorded { job: Vec::with_capacity(job.len()), arcs: 0, left: Vec::new() };
    let (mut index, mut moves) = (0, 0);
    // Whether the controller takes coordinates alone for those of an arc, as it did.
    let mut named = true;
    for (k, raw) in text.split('\n').enumerate() {
        if k > 0 {
            chorded.job.push(b'\n');
        }
        for (k, piece) in raw.split('\r').enumerate() {
            if k > 0 {
                chorded.job.push(b'\r');
            }
            let line = lines.lines().get(index).filter(|_| !clean(piece).0.is_empty());
            let Some(line) = line else {
                chorded.job.extend_from_slice(piece.as_bytes());
                continue;
            };
            let state = followed.state_after(Some(index));
            let names = words(&line.text).any(|(letter, value)| letter == 'G' && matches!(value, 0.0..4.0));
            named |= names;
            if is_arc(line, state) {
                let written = written(line, index, &followed)
                    .filter(|(first, rest)| first.len() <= limit && moves + rest.len() < MOVES_MAX);
                if let Some((first, rest)) = written {
                    moves += rest.len() + 1;
                    chorded.arcs += 1;
                    chorded.job.extend_from_slice(first.as_bytes());
                    for chord in rest {
                        chorded.job.push(b'\r');
                        chorded.job.extend_from_slice(chord.as_bytes());
                    }
                    named = false;
                } else {
                    chorded.left.push(line.number);
                    if !named {
                        chorded.job.extend_from_slice(if state.motion == Some(Motion::ArcClockwise) {
                            b"G2"
                        } else {
                            b"G3"
                        });
                        named = true;
                    }
                    chorded.job.extend_from_slice(piece.as_bytes());
                }
            } else {
                chorded.job.extend_from_slice(piece.as_bytes());
            }
            index += 1;
        }
    }
    Ok(chorded)
}

/// Whether a line moves along an arc.
fn is_arc(line: &Line, state: &Modal) -> bool {
    matches!(state.motion, Some(Motion::ArcClockwise | Motion::ArcCounterClockwise))
        && line.turn == Turn::Streamed
        && words(&line.text).any(|(letter, _)| matches!(letter, 'X' | 'Y' | 'Z' | 'I' | 'J' | 'K' | 'R'))
        && !words(&line.text).any(|(letter, value)| letter == 'G' && WITHOUT_MOTION.contains(&value))
}

/// The lines of an arc's chords; none where it is not known how the arc goes.
fn written(line: &Line, index: usize, followed: &Followed) -> Option<(String, Vec<String>)> {
    let state = followed.state_after(Some(index));
    let mm = state.units?.mm();
    let absolute = state.distance? == Distance::Absolute;
    if state.plane != Some(Plane::Xy) || state.feed_mode != Some(FeedMode::PerMinute) {
        return None;
    }
    let (mut offset, mut radius, mut first, mut feed) = ([None; 3], None, String::new(), String::new());
    let mut ends: [Option<&str>; 2] = [None; 2];
    for ((letter, value), (_, number)) in words(&line.text).zip(spelled(&line.text)) {
        if !value.is_finite() {
            return None;
        }
        match letter {
            'G' if matches!(value, 2.0 | 3.0) => {}
            'G' if WITH_ARCS.contains(&value) => first.push_str(&format!("G{number}")),
            'X' => ends[0] = Some(number),
            'Y' => ends[1] = Some(number),
            'I' => offset[0] = Some(value * mm),
            'J' => offset[1] = Some(value * mm),
            'R' => radius = Some(value * mm),
            'F' => feed = format!("F{number}"),
            'N' => {}
            _ => return None,
        }
    }
    let steps = &followed.trace.steps;
    let start = steps.get(index.checked_sub(1)?)?.end.xy()?;
    let end = steps.get(index)?.end.xy()?;
    let clockwise = state.motion == Some(Motion::ArcClockwise);
    let arc = Arc::new(start.extend(0.0), end.extend(0.0), Plane::Xy, offset, radius, clockwise)?;
    let origin = if absolute { DVec2::ZERO } else { start };
    // A micrometre, or less than that in inches.
    let scale = if mm > 1.0 { 1e5 } else { 1e3 };
    let mut at = start;
    let mut targets: Vec<[f64; 2]> = arc
        .chords()
        .map(|way| {
            at += way.truncate();
            (((at - origin) / mm * scale).round() / scale).to_array()
        })
        .collect();
    // The last one ends where the arc does.
    *targets.last_mut()? = ((end - origin) / mm).to_array();
    let last = targets.len() - 1;
    let mut before = [0.0; 2];
    let mut moves = targets.iter().enumerate().map(|(k, to)| {
        let number = |axis: usize| match ends[axis] {
            Some(number) if k == last && absolute => number.to_owned(),
            _ if absolute => decimal(to[axis], DECIMALS),
            _ => decimal(to[axis] - before[axis], DECIMALS),
        };
        let words = format!("X{}Y{}", number(0), number(1));
        before = *to;
        words
    });
    let first = format!("{first}G1{}{feed}", moves.next()?);
    Some((first, moves.collect()))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::device::find;

    fn machine() -> Machine {
        Machine::of(&find("grbl-servo").unwrap()).unwrap()
    }

    fn without_arcs(gcode: &str) -> Chorded {
        chorded(gcode.as_bytes(), 79, &machine()).unwrap()
    }

    /// The job, with `/` for carriage returns and `|` for line ends.
    fn text(chorded: &Chorded) -> String {
        String::from_utf8(chorded.job.clone()).unwrap().replace('\r', "/").replace('\n', "|")
    }

    #[test]
    fn arcs_become_chords_and_all_else_stays() {
        // A radius of 10 µm: a quarter is a chord of 14 µm, 3 µm from it at the most, and so two.
        let head = "G21 G90 (head)|G0 X1 Y2|";
        let table: &[(&str, &str)] = &[
            ("G2 X1.01 Y2.01 I.01 J0 F9|G1 X5", "G1X1.003Y2.007F9/X1.01Y2.01|G1 X5"),
            ("G3 X1.01 Y2.01 I0 J.01 F9|G1 X5", "G1X1.007Y2.003F9/X1.01Y2.01|G1 X5"),
            // By radius; and an end that the line does not name is where the pen was.
            ("G2 X1.01 Y2.01 R.01 F9", "G1X1.003Y2.007F9/X1.01Y2.01"),
            ("G2 X1.02 I.01 F9", "G1X1.005Y2.009F9/X1.015Y2.009/X1.02Y2"),
            // Increments, whose sum is that of the job.
            ("G91 G2 X.01 Y.01 I.01 F9", "G91G1X0.003Y0.007F9/X0.007Y0.003"),
            // The second arc goes on without a word, and other lines are as they were.
            (
                "G2 X1.01 Y2.01 I.01 F9|M3 S5|X1.02 Y2 I0 J-.01|(no arc)|",
                "G1X1.003Y2.007F9/X1.01Y2.01|M3 S5|G1X1.017Y2.007/X1.02Y2|(no arc)|",
            ),
        ];
        for (gcode, expected) in table {
            let chorded = without_arcs(&format!("{head}{gcode}").replace('|', "\n"));
            assert_eq!(text(&chorded), format!("{head}{expected}"), "{gcode}");
            assert!(chorded.left.is_empty());
        }
        let plain = "G21\nG90\r\nG1X5F9\r\r;c\nG4P1";
        assert_eq!(without_arcs(plain), Chorded { job: plain.into(), arcs: 0, left: Vec::new() });
    }

    #[test]
    fn arcs_that_cannot_be_followed_stay_and_are_told() {
        for (gcode, left) in [
            // Units, mode, and the place where it begins are unknown.
            ("G90\nG0X1Y2\nG2X2Y2I.5F9", 3),
            ("G21\nG0X1Y2\nG2X2Y2I.5F9", 3),
            ("G21\nG90\nG2X2Y2I.5F9", 3),
            // Another plane, a helix, a feed of its own, a pen that is moved with it, an arc that the controller refuses.
            ("G21G90G18\nG0X1Y2Z0\nG2X2Z0I.5F9", 3),
            ("G21G90\nG0X1Y2Z0\nG2X2Y2Z1I.5F9", 3),
            ("G21G90G93\nG0X1Y2\nG2X2Y2I.5F9", 3),
            ("G21G90\nG0X1Y2\nG2X2Y2I.5F9M3S1000", 3),
            ("G21G90\nG0X1Y2\nG2X2Y2I.7F9", 3),
        ] {
            let chorded = without_arcs(gcode);
            assert_eq!((text(&chorded), chorded.left), (gcode.replace('\n', "|"), vec![left]), "{gcode}");
        }
        // What was an arc without a word is not one of chords.
        let chorded = without_arcs("G21G90\nG0X1Y2\nG3X1.01Y2.01J.01F9\nX2Y2Z1I.5\nX3Y2Z2I.5\n");
        assert_eq!(text(&chorded), "G21G90|G0X1Y2|G1X1.007Y2.003F9/X1.01Y2.01|G3X2Y2Z1I.5|X3Y2Z2I.5|");
        assert_eq!((chorded.arcs, chorded.left), (1, vec![4, 5]));
        // These take the coordinates for themselves.
        let chorded = without_arcs("G21G90G2\nG92X0Y0\nG28X1\nG4P1\n");
        assert_eq!((chorded.arcs, chorded.left.len()), (0, 0));
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

        #[test]
        fn chords_are_the_arcs(
            arcs in prop::collection::vec((-20.0..20.0_f64, -20.0..20.0_f64, -6.2..6.2_f64, any::<bool>()), 1..5), inches: bool, incremental: bool,
        ) {
            let unit = if inches { 25.4 } else { 1.0 };
            let mut gcode = format!("G{}G{}G17\n", if inches { 20 } else { 21 }, 90);
            let mut at = DVec2::new(100.0, 100.0);
            gcode += &format!("G0X{:.6}Y{:.6}\nM3S1000\nF600\n", at.x / unit, at.y / unit);
            if incremental {
                gcode += "G91\n";
            }
            for (i, j, angle, named) in &arcs {
                let centre = at + DVec2::new(*i, *j);
                let to = centre + DVec2::from_angle(*angle).rotate(at - centre);
                let [x, y] = (if incremental { to - at } else { to }).to_array().map(|value| value / unit);
                let word = if *angle < 0.0 { "G2" } else { "G3" };
                gcode += &format!("{word}X{x:.6}Y{y:.6}I{:.6}J{:.6}\n", i / unit, j / unit);
                at = to;
                if !named {
                    gcode += "G1\n";
                }
            }
            let chorded = without_arcs(&gcode);
            prop_assume!(chorded.left.is_empty());
            prop_assert_eq!(chorded.arcs, arcs.len());
            let trace = |text: &str| places(&Job::new(text, 79).unwrap(), &machine(), &Modal::default(), Position::UNKNOWN).trace;
            let (arcs, chords) = (trace(&gcode), trace(std::str::from_utf8(&chorded.job).unwrap()));
            // The same ways, and no arc in it.
            prop_assert!((arcs.ink_mm() - chords.ink_mm()).abs() <= 2e-3 * arcs.ink_mm() + 0.01, "{} {}", arcs.ink_mm(), chords.ink_mm());
            let end = |trace: &crate::trace::Trace| trace.steps.last().and_then(|step| step.end.xy()).unwrap();
            prop_assert!(end(&arcs).distance(end(&chords)) < 1e-4);
            prop_assert_eq!(without_arcs(std::str::from_utf8(&chorded.job).unwrap()).arcs, 0);
        }
    }
}
