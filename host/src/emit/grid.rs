//! Polylines on the grid of a plotter: rounded first, then everything else.

use glam::DVec2;

use crate::drawing::Drawing;

/// What the pen draws without being lifted, in whole steps of a grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Pen number, from 1.
    pub pen: u32,
    /// Index of the polyline that it begins with.
    pub polyline: usize,
    /// Vertices, neighbours different. A single one is a dot.
    pub points: Vec<[i64; 2]>,
    /// The same vertices before they were rounded, mm.
    pub exact: Vec<DVec2>,
}

/// The runs of a drawing on a grid of `unit_mm`, in drawing order: vertices that fall on their predecessor are dropped, and
/// a polyline that begins where the one before it with the same pen has ended is drawn on without a lift.
///
/// `place` maps the page to the machine, both in mm. A coordinate is off by half a unit at most.
#[must_use]
pub fn runs(drawing: &Drawing, unit_mm: f64, place: impl Fn(DVec2) -> DVec2) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (index, polyline) in drawing.polylines.iter().enumerate() {
        let mut vertices = polyline.page.iter().map(|p| {
            let exact = place(*p);
            let at = (exact / unit_mm).round();
            // A cast saturates, and makes 0 of what is not a number.
            ([at.x as i64, at.y as i64], exact)
        });
        let Some((first, exact)) = vertices.next() else { continue };
        match runs.last() {
            Some(run) if run.pen == polyline.pen && run.points.last() == Some(&first) => {}
            _ => runs.push(Run { pen: polyline.pen, polyline: index, points: vec![first], exact: vec![exact] }),
        }
        let Some(run) = runs.last_mut() else { continue };
        for (point, exact) in vertices {
            if run.points.last() != Some(&point) {
                run.points.push(point);
                run.exact.push(exact);
            }
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use penvis_core::stroke::CurveKind::Iso;

    use super::super::tests::{drawing, polyline};
    use super::*;

    #[test]
    fn rounding_comes_before_dropping_and_joining() {
        let lines = vec![
            polyline(Iso, 1, &[[0.0, 0.0], [0.1, 0.0], [0.6, 0.0], [0.9, 0.2], [5.0, 5.0]]),
            polyline(Iso, 1, &[[5.2, 4.8], [9.0, 9.0]]),
            polyline(Iso, 2, &[[9.0, 9.0], [9.1, 9.1]]),
        ];
        let found = runs(&drawing(10.0, 10.0, lines), 1.0, |p| p);
        let found: Vec<_> = found.into_iter().map(|run| (run.pen, run.polyline, run.points, run.exact)).collect();
        let exact = [[0.0, 0.0], [0.6, 0.0], [5.0, 5.0], [9.0, 9.0]].map(DVec2::from).to_vec();
        assert_eq!(
            found,
            [(1, 0, vec![[0, 0], [1, 0], [5, 5], [9, 9]], exact), (2, 2, vec![[9, 9]], vec![DVec2::splat(9.0)])]
        );
    }
}
