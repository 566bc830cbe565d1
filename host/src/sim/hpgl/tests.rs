//! Dialogues with the simulated plotter, as the real one has them.

use std::io::{ErrorKind, Read, Write};
use std::time::Duration;

use serialport::{FlowControl, SerialPort};

use super::*;
use crate::device::{Language as Spoken, find};
use crate::sim::SimPort;
use crate::sim::tests::hear_all;
use crate::stream::Clock;

fn peer(options: &[(&str, &str)]) -> Hpgl {
    let device = find("hp7475a").unwrap();
    let Spoken::Hpgl(language) = &device.language else { panic!("not hpgl") };
    Hpgl::new(language, &device.papers, options).unwrap()
}

fn port(options: &[(&str, &str)]) -> SimPort {
    let mut port = SimPort::with(Box::new(peer(options)), 9600);
    port.set_timeout(Duration::from_secs(30)).unwrap();
    assert_eq!(read_all(&mut port), "");
    port
}

/// All that comes until nothing has come for a while.
fn read_all(port: &mut SimPort) -> String {
    hear_all(port).replace('\r', "|")
}

fn say(port: &mut SimPort, text: &str) -> String {
    port.write_all(text.as_bytes()).unwrap();
    read_all(port)
}

fn ink_mm(port: &SimPort) -> f64 {
    port.recording().ink_mm()
}

#[test]
fn questions_are_answered() {
    let mut port = port(&[]);
    for (text, answer) in [
        ("\x1b.B", "1024|"),
        ("\x1b.L", "1024|"),
        ("\x1b.O", "8|"),
        ("\x1b.E", "0|"),
        ("OI;", "7475A|"),
        ("OS;OS;", "24|16|"),
        ("OA;", "0,0,0|"),
        ("OH;", "0,0,16158,11040|"),
        ("OF;", "40,40|"),
        ("OE;", "0|"),
        ("XX;OE;OE;", "1|0|"),
        ("PE1;OE;", "1|"),
        ("PA1;OE;", "2|"),
        ("SP9;OE;", "3|"),
        ("IP1,2;OE;", "2|"),
        ("PA99999,0;OE;", "3|"),
        ("PR32000,0,32000,0;OE;", "6|"),
        ("PA400,300;OA;", "400,300,0|"),
        ("PDOC;PU", "400,300,1|"),
        ("\x1b.X\x1b.E\x1b.E", "11|0|"),
        ("\x1b.@a\x1b.E", "12|"),
        ("\x1b.M;;;10:\x1b.B", "1024\n"),
        ("\x1b.R\x1b.B", "1024|"),
        ("\x1b.)\x1b.(", ""),
    ] {
        assert_eq!(say(&mut port, text), answer, "{text:?}");
    }
}

#[test]
fn vectors_become_ink() {
    let mut port = port(&[]);
    let unit = 0.02488;
    say(&mut port, "IN;SP2;PU1000,1000;PD2000,1000,2000,2000;PU;PR-1000,0;PD0,-1000;PU;SP0;");
    let recording = port.recording();
    assert!((recording.ink_mm() - 3000.0 * unit).abs() < 1e-9, "{} mm", recording.ink_mm());
    assert_eq!((recording.lifts(), recording.position[..2].to_vec()), (2, vec![1000, 1000]));
    assert!(recording.traces.iter().filter(|trace| trace.pen_down).all(|trace| trace.pen == 2));
    // Without a pen there is no ink.
    say(&mut port, "PD0,0;PU;");
    assert!((ink_mm(&port) - 3000.0 * unit).abs() < 1e-9);
}

#[test]
fn what_is_outside_is_not_drawn() {
    let mut port = port(&[("paper", "a4")]);
    let unit = 0.02488;
    say(&mut port, "IN;SP1;PU10040,1000;PD13040,1000,13040,2000,10040,2000;PU;");
    assert!((ink_mm(&port) - 2000.0 * unit).abs() < 1e-6, "{}", ink_mm(&port));
    assert_eq!(say(&mut port, "OC;OA;"), "10040,2000,0|10040,2000,0|");
    say(&mut port, "IW0,0,500,500;PU0,0;PD1000,0;PU;");
    assert!((ink_mm(&port) - 2500.0 * unit).abs() < 1e-6);
}

#[test]
fn scaling_arcs_and_rectangles() {
    let mut port = port(&[]);
    let (unit, pi) = (0.02488, std::f64::consts::PI);
    say(&mut port, "IN;SP1;IP0,0,10000,10000;SC0,100,0,100;PU50,50;CI10;");
    assert!((ink_mm(&port) - 2000.0 * pi * unit).abs() < 0.1, "{}", ink_mm(&port));
    assert_eq!(say(&mut port, "OC;"), "50,50,0|");
    say(&mut port, "SC;PU5000,5000;PD;AR-1000,0,90;PU;EA3000,5000;");
    let expected = (2000.0 * pi + 500.0 * pi + 4000.0) * unit;
    assert!((ink_mm(&port) - expected).abs() < 0.2, "{} and {expected}", ink_mm(&port));
}

