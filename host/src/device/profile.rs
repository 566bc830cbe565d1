//! What a profile file may say, and the checked profile made from it.

use serde::Deserialize;

use super::DeviceError;
use crate::message::one_line;

/// The language a plotter speaks, with what is particular to it.
#[derive(Clone, Debug, PartialEq)]
pub enum Language {
    /// G-code with GRBL's line protocol.
    Grbl(Gcode),
    /// HPGL.
    Hpgl(Hpgl),
}

impl Language {
    /// The word for it in profiles.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Grbl(_) => "grbl",
            Self::Hpgl(_) => "hpgl",
        }
    }
}

/// How a G-code machine lifts its pen.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
#[non_exhaustive]
pub enum Pen {
    /// A servo on the spindle output: `M3 S…`, then a dwell while it turns.
    Servo {
        /// S value with the pen up.
        up: u32,
        /// S value with the pen down.
        down: u32,
        /// Time in s that raising takes.
        raise_s: f64,
        /// Time in s that lowering takes.
        lower_s: f64,
    },
    /// The Z axis.
    Z {
        /// Height in mm with the pen up.
        up_mm: f64,
        /// Height in mm with the pen down.
        down_mm: f64,
        /// Feed of the Z moves in mm/min.
        feed: f64,
    },
}

/// What is particular to a G-code machine.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Gcode {
    /// How the pen is lifted.
    pub pen: Pen,
    /// Longest line in characters, without its end. GRBL 1.1: 79.
    pub line_limit: usize,
    /// Size of the controller's receive buffer in bytes, when the controller does not tell. GRBL 1.1: 128.
    pub rx_bytes: usize,
    /// Lines before the drawing.
    pub start: Vec<String>,
    /// Lines after the drawing; the pen is up and back at the origin by then.
    pub end: Vec<String>,
    /// Lines that have the pen changed; `{pen}` stands for its number. The pen is up by then.
    pub pen_change: Vec<String>,
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
    /// Instructions before the drawing.
    pub start: String,
    /// Instructions after the drawing.
    pub end: String,
    /// Instructions that take a pen; `{pen}` stands for its number.
    pub pen_change: String,
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
    papers: Vec<Paper>,
    pens: u32,
    draw_feed: f64,
    travel_feed: f64,
    acceleration: f64,
    gcode: Option<Gcode>,
    hpgl: Option<Hpgl>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Protocol {
    Grbl,
    Hpgl,
}

impl Device {
    /// Reads a profile whose `inherits` has been resolved. `file` is for the message.
    ///
    /// # Errors
    /// [`DeviceError::Profile`] with the key that is unknown, missing, or out of range.
    pub(super) fn from_table(table: toml::Table, file: &str) -> Result<Self, DeviceError> {
        let bad = |what: String| DeviceError::Profile { file: file.to_owned(), what };
        let raw: Raw = table.try_into().map_err(|e: toml::de::Error| bad(one_line(&e.to_string())))?;
        let language = match (raw.protocol, raw.gcode, raw.hpgl) {
            (Protocol::Grbl, Some(gcode), None) => Language::Grbl(gcode),
            (Protocol::Hpgl, None, Some(hpgl)) => Language::Hpgl(hpgl),
            (Protocol::Grbl, ..) => {
                return Err(bad("protocol `grbl` wants a table [gcode] and no table [hpgl]".into()));
            }
            (Protocol::Hpgl, ..) => {
                return Err(bad("protocol `hpgl` wants a table [hpgl] and no table [gcode]".into()));
            }
        };
        let device = Self {
            name: raw.name,
            description: raw.description,
            language,
            baud: raw.baud,
            flow: raw.flow,
            travel_mm: raw.travel_mm,
            origin: raw.origin,
            papers: raw.papers,
            pens: raw.pens,
            draw_feed: raw.draw_feed,
            travel_feed: raw.travel_feed,
            acceleration: raw.acceleration,
        };
        match device.fault() {
            None => Ok(device),
            Some(what) => Err(bad(what)),
        }
    }

    /// The first value that is out of range, in words.
    fn fault(&self) -> Option<String> {
        let positive = |key: &str, value: f64| {
            (!(value.is_finite() && value > 0.0)).then(|| format!("`{key}` is {value}; it must be a positive number"))
        };
        let nonzero = |key: &str, value: usize| (value == 0).then(|| format!("`{key}` is 0; it must be at least 1"));
        let mut faults = vec![
            nonzero("baud", self.baud as usize),
            nonzero("pens", self.pens as usize),
            positive("draw_feed", self.draw_feed),
            positive("travel_feed", self.travel_feed),
            positive("acceleration", self.acceleration),
        ];
        for length in self.travel_mm.into_iter().flatten() {
            faults.push(positive("travel_mm", length));
        }
        for paper in &self.papers {
            for length in paper.size_mm {
                faults.push(positive("papers.size_mm", length));
            }
            for range in [paper.x_range, paper.y_range] {
                faults.push(
                    (range[0] >= range[1]).then(|| format!("paper `{}`: the range {range:?} is empty", paper.name)),
                );
            }
            let [x, y] = paper.origin_mm;
            faults.push(
                (!(x.is_finite() && y.is_finite()))
                    .then(|| format!("paper `{}`: `origin_mm` is not finite", paper.name)),
            );
        }
        match &self.language {
            Language::Grbl(gcode) => {
                if self.travel_mm.is_none() {
                    faults.push(Some("`travel_mm` is missing".into()));
                }
                if !self.papers.is_empty() {
                    faults.push(Some("`papers` is for HPGL plotters; a G-code machine has `travel_mm`".into()));
                }
                faults.push(nonzero("gcode.line_limit", gcode.line_limit));
                // A buffer must hold one line with its end, and one byte of it stays free.
                faults
                    .push((gcode.rx_bytes < gcode.line_limit + 2).then(|| {
                        format!("`gcode.rx_bytes` must be at least {}, to hold a line", gcode.line_limit + 2)
                    }));
                match gcode.pen {
                    Pen::Servo { raise_s, lower_s, up, down } => {
                        for (key, seconds) in [("gcode.pen.raise_s", raise_s), ("gcode.pen.lower_s", lower_s)] {
                            faults.push(positive(key, seconds));
                        }
                        faults.push((up == down).then(|| "`gcode.pen`: up and down are the same".into()));
                    }
                    Pen::Z { up_mm, down_mm, feed } => {
                        faults.push(positive("gcode.pen.feed", feed));
                        faults.push(
                            (!(up_mm.is_finite() && down_mm.is_finite() && up_mm > down_mm))
                                .then(|| "`gcode.pen`: up_mm must be above down_mm".into()),
                        );
                    }
                }
            }
            Language::Hpgl(hpgl) => {
                faults.push(positive("hpgl.unit_mm", hpgl.unit_mm));
                faults.push(nonzero("hpgl.list_points", hpgl.list_points));
                faults.push((hpgl.buffer_bytes < 32).then(|| "`hpgl.buffer_bytes` must be at least 32".into()));
                if self.papers.is_empty() {
                    faults.push(Some("`papers` is missing; an HPGL plotter has at least one".into()));
                }
            }
        }
        faults.into_iter().flatten().next()
    }
}
