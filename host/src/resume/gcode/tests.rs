//! Jobs broken off after each of their lines.

use proptest::prelude::*;

use super::*;
use crate::device::{Language, find};
use crate::trace::gcode::{Machine, follow};
use crate::trace::{Position, Trace};

fn device(name: &str) -> (Device, Gcode) {
    let device = find(name).unwrap();
    let gcode = device.language.gcode().unwrap().clone();
    (device, gcode)
}

fn followed(text: &str, device: &Device) -> (Job, Followed) {
    let job = Job::new(text, 79).unwrap();
    let followed = follow(&job, &Machine::of(device).unwrap(), &Modal::default(), Position::UNKNOWN);
    (job, followed)
}

/// What is left of a job after so many lines, in one line.
fn left(text: &str, name: &str, executed: usize, overlap_mm: f64, pen: u32) -> String {
    let (device, gcode) = device(name);
    let (job, followed) = followed(text, &device);
    let rest = rest(&job, &followed, executed, overlap_mm, &device, &gcode, pen);
    String::from_utf8(rest.job).unwrap().trim().replace('\r', "|").replace('\n', "/")
}

const TWO: &str = "G21\nG90\nG17\nG94\nM3 S0\nG4 P0.15\nG0 X10 Y20\nM3 S1000\nG4 P0.2\nG1 X30 Y20 F2000\nG1 X30 Y40\nM3 S0\n\
                   G4 P0.15\nG0 X50 Y50\nM3 S1000\nG4 P0.2\nG1 X60 Y50 F2000\nM3 S0\nG4 P0.15\nG0 X0 Y0\nM5\n";

#[test]
fn a_job_goes_on_where_it_stopped() {
    const BEGIN: &str = "G21|G90|G17|G94|M3 S0|G4 P0.15";
    let down = "M3 S1000|G4 P0.2|F2000|G1";
    let last = "M3S0/G4P0.15/G0X0Y0/M5";
    let table: &[(usize, f64, String)] = &[
        // Within the first stroke.
        (
            10,
            0.0,
            format!("{BEGIN}|G0X30Y20|{down}|G1X30Y40/M3S0/G4P0.15/G0X50Y50/M3S1000/G4P0.2/G1X60Y50F2000/{last}"),
        ),
        // Back along the second line, and over the corner to the first.
        (
            11,
            5.0,
            format!("{BEGIN}|G0X30Y35|{down}|G1X30Y40/M3S0/G4P0.15/G0X50Y50/M3S1000/G4P0.2/G1X60Y50F2000/{last}"),
        ),
        (
            11,
            25.0,
            format!(
                "{BEGIN}|G0X25Y20|M3 S1000|G4 P0.2|G0|G1X30Y20F2000/G1X30Y40/M3S0/G4P0.15/G0X50Y50/M3S1000/G4P0.2/\
                 G1X60Y50F2000/{last}"
            ),
        ),
        // Between two strokes there is nothing to draw again.
        (14, 9.0, format!("{BEGIN}|G0X50Y50|F2000|G0|M3S1000/G4P0.2/G1X60Y50F2000/{last}")),
        (20, 0.0, format!("{BEGIN}|G0X0Y0|F2000|G0|M5")),
    ];
    for (executed, overlap_mm, expected) in table {
        assert_eq!(left(TWO, "grbl-servo", *executed, *overlap_mm, 1), *expected, "{executed} {overlap_mm}");
    }
}

#[test]
fn a_job_of_which_nothing_is_known_begins_anew() {
    for executed in [0, 1, 6] {
        let text = left(TWO, "grbl-servo", executed, 0.0, 1);
        assert!(text.starts_with("G21/G90/G17"), "{text}");
    }
    // Homing loses what is known, and it is known again once the job says where it goes.
    let text = "G21G90\nG0X1Y1\nM3S0\nG28\nG0X5\nG0Y5\nG0X7\n";
    assert!(left(text, "grbl-servo", 5, 0.0, 1).ends_with("G0X1Y1|G0|G28/G0X5/G0Y5/G0X7"));
    assert!(left(text, "grbl-servo", 6, 0.0, 1).ends_with("G0X5Y5|G0|G0X7"));
}

