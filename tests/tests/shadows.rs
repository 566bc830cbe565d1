//! Shadows: areas that are known exactly, and places of models against triangles that the light sees or does not see.

use std::f64::consts::PI;

use glam::DVec3;
use penvis::builtin;
use penvis::model::View;
use penvis::shadow::{Shadows, camera, shadows, visible};
use penvis_core::nurbs::Surface;
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::scene::{Scene, SceneSurface};
use penvis_core::shape::{Frame, disk, plane, sphere};
use penvis_tests::oracle::Sight;
use penvis_tests::raster::prepared;
use penvis_tests::shadow::against;
use penvis_tests::views::near;

const TOLERANCE: f64 = 1e-4;

fn scene(surfaces: Vec<Surface>) -> Scene {
    let named = |(k, surface)| SceneSurface::new(format!("surface {k}"), surface);
    Scene { name: "closed form".into(), surfaces: surfaces.into_iter().enumerate().map(named).collect() }
}

fn at(origin: DVec3) -> Frame {
    Frame::new(origin, DVec3::Z, DVec3::X).expect("a frame")
}

/// An orthographic view, whatever the direction.
fn view(direction: DVec3) -> View {
    let up = if direction.x == 0.0 && direction.y == 0.0 { DVec3::Y } else { DVec3::Z };
    View { up, ..View::orthographic(direction) }
}

/// A direction in model space as the viewer has it.
fn to_viewer(prepared: &Prepared, direction: DVec3) -> DVec3 {
    DVec3::from_array(prepared.geometry().view.camera().axes().map(|axis| axis.dot(direction)))
}

fn cast(scene: &Scene, prepared: &Prepared, light: DVec3, tolerance: f64) -> Shadows {
    in_light(scene, prepared, to_viewer(prepared, light), tolerance)
}

/// The shadows of a light in the viewer's frame.
fn in_light(scene: &Scene, prepared: &Prepared, light: DVec3, tolerance: f64) -> Shadows {
    let seen = visible(prepared, tolerance, PI, &()).expect("nothing stops it");
    shadows(scene, prepared, &seen, light, tolerance, &DrawOptions::default(), &()).expect("shadows")
}

/// Area of the shadows of each surface.
fn areas(scene: &Scene, eye: &View, light: DVec3) -> Vec<f64> {
    let prepared = prepared(scene, eye);
    let found = cast(scene, &prepared, light, TOLERANCE);
    assert!(found.undecided.is_empty(), "{:?}", found.undecided);
    let mut areas = vec![0.0; scene.surfaces.len()];
    for shadow in &found.shadows {
        for own in &shadow.loops {
            let next = own.iter().cycle().skip(1);
            areas[shadow.surface] += own.iter().zip(next).map(|(a, b)| 0.5 * a.screen.perp_dot(b.screen)).sum::<f64>();
        }
    }
    areas
}

/// What a chord may leave out or add along a border that is so long.
fn off(border: f64) -> f64 {
    2.0 * TOLERANCE * border
}

const EYES: [DVec3; 6] =
    [DVec3::X, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z, DVec3::new(0.31, -0.85, 0.42), DVec3::new(1.0, -1.0, 1.0)];

#[test]
fn the_dark_part_of_a_ball_is_the_lune_beyond_the_terminator() {
    let ball = scene(vec![sphere(&Frame::WORLD, 1.0).expect("a ball")]);
    for eye in EYES {
        let across = eye.normalize().any_orthonormal_vector();
        for degrees in [0.0, 10.0, 45.0, 90.0, 120.0, 180.0] {
            let (sin, cos) = f64::sin_cos(f64::to_radians(degrees));
            let light = eye.normalize() * cos + across * sin;
            let found = areas(&ball, &view(eye), light)[0];
            // Half a disk less half an ellipse.
            let want = PI * (1.0 - cos) / 2.0;
            assert!((found - want).abs() < off(3.0 * PI), "{eye}, {degrees} degrees: {found} and not {want}");
        }
    }
}

