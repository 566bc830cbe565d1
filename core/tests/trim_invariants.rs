//! What is drawn of trimmed surfaces belongs to the shapes, not to how surfaces and trims are described; and trims that lie
//! as awkwardly as they can, against closed forms.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use glam::{DMat4, DQuat, DVec2, DVec3, DVec4};
use penvis_core::nurbs::{Curve, KnotVector, Surface};
use penvis_core::pipeline::{DrawOptions, Prepared};
use penvis_core::scene::{Scene, SceneSurface};
use penvis_core::shape::{Frame, arc, circle, cylinder, line, plane, polyline, sphere, torus};
use penvis_core::stroke::CurveKind;
use penvis_core::trim::{TrimCurve, Trims};
use penvis_core::view::Camera;
use proptest::prelude::*;

type Loop = Vec<Curve>;

/// A surface with the loops that bound what is kept of it.
#[derive(Clone)]
struct Face {
    surface: Surface,
    loops: Vec<Loop>,
}

impl Face {
    fn scene(&self) -> SceneSurface {
        let trims = Some(Trims::new(&self.surface, &self.loops).expect("trims"));
        SceneSurface { trims, ..SceneSurface::new("face", self.surface.clone()) }
    }

    /// With every curve of its loops made into others.
    fn with_curves(&self, f: impl Fn(&Curve) -> Vec<Curve>) -> Self {
        let loops = self.loops.iter().map(|l| l.iter().flat_map(&f).collect()).collect();
        Self { loops, ..self.clone() }
    }

    fn mapped(&self, surface: Surface, map: DMat4) -> Self {
        Self { surface, ..self.with_curves(|c| vec![c.transformed(map).expect("a map")]) }
    }
}

fn ring(centre: DVec2, radius: f64) -> Loop {
    let there = DMat4::from_translation(centre.extend(0.0));
    vec![circle(&Frame::WORLD, radius).expect("a circle").transformed(there).expect("a move")]
}

fn polygon(corners: &[(f64, f64)]) -> Loop {
    let points: Vec<DVec3> = corners.iter().chain(&corners[..1]).map(|&(u, v)| DVec3::new(u, v, 0.0)).collect();
    vec![polyline(&points).expect("a polygon")]
}

fn rectangle(u: [f64; 2], v: [f64; 2]) -> Loop {
    polygon(&[(u[0], v[0]), (u[1], v[0]), (u[1], v[1]), (u[0], v[1])])
}

/// A cubic with five lobes.
fn lobed(centre: DVec2, radii: [f64; 2]) -> Loop {
    let at = |k: usize| (centre + radii[k % 2] * DVec2::from_angle(TAU * k as f64 / 10.0)).extend(0.0).extend(1.0);
    let points: Vec<DVec4> = (0..=10).map(at).collect();
    let inner = (1..=7).map(f64::from);
    let knots = [0.0; 4].into_iter().chain(inner).chain([8.0; 4]).collect();
    vec![Curve::new(KnotVector::new(knots, 3).expect("knots"), points).expect("a curve")]
}

/// The range of a surface's parameters as the unit square.
fn scaled(surface: &Surface, loops: Vec<Loop>) -> Face {
    let ([u0, u1], [v0, v1]) = (surface.domain_u(), surface.domain_v());
    let map = DMat4::from_translation(DVec3::new(u0, v0, 0.0)) * DMat4::from_scale(DVec3::new(u1 - u0, v1 - v0, 1.0));
    Face { surface: surface.clone(), loops }.mapped(surface.clone(), map)
}

/// The square with side 2 about (0, 0, z).
fn square(z: f64) -> Surface {
    plane(DVec3::new(-1.0, -1.0, z), DVec3::X * 2.0, DVec3::Y * 2.0).expect("a plane")
}

/// A part of a torus with a lobed window and a border that meets the range's, before a plate with holes.
fn model() -> Vec<Face> {
    let tube = torus(&Frame::WORLD, 3.0, 1.1).expect("a torus");
    let border = polygon(&[(0.05, 0.0), (0.9, 0.0), (0.8, 0.6), (0.95, 1.0), (0.1, 1.0)]);
    let part =
        scaled(&tube, vec![border, lobed(DVec2::new(0.42, 0.45), [0.2, 0.11]), ring(DVec2::new(0.72, 0.3), 0.07)]);
    let plate = plane(DVec3::new(-4.0, -3.5, -1.6), 8.5 * DVec3::X, DVec3::new(0.3, 7.0, 0.2)).expect("a plane");
    let loops = vec![
        rectangle([0.0, 1.0], [0.1, 1.0]),
        ring(DVec2::new(0.3, 0.6), 0.2),
        lobed(DVec2::new(0.7, 0.5), [0.2, 0.1]),
    ];
    vec![part, scaled(&plate, loops)]
}

