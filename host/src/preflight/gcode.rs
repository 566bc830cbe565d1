//! G-code against a profile, and against what a controller tells.

use glam::DVec2;

use super::{Finding, Repeated, Severity, Told, whole};
use crate::device::{Device, Dialect, Gcode, Pen};
use crate::drawing::Page;
use crate::protocol::Unit;
use crate::protocol::grbl::{Job, Turn, words};
use crate::trace::gcode::{Machine, Modal, places};
use crate::trace::{Position, Trace};

/// Slack in mm when the extent of a job is compared with a travel: papers are rounded, and switches have play.
const SLACK_MM: f64 = 0.5;

/// G-codes in tenths that GRBL 1.1 knows ("Supported G-codes" of its documentation).
const GRBL_G: &[i64] = &[
    0, 10, 20, 30, 40, 100, 170, 180, 190, 200, 210, 280, 281, 300, 301, 382, 383, 384, 385, 400, 431, 490, 530, 540,
    550, 560, 570, 580, 590, 610, 800, 900, 910, 911, 920, 921, 930, 940,
];
/// M-codes in tenths that GRBL 1.1 knows.
const GRBL_M: &[i64] = &[0, 10, 20, 30, 40, 50, 70, 80, 90, 300];
/// What FluidNC knows besides: tool changes, and its outputs.
const FLUIDNC_M: &[i64] = &[60, 560, 610, 620, 630, 640, 650, 660, 670, 680];

/// What is wrong with a job for a device.
pub(super) fn job(job: &Job, device: &Device, language: &Gcode) -> Vec<Finding> {
    let mut findings = Vec::new();
    findings.extend(unknown_words(job, language.dialect));
    if language.dialect == Dialect::Marlin {
        findings.extend(system_lines(job));
    }
    let trace = trace(job, device, language);
    findings.extend(extent(&trace, device));
    let known = trace.steps.iter().any(|step| step.pen_down.is_some());
    if trace.ink_mm() == 0.0 {
        let what = if known {
            "nothing is drawn: the pen never moves while it is down"
        } else {
            "nothing is drawn as far as the profile tells: no line moves the pen as [gcode.pen] does; is --device right?"
        };
        findings.push(whole(Severity::Warning, what.into()));
    }
    findings
}

fn trace(job: &Job, device: &Device, language: &Gcode) -> Trace {
    places(job, &Machine::new(device, language), &Modal::default(), Position::UNKNOWN).trace
}

/// Commands that the controller does not know.
fn unknown_words(job: &Job, dialect: Dialect) -> Vec<Finding> {
    // What grblHAL and Marlin know depends on how they were built.
    let sure = matches!(dialect, Dialect::Grbl | Dialect::FluidNc);
    let (mut unknown, mut probes) = (Repeated::default(), Repeated::default());
    for line in job.lines().iter().filter(|line| line.turn != Turn::AtRest) {
        for (letter, value) in words(&line.text) {
            let tenths = (value * 10.0).round() as i64;
            let known = match (letter, dialect) {
                ('G', _) => GRBL_G.contains(&tenths) || dialect == Dialect::Marlin && tenths % 10 == 0,
                // Marlin has hundreds of them, printers' own among them.
                ('M', Dialect::Marlin) => true,
                ('M', Dialect::FluidNc) => GRBL_M.contains(&tenths) || FLUIDNC_M.contains(&tenths),
                ('M', _) => GRBL_M.contains(&tenths),
                _ => true,
            };
            if letter == 'G' && (382..=385).contains(&tenths) {
                probes.add(Severity::Warning, Unit::Line, line.number, || {
                    "probes (G38), and a pen holder has no probe: the plotter would stop with an alarm".into()
                });
            }
            if !known {
                let severity = if sure { Severity::Error } else { Severity::Warning };
                unknown.add(severity, Unit::Line, line.number, || {
                    let code =
                        if value.fract() == 0.0 { format!("{letter}{value:.0}") } else { format!("{letter}{value}") };
                    let not = if sure { "does not know" } else { "may not know" };
                    let advice = match code.as_str() {
                        "M6" => "; have the pen changed with M0",
                        "G5" => "; write curves as lines or arcs",
                        _ => "",
                    };
                    format!("has {code}, which {} {not}{advice}", dialect.name())
                });
            }
        }
    }
    [probes, unknown].into_iter().filter_map(|found| found.finish(Unit::Line)).collect()
}

