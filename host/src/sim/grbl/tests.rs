//! Dialogues with the simulated GRBL, as the real one has them.

use std::io::Write;
use std::time::Duration;

use serialport::SerialPort;

use super::*;
use crate::device::find;
use crate::sim::SimPort;
use crate::sim::tests::hear_all;
use crate::stream::Clock;

const SERVO: Pen = Pen::Servo { index: 0, up: 0, down: 1000, raise_s: 0.1, lower_s: 0.1, soft_steps: 1 };

fn port(options: &[(&str, &str)]) -> SimPort {
    let mut port = SimPort::with(Box::new(Grbl::new(Dialect::Grbl, &SERVO, options).unwrap()), 115_200);
    port.set_timeout(Duration::from_secs(2)).unwrap();
    port
}

fn booted(options: &[(&str, &str)]) -> SimPort {
    let mut port = port(options);
    assert_eq!(hear_all(&mut port), "\r\nGrbl 1.1h ['$' for help]\r\n");
    port
}

fn say(port: &mut SimPort, text: &str) -> String {
    port.write_all(text.as_bytes()).unwrap();
    hear_all(port).replace("\r\n", "|")
}

/// Lets some time pass, and leaves what comes in it unread.
fn wait(port: &mut SimPort, ms: u64) {
    let until = port.clock().now() + Duration::from_millis(ms);
    while port.clock().now() < until {
        // A byte takes less than 0.1 ms; those of real-time characters that mean nothing do no harm.
        port.write_all(&[0xff]).unwrap();
    }
}

#[test]
fn lines_are_answered_as_grbl_answers_them() {
    let mut port = booted(&[]);
    for (text, answer) in [
        ("\n", "ok|"),
        ("\r\n", "ok|ok|"),
        ("(a comment!\n", "<hold>"),
        ("(comment)\n", "ok|"),
        ("; comment\n", "ok|"),
        ("/g21 (x) g90\n", "ok|"),
        ("$I\n", "[VER:1.1h.20190830:]|[OPT:V,15,128]|ok|"),
        ("$G\n", "[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]|ok|"),
        ("G1X1\n", "error:22|"),
        ("X\n", "error:2|"),
        ("G\n", "error:2|"),
        ("#\n", "error:1|"),
        ("G1X12#\n", "error:1|"),
        ("G5Y3\n", "error:20|"),
        ("M6\n", "error:20|"),
        ("A1\n", "error:20|"),
        ("G1.5\n", "error:23|"),
        ("G0G1X1\n", "error:21|"),
        ("G90G91\n", "error:21|"),
        ("G10G92X1\n", "error:24|"),
        ("G0X1X2\n", "error:25|"),
        ("F-1\n", "error:4|"),
        ("G92\n", "error:26|"),
        ("G10L2X1\n", "error:28|"),
        ("G10L2P9X1\n", "error:29|"),
        ("G4\n", "error:28|"),
        ("G53G2X1I1F100\n", "error:30|"),
        ("G80X1\n", "error:31|"),
        ("G2F100Z1I1\n", "error:32|"),
        ("G2F100X1\n", "error:35|"),
        ("G0X1I3\n", "error:36|"),
        ("N99999999\n", "error:27|"),
        ("$7=1\n", "error:3|"),
        ("$100=0\n", "error:4|"),
        ("$H\n", "error:5|"),
        ("$0=1\n", "error:6|"),
        ("$20=1\n", "error:10|"),
        ("$J=X1\n", "error:22|"),
        ("$J=G1X1F100\n", "error:16|"),
        ("G1X1234567890123456789012345678901234567890123456789012345678901234567890123456789\n", "error:11|"),
        ("$N0=G91\n", "ok|"),
        ("$N\n", "$N0=G91|$N1=|ok|"),
        ("\u{18}", "|Grbl 1.1h ['$' for help]|>G91:ok|"),
        ("$G\n", "[GC:G0 G54 G17 G21 G91 G94 M5 M9 T0 F0 S0]|ok|"),
        ("$N0=\n", "ok|"),
        ("$C\n", "[MSG:Enabled]|ok|"),
        ("G0X5\nM0\n", "ok|ok|"),
        ("?", "<Check|MPos:0.000,0.000,0.000|FS:0,0|WCO:0.000,0.000,0.000>|"),
        ("$C\n", "[MSG:Disabled]||Grbl 1.1h ['$' for help]|ok|"),
    ] {
        if answer == "<hold>" {
            // Real-time characters act inside comments too.
            assert_eq!(say(&mut port, text), "", "{text:?}");
            assert!(say(&mut port, "?").starts_with("<Hold:0|"));
            assert_eq!(say(&mut port, "~"), "ok|");
            continue;
        }
        assert_eq!(say(&mut port, text), answer, "{text:?}");
    }
    assert_eq!(port.recording().steps, [0; 3]);
}