#[test]
fn a_marlin_job_need_not_say_its_units() {
    let job = "M280 P0 S90\nG4 P200\nG28 X Y\nG0 X10 Y20 F9000\nM400\nM280 P0 S30\nG4 P50\nG1 X30 Y20\nG1 X30 Y40\nM400\nM280 P0 S90\n";
    let device = find("marlin-servo").unwrap();
    let whole = crate::resume::Whole::new(job.as_bytes(), &device).unwrap();
    let rest = whole.rest(8, 0.0, 1);
    let text = String::from_utf8(rest.job).unwrap();
    assert_eq!(rest.skipped, 8, "{text:?}");
    assert!(text.contains("G90\r") && text.contains("\rG0X30Y20F") && !text.contains("G21"), "{text:?}");
    let whole = crate::resume::Whole::new(format!("G20\n{job}").as_bytes(), &device).unwrap();
    let text = String::from_utf8(whole.rest(9, 0.0, 1).job).unwrap();
    assert!(
        text.contains("G21\rG90\r") && text.contains("\rG0X762Y508F") && text.contains("\rG20\rG1X30Y40"),
        "{text:?}"
    );
}

#[test]
fn states_are_restored() {
    let table = [
        // Inches, increments, the plane, another origin.
        (
            "M3S0\nG20G90G55G18\nG0X1Y2\nG91\nG1X1F10\nX1\nY1",
            6,
            "|G55|M3 S0|G4 P0.15|G0X76.2Y50.8|F254|G1|G18|G20|G91|Y1",
        ),
        ("M3S0\nG21G90\nG0X1Y2\nG93\nG1X5F2\nG1X6F2", 5, "|G0X5Y2|G93|G1X6F2"),
        // Nor does a feed that each line has for itself.
        ("M3S0\nG21G90\nG0X1Y2\nG93\nG1X5F2\nX6F2", 5, "|G0X1Y2|G0|G93|G1X5F2/X6F2"),
        // The place is called by another name.
        ("M3S0\nG21G90\nG0X9Y9\nG92X0Y1\nG0X1\nG0X2", 5, "|G94|G92.1|M3 S0|G4 P0.15|G0X10Y9|G92X1Y1|G0|G0X2"),
        // An arc does not go without saying: back to the line before.
        ("M3S0\nG21G90\nG0X0Y0\nG2X2I1F100\nX4I1\nM5", 4, "|G0X0Y0|G0|G2X2I1F100/X4I1/M5"),
        ("M3S0\nG21G90\nG0X0Y0\nG2X2I1F100\nG2X4I1\nM5", 4, "|G0X2Y0|F100|G2X4I1/M5"),
        // Whether a pen at another level draws is not known: back to where it was up.
        ("M3S0\nG21G90\nG0X1Y1\nM3S900\nG1X2F100\nG1X3", 5, "|G0X1Y1|G0|M3S900/G1X2F100/G1X3"),
    ];
    for (text, executed, expected) in table {
        let left = left(text, "grbl-servo", executed, 0.0, 1);
        assert!(left.contains(expected) || left.ends_with(expected), "{text:?} gave {left}");
    }
    let z = "G21G90\nG1Z5F900\nG0X1Y1\nG1Z-1F300\nG1X2F100\nG1X3\nG1Z5\n";
    assert!(left(z, "grbl-z", 5, 0.0, 1).ends_with("|G0X2Y1|G1 Z1 F1000|G1 Z0 F300|G1Z-1F1000|F100|G1|G1X3/G1Z5"));
    assert!(left(z, "grbl-z", 3, 0.0, 1).ends_with("|G0X1Y1|G1Z5F1000|F900|G0|G1Z-1F300/G1X2F100/G1X3/G1Z5"));
}

#[test]
fn the_right_pen_is_asked_for() {
    let text = "G21G90\nM3S0\nM0 (pen 2)\nG0X1Y1\nG0X2\nM0 ;pen 3)\nG0X3\n";
    let table = [(2, 1, false), (4, 2, true), (5, 1, true)];
    for (executed, pen, asks) in table {
        let left = left(text, "grbl-servo", executed, 0.0, pen);
        assert_eq!(left.contains("|M0;pen 2|") || left.contains("|M0 (pen 2)|"), asks, "{executed}: {left}");
    }
    let left = left(text, "grbl-servo", 5, 0.0, 2);
    let job = Job::new(&left.replace('|', "\r").replace('/', "\n"), 79).unwrap();
    let pauses: Vec<_> =
        job.lines().iter().filter(|l| matches!(l.turn, Turn::Pause(_))).map(|l| l.turn.clone()).collect();
    assert_eq!(pauses, [Turn::Pause("pen 2".into()), Turn::Pause("pen 3)".into())]);
}

#[test]
fn a_line_put_before_the_rest_bears_the_number_of_the_first() {
    let (device, gcode) = device("grbl-servo");
    let (job, followed) = followed(TWO, &device);
    let mut rest = rest(&job, &followed, 10, 0.0, &device, &gcode, 1);
    let added = rest.added;
    rest.begin_with("G28");
    let again = Job::new(&String::from_utf8(rest.job).unwrap(), 79).unwrap();
    assert_eq!((rest.added, again.lines()[0].text.as_str(), again.lines()[0].number), (added + 1, "G28", 11));
    assert_eq!(again.lines()[rest.added..], job.lines()[10..]);
}

