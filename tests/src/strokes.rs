//! Strokes to be ordered: drawings of three kinds, each made from a seed, and how far the pen travels in one.

use std::f64::consts::TAU;

use glam::DVec2;
use penvis::page::Visit;

/// Sheet in mm.
const SHEET: DVec2 = DVec2::new(280.0, 200.0);

/// Vertices of a stroke in mm.
pub type Line = Vec<DVec2>;

/// Travel between strokes in mm.
///
/// # Panics
/// If a visit is none of these strokes.
#[must_use]
pub fn travel(lines: &[Line], visits: &[Visit]) -> f64 {
    let ends = |v: &Visit| {
        let line = &lines[v.stroke as usize];
        let (first, last) = (line[0], line[line.len() - 1]);
        match v.vertex {
            _ if first == last => [line[v.vertex as usize]; 2],
            0 => [first, last],
            _ => [last, first],
        }
    };
    visits.windows(2).map(|w| ends(&w[0])[1].distance(ends(&w[1])[0])).sum()
}

/// A travel in mm that no order of these strokes is shorter than: the best of one-trees (Held and Karp, *The traveling-salesman problem and minimum
/// spanning trees*, 1970), made better until it comes near `known`, the travel in some order, or for `rounds` rounds.
///
/// The pen comes from one end of a chain of strokes to the other, and so the ways make a tree of strokes in which each end has one way but for the two at
/// which the chain begins and ends. The shortest tree is no longer, and neither is it where a price is put on the ways at an end and taken off again. Costs
/// O(n²) for each round.
#[must_use]
pub fn least_travel(lines: &[Line], known: f64, rounds: usize) -> f64 {
    let ends: Vec<DVec2> = lines.iter().flat_map(|l| l.first().zip(l.last())).flat_map(|(a, b)| [*a, *b]).collect();
    let mut prices = vec![0.0; ends.len()];
    let (mut best, mut step) = (0.0_f64, 2.0);
    for round in 0..rounds {
        let (length, mut ways) = shortest_tree(&ends, &prices);
        // The two ends of the chain are those where a way is cheapest.
        let mut cheap: Vec<usize> = (0..ends.len()).collect();
        cheap.sort_by(|&a, &b| prices[a].total_cmp(&prices[b]));
        let open = cheap.iter().take(2).map(|&e| {
            ways[e] += 1;
            prices[e]
        });
        let bound = length + open.sum::<f64>() - prices.iter().sum::<f64>();
        best = best.max(bound);
        let off: f64 = ways.iter().map(|&w| (f64::from(w) - 1.0).powi(2)).sum();
        if off == 0.0 {
            break;
        }
        if round % 50 == 49 {
            step *= 0.7;
        }
        let step = step * (known - bound).max(0.0) / off;
        prices.iter_mut().zip(&ways).for_each(|(price, &w)| *price += step * (f64::from(w) - 1.0));
    }
    best
}

/// The shortest tree of strokes given by their ends, with prices on the ways at ends, and how many ways each end has (Prim 1957).
fn shortest_tree(ends: &[DVec2], prices: &[f64]) -> (f64, Vec<u32>) {
    let strokes = ends.len() / 2;
    let mut ways = vec![0; ends.len()];
    let mut length = 0.0;
    // The shortest way to each stroke that is not in the tree: its length, and its ends here and there.
    let mut nearest = vec![(f64::INFINITY, 0, 0); strokes];
    let mut left: Vec<usize> = (1..strokes).collect();
    let mut last = 0;
    while !left.is_empty() {
        for &stroke in &left {
            for (a, b) in [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(a, b)| (2 * last + a, 2 * stroke + b)) {
                let way = ends[a].distance(ends[b]) + prices[a] + prices[b];
                if way < nearest[stroke].0 {
                    nearest[stroke] = (way, a, b);
                }
            }
        }
        let Some(at) = (0..left.len()).min_by(|&i, &j| nearest[left[i]].0.total_cmp(&nearest[left[j]].0)) else {
            break;
        };
        last = left.swap_remove(at);
        let (way, a, b) = nearest[last];
        length += way;
        ways[a] += 1;
        ways[b] += 1;
    }
    (length, ways)
}

/// Short segments anywhere.
#[must_use]
pub fn segments(count: usize) -> Vec<Line> {
    let mut rng = fastrand::Rng::with_seed(1);
    let segment = |_| {
        let at = DVec2::new(rng.f64(), rng.f64()) * SHEET;
        vec![at, at + DVec2::from_angle(rng.f64() * TAU) * (1.0 + 4.0 * rng.f64())]
    };
    (0..count).map(segment).collect()
}

/// Dashes of wobbly rings around a few places, in any order and direction.
#[must_use]
pub fn rings(count: usize) -> Vec<Line> {
    let mut rng = fastrand::Rng::with_seed(2);
    let mut lines = Vec::new();
    while lines.len() < count {
        let (middle, lobes) = (DVec2::new(rng.f64(), rng.f64()) * SHEET, f64::from(rng.u32(3..9)));
        for ring in 1..=20 {
            let radius = 1.5 * f64::from(ring);
            let at = |angle: f64| middle + DVec2::from_angle(angle) * (radius + 0.5 * (lobes * angle).sin());
            let mut angle = 0.0;
            while angle < TAU {
                let vertices = rng.u32(4..14);
                let mut line: Line = (0..vertices).map(|k| at(angle + 0.5 * f64::from(k) / radius)).collect();
                if rng.bool() {
                    line.reverse();
                }
                lines.push(line);
                angle += (0.5 * f64::from(vertices) + rng.f64()) / radius;
            }
        }
    }
    rng.shuffle(&mut lines);
    lines.truncate(count);
    lines
}

/// Hatches of disks and boxes, some broken, those of a shape together.
#[must_use]
pub fn hatches(count: usize) -> Vec<Line> {
    let mut rng = fastrand::Rng::with_seed(3);
    let mut lines = Vec::new();
    while lines.len() < count {
        let (middle, angle) = (DVec2::new(rng.f64(), rng.f64()) * SHEET, rng.f64() * TAU);
        let (along, half, is_disk) = (DVec2::from_angle(angle), 1.0 + 4.0 * rng.f64(), rng.bool());
        let mut off = -half;
        while off < half {
            let reach = if is_disk { (half * half - off * off).sqrt() } else { half };
            let at = |share: f64| middle + along.perp() * off + along * (share * reach);
            if rng.u32(0..3) == 0 {
                let gap = rng.f64() - 0.5;
                lines.extend([vec![at(-1.0), at(gap - 0.1)], vec![at(gap + 0.1), at(1.0)]]);
            } else {
                lines.push(vec![at(-1.0), at(1.0)]);
            }
            off += 0.3;
        }
    }
    lines.truncate(count);
    lines
}
