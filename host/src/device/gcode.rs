//! What is particular to machines that take G-code: the dialect, and how the pen is moved.

use serde::Deserialize;

use super::template;
use crate::emit::decimal;

/// Decimals of heights in mm and of dwells in s.
const DECIMALS: usize = 3;

/// Whose G-code it is. The words for strokes are the same in all; what is around them differs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Dialect {
    /// GRBL 1.1.
    Grbl,
    /// grblHAL.
    GrblHal,
    /// FluidNC.
    FluidNc,
    /// Marlin 2.
    Marlin,
}

/// How far chords are from an arc in mm for GRBL as it is shipped ($12).
pub const ARC_TOLERANCE_MM: f64 = 0.002;

impl Dialect {
    /// The word for it in profiles.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Grbl => "grbl",
            Self::GrblHal => "grblhal",
            Self::FluidNc => "fluidnc",
            Self::Marlin => "marlin",
        }
    }

    /// How far the chords by which the controller draws lie inside an arc of `radius` mm, mm, at most: GRBL's arc tolerance as it is
    /// shipped ($12), and for Marlin 72 chords a turn that are 0.1 to 1 mm long (MIN_CIRCLE_SEGMENTS, MIN_ARC_SEGMENT_MM and MAX_ARC_SEGMENT_MM
    /// of its Configuration_adv.h).
    #[must_use]
    pub fn inside_of_arc(self, radius: f64) -> f64 {
        match self {
            Self::Marlin => {
                let chord = (radius * std::f64::consts::TAU / 72.0).clamp(0.1, 1.0).min(2.0 * radius);
                radius - (radius * radius - chord * chord / 4.0).max(0.0).sqrt()
            }
            _ => ARC_TOLERANCE_MM,
        }
    }

    /// The line that waits for so many seconds: `G4 P` counts seconds, and milliseconds on Marlin.
    #[must_use]
    pub fn dwell(self, seconds: f64) -> String {
        match self {
            Self::Marlin => format!("G4 P{}", decimal(seconds * 1000.0, 0)),
            _ => format!("G4 P{}", decimal(seconds, DECIMALS)),
        }
    }
}

/// How lines go to a controller of the GRBL kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Streaming {
    /// As many as its receive buffer holds.
    #[default]
    CharacterCounting,
    /// Each when the one before it is answered: slower, for controllers whose buffer cannot be relied on.
    SendResponse,
}

/// How a G-code machine lifts its pen.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Pen {
    /// A servo: `M3 S…` on the spindle output, or `M280` on Marlin, then a dwell while it turns.
    Servo {
        /// Number of the servo on Marlin, `M280 P…`.
        index: u32,
        /// S value with the pen up.
        up: u32,
        /// S value with the pen down.
        down: u32,
        /// Time in s that raising takes.
        raise_s: f64,
        /// Time in s that lowering takes, all steps together.
        lower_s: f64,
        /// Steps in which the pen comes down, from 1: the more, the softer it lands.
        soft_steps: u32,
    },
    /// The Z axis.
    Z {
        /// Height in mm with the pen up.
        up_mm: f64,
        /// Height in mm with the pen down.
        down_mm: f64,
        /// Feed of the Z moves in mm/min.
        feed: f64,
        /// Last part of the way down, in mm, that goes at `soft_feed`. 0: none of it.
        soft_mm: f64,
        /// Feed of that part in mm/min.
        soft_feed: f64,
    },
}

/// What is particular to a G-code machine.
#[derive(Clone, Debug, PartialEq)]
pub struct Gcode {
    /// Whose G-code it is.
    pub dialect: Dialect,
    /// How lines go to it. Marlin has a way of its own.
    pub streaming: Streaming,
    /// How the pen is lifted.
    pub pen: Pen,
    /// Longest line in characters, without its end, and on Marlin without number and checksum. GRBL 1.1: 79.
    pub line_limit: usize,
    /// Size of the controller's receive buffer in bytes, when the controller does not tell. GRBL 1.1: 128.
    pub rx_bytes: usize,
    /// Lines that the controller holds before it carries them out, when it does not tell: `BUFSIZE` of Marlin. GRBL counts bytes only.
    pub buffer_lines: usize,
    /// Whether it draws arcs (G2 and G3 with I and J).
    pub arcs: bool,
    /// Lines that home the machine; none where it has no switches.
    pub home: Vec<String>,
    /// Lines before the drawing.
    pub start: Vec<String>,
    /// Lines after the drawing; the pen is up and back at the origin by then.
    pub end: Vec<String>,
    /// Lines that have the pen changed; `{pen}` stands for its number. The pen is up by then.
    pub pen_change: Vec<String>,
}

