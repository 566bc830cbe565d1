//! What the port says to what it is told.

mod common;

use common::Sim;
use proptest::prelude::*;

#[test]
fn lines_and_their_answers() {
    for (line, answer) in [
        ("", "ok\r\n"),
        ("(comment)", "ok\r\n"),
        ("; comment", "ok\r\n"),
        ("g1 x1 f100", "ok\r\n"),
        ("N5 G21 G90 G94 G17 G40 G49 G54 G80", "ok\r\n"),
        ("G0 X1\r", "ok\r\nok\r\n"),
        ("X1 5", "ok\r\n"),
        ("1", "error:1\r\n"),
        ("#5=3", "error:1\r\n"),
        ("G", "error:2\r\n"),
        ("X1.2.3", "error:1\r\n"),
        ("G1 X- F5", "error:2\r\n"),
        ("$Q", "error:3\r\n"),
        ("F-1", "error:4\r\n"),
        ("G4 P-1", "error:4\r\n"),
        ("$100=-1", "error:4\r\n"),
        ("$H", "error:5\r\n"),
        ("$0=0", "error:6\r\n"),
        ("$110=1e9", "error:3\r\n"),
        ("$110=1000000", "error:12\r\n"),
        ("G5", "error:20\r\n"),
        ("G55 G43.1 Z2 G93 G61", "ok\r\n"),
        ("G59.1", "error:20\r\n"),
        ("G64", "error:20\r\n"),
        ("G38.2 Z-1 F100", "error:20\r\n"),
        ("G93 G1 X1", "error:22\r\n"),
        ("G10 L2 P1", "error:26\r\n"),
        ("G10 L2 X1", "error:28\r\n"),
        ("G10 L2 P7 X1", "error:29\r\n"),
        ("G10 L2 P1.5 X1", "error:23\r\n"),
        ("G10 L3 P1 X1", "error:20\r\n"),
        ("G10 L2 P1 R5 X1", "error:20\r\n"),
        ("G10 L2 P1 X1e9", "error:20\r\n"),
        ("G10 L2 P1 X999999999", "error:33\r\n"),
        ("G28 G0 X1", "error:24\r\n"),
        ("G43.1 X1", "error:37\r\n"),
        ("M7 M8", "error:21\r\n"),
        ("$HX", "error:5\r\n"),
        ("G90.1", "error:20\r\n"),
        ("M6", "error:20\r\n"),
        ("A1", "error:20\r\n"),
        ("G0.05", "error:20\r\n"),
        ("G0 G1 X1", "error:24\r\n"),
        ("G20 G21", "error:21\r\n"),
        ("M3 M5", "error:21\r\n"),
        ("G1 X1", "error:22\r\n"),
        ("T1.5", "error:23\r\n"),
        ("G0 X1 G92", "error:24\r\n"),
        ("G0 X1 X2", "error:25\r\n"),
        ("G92", "error:26\r\n"),
        ("G2 I1 F100", "error:26\r\n"),
        ("N10000001", "error:27\r\n"),
        ("G4", "error:28\r\n"),
        ("G2 G53 X1 I1 F100", "error:30\r\n"),
        ("G80 X1", "error:31\r\n"),
        ("G2 Z1 I1 F100", "error:32\r\n"),
        ("G2 X10 I4 F100", "error:33\r\n"),
        ("G0 X99999999", "error:33\r\n"),
        ("G2 X10 R4 F100", "error:34\r\n"),
        ("G2 X10 F100", "error:35\r\n"),
        ("G2 X10 K5 F100", "error:35\r\n"),
        ("G0 X1 R2", "error:36\r\n"),
        ("P1", "error:36\r\n"),
        ("T256", "error:38\r\n"),
        (&"1".repeat(80), "error:11\r\n"),
    ] {
        let mut sim = Sim::with(&[]);
        assert_eq!(sim.ask(line), answer, "{line:?}");
    }
}

#[test]
fn refused_lines_change_nothing() {
    let mut sim = Sim::with(&[]);
    sim.ask("G0 X5");
    let before = sim.ask("$G");
    for bad in ["G91 G20 G1 X1 F100 P1", "G1 F0 X5", "M3 S100 G5", "G92 X0 Y1 R1"] {
        assert!(sim.ask(bad).starts_with("error:"), "{bad}");
    }
    assert_eq!(sim.ask("$G"), before);
    assert_eq!(sim.machine.position(), [400, 0, 0]);
    assert_eq!(sim.path().len(), 400);
}

