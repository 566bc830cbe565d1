//! Invariants: no change of representation moves a point.

use alloc::vec;
use alloc::vec::Vec;

use glam::{DMat4, DVec3, DVec4};
use proptest::prelude::*;

use super::{Curve, KnotVector, NurbsError, Surface};
use crate::view::MAX_DEGREE;

/// Control points lie in the cube of side 2 about the origin and weights in [0.1, 10], so points are of size 1, and
/// rounding is some p² · 2⁻⁵³ times the ratio of the weights.
const TOLERANCE: f64 = 1e-12;

/// Where a parameter of size up to 60 is itself rounded, and knots are 0.1 apart or more: a span's derivative is at most
/// p · (ratio of the weights)² · diameter / 0.1 < 10⁷ (Floater 1992), times an ulp of the parameter.
const PARAMETER_TOLERANCE: f64 = 1e-6;

/// Legal knot vectors of degree up to `most`, clamped or not, with repeated knots and knots `close` apart.
fn knot_vectors(most: usize, close: f64) -> impl Strategy<Value = KnotVector> {
    let step = prop_oneof![Just(0.0), Just(1.0), Just(close), 0.1..3.0_f64];
    let steps = prop::collection::vec(step, 2 * most + 2..30);
    (1..=most, steps, any::<bool>(), -5.0..5.0_f64).prop_filter_map("empty domain", |(p, steps, clamped, start)| {
        let mut t = start;
        let mut knots = vec![t];
        let mut run = 1;
        for step in steps {
            // More than p equal knots would tear the curve.
            let step = if run == p && step == 0.0 { 0.5 } else { step };
            run = if step > 0.0 { 1 } else { run + 1 };
            t += step;
            knots.push(t);
        }
        if clamped {
            let (first, last) = (knots[0] - 0.3, t + 0.3);
            knots.splice(0..0, vec![first; p + 1]);
            knots.extend(vec![last; p + 1]);
        }
        match KnotVector::new(knots, p) {
            Err(NurbsError::EmptyDomain { .. }) => None,
            checked => Some(checked.unwrap()),
        }
    })
}

fn points(count: usize) -> impl Strategy<Value = Vec<DVec4>> {
    let point = (-1.0..1.0_f64, -1.0..1.0_f64, -1.0..1.0_f64, prop_oneof![Just(1.0), 0.1..10.0_f64]);
    prop::collection::vec(point.prop_map(|(x, y, z, w)| DVec4::new(x, y, z, w)), count)
}

/// Numbers at the limits of the format, and ordinary ones.
fn extremes() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => 0.1..3.0_f64,
        2 => prop::sample::select(vec![0.0, 1.0, -1.0, 5e-324, f64::MIN_POSITIVE, f64::EPSILON, 1e150, 8e307]),
        1 => prop::num::f64::ANY,
    ]
}

fn curves_on(knots: impl Strategy<Value = KnotVector>) -> impl Strategy<Value = Curve> {
    knots.prop_flat_map(|k| (points(k.control_count()), Just(k))).prop_map(|(points, k)| Curve::new(k, points).unwrap())
}

fn curves() -> impl Strategy<Value = Curve> {
    curves_on(knot_vectors(MAX_DEGREE, 1e-7))
}

fn surfaces_with(close: f64) -> impl Strategy<Value = Surface> {
    (knot_vectors(4, close), knot_vectors(3, close))
        .prop_flat_map(|(u, v)| (points(u.control_count() * v.control_count()), Just(u), Just(v)))
        .prop_map(|(points, u, v)| Surface::new(u, v, points).unwrap())
}

fn surfaces() -> impl Strategy<Value = Surface> {
    surfaces_with(1e-7)
}

/// Parameters over a domain, ends and knots among them.
fn samples(knots: &KnotVector) -> Vec<f64> {
    let [a, b] = knots.domain();
    let mut t: Vec<f64> = (0..=20).map(|i| (a + (b - a) * f64::from(i) / 20.0).min(b)).collect();
    t.extend(knots.breaks());
    t
}

/// Where a fraction of the domain lies, strictly inside.
fn inside(knots: &KnotVector, f: f64) -> f64 {
    let [a, b] = knots.domain();
    a + (b - a) * (0.01 + 0.98 * f)
}

fn same_curve(a: &Curve, b: &Curve) -> Result<(), TestCaseError> {
    for t in samples(a.knots()) {
        let d = (a.eval(t) - b.eval(t)).length();
        prop_assert!(d < TOLERANCE, "{d:e} apart at {t}");
    }
    Ok(())
}

