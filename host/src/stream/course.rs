//! How much of a plot is done, and how long the rest takes.

use std::time::Duration;

use crate::trace::Step;

/// Weight of the estimate against what is measured: after so many seconds they count alike.
const PRIOR_S: f64 = 60.0;

/// What is drawn, and how long it takes by estimate, up to each piece of a job.
#[derive(Clone, Debug, Default)]
pub struct Course {
    /// Seconds and mm of ink after each piece.
    sums: Vec<(f64, f64)>,
}

/// How a plot stands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Standing {
    /// From 0 to 1, by time where that is known, else by pieces.
    pub fraction: f64,
    /// Ink that is drawn, and all of it, in mm; none where the job is not followed.
    pub ink_mm: Option<(f64, f64)>,
    /// Time that is left; none where it cannot be told.
    pub left: Option<Duration>,
}

impl Course {
    /// The course of a job of which this is known.
    #[must_use]
    pub fn new(steps: &[Step]) -> Self {
        let sums = steps.iter().scan((0.0, 0.0), |sum, step| {
            *sum = (sum.0 + step.seconds, sum.1 + step.ink_mm);
            Some(*sum)
        });
        Self { sums: sums.collect() }
    }

    /// Seconds and mm of ink of the first pieces.
    fn after(&self, pieces: usize) -> (f64, f64) {
        let last = pieces.min(self.sums.len()).checked_sub(1);
        last.and_then(|last| self.sums.get(last)).copied().unwrap_or_default()
    }

    fn total(&self) -> (f64, f64) {
        self.after(self.sums.len())
    }
}

/// Follows a plot on its course.
#[derive(Clone, Debug, Default)]
pub struct Estimate {
    course: Course,
    /// Pieces at the beginning, and when that was.
    begun: Option<(usize, Duration)>,
    /// Time at rest, and since when it rests now.
    rested: Duration,
    rests_since: Option<Duration>,
}

impl Estimate {
    /// Of a plot that has not begun.
    #[must_use]
    pub fn new(course: Course) -> Self {
        Self { course, ..Self::default() }
    }

    /// The plotter rests, or goes on: that time says nothing of its speed.
    pub fn paused(&mut self, rests: bool, now: Duration) {
        let since = self.rests_since.take();
        self.rested += since.map_or(Duration::ZERO, |since| now.saturating_sub(since));
        self.rests_since = rests.then_some(now);
    }

    /// How the plot stands when `pieces` of `total` are done.
    pub fn at(&mut self, pieces: usize, total: usize, now: Duration) -> Standing {
        let (from, since) = *self.begun.get_or_insert((pieces, now));
        let resting = self.rests_since.map_or(Duration::ZERO, |since| now.saturating_sub(since));
        let measured = now.saturating_sub(since).saturating_sub(self.rested + resting).as_secs_f64();
        let ((seconds, ink), (all_s, all_ink)) = (self.course.after(pieces), self.course.total());
        if self.course.sums.is_empty() || all_s <= 0.0 {
            let fraction = pieces as f64 / (total.max(1) as f64);
            let done = pieces.saturating_sub(from) as f64;
            let left = measured / done * total.saturating_sub(pieces) as f64;
            return Standing { fraction, ink_mm: None, left: Duration::try_from_secs_f64(left).ok() };
        }
        // Estimates of acceleration and of what a controller adds are off by some factor, which the time so far tells.
        let modelled = seconds - self.course.after(from).0;
        let factor = (measured + PRIOR_S) / (modelled + PRIOR_S);
        let left = Duration::try_from_secs_f64((all_s - seconds).max(0.0) * factor).ok();
        Standing { fraction: seconds / all_s, ink_mm: Some((ink, all_ink)), left }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course(count: usize) -> Course {
        Course::new(&vec![Step { seconds: 2.0, ink_mm: 10.0, ..Step::default() }; count])
    }

    const fn s(seconds: u64) -> Duration {
        Duration::from_secs(seconds)
    }

    #[test]
    fn what_is_left_follows_what_is_measured() {
        let mut estimate = Estimate::new(course(1000));
        let standing = estimate.at(0, 1000, s(5));
        assert_eq!(standing, Standing { fraction: 0.0, ink_mm: Some((0.0, 10_000.0)), left: Some(s(2000)) });
        // As estimated.
        assert_eq!(estimate.at(100, 1000, s(205)).left, Some(s(1800)));
        // Twice as slow, and in the end that is what counts.
        let standing = estimate.at(500, 1000, s(2005));
        assert_eq!((standing.fraction, standing.ink_mm), (0.5, Some((5000.0, 10_000.0))));
        assert!(standing.left.unwrap() > s(1900) && standing.left.unwrap() < s(2000), "{standing:?}");
        assert_eq!(estimate.at(1000, 1000, s(4000)).left, Some(Duration::ZERO));
    }

    #[test]
    fn rests_and_what_was_drawn_before_do_not_count() {
        let mut estimate = Estimate::new(course(1000));
        estimate.at(500, 1000, s(0));
        estimate.paused(true, s(100));
        assert_eq!(estimate.at(550, 1000, s(5000)).left, Some(s(900)));
        estimate.paused(false, s(9100));
        assert_eq!(estimate.at(600, 1000, s(9200)).left, Some(s(800)));
    }

    #[test]
    fn without_a_course_pieces_are_counted() {
        let mut estimate = Estimate::new(Course::default());
        assert_eq!(estimate.at(0, 10, s(0)), Standing { fraction: 0.0, ink_mm: None, left: None });
        assert_eq!(estimate.at(4, 10, s(8)), Standing { fraction: 0.4, ink_mm: None, left: Some(s(12)) });
    }
}
