use alloc::vec::Vec;

use glam::{DVec2, DVec3};
use proptest::prelude::*;

use super::*;
use crate::line::Axis;
use crate::shape::{Frame, cylinder, plane, polyline, sphere, torus};

fn tube() -> Surface {
    cylinder(&Frame::WORLD, 1.0, 1.0).unwrap()
}

/// A loop of straight curves through the corners; it closes where the last corner is.
fn path(corners: &[[f64; 2]]) -> Vec<TrimCurve> {
    let line = |w: &[[f64; 2]]| polyline(&[w[0], w[1]].map(|c| DVec3::new(c[0], c[1], 0.0))).unwrap();
    let edge = |(k, w): (usize, &[[f64; 2]])| TrimCurve { curve: line(w), edge: Some(k as u32) };
    corners.windows(2).enumerate().map(edge).collect()
}

/// Counterclockwise.
fn rectangle(lo: [f64; 2], hi: [f64; 2]) -> Vec<TrimCurve> {
    path(&[lo, [hi[0], lo[1]], hi, [lo[0], hi[1]], lo])
}

/// Clockwise.
fn hole(lo: [f64; 2], hi: [f64; 2]) -> Vec<TrimCurve> {
    path(&[lo, [lo[0], hi[1]], hi, [hi[0], lo[1]], lo])
}

/// The trims keep what `kept` says, at places off all lines of the tests.
fn assert_keeps(t: &Trims, kept: impl Fn(f64, f64) -> bool) {
    for i in 0..40 {
        for j in 0..40 {
            let at = DVec2::new(f64::from(i) + 0.37, f64::from(j) + 0.41) / 40.0;
            assert_eq!(t.contains(at), kept(at.x, at.y), "{at}");
        }
    }
    assert_eq!(t.loops().iter().map(|l| l.pieces()[0].from()).collect::<Vec<_>>(), {
        t.loops().iter().map(|l| l.pieces()[l.pieces().len() - 1].to()).collect::<Vec<_>>()
    });
}

const ROUND: [bool; 2] = [true, false];

fn on_tube(loops: &[Vec<TrimCurve>]) -> Trims {
    Trims::oriented(&tube(), ROUND, loops).unwrap()
}

#[test]
fn two_loops_that_wind_round_bound_a_band_wherever_they_begin() {
    for (a, b) in [(0.0, 0.0), (0.3, 0.0), (0.3, 0.8), (-2.6, 5.1), (1.0, -1.0)] {
        let t = on_tube(&[path(&[[a, 0.2], [a + 0.4, 0.2], [a + 1.0, 0.2]]), path(&[[b, 0.7], [b - 1.0, 0.7]])]);
        assert_keeps(&t, |_, v| 0.2 < v && v < 0.7);
        assert_eq!(t.loops().len(), 1, "{a} {b}");
        for u in [0.0, 1.0] {
            let seam = t.kept_on_border(Axis::U, u);
            assert!(seam.len() == 1 && (seam[0][0] - 0.2).abs() + (seam[0][1] - 0.7).abs() < 1e-12, "{seam:?}");
        }
    }
}

#[test]
fn a_loop_with_seams_is_that_band_too() {
    // Down the seam at the parameter of its other side as well, as some write it.
    for down in [0.0, 1.0] {
        let mut l = path(&[[0.0, 0.2], [1.0, 0.2], [1.0, 0.7], [0.0, 0.7]]);
        l.extend(path(&[[down, 0.7], [down, 0.2]]));
        let t = on_tube(&[l]);
        assert_keeps(&t, |_, v| 0.2 < v && v < 0.7);
    }
}

#[test]
fn one_loop_that_winds_round_keeps_what_is_above_or_below() {
    let t = on_tube(&[path(&[[0.4, 0.3], [0.9, 0.5], [1.4, 0.3]])]);
    assert_keeps(&t, |u, v| {
        let x = (u - 0.4).rem_euclid(1.0);
        v > if x < 0.5 { 0.3 + 0.4 * x } else { 0.7 - 0.4 * x }
    });
    let t = on_tube(&[path(&[[1.4, 0.3], [0.4, 0.3]])]);
    assert_keeps(&t, |_, v| v < 0.3);
}

#[test]
fn a_hole_over_the_seam_leaves_the_rest() {
    let in_hole = |u: f64, v: f64| !(0.1..0.9).contains(&u) && (0.3..0.6).contains(&v);
    for shift in [0.0, 1.0, -3.0] {
        let t = on_tube(&[hole([shift - 0.1, 0.3], [shift + 0.1, 0.6])]);
        assert_keeps(&t, |u, v| !in_hole(u, v));
        // A tile of the same bounds is what the hole leaves out.
        let t = on_tube(&[rectangle([shift - 0.1, 0.3], [shift + 0.1, 0.6])]);
        assert_keeps(&t, in_hole);
        assert_eq!(t.loops().len(), 2);
    }
}

