//! Jobs that a plotter would not draw as they are, and what is said of them.

use std::time::Duration;

use super::*;
use crate::device::find;
use crate::protocol::Protocol;
use crate::sim::{SimName, SimPort};
use crate::stream;

fn findings(text: &str, device: &str) -> Vec<String> {
    job(text.as_bytes(), &find(device).unwrap()).iter().map(ToString::to_string).collect()
}

/// A stroke that is drawn, and this line.
fn with(line: &str) -> String {
    format!("G21\nG90\nM3S0\nG0X1Y1\nM3S1000\nG4P0.2\nG1X2F600\n{line}\nM3S0\nG4P0.2\n")
}

#[test]
fn good_jobs_have_nothing_wrong() {
    assert_eq!(findings(&with("G1Y2"), "grbl-servo"), Vec::<String>::new());
    assert_eq!(findings("IN;SP1;PU10,10;PD20,20;PU;SP0;", "hp7475a"), Vec::<String>::new());
}

#[test]
fn gcode_against_the_profile() {
    let table: &[(String, &str, &str)] = &[
        (with("G5 I1 J1 P1 Q1 X3"), "grbl-servo", "error: line 8 has G5, which grbl does not know; write curves"),
        (with("M6 T1"), "grbl-servo", "error: line 8 has M6, which grbl does not know; have the pen changed with M0"),
        (with("M6 T1"), "grblhal", "warning: line 8 has M6, which grblhal may not know"),
        (with("G92.3"), "grbl-servo", "error: line 8 has G92.3"),
        (with("M280 P0 S30"), "grbl-servo", "error: line 8 has M280"),
        (
            with("M8\nM7\nG5\nG5"),
            "grbl-servo",
            "error: line 10 has G5, which grbl does not know; write curves as lines or arcs (and 1 more lines like it)",
        ),
        (with("G38.2 Z-1 F10"), "grbl-servo", "warning: line 8 probes"),
        (with("G0 X500"), "grbl-servo", "error: it goes over x from 1.0 to 500.0"),
        (with("G0 X-5"), "grbl-servo", "warning: it goes over x from -5.0"),
        ("G21\nG0X1Y1\nG1X2F600\n".into(), "grbl-servo", "warning: nothing is drawn as far as the profile tells"),
        ("M3S0\nG21\nG90\nG0X1Y1\n".into(), "grbl-servo", "warning: nothing is drawn: the pen never moves"),
        ("$H\nG90\n".into(), "marlin-servo", "error: line 1 is a command of GRBL, `$H`"),
        ("G1X1!\n".into(), "grbl-servo", "error: line 1 holds `!`"),
        (with(&format!("G1X{}", "1".repeat(90))), "grbl-servo", "error: line 8 has 93 characters"),
        ("; nothing\n".into(), "grbl-servo", "error: there is no G-code in it"),
    ];
    for (text, device, expected) in table {
        let found = findings(text, device);
        assert!(found.iter().any(|finding| finding.starts_with(expected)), "{text:?} gave {found:?}");
        assert!(found.iter().all(|finding| !finding.contains('\n')));
    }
}

#[test]
fn hpgl_against_the_profile() {
    let list = "1,1,".repeat(40);
    let table: &[(String, &str, &str)] = &[
        (
            "IN;SP7;PD1,1;".into(),
            "hp7475a",
            "warning: instruction 2 takes pen 7, and `hp7475a` holds 6: the plot stops there until it is in holder 1",
        ),
        (
            "IN;PA17000,1;".into(),
            "hp7475a",
            "error: it goes from (17000, 1) to (17000, 1), outside of the hard-clip limits",
        ),
        (
            "IN;PA16000,1;".into(),
            "hp7475a",
            "warning: it goes from (16000, 1) to (16000, 1), within the hard-clip limits of a3 only",
        ),
        ("IN;PA-5,1;".into(), "hp7475a", "error: it goes from (-5, 1)"),
        ("SP1;PA5,1;".into(), "hp7475a", "warning: it does not begin with IN;"),
        ("IN;VS60;PA5,1;".into(), "hp7475a", "warning: instruction 2 sets 60 cm/s, and `hp7475a` draws at 38"),
        (
            "IN;LBabc\x03LBdef\x03".into(),
            "hp7475a",
            "warning: instruction 2 leaves the pen where only the plotter knows: what is lost on the line there is not noticed (and 1 more",
        ),
        (
            format!("IN;SC0,9,0,9;PD{list}1,1;"),
            "hp7475a",
            "warning: instruction 3 has a list of 41 points, and `hp7475a` takes 32",
        ),
        (
            format!("IN;LB{}\x03", "a".repeat(80)),
            "hp7440a",
            "warning: instruction 2 has 83 bytes, more than the buffer",
        ),
        ("12".into(), "hp7475a", "error: this is not HPGL"),
    ];
    for (text, device, expected) in table {
        let found = findings(text, device);
        assert!(found.iter().any(|finding| finding.starts_with(expected)), "{text:?} gave {found:?}");
    }
}

