//! Conversations as tables: what the controller says and when, and what must go out.

use proptest::prelude::*;

use super::*;
use crate::device::find;
use crate::protocol::dialogue;
use Step::{Fails, In, Out, Says, Wait, Wants};

/// A step of a conversation.
enum Step {
    /// The controller sends this; time goes on by a millisecond.
    In(&'static str),
    /// Time passes, in ms.
    Wait(u64),
    /// All that has gone out since the last `Out` is this, each line with its number (less the first) and checksum.
    Out(&'static [(u32, &'static str)]),
    /// The next event is this.
    Says(Event),
    /// The next event is a failure whose message holds all of these.
    Fails(&'static [&'static str]),
    /// The user wants this.
    Wants(Control),
}

fn options() -> Options {
    Options {
        rx_bytes: 128,
        buffer_lines: 4,
        machine: Machine::of(&find("marlin-servo").unwrap()).unwrap(),
        lift: vec!["M280P0S90".into()],
        baud: 115_200,
    }
}

fn marlin(gcode: &str) -> Marlin {
    Marlin::new(Job::new(gcode, 80).unwrap(), options())
}

/// Goes through the steps from a time (ms) on; the time at their end.
fn talk(marlin: &mut Marlin, from: u64, steps: &[Step]) -> u64 {
    let mut at = from;
    for (i, step) in steps.iter().enumerate() {
        let now = Duration::from_millis(at);
        match step {
            In(text) => {
                dialogue::say(marlin, text, now);
                at += 1;
            }
            Wait(ms) => at = dialogue::wait(marlin, at, *ms),
            Out(expected) => {
                let expected: String = expected.iter().map(|(number, text)| numbered(FIRST + number, text)).collect();
                assert_eq!(String::from_utf8(marlin.take_output()).unwrap(), expected, "step {i}");
            }
            Says(event) => assert_eq!(marlin.take_event().as_ref(), Some(event), "step {i}"),
            Fails(words) => dialogue::assert_fails(marlin, words, i),
            Wants(control) => marlin.control(*control, now),
        }
    }
    at
}

/// The conversation up to the first lines of the job.
fn started(gcode: &str) -> (Marlin, u64) {
    let mut marlin = marlin(gcode);
    let steps = [
        Wait(1_000),
        In("start\nMarlin 2.1.2\n"),
        Out(&[]),
        Wait(1_500),
        Out(&[(0, "M110N1000")]),
        In("ok\n"),
        Wait(1),
    ];
    let at = talk(&mut marlin, 0, &steps);
    (marlin, at)
}

const LINES: &str = "G90\nG0X1Y1\nG0X2\nG0X3\nG0X4\nG0X5\n";
const END: &str = "X:5.00 Y:1.00 Z:0.00 E:0.00 Count X:400 Y:80 Z:0\nok\n";

#[test]
fn a_job_from_banner_to_the_end() {
    let (mut marlin, at) = started(LINES);
    let at = talk(
        &mut marlin,
        at,
        &[
            // Four lines are what it holds.
            Out(&[(1, "G90"), (2, "G0X1Y1"), (3, "G0X2"), (4, "G0X3")]),
            In("ok\nok\n"),
            Out(&[(5, "G0X4"), (6, "G0X5")]),
            In("ok\nok\nok\n"),
            Out(&[(7, "M400"), (8, "M114")]),
        ],
    );
    assert_eq!(marlin.progress(), Progress { acknowledged: 5, executed: 0, total: 6 });
    talk(&mut marlin, at, &[In("ok\nok\n"), In(END), Says(Event::Done), Wait(40_000), Out(&[])]);
    assert_eq!(marlin.progress(), Progress { acknowledged: 6, executed: 6, total: 6 });
}

#[test]
fn nobody_there() {
    let mut marlin = marlin("G0");
    talk(&mut marlin, 0, &[Wait(13_000), Fails(&["no answer", "115200"])]);
}

