//! Adaptive isocurves against equally spaced ones (Elber and Cohen 1992), for every built-in model on A4:
//!
//!     cargo run --release -p penvis-tests --example isocurves [SPACING IN MM] [MODEL…]
//!
//! `farthest`: the largest distance of a densely sampled surface point from an isocurve, in spacings; the promise is 0.75.
//! `crowded`: the share of neighbours nearer together than half the spacing. `uniform`: the fewest equally spaced isocurves that
//! are nowhere farther apart than the spacing, on each surface in the same direction, and the adaptive ones' length as a share of
//! theirs. The last columns are whole pictures, visible pieces only, from the model to G-code.

use std::time::Instant;

use penvis::drawing::Page;
use penvis::page::Layout;
use penvis::stats::Stats;
use penvis::{builtin, emit};
use penvis_core::extract::adaptive::{AdaptiveOptions, Direction, Spacing};
use penvis_core::nurbs::{Curve, KnotVector};
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::scene::{Scene, SceneSurface};
use penvis_core::shape;
use penvis_core::view::Camera;
use penvis_tests::cover::{Coverage, measure};
use penvis_tests::plotter::{draw, simulated};

/// The sheet and its margin in mm.
const PAGE: Page = Page { width_mm: 297.0, height_mm: 210.0 };
const MARGIN_MM: f64 = 15.0;

fn main() {
    let mut words: Vec<String> = std::env::args().skip(1).collect();
    let spacing_mm = match words.first().map(|w| w.parse()) {
        Some(Ok(mm)) => {
            words.remove(0);
            mm
        }
        _ => 0.5,
    };
    println!("Spacing {spacing_mm} mm on A4.\n");
    println!(
        "| model | curves | distances | farthest | crowded | length mm | uniform | their length mm | share | ms | strokes \
         | ink mm | lifts |"
    );
    println!("|---|{}", "--:|".repeat(12));
    let wanted = |name: &str| words.is_empty() || words.iter().any(|w| w == name);
    if wanted("hourglass") {
        let scene = hourglass();
        let camera = Camera::orthographic(glam::DVec3::new(1.0, -2.0, 0.6), glam::DVec3::Z).expect("a camera");
        row("hourglass", &scene, &camera, spacing_mm, false);
    }
    if wanted("lid") {
        let teapot = builtin::load("teapot").expect("a built-in model");
        let surfaces = teapot.scene.surfaces.into_iter().filter(|s| s.name.starts_with("lid")).collect();
        let scene = Scene { name: "lid".into(), surfaces };
        row("lid", &scene, &teapot.view.camera().expect("a camera"), spacing_mm, false);
    }
    for (name, _) in builtin::names().filter(|(name, _)| wanted(name)) {
        let model = builtin::load(name).expect("a built-in model");
        row(name, &model.scene, &model.view.camera().expect("a camera"), spacing_mm, true);
    }
}

/// A surface that is narrow in the middle, as in figure 1 of the paper: turned, waist a seventh of its ends.
fn hourglass() -> Scene {
    let knots = KnotVector::bezier(2, [0.0, 1.0]).expect("knots");
    let profile = [[2.0, -3.0], [-1.4, 0.0], [2.0, 3.0]].map(|[x, z]| glam::DVec4::new(x, 0.0, z, 1.0));
    let profile = Curve::new(knots, profile.to_vec()).expect("a profile");
    let axis = (glam::DVec3::ZERO, glam::DVec3::Z);
    let surface = shape::revolution(&profile, axis.0, axis.1, std::f64::consts::TAU).expect("a surface");
    Scene { name: "hourglass".into(), surfaces: vec![SceneSurface::new("hourglass", surface)] }
}

fn row(name: &str, scene: &Scene, camera: &Camera, spacing_mm: f64, draws: bool) {
    let options = DrawOptions { isos: 0, ..DrawOptions::default() };
    let mut prepared = Prepared::new(scene, camera, &options, &()).expect("a picture");
    let layout = Layout::fit(prepared.extent(), PAGE, MARGIN_MM).expect("it fits");
    let spacing = layout.to_screen_length(spacing_mm);
    let (measured, direction) = (Spacing::Screen, Direction::Auto);
    let even = AdaptiveOptions { spacing, measured, direction, tone: None, levels: 1, shortest: 0.0 };
    prepared.cover(&even, &()).expect("nothing stops it");
    let mut all = Coverage::default();
    let surfaces = scene.surfaces.iter().map(|s| &s.surface);
    measure(surfaces, camera, &prepared, spacing).iter().for_each(|one| all.add(one));
    let counts = prepared.stats().adaptive;
    let mm = spacing_mm / spacing;
    print!(
        "| {name} | {} | {} | {:.3} | {:.1} % | {:.0} | {} | {:.0} | {:.2} |",
        counts.curves,
        counts.distances,
        all.farthest / spacing,
        100.0 * all.crowded as f64 / all.pairs.max(1) as f64,
        all.length * mm,
        all.uniform,
        all.uniform_length * mm,
        all.length / all.uniform_length,
    );
    if draws {
        let device = simulated();
        let started = Instant::now();
        let computed = draw(&[name, "--iso-spacing", &spacing_mm.to_string()]);
        let text = emit::gcode(&computed.drawing, &device).expect("G-code");
        let time = started.elapsed();
        let stats = Stats::new(&computed.stats, computed.seconds, &computed.drawing, &device);
        let strokes = stats.strokes;
        assert!(!text.is_empty());
        println!(" {:.0} | {} | {:.0} | {} |", 1e3 * time.as_secs_f64(), strokes.count, strokes.ink_mm, strokes.lifts);
    } else {
        println!(" | | | |");
    }
}
