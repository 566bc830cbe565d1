use super::*;
use crate::extract::facing::facing_of_all;
use crate::extract::silhouette::{SilhouetteOptions, silhouettes};
use crate::extract::{CurveSet, Style, Styles, curves};
use crate::nurbs::{KnotVector, Surface};
use crate::scene::{Scene, SceneSurface};
use crate::shape::{Frame, cylinder, sphere, torus};
use crate::stitch::StitchOptions;
use crate::stop::Stop;
use crate::view::{Camera, ViewScene};
use core::f64::consts::{PI, TAU};
use glam::{DVec3, DVec4};
use proptest::prelude::*;

const DEGREE: f64 = PI / 180.0;

/// A curve that is found: kind, domain on its own surface, points in model space.
struct Found {
    kind: CurveKind,
    domain: [f64; 2],
    on_line: bool,
    points: Vec<DVec3>,
}

impl Found {
    fn length(&self) -> f64 {
        self.points.windows(2).map(|w| w[0].distance(w[1])).sum()
    }
}

/// All curves but isocurves and boundaries, joins smooth up to one degree.
fn found(surfaces: Vec<Surface>, eye: DVec3) -> Vec<Found> {
    const PARTS: u32 = 512;
    let surfaces = surfaces.into_iter().map(|surface| SceneSurface::new("s", surface)).collect();
    let up = if eye.x.abs() + eye.y.abs() < 0.1 { DVec3::Y } else { DVec3::Z };
    let camera = Camera::orthographic(eye, up).unwrap();
    let view = ViewScene::new(&Scene { name: "t".into(), surfaces }, &camera).unwrap();
    let contact = 1e-6 * view.size();
    let stitching = Stitching::new(&view, &StitchOptions { distance: contact, angle: DEGREE }, Stop::NEVER);
    let (forms, _) = facing_of_all(view.patches(), Stop::NEVER);
    let g = Geometry { view: &view, forms: &forms };
    let traced = silhouettes(view.patches(), &forms, SilhouetteOptions { chord: 1e-3, normal_angle: 0.2 }, Stop::NEVER);
    assert!(traced.undecided.is_empty());
    let wanted = CurveSet { iso: false, ..CurveSet::default() };
    let styles = Styles::uniform(Style { curves: wanted, isos: 0 });
    let all = curves(&g, &stitching, &traced, &CurveOptions { styles: &styles, angle: DEGREE, contact }, Stop::NEVER);
    let kept = all.iter().filter(|c| c.kind != CurveKind::Boundary);
    kept.map(|c| Found {
        kind: c.kind,
        domain: c.domain,
        on_line: matches!(c.path, Path::Line(_)),
        points: (0..=PARTS)
            .map(|k| c.model_point(&g, c.domain[0] + (c.domain[1] - c.domain[0]) * f64::from(k) / f64::from(PARTS)))
            .collect(),
    })
    .collect()
}

fn on_lines(all: &[Found], kind: CurveKind) -> Vec<[f64; 2]> {
    all.iter().filter(|f| f.kind == kind && f.on_line).map(|f| f.domain).collect()
}

fn near(a: &[[f64; 2]], b: &[[f64; 2]], tolerance: f64) -> bool {
    a.len() == b.len() && a.iter().flatten().zip(b.iter().flatten()).all(|(x, y)| (x - y).abs() <= tolerance)
}

/// Total length of the silhouettes.
fn silhouette_length(all: &[Found]) -> f64 {
    all.iter().filter(|f| f.kind == CurveKind::Silhouette).map(Found::length).sum()
}

/// Degrees (p, q) over [0, 1]², with the knots of `rows` Bézier pieces in u that are merely continuous.
fn sheet(p: usize, q: usize, pieces: usize, points: Vec<DVec3>) -> Surface {
    let mut u = vec![0.0; p + 1];
    for k in 1..pieces {
        u.extend(vec![k as f64 / pieces as f64; p]);
    }
    u.extend(vec![1.0; p + 1]);
    let points = points.into_iter().map(|p| p.extend(1.0)).collect();
    Surface::new(KnotVector::new(u, p).unwrap(), KnotVector::bezier(q, [0.0, 1.0]).unwrap(), points).unwrap()
}

