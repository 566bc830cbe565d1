//! What outlives switching off, and the commands that change it.

mod common;

use common::{RamFlash, Sim, settings};
use penvis_firmware::Settings;

const BANNER: &str = "\r\nGrbl 1.1h ['$' for help]\r\n";

#[test]
fn settings_survive_switching_off() {
    let mut sim = Sim::with(&[]);
    // Each fits only when the other has been changed.
    assert_eq!(sim.ask("$110=1200") + &sim.ask("$100=800"), "ok\r\nok\r\n");
    let mut sim = sim.restarted(Settings::default());
    assert_eq!(sim.take(), BANNER);
    let listed = sim.ask("$$");
    assert!(listed.contains("$100=800.000\r\n") && listed.contains("$110=1200.000\r\n"), "{listed}");
    assert!(sim.ask("$RST=$").contains("Restoring defaults"));
    let mut sim = sim.restarted(Settings::default());
    assert!(sim.ask("$$").contains("$100=80.000\r\n"));
}

#[test]
fn damaged_storage_gives_the_defaults_and_says_so() {
    let mut sim = Sim::with(&[]);
    sim.ask("$100=40");
    let mut flash = sim.machine.storage().clone();
    flash.bytes.iter_mut().for_each(|byte| *byte ^= 0x10);
    let mut sim = Sim::start(Settings::default(), flash);
    assert_eq!(sim.take(), format!("error:7\r\n{BANNER}"));
    assert!(sim.ask("$$").contains("$100=80.000\r\n"));
    assert_eq!(sim.ask("$100=60"), "ok\r\n");
    let mut sim = sim.restarted(Settings::default());
    assert_eq!(sim.take(), BANNER);
    assert!(sim.ask("$$").contains("$100=60.000\r\n"));
}

#[test]
fn what_cannot_be_kept_is_refused_and_changes_nothing() {
    let flash = RamFlash { left: 0, ..RamFlash::default() };
    let mut sim = Sim::start(Settings::default(), flash);
    sim.take();
    for line in ["$100=40", "$N0=G20", "$I=NAME", "$RST=#", "G10 L2 P1 X5", "G28.1"] {
        assert_eq!(sim.ask(line), "error:7\r\n", "{line}");
    }
    assert!(sim.ask("$$").contains("$100=80.000\r\n"));
    assert_eq!(sim.ask("$N"), "$N0=\r\n$N1=\r\nok\r\n");
    assert!(sim.ask("$#").starts_with("[G54:0.000,"));
    assert_eq!(sim.ask("G0 X1"), "ok\r\n");
}

#[test]
fn start_up_lines_run_at_the_start_and_after_a_reset() {
    let mut sim = Sim::with(&[]);
    assert_eq!(sim.ask("$N0=G20 G5"), "error:20\r\n", "a bad line is not kept");
    assert_eq!(sim.ask("$N1=g91 x 2 f100 (c)"), "ok\r\n");
    assert_eq!(sim.machine.position(), [0; 3], "checked, not obeyed");
    assert_eq!(sim.ask("$N"), "$N0=\r\n$N1=G91X2F100\r\nok\r\n");
    sim.send([0x18]);
    sim.finish();
    assert_eq!(sim.take(), format!("{BANNER}>G91X2F100:ok\r\n"));
    assert_eq!(sim.machine.position(), [160, 0, 0]);
    let mut again = sim.restarted(Settings::default());
    again.send("G0 X1\n");
    again.finish();
    assert_eq!(again.take(), format!("{BANNER}>G91X2F100:ok\r\nok\r\n"), "before what the port has sent");
    assert_eq!(again.machine.position(), [240, 0, 0]);
    assert_eq!(again.ask("$N1="), "ok\r\n");
    // A line that has become bad since.
    assert_eq!(again.ask("$N0=X10000000"), "ok\r\n");
    assert_eq!(again.ask("$100=10000"), "error:12\r\n");
    again.ask("$110=60");
    again.ask("$100=2000");
    again.send([0x18]);
    again.finish();
    assert_eq!(again.take(), format!("{BANNER}>X10000000:error:33\r\n"));
}

