use super::*;
use alloc::vec;
use proptest::prelude::*;

fn u() -> Bivariate {
    Bivariate::from_fn(1, 0, |i, _| i as f64)
}

fn v() -> Bivariate {
    Bivariate::from_fn(0, 1, |_, j| j as f64)
}

fn c(x: f64) -> Bivariate {
    Bivariate::constant(x)
}

fn circle(a: f64, b: f64, r: f64) -> Bivariate {
    let (x, y) = (u().sub(&c(a)), v().sub(&c(b)));
    x.mul(&x).add(&y.mul(&y)).sub(&c(r * r))
}

fn noise(f: &Bivariate) -> f64 {
    64.0 * f64::EPSILON * f.magnitude()
}

/// The arc's point at a fraction of its independent variable, by bisection.
fn point(f: &Bivariate, arc: &Arc, t: f64) -> DVec2 {
    let at = |x: f64, y: f64| if arc.axis == Variable::U { DVec2::new(x, y) } else { DVec2::new(y, x) };
    let p = arc.start + (arc.end - arc.start) * t;
    let x = if arc.axis == Variable::U { p.x } else { p.y };
    let [mut lo, mut hi] = if arc.axis == Variable::U { arc.cell.v } else { arc.cell.u };
    for _ in 0..60 {
        let y = 0.5 * (lo + hi);
        let q = at(x, y);
        if (f.eval(q.x, q.y) > 0.0) == arc.rising {
            hi = y;
        } else {
            lo = y;
        }
    }
    at(x, 0.5 * (lo + hi))
}

/// What holds of every zero set: arcs join bit by bit, lie on F = 0, keep F > 0 on the left, and open components end on
/// the border unless something is undecided.
fn sanity_check(f: &Bivariate, z: &ZeroSet) {
    let small = 1e-10 * f.magnitude();
    for component in &z.components {
        let arcs = &component.arcs;
        for pair in arcs.windows(2) {
            assert_eq!(pair[0].end, pair[1].start);
        }
        match component.ends {
            None => assert_eq!(arcs[0].start, arcs[arcs.len() - 1].end),
            Some(ends) => {
                let points = [arcs[0].start, arcs[arcs.len() - 1].end];
                for (end, p) in ends.iter().zip(points) {
                    match end {
                        ZeroEnd::Border => assert!([p.x, p.y].iter().any(|&x| x == 0.0 || x == 1.0), "{p}"),
                        ZeroEnd::Crossing => {
                            assert!(z.crossings.iter().any(|c| c.place.contains(p)), "{p} is no crossing")
                        }
                        ZeroEnd::Undecided => assert!(
                            z.undecided
                                .iter()
                                .any(|r| p.x >= r.u[0] && p.x <= r.u[1] && p.y >= r.v[0] && p.y <= r.v[1]),
                            "{p} ends on no undecided cell"
                        ),
                    }
                }
            }
        }
        for arc in arcs {
            let middle = point(f, arc, 0.5);
            assert!(f.eval(middle.x, middle.y).abs() <= small, "{arc:?}");
            assert!(f.eval(arc.start.x, arc.start.y).abs() <= small && f.eval(arc.end.x, arc.end.y).abs() <= small);
            let gradient =
                DVec2::new(f.derivative_u().eval(middle.x, middle.y), f.derivative_v().eval(middle.x, middle.y));
            let along = point(f, arc, 0.6) - point(f, arc, 0.4);
            if along.length() > 1e-6 && gradient.length() > 1e-6 * f.magnitude() {
                assert!(along.perp_dot(gradient) > 0.0, "{arc:?}");
            }
        }
    }
    assert_eq!((z.stats.undecided, z.stats.crossings), (z.undecided.len(), z.crossings.len()));
    assert_eq!(z.stats.components, z.components.len());
}

fn solve(f: &Bivariate) -> ZeroSet {
    let z = zero_set(f, noise(f));
    sanity_check(f, &z);
    let w = zero_set(&f.transposed(), noise(f));
    sanity_check(&f.transposed(), &w);
    if z.undecided.is_empty() && w.undecided.is_empty() {
        assert_eq!((z.stats.components, z.stats.loops), (w.stats.components, w.stats.loops), "u and v exchanged");
    }
    z
}

