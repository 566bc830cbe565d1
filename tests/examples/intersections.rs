//! Two curves intersected in three ways (Elber and Cohen 1989, table 2): by boxes along the axes alone, by strips along
//! the chords alone, and by strips with the cone test and Newton's method. Subdivisions, and time by that of the last.
//!
//!     cargo run --release -p penvis-tests --example intersections

use std::hint::black_box;
use std::time::Instant;

use glam::{DVec2, DVec4};
use penvis_core::arrange::intersect;

/// What two curves are told apart by.
#[derive(Clone, Copy)]
enum Bounds {
    Boxes,
    Strips,
}

/// Where subdivision by bounds alone ends: the size of both curves.
const RESOLUTION: f64 = 1e-6;

/// Two Bézier curves.
type Pair = (&'static str, &'static [[f64; 2]], &'static [[f64; 2]]);

fn halves(c: &[DVec2]) -> [Vec<DVec2>; 2] {
    let (mut low, mut high) = (Vec::with_capacity(c.len()), c.to_vec());
    for r in (0..c.len()).rev() {
        low.push(high[0]);
        for k in 0..r {
            high[k] = high[k].midpoint(high[k + 1]);
        }
    }
    [low, high]
}

fn box_of(c: &[DVec2]) -> [DVec2; 2] {
    c.iter().fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[lo, hi], p| [lo.min(*p), hi.max(*p)])
}

/// Whether all of `c` lies on one side of the strip round `strip`.
fn outside(strip: &[DVec2], c: &[DVec2]) -> bool {
    let normal = (strip[strip.len() - 1] - strip[0]).perp();
    let range = |c: &[DVec2]| {
        let heights = c.iter().map(|p| (*p - strip[0]).dot(normal));
        heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), h| (lo.min(h), hi.max(h)))
    };
    let ((lo, hi), (low, high)) = (range(strip), range(c));
    low > hi || high < lo
}

/// Intersects by subdivision alone; counts halvings of a curve.
fn subdivide(a: &[DVec2], b: &[DVec2], bounds: Bounds, count: &mut u64) {
    let ([alo, ahi], [blo, bhi]) = (box_of(a), box_of(b));
    let apart = match bounds {
        Bounds::Boxes => alo.cmpgt(bhi).any() || blo.cmpgt(ahi).any(),
        Bounds::Strips => outside(a, b) || outside(b, a) || alo.cmpgt(bhi).any() || blo.cmpgt(ahi).any(),
    };
    if apart {
        return;
    }
    let (sa, sb) = ((ahi - alo).length(), (bhi - blo).length());
    if sa.max(sb) <= RESOLUTION {
        return;
    }
    *count += 1;
    if sa >= sb {
        halves(a).iter().for_each(|half| subdivide(half, b, bounds, count));
    } else {
        halves(b).iter().for_each(|half| subdivide(a, half, bounds, count));
    }
}

/// Nanoseconds of one call, the median of some.
fn nanoseconds(mut call: impl FnMut()) -> f64 {
    let mut times: Vec<f64> = (0..31)
        .map(|_| {
            let started = Instant::now();
            (0..20).for_each(|_| call());
            started.elapsed().as_nanos() as f64 / 20.0
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[15]
}

fn main() {
    let pairs: [Pair; 4] = [
        ("two axes", &[[-1.0, 0.0], [1.0, 0.0]], &[[0.0, -1.0], [0.0, 1.0]]),
        (
            "two bows that cross twice",
            &[[0.0, 0.0], [1.0, 1.4], [2.0, 1.1], [3.0, 0.2]],
            &[[0.3, 1.5], [1.0, 0.1], [2.1, 0.4], [2.9, 1.3]],
        ),
        (
            "two waves that cross seven times",
            &[[0.0, 0.0], [0.05, 3.4], [0.9, -3.4], [1.0, 0.0]],
            &[[0.0, -0.45], [3.4, -0.4], [-2.4, 0.4], [1.0, 0.5]],
        ),
        (
            "an arch and a slanted bow",
            &[[0.0, 0.0], [0.2, 1.9], [1.8, 1.9], [2.0, 0.0]],
            &[[-0.2, 0.5], [0.7, 0.9], [1.4, 0.8], [2.3, 1.6]],
        ),
    ];
    println!(
        "| pair | boxes: halvings | time | strips: halvings | time | strips, cones, Newton: halvings | time | crossings |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|--:|");
    for (name, a, b) in pairs {
        let flat = |c: &[[f64; 2]]| -> Vec<DVec2> { c.iter().map(|p| DVec2::from_array(*p)).collect() };
        let (fa, fb) = (flat(a), flat(b));
        let lift = |c: &[DVec2]| -> Vec<DVec4> { c.iter().map(|p| DVec4::new(p.x, p.y, 0.0, 1.0)).collect() };
        let (la, lb) = (lift(&fa), lift(&fb));
        let full = intersect(&la, &lb, RESOLUTION).expect("cubics");
        let unit = nanoseconds(|| drop(black_box(intersect(black_box(&la), &lb, RESOLUTION))));
        let by = |bounds: Bounds| {
            let mut count = 0;
            subdivide(&fa, &fb, bounds, &mut count);
            let time = nanoseconds(|| subdivide(black_box(&fa), &fb, bounds, &mut 0));
            (count, time / unit)
        };
        let (boxes, strips) = (by(Bounds::Boxes), by(Bounds::Strips));
        println!(
            "| {name} | {} | {:.1} | {} | {:.1} | {} | 1 ({:.1} µs) | {} |",
            boxes.0,
            boxes.1,
            strips.0,
            strips.1,
            full.subdivisions,
            unit / 1e3,
            full.crossings.len()
        );
    }
}