#[test]
fn a_ball_over_a_plate_casts_the_ellipse_that_it_does_not_hide() {
    let h = 2.0;
    let square = plane(DVec3::new(-10.0, -10.0, 0.0), 20.0 * DVec3::X, 20.0 * DVec3::Y).expect("a plate");
    let round = disk(&Frame::WORLD, 10.0).expect("a plate");
    for plate in [square, round] {
        let two = scene(vec![plate, sphere(&at(h * DVec3::Z), 1.0).expect("a ball")]);
        for degrees in [0.0, 5.0, 20.0, 35.0, 55.0] {
            let (sin, cos) = f64::sin_cos(f64::to_radians(degrees));
            // Seen from above, the shadow is an ellipse about so far beside the ball, 1 wide.
            let (aside, long) = (h * sin / cos, 1.0 / cos);
            for light in [DVec3::new(sin, 0.0, cos), DVec3::new(-0.6 * sin, 0.8 * sin, cos)] {
                let found = areas(&two, &view(DVec3::Z), light)[0];
                let seen = |s: f64| {
                    // Of a chord of the ellipse what is beyond that of the ball.
                    let [a, b] = [aside - long * s, aside + long * s];
                    (b - a) - (b.min(s) - a.max(-s)).max(0.0)
                };
                // Over the angle the chords have no root.
                let parts = 20_000;
                let step = PI / f64::from(parts);
                let angle = |k: i32| (f64::from(k) + 0.5) * step;
                let want: f64 = (0..parts).map(|k| seen(angle(k).sin()) * angle(k).sin() * step).sum();
                assert!((found - want).abs() < off(16.0), "{light}: {found} and not {want}");
            }
        }
        // From the side the whole ellipse is seen, foreshortened as the plate is.
        let (eye, light) = (DVec3::new(0.0, -1.0, 1.0), DVec3::new(1.0, 0.0, 0.5));
        let found = areas(&two, &view(eye), light)[0];
        let want = PI * light.length() / light.z * eye.normalize().z;
        assert!((found - want).abs() < off(16.0), "{found} and not {want}");
    }
}

#[test]
fn a_sheet_is_lit_on_one_side() {
    let sheet = scene(vec![plane(DVec3::ZERO, DVec3::X, DVec3::new(0.0, 0.8, 0.6)).expect("a sheet")]);
    let normal = DVec3::new(0.0, -0.6, 0.8);
    for eye in [DVec3::Z, DVec3::NEG_Z, DVec3::new(0.3, -0.5, 1.0), DVec3::Y] {
        let whole = normal.dot(eye.normalize()).abs();
        for light in [normal, -normal, DVec3::Z, DVec3::NEG_Z, DVec3::Y, DVec3::new(1.0, 0.2, -0.4)] {
            let found = areas(&sheet, &view(eye), light)[0];
            let want = if normal.dot(eye) * normal.dot(light) > 0.0 { 0.0 } else { whole };
            assert!((found - want).abs() < off(4.0), "{eye}, {light}: {found} and not {want}");
        }
        // Along the sheet no light falls on it.
        let found = areas(&sheet, &view(eye), DVec3::X)[0];
        assert!((found - whole).abs() < off(4.0), "{eye}: {found} and not {whole}");
    }
}

#[test]
fn a_sheet_shades_another_one_on_the_side_of_the_light_only() {
    // Three squares above one another, lit from above: seen from above all is lit that is seen, and from below nothing is.
    let square = |z: f64, size: f64| {
        plane(DVec3::new(-size, -size, z), 2.0 * size * DVec3::X, 2.0 * size * DVec3::Y).expect("a square")
    };
    let pile = scene(vec![square(0.0, 3.0), square(1.0, 2.0), square(2.0, 1.0)]);
    assert_eq!(areas(&pile, &view(DVec3::Z), DVec3::Z), [0.0; 3]);
    let below = areas(&pile, &view(DVec3::NEG_Z), DVec3::Z);
    assert!((below[0] - 36.0).abs() < off(24.0) && below[1] + below[2] == 0.0, "{below:?}");
    // A light that comes down by one for two aside moves shadows by two a storey. From −1 to 1 the highest casts on −3 to −1 of the middle one, of which
    // −2 to −1 is there; on the lowest it is −5 to −3, and the shadow of the middle one −4 to 0, of which −3 to 0 is there. From above the middle one hides
    // −2 to 0 of that; what is left is as wide as the middle one.
    let slant = areas(&pile, &view(DVec3::Z), DVec3::new(2.0, 0.0, 1.0));
    for (found, want) in slant.iter().zip([4.0, 2.0, 0.0]) {
        assert!((found - want).abs() < off(24.0), "{slant:?}");
    }
}

#[test]
fn where_the_light_comes_from_the_eye_there_is_no_shadow() {
    for name in ["teapot", "vase", "pawn", "linked_tori", "spring"] {
        let model = builtin::load(name).expect("a built-in model");
        for eye in [model.view.eye_direction, DVec3::NEG_Y, DVec3::Z] {
            let prepared = prepared(&model.scene, &view(eye));
            let size = prepared.geometry().view.size();
            let found = in_light(&model.scene, &prepared, DVec3::Z, TOLERANCE * size);
            let of: Vec<usize> = found.shadows.iter().map(|s| s.surface).collect();
            assert!(of.is_empty(), "{name} from {eye}: {of:?}");
        }
    }
}

