//! Arcs that are kept, thousands of them, in hardly more room than their control points take.
//!
//! An arc begins with the control point with which the one before it ends, and its box follows from its control points. So a run
//! of arcs keeps each control point once, without a weight where all weights are 1, and makes an arc again when it is asked for
//! one: the same to the bit, at the cost of a copy and of its box.

use alloc::boxed::Box;
use alloc::vec::Vec;

use glam::{DVec3, DVec4};

use super::arc::{Arc, Control};

/// Arcs of one curve and one degree that follow one another.
#[derive(Clone, Debug)]
pub(super) struct Run {
    degree: usize,
    /// The curve's parameter where the first arc begins, and where each ends, there with the error of the arc.
    joints: Box<[(f64, f64)]>,
    points: Points,
}

/// Control points, of which arcs that follow one another share one.
#[derive(Clone, Debug)]
enum Points {
    /// All weights are 1, as those of all arcs that are fitted.
    Polynomial(Box<[DVec3]>),
    Rational(Box<[DVec4]>),
}

impl Run {
    /// Number of arcs.
    pub(super) fn len(&self) -> usize {
        self.joints.len() - 1
    }

    /// The arc `k`, of the curve with the index `curve`.
    pub(super) fn arc(&self, k: usize, curve: usize) -> Arc {
        let ((t0, _), (t1, error)) = (self.joints[k], self.joints[k + 1]);
        let span = k * self.degree..=(k + 1) * self.degree;
        // What is kept was worked with before, so there is room.
        match &self.points {
            Points::Polynomial(points) => {
                let places = &points[span];
                let points: Control = places.iter().map(|p| p.extend(1.0)).collect();
                Arc::over(places.iter().copied(), curve, [t0, t1], points, error)
            }
            Points::Rational(points) => {
                Arc::new(curve, [t0, t1], Control::from_slice(&points[span]).unwrap_or_default(), error)
            }
        }
    }

    /// The first arc that holds the parameter `t`.
    pub(super) fn holding(&self, t: f64) -> Option<usize> {
        self.joints.windows(2).position(|j| j[0].0 <= t && t <= j[1].0)
    }
}

/// Takes arcs in order and keeps them as runs.
#[derive(Default)]
pub(super) struct Keeper {
    degree: usize,
    joints: Vec<(f64, f64)>,
    points: Vec<DVec4>,
    runs: Vec<Run>,
}

impl Keeper {
    /// Keeps the next arc of the curve.
    pub(super) fn push(&mut self, arc: &Arc) {
        let Some((first, rest)) = arc.points.split_first() else { return };
        let same = |a: DVec4, b: DVec4| a.to_array().map(f64::to_bits) == b.to_array().map(f64::to_bits);
        let follows = self.degree == rest.len()
            && self.joints.last().is_some_and(|j| j.0.to_bits() == arc.t[0].to_bits())
            && self.points.last().is_some_and(|p| same(*p, *first));
        if !follows {
            self.end();
            self.degree = rest.len();
            self.joints.push((arc.t[0], 0.0));
            self.points.push(*first);
        }
        self.joints.push((arc.t[1], arc.error));
        self.points.extend_from_slice(rest);
    }

    /// Ends the run, if there is one.
    fn end(&mut self) {
        if self.joints.is_empty() {
            return;
        }
        let points = if self.points.iter().all(|p| p.w == 1.0) {
            Points::Polynomial(self.points.iter().map(|p| p.truncate()).collect())
        } else {
            Points::Rational(Box::from(&*self.points))
        };
        self.runs.push(Run { degree: self.degree, joints: Box::from(&*self.joints), points });
        self.joints.clear();
        self.points.clear();
    }

    /// The runs of the curve whose arcs it took.
    pub(super) fn take(&mut self) -> Box<[Run]> {
        self.end();
        core::mem::take(&mut self.runs).into_boxed_slice()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arc(t: [f64; 2], points: &[[f64; 4]], error: f64) -> Arc {
        Arc::new(7, t, points.iter().map(|p| DVec4::from_array(*p)).collect(), error)
    }

    #[test]
    fn arcs_come_back_to_the_bit() {
        let arcs = [
            arc([0.0, 0.5], &[[0.0, -0.0, 1.0, 1.0], [1.0, 2.0, 3.0, 1.0], [2.0, 0.1, 0.3, 1.0]], 1e-9),
            arc([0.5, 0.7], &[[2.0, 0.1, 0.3, 1.0], [1.5, 0.2, 0.7, 1.0], [1.0, 1.0, 1.0, 1.0]], 0.0),
            // Another degree.
            arc([0.7, 0.8], &[[1.0, 1.0, 1.0, 1.0], [3.0, 1.0, 1.0, 1.0]], 0.25),
            // Another place, by a sign that no comparison of numbers sees.
            arc([0.8, 0.9], &[[3.0, 1.0, 1.0, 1.0], [0.0, 0.0, 0.0, 1.0]], 0.25),
            arc([0.9, 1.0], &[[-0.0, 0.0, 0.0, 1.0], [0.5, 0.25, 0.3, 0.7]], 0.25),
            arc([1.0, 2.0], &[[0.5, 0.25, 0.3, 0.7], [0.1, 0.2, 0.3, 0.4]], 0.0),
            // Another parameter.
            arc([3.0, 4.0], &[[0.1, 0.2, 0.3, 0.4], [0.0, 0.0, 1.0, 1.0]], 0.0),
        ];
        let mut keeper = Keeper::default();
        arcs.iter().for_each(|a| keeper.push(a));
        let runs = keeper.take();
        assert_eq!(runs.iter().map(Run::len).collect::<Vec<_>>(), [2, 2, 2, 1]);
        let again: Vec<Arc> = runs.iter().flat_map(|run| (0..run.len()).map(|k| run.arc(k, 7))).collect();
        // The shortest decimals of a number tell its sign and its bits.
        assert_eq!(alloc::format!("{again:?}"), alloc::format!("{arcs:?}"));
        assert_eq!([0.0, 0.5, 0.6, 0.75].map(|t| runs[0].holding(t)), [Some(0), Some(0), Some(1), None]);
        assert!(keeper.take().is_empty());
    }
}
