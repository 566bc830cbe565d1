//! Curves whose parameter runs very unevenly: all of a picture's ends and crossings may be at one end of it.

use glam::{DVec2, DVec3, DVec4};
use penvis_core::nurbs::{Curve, KnotVector, Surface};
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::scene::{Scene, SceneSurface};
use penvis_core::shape::{plane, polyline};
use penvis_core::trim::Trims;
use penvis_core::view::Camera;
use penvis_core::visibility::Method;

/// Visible length of the outlines of one surface, seen from above, with either method.
fn visible_border(surfaces: &[SceneSurface], of: usize) -> [f64; 2] {
    [Method::Rays, Method::Propagate].map(|visibility| {
        let scene = Scene { name: "tips".into(), surfaces: surfaces.to_vec() };
        let camera = Camera::orthographic(DVec3::Z, DVec3::Y).expect("a camera");
        let options = DrawOptions { isos: 0, visibility, ..DrawOptions::default() };
        let prepared = Prepared::new(&scene, &camera, &options, &()).expect("a picture");
        let traced = prepared.trace(1e-7, &()).expect("nothing stops it");
        assert_eq!(traced.stats.visibility.disagreements, 0, "{:?}", traced.stats.visibility.tolerated);
        let own = traced.strokes.iter().filter(|s| s.surface == of);
        own.flat_map(|s| s.points.windows(2)).map(|w| w[0].model.distance(w[1].model)).sum()
    })
}

fn rectangle(x: [f64; 2], y: [f64; 2], z: f64) -> SceneSurface {
    let corner = DVec3::new(x[0], y[0], z);
    SceneSurface::new("rectangle", plane(corner, DVec3::X * (x[1] - x[0]), DVec3::Y * (y[1] - y[0])).expect("a plane"))
}

/// The unit square, whose lower border runs from 0 to 1 with weights from 1 to `weight`.
fn weighted(weight: f64) -> SceneSurface {
    let corner = |x: f64, y: f64, w: f64| DVec4::new(x, y, 0.0, w);
    let points = vec![corner(0.0, 0.0, 1.0), corner(0.0, 1.0, 1.0), corner(1.0, 0.0, weight), corner(1.0, 1.0, weight)];
    let knots = || KnotVector::bezier(1, [0.0, 1.0]).expect("knots");
    SceneSurface::new(format!("weighted {weight}"), Surface::new(knots(), knots(), points).expect("a surface"))
}

/// Degree `p` in u, all of whose control points but the last are on the border u = 0: x = uᵖ.
fn crowded(p: usize) -> SceneSurface {
    let corner = |i: usize, y: f64| DVec4::new(if i == p { 1.0 } else { 0.0 }, y, 0.0, 1.0);
    let points = (0..=p).flat_map(|i| [corner(i, 0.0), corner(i, 1.0)]).collect();
    let knots = |d| KnotVector::bezier(d, [0.0, 1.0]).expect("knots");
    SceneSurface::new("crowded", Surface::new(knots(p), knots(1), points).expect("a surface"))
}

#[test]
fn crossings_at_one_end_of_the_parameter_are_told_apart() {
    for face in [weighted(1.0), weighted(1e5), weighted(1e9), weighted(1e-9), crowded(3), crowded(9)] {
        for x in [[0.3, 0.6], [0.5, 0.9], [1e-3, 2e-3], [0.01, 0.97], [0.999, 0.9995]] {
            // A bar across both borders that run unevenly.
            let scene = [face.clone(), rectangle(x, [-0.5, 1.5], 1.0)];
            for found in visible_border(&scene, 0) {
                let expected = 4.0 - 2.0 * (x[1] - x[0]);
                assert!((found - expected).abs() < 1e-5, "{} {x:?}: {found} instead of {expected}", face.name);
            }
        }
    }
}

/// A border with four spans in its first hundred-millionth part: its middle by parameter lies there.
fn with_a_tip(spans: usize, tip: f64) -> SceneSurface {
    // The parameters are the coordinates.
    let knots = || KnotVector::bezier(1, [-1.0, 2.0]).expect("knots");
    let points = [(-1.0, -1.0), (-1.0, 2.0), (2.0, -1.0), (2.0, 2.0)].map(|(x, y)| DVec4::new(x, y, 0.0, 1.0));
    let surface = Surface::new(knots(), knots(), points.to_vec()).expect("a plane");
    let mut along: Vec<DVec4> = (0..=spans).map(|k| DVec4::new(tip * k as f64 / spans as f64, 0.0, 0.0, 1.0)).collect();
    along.push(DVec4::new(1.0, 0.0, 0.0, 1.0));
    let count = along.len();
    let mut knots: Vec<f64> = (0..count).map(|k| k as f64).collect();
    knots.insert(0, 0.0);
    knots.push((count - 1) as f64);
    let lower = Curve::new(KnotVector::new(knots, 1).expect("knots"), along).expect("a curve");
    let rest = [DVec2::new(1.0, 0.0), DVec2::new(1.0, 1.0), DVec2::new(0.0, 1.0), DVec2::ZERO].map(|p| p.extend(0.0));
    let loops = [vec![lower, polyline(&rest).expect("a polygon")]];
    SceneSurface { trims: Some(Trims::new(&surface, &loops).expect("trims")), ..SceneSurface::new("tip", surface) }
}

#[test]
fn what_is_nearer_at_the_tip_of_a_border_does_not_take_the_rest_of_it() {
    for (spans, tip) in [(4, 1e-8), (4, 3e-8), (9, 2e-8), (40, 1e-7)] {
        let face = with_a_tip(spans, tip);
        // A nearer face with a side that lies on the same line on the screen, and ends within the tip.
        let scene = [face, rectangle([-1.0, 0.9 * tip], [-1.0, 0.0], 1.0)];
        for found in visible_border(&scene, 0) {
            assert!((found - 4.0).abs() < 1e-5, "{spans} spans: {found}");
        }
    }
}