/// Visible length in model space over `scale`, by kind and surface.
fn visible(
    surfaces: &[SceneSurface],
    eye: DVec3,
    up: DVec3,
    isos: u32,
    scale: f64,
) -> BTreeMap<(CurveKind, usize), f64> {
    let scene = Scene { name: "trims".into(), surfaces: surfaces.to_vec() };
    let camera = Camera::orthographic(eye, up).expect("a camera");
    let options = DrawOptions { isos, ..DrawOptions::default() };
    let prepared = Prepared::new(&scene, &camera, &options, &()).expect("a picture");
    let traced = prepared.trace(1e-6 * scale, &()).expect("nothing stops it");
    assert!(traced.stats.visibility.undecided.is_empty(), "{:?}", traced.stats.visibility.undecided);
    let mut lengths = BTreeMap::new();
    for s in &traced.strokes {
        let length: f64 = s.points.windows(2).map(|w| w[0].model.distance(w[1].model)).sum();
        *lengths.entry((s.kind, s.surface)).or_insert(0.0) += length / scale;
    }
    lengths
}

fn scenes(faces: &[Face]) -> Vec<SceneSurface> {
    faces.iter().map(Face::scene).collect()
}

fn same<K: Ord + std::fmt::Debug>(a: &BTreeMap<K, f64>, b: &BTreeMap<K, f64>) -> Result<(), TestCaseError> {
    for kind in a.keys().chain(b.keys()) {
        let (x, y) = (a.get(kind).copied().unwrap_or(0.0), b.get(kind).copied().unwrap_or(0.0));
        // Where a silhouette ends on a border, or another branch at a cusp, what is within r of it on the screen is
        // √(8 r R) long, with r of 10⁻⁸ of the size R: some 10⁻³ at each such place.
        prop_assert!((x - y).abs() <= 4e-3 * (1.0 + x), "{kind:?}: {x} and {y}");
    }
    Ok(())
}

fn direction() -> impl Strategy<Value = DVec3> {
    (-1.0..1.0_f64, 0.0..TAU).prop_map(|(z, a)| {
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * a.cos(), r * a.sin(), z)
    })
}

fn up_of(eye: DVec3) -> DVec3 {
    if eye.z.abs() > 0.9 { DVec3::X } else { DVec3::Z }
}

