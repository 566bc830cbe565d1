//! The keys while a plot goes on, at a real terminal: a pseudo terminal that controls the program, with the simulated plotter at
//! another one, by the wall's clock.
#![cfg(target_os = "linux")]

use std::fs::{self, File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use penvis::device::find;
use penvis::sim::{Pace, Pty, Recording, SimName, SimPort};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{LocalModes, Termios, Winsize, tcgetattr, tcsetwinsize};

/// Nothing that is waited for takes longer.
const PATIENCE: Duration = Duration::from_secs(60);
/// Length of each stroke of the job, mm, and how many there are.
const LENGTH: f64 = 20.0;
const STROKES: usize = 8;

/// Strokes of a second and a third each.
fn job() -> String {
    let mut text = String::from("G21\nG90\nM3 S0\nG4 P0.1\n");
    for k in 0..STROKES {
        text.push_str(&format!("G0 X0 Y{k}\nM3 S1000\nG4 P0.1\nG1 X{LENGTH} Y{k} F900\nM3 S0\nG4 P0.1\n"));
    }
    text + "G0 X0 Y0\n"
}

/// A plotter that is switched on, at a pseudo terminal that is gone when it is switched off.
struct Plotter {
    path: PathBuf,
    over: Arc<AtomicBool>,
    thread: JoinHandle<Recording>,
}

impl Plotter {
    fn switch_on() -> Self {
        let mut pty = Pty::open().unwrap();
        let path = pty.path().to_owned();
        let over = Arc::new(AtomicBool::new(false));
        let ends = Arc::clone(&over);
        let thread = thread::spawn(move || {
            let name = SimName::parse("sim").unwrap().unwrap();
            let mut sim = SimPort::with(name.peer(&find("penvis").unwrap()).unwrap(), 115_200);
            pty.serve(&mut sim, Pace::Wall, &mut |_| ends.load(Ordering::Relaxed)).unwrap();
            sim.recording()
        });
        Self { path, over, thread }
    }

    fn switch_off(self) -> Recording {
        self.over.store(true, Ordering::Relaxed);
        self.thread.join().unwrap()
    }
}

/// A terminal with a program in its foreground.
struct Terminal {
    keys: File,
    /// Held so that its settings outlive the program.
    screen: File,
    before: Termios,
    shown: Arc<Mutex<String>>,
    /// Bytes of what was shown that were looked at.
    seen: usize,
    child: Child,
}

impl Terminal {
    fn start(folder: &Path, words: &[&str]) -> Self {
        let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
        grantpt(&master).unwrap();
        unlockpt(&master).unwrap();
        let path = ptsname(&master, Vec::new()).unwrap().into_string().unwrap();
        let screen = OpenOptions::new().read(true).write(true).open(path).unwrap();
        tcsetwinsize(&screen, Winsize { ws_row: 24, ws_col: 200, ws_xpixel: 0, ws_ypixel: 0 }).unwrap();
        let before = tcgetattr(&screen).unwrap();
        let stdio = || Stdio::from(screen.try_clone().unwrap());
        // The terminal must be the one that controls the program, or it would take no keys.
        let mut command = Command::new("setsid");
        command.args(["--ctty", env!("CARGO_BIN_EXE_penvis")]).args(words).current_dir(folder);
        let child = command.stdin(stdio()).stdout(stdio()).stderr(stdio()).spawn().unwrap();
        let keys = File::from(master);
        let shown = Arc::new(Mutex::new(String::new()));
        let (mut reader, text) = (keys.try_clone().unwrap(), Arc::clone(&shown));
        thread::spawn(move || {
            let mut buffer = [0; 1024];
            while let Ok(count @ 1..) = reader.read(&mut buffer) {
                text.lock().unwrap().push_str(&String::from_utf8_lossy(&buffer[..count]));
            }
        });
        Self { keys, screen, before, shown, seen: 0, child }
    }

    fn press(&mut self, keys: &str) {
        self.keys.write_all(keys.as_bytes()).unwrap();
    }

    /// Waits until a text is shown, behind the one that was waited for before.
    fn expect(&mut self, text: &str) {
        let since = Instant::now();
        loop {
            let shown = self.shown.lock().unwrap().clone();
            if let Some(at) = shown[self.seen..].find(text) {
                self.seen += at + text.len();
                return;
            }
            assert!(since.elapsed() < PATIENCE, "{text:?} is not shown behind {}", without_bars(&shown[self.seen..]));
            thread::sleep(Duration::from_millis(5));
        }
    }

    fn is_raw(&self) -> bool {
        !tcgetattr(&self.screen).unwrap().local_modes.contains(LocalModes::ICANON)
    }

    /// Waits for the end of the program: whether it did what was asked of it. The terminal must be as it was before.
    fn end(mut self) -> (bool, String) {
        let since = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            assert!(
                since.elapsed() < PATIENCE,
                "it does not come to an end: {}",
                without_bars(&self.shown.lock().unwrap())
            );
            thread::sleep(Duration::from_millis(5));
        };
        let after = tcgetattr(&self.screen).unwrap();
        assert_eq!(
            (after.input_modes, after.output_modes, after.local_modes, after.control_modes),
            (self.before.input_modes, self.before.output_modes, self.before.local_modes, self.before.control_modes)
        );
        // What was written last is read by then.
        thread::sleep(Duration::from_millis(100));
        let shown = self.shown.lock().unwrap().clone();
        (status.success(), without_bars(&shown))
    }
}