#[test]
fn listings() {
    let mut sim = Sim::with(&[]);
    let settings = sim.ask("$$");
    assert_eq!(settings.lines().count(), 50);
    assert!(settings.starts_with("$0=10\r\n$1=255\r\n$2=0\r\n"), "{settings}");
    assert!(settings.contains("\r\n$100=80.000\r\n") && settings.ends_with("$512=0\r\nok\r\n"), "{settings}");
    assert_eq!(sim.ask("$I"), "[VER:1.1h.penvis:]\r\n[OPT:VH,896,128]\r\nok\r\n");
    assert_eq!(sim.ask("$G"), "[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]\r\nok\r\n");
    sim.ask("G92 X-1.5");
    assert_eq!(
        sim.ask("$#"),
        [
            "[G54:0.000,0.000,0.000]\r\n[G55:0.000,0.000,0.000]\r\n[G56:0.000,0.000,0.000]\r\n[G57:0.000,0.000,0.000]\r\n",
            "[G58:0.000,0.000,0.000]\r\n[G59:0.000,0.000,0.000]\r\n[G28:0.000,0.000,0.000]\r\n[G30:0.000,0.000,0.000]\r\n",
            "[G92:1.500,0.000,0.000]\r\n[TLO:0.000]\r\n[PRB:0.000,0.000,0.000:0]\r\nok\r\n",
        ]
        .concat()
    );
    assert_eq!(sim.ask("$N"), "$N0=\r\n$N1=\r\nok\r\n");
    assert_eq!(sim.ask("$101=40"), "ok\r\n");
    assert!(sim.ask("$$").contains("$101=40.000\r\n"));
    assert_eq!(sim.ask("$RST=$"), "[MSG:Restoring defaults]\r\nok\r\n\r\nGrbl 1.1h ['$' for help]\r\n");
    assert!(sim.ask("$$").contains("$101=80.000\r\n"));
}

#[test]
fn listings_wait_for_a_slow_reader() {
    let mut sim = Sim::with(&[]);
    sim.machine.receive(b'$');
    sim.machine.receive(b'$');
    sim.machine.receive(b'\n');
    let mut answer = Vec::new();
    for _ in 0..5000 {
        sim.machine.poll();
        answer.extend(sim.machine.transmit());
    }
    let answer = String::from_utf8(answer).unwrap();
    assert_eq!(answer.lines().count(), 50);
    assert!(answer.ends_with("ok\r\n"));
}

#[test]
fn status_reports() {
    let mut sim = Sim::with(&[]);
    sim.send("?");
    assert_eq!(sim.take(), "<Idle|MPos:0.000,0.000,0.000|Bf:896,128|FS:0,0|WCO:0.000,0.000,0.000>\r\n");
    sim.send("?");
    assert_eq!(sim.take(), "<Idle|MPos:0.000,0.000,0.000|Bf:896,128|FS:0,0|Ov:100,100,100>\r\n");
    sim.send("?");
    assert_eq!(sim.take(), "<Idle|MPos:0.000,0.000,0.000|Bf:896,128|FS:0,0>\r\n");
    sim.send("G1 X100 F6000 M3 S500 N7\n");
    sim.run_for(500_000);
    sim.take();
    sim.send("?");
    let report = sim.take();
    assert!(report.starts_with("<Run|MPos:"), "{report}");
    assert!(report.contains("|Bf:895,128|Ln:7|FS:6000,500>"), "{report}");
    sim.finish();
    sim.ask("$10=0");
    sim.ask("G92 X0");
    sim.take();
    sim.send("?");
    assert_eq!(sim.take(), "<Idle|WPos:0.000,0.000,0.000|FS:0,500|WCO:100.000,0.000,0.000>\r\n");
}

