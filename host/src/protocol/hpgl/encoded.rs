//! Polylines in `PE`, as HP-GL/2 plotters take them.
//!
//! ```text
//!  PD;PR12,0,8,-3;      in ASCII digits
//!  PE7wo_qkf... ;       the same encoded
//! ```
//!
//! Written is base 32 (flag `7`), which passes lines of seven bits, text editors and handshakes alike: of a number n the code is 2n, or
//! 2|n| + 1 where n is negative, and its digits of five bits go out the lowest first, as 63 + digit, the last as 95 + digit. Points are
//! increments, and the pen draws all of them. Read is all that `PE` may hold but binary fractions. Source: Hewlett-Packard,
//! *The HP-GL/2 and HP RTL Reference Guide*, "PE, Polyline Encoded".

use std::fmt::Write as _;

use penvis_firmware::{Encoded, EncodedPiece};

use crate::trace::hpgl::State;

/// Begins an instruction whose coordinates are in base 32.
pub(crate) const BEGIN: &str = "PE7";

/// Most points in a list that an encoded one becomes: a job goes on behind an instruction, not within it.
const LIST_POINTS: usize = 64;

/// Bytes of an increment.
pub(crate) fn length(step: [i64; 2]) -> usize {
    step.map(|n| (code(n).checked_ilog2().unwrap_or(0) / 5 + 1) as usize).iter().sum()
}

/// Appends an increment.
pub(crate) fn push(text: &mut String, step: [i64; 2]) {
    for n in step {
        let mut code = code(n);
        while code > 31 {
            text.push(char::from(63 + (code & 31) as u8));
            code >>= 5;
        }
        text.push(char::from(95 + code as u8));
    }
}

fn code(n: i64) -> u64 {
    (n.unsigned_abs() << 1) | u64::from(n < 0)
}

/// A job's instructions with those of each `PE` that can be followed in its place. Where there is none, nothing is followed.
pub(super) fn written_out(instructions: Vec<Vec<u8>>) -> Vec<Vec<u8>> {
    let is_encoded = |instruction: &[u8]| instruction.get(..2).is_some_and(|word| word.eq_ignore_ascii_case(b"PE"));
    if !instructions.iter().any(|instruction| is_encoded(instruction)) {
        return instructions;
    }
    let mut state = State::unknown();
    let written_out = |instruction: Vec<u8>| {
        let plain = if is_encoded(&instruction) { plain(&instruction, state) } else { None };
        let plain = plain.unwrap_or_else(|| vec![instruction]);
        plain.iter().for_each(|instruction| {
            state.follow(instruction);
        });
        plain
    };
    instructions.into_iter().flat_map(written_out).collect()
}

/// The instructions `PU`, `PD` and `SP` that a `PE` stands for, in the mode (`PA` or `PR`) that the plotter is in and stays in; none where
/// that, or the place of the pen, is not known, or the instruction holds what is no point in whole plotter units.
fn plain(instruction: &[u8], mut state: State) -> Option<Vec<Vec<u8>>> {
    let parameters = instruction.get(2..)?;
    let parameters = parameters.strip_suffix(b";").unwrap_or(parameters);
    let absolute = state.absolute.filter(|_| state.is_plain())?;
    let mut at = state.at?;
    let (mut encoded, mut lists) = (Encoded::default(), Vec::new());
    let mut list = (String::new(), 0);
    for byte in parameters {
        match encoded.take(*byte) {
            EncodedPiece::None => {}
            EncodedPiece::Bad => return None,
            EncodedPiece::Pen(pen) => {
                let pen = whole(pen).filter(|pen| *pen >= 0)?;
                lists.push(std::mem::take(&mut list).0);
                lists.push(format!("SP{pen}"));
            }
            EncodedPiece::Point { at: [x, y], absolute: there, down } => {
                let [x, y] = [whole(x)?, whole(y)?];
                let to = if there { [x, y] } else { [at[0].checked_add(x)?, at[1].checked_add(y)?] };
                let begin = if down { "PD" } else { "PU" };
                if !list.0.starts_with(begin) || list.1 == LIST_POINTS {
                    lists.push(std::mem::replace(&mut list, (begin.to_owned(), 0)).0);
                }
                let [a, b] = if absolute { to } else { [to[0] - at[0], to[1] - at[1]] };
                let comma = if list.1 > 0 { "," } else { "" };
                // Writing to a string cannot fail.
                let _ = write!(list.0, "{comma}{a},{b}");
                list.1 += 1;
                at = to;
            }
        }
    }
    lists.push(list.0);
    let lists = lists.into_iter().filter(|list| !list.is_empty()).map(|list| format!("{list};").into_bytes());
    let lists: Vec<_> = lists.collect();
    // Coordinates that are out of a plotter's range are its own affair.
    lists.iter().for_each(|list| {
        state.follow(list);
    });
    (state.at == Some(at)).then_some(lists)
}

