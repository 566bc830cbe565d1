use alloc::vec;
use alloc::vec::Vec;
use core::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3, DVec4};
use proptest::prelude::*;

use super::*;
use crate::extract::facing::{FacingForm, facing_of_all};
use crate::extract::{CurveSet, Style};
use crate::nurbs::{KnotVector, Surface};
use crate::scene::{Scene, SceneSurface};
use crate::shape::{Frame, cone, cylinder, plane, polyline, revolution, sphere, torus};
use crate::stitch::StitchOptions;
use crate::view::{Camera, ViewScene};

/// Surfaces seen from a direction, with what is needed to cover them.
struct Seen {
    view: ViewScene,
    forms: Vec<FacingForm>,
    stitching: Stitching,
}

impl Seen {
    fn new(surfaces: Vec<Surface>, eye: DVec3) -> Self {
        let up = if eye.x == 0.0 && eye.y == 0.0 { DVec3::Y } else { DVec3::Z };
        Self::through(surfaces, &Camera::orthographic(eye, up).unwrap())
    }

    fn through(surfaces: Vec<Surface>, camera: &Camera) -> Self {
        let named = surfaces.into_iter().map(|surface| SceneSurface::new("s", surface));
        let scene = Scene { name: "s".into(), surfaces: named.collect() };
        let view = ViewScene::new(&scene, camera).unwrap();
        let (forms, _) = facing_of_all(view.patches(), Stop::NEVER);
        let options = StitchOptions { distance: 1e-6 * view.size(), angle: PI / 180.0 };
        let stitching = Stitching::new(&view, &options, Stop::NEVER);
        Self { view, forms, stitching }
    }

    fn cover(&self, options: &AdaptiveOptions) -> Cover {
        let g = Geometry { view: &self.view, forms: &self.forms };
        cover(&g, &self.stitching, &|_| true, &Styles::default(), options, Stop::NEVER)
    }

    /// The largest distance on the screen, or in view space, of a dense sample of surface 0 from the pieces given and its
    /// boundary in that direction.
    fn farthest(&self, pieces: &[IsoPiece], axis: Axis, metric: Metric) -> f64 {
        let g = Geometry { view: &self.view, forms: &self.forms };
        let (s, t) = domain(&g, 0, axis);
        let ends = s.map(|value| IsoPiece { surface: 0, axis, value, t, level: 0 });
        let mut lines: Vec<(DVec3, DVec3)> = Vec::new();
        for p in pieces.iter().filter(|p| p.surface == 0 && p.axis == axis).chain(&ends) {
            let line = Line::over(&self.view, 0, axis, p.value, false, p.t);
            let at = |k: i32| line.point(p.t[0] + (p.t[1] - p.t[0]) * f64::from(k) / 64.0);
            lines.extend((0..64).map(|k| (at(k), at(k + 1))));
        }
        let flat = |p: DVec3| if metric == Metric::Screen { p.with_z(0.0) } else { p };
        let away = |p: DVec3, (a, b): (DVec3, DVec3)| {
            let (p, a, d) = (flat(p), flat(a), flat(b) - flat(a));
            let x = if d == DVec3::ZERO { 0.0 } else { ((p - a).dot(d) / d.length_squared()).clamp(0.0, 1.0) };
            (p - a - d * x).length()
        };
        let mut most = 0.0_f64;
        for k in 0..60 * 60 {
            let (x, y) = ((f64::from(k % 60) + 0.5) / 60.0, (f64::from(k / 60) + 0.5) / 60.0);
            let (s, t) = (s[0] + (s[1] - s[0]) * x, t[0] + (t[1] - t[0]) * y);
            let uv = if axis == Axis::U { DVec2::new(s, t) } else { DVec2::new(t, s) };
            let p = self.view.jet(0, uv, [false; 2]).p;
            most = most.max(lines.iter().map(|&line| away(p, line)).fold(f64::INFINITY, f64::min));
        }
        most
    }