fn same_surface(a: &Surface, b: &Surface) -> Result<(), TestCaseError> {
    for &u in samples(a.knots_u()).iter().step_by(3) {
        for &v in samples(a.knots_v()).iter().step_by(3) {
            let d = (a.eval(u, v) - b.eval(u, v)).length();
            prop_assert!(d < TOLERANCE, "{d:e} apart at {u}, {v}");
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(96) })]

    #[test]
    fn knot_insertion_moves_no_point(c in curves(), f in 0.0..1.0_f64) {
        let t = inside(c.knots(), f);
        let times = c.degree() - c.knots().multiplicity(t);
        let d = c.insert_knot(t, times).unwrap();
        prop_assert_eq!(d.knots().multiplicity(t), c.degree());
        prop_assert!(KnotVector::new(d.knots().as_slice().to_vec(), d.degree()).is_ok());
        same_curve(&c, &d)?;
        prop_assert!(d.insert_knot(t, 1).is_err());
    }

    #[test]
    fn degree_elevation_moves_no_point_and_keeps_the_continuity(c in curves(), by in 1..4_usize) {
        let degree = (c.degree() + by).min(MAX_DEGREE);
        let d = c.elevated(degree).unwrap();
        prop_assert_eq!(d.degree(), degree);
        prop_assert!(KnotVector::new(d.knots().as_slice().to_vec(), degree).is_ok());
        let breaks = c.knots().breaks();
        for &t in &breaks[1..breaks.len() - 1] {
            prop_assert_eq!(d.degree() - d.knots().multiplicity(t), c.degree() - c.knots().multiplicity(t));
        }
        same_curve(&c, &d)?;
    }

    #[test]
    fn clamping_and_splitting_move_no_point(c in curves(), f in 0.0..1.0_f64) {
        let d = c.clamped();
        prop_assert!(d.knots().is_clamped());
        prop_assert_eq!(d.domain(), c.domain());
        same_curve(&c, &d)?;
        let t = inside(c.knots(), f);
        let (a, b) = c.split(t).unwrap();
        prop_assert_eq!([a.domain(), b.domain()], [[c.domain()[0], t], [t, c.domain()[1]]]);
        same_curve(&a, &c)?;
        same_curve(&b, &c)?;
        prop_assert_eq!(a.homogeneous().last(), b.homogeneous().first());
    }

    #[test]
    fn bezier_segments_are_the_curve_and_meet(c in curves()) {
        let segments = c.bezier_segments();
        for pair in segments.windows(2) {
            prop_assert_eq!(pair[0].interval[1], pair[1].interval[0]);
            prop_assert_eq!(pair[0].points.last(), pair[1].points.first());
        }
        for s in segments {
            let piece = Curve::trusted(KnotVector::bezier(c.degree(), s.interval).unwrap(), s.points);
            same_curve(&piece, &c)?;
        }
    }

    #[test]
    fn reversal_runs_backwards(c in curves_on(knot_vectors(MAX_DEGREE, 0.1))) {
        let r = c.reversed();
        let [a, b] = c.domain();
        prop_assert_eq!(r.domain(), [a, b]);
        for i in 0..=20 {
            let t = a + (b - a) * f64::from(i) / 20.0;
            prop_assert!((c.eval(t) - r.eval(a + (b - t))).length() < PARAMETER_TOLERANCE);
        }
    }

    #[test]
    fn derivatives_are_limits_of_difference_quotients(c in curves(), f in 0.0..1.0_f64) {
        // On one Bézier piece, stretched to length 1, so that no knot lies within the step.
        let s = c.bezier_segments().swap_remove(0);
        let piece = Curve::trusted(KnotVector::bezier(c.degree(), [0.0, 1.0]).unwrap(), s.points);
        let (t, h) = (0.1 + 0.8 * f, 1e-4);
        let [p, d1, d2] = piece.derivatives(t);
        let (before, after) = (piece.eval(t - h), piece.eval(t + h));
        let scale = 1.0 + d1.length() + d2.length();
        prop_assert!((p - piece.eval(t)).length() < TOLERANCE);
        // Third and fourth derivatives reach p³ and p⁴ times powers of the weights' ratio 100.
        prop_assert!(((after - before) / (2.0 * h) - d1).length() < 1e-2 * scale);
        prop_assert!(((after - 2.0 * p + before) / (h * h) - d2).length() < 1e-1 * scale);
    }

    #[test]
    fn refinements_of_a_surface_move_no_point(s in surfaces(), f in 0.0..1.0_f64, g in 0.0..1.0_f64) {
        let (u, v) = (inside(s.knots_u(), f), inside(s.knots_v(), g));
        same_surface(&s, &s.insert_knot_u(u, 1).unwrap().insert_knot_v(v, 1).unwrap())?;
        same_surface(&s, &s.elevated(s.degree_u() + 1, s.degree_v() + 2).unwrap())?;
        same_surface(&s, &s.clamped())?;
        let (a, b) = s.split_u(u).unwrap();
        let (b, c) = b.split_v(v).unwrap();
        for part in [a, b, c] {
            same_surface(&part, &s)?;
        }
        let (x, y) = (s.isocurve_u(u), s.isocurve_v(v));
        for t in samples(s.knots_v()) {
            prop_assert!((x.eval(t) - s.eval(u, t)).length() < TOLERANCE);
        }
        for t in samples(s.knots_u()) {
            prop_assert!((y.eval(t) - s.eval(t, v)).length() < TOLERANCE);
        }
    }

    #[test]
    fn bezier_patches_are_the_surface_and_meet(s in surfaces_with(0.1)) {
        let patches = s.bezier_patches(7);
        let (nu, nv) = (s.knots_u().breaks().len() - 1, s.knots_v().breaks().len() - 1);
        prop_assert_eq!(patches.len(), nu * nv);
        let (p, q) = (s.degree_u(), s.degree_v());
        for (i, patch) in patches.iter().enumerate() {
            prop_assert_eq!((patch.surface, patch.degree_u, patch.degree_v), (7, p, q));
            for (a, b) in [(0.0, 0.0), (0.3, 0.6), (1.0, 0.2), (0.7, 1.0)] {
                let uv = patch.to_surface(a, b);
                let expected = s.eval(uv.x, uv.y);
                prop_assert!((patch.eval(a, b) - expected).length() < PARAMETER_TOLERANCE);
            }
            if i % nv + 1 < nv {
                let next = &patches[i + 1];
                prop_assert!((0..=p).all(|r| patch.points[r * (q + 1) + q] == next.points[r * (q + 1)]));
            }
            if let Some(next) = patches.get(i + nv) {
                prop_assert_eq!(&patch.points[p * (q + 1)..], &next.points[..=q]);
            }
        }
    }

    #[test]
    fn surface_jets_agree_with_those_of_isocurves(s in surfaces_with(0.1), f in 0.0..1.0_f64, g in 0.0..1.0_f64) {
        let (u, v) = (inside(s.knots_u(), f), inside(s.knots_v(), g));
        let j = s.jet(u, v);
        let [p, du, duu] = s.isocurve_v(v).derivatives(u);
        let [_, dv, dvv] = s.isocurve_u(u).derivatives(v);
        let t = s.transposed().jet(v, u);
        // Differences of control points over knot intervals of 0.1, twice, and the weights' ratio amplify rounding.
        let size = [j.p, j.du, j.dv, j.duu, j.duv, j.dvv].iter().fold(1.0, |m: f64, d| m.max(d.length()));
        for (a, b) in [(j.p, p), (j.du, du), (j.duu, duu), (j.dv, dv), (j.dvv, dvv), (j.duv, t.duv)] {
            prop_assert!((a - b).length() <= 1e-9 * size);
        }
    }

    #[test]
    fn nothing_panics_on_extreme_numbers(
        mut knots in prop::collection::vec(extremes(), 4..14),
        raw in prop::collection::vec((extremes(), extremes(), extremes()), 10),
        degree in 0..5_usize,
        t in extremes(),
    ) {
        knots.sort_by(f64::total_cmp);
        let Ok(k) = KnotVector::new(knots, degree) else { return Ok(()) };
        let points = raw.iter().map(|&(x, y, w)| DVec4::new(x, y, 1.0, w)).cycle();
        let Ok(c) = Curve::new(k.clone(), points.clone().take(k.control_count()).collect()) else { return Ok(()) };
        let _ = (c.derivatives(t), c.split(t), c.insert_knot(t, 1), c.elevated(degree + 1), c.reversed().clamped());
        let _ = (c.bezier_segments(), c.compatible(&c.reversed()), c.reparametrized([0.0, t]));
        let n = k.control_count();
        let Ok(s) = Surface::new(k.clone(), k, points.take(n * n).collect()) else { return Ok(()) };
        let _ = (s.jet(t, -t), s.split_v(t), s.elevated(degree, degree + 1), s.bezier_patches(0), s.isocurve_v(t));
    }

    #[test]
    fn transformation_commutes_with_evaluation(s in surfaces(), f in 0.0..1.0_f64, g in 0.0..1.0_f64) {
        // The plane z = 4 goes to infinity: in front of it the weight is positive.
        let divide = DMat4::from_cols(DVec4::X, DVec4::Y, DVec4::new(0.0, 0.0, 1.0, -1.0), DVec4::new(0.3, 0.1, 0.0, 4.0));
        let image = s.transformed(divide).unwrap();
        let (u, v) = (inside(s.knots_u(), f), inside(s.knots_v(), g));
        let h = divide * s.eval(u, v).extend(1.0);
        prop_assert!((image.eval(u, v) - h.truncate() / h.w).length() < TOLERANCE);
        let behind = s.transformed(divide * DMat4::from_translation(DVec3::Z * 6.0));
        let is_refused = matches!(behind, Err(NurbsError::Projection { .. }));
        prop_assert!(is_refused);
    }
}

