//! Tones by lines that are there or not.
//!
//! Each line has a threshold, and is drawn where it is darker than that. Where it is half as dark as it gets every second line is drawn, where it is a quarter every
//! fourth one, and between these levels the lines of the one take turns: thresholds are the fractions whose binary digits are those of the line's number
//! the other way round (van der Corput's sequence). So the ink is as much as it is dark, neighbouring lines end in different places, as an
//! engraver's do, and none moves.

/// How many thresholds there are. Lines of the coarsest level are so many times as far apart as those of the finest.
const THRESHOLDS: u32 = 1 << u8::BITS;

/// Darkness beyond which a line is drawn, by its number.
pub(super) fn threshold(line: i64) -> f64 {
    let digits = line.rem_euclid(THRESHOLDS.into()) as u8;
    (f64::from(digits.reverse_bits()) + 0.5) / f64::from(THRESHOLDS)
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
    fn as_many_lines_are_drawn_as_it_is_dark() {
        for dark in 0..=200 {
            let dark = f64::from(dark) / 200.0;
            let share = |lines: std::ops::Range<i64>| {
                let count = lines.end - lines.start;
                lines.filter(|&line| dark > threshold(line)).count() as f64 / count as f64
            };
            // Of all lines, of those about the corner of the sheet, and of a few neighbours.
            assert!((share(-1280..1280) - dark).abs() <= 0.5 / 256.0 + 1e-12, "{dark}: {}", share(-1280..1280));
            for first in [-100, -7, 0, 33, 250] {
                assert!((share(first..first + 100) - dark).abs() < 0.04, "{dark} from {first}");
                assert!((share(first..first + 16) - dark).abs() <= 2.0 / 16.0, "{dark} from {first}");
            }
        }
        assert!((-300..300).all(|line| threshold(line) > 0.0 && threshold(line) < 1.0));
    }

    #[test]
    fn at_dyadic_darknesses_lines_are_equally_far_apart() {
        for level in 0..6 {
            let every = 1_i64 << level;
            let drawn: Vec<i64> = (-64..64).filter(|&line| 1.0 / every as f64 > threshold(line)).collect();
            assert!(drawn.windows(2).all(|w| w[1] - w[0] == every), "{level}: {drawn:?}");
        }
    }

    #[test]
    fn neighbouring_lines_end_in_different_places() {
        // On a ramp a line's end is where its threshold is: neighbours end a quarter of the ramp apart at least, and the next ones half of that.
        for line in -300..300 {
            for (next, apart) in [(1, 0.25), (2, 0.125)] {
                assert!((threshold(line) - threshold(line + next)).abs() >= apart, "{line} {next}");
            }
        }
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
