//! What a good line asks for.

use crate::axis::AXES;
use crate::gcode::Arc;

/// How fast a motion is meant to go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Speed {
    /// As fast as the axes allow.
    Rapid,
    /// mm/min along the path.
    Feed(f64),
}

/// The motion of a line, in machine mm.
#[derive(Clone, Debug)]
pub(crate) enum Path {
    /// A straight line; G28 and G30 go to another place before (`via`).
    Line { via: Option<[f64; AXES]>, target: [f64; AXES], speed: Speed },
    /// An arc or helix.
    Arc(Arc),
}

/// M0, M2 and M30.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Flow {
    /// Go on.
    #[default]
    Run,
    /// M0: stop until `~`.
    Pause,
    /// M0 has stopped.
    Paused,
    /// M2, M30.
    End,
}

/// What the pen is to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum PenOrder {
    /// M5.
    Off,
    /// M3 and M4 with this S.
    Speed(f64),
}

/// What is to be kept in the storage, in machine mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Keep {
    /// G10 L2 and L20: the origin of a coordinate system, from 0 for G54.
    System(usize, [f64; AXES]),
    /// G28.1 (0) and G30.1 (1).
    Place(usize, [f64; AXES]),
}

/// What a good line asks for, in the order in which it is done.
#[derive(Clone, Debug, Default)]
pub(crate) struct Actions {
    pub(crate) pen: Option<PenOrder>,
    /// Seconds.
    pub(crate) dwell: Option<f64>,
    pub(crate) keep: Option<Keep>,
    pub(crate) motion: Option<Path>,
    pub(crate) flow: Flow,
}