#[test]
fn the_mixed_derivative_of_a_polynomial_surface() {
    // (u, v, u²v): S_uv = (0, 0, 2u).
    let k = |p| KnotVector::bezier(p, [0.0, 1.0]).unwrap();
    let z = [[0.0, 0.0], [0.0, 0.0], [0.0, 1.0]];
    let points = (0..3).flat_map(|i| (0..2).map(move |j| DVec4::new(i as f64 / 2.0, j as f64, z[i][j], 1.0))).collect();
    let j = Surface::new(k(2), k(1), points).unwrap().jet(0.3, 0.8);
    assert!((j.duv - DVec3::new(0.0, 0.0, 0.6)).length() < 1e-15);
    assert!((j.duu - DVec3::new(0.0, 0.0, 1.6)).length() < 1e-15);
    assert!((j.p - DVec3::new(0.3, 0.8, 0.072)).length() < 1e-15);
}

#[test]
fn the_mixed_derivative_of_a_rational_surface() {
    // (u, v, 0) / (1 + u v) has, with w = 1 + uv, the x component u/w, whose mixed derivative is −2u / w³.
    let k = || KnotVector::bezier(1, [0.0, 1.0]).unwrap();
    let points = vec![
        DVec4::new(0.0, 0.0, 0.0, 1.0),
        DVec4::new(0.0, 1.0, 0.0, 1.0),
        DVec4::new(1.0, 0.0, 0.0, 1.0),
        DVec4::new(0.5, 0.5, 0.0, 2.0),
    ];
    let (u, v) = (0.4, 0.7);
    let w: f64 = 1.0 + u * v;
    let j = Surface::new(k(), k(), points).unwrap().jet(u, v);
    let expected = DVec3::new(-2.0 * u, -2.0 * v, 0.0) / (w * w * w);
    assert!((j.duv - expected).length() < 1e-15, "{} {expected}", j.duv);
}

