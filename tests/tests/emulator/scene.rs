//! The core on the chip: stored scenes are sent, computed and drawn by the emulated boards.

use std::time::{Duration, Instant};

use penvis::compute::load;
use penvis::progress::Progress;
use penvis::store::{lines, store};
use penvis_firmware::scene::{Figures, draw};
use penvis_tests::plotter::{draw as draw_model, options, simulated};

use super::qemu::{Board, Emulator, Line, Port, image};
use super::{elf, is_faithful, recording};

/// Instructions in a millisecond of the emulated boards, by `-icount shift=5`.
const INSTRUCTIONS_PER_MS: u64 = 1_000_000 / 32;

/// Flash that a board may take with the core, bytes.
const FLASH_MAX: u64 = 512 * 1024;

/// Longest time that a board may compute.
const PATIENCE: Duration = Duration::from_secs(1200);

fn packed(words: &[&str]) -> Vec<u8> {
    let (options, progress) = (options(words), Progress::start());
    let loaded = load(&options, &progress).expect("the model can be read");
    store(loaded, &simulated()).expect("a board could draw it").pack().expect("it can be packed")
}

/// Boots a board and sends it a scene.
fn with_scene(board: Board, bytes: &[u8]) -> Option<Emulator> {
    let mut emulator = Emulator::boot(board, Port::Line)?;
    let line = emulator.line();
    while !line.read().contains("Grbl") {}
    send(line, bytes);
    Some(emulator)
}

/// What the host draws of a scene.
fn drawn(bytes: &[u8]) -> Figures {
    draw(bytes, usize::MAX, &(), &mut |_| true).expect("it can be drawn")
}

fn send(line: &mut Line, bytes: &[u8]) {
    for request in lines(bytes).lines() {
        assert_eq!(line.ask(request), ["ok"]);
    }
}

/// Sends a line that takes long, and asks for the state of the machine until it is answered: it lives.
fn ask_long(line: &mut Line, request: &str) -> Vec<String> {
    let deadline = Instant::now() + PATIENCE;
    line.send(format!("{request}\n").as_bytes());
    let mut answer = Vec::new();
    loop {
        line.send(b"?");
        loop {
            let said = line.read();
            if said == "ok" || said.starts_with("error:") {
                answer.push(said);
                // The state that was asked for last is still to come.
                while !line.read().starts_with('<') {}
                return answer;
            }
            if said.starts_with('<') {
                break;
            }
            answer.push(said);
        }
        assert!(Instant::now() < deadline, "no answer to {request} in {PATIENCE:?}");
        std::thread::sleep(Duration::from_millis(200));
    }
}

/// What a board tells of a drawing: strokes, points, hash; heap at most in bytes, and ms.
fn figures(answer: &[String]) -> ([String; 3], [u64; 2]) {
    let [text, ok] = answer else { panic!("{answer:?}") };
    assert_eq!(ok, "ok", "{text}");
    let numbers = text.strip_prefix("[PV:").and_then(|text| text.strip_suffix(']')).expect("figures");
    let words: Vec<&str> = numbers.split(',').collect();
    let [strokes, points, hash, heap, ms] = words[..] else { panic!("{text}") };
    let number = |word: &str| word.parse().expect("a number");
    ([strokes, points, hash].map(str::to_owned), [number(heap), number(ms)])
}

/// Computes a scene on a board, and holds its strokes against the host's. False where there is no emulator.
fn is_traced_to_the_bit(board: Board, words: &[&str]) -> bool {
    let bytes = packed(words);
    let Some(mut emulator) = with_scene(board, &bytes) else { return false };
    let expected = drawn(&bytes);
    let (found, [heap, ms]) = figures(&ask_long(emulator.line(), "$PV=TRACE"));
    println!(
        "{} {words:?}: {} strokes, {} points, {heap} bytes of heap, {:.0} million instructions, {}",
        board.name(),
        found[0],
        found[1],
        (ms * INSTRUCTIONS_PER_MS) as f64 / 1e6,
        emulator.measure(b's'),
    );
    let expected = [expected.strokes.to_string(), expected.points.to_string(), format!("{:016x}", expected.hash)];
    assert_eq!(found, expected, "{} {words:?}", board.name());
    true
}

