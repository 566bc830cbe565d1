//! Dialogues with the simulated Marlin, as the real one has them.

use std::io::{Read, Write};
use std::time::Duration;

use serialport::SerialPort;

use super::*;
use crate::sim::SimPort;
use crate::sim::tests::hear_all;

const SERVO: Pen = Pen::Servo { index: 0, up: 90, down: 30, raise_s: 0.1, lower_s: 0.1, soft_steps: 1 };

fn port(pen: &Pen, options: &[(&str, &str)]) -> SimPort {
    let mut port = SimPort::with(Box::new(Marlin::new(pen, options).unwrap()), 115_200);
    port.set_timeout(Duration::from_millis(1500)).unwrap();
    assert!(read_all(&mut port).starts_with("start|"));
    port
}

/// All that comes until nothing has come for a while.
fn read_all(port: &mut SimPort) -> String {
    hear_all(port).replace('\n', "|")
}

fn say(port: &mut SimPort, text: &str) -> String {
    port.write_all(text.as_bytes()).unwrap();
    read_all(port)
}

fn numbered(number: u32, text: &str) -> String {
    let line = format!("N{number} {text}");
    let sum = line.bytes().fold(0, |sum, byte| sum ^ byte);
    format!("{line}*{sum}\n")
}

#[test]
fn lines_are_answered_as_marlin_answers_them() {
    let mut port = port(&SERVO, &[]);
    for (text, answer) in [
        ("\n\r\n; comment\n", ""),
        ("G91 ; comment\nG90\n", "ok|ok|"),
        ("G21\n", "ok|"),
        ("G20\n", "echo:Unknown command: \"G20\"|ok|"),
        ("#\n", "echo:Unknown command: \"#\"|ok|"),
        ("M220 S50\nM220\n", "ok|FR:50%|ok|"),
        ("M280 P0\n", "echo: Servo 0: 90|ok|"),
        ("M280 P3 S1\n", "Error:Servo 3 out of range|ok|"),
        ("G2 X1\n", "Error:G2/G3 bad parameters|ok|"),
        ("M211\n", "Soft endstops: On  Min:  X0.00 Y0.00 Z0.00   Max:  X300.00 Y300.00 Z50.00|ok|"),
        ("G92 X3\nM114\nG92 X0\n", "ok|X:3.00 Y:0.00 Z:0.00 E:0.00 Count X:0 Y:0 Z:0|ok|ok|"),
    ] {
        assert_eq!(say(&mut port, text), answer, "{text:?}");
    }
    assert!(say(&mut port, "M115\n").starts_with("FIRMWARE_NAME:Marlin 2.1.2.5 "));
    assert!(say(&mut port, "M503\n").contains("M92 X80.00 Y80.00 Z400.00|"));
}

#[test]
fn numbers_and_checksums_are_checked() {
    let mut port = port(&SERVO, &[]);
    for (text, answer) in [
        (numbered(0, "M110 N0"), "ok|"),
        (numbered(1, "G91"), "ok|"),
        (numbered(1, "G91"), "Error:Line Number is not Last Line Number+1, Last Line: 1|Resend: 2|ok|"),
        (numbered(3, "G91"), "Error:Line Number is not Last Line Number+1, Last Line: 1|Resend: 2|ok|"),
        (numbered(2, "G90").replace('9', "8"), "Error:checksum mismatch, Last Line: 1|Resend: 2|ok|"),
        ("N2 G90\n".to_owned(), "Error:No Checksum with line number, Last Line: 1|Resend: 2|ok|"),
        (numbered(2, "G90"), "ok|"),
        (numbered(77, "M110 N10"), "ok|"),
        (
            numbered(11, "G90") + &numbered(13, "G90") + &numbered(12, "G90"),
            "ok|Error:Line Number is not Last Line Number+1, Last Line: 11|Resend: 12|ok|ok|",
        ),
    ] {
        assert_eq!(say(&mut port, &text), answer, "{text:?}");
    }
}

#[test]
fn options() {
    let mut with = port(&SERVO, &[("advanced-ok", "1"), ("resend-ok", "0"), ("inch", "1")]);
    assert_eq!(say(&mut with, &numbered(1, "G20")), "ok N1 P15 B4|");
    assert_eq!(say(&mut with, "G1 X1 F60\n"), "ok P14 B4|");
    assert_eq!(
        say(&mut with, &numbered(1, "G20")),
        "Error:Line Number is not Last Line Number+1, Last Line: 1|Resend: 2|"
    );
    say(&mut with, "M400\n");
    assert_eq!(with.recording().position, [2032, 0, 0]);
    for (key, value) in [("bufsize", "0"), ("advanced-ok", "yes"), ("speed", "1")] {
        assert!(Marlin::new(&SERVO, &[(key, value)]).is_err());
    }
}