    fn length(&self, pieces: &[IsoPiece]) -> f64 {
        let one = |p: &IsoPiece| {
            let line = Line::over(&self.view, p.surface, p.axis, p.value, false, p.t);
            let at = |k: i32| line.point(p.t[0] + (p.t[1] - p.t[0]) * f64::from(k) / 64.0).truncate();
            (0..64).map(|k| at(k).distance(at(k + 1))).sum::<f64>()
        };
        pieces.iter().map(one).sum()
    }
}

fn even(spacing: f64, direction: Direction) -> AdaptiveOptions {
    AdaptiveOptions { spacing, measured: Spacing::Screen, direction, tone: None, levels: 1, shortest: 0.0 }
}

/// Narrow in the middle, as in figure 1 of the paper: turned about the z axis.
fn hourglass() -> Surface {
    let knots = KnotVector::bezier(2, [0.0, 1.0]).unwrap();
    let profile = [DVec4::new(2.0, 0.0, -3.0, 1.0), DVec4::new(-1.4, 0.0, 0.0, 1.0), DVec4::new(2.0, 0.0, 3.0, 1.0)];
    let profile = crate::nurbs::Curve::new(knots, profile.to_vec()).unwrap();
    revolution(&profile, DVec3::ZERO, DVec3::Z, TAU).unwrap()
}

fn wave() -> Surface {
    let knots = || KnotVector::new(vec![0.0, 0.0, 0.0, 0.0, 0.4, 0.5, 1.0, 1.0, 1.0, 1.0], 3).unwrap();
    let points = (0..36).map(|k| {
        let (i, j) = (f64::from(k / 6), f64::from(k % 6));
        DVec4::new(i, j, libm::sin(1.1 * i) * libm::cos(0.8 * j), 1.0)
    });
    Surface::new(knots(), knots(), points.collect()).unwrap()
}

#[test]
fn a_rectangle_is_halved_until_its_strips_are_narrow_enough_exactly_or_not() {
    let seen = Seen::new(vec![plane(DVec3::ZERO, 4.0 * DVec3::X, 3.0 * DVec3::Y).unwrap()], DVec3::Z);
    for (spacing, want) in [(3.0, 0), (2.9, 1), (1.5, 1), (1.0, 3), (0.75, 3), (0.7499, 7), (3.0 / 64.0, 63)] {
        let found = seen.cover(&even(spacing, Direction::U));
        assert_eq!(found.pieces.len(), want, "{spacing}");
        // One distance for the two ends, two for each curve between them.
        let n = found.stats.curves;
        assert_eq!((n, found.stats.distances), (want as u64 + 2, 2 * n - 3));
        for (k, p) in found.pieces.iter().enumerate() {
            assert_eq!((p.axis, p.t), (Axis::V, [0.0, 1.0]));
            assert_eq!(p.value, (k + 1) as f64 / (want + 1) as f64);
        }
    }
}

#[test]
fn lines_end_where_a_triangle_has_become_narrow() {
    // Width 1 − v at the height v: a curve of the n-th halving ends where the width is 2ⁿ⁻¹ δ.
    let corner = |x: f64, y: f64| DVec4::new(x, y, 0.0, 1.0);
    let knots = || KnotVector::bezier(1, [0.0, 1.0]).unwrap();
    let points = vec![corner(0.0, 0.0), corner(0.0, 1.0), corner(1.0, 0.0), corner(0.0, 1.0)];
    let seen = Seen::new(vec![Surface::new(knots(), knots(), points).unwrap()], DVec3::Z);
    let found = seen.cover(&even(0.1, Direction::V));
    assert_eq!(found.pieces.len(), 15);
    for p in &found.pieces {
        let halving = (1..=4).find(|n| (p.value * libm::exp2(f64::from(*n))).fract() == 0.0).unwrap();
        let until = 1.0 - 0.1 * libm::exp2(f64::from(halving - 1));
        assert!(p.t[0] == 0.0 && (p.t[1] - until).abs() < 1e-12, "{p:?} {until}");
    }
}