fn probe_of(lines: &str) -> Told {
    let mut probe = Probe::new();
    probe.tick(Duration::ZERO);
    assert_eq!(probe.take_output(), b"$I\n");
    probe.receive(lines.as_bytes(), Duration::ZERO);
    probe.told().clone()
}

#[test]
fn a_controller_tells_what_it_is_like() {
    let told = probe_of("[VER:1.1h.20190825:]\r\n[OPT:V,15,254]\r\nok\r\n$30=255\r\n$31=0.000 (min)\r\n$x=\r\nok\r\n");
    assert_eq!(
        (told.rx_bytes, told.setting(30), told.setting(31), told.setting(32)),
        (Some(254), Some(255.0), Some(0.0), None)
    );
    assert_eq!(probe_of("[OPT:PHS]\r\nok\r\n").rx_bytes, None);
}

#[test]
fn the_probe_is_bounded_and_begins_anew_after_a_reset() {
    let mut probe = Probe::new();
    let mut asked = 0;
    for ms in (0..20_000).step_by(100) {
        probe.tick(Duration::from_millis(ms));
        asked += usize::from(!probe.take_output().is_empty());
    }
    assert_eq!((asked, probe.take_event()), (3, Some(Event::Done)));

    let mut probe = Probe::new();
    probe.tick(Duration::ZERO);
    probe.receive(b"ok\r\n$30=1\r\n\r\nGrbl 1.1h ['$' for help]\r\n", Duration::ZERO);
    assert_eq!(probe.take_output(), b"$I\n$$\n$I\n");
    probe.receive(b"error:2\r\nok\r\n", Duration::ZERO);
    assert_eq!(probe.take_output(), b"$I\n$$\n");
    probe.receive(b"ok\r\n", Duration::ZERO);
    assert_eq!(probe.take_event(), Some(Event::Done));
}

#[test]
fn gcode_against_what_the_controller_tells() {
    let table = [
        ("grbl-servo", "$32=1", "error: the plotter is in laser mode"),
        ("grbl-servo", "$30=1000\n$31=0", ""),
        ("grbl-servo", "$30=255\n$31=0", "warning: S0 and S1000 of the pen, with $30=255 and $31=0, are cut"),
        ("grbl-servo", "$20=1\n$130=1\n$131=1", ""),
        (
            "grbl-servo",
            "$20=1\n$130=0.2\n$131=9",
            "error: the job takes 1.0 × 0.0 mm, more than the plotter's travel of 0.2 × 9 mm ($130, $131), which it holds to ($20)",
        ),
        ("grbl-servo", "$20=0\n$130=0.2\n$131=9", "warning: the job takes"),
        ("grbl-z", "$20=1\n$132=2", "error: the pen moves by 3 mm"),
        ("grbl-servo", "[OPT:V,15,6]", "error: it receives 6 bytes at a time, and line 6 is longer"),
    ];
    for (device, lines, expected) in table {
        let device = find(device).unwrap();
        let Language::Grbl(language) = &device.language else { panic!("not GRBL") };
        let job = grbl::Job::new("G21\nG90\nM3S0\nG0X1Y1\nM3S1000\nG1X2F600\n", 79).unwrap();
        let found = told(&job, &device, language, &probe_of(&format!("{lines}\nok\n")));
        match expected {
            "" => assert_eq!(found, [], "{lines}"),
            _ => assert!(found.len() == 1 && found[0].to_string().starts_with(expected), "{lines}: {found:?}"),
        }
    }
    // Both levels beyond the range are one.
    let mut device = find("grbl-servo").unwrap();
    let Language::Grbl(language) = &mut device.language else { panic!("not GRBL") };
    language.pen =
        crate::device::Pen::Servo { index: 0, up: 300, down: 700, raise_s: 0.1, lower_s: 0.1, soft_steps: 1 };
    let language = language.clone();
    let job = grbl::Job::new("M3S300\n", 79).unwrap();
    let found = told(&job, &device, &language, &probe_of("$30=255\n$31=0\nok\n"));
    assert!(found[0].to_string().contains("are the same to the plotter"), "{found:?}");
}

