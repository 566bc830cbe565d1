//! Says what would go wrong with a job before it is sent.

use serialport::SerialPort;

use super::{Job, PlotError};
use crate::device::{Device, Language};
use crate::interrupt;
use crate::preflight::{Check, Finding, Probe, Severity, Window, told};
use crate::protocol::{Control, Progress, Protocol};
use crate::protocol::{grbl, hpgl};
use crate::stream::{self, Clock, Observer};

/// Prints what was found, a line each; the first error is that of the command.
///
/// # Errors
/// [`PlotError::Preflight`] if the job must not be sent.
pub(super) fn report(job: &Job, findings: &[Finding]) -> Result<(), PlotError> {
    let first = findings.iter().find(|finding| finding.severity == Severity::Error);
    for finding in findings.iter().filter(|finding| first != Some(*finding)) {
        eprintln!("{}: {finding}", job.name);
    }
    match first {
        None => Ok(()),
        Some(finding) => Err(PlotError::Preflight { name: job.name.clone(), what: finding.text() }),
    }
}

/// Asks the plotter at a port for what matters to the job, and with `check` lets it read all of the job; nothing moves.
/// GRBL tells its settings, and HPGL plotters tell where their pens can go.
///
/// # Errors
/// As [`report`], and what went wrong on the way.
pub(super) fn ask(
    port: &mut dyn SerialPort,
    clock: &dyn Clock,
    job: &Job,
    device: &Device,
    check: bool,
) -> Result<(), PlotError> {
    let bad = |source| PlotError::Job { name: job.name.clone(), source };
    let mut converse = |protocol: &mut dyn Protocol| {
        stream::run(port, protocol, clock, &mut Unwatched)
            .map_err(|source| PlotError::Stream { name: job.name.clone(), source })
    };
    let language = match &device.language {
        Language::Grbl(language) => language,
        language if check => {
            return Err(PlotError::Check { device: device.name.clone(), speaks: language.name() });
        }
        Language::Hpgl(_) => {
            let instructions = hpgl::Job::new(&job.bytes).map_err(|source| bad(source.into()))?;
            let mut window = Window::default();
            converse(&mut window)?;
            return report(job, &window.findings(&instructions));
        }
        Language::Marlin(_) => return Ok(()),
    };
    let lines = grbl::Job::new(&String::from_utf8_lossy(&job.bytes), language.line_limit)
        .map_err(|source| bad(source.into()))?;
    let mut probe = Probe::new();
    converse(&mut probe)?;
    report(job, &told(&lines, device, language, probe.told()))?;
    if check {
        let rx_bytes = probe.told().rx_bytes.unwrap_or(language.rx_bytes);
        let mut check = Check::new(lines, rx_bytes);
        converse(&mut check)?;
        report(job, &check.findings())?;
    }
    Ok(())
}

/// Lets a conversation come to its end unless Ctrl-C stops it.
pub(super) struct Unwatched;

impl Observer for Unwatched {
    fn progress(&mut self, _: Progress) {}

    fn message(&mut self, _: &str) {}

    fn control(&mut self) -> Option<Control> {
        interrupt::is_wanted().then_some(Control::Stop)
    }

    fn prompt(&mut self, _: &str) -> bool {
        true
    }

    fn paused(&mut self, _: bool) {}
}