#[test]
fn every_point_is_as_near_as_promised_on_any_kind_of_surface_from_any_side() {
    let surfaces = [
        hourglass(),
        wave(),
        sphere(&Frame::WORLD, 1.0).unwrap(),
        torus(&Frame::WORLD, 3.0, 1.0).unwrap(),
        cylinder(&Frame::WORLD, 1.0, 2.0).unwrap(),
        cone(&Frame::WORLD, 1.0, 0.0, 2.0).unwrap(),
    ];
    for surface in surfaces {
        for eye in [DVec3::Z, DVec3::NEG_Y, DVec3::new(1.0, -1.6, 0.75), DVec3::new(0.02, -1.0, 0.01)] {
            let seen = Seen::new(vec![surface.clone()], eye);
            // A surface without area on the screen has nothing to be covered.
            if seen.forms.iter().all(|f| f.facing == Facing::EdgeOn) {
                continue;
            }
            let spacing = seen.view.size() / 25.0;
            for (direction, axis) in [(Direction::U, Axis::V), (Direction::V, Axis::U)] {
                let mut length = Vec::new();
                for measured in [Spacing::Screen, Spacing::Surface] {
                    let options = AdaptiveOptions { measured, ..even(spacing, direction) };
                    let found = seen.cover(&options);
                    let g = Geometry { view: &seen.view, forms: &seen.forms };
                    let most = seen.farthest(&found.pieces, axis, metric(&g, 0, measured));
                    assert!(most <= (0.5 + RULED) * spacing, "{eye} {direction:?} {measured:?}: {}", most / spacing);
                    // Every curve introduced is one whose two distances are formed, and the first pair has one.
                    assert_eq!(found.stats.distances, 2 * found.stats.curves - 3);
                    length.push(seen.length(&found.pieces));
                }
                assert!(length[0] <= length[1] * 1.0001, "space asks for more than the screen: {length:?}");
            }
        }
    }
}

#[test]
fn a_seam_does_not_end_the_cover_of_a_closed_surface_and_is_drawn_once() {
    let seen = Seen::new(vec![cylinder(&Frame::WORLD, 1.0, 2.0).unwrap()], DVec3::new(1.0, 1.0, 0.4));
    // Both ends of u are one line, so that they are nearest, and lines parallel to the axis are chosen.
    let found = seen.cover(&even(0.1, Direction::Auto));
    assert!(found.pieces.iter().all(|p| p.axis == Axis::U));
    let seams = found.pieces.iter().filter(|p| p.value == 0.0 || p.value == 1.0).count();
    assert_eq!(seams, 1);
    assert!(found.pieces.len() > 30, "{}", found.pieces.len());
}

#[test]
fn free_edges_are_left_to_boundaries_unless_those_are_not_drawn() {
    let seen = Seen::new(vec![plane(DVec3::ZERO, 4.0 * DVec3::X, 3.0 * DVec3::Y).unwrap()], DVec3::Z);
    let g = Geometry { view: &seen.view, forms: &seen.forms };
    let options = even(3.0, Direction::U);
    let of = |curves: CurveSet| {
        let styles = Styles::uniform(Style { curves, isos: 0 });
        cover(&g, &seen.stitching, &|_| true, &styles, &options, Stop::NEVER).pieces.len()
    };
    assert_eq!(of(CurveSet::default()), 0);
    assert_eq!(of(CurveSet { boundary: false, ..CurveSet::default() }), 2);
}