#[test]
fn a_servo_turns_before_the_motion_has_ended_unless_it_is_waited_for() {
    for (wait, ink) in [("M400\n", 5.0), ("", 10.0)] {
        let mut port = port(&SERVO, &[]);
        port.set_timeout(Duration::from_secs(5)).unwrap();
        say(&mut port, &format!("G1 X5 F300\n{wait}M280 P0 S30\nG1 X10\nM400\nM280 P0 S90\n"));
        let inked = port.recording().ink_mm();
        assert!((inked - ink).abs() < 0.1, "{inked} mm");
    }
}

#[test]
fn it_says_that_it_is_busy() {
    let mut port = port(&SERVO, &[]);
    port.set_timeout(Duration::from_millis(2500)).unwrap();
    assert_eq!(say(&mut port, "G1 X9 F60\nM400\n"), format!("ok|{}ok|", "echo:busy: processing|".repeat(4)));
    assert_eq!(say(&mut port, "M0 S3\n"), "echo:busy: paused for user|ok|");
    port.write_all(b"M0\n").unwrap();
    for _ in 0..5 {
        let mut buffer = [0; 64];
        assert!(port.read(&mut buffer).unwrap() > 0);
    }
    assert!(say(&mut port, "M108\n").ends_with("ok|ok|"));
}

#[test]
fn bytes_that_the_ring_cannot_hold_are_lost() {
    let mut port = port(&SERVO, &[]);
    port.write_all(b"G4 S5\n").unwrap();
    for _ in 0..30 {
        port.write_all(b"G1 X1.000 Y2.000\n").unwrap();
    }
    assert!(port.recording().lost_bytes > 100);
}

#[test]
fn urgent_commands_do_not_wait() {
    let mut port = port(&SERVO, &[]);
    port.set_timeout(Duration::from_millis(100)).unwrap();
    assert_eq!(say(&mut port, "G1 X100 F600\nM400\n"), "ok|");
    assert_eq!(say(&mut port, "M410\n"), "ok|ok|");
    let at = port.recording().position[0];
    assert!((40..800).contains(&at), "{at}");
    assert_eq!(say(&mut port, "G1 X50\n"), "ok|");
    assert_eq!(say(&mut port, "M112\n"), "Error:Printer halted. kill() called!|");
    assert_eq!(say(&mut port, "G1 X0\nM114\n"), "");
}

#[test]
fn it_homes_and_then_stays_within_its_travel() {
    let mut port = port(&SERVO, &[]);
    say(&mut port, "G1 X5 Y5 F3000\nG28\nG1 X-5 Y400 F9000\nM400\n");
    read_all(&mut port);
    assert_eq!(port.recording().position, [0, 24_000, 0]);
}

#[test]
fn arcs_are_round() {
    let mut port = port(&SERVO, &[]);
    port.set_timeout(Duration::from_secs(20)).unwrap();
    say(&mut port, "G1 X20 Y10 F3000\nM400\nM280 P0 S30\nG3 X10 Y20 I-10 J0\nG2 X0 Y10 R-10\nM400\nM280 P0 S90\n");
    let recording = port.recording();
    // A quarter of a circle of 10 mm, and then three quarters of one.
    let expected = std::f64::consts::PI * 20.0;
    assert!((recording.ink_mm() - expected).abs() < 0.2, "{} mm", recording.ink_mm());
    assert_eq!(recording.position, [0, 800, 0]);
}

#[test]
fn troubles() {
    let drawing = || {
        let mut marlin = Marlin::new(&SERVO, &[]).unwrap();
        let run = |marlin: &mut Marlin, text: &[u8], ms: u64| {
            for byte in text {
                marlin.receive(*byte);
            }
            let until = marlin.now() + ms * 1_000_000;
            loop {
                while marlin.work() {}
                let next = marlin.next_event().min(until);
                marlin.advance(next);
                if next == until && !marlin.work() {
                    break;
                }
            }
            String::from_utf8(std::iter::from_fn(|| marlin.transmit()).collect()).unwrap()
        };
        run(&mut marlin, b"", 1100);
        run(&mut marlin, b"G1X50F1000\n", 300);
        assert!(marlin.is_moving());
        (marlin, run)
    };
    let (mut marlin, run) = drawing();
    marlin.suffer(Trouble::Error);
    assert_eq!(run(&mut marlin, b"G1X60\nG1X70\n", 10), "Error:Command failed\nok\nok\n");
    marlin.suffer(Trouble::PenChange { ns: 5_000_000_000 });
    assert_eq!(run(&mut marlin, b"G1X60\n", 4500), "echo:busy: paused for user\necho:busy: paused for user\n");
    assert_eq!(run(&mut marlin, b"", 1000), "ok\n");
    marlin.suffer(Trouble::Alarm);
    assert_eq!(run(&mut marlin, b"G1X60\n", 10), "Error:Printer halted. kill() called!\n");
    let (mut marlin, run) = drawing();
    marlin.suffer(Trouble::Reset);
    assert!(run(&mut marlin, b"M114\n", 1100).starts_with("start\n"));
    assert!(run(&mut marlin, b"M114\n", 10).starts_with("X:0.00"));
    let (mut marlin, run) = drawing();
    marlin.suffer(Trouble::Hang);
    assert_eq!(run(&mut marlin, b"M114\n", 10_000), "");
}