#[test]
fn a_status_tells_what_its_mask_asks_for() {
    let mut port = booted(&[("$10", "3")]);
    assert_eq!(say(&mut port, "?"), "<Idle|MPos:0.000,0.000,0.000|Bf:15,128|FS:0,0|WCO:0.000,0.000,0.000>|");
    assert_eq!(say(&mut port, "?"), "<Idle|MPos:0.000,0.000,0.000|Bf:15,128|FS:0,0|Ov:100,100,100>|");
    assert_eq!(say(&mut port, "?"), "<Idle|MPos:0.000,0.000,0.000|Bf:15,128|FS:0,0>|");
    assert_eq!(say(&mut port, "G92X-3\nM3S500\n$10=0\n"), "ok|ok|ok|");
    assert!(say(&mut port, "?").starts_with("<Idle|WPos:-3.000,0.000,0.000|FS:0,500"));
    assert_eq!(say(&mut port, "G1X97F6000\n"), "ok|");
    port.write_all(b"G1X0F3000\n").unwrap();
    wait(&mut port, 500);
    port.write_all(b"?").unwrap();
    let answer = hear_all(&mut port);
    assert!(answer.contains("<Run|WPos:") && answer.contains("|FS:3000,500"), "{answer}");
}

#[test]
fn offsets_are_work_coordinates() {
    let mut port = booted(&[]);
    assert_eq!(say(&mut port, "G0X10Y5\nG10L20P1X0Y0\n"), "ok|ok|");
    assert_eq!(say(&mut port, "G92X1\n"), "ok|");
    let parameters = say(&mut port, "$#\n");
    assert!(
        parameters.contains("[G54:10.000,5.000,0.000]") && parameters.contains("[G92:-1.000,0.000,0.000]"),
        "{parameters}"
    );
    assert_eq!(say(&mut port, "G0X1Y0\nG53G0X2\nG28.1\n"), "ok|ok|ok|");
    assert_eq!(say(&mut port, "G0X9\nG28Y3\nG92.1\nG20G91G1X1F150\n"), "ok|".repeat(4));
    // From machine (2, 5): to X9 (work; 18), then by way of Y3 (work; 8) in Y only back to 5, and an inch to the right.
    assert_eq!(port.recording().position, [(18.0 + 25.4) as i64 * 80 + 32, 400, 0]);
    assert!(say(&mut port, "$G\n").contains("[GC:G1 G54 G17 G20 G91 G94 M5 M9 T0 F3810 S0]"));
    assert_eq!(say(&mut port, "$13=1\n"), "ok|");
    assert!(say(&mut port, "$G\n").contains(" F150.0 S0]"), "in the units of reports");
}

#[test]
fn bytes_that_the_ring_cannot_hold_are_lost_without_a_word() {
    let mut port = booted(&[]);
    let answers = {
        for i in 0..100 {
            port.write_all(format!("G1X{}F600\n", i % 10).as_bytes()).unwrap();
        }
        hear_all(&mut port)
    };
    assert!(port.recording().lost_bytes > 100);
    assert!(answers.matches("ok").count() < 100);
}

#[test]
fn writing_the_eeprom_makes_it_deaf() {
    let mut port = booted(&[]);
    assert_eq!(say(&mut port, "$100=80\nG0X5\n"), "ok|");
    assert_eq!(port.recording().lost_bytes, 5);
}

#[test]
fn a_servo_waits_for_the_motion_but_not_in_laser_mode() {
    for (laser, ink) in [("0", 10.0), ("1", 15.0)] {
        let mut port = booted(&[("32", laser)]);
        // The second change comes before the second move has ended.
        let answers = say(&mut port, "G21G90\nG1X5F600\nM3S1000\nG1X15\nG4P0\nG1X20\nM3S0\n");
        assert_eq!(answers, "ok|".repeat(7));
        let inked = port.recording().ink_mm();
        if laser == "0" {
            assert!((inked - 15.0).abs() < 1e-9, "{inked} mm");
        } else {
            assert!((inked - ink).abs() < 0.5, "{inked} mm");
        }
    }
}

