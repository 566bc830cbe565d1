//! Conversations with a controller that tells its state and its place.

use super::*;

const STATE: &str = "[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]\r\nok\r\n";

/// The conversation up to the first line of the job, with a controller that answers `$G`.
fn started_verified(gcode: &str) -> (Grbl, u64) {
    let mut grbl = grbl(gcode);
    let settings = "$13=0\r\n$32=0\r\n$100=250.000\r\n$101=250.000\r\n$102=250.000\r\nok\r\n";
    let idle = "<Idle|MPos:0.000,0.000,0.000|FS:0,0|WCO:0.000,0.000,0.000>\r\n";
    let at = talk(&mut grbl, 0, &[In(BANNER), In(idle), In("error:1\r\nok\r\n"), In(settings), In(STATE)]);
    let out = grbl.take_output();
    let begun = b"?#\n$I\n$$\n$G\n";
    assert!(out.starts_with(begun), "{:?}", String::from_utf8_lossy(&out));
    grbl.outbox.write(&out[begun.len()..]);
    (grbl, at)
}

const STROKE: &str =
    "M3S0\nG4P0.15\nG0X10Y20\nM3S1000\nG4P0.2\nG1X30.5Y20F2000\nG1X30.5Y40.125\nM3S0\nG4P0.15\nG0X0Y0\n";
const UP: &str = "[GC:G0 G54 G17 G21 G90 G94 M3 M9 T0 F0 S0]\r\nok\r\n";
const DOWN: &str = "[GC:G0 G54 G17 G21 G91 G94 M3 M9 T0 F0 S1000]\r\nok\r\n";
const DRAWN: &str = "[GC:G1 G54 G17 G21 G90 G94 M3 M9 T0 F2000 S0]\r\nok\r\n";
const LEFT: &str = "[GC:G0 G54 G17 G21 G90 G94 M3 M9 T0 F2000 S0]\r\nok\r\n";
const AT_START: &str = "<Idle|MPos:10.000,20.000,0.000|FS:0,0>\r\n";
const AT_END: &str = "<Idle|MPos:30.500,40.125,0.000|FS:0,0>\r\n";
const AT_ZERO: &str = "<Idle|MPos:0.000,0.000,0.000|FS:0,0>\r\n";

/// The conversation up to the pen being down, with nothing checked yet.
fn lowered() -> (Grbl, u64) {
    let (mut grbl, at) = started_verified(STROKE);
    let at = talk(
        &mut grbl,
        at,
        &[
            Out("G0M3S0\nG4P0.15\n$G\n"),
            In("ok\r\n"),
            Wait(150),
            In("ok\r\n"),
            In(UP),
            Out("G0X10Y20\nG0M3S1000\nG91G4P0.2\n$G\n"),
            In("ok\r\nok\r\n"),
            Wait(200),
            In("ok\r\n"),
        ],
    );
    (grbl, at)
}

/// The conversation up to the pen being lifted again, with nothing checked yet.
fn lifted() -> (Grbl, u64) {
    let (mut grbl, at) = lowered();
    let at = talk(
        &mut grbl,
        at,
        &[
            In(DOWN),
            In(AT_START),
            Out("G1X20.5Y0F2000\nG1X0Y20.125\nG1G90M3S0\nG4P0.15\n$G\n"),
            In("ok\r\nok\r\nok\r\n"),
            Wait(150),
            In("ok\r\n"),
        ],
    );
    (grbl, at)
}

#[test]
fn a_stroke_is_held_against_what_it_should_be() {
    let (mut grbl, at) = lifted();
    assert_eq!(grbl.progress(), Progress { acknowledged: 9, executed: 5, total: 10 });
    let at = talk(&mut grbl, at, &[In(DRAWN), In(AT_END), Out("G0X0Y0\nG4P0.01\n$G\n")]);
    assert_eq!(grbl.progress(), Progress { acknowledged: 9, executed: 9, total: 10 });
    talk(&mut grbl, at, &[In("ok\r\nok\r\n"), In(LEFT), In(AT_ZERO), Says(Event::Done)]);
    assert_eq!(grbl.progress(), Progress { acknowledged: 10, executed: 10, total: 10 });
}