impl Gcode {
    /// Lines that raise the pen and end when it is up.
    #[must_use]
    pub fn pen_up(&self) -> Vec<String> {
        match self.pen {
            Pen::Servo { index, up, raise_s, .. } => self.servo(index, [up], raise_s),
            Pen::Z { up_mm, feed, .. } => vec![z(up_mm, feed)],
        }
    }

    /// Lines that lower the pen and end when it is down.
    #[must_use]
    pub fn pen_down(&self) -> Vec<String> {
        match self.pen {
            Pen::Servo { index, up, down, lower_s, soft_steps, .. } => {
                let (up, down, steps) = (i64::from(up), i64::from(down), i64::from(soft_steps.max(1)));
                // Between two numbers of 32 bits.
                let levels = (1..=steps).map(|k| (up + (down - up) * k / steps) as u32);
                self.servo(index, levels, lower_s / steps as f64)
            }
            Pen::Z { down_mm, feed, soft_mm, soft_feed, .. } if soft_mm > 0.0 => {
                vec![z(down_mm + soft_mm, feed), z(down_mm, soft_feed)]
            }
            Pen::Z { down_mm, feed, .. } => vec![z(down_mm, feed)],
        }
    }

    /// The lines of a servo that goes through some levels, and rests `dwell_s` at each.
    fn servo(&self, index: u32, levels: impl IntoIterator<Item = u32>, dwell_s: f64) -> Vec<String> {
        let mut lines = Vec::new();
        // M280 turns the servo while moves before it are still under way.
        if self.dialect == Dialect::Marlin {
            lines.push("M400".to_owned());
        }
        for level in levels {
            lines.push(match self.dialect {
                Dialect::Marlin => format!("M280 P{index} S{level}"),
                _ => format!("M3 S{level}"),
            });
            lines.push(self.dialect.dwell(dwell_s));
        }
        lines
    }
}

fn z(height_mm: f64, feed: f64) -> String {
    format!("G1 Z{} F{}", decimal(height_mm, DECIMALS), decimal(feed, 1))
}

/// The table `[gcode.pen]` as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPen {
    kind: Kind,
    index: Option<u32>,
    up: Option<u32>,
    down: Option<u32>,
    raise_s: Option<f64>,
    lower_s: Option<f64>,
    soft_steps: Option<u32>,
    up_mm: Option<f64>,
    down_mm: Option<f64>,
    feed: Option<f64>,
    soft_mm: Option<f64>,
    soft_feed: Option<f64>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Kind {
    Servo,
    Z,
}

/// The table `[gcode]` as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawGcode {
    dialect: Option<Dialect>,
    #[serde(default)]
    streaming: Streaming,
    pen: RawPen,
    line_limit: usize,
    rx_bytes: usize,
    buffer_lines: Option<usize>,
    arcs: Option<bool>,
    #[serde(default)]
    home: Vec<String>,
    start: Vec<String>,
    end: Vec<String>,
    pen_change: Vec<String>,
}

/// A value of a profile that cannot be: its key, and what is wrong with it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Wrong {
    /// The key from the top of the file on, with dots.
    pub(super) key: String,
    /// What is wrong, as a sentence goes on after the key.
    pub(super) problem: String,
}

/// `key` is wrong.
pub(super) fn wrong(key: &str, problem: impl Into<String>) -> Wrong {
    Wrong { key: key.to_owned(), problem: problem.into() }
}

/// A number above zero.
pub(super) fn positive(key: &str, value: f64) -> Result<(), Wrong> {
    if value.is_finite() && value > 0.0 {
        Ok(())
    } else {
        Err(wrong(key, format!("is {value}; it must be a positive number")))
    }
}