fn whole(value: f64) -> Option<i64> {
    (value.fract() == 0.0 && value.abs() <= f64::from(i32::MAX)).then_some(value as i64)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn encoded(steps: &[[i64; 2]]) -> String {
        let mut text = BEGIN.to_owned();
        steps.iter().for_each(|step| push(&mut text, *step));
        text + ";"
    }

    fn after(hpgl: &[&[u8]]) -> State {
        let mut state = State::unknown();
        hpgl.iter().for_each(|instruction| {
            state.follow(instruction);
        });
        state
    }

    fn text(lists: Option<Vec<Vec<u8>>>) -> Option<String> {
        lists.map(|lists| String::from_utf8(lists.concat()).unwrap())
    }

    #[test]
    fn numbers_are_encoded_as_the_manual_says() {
        // 0 is the last digit 0; 15 the last digit 30; 16 is 32: digit 0, then last digit 1; -1 is 3.
        assert_eq!(encoded(&[[0, 15], [16, -1]]), "PE7_}?`b;");
        for step in [[0, 0], [15, -15], [16, -16], [511, 512], [-32_767, 32_767]] {
            assert_eq!(encoded(&[step]).len(), "PE7;".len() + length(step), "{step:?}");
        }
    }

    #[test]
    fn what_is_encoded_is_written_out_in_the_mode_of_the_job() {
        let absolute = after(&[b"IN;", b"PU10,20;"]);
        let relative = after(&[b"IN;", b"PU10,20;", b"PR;"]);
        let steps = encoded(&[[5, 0], [0, -7]]);
        let lists = |state| text(plain(steps.as_bytes(), state));
        assert_eq!(lists(absolute).unwrap(), "PD15,20,15,13;");
        assert_eq!(lists(relative).unwrap(), "PD5,0,0,-7;");
        // With the pen up to a place, and another pen, in base 64.
        let flags = [&b"PE<="[..], &[191 + 8, 191 + 9], &[b':', 191 + 4, 191 + 2, 191 + 3], b";"].concat();
        assert_eq!(text(plain(&flags, absolute)).unwrap(), "PU4,-4;SP2;PD5,-5;");
        assert_eq!(text(plain(b"PE;", absolute)).unwrap(), "");
        // Unknown place, unknown mode, user units, fractions, far away, nonsense.
        let fraction = [&b"PE7>"[..], b"a__", b";"].concat();
        for (bytes, state) in [
            (steps.as_bytes(), after(&[b"IN;"])),
            (steps.as_bytes(), after(&[b"PU1,1;"])),
            (steps.as_bytes(), after(&[b"IN;", b"PU1,1;", b"SC0,1,0,1;"])),
            (encoded(&[[32_760, 0]]).as_bytes(), absolute),
            (&[b'P', b'E', 170, b';'], absolute),
        ] {
            assert_eq!(plain(bytes, state), None, "{}", String::from_utf8_lossy(bytes));
        }
        // One half.
        assert!(plain(&fraction, absolute).is_some());
        assert_eq!(plain(&[&b"PE7>a"[..], b"a_;"].concat(), absolute), None);
    }

    proptest! {
        #[test]
        fn points_come_back(steps in prop::collection::vec([-300_i64..300, -300_i64..300], 1..200), far: bool) {
            let state = after(&[b"IN;", b"PA0,0;", if far { b"PR;" } else { b"PA;" }]);
            let lists = plain(encoded(&steps).as_bytes(), state).unwrap();
            let mut there = state;
            let mut points = Vec::new();
            for list in &lists {
                if let crate::trace::hpgl::Action::Move(motion) = there.follow(list) {
                    prop_assert_eq!(motion.lowers, Some(true));
                    if let crate::trace::hpgl::Path::Through(through) = motion.path {
                        points.extend(through);
                    }
                }
            }
            let mut at = [0, 0];
            let expected: Vec<_> = steps.iter().map(|[x, y]| { at = [at[0] + x, at[1] + y]; at }).collect();
            prop_assert_eq!(points, expected);
        }

        #[test]
        fn any_bytes_are_read(bytes in prop::collection::vec(any::<u8>(), 0..60)) {
            let _ = plain(&[&b"PE"[..], &bytes].concat(), after(&[b"IN;", b"PA0,0;"]));
        }
    }
}