/// The same face in other words.
fn reworded(face: &Face, way: usize, at: f64) -> Face {
    let s = &face.surface;
    let ([u0, u1], [v0, v1]) = (s.domain_u(), s.domain_v());
    let within = |[a, b]: [f64; 2]| a + at * (b - a);
    match way {
        0 => face.with_curves(|c| vec![c.elevated(c.degree() + 1).expect("a degree in range")]),
        1 => face.with_curves(|c| vec![c.insert_knot(within(c.domain()), 1).expect("a knot inside")]),
        2 => face.with_curves(|c| {
            let (low, high) = c.split(within(c.domain())).expect("a place inside");
            vec![low, high]
        }),
        3 => {
            let mut reversed = face.with_curves(|c| vec![c.reversed()]);
            reversed.loops.iter_mut().for_each(|l| l.reverse());
            reversed
        }
        4 => Face { loops: face.loops.iter().rev().cloned().collect(), ..face.clone() },
        5 => {
            Face { surface: s.elevated(s.degree_u() + 1, s.degree_v() + 1).expect("a degree in range"), ..face.clone() }
        }
        6 => Face { surface: s.insert_knot_u(within([u0, u1]), 1).expect("a knot inside"), ..face.clone() },
        7 => Face { surface: s.insert_knot_v(within([v0, v1]), 1).expect("a knot inside"), ..face.clone() },
        8 => face.mapped(s.transposed(), DMat4::from_cols(DVec4::Y, DVec4::X, DVec4::Z, DVec4::W)),
        9 => {
            let mirror = DMat4::from_scale(DVec3::new(-1.0, 1.0, 1.0));
            face.mapped(s.reversed_u(), DMat4::from_translation(DVec3::X * (u0 + u1)) * mirror)
        }
        _ => {
            // Each loop begins elsewhere, and has a curve of no length there.
            let mut turned = face.with_curves(|c| {
                let (low, high) = c.split(within(c.domain())).expect("a place inside");
                let stop = high.eval(high.domain()[0]).extend(1.0);
                let still =
                    Curve::new(KnotVector::bezier(2, [0.0, 1.0]).expect("knots"), vec![stop; 3]).expect("a point");
                vec![low, still, high]
            });
            turned.loops.iter_mut().for_each(|l| l.rotate_left(1));
            turned
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 22, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn other_words_for_the_same_trims_draw_the_same(eye in direction(), way in 0..11_usize, at in 0.05..0.95_f64) {
        let other: Vec<Face> = model().iter().map(|f| reworded(f, way, at)).collect();
        let up = up_of(eye);
        same(&visible(&scenes(&model()), eye, up, 3, 1.0), &visible(&scenes(&other), eye, up, 3, 1.0))?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn moving_turning_and_scaling_trimmed_surfaces_and_the_eye_changes_nothing(
        eye in direction(), axis in direction(), angle in 0.0..3.0_f64, far in 0.0..100.0_f64, scale in -3.0..3.0_f64,
    ) {
        let (turn, scale) = (DQuat::from_axis_angle(axis, angle), 10.0_f64.powf(scale));
        let map = DMat4::from_scale_rotation_translation(DVec3::splat(scale), turn, far * scale * axis);
        let moved = |f: &Face| Face { surface: f.surface.transformed(map).expect("a similarity"), ..f.clone() };
        let moved: Vec<Face> = model().iter().map(moved).collect();
        let up = up_of(eye);
        let still = visible(&scenes(&model()), eye, up, 3, 1.0);
        same(&still, &visible(&scenes(&moved), turn * eye, turn * up, 3, scale))?;
    }

    /// A hole across the seam, one round the axis and the seam elsewhere: turned round its axis by quarters a surface of
    /// revolution is the same, and its parameters are moved.
    #[test]
    fn the_place_of_the_seam_does_not_matter(eye in direction(), quarters in 1..4_u32, at in 0.0..1.0_f64, which in 0..3_usize) {
        let whole = |turn: u32| {
            let x = DVec2::from_angle(0.5 * PI * f64::from(turn)).extend(0.0);
            let frame = Frame::new(DVec3::ZERO, DVec3::Z, x).expect("a frame");
            match which {
                0 => cylinder(&frame, 1.0, 2.0),
                1 => sphere(&frame, 1.5),
                _ => torus(&frame, 2.0, 0.8),
            }
            .expect("a surface")
        };
        let face = |turn: u32| {
            let surface = whole(turn);
            let ([u0, u1], [v0, v1]) = (surface.domain_u(), surface.domain_v());
            let (width, height) = (u1 - u0, v1 - v0);
            let shift = DVec3::new(u0 + (at - 0.25 * f64::from(turn)) * width, v0, 0.0);
            let map = DMat4::from_translation(shift) * DMat4::from_scale(DVec3::new(width, height, 1.0));
            let placed = |c: Curve| TrimCurve { curve: c.transformed(map).expect("a map"), edge: None };
            let hole = |l: Loop| l.into_iter().map(|c| placed(c.reversed())).collect();
            // What is above a line all the way round is kept, but for two holes.
            let round = vec![placed(line(DVec3::new(0.0, 0.2, 0.0), DVec3::new(1.0, 0.2, 0.0)).expect("a line"))];
            let over = vec![placed(line(DVec3::new(1.0, 0.9, 0.0), DVec3::new(0.0, 0.9, 0.0)).expect("a line"))];
            let loops: Vec<Vec<TrimCurve>> =
                vec![round, over, hole(ring(DVec2::new(0.1, 0.5), 0.12)), hole(lobed(DVec2::new(0.5, 0.55), [0.2, 0.1]))];
            let trims = Some(Trims::oriented(&surface, [true, which == 2], &loops).expect("trims"));
            vec![SceneSurface { trims, ..SceneSurface::new("turned", surface) }]
        };
        let up = up_of(eye);
        same(&visible(&face(0), eye, up, 0, 1.0), &visible(&face(quarters), eye, up, 0, 1.0))?;
    }
}

/// Length of one kind against what it must be. At each of `touches` places two curves touch, and what
/// of them is within r on the screen, which is r of 10⁻⁸ of the size, is drawn once: √(8 r R) long, with R the radius.
fn expect(face: &SceneSurface, kind: CurveKind, expected: f64, touches: u32) {
    for eye in [DVec3::Z, DVec3::new(0.7, -1.3, 0.9), DVec3::new(-0.2, 0.4, 2.0)] {
        let up = if eye == DVec3::Z { DVec3::Y } else { DVec3::Z };
        let found = visible(std::slice::from_ref(face), eye, up, 5, 1.0).get(&(kind, 0)).copied().unwrap_or(0.0);
        let room = 1e-5 * (1.0 + expected) + 4e-4 * f64::from(touches);
        assert!((found - expected).abs() < room, "{kind:?} from {eye}: {found} instead of {expected}");
    }
}

/// The square with side 2 without the holes; its five isocurves a direction are at 0.1, 0.3 … of the range.
fn plate(holes: Vec<Loop>) -> SceneSurface {
    let loops = std::iter::once(rectangle([0.0, 1.0], [0.0, 1.0])).chain(holes).collect();
    Face { surface: square(0.0), loops }.scene()
}

/// Length of the chord of a circle with radius `r` at distance `d` from its middle.
fn chord(r: f64, d: f64) -> f64 {
    2.0 * (r * r - d * d).max(0.0).sqrt()
}

#[test]
fn a_hole_that_touches_isocurves_cuts_only_those_that_pass_it() {
    // Touches u = 0.5, u = 0.7 and none of v; v = 0.5 passes through its middle.
    let face = plate(vec![ring(DVec2::new(0.6, 0.5), 0.1)]);
    expect(&face, CurveKind::Iso, 2.0 * (10.0 - 0.2), 2);
    expect(&face, CurveKind::Boundary, 8.0 + 0.4 * PI, 0);
    // Sides along isocurves.
    let face = plate(vec![rectangle([0.3, 0.7], [0.4, 0.6])]);
    expect(&face, CurveKind::Boundary, 8.0 + 2.0 * 1.2, 0);
}

#[test]
fn a_bound_through_corners_of_the_range_and_crossings_of_isocurves() {
    let half = Face { surface: square(0.0), loops: vec![polygon(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)])] }.scene();
    expect(&half, CurveKind::Boundary, 4.0 + 8.0_f64.sqrt(), 0);
    expect(&half, CurveKind::Iso, 2.0 * 5.0, 0);
    // A square on its corner, all of which lie on isocurves.
    let holed = plate(vec![polygon(&[(0.5, 0.3), (0.7, 0.5), (0.5, 0.7), (0.3, 0.5)])]);
    expect(&holed, CurveKind::Iso, 2.0 * (10.0 - 2.0 * 0.4), 0);
    expect(&holed, CurveKind::Boundary, 8.0 + 2.0 * 4.0 * 0.08_f64.sqrt(), 0);
}

#[test]
fn bounds_along_parts_of_the_border() {
    // A comb: along the lower border, and up to the upper one twice.
    let comb = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.6, 1.0), (0.6, 0.2), (0.4, 0.2), (0.4, 1.0), (0.0, 1.0)];
    let face = Face { surface: square(0.0), loops: vec![polygon(&comb)] }.scene();
    expect(&face, CurveKind::Boundary, 2.0 * (1.0 + 2.0 + 0.8 + 1.6 + 0.2), 0);
    // u = 0.5 is cut from 0.2 on, and of v all from 0.3 on by the gap.
    expect(&face, CurveKind::Iso, 2.0 * (10.0 - 0.8 - 4.0 * 0.2), 0);
}

