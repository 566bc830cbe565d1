//! G-code for GRBL 1.1 and its kin, and for Marlin.

use glam::DVec2;

use super::EmitError;
use super::fit::{DECIMALS, moves};
use super::grid::{Run, runs};
use super::number::{decimal, fixed};
use crate::device::{Device, Dialect, Gcode};
use crate::drawing::Drawing;

/// The drawing as G-code: absolute mm, `G0` with the pen up, with it down `G1`, and `G2` and `G3` where
/// the drawing has slack for arcs and the device takes them; the pen's own lines between.
///
/// One command a line, ended by `\n`; printable ASCII without comments, and no line longer than the device takes. The
/// program begins by raising the pen and ends with it raised at the machine's zero.
///
/// # Errors
/// If the device speaks no G-code, does not reach some ink, or a line of its profile is too long or not plain ASCII.
pub fn gcode(drawing: &Drawing, device: &Device) -> Result<String, EmitError> {
    let Some(language) = device.language.gcode() else {
        return Err(EmitError::Language {
            device: device.name.clone(),
            speaks: device.language.name(),
            wanted: "G-code",
        });
    };
    let place = device.place(drawing.page)?;
    let unit = 10_f64.powi(-(DECIMALS as i32));
    super::check_reach(drawing, device, &place, unit)?;
    let mut writer = Writer { text: String::new(), device, language };
    for line in &language.start {
        writer.line(&device.fill(line, 1))?;
    }
    writer.lines(language.pen_up())?;
    let mut pen = 1;
    for run in runs(drawing, unit, |p: DVec2| place.to_machine(p)) {
        if run.pen != pen {
            pen = run.pen;
            for line in &language.pen_change {
                writer.line(&device.fill(line, pen))?;
            }
        }
        writer.run(&run, drawing.slack_mm, drawing.pens.draw_feed(run.pen, device.draw_feed))?;
    }
    writer.travel("X0 Y0")?;
    for line in &language.end {
        writer.line(&device.fill(line, pen))?;
    }
    Ok(writer.text)
}

struct Writer<'a> {
    text: String,
    device: &'a Device,
    language: &'a Gcode,
}

impl Writer<'_> {
    fn line(&mut self, line: &str) -> Result<(), EmitError> {
        let limit = self.language.line_limit;
        // Bytes that are not printable ASCII may be real-time commands to the controller.
        if line.len() > limit || !line.bytes().all(|b| (b' '..=b'~').contains(&b)) {
            return Err(EmitError::Line { line: line.to_owned(), limit, device: self.device.name.clone() });
        }
        self.text.push_str(line);
        self.text.push('\n');
        Ok(())
    }

    fn lines(&mut self, lines: Vec<String>) -> Result<(), EmitError> {
        lines.iter().try_for_each(|line| self.line(line))
    }

    /// Goes somewhere with the pen up. Marlin's `G0` is as fast as the feed, which is that of the last stroke.
    fn travel(&mut self, to: &str) -> Result<(), EmitError> {
        match self.language.dialect {
            Dialect::Marlin => self.line(&format!("G0 {to} F{}", decimal(self.device.travel_feed, 1))),
            _ => self.line(&format!("G0 {to}")),
        }
    }

    fn run(&mut self, run: &Run, slack_mm: f64, feed: f64) -> Result<(), EmitError> {
        let Some(first) = run.points.first() else { return Ok(()) };
        self.travel(&coordinates(*first))?;
        self.lines(self.language.pen_down())?;
        for (k, piece) in moves(run, slack_mm, self.language).iter().enumerate() {
            // The feed is modal; a pen on the Z axis, or a Marlin's travel, has changed it.
            let feed = if k == 0 { format!(" F{}", decimal(feed, 1)) } else { String::new() };
            self.line(&format!("{}{feed}", piece.text()))?;
        }
        self.lines(self.language.pen_up())
    }
}

