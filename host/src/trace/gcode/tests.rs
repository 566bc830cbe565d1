//! Jobs as tables, and jobs whose lengths are known otherwise.

use penvis_firmware::Mechanics;
use proptest::prelude::*;

use super::*;
use crate::device::find;

const SERVO: Pen = Pen::Servo { index: 0, up: 0, down: 1000, raise_s: 0.15, lower_s: 0.2, soft_steps: 1 };

/// A machine to which lines come at once.
fn machine(pen: Pen) -> Machine {
    let mechanics = Mechanics { max_rate: [6000.0; 3], acceleration: [500.0; 3], junction_deviation: 0.01 };
    Machine {
        pen,
        pen_change: vec!["M0 (pen {pen})".into()],
        dialect: Dialect::Grbl,
        pace: Pace::of_motion(mechanics, 16),
    }
}

fn followed(gcode: &str, pen: Pen) -> Followed {
    follow(&Job::new(gcode, 79).unwrap(), &machine(pen), &Modal::default(), Position::UNKNOWN)
}

/// Where the pen is after the lines, joined by blanks.
fn ends(gcode: &str) -> String {
    let number = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{}", (value * 1e6).round() / 1e6));
    let steps = followed(&gcode.replace('|', "\n"), SERVO).trace.steps;
    let ends: Vec<String> = steps.iter().map(|step| step.end.axes().map(number).join(",")).collect();
    ends.join(" ")
}

#[test]
fn positions_are_known_as_far_as_the_job_tells() {
    let table = [
        // Without units or a distance mode, nothing is known.
        ("G0X1", "-,-,-"),
        ("G21|G0X1", "-,-,- -,-,-"),
        ("G21G90|X1", "-,-,- -,-,-"),
        ("G21G90|G0X1|Y2|G1Z-.5", "-,-,- 1,-,- 1,2,- 1,2,-0.5"),
        ("G21G90G0X1Y2|G91|X1|Y-1X+.25", "1,2,- 1,2,- 2,2,- 2.25,1,-"),
        ("G21G91|G0X1", "-,-,- -,-,-"),
        ("G20G90G0X1Y2|G21G91X.6", "25.4,50.8,- 26,50.8,-"),
        ("G21G90G0X1Y2|G53G0X5|X1", "1,2,- -,2,- 1,2,-"),
        ("G21G90G0X1Y2|G54|G0X1Y1|G54|G55", "1,2,- -,-,- 1,1,- 1,1,- -,-,-"),
        // The place stays, and its name changes.
        ("G21G90G0X1Y2|G92X0|G0X1|G92.1", "1,2,- 0,2,- 1,2,- -,-,-"),
        ("G21G90G0X1Y2|G28|G0X1", "1,2,- -,-,- 1,-,-"),
        ("G21G90G0X1Y2|G10L20P1X0Y0|G28.1", "1,2,- -,-,- -,-,-"),
        ("G21G90G0X1Y2|$H|G0X1|G21G90G0X1", "1,2,- -,-,- -,-,- 1,-,-"),
        ("G21G90G0X1Y2|$$|G0X3", "1,2,- 1,2,- 3,2,-"),
        ("G21G90G0X1Y2|G5X3Y3|G90G21X3", "1,2,- -,-,- -,-,-"),
        ("G21G90G0X1Y2|G38.2X9F1|X1|G0X1", "1,2,- -,-,- -,-,- 1,-,-"),
        ("G21G90G0X1Y2|G80|X3", "1,2,- 1,2,- -,-,-"),
        ("G21G90G0X1Y2|A3|G0X", "1,2,- -,-,- -,-,-"),
        ("G21G90G0X1Y2Z3|G49|G43.1Z1", "1,2,3 1,2,- 1,2,1"),
        ("G21G91G90G0X1|M30|G0X2", "1,-,- 1,-,- 2,-,-"),
    ];
    for (gcode, expected) in table {
        assert_eq!(ends(gcode), expected, "{gcode}");
    }
}

