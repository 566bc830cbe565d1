//! Jobs against simulated plotters with which something goes wrong: what may come of it, and what may not.
//!
//! A job is to be drawn, every stroke once, or to end with the place that failed. What the sender counts as executed must be on the
//! paper, whatever happens next. Time is virtual, and bounded.

use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::time::Duration;

use glam::{DVec2, DVec3};
use penvis::device::{self, Device, Language};
use penvis::drawing::{Drawing, Page, Polyline};
use penvis::emit;
use penvis::options::Arcs;
use penvis::pens::Pens;
use penvis::protocol::{self, Control, Progress, grbl, hpgl};
use penvis::sim::{Fault, FaultKind, Faults, Recording, SimClock, SimName, SimPort, Traffic};
use penvis::stream::{self, Clock, Observer};
use penvis::trace::gcode::{Machine, chorded};
use penvis_core::stroke::{Certainty, CurveKind};

use crate::ink::Ink;

/// Largest distance in mm between ink that is there and ink that should be: a step, and the rounding of the job.
const DEVIATION_MM: f64 = 0.06;

/// Part of the ink that may be too much, for pieces of paths in steps are a little longer than those they follow.
const EXCESS: f64 = 1.02;

/// Virtual time that a job may take beyond that of a good line, before it is stopped; the same again, and it hangs.
const PATIENCE: Duration = Duration::from_secs(1500);

/// Simulated plotters with the devices that they are plotted on.
pub const PLOTTERS: &[(&str, &str)] = &[
    ("sim", "penvis"),
    ("sim", "penvis-hpgl"),
    ("sim:grbl", "grbl-servo"),
    ("sim:grbl", "grbl-z"),
    ("sim:grbl,$10=3,rx=1024", "grbl-servo"),
    ("sim:grblhal", "grblhal"),
    ("sim:fluidnc", "fluidnc"),
    ("sim:marlin", "marlin-servo"),
    ("sim:marlin,advanced-ok=1,resend-ok=0", "marlin-z"),
    ("sim:hpgl7475a", "hp7475a"),
    ("sim:hpgl7475a,buffer=60", "hp7440a"),
];

/// What came of a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Verdict {
    /// All of it is on the paper.
    Drawn,
    /// It ended with the place that failed.
    Stopped,
    /// It ended, and nobody knows where.
    Vague,
    /// It was said to be drawn and is not.
    Wrong,
    /// Pieces were counted as executed that are not on the paper.
    Overpromised,
    /// It never ended.
    Hung,
}

impl Verdict {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Drawn, Self::Stopped, Self::Vague, Self::Wrong, Self::Overpromised, Self::Hung];

    /// Whether it may be.
    #[must_use]
    pub fn is_good(self) -> bool {
        matches!(self, Self::Drawn | Self::Stopped)
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Drawn => "drawn",
            Self::Stopped => "stopped",
            Self::Vague => "vague",
            Self::Wrong => "wrong",
            Self::Overpromised => "overpromised",
            Self::Hung => "hung",
        })
    }
}

/// A job with something that went wrong.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// What came of it.
    pub verdict: Verdict,
    /// What the sender said, or what is wrong with the ink.
    pub message: String,
    /// What happened, where and when; empty when it did not come to that.
    pub struck: String,
}

/// A job on its way to one of [`PLOTTERS`], and what it draws when nothing goes wrong.
pub struct Bench {
    name: SimName,
    device: Device,
    job: Vec<u8>,
    page: Page,
    wanted: Ink,
    traffic: Traffic,
    took: Duration,
}

/// The end of one conversation.
struct Run {
    /// None when it hung.
    result: Option<Result<(), String>>,
    recording: Recording,
    executed: usize,
    traffic: Traffic,
    took: Duration,
    struck: String,
}

impl Bench {
    /// Plots the job once on a good line.
    ///
    /// # Errors
    /// What keeps it from being plotted even there.
    pub fn new(port: &str, device: &str) -> Result<Self, String> {
        let name = SimName::parse(port).ok_or("no simulated port")?.map_err(|e| e.to_string())?;
        let device = device::find(device).map_err(|e| e.to_string())?;
        let drawing = drawing(Arcs::Auto.in_file(&device));
        let job = match device.language {
            Language::Hpgl(_) => emit::hpgl(&drawing, &device),
            _ => emit::gcode(&drawing, &device),
        };
        let mut job = job.map_err(|e| e.to_string())?.into_bytes();
        if let Some(language) = device.language.gcode() {
            // A file has arcs, and goes to plotters without checksums as when it is plotted.
            let machine = Machine::new(&device, language);
            let chorded = chorded(&job, language.line_limit, &machine).map_err(|e| e.to_string())?;
            if chorded.arcs == 0 || !chorded.left.is_empty() {
                return Err(format!("{} arcs, and {:?} left", chorded.arcs, chorded.left));
            }
            if !Arcs::Auto.on_line(&device) {
                job = chorded.job;
            }
        }
        let wanted = Ink::new(&drawing);
        let (traffic, took) = (Traffic::default(), Duration::ZERO);
        let mut bench = Self { name, device, job, page: drawing.page, wanted, traffic, took };
        let run = bench.run(&bench.job, Faults::default(), PATIENCE * 4)?;
        match &run.result {
            Some(Ok(())) => {}
            Some(Err(message)) => return Err(message.clone()),
            None => return Err("it hangs without any fault".into()),
        }
        if let Some(problem) = bench.difference(&bench.wanted, &run.recording) {
            return Err(format!("without any fault, {problem}"));
        }
        (bench.traffic, bench.took) = (run.traffic, run.took);
        Ok(bench)
    }