fn coordinates([x, y]: [i64; 2]) -> String {
    format!("X{} Y{}", fixed(x, DECIMALS), fixed(y, DECIMALS))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use penvis_core::stroke::CurveKind::{Boundary, Iso};

    use super::super::tests::{drawing, polyline};
    use super::*;
    use crate::device::{Language, Origin, find};
    use crate::pens::Pens;

    #[test]
    fn a_servo_draws_two_strokes_and_a_dot() {
        let lines = vec![
            polyline(Boundary, 1, &[[10.0, 20.0], [10.0004, 20.0], [30.5, 20.0], [30.5, 40.12345]]),
            polyline(Iso, 1, &[[50.0, 50.0], [50.0001, 50.0]]),
        ];
        let text = gcode(&drawing(297.0, 210.0, lines), &find("grbl-servo").unwrap()).unwrap();
        let expected = "\
G21
G90
G17
G94
M3 S0
G4 P0.15
G0 X10 Y20
M3 S1000
G4 P0.2
G1 X30.5 Y20 F2000
G1 X30.5 Y40.123
M3 S0
G4 P0.15
G0 X50 Y50
M3 S1000
G4 P0.2
M3 S0
G4 P0.15
G0 X0 Y0
M5
";
        assert_eq!(text, expected);
    }

    #[test]
    fn a_pen_on_z_at_the_upper_left_with_a_change_of_pens() {
        let mut device = find("grbl-z").unwrap();
        device.origin = Origin::UpperLeft;
        let lines =
            vec![polyline(Boundary, 1, &[[0.0, 90.0], [1.0, 90.0]]), polyline(Iso, 2, &[[1.0, 90.0], [2.0, 90.0]])];
        let text = gcode(&drawing(100.0, 100.0, lines), &device).unwrap();
        let expected = "\
G21
G90
G17
G94
G1 Z3 F1000
G0 X0 Y-10
G1 Z1 F1000
G1 Z0 F300
G1 X1 Y-10 F2000
G1 Z3 F1000
M0 (pen 2)
G0 X1 Y-10
G1 Z1 F1000
G1 Z0 F300
G1 X2 Y-10 F2000
G1 Z3 F1000
G0 X0 Y0
";
        assert_eq!(text, expected);
    }

    #[test]
    fn each_pen_draws_at_its_speed() {
        let lines = vec![polyline(Boundary, 1, &[[1.0, 9.0], [2.0, 9.0]]), polyline(Iso, 2, &[[3.0, 9.0], [4.0, 9.0]])];
        let mut drawing = drawing(100.0, 100.0, lines);
        let slow = crate::pens::Pen { speed_mm_s: Some(10.5), ..Default::default() };
        drawing.pens = Pens::new(BTreeMap::from([(2, slow)]), 0.3);
        let text = gcode(&drawing, &find("grbl-servo").unwrap()).unwrap();
        assert!(text.contains("G1 X2 Y9 F2000\n") && text.contains("G1 X4 Y9 F630\n"), "{text}");
    }

    #[test]
    fn marlin_waits_for_its_moves_and_is_told_each_feed() {
        let lines = vec![polyline(Boundary, 1, &[[10.0, 20.0], [30.5, 20.0]])];
        let text = gcode(&drawing(200.0, 200.0, lines), &find("marlin-servo").unwrap()).unwrap();
        let expected = "\
G21
G90
M400
M280 P0 S90
G4 P200
G0 X10 Y20 F6000
M400
M280 P0 S30
G4 P250
G1 X30.5 Y20 F2400
M400
M280 P0 S90
G4 P200
G0 X0 Y0 F6000
M400
";
        assert_eq!(text, expected);
    }

    /// A quarter of 20 mm clockwise and one back, by chords of 0.314 mm: three of them lie within 0.005 mm of one, four within 0.01 mm.
    #[test]
    fn curves_are_arcs_where_there_is_slack_and_the_device_takes_them() {
        let quarter = |centre: DVec2, from: f64, to: f64| {
            (0..=100).map(move |k| {
                centre + DVec2::from_angle((from + (to - from) * f64::from(k) / 100.0).to_radians()) * 20.0
            })
        };
        let curve: Vec<[f64; 2]> = quarter(DVec2::new(50.0, 50.0), 180.0, 90.0)
            .chain(quarter(DVec2::new(50.0, 90.0), -90.0, 0.0).skip(1))
            .map(|p| [p.x, p.y])
            .collect();
        let mut drawing = drawing(200.0, 200.0, vec![polyline(Iso, 1, &curve)]);
        let mut device = find("grbl-servo").unwrap();
        let moves = |drawing: &Drawing, device: &Device| -> Vec<String> {
            let text = gcode(drawing, device).unwrap();
            let drawn = |line: &&str| ["G1 ", "G2 ", "G3 "].iter().any(|word| line.starts_with(word));
            text.lines().filter(drawn).map(str::to_owned).collect()
        };
        assert_eq!(moves(&drawing, &device).len(), 200, "without slack each chord is a line");
        drawing.slack_mm = 0.0075;
        let arcs = moves(&drawing, &device);
        assert!(arcs[0].starts_with("G2 X") && arcs[0].contains(" J") && arcs[0].ends_with(" F2000"), "{arcs:?}");
        assert!(arcs.last().is_some_and(|last| last.starts_with("G3 X70 Y90 I")) && arcs.len() <= 4, "{arcs:?}");
        if let Language::Grbl(language) = &mut device.language {
            language.arcs = false;
        }
        let lines = moves(&drawing, &device);
        assert!(lines.iter().all(|line| line.starts_with("G1 ")) && (60..75).contains(&lines.len()), "{lines:?}");
    }

    #[test]
    fn what_the_machine_cannot_do_is_refused() {
        let one = |page: &[[f64; 2]]| drawing(297.0, 210.0, vec![polyline(Iso, 1, page)]);
        let inside = one(&[[10.0, 10.0], [20.0, 10.0]]);
        let mut device = find("grbl-servo").unwrap();
        assert!(matches!(gcode(&one(&[[-1.0, 0.0], [0.0, 0.0]]), &device), Err(EmitError::Reach { .. })));
        assert!(matches!(gcode(&one(&[[f64::NAN, 0.0], [0.0, 0.0]]), &device), Err(EmitError::Reach { .. })));
        assert!(matches!(gcode(&inside, &find("hp7475a").unwrap()), Err(EmitError::Language { .. })));
        let huge = drawing(9000.0, 210.0, Vec::new());
        assert!(matches!(gcode(&huge, &device), Err(EmitError::Place(_))));
        if let Language::Grbl(language) = &mut device.language {
            language.end = vec!["x".repeat(80)];
        }
        assert!(matches!(gcode(&inside, &device), Err(EmitError::Line { .. })));
        if let Language::Grbl(language) = &mut device.language {
            language.end = vec!["M5 é".into()];
        }
        assert!(matches!(gcode(&inside, &device), Err(EmitError::Line { .. })));
    }

    #[test]
    fn an_empty_drawing_only_raises_the_pen() {
        let text = gcode(&drawing(100.0, 100.0, Vec::new()), &find("penvis").unwrap()).unwrap();
        assert!(!text.contains("G1 ") && text.contains("M3 S0"));
    }
}
