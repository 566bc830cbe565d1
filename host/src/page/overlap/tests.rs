use std::f64::consts::TAU;

use penvis_core::stroke::CurveKind::{Boundary, Iso};
use proptest::prelude::*;

use super::*;
use crate::drawing::length_mm;
use crate::emit::tests::polyline;

const WITHIN: f64 = 0.01;

fn line(page: &[[f64; 2]]) -> Polyline {
    polyline(Iso, 1, page)
}

fn once(lines: Vec<Polyline>) -> Vec<Polyline> {
    let found = draw_once(lines, WITHIN, false, &|| false);
    found.iter().for_each(|l| assert_eq!(l.page.len(), l.points.len()));
    found
}

fn ink(lines: &[Polyline]) -> f64 {
    lines.iter().map(|l| length_mm(&l.page)).sum()
}

/// Distance of a place from ink.
fn distance(p: DVec2, lines: &[Polyline]) -> f64 {
    let to = |w: &[DVec2]| {
        let d = w[1] - w[0];
        let t = if d == DVec2::ZERO { 0.0 } else { ((p - w[0]).dot(d) / d.length_squared()).clamp(0.0, 1.0) };
        p.distance(w[0] + d * t)
    };
    lines.iter().flat_map(|l| l.page.windows(2)).map(to).fold(f64::INFINITY, f64::min)
}

/// Largest distance of one ink from another.
fn farthest(from: &[Polyline], to: &[Polyline], samples: u32) -> f64 {
    let places = from
        .iter()
        .flat_map(|l| l.page.windows(2))
        .flat_map(|w| (0..=samples).map(move |k| w[0].lerp(w[1], f64::from(k) / f64::from(samples))));
    places.map(|p| distance(p, to)).fold(0.0, f64::max)
}

fn ring(middle: [f64; 2], radius: f64, count: u32, turns: u32) -> Vec<[f64; 2]> {
    let at = |k: u32| DVec2::from(middle) + DVec2::from_angle(TAU * f64::from(k % count) / f64::from(count)) * radius;
    (0..=count * turns).map(|k| at(k).to_array()).collect()
}

/// Draws lines once, holds the ink against theirs, and tells the length of what is left.
fn left(lines: &[&[[f64; 2]]]) -> f64 {
    let lines: Vec<Polyline> = lines.iter().map(|l| line(l)).collect();
    let found = once(lines.clone());
    assert!(farthest(&lines, &found, 9) <= WITHIN + 1e-9);
    assert!(farthest(&found, &lines, 9) <= 1e-9);
    ink(&found)
}

#[test]
fn the_same_stroke_is_drawn_once_either_way_round() {
    let (there, back) = ([[0.0, 0.0], [3.0, 4.0], [3.0, 9.0]], [[3.0, 9.0], [3.0, 4.0], [0.0, 0.0]]);
    assert_eq!(left(&[&there, &there, &back, &there]), 10.0);
    let beside = there.map(|[x, y]| [x + 0.007, y - 0.007]);
    assert_eq!(left(&[&there, &beside]), 10.0);
    let farther = there.map(|[x, y]| [x + 0.02, y]);
    assert_eq!(left(&[&there, &farther]), 20.0);
    let circle = ring([5.0, 5.0], 5.0, 60, 1);
    let mut other = circle[20..60].to_vec();
    other.extend_from_slice(&circle[..=20]);
    assert_eq!(left(&[&circle, &other]), left(&[&circle]));
    // Other vertices of the same circle: chords of a hundredth of a mm at most.
    let finer = ring([5.0, 5.0], 5.0, 160, 1);
    let coarse = ring([5.0, 5.0], 5.0, 80, 1);
    assert!(left(&[&coarse, &finer]) <= left(&[&finer]));
}

