//! Conversations as tables: what the controller says and when, and what must go out.

use proptest::prelude::*;

mod verified;

use super::*;
use crate::device::find;
use crate::protocol::dialogue;

/// A step of a conversation.
enum Step {
    /// The controller sends this; time goes on by a millisecond.
    In(&'static str),
    /// Time passes, in ms.
    Wait(u64),
    /// All that has gone out since the last `Out` (status requests left aside) is this.
    Out(&'static str),
    /// The next event is this.
    Says(Event),
    /// The next event is a failure whose message holds all of these.
    Fails(&'static [&'static str]),
    /// The user goes on after a pause.
    Resume,
    /// The user stops the job.
    Cancel,
    /// The user wants this.
    Wants(Control),
}
use Step::{Cancel, Fails, In, Out, Resume, Says, Wait, Wants};

const BANNER: &str = "\r\nGrbl 1.1h ['$' for help]\r\n";
const IDLE: &str = "<Idle|MPos:0.000,0.000,0.000|FS:0,0>\r\n";
const RUN: &str = "<Run|MPos:0.000,0.000,0.000|FS:0,0>\r\n";

fn options() -> Options {
    Options {
        rx_bytes: 128,
        line_limit: 79,
        streaming: Streaming::CharacterCounting,
        machine: Machine::of(&find("grbl-servo").unwrap()).unwrap(),
        servo: true,
        lift: vec!["M3S0".into()],
        baud: 115_200,
    }
}

fn unverified() -> Event {
    Event::Warning(UNVERIFIED.to_owned())
}

fn grbl(gcode: &str) -> Grbl {
    Grbl::new(Job::new(gcode, 79).unwrap(), options())
}

/// The conversation up to the first line of the job, with the default buffer.
fn started(gcode: &str) -> (Grbl, u64) {
    let mut grbl = grbl(gcode);
    let at = talk(
        &mut grbl,
        0,
        &[In(BANNER), In(IDLE), In("error:1\r\nok\r\nok\r\nerror:3\r\nerror:3\r\nerror:3\r\n"), Says(unverified())],
    );
    let out = grbl.take_output();
    assert!(out.starts_with(b"?#\n$I\n$$\n$G\n$G\n$G\n"), "{:?}", String::from_utf8_lossy(&out));
    grbl.outbox.write(&out[b"?#\n$I\n$$\n$G\n$G\n$G\n".len()..]);
    (grbl, at)
}

/// Goes through the steps from a time (ms) on; the time at their end.
fn talk(grbl: &mut Grbl, from: u64, steps: &[Step]) -> u64 {
    let mut at = from;
    for (i, step) in steps.iter().enumerate() {
        let now = Duration::from_millis(at);
        match step {
            In(text) => {
                dialogue::say(grbl, text, now);
                at += 1;
            }
            Wait(ms) => at = dialogue::wait(grbl, at, *ms),
            Out(expected) => {
                let out: Vec<u8> = grbl.take_output().into_iter().filter(|byte| *byte != b'?').collect();
                assert_eq!(String::from_utf8(out).unwrap(), *expected, "step {i}");
            }
            Says(event) => assert_eq!(grbl.take_event().as_ref(), Some(event), "step {i}"),
            Fails(words) => dialogue::assert_fails(grbl, words, i),
            Resume => grbl.control(Control::Resume, now),
            Cancel => grbl.control(Control::Stop, now),
            Wants(control) => grbl.control(*control, now),
        }
    }
    at
}

#[test]
fn a_job_from_banner_to_barrier() {
    let mut grbl = grbl("G21 (mm)\r\n\r\nG1 X1\r\n");
    talk(
        &mut grbl,
        0,
        &[
            Out(""),
            In(BANNER),
            In(IDLE),
            Out("#\n"),
            In("error:1\r\n"),
            Out("$I\n"),
            In("[VER:1.1h.20190825:]\r\n[OPT:V,15,128]\r\nok\r\n"),
            Out("$$\n"),
            In("$0=10\r\n$32=0\r\nok\r\n"),
            Out("$G\n"),
            In("error:3\r\nerror:3\r\nerror:3\r\n"),
            Says(unverified()),
            Out("$G\n$G\nG21\nG1X1\n"),
            In("ok\r\n"),
            Out(""),
            In("ok\r\n"),
            Out("G4P0.01\n"),
            In("ok\r\n"),
            Says(Event::Done),
            Wait(20_000),
            Out(""),
        ],
    );
    assert_eq!(grbl.progress(), Progress { acknowledged: 2, executed: 2, total: 2 });
}

#[test]
fn without_a_banner_it_asks_for_the_status() {
    let mut grbl = grbl("G0");
    talk(&mut grbl, 0, &[Wait(1999)]);
    assert!(grbl.take_output().is_empty());
    talk(&mut grbl, 1999, &[Wait(1)]);
    assert_eq!(grbl.take_output(), b"?");
    talk(
        &mut grbl,
        2000,
        &[
            In(IDLE),
            Out("#\n"),
            In("error:1\r\n"),
            Out("$I\n"),
            In("error:3\n"),
            In("error:3\nok\nok\nok\n"),
            Out("$$\n$G\n$G\n$G\nG0\n"),
        ],
    );
}

#[test]
fn a_banner_in_the_owners_words_is_none_and_does_no_harm() {
    let mut grbl = grbl("G0");
    talk(&mut grbl, 0, &[In("ets Jul 29 2019\r\nMy plotter is ready\r\nok\r\n"), Wait(2000)]);
    assert_eq!(grbl.take_output(), b"?");
}

#[test]
fn a_late_banner_starts_the_questions_again() {
    let mut grbl = grbl("G0");
    talk(&mut grbl, 0, &[Wait(2000), In(IDLE), Out("#\n"), In(BANNER), Out(""), In(IDLE), Out("#\n")]);
}

#[test]
fn nobody_there() {
    talk(&mut grbl("G0"), 0, &[Wait(10_000), Fails(&["no answer", "--baud", "115200"]), Out("")]);
}

#[test]
fn states_in_which_no_job_begins() {
    for (report, words) in [
        ("<Alarm|MPos:0,0,0>\n", &["Alarm", "$H", "$X"][..]),
        ("<Hold:0|MPos:0,0,0>\n", &["Hold:0"][..]),
        ("<Run>\n", &["Run", "rest"][..]),
    ] {
        let mut grbl = grbl("G0");
        talk(&mut grbl, 0, &[In(BANNER), In(report), Out("")]);
        let Some(Event::Failed(fault)) = grbl.take_event() else { panic!("it began") };
        for word in words {
            assert!(fault.to_string().contains(word), "{fault}");
        }
    }
}

#[test]
fn a_servo_in_laser_mode_is_refused() {
    let steps = [In(BANNER), In(IDLE), In("ok\nok\n"), In("$32=1\nok\n"), Fails(&["$32=0"])];
    talk(&mut grbl("G0"), 0, &steps);
    let mut z = Grbl::new(Job::new("G0", 79).unwrap(), Options { servo: false, ..options() });
    talk(&mut z, 0, &[In(BANNER), In(IDLE), In("ok\nok\n$32=1\nok\nok\nok\nok\n"), Out("#\n$I\n$$\n$G\n$G\n$G\nG0\n")]);
}

#[test]
fn the_buffer_size_is_what_the_controller_says() {
    for (answer, limit) in [
        ("[OPT:V,15,128]\n", 127),
        ("[OPT:VNMGLS,35,1024,3,0]\n", 1023),
        ("[OPT:MPHS]\n", 127),
        ("[OPT:V,15,x]\n", 127),
        ("[OPT:V,15,0]\n", 127),
        ("error:3\n", 127),
    ] {
        let mut grbl = grbl("G0");
        talk(&mut grbl, 0, &[In(BANNER), In(IDLE), In("ok\n"), In(answer)]);
        assert_eq!(grbl.rx_limit(), limit, "{answer}");
    }
}

#[test]
fn a_buffer_too_small_for_a_line_is_refused() {
    let mut grbl = grbl(&format!("G0\nG1X{}", "1".repeat(70)));
    let steps = [
        In(BANNER),
        In(IDLE),
        In("ok\n[OPT:V,15,64]\nok\nok\nok\nok\nok\n"),
        Fails(&["line 2", "73", "62"]),
        Out("#\n$I\n$$\n$G\n$G\n$G\n"),
    ];
    talk(&mut grbl, 0, &steps);
}

#[test]
fn an_error_holds_resets_lifts_and_reports_the_line() {
    let (mut grbl, at) = started("G1X1\n\nG1X2\nG5Y1\nG1X4\n");
    talk(
        &mut grbl,
        at,
        &[
            Out("G1X1\nG1X2\nG5Y1\nG1X4\n"),
            In("ok\nok\nerror:20\n"),
            Out("!"),
            In("ok\n"),
            In("<Hold:1|MPos:0,0,0>\n"),
            Out(""),
            In("<Hold:0|MPos:0,0,0>\n"),
            Out("\x18"),
            In(BANNER),
            Wait(1),
            Out("M3S0\n"),
            In("ok\n"),
            Wait(1),
            Fails(&["line 4", "`G5Y1`", "error 20", "unsupported"]),
            Wait(20_000),
            Out(""),
        ],
    );
}

#[test]
fn an_alarm_names_the_line_that_was_not_answered() {
    let (mut grbl, at) = started("G1X1\nG1X2\n");
    talk(
        &mut grbl,
        at,
        &[
            In("ok\n"),
            Out("G1X1\nG1X2\n"),
            In("ALARM:1\n"),
            Fails(&["alarm 1", "line 2", "`G1X2`", "limit switch"]),
            Out("\x18"),
        ],
    );
}

#[test]
fn a_banner_in_the_job_is_a_restart() {
    let (mut grbl, at) = started("G1X1\nG1X2\n");
    talk(&mut grbl, at, &[In("ok\n"), In(BANNER), Fails(&["restarted", "line 2"])]);
}

#[test]
fn silence_and_lost_bytes() {
    let (mut grbl, at) = started("G1X1\nG1X2\n");
    talk(&mut grbl, at, &[In("ok\n"), Wait(10_100), Fails(&["silent", "line 2", "10 s"])]);

    // It goes on reporting motion: nothing is wrong, for an hour.
    let (mut grbl, mut at) = started("G1X1\nG1X2\n");
    for _ in 0..1800 {
        at = talk(&mut grbl, at, &[In(RUN), Wait(999), In("<Run|MPos:0.001,0.000,0.000>\r\n"), Wait(999)]);
    }
    assert_eq!(grbl.take_event(), None);
    // It reports to be idle, and answers no more.
    for _ in 0..6 {
        at = talk(&mut grbl, at, &[In(IDLE), Wait(999)]);
    }
    talk(&mut grbl, at, &[In("<Hold:0>\n"), In(BANNER), In("ok\n"), Wait(1), Fails(&["lost", "line 1"])]);
}

#[test]
fn a_long_dwell_is_not_taken_for_a_loss() {
    let (mut grbl, mut at) = started("G4P60\n");
    for _ in 0..60 {
        at = talk(&mut grbl, at, &[In(IDLE), Wait(999)]);
    }
    talk(&mut grbl, at, &[In("ok\n"), Wait(1), In("ok\n"), Says(Event::Done)]);
}

#[test]
fn the_status_is_asked_for_at_most_five_times_a_second() {
    let (mut grbl, mut at) = started("G1X1\n");
    grbl.take_output();
    for _ in 0..10 {
        at = talk(&mut grbl, at, &[In(RUN), Wait(999)]);
    }
    let asked = grbl.take_output().iter().filter(|byte| **byte == b'?').count();
    assert!((30..=50).contains(&asked), "{asked} times in 10 s");
}

#[test]
fn lines_that_write_the_eeprom_go_alone() {
    let (mut grbl, at) = started("G0X1\nG10L2P1X0\nG0X2\n$1=25\nG0X3\n");
    talk(
        &mut grbl,
        at,
        &[
            Out("G0X1\n"),
            In("ok\n"),
            Out("G10L2P1X0\n"),
            In("ok\n"),
            Out("G0X2\n"),
            In("ok\n"),
            // A `$` line is refused in motion: it waits for rest first.
            Out("G4P0.01\n"),
            In("ok\n"),
            Out("$1=25\n"),
            In("ok\n"),
            Out("G0X3\n"),
        ],
    );
}

#[test]
fn a_pause_waits_for_its_user() {
    let (mut grbl, at) = started("G0X1\nM0 (pen 2)\nG0X2\nM0T3\n");
    let at = talk(
        &mut grbl,
        at,
        &[
            Out("G0X1\n"),
            In("ok\n"),
            // At rest first; and the pause is the sender's, so that no byte of it can be lost.
            Out("G4P0.01\n"),
            Resume,
            In("ok\n"),
            Says(Event::Prompt("pen 2".into())),
            Out(""),
            // However long it takes.
            Wait(9_000),
        ],
    );
    grbl.receive(IDLE.as_bytes(), Duration::from_millis(at));
    grbl.take_output();
    talk(
        &mut grbl,
        at,
        &[
            Resume,
            Out("G0X2\n"),
            In("ok\n"),
            Out("G4P0.01\n"),
            In("ok\n"),
            Says(Event::Prompt(String::new())),
            Resume,
            Out("T3\n"),
            In("ok\n"),
            Out("G4P0.01\n"),
            In("ok\n"),
            Says(Event::Done),
        ],
    );
}

#[test]
fn a_hold_that_nobody_asked_for_is_told_once() {
    let (mut grbl, at) = started("G0X1\n");
    let told = |state: &str| Event::Message(format!("{state}; the job goes on when the plotter is resumed"));
    let steps =
        [In("<Hold:1>\n<Hold:0>\n"), Says(told("Hold")), In(RUN), In("<Door:0>\n<Door:0>\n"), Says(told("Door"))];
    talk(&mut grbl, at, &steps);
    assert_eq!(grbl.take_event(), None);
}

#[test]
fn an_alarm_whose_message_was_lost() {
    let (mut grbl, at) = started("G0X1\n");
    talk(&mut grbl, at, &[In("<Alarm|MPos:0,0,0>\n"), Fails(&["alarm", "line 1"]), Out("G0X1\n\x18")]);
}

#[test]
fn a_barrier_that_is_refused() {
    let (mut grbl, at) = started("G0X1\n");
    let steps =
        [In("ok\n"), Out("G0X1\nG4P0.01\n"), In("error:9\n"), In("<Hold:0>\n"), In(BANNER), In("ok\n"), Wait(1)];
    talk(&mut grbl, at, &steps);
    talk(&mut grbl, at + 10, &[Fails(&["line 1", "error 9", "locked"])]);
}

#[test]
fn cancelling_keeps_the_position() {
    let (mut grbl, at) = started("G1X1\nG1X2\n");
    talk(
        &mut grbl,
        at,
        &[
            In("ok\n"),
            Out("G1X1\nG1X2\n"),
            Cancel,
            Out("!"),
            Cancel,
            In("<Run>\n<Hold:1>\n"),
            Out(""),
            In("<Hold:0>\n"),
            Out("\x18"),
            In(BANNER),
            Wait(1),
            Out("M3S0\n"),
            In("ok\n"),
            Wait(1),
            Fails(&["stopped", "line 2"]),
        ],
    );
    // No hold in sight: the reset goes out all the same, and the end comes without a banner.
    let (mut grbl, at) = started("G1X1\n");
    talk(&mut grbl, at, &[Out("G1X1\n"), Cancel, Wait(5_100), Out("!\x18"), Wait(3_100), Fails(&["stopped"]), Out("")]);
}

#[test]
fn start_up_lines_and_messages_are_no_answers() {
    let (mut grbl, at) = started("G1X1\nG1X2\n");
    talk(&mut grbl, at, &[In(">G21:ok\n[MSG:Pgm End]\n[GC:G0]\n\r\n"), Says(Event::Message("Pgm End".into()))]);
    assert_eq!(grbl.progress().acknowledged, 0);
}

proptest! {
    /// Whatever the lines and the order of answers: never more than 127 bytes on the way, and every line in order, once.
    #[test]
    fn the_receive_buffer_never_overflows(
        lengths in prop::collection::vec(1usize..=79, 1..200),
        answers in prop::collection::vec(1usize..10, 1..50),
    ) {
        let gcode: Vec<String> = lengths.iter().map(|n| format!("G{}", "1".repeat(n - 1))).collect();
        let (mut grbl, at) = started(&gcode.join("\n"));
        let now = Duration::from_millis(at);
        let mut buffer: VecDeque<String> = VecDeque::new();
        let mut seen = Vec::new();
        for answers in answers.iter().cycle() {
            let out = String::from_utf8(grbl.take_output()).unwrap();
            buffer.extend(out.replace('?', "").lines().map(str::to_owned));
            let held: usize = buffer.iter().map(|line| line.len() + 1).sum();
            prop_assert!(held <= 127);
            if buffer.is_empty() { break; }
            for _ in 0..*answers {
                if let Some(line) = buffer.pop_front() {
                    seen.push(line);
                    grbl.receive(b"ok\r\n", now);
                }
            }
        }
        prop_assert_eq!(seen.pop(), Some(BARRIER.to_owned()));
        prop_assert_eq!(seen, gcode);
        prop_assert_eq!(grbl.take_event(), Some(Event::Done));
    }

    /// Noise on the line ends in no panic and in no overflow.
    #[test]
    fn noise_does_no_harm(noise in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..40), 0..40)) {
        let (mut grbl, mut at) = started("G1X1\nG1X2\n$X\nM0\nG1X3\n");
        for bytes in noise {
            at += 300;
            grbl.receive(&bytes, Duration::from_millis(at));
            prop_assert!(grbl.used <= grbl.rx_limit());
        }
    }
}

