//! Regions without silhouettes: those that overlap themselves on the screen are found and split.

use std::f64::consts::PI;

use glam::{DVec2, DVec3, DVec4};
use penvis_core::arrange::region::{Part, Region};
use penvis_core::nurbs::{KnotVector, Surface};
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::scene::{Scene, SceneSurface};
use penvis_core::shape::{Frame, cone, sphere, torus};
use penvis_core::view::Camera;

fn prepared(surface: &Surface, eye: DVec3) -> Prepared {
    let surfaces = vec![SceneSurface::new("s", surface.clone())];
    let up = if eye.z.abs() > 0.9 * eye.length() { DVec3::Y } else { DVec3::Z };
    let camera = Camera::orthographic(eye, up).expect("a camera");
    let options = DrawOptions { isos: 0, ..DrawOptions::default() };
    Prepared::new(&Scene { name: String::new(), surfaces }, &camera, &options, &()).expect("a picture")
}

/// A ramp that winds up round the z axis: between radii 1 and 2, control points at equal angles.
fn ramp(degree: usize, controls: usize, turn: f64) -> Surface {
    let along = KnotVector::uniform(degree, controls - degree, [0.0, 1.0]).expect("knots");
    let across = KnotVector::bezier(1, [0.0, 1.0]).expect("knots");
    let points = (0..2 * controls).map(|k| {
        let (t, r) = ((k / 2) as f64 / (controls - 1) as f64, 1.0 + (k % 2) as f64);
        DVec4::new(r * (turn * t).cos(), r * (turn * t).sin(), 2.0 * t, 1.0)
    });
    Surface::new(along, across, points.collect()).expect("a surface")
}

/// The largest number of points of a part over one point of the screen, from the cells of a fine grid.
fn layers(p: &Prepared, surface: &Surface, part: &Part) -> usize {
    const N: usize = 60;
    let camera = p.geometry().view.camera();
    let at = |i: usize, j: usize| {
        let (s, t) = (i as f64 / N as f64, j as f64 / N as f64);
        let q = surface.eval(part.u[0] + s * (part.u[1] - part.u[0]), part.v[0] + t * (part.v[1] - part.v[0]));
        camera.project(q).expect("in front of the eye").truncate()
    };
    let triangles: Vec<[DVec2; 3]> = (0..N * N)
        .flat_map(|k| {
            let (i, j) = (k / N, k % N);
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
        })
        // At a pole triangles have no area but rounding.
        .filter(|[a, b, c]| (*b - *a).perp_dot(*c - *a).abs() > 1e-12)
        .collect();
    let covers = |[a, b, c]: &[DVec2; 3], q: DVec2| {
        let s = [(*b - *a).perp_dot(q - *a), (*c - *b).perp_dot(q - *b), (*a - *c).perp_dot(q - *c)];
        s.iter().all(|&x| x > 0.0) || s.iter().all(|&x| x < 0.0)
    };
    // Inside triangles, where neither of two neighbours is hit twice.
    let probes = triangles.iter().step_by(7).map(|t| 0.31 * t[0] + 0.42 * t[1] + 0.27 * t[2]);
    probes.map(|q| triangles.iter().filter(|t| covers(t, q)).count()).max().unwrap_or(0)
}

fn regions(p: &Prepared) -> Vec<Region> {
    p.regions()
}

#[test]
fn a_ramp_of_more_than_a_turn_overlaps_itself_and_is_split() {
    // The figure 2 of Elber and Cohen 1989: a B-spline of many spans, and one Bézier patch of the highest degree.
    for surface in [ramp(3, 20, 3.3 * PI), ramp(9, 10, 3.8 * PI)] {
        let p = prepared(&surface, DVec3::Z);
        let found = regions(&p);
        assert_eq!(p.stats().chains.components, 0, "no silhouettes");
        assert_eq!(found.len(), 1);
        let whole = Part { u: [0.0, 1.0], v: [0.0, 1.0], one_to_one: false };
        assert!(layers(&p, &surface, &whole) > 1, "it does overlap");
        assert!(found[0].overlaps_itself());
        assert!(found[0].parts.len() > 1 && found[0].parts.iter().all(|q| q.one_to_one), "{:?}", found[0].parts);
        for part in &found[0].parts {
            assert_eq!(layers(&p, &surface, part), 1, "{part:?}");
        }
        let area: f64 = found[0].parts.iter().map(|q| (q.u[1] - q.u[0]) * (q.v[1] - q.v[0])).sum();
        assert!((area - 1.0).abs() < 1e-12, "the parts cover the region");
    }
}

#[test]
fn what_does_not_overlap_itself_is_left_whole() {
    let arch = ramp(3, 12, 1.7 * PI);
    for surface in [&arch, &arch.reversed_u(), &arch.transposed()] {
        let found = regions(&prepared(surface, DVec3::Z));
        assert_eq!(found.len(), 1);
        assert!(!found[0].overlaps_itself(), "{found:?}");
    }
    // A cone from above its tip: a seam, a pole and a base.
    let tip = cone(&Frame::WORLD, 1.0, 0.0, 2.0).expect("a cone");
    let found = regions(&prepared(&tip, DVec3::new(0.1, 0.2, 1.0)));
    assert_eq!(found.len(), 1);
    assert!(!found[0].overlaps_itself(), "{found:?}");
}

#[test]
fn patches_between_silhouettes_are_one_to_one() {
    let shapes = [sphere(&Frame::WORLD, 1.0).expect("a sphere"), torus(&Frame::WORLD, 3.0, 1.0).expect("a torus")];
    for eye in [DVec3::new(1.0, -1.6, 0.75), DVec3::Z, DVec3::new(0.0, 1.0, 0.2)] {
        for shape in &shapes {
            let p = prepared(shape, eye);
            let found = regions(&p);
            assert!(!found.is_empty(), "{eye}");
            for part in found.iter().flat_map(|r| &r.parts) {
                assert!(part.one_to_one, "{eye} {part:?}");
                assert_eq!(layers(&p, shape, part), 1, "{eye} {part:?}");
            }
        }
    }
}