#[test]
fn a_place_seen_in_the_dwell_need_not_be_asked_for_again() {
    let (mut grbl, at) = started_verified(STROKE);
    let at = talk(
        &mut grbl,
        at,
        &[
            In("ok\r\n"),
            Wait(150),
            In("ok\r\n"),
            In(UP),
            Out("G0M3S0\nG4P0.15\n$G\nG0X10Y20\nG0M3S1000\nG91G4P0.2\n$G\n"),
            In("ok\r\n"),
        ],
    );
    assert!(grbl.take_output().is_empty());
    let at = talk(&mut grbl, at, &[In("ok\r\n")]);
    assert_eq!(grbl.take_output(), b"?");
    talk(&mut grbl, at, &[In(AT_START), Wait(200), In("ok\r\n"), In(DOWN)]);
    assert!(grbl.take_output().ends_with(b"G1X20.5Y0F2000\nG1X0Y20.125\nG1G90M3S0\nG4P0.15\n$G\n"));
}

#[test]
fn a_wrong_place_stops_with_the_line() {
    let (mut grbl, at) = lifted();
    // The line with 20.125 lost its 1.
    let wrong = "<Idle|WPos:30.500,40.025,0.000|FS:0,0>\r\n<Idle|WPos:30.500,40.025,0.000|FS:0,0>\r\n";
    talk(
        &mut grbl,
        at,
        &[
            In(DRAWN),
            In(wrong),
            Out(""),
            In(wrong),
            Out("!\x18"),
            In(BANNER),
            Wait(1),
            Out("M3S0\n"),
            In("ok\n"),
            Wait(1),
            Fails(&["Y by -0.100 mm", "lines 6 to 9", "at line 7 (`G1X30.5Y40.125`)"]),
        ],
    );
}

#[test]
fn one_wrong_report_is_asked_again() {
    let (mut grbl, at) = lifted();
    let wrong = "<Idle|MPos:30.500,40.225,0.000|FS:0,0>\r\n";
    talk(&mut grbl, at, &[In(DRAWN), In(wrong), In(AT_END), Out("G0X0Y0\nG4P0.01\n$G\n")]);
    let (mut grbl, at) = lifted();
    let wrong = "[GC:G1 G54 G17 G21 G90 G94 M3 M9 T0 F2000 S8]\r\nok\r\n";
    talk(&mut grbl, at, &[In(wrong), Out("$G\n"), In(DRAWN), In(AT_END), Out("G0X0Y0\nG4P0.01\n$G\n")]);
}

#[test]
fn the_pens_lines_are_repeated_before_anything_is_drawn() {
    // The pen's line was taken for S100.
    let (mut grbl, at) = lowered();
    let wrong = "[GC:G0 G54 G17 G21 G91 G94 M3 M9 T0 F0 S100]\r\nok\r\n";
    let at = talk(
        &mut grbl,
        at,
        &[
            In(wrong),
            Out("$G\n"),
            In(wrong),
            Out("G0M3S1000\nG91G4P0.2\n$G\n"),
            In("ok\r\n"),
            Wait(200),
            In("ok\r\n"),
            In(DOWN),
            In(AT_START),
            Out("G1X20.5Y0F2000\nG1X0Y20.125\nG1G90M3S0\nG4P0.15\n$G\n"),
        ],
    );
    assert_eq!(grbl.take_event(), None);
    let _ = at;
    // It is wrong for good.
    let (mut grbl, at) = lowered();
    talk(
        &mut grbl,
        at,
        &[
            In(wrong),
            In(wrong),
            In("ok\r\n"),
            Wait(200),
            In("ok\r\n"),
            In(wrong),
            In(wrong),
            In("<Idle|MPos:10.000,20.000,0.000>\r\n"),
            In(BANNER),
            In("ok\r\n"),
            Wait(1),
            Fails(&["S100 and not S1000", "line 5"]),
        ],
    );
}

