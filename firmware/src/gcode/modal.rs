//! The modal state: what a line leaves behind for the next.

use crate::axis::AXES;

/// Group 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Motion {
    /// G0.
    #[default]
    Rapid,
    /// G1.
    Linear,
    /// G2.
    ArcClockwise,
    /// G3.
    ArcCounterClockwise,
    /// G80: axis words alone are an error.
    Cancelled,
}

/// Group 2.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Plane {
    /// G17.
    #[default]
    Xy,
    /// G18.
    Zx,
    /// G19.
    Yz,
}

impl Plane {
    /// First axis, second axis, and the axis of the helix; right-handed.
    pub(crate) const fn axes(self) -> [usize; AXES] {
        match self {
            Self::Xy => [0, 1, 2],
            Self::Zx => [2, 0, 1],
            Self::Yz => [1, 2, 0],
        }
    }
}

/// Group 6.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Units {
    /// G21.
    #[default]
    Millimetres,
    /// G20.
    Inches,
}

impl Units {
    /// Millimetres in one unit.
    pub(crate) const fn mm(self) -> f64 {
        match self {
            Self::Millimetres => 1.0,
            Self::Inches => 25.4,
        }
    }
}

/// Group 3.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Distance {
    /// G90.
    #[default]
    Absolute,
    /// G91.
    Incremental,
}

/// Group 7 of the M codes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Spindle {
    /// M5.
    #[default]
    Off,
    /// M3.
    Clockwise,
    /// M4; for a pen the same as M3.
    CounterClockwise,
}

/// The state that interpretation reads and, for a good line, replaces.
#[derive(Clone, Debug, Default)]
pub(crate) struct GcodeState {
    pub(crate) motion: Motion,
    pub(crate) plane: Plane,
    pub(crate) units: Units,
    pub(crate) distance: Distance,
    pub(crate) spindle: Spindle,
    /// M8 is accepted and remembered; there is nothing to cool.
    pub(crate) coolant: bool,
    /// mm/min; 0 while none has been given.
    pub(crate) feed: f64,
    /// S word, ≥ 0.
    pub(crate) speed: f64,
    pub(crate) tool: u8,
    /// The last N word.
    pub(crate) line: u32,
    /// G92: work = machine − offset, mm.
    pub(crate) offset: [f64; AXES],
    /// Where the last accepted motion ends, machine mm.
    pub(crate) position: [f64; AXES],
}

impl GcodeState {
    /// M2 and M30: G1, G17, G90, M5 and M9 again; units, feed, offsets and position stay.
    pub(crate) fn end_program(&mut self) {
        self.motion = Motion::Linear;
        self.plane = Plane::Xy;
        self.distance = Distance::Absolute;
        self.spindle = Spindle::Off;
        self.coolant = false;
    }
}
