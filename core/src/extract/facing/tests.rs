use super::*;
use alloc::vec::Vec;
use proptest::prelude::*;

fn patch(p: usize, q: usize, mut f: impl FnMut(usize, usize) -> DVec4) -> Patch {
    let mut points = Vec::new();
    for i in 0..=p {
        for j in 0..=q {
            points.push(f(i, j));
        }
    }
    Patch { surface: 0, degree_u: p, degree_v: q, points, u: [0.0, 1.0], v: [0.0, 1.0] }
}

/// A patch of degrees up to 4 with control points near a grid, far from the origin or not, rational or not.
fn any_patch() -> impl Strategy<Value = Patch> {
    (1_usize..5, 1_usize..5, any::<bool>(), -10.0..10.0_f64, 0.0..2.0_f64)
        .prop_flat_map(|(p, q, rational, shift, jitter)| {
            let n = (p + 1) * (q + 1);
            (Just((p, q, rational, shift, jitter)), proptest::collection::vec((-1.0..1.0_f64, -1.0..1.0, 0.2..2.0), n))
        })
        .prop_map(|((p, q, rational, shift, jitter), noise)| {
            patch(p, q, |i, j| {
                let (a, b, w) = noise[i * (q + 1) + j];
                let w = if rational { w } else { 1.0 };
                DVec4::new(i as f64 + jitter * a + shift, j as f64 + jitter * b - shift, a * b, 1.0) * w
            })
        })
}

proptest! {
    #[test]
    fn the_polynomial_is_the_normal_times_the_weight_cubed(patch in any_patch(), s in 0.0..1.0_f64, t in 0.0..1.0_f64) {
        let f = facing_polynomial(&patch);
        let jet = patch.jet(s, t);
        let w = if patch.is_polynomial() { 1.0 } else { patch.homogeneous_jet(s, t)[0].w };
        let want = jet.normal().z * w * w * w;
        prop_assert!((f.eval(s, t) - want).abs() <= 1e-10 * (f.magnitude() + 1.0), "{} {want}", f.eval(s, t));
        let form = facing(&patch);
        let normal = jet.normal().z;
        match form.facing {
            Facing::Front => prop_assert!(normal > -1e-9),
            Facing::Back => prop_assert!(normal < 1e-9),
            Facing::EdgeOn => prop_assert!(normal.abs() < 1e-9),
            Facing::Mixed => {}
        }
    }

    #[test]
    fn gradient_agrees_with_the_polynomial(patch in any_patch(), s in 0.0..1.0_f64, t in 0.0..1.0_f64) {
        let form = facing(&patch);
        if let Some(f) = &form.polynomial {
            let want = [f.eval(s, t), f.derivative_u().eval(s, t), f.derivative_v().eval(s, t)];
            for (g, w) in form.gradient(s, t).iter().zip(want) {
                prop_assert!((g - w).abs() <= 1e-12 * f.magnitude());
            }
            for (along_v, x, y) in [(true, s, t), (false, t, s)] {
                let (value, slope) = LineForm::new(f, along_v, x).eval(y);
                prop_assert!((value - want[0]).abs() <= 1e-12 * f.magnitude());
                let want = want[if along_v { 2 } else { 1 }];
                prop_assert!((slope - want).abs() <= 1e-12 * f.magnitude());
            }
        }
    }

    #[test]
    fn a_plane_or_cylinder_seen_along_itself_is_edge_on(
        shift in -100.0..100.0_f64, a in -1.0..1.0_f64, b in -1.0..1.0_f64, rational in any::<bool>(),
    ) {
        // All points on the screen line or curve of u alone; v runs along the sight line, at a place with rounding.
        let p = patch(3, 2, |i, j| {
            let (u, w) = (i as f64 / 3.0, if rational { (1.0 + 0.3 * (i % 2) as f64) * (1.0 + 0.2 * j as f64) } else { 1.0 });
            DVec4::new(a * u + shift, b * u + u * u * shift * 1e-3, 0.7 * j as f64 + u, 1.0) * w
        });
        prop_assert_eq!(facing(&p).facing, Facing::EdgeOn);
    }
}