#[test]
fn the_buffer_empties_as_the_pen_goes_and_overflows_with_an_error() {
    let mut port = port(&[]);
    port.write_all(b"IN;SP1;VS1;PU0,0;PD").unwrap();
    for _ in 0..100 {
        port.write_all(b"1000,0,0,0,").unwrap();
    }
    port.write_all(b"\x1b.B\x1b.O").unwrap();
    port.set_timeout(Duration::from_millis(50)).unwrap();
    assert_eq!(read_all(&mut port), "0|0|");
    assert_eq!(say(&mut port, "\x1b.E"), "16|");
    assert!(port.recording().lost_bytes > 20);
    port.write_all(b"\x1b.K\x1b.B").unwrap();
    assert_eq!(read_all(&mut port), "1024|");
}

#[test]
fn a_list_may_be_longer_than_the_buffer() {
    let mut port = port(&[("buffer", "60")]);
    let mut text = String::from("IN;SP1;PD");
    for i in 0..100 {
        text.push_str(&format!("{},{},", i % 7 * 10, i % 5 * 10));
    }
    text.push_str("0,0;PU;");
    for byte in text.bytes() {
        while say(&mut port, "\x1b.B") == "0|" {}
        port.write_all(&[byte]).unwrap();
    }
    read_all(&mut port);
    assert_eq!(
        (port.recording().lost_bytes, port.recording().traces.iter().map(|t| t.points.len()).max()),
        (0, Some(101))
    );
}

/// Sends much more than the buffer holds, slowly drawn, in small pieces.
fn flood(port: &mut SimPort, mut wait: impl FnMut(&mut SimPort)) {
    port.write_all(b"IN;SP1;VS10;PU0,0;").unwrap();
    for i in 0..300 {
        wait(port);
        let text = format!("PD{},500,{},0;", i % 100 * 10, i % 100 * 10 + 5);
        let mut rest = text.as_bytes();
        for _ in 0..10_000 {
            match port.write(rest) {
                Ok(count) => rest = &rest[count..],
                Err(e) => assert_eq!(e.kind(), ErrorKind::TimedOut),
            }
            if rest.is_empty() {
                break;
            }
        }
    }
    let recording = {
        port.set_timeout(Duration::from_secs(100)).unwrap();
        read_all(port);
        port.recording()
    };
    assert_eq!(recording.lost_bytes, 0);
    assert_eq!(recording.position[..2], [995, 0]);
}

#[test]
fn xon_and_xoff_hold_up_the_port() {
    let mut port = port(&[]);
    port.set_flow_control(FlowControl::Software).unwrap();
    port.write_all(b"\x1b.I80;0;17:\x1b.N;19:").unwrap();
    flood(&mut port, |_| {});
}

#[test]
fn the_ready_line_holds_up_the_port() {
    let mut port = port(&[]);
    port.set_flow_control(FlowControl::Hardware).unwrap();
    port.write_all(b"\x1b.@;1:").unwrap();
    assert!(port.read_clear_to_send().unwrap());
    flood(&mut port, |_| {});
}

#[test]
fn an_enquiry_is_answered_when_there_is_room() {
    let mut port = port(&[]);
    port.write_all(b"\x1b.H128;5;6:").unwrap();
    flood(&mut port, |port| {
        port.write_all(&[5]).unwrap();
        port.set_timeout(Duration::from_secs(60)).unwrap();
        let mut answer = [0];
        assert_eq!((port.read(&mut answer).unwrap(), answer), (1, [6]));
    });
}

#[test]
fn troubles() {
    let drawing = || {
        let mut port = port(&[]);
        port.write_all(b"IN;SP1;PU0,0;PD10000,0;PU;").unwrap();
        port
    };
    let with = |kind: &str| {
        let mut port = drawing();
        let fault = kind.parse().unwrap();
        port.set_faults(crate::sim::Faults::new(&[fault], 3, crate::sim::Traffic::default()));
        port
    };
    let mut port = with("error@1");
    assert_eq!(say(&mut port, " PA0,0;OE;"), "1|");
    let mut port = with("alarm@1");
    port.write_all(b"PD10000,1000;PU;PA0,0;PD0,1000;").unwrap();
    read_all(&mut port);
    assert_eq!(say(&mut port, "\x1b.O"), "32|");
    let mut port = with("reset@1");
    port.write_all(b"PD10000,1000;PU;PA0,0;PD0,1000;").unwrap();
    read_all(&mut port);
    assert_eq!(say(&mut port, "\x1b.OOS;"), "8|24|");
    let mut port = with("pen-change@1");
    let start = port.clock().now();
    assert_eq!(say(&mut port, "PA0,0;\x1b.O"), "16|");
    port.set_timeout(Duration::from_secs(200)).unwrap();
    port.write_all(b"OA;").unwrap();
    let mut answer = [0; 16];
    assert!(port.read(&mut answer).unwrap() > 0 && (port.clock().now() - start) > Duration::from_secs(1));
}
