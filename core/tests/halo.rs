//! Curves that leave gaps where they pass behind others.

use glam::{DMat3, DVec3};
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::scene::{Scene, SceneSurface};
use penvis_core::shape::{Frame, plane, sphere, torus};
use penvis_core::stroke::Stroke;
use penvis_core::view::Camera;

const GAP: f64 = 0.2;

fn scene(surfaces: Vec<penvis_core::nurbs::Surface>) -> Scene {
    Scene { name: "halo".into(), surfaces: surfaces.into_iter().map(|s| SceneSurface::new("s", s)).collect() }
}

fn strokes(scene: &Scene, eye: DVec3, up: DVec3, options: &DrawOptions, gap: f64) -> Vec<Stroke> {
    let camera = Camera::orthographic(eye, up).unwrap();
    let mut prepared = Prepared::new(scene, &camera, options, &()).unwrap();
    prepared.leave_gaps(gap);
    prepared.trace(1e-5, &()).unwrap().strokes
}

fn length<'a>(strokes: impl IntoIterator<Item = &'a Stroke>) -> f64 {
    let parts = |s: &Stroke| s.points.windows(2).map(|w| w[0].screen.distance(w[1].screen)).sum::<f64>();
    strokes.into_iter().map(parts).sum()
}

/// A bar of length 6 and width 2 along x, of two parts, one of which is joined so near the upper bar that the gap goes on over the joint; and
/// another one above it, turned by an angle.
fn bars(angle: f64) -> Scene {
    let turn = DMat3::from_rotation_z(angle);
    let from = |x: f64, to: f64| plane(DVec3::new(x, -1.0, 0.0), DVec3::X * (to - x), DVec3::Y * 2.0).unwrap();
    let upper = plane(turn * DVec3::new(-1.0, -3.0, 1.0), turn * DVec3::X * 2.0, turn * DVec3::Y * 6.0).unwrap();
    scene(vec![from(-3.0, -1.1), from(-1.1, 3.0), upper])
}

#[test]
fn a_bar_ends_before_the_one_above_it() {
    let flat = |deepest, gap| {
        let options = DrawOptions { isos: 0, deepest, ..DrawOptions::default() };
        strokes(&bars(0.0), DVec3::Z, DVec3::Y, &options, gap)
    };
    let lower = |strokes: &[Stroke]| strokes.iter().filter(|s| s.surface < 2).cloned().collect::<Vec<_>>();
    let near = |a: f64, b: f64| (a - b).abs() < 4e-3 * GAP;
    let found = flat(0, GAP);
    assert!(near(length(&lower(&found)), 2.0 * (2.0 * (2.0 - GAP)) + 4.0), "{}", length(&lower(&found)));
    for stroke in lower(&found) {
        for p in &stroke.points {
            assert!(p.screen.x.abs() > 1.0 + GAP - 4e-3 * GAP, "{}", p.screen);
        }
    }
    // The upper one is whole, and so is all without gaps.
    assert!(near(length(found.iter().filter(|s| s.surface == 2)), 16.0));
    assert!(near(length(&lower(&flat(0, 0.0))), 2.0 * 4.0 + 4.0));
    // What is hidden and drawn is cut back from the other side.
    let hidden: Vec<_> = flat(1, GAP).into_iter().filter(|s| s.qi == 1).collect();
    assert!(near(length(&hidden), 2.0 * (2.0 - 2.0 * GAP)), "{}", length(&hidden));
}

#[test]
fn gaps_are_as_wide_on_the_paper_where_lines_cross_at_an_angle() {
    for angle in [0.2, -0.5, 0.7] {
        let options = DrawOptions { isos: 0, ..DrawOptions::default() };
        let both = [0.0, GAP].map(|gap| strokes(&bars(angle), DVec3::Z, DVec3::Y, &options, gap));
        let [whole, cut] = both.each_ref().map(|strokes| length(strokes.iter().filter(|s| s.surface < 2)));
        // Four crossings with lines at this angle from the vertical.
        let expected = 4.0 * GAP / f64::cos(angle);
        assert!((whole - cut - expected).abs() < 0.01 * GAP, "{angle}: {} for {expected}", whole - cut);
    }
}

