//! What is left of an HPGL job, behind the instructions that set what it goes by.
//!
//! Whatever a plotter was told to set (speeds, scaling points, character sets) is told again, in the same order; what draws is
//! not. The points that the overlap asks for are drawn by instructions of its own.

use glam::DVec2;

use super::Rest;
use crate::device::{Device, Hpgl};
use crate::protocol::hpgl::{Holders, Job};
use crate::trace::hpgl::{Action, Motion, Path, State, is_setting};

/// Where a job goes on.
struct Start {
    /// Index of the first instruction that is sent again.
    instruction: usize,
    /// What the plotter was told by then.
    state: State,
    at: [i64; 2],
    down: bool,
    /// Points of the stroke so far, where the pen is down: the last is `at`.
    stroke: Vec<[i64; 2]>,
}

/// The rest of a job of which `executed` instructions were carried out, with `overlap_mm` of the stroke drawn again in
/// which it was broken off.
#[must_use]
pub fn rest(job: &Job, executed: usize, overlap_mm: f64, device: &Device, language: &Hpgl) -> Rest {
    let instructions = job.instructions();
    let Some(start) = last_known(instructions, executed) else {
        return Rest { job: instructions.concat(), added: 0, skipped: 0 };
    };
    let (before, after) = instructions.split_at(start.instruction);
    let mut bytes: Vec<u8> = before.iter().filter(|instruction| is_setting(instruction)).flatten().copied().collect();
    let mut tell = String::new();
    let mut holders = Holders::new(device.pens);
    let _swaps = holders.follow(job, start.instruction).count();
    // Whoever goes on may have put the plotter's own pens back.
    for swap in holders.swaps().iter().filter(|swap| Some(swap.pen) != start.state.pen) {
        tell.push_str(&device.fill(&language.pen_change, swap.pen));
    }
    if let Some(pen @ 1..) = start.state.pen {
        tell.push_str(&device.fill(&language.pen_change, pen));
    }
    let overlap = if start.down { back(&start, overlap_mm / language.unit_mm) } else { vec![start.at] };
    let [x, y] = overlap.first().copied().unwrap_or(start.at);
    tell.push_str(&format!("PA;PU{x},{y};"));
    for list in overlap.get(1..).unwrap_or_default().chunks(language.list_points.max(1)) {
        let list: Vec<_> = list.iter().map(|[x, y]| format!("{x},{y}")).collect();
        tell.push_str(&format!("PD{};", list.join(",")));
    }
    if start.down && overlap.len() < 2 {
        tell.push_str("PD;");
    }
    if start.state.absolute == Some(false) {
        tell.push_str("PR;");
    }
    bytes.extend_from_slice(tell.as_bytes());
    // Cut as the protocol cuts it, whatever the profile's own instructions are.
    let added = Job::new(&bytes).map_or(0, |job| job.instructions().len());
    bytes.extend(after.iter().flatten());
    Rest { job: bytes, added, skipped: start.instruction }
}

/// The last place, no further than after so many instructions, at which it is known where the pen is.
fn last_known(instructions: &[Vec<u8>], executed: usize) -> Option<Start> {
    let mut state = State::unknown();
    let mut stroke: Vec<[i64; 2]> = Vec::new();
    let mut start = None;
    for (index, instruction) in instructions.iter().take(executed).enumerate() {
        let before = state;
        let action = state.follow(instruction);
        if state.down != Some(true) || state.at.is_none() {
            stroke.clear();
        } else if let Action::Move(Motion { path: Path::Through(points), .. }) = &action {
            if before.down != Some(true) || stroke.is_empty() {
                stroke = before.at.into_iter().collect();
            }
            stroke.extend(points);
        } else if stroke.is_empty() {
            stroke.extend(state.at);
        }
        let (Some(at), Some(down)) = (state.at, state.down) else { continue };
        // A pattern of dashes cannot be begun in its middle.
        if state.is_plain() && (state.is_solid() || !down) {
            start = Some((index + 1, state, at, down, stroke.len()));
        }
    }
    let (instruction, state, at, down, points) = start?;
    // What was drawn after it is of no use; what was drawn up to it is the beginning of the same stroke, or gone with it.
    stroke.truncate(points);
    if stroke.last() != Some(&at) {
        stroke.clear();
    }
    Some(Start { instruction, state, at, down, stroke })
}

