//! What the steps do.

mod common;

use std::fmt::Write as _;

use common::{Event, Sim};
use penvis_firmware::Pen;
use proptest::prelude::*;

/// Steps per mm of the default settings.
const SCALE: f64 = 80.0;

/// The speed along the path in mm/s over each window of about `window` µs that does not contain a rest of more than 20 ms: (middle in µs, mm/s).
///
/// The way of a window is that of its ends; on straight paths that is the path's.
fn speeds(path: &[(u64, [i32; 3])], window: u64) -> Vec<(f64, f64)> {
    let mut out = Vec::new();
    let mut from = 0;
    for to in 1..path.len() {
        if path[to].0 - path[to - 1].0 > 20_000 {
            from = to;
        } else if path[to].0 - path[from].0 >= window {
            let mm = |axis: usize| f64::from(path[to].1[axis] - path[from].1[axis]) / SCALE;
            let way = (mm(0).powi(2) + mm(1).powi(2) + mm(2).powi(2)).sqrt();
            let time = (path[to].0 - path[from].0) as f64 * 1e-6;
            out.push(((path[to].0 + path[from].0) as f64 / 2.0, way / time));
            from = to;
        }
    }
    out
}

/// Shortest time in which each axis makes [`RUN`] steps, µs.
fn shortest_runs(sim: &Sim) -> [u64; 3] {
    let mut times: [Vec<u64>; 3] = Default::default();
    for event in sim.events() {
        if let Event::Step { at, delta } = event {
            for axis in 0..3 {
                if delta[axis] != 0 {
                    times[axis].push(*at);
                }
            }
        }
    }
    times.map(|times| times.windows(RUN + 1).map(|w| w[RUN] - w[0]).min().unwrap_or(u64::MAX))
}

/// The busiest axis of a block steps evenly; the others step at those moments that are nearest, so single steps of theirs are early
/// or late by up to one of its periods.
const RUN: usize = 20;

fn total_time(sim: &Sim) -> f64 {
    sim.path().last().map_or(0.0, |p| p.0 as f64 * 1e-6)
}

#[test]
fn one_line_takes_the_time_of_its_trapezoid() {
    // 100 mm at 100 mm/s and 1000 mm/s²: 0.1 s up, 0.9 s across, 0.1 s down.
    let mut sim = Sim::with(&[]);
    sim.stream("G1 X100 F6000\n");
    assert!((total_time(&sim) - 1.1).abs() < 0.003, "{}", total_time(&sim));
    // 1 mm never reaches 100 mm/s: 2·√(1/1000).
    let mut sim = Sim::with(&[]);
    sim.stream("G1 X1 F6000\n");
    assert!((total_time(&sim) - 2.0 * 0.001f64.sqrt()).abs() < 0.004, "{}", total_time(&sim));
    // A diagonal may use both axes' acceleration: √2 of it along the path.
    let mut sim = Sim::with(&[]);
    sim.stream("G1 X100 Y100 F6000\n");
    let (length, a) = (100.0 * 2f64.sqrt(), 1000.0 * 2f64.sqrt());
    assert!((total_time(&sim) - (length / 100.0 + 100.0 / a)).abs() < 0.003, "{}", total_time(&sim));
}

#[test]
fn speed_rises_and_falls_with_the_acceleration() {
    let mut sim = Sim::with(&[]);
    sim.stream("G1 X100 F6000\n");
    for (at, v) in speeds(&sim.path(), 5000) {
        let t = at * 1e-6;
        let end = total_time(&sim);
        let expect = (1000.0 * t).min(100.0).min(1000.0 * (end - t));
        assert!((v - expect).abs() < 4.0, "{t:.4} s: {v:.2} instead of {expect:.2} mm/s");
        assert!(v < 100.1);
    }
}