#[test]
fn first_differences_decide_a_gentle_patch_without_the_polynomial() {
    let gentle = patch(3, 3, |i, j| DVec4::new(i as f64, j as f64 + 0.2 * (i * i) as f64, (i * j) as f64, 1.0));
    let form = facing(&gentle);
    assert_eq!((form.facing, form.polynomial), (Facing::Front, None));
    let turned = patch(3, 3, |i, j| DVec4::new(-(i as f64), j as f64, 0.0, 1.0));
    assert_eq!(facing(&turned).facing, Facing::Back);
    let (_, stats) = facing_of_all(&[gentle, turned], Stop::NEVER);
    assert_eq!((stats.patches, stats.by_differences, stats.mixed), (2, 2, 0));
}

#[test]
fn a_vanishing_edge_is_divided_out() {
    // x = u², y = v: N_z = 2u.
    let p = patch(2, 1, |i, j| DVec4::new(if i == 2 { 1.0 } else { 0.0 }, j as f64, i as f64, 1.0));
    let form = facing(&p);
    assert_eq!((form.facing, form.edge_factor, form.collapsed), (Facing::Front, [1, 0, 0, 0], [false; 4]));
    // x = (1 − v)³, y = u: N_z = 3 (1 − v)².
    let p = patch(1, 3, |i, j| DVec4::new(if j == 0 { 1.0 } else { 0.0 }, i as f64, 0.0, 1.0));
    let form = facing(&p);
    assert_eq!((form.facing, form.edge_factor), (Facing::Front, [0, 0, 0, 2]));
}

#[test]
fn a_pole_is_a_factor_on_a_collapsed_edge() {
    // x = v (1 + u), y = v (2 − u): a fan about the origin, v = 0 collapsed, N_z = 3 v.
    let p = patch(1, 1, |i, j| DVec4::new((j * (1 + i)) as f64, (j * (2 - i)) as f64, 1.0, 1.0));
    let form = facing(&p);
    assert_eq!(form.collapsed, [false, false, true, false]);
    assert_eq!(form.edge_factor, [0, 0, 1, 0]);
    assert_eq!(form.facing, Facing::Front);
}

proptest! {
    #[test]
    fn differences_never_contradict_the_polynomial(
        offsets in prop::collection::vec((-0.4..0.4_f64, -0.4..0.4_f64, -1.0..1.0_f64, -1.5..1.5_f64), 16),
        slant in -2.0..2.0_f64, rational in any::<bool>(), flip in any::<bool>(), s in 0.0..=1.0_f64, t in 0.0..=1.0_f64,
    ) {
        let p = patch(3, 3, |i, j| {
            let (x, y, z, w) = offsets[4 * i + j];
            let (x, y) = (i as f64 + x, j as f64 + y);
            DVec4::new(if flip { -x } else { x } + slant * y, y, z, 1.0) * if rational { 10.0_f64.powf(w) } else { 1.0 }
        });
        let form = facing(&p);
        if form.polynomial.is_none() && form.facing != Facing::EdgeOn {
            let f = facing_polynomial(&p).eval(s, t);
            prop_assert_eq!(f > 0.0, form.facing == Facing::Front, "{}", f);
        }
    }
}

#[test]
fn directions_of_differences_decide_a_gentle_rational_patch() {
    let gentle = patch(3, 2, |i, j| {
        DVec4::new(i as f64, j as f64 + 0.1 * (i * i) as f64, (i * j) as f64, 1.0) * [1.0, 2.0, 1.5, 2.5][i]
    });
    let form = facing(&gentle);
    assert_eq!((form.facing, form.polynomial), (Facing::Front, None));
}

#[test]
fn the_class_of_a_patch_is_that_of_its_surface_and_not_of_its_net() {
    // A row of the net is folded back, so that the normals of the net's facets have both signs (by which Ruan, Zhang and
    // Yong 2006 would call the patch partially visible); the surface only slows down there.
    let p = patch(3, 1, |i, j| DVec4::new([0.0, 1.2, 0.9, 2.0][i], j as f64, 0.0, 1.0));
    let facet = |i: usize| p.points[2 * (i + 1)].x - p.points[2 * i].x;
    assert!(facet(0) > 0.0 && facet(1) < 0.0 && facet(2) > 0.0);
    let form = facing(&p);
    let silhouettes = match &form.polynomial {
        Some(f) if form.facing == Facing::Mixed => {
            crate::extract::zero_set::zero_set(f, form.rounding).stats.components
        }
        _ => 0,
    };
    assert_eq!(silhouettes, 0);
    assert!(facing_polynomial(&p).eval(0.5, 0.5) > 0.0);
}
