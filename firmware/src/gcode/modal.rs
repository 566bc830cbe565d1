//! The modal state: what a line leaves behind for the next.

use crate::axis::AXES;
use crate::storage::SYSTEMS;

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

/// Group 5: what F means.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum FeedMode {
    /// G94: mm/min.
    #[default]
    PerMinute,
    /// G93: motions a minute; each G1, G2 and G3 has its own.
    InverseTime,
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
    /// M7 and M8 are accepted and remembered; there is nothing to cool.
    pub(crate) mist: bool,
    pub(crate) flood: bool,
    pub(crate) feed_mode: FeedMode,
    /// mm/min; 0 while none has been given, and always with G93.
    pub(crate) feed: f64,
    /// S word, ≥ 0.
    pub(crate) speed: f64,
    pub(crate) tool: u8,
    /// The last N word.
    pub(crate) line: u32,
    /// G54 to G59, from 0.
    pub(crate) system: usize,
    /// G92, mm.
    pub(crate) offset: [f64; AXES],
    /// G43.1, mm of Z.
    pub(crate) tool_length: f64,
    /// Where the last accepted motion ends, machine mm.
    pub(crate) position: [f64; AXES],
}

impl GcodeState {
    /// What a work position lacks of the machine position, mm: work = machine − this. `systems` are the origins of G54 to G59.
    pub(crate) fn work_offset(&self, systems: &[[f64; AXES]; SYSTEMS]) -> [f64; AXES] {
        let mut sum = systems.get(self.system).copied().unwrap_or_default();
        for (sum, offset) in sum.iter_mut().zip(self.offset) {
            *sum += offset;
        }
        sum[2] += self.tool_length;
        sum
    }

    /// M2 and M30: G1, G17, G54, G90, G94, M5 and M9 again; units, feed, offsets and position stay.
    pub(crate) fn end_program(&mut self) {
        self.motion = Motion::Linear;
        self.plane = Plane::Xy;
        self.system = 0;
        self.distance = Distance::Absolute;
        self.feed_mode = FeedMode::PerMinute;
        self.spindle = Spindle::Off;
        (self.mist, self.flood) = (false, false);
    }
}
