//! Parallel lines inside shapes.
//!
//! The lines of a hatching are those of one grid on the whole sheet, so that what ends at a join goes on beyond it:
//!
//! ```text
//!    line 3  ----------------------------
//!    line 2  ------[=====]--------[===]--    runs: the parts inside
//!    line 1  ---[===========]------[=]---
//!    line 0  ----------------------------    through the corner of the sheet
//! ```

use glam::DVec2;

use super::area::Loop;

/// Equally distant parallel lines, numbered across; line 0 goes through the lower left corner of the sheet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Unit vector along the lines.
    along: DVec2,
    /// Distance of neighbours in mm, positive.
    pitch_mm: f64,
}

/// A part of a line of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// Number of the line.
    pub line: i64,
    /// Where along the line it begins and ends, in mm from the foot of the sheet's corner.
    pub along: [f64; 2],
    /// Which of its ends lie on a smooth join.
    pub joins: [bool; 2],
}

impl Run {
    /// Its length in mm.
    #[must_use]
    pub fn length_mm(&self) -> f64 {
        self.along[1] - self.along[0]
    }
}

impl Grid {
    /// Lines at an angle, in degrees counter-clockwise from the lower side of the sheet, and their distance in mm, positive.
    #[must_use]
    pub fn new(degrees: f64, pitch_mm: f64) -> Self {
        // Lines along the axes are so to the bit, and so are their numbers.
        let quarter = degrees.rem_euclid(180.0);
        let along = if quarter == 0.0 {
            DVec2::X
        } else if quarter == 90.0 {
            DVec2::Y
        } else {
            DVec2::from_angle(quarter.to_radians())
        };
        Self { along, pitch_mm }
    }

    /// Its lines farther apart, so that of their ink there is only a share, more than 0.
    pub(super) fn spread(&self, share: f64) -> Self {
        Self { pitch_mm: self.pitch_mm / share, ..*self }
    }

    /// Distance of neighbours in mm.
    pub(super) fn pitch_mm(&self) -> f64 {
        self.pitch_mm
    }

    /// A place in the frame of the grid: along the lines, and across.
    #[must_use]
    pub fn frame(&self, p: DVec2) -> DVec2 {
        DVec2::new(self.along.dot(p), self.along.perp_dot(p))
    }

    /// The place on a line, so far along it.
    #[must_use]
    pub fn place(&self, line: i64, along: f64) -> DVec2 {
        self.along * along + self.along.perp() * self.across(line)
    }

    /// How far across a line lies.
    #[must_use]
    pub fn across(&self, line: i64) -> f64 {
        line as f64 * self.pitch_mm
    }

    /// The lines that lie at `low` across or farther, but not at `high`.
    pub(super) fn lines(&self, [low, high]: [f64; 2]) -> impl Iterator<Item = i64> {
        let mut first = (low / self.pitch_mm).ceil() as i64;
        // The quotient is rounded; what counts is the line itself.
        while self.across(first - 1) >= low {
            first -= 1;
        }
        while self.across(first) < low {
            first += 1;
        }
        let grid = *self;
        (first..).take_while(move |&line| grid.across(line) < high)
    }
}

/// A line of a grid crosses a side.
struct Crossing {
    line: i64,
    along: f64,
    /// 1 if the side comes from below, -1 from above.
    turn: i32,
    joins: bool,
}