#[test]
fn a_hold_rests_and_goes_on() {
    let (mut grbl, at) = started("G1X1\n");
    let at = talk(
        &mut grbl,
        at,
        &[
            Out("G1X1\n"),
            In("ok\r\n"),
            Out("G4P0.01\n"),
            Wants(Control::Hold),
            Wants(Control::Hold),
            Out("!"),
            In("<Hold:1|MPos:0.000,0.000,0.000>\r\n<Hold:0|MPos:0.000,0.000,0.000>\r\n"),
            Says(Event::Paused),
            // However long the user takes, nothing is lost.
            Wait(500),
        ],
    );
    assert_eq!(grbl.take_event(), None);
    grbl.take_output();
    talk(
        &mut grbl,
        at,
        &[Wants(Control::Resume), Out("~"), In(RUN), Says(Event::Resumed), In("ok\r\n"), Says(Event::Done)],
    );
}

#[test]
fn the_speed_is_set_from_that_of_the_job() {
    for (percent, bytes) in [
        (100, &b"\x90"[..]),
        (120, b"\x90\x91\x91"),
        (87, b"\x90\x92\x94\x94\x94"),
        (5, b"\x90\x92\x92\x92\x92\x92\x92\x92\x92\x92"),
        (1000, b"\x90\x91\x91\x91\x91\x91\x91\x91\x91\x91\x91"),
    ] {
        let (mut grbl, _) = started("G1X1\n");
        grbl.take_output();
        grbl.control(Control::Speed(percent), Duration::ZERO);
        assert_eq!(grbl.take_output(), bytes, "{percent}");
    }
}