/// The last points of a stroke, from a place so many units back to its end.
fn back(start: &Start, mut left: f64) -> Vec<[i64; 2]> {
    let place = |[x, y]: [i64; 2]| DVec2::new(x as f64, y as f64);
    let mut points = vec![start.at];
    for pair in start.stroke.windows(2).rev() {
        if left <= 0.0 {
            break;
        }
        let (from, to) = (place(pair[0]), place(pair[1]));
        let length = from.distance(to);
        if length > left {
            let at = to.lerp(from, left / length);
            points.push([at.x.round() as i64, at.y.round() as i64]);
            break;
        }
        points.push(pair[0]);
        left -= length;
    }
    points.reverse();
    points
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::device::{Language, find};
    use crate::trace::hpgl::follow;

    fn device() -> (Device, Hpgl) {
        let device = find("dxy1100").unwrap();
        let Language::Hpgl(language) = device.language.clone() else { panic!("no HPGL") };
        (device, language)
    }

    fn left(job: &str, executed: usize, overlap_mm: f64) -> (String, usize, usize) {
        let (device, language) = device();
        let rest = rest(&Job::new(job.as_bytes()).unwrap(), executed, overlap_mm, &device, &language);
        (String::from_utf8(rest.job).unwrap(), rest.added, rest.skipped)
    }

    #[test]
    fn pens_that_were_put_in_by_hand_are_asked_for_again() {
        const JOB: &str = "IN;SP9;PU0,0;PD40,0;PU;SP2;PU40,80;PD120,80;PU;SP1;PD0,0;PU;";
        let table = [
            (4, "IN;PU;SP9;PA;PU40,0;PD;PU;SP2;PU40,80;PD120,80;PU;SP1;PD0,0;PU;"),
            (8, "IN;PU;SP9;PU;SP2;PA;PU120,80;PD;PU;SP1;PD0,0;PU;"),
            (10, "IN;PU;SP1;PA;PU120,80;PD0,0;PU;"),
        ];
        for (executed, expected) in table {
            assert_eq!(left(JOB, executed, 0.0).0, expected, "{executed}");
        }
    }

    #[test]
    fn a_job_goes_on_where_it_stopped() {
        const JOB: &str = "IN;PA;PU;SP2;VS9;PU40,80;PD120,80,120,160;PD0,160;PU400,0;PR;PD0,40;PD40,0;PU;SP0;";
        let table: &[(usize, f64, &str, usize, usize)] = &[
            (6, 0.0, "IN;VS9;PU;SP2;PA;PU40,80;PD120,80,120,160;PD0,160;PU400,0;PR;PD0,40;PD40,0;PU;SP0;", 6, 6),
            (7, 0.0, "IN;VS9;PU;SP2;PA;PU120,160;PD;PD0,160;PU400,0;PR;PD0,40;PD40,0;PU;SP0;", 7, 7),
            // 0.025 mm a unit: within the last line, and round the corner.
            (7, 1.0, "IN;VS9;PU;SP2;PA;PU120,120;PD120,160;PD0,160;PU400,0;PR;PD0,40;PD40,0;PU;SP0;", 7, 7),
            (7, 2.5, "IN;VS9;PU;SP2;PA;PU100,80;PD120,80,120,160;PD0,160;PU400,0;PR;PD0,40;PD40,0;PU;SP0;", 7, 7),
            // No further than the stroke goes back.
            (8, 99.0, "IN;VS9;PU;SP2;PA;PU40,80;PD120,80,120,160,0,160;PU400,0;PR;PD0,40;PD40,0;PU;SP0;", 7, 8),
            // Increments.
            (11, 0.0, "IN;VS9;PU;SP2;PA;PU400,40;PD;PR;PD40,0;PU;SP0;", 8, 11),
            (0, 0.0, "IN;PA;PU;SP2;VS9;PU40,80;PD120,80,120,160;PD0,160;PU400,0;PR;PD0,40;PD40,0;PU;SP0;", 0, 0),
            (3, 0.0, "IN;PA;PU;SP2;VS9;PU40,80;PD120,80,120,160;PD0,160;PU400,0;PR;PD0,40;PD40,0;PU;SP0;", 0, 0),
        ];
        for (executed, overlap_mm, expected, added, skipped) in table {
            let found = left(JOB, *executed, *overlap_mm);
            assert_eq!(found, ((*expected).to_owned(), *added, *skipped), "{executed} {overlap_mm}");
        }
    }

    #[test]
    fn what_is_not_known_is_drawn_again() {
        // After a label, and within a pattern of dashes.
        assert_eq!(left("IN;PU1,1;LBa\x03PD2,2;", 3, 0.0).2, 2);
        assert_eq!(left("IN;PU1,1;LBa\x03PD2,2;", 4, 0.0).2, 4);
        assert_eq!(left("IN;PU1,1;LT2;PD2,2;PD3,3;", 5, 0.0).2, 3);
        assert_eq!(left("IN;SC0,1,0,1;PU1,1;PD2,2;", 4, 0.0), ("IN;SC0,1,0,1;PU1,1;PD2,2;".to_owned(), 0, 0));
    }

    proptest! {
        #[test]
        fn what_is_left_draws_the_rest_and_the_overlap(
            strokes in proptest::collection::vec(proptest::collection::vec((0_i64..400, 0_i64..400), 2..6), 1..6),
            cut in any::<proptest::sample::Index>(),
            overlap_mm in prop_oneof![Just(0.0), 0.1..4.0],
        ) {
            let (device, language) = device();
            let mut text = String::from("IN;PA;PU;SP1;VS10;");
            for points in &strokes {
                let list: Vec<_> = points.iter().map(|(x, y)| format!("{x},{y}")).collect();
                text.push_str(&format!("PU{};PD{};PD{};", list[0], list[1..].join(","), list[0]));
            }
            let job = Job::new(text.as_bytes()).unwrap();
            let executed = cut.index(job.instructions().len());
            let rest = rest(&job, executed, overlap_mm, &device, &language);
            let whole = follow(&job, &device, &language);
            let again_job = Job::new(&rest.job).unwrap();
            let again = follow(&again_job, &device, &language);
            prop_assert_eq!(again.steps.len(), rest.added + whole.steps.len() - rest.skipped);
            prop_assert!(rest.skipped == executed || rest.skipped == 0);
            for (again, whole) in again.steps[rest.added..].iter().zip(&whole.steps[rest.skipped..]) {
                prop_assert_eq!(again.end, whole.end);
                prop_assert_eq!((again.pen_down, again.pen), (whole.pen_down, whole.pen));
                prop_assert!((again.ink_mm - whole.ink_mm).abs() < 1e-9);
            }
            // Before it, no more than the overlap is drawn; less only where the stroke begins.
            let drawn: f64 = again.steps[..rest.added].iter().map(|step| step.ink_mm).sum();
            let pen_was_down = rest.skipped > 0 && whole.steps[rest.skipped - 1].pen_down == Some(true);
            prop_assert!(drawn <= overlap_mm + 0.05 && (pen_was_down || drawn == 0.0), "{} of {}", drawn, overlap_mm);
        }
    }
}
