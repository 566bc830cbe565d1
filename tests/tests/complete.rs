//! Nothing is missing and nothing is drawn twice: the outlines of an independent tessellation, as far as they are seen,
//! are all inked, and the strokes are as long as what is visible.

use glam::DVec3;
use penvis::builtin;
use penvis::drawing::Drawing;
use penvis::model::View;
use penvis::page::{Depths, Inks, Layout, lay_out};
use penvis::pens::Pens;
use penvis_core::extract::CurveSet;
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_tests::ink::Ink;
use penvis_tests::oracle::Oracle;
use penvis_tests::plotter::options;

/// Chord error of the strokes in mm.
const TOLERANCE: f64 = 0.01;

/// Outlines only: boundaries, creases, silhouettes.
fn outlines() -> DrawOptions {
    DrawOptions { curves: CurveSet { iso: false, ..CurveSet::default() }, isos: 0, ..DrawOptions::default() }
}

struct Picture {
    prepared: Prepared,
    layout: Layout,
    ink: Ink,
}

fn picture(name: &str, view: &View, wanted: &DrawOptions) -> Picture {
    let model = builtin::load(name).expect("a built-in model");
    let camera = view.camera().expect("a camera");
    let prepared = Prepared::new(&model.scene, &camera, wanted, &()).expect("seen");
    let asked = options(&[name]);
    let (page, margin_mm) = asked.sheet.settle().expect("a sheet");
    let layout = Layout::fit(prepared.extent(), page, margin_mm).expect("it fits");
    let traced = prepared.trace(layout.to_screen_length(TOLERANCE), &()).expect("nothing stops it");
    let polylines = lay_out(&traced.strokes, &layout, &Inks::default(), Depths::Together, 1);
    let drawing = Drawing { name: name.into(), page, isos: 0, pens: Pens::default(), slack_mm: 0.0, polylines };
    Picture { prepared, layout, ink: Ink::new(&drawing) }
}

fn views(name: &str) -> [View; 2] {
    let own = builtin::load(name).expect("a built-in model").view;
    [own, View::orthographic(DVec3::new(0.31, -0.85, 0.42))]
}

#[test]
fn every_visible_outline_is_inked() {
    for (name, _) in builtin::names() {
        let scene = builtin::load(name).expect("a built-in model").scene;
        for (k, view) in views(name).iter().enumerate() {
            let p = picture(name, view, &outlines());
            let outline = Oracle::new(&scene, view).visible_outline();
            assert!(outline.len() > 40, "{name}, view {k}: {} places", outline.len());
            for (at, error) in outline {
                let allowed = error / p.layout.to_screen_length(1.0) + TOLERANCE;
                let off = p.ink.distance(p.layout.to_page(at));
                assert!(
                    off <= allowed,
                    "{name}, view {k}: no ink within {off:.3} mm of {at} on the screen, but {allowed:.3} mm are allowed"
                );
            }
        }
    }
}

/// The check can fail: without silhouettes most outlines of a pawn are missing.
#[test]
fn a_kind_of_curve_left_out_is_noticed() {
    let model = builtin::load("pawn").expect("a built-in model");
    let without = CurveSet { silhouette: false, ..outlines().curves };
    let p = picture("pawn", &model.view, &DrawOptions { curves: without, ..outlines() });
    let outline = Oracle::new(&model.scene, &model.view).visible_outline();
    let far = outline.iter().filter(|(at, _)| p.ink.distance(p.layout.to_page(*at)) > 0.5).count();
    assert!(far * 2 > outline.len(), "{far} of {}", outline.len());
}

/// Strokes are flattened and chained from the visible parts; their lengths on the screen must add up to the same.
#[test]
fn strokes_are_as_long_as_what_is_visible() {
    const PARTS: u32 = 200;
    for (name, _) in builtin::names() {
        let view = builtin::load(name).expect("a built-in model").view;
        let p = picture(name, &view, &DrawOptions::default());
        let g = p.prepared.geometry();
        let (sightings, _) = p.prepared.sightings(&()).expect("nothing stops it");
        let visible: f64 = sightings
            .iter()
            .filter(|s| s.qi == 0)
            .map(|s| {
                let curve = &p.prepared.curves()[s.curve];
                let at =
                    |k: u32| curve.point(&g, s.t[0] + (s.t[1] - s.t[0]) * f64::from(k) / f64::from(PARTS)).truncate();
                (0..PARTS).map(|k| at(k).distance(at(k + 1))).sum::<f64>()
            })
            .sum();
        let visible = visible / p.layout.to_screen_length(1.0);
        let ratio = p.ink.length_mm() / visible;
        assert!((ratio - 1.0).abs() < 1e-3, "{name}: {} mm of {visible}", p.ink.length_mm());
    }
}
