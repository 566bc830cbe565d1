//! HPGL for pen plotters.

use std::fmt::Write as _;

use glam::DVec2;

use super::EmitError;
use super::grid::runs;
use super::number::decimal;
use crate::device::{Device, Hpgl, Language, MM_MIN_PER_CM_S};
use crate::drawing::Drawing;
use crate::protocol::hpgl::encoded;

/// The drawing as HPGL: absolute coordinates in whole plotter units, `PU` to each start, then `PD` lists no longer than the
/// device takes, or one `PE` where it takes that. Rounding to the unit comes before anything else. No line breaks; every instruction ends with `;`.
/// Pens keep their numbers, also those beyond what the device holds: see [`crate::protocol::hpgl::Holders`].
///
/// # Errors
/// If the device speaks no HPGL, has no such sheet, or does not reach some ink.
pub fn hpgl(drawing: &Drawing, device: &Device) -> Result<String, EmitError> {
    let Language::Hpgl(language) = &device.language else {
        return Err(EmitError::Language {
            device: device.name.clone(),
            speaks: device.language.name(),
            wanted: "HPGL",
        });
    };
    let place = device.place(drawing.page)?;
    super::check_reach(drawing, device, &place, language.unit_mm)?;
    // Absolute coordinates are the default after IN; a start string of one's own may have said otherwise.
    let mut text = format!("{}PA;", device.fill(&language.start, 1));
    let mut held = None;
    for run in runs(drawing, language.unit_mm, |p: DVec2| place.to_machine(p)) {
        if held != Some(run.pen) {
            text.push_str(&device.fill(&language.pen_change, run.pen));
            text.push_str(&pressure(drawing, device, language, run.pen)?);
            held = Some(run.pen);
        }
        let [x, y] = run.points[0];
        // Writing to a string cannot fail.
        let _ = write!(text, "PU{x},{y};");
        // A dot is the pen put down where it is.
        let rest = if run.points.len() > 1 { &run.points[1..] } else { &run.points[..] };
        if language.encoded {
            text.push_str(encoded::BEGIN);
            let mut from = run.points[0];
            for to in rest {
                encoded::push(&mut text, [to[0] - from[0], to[1] - from[1]]);
                from = *to;
            }
            text.push(';');
            continue;
        }
        for list in rest.chunks(language.list_points.max(1)) {
            let list: Vec<_> = list.iter().map(|[x, y]| format!("{x},{y}")).collect();
            let _ = write!(text, "PD{};", list.join(","));
        }
    }
    text.push_str(&device.fill(&language.end, held.unwrap_or(1)));
    Ok(text)
}

