use std::collections::BTreeMap;

use glam::DVec3;
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::scene::Scene;
use penvis_core::stroke::{CurveKind, Stroke};
use penvis_core::view::Camera;
use proptest::prelude::*;

use super::*;

/// A mesh of triangles with their own corners, as STL has them.
fn soup(triangles: &[[DVec3; 3]]) -> Mesh {
    let mut mesh = Mesh::new("triangle");
    for (place, corners) in triangles.iter().enumerate() {
        let corners = corners.map(|p| mesh.point(p));
        mesh.facet(&corners, place + 1).unwrap();
    }
    mesh
}

fn read(mesh: Mesh) -> (Vec<SceneSurface>, Report) {
    let mut report = Report::default();
    let surfaces = mesh.into_surfaces(Precision::Single, &Reading::new(&()), &mut report).unwrap();
    (surfaces, report)
}

/// Visible strokes from a direction.
fn drawn(surfaces: Vec<SceneSurface>, eye: DVec3) -> Vec<Stroke> {
    let up = if eye.x == 0.0 && eye.y == 0.0 { DVec3::Y } else { DVec3::Z };
    let camera = Camera::orthographic(eye, up).unwrap();
    let scene = Scene { name: "mesh".into(), surfaces };
    let options = DrawOptions { deepest: 0, ..DrawOptions::default() };
    let traced = Prepared::new(&scene, &camera, &options, &()).unwrap().trace(1e-6, &()).unwrap();
    assert_eq!(traced.stats.visibility.undecided.len(), 0);
    traced.strokes
}

/// Length in space of what is visible, by kind.
fn ink(strokes: &[Stroke]) -> BTreeMap<CurveKind, f64> {
    let mut ink = BTreeMap::new();
    for s in strokes.iter().filter(|s| s.qi == 0) {
        let length: f64 = s.points.windows(2).map(|w| w[0].model.distance(w[1].model)).sum();
        *ink.entry(s.kind).or_default() += length;
    }
    ink
}

/// Triangles of a polygon by a fan from its first corner.
fn fan(corners: &[DVec3]) -> Vec<[DVec3; 3]> {
    (1..corners.len() - 1).map(|k| [corners[0], corners[k], corners[k + 1]]).collect()
}

/// The cube between the corners 0 and 1, two triangles a face.
fn cube() -> Vec<[DVec3; 3]> {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let face = |k: usize| {
        let (w, u, v) = (axes[k % 3], axes[(k + 1) % 3], axes[(k + 2) % 3]);
        let (origin, u, v) = if k < 3 { (DVec3::ZERO, v, u) } else { (w, u, v) };
        fan(&[origin, origin + u, origin + u + v, origin + v])
    };
    (0..6).flat_map(face).collect()
}

/// An icosahedron whose faces are parted in four `times` times, on the unit sphere.
fn icosphere(times: usize) -> Vec<[DVec3; 3]> {
    let golden = (1.0 + 5_f64.sqrt()) / 2.0;
    let mut corners = Vec::new();
    for k in 0..3 {
        for (a, b) in [(1.0, golden), (1.0, -golden), (-1.0, golden), (-1.0, -golden)] {
            let mut p = DVec3::ZERO;
            (p[k], p[(k + 1) % 3]) = (a, b);
            corners.push(p);
        }
    }
    let near = |a: DVec3, b: DVec3| (a.distance(b) - 2.0).abs() < 1e-9;
    let mut faces = Vec::new();
    for (i, &a) in corners.iter().enumerate() {
        for (j, &b) in corners.iter().enumerate().skip(i + 1) {
            for &c in corners.iter().skip(j + 1) {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward = (b - a).cross(c - a).dot(a) > 0.0;
                    faces.push(if outward { [a, b, c] } else { [a, c, b] }.map(DVec3::normalize));
                }
            }
        }
    }
    for _ in 0..times {
        let parted = |[a, b, c]: [DVec3; 3]| {
            let [ab, bc, ca] = [a + b, b + c, c + a].map(DVec3::normalize);
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        faces = faces.into_iter().flat_map(parted).collect();
    }
    faces
}

