use alloc::vec;
use alloc::vec::Vec;

use glam::{DVec2, DVec3, DVec4};

use super::*;
use crate::extract::facing::{FacingForm, facing_of_all};
use crate::nurbs::Surface;
use crate::scene::{Scene, SceneSurface};
use crate::shape::{Frame, cylinder, plane, sphere, torus};
use crate::stitch::StitchOptions;
use crate::trim::Trims;
use crate::view::{Camera, ViewScene};

struct Seen {
    view: ViewScene,
    forms: Vec<FacingForm>,
    stitching: Stitching,
}

impl Seen {
    fn new(surfaces: Vec<Surface>, camera: &Camera) -> Self {
        let named = surfaces.into_iter().map(|surface| SceneSurface::new("s", surface));
        Self::of(named.collect(), camera)
    }

    fn of(surfaces: Vec<SceneSurface>, camera: &Camera) -> Self {
        let view = ViewScene::new(&Scene { name: "s".into(), surfaces }, camera).unwrap();
        let (forms, _) = facing_of_all(view.patches(), Stop::NEVER);
        let options = StitchOptions { distance: 1e-6 * view.size(), angle: 0.02 };
        let stitching = Stitching::new(&view, &options, Stop::NEVER);
        Self { view, forms, stitching }
    }

    fn render(&self, grid: &PixelGrid) -> Raster {
        let g = Geometry { view: &self.view, forms: &self.forms };
        let raster = render(&g, &self.stitching, grid, Stop::NEVER);
        self.check(&raster);
        raster
    }

    /// What is painted are points of the surfaces, in the pixels that hold them.
    fn check(&self, raster: &Raster) {
        for (k, s) in raster.samples.iter().enumerate().filter_map(|(k, s)| s.map(|s| (k, s))) {
            let p = self.view.patches()[s.patch].eval(s.at.x, s.at.y);
            let place = raster.grid.place(p.truncate());
            let pixel = DVec2::new((k % raster.grid.width) as f64, (k / raster.grid.width) as f64);
            assert!((place - pixel - 0.5).abs().max_element() < 0.5 + 1e-9, "{place} in {pixel}");
            assert!((p.z - s.z).abs() < 1e-12 * self.view.size());
        }
    }
}

fn front() -> Camera {
    Camera::orthographic(DVec3::NEG_Y, DVec3::Z).unwrap()
}

/// A square of pixels round the middle of the screen.
fn square(half: f64, pixels: usize) -> PixelGrid {
    let corner = DVec2::new(-half, half);
    PixelGrid { corner, pixel: 2.0 * half / pixels as f64, width: pixels, height: pixels }
}

fn pixels(grid: &PixelGrid) -> impl Iterator<Item = (usize, usize)> + use<> {
    let (width, height) = (grid.width, grid.height);
    (0..height).flat_map(move |row| (0..width).map(move |column| (column, row)))
}

/// Distances of the nearest and the farthest point of a pixel from the middle of the screen.
fn reach(centre: DVec2, pixel: f64) -> [f64; 2] {
    let nearest = (centre.abs() - 0.5 * pixel).max(DVec2::ZERO);
    [nearest.length(), (centre.abs() + 0.5 * pixel).length()]
}

/// A ball of radius 1 in the middle of the screen, from whatever side: painted where it covers the middle of a pixel, not
/// where it touches no part of it, and no deeper than anywhere in the pixel.
fn is_a_ball(raster: &Raster, radius: f64) {
    let grid = &raster.grid;
    let mut between = 0;
    for (column, row) in pixels(grid) {
        let centre = grid.centre(column, row);
        let [nearest, farthest] = reach(centre, grid.pixel);
        let sample = raster.sample(column, row);
        if centre.length() <= radius {
            let deepest = libm::sqrt((radius * radius - farthest * farthest).max(0.0));
            let z = sample.unwrap_or_else(|| panic!("nothing at {column}, {row}")).z;
            let highest = libm::sqrt(radius * radius - nearest * nearest);
            assert!(z >= deepest - 1e-12 && z <= highest + 1e-12, "{column}, {row}: {z} from {deepest} to {highest}");
        } else if nearest > radius {
            assert_eq!(sample, None, "{column}, {row}");
        } else {
            between += 1;
        }
    }
    // The rim crosses less than 8 radii of pixels.
    assert!(f64::from(between) < 8.0 * radius / grid.pixel);
}

