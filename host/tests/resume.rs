//! A plot whose program is killed at any moment, again and again, and goes on each time: the ink is that of a plot that nobody
//! disturbed.
//!
//! The plotter is the simulated one at a pseudo terminal, in the time of the wall. It is never switched off: what it had in its
//! buffers it draws to the end, as a real one does. `PENVIS_KILLS` sets how often each kind is killed.
#![cfg(unix)]

use std::env;
use std::fs;
use std::io::{ErrorKind, Read, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use glam::DVec2;
use penvis::device::find;
use penvis::sim::{Recording, SimName, SimPort};
use penvis::stream::Clock;
use serialport::{SerialPort, TTYPort};

/// Kills in all, unless the environment says otherwise.
const KILLS: u32 = 2;
/// Kills of one plot, at the most; then it is let go to its end.
const KILLS_A_PLOT: u32 = 4;
/// Plots for a kill that is to meet a program at work, at the most.
const PLOTS_A_KILL: u32 = 10;
/// A plot, or what is left of one, takes no longer.
const PATIENCE: Duration = Duration::from_secs(120);
/// So much of the time of the wall the plotter makes good at a time.
const LAG_MAX: Duration = Duration::from_millis(100);
/// Half the diagonal of a step, and what a corner is rounded by where the pen does not stop.
const TOLERANCE_MM: f64 = 0.05;
/// Distance between the places at which ink is compared.
const SPACING_MM: f64 = 0.25;

/// A kind of plotter, and how a drawing is said to it.
#[derive(Clone, Copy)]
struct Kind {
    port: &'static str,
    device: &'static str,
    file: &'static str,
    /// Time from power on until it listens.
    boots: Duration,
    begin: &'static str,
    end: &'static str,
    write: fn(&mut String, &[DVec2]),
}

const FIRMWARE: Kind = Kind {
    port: "sim",
    device: "penvis",
    file: "job.gcode",
    boots: Duration::ZERO,
    begin: "G21\nG90\nG17\nG94\nM3 S0\nG4 P0.05\n",
    end: "G0 X0 Y0\nM5\n",
    write: |text, points| gcode(text, points, ["M3 S1000\nG4 P0.05\n", "M3 S0\nG4 P0.05\n"]),
};

/// It homes: Marlin does not tell whether it has been switched off meanwhile.
const MARLIN: Kind = Kind {
    port: "sim:marlin",
    device: "marlin-servo",
    file: "job.gcode",
    boots: Duration::ZERO,
    begin: "G21\nG90\nM280 P0 S90\nG4 P200\nG28 X Y\n",
    end: "G0 X0 Y0 F9000\nM400\n",
    write: |text, points| {
        gcode(text, points, ["M400\nM280 P0 S30\nG4 P50\n", "M400\nM280 P0 S90\nG4 P50\n"]);
    },
};

const HPGL: Kind = Kind {
    port: "sim:hpgl7475a",
    device: "hp7475a",
    file: "job.plt",
    boots: Duration::from_millis(1100),
    begin: "IN;SP1;VS10;",
    end: "PU0,0;SP0;",
    write: |text, points| {
        let units: Vec<_> =
            points.iter().map(|p| format!("{},{}", (p.x / 0.025).round(), (p.y / 0.025).round())).collect();
        text.push_str(&format!("PU{};", units[0]));
        for list in units[1..].chunks(8) {
            text.push_str(&format!("PD{};", list.join(",")));
        }
        text.push_str(if units.len() == 1 { "PD;PU;" } else { "PU;" });
    },
};

/// A stroke in G-code, with what lowers and lifts the pen.
fn gcode(text: &mut String, points: &[DVec2], [lower, lift]: [&str; 2]) {
    text.push_str(&format!("G0 X{:.3} Y{:.3} F9000\n{lower}", points[0].x, points[0].y));
    for (k, point) in points.iter().enumerate().skip(1) {
        let feed = if k == 1 { " F9000" } else { "" };
        text.push_str(&format!("G1 X{:.3} Y{:.3}{feed}\n", point.x, point.y));
    }
    text.push_str(lift);
}

impl Kind {
    /// A drawing: rows of waves, each a stroke, and a dot between them.
    fn job(&self, rows: u32) -> String {
        let mut text = self.begin.to_owned();
        for row in 0..rows {
            let y = 5.0 + 6.0 * f64::from(row);
            let wave = |k: u32| DVec2::new(5.0 + f64::from(k), y + 2.0 * (f64::from(k) * 0.4 + f64::from(row)).sin());
            (self.write)(&mut text, &(0..60).map(wave).collect::<Vec<_>>());
            (self.write)(&mut text, &[DVec2::new(70.0, y)]);
        }
        text + self.end
    }
}

/// A plotter at a pseudo terminal, served by a thread.
struct Plotter {
    path: String,
    over: Arc<AtomicBool>,
    thread: JoinHandle<Recording>,
}

impl Plotter {
    fn switch_on(kind: Kind) -> Self {
        let (mut master, slave) = TTYPort::pair().unwrap();
        let path = slave.name().unwrap();
        let over = Arc::new(AtomicBool::new(false));
        let ends = Arc::clone(&over);
        let thread = thread::spawn(move || {
            // Held until all is over: without it, the master sees the end of every user of the slave.
            let _slave = slave;
            let device = find(kind.device).unwrap();
            let name = SimName::parse(kind.port).unwrap().unwrap();
            let mut sim = SimPort::with(name.peer(&device).unwrap(), device.baud);
            let clock = sim.clock();
            let mut buffer = [0; 256];
            sim.set_timeout(Duration::from_millis(1)).unwrap();
            while clock.now() < kind.boots {
                let _ = sim.read(&mut buffer);
            }
            let (begun, mut since) = (clock.now(), Instant::now());
            master.set_timeout(Duration::from_millis(1)).unwrap();
            while !ends.load(Ordering::Relaxed) {
                match master.read(&mut buffer) {
                    Ok(count) => sim.write_all(&buffer[..count]).unwrap(),
                    Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
                    Err(e) => panic!("the pseudo terminal failed: {e}"),
                }
                // On a machine that is too busy for it the plotter is slow, and not deaf.
                let behind = since.elapsed().saturating_sub(clock.now() - begun);
                since += behind.saturating_sub(LAG_MAX);
                let until = begun + since.elapsed();
                while clock.now() < until {
                    if let Ok(count) = sim.read(&mut buffer) {
                        // Nobody reads while the program is dead; what does not fit is lost, as on a wire.
                        let _ = master.write(&buffer[..count]);
                    }
                }
            }
            sim.recording()
        });
        Self { path, over, thread }
    }

    fn switch_off(self) -> Recording {
        self.over.store(true, Ordering::Relaxed);
        self.thread.join().unwrap()
    }
}

/// Numbers that are the same in every run.
struct Random(u64);

impl Random {
    /// From 0 to 1.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn penvis(folder: &Path, words: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_penvis"));
    command.args(words).current_dir(folder).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    command.spawn().unwrap()
}

/// Waits for the end of a program. What it said, and whether it did what was asked of it.
fn end(mut child: Child) -> (bool, String) {
    let since = Instant::now();
    while child.try_wait().unwrap().is_none() {
        assert!(since.elapsed() < PATIENCE, "it does not come to an end");
        thread::sleep(Duration::from_millis(10));
    }
    let mut said = String::new();
    child.stderr.take().unwrap().read_to_string(&mut said).unwrap();
    (child.wait().unwrap().success(), said)
}

/// Plots a job on a plotter of its own, kills the program after each of these times, and has it go on. The ink, and how often
/// the blow met a program that was at work.
fn plot(kind: Kind, job: &str, kills: &[Duration], overlap: &str) -> (Recording, u32) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join(kind.file), job).unwrap();
    let plotter = Plotter::switch_on(kind);
    let begin = ["plot", kind.file, "--port", &plotter.path, "--device", kind.device];
    let go_on = ["plot", "--resume", "--overlap", overlap, "--port", &plotter.path];
    let mut child = penvis(folder.path(), &begin);
    let (mut first, mut struck) = (true, 0);
    for kill in kills {
        thread::sleep(*kill);
        if child.try_wait().unwrap().is_some() {
            let (done, said) = end(child);
            if done {
                return (plotter.switch_off(), struck);
            }
            child = at_zero(folder.path(), &go_on, &said);
            continue;
        }
        struck += 1;
        child.kill().unwrap();
        child.wait().unwrap();
        let journal = folder.path().join(format!("{}.journal", kind.file));
        if !journal.exists() && fs::read_dir(folder.path()).unwrap().count() == 1 {
            // It had not begun, or was done before the blow.
            if !first {
                return (plotter.switch_off(), struck);
            }
            child = penvis(folder.path(), &begin);
            continue;
        }
        first = false;
        if let Ok(contents) = penvis::journal::read(&journal) {
            let executed = contents.last.map_or(0, |last| last.executed);
            println!("killed after {kill:?}, with {executed} of {} lines noted", contents.head.pieces);
        }
        // A journal that was not finished is none.
        child = if journal.exists() { penvis(folder.path(), &go_on) } else { penvis(folder.path(), &begin) };
    }
    let (mut done, mut said) = end(child);
    if !done {
        (done, said) = end(at_zero(folder.path(), &go_on, &said));
    }
    assert!(done, "killed after {kills:?}: {said}");
    assert!(!folder.path().join(format!("{}.journal", kind.file)).exists());
    (plotter.switch_off(), struck)
}

