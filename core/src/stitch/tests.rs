use super::*;
use crate::nurbs::{KnotVector, Surface};
use crate::scene::{Facet, Scene, SceneSurface};
use crate::shape::{Frame, cylinder, plane, sphere, torus};
use crate::view::Camera;
use alloc::vec;

fn stitched(surfaces: Vec<Surface>) -> Stitching {
    let surfaces = surfaces.into_iter().map(|surface| SceneSurface::new("s", surface)).collect();
    let camera = Camera::orthographic(DVec3::new(1.0, -2.0, 0.7), DVec3::Z).unwrap();
    let view = ViewScene::new(&Scene { name: "t".into(), surfaces }, &camera).unwrap();
    Stitching::new(&view, &StitchOptions { distance: 1e-6 * view.size(), angle: 0.02 }, Stop::NEVER)
}

fn classes(s: &Stitching) -> [usize; 3] {
    let count = |c| s.edges.iter().filter(|e| e.class == c).count();
    [count(EdgeClass::Boundary), count(EdgeClass::Crease), count(EdgeClass::Smooth)]
}

fn square(origin: DVec3, u: DVec3, v: DVec3) -> Surface {
    plane(origin, u, v).unwrap()
}

#[test]
fn a_lone_square_has_four_boundaries() {
    assert_eq!(classes(&stitched(vec![square(DVec3::ZERO, DVec3::X, DVec3::Y)])), [4, 0, 0]);
}

#[test]
fn sides_of_one_edge_are_joined_whatever_their_distance() {
    use crate::shape::polyline;
    use crate::trim::{TrimCurve, Trims};
    // Two squares that end a hundredth apart, at the border of the one and inside the other.
    let joined = |right: DVec3, edges: [u32; 2]| {
        let left = square(DVec3::ZERO, DVec3::X, DVec3::Y);
        let right = square(DVec3::new(0.99, 0.0, 0.0), right, DVec3::Y);
        let part = |surface: Surface, u: [f64; 2], edges: [Option<u32>; 4]| {
            let corners = [[u[0], 0.0], [u[1], 0.0], [u[1], 1.0], [u[0], 1.0], [u[0], 0.0]];
            let side = |w: &[[f64; 2]]| polyline(&[w[0], w[1]].map(|c| DVec3::new(c[0], c[1], 0.0))).unwrap();
            let curves = corners.windows(2).zip(edges).map(|(w, edge)| TrimCurve { curve: side(w), edge });
            let trims = Trims::oriented(&surface, [false; 2], &[curves.collect()]).unwrap();
            SceneSurface { trims: Some(trims), ..SceneSurface::new("part", surface) }
        };
        let surfaces = vec![
            part(left, [0.0, 1.0], [None, Some(edges[0]), None, None]),
            part(right, [0.02, 1.0], [None, None, None, Some(edges[1])]),
        ];
        let camera = Camera::orthographic(DVec3::new(1.0, -2.0, 0.7), DVec3::Z).unwrap();
        let view = ViewScene::new(&Scene { name: "t".into(), surfaces }, &camera).unwrap();
        self::classes(&Stitching::new(&view, &StitchOptions { distance: 1e-6, angle: 0.02 }, Stop::NEVER))
    };
    assert_eq!(joined(DVec3::X, [7, 7]), [6, 0, 2]);
    assert_eq!(joined(DVec3::Z, [7, 7]), [6, 2, 0]);
    assert_eq!(joined(DVec3::X, [7, 8]), [8, 0, 0]);
}