/// A roll over the line x = z = 0 along y from 0 to 1: down from (−1, y, 1) and on to (−1, y, −1). Above the line its
/// tangent leans from the vertical by `above(y)` at y = 0 and 1 (linear in between), below it by `below(y)`; positive is
/// what keeps both parts at x < 0.
fn roll(above: [f64; 2], below: [f64; 2]) -> Surface {
    let row = |x: [f64; 2], z: f64| [DVec3::new(x[0], 0.0, z), DVec3::new(x[1], 1.0, z)];
    let lean = |a: [f64; 2]| a.map(|a| -0.5 * libm::tan(a));
    let rows =
        [row([-1.0; 2], 1.0), row(lean(above), 0.5), row([0.0; 2], 0.0), row(lean(below), -0.5), row([-1.0; 2], -1.0)];
    sheet(2, 1, 2, rows.concat())
}

/// The surface whole, and cut at its join with the second half described in every way.
fn cut_at_the_join(s: &Surface) -> Vec<Vec<Surface>> {
    let (a, b) = s.split_u(0.5).unwrap();
    let mut ways = vec![vec![s.clone()], vec![b.clone(), a.clone()]];
    for other in [b.clone(), b.reversed_u(), b.reversed_v(), b.transposed(), b.transposed().reversed_u()] {
        ways.push(vec![a.clone(), other]);
    }
    ways
}

#[test]
fn a_fold_that_lies_between_the_tangent_planes_of_a_join_is_the_join() {
    for s in cut_at_the_join(&roll([0.25 * DEGREE; 2], [0.25 * DEGREE; 2])) {
        let all = found(s, DVec3::Z);
        assert_eq!(all.len(), 1);
        assert_eq!(all[0].kind, CurveKind::Silhouette);
        assert!((all[0].length() - 1.0).abs() < 1e-12);
        assert!(all[0].points.iter().all(|p| p.x.abs() + p.z.abs() < 1e-15));
    }
}

#[test]
fn a_fold_on_a_join_with_a_common_tangent_plane_is_the_join() {
    for s in cut_at_the_join(&roll([0.0; 2], [0.0; 2])) {
        let all = found(s, DVec3::Z);
        assert_eq!((all.len(), all[0].kind), (1, CurveKind::Silhouette));
        assert!((all[0].length() - 1.0).abs() < 1e-12);
    }
}

/// Leaning over on both sides, the fold splits in two, one on each part, and the kink between them is a third.
#[test]
fn a_concave_kink_between_two_folds_is_a_fold_too() {
    for s in cut_at_the_join(&roll([-0.25 * DEGREE; 2], [-0.25 * DEGREE; 2])) {
        let all = found(s, DVec3::Z);
        assert_eq!(on_lines(&all, CurveKind::Silhouette).len(), 1);
        assert_eq!(all.iter().filter(|f| !f.on_line && f.kind == CurveKind::Silhouette).count(), 2);
        assert!((silhouette_length(&all) - 3.0).abs() < 1e-9);
    }
}

#[test]
fn a_fold_covers_the_part_of_a_join_between_the_silhouettes_of_its_sides() {
    // tan is linear in y: what is above turns over at y = 1/4, what is below at y = 3/4.
    let lean = |at: f64| [0.0, 1.0].map(|y| libm::atan(0.006 * (at - y)));
    for s in cut_at_the_join(&roll(lean(0.25), lean(0.75))) {
        let all = found(s, DVec3::Z);
        let mut parts = on_lines(&all, CurveKind::Silhouette);
        parts.sort_by(|a, b| a[0].total_cmp(&b[0]));
        // Either direction of the line gives the same intervals.
        assert!(near(&parts, &[[0.0, 0.25], [0.75, 1.0]], 1e-9), "{parts:?}");
        // The silhouettes of the sides go on where the join leaves off: every end but those on the boundary is shared.
        let silhouettes = || all.iter().filter(|f| f.kind == CurveKind::Silhouette);
        for f in silhouettes() {
            for end in [f.points[0], f.points[f.points.len() - 1]] {
                let inner = end.y > 1e-9 && end.y < 1.0 - 1e-9;
                let met = silhouettes().flat_map(|o| [o.points[0], o.points[o.points.len() - 1]]);
                assert_eq!(met.filter(|p| p.distance(end) < 1e-9).count(), if inner { 2 } else { 1 }, "{end}");
            }
        }
    }
}

