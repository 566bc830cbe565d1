//! What a job does, piece by piece, before a byte of it is sent: where the pen is after each piece, whether it draws, and for
//! how long.
//!
//! Pieces are what [`crate::protocol`] counts: the lines of a G-code job, the instructions of one in HPGL. What cannot be followed is unknown from there on,
//! until the job says it anew; it is never guessed.

pub mod gcode;
pub mod hpgl;
mod timing;

pub use timing::Pace;
pub(crate) use timing::Timer;

use glam::DVec2;

/// What a job does.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// A step for each piece of the job, in order.
    pub steps: Vec<Step>,
}

/// What a piece of a job does, and how it leaves the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Step {
    /// Position after it.
    pub end: Position,
    /// Whether the pen is down after it; none where that is unknown, or the pen is on its way between the two.
    pub pen_down: Option<bool>,
    /// Number of the pen after it, from 1.
    pub pen: u32,
    /// Length that it draws, mm; 0 where it is unknown where it begins or whether the pen is down.
    pub ink_mm: f64,
    /// Length that it moves along the paper without drawing, mm; 0 where it is unknown where it begins.
    pub travel_mm: f64,
    /// Estimate of the time that it takes, s: its motion at the speeds and the acceleration of the device, and its dwell.
    pub seconds: f64,
    /// What it is to the strokes of the job.
    pub cut: Cut,
}

/// A position in the coordinate system that the job draws in, axis by axis; unknown until the job says where it goes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Position {
    /// x in mm.
    pub x: Option<f64>,
    /// y in mm.
    pub y: Option<f64>,
    /// z in mm. Jobs for a pen that is no axis never say it.
    pub z: Option<f64>,
}

impl Position {
    /// Nothing is known.
    pub const UNKNOWN: Self = Self { x: None, y: None, z: None };

    /// The place on the paper in mm, if both coordinates are known.
    #[must_use]
    pub fn xy(self) -> Option<DVec2> {
        Some(DVec2::new(self.x?, self.y?))
    }

    pub(crate) fn axes(self) -> [Option<f64>; 3] {
        [self.x, self.y, self.z]
    }

    pub(crate) fn from_axes([x, y, z]: [Option<f64>; 3]) -> Self {
        Self { x, y, z }
    }
}

/// What a piece is to the strokes of a job. A stroke is what the pen draws from being lowered to being lifted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Cut {
    /// It begins and ends none.
    #[default]
    None,
    /// It begins to lower a pen that was up.
    StrokeStart,
    /// It lifts a pen that was not up, or not known to be; a dwell for the pen may follow it.
    StrokeEnd,
}

impl Trace {
    /// Length that is drawn, mm.
    #[must_use]
    pub fn ink_mm(&self) -> f64 {
        self.steps.iter().map(|step| step.ink_mm).sum()
    }

    /// Length of the motion along the paper that draws nothing, mm.
    #[must_use]
    pub fn travel_mm(&self) -> f64 {
        self.steps.iter().map(|step| step.travel_mm).sum()
    }

    /// Estimate of the time that the job takes, s.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.steps.iter().map(|step| step.seconds).sum()
    }

    /// What is between the edges of the known positions, mm: the least and the greatest x and y; none without any.
    #[must_use]
    pub fn extent(&self) -> Option<(DVec2, DVec2)> {
        let mut places = self.steps.iter().filter_map(|step| step.end.xy());
        let first = places.next()?;
        Some(places.fold((first, first), |(low, high), at| (low.min(at), high.max(at))))
    }
}
