//! HPGL on the machine.

mod common;

use common::{Event, Sim};
use penvis_firmware::{HPGL_BYTES, Pen};

/// A machine that hears HPGL from the start.
fn plotter(changes: &[(u16, f64)]) -> Sim {
    let mut sim = Sim::start(common::settings(&[&[(450, 2.0), (452, 10.0)][..], changes].concat()), Default::default());
    assert_eq!(sim.take(), "", "no banner");
    sim
}

/// Pen-down lines as mm from place to place: where the pen went down, and where it went up.
fn strokes(sim: &Sim) -> Vec<[[f64; 2]; 2]> {
    let mm = |p: [i32; 3]| [f64::from(p[0]) / 80.0, f64::from(p[1]) / 80.0];
    let (mut strokes, mut down) = (Vec::new(), None);
    for event in sim.events() {
        if let Event::Pen { pen, position, .. } = event {
            match (pen, down) {
                (Pen::On { .. }, None) => down = Some(mm(*position)),
                (Pen::Off, Some(from)) => {
                    strokes.push([from, mm(*position)]);
                    down = None;
                }
                _ => {}
            }
        }
    }
    strokes
}

#[test]
fn a_drawing_and_its_answers() {
    let mut sim = plotter(&[]);
    sim.stream("IN;SP1;PU400,800;PD2000,800,2000,1600;PU;OA;OS;OE;OI;OF;OH;OP;OW;OO;OC;");
    assert_eq!(
        sim.take().split('\r').collect::<Vec<_>>(),
        [
            "2000,1600,0",
            "24",
            "0",
            "PENVIS",
            "40,40",
            "0,0,17200,12400",
            "0,0,17200,12400",
            "0,0,17200,12400",
            "0,0,0,0,0,0,0,0",
            "2000.0000,1600.0000,0",
            ""
        ]
    );
    assert_eq!(strokes(&sim), [[[10.0, 20.0], [50.0, 40.0]]]);
    assert_eq!(sim.machine.position(), [4000, 3200, 0]);
}

#[test]
fn answers_wait_for_the_pen() {
    let mut sim = plotter(&[]);
    sim.send("VS1;PD400,0;OA;");
    sim.run_for(500_000);
    assert_eq!(sim.take(), "");
    sim.send("\x1b.B");
    assert_eq!(sim.take(), format!("{HPGL_BYTES}\r"), "device control does not");
    let before = sim.machine.now();
    sim.finish();
    let seconds = (sim.machine.now() - before) as f64 * 1e-6;
    assert!((0.4..0.7).contains(&seconds), "10 mm at 1 cm/s: {seconds}");
    assert_eq!(sim.take(), "400,0,1\r");
}

#[test]
fn what_lies_outside_of_the_travel_is_not_drawn() {
    let mut sim = plotter(&[(20, 1.0), (130, 100.0), (131, 50.0)]);
    sim.stream("IN;PU2000,1000;PD6000,1000;PU-100,-100;PD500,500;PU;OA;OE;");
    assert_eq!(strokes(&sim), [[[50.0, 25.0], [100.0, 25.0]], [[0.0, 0.0], [12.5, 12.5]]]);
    assert_eq!(sim.take(), "500,500,0\r0\r");
}

#[test]
fn the_origin_is_that_of_the_work() {
    let mut sim = plotter(&[]);
    sim.stream("$J=G91X20Y10F6000\nPA;OA;");
    assert_eq!(sim.take(), "ok\r\n800,400,0\r");
    let mut sim = Sim::with(&[(452, 0.0)]);
    sim.ask("G10 L2 P1 X20 Y10");
    sim.ask("G0 X0 Y0");
    sim.stream("IN;PD400,0;PU;OA;OH;");
    assert_eq!(sim.take(), "400,0,0\r-800,-400,16400,12000\r");
    assert_eq!(strokes(&sim), [[[20.0, 10.0], [30.0, 10.0]]]);
}