/// A number of something of which there is at least one.
pub(super) fn nonzero(key: &str, value: usize) -> Result<(), Wrong> {
    if value > 0 { Ok(()) } else { Err(wrong(key, "is 0; it must be at least 1")) }
}

/// Most steps of a soft landing: a stroke should not begin with a page of lines.
const SOFT_STEPS_MAX: u32 = 50;

impl RawPen {
    fn checked(self, dialect: Dialect) -> Result<Pen, Wrong> {
        let key = |name: &str| format!("gcode.pen.{name}");
        let (servo, z) = (
            [
                ("index", self.index.is_some()),
                ("up", self.up.is_some()),
                ("down", self.down.is_some()),
                ("raise_s", self.raise_s.is_some()),
                ("lower_s", self.lower_s.is_some()),
                ("soft_steps", self.soft_steps.is_some()),
            ],
            [
                ("up_mm", self.up_mm.is_some()),
                ("down_mm", self.down_mm.is_some()),
                ("feed", self.feed.is_some()),
                ("soft_mm", self.soft_mm.is_some()),
                ("soft_feed", self.soft_feed.is_some()),
            ],
        );
        let (others, kind) = match self.kind {
            Kind::Servo => (&z[..], "servo"),
            Kind::Z => (&servo[..], "z"),
        };
        if let Some((name, _)) = others.iter().find(|(_, given)| *given) {
            return Err(wrong(&key(name), format!("is no key of a pen of the kind `{kind}`")));
        }
        let missing = |name: &str| wrong(&key(name), "is missing");
        let pen = match self.kind {
            Kind::Servo => {
                let pen = Pen::Servo {
                    index: self.index.unwrap_or(0),
                    up: self.up.ok_or_else(|| missing("up"))?,
                    down: self.down.ok_or_else(|| missing("down"))?,
                    raise_s: self.raise_s.ok_or_else(|| missing("raise_s"))?,
                    lower_s: self.lower_s.ok_or_else(|| missing("lower_s"))?,
                    soft_steps: self.soft_steps.unwrap_or(1),
                };
                if self.index.is_some() && dialect != Dialect::Marlin {
                    return Err(wrong(&key("index"), "numbers the servos of Marlin, and this is not Marlin"));
                }
                pen
            }
            Kind::Z => {
                let feed = self.feed.ok_or_else(|| missing("feed"))?;
                Pen::Z {
                    up_mm: self.up_mm.ok_or_else(|| missing("up_mm"))?,
                    down_mm: self.down_mm.ok_or_else(|| missing("down_mm"))?,
                    feed,
                    soft_mm: self.soft_mm.unwrap_or(0.0),
                    soft_feed: self.soft_feed.unwrap_or(feed),
                }
            }
        };
        match pen {
            Pen::Servo { up, down, raise_s, lower_s, soft_steps, .. } => {
                positive(&key("raise_s"), raise_s)?;
                positive(&key("lower_s"), lower_s)?;
                if up == down {
                    return Err(wrong(&key("down"), "is the same as `up`"));
                }
                if !(1..=SOFT_STEPS_MAX).contains(&soft_steps) {
                    return Err(wrong(
                        &key("soft_steps"),
                        format!("is {soft_steps}; 1 to {SOFT_STEPS_MAX} make sense"),
                    ));
                }
            }
            Pen::Z { up_mm, down_mm, feed, soft_mm, soft_feed } => {
                positive(&key("feed"), feed)?;
                positive(&key("soft_feed"), soft_feed)?;
                if !(up_mm.is_finite() && down_mm.is_finite() && up_mm > down_mm) {
                    return Err(wrong(&key("up_mm"), format!("is {up_mm}; it must be above down_mm, {down_mm}")));
                }
                if !(0.0..=up_mm - down_mm).contains(&soft_mm) {
                    return Err(wrong(&key("soft_mm"), format!("is {soft_mm}; it must be a part of the way down")));
                }
            }
        }
        Ok(pen)
    }
}

