//! Whether a place is on the way that a job has yet to go.

use glam::DVec2;

use crate::trace::Step;

/// The distance in mm of a place from the way that a job goes from the end of piece `executed` (from 1; 0 is the beginning) on,
/// for as many pieces as `ahead` tells; infinite where nothing of it is known. Arcs are taken for their chords, so that a place
/// on one is as far as its rise. Cost: linear.
#[must_use]
pub fn distance(steps: &[Step], executed: usize, ahead: usize, place: DVec2) -> f64 {
    let from = executed.saturating_sub(1);
    let to = executed.saturating_add(ahead).min(steps.len());
    let mut before: Option<DVec2> = None;
    let mut nearest = f64::INFINITY;
    for step in steps.get(from..to).unwrap_or_default() {
        let end = step.end.xy();
        if let Some(end) = end {
            nearest = nearest.min(to_segment(place, before.unwrap_or(end), end));
        }
        before = end;
    }
    nearest
}

fn to_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let way = b - a;
    let along = if way == DVec2::ZERO { 0.0 } else { ((p - a).dot(way) / way.length_squared()).clamp(0.0, 1.0) };
    p.distance(a + way * along)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::Position;

    #[test]
    fn only_what_is_still_to_come_counts() {
        let at = |x: f64, y: f64| Step { end: Position { x: Some(x), y: Some(y), z: None }, ..Step::default() };
        let steps = [Step::default(), at(0.0, 0.0), at(10.0, 0.0), Step::default(), at(10.0, 5.0), at(20.0, 5.0)];
        let table = [
            (0, [5.0, 0.0], 0.0),
            (2, [5.0, 1.0], 1.0),
            (3, [10.0, 0.0], 0.0),
            (3, [5.0, 0.0], 5.0),
            // The way to an unknown place and back is unknown.
            (3, [10.0, 2.0], 2.0),
            (5, [15.0, 5.0], 0.0),
            (6, [15.0, 5.0], 5.0),
        ];
        for (executed, place, expected) in table {
            assert_eq!(distance(&steps, executed, 9, place.into()), expected, "{executed} {place:?}");
        }
        assert_eq!(distance(&steps[..1], 0, 9, DVec2::ZERO), f64::INFINITY);
        assert_eq!(distance(&[], 7, 9, DVec2::ZERO), f64::INFINITY);
        assert_eq!(distance(&steps, 2, 1, DVec2::new(10.0, 5.0)), 5.0);
    }
}