#[test]
fn the_servo_goes_by_the_range_of_s() {
    let mut port = booted(&[("$30", "255")]);
    // All of 255 and more is the full level: with this range the pen for S0 and S1000 is the same as for S0 and S255.
    say(&mut port, "M3S200\nG1X10F600\nM3S100\nG1X20\n");
    assert!((port.recording().ink_mm() - 10.0).abs() < 1e-9);
}

#[test]
fn a_hold_keeps_the_position_and_a_reset_in_motion_loses_it() {
    let mut port = booted(&[]);
    port.write_all(b"G1X50F3000\n").unwrap();
    wait(&mut port, 300);
    port.write_all(b"!?").unwrap();
    wait(&mut port, 150);
    assert!(say(&mut port, "?").contains("<Hold:0|MPos:1"));
    assert_eq!(say(&mut port, "G4P0\n"), "");
    assert_eq!(say(&mut port, "~"), "ok|");
    assert_eq!(port.recording().position, [4000, 0, 0]);
    port.write_all(b"G1X0\n").unwrap();
    wait(&mut port, 300);
    port.write_all(&[0x18]).unwrap();
    let answer = hear_all(&mut port);
    assert!(answer.ends_with("ALARM:3\r\n\r\nGrbl 1.1h ['$' for help]\r\n[MSG:'$H'|'$X' to unlock]\r\n"), "{answer}");
    assert_eq!(say(&mut port, "G0X1\n"), "error:9|");
    assert_eq!(say(&mut port, "$X\n"), "[MSG:Caution: Unlocked]|ok|");
    // It runs back to what it takes for 50, a little off.
    assert_eq!(say(&mut port, "G0X50\n"), "ok|");
    let off = port.recording().position[0] - 4000;
    assert!((-400..0).contains(&off), "{off} steps");
}

#[test]
fn a_hold_and_a_reset_at_rest_keep_the_position() {
    let mut port = booted(&[]);
    port.write_all(b"G1X50F3000\n").unwrap();
    wait(&mut port, 300);
    port.write_all(b"!").unwrap();
    wait(&mut port, 300);
    hear_all(&mut port);
    assert_eq!(say(&mut port, "\u{18}"), "|Grbl 1.1h ['$' for help]|");
    assert_eq!(say(&mut port, "G0X50\n"), "ok|");
    assert_eq!(port.recording().position, [4000, 0, 0]);
}

#[test]
fn a_pause_of_the_program_waits_for_its_user() {
    let mut port = booted(&[]);
    assert_eq!(say(&mut port, "G1X1F600\nM0\nG1X2\n"), "ok|");
    assert!(say(&mut port, "?").starts_with("<Hold:0|"));
    assert_eq!(say(&mut port, "~"), "ok|ok|");
}

#[test]
fn the_speed_can_be_overridden() {
    let took = |overrides: &[u8]| {
        let mut port = booted(&[]);
        port.set_timeout(Duration::from_secs(100)).unwrap();
        port.write_all(overrides).unwrap();
        let start = port.clock().now();
        say(&mut port, "G1X100F1000\nG4P0\n");
        (port.clock().now() - start).as_secs_f64() - 100.0
    };
    assert!((took(&[]) - 6.05).abs() < 0.1);
    assert!((took(&[0x91; 10]) - 3.05).abs() < 0.1);
    assert!((took(&[0x92; 20]) - 60.05).abs() < 0.2);
    assert!((took(&[0x92, 0x92, 0x90]) - 6.05).abs() < 0.1);
}

#[test]
fn homing_finds_the_corner() {
    let mut port = port(&[("22", "1"), ("23", "3"), ("20", "1")]);
    assert!(hear_all(&mut port).ends_with("[MSG:'$H'|'$X' to unlock]\r\n"));
    assert_eq!(say(&mut port, "G0X1\n"), "error:9|");
    port.write_all(b"$H\n?").unwrap();
    port.set_timeout(Duration::from_secs(120)).unwrap();
    let answer = hear_all(&mut port).replace("\r\n", "|");
    assert_eq!(answer, "<Idle|MPos:-419.000,-296.000,-1.000|FS:0,0|WCO:0.000,0.000,0.000>|ok|");
    assert_eq!(say(&mut port, "G53G0X-400\nG0X1\n"), "ok|ALARM:2|[MSG:Reset to continue]|");
    assert_eq!(say(&mut port, "$X\n"), "");
    assert_eq!(say(&mut port, "\u{18}"), "|Grbl 1.1h ['$' for help]|[MSG:'$H'|'$X' to unlock]|");
}