#[test]
fn knots_and_degree_change_nothing() {
    let surface = wave();
    let finer = surface.insert_knot_u(0.3, 1).unwrap().insert_knot_v(0.71, 2).unwrap();
    let higher = surface.elevated(4, 5).unwrap();
    let eye = DVec3::new(1.0, -1.0, 1.0);
    let of = |s: &Surface| Seen::new(vec![s.clone()], eye).cover(&even(0.2, Direction::Both));
    let want = of(&surface);
    for other in [finer, higher] {
        let found = of(&other);
        assert_eq!(found.pieces.len(), want.pieces.len());
        for (a, b) in found.pieces.iter().zip(&want.pieces) {
            assert_eq!((a.axis, a.value), (b.axis, b.value));
            assert!((a.t[0] - b.t[0]).abs() < 1e-7 && (a.t[1] - b.t[1]).abs() < 1e-7, "{a:?} {b:?}");
        }
    }
}

#[test]
fn levels_part_the_same_lines_and_each_is_a_picture() {
    let seen = Seen::new(vec![hourglass()], DVec3::new(1.0, -2.0, 0.5));
    let spacing = 0.1;
    let one = seen.cover(&even(spacing, Direction::V));
    let four = seen.cover(&AdaptiveOptions { levels: 4, ..even(spacing, Direction::V) });
    assert!((seen.length(&one.pieces) - seen.length(&four.pieces)).abs() < 1e-4 * seen.length(&one.pieces));
    for level in 0..4 {
        let until: Vec<IsoPiece> = four.pieces.iter().copied().filter(|p| p.level <= level).collect();
        let coarser = spacing * libm::exp2(f64::from(3 - level));
        let want = seen.cover(&even(coarser, Direction::V));
        // The pieces of a coarser cover, though cut at other places.
        let (found, wanted) = (seen.length(&until), seen.length(&want.pieces));
        assert!((found - wanted).abs() < 0.02 * wanted, "{level}: {found} {wanted}");
        assert!(seen.farthest(&until, Axis::U, Metric::Screen) <= (0.5 + RULED) * coarser);
    }
}

#[test]
fn a_shaded_ball_is_bare_in_the_light_and_as_dark_as_it_should_be_elsewhere() {
    let seen = Seen::new(vec![sphere(&Frame::WORLD, 1.0).unwrap()], DVec3::NEG_Y);
    let light = DVec3::new(-1.0, 1.0, 1.0);
    let spacing = 0.02;
    let options = AdaptiveOptions { tone: Some(Tone::Lambert(light)), ..even(spacing, Direction::U) };
    let found = seen.cover(&options);
    // Curves near a place of the visible half: their length in a disk over its area, times the spacing.
    let darkness = |x: f64, y: f64| {
        let (radius, mut length) = (0.12, 0.0);
        for p in &found.pieces {
            let line = Line::over(&seen.view, 0, p.axis, p.value, false, p.t);
            let at = |k: i32| line.point(p.t[0] + (p.t[1] - p.t[0]) * f64::from(k) / 2000.0);
            for k in 0..2000 {
                let (a, b) = (at(k), at(k + 1));
                if a.z > 0.0 && DVec2::new(a.x - x, a.y - y).length() < radius {
                    length += (b - a).truncate().length();
                }
            }
        }
        length / (PI * radius * radius) * spacing
    };
    let towards = light.normalize();
    assert_eq!(darkness(towards.x, towards.y), 0.0);
    for place in [[0.5, -0.5], [0.3, 0.3], [0.6, 0.0], [0.0, -0.6]] {
        // Seen from −y, x is to the right and z up.
        let p = DVec3::new(place[0], -libm::sqrt(1.0 - place[0] * place[0] - place[1] * place[1]), place[1]);
        let n = DVec3::new(p.x, p.z, -p.y);
        let dark = (1.0 - n.dot(towards).max(0.0) - 0.125) / 0.875;
        let found = darkness(place[0], place[1]);
        assert!((found / dark - 1.0).abs() < 0.15, "{place:?}: {found} for {dark}");
    }
}

