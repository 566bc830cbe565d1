//! Whole conversations with the simulated plotter, over good lines and bad ones.

use std::io::{Read, Write};

use penvis_firmware::Settings;
use serialport::{ClearBuffer, DataBits, FlowControl, Parity, StopBits};

use super::*;
use crate::device::{Language, Streaming, find};
use crate::protocol::grbl::{Grbl, Job, Options};
use crate::sim::{Recording, SimClock, SimPort};
use crate::trace::gcode::Machine;

/// What goes wrong on the line.
#[derive(Clone, Copy, Debug)]
enum Trouble {
    /// Nothing.
    None,
    /// After so many bytes were read, every read gives nothing: the way some systems show an unplugged device.
    ReadsNothingAfter(usize),
    /// After so many bytes were read, every read and write is a broken pipe.
    BrokenPipeAfter(usize),
    /// Of every so many bytes written, one is lost.
    LosesEvery(usize),
    /// After so many bytes were read, this is read before anything else.
    SaysAfter(usize, &'static [u8]),
    /// After so many bytes were read, nothing ever comes.
    SilentAfter(usize),
    /// A write takes one byte, and every other one none.
    WritesSlowly,
    /// After so many bytes were written, no write is taken.
    TakesNothingAfter(usize),
    /// What is read first was sent before the plotter was switched on.
    SwallowsTheBanner,
}

/// A simulated plotter behind a line with a trouble.
struct FaultyPort {
    sim: SimPort,
    trouble: Trouble,
    bytes_read: usize,
    bytes_written: usize,
    calls: usize,
    sent: Vec<u8>,
}

impl FaultyPort {
    fn new(trouble: Trouble) -> Self {
        let Language::Grbl(gcode) = find("penvis").unwrap().language else { panic!("not grbl") };
        let sim = SimPort::new(Settings::default(), &gcode.pen, 115_200);
        Self { sim, trouble, bytes_read: 0, bytes_written: 0, calls: 0, sent: Vec::new() }
    }
}

impl Read for FaultyPort {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self.trouble {
            Trouble::ReadsNothingAfter(count) if self.bytes_read >= count => return Ok(0),
            Trouble::BrokenPipeAfter(count) if self.bytes_read >= count => return Err(ErrorKind::BrokenPipe.into()),
            Trouble::SaysAfter(count, text) if self.bytes_read >= count => {
                self.trouble = Trouble::None;
                buffer[..text.len()].copy_from_slice(text);
                return Ok(text.len());
            }
            _ => {}
        }
        let count = self.sim.read(buffer)?;
        self.bytes_read += count;
        match self.trouble {
            Trouble::SilentAfter(silent) if self.bytes_read >= silent => Err(ErrorKind::TimedOut.into()),
            Trouble::SwallowsTheBanner => {
                self.trouble = Trouble::None;
                Err(ErrorKind::TimedOut.into())
            }
            _ => Ok(count),
        }
    }
}

impl Write for FaultyPort {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.calls += 1;
        let taken = match self.trouble {
            Trouble::WritesSlowly if self.calls.is_multiple_of(2) => return Err(ErrorKind::TimedOut.into()),
            Trouble::WritesSlowly => &bytes[..1],
            Trouble::BrokenPipeAfter(count) if self.bytes_read >= count => return Err(ErrorKind::BrokenPipe.into()),
            Trouble::TakesNothingAfter(count) if self.bytes_written >= count => return Err(ErrorKind::TimedOut.into()),
            _ => bytes,
        };
        for byte in taken {
            self.bytes_written += 1;
            if !matches!(self.trouble, Trouble::LosesEvery(n) if self.bytes_written.is_multiple_of(n)) {
                self.sim.write_all(&[*byte])?;
            }
        }
        self.sent.extend_from_slice(taken);
        Ok(taken.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.sim.flush()
    }
}

/// Hands calls of the trait on to the simulated port.
macro_rules! forward {
    ($($name:ident(&self $(, $arg:ident: $type:ty)*) -> $result:ty;)* ; $($set:ident(&mut self $(, $value:ident: $value_type:ty)*);)*) => {
        $(fn $name(&self $(, $arg: $type)*) -> $result { self.sim.$name($($arg),*) })*
        $(fn $set(&mut self $(, $value: $value_type)*) -> serialport::Result<()> { self.sim.$set($($value),*) })*
    };
}