#[test]
fn parts_are_cut_at_ends_and_out_of_the_middle() {
    assert!((left(&[&[[0.0, 0.0], [50.0, 0.0]], &[[30.0, 0.0], [70.0, 0.0]]]) - 70.0).abs() <= 2.0 * WITHIN);
    // The longer one is kept whole.
    assert_eq!(left(&[&[[10.0, 0.0], [20.0, 0.0]], &[[0.0, 0.0], [50.0, 0.0]]]), 50.0);
    let with = |kind| polyline(kind, 1, &[[10.0, 0.0], [30.0, 0.0]]);
    let found = once(vec![line(&[[0.0, 0.0], [50.0, 0.0]]), with(Boundary)]);
    assert_eq!(found.iter().map(|l| l.kind).collect::<Vec<_>>(), [Iso, Iso, Boundary].map(Some));
    assert!((ink(&found) - 50.0).abs() <= 2.0 * WITHIN + 1e-9);
    // What is short is not worth a lift.
    let short = polyline(Boundary, 1, &[[10.0, 0.0], [19.0, 0.0]]);
    assert_eq!(once(vec![line(&[[0.0, 0.0], [50.0, 0.0]]), short]).len(), 2);
    // Pieces of several make up a whole.
    assert!(
        (left(&[&[[0.0, 0.0], [30.0, 0.0]], &[[30.0, 0.0], [60.0, 0.0]], &[[22.0, 0.0], [41.0, 0.0]]]) - 60.0).abs()
            < 1e-9
    );
}

#[test]
fn lines_that_cross_or_touch_stay() {
    let long = [[0.0, 0.0], [100.0, 0.0]];
    let crossing = |degrees: f64| {
        let d = DVec2::from_angle(degrees.to_radians()) * 40.0;
        [(DVec2::new(50.0, 0.0) - d).to_array(), (DVec2::new(50.0, 0.0) + d).to_array()]
    };
    for degrees in [90.0, 30.0, 5.0, 1.0, 0.3, 0.15] {
        assert!((left(&[&long, &crossing(degrees)]) - 180.0).abs() < 1e-9, "{degrees}");
        // Also where one ends on the other.
        let [a, _] = crossing(degrees);
        let least = if degrees > 1.0 { 0.0 } else { WITHIN / degrees.to_radians() + WITHIN };
        assert!(left(&[&long, &[a, [50.0, 0.0]]]) >= 140.0 - least - 1e-9, "{degrees}");
    }
    let tee: [&[[f64; 2]]; 3] = [&long, &[[50.0, 0.0], [50.0, 30.0]], &[[20.0, 30.0], [20.0, 0.005]]];
    assert!((left(&tee) - 159.995).abs() < 1e-9);
    let circles = [ring([0.0, 0.0], 20.0, 80, 1), ring([40.0, 0.0], 20.0, 80, 1)];
    assert_eq!(left(&[&circles[0], &circles[1]]), left(&[&circles[0]]) + left(&[&circles[1]]));
}

#[test]
fn strokes_are_compared_with_themselves_but_not_at_corners() {
    let corner = [[0.0, 0.0], [20.0, 0.0], [0.0, 0.1]];
    assert_eq!(left(&[&corner]), length_mm(&corner.map(DVec2::from)));
    let back = [[0.0, 0.0], [20.0, 0.0], [0.0, 0.0]];
    // It is closed, and so it has a corner at either end.
    assert!((left(&[&back]) - 20.0).abs() <= 2.0 * SELF_MM + 1e-9);
    let thrice = ring([0.0, 0.0], 10.0, 40, 3);
    let once_round = length_mm(&thrice[..41].iter().map(|p| DVec2::from(*p)).collect::<Vec<_>>());
    assert!((left(&[&thrice]) - once_round).abs() <= SELF_MM + WITHIN);
    let sharp = [[0.0, 0.0], [30.0, 1.0], [3.0, 0.0], [30.0, -1.0], [0.0, 0.0]];
    assert_eq!(left(&[&sharp]), length_mm(&sharp.map(DVec2::from)));
}

#[test]
fn a_spiral_is_not_taken_for_its_neighbours_neighbour() {
    // Each turn is within reach of the one before it, and only of that.
    let at = |k: u32| DVec2::from_angle(TAU * f64::from(k) / 40.0) * (10.0 + 0.006 * f64::from(k) / 40.0);
    let spiral: Vec<[f64; 2]> = (0..400).map(|k| at(k).to_array()).collect();
    let rest = left(&[&spiral]);
    assert!((4.9 * TAU * 10.0..7.0 * TAU * 10.0).contains(&rest), "{rest}");
}