#[test]
fn holes_that_touch_one_another_and_the_border() {
    let rings = [(0.3, 0.5), (0.5, 0.5), (0.5, 0.1)].map(|(u, v)| DVec2::new(u, v));
    let face = plate(rings.iter().map(|&c| ring(c, 0.1)).collect());
    expect(&face, CurveKind::Boundary, 8.0 + 3.0 * 0.4 * PI, 2);
    let gone = |at: f64, along: usize| rings.iter().map(|c| chord(0.1, c[along] - at)).sum::<f64>();
    let all: f64 = [0.1, 0.3, 0.5, 0.7, 0.9].iter().map(|&at| 2.0 - gone(at, 0) - gone(at, 1)).sum();
    expect(&face, CurveKind::Iso, 2.0 * all, 0);
    // What is seen through them of another square, from above.
    let under = SceneSurface::new("under", square(-1.0));
    let seen = visible(&[face, under], DVec3::Z, DVec3::Y, 5, 1.0);
    let expected: f64 = [0.1, 0.3, 0.5, 0.7, 0.9].iter().map(|&at| gone(at, 0) + gone(at, 1)).sum();
    let found = seen.get(&(CurveKind::Iso, 1)).copied().unwrap_or(0.0);
    assert!((found - 2.0 * expected).abs() < 1e-4, "{found} instead of {}", 2.0 * expected);
}

