//! The main job from end to end: a model is drawn with default settings, written as G-code, streamed to the simulated
//! plotter, and what its motors drew, rebuilt from the step pulses, is compared with the drawing.

use std::io::Write;

use glam::DVec2;
use penvis::drawing::Drawing;
use penvis::emit;
use penvis::page::{Effort, PathChoice};
use penvis::sim::Recording;
use penvis_firmware::Settings;
use penvis_tests::faults::Bench;
use penvis_tests::ink::Ink;
use penvis_tests::plotter::{draw, drawn, ink, plot, port, simulated};

/// Allowed besides the length of a step, in mm.
const DEVIATION: f64 = 0.02;

/// The largest deviation in mm that a plot may have from its drawing.
fn allowed() -> f64 {
    let [x, y, _] = Settings::default().steps_per_mm();
    DEVIATION + 1.0 / x.min(y)
}

/// Largest distance of either from the other, in mm.
fn deviation(a: &Ink, b: &Ink) -> f64 {
    let one_way = |a: &Ink, b: &Ink| a.farthest_from(b).expect("there is ink").0;
    one_way(a, b).max(one_way(b, a))
}

struct Plot {
    drawing: Drawing,
    job: String,
    recording: Recording,
    drawn: Drawing,
}

fn plotted(words: &[&str]) -> Plot {
    plotted_drawing(draw(words).drawing)
}

fn plotted_drawing(drawing: Drawing) -> Plot {
    let device = simulated();
    let job = emit::gcode(&drawing, &device).expect("G-code");
    let recording = plot(&job, &device).expect("plotted to the end");
    let drawn = ink(&recording, &drawing, &device);
    Plot { drawing, job, recording, drawn }
}

/// Everything drawn is in the drawing, all of the drawing is drawn, and the pen is up at the origin in the end.
fn is_faithful(words: &[&str], least_mm: f64) {
    is_plotted_faithfully(words, plotted(words), least_mm);
}

fn is_plotted_faithfully(words: &[&str], plot: Plot, least_mm: f64) {
    let Plot { drawing, job, recording, drawn } = plot;
    let (wanted, got) = (Ink::new(&drawing), Ink::new(&drawn));
    assert!(wanted.length_mm() > least_mm, "{words:?}: only {:.0} mm", wanted.length_mm());
    let off = deviation(&wanted, &got);
    println!("{words:?}: {:.0} mm, largest deviation {off:.4} mm", wanted.length_mm());
    assert!(off <= allowed(), "{words:?}: {off:.4} mm off");
    // Strokes that meet within the resolution of the job are drawn without lifting: less ink is not possible, and a
    // path of steps is a little longer than the one that it follows.
    let ratio = got.length_mm() / wanted.length_mm();
    assert!((0.995..1.02).contains(&ratio), "{words:?}: {ratio} times the ink");
    let downs = job.lines().filter(|line| *line == "M3 S1000").count();
    assert_eq!(recording.lifts(), downs, "{words:?}: the pen went down once for each M3");
    assert_eq!(recording.lost_bytes, 0);
    assert_eq!(recording.position[..2], [0, 0]);
    assert!(!recording.traces.last().expect("traces").pen_down);
}

#[test]
fn the_teapot_is_drawn_as_it_should() {
    is_faithful(&["teapot"], 4000.0);
}

#[test]
fn the_pawn_is_drawn_as_it_should() {
    is_faithful(&["pawn"], 1000.0);
}

#[test]
fn linked_tori_are_drawn_as_they_should() {
    is_faithful(&["linked_tori"], 1000.0);
}

/// Arcs to either side and lines, by the firmware's own chords.
#[test]
fn a_torus_of_arcs_is_drawn_as_it_should() {
    let words = ["torus", "--paper", "a5", "--iso", "4"];
    let plot = plotted_drawing(drawn(&words, PathChoice::default(), true).drawing);
    let count = |word: &str| plot.job.lines().filter(|line| line.starts_with(word)).count();
    let (arcs, lines) = (count("G2 ") + count("G3 "), count("G1 "));
    println!("{arcs} arcs, {lines} lines");
    assert!(count("G2 ") > 10 && count("G3 ") > 10 && arcs > lines, "{arcs} arcs, {lines} lines");
    is_plotted_faithfully(&words, plot, 300.0);
}

