use std::f64::consts::PI;

use super::*;
use glam::DMat4;
use penvis_core::nurbs::{Curve, Surface};
use penvis_core::scene::SceneSurface;
use penvis_core::shape::{Frame, circle, cylinder, plane, polyline, sphere, torus};
use penvis_core::trim::Trims;

fn scene(surfaces: Vec<Surface>) -> Scene {
    let named = |(k, surface)| SceneSurface::new(format!("surface {k}"), surface);
    Scene { name: "closed form".into(), surfaces: surfaces.into_iter().enumerate().map(named).collect() }
}

fn wall(y: f64, half: f64) -> Surface {
    plane(DVec3::new(-half, y, -half), 2.0 * half * DVec3::X, 2.0 * half * DVec3::Z).unwrap()
}

/// Judges a grid of interior points of one surface against `sheets`; returns how many were judged, of how many.
fn agree(scene: &Scene, sight: Sight, surface: usize, sheets: impl Fn(DVec3) -> u32) -> (usize, usize) {
    const N: usize = 37;
    let oracle = Oracle::new(scene, sight);
    let s = &scene.surfaces[surface].surface;
    let mut judged = 0;
    for i in 0..N {
        for j in 0..N {
            let uv = DVec2::new((i as f64 + 0.43) / N as f64, (j as f64 + 0.37) / N as f64);
            let point = s.eval(uv.x, uv.y);
            let expected = sheets(point);
            let seen = oracle.judge(&Place { point, surface, uv, site: Site::Sheet });
            match seen {
                Verdict::Ambiguous(_) => {}
                Verdict::Visible => assert_eq!(expected, 0, "at {point}"),
                Verdict::Hidden(n) => assert_eq!(expected, n, "at {point}"),
            }
            judged += usize::from(!matches!(seen, Verdict::Ambiguous(_)));
        }
    }
    (judged, N * N)
}

fn mostly((judged, all): (usize, usize)) {
    assert!(judged * 100 > all * 96, "{judged} judged of {all}");
}

fn parallel(direction: DVec3) -> Sight {
    Sight::Parallel { direction, up: DVec3::Z }
}

fn central(eye: DVec3) -> Sight {
    Sight::Central { eye, target: DVec3::ZERO, up: DVec3::Z }
}

/// Direction from `p` to the eye.
fn towards_eye(sight: Sight, p: DVec3) -> DVec3 {
    match sight {
        Sight::Parallel { direction, .. } => direction,
        Sight::Central { eye, .. } => eye - p,
    }
}

/// Passages through the sphere about the origin on the way from `p` to the eye, `p` itself not among them.
fn passages(p: DVec3, way: DVec3, radius: f64) -> u32 {
    let d = way.normalize();
    let (b, c) = (p.dot(d), p.length_squared() - radius * radius);
    if c.abs() < 1e-9 {
        // On the sphere: the other passage is ahead where the way leads inwards.
        return u32::from(b < 0.0);
    }
    let disc = b * b - c;
    if disc <= 0.0 { 0 } else { [-b - disc.sqrt(), -b + disc.sqrt()].iter().filter(|&&t| t > 0.0).count() as u32 }
}

#[test]
fn a_sphere_hides_a_disc_of_the_wall_behind_it() {
    let s = scene(vec![sphere(&Frame::WORLD, 1.0).unwrap(), wall(3.0, 4.0)]);
    for sight in [
        parallel(DVec3::NEG_Y),
        parallel(DVec3::new(0.3, -1.0, 0.2)),
        central(DVec3::new(0.0, -5.0, 0.0)),
        central(DVec3::new(1.0, -4.0, 1.5)),
    ] {
        mostly(agree(&s, sight, 1, |p| passages(p, towards_eye(sight, p), 1.0)));
    }
}

#[test]
fn nested_spheres_add_their_sheets() {
    let radii = [1.0, 1.4, 2.0];
    let mut surfaces: Vec<Surface> = radii.iter().map(|&r| sphere(&Frame::WORLD, r).unwrap()).collect();
    surfaces.push(wall(3.0, 3.0));
    let s = scene(surfaces);
    for sight in [parallel(DVec3::new(0.3, -1.0, 0.2)), central(DVec3::new(1.0, -6.0, 1.5))] {
        for k in 0..s.surfaces.len() {
            let (judged, all) =
                agree(&s, sight, k, |p| radii.iter().map(|&r| passages(p, towards_eye(sight, p), r)).sum());
            // Points just behind their own fold, and the poles of the parametrisation, are not judged.
            assert!(judged * 100 > all * 85, "{judged} judged of {all} on surface {k}");
        }
    }
}