fn is_told(event: Option<Event>, words: &str) -> bool {
    matches!(event, Some(Event::Warning(text)) if text.contains(words))
}

#[test]
fn a_changed_feed_is_told_and_set_again() {
    let slow = "[GC:G1 G54 G17 G21 G90 G94 M3 M9 T0 F200 S0]\r\nok\r\n";
    let (mut grbl, at) = lifted();
    let at = talk(&mut grbl, at, &[In(slow), Out("$G\n"), In(slow), Out("F2000\n$G\n"), In("ok\r\n")]);
    assert!(is_told(grbl.take_event(), "a feed of 200 and not 2000 mm/min in lines 6 to 9"));
    talk(&mut grbl, at, &[In(DRAWN), In(AT_END), Out("G0X0Y0\nG4P0.01\n$G\n")]);
    assert_eq!((grbl.take_event(), grbl.progress().executed), (None, 9));
    // A report that was changed on the way says nothing.
    let (mut grbl, at) = lifted();
    talk(&mut grbl, at, &[In(slow), In(DRAWN), In(AT_END), Out("$G\nG0X0Y0\nG4P0.01\n$G\n")]);
    assert_eq!(grbl.take_event(), None);
    // A controller that means something else by it is believed once.
    let (mut grbl, at) = lifted();
    let at = talk(&mut grbl, at, &[In(slow), In(slow), In("ok\r\n"), In(slow), In(slow), In(AT_END)]);
    assert!(is_told(grbl.take_event(), "and not 2000") && is_told(grbl.take_event(), "its feed is not verified"));
    let left = "[GC:G0 G54 G17 G21 G90 G94 M3 M9 T0 F200 S0]\r\nok\r\n";
    talk(&mut grbl, at, &[In("ok\r\nok\r\n"), In(left), In(AT_ZERO), Says(Event::Done)]);
}

#[test]
fn a_dwell_that_was_too_short_is_repeated() {
    let (mut grbl, at) = started_verified(STROKE);
    talk(
        &mut grbl,
        at,
        &[
            Out("G0M3S0\nG4P0.15\n$G\n"),
            In("ok\r\n"),
            Wait(20),
            In("ok\r\n"),
            In(UP),
            Out("G4P0.15\n$G\n"),
            Wait(150),
            In("ok\r\n"),
            In(UP),
            Out("G0X10Y20\nG0M3S1000\nG91G4P0.2\n$G\n"),
        ],
    );
}

#[test]
fn lost_and_doubled_answers_are_made_good() {
    // Two of them are lost.
    let (mut grbl, at) = lowered();
    let at = talk(
        &mut grbl,
        at,
        &[
            In(DOWN),
            In(AT_START),
            Out("G1X20.5Y0F2000\nG1X0Y20.125\nG1G90M3S0\nG4P0.15\n$G\n"),
            In("k\r\nok\r\nok\r\n"),
            Wait(150),
            In("oo\r\n"),
            In(DRAWN),
            In(AT_END),
            Out("G0X0Y0\nG4P0.01\n$G\n"),
        ],
    );
    assert_eq!((grbl.progress().executed, grbl.unknown_lines(), grbl.used), (9, 2, 7 + 8 + 3));
    // One comes twice, so that the answer of `$G` seems to be there before it is.
    talk(&mut grbl, at, &[In("ok\r\nok\r\nok\r\n"), Wait(10), In(LEFT), In(AT_ZERO), Says(Event::Done)]);
}

#[test]
fn an_idle_controller_is_asked_what_it_has_taken() {
    // All answers of a part are lost, and that of `$G` with them.
    let (mut grbl, mut at) = lowered();
    at = talk(&mut grbl, at, &[In(DOWN), In(AT_START), In("k\r\nk\r\nk\r\nk\r\n[GC:x]\r\nk\r\n")]);
    grbl.take_output();
    for _ in 0..3 {
        at = talk(&mut grbl, at, &[In(AT_END), Wait(600)]);
    }
    talk(&mut grbl, at, &[Out("$G\n"), In(DRAWN), Wait(1_100), In(AT_END)]);
    assert_eq!(grbl.progress().executed, 9);
}

