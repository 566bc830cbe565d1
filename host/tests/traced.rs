//! What is written for each plotter that there is a profile for, followed as the plotter reads it, is what was drawn.

use glam::DVec2;
use penvis::device::{self, Device, Language};
use penvis::drawing::{Drawing, Page, Polyline};
use penvis::emit;
use penvis::pens::Pens;
use penvis::protocol::{grbl, hpgl};
use penvis::trace::gcode::{Machine, Modal};
use penvis::trace::hpgl::{Action, Motion, Path, State};
use penvis::trace::{self, Position};
use proptest::prelude::*;

/// Grid of G-code in mm.
const GRID_MM: f64 = 0.001;

fn polyline((pen, page): (u32, Vec<[f64; 2]>)) -> Polyline {
    Polyline::stroke("iso", pen, page.into_iter().map(DVec2::from).collect())
}

/// Some strokes on an A4 sheet, well within what every plotter reaches, some of them dots or joined to the one before.
fn polylines() -> impl Strategy<Value = Vec<(u32, Vec<[f64; 2]>)>> {
    let point = (20.0..270.0, 20.0..185.0).prop_map(|(x, y)| [x, y]);
    let fine = prop::collection::vec((-0.05..0.05, -0.05..0.05), 0..3);
    let stroke = (1..3_u32, prop::collection::vec(point, 1..6), fine).prop_map(|(pen, mut points, fine)| {
        for (dx, dy) in fine {
            let [x, y] = points[points.len() - 1];
            points.push([x + dx, y + dy]);
        }
        (pen, points)
    });
    prop::collection::vec(stroke, 0..12)
}

/// What the pen draws when the device reads the job, on a grid of `unit_mm`.
fn traced(text: &str, device: &Device, unit_mm: f64) -> Vec<(u32, Vec<[i64; 2]>)> {
    let mut runs: Vec<(u32, Vec<[i64; 2]>)> = Vec::new();
    let mut was_down = false;
    let mut draw = |pen: u32, down: bool, points: &[[i64; 2]]| {
        if down && !was_down {
            runs.push((pen, Vec::new()));
        }
        was_down = down;
        if let (true, Some(run)) = (down, runs.last_mut()) {
            run.1.extend(points);
            run.1.dedup();
        }
    };
    match &device.language {
        Language::Grbl(language) | Language::Marlin(language) => {
            let job = grbl::Job::new(text, language.line_limit).unwrap();
            let machine = Machine::of(device).unwrap();
            let followed = trace::gcode::follow(&job, &machine, &Modal::default(), Position::UNKNOWN);
            for step in &followed.trace.steps {
                let at = step.end.xy().map(|at| (at / unit_mm).round());
                let points: Vec<_> = at.into_iter().map(|at| [at.x as i64, at.y as i64]).collect();
                draw(step.pen, step.pen_down == Some(true), &points);
            }
            assert_ne!(followed.trace.steps.last().unwrap().pen_down, Some(true));
        }
        Language::Hpgl(_) => {
            let job = hpgl::Job::new(text.as_bytes()).unwrap();
            let mut state = State::unknown();
            for instruction in job.instructions() {
                let before = state.at;
                let action = state.follow(instruction);
                assert_ne!(action, Action::Unknown, "{}", String::from_utf8_lossy(instruction));
                let mut points: Vec<_> = before.into_iter().collect();
                match action {
                    Action::Move(Motion { path: Path::Through(through), .. }) => points.extend(through),
                    Action::Move(Motion { path: Path::Unknown, .. }) => panic!("a move that is not known"),
                    _ => {}
                }
                draw(state.pen.unwrap_or(0), state.down == Some(true), &points);
            }
            assert_eq!(state.down, Some(false));
        }
    }
    runs
}

proptest! {
    // Each case is written for every plotter.
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn what_is_written_is_what_was_drawn(lines in polylines()) {
        for name in device::names() {
            let device = device::find(name).unwrap();
            // A machine with one pen has it changed by hand.
            let pens = if device.language.gcode().is_some() { 2 } else { device.pens };
            let polylines = lines.iter().map(|(pen, page)| polyline(((*pen).min(pens), page.clone()))).collect();
            let page = Page { width_mm: 297.0, height_mm: 210.0 };
            let drawing = Drawing { name: "t".into(), page, isos: 0, pens: Pens::default(), slack_mm: 0.0, polylines };
            let (text, unit_mm) = match &device.language {
                Language::Hpgl(language) => (emit::hpgl(&drawing, &device).unwrap(), language.unit_mm),
                _ => (emit::gcode(&drawing, &device).unwrap(), GRID_MM),
            };
            let placement = device.place(page).unwrap();
            let runs = emit::runs(&drawing, unit_mm, |at| placement.to_machine(at));
            let expected: Vec<_> = runs.into_iter().map(|run| (run.pen, run.points)).collect();
            prop_assert_eq!(traced(&text, &device, unit_mm), expected, "{}:\n{}", name, text);
            let findings = penvis::preflight::job(text.as_bytes(), &device);
            prop_assert!(
                findings.iter().all(|finding| lines.is_empty() || finding.what.contains("nothing is drawn")
                    || finding.what.contains("hard-clip limits of")),
                "{}: {:?}", name, findings
            );
        }
    }
}