#[test]
fn curves_are_as_dense_as_the_tone_is_dark_and_gaps_are_no_narrower_than_half_the_spacing() {
    // Seen from above and without a fold, so that area on the screen is known.
    let seen = Seen::new(vec![wave()], DVec3::Z);
    let spacing = 0.05;
    for darkness in [0.05, 0.1, 0.3, 0.5, 0.7, 1.0] {
        for direction in [Direction::U, Direction::V] {
            let flat = AdaptiveOptions { tone: Some(Tone::Flat(darkness)), ..even(spacing, direction) };
            let found = seen.length(&seen.cover(&flat).pieces) / 25.0 * spacing;
            // Up to a tenth, and one curve: those at the ends are not counted.
            let curve = spacing / 5.0;
            assert!((found - darkness).abs() < 0.1 * darkness + 1.1 * curve, "{darkness} {direction:?}: {found}");
        }
    }
    let darkest = AdaptiveOptions { tone: Some(Tone::Flat(1.0)), ..even(spacing, Direction::U) };
    let pieces = seen.cover(&darkest).pieces;
    for w in pieces.windows(2).filter(|w| w[0].value < w[1].value) {
        let common = [w[0].t[0].max(w[1].t[0]), w[0].t[1].min(w[1].t[1])];
        if common[0] < common[1] {
            let [a, b] = [w[0].value, w[1].value].map(|s| Rail::new(&seen.view, 0, Axis::V, s, common));
            let gap = IsoDistance::across(&a, &b);
            for k in 0..=100 {
                let t = common[0] + (common[1] - common[0]) * f64::from(k) / 100.0;
                let found = libm::sqrt(gap.above.eval(t) / gap.below.eval(t));
                assert!(found > 0.49 * spacing, "{t}: {found}");
            }
        }
    }
}

#[test]
fn a_plane_in_one_light_gets_equal_strips_and_levels_of_every_other_one() {
    let seen = Seen::new(vec![plane(DVec3::ZERO, 4.0 * DVec3::X, 3.0 * DVec3::Y).unwrap()], DVec3::Z);
    // Lit at 60°: dark by a half, of which an eighth is highlight.
    let light = DVec3::new(libm::sqrt(3.0), 0.0, 1.0);
    for (spacing, want) in [(0.1, 13.0), (0.037, 35.0), (10.0, 1.0)] {
        let even = even(spacing, Direction::U);
        let found = seen.cover(&AdaptiveOptions { tone: Some(Tone::Lambert(light)), levels: 3, ..even }).pieces;
        assert_eq!(want, libm::round(3.0 * (0.5 - 0.125) / 0.875 / spacing).max(1.0));
        assert_eq!(found.len() as f64, want - 1.0);
        for (p, k) in found.iter().zip(1_u32..) {
            assert!((p.value - f64::from(k) / want).abs() < 1e-15 && p.t == [0.0, 1.0]);
            assert_eq!(
                p.level,
                if k % 4 == 0 {
                    0
                } else if k % 2 == 0 {
                    1
                } else {
                    2
                }
            );
        }
    }
    assert!(
        seen.cover(&AdaptiveOptions { tone: Some(Tone::Lambert(DVec3::Z)), ..even(0.1, Direction::U) })
            .pieces
            .is_empty()
    );
}

#[test]
fn what_is_shorter_than_a_dash_and_ends_inside_is_left_out() {
    const DASH: f64 = 0.06;
    let seen = Seen::new(vec![sphere(&Frame::WORLD, 1.0).unwrap()], DVec3::NEG_Y);
    let tone = Some(Tone::Lambert(DVec3::new(-1.0, 1.0, 1.0)));
    let all = AdaptiveOptions { tone, ..even(0.02, Direction::Both) };
    let dashes = AdaptiveOptions { shortest: DASH, ..all };
    let short = |options: &AdaptiveOptions| {
        let inside = |p: &&IsoPiece| p.t[0] > 0.0 && p.t[1] < 1.0;
        let length = |p: &IsoPiece| Rail::new(&seen.view, 0, p.axis, p.value, p.t).length_bound();
        let lengths: Vec<f64> = seen.cover(options).pieces.iter().filter(inside).map(length).collect();
        (lengths.iter().filter(|&&l| l <= DASH).count(), lengths.iter().filter(|&&l| l > DASH).count())
    };
    let (some, rest) = short(&all);
    assert!(some > 0);
    assert_eq!(short(&dashes), (0, rest));
}