#[test]
fn islands_in_holes_and_bounds_that_run_along_one_another() {
    // A window with an island, of which one side is the window's.
    let face = plate(vec![rectangle([0.2, 0.8], [0.2, 0.8]), rectangle([0.2, 0.6], [0.35, 0.65])]);
    expect(&face, CurveKind::Boundary, 8.0 + 2.0 * (2.4 + 1.4 - 2.0 * 0.3), 0);
    // u: 0.3 and 0.5 lose 0.3, 0.7 loses 0.6. v: 0.3 and 0.7 lose 0.6, 0.5 loses 0.2.
    expect(&face, CurveKind::Iso, 2.0 * (10.0 - 0.3 - 0.3 - 0.6 - 0.6 - 0.6 - 0.2), 0);
    // The middle of the window's side is not what they have in common.
    let face = plate(vec![rectangle([0.2, 0.8], [0.2, 0.8]), rectangle([0.2, 0.6], [0.35, 0.45])]);
    expect(&face, CurveKind::Boundary, 8.0 + 2.0 * (2.4 + 1.0 - 2.0 * 0.1), 0);
    expect(&face, CurveKind::Iso, 2.0 * (10.0 - 0.5 - 0.5 - 0.6 - 3.0 * 0.6), 0);
    // Half a disc in a round hole, along half of its edge.
    let half = arc(&Frame::at(DVec3::new(0.5, 0.5, 0.0)).expect("a frame"), 0.2, 0.3, PI).expect("an arc");
    let [a, b] = half.domain().map(|t| half.eval(t));
    let face = plate(vec![ring(DVec2::splat(0.5), 0.2), vec![half, line(b, a).expect("a line")]]);
    expect(&face, CurveKind::Boundary, 8.0 + 2.0 * (0.2 * PI + 0.4), 0);
}

/// A ball without its cap, by a trim that goes round the pole, and by splitting.
#[test]
fn a_bound_round_a_pole_is_a_circle_of_latitude() {
    let ball = sphere(&Frame::WORLD, 1.5).expect("a sphere");
    let ([u0, u1], [v0, v1]) = (ball.domain_u(), ball.domain_v());
    let v = v0 + 0.7 * (v1 - v0);
    let (below, above) = ball.split_v(v).expect("a place inside");
    for (part, ends) in [(below, [u1, u0]), (above, [u0, u1])] {
        let round = line(DVec3::new(ends[0], v, 0.0), DVec3::new(ends[1], v, 0.0)).expect("a line");
        let loops = [vec![TrimCurve { curve: round, edge: None }]];
        let trims = Some(Trims::oriented(&ball, [true, false], &loops).expect("trims"));
        let cut = SceneSurface { trims, ..SceneSurface::new("cut", ball.clone()) };
        for eye in [DVec3::new(0.7, -1.3, 0.9), DVec3::new(0.1, 0.3, -0.8), DVec3::new(-1.0, 0.2, 0.1), DVec3::Z] {
            let seen = |s: &SceneSurface| visible(std::slice::from_ref(s), eye, up_of(eye), 0, 1.0);
            let (a, b) = (seen(&cut), seen(&SceneSurface::new("part", part.clone())));
            same(&a, &b).unwrap_or_else(|e| panic!("from {eye}: {e}"));
        }
    }
}
