//! What a profile file may say, and the checked profile made from it.

use serde::{Deserialize, Serialize};

use super::DeviceError;
use super::gcode::{Gcode, RawGcode, Wrong, nonzero, positive, wrong};
use super::source::Sources;
use super::template;

/// The language a plotter speaks, with what is particular to it.
#[derive(Clone, Debug, PartialEq)]
pub enum Language {
    /// G-code with GRBL's line protocol.
    Grbl(Gcode),
    /// G-code with Marlin's line protocol.
    Marlin(Gcode),
    /// HPGL.
    Hpgl(Hpgl),
}

impl Language {
    /// The word for it in profiles.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Grbl(_) => "grbl",
            Self::Marlin(_) => "marlin",
            Self::Hpgl(_) => "hpgl",
        }
    }

    /// What is particular to it when it is G-code.
    #[must_use]
    pub fn gcode(&self) -> Option<&Gcode> {
        match self {
            Self::Grbl(gcode) | Self::Marlin(gcode) => Some(gcode),
            Self::Hpgl(_) => None,
        }
    }
}

/// What is particular to an HPGL plotter.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hpgl {
    /// Length of a plotter unit in mm.
    pub unit_mm: f64,
    /// Size of the plotter's buffer in bytes.
    pub buffer_bytes: usize,
    /// Points in one `PD` list, at most; long lists overflow some parsers.
    pub list_points: usize,
    /// Whether the plotter takes `PE`, polylines in base 32, as HP-GL/2 plotters do.
    #[serde(default)]
    pub encoded: bool,
    /// Instructions before the drawing.
    pub start: String,
    /// Instructions after the drawing.
    pub end: String,
    /// Instructions that take a pen; `{pen}` stands for its number.
    pub pen_change: String,
    /// How the plotter's buffer is kept from overflowing.
    #[serde(default)]
    pub handshake: Handshake,
    /// Fastest speed that `VS` takes, in cm/s; none when the plotter has no such instruction.
    pub speed_max: Option<u32>,
    /// Largest force that `FS` takes, in its steps from 1; none when the plotter has no such instruction.
    pub force_max: Option<u32>,
    /// Time that raising the pen takes, and lowering it, in s.
    #[serde(default = "usual_lift")]
    pub lift_s: f64,
    /// Time that the plotter takes to put a pen back and take another one, in s.
    #[serde(default = "usual_change")]
    pub change_s: f64,
}

/// About what the plotters' manuals say.
fn usual_lift() -> f64 {
    0.1
}

/// Of a carousel.
fn usual_change() -> f64 {
    3.0
}

/// How an HPGL plotter's buffer is kept from overflowing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Handshake {
    /// The first of the others that the plotter knows, in their order.
    #[default]
    Auto,
    /// The free bytes are asked for (`ESC.B`).
    EscB,
    /// The plotter says when to stop and when to go on (`ESC.I`, `ESC.N`).
    XonXoff,
    /// A block is sent when the plotter has said that it has room for it (`ESC.H`).
    EnqAck,
    /// The plotter's DTR, at CTS or DSR of the port, tells whether there is room (`ESC.@`).
    Hardware,
    /// A piece is sent when the one before it is drawn (`OA`).
    Oa,
}

/// Flow control of the line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Flow {
    /// None in the line itself; the protocol counts.
    #[default]
    None,
    /// XON/XOFF.
    XonXoff,
    /// RTS/CTS.
    RtsCts,
}

/// The corner of the sheet where the machine's zero is. x grows to the right and y away from the operator in all of them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// Lower left: the sheet is at positive x and positive y.
    #[default]
    LowerLeft,
    /// Upper left: the sheet is at positive x and negative y.
    UpperLeft,
    /// Lower right: the sheet is at negative x and positive y.
    LowerRight,
    /// Upper right: the sheet is at negative x and negative y.
    UpperRight,
}

