//! Surfaces drawn each in its own style.

use glam::DVec3;
use penvis_core::extract::adaptive::{AdaptiveOptions, Direction, Spacing};
use penvis_core::extract::{CurveSet, Style, Styles};
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::scene::{Scene, SceneSurface};
use penvis_core::shape::{Frame, cylinder, plane, sphere};
use penvis_core::stroke::{CurveKind, Stroke};
use penvis_core::view::Camera;

fn scene(surfaces: Vec<penvis_core::nurbs::Surface>) -> Scene {
    Scene { name: "styles".into(), surfaces: surfaces.into_iter().map(|s| SceneSurface::new("s", s)).collect() }
}

fn strokes(scene: &Scene, styles: &[Style], deepest: u32) -> Vec<Stroke> {
    let camera = Camera::orthographic(DVec3::new(0.0, -1.0, 0.2), DVec3::Z).unwrap();
    let options = DrawOptions { deepest, ..DrawOptions::default() };
    let prepared = Prepared::styled(scene, &camera, &options, Styles::new(styles.to_vec()), &()).unwrap();
    prepared.trace(1e-4, &()).unwrap().strokes
}

const PLAIN: Style =
    Style { curves: CurveSet { boundary: true, crease: true, silhouette: true, ..CurveSet::NONE }, isos: 0 };
const NOTHING: Style = Style { curves: CurveSet::NONE, isos: 5 };
const ISOS: Style = Style { curves: CurveSet { iso: true, ..CurveSet::NONE }, isos: 3 };

/// A ball before a wall.
fn ball_and_wall() -> Scene {
    let wall = plane(DVec3::new(-3.0, 2.0, -3.0), DVec3::X * 6.0, DVec3::Z * 6.0).unwrap();
    scene(vec![sphere(&Frame::WORLD, 1.0).unwrap(), wall])
}

fn length(strokes: &[Stroke]) -> f64 {
    let parts = |s: &Stroke| s.points.windows(2).map(|w| w[0].model.distance(w[1].model)).sum::<f64>();
    strokes.iter().map(parts).sum()
}

#[test]
fn each_surface_has_its_own_curves_and_isocurves() {
    let found = strokes(&ball_and_wall(), &[PLAIN, ISOS], 0);
    let kinds = |surface: usize| -> Vec<CurveKind> {
        let mut kinds: Vec<_> = found.iter().filter(|s| s.surface == surface).map(|s| s.kind).collect();
        kinds.sort();
        kinds.dedup();
        kinds
    };
    assert_eq!((kinds(0), kinds(1)), (vec![CurveKind::Silhouette], vec![CurveKind::Iso]));
    assert!(found.iter().all(|s| s.style == s.surface));
}

#[test]
fn what_is_not_drawn_still_hides() {
    let isos = |ball: Style, deepest: u32| length(&strokes(&ball_and_wall(), &[ball, ISOS], deepest));
    let all = isos(NOTHING, u32::MAX);
    assert!((all - 36.0).abs() < 1e-3, "six lines of length 6: {all}");
    let seen = isos(NOTHING, 0);
    // Two of the six, those through the middle of the wall, run through the shadow: an ellipse with half axes 1 and 1 over the
    // cosine of the eye's height, 0.4 below the middle.
    let high = 1.04_f64.sqrt();
    let hidden = 2.0 * high + 2.0 * (1.0 - (0.4 / high).powi(2)).sqrt();
    assert!((all - seen - hidden).abs() < 1e-3, "{seen}");
}

#[test]
fn a_shared_edge_is_drawn_once_in_the_style_of_the_first_surface_that_wants_it() {
    let tube = cylinder(&Frame::WORLD, 1.0, 2.0).unwrap();
    let above = cylinder(&Frame::at(DVec3::Z * 2.0).unwrap(), 1.0, 1.0).unwrap();
    let cap = penvis_core::shape::disk(&Frame::at(DVec3::Z * 2.0).unwrap(), 1.0).unwrap();
    let crease = Style { curves: CurveSet { crease: true, ..CurveSet::NONE }, isos: 0 };
    let both = scene(vec![tube.clone(), cap]);
    let round = |styles: &[Style]| {
        let found = strokes(&both, styles, u32::MAX);
        assert!((length(&found) - core::f64::consts::TAU).abs() < 1e-3, "{}", length(&found));
        let mut styles: Vec<usize> = found.iter().map(|s| s.style).collect();
        styles.dedup();
        styles
    };
    assert_eq!(round(&[crease, crease]), [0]);
    assert_eq!(round(&[NOTHING, crease]), [1]);
    assert_eq!(round(&[crease, NOTHING]), [0]);
    assert!(strokes(&both, &[NOTHING, NOTHING], u32::MAX).is_empty());
    // A smooth join is drawn where one of the two asks for it.
    let smooth = Style { curves: CurveSet { smooth: true, ..CurveSet::NONE }, isos: 0 };
    let joined = scene(vec![tube, above]);
    assert!((length(&strokes(&joined, &[NOTHING, smooth], u32::MAX)) - core::f64::consts::TAU).abs() < 1e-3);
}

#[test]
fn sections_are_drawn_where_one_of_the_surfaces_wants_them() {
    let section = Style { curves: CurveSet { section: true, ..CurveSet::NONE }, isos: 0 };
    let across = plane(DVec3::new(-3.0, -3.0, 0.28), DVec3::X * 6.0, DVec3::Y * 6.0).unwrap();
    let above = plane(DVec3::new(-3.0, -3.0, 0.5), DVec3::X * 6.0, DVec3::Y * 6.0).unwrap();
    let cut = scene(vec![sphere(&Frame::WORLD, 1.0).unwrap(), across, above]);
    let found = strokes(&cut, &[NOTHING, section, NOTHING], u32::MAX);
    // The circle at the height 0.28 has the radius 0.96.
    let circle = 0.96 * core::f64::consts::TAU;
    assert!((length(&found) - circle).abs() < 1e-3 && found.iter().all(|s| s.style == 1), "{}", length(&found));
    assert!(strokes(&cut, &[NOTHING; 3], u32::MAX).is_empty());
}

#[test]
fn isocurves_cover_the_surfaces_that_want_them() {
    let camera = Camera::orthographic(DVec3::new(0.0, -1.0, 0.2), DVec3::Z).unwrap();
    let mut prepared = Prepared::styled(
        &ball_and_wall(),
        &camera,
        &DrawOptions::default(),
        Styles::new(vec![PLAIN, Style { isos: 0, ..ISOS }]),
        &(),
    )
    .unwrap();
    let options = AdaptiveOptions {
        spacing: 0.5,
        measured: Spacing::Screen,
        direction: Direction::U,
        tone: None,
        levels: 1,
        shortest: 0.1,
    };
    prepared.cover(&options, &()).unwrap();
    let isos: Vec<usize> = prepared.curves().iter().filter(|c| c.kind == CurveKind::Iso).map(|c| c.surface).collect();
    assert!(isos.len() > 10 && isos.iter().all(|&s| s == 1), "{isos:?}");
}
