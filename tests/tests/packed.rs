//! Scenes packed for boards: what they draw is what the program draws, to the bit, however little memory there is.

use std::io::{Read, Write};
use std::time::Duration;

use penvis::builtin;
use penvis::compute::load;
use penvis::progress::Progress;
use penvis::sim::SimPort;
use penvis::store::{lines, store};
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_firmware::scene::{StoredScene, draw};
use penvis_tests::ink::Ink;
use penvis_tests::plotter::{draw as draw_model, ink, options, port, simulated};
use serialport::SerialPort;

/// The packed scene of what `penvis draw` with these words draws.
fn packed(words: &[&str]) -> Vec<u8> {
    let (options, progress) = (options(words), Progress::start());
    let loaded = load(&options, &progress).expect("the model can be read");
    store(loaded, &simulated()).expect("a board could draw it").pack().expect("it can be packed")
}

/// FNV-1a over the coordinates on the screen, beside the firmware's own.
fn hash(points: impl Iterator<Item = [f64; 2]>) -> u64 {
    let bytes = points.flatten().flat_map(f64::to_le_bytes);
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[test]
fn packed_models_are_drawn_to_the_bit_as_the_models_are() {
    for (name, _) in builtin::names() {
        let bytes = packed(&[name]);
        let stored = StoredScene::unpack(&bytes).expect("it was packed");
        let model = builtin::load(name).expect("a built-in model");
        assert_eq!(stored.scene.surfaces, model.scene.surfaces, "{name}");
        let camera = model.view.camera().expect("a camera");
        let prepared = Prepared::new(&model.scene, &camera, &DrawOptions::default(), &()).expect("a picture");
        let strokes = prepared.trace(stored.tolerance, &()).expect("nothing stops it").strokes;
        let expected = hash(strokes.iter().flat_map(|s| &s.points).map(|p| p.screen.to_array()));
        for cells in [0, 500] {
            let figures = draw(&bytes, cells, &(), &mut |_| true).expect("it can be drawn");
            println!("{name}, {cells} cells: {figures:x?}, {} bytes", bytes.len());
            assert_eq!(figures.strokes as usize, strokes.len(), "{name}, {cells} cells");
            assert_eq!(figures.hash, expected, "{name}, {cells} cells");
        }
    }
}

#[test]
fn sections_and_hidden_curves_survive_packing() {
    for words in [&["linked_tori", "--hidden", "layer"][..], &["teapot", "--curves", "crease,intersection"]] {
        let bytes = packed(words);
        let once = draw(&bytes, 0, &(), &mut |_| true).expect("it can be drawn");
        let stored = StoredScene::unpack(&bytes).expect("it was packed");
        let again = draw(&stored.pack().expect("it was packed before"), usize::MAX, &(), &mut |_| true);
        assert_eq!(again.expect("it can be drawn"), once, "{words:?}");
        assert!(once.strokes > 5, "{words:?}: {once:?}");
    }
}

/// Reads of a simulated port that hear nothing, each a tenth of a second of its time, after which an answer does not come any more.
const MOST_SILENCE: usize = 20_000;

/// Sends a line and hears what comes until its answer, that included.
fn tell(port: &mut SimPort, line: &str) -> String {
    port.write_all(format!("{line}\n").as_bytes()).expect("the line takes it");
    hear(port, |heard| heard.ends_with("ok\r\n") || heard.contains("error:") && heard.ends_with("\r\n"))
}

fn hear(port: &mut SimPort, is_all: impl Fn(&str) -> bool) -> String {
    let (mut heard, mut silence) = (String::new(), 0);
    let mut buffer = [0; 64];
    while !is_all(&heard) {
        match port.read(&mut buffer) {
            Ok(count) => heard.push_str(&String::from_utf8_lossy(&buffer[..count])),
            Err(_) => silence += 1,
        }
        assert!(silence < MOST_SILENCE, "no answer, but {heard:?}");
    }
    heard
}

/// Sends a scene to a machine that has said its banner.
fn send(port: &mut SimPort, bytes: &[u8]) {
    for line in lines(bytes).lines() {
        assert_eq!(tell(port, line), "ok\r\n");
    }
}

fn switched_on() -> SimPort {
    let mut port = port(&simulated());
    port.set_timeout(Duration::from_millis(100)).expect("any time will do");
    hear(&mut port, |heard| heard.ends_with("help]\r\n"));
    port
}

#[test]
fn a_machine_draws_a_scene_that_was_sent_to_it() {
    let bytes = packed(&["pawn"]);
    let mut port = switched_on();
    send(&mut port, &bytes);
    assert_eq!(tell(&mut port, "$PV"), format!("[PV:{},65536,0]\r\nok\r\n", bytes.len()));
    let figures = draw(&bytes, 0, &(), &mut |_| true).expect("it can be drawn");
    let expected = format!("[PV:{},{},{:016x},0,0]\r\nok\r\n", figures.strokes, figures.points, figures.hash);
    assert_eq!(tell(&mut port, "$PV=TRACE"), expected);
    assert_eq!(port.recording().lifts(), 0);
    assert_eq!(tell(&mut port, "$PV=DRAW"), expected);
    // Nothing waits for the last motion but this.
    assert_eq!(tell(&mut port, "G4 P0"), "ok\r\n");

    let device = simulated();
    let (drawing, recording) = (draw_model(&["pawn"]).drawing, port.recording());
    assert_eq!((recording.lost_bytes, &recording.position[..2]), (0, &[0, 0][..]));
    let drawn = ink(&recording, &drawing, &device);
    let (wanted, got) = (Ink::new(&drawing), Ink::new(&drawn));
    let off = |a: &Ink, b: &Ink| a.farthest_from(b).expect("there is ink").0;
    let farthest = off(&wanted, &got).max(off(&got, &wanted));
    // A step of 1/80 mm besides the planner's own slack.
    assert!(farthest <= 0.02 + 1.0 / 80.0, "{farthest:.4} mm off");
}

#[test]
fn a_drawing_is_held_goes_on_and_is_ended_by_a_reset() {
    let mut port = switched_on();
    send(&mut port, &packed(&["saddle", "--iso", "3"]));
    port.write_all(b"$PV=DRAW\n").expect("the line takes it");
    let state = |port: &mut SimPort| {
        port.write_all(b"?").expect("the line takes it");
        hear(port, |heard| heard.contains('>'))
    };
    let mut waited = 0;
    while !state(&mut port).contains("<Run") {
        waited += 1;
        assert!(waited < 100);
    }
    port.write_all(b"!").expect("the line takes it");
    let mut waited = 0;
    while !state(&mut port).contains("<Hold:0") {
        waited += 1;
        assert!(waited < 10_000);
    }
    let held = port.recording().position;
    hear(&mut port, {
        let silent = std::cell::Cell::new(0);
        move |_| silent.replace(silent.get() + 1) > 3
    });
    assert_eq!(port.recording().position, held);
    port.write_all(b"~").expect("the line takes it");
    assert!(state(&mut port).contains("<Run"));
    port.write_all(&[0x18]).expect("the line takes it");
    hear(&mut port, |heard| heard.contains("Grbl"));
    tell(&mut port, "$X");
    // It lives, and draws again.
    assert!(tell(&mut port, "$PV=DRAW").starts_with("[PV:"));
}

#[test]
fn what_is_wrong_with_a_scene_is_said_in_a_message_and_an_error() {
    let mut port = switched_on();
    for (line, expected) in [
        ("$PV=DRAW", "[MSG:there is no scene; send one with $PV=]\r\nerror:90\r\n"),
        ("$PV=DRAWN", "error:3\r\n"),
        (
            "$PV=474946",
            "[MSG:this is no stored scene: it does not begin with PVSC; make one with `penvis pack`]\r\nerror:90\r\n",
        ),
        (
            "$PV=50565343010000000000010000000000",
            "[MSG:the scene needs 65552 bytes and 65536 are available]\r\nerror:91\r\n",
        ),
    ] {
        assert_eq!(tell(&mut port, line), expected, "{line}");
    }
    let mut bytes = packed(&["saddle"]);
    bytes[100] ^= 1;
    send(&mut port, &bytes);
    let answer = tell(&mut port, "$PV=DRAW");
    assert!(answer.contains("is damaged") && answer.ends_with("error:90\r\n"), "{answer}");
    assert_eq!(tell(&mut port, "G0 X1"), "ok\r\n");
}