#[test]
fn loops_along_the_seam_bound_one_side_of_it() {
    for u in [0.0, 1.0] {
        let t = on_tube(&[rectangle([u, 0.3], [u + 0.2, 0.6])]);
        assert_keeps(&t, |u, v| u < 0.2 && (0.3..0.6).contains(&v));
        let (low, high) = (t.kept_on_border(Axis::U, 0.0), t.kept_on_border(Axis::U, 1.0));
        assert!(low.len() == 1 && high.is_empty(), "{low:?} {high:?}");
        // The hole ends at the seam, beyond which there is something, that ends there.
        let t = on_tube(&[hole([u, 0.3], [u + 0.2, 0.6])]);
        assert_keeps(&t, |u, v| !(u < 0.2 && (0.3..0.6).contains(&v)));
        let (low, high) = (t.kept_on_border(Axis::U, 0.0), t.kept_on_border(Axis::U, 1.0));
        assert!(low.len() == 2 && high.len() == 1 && high[0] == [0.0, 1.0], "{low:?} {high:?}");
    }
}

#[test]
fn loops_inside_a_hole_are_islands() {
    let t =
        on_tube(&[hole([-0.3, 0.2], [0.3, 0.8]), rectangle([-0.2, 0.3], [0.2, 0.7]), hole([0.05, 0.4], [0.15, 0.6])]);
    let within = |u: f64, v: f64, r: f64, h: f64| (u.min(1.0 - u)) < r && (v - 0.5).abs() < h;
    assert_keeps(&t, |u, v| {
        let in_last = (0.05..0.15).contains(&u) && (0.4..0.6).contains(&v);
        !within(u, v, 0.3, 0.3) || within(u, v, 0.2, 0.2) && !in_last
    });
}

#[test]
fn poles_close_what_winds_round_them_or_ends_in_them() {
    let ball = sphere(&Frame::WORLD, 1.0).unwrap();
    let on_ball = |loops: &[Vec<TrimCurve>]| Trims::oriented(&ball, ROUND, loops).unwrap();
    // A cap, with and without the seam and the pole in its loop.
    let cap = |_: f64, v: f64| v > 0.6;
    assert_keeps(&on_ball(&[path(&[[0.2, 0.6], [1.2, 0.6]])]), cap);
    let mut seamed = path(&[[0.0, 0.6], [1.0, 0.6], [1.0, 1.0]]);
    seamed.extend(path(&[[0.0, 1.0], [0.0, 0.6]]));
    assert_keeps(&on_ball(&[seamed]), cap);
    let mut seamed = path(&[[0.0, 0.6], [1.0, 0.6], [1.0, 1.0]]);
    seamed.extend(path(&[[1.0, 1.0], [1.0, 0.6]]));
    assert_keeps(&on_ball(&[seamed]), cap);
    // A sector between two meridians from one pole to the other, also over the seam.
    let lune = |from: f64, to: f64| {
        let mut l = path(&[[to, 0.0], [to, 1.0]]);
        l.extend(path(&[[from, 1.0], [from, 0.0]]));
        on_ball(&[l])
    };
    assert_keeps(&lune(0.2, 0.7), |u, _| 0.2 < u && u < 0.7);
    assert_keeps(&lune(0.7, 0.2), |u, _| !(0.2..0.7).contains(&u));
    assert_keeps(&lune(0.0, 0.5), |u, _| u < 0.5);
    assert_keeps(&lune(0.5, 1.0), |u, _| u > 0.5);
}

#[test]
fn a_torus_closes_in_both_directions() {
    let ring = torus(&Frame::WORLD, 2.0, 1.0).unwrap();
    let on_ring = |loops: &[Vec<TrimCurve>]| Trims::oriented(&ring, [true; 2], loops).unwrap();
    let corner = |u: f64, v: f64| !(0.2..0.9).contains(&u) && !(0.3..0.8).contains(&v);
    let t = on_ring(&[rectangle([0.9, -0.2], [1.2, 0.3])]);
    assert_keeps(&t, corner);
    assert_eq!(t.loops().len(), 4);
    assert_keeps(&on_ring(&[hole([-0.1, 0.8], [0.2, 1.3])]), |u, v| !corner(u, v));
    // Bands round either way, over the seam; and one that winds round both ways, between a loop and its neighbour.
    let band = on_ring(&[path(&[[0.3, 0.8], [1.3, 0.8]]), path(&[[0.6, 0.1], [-0.4, 0.1]])]);
    assert_keeps(&band, |_, v| !(0.1..0.8).contains(&v));
    let band = on_ring(&[path(&[[0.1, 0.6], [0.1, 1.6]]), path(&[[0.8, 0.3], [0.8, -0.7]])]);
    assert_keeps(&band, |u, _| !(0.1..0.8).contains(&u));
    let band = on_ring(&[path(&[[0.0, 0.25], [1.0, 1.25]]), path(&[[1.0, 1.65], [0.0, 0.65]])]);
    assert_keeps(&band, |u, v| (v - u - 0.25).rem_euclid(1.0) < 0.4);
}

