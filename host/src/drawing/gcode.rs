//! The G-code reader: what the pen of a plotter draws.

use super::file::{Found, Reading};
use super::flatten::Flattener;
use super::traced::Traced;
use crate::device::{self, Device, Dialect, Pen};
use crate::model::{Fault, ReadError, Source};
use crate::protocol::grbl::Job;
use crate::trace::gcode::{Machine, Modal, Way, follow_ways};
use crate::trace::{Cut, Position};

/// What a G-code file draws, on all that the plotter for which it is reaches, and each pen on a layer of its own, `pen1` and so on.
///
/// Which plotter that is is told by its pen: `device`, or the first of those with a profile, whose pen goes up and down by the lines of the file. What
/// it does not say is as after a reset: millimetres, absolute, from zero on. Cost and memory: linear in the file.
///
/// # Errors
/// [`ReadError`] with the line, whatever the bytes are.
pub(super) fn read(source: &mut Source, device: &Device, reading: &Reading<'_>) -> Result<Found, ReadError> {
    let bytes = source.bytes()?;
    // The length of lines is the affair of those who send them.
    let job =
        Job::new(&String::from_utf8_lossy(&bytes), usize::MAX).map_err(|error| Fault::whole(error.to_string()))?;
    let others = device::names().into_iter().filter_map(|name| device::find(name).ok());
    let mut tried: Vec<(Pen, bool)> = Vec::new();
    for device in std::iter::once(device.clone()).chain(others) {
        let Some(machine) = Machine::of(&device) else { continue };
        // Dialects differ in how they speak of a pen only between Marlin and the rest.
        let pen = (machine.pen, machine.dialect == Dialect::Marlin);
        if tried.contains(&pen) {
            continue;
        }
        tried.push(pen);
        if (reading.stops)() {
            return Err(ReadError::Stopped);
        }
        if draws(&job, &machine) {
            return trace(&job, source.stem(), &device, &machine, reading).map_err(ReadError::from);
        }
    }
    Err(Fault::whole(
        "draws nothing with any pen that there is a profile of; say with --device for which plotter it is",
    )
    .into())
}

/// Where a job begins if nothing is said.
const START: Position = Position { x: Some(0.0), y: Some(0.0), z: None };

/// Whether the pen of a machine is lowered by a job.
fn draws(job: &Job, machine: &Machine) -> bool {
    let mut any = false;
    follow_ways(job, machine, &Modal::after_reset(), START, &mut |_, step, _| {
        any |= step.pen_down == Some(true);
    });
    any
}

