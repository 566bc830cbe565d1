//! Home and limit switches, the safety door, sleep, and the pen meanwhile.

mod common;

use common::{Event, Sim};
use penvis_firmware::{Axes, Pen};

const LOCK: &str = "\r\nGrbl 1.1h ['$' for help]\r\n[MSG:'$H'|'$X' to unlock]\r\n";

/// A machine that homes, some way from its switches.
fn homing(changes: &[(u16, f64)]) -> Sim {
    let mut sim = Sim::with(&[&[(22, 1.0)][..], changes].concat());
    let hardware = sim.machine.hardware_mut();
    hardware.switches = [Some(-2003), Some(-1001), None];
    sim.answers.clear();
    sim
}

fn pen_is_up(sim: &Sim) -> bool {
    let last = sim.events().iter().rev().find_map(|event| match event {
        Event::Pen { pen, .. } => Some(*pen),
        _ => None,
    });
    last == Some(Pen::Off)
}

#[test]
fn a_machine_that_homes_starts_locked() {
    let mut sim = Sim::with(&[(22, 1.0)]);
    sim.send("?");
    assert!(sim.take().starts_with("<Alarm|"));
    assert_eq!(sim.ask("G0 X1"), "error:9\r\n");
    assert_eq!(sim.ask("$X"), "[MSG:Caution: Unlocked]\r\nok\r\n");
    assert_eq!(sim.ask("G0 X1"), "ok\r\n");
}

#[test]
fn homing_finds_the_switches() {
    let mut sim = homing(&[(27, 1.5)]);
    sim.send("$H\n");
    sim.run_for(500_000);
    sim.send("?!");
    assert!(sim.take().starts_with("<Home|"), "and a hold does not stop it");
    sim.finish();
    assert_eq!(sim.take(), "ok\r\n");
    // 1.5 mm of 80 steps from each switch, which closes with the first step at or below its place.
    assert_eq!(sim.machine.hardware().position, [-2003 + 120, -1001 + 120, 0]);
    assert_eq!(sim.machine.position(), [-428 * 80 - 40, -308 * 80 - 40, 0], "travel and pull-off, as GRBL");
    sim.send("?");
    assert!(sim.take().starts_with("<Idle|MPos:-428.500,-308.500,0.000|"));
    // Again, and the same.
    sim.ask("G0 X-300 Y-200");
    assert_eq!(sim.ask("$HX"), "ok\r\n");
    assert_eq!(sim.machine.position()[0], -428 * 80 - 40);
    assert_eq!(sim.machine.hardware().position[0], -2003 + 120);
    assert_eq!(sim.machine.position()[1], -200 * 80);
    assert_eq!(sim.ask("$HZ"), "error:5\r\n", "it has no switch");
}

/// First events of a kind: whether an axis stepped, and which.
fn moved(sim: &Sim, axis: usize) -> impl Iterator<Item = u64> {
    sim.events().iter().filter_map(move |event| match event {
        Event::Step { at, delta } if delta[axis] != 0 => Some(*at),
        _ => None,
    })
}

#[test]
fn x_and_y_home_together_after_z() {
    let mut sim = homing(&[(44, 7.0), (23, 1.0)]);
    // Z and Y home upwards, X down.
    let hardware = sim.machine.hardware_mut();
    hardware.switches = [Some(-2003), None, None];
    hardware.upper_switches = [None, Some(1001), Some(500)];
    sim.send("$H\n");
    sim.finish();
    assert_eq!(sim.take(), "ok\r\n");
    assert_eq!(sim.machine.hardware().position, [-2003 + 160, 1001 - 160, 500 - 160]);
    sim.send("?");
    let report = sim.take();
    assert!(report.starts_with("<Idle|MPos:-428.000,-2.000,-2.000|"), "{report}");
    let (z, x) = (moved(&sim, 2).last().unwrap(), moved(&sim, 0).next().unwrap());
    assert!(z < x, "Z is done at {z}, X begins at {x}");
    // Both at $25: 1001 steps of each at 2000 a second, in the time of one.
    let first = moved(&sim, 1).next().unwrap();
    assert_eq!(first, x, "with the same step");
    let (x, y) = (moved(&sim, 0).nth(900).unwrap(), moved(&sim, 1).nth(900).unwrap());
    assert_eq!(x, y);
    assert!(x - first < 500_000, "900 steps take {} µs", x - first);
}