/// Where both sides turn over within the contact of stitching, what lies between is rounding.
#[test]
fn parts_of_a_fold_below_the_contact_are_none() {
    for gap in [1e-3, 1e-5, 1e-7, 1e-9] {
        let lean = |at: f64| [0.0, 1.0].map(|y| libm::atan(0.006 * (at - y)));
        // Above it leans over beyond y = 0.4, below it leans back there: an S that is nowhere folded at the join.
        let below = lean(0.4 + gap).map(|a| -a);
        for s in cut_at_the_join(&roll(lean(0.4), below)) {
            let parts = on_lines(&found(s, DVec3::Z), CurveKind::Silhouette);
            let expected: &[[f64; 2]] = if gap > 3e-6 { &[[0.4, 0.4 + gap]] } else { &[] };
            assert!(near(&parts, expected, 1e-9), "{gap}: {parts:?}");
        }
    }
}

/// The level half-plane x < 0, and for x > 0 a slope of `rise(y)` with Bernstein coefficients `rise`.
fn hinge(rise: &[f64]) -> Surface {
    let n = rise.len() - 1;
    let row = |x: f64, z: &dyn Fn(usize) -> f64| (0..=n).map(|j| DVec3::new(x, j as f64 / n as f64, z(j))).collect();
    let rows: [Vec<DVec3>; 3] = [row(-1.0, &|_| 0.0), row(0.0, &|_| 0.0), row(1.0, &|j| rise[j])];
    sheet(1, n, 2, rows.concat())
}

const OBLIQUE: DVec3 = DVec3::new(0.3, 0.5, 1.0);

#[test]
fn a_crease_begins_where_the_angle_does() {
    let s = hinge(&[0.0, libm::tan(2.0 * DEGREE)]);
    let begin = libm::tan(DEGREE) / libm::tan(2.0 * DEGREE);
    let all = found(vec![s.clone()], OBLIQUE);
    assert!(near(&on_lines(&all, CurveKind::Crease), &[[begin, 1.0]], 1e-12));
    assert_eq!(all.len(), 1);
    // However it is described.
    for s in [s.reversed_u(), s.transposed(), s.transposed().reversed_v(), s.elevated(3, 4).unwrap()] {
        assert!(near(&on_lines(&found(vec![s], OBLIQUE), CurveKind::Crease), &[[begin, 1.0]], 1e-10));
    }
    let parts = on_lines(&found(vec![s.reversed_v()], OBLIQUE), CurveKind::Crease);
    assert!(near(&parts, &[[0.0, 1.0 - begin]], 1e-12), "{parts:?}");
}

#[test]
fn a_crease_on_a_thousandth_of_a_knot_line_is_found() {
    // rise = 4 y (1 − y) (1 + h) tan 1° is above tan 1° within √(h / (1 + h)) / 2 of the middle.
    let h = 1e-6;
    let s = hinge(&[0.0, 2.0 * (1.0 + h) * libm::tan(DEGREE), 0.0]);
    let half = 0.5 * libm::sqrt(h / (1.0 + h));
    let parts = on_lines(&found(vec![s], OBLIQUE), CurveKind::Crease);
    assert!(near(&parts, &[[0.5 - half, 0.5 + half]], 1e-8), "{parts:?}");
}

#[test]
fn a_surface_that_turns_back_on_itself_has_a_crease_there() {
    let row = |x: f64, z: f64| [DVec3::new(x, 0.0, z), DVec3::new(x, 1.0, z)];
    for z in [0.0, 0.001, -0.3] {
        let s = sheet(1, 1, 2, [row(0.0, 0.0), row(1.0, 0.0), row(0.2, z)].concat());
        for eye in [DVec3::Z, OBLIQUE] {
            let parts = on_lines(&found(vec![s.clone()], eye), CurveKind::Crease);
            assert_eq!(parts, [[0.0, 1.0]], "{z}");
        }
    }
}