/// Goes on with a plot whose program was killed before the pen had left the zero: the plotter cannot tell that from being switched
/// on, and so the program asked for this.
fn at_zero(folder: &Path, go_on: &[&str], said: &str) -> Child {
    assert!(said.contains("--at-zero"), "{said}");
    penvis(folder, &[go_on, &["--at-zero"]].concat())
}

/// Places along the ink, and whether each is within the tolerance of the other ink.
fn uncovered(ink: &Recording, other: &Recording) -> Option<DVec2> {
    let segments = |recording: &Recording| -> Vec<[DVec2; 2]> {
        let drawn = recording.traces.iter().filter(|trace| trace.pen_down);
        drawn.flat_map(|trace| trace.points.windows(2).map(|w| [w[0], w[1]]).collect::<Vec<_>>()).collect()
    };
    let others = segments(other);
    let places = segments(ink).into_iter().flat_map(|[a, b]| {
        let count = (a.distance(b) / SPACING_MM).ceil().max(1.0) as usize;
        (0..=count).map(move |i| a.lerp(b, i as f64 / count as f64))
    });
    let to_segment = |p: DVec2, [a, b]: [DVec2; 2]| {
        let d = b - a;
        let along = if d == DVec2::ZERO { 0.0 } else { ((p - a).dot(d) / d.length_squared()).clamp(0.0, 1.0) };
        p.distance(a + d * along)
    };
    places.into_iter().find(|&p| others.iter().all(|&segment| to_segment(p, segment) > TOLERANCE_MM))
}

