//! Shapes joined, kept away from lines, and made smaller.
//!
//! It is done on a grid of integers that is far finer than any pen, so that no rounding depends on what lies on what: sides that coincide, corners
//! that touch and borders that are there twice are ordinary input.

use glam::DVec2;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::float::scale::{FixedScaleFloatOverlay, FixedScaleOverlayError};
use i_overlay::mesh::float::outline::offset::OutlineOffset;
use i_overlay::mesh::float::stroke::offset::StrokeOffset;
use i_overlay::mesh::float::style::{LineCap, LineJoin, OutlineStyle, StrokeStyle};

use crate::drawing::simplify::kept;

/// Places of the grid in a mm. Sixty-four bits hold a square of many kilometres of it.
const GRID: f64 = (1_u64 << 20) as f64;

/// Why there is no such shape.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum OffsetError {
    /// It cannot be put on the grid.
    #[error(
        "regions are so large on the paper that no lines along their contours can be found; clip a smaller part, or take another fill"
    )]
    TooLarge,
}

impl From<FixedScaleOverlayError> for OffsetError {
    fn from(_: FixedScaleOverlayError) -> Self {
        // The scale itself is one; what is left is what lies beyond the grid.
        Self::TooLarge
    }
}

/// A closed line, the last corner joined to the first.
type Contour = Vec<[f64; 2]>;

/// Shapes on the paper that do not overlap, each an outer loop, counter-clockwise, and its holes, clockwise.
#[derive(Clone, Debug, Default)]
pub(super) struct Shapes(Vec<Vec<Contour>>);

impl Shapes {
    /// What loops wind round, more often one way than the other.
    ///
    /// # Errors
    /// If they are no numbers, or beyond the grid.
    pub(super) fn of<'a>(loops: impl IntoIterator<Item = &'a [DVec2]>) -> Result<Self, OffsetError> {
        let contours: Vec<Contour> = loops.into_iter().map(contour).collect();
        let nothing: Vec<Contour> = Vec::new();
        Ok(Self(contours.overlay_with_fixed_scale_as::<i64>(
            &nothing,
            OverlayRule::Subject,
            FillRule::NonZero,
            GRID,
        )?))
    }

    /// Whether there is nothing.
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The same without gaps that are narrower than twice `mm`, which are closed; nothing else is changed by more than the chords of arcs of this radius.
    ///
    /// # Errors
    /// As [`of`](Self::of).
    pub(super) fn closed(self, mm: f64) -> Result<Self, OffsetError> {
        self.moved(mm, mm / 8.0)?.moved(-mm, mm / 8.0)
    }

    /// What of the shapes is farther than `mm` from lines, to within `chord_mm`.
    ///
    /// # Errors
    /// As [`of`](Self::of).
    pub(super) fn away_from<'a>(
        self,
        lines: impl IntoIterator<Item = &'a [DVec2]>,
        mm: f64,
        chord_mm: f64,
    ) -> Result<Self, OffsetError> {
        // Borders may have a great many corners on one line, each of which would get a circle of its own.
        let thin = |line: &[DVec2]| kept(line, chord_mm).into_iter().map(|k| line[k].to_array()).collect();
        let lines: Vec<Contour> = lines.into_iter().map(thin).collect();
        if self.is_empty() || lines.is_empty() {
            return Ok(self);
        }
        let step = step(mm, chord_mm);
        // Round the ends of lines there are polygons; with this width it is their sides that touch the circle.
        let width = 2.0 * mm / (step / 2.0).cos();
        let style = StrokeStyle::new(width)
            .line_join(LineJoin::Round(step))
            .start_cap(LineCap::Round(step))
            .end_cap(LineCap::Round(step));
        let near = lines.stroke_fixed_scale_as::<i64>(style, false, GRID)?;
        let left =
            self.0.overlay_with_fixed_scale_as::<i64>(&near, OverlayRule::Difference, FillRule::NonZero, GRID)?;
        Ok(Self(left))
    }

    /// What of the shapes is `mm` inside, with arcs about corners that point inwards made of chords within `chord_mm`.
    ///
    /// # Errors
    /// As [`of`](Self::of).
    pub(super) fn shrunk(self, mm: f64, chord_mm: f64) -> Result<Self, OffsetError> {
        self.moved(-mm, chord_mm)
    }

    /// With the borders moved outwards.
    fn moved(self, mm: f64, chord_mm: f64) -> Result<Self, OffsetError> {
        if self.is_empty() {
            return Ok(self);
        }
        let style = OutlineStyle::new(mm).line_join(LineJoin::Round(step(mm.abs(), chord_mm)));
        Ok(Self(self.0.outline_fixed_scale_as::<i64>(&style, GRID)?))
    }

    /// With as few corners as chords within `chord_mm` need.
    pub(super) fn thinned(mut self, chord_mm: f64) -> Self {
        for contour in self.0.iter_mut().flatten() {
            let Some(&first) = contour.first() else { continue };
            let closed: Vec<DVec2> = contour.iter().chain([&first]).copied().map(DVec2::from).collect();
            let corners = kept(&closed, chord_mm);
            *contour = corners[..corners.len() - 1].iter().map(|&k| closed[k].to_array()).collect();
        }
        self
    }

    /// Its borders, closed: the last point is the first.
    pub(super) fn borders(&self) -> impl Iterator<Item = Vec<DVec2>> {
        let closed = |c: &Contour| c.iter().chain(c.first()).copied().map(DVec2::from).collect();
        self.0.iter().flatten().filter(|c| c.len() > 2).map(closed)
    }
}