/// A curve of degree p through the heights 0, 1 of a plane, at uneven speeds.
#[test]
fn a_break_of_the_speed_alone_is_nothing() {
    let row = |x: f64| [DVec3::new(x, 0.0, 0.2 * x), DVec3::new(x + 0.1, 1.0, 0.2 * x)];
    let cubic = [0.0, 0.1, 0.5, 0.6, 1.6, 1.7, 3.0].map(row).concat();
    let quadratic = [0.0, 0.1, 0.6, 1.6, 3.0].map(row).concat();
    let line = [0.0, 0.1, 3.0].map(row).concat();
    for s in [sheet(3, 1, 2, cubic), sheet(2, 1, 2, quadratic), sheet(1, 1, 2, line)] {
        assert!(found(vec![s.clone()], OBLIQUE).is_empty());
        assert!(found(vec![s.transposed()], OBLIQUE).is_empty());
    }
}

/// A simple knot, but control points that coincide: the derivative vanishes at the knot, and the directions before and
/// after it need not agree.
#[test]
fn a_knot_at_which_the_derivative_vanishes_is_a_crease_if_the_direction_breaks() {
    let knots = || KnotVector::new(vec![0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0], 2).unwrap();
    let across = || KnotVector::bezier(1, [0.0, 1.0]).unwrap();
    let through = |a: DVec3, b: DVec3, c: DVec3| {
        let rows = [a, b, b, c].map(|p| [p.extend(1.0), (p + DVec3::Y).extend(1.0)]);
        Surface::new(knots(), across(), rows.concat()).unwrap()
    };
    let (a, b) = (DVec3::ZERO, DVec3::X);
    let turned = |angle: f64| b + 0.7 * DVec3::new(libm::cos(angle), 0.0, libm::sin(angle));
    for (angle, sharp) in [(0.0, false), (0.9 * DEGREE, false), (1.1 * DEGREE, true), (1.5, true), (PI, true)] {
        let s = through(a, b, turned(angle));
        for s in [s.clone(), s.transposed(), s.reversed_u()] {
            let creases = on_lines(&found(vec![s], OBLIQUE), CurveKind::Crease);
            assert_eq!(creases.len(), usize::from(sharp), "{angle}");
        }
    }
}

/// Where knot lines of both directions are sharp each is one crease from end to end.
#[test]
fn a_pyramid_on_a_grid_has_a_crease_along_every_knot_line() {
    let height = |i: usize, j: usize| 0.5 - 0.25 * ((i as f64 - 1.0).abs() + (j as f64 - 1.0).abs());
    let points = (0..9).map(|k| DVec4::new((k / 3) as f64, (k % 3) as f64, height(k / 3, k % 3), 1.0)).collect();
    let knots = || KnotVector::uniform(1, 2, [0.0, 1.0]).unwrap();
    let all = found(vec![Surface::new(knots(), knots(), points).unwrap()], DVec3::Z);
    assert_eq!(on_lines(&all, CurveKind::Crease), [[0.0, 1.0]; 2]);
    assert_eq!(all.len(), 2);
}

#[test]
fn a_waist_that_is_one_point_is_no_curve() {
    let row = |x: f64, half: f64| [DVec3::new(x, -half, 0.0), DVec3::new(x, half, 0.0)];
    let s = sheet(1, 1, 2, [row(-1.0, 1.0), row(0.0, 0.0), row(1.0, 1.0)].concat());
    assert!(found(vec![s], OBLIQUE).is_empty());
}