#[test]
fn perspective_is_measured_on_the_screen() {
    let camera = Camera::perspective(DVec3::new(0.0, -3.0, 1.5), DVec3::ZERO, DVec3::Z).unwrap();
    let floor = plane(DVec3::new(-2.0, -2.0, 0.0), 4.0 * DVec3::X, 4.0 * DVec3::Y).unwrap();
    let seen = Seen::through(vec![floor], &camera);
    let found = seen.cover(&even(0.1, Direction::U));
    // Lines across the sight line: denser, in the parameter, where the floor is near.
    let near = found.pieces.iter().filter(|p| p.value < 0.5).count();
    assert!(2 * near > 3 * (found.pieces.len() - near), "{near} of {}", found.pieces.len());
    assert!(seen.farthest(&found.pieces, Axis::V, Metric::Screen) <= 0.0501);
}

#[test]
fn corners_in_a_profile_are_covered() {
    let profile = polyline(&[DVec3::new(0.5, 0.0, 0.0), DVec3::new(1.5, 0.0, 0.1), DVec3::new(1.5, 0.0, 2.0)]).unwrap();
    let seen = Seen::new(vec![revolution(&profile, DVec3::ZERO, DVec3::Z, TAU).unwrap()], DVec3::new(0.3, -1.0, 0.6));
    for (direction, axis) in [(Direction::U, Axis::V), (Direction::V, Axis::U)] {
        let found = seen.cover(&even(0.15, direction));
        assert!(seen.farthest(&found.pieces, axis, Metric::Screen) <= (0.5 + RULED) * 0.15);
    }
}

/// Rational patches of bidegree 2 × 3, among them ones with a collapsed edge, with both edges in one place, flat ones, and
/// ones folded over on the screen.
fn patches() -> impl Strategy<Value = Surface> {
    let points = prop::collection::vec((-1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64, 0.3..3.0_f64), 12);
    (points, 0..6_u32).prop_map(|(points, kind)| {
        let mut net: Vec<DVec4> = points
            .into_iter()
            .enumerate()
            .map(|(k, (x, y, z, w))| {
                let (i, j) = ((k / 4) as f64, (k % 4) as f64);
                DVec4::new(i + 0.6 * x, j + 0.6 * y, z, w)
            })
            .collect();
        match kind {
            0 => (0..4).for_each(|j| net[j] = net[0]),
            1 => (0..4).for_each(|j| net[8 + j] = net[j]),
            2 => net.iter_mut().for_each(|p| p.z = 0.0),
            3 => (0..3).for_each(|i| net[4 * i + 3] = net[4 * i]),
            4 => net.iter_mut().for_each(|p| p.w = 1.0),
            _ => {}
        }
        let [u, v] = [2, 3].map(|degree| KnotVector::bezier(degree, [0.0, 1.0]).unwrap());
        Surface::new(u, v, net).unwrap()
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(48) })]

    #[test]
    fn any_patch_is_covered_as_promised(
        surface in patches(), eye in (-1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64), along_u in any::<bool>()
    ) {
        prop_assume!(DVec2::new(eye.0, eye.1).length() > 0.01);
        let seen = Seen::new(vec![surface], DVec3::from(eye));
        let spacing = seen.view.size() / 15.0;
        let (direction, axis) = if along_u { (Direction::U, Axis::V) } else { (Direction::V, Axis::U) };
        let found = seen.cover(&even(spacing, direction));
        let most = seen.farthest(&found.pieces, axis, Metric::Screen);
        // The polylines that it is measured with are off by the sag of a 64th of a curve.
        prop_assert!(most <= (0.5 + RULED + 0.01) * spacing, "{}", most / spacing);
        prop_assert_eq!(found.stats.distances, 2 * found.stats.curves - 3);
    }
}