impl SerialPort for FaultyPort {
    forward! {
        name(&self) -> Option<String>;
        baud_rate(&self) -> serialport::Result<u32>;
        data_bits(&self) -> serialport::Result<DataBits>;
        flow_control(&self) -> serialport::Result<FlowControl>;
        parity(&self) -> serialport::Result<Parity>;
        stop_bits(&self) -> serialport::Result<StopBits>;
        timeout(&self) -> Duration;
        bytes_to_read(&self) -> serialport::Result<u32>;
        bytes_to_write(&self) -> serialport::Result<u32>;
        clear(&self, buffer: ClearBuffer) -> serialport::Result<()>;
        try_clone(&self) -> serialport::Result<Box<dyn SerialPort>>;
        set_break(&self) -> serialport::Result<()>;
        clear_break(&self) -> serialport::Result<()>;
        ;
        set_baud_rate(&mut self, baud: u32);
        set_data_bits(&mut self, bits: DataBits);
        set_flow_control(&mut self, flow: FlowControl);
        set_parity(&mut self, parity: Parity);
        set_stop_bits(&mut self, bits: StopBits);
        set_timeout(&mut self, timeout: Duration);
        write_request_to_send(&mut self, level: bool);
        write_data_terminal_ready(&mut self, level: bool);
    }

    fn read_clear_to_send(&mut self) -> serialport::Result<bool> {
        self.sim.read_clear_to_send()
    }

    fn read_data_set_ready(&mut self) -> serialport::Result<bool> {
        self.sim.read_data_set_ready()
    }

    fn read_ring_indicator(&mut self) -> serialport::Result<bool> {
        self.sim.read_ring_indicator()
    }

    fn read_carrier_detect(&mut self) -> serialport::Result<bool> {
        self.sim.read_carrier_detect()
    }
}

/// Notes what it is told, and goes on after every pause unless told otherwise.
struct Notes {
    progress: Vec<usize>,
    messages: Vec<String>,
    pauses: Vec<String>,
    goes_on: bool,
    stops_at: usize,
}

impl Observer for Notes {
    fn control(&mut self) -> Option<Control> {
        self.progress.last().is_some_and(|count| *count >= self.stops_at).then_some(Control::Stop)
    }

    fn paused(&mut self, _rests: bool) {}

    fn progress(&mut self, progress: Progress) {
        self.progress.push(progress.acknowledged);
    }

    fn message(&mut self, text: &str) {
        self.messages.push(text.to_owned());
    }

    fn prompt(&mut self, comment: &str) -> bool {
        self.pauses.push(comment.to_owned());
        self.goes_on
    }
}

struct Outcome {
    result: Result<(), StreamError>,
    recording: Recording,
    notes: Notes,
    used_max: usize,
    sent: Vec<u8>,
}

impl Outcome {
    /// The message of the failure, which must be one.
    fn message(&self) -> String {
        self.result.as_ref().unwrap_err().to_string()
    }
}

/// A clock that also runs on when the simulated one stands, as no virtual time passes in a write that is not taken.
struct Restless(SimClock, std::cell::Cell<u32>);

impl Clock for Restless {
    fn now(&self) -> Duration {
        self.1.set(self.1.get() + 1);
        self.0.now() + Duration::from_micros(10) * self.1.get()
    }
}

fn options() -> Options {
    Options {
        rx_bytes: 128,
        line_limit: 79,
        streaming: Streaming::CharacterCounting,
        machine: Machine::of(&find("penvis").unwrap()).unwrap(),
        servo: true,
        lift: vec!["M3S0".into()],
        baud: 115_200,
    }
}

fn plot_with(gcode: &str, trouble: Trouble, goes_on: bool, stops_at: usize) -> Outcome {
    let mut port = FaultyPort::new(trouble);
    let mut grbl = Grbl::new(Job::new(gcode, 79).unwrap(), options());
    let clock = Restless(port.sim.clock(), Default::default());
    let mut notes = Notes { progress: Vec::new(), messages: Vec::new(), pauses: Vec::new(), goes_on, stops_at };
    let result = run(&mut port, &mut grbl, &clock, &mut notes);
    Outcome { result, recording: port.sim.recording(), notes, used_max: grbl.used_max(), sent: port.sent }
}

fn plot(gcode: &str, trouble: Trouble) -> Outcome {
    plot_with(gcode, trouble, true, usize::MAX)
}