#[test]
fn troubles() {
    let drawing = || {
        let mut grbl = Grbl::new(Dialect::Grbl, &SERVO, &[]).unwrap();
        let run = |grbl: &mut Grbl, text: &[u8], ms: u64| {
            for byte in text {
                grbl.receive(*byte);
            }
            let until = grbl.now() + ms * 1_000_000;
            loop {
                while grbl.work() {}
                let next = grbl.next_event().min(until);
                grbl.advance(next);
                if next == until && !grbl.work() {
                    break;
                }
            }
            String::from_utf8(std::iter::from_fn(|| grbl.transmit()).collect()).unwrap()
        };
        run(&mut grbl, b"", 1100);
        run(&mut grbl, b"G1X50F3000\n", 300);
        assert!(grbl.is_moving());
        (grbl, run)
    };
    let (mut grbl, run) = drawing();
    grbl.suffer(Trouble::Error);
    assert_eq!(run(&mut grbl, b"G1X60\nG1X70\n", 10), "error:20\r\nok\r\n");
    grbl.suffer(Trouble::Alarm);
    assert_eq!(run(&mut grbl, b"G1X60\n", 10), "ALARM:1\r\n[MSG:Reset to continue]\r\n");
    let (mut grbl, run) = drawing();
    grbl.suffer(Trouble::Reset);
    assert_eq!(run(&mut grbl, b"?", 1100), "\r\nGrbl 1.1h ['$' for help]\r\n");
    assert!(run(&mut grbl, b"?", 10).starts_with("<Idle|MPos:0.000,"));
    let (mut grbl, run) = drawing();
    grbl.suffer(Trouble::Hang);
    assert_eq!(run(&mut grbl, b"?\n", 10_000), "");
    let (mut grbl, run) = drawing();
    grbl.suffer(Trouble::PenChange { ns: 5_000_000_000 });
    assert!(run(&mut grbl, b"", 4000).is_empty() && run(&mut grbl, b"?", 10).starts_with("<Hold:0|"));
    assert_eq!(run(&mut grbl, b"G4P0\n", 10_000), "ok\r\n");
    assert_eq!(grbl.recording().position, [4000, 0, 0]);
}

#[test]
fn a_pen_on_the_z_axis_draws() {
    let pen = find("grbl-z").map(|device| match device.language {
        crate::device::Language::Grbl(gcode) => gcode.pen,
        _ => SERVO,
    });
    let mut port = SimPort::with(Box::new(Grbl::new(Dialect::Grbl, &pen.unwrap(), &[]).unwrap()), 115_200);
    port.set_timeout(Duration::from_secs(9)).unwrap();
    hear_all(&mut port);
    assert_eq!(say(&mut port, "G0Z3\nG0X5\nG1Z0F600\nG1Y8\nG0Z3\n"), "ok|".repeat(5));
    assert!((port.recording().ink_mm() - 8.0).abs() < 1e-9);
}

#[test]
fn its_descendants_differ() {
    let long = format!("G1X{}F600\n", "1".repeat(300));
    for (dialect, banner, table) in [
        (
            Dialect::GrblHal,
            "GrblHAL 1.1f",
            vec![
                ("\r\n", "ok|"),
                ("\n\n", "ok|ok|"),
                ("G5\nG0X1\nG0X2\n", "error:20|error:20|error:20|"),
                ("\nG0X3\n", "ok|ok|"),
                ("G5\n$X\nG0X2\n", "error:20|ok|ok|"),
                (long.as_str(), "error:11|"),
                ("$100=80\nG0X4\n", "ok|ok|"),
            ],
        ),
        (
            Dialect::FluidNc,
            "FluidNC",
            vec![
                ("\r\n", "ok|"),
                ("G5\nG0X1\n", "error:20|ok|"),
                ("$I\n", "[VER:3.7 FluidNC v3.7.8:]|[OPT:MPHS]|[MSG: Machine: plotter]|ok|"),
                // Cut off before its feed.
                (long.as_str(), "error:22|"),
            ],
        ),
    ] {
        let mut port = SimPort::with(Box::new(Grbl::new(dialect, &SERVO, &[]).unwrap()), 115_200);
        port.set_timeout(Duration::from_secs(2)).unwrap();
        assert!(hear_all(&mut port).contains(banner));
        for (text, answer) in table {
            assert_eq!(say(&mut port, text), answer, "{dialect:?} {text:?}");
        }
    }
}