/// Kills the plots of one kind of plotter as often as is asked for.
fn kill_and_go_on(kind: Kind) {
    let kills: u32 = env::var("PENVIS_KILLS").ok().and_then(|count| count.parse().ok()).unwrap_or(KILLS);
    let rows = if kills > KILLS { 6 } else { 3 };
    let (name, job, lifts) = (kind.port, kind.job(rows), 2 * rows as usize);
    let since = Instant::now();
    let (undisturbed, _) = plot(kind, &job, &[], "0");
    let took = since.elapsed();
    println!("{name}: undisturbed: {took:?}");
    assert_eq!((undisturbed.lifts(), undisturbed.lost_bytes), (lifts, 0));
    let mut random = Random(7);
    let (mut left, mut most, mut plots) = (kills, 0.0_f64, 0);
    while left > 0 {
        plots += 1;
        assert!(plots <= kills * PLOTS_A_KILL, "the blows meet no program");
        let count = left.min(1 + (random.next() * f64::from(KILLS_A_PLOT)) as u32);
        let times: Vec<_> = (0..count).map(|_| took.mul_f64(random.next())).collect();
        let overlap = if random.next() < 0.5 { "0" } else { "1.5" };
        let (ink, struck) = plot(kind, &job, &times, overlap);
        left -= struck;
        assert_eq!(uncovered(&undisturbed, &ink), None, "{name}: left out, killed after {times:?}");
        assert_eq!(uncovered(&ink, &undisturbed), None, "{name}: drawn too much, killed after {times:?}");
        assert_eq!(ink.lost_bytes, 0);
        most = most.max(ink.ink_mm() / undisturbed.ink_mm() - 1.0);
        println!("{name}: {struck} kills, {left} left: {:.1} of {:.1} mm", ink.ink_mm(), undisturbed.ink_mm());
    }
    println!("{name}: {kills} kills; at most {:.1} % of the ink was drawn twice", 100.0 * most);
}

#[test]
fn a_killed_plot_goes_on_to_the_same_ink() {
    kill_and_go_on(FIRMWARE);
}

#[test]
fn a_killed_plot_goes_on_to_the_same_ink_on_marlin() {
    kill_and_go_on(MARLIN);
}

#[test]
fn a_killed_plot_goes_on_to_the_same_ink_on_hpgl() {
    kill_and_go_on(HPGL);
}

#[test]
fn a_plot_that_was_broken_off_is_not_begun_anew_by_mistake() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("job.gcode"), FIRMWARE.job(2)).unwrap();
    let plotter = Plotter::switch_on(FIRMWARE);
    let begin = ["plot", "job.gcode", "--port", &plotter.path, "--device", "penvis"];
    let journal = folder.path().join("job.gcode.journal");
    let mut child = penvis(folder.path(), &begin);
    let since = Instant::now();
    while !journal.exists() && since.elapsed() < PATIENCE {
        thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let (done, said) = end(penvis(folder.path(), &begin));
    assert!(!done && said.contains("--resume") && said.contains("--restart"), "{said}");
    let (done, said) = end(penvis(folder.path(), &[&begin[..], &["--restart"]].concat()));
    assert!(done && !journal.exists(), "{said}");
    let (done, said) = end(penvis(folder.path(), &["plot", "--resume", "--port", &plotter.path]));
    assert!(!done && said.starts_with("error: there is no journal in this folder"), "{said}");
    assert_eq!(plotter.switch_off().lifts(), 4);
}