/// Many short lines round a circle, `n` of them.
fn circle(n: u32) -> String {
    let mut gcode = String::from("G21G90\nF6000\n");
    for i in 0..n {
        let angle = f64::from(i) / f64::from(n) * std::f64::consts::TAU;
        gcode.push_str(&format!("G1X{:.3}Y{:.3}\n", 100.0 + 50.0 * angle.cos(), 100.0 + 50.0 * angle.sin()));
    }
    gcode.push_str("G1X12.5Y7.25\n");
    gcode
}

#[test]
fn ten_thousand_short_lines_arrive() {
    let outcome = plot(&circle(10_000), Trouble::None);
    outcome.result.unwrap();
    assert_eq!(outcome.recording.lost_bytes, 0);
    assert_eq!(outcome.recording.position, [1000, 580, 0]);
    assert_eq!(outcome.notes.progress.last(), Some(&10_003));
    assert!(outcome.notes.progress.is_sorted());
    // Never more than the buffer holds, and it is made use of.
    assert!((100..=127).contains(&outcome.used_max), "{}", outcome.used_max);
    assert!(!outcome.sent.contains(&b'\r'));
}

#[test]
fn the_end_is_when_the_pen_rests() {
    // 100 mm at 10 mm/s; all of it fits the planner at once.
    let outcome = plot("G1X100F600\n", Trouble::None);
    outcome.result.unwrap();
    assert!((10.0..10.6).contains(&outcome.recording.duration_s), "{}", outcome.recording.duration_s);
    assert_eq!(outcome.recording.position, [8000, 0, 0]);
}

#[test]
fn windows_line_ends_and_comments_change_nothing() {
    let plain = plot("G1X10F600\nG1Y10\n", Trouble::None);
    let decorated = plot("%\r\n(a ! ? ~ \u{18})\r\ng1 x10 f600 ; µ\r\n\r\nG1 Y10\r\n", Trouble::None);
    decorated.result.unwrap();
    assert_eq!(plain.recording.traces, decorated.recording.traces);
    assert!(!decorated.sent.contains(&b'\r'));
}

#[test]
fn a_refused_line_is_named_and_the_pen_is_up() {
    let outcome = plot("G1X1F600\nM3S1000\nG4P0.1\nG1X20\nG5Y1\nG1X99\n", Trouble::None);
    let message = outcome.message();
    for word in ["line 5", "`G5Y1`", "error 20"] {
        assert!(message.contains(word), "{message}");
    }
    assert!(outcome.recording.position[0] < 99 * 80, "it went on");
    assert!(outcome.sent.ends_with(b"M3S0\n"), "the pen was left down");
}

