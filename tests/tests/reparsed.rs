//! G-code files with arcs, read again by a parser no one here wrote, the crate `gcode`, and held against the curves that they are to draw.

use gcode::{Code, Value};
use glam::DVec2;
use penvis::device::find;
use penvis::drawing::Drawing;
use penvis::emit;
use penvis::page::PathChoice;
use penvis_tests::ink::Ink;
use penvis_tests::plotter::drawn;

/// The tolerance of a drawing when nothing is said, in mm.
const TOLERANCE_MM: f64 = 0.01;

/// Curves stand for themselves within this, in mm.
const TRUE_MM: &str = "0.0004";

/// Largest distance in mm of chords from an arc when its ink is compared.
const CHORD_MM: f64 = 1e-4;

/// What is besides the tolerance: half the diagonal of the file's grid of 0.001 mm, the true curves' own, the chords', and a parser that has f32.
const ROUNDING_MM: f64 = 0.0005 * std::f64::consts::SQRT_2 + 0.0004 + CHORD_MM + 1e-4;

/// What the pen draws, in mm: strokes from where the spindle starts, which lowers the pen of this device, to where it stops.
fn interpreted(job: &str) -> (Vec<Vec<DVec2>>, usize) {
    let program = gcode::parse(job).expect("G-code that the crate reads");
    let (mut at, mut down, mut arcs) = (DVec2::ZERO, false, 0);
    let mut strokes: Vec<Vec<DVec2>> = Vec::new();
    for block in &program.blocks {
        // Each move of these files names its motion.
        assert!(block.word_addresses.is_empty(), "{block:?}");
        for code in &block.codes {
            let args = match code {
                Code::General(code) => &code.args,
                Code::Miscellaneous(code) => &code.args,
                _ => panic!("no move and no switch: {code:?}"),
            };
            let word = |letter: char| {
                args.iter().find(|arg| arg.letter == letter).map(|arg| match arg.value {
                    Value::Literal(value) => f64::from(value),
                    _ => panic!("no number: {arg:?}"),
                })
            };
            match code {
                Code::Miscellaneous(code) if code.number.major() == 3 => {
                    let lowers = word('S').is_some_and(|speed| speed > 0.0);
                    if lowers && !down {
                        strokes.push(vec![at]);
                    }
                    down = lowers;
                }
                Code::General(code) => {
                    let to = DVec2::new(word('X').unwrap_or(at.x), word('Y').unwrap_or(at.y));
                    let way = match code.number.major() {
                        0 | 1 => vec![to],
                        number @ (2 | 3) => {
                            arcs += 1;
                            let centre = at + DVec2::new(word('I').unwrap_or(0.0), word('J').unwrap_or(0.0));
                            arc(at, to, centre, number == 2)
                        }
                        _ => Vec::new(),
                    };
                    if let (true, Some(stroke)) = (down, strokes.last_mut()) {
                        stroke.extend(&way);
                    }
                    at = way.last().copied().unwrap_or(at);
                }
                // Other switches move nothing.
                _ => {}
            }
        }
    }
    (strokes, arcs)
}

/// Points along an arc, its end the last.
fn arc(from: DVec2, to: DVec2, centre: DVec2, clockwise: bool) -> Vec<DVec2> {
    let (a, b) = (from - centre, to - centre);
    let turn = a.angle_to(b);
    let turn = match (clockwise, turn) {
        (true, turn) if turn >= 0.0 => turn - std::f64::consts::TAU,
        (false, turn) if turn <= 0.0 => turn + std::f64::consts::TAU,
        (_, turn) => turn,
    };
    let (r, s) = (a.length(), b.length());
    assert!((r - s).abs() <= 0.005_f64.max(0.001 * r), "a controller refuses it: radii of {r} and {s}");
    let count = (turn.abs() / (8.0 * CHORD_MM / r).sqrt()).ceil().max(1.0);
    let points = (1..=count as u32).map(|k| {
        let t = f64::from(k) / count;
        centre + DVec2::from_angle(turn * t).rotate(a) * (1.0 + t * (s / r - 1.0))
    });
    points.collect()
}

#[test]
fn a_file_of_arcs_is_within_the_tolerance_of_the_curves() {
    let device = find("grbl-servo").expect("a built-in device");
    for words in [
        &["torus", "--iso", "3", "--paper", "a5"][..],
        &["vase", "--iso", "2", "--paper", "a5"],
        &["teapot", "--iso", "1", "--paper", "a5"],
    ] {
        // All of the ink: joining leaves out what is within the tolerance of other ink.
        let path = PathChoice { merge_mm: Some(0.0), ..PathChoice::default() };
        let drawing = drawn(words, path, true).drawing;
        let job = emit::gcode(&drawing, &device).expect("G-code");
        let (strokes, arcs) = interpreted(&job);
        let place = device.place(drawing.page).expect("it fits");
        let one = drawing.polylines.first().expect("strokes");
        let read: Vec<_> = strokes
            .into_iter()
            .map(|line| {
                let mut polyline = one.clone();
                polyline.page = line.into_iter().map(|p| place.to_page(p)).collect();
                polyline
            })
            .collect();
        let read = Ink::new(&Drawing { polylines: read, ..drawing.clone() });
        let fine = Ink::new(&drawn(&[words, &["--tolerance", TRUE_MM]].concat(), path, false).drawing);
        let (drawn_off, missing) =
            (read.farthest_from(&fine).expect("ink").0, fine.farthest_from(&read).expect("ink").0);
        println!("{words:?}: {arcs} arcs, {drawn_off:.4} mm off, {missing:.4} mm missing");
        assert!(arcs > 20, "{words:?}: {arcs} arcs");
        assert!(drawn_off.max(missing) <= TOLERANCE_MM + ROUNDING_MM, "{words:?}: {drawn_off} {missing}");
    }
}