struct Nobody;

impl stream::Observer for Nobody {
    fn progress(&mut self, _: crate::protocol::Progress) {}
    fn message(&mut self, _: &str) {}
    fn control(&mut self) -> Option<crate::protocol::Control> {
        None
    }
    fn prompt(&mut self, _: &str) -> bool {
        true
    }
    fn paused(&mut self, _: bool) {}
}

fn sim(name: &str) -> SimPort {
    let name = SimName::parse(name).unwrap().unwrap();
    SimPort::with(name.peer(&find(name.default_device()).unwrap()).unwrap(), 115_200)
}

#[test]
fn a_simulated_controller_tells_and_checks() {
    let mut port = sim("sim:grbl,$32=1");
    let clock = port.clock();
    let mut probe = Probe::new();
    stream::run(&mut port, &mut probe, &clock, &mut Nobody).unwrap();
    assert_eq!((probe.told().rx_bytes, probe.told().setting(32)), (Some(128), Some(1.0)));

    let text = "G21\nG90\nG1X5F600\nG5X1\n$H\nG1 X1 X2\nG2X1Y1\nG0X0\n";
    let job = grbl::Job::new(text, 79).unwrap();
    let mut check = Check::new(job, 128);
    stream::run(&mut port, &mut check, &clock, &mut Nobody).unwrap();
    let found: Vec<_> = check.findings().iter().map(ToString::to_string).collect();
    assert_eq!(found.len(), 3, "{found:?}");
    for (finding, expected) in found.iter().zip(["line 4 `G5X1` is refused: error 20", "line 6 ", "line 7 "]) {
        assert!(finding.starts_with(&format!("error: {expected}")), "{finding}");
    }
    assert!(port.recording().ink_mm() == 0.0 && port.recording().travel_mm() == 0.0);
}

#[test]
fn a_check_ends_whatever_the_controller_does() {
    let job = || grbl::Job::new("G1X1F1\nG1X2\n", 79).unwrap();
    let at_end = |said: &[(u64, &str)]| {
        let mut check = Check::new(job(), 128);
        for ms in (0..60_000).step_by(100) {
            let now = Duration::from_millis(ms);
            for (_, text) in said.iter().filter(|(at, _)| *at == ms) {
                check.receive(text.as_bytes(), now);
            }
            check.tick(now);
            if let Some(event) = check.take_event() {
                return (event, String::from_utf8_lossy(&check.take_output()).into_owned());
            }
        }
        panic!("no end");
    };
    let (event, sent) = at_end(&[]);
    assert!(matches!(event, Event::Failed(crate::protocol::Fault::Silent { .. })));
    assert!(sent.starts_with("$C\n") && sent.ends_with('\x18'));
    let (event, _) = at_end(&[(100, "Grbl 1.1h ['$' for help]\n"), (200, "error:8\n")]);
    assert!(matches!(event, Event::Failed(crate::protocol::Fault::NotReady { .. })));
    let banner = "Grbl 1.1h ['$' for help]\n";
    let (event, sent) = at_end(&[(100, banner), (200, "ok\n"), (300, "ok\nok\n"), (400, banner)]);
    assert_eq!((event, sent.as_str()), (Event::Done, "$C\nG1X1F1\nG1X2\n\x18"));
    let (event, _) = at_end(&[(100, banner), (200, "ok\n"), (300, banner)]);
    assert!(matches!(event, Event::Failed(crate::protocol::Fault::Restarted { .. })));
}