/// How the controller's axes lie to those of the operator, for whom x goes to the right and y away.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Axes {
    /// Whether the controller's x goes away from the operator and y to the right.
    pub swap: bool,
    /// Whether the controller's x (after the swap) counts the other way.
    pub invert_x: bool,
    /// Whether the controller's y (after the swap) counts the other way.
    pub invert_y: bool,
}

/// A sheet that the plotter knows, as it lies in it.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Paper {
    /// Its name, such as `a4`.
    pub name: String,
    /// Width and height in mm.
    pub size_mm: [f64; 2],
    /// Reach along x in plotter units, both ends included.
    pub x_range: [i32; 2],
    /// Reach along y in plotter units, both ends included.
    pub y_range: [i32; 2],
    /// Where the plotter's (0, 0) lies, in mm from the lower left corner of the sheet.
    pub origin_mm: [f64; 2],
}

/// A plotter, as its profile tells.
#[derive(Clone, Debug, PartialEq)]
pub struct Device {
    /// Its name.
    pub name: String,
    /// One line for the list of devices.
    pub description: String,
    /// What it speaks.
    pub language: Language,
    /// Speed of the line in baud.
    pub baud: u32,
    /// Flow control of the line.
    pub flow: Flow,
    /// Reach in mm along x and y; none when the papers tell it.
    pub travel_mm: Option<[f64; 2]>,
    /// Where the machine's zero is on a sheet that is not one of `papers`.
    pub origin: Origin,
    /// How the controller's axes lie.
    pub axes: Axes,
    /// Sheets it knows. Empty: any sheet within the reach.
    pub papers: Vec<Paper>,
    /// How many pens it holds.
    pub pens: u32,
    /// Feed with the pen down in mm/min.
    pub draw_feed: f64,
    /// Feed with the pen up in mm/min.
    pub travel_feed: f64,
    /// Acceleration in mm/s².
    pub acceleration: f64,
    /// How far a corner may be cut in mm: the junction deviation that sets its speed.
    pub junction_deviation: f64,
    /// Moves that the controller plans together; one where each comes to rest.
    pub lookahead: u32,
}

/// The file as it is written, after inheritance.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    name: String,
    description: String,
    protocol: Protocol,
    baud: u32,
    #[serde(default)]
    flow: Flow,
    travel_mm: Option<[f64; 2]>,
    #[serde(default)]
    origin: Origin,
    #[serde(default)]
    axes: Axes,
    #[serde(default)]
    papers: Vec<Paper>,
    pens: u32,
    draw_feed: f64,
    travel_feed: f64,
    acceleration: f64,
    #[serde(default = "usual_junction_deviation")]
    junction_deviation: f64,
    #[serde(default = "usual_lookahead")]
    lookahead: u32,
    gcode: Option<RawGcode>,
    hpgl: Option<Hpgl>,
}

/// GRBL's, as it is shipped.
fn usual_junction_deviation() -> f64 {
    0.01
}