#[test]
fn the_name_is_told() {
    let mut sim = Sim::with(&[]);
    assert_eq!(sim.ask("$I=plotter 7"), "ok\r\n");
    let mut sim = sim.restarted(Settings::default());
    sim.take();
    assert_eq!(sim.ask("$I"), "[VER:1.1h.penvis:PLOTTER7]\r\n[OPT:VH,896,128]\r\nok\r\n");
}

#[test]
fn coordinate_systems_are_kept_and_used() {
    let mut sim = Sim::with(&[]);
    assert_eq!(sim.ask("G10 L2 P2 X10 Y-5"), "ok\r\n");
    sim.ask("G55 G0 X1 Y6");
    assert_eq!(sim.machine.position(), [880, 80, 0]);
    // Here is to be 3.
    assert_eq!(sim.ask("G10 L20 P0 X3"), "ok\r\n");
    sim.ask("G43.1 Z2");
    sim.ask("G92 Y0");
    sim.send("?");
    let report = sim.take();
    assert!(report.contains("|WCO:8.000,1.000,2.000>"), "{report}");
    sim.ask("G0 X0 Y2 Z1");
    assert_eq!(sim.machine.position(), [640, 240, 240]);
    let listed = sim.ask("$#");
    assert!(listed.contains("[G55:8.000,-5.000,0.000]\r\n") && listed.contains("[G92:0.000,6.000,0.000]"), "{listed}");
    assert!(listed.contains("[TLO:2.000]"), "{listed}");
    let mut sim = sim.restarted(Settings::default());
    assert!(sim.ask("$#").contains("[G55:8.000,-5.000,0.000]"));
    assert!(sim.ask("$G").contains(" G54 "));
    assert!(sim.ask("$RST=#").contains("ok"));
    assert!(sim.ask("$#").contains("[G55:0.000,0.000,0.000]"));
}

#[test]
fn stored_places() {
    let mut sim = Sim::with(&[]);
    sim.ask("G0 X10 Y20");
    assert_eq!(sim.ask("G28.1"), "ok\r\n");
    sim.ask("G0 X0 Y0");
    assert_eq!(sim.ask("G28"), "ok\r\n");
    assert_eq!(sim.machine.position(), [800, 1600, 0]);
    // By way of X5 and then only X home.
    sim.ask("G0 X1 Y1");
    assert_eq!(sim.ask("G28 X5"), "ok\r\n");
    assert_eq!(sim.machine.position(), [800, 80, 0]);
    assert!(sim.path().iter().any(|(_, p)| *p == [400, 80, 0]));
    assert_eq!(sim.ask("G30"), "ok\r\n", "never set: the origin");
    assert_eq!(sim.machine.position(), [0; 3]);
    let mut sim = sim.restarted(settings(&[]));
    sim.ask("G28");
    assert_eq!(sim.machine.position(), [800, 1600, 0]);
}

#[test]
fn inverse_time() {
    let mut sim = Sim::with(&[]);
    let start = sim.machine.now();
    // 100 mm in a twelfth of a minute.
    sim.ask("G93 G1 X100 F12");
    let line = (sim.machine.now() - start) as f64 * 1e-6;
    assert!((5.0..5.1).contains(&line), "{line} s");
    assert_eq!(sim.ask("G1 X0"), "error:22\r\n", "each line has its own");
    let start = sim.machine.now();
    sim.ask("G3 X100 Y0 I0 J0 R50 F6");
    let arc = (sim.machine.now() - start) as f64 * 1e-6;
    assert!(arc < 0.01, "the same place has no arc: {arc} s");
    let start = sim.machine.now();
    sim.ask("G3 X0 R50 F6");
    let arc = (sim.machine.now() - start) as f64 * 1e-6;
    assert!((10.0..10.2).contains(&arc), "half a turn in a sixth of a minute: {arc} s");
    assert_eq!(sim.ask("G94 G1 X1"), "error:22\r\n", "a feed is forgotten");
    assert!(sim.ask("$G").contains(" G93 "));
}
