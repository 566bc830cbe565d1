//! Tones by lines that are there or not.
//!
//! Where it is darkest all lines of a grid are drawn, where it is half as dark every second one, and so on: a line has a level,
//! how often its number can be halved, and is drawn where it is darker than its level asks for. So lines end, and none moves.

/// Levels beyond the finest. Lines of the coarsest are 16 times as far apart as those of the finest.
const COARSEST: u32 = 4;

/// Darkness from which on all lines are drawn: midway between what all of them make and what every second one makes, so that the ink
/// is nowhere more than a third off.
const ALL: f64 = 0.75;

/// Darkness beyond which a line is drawn, by its number.
pub(super) fn threshold(line: i64) -> f64 {
    ALL / f64::from(1_u32 << line.trailing_zeros().min(COARSEST))
}

/// The parts of an interval in which `darkness` is more than a threshold. It is looked at in steps no longer than `step`, and
/// found to within `resolution` where it passes the threshold. Where it is not known it is as before.
pub(super) fn darker(
    [from, to]: [f64; 2],
    threshold: f64,
    [step, resolution]: [f64; 2],
    darkness: &mut dyn FnMut(f64) -> Option<f64>,
) -> Vec<[f64; 2]> {
    let count = ((to - from) / step).ceil().clamp(1.0, 1e6) as u32;
    let mut is_dark = |at: f64| darkness(at).map(|d| d > threshold);
    let looks: Vec<(f64, Option<bool>)> = (0..=count)
        .map(|k| if k == count { to } else { from + (to - from) * f64::from(k) / f64::from(count) })
        .map(|at| (at, is_dark(at)))
        .collect();
    // The ends may lie on a border, where nothing is known.
    let mut dark = looks.iter().find_map(|(_, dark)| *dark).unwrap_or_default();
    let mut begun = dark.then_some(from);
    let mut before = from;
    let mut parts = Vec::new();
    for (at, found) in looks {
        if let Some(now) = found.filter(|now| *now != dark) {
            let (mut low, mut high) = (before, at);
            while high - low > resolution {
                let middle = low.midpoint(high);
                if is_dark(middle).unwrap_or(dark) == dark { low = middle } else { high = middle }
            }
            let passes = low.midpoint(high);
            match begun.take() {
                Some(begun) => parts.push([begun, passes]),
                None => begun = Some(passes),
            }
            dark = now;
        }
        before = at;
    }
    parts.extend(begun.map(|begun| [begun, to]));
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_lines_are_drawn_as_it_is_dark_to_within_a_third() {
        for dark in 5..=100 {
            let dark = f64::from(dark) / 100.0;
            let drawn = (0..1600).filter(|&line| dark > threshold(line)).count();
            let share = drawn as f64 / 1600.0;
            assert!((share - dark).abs() <= dark / 3.0 + 1e-9, "{dark}: {share}");
        }
        assert!((-8..8).all(|line| threshold(line) >= ALL / 16.0));
    }

    #[test]
    fn a_line_ends_where_it_is_light() {
        let mut ramp = |x: f64| (x > 0.01).then_some((x - 3.0).abs() / 3.0);
        let parts = darker([0.0, 10.0], 0.5, [0.4, 1e-6], &mut ramp);
        assert_eq!(parts.len(), 2);
        for (found, want) in parts.iter().flatten().zip([0.0, 1.5, 4.5, 10.0]) {
            assert!((found - want).abs() < 1e-6, "{parts:?}");
        }
        assert_eq!(darker([0.0, 1.0], 0.5, [0.4, 1e-6], &mut |_| None), [[0.0; 2]; 0]);
    }
}
