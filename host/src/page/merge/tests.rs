use std::collections::BTreeMap;

use glam::DVec2;
use penvis_core::stroke::CurveKind::{Crease, Iso};
use proptest::prelude::*;

use super::*;
use crate::emit::tests::polyline;

const GAP: f64 = 0.1;

fn line(page: &[[f64; 2]]) -> Polyline {
    polyline(Iso, 1, page)
}

/// Vertices of what strokes are merged to.
fn merged(lines: &[&[[f64; 2]]]) -> Vec<Vec<[f64; 2]>> {
    pages(merge(lines.iter().map(|l| line(l)).collect(), GAP, false))
}

fn pages(lines: Vec<Polyline>) -> Vec<Vec<[f64; 2]>> {
    lines.iter().for_each(|l| assert_eq!(l.page.len(), l.points.len()));
    lines.into_iter().map(|l| l.page.into_iter().map(|p| p.to_array()).collect()).collect()
}

#[test]
fn ends_that_meet_are_joined_whatever_the_direction() {
    let (a, b, c, d) = ([0.0, 0.0], [1.0, 0.0], [2.0, 1.0], [3.0, 1.0]);
    for lines in [[[a, b], [b, c], [c, d]], [[b, a], [c, b], [c, d]], [[c, b], [d, c], [b, a]]] {
        let found = merged(&[&lines[0], &lines[1], &lines[2]]);
        assert!(found == [vec![a, b, c, d]] || found == [vec![d, c, b, a]], "{found:?}");
    }
}

#[test]
fn gaps_are_closed_up_to_the_largest() {
    let found = merged(&[&[[0.0, 0.0], [1.0, 0.0]], &[[1.09, 0.0], [2.0, 0.0]], &[[2.11, 0.0], [3.0, 0.0]]]);
    assert_eq!(found, [vec![[0.0, 0.0], [1.0, 0.0], [1.09, 0.0], [2.0, 0.0]], vec![[2.11, 0.0], [3.0, 0.0]]]);
}

#[test]
fn the_pen_goes_straight_on_where_several_meet() {
    let at = |degrees: f64| (DVec2::from_angle(degrees.to_radians()) * 5.0).to_array();
    let spokes: Vec<[[f64; 2]; 2]> = [0.0, 50.0, 90.0, 180.0, 230.0, 271.0].map(|a| [[0.0, 0.0], at(a)]).to_vec();
    let found = merged(&spokes.iter().map(|s| s.as_slice()).collect::<Vec<_>>());
    assert_eq!(found.len(), 3);
    for stroke in found {
        let (a, b) = (DVec2::from(stroke[0]), DVec2::from(stroke[2]));
        assert!(a.angle_to(b).abs().to_degrees() > 178.9, "{a} to {b}");
    }
}

#[test]
fn a_hook_at_the_end_does_not_count_as_its_direction() {
    // The first stroke ends with a hook upwards that is shorter than a gap may be.
    let found = merged(&[
        &[[0.0, 0.0], [5.0, 0.0], [5.0, 0.01]],
        &[[5.0, 0.01], [9.0, 0.0]],
        &[[5.0, 0.01], [5.0, 9.0]],
        &[[5.0, 0.01], [5.0, -9.0]],
    ]);
    assert_eq!(found.iter().map(Vec::len).collect::<Vec<_>>(), [4, 3]);
}

#[test]
fn rings_are_closed_and_dots_are_not() {
    let ring = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 0.05]];
    let closed = [ring.to_vec(), vec![[0.0, 0.0]]].concat();
    assert_eq!(merged(&[&ring]), [closed]);
    let halves: [&[[f64; 2]]; 2] = [&[[0.0, 0.0], [4.0, 0.0], [4.0, 4.0]], &[[0.0, 0.0], [0.0, 4.0], [4.0, 4.0]]];
    let found = merged(&halves);
    assert_eq!((found.len(), found[0].len(), found[0].first()), (1, 5, found[0].last()));
    let dot = [[0.0, 0.0], [0.1, 0.05]];
    assert_eq!(merged(&[&dot]), [dot]);
}

