use alloc::vec;
use alloc::vec::Vec;
use core::f64::consts::PI;

use glam::{DMat4, DVec2, DVec3};
use proptest::prelude::*;

use super::*;
use crate::line::Axis;
use crate::nurbs::{Curve, Surface};
use crate::shape::{Frame, circle, line, plane, polyline};

/// A plane over [0, 1]².
fn unit() -> Surface {
    plane(DVec3::ZERO, DVec3::X, DVec3::Y).unwrap()
}

fn round(x: f64, y: f64, radius: f64) -> Vec<Curve> {
    let there = DMat4::from_translation(DVec3::new(x, y, 0.0));
    vec![circle(&Frame::WORLD, radius).unwrap().transformed(there).unwrap()]
}

/// A closed polygon, one curve.
fn polygon(corners: &[[f64; 2]]) -> Vec<Curve> {
    let points: Vec<DVec3> = corners.iter().chain(&corners[..1]).map(|c| DVec3::new(c[0], c[1], 0.0)).collect();
    vec![polyline(&points).unwrap()]
}

fn square(lo: f64, hi: f64) -> Vec<Curve> {
    polygon(&[[lo, lo], [hi, lo], [hi, hi], [lo, hi]])
}

fn trims(loops: &[Vec<Curve>]) -> Trims {
    Trims::new(&unit(), loops).unwrap()
}

fn grid() -> impl Iterator<Item = DVec2> {
    // Off every line of symmetry, so that no place lies on a curve of these tests.
    (0..40).flat_map(|i| (0..40).map(move |j| DVec2::new(f64::from(i) + 0.37, f64::from(j) + 0.41) / 40.0))
}

fn close(found: &[[f64; 2]], expected: &[[f64; 2]]) -> bool {
    let near = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12;
    found.len() == expected.len() && found.iter().zip(expected).all(near)
}

#[test]
fn a_circle_holds_what_is_within_its_radius() {
    let middle = DVec2::new(0.5, 0.5);
    let t = trims(&[round(0.5, 0.5, 0.3)]);
    for at in grid() {
        assert_eq!(t.contains(at), at.distance(middle) < 0.3, "{at}");
    }
    // To rounding of the border, in all directions.
    for k in 0..64 {
        let angle = 0.01 + f64::from(k) * PI / 32.0;
        let d = DVec2::new(libm::cos(angle), libm::sin(angle));
        assert!(t.contains(middle + d * (0.3 - 1e-13)) && !t.contains(middle + d * (0.3 + 1e-13)), "{angle}");
    }
    let (lo, hi) = t.bounds();
    assert!((lo - DVec2::splat(0.2)).length() < 1e-15 && (hi - DVec2::splat(0.8)).length() < 1e-15);
}

#[test]
fn nested_circles_alternate() {
    let t = trims(&[round(0.5, 0.5, 0.4), round(0.5, 0.5, 0.25), round(0.5, 0.5, 0.1)]);
    for at in grid() {
        let r = at.distance(DVec2::splat(0.5));
        assert_eq!(t.contains(at), (0.25..0.4).contains(&r) || r < 0.1, "{at}");
    }
    for axis in [Axis::U, Axis::V] {
        let kept = t.kept_on_line(axis, 0.5, [0.0, 1.0]);
        assert!(close(&kept, &[[0.1, 0.25], [0.4, 0.6], [0.75, 0.9]]), "{kept:?}");
        let half = libm::sqrt(0.4 * 0.4 - 0.3 * 0.3);
        let kept = t.kept_on_line(axis, 0.8, [0.0, 0.5]);
        assert!(close(&kept, &[[0.5 - half, 0.5]]), "{kept:?}");
    }
}

