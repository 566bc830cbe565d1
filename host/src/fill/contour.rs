//! Lines that follow the contours of regions, one within the other.
//!
//! ```text
//!   +-------------------+
//!   | +---------------+ |    the first ring keeps the gap from all outlines, each further one the pitch
//!   | | +-----------+ | |    from the one before it, until nothing is left
//!   | | +-----------+ | |
//!   | +---------------+ |
//!   +-------------------+
//! ```

use glam::DVec2;

use super::offset::{OffsetError, Shapes};
use super::{Area, Fill};

/// Share of the tolerance, and of the pitch, by which a ring may be off for its having few corners. It adds up from ring to ring.
const THIN: f64 = 1.0 / 32.0;

/// A closed line about what it encloses, or about a hole.
#[derive(Clone, Debug, PartialEq)]
pub struct Ring {
    /// How many rings there are between it and the outline.
    pub number: i64,
    /// Its corners in mm; the last is the first.
    pub page: Vec<DVec2>,
}

/// The rings inside areas, which are those of one fill. Areas that meet at smooth joins are one, and the lines that bound them otherwise, or that are drawn inside
/// them, are what rings go along: none is nearer to one of these than the gap of the fill, and each one farther in is a pitch from what it
/// follows. Borders and outlines are within `tolerance_mm` of what they stand for. Where `stops` says so, the rest is left out.
///
/// Cost: O(n log n) a pitch of depth, in the corners that are left there.
///
/// # Errors
/// If areas are no numbers, or farther out than offsets can be found.
pub fn rings(
    areas: &[&Area],
    outlines: &[&[DVec2]],
    fill: &Fill,
    tolerance_mm: f64,
    stops: &dyn Fn() -> bool,
) -> Result<Vec<Ring>, OffsetError> {
    let loops = || areas.iter().flat_map(|area| &area.loops);
    // The two sides of a smooth join have chords of their own; what lies between is inside.
    let whole = Shapes::of(loops().map(|own| &own.points[..]))?.closed(tolerance_mm)?;
    let walls: Vec<Vec<DVec2>> = loops().flat_map(super::Loop::walls).collect();
    let walls = walls.iter().map(|wall| &wall[..]).chain(outlines.iter().copied());
    let chord = THIN * tolerance_mm.min(fill.pitch_mm);
    // At no gap the outlines inside are still walls.
    let mut inside = whole.away_from(walls, fill.gap_mm.max(tolerance_mm), chord)?;
    let mut rings = Vec::new();
    for number in 0.. {
        if inside.is_empty() || stops() {
            break;
        }
        inside = inside.thinned(chord);
        rings.extend(inside.borders().map(|page| Ring { number, page }));
        inside = inside.shrunk(fill.pitch_mm, chord)?;
    }
    Ok(rings)
}

#[cfg(test)]
mod tests {
    use penvis_core::extract::adaptive::Direction;
    use proptest::prelude::*;

    use super::super::testing::{corner, distance, winds};
    use super::super::{FillKind, Loop};
    use super::*;

    fn fill(pitch_mm: f64, gap_mm: f64) -> Fill {
        Fill { kind: FillKind::Contour, degrees: 0.0, pitch_mm, gap_mm, direction: Direction::Auto, pen: 1 }
    }

    fn area(surface: usize, loops: &[Loop]) -> Area {
        Area { surface, loops: loops.to_vec() }
    }

    fn found(areas: &[&Area], outlines: &[&[DVec2]], fill: &Fill) -> Vec<Ring> {
        let rings = rings(areas, outlines, fill, 0.01, &|| false).unwrap();
        assert!(rings.iter().all(|ring| ring.page.first() == ring.page.last() && ring.page.len() > 3));
        rings
    }

    fn length(ring: &Ring) -> f64 {
        ring.page.windows(2).map(|w| w[0].distance(w[1])).sum()
    }

    fn rectangle([left, low]: [f64; 2], [right, high]: [f64; 2]) -> Vec<DVec2> {
        [[left, low], [right, low], [right, high], [left, high]].map(DVec2::from).to_vec()
    }

    #[test]
    fn a_square_is_filled_by_squares() {
        let square = area(0, &[Loop::bordered(rectangle([0.0, 0.0], [20.0, 20.0]))]);
        let rings = found(&[&square], &[], &fill(2.0, 0.5));
        let sides: Vec<f64> = rings.iter().map(|ring| length(ring) / 4.0).collect();
        for (side, want) in sides.iter().zip([19.0, 15.0, 11.0, 7.0, 3.0]) {
            assert!((side - want).abs() < 2e-3, "{sides:?}");
        }
        assert_eq!(rings.iter().map(|ring| ring.number).collect::<Vec<_>>(), [0, 1, 2, 3, 4]);
    }