#[test]
fn slow_feeds_step_evenly() {
    let mut sim = Sim::with(&[]);
    sim.stream("G1 X1 F6\n");
    // 0.1 mm/s and 80 steps per mm: 8 steps a second.
    let path = sim.path();
    assert!(path.windows(2).all(|w| (w[1].0 - w[0].0).abs_diff(125_000) < 200), "{path:?}");
    assert!((total_time(&sim) - 10.0).abs() < 0.15);
}

#[test]
fn collinear_pieces_run_through() {
    let mut program = String::new();
    for i in 1..=200 {
        writeln!(program, "G1 X{:.3} Y{:.3} F6000", f64::from(i) * 0.5, f64::from(i) * 0.25).unwrap();
    }
    let mut sim = Sim::with(&[]);
    sim.stream(&program);
    let length = 100.0 * 1.25f64.sqrt();
    let a = 1000.0 * 1.25f64.sqrt();
    let expect = length / 100.0 + 100.0 / a;
    // The beginning has only what the port has delivered by then to plan with.
    assert!((total_time(&sim) - expect).abs() < 0.03, "{} instead of {expect}", total_time(&sim));
}

#[test]
fn chords_of_a_circle_keep_the_speed_that_the_circle_allows() {
    // Radius 50 mm at 1000 mm/s² carries √50000 = 223 mm/s; 100 are asked for.
    let mut program = String::from("G0 X100 Y50\nG4 P0.01\n");
    for i in 1..=400 {
        let t = f64::from(i) / 400.0 * std::f64::consts::TAU;
        writeln!(program, "G1 X{:.3} Y{:.3} F6000", 50.0 + 50.0 * t.cos(), 50.0 + 50.0 * t.sin()).unwrap();
    }
    let mut sim = Sim::with(&[]);
    sim.stream(&program);
    let path = sim.path();
    let start = path.windows(2).rfind(|w| w[1].0 - w[0].0 > 5_000).unwrap()[1].0;
    let time = total_time(&sim) - start as f64 * 1e-6;
    let expect = std::f64::consts::TAU * 50.0 / 100.0 + 0.1;
    assert!((time - expect).abs() < 0.06, "{time} instead of {expect}");

    // Radius 1 mm carries only √1000 = 31.6 mm/s, however fine the chords, and ⁴√2 of it where both axes share the acceleration.
    let mut program = String::from("G0 X2 Y1\nG4 P0.01\n");
    for i in 1..=1000 {
        let t = f64::from(i) / 100.0 * std::f64::consts::TAU;
        writeln!(program, "G1 X{:.4} Y{:.4} F6000", 1.0 + t.cos(), 1.0 + t.sin()).unwrap();
    }
    let mut sim = Sim::with(&[]);
    sim.stream(&program);
    let path = sim.path();
    let start = path.windows(2).rfind(|w| w[1].0 - w[0].0 > 5_000).unwrap()[1].0;
    for (at, v) in speeds(&path, 10_000).into_iter().filter(|s| s.0 > start as f64) {
        assert!(v < 1.03 * (1000.0 * 2f64.sqrt()).sqrt(), "{at}: {v} mm/s");
    }
    let time = total_time(&sim) - start as f64 * 1e-6;
    let expect = std::f64::consts::TAU * 10.0 / 1000f64.sqrt();
    assert!((0.9..1.3).contains(&(time / expect)), "{time}, at best {expect}");
}

/// Points of a curve, for its parameter from 0 to 1.
type Curve = fn(f64) -> (f64, f64);

/// The program that draws `curve` at 100 mm/s in chords of 0.02 mm.
fn short_chords(curve: Curve) -> String {
    let length: f64 = (0..10_000)
        .map(|k| {
            let (a, b) = (curve(f64::from(k) / 10_000.0), curve(f64::from(k + 1) / 10_000.0));
            (b.0 - a.0).hypot(b.1 - a.1)
        })
        .sum();
    let count = (length / 0.02) as u32;
    let (x, y) = curve(0.0);
    let mut program = format!("G0 X{x:.3} Y{y:.3}\nG4 P0.03\nG1 F6000\n");
    for k in 1..=count {
        let (x, y) = curve(f64::from(k) / f64::from(count));
        writeln!(program, "X{x:.3}Y{y:.3}").unwrap();
    }
    program
}

