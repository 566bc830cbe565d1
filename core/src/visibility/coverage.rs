//! How many sheets a sight line meets that passes exactly through borders.
//!
//! A root on the border of a patch is worth a part of a sheet: the sector of directions on the screen that the patch
//! fills round the sight line, a half plane on an edge, less or more at a corner, the sector of its tangents at a pole.
//! The sectors of all patches that meet there add up. If every direction is covered the same number of times, so many
//! sheets are crossed, however many patches share them. If not, the sight line touches an open border or a crease at
//! which the surface turns back, and its count is not defined.

use core::f64::consts::TAU;

use alloc::vec::Vec;

use glam::DVec2;

/// Difference of direction, in radians, below which two borders are one: tangents of the same border taken from two
/// patches agree to rounding, a few units of 1e-16 over the sine of the Jacobian, which is above 1e-9 for a hit that is
/// not grazing.
pub(super) const SAME_DIRECTION: f64 = 1e-6;

/// Directions counterclockwise from `from` to `to`, neither normalised nor zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sector {
    pub(super) from: DVec2,
    pub(super) to: DVec2,
}

impl Sector {
    /// The half plane on the left of `direction`.
    pub(super) fn left_of(direction: DVec2) -> Self {
        Self { from: direction, to: -direction }
    }

    /// The sector spanned by `a` and `b` that is narrower than half a turn.
    pub(super) fn between(a: DVec2, b: DVec2) -> Self {
        if a.perp_dot(b) >= 0.0 { Self { from: a, to: b } } else { Self { from: b, to: a } }
    }
}

/// How often the sectors cover the directions: the smallest and the largest count. Borders whose directions differ by no more
/// than `same`, in radians, are one. `events` is scratch.
pub(super) fn coverage(sectors: &[Sector], same: f64, events: &mut Vec<f64>) -> (u32, u32) {
    let angle = |d: DVec2| libm::atan2(d.y, d.x);
    events.clear();
    events.extend(sectors.iter().flat_map(|s| [angle(s.from), angle(s.to)]));
    events.sort_unstable_by(f64::total_cmp);
    let Some(&first) = events.first() else { return (0, 0) };
    events.push(first + TAU);
    let (mut low, mut high) = (u32::MAX, 0);
    for gap in events.windows(2) {
        if gap[1] - gap[0] <= same {
            continue;
        }
        let middle = 0.5 * (gap[0] + gap[1]);
        let covers = |s: &Sector| {
            let from = angle(s.from);
            let width = turn(angle(s.to) - from);
            // A sector without width may come out as a full turn.
            width < TAU - same && turn(middle - from) < width
        };
        let n = sectors.iter().filter(|s| covers(s)).count() as u32;
        low = low.min(n);
        high = high.max(n);
    }
    (low.min(high), high)
}

/// The angle in [0, 2π); the argument is a difference of two results of atan2, or off that by half a turn.
fn turn(mut angle: f64) -> f64 {
    while angle < 0.0 {
        angle += TAU;
    }
    while angle >= TAU {
        angle -= TAU;
    }
    angle
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(angle: f64) -> DVec2 {
        DVec2::new(libm::cos(angle), libm::sin(angle))
    }

    fn count(sectors: &[Sector]) -> (u32, u32) {
        coverage(sectors, SAME_DIRECTION, &mut Vec::new())
    }

    #[test]
    fn nothing_covers_nothing() {
        assert_eq!(count(&[]), (0, 0));
    }

    #[test]
    fn two_halves_make_a_sheet_and_one_does_not() {
        for k in 0..16 {
            let d = at(0.4 * f64::from(k));
            let (a, b) = (Sector::left_of(d), Sector::left_of(-3.0 * d));
            assert_eq!(count(&[a, b]), (1, 1));
            assert_eq!(count(&[a, b, b, a]), (2, 2));
            assert_eq!(count(&[a]), (0, 1));
            assert_eq!(count(&[a, a]), (0, 2), "a crease seen from its side");
        }
    }

    #[test]
    fn corners_of_any_valence_close() {
        for n in 3..9 {
            let step = TAU / f64::from(n);
            let mut fan: Vec<Sector> = (0..n)
                .map(|k| Sector::between(at(0.3 + step * f64::from(k)), at(0.3 + step * f64::from(k + 1) + 1e-12)))
                .collect();
            assert_eq!(count(&fan), (1, 1));
            fan.pop();
            assert_eq!(count(&fan), (0, 1));
        }
    }
}