#[test]
fn a_tangent_line_is_not_kept_and_keeps_what_touches_a_hole() {
    let t = trims(&[square(0.0, 1.0), round(0.5, 0.5, 0.25)]);
    for axis in [Axis::U, Axis::V] {
        for value in [0.25, 0.75] {
            assert!(close(&t.kept_on_line(axis, value, [0.0, 1.0]), &[[0.0, 1.0]]));
            let disc = trims(&[round(0.5, 0.5, 0.25)]);
            assert!(disc.kept_on_line(axis, value, [0.0, 1.0]).is_empty());
        }
        let half = |d: f64| libm::sqrt(0.25 * 0.25 - d * d);
        let kept = t.kept_on_line(axis, 0.25 + 1e-6, [0.0, 1.0]);
        let h = half(0.25 - 1e-6);
        assert_eq!(kept.len(), 2, "{kept:?}");
        assert!((kept[0][1] - 0.5 + h).abs() < 1e-9 && (kept[1][0] - 0.5 - h).abs() < 1e-9, "{kept:?}");
    }
}

#[test]
fn lines_along_a_square_are_its_own_and_lines_through_corners_are_cut_once() {
    let t = trims(&[square(0.25, 0.75)]);
    for axis in [Axis::U, Axis::V] {
        assert!(t.kept_on_line(axis, 0.25, [0.0, 1.0]).is_empty());
        assert!(t.kept_on_line(axis, 0.75, [0.0, 1.0]).is_empty());
        assert!(close(&t.kept_on_line(axis, 0.4, [0.0, 1.0]), &[[0.25, 0.75]]));
    }
    let diamond = trims(&[polygon(&[[0.5, 0.0], [1.0, 0.5], [0.5, 1.0], [0.0, 0.5]])]);
    for axis in [Axis::U, Axis::V] {
        assert!(close(&diamond.kept_on_line(axis, 0.5, [0.0, 1.0]), &[[0.0, 1.0]]));
        assert!(diamond.kept_on_line(axis, 0.0, [0.0, 1.0]).is_empty());
    }
    // A square notch: the line along its bottom is the surface's own on either side of it.
    let notch =
        polygon(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.7, 1.0], [0.7, 0.5], [0.3, 0.5], [0.3, 1.0], [0.0, 1.0]]);
    let kept = trims(&[notch]).kept_on_line(Axis::V, 0.5, [0.0, 1.0]);
    assert!(close(&kept, &[[0.0, 0.3], [0.7, 1.0]]), "{kept:?}");
}

#[test]
fn trims_along_the_whole_range_keep_everything_and_its_borders() {
    for direction in [square(0.0, 1.0), square(0.0, 1.0).iter().map(Curve::reversed).collect()] {
        let t = trims(&[direction]);
        assert!(grid().all(|at| t.contains(at)));
        assert_eq!(t.cover(DVec2::ZERO, DVec2::ONE), Cover::Inside);
        for axis in [Axis::U, Axis::V] {
            assert!(close(&t.kept_on_line(axis, 0.3, [0.0, 1.0]), &[[0.0, 1.0]]));
            for value in [0.0, 1.0] {
                assert_eq!(t.kept_on_border(axis, value), [[0.0, 1.0]]);
            }
        }
    }
}

#[test]
fn a_loop_that_touches_the_border_keeps_of_it_what_runs_along_it() {
    let t = trims(&[polygon(&[[0.0, 0.2], [0.5, 0.0], [0.5, 0.6], [0.0, 0.7]]), round(0.8, 0.5, 0.2)]);
    assert_eq!(t.kept_on_border(Axis::U, 0.0), [[0.2, 0.7]]);
    // The circle and the corner touch it in a point.
    assert!(t.kept_on_border(Axis::U, 1.0).is_empty() && t.kept_on_border(Axis::V, 0.0).is_empty());
    assert!(close(&t.kept_on_line(Axis::V, 0.5, [0.0, 1.0]), &[[0.0, 0.5], [0.6, 1.0]]));
}