#[test]
fn every_place_is_lit_that_the_light_sees() {
    let lamps = [DVec3::new(-1.0, 1.0, 1.0), DVec3::Y, DVec3::new(1.0, 0.3, -0.2)];
    for (m, name) in ["teapot", "vase", "pawn", "linked_tori", "spring", "discont"].into_iter().enumerate() {
        let model = builtin::load(name).expect("a built-in model");
        let oblique = view(DVec3::new(0.31, -0.85, 0.42));
        let close = near(&model.scene, DVec3::new(0.4, -1.0, 0.5).normalize());
        let mut told = [0; 2];
        for (k, eye) in [model.view, view(DVec3::NEG_Y), oblique, close].iter().enumerate() {
            let prepared = prepared(&model.scene, eye);
            let light = lamps[(k + m) % 3];
            let lamp = camera(prepared.geometry().view.camera(), light).expect("a camera").axes()[2];
            let tolerance = 1e-4 * prepared.geometry().view.size();
            let found = in_light(&model.scene, &prepared, light, tolerance);
            let judged = against(&model.scene, &prepared, Sight::from(eye), lamp, &found, 3.0 * tolerance, 3000);
            let undecided = found.undecided.len();
            println!("{name}, view {k}, light {light}: {judged:?}, {undecided} undecided");
            assert_eq!(judged.wrong, 0, "{name}, view {k}, light {light}: {judged:?} {:?}", found.undecided);
            assert!(judged.near * 8 < judged.dark + judged.lit, "{name}, view {k}, light {light}: {judged:?}");
            told[0] += judged.dark;
            told[1] += judged.lit;
        }
        assert!(told.iter().all(|count| *count > 80), "{name}: {told:?}");
    }
}

#[test]
fn borders_of_shadows_lie_on_the_screen_where_their_parameters_do() {
    let model = builtin::load("teapot").expect("a built-in model");
    let prepared = prepared(&model.scene, &model.view);
    let size = prepared.geometry().view.size();
    let found = cast(&model.scene, &prepared, DVec3::new(-1.0, -1.0, 1.0), 1e-4 * size);
    let mut count = 0;
    for shadow in &found.shadows {
        for p in shadow.loops.iter().flatten() {
            let screen = prepared.geometry().view.jet(shadow.surface, p.uv, [false; 2]).p.truncate();
            assert!(screen.distance(p.screen) < 1e-12 * size, "{p:?} {screen}");
            count += 1;
        }
        let area = |own: &Vec<penvis_core::visible::BorderPoint>| -> f64 {
            let next = own.iter().cycle().skip(1);
            own.iter().zip(next).map(|(a, b)| 0.5 * a.screen.perp_dot(b.screen)).sum()
        };
        assert!(shadow.loops.iter().map(area).sum::<f64>() > 0.0, "the shadow is on the left: {}", shadow.surface);
    }
    assert!(count > 500, "{count}");
}

#[test]
fn borders_go_on_in_the_parameters_as_they_do_on_the_screen() {
    // Also where a section or a silhouette ends on the seam of a closed surface, whose parameters are two there, and where two sheets of a surface come
    // together on the screen.
    let mut wrong: Vec<String> = Vec::new();
    for name in ["teapot", "vase", "pawn", "linked_tori", "spring", "missile", "goblet"] {
        let model = builtin::load(name).expect("a built-in model");
        for eye in
            [model.view, view(DVec3::NEG_Y), view(DVec3::new(0.31, -0.85, 0.42)), view(DVec3::new(-1.0, 0.2, -0.3))]
        {
            let prepared = prepared(&model.scene, &eye);
            let scene = prepared.geometry().view;
            let tolerance = 1e-4 * scene.size();
            let found = visible(&prepared, tolerance, PI, &()).expect("nothing stops it");
            for region in &found.regions {
                // What could not be closed there goes straight on.
                if found.undecided.iter().any(|u| u.surface.is_none_or(|s| s == region.surface)) {
                    continue;
                }
                for own in &region.loops {
                    let points: Vec<_> = own.points().collect();
                    for (a, b) in points.iter().zip(points.iter().cycle().skip(1)) {
                        let middle = scene.jet(region.surface, a.uv.midpoint(b.uv), [false; 2]).p.truncate();
                        let (d, q) = (b.screen - a.screen, middle - a.screen);
                        let share =
                            if d.length() > 0.0 { (q.dot(d) / d.length_squared()).clamp(0.0, 1.0) } else { 0.0 };
                        let off = q.distance(share * d);
                        if off > 2.0 * tolerance {
                            wrong.push(format!("{name} from {}: {off} from {a:?} to {b:?}", eye.eye_direction));
                        }
                    }
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}: {:#?}", wrong.len(), &wrong[..wrong.len().min(20)]);
}