#[test]
fn a_pen_is_down_when_the_profile_says_so() {
    let z = Pen::Z { up_mm: 3.0, down_mm: 0.0, feed: 1000.0, soft_mm: 0.0, soft_feed: 1000.0 };
    let half = Pen::Servo { index: 0, up: 500, down: 200, raise_s: 0.1, lower_s: 0.1, soft_steps: 1 };
    let (up, down, unknown) = (Some(false), Some(true), None);
    /// Pen, lines, and for each of them whether the pen is down and what it cuts.
    type Row<'a> = (Pen, &'a str, &'a [(Option<bool>, Cut)]);
    let table: &[Row<'_>] = &[
        (
            SERVO,
            "M3S0|G4P.2|M3S1000|G4P.2|S0|M5",
            &[
                (up, Cut::StrokeEnd),
                (up, Cut::None),
                (down, Cut::StrokeStart),
                (down, Cut::None),
                (up, Cut::StrokeEnd),
                (up, Cut::None),
            ],
        ),
        // A soft landing begins the stroke.
        (
            SERVO,
            "S0M3|S600|S1000|S300|S0",
            &[
                (up, Cut::StrokeEnd),
                (unknown, Cut::StrokeStart),
                (down, Cut::None),
                (unknown, Cut::None),
                (up, Cut::StrokeEnd),
            ],
        ),
        (SERVO, "S1000|M4|M5", &[(unknown, Cut::None), (down, Cut::StrokeStart), (up, Cut::StrokeEnd)]),
        // Without a signal the servo is where it was, if nothing pulls at it.
        (
            half,
            "M3S500|M5|M3S200|M5",
            &[(up, Cut::StrokeEnd), (up, Cut::None), (down, Cut::StrokeStart), (unknown, Cut::None)],
        ),
        (half, "M3S510|S100", &[(up, Cut::StrokeEnd), (down, Cut::StrokeStart)]),
        (
            z,
            "G21G90G0Z5|Z3|G1Z.5F100|Z0|X1|Z3",
            &[
                (up, Cut::StrokeEnd),
                (up, Cut::None),
                (unknown, Cut::StrokeStart),
                (down, Cut::None),
                (down, Cut::None),
                (up, Cut::StrokeEnd),
            ],
        ),
    ];
    for (pen, gcode, expected) in table {
        let steps = followed(&gcode.replace('|', "\n"), *pen).trace.steps;
        let found: Vec<_> = steps.iter().map(|step| (step.pen_down, step.cut)).collect();
        assert_eq!(found, *expected, "{gcode}");
    }
}

#[test]
fn pens_are_told_by_the_profiles_own_lines() {
    let gcode = "G21\nM0 (pen 2)\nM0 (coffee 3)\nT4\nM0(pen 12)\nM0\n";
    let pens: Vec<u32> = followed(gcode, SERVO).trace.steps.iter().map(|step| step.pen).collect();
    assert_eq!(pens, [1, 2, 2, 4, 12, 12]);
}

#[test]
fn the_state_after_each_line_is_kept() {
    let followed = followed("G21\nG90 G0 X1\nG1 X2 F600\nX3\nG20 F10\nM3 S7\nG93\nM30\n", SERVO);
    assert_eq!(*followed.state_after(None), Modal::default());
    let after = |index| followed.state_after(Some(index));
    assert_eq!((after(0).units, after(0).distance), (Some(Units::Millimetres), None));
    assert_eq!((after(1).motion, after(1).feed), (Some(Motion::Rapid), None));
    assert_eq!((after(3).motion, after(3).feed), (Some(Motion::Linear), Some(600.0)));
    assert_eq!(after(4).feed, Some(254.0));
    assert_eq!((after(5).speed, after(5).spindle), (Some(7.0), Some(Spindle::Clockwise)));
    assert_eq!((after(6).feed, after(6).feed_mode), (None, Some(FeedMode::InverseTime)));
    assert_eq!((after(7).spindle, after(7).units), (Some(Spindle::Off), Some(Units::Inches)));
    assert_eq!(after(7), after(99));
}