#[test]
fn what_somebody_left_half_written_is_asked_for_again() {
    let mut marlin = marlin("G90");
    talk(
        &mut marlin,
        0,
        &[
            Wait(2_000),
            Out(&[(0, "M110N1000")]),
            In("Error:checksum mismatch, Last Line: 17\nResend: 18\nok\n"),
            Out(&[(0, "M110N1000")]),
            In("ok\n"),
            Wait(1),
            Out(&[(1, "G90"), (2, "M400"), (3, "M114")]),
        ],
    );
}

#[test]
fn a_line_that_was_mangled_is_sent_again_once() {
    let (mut marlin, at) = started(LINES);
    talk(
        &mut marlin,
        at,
        &[
            Out(&[(1, "G90"), (2, "G0X1Y1"), (3, "G0X2"), (4, "G0X3")]),
            In("ok\n"),
            Out(&[(5, "G0X4")]),
            // The lines behind it ask for the same.
            In("Error:checksum mismatch, Last Line: 1001\nResend: 1002\nok\n"),
            In("Error:Line Number is not Last Line Number+1, Last Line: 1001\nResend: 1002\nok\n"),
            Out(&[]),
            Wait(110),
            // One by itself, then the others.
            Out(&[(2, "G0X1Y1")]),
            In("ok\n"),
            Out(&[(3, "G0X2"), (4, "G0X3"), (5, "G0X4"), (6, "G0X5")]),
        ],
    );
}

#[test]
fn a_missing_answer_is_recovered() {
    let (mut marlin, at) = started(LINES);
    talk(
        &mut marlin,
        at,
        &[
            Out(&[(1, "G90"), (2, "G0X1Y1"), (3, "G0X2"), (4, "G0X3")]),
            // It is busy, and so alive.
            Wait(4_000),
            In("echo:busy: processing\n"),
            Wait(4_000),
            Out(&[]),
            Wait(1_010),
            Out(&[(1, "G90")]),
            // It has all of them.
            In("Error:Line Number is not Last Line Number+1, Last Line: 1004\nResend: 1005\nok\n"),
            Wait(1),
            Out(&[(5, "G0X4"), (6, "G0X5"), (7, "M400"), (8, "M114")]),
        ],
    );
}

#[test]
fn numbered_answers_are_taken_at_their_word() {
    let (mut marlin, at) = started(LINES);
    talk(
        &mut marlin,
        at,
        &[
            Out(&[(1, "G90"), (2, "G0X1Y1"), (3, "G0X2"), (4, "G0X3")]),
            // The one before it was lost; and one comes again.
            In("ok N1002 P15 B3\nok N1002 P15 B3\nok N9 P15 B3\n"),
            Out(&[(5, "G0X4"), (6, "G0X5")]),
        ],
    );
}

#[test]
fn it_is_given_up_in_the_end() {
    let (mut marlin, at) = started(LINES);
    talk(&mut marlin, at, &[Wait(40_000), Fails(&["fallen silent", "line 1"])]);

    let (mut marlin, mut at) = started(LINES);
    for _ in 0..8 {
        at = talk(&mut marlin, at, &[In("Resend: 1001\n"), Wait(300)]);
    }
    talk(&mut marlin, at, &[Wait(3_000), Fails(&["lost", "line 1"])]);
}

#[test]
fn what_it_says_of_itself_ends_the_job() {
    for (text, words) in
        [("start\n", &["restarted", "line 1"][..]), ("Error:Printer halted. kill() called!\n", &["halt", "line 1"][..])]
    {
        let (mut marlin, at) = started(LINES);
        talk(&mut marlin, at, &[In(text), Fails(words)]);
    }
    for (text, words) in [
        ("Error:Motor driver\n", &["Motor driver", "line 1"][..]),
        ("ok\necho:Unknown command: \"G0X1Y1\"\n", &["does not know", "line 2 (`G0X1Y1`)"][..]),
    ] {
        let (mut marlin, at) = started(LINES);
        talk(&mut marlin, at, &[In(text), Wait(3_100), Fails(words)]);
        assert!(marlin.take_output().ends_with(b"M410\nM280P0S90\n"));
    }
    // A line that was mangled on the way is none of ours.
    let (mut marlin, at) = started(LINES);
    talk(&mut marlin, at, &[In("echo:Unknown command: \"1001G90*7\"\n"), Wait(100)]);
    assert_eq!(marlin.take_event(), None);
}