const AXES: [DVec3; 6] = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z];

#[test]
fn a_cube_shows_its_edges_and_no_diagonals() {
    let (surfaces, report) = read(soup(&cube()));
    assert_eq!((surfaces.len(), &report.healed, &report.problems), (12, &vec![], &vec![]));
    let visible = ink(&drawn(surfaces.clone(), DVec3::new(1.0, -1.3, 0.8)));
    assert_eq!(visible.keys().collect::<Vec<_>>(), [&CurveKind::Crease]);
    assert!((visible[&CurveKind::Crease] - 9.0).abs() < 1e-9, "{visible:?}");
    for eye in AXES {
        // A square; the faces beside it are seen along themselves.
        let visible = ink(&drawn(surfaces.clone(), eye));
        assert!((visible[&CurveKind::Crease] - 4.0).abs() < 1e-9, "{eye}: {visible:?}");
        assert_eq!(visible.len(), 1, "{eye}: {visible:?}");
    }
}

#[test]
fn facets_in_a_plane_have_no_edge_between_them_even_where_every_angle_is_one() {
    let turn = glam::DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7);
    // Rounded to single precision, as a file has them, the faces are not quite flat.
    let rounded = |p: DVec3| (turn * p * 100.0).as_vec3().as_dvec3();
    let triangles: Vec<[DVec3; 3]> = cube().into_iter().map(|t| t.map(rounded)).collect();
    let reading = Reading::new(&()).with_crease_angle(0.0);
    let surfaces = soup(&triangles).into_surfaces(Precision::Single, &reading, &mut Report::default()).unwrap();
    let visible = ink(&drawn(surfaces, turn * DVec3::new(1.0, -1.3, 0.8)));
    assert_eq!(visible.keys().collect::<Vec<_>>(), [&CurveKind::Crease]);
    assert!((visible[&CurveKind::Crease] - 900.0).abs() < 1e-3, "{visible:?}");
}

#[test]
fn a_tetrahedron_shows_the_edges_of_its_faces_in_sight() {
    let corners = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]].map(DVec3::from);
    let faces = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]].map(|f| f.map(|k| corners[k]));
    let (surfaces, report) = read(soup(&faces));
    assert_eq!(report.healed.len(), 0);
    let edge = 8_f64.sqrt();
    // Towards a corner three faces are in sight, towards the middle of a face one, along an axis two.
    for (eye, edges) in [(corners[0], 6.0), (-corners[0], 3.0), (DVec3::X, 5.0), (DVec3::NEG_Z, 5.0)] {
        let visible = ink(&drawn(surfaces.clone(), eye));
        assert!((visible[&CurveKind::Crease] - edges * edge).abs() < 1e-9, "{eye}: {visible:?}");
        assert_eq!(visible.len(), 1);
    }
}

/// The outline of a smooth mesh is the polygon of edges between facets that face the eye and facets that do not: on a
/// convex mesh it is the hull of its projection, seen once, and nothing else is seen.
#[test]
fn a_ball_of_facets_shows_its_outline_once() {
    let faces = icosphere(2);
    let (surfaces, report) = read(soup(&faces));
    assert_eq!((surfaces.len(), report.healed.len()), (320, 0));
    for eye in AXES.into_iter().chain([DVec3::new(1.0, -1.3, 0.8), DVec3::new(0.3, 0.1, 2.0)]) {
        let strokes = drawn(surfaces.clone(), eye);
        assert!(strokes.iter().all(|s| s.kind == CurveKind::Silhouette), "{eye}");
        let eye = eye.normalize();
        let (u, v) = eye.any_orthonormal_pair();
        let on_screen: f64 = strokes
            .iter()
            .flat_map(|s| s.points.windows(2))
            .map(|w| {
                let d = w[1].model - w[0].model;
                d.dot(u).hypot(d.dot(v))
            })
            .sum();
        let corners: Vec<_> = faces.iter().flatten().map(|p| [p.dot(u), p.dot(v)]).collect();
        let expected = hull_length(corners);
        assert!((on_screen - expected).abs() < 1e-4, "{eye}: {on_screen}, not {expected}");
    }
}

