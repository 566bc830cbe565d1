//! The state that one line leaves behind for the next.

/// What a controller remembers from line to line, as far as the job tells; nothing of it is known by default.
#[derive(Clone, Debug, PartialEq)]
pub struct Modal {
    /// G20, G21.
    pub units: Option<Units>,
    /// G90, G91.
    pub distance: Option<Distance>,
    /// What axis words alone do.
    pub motion: Option<Motion>,
    /// Plane of arcs.
    pub plane: Option<Plane>,
    /// G93, G94.
    pub feed_mode: Option<FeedMode>,
    /// Feed in mm/min; none in inverse time mode, where each line has its own.
    pub feed: Option<f64>,
    /// S word: speed of the spindle, or place of a servo on its output.
    pub speed: Option<f64>,
    /// M3, M4, M5.
    pub spindle: Option<Spindle>,
    /// Angle of Marlin's servo (M280), degrees.
    pub servo: Option<f64>,
    /// Which of the origins is in force.
    pub coordinates: Option<Coordinates>,
    /// How far G92 has moved the origin since the job began, mm along x, y and z; none once that is unknown.
    pub shift: [Option<f64>; 3],
}

impl Default for Modal {
    fn default() -> Self {
        Self {
            units: None,
            distance: None,
            motion: None,
            plane: None,
            feed_mode: None,
            feed: None,
            speed: None,
            spindle: None,
            servo: None,
            coordinates: None,
            shift: [Some(0.0); 3],
        }
    }
}

impl Modal {
    /// The state of GRBL after a reset.
    #[must_use]
    pub fn after_reset() -> Self {
        Self {
            units: Some(Units::Millimetres),
            distance: Some(Distance::Absolute),
            motion: Some(Motion::Rapid),
            plane: Some(Plane::Xy),
            feed_mode: Some(FeedMode::PerMinute),
            feed: Some(0.0),
            speed: Some(0.0),
            spindle: Some(Spindle::Off),
            servo: None,
            coordinates: Some(Coordinates(54)),
            ..Self::default()
        }
    }

    /// What M2 and M30 restore: G1, G17, G90, G94, G54, M5.
    pub(super) fn end_program(&mut self) {
        self.motion = Some(Motion::Linear);
        self.plane = Some(Plane::Xy);
        self.distance = Some(Distance::Absolute);
        self.feed_mode = Some(FeedMode::PerMinute);
        self.spindle = Some(Spindle::Off);
        self.coordinates = Some(Coordinates(54));
    }
}

/// Units of lengths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Units {
    /// G21.
    Millimetres,
    /// G20.
    Inches,
}

impl Units {
    /// Millimetres in one unit.
    #[must_use]
    pub const fn mm(self) -> f64 {
        match self {
            Self::Millimetres => 1.0,
            Self::Inches => 25.4,
        }
    }
}

/// What coordinates are measured from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distance {
    /// G90: the origin.
    Absolute,
    /// G91: the place before.
    Incremental,
}

/// What axis words without a G word do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// G0.
    Rapid,
    /// G1.
    Linear,
    /// G2.
    ArcClockwise,
    /// G3.
    ArcCounterClockwise,
    /// G38.2 to G38.5.
    Probe,
    /// G80: they are an error.
    Cancelled,
}

/// The plane that arcs lie in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plane {
    /// G17.
    Xy,
    /// G18.
    Zx,
    /// G19.
    Yz,
}

impl Plane {
    /// First axis, second axis, and the axis across; right-handed.
    pub(super) const fn axes(self) -> [usize; 3] {
        match self {
            Self::Xy => [0, 1, 2],
            Self::Zx => [2, 0, 1],
            Self::Yz => [1, 2, 0],
        }
    }
}

/// What F means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeedMode {
    /// G93: the inverse of the minutes that the line takes.
    InverseTime,
    /// G94: units a minute.
    PerMinute,
}

/// The spindle's output, which turns a pen's servo on some machines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spindle {
    /// M5.
    Off,
    /// M3.
    Clockwise,
    /// M4.
    CounterClockwise,
}

/// One of the origins that a controller holds: the number of its G word, 54 to 59.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Coordinates(pub u8);