/// Lowest and mean speed, mm/s, of the drawing of a curve at least 10 mm from both of its ends, where none need slow down for them.
fn speed_within<const BLOCKS: usize>(curve: Curve) -> (f64, f64) {
    let mut sim: Sim<BLOCKS> = Sim::new(common::settings(&[]));
    sim.stream(&short_chords(curve));
    let path = sim.path();
    let begin = path.windows(2).position(|w| w[1].0 - w[0].0 >= 30_000).map_or(0, |i| i + 1);
    let away = |p: &[i32; 3], end: &[i32; 3]| f64::from(p[0] - end[0]).hypot(f64::from(p[1] - end[1])) > 10.0 * SCALE;
    let (first, last) = (path[begin].1, path[path.len() - 1].1);
    let from = begin + path[begin..].iter().position(|p| away(&p.1, &first)).unwrap();
    let to = path.iter().rposition(|p| away(&p.1, &last)).unwrap();
    let speeds = speeds(&path[from..to], 5000);
    let lowest = speeds.iter().map(|s| s.1).fold(f64::INFINITY, f64::min);
    (lowest, speeds.iter().map(|s| s.1).sum::<f64>() / speeds.len() as f64)
}

#[test]
fn nothing_stops_within_a_smooth_stroke_of_short_chords() {
    use std::f64::consts::TAU;
    // Each is nowhere tighter than the radius at which 1000 mm/s² carry the 100 mm/s, 10 mm.
    let line: Curve = |t| (100.0 * t, 50.0 * t);
    let circle: Curve = |t| (50.0 - 50.0 * (TAU * 0.75 * t).cos(), 50.0 * (TAU * 0.75 * t).sin());
    let spiral: Curve = |t| {
        let (r, a) = (15.0 + 30.0 * t, 2.0 * TAU * t);
        (50.0 + r * a.cos(), 50.0 + r * a.sin())
    };
    // As the rim of a teapot lies on paper, or its outline: an ellipse of 60 by 40 mm, and a wave that turns both ways.
    let rim: Curve = |t| (60.0 - 60.0 * (TAU * 0.6 * t).cos(), 40.0 * (TAU * 0.6 * t).sin());
    let wave: Curve = |t| (120.0 * t, 8.0 * (2.0 * TAU * t).sin());
    for (name, curve) in [("line", line), ("circle", circle), ("spiral", spiral), ("rim", rim), ("wave", wave)] {
        let (lowest, mean) = speed_within::<15>(curve);
        let (lowest_64, mean_64) = speed_within::<64>(curve);
        println!(
            "{name}: 15 blocks at least {lowest:.1} and {mean:.1} in the mean, 64: {lowest_64:.1}, {mean_64:.1} mm/s"
        );
        // The speed of a window is that of its chord, and the steps of a curve do not lie on it: some percent.
        assert!(lowest > 90.0 && lowest_64 > 90.0, "{name}: {lowest:.1}, {lowest_64:.1} mm/s");
        assert!(mean > 97.0 && mean_64 > 97.0, "{name}: {mean:.1}, {mean_64:.1} mm/s in the mean");
    }
}

#[test]
fn a_reversal_stops() {
    let mut sim = Sim::with(&[]);
    sim.stream("G1 X50 F6000\nX0\n");
    assert!((total_time(&sim) - 2.0 * 0.6).abs() < 0.01, "{}", total_time(&sim));
}