#[test]
fn what_is_not_alike_only_meets() {
    let change = |change: fn(&mut Polyline)| {
        let mut lines = vec![line(&[[0.0, 0.0], [1.0, 0.0]]), line(&[[1.05, 0.0], [2.0, 0.0]])];
        change(&mut lines[1]);
        pages(merge(lines, GAP, false))
    };
    let stays = [vec![[0.0, 0.0], [1.0, 0.0]], vec![[1.05, 0.0], [2.0, 0.0]]];
    assert_eq!(change(|_| ()).len(), 1);
    assert_eq!(change(|l| l.pen = 2), stays);
    assert_eq!(change(|l| l.level = 2), stays);
    assert_eq!(change(|l| l.layer = "hidden".into()), stays);
    assert_eq!(change(|l| l.visible = false), stays);
    assert_eq!(change(|l| l.qi = 1), stays);
    assert_eq!(change(|l| l.page[1].x = f64::NAN).len(), 2);
    let meets = [vec![[0.0, 0.0], [1.0, 0.0], [1.05, 0.0]], vec![[1.05, 0.0], [2.0, 0.0]]];
    assert_eq!(change(|l| l.surface = 4), meets);
    assert_eq!(change(|l| l.kind = Some(Crease)), meets);
    assert_eq!(change(|l| l.certainty = Certainty::Tolerance), meets);
}

#[test]
fn hidden_strokes_are_joined_when_they_are_whole() {
    let lines = [[[0.0, 0.0], [1.0, 0.0]], [[1.05, 0.0], [2.0, 0.0]]];
    let hidden = lines.map(|l| Polyline { visible: false, qi: 1, ..line(&l) }).to_vec();
    assert_eq!(merge(hidden.clone(), GAP, false), hidden);
    assert_eq!(merge(hidden, GAP, true).len(), 1);
}

#[test]
fn nothing_is_joined_over_no_gap_at_all() {
    let lines = vec![line(&[[0.0, 0.0], [1.0, 0.0]]), line(&[[1.0, 0.0], [2.0, 0.0]])];
    for gap in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert_eq!(merge(lines.clone(), gap, false), lines);
    }
    assert_eq!(merge(lines, 1e-300, false).len(), 1);
}

#[test]
fn very_many_ends_in_one_place_are_joined_too() {
    let at = |k: u32| (DVec2::from_angle(f64::from(k) * 0.1) * (3.0 + 0.01 * f64::from(k))).to_array();
    let lines: Vec<_> = (0..3001).map(|k| line(&[[0.0, 0.0], at(k)])).collect();
    let found = merge(lines, GAP, false);
    let twos = found.iter().filter(|l| l.page.len() == 3).count();
    assert_eq!((twos, found.len()), (1500, 1501));
}

/// Segments with how often they are there, in either direction.
fn segments<'a>(lines: impl IntoIterator<Item = &'a Polyline>) -> BTreeMap<[u64; 4], usize> {
    let mut all = BTreeMap::new();
    for w in lines.into_iter().flat_map(|l| l.page.windows(2)) {
        let ends = [w[0].to_array(), w[1].to_array()].map(|p| p.map(f64::to_bits));
        let [a, b] = if ends[0] < ends[1] { ends } else { [ends[1], ends[0]] };
        *all.entry([a[0], a[1], b[0], b[1]]).or_insert(0) += 1;
    }
    all
}

proptest! {
    #[test]
    fn all_ink_stays_and_what_is_added_closes_gaps(
        walks in prop::collection::vec(prop::collection::vec((0_u32..12, 0_u32..12), 2..5), 1..40),
        shifts in prop::collection::vec((-0.06..0.06, -0.06..0.06), 12), unlike in 1_usize..5
    ) {
        // Strokes between places of a grid, each of which many share, some a little off.
        let at = |&(x, y): &(u32, u32), k: usize| {
            let shift = if k.is_multiple_of(3) { shifts[(k + x as usize) % 12] } else { (0.0, 0.0) };
            [f64::from(x) + shift.0, f64::from(y) + shift.1]
        };
        let mut lines: Vec<Polyline> = Vec::new();
        for (k, walk) in walks.iter().enumerate() {
            let mut walk: Vec<[f64; 2]> = walk.iter().map(|p| at(p, k)).collect();
            walk.dedup();
            if walk.len() >= 2 {
                lines.push(Polyline { surface: k % unlike, ..line(&walk) });
            }
        }
        let before = segments(&lines);
        let count = lines.len();
        let found = merge(lines, GAP, false);
        prop_assert!(found.len() <= count);
        let after = segments(&found);
        for (segment, times) in &before {
            prop_assert!(after.get(segment).is_some_and(|t| t >= times), "{:?} is gone", segment);
        }
        for (segment, times) in &after {
            let [a, b] = [[segment[0], segment[1]], [segment[2], segment[3]]].map(|p| DVec2::from(p.map(f64::from_bits)));
            prop_assert!(before.get(segment).is_some_and(|t| t >= times) || a.distance(b) <= GAP, "{} to {} is new", a, b);
        }
        // Nothing is left to be joined; but an end that was taken to another one may have come near to more.
        if unlike == 1 {
            let again = merge(found.clone(), GAP, false);
            prop_assert_eq!(again.len(), found.len());
        }
    }
}
