//! The firmware on emulated boards: built for their processors, run in QEMU, spoken to over serial ports.
//!
//! What is needed beside a host's compiler are its bare-metal targets, `qemu-system-arm`, and for one test Python. Where something is missing the tests say so and
//! pass, unless `PENVIS_REQUIRE_EMULATOR` is set: then they fail. The figures of README are what this prints:
//!
//! ```text
//! cargo test -p penvis-tests --test emulator -- --nocapture
//! ```
#![cfg(unix)]

mod elf;
mod qemu;
mod scene;
mod sender;
mod trace;

use std::time::Duration;

use penvis::drawing::Drawing;
use penvis::emit;
use penvis::sim::Recording;
use penvis_firmware::Settings;
use penvis_tests::ink::Ink;
use penvis_tests::plotter::{draw, ink, plot_at, simulated};

use qemu::{Board, Emulator, Port};

const BOARDS: [Board; 2] = [Board::Mps2An386, Board::Mps2An500];

/// Allowed besides the length of a step, in mm.
const DEVIATION: f64 = 0.01;

/// Ticks of the emulated boards' step timer.
const TICKS_PER_US: f64 = 25.0;

/// Flash that a board may take without the core, bytes.
const FLASH_MAX: u64 = 256 * 1024;

/// Instructions that a step of two axes may take.
const STEP_MAX: f64 = 60.0;

/// Clock of an STM32F407, by which step rates are usually told.
const FAST_HZ: f64 = 168e6;

/// What the board has done so far.
fn recording(emulator: &Emulator) -> Recording {
    let [x, y, _] = Settings::default().steps_per_mm();
    trace::recording(&emulator.trace(), [1.0 / x, 1.0 / y], TICKS_PER_US).expect("a trace")
}

/// Everything drawn is in the drawing, and all of the drawing is drawn, within a step and [`DEVIATION`]; in the end the pen is up at the origin.
fn is_faithful(drawing: &Drawing, recording: &Recording) {
    let drawn = ink(recording, drawing, &simulated());
    let (wanted, got) = (Ink::new(drawing), Ink::new(&drawn));
    let one_way = |a: &Ink, b: &Ink| a.farthest_from(b).expect("there is ink").0;
    let off = one_way(&wanted, &got).max(one_way(&got, &wanted));
    let [x, y, _] = Settings::default().steps_per_mm();
    println!(
        "{:.0} mm of ink in {:.0} s of the board's time, {:?} steps, {} strokes, largest deviation {off:.4} mm",
        wanted.length_mm(),
        recording.duration_s,
        recording.steps,
        recording.lifts()
    );
    assert!(off <= 1.0 / x.min(y) + DEVIATION, "{off:.4} mm off");
    assert_eq!(recording.position, [0; 3]);
    assert!(!recording.traces.last().expect("traces").pen_down);
}

/// Boots, introduces itself, and says which firmware it is.
#[test]
fn boards_boot_and_answer() {
    for board in BOARDS {
        let Some(mut emulator) = Emulator::boot(board, Port::Line) else { return };
        assert_eq!(emulator.line().read(), "");
        assert_eq!(emulator.line().read(), "Grbl 1.1h ['$' for help]");
        let answer = emulator.line().ask("$I");
        assert!(answer[0].starts_with("[VER:1.1h.penvis:") && answer[1].starts_with("[OPT:"), "{answer:?}");
        assert_eq!(answer[2], "ok");
    }
}

/// The host's own sender, over a serial port of the system's, to the processor's own step pulses.
#[test]
fn the_teapot_is_streamed() {
    let Some(mut emulator) = Emulator::boot(Board::Mps2An386, Port::Terminal) else { return };
    let device = simulated();
    let drawing = draw(&["teapot"]).drawing;
    let job = emit::gcode(&drawing, &device).expect("G-code");
    let mut port = serialport::new(emulator.terminal(), device.baud)
        .timeout(Duration::from_millis(100))
        .open()
        .expect("QEMU's terminal opens");
    let progress = plot_at(port.as_mut(), &job, &device).expect("plotted to the end");
    assert_eq!((progress.acknowledged, progress.executed), (progress.total, progress.total));
    println!("{} lines, each acknowledged; {}", progress.total, emulator.measure(b's'));
    is_faithful(&drawing, &recording(&emulator));
}

/// A sender that nobody here has written: grbl-streamer, from the Python package index.
#[test]
fn a_published_sender_streams_a_file() {
    let Some(emulator) = Emulator::boot(Board::Mps2An386, Port::Terminal) else { return };
    let Some(python) = sender::python() else { return };
    let drawing = draw(&["pawn"]).drawing;
    let job = emit::gcode(&drawing, &simulated()).expect("G-code");
    println!("{}", sender::stream(&python, emulator.terminal(), &job));
    is_faithful(&drawing, &recording(&emulator));
}