#[test]
fn inches_increments_and_offsets() {
    let mut sim = Sim::with(&[]);
    sim.stream("G20 G0 X1\nG21 G91 X0.6 Y-1\nG90 G92 X0 Y0\nG0 X10 Y10\nG53 X5\nG92.1\nX1\n");
    let xs: Vec<i32> = sim.path().iter().map(|p| p.1[0]).collect();
    // 25.4, 26, 36, 5, 1 mm.
    assert_eq!(xs.iter().max(), Some(&(36 * 80)));
    assert_eq!(sim.machine.position(), [80, 9 * 80, 0]);
    let mut sim = Sim::with(&[]);
    // A thousand increments of a third of a step, and of three hundredths: nothing is lost by rounding.
    sim.stream(&"G91 G1 X0.004 Y0.0003 F1000\n".repeat(1000));
    assert_eq!(sim.machine.position(), [320, 24, 0]);
}

#[test]
fn pen_moves_where_it_was_told() {
    let mut sim = Sim::with(&[(30, 1000.0)]);
    sim.stream("G0 X10\nM3 S1000\nG1 X20 F3000\nM5\nG0 X0\nM3 S500\nS250\nM30\n");
    let pens: Vec<_> = sim
        .events()
        .iter()
        .filter_map(|e| if let Event::Pen { pen, position, .. } = e { Some((*pen, position[0])) } else { None })
        .collect();
    let on = |level| Pen::On { level };
    assert_eq!(
        pens,
        [(Pen::Off, 0), (on(65535), 800), (Pen::Off, 1600), (on(32768), 0), (on(16384), 0), (Pen::Off, 0),]
    );
}

#[test]
fn the_pen_lands_softly_and_the_motors_wait() {
    // Down is S0: from 1000 to 0 in half a second, up again at once, and 50 ms to settle.
    let mut sim = Sim::with(&[(511, 2000.0), (512, 50.0)]);
    sim.stream("M3 S1000\nG0 X10\nS0\nG1 X20 F3000\nS1000\nG0 X0\n");
    let (mut levels, mut steps) = (Vec::new(), Vec::new());
    for event in sim.events() {
        match event {
            Event::Pen { at, pen: Pen::On { level }, .. } => levels.push((*at, *level)),
            Event::Step { at, .. } => steps.push(*at),
            _ => {}
        }
    }
    let landing = levels.iter().position(|(_, level)| *level < 65_535).unwrap();
    let landed = levels.iter().position(|(_, level)| *level == 0).unwrap();
    let took = levels[landed].0 - levels[landing].0;
    assert_eq!(landed - landing, 49, "{levels:?}");
    assert!((489_000..=491_000).contains(&took), "{took} µs");
    assert!(levels[landing..=landed].windows(2).all(|w| w[1].0 - w[0].0 == 10_000 && w[0].1 - w[1].1 <= 1312));
    // The motors stand from the first step of the landing until 50 ms after the last.
    let next = steps.iter().find(|at| **at > levels[landing].0).unwrap();
    assert!(*next >= levels[landed].0 + 50_000, "{next} after {}", levels[landed].0);
    assert_eq!(levels[landed..].iter().map(|l| l.1).collect::<Vec<_>>(), [0, 65_535], "and up in one go");
    // A reset lifts it at once.
    sim.send("S0\n");
    sim.run_for(200_000);
    sim.send([0x18]);
    sim.finish();
    assert!(matches!(sim.events().last(), Some(Event::Pen { pen: Pen::Off, .. })));
}

#[test]
fn laser_mode_does_not_stop() {
    let mut program = String::new();
    for i in 1..=20 {
        writeln!(program, "M{}\nG1 X{} F6000", if i % 2 == 0 { 5 } else { 3 }, i * 5).unwrap();
    }
    program.push_str("M3\n");
    let mut sim = Sim::with(&[(32, 1.0)]);
    sim.stream(&program);
    assert!((total_time(&sim) - 1.1).abs() < 0.03, "{}", total_time(&sim));
    let places: Vec<i32> = sim
        .events()
        .iter()
        .filter_map(|e| if let Event::Pen { position, .. } = e { Some(position[0]) } else { None })
        .collect();
    let expect: Vec<i32> = std::iter::once(0).chain((0..=20).map(|i| i * 400)).collect();
    assert_eq!(places, expect);
}

