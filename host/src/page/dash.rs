//! Dashes as ink: a polyline cut into short ones, because a pen knows no dash pattern.

use super::walk::Walk;
use crate::drawing::Polyline;

/// Lengths of dash and gap in mm, both positive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DashPattern {
    /// Length of a dash in mm.
    pub dash_mm: f64,
    /// Length of a gap in mm.
    pub gap_mm: f64,
}

impl Default for DashPattern {
    /// 2 mm and 1.25 mm, which a 0.5 mm pen still keeps apart.
    fn default() -> Self {
        Self { dash_mm: 2.0, gap_mm: 1.25 }
    }
}

/// Appends the dashes of `polyline` to `out`.
///
/// The pattern is stretched or squeezed a little, so that an open polyline begins and ends with a whole dash and a closed
/// one goes on evenly over its start. A polyline too short for two dashes stays whole.
pub fn dash(polyline: &Polyline, pattern: DashPattern, out: &mut Vec<Polyline>) {
    let DashPattern { dash_mm, gap_mm } = pattern;
    let length = polyline.length_mm();
    let closed = polyline.page.first() == polyline.page.last();
    // Open: n dashes and n − 1 gaps. Closed: as many gaps as dashes.
    let natural = if closed { length } else { length + gap_mm };
    let count = (natural / (dash_mm + gap_mm)).round();
    if count.is_nan() || count < 2.0 {
        out.push(polyline.clone());
        return;
    }
    let stretch = length / (natural_length(count, closed, pattern));
    let period = (dash_mm + gap_mm) * stretch;
    let mut walk = Walk::new(polyline);
    let mut k = 0.0;
    while k < count {
        let from = k * period;
        out.push(walk.cut(from, (from + dash_mm * stretch).min(length)));
        k += 1.0;
    }
}

fn natural_length(count: f64, closed: bool, pattern: DashPattern) -> f64 {
    count * (pattern.dash_mm + pattern.gap_mm) - if closed { 0.0 } else { pattern.gap_mm }
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};
    use penvis_core::stroke::{Certainty, CurveKind};
    use proptest::prelude::*;

    use super::*;

    fn polyline(page: Vec<DVec2>) -> Polyline {
        Polyline {
            kind: Some(CurveKind::Iso),
            surface: 0,
            layer: "hidden".into(),
            pen: 1,
            level: 0,
            visible: false,
            qi: 1,
            certainty: Certainty::Proven,
            points: page.iter().map(|p| p.extend(1.0) * 2.0).collect(),
            page,
        }
    }

    fn dashes(page: Vec<DVec2>, dash_mm: f64, gap_mm: f64) -> Vec<Polyline> {
        let mut out = Vec::new();
        dash(&polyline(page), DashPattern { dash_mm, gap_mm }, &mut out);
        out
    }

    #[test]
    fn an_open_line_begins_and_ends_with_a_dash() {
        let found = dashes(vec![DVec2::ZERO, DVec2::new(8.0, 0.0)], 2.0, 1.0);
        let spans: Vec<_> = found.iter().map(|p| (p.page[0].x, p.page[1].x)).collect();
        assert_eq!(spans, [(0.0, 2.0), (3.0, 5.0), (6.0, 8.0)]);
        assert_eq!(found[1].points, [DVec3::new(6.0, 0.0, 2.0), DVec3::new(10.0, 0.0, 2.0)]);
    }

    #[test]
    fn dashes_bend_round_corners_and_closed_lines_close_evenly() {
        let square = [(0.0, 0.0), (3.0, 0.0), (3.0, 3.0), (0.0, 3.0), (0.0, 0.0)];
        let found = dashes(square.map(DVec2::from).to_vec(), 2.0, 0.4);
        assert_eq!(found.len(), 5);
        assert_eq!(found[1].page[1], DVec2::new(3.0, 0.0));
        let last = *found[4].page.last().unwrap();
        assert!((last - DVec2::new(0.0, 0.4)).length() < 1e-12, "{last}");
    }

    #[test]
    fn short_lines_stay_whole() {
        assert_eq!(dashes(vec![DVec2::ZERO, DVec2::new(2.5, 0.0)], 2.0, 1.0).len(), 1);
        assert_eq!(dashes(vec![DVec2::ONE, DVec2::ONE], 2.0, 1.0).len(), 1);
    }

    proptest! {
        #[test]
        fn dashes_hold_their_share_of_the_length(
            page in prop::collection::vec((0.0..50.0, 0.0..50.0).prop_map(DVec2::from), 2..30)
        ) {
            let length: f64 = page.windows(2).map(|w| w[0].distance(w[1])).sum();
            let found = dashes(page.clone(), 2.0, 1.0);
            let ink: f64 = found.iter().flat_map(|p| p.page.windows(2)).map(|w| w[0].distance(w[1])).sum();
            prop_assert!(ink <= length + 1e-9);
            if length > 30.0 {
                prop_assert!((ink / length - 2.0 / 3.0).abs() < 0.05, "{} of {}", ink, length);
                prop_assert!(found[0].page[0] == page[0]);
                prop_assert!(found.last().unwrap().page.last().unwrap().distance(*page.last().unwrap()) < 1e-9);
            }
            for p in &found {
                prop_assert_eq!(p.page.len(), p.points.len());
            }
        }
    }
}
