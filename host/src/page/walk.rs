//! Parts of a polyline by their lengths along it.

use glam::{DVec2, DVec3};

use crate::drawing::Polyline;

/// Where a walk along a polyline has come to.
pub(super) struct Walk<'a> {
    polyline: &'a Polyline,
    /// The segment that the walk is on.
    segment: usize,
    /// Length in mm before it.
    start: f64,
}

impl<'a> Walk<'a> {
    /// From the beginning of a polyline of two vertices or more.
    pub(super) fn new(polyline: &'a Polyline) -> Self {
        Self { polyline, segment: 0, start: 0.0 }
    }

    /// The part between two lengths in mm, neither less than those of the call before.
    pub(super) fn cut(&mut self, from: f64, to: f64) -> Polyline {
        let (page, points) = (&self.polyline.page, &self.polyline.points);
        let (p, q) = self.go(from);
        let (mut on_page, mut on_model) = (vec![p], vec![q]);
        let first = self.segment;
        let (p, q) = self.go(to);
        on_page.extend_from_slice(&page[first + 1..=self.segment]);
        on_model.extend_from_slice(&points[first + 1..=self.segment]);
        on_page.push(p);
        on_model.push(q);
        Polyline { page: on_page, points: on_model, layer: self.polyline.layer.clone(), ..*self.polyline }
    }

    /// Walks to a length in mm and returns the point there, on the page and in the model.
    fn go(&mut self, at: f64) -> (DVec2, DVec3) {
        let (page, points) = (&self.polyline.page, &self.polyline.points);
        loop {
            let k = self.segment;
            let length = page[k].distance(page[k + 1]);
            if at <= self.start + length || k + 2 == page.len() {
                let s = if length > 0.0 { ((at - self.start) / length).clamp(0.0, 1.0) } else { 0.0 };
                return (page[k].lerp(page[k + 1], s), points[k].lerp(points[k + 1], s));
            }
            self.start += length;
            self.segment += 1;
        }
    }
}