#[test]
fn lines_keep_their_numbers() {
    let text = "G21G90\n\n(head)\nM3S0\r\nG0X1Y1\n\nG1X2F100\rX3\r\r\nX4\n";
    let (device, gcode) = device("grbl-servo");
    let (job, followed) = followed(text, &device);
    for executed in 0..=job.lines().len() {
        let rest = rest(&job, &followed, executed, 0.0, &device, &gcode, 1);
        let again = Job::new(&String::from_utf8(rest.job.clone()).unwrap(), 79);
        if executed == job.lines().len() && again.is_err() {
            continue;
        }
        let again = again.unwrap();
        assert_eq!(again.lines().len(), rest.added + job.lines().len() - rest.skipped);
        assert_eq!(again.lines()[rest.added..], job.lines()[rest.skipped..], "{executed}");
        let first = job.lines().get(rest.skipped).map_or(1, |line| line.number);
        assert!(again.lines()[..rest.added].iter().all(|line| line.number == first));
        assert_eq!(rest.of_whole(0), rest.skipped);
        assert_eq!(rest.of_whole(again.lines().len()), job.lines().len());
    }
}

/// The trace of what is sent, of a machine that was switched on anew.
fn again(rest: &Rest, device: &Device) -> Trace {
    let job = Job::new(&String::from_utf8(rest.job.clone()).unwrap(), 79).unwrap();
    follow(&job, &Machine::of(device).unwrap(), &Modal::after_reset(), Position::UNKNOWN).trace
}

/// Lines of a job, most of which move.
fn line() -> impl Strategy<Value = String> {
    let number = || (-400_i32..400).prop_map(|n| format!("{}", f64::from(n) * 0.25));
    prop_oneof![
        6 => (number(), number()).prop_map(|(x, y)| format!("G1X{x}Y{y}F1500")),
        2 => number().prop_map(|x| format!("X{x}")),
        2 => number().prop_map(|y| format!("G0Y{y}")),
        1 => number().prop_map(|r| format!("G2X{r}Y1R900F700")),
        3 => Just("M3S1000".to_owned()),
        3 => Just("M3S0".to_owned()),
        1 => Just("G4P0.2".to_owned()),
        1 => Just("G91".to_owned()),
        1 => Just("G90".to_owned()),
        1 => Just("G20".to_owned()),
        1 => Just("G21".to_owned()),
        1 => Just("G92X1Y2".to_owned()),
        1 => Just("G28".to_owned()),
        1 => Just("G55".to_owned()),
    ]
}

proptest! {
    #[test]
    fn what_is_left_ends_as_the_whole_and_leaves_no_ink_out(
        lines in proptest::collection::vec(line(), 1..40),
        cut in any::<proptest::sample::Index>(),
        overlap_mm in prop_oneof![Just(0.0), 0.1..60.0],
    ) {
        let text = format!("G21G90G54\nM3S0\nG0X0Y0\n{}\n", lines.join("\n"));
        let (device, gcode) = device("grbl-servo");
        prop_assume!(matches!(device.language, Language::Grbl(_)));
        let (job, followed) = followed(&text, &device);
        let executed = cut.index(job.lines().len());
        let rest = rest(&job, &followed, executed, overlap_mm, &device, &gcode, 1);
        prop_assert!(rest.skipped <= executed);
        let whole = &followed.trace.steps[rest.skipped..];
        let again = again(&rest, &device);
        let (added, tail) = again.steps.split_at(rest.added);
        prop_assert!(added.iter().all(|step| step.ink_mm == 0.0), "the lines before it draw");
        prop_assert_eq!(tail.len(), whole.len());
        for (index, (tail, whole)) in tail.iter().zip(whole).enumerate() {
            for (a, b) in tail.end.axes().iter().zip(whole.end.axes()) {
                // Axes that the whole job never named are those of the machine.
                prop_assert!(b.is_none() || a.is_some_and(|a| (a - b.unwrap_or(a)).abs() < 1e-3), "{index}: {tail:?} {whole:?}");
            }
            prop_assert!(whole.pen_down.is_none() || tail.pen_down == whole.pen_down);
            // The first may be drawn in part: what comes before its beginning was executed.
            prop_assert!(tail.ink_mm >= whole.ink_mm - 1e-3 || (index == 0 && rest.skipped < executed), "{index}");
        }
        let ink = |steps: &[Step]| steps[..executed - rest.skipped].iter().map(|step| step.ink_mm).sum::<f64>();
        prop_assert!(ink(tail) >= ink(whole).min(overlap_mm) - 1e-3, "{} of {}", ink(tail), ink(whole));
    }
}