/// Length round the convex hull of points, by Andrew's monotone chains.
fn hull_length(mut points: Vec<[f64; 2]>) -> f64 {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut hull: Vec<[f64; 2]> = Vec::new();
        for p in points {
            let turns = |a: [f64; 2], b: [f64; 2]| (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
            while hull.len() > 1 && turns(hull[hull.len() - 2], hull[hull.len() - 1]) <= 0.0 {
                hull.pop();
            }
            hull.push(p);
        }
        hull.windows(2).map(|w| (w[1][0] - w[0][0]).hypot(w[1][1] - w[0][1])).sum::<f64>()
    };
    chain(&mut points.iter().copied()) + chain(&mut points.iter().rev().copied())
}

#[test]
fn what_is_wrong_is_put_right_and_told() {
    let ulp = 2_f64.powi(-23);
    let mut triangles = cube();
    // A corner that was computed twice, a needle, a triangle that is one point, one that is there twice, and one that
    // goes round the other way.
    let far = triangles.iter().position(|t| t.contains(&DVec3::ONE)).unwrap();
    triangles[far] = triangles[far].map(|p| if p == DVec3::ONE { p - DVec3::X * ulp } else { p });
    triangles.push([DVec3::ZERO, DVec3::X, DVec3::X * 0.5]);
    triangles.push([DVec3::Y; 3]);
    let [a, b, c] = triangles[7];
    triangles.push([b, c, a]);
    triangles[5].reverse();
    let (surfaces, report) = read(soup(&triangles));
    assert_eq!(
        report.healed,
        [
            "welded 1 corner to others, at most 1.2e-7 away",
            "dropped 2 facets without area",
            "dropped 1 facet that is there already",
            "turned 1 facet round to agree with their neighbours",
        ]
    );
    assert_eq!(report.problems, Vec::<String>::new());
    let (whole, _) = read(soup(&cube()));
    assert_eq!(surfaces.len(), 12);
    let eye = DVec3::new(1.0, -1.3, 0.8);
    let (healed, whole) = (ink(&drawn(surfaces, eye)), ink(&drawn(whole, eye)));
    assert_eq!(healed.keys().collect::<Vec<_>>(), whole.keys().collect::<Vec<_>>());
    assert!((healed[&CurveKind::Crease] - 9.0).abs() < 1e-5, "{healed:?}");
}

/// A corner in the middle of the edge of a face beside it, off it by what the file rounds, far from the origin, where that
/// is more than stitching by geometry would join.
#[test]
fn edges_that_a_corner_parts_are_joined_on_both_sides_of_it() {
    for offset in [0.0, 1e4] {
        let origin = DVec3::new(offset, -offset, 0.5 * offset);
        let rounded = |p: DVec3| (p + origin).as_vec3().as_dvec3();
        let mut triangles: Vec<[DVec3; 3]> = cube();
        // One of the two triangles beside the edge from 0 to X is two, parted at a third of it.
        let middle = DVec3::X / 3.0;
        let has = |t: &[DVec3; 3], p: DVec3| t.contains(&p);
        let k = triangles.iter().position(|t| has(t, DVec3::ZERO) && has(t, DVec3::X)).unwrap();
        let t = triangles.remove(k);
        let (mut low, mut high) = (t, t);
        low.iter_mut().filter(|p| **p == DVec3::X).for_each(|p| *p = middle);
        high.iter_mut().filter(|p| **p == DVec3::ZERO).for_each(|p| *p = middle);
        triangles.extend([low, high]);
        let moved: Vec<[DVec3; 3]> = triangles.iter().map(|t| t.map(rounded)).collect();
        let (surfaces, report) = read(soup(&moved));
        assert_eq!(report.healed.len(), 1, "{report:?}");
        assert!(report.healed[0].starts_with("parted 1 edge at corners of other facets"), "{report:?}");
        for eye in [DVec3::new(1.0, -1.3, 0.8), DVec3::new(1.0, -1.3, -0.8)] {
            let visible = ink(&drawn(surfaces.clone(), eye));
            assert_eq!(visible.keys().collect::<Vec<_>>(), [&CurveKind::Crease], "{offset}: {visible:?}");
            assert!((visible[&CurveKind::Crease] - 9.0).abs() < 1e-6 * offset + 1e-9, "{offset}: {visible:?}");
        }
    }
}