#[test]
fn loops_are_found_however_small() {
    for r in [0.3, 0.1, 1e-3, 1e-5] {
        let z = solve(&circle(0.31, 0.62, r));
        assert_eq!((z.stats.components, z.stats.loops, z.stats.undecided), (1, 1, 0), "radius {r}: {:?}", z.stats);
    }
    // Below the resolution it is not lost either: it is undecided.
    let z = solve(&circle(0.31, 0.62, 1e-9));
    assert!(z.stats.components + z.stats.isolated + z.stats.undecided > 0);
}

#[test]
fn nested_and_separate_loops_in_one_polynomial() {
    let f =
        circle(0.3, 0.3, 0.2).mul(&circle(0.3, 0.3, 0.1)).mul(&circle(0.7, 0.75, 0.05)).mul(&circle(0.7, 0.2, 0.002));
    let z = solve(&f);
    assert_eq!((z.stats.components, z.stats.loops, z.stats.undecided), (4, 4, 0), "{:?}", z.stats);
}

#[test]
fn branches_between_every_pair_of_sides() {
    // Lines from side to side, as zero sets of linear polynomials a u + b v + c.
    for (a, b, k) in [
        (1.0, 0.1, -0.4),
        (0.1, 1.0, -0.4),
        (1.0, 1.0, -0.3),
        (1.0, 1.0, -1.7),
        (1.0, -1.0, 0.6),
        (1.0, -1.0, -0.6),
        (1.0, 0.0, -0.5),
        (0.0, 1.0, -0.5),
    ] {
        let f = u().scaled(a).add(&v().scaled(b)).add(&c(k));
        let z = solve(&f);
        assert_eq!((z.stats.components, z.stats.loops, z.stats.undecided), (1, 0, 0), "{a} {b} {k}");
        let z = solve(&f.scaled(-1.0));
        assert_eq!(z.stats.components, 1);
    }
}

#[test]
fn several_branches_in_one_monotone_cell() {
    // v = ½ + 60 (u − ½)(u − 0.2)(u − 0.8) leaves the square and comes back.
    let x = |a: f64| u().sub(&c(a));
    let f = v().sub(&c(0.5)).sub(&x(0.5).mul(&x(0.2)).mul(&x(0.8)).scaled(60.0));
    let z = solve(&f);
    assert_eq!((z.stats.components, z.stats.cells, z.stats.undecided), (3, 1, 0));
}

#[test]
fn roots_in_corners_of_the_square() {
    for f in [u().sub(&v()), u().add(&v()).sub(&c(1.0))] {
        let z = solve(&f);
        assert_eq!((z.stats.components, z.stats.undecided), (1, 0));
        let (a, b) = (z.components[0].arcs[0].start, z.components[0].arcs.last().unwrap().end);
        assert!([a, b].iter().all(|p| (p.x == 0.0 || p.x == 1.0) && (p.y == 0.0 || p.y == 1.0)));
    }
    // Touches the square in a corner only.
    let z = solve(&u().add(&v()));
    assert_eq!((z.stats.components, z.stats.undecided), (0, 0));
    // A parabola that leaves through the corner (0, 0) with a vertical and with a slanted tangent.
    for f in [v().mul(&v()).sub(&u()), v().sub(&u().mul(&u())).sub(&u())] {
        let z = solve(&f);
        assert_eq!((z.stats.components, z.stats.undecided), (1, 0));
    }
    // The corner is touched from inside by a branch that comes in and goes out on both of its sides.
    let f = circle(0.0, 0.0, 0.5).mul(&u().scaled(2.0).sub(&v()));
    let z = zero_set(&f, noise(&f));
    sanity_check(&f, &z);
    assert_eq!((z.stats.crossings, z.stats.undecided), (1, 0), "the branches cross at one point");
}

#[test]
fn touching_the_border() {
    // A circle inside, touching v = 0; and outside, touching nothing else.
    let z = solve(&circle(0.4, 0.25, 0.25));
    assert_eq!((z.stats.components, z.stats.undecided), (1, 0), "{:?}", z);
    let z = solve(&circle(0.4, -0.25, 0.25));
    assert_eq!((z.stats.components, z.stats.undecided), (0, 0), "{:?}", z);
    // Nearly touching, on either side.
    let z = solve(&circle(0.4, 0.25, 0.25 - 1e-7));
    assert_eq!((z.stats.components, z.stats.loops, z.stats.undecided), (1, 1, 0));
    let z = solve(&circle(0.4, 0.25, 0.25 + 1e-7));
    assert_eq!((z.stats.components, z.stats.loops, z.stats.undecided), (1, 0, 0));
}