#[test]
fn a_hanging_pen_does_not_home_and_says_so() {
    let mut sim = homing(&[(500, 2.0)]);
    assert_eq!(sim.ask("$H"), "[MSG:A hanging pen does not home: put it at the origin by hand]\r\nerror:5\r\n");
    assert_eq!(sim.ask("G1 X1 F600"), "ok\r\n");
}

#[test]
fn home_may_be_the_origin() {
    let mut sim = homing(&[(22, 9.0), (20, 1.0)]);
    assert_eq!(sim.ask("$H"), "ok\r\n");
    assert_eq!(sim.machine.position(), [0; 3]);
    assert_eq!(sim.machine.hardware().position, [-2003 + 160, -1001 + 160, 0]);
    assert_eq!(sim.ask("G0 X430 Y310"), "ok\r\n");
    assert_eq!(sim.ask("$J=X-1 F1000"), "error:15\r\n");
    assert_eq!(sim.machine.hardware().position, [430 * 80 - 2003 + 160, 310 * 80 - 1001 + 160, 0]);
}

#[test]
fn homing_where_the_switch_is_closed_already() {
    let mut sim = homing(&[]);
    sim.machine.hardware_mut().position = [-2100, 0, 0];
    assert_eq!(sim.ask("$H"), "ok\r\n");
    assert_eq!(sim.machine.hardware().position[0], -2003 + 160);
}

#[test]
fn homing_that_fails_locks_the_machine() {
    // No switch anywhere.
    let mut sim = homing(&[(130, 20.0)]);
    sim.machine.hardware_mut().switches = [None; 3];
    assert_eq!(sim.ask("$H"), format!("ALARM:9\r\n{LOCK}"));
    assert_eq!(sim.machine.hardware().position, [-30 * 80, -30 * 80, 0], "one and a half times the lesser travel");
    assert_eq!(sim.ask("G0 X1"), "error:9\r\n");
    // One that stays closed.
    let mut sim = homing(&[]);
    sim.machine.hardware_mut().stuck = Axes::from_bits(0b001);
    assert_eq!(sim.ask("$H"), format!("ALARM:8\r\n{LOCK}"));
    // A reset, and the door.
    for (byte, alarm) in [(0x18, 6), (0x84, 7)] {
        let mut sim = homing(&[]);
        sim.send("$H\n");
        sim.run_for(300_000);
        sim.send([byte]);
        sim.finish();
        assert_eq!(sim.take(), format!("ALARM:{alarm}\r\n{LOCK}"));
        let stopped = sim.machine.hardware().position;
        sim.run_for(1_000_000);
        assert_eq!(sim.machine.hardware().position, stopped);
    }
}

#[test]
fn switches_that_are_normally_closed() {
    let mut sim = homing(&[(5, 1.0), (44, 1.0)]);
    let hardware = sim.machine.hardware_mut();
    // Low above its place, high at and below.
    hardware.switches = [None; 3];
    hardware.stuck = Axes::from_bits(0b111);
    sim.send("?");
    assert!(!sim.take().contains("Pn:"));
    sim.machine.hardware_mut().stuck = Axes::from_bits(0b010);
    sim.send("?");
    let report = sim.take();
    assert!(report.contains("|Pn:XZ"), "{report}");
}

#[test]
fn a_hard_limit_stops_at_once_with_the_pen_up() {
    let mut sim = Sim::with(&[(21, 1.0)]);
    sim.machine.hardware_mut().switches = [Some(-800), None, None];
    sim.send("M3 S1000\nG1 X-50 F3000\nX0\n");
    sim.run_for(3_000_000);
    assert_eq!(sim.take(), "ok\r\nok\r\nok\r\nALARM:1\r\n[MSG:Reset to continue]\r\n");
    assert_eq!(sim.machine.hardware().position, [-800, 0, 0]);
    assert!(pen_is_up(&sim));
    sim.send("?$X\nG0 X0\n");
    let report = sim.take();
    assert!(report.starts_with("<Alarm|") && report.contains("|Pn:X"), "{report}");
    assert_eq!(report.lines().count(), 1, "only a reset helps");
    sim.send([0x18]);
    assert_eq!(sim.take(), LOCK);
    assert_eq!(sim.ask("$X"), "[MSG:Caution: Unlocked]\r\nok\r\n");
    assert_eq!(sim.ask("G0 X0"), "ok\r\n", "it may leave the switch");
    assert_eq!(sim.machine.hardware().position, [0; 3]);
}

/// Times and states of the pen.
fn pens(sim: &Sim) -> Vec<Pen> {
    sim.events()
        .iter()
        .filter_map(|event| match event {
            Event::Pen { pen, .. } => Some(*pen),
            _ => None,
        })
        .collect()
}