#[test]
fn edges_of_three_facets_and_open_ones_are_drawn() {
    let [o, x, y, z] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    let (surfaces, report) = read(soup(&[[o, x, y], [o, x, z], [o, x, -y]]));
    assert_eq!(
        report.problems,
        ["1 edge is in more than two facets, the first from [0, 0, 0] to [1, 0, 0]; each is drawn as a crease"]
    );
    let visible = ink(&drawn(surfaces, DVec3::new(0.2, 0.3, 1.0)));
    assert!((visible[&CurveKind::Crease] - 1.0).abs() < 1e-9, "{visible:?}");
    assert!(visible[&CurveKind::Boundary] > 3.0, "{visible:?}");
}

#[test]
fn a_strip_with_one_side_is_told() {
    let at = |k: usize, side: f64| {
        let angle = std::f64::consts::TAU * k as f64 / 12.0;
        let (ring, axis) = (DVec3::new(angle.cos(), angle.sin(), 0.0), DVec3::Z);
        ring + side * 0.3 * (ring * (angle / 2.0).cos() + axis * (angle / 2.0).sin())
    };
    let mut triangles = Vec::new();
    for k in 0..12 {
        let (a, b) = (at(k, -1.0), at(k, 1.0));
        let (c, d) = if k < 11 { (at(k + 1, -1.0), at(k + 1, 1.0)) } else { (at(0, 1.0), at(0, -1.0)) };
        triangles.extend([[a, b, c], [b, d, c]]);
    }
    let (surfaces, report) = read(soup(&triangles));
    assert_eq!(surfaces.len(), 24);
    assert_eq!(
        report.problems,
        ["the surface has one side only: at 1 edge neighbours cannot agree which is the front"]
    );
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// However the triangles of a closed body are ordered, turned and begun, and wherever it is, what is read is the same.
    #[test]
    fn order_and_sense_of_facets_do_not_matter(
        order in Just((0..80).collect::<Vec<usize>>()).prop_shuffle(),
        starts in prop::collection::vec(0_usize..3, 80),
        turned in prop::collection::vec(prop::bool::weighted(0.3), 80),
        far in 0.0_f64..1e3,
    ) {
        let origin = DVec3::new(far, 0.5 * far, -far);
        let faces: Vec<[DVec3; 3]> = icosphere(1).iter().map(|t| t.map(|p| (p + origin).as_vec3().as_dvec3())).collect();
        let shuffled: Vec<[DVec3; 3]> = order
            .iter()
            .map(|&k| {
                let mut t = faces[k];
                t.rotate_left(starts[k]);
                if turned[k] {
                    t.reverse();
                }
                t
            })
            .collect();
        let (surfaces, report) = read(soup(&shuffled));
        prop_assert_eq!(surfaces.len(), 80);
        prop_assert_eq!(report.problems, Vec::<String>::new());
        // All fronts look outwards, or all inwards.
        let middle = origin;
        let outward = |s: &SceneSurface| {
            let (p, du, dv) = s.surface.derivatives(0.5, 0.5);
            du.cross(dv).dot(p - middle) > 0.0
        };
        let first = outward(&surfaces[0]);
        prop_assert!(surfaces.iter().all(|s| outward(s) == first));
        let ink = ink(&drawn(surfaces, DVec3::new(0.5, -1.0, 0.7)));
        let expected = self::ink(&drawn(read(soup(&faces)).0, DVec3::new(0.5, -1.0, 0.7)));
        prop_assert_eq!(ink.len(), expected.len());
        for (kind, length) in ink {
            prop_assert!((length - expected[&kind]).abs() < 1e-6 * (1.0 + far));
        }
    }
}