#[test]
fn a_ball_fills_its_disk_from_any_side_at_any_size() {
    let ball = sphere(&Frame::WORLD, 1.0).unwrap();
    // From the side, along the axis so that a pole is in the middle, and askew.
    for eye in [DVec3::NEG_Y, DVec3::Z, DVec3::new(0.3, -0.5, 0.8)] {
        let camera = Camera::orthographic(eye, DVec3::new(0.0, 1.0, 0.1)).unwrap();
        let seen = Seen::new(vec![ball.clone()], &camera);
        for n in [3, 20, 131, 500] {
            is_a_ball(&seen.render(&square(1.1, n)), 1.0);
        }
    }
}

#[test]
fn perspective_is_exact() {
    let camera = Camera::perspective(DVec3::new(0.0, -2.5, 0.0), DVec3::ZERO, DVec3::Z).unwrap();
    let seen = Seen::new(vec![sphere(&Frame::WORLD, 1.0).unwrap()], &camera);
    let grid = square(1.3, 300);
    let raster = seen.render(&grid);
    // The cone of tangents from the eye: a disk of radius f tan α, sin α = 1 / f.
    let radius = 2.5 / libm::sqrt(2.5 * 2.5 - 1.0);
    for (column, row) in pixels(&grid) {
        let centre = grid.centre(column, row);
        let painted = raster.sample(column, row).is_some();
        assert!(painted || centre.length() > radius);
        assert!(!painted || reach(centre, grid.pixel)[0] <= radius);
    }
    // The nearest point is 1.5 from the eye, where lengths are 2.5 / 1.5 of those at the target.
    let middle = raster.sample(150, 150).unwrap();
    assert!((middle.z - 2.5 / 1.5).abs() < 1e-4);
}

#[test]
fn the_nearer_surface_wins_in_whatever_order_they_come() {
    let wall = |y: f64| plane(DVec3::new(-1.0, y, -1.0), 2.0 * DVec3::X, 2.0 * DVec3::Z).unwrap();
    let ball = sphere(&Frame::WORLD, 0.5).unwrap();
    let grid = square(0.9, 100);
    for order in [[0, 1, 2], [2, 1, 0], [1, 2, 0]] {
        // A wall behind, one through the middle of the ball, and the ball.
        let all = [wall(1.0), wall(0.0), ball.clone()];
        let seen = Seen::new(order.iter().map(|&k: &usize| all[k].clone()).collect(), &front());
        let raster = seen.render(&grid);
        for (column, row) in pixels(&grid) {
            let [nearest, farthest] = reach(grid.centre(column, row), grid.pixel);
            let sample = raster.sample(column, row).unwrap();
            let surface = order[seen.view.patches()[sample.patch].surface];
            assert!(surface != 0, "what is behind a wall");
            if farthest < 0.5 {
                assert_eq!(surface, 2);
            } else if nearest > 0.5 {
                assert_eq!((surface, sample.z), (1, 0.0));
            }
        }
    }
}