#[test]
fn a_controller_that_never_answers_again_is_given_up() {
    let (mut grbl, mut at) = lowered();
    at = talk(&mut grbl, at, &[In(DOWN), In(AT_START)]);
    for _ in 0..100 {
        at = talk(&mut grbl, at, &[In(AT_START), Wait(600)]);
    }
    talk(&mut grbl, at, &[In(BANNER), In("ok\n"), Wait(1), Fails(&["lost", "line 6"])]);

    let (mut grbl, mut at) = lowered();
    at = talk(&mut grbl, at, &[In(DOWN), In(AT_START)]);
    for _ in 0..150 {
        at = talk(&mut grbl, at, &[In("<Run|MPos:10.000,20.000,0.000>\r\n"), Wait(600)]);
    }
    talk(
        &mut grbl,
        at,
        &[In("<Idle>\n"), In(BANNER), In("ok\n"), Wait(1), Fails(&["neither moved nor taken", "line 6"])],
    );
}

#[test]
fn an_error_that_belongs_to_nothing_stops_too() {
    let (mut grbl, at) = lowered();
    talk(
        &mut grbl,
        at,
        &[
            In("ok\r\nerror:2\r\n"),
            Wait(1),
            In("<Idle|MPos:10.000,20.000,0.000>\r\n"),
            In(BANNER),
            In("ok\r\n"),
            Wait(1),
            Fails(&["error 2", "line 5"]),
        ],
    );
}

#[test]
fn a_pause_comes_at_the_end_of_the_stroke() {
    let (mut grbl, at) = lowered();
    let at = talk(
        &mut grbl,
        at,
        &[
            In(DOWN),
            In(AT_START),
            Wants(Control::Pause),
            Out("G1X20.5Y0F2000\nG1X0Y20.125\nG1G90M3S0\nG4P0.15\n$G\n"),
            In("ok\r\nok\r\nok\r\n"),
            Wait(150),
            In("ok\r\n"),
            In(DRAWN),
            In(AT_END),
            Says(Event::Paused),
            Out(""),
            // Its levels may be changed meanwhile: two steps down, and up higher by nothing that a servo can do.
            Wants(Control::PenHeight { down: true, steps: 2 }),
            Says(Event::Note("the pen-down level is S960 from now on".into())),
            Wants(Control::PenHeight { down: false, steps: 1 }),
            Says(Event::Note("the pen-up level stays at S0: there is no room that way".into())),
            Wait(9_000),
        ],
    );
    grbl.take_output();
    let at =
        talk(&mut grbl, at, &[In(AT_END), Wants(Control::Resume), Says(Event::Resumed), Out("G0X0Y0\nG4P0.01\n$G\n")]);
    talk(&mut grbl, at, &[In("ok\r\nok\r\n"), In(LEFT), In(AT_ZERO), Says(Event::Done)]);
}

#[test]
fn changed_levels_are_sent_and_expected() {
    let (mut grbl, at) = started_verified(STROKE);
    let down = "[GC:G0 G54 G17 G21 G91 G94 M3 M9 T0 F0 S960]\r\nok\r\n";
    talk(
        &mut grbl,
        at,
        &[
            In("ok\r\n"),
            Wait(150),
            Wants(Control::Pause),
            In("ok\r\n"),
            In(UP),
            Says(Event::Paused),
            Wants(Control::PenHeight { down: true, steps: 2 }),
            Says(Event::Note("the pen-down level is S960 from now on".into())),
            Wants(Control::Resume),
            Out("G0M3S0\nG4P0.15\n$G\nG0X10Y20\nG0M3S960\nG91G4P0.2\n$G\n"),
            In("ok\r\nok\r\n"),
            Wait(200),
            In("ok\r\n"),
            In(down),
            In(AT_START),
            Out("G1X20.5Y0F2000\nG1X0Y20.125\nG1G90M3S0\nG4P0.15\n$G\n"),
        ],
    );
}