#[test]
fn a_tiny_hole_is_a_hole() {
    for radius in [1e-3, 1e-6, 1e-9] {
        let t = trims(&[square(0.0, 1.0), round(0.371, 0.613, radius)]);
        let middle = DVec2::new(0.371, 0.613);
        assert!(!t.contains(middle) && t.contains(middle + DVec2::new(2.0 * radius, 0.0)));
        assert_eq!(t.cover(DVec2::splat(0.1), DVec2::splat(0.9)), Cover::Mixed);
        assert_eq!(t.cover(DVec2::splat(0.1), DVec2::splat(0.3)), Cover::Inside);
        let kept = t.kept_on_line(Axis::U, 0.371, [0.0, 1.0]);
        assert!(close(&kept, &[[0.0, 0.613 - radius], [0.613 + radius, 1.0]]), "{kept:?}");
    }
}

#[test]
fn a_rectangle_is_mixed_only_where_a_curve_enters_it() {
    let t = trims(&[round(0.5, 0.5, 0.25)]);
    let at = |x: f64, y: f64, h: f64| t.cover(DVec2::new(x - h, y - h), DVec2::new(x + h, y + h));
    assert_eq!(at(0.5, 0.5, 0.17), Cover::Inside);
    assert_eq!(at(0.5, 0.5, 0.18), Cover::Mixed);
    // In the corner of the circle's box, but not in the circle.
    assert_eq!(at(0.72, 0.72, 0.02), Cover::Outside);
    assert_eq!(at(0.1, 0.5, 0.05), Cover::Outside);
    // It holds the whole circle.
    assert_eq!(at(0.5, 0.5, 0.5), Cover::Mixed);
}

#[test]
fn every_piece_knows_its_kept_side() {
    for backwards in [false, true] {
        let turn = |curves: Vec<Curve>| -> Vec<Curve> {
            if backwards { curves.iter().rev().map(Curve::reversed).collect() } else { curves }
        };
        let t = trims(&[turn(square(0.1, 0.9)), turn(round(0.5, 0.5, 0.25))]);
        for (k, l) in t.loops().iter().enumerate() {
            for p in l.pieces() {
                let outer = k == 0;
                assert_eq!(p.keeps_left(), Some(outer != backwards));
                let (at, d) = p.jet(0.5);
                let left = at + d.perp().normalize() * 1e-6;
                assert_eq!(Some(t.contains(left)), p.keeps_left());
            }
        }
    }
    // Two loops along each other cancel where they do.
    let t = trims(&[square(0.0, 0.5), polygon(&[[0.5, 0.0], [1.0, 0.0], [1.0, 0.5], [0.5, 0.5]])]);
    let seam = |p: &TrimPiece| p.from().x == 0.5 && p.to().x == 0.5;
    let sides = t.loops().iter().flat_map(TrimLoop::pieces).map(|p| (seam(p), p.keeps_left()));
    assert!(sides.clone().all(|(seam, left)| seam == left.is_none()));
}

#[test]
fn curves_are_cut_at_knot_lines_and_stay_the_same() {
    let whole = trims(&[round(0.5, 0.5, 0.4)]);
    let t = whole.cut_at(&[0.0, 0.2, 0.5, 0.55, 1.0], &[0.0, 0.3, 1.0]);
    assert_eq!(t.loops()[0].pieces().len(), 4 + 4 + 2);
    for w in t.loops()[0].pieces().windows(2) {
        assert_eq!(w[0].to(), w[1].from());
    }
    for p in t.loops()[0].pieces() {
        for s in [0.0, 0.3, 0.8, 1.0] {
            assert!((p.eval(s).distance(DVec2::splat(0.5)) - 0.4).abs() < 1e-14);
        }
    }
    assert!(grid().all(|at| t.contains(at) == whole.contains(at)));
}