#[test]
fn a_torus_has_a_hole_and_a_side_of_four_sheets() {
    let (major, minor) = (2.0, 0.6);
    let s = scene(vec![torus(&Frame::WORLD, major, minor).unwrap(), wall(4.0, 3.0)]);
    mostly(agree(&s, parallel(DVec3::NEG_Y), 1, |p| {
        // On the sight line at (x, z) the distance from the axis is major ± √(minor² − z²) where it meets the torus.
        let h = minor * minor - p.z * p.z;
        let at = |r: f64| if r > p.x.abs() { 2 } else { 0 };
        if h < 0.0 { 0 } else { at(major + h.sqrt()) + at(major - h.sqrt()) }
    }));
    let floor = plane(DVec3::new(-3.0, -3.0, -1.0), 6.0 * DVec3::X, 6.0 * DVec3::Y).unwrap();
    let s = scene(vec![torus(&Frame::WORLD, major, minor).unwrap(), floor]);
    let above = Sight::Parallel { direction: DVec3::Z, up: DVec3::Y };
    mostly(agree(&s, above, 1, |p| if (p.truncate().length() - major).abs() < minor { 2 } else { 0 }));
}

#[test]
fn a_silhouette_is_not_hidden_by_its_own_sheet() {
    let s = scene(vec![sphere(&Frame::WORLD, 1.0).unwrap(), wall(3.0, 4.0)]);
    // The eye sees the equator as the outline: along it v is ½.
    let above = Oracle::new(&s, Sight::Parallel { direction: DVec3::Z, up: DVec3::Y });
    for k in 0..100 {
        let uv = DVec2::new((f64::from(k) + 0.41) / 100.0, 0.5);
        let point = s.surfaces[0].surface.eval(uv.x, uv.y);
        assert_eq!(above.judge(&Place { point, surface: 0, uv, site: Site::Silhouette }), Verdict::Visible);
        // The same points claimed to lie inside the sheet are left alone.
        let claim = above.judge(&Place { point, surface: 0, uv, site: Site::Sheet });
        assert_eq!(claim, Verdict::Ambiguous(Doubt::OwnSheet));
    }
}

#[test]
fn what_touches_or_borders_is_not_judged() {
    let s = scene(vec![wall(0.0, 1.0), wall(1e-9, 2.0), wall(3.0, 4.0)]);
    let oracle = Oracle::new(&s, parallel(DVec3::NEG_Y));
    let place = |x: f64, surface: usize, half: f64| {
        let uv = DVec2::new(0.5 + 0.5 * x / half, 0.51);
        let point = s.surfaces[surface].surface.eval(uv.x, uv.y);
        oracle.judge(&Place { point, surface, uv, site: Site::Sheet })
    };
    assert_eq!(place(0.5, 1, 2.0), Verdict::Ambiguous(Doubt::Contact));
    assert_eq!(place(1.0, 2, 4.0), Verdict::Ambiguous(Doubt::Transition));
    assert_eq!(place(0.9, 2, 4.0), Verdict::Hidden(2));
    assert_eq!(place(1.1, 2, 4.0), Verdict::Hidden(1));
    assert_eq!(place(2.1, 2, 4.0), Verdict::Visible);
    // On the edge of a sheet: its own edge does not hide it.
    assert_eq!(place(2.0, 1, 2.0), Verdict::Visible);
}

fn holed(surface: Surface, loops: &[Vec<Curve>]) -> SceneSurface {
    let trims = Some(Trims::new(&surface, loops).unwrap());
    SceneSurface { trims, ..SceneSurface::new("trimmed", surface) }
}

fn ring(centre: DVec2, radius: f64) -> Vec<Curve> {
    let there = DMat4::from_translation(centre.extend(0.0));
    vec![circle(&Frame::WORLD, radius).unwrap().transformed(there).unwrap()]
}

#[test]
fn a_trimmed_sheet_hides_what_it_keeps_and_is_judged_to_its_borders() {
    // A disc of radius 2 with a hole of radius ½ off its middle, before a wall; parameters run from 0 to 1.
    let loops = [ring(DVec2::splat(0.5), 0.4), ring(DVec2::new(0.6, 0.5), 0.1)];
    let mut s = scene(vec![wall(3.0, 4.0)]);
    s.surfaces.push(holed(wall(0.0, 2.5), &loops));
    for sight in [parallel(DVec3::NEG_Y), parallel(DVec3::new(0.3, -1.0, 0.2)), central(DVec3::new(1.0, -4.0, 1.5))] {
        mostly(agree(&s, sight, 0, |p| {
            let way = towards_eye(sight, p);
            let q = p - way * (p.y / way.y);
            let kept = q.length() < 2.0 && q.distance(DVec3::X * 0.5) > 0.5;
            u32::from(kept && p.y > 0.0)
        }));
    }
    // On the border of the hole: the end of a sheet, and nothing before it.
    let oracle = Oracle::new(&s, parallel(DVec3::new(0.3, -1.0, 0.2)));
    let on_border = |k: u32| {
        let uv = DVec2::new(0.6, 0.5) + 0.1 * DVec2::from_angle(0.37 + f64::from(k));
        oracle.judge(&Place { point: s.surfaces[1].surface.eval(uv.x, uv.y), surface: 1, uv, site: Site::Sheet })
    };
    assert!((0..60).all(|k| on_border(k) == Verdict::Visible));
    // All round each border there is an outline to be seen.
    let near = |q: DVec2, radius: f64, centre: f64| q.distance(DVec2::new(centre, 0.0)) - radius;
    let front = Oracle::new(&s, parallel(DVec3::NEG_Y));
    let outline = front.visible_outline();
    for (radius, centre) in [(2.0, 0.0), (0.5, 0.5)] {
        let found = outline.iter().filter(|(q, error)| near(*q, radius, centre).abs() <= *error).count();
        assert!(found > 40, "{found} places on the border with radius {radius}");
    }
}

