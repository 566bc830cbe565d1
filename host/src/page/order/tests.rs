use glam::DVec2;
use penvis_core::stroke::CurveKind;
use proptest::prelude::*;

use super::stroke::{Stroke, total};
use super::*;
use crate::emit::tests::polyline;

const NO_SEARCH: Effort = Effort { measure: Measure::Distance, seconds: 0.0, seed: 0 };

fn line(a: DVec2, b: DVec2, pen: u32) -> Polyline {
    polyline(CurveKind::Iso, pen, &[a.into(), b.into()])
}

fn ordered(lines: Vec<Polyline>) -> Vec<Polyline> {
    order(lines, &Effort::default(), &|| false)
}

/// Length of all ways of a route.
fn length(lines: &[&[DVec2]], visits: &[Visit], rest: Rest) -> f64 {
    let strokes: Vec<_> = lines.iter().map(|l| Stroke::new(l)).collect();
    total(&strokes, visits, rest, DVec2::distance)
}

#[test]
fn polylines_are_turned_and_pens_kept_together() {
    let p = |x: f64| DVec2::new(x, 1.0);
    let found = ordered(vec![line(p(9.0), p(5.0), 1), line(p(1.0), p(2.0), 2), line(p(4.0), p(0.0), 1)]);
    let starts: Vec<_> = found.iter().map(|l| (l.pen, l.page[0].x)).collect();
    assert_eq!(starts, [(1, 0.0), (1, 5.0), (2, 2.0)]);
    assert!(ordered(Vec::new()).is_empty());
}

#[test]
fn levels_are_drawn_one_after_the_other_with_each_pen() {
    let p = |x: f64| DVec2::new(x, 1.0);
    let mut lines: Vec<_> = (0..6).map(|k| line(p(f64::from(k)), p(f64::from(k) + 0.5), 1 + k as u32 % 2)).collect();
    for (k, l) in lines.iter_mut().enumerate() {
        l.level = 2 - k as u32 / 2;
    }
    let turns: Vec<_> = ordered(lines).iter().map(|l| (l.pen, l.level)).collect();
    assert_eq!(turns, [(1, 0), (1, 1), (1, 2), (2, 0), (2, 1), (2, 2)]);
}

#[test]
fn ends_on_a_line_or_in_a_point_or_nowhere_are_ordered_too() {
    for scale in [0.0, 1e-300, 1.0, 1e300, f64::INFINITY] {
        let lines: Vec<_> =
            (0..50).map(|k| line(DVec2::new(f64::from(k * 7 % 50), 0.0) * scale, DVec2::ZERO, 1)).collect();
        assert_eq!(ordered(lines).len(), 50);
    }
}

#[test]
fn a_closed_stroke_begins_where_the_pen_comes_by() {
    let square = [[10.0, 10.0], [10.0, 0.0], [0.0, 0.0], [0.0, 10.0], [10.0, 10.0]];
    let mut square = polyline(CurveKind::Boundary, 1, &square);
    for (k, point) in square.points.iter_mut().enumerate() {
        point.z = (k % 4) as f64;
    }
    let found = ordered(vec![square]);
    assert_eq!(
        found[0].page.iter().map(|p| (p.x, p.y)).collect::<Vec<_>>(),
        [(0.0, 0.0), (0.0, 10.0), (10.0, 10.0), (10.0, 0.0), (0.0, 0.0)]
    );
    assert_eq!(found[0].points.iter().map(|p| p.z).collect::<Vec<_>>(), [2.0, 3.0, 0.0, 1.0, 2.0]);
}

#[test]
fn equally_long_routes_stay_as_they_are_given() {
    // A line and dashes on it: the line may come first or last.
    let line = vec![DVec2::new(10.0, 10.0), DVec2::new(110.0, 10.0)];
    let dash = |k: u32| [0.0, 2.04].map(|x| DVec2::new(10.0 + 3.2653 * f64::from(k) + x, 10.0)).to_vec();
    let mut lines = vec![line];
    lines.extend((0..30).rev().map(dash));
    lines.iter_mut().skip(1).for_each(|dash| dash.reverse());
    let lines: Vec<&[DVec2]> = lines.iter().map(Vec::as_slice).collect();
    let rest = Rest { before: Some(DVec2::ZERO), after: None };
    let visits = route(&lines, rest, &Effort::default(), &|| false);
    assert_eq!(visits.iter().map(|v| v.stroke).collect::<Vec<_>>(), (0..31).collect::<Vec<_>>());
}

#[test]
fn small_routes_are_the_shortest() {
    let mut rng = fastrand::Rng::with_seed(3);
    let mut point = || DVec2::new(rng.f64(), rng.f64()) * 100.0;
    for _ in 0..20 {
        let lines: Vec<[DVec2; 2]> = (0..5).map(|_| [point(), point()]).collect();
        let lines: Vec<&[DVec2]> = lines.iter().map(|l| l.as_slice()).collect();
        for rest in [Rest::default(), Rest { before: Some(DVec2::ZERO), after: Some(DVec2::X * 90.0) }] {
            let mut least = f64::INFINITY;
            every_route(&mut vec![], &mut |visits| least = least.min(length(&lines, visits, rest)));
            let found = length(&lines, &route(&lines, rest, &Effort::default(), &|| false), rest);
            assert!((found - least).abs() < 1e-9, "{found} for {least}");
        }
    }
}