/// The strokes are the host's, to the bit.
#[test]
fn scenes_are_traced_to_the_bit() {
    for (board, models) in
        [(Board::Mps2An386Scene, &["saddle", "sphere"][..]), (Board::Mps2An500Scene, &["saddle", "torus", "pawn"])]
    {
        for model in models {
            if !is_traced_to_the_bit(board, &[model]) {
                return;
            }
        }
    }
}

/// All models that fit, on both processors: for the figures.
#[test]
#[ignore = "takes ten minutes; the figures of all models are what it prints"]
fn all_models_are_traced_to_the_bit() {
    for board in [Board::Mps2An500Scene, Board::Mps2An386Scene] {
        for model in ["saddle", "torus", "pawn", "teapot", "sphere", "cylinder", "cone", "box", "missile", "wiggle"] {
            if !is_traced_to_the_bit(board, &[model]) {
                return;
            }
        }
    }
}

/// The board draws by itself, with motion under way while it computes.
#[test]
fn a_board_draws_a_scene_by_itself() {
    let words = ["saddle", "--iso", "2", "--paper", "100x80", "--margin", "5"];
    let bytes = packed(&words);
    let Some(mut emulator) = with_scene(Board::Mps2An500Scene, &bytes) else { return };
    let (found, _) = figures(&ask_long(emulator.line(), "$PV=DRAW"));
    assert_eq!(found[2], format!("{:016x}", drawn(&bytes).hash));
    while !emulator.line().ask("G4 P0")[0].starts_with("ok") {}
    is_faithful(&draw_model(&words).drawing, &recording(&emulator));
}

/// A scene in the flash is drawn without having been sent.
#[test]
fn a_scene_in_flash_is_traced_to_the_bit() {
    let bytes = packed(&["saddle", "--iso", "2"]);
    let Some(mut emulator) = Emulator::boot_with(Board::Mps2An500Scene, Port::Line, &bytes) else { return };
    emulator.line().skip_greeting();
    assert_eq!(emulator.line().ask("$PV"), [format!("[PV:0,65536,{}]", bytes.len()), "ok".to_owned()]);
    let (found, _) = figures(&ask_long(emulator.line(), "$PV=TRACE"));
    let expected = drawn(&bytes);
    let expected = [expected.strokes.to_string(), expected.points.to_string(), format!("{:016x}", expected.hash)];
    assert_eq!(found, expected);
}

/// Too large a scene ends with an error that says how much was needed, and the machine goes on living.
#[test]
fn a_scene_that_needs_too_much_memory_is_refused_and_the_machine_lives() {
    let bytes = packed(&["teapot", "--iso", "1000"]);
    let Some(mut emulator) = with_scene(Board::Mps2An500Scene, &bytes) else { return };
    let answer = ask_long(emulator.line(), "$PV=TRACE");
    println!("{answer:?}");
    assert!(
        answer[0].starts_with("[MSG:the scene needs ") && answer[0].ends_with(" of 3145728 are in use]"),
        "{answer:?}"
    );
    assert_eq!(answer[1], "error:92");
    assert_eq!(emulator.line().ask("G1 X20 Y10 F1200"), ["ok"]);
    // A scene is taken at rest.
    while !emulator.line().ask("?")[0].starts_with("<Idle|MPos:20.000,10.000,0.000|") {}
    send(emulator.line(), &packed(&["saddle"]));
    figures(&ask_long(emulator.line(), "$PV=TRACE"));
}

/// With the core the images are still small enough.
#[test]
fn images_with_the_core_fit_into_flash() {
    for board in [Board::Mps2An386Scene, Board::Mps2An500Scene] {
        let Some(image) = image(board.name()) else { return };
        let size = elf::size(&std::fs::read(image).expect("an image"));
        println!("{}: {} bytes of flash, {} of RAM before the heap and the stack", board.name(), size.flash, size.ram);
        assert!(size.flash <= FLASH_MAX, "{}: {} bytes of flash", board.name(), size.flash);
    }
}