fn contour(points: &[DVec2]) -> Contour {
    points.iter().map(DVec2::to_array).collect()
}

/// Angle between the corners of a polygon that stands for a circle within a chord error.
fn step(radius: f64, chord: f64) -> f64 {
    let cosine = 1.0 - chord / radius.max(chord);
    // What the offsets take.
    (2.0 * cosine.acos()).clamp(0.01 * std::f64::consts::PI, 0.25 * std::f64::consts::PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(low: f64, high: f64) -> Vec<DVec2> {
        [[low, low], [high, low], [high, high], [low, high]].map(DVec2::from).to_vec()
    }

    fn area(shapes: &Shapes) -> f64 {
        shapes.borders().flat_map(|b| b.windows(2).map(|w| 0.5 * w[0].perp_dot(w[1])).collect::<Vec<_>>()).sum()
    }

    #[test]
    fn a_square_with_a_hole_shrinks_on_both_sides() {
        let hole: Vec<DVec2> = square(8.0, 12.0).into_iter().rev().collect();
        let shapes = Shapes::of([&square(0.0, 20.0)[..], &hole]).unwrap();
        assert!((area(&shapes) - (400.0 - 16.0)).abs() < 1e-4);
        let small = shapes.shrunk(1.0, 1e-3).unwrap();
        let hole = 16.0 + 4.0 * 4.0 + std::f64::consts::PI;
        assert!((area(&small) - (18.0 * 18.0 - hole)).abs() < 0.01, "{}", area(&small));
        assert!(small.shrunk(4.0, 1e-3).unwrap().is_empty());
    }

    #[test]
    fn halves_that_miss_one_another_by_a_hair_are_one_when_closed() {
        let right: Vec<DVec2> = square(10.0, 20.0).iter().map(|p| DVec2::new(p.x + 0.015, p.y - 10.0)).collect();
        let left = square(0.0, 10.0);
        let two = Shapes::of([&left[..], &right]).unwrap();
        assert_eq!(two.borders().count(), 2);
        let one = two.closed(0.01).unwrap();
        assert_eq!(one.borders().count(), 1);
        assert!((area(&one) - 200.15).abs() < 1e-2, "{}", area(&one));
    }

    #[test]
    fn a_line_takes_its_gap_out_of_a_shape() {
        let line = [DVec2::new(5.0, 10.0), DVec2::new(15.0, 10.0)];
        let left = Shapes::of([&square(0.0, 20.0)[..]]).unwrap().away_from([&line[..]], 2.0, 1e-3).unwrap();
        let near = 40.0 + 4.0 * std::f64::consts::PI;
        assert!((area(&left) - (400.0 - near)).abs() < 0.05, "{}", area(&left));
        let nearest = left.borders().flatten().filter(|p| p.distance(line[0]) < 4.0).map(|p| p.distance(line[0]));
        assert!(nearest.fold(f64::INFINITY, f64::min) > 2.0 - 1e-5);
        // So does one of many corners that are on it.
        let many: Vec<DVec2> = (0..=5000).map(|k| line[0].lerp(line[1], f64::from(k) / 5000.0)).collect();
        let other = Shapes::of([&square(0.0, 20.0)[..]]).unwrap().away_from([&many[..]], 2.0, 1e-3).unwrap();
        assert!((area(&other) - area(&left)).abs() < 1e-6, "{} {}", area(&other), area(&left));
    }

    #[test]
    fn what_is_no_number_and_what_is_beyond_the_grid_is_told() {
        for x in [f64::NAN, f64::INFINITY, 1e200] {
            let corners = [DVec2::ZERO, DVec2::new(x, 0.0), DVec2::Y];
            assert_eq!(Shapes::of([&corners[..]]).err(), Some(OffsetError::TooLarge), "{x}");
        }
    }
}