#[test]
fn real_time_bytes_act_inside_comments_and_words() {
    let mut sim = Sim::with(&[]);
    sim.send("G0 (a ? b");
    assert!(sim.take().starts_with("<Idle|"));
    sim.send(") X1");
    sim.send("?");
    sim.send("0 ; \u{7f}!");
    assert!(sim.take().starts_with("<Idle|"));
    sim.send([0x91, 0xff, b'\n']);
    sim.run_for(1_000_000);
    sim.send("?");
    let report = sim.take();
    assert!(report.starts_with("ok\r\n<Hold:0|MPos:0.000,0.000,0.000|"), "{report}");
    sim.send("~");
    sim.finish();
    assert_eq!(sim.machine.position(), [800, 0, 0]);
}

#[test]
fn ok_means_planned_and_a_full_planner_fills_the_ring() {
    let mut sim = Sim::with(&[]);
    let mut sent = 0;
    // Blocks in execution, 15 waiting, and then lines wait in the ring and in the editor.
    while sim.machine.rx_free() > 0 {
        sim.send(
            format!("G1 X{} Y{} F60\n", sent + 1, sent % 2)
                .as_bytes()
                .iter()
                .copied()
                .take(sim.machine.rx_free())
                .collect::<Vec<_>>(),
        );
        sent += 1;
        assert!(sent < 100);
    }
    assert_eq!(sim.take().matches("ok").count(), 16, "one in execution and fifteen behind it");
    assert_eq!(sim.machine.lost_bytes(), 0);
    sim.send("XYZ");
    assert_eq!(sim.machine.lost_bytes(), 3, "what does not fit is lost, silently but counted");
    assert_eq!(sim.take(), "");
}

#[test]
fn dwell_is_a_barrier() {
    let mut sim = Sim::with(&[]);
    sim.send("G1 X10 F6000\nG4 P0.25\n");
    assert_eq!(sim.take(), "ok\r\n");
    while sim.machine.position()[0] < 800 {
        sim.tick();
        assert_eq!(sim.take(), "");
    }
    let reached = sim.machine.now();
    sim.finish();
    assert_eq!(sim.take(), "ok\r\n");
    let waited = sim.machine.now() - reached;
    assert!((250_000..260_000).contains(&waited), "{waited}");
}

#[test]
fn pause_holds_until_resumed() {
    let mut sim = Sim::with(&[]);
    sim.send("G1 X10 F6000\nM0\nX20\n");
    sim.run_for(2_000_000);
    assert_eq!(sim.take(), "ok\r\n");
    assert_eq!(sim.machine.position(), [800, 0, 0]);
    sim.send("?");
    assert!(sim.take().starts_with("<Hold:0|"));
    sim.send("~");
    sim.finish();
    assert_eq!(sim.take(), "ok\r\nok\r\n");
    assert_eq!(sim.machine.position(), [1600, 0, 0]);
}

#[test]
fn program_end_restores_modes() {
    let mut sim = Sim::with(&[]);
    sim.ask("G91 G18 G20 M3 S500 M8 F10");
    assert_eq!(sim.ask("M2"), "[MSG:Pgm End]\r\nok\r\n");
    assert_eq!(sim.ask("$G"), "[GC:G1 G54 G17 G20 G90 G94 M5 M9 T0 F254 S500]\r\nok\r\n");
}

#[test]
fn check_mode_moves_nothing() {
    let mut sim = Sim::with(&[]);
    assert_eq!(sim.ask("$C"), "[MSG:Enabled]\r\nok\r\n");
    assert_eq!(sim.ask("G0 X10"), "ok\r\n");
    assert_eq!(sim.ask("G2 X20 R1 F1"), "error:34\r\n");
    assert_eq!(sim.ask("$C"), "[MSG:Disabled]\r\nok\r\n\r\nGrbl 1.1h ['$' for help]\r\n");
    assert_eq!(sim.machine.position(), [0; 3]);
    assert_eq!(sim.ask("G91 G0 X1"), "ok\r\n");
    assert_eq!(sim.machine.position(), [80, 0, 0]);
}