    /// Virtual time that the job takes on a good line.
    #[must_use]
    pub fn took(&self) -> Duration {
        self.took
    }

    /// Plots the job with one fault, whose place and kind the seed decides.
    ///
    /// # Errors
    /// What keeps it from being plotted at all.
    pub fn try_fault(&self, kind: FaultKind, seed: u64) -> Result<Outcome, String> {
        let faults = Faults::new(&[Fault { kind, at: None }], seed, self.traffic);
        let run = self.run(&self.job, faults, self.took + PATIENCE)?;
        let struck = run.struck.clone();
        let told = |verdict, message: String| Ok(Outcome { verdict, message, struck });
        let message = match &run.result {
            None => return told(Verdict::Hung, "no end in sight".into()),
            Some(Ok(())) => {
                return match self.difference(&self.wanted, &run.recording) {
                    None => told(Verdict::Drawn, String::new()),
                    Some(problem) => told(Verdict::Wrong, problem),
                };
            }
            Some(Err(message)) => message.clone(),
        };
        if let Some(problem) = self.promised(&run)? {
            return told(Verdict::Overpromised, format!("{problem}; it said: {message}"));
        }
        let placed = [" line ", " lines ", " instruction ", " instructions ", "before the first"]
            .iter()
            .any(|place| message.contains(place));
        let begun = run.executed > 0 || run.recording.ink_mm() > 0.0;
        told(if placed || !begun { Verdict::Stopped } else { Verdict::Vague }, message)
    }

    /// What of the pieces that count as executed is missing on the paper.
    fn promised(&self, run: &Run) -> Result<Option<String>, String> {
        if run.executed == 0 {
            return Ok(None);
        }
        // As they are counted: an instruction of the file may be several.
        let pieces: Vec<u8> = match &self.device.language {
            Language::Hpgl(_) => {
                let job = hpgl::Job::new(&self.job).map_err(|e| e.to_string())?;
                job.instructions().iter().take(run.executed).flatten().copied().collect()
            }
            Language::Grbl(language) | Language::Marlin(language) => {
                let text = String::from_utf8_lossy(&self.job);
                let job = grbl::Job::new(&text, language.line_limit).map_err(|e| e.to_string())?;
                job.lines().iter().take(run.executed).flat_map(|line| line.text.bytes().chain([b'\n'])).collect()
            }
        };
        let done = self.run(&pieces, Faults::default(), PATIENCE * 4)?;
        if !matches!(done.result, Some(Ok(()))) {
            return Err(format!("the first {} pieces cannot be plotted by themselves", run.executed));
        }
        let (promised, got) = (self.ink(&done.recording), self.ink(&run.recording));
        let missing = promised.farthest_from(&got).filter(|(distance, _)| *distance > DEVIATION_MM);
        Ok(missing.map(|(distance, at)| {
            format!(
                "of {} pieces executed, ink {distance:.2} mm from ({:.1}, {:.1}) is missing",
                run.executed, at.x, at.y
            )
        }))
    }

    /// What is wrong with what was drawn; none when it is all there, once.
    fn difference(&self, wanted: &Ink, recording: &Recording) -> Option<String> {
        let got = self.ink(recording);
        let far = |a: &Ink, b: &Ink| a.farthest_from(b).filter(|(distance, _)| *distance > DEVIATION_MM);
        if let Some((distance, at)) = far(wanted, &got) {
            return Some(format!("ink is missing: {distance:.2} mm at ({:.1}, {:.1})", at.x, at.y));
        }
        if let Some((distance, at)) = far(&got, wanted) {
            return Some(format!(
                "there is ink where none should be: {distance:.2} mm off at ({:.1}, {:.1})",
                at.x, at.y
            ));
        }
        let ratio = got.length_mm() / wanted.length_mm();
        (ratio > EXCESS).then(|| format!("{ratio:.3} times the ink"))
    }

