//! Trimmed surfaces against the oracle, which triangulates what the trims keep: a mechanical part with holes, fillets and a
//! cross bore from twenty directions, and a wave with a wavy outline and three holes. What is drawn is right, and nothing is
//! missing.

use std::path::PathBuf;

use glam::DVec3;
use penvis::drawing::Drawing;
use penvis::model::{self, View};
use penvis::page::{Depths, Inks, Layout, lay_out};
use penvis::pens::Pens;
use penvis_core::extract::CurveSet;
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::scene::Scene;
use penvis_tests::agreement::against;
use penvis_tests::ink::Ink;
use penvis_tests::oracle::{Model, Oracle};
use penvis_tests::plotter::options;
use rayon::prelude::*;

/// Chord error of the strokes in mm.
const TOLERANCE: f64 = 0.01;

/// Directions to the eye.
const VIEWS: u32 = 20;

fn scene(name: &str) -> Scene {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("data").join(name);
    model::load(&[path.display().to_string()], &model::Reading::new(&())).expect("a model").scene
}

/// Directions spread evenly over the sphere.
fn directions() -> Vec<DVec3> {
    let direction = |k: u32| {
        let z: f64 = 1.0 - (2.0 * f64::from(k) + 1.0) / f64::from(VIEWS);
        let (azimuth, r) = (2.399_963_229_728 * f64::from(k) + 0.3, (1.0 - z * z).sqrt());
        DVec3::new(r * azimuth.cos(), r * azimuth.sin(), z)
    };
    (0..VIEWS).map(direction).collect()
}

/// No place is judged differently, at least `least` of them alike, and the oracle withholds its verdict from no more than a
/// part of the curves' length.
fn agree(scene: &Scene, model: &Model, view: &View, (least, withheld): (usize, f64)) {
    let options = DrawOptions { deepest: u32::MAX, ..DrawOptions::default() };
    let camera = view.camera().expect("a camera");
    let prepared = Prepared::new(scene, &camera, &options, &()).expect("a picture");
    let a = against(&prepared, &Oracle::seen(scene, model, view), true);
    let list: Vec<String> = a.disagreements.iter().map(|d| format!("\n  {d:?}")).collect();
    assert!(list.is_empty(), "{view:?}: {} disagreements{}", list.len(), list.concat());
    assert!(a.agreed >= least, "{view:?}: only {} places judged, {:?} not", a.agreed, a.doubts);
    assert!(a.ambiguous() < withheld, "{view:?}: {:.3} of the length not judged", a.ambiguous());
}

/// Every place at which the oracle sees an end of a sheet or a fold has ink.
fn complete(scene: &Scene, model: &Model, view: &View) {
    let curves = CurveSet { iso: false, ..CurveSet::default() };
    let wanted = DrawOptions { curves, isos: 0, ..DrawOptions::default() };
    let camera = view.camera().expect("a camera");
    let prepared = Prepared::new(scene, &camera, &wanted, &()).expect("a picture");
    let (page, margin_mm) = options(&["-"]).sheet.settle().expect("a sheet");
    let layout = Layout::fit(prepared.extent(), page, margin_mm).expect("it fits");
    let traced = prepared.trace(layout.to_screen_length(TOLERANCE), &()).expect("nothing stops it");
    let polylines = lay_out(&traced.strokes, &layout, &Inks::default(), Depths::Together, 1);
    let ink =
        Ink::new(&Drawing { name: scene.name.clone(), page, isos: 0, pens: Pens::default(), slack_mm: 0.0, polylines });
    let outline = Oracle::seen(scene, model, view).visible_outline();
    assert!(outline.len() > 100, "{view:?}: {} places", outline.len());
    for (at, error) in outline {
        let allowed = error / layout.to_screen_length(1.0) + TOLERANCE;
        let off = ink.distance(layout.to_page(at));
        assert!(off <= allowed, "{view:?}: no ink within {off:.3} mm of {at}, but {allowed:.3} mm are allowed");
    }
}

#[test]
fn a_mechanical_part_from_all_round() {
    let scene = scene("mech.json");
    let model = Model::new(&scene);
    directions().into_par_iter().for_each(|direction| {
        let view = View::orthographic(direction);
        agree(&scene, &model, &view, (1000, 0.25));
        complete(&scene, &model, &view);
    });
}

/// In the exchange file edges are approximated, so that what ends at an edge on one face reaches over what is drawn of it on
/// the other, or falls short of it.
#[test]
fn a_mechanical_part_whose_edges_are_loose() {
    let scene = scene("mech.step");
    let model = Model::new(&scene);
    let (middle, away) = (DVec3::new(0.0, 0.0, 24.0), 210.0);
    directions().into_par_iter().step_by(4).for_each(|direction| {
        agree(&scene, &model, &View::perspective(middle + away * direction, middle), (1000, 0.25));
    });
}

#[test]
fn a_wave_with_holes() {
    let scene = scene("trimmed_wave.json");
    let model = Model::new(&scene);
    let along = [DVec3::new(0.8, -1.0, 0.7), DVec3::new(0.2, -1.0, 0.15), DVec3::Z, DVec3::new(-0.6, 0.3, -0.5)];
    let views = along
        .iter()
        .map(|&d| if d == DVec3::Z { View { up: DVec3::Y, ..View::orthographic(d) } } else { View::orthographic(d) });
    for view in views.chain([View::perspective(DVec3::new(2.0, -3.0, 2.5), DVec3::new(0.5, 0.5, 0.0))]) {
        agree(&scene, &model, &view, (100, 0.25));
        complete(&scene, &model, &view);
    }
}

/// A silhouette of a hole's wall runs within a thousandth of a radian of the seam, where the wall ends: what it hides of the
/// hole's edge is thinner than anything triangles can tell.
#[test]
fn a_silhouette_next_to_a_seam() {
    let scene = scene("mech.json");
    let eye = DVec3::new(-32.61385944206944, -180.23272780572606, 71.29164831130333);
    let view = View::perspective(eye, DVec3::new(0.0, 0.0, 24.0));
    agree(&scene, &Model::new(&scene), &view, (1000, 0.25));
}

/// The comparison can fail: where the pipeline does not know of the holes of one face, it disagrees.
#[test]
fn holes_that_the_pipeline_does_not_see_are_noticed() {
    let full = scene("mech.json");
    let most = |k: &usize| full.surfaces[*k].trims.as_ref().map_or(0, |t| t.loops().len());
    let face = (0..full.surfaces.len()).max_by_key(most).expect("a face");
    let mut closed = full.clone();
    closed.surfaces[face].trims = None;
    let view = View::orthographic(DVec3::new(1.0, -1.4, -0.95));
    let options = DrawOptions { deepest: u32::MAX, ..DrawOptions::default() };
    let prepared = Prepared::new(&closed, &view.camera().expect("a camera"), &options, &()).expect("a picture");
    let a = against(&prepared, &Oracle::new(&full, &view), true);
    assert!(a.disagreements.len() > 20, "{} disagreements", a.disagreements.len());
}