/// `$` lines, which are GRBL's.
fn system_lines(job: &Job) -> Option<Finding> {
    let mut found = Repeated::default();
    for line in job.lines().iter().filter(|line| line.turn == Turn::AtRest) {
        found.add(Severity::Error, Unit::Line, line.number, || {
            format!("is a command of GRBL, `{}`, and Marlin has none such", line.text)
        });
    }
    found.finish(Unit::Line)
}

/// A job that goes further than the travel.
fn extent(trace: &Trace, device: &Device) -> Option<Finding> {
    let (low, high) = trace.extent()?;
    let [width_mm, height_mm] = device.travel_mm?;
    let reach = device.place(Page { width_mm, height_mm }).ok()?;
    let (travel, size) = (reach.max_mm - reach.min_mm, high - low);
    let text = |low: DVec2, high: DVec2| {
        format!("x from {:.1} to {:.1} and y from {:.1} to {:.1} mm", low.x, high.x, low.y, high.y)
    };
    if size.cmpgt(travel + SLACK_MM).any() {
        let what = format!(
            "it goes over {}, further than the travel of `{}`, {:.0} × {:.0} mm (travel_mm)",
            text(low, high),
            device.name,
            travel.x,
            travel.y
        );
        return Some(whole(Severity::Error, what));
    }
    let outside = low.cmplt(reach.min_mm - SLACK_MM).any() || high.cmpgt(reach.max_mm + SLACK_MM).any();
    outside.then(|| {
        let what = format!(
            "it goes over {}, and from its zero `{}` reaches {}: is the zero where the job wants it (origin, axes)?",
            text(low, high),
            device.name,
            text(reach.min_mm, reach.max_mm)
        );
        whole(Severity::Warning, what)
    })
}

/// What is wrong with a job for a controller that has told of itself.
#[must_use]
pub fn told(job: &Job, device: &Device, language: &Gcode, told: &Told) -> Vec<Finding> {
    let mut findings = Vec::new();
    let mut add = |severity, what: String| findings.push(whole(severity, what));
    let setting = |number: u32| told.setting(number);
    if let Some(bytes) = told.rx_bytes {
        let longest = job.lines().iter().max_by_key(|line| line.text.len());
        if let Some(line) = longest.filter(|line| line.text.len() + 2 > bytes) {
            let what = format!("it receives {bytes} bytes at a time, and line {} is longer", line.number);
            add(Severity::Error, what);
        }
    }
    if let Pen::Servo { up, down, .. } = language.pen {
        if setting(32) == Some(1.0) {
            let what =
                "the plotter is in laser mode ($32=1), where a servo moves too early: switch it off with `$32=0`";
            add(Severity::Error, what.into());
        }
        if let (Some(most), Some(least)) = (setting(30), setting(31)) {
            // S0 switches the output off, and all else is limited to the range.
            let level = |s: u32| if s == 0 { 0.0 } else { f64::from(s).clamp(least.min(most), most) };
            let limits = format!("S{up} and S{down} of the pen, with $30={most} and $31={least}");
            if level(up) == level(down) {
                add(
                    Severity::Error,
                    format!("{limits}, are the same to the plotter: set $30, or the levels in [gcode.pen]"),
                );
            } else if [up, down].iter().any(|s| level(*s) != f64::from(*s)) {
                add(Severity::Warning, format!("{limits}, are cut to that range"));
            }
        }
    }
    let soft_limits = setting(20).is_some_and(|value| value != 0.0);
    if let (Some((low, high)), Some(x), Some(y)) = (trace(job, device, language).extent(), setting(130), setting(131)) {
        let size = high - low;
        if size.cmpgt(DVec2::new(x, y) + SLACK_MM).any() {
            let what = format!(
                "the job takes {:.1} × {:.1} mm, more than the plotter's travel of {x} × {y} mm ($130, $131){}",
                size.x,
                size.y,
                if soft_limits { ", which it holds to ($20)" } else { "" }
            );
            add(if soft_limits { Severity::Error } else { Severity::Warning }, what);
        }
    }
    if let (Pen::Z { up_mm, down_mm, .. }, Some(z)) = (language.pen, setting(132))
        && up_mm - down_mm > z
    {
        let severity = if soft_limits { Severity::Error } else { Severity::Warning };
        let way = up_mm - down_mm;
        add(severity, format!("the pen moves by {way} mm, more than the plotter's travel along z, {z} mm ($132)"));
    }
    findings
}