#[test]
fn what_the_plotter_says_in_the_job_ends_it() {
    let table: &[(&'static [u8], &[&str])] = &[
        (b"error:20\r\n", &["line ", "error 20", "unsupported"]),
        (b"ALARM:1\r\n", &["line ", "alarm 1", "limit switch"]),
        (b"\r\nGrbl 1.1h ['$' for help]\r\n", &["line ", "restarted"]),
    ];
    for (text, words) in table {
        let message = plot(&circle(300), Trouble::SaysAfter(1200, text)).message();
        for word in *words {
            assert!(message.contains(word), "{message}");
        }
    }
}

#[test]
fn unplugging_is_told_with_the_line() {
    for trouble in [Trouble::ReadsNothingAfter(1200), Trouble::BrokenPipeAfter(1200)] {
        let message = plot(&circle(1000), trouble).message();
        assert!(message.starts_with("the plotter was unplugged at line "), "{message}");
        assert!(message.contains("(`G1X"), "{message}");
    }
    let message = plot("G0\n", Trouble::ReadsNothingAfter(0)).message();
    assert_eq!(message, "the plotter was unplugged before the first line");
}

#[test]
fn silence_is_bounded() {
    let outcome = plot(&circle(1000), Trouble::SilentAfter(1200));
    assert!(outcome.message().contains("fallen silent at line"), "{}", outcome.message());
    let message = plot("G0\n", Trouble::SilentAfter(0)).message();
    assert!(message.contains("no answer from the plotter"), "{message}");
}

#[test]
fn lost_bytes_do_not_go_unnoticed() {
    // Whatever a loss makes of the lines, the job does not end as if it were drawn.
    for every in [97, 211, 1009] {
        let outcome = plot(&circle(1000), Trouble::LosesEvery(every));
        let position = outcome.recording.position;
        assert!(outcome.result.is_err() || position == [1000, 580, 0], "every {every}: {position:?}");
    }
}

#[test]
fn a_line_that_takes_a_byte_at_a_time_is_slow_and_right() {
    let outcome = plot(&circle(200), Trouble::WritesSlowly);
    outcome.result.unwrap();
    assert_eq!((outcome.recording.lost_bytes, outcome.recording.position), (0, [1000, 580, 0]));
}

#[test]
fn a_line_that_takes_nothing_is_given_up() {
    let message = plot(&circle(200), Trouble::TakesNothingAfter(600)).message();
    assert!(message.contains("takes no more bytes at line"), "{message}");
}

#[test]
fn a_missing_banner_is_no_hindrance() {
    let outcome = plot(&circle(10), Trouble::SwallowsTheBanner);
    outcome.result.unwrap();
    assert_eq!(outcome.recording.position, [1000, 580, 0]);
    assert!(outcome.sent.starts_with(b"?#\n$I\n"));
}

#[test]
fn a_pause_asks_its_user() {
    let gcode = "G1X10F600\nM0 (pen 2)\nG1X20\n";
    let outcome = plot(gcode, Trouble::None);
    outcome.result.unwrap();
    assert_eq!(outcome.notes.pauses, ["pen 2"]);
    assert_eq!(outcome.recording.position, [1600, 0, 0]);

    let outcome = plot_with(gcode, Trouble::None, false, usize::MAX);
    assert!(outcome.message().contains("stopped"), "{}", outcome.message());
    assert_eq!(outcome.recording.position, [800, 0, 0]);
}

#[test]
fn the_ink_is_where_the_lines_are() {
    let outcome = plot("G0X10Y10\nM3S1000\nG4P0.2\nG1X30Y10F3000\nG1X30Y25\nM3S0\nG4P0.2\nG0X0Y0\n", Trouble::None);
    outcome.result.unwrap();
    let recording = outcome.recording;
    assert_eq!(recording.lifts(), 1);
    // Half a step at the corner.
    assert!((recording.ink_mm() - 35.0).abs() < 0.02, "{}", recording.ink_mm());
    let expected = 200.0_f64.sqrt() + (30.0_f64 * 30.0 + 25.0 * 25.0).sqrt();
    assert!((recording.travel_mm() - expected).abs() < 0.02, "{}", recording.travel_mm());
}

#[test]
fn lines_that_share_a_block_count_when_they_are_drawn() {
    let line = |k: u32| f64::from(k) * 0.5 + 10.0;
    let mut gcode = String::from("G21G90\nM3S0\nG4P0.15\nG0X10Y10\nM3S1000\nG4P0.2\n");
    gcode.extend((1..=600).map(|k| format!("G1X{:.1}Y10F3000\n", line(k))));
    let before = 6;
    let mut port = FaultyPort::new(Trouble::None).sim;
    let clock = port.clock();
    let mut grbl = Grbl::new(Job::new(&(gcode + "M3S0\nG4P0.15\n"), 79).unwrap(), options());
    let (mut seen, mut input) = (vec![0], [0; 512]);
    port.set_timeout(READ_WAIT).unwrap();
    while clock.now() < Duration::from_secs(60) && grbl.take_event() != Some(Event::Done) {
        grbl.tick(clock.now());
        port.write_all(&grbl.take_output()).unwrap();
        if let Ok(count) = port.read(&mut input) {
            grbl.receive(&input[..count], clock.now());
        }
        let executed = grbl.progress().executed;
        if executed > before && executed > seen[seen.len() - 1] {
            seen.push(executed);
            let drawn = port.recording().position[0] as f64 / 80.0;
            let told = line((executed.min(before + 600) - before) as u32);
            assert!(drawn > told - 0.02, "{executed} lines executed, to {told} mm, and the pen is at {drawn} mm");
        }
    }
    assert_eq!(seen.last(), Some(&608));
    assert!(seen.len() > 10, "told at its end only: {seen:?}");
}

#[test]
fn stopping_keeps_the_position_and_lifts_the_pen() {
    let gcode = format!("M3S1000\nG4P0.2\n{}", circle(1000));
    let outcome = plot_with(&gcode, Trouble::None, true, 100);
    assert!(outcome.message().starts_with("the job was stopped at line 1"), "{}", outcome.message());
    assert_eq!(outcome.sent.iter().filter(|byte| **byte == b'!').count(), 1);
    assert!(outcome.sent.ends_with(b"\x18M3S0\n"), "{:?}", String::from_utf8_lossy(&outcome.sent));
    assert!(!outcome.notes.messages.iter().any(|text| text.contains("unlock")), "the position was lost");
    assert_eq!(outcome.recording.lifts(), 1);
}