#[test]
fn times_are_those_of_the_motion_and_the_dwells() {
    // 600 mm/min are 10 mm/s, at 500 mm/s² within 0.02 s and 0.1 mm.
    let steps = followed("G21G90G0X0Y0\nM3S0\nG4P.5\nG1X10.2F600\nG4P1\nX20.4\n", SERVO).trace.steps;
    let seconds: Vec<f64> = steps.iter().map(|step| (step.seconds * 1e4).round() / 1e4).collect();
    assert_eq!(seconds, [0.0, 0.0, 0.5, 1.04, 1.0, 1.04]);
}

#[test]
fn marlin_dwells_in_milliseconds_or_seconds() {
    let machine = Machine { dialect: Dialect::Marlin, ..machine(SERVO) };
    let job = Job::new("G4P250\nG4S2\nM104S200\n", 79).unwrap();
    let followed = follow(&job, &machine, &Modal::default(), Position::UNKNOWN);
    let seconds: Vec<f64> = followed.trace.steps.iter().map(|step| step.seconds).collect();
    assert_eq!(seconds, [0.25, 2.0, 0.0]);
    assert_eq!(followed.state_after(Some(2)).speed, None);
}

#[test]
fn marlin_turns_its_servo_by_an_angle() {
    let pen = Pen::Servo { index: 1, up: 90, down: 30, raise_s: 0.1, lower_s: 0.1, soft_steps: 1 };
    let machine = Machine { dialect: Dialect::Marlin, ..machine(pen) };
    let job = Job::new("M280P1S90\nG4P200\nM400\nM280P0S30\nM280P1S30\nS90\n", 79).unwrap();
    let steps = follow(&job, &machine, &Modal::default(), Position::UNKNOWN).trace.steps;
    let found: Vec<_> = steps.iter().map(|step| step.pen_down).collect();
    assert_eq!(found, [Some(false), Some(false), Some(false), Some(false), Some(true), Some(true)]);
}

#[test]
fn each_shipped_device_that_speaks_gcode_is_a_machine() {
    for name in crate::device::names() {
        let device = find(name).unwrap();
        assert_eq!(Machine::of(&device).is_some(), device.language.name() != "hpgl", "{name}");
    }
}

#[test]
fn arcs_of_known_lengths() {
    let pi = std::f64::consts::PI;
    let table = [
        // A quarter, three quarters, a full turn, a half by its radius, the long way by it.
        ("G3X0Y10I-10J0", pi * 5.0),
        ("G2X0Y10I-10J0", pi * 15.0),
        ("G2X10Y0I-10", pi * 20.0),
        ("G3X-10Y0R10", pi * 10.0),
        ("G3X0Y10R-10", pi * 15.0),
        ("G3X0Y10R10", pi * 5.0),
        ("G2X0Y10R10", pi * 5.0),
        // A helix casts its circle; a circle in the zx plane casts a line there and back.
        ("G3X0Y10I-10J0Z5", pi * 5.0),
        ("G18G2X10Z0I-10K0", 40.0),
        // Refused by the controller.
        ("G3X0Y12I-10J0", 0.0),
        ("G3X-30Y0R10", 0.0),
        ("G3X0Y10", 0.0),
    ];
    for (arc, length) in table {
        let steps = followed(&format!("G21G90G17F600M3S1000\nG0X10Y0Z0\n{arc}"), SERVO).trace.steps;
        assert!((steps[2].ink_mm - length).abs() < 0.01, "{arc}: {} for {length}", steps[2].ink_mm);
    }
}