#[test]
fn a_closed_cylinder_is_a_rectangle_and_seen_along_its_axis_nothing() {
    let tube = cylinder(&Frame::WORLD, 1.0, 1.5).unwrap();
    let grid = PixelGrid { corner: DVec2::new(-1.5, 2.0), pixel: 0.017, width: 180, height: 150 };
    let raster = Seen::new(vec![tube.clone()], &front()).render(&grid);
    for (column, row) in pixels(&grid) {
        let p = grid.centre(column, row);
        let off = (p.x.abs() - 1.0).max(-p.y).max(p.y - 1.5);
        let painted = raster.sample(column, row).is_some();
        assert!(painted || off > 0.0, "{column}, {row}");
        assert!(!painted || off <= 0.5 * grid.pixel + 1e-12, "{column}, {row}");
    }
    let along = Camera::orthographic(DVec3::Z, DVec3::Y).unwrap();
    assert_eq!(Seen::new(vec![tube], &along).render(&square(1.1, 50)).painted(), 0);
}

#[test]
fn the_rows_are_the_same_whichever_grid_they_are_part_of() {
    let seen = Seen::new(vec![torus(&Frame::WORLD, 3.0, 1.0).unwrap()], &front());
    let whole = seen.render(&square(4.2, 120));
    let mut part = whole.grid;
    (part.width, part.height) = (70, 50);
    let cut = seen.render(&part);
    for (column, row) in pixels(&part) {
        assert_eq!(cut.sample(column, row), whole.sample(column, row));
    }
    let empty = PixelGrid { width: 0, ..part };
    assert!(seen.render(&empty).samples.is_empty());
    for pixel in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(seen.render(&PixelGrid { pixel, ..part }).painted(), 0);
    }
    assert_eq!(cut.sample(70, 0), None);
    assert_eq!(cut.sample(0, 50), None);
}

#[test]
fn a_ball_is_lit_by_lambert_and_its_poles_are_no_holes() {
    // The pole, where both surfaces' normals vanish, towards the eye.
    let camera = Camera::orthographic(DVec3::Z, DVec3::Y).unwrap();
    let seen = Seen::new(vec![sphere(&Frame::WORLD, 1.0).unwrap()], &camera);
    let grid = square(1.0, 201);
    let raster = seen.render(&grid);
    let light = DVec3::new(-2.0, 1.0, 3.0);
    let shades = shade(&raster, &seen.view, light, Stop::NEVER);
    for (column, row) in pixels(&grid) {
        let k = row * grid.width + column;
        let (Some(sample), Some(found)) = (raster.samples[k], shades[k]) else {
            assert!(raster.samples[k].is_none() && shades[k].is_none());
            continue;
        };
        // A point of the unit ball is its own normal.
        let normal = seen.view.patches()[sample.patch].eval(sample.at.x, sample.at.y);
        let want = AMBIENT + (1.0 - AMBIENT) * normal.dot(light.normalize()).max(0.0);
        // In a pixel at the rim too, where the point may be right behind it.
        assert!(normal.z > -0.15 && (found - want).abs() < 2e-3, "{column}, {row}: {found} for {want}");
    }
}

#[test]
fn the_exact_pole_has_the_normal_beside_it() {
    let camera = Camera::orthographic(DVec3::new(0.2, -0.3, 1.0), DVec3::Y).unwrap();
    let seen = Seen::new(vec![sphere(&Frame::WORLD, 1.0).unwrap()], &camera);
    let corners = (0..seen.view.patches().len()).flat_map(|k| [0.0, 1.0].map(|t| (k, DVec2::new(0.3, t))));
    let pole = |&(k, at): &(usize, DVec2)| {
        let jet = seen.view.patches()[k].jet(at.x, at.y);
        jet.normal().length() < 1e-12 && jet.p.z > 0.0
    };
    let (patch, at) = corners.into_iter().find(pole).unwrap();
    let sample = Sample { z: 1.0, patch, at };
    let raster = Raster {
        grid: PixelGrid { corner: DVec2::ZERO, pixel: 1.0, width: 1, height: 1 },
        samples: vec![Some(sample)],
        stats: RasterStats::default(),
    };
    let found = shade(&raster, &seen.view, DVec3::Z, Stop::NEVER)[0].unwrap();
    let eye = DVec3::new(0.2, -0.3, 1.0).normalize();
    assert!((found - AMBIENT - (1.0 - AMBIENT) * eye.z).abs() < 1e-2, "{found}");
}