#[test]
fn motors_are_released_after_the_idle_delay() {
    let mut sim = Sim::with(&[(1, 100.0)]);
    sim.stream("G0 X1\n");
    let end = sim.path().last().unwrap().0;
    sim.run_for(300_000);
    let motors: Vec<_> = sim
        .events()
        .iter()
        .filter_map(|e| if let Event::Motors { at, on } = e { Some((*at, *on)) } else { None })
        .collect();
    assert_eq!(motors.iter().map(|m| m.1).collect::<Vec<_>>(), [false, true, false]);
    assert!((100_000..=102_000).contains(&(motors[2].0 - end)), "{motors:?}");
}

#[test]
fn feed_override_takes_effect_and_comes_back() {
    let mut sim = Sim::with(&[]);
    sim.send("G1 X50 F6000\nX100\nX150\n");
    sim.run_for(400_000);
    sim.send([0x92; 5]);
    sim.run_for(400_000);
    let half = speeds(&sim.path(), 20_000).last().unwrap().1;
    assert!((half - 50.0).abs() < 0.5, "{half}");
    sim.send([0x90]);
    sim.run_for(200_000);
    let full = speeds(&sim.path(), 20_000).last().unwrap().1;
    assert!((full - 100.0).abs() < 0.5, "{full}");
    sim.finish();
    assert_eq!(sim.machine.position(), [12_000, 0, 0]);
}

/// A program of straight lines, arcs and pen moves, and the target of each line.
fn program() -> impl Strategy<Value = (String, Vec<[f64; 3]>)> {
    let line = (
        0..5u8,
        -3000..3000i32,
        -3000..3000i32,
        -500..500i32,
        prop::sample::select(vec![1.0, 0.1, 0.01]),
        50.0..9000.0f64,
    );
    prop::collection::vec(line, 1..25).prop_map(|lines| {
        let (mut text, mut targets, mut at) = (String::new(), Vec::new(), [0.0f64; 3]);
        for (kind, x, y, z, scale, feed) in lines {
            // Hundredths of mm, so that text and target are the same number.
            let to = [f64::from(x) / 100.0, f64::from(y) / 100.0, f64::from(z) / 100.0]
                .map(|v| (v * scale * 100.0).round() / 100.0);
            let to = [0, 1, 2].map(|a| ((at[a] + to[a]).clamp(-40.0, 40.0) * 100.0).round() / 100.0);
            let [tx, ty, tz] = to;
            match kind {
                0 => writeln!(text, "G0 X{tx:.2} Y{ty:.2} Z{tz:.2}"),
                1 if (at[0], at[1]) != (tx, ty) => {
                    let r = (tx - at[0]).hypot(ty - at[1]) * 0.6 + 0.01;
                    writeln!(text, "G2 X{tx:.2} Y{ty:.2} Z{tz:.2} R{r:.4} F{feed:.1}")
                }
                _ => writeln!(text, "G1 X{tx:.2} Y{ty:.2} Z{tz:.2} F{feed:.1}"),
            }
            .unwrap();
            at = to;
            targets.push(to);
        }
        (text, targets)
    })
}

