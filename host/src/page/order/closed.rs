//! Where the pen begins with closed strokes, once their order is known.

use glam::DVec2;

use super::cost::Measure;
use super::ends::Rest;
use super::stroke::{Stroke, Visit};

/// Most vertices of a stroke that are held against those of its neighbours.
const CANDIDATES: usize = 32;

/// Most times that all vertices are looked at afterwards.
const SWEEPS: usize = 4;

/// Begins closed strokes where the ways to and from them cost least: for each run of them the best of up to [`CANDIDATES`] vertices each by
/// dynamic programming, then each by itself the best of all its vertices. Costs become no larger.
///
/// Cost: [`CANDIDATES`]² for a closed stroke beside another one, and linear in the vertices.
pub(super) fn choose(strokes: &[Stroke<'_>], visits: &mut [Visit], rest: Rest, measure: Measure) {
    let mut first = 0;
    while first < visits.len() {
        let is_closed = |v: &Visit| strokes[v.stroke as usize].is_closed();
        let count = visits[first..].iter().take_while(|v| is_closed(v)).count();
        let before = if first == 0 { rest.before } else { end(strokes, visits, first - 1) };
        let after = if first + count == visits.len() { rest.after } else { begin(strokes, visits, first + count) };
        choose_run(strokes, &mut visits[first..first + count], before, after, measure);
        first += count + 1;
    }
    for _ in 0..SWEEPS {
        let mut changed = false;
        for k in 0..visits.len() {
            let stroke = &strokes[visits[k].stroke as usize];
            if !stroke.is_closed() {
                continue;
            }
            let before = if k == 0 { rest.before } else { end(strokes, visits, k - 1) };
            let after = if k + 1 == visits.len() { rest.after } else { begin(strokes, visits, k + 1) };
            let cost = |at: DVec2| {
                let way = |other: Option<DVec2>| other.map_or(0.0, |other| measure.of(other - at));
                way(before) + way(after)
            };
            let mut best = cost(stroke.begin(visits[k]));
            for start in 0..stroke.starts() {
                let found = cost(stroke.start(start));
                if found < best {
                    best = found;
                    visits[k] = stroke.visit(visits[k].stroke, start);
                    changed = true;
                }
            }
        }
        if !changed {
            break;
        }
    }
}

fn begin(strokes: &[Stroke<'_>], visits: &[Visit], k: usize) -> Option<DVec2> {
    visits.get(k).map(|&v| strokes[v.stroke as usize].begin(v))
}

fn end(strokes: &[Stroke<'_>], visits: &[Visit], k: usize) -> Option<DVec2> {
    visits.get(k).map(|&v| strokes[v.stroke as usize].end(v))
}

/// A candidate of a stroke.
struct Step {
    visit: Visit,
    /// Its place.
    at: Option<DVec2>,
    /// The least cost up to it.
    cost: f64,
    /// With which candidate of the stroke before.
    from: usize,
}

/// The best of the candidates of a run of closed strokes.
fn choose_run(
    strokes: &[Stroke<'_>],
    run: &mut [Visit],
    before: Option<DVec2>,
    after: Option<DVec2>,
    measure: Measure,
) {
    let way = |a: Option<DVec2>, b: Option<DVec2>| a.zip(b).map_or(0.0, |(a, b)| measure.of(b - a));
    let mut steps: Vec<Vec<Step>> = Vec::with_capacity(run.len());
    for &visit in &*run {
        let stroke = &strokes[visit.stroke as usize];
        let candidates = candidates(stroke, visit);
        let step = candidates.map(|candidate| {
            let at = Some(stroke.begin(candidate));
            let (cost, from) = match steps.last() {
                None => (way(before, at), 0),
                Some(last) => last
                    .iter()
                    .enumerate()
                    .map(|(from, step)| (step.cost + way(step.at, at), from))
                    .min_by(|a, b| a.0.total_cmp(&b.0))
                    .unwrap_or((0.0, 0)),
            };
            Step { visit: candidate, at, cost, from }
        });
        let step = step.collect();
        steps.push(step);
    }
    let Some(last) = steps.last() else { return };
    let ends = last.iter().enumerate().map(|(k, step)| (step.cost + way(step.at, after), k));
    let mut k = ends.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0, |e| e.1);
    for (visit, step) in run.iter_mut().zip(&steps).rev() {
        (*visit, k) = (step[k].visit, step[k].from);
    }
}

/// Vertices all around a closed stroke, the one that it begins with first.
fn candidates(stroke: &Stroke<'_>, visit: Visit) -> impl Iterator<Item = Visit> {
    let starts = stroke.starts();
    let count = starts.min(CANDIDATES);
    (0..count).map(move |k| Visit { vertex: ((visit.vertex as usize + k * starts / count) % starts) as u32, ..visit })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::super::stroke::total;
    use super::*;

    fn ring((x, y, r): (f64, f64, f64), count: u32) -> Vec<DVec2> {
        let angle = |k: u32| std::f64::consts::TAU * f64::from(k % count) / f64::from(count);
        (0..=count).map(|k| DVec2::new(x, y) + r * DVec2::from_angle(angle(k))).collect()
    }

    proptest! {
        #[test]
        fn runs_of_closed_strokes_begin_where_it_is_best(
            rings in prop::collection::vec((0.0..50.0, 0.0..50.0, 1.0..20.0), 1..4), free in any::<bool>()
        ) {
            let lines: Vec<_> = rings.into_iter().map(|r| ring(r, 7)).collect();
            let strokes: Vec<_> = lines.iter().map(|l| Stroke::new(l)).collect();
            let rest = Rest { before: Some(DVec2::ZERO), after: (!free).then_some(DVec2::new(60.0, 0.0)) };
            let visit = |k: usize, vertex| Visit { stroke: k as u32, vertex };
            let mut visits: Vec<_> = (0..strokes.len()).map(|k| visit(k, 3)).collect();
            choose(&strokes, &mut visits, rest, Measure::Distance);
            let found: f64 = total(&strokes, &visits, rest, DVec2::distance);
            let mut least = f64::INFINITY;
            for pick in 0..7_u32.pow(strokes.len() as u32) {
                let all: Vec<_> = (0..strokes.len()).map(|k| visit(k, pick / 7_u32.pow(k as u32) % 7)).collect();
                least = least.min(total(&strokes, &all, rest, DVec2::distance));
            }
            prop_assert!((found - least).abs() < 1e-9, "{} for {}", found, least);
        }

        #[test]
        fn it_never_becomes_longer(
            rings in prop::collection::vec((0.0..50.0, 0.0..50.0, 1.0..20.0), 1..6), vertex in 0_u32..100
        ) {
            let mut lines: Vec<_> = rings.into_iter().map(|r| ring(r, 100)).collect();
            lines.insert(lines.len() / 2, vec![DVec2::new(9.0, 9.0), DVec2::new(1.0, 2.0)]);
            let strokes: Vec<_> = lines.iter().map(|l| Stroke::new(l)).collect();
            let pick = |s: &Stroke<'_>| if s.is_closed() { vertex } else { 0 };
            let mut visits: Vec<_> =
                strokes.iter().enumerate().map(|(k, s)| Visit { stroke: k as u32, vertex: pick(s) }).collect();
            let before = total(&strokes, &visits, Rest::default(), DVec2::distance);
            choose(&strokes, &mut visits, Rest::default(), Measure::Distance);
            prop_assert!(total(&strokes, &visits, Rest::default(), DVec2::distance) <= before + 1e-9);
        }
    }
}