#[test]
fn knots_weights_and_degree_leave_no_gap() {
    let knots = || crate::nurbs::KnotVector::new(vec![0.0, 0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 1.0], 3).unwrap();
    let points = (0..25).map(|k| {
        let (i, j) = (f64::from(k / 5), f64::from(k % 5));
        let w = 1.0 + 0.8 * libm::sin(3.0 * i + 2.0 * j);
        DVec4::new(i, libm::cos(2.0 * i) * libm::sin(1.3 * j), j, w)
    });
    let sheet = Surface::new(knots(), knots(), points.collect()).unwrap();
    let grid = PixelGrid { corner: DVec2::new(-0.5, 4.5), pixel: 0.025, width: 200, height: 200 };
    let sheets = [
        sheet.clone(),
        sheet.elevated(5, 9).unwrap(),
        sheet.insert_knot_u(0.2, 3).unwrap().insert_knot_v(0.9, 1).unwrap(),
    ];
    for surface in sheets {
        let raster = Seen::new(vec![surface], &front()).render(&grid);
        // The sheet's outline from the front is the square of its corners.
        for (column, row) in pixels(&grid) {
            let p = grid.centre(column, row);
            let off = (-p).max(p - 4.0).max_element();
            let painted = raster.sample(column, row).is_some();
            assert!(painted || off > 0.0, "{p}");
            assert!(!painted || off <= 0.5 * grid.pixel + 1e-12, "{p}");
        }
    }
}

#[test]
fn it_stops() {
    let seen = Seen::new(vec![torus(&Frame::WORLD, 3.0, 1.0).unwrap()], &front());
    let g = Geometry { view: &seen.view, forms: &seen.forms };
    let wanted = || true;
    assert_eq!(render(&g, &seen.stitching, &square(4.0, 4000), Stop::when(&wanted)).painted(), 0);
}

#[test]
fn a_hole_is_left_out_and_its_rim_is_not() {
    let plate = plane(DVec3::new(-1.0, 0.0, -1.0), 2.0 * DVec3::X, 2.0 * DVec3::Z).unwrap();
    let frame = |radius: f64| {
        let middle = Frame::new(DVec3::new(0.5, 0.5, 0.0), DVec3::Z, DVec3::X).unwrap();
        vec![crate::shape::circle(&middle, radius).unwrap()]
    };
    // In the parameters, both of which are half of lengths: a ring of radii 0.3 and 0.9.
    let trims = Trims::new(&plate, &[frame(0.45), frame(0.15)]).unwrap();
    let surface = SceneSurface { trims: Some(trims), ..SceneSurface::new("plate", plate) };
    let seen = Seen::of(vec![surface], &front());
    for pixels_across in [7, 40, 133] {
        let grid = square(1.1, pixels_across);
        let raster = seen.render(&grid);
        for (column, row) in pixels(&grid) {
            let (r, half) = (grid.centre(column, row).length(), grid.pixel * core::f64::consts::FRAC_1_SQRT_2);
            let painted = raster.sample(column, row).is_some();
            if r > 0.3 && r < 0.9 {
                assert!(painted, "{column} {row} of {pixels_across}");
            }
            if r + half < 0.3 || r - half > 0.9 {
                assert!(!painted, "{column} {row} of {pixels_across}");
            }
        }
    }
}

#[test]
fn facets_of_meshes_are_painted_like_other_surfaces() {
    let wall = plane(DVec3::new(-1.0, 0.0, -1.0), 2.0 * DVec3::X, 2.0 * DVec3::Z).unwrap();
    let facet =
        SceneSurface { facet: Some(crate::scene::Facet { crease_angle: 0.5 }), ..SceneSurface::new("facet", wall) };
    let raster = Seen::of(vec![facet], &front()).render(&square(0.9, 30));
    assert!(raster.samples.iter().all(Option::is_some));
}