#[test]
fn an_edge_round_corners_is_joined_part_by_part() {
    use crate::shape::polyline;
    use crate::trim::{TrimCurve, Trims};
    // A square with a square hole, and what fits into it, all of the seam one edge. Then that lies a little lower.
    for lower in [0.0, 0.01] {
        let ring = |corners: &[[f64; 2]], edge: Option<u32>| -> Vec<TrimCurve> {
            let side = |w: &[[f64; 2]]| polyline(&[w[0], w[1]].map(|c| DVec3::new(c[0], c[1], 0.0))).unwrap();
            corners.windows(2).map(|w| TrimCurve { curve: side(w), edge }).collect()
        };
        let all = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
        let hole = [[0.25, 0.25], [0.25, 0.75], [0.75, 0.75], [0.75, 0.25], [0.25, 0.25]];
        let part = |surface: Surface, loops: &[Vec<TrimCurve>]| {
            let trims = Trims::oriented(&surface, [false; 2], loops).unwrap();
            SceneSurface { trims: Some(trims), ..SceneSurface::new("part", surface) }
        };
        let plate = square(DVec3::ZERO, DVec3::X, DVec3::Y);
        let plug = square(DVec3::new(0.25, 0.25, -lower), 0.5 * DVec3::X, 0.5 * DVec3::Y);
        let surfaces = vec![part(plate, &[ring(&all, None), ring(&hole, Some(7))]), part(plug, &[ring(&all, Some(7))])];
        let camera = Camera::orthographic(DVec3::new(1.0, -2.0, 0.7), DVec3::Z).unwrap();
        let view = ViewScene::new(&Scene { name: "t".into(), surfaces }, &camera).unwrap();
        let s = Stitching::new(&view, &StitchOptions { distance: 1e-6, angle: 0.02 }, Stop::NEVER);
        assert_eq!(self::classes(&s), [4, 0, 8]);
        assert!(s.edges.iter().all(|e| (e.gap - if e.partners.is_empty() { 0.0 } else { lower }).abs() < 1e-12));
        assert!(s.edges.iter().all(|e| e.partners.len() <= 1));
    }
}

#[test]
fn a_short_part_of_a_loop_along_a_border_is_no_side_of_the_rest_of_the_loop() {
    use crate::shape::arc;
    use crate::trim::{TrimCurve, Trims};
    // A round plug on a square that is as large, at whose border its loop is straight for a little, longer than what is one
    // edge; and the plate round it, whose hole is the same loop.
    let (short, distance) = (1e-3, 1.3e-3);
    let flat = |centre: f64| Frame::new(DVec3::new(centre, centre, 0.0), DVec3::Z, DVec3::X).unwrap();
    let part = |half: f64, [lo, hi]: [f64; 2], outer: bool| {
        let scale = 1.0 / (2.0 * half);
        let round = arc(&flat(0.5), scale, short, core::f64::consts::TAU - short).unwrap();
        let ends = round.domain().map(|t| round.eval(t));
        let straight = crate::shape::line(ends[1], ends[0]).unwrap();
        let curve = |curve: &crate::nurbs::Curve| TrimCurve { curve: curve.clone(), edge: Some(7) };
        let ring = [curve(&round), curve(&straight)];
        let hole = [curve(&straight.reversed()), curve(&round.reversed())];
        let surface = square(DVec3::new(lo, lo, 0.0), (hi - lo) * DVec3::X, (hi - lo) * DVec3::Y);
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
        let side = |w: &[[f64; 2]]| crate::shape::polyline(&[w[0], w[1]].map(|c| DVec3::new(c[0], c[1], 0.0))).unwrap();
        let border = corners.windows(2).map(|w| TrimCurve { curve: side(w), edge: None });
        let loops = if outer { vec![border.collect(), hole.to_vec()] } else { vec![ring.to_vec()] };
        let trims = Trims::oriented(&surface, [false; 2], &loops).unwrap();
        SceneSurface { trims: Some(trims), ..SceneSurface::new("part", surface) }
    };
    let surfaces = vec![part(1.0, [-1.0, 1.0], false), part(2.0, [-2.0, 2.0], true)];
    let camera = Camera::orthographic(DVec3::new(0.5, 0.1, -0.8), DVec3::Z).unwrap();
    let view = ViewScene::new(&Scene { name: "t".into(), surfaces }, &camera).unwrap();
    let s = Stitching::new(&view, &StitchOptions { distance, angle: 0.02 }, Stop::NEVER);
    assert!(s.edges_of(1).any(|e| e.t[1] - e.t[0] < 4.0 * short), "the part along the border: {:?}", s.edges);
    assert!(s.edges.iter().all(|e| e.partners.len() <= 1), "{:?}", s.edges);
    let [boundaries, creases, _] = classes(&s);
    assert_eq!((boundaries, creases), (4, 0));
}