#[test]
fn circles_on_joins_are_found_once_along_the_axis() {
    let ball = found(vec![sphere(&Frame::WORLD, 2.0).unwrap()], DVec3::Z);
    assert!(ball.iter().all(|f| f.on_line && f.kind == CurveKind::Silhouette));
    assert!((silhouette_length(&ball) - 2.0 * TAU).abs() < 1e-4);
    let ring = found(vec![torus(&Frame::WORLD, 3.0, 1.0).unwrap()], DVec3::Z);
    assert!(ring.iter().all(|f| f.on_line && f.kind == CurveKind::Silhouette));
    assert!((silhouette_length(&ring) - (4.0 + 2.0) * TAU).abs() < 1e-3);
}

/// Off the axis by less and less the circles pass from the patches to the joins, in parts, and none is lost or doubled.
#[test]
fn circles_near_joins_keep_their_length_on_the_way_to_the_axis() {
    for tilt in (2..18).map(|k| libm::pow(10.0, -f64::from(k))) {
        for eye in [DVec3::new(tilt, 0.0, 1.0), DVec3::new(0.31 * tilt, -0.77 * tilt, 1.0)] {
            let ball = found(vec![sphere(&Frame::WORLD, 2.0).unwrap()], eye);
            assert!((silhouette_length(&ball) - 2.0 * TAU).abs() < 1e-3, "{eye}: {}", silhouette_length(&ball));
            let ring = found(vec![torus(&Frame::WORLD, 3.0, 1.0).unwrap()], eye);
            // Off by the tilt the circles are ellipses, longer by less than that.
            let expected = (4.0 + 2.0) * TAU;
            assert!((silhouette_length(&ring) - expected).abs() < 1e-3 + tilt, "{eye}: {}", silhouette_length(&ring));
        }
    }
}

/// A wall seen along itself has no area; the roll that it is joined to smoothly ends there.
#[test]
fn a_roll_that_goes_over_into_a_wall_seen_edge_on_is_folded_there() {
    let row = |x: f64, z: f64| [DVec3::new(x, 0.0, z), DVec3::new(x, 1.0, z)];
    let s = sheet(2, 1, 2, [row(-1.0, 1.0), row(0.0, 1.0), row(0.0, 0.0), row(0.0, -1.0), row(0.0, -2.0)].concat());
    for s in cut_at_the_join(&s) {
        let all = found(s, DVec3::Z);
        assert_eq!((all.len(), all[0].kind, all[0].on_line), (1, CurveKind::Silhouette, true));
    }
}