#[test]
fn only_ink_of_the_same_pen_counts_and_visible_ink_first() {
    let page = [[0.0, 0.0], [20.0, 0.0]];
    let of = |pen: u32, visible: bool, level: u32| Polyline {
        visible,
        level,
        qi: u32::from(!visible),
        ..polyline(Iso, pen, &page)
    };
    assert_eq!(once(vec![of(1, true, 0), of(2, true, 0)]).len(), 2);
    assert_eq!(once(vec![of(1, true, 2), of(1, true, 1)])[..], [of(1, true, 1)]);
    let both = vec![of(1, false, 0), of(1, true, 0)];
    assert_eq!(draw_once(both.clone(), WITHIN, true, &|| false), [of(1, true, 0)]);
    assert_eq!(once(both.clone()), both);
    assert_eq!(draw_once(both.clone(), WITHIN, true, &|| true), both);
    for within in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(draw_once(both.clone(), within, true, &|| false), both);
    }
}

#[test]
fn chains_of_tiny_strokes_are_drawn_once_and_stay_whole() {
    let at = |k: u32| [0.3 * f64::from(k), (0.05 * f64::from(k)).sin()];
    let tiny: Vec<Polyline> = (0..300).map(|k| line(&[at(k), at(k + 1)])).collect();
    assert_eq!(once(tiny.clone()), tiny);
    let whole = line(&(0..=300).map(at).collect::<Vec<_>>());
    assert_eq!(once([tiny, vec![whole.clone()]].concat()), [whole]);
}

#[test]
fn what_is_no_place_or_a_dot_stays() {
    let lines = vec![
        line(&[[0.0, 0.0], [f64::NAN, 1.0]]),
        line(&[[0.0, 0.0], [1e300, 0.0]]),
        line(&[[2.0, 2.0], [2.0, 2.0]]),
        line(&[[0.0, 0.0], [9e5, 0.0]]),
    ];
    let found = once(lines.clone());
    assert_eq!((found.len(), &found[1..]), (4, &lines[1..]));
    assert!(found[0].page[1].is_nan());
}

#[test]
fn the_work_is_in_proportion_to_the_strokes() {
    let looks = |count: u32| {
        let mut rng = fastrand::Rng::with_seed(5);
        let side = f64::from(count).sqrt();
        let stroke = |_| {
            let at = DVec2::new(rng.f64(), rng.f64()) * side;
            let walk = (0..4).scan(at, |at, _| {
                *at += DVec2::from_angle(rng.f64() * TAU) * 0.5;
                Some(at.to_array())
            });
            line(&walk.collect::<Vec<_>>())
        };
        drawn_once((0..count).map(stroke).collect(), WITHIN, false, &|| false).1 as f64 / f64::from(count)
    };
    let (few, many) = (looks(300), looks(1500));
    assert!(many < 1.3 * few, "{many} pieces a stroke for {few}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn all_ink_stays_within_reach_and_none_is_new(
        walks in prop::collection::vec(prop::collection::vec((0_u32..6, 0_u32..6), 2..6), 1..14),
        copies in prop::collection::vec((any::<prop::sample::Index>(), 0.0..0.012, any::<bool>(), 0.0..1.0_f64, 0.0..1.0_f64), 0..10)
    ) {
        let at = |&(x, y): &(u32, u32)| [4.0 * f64::from(x), 4.0 * f64::from(y)];
        let mut lines: Vec<Polyline> = walks.iter().map(|w| line(&w.iter().map(at).collect::<Vec<_>>())).collect();
        // Parts of what is there, a little beside it and turned.
        for (of, shift, turned, a, b) in copies {
            let mut part = {
                let of = of.get(&lines);
                let length = length_mm(&of.page);
                Walk::new(of).cut(a.min(b) * length, a.max(b) * length)
            };
            part.page.iter_mut().for_each(|p| p.y += shift);
            if turned {
                part.page.reverse();
                part.points.reverse();
            }
            lines.push(part);
        }
        let found = once(lines.clone());
        prop_assert!(ink(&found) <= ink(&lines) + 1e-9);
        prop_assert!(farthest(&lines, &found, 8) <= WITHIN + 1e-9);
        prop_assert!(farthest(&found, &lines, 8) <= 1e-9);
    }
}
