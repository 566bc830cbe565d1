//! From a device and a job to the conversation that they need.

use thiserror::Error;

use super::{Protocol, grbl, hpgl, marlin};
use crate::device::{Device, Gcode, Language, MM_MIN_PER_CM_S, Pen};
use crate::trace::gcode::Machine;

/// A conversation that has not begun.
pub struct Conversation {
    /// Says what is to be said.
    pub protocol: Box<dyn Protocol>,
    /// First line or instruction at which the job waits for its user, from 1.
    pub first_pause: Option<usize>,
}

/// A job that must not be sent.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum JobError {
    /// G-code.
    #[error(transparent)]
    Gcode(#[from] grbl::JobError),
    /// HPGL.
    #[error(transparent)]
    Hpgl(#[from] hpgl::JobError),
}

/// Checks a job, in the language of the device, and gets ready to send it. `baud` is the speed of the line.
///
/// # Errors
/// [`JobError`]: the job must not be sent.
pub fn start(job: &[u8], device: &Device, baud: u32) -> Result<Conversation, JobError> {
    match &device.language {
        Language::Grbl(gcode) => {
            let (job, first_pause) = gcode_job(job, gcode)?;
            let options = grbl::Options {
                rx_bytes: gcode.rx_bytes,
                line_limit: gcode.line_limit,
                streaming: gcode.streaming,
                machine: Machine::new(device, gcode),
                servo: matches!(gcode.pen, Pen::Servo { .. }),
                lift: lift(&gcode.pen),
                baud,
            };
            Ok(Conversation { protocol: Box::new(grbl::Grbl::new(job, options)), first_pause })
        }
        Language::Marlin(gcode) => {
            let (job, first_pause) = gcode_job(job, gcode)?;
            let options = marlin::Options {
                rx_bytes: gcode.rx_bytes,
                buffer_lines: gcode.buffer_lines,
                machine: Machine::new(device, gcode),
                lift: std::iter::once("G90".to_owned()).chain(gcode.pen_up()).collect(),
                baud,
            };
            Ok(Conversation { protocol: Box::new(marlin::Marlin::new(job, options)), first_pause })
        }
        Language::Hpgl(language) => {
            let options = hpgl::Options {
                name: device.name.clone(),
                buffer_bytes: language.buffer_bytes,
                list_points: language.list_points,
                encoded: language.encoded,
                pens: device.pens,
                handshake: language.handshake,
                speeds: language.speed_max.map(|fastest| (device.draw_feed / MM_MIN_PER_CM_S, fastest)),
                baud,
            };
            let job = hpgl::Job::new(job)?;
            let first_pause = hpgl::Holders::new(device.pens).follow(&job, usize::MAX).next().map(|(at, _)| at + 1);
            Ok(Conversation { protocol: Box::new(hpgl::Hpgl::new(job, options)), first_pause })
        }
    }
}

/// The lines of a job, and the number of the first at which it waits for its user.
fn gcode_job(job: &[u8], gcode: &Gcode) -> Result<(grbl::Job, Option<usize>), JobError> {
    let job = grbl::Job::new(&String::from_utf8_lossy(job), gcode.line_limit)?;
    let pause = job.lines().iter().find(|line| matches!(line.turn, grbl::Turn::Pause(_)));
    let first_pause = pause.map(|line| line.number);
    Ok((job, first_pause))
}

/// Lines that lift the pen after a reset, which leaves the controller with its defaults: G21, G90.
fn lift(pen: &Pen) -> Vec<String> {
    match pen {
        Pen::Servo { up, .. } => vec![format!("M3S{up}")],
        Pen::Z { up_mm, .. } => vec![format!("G21G90G0Z{up_mm:.3}")],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::find;

    #[test]
    fn each_device_has_its_language() {
        for name in crate::device::names() {
            let device = find(name).unwrap();
            let (right, wrong): (&[u8], &[u8]) = match device.language {
                Language::Grbl(_) | Language::Marlin(_) => (b"G21\n(c)\nM0\n", b"; \n"),
                Language::Hpgl(_) => (b"IN;", b"12"),
            };
            let conversation = start(right, &device, 9600).unwrap();
            assert_eq!(conversation.first_pause.is_some(), device.language.gcode().is_some());
            assert!(start(wrong, &device, 9600).is_err());
        }
        assert_eq!(start(b"G21\n(c)\nM0\n", &find("penvis").unwrap(), 9600).unwrap().first_pause, Some(3));
    }

    #[test]
    fn the_pen_is_lifted_as_it_is_made() {
        assert_eq!(
            lift(&Pen::Servo { index: 0, up: 5, down: 90, raise_s: 0.1, lower_s: 0.1, soft_steps: 1 }),
            ["M3S5"]
        );
        assert_eq!(
            lift(&Pen::Z { up_mm: 3.0, down_mm: 0.0, feed: 1.0, soft_mm: 0.0, soft_feed: 1.0 }),
            ["G21G90G0Z3.000"]
        );
    }
}