/// All orders and directions of five lines.
fn every_route(visits: &mut Vec<Visit>, try_it: &mut dyn FnMut(&[Visit])) {
    if visits.len() == 5 {
        return try_it(visits);
    }
    for stroke in (0..5).filter(|k| visits.iter().all(|v| v.stroke != *k)).collect::<Vec<_>>() {
        for vertex in 0..2 {
            visits.push(Visit { stroke, vertex });
            every_route(visits, try_it);
            visits.pop();
        }
    }
}

#[test]
fn ways_of_no_length_are_preferred_by_time() {
    // By length the middle line is best drawn on the way; by time it is better to lift once less.
    let p = |x: f64, y: f64| DVec2::new(x, y);
    let lines: [&[DVec2]; 3] =
        [&[p(0.0, 0.0), p(10.0, 0.0)], &[p(10.5, 0.4), p(10.5, 5.0)], &[p(10.0, 0.0), p(10.0, 5.0)]];
    let gaps = |measure: Measure| {
        let visits = route(&lines, Rest::default(), &Effort { measure, ..Effort::default() }, &|| false);
        let strokes: Vec<_> = lines.iter().map(|l| Stroke::new(l)).collect();
        let ends = |w: &[Visit]| (strokes[w[0].stroke as usize].end(w[0]), strokes[w[1].stroke as usize].begin(w[1]));
        visits.windows(2).filter(|w| ends(w).0 != ends(w).1).count()
    };
    assert_eq!(gaps(Measure::Time { lift_s: 0.5, speed: 100.0, acceleration: 1000.0, of_axes: false }), 1);
}

#[test]
fn a_search_that_is_stopped_gives_what_it_has() {
    let mut rng = fastrand::Rng::with_seed(1);
    let mut point = || DVec2::new(rng.f64(), rng.f64()) * 100.0;
    let lines: Vec<[DVec2; 2]> = (0..200).map(|_| [point(), point()]).collect();
    let lines: Vec<&[DVec2]> = lines.iter().map(|l| l.as_slice()).collect();
    let effort = Effort { seconds: 1e9, ..Effort::default() };
    let first = route(&lines, Rest::default(), &NO_SEARCH, &|| false);
    assert_eq!(route(&lines, Rest::default(), &effort, &|| true), first);
}

fn lines() -> impl Strategy<Value = Vec<Vec<DVec2>>> {
    let point = (0.0..300.0, 0.0..200.0).prop_map(DVec2::from);
    let line = (prop::collection::vec(point, 2..6), any::<bool>()).prop_map(|(mut line, close)| {
        line.extend(close.then_some(line[0]));
        line
    });
    prop::collection::vec(line, 0..30)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn a_route_visits_all_is_never_longer_and_is_always_the_same(
        lines in lines(), before in any::<bool>(), after in any::<bool>(), seed in 0_u64..9
    ) {
        let lines: Vec<&[DVec2]> = lines.iter().map(Vec::as_slice).collect();
        let rest = Rest { before: before.then_some(DVec2::ZERO), after: after.then_some(DVec2::X * 50.0) };
        let effort = Effort { seed, seconds: 0.2, ..Effort::default() };
        let visits = route(&lines, rest, &effort, &|| false);
        let mut seen: Vec<u32> = visits.iter().map(|v| v.stroke).collect();
        seen.sort_unstable();
        prop_assert_eq!(seen, (0..lines.len() as u32).collect::<Vec<_>>());
        let given: Vec<Visit> = (0..lines.len() as u32).map(|stroke| Visit { stroke, vertex: 0 }).collect();
        let first = route(&lines, rest, &NO_SEARCH, &|| false);
        prop_assert!(length(&lines, &first, rest) <= length(&lines, &given, rest) + 1e-9);
        prop_assert!(length(&lines, &visits, rest) <= length(&lines, &first, rest) + 1e-9);
        prop_assert_eq!(&route(&lines, rest, &effort, &|| false), &visits);
        // What is found is not made longer when it is given again.
        let again: Vec<Vec<DVec2>> = visits
            .iter()
            .map(|v| {
                let mut page = lines[v.stroke as usize].to_vec();
                if page.len() > 2 && page.first() == page.last() {
                    rotate(&mut page, v.vertex as usize);
                } else if v.vertex > 0 {
                    page.reverse();
                }
                page
            })
            .collect();
        let again: Vec<&[DVec2]> = again.iter().map(Vec::as_slice).collect();
        prop_assert!((length(&again, &given, rest) - length(&lines, &visits, rest)).abs() < 1e-9);
        let kept = route(&again, rest, &NO_SEARCH, &|| false);
        prop_assert!(length(&again, &kept, rest) <= length(&again, &given, rest) + 1e-9);
    }
}