/// A job of strokes through these points (thousandths of a mm), absolute or in differences.
fn job_of(strokes: &[Vec<[i32; 2]>], relative: bool) -> String {
    let mut text = String::from("G21\nM3S0\nG90G0X0Y0\n");
    let mut at = [0, 0];
    for stroke in strokes {
        for (k, point) in stroke.iter().enumerate() {
            let to = if relative { [point[0] - at[0], point[1] - at[1]] } else { *point };
            let words = format!("X{:.3}Y{:.3}", f64::from(to[0]) / 1e3, f64::from(to[1]) / 1e3);
            let mode = if relative { "G91" } else { "G90" };
            match k {
                0 => text.push_str(&format!("{mode}G0{words}\nS1000\n")),
                _ => text.push_str(&format!("G1{words}F1000\n")),
            }
            at = *point;
        }
        text.push_str("S0\n");
    }
    text
}

proptest! {
    /// Lengths are those of the polylines, whichever way they are written, and no line takes less time than its feed allows.
    #[test]
    fn sums_are_those_of_the_strokes(
        strokes in prop::collection::vec(prop::collection::vec(prop::array::uniform2(-5_000..5_000i32), 1..20), 1..10)
    ) {
        let (mut ink, mut travel, mut at) = (0.0, 0.0, DVec3::ZERO);
        for stroke in &strokes {
            for (k, point) in stroke.iter().enumerate() {
                let to = DVec3::new(f64::from(point[0]) / 1e3, f64::from(point[1]) / 1e3, 0.0);
                *(if k == 0 { &mut travel } else { &mut ink }) += at.distance(to);
                at = to;
            }
        }
        for relative in [false, true] {
            let trace = followed(&job_of(&strokes, relative), SERVO).trace;
            prop_assert!((trace.ink_mm() - ink).abs() < 1e-6 && (trace.travel_mm() - travel).abs() < 1e-6);
            let last = trace.steps.last().unwrap().end.xy().unwrap();
            prop_assert!(last.distance(at.truncate()) < 1e-6);
            prop_assert_eq!(trace.steps.iter().filter(|step| step.cut == Cut::StrokeStart).count(), strokes.len());
            // Each axis has its own speed, and a diagonal is √2 times as fast.
            let least = ink / 1000.0 * 60.0 + travel / 6000.0 * 60.0 / f64::sqrt(2.0);
            prop_assert!(trace.seconds() >= least * (1.0 - 1e-5));
        }
    }

    /// Any text ends in steps, one a line, and in finite sums.
    #[test]
    fn any_words_are_followed(words in prop::collection::vec(("[A-Z$\\[]", -1e3..1e3f64, prop::bool::ANY), 1..60)) {
        let text: String = words
            .iter()
            .map(|(letter, value, ends)| format!("{letter}{}{}", (value * 10.0).round() / 10.0, if *ends { "\n" } else { "" }))
            .collect();
        let Ok(job) = Job::new(&text, 10_000) else { return Ok(()) };
        let trace = follow(&job, &machine(SERVO), &Modal::after_reset(), Position::UNKNOWN).trace;
        prop_assert_eq!(trace.steps.len(), job.lines().len());
        prop_assert!(trace.seconds().is_finite() && trace.ink_mm().is_finite() && trace.travel_mm().is_finite());
    }
}

#[test]
fn homing_of_some_axes_leaves_the_modes_as_they_are() {
    let pen = Pen::Servo { index: 0, up: 90, down: 30, raise_s: 0.1, lower_s: 0.1, soft_steps: 1 };
    let job = Job::new("G21\nG90\nG28 X Y\nG0X1Y2F600\nM280P0S30\nG1X4Y6\nG0 X\nG1X9\n", 79).unwrap();
    let machine = Machine { dialect: Dialect::Marlin, ..machine(pen) };
    let followed = follow(&job, &machine, &Modal::default(), Position::UNKNOWN);
    let steps = &followed.trace.steps;
    assert_eq!((steps[2].end.x, steps[3].end.x, steps[5].ink_mm), (None, Some(1.0), 5.0));
    // Where nothing is homed it is no word at all.
    assert_eq!((steps[6].end.x, steps[7].end.x), (None, None));
}