impl RawGcode {
    /// The checked table. `marlin` is whether the protocol is Marlin's.
    pub(super) fn checked(self, marlin: bool) -> Result<Gcode, Wrong> {
        let dialect = match (self.dialect, marlin) {
            (None, false) => Dialect::Grbl,
            (None | Some(Dialect::Marlin), true) => Dialect::Marlin,
            (Some(dialect), false) if dialect != Dialect::Marlin => dialect,
            (Some(dialect), _) => {
                let protocol = if marlin { "marlin" } else { "grbl" };
                return Err(wrong(
                    "gcode.dialect",
                    format!("is `{}`, which protocol `{protocol}` does not go with", dialect.name()),
                ));
            }
        };
        nonzero("gcode.line_limit", self.line_limit)?;
        // A buffer must hold one line with its end, and one byte of it stays free.
        let least = self.line_limit.saturating_add(2);
        if self.rx_bytes < least {
            return Err(wrong("gcode.rx_bytes", format!("must be at least {least}, to hold a line")));
        }
        let buffer_lines = self.buffer_lines.unwrap_or(1);
        nonzero("gcode.buffer_lines", buffer_lines)?;
        let lists =
            [("home", &self.home), ("start", &self.start), ("end", &self.end), ("pen_change", &self.pen_change)];
        for (name, lines) in lists {
            for (index, line) in lines.iter().enumerate() {
                template::check(&format!("gcode.{name}[{index}]"), line, true)?;
            }
        }
        Ok(Gcode {
            dialect,
            streaming: self.streaming,
            pen: self.pen.checked(dialect)?,
            line_limit: self.line_limit,
            rx_bytes: self.rx_bytes,
            buffer_lines,
            // All of these controllers do, unless they are built without.
            arcs: self.arcs.unwrap_or(true),
            home: self.home,
            start: self.start,
            end: self.end,
            pen_change: self.pen_change,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Language, find};
    use super::*;

    fn gcode(name: &str) -> Gcode {
        match find(name).unwrap().language {
            Language::Grbl(gcode) | Language::Marlin(gcode) => gcode,
            Language::Hpgl(_) => panic!("{name} speaks HPGL"),
        }
    }

    #[test]
    fn pens_move_in_the_words_of_their_dialect() {
        let servo = |soft_steps| Pen::Servo { index: 2, up: 90, down: 30, raise_s: 0.15, lower_s: 0.3, soft_steps };
        let z = |soft_mm| Pen::Z { up_mm: 3.0, down_mm: -0.5, feed: 1000.0, soft_mm, soft_feed: 150.0 };
        let table: &[(Dialect, Pen, &[&str], &[&str])] = &[
            (Dialect::Grbl, servo(1), &["M3 S90", "G4 P0.15"], &["M3 S30", "G4 P0.3"]),
            (
                Dialect::FluidNc,
                servo(3),
                &["M3 S90", "G4 P0.15"],
                &["M3 S70", "G4 P0.1", "M3 S50", "G4 P0.1", "M3 S30", "G4 P0.1"],
            ),
            (Dialect::Marlin, servo(1), &["M400", "M280 P2 S90", "G4 P150"], &["M400", "M280 P2 S30", "G4 P300"]),
            (
                Dialect::Marlin,
                servo(2),
                &["M400", "M280 P2 S90", "G4 P150"],
                &["M400", "M280 P2 S60", "G4 P150", "M280 P2 S30", "G4 P150"],
            ),
            (Dialect::GrblHal, z(0.0), &["G1 Z3 F1000"], &["G1 Z-0.5 F1000"]),
            (Dialect::Marlin, z(0.75), &["G1 Z3 F1000"], &["G1 Z0.25 F1000", "G1 Z-0.5 F150"]),
        ];
        for (dialect, pen, up, down) in table {
            let machine = Gcode { dialect: *dialect, pen: *pen, ..gcode("grbl-servo") };
            assert_eq!(machine.pen_up(), *up, "{dialect:?} {pen:?}");
            assert_eq!(machine.pen_down(), *down, "{dialect:?} {pen:?}");
        }
    }

    #[test]
    fn the_dialect_follows_the_protocol() {
        assert_eq!(gcode("grbl-servo").dialect, Dialect::Grbl);
        assert_eq!(gcode("marlin-servo").dialect, Dialect::Marlin);
        assert_eq!(gcode("marlin-servo").buffer_lines, 4);
    }
}