#[test]
fn facets_of_a_mesh_join_smoothly_up_to_the_angle_of_their_mesh() {
    let roof = |crease_angles: [f64; 2]| {
        let rising = square(DVec3::ZERO, DVec3::new(1.0, 0.0, 0.25), DVec3::Y);
        let falling = square(DVec3::new(1.0, 0.0, 0.25), DVec3::new(1.0, 0.0, -0.25), DVec3::Y);
        let facets = [rising, falling].into_iter().zip(crease_angles).map(|(surface, crease_angle)| SceneSurface {
            facet: Some(Facet { crease_angle }),
            ..SceneSurface::new("facet", surface)
        });
        let scene = Scene { name: "roof".into(), surfaces: facets.collect() };
        let camera = Camera::orthographic(DVec3::new(1.0, -2.0, 0.7), DVec3::Z).unwrap();
        let view = ViewScene::new(&scene, &camera).unwrap();
        let options = StitchOptions { distance: 1e-6 * view.size(), angle: 0.02 };
        self::classes(&Stitching::new(&view, &options, Stop::NEVER))
    };
    // They meet at twice the arc tangent of 1/4, which is 0.49.
    assert_eq!(roof([0.5, 0.5]), [6, 0, 2]);
    assert_eq!(roof([0.48, 0.48]), [6, 2, 0]);
    assert_eq!(roof([0.5, 0.48]), [6, 2, 0]);
}

#[test]
fn squares_side_by_side_share_a_smooth_edge_and_squares_at_an_angle_a_crease() {
    let flat = square(DVec3::X, DVec3::X, DVec3::Y);
    let upright = square(DVec3::X, DVec3::Z, DVec3::Y);
    let base = || square(DVec3::ZERO, DVec3::X, DVec3::Y);
    assert_eq!(classes(&stitched(vec![base(), flat.clone()])), [6, 0, 2]);
    assert_eq!(classes(&stitched(vec![base(), upright])), [6, 2, 0]);
    // However the neighbour is parametrised.
    for other in [flat.reversed_u(), flat.reversed_v(), flat.transposed()] {
        assert_eq!(classes(&stitched(vec![base(), other])), [6, 0, 2]);
    }
}

#[test]
fn each_shared_edge_has_one_owner() {
    let s = stitched(vec![square(DVec3::ZERO, DVec3::X, DVec3::Y), square(DVec3::X, DVec3::X, DVec3::Y)]);
    assert_eq!(s.edges.iter().filter(|e| e.class == EdgeClass::Smooth && e.owner()).count(), 1);
}

#[test]
fn a_square_folded_back_on_itself_is_a_crease() {
    let back = square(DVec3::X, -DVec3::X, DVec3::new(0.0, 1.0, 0.0));
    let s = stitched(vec![square(DVec3::ZERO, DVec3::X, DVec3::Y), back]);
    assert!(s.edges.iter().all(|e| e.class != EdgeClass::Smooth), "{:?}", s.edges);
}

#[test]
fn a_long_side_is_cut_where_a_short_one_begins_and_ends() {
    // The short square touches the middle third of the long one's side v = 1.
    let long = square(DVec3::ZERO, DVec3::X * 3.0, DVec3::Y);
    let short = square(DVec3::new(1.0, 1.0, 0.0), DVec3::X, DVec3::Y);
    let s = stitched(vec![long, short]);
    let parts: Vec<_> = s.edges_of(3).map(|e| (e.class, e.t)).collect();
    assert_eq!(parts.len(), 3, "{parts:?}");
    assert_eq!(parts[1].0, EdgeClass::Smooth);
    assert!((parts[1].1[0] - 1.0 / 3.0).abs() < 1e-9 && (parts[1].1[1] - 2.0 / 3.0).abs() < 1e-9, "{parts:?}");
    assert_eq!((parts[0].0, parts[2].0), (EdgeClass::Boundary, EdgeClass::Boundary));
    assert_eq!(s.joined_surfaces(), vec![vec![0, 1], vec![0, 1]]);
}

