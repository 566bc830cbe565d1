//! A route through strokes: in which order, in which direction, and from which vertex on.

use glam::DVec2;

use super::closed;
use super::cost::{Measure, Scale};
use super::ends::{Ends, Rest};
use super::search::Search;
use super::start;
use super::stroke::{Stroke, Visit, total};

/// Neighbours that a search looks at in a second, on a machine of the year 2020.
const LOOKS_PER_SECOND: f64 = 18e6;

/// What a first order and the neighbours of a stroke cost, in looks.
const LOOKS_PER_STROKE: u64 = 140;

/// Strokes for which the search takes all of its time.
const MANY: f64 = 1000.0;

/// Times that the search and the choice of where closed strokes begin take turns.
const TURNS: u64 = 3;

/// How good a route is to be, and how long may be searched for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// What is to become small.
    pub measure: Measure,
    /// Time for the search in s, or less for [few strokes](Effort::looks). It is counted in work done, so that the same route is found on every
    /// machine; 0 for the first route only.
    pub seconds: f64,
    /// Seed of the places where the search tries something else.
    pub seed: u64,
}

impl Effort {
    /// Neighbours of ends that the search looks at for so many strokes, all its work counted in them. Few strokes need little: for fewer than
    /// a thousand it falls about with the square of their number.
    #[must_use]
    pub fn looks(&self, strokes: usize) -> u64 {
        let share = strokes as f64 / MANY;
        (self.seconds * LOOKS_PER_SECOND * (share * (share + 0.1)).min(1.0)) as u64
    }
}

/// A short route through polylines of one vertex or more, which are closed where the last vertex is the first; never longer than in the given order.
///
/// The pen comes from `rest` and goes there. `stops` is asked now and then whether to end with what has been found. The same arguments give the same
/// route. Costs O(n log n) and what `effort` says.
///
/// # Examples
/// Three lines to the right, of which the last is drawn backwards:
///
/// ```
/// use glam::DVec2;
/// use penvis::page::{Effort, Measure, Rest, route};
///
/// let line = |x: f64| vec![DVec2::new(x, 0.0), DVec2::new(x + 5.0, 0.0)];
/// let lines = [line(0.0), line(20.0), line(10.0)];
/// let lines: Vec<&[DVec2]> = lines.iter().map(Vec::as_slice).collect();
/// let effort = Effort { measure: Measure::Distance, seconds: 0.1, seed: 0 };
/// let rest = Rest { before: Some(DVec2::ZERO), after: None };
/// let visits = route(&lines, rest, &effort, &|| false);
/// assert_eq!(visits.iter().map(|v| v.stroke).collect::<Vec<_>>(), [0, 2, 1]);
/// ```
#[must_use]
pub fn route(polylines: &[&[DVec2]], rest: Rest, effort: &Effort, stops: &dyn Fn() -> bool) -> Vec<Visit> {
    let strokes: Vec<Stroke<'_>> = polylines.iter().map(|p| Stroke::new(p)).collect();
    let strokes = strokes.as_slice();
    let given: Vec<Visit> = strokes.iter().zip(0..).map(|(s, k)| s.visit(k, 0)).collect();
    let places = strokes.iter().flat_map(|s| (0..s.starts()).map(|k| s.start(k))).chain(rest.before).chain(rest.after);
    let low = places.clone().fold(DVec2::INFINITY, DVec2::min);
    let high = places.fold(DVec2::NEG_INFINITY, DVec2::max);
    let scale = Scale::new(effort.measure, low.distance(high), strokes.len() + 1);
    let cost = total(strokes, &given, rest, |a, b| scale.between(a, b));
    let mut best = Best { strokes, rest, measure: effort.measure, scale, cost, visits: given };
    let from = rest.before.or_else(|| strokes.first().map(|s| s.start(0))).unwrap_or(DVec2::ZERO);
    let nearest = start::nearest(strokes, from);
    let greedy = pick(strokes, &nearest, &start::greedy(&ends(strokes, &nearest)));
    let turned = greedy.iter().rev().map(|&v| strokes[v.stroke as usize].turned(v)).collect();
    for visits in [nearest, greedy, turned] {
        best.consider(visits);
    }
    let has_closed = strokes.iter().any(Stroke::is_closed);
    let mut rng = fastrand::Rng::with_seed(effort.seed);
    let mut left = effort.looks(strokes.len()).saturating_sub(LOOKS_PER_STROKE * strokes.len() as u64);
    let turns = if has_closed { TURNS } else { 1 };
    for turn in 0..turns {
        let share = left / (turns - turn);
        if share == 0 || strokes.is_empty() || stops() {
            break;
        }
        let ends = Ends::new(ends(strokes, &best.visits), rest, effort.measure);
        let last = strokes.len() as u32;
        let mut search = Search::new(&ends, (0..=last).map(|k| 2 * k).collect());
        search.run(share, &mut rng, stops);
        left = left.saturating_sub(search.work());
        // The round from the pen's rest on, in the direction in which that is left at its end.
        let mut order = search.order().to_vec();
        if let Some(at) = order.iter().position(|e| e >> 1 == last) {
            order.rotate_left(at);
        }
        if order.first().is_some_and(|e| e & 1 == 1) {
            order[1..].reverse();
            order.iter_mut().for_each(|e| *e ^= 1);
        }
        let visits = pick(strokes, &best.visits, order.get(1..).unwrap_or_default());
        if !best.consider(visits) {
            break;
        }
    }
    best.visits
}

/// The best route so far.
struct Best<'a> {
    strokes: &'a [Stroke<'a>],
    rest: Rest,
    measure: Measure,
    /// Whole numbers, so that roundings make no difference between routes that are equally long.
    scale: Scale,
    cost: i64,
    visits: Vec<Visit>,
}

impl Best<'_> {
    /// Takes another route if it is better once its closed strokes begin where they should; whether it is.
    fn consider(&mut self, mut visits: Vec<Visit>) -> bool {
        closed::choose(self.strokes, &mut visits, self.rest, self.measure);
        let cost = total(self.strokes, &visits, self.rest, |a, b| self.scale.between(a, b));
        let is_better = cost < self.cost;
        if is_better {
            (self.cost, self.visits) = (cost, visits);
        }
        is_better
    }
}

/// Begins and ends of visits.
fn ends(strokes: &[Stroke<'_>], visits: &[Visit]) -> Vec<DVec2> {
    let ends = |v: &Visit| {
        let stroke = &strokes[v.stroke as usize];
        [stroke.begin(*v), stroke.end(*v)]
    };
    visits.iter().flat_map(ends).collect()
}

/// Visits in the order of these ends, turned where it is the second end.
fn pick(strokes: &[Stroke<'_>], visits: &[Visit], order: &[u32]) -> Vec<Visit> {
    let visit = |&end: &u32| {
        let visit = visits[(end >> 1) as usize];
        if end & 1 == 1 { strokes[visit.stroke as usize].turned(visit) } else { visit }
    };
    order.iter().map(visit).collect()
}