/// What the pen of a machine draws by a job.
fn trace(job: &Job, name: &str, device: &Device, machine: &Machine, reading: &Reading<'_>) -> Result<Found, Fault> {
    let mut traced = Traced::new(device, Flattener::new(reading.tolerance_mm))?;
    let mut wrong: Option<Fault> = None;
    let mut at = START.xy();
    let mut lost: Option<(usize, usize)> = None;
    follow_ways(job, machine, &Modal::after_reset(), START, &mut |line, step, way| {
        if wrong.is_some() {
            return;
        }
        let from = std::mem::replace(&mut at, step.end.xy());
        let drawn = match (step.pen_down, from, at) {
            (Some(true), Some(from), Some(to)) if step.ink_mm > 0.0 => {
                traced.lower(from, step.pen).and_then(|()| match way {
                    Way::Straight => traced.line(to),
                    Way::Arc { centre, angle } => traced.arc(centre, angle, to),
                })
            }
            // A dot, unless it goes on from here.
            (Some(true), from, Some(to)) if from == Some(to) || step.cut == Cut::StrokeStart => {
                traced.lower(to, step.pen)
            }
            (Some(true), ..) => {
                lost.get_or_insert((0, line.number)).0 += 1;
                traced.lift()
            }
            _ => traced.lift(),
        };
        if let Err(problem) = drawn {
            wrong = Some(Fault::line(line.number, problem));
        }
    });
    traced.lift().map_err(Fault::whole)?;
    if let Some(fault) = wrong {
        return Err(fault);
    }
    let note = lost.map(|(count, first)| {
        format!("{count} × a line whose way cannot be followed is left out (the first is line {first}); write it as G0 to G3 in millimetres or inches")
    });
    traced.found(name, note.into_iter().collect())
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::drawing::{DrawingFormat, file};
    use crate::emit::{self, tests::drawing, tests::polyline};
    use penvis_core::stroke::CurveKind::Iso;

    fn read(text: &str, device: &str) -> Result<Found, String> {
        file::tests::read(DrawingFormat::Gcode, text, device, 0.001)
    }

    /// The strokes: layer, pen, points.
    fn strokes(text: &str) -> Vec<(String, u32, Vec<[f64; 2]>)> {
        let found = read(text, "grbl-servo").unwrap();
        let points = |p: &DVec2| (*p * 1e6).round().to_array().map(|x| x / 1e6);
        found.drawing.polylines.iter().map(|p| (p.layer.clone(), p.pen, p.page.iter().map(points).collect())).collect()
    }

    #[test]
    fn what_is_written_for_a_plotter_is_read_whichever_it_is() {
        let lines = [
            &[[10.0, 20.0], [30.5, 20.0], [30.5, 40.123]][..],
            &[[50.0, 50.0], [50.0, 50.0]],
            &[[60.0, 20.0], [70.0, 30.0]],
        ];
        let pens = [1, 1, 2];
        let polylines: Vec<_> = lines.iter().zip(pens).map(|(page, pen)| polyline(Iso, pen, page)).collect();
        for name in device::names() {
            let made_for = device::find(name).unwrap();
            if made_for.language.gcode().is_none() {
                continue;
            }
            let page = made_for.whole_page();
            let drawn = drawing(page.width_mm, page.height_mm, polylines.clone());
            let text = emit::gcode(&drawn, &made_for).unwrap();
            let found = read(&text, name).unwrap();
            assert!(found.notes.is_empty(), "{name}: {:?}", found.notes);
            assert_eq!(found.drawing.page, drawn.page, "{name}");
            let read: Vec<_> =
                found.drawing.polylines.iter().map(|p| (p.pen, p.layer.as_str(), p.page.clone())).collect();
            assert_eq!(read.len(), 3, "{name}: {read:?}");
            for ((pen, layer, points), line) in read.iter().zip(&polylines) {
                assert_eq!((*pen, *layer), (line.pen, ["pen1", "pen2"][line.pen as usize - 1]), "{name}");
                assert!(
                    points.len() == line.page.len()
                        && points.iter().zip(&line.page).all(|(p, q)| p.distance(*q) < 1e-9),
                    "{name}: {points:?}"
                );
            }
        }
        // A pen on Z tells itself from a servo.
        let z = emit::gcode(&drawing(100.0, 100.0, polylines.clone()), &device::find("grbl-z").unwrap()).unwrap();
        assert_eq!(read(&z, "grbl-servo").unwrap().drawing.polylines.len(), 3);
    }

    #[test]
    fn units_differences_and_arcs_are_followed() {
        let down = "M3 S1000";
        assert_eq!(
            strokes(&format!("G20\nG0 X1 Y1\n{down}\nG91\nG1 X1 F9\nG1 Y1\nM5")),
            [("ink".into(), 1, vec![[25.4, 25.4], [50.8, 25.4], [50.8, 50.8]])]
        );
        let arc = strokes(&format!("G0 X20 Y10\n{down}\nG3 X10 Y20 I-10 J0 F600\nG1 X0\nM3 S0\n")).remove(0).2;
        assert!(arc.len() > 20 && arc.last() == Some(&[0.0, 20.0]), "{arc:?}");
        for p in &arc[..arc.len() - 1] {
            assert!(((p[0] - 10.0).hypot(p[1] - 10.0) - 10.0).abs() < 1e-5, "{p:?}");
        }
    }

    #[test]
    fn what_cannot_be_followed_is_told() {
        let found = read("M3 S1000\nG1 X10 F600\nG28\nG1 X20\nG0 X5 Y5\nG1 X9", "grbl-servo").unwrap();
        assert!(found.notes[0].contains("cannot be followed is left out (the first is line 3)"), "{:?}", found.notes);
        for (text, expected) in [
            ("G0 X1", "draws nothing with any pen"),
            ("", "there is no G-code in it"),
            ("G1 X1!", "line 1 holds `!`"),
            ("M3 S1000\nG1 X99999 F600", "line 2: has a coordinate of more than 10000 mm"),
        ] {
            let message = read(text, "grbl-servo").unwrap_err();
            assert!(message.contains(expected) && !message.contains('\n'), "{text}: {message}");
        }
    }
}