#[test]
fn what_is_wrong_is_named() {
    let segment = |a: [f64; 2], b: [f64; 2]| line(DVec3::new(a[0], a[1], 0.0), DVec3::new(b[0], b[1], 0.0)).unwrap();
    let message = |loops: &[Vec<Curve>]| alloc::format!("{}", Trims::new(&unit(), loops).unwrap_err());
    assert!(message(&[]).contains("no trim loop"));
    assert!(message(&[square(0.1, 0.9), vec![]]).starts_with("trim loop 1 has no extent"));
    let open = vec![segment([0.1, 0.1], [0.9, 0.1]), segment([0.9, 0.1], [0.5, 0.8])];
    let found = message(core::slice::from_ref(&open));
    assert!(
        found.starts_with("trim loop 0: curve 1 ends at (0.5, 0.8), but the next one begins at (0.1, 0.1)"),
        "{found}"
    );
    let found = message(&[round(0.5, 0.5, 0.2), round(0.9, 0.5, 0.2)]);
    assert!(found.contains("loop 1: curve 0 reaches (1.1, 0.5), outside"), "{found}");
    // What is off by rounding is put right.
    let off = polygon(&[[-1e-9, 0.0], [1.0 + 1e-9, 1e-14], [1.0, 1.0], [0.0, 1.0]]);
    let t = trims(&[off]);
    assert_eq!((t.bounds(), t.kept_on_border(Axis::V, 0.0)), ((DVec2::ZERO, DVec2::ONE), vec![[0.0, 1.0]]));
}

proptest! {
    /// Discs, each cut out of or added to what the others leave.
    #[test]
    fn circles_anywhere_follow_the_even_odd_rule(
        discs in prop::collection::vec((0.2..0.8_f64, 0.2..0.8_f64, 1e-3..0.2_f64), 1..6),
        places in prop::collection::vec((0.0..1.0_f64, 0.0..1.0_f64), 20),
    ) {
        let loops: Vec<Vec<Curve>> = discs.iter().map(|&(x, y, r)| round(x, y, r)).collect();
        let t = trims(&loops);
        let count = |at: DVec2| discs.iter().filter(|d| at.distance(DVec2::new(d.0, d.1)) < d.2).count();
        for &(x, y) in &places {
            let at = DVec2::new(x, y);
            let clear = discs.iter().all(|d| (at.distance(DVec2::new(d.0, d.1)) - d.2).abs() > 1e-12);
            prop_assert!(!clear || t.contains(at) == (count(at) % 2 == 1), "{at}");
            for (axis, value) in [(Axis::U, x), (Axis::V, y)] {
                let kept = t.kept_on_line(axis, value, [0.0, 1.0]);
                for k in 0..50 {
                    let m = (f64::from(k) + 0.5) / 50.0;
                    let at = if axis == Axis::U { DVec2::new(value, m) } else { DVec2::new(m, value) };
                    let clear = discs.iter().all(|d| (at.distance(DVec2::new(d.0, d.1)) - d.2).abs() > 1e-9);
                    let inside = kept.iter().any(|i| i[0] < m && m < i[1]);
                    prop_assert!(!clear || inside == (count(at) % 2 == 1), "{axis:?} {value} {m}: {kept:?}");
                }
            }
        }
    }

    /// A rectangle that is not mixed is of one kind all over.
    #[test]
    fn rectangles_of_one_kind_are(
        corners in prop::collection::vec((0.05..0.95_f64, 0.05..0.95_f64), 3..8),
        (x, y, w, h) in (0.0..0.9_f64, 0.0..0.9_f64, 0.001..0.3_f64, 0.001..0.3_f64),
    ) {
        let corners: Vec<[f64; 2]> = corners.iter().map(|c| [c.0, c.1]).collect();
        let t = trims(&[polygon(&corners)]);
        let (lo, size) = (DVec2::new(x, y), DVec2::new(w, h));
        let cover = t.cover(lo, lo + size);
        let places = (0..100).map(|k| lo + size * DVec2::new(f64::from(k % 10) + 0.5, f64::from(k / 10) + 0.5) / 10.0);
        let inside: Vec<bool> = places.filter(|p| p.max_element() < 1.0).map(|p| t.contains(p)).collect();
        match cover {
            Cover::Inside => prop_assert!(inside.iter().all(|&k| k)),
            Cover::Outside => prop_assert!(inside.iter().all(|&k| !k)),
            Cover::Mixed => {}
        }
    }
}