/// What was shown but for the bar.
fn without_bars(shown: &str) -> String {
    shown.split(['\r', '\n']).filter(|line| !line.contains('░') && !line.contains('█')).collect::<Vec<_>>().join("\n")
}

impl Drop for Terminal {
    fn drop(&mut self) {
        // Of a test that failed.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("job.gcode"), job()).unwrap();
    folder
}

#[test]
fn keys_pause_hold_change_the_speed_and_the_pen_and_end_the_plot() {
    let (folder, plotter) = (folder(), Plotter::switch_on());
    let path = plotter.path.to_str().unwrap().to_owned();
    let mut terminal = Terminal::start(folder.path(), &["plot", "job.gcode", "--port", &path, "--device", "penvis"]);
    assert!(!terminal.is_raw());
    terminal.expect("space pauses at the end of the stroke");
    assert!(terminal.is_raw());
    // Within the second stroke or the third.
    thread::sleep(Duration::from_secs(3));
    terminal.press(" ");
    terminal.expect("pausing at the end of the stroke");
    terminal.expect("the plotter rests");
    for (key, text) in [
        ("u", "the pen-down level is S980"),
        ("d", "the pen-down level is S1000"),
        ("D", "the pen-up level is S20"),
        ("U", "the pen-up level is S0"),
        ("-", "speed 90 %"),
        (" ", "going on"),
    ] {
        terminal.press(key);
        terminal.expect(text);
    }
    terminal.expect("the plotter goes on");
    terminal.press("u+");
    terminal.expect("speed 100 %");
    thread::sleep(Duration::from_millis(900));
    terminal.press("  ");
    terminal.expect("pausing at the end of the stroke");
    terminal.expect("holding");
    terminal.expect("the plotter rests");
    terminal.press("u");
    terminal.expect("the pen's levels change where it is up");
    terminal.press("q");
    terminal.expect("ending the plot, pen up");
    let (done, shown) = terminal.end();
    assert!(!done && shown.contains("the job was stopped at line "), "{shown}");
    // A level changes while it rests only.
    assert_eq!(shown.matches("the pen-down level").count(), 2, "{shown}");

    // It has kept its place, and its pen is up: what is left is drawn, and nothing on the way there.
    let terminal = Terminal::start(folder.path(), &["plot", "--resume", "--port", &path]);
    let (done, shown) = terminal.end();
    assert!(done, "{shown}");
    let ink = plotter.switch_off();
    let strokes: Vec<_> = ink.traces.iter().filter(|trace| trace.pen_down).collect();
    for stroke in &strokes {
        let [first, last] = [stroke.points[0], stroke.points[stroke.points.len() - 1]];
        assert!(
            (first.y - last.y).abs() < 0.02 && (stroke.length_mm() - (last.x - first.x)).abs() < 0.02,
            "{stroke:?}"
        );
    }
    // The first pause waited for the end of its stroke, and the hold did not: one stroke at the most was broken off.
    let broken = strokes.iter().filter(|stroke| stroke.length_mm() < LENGTH - 0.05).count();
    assert!(broken <= 2 && (STROKES..=STROKES + 1).contains(&strokes.len()), "{broken} of {}", strokes.len());
}

#[test]
fn the_terminal_is_as_it_was_after_an_error() {
    let (folder, plotter) = (folder(), Plotter::switch_on());
    let path = plotter.path.to_str().unwrap().to_owned();
    let mut terminal = Terminal::start(folder.path(), &["plot", "job.gcode", "--port", &path, "--device", "penvis"]);
    terminal.expect("space pauses at the end of the stroke");
    assert!(terminal.is_raw());
    plotter.switch_off();
    let (done, shown) = terminal.end();
    assert!(!done && shown.contains("the plotter was unplugged at line "), "{shown}");
}