#[test]
fn lines_on_a_wall_end_before_the_ball_in_front_of_it() {
    let wall = plane(DVec3::new(-3.0, 2.0, -3.0), DVec3::X * 6.0, DVec3::Z * 6.0).unwrap();
    let scene = scene(vec![sphere(&Frame::WORLD, 1.0).unwrap(), wall]);
    // Lines of both directions at 0.25, 0.75, 1.25, …: those that do not pass behind the ball are whole.
    let options = DrawOptions { isos: 12, ..DrawOptions::default() };
    let on_wall = |gap| {
        let found = strokes(&scene, DVec3::NEG_Y, DVec3::Z, &options, gap);
        length(found.iter().filter(|s| s.surface == 1))
    };
    let chord = |radius: f64| [0.25, 0.75].map(|d| 4.0 * 2.0 * f64::sqrt(radius * radius - d * d)).iter().sum::<f64>();
    let (whole, cut) = (on_wall(0.0), on_wall(GAP));
    assert!((whole - cut - chord(1.0 + GAP) + chord(1.0)).abs() < 0.02 * GAP, "{whole} {cut}");
}

#[test]
fn curves_that_meet_an_outline_in_space_are_not_cut() {
    let ball = scene(vec![sphere(&Frame::WORLD, 1.0).unwrap()]);
    let ring = scene(vec![torus(&Frame::WORLD, 2.0, 0.5).unwrap()]);
    let options = DrawOptions::default();
    for (scene, eye) in [(&ball, DVec3::new(0.4, -1.0, 0.7)), (&ring, DVec3::new(0.1, -0.2, 1.0))] {
        let [whole, cut] = [0.0, GAP].map(|gap| strokes(scene, eye, DVec3::Z, &options, gap));
        assert!(whole == cut, "seen from {eye}: {} and {}", length(&whole), length(&cut));
    }
    // From the side the ring passes behind itself.
    let [whole, cut] =
        [0.0, GAP].map(|gap| length(&strokes(&ring, DVec3::new(0.1, -1.0, 0.3), DVec3::Z, &options, gap)));
    assert!(cut < whole - GAP, "{cut} of {whole}");
}

/// An outline rises towards the eye here and there; its own continuation is nothing that it passes behind.
#[test]
fn an_outline_is_not_eaten_up_by_itself() {
    let frame = |at: DVec3, axis: DVec3| Frame::along(at, axis).unwrap();
    let ring = |at, axis| torus(&frame(at, axis), 2.0, 0.5).unwrap();
    let linked = scene(vec![ring(DVec3::ZERO, DVec3::Z), ring(DVec3::X * 2.0, DVec3::Y)]);
    let options = DrawOptions { isos: 0, ..DrawOptions::default() };
    let ink = |gap| strokes(&linked, DVec3::new(0.5, -1.0, 0.6), DVec3::Z, &options, gap);
    let (whole, cut) = (ink(0.0), ink(0.1));
    let lost = length(&whole) - length(&cut);
    // A dozen crossings of no sharp angle, each with one side that is seen.
    assert!((0.1..4.0).contains(&lost), "{lost} of {}", length(&whole));
    // Nothing is lost far from where something passes behind: every place that is lost is within the gap of what is left.
    for p in whole.iter().flat_map(|s| &s.points) {
        let near = cut.iter().flat_map(|s| s.points.windows(2)).any(|w| {
            let (a, d) = (w[0].screen, w[1].screen - w[0].screen);
            let along = ((p.screen - a).dot(d) / d.length_squared().max(1e-300)).clamp(0.0, 1.0);
            (a + along * d).distance(p.screen) < 0.1001
        });
        assert!(near, "{}", p.screen);
    }
}