fn in_steps(mm: [f64; 3]) -> [i32; 3] {
    mm.map(|v| (v * SCALE).round() as i32)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn every_target_is_met_to_the_step((text, targets) in program()) {
        let mut sim = Sim::with(&[]);
        sim.stream(&text);
        let path = sim.path();
        // In order: each target is on the path, after the one before.
        let mut from = 0;
        let mut last = [0; 3];
        for target in targets.iter().map(|&t| in_steps(t)) {
            if target != last {
                let found = path[from..].iter().position(|p| p.1 == target);
                prop_assert!(found.is_some(), "{:?} missing in {}", target, text);
                from += found.unwrap();
                last = target;
            }
        }
        prop_assert_eq!(path.last().map_or([0; 3], |p| p.1), last);
        prop_assert_eq!(sim.machine.position(), last);
        // No axis ever exceeds its maximum rate: 12000 and 3000 mm/min, and a µs of the timer.
        let least = shortest_runs(&sim);
        for (axis, rate) in [(0, 12_000.0), (1, 12_000.0), (2, 3_000.0)] {
            let period = 60e6 / (rate * SCALE);
            prop_assert!(least[axis] as f64 >= (RUN as f64 - 1.0) * period - 1.0, "axis {}: {} µs", axis, least[axis]);
        }
    }

    #[test]
    fn steps_stay_beside_the_arc(r in 0.1..30.0f64, from in 0.0..6.2f64, sweep in 0.01..6.2f64, clockwise: bool) {
        let at = |t: f64| [r * t.cos() - r, r * t.sin()];
        let (start, end) = (at(from), at(if clockwise { from - sweep } else { from + sweep }));
        let mut sim = Sim::with(&[]);
        let code = if clockwise { "G2" } else { "G3" };
        sim.stream(&format!(
            "G0 X{:.6} Y{:.6}\nG4 P0.03\n{code} X{:.6} Y{:.6} I{:.6} J{:.6} F3000\n",
            start[0], start[1], end[0], end[1], -r - start[0], -start[1]
        ));
        prop_assert_eq!(sim.take(), "ok\r\nok\r\nok\r\n");
        prop_assert_eq!(sim.machine.position(), in_steps([end[0], end[1], 0.0]));
        let path = sim.path();
        let begin = path.windows(2).position(|w| w[1].0 - w[0].0 >= 30_000).map_or(0, |i| i + 1);
        // The chord's distance from the circle, half a step on each axis for its ends, half a step for Bresenham, and the rounding of the text.
        let bound = 0.002 + (0.5 * 2f64.sqrt() + 0.5) / SCALE + 1e-5;
        for (_, p) in &path[begin..] {
            let off = (f64::from(p[0]) / SCALE + r).hypot(f64::from(p[1]) / SCALE) - r;
            prop_assert!(off.abs() <= bound, "{:?} is {} off", p, off);
        }
    }

    #[test]
    fn steps_stay_beside_the_line(x in -4000..4000i32, y in -4000..4000i32) {
        let mut sim = Sim::with(&[]);
        let (x, y) = (f64::from(x) / 100.0, f64::from(y) / 100.0);
        sim.stream(&format!("G1 X{x} Y{y} F6000\n"));
        let end = in_steps([x, y, 0.0]);
        let length = f64::from(end[0]).hypot(f64::from(end[1]));
        for (_, p) in sim.path() {
            let across = (f64::from(p[0]) * f64::from(end[1]) - f64::from(p[1]) * f64::from(end[0])).abs() / length;
            prop_assert!(across <= 0.5 + 1e-9, "{:?} on the way to {:?}", p, end);
        }
    }

    #[test]
    fn holds_and_overrides_lose_no_step_and_brake_gently(
        lengths in prop::collection::vec(0.02..20.0f64, 1..20),
        feeds in prop::collection::vec(300.0..9000.0f64, 20),
        orders in prop::collection::vec((1000..200_000u64, prop::sample::select(vec![b'!', b'~', 0x90, 0x91, 0x92, 0x95, 0x96, 0x97])), 0..12),
    ) {
        // Along X only, so that the speed of X is the speed of the path, whatever the blocks.
        let (mut text, mut x) = (String::new(), 0.0);
        for (length, feed) in lengths.iter().zip(&feeds) {
            x += length;
            writeln!(text, "G{} X{x:.3} F{feed:.1}", u8::from(*feed < 6000.0)).unwrap();
        }
        let mut sim = Sim::with(&[]);
        let mut orders = orders.into_iter();
        for piece in text.lines() {
            sim.send(format!("{piece}\n"));
            if let Some((wait, order)) = orders.next() {
                sim.run_for(wait);
                sim.send([order]);
            }
            // A held machine takes only what fits.
            if sim.machine.rx_free() < 30 {
                sim.send([b'~']);
                while sim.machine.rx_free() < 30 {
                    sim.tick();
                }
            }
        }
        sim.send([b'~']);
        sim.finish();
        let end: f64 = format!("{x:.3}").parse().unwrap();
        prop_assert_eq!(sim.machine.position()[0], (end * SCALE).round() as i32);
        prop_assert_eq!(sim.machine.lost_bytes(), 0);
        // Mean speeds of windows: their difference is at most the acceleration times the distance of their middles,
        // plus two steps' worth of where a window cuts and a tread of the staircase (1000 mm/s² × 2.5 ms).
        let speeds = speeds(&sim.path(), 10_000);
        for w in speeds.windows(2) {
            let dt = (w[1].0 - w[0].0) * 1e-6;
            if dt < 0.03 {
                let change = (w[1].1 - w[0].1).abs();
                prop_assert!(change <= 1000.0 * dt * 1.05 + 5.0, "{:?} of {}", w, text);
            }
        }
    }
}