/// A plate with a round hole and a wall that begins there, whose parameters have nothing in common, are joined.
#[test]
fn a_wall_and_the_hole_that_it_begins_at_share_an_edge() {
    let plate = plane(DVec3::new(-1.0, -1.0, 0.0), 2.0 * DVec3::X, 2.0 * DVec3::Y).unwrap();
    let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)].map(|(u, v)| DVec3::new(u, v, 0.0));
    let border = vec![polyline(&corners).unwrap()];
    let bore = cylinder(&Frame::new(DVec3::new(0.0, 0.0, -0.7), DVec3::Z, DVec3::X).unwrap(), 0.5, 0.7).unwrap();
    let mut s = scene(vec![bore]);
    s.surfaces.push(holed(plate, &[border, ring(DVec2::splat(0.5), 0.25)]));
    let oracle = Oracle::new(&s, parallel(DVec3::new(0.4, -1.0, 0.8)));
    let mut seen = 0;
    for k in 0..200 {
        let uv = DVec2::splat(0.5) + 0.25 * DVec2::from_angle(f64::from(k));
        let place = Place { point: s.surfaces[1].surface.eval(uv.x, uv.y), surface: 1, uv, site: Site::Crease };
        match oracle.judge(&place) {
            Verdict::Visible => seen += 1,
            Verdict::Hidden(n) => panic!("{n} sheets before {place:?}"),
            Verdict::Ambiguous(_) => {}
        }
    }
    assert!(seen > 180, "{seen} places of the edge are seen");
}

#[test]
fn triangles_cover_the_area_of_a_shadow() {
    let ball = sphere(&Frame::WORLD, 1.5).unwrap();
    let tube = cylinder(&Frame::WORLD, 1.0, 3.0).unwrap();
    // Half an ellipse at either end of a rectangle; from higher up one would see through.
    let tilted = |angle: f64| 2.0 * 3.0 * angle.cos() + PI * angle.sin();
    let seen = |surfaces: Vec<Surface>, angle: f64| {
        let oracle = Oracle::new(&scene(surfaces), parallel(DVec3::new(angle.cos(), 0.0, angle.sin())));
        (oracle.area(2000), oracle.relative_error())
    };
    for angle in [0.0, 0.3, 0.6] {
        for (surfaces, expected) in [(vec![ball.clone()], PI * 2.25), (vec![tube.clone()], tilted(angle))] {
            let (area, error) = seen(surfaces, angle);
            assert!((area / expected - 1.0).abs() < 4.0 * error + 1e-5, "{angle}: {area} is not {expected}");
        }
    }
    // What is covered twice counts once.
    let (area, _) = seen(vec![wall(0.0, 1.0).transformed(DMat4::from_rotation_z(0.5 * PI)).unwrap(), ball], 0.0);
    assert!((area / (PI * 2.25) - 1.0).abs() < 1e-3, "{area}");
}

#[test]
fn what_is_nearest_is_told_but_for_where_it_changes() {
    let ball = sphere(&Frame::WORLD, 1.0).unwrap();
    let oracle = Oracle::new(&scene(vec![wall(0.5, 2.0), ball]), parallel(DVec3::NEG_Y));
    for (at, expected) in [
        ([0.1, 0.2], Nearest::Surface(1)),
        ([1.1, 1.2], Nearest::Surface(0)),
        ([2.1, 0.2], Nearest::Nothing),
        ([0.6, 0.8], Nearest::Ambiguous),
        ([2.0, 0.3], Nearest::Ambiguous),
    ] {
        assert_eq!(oracle.nearest(DVec2::from_array(at)), expected, "{at:?}");
    }
    // From behind the wall, which the ball pierces: along a circle of the radius √¾.
    let oracle = Oracle::new(&scene(vec![wall(0.5, 2.0), sphere(&Frame::WORLD, 1.0).unwrap()]), parallel(DVec3::Y));
    let ring = 0.75_f64.sqrt();
    for (r, expected) in
        [(ring, Nearest::Ambiguous), (ring - 0.01, Nearest::Surface(1)), (ring + 0.01, Nearest::Surface(0))]
    {
        for angle in [0.3, 2.0, 4.4] {
            assert_eq!(oracle.nearest(r * DVec2::from_angle(angle)), expected, "{r} at {angle}");
        }
    }
}
