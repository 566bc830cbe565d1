//! Fewer vertices where a drawing may be farther from its curves than its polylines are.

use std::borrow::Cow;

use glam::DVec2;

use super::{Drawing, Polyline};

impl Drawing {
    /// The drawing with as few vertices as its slack allows, which is used up by that. What stays is where it was. Cost: O(n log n) in the vertices.
    #[must_use]
    pub fn thinned(&self) -> Cow<'_, Self> {
        if self.slack_mm <= 0.0 {
            return Cow::Borrowed(self);
        }
        let thin = |polyline: &Polyline| {
            let kept = kept(&polyline.page, self.slack_mm);
            let points = kept.iter().filter_map(|k| polyline.points.get(*k)).copied().collect();
            let page = kept.iter().map(|k| polyline.page[*k]).collect();
            Polyline { points, page, layer: polyline.layer.clone(), ..*polyline }
        };
        Cow::Owned(Self {
            name: self.name.clone(),
            pens: self.pens.clone(),
            slack_mm: 0.0,
            polylines: self.polylines.iter().map(thin).collect(),
            ..*self
        })
    }
}

/// Indices of the vertices that stay, the first and the last among them.
fn kept(page: &[DVec2], slack_mm: f64) -> Vec<usize> {
    let Some(last) = page.len().checked_sub(1) else { return Vec::new() };
    let (mut from, mut kept) = (0, vec![0]);
    while from < last {
        let chord = |to: usize| {
            let follows = || follows(page[from], page[to], &page[from..=to], slack_mm, 0.0);
            (to == from + 1 || follows()).then_some(())
        };
        // A chord to the next vertex always serves.
        from = farthest(from, last, chord).map_or(from + 1, |(to, ())| to);
        kept.push(from);
    }
    kept
}

/// Whether the straight way from `start` to `end` passes `points` in their order, but for `back_mm` that they may go back, and within `slack_mm` of each.
#[must_use]
pub(crate) fn follows(start: DVec2, end: DVec2, points: &[DVec2], slack_mm: f64, back_mm: f64) -> bool {
    let way = end - start;
    let length = way.length();
    let mut along = 0.0;
    // Where the ends are one place, nothing compares as true.
    points.iter().all(|p| {
        let at = (*p - start).dot(way) / length;
        let ordered = at >= along - back_mm;
        along = at.max(along);
        // Beyond the ends it is as far as they are.
        let off = (*p - start - way * (at / length).clamp(0.0, 1.0)).length();
        ordered && off <= slack_mm
    })
}

/// The last vertex after `from` and up to `last` that `reach` accepts, with what it says of it, as far as doubling and halving the number of vertices finds it.
pub(crate) fn farthest<T>(from: usize, last: usize, reach: impl Fn(usize) -> Option<T>) -> Option<(usize, T)> {
    let mut found = None;
    let (mut good, mut step) = (from, 1);
    let mut bad = last + 1;
    while good < last {
        let to = (good + step).min(last);
        match reach(to) {
            Some(value) => {
                found = Some((to, value));
                good = to;
                step *= 2;
            }
            // Two chords are the least that an arc is for.
            None if step == 1 && good == from => {
                step = 2;
                if from + 2 > last {
                    return found;
                }
                let value = reach(from + 2)?;
                found = Some((from + 2, value));
                good = from + 2;
            }
            None => {
                bad = to;
                break;
            }
        }
    }
    while good + 1 < bad {
        let to = good.midpoint(bad);
        match reach(to) {
            Some(value) => {
                found = Some((to, value));
                good = to;
            }
            None => bad = to,
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use penvis_core::stroke::CurveKind::Iso;

    use super::*;
    use crate::emit::tests::{drawing, polyline};

    #[test]
    fn what_stays_is_where_it_was_and_near_enough() {
        let circle: Vec<[f64; 2]> = (0..=400)
            .map(|k| DVec2::from_angle(f64::from(k) / 400.0 * std::f64::consts::TAU) * 30.0)
            .map(|p| [p.x + 50.0, p.y + 50.0])
            .collect();
        let straight: Vec<[f64; 2]> = (0..=50).map(|k| [f64::from(k), 3.0]).collect();
        let mut fine = drawing(100.0, 100.0, vec![polyline(Iso, 1, &circle), polyline(Iso, 1, &straight)]);
        assert_eq!(*fine.thinned(), fine);
        fine.slack_mm = 0.0075;
        let thin = fine.thinned();
        assert_eq!((thin.slack_mm, thin.polylines[1].page.len()), (0.0, 2));
        let (few, all) = (&thin.polylines[0], &fine.polylines[0]);
        // The vertices between the ends of three chords are 0.0074 mm from the way between these, those of four 0.0148 mm.
        assert_eq!((few.page.len(), few.points.len()), (135, 135));
        assert_eq!((few.page.first(), few.page.last()), (all.page.first(), all.page.last()));
        for p in &all.page {
            let near = few.page.windows(2).any(|w| {
                let along = ((*p - w[0]).dot(w[1] - w[0]) / w[0].distance_squared(w[1])).clamp(0.0, 1.0);
                p.distance(w[0].lerp(w[1], along)) <= 0.0075 + 1e-12
            });
            assert!(near, "{p}");
        }
    }
}
