//! HPGL against a profile.

use super::{Finding, Repeated, Severity, whole};
use crate::device::{Device, Handshake, Hpgl};
use crate::protocol::Unit;
use crate::protocol::hpgl::{Holders, Job, RESERVE};
use crate::trace::hpgl::{Action, Motion, Path, State};

/// What is wrong with a job for a device.
pub(super) fn job(job: &Job, device: &Device, language: &Hpgl) -> Vec<Finding> {
    let mut state = State::unknown();
    let (mut unfollowed, mut lists, mut long, mut pens, mut speeds) = Default::default();
    let (unfollowed, lists, long): (&mut Repeated, &mut Repeated, &mut Repeated) =
        (&mut unfollowed, &mut lists, &mut long);
    let (pens, speeds): (&mut Repeated, &mut Repeated) = (&mut pens, &mut speeds);
    for (index, swap) in Holders::new(device.pens).follow(job, usize::MAX) {
        pens.add(Severity::Warning, Unit::Instruction, index + 1, || {
            format!(
                "takes pen {}, and `{}` holds {}: the plot stops there until it is in holder {}",
                swap.pen, device.name, device.pens, swap.holder
            )
        });
    }
    for (index, instruction) in job.instructions().iter().enumerate() {
        let number = index + 1;
        let action = state.follow(instruction);
        let verbatim = match action {
            Action::Move(Motion { path: Path::Unknown, .. }) => {
                let points = instruction.iter().filter(|byte| **byte == b',').count().div_ceil(2);
                if points > language.list_points {
                    lists.add(Severity::Warning, Unit::Instruction, number, || {
                        format!(
                            "has a list of {points} points, and `{}` takes {} (list_points)",
                            device.name, language.list_points
                        )
                    });
                }
                true
            }
            Action::Unknown => true,
            _ => false,
        };
        if let (Some(speed), Some(fastest)) = (state.speed, language.speed_max)
            && speed > f64::from(fastest)
            && instruction.get(..2).is_some_and(|word| word.eq_ignore_ascii_case(b"VS"))
        {
            speeds.add(Severity::Warning, Unit::Instruction, number, || {
                format!("sets {speed} cm/s, and `{}` draws at {fastest} at most (speed_max)", device.name)
            });
        }
        if verbatim {
            unfollowed.add(Severity::Warning, Unit::Instruction, number, || {
                "leaves the pen where only the plotter knows: what is lost on the line there is not noticed".into()
            });
            if instruction.len() + RESERVE > language.buffer_bytes {
                let severity = if language.handshake == Handshake::Oa { Severity::Error } else { Severity::Warning };
                long.add(severity, Unit::Instruction, number, || {
                    format!(
                        "has {} bytes, more than the buffer of `{}`, {} bytes: only a plotter that says when it is full can take it",
                        instruction.len(),
                        device.name,
                        language.buffer_bytes
                    )
                });
            }
        }
    }
    let mut findings = Vec::new();
    let begins_anew = job.instructions().first().is_some_and(|first| {
        first.get(..2).is_some_and(|word| word.eq_ignore_ascii_case(b"IN") || word.eq_ignore_ascii_case(b"DF"))
    });
    if !begins_anew {
        let what =
            "it does not begin with IN; or DF;, so that an earlier job may have scaled or turned its coordinates";
        findings.push(whole(Severity::Warning, what.into()));
    }
    findings.extend(reached(job).and_then(|reached| limits(reached, device)));
    let repeated = [pens, speeds, lists, long, unfollowed];
    findings.extend(repeated.into_iter().filter_map(|found| std::mem::take(found).finish(Unit::Instruction)));
    findings
}

/// The least and the greatest coordinates that a job goes to, in plotter units, as far as they are known.
pub(super) fn reached(job: &Job) -> Option<[[i64; 2]; 2]> {
    let mut state = State::unknown();
    let mut reached: Option<[[i64; 2]; 2]> = None;
    for instruction in job.instructions() {
        let Action::Move(Motion { path: Path::Through(points), .. }) = state.follow(instruction) else { continue };
        for point in points {
            let [low, high] = reached.get_or_insert([point; 2]);
            for axis in 0..2 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
    }
    reached
}

/// A job that leaves the hard-clip limits.
fn limits([low, high]: [[i64; 2]; 2], device: &Device) -> Option<Finding> {
    let holds = |paper: &&crate::device::Paper| {
        let ranges = [paper.x_range, paper.y_range];
        (0..2).all(|axis| i64::from(ranges[axis][0]) <= low[axis] && high[axis] <= i64::from(ranges[axis][1]))
    };
    let fit: Vec<_> = device.papers.iter().filter(holds).map(|paper| paper.name.as_str()).collect();
    let all: Vec<_> = device.papers.iter().map(|paper| paper.name.as_str()).collect();
    if fit.len() == all.len() {
        return None;
    }
    let reach = format!("it goes from ({}, {}) to ({}, {})", low[0], low[1], high[0], high[1]);
    Some(if fit.is_empty() {
        let what =
            format!("{reach}, outside of the hard-clip limits of every paper of `{}`: {}", device.name, all.join(", "));
        whole(Severity::Error, what)
    } else {
        whole(Severity::Warning, format!("{reach}, within the hard-clip limits of {} only", fit.join(", ")))
    })
}