/// The components that reach a crossing, counted by end.
fn arms(z: &ZeroSet) -> usize {
    z.components.iter().filter_map(|c| c.ends).flatten().filter(|&e| e == ZeroEnd::Crossing).count()
}

#[test]
fn branches_that_cross_do_so_in_one_point() {
    for (a, b) in [(0.5, 0.5), (0.4871, 0.4871), (0.3, 0.6)] {
        let f = u().sub(&c(a)).mul(&v().sub(&c(b)));
        let z = solve(&f);
        assert_eq!((z.stats.components, arms(&z)), (4, 4), "{:?}", z.stats);
        assert_eq!((z.stats.crossings, z.stats.undecided), (1, 0), "{a} {b} {:?}", z.stats);
        assert!((z.crossings[0].point - DVec2::new(a, b)).length() < 1e-12, "{:?}", z.crossings);
    }
}

#[test]
fn crossings_on_the_border_and_in_corners_keep_the_arms_inside() {
    let line = |p: DVec2, angle: f64| u().sub(&c(p.x)).scaled(angle.sin()).sub(&v().sub(&c(p.y)).scaled(angle.cos()));
    for (p, inside) in [([0.37, 0.0], 2), ([1.0, 0.61], 2), ([0.0, 1.0], 1)] {
        let p = DVec2::from_array(p);
        let f = line(p, 0.9).mul(&line(p, 2.1)).mul(&circle(p.x, p.y, 3.0));
        let z = solve(&f);
        assert_eq!((z.stats.components, z.stats.undecided), (inside, 0), "{p} {:?}", z);
        let ends = z.components.iter().filter_map(|c| c.ends.map(|_| [c.arcs[0].start, c.arcs[c.arcs.len() - 1].end]));
        assert_eq!(ends.flatten().filter(|e| (*e - p).length() < 1e-5).count(), inside, "{p} {:?}", z);
    }
}

#[test]
fn an_isolated_point_is_no_curve_and_not_undecided() {
    let f = circle(0.31, 0.62, 0.0);
    let z = solve(&f);
    assert_eq!((z.stats.components, z.stats.undecided), (0, 0), "{:?}", z.stats);
}

#[test]
fn every_kind_of_open_silhouette_from_border_to_border() {
    // The sixteen kinds of Ruan, Zhang and Yong (2006), table 1: zeros on u = 0, u = 1, v = 0, v = 1, by the ends' places.
    type Place = (Option<f64>, Option<f64>);
    let (low, high, free): (Option<f64>, Option<f64>, Option<f64>) = (Some(0.0), Some(1.0), None);
    let kinds: [(Place, Place); 16] = [
        ((low, free), (free, low)),
        ((high, free), (free, low)),
        ((high, free), (free, high)),
        ((low, free), (free, high)),
        ((low, free), (high, free)),
        ((free, low), (free, high)),
        ((low, low), (free, high)),
        ((high, low), (free, high)),
        ((low, high), (high, free)),
        ((low, low), (high, free)),
        ((low, high), (free, low)),
        ((high, high), (free, low)),
        ((high, high), (low, free)),
        ((high, low), (low, free)),
        ((low, high), (high, low)),
        ((low, low), (high, high)),
    ];
    for (kind, (a, b)) in kinds.into_iter().enumerate() {
        for (s, t) in [(0.5, 0.5), (0.2, 0.7), (0.9, 0.1), (1e-6, 0.5)] {
            let [p, q] = [(a, s), (b, t)].map(|((x, y), free)| DVec2::new(x.unwrap_or(free), y.unwrap_or(free)));
            let d = q - p;
            // (x − p) × d is 0 on the chord.
            let chord = u().sub(&c(p.x)).scaled(d.y).sub(&v().sub(&c(p.y)).scaled(d.x));
            // Times something without zeros, so that the degree is not 1.
            for f in [chord.clone(), chord.mul(&circle(0.4, 0.3, 2.0)), chord.scaled(-1.0)] {
                let z = solve(&f);
                assert_eq!((z.stats.components, z.stats.undecided), (1, 0), "kind {} {p} {q}", kind + 1);
                let arcs = &z.components[0].arcs;
                let e = [arcs[0].start, arcs[arcs.len() - 1].end];
                let near = |x: DVec2, y: DVec2| (x - y).length() < 1e-12;
                assert!(
                    (near(e[0], p) && near(e[1], q)) || (near(e[0], q) && near(e[1], p)),
                    "kind {} {e:?}",
                    kind + 1
                );
            }
        }
    }
}