#[test]
fn reset_in_motion_locks_and_reset_from_hold_does_not() {
    let mut sim = Sim::with(&[]);
    sim.send("G1 X100 F6000\nX0\n");
    sim.run_for(300_000);
    assert_eq!(sim.take(), "ok\r\nok\r\n");
    sim.send([0x18]);
    assert_eq!(sim.take(), "ALARM:3\r\n\r\nGrbl 1.1h ['$' for help]\r\n[MSG:'$H'|'$X' to unlock]\r\n");
    let stopped = sim.machine.position();
    assert_eq!(sim.ask("G0 X1"), "error:9\r\n");
    assert_eq!(sim.ask(""), "ok\r\n");
    assert_eq!(sim.ask("$X"), "[MSG:Caution: Unlocked]\r\nok\r\n");
    assert_eq!(sim.machine.position(), stopped);

    sim.send("G1 X100 F6000\n");
    sim.run_for(300_000);
    sim.send("!");
    sim.send("?");
    let report = sim.take();
    assert!(report.contains("<Hold:1|"), "{report}");
    sim.run_for(500_000);
    sim.send("?");
    assert!(sim.take().starts_with("<Hold:0|"));
    sim.send([0x18]);
    assert_eq!(sim.take(), "\r\nGrbl 1.1h ['$' for help]\r\n");
    // The position is kept: going back to 0 takes exactly the steps made.
    sim.ask("G0 X0");
    assert_eq!(sim.machine.position(), [0; 3]);
    assert_eq!(sim.machine.hardware().position, [0; 3]);
}

#[test]
fn reset_forgets_what_was_received() {
    let mut sim = Sim::with(&[]);
    for &b in b"G0 X1\nG0 X2\nhalf \x18" {
        sim.machine.receive(b);
    }
    sim.finish();
    assert_eq!(sim.take(), "\r\nGrbl 1.1h ['$' for help]\r\n");
    assert_eq!(sim.ask("G0 X3"), "ok\r\n");
    assert_eq!(sim.machine.position(), [240, 0, 0]);
}

#[test]
fn soft_limits_stop_and_want_a_reset() {
    let mut sim = Sim::with(&[(20, 1.0)]);
    assert_eq!(sim.ask("G0 X10 Y10"), "ok\r\n");
    sim.send("G1 X20 F600\nX-1\nX5\n");
    sim.run_for(3_000_000);
    assert_eq!(sim.take(), "ok\r\nALARM:2\r\n[MSG:Reset to continue]\r\n");
    sim.send("~?\n$X\n");
    sim.run_for(1_000_000);
    assert!(sim.take().starts_with("<Alarm|"));
    sim.send([0x18]);
    assert!(sim.take().ends_with("[MSG:'$H'|'$X' to unlock]\r\n"));
    sim.ask("$X");
    assert_eq!(sim.ask("G0 X0 Y0"), "ok\r\n");
    assert_eq!(sim.machine.hardware().position, [0; 3]);
}

#[test]
fn commands_that_need_rest() {
    let mut sim = Sim::with(&[]);
    sim.send("G1 X10 F600\n");
    sim.run_for(100_000);
    sim.take();
    for line in ["$$", "$100=40", "$C", "$X", "$#"] {
        sim.send(format!("{line}\n"));
        assert_eq!(sim.take(), "error:8\r\n", "{line}");
    }
    sim.send("$G\n");
    assert!(sim.take().starts_with("[GC:"));
}

#[test]
fn jogs() {
    let mut sim = Sim::with(&[(20, 1.0)]);
    for (line, answer) in [
        ("$J=X10 F600", "ok\r\n"),
        ("$J=G91 G20 X1 F20", "ok\r\n"),
        ("$J=X10", "error:22\r\n"),
        ("$J=F100", "error:26\r\n"),
        ("$J=G1 X1 F100", "error:16\r\n"),
        ("$J=G4 X1 F100", "error:16\r\n"),
        ("$J=G92 X1 F100", "error:16\r\n"),
        ("$J=M3 X1 F100", "error:16\r\n"),
        ("$J=X1 S1 F100", "error:16\r\n"),
        ("$J=X-1 F100", "error:15\r\n"),
        ("$J=X1 F", "error:2\r\n"),
    ] {
        assert_eq!(sim.ask(line), answer, "{line}");
    }
    assert_eq!(sim.machine.position(), [2832, 0, 0], "10 mm and an inch");
    assert_eq!(sim.ask("$G"), "[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]\r\nok\r\n");

    // Cancelled on the way, with another behind it.
    sim.send("$J=X300 F6000\n$J=X0 F6000\nG0 X1\n");
    sim.run_for(500_000);
    assert_eq!(sim.take(), "ok\r\nok\r\nerror:9\r\n");
    sim.send("?");
    assert!(sim.take().starts_with("<Jog|"));
    sim.send([0x85]);
    sim.finish();
    let stopped = sim.machine.position()[0];
    assert!((6000..8000).contains(&stopped), "{stopped}");
    sim.send("?");
    assert!(sim.take().starts_with("<Idle|"));
    assert_eq!(sim.ask("G91 G0 X0.1"), "ok\r\n");
    assert_eq!(sim.machine.position()[0], stopped + 8);
    // Many more than the planner holds, and the one that waits for it.
    for i in 0..17 {
        sim.send(format!("$J=G91 {}0.5 F60\n", ["X", "Y"][i % 2]));
    }
    sim.run_for(100_000);
    assert_eq!(sim.take().matches("ok").count(), 16);
    sim.send("!");
    sim.finish();
    assert_eq!(sim.take(), "ok\r\n");
    assert_eq!(sim.ask("G90 G0 X0"), "ok\r\n");
    assert_eq!(sim.machine.hardware().position, [0; 3]);
    // Nothing to cancel.
    sim.send([0x85]);
    assert_eq!(sim.ask("X1"), "ok\r\n");
}

