//! How well the line to a plotter is used: `cargo run -p penvis-tests --release --example line_use`.
//!
//! First many short lines, for which the line is the bottleneck: the part of its rate that is used between the first and the last
//! tenth of the job. Then long ones, for which it is not: how much longer the same part takes than on a line a hundred times as
//! fast, which is the time that the planner starved. Last, lines a second through a pseudo terminal and the operating system.

use std::cell::Cell;
use std::fmt::Write as _;
use std::time::Duration;

use penvis::device::{self, Device};
use penvis::protocol::{self, Control, Outbox, Place, Progress, Protocol};
use penvis::sim::{SimName, SimPort};
use penvis::stream::{self, Clock, Observer};

const PLOTTERS: [&str; 2] = ["sim", "sim:grbl"];
/// Accelerations in mm/s² with which short lines end sooner than the next ones come: with fifteen lines to look ahead, a plotter
/// takes as many as it can come to rest in.
const ACCELERATION: &str = "$120=10000000\n$121=10000000\n";
/// Bits of a byte on the line.
const BITS: f64 = 10.0;

/// A stroke of `count` lines, each `length` mm, that runs to and fro.
fn job(count: usize, length: f64, feed: u32) -> String {
    let mut text = String::from("G21\nG90\nG17\nG94\nM3 S0\nG4 P0.15\nG0 X50 Y50\nM3 S1000\nG4 P0.2\n");
    let across = (100.0 / length) as usize;
    let mut at = (0, 0);
    for k in 0..count {
        let (row, column) = (k / across, k % across);
        at = if row % 2 == 0 { (column + 1, row) } else { (across - column - 1, row) };
        let feed = if k == 0 { format!(" F{feed}") } else { String::new() };
        let [x, y] = [50.0 + at.0 as f64 * length, 50.0 + at.1 as f64 * 0.1];
        // Writing to a string cannot fail.
        let _ = writeln!(text, "G1 X{x:.3} Y{y:.3}{feed}");
    }
    assert!(at.1 < 1000, "off the paper");
    text.push_str("M3 S0\nG4 P0.15\nM5\n");
    text
}

/// Lines of 0.02 mm for a plotter that is faster than its line.
fn hasty(count: usize) -> String {
    format!("{ACCELERATION}{}", job(count, 0.02, 12_000))
}

/// Counts the bytes of a conversation.
struct Counted<'a> {
    inner: Box<dyn Protocol>,
    bytes: &'a Cell<usize>,
}

impl Protocol for Counted<'_> {
    fn receive(&mut self, bytes: &[u8], now: Duration) {
        self.inner.receive(bytes, now);
    }
    fn tick(&mut self, now: Duration) {
        self.inner.tick(now);
    }
    fn take_output(&mut self) -> Vec<u8> {
        let output = self.inner.take_output();
        self.bytes.set(self.bytes.get() + output.len());
        output
    }
    fn outbox(&mut self) -> &mut Outbox {
        self.inner.outbox()
    }
    fn control(&mut self, control: Control, now: Duration) {
        self.inner.control(control, now);
    }
    fn progress(&self) -> Progress {
        self.inner.progress()
    }
    fn place(&self) -> Place {
        self.inner.place()
    }
}

/// Notes time, bytes and lines after the first tenth of a job, and before the last.
struct Watcher<'a> {
    clock: &'a dyn Clock,
    bytes: &'a Cell<usize>,
    first: Option<(Duration, usize, usize)>,
    last: (Duration, usize, usize),
}

impl Observer for Watcher<'_> {
    fn progress(&mut self, progress: Progress) {
        let now = (self.clock.now(), self.bytes.get(), progress.acknowledged);
        if progress.acknowledged * 10 >= progress.total && self.first.is_none() {
            self.first = Some(now);
        }
        if progress.acknowledged * 10 <= 9 * progress.total {
            self.last = now;
        }
    }
    fn message(&mut self, text: &str) {
        eprintln!("{text}");
    }
    fn control(&mut self) -> Option<Control> {
        None
    }
    fn prompt(&mut self, _: &str) -> bool {
        true
    }
    fn paused(&mut self, _: bool) {}
}

/// Seconds, bytes and lines in the middle of a plot.
fn stream(port: &mut dyn serialport::SerialPort, clock: &dyn Clock, job: &str, device: &Device) -> (f64, usize, usize) {
    let bytes = Cell::new(0);
    let inner = protocol::start(job.as_bytes(), device, device.baud).expect("a job for the device").protocol;
    let mut watcher = Watcher { clock, bytes: &bytes, first: None, last: Default::default() };
    stream::run(port, &mut Counted { inner, bytes: &bytes }, clock, &mut watcher).expect("nothing goes wrong");
    let first = watcher.first.expect("more than a line");
    let last = watcher.last;
    ((last.0 - first.0).as_secs_f64(), last.1 - first.1, last.2 - first.2)
}

fn plotter(name: &str, baud: u32) -> (SimPort, Device) {
    let sim = SimName::parse(name).expect("a simulated port").expect("its options are legal");
    let device = device::find(sim.default_device()).expect("a built-in profile");
    (SimPort::with(sim.peer(&device).expect("a device for it"), baud), device)
}

fn main() {
    println!("the line is the bottleneck: 20,000 lines of 0.02 mm at 115,200 baud");
    for name in PLOTTERS {
        let (mut port, device) = plotter(name, 115_200);
        let clock = port.clock();
        let (seconds, bytes, lines) = stream(&mut port, &clock, &hasty(20_000), &device);
        let rate = bytes as f64 / seconds;
        let used = 100.0 * rate * BITS / 115_200.0;
        println!("  {name}: {used:.1} % of the line, {:.0} lines/s, {rate:.0} bytes/s", lines as f64 / seconds);
    }
    println!("it is not: 2,000 lines of 2 mm");
    for name in PLOTTERS {
        let durations = [115_200, 11_520_000].map(|baud| {
            let (mut port, device) = plotter(name, baud);
            let clock = port.clock();
            stream(&mut port, &clock, &job(2000, 2.0, 3000), &device).0
        });
        println!("  {name}: {:.3} s, {:+.3} s for the line", durations[0], durations[0] - durations[1]);
    }
    #[cfg(unix)]
    over_a_pty();
}

/// Lines a second through a pseudo terminal, to a plotter that is as fast as they come.
#[cfg(unix)]
fn over_a_pty() {
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::thread;

    use penvis::sim::{Pace, Pty};
    use penvis::stream::WallClock;

    let (mut port, device) = plotter(PLOTTERS[1], 11_520_000);
    let mut pty = Pty::open().expect("a pseudo terminal");
    let path = pty.path().to_string_lossy().into_owned();
    let over = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| pty.serve(&mut port, Pace::Hurry, &mut |_| over.load(Ordering::Relaxed)));
        let mut port = serialport::new(&path, device.baud).open().expect("the pseudo terminal opens");
        let clock = WallClock::start();
        let (seconds, _, lines) = stream(port.as_mut(), &clock, &hasty(20_000), &device);
        over.store(true, Ordering::Relaxed);
        println!("over a pseudo terminal: {:.0} lines/s", lines as f64 / seconds);
    });
}