/// The parts of the lines inside loops, by the nonzero rule, line by line and along each. They end on the sides exactly, but for
/// rounding. A corner that lies on a line belongs to what is above it, and so does a side along a line.
///
/// Cost: O(n log n) in the crossings of lines and sides.
#[must_use]
pub fn hatch(loops: &[Loop], grid: &Grid) -> Vec<Run> {
    let mut crossings = Vec::new();
    for ([a, b], joins) in loops.iter().flat_map(Loop::sides) {
        let (a, b) = (grid.frame(a), grid.frame(b));
        // The same from both of its ends, so that a side that is there twice is crossed at one place.
        let ([low, high], turn) = if a.y <= b.y { ([a, b], 1) } else { ([b, a], -1) };
        for line in grid.lines([low.y, high.y]) {
            let share = (grid.across(line) - low.y) / (high.y - low.y);
            crossings.push(Crossing { line, along: low.x + share * (high.x - low.x), turn, joins });
        }
    }
    crossings.sort_unstable_by(|a, b| a.line.cmp(&b.line).then(a.along.total_cmp(&b.along)));
    let mut runs: Vec<Run> = Vec::new();
    for own in crossings.chunk_by(|a, b| a.line == b.line) {
        let mut winding = 0;
        for pair in own.windows(2) {
            let [from, to] = pair else { continue };
            winding += from.turn;
            if winding == 0 || to.along <= from.along {
                continue;
            }
            match runs.last_mut() {
                // Sides at one place, as where a closed surface is cut: the inside goes on.
                Some(last) if last.line == from.line && last.along[1] == from.along => {
                    (last.along[1], last.joins[1]) = (to.along, to.joins);
                }
                _ => {
                    let (along, joins) = ([from.along, to.along], [from.joins, to.joins]);
                    runs.push(Run { line: from.line, along, joins });
                }
            }
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(low: f64, high: f64) -> Loop {
        Loop::bordered([[low, low], [high, low], [high, high], [low, high]].map(DVec2::from).to_vec())
    }

    fn reversed(mut own: Loop) -> Loop {
        own.points.reverse();
        own
    }

    #[test]
    fn a_square_with_a_hole_is_hatched_on_either_side_of_it() {
        let loops = [square(0.0, 10.0), reversed(square(4.0, 6.0))];
        let runs = hatch(&loops, &Grid::new(0.0, 1.0));
        let on = |line: i64| runs.iter().filter(|r| r.line == line).map(|r| r.along).collect::<Vec<_>>();
        assert_eq!(on(3), [[0.0, 10.0]]);
        // A side along a line belongs to what is above it.
        assert_eq!(on(4), [[0.0, 4.0], [6.0, 10.0]]);
        assert_eq!(on(6), [[0.0, 10.0]]);
        assert_eq!((on(0).len(), on(10).len()), (1, 0));
        let total: f64 = runs.iter().map(Run::length_mm).sum();
        assert!((total - 96.0).abs() < 1e-12, "{total}");
    }

    #[test]
    fn lines_through_corners_see_a_square_on_its_tip_whole() {
        let tip = Loop::bordered([[5.0, 0.0], [10.0, 5.0], [5.0, 10.0], [0.0, 5.0]].map(DVec2::from).to_vec());
        for degrees in [0.0, 90.0, 180.0, -90.0] {
            let runs = hatch(std::slice::from_ref(&tip), &Grid::new(degrees, 2.5));
            let lengths: Vec<f64> = runs.iter().map(Run::length_mm).collect();
            // At the lower tip the line meets nothing but a point.
            assert_eq!(lengths, [5.0, 10.0, 5.0], "{degrees}");
        }
    }

    #[test]
    fn a_place_is_found_again_at_any_angle() {
        for degrees in [0.0, 30.0, 45.0, 90.0, 123.0, -20.0] {
            let grid = Grid::new(degrees, 0.35).spread(0.5);
            let p = grid.place(17, 3.25);
            assert!((grid.frame(p) - DVec2::new(3.25, 17.0 * 0.7)).length() < 1e-12, "{degrees}");
        }
    }

    #[test]
    fn a_cut_along_which_a_shape_goes_on_ends_no_line() {
        let (left, right) = (square(0.0, 2.0), square(2.0, 4.0));
        let shift = |own: Loop| Loop { points: own.points.iter().map(|p| *p - DVec2::Y * 2.0).collect(), ..own };
        let runs = hatch(&[left, shift(right)], &Grid::new(0.0, 0.5));
        assert_eq!(runs.len(), 4);
        assert!(runs.iter().all(|r| r.along == [0.0, 4.0]));
    }

    #[test]
    fn the_ink_of_a_shape_with_ten_thousand_sides_is_its_area_over_the_pitch() {
        let star = |k: i32| {
            let r = if k % 2 == 0 { 100.0 } else { 60.0 };
            DVec2::from_angle(f64::from(k) * std::f64::consts::TAU / 10_000.0) * r + 120.0
        };
        let own = Loop::bordered((0..10_000).map(star).collect());
        let area: f64 = own.sides().map(|([a, b], _)| 0.5 * a.perp_dot(b)).sum();
        let runs = hatch(std::slice::from_ref(&own), &Grid::new(17.0, 0.2));
        let ink: f64 = runs.iter().map(Run::length_mm).sum();
        assert!((ink * 0.2 - area).abs() < 1e-3 * area, "{ink} {area}");
    }
}