/// Pieces of lines, right and wrong, that never hold the machine up for good.
fn piece() -> impl Strategy<Value = String> {
    prop_oneof![
        Just("G0".to_owned()),
        Just("G1".to_owned()),
        Just("G2".to_owned()),
        Just("G91".to_owned()),
        Just("G92".to_owned()),
        Just("M3".to_owned()),
        Just("M5".to_owned()),
        Just("(x)".to_owned()),
        Just("$G".to_owned()),
        Just("$J=X1F900".to_owned()),
        Just("$110=6000".to_owned()),
        (-50.0..50.0f64).prop_map(|v| format!("X{v:.3}")),
        (-50.0..50.0f64).prop_map(|v| format!("Y{v:.3}")),
        (-20.0..20.0f64).prop_map(|v| format!("I{v:.3}")),
        (1.0..50.0f64).prop_map(|v| format!("R{v:.3}")),
        (0.0..9000.0f64).prop_map(|v| format!("F{v:.1}")),
        (0.0..0.01f64).prop_map(|v| format!("P{v:.4}")),
        Just("S300".to_owned()),
        "[A-Z0-9.$#]{0,5}",
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn every_line_end_earns_one_answer(lines in prop::collection::vec(prop::collection::vec(piece(), 0..6), 1..30)) {
        let program: String = lines.iter().map(|l| l.concat() + "\n").filter(|l| !l.contains("M0\n") && !l.contains("$C")).collect();
        // M0 waits and $C resets; neither in any spelling.
        prop_assume!(!program.contains("M0") && !program.contains("G4"));
        let mut sim = Sim::with(&[]);
        sim.stream(&program);
        let answers = sim.take();
        let count = answers.lines().filter(|l| *l == "ok" || l.starts_with("error:")).count();
        prop_assert_eq!(count, program.matches('\n').count(), "{}\n{}", program, answers);
        prop_assert_eq!(sim.machine.lost_bytes(), 0);
        prop_assert_eq!(sim.machine.position(), sim.machine.hardware().position);
    }

    #[test]
    fn arbitrary_bytes_never_panic_and_a_reset_recovers(
        chunks in prop::collection::vec((prop::collection::vec(any::<u8>(), 0..60), 0..200u16), 0..30),
        text in prop::collection::vec("[GMXYZIJKRFSPN$=.0-9 ?!~\n]{0,30}", 0..30),
    ) {
        let mut sim = Sim::with(&[]);
        for (bytes, ticks) in chunks {
            sim.send(bytes);
            sim.send("$J=X9F50\n");
            for _ in 0..ticks {
                sim.tick();
            }
        }
        for line in text {
            sim.send(line);
            for _ in 0..50 {
                sim.tick();
            }
        }
        sim.take();
        sim.send([0x18]);
        prop_assert!(sim.take().contains("Grbl 1.1h"));
        sim.send("$X\n");
        sim.settle();
        prop_assert!(sim.take().ends_with("ok\r\n"));
        prop_assert_eq!(sim.ask("G90 G21 G0 X1"), "ok\r\n");
    }
}