/// Isocurves that end at one outline are drawn on along it.
#[test]
fn a_shaded_pawn_is_drawn_as_it_should() {
    is_faithful(&["pawn", "--shade", "lambert", "--iso-levels", "2", "--paper", "a5"], 1000.0);
}

/// A page that fits only when turned: what is compared has been turned and turned back.
#[test]
fn a_turned_page_is_drawn_as_it_should() {
    is_faithful(&["saddle", "--paper", "a3", "--portrait", "--iso", "5"], 1000.0);
}

/// The comparison can fail, from either side.
#[test]
fn a_drawing_moved_or_with_a_stroke_less_is_told_apart() {
    let Plot { drawing, drawn, .. } = plotted(&["saddle", "--iso", "3", "--paper", "a5"]);
    let got = Ink::new(&drawn);
    assert!(deviation(&Ink::new(&drawing), &got) <= allowed());
    let mut moved = drawing.clone();
    for p in moved.polylines.iter_mut().flat_map(|line| &mut line.page) {
        *p += DVec2::new(0.05, 0.0);
    }
    assert!(deviation(&Ink::new(&moved), &got) > allowed());
    for k in 0..drawing.polylines.len() {
        let mut fewer = drawing.clone();
        fewer.polylines.remove(k);
        let fewer = Ink::new(&fewer);
        assert!(got.farthest_from(&fewer).expect("ink").0 > allowed(), "without stroke {k}");
        assert!(fewer.farthest_from(&got).expect("ink").0 <= allowed());
    }
}

/// A sender that does not count overflows the plotter's receive buffer; nobody tells it, and the drawing is spoilt.
#[test]
fn a_sender_that_does_not_count_spoils_the_drawing() {
    let device = simulated();
    let drawing = draw(&["saddle", "--iso", "3", "--paper", "a5"]).drawing;
    let job = emit::gcode(&drawing, &device).expect("G-code");
    let mut port = port(&device);
    // At the speed of the line: the plotter draws meanwhile, but more slowly than the bytes come.
    port.write_all(job.as_bytes()).expect("the port takes all");
    let recording = port.recording();
    assert!(recording.lost_bytes > 1000, "{} bytes lost", recording.lost_bytes);
    let drawn = ink(&recording, &drawing, &device);
    let off = Ink::new(&drawing).farthest_from(&Ink::new(&drawn)).map_or(f64::INFINITY, |far| far.0);
    assert!(off > 1.0, "{off} mm off");
}

/// The sender for HPGL plotters, on the firmware that hears it: what is drawn is the drawing, and it says so.
#[test]
fn the_firmware_is_an_hpgl_plotter_too() {
    if let Err(problem) = Bench::new("sim", "penvis-hpgl") {
        panic!("{problem}");
    }
}

/// Strokes that are joined, parts of strokes that are there twice, and vertices that are left out: it is the same ink.
#[test]
fn joining_changes_no_ink() {
    let models: [&[&str]; 3] = [
        &["teapot", "--iso", "3"],
        &["pawn", "--hidden", "layer", "--iso", "2"],
        &["pawn", "--hidden", "dashed", "--iso", "2"],
    ];
    let effort = Effort { seconds: 0.0, ..Effort::default() };
    for words in models {
        let with = |merge_mm: Option<f64>| drawn(words, PathChoice { merge_mm, effort }, false).drawing;
        let (as_they_are, joined) = (with(Some(0.0)), with(None));
        let (before, after) = (Ink::new(&as_they_are), Ink::new(&joined));
        let lost = before.farthest_from(&after).expect("ink").0;
        let new = after.farthest_from(&before).expect("ink").0;
        let vertices = |d: &Drawing| d.polylines.iter().map(|p| p.page.len()).sum::<usize>();
        println!(
            "{words:?}: {} strokes for {}, {} vertices for {}, {:.1} mm for {:.1}; {lost:.4} mm lost, {new:.4} mm new",
            joined.polylines.len(),
            as_they_are.polylines.len(),
            vertices(&joined),
            vertices(&as_they_are),
            after.length_mm(),
            before.length_mm(),
        );
        let gaps = 0.1 * as_they_are.polylines.len() as f64;
        assert!(after.length_mm() <= before.length_mm() + gaps && vertices(&joined) <= vertices(&as_they_are));
        // The tolerance; and the middle of a gap that is closed, which lies in the ink of its ends.
        assert!(lost <= 0.01 + 0.001 && new <= 0.05 + 0.001, "{words:?}: {lost} mm lost, {new} mm new");
    }
}