    #[test]
    fn rings_of_a_disk_are_circles_and_stay_few_cornered() {
        let circle = |r: f64| -> Vec<DVec2> {
            (0..720).map(|k| DVec2::from_angle(f64::from(k) * std::f64::consts::TAU / 720.0) * r).collect()
        };
        let hole: Vec<DVec2> = circle(10.0).into_iter().rev().collect();
        // Inwards the rings have fewer corners, and about the hole, outwards, no more than their chords need.
        let ring = area(0, &[Loop::bordered(circle(60.0)), Loop::bordered(hole)]);
        let rings = found(&[&ring], &[], &fill(0.5, 0.25));
        assert_eq!(rings.len(), 100);
        for ring in &rings {
            let step = 0.25 + 0.5 * ring.number as f64;
            let off = |r: f64| ring.page.iter().map(|p| (p.length() - r).abs()).fold(0.0, f64::max);
            let off = off(60.0 - step).min(off(10.0 + step));
            assert!(off < 0.02, "{}: {off}", ring.number);
            assert!(ring.page.len() < 900, "{}: {} corners", ring.number, ring.page.len());
        }
    }

    #[test]
    fn rings_go_on_over_smooth_joins_and_round_lines_that_are_drawn_inside() {
        // The join is not there twice at the same place, as its two sides are chords of their own.
        let half = |[left, low]: [f64; 2], [right, high]: [f64; 2], join: usize| {
            let smooth = (0..4).map(|side| side == join).collect();
            Loop { points: rectangle([left, low], [right, high]), smooth }
        };
        let left = area(3, &[half([0.0, 0.0], [9.993, 20.0], 1)]);
        let right = area(4, &[half([10.005, 0.0], [20.0, 20.0], 3)]);
        let rings = found(&[&left, &right], &[], &fill(3.0, 1.0));
        assert_eq!(rings.len(), 3);
        assert!((length(&rings[0]) - 72.0).abs() < 1e-2, "{}", length(&rings[0]));
        // A line from the border to the middle is gone round: it is not crossed, and it keeps its gap beyond its end.
        let line = [DVec2::new(10.0, -1.0), DVec2::new(10.0, 10.0)];
        let rings = found(&[&left, &right], &[&line], &fill(3.0, 1.0));
        let own = rings.iter().flat_map(|ring| &ring.page);
        let nearest = own.map(|p| p.distance(DVec2::new(10.0, p.y.min(10.0)))).fold(f64::INFINITY, f64::min);
        assert!((1.0 - 1e-4..1.01).contains(&nearest), "{nearest}");
        assert!((length(&rings[0]) - (72.0 - 2.0 + 2.0 * 9.0 + std::f64::consts::PI)).abs() < 0.02);
        // Where there is no gap, a line is no less a border.
        let tight = found(&[&left, &right], &[&line], &fill(3.0, 0.0));
        assert!(tight.iter().flat_map(|ring| ring.page.windows(2)).all(|w| {
            let crosses = (w[0].x - 10.0) * (w[1].x - 10.0) < 0.0;
            !crosses || w[0].y.max(w[1].y) > 9.9
        }));
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        #[test]
        fn rings_are_as_far_from_all_lines_as_their_number_says_and_none_is_missing(
            corners in prop::collection::vec(corner(), 3..9),
            second in prop::collection::vec(corner(), 3..6),
            inner in prop::collection::vec(corner(), 2..4),
            gap in prop_oneof![Just(0.0), 0.05..0.7f64],
            pitch in 0.2..0.9f64,
        ) {
            let loops = [Loop::bordered(corners), Loop::bordered(second)];
            let own = area(0, &loops);
            let mut walls: Vec<[DVec2; 2]> = loops.iter().flat_map(Loop::sides).map(|(side, _)| side).collect();
            walls.extend(inner.windows(2).map(|w| [w[0], w[1]]));
            let away = |p: DVec2| walls.iter().map(|w| distance(p, *w)).fold(f64::INFINITY, f64::min);
            let fill = fill(pitch, gap);
            let rings = found(&[&own], &[&inner], &fill);
            let first = gap.max(0.01);
            for ring in &rings {
                let want = first + pitch * ring.number as f64;
                for w in ring.page.windows(2) {
                    for k in 0..4 {
                        let p = w[0].lerp(w[1], f64::from(k) / 4.0);
                        // Each ring may be off by its chords, and by the corners that it lacks.
                        let off = 2e-3 + 7e-4 * ring.number as f64;
                        prop_assert!((away(p) - want).abs() < off, "ring {} at {p}: {} of {want}", ring.number, away(p));
                        prop_assert!(winds(p, &loops), "{p} is outside");
                    }
                }
            }
            // From any place the way to what is nearest of all lines crosses the ring that lies before it.
            for k in 0..400 {
                let p = DVec2::new(f64::from(k % 20) + 0.317, f64::from(k / 20) + 0.271) * 0.6;
                let far = away(p);
                if far < first + 0.05 || !winds(p, &loops) {
                    continue;
                }
                let number = ((far - 0.02 - first) / pitch).floor();
                let own = rings.iter().filter(|ring| ring.number as f64 == number);
                let nearest = own.flat_map(|r| r.page.windows(2)).map(|w| distance(p, [w[0], w[1]])).fold(f64::INFINITY, f64::min);
                prop_assert!(nearest < far - first - pitch * number + 0.03, "{p}: ring {number} is {nearest} away");
            }
        }
    }
}
