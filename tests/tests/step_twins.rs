//! Boundary representations against the same models as surface JSON: both draw the same lines, as sets of points, from all
//! round and along the axes, where edges of walls coincide, and with as much ink. The exchange files were written by another
//! program from the surfaces.

use std::path::PathBuf;

use glam::DVec3;
use penvis::drawing::Drawing;
use penvis::model::{self, Model, View};
use penvis::page::{Depths, Inks, Layout, lay_out};
use penvis::pens::Pens;
use penvis_core::extract::CurveSet;
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::scene::Scene;
use penvis_tests::ink::Ink;
use penvis_tests::plotter::options;
use rayon::prelude::*;

/// Chord error of the strokes in mm.
const TOLERANCE: f64 = 0.005;

/// Distance in mm from any ink of the one drawing to ink of the other: two chord errors, and what is left for edges in the
/// exchange file, which are intersections that were computed within a tolerance there.
const APART: f64 = 0.02;

/// Part of the ink by which two drawings may differ in length. Where an edge goes behind the wall that it bounds, it touches
/// the outline of the wall on the screen, and an edge that is off by g ends √(8 g R) earlier or later: a tenth of a millimetre
/// for the approximated edges of the mechanical part.
const LONGER: f64 = 2e-4;

/// Directions to the eye all round, half of them from below.
const VIEWS: u32 = 20;

fn load(name: &str) -> Model {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("data").join(name);
    model::load(&[path.display().to_string()], &model::Reading::new(&())).unwrap_or_else(|e| panic!("{e}"))
}

/// Directions spread evenly over the sphere, and those of the axes.
fn directions() -> Vec<DVec3> {
    let direction = |k: u32| {
        let z: f64 = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(VIEWS);
        let (azimuth, r) = (2.399_963_229_728 * f64::from(k) + 0.7, (1.0 - z * z).sqrt());
        DVec3::new(r * azimuth.cos(), r * azimuth.sin(), z)
    };
    let axes = [DVec3::X, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];
    (0..VIEWS).map(direction).chain(axes).collect()
}

fn view(direction: DVec3) -> View {
    let up = if direction.z.abs() == 1.0 { DVec3::Y } else { DVec3::Z };
    View { up, ..View::orthographic(direction) }
}

fn prepared(scene: &Scene, view: &View) -> Prepared {
    // Parameters of faces and of the surfaces that they were made from are not the same, so isocurves are not.
    let curves = CurveSet { iso: false, ..CurveSet::default() };
    let wanted = DrawOptions { curves, isos: 0, ..DrawOptions::default() };
    Prepared::new(scene, &view.camera().expect("a camera"), &wanted, &()).expect("a picture")
}

/// The drawing of what is visible.
fn drawn(prepared: &Prepared, layout: &Layout) -> Drawing {
    let (page, _) = options(&["-"]).sheet.settle().expect("a sheet");
    let traced = prepared.trace(layout.to_screen_length(TOLERANCE), &()).expect("nothing stops it");
    let polylines = lay_out(&traced.strokes, layout, &Inks::default(), Depths::Together, 1);
    Drawing { name: String::new(), page, isos: 0, pens: Pens::default(), slack_mm: 0.0, polylines }
}

/// The farthest point of a drawing, looked at every few tenths of a millimetre, from the ink of another.
fn farthest(drawing: &Drawing, ink: &Ink) -> f64 {
    let mut most = 0.0_f64;
    for line in &drawing.polylines {
        for w in line.page.windows(2) {
            let (a, b) = (w[0], w[1]);
            let steps = (a.distance(b) / 0.3).ceil().max(1.0);
            let mut k = 0.0;
            while k <= steps {
                most = most.max(ink.distance(a + (b - a) * (k / steps)));
                k += 1.0;
            }
        }
    }
    most
}

/// Length of all lines in mm.
fn length(drawing: &Drawing) -> f64 {
    drawing.polylines.iter().flat_map(|line| line.page.windows(2)).map(|w| w[0].distance(w[1])).sum()
}

fn agree(step: &str, json: &str) {
    agree_from(step, json, directions());
}

fn agree_from(step: &str, json: &str, directions: Vec<DVec3>) {
    let (own, twin) = (load(step), load(json));
    let report = &own.files[0].report;
    assert!(report.problems.is_empty() && report.skipped.is_empty(), "{step}: {report:?}");
    directions.into_par_iter().for_each(|direction| {
        let view = view(direction);
        let [a, b] = [&own.scene, &twin.scene].map(|scene| prepared(scene, &view));
        let (page, margin) = options(&["-"]).sheet.settle().expect("a sheet");
        let layout = Layout::fit(b.extent(), page, margin).expect("it fits");
        let [a, b] = [&a, &b].map(|p| drawn(p, &layout));
        assert!(!a.polylines.is_empty() && !b.polylines.is_empty(), "{step} from {direction}");
        let apart = [farthest(&a, &Ink::new(&b)), farthest(&b, &Ink::new(&a))];
        assert!(apart.iter().all(|d| *d <= APART), "{step} from {direction}: {apart:?} mm apart");
        let [own, twin] = [&a, &b].map(length);
        assert!((own - twin).abs() <= LONGER * twin, "{step} from {direction}: {own} mm of ink and {twin} mm");
    });
}

#[test]
fn primitives_turned_on_a_lathe() {
    for name in ["sphere", "torus", "goblet", "pawn"] {
        agree(&format!("{name}.step"), &format!("{name}.json"));
    }
}

#[test]
fn assemblies() {
    for name in ["vase", "teapot"] {
        agree(&format!("{name}.step"), &format!("{name}.json"));
    }
}

#[test]
fn a_trimmed_surface() {
    agree("trimmed_wave.step", "trimmed_wave.json");
}

#[test]
fn a_mechanical_part_of_splines_and_of_planes_cylinders_and_tori() {
    agree("mech.step", "mech.json");
    agree("mech_analytic.step", "mech.json");
}

/// The parameter curve of the ring round the bore leaves the plane that was made to its size by 4·10⁻¹⁰ mm, so that a quarter
/// of a micrometre of its loop is along the border of that plane: part of one smooth edge, and no dot on the flat bottom.
#[test]
fn no_dot_where_a_round_face_touches_the_border_of_its_plane() {
    agree_from(
        "mech.step",
        "mech.json",
        vec![DVec3::new(0.5478563066695913, 0.07354605902365112, -0.8333333333333333)],
    );
}