const DOWN: Pen = Pen::On { level: u16::MAX };

#[test]
fn a_hold_parks_the_pen_when_asked_to() {
    let mut sim = Sim::with(&[(41, 1.0)]);
    sim.send("M3 S1000\nG1 X100 F6000\n");
    sim.run_for(500_000);
    sim.send("!");
    sim.run_for(500_000);
    assert_eq!(pens(&sim), [Pen::Off, DOWN, Pen::Off]);
    let held = sim.machine.position();
    sim.send("~");
    sim.finish();
    assert_eq!(pens(&sim), [Pen::Off, DOWN, Pen::Off, DOWN]);
    assert_eq!(sim.machine.position(), [8000, 0, 0]);
    // It was lifted and put down where it was held.
    let places: Vec<_> = sim
        .events()
        .iter()
        .filter_map(|e| if let Event::Pen { position, .. } = e { Some(*position) } else { None })
        .collect();
    assert_eq!(places[2..], [held, held]);
    let mut sim = Sim::with(&[]);
    sim.send("M3 S1000\nG1 X100 F6000\n");
    sim.run_for(500_000);
    sim.send("!");
    sim.run_for(500_000);
    sim.send("~");
    sim.finish();
    assert_eq!(pens(&sim), [Pen::Off, DOWN], "without $41 it stays down");
}

#[test]
fn the_door_lifts_the_pen_in_any_case() {
    let mut sim = Sim::with(&[]);
    sim.send("M3 S1000\nG1 X100 F6000\n");
    sim.run_for(500_000);
    sim.take();
    sim.send([0x84]);
    sim.send("?");
    assert!(sim.take().starts_with("<Door:2|"));
    sim.run_for(500_000);
    sim.send("?");
    let report = sim.take();
    assert!(report.starts_with("<Door:0|") && report.contains("|Pn:D"), "{report}");
    assert!(pen_is_up(&sim));
    sim.send("~");
    sim.finish();
    assert_eq!((pens(&sim).last(), sim.machine.position()), (Some(&DOWN), [8000, 0, 0]));
}

#[test]
fn the_pen_follows_its_override_while_it_is_held() {
    let mut sim = Sim::with(&[]);
    sim.send("M3 S500\nG1 X100 F6000\n");
    sim.run_for(500_000);
    sim.send("!");
    sim.run_for(500_000);
    sim.take();
    sim.send([0x9a]);
    sim.run_for(2000);
    // 550 of 1000.
    assert_eq!(pens(&sim).last(), Some(&Pen::On { level: 36044 }));
    sim.send("?");
    sim.send("?");
    let reports = sim.take();
    assert!(reports.contains("|Ov:100,100,110|A:S>"), "{reports}");
    // Lifted by hand, changed, and put down again.
    sim.send([0x9e]);
    sim.run_for(2000);
    assert!(pen_is_up(&sim));
    sim.send([0x9b]);
    sim.run_for(2000);
    assert!(pen_is_up(&sim));
    sim.send("~");
    sim.finish();
    assert_eq!(pens(&sim).last(), Some(&Pen::On { level: 32768 }));
    sim.ask("M5");
    sim.send([0x9a]);
    sim.finish();
    assert!(pen_is_up(&sim));
}

#[test]
fn a_soft_limit_leaves_the_pen_up() {
    let mut sim = Sim::with(&[(20, 1.0)]);
    sim.send("M3 S1000\nG1 X20 F600\nX-1\n");
    sim.run_for(3_000_000);
    assert!(sim.take().contains("ALARM:2"));
    assert!(pen_is_up(&sim));
}

#[test]
fn sleep_releases_the_motors_until_a_reset() {
    let mut sim = Sim::with(&[]);
    sim.ask("M3 S1000");
    sim.ask("G0 X1");
    assert_eq!(sim.ask("$SLP"), "[MSG:Sleeping]\r\nok\r\n");
    sim.run_for(10_000);
    assert!(pen_is_up(&sim));
    assert!(matches!(sim.events().last(), Some(Event::Motors { on: false, .. })), "{:?}", sim.events().last());
    sim.send("?G0 X0\n~");
    sim.run_for(10_000);
    let said = sim.take();
    assert!(said.starts_with("<Sleep|") && said.lines().count() == 1, "{said}");
    sim.send([0x18]);
    assert_eq!(sim.take(), LOCK);
    sim.ask("$X");
    sim.ask("G0 X0");
    assert_eq!(sim.machine.hardware().position, [0; 3]);
}