/// What a pen that has been taken is told of its speed and force, where the plotter knows them.
fn pressure(drawing: &Drawing, device: &Device, language: &Hpgl, pen: u32) -> Result<String, EmitError> {
    let mut text = String::new();
    if let Some(fastest) = language.speed_max
        && drawing.pens.have_speeds()
    {
        let speed = drawing.pens.draw_feed(pen, device.draw_feed) / MM_MIN_PER_CM_S;
        let _ = write!(text, "VS{};", decimal(speed.clamp(1.0, f64::from(fastest)), 0));
    }
    if let (Some(force), Some(forces)) = (drawing.pens.force(pen), language.force_max) {
        if force > forces {
            return Err(EmitError::Force { pen, force, device: device.name.clone(), forces });
        }
        let _ = write!(text, "FS{force};");
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use penvis_core::stroke::CurveKind::Iso;

    use super::super::tests::{drawing, polyline};
    use super::*;
    use crate::device::find;
    use crate::pens::{Pen, Pens};

    /// Ends in HPGL units on A3 of a Roland: 40 a millimetre, zero in the corner.
    fn dxy(list_points: usize, lines: &[(u32, &[[f64; 2]])]) -> String {
        let mut device = find("dxy1100").unwrap();
        if let Language::Hpgl(language) = &mut device.language {
            language.list_points = list_points;
        }
        let lines = lines.iter().map(|(pen, page)| polyline(Iso, *pen, page)).collect();
        hpgl(&drawing(420.0, 297.0, lines), &device).unwrap()
    }

    #[test]
    fn strokes_become_exact_strings() {
        type Case = (&'static str, usize, &'static [(u32, &'static [[f64; 2]])], &'static str);
        let table: &[Case] = &[
            ("nothing", 9, &[], "IN;PA;PU;SP0;"),
            ("a line", 9, &[(1, &[[1.0, 2.0], [3.0, 2.0]])], "IN;PA;PU;SP1;PU40,80;PD120,80;PU;SP0;"),
            ("rounding", 9, &[(1, &[[0.012, 0.0], [0.013, 0.99]])], "IN;PA;PU;SP1;PU0,0;PD1,40;PU;SP0;"),
            ("a dot", 9, &[(1, &[[1.0, 1.0], [1.001, 1.0]])], "IN;PA;PU;SP1;PU40,40;PD40,40;PU;SP0;"),
            (
                "a list too long",
                2,
                &[(1, &[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]])],
                "IN;PA;PU;SP1;PU0,0;PD40,0,80,0;PD120,0;PU;SP0;",
            ),
            (
                "strokes that meet are one",
                9,
                &[(1, &[[0.0, 0.0], [1.0, 0.0]]), (1, &[[1.01, 0.0], [1.0, 1.0]])],
                "IN;PA;PU;SP1;PU0,0;PD40,0,40,40;PU;SP0;",
            ),
            (
                "two pens",
                9,
                &[(1, &[[0.0, 0.0], [1.0, 0.0]]), (2, &[[1.0, 0.0], [1.0, 1.0]])],
                "IN;PA;PU;SP1;PU0,0;PD40,0;PU;SP2;PU40,0;PD40,40;PU;SP0;",
            ),
        ];
        for (name, list_points, lines, expected) in table {
            assert_eq!(dxy(*list_points, lines), *expected, "{name}");
        }
    }

    #[test]
    fn strokes_are_encoded_where_the_device_takes_that() {
        let lines =
            [polyline(Iso, 1, &[[1.0, 2.0], [3.0, 2.0], [3.0, 1.0]]), polyline(Iso, 1, &[[5.0, 5.0], [5.0, 5.0]])];
        let text = hpgl(&drawing(420.0, 297.0, lines.into()), &find("hpgl2").unwrap()).unwrap();
        assert_eq!(text, "IN;PA;PU;SP1;PU40,80;PE7?d__Pa;PU200,200;PE7__;PU;SP0;");
    }

    #[test]
    fn pens_are_told_their_speed_and_force_when_they_are_taken() {
        let slow = Pen { speed_mm_s: Some(100.0), force: Some(3), ..Pen::default() };
        let lines =
            vec![polyline(Iso, 1, &[[20.0, 20.0], [30.0, 20.0]]), polyline(Iso, 2, &[[20.0, 20.0], [30.0, 20.0]])];
        let mut drawing = drawing(297.0, 210.0, lines);
        drawing.pens = Pens::new(BTreeMap::from([(2, slow)]), 0.3);
        let text = |name: &str| hpgl(&drawing, &find(name).unwrap());
        let hp = text("hp7550a").unwrap();
        assert!(hp.contains("SP1;VS50;PU") && hp.contains("SP2;VS10;FS3;PU"), "{hp}");
        // It knows no forces.
        let hp = text("hp7475a").unwrap();
        assert!(hp.contains("SP2;VS10;PU"), "{hp}");
        drawing.pens = Pens::new(BTreeMap::from([(2, Pen { force: Some(9), ..slow })]), 0.3);
        let error = hpgl(&drawing, &find("hp7550a").unwrap()).unwrap_err();
        assert!(matches!(error, EmitError::Force { pen: 2, force: 9, forces: 8, .. }));
    }

    #[test]
    fn an_upright_page_is_turned_on_the_sheet() {
        let lines = vec![polyline(Iso, 1, &[[0.0, 420.0], [0.0, 410.0]])];
        let text = hpgl(&drawing(297.0, 420.0, lines), &find("dxy1100").unwrap()).unwrap();
        assert_eq!(text, "IN;PA;PU;SP1;PU0,0;PD400,0;PU;SP0;");
    }

    #[test]
    fn what_the_plotter_cannot_do_is_refused() {
        let hp = find("hp7475a").unwrap();
        let on = |pen, x: f64| drawing(297.0, 210.0, vec![polyline(Iso, pen, &[[x, 100.0], [100.0, 100.0]])]);
        assert!(hpgl(&on(6, 11.0), &hp).is_ok());
        assert!(hpgl(&on(7, 11.0), &hp).unwrap().contains("SP7;"));
        assert!(matches!(hpgl(&on(1, 9.0), &hp), Err(EmitError::Reach { .. })));
        assert!(matches!(hpgl(&on(1, 11.0), &find("penvis").unwrap()), Err(EmitError::Language { .. })));
        assert!(matches!(hpgl(&drawing(10.0, 10.0, Vec::new()), &hp), Err(EmitError::Place(_))));
    }
}