    fn ink(&self, recording: &Recording) -> Ink {
        // The page fits: the job was made for it.
        let place = self.device.place(self.page).expect("the page fits");
        Ink::new(&recording.drawing("ink", self.page, &place))
    }

    fn run(&self, job: &[u8], faults: Faults, limit: Duration) -> Result<Run, String> {
        let mut port = SimPort::with(self.name.peer(&self.device).map_err(|e| e.to_string())?, self.device.baud);
        port.set_faults(faults);
        let clock = port.clock();
        let mut conversation = protocol::start(job, &self.device, self.device.baud).map_err(|e| e.to_string())?;
        let mut user = User { clock: clock.clone(), limit, stop: false };
        let run = || stream::run(&mut port, conversation.protocol.as_mut(), &clock, &mut user);
        let result = match catch_unwind(AssertUnwindSafe(run)) {
            Ok(result) => Some(result.map_err(|e| e.to_string())),
            Err(panic) if panic.is::<Hang>() => None,
            Err(panic) => resume_unwind(panic),
        };
        let struck: Vec<_> = port.faults().struck().iter().map(ToString::to_string).collect();
        Ok(Run {
            result,
            recording: port.recording(),
            executed: conversation.protocol.progress().executed,
            traffic: port.traffic(),
            took: clock.now(),
            struck: struck.join(", "),
        })
    }
}

/// What a conversation without an end is thrown out with.
struct Hang;

/// Goes on after every pause, and has no patience without end.
struct User {
    clock: SimClock,
    limit: Duration,
    stop: bool,
}

impl Observer for User {
    fn progress(&mut self, _: Progress) {}

    fn message(&mut self, text: &str) {
        // Nobody puts the paper back.
        self.stop |= text.contains("lever");
    }

    fn control(&mut self) -> Option<Control> {
        let now = self.clock.now();
        if now > self.limit + PATIENCE {
            resume_unwind(Box::new(Hang));
        }
        (self.stop || now > self.limit).then_some(Control::Stop)
    }

    fn prompt(&mut self, _: &str) -> bool {
        true
    }

    fn paused(&mut self, _: bool) {}
}

/// Strokes of all kinds, each a few mm from the others: short and long ones, curves, corners, and dots. Circles are so fine that they are written as
/// arcs if there are to be `arcs`.
fn drawing(arcs: bool) -> Drawing {
    let v = DVec2::new;
    let fine = if arcs { 10 } else { 1 };
    let circle = |centre: DVec2, r: f64, count: u32| {
        (0..=count)
            .map(|k| centre + r * DVec2::from_angle(f64::from(k) / f64::from(count) * std::f64::consts::TAU))
            .collect()
    };
    let mut lines: Vec<Vec<DVec2>> = vec![
        vec![v(30.0, 30.0), v(60.0, 30.0), v(60.0, 45.0), v(30.0, 45.0), v(30.0, 30.0)],
        circle(v(80.0, 40.0), 9.0, 40 * fine),
        (0..20).map(|k| v(100.0 + 2.0 * f64::from(k), 30.0 + f64::from(k % 2) * 7.5)).collect(),
        vec![v(105.0, 50.0), v(105.0, 50.0)],
        circle(v(45.0, 70.0), 4.0, 24 * fine),
        // Longer than what most of the plotters plan ahead, so that lines count as executed while it is drawn.
        (0..120).map(|k| v(70.0, 75.0) + 0.13 * f64::from(k) * DVec2::from_angle(0.25 * f64::from(k))).collect(),
        vec![v(110.0, 60.0), v(135.5, 88.25)],
        vec![v(120.0, 60.0), v(120.5, 60.0)],
    ];
    for k in 0..6 {
        let x = 30.0 + 18.0 * f64::from(k);
        lines.push((0..8).map(|i| v(x + 0.9 * f64::from(i), 110.0 + 3.0 * (f64::from(i) * 0.8).sin())).collect());
    }
    let polylines = lines.into_iter().enumerate().map(|(surface, page)| Polyline {
        kind: Some(CurveKind::Boundary),
        surface,
        layer: "ink".into(),
        pen: 1,
        level: 0,
        visible: true,
        qi: 0,
        certainty: Certainty::Proven,
        points: page.iter().map(|p| DVec3::new(p.x, p.y, 0.0)).collect(),
        page,
    });
    let page = Page { width_mm: 297.0, height_mm: 210.0 };
    Drawing {
        name: "faults".into(),
        page,
        isos: 0,
        pens: Pens::default(),
        slack_mm: if arcs { 0.0075 } else { 0.0 },
        polylines: polylines.collect(),
    }
}