#[test]
fn work_positions_and_inches_are_understood() {
    let (mut grbl, at) = lifted();
    talk(&mut grbl, at, &[In(DRAWN), In("<Idle|WPos:30.500,40.125,0.000>\r\n"), Out("G0X0Y0\nG4P0.01\n$G\n")]);
    let (mut grbl, at) = lifted();
    let moved = "<Idle|MPos:130.500,-59.875,0.000|WCO:100.000,-100.000,0.000>\r\n";
    talk(&mut grbl, at, &[In(DRAWN), In(moved), Out("G0X0Y0\nG4P0.01\n$G\n")]);
    let (mut grbl, at) = lifted();
    grbl.told.unit_mm = 25.4;
    let drawn = "[GC:G1 G54 G17 G21 G90 G94 M3 M9 T0 F78.7 S0]\r\nok\r\n";
    talk(&mut grbl, at, &[In(drawn), In("<Idle|WPos:1.2008,1.5797,0.0000>\r\n"), Out("G0X0Y0\nG4P0.01\n$G\n")]);
}

#[test]
fn one_line_at_a_time_where_the_profile_says_so() {
    let mut grbl = grbl("G21\nG90\n");
    grbl.options.streaming = Streaming::SendResponse;
    talk(
        &mut grbl,
        0,
        &[
            In(BANNER),
            In(IDLE),
            In("error:1\nok\nok\n"),
            In(STATE),
            Out("#\n$I\n$$\n$G\nG21\n"),
            In("ok\n"),
            Out("G90\n"),
            In("ok\n"),
            Out("G4P0.01\n"),
            In("ok\n"),
            Out("$G\n"),
            In(STATE),
            Says(Event::Done),
        ],
    );
}

#[test]
fn an_error_behind_a_lost_line_end_is_one() {
    for text in ["ok\rerror:20\r\n", "<Run|MPos:0.000,0.000,0error:20\r\n"] {
        let (mut grbl, at) = started_verified(STROKE);
        talk(&mut grbl, at, &[Out("G0M3S0\nG4P0.15\n$G\n"), In(text), Out("!")]);
    }
    let (mut grbl, at) = started_verified(STROKE);
    talk(&mut grbl, at, &[In("okALARM:1\r\n"), Fails(&["alarm 1"])]);
    let (mut grbl, at) = started_verified(STROKE);
    talk(&mut grbl, at, &[In("[MSG:error: none]\r\n>G5:error:20\r\n"), Says(Event::Message("error: none".into()))]);
    assert_eq!(grbl.phase, Phase::Streaming);
}

#[test]
fn probes_are_asked_again() {
    // Two answers are lost, and the first of `$G` is mangled.
    let mut grbl = grbl("G21\n");
    let mut at = talk(&mut grbl, 0, &[In(BANNER), In("<Idxe|MPos:0,0,0>\r\n"), In(IDLE), Wait(2_300), In(IDLE)]);
    at = talk(&mut grbl, at, &[In("ok\r\n"), Wait(2_300), In(IDLE)]);
    talk(
        &mut grbl,
        at,
        &[In("[GC:G0 G54 G17 G2?]\r\nok\r\n"), Out("#\n$I\n$$\n$G\n$G\n"), In(STATE), Out("G21\nG4P0.01\n$G\n")],
    );
    assert_eq!(grbl.take_event(), None);
}

#[test]
fn a_mangled_origin_is_not_believed() {
    let (mut grbl, at) = lifted();
    let mangled = "<Idle|MPos:30.500,40.125,0.000|FS:0,0|WCO:0.000,4.000,0.000>\r\n";
    talk(&mut grbl, at, &[In(DRAWN), In(mangled), Out("G0X0Y0\nG4P0.01\n$G\n")]);
    // It was mangled when it was told first: nothing is wrong until it is told again.
    let (mut grbl, mut at) = lifted();
    grbl.told.origin = Some([0.0, 4.0, 0.0]);
    at = talk(&mut grbl, at, &[In(DRAWN)]);
    for _ in 0..20 {
        at = talk(&mut grbl, at, &[In(AT_END)]);
    }
    let told = "<Idle|MPos:30.500,40.125,0.000|FS:0,0|WCO:0.000,0.000,0.000>\r\n";
    talk(&mut grbl, at, &[In(told), Out("G0X0Y0\nG4P0.01\n$G\n")]);
}