#[test]
fn the_language_is_known_by_its_first_bytes() {
    for (first, answer) in [("IN;OI;", "PENVIS\r"), ("\x1b.O", "8\r"), ("in;\x1b.L", "1024\r")] {
        let mut sim = Sim::with(&[]);
        sim.stream(first);
        assert_eq!(sim.take(), answer, "{first:?}");
        // And back.
        sim.send([0x18]);
        assert_eq!(sim.take(), "\r\nGrbl 1.1h ['$' for help]\r\n");
        assert_eq!(sim.ask("G0 X1"), "ok\r\n");
    }
    // After a line, and byte by byte with turns between.
    let mut sim = Sim::with(&[]);
    assert_eq!(sim.ask("G21"), "ok\r\n");
    for byte in "IN;OI;".bytes() {
        sim.send([byte]);
    }
    assert_eq!(sim.take(), "PENVIS\r");
    // Not in the middle of one, and not where it is not asked for.
    let mut sim = Sim::with(&[]);
    sim.send("G0X1I");
    assert_eq!(sim.ask("N;"), "error:2\r\n");
    let mut sim = Sim::with(&[(450, 1.0)]);
    assert_eq!(sim.ask("IN;OI;"), "error:2\r\n");
}

#[test]
fn a_full_buffer_loses_bytes_and_says_so() {
    let mut sim = plotter(&[]);
    sim.send("\x1b.I100;0;17:\x1b.N;19:VS1;PD4000,0;OA;");
    let free = sim.machine.rx_free();
    assert_eq!(free, HPGL_BYTES);
    // Those that make moves until the planner is full are taken out; the rest waits.
    let mut sent = String::new();
    while !sent.contains('\x13') {
        sim.send("PD0,0;");
        sent += &sim.take();
    }
    assert!(sim.machine.rx_free() < 100);
    while sim.machine.rx_free() > 0 {
        sim.send(";");
    }
    sim.send(";;\x1b.E\x1b.E");
    assert_eq!((sim.take().as_str(), sim.machine.lost_bytes()), ("16\r0\r", 2));
    sim.finish();
    let said = sim.take();
    assert!(said.contains("4000,0,1\r") && said.contains('\x11'), "{said:?}");
}

#[test]
fn an_abort_stops_and_forgets() {
    let mut sim = plotter(&[]);
    sim.send("VS5;PD8000,0,8000,8000;OA;PD0,0;");
    sim.run_for(500_000);
    sim.send("\x1b.K;PU;SP0;OA;");
    sim.finish();
    let [x, y, _] = sim.machine.position();
    assert!((1600..3200).contains(&x) && y == 0, "{x} {y}");
    let units = (f64::from(x) / 2.0).round();
    assert_eq!(sim.take(), format!("{units},0,0\r"), "the answer of before is forgotten too");
    assert_eq!(strokes(&sim).len(), 1);
}

#[test]
fn a_locked_machine_answers_and_keeps_the_pen_up() {
    let mut sim = plotter(&[(21, 1.0)]);
    sim.machine.hardware_mut().switches = [None, None, None];
    sim.send("IN;VS5;PD4000,0;OE;");
    sim.run_for(500_000);
    sim.machine.hardware_mut().stuck = penvis_firmware::Axes::from_bits(1);
    sim.run_for(500_000);
    sim.send("\x1b.O");
    assert_eq!(sim.take(), "40\r", "locked, and nothing is buffered");
    assert_eq!(strokes(&sim).len(), 1, "the pen is up");
    sim.send([0x18]);
    sim.stream("PD8000,0;OE;");
    sim.send("\x1b.O");
    assert_eq!(sim.take(), "7\r40\r");
    assert_eq!(strokes(&sim).len(), 1);
    sim.machine.hardware_mut().stuck = penvis_firmware::Axes::NONE;
    sim.stream("$X\nPU0,0;OA;");
    assert_eq!(sim.take(), "[MSG:Caution: Unlocked]\r\nok\r\n0,0,0\r");
}

#[test]
fn in_homes_a_machine_that_can() {
    let mut sim = plotter(&[(22, 9.0)]);
    sim.machine.hardware_mut().switches = [Some(-2000), Some(-1000), None];
    sim.stream("IN;PD400,0;PU;OA;OE;");
    assert_eq!(sim.take(), "400,0,0\r0\r");
    assert_eq!(sim.machine.position(), [800, 0, 0]);
    assert_eq!(sim.machine.hardware().position, [-2000 + 160 + 800, -1000 + 160, 0]);
}

#[test]
fn pens_have_their_time() {
    let mut sim = plotter(&[(452, 200.0)]);
    sim.stream("PD;PU;PD;PD;");
    let pens: Vec<u64> =
        sim.events().iter().filter_map(|e| if let Event::Pen { at, .. } = e { Some(*at) } else { None }).collect();
    assert_eq!(pens.len(), 4, "up at the start, down, up, down");
    assert!(pens[1..].windows(2).all(|w| (200_000..202_000).contains(&(w[1] - w[0]))), "{pens:?}");
}