#[test]
fn defective_points_are_named() {
    let k = || KnotVector::bezier(1, [0.0, 1.0]).unwrap();
    let good = DVec4::ONE;
    let make = |second| Curve::new(k(), vec![good, second]).unwrap_err();
    assert!(matches!(Curve::new(k(), vec![good]), Err(NurbsError::PointCount { count: 1, expected: 2 })));
    for weight in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(make(good.with_w(weight)), NurbsError::Weight { index: 1, .. }));
    }
    assert!(matches!(make(good.with_y(f64::NAN)), NurbsError::PointNotFinite { index: 1 }));
    assert!(matches!(make(DVec4::new(1e300, 0.0, 0.0, 1e300)), NurbsError::PointNotFinite { index: 1 }));
    assert!(matches!(Surface::new(k(), k(), vec![good; 3]), Err(NurbsError::PointCount { count: 3, expected: 4 })));
    let c = Curve::new(k(), vec![good; 2]).unwrap();
    assert!(matches!(c.split(1.0), Err(NurbsError::OutsideDomain { .. })));
    assert!(matches!(c.split(f64::NAN), Err(NurbsError::OutsideDomain { .. })));
    assert!(matches!(c.insert_knot(0.5, 2), Err(NurbsError::InsertsTooMany { multiplicity: 2, most: 1, .. })));
    assert!(matches!(c.elevated(10), Err(NurbsError::Degree { degree: 10, .. })));
    assert!(!c.eval(f64::NAN).is_finite());
}