#[test]
fn a_restart_without_a_banner_is_noticed() {
    let long: String = (0..60).map(|k| format!("G1X{}.125Y20.25\n", 11 + k)).collect();
    let job = STROKE.replace("G1X30.5Y40.125\n", &long);
    let (mut grbl, at) = started_verified(&job);
    let mut at = talk(
        &mut grbl,
        at,
        &[
            In("ok\r\n"),
            Wait(150),
            In("ok\r\n"),
            In(UP),
            In("ok\r\nok\r\n"),
            Wait(200),
            In("ok\r\n"),
            In(DOWN),
            In(AT_START),
        ],
    );
    let sent: Vec<u8> = grbl.take_output().into_iter().filter(|byte| *byte != b'?').collect();
    assert!(sent.ends_with(b"X1Y0\nX1Y0\n"), "{}", String::from_utf8_lossy(&sent));
    for _ in 0..3 {
        at = talk(&mut grbl, at, &[In(AT_ZERO), Wait(600)]);
    }
    let steps = [
        Out("$G\n"),
        In(STATE),
        Out("!"),
        In(AT_ZERO),
        In(BANNER),
        In("ok\r\n"),
        Wait(1),
        Fails(&["G90 and not G91", "line 6"]),
    ];
    talk(&mut grbl, at, &steps);
}

#[test]
fn free_blocks_tell_how_far_a_stroke_is() {
    let mut grbl = grbl(&STROKE.replace("G1X30.5Y40.125\n", &"G1X12Y20.25\nG1X13Y20\n".repeat(40)));
    let mut at = talk(&mut grbl, 0, &[In(BANNER), In(IDLE), In("error:1\n[OPT:V,15,128]\nok\n$100=80\n$101=80\nok\n")]);
    at = talk(&mut grbl, at, &[In(STATE), In("ok\n"), Wait(150), In("ok\n"), In(UP), In("ok\nok\n"), Wait(200)]);
    at = talk(&mut grbl, at, &[In("ok\n"), In(DOWN), In("<Idle|WPos:10.000,20.000,0.000>\n")]);
    assert_eq!(grbl.progress().executed, 5);
    for _ in 0..60 {
        at = talk(&mut grbl, at, &[In("ok\n")]);
    }
    assert_eq!((grbl.progress().acknowledged, grbl.progress().executed), (65, 5));
    // Not before it was asked for since.
    let told = "<Run|WPos:12.000,20.000,0.000|Bf:5,100>\n";
    at = talk(&mut grbl, at, &[In(told)]);
    assert_eq!(grbl.progress().executed, 5);
    at = talk(&mut grbl, at, &[Wait(300), In(told)]);
    assert_eq!(grbl.progress().executed, 65 - 10 - 16);
    // All of it is taken back when its end is in the wrong place.
    for _ in 0..21 {
        at = talk(&mut grbl, at, &[In("ok\n")]);
    }
    at = talk(&mut grbl, at, &[Wait(300), In("<Run|WPos:12.000,20.000,0.000|Bf:10,100>\n")]);
    assert_eq!(grbl.progress().executed, 86 - 5 - 16, "in the check too");
    at = talk(&mut grbl, at, &[Wait(150), In("ok\n"), In(DRAWN)]);
    for _ in 0..3 {
        at = talk(&mut grbl, at, &[In("<Idle|WPos:13.000,20.250,0.000>\n")]);
    }
    assert_eq!((grbl.phase, grbl.progress().executed), (Phase::Holding, 5));
    let _ = at;
}
