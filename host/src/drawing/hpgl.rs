//! The HPGL reader: what the pens of a plotter draw.

use std::collections::BTreeMap;

use glam::DVec2;

use super::file::{Found, Reading};
use super::flatten::Flattener;
use super::traced::Traced;
use crate::device::{Device, Language};
use crate::model::{Fault, ReadError, Source};
use crate::protocol::hpgl::Job;
use crate::trace::hpgl::{Action, Motion, Path, State};

/// What an HPGL file draws, as a plotter of this kind would draw it: on its first sheet, and each pen on a layer of its own, `pen1` and so on.
///
/// What is not followed (labels, user units, arcs and circles, …) is told and left out. Cost and memory: linear in the file.
///
/// # Errors
/// [`ReadError`] with the instruction, whatever the bytes are.
pub(super) fn read(source: &mut Source, device: &Device, reading: &Reading<'_>) -> Result<Found, ReadError> {
    let Language::Hpgl(language) = &device.language else {
        return Err(Fault::whole(format!("is HPGL, and `{}` speaks {}", device.name, device.language.name())).into());
    };
    let job = Job::new(&source.bytes()?).map_err(|error| Fault::whole(error.to_string()))?;
    let mut traced = Traced::new(device, Flattener::new(reading.tolerance_mm))?;
    // A plotter that has just been switched on.
    let mut state = State::default();
    let _ = state.follow(b"IN;");
    let mut skipped: BTreeMap<String, (usize, usize)> = BTreeMap::new();
    let mm = |[x, y]: [i64; 2]| DVec2::new(x as f64, y as f64) * language.unit_mm;
    for (index, instruction) in job.instructions().iter().enumerate() {
        if index.is_multiple_of(1 << 12) && (reading.stops)() {
            return Err(ReadError::Stopped);
        }
        let before = state.at;
        let action = state.follow(instruction);
        let at = |problem: String| Fault::at(format!("instruction {}", index + 1), problem);
        let (is_followed, lowers, points) = match action {
            Action::Move(Motion { lowers, path: Path::Through(points) }) => (true, lowers, points),
            Action::Move(Motion { lowers, path: Path::Stays }) => (true, lowers, Vec::new()),
            Action::Move(Motion { path: Path::Unknown, .. }) | Action::Unknown => (false, None, Vec::new()),
            Action::Select | Action::Set => {
                if state.down != Some(true) {
                    traced.lift().map_err(at)?;
                }
                continue;
            }
        };
        let pen = state.pen.unwrap_or(1);
        if !is_followed {
            // Moves in the air are lost as well, but nothing of the drawing is.
            if state.down != Some(false) {
                let name = String::from_utf8_lossy(instruction.get(..2).unwrap_or_default()).to_ascii_uppercase();
                skipped.entry(name).or_insert((0, index + 1)).0 += 1;
            }
            traced.lift().map_err(at)?;
        } else if state.down == Some(true) && pen > 0 {
            if let Some(from) = before {
                traced.lower(mm(from), pen).map_err(at)?;
                for point in points {
                    traced.line(mm(point)).map_err(at)?;
                }
            } else if let Some((&first, rest)) = points.split_first() {
                // Where the pen came from is not known.
                traced.lower(mm(first), pen).map_err(at)?;
                rest.iter().try_for_each(|&point| traced.line(mm(point))).map_err(at)?;
            }
        } else if lowers == Some(false) || state.down == Some(false) {
            traced.lift().map_err(at)?;
        }
    }
    traced.lift().map_err(Fault::whole)?;
    let notes = skipped.into_iter().map(|(name, (count, first))| {
        format!("{count} × {name} is not followed, and what it draws is left out (the first is instruction {first}); turn it into PA and PD first")
    });
    let notes = notes.collect();
    traced.found(source.stem(), notes).map_err(ReadError::from)
}

#[cfg(test)]
mod tests {
    use penvis_core::stroke::CurveKind::Iso;

    use super::*;
    use crate::device;
    use crate::drawing::{DrawingFormat, file};
    use crate::emit::{self, tests::drawing, tests::polyline};

    fn read(text: &str, device: &str) -> Result<Found, String> {
        file::tests::read(DrawingFormat::Hpgl, text, device, 0.001)
    }

    #[test]
    fn what_is_written_for_a_plotter_is_read() {
        let lines = [
            &[[30.0, 40.0], [60.0, 40.0], [60.0, 70.0]][..],
            &[[80.0, 80.0], [80.0, 80.0]],
            &[[90.0, 40.0], [99.0, 50.0]],
        ];
        let pens = [1, 1, 2];
        let polylines: Vec<_> = lines.iter().zip(pens).map(|(page, pen)| polyline(Iso, pen, page)).collect();
        for name in device::names() {
            let made_for = device::find(name).unwrap();
            if made_for.language.gcode().is_some() || made_for.pens < 2 {
                continue;
            }
            let page = made_for.whole_page();
            let text = emit::hpgl(&drawing(page.width_mm, page.height_mm, polylines.clone()), &made_for).unwrap();
            let found = read(&text, name).unwrap();
            assert!(found.notes.is_empty(), "{name}: {:?}", found.notes);
            assert_eq!(found.drawing.polylines.len(), 3, "{name}");
            for (found, line) in found.drawing.polylines.iter().zip(&polylines) {
                assert_eq!((found.pen, found.page.len()), (line.pen, line.page.len()), "{name}");
                // Half a plotter unit each way.
                assert!(
                    found.page.iter().zip(&line.page).all(|(p, q)| p.distance(*q) < 0.02),
                    "{name}: {:?}",
                    found.page
                );
            }
        }
    }

    #[test]
    fn moves_are_absolute_or_relative_and_in_lists() {
        let found = read("IN;SP2;PU400,400;PD800,400;PR0,400,-400,0;PU;PA0,0;PD;PU;SP0;PD9,9;", "dxy1100").unwrap();
        let strokes: Vec<_> = found.drawing.polylines.iter().map(|p| (p.pen, p.page.clone())).collect();
        let points = |p: &[[f64; 2]]| p.iter().map(|&p| DVec2::from(p)).collect::<Vec<_>>();
        let expected =
            [points(&[[10.0, 10.0], [20.0, 10.0], [20.0, 20.0], [10.0, 20.0]]), points(&[[0.0, 0.0], [0.0, 0.0]])];
        assert_eq!(strokes, expected.map(|points| (2, points)));
    }

    #[test]
    fn what_is_not_followed_is_told() {
        let found = read("IN;SP1;PU0,0;PD400,0;LBno\u{3}PU0,0;PD0,400;CI100;CI50;PU;", "dxy1100").unwrap();
        assert_eq!(found.drawing.polylines.len(), 2);
        assert!(
            found.notes.iter().any(|n| n.starts_with("2 × CI is not followed") && n.contains("instruction 8")),
            "{:?}",
            found.notes
        );
        for (text, expected) in [
            ("IN;SP1;PU;", "draws nothing that can be followed"),
            ("IN;SC0,1,0,1;PD1,1;", "draws nothing that can be followed: 1 × PD"),
            ("", "there is no HPGL instruction"),
            ("12;", "instruction 1 begins with"),
        ] {
            let message = read(text, "hp7475a").unwrap_err();
            assert!(message.contains(expected) && !message.contains('\n'), "{text}: {message}");
        }
    }
}
