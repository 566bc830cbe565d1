//! Which line a wrong place comes from: the only one of which a byte that was lost, doubled or changed leads there.

/// Bytes that a changed byte is tried to be: those that lines are made of, and one that begins a comment.
const CHANGED: &[u8] = b"0123456789.-GXYZIJFMS(";
/// Most bytes of lines that are tried; a moment's work.
const BYTES_MAX: usize = 200_000;

/// A line as it was sent.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line<'a> {
    pub(super) text: &'a str,
    /// Whether its coordinates are differences.
    pub(super) relative: bool,
    /// x and y before it, mm.
    pub(super) before: [Option<f64>; 2],
}

/// Index of the one line that explains by a single byte why the machine is `off` (mm) from where the lines lead; none if there
/// is no such line, or more than one. `near` is how far off an explanation may be, mm.
pub(super) fn culprit(lines: &[Line<'_>], off: [f64; 2], near: f64) -> Option<usize> {
    if lines.iter().map(|line| line.text.len()).sum::<usize>() > BYTES_MAX {
        return None;
    }
    // What follows an absolute coordinate forgets what was before it.
    let mut forgotten = [false; 2];
    let mut found = None;
    for (index, line) in lines.iter().enumerate().rev() {
        let Some(words) = coordinates(line.text) else { continue };
        if explains(line, words, forgotten, off, near) {
            if found.is_some() {
                return None;
            }
            found = Some(index);
        }
        for (forgotten, word) in forgotten.iter_mut().zip(words) {
            *forgotten |= word.is_some() && !line.relative;
        }
    }
    found
}

/// Whether some single byte of a line explains it.
fn explains(line: &Line<'_>, words: [Option<f64>; 2], forgotten: [bool; 2], off: [f64; 2], near: f64) -> bool {
    let leads = |changed: [Option<f64>; 2]| {
        (0..2).all(|axis| {
            let by = if forgotten[axis] {
                0.0
            } else if line.relative {
                changed[axis].unwrap_or(0.0) - words[axis].unwrap_or(0.0)
            } else {
                let place = |word: Option<f64>| word.or(line.before[axis]);
                match (place(changed[axis]), place(words[axis])) {
                    (Some(changed), Some(wanted)) => changed - wanted,
                    (None, None) => 0.0,
                    _ => return false,
                }
            };
            (by - off[axis]).abs() < near
        })
    };
    let text = line.text.as_bytes();
    // All of it, as when a byte before it begins a comment.
    if words != [None; 2] && leads([None; 2]) {
        return true;
    }
    let mut changed = Vec::with_capacity(text.len() + 1);
    let mut tried = |change: &dyn Fn(&mut Vec<u8>)| {
        changed.clear();
        changed.extend_from_slice(text);
        change(&mut changed);
        std::str::from_utf8(&changed).ok().and_then(coordinates).is_some_and(&leads)
    };
    (0..text.len()).any(|at| {
        tried(&|line| {
            line.remove(at);
        }) || tried(&|line| line.insert(at, text[at]))
            || CHANGED.iter().any(|byte| *byte != text[at] && tried(&|line| line[at] = *byte))
    })
}

/// x and y in a line; none if the controller refuses it.
fn coordinates(text: &str) -> Option<[Option<f64>; 2]> {
    let text = text.split('(').next().unwrap_or_default();
    let mut found = [None; 2];
    let mut rest = text;
    while let Some(letter) = rest.chars().next() {
        if !letter.is_ascii_uppercase() {
            return None;
        }
        let after = rest.get(1..)?;
        let end = after.find(|c: char| c.is_ascii_uppercase()).unwrap_or(after.len());
        let (number, next) = after.split_at(end);
        let value: f64 = number.parse().ok()?;
        match letter {
            'X' if found[0].is_none() => found[0] = Some(value),
            'Y' if found[1].is_none() => found[1] = Some(value),
            'X' | 'Y' => return None,
            _ => {}
        }
        rest = next;
    }
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(lines: &[(&str, bool)], off: [f64; 2]) -> Option<usize> {
        let lines: Vec<Line<'_>> = lines
            .iter()
            .map(|(text, relative)| Line { text, relative: *relative, before: [Some(1.0), Some(2.0)] })
            .collect();
        culprit(&lines, off, 0.003)
    }

    #[test]
    fn the_line_at_fault_is_found_when_it_is_the_only_one() {
        let stroke = [("G1X1.5Y-2F2000", true), ("X20.25Y0", true), ("G1X-3.25Y0.125", true), ("G1G90M3S0", true)];
        let table = [
            // A digit lost: 2.25 instead of 20.25.
            ([-18.0, 0.0], Some(1)),
            // A digit doubled: -22.
            ([0.0, -20.0], Some(0)),
            // A sign lost.
            ([6.5, 0.0], Some(2)),
            // A line lost.
            ([-1.5, 2.0], Some(0)),
            // Nothing explains it.
            ([0.37, 0.0], None),
            ([3.3, 4.4], None),
        ];
        for (off, expected) in table {
            assert_eq!(found(&stroke, off), expected, "{off:?}");
        }
        // Two lines that explain it are none.
        assert_eq!(found(&[("X1Y0", true), ("X1Y0", true)], [-1.0, 0.0]), None);
    }

    #[test]
    fn only_the_last_absolute_coordinates_matter() {
        let travel = [("G0X10Y20", false), ("G0X30", false)];
        assert_eq!(found(&travel, [-27.0, 0.0]), Some(1));
        assert_eq!(found(&travel, [0.0, -18.0]), Some(0));
        // The line lost: it stays where it was before.
        assert_eq!(found(&[("G0X10Y20", false)], [-9.0, -18.0]), Some(0));
    }
}