#[test]
fn a_wrong_place_stops() {
    let (mut marlin, at) = started("G90\nG0X1Y1\n");
    let wrong = "X:1.00 Y:1.20 Z:0.00 E:0.00 Count X:80 Y:80 Z:0\nok\n";
    talk(
        &mut marlin,
        at,
        &[
            In("ok\nok\nok\n"),
            In(wrong),
            In(wrong),
            Out(&[(1, "G90"), (2, "G0X1Y1"), (3, "M400"), (4, "M114"), (5, "M114"), (6, "M114")]),
            In(wrong),
            Wait(3_100),
            Fails(&["Y by 0.20 mm", "lines 1 to 2"]),
        ],
    );
}

const STROKES: &str = "G90\nM280P0S90\nG4P200\nM0 (pen 2)\nG0X1Y1\nM280P0S30\nM280P0S90\nG0X5Y1\n";
const UNKNOWN: &str = "X:0.00 Y:0.00 Z:0.00 E:0.00 Count X:0 Y:0 Z:0\nok\n";
const DRAWN: &str = "X:1.00 Y:1.00 Z:0.00 E:0.00 Count X:80 Y:80 Z:0\nok\n";

#[test]
fn pauses_levels_and_speeds() {
    let (mut marlin, at) = started(STROKES);
    let at = talk(
        &mut marlin,
        at,
        &[
            Out(&[(1, "G90"), (2, "M280P0S90"), (3, "G4P200"), (4, "M400")]),
            In("ok\nok\nok\nok\n"),
            Out(&[(5, "M114")]),
            In(UNKNOWN),
            // At rest since the check: the pause is the sender's own.
            Says(Event::Prompt("pen 2".into())),
            Wait(20_000),
            Out(&[]),
            Wants(Control::PenHeight { down: true, steps: 5 }),
            Says(Event::Note("the pen-down level is S35 from now on".into())),
            Wants(Control::Speed(150)),
            Wants(Control::Resume),
            Wants(Control::Pause),
            Out(&[(6, "M220S150"), (7, "G0X1Y1"), (8, "M280P0S35"), (9, "M280P0S90")]),
            In("ok\nok\nok\nok\n"),
            Out(&[(10, "M400"), (11, "M114")]),
            In("ok\n"),
            In(DRAWN),
            Says(Event::Paused),
            Wait(20_000),
            Out(&[]),
            Wants(Control::Resume),
            Says(Event::Resumed),
            Out(&[(12, "G0X5Y1"), (13, "M400"), (14, "M114")]),
        ],
    );
    assert_eq!(marlin.progress().executed, 7);
    talk(&mut marlin, at, &[In("ok\nok\n"), In(END), Says(Event::Done)]);
}

#[test]
fn a_hold_rests_when_all_is_drawn_that_it_has() {
    let (mut marlin, at) = started(LINES);
    talk(
        &mut marlin,
        at,
        &[
            Out(&[(1, "G90"), (2, "G0X1Y1"), (3, "G0X2"), (4, "G0X3")]),
            Wants(Control::Hold),
            In("ok\nok\nok\nok\n"),
            Out(&[(5, "M400")]),
            In("ok\n"),
            Says(Event::Paused),
            Wants(Control::Resume),
            Says(Event::Resumed),
            Out(&[(6, "G0X4"), (7, "G0X5"), (8, "M400"), (9, "M114")]),
            Wants(Control::Stop),
            Wait(3_100),
            Fails(&["stopped", "line 5"]),
        ],
    );
}

/// A controller as small as it can be: it takes numbered lines in order, and asks for others.
struct Peer {
    last: u32,
    input: Vec<u8>,
    taken: Vec<String>,
}