/// Thread mode runs out of memory, and the machine goes on living.
#[test]
fn out_of_memory_ends_only_what_asked_for_it() {
    for board in BOARDS {
        let Some(mut emulator) = Emulator::boot(board, Port::Line) else { return };
        emulator.line().ask("G1 X20 Y10 F1200");
        for _ in 0..3 {
            let said = emulator.measure(b'm');
            assert!(said.starts_with("out of memory: 1000 more bytes were needed, with "), "{said}");
        }
        while !emulator.line().ask("?")[0].starts_with("<Idle|MPos:20.000,10.000,0.000|") {}
        assert_eq!(recording(&emulator).position, [1600, 800, 0]);
        println!("{}: {}, {}", board.name(), emulator.measure(b'h'), emulator.measure(b's'));
    }
}

/// What is stored is there again when the processor starts anew; and so are the defaults, once they have been restored.
#[test]
fn settings_outlive_a_reset_of_the_processor() {
    for board in BOARDS {
        let Some(mut emulator) = Emulator::boot(board, Port::Line) else { return };
        emulator.line().skip_greeting();
        let rate = |emulator: &mut Emulator| {
            let listed = emulator.line().ask("$$");
            listed.into_iter().find(|line| line.starts_with("$110=")).expect("a maximum rate")
        };
        assert_eq!(rate(&mut emulator), "$110=12000.000");
        for value in ["9000", "9500.5", "9100"] {
            assert_eq!(emulator.line().ask(&format!("$110={value}")), ["ok"]);
        }
        assert_eq!(emulator.line().ask("G10 L2 P1 X5"), ["ok"]);
        emulator.restart();
        assert_eq!(rate(&mut emulator), "$110=9100.000", "{}", board.name());
        assert_eq!(emulator.line().ask("$#")[0], "[G54:5.000,0.000,0.000]");
        assert_eq!(emulator.line().ask("$RST=*"), ["[MSG:Restoring defaults]", "ok"]);
        emulator.line().skip_greeting();
        emulator.restart();
        assert_eq!(rate(&mut emulator), "$110=12000.000", "{}", board.name());
        assert_eq!(emulator.line().ask("$#")[0], "[G54:0.000,0.000,0.000]");
    }
}

/// Finds its switches, knows where it is, and stops where one closes in motion.
#[test]
fn boards_home_and_mind_their_limits() {
    // The monitor's, in steps below the start, and the pull-off.
    let (switches, pull_off) = ([800, 2000, 400], 160);
    for board in BOARDS {
        let Some(mut emulator) = Emulator::boot(board, Port::Line) else { return };
        emulator.line().skip_greeting();
        assert_eq!(emulator.measure(b'l'), "limit switches 800 steps below X, 2000 below Y, 400 below Z");
        for setting in ["$22=1", "$44=7", "$21=1"] {
            assert_eq!(emulator.line().ask(setting), ["ok"]);
        }
        assert_eq!(emulator.line().ask("$H"), ["ok"]);
        // A switch is seen a turn of the foreground after it closes, in which an axis makes a step at the most.
        let at = recording(&emulator).position;
        let expected = switches.map(|below| pull_off - below);
        assert!((0..3).all(|axis| (at[axis] - expected[axis]).abs() <= 1), "{}: {at:?}", board.name());
        emulator.line().send(b"?");
        let report = emulator.line().read();
        assert!(report.starts_with("<Idle|MPos:-428.000,-308.000,-48.000|"), "{report}");

        assert_eq!(emulator.line().ask("G1 X-438 F600"), ["ok"]);
        while emulator.line().read() != "ALARM:1" {}
        assert_eq!(emulator.line().read(), "[MSG:Reset to continue]");
        let stopped = recording(&emulator).position;
        assert!((-810..=-800).contains(&stopped[0]), "{}: {stopped:?}", board.name());
        emulator.line().send(b"\x18");
        emulator.line().skip_greeting();
        assert_eq!(emulator.line().ask("$X").last().map(String::as_str), Some("ok"));
        assert_eq!(emulator.line().ask("G0 X-428"), ["ok"], "it may leave the switch");
    }
}

/// Images are small enough for the boards, and for what is still to come.
#[test]
fn images_fit_into_flash() {
    for board in ["mps2-an386", "mps2-an500", "pico", "black-pill"] {
        let Some(image) = qemu::image(board) else { return };
        let size = elf::size(&std::fs::read(image).expect("an image"));
        println!("{board}: {} bytes of flash, {} of RAM before the heap and the stack", size.flash, size.ram);
        assert!(size.flash <= FLASH_MAX, "{board}: {} bytes of flash", size.flash);
    }
}

/// What a step costs. QEMU counts instructions, so the figure is the same on every run.
#[test]
fn the_step_interrupt_is_short() {
    for board in BOARDS {
        let Some(mut emulator) = Emulator::boot(board, Port::Line) else { return };
        let said = emulator.measure(b't');
        let instructions: f64 = said.split(' ').next().and_then(|word| word.parse().ok()).expect("a number first");
        let rate = FAST_HZ / instructions;
        println!("{}: {said}; {rate:.0} steps/s at 168 MHz and an instruction a cycle", board.name());
        assert!(instructions <= STEP_MAX, "{}: {said}", board.name());
    }
}