#[test]
fn isoparametric_zero_lines_at_symmetric_places() {
    for k in [0.5, 0.25, 0.75, 0.4871] {
        let f = u().sub(&c(k)).mul(&circle(0.5, 0.5, 2.0));
        let z = solve(&f);
        assert_eq!((z.stats.components, z.stats.undecided), (1, 0), "u = {k}: {:?}", z.stats);
    }
}

#[test]
fn a_double_curve_is_undecided_and_bounded_in_cost() {
    let g = circle(0.45, 0.52, 0.3);
    let f = g.mul(&g);
    let z = zero_set(&f, noise(&f));
    assert!(z.stats.cells <= 2 * MAX_CELLS && !z.undecided.is_empty());
    for r in &z.undecided {
        let distance = DVec2::new(r.u[0] - 0.45, r.v[0] - 0.52).length() - 0.3;
        assert!(distance.abs() < 2e-2, "{r:?} {distance}");
    }
}

#[test]
fn no_zero_no_work() {
    let z = zero_set(&c(1.0), 0.0);
    assert_eq!(z.stats, ZeroSetStats::default());
}

fn polynomial() -> impl Strategy<Value = Bivariate> {
    (1_usize..6, 1_usize..6)
        .prop_flat_map(|(p, q)| (Just((p, q)), proptest::collection::vec(-1.0..1.0_f64, (p + 1) * (q + 1))))
        .prop_map(|((p, q), coef)| Bivariate::from_fn(p, q, |i, j| coef[i * (q + 1) + j]))
}

/// Small integers as coefficients: zeros in corners, on split lines, singular points, all of them often.
fn degenerate_polynomial() -> impl Strategy<Value = Bivariate> {
    (1_usize..5, 1_usize..5)
        .prop_flat_map(|(p, q)| (Just((p, q)), proptest::collection::vec(-1..=1_i32, (p + 1) * (q + 1))))
        .prop_map(|((p, q), coef)| Bivariate::from_fn(p, q, |i, j| f64::from(coef[i * (q + 1) + j])))
        .prop_filter("vanishes on a border line", |f| {
            let (p, q) = (f.degree_u(), f.degree_v());
            (0..=q).any(|j| f.get(0, j) != 0.0)
                && (0..=q).any(|j| f.get(p, j) != 0.0)
                && (0..=p).any(|i| f.get(i, 0) != 0.0)
                && (0..=p).any(|i| f.get(i, q) != 0.0)
        })
}

/// Every line of a grid meets the arcs exactly as often as F changes sign along it.
fn agrees_with_grid(f: &Bivariate, z: &ZeroSet) {
    const N: usize = 23;
    for k in 1..N {
        let at = k as f64 / N as f64 + 1e-4;
        let near_undecided = |lo: f64, hi: f64| z.undecided.iter().any(|r| r.u[0] <= hi && r.u[1] >= lo);
        if near_undecided(at, at) {
            continue;
        }
        let on_line = f.restricted_u(at);
        let samples: Vec<f64> = (0..=4000)
            .map(|s| on_line.eval(if s == 0 { 0.0 } else { (f64::from(s) + 0.3) / 4001.0 }))
            .chain([on_line.eval(1.0)])
            .collect();
        let changes = samples.windows(2).filter(|w| w[0] * w[1] < 0.0).count();
        // Crossings of the arcs with u = at, as sign changes of u − at along finely sampled components.
        let mut crossings = 0;
        for component in &z.components {
            let mut points = vec![component.arcs[0].start];
            for arc in &component.arcs {
                points.extend((1..40).map(|s| point(f, arc, f64::from(s) / 40.0)));
                points.push(arc.end);
            }
            crossings += points.windows(2).filter(|w| (w[0].x - at) * (w[1].x - at) < 0.0).count();
        }
        // Two close roots can hide from the samples of either count, in pairs.
        assert_eq!(crossings % 2, changes % 2, "on u = {at}");
        let close = on_line.roots().windows(2).any(|w| w[1].t - w[0].t < 2e-2);
        if !close {
            assert_eq!(crossings, changes, "on u = {at}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn random_zero_sets_agree_with_the_sign_pattern(f in polynomial()) {
        let z = solve(&f);
        prop_assert!(z.undecided.is_empty());
        agrees_with_grid(&f, &z);
    }

    #[test]
    fn degenerate_zero_sets_keep_the_invariants(f in degenerate_polynomial()) {
        let z = solve(&f);
        agrees_with_grid(&f, &z);
    }
}