/// GRBL's.
fn usual_lookahead() -> u32 {
    15
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Protocol {
    Grbl,
    Marlin,
    Hpgl,
}

impl Device {
    /// Reads a profile whose `inherits` has been resolved; `sources` are what it was resolved from.
    ///
    /// # Errors
    /// [`DeviceError::Profile`] with the key that is unknown, missing, or out of range.
    pub(super) fn from_table(table: toml::Table, sources: &Sources) -> Result<Self, DeviceError> {
        let raw: Raw = serde_path_to_error::deserialize(toml::Value::Table(table))
            .map_err(|e| sources.fault(&e.path().to_string(), &format!("is wrong: {}", e.inner().message())))?;
        raw.checked().map_err(|Wrong { key, problem }| sources.fault(&key, &problem))
    }
}

impl Raw {
    fn checked(self) -> Result<Device, Wrong> {
        let language = match (self.protocol, self.gcode, self.hpgl) {
            (Protocol::Grbl, Some(gcode), None) => Language::Grbl(gcode.checked(false)?),
            (Protocol::Marlin, Some(gcode), None) => Language::Marlin(gcode.checked(true)?),
            (Protocol::Hpgl, None, Some(hpgl)) => Language::Hpgl(hpgl),
            (Protocol::Grbl | Protocol::Marlin, ..) => {
                return Err(wrong("protocol", "is of G-code: it wants a table [gcode] and no table [hpgl]"));
            }
            (Protocol::Hpgl, ..) => {
                return Err(wrong("protocol", "is `hpgl`: it wants a table [hpgl] and no table [gcode]"));
            }
        };
        nonzero("baud", self.baud as usize)?;
        nonzero("pens", self.pens as usize)?;
        positive("draw_feed", self.draw_feed)?;
        positive("travel_feed", self.travel_feed)?;
        positive("acceleration", self.acceleration)?;
        if !(self.junction_deviation >= 0.0 && self.junction_deviation.is_finite()) {
            return Err(wrong("junction_deviation", "must be a length in mm, 0 or more"));
        }
        nonzero("lookahead", self.lookahead as usize)?;
        for length in self.travel_mm.into_iter().flatten() {
            positive("travel_mm", length)?;
        }
        for (index, paper) in self.papers.iter().enumerate() {
            paper.check(index)?;
        }
        match &language {
            Language::Grbl(_) | Language::Marlin(_) => {
                if self.travel_mm.is_none() {
                    return Err(wrong("travel_mm", "is missing"));
                }
                if !self.papers.is_empty() {
                    return Err(wrong("papers", "is for HPGL plotters; a G-code machine has `travel_mm`"));
                }
            }
            Language::Hpgl(hpgl) => {
                positive("hpgl.unit_mm", hpgl.unit_mm)?;
                nonzero("hpgl.list_points", hpgl.list_points)?;
                if hpgl.buffer_bytes < 32 {
                    return Err(wrong("hpgl.buffer_bytes", "must be at least 32"));
                }
                for (key, text) in [("start", &hpgl.start), ("end", &hpgl.end), ("pen_change", &hpgl.pen_change)] {
                    template::check(&format!("hpgl.{key}"), text, false)?;
                }
                for (key, seconds) in [("hpgl.lift_s", hpgl.lift_s), ("hpgl.change_s", hpgl.change_s)] {
                    if !(seconds >= 0.0 && seconds.is_finite()) {
                        return Err(wrong(key, "must be a time in s, 0 or more"));
                    }
                }
                nonzero("hpgl.speed_max", hpgl.speed_max.map_or(1, |speed| speed as usize))?;
                nonzero("hpgl.force_max", hpgl.force_max.map_or(1, |force| force as usize))?;
                if self.axes != Axes::default() {
                    return Err(wrong("axes", "is for G-code machines; the ranges of `papers` say how HPGL lies"));
                }
                if self.papers.is_empty() {
                    return Err(wrong("papers", "is missing; an HPGL plotter has at least one"));
                }
            }
        }
        Ok(Device {
            name: self.name,
            description: self.description,
            language,
            baud: self.baud,
            flow: self.flow,
            travel_mm: self.travel_mm,
            origin: self.origin,
            axes: self.axes,
            papers: self.papers,
            pens: self.pens,
            draw_feed: self.draw_feed,
            travel_feed: self.travel_feed,
            acceleration: self.acceleration,
            junction_deviation: self.junction_deviation,
            lookahead: self.lookahead,
        })
    }
}

impl Paper {
    fn check(&self, index: usize) -> Result<(), Wrong> {
        let key = |name: &str| format!("papers[{index}].{name}");
        for length in self.size_mm {
            positive(&key("size_mm"), length)?;
        }
        for (name, range) in [("x_range", self.x_range), ("y_range", self.y_range)] {
            if range[0] >= range[1] {
                return Err(wrong(&key(name), format!("is {range:?}, which is empty")));
            }
        }
        if !self.origin_mm.iter().all(|at| at.is_finite()) {
            return Err(wrong(&key("origin_mm"), "is not finite"));
        }
        Ok(())
    }
}