#[test]
fn without_loops_or_with_the_whole_border_all_is_kept() {
    let whole = [
        on_tube(&[]),
        on_tube(&[rectangle([0.0, 0.0], [1.0, 1.0])]),
        on_tube(&[rectangle([3.0, 0.0], [4.0, 1.0])]),
        on_tube(&[path(&[[0.0, 0.0], [1.0, 0.0]]), path(&[[1.0, 1.0], [0.0, 1.0]])]),
        // To the seven digits of other programs.
        on_tube(&[rectangle([1e-8, -1e-8], [1.0 - 1e-8, 1.0 + 1e-8])]),
    ];
    for (k, t) in whole.iter().enumerate() {
        assert!(t.is_whole(), "{k}: {t:?}");
        assert_keeps(t, |_, _| true);
    }
    for t in [on_tube(&[hole([0.2, 0.2], [0.4, 0.4])]), on_tube(&[rectangle([0.0, 0.0], [0.5, 1.0])])] {
        assert!(!t.is_whole());
    }
}

#[test]
fn a_plane_does_not_close() {
    let square = plane(DVec3::ZERO, DVec3::X, DVec3::Y).unwrap();
    let t = Trims::oriented(&square, [false; 2], &[hole([0.2, 0.3], [0.4, 0.6])]).unwrap();
    assert_keeps(&t, |u, v| !((0.2..0.4).contains(&u) && (0.3..0.6).contains(&v)));
    // A hole that touches the border in a side.
    let t = Trims::oriented(&square, [false; 2], &[rectangle([0.0, 0.0], [1.0, 1.0]), hole([0.0, 0.3], [0.4, 0.6])]);
    assert_keeps(&t.unwrap(), |u, v| !(u < 0.4 && (0.3..0.6).contains(&v)));
    let out = Trims::oriented(&square, [false; 2], &[rectangle([0.5, 0.5], [1.5, 0.7])]);
    assert!(matches!(out, Err(TrimError::Outside { index: 0, curve: 1, .. })), "{out:?}");
    let open = Trims::oriented(&square, [false; 2], &[path(&[[0.1, 0.1], [0.9, 0.1], [0.9, 0.9]])]);
    assert!(matches!(open, Err(TrimError::Gap { index: 0, curve: 1, .. })), "{open:?}");
}

#[test]
fn loops_that_bound_no_side_are_refused() {
    // Both keep what is above them.
    let both = Trims::oriented(&tube(), ROUND, &[path(&[[0.0, 0.2], [1.0, 0.2]]), path(&[[0.0, 0.7], [1.0, 0.7]])]);
    assert!(matches!(both, Err(TrimError::Open { .. })), "{both:?}");
}

#[test]
fn pieces_know_their_edges() {
    let t = on_tube(&[hole([-0.1, 0.3], [0.1, 0.6])]);
    let mut edges: Vec<_> = t.loops().iter().flat_map(TrimLoop::pieces).filter_map(TrimPiece::edge).collect();
    edges.sort_unstable();
    // The two sides that pass the seam are in two pieces.
    assert_eq!(edges, [0, 1, 1, 2, 3, 3]);
    assert!(t.loops().iter().flat_map(TrimLoop::pieces).any(|p| p.edge().is_none()));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_tile_anywhere_on_a_torus_keeps_its_inside(u in -2.0..2.0_f64, v in -2.0..2.0_f64, w in 0.05..0.95_f64, h in 0.05..0.95_f64) {
        let ring = torus(&Frame::WORLD, 2.0, 1.0).unwrap();
        let t = Trims::oriented(&ring, [true; 2], &[rectangle([u, v], [u + w, v + h])]).unwrap();
        let rest = Trims::oriented(&ring, [true; 2], &[hole([u, v], [u + w, v + h])]).unwrap();
        for i in 0..20 {
            for j in 0..20 {
                let at = DVec2::new(f64::from(i) + 0.37, f64::from(j) + 0.41) / 20.0;
                let (x, y) = ((at.x - u).rem_euclid(1.0), (at.y - v).rem_euclid(1.0));
                let near = (x.min((x - w).abs())).min(y.min((y - h).abs())) < 1e-9;
                prop_assume!(!near);
                prop_assert_eq!(t.contains(at), x < w && y < h, "{}", at);
                prop_assert_eq!(rest.contains(at), !(x < w && y < h), "{}", at);
            }
        }
    }
}