#[test]
fn closed_surfaces_are_smooth_at_their_seams_and_poles_are_no_edges() {
    assert_eq!(classes(&stitched(vec![sphere(&Frame::WORLD, 1.0).unwrap()])), [0, 0, 2]);
    assert_eq!(classes(&stitched(vec![torus(&Frame::WORLD, 3.0, 1.0).unwrap()])), [0, 0, 4]);
    assert_eq!(classes(&stitched(vec![cylinder(&Frame::WORLD, 1.0, 2.0).unwrap()])), [2, 0, 2]);
}

#[test]
fn a_join_is_a_crease_where_its_angle_is_too_large_and_smooth_elsewhere() {
    // Beside the level square one whose slope grows from 0 to 0.05: at 0.02 rad the crease begins.
    let knots = || KnotVector::bezier(1, [0.0, 1.0]).unwrap();
    let corners = [(1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (2.0, 0.0, 0.0), (2.0, 1.0, 0.05)];
    let points = corners.map(|(x, y, z)| DVec4::new(x, y, z, 1.0)).into();
    let twisted = Surface::new(knots(), knots(), points).unwrap();
    let begin = libm::tan(0.02) / 0.05;
    for other in [twisted.clone(), twisted.reversed_u(), twisted.reversed_v(), twisted.transposed()] {
        let s = stitched(vec![square(DVec3::ZERO, DVec3::X, DVec3::Y), other]);
        assert_eq!(classes(&s), [6, 2, 2]);
        let owned: Vec<_> = s.edges.iter().filter(|e| e.owner() && e.class != EdgeClass::Boundary).collect();
        assert_eq!((owned[0].class, owned[1].class), (EdgeClass::Smooth, EdgeClass::Crease));
        assert!((owned[0].t[1] - begin).abs() < 1e-5 && owned[0].t[1] == owned[1].t[0], "{owned:?}");
    }
}

/// Derivatives across the join vanish on both sides, and close to it both surfaces bend up sharply.
#[test]
fn a_join_is_smooth_if_the_limits_of_the_tangent_planes_agree() {
    let wing = |side: f64, lift: f64| {
        let rows = [(0.0, 0.0), (0.0, 0.0), (0.01 * side, 0.01 * side * lift), (side, 1.0)];
        let points = rows.iter().flat_map(|&(x, z)| [DVec4::new(x, 0.0, z, 1.0), DVec4::new(x, 1.0, z, 1.0)]);
        let knots = |p| KnotVector::bezier(p, [0.0, 1.0]).unwrap();
        Surface::new(knots(3), knots(1), points.collect()).unwrap()
    };
    for (lift, expected) in [(0.0, [6, 0, 2]), (0.019, [6, 0, 2]), (0.021, [6, 2, 0]), (1.0, [6, 2, 0])] {
        let other = wing(1.0, lift);
        for other in [other.clone(), other.reversed_u(), other.reversed_v(), other.transposed()] {
            assert_eq!(classes(&stitched(vec![wing(-1.0, 0.0), other])), expected, "{lift}");
        }
    }
}

#[test]
fn three_squares_on_one_edge_are_a_crease() {
    let s = stitched(vec![
        square(DVec3::ZERO, DVec3::X, DVec3::Y),
        square(DVec3::X, DVec3::X, DVec3::Y),
        square(DVec3::X, DVec3::Z, DVec3::Y),
    ]);
    assert_eq!(classes(&s), [9, 3, 0]);
    assert_eq!(s.edges.iter().filter(|e| e.class == EdgeClass::Crease && e.owner()).count(), 1);
}
