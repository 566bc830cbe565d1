//! How good the order of strokes is, against what no order can beat.

use glam::DVec2;
use penvis::page::{Effort, Measure, Rest, route};
use penvis_tests::strokes::{Line, hatches, least_travel, rings, segments, travel};

fn check(name: &str, lines: &[Line], percent: f64) {
    let pages: Vec<&[DVec2]> = lines.iter().map(Vec::as_slice).collect();
    let with = |seconds: f64| {
        let effort = Effort { measure: Measure::Distance, seconds, seed: 1 };
        travel(lines, &route(&pages, Rest::default(), &effort, &|| false))
    };
    let (first, found) = (with(0.0), with(1.0));
    let least = least_travel(lines, found, 400);
    let above = (found / least - 1.0) * 100.0;
    println!("{name}: {found:.1} mm, at least {least:.1}, {above:.2} % above; {first:.1} without a search");
    assert!(least > 0.0 && found >= least - 1e-9, "{name}: {found} mm for at least {least}");
    assert!(above <= percent, "{name}: {above:.2} % above what no order can beat");
    assert!(found < first, "{name}: the search has found nothing");
}

/// Part of each margin is that of the bound, which is below the best order.
#[test]
fn orders_are_near_to_the_best_there_are() {
    check("segments", &segments(60), 2.5);
    check("rings", &rings(60), 4.0);
    check("hatches", &hatches(60), 7.0);
}