/// A bicubic sheet over a net of 6 by 6 points with heights in [−1, 1].
fn hills(heights: &[f64]) -> Surface {
    let knots = || KnotVector::uniform(3, 3, [0.0, 1.0]).unwrap();
    let points = heights.iter().enumerate().map(|(k, z)| DVec4::new((k / 6) as f64, (k % 6) as f64, *z, 1.0));
    Surface::new(knots(), knots(), points.collect()).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn silhouettes_are_the_same_of_a_surface_in_one_piece_and_cut(
        heights in proptest::collection::vec(-1.0..1.0_f64, 36), at in 0.05..0.95_f64, across in 0.05..0.95_f64,
        low in -0.6..0.6_f64, turn in 0.0..TAU,
    ) {
        let s = hills(&heights);
        let eye = DVec3::new(libm::cos(turn), libm::sin(turn), low);
        let (a, b) = s.split_u(at).unwrap();
        let cut = [a, b].iter().flat_map(|s| { let (c, d) = s.split_v(across).unwrap(); [c, d.transposed()] }).collect();
        let (whole, cut) = (silhouette_length(&found(vec![s], eye)), silhouette_length(&found(cut, eye)));
        // Polylines with some hundred vertices a curve.
        prop_assert!((whole - cut).abs() <= 1e-3 * (1.0 + whole), "{whole} and {cut}");
    }

    /// Silhouettes end on free edges and nowhere else: what leaves one patch goes on in the other or along the join.
    #[test]
    fn silhouettes_go_on_over_a_join_that_is_smooth_within_the_tolerance(
        above in proptest::array::uniform4(-0.45..0.45_f64), below in proptest::array::uniform4(-0.45..0.45_f64),
        tilt in -0.01..0.01_f64, turn in -0.3..0.3_f64, way in 0..7_usize,
    ) {
        let row = |x: [f64; 4], z: f64| [0, 1, 2, 3].map(|j| DVec3::new(x[j], j as f64 / 3.0, z));
        let lean = |a: [f64; 4]| a.map(|a| -0.5 * libm::tan(a * DEGREE));
        let rows = [row([-1.0; 4], 1.0), row(lean(above), 0.5), row([0.0; 4], 0.0), row(lean(below), -0.5), row([-1.0; 4], -1.0)];
        let s = sheet(2, 3, 2, rows.concat());
        let all = found(cut_at_the_join(&s).swap_remove(way), DVec3::new(tilt, turn * tilt, 1.0));
        let ends: Vec<DVec3> = all.iter().filter(|f| f.kind == CurveKind::Silhouette)
            .flat_map(|f| [f.points[0], f.points[f.points.len() - 1]]).collect();
        prop_assert!(!ends.is_empty());
        for end in &ends {
            let free = end.y < 1e-9 || end.y > 1.0 - 1e-9 || end.z.abs() > 1.0 - 1e-9;
            // Parts of the join below the contact, 3e-6, are left out.
            let met = ends.iter().filter(|p| p.distance(*end) <= 6e-6).count();
            prop_assert!(free || met % 2 == 0, "{end} of {ends:?}");
        }
    }

    /// As above where joins in both directions meet: four patches in a corner, with four tangent planes.
    #[test]
    fn silhouettes_go_on_through_corners_that_are_smooth_within_the_tolerance(
        heights in proptest::collection::vec(-1.0..1.0_f64, 36), noise in proptest::collection::vec(-1e-3..1e-3_f64, 100),
        low in -0.6..0.6_f64, turn in 0.0..TAU, apart: bool,
    ) {
        // Knots of full multiplicity: 10 by 10 control points, which need not be in line over a knot.
        let mut s = hills(&heights);
        for k in [1.0 / 3.0, 2.0 / 3.0] {
            let inner = |knots: &KnotVector| knots.breaks().into_iter().find(|b| (b - k).abs() < 1e-9).unwrap();
            s = s.insert_knot_u(inner(s.knots_u()), 2).unwrap();
            s = s.insert_knot_v(inner(s.knots_v()), 2).unwrap();
        }
        let points = s.homogeneous().iter().zip(&noise).map(|(p, z)| *p + DVec4::Z * *z).collect();
        let s = Surface::new(s.knots_u().clone(), s.knots_v().clone(), points).unwrap();
        let inner = s.knots_u().breaks()[1];
        let (a, b) = s.split_u(inner).unwrap();
        let (c, d) = b.split_v(s.knots_v().breaks()[2]).unwrap();
        let pieces = if apart { vec![a, c.reversed_v(), d.transposed()] } else { vec![s.clone()] };
        let all = found(pieces, DVec3::new(libm::cos(turn), libm::sin(turn), low));
        prop_assert!(all.iter().all(|f| f.kind == CurveKind::Silhouette));
        let ends: Vec<DVec3> = all.iter().flat_map(|f| [f.points[0], f.points[f.points.len() - 1]]).collect();
        for end in &ends {
            let free = [end.x, end.y].iter().any(|x| *x < 1e-9 || *x > 5.0 - 1e-9);
            let met = ends.iter().filter(|p| p.distance(*end) <= 3e-5).count();
            prop_assert!(free || met % 2 == 0, "{end} of {ends:?}");
        }
    }

    /// The cut is made just where the silhouette is.
    #[test]
    fn a_cylinder_cut_along_its_silhouettes_keeps_them(at in 0.01..0.99_f64, tilt in -0.8..0.8_f64) {
        let s = cylinder(&Frame::WORLD, 1.2, 3.5).unwrap();
        let (a, b) = s.split_u(at).unwrap();
        let on_cut = a.eval(at, 0.0);
        let eye = DVec3::new(-on_cut.y, on_cut.x, tilt);
        let all = found(vec![a, b], eye);
        prop_assert!((silhouette_length(&all) - 7.0).abs() < 1e-9, "{}", silhouette_length(&all));
    }
}