/// The motors of other kinematics draw what was asked for.
#[test]
fn crossed_belts_and_cords_draw_the_same_square() {
    // 200 steps a mm, so that steps are small beside the tolerance of a line; $12 is that of the hanging pen.
    let fine = [(100, 200.0), (101, 200.0), (110, 6000.0), (111, 6000.0), (12, 0.01)];
    let square = "G0 X50 Y100\nG4 P0.03\nG1 X250 F3000\nY300\nX50\nY100\nG2 X150 Y200 R100\n";
    // The chords of the arc, half a step for the lines that share a block, and the steps; the hanging pen's pieces besides.
    for (kind, most) in [(0.0, 0.018), (1.0, 0.018), (2.0, 0.03)] {
        let settings = common::settings(&[&fine[..], &[(500, kind)]].concat());
        let mut sim: Sim = Sim::new(settings.clone());
        sim.stream(square);
        let path = sim.path();
        let begin = path.windows(2).position(|w| w[1].0 - w[0].0 >= 30_000).map_or(0, |i| i + 1);
        let mut far = 0.0f64;
        for (_, steps) in &path[begin..] {
            let [x, y, _] = settings.pen(steps.map(f64::from));
            let side = |value: f64, at: f64| (value - at).abs();
            let edges = [side(x, 50.0), side(x, 250.0), side(y, 100.0), side(y, 300.0)];
            let arc = ((x - 150.0).hypot(y - 100.0) - 100.0).abs();
            far = far.max(edges.into_iter().fold(arc, f64::min));
        }
        println!("kinematics {kind}: at most {far:.4} mm off");
        assert!(far <= most, "kinematics {kind}: {far} mm off");
        let end = settings.pen(sim.machine.position().map(f64::from));
        assert!((end[0] - 150.0).abs() < 0.01 && (end[1] - 200.0).abs() < 0.01, "{end:?}");
        // 900 mm and a little more than 150 at 50 mm/s, and some stops.
        let seconds = (path[path.len() - 1].0 - path[begin].0) as f64 * 1e-6;
        assert!((18.8..20.5).contains(&seconds), "kinematics {kind}: {seconds} s");
        assert_eq!(sim.take(), "ok\r\n".repeat(7));
        sim.send("?");
        let report = sim.take();
        assert!(report.contains("MPos:150.00") || report.contains("MPos:149.99"), "{report}");
    }
}

#[test]
fn a_hanging_pen_does_not_go_above_its_motors() {
    let mut sim = Sim::with(&[(500, 2.0)]);
    assert_eq!(sim.ask("G0 X100 Y800"), "error:33\r\n");
    assert_eq!(sim.ask("G0 X100 Y700"), "ok\r\n");
    // Half a circle that would: it stops, and waits for a reset.
    sim.send("G2 X300 Y700 I100 F6000\n");
    sim.run_for(2_000_000);
    let answer = sim.take();
    assert!(answer.starts_with("ALARM:2"), "{answer}");
}