impl Peer {
    fn receive(&mut self, byte: u8) -> String {
        if byte != b'\n' {
            self.input.push(byte);
            return String::new();
        }
        let line = String::from_utf8_lossy(&std::mem::take(&mut self.input)).into_owned();
        let good = line.strip_prefix('N').and_then(|rest| rest.split_once('*')).and_then(|(body, sum)| {
            let checksum = line.bytes().take_while(|byte| *byte != b'*').fold(0, |sum, byte| sum ^ byte);
            let digits = body.find(|c: char| !c.is_ascii_digit())?;
            let number: u32 = body[..digits].parse().ok()?;
            (sum.parse() == Ok(checksum)).then(|| (number, body[digits..].to_owned()))
        });
        match good {
            None if line.is_empty() => String::new(),
            Some((number, text)) if text.starts_with("M110") => {
                self.last = number;
                "ok\n".to_owned()
            }
            Some((number, text)) if number == self.last + 1 => {
                self.last = number;
                let place = if text == "M114" { "X:5.00 Y:1.00 Z:0.00 E:0.00 Count X:0\n" } else { "" };
                self.taken.push(text);
                format!("{place}ok\n")
            }
            _ => format!("Error:checksum mismatch, Last Line: {0}\nResend: {1}\nok\n", self.last, self.last + 1),
        }
    }
}

proptest! {
    /// Bytes are lost, doubled and changed in both directions, one in some: every line is taken once and in order, or the job
    /// fails within a bounded time.
    #[test]
    fn every_line_is_taken_once_and_in_order(
        count in 1usize..60,
        every in 150u64..2000,
        kinds in prop::collection::vec(0u8..3, 1..8),
        seed: u64,
    ) {
        let mut gcode = String::from("G90\n");
        for k in 0..count {
            gcode.push_str(&format!("G0X{}Y{k}\n", k % 7));
        }
        gcode.push_str("G0X5Y1\n");
        let mut marlin = marlin(&gcode);
        let mut peer = Peer { last: 0, input: Vec::new(), taken: Vec::new() };
        let (mut bytes, mut random, mut faults) = (0u64, seed | 1, kinds.iter().cycle());
        let mut noisy = |byte: u8| -> Vec<u8> {
            bytes += 1;
            if bytes % every != 0 {
                return vec![byte];
            }
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            match faults.next() {
                Some(0) => vec![],
                Some(1) => vec![byte, byte],
                _ => vec![byte ^ (1 << (random >> 61))],
            }
        };
        let mut ended = None;
        for ms in (0..400_000).step_by(10) {
            let now = Duration::from_millis(ms);
            marlin.tick(now);
            let mut answers = Vec::new();
            for byte in marlin.take_output() {
                for byte in noisy(byte) {
                    answers.extend(peer.receive(byte).into_bytes());
                }
            }
            let answers: Vec<u8> = answers.into_iter().flat_map(&mut noisy).collect();
            marlin.receive(&answers, now);
            if let Some(event) = marlin.take_event() {
                ended = Some(event);
                break;
            }
        }
        let lines: Vec<String> = gcode.lines().map(str::to_owned).collect();
        let drawn: Vec<String> = peer.taken.into_iter().filter(|text| text.starts_with('G')).collect();
        match ended {
            Some(Event::Done) => prop_assert_eq!(drawn, lines),
            Some(Event::Failed(_)) => prop_assert!(lines.starts_with(&drawn)),
            other => prop_assert!(false, "{:?}", other),
        }
    }

    /// Noise on the line ends in no panic.
    #[test]
    fn noise_does_no_harm(noise in prop::collection::vec("(ok|Resend: |N|100[0-9]|[0-9]| |\n|Error:|X:1 Y:2 Z:3 Count|start|.){0,20}", 0..40)) {
        let (mut marlin, mut at) = started(LINES);
        for text in noise {
            at += 300;
            marlin.receive(text.as_bytes(), Duration::from_millis(at));
            prop_assert!(marlin.oldest <= marlin.upcoming && marlin.upcoming <= marlin.end());
        }
    }
}
